//! Products of small matrices and vectors, whose columns are contiguous: nalgebra takes any strides, and one entry at a time.

use nalgebra::{DMatrix, DVector};

/// Columns that are added together: each value of y is loaded and stored once for all of them.
const TOGETHER: usize = 4;

/// y ← y + A x, y and x as long as A has rows and columns.
pub(crate) fn add_product(y: &mut [f64], a: &DMatrix<f64>, x: &[f64]) {
    debug_assert_eq!(a.shape(), (y.len(), x.len()));
    let rows = y.len();
    if rows == 0 {
        return;
    }
    let (fours, rest) = x.as_chunks::<TOGETHER>();
    let mut blocks = a.as_slice().chunks_exact(TOGETHER * rows);
    for (x, block) in fours.iter().zip(&mut blocks) {
        if x.iter().all(|x| *x == 0.0) {
            continue;
        }
        let (left, right) = block.split_at(2 * rows);
        let columns = left.split_at(rows);
        let others = right.split_at(rows);
        let columns = columns.0.iter().zip(columns.1);
        let others = others.0.iter().zip(others.1);
        for (y, ((a, b), (c, d))) in y.iter_mut().zip(columns.zip(others)) {
            *y += (a * x[0] + b * x[1]) + (c * x[2] + d * x[3]);
        }
    }
    for (x, column) in rest.iter().zip(blocks.remainder().chunks_exact(rows)) {
        for (y, a) in y.iter_mut().zip(column) {
            *y += a * x;
        }
    }
}

/// A x.
pub(crate) fn product(a: &DMatrix<f64>, x: &DVector<f64>) -> DVector<f64> {
    let mut y = DVector::zeros(a.nrows());
    add_product(y.as_mut_slice(), a, x.as_slice());
    y
}

/// A ← A + y xᵀ, y and x as long as A has rows and columns.
pub(crate) fn add_outer(a: &mut DMatrix<f64>, y: &[f64], x: &[f64]) {
    debug_assert_eq!(a.shape(), (y.len(), x.len()));
    if y.is_empty() {
        return;
    }
    for (column, x) in a.as_mut_slice().chunks_exact_mut(y.len()).zip(x) {
        for (a, y) in column.iter_mut().zip(y) {
            *a += y * x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_nalgebra() {
        for (rows, columns) in [(0, 3), (3, 0), (1, 1), (5, 4), (7, 6), (4, 9)] {
            let a = DMatrix::from_fn(rows, columns, |i, j| ((3 * i + 7 * j) % 11) as f64);
            let x = DVector::from_fn(columns, |j, _| j as f64 - 2.0);
            let mut y = DVector::from_element(rows, 1.0);
            let sum = &y + &a * &x;
            add_product(y.as_mut_slice(), &a, x.as_slice());
            assert_eq!(y, sum);
            assert_eq!(product(&a, &x), &a * &x);
            let (mut outer, sum) = (a.clone(), &a + &y * x.transpose());
            add_outer(&mut outer, y.as_slice(), x.as_slice());
            assert_eq!(outer, sum);
        }
    }
}
