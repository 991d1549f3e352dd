//! The signals of a run, and expressions over them as waveforms.

use super::curve::{Curve, VALUES, blended, cut};
use super::expression::{Drawn, Expression, finite};
use super::pieces::{Laps, Pieces};
use super::{MeasureError, Trace};

/// The signals of a run as measurements see them.
#[derive(Debug, Clone)]
pub enum Signals<'a> {
    /// Straight lines between rows.
    Lines {
        /// Times, s, nondecreasing.
        time: &'a [f64],
        /// By signal its values.
        columns: Vec<Vec<f64>>,
    },
    /// What happens between events.
    Curves(&'a Curves),
}

/// All signals as smooth pieces, one after the other, which an orbit repeats lap by lap.
#[derive(Debug, Clone)]
pub struct Curves {
    columns: usize,
    /// Of one lap: where each piece begins and how long it is, s, and which part of that belongs to it.
    pieces: Vec<(f64, f64, f64)>,
    /// By piece of a lap and signal.
    values: Vec<[f64; VALUES]>,
    /// Of one lap: times, s, and by signal the areas of impulses.
    impulses: Vec<(f64, Vec<f64>)>,
    pub(super) laps: Laps,
    /// The part that is seen, s; all where absent.
    seen: Option<(f64, f64)>,
}

impl Curves {
    /// Whether all values are within the range of numbers.
    #[must_use]
    pub(crate) fn is_finite(&self) -> bool {
        self.values.iter().flatten().all(|value| value.is_finite())
    }

    /// So many signals, without a piece yet.
    #[must_use]
    pub const fn of(columns: usize) -> Self {
        Self {
            columns,
            pieces: vec![],
            values: vec![],
            impulses: vec![],
            laps: Laps::ONE,
            seen: None,
        }
    }

    /// Adds a piece: where it begins, how long it is, s, the part of that which belongs to it, and by signal its values.
    ///
    /// # Panics
    /// Of another number of signals.
    pub fn push(&mut self, piece: (f64, f64, f64), values: &[[f64; VALUES]]) {
        assert_eq!(values.len(), self.columns);
        self.pieces.push(piece);
        self.values.extend_from_slice(values);
    }

    /// Adds what belongs to the waveform of a piece, as a piece of its own: the same polynomial through its values at s = 0, `until`/8 … `until`.
    pub(crate) fn push_cut(
        &mut self,
        (begin, length, until): (f64, f64, f64),
        values: &[[f64; VALUES]],
    ) {
        self.push((begin, length * until, 1.0), values);
        if until < 1.0 {
            let rows = cut(until);
            let from = self.values.len() - self.columns;
            for own in &mut self.values[from..] {
                *own = blended(own, &rows);
            }
        }
    }

    /// Adds an impulse: its time, s, and by signal its area.
    pub fn impulse(&mut self, t: f64, areas: Vec<f64>) {
        self.impulses.push((t, areas));
    }

    /// The same, of which only this is seen, s.
    #[must_use]
    pub fn within(self, seen: (f64, f64)) -> Self {
        Self {
            seen: Some(seen),
            ..self
        }
    }

    /// The pieces so far, of one lap.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.pieces.len()
    }

    /// The values of all of them.
    #[must_use]
    pub const fn values(&self) -> usize {
        self.values.len() * VALUES
    }

    /// The largest |value|.
    pub(crate) fn largest(&self) -> f64 {
        let all = self.values.as_flattened().iter();
        all.fold(0.0, |largest, value| largest.max(value.abs()))
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// The same again and again, from one lap to another of so many seconds each; the first one would begin at t = 0 what begins here at `origin`.
    #[must_use]
    pub fn repeated(self, (from, to): (usize, usize), period: f64, origin: f64) -> Self {
        let laps = Laps {
            from,
            count: to.saturating_sub(from),
            period,
            origin,
        };
        Self { laps, ..self }
    }

    /// Whether the same pieces are there again and again.
    pub(crate) const fn repeats(&self) -> bool {
        self.laps.count > 1
    }

    /// The same waveforms in pieces that all end with their last value (`until` = 1), as measures are quickest on.
    pub(crate) fn whole(&self) -> Self {
        let mut whole = Self {
            impulses: self.impulses.clone(),
            laps: self.laps,
            seen: self.seen,
            ..Self::of(self.columns)
        };
        for (piece, values) in self.once() {
            whole.push_cut(piece, values);
        }
        whole
    }

    /// The pieces of one lap as they were told.
    pub(super) fn once(&self) -> impl Iterator<Item = Whole<'_>> {
        self.pieces.iter().copied().zip(self.rows())
    }

    /// By piece of a lap the values of the signals.
    fn rows(&self) -> impl Iterator<Item = &[[f64; VALUES]]> {
        self.values.chunks_exact(self.columns.max(1))
    }

    /// The k-th piece of all laps.
    pub(crate) fn get(&self, k: usize) -> Whole<'_> {
        let (lap, own) = (k / self.pieces.len(), k % self.pieces.len());
        let (begin, length, until) = self.pieces[own];
        let values = &self.values[own * self.columns..(own + 1) * self.columns];
        ((begin + self.laps.shift(lap), length, until), values)
    }

    /// All pieces, lap after lap.
    pub(super) fn all(&self) -> impl Iterator<Item = Whole<'_>> {
        (0..self.pieces.len() * self.laps.count).map(|k| self.get(k))
    }

    /// One of the signals as a waveform.
    pub(crate) fn signal(&self, index: usize) -> Trace<'static> {
        let own = self.once().map(|((begin, length, until), values)| Curve {
            begin,
            length,
            until,
            values: values[index],
        });
        let pieces = Pieces::repeated(own.collect(), self.laps);
        Trace::pieced(pieces, self.areas(|_, areas| areas[index]))
    }

    /// The times of impulses, s, and what they have of the areas of the signals.
    fn areas(&self, of: impl Fn(f64, &[f64]) -> f64) -> Vec<(f64, f64)> {
        let laps = (0..self.laps.count).map(|lap| self.laps.shift(lap));
        let all = laps.flat_map(|shift| {
            let own = self.impulses.iter();
            own.map(move |(t, areas)| (t + shift, &areas[..]))
        });
        all.map(|(t, areas)| (t, of(t, areas))).collect()
    }

    /// An expression as a waveform, and of which piece, where on it and how much of it each of its own is a part; none where it has an edge that is none of the signals.
    ///
    /// # Errors
    /// [`MeasureError::NotFinite`].
    #[expect(clippy::type_complexity, reason = "a waveform with its places")]
    pub(crate) fn drawn(
        &self,
        of: &Expression<'_>,
    ) -> Result<Option<(Trace<'static>, Vec<(usize, f64, f64)>)>, MeasureError> {
        let drawn = Drawn::of(self, of)?;
        let pieces = Pieces::repeated(drawn.curves, drawn.laps);
        let trace = Trace::pieced(pieces, vec![]);
        Ok((!drawn.has_edge).then_some((trace, drawn.places)))
    }
}

/// A piece: where it begins, how long it is, s, which part of that belongs to it, and by signal its values.
pub(super) type Whole<'a> = ((f64, f64, f64), &'a [[f64; VALUES]]);

impl<'a> Signals<'a> {
    /// Where they begin and end, s.
    #[must_use]
    pub fn span(&self) -> (f64, f64) {
        let span = match self {
            Self::Lines { time, .. } => time.first().copied().zip(time.last().copied()),
            Self::Curves(curves) => {
                let all = curves.pieces.len() * curves.laps.count;
                let end = |((begin, length, until), _): Whole<'_>| begin + until * length;
                let all = all
                    .checked_sub(1)
                    .map(|last| (curves.get(0).0.0, end(curves.get(last))));
                curves.seen.or(all)
            }
        };
        span.unwrap_or_default()
    }

    /// One of them.
    ///
    /// # Errors
    /// [`MeasureError::NotFinite`].
    pub fn signal(&self, index: usize) -> Result<Trace<'_>, MeasureError> {
        match self {
            Self::Lines { time, columns } => {
                let values = &columns[index];
                let finite = values.iter().all(|value| value.is_finite());
                let trace = finite.then(|| Trace::lines(time, &values[..]));
                trace.ok_or(MeasureError::NotFinite)
            }
            Self::Curves(curves) => {
                let mut values = curves.rows().flat_map(|values| values[index]);
                let finite = values.all(f64::is_finite);
                let trace = finite.then(|| curves.signal(index));
                trace.ok_or(MeasureError::NotFinite)
            }
        }
    }

    /// An expression. Of an impulse it has what it has of the areas where it is affine, else nothing.
    ///
    /// # Errors
    /// [`MeasureError::NotFinite`].
    pub fn trace(&self, of: &Expression<'_>) -> Result<Trace<'a>, MeasureError> {
        match self {
            Self::Lines { time, columns } => {
                let time: &'a [f64] = time;
                let mut row = vec![0.0; columns.len()];
                let mut all = Vec::with_capacity(time.len());
                for (k, &t) in time.iter().enumerate() {
                    for (value, column) in row.iter_mut().zip(columns) {
                        *value = column[k];
                    }
                    all.push(finite((of.value)(t, &row))?);
                }
                Ok(Trace::lines(time, all))
            }
            Self::Curves(curves) => {
                let drawn = Drawn::of(curves, of)?;
                let pieces = Pieces::repeated(drawn.curves, drawn.laps);
                if !of.is_affine {
                    return Ok(Trace::pieced(pieces, vec![]));
                }
                let still = vec![0.0; curves.columns];
                let impulses = curves.areas(|t, areas| {
                    // As large as what else is in the expression: less of it is lost in the difference.
                    let size = areas.iter().fold(f64::MIN_POSITIVE, |m, a| m.max(a.abs()));
                    let scaled: Vec<f64> = areas.iter().map(|area| area / size).collect();
                    size * ((of.value)(t, &scaled) - (of.value)(t, &still))
                });
                Ok(Trace::pieced(pieces, impulses))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::{Edge, Over, Which};

    /// sin t from 0 to 10 s.
    fn sine() -> Curves {
        let mut curves = Curves::of(1);
        for k in 0..20 {
            let begin = 0.5 * f64::from(k);
            let values = std::array::from_fn(|j| (begin + 0.0625 * j as f64).sin());
            curves.push((begin, 0.5, 1.0), &[values]);
        }
        curves
    }

    #[test]
    fn expressions_that_bend_and_jump() {
        let curves = sine();
        let signals = Signals::Curves(&curves);
        let over = |value: &dyn Fn(f64, &[f64]) -> f64, what| {
            let of = Expression {
                value,
                is_affine: false,
                is_timed: true,
            };
            let trace = signals.trace(&of).unwrap();
            trace.over(what, 0.0, 10.0).unwrap()
        };
        let whole = over(&|_, y| y[0].abs(), Over::Integral);
        let exact = 6.0 + 1.0 + 10.0_f64.cos();
        assert!((whole - exact).abs() < 1e-10, "{whole} {exact}");
        let square = over(&|_, y| y[0] * y[0], Over::Average);
        assert!((square - (0.5 - 20.0_f64.sin() / 40.0)).abs() < 1e-11);
        let above = |_: f64, y: &[f64]| f64::from(y[0] > 0.5);
        let on = over(&above, Over::Integral);
        let third = std::f64::consts::TAU / 3.0;
        assert!((on - 2.0 * third).abs() < 1e-10, "{on}");
        assert_eq!(over(&above, Over::Maximum), 1.0);
        let ramp = over(&|t, _| t, Over::Average);
        assert!((ramp - 5.0).abs() < 1e-14);
    }

    #[test]
    fn crossings_of_a_curve() {
        let curves = sine();
        let signals = Signals::Curves(&curves);
        let trace = signals.signal(0).unwrap();
        let when = |n| trace.crossing(0.5, Edge::Rise, Which::Number(n), (0.0, 10.0));
        for n in 1..=2 {
            let exact = std::f64::consts::TAU * (n as f64 - 1.0 + 1.0 / 12.0);
            assert!((when(n).unwrap() - exact).abs() < 1e-11, "{n}");
        }
        assert!(when(3).is_err());
        let peak = trace.over(Over::WhenMaximum, 0.0, 5.0).unwrap();
        assert!((peak - 0.25 * std::f64::consts::TAU).abs() < 1e-6, "{peak}");
        assert!((trace.slope(1.0).unwrap() - 1.0_f64.cos()).abs() < 1e-9);
    }

    #[test]
    fn impulses_count_in_integrals_alone() {
        let mut curves = sine();
        curves.impulse(4.0, vec![2.0]);
        let signals = Signals::Curves(&curves);
        let shifted = Expression {
            value: &|_, y| 3.0 * y[0] + 1.0,
            is_affine: true,
            is_timed: false,
        };
        let shifted = signals.trace(&shifted).unwrap();
        let whole = shifted.over(Over::Integral, 0.0, 10.0).unwrap();
        let exact = 3.0 * (1.0 - 10.0_f64.cos()) + 10.0 + 6.0;
        assert!((whole - exact).abs() < 1e-9);
        let [before, after] = [(0.0, 4.0), (4.0, 10.0)]
            .map(|(from, to)| shifted.over(Over::Integral, from, to).unwrap());
        assert!((before + after - exact).abs() < 1e-9, "{before} {after}");
        let twice = curves.repeated((0, 2), 10.0, 0.0);
        let signals = Signals::Curves(&twice);
        let trace = signals.signal(0).unwrap();
        let whole = trace.over(Over::Integral, 0.0, 20.0).unwrap();
        assert!((whole - 2.0 * (3.0 - 10.0_f64.cos())).abs() < 1e-9);
        assert!(trace.over(Over::Maximum, 0.0, 20.0).unwrap() < 1.001);
    }
}
