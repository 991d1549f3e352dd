//! The time loop, shared by all methods: a [`Stepper`] moves, the loop writes rows.

use std::sync::Arc;

use crate::circuit::Tran;
use crate::diagnostic::{Diagnostic, Faults, Internal};
use crate::integrate::event::{Change, Event};
use crate::integrate::note;
use crate::integrate::rows::{Asked, RowKind, Sheet};
use crate::integrate::{Energy, Impulse, Note, Run, StateJump, StateJumps, StatedError, Stats};
use crate::lcs::ReduceError;
use crate::settings::tolerances::times::LAST_ROW;
use crate::waveform::Waveforms;

/// A simulation that ended early: when, at which device, and why, with everything computed so far.
#[derive(Debug, thiserror::Error)]
#[error("{}{}{reason}", at(*.t), named(.elements))]
pub struct SimError {
    /// Time, s; `None` before the run started.
    pub t: Option<f64>,
    /// The elements concerned, or parts of them (`d3.1`); the first is where the failure shows.
    pub elements: Vec<String>,
    /// Why.
    pub reason: Reason,
    /// The run up to the failure.
    pub partial: Option<Box<Run>>,
}

/// "at t = 1e-3 s: ", nothing before the run.
pub(super) fn at(t: Option<f64>) -> String {
    match t {
        None => String::new(),
        Some(0.0) => "at t = 0: ".into(),
        Some(t) => format!("at t = {t:e} s: "),
    }
}

/// "d1, d2: ", nothing where no element is concerned.
pub(crate) fn named(elements: &[String]) -> String {
    match elements {
        [] => String::new(),
        _ => elements.join(", ") + ": ",
    }
}

/// Why a simulation cannot go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Reason {
    /// The one-step problem has no solution.
    #[error(
        "the one-step complementarity problem has no solution (no state of the devices satisfies the circuit equations)"
    )]
    Infeasible,
    /// No solver reached the residual.
    #[error("no solver met the complementarity residual {tolerance:e} (best {residual:e})")]
    Residual {
        /// Best scaled residual.
        residual: f64,
        /// Required.
        tolerance: f64,
    },
    /// I − hθA or a mode's system is singular.
    #[error("the step matrix is singular for h = {h:e} s")]
    Singular {
        /// Step, s.
        h: f64,
    },
    /// The error-controlled step became too small.
    #[error("the step fell below {limit:e} s without meeting the tolerance")]
    StepTooSmall {
        /// Smallest step allowed, s.
        limit: f64,
    },
    /// `Settings::max_steps`.
    #[error("more than {limit} steps")]
    TooManySteps {
        /// The limit.
        limit: u64,
    },
    /// Switch positions contradict each other at one instant.
    #[error("switch positions do not settle")]
    SwitchesDoNotSettle,
    /// Events follow each other without end.
    #[error("{events} events follow each other within {span:e} s")]
    EventsAccumulate {
        /// Their number.
        events: usize,
        /// The time they take, s.
        span: f64,
    },
    /// Steps within one mode come no further.
    #[error("{steps} steps come no further than {span:e} s")]
    NoProgress {
        /// Their number.
        steps: u64,
        /// The time they take, s.
        span: f64,
    },
    /// A mode's exponential has lost its digits to a resistance that decades part from the others.
    #[error(
        "exact integration would be wrong by {loss:.0e} of a signal in each step: decades lie between a resistance and the others, and no single storage element has to itself what it makes fast"
    )]
    NotGraded {
        /// Relative to the signal.
        loss: f64,
    },
    /// The circuit has no operating point.
    #[error("no operating point: {0}; `uic` starts from initial conditions instead")]
    NoOperatingPoint(NoRest),
    /// What was read is no circuit.
    #[error("{0}")]
    Netlist(Faults),
    /// The circuit in this switch position is not a system.
    #[error("{0}")]
    Circuit(ReduceError),
    /// The state left the range of doubles.
    #[error("the solution grows beyond the range of numbers")]
    Overflow,
    /// The run was cancelled, or nobody takes its rows any more.
    #[error("interrupted")]
    Interrupted,
    /// More rows than may be held at once.
    #[error(
        "{rows:e} rows of {} values are {:.3} GB, more than the {:.3} GB that may be held at once",
        .columns + 1, gigabytes(*.rows, *.columns), gigabytes(*.limit as f64, *.columns)
    )]
    TooManyRows {
        /// Their number.
        rows: f64,
        /// Values of a row besides its time.
        columns: usize,
        /// The largest number that is held.
        limit: usize,
    },
    /// Output times closer to each other than doubles are.
    #[error(
        "{rows:e} rows from {tstart:e} s to {tstop:e} s are closer to each other than numbers are: the print step must be {least:.1e} s or longer"
    )]
    RowsTooDense {
        /// Their number.
        rows: f64,
        /// First, s.
        tstart: f64,
        /// Last, s.
        tstop: f64,
        /// The shortest distance of rows, s.
        least: f64,
    },
    /// The method asked for does not cover the circuit.
    #[error("{0}")]
    Unsupported(String),
    /// A broken invariant.
    #[error("{0}")]
    Internal(Internal),
}

/// Why a circuit has no operating point.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoRest {
    /// Its network with open capacitors and shorted inductors is none.
    #[error("{0}")]
    Network(String),
    /// That network is no system.
    #[error("{0}")]
    System(ReduceError),
    /// The devices contradict it.
    #[error("no state of the devices satisfies the circuit equations")]
    Devices,
    /// Currents or voltages grow without end.
    #[error(
        "a voltage source across inductors or a current source into capacitors has no steady state"
    )]
    Sources,
    /// A voltage is held across an inductor.
    #[error("`.ic` holds a voltage across an inductor, whose current has no steady state")]
    Held,
    /// A current flows where only capacitors lead on.
    #[error("a current flows into a part of the circuit that only capacitors hold")]
    Floating,
}

impl Reason {
    /// A broken invariant: what does not hold at this place of the program, as `integrate::exact`.
    pub fn internal(place: &'static str, what: impl Into<String>) -> Self {
        Self::Internal(Internal::new(place, what))
    }
}

impl From<ReduceError> for Reason {
    fn from(error: ReduceError) -> Self {
        match error {
            ReduceError::Internal(broken) => Self::Internal(broken),
            error => Self::Circuit(error),
        }
    }
}

impl From<Faults> for SimError {
    fn from(faults: Faults) -> Self {
        Self::before(Reason::Netlist(faults))
    }
}

/// The memory of so many rows.
fn gigabytes(rows: f64, columns: usize) -> f64 {
    rows * (columns + 1) as f64 * size_of::<f64>() as f64 * 1e-9
}

impl SimError {
    /// What is wrong with a netlist, with places in the files of [`Reason::Netlist`]; empty where the circuit itself is at fault.
    #[must_use]
    pub fn findings(&self) -> &[Diagnostic] {
        match &self.reason {
            Reason::Netlist(faults) => &faults.findings,
            _ => &[],
        }
    }

    /// A failure before the run.
    #[must_use]
    pub fn before(reason: Reason) -> Self {
        Self {
            t: None,
            elements: Vec::new(),
            reason,
            partial: None,
        }
    }

    /// A failure at a time.
    #[must_use]
    pub fn at(t: f64, reason: Reason) -> Self {
        Self {
            t: Some(t),
            elements: Vec::new(),
            reason,
            partial: None,
        }
    }

    /// Names the element concerned.
    #[must_use]
    pub fn device(self, name: impl Into<String>) -> Self {
        self.devices([name])
    }

    /// Names the elements concerned.
    #[must_use]
    pub fn devices(mut self, names: impl IntoIterator<Item = impl Into<String>>) -> Self {
        self.elements = names.into_iter().map(Into::into).collect();
        self
    }
}

/// One integration method on one circuit.
pub trait Stepper {
    /// Current time, s.
    fn time(&self) -> f64;
    /// Advances to exactly `t` (≥ the current time); afterwards the state is the right limit at `t`. Every event and jump
    /// on the way, one at `t` itself included, goes into `log`.
    ///
    /// # Errors
    /// See [`Reason`]; the stepper stays at the last time it reached.
    fn advance(&mut self, t: f64, log: &mut Log) -> Result<(), SimError>;
    /// Probe values at the current time (right limit), one per output name.
    fn read(&mut self, row: &mut [f64]);
    /// Advances over the output times k, k + 1, … of the grid whose rows are known already, and returns these rows, one after the
    /// other.
    fn rows_ahead(&mut self, _times: &Times, _k: usize) -> &[f64] {
        &[]
    }
    /// Whether steps have been made that err.
    fn has_stepped(&self) -> bool {
        true
    }
    /// Counters, energy, notes.
    fn finish(&mut self) -> Outcome;
}

/// What a stepper knows at the end.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Counters.
    pub stats: Stats,
    /// Energy balance.
    pub energy: Energy,
    /// See [`Run::error`].
    pub error: StatedError,
    /// Things the user should know.
    pub notes: Vec<Note>,
}

/// Collects what happens between output times.
#[derive(Default)]
pub struct Log<'a> {
    /// The first [`Self::LISTED`].
    pub events: Vec<Event>,
    /// Impulses at jumps; the first [`Self::LISTED`].
    pub impulses: Vec<Impulse>,
    /// Jumps of the state.
    pub state_jumps: StateJumps,
    rows: Sheet<'a>,
    /// The number of events above which steppers pause.
    pause: Option<usize>,
}

impl<'a> Log<'a> {
    /// Events and impulses listed; those after them are only counted.
    pub const LISTED: usize = 1 << 20;

    /// A log for rows of `columns` values from time `from` on, all of them collected; event rows only if `wants_rows`.
    #[must_use]
    pub fn new(columns: usize, from: f64, wants_rows: bool) -> Self {
        let asked = Asked {
            events: wants_rows,
            ..Asked::default()
        };
        Self::of(columns, from, asked)
    }

    /// The same for the rows that are asked for.
    #[must_use]
    pub fn of(columns: usize, from: f64, asked: Asked<'a>) -> Self {
        Self {
            rows: Sheet::new(columns, from, asked),
            ..Self::default()
        }
    }

    /// A device or switch changed its state at `t`, or the state jumped.
    pub fn event(&mut self, t: f64, changes: Arc<[Change]>, jump: bool) {
        if self.events.len() < Self::LISTED {
            self.events.push(Event { t, changes, jump });
        }
    }

    /// An impulse of this area at `t`.
    pub fn impulse(&mut self, t: f64, name: impl Into<String>, area: f64) {
        if self.impulses.len() < Self::LISTED {
            self.impulses.push(Impulse {
                t,
                name: name.into(),
                area,
            });
        }
    }

    /// A jump of the state.
    pub fn state_jump(&mut self, jump: StateJump) {
        self.state_jumps.add(jump);
    }

    /// Whether rows at event times were asked for.
    #[must_use]
    pub fn wants_rows(&self) -> bool {
        self.rows.wants_events()
    }

    /// Whether rows at corners of sources were asked for.
    #[must_use]
    pub fn wants_corners(&self) -> bool {
        self.rows.wants_corners()
    }

    /// Whether a run that stands at `t` may go on: steppers ask at every step.
    ///
    /// # Errors
    /// [`Reason::Interrupted`] when it was cancelled or nobody takes its rows any more, [`Reason::TooManyRows`] when more were
    /// collected than allowed.
    #[inline]
    pub fn go_on(&self, t: f64) -> Result<(), SimError> {
        self.rows.go_on(t)
    }

    /// Has steppers pause at the next event, or no longer do so.
    pub(crate) fn pause_at_event(&mut self, pause: bool) {
        self.pause = pause.then_some(self.events.len());
    }

    /// Whether a stepper that has just logged what happened is to return before the time it was to reach.
    pub(crate) fn pauses(&self) -> bool {
        self.pause.is_some_and(|known| self.events.len() > known)
    }

    /// Takes back what was logged since there were `events` events and `impulses` impulses.
    pub(crate) fn back_to(&mut self, events: usize, impulses: usize) {
        self.events.truncate(events);
        self.impulses.truncate(impulses);
    }

    /// A row at an event: once at a continuous event, twice (left limit, right limit) at a jump. Ignored unless
    /// [`Self::wants_rows`].
    pub fn row(&mut self, t: f64, row: &[f64]) {
        self.rows.between(t, row, RowKind::Event);
    }

    /// A row at a corner of a source. Ignored unless [`Self::wants_corners`], and where there is a row.
    pub fn corner(&mut self, t: f64, row: &[f64]) {
        if self.wants_corners() {
            self.rows.between(t, row, RowKind::Corner);
        }
    }

    /// Forgets an attempt that failed, for another one from the start. Rows that were handed on stay: returns the time of the last, s.
    pub(crate) fn again(&mut self) -> Option<f64> {
        self.back_to(0, 0);
        self.rows.again()
    }
}

/// Output times `tstart + k·tstep`, the last exactly `tstop`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// First output time, s.
    pub tstart: f64,
    /// Distance of output times, s.
    pub tstep: f64,
    /// Last output time, s.
    pub tstop: f64,
}

impl Grid {
    /// The output times of a transient analysis.
    #[must_use]
    pub const fn of(tran: &Tran) -> Self {
        Self {
            tstart: tran.tstart,
            tstep: tran.tstep,
            tstop: tran.tstop,
        }
    }

    /// Number of output times.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count() as usize
    }

    /// The same, which may be more than a computer can count.
    #[must_use]
    pub fn count(&self) -> f64 {
        let span = self.tstop - self.tstart;
        if !(span > 0.0 && self.tstep > 0.0) {
            return 1.0;
        }
        (span / self.tstep - LAST_ROW).ceil().max(1.0) + 1.0
    }

    /// # Errors
    /// [`Reason::RowsTooDense`] for output times that doubles do not tell apart; [`Reason::TooManyRows`] for more than `most` rows, of
    /// so many columns besides time.
    pub fn check(&self, columns: usize, most: Option<usize>) -> Result<(), SimError> {
        let Self {
            tstart,
            tstep,
            tstop,
        } = *self;
        let rows = self.count();
        let least = 2.0 * f64::EPSILON * tstop.abs();
        if tstep < least {
            return Err(SimError::before(Reason::RowsTooDense {
                rows,
                tstart,
                tstop,
                least,
            }));
        }
        match most {
            Some(limit) if rows > limit as f64 => Err(SimError::before(Reason::TooManyRows {
                rows,
                columns,
                limit,
            })),
            _ => Ok(()),
        }
    }

    /// Never: `tstop` is always there.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        false
    }

    /// Output time k < [`Self::len`], s.
    #[must_use]
    pub fn time(&self, k: usize) -> f64 {
        self.times().at(k)
    }

    /// The times one by one.
    #[must_use]
    pub fn times(&self) -> Times {
        Times {
            grid: *self,
            len: self.len(),
        }
    }
}

/// The times of a [`Grid`], counted once.
#[derive(Debug, Clone, Copy)]
pub struct Times {
    grid: Grid,
    /// Their number.
    pub len: usize,
}

impl Times {
    /// Output time k, s.
    #[must_use]
    pub fn at(&self, k: usize) -> f64 {
        let Grid {
            tstart,
            tstep,
            tstop,
        } = self.grid;
        if k + 1 >= self.len {
            tstop
        } else {
            tstart + k as f64 * tstep
        }
    }
}

/// What every run needs besides its stepper.
pub struct Frame<'a> {
    /// Title for the waveforms.
    pub title: String,
    /// Column names.
    pub names: Vec<String>,
    /// Column units.
    pub units: Vec<&'static str>,
    /// Output times.
    pub grid: Grid,
    /// `exact`, `theta`, `euler`.
    pub method: String,
    /// What the plan decided.
    pub plan: Vec<String>,
    /// Notes from before the run.
    pub notes: Vec<Note>,
    /// Called with the time reached, s, after an output row or several.
    pub progress: Option<&'a mut dyn FnMut(f64)>,
}

/// Runs a stepper over the output grid.
///
/// # Errors
/// The stepper's, with the run so far in [`SimError::partial`].
pub fn run(stepper: &mut dyn Stepper, frame: Frame<'_>, mut log: Log<'_>) -> Result<Run, SimError> {
    attempt(stepper, frame, &mut log, true)
}

/// The same with a log that can be used [again](Log::again): after a failure of what is not the `last` attempt, unless [`is_final`],
/// the rows stay in it.
pub(crate) fn attempt(
    stepper: &mut dyn Stepper,
    frame: Frame<'_>,
    log: &mut Log<'_>,
    last: bool,
) -> Result<Run, SimError> {
    let Frame {
        title,
        names,
        units,
        grid,
        method,
        plan,
        notes,
        mut progress,
    } = frame;
    let mut row = vec![0.0; names.len()];
    let mut failure = None;
    let times = grid.times();
    log.rows.expect(times.len);
    let mut k = 0;
    while k < times.len {
        let advanced = stepper.advance(times.at(k), log).and_then(|()| {
            stepper.read(&mut row);
            log.rows.grid(&times, k..k + 1, &row)?;
            let ahead = stepper.rows_ahead(&times, k + 1);
            let after = k + 1 + ahead.len() / row.len().max(1);
            if after > k + 1 {
                log.rows.grid(&times, k + 1..after, ahead)?;
            }
            if after < times.len {
                log.go_on(times.at(after - 1))?;
            }
            Ok(after)
        });
        match advanced {
            Ok(after) => k = after,
            Err(error) => {
                failure = Some(error);
                break;
            }
        }
        if let Some(report) = progress.as_mut() {
            report(times.at(k - 1));
        }
    }
    let outcome = stepper.finish();
    let mut all_notes = notes;
    note::append(&mut all_notes, outcome.notes);
    if log.events.len() == Log::LISTED {
        all_notes.push(format!("the first {} events are listed", Log::LISTED).into());
    }
    let failure = match failure {
        Some(error) if !last && !is_final(&error) => return Err(error),
        failure => failure,
    };
    log.rows.end();
    let (time, values, kinds) = log.rows.collected();
    let run = Run {
        waveforms: Waveforms {
            title,
            names,
            units,
            time,
            values,
        },
        kinds,
        method,
        plan,
        stats: outcome.stats,
        energy: outcome.energy,
        balanced: true,
        error: outcome.error,
        impulses: std::mem::take(&mut log.impulses),
        events: std::mem::take(&mut log.events),
        state_jumps: std::mem::take(&mut log.state_jumps),
        notes: all_notes,
        aliased: None,
        verified: None,
    };
    match failure {
        None => Ok(run),
        Some(mut error) => {
            error.partial = Some(Box::new(run));
            Err(error)
        }
    }
}

/// Whether no other method would come further.
pub(crate) fn is_final(error: &SimError) -> bool {
    matches!(
        error.reason,
        Reason::Interrupted | Reason::TooManyRows { .. }
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grid_ends_exactly_at_tstop() {
        let grid = Grid {
            tstart: 0.0,
            tstep: 1e-6,
            tstop: 5e-3,
        };
        assert_eq!(grid.len(), 5001);
        assert_eq!(grid.time(5000), 5e-3);
        let uneven = Grid {
            tstart: 1.0,
            tstep: 0.4,
            tstop: 2.0,
        };
        let times: Vec<f64> = (0..uneven.len()).map(|k| uneven.time(k)).collect();
        assert_eq!(times, [1.0, 1.4, 1.8, 2.0]);
    }

    /// x = t, one "event" with a jump row pair at t = 1 and a failure after 2.
    struct Ramp(f64);
    impl Stepper for Ramp {
        fn time(&self) -> f64 {
            self.0
        }
        fn advance(&mut self, t: f64, log: &mut Log) -> Result<(), SimError> {
            if t > 2.0 {
                return Err(SimError::at(2.5, Reason::Infeasible).device("d1"));
            }
            if self.0 < 1.0 && t >= 1.0 {
                log.event(1.0, Arc::default(), true);
                log.row(1.0, &[-1.0]);
                log.row(1.0, &[1.0]);
            }
            self.0 = t;
            Ok(())
        }
        fn read(&mut self, row: &mut [f64]) {
            row[0] = self.0;
        }
        fn finish(&mut self) -> Outcome {
            Outcome::default()
        }
    }

    fn ramp(events: bool) -> SimError {
        let grid = Grid {
            tstart: 0.0,
            tstep: 1.0,
            tstop: 3.0,
        };
        let frame = Frame {
            title: String::new(),
            names: vec!["v(1)".into()],
            units: vec!["V"],
            grid,
            method: "ramp".into(),
            plan: vec![],
            notes: vec![],
            progress: None,
        };
        run(&mut Ramp(0.0), frame, Log::new(1, 0.0, events)).unwrap_err()
    }

    #[test]
    fn failure_keeps_the_waveform_and_names_time_and_device() {
        let error = ramp(false);
        assert!(
            error
                .to_string()
                .starts_with("at t = 2.5e0 s: d1: the one-step"),
            "{error}"
        );
        let kept = error.partial.unwrap().waveforms;
        assert_eq!(kept.time, [0.0, 1.0, 2.0]);
        assert_eq!(kept.values, [0.0, 1.0, 2.0]);
    }

    #[test]
    fn event_rows_do_not_repeat_the_grid_row() {
        let kept = ramp(true).partial.unwrap().waveforms;
        assert_eq!(kept.time, [0.0, 1.0, 1.0, 2.0]);
        assert_eq!(kept.values, [0.0, -1.0, 1.0, 2.0]);
    }
}
