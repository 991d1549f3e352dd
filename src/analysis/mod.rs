//! What is asked of a circuit besides one transient: functions of a [`Model`](crate::Model) and of options.
//!
//! | question | answer |
//! |---|---|
//! | `.meas` and `.four` of a transient | [`transient`]: a run with its [`Measurements`] |
//! | `.dc` | [`dc`]: a [`Characteristic`] |
//! | the periodic steady state | [`periodic`]: its [`Orbit`] and one period of waveforms |
//! | `.step`, or any other values | [`variants`]: a [`Variant`] for every combination of values; [`each`] asks all of them, in parallel |

mod dc;
mod measured;
mod periodic;
mod sweep;
mod variation;

pub use crate::integrate::{Orbit, OrbitKind};
pub use dc::{Characteristic, Unsolved, dc};
pub use measured::{Finished, Measurements, is_measured, transient};
pub use periodic::{PeriodicOptions, periodic};
pub use sweep::{Variant, each, variants};
