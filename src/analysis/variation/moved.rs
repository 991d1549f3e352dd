//! The outputs of a run and how they move with ln p, as the smooth pieces that measurements see.

use nalgebra::DVector;

use crate::measure::{Curves, VALUES};
use crate::settings::tolerances::periodic::{MEASURE_STEP, MOVED};

/// Where a piece is, s.
#[derive(Debug, Clone, Copy)]
struct Piece {
    segment: usize,
    /// Since the segment began.
    age: f64,
    begin: f64,
    length: f64,
    until: f64,
    /// Derivatives with ln p.
    begins_later: f64,
    longer: f64,
}

/// Which part of a run is seen, and in which steps.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sight {
    /// Segments that end later, s.
    pub(crate) from: f64,
    /// Steps are halvings of it, s.
    pub(crate) unit: f64,
    /// Values at most.
    pub(crate) most: usize,
}

/// Outputs, their derivatives with ln p at a time that stays, and their rates.
pub(super) struct Sample {
    pub(super) y: DVector<f64>,
    pub(super) dy: DVector<f64>,
    pub(super) rate: DVector<f64>,
}

/// See the [module](self).
#[derive(Debug, Clone, Default)]
pub(crate) struct Moved {
    columns: usize,
    pieces: Vec<Piece>,
    /// By piece and output.
    values: Vec<[f64; VALUES]>,
    /// Their derivatives with ln p, first at times that stay.
    changes: Vec<[f64; VALUES]>,
    rates: Vec<[f64; VALUES]>,
}

impl Moved {
    pub(super) fn of(columns: usize) -> Self {
        Self {
            columns,
            ..Self::default()
        }
    }

    pub(super) fn values(&self) -> usize {
        self.values.len() * VALUES
    }

    /// Adds a piece of a segment of so many seconds from t.
    pub(super) fn push(
        &mut self,
        segment: usize,
        (t, seconds): (f64, f64),
        (age, step): (f64, f64),
        samples: &[Sample],
    ) {
        self.pieces.push(Piece {
            segment,
            age,
            begin: t + age,
            length: step,
            until: ((seconds - age) / step).min(1.0),
            begins_later: 0.0,
            longer: 0.0,
        });
        for c in 0..self.columns {
            self.values.push(std::array::from_fn(|k| samples[k].y[c]));
            self.changes.push(std::array::from_fn(|k| samples[k].dy[c]));
            self.rates.push(std::array::from_fn(|k| samples[k].rate[c]));
        }
    }

    /// Has what is in each segment move with its ends, which move by so much with ln p; `seconds` by segment, and one more of `ends` than these. An event stays where
    /// it is beside another one that it would pass.
    pub(super) fn stretch(&mut self, seconds: &[f64], ends: &[f64]) {
        /// Moves for which there is room.
        const ROOM: f64 = 4.0;
        let mut moves = ends.to_vec();
        for (k, seconds) in seconds.iter().enumerate() {
            if ROOM * MEASURE_STEP * (ends[k + 1] - ends[k]).abs() > *seconds {
                moves[k..=k + 1].fill(0.0);
            }
        }
        let rates = std::mem::take(&mut self.rates);
        let changes = self.changes.chunks_exact_mut(self.columns.max(1));
        let rates = rates.chunks_exact(self.columns.max(1));
        for ((piece, changes), rates) in self.pieces.iter_mut().zip(changes).zip(rates) {
            let [from, to] = [piece.segment, piece.segment + 1].map(|k| moves[k]);
            let strain = (to - from) / seconds[piece.segment];
            piece.begins_later = from + strain * piece.age;
            piece.longer = strain * piece.length;
            for (change, rate) in changes.iter_mut().zip(rates) {
                for (k, (change, rate)) in change.iter_mut().zip(rate).enumerate() {
                    let part = k as f64 / (VALUES - 1) as f64;
                    *change += rate * (piece.begins_later + part * piece.longer);
                }
            }
        }
    }

    /// A change of ln p that moves times and values by small parts of themselves.
    pub(crate) fn small(&self) -> f64 {
        let pieces = self.pieces.iter();
        let strain = pieces.fold(0.0, |m: f64, piece| {
            m.max((piece.longer / piece.length).abs())
        });
        let largest = |all: &[[f64; VALUES]], c: usize| {
            let own = all.iter().skip(c).step_by(self.columns);
            own.flatten().fold(0.0, |m: f64, v| m.max(v.abs()))
        };
        let change = |c: usize| largest(&self.changes, c) / largest(&self.values, c);
        let changes = (0..self.columns)
            .map(change)
            .filter(|change| change.is_finite());
        (MOVED / changes.fold(strain, f64::max)).clamp(MEASURE_STEP, MOVED)
    }

    /// The outputs where ln p is larger by h.
    pub(crate) fn at(&self, h: f64) -> Curves {
        let mut moved = Curves::of(self.columns);
        let values = self.values.chunks_exact(self.columns.max(1));
        let changes = self.changes.chunks_exact(self.columns.max(1));
        for ((piece, values), changes) in self.pieces.iter().zip(values).zip(changes) {
            let length = piece.length + h * piece.longer;
            let all = values.iter().zip(changes);
            let all = all.map(|(y, dy)| std::array::from_fn(|k| y[k] + h * dy[k]));
            let all: Vec<[f64; VALUES]> = all.collect();
            moved.push(
                (piece.begin + h * piece.begins_later, length, piece.until),
                &all,
            );
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A piece of 1 s whose end moves by so much with ln p, of a constant signal.
    fn small(end: f64) -> f64 {
        let constant = || Sample {
            y: DVector::from_element(1, 1.0),
            dy: DVector::zeros(1),
            rate: DVector::zeros(1),
        };
        let samples: Vec<Sample> = (0..VALUES).map(|_| constant()).collect();
        let mut moved = Moved::of(1);
        moved.push(0, (0.0, 1.0), (0.0, 1.0), &samples);
        moved.stretch(&[1.0], &[0.0, end]);
        moved.small()
    }

    #[test]
    fn a_piece_that_shrinks_is_moved_as_far_as_one_that_grows() {
        assert_eq!(small(0.1), MOVED);
        assert_eq!(small(10.0), MOVED / 10.0);
        assert_eq!(small(-10.0), MOVED / 10.0);
    }
}
