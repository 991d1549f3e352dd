//! What is measured of a run.

use crate::analysis::conducting::Conduction;
use crate::analysis::table::Table;
use crate::analysis::worst::Worst;
use crate::circuit::{Circuit, Harmonics, Measured};
use crate::integrate::{Error, Run};

/// The outcome of the measurements of one run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Measurements {
    /// Of `.meas`, in file order.
    pub measured: Vec<Measured>,
    /// Of `.four`, in file order.
    pub harmonics: Vec<Harmonics>,
    /// The means of all elements, where they were asked for.
    pub table: Option<Table>,
    /// The ranges of measurements within tolerances, where they were asked for.
    pub worst: Vec<Worst>,
    /// Of a run for pictures when devices of curved laws conduct, which none of its events tells.
    pub conduction: Vec<Conduction>,
}

impl Measurements {
    /// Whether nothing was asked for.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.measured.is_empty()
            && self.harmonics.is_empty()
            && self.table.is_none()
            && self.worst.is_empty()
    }
}

/// A run, or as much of it as there is.
#[derive(Debug)]
pub struct Finished {
    /// The rows, and what was measured on them.
    pub run: Option<(Run, Measurements)>,
    /// Why it ended early.
    pub error: Option<Error>,
}

impl Finished {
    /// A run without measurements.
    #[must_use]
    pub fn of(result: Result<Run, Error>) -> Self {
        let (run, error) = match result {
            Ok(run) => (Some(run), None),
            Err(mut error) => (error.partial.take().map(|run| *run), Some(error)),
        };
        Self {
            run: run.map(|run| (run, Measurements::default())),
            error,
        }
    }
}

/// Whether a circuit asks for measurements; then [`transient`](super::transient) holds its rows until the end.
#[must_use]
pub fn is_measured(circuit: &Circuit) -> bool {
    !circuit.measured.is_empty() || !circuit.measurements.is_empty()
}
