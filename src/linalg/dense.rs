//! Dense matrices of the sizes of circuits. Products of general-purpose libraries spend more on packing small ones than on multiplying
//! them; large ones are left to nalgebra.

use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, Dyn};

/// Rows computed together: four independent accumulators keep the adders of any x86-64 or ARM64 core busy.
pub(crate) const BLOCK: usize = 4;
/// Blocks in a column from which on packing pays.
const LARGE: usize = 16;
/// Rows computed together.
pub(crate) type Block = [f64; BLOCK];

/// A matrix in blocks of four rows, column by column; rows beyond the last are zero.
#[derive(Debug, Clone, Default)]
pub(crate) struct Dense {
    rows: usize,
    columns: usize,
    /// Blocks in a column.
    blocks: usize,
    data: Vec<Block>,
}

impl Dense {
    pub(crate) fn zeros(rows: usize, columns: usize) -> Self {
        let blocks = rows.div_ceil(BLOCK);
        Self {
            rows,
            columns,
            blocks,
            data: vec![[0.0; BLOCK]; blocks * columns],
        }
    }

    pub(crate) fn from_fn(
        rows: usize,
        columns: usize,
        entry: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let mut dense = Self::zeros(rows, columns);
        for j in 0..columns {
            for (i, out) in dense.column_mut(j).iter_mut().enumerate() {
                *out = entry(i, j);
            }
        }
        dense
    }

    pub(crate) fn of(matrix: &DMatrix<f64>) -> Self {
        Self::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)])
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    pub(crate) fn column(&self, j: usize) -> &[f64] {
        let column = &self.data[j * self.blocks..(j + 1) * self.blocks];
        &column.as_flattened()[..self.rows]
    }

    /// Rows 4k to 4k + 3 of column j, zeros beyond the last.
    pub(crate) fn block(&self, k: usize, j: usize) -> &Block {
        &self.data[j * self.blocks + k]
    }

    pub(crate) fn column_mut(&mut self, j: usize) -> &mut [f64] {
        let column = &mut self.data[j * self.blocks..(j + 1) * self.blocks];
        &mut column.as_flattened_mut()[..self.rows]
    }

    /// self ← a b, all of matching sizes.
    pub(crate) fn set_product(&mut self, a: &Self, b: &Self) {
        debug_assert_eq!((self.rows, self.columns), (a.rows, b.columns));
        debug_assert_eq!(a.columns, b.rows);
        match a.blocks {
            0 => {}
            1 => self.set_product_in::<1>(a, b),
            2 => self.set_product_in::<2>(a, b),
            3 => self.set_product_in::<3>(a, b),
            4 => self.set_product_in::<4>(a, b),
            blocks if blocks >= LARGE && b.is_full() => {
                let (rows, columns, stride) = (self.rows, self.columns, blocks * BLOCK);
                let out = self.data.as_flattened_mut();
                DMatrixViewMut::from_slice_with_strides_mut(out, rows, columns, 1, stride).gemm(
                    1.0,
                    &a.view(),
                    &b.view(),
                    0.0,
                );
            }
            blocks => {
                self.data.fill([0.0; BLOCK]);
                for (j, out) in self.data.chunks_exact_mut(blocks).enumerate() {
                    for (column, &factor) in a.data.chunks_exact(blocks).zip(b.column(j)) {
                        // Large systems are sparse.
                        if factor == 0.0 {
                            continue;
                        }
                        for (s, a) in out.as_flattened_mut().iter_mut().zip(column.as_flattened()) {
                            *s += a * factor;
                        }
                    }
                }
            }
        }
    }

    /// Whether few entries are zero: those of large systems are at first.
    fn is_full(&self) -> bool {
        let zeros = self.entries().iter().filter(|v| **v == 0.0).count();
        4 * zeros < self.entries().len()
    }

    fn view(&self) -> DMatrixView<'_, f64, Dyn, Dyn> {
        let stride = self.blocks * BLOCK;
        DMatrixView::from_slice_with_strides(self.entries(), self.rows, self.columns, 1, stride)
    }

    /// The product where a column has `B` blocks: its sums stay in registers.
    fn set_product_in<const B: usize>(&mut self, a: &Self, b: &Self) {
        let (columns, _) = a.data.as_chunks::<B>();
        let (outs, _) = self.data.as_chunks_mut::<B>();
        for (j, out) in outs.iter_mut().enumerate() {
            let mut sums = [[0.0; BLOCK]; B];
            for (column, &factor) in columns.iter().zip(b.column(j)) {
                for (sum, block) in sums.iter_mut().zip(column) {
                    for (s, a) in sum.iter_mut().zip(block) {
                        *s += a * factor;
                    }
                }
            }
            *out = sums;
        }
    }

    /// self ← aᵀ, of matching size.
    pub(crate) fn set_transposed(&mut self, a: &Self) {
        for i in 0..self.rows {
            let (block, lane) = (i / BLOCK, i % BLOCK);
            let rows = self.data.iter_mut().skip(block);
            let rows = rows.step_by(self.blocks.max(1));
            for (out, value) in rows.zip(a.column(i)) {
                out[lane] = *value;
            }
        }
    }

    /// self ← factor (a + aᵀ), square and of matching size.
    pub(crate) fn set_symmetric(&mut self, factor: f64, a: &Self) {
        self.set_transposed(a);
        self.combine(factor, factor, a);
    }

    /// self ← self · scale + other · factor.
    pub(crate) fn combine(&mut self, scale: f64, factor: f64, other: &Self) {
        let theirs = other.data.as_flattened();
        for (a, b) in self.data.as_flattened_mut().iter_mut().zip(theirs) {
            *a = *a * scale + b * factor;
        }
    }

    /// self ← self + other, of matching size.
    pub(crate) fn add(&mut self, other: &Self) {
        let theirs = other.data.as_flattened();
        for (a, b) in self.data.as_flattened_mut().iter_mut().zip(theirs) {
            *a += b;
        }
    }

    /// Every entry, zeros beyond the last row included.
    fn entries(&self) -> &[f64] {
        self.data.as_flattened()
    }

    /// Largest absolute entry.
    pub(crate) fn amax(&self) -> f64 {
        self.entries().iter().fold(0.0, |m, v| v.abs().max(m))
    }

    /// Largest absolute column sum.
    pub(crate) fn norm_1(&self) -> f64 {
        (0..self.columns)
            .map(|j| self.column(j).iter().map(|v| v.abs()).sum::<f64>())
            .fold(0.0, f64::max)
    }

    /// Adds to the diagonal.
    pub(crate) fn shift(&mut self, by: f64) {
        for j in 0..self.columns.min(self.rows) {
            self.column_mut(j)[j] += by;
        }
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.entries().iter().all(|v| v.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn random(rows: usize, columns: usize, seed: u32) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |i, j| {
            (((i * 31 + j) as f64 + 1.3) * f64::from(seed)).sin() * 10.0
        })
        .map(f64::round)
    }

    fn matrix(dense: &Dense) -> DMatrix<f64> {
        DMatrix::from_fn(dense.rows(), dense.columns(), |i, j| dense.column(j)[i])
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))), ..ProptestConfig::default() })]
        #[test]
        fn products_are_those_of_matrices(m in prop_oneof![0_usize..20, 60_usize..70], k in 0_usize..10, n in 0_usize..10, seed in any::<u32>()) {
            let (a, b) = (random(m, k, seed), random(k, n, seed ^ 77));
            let mut product = Dense::zeros(m, n);
            product.set_product(&Dense::of(&a), &Dense::of(&b));
            prop_assert_eq!(matrix(&product), &a * &b);
            let mut transposed = Dense::zeros(k, m);
            transposed.set_transposed(&Dense::of(&a));
            prop_assert_eq!(matrix(&transposed), a.transpose());
            product.combine(2.0, -3.0, &product.clone());
            prop_assert_eq!(matrix(&product), -(a * b));
        }
    }

    #[test]
    fn sizes_and_shifts() {
        let mut dense = Dense::of(&DMatrix::from_row_slice(2, 2, &[1.0, -2.0, -5.0, 1.5]));
        assert_eq!((dense.amax(), dense.norm_1()), (5.0, 6.0));
        dense.shift(-1.0);
        assert_eq!(dense.column(1), [-2.0, 0.5]);
        dense.column_mut(0)[1] = f64::NAN;
        assert!(!dense.is_finite());
    }
}
