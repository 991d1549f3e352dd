//! Lemke's complementary pivoting with lexicographic ties.
//!
//! R. W. Cottle, J.-S. Pang, R. E. Stone, "The Linear Complementarity Problem", algorithm 4.4.5 (scheme I) with the
//! lexicographic degeneracy resolution of section 4.9. The rows of the basis inverse are the columns of the slack
//! variables in the tableau, so the lexicographic order costs nothing extra and cycling is impossible. For M copositive-plus
//! (M + Mᵀ ⪰ 0) a secondary ray proves that no λ ≥ 0 has Mλ + q ≥ 0.

use nalgebra::{DMatrix, DVector};

use super::lcp::Lcp;
use crate::linalg::whole::largest;
use crate::settings::tolerances::complementarity::{TABLEAU_NOISE, TIE};
use crate::settings::tolerances::ranks::INVERSE;

/// How Lemke ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Lemke {
    /// The complementary basis found: which λ_j are basic.
    Basis(Vec<bool>),
    /// A secondary ray: λ can grow along this direction for ever.
    Ray(DVector<f64>),
    /// Pivot limit reached.
    Limit,
}

/// Pivots allowed per port: small circuit problems take about m, Murty's example 2^m for m up to 12.
const PIVOTS_PER_PORT: usize = 400;

/// Runs Lemke on an equilibrated problem with covering vector `cover` > 0.
#[must_use]
pub fn solve(lcp: &Lcp, cover: &DVector<f64>) -> Lemke {
    let m = lcp.size();
    if lcp.q.iter().all(|&v| v >= 0.0) {
        return Lemke::Basis(vec![false; m]);
    }
    // y − M λ − cover·z0 = q. Columns: y 0..m, λ m..2m, z0 2m, q 2m+1.
    let (z0, rhs) = (2 * m, 2 * m + 1);
    let mut t = DMatrix::zeros(m, 2 * m + 2);
    t.view_mut((0, 0), (m, m)).fill_with_identity();
    t.view_mut((0, m), (m, m)).copy_from(&(-&lcp.m));
    t.set_column(z0, &(-cover));
    t.set_column(rhs, &lcp.q);
    let mut basis: Vec<usize> = (0..m).collect();
    let complement = |v: usize| if v < m { v + m } else { v - m };

    // z0 enters; the row with the lexicographically smallest (q, I)/cover leaves, which makes the right-hand side
    // nonnegative. For the first pivot only, the order of rows is that of −row/cover.
    let scale = largest(lcp.q.as_slice());
    let mut row = 0;
    for i in 1..m {
        let order = (0..=m)
            .map(|k| if k == 0 { rhs } else { k - 1 })
            .find_map(|k| {
                let (a, b) = (t[(i, k)] / cover[i], t[(row, k)] / cover[row]);
                ((a - b).abs() > TIE * a.abs().max(b.abs()).max(TIE * scale)).then_some(a < b)
            });
        if order == Some(true) {
            row = i;
        }
    }
    let mut leaving = basis[row];
    pivot(&mut t, row, z0);
    basis[row] = z0;

    for _ in 0..PIVOTS_PER_PORT * m + 100 {
        let entering = complement(leaving);
        let column = t.column(entering);
        let limit = INVERSE * largest(column.as_slice()).max(f64::MIN_POSITIVE);
        let candidates: Vec<usize> = (0..m).filter(|&i| t[(i, entering)] > limit).collect();
        if candidates.is_empty() {
            let mut ray = DVector::zeros(m);
            if entering >= m {
                ray[entering - m] = 1.0;
            }
            for (i, &b) in basis.iter().enumerate() {
                if (m..2 * m).contains(&b) {
                    ray[b - m] = (-t[(i, entering)]).max(0.0);
                }
            }
            return Lemke::Ray(ray);
        }
        let row = lexicographic_minimum(&t, &candidates, entering, rhs, &basis, z0);
        leaving = basis[row];
        pivot(&mut t, row, entering);
        basis[row] = entering;
        if leaving == z0 {
            let mut active = vec![false; m];
            for &b in basis.iter().filter(|&&b| b >= m) {
                active[b - m] = true;
            }
            return Lemke::Basis(active);
        }
    }
    Lemke::Limit
}

/// The candidate row with the smallest (rhs, B⁻¹)/pivot in lexicographic order; z0 wins ties in the first entry, where
/// leaving with it ends the run.
fn lexicographic_minimum(
    t: &DMatrix<f64>,
    candidates: &[usize],
    entering: usize,
    rhs: usize,
    basis: &[usize],
    z0: usize,
) -> usize {
    let mut tied = candidates.to_vec();
    let size = basis.len();
    for k in 0..=size {
        let column = if k == 0 { rhs } else { k - 1 };
        let noise = TABLEAU_NOISE * largest(t.column(column).as_slice());
        let ratio = |i: usize| (t[(i, column)] / t[(i, entering)], noise / t[(i, entering)]);
        let (least, blur) = tied
            .iter()
            .map(|&i| ratio(i))
            .fold((f64::INFINITY, 0.0), |a, b| if b.0 < a.0 { b } else { a });
        tied.retain(|&i| {
            let (value, own) = ratio(i);
            value - least <= TIE * least.abs() + blur + own
        });
        if k == 0
            && let Some(&row) = tied.iter().find(|&&i| basis[i] == z0)
        {
            return row;
        }
        if tied.len() == 1 {
            break;
        }
    }
    tied[0]
}

fn pivot(t: &mut DMatrix<f64>, row: usize, column: usize) {
    let (m, width) = t.shape();
    let value = t[(row, column)];
    for k in 0..width {
        t[(row, k)] /= value;
    }
    for i in (0..m).filter(|&i| i != row) {
        let factor = t[(i, column)];
        if factor != 0.0 {
            for k in 0..width {
                let change = factor * t[(row, k)];
                t[(i, k)] -= change;
            }
            t[(i, column)] = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{dmatrix, dvector};

    fn run(m: DMatrix<f64>, q: DVector<f64>) -> Lemke {
        let ones = DVector::from_element(q.len(), 1.0);
        solve(&Lcp { m, q }, &ones)
    }

    #[test]
    fn skew_bridge_pair() {
        let end = run(dmatrix![0.0, -1.0; 1.0, 0.0], dvector![2.0, -3.0]);
        assert_eq!(end, Lemke::Basis(vec![true, true]));
    }

    #[test]
    fn cancelling_right_hand_sides_tie() {
        // A bridge arm with two equal diodes in parallel: at the solution λ_2 alone carries the current and three pairs vanish
        // together, in the tableau only to rounding.
        let a = 0.0006357784054158147;
        let b = -0.02034490897330607;
        let c = 0.9999936422159459;
        let m = dmatrix![
            0.00999993642215946, c, -0.00020344908973306069, c;
            -c, a, b, a;
            0.0002034490897330607, b, 0.6510370871457942, b;
            -c, a, b, a
        ];
        let q = dvector![
            -1.4380978419164194e-8,
            -9.146726369255016e-12,
            2.926952438161605e-10,
            -9.146726369255016e-12
        ];
        let Lemke::Basis(active) = run(m, q) else {
            panic!("no basis")
        };
        assert!(active[1] || active[3], "{active:?}");
    }

    #[test]
    fn infeasible_problem_ends_on_a_ray() {
        let Lemke::Ray(ray) = run(dmatrix![0.0], dvector![-1.0]) else {
            panic!("no ray")
        };
        assert!(ray[0] > 0.0);
    }

    /// At λ = (1, 1, 0) z₀ reaches 0 together with another variable: leaving with that one instead ends on a ray, though M λ + q = 0.
    #[test]
    fn the_cover_leaves_first_where_it_ties() {
        let m = dmatrix![1.0, 0.0, 1.0; 0.0, 1.0, -1.0; 1.0, -1.0, 1.0];
        let q = dvector![-1.0, -1.0, 0.0];
        assert_eq!(&m * dvector![1.0, 1.0, 0.0] + &q, DVector::zeros(3));
        assert_eq!(run(m, q), Lemke::Basis(vec![true, true, false]));
    }

    #[test]
    fn murtys_example_takes_exponentially_many_pivots_and_still_ends() {
        // M lower triangular with 1 on and 2 below the diagonal, q = −1: λ = (1, 0, …, 0).
        let m = 8;
        let matrix = DMatrix::from_fn(m, m, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Less => 0.0,
            std::cmp::Ordering::Equal => 1.0,
            std::cmp::Ordering::Greater => 2.0,
        });
        let mut expected = vec![false; m];
        expected[0] = true;
        assert_eq!(
            run(matrix, DVector::from_element(m, -1.0)),
            Lemke::Basis(expected)
        );
    }
}
