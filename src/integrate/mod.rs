//! From a complementarity system to waveforms.

pub mod exact;
pub mod stats;

pub use stats::{Energy, Impulse, Run, Stats};
