//! The least-norm member of the solution set.
//!
//! Parallel diodes share a current in any proportion. For M + Mᵀ ⪰ 0 the solution set is the polyhedron
//! {λ ≥ 0, Mλ + q ≥ 0, (M + Mᵀ)(λ − λ*) = 0, qᵀ(λ − λ*) = 0} (Cottle-Pang-Stone 3.1.7): every λ* + Z w with Z a basis of the
//! common kernel. Of these the one with the least Σ λ_j² + y_j² is taken: which of two equal devices has its current in λ and which in
//! y makes no difference to it. It is a least-distance problem, solved by nonnegative least squares (Lawson-Hanson, chapter 23).

use nalgebra::{DMatrix, DVector};

use super::lcp::Lcp;
use crate::linalg::whole::{entrywise, largest, magnitudes, transposed};
use crate::settings::tolerances::ranks::RANK;

/// The least-norm member of a solution set.
#[derive(Debug, Clone)]
pub(super) struct Least {
    /// It.
    pub lambda: DVector<f64>,
    /// Whether the set has no other, as far as that was asked: else whether it is the solution that was given.
    pub unique: bool,
    /// The ports with a positive λ or y that another member has otherwise: what the norm has chosen.
    pub chosen: Vec<usize>,
}

/// The least-norm solution. `lcp` is equilibrated and monotone, `lambda` solves it; λ_j and y_j in their own units are `units[j]` and
/// 1/`units[j]` times what stands here. `others` asks whether there is another member.
pub(super) fn least(lcp: &Lcp, lambda: &DVector<f64>, units: &DVector<f64>, others: bool) -> Least {
    let m = lcp.size();
    let as_it_is = |unique| Least {
        lambda: lambda.clone(),
        unique,
        chosen: Vec::new(),
    };
    let scale = largest(lambda.as_slice()).max(largest(lcp.q.as_slice()));
    if scale == 0.0 {
        return as_it_is(true);
    }
    let mut equations = DMatrix::zeros(m + 1, m);
    for (j, mut column) in equations.column_iter_mut().enumerate() {
        for i in 0..m {
            column[i] = lcp.m[(i, j)] + lcp.m[(j, i)];
        }
        column[m] = lcp.q[j] / scale;
    }
    let z = kernel(&equations);
    if z.ncols() == 0 {
        return as_it_is(true);
    }
    // In units of `scale`: (λ, y) = here + G w, of which nothing may be negative. Entries at rounding level are zeros: as inequalities
    // they may not be contradicted by noise.
    let clear = |v: f64| if v.abs() < RANK { 0.0 } else { v };
    let (y_of_z, y) = (&lcp.m * &z, lcp.y(lambda));
    let both = |i: usize, j: usize| if i < m { z[(i, j)] } else { y_of_z[(i - m, j)] };
    let g = DMatrix::from_fn(2 * m, z.ncols(), |i, j| clear(both(i, j)));
    let here = DVector::from_fn(2 * m, |i, _| {
        clear(if i < m { lambda[i] } else { y[i - m] } / scale)
    });
    // ‖W (here + G w)‖ = ‖R w + c‖ up to what w cannot change, with W G = Q R; v = R w + c.
    let weight = DVector::from_fn(2 * m, |i, _| {
        if i < m {
            units[i]
        } else {
            units[i - m].recip()
        }
    });
    let weighted = DMatrix::from_fn(2 * m, z.ncols(), |i, j| g[(i, j)] * weight[i]);
    let qr = weighted.qr();
    let (Some(inverse), c) = (
        qr.r().try_inverse(),
        transposed(&qr.q()) * entrywise(&here, &weight),
    ) else {
        return as_it_is(false);
    };
    let to_v = &g * &inverse;
    let nearest = least_distance(&to_v, &(&to_v * &c - &here));
    // Where no point is found in units this far apart, the solution stands, as one of several.
    let w = nearest
        .as_ref()
        .map_or(DVector::zeros(c.len()), |v| inverse * (v - c));
    let both = &here + &g * &w;
    // Unique if no direction of the kernel is feasible from the least-norm point (checked by its mirror problem).
    let unique = largest(w.as_slice()) < RANK && (!others || is_vertex(&g, &-&here, &w));
    let varies = |i: usize| both[i] > RANK && g.row(i).amax() > RANK;
    Least {
        lambda: DVector::from_fn(m, |j, _| {
            if both[j].abs() < RANK {
                0.0
            } else {
                both[j] * scale
            }
        }),
        unique,
        chosen: (0..m)
            .filter(|&j| !unique && (varies(j) || varies(m + j)))
            .collect(),
    }
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
    if n == 1 {
        let free = usize::from(a.iter().all(|&entry| entry == 0.0));
        return DMatrix::from_element(1, free, 1.0);
    }
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
    transposed(&v.select_rows(&null))
}

/// min ‖w‖ subject to G w ≥ h; `None` where no w is feasible (Lawson-Hanson, algorithm LDP).
#[must_use]
pub fn least_distance(g: &DMatrix<f64>, h: &DVector<f64>) -> Option<DVector<f64>> {
    let (rows, n) = g.shape();
    // An inequality holds at any length of its row, and w may be in any unit: rows of length 1, the largest distance 1.
    let lengths = DVector::from_fn(rows, |i, _| match g.row(i).norm() {
        0.0 => 1.0,
        length => length,
    });
    let far = h.component_div(&lengths);
    let unit = match largest(far.as_slice()) {
        farthest if farthest > 0.0 => farthest,
        _ => 1.0,
    };
    let e = DMatrix::from_fn(n + 1, rows, |j, i| {
        if j < n {
            g[(i, j)] / lengths[i]
        } else {
            far[i] / unit
        }
    });
    let mut f = DVector::zeros(n + 1);
    f[n] = 1.0;
    let u = nonnegative_least_squares(&e, &f);
    let r = &e * u - f;
    if r.norm() < RANK.sqrt() {
        return None;
    }
    Some(-r.rows(0, n) * (unit / r[n]))
}

/// min ‖E u − f‖ subject to u ≥ 0 (Lawson-Hanson, algorithm NNLS).
#[must_use]
pub fn nonnegative_least_squares(e: &DMatrix<f64>, f: &DVector<f64>) -> DVector<f64> {
    let n = e.ncols();
    let mut passive = vec![false; n];
    let mut u = DVector::zeros(n);
    let rounding = 1e2 * f64::EPSILON * largest(e.as_slice()).max(1.0);
    // Columns whose gradient is positive by rounding alone: they entered and were to leave at once.
    let mut refused = vec![false; n];
    for _ in 0..30 * (n + 1) {
        let gradient = transposed(e) * (f - e * &u);
        let sum = magnitudes(e) * &u;
        let tolerance = rounding * f.norm().max(largest(sum.as_slice()));
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

    fn least_in_own_units(lcp: &Lcp, lambda: &DVector<f64>) -> Least {
        least(lcp, lambda, &DVector::from_element(lambda.len(), 1.0), true)
    }

    #[test]
    fn parallel_diodes_share_equally() {
        let lcp = Lcp {
            m: dmatrix![1.0, 1.0; 1.0, 1.0],
            q: dvector![-2.0, -2.0],
        };
        let found = least_in_own_units(&lcp, &dvector![2.0, 0.0]);
        assert!((found.lambda - dvector![1.0, 1.0]).norm() < 1e-12);
        assert!(!found.unique);
        assert_eq!(found.chosen, [0, 1]);
    }

    #[test]
    fn parallel_diodes_share_equally_whichever_quantity_is_lambda() {
        // λ2 = 0, 0 ≤ λ1 ≤ 1 is the current of one, y2 = 1 − λ1 that of the other.
        let lcp = Lcp {
            m: dmatrix![0.0, 1.0; -1.0, 0.0],
            q: dvector![0.0, 1.0],
        };
        let found = least_in_own_units(&lcp, &dvector![1.0, 0.0]);
        assert!((found.lambda - dvector![0.5, 0.0]).norm() < 1e-12);
        assert!(!found.unique);
        assert_eq!(found.chosen, [0, 1]);
        // From an end the set is still a segment.
        assert!(!least_in_own_units(&lcp, &dvector![0.0, 0.0]).unique);
        // A current in milliamperes beside one in amperes: λ1 = 0.2 mA per unit, y2 = 1 / 0.2 of its unit.
        let units = dvector![0.2, 5.0];
        let scaled = Lcp {
            m: dmatrix![0.0, 1.0; -1.0, 0.0],
            q: dvector![0.0, 5.0],
        };
        let found = least(&scaled, &dvector![5.0, 0.0], &units, true);
        assert!((found.lambda - dvector![2.5, 0.0]).norm() < 1e-12);
    }

    #[test]
    fn a_diode_across_a_closed_switch_carries_nothing() {
        // λ may be any current ≥ 0 that the switch beside it gives back: of that nothing is known here.
        let lcp = Lcp {
            m: dmatrix![0.0],
            q: dvector![0.0],
        };
        let two = Lcp {
            m: dmatrix![0.0, 0.0; 0.0, 1.0],
            q: dvector![0.0, -1.0],
        };
        assert!(least_in_own_units(&lcp, &dvector![0.0]).chosen.is_empty());
        let found = least_in_own_units(&two, &dvector![3.0, 1.0]);
        assert!((found.lambda - dvector![0.0, 1.0]).norm() < 1e-12);
        assert!(!found.unique && found.chosen.is_empty());
    }

    #[test]
    fn degenerate_but_unique() {
        let lcp = Lcp {
            m: dmatrix![0.0, -1.0; 1.0, 0.0],
            q: dvector![2.0, -3.0],
        };
        let found = least_in_own_units(&lcp, &dvector![3.0, 2.0]);
        assert!((found.lambda - dvector![3.0, 2.0]).norm() < 1e-12);
        assert!(found.unique && found.chosen.is_empty());
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
