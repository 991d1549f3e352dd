//! The zener diode: conducts above the forward drop and below the breakdown voltage.

use super::{Curve, ONE, ZERO};
use crate::algebra::Value;

impl Curve {
    /// The zener diode of straight lines: `reverse` and `forward` are its voltage, positive, and resistance on either side;
    /// between them i = v/roff, or 0 where `roff` is `None`.
    #[must_use]
    pub fn zener(reverse: (Value, Value), forward: (Value, Value), roff: Option<Value>) -> Self {
        let point = |v: Value| {
            let leak = roff.map_or(ZERO, |r| Value::binary(v.f64 / r.f64));
            (v, leak)
        };
        Self {
            kind: "zener",
            vertices: vec![point(reverse.0.negated()), point(forward.0)],
            first: (reverse.1, ONE),
            last: (forward.1, ONE),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zener_clamps_both_ways() {
        let curve = Curve::zener((5.0.into(), ZERO), (1.0.into(), ZERO), None);
        assert_eq!(curve.resolvent(1.0, 3.0), (1.0, 2.0));
        assert_eq!(curve.resolvent(1.0, 0.5), (0.5, 0.0));
        assert_eq!(curve.resolvent(1.0, -7.0), (-5.0, -2.0));
        assert_eq!(curve.potential(0.0), 0.0);
        assert_eq!(curve.potential(-5.1), f64::INFINITY);
    }
}
