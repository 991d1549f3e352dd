//! Systems whose rows are decades apart: those of states behind different resistances.

use nalgebra::{DMatrix, DVector, Dyn, LU};

/// A factored matrix, rows by their diagonals: those of different Roff are decades apart.
pub(crate) struct Levelled {
    diagonal: DVector<f64>,
    factors: LU<f64, Dyn, Dyn>,
}

impl Levelled {
    /// Of a matrix without zeros on its diagonal.
    pub(crate) fn new(a: &DMatrix<f64>) -> Self {
        let diagonal = a.diagonal();
        let factors = levelled(a.clone(), &diagonal).lu();
        Self { diagonal, factors }
    }

    /// a⁻¹ b; `None` where it is singular.
    pub(crate) fn solve(&self, b: DMatrix<f64>) -> Option<DMatrix<f64>> {
        let mut solved = levelled(b, &self.diagonal);
        self.factors.solve_mut(&mut solved).then_some(solved)
    }
}

/// Rows over these numbers.
fn levelled(mut matrix: DMatrix<f64>, by: &DVector<f64>) -> DMatrix<f64> {
    for mut column in matrix.column_iter_mut() {
        column.component_div_assign(by);
    }
    matrix
}
