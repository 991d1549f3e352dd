//! The margin problem of [`barrier`](super::barrier) through clarabel's semidefinite cone: a second opinion.
//!
//! ```text
//! maximise t   subject to   F(z) − tI ⪰ 0,   P(z) − tI ⪰ 0,   t ≤ 1,   |zₖ| ≤ ρ
//! ```
//!
//! Needs feature `sdp`, which links the LAPACK of the system.

// Linked for clarabel.
extern crate netlib_src as _;

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT,
    PSDTriangleConeT, SolverStatus, SupportedConeT,
};
use nalgebra::{DMatrix, DVector};

use super::barrier::Outcome;
use super::facial::Face;
use super::{Certificate, System, lmi};
use crate::settings::tolerances::passivity::RADIUS;
use crate::settings::tolerances::passivity::SIGN;
use crate::settings::tolerances::theorems::INTERIOR_POINT;

/// Solves (45) like [`lmi::solve`], with clarabel in place of the barrier.
///
/// # Errors
/// As [`lmi::solve`].
pub fn solve(system: &System) -> Result<Certificate, lmi::Unsolved> {
    lmi::solve_with(system, maximise)
}

/// vec of the upper triangle by columns, off-diagonals times √2: clarabel's order.
fn triangle(m: &DMatrix<f64>) -> Vec<f64> {
    (0..m.ncols())
        .flat_map(|j| (0..=j).map(move |i| (i, j)))
        .map(|(i, j)| {
            if i == j {
                m[(i, j)]
            } else {
                m[(i, j)] * std::f64::consts::SQRT_2
            }
        })
        .collect()
}

/// The symmetric matrix of [`triangle`].
fn square(v: &[f64], order: usize) -> DMatrix<f64> {
    let mut m = DMatrix::zeros(order, order);
    let mut k = 0;
    for j in 0..order {
        for i in 0..=j {
            let value = if i == j {
                v[k]
            } else {
                v[k] / std::f64::consts::SQRT_2
            };
            (m[(i, j)], m[(j, i)]) = (value, value);
            k += 1;
        }
    }
    m
}

/// Maximises the margin over a face.
fn maximise(face: &Face) -> Outcome {
    let (p0, basis) = face.p_parts();
    let (f0, f) = face.f_parts();
    let (q, n, unknowns) = (f0.nrows(), p0.nrows(), basis.len());
    let (fq, fp) = (q * (q + 1) / 2, n * (n + 1) / 2);
    let rows = fq + fp + 1 + 2 * unknowns;
    // s = b − A(z, t) ∈ K with s = (F − tI, P − tI, 1 − t, ρ ± z).
    let mut a = DMatrix::zeros(rows, unknowns + 1);
    let mut b = triangle(f0);
    b.extend(triangle(p0));
    b.push(1.0);
    b.extend(std::iter::repeat_n(
        RADIUS * p0.amax().max(1.0),
        2 * unknowns,
    ));
    for k in 0..unknowns {
        let column: Vec<f64> = triangle(&f[k])
            .into_iter()
            .chain(triangle(&basis[k]))
            .map(|v| -v)
            .collect();
        a.view_mut((0, k), (fq + fp, 1)).copy_from_slice(&column);
        a[(fq + fp + 1 + 2 * k, k)] = 1.0;
        a[(fq + fp + 2 + 2 * k, k)] = -1.0;
    }
    let unit = triangle(&DMatrix::identity(q, q))
        .into_iter()
        .chain(triangle(&DMatrix::identity(n, n)));
    for (i, v) in unit.enumerate() {
        a[(i, unknowns)] = v;
    }
    a[(fq + fp, unknowns)] = 1.0;

    let mut objective = vec![0.0; unknowns + 1];
    objective[unknowns] = -1.0;
    let cones: Vec<SupportedConeT<f64>> = vec![
        PSDTriangleConeT(q),
        PSDTriangleConeT(n),
        NonnegativeConeT(1 + 2 * unknowns),
    ];
    let settings: Option<DefaultSettings<f64>> = DefaultSettingsBuilder::default()
        .verbose(false)
        .tol_feas(INTERIOR_POINT)
        .tol_gap_abs(INTERIOR_POINT)
        .tol_gap_rel(INTERIOR_POINT)
        .build()
        .ok();
    let quadratic = CscMatrix::zeros((unknowns + 1, unknowns + 1));
    let stalled = |reason| Outcome::Stalled {
        z: DVector::zeros(unknowns),
        reason,
    };
    let Some(Ok(mut solver)) = settings.map(|settings| {
        DefaultSolver::new(&quadratic, &objective, &dense(&a), &b, &cones, settings)
    }) else {
        return stalled("clarabel refused the problem");
    };
    solver.solve();
    if !matches!(
        solver.solution.status,
        SolverStatus::Solved | SolverStatus::AlmostSolved
    ) {
        return stalled("clarabel did not solve the passivity inequality");
    }
    let z = DVector::from_column_slice(&solver.solution.x[..unknowns]);
    let margin = solver.solution.x[unknowns];
    let dual = square(&solver.solution.z[..fq], q);
    if margin > SIGN * INTERIOR_POINT {
        Outcome::Interior { z, margin }
    } else if margin < -SIGN * INTERIOR_POINT {
        Outcome::Infeasible { z, margin, dual }
    } else {
        Outcome::Boundary { z, margin, dual }
    }
}

/// A dense matrix as clarabel stores it.
fn dense(m: &DMatrix<f64>) -> CscMatrix<f64> {
    let (rows, columns) = m.shape();
    CscMatrix::new(
        rows,
        columns,
        (0..=columns).map(|j| j * rows).collect(),
        (0..columns).flat_map(|_| 0..rows).collect(),
        m.as_slice().to_vec(),
    )
}
