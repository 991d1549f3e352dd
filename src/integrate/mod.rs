//! From a complementarity system to waveforms.

pub mod aliasing;
mod beside;
mod companion;
pub mod control;
mod cpu;
mod curved;
mod difference;
pub mod energy;
mod error;
pub mod event;
pub mod exact;
#[cfg(test)]
#[path = "../../tests/systems/mod.rs"]
pub(crate) mod fixtures;
mod grid;
mod handover;
mod impulses;
pub mod inputs;
pub mod jump;
mod lawful;
pub mod line;
mod located;
mod log;
mod note;
mod orbit;
mod parts;
mod problem;
pub mod reading;
mod ready;
mod roles;
pub mod rows;
pub mod run;
mod settle;
pub mod simulate;
pub mod simulation;
mod sparse;
pub mod start;
pub mod stats;
pub mod step;
pub mod switching;
pub mod system;
pub mod theta;
pub mod verify;

pub use aliasing::{Aliased, aliased};
pub(crate) use curved::tableau::STAGES;
pub(crate) use difference::grow;
pub use error::{Error, NoRest, Reason};
pub use event::{Change, Event};
pub use grid::Grid;
pub use log::Log;
pub use note::{Note, Places};
pub use orbit::{Orbit, OrbitKind};
pub use rows::{Asked, Block, RowKind, Sink};
pub use run::{Frame, Outcome, Stepper};
pub(crate) use simulate::simulate_beside;
pub use simulate::{Method, SimOptions, Standing, simulate, simulate_system};
pub use simulation::{Checkpoint, Simulation, SimulationOptions, Stop, StopReason};
pub(crate) use sparse::{
    Bend, Drive, Lengths, Passed, Reads, Returned, Returns, Sine, Stepped, Tape, Weighed,
    through_stages,
};
pub use start::{OperatingPoint, Values, operating_point};
pub use stats::{Energy, Impulse, JumpReason, Run, StateJump, StateJumps, StatedError, Stats};
pub use verify::{Verified, VerifyOptions, verify, verify_system};
