//! The sums of a table over the straight lines between rows.

use std::f64::consts::TAU;

use nalgebra::Complex;

use super::columns::{Columns, Sums, distortion};
use super::commutation::{Commutations, Costs};
use super::means::Span;
use crate::integrate::Run;
use crate::settings::tolerances::times::SAME_TIME;

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
        costs: Vec::new(),
    };
    let seconds = period.unwrap_or(0.0);
    let whole = (span.to - seconds).max(span.from);
    let mut parts = vec![(0.0, 0.0, Complex::<f64>::default()); count];
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
            if let (Some(period), true) = (period, t0 >= whole - 0.5 * h) {
                let omega = TAU / period;
                let turn = |t: f64| Complex::from_polar(1.0, -omega * (t - span.from));
                // ∫ (a + b t) e^{−jωt} by Simpson's rule on the line.
                let middle = turn(0.5 * (t0 + t1)) * (0.5 * (y0[c] + y1[c]));
                let part = (turn(t0) * y0[c] + middle * 4.0 + turn(t1) * y1[c]) * (h / 6.0);
                let (m, s, f) = &mut parts[c];
                (*m, *s, *f) = (*m + mean, *s + square, *f + part);
            }
        }
        for (work, (i, v)) in sums.work.iter_mut().zip(&columns.elements) {
            *work += product(*i, *v);
        }
    }
    if seconds > 0.0 {
        for (found, &c) in sums.distortion.iter_mut().zip(&columns.shown) {
            let (mean, square, harmonic) = parts[c];
            *found = distortion(square, mean, harmonic.norm(), seconds);
        }
    }
    let extremes = (&sums.least[..], &sums.greatest[..]);
    sums.costs = costs(columns, run, (span.from, closes), extremes);
    sums
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
