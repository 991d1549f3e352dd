//! Steps of circuits with curved laws whose lengths follow the error alone: a method of order 4 with an embedded error estimate, Newton's
//! method on the resolvents at its stages, and dense output.
//!
//! | file | what |
//! |---|---|
//! | `tableau` | the coefficients |
//! | `implicit` | a system's matrices for one step length, and one stage |
//! | `instant` | λ on the laws where the state jumped or a run begins |
//! | `trial` | the buffers of a step on its way, and what it says of its error |
//! | `swing` | slopes that swing from step to step at a state that rests |
//! | `segment` | dense output: what rows within a step are read from |
//! | `forms` | energies and readings |
//!
//! Nothing is allocated in a step whose length was met before. When steps are made, and what switches and edges do with them, stands in
//! [`theta`](crate::integrate::theta).

mod forms;
mod implicit;
mod instant;
mod segment;
mod swing;
pub(crate) mod tableau;
mod trial;

pub(crate) use implicit::Curved;
pub(crate) use segment::{Segments, Within};
pub(crate) use trial::{Start, Trial};
