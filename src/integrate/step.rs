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

mod back;
mod fused;

use nalgebra::{DMatrix, DVector};

use crate::integrate::lawful;
use crate::lcs::Lcs;
use crate::settings::tolerances::events::STEP_GUARD;
use crate::settings::tolerances::steps::SHORT;
use crate::solve::Driver;
use crate::solve::active::equilibrated_inverse;
use crate::solve::lcp::{Lcp, Scaling};
pub(crate) use back::Back;
pub(crate) use fused::FusedMode;

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

    /// Makes z that of a step as long from the end x⁺ of the one from z; sources go on with their slopes.
    pub(crate) fn go_on(&self, x_next: &[f64], z: &mut [f64]) {
        let (x, rest) = z.split_at_mut(self.n);
        x.copy_from_slice(x_next);
        let (next, now) = rest.split_at_mut(self.varying.len());
        for (next, u) in next.iter_mut().zip(now) {
            let change = *next - *u;
            *u = *next;
            *next += change;
        }
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
    back: Vec<(Vec<bool>, Back)>,
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
