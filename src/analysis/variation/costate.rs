//! ∫ φ wᵀ dt along stretches of w' = 𝒜 w with costates φ' = −𝒜ᵀ φ.
//!
//! Over h from w₀ to φ₁ it is L_h(φ₁ w₀ᵀ) with the linear map
//!
//! ```text
//! L_h(X) = ∫₀ʰ e^{𝒜ᵀ(h−t)} X e^{𝒜ᵀ t} dt,     L_2h(X) = L_h(Φᵀ X + X Φᵀ),     Φ = e^{𝒜 h}.
//! ```
//!
//! A stretch is cut into lengths that are halvings of one unit, each of which adds φ₁ w₀ᵀ to one sum per length. The sums of all stretches are then
//! carried from each length to its half, down to one where Taylor's series holds. So a stretch costs products of matrices and vectors, and products of matrices are as many as
//! there are equations and lengths, however far apart the eigenvalues of 𝒜 lie.

use nalgebra::{DMatrix, DVector};

use super::linear::Motion;
use crate::integrate::Error;
use crate::linalg::gauss::{NODES, WEIGHTS};

/// Costates φ₁, and w₀.
type Factors = (DMatrix<f64>, DVector<f64>);

/// Sums of an equation of dimension N, for several costates.
#[derive(Debug, Default)]
pub(super) struct Outer {
    /// By halving of the unit and costate: Σ φ₁ w₀ᵀ, N×N.
    levels: Vec<Vec<DMatrix<f64>>>,
    /// By costate: ∫ φ wᵀ dt of what is whole.
    whole: Vec<DMatrix<f64>>,
    /// What is still to be added to the sums of one halving: φ₁ and w₀.
    waiting: (u32, Vec<Factors>),
}

impl Outer {
    /// Room for so many costates.
    pub(super) fn of(dim: usize, costates: usize) -> Self {
        Self {
            levels: Vec::new(),
            whole: vec![DMatrix::zeros(dim, dim); costates],
            waiting: (0, Vec::new()),
        }
    }

    fn level(&mut self, level: u32) -> &mut [DMatrix<f64>] {
        let at = level as usize;
        if self.levels.len() <= at {
            self.levels.resize(at + 1, Vec::new());
        }
        if self.levels[at].is_empty() {
            let whole = self.whole.iter();
            self.levels[at] = whole.map(|whole| whole.map(|_| 0.0)).collect();
        }
        &mut self.levels[at]
    }

    /// Adds Σ_c φ_c wᵀ to the sums of a halving, several at a time: a product of matrices takes less than as many of vectors.
    fn wait(&mut self, level: u32, phi: &DMatrix<f64>, w: &DVector<f64>) {
        /// Products that wait for each other.
        const AT_ONCE: usize = 16;
        if self.waiting.0 != level || self.waiting.1.len() == AT_ONCE {
            self.add_waiting();
        }
        self.waiting.0 = level;
        self.waiting.1.push((phi.clone(), w.clone()));
    }

    fn add_waiting(&mut self) {
        let (level, waiting) = (self.waiting.0, std::mem::take(&mut self.waiting.1));
        let Some((_, first)) = waiting.first() else {
            return;
        };
        let (dim, count) = (first.len(), waiting.len());
        let before = DMatrix::from_fn(count, dim, |k, i| waiting[k].1[i]);
        for (c, sum) in self.level(level).iter_mut().enumerate() {
            let after = DMatrix::from_fn(dim, count, |i, k| waiting[k].0[(i, c)]);
            if after.iter().any(|value| *value != 0.0) {
                sum.gemm(1.0, &after, &before, 1.0);
            }
        }
    }

    /// Takes costates back over a halving of the unit from the w before it.
    pub(super) fn back(
        &mut self,
        motion: &mut Motion<'_>,
        level: u32,
        phi: &mut DMatrix<f64>,
        w: &DVector<f64>,
    ) -> Result<(), Error> {
        if phi.iter().all(|value| *value == 0.0) {
            return Ok(());
        }
        self.wait(level, phi, w);
        let step = motion.step(level)?.tr_mul(&*phi);
        *phi += step;
        Ok(())
    }

    /// Takes costates back over any time from the w before it: its binary digits, the largest first, and a rest for which the series holds.
    pub(super) fn back_over(
        &mut self,
        motion: &mut Motion<'_>,
        seconds: f64,
        phi: &mut DMatrix<f64>,
        w: &DVector<f64>,
    ) -> Result<(), Error> {
        if phi.iter().all(|value| *value == 0.0) {
            return Ok(());
        }
        let (mut left, mut w) = (seconds, w.clone());
        let mut steps = Vec::new();
        for level in 0..=motion.bottom {
            let length = motion.part(level);
            if left >= length {
                let next = motion.after(level, &w)?;
                steps.push((level, std::mem::replace(&mut w, next)));
                left -= length;
            }
        }
        if left > 0.0 {
            let forward = motion.series(&w, left);
            let columns = (0..phi.ncols()).map(|c| motion.series_back(&phi.column(c).into(), left));
            let backward: Vec<Vec<DVector<f64>>> = columns.collect();
            let at = |series: &[DVector<f64>], s: f64| {
                let (last, rest) = series.split_last()?;
                Some(
                    rest.iter()
                        .rev()
                        .fold(last.clone(), |sum, term| sum * s + term),
                )
            };
            for (c, backward) in backward.iter().enumerate() {
                for (s, weight) in NODES.iter().zip(WEIGHTS) {
                    if let (Some(w), Some(phi)) = (at(&forward, *s), at(backward, 1.0 - s)) {
                        self.whole[c].ger(left * weight, &phi, &w, 1.0);
                    }
                }
                if let Some(before) = at(backward, 1.0) {
                    phi.set_column(c, &before);
                }
            }
        }
        for (level, w) in steps.iter().rev() {
            self.back(motion, *level, phi, w)?;
        }
        Ok(())
    }

    /// The values of the sums by length.
    pub(super) fn values(&self) -> usize {
        let own = self.whole.iter().map(DMatrix::len).sum::<usize>();
        own * self.levels.iter().filter(|level| !level.is_empty()).count()
    }

    /// Carries the sums of all lengths to what is whole.
    ///
    /// # Errors
    /// An exponential does not exist in doubles.
    pub(super) fn settle(&mut self, motion: &mut Motion<'_>) -> Result<(), Error> {
        self.add_waiting();
        let levels = std::mem::take(&mut self.levels);
        let last = (motion.bottom as usize + 1).max(levels.len());
        let whole = self.whole.iter();
        let mut sums: Vec<DMatrix<f64>> = whole.map(|whole| whole.map(|_| 0.0)).collect();
        for level in 0..last {
            if let Some(own) = levels.get(level) {
                for (sum, own) in sums.iter_mut().zip(own) {
                    *sum += own;
                }
            }
            if level + 1 < last && sums.iter().any(|sum| sum.amax() > 0.0) {
                let step = motion.step(level as u32 + 1)?.transpose();
                for sum in &mut sums {
                    *sum = &*sum * 2.0 + &step * &*sum + &*sum * &step;
                }
            }
        }
        let h = motion.part(last as u32 - 1);
        let generator = motion.linear.generator.transpose() * h;
        for (whole, sum) in self.whole.iter_mut().zip(sums) {
            *whole += short(&generator, sum) * h;
        }
        Ok(())
    }

    /// ∫ φ wᵀ dt by costate.
    ///
    /// # Errors
    /// An exponential does not exist in doubles.
    pub(super) fn whole(mut self, motion: &mut Motion<'_>) -> Result<Vec<DMatrix<f64>>, Error> {
        self.settle(motion)?;
        Ok(self.whole)
    }
}

/// L_h(X)/h by its series Σ S_m/(m + 1)!, S_m = B S_{m−1} + X Bᵐ, with B = 𝒜ᵀ h.
fn short(b: &DMatrix<f64>, x: DMatrix<f64>) -> DMatrix<f64> {
    /// Terms beyond which nothing is left where ‖B‖ ≤ ⅛.
    const TERMS: u32 = 12;
    let mut sum = x.clone();
    let (mut term, mut right) = (x.clone(), x);
    let mut factor = 1.0;
    for m in 1..TERMS {
        right *= b;
        term = b * term + &right;
        factor /= f64::from(m + 1);
        sum += &term * factor;
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
