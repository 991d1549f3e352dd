//! Piecewise-linear functions of one variable, with jumps: composed, multiplied, and split into monotone curves.

use crate::algebra::Value;
use crate::law::Curve;

/// Most knots of one function.
const MAX_KNOTS: usize = 1_000;
/// Two lines meet in a knot, or have one slope, if they differ by less than so many roundings.
const ROUNDINGS: f64 = 64.0;

/// One affine piece between two knots.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    /// The limit at its left end; of the first piece, which has none, at its right end.
    left: f64,
    /// The limit at its right end; of the last piece, which has none, at its left end.
    right: f64,
    slope: f64,
}

/// f(u), affine between the knots and on the rays outside; at a knot it may jump.
///
/// Without knots it is one line, whose `left` and `right` are f(0).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Piecewise {
    /// Strictly increasing.
    knots: Vec<f64>,
    /// One more than knots.
    pieces: Vec<Piece>,
}

/// A nondecreasing function and the sign with which it enters a sum.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Monotone {
    /// +1 or −1.
    pub(super) sign: f64,
    /// The function.
    pub(super) curve: Curve,
}

impl Piecewise {
    /// slope·u + constant.
    pub(super) fn line(slope: f64, constant: f64) -> Self {
        Self {
            knots: Vec::new(),
            pieces: vec![Piece {
                left: constant,
                right: constant,
                slope,
            }],
        }
    }

    /// Straight between the points (u nondecreasing, equal u a jump), with these slopes outside.
    pub(super) fn through(points: &[(f64, f64)], first: f64, last: f64) -> Self {
        let Some(&(u, y)) = points.first() else {
            return Self::line(0.0, 0.0);
        };
        let mut knots = vec![u];
        let mut pieces = vec![Piece {
            left: y,
            right: y,
            slope: first,
        }];
        let mut before = (u, y);
        for &(u, y) in &points[1..] {
            if u > before.0 {
                knots.push(u);
                pieces.push(Piece {
                    left: before.1,
                    right: y,
                    slope: (y - before.1) / (u - before.0),
                });
            }
            before = (u, y);
        }
        pieces.push(Piece {
            left: before.1,
            right: before.1,
            slope: last,
        });
        Self { knots, pieces }
    }

    /// max(0, u).
    pub(super) fn ramp() -> Self {
        Self::through(&[(0.0, 0.0)], 0.0, 1.0)
    }

    /// 0 for u < level, 1 for u > level.
    pub(super) fn step(level: f64) -> Self {
        Self::through(&[(level, 0.0), (level, 1.0)], 0.0, 0.0)
    }

    /// Number of knots.
    pub(super) fn corners(&self) -> usize {
        self.knots.len()
    }

    /// slope and f(0), if there is no knot.
    pub(super) fn as_line(&self) -> Option<(f64, f64)> {
        (self.knots.is_empty()).then(|| (self.pieces[0].slope, self.pieces[0].left))
    }

    /// Whether all numbers are finite.
    pub(super) fn is_finite(&self) -> bool {
        let sound = |p: &Piece| (p.left + p.right).is_finite() && p.slope.is_finite();
        self.knots.iter().all(|u| u.is_finite()) && self.pieces.iter().all(sound)
    }

    /// f(u); at a jump the value before it.
    pub(super) fn value(&self, u: f64) -> f64 {
        self.at(self.knots.partition_point(|&x| x < u), u)
    }

    /// The limit of piece `k`, continued to `u`.
    fn at(&self, k: usize, u: f64) -> f64 {
        let piece = self.pieces[k];
        let left = k.checked_sub(1).map(|i| self.knots[i]);
        match (left, self.knots.get(k)) {
            (None, None) => piece.left + piece.slope * u,
            (None, Some(&u1)) => piece.right + piece.slope * (u - u1),
            (Some(u0), None) => piece.left + piece.slope * (u - u0),
            (Some(_), Some(&u1)) if u == u1 => piece.right,
            (Some(u0), Some(&u1)) => {
                piece.left + (piece.right - piece.left) * ((u - u0) / (u1 - u0))
            }
        }
    }

    /// The same function on its own knots and these.
    fn refined(&self, more: &[f64]) -> Self {
        let mut knots = [self.knots.as_slice(), more].concat();
        knots.sort_by(f64::total_cmp);
        knots.dedup();
        let pieces = (0..=knots.len())
            .map(|j| {
                let left = j.checked_sub(1).map(|i| knots[i]);
                let right = knots.get(j).copied();
                let k = left.map_or(0, |u| self.knots.partition_point(|&x| x <= u));
                let ends = (left.or(right), right.or(left));
                Piece {
                    left: self.at(k, ends.0.unwrap_or(0.0)),
                    right: self.at(k, ends.1.unwrap_or(0.0)),
                    slope: self.pieces[k].slope,
                }
            })
            .collect();
        Self { knots, pieces }
    }

    pub(super) fn scaled(mut self, factor: f64) -> Self {
        for piece in &mut self.pieces {
            piece.left *= factor;
            piece.right *= factor;
            piece.slope *= factor;
        }
        self
    }

    pub(super) fn plus(&self, other: &Self) -> Self {
        self.pointwise(other, |p, q| {
            Some(Piece {
                left: p.left + q.left,
                right: p.right + q.right,
                slope: p.slope + q.slope,
            })
        })
        .unwrap_or_else(|| self.clone())
    }

    /// The product; `None` where two factors vary at once.
    pub(super) fn times(&self, other: &Self) -> Option<Self> {
        let constant = |p: &Piece| p.slope == 0.0 && p.left == p.right;
        self.pointwise(other, |p, q| {
            let (factor, piece) = if constant(&p) {
                (p.left, q)
            } else if constant(&q) {
                (q.left, p)
            } else {
                return None;
            };
            Some(Piece {
                left: factor * piece.left,
                right: factor * piece.right,
                slope: factor * piece.slope,
            })
        })
    }

    fn pointwise(
        &self,
        other: &Self,
        operation: impl Fn(Piece, Piece) -> Option<Piece>,
    ) -> Option<Self> {
        let (a, b) = (self.refined(&other.knots), other.refined(&self.knots));
        let pieces = a.pieces.iter().zip(&b.pieces);
        let pieces = pieces
            .map(|(p, q)| operation(*p, *q))
            .collect::<Option<_>>()?;
        Some(
            Self {
                knots: a.knots,
                pieces,
            }
            .simplified(),
        )
    }

    /// outer(self(u)); `None` if that has too many knots.
    pub(super) fn then(&self, outer: &Self) -> Option<Self> {
        // Where this function passes a knot of the outer one.
        let mut passes = Vec::new();
        for (k, piece) in self.pieces.iter().enumerate() {
            if piece.slope == 0.0 {
                continue;
            }
            let left = k.checked_sub(1).map(|i| self.knots[i]);
            let right = self.knots.get(k).copied();
            for &level in &outer.knots {
                let u = match (left, right) {
                    (None, None) => (level - piece.left) / piece.slope,
                    (None, Some(u)) | (Some(u), None) => u + (level - piece.left) / piece.slope,
                    (Some(u0), Some(u1)) => {
                        u0 + (u1 - u0) * ((level - piece.left) / (piece.right - piece.left))
                    }
                };
                if u.is_finite() && left.is_none_or(|l| l < u) && right.is_none_or(|r| u < r) {
                    passes.push((u, level));
                }
            }
            if passes.len() > MAX_KNOTS {
                return None;
            }
        }
        let mut inner = self.refined(&passes.iter().map(|p| p.0).collect::<Vec<_>>());
        if inner.knots.len() > MAX_KNOTS {
            return None;
        }
        for (u, level) in passes {
            let i = inner.knots.partition_point(|&x| x < u);
            inner.pieces[i].right = level;
            inner.pieces[i + 1].left = level;
        }
        let last = inner.knots.len();
        if last > 0 {
            inner.pieces[0].left = inner.pieces[0].right;
            inner.pieces[last].right = inner.pieces[last].left;
        }
        let below = |y: f64| outer.knots.partition_point(|&x| x < y);
        let up_to = |y: f64| outer.knots.partition_point(|&x| x <= y);
        let pieces = inner
            .pieces
            .iter()
            .enumerate()
            .map(|(j, piece)| {
                // The outer piece over this one: all of it lies in one.
                let rises_away = if j == 0 { -piece.slope } else { piece.slope };
                let k = if j > 0 && j < last {
                    below(0.5 * (piece.left + piece.right))
                } else if last > 0 && rises_away > 0.0 {
                    up_to(piece.left)
                } else {
                    below(piece.left)
                };
                Piece {
                    left: outer.at(k, piece.left),
                    right: outer.at(k, piece.right),
                    slope: outer.pieces[k].slope * piece.slope,
                }
            })
            .collect();
        let knots = inner.knots;
        Some(Self { knots, pieces }.simplified())
    }

    /// Without the knots where nothing happens, and without jumps that are mere rounding.
    fn simplified(self) -> Self {
        let mut knots = Vec::with_capacity(self.knots.len());
        let mut pieces = vec![self.pieces[0]];
        for (&u, &next) in self.knots.iter().zip(&self.pieces[1..]) {
            let mut next = next;
            let Some(last) = pieces.last_mut() else { break };
            let size = last.right.abs()
                + next.left.abs()
                + (last.slope.abs() + next.slope.abs()) * u.abs();
            let continuous = (last.right - next.left).abs() <= ROUNDINGS * f64::EPSILON * size;
            if continuous {
                if next.right == next.left {
                    next.right = last.right;
                }
                next.left = last.right;
            }
            let bend = (last.slope - next.slope).abs();
            if continuous
                && bend <= ROUNDINGS * f64::EPSILON * (last.slope.abs() + next.slope.abs())
            {
                last.right = next.right;
                if knots.is_empty() {
                    // Still the first ray: it ends at the next knot.
                    last.left = last.right;
                }
                continue;
            }
            knots.push(u);
            pieces.push(next);
        }
        let last = pieces.len() - 1;
        if last > 0 {
            pieces[last].right = pieces[last].left;
        } else if let Some(&u) = self.knots.last() {
            // One line: stated at zero.
            let whole = &mut pieces[0];
            whole.left = whole.right - whole.slope * u;
            whole.right = whole.left;
        }
        Self { knots, pieces }
    }

    /// (u, jump) at every knot.
    fn jumps(&self) -> impl Iterator<Item = f64> {
        self.pieces.windows(2).map(|w| w[1].left - w[0].right)
    }

    /// f = linear·u + Σ ± nondecreasing functions. At jumps the functions take all values between.
    pub(super) fn monotone(&self) -> (f64, Vec<Monotone>) {
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

    /// The points with the values at both ends `from` and `to` included; two points at one u are a jump.
    pub(super) fn points(&self, from: f64, to: f64) -> Vec<(f64, f64)> {
        let inside = self.refined(&[from, to]);
        let mut points = Vec::new();
        for (k, &u) in inside.knots.iter().enumerate() {
            if u < from || u > to {
                continue;
            }
            let (before, after) = (inside.pieces[k].right, inside.pieces[k + 1].left);
            if u > from {
                points.push((u, before));
            }
            if u == from || after != before {
                points.push((u, after));
            }
        }
        points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// f just left and just right of u, from the pieces.
    fn both(f: &Piecewise, u: f64) -> (f64, f64) {
        let left = f.knots.partition_point(|&x| x < u);
        let right = f.knots.partition_point(|&x| x <= u);
        (f.at(left, u), f.at(right, u))
    }

    fn value(f: &Piecewise, u: f64) -> f64 {
        both(f, u).1
    }

    #[test]
    fn composition_is_pointwise() {
        let tent = Piecewise::through(&[(-1.0, 0.0), (0.0, 2.0), (1.0, 0.0)], 0.0, -3.0);
        let outer = Piecewise::through(&[(0.5, 1.0), (0.5, 2.0), (1.5, 4.0)], 1.0, 0.5);
        let both = tent.then(&outer).expect("few knots");
        for k in -40..40 {
            let u = f64::from(k) * 0.077;
            let expected = value(&outer, value(&tent, u));
            assert!((value(&both, u) - expected).abs() < 1e-12, "{u}");
        }
        let product = tent.times(&Piecewise::step(0.3)).expect("a step");
        assert_eq!(value(&product, 0.2), 0.0);
        assert!((value(&product, 0.5) - 1.0).abs() < 1e-15);
        assert_eq!(tent.times(&tent), None);
    }

    #[test]
    fn a_steep_clamp_keeps_its_numbers() {
        let clamp = Piecewise::through(&[(-4.8, -4.8), (4.8, 4.8)], 0.0, 0.0);
        let f = Piecewise::line(1e5, 0.0).then(&clamp).expect("two knots");
        let (linear, parts) = f.monotone();
        assert_eq!((linear, parts.len(), parts[0].sign), (0.0, 1, 1.0));
        let curve = &parts[0].curve;
        assert_eq!(curve.kind, "saturation");
        let corners: Vec<(f64, f64)> = curve.vertices.iter().map(|(u, y)| (u.f64, y.f64)).collect();
        assert_eq!(corners, [(-4.8e-5, -4.8), (4.8e-5, 4.8)]);
        assert_eq!((curve.first.1.f64, curve.last.1.f64), (0.0, 0.0));
    }

    #[test]
    fn knots_that_do_nothing_vanish() {
        let ramp = Piecewise::ramp();
        let line = ramp.plus(&Piecewise::line(-1.0, 0.0).then(&ramp).unwrap().scaled(-1.0));
        assert_eq!(line.as_line(), Some((1.0, 0.0)));
        let shifted = Piecewise::line(1.0, -2.0).then(&ramp).unwrap();
        let other = Piecewise::line(-1.0, 2.0).then(&ramp).unwrap();
        assert_eq!(
            shifted.plus(&other.scaled(-1.0)).as_line(),
            Some((1.0, -2.0))
        );
    }

    #[test]
    fn sums_of_monotone_parts() {
        let window = Piecewise::step(1.0).plus(&Piecewise::step(2.0).scaled(-1.0));
        let (linear, parts) = window.monotone();
        assert_eq!((linear, parts.len()), (0.0, 2));
        assert_eq!((parts[0].sign, parts[1].sign), (1.0, -1.0));
        assert_eq!(
            (parts[0].curve.kind, parts[1].curve.kind),
            ("relay", "relay")
        );
        let ramp = Piecewise::ramp();
        let magnitude = ramp.plus(&Piecewise::line(-1.0, 0.0).then(&ramp).unwrap());
        let (linear, parts) = magnitude.monotone();
        assert_eq!((linear, parts.len(), parts[0].sign), (-1.0, 1, 1.0));
        assert_eq!(parts[0].curve.last.1.f64, 2.0);
    }

    #[test]
    fn waveform_points() {
        let f = Piecewise::step(1.0).scaled(5.0);
        assert_eq!(
            f.points(0.0, 3.0),
            [(0.0, 0.0), (1.0, 0.0), (1.0, 5.0), (3.0, 5.0)]
        );
        assert_eq!(
            Piecewise::line(2.0, 1.0).points(0.0, 2.0),
            [(0.0, 1.0), (2.0, 5.0)]
        );
    }
}
