//! Units out of the way: balancing of states, time and ports by powers of two, and eigenvalues in those scales.

use nalgebra::{DMatrix, DVector};

use super::System;
pub(crate) use crate::linalg::powers::equilibrate;
use crate::linalg::powers::power_of_two;
use crate::settings::tolerances::ranks::RANK;

/// Sweeps of the balancing iterations; each halves the logarithm of what is left to balance.
const SWEEPS: usize = 24;

/// A system in balanced units: x = T x̂, t̂ = ω t, λ = √ω S λ̂, all powers of two; Q̂(P̂) is congruent to Q(P).
#[derive(Debug, Clone)]
pub(crate) struct Balanced {
    /// The system in balanced units; P̂ = T P T with T = diag(`states`).
    pub(crate) system: System,
    /// T.
    pub(crate) states: DVector<f64>,
    /// √ω S: λ = diag(`ports`)·λ̂.
    pub(crate) ports: DVector<f64>,
    /// ω, 1/s.
    pub(crate) omega: f64,
}

/// Balances (A, B, C, D): Osborne's iteration on the state indices of [[A, B], [C, D]], then time, then a congruence on
/// the ports.
pub(crate) fn balance(system: &System) -> Balanced {
    let (n, m) = (system.n(), system.m());
    let System {
        mut a,
        mut b,
        mut c,
        mut d,
    } = system.clone();
    let mut states = DVector::from_element(n, 1.0);
    for _ in 0..SWEEPS {
        let mut changed = false;
        for i in 0..n {
            let off = |v: f64, k: usize| if k == i { 0.0 } else { v.abs() };
            let row = (0..n).map(|k| off(a[(i, k)], k)).sum::<f64>()
                + b.row(i).iter().map(|v| v.abs()).sum::<f64>();
            let column = (0..n).map(|k| off(a[(k, i)], k)).sum::<f64>()
                + c.column(i).iter().map(|v| v.abs()).sum::<f64>();
            if row == 0.0 || column == 0.0 {
                continue;
            }
            let f = power_of_two((row / column).sqrt());
            if f == 1.0 {
                continue;
            }
            changed = true;
            states[i] *= f;
            a.row_mut(i).scale_mut(1.0 / f);
            b.row_mut(i).scale_mut(1.0 / f);
            a.column_mut(i).scale_mut(f);
            c.column_mut(i).scale_mut(f);
        }
        if !changed {
            break;
        }
    }
    let omega = power_of_two(a.amax().sqrt()).powi(2);
    a.scale_mut(1.0 / omega);
    b.scale_mut(1.0 / omega.sqrt());
    c.scale_mut(1.0 / omega.sqrt());
    let mut ports = DVector::from_element(m, 1.0);
    for _ in 0..SWEEPS {
        let mut changed = false;
        for j in 0..m {
            let size = d
                .row(j)
                .amax()
                .max(d.column(j).amax())
                .max(b.column(j).amax())
                .max(c.row(j).amax());
            let f = power_of_two(1.0 / size.sqrt());
            if size == 0.0 || f == 1.0 {
                continue;
            }
            changed = true;
            ports[j] *= f;
            b.column_mut(j).scale_mut(f);
            c.row_mut(j).scale_mut(f);
            d.row_mut(j).scale_mut(f);
            d.column_mut(j).scale_mut(f);
        }
        if !changed {
            break;
        }
    }
    Balanced {
        system: System { a, b, c, d },
        states,
        ports: ports * omega.sqrt(),
        omega,
    }
}

/// diag(l) M diag(r).
pub(crate) fn scaled(m: &DMatrix<f64>, l: &DVector<f64>, r: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| l[i] * m[(i, j)] * r[j])
}

/// ½(M + Mᵀ).
pub(crate) fn symmetric(m: &DMatrix<f64>) -> DMatrix<f64> {
    (m + m.transpose()) * 0.5
}

/// Eigenvalues (ascending) and eigenvectors (columns in that order) of a symmetric matrix; empty for 0×0.
pub(crate) fn eigen(m: &DMatrix<f64>) -> (DVector<f64>, DMatrix<f64>) {
    if m.is_empty() {
        return (DVector::zeros(0), DMatrix::zeros(0, 0));
    }
    let eigen = symmetric(m).symmetric_eigen();
    let mut order: Vec<usize> = (0..m.nrows()).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    let values = DVector::from_iterator(order.len(), order.iter().map(|&i| eigen.eigenvalues[i]));
    (values, eigen.eigenvectors.select_columns(&order))
}

/// Orthonormal bases (range of M, its complement, kernel of M, its complement) at relative accuracy [`RANK`] of the
/// largest singular value, with the singular values of the range.
pub(crate) struct Split {
    /// n×r: range of M.
    pub(crate) range: DMatrix<f64>,
    /// n×(n−r).
    pub(crate) left_kernel: DMatrix<f64>,
    /// k×(k−r).
    pub(crate) kernel: DMatrix<f64>,
    /// k×r: range of Mᵀ.
    pub(crate) row_space: DMatrix<f64>,
    /// r singular values.
    pub(crate) values: DVector<f64>,
}

/// The four fundamental subspaces of an n×k matrix. `floor` is the size below which M counts as zero altogether.
pub(crate) fn split(m: &DMatrix<f64>, floor: f64) -> Split {
    let (n, k) = m.shape();
    // Eigenvectors of MᵀM would square the condition; pad to square for a full SVD instead.
    let size = n.max(k);
    let mut padded = DMatrix::zeros(size, size);
    padded.view_mut((0, 0), (n, k)).copy_from(m);
    let (Some(u), Some(v_t), s) = full_svd(padded) else {
        return Split {
            range: DMatrix::zeros(n, 0),
            left_kernel: DMatrix::identity(n, n),
            kernel: DMatrix::identity(k, k),
            row_space: DMatrix::zeros(k, 0),
            values: DVector::zeros(0),
        };
    };
    let top = s.iter().copied().fold(0.0, f64::max);
    let rank = s
        .iter()
        .filter(|&&v| v > RANK * top && v > floor)
        .count()
        .min(n.min(k));
    // Left vectors of the padding rows mix with the left kernel; rebuild the complements from the ranges.
    let range = u.view((0, 0), (n, rank)).into_owned();
    let row_space = v_t.view((0, 0), (rank, k)).transpose();
    Split {
        left_kernel: complement(&range),
        kernel: complement(&row_space),
        range,
        row_space,
        values: DVector::from_iterator(rank, s.iter().copied().take(rank)),
    }
}

/// SVD with singular values in descending order.
fn full_svd(m: DMatrix<f64>) -> (Option<DMatrix<f64>>, Option<DMatrix<f64>>, DVector<f64>) {
    if m.is_empty() {
        return (None, None, DVector::zeros(0));
    }
    let svd = m.svd(true, true);
    (svd.u, svd.v_t, svd.singular_values)
}

/// An orthonormal basis of the orthogonal complement of orthonormal columns.
pub(crate) fn complement(q: &DMatrix<f64>) -> DMatrix<f64> {
    let n = q.nrows();
    if q.ncols() == 0 {
        return DMatrix::identity(n, n);
    }
    let projector = DMatrix::identity(n, n) - q * q.transpose();
    let (_, vectors) = eigen(&projector);
    vectors.columns(q.ncols(), n - q.ncols()).into_owned()
}

/// Whether M can be inverted to about ten digits after equilibration of rows and columns.
pub(crate) fn well_conditioned(m: &DMatrix<f64>) -> bool {
    if m.is_empty() {
        return true;
    }
    let mut m = m.clone();
    for _ in 0..4 {
        for i in 0..m.nrows() {
            let size = m.row(i).amax();
            if size == 0.0 {
                return false;
            }
            m.row_mut(i).scale_mut(power_of_two(1.0 / size));
        }
        for j in 0..m.ncols() {
            let size = m.column(j).amax();
            if size == 0.0 {
                return false;
            }
            m.column_mut(j).scale_mut(power_of_two(1.0 / size));
        }
    }
    let values = m.singular_values();
    values.min() > RANK * values.max()
}
