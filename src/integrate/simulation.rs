//! A run that its caller drives: from stop to stop, with sources and switches moved in between.
//!
//! The methods, events, jumps and energies are those of [`simulate`](crate::integrate::simulate()); what differs is who asks for the
//! next time. A simulation owns all it needs and may be sent to another thread.

mod passages;
mod stop;
mod way;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use nalgebra::DVector;

pub use self::stop::{Checkpoint, SimulationOptions, Stop, StopReason};
use self::way::{Lap, Way};

use crate::circuit::{Circuit, Source, Tran, held_at, holder};
use crate::integrate::Note;
use crate::integrate::error::{Error, Reason};
use crate::integrate::event::Event;
use crate::integrate::exact::Place;
use crate::integrate::log::Log;
use crate::integrate::note;
use crate::integrate::problem::Problem;
use crate::integrate::rows::Asked;
use crate::integrate::simulate::{Method, check};
use crate::integrate::stats::{Impulse, Run, StateJumps, Stats};
use crate::lcs::Lcs;
use crate::mna::{StaticMultiport, behaviour};
use crate::settings::tolerances::times::SPAN_PARTS;
use crate::waveform::canonical_name;

/// A circuit in the course of a transient. It stands at right limits: after everything that happens at its time.
///
/// # Example
/// A capacitor is charged to 3 V by a source that is then taken down to 1 V.
/// ```
/// use circ::{Model, SimulationOptions};
///
/// let model = Model::parse("charge\nv1 1 0 3\nr1 1 2 1k\nc1 2 0 1u\n.tran 1u 10m uic\n.end\n", "charge.cir")?;
/// let mut simulation = model.simulation(SimulationOptions::default())?;
/// simulation.advance_to(1e-3)?;
/// let charged = simulation.value("v(2)")?;
/// assert!((charged - 3.0 * (1.0 - (-1.0_f64).exp())).abs() < 1e-12);
/// simulation.set_source("v1", 1.0)?;
/// simulation.advance_to(2e-3)?;
/// assert!((simulation.value("v(2)")? - (1.0 + (charged - 1.0) * (-1.0_f64).exp())).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Simulation {
    circuit: Arc<Circuit>,
    problem: Problem,
    lcs: Lcs,
    tran: Tran,
    options: SimulationOptions,
    way: Way,
    row: Vec<f64>,
    impulses: Vec<Impulse>,
    state_jumps: StateJumps,
    notes: Vec<Note>,
    spent: Stats,
    /// See [`Self::lapping`].
    lap: Option<Lap>,
}

impl Simulation {
    /// A simulation that stands at t = 0⁺, after the jump there.
    ///
    /// # Errors
    /// As [`simulate`](crate::integrate::simulate()) before its first row.
    pub fn new(
        circuit: &Circuit,
        multiport: &StaticMultiport,
        options: SimulationOptions,
    ) -> Result<Self, Error> {
        Self::start(
            circuit,
            multiport,
            options,
            (Problem::with_free_sources, None),
        )
    }

    /// The same of a circuit whose sources keep their waveforms: those that only move switches are then no part of the state. It keeps no energy
    /// balance where it is exact.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn closed(
        circuit: &Circuit,
        multiport: &StaticMultiport,
        options: SimulationOptions,
    ) -> Result<Self, Error> {
        Self::start(circuit, multiport, options, (Problem::unbalanced, None))
    }

    /// The same of one that comes around again after `span` seconds, over which the steps of curved laws keep the tolerance, relative to the amplitudes of another one that is `like` it and
    /// those that were seen so far. They end at the times that are asked for, follow from the place that was last gone to alone, and are `most` at most on the way to a time.
    pub(crate) fn lapping(
        circuit: &Circuit,
        multiport: &StaticMultiport,
        options: SimulationOptions,
        (span, most): (f64, u64),
        like: Option<&Self>,
    ) -> Result<Self, Error> {
        let lap = Lap {
            span,
            most,
            amplitudes: like.and_then(|like| like.way.amplitudes()),
        };
        let problem = (Problem::unbalanced, Some(lap));
        Self::start(circuit, multiport, options, problem)
    }

    fn start(
        circuit: &Circuit,
        multiport: &StaticMultiport,
        options: SimulationOptions,
        (sources, lap): (impl FnOnce(Problem) -> Problem, Option<Lap>),
    ) -> Result<Self, Error> {
        let tran = transient(circuit.tran, options.until)?;
        check(&tran, &options.as_asked())?;
        let problem = Problem::of_circuit(circuit, multiport, tran.uic, &options.settings)?;
        let mut problem = sources(problem);
        let lcs = problem.prepare(&tran, &options.settings)?;
        let (mut notes, mut log) = (problem.notes.clone(), Log::default());
        let asked = (&options, lap.as_ref());
        let way = Way::of(&problem, &lcs, &tran, asked, &mut notes, &mut log)?;
        Ok(Self {
            row: vec![0.0; lcs.outputs.names.len()],
            circuit: Arc::new(circuit.clone()),
            problem,
            lcs,
            tran,
            options,
            way,
            impulses: log.impulses,
            state_jumps: log.state_jumps,
            notes,
            spent: Stats::default(),
            lap,
        })
    }

    /// The circuit whose transient it is.
    pub(crate) fn circuit(&self) -> &Circuit {
        &self.circuit
    }

    pub(super) const fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The present time, s.
    #[must_use]
    pub fn time(&mut self) -> f64 {
        self.way.stepper().time()
    }

    /// Advances to this time, s: no earlier than the present one, no later than the end.
    ///
    /// # Errors
    /// See [`Reason`]; the simulation stays at the last time it reached.
    pub fn advance_to(&mut self, t: f64) -> Result<Stop, Error> {
        let cancel = self.options.cancel.clone();
        self.advance(t, false, cancel.as_deref())
    }

    /// Advances to the next event, to `t` at most.
    ///
    /// # Errors
    /// As [`Self::advance_to`].
    pub fn advance_to_event(&mut self, t: f64) -> Result<Stop, Error> {
        let cancel = self.options.cancel.clone();
        self.advance(t, true, cancel.as_deref())
    }

    /// Advances to this time, or where `pause` asks for it to the next event before; it ends when `cancel` is set.
    ///
    /// # Errors
    /// As [`Self::advance_to`].
    pub(crate) fn advance(
        &mut self,
        t: f64,
        pause: bool,
        cancel: Option<&AtomicBool>,
    ) -> Result<Stop, Error> {
        let (now, end) = (self.time(), self.tran.tstop);
        if !(t >= now && t <= end) {
            let what = format!(
                "the simulation stands at {now:e} s and ends at {end:e} s: it cannot go to {t:e} s"
            );
            return Err(Error::at(now, Reason::Unsupported(what)));
        }
        let asked = Asked {
            cancel,
            ..Asked::default()
        };
        let mut log = Log::of(0, 0.0, asked);
        log.pause_at_event(pause);
        if let (Some(lap), Way::Steps(theta)) = (&self.lap, &mut self.way) {
            theta.make_at_most(lap.most);
        }
        let advanced = self.way.stepper().advance(t, &mut log);
        let events = self.take(log);
        advanced?;
        let time = self.time();
        let reason = if time < t {
            StopReason::Event
        } else {
            StopReason::Time
        };
        Ok(Stop {
            time,
            reason,
            events,
        })
    }

    /// Keeps what a log holds but the events.
    fn take(&mut self, mut log: Log<'_>) -> Vec<Event> {
        let room = Log::LISTED.saturating_sub(self.impulses.len());
        self.impulses.extend(log.impulses.drain(..).take(room));
        self.state_jumps.extend(&log.state_jumps);
        log.events
    }

    /// What [`Self::value`] can be asked for.
    #[must_use]
    pub fn probes(&self) -> &[String] {
        &self.lcs.outputs.names
    }

    /// A probe's value now, V or A.
    ///
    /// # Errors
    /// The simulation has no such probe.
    pub fn value(&mut self, probe: &str) -> Result<f64, Error> {
        let name = canonical_name(probe);
        let names = &self.lcs.outputs.names;
        let Some(at) = names.iter().position(|n| canonical_name(n) == name) else {
            return Err(unknown("probe", probe, names.iter().map(String::as_str)));
        };
        self.way.stepper().read(&mut self.row);
        Ok(self.row[at])
    }

    /// Names of the state: `v(c1)`, `i(l1)`.
    #[must_use]
    pub fn state_names(&self) -> &[String] {
        &self.lcs.storage.names
    }

    /// All capacitor voltages, V, and inductor currents, A, now.
    #[must_use]
    pub fn state(&mut self) -> Vec<f64> {
        self.way.place().storage.as_slice().to_vec()
    }

    /// Units of the state, `V` and `A`.
    #[must_use]
    pub fn state_units(&self) -> &[&'static str] {
        &self.lcs.storage.units
    }

    /// The tolerance of the steps of [`Self::lapping`].
    pub(crate) fn lap_tolerance(&self) -> Option<f64> {
        let steps = self.lap.is_some() && !self.is_exact();
        steps.then_some(self.options.settings.tol)
    }

    /// Whether modes are integrated exactly, with steps at most where that is not possible.
    pub(crate) const fn is_exact(&self) -> bool {
        matches!(self.way, Way::Exact(_))
    }

    /// Steps of exact integration so far.
    pub(crate) fn exact_steps(&self) -> u64 {
        self.way.exact_steps()
    }

    /// Which ideal pairs conduct; empty where not known.
    pub(crate) fn conducting(&self) -> Vec<bool> {
        self.way.conducting()
    }

    /// Goes to another time and state: capacitor voltages, V, and inductor currents, A, as [`Self::state`] gives them, switches as
    /// [`Self::positions`] does. Edges of sources at that time have acted; a state that the circuit does not admit jumps.
    ///
    /// # Errors
    /// As [`Self::advance_to`]; the circuit has transmission lines.
    pub(crate) fn stand_at(
        &mut self,
        t: f64,
        state: &[f64],
        switches: &[bool],
    ) -> Result<(), Error> {
        self.can_be_moved()?;
        let place = Place {
            t,
            storage: DVector::from_column_slice(state),
            switches: switches.to_vec(),
        };
        let conducting = self.way.conducting();
        let back = match &mut self.way {
            Way::Exact(exact) => exact.restore(&place, &conducting, std::iter::empty()),
            Way::Steps(_) => false,
        };
        if back {
            return Ok(());
        }
        self.go_on_with(self.problem.clone().standing_at(place, conducting))
    }

    /// Switches that are on, in the order of [`Self::switches`].
    #[must_use]
    pub fn positions(&mut self) -> Vec<bool> {
        self.way.place().switches
    }

    /// Names of the switches.
    #[must_use]
    pub fn switches(&self) -> Vec<&str> {
        let switches = self.problem.systems.multiport.switches.iter();
        switches.map(|switch| switch.name.as_str()).collect()
    }

    /// Holds a source at a value, V or A, from now on: an edge, with the jumps it makes.
    ///
    /// # Errors
    /// There is no such source; else as [`Self::advance_to`].
    pub fn set_source(&mut self, name: &str, value: f64) -> Result<Vec<Event>, Error> {
        let sources = &self.problem.systems.multiport.sources;
        let Some(input) = sources.iter().position(|s| s.input.name == name) else {
            return Err(unknown(
                "source",
                name,
                sources.iter().map(|s| s.input.name.as_str()),
            ));
        };
        if self
            .circuit
            .element(name)
            .is_some_and(|id| self.circuit.is_known(id))
        {
            let what = "it cannot be set during a run: an expression took its voltage as a number";
            return Err(Error::before(Reason::Unsupported(what.into())).device(name));
        }
        if !value.is_finite() {
            let what = format!("{name} cannot be set to {value}");
            return Err(Error::before(Reason::Unsupported(what)));
        }
        self.can_be_moved()?;
        let source = Source::constant(value);
        self.problem.systems.replace_source(input, source.clone());
        let mut log = Log::default();
        let set = match &mut self.way {
            Way::Exact(exact) => exact.set_source(input, source, &mut log),
            Way::Steps(_) => {
                let (place, conducting) = (self.way.place(), self.way.conducting());
                self.go_on_with(self.problem.clone().standing_at(place, conducting))
            }
        };
        let events = self.take(log);
        set.map(|()| events)
    }

    /// Holds a switch in a position from now on, whatever its control says, until it is set again.
    ///
    /// # Errors
    /// There is no such switch, or it is part of a thyristor; else as [`Self::advance_to`].
    pub fn set_switch(&mut self, name: &str, on: bool) -> Result<Vec<Event>, Error> {
        let source = holder(name);
        if self.circuit.element(&source).is_none() {
            self.take_switch(name)?;
        }
        self.set_source(&source, held_at(on))
    }

    /// Has a switch controlled by a source of its own, at first so that it stays.
    fn take_switch(&mut self, name: &str) -> Result<(), Error> {
        self.can_be_moved()?;
        let place = self.way.place();
        let at = self.switches().iter().position(|switch| *switch == name);
        let on = at.is_some_and(|at| place.switches[at]);
        let Some(circuit) = self.circuit.with_held_switch(name, on) else {
            return Err(unknown(
                "switch that can be set",
                name,
                self.switches().into_iter(),
            ));
        };
        let multiport = behaviour(&circuit).map_err(|_| {
            let what = format!("{name} cannot be held by a source");
            Error::before(Reason::internal("integrate::simulation", what))
        })?;
        let replaced = self.problem.systems.replaced();
        let problem = Problem::of_circuit(&circuit, &multiport, true, &self.options.settings)?;
        problem.systems.replace_sources(replaced);
        let conducting = self.way.conducting();
        let problem = problem.standing_at(place, conducting).with_free_sources();
        self.circuit = Arc::new(circuit);
        self.go_on_with(problem)
    }

    /// Another problem from where the present one stands.
    fn go_on_with(&mut self, problem: Problem) -> Result<(), Error> {
        let mut problem = problem;
        self.lcs = problem.prepare(&self.tran, &self.options.settings)?;
        let mut log = Log::default();
        if let Some(lap) = &mut self.lap {
            lap.amplitudes = self.way.amplitudes();
        }
        let (tran, notes) = (&self.tran, &mut self.notes);
        let asked = (&self.options, self.lap.as_ref());
        let mut way = Way::of(&problem, &self.lcs, tran, asked, notes, &mut log)?;
        way.carry_on(self.way.balance());
        let outcome = self.way.stepper().finish();
        self.spent.add(&outcome.stats);
        note::append(&mut self.notes, outcome.notes);
        (self.way, self.problem) = (way, problem);
        self.take(log);
        Ok(())
    }

    /// # Errors
    /// What travels on transmission lines is part of the state, and not kept beside it.
    fn can_be_moved(&self) -> Result<(), Error> {
        if self.circuit.lines.is_empty() {
            return Ok(());
        }
        let what = "sources and switches of a circuit with transmission lines cannot be set during a run, nor can it be taken up again";
        Err(Error::before(Reason::Unsupported(what.into())))
    }

    /// The present state, to return to.
    ///
    /// # Errors
    /// The circuit has transmission lines.
    pub fn checkpoint(&mut self) -> Result<Checkpoint, Error> {
        self.can_be_moved()?;
        let problem = self.problem.clone();
        Ok(Checkpoint {
            circuit: Arc::clone(&self.circuit),
            problem: problem.standing_at(self.way.place(), self.way.conducting()),
            replaced: self.problem.systems.replaced(),
            balance: self.way.balance(),
            impulses: self.impulses.clone(),
            state_jumps: self.state_jumps.clone(),
        })
    }

    /// Goes back, or on, to a state of this simulation.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), Error> {
        let Checkpoint {
            circuit,
            problem,
            replaced,
            balance,
            impulses,
            state_jumps,
        } = checkpoint;
        problem.systems.replace_sources(replaced.clone());
        self.circuit = Arc::clone(circuit);
        let same = Arc::ptr_eq(&problem.systems.multiport, &self.problem.systems.multiport);
        let back = match &mut self.way {
            Way::Exact(exact) if same => {
                let inputs = problem
                    .systems
                    .free(&problem.start.switches)?
                    .into_parts()
                    .inputs;
                let sources = inputs.into_iter().map(|input| input.source);
                exact.restore(&problem.start, &problem.conducting, sources)
            }
            _ => false,
        };
        if !back {
            self.go_on_with(problem.clone())?;
        }
        self.way.start_balance(*balance);
        self.impulses.clone_from(impulses);
        self.state_jumps.clone_from(state_jumps);
        Ok(())
    }

    /// Counters, energy, jumps and notes of all that was simulated; without rows and events, which the caller has.
    #[must_use]
    pub fn finish(mut self) -> Run {
        let outcome = self.way.stepper().finish();
        self.spent.add(&outcome.stats);
        note::append(&mut self.notes, outcome.notes);
        Run {
            method: match self.way {
                Way::Exact(_) => Method::Exact.name().into(),
                Way::Steps(_) if self.options.method == Method::Euler => {
                    Method::Euler.name().into()
                }
                Way::Steps(_) => Method::Theta.name().into(),
            },
            stats: self.spent,
            energy: outcome.energy,
            balanced: true,
            error: outcome.error,
            impulses: self.impulses,
            state_jumps: self.state_jumps,
            notes: self.notes,
            ..Run::default()
        }
    }
}

/// The span of a simulation: that of `.tran`, unless it is to end elsewhere.
fn transient(tran: Option<Tran>, until: Option<f64>) -> Result<Tran, Error> {
    let of_span = |tstop: f64| Tran {
        tstep: tstop / SPAN_PARTS,
        prints: true,
        tstop,
        tstart: 0.0,
        tmax: None,
        uic: false,
    };
    match (tran, until) {
        (Some(tran), until) => Ok(Tran {
            tstop: until.unwrap_or(tran.tstop),
            tstart: 0.0,
            ..tran
        }),
        (None, Some(until)) => Ok(of_span(until)),
        (None, None) => {
            let what = "the netlist asks for no .tran analysis: say until when a simulation may go";
            Err(Error::before(Reason::Unsupported(what.into())))
        }
    }
}

fn unknown<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str>) -> Error {
    let known: Vec<&str> = known.collect();
    let there = if known.is_empty() {
        "there is none".into()
    } else {
        format!("there are {}", known.join(" "))
    };
    Error::before(Reason::Unknown(format!("no {what} `{name}`: {there}")))
}
