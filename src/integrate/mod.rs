//! From a complementarity system to waveforms.

pub mod exact;
pub mod run;
pub mod stats;

pub use run::{Frame, Grid, Log, Outcome, Reason, SimError, Stepper};
pub use stats::{Energy, Impulse, Run, Stats};
