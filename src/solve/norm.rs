//! The least-norm member of the solution set.
//!
//! Parallel diodes share a current in any proportion. For M + Mᵀ ⪰ 0 the solution set is the polyhedron
//! {λ ≥ 0, Mλ + q ≥ 0, (M + Mᵀ)(λ − λ*) = 0, qᵀ(λ − λ*) = 0} (Cottle-Pang-Stone 3.1.7): every λ* + Z w with Z a basis of the
//! common kernel. Its point of least norm is a least-distance problem, solved by nonnegative least squares
//! (Lawson-Hanson, chapter 23).

use nalgebra::{DMatrix, DVector};

use super::lcp::Lcp;

/// Singular values below this multiple of the largest count as zero (M equilibrated).
const RANK: f64 = 1e-10;

/// The least-norm solution, and whether it is the only one. `lcp` is equilibrated and monotone, `lambda` solves it.
///
/// The norm is that of the equilibrated λ, which within ports of equal scale (parallel devices) is the plain one.
#[must_use]
pub fn least(lcp: &Lcp, lambda: &DVector<f64>) -> (DVector<f64>, bool) {
    let m = lcp.size();
    let scale = lambda.amax().max(lcp.q.amax());
    if scale == 0.0 {
        return (lambda.clone(), true);
    }
    let mut equations = DMatrix::zeros(m + 1, m);
    equations
        .rows_mut(0, m)
        .copy_from(&(&lcp.m + lcp.m.transpose()));
    equations.set_row(m, &(lcp.q.transpose() / scale));
    let z = kernel(&equations);
    if z.ncols() == 0 {
        return (lambda.clone(), true);
    }
    // In units of `scale`: λ = base + Z w with base ⟂ Z, so ‖λ‖ is least where ‖w‖ is.
    let base = (lambda - &z * (z.transpose() * lambda)) / scale;
    let mut g = DMatrix::zeros(2 * m, z.ncols());
    g.rows_mut(0, m).copy_from(&z);
    g.rows_mut(m, m).copy_from(&(&lcp.m * &z));
    let mut h = DVector::zeros(2 * m);
    h.rows_mut(0, m).copy_from(&(-&base));
    h.rows_mut(m, m)
        .copy_from(&(-(&lcp.m * &base + &lcp.q / scale)));
    // Entries at rounding level are zeros of λ or y: as inequalities they may not be contradicted by noise.
    h.iter_mut()
        .filter(|v| v.abs() < RANK)
        .for_each(|v| *v = 0.0);
    let Some(w) = least_distance(&g, &h) else {
        return (lambda.clone(), false);
    };
    let least = (base + &z * &w) * scale;
    let here = z.transpose() * lambda / scale;
    // Unique if no direction of the kernel is feasible from the least-norm point (checked by its mirror problem).
    let unique = (&w - &here).amax() < RANK && is_vertex(&g, &h, &w);
    (
        least.map(|v| {
            if v.abs() < RANK * scale {
                v.max(0.0)
            } else {
                v
            }
        }),
        unique,
    )
}

/// Whether {w : G w ≥ h} has no other point: the tight rows positively span the space. Decided by asking for the point of
/// least distance to w ± e_k directions: a second point exists iff some kernel direction d has G_tight d ≥ 0.
fn is_vertex(g: &DMatrix<f64>, h: &DVector<f64>, w: &DVector<f64>) -> bool {
    let slack = g * w - h;
    let tight: Vec<usize> = (0..h.len()).filter(|&i| slack[i] < RANK).collect();
    let rows = g.select_rows(&tight);
    // For each ±e_k: is there d with rows·d ≥ 0 and ±d_k ≥ 1?
    (0..w.len()).all(|k| {
        [1.0, -1.0].iter().all(|&sign| {
            let mut gg = rows.clone().insert_row(tight.len(), 0.0);
            gg[(tight.len(), k)] = sign;
            let mut hh = DVector::zeros(tight.len() + 1);
            hh[tight.len()] = 1.0;
            least_distance(&gg, &hh).is_none()
        })
    })
}

/// An orthonormal basis of ker A.
#[must_use]
pub fn kernel(a: &DMatrix<f64>) -> DMatrix<f64> {
    let n = a.ncols();
    let square = if a.nrows() < n {
        a.clone().resize_vertically(n, 0.0)
    } else {
        a.clone()
    };
    let svd = square.svd(false, true);
    let Some(v) = svd.v_t else {
        return DMatrix::zeros(n, 0);
    };
    let limit = RANK * svd.singular_values.max();
    let null: Vec<usize> = (0..n)
        .filter(|&k| svd.singular_values[k] <= limit || limit == 0.0)
        .collect();
    v.select_rows(&null).transpose()
}

/// min ‖w‖ subject to G w ≥ h; `None` where no w is feasible (Lawson-Hanson, algorithm LDP).
#[must_use]
pub fn least_distance(g: &DMatrix<f64>, h: &DVector<f64>) -> Option<DVector<f64>> {
    let (rows, n) = g.shape();
    let mut e = DMatrix::zeros(n + 1, rows);
    e.rows_mut(0, n).copy_from(&g.transpose());
    e.set_row(n, &h.transpose());
    let mut f = DVector::zeros(n + 1);
    f[n] = 1.0;
    let u = nonnegative_least_squares(&e, &f);
    let r = &e * u - f;
    if r.norm() < RANK.sqrt() {
        return None;
    }
    Some(-r.rows(0, n) / r[n])
}

/// min ‖E u − f‖ subject to u ≥ 0 (Lawson-Hanson, algorithm NNLS).
#[must_use]
pub fn nonnegative_least_squares(e: &DMatrix<f64>, f: &DVector<f64>) -> DVector<f64> {
    let n = e.ncols();
    let mut passive = vec![false; n];
    let mut u = DVector::zeros(n);
    let rounding = 1e2 * f64::EPSILON * e.amax().max(1.0);
    // Columns whose gradient is positive by rounding alone: they entered and were to leave at once.
    let mut refused = vec![false; n];
    for _ in 0..30 * (n + 1) {
        let gradient = e.transpose() * (f - e * &u);
        let tolerance = rounding * f.norm().max((e.abs() * &u).amax());
        let Some(enter) = (0..n)
            .filter(|&j| !passive[j] && !refused[j] && gradient[j] > tolerance)
            .max_by(|&a, &b| gradient[a].total_cmp(&gradient[b]))
        else {
            break;
        };
        passive[enter] = true;
        let mut moved = false;
        loop {
            let set: Vec<usize> = (0..n).filter(|&j| passive[j]).collect();
            if set.is_empty() {
                refused[enter] = true;
                break;
            }
            let columns = e.select_columns(&set);
            let svd = columns.svd(true, true);
            let limit = f64::EPSILON * 1e3 * svd.singular_values.max();
            let Ok(solved) = svd.solve(f, limit) else {
                return u;
            };
            let at = set.iter().position(|&j| j == enter);
            if !moved && at.is_some_and(|at| solved[at] <= 0.0) {
                (passive[enter], refused[enter]) = (false, true);
                break;
            }
            moved = true;
            if solved.iter().all(|&v| v > 0.0) {
                u.fill(0.0);
                set.iter().zip(solved.iter()).for_each(|(&j, &v)| u[j] = v);
                refused.fill(false);
                break;
            }
            let step = set
                .iter()
                .zip(solved.iter())
                .filter(|&(_, &v)| v <= 0.0)
                .map(|(&j, &v)| u[j] / (u[j] - v).max(f64::MIN_POSITIVE))
                .fold(1.0, f64::min);
            let mut dropped = false;
            for (&j, &v) in set.iter().zip(solved.iter()) {
                u[j] += step * (v - u[j]);
                if u[j] <= f64::EPSILON * f.norm() && v <= 0.0 {
                    u[j] = 0.0;
                    passive[j] = false;
                    dropped = true;
                }
            }
            if !dropped {
                return u;
            }
        }
    }
    u
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{dmatrix, dvector};

    #[test]
    fn parallel_diodes_share_equally() {
        let lcp = Lcp {
            m: dmatrix![1.0, 1.0; 1.0, 1.0],
            q: dvector![-2.0, -2.0],
        };
        let (lambda, unique) = least(&lcp, &dvector![2.0, 0.0]);
        assert!((lambda - dvector![1.0, 1.0]).norm() < 1e-12);
        assert!(!unique);
    }

    #[test]
    fn skew_segment_shrinks_to_its_end() {
        // λ2 = 0, 0 ≤ λ1 ≤ 1.
        let lcp = Lcp {
            m: dmatrix![0.0, 1.0; -1.0, 0.0],
            q: dvector![0.0, 1.0],
        };
        let (lambda, unique) = least(&lcp, &dvector![1.0, 0.0]);
        assert!(lambda.norm() < 1e-12);
        assert!(!unique);
        // From the end itself the set is still a segment.
        assert!(!least(&lcp, &dvector![0.0, 0.0]).1);
    }

    #[test]
    fn degenerate_but_unique() {
        let lcp = Lcp {
            m: dmatrix![0.0, -1.0; 1.0, 0.0],
            q: dvector![2.0, -3.0],
        };
        let (lambda, unique) = least(&lcp, &dvector![3.0, 2.0]);
        assert!((lambda - dvector![3.0, 2.0]).norm() < 1e-12);
        assert!(unique);
    }

    #[test]
    fn columns_that_enter_by_rounding_leave_and_stay_out() {
        // From a chattering comparator: five nearly dependent columns.
        let e = DMatrix::from_column_slice(
            3,
            5,
            &[
                7.050_101_361_672_679e-9,
                0.160_918_642_578_446_8,
                0.0,
                5.709_773_986_183_874e-10,
                -0.986_967_674_481_140_5,
                0.0,
                -1.000_000_000_000_000_2,
                5.709_569_499_543_558e-10,
                0.0,
                7.050_106_828_182_639e-9,
                0.160_918_642_578_446_8,
                0.0,
                -1.0,
                0.0,
                1.0,
            ],
        );
        let f = dvector![0.0, 0.0, 1.0];
        let u = nonnegative_least_squares(&e, &f);
        assert!(u.min() >= 0.0, "{u}");
        let gradient = e.transpose() * (&f - &e * &u);
        assert!(gradient.max() <= 1e-8, "{gradient}");
    }

    #[test]
    fn least_distance_to_a_half_plane_and_to_nothing() {
        let w = least_distance(&dmatrix![1.0, 1.0], &dvector![2.0]).unwrap();
        assert!((w - dvector![1.0, 1.0]).norm() < 1e-12);
        assert!(least_distance(&dmatrix![1.0; -1.0], &dvector![1.0, 0.0]).is_none());
    }
}
