//! Sparse rows, and the elimination of node potentials and internal currents, once per circuit.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::Field;
use crate::settings::tolerances::ranks::PIVOT_CHOICE;

/// Entries (column, value) of a row, columns increasing, no zeros.
pub type SparseRow<F> = Vec<(usize, F)>;

/// The entries that are not zero of a row written in full.
pub fn sparse<F: Field>(row: impl IntoIterator<Item = F>) -> SparseRow<F> {
    let entries = row.into_iter().enumerate();
    entries.filter(|(_, x)| !x.is_zero()).collect()
}

/// The entry of a column, where it is not zero.
#[must_use]
pub fn entry<F>(row: &[(usize, F)], column: usize) -> Option<&F> {
    row.binary_search_by_key(&column, |(c, _)| *c)
        .ok()
        .map(|k| &row[k].1)
}

/// The entries of these columns.
#[must_use]
pub fn part<F>(row: &[(usize, F)], columns: std::ops::Range<usize>) -> &[(usize, F)] {
    let from = row.partition_point(|(c, _)| *c < columns.start);
    let to = row.partition_point(|(c, _)| *c < columns.end);
    &row[from..to.max(from)]
}

/// row − factor · other, without `column`; `filled` is told of columns that only `other` holds.
#[must_use]
pub fn subtract<F: Field>(
    row: &[(usize, F)],
    factor: &F,
    other: &[(usize, F)],
    column: usize,
    mut filled: impl FnMut(usize),
) -> SparseRow<F> {
    let mut result = Vec::with_capacity(row.len() + other.len());
    let minus = factor.neg();
    let mut rest = row;
    for (c, x) in other.iter().filter(|(c, _)| *c != column) {
        let before = rest.iter().take_while(|(a, _)| a < c).count();
        push_all(&mut result, &rest[..before], column);
        rest = &rest[before..];
        if let [(a, own), after @ ..] = rest
            && a == c
        {
            let mut value = own.clone();
            value.sub_mul(factor, x);
            if !value.is_zero() {
                result.push((*c, value));
            }
            rest = after;
        } else {
            filled(*c);
            result.push((*c, x.mul(&minus)));
        }
    }
    push_all(&mut result, rest, column);
    result
}

/// Appends entries, but for that of `column`.
fn push_all<F: Field>(target: &mut SparseRow<F>, entries: &[(usize, F)], column: usize) {
    target.extend(entries.iter().filter(|(c, _)| *c != column).cloned());
}

/// A row from terms in any order, several of a column.
pub fn summed<F: Field>(mut terms: Vec<(usize, F)>) -> SparseRow<F> {
    terms.sort_by_key(|(c, _)| *c);
    terms.dedup_by(|later, kept| {
        let same = later.0 == kept.0;
        if same {
            kept.1 = kept.1.add(&later.1);
        }
        same
    });
    terms.retain(|(_, x)| !x.is_zero());
    terms
}

/// target ← target + scale · row.
pub fn add_scaled<F: Field>(target: &mut SparseRow<F>, scale: &F, row: &[(usize, F)]) {
    if target.is_empty() {
        target.extend(row.iter().map(|(c, x)| (*c, x.mul(scale))));
    } else if !row.is_empty() {
        *target = subtract(target, &scale.neg(), row, usize::MAX, |_| {});
    }
}

/// row ← row + scale · x in one column.
pub(crate) fn add_term<F: Field>(row: &mut SparseRow<F>, column: usize, scale: &F, x: &F) {
    match row.binary_search_by_key(&column, |(c, _)| *c) {
        Ok(k) => {
            row[k].1.sub_mul(&scale.neg(), x);
            if row[k].1.is_zero() {
                row.remove(k);
            }
        }
        Err(k) => row.insert(k, (column, x.mul(scale))),
    }
}

/// Eliminates the columns below `columns` from all rows and removes the rows that held the pivots.
///
/// Only the first `equations` rows can hold pivots; the others (readings) are rewritten. Returns the number of equations
/// left; they stay in front. The column with the fewest candidate rows goes first, the first of equals, which keeps the rows short
/// (Markowitz). A column that stays is zero in every equation left.
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
    // How many equations hold a column, and columns by that: entries of an older count are passed over.
    let mut counts: Vec<usize> = (holders.iter())
        .map(|list| list.iter().filter(|&&r| r < equations).count())
        .collect();
    let mut queue: BinaryHeap<Reverse<(usize, usize)>> = (counts.iter().enumerate())
        .map(|(c, &n)| Reverse((n, c)))
        .collect();
    let mut open = vec![true; columns];
    while let Some(Reverse((count, column))) = queue.pop() {
        if !open[column] || count != counts[column] || count == 0 {
            continue;
        }
        open[column] = false;
        let mut list = std::mem::take(&mut holders[column]);
        list.retain(|&r| entry(&rows[r], column).is_some());
        list.sort_unstable();
        list.dedup();
        let Some(pivot) = pivot_row(rows, &active, &list, column) else {
            continue;
        };
        active[pivot] = false;
        let pivot_entries = std::mem::take(&mut rows[pivot]);
        let Some(inverse) = entry(&pivot_entries, column).map(|x| F::one().div(x)) else {
            continue;
        };
        let mut changed: Vec<usize> = Vec::new();
        let mut recount = |c: usize, more: bool, counts: &mut Vec<usize>| {
            counts[c] = if more { counts[c] + 1 } else { counts[c] - 1 };
            changed.push(c);
        };
        let internal = |row: &[(usize, F)]| part(row, 0..columns).iter().map(|e| e.0).collect();
        let left: Vec<usize> = internal(&pivot_entries);
        left.into_iter()
            .for_each(|c| recount(c, false, &mut counts));
        for r in list.into_iter().filter(|&r| r != pivot) {
            let Some(factor) = entry(&rows[r], column).map(|x| x.mul(&inverse)) else {
                continue;
            };
            let counted = r < equations;
            let before: Vec<usize> = if counted {
                internal(&rows[r])
            } else {
                Vec::new()
            };
            rows[r] = subtract(&rows[r], &factor, &pivot_entries, column, |c| {
                if c < columns {
                    holders[c].push(r);
                    if counted {
                        recount(c, true, &mut counts);
                    }
                }
            });
            for c in before {
                if entry(&rows[r], c).is_none() {
                    recount(c, false, &mut counts);
                }
            }
        }
        changed.sort_unstable();
        changed.dedup();
        queue.extend(
            changed
                .into_iter()
                .filter(|&c| open[c])
                .map(|c| Reverse((counts[c], c))),
        );
    }
    let mut index = 0;
    rows.retain(|_| {
        index += 1;
        index > equations || active[index - 1]
    });
    active.iter().filter(|a| **a).count()
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
