//! Expressions over signals as smooth pieces of their own.

use super::MeasureError;
use super::curve::{Curve, INTERVALS, VALUES, interpolated};
use super::pieces::Laps;
use super::signals::{Curves, Whole};
use crate::settings::tolerances::times::CURVE_CLOSE;

/// Halvings of a piece after which an expression that no polynomial follows has an edge in it.
const HALVINGS: u32 = 40;

/// A function of the time and the signals.
pub struct Expression<'f> {
    /// Its value.
    pub value: &'f dyn Fn(f64, &[f64]) -> f64,
    /// Whether it is affine in the signals.
    pub is_affine: bool,
    /// Whether the time is in it.
    pub is_timed: bool,
}

pub(super) fn finite(value: f64) -> Result<f64, MeasureError> {
    let value = Some(value).filter(|value| value.is_finite());
    value.ok_or(MeasureError::NotFinite)
}

/// An expression as smooth pieces.
pub(super) struct Drawn<'f> {
    of: &'f Expression<'f>,
    /// Its largest value.
    largest: f64,
    pub(super) curves: Vec<Curve>,
    /// By curve: the piece of the signals that it is a part of, where on it that part begins, and how much of it that is.
    pub(super) places: Vec<(usize, f64, f64)>,
    /// How often all that is there: once in all laps where the time is in it.
    pub(super) laps: Laps,
    /// Whether an edge that is none of the signals is in it.
    pub(super) has_edge: bool,
}

impl<'f> Drawn<'f> {
    /// Of all pieces.
    pub(super) fn of(curves: &Curves, of: &'f Expression<'f>) -> Result<Self, MeasureError> {
        let mut drawn = Self {
            of,
            largest: 0.0,
            curves: Vec::with_capacity(curves.len()),
            places: Vec::with_capacity(curves.len()),
            laps: if of.is_timed { Laps::ONE } else { curves.laps },
            has_edge: false,
        };
        let seen: Vec<Whole<'_>> = if of.is_timed {
            curves.all().collect()
        } else {
            curves.once().collect()
        };
        let own = seen.into_iter();
        let own = own.map(|(piece, signals)| Ok((piece, signals, drawn.values(piece, signals)?)));
        let own: Vec<_> = own.collect::<Result<_, _>>()?;
        let values = own.iter().flat_map(|(.., values)| values);
        drawn.largest = values.fold(0.0, |m: f64, y| m.max(y.abs()));
        for (k, (piece, signals, values)) in own.into_iter().enumerate() {
            let place = (k, 0.0, 1.0);
            if of.is_affine {
                drawn.push(piece, place, values);
            } else {
                drawn.follow(piece, place, signals, values, HALVINGS)?;
            }
        }
        Ok(drawn)
    }

    /// Its values where the signals have theirs.
    fn values(
        &self,
        (begin, length, _): (f64, f64, f64),
        signals: &[[f64; VALUES]],
    ) -> Result<[f64; VALUES], MeasureError> {
        let mut row = vec![0.0; signals.len()];
        let mut values = [0.0; VALUES];
        for (k, value) in values.iter_mut().enumerate() {
            for (own, signal) in row.iter_mut().zip(signals) {
                *own = signal[k];
            }
            let t = begin + length * (k as f64 / INTERVALS as f64);
            *value = finite((self.of.value)(t, &row))?;
        }
        Ok(values)
    }

    fn push(
        &mut self,
        (begin, length, until): (f64, f64, f64),
        place: (usize, f64, f64),
        values: [f64; VALUES],
    ) {
        self.places.push(place);
        self.curves.push(Curve {
            begin,
            length,
            until,
            values,
        });
    }

    /// Adds the pieces of it that make a piece of the signals: halves of it where its polynomial is not close between its values.
    fn follow(
        &mut self,
        piece: (f64, f64, f64),
        place: (usize, f64, f64),
        signals: &[[f64; VALUES]],
        values: [f64; VALUES],
        halvings: u32,
    ) -> Result<(), MeasureError> {
        let (begin, length, until) = piece;
        let (whole, from, part) = place;
        let halves: Vec<_> = signals.iter().map(Curve::halved).collect();
        let half = [0, 1].map(|k| halves.iter().map(|pair| pair[k]).collect::<Vec<_>>());
        let pieces = [
            (begin, 0.5 * length, (2.0 * until).min(1.0)),
            (begin + 0.5 * length, 0.5 * length, 2.0 * until - 1.0),
        ];
        let closer = [
            self.values(pieces[0], &half[0])?,
            self.values(pieces[1], &half[1])?,
        ];
        let off = |k: usize| {
            let at = closer[k / INTERVALS][k % INTERVALS];
            (interpolated(&values, k as f64 / (2 * INTERVALS) as f64) - at).abs()
        };
        let most = (1..2 * INTERVALS).step_by(2).map(off).fold(0.0, f64::max);
        if most <= CURVE_CLOSE * self.largest {
            self.push(piece, place, values);
            return Ok(());
        }
        if halvings == 0 {
            self.has_edge = true;
            let rise = (values[INTERVALS] - values[0]) / INTERVALS as f64;
            let line = std::array::from_fn(|k| values[0] + rise * k as f64);
            self.push(piece, place, line);
            return Ok(());
        }
        let places = [0.0, 0.5].map(|begins| (whole, from + begins * part, 0.5 * part));
        for (((piece, place), signals), values) in
            pieces.into_iter().zip(places).zip(&half).zip(closer)
        {
            if piece.2 > 0.0 {
                self.follow(piece, place, signals, values, halvings - 1)?;
            }
        }
        Ok(())
    }
}
