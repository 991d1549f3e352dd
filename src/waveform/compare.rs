//! How far two sets of waveforms are apart, on whatever grids they stand.
//!
//! Both sides are read as what they are: straight lines between rows, and a jump where two rows share a time. On the union of
//! the two grids the difference is then straight between neighbours, so its maximum and its integral are exact.

use std::collections::VecDeque;

use super::{Waveforms, canonical_name};

/// The smallest amplitude that errors are related to, as a part of the largest amplitude of the same unit: a signal below it
/// is the rounding or leakage of its neighbours.
const AMPLITUDE_FLOOR: f64 = 1e-9;

/// Where two sides are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum At {
    /// At every row of either side; between rows both are straight lines.
    AllRows,
    /// At the rows of the first side only, the reference's rows being dense. A single row at a jump of the other side may hold
    /// either limit.
    FirstRows,
    /// At the rows of the reference only: right when the first side's rows are dense and the reference's are the steps of
    /// another program, between which it claims nothing. A single row at a jump of the other side may hold either limit.
    ReferenceRows,
}

/// Errors of one signal, relative to its amplitude.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SignalError {
    /// The first side's name.
    pub name: String,
    /// `V` or `A`.
    pub unit: &'static str,
    /// What errors are relative to, in `unit`: the largest |value| of the reference (see [`compare`]).
    pub amplitude: f64,
    /// max |a − b| / amplitude.
    pub max: f64,
    /// Where the maximum is, s.
    pub max_time: f64,
    /// √(mean of (a − b)²) / amplitude.
    pub rms: f64,
    /// The largest distance of either curve from the other one's values within ± shift, / amplitude: what is left when
    /// edges may stand a little earlier or later.
    pub shifted: f64,
    /// Where that is, s.
    pub shifted_time: f64,
}

/// What [`compare`] found.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Comparison {
    /// Start of the common span, s.
    pub from: f64,
    /// End of the common span, s.
    pub to: f64,
    /// The time by which edges may be shifted in [`SignalError::shifted`], s.
    pub shift: f64,
    /// One entry per signal that both sides have, in the first side's order.
    pub signals: Vec<SignalError>,
    /// Signals of the first side that the reference lacks.
    pub missing: Vec<String>,
}

impl Comparison {
    /// The signal with the largest maximum error.
    #[must_use]
    pub fn worst(&self) -> Option<&SignalError> {
        self.signals.iter().max_by(|a, b| a.max.total_cmp(&b.max))
    }

    /// The largest RMS error of any signal.
    #[must_use]
    pub fn worst_rms(&self) -> f64 {
        self.signals.iter().map(|s| s.rms).fold(0.0, f64::max)
    }
}

/// Why two sets of waveforms cannot be compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CompareError {
    /// One of them has no rows, or their spans do not meet.
    #[error("no common span of time: {first} and {second}")]
    NoOverlap {
        /// Span of the first side.
        first: String,
        /// Span of the reference.
        second: String,
    },
    /// No name occurs on both sides.
    #[error("no signal in common: {first} and {second}")]
    NoSignal {
        /// Names of the first side.
        first: String,
        /// Names of the reference.
        second: String,
    },
}

/// Compares every signal of `waves` that `reference` has too, under any spelling ([`canonical_name`]); `v(a,b)` may also be
/// the difference of the reference's `v(a)` and `v(b)`.
///
/// The amplitude of a signal is the reference's largest |value| in the common span, at least 1e-9 of the largest among the
/// signals of its unit. `shift` (s) is the tolerance in time of [`SignalError::shifted`].
///
/// # Errors
/// [`CompareError`] when there is no common time or signal.
///
/// # Cost
/// O(N log N) per signal for N rows.
///
/// # Example
/// ```
/// use circ::waveform::{Waveforms, compare::{At, compare}};
/// let ramp = |time: Vec<f64>, slope: f64| Waveforms {
///     names: vec!["v(a)".into()], units: vec!["V"], values: time.iter().map(|t| slope * t).collect(), time, ..Default::default()
/// };
/// let found = compare(&ramp(vec![0.0, 1.0], 1.1), &ramp(vec![0.0, 0.3, 1.0], 1.0), At::AllRows, 0.0).unwrap();
/// assert!((found.signals[0].max - 0.1).abs() < 1e-15);
/// assert!((found.signals[0].rms - 0.1 / 3f64.sqrt()).abs() < 1e-15);
/// ```
pub fn compare(
    waves: &Waveforms,
    reference: &Waveforms,
    at: At,
    shift: f64,
) -> Result<Comparison, CompareError> {
    let (pairs, missing) = paired(waves, reference)?;
    let (from, to) = common_span(waves, reference)?;
    let grid = match at {
        At::AllRows => grid(waves.time.iter().chain(&reference.time), from, to),
        At::FirstRows => grid(waves.time.iter(), from, to),
        At::ReferenceRows => grid(reference.time.iter(), from, to),
    };
    let amplitudes: Vec<f64> = pairs.iter().map(|(_, b)| b.amplitude(&grid)).collect();
    let floor = |unit: &str| {
        let same_unit = pairs
            .iter()
            .zip(&amplitudes)
            .filter(|((j, _), _)| waves.units[*j] == unit);
        AMPLITUDE_FLOOR
            * same_unit
                .map(|(_, &amplitude)| amplitude)
                .fold(0.0, f64::max)
    };
    let signals = pairs
        .iter()
        .zip(&amplitudes)
        .map(|((j, b), &amplitude)| {
            let a = Curve::of(waves, *j);
            let mut amplitude = amplitude.max(floor(waves.units[*j]));
            if amplitude == 0.0 {
                amplitude = a.amplitude(&grid);
            }
            let scale = if amplitude > 0.0 {
                1.0 / amplitude
            } else {
                1.0
            };
            let (max, max_time, rms) = difference_norms(&a, b, &grid, at);
            let tube = tube_distance(&a, b, &grid, shift);
            let back = tube_distance(b, &a, &grid, shift);
            let (shifted, shifted_time) = if back.0 > tube.0 { back } else { tube };
            SignalError {
                name: waves.names[*j].clone(),
                unit: waves.units[*j],
                amplitude,
                max: max * scale,
                max_time,
                rms: rms * scale,
                shifted: shifted * scale,
                shifted_time,
            }
        })
        .collect();
    Ok(Comparison {
        from,
        to,
        shift,
        signals,
        missing,
    })
}

/// The common signals of both sides, `waves` minus `reference`, on the union of their grids with a row pair at each jump.
///
/// # Errors
/// As [`compare`].
pub fn difference(waves: &Waveforms, reference: &Waveforms) -> Result<Waveforms, CompareError> {
    let (pairs, _) = paired(waves, reference)?;
    let (from, to) = common_span(waves, reference)?;
    let curves: Vec<_> = pairs
        .into_iter()
        .map(|(j, b)| (j, Curve::of(waves, j), b))
        .collect();
    let mut result = Waveforms {
        title: waves.title.clone(),
        names: curves
            .iter()
            .map(|(j, ..)| waves.names[*j].clone())
            .collect(),
        units: curves.iter().map(|(j, ..)| waves.units[*j]).collect(),
        ..Waveforms::default()
    };
    for &t in &grid(waves.time.iter().chain(&reference.time), from, to) {
        let before: Vec<f64> = curves
            .iter()
            .map(|(_, a, b)| a.before(t) - b.before(t))
            .collect();
        let after: Vec<f64> = curves
            .iter()
            .map(|(_, a, b)| a.after(t) - b.after(t))
            .collect();
        if before != after {
            result.time.push(t);
            result.values.extend(before);
        }
        result.time.push(t);
        result.values.extend(after);
    }
    Ok(result)
}

/// A signal as straight lines between rows.
struct Curve<'a> {
    time: &'a [f64],
    values: Vec<f64>,
}

impl<'a> Curve<'a> {
    fn of(waves: &'a Waveforms, j: usize) -> Self {
        Self {
            time: &waves.time,
            values: waves.column(j).collect(),
        }
    }

    /// The limit from the left at t.
    fn before(&self, t: f64) -> f64 {
        let k = self.time.partition_point(|&s| s < t);
        if k == self.time.len() {
            self.values[k - 1]
        } else {
            self.between(k, t)
        }
    }

    /// The limit from the right at t.
    fn after(&self, t: f64) -> f64 {
        let k = self.time.partition_point(|&s| s <= t);
        match k {
            0 => self.values[0],
            k if self.time[k - 1] == t || k == self.time.len() => self.values[k - 1],
            k => self.between(k, t),
        }
    }

    /// On the line from row k − 1 to row k.
    fn between(&self, k: usize, t: f64) -> f64 {
        if k == 0 || self.time[k] == t {
            return self.values[k];
        }
        let weight = (t - self.time[k - 1]) / (self.time[k] - self.time[k - 1]);
        self.values[k - 1] * (1.0 - weight) + self.values[k] * weight
    }

    fn amplitude(&self, grid: &[f64]) -> f64 {
        grid.iter()
            .map(|&t| self.before(t).abs().max(self.after(t).abs()))
            .fold(0.0, f64::max)
    }
}

/// A column of the first side and the reference's curve of that name.
type Pair<'a> = (usize, Curve<'a>);

/// Columns of `waves` with their partners, and the names without one.
fn paired<'a>(
    waves: &Waveforms,
    reference: &'a Waveforms,
) -> Result<(Vec<Pair<'a>>, Vec<String>), CompareError> {
    let (mut pairs, mut missing) = (Vec::new(), Vec::new());
    for (j, name) in waves.names.iter().enumerate() {
        match partner(name, reference) {
            Some(curve) => pairs.push((j, curve)),
            None => missing.push(name.clone()),
        }
    }
    if pairs.is_empty() {
        let (first, second) = (waves.names.join(" "), reference.names.join(" "));
        return Err(CompareError::NoSignal { first, second });
    }
    Ok((pairs, missing))
}

fn partner<'a>(name: &str, reference: &'a Waveforms) -> Option<Curve<'a>> {
    if let Some(j) = reference.find(name) {
        return Some(Curve::of(reference, j));
    }
    let name = canonical_name(name);
    let (a, b) = name
        .strip_prefix("v(")?
        .strip_suffix(')')?
        .split_once(',')?;
    let node = |n: &str| {
        if n == "0" {
            return Some(vec![0.0; reference.len()]);
        }
        Some(reference.column(reference.find(n)?).collect())
    };
    let values = node(a)?
        .iter()
        .zip(node(b)?)
        .map(|(a, b): (&f64, f64)| a - b)
        .collect();
    Some(Curve {
        time: &reference.time,
        values,
    })
}

fn common_span(waves: &Waveforms, reference: &Waveforms) -> Result<(f64, f64), CompareError> {
    let span = |w: &Waveforms| w.time.first().copied().zip(w.time.last().copied());
    let describe =
        |w: &Waveforms| span(w).map_or("no rows".into(), |(a, b)| format!("{a:e} s to {b:e} s"));
    let common = span(waves)
        .zip(span(reference))
        .map(|(a, b)| (a.0.max(b.0), a.1.min(b.1)));
    common
        .filter(|(from, to)| from <= to)
        .ok_or_else(|| CompareError::NoOverlap {
            first: describe(waves),
            second: describe(reference),
        })
}

/// The times within the span, increasing, with the span's ends.
fn grid<'a>(times: impl Iterator<Item = &'a f64>, from: f64, to: f64) -> Vec<f64> {
    let inside = times.copied().filter(|t| (from..=to).contains(t));
    let mut grid: Vec<f64> = inside.chain([from, to]).collect();
    grid.sort_by(f64::total_cmp);
    grid.dedup();
    grid
}

/// max |a − b| with its time, and √(∫(a − b)² dt / T).
fn difference_norms(a: &Curve, b: &Curve, grid: &[f64], at: At) -> (f64, f64, f64) {
    let (mut max, mut max_time) = (0.0, grid[0]);
    let mut integral = 0.0;
    let mut previous: Option<(f64, f64)> = None;
    for &t in grid {
        let (a, b) = ((a.before(t), a.after(t)), (b.before(t), b.after(t)));
        let (mut left, mut right) = (a.0 - b.0, a.1 - b.1);
        let single = match at {
            At::AllRows => false,
            At::FirstRows => a.0 == a.1,
            At::ReferenceRows => b.0 == b.1,
        };
        if single {
            let nearer = if left.abs() < right.abs() {
                left
            } else {
                right
            };
            (left, right) = (nearer, nearer);
        }
        let here = left.abs().max(right.abs());
        if here > max {
            (max, max_time) = (here, t);
        }
        if let Some((t0, d)) = previous {
            integral += (t - t0) * (d * d + d * left + left * left) / 3.0;
        }
        previous = Some((t, right));
    }
    let span = grid[grid.len() - 1] - grid[0];
    (
        max,
        max_time,
        if span > 0.0 {
            (integral / span).sqrt()
        } else {
            max
        },
    )
}

/// The largest distance of `a(t)` from the range of `b` on [t − shift, t + shift] over the grid, and its time.
fn tube_distance(a: &Curve, b: &Curve, grid: &[f64], shift: f64) -> (f64, f64) {
    let (mut worst, mut worst_time) = (0.0, grid[0]);
    let (mut lows, mut highs) = (VecDeque::<usize>::new(), VecDeque::<usize>::new());
    let mut next = 0;
    for &t in grid {
        let (start, end) = (t - shift, t + shift);
        while next < b.time.len() && b.time[next] <= end {
            let value = b.values[next];
            while lows.back().is_some_and(|&k| b.values[k] >= value) {
                lows.pop_back();
            }
            while highs.back().is_some_and(|&k| b.values[k] <= value) {
                highs.pop_back();
            }
            lows.push_back(next);
            highs.push_back(next);
            next += 1;
        }
        while lows.front().is_some_and(|&k| b.time[k] < start) {
            lows.pop_front();
        }
        while highs.front().is_some_and(|&k| b.time[k] < start) {
            highs.pop_front();
        }
        let ends = [b.before(start), b.after(start), b.before(end), b.after(end)];
        let low = lows
            .front()
            .map(|&k| b.values[k])
            .into_iter()
            .chain(ends)
            .fold(f64::INFINITY, f64::min);
        let high = highs
            .front()
            .map(|&k| b.values[k])
            .into_iter()
            .chain(ends)
            .fold(f64::NEG_INFINITY, f64::max);
        for value in [a.before(t), a.after(t)] {
            let distance = (low - value).max(value - high);
            if distance > worst {
                (worst, worst_time) = (distance, t);
            }
        }
    }
    (worst, worst_time)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waves(name: &str, time: &[f64], values: &[f64]) -> Waveforms {
        Waveforms {
            names: vec![name.into()],
            units: vec![super::super::unit_of(name)],
            time: time.to_vec(),
            values: values.to_vec(),
            ..Waveforms::default()
        }
    }

    #[test]
    fn equal_curves_on_different_grids_differ_by_nothing() {
        let coarse = waves("v(a)", &[0.0, 1.0, 1.0, 2.0], &[0.0, 2.0, -2.0, 0.0]);
        let fine = waves(
            "V(A)",
            &[0.0, 0.5, 1.0, 1.0, 1.25, 2.0],
            &[0.0, 1.0, 2.0, -2.0, -1.5, 0.0],
        );
        let found = compare(&coarse, &fine, At::AllRows, 0.0).unwrap();
        let s = &found.signals[0];
        assert_eq!((s.max, s.rms, s.shifted, s.amplitude), (0.0, 0.0, 0.0, 2.0));
    }

    #[test]
    fn a_late_edge_is_a_large_error_that_a_shift_forgives() {
        let reference = waves("v(a)", &[0.0, 1.0, 1.0, 3.0], &[0.0, 0.0, 4.0, 4.0]);
        let late = waves("v(a)", &[0.0, 1.1, 1.1, 3.0], &[0.0, 0.0, 4.0, 4.0]);
        let found = compare(&late, &reference, At::AllRows, 0.2).unwrap();
        let s = &found.signals[0];
        assert_eq!((s.max, s.max_time, s.shifted), (1.0, 1.0, 0.0));
        // |a − b| = 4 for 0.1 s of 3 s.
        assert!((s.rms - (0.1f64 / 3.0).sqrt()).abs() < 1e-12);
        let strict = compare(&late, &reference, At::AllRows, 0.05).unwrap();
        assert_eq!(strict.signals[0].shifted, 1.0);
    }

    #[test]
    fn a_spike_on_either_side_is_seen_through_the_shift() {
        let flat = waves("v(a)", &[0.0, 1.0], &[1.0, 1.0]);
        let spike = waves(
            "v(a)",
            &[0.0, 0.49, 0.5, 0.51, 1.0],
            &[1.0, 1.0, 3.0, 1.0, 1.0],
        );
        assert_eq!(
            compare(&flat, &spike, At::AllRows, 0.1).unwrap().signals[0].shifted,
            2.0 / 3.0
        );
        let found = compare(&spike, &flat, At::AllRows, 0.1).unwrap();
        assert_eq!(
            (found.signals[0].shifted, found.signals[0].shifted_time),
            (2.0, 0.5)
        );
    }

    #[test]
    fn voltages_between_nodes_are_differences_of_the_reference() {
        let ours = waves("v(a,b)", &[0.0, 1.0], &[1.0, 1.0]);
        let reference = Waveforms {
            names: vec!["a".into(), "b".into()],
            units: vec!["V", "V"],
            time: vec![0.0, 1.0],
            values: vec![3.0, 2.0, 4.0, 2.5],
            ..Waveforms::default()
        };
        let found = compare(&ours, &reference, At::AllRows, 0.0).unwrap();
        assert_eq!(
            (found.signals[0].amplitude, found.signals[0].max_time),
            (1.5, 1.0)
        );
        let delta = difference(&ours, &reference).unwrap();
        assert_eq!(delta.values, [0.0, -0.5]);
    }

    #[test]
    fn leakage_next_to_amperes_is_measured_against_the_amperes() {
        let both = |small: f64| Waveforms {
            names: vec!["i(d1)".into(), "i(v1)".into()],
            units: vec!["A", "A"],
            time: vec![0.0, 1.0],
            values: vec![small, 2.0, small, 2.0],
            ..Waveforms::default()
        };
        let found = compare(&both(0.0), &both(1e-12), At::AllRows, 0.0).unwrap();
        assert_eq!(found.signals[0].amplitude, 2e-9);
        assert!((found.signals[0].max - 5e-4).abs() < 1e-15);
        // A signal that should vanish and does not is not excused.
        assert!(
            compare(&both(1.0), &both(0.0), At::AllRows, 0.0)
                .unwrap()
                .signals[0]
                .max
                > 1e8
        );
    }

    #[test]
    fn between_the_rows_of_another_program_nothing_is_claimed() {
        let parabola = |n: u32| {
            let time: Vec<f64> = (0..=n).map(|k| f64::from(k) / f64::from(n)).collect();
            let values: Vec<f64> = time.iter().map(|t| t * t).collect();
            waves("v(a)", &time, &values)
        };
        let error = |at| {
            compare(&parabola(64), &parabola(4), at, 0.0)
                .unwrap()
                .signals[0]
                .max
        };
        assert_eq!(
            (error(At::ReferenceRows), error(At::AllRows)),
            (0.0, 1.0 / 64.0)
        );
    }

    #[test]
    fn a_row_at_a_jump_may_hold_either_limit() {
        let jump = waves("v(a)", &[0.0, 1.0, 1.0, 2.0], &[0.0, 0.0, 3.0, 3.0]);
        for value in [0.0, 3.0] {
            let rows = waves("v(a)", &[0.0, 1.0, 2.0], &[0.0, value, 3.0]);
            let error = |found: Result<Comparison, CompareError>| found.unwrap().signals[0].max;
            assert_eq!(error(compare(&jump, &rows, At::ReferenceRows, 0.0)), 0.0);
            assert_eq!(error(compare(&rows, &jump, At::FirstRows, 0.0)), 0.0);
            assert_eq!(error(compare(&rows, &jump, At::AllRows, 0.0)), 1.0);
        }
        let wrong = waves("v(a)", &[0.0, 1.0, 2.0], &[0.0, 1.0, 3.0]);
        assert_eq!(
            compare(&wrong, &jump, At::FirstRows, 0.0).unwrap().signals[0].max,
            1.0 / 3.0
        );
    }

    #[test]
    fn nothing_in_common_is_an_error() {
        let a = waves("v(a)", &[0.0, 1.0], &[0.0, 0.0]);
        assert!(matches!(
            compare(&a, &waves("v(b)", &[0.0], &[0.0]), At::AllRows, 0.0),
            Err(CompareError::NoSignal { .. })
        ));
        let later = waves("v(a)", &[2.0, 3.0], &[0.0, 0.0]);
        let error = compare(&a, &later, At::AllRows, 0.0)
            .unwrap_err()
            .to_string();
        assert_eq!(
            error,
            "no common span of time: 0e0 s to 1e0 s and 2e0 s to 3e0 s"
        );
        assert!(compare(&a, &waves("v(a)", &[], &[]), At::AllRows, 0.0).is_err());
    }
}
