//! What rounding leaves of guards and of times.

/// Rounding of a computed guard, in units of 2⁻⁵³ Σ |row| |w|.
pub(super) const NOISE: f64 = 16.0;
/// Guards within this many times the rounding noise of one evaluation are taken together as zero: simultaneous events of
/// symmetric circuits differ by the roundings of a few operations.
pub(super) const GROUP: f64 = 128.0;
/// The same in units of a guard's [noise](super::flow::Flow::noise).
pub(super) const SIMULTANEOUS: f64 = GROUP / NOISE;
/// Event times are known to this many units in the last place.
const TIME_ULPS: f64 = 8.0;

/// What event times near t are known to, s.
pub(super) fn resolution(t: f64) -> f64 {
    TIME_ULPS * f64::EPSILON * t.abs()
}
