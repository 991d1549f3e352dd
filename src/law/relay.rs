//! The relay: the sign function between two output levels, any level at the threshold itself.

use super::{Curve, ONE, ZERO};
use crate::algebra::Value;

impl Curve {
    /// Output `low` below the input `at`, `high` above it, anything between at `at`; `low` ≤ `high`.
    #[must_use]
    pub fn relay(at: Value, low: Value, high: Value) -> Self {
        Self {
            kind: "relay",
            vertices: vec![(at, low), (at, high)],
            first: (ONE, ZERO),
            last: (ONE, ZERO),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_relay_switches_at_its_threshold() {
        let curve = Curve::relay(ZERO, (-1.0).into(), 3.0.into());
        assert_eq!(curve.resolvent(2.0, -4.0), (-2.0, -1.0));
        assert_eq!(curve.resolvent(2.0, 1.0), (0.0, 0.5));
        assert_eq!(curve.resolvent(2.0, 8.0), (2.0, 3.0));
        // φ(y) = −y below, 3 y above.
        assert_eq!((curve.potential(-2.0), curve.potential(2.0)), (2.0, 6.0));
        let shifted = Curve::relay(1.5.into(), (-1.0).into(), 3.0.into());
        assert_eq!(shifted.resolvent(2.0, 2.5), (1.5, 0.5));
    }
}
