//! The energy balance along a run: source = stored + dissipated + jumps + numerical + residual.
//!
//! Each of the first five is computed on its own, so that the residual tells whether they fit together.
//!
//! Power is Σ (v-row · w)(i-row · w) with w = [x | λ | u | u' | 1]; over a (θ, γ) step all of w is taken at the point k + θ, where
//! x' = (x⁺ − x)/h, with u' as (u⁺ − u)/h. On one active set w is affine in z = [x; u⁺; u; 1], so each sum is one quadratic form in z.
//!
//! What the network takes up there is not what it stores: with s the storage vector, M the metric of its energy and Δ = s⁺ − s it is
//! s_θᵀMΔ, while the energy grows by ½(s⁺ + s)ᵀMΔ. The difference is the numerical loss of the step, (θ − ½) ΔᵀMΔ: nothing for the midpoint
//! rule, the damping of Moreau's scheme for θ = 1. Where γ ≠ θ, λ and y are complementary elsewhere: λ' is nearer to what the ports on the
//! active set would have at k + θ, as far as that is no force on the state, and what ideal pairs seem to take up there, −h λ'ᵀy, is the
//! scheme's loss too.
//!
//! In a jump the impulses move s to where it is closest to s in the metric M, which loses ½ΔᵀMΔ; the sources bring their impulses
//! times their values. A jump to anywhere else leaves a residual.

use nalgebra::{DMatrix, DVector};

use crate::integrate::Energy;
use crate::integrate::reading::{self, Point};
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

/// The storage vector s = X x + U u + k behind a system, and the metric M of its energy ½ sᵀMs: the elements', or the states
/// themselves where the system does not name them.
struct Stock<'a> {
    x: std::borrow::Cow<'a, DMatrix<f64>>,
    u: std::borrow::Cow<'a, DMatrix<f64>>,
    metric: &'a DMatrix<f64>,
}

impl<'a> Stock<'a> {
    fn of(lcs: &'a Lcs) -> Self {
        use std::borrow::Cow;
        let storage = &lcs.storage;
        if storage.metric.is_empty() {
            let n = lcs.energy.nrows();
            return Self {
                x: Cow::Owned(DMatrix::identity(n, n)),
                u: Cow::Owned(DMatrix::zeros(n, lcs.p())),
                metric: &lcs.energy,
            };
        }
        let u = if storage.u.ncols() == lcs.p() {
            Cow::Borrowed(&storage.u)
        } else {
            Cow::Owned(DMatrix::zeros(storage.metric.nrows(), lcs.p()))
        };
        Self {
            x: Cow::Borrowed(&storage.x),
            u,
            metric: &storage.metric,
        }
    }

    /// X Δx + U Δu.
    fn change(&self, dx: &DVector<f64>, du: &DVector<f64>) -> DVector<f64> {
        &*self.x * dx + &*self.u * du
    }

    /// ½ ΔᵀMΔ.
    fn of_change(&self, change: &DVector<f64>) -> f64 {
        0.5 * change.dot(&(self.metric * change))
    }
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
fn pairs(lcs: &Lcs) -> Vec<usize> {
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

/// The storage vector s of a state under inputs u.
fn storage(lcs: &Lcs, x: &[f64], u: &[f64]) -> DVector<f64> {
    let stock = Stock::of(lcs);
    let vector = DVector::from_column_slice;
    let mut s = stock.change(&vector(x), &vector(u));
    if lcs.storage.one.len() == s.len() {
        s += &lcs.storage.one;
    }
    s
}

/// Energy lost in a jump from x to `after` under inputs u by port impulses p, J: where the network is `passive` the jump is a projection,
/// which loses ½ΔᵀMΔ; else its devices lose ½pᵀ(y⁺ − y), as pᵀy⁺ = 0. Forward drops take up their part of the impulse besides.
pub(crate) fn loss_of_jump(
    lcs: &Lcs,
    x: &DVector<f64>,
    after: &DVector<f64>,
    u: &DVector<f64>,
    p: &DVector<f64>,
    passive: bool,
) -> f64 {
    let step = after - x;
    let pairs = pairs(lcs);
    let moved = if passive {
        let stock = Stock::of(lcs);
        stock.of_change(&(&*stock.x * &step))
    } else {
        let change = &lcs.c * &step;
        0.5 * pairs.iter().map(|&j| p[j] * change[j]).sum::<f64>()
    };
    if lcs.outputs.power.is_empty() || p.is_empty() || p.amax() == 0.0 {
        return moved;
    }
    // −(v − v_drop)·i of an ideal pair is its part of pᵀy⁺, which is nothing; a curved law takes up what it does at its bound.
    let still = vec![0.0; lcs.p()];
    let no_lambda = vec![0.0; lcs.m()];
    let at = Point {
        x: after.as_slice(),
        lambda: &no_lambda,
        u: u.as_slice(),
        du: &still,
    };
    let taken = work_of_impulse(lcs, PowerKind::Dissipated, at, p.as_slice(), &still);
    let y = &lcs.c * after + &lcs.g * u + &lcs.f;
    let ideal = |&&j: &&usize| lcs.ports[j].law.is_ideal_diode();
    let seeming = pairs.iter().filter(ideal).map(|&j| p[j] * y[j]);
    moved + taken + seeming.sum::<f64>()
}

/// Work into the elements of a kind by port impulses p and steps of the inputs, J: the impulse of one factor times the value of the other.
fn work_of_impulse(lcs: &Lcs, kind: PowerKind, at: Point<'_>, p: &[f64], step: &[f64]) -> f64 {
    let (v, current) = (&lcs.outputs.power_v, &lcs.outputs.power_i);
    let terms = lcs.outputs.power.iter().enumerate();
    let work = terms.filter(|(_, term)| term.kind == kind).map(|(i, _)| {
        reading::value(v, i, at) * reading::impulse(current, i, p, step)
            + reading::value(current, i, at) * reading::impulse(v, i, p, step)
    });
    work.sum()
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
    let works = parts.iter().map(|(x, u, p, step)| {
        let at = Point {
            x,
            lambda: zero_lambda,
            u,
            du: &no_step,
        };
        -work_of_impulse(lcs, PowerKind::Source, at, p, step)
    });
    works.sum()
}

/// (from sources, lost), J, where storage elements s become s⁺ = X x + U u + k because a switch joins them to one another or to sources:
/// the impulses in the loops (cut-sets) move s⁺ to where it is closest to s in the metric M of stored energy, so that ½ ΔᵀM Δ is lost,
/// Δ = s⁺ − s. The charges MΔ pass the sources, whose voltages are U u + k in the loops; charge and flux are conserved, XᵀMΔ = 0.
pub(crate) fn taking_over(
    lcs: &Lcs,
    s: &[f64],
    x: &DVector<f64>,
    after: &DVector<f64>,
) -> (f64, f64) {
    let storage = &lcs.storage;
    let step = after - DVector::from_column_slice(s);
    let charge = &storage.metric * &step;
    let brought = (after - &storage.x * x).dot(&charge);
    (brought, 0.5 * step.dot(&charge))
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
    jumps: f64,
    numerical: f64,
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

    /// Adds a jump in which sources brought and which lost so much energy, J.
    pub fn add_jump(&mut self, (source, loss): (f64, f64)) {
        self.source += source;
        self.jumps += loss;
    }

    /// Takes back all but a part of the jumps since `before`, whose storage changed by Δ in all with `square` = ½ΔᵀMΔ: sources deliver
    /// in proportion, and where the whole loses L, a part a loses a(L + square) − a² square.
    pub(crate) fn take_part(&mut self, before: &Self, part: f64, square: f64) {
        let (source, loss) = (self.source - before.source, self.jumps - before.jumps);
        *self = *before;
        self.add_jump((part * source, part * (loss + square) - part * part * square));
    }

    /// Energy lost in jumps so far, J.
    pub(crate) fn lost_in_jumps(&self) -> f64 {
        self.jumps
    }

    /// Adds what a scheme lost by itself, J.
    #[inline]
    pub fn add_numerical(&mut self, loss: f64) {
        self.numerical += loss;
    }

    /// So much of what a scheme lost was a jump's, J.
    pub(crate) fn reattribute_to_jump(&mut self, loss: f64) {
        self.numerical -= loss;
        self.jumps += loss;
    }

    /// Adds the flows of a part of the run that was balanced elsewhere.
    pub fn add_part(&mut self, part: &Energy) {
        self.source += part.source;
        self.dissipated += part.dissipated;
        self.jumps += part.jumps;
        self.numerical += part.numerical;
    }

    /// Notes the stored energy now, J.
    pub fn note(&mut self, stored: f64) {
        self.last = stored;
        self.largest = self
            .largest
            .max(stored.abs())
            .max(self.source.abs())
            .max(self.dissipated.abs())
            .max(self.jumps.abs());
    }

    /// The result.
    #[must_use]
    pub fn energy(&self) -> Energy {
        let stored = self.last - self.first;
        let residual = self.source - self.dissipated - self.jumps - self.numerical - stored;
        let residual_relative = if self.largest > 0.0 {
            residual.abs() / self.largest
        } else {
            0.0
        };
        Energy {
            source: self.source,
            dissipated: self.dissipated,
            stored,
            jumps: self.jumps,
            numerical: self.numerical,
            residual,
            residual_relative,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::fixtures;
    use crate::integrate::jump::JumpProblem;
    use crate::lcs::Rows;
    use nalgebra::{dmatrix, dvector};

    /// What a jump of the bridge with a capacitor filter, 1 µF at 10 V onto 0.3 µF at 0 V, leaves unexplained when its state and
    /// impulse are multiplied by `part`, relative to the energy before it.
    fn residual_of_jump(part: f64) -> f64 {
        // Of its elements it names the resistor's power alone.
        let lcs = fixtures::bridge_cap_filter().changed(|parts| {
            parts.outputs.power.clear();
            (parts.outputs.power_v, parts.outputs.power_i) = (Rows::default(), Rows::default());
        });
        let lcs = lcs.unwrap();
        let (x, u) = (dvector![10.0, 0.0, 0.0], DVector::zeros(0));
        let mut problem = JumpProblem::new(&lcs, 1e-9).unwrap();
        let jump = problem.solve(&lcs, &x, &u).unwrap().unwrap();
        let (after, p) = (&x + (jump.x - &x) * part, jump.p * part);
        let mut balance = Balance::new(stored(&lcs, x.as_slice(), &[]));
        let source =
            source_work_of_jump(&lcs, x.as_slice(), after.as_slice(), &[], &[], p.as_slice());
        let loss = loss_of_jump(&lcs, &x, &after, &u, &p, true);
        balance.add_jump((source, loss));
        balance.note(stored(&lcs, after.as_slice(), &[]));
        balance.energy().residual_relative
    }

    #[test]
    fn a_jump_that_does_not_end_where_it_must_leaves_a_residual() {
        assert!(residual_of_jump(1.0) < 1e-15);
        // With a part a of the charge the energy falls by (2a − a²) of the loss, of which a² is the jump's: 2a(1 − a) of 3/13 is left.
        for part in [0.9, 0.5, 1.2] {
            let left: f64 = 2.0 * part * (1.0 - part) * 3.0 / 13.0;
            let found = residual_of_jump(part);
            assert!((found - left.abs()).abs() < 1e-14, "{part}: {found}");
        }
    }

    /// Two capacitors, 1 µF at 10 V and 3 µF at 0 V, joined beside a source of 5 V through whose loop no charge passes: at 2.5 V, or
    /// anywhere else, where charge is not conserved.
    #[test]
    fn storage_taken_over_wrongly_leaves_a_residual() {
        let lcs = fixtures::clamped_capacitor().changed(|parts| {
            let storage = &mut parts.storage;
            storage.names = vec!["v(c1)".into(), "v(c2)".into()];
            storage.metric = DMatrix::from_diagonal(&dvector![1e-6, 3e-6]);
            storage.x = DMatrix::from_element(2, 1, 1.0);
            storage.lambda = DMatrix::zeros(2, 1);
            storage.u = DMatrix::zeros(2, 0);
            storage.inject = dmatrix![0.25, 0.75];
            (storage.one, storage.initial) = (DVector::zeros(2), DVector::zeros(2));
        });
        let lcs = lcs.unwrap();
        let residual = |v: f64| {
            let mut balance = Balance::new(50e-6);
            balance.add_jump(taking_over(
                &lcs,
                &[10.0, 0.0],
                &dvector![v],
                &dvector![v, v],
            ));
            balance.note(2e-6 * v * v);
            balance.energy().residual
        };
        assert!(residual(2.5).abs() < 1e-19);
        // v times the charge that came from nowhere.
        assert!(
            (residual(3.0) + 3.0 * 2e-6).abs() < 1e-18,
            "{}",
            residual(3.0)
        );
    }

    #[test]
    fn every_part_of_the_balance_stands_beside_the_others() {
        let mut balance = Balance::new(3.0);
        balance.add((10.0, 2.0));
        balance.add_jump((1.0, 0.5));
        balance.add_numerical(0.25);
        balance.note(8.0);
        let energy = balance.energy();
        assert_eq!((energy.source, energy.dissipated), (11.0, 2.0));
        assert_eq!((energy.jumps, energy.numerical), (0.5, 0.25));
        assert_eq!((energy.stored, energy.residual), (5.0, 3.25));
        assert_eq!(energy.residual_relative, 3.25 / 11.0);
    }
}
