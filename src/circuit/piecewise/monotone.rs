//! Piecewise-linear functions as sums of nondecreasing ones.

use super::{Piece, Piecewise};
use crate::algebra::Value;
use crate::law::Curve;

/// A nondecreasing function and the sign with which it enters a sum.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::circuit) struct Monotone {
    /// +1 or −1.
    pub(in crate::circuit) sign: f64,
    /// The function.
    pub(in crate::circuit) curve: Curve,
}

impl Piecewise {
    /// (u, jump) at every knot.
    fn jumps(&self) -> impl Iterator<Item = f64> {
        self.pieces.windows(2).map(|w| w[1].left - w[0].right)
    }

    /// f = linear·u + Σ ± nondecreasing functions. At jumps the functions take all values between.
    pub(in crate::circuit) fn monotone(&self) -> (f64, Vec<Monotone>) {
        let rises = self.pieces.iter().any(|p| p.slope > 0.0) || self.jumps().any(|j| j > 0.0);
        let falls = self.pieces.iter().any(|p| p.slope < 0.0) || self.jumps().any(|j| j < 0.0);
        let one = |f: &Self, sign| Monotone {
            sign,
            curve: f.clone().scaled(sign).curve(),
        };
        match (rises, falls) {
            (_, false) => (0.0, vec![one(self, 1.0)]),
            (false, true) => (0.0, vec![one(self, -1.0)]),
            (true, true) if self.knots.len() == 1 && self.jumps().all(|j| j == 0.0) => {
                // One corner, as of |u|: a hinge and a line.
                let least = self.pieces[0].slope.min(self.pieces[1].slope);
                (least, vec![one(&self.plus(&Self::line(-least, 0.0)), 1.0)])
            }
            (true, true) => {
                let parts = self.split().into_iter().map(|(sign, part)| Monotone {
                    sign,
                    curve: part.curve(),
                });
                (0.0, parts.collect())
            }
        }
    }

    /// f = up − down, each nondecreasing, with their signs.
    fn split(&self) -> [(f64, Self); 2] {
        let part = |sign: f64, start: f64| {
            let mut y = start;
            let mut pieces = Vec::with_capacity(self.pieces.len());
            for (k, piece) in self.pieces.iter().enumerate() {
                let jump = k
                    .checked_sub(1)
                    .map_or(0.0, |i| piece.left - self.pieces[i].right);
                y += (sign * jump).max(0.0);
                let left = y;
                y += (sign * (piece.right - piece.left)).max(0.0);
                pieces.push(Piece {
                    left,
                    right: y,
                    slope: (sign * piece.slope).max(0.0),
                });
            }
            Self {
                knots: self.knots.clone(),
                pieces,
            }
            .simplified()
        };
        [
            (1.0, part(1.0, self.pieces[0].left)),
            (-1.0, part(-1.0, 0.0)),
        ]
    }

    /// A nondecreasing function as a curve; a line gets a corner at zero.
    fn curve(&self) -> Curve {
        let whole = if self.knots.is_empty() {
            self.refined(&[0.0])
        } else {
            self.clone()
        };
        let mut vertices: Vec<(Value, Value)> = Vec::new();
        let mut least = f64::NEG_INFINITY;
        for (k, &u) in whole.knots.iter().enumerate() {
            let ends = (whole.pieces[k].right, whole.pieces[k + 1].left);
            let ends = (ends.0.max(least), ends.1.max(ends.0).max(least));
            vertices.push((u.into(), ends.0.into()));
            if ends.1 > ends.0 {
                vertices.push((u.into(), ends.1.into()));
            }
            least = ends.1;
        }
        let slopes: Vec<f64> = whole.pieces.iter().map(|p| p.slope).collect();
        let ray = |slope: f64| (Value::decimal(1.0, 1, 0), Value::binary(slope));
        match (&slopes[..], &vertices[..]) {
            (&[0.0, 0.0], &[(at, low), (_, high)]) => Curve::relay(at, low, high),
            (&[0.0, slope, 0.0], &[from, to]) if slope > 0.0 => Curve::saturation(from, to),
            (&[a, 0.0, b], &[(from, level), (to, _)]) if a > 0.0 && b > 0.0 => {
                Curve::dead_zone((from, to), level, (a.into(), b.into()))
            }
            _ => {
                let ends = [slopes.first(), slopes.last()].map(|s| ray(s.copied().unwrap_or(0.0)));
                Curve::table(vertices, ends[0], ends[1])
            }
        }
    }
}
