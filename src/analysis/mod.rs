//! What is asked of a circuit besides one transient: functions of a [`Model`](crate::Model) and of options.
//!
//! | question | answer |
//! |---|---|
//! | `.meas` and `.four` of a transient | [`transient`]: a run with its [`Measurements`] |
//! | a transient for a picture | [`pictured`]: the same with rows between, where curves ask for them |
//! | what rows cannot show | [`ringing`]: a frequency of the circuit's own |
//! | `.dc` | [`dc`]: a [`Characteristic`] |
//! | what conducts at an instant | [`conducting()`]: names of devices and switches |
//! | the periodic steady state | [`periodic`]: its [`Orbit`] and one period of waveforms |
//! | `.ac`, small signals about the operating point or that state | [`small_signal`]: a [`Response`] over frequency |
//! | derivatives of `.meas` to element values and parameters | [`sensitivity()`]: a [`Sensitivity`] |
//! | what tolerances make of a `.meas` | [`worst()`]: a [`Worst`] |
//! | means, extrema and powers of all elements, efficiency, distortion | [`table()`], [`periodic_table`]: a [`Table`] |
//! | `.step`, or any other values | [`variants`]: a [`Variant`] for every combination of values; [`each`] asks all of them, in parallel |
//! | tolerances and random values | [`samples`] of variants; [`sweep()`] gives a [`Row`] of `.meas` for each |

mod conducting;
mod curves;
mod dc;
mod density;
mod measured;
mod periodic;
mod sensitivity;
mod shown;
mod small_signal;
mod start;
mod sweep;
mod table;
mod variation;
mod worst;

pub use crate::integrate::{Orbit, OrbitKind};
pub use conducting::{Conduction, conducting};
#[cfg(feature = "cli")]
pub(crate) use curves::shortest_period;
pub use dc::{Characteristic, Unsolved, dc};
pub use density::ringing;
pub use measured::{Finished, Measurements, is_measured, periodic_measured, pictured, transient};
pub use periodic::{PeriodicOptions, orbit_start, periodic};
pub use sensitivity::{
    Gradient, Passes, Sensitivity, SensitivityMethod, SensitivityOptions, sensitivity,
};
pub use shown::{Undefined, shown, shown_values};
pub use small_signal::{
    About, Left, Margin, Ratio, Response, SmallSignalOptions, margins, ratios, small_signal,
    small_signal_measured, unwrapped,
};
pub use sweep::{
    Row, SweepOptions, Variant, drawn_names, each, measured_names, samples, steps, sweep, variants,
};
#[cfg(feature = "cli")]
pub(crate) use table::table_names;
pub use table::{
    DeviceLosses, ElementMeans, Mean, SignalMeans, Span, Switching, Table, TableOptions,
    Throughput, periodic_table, table,
};
#[cfg(feature = "cli")]
pub(crate) use worst::toleranced;
pub use worst::{Bound, Worst, WorstOptions, worst};
