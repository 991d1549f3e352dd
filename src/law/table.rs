//! A table of points, continued straight beyond its ends.

use super::curve::CurveError;
use super::{Curve, Law};
use crate::algebra::Value;

impl Law {
    /// The curve through `points` (v, i), both coordinates nondecreasing, with the given directions of its ends.
    ///
    /// # Errors
    /// [`CurveError`] if it is not monotone.
    pub fn table(
        points: Vec<(Value, Value)>,
        first: (Value, Value),
        last: (Value, Value),
    ) -> Result<Self, CurveError> {
        let curve = Curve {
            kind: "table",
            vertices: points,
            first,
            last,
        };
        curve.check().map(|()| Self::Curve(curve))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_must_not_decrease() {
        let point = |v: f64, i: f64| (Value::binary(v), Value::binary(i));
        let ends = (point(1.0, 0.0), point(1.0, 0.0));
        let falling = Law::table(vec![point(0.0, 1.0), point(1.0, 0.0)], ends.0, ends.1);
        assert_eq!(falling, Err(CurveError::Backwards));
        let rising = Law::table(vec![point(0.0, 0.0), point(1.0, 2.0)], ends.0, ends.1).unwrap();
        assert_eq!(rising.curve().unwrap().resolvent(0.5, 1.0), (0.5, 1.0));
    }
}
