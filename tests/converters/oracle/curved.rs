//! Currents of exponential diodes for given states and sources, by Newton's method on their voltages.

use super::network::{Mode, Row};
use super::{Factors, Network};

/// k·T/q at 27 °C, V.
const THERMAL: f64 = 1.380_649e-23 * 300.15 / 1.602_176_634e-19;

pub(super) fn dot(row: &Row, known: &[f64]) -> f64 {
    row.iter().zip(known).map(|(a, b)| a * b).sum()
}

/// States, sources, diode currents and 1: what a [`Row`] multiplies.
pub(super) fn known(network: &Network, mode: &Mode, x: &[f64], u: &[f64]) -> Vec<f64> {
    let mut known: Vec<f64> = x.iter().chain(u).copied().collect();
    let first = known.len();
    known.resize(first + network.curved.len() + 1, 0.0);
    if let Some(one) = known.last_mut() {
        *one = 1.0;
    }
    if !network.curved.is_empty() {
        currents(network, mode, &mut known, first);
    }
    known
}

/// exp(x) without numbers below the normal ones, which cost much and are nothing beside 1.
fn exponential(x: f64) -> f64 {
    if x < -700.0 { 0.0 } else { x.exp() }
}

/// v = q + Z i(v): Newton on the voltages, a voltage above the knee moved in the logarithm of its current.
fn currents(network: &Network, mode: &Mode, known: &mut [f64], first: usize) {
    let m = network.curved.len();
    let open: Vec<f64> = mode.drops.iter().map(|row| dot(row, known)).collect();
    let knees: Vec<f64> = network
        .curved
        .iter()
        .map(|&(is, n)| n * THERMAL * (n * THERMAL / (std::f64::consts::SQRT_2 * is)).ln())
        .collect();
    let mut v: Vec<f64> = open.iter().zip(&knees).map(|(q, k)| q.min(*k)).collect();
    let mut last = f64::INFINITY;
    for _ in 0..200 {
        let mut a = vec![0.0; m * m];
        let mut residual = vec![0.0; m];
        let law = |k: usize| {
            let (is, n) = network.curved[k];
            let e = exponential(v[k] / (n * THERMAL));
            (is * (e - 1.0), is * e / (n * THERMAL))
        };
        for i in 0..m {
            residual[i] = open[i] - v[i];
            a[i * m + i] += 1.0;
            for j in 0..m {
                let z = mode.drops[i][first + j];
                let (current, slope) = law(j);
                residual[i] += z * current;
                a[i * m + j] -= z * slope;
            }
        }
        let Some(factors) = Factors::new(m, a) else {
            break;
        };
        let step = factors.solve(&residual);
        let mut largest = 0.0_f64;
        for k in 0..m {
            let nvt = network.curved[k].1 * THERMAL;
            let wanted = v[k] + step[k];
            let next = if wanted > knees[k] && step[k] > 2.0 * nvt {
                if v[k] > 0.0 {
                    v[k] + nvt * (1.0 + step[k] / nvt).ln()
                } else {
                    knees[k]
                }
            } else {
                wanted
            };
            largest = largest.max((next - v[k]).abs() / (nvt + 1e-9 * v[k].abs()));
            v[k] = next;
        }
        // What does not shrink any more is rounding.
        if largest < 1e-13 || largest < 1e-9 && largest >= 0.5 * last {
            break;
        }
        last = largest;
    }
    for k in 0..m {
        let (is, n) = network.curved[k];
        known[first + k] = is * (exponential(v[k] / (n * THERMAL)) - 1.0);
    }
}

/// Derivatives of the rates to the states, by rows.
pub(super) fn jacobian(network: &Network, mode: &Mode, known: &[f64], n: usize) -> Vec<f64> {
    let mut jacobian = Vec::with_capacity(n * n);
    mode.rates.iter().for_each(|r| jacobian.extend(&r[..n]));
    let m = network.curved.len();
    if m == 0 {
        return jacobian;
    }
    let first = known.len() - 1 - m;
    // di/dv at the current.
    let slopes: Vec<f64> = (0..m)
        .map(|k| (known[first + k] + network.curved[k].0) / (network.curved[k].1 * THERMAL))
        .collect();
    let mut a = vec![0.0; m * m];
    for i in 0..m {
        a[i * m + i] += 1.0;
        for j in 0..m {
            a[i * m + j] -= mode.drops[i][first + j] * slopes[j];
        }
    }
    let Some(factors) = Factors::new(m, a) else {
        return jacobian;
    };
    for l in 0..n {
        let column: Vec<f64> = mode.drops.iter().map(|row| row[l]).collect();
        let volts = factors.solve(&column);
        for k in 0..n {
            let through = (0..m).map(|j| mode.rates[k][first + j] * slopes[j] * volts[j]);
            jacobian[k * n + l] += through.sum::<f64>();
        }
    }
    jacobian
}
