//! Elimination on sparse rows: node potentials and internal currents, once per circuit.

use super::Field;
use crate::settings::tolerances::ranks::PIVOT_CHOICE;

/// Entries (column, value) of a row, columns increasing, no zeros.
pub type SparseRow<F> = Vec<(usize, F)>;

/// Eliminates the columns below `columns` from all rows and removes the rows that held the pivots.
///
/// Only the first `equations` rows can hold pivots; the others (readings) are rewritten. Returns the number of equations
/// left; they stay in front. The column with the fewest candidate rows goes first, which keeps the rows short (Markowitz).
/// A column that stays is zero in every equation left.
pub fn eliminate_sparse<F: Field>(
    rows: &mut Vec<SparseRow<F>>,
    equations: usize,
    columns: usize,
) -> usize {
    let mut active = vec![true; equations];
    // Rows that hold a column; entries may be stale, never missing.
    let mut holders: Vec<Vec<usize>> = vec![Vec::new(); columns];
    for (r, row) in rows.iter().enumerate() {
        for &(c, _) in row.iter().take_while(|(c, _)| *c < columns) {
            holders[c].push(r);
        }
    }
    let mut open: Vec<usize> = (0..columns).collect();
    while let Some(position) = next_column(rows, &active, &mut holders, &open) {
        let column = open.swap_remove(position);
        let Some(pivot) = pivot_row(rows, &active, &holders[column], column) else {
            continue;
        };
        active[pivot] = false;
        let pivot_entries = std::mem::take(&mut rows[pivot]);
        let Some(inverse) = entry(&pivot_entries, column).map(|x| F::one().div(x)) else {
            continue;
        };
        for r in std::mem::take(&mut holders[column]) {
            let Some(factor) = entry(&rows[r], column).map(|x| x.mul(&inverse)) else {
                continue;
            };
            let updated = subtract(&rows[r], &factor, &pivot_entries, column);
            for &(c, _) in updated.iter().take_while(|(c, _)| *c < columns) {
                if entry(&rows[r], c).is_none() {
                    holders[c].push(r);
                }
            }
            rows[r] = updated;
        }
    }
    let mut index = 0;
    rows.retain(|_| {
        index += 1;
        index > equations || active[index - 1]
    });
    active.iter().filter(|a| **a).count()
}

fn entry<F>(row: &[(usize, F)], column: usize) -> Option<&F> {
    row.binary_search_by_key(&column, |(c, _)| *c)
        .ok()
        .map(|k| &row[k].1)
}

/// The position in `open` of a column with the fewest candidate rows; `None` when no open column has any.
fn next_column<F: Field>(
    rows: &[SparseRow<F>],
    active: &[bool],
    holders: &mut [Vec<usize>],
    open: &[usize],
) -> Option<usize> {
    let mut best: Option<(usize, usize, usize)> = None;
    for (position, &column) in open.iter().enumerate() {
        // Lists are only tidied when they could win: their length bounds the count from above, not below.
        holders[column].retain(|&r| entry(&rows[r], column).is_some());
        let count = holders[column]
            .iter()
            .filter(|&&r| r < active.len() && active[r])
            .count();
        if count > 0 && best.is_none_or(|(_, c, n)| (count, column) < (n, c)) {
            best = Some((position, column, count));
        }
        if count == 1 {
            break;
        }
    }
    best.map(|(position, ..)| position)
}

/// The shortest row among those whose entry is large enough.
fn pivot_row<F: Field>(
    rows: &[SparseRow<F>],
    active: &[bool],
    holders: &[usize],
    column: usize,
) -> Option<usize> {
    let candidates: Vec<(usize, f64)> = holders
        .iter()
        .filter(|&&r| r < active.len() && active[r])
        .filter_map(|&r| {
            let largest = rows[r]
                .iter()
                .fold(0.0, |m: f64, (_, x)| m.max(x.to_f64().abs()));
            entry(&rows[r], column).map(|x| (r, x.to_f64().abs() / largest))
        })
        .collect();
    let largest = candidates.iter().fold(0.0, |m: f64, c| m.max(c.1));
    candidates
        .into_iter()
        .filter(|c| c.1 >= PIVOT_CHOICE * largest)
        .map(|(r, _)| (rows[r].len(), r))
        .min()
        .map(|(_, r)| r)
}

/// row − factor · pivot, without `column`.
fn subtract<F: Field>(
    row: &[(usize, F)],
    factor: &F,
    pivot: &[(usize, F)],
    column: usize,
) -> SparseRow<F> {
    let minus = factor.neg();
    let mut result = Vec::with_capacity(row.len() + pivot.len());
    let (mut i, mut j) = (0, 0);
    while i < row.len() || j < pivot.len() {
        let a = row.get(i).map_or(usize::MAX, |e| e.0);
        let b = pivot.get(j).map_or(usize::MAX, |e| e.0);
        let c = a.min(b);
        let value = if a < b {
            row[i].1.clone()
        } else if b < a {
            pivot[j].1.mul(&minus)
        } else {
            let mut x = row[i].1.clone();
            x.sub_mul(factor, &pivot[j].1);
            x
        };
        i += usize::from(a == c);
        j += usize::from(b == c);
        if c != column && !value.is_zero() {
            result.push((c, value));
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::super::{Rational, rational};
    use super::*;

    #[test]
    fn a_divider_is_reduced_to_its_port() {
        // Potentials a, b (columns 0, 1), port v, i (2, 3): KCL a: i + (a − b) = 0; KCL b: (b − a) + b = 0; v = a.
        let e = |list: &[(usize, f64)]| list.iter().map(|&(c, x)| (c, rational(x))).collect();
        let mut rows: Vec<SparseRow<Rational>> = vec![
            e(&[(0, 1.0), (1, -1.0), (3, 1.0)]),
            e(&[(0, -1.0), (1, 2.0)]),
            e(&[(0, -1.0), (2, 1.0)]),
            e(&[(1, 1.0)]),
        ];
        let left = eliminate_sparse(&mut rows, 3, 2);
        assert_eq!(left, 1);
        let port = &rows[0];
        // ½ v + i = 0 up to a factor; at v = 2, i = −1 the middle of the divider is at 1.
        assert_eq!(&port[0].1 / &port[1].1, rational(0.5));
        let at = |row: &SparseRow<Rational>| {
            row.iter()
                .map(|(c, x)| x * rational([0.0, 0.0, 2.0, -1.0][*c]))
                .sum::<Rational>()
        };
        assert_eq!(at(&rows[0]), rational(0.0));
        assert_eq!(at(&rows[1]), rational(1.0));
    }
}
