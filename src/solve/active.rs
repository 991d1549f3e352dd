//! Solution on a known active set: λ_a from M_aa λ_a = −q_a, λ_ā = 0.

use nalgebra::{DMatrix, DVector};

use super::lcp::Lcp;
use crate::linalg::powers::power_of_two;
use crate::settings::tolerances::ranks::INVERSE;

/// How λ_a depends on q_a for one active set of one matrix M.
#[derive(Debug, Clone)]
pub struct ActiveSolve {
    /// Indices of the active ports.
    pub indices: Vec<usize>,
    /// `inverse`: λ_a = −inverse · q_a; the pseudo-inverse where M_aa is singular.
    pub inverse: DMatrix<f64>,
    /// Whether M_aa has full numerical rank. If not, λ_a is the least-norm choice and M_aa λ_a = −q_a must be checked.
    pub regular: bool,
}

impl ActiveSolve {
    /// Factors M_aa of an *equilibrated* matrix.
    #[must_use]
    pub fn new(m: &DMatrix<f64>, active: &[bool]) -> Self {
        let indices: Vec<usize> = (0..active.len()).filter(|&j| active[j]).collect();
        let maa = m.select_rows(&indices).select_columns(&indices);
        let k = indices.len();
        if k == 0 {
            return Self {
                indices,
                inverse: maa,
                regular: true,
            };
        }
        if let Some(inverse) = refined_inverse(&maa) {
            return Self {
                indices,
                inverse,
                regular: true,
            };
        }
        let inverse = pseudo_inverse(&maa);
        Self {
            indices,
            inverse,
            regular: false,
        }
    }

    /// λ for a right-hand side q.
    #[must_use]
    pub fn lambda(&self, q: &DVector<f64>) -> DVector<f64> {
        let mut lambda = DVector::zeros(q.len());
        let solved = -(&self.inverse * q.select_rows(&self.indices));
        for (&j, &v) in self.indices.iter().zip(solved.iter()) {
            lambda[j] = v;
        }
        lambda
    }

    /// λ with one step of iterative refinement against M.
    #[must_use]
    pub fn refined(&self, lcp: &Lcp) -> DVector<f64> {
        let mut lambda = self.lambda(&lcp.q);
        let correction = self.lambda(&lcp.y(&lambda));
        lambda += correction;
        lambda
    }
}

/// The inverse by LU with one Newton step X ← X (2I − A X), `None` where A is singular to `INVERSE`.
#[must_use]
pub fn refined_inverse(a: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let k = a.nrows();
    let inverse = a.clone().lu().try_inverse()?;
    if !inverse.iter().all(|v| v.is_finite()) || norm1(a) * norm1(&inverse) * INVERSE > 1.0 {
        return None;
    }
    let residual = DMatrix::identity(k, k) * 2.0 - a * &inverse;
    Some(inverse * residual)
}

/// As [`refined_inverse`], after rows and columns were brought near 1 by powers of two: what is singular then is so in any units.
#[must_use]
pub fn equilibrated_inverse(a: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let (mut scaled, n) = (a.clone(), a.nrows());
    let (mut left, mut right) = (DVector::from_element(n, 1.0), DVector::from_element(n, 1.0));
    let factor = |largest: f64| power_of_two(largest.sqrt()).recip();
    for _ in 0..SWEEPS {
        for i in 0..n {
            let by = factor(scaled.row(i).amax());
            scaled.row_mut(i).scale_mut(by);
            left[i] *= by;
            let by = factor(scaled.column(i).amax());
            scaled.column_mut(i).scale_mut(by);
            right[i] *= by;
        }
    }
    let inverse = refined_inverse(&scaled)?;
    Some(DMatrix::from_fn(n, n, |i, j| {
        right[i] * inverse[(i, j)] * left[j]
    }))
}

/// Sweeps of the equilibration; each takes the square root of what is left of the imbalance.
const SWEEPS: usize = 8;

/// The Moore-Penrose inverse with rank decided at `INVERSE`.
#[must_use]
pub fn pseudo_inverse(a: &DMatrix<f64>) -> DMatrix<f64> {
    let svd = a.clone().svd(true, true);
    let largest = svd.singular_values.max();
    // `pseudo_inverse` fails only for a negative threshold.
    svd.pseudo_inverse(largest * INVERSE)
        .unwrap_or_else(|_| DMatrix::zeros(a.ncols(), a.nrows()))
}

fn norm1(a: &DMatrix<f64>) -> f64 {
    a.column_iter()
        .map(|c| c.iter().map(|v| v.abs()).sum())
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{dmatrix, dvector};

    #[test]
    fn singular_set_gives_the_least_norm_current_of_parallel_diodes() {
        let m = dmatrix![1.0, 1.0; 1.0, 1.0];
        let solve = ActiveSolve::new(&m, &[true, true]);
        assert!(!solve.regular);
        let lambda = solve.lambda(&dvector![-2.0, -2.0]);
        assert!((lambda - dvector![1.0, 1.0]).norm() < 1e-14);
    }

    #[test]
    fn regular_set_leaves_inactive_ports_at_zero() {
        let m = dmatrix![0.0, -1.0, 0.0; 1.0, 0.0, 0.0; 0.0, 0.0, 5.0];
        let solve = ActiveSolve::new(&m, &[true, true, false]);
        assert!(solve.regular);
        let lcp = Lcp {
            m,
            q: dvector![3.0, -4.0, 1.0],
        };
        assert_eq!(solve.refined(&lcp), dvector![4.0, 3.0, 0.0]);
    }
}
