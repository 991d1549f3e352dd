//! The linear complementarity problem, its scaling and its residual.

use nalgebra::{DMatrix, DVector};

use crate::linalg::powers::equilibrate;
use crate::linalg::whole::{entrywise, largest, scaled, with_transposed};

/// Find λ with 0 ≤ λ ⟂ y = M λ + q ≥ 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Lcp {
    /// m×m.
    pub m: DMatrix<f64>,
    /// m.
    pub q: DVector<f64>,
}

/// A malformed problem: the call made no sense.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LcpError {
    /// M is not square or q has another length.
    #[error("M is {rows}×{columns} but q has {q} entries")]
    Shape {
        /// Rows of M.
        rows: usize,
        /// Columns of M.
        columns: usize,
        /// Entries of q.
        q: usize,
    },
    /// An entry is infinite or not a number.
    #[error("the problem has an entry that is not a finite number")]
    NotFinite,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
#[must_use]
pub enum Status {
    /// The residual is within the tolerance.
    Solved,
    /// No λ ≥ 0 has Mλ + q ≥ 0: the ray v ≥ 0 has Mᵀv ≤ 0 and qᵀv < 0 (Farkas), in the problem's own units.
    Infeasible(DVector<f64>),
    /// No method reached the tolerance; nothing is known about solutions.
    Failed,
}

/// Which method's result was accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answered {
    /// q ≥ 0 or the active set of the last call.
    Warm,
    /// Block principal pivoting.
    Block,
    /// Lemke.
    Lemke,
    /// clarabel.
    Convex,
    /// Newton's method on the resolvents of curved laws.
    Newton,
    /// Newton's method from where Douglas–Rachford splitting came to.
    Splitting,
    /// None.
    Nobody,
}

/// A result with its certificate.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// What was found.
    pub status: Status,
    /// λ ≥ 0 (best found if not solved).
    pub lambda: DVector<f64>,
    /// Mλ + q, recomputed.
    pub y: DVector<f64>,
    /// Scaled natural residual, see [`Scaling::residual`].
    pub residual: f64,
    /// What the devices do: `true` for λ_j > 0, `false` for y_j > 0, `None` where both vanish to the tolerance.
    pub active: Vec<Option<bool>>,
    /// The index set that gave the solution, the one to start the next problem from.
    pub basis: Vec<bool>,
    /// Who answered.
    pub by: Answered,
}

impl Lcp {
    /// A checked problem.
    ///
    /// # Errors
    /// Shapes that do not fit, entries that are not finite.
    pub fn new(m: DMatrix<f64>, q: DVector<f64>) -> Result<Self, LcpError> {
        if m.nrows() != m.ncols() || m.nrows() != q.len() {
            return Err(LcpError::Shape {
                rows: m.nrows(),
                columns: m.ncols(),
                q: q.len(),
            });
        }
        if m.iter().chain(q.iter()).any(|v| !v.is_finite()) {
            return Err(LcpError::NotFinite);
        }
        Ok(Self { m, q })
    }

    /// y = M λ + q.
    #[must_use]
    pub fn y(&self, lambda: &DVector<f64>) -> DVector<f64> {
        &self.m * lambda + &self.q
    }

    /// The number of pairs m.
    #[must_use]
    pub fn size(&self) -> usize {
        self.q.len()
    }
}

/// Powers of two d that bring the entries of d M d near 1.
///
/// λ = d λ', y = y'/d: complementarity, positive semidefiniteness and every digit are kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Scaling {
    /// m positive powers of two.
    pub d: DVector<f64>,
}

impl Scaling {
    /// Ruiz equilibration in the maximum norm of row and column together, rounded to powers of two.
    #[must_use]
    pub fn of(m: &DMatrix<f64>) -> Self {
        let size = m.nrows();
        let sizes = DMatrix::from_fn(size, size, |i, j| m[(i, j)].abs().max(m[(j, i)].abs()));
        Self {
            d: equilibrate(&sizes),
        }
    }

    /// The problem (d M d, d q) in λ' = λ/d, y' = d y.
    #[must_use]
    pub fn apply(&self, lcp: &Lcp) -> Lcp {
        Lcp {
            m: scaled(&lcp.m, &self.d),
            q: entrywise(&lcp.q, &self.d),
        }
    }

    /// d (M + Mᵀ) d.
    pub(crate) fn symmetric(&self, m: &DMatrix<f64>) -> DMatrix<f64> {
        with_transposed(&scaled(m, &self.d))
    }

    /// λ from λ'.
    #[must_use]
    pub fn unscale(&self, lambda: &DVector<f64>) -> DVector<f64> {
        entrywise(lambda, &self.d)
    }

    /// The natural residual ‖min(λ', y')‖∞ relative to max(‖q'‖∞, ‖λ'‖∞): dimensionless, 0 for an exact solution.
    #[must_use]
    pub fn residual(&self, lcp: &Lcp, lambda: &DVector<f64>, y: &DVector<f64>) -> f64 {
        self.residual_beyond(lcp, lambda, y, |_| 0.0)
    }

    /// The part of the [natural residual](Self::residual) that is not explained by q'_j being uncertain by `noise(j)`.
    ///
    /// This is the single acceptance test of every solution in the crate.
    pub(crate) fn residual_beyond(
        &self,
        lcp: &Lcp,
        lambda: &DVector<f64>,
        y: &DVector<f64>,
        noise: impl Fn(usize) -> f64,
    ) -> f64 {
        let (mut worst, mut scale) = (0.0_f64, 0.0_f64);
        for j in 0..lcp.size() {
            let (l, w) = (lambda[j] / self.d[j], y[j] * self.d[j]);
            // The smaller of a number and none would be the number.
            if l.is_nan() || w.is_nan() {
                return f64::INFINITY;
            }
            worst = worst.max(if l < w { l.abs() } else { w.abs() - noise(j) });
            scale = scale.max(l.abs()).max((lcp.q[j] * self.d[j]).abs());
        }
        // Rounding of the smallest numbers there are is nothing relative.
        if worst <= f64::MIN_POSITIVE {
            0.0
        } else {
            worst / scale
        }
    }

    /// What the devices do, see [`Solution::active`]; quantities below `tolerance` times the largest vanish.
    #[must_use]
    pub fn active(
        &self,
        lambda: &DVector<f64>,
        y: &DVector<f64>,
        tolerance: f64,
    ) -> Vec<Option<bool>> {
        let l = lambda.component_div(&self.d);
        let w = entrywise(y, &self.d);
        let zero = tolerance * largest(l.as_slice()).max(largest(w.as_slice()));
        let state = |l: f64, w: f64| (l.max(w) > zero).then_some(l > w);
        l.iter().zip(w.iter()).map(|(&l, &w)| state(l, w)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{dmatrix, dvector};

    #[test]
    fn equilibration_asks_for_sizes_and_not_for_signs() {
        let m = dmatrix![1.0, -4096.0; 1.0, 1.0];
        assert_eq!(Scaling::of(&m).d, Scaling::of(&m.abs()).d);
        assert_eq!(Scaling::of(&m.transpose()).d, Scaling::of(&m.abs()).d);
    }

    #[test]
    fn equilibration_keeps_every_digit_and_levels_the_entries() {
        let m = dmatrix![1e-12, 3.0; -3.0, 1e9];
        let scaling = Scaling::of(&m);
        let scaled = scaling.apply(&Lcp {
            m: m.clone(),
            q: dvector![1e-9, 1e7],
        });
        assert!(scaling.d.iter().all(|d| d.log2().fract() == 0.0));
        assert!((scaled.m[(0, 1)].abs().log2()).abs() < 2.0, "{}", scaled.m);
        assert_eq!(scaled.m[(0, 1)] / scaling.d[0] / scaling.d[1], m[(0, 1)]);
    }

    #[test]
    fn residual_sees_each_kind_of_violation() {
        let lcp = Lcp::new(dmatrix![2.0, 0.0; 0.0, 1.0], dvector![-2.0, 3.0]).unwrap();
        let scaling = Scaling {
            d: dvector![1.0, 1.0],
        };
        let residual = |l: DVector<f64>| scaling.residual(&lcp, &l, &lcp.y(&l));
        assert_eq!(residual(dvector![1.0, 0.0]), 0.0);
        assert!(residual(dvector![0.0, 0.0]) > 0.1, "y negative");
        assert!(residual(dvector![1.0, -0.5]) > 0.1, "λ negative");
        assert!(residual(dvector![1.0, 0.5]) > 0.1, "both positive");
        assert_eq!(residual(dvector![f64::NAN, 0.0]), f64::INFINITY);
        let y = dvector![f64::NAN, 3.0];
        assert_eq!(
            scaling.residual(&lcp, &dvector![0.0, 0.0], &y),
            f64::INFINITY
        );
    }

    #[test]
    fn malformed_problems_are_errors() {
        assert!(Lcp::new(DMatrix::zeros(2, 3), DVector::zeros(2)).is_err());
        assert!(Lcp::new(DMatrix::zeros(2, 2), DVector::zeros(1)).is_err());
        assert_eq!(
            Lcp::new(dmatrix![f64::NAN], dvector![0.0]),
            Err(LcpError::NotFinite)
        );
    }
}
