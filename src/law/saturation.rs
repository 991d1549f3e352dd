//! Saturation: a straight gain between two output levels (an op-amp with rails, a comparator with a finite gain).

use super::{Curve, ONE, ZERO};
use crate::algebra::Value;

impl Curve {
    /// Constant before the point `from` (input, output) and after `to`, straight between; `from` is below `to` in both coordinates.
    #[must_use]
    pub fn saturation(from: (Value, Value), to: (Value, Value)) -> Self {
        Self {
            kind: "saturation",
            vertices: vec![from, to],
            first: (ONE, ZERO),
            last: (ONE, ZERO),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_saturation_is_linear_between_its_rails() {
        let curve = Curve::saturation(((-0.15).into(), ZERO), (0.15.into(), 3.0.into()));
        assert!(curve.contains(0.0, 1.5, 1.0, 1e-12));
        assert!(curve.contains(-1.0, 0.0, 1.0, 1e-12) && curve.contains(1.0, 3.0, 1.0, 1e-12));
        assert!(!curve.contains(0.1, 1.5, 1.0, 1e-12));
    }
}
