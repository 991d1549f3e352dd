//! The matrix K of a step on one active set: the state behind it, and what tests its signs.

use nalgebra::DMatrix;

use super::{Columns, StepMatrices};
use crate::integrate::energy::PowerForms;
use crate::lcs::Lcs;
use crate::settings::tolerances::events::STEP_GUARD;
use crate::settings::tolerances::steps::DIRECT;
use crate::solve::active::ActiveSolve;

/// K for one active set.
#[derive(Debug, Clone)]
pub(crate) struct FusedMode {
    pub(super) active: Vec<bool>,
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

impl StepMatrices {
    /// λ (m×len(z), rows of blocking ports zero) on an active set, with the factorisation it comes from.
    pub(super) fn lambda_rows(&self, active: &[bool]) -> (DMatrix<f64>, ActiveSolve) {
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

    pub(super) fn fuse(&self, lcs: &Lcs, columns: &Columns, active: &[bool]) -> FusedMode {
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
        let mut each = guards.iter().enumerate();
        self.regular && each.all(|(j, &guard)| self.is_strict_at(j, z, guard))
    }

    /// Whether the guard of port j is not zero up to rounding.
    pub(crate) fn is_strict_at(&self, j: usize, z: &[f64], guard: f64) -> bool {
        let size = &self.sizes[j * self.width..][..self.width];
        guard > STEP_GUARD * size.iter().zip(z).map(|(a, b)| a * b.abs()).sum::<f64>()
    }

    /// λ of this mode from the guards of a step.
    pub(crate) fn lambda(&self, guards: &[f64], lambda: &mut [f64]) {
        for ((l, &guard), &on) in lambda.iter_mut().zip(guards).zip(&self.active) {
            *l = if on { guard.max(0.0) } else { 0.0 };
        }
    }
}
