//! Orbits of circuits whose transients are made in steps on matrices without their zeros.

mod newton;

use std::sync::atomic::AtomicBool;

use super::attempt::{from_rest, searching};
use super::shooting::Stand;
use super::{Asked, PeriodicOptions, none, rows};
use crate::circuit::{Circuit, Tran};
use crate::integrate::{
    Error, Lengths, Note, Orbit, OrbitKind, Reason, Returns, Run, Standing, Tape,
};
use crate::linalg::krylov::Ritz;
use crate::mna::StaticMultiport;
use crate::settings::Settings;
use crate::settings::tolerances::periodic::{
    FINER_ORBIT, FINEST_ORBIT, NEUTRAL, ROUNDING_OF_RETURN, STEPPED_CLOSED, TAKES_PART,
};
use newton::{Shooting, Shot};

/// Returns of transient before each attempt.
const TRANSIENTS: [usize; 5] = [2, 16, 64, 256, 1024];

/// The orbit of a large circuit.
pub(in crate::analysis) struct Large {
    circuit: Circuit,
    multiport: StaticMultiport,
    standing: Standing,
    returns: Returns,
    orbit: Orbit,
    /// How far orbits of longer and shorter steps are apart, relative to the amplitudes.
    apart: Option<f64>,
    notes: Vec<Note>,
    /// What was made for it, in words.
    words: String,
    settings: Settings,
}

impl Large {
    /// Of a driven circuit for which steps on matrices without their zeros apply; nothing of another.
    ///
    /// # Errors
    /// As [`periodic`](super::periodic()).
    pub(super) fn of(asked: &Asked, options: &PeriodicOptions<'_>) -> Result<Option<Self>, Error> {
        let Some(period) = asked.period.seconds else {
            return Ok(None);
        };
        let settings = Settings {
            tol: (FINER_ORBIT * options.settings.tol).max(FINEST_ORBIT),
            ..options.settings.clone()
        };
        let Some(returns) = returns(asked, period, &settings)? else {
            return Ok(None);
        };
        let order = options.order.unwrap_or(1).max(1);
        let closed = options.tol.unwrap_or(STEPPED_CLOSED);
        let from = asked.period.from;
        let seconds = order as f64 * period;
        let mut notes = returns.notes().to_vec();
        let mut shooting = Shooting::of(returns, (from, from + seconds), options.cancel);
        let coarse = search(&mut shooting, closed)?;
        let found = shooting.multipliers(&coarse)?;
        let found = found.ok_or_else(|| none("its multipliers are not found".into()))?;
        let names = shooting.returns.names();
        notes.extend(about_multipliers(&found, names));
        let largest = found.first().map_or(0.0, |ritz| ritz.value.norm());
        let fine = shooting.halved(&coarse, closed, largest)?;
        let apart = fine.as_ref().map(|fine| {
            let both = fine.stand.state.iter().zip(&coarse.stand.state);
            let apart = both.zip(&shooting.amplitudes);
            let apart = apart.fold(0.0_f64, |m, ((a, b), size)| m.max((a - b).abs() / size));
            // What is not closed, by rounding at least, counts so much more on the orbit.
            let open = fine.size.max(ROUNDING_OF_RETURN);
            apart.max(open / (1.0 - largest).abs().max(NEUTRAL))
        });
        let shown = fine.unwrap_or(coarse);
        let place = (from, &shown.stand.state[..], &shown.stand.switches[..]);
        let conducting = shooting.returns.conducting(place)?;
        let told = found.iter().take_while(|ritz| ritz.has_converged());
        let told = told.count().max(1);
        let multipliers = found.iter().take(told);
        Ok(Some(Self {
            circuit: asked.circuit.clone(),
            multiport: asked.multiport.clone(),
            orbit: Orbit {
                period: seconds,
                residual: shown.size,
                iterations: shooting.corrections,
                multipliers: multipliers.map(|r| [r.value.re, r.value.im]).collect(),
                stable: largest < 1.0 + NEUTRAL,
                kind: OrbitKind::Driven,
                order,
                section: None,
            },
            standing: Standing {
                t: from,
                state: shown.stand.state,
                switches: shown.stand.switches,
                conducting,
                ..Standing::default()
            },
            apart,
            notes,
            words: format!(
                "orbit by products: {} returns of {} steps, {} products with their derivative",
                shooting.made,
                shooting.steps(),
                shooting.products
            ),
            returns: shooting.returns,
            settings,
        }))
    }

    /// The orbit.
    pub(in crate::analysis) const fn orbit(&self) -> &Orbit {
        &self.orbit
    }

    /// How far orbits of longer and shorter steps are apart, relative to the amplitudes.
    pub(in crate::analysis) const fn apart(&self) -> Option<f64> {
        self.apart
    }

    /// The orbit in steps of at most `longest`, s, and in halves of these where that is asked, as what the circuit makes of small changes; and the longest step.
    ///
    /// # Errors
    /// See [`Reason`].
    pub(in crate::analysis) fn in_steps(
        &mut self,
        longest: f64,
        halved: bool,
        cancel: Option<&AtomicBool>,
    ) -> Result<(Tape, f64), Error> {
        let Standing {
            t, state, switches, ..
        } = &self.standing;
        let (place, until) = ((*t, &state[..], &switches[..]), t + self.orbit.period);
        self.returns.resolve(longest);
        let mut made = self.returns.pass(place, until, Lengths::Free, cancel)?;
        let most = made.steps.iter().fold(0.0_f64, |m, (h, _)| m.max(*h));
        if halved {
            let halves = Lengths::Halves(&made.steps);
            made = self.returns.pass(place, until, halves, cancel)?;
        }
        Ok((made.tape, most))
    }

    /// What makes its returns.
    pub(in crate::analysis) const fn returns(&mut self) -> &mut Returns {
        &mut self.returns
    }

    /// The circuit, its sources that do not repeat at rest.
    pub(in crate::analysis) const fn circuit(&self) -> &Circuit {
        &self.circuit
    }

    /// When it begins, s.
    pub(in crate::analysis) const fn from(&self) -> f64 {
        self.standing.t
    }

    /// Its multiport.
    pub(in crate::analysis) const fn multiport(&self) -> &StaticMultiport {
        &self.multiport
    }

    /// The transient that it was looked for in.
    pub(in crate::analysis) fn searched(&self) -> Tran {
        let tran = searching(self.circuit.tran, self.orbit.period, 1.0);
        Tran { uic: true, ..tran }
    }

    /// How far it may be off, relative to the amplitudes.
    pub(super) fn off(&self) -> f64 {
        self.apart.unwrap_or(f64::INFINITY)
    }

    /// What concerns what begins on it.
    pub(super) fn notes_of_start(&self) -> impl Iterator<Item = Note> + '_ {
        let own = self
            .notes
            .iter()
            .filter(|note| note.code == "orbit-not-unique");
        rows::unstable(&self.orbit).into_iter().chain(own.cloned())
    }

    /// Where it begins.
    pub(in crate::analysis) fn standing(&self) -> Standing {
        self.standing.clone()
    }

    /// The orbit, and one period of it on the grid that `grid` makes of that of the period.
    pub(super) fn on_grid(
        self,
        (held, said): (&[String], Vec<Note>),
        options: &PeriodicOptions<'_>,
        grid: impl FnOnce(Tran) -> Tran,
    ) -> Result<(Orbit, Run), Error> {
        let off = self.off();
        let options = PeriodicOptions {
            settings: self.settings,
            ..options.clone()
        };
        let parts = (&self.circuit, &self.multiport, None);
        let period = self.orbit.period;
        let mut run = rows::rows(
            parts,
            self.standing,
            (period, rows::Steps::default()),
            &options,
            grid,
        )?;
        run.error.begins_off(off);
        run.plan.push(self.words);
        run.notes.extend(said);
        run.notes.extend(rows::held_sources(held));
        run.notes.extend(rows::unstable(&self.orbit));
        for note in self.notes {
            if !run.notes.contains(&note) {
                run.notes.push(note);
            }
        }
        Ok((self.orbit, run))
    }
}

/// The circuit as one that goes through its period again and again.
fn returns(asked: &Asked, period: f64, settings: &Settings) -> Result<Option<Returns>, Error> {
    from_rest(searching(asked.circuit.tran, period, 1.0), |tran| {
        Returns::of(&asked.circuit, &asked.multiport, None, (&tran, settings))
    })
}

/// Finds the orbit: some returns of transient, then corrections, and more of both where these do not close it.
fn search(shooting: &mut Shooting<'_>, closed: f64) -> Result<Shot, Error> {
    let start = shooting.returns.start();
    let mut stand = Stand {
        state: start.state.clone(),
        switches: start.switches.clone(),
    };
    let (from, until) = (shooting.from, shooting.until);
    if from > 0.0 {
        (shooting.from, shooting.until) = (0.0, from);
        stand = shooting.pass(&stand)?;
        (shooting.from, shooting.until) = (from, until);
    }
    let mut last = None;
    for returns in TRANSIENTS {
        for _ in 0..returns {
            stand = shooting.pass(&stand)?;
        }
        match shooting.solve(stand.clone(), closed) {
            Ok(Some(shot)) => return Ok(shot),
            Ok(None) => {}
            Err(error) if error.reason == Reason::Interrupted => return Err(error),
            Err(error) => last = Some(error),
        }
    }
    let returns: usize = TRANSIENTS.iter().sum();
    let seconds = until - from;
    Err(last.unwrap_or_else(|| {
        none(format!(
            "Newton's method by products does not close an orbit of {seconds:e} s (it comes to {:.0e} of the amplitudes, {closed:.0e} is asked for), and {returns} returns of transient do not \
             come to one",
            shooting.least
        ))
    }))
}

/// What the user should know of multipliers, of which the leading ones alone are looked for.
fn about_multipliers(found: &[Ritz], names: &[String]) -> Vec<Note> {
    let mut notes = Vec::new();
    let told = found.iter().take_while(|ritz| ritz.has_converged()).count();
    let text = match (told, found.first()) {
        (0, Some(first)) => format!(
            "multipliers of a large circuit are found by products with its derivative: the largest one is known to {:.0e} only, the other {} are not looked for",
            first.left,
            names.len().saturating_sub(1)
        ),
        _ => format!(
            "multipliers of a large circuit are found by products with its derivative: the leading {told} of {} are given",
            names.len()
        ),
    };
    if told < names.len() {
        notes.push(Note::run("leading-multipliers", text));
    }
    let neutral = found
        .iter()
        .filter(|ritz| ritz.has_converged() && (ritz.value - 1.0).norm() <= NEUTRAL);
    let neutral: Vec<&Ritz> = neutral.collect();
    let taking_part = |j: &usize| neutral.iter().any(|r| r.vector[*j].abs() > TAKES_PART);
    let states = (0..names.len()).filter(taking_part);
    let states: Vec<&str> = states.map(|j| names[j].as_str()).collect();
    if !states.is_empty() {
        let text = format!(
            "the orbit is not unique: {} may be another, as a period leaves them as they are",
            states.join(", "),
        );
        notes.push(Note::run("orbit-not-unique", text));
    }
    notes
}
