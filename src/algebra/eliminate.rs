//! Dense matrices and Gauss–Jordan elimination in a given order of columns.

use super::Field;

/// A matrix over a field, row by row.
#[derive(Debug, Clone)]
pub struct Matrix<F> {
    rows: usize,
    cols: usize,
    data: Vec<F>,
}

/// What an elimination has found so far.
#[derive(Debug, Clone)]
pub struct Elimination {
    /// Number of rows that may hold pivots: the first ones; the rows below are only rewritten.
    pub equations: usize,
    /// For each column the row of its pivot, if it depends on the others.
    pub pivot: Vec<Option<usize>>,
    /// For each equation whether it holds a pivot.
    pub used: Vec<bool>,
}

impl Elimination {
    /// Nothing eliminated yet.
    #[must_use]
    pub fn new(equations: usize, columns: usize) -> Self {
        Self {
            equations,
            pivot: vec![None; columns],
            used: vec![false; equations],
        }
    }
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

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    #[must_use]
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// A row.
    #[must_use]
    pub fn row(&self, row: usize) -> &[F] {
        &self.data[row * self.cols..(row + 1) * self.cols]
    }

    /// A row, to write.
    pub fn row_mut(&mut self, row: usize) -> &mut [F] {
        &mut self.data[row * self.cols..(row + 1) * self.cols]
    }

    /// An entry.
    #[must_use]
    pub fn at(&self, row: usize, col: usize) -> &F {
        &self.data[row * self.cols + col]
    }

    /// An entry, to write.
    pub fn at_mut(&mut self, row: usize, col: usize) -> &mut F {
        &mut self.data[row * self.cols + col]
    }

    /// Replaces an entry.
    pub fn set(&mut self, row: usize, col: usize, value: F) {
        self.data[row * self.cols + col] = value;
    }

    /// Appends a row of the matrix's width.
    pub fn push_row(&mut self, row: &[F]) {
        assert_eq!(row.len(), self.cols, "a row of another width");
        self.data.extend_from_slice(row);
        self.rows += 1;
    }

    /// Gives `column` a pivot if an unused equation has a nonzero entry there, and clears it from all other rows.
    ///
    /// Among the candidates the entry largest relative to its row is taken, the first of equals. Returns whether a
    /// pivot was found. An elimination over columns in class order makes each class depend on later ones as
    /// far as the equations allow.
    pub fn eliminate(&mut self, column: usize, state: &mut Elimination) -> bool {
        let free = |row: &usize| !state.used[*row] && !self.at(*row, column).is_zero();
        let mut candidates = (0..state.equations).filter(free);
        let (first, second) = (candidates.next(), candidates.next());
        let relative = |row: usize| {
            let sizes = self.row(row).iter().map(|x| x.to_f64().abs());
            self.at(row, column).to_f64().abs() / sizes.fold(0.0, f64::max)
        };
        let mut best = first.map(|row| (row, 0.0));
        if let (Some((row, size)), Some(_)) = (&mut best, second) {
            *size = relative(*row);
            for other in second.into_iter().chain(candidates) {
                let its = relative(other);
                if its > *size {
                    (*row, *size) = (other, its);
                }
            }
        }
        let Some((row, _)) = best else { return false };
        state.used[row] = true;
        state.pivot[column] = Some(row);
        self.pivot(row, column);
        true
    }

    /// Gives the equation of `leaving`, which has a pivot, to `entering`, which has none and a nonzero entry there; returns whether that is so.
    pub fn exchange(&mut self, leaving: usize, entering: usize, state: &mut Elimination) -> bool {
        let Some(row) = state.pivot[leaving] else {
            return false;
        };
        if state.pivot[entering].is_some() || self.at(row, entering).is_zero() {
            return false;
        }
        state.pivot[leaving] = None;
        state.pivot[entering] = Some(row);
        self.pivot(row, entering);
        true
    }

    /// Scales `row` to 1 in `column` and subtracts it from every other row so that they are 0 there.
    fn pivot(&mut self, row: usize, column: usize) {
        let inverse = F::one().div(self.at(row, column));
        let mut pivot_row = Vec::with_capacity(self.cols);
        for (c, x) in self.row_mut(row).iter_mut().enumerate() {
            if c == column {
                *x = F::one();
            } else if !x.is_zero() {
                *x = x.mul(&inverse);
                pivot_row.push((c, x.clone()));
            }
        }
        for r in (0..self.rows).filter(|&r| r != row) {
            let target = self.row_mut(r);
            if target[column].is_zero() {
                continue;
            }
            let factor = std::mem::replace(&mut target[column], F::zero());
            for (c, x) in &pivot_row {
                target[*c].sub_mul(&factor, x);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::{Ball, Rational, rational};
    use super::*;

    fn eliminate_all<F: Field>(
        entries: &[Vec<Rational>],
        number: impl Fn(&Rational) -> F + Copy,
    ) -> (Matrix<F>, Elimination) {
        let cols = entries[0].len();
        let mut table = Matrix::zeros(0, cols);
        for row in entries {
            table.push_row(&row.iter().map(number).collect::<Vec<_>>());
        }
        let mut state = Elimination::new(entries.len(), cols);
        for c in 0..cols {
            table.eliminate(c, &mut state);
        }
        (table, state)
    }

    #[test]
    fn a_dependent_row_gets_no_pivot() {
        let rows = [[1.0, 2.0, 3.0], [0.1, 0.2, 0.3], [0.0, 1.0, 1.0]];
        let exact: Vec<Vec<Rational>> = vec![
            rows[0].iter().map(|&x| rational(x)).collect(),
            rows[0]
                .iter()
                .map(|&x| rational(x) * rational(0.1))
                .collect(),
            rows[2].iter().map(|&x| rational(x)).collect(),
        ];
        let (m, state) = eliminate_all(&exact, Ball::from_rational);
        assert_eq!(state.pivot.iter().flatten().count(), 2);
        assert_eq!(state.pivot[2], None);
        // x0 = −1 x2, x1 = −1 x2
        assert_eq!(m.at(state.pivot[0].unwrap(), 2).to_f64(), 1.0);
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))), ..Default::default() })]
        #[test]
        fn balls_find_the_ranks_and_entries_of_rationals(
            entries in prop::collection::vec((-3i64..4, -15i32..13), 30),
            copies in prop::collection::vec((0usize..5, 0usize..5, -2i64..3), 2),
        ) {
            let number = |&(n, e): &(i64, i32)| super::super::Value::decimal(0.0, n.into(), e).exact();
            let mut rows: Vec<Vec<Rational>> = entries.chunks(6).map(|r| r.iter().map(number).collect()).collect();
            for (from, to, k) in copies {
                rows[to] = rows[from].iter().map(|x| x * Rational::from_integer(k.into())).collect();
            }
            let (ball, found) = eliminate_all(&rows, Ball::from_rational);
            let (exact, truth) = eliminate_all(&rows, Rational::clone);
            prop_assert_eq!(found.pivot.iter().map(Option::is_some).collect::<Vec<_>>(),
                            truth.pivot.iter().map(Option::is_some).collect::<Vec<_>>());
            for c in 0..6 {
                let (Some(r), Some(s)) = (found.pivot[c], truth.pivot[c]) else { continue };
                for k in 0..6 {
                    let (x, y) = (ball.at(r, k), exact.at(s, k));
                    prop_assert_eq!(x.is_zero(), Field::is_zero(y));
                    if x.is_precise() && !x.is_zero() {
                        let y = Field::to_f64(y);
                        prop_assert!((x.to_f64() - y).abs() <= 2e-14 * y.abs());
                    }
                }
            }
        }
    }
}
