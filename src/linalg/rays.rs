//! Guards where the ideal model leaves a current or voltage undetermined.

use crate::linalg::whole::largest;
use crate::settings::tolerances::ranks::ENTRY;
use nalgebra::{DMatrix, DVector};

/// Rays kept before the description counts as too large.
const MOST_RAYS: usize = 256;

/// Extreme rays r ≥ 0 of {r : Kᵀ r = 0}, one per row (double description method, Motzkin et al. 1953).
///
/// By Farkas' lemma some member of `g + K κ` is nonnegative exactly if `R g ≥ 0`: two conducting diodes in parallel are
/// valid while the *sum* of their currents is positive. `None` where there are more than 256 rays.
pub(crate) fn extreme_rays(kernel: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let m = kernel.nrows();
    let mut rays: Vec<DVector<f64>> = (0..m)
        .map(|i| DVector::from_fn(m, |j, _| if i == j { 1.0 } else { 0.0 }))
        .collect();
    for column in kernel.column_iter() {
        let size = largest(column.as_slice());
        if size == 0.0 {
            continue;
        }
        let values: Vec<f64> = rays.iter().map(|r| column.dot(r)).collect();
        let sign = |i: usize| {
            if values[i].abs() <= ENTRY * size {
                0.0
            } else {
                values[i].signum()
            }
        };
        let mut next: Vec<DVector<f64>> = (0..rays.len())
            .filter(|&i| sign(i) == 0.0)
            .map(|i| rays[i].clone())
            .collect();
        for p in (0..rays.len()).filter(|&i| sign(i) > 0.0) {
            for n in (0..rays.len()).filter(|&i| sign(i) < 0.0) {
                let mut ray = &rays[n] * values[p] - &rays[p] * values[n];
                ray /= largest(ray.as_slice());
                ray.iter_mut()
                    .filter(|v| v.abs() <= ENTRY)
                    .for_each(|v| *v = 0.0);
                next.push(ray);
            }
        }
        rays = minimal(next);
        if rays.len() > MOST_RAYS {
            return None;
        }
    }
    Some(DMatrix::from_fn(rays.len(), m, |i, j| rays[i][j]))
}

/// The rays whose support contains no other ray's support.
fn minimal(rays: Vec<DVector<f64>>) -> Vec<DVector<f64>> {
    let within =
        |a: &DVector<f64>, b: &DVector<f64>| a.iter().zip(b).all(|(x, y)| *x == 0.0 || *y != 0.0);
    let keep: Vec<bool> = (0..rays.len())
        .map(|i| {
            !(0..rays.len()).any(|j| {
                j != i && within(&rays[j], &rays[i]) && (j < i || !within(&rays[i], &rays[j]))
            })
        })
        .collect();
    rays.into_iter()
        .zip(keep)
        .filter_map(|(ray, kept)| kept.then_some(ray))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parallel_diodes_share_their_sum() {
        let rays = extreme_rays(&DMatrix::from_row_slice(3, 1, &[1.0, -1.0, 0.0])).unwrap();
        assert_eq!(rays.nrows(), 2);
        assert!(rays.row_iter().any(|r| r.iter().eq([0.0, 0.0, 1.0].iter())));
        assert!(rays.row_iter().any(|r| r.iter().eq([1.0, 1.0, 0.0].iter())));
    }

    #[test]
    fn a_string_of_blocking_diodes_has_one_guard() {
        // nodes between n blocking diodes float: only the sum of the reverse voltages is known
        let n = 12;
        let mut kernel = DMatrix::zeros(n, n - 1);
        for j in 0..n - 1 {
            kernel[(j, j)] = 1.0;
            kernel[(j + 1, j)] = -1.0;
        }
        let rays = extreme_rays(&kernel).unwrap();
        assert_eq!(rays.nrows(), 1);
        assert!(rays.iter().all(|v| (v - 1.0).abs() < 1e-12));
    }

    #[test]
    fn a_bridge_short() {
        // all four diodes of a bridge conduct: one loop current (D1, D2, D3, D4 alternate in direction)
        let kernel = DMatrix::from_column_slice(4, 1, &[0.5, -0.5, 0.5, -0.5]);
        let rays = extreme_rays(&kernel).unwrap();
        assert_eq!(rays.nrows(), 4);
        assert!((rays * kernel).amax() < 1e-15);
    }

    #[test]
    fn a_one_signed_kernel_asks_nothing_of_its_pairs() {
        let rays = extreme_rays(&DMatrix::from_column_slice(2, 1, &[1.0, 2.0])).unwrap();
        assert_eq!(rays.nrows(), 0);
    }
}
