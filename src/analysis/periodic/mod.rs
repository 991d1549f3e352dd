//! The periodic steady state: the orbit that transients go to, without waiting for it.

mod attempt;
mod large;
mod multipliers;
mod period;
mod rest;
mod rows;
mod search;
mod settled;
mod shooting;
#[cfg(test)]
mod tests;

use std::sync::atomic::AtomicBool;

use super::variation::{Course, Linearised, Trajectory};
use crate::circuit::{Circuit, Element, Kind, Source, Tran};
use crate::integrate::exact::Corners;
use crate::integrate::{Error, Note, Orbit, OrbitKind, Reason, Run, Simulation, Standing};
use crate::mna::{StaticMultiport, behaviour};
use crate::model::Model;
use crate::settings::Settings;
use crate::settings::tolerances::periodic::{
    CLOSED, FINER, MOST_LINEARISED, PARTS_OF_PERIOD, PERIOD_OFF, STEPPED_CLOSED,
};

use attempt::{By, Pace, refined, searched, simulation};
pub(super) use large::Large;
use multipliers::{growth, is_dissipative};
use rows::{Steps, closing_error, next_to_nothing, notes};
use search::{Found, Search};
pub(super) use settled::{Settled, settled, settled_large, settled_linear};

/// What a periodic steady state may be asked for.
#[derive(Debug, Clone, Default)]
pub struct PeriodicOptions<'a> {
    /// The period, s, in place of the common one of the sources.
    pub period: Option<f64>,
    /// Periods of the sources (returns, where there are none) after which the orbit closes; by default 1, or that of the stable orbit which the
    /// transient goes to.
    pub order: Option<usize>,
    /// The largest residual relative to the amplitudes; by default 1e-9, of runs in steps 1e-6.
    pub tol: Option<f64>,
    /// Rows at events too.
    pub events: bool,
    /// Rows at events and at corners of sources too.
    pub corners: bool,
    /// Ends the search when set.
    pub cancel: Option<&'a AtomicBool>,
    /// Tolerances of the runs.
    pub settings: Settings,
}

/// The periodic steady state of a circuit, and its waveforms over one period from 0 on.
///
/// With sources that vary the period is their least common one; without, an event that happens once a period closes the orbit, or the circuit
/// is at rest. Sources that do not repeat stay at their values at 0⁻. A stable orbit is preferred: where the one of one period is not, the
/// order of the one that the transient goes to.
///
/// Where sources drive a circuit of [`Settings::large`] capacitors, inductors and ideal pairs or more, with devices that are ideal pairs and switches that follow sources alone, the orbit is found in steps on
/// matrices without their zeros, by Newton's method with GMRES (docs/decisions/0015-orbits-by-products.md): of the multipliers the leading ones are given, and no order but the one asked for is looked for.
///
/// # Errors
/// [`Reason::NoOrbit`] where none was found, with what was seen; else as [`Model::transient`].
///
/// # Example
/// A capacitor is charged and discharged over 1 kΩ in turn: it swings between 5 V ∓ 5 V tanh ¼.
/// ```
/// use circ::analysis::{PeriodicOptions, periodic};
///
/// let text = "rc\nv1 1 0 pulse(0 10 0 0 0 0.5m 1m)\nr1 1 2 1k\nc1 2 0 1u\n.tran 10u 1m\n.end\n";
/// let model = circ::Model::parse(text, "rc.cir")?;
/// let (orbit, run) = periodic(&model, &PeriodicOptions::default())?;
/// let least = 5.0 * (1.0 - 0.25_f64.tanh());
/// assert!((run.waveforms.values[1] - least).abs() < 1e-12 && orbit.stable);
/// assert!((orbit.multipliers[0][0] - (-1.0_f64).exp()).abs() < 1e-6);
/// # Ok::<(), circ::Error>(())
/// ```
pub fn periodic(model: &Model, options: &PeriodicOptions<'_>) -> Result<(Orbit, Run), Error> {
    settled(model, options)?.on_grid(options, |tran| tran)
}

/// The orbit of [`periodic`], and where a transient begins that starts on it at t = 0, with sources that do not repeat running from there on; those that do have done so for ever.
///
/// # Errors
/// As [`periodic`].
pub fn orbit_start(
    model: &Model,
    options: &PeriodicOptions<'_>,
) -> Result<(Orbit, Standing), Error> {
    let mut settled = settled(model, options)?;
    let standing = settled.standing()?;
    let (off, notes) = settled.of_start();
    let begins = Standing {
        t: 0.0,
        begun: standing.t,
        off,
        notes,
        ..standing
    };
    Ok((settled.orbit(), begins))
}

/// A circuit in its periodic steady state.
pub(super) struct Steady {
    pub(super) circuit: Circuit,
    multiport: StaticMultiport,
    /// Sources that do not repeat.
    pub(super) held: Vec<String>,
    /// What is to be told of the period.
    said: Vec<Note>,
    pub(super) simulation: Simulation,
    /// What it was found by.
    by: By,
    found: Found,
    /// How far orbits of longer and shorter steps are apart, relative to the amplitudes.
    pub(super) apart: Option<f64>,
}

impl Steady {
    /// The orbit.
    pub(super) fn orbit(&self) -> Orbit {
        self.found.orbit()
    }

    /// The orbit, and one period of it on the grid that `grid` makes of that of the period.
    pub(super) fn on_grid(
        mut self,
        options: &PeriodicOptions<'_>,
        grid: impl FnOnce(Tran) -> Tran,
    ) -> Result<(Orbit, Run), Error> {
        let (standing, off) = (self.standing()?, self.off());
        let begin = standing.state.clone();
        let Self {
            circuit,
            multiport,
            held,
            said,
            simulation,
            by,
            found,
            ..
        } = self;
        let (names, orbit) = (simulation.state_names(), found.orbit());
        // Nothing moves, or what leakage and rounding leave does: an error control would look for its digits.
        let still = found.rests || orbit.kind == OrbitKind::Equilibrium && !simulation.is_exact();
        let steps = Steps {
            method: by.method,
            step: still.then_some(FINER * orbit.period / PARTS_OF_PERIOD),
            unestimated: found.rests,
        };
        let mut run = rows::rows(
            (&circuit, &multiport, Some(&simulation)),
            standing,
            (orbit.period, steps),
            options,
            grid,
        )?;
        if simulation.is_exact() {
            closing_error(&mut run, &begin, &found.amplitudes);
        } else {
            run.error.begins_off(off);
            if found.rests {
                run.balanced = false;
                run.notes.push(next_to_nothing());
            }
        }
        run.notes.extend(said);
        run.notes.extend(notes(&orbit, &found.fixed, names, &held));
        Ok((orbit, run))
    }

    /// How far the orbit may be off, relative to the amplitudes.
    fn off(&self) -> f64 {
        let open = self.found.fixed.residual;
        let open = if open > CLOSED { open } else { 0.0 };
        self.apart.unwrap_or(f64::INFINITY).max(open)
    }

    /// What of it concerns what begins on it.
    fn notes_of_start(&self) -> Vec<Note> {
        let (orbit, names) = (self.orbit(), self.simulation.state_names());
        let own = rows::of_start(&orbit, &self.found.fixed, names);
        self.said.iter().cloned().chain(own).collect()
    }

    /// Where the orbit begins, with what conducts there.
    fn standing(&mut self) -> Result<Standing, Error> {
        let (stand, from) = (&self.found.fixed.stand, self.found.from);
        self.simulation
            .stand_at(from, &stand.state, &stand.switches)?;
        Ok(Standing {
            t: from,
            state: stand.state.clone(),
            switches: stand.switches.clone(),
            conducting: self.simulation.conducting(),
            ..Standing::default()
        })
    }

    /// Whether it is exact throughout.
    ///
    /// # Errors
    /// The simulation's.
    pub(super) fn is_exact(&mut self, cancel: Option<&AtomicBool>) -> Result<bool, Error> {
        let (stand, from) = (&self.found.fixed.stand, self.found.from);
        let place = (from, &stand.state[..], &stand.switches[..]);
        let until = from + self.found.orbit().period;
        let passages = (self.simulation).passages(place, until, Corners::Seen, cancel)?;
        Ok(passages.is_some())
    }

    /// One period of the orbit, and the time at which it begins, s; `None` where steps are made in it.
    ///
    /// # Errors
    /// As [`Course::of`].
    pub(super) fn course(
        &mut self,
        cancel: Option<&AtomicBool>,
    ) -> Result<Option<(Course, f64)>, Error> {
        let (stand, from) = (&self.found.fixed.stand, self.found.from);
        let place = (from, &stand.state[..], &stand.switches[..]);
        let until = from + self.found.orbit().period;
        let course = Course::of(&mut self.simulation, place, until, cancel)?;
        Ok(course.map(|course| (course, from)))
    }

    /// One period of the orbit with what its derivative is made of, and the time from which on rows of the orbit count, s. It begins in the
    /// middle of the longest stretch without an event, so that none stands where it ends and begins. Its events have
    /// derivatives with these sources.
    ///
    /// # Errors
    /// As [`Trajectory::of`].
    pub(super) fn trajectory(
        &mut self,
        sources: &[String],
        cancel: Option<&AtomicBool>,
    ) -> Result<(Trajectory, f64), Error> {
        let (stand, from) = (&self.found.fixed.stand, self.found.from);
        let place = (from, &stand.state[..], &stand.switches[..]);
        let period = self.found.orbit().period;
        let asked = (sources, cancel);
        let whole = Trajectory::of(&mut self.simulation, place, from + period, asked)?;
        let Some(begin) = whole.calmest() else {
            return Ok((whole, from));
        };
        self.simulation
            .stand_at(from, &stand.state, &stand.switches)?;
        self.simulation.advance(begin, false, cancel)?;
        let (state, switches) = (self.simulation.state(), self.simulation.positions());
        let place = (begin, &state[..], &switches[..]);
        let trajectory = whole.again(&mut self.simulation, place, begin + period, asked)?;
        Ok((trajectory, from))
    }

    /// When the orbit begins, s.
    pub(super) const fn from(&self) -> f64 {
        self.found.from
    }

    /// By state: the largest amplitude on the orbit of one of its unit.
    pub(super) fn sizes(&self) -> Vec<f64> {
        let units = self.simulation.state_units();
        let all = units.iter().zip(&self.found.amplitudes);
        let of = |unit| {
            let same = all.clone().filter(|(other, _)| **other == unit);
            same.fold(0.0_f64, |m, (_, size)| m.max(*size))
        };
        units.iter().map(|unit| of(*unit)).collect()
    }

    /// Where the orbit begins if sources are higher by as much as these; `None` where it is not found beside this one, or a source cannot be.
    pub(super) fn beside(
        &self,
        shifts: &[(&str, f64)],
        options: &PeriodicOptions<'_>,
    ) -> Result<Option<Vec<f64>>, Error> {
        let mut circuit = self.circuit.clone();
        for (name, by) in shifts.iter().filter(|(_, by)| *by != 0.0) {
            let id = circuit.element(name);
            let kind = id.map(|id| &mut circuit.elements[id.index()].kind);
            let (Some(Kind::VoltageSource(source)) | Some(Kind::CurrentSource(source))) = kind
            else {
                return Ok(None);
            };
            if !source.raise(*by) {
                return Ok(None);
            }
        }
        let Ok(multiport) = behaviour(&circuit) else {
            return Ok(None);
        };
        let seconds = self.orbit().period / self.orbit().order as f64;
        let mut simulation = simulation(
            (&circuit, &multiport),
            Some(seconds),
            Pace {
                by: self.by,
                finer: true,
                like: Some(&self.simulation),
            },
            options,
        )?;
        let fixed = Search::of(&mut simulation, options).again(&self.found)?;
        Ok(fixed.map(|fixed| fixed.stand.state))
    }

    /// The same of an orbit that is made of steps; `None` of an exact one.
    ///
    /// # Errors
    /// As [`Trajectory::of_steps`].
    pub(super) fn linearised(
        &mut self,
        cancel: Option<&AtomicBool>,
    ) -> Result<Option<(Linearised, f64)>, Error> {
        if self.simulation.is_exact() {
            return Ok(None);
        }
        let (stand, from) = (&self.found.fixed.stand, self.found.from);
        let place = (from, &stand.state[..], &stand.switches[..]);
        let until = from + self.found.orbit().period;
        let found = Trajectory::of_steps(&mut self.simulation, place, until, cancel)?;
        Ok(Some((found, from)))
    }
}

/// The common period of the sources that repeat, s.
pub(super) fn common_period(circuit: &Circuit) -> Option<f64> {
    let (circuit, _) = period::repeating(circuit);
    period::common(&circuit).ok()?.seconds
}

/// The circuit with sources that do not repeat at rest, and the period of the others.
///
/// # Errors
/// It is none.
pub(super) fn repeating(model: &Model) -> Result<(Option<f64>, Circuit, StaticMultiport), Error> {
    let (circuit, _) = period::repeating(model.circuit());
    let seconds = period::common(&circuit)
        .ok()
        .and_then(|period| period.seconds);
    let multiport = ports(model, &circuit)?;
    Ok((seconds, circuit, multiport))
}

/// A circuit with its sources as [`repeating`] has them.
pub(super) fn at_rest(circuit: &Circuit) -> Circuit {
    period::repeating(circuit).0
}

/// The ports of the circuit of a model with sources at rest: its own where none differs.
fn ports(model: &Model, circuit: &Circuit) -> Result<StaticMultiport, Error> {
    let own = model.circuit().elements.iter().map(source);
    if own.eq(circuit.elements.iter().map(source)) {
        return Ok(model.multiport().clone());
    }
    behaviour(circuit).map_err(|_| {
        let what = "a circuit with sources at rest is none";
        Error::before(Reason::internal("analysis::periodic", what))
    })
}

const fn source(element: &Element) -> Option<&Source> {
    match &element.kind {
        Kind::VoltageSource(source) | Kind::CurrentSource(source) => Some(source),
        _ => None,
    }
}

/// A simulation of a circuit near one whose steady state is known.
///
/// # Errors
/// As [`periodic`].
pub(super) fn beside(model: &Model, options: &PeriodicOptions<'_>) -> Result<Simulation, Error> {
    let (seconds, circuit, multiport) = repeating(model)?;
    simulation(
        (&circuit, &multiport),
        seconds,
        Pace::first(By::PLAN),
        options,
    )
}

/// What a search begins with.
struct Asked {
    circuit: Circuit,
    multiport: StaticMultiport,
    period: period::Period,
    /// Sources that do not repeat.
    held: Vec<String>,
    /// What is to be told of the period.
    said: Vec<Note>,
}

fn none(what: String) -> Error {
    Error::before(Reason::NoOrbit(what))
}

/// The circuit that is to repeat, and its period.
///
/// # Errors
/// There is no such period; what is on lines is no part of the state.
fn asked(model: &Model, options: &PeriodicOptions<'_>) -> Result<Asked, Error> {
    let (circuit, held) = period::repeating(model.circuit());
    if let Some(line) = circuit.lines.first() {
        let name = &circuit.elements[line.ports[0].wave.index()].name;
        let what = "what travels on a transmission line is no part of the state that is to repeat; a transient that is long enough ends in it";
        return Err(none(what.into()).device(name));
    }
    let mut period = period::common(&circuit).or_else(|what| match options.period {
        Some(_) => Ok(period::Period::default()),
        None => Err(none(what)),
    })?;
    let mut said = Vec::new();
    if let Some(asked) = options.period {
        if !(asked > 0.0 && asked.is_finite()) {
            return Err(none(format!("{asked} s is no period")));
        }
        if let Some((name, own, part)) = period::off(&circuit, asked) {
            if part > PERIOD_OFF {
                let what = format!(
                    "{name} repeats every {own:e} s, of which the period asked for, {asked:e} s, is no multiple"
                );
                return Err(none(what).device(name));
            }
            if part > CLOSED {
                let text = format!(
                    "{name} is {part:.0e} of its period away from where it began after the period asked for: the orbit is closed as if it were there"
                );
                said.push(Note::of("period-off", [name], text));
            }
        }
        period = period.of(asked);
    }
    let multiport = ports(model, &circuit)?;
    Ok(Asked {
        circuit,
        multiport,
        period,
        held,
        said,
    })
}

/// Finds the periodic steady state with dense matrices, as those need it that ask for its derivative.
///
/// # Errors
/// As [`periodic`].
pub(super) fn steady(model: &Model, options: &PeriodicOptions<'_>) -> Result<Steady, Error> {
    linearised(asked(model, options)?, options)
}

/// Whether an orbit is too large for dense matrices that make it linear.
pub(super) fn beyond_dense(model: &Model) -> bool {
    size(model.multiport()) > MOST_LINEARISED
}

/// Capacitors, inductors and ideal pairs.
fn size(multiport: &StaticMultiport) -> usize {
    multiport.storage.len() + multiport.ideal_pairs()
}

fn linearised(asked: Asked, options: &PeriodicOptions<'_>) -> Result<Steady, Error> {
    let size = size(&asked.multiport);
    if size > MOST_LINEARISED {
        let text = format!(
            "what follows from the derivative of an orbit is found with dense matrices, of {MOST_LINEARISED} capacitors, inductors and ideal pairs at most, and the circuit has {size}: \
             leave out or join what the answer does not depend on, or compare runs of `circ pss` with values a little aside"
        );
        return Err(Error::before(Reason::Unsupported(text)));
    }
    whole(asked, options)
}

fn whole(asked: Asked, options: &PeriodicOptions<'_>) -> Result<Steady, Error> {
    let Asked {
        circuit,
        multiport,
        period,
        held,
        mut said,
    } = asked;
    let parts = (&circuit, &multiport);
    let (by, (mut simulation, mut found)) = searched(parts, &period, options, &mut said)?;
    found.underived = by.equal && !(circuit.is_curved() && found.rests);
    let apart = if simulation.is_exact() {
        Some(0.0)
    } else {
        let coarse = (&mut simulation, &mut found);
        refined(parts, coarse, period.seconds, by, options)?
    };
    let closed = options.tol.unwrap_or(STEPPED_CLOSED);
    if apart.is_none() && found.fixed.residual > closed {
        let residual = found.fixed.residual;
        return Err(none(format!(
            "steps of a tenth of the tolerance close an orbit to {residual:.1e} of its amplitudes, where {closed:e} is asked for, and finer ones none"
        )));
    }
    if !simulation.is_exact()
        && !found.underived
        && let Some(growth) = growth(&found.fixed.derivative)
        && is_dissipative(&circuit)
    {
        let text = format!(
            "disturbances of an orbit of resistances, capacitances, inductances and diodes do not grow; differences of runs in steps say that they do by {growth:.2e} a period, which is their noise: there are no multipliers"
        );
        said.push(Note::run("no-multipliers", text));
        found.underived = true;
    }
    Ok(Steady {
        circuit,
        multiport,
        held,
        said,
        simulation,
        by,
        found,
        apart,
    })
}
