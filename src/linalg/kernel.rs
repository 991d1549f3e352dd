//! The matrix-vector product of the step loop.

use nalgebra::DMatrix;

use super::dense::{BLOCK, Block, Dense};

/// A dense matrix in blocks of four rows, each block column by column, for y = K w without allocation.
#[derive(Debug, Clone, Default)]
pub(crate) struct Kernel {
    rows: usize,
    columns: usize,
    blocks: Vec<Block>,
}

impl Kernel {
    /// Repacks a matrix.
    pub(crate) fn new(matrix: &DMatrix<f64>) -> Self {
        let mut kernel = Self::zeros(matrix.nrows(), matrix.ncols());
        for (j, column) in matrix.column_iter().enumerate() {
            kernel.set_column(j, column.as_slice());
        }
        kernel
    }

    /// Repacks a matrix.
    pub(crate) fn of(matrix: &Dense) -> Self {
        let mut kernel = Self::zeros(matrix.rows(), matrix.columns());
        for j in 0..matrix.columns() {
            kernel.set_column(j, matrix.column(j));
        }
        kernel
    }

    /// Of so many rows and columns, each filled in by its number.
    pub(crate) fn of_columns(
        rows: usize,
        columns: usize,
        mut fill: impl FnMut(usize, &mut [f64]),
    ) -> Self {
        let (mut kernel, mut column) = (Self::zeros(rows, columns), vec![0.0; rows]);
        for j in 0..columns {
            fill(j, &mut column);
            kernel.set_column(j, &column);
        }
        kernel
    }

    fn zeros(rows: usize, columns: usize) -> Self {
        Self {
            rows,
            columns,
            blocks: vec![[0.0; BLOCK]; rows.div_ceil(BLOCK) * columns],
        }
    }

    /// The entries of column j.
    fn set_column(&mut self, j: usize, values: &[f64]) {
        let (blocks, last) = values.as_chunks::<BLOCK>();
        for (k, block) in blocks.iter().enumerate() {
            self.blocks[k * self.columns + j] = *block;
        }
        if !last.is_empty() {
            self.blocks[blocks.len() * self.columns + j][..last.len()].copy_from_slice(last);
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
            put(product(blocks, w), tail);
        }
    }
}

/// A matrix with many zeros, whose blocks of four rows and one column are left out where they are zero.
#[derive(Debug, Clone, Default)]
pub(crate) struct SparseKernel {
    rows: usize,
    /// By block of rows: where its blocks end.
    ends: Vec<usize>,
    /// (column, entries).
    blocks: Vec<(usize, Block)>,
}

impl SparseKernel {
    /// Repacks a matrix.
    pub(crate) fn new(matrix: &DMatrix<f64>) -> Self {
        let dense = Kernel::new(matrix);
        let mut sparse = Self {
            rows: dense.rows,
            ends: Vec::with_capacity(dense.rows.div_ceil(BLOCK)),
            blocks: Vec::with_capacity(dense.blocks.len()),
        };
        for k in 0..dense.rows.div_ceil(BLOCK) {
            let rows = &dense.blocks[k * dense.columns..(k + 1) * dense.columns];
            let blocks = rows.iter().copied().enumerate();
            sparse
                .blocks
                .extend(blocks.filter(|(_, block)| *block != [0.0; BLOCK]));
            sparse.ends.push(sparse.blocks.len());
        }
        sparse
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// Every entry through `f`, which leaves zero as it is.
    pub(crate) fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        let blocks = self.blocks.iter();
        Self {
            rows: self.rows,
            ends: self.ends.clone(),
            blocks: blocks.map(|(c, block)| (*c, block.map(&f))).collect(),
        }
    }

    /// y = K w, the first rows as far as y reaches.
    #[inline]
    pub(crate) fn apply_first(&self, w: &[f64], y: &mut [f64]) {
        let (full, tail) = y.as_chunks_mut::<BLOCK>();
        self.apply(w, full);
        if !tail.is_empty() {
            let begin = full.len().checked_sub(1).map_or(0, |k| self.ends[k]);
            let sums = sparse_product(&self.blocks[begin..self.ends[full.len()]], w);
            put(sums, tail);
        }
    }

    /// y = K w in whole blocks, zeros behind the last row.
    #[inline]
    pub(crate) fn apply(&self, w: &[f64], y: &mut [Block]) {
        let mut begin = 0;
        for (&end, y) in self.ends.iter().zip(y) {
            *y = sparse_product(&self.blocks[begin..end], w);
            begin = end;
        }
    }
}

/// The first sums, fewer than four: copied in a loop they would be put into memory and fetched again by a call.
#[inline]
fn put([a, b, c, _]: Block, to: &mut [f64]) {
    match to {
        [x] => *x = a,
        [x, y] => (*x, *y) = (a, b),
        [x, y, z] => (*x, *y, *z) = (a, b, c),
        _ => {}
    }
}

/// Four rows times w.
#[inline]
fn sparse_product(blocks: &[(usize, Block)], w: &[f64]) -> Block {
    let mut sums = [0.0; BLOCK];
    for (column, block) in blocks {
        let value = w[*column];
        for (sum, k) in sums.iter_mut().zip(block) {
            *sum += k * value;
        }
    }
    sums
}

/// Four rows times w.
#[inline]
fn product(block: &[Block], w: &[f64]) -> Block {
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
        #![proptest_config(ProptestConfig { failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))), ..ProptestConfig::default() })]
        #[test]
        fn equals_the_dense_product(rows in 0_usize..13, columns in 0_usize..9, seed in any::<u32>()) {
            let value = |i: usize| (((i as f64 + 1.3) * f64::from(seed)).sin() * 10.0).round();
            let empty = |j: usize| (seed >> j) & 1 == 1;
            let entry = |i: usize, j: usize| if empty(j) { 0.0 } else { value(i * 31 + j) };
            let matrix = DMatrix::from_fn(rows, columns, entry);
            let w = DVector::from_fn(columns, |i, _| value(i + 1000));
            let mut y = vec![f64::NAN; rows];
            Kernel::new(&matrix).apply(w.as_slice(), &mut y);
            let expected = &matrix * &w;
            prop_assert_eq!(y.as_slice(), expected.as_slice());
            let mut blocks = vec![[f64::NAN; BLOCK]; rows.div_ceil(BLOCK)];
            SparseKernel::new(&matrix).apply(w.as_slice(), &mut blocks);
            prop_assert_eq!(&blocks.as_flattened()[..rows], expected.as_slice());
            for first in 0..=rows {
                let mut y = vec![f64::NAN; first];
                SparseKernel::new(&matrix).apply_first(w.as_slice(), &mut y);
                prop_assert_eq!(y.as_slice(), &expected.as_slice()[..first]);
            }
            Kernel::of(&Dense::of(&matrix)).apply(w.as_slice(), &mut y);
            prop_assert_eq!(y.as_slice(), expected.as_slice());
            let fill = |j: usize, column: &mut [f64]| column.copy_from_slice(matrix.column(j).as_slice());
            Kernel::of_columns(rows, columns, fill).apply(w.as_slice(), &mut y);
            prop_assert_eq!(y.as_slice(), expected.as_slice());
            SparseKernel::new(&matrix).map(|v| 2.0 * v).apply_first(w.as_slice(), &mut y);
            let twice = 2.0 * expected;
            prop_assert_eq!(y.as_slice(), twice.as_slice());
        }
    }
}
