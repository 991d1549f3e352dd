//! Block principal pivoting: exchange all violated pairs at once while that helps, else one by one.
//!
//! J. J. Júdice and F. M. Pires, "A block principal pivoting algorithm for large-scale strictly monotone linear
//! complementarity problems", Computers & Operations Research 21 (1994). It needs nonsingular M_aa on its way: for the
//! skew matrices of bridges it stops at once and Lemke takes over.

use super::active::refined_inverse;
use super::lcp::Lcp;
use nalgebra::DVector;

/// Blocks in a row that may fail to reduce the number of violations before single exchanges begin.
const PATIENCE: usize = 10;

/// Exchanges before giving up, per port.
const EXCHANGES_PER_PORT: usize = 20;

/// λ and the active set at which all signs hold, starting from `active`; `None` at the first singular M_aa or after too many
/// exchanges. `lcp` is equilibrated; `slack` is the violation that counts as zero.
#[must_use]
pub fn solve(lcp: &Lcp, active: &[bool], slack: f64) -> Option<(DVector<f64>, Vec<bool>)> {
    let size = lcp.size();
    let mut set = active.to_vec();
    let mut best = size + 1;
    let mut patience = PATIENCE;
    for _ in 0..EXCHANGES_PER_PORT * size.max(1) {
        let indices: Vec<usize> = (0..size).filter(|&j| set[j]).collect();
        let maa = lcp.m.select_rows(&indices).select_columns(&indices);
        let inverse = if indices.is_empty() {
            maa
        } else {
            refined_inverse(&maa)?
        };
        let solved = -(inverse * lcp.q.select_rows(&indices));
        let mut lambda = DVector::zeros(size);
        for (&j, &v) in indices.iter().zip(solved.iter()) {
            lambda[j] = v;
        }
        let y = lcp.y(&lambda);
        let violated: Vec<usize> = (0..size)
            .filter(|&j| {
                if set[j] {
                    lambda[j] < -slack
                } else {
                    y[j] < -slack
                }
            })
            .collect();
        let Some(&last) = violated.last() else {
            return Some((lambda, set));
        };
        let single = if violated.len() < best {
            best = violated.len();
            patience = PATIENCE;
            false
        } else if patience > 0 {
            patience -= 1;
            false
        } else {
            true
        };
        if single {
            set[last] = !set[last];
        } else {
            for j in violated {
                set[j] = !set[j];
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{dmatrix, dvector};

    #[test]
    fn warm_start_at_the_solution_needs_no_exchange() {
        let lcp = Lcp {
            m: dmatrix![2.0, 1.0; 1.0, 2.0],
            q: dvector![-5.0, -6.0],
        };
        let (lambda, set) = solve(&lcp, &[true, true], 0.0).unwrap();
        assert_eq!(set, [true, true]);
        assert!((lambda - dvector![4.0 / 3.0, 7.0 / 3.0]).norm() < 1e-14);
    }

    #[test]
    fn stops_at_a_singular_block() {
        let lcp = Lcp {
            m: dmatrix![0.0, -1.0; 1.0, 0.0],
            q: dvector![-1.0, 1.0],
        };
        assert!(solve(&lcp, &[false, false], 0.0).is_none());
    }
}
