//! Saturation: a straight gain between two output levels (an op-amp with rails, a comparator with a finite gain).

use super::{Curve, Law, ONE, ZERO};
use crate::algebra::Value;

impl Law {
    /// Output `low` below input −`width`, `high` above `width`, linear between; `width` > 0.
    #[must_use]
    pub fn saturation(low: Value, high: Value, width: Value) -> Self {
        Self::Curve(Curve {
            kind: "saturation",
            vertices: vec![(width.negated(), low), (width, high)],
            first: (ONE, ZERO),
            last: (ONE, ZERO),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_saturation_is_linear_between_its_rails() {
        let curve = Law::saturation(0.0.into(), 3.0.into(), 0.15.into())
            .curve()
            .unwrap();
        assert!(curve.contains(0.0, 1.5, 1.0, 1e-12));
        assert!(curve.contains(-1.0, 0.0, 1.0, 1e-12) && curve.contains(1.0, 3.0, 1.0, 1e-12));
        assert!(!curve.contains(0.1, 1.5, 1.0, 1e-12));
    }
}
