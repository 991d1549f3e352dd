//! Why a simulation ends early: one error with time, elements, reason and the run so far.

use crate::diagnostic::{Diagnostic, Faults, Internal};
use crate::integrate::Run;
use crate::lcs::ReduceError;

/// A simulation that ended early: when, at which device, and why, with everything computed so far.
#[derive(Debug, thiserror::Error)]
#[error("{}{}{reason}", at(*.t), named(.elements))]
pub struct Error {
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
    /// Currents of curved laws leave nothing of what they charge.
    #[error(
        "currents of {current:.0e} A are subtracted from each other: their rounding alone is more than the voltages that they leave"
    )]
    Cancellation {
        /// The largest, A.
        current: f64,
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
    /// The circuit has no periodic steady state, or none was found.
    #[error("no periodic steady state: {0}")]
    NoOrbit(String),
    /// A derivative was asked for that does not exist, or is not known.
    #[error("no derivative: {0}")]
    NotSmooth(String),
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
    /// A name that means nothing here, and those that do.
    #[error("{0}")]
    Unknown(String),
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

impl From<Faults> for Error {
    fn from(faults: Faults) -> Self {
        Self::before(Reason::Netlist(faults))
    }
}

/// The memory of so many rows.
fn gigabytes(rows: f64, columns: usize) -> f64 {
    rows * (columns + 1) as f64 * size_of::<f64>() as f64 / 1e9
}

impl Error {
    /// What is wrong with a netlist, with places in the files of [`Reason::Netlist`]; empty where the circuit itself is at fault.
    #[must_use]
    pub fn findings(&self) -> &[Diagnostic] {
        match &self.reason {
            Reason::Netlist(faults) => &faults.findings,
            _ => &[],
        }
    }

    /// Whether it was asked to end, and has not failed.
    pub(crate) const fn is_interruption(&self) -> bool {
        matches!(self.reason, Reason::Interrupted)
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

/// Whether no other method would come further.
pub(crate) fn is_final(error: &Error) -> bool {
    matches!(
        error.reason,
        Reason::Interrupted | Reason::TooManyRows { .. }
    )
}
