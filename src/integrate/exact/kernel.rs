//! The matrix-vector product of the step loop.

use nalgebra::DMatrix;

/// Rows computed together: four independent accumulators keep the adders of any x86-64 or ARM64 core busy.
const BLOCK: usize = 4;

/// A dense matrix in blocks of four rows, each block column by column, for y = K w without allocation.
#[derive(Debug, Clone, Default)]
pub(crate) struct Kernel {
    rows: usize,
    columns: usize,
    blocks: Vec<[f64; BLOCK]>,
}

impl Kernel {
    /// Repacks a matrix.
    pub(crate) fn new(matrix: &DMatrix<f64>) -> Self {
        Self::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)])
    }

    /// Packs entries (row, column).
    pub(crate) fn from_fn(
        rows: usize,
        columns: usize,
        entry: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let mut blocks = Vec::with_capacity(rows.div_ceil(BLOCK) * columns);
        for first in (0..rows).step_by(BLOCK) {
            for j in 0..columns {
                blocks.push(std::array::from_fn(|i| {
                    if first + i < rows {
                        entry(first + i, j)
                    } else {
                        0.0
                    }
                }));
            }
        }
        Self {
            rows,
            columns,
            blocks,
        }
    }

    /// y = K w; `w` must have one value per column, `y` one per row.
    #[inline]
    pub(crate) fn apply(&self, w: &[f64], y: &mut [f64]) {
        self.apply_first(self.rows, w, y);
    }

    /// As [`Self::apply`], the first `rows` rows alone.
    pub(crate) fn apply_first(&self, rows: usize, w: &[f64], y: &mut [f64]) {
        let w = &w[..self.columns];
        if self.columns == 0 {
            y[..rows].fill(0.0);
            return;
        }
        let (full, tail) = y[..rows].as_chunks_mut::<BLOCK>();
        let mut blocks = &self.blocks[..];
        for out in full {
            let (block, rest) = blocks.split_at(self.columns);
            *out = product(block, w);
            blocks = rest;
        }
        if !tail.is_empty() {
            let sums = product(blocks, w);
            for (out, sum) in tail.iter_mut().zip(sums) {
                *out = sum;
            }
        }
    }
}

/// Four rows times w.
#[inline]
fn product(block: &[[f64; BLOCK]], w: &[f64]) -> [f64; BLOCK] {
    let mut sums = [0.0; BLOCK];
    for (column, &value) in block.iter().zip(w) {
        for (sum, &k) in sums.iter_mut().zip(column) {
            *sum += k * value;
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn equals_the_dense_product(rows in 0_usize..13, columns in 0_usize..9, seed in any::<u32>()) {
            let value = |i: usize| (((i as f64 + 1.3) * f64::from(seed)).sin() * 10.0).round();
            let matrix = DMatrix::from_fn(rows, columns, |i, j| value(i * 31 + j));
            let w = DVector::from_fn(columns, |i, _| value(i + 1000));
            let mut y = vec![f64::NAN; rows];
            Kernel::new(&matrix).apply(w.as_slice(), &mut y);
            let expected = matrix * w;
            prop_assert_eq!(y.as_slice(), expected.as_slice());
        }
    }
}
