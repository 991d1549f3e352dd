//! The exact integrator: within a mode the circuit is a linear system driven by an exosystem, and its solution is a
//! matrix exponential; between modes stands a complementarity problem.

mod accumulation;
mod ahead;
mod assembler;
mod clock;
mod energy_integral;
mod exosystem;
mod flow;
mod free;
mod inspect;
mod jump;
mod key;
mod magnitudes;
mod map;
mod mode;
mod modes;
mod passage;
mod plant;
mod recurring;
mod report;
mod rounding;
mod sampled;
mod slaved;
mod sources;
mod spectrum;
mod stepper;
mod storage;
mod transition;
mod travel;

#[cfg(test)]
pub(super) mod tests;

pub use assembler::Assembler;
pub(crate) use assembler::{Reduced, Step, steps_of};
pub(crate) use exosystem::{Exosystem, Shape};
pub(crate) use key::{Key, Owner};
pub(crate) use mode::over_w;
pub(crate) use modes::Modes;
pub(crate) use passage::{Corners, Passage};
pub(crate) use report::row_jumps;
pub(crate) use spectrum::Spectrum;
pub(crate) use stepper::Place;
pub use stepper::{Exact, Setup};
