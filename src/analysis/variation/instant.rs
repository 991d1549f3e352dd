//! The sources on either side of an instant.

use nalgebra::DVector;

use crate::circuit::Source;
use crate::circuit::source::Piece;
use crate::lcs::Input;

/// u and its first two derivatives on one side of an instant.
#[derive(Debug, Clone)]
pub(super) struct Inputs {
    pub(super) u: DVector<f64>,
    pub(super) du: DVector<f64>,
    pub(super) ddu: DVector<f64>,
}

impl Inputs {
    /// The right limits at t, as far as times within `same`, s, are one; `None` where a source has no closed form.
    pub(super) fn after(inputs: &[Input], t: f64, same: f64) -> Option<Self> {
        Self::of(inputs, t, |source| source.piece(t + same))
    }

    /// The left limits at t.
    pub(super) fn before(inputs: &[Input], t: f64, same: f64) -> Option<Self> {
        Self::of(inputs, t, |source| source.piece(t - same))
    }

    fn of(inputs: &[Input], t: f64, piece: impl Fn(&Source) -> Option<Piece>) -> Option<Self> {
        let pieces: Option<Vec<Piece>> = inputs.iter().map(|input| piece(&input.source)).collect();
        let pieces = pieces?;
        let values = |value: fn(&Piece, f64) -> f64| {
            DVector::from_iterator(pieces.len(), pieces.iter().map(|piece| value(piece, t)))
        };
        Some(Self {
            u: values(Piece::value),
            du: values(Piece::derivative),
            ddu: values(Piece::second_derivative),
        })
    }
}
