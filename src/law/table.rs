//! A table of points, continued straight beyond its ends.

use super::Curve;
use crate::algebra::Value;

impl Curve {
    /// The curve through `points` (v, i) with the given directions of its ends; [`Curve::check`] tells whether it is monotone.
    #[must_use]
    pub fn table(points: Vec<(Value, Value)>, first: (Value, Value), last: (Value, Value)) -> Self {
        Self {
            kind: "table",
            vertices: points,
            first,
            last,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::CurveError;
    use super::*;

    #[test]
    fn a_table_must_not_decrease() {
        let point = |v: f64, i: f64| (Value::binary(v), Value::binary(i));
        let ends = (point(1.0, 0.0), point(1.0, 0.0));
        let falling = Curve::table(vec![point(0.0, 1.0), point(1.0, 0.0)], ends.0, ends.1);
        assert_eq!(falling.check(), Err(CurveError::Backwards));
        let rising = Curve::table(vec![point(0.0, 0.0), point(1.0, 2.0)], ends.0, ends.1);
        assert_eq!(rising.check(), Ok(()));
        assert_eq!(rising.resolvent(0.5, 1.0), (0.5, 1.0));
    }
}
