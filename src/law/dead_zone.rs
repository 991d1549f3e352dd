//! The dead zone: a constant output for inputs between two bounds, a straight gain beyond.

use super::{Curve, ONE};
use crate::algebra::Value;

impl Curve {
    /// Output `level` for inputs from `bounds.0` to `bounds.1`, the slopes `gains` below and above; the gains are positive.
    #[must_use]
    pub fn dead_zone(bounds: (Value, Value), level: Value, gains: (Value, Value)) -> Self {
        Self {
            kind: "dead_zone",
            vertices: vec![(bounds.0, level), (bounds.1, level)],
            first: (ONE, gains.0),
            last: (ONE, gains.1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ZERO;
    use super::*;

    #[test]
    fn a_dead_zone_shrinks_towards_zero() {
        let curve = Curve::dead_zone(((-1.0).into(), 1.0.into()), ZERO, (2.0.into(), 2.0.into()));
        assert_eq!(curve.resolvent(1.0, 0.5), (0.5, 0.0));
        // v + 2 (v − 1) = 4
        assert_eq!(curve.resolvent(1.0, 4.0), (2.0, 2.0));
        assert_eq!(curve.resolvent(1.0, -4.0), (-2.0, -2.0));
    }
}
