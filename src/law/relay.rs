//! The relay: the sign function between two output levels, any level at the threshold itself.

use super::{Curve, Law, ONE, ZERO};
use crate::algebra::Value;

impl Law {
    /// Output `low` below input 0, `high` above it, anything between at 0; `low` ≤ `high`.
    #[must_use]
    pub fn relay(low: Value, high: Value) -> Self {
        Self::Curve(Curve {
            kind: "relay",
            vertices: vec![(ZERO, low), (ZERO, high)],
            first: (ONE, ZERO),
            last: (ONE, ZERO),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_relay_switches_at_zero() {
        let curve = Law::relay((-1.0).into(), 3.0.into()).curve().unwrap();
        assert_eq!(curve.resolvent(2.0, -4.0), (-2.0, -1.0));
        assert_eq!(curve.resolvent(2.0, 1.0), (0.0, 0.5));
        assert_eq!(curve.resolvent(2.0, 8.0), (2.0, 3.0));
        // φ(y) = −y below, 3 y above.
        assert_eq!((curve.potential(-2.0), curve.potential(2.0)), (2.0, 6.0));
    }
}
