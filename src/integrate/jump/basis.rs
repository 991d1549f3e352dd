//! Directions of impulses: kernels with coordinates that are components, and what bounds leave of them.

use nalgebra::{DMatrix, RowDVector};

use super::Ends;
use crate::linalg::blocks::extreme_eigenvalues;
use crate::settings::tolerances::ranks::{EIGENVALUE, ENTRY};

/// A basis of the kernel of S ⪰ 0 (entries near 1), by elimination on its diagonal: column j has 1 in a row of its own, so that
/// coordinates are components. What falls below rounding is zero, else noise would pass for a constraint.
pub(super) fn kernel(mut s: DMatrix<f64>) -> DMatrix<f64> {
    let m = s.nrows();
    let zero = ENTRY * s.amax();
    let mut free: Vec<usize> = (0..m).collect();
    while let Some(&i) = free
        .iter()
        .filter(|&&i| s[(i, i)] > zero)
        .max_by(|&&a, &&b| s[(a, a)].total_cmp(&s[(b, b)]))
    {
        free.retain(|&other| other != i);
        let row = s.row(i) / s[(i, i)];
        let column = s.column(i).into_owned();
        let concerned = |v: &[f64]| -> Vec<usize> {
            let entries = v.iter().enumerate();
            entries
                .filter(|(_, v)| **v != 0.0)
                .map(|(k, _)| k)
                .collect()
        };
        let below = concerned(column.as_slice());
        for j in concerned(row.transpose().as_slice()) {
            for &i in &below {
                let left = s[(i, j)] - column[i] * row[j];
                s[(i, j)] = if left.abs() <= zero { 0.0 } else { left };
            }
        }
        s.set_row(i, &row);
    }
    let mut n = -s.select_columns(&free);
    for (j, &f) in free.iter().enumerate() {
        n.set_row(f, &RowDVector::zeros(free.len()));
        n[(f, j)] = 1.0;
    }
    n
}

/// The columns of N without impulses that Q has not, and the rows of [N; DN] that z ≥ 0 does not imply.
pub(super) fn reduced(
    mut kernel: DMatrix<f64>,
    d: &DMatrix<f64>,
    ends: &[Ends],
) -> (DMatrix<f64>, DMatrix<f64>) {
    let through = |kernel: &DMatrix<f64>, bounded: bool| {
        let rows: Vec<usize> = (0..ends.len())
            .filter(|&j| ends[j].lambda.is_some() == bounded)
            .collect();
        (d.select_rows(&rows) * kernel).map(|v| if v.abs() < ENTRY { 0.0 } else { v })
    };
    let equations = through(&kernel, false);
    if equations.amax() > 0.0 {
        kernel *= null(equations);
    }
    let feed = through(&kernel, true);
    let mut columns: Vec<usize> = (0..kernel.ncols()).collect();
    let rows: Vec<_> = kernel.row_iter().chain(feed.row_iter()).collect();
    loop {
        // A row without positive entries allows only zeros where it is negative.
        let held = columns.iter().copied().find(|&j| {
            rows.iter()
                .any(|row| row[j] < 0.0 && columns.iter().all(|&i| row[i] <= 0.0))
        });
        match held {
            Some(j) => columns.retain(|&other| other != j),
            None => break,
        }
    }
    let open: Vec<_> = rows
        .iter()
        .filter(|row| columns.iter().any(|&j| row[j] < 0.0))
        .collect();
    let v = DMatrix::from_fn(open.len(), columns.len(), |i, j| open[i][columns[j]]);
    (kernel.select_columns(&columns), v)
}

/// A basis of the kernel of E (entries near 1), by elimination with complete pivoting: column j has 1 in a row of its own.
pub(super) fn null(mut e: DMatrix<f64>) -> DMatrix<f64> {
    let m = e.ncols();
    let zero = ENTRY * e.amax();
    let mut free: Vec<usize> = (0..m).collect();
    let mut open: Vec<usize> = (0..e.nrows()).collect();
    let mut pivots = Vec::new();
    loop {
        let entries = open.iter().flat_map(|&i| free.iter().map(move |&j| (i, j)));
        let largest = entries.max_by(|&a, &b| e[a].abs().total_cmp(&e[b].abs()));
        let Some((i, j)) = largest.filter(|&at| e[at].abs() > zero) else {
            break;
        };
        let row = e.row(i) / e[(i, j)];
        let column = e.column(j).into_owned();
        e -= column * &row;
        e.set_row(i, &row);
        open.retain(|&other| other != i);
        free.retain(|&other| other != j);
        pivots.push((i, j));
    }
    let mut n = DMatrix::zeros(m, free.len());
    for (k, &f) in free.iter().enumerate() {
        n[(f, k)] = 1.0;
        for &(i, j) in &pivots {
            n[(j, k)] = -e[(i, f)];
        }
    }
    n
}

pub(super) fn is_semidefinite(symmetric: &DMatrix<f64>) -> bool {
    let [least, largest] = extreme_eigenvalues(symmetric);
    least >= -EIGENVALUE * largest.max(-least)
}

/// |D| with the rows and columns that are zero taken from CB.
pub(super) fn levelled(d: &DMatrix<f64>, cb: &DMatrix<f64>) -> DMatrix<f64> {
    let m = d.nrows();
    let empty = |j: usize| d.row(j).amax() == 0.0 && d.column(j).amax() == 0.0;
    let empty: Vec<bool> = (0..m).map(empty).collect();
    DMatrix::from_fn(m, m, |i, j| {
        if empty[i] && empty[j] {
            cb[(i, j)]
        } else {
            d[(i, j)]
        }
    })
}
