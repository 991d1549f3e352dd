//! Sums of products φ wᵀ, and what integrals they are of.

use nalgebra::DMatrix;

use super::linear::Motion;
use crate::integrate::Error;

/// Σ a_c bᵀ by costate c, several terms at a time: a product of matrices takes less than as many of vectors.
#[derive(Debug)]
pub(super) struct Sums {
    of: Vec<DMatrix<f64>>,
    /// a by costate, and bᵀ, of the terms that wait.
    after: Vec<DMatrix<f64>>,
    before: DMatrix<f64>,
    waiting: usize,
}

impl Sums {
    /// Terms that wait for each other.
    const AT_ONCE: usize = 16;

    /// Of no terms yet, by costate a matrix of so many rows and columns.
    pub(super) fn of(rows: usize, columns: usize, costates: usize) -> Self {
        Self {
            of: vec![DMatrix::zeros(rows, columns); costates],
            after: vec![DMatrix::zeros(rows, Self::AT_ONCE); costates],
            before: DMatrix::zeros(Self::AT_ONCE, columns),
            waiting: 0,
        }
    }

    /// Adds a_c bᵀ, a with a column for each costate.
    pub(super) fn add(&mut self, a: &DMatrix<f64>, b: &[f64]) {
        for (after, a) in self.after.iter_mut().zip(a.column_iter()) {
            after.column_mut(self.waiting).copy_from(&a);
        }
        for (before, b) in self.before.row_mut(self.waiting).iter_mut().zip(b) {
            *before = *b;
        }
        self.waiting += 1;
        if self.waiting == Self::AT_ONCE {
            self.add_waiting();
        }
    }

    fn add_waiting(&mut self) {
        let before = self.before.rows(0, self.waiting);
        for (sum, after) in self.of.iter_mut().zip(&self.after) {
            let after = after.columns(0, self.waiting);
            if after.iter().any(|value| *value != 0.0) {
                sum.gemm(1.0, &after, &before, 1.0);
            }
        }
        self.waiting = 0;
    }

    /// By costate with all terms.
    pub(super) fn whole(mut self) -> Vec<DMatrix<f64>> {
        self.add_waiting();
        self.of
    }

    /// How many numbers they are.
    pub(super) fn values(&self) -> usize {
        self.of.iter().map(DMatrix::len).sum()
    }
}

/// Adds by costate Σ L_h(X) of the sums X of each halving h of a motion, carried from each to its half.
///
/// # Errors
/// An exponential does not exist in doubles.
pub(super) fn integrate(
    motion: &mut Motion<'_>,
    levels: &[Vec<DMatrix<f64>>],
    whole: &mut [DMatrix<f64>],
) -> Result<(), Error> {
    let last = (motion.bottom as usize + 1).max(levels.len());
    let mut sums: Vec<DMatrix<f64>> = whole.iter().map(|whole| whole.map(|_| 0.0)).collect();
    let mut halved = motion.linear.generator.clone();
    for level in 0..last {
        for (sum, own) in sums.iter_mut().zip(levels.get(level).into_iter().flatten()) {
            *sum += own;
        }
        if level + 1 < last && sums.iter().any(|sum| sum.amax() > 0.0) {
            let step = motion.step_back(level as u32 + 1)?;
            for sum in &mut sums {
                halved.copy_from(sum);
                halved.gemm(1.0, step, sum, 2.0);
                halved.gemm(1.0, sum, step, 1.0);
                std::mem::swap(sum, &mut halved);
            }
        }
    }
    let h = motion.part(last as u32 - 1);
    let generator = motion.linear.generator.transpose() * h;
    for (whole, sum) in whole.iter_mut().zip(sums) {
        *whole += short(&generator, sum) * h;
    }
    Ok(())
}

/// L_h(X)/h by its series Σ S_m/(m + 1)!, S_m = B S_{m−1} + X Bᵐ, with B = 𝒜ᵀ h.
fn short(b: &DMatrix<f64>, x: DMatrix<f64>) -> DMatrix<f64> {
    /// Terms beyond which nothing is left where ‖B‖ ≤ ⅛.
    const TERMS: u32 = 12;
    let mut sum = x.clone();
    let (mut term, mut right, mut next) = (x.clone(), x.clone(), x);
    let mut factor = 1.0;
    for m in 1..TERMS {
        next.gemm(1.0, &right, b, 0.0);
        std::mem::swap(&mut right, &mut next);
        next.copy_from(&right);
        next.gemm(1.0, b, &term, 1.0);
        std::mem::swap(&mut term, &mut next);
        factor /= f64::from(m + 1);
        sum.zip_apply(&term, |sum, term| *sum += term * factor);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::dmatrix;

    /// ∫ e^{a(1−t)} e^{bt} dt = (e^a − e^b)/(a − b) where 𝒜 is diagonal, to its first terms.
    #[test]
    fn short_integrals_are_divided_differences() {
        let (a, b) = (0.11, -0.07_f64);
        let found = short(&dmatrix![a, 0.0; 0.0, b], dmatrix![1.0, 1.0; 1.0, 1.0]);
        let across = (a.exp() - b.exp()) / (a - b);
        let exact = dmatrix![a.exp(), across; across, b.exp()];
        assert!((found - exact).amax() < 4.0 * f64::EPSILON);
    }
}
