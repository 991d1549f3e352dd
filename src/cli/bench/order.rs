//! The observed order of a ladder of steps.

use super::ladder::IMPLICIT;
use crate::report::work::{Measurement, Order};

/// Errors below this are rounding and say nothing about the order.
const ROUNDING: f64 = 1e-11;

/// The observed orders of the fixed-step ladders.
pub(super) fn orders(measurements: &[Measurement]) -> Vec<Order> {
    ["euler", "theta", IMPLICIT]
        .into_iter()
        .filter_map(|series| {
            let rungs = || measurements.iter().filter(move |m| m.series == series);
            let slope = |error: fn(&Measurement) -> Option<f64>| {
                let points: Vec<(f64, f64)> = rungs()
                    .filter_map(|m| {
                        let step: f64 = m.parameter.strip_prefix("step=")?.parse().ok()?;
                        let error = error(m).filter(|e| *e > ROUNDING)?;
                        Some((step.ln(), error.ln()))
                    })
                    .collect();
                least_squares_slope(&points)
            };
            let (max, rms) = slope(|m| m.max_error).zip(slope(|m| m.rms_error))?;
            Some(Order {
                series: series.into(),
                max,
                rms,
            })
        })
        .collect()
}

/// The slope of the straight line nearest to at least three points.
fn least_squares_slope(points: &[(f64, f64)]) -> Option<f64> {
    if points.len() < 3 {
        return None;
    }
    let n = points.len() as f64;
    let (x, y) = points
        .iter()
        .fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |(xy, xx), p| {
        (xy + (p.0 - x) * (p.1 - y), xx + (p.0 - x) * (p.0 - x))
    });
    (xx > 0.0).then(|| xy / xx)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_is_the_slope() {
        let points: Vec<(f64, f64)> = (0..5)
            .map(|k| (f64::from(k), 3.0 + 2.0 * f64::from(k)))
            .collect();
        assert_eq!(least_squares_slope(&points), Some(2.0));
        assert_eq!(least_squares_slope(&points[..2]), None);
    }
}
