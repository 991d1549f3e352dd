//! The outputs of a run as they are where ln p is a little larger or smaller, for measurements whose derivative is a difference.

use super::drawing::{Drawing, Weighted};
use crate::measure::{Curves, VALUES};
use crate::settings::tolerances::periodic::{MEASURE_STEP, MOVED};

/// How a run moves with ln p.
#[derive(Debug, Clone)]
pub(crate) struct Moved {
    /// By piece of the drawing and output: the derivatives of its values at times that stay.
    pub(super) changes: Vec<[f64; VALUES]>,
    /// Of where segments begin, and of the last one's end.
    pub(super) ends: Vec<f64>,
}

/// A run whose segments move with their ends: by piece where it begins later and how much longer it is, and by piece and output the derivatives of its values.
pub(crate) struct Stretched<'a> {
    drawing: &'a Drawing,
    pieces: Vec<(f64, f64)>,
    changes: Vec<[f64; VALUES]>,
}

impl Moved {
    /// dJ with ln p of what a measurement weighs.
    pub(crate) fn weighed(&self, weighted: &Weighted) -> f64 {
        let pairs = weighted.nodes.iter().zip(&self.changes);
        let dot = |(a, b): (&[f64; VALUES], &[f64; VALUES])| -> f64 {
            a.iter().zip(b).map(|(a, b)| a * b).sum()
        };
        let nodes: f64 = pairs.map(dot).sum();
        let ends = weighted.shifts.iter().zip(&self.ends);
        nodes + ends.map(|(a, b)| a * b).sum::<f64>()
    }

    /// Has what is in each segment move with its ends. An event stays where it is beside another one that it would pass.
    pub(crate) fn stretched<'a>(&self, drawing: &'a Drawing) -> Stretched<'a> {
        /// Moves for which there is room.
        const ROOM: f64 = 4.0;
        let mut moves = self.ends.clone();
        for (k, seconds) in drawing.seconds.iter().enumerate() {
            if ROOM * MEASURE_STEP * (self.ends[k + 1] - self.ends[k]).abs() > *seconds {
                moves[k..=k + 1].fill(0.0);
            }
        }
        let columns = drawing.columns.max(1);
        let mut changes = self.changes.clone();
        let mut pieces = Vec::with_capacity(drawing.pieces.len());
        let all = changes.chunks_exact_mut(columns);
        let all = all.zip(drawing.rates.chunks_exact(columns));
        for (piece, (changes, rates)) in drawing.pieces.iter().zip(all) {
            let [from, to] = [piece.segment, piece.segment + 1].map(|k| moves[k]);
            let strain = (to - from) / drawing.seconds[piece.segment];
            let (later, longer) = (from + strain * piece.age, strain * piece.length);
            pieces.push((later, longer));
            for (change, rate) in changes.iter_mut().zip(rates) {
                for (k, (change, rate)) in change.iter_mut().zip(rate).enumerate() {
                    let part = k as f64 / (VALUES - 1) as f64;
                    *change += rate * (later + part * longer);
                }
            }
        }
        Stretched {
            drawing,
            pieces,
            changes,
        }
    }
}

impl Stretched<'_> {
    /// A change of ln p that moves times and values by small parts of themselves.
    pub(crate) fn small(&self) -> f64 {
        let pieces = self.drawing.pieces.iter().zip(&self.pieces);
        let strain = pieces.fold(0.0, |m: f64, (piece, (_, longer))| {
            m.max((longer / piece.length).abs())
        });
        let columns = self.drawing.columns;
        let largest = |all: &[[f64; VALUES]], c: usize| {
            let own = all.iter().skip(c).step_by(columns);
            own.flatten().fold(0.0, |m: f64, v| m.max(v.abs()))
        };
        let change = |c: usize| largest(&self.changes, c) / largest(&self.drawing.values, c);
        let changes = (0..columns).map(change).filter(|change| change.is_finite());
        (MOVED / changes.fold(strain, f64::max)).clamp(MEASURE_STEP, MOVED)
    }

    /// The outputs where ln p is larger by h.
    pub(crate) fn at(&self, h: f64) -> Curves {
        let columns = self.drawing.columns;
        let mut moved = Curves::of(columns);
        let values = self.drawing.values.chunks_exact(columns.max(1));
        let changes = self.changes.chunks_exact(columns.max(1));
        let pieces = self.drawing.pieces.iter().zip(&self.pieces);
        for ((piece, values), changes) in pieces.zip(values).zip(changes) {
            let (piece, (later, longer)) = piece;
            let length = piece.length + h * longer;
            let all = values.iter().zip(changes);
            let all = all.map(|(y, dy)| std::array::from_fn(|k| y[k] + h * dy[k]));
            let all: Vec<[f64; VALUES]> = all.collect();
            moved.push((piece.begin + h * later, length, piece.until), &all);
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::super::drawing::Piece;
    use super::*;

    /// A piece of 1 s whose end moves by so much with ln p, of a constant signal.
    fn small(end: f64) -> f64 {
        let drawing = Drawing {
            columns: 1,
            pieces: vec![Piece {
                segment: 0,
                age: 0.0,
                begin: 0.0,
                level: 0,
                length: 1.0,
                until: 1.0,
            }],
            values: vec![[1.0; VALUES]],
            rates: vec![[0.0; VALUES]],
            seconds: vec![1.0],
        };
        let moved = Moved {
            changes: vec![[0.0; VALUES]],
            ends: vec![0.0, end],
        };
        moved.stretched(&drawing).small()
    }

    #[test]
    fn a_piece_that_shrinks_is_moved_as_far_as_one_that_grows() {
        assert_eq!(small(0.1), MOVED);
        assert_eq!(small(10.0), MOVED / 10.0);
        assert_eq!(small(-10.0), MOVED / 10.0);
    }
}
