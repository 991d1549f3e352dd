//! The signals of a run, and expressions over them as waveforms.

use super::curve::{Curve, INTERVALS, VALUES, blended, cut, interpolated};
use super::{MeasureError, Trace};
use crate::settings::tolerances::times::CURVE_CLOSE;

/// Halvings of a piece after which an expression that no polynomial follows has an edge in it.
const HALVINGS: u32 = 40;

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

/// All signals as smooth pieces, one after the other.
#[derive(Debug, Clone, Default)]
pub struct Curves {
    columns: usize,
    /// Where each piece begins and how long it is, s, and which part of that belongs to it.
    pieces: Vec<(f64, f64, f64)>,
    /// By piece and signal.
    values: Vec<[f64; VALUES]>,
    /// Times, s, and by signal the areas of impulses.
    impulses: Vec<(f64, Vec<f64>)>,
    /// The part that is seen, s; all where absent.
    seen: Option<(f64, f64)>,
    /// Pieces after which they repeat, where they do.
    lap: Option<usize>,
}

impl Curves {
    /// So many signals, without a piece yet.
    #[must_use]
    pub fn of(columns: usize) -> Self {
        Self {
            columns,
            ..Self::default()
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

    /// The pieces so far.
    #[must_use]
    pub fn len(&self) -> usize {
        self.pieces.len()
    }

    /// The values of all of them.
    #[must_use]
    pub fn values(&self) -> usize {
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
    pub fn repeated(&self, (from, to): (usize, usize), period: f64, origin: f64) -> Self {
        let laps = (from..to).map(|lap| lap as f64 * period - origin);
        let pieces = laps.clone().flat_map(|shift| {
            let moved = move |&(begin, length, until)| (begin + shift, length, until);
            self.pieces.iter().map(moved)
        });
        let impulses = laps.clone().flat_map(|shift| {
            let moved = move |(t, areas): &(f64, Vec<f64>)| (t + shift, areas.clone());
            self.impulses.iter().map(moved)
        });
        Self {
            columns: self.columns,
            pieces: pieces.collect(),
            values: laps.flat_map(|_| &self.values).copied().collect(),
            impulses: impulses.collect(),
            seen: None,
            lap: Some(self.pieces.len()),
        }
    }

    /// Pieces after which they repeat, where they do.
    pub(crate) const fn lap(&self) -> Option<usize> {
        self.lap
    }

    /// The same waveforms in pieces that all end with their last value (`until` = 1), as measures are quickest on.
    pub(crate) fn whole(&self) -> Self {
        let mut whole = Self {
            impulses: self.impulses.clone(),
            seen: self.seen,
            lap: self.lap,
            ..Self::of(self.columns)
        };
        for (piece, values) in self.all() {
            whole.push_cut(piece, values);
        }
        whole
    }

    /// A function of the time and the signals, and of which piece each of its own is a part, where that begins on it, and how much of it that is; none where it has an edge
    /// that is none of the signals.
    ///
    /// # Errors
    /// [`MeasureError::NotFinite`].
    #[expect(clippy::type_complexity, reason = "a waveform with its places")]
    pub(crate) fn drawn(
        &self,
        f: &dyn Fn(f64, &[f64]) -> f64,
        affine: bool,
    ) -> Result<Option<(Trace<'static>, Vec<(usize, f64, f64)>)>, MeasureError> {
        let drawn = Drawn::of(self, f, affine)?;
        let (trace, places) = (Trace::curves(drawn.curves, vec![]), drawn.places);
        Ok((!drawn.has_edge).then_some((trace, places)))
    }

    pub(crate) fn all(&self) -> impl Iterator<Item = ((f64, f64, f64), &[[f64; VALUES]])> {
        let values = self.values.chunks_exact(self.columns.max(1));
        self.pieces.iter().copied().zip(values)
    }
}

impl<'a> Signals<'a> {
    /// Where they begin and end, s.
    #[must_use]
    pub fn span(&self) -> (f64, f64) {
        let span = match self {
            Self::Lines { time, .. } => time.first().copied().zip(time.last().copied()),
            Self::Curves(curves) => {
                let (first, last) = (curves.pieces.first(), curves.pieces.last());
                let end = |&(begin, length, until): &(f64, f64, f64)| begin + until * length;
                let all = first.map(|first| first.0).zip(last.map(end));
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
                let own = |((begin, length, until), values): (_, &[[f64; VALUES]])| Curve {
                    begin,
                    length,
                    until,
                    values: values[index],
                };
                let own: Vec<Curve> = curves.all().map(own).collect();
                let impulses = curves.impulses.iter();
                let impulses = impulses.map(|(t, areas)| (*t, areas[index]));
                let mut values = own.iter().flat_map(|curve| &curve.values);
                let finite = values.all(|value| value.is_finite());
                let trace = finite.then(|| Trace::curves(own, impulses.collect()));
                trace.ok_or(MeasureError::NotFinite)
            }
        }
    }

    /// A function of the time and the signals. Of an impulse it has what it has of the areas where it is `affine`, else nothing.
    ///
    /// # Errors
    /// [`MeasureError::NotFinite`].
    pub fn trace(
        &self,
        f: &dyn Fn(f64, &[f64]) -> f64,
        affine: bool,
    ) -> Result<Trace<'a>, MeasureError> {
        match self {
            Self::Lines { time, columns } => {
                let time: &'a [f64] = time;
                let mut row = vec![0.0; columns.len()];
                let mut all = Vec::with_capacity(time.len());
                for (k, &t) in time.iter().enumerate() {
                    for (value, column) in row.iter_mut().zip(columns) {
                        *value = column[k];
                    }
                    all.push(finite(f(t, &row))?);
                }
                Ok(Trace::lines(time, all))
            }
            Self::Curves(curves) => {
                let drawn = Drawn::of(curves, f, affine)?;
                let still = vec![0.0; curves.columns];
                let impulses = curves.impulses.iter().filter(|_| affine);
                let impulses = impulses.map(|(t, areas)| {
                    // As large as what else is in the expression: less of it is lost in the difference.
                    let size = areas.iter().fold(f64::MIN_POSITIVE, |m, a| m.max(a.abs()));
                    let scaled: Vec<f64> = areas.iter().map(|area| area / size).collect();
                    (*t, size * (f(*t, &scaled) - f(*t, &still)))
                });
                Ok(Trace::curves(drawn.curves, impulses.collect()))
            }
        }
    }
}

fn finite(value: f64) -> Result<f64, MeasureError> {
    let value = Some(value).filter(|value| value.is_finite());
    value.ok_or(MeasureError::NotFinite)
}

/// A function of time and signals as smooth pieces.
pub(super) struct Drawn<'f> {
    f: &'f dyn Fn(f64, &[f64]) -> f64,
    /// Its largest value.
    largest: f64,
    pub(super) curves: Vec<Curve>,
    /// By curve: the piece of the signals that it is a part of, where on it that part begins, and how much of it that is.
    pub(super) places: Vec<(usize, f64, f64)>,
    /// Whether an edge that is none of the signals is in it.
    pub(super) has_edge: bool,
}

impl<'f> Drawn<'f> {
    /// Of all pieces.
    pub(super) fn of(
        curves: &Curves,
        f: &'f dyn Fn(f64, &[f64]) -> f64,
        affine: bool,
    ) -> Result<Self, MeasureError> {
        let mut drawn = Self {
            f,
            largest: 0.0,
            curves: Vec::with_capacity(curves.len()),
            places: Vec::with_capacity(curves.len()),
            has_edge: false,
        };
        let all = curves.all();
        let own = all.map(|(piece, signals)| Ok((piece, signals, drawn.values(piece, signals)?)));
        let own: Vec<_> = own.collect::<Result<_, _>>()?;
        let values = own.iter().flat_map(|(.., values)| values);
        drawn.largest = values.fold(0.0, |m: f64, y| m.max(y.abs()));
        for (k, (piece, signals, values)) in own.into_iter().enumerate() {
            let place = (k, 0.0, 1.0);
            if affine {
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
            *value = finite((self.f)(t, &row))?;
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
        let over = |f: &dyn Fn(f64, &[f64]) -> f64, what| {
            let trace = signals.trace(f, false).unwrap();
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
        let shifted = signals.trace(&|_, y| 3.0 * y[0] + 1.0, true).unwrap();
        let whole = shifted.over(Over::Integral, 0.0, 10.0).unwrap();
        let exact = 3.0 * (1.0 - 10.0_f64.cos()) + 10.0 + 6.0;
        assert!((whole - exact).abs() < 1e-9);
        let twice = curves.repeated((0, 2), 10.0, 0.0);
        let signals = Signals::Curves(&twice);
        let trace = signals.signal(0).unwrap();
        let whole = trace.over(Over::Integral, 0.0, 20.0).unwrap();
        assert!((whole - 2.0 * (3.0 - 10.0_f64.cos())).abs() < 1e-9);
        assert!(trace.over(Over::Maximum, 0.0, 20.0).unwrap() < 1.001);
    }
}
