//! ∫ φ wᵀ dt along stretches of w' = 𝒜 w with costates φ' = −𝒜ᵀ φ.
//!
//! Over h from w₀ to φ₁ it is L_h(φ₁ w₀ᵀ) with the linear map
//!
//! ```text
//! L_h(X) = ∫₀ʰ e^{𝒜ᵀ(h−t)} X e^{𝒜ᵀ t} dt,     L_2h(X) = L_h(Φᵀ X + X Φᵀ),     Φ = e^{𝒜 h}.
//! ```
//!
//! A stretch is cut into lengths that are halvings of one unit, each of which adds φ₁ w₀ᵀ to one sum per length; one whose length recurs is not cut, and adds to the sum of that
//! length. Of a piece at whose nodes outputs y = C w are weighed with ω_j, ω_j w₀ᵀ is added to a sum as well, as φ₀ = Φᵀ φ₁ + Σ_j (C Φ_j)ᵀ ω_j with the rows C Φ_j that all
//! pieces of that length have in common. The sums of all stretches are then carried from each length to its half, down to one where Taylor's series holds. So a stretch costs
//! products of matrices and vectors, and products of matrices are as many as there are equations and lengths, however far apart the eigenvalues of 𝒜 lie.

use nalgebra::{DMatrix, DMatrixView, DVector};

use super::length::Length;
use super::linear::{LEVELS, Linear, Motion, TERMS, series};
use super::sums::{Sums, integrate};
use crate::integrate::Error;
use crate::linalg::gauss::{NODES, POINTS, WEIGHTS};
use crate::linalg::product::add_product;
use crate::measure::{INTERVALS, VALUES};

/// Takes costates back over a halving of the unit: φ(0) = Φᵀ φ(h).
fn step_back(motion: &mut Motion<'_>, level: u32, phi: &mut DMatrix<f64>) -> Result<(), Error> {
    let after = phi.clone();
    add_products(phi, motion.step_back(level)?, &after);
    Ok(())
}

/// Y ← Y + A X.
fn add_products(y: &mut DMatrix<f64>, a: &DMatrix<f64>, x: &DMatrix<f64>) {
    for (mut y, x) in y.column_iter_mut().zip(x.column_iter()) {
        add_product(y.as_mut_slice(), a, x.as_slice());
    }
}

/// By node s_j of Gauss and Legendre s_j^k.
const POWERS: [[f64; TERMS]; POINTS] = powers();

const fn powers() -> [[f64; TERMS]; POINTS] {
    let mut all = [[1.0; TERMS]; POINTS];
    let mut j = 0;
    while j < POINTS {
        let mut k = 1;
        while k < TERMS {
            all[j][k] = all[j][k - 1] * NODES[j];
            k += 1;
        }
        j += 1;
    }
    all
}

/// Σ_k s_j^k w_k of a series' columns w_k by node s_j, N×[`POINTS`]; `node` has the number of each.
fn through_nodes(series: &DMatrix<f64>, node: fn(usize) -> usize) -> DMatrix<f64> {
    let mut values = DMatrix::zeros(series.nrows(), POINTS);
    for (j, mut column) in values.column_iter_mut().enumerate() {
        add_product(column.as_mut_slice(), series, &POWERS[node(j)]);
    }
    values
}

/// Sums of an equation of dimension N, for several costates.
pub(super) struct Outer<'a> {
    linear: &'a Linear,
    costates: usize,
    /// By halving of the unit: Σ φ₁ w₀ᵀ, N×N.
    levels: Vec<Option<Sums>>,
    /// By halving: Σ ω w₀ᵀ of pieces at whose nodes ω weighs the m outputs, m·[`VALUES`]×N.
    weights: Vec<Vec<DMatrix<f64>>>,
    /// Σ φ₁ w₀ᵀ of lengths that recur: each is the unit of its own motion.
    recurring: Vec<(Motion<'a>, Sums)>,
    /// By costate: ∫ φ wᵀ dt of what is whole.
    whole: Vec<DMatrix<f64>>,
    /// By costate: Σ ω wᵀ over the nodes of what is whole, m×N.
    outputs: Vec<DMatrix<f64>>,
}

impl<'a> Outer<'a> {
    /// Room for so many costates.
    pub(super) fn of(linear: &'a Linear, costates: usize) -> Self {
        let dim = linear.generator.nrows();
        Self {
            linear,
            costates,
            levels: Vec::new(),
            weights: Vec::new(),
            recurring: Vec::new(),
            whole: vec![DMatrix::zeros(dim, dim); costates],
            outputs: vec![DMatrix::zeros(linear.rows[0].nrows(), dim); costates],
        }
    }

    fn dim(&self) -> usize {
        self.linear.generator.nrows()
    }

    /// Takes costates back over a halving of the unit from the w before it.
    pub(super) fn back(
        &mut self,
        motion: &mut Motion<'_>,
        halving: u32,
        phi: &mut DMatrix<f64>,
        w: &[f64],
    ) -> Result<(), Error> {
        if phi.iter().all(|value| *value == 0.0) {
            return Ok(());
        }
        let (dim, costates, at) = (self.dim(), self.costates, halving as usize);
        if self.levels.len() <= at {
            self.levels.resize_with(at + 1, || None);
        }
        let sums = self.levels[at].get_or_insert_with(|| Sums::of(dim, dim, costates));
        sums.add(phi, w);
        step_back(motion, halving, phi)
    }

    /// What weighs the outputs at the nodes of pieces of one length, by costate m·[`VALUES`]×pieces, has of costates where the pieces begin, by costate N×pieces. The
    /// equation is at w there, N×pieces.
    ///
    /// # Errors
    /// An exponential does not exist in doubles.
    pub(super) fn weigh(
        &mut self,
        motion: &mut Motion<'_>,
        halving: u32,
        weights: &[DMatrixView<'_, f64>],
        w: DMatrixView<'_, f64>,
    ) -> Result<Vec<DMatrix<f64>>, Error> {
        let (dim, at) = (self.dim(), halving as usize);
        if self.weights.len() <= at {
            self.weights.resize(at + 1, vec![]);
        }
        let rows = self.outputs.first().map_or(0, DMatrix::nrows) * VALUES;
        let sums = &mut self.weights[at];
        sums.resize_with(self.costates, || DMatrix::zeros(rows, dim));
        let (back, before) = (motion.seen_back(halving)?, w.transpose());
        let of = |(sum, weights): (&mut DMatrix<f64>, &DMatrixView<'_, f64>)| {
            let mut seen = DMatrix::zeros(dim, w.ncols());
            if weights.iter().any(|weight| *weight != 0.0) {
                sum.gemm(1.0, weights, &before, 1.0);
                seen.gemm(1.0, back, weights, 0.0);
            }
            seen
        };
        Ok(sums.iter_mut().zip(weights).map(of).collect())
    }

    /// Takes costates back over a stretch from the w before it: by its own exponential where its length recurs, else by the binary digits of that, the largest first, and a rest for
    /// which the series holds.
    pub(super) fn back_over(
        &mut self,
        motion: &mut Motion<'_>,
        length: Length,
        phi: &mut DMatrix<f64>,
        w: &DVector<f64>,
    ) -> Result<(), Error> {
        if length.seconds <= 0.0 || phi.iter().all(|value| *value == 0.0) {
            return Ok(());
        }
        if length.recurs {
            let (motion, sums) = self.recurring(length.seconds);
            sums.add(phi, w.as_slice());
            return step_back(motion, 0, phi);
        }
        let (mut left, mut w) = (length.seconds, w.clone());
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
            self.back_by_series(left, phi, &w);
        }
        for (level, w) in steps.iter().rev() {
            self.back(motion, *level, phi, w.as_slice())?;
        }
        Ok(())
    }

    /// The motion of a length that recurs, and its sums.
    fn recurring(&mut self, seconds: f64) -> &mut (Motion<'a>, Sums) {
        let mut known = self.recurring.iter();
        let known = known.position(|(motion, _)| motion.seconds == seconds);
        let at = known.unwrap_or_else(|| {
            let sums = Sums::of(self.dim(), self.dim(), self.costates);
            self.recurring.push((self.linear.over(seconds), sums));
            self.recurring.len() - 1
        });
        &mut self.recurring[at]
    }

    /// Takes costates back over a time, s, for which the series holds, from the w before it.
    fn back_by_series(&mut self, seconds: f64, phi: &mut DMatrix<f64>, w: &DVector<f64>) {
        let generator = &self.linear.generator;
        let back = generator.transpose();
        let mut before = through_nodes(&series(generator, w.as_slice(), seconds), |j| j);
        for (mut column, weight) in before.column_iter_mut().zip(WEIGHTS) {
            column *= seconds * weight;
        }
        let before = before.transpose();
        for (whole, mut phi) in self.whole.iter_mut().zip(phi.column_iter_mut()) {
            let series = series(&back, phi.as_slice(), seconds);
            // The nodes lie alike from both ends.
            whole.gemm(
                1.0,
                &through_nodes(&series, |j| POINTS - 1 - j),
                &before,
                1.0,
            );
            phi.copy_from(&series.column_sum());
        }
    }

    /// The values of all sums.
    pub(super) fn values(&self) -> usize {
        let weights = self.weights.iter().flatten().map(DMatrix::len);
        let recurring = self.recurring.iter().map(|(_, sums)| sums);
        let sums = self.levels.iter().flatten().chain(recurring);
        weights.chain(sums.map(Sums::values)).sum()
    }

    /// Carries all sums to what is whole.
    ///
    /// # Errors
    /// An exponential does not exist in doubles.
    pub(super) fn settle(&mut self, motion: &mut Motion<'_>) -> Result<(), Error> {
        let whole = |sums: Option<Sums>| sums.map_or_else(Vec::new, Sums::whole);
        let levels = std::mem::take(&mut self.levels).into_iter().map(whole);
        let mut levels: Vec<Vec<DMatrix<f64>>> = levels.collect();
        let weights = std::mem::take(&mut self.weights);
        if !weights.is_empty() {
            levels.resize(levels.len().max(weights.len() + LEVELS as usize), vec![]);
        }
        for (halving, weights) in weights.into_iter().enumerate() {
            for (c, weights) in weights.iter().enumerate() {
                self.settle_weights(motion, halving, (c, weights), &mut levels)?;
            }
        }
        integrate(motion, &levels, &mut self.whole)?;
        for (mut motion, sums) in std::mem::take(&mut self.recurring) {
            integrate(&mut motion, &[sums.whole()], &mut self.whole)?;
        }
        Ok(())
    }

    /// Carries what costate c weighs at the nodes of pieces to the sums of their halvings: the time until a node is a sum of halvings, the largest first, and
    /// over each goes what the nodes from its end on weigh, as far as that halving is one of theirs.
    fn settle_weights(
        &mut self,
        motion: &mut Motion<'_>,
        halving: usize,
        (c, weights): (usize, &DMatrix<f64>),
        levels: &mut [Vec<DMatrix<f64>>],
    ) -> Result<(), Error> {
        let piece = halving as u32;
        let values = motion.seen_back(piece)?.clone();
        // Σ ω wᵀ with the w at an even node, by half of its number.
        let half = weights + weights * motion.step_back(piece + 1)?;
        let quarter = motion.step_back(piece + 2)?;
        let three = &half + &half * quarter;
        let at = [weights, &(weights + weights * quarter), &half, &three];
        let dim = self.dim();
        for k in 0..=LEVELS {
            let length = INTERVALS >> k;
            let own = &mut levels[halving + k as usize];
            own.resize_with(self.costates, || DMatrix::zeros(dim, dim));
            for from in (0..INTERVALS).step_by(2 * length) {
                let end = from + length;
                let nodes = length.min(VALUES - end);
                for output in (0..values.ncols()).step_by(VALUES) {
                    let read = values.columns(output, nodes);
                    let weights = at[from / 2].rows(output + end, nodes);
                    own[c].gemm(1.0, &read, &weights, 1.0);
                }
            }
        }
        let whole = motion.step_back(piece)?;
        let last = weights + weights * whole;
        let node = motion.step_back(piece + LEVELS)?;
        for (output, mut sum) in self.outputs[c].row_iter_mut().enumerate() {
            let row = output * VALUES;
            sum += last.row(row + INTERVALS);
            for (k, at) in at.iter().enumerate() {
                let [even, odd] = [0, 1].map(|odd| at.row(row + 2 * k + odd));
                sum += even + odd + odd * node;
            }
        }
        Ok(())
    }

    /// By costate ∫ φ wᵀ dt, N×N, and Σ ω wᵀ over all nodes, m×N.
    ///
    /// # Errors
    /// An exponential does not exist in doubles.
    pub(super) fn whole(
        mut self,
        motion: &mut Motion<'_>,
    ) -> Result<impl Iterator<Item = (DMatrix<f64>, DMatrix<f64>)>, Error> {
        self.settle(motion)?;
        Ok(self.whole.into_iter().zip(self.outputs))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::exact::Spectrum;
    use crate::linalg::product::add_outer;
    use nalgebra::{dmatrix, dvector};

    /// Two outputs of an oscillation that decays and a slow state that follows it.
    fn linear() -> Linear {
        let generator = dmatrix![-0.4, 3.0, 0.0; -3.0, -0.1, 0.2; 1.0, 0.5, -0.05];
        let rows = dmatrix![1.0, 0.0, 2.0; 0.3, -1.0, 0.5];
        let rates = &rows * &generator;
        let second = &rates * &generator;
        Linear::of_generator(
            generator.clone(),
            [rows, rates, second],
            Spectrum::new(&generator, &[]),
        )
    }

    fn costates() -> DMatrix<f64> {
        dmatrix![1.0, 0.2; -0.5, 0.0; 2.0, 1.5]
    }

    fn close(name: &str, found: &DMatrix<f64>, exact: &DMatrix<f64>) {
        let apart = (found - exact).amax();
        assert!(apart < 1e-13 * exact.amax(), "{name}: {apart:e}");
    }

    #[test]
    fn a_length_that_recurs_takes_costates_as_its_digits_do() {
        let linear = linear();
        let w = dvector![0.7, -1.0, 0.4];
        let over = |recurs: bool| {
            let (mut motion, mut phi) = (linear.over(1.0), costates());
            let mut outer = Outer::of(&linear, 2);
            let seconds = 0.83;
            for _ in 0..3 {
                let length = Length { seconds, recurs };
                outer.back_over(&mut motion, length, &mut phi, &w).unwrap();
            }
            let levels = outer.levels.iter().flatten().count();
            assert_eq!(
                (outer.recurring.len(), levels > 0),
                (usize::from(recurs), !recurs)
            );
            (phi, outer.whole(&mut motion).unwrap().collect::<Vec<_>>())
        };
        let ((phi, whole), (exact, others)) = (over(true), over(false));
        close("costates", &phi, &exact);
        for (own, other) in whole.iter().zip(&others) {
            close("integral", &own.0, &other.0);
        }
    }

    #[test]
    fn what_is_weighed_in_a_piece_is_what_its_nodes_weigh_one_after_the_other() {
        let linear = linear();
        let weights =
            DMatrix::from_fn(2 * VALUES, 2, |i, c| (1.0 + 0.7 * (i + 5 * c) as f64).sin());
        let (mut motion, w) = (linear.over(1.0), dvector![0.7, -1.0, 0.4]);
        let (mut phi, mut outer) = (costates(), Outer::of(&linear, 2));
        outer.back(&mut motion, 1, &mut phi, w.as_slice()).unwrap();
        let own = [0, 1].map(|c| weights.columns(c, 1).into_owned());
        let own = own.each_ref().map(|own| own.as_view());
        let start = DMatrix::from_column_slice(3, 1, w.as_slice());
        let seen = outer.weigh(&mut motion, 1, &own, start.as_view()).unwrap();
        phi += DMatrix::from_columns(&[seen[0].column(0), seen[1].column(0)]);
        let found: Vec<_> = outer.whole(&mut motion).unwrap().collect();
        let mut nodes = vec![w];
        for node in 0..INTERVALS {
            nodes.push(motion.after(1 + LEVELS, &nodes[node]).unwrap());
        }
        let (mut one, mut outer) = (costates(), Outer::of(&linear, 2));
        let mut sums = [DMatrix::zeros(2, 3), DMatrix::zeros(2, 3)];
        for (node, w) in nodes.iter().enumerate().rev() {
            if node < INTERVALS {
                outer
                    .back(&mut motion, 1 + LEVELS, &mut one, w.as_slice())
                    .unwrap();
            }
            for (c, sum) in sums.iter_mut().enumerate() {
                let own = dvector![weights[(node, c)], weights[(VALUES + node, c)]];
                let mut column = one.column_mut(c);
                column += linear.rows[0].tr_mul(&own);
                add_outer(sum, own.as_slice(), w.as_slice());
            }
        }
        close("costates", &phi, &one);
        let exact = outer.whole(&mut motion).unwrap();
        for ((own, other), sum) in found.iter().zip(exact).zip(&sums) {
            close("integral", &own.0, &other.0);
            close("outputs", &own.1, sum);
        }
    }
}
