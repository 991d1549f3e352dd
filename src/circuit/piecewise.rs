//! Piecewise-linear functions of one variable, with jumps: composed, multiplied, and split into monotone curves.

use crate::settings::tolerances::netlists::SAME_KNOT;

mod monotone;

#[cfg(test)]
mod tests;

/// Most knots of one function.
const MAX_KNOTS: usize = 1_000;

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

    /// The values it takes from left to right, if it is constant between its knots.
    pub(super) fn steps(&self) -> Option<Vec<f64>> {
        let flat = |p: &Piece| (p.slope == 0.0 && p.left == p.right).then_some(p.left);
        self.pieces.iter().map(flat).collect()
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
            let continuous = (last.right - next.left).abs() <= SAME_KNOT * f64::EPSILON * size;
            if continuous {
                if next.right == next.left {
                    next.right = last.right;
                }
                next.left = last.right;
            }
            let bend = (last.slope - next.slope).abs();
            if continuous
                && bend <= SAME_KNOT * f64::EPSILON * (last.slope.abs() + next.slope.abs())
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
