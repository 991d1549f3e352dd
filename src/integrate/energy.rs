//! The energy balance along a run: source − dissipated − Δstored.
//!
//! Power is Σ (v-row · w)(i-row · w) with w = [x | λ | u | u' | 1]; over a (θ, γ) step all of w is taken at the point k + γ,
//! u' as (u⁺ − u)/h. With θ = γ = ½ this discrete balance is exact, so the residual is rounding; with θ = 1 the residual is the
//! scheme's own damping. On one active set w is affine in z = [x; u⁺; u; 1], so each sum is one quadratic form in z.

use nalgebra::{DMatrix, DVector};

use crate::integrate::Energy;
use crate::integrate::reading::{self, Point};
use crate::integrate::step::{Columns, Scheme};
use crate::lcs::{Lcs, PowerKind, Rows};

/// Quadratic forms of z: energy from sources and into resistors and devices over one step, J.
#[derive(Debug, Clone, Default)]
pub(crate) struct PowerForms {
    source: Vec<f64>,
    dissipated: Vec<f64>,
}

impl PowerForms {
    /// Forms of one active set, where x⁺ = `x_next` z and λ = `lambda` z. Empty where the system has no power terms.
    pub(crate) fn new(
        lcs: &Lcs,
        columns: &Columns,
        h: f64,
        scheme: Scheme,
        x_next: &DMatrix<f64>,
        lambda: &DMatrix<f64>,
    ) -> Self {
        let terms = &lcs.outputs.power;
        if terms.is_empty() {
            return Self::default();
        }
        let (n, p, width) = (lcs.n(), lcs.p(), columns.len());
        let gamma = scheme.gamma;
        let mut x = x_next * gamma;
        for i in 0..n {
            x[(i, i)] += 1.0 - gamma;
        }
        let identity = DMatrix::identity(p, p);
        let no_x = DMatrix::zeros(p, n);
        let none = DVector::zeros(p);
        let u = columns.rows(&no_x, &identity, gamma, &none);
        // (u⁺ − u)/h has no part of the constant inputs: the difference of the two ends.
        let ends = columns.rows(&no_x, &identity, 1.0, &none);
        let starts = columns.rows(&no_x, &identity, 0.0, &none);
        let du = (ends - starts) / h;
        let over_z = |rows: &Rows| -> DMatrix<f64> {
            let mut table = DMatrix::zeros(terms.len(), width);
            let blocks = [
                (&rows.x, &x),
                (&rows.lambda, lambda),
                (&rows.u, &u),
                (&rows.du, &du),
            ];
            for (block, map) in blocks {
                if block.nrows() == terms.len() && block.ncols() == map.nrows() {
                    table += block * map;
                }
            }
            for (i, one) in rows.one.iter().enumerate().take(terms.len()) {
                table[(i, width - 1)] += one;
            }
            table
        };
        let (v, i) = (over_z(&lcs.outputs.power_v), over_z(&lcs.outputs.power_i));
        let sum = |kind: PowerKind, sign: f64| -> DMatrix<f64> {
            let of_kind = (0..terms.len()).filter(|&k| terms[k].kind == kind);
            let rows: Vec<usize> = of_kind.collect();
            v.select_rows(&rows).tr_mul(&i.select_rows(&rows)) * (sign * h)
        };
        let (source, dissipated) = (
            sum(PowerKind::Source, -1.0),
            sum(PowerKind::Dissipated, 1.0),
        );
        let pack = |q: DMatrix<f64>| {
            // zᵀQz with Q folded onto its upper triangle, row by row; nothing where Q = 0.
            if q.amax() == 0.0 {
                return Vec::new();
            }
            let mut packed = Vec::with_capacity(width * (width + 1) / 2);
            for i in 0..width {
                packed.push(q[(i, i)]);
                packed.extend((i + 1..width).map(|j| q[(i, j)] + q[(j, i)]));
            }
            packed
        };
        Self {
            source: pack(source),
            dissipated: pack(dissipated),
        }
    }

    /// (from sources, dissipated) over the step from z, J.
    #[inline]
    pub(crate) fn over_step(&self, z: &[f64]) -> (f64, f64) {
        (form(&self.source, z), form(&self.dissipated, z))
    }
}

#[inline]
fn form(packed: &[f64], z: &[f64]) -> f64 {
    let mut rest = packed;
    let mut sum = 0.0;
    for i in 0..z.len() {
        if rest.is_empty() {
            break;
        }
        let (row, tail) = rest.split_at(z.len() - i);
        sum += z[i] * row.iter().zip(&z[i..]).map(|(a, b)| a * b).sum::<f64>();
        rest = tail;
    }
    sum
}

/// (from sources, dissipated) at one instant, W.
#[must_use]
pub fn power(lcs: &Lcs, at: Point<'_>) -> (f64, f64) {
    let (mut source, mut dissipated) = (0.0, 0.0);
    for (i, term) in lcs.outputs.power.iter().enumerate() {
        let product = reading::value(&lcs.outputs.power_v, i, at)
            * reading::value(&lcs.outputs.power_i, i, at);
        match term.kind {
            PowerKind::Source => source -= product,
            PowerKind::Dissipated => dissipated += product,
            PowerKind::Line => {}
        }
    }
    (source, dissipated)
}

/// Work of the sources in a jump, J: the impulse of one factor times the other factor, which moves linearly with the charge
/// (flux) between its values before and after. `u` and `u_after` are the inputs before and after, p the port impulses.
#[must_use]
pub fn source_work_of_jump(
    lcs: &Lcs,
    x: &[f64],
    x_after: &[f64],
    u: &[f64],
    u_after: &[f64],
    p: &[f64],
) -> f64 {
    let mean = |a: &[f64], b: &[f64]| -> Vec<f64> {
        a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect()
    };
    let step: Vec<f64> = u_after.iter().zip(u).map(|(a, b)| a - b).collect();
    let (no_p, no_step) = (vec![0.0; p.len()], vec![0.0; u.len()]);
    let zero_lambda = &no_p;
    // First the edge of u at fixed x, then the devices' impulse at fixed u.
    let parts = [
        (x.to_vec(), mean(u, u_after), &no_p[..], &step[..]),
        (mean(x, x_after), u_after.to_vec(), p, &no_step[..]),
    ];
    let mut work = 0.0;
    for (x, u, p, step) in &parts {
        let at = Point {
            x,
            lambda: zero_lambda,
            u,
            du: &no_step,
        };
        for (i, term) in lcs.outputs.power.iter().enumerate() {
            if term.kind == PowerKind::Source {
                let (v, current) = (&lcs.outputs.power_v, &lcs.outputs.power_i);
                work -= reading::value(v, i, at) * reading::impulse(current, i, p, step)
                    + reading::value(current, i, at) * reading::impulse(v, i, p, step);
            }
        }
    }
    work
}

/// (from sources, dissipated), J, where storage elements s become s⁺ because a switch joins them to one another or to sources: the
/// impulses in the loops (cut-sets) move s⁺ to where it is closest to s in the metric M of stored energy, so that ½ ΔᵀM Δ is lost,
/// Δ = s⁺ − s, and the sources bring s⁺ᵀM Δ.
pub(crate) fn taking_over(metric: &DMatrix<f64>, s: &[f64], after: &DVector<f64>) -> (f64, f64) {
    let step = after - DVector::from_column_slice(s);
    let charge = metric * &step;
    (after.dot(&charge), 0.5 * step.dot(&charge))
}

/// Stored energy, J: ½ sᵀ M s of all storage elements, or ½ xᵀ P x where the system does not name them.
#[must_use]
pub fn stored(lcs: &Lcs, x: &[f64], u: &[f64]) -> f64 {
    stored_with(lcs, x, u, &mut Vec::new())
}

/// As [`stored`], with a buffer for s.
pub(crate) fn stored_with(lcs: &Lcs, x: &[f64], u: &[f64], s: &mut Vec<f64>) -> f64 {
    let storage = &lcs.storage;
    let row = |block: &DMatrix<f64>, k: usize, v: &[f64]| -> f64 {
        (0..block.ncols().min(v.len()))
            .map(|j| block[(k, j)] * v[j])
            .sum()
    };
    let metric = if storage.metric.is_empty() {
        &lcs.energy
    } else {
        &storage.metric
    };
    s.clear();
    if storage.metric.is_empty() {
        s.extend_from_slice(x);
    } else {
        s.extend(
            (0..storage.one.len())
                .map(|k| storage.one[k] + row(&storage.x, k, x) + row(&storage.u, k, u)),
        );
    }
    if metric.nrows() != s.len() {
        return 0.0;
    }
    0.5 * s
        .iter()
        .enumerate()
        .map(|(k, v)| v * row(metric, k, s))
        .sum::<f64>()
}

/// Sums of a run.
#[derive(Debug, Clone, Copy, Default)]
pub struct Balance {
    source: f64,
    dissipated: f64,
    first: f64,
    last: f64,
    largest: f64,
}

impl Balance {
    /// A balance that starts with this stored energy, J.
    #[must_use]
    pub fn new(stored: f64) -> Self {
        Self {
            first: stored,
            last: stored,
            largest: stored.abs(),
            ..Self::default()
        }
    }

    /// So much more is stored from the start on, J.
    pub(crate) fn hold(&mut self, more: f64) {
        self.first += more;
        self.last += more;
        self.largest = self.largest.max(self.last.abs());
    }

    /// The largest energy noted, J.
    pub(crate) fn largest(&self) -> f64 {
        self.largest
    }

    /// Adds energy from sources and dissipated energy, J.
    #[inline]
    pub fn add(&mut self, (source, dissipated): (f64, f64)) {
        self.source += source;
        self.dissipated += dissipated;
    }

    /// Notes the stored energy now, J.
    pub fn note(&mut self, stored: f64) {
        self.last = stored;
        self.largest = self
            .largest
            .max(stored.abs())
            .max(self.source.abs())
            .max(self.dissipated.abs());
    }

    /// The result.
    #[must_use]
    pub fn energy(&self) -> Energy {
        let stored = self.last - self.first;
        let residual = (self.source - self.dissipated - stored).abs();
        let residual_relative = if self.largest > 0.0 {
            residual / self.largest
        } else {
            0.0
        };
        Energy {
            source: self.source,
            dissipated: self.dissipated,
            stored,
            residual_relative,
        }
    }
}
