//! Which quantity of each device is λ, where that decides how much of A is lost in doubles.
//!
//! With λ = −v of a diode behind 1 µΩ a capacitor of 1 fF has the rate −1/RC = −10²¹ 1/s, beside which the 10³ 1/s of its other
//! resistor is lost; with λ = i the same circuit has A = −10³ 1/s. Roles are left as the reduction prefers them until the
//! rates of A span so much that the slow ones would be noise.

use crate::lcs::Lcs;
use crate::settings::tolerances::steps::{ROLES_GAIN, ROLES_LOST};

/// Whether the system is so fast that other roles are worth a look; `span` in s.
pub(crate) fn doubtful(lcs: &Lcs, span: f64) -> bool {
    fastest(lcs) * span > ROLES_LOST
}

/// Whether `other`, the same circuit in other roles, keeps more of A.
pub(crate) fn better(lcs: &Lcs, other: &Lcs) -> bool {
    fastest(other) < ROLES_GAIN * fastest(lcs)
}

/// The largest entry of A in coordinates of equal energy, 1/s.
fn fastest(lcs: &Lcs) -> f64 {
    let size = |k: usize| lcs.energy[(k, k)].abs().sqrt();
    let mut largest = 0.0_f64;
    for i in 0..lcs.n() {
        for j in 0..lcs.n() {
            let scaled = lcs.a[(i, j)].abs() * size(i) / size(j);
            largest = largest.max(if scaled.is_finite() { scaled } else { 0.0 });
        }
    }
    largest
}
