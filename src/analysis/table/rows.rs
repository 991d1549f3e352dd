//! The sums of a table over the straight lines between rows.

use super::columns::{Columns, Sums, distortion};
use super::commutation::{Commutations, Costs};
use super::means::Span;
use crate::integrate::Run;
use crate::measure::{Over, Trace, fourier};
use crate::settings::tolerances::times::SAME_TIME;
use crate::waveform::Waveforms;

pub(super) fn sums(
    columns: &Columns<'_>,
    run: &Run,
    span: Span,
    (period, closes): (Option<f64>, bool),
) -> Sums {
    let waves = &run.waveforms;
    let count = columns.probes.len();
    let mut sums = Sums {
        mean: vec![0.0; count],
        square: vec![0.0; count],
        least: vec![f64::INFINITY; count],
        greatest: vec![f64::NEG_INFINITY; count],
        work: vec![0.0; columns.elements.len()],
        distortion: vec![None; columns.shown.len()],
        struck: vec![false; columns.shown.len()],
        costs: Vec::new(),
    };
    let mut rows = waves.time.iter().zip(waves.values.chunks_exact(count));
    let mut before = rows.next();
    for row in rows {
        let Some((&t0, y0)) = before.replace(row) else {
            continue;
        };
        let (&t1, y1) = row;
        let h = t1 - t0;
        // ∫ of a product of straight lines.
        let product = |a: usize, b: usize| {
            h / 6.0 * (y0[a] * (2.0 * y0[b] + y1[b]) + y1[a] * (y0[b] + 2.0 * y1[b]))
        };
        for c in 0..count {
            let (mean, square) = (0.5 * h * (y0[c] + y1[c]), product(c, c));
            sums.mean[c] += mean;
            sums.square[c] += square;
            sums.least[c] = sums.least[c].min(y0[c]).min(y1[c]);
            sums.greatest[c] = sums.greatest[c].max(y0[c]).max(y1[c]);
        }
        for (work, (i, v)) in sums.work.iter_mut().zip(&columns.elements) {
            *work += product(*i, *v);
        }
    }
    if let Some(period) = period {
        for (found, &c) in sums.distortion.iter_mut().zip(&columns.shown) {
            *found = distorted(waves, c, period);
        }
    }
    let extremes = (&sums.least[..], &sums.greatest[..]);
    sums.costs = costs(columns, run, (span.from, closes), extremes);
    sums
}

/// The distortion over the last period, of which `.four` has the fundamental.
fn distorted(waves: &Waveforms, column: usize, period: f64) -> Option<f64> {
    let to = *waves.time.last()?;
    let over = |trace: &Trace<'_>, what| trace.over(what, to - period, to).ok();
    let values: Vec<f64> = waves.column(column).collect();
    let mean = over(&Trace::lines(&waves.time, &values[..]), Over::Average)?;
    // About the mean, of which a ripple may be a small part.
    let ripple: Vec<f64> = values.iter().map(|y| y - mean).collect();
    let ripple = Trace::lines(&waves.time, ripple);
    let alternating = over(&ripple, Over::Rms)?.powi(2);
    let spectrum = fourier(&ripple, period.recip(), 1).ok()?;
    let fundamental = 0.5 * spectrum.harmonics.first()?.magnitude.powi(2);
    distortion(mean, alternating, fundamental)
}

/// Of changes of state after a time, from the first and the last row of each event; where the run closes, a switch that ends it elsewhere than it began moves
/// between its end and its start.
fn costs(
    columns: &Columns<'_>,
    run: &Run,
    (from, closes): (f64, bool),
    extremes: (&[f64], &[f64]),
) -> Vec<Costs> {
    let mut commutations = Commutations::of(columns, extremes);
    let (waves, count) = (&run.waveforms, columns.probes.len());
    let row = |k: usize| &waves.values[k * count..(k + 1) * count];
    let Some(last) = waves.time.len().checked_sub(1) else {
        return commutations.costs;
    };
    let same = SAME_TIME * waves.time[last].abs();
    for event in run.events.iter().filter(|event| event.t > from + same) {
        let before = waves.time.partition_point(|t| *t < event.t - same);
        let after = waves.time.partition_point(|t| *t <= event.t + same);
        let sides = (row(before.min(last)), row(after.saturating_sub(1)));
        let moved = |name: &str| {
            let to = |on: bool| event.turns(name, on).then_some(on);
            to(true).or_else(|| to(false))
        };
        commutations.see(moved, sides);
    }
    if closes {
        let moved = |name: &str| {
            let turns = |on: bool| run.events.iter().filter(|e| e.turns(name, on)).count();
            let (ons, offs) = (turns(true), turns(false));
            (ons != offs).then_some(ons < offs)
        };
        commutations.see(moved, (row(last), row(0)));
    }
    commutations.costs
}
