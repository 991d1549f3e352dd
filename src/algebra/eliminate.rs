//! Gauss–Jordan elimination with pivots taken in the order of columns that the caller names.

use super::Field;

/// A dense row-major matrix over a field.
#[derive(Debug, Clone)]
pub struct Matrix<F> {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub cols: usize,
    data: Vec<F>,
}

impl<F: Field> Matrix<F> {
    /// All zeros.
    #[must_use]
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Self {
            rows,
            cols,
            data: vec![F::zero(); rows * cols],
        }
    }

    /// The entry in row `i`, column `j`.
    #[must_use]
    pub fn at(&self, i: usize, j: usize) -> &F {
        &self.data[i * self.cols + j]
    }

    /// Replaces an entry.
    pub fn set(&mut self, i: usize, j: usize, value: F) {
        self.data[i * self.cols + j] = value;
    }

    /// Adds to an entry.
    pub fn add_to(&mut self, i: usize, j: usize, value: &F) {
        let k = i * self.cols + j;
        self.data[k] = self.data[k].add(value);
    }

    /// Row `i`.
    #[must_use]
    pub fn row(&self, i: usize) -> &[F] {
        &self.data[i * self.cols..(i + 1) * self.cols]
    }
}

/// Brings `m` to reduced form: each column of `order`, in turn, gets a pivot if an unused row has a nonzero entry in it.
///
/// Returns the pivot row of every column (`None` where the column stayed free or was not in `order`). Afterwards a pivot
/// column is a unit vector. Among the candidates the row with the entry largest relative to its row is taken, the first
/// one on ties, so the result depends on the input alone. Only the first `candidates` rows can hold a pivot; the rows
/// below are carried along.
pub fn eliminate<F: Field>(
    m: &mut Matrix<F>,
    candidates: usize,
    order: impl IntoIterator<Item = usize>,
) -> Vec<Option<usize>> {
    let order: Vec<usize> = order.into_iter().collect();
    let mut pivot_row = vec![None; m.cols];
    eliminate_more(
        m,
        candidates,
        &order,
        &mut pivot_row,
        &mut vec![false; candidates],
    );
    pivot_row
}

/// Continues an elimination with further columns; `used` marks the rows that hold a pivot already.
pub fn eliminate_more<F: Field>(
    m: &mut Matrix<F>,
    candidates: usize,
    order: &[usize],
    pivot_row: &mut [Option<usize>],
    used: &mut [bool],
) {
    let scale: Vec<f64> = (0..m.rows)
        .map(|i| {
            m.row(i)
                .iter()
                .map(|v| v.to_f64().abs())
                .fold(f64::MIN_POSITIVE, f64::max)
        })
        .collect();
    for &j in order {
        let mut best: Option<(usize, f64)> = None;
        for i in (0..candidates).filter(|&i| !used[i]) {
            let entry = m.at(i, j);
            if !entry.is_zero() {
                let weight = entry.to_f64().abs() / scale[i];
                if best.is_none_or(|(_, w)| weight > w) {
                    best = Some((i, weight));
                }
            }
        }
        let Some((p, _)) = best else { continue };
        used[p] = true;
        pivot_row[j] = Some(p);
        let pivot = m.at(p, j).clone();
        let row: Vec<(usize, F)> = (0..m.cols)
            .filter(|&k| k != j && !m.at(p, k).is_zero())
            .map(|k| (k, m.at(p, k).div(&pivot)))
            .collect();
        m.set(p, j, F::one());
        for (k, v) in &row {
            m.set(p, *k, v.clone());
        }
        for i in (0..m.rows).filter(|&i| i != p) {
            let factor = m.at(i, j).clone();
            if factor.is_zero() {
                continue;
            }
            for (k, v) in &row {
                let value = m.at(i, *k).sub(&factor.mul(v));
                m.set(i, *k, value);
            }
            m.set(i, j, F::zero());
        }
    }
}
