//! How far two sets of waveforms are apart, on whatever grids they stand.
//!
//! Both sides are read as what they are: straight lines between rows, and a jump where two rows share a time. On the union of
//! the two grids the difference is then straight between neighbours, so its maximum and its integral are exact.

mod curve;

#[cfg(test)]
mod tests;

use self::curve::{Curve, difference_norms, tube_distance};
use super::{Waveforms, canonical_name};
use crate::settings::tolerances::stated::AMPLITUDE_FLOOR;

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
