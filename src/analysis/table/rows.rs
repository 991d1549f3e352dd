//! The sums of a table over the straight lines between rows.

use std::f64::consts::TAU;

use nalgebra::Complex;

use super::{Columns, Span, Sums, distortion};
use crate::integrate::Run;

pub(super) fn sums(columns: &Columns<'_>, run: &Run, span: Span, period: Option<f64>) -> Sums {
    let waves = &run.waveforms;
    let count = columns.probes.len();
    let mut sums = Sums {
        mean: vec![0.0; count],
        square: vec![0.0; count],
        least: vec![f64::INFINITY; count],
        greatest: vec![f64::NEG_INFINITY; count],
        work: vec![0.0; columns.elements.len()],
        distortion: vec![None; columns.shown.len()],
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
    sums
}
