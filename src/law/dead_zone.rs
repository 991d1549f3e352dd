//! The dead zone: no output for small inputs, a straight gain beyond.

use super::{Curve, Law, ONE, ZERO};
use crate::algebra::Value;

impl Law {
    /// Output 0 for |input| ≤ `width`, slope `gain` beyond; both positive.
    #[must_use]
    pub fn dead_zone(width: Value, gain: Value) -> Self {
        Self::Curve(Curve {
            kind: "dead_zone",
            vertices: vec![(width.negated(), ZERO), (width, ZERO)],
            first: (ONE, gain),
            last: (ONE, gain),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dead_zone_shrinks_towards_zero() {
        let curve = Law::dead_zone(1.0.into(), 2.0.into()).curve().unwrap();
        assert_eq!(curve.resolvent(1.0, 0.5), (0.5, 0.0));
        // v + 2 (v − 1) = 4
        assert_eq!(curve.resolvent(1.0, 4.0), (2.0, 2.0));
        assert_eq!(curve.resolvent(1.0, -4.0), (-2.0, -2.0));
    }
}
