//! Small linear and quadratic programs: feasibility questions that the hypotheses of theorems come down to.

use crate::settings::tolerances::theorems::{INTERIOR_POINT, STRICT};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT,
    SolverStatus, SupportedConeT, ZeroConeT,
};
use nalgebra::{DMatrix, DVector};

/// Minimises ½xᵀPx + qᵀx subject to Ax + b = 0 on the first `equalities` rows and ≥ 0 on the rest.
/// `None` if it is infeasible or unbounded.
#[must_use]
pub fn minimise(
    p: &DMatrix<f64>,
    q: &DVector<f64>,
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    equalities: usize,
) -> Option<DVector<f64>> {
    let rows = a.nrows();
    let upper = DMatrix::from_fn(p.nrows(), p.ncols(), |i, j| {
        if i <= j {
            0.5 * (p[(i, j)] + p[(j, i)])
        } else {
            0.0
        }
    });
    let cones: Vec<SupportedConeT<f64>> =
        vec![ZeroConeT(equalities), NonnegativeConeT(rows - equalities)];
    let settings: DefaultSettings<f64> = DefaultSettingsBuilder::default()
        .verbose(false)
        .tol_feas(INTERIOR_POINT)
        .tol_gap_abs(INTERIOR_POINT)
        .tol_gap_rel(INTERIOR_POINT)
        .build()
        .ok()?;
    let mut solver = DefaultSolver::new(
        &sparse(&upper),
        q.as_slice(),
        &sparse(&-a),
        b.as_slice(),
        &cones,
        settings,
    )
    .ok()?;
    solver.solve();
    match solver.solution.status {
        SolverStatus::Solved | SolverStatus::AlmostSolved => {
            let x = DVector::from_column_slice(&solver.solution.x);
            x.iter().all(|v| v.is_finite()).then_some(x)
        }
        _ => None,
    }
}

/// Columns of the nonzeros of a dense matrix.
fn sparse(m: &DMatrix<f64>) -> CscMatrix<f64> {
    let mut columns = vec![0];
    let (mut rows, mut values) = (Vec::new(), Vec::new());
    for j in 0..m.ncols() {
        for i in 0..m.nrows() {
            if m[(i, j)] != 0.0 {
                rows.push(i);
                values.push(m[(i, j)]);
            }
        }
        columns.push(rows.len());
    }
    CscMatrix::new(m.nrows(), m.ncols(), columns, rows, values)
}

/// Inequalities Gz + h ≥ 0; the rows of `strict` may be asked to hold strictly.
#[derive(Debug, Clone)]
pub struct Inequalities {
    /// rows×variables.
    pub g: DMatrix<f64>,
    /// rows.
    pub h: DVector<f64>,
    /// Which rows must hold with slack.
    pub strict: Vec<bool>,
}

/// A point of the inequalities with the largest slack s ≤ 1 of the strict rows (rows scaled to unit size).
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// z.
    pub z: DVector<f64>,
    /// s.
    pub slack: f64,
}

impl Point {
    /// Whether all strict rows hold strictly.
    #[must_use]
    pub fn is_strict(&self) -> bool {
        self.slack > STRICT
    }

    /// Whether the inequalities hold at all.
    #[must_use]
    pub fn is_feasible(&self) -> bool {
        self.slack > -STRICT
    }
}

impl Inequalities {
    /// Maximises the slack; `None` if the rows that are not strict cannot be satisfied.
    #[must_use]
    pub fn widest(&self) -> Option<Point> {
        let (rows, variables) = self.g.shape();
        let mut a = DMatrix::zeros(rows + 1, variables + 1);
        let mut b = DVector::zeros(rows + 1);
        // One unit for the variables: the size of h where there is one, so that a slack of one is of the circuit's size.
        for i in 0..rows {
            let size = self.g.row(i).amax().max(self.h[i].abs());
            let f = if size > 0.0 { 1.0 / size } else { 1.0 };
            a.view_mut((i, 0), (1, variables))
                .copy_from(&(self.g.row(i) * f));
            a[(i, variables)] = if self.strict[i] { -1.0 } else { 0.0 };
            b[i] = self.h[i] * f;
        }
        a[(rows, variables)] = -1.0;
        b[rows] = 1.0;
        let mut q = DVector::zeros(variables + 1);
        q[variables] = -1.0;
        let p = DMatrix::zeros(variables + 1, variables + 1);
        let x = minimise(&p, &q, &a, &b, 0)?;
        Some(Point {
            slack: x[variables],
            z: x.rows(0, variables).into_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slack_tells_interior_boundary_and_empty() {
        let halfplanes = |h: f64| Inequalities {
            g: DMatrix::from_row_slice(2, 1, &[1.0, -1.0]),
            h: DVector::from_column_slice(&[0.0, h]),
            strict: vec![true, true],
        };
        assert!(halfplanes(1.0).widest().is_some_and(|p| p.is_strict()));
        assert!(
            halfplanes(0.0)
                .widest()
                .is_some_and(|p| p.is_feasible() && !p.is_strict())
        );
        assert!(halfplanes(-1.0).widest().is_some_and(|p| !p.is_feasible()));
    }
}
