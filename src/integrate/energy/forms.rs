//! Energies of one step of a (θ, γ) method or of its stages; the equations stand in the [parent](super).

use nalgebra::{DMatrix, DVector};

use super::{Stock, power, storage};
use crate::integrate::reading::Point;
use crate::integrate::step::{Columns, Scheme};
use crate::lcs::{Lcs, PowerKind, Role, Rows};
use crate::settings::tolerances::ranks::RANK;
use crate::solve::lcp::Scaling;
use crate::solve::norm;

/// Quadratic forms of z: energy from sources and into resistors and devices over one step, J, and what the scheme loses.
#[derive(Debug, Clone, Default)]
pub(crate) struct PowerForms {
    source: Vec<f64>,
    dissipated: Vec<f64>,
    /// Entries (i, j, a), i ≤ j, of the loss Σ a δ_i δ_j in δ = [x⁺ − x; u⁺ − u].
    damping: Vec<(usize, usize, f64)>,
    /// What ideal pairs seem to take up, where γ ≠ θ.
    seeming: Vec<f64>,
}

impl PowerForms {
    /// Forms of one active set, where x⁺ = `x_next` z and λ = `lambda` z.
    pub(crate) fn new(
        lcs: &Lcs,
        columns: &Columns,
        h: f64,
        scheme: Scheme,
        active: &[bool],
        x_next: &DMatrix<f64>,
        lambda: &DMatrix<f64>,
    ) -> Self {
        let terms = &lcs.outputs.power;
        let (n, p, width) = (lcs.n(), lcs.p(), columns.len());
        let theta = scheme.theta;
        let mut x = x_next * theta;
        for i in 0..n {
            x[(i, i)] += 1.0 - theta;
        }
        let identity = DMatrix::identity(p, p);
        let no_x = DMatrix::zeros(p, n);
        let none = DVector::zeros(p);
        let u = columns.rows(&no_x, &identity, theta, &none);
        let stock = Stock::of(lcs);
        let mut seen = lambda.clone();
        let mut seeming = DMatrix::zeros(width, width);
        if scheme.gamma != theta {
            let direct = columns.rows(&(&lcs.c * 0.0), &lcs.g, theta, &lcs.f);
            let mut y = &lcs.c * &x + &lcs.d * lambda + direct;
            let nearer = towards_set(lcs, active, &y);
            y += &lcs.d * &nearer;
            seen += nearer;
            let pairs = pairs(lcs);
            seeming = seen.select_rows(&pairs).tr_mul(&y.select_rows(&pairs)) * -h;
        }
        // (u⁺ − u)/h has no part of the constant inputs: the difference of the two ends.
        let ends = columns.rows(&no_x, &identity, 1.0, &none);
        let starts = columns.rows(&no_x, &identity, 0.0, &none);
        let du = (ends - starts) / h;
        let over_z = |rows: &Rows| -> DMatrix<f64> {
            let mut table = DMatrix::zeros(terms.len(), width);
            let blocks = [
                (&rows.x, &x),
                (&rows.lambda, &seen),
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
        let mut damping = Vec::new();
        if theta != 0.5 {
            let mut ends = DMatrix::zeros(stock.metric.nrows(), n + columns.varying.len());
            ends.columns_mut(0, n).copy_from(&*stock.x);
            for (k, &j) in columns.varying.iter().enumerate() {
                ends.set_column(n + k, &stock.u.column(j));
            }
            let q = ends.tr_mul(&(stock.metric * &ends)) * (theta - 0.5);
            for i in 0..q.nrows() {
                let fold = |j: usize| {
                    if i == j {
                        q[(i, i)]
                    } else {
                        q[(i, j)] + q[(j, i)]
                    }
                };
                let row = (i..q.nrows()).map(|j| (i, j, fold(j)));
                damping.extend(row.filter(|(.., a)| *a != 0.0));
            }
        }
        Self {
            source: pack(source),
            dissipated: pack(dissipated - &seeming),
            damping,
            seeming: pack(seeming),
        }
    }

    /// (from sources, dissipated) over the step from z, J.
    #[inline]
    pub(crate) fn over_step(&self, z: &[f64]) -> (f64, f64) {
        (form(&self.source, z), form(&self.dissipated, z))
    }

    /// What the scheme itself loses over the step from z to x⁺ (the first n of `out`), J.
    #[inline]
    pub(crate) fn numerical(&self, z: &[f64], out: &[f64], n: usize) -> f64 {
        let p = (z.len() - n) / 2;
        let change = |i: usize| {
            if i < n {
                out[i] - z[i]
            } else {
                z[i] - z[i + p]
            }
        };
        let terms = self.damping.iter();
        let damping: f64 = terms.map(|&(i, j, a)| a * change(i) * change(j)).sum();
        damping + form(&self.seeming, z)
    }
}

/// zᵀQz with Q folded onto its upper triangle, row by row; nothing where Q = 0.
fn pack(q: DMatrix<f64>) -> Vec<f64> {
    let width = q.nrows();
    if q.amax() == 0.0 {
        return Vec::new();
    }
    let mut packed = Vec::with_capacity(width * (width + 1) / 2);
    for i in 0..width {
        packed.push(q[(i, i)]);
        packed.extend((i + 1..width).map(|j| q[(i, j)] + q[(j, i)]));
    }
    packed
}

/// (from sources, dissipated, lost by the scheme), J, of a step with θ and h from (x, u) to (x⁺, u⁺) by solvers that found this
/// active set and λ.
pub(crate) fn of_solved(
    lcs: &Lcs,
    (theta, h): (f64, f64),
    (x, u): (&[f64], &[f64]),
    (x_next, u_next): (&[f64], &[f64]),
    du: &[f64],
    (active, lambda): (&[bool], &[f64]),
) -> (f64, f64, f64) {
    let stock = Stock::of(lcs);
    let vector = DVector::from_column_slice;
    let (x, u, x_next, u_next) = (vector(x), vector(u), vector(x_next), vector(u_next));
    let change = stock.change(&(&x_next - &x), &(&u_next - &u));
    let x = x_next * theta + x * (1.0 - theta);
    let u = u_next * theta + u * (1.0 - theta);
    let mut seen = vector(lambda);
    let mut y = &lcs.c * &x + &lcs.d * &seen + &lcs.g * &u + &lcs.f;
    let rows = DMatrix::from_column_slice(y.len(), 1, y.as_slice());
    let nearer = towards_set(lcs, active, &rows).column(0).into_owned();
    y += &lcs.d * &nearer;
    seen += nearer;
    let at = Point {
        x: x.as_slice(),
        lambda: seen.as_slice(),
        u: u.as_slice(),
        du,
    };
    let (source, dissipated) = power(lcs, at);
    let seeming = -h * pairs(lcs).iter().map(|&j| seen[j] * y[j]).sum::<f64>();
    let damping = (2.0 * theta - 1.0) * stock.of_change(&change);
    (h * source, h * dissipated - seeming, damping + seeming)
}

/// The ports whose yᵀλ is power.
pub(super) fn pairs(lcs: &Lcs) -> Vec<usize> {
    let of_devices = |&j: &usize| lcs.ports[j].role != Role::Function;
    (0..lcs.m()).filter(of_devices).collect()
}

/// The least δ that reduces y_a + (D δ)_a most on an active set among those that are no forces on the state, B δ = 0, for each column of y:
/// what the sources bring then still is what is stored and dissipated.
fn towards_set(lcs: &Lcs, active: &[bool], y: &DMatrix<f64>) -> DMatrix<f64> {
    let mut nearer = DMatrix::zeros(y.nrows(), y.ncols());
    let set: Vec<usize> = (0..active.len()).filter(|&j| active[j]).collect();
    if set.is_empty() {
        return nearer;
    }
    let scaling = Scaling::of(&lcs.d);
    let d = DMatrix::from_diagonal(&scaling.d.select_rows(&set));
    let idle = norm::kernel(&(lcs.b.select_columns(&set) * &d));
    if idle.ncols() == 0 {
        return nearer;
    }
    let through = &d * lcs.d.select_rows(&set).select_columns(&set) * &d * &idle;
    if let Ok(w) = through
        .svd(true, true)
        .solve(&(&d * y.select_rows(&set)), RANK)
    {
        for (row, &j) in (d * idle * w).row_iter().zip(&set) {
            nearer.set_row(j, &-row);
        }
    }
    nearer
}

/// What the stages of a step lose, J: Σ b_j s_jᵀ M ds_j at its stages less what is stored, with ds_j = X h f_j + U Δu.
#[derive(Debug, Default)]
pub(crate) struct StageLoss(f64);

impl StageLoss {
    /// A stage of weight b, with its slope h f.
    pub(crate) fn stage(&mut self, lcs: &Lcs, b: f64, at: Point<'_>, slope: &DVector<f64>, h: f64) {
        let stock = Stock::of(lcs);
        let change = stock.change(slope, &(DVector::from_column_slice(at.du) * h));
        self.0 += b * storage(lcs, at.x, at.u).dot(&(stock.metric * change));
    }

    /// The loss of a step from (x, u) to (x⁺, u⁺).
    pub(crate) fn of_step(
        &self,
        lcs: &Lcs,
        (x, u): (&[f64], &[f64]),
        (x_next, u_next): (&[f64], &[f64]),
    ) -> f64 {
        let (before, after) = (storage(lcs, x, u), storage(lcs, x_next, u_next));
        let middle = (&before + &after) * 0.5;
        self.0 - middle.dot(&(Stock::of(lcs).metric * (after - before)))
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
