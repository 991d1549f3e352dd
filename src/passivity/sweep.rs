//! Where the transfer matrix fails to be positive real: a sweep over the axes and around the poles.

use super::System;
use super::witness::{C, Witness, complex, eigenvalues, resolvent};
use crate::settings::tolerances::passivity::{BAND, POLE_AT_REST, SEARCHED_AROUND};

/// Points of the frequency sweep per decade.
const PER_DECADE: usize = 6;

/// Steps of the golden-section refinement at a local minimum of the sweep.
const REFINE: usize = 40;

/// The smallest eigenvalue of H(s) + H(s)* relative to ‖H(s)‖, with its motion.
fn at(system: &System, s: C) -> Option<(f64, Witness)> {
    let b = complex(&system.b);
    let x = resolvent(&system.a, s).lu().solve(&b)?;
    let h = complex(&system.c) * &x + complex(&system.d);
    let size = h.iter().map(|z| z.norm()).fold(0.0, f64::max);
    if !(size.is_finite() && size > 0.0) {
        return None;
    }
    let hermitian = (&h + h.adjoint()) * C::new(0.5, 0.0);
    let eigen = hermitian.symmetric_eigen();
    let k = eigen.eigenvalues.imin();
    let v = eigen.eigenvectors.column(k).into_owned();
    let supply = eigen.eigenvalues[k];
    let witness = Witness::Motion {
        s,
        state: (x * &v).as_slice().to_vec(),
        input: v.as_slice().to_vec(),
        supply,
    };
    Some((supply / size, witness))
}

/// Sweeps the imaginary axis, the real axis and the neighbourhood of the poles, refining local minima on the axis.
pub(super) fn violation(
    system: &System,
    accept: impl Fn(Witness) -> Option<Witness>,
) -> Option<Witness> {
    if system.m() == 0 || system.n() == 0 {
        return None;
    }
    let poles = eigenvalues(&system.a);
    let sizes = || poles.iter().map(|p| p.norm()).filter(|&v| v > POLE_AT_REST);
    let low = sizes().fold(1.0, f64::min) * BAND.0;
    let high = sizes().fold(1.0, f64::max) * BAND.1;
    let count = ((high / low).log10() * PER_DECADE as f64).ceil() as usize + 1;
    let mut grid: Vec<f64> = (0..count)
        .map(|k| low * (high / low).powf(k as f64 / (count - 1).max(1) as f64))
        .collect();
    for p in &poles {
        for f in [0.9, 0.99, 0.999, 1.0, 1.001, 1.01, 1.1] {
            grid.extend(
                [p.im.abs() * f, p.norm() * f]
                    .into_iter()
                    .filter(|&v| v > 0.0),
            );
        }
    }
    grid.sort_by(f64::total_cmp);
    let on_axis = |w: f64| at(system, C::new(0.0, w));
    let mut found = Vec::new();
    let values: Vec<f64> = grid
        .iter()
        .map(|&w| {
            on_axis(w).map_or(f64::INFINITY, |(value, witness)| {
                found.push((value, witness));
                value
            })
        })
        .collect();
    for k in 0..grid.len() {
        let left = k.saturating_sub(1);
        let right = (k + 1).min(grid.len() - 1);
        if values[k].is_finite() && values[k] <= values[left] && values[k] <= values[right] {
            found.extend(refine(on_axis, grid[left].ln(), grid[right].ln()));
        }
    }
    for &w in grid.iter().step_by(3) {
        found.extend(at(system, C::new(w, 0.0)));
    }
    for p in &poles {
        for radius in SEARCHED_AROUND {
            found.extend(at(system, C::new(radius * p.norm().max(low), p.im)));
        }
    }
    found.retain(|(value, _)| *value < 0.0);
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found
        .into_iter()
        .take(40)
        .find_map(|(_, witness)| accept(witness))
}

/// Golden-section search for the minimum over ω = exp(l), l in [a, b].
fn refine(
    value: impl Fn(f64) -> Option<(f64, Witness)>,
    mut a: f64,
    mut b: f64,
) -> Option<(f64, Witness)> {
    let ratio = (5.0_f64.sqrt() - 1.0) / 2.0;
    let at = |l: f64| value(l.exp()).map_or(f64::INFINITY, |(v, _)| v);
    let (mut c, mut d) = (b - ratio * (b - a), a + ratio * (b - a));
    let (mut fc, mut fd) = (at(c), at(d));
    for _ in 0..REFINE {
        if fc < fd {
            (b, d, fd) = (d, c, fc);
            c = b - ratio * (b - a);
            fc = at(c);
        } else {
            (a, c, fc) = (c, d, fd);
            d = a + ratio * (b - a);
            fd = at(d);
        }
    }
    value((0.5 * (a + b)).exp())
}
