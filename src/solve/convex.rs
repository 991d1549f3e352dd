//! The last resort: clarabel on the convex quadratic program of a monotone complementarity problem.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT};
use nalgebra::{DMatrix, DVector};

use super::lcp::Lcp;

/// An approximate λ from min λᵀ(Mλ + q) subject to λ ≥ 0, Mλ + q ≥ 0 (convex for M + Mᵀ ⪰ 0), not yet on a vertex: the
/// caller reads the active set off it and solves on that. `None` where clarabel could not be set up or ended without a point.
#[must_use]
pub fn solve(lcp: &Lcp) -> Option<DVector<f64>> {
    let m = lcp.size();
    let symmetric = &lcp.m + lcp.m.transpose();
    let objective = upper_csc(&symmetric);
    let constraints = DMatrix::from_fn(2 * m, m, |i, j| {
        if i < m {
            if i == j { -1.0 } else { 0.0 }
        } else {
            -lcp.m[(i - m, j)]
        }
    });
    let mut bound = vec![0.0; m];
    bound.extend(lcp.q.iter());
    let settings = DefaultSettings {
        verbose: false,
        ..DefaultSettings::default()
    };
    let cones = [NonnegativeConeT(2 * m)];
    let mut solver = DefaultSolver::new(
        &objective,
        lcp.q.as_slice(),
        &csc(&constraints),
        &bound,
        &cones,
        settings,
    )
    .ok()?;
    solver.solve();
    let lambda = DVector::from_vec(solver.solution.x);
    lambda.iter().all(|v| v.is_finite()).then_some(lambda)
}

fn csc(a: &DMatrix<f64>) -> CscMatrix<f64> {
    filtered(a, |_, _| true)
}

fn upper_csc(a: &DMatrix<f64>) -> CscMatrix<f64> {
    filtered(a, |i, j| i <= j)
}

fn filtered(a: &DMatrix<f64>, keep: impl Fn(usize, usize) -> bool) -> CscMatrix<f64> {
    let (mut start, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
    for j in 0..a.ncols() {
        for i in (0..a.nrows()).filter(|&i| keep(i, j) && a[(i, j)] != 0.0) {
            rows.push(i);
            values.push(a[(i, j)]);
        }
        start.push(rows.len());
    }
    CscMatrix::new(a.nrows(), a.ncols(), start, rows, values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{dmatrix, dvector};

    #[test]
    fn finds_the_neighbourhood_of_the_solution() {
        let lcp = Lcp {
            m: dmatrix![0.0, -1.0; 1.0, 0.0],
            q: dvector![2.0, -3.0],
        };
        let lambda = solve(&lcp).unwrap();
        assert!((lambda - dvector![3.0, 2.0]).norm() < 1e-5);
    }
}
