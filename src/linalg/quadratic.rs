//! Two quadratic forms of one vector at once.

use super::dense::{BLOCK, Block, Dense};

/// yᵀΓ₀y and yᵀΓ₁y of symmetric matrices, by blocks of four rows on and above the diagonal; what is above counts twice.
#[derive(Debug, Clone)]
pub(crate) struct Quadratics {
    dim: usize,
    /// For each four rows, column by column from their diagonal on.
    blocks: Vec<[Block; 2]>,
}

impl Quadratics {
    /// Of two matrices of one size.
    pub(crate) fn of(matrices: &[Dense; 2]) -> Self {
        let dim = matrices[0].columns();
        let rows = dim.div_ceil(BLOCK);
        let count = (0..rows).map(|k| dim - k * BLOCK).sum();
        let mut blocks = Vec::with_capacity(count);
        for k in 0..rows {
            for j in k * BLOCK..dim {
                let factor = if j < (k + 1) * BLOCK { 1.0 } else { 2.0 };
                let both = matrices.each_ref();
                blocks.push(both.map(|matrix| matrix.block(k, j).map(|entry| factor * entry)));
            }
        }
        Self { dim, blocks }
    }

    /// Length of y with zeros up to whole blocks, as [`Self::at`] takes it.
    pub(crate) fn padded(dim: usize) -> usize {
        dim.next_multiple_of(BLOCK)
    }

    /// Both at y.
    #[inline]
    pub(crate) fn at(&self, y: &[f64]) -> [f64; 2] {
        let (mut sums, mut rest) = ([0.0; 2], &self.blocks[..]);
        let (rows, _) = y.as_chunks::<BLOCK>();
        for (k, row) in rows.iter().enumerate() {
            let columns = &y[k * BLOCK..self.dim];
            let (blocks, after) = rest.split_at(columns.len());
            let mut along = [[0.0; BLOCK]; 2];
            for (block, &y) in blocks.iter().zip(columns) {
                for (along, block) in along.iter_mut().zip(block) {
                    for (sum, entry) in along.iter_mut().zip(block) {
                        *sum += entry * y;
                    }
                }
            }
            for (sum, along) in sums.iter_mut().zip(along) {
                let products = along.iter().zip(row).map(|(a, y)| a * y);
                *sum += products.sum::<f64>();
            }
            rest = after;
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms_of_any_size() {
        for dim in 0..11 {
            let symmetric =
                |seed: f64| Dense::from_fn(dim, dim, |i, j| ((i * j + i + j) as f64 * seed).sin());
            let matrices = [symmetric(1.3), symmetric(0.7)];
            let mut y: Vec<f64> = (0..dim).map(|i| (i as f64 + 0.4).cos()).collect();
            let expected = matrices.each_ref().map(|matrix| {
                let pairs = (0..dim).flat_map(|i| (0..dim).map(move |j| (i, j)));
                let terms = pairs.map(|(i, j)| y[i] * matrix.column(j)[i] * y[j]);
                terms.sum::<f64>()
            });
            y.resize(Quadratics::padded(dim), 0.0);
            let found = Quadratics::of(&matrices).at(&y);
            for (found, expected) in found.iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 1e-13,
                    "{dim}: {found} {expected}"
                );
            }
        }
    }
}
