//! Sparse tables and their elimination in a given order of columns.

use super::Field;
use super::sparse::{SparseRow, entry, subtract};

/// Rows over a field, without their zeros, and which rows hold a column.
#[derive(Debug, Clone)]
pub struct Table<F> {
    rows: Vec<SparseRow<F>>,
    /// By column the latest link of its chain.
    heads: Vec<Option<u32>>,
    /// Rows that hold a column, chained: a row, and the link before. Rows may hold it no more, or stand twice; none is missing.
    links: Vec<(u32, Option<u32>)>,
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
    /// The columns with pivots, in the order in which they got them.
    order: Vec<usize>,
}

impl Elimination {
    /// Nothing eliminated yet.
    #[must_use]
    pub fn new(equations: usize, columns: usize) -> Self {
        Self {
            equations,
            pivot: vec![None; columns],
            used: vec![false; equations],
            order: Vec::new(),
        }
    }
}

impl<F: Field> Table<F> {
    /// Of rows over `cols` columns.
    #[must_use]
    pub fn new(rows: Vec<SparseRow<F>>, cols: usize) -> Self {
        let mut table = Self {
            heads: vec![None; cols],
            links: Vec::with_capacity(rows.iter().map(Vec::len).sum()),
            rows,
        };
        for r in 0..table.rows.len() {
            for k in 0..table.rows[r].len() {
                table.link(table.rows[r][k].0, r);
            }
        }
        table
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// Number of columns.
    #[must_use]
    pub fn cols(&self) -> usize {
        self.heads.len()
    }

    /// A row.
    #[must_use]
    pub fn row(&self, row: usize) -> &[(usize, F)] {
        &self.rows[row]
    }

    /// An entry, where it is not zero.
    #[must_use]
    pub fn at(&self, row: usize, column: usize) -> Option<&F> {
        entry(&self.rows[row], column)
    }

    /// The rows with an entry in `column`, in order.
    #[must_use]
    pub fn holders(&self, column: usize) -> Vec<usize> {
        let mut next = self.heads[column];
        let chain = std::iter::from_fn(|| {
            let (row, before) = self.links[next? as usize];
            next = before;
            Some(row as usize)
        });
        let mut rows: Vec<usize> = chain.collect();
        rows.sort_unstable();
        rows.dedup();
        rows.retain(|&r| self.at(r, column).is_some());
        rows
    }

    fn link(&mut self, column: usize, row: usize) {
        let latest = self.links.len() as u32;
        self.links.push((row as u32, self.heads[column]));
        self.heads[column] = Some(latest);
    }

    /// Makes a column zero.
    pub fn clear(&mut self, column: usize) {
        for r in self.holders(column) {
            self.rows[r].retain(|(c, _)| *c != column);
        }
        self.heads[column] = None;
    }

    /// Adds `factor` times column `from` to column `to`, and makes `from` zero.
    pub fn fold(&mut self, from: usize, factor: &F, to: usize) {
        for r in self.holders(from) {
            let row = &mut self.rows[r];
            let Ok(at) = row.binary_search_by_key(&from, |(c, _)| *c) else {
                continue;
            };
            let moved = row.remove(at).1.mul(factor);
            if moved.is_zero() {
                continue;
            }
            match row.binary_search_by_key(&to, |(c, _)| *c) {
                Ok(at) => {
                    row[at].1 = row[at].1.add(&moved);
                    if row[at].1.is_zero() {
                        row.remove(at);
                    }
                }
                Err(at) => {
                    row.insert(at, (to, moved));
                    self.link(to, r);
                }
            }
        }
        self.heads[from] = None;
    }

    /// Gives `column` a pivot if an unused equation has a nonzero entry there, and clears it from the other unused equations; those with
    /// pivots keep it until [`Self::settle`].
    ///
    /// Among the candidates the entry largest relative to its row is taken, the first of equals. Returns whether a
    /// pivot was found. An elimination over columns in class order makes each class depend on later ones as
    /// far as the equations allow.
    pub fn eliminate(&mut self, column: usize, state: &mut Elimination) -> bool {
        let holders = self.holders(column);
        let free = |row: &usize| *row < state.equations && !state.used[*row];
        let mut candidates = holders.iter().copied().filter(free);
        let (first, second) = (candidates.next(), candidates.next());
        let relative = |row: usize| {
            let sizes = self.row(row).iter().map(|(_, x)| x.to_f64().abs());
            let size = self.at(row, column).map_or(0.0, |x| x.to_f64().abs());
            size / sizes.fold(0.0, f64::max)
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
        state.order.push(column);
        let open = holders
            .into_iter()
            .filter(|&r| r < state.equations && !state.used[r]);
        self.normalise(row, column);
        open.for_each(|r| self.clear_from(r, column, row));
        true
    }

    /// Puts pivots into each other, the latest first, so that each depends on columns without pivot alone.
    pub fn settle(&mut self, state: &Elimination) {
        for &column in state.order.iter().rev() {
            if let Some(row) = state.pivot[column] {
                self.clear_from_others(column, row);
            }
        }
    }

    /// Gives the equation of `leaving`, which has a pivot, to `entering`, which has none and a nonzero entry there; returns whether that is so.
    /// The pivots must be [settled](Self::settle); they are so afterwards.
    pub fn exchange(&mut self, leaving: usize, entering: usize, state: &mut Elimination) -> bool {
        let Some(row) = state.pivot[leaving] else {
            return false;
        };
        if state.pivot[entering].is_some() || self.at(row, entering).is_none() {
            return false;
        }
        state.pivot[leaving] = None;
        state.pivot[entering] = Some(row);
        state.order.retain(|&c| c != leaving);
        state.order.push(entering);
        self.normalise(row, entering);
        self.clear_from_others(entering, row);
        true
    }

    /// Scales `row` to 1 in `column`.
    fn normalise(&mut self, row: usize, column: usize) {
        let row = &mut self.rows[row];
        let Some(inverse) = entry(row, column).map(|x| F::one().div(x)) else {
            return;
        };
        for (c, x) in row {
            *x = if *c == column {
                F::one()
            } else {
                x.mul(&inverse)
            };
        }
    }

    /// Subtracts `row`, which is 1 in `column`, from all others that hold the column.
    fn clear_from_others(&mut self, column: usize, row: usize) {
        let holders = self.holders(column);
        for r in holders.into_iter().filter(|&r| r != row) {
            self.clear_from(r, column, row);
        }
        // No other row holds it any more.
        self.heads[column] = None;
        self.link(column, row);
    }

    /// Subtracts `row`, which is 1 in `column`, from row r so that it is 0 there.
    fn clear_from(&mut self, r: usize, column: usize, row: usize) {
        let mut filled = Vec::new();
        let target = std::mem::take(&mut self.rows[r]);
        self.rows[r] = match entry(&target, column) {
            Some(factor) => subtract(&target, factor, &self.rows[row], column, |c| {
                filled.push(c);
            }),
            None => target,
        };
        filled.into_iter().for_each(|c| self.link(c, r));
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::{Ball, Rational, rational, sparse::sparse};
    use super::*;

    fn eliminate_all<F: Field>(
        entries: &[Vec<Rational>],
        number: impl Fn(&Rational) -> F + Copy,
    ) -> (Table<F>, Elimination) {
        let cols = entries[0].len();
        let row = |row: &Vec<Rational>| sparse(row.iter().map(number));
        let mut table = Table::new(entries.iter().map(row).collect(), cols);
        let mut state = Elimination::new(entries.len(), cols);
        for c in 0..cols {
            table.eliminate(c, &mut state);
        }
        table.settle(&state);
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
        assert_eq!(m.at(state.pivot[0].unwrap(), 2).unwrap().to_f64(), 1.0);
    }

    #[test]
    fn a_pivot_goes_to_a_column_that_is_free_and_depends_on_it() {
        // x0 + 2 x2 = 0, x1 + 3 x3 = 0.
        let rows = [[1.0, 0.0, 2.0, 0.0], [0.0, 1.0, 0.0, 3.0]];
        let exact: Vec<Vec<Rational>> = rows
            .iter()
            .map(|row| row.iter().map(|&x| rational(x)).collect())
            .collect();
        let (mut m, mut state) = eliminate_all(&exact, Rational::clone);
        let before = state.pivot.clone();
        for (leaving, entering) in [(0, 1), (0, 3), (2, 0)] {
            assert!(
                !m.exchange(leaving, entering, &mut state),
                "{leaving} {entering}"
            );
            assert_eq!(state.pivot, before);
        }
        assert!(m.exchange(0, 2, &mut state));
        assert_eq!((state.pivot[0], state.pivot[2]), (None, before[0]));
        assert_eq!(m.at(before[0].unwrap(), 0).unwrap().to_f64(), 0.5);
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
                    prop_assert_eq!(x.is_some(), y.is_some());
                    let (Some(x), Some(y)) = (x, y) else { continue };
                    if x.is_precise() {
                        let y = Field::to_f64(y);
                        prop_assert!((x.to_f64() - y).abs() <= 2e-14 * y.abs());
                    }
                }
            }
        }
    }
}
