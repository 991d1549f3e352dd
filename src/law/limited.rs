//! The diode of straight lines with a current limit: LTspice's `Ilimit` and `Revilimit`.
//!
//! LTspice bends the line i = v/R into I tanh(v/(R I)). Here the hyperbolic tangent is replaced by its tangents at 0, at three points between
//! and at infinity: the slope at the corner and the limit are exact, and in between the current is at most 2 % of the limit too large.

use super::{Curve, ONE, ZERO};
use crate::algebra::Value;
use crate::settings::tolerances::netlists::TANGENTS;

/// One conducting side of the diode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side {
    /// The voltage at which it begins to conduct, V, positive.
    pub v: Value,
    /// Resistance, Ω.
    pub r: Value,
    /// Largest current, A, positive; `None` is no limit.
    pub limit: Option<f64>,
}

impl Side {
    /// The corners above (v, i₀), and the direction after the last one.
    fn bends(&self, leak: f64) -> (Vec<(f64, f64)>, (Value, Value)) {
        let Some(limit) = self.limit.filter(|limit| *limit > leak) else {
            return (Vec::new(), (self.r, ONE));
        };
        let rest = limit - leak;
        let (v, r) = (self.v.f64, self.r.f64);
        if r == 0.0 {
            return (vec![(v, limit)], (ONE, ZERO));
        }
        let corner = |&(x, y): &(f64, f64)| (v + r * rest * x, leak + rest * y);
        (tangents().iter().map(corner).collect(), (ONE, ZERO))
    }
}

/// The corners of the polygon of tangents around tanh.
fn tangents() -> Vec<(f64, f64)> {
    let line = |x: f64| {
        let slope = 1.0 - x.tanh().powi(2);
        (slope, x.tanh() - slope * x)
    };
    let mut before = line(0.0);
    let after = TANGENTS.iter().map(|&x| line(x)).chain([(0.0, 1.0)]);
    after
        .map(|(slope, offset)| {
            let x = (offset - before.1) / (before.0 - slope);
            before = (slope, offset);
            (x, slope * x + offset)
        })
        .collect()
}

impl Curve {
    /// The diode with limited currents: i = v/roff between −`reverse.v` and `forward.v` (0 where `roff` is `None`), and without `reverse`
    /// no breakdown. A limit that the leakage at the corner exceeds is none.
    #[must_use]
    pub fn limited(forward: Side, reverse: Option<Side>, roff: Option<Value>) -> Self {
        let leak = |v: f64| roff.map_or(0.0, |r| v / r.f64);
        let mut vertices = Vec::new();
        let mut first = roff.map_or((ONE, ZERO), |r| (r, ONE));
        if let Some(side) = reverse {
            let (bends, last) = side.bends(leak(side.v.f64));
            let mirrored = bends.iter().rev().map(|&(v, i)| ((-v).into(), (-i).into()));
            vertices.extend(mirrored);
            vertices.push((side.v.negated(), (-leak(side.v.f64)).into()));
            first = last;
        }
        let (bends, last) = forward.bends(leak(forward.v.f64));
        vertices.push((forward.v, leak(forward.v.f64).into()));
        vertices.extend(bends.iter().map(|&(v, i)| (v.into(), i.into())));
        Self {
            kind: "table",
            vertices,
            first,
            last,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_stay_close_above_the_curve() {
        let corners = tangents();
        let errors: Vec<f64> = corners.iter().map(|(x, y)| y - x.tanh()).collect();
        // A chain of tangents is farthest from a concave curve at its corners.
        assert!(errors.iter().all(|e| *e > 0.0 && *e < 0.0202), "{errors:?}");
        assert!((corners[0].0 - corners[0].1).abs() < 1e-15);
        assert!((corners[3].1 - 1.0).abs() < 1e-15);
    }

    #[test]
    fn both_currents_are_limited() {
        let side = |v: f64, r: f64, limit: f64| Side {
            v: v.into(),
            r: r.into(),
            limit: Some(limit),
        };
        let curve = Curve::limited(
            side(0.5, 0.1, 2.0),
            Some(side(5.0, 1.0, 0.25)),
            Some(1000.0.into()),
        );
        assert_eq!((curve.check(), curve.vertices.len()), (Ok(()), 10));
        // On the line of Ron near the corner, at the limits far away, on Roff between.
        assert!(curve.contains(0.52, 0.0005 + 0.2, 1.0, 1e-12));
        assert!(curve.contains(9.0, 2.0, 1.0, 1e-12));
        assert!(curve.contains(-9.0, -0.25, 1.0, 1e-12));
        assert!(curve.contains(-2.0, -0.002, 1.0, 1e-12));
        // A source current below the limit at zero resistance is at the drop.
        let steep = Curve::limited(side(0.5, 0.0, 2.0), None, None);
        assert!(steep.contains(0.5, 1.0, 1.0, 1e-12) && steep.contains(3.0, 2.0, 1.0, 1e-12));
        assert!(steep.contains(-3.0, 0.0, 1.0, 1e-12));
    }
}
