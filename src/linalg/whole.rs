//! Operations on whole vectors and matrices, one copy of each: nalgebra puts its own into every place that asks for one, and what sets a
//! mode up runs once and waits for its code.

use nalgebra::{DMatrix, DVector};

/// The largest magnitude, 0 of none.
#[inline(never)]
pub(crate) fn largest(values: &[f64]) -> f64 {
    let mut rest = values.iter();
    let first = rest.next().map_or(0.0, |v| v.abs());
    rest.fold(first, |largest, v| largest.max(v.abs()))
}

/// Aᵀ.
#[inline(never)]
pub(crate) fn transposed(a: &DMatrix<f64>) -> DMatrix<f64> {
    a.transpose()
}

/// |A|.
#[inline(never)]
pub(crate) fn magnitudes(a: &DMatrix<f64>) -> DMatrix<f64> {
    a.abs()
}

/// |x|.
#[inline(never)]
pub(crate) fn sizes(x: &DVector<f64>) -> DVector<f64> {
    x.abs()
}

/// The entries of x times those of y.
#[inline(never)]
pub(crate) fn entrywise(x: &DVector<f64>, y: &DVector<f64>) -> DVector<f64> {
    x.component_mul(y)
}

/// d A d, d a vector of powers of two: no product rounds.
#[inline(never)]
pub(crate) fn scaled(a: &DMatrix<f64>, d: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| d[i] * a[(i, j)] * d[j])
}

/// A + Aᵀ.
#[inline(never)]
pub(crate) fn with_transposed(a: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] + a[(j, i)])
}

/// Whether A is the identity of this size.
#[inline(never)]
pub(crate) fn is_identity(a: &DMatrix<f64>, n: usize) -> bool {
    let one = |(k, v): (usize, &f64)| *v == f64::from(u8::from(k % (n + 1) == 0));
    a.shape() == (n, n) && a.iter().enumerate().all(one)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{dmatrix, dvector};

    #[test]
    fn they_are_those_of_nalgebra() {
        for v in [dvector![], dvector![-3.0, 2.0, -0.0], dvector![0.0, -5.0]] {
            assert_eq!(largest(v.as_slice()), v.amax());
            assert_eq!(sizes(&v), v.abs());
            assert_eq!(entrywise(&v, &v), v.component_mul(&v));
        }
        let a = dmatrix![1.0, -2.0; 3.0, 4.0];
        let d = dvector![0.5, 8.0];
        let diagonal = DMatrix::from_diagonal(&d);
        assert_eq!(scaled(&a, &d), &diagonal * &a * &diagonal);
        assert_eq!(with_transposed(&a), &a + a.transpose());
        assert_eq!(transposed(&a), a.transpose());
        assert_eq!(magnitudes(&a), a.abs());
    }

    #[test]
    fn the_identity_has_its_size() {
        for n in 0..4 {
            let mut one = DMatrix::identity(n, n);
            assert!(is_identity(&one, n) && !is_identity(&one, n + 1));
            if n > 1 {
                one[(0, 1)] = 1e-300;
                assert!(!is_identity(&one, n));
            }
        }
        assert!(!is_identity(&DMatrix::zeros(2, 2), 2));
    }
}
