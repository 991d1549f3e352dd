//! One (θ, γ) step as one matrix–vector product.
//!
//! ```text
//! x⁺ = x + h A (θx⁺ + (1−θ)x) + h B λ + h E (θu⁺ + (1−θ)u) + h e
//! y  = C (γx⁺ + (1−γ)x) + D λ + G (γu⁺ + (1−γ)u) + F,      0 ≤ λ ⟂ y ≥ 0
//! ```
//!
//! with u the right limit at the start of the step and u⁺ the left limit at its end: for θ = γ = 1 Moreau's scheme, for
//! θ = ½, γ = 1 Siconos', for θ = γ = ½ the midpoint rule, which keeps the energy balance exactly (S. Greenhalgh, V. Acary,
//! B. Brogliato, "On preserving dissipativity properties of linear complementarity dynamical systems with the θ-method",
//! Numerische Mathematik 125, 2013). With W = I − hθA the one-step problem is LCP(M, q), M = D + hγ C W⁻¹ B.
//!
//! For one active set everything is affine in z = [x; u⁺; u; 1] (only inputs that vary have columns), so the step and its
//! sign test are [x⁺; λ_a; y_ā] = K z with a matrix K that is computed once.

use nalgebra::{DMatrix, DVector};

use crate::integrate::energy::PowerForms;
use crate::integrate::lawful;
use crate::lcs::Lcs;
use crate::settings::tolerances::events::STEP_GUARD;
use crate::settings::tolerances::steps::{DIRECT, SHORT};
use crate::solve::Driver;
use crate::solve::active::{ActiveSolve, equilibrated_inverse};
use crate::solve::lcp::{Lcp, Scaling};

/// θ for the state, γ for λ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scheme {
    /// Implicitness of the state, ½ … 1.
    pub theta: f64,
    /// Implicitness of the complementarity, ½ … 1.
    pub gamma: f64,
}

impl Scheme {
    /// Implicit Euler in both, Moreau's time-stepping.
    pub const MOREAU: Self = Self {
        theta: 1.0,
        gamma: 1.0,
    };
    /// The midpoint rule.
    pub const MIDPOINT: Self = Self {
        theta: 0.5,
        gamma: 0.5,
    };

    /// The same θ with γ = 1, for steps in which the active set changes or the state may jump. Where γ > θ a stiff part
    /// (h‖A‖ > 2) can cost M = D + hCW⁻¹B its monotonicity; such a step takes [`Self::MOREAU`].
    #[must_use]
    pub const fn implicit_in_lambda(self) -> Self {
        Self {
            theta: self.theta,
            gamma: 1.0,
        }
    }

    /// Order of the global error between events.
    #[must_use]
    pub fn order(self) -> i32 {
        if self.theta == 0.5 && self.gamma == 0.5 {
            2
        } else {
            1
        }
    }
}

/// Columns of z.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Columns {
    /// Number of states.
    pub n: usize,
    /// Inputs that vary, as indices into u.
    pub varying: Vec<usize>,
    /// Values of all inputs at the start; those of the constant ones never change.
    pub constant: Vec<f64>,
}

impl Columns {
    /// Length of z.
    pub(crate) fn len(&self) -> usize {
        self.n + 2 * self.varying.len() + 1
    }

    /// z from its parts.
    pub(crate) fn fill(&self, x: &[f64], u_next: &[f64], u: &[f64], z: &mut [f64]) {
        let p = self.varying.len();
        z[..self.n].copy_from_slice(x);
        for (k, &j) in self.varying.iter().enumerate() {
            z[self.n + k] = u_next[j];
            z[self.n + p + k] = u[j];
        }
        z[self.n + 2 * p] = 1.0;
    }

    /// z of a step [`SHORT`] times as long from the end of a step, as rows over z at the start of that one, where x⁺ = `x_next` z. The
    /// sources go on with their slopes: a λ that keeps a constraint on the state is made of these.
    fn end_rows(&self, x_next: &DMatrix<f64>) -> DMatrix<f64> {
        let p = self.varying.len();
        let mut rows = DMatrix::zeros(self.len(), self.len());
        rows.rows_mut(0, self.n).copy_from(x_next);
        for k in self.n..self.n + p {
            rows[(k, k)] = 1.0 + SHORT;
            rows[(k, k + p)] = -SHORT;
            rows[(k + p, k)] = 1.0;
        }
        rows[(self.len() - 1, self.len() - 1)] = 1.0;
        rows
    }

    /// `x_part·x + u_part·(weight·u⁺ + (1 − weight)·u) + one` as rows over z.
    pub(crate) fn rows(
        &self,
        x_part: &DMatrix<f64>,
        u_part: &DMatrix<f64>,
        weight: f64,
        one: &DVector<f64>,
    ) -> DMatrix<f64> {
        let p = self.varying.len();
        let mut rows = DMatrix::zeros(one.len(), self.len());
        rows.columns_mut(0, self.n).copy_from(x_part);
        let mut last = one.clone();
        for j in 0..u_part.ncols() {
            if let Some(k) = self.varying.iter().position(|&v| v == j) {
                rows.set_column(self.n + k, &(u_part.column(j) * weight));
                rows.set_column(self.n + p + k, &(u_part.column(j) * (1.0 - weight)));
            } else {
                last += u_part.column(j) * self.constant[j];
            }
        }
        rows.set_column(self.n + 2 * p, &last);
        rows
    }
}

/// Everything about one step length and scheme of one system.
#[derive(Debug, Clone)]
pub(crate) struct StepMatrices {
    /// Step, s.
    pub h: f64,
    /// θ and γ.
    pub scheme: Scheme,
    /// For eviction: when this was used last.
    pub used: u64,
    /// n×len(z): x⁺ for λ = 0.
    phi: DMatrix<f64>,
    /// n×m: h W⁻¹ B.
    response: DMatrix<f64>,
    /// m×len(z): q.
    q: DMatrix<f64>,
    /// M equilibrated, and its scaling.
    scaled: DMatrix<f64>,
    scaling: Scaling,
    m: DMatrix<f64>,
    /// For γ < 1: the short implicit step that tests the end.
    after: Option<Box<StepMatrices>>,
    /// The solvers for M.
    pub driver: Driver,
    modes: Vec<FusedMode>,
    /// See [`Self::back`], by active set.
    back: Vec<(Vec<bool>, DMatrix<f64>)>,
}

/// K for one active set.
#[derive(Debug, Clone)]
pub(crate) struct FusedMode {
    active: Vec<bool>,
    /// Row-major; n rows x⁺, m rows of guards, then rows that must vanish (only where M_aa is singular).
    k: Vec<f64>,
    /// For every guard the sum of the magnitudes it was computed from, as a row over |z|.
    sizes: Vec<f64>,
    width: usize,
    /// Whether M_aa is regular; if not λ_a is the least-norm choice.
    pub regular: bool,
    /// Power as quadratic forms of z.
    pub power: PowerForms,
}

/// Fused modes kept per step length.
const KEPT_MODES: usize = 256;

impl StepMatrices {
    /// Factors one step; `None` where W is singular.
    pub(crate) fn new(
        lcs: &Lcs,
        columns: &Columns,
        h: f64,
        scheme: Scheme,
        tolerance: f64,
    ) -> Option<Self> {
        let n = lcs.n();
        let Scheme { theta, gamma } = scheme;
        let identity = DMatrix::identity(n, n);
        let w_inverse = if n == 0 {
            identity.clone()
        } else {
            equilibrated_inverse(&(&identity - &lcs.a * (h * theta)))?
        };
        let explicit = &identity + &lcs.a * (h * (1.0 - theta));
        let phi = &w_inverse * columns.rows(&explicit, &(&lcs.e * h), theta, &(&lcs.e0 * h));
        let response = &w_inverse * &lcs.b * h;
        let direct = columns.rows(&(&lcs.c * (1.0 - gamma)), &lcs.g, gamma, &lcs.f);
        let q = &lcs.c * gamma * &phi + direct;
        let m = &lcs.d + &lcs.c * gamma * &response;
        if !(m
            .iter()
            .chain(q.iter())
            .chain(phi.iter())
            .all(|v| v.is_finite()))
        {
            return None;
        }
        let scaling = Scaling::of(&m);
        let scaled = scaling
            .apply(&Lcp {
                m: m.clone(),
                q: DVector::zeros(m.nrows()),
            })
            .m;
        let driver = lawful::driver(lcs, m.clone(), tolerance);
        let after = if gamma < 1.0 {
            let short = Self::new(lcs, columns, h * SHORT, Scheme::MOREAU, tolerance)?;
            Some(Box::new(short))
        } else {
            None
        };
        Some(Self {
            h,
            scheme,
            used: 0,
            phi,
            response,
            q,
            scaled,
            scaling,
            m,
            after,
            driver,
            modes: Vec::new(),
            back: Vec::new(),
        })
    }

    /// What a λ of this implicit step lacks to be that at its start, as rows over z: where λ follows from x and u at every instant,
    /// D_aa λ + C x + G u + F = 0, the step has moved these by h(C x' + G u'), and a small resistance makes much of it. Where λ is what keeps
    /// a constraint, it is that of a step. With M = D + E, E = h C W B, the former lacks D⁻¹ h(C x' + G u') = (I − K)⁻¹ M⁻¹ h(C x' + G u')
    /// with K = M⁻¹ E, and of the latter K = I. The sum I + K + … + K⁷ = (I + K)(I + K²)(I + K⁴) times I − K⁸ is right for both, up to
    /// 2 K⁸ where K is small.
    pub(crate) fn back(&mut self, lcs: &Lcs, columns: &Columns, active: &[bool]) -> &DMatrix<f64> {
        let at = self.back.iter().position(|(known, _)| known == active);
        let at = at.unwrap_or_else(|| {
            if self.back.len() == KEPT_MODES {
                self.back.clear();
            }
            let rows = self.back_rows(lcs, columns, active);
            self.back.push((active.to_vec(), rows));
            self.back.len() - 1
        });
        &self.back[at].1
    }

    fn back_rows(&self, lcs: &Lcs, columns: &Columns, active: &[bool]) -> DMatrix<f64> {
        let (lambda, solve) = self.lambda_rows(active);
        let mut rows = DMatrix::zeros(self.m.nrows(), self.q.ncols());
        if !solve.regular {
            return rows;
        }
        let scale = DVector::from_iterator(
            solve.indices.len(),
            solve.indices.iter().map(|&j| self.scaling.d[j]),
        );
        let scale = DMatrix::from_diagonal(&scale);
        let inverse = &scale * &solve.inverse * &scale;
        let before = columns.rows(&lcs.c, &lcs.g, 0.0, &lcs.f);
        let moved = &self.q - before + (&self.m - &lcs.d) * lambda;
        let moved = moved.select_rows(&solve.indices);
        let direct = lcs
            .d
            .select_rows(&solve.indices)
            .select_columns(&solve.indices);
        let first = &inverse * direct;
        let one = DMatrix::identity(solve.indices.len(), solve.indices.len());
        let k = &one - &first;
        let squared = &k * &k;
        let fourth = &squared * &squared;
        let eighth = &fourth * &fourth;
        // A network that is not passive may have a K that grows.
        let back = if eighth.amax() <= 1.0 {
            (&one - eighth) * (&one + k) * (&one + squared) * (&one + fourth)
        } else {
            first
        };
        let back = back * (&inverse * moved);
        for (row, &j) in back.row_iter().zip(&solve.indices) {
            rows.set_row(j, &row);
        }
        rows
    }

    /// The index of the fused mode of an active set, computed at its first use; and whether it was computed now.
    pub(crate) fn mode(&mut self, lcs: &Lcs, columns: &Columns, active: &[bool]) -> (usize, bool) {
        if let Some(at) = self.modes.iter().position(|mode| mode.active == active) {
            return (at, false);
        }
        if self.modes.len() == KEPT_MODES {
            self.modes.clear();
        }
        self.modes.push(self.fuse(lcs, columns, active));
        (self.modes.len() - 1, true)
    }

    /// A fused mode by index.
    pub(crate) fn fused(&self, index: usize) -> &FusedMode {
        &self.modes[index]
    }

    /// λ (m×len(z), rows of blocking ports zero) on an active set, with the factorisation it comes from.
    fn lambda_rows(&self, active: &[bool]) -> (DMatrix<f64>, ActiveSolve) {
        let solve = ActiveSolve::new(&self.scaled, active);
        let d = &self.scaling.d;
        let mut lambda = DMatrix::zeros(self.m.nrows(), self.q.ncols());
        // One solve, and where M_aa is regular one step of refinement through the same inverse.
        for _ in 0..if solve.regular { 2 } else { 1 } {
            let mut residual = (&self.m * &lambda + &self.q).select_rows(&solve.indices);
            for (mut row, &j) in residual.row_iter_mut().zip(&solve.indices) {
                row *= d[j];
            }
            for (row, &j) in (&solve.inverse * residual).row_iter().zip(&solve.indices) {
                let better = lambda.row(j) - row * d[j];
                lambda.set_row(j, &better);
            }
        }
        (lambda, solve)
    }

    /// |M_aa⁻¹| |q_a|, the magnitudes λ_a is computed from.
    fn lambda_sizes(&self, solve: &ActiveSolve) -> DMatrix<f64> {
        let d = &self.scaling.d;
        let mut q = self.q.select_rows(&solve.indices).abs();
        for (mut row, &j) in q.row_iter_mut().zip(&solve.indices) {
            row *= d[j];
        }
        let mut sizes = DMatrix::zeros(self.m.nrows(), self.q.ncols());
        for (row, &j) in (solve.inverse.abs() * q).row_iter().zip(&solve.indices) {
            sizes.set_row(j, &(row * d[j]));
        }
        sizes
    }

    fn fuse(&self, lcs: &Lcs, columns: &Columns, active: &[bool]) -> FusedMode {
        let (n, m, width) = (lcs.n(), lcs.m(), columns.len());
        let (lambda, solve) = self.lambda_rows(active);
        let x_next = &self.phi + &self.response * &lambda;
        let y = &self.m * &lambda + &self.q;
        // Blocking ports are tested at the end of the step, conducting ones by their λ. For γ < 1 that is not where y and λ
        // belong: there both are those of a very short implicit step from the end, but for a λ that makes a derivative, which
        // would be made of its rounding. y is that of the λ that are tested.
        let y_size = self.m.abs() * lambda.abs() + self.q.abs();
        let mut guards = (lambda.clone(), self.lambda_sizes(&solve));
        let (y_end, y_end_size) = match &self.after {
            None => (y.clone(), y_size.clone()),
            Some(after) => {
                let (short, solve) = after.lambda_rows(active);
                let end = columns.end_rows(&x_next);
                let short = short * &end;
                let short_size = after.lambda_sizes(&solve) * end.abs();
                for &j in &solve.indices {
                    if short_size.row(j).amax() <= DIRECT * guards.1.row(j).amax() {
                        guards.0.set_row(j, &short.row(j));
                        guards.1.set_row(j, &short_size.row(j));
                    }
                }
                let through_state = &after.m - &lcs.d;
                let size = through_state.abs() * short.abs()
                    + lcs.d.abs() * &guards.1
                    + after.q.abs() * end.abs();
                (
                    through_state * short + &lcs.d * &guards.0 + &after.q * end,
                    size,
                )
            }
        };
        let extra = if solve.regular {
            0
        } else {
            solve.indices.len()
        };
        let mut k = Vec::with_capacity((n + m + extra) * width);
        let mut sizes = Vec::with_capacity((m + extra) * width);
        (0..n).for_each(|i| k.extend(x_next.row(i).iter()));
        for (j, &conducts) in active.iter().enumerate().take(m) {
            let (guard, size) = if conducts {
                (&guards.0, &guards.1)
            } else {
                (&y_end, &y_end_size)
            };
            k.extend(guard.row(j).iter());
            sizes.extend(size.row(j).iter());
        }
        for &j in solve.indices.iter().take(extra) {
            k.extend(y.row(j).iter());
            sizes.extend(y_size.row(j).iter());
        }
        let power = PowerForms::new(lcs, columns, self.h, self.scheme, active, &x_next, &lambda);
        FusedMode {
            active: active.to_vec(),
            k,
            sizes,
            width,
            regular: solve.regular,
            power,
        }
    }

    /// q for the solvers.
    pub(crate) fn q(&self, z: &[f64]) -> DVector<f64> {
        &self.q * DVector::from_column_slice(z)
    }

    /// Has the solvers know what rounding leaves uncertain in q(z), where `noise(k)` is what state k may be off.
    pub(crate) fn blur(&mut self, lcs: &Lcs, z: &[f64], noise: impl Fn(usize) -> f64) {
        // In units of STEP_GUARD, so that one product does for both.
        let z = DVector::from_iterator(
            z.len(),
            z.iter().enumerate().map(|(k, v)| {
                v.abs()
                    + if k < lcs.n() {
                        noise(k) / STEP_GUARD
                    } else {
                        0.0
                    }
            }),
        );
        // q is what is left of C x⁺ and the rest.
        let size = self.q.abs() * &z + lcs.c.abs() * (self.phi.abs() * &z);
        self.driver.blur(&(size * STEP_GUARD));
    }

    /// The sums of the magnitudes that x⁺ is computed from.
    pub(crate) fn x_sizes(&self, z: &[f64], lambda: &DVector<f64>) -> DVector<f64> {
        self.phi.abs() * DVector::from_column_slice(z).abs() + self.response.abs() * lambda.abs()
    }

    /// What a small change of x has become at the end of a step to (λ, y) on curved laws.
    pub(crate) fn carried(
        &self,
        change: &DVector<f64>,
        lambda: &DVector<f64>,
        y: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let n = change.len();
        let dq = self.q.columns(0, n) * change;
        let response = self.driver.response(lambda, y, &dq)?;
        Some(self.phi.columns(0, n) * change + &self.response * response)
    }

    /// x⁺ for a given λ.
    pub(crate) fn x_next(&self, z: &[f64], lambda: &DVector<f64>) -> DVector<f64> {
        &self.phi * DVector::from_column_slice(z) + &self.response * lambda
    }
}

impl FusedMode {
    /// `out` = [x⁺; guards]; whether every guard is ≥ 0 up to rounding, where `noise(k)` is what state k may be off.
    #[inline]
    pub(crate) fn step(
        &self,
        z: &[f64],
        n: usize,
        out: &mut [f64],
        noise: impl Fn(usize) -> f64,
    ) -> bool {
        debug_assert_eq!(z.len(), self.width);
        let mut rows = self.k.chunks_exact(self.width);
        for (value, row) in out.iter_mut().zip(&mut rows) {
            *value = row.iter().zip(z).map(|(a, b)| a * b).sum();
        }
        if out[n..].iter().all(|&guard| guard >= 0.0) && self.regular {
            return true;
        }
        self.holds_to_rounding(z, n, out, noise)
    }

    #[cold]
    fn holds_to_rounding(
        &self,
        z: &[f64],
        n: usize,
        out: &[f64],
        noise: impl Fn(usize) -> f64,
    ) -> bool {
        let rows = self.k.chunks_exact(self.width).enumerate().skip(n);
        for ((i, row), size) in rows.zip(self.sizes.chunks_exact(self.width)) {
            let rounding = size.iter().zip(z).map(|(a, b)| a * b.abs()).sum::<f64>();
            let inherited = (0..n).map(|k| size[k] * noise(k)).sum::<f64>();
            let negative = match out.get(i) {
                Some(guard) => -guard,
                None => row.iter().zip(z).map(|(a, b)| a * b).sum::<f64>().abs(),
            };
            if negative > STEP_GUARD * rounding + inherited || negative.is_nan() {
                return false;
            }
        }
        true
    }

    /// Whether λ of this mode is the only one, by strict complementarity: it is regular and no guard is zero up to rounding.
    pub(crate) fn is_strict(&self, z: &[f64], guards: &[f64]) -> bool {
        let sizes = self.sizes.chunks_exact(self.width);
        self.regular
            && guards.iter().zip(sizes).all(|(&guard, size)| {
                guard > STEP_GUARD * size.iter().zip(z).map(|(a, b)| a * b.abs()).sum::<f64>()
            })
    }

    /// λ of this mode from the guards of a step.
    pub(crate) fn lambda(&self, guards: &[f64], lambda: &mut [f64]) {
        for ((l, &guard), &on) in lambda.iter_mut().zip(guards).zip(&self.active) {
            *l = if on { guard.max(0.0) } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::fixtures;
    use crate::lcs::Role;
    use nalgebra::dmatrix;

    /// Two diodes share the current of a capacitor through one resistor: how is not known, nor what each of them had at the start of a step.
    #[test]
    fn currents_that_only_their_sum_determines_are_not_taken_back() {
        let lcs = fixtures::system(
            &[("v(c1)", "V")],
            &[("d1", Role::Current), ("d2", Role::Current)],
            [
                dmatrix![0.0],
                dmatrix![-1.0, -1.0],
                dmatrix![-1.0; -1.0],
                dmatrix![1.0, 1.0; 1.0, 1.0],
            ],
            &[1.0],
        );
        let columns = Columns {
            n: 1,
            varying: vec![],
            constant: vec![],
        };
        let mut step = StepMatrices::new(&lcs, &columns, 0.5, Scheme::MOREAU, 1e-9).unwrap();
        // Alone i = v: behind a step of h it is v/(1 + h), and lacks v K with K = h/(1 + h), but for 2 K⁸ of it.
        let alone = step.back(&lcs, &columns, &[true, false])[(0, 0)];
        let k: f64 = 0.5 / 1.5;
        let found = k * (1.0 - k.powi(8)).powi(2);
        assert!((alone - found).abs() < 1e-15, "{alone}");
        assert_eq!(step.back(&lcs, &columns, &[true, true]).amax(), 0.0);
    }
}
