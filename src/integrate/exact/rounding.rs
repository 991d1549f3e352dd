//! What rounding leaves of guards and of times.

use crate::settings::tolerances::times::SAME_TIME;

/// What event times near t are known to, s.
pub(super) fn resolution(t: f64) -> f64 {
    SAME_TIME * t.abs()
}
