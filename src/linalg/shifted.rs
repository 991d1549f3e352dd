//! (Z − p)⁻¹ for real Z and complex p: Gaussian elimination with partial pivoting, real and imaginary parts apart.

use nalgebra::Complex;

use super::dense::Dense;

/// Work space for n×n.
#[derive(Debug, Clone)]
pub(crate) struct Shifted {
    n: usize,
    /// Rows of [Z − p, B], each with its real parts first: 4n numbers.
    rows: Vec<f64>,
    /// (Z − p)⁻¹.
    inverse: [Dense; 2],
}

/// target ← target − factor · row, rows as in [`Shifted`], from column `from` on.
fn subtract(target: &mut [f64], factor: Complex<f64>, row: &[f64], from: usize) {
    let half = row.len() / 2;
    let (re, im) = target.split_at_mut(half);
    let (row_re, row_im) = row.split_at(half);
    let targets = re[from..].iter_mut().zip(&mut im[from..]);
    let row = row_re[from..].iter().zip(&row_im[from..]);
    for ((re, im), (a, b)) in targets.zip(row) {
        *re -= factor.re * a - factor.im * b;
        *im -= factor.re * b + factor.im * a;
    }
}

impl Shifted {
    pub(crate) fn new(n: usize) -> Self {
        Self {
            n,
            rows: vec![0.0; 4 * n * n],
            inverse: [Dense::zeros(n, n), Dense::zeros(n, n)],
        }
    }

    fn at(&self, i: usize, j: usize) -> Complex<f64> {
        let row = &self.rows[4 * self.n * i..];
        Complex::new(row[j], row[2 * self.n + j])
    }

    /// Rows i < k apart: the first mutable, the second as it is.
    fn two(&mut self, target: usize, row: usize) -> (&mut [f64], &[f64]) {
        let width = 4 * self.n;
        let (low, high) = self.rows.split_at_mut(width * target.max(row));
        let low = &mut low[width * target.min(row)..][..width];
        let high = &mut high[..width];
        if target < row {
            (low, high)
        } else {
            (high, low)
        }
    }

    /// Real and imaginary part of (Z − p)⁻¹; `None` where it does not exist.
    pub(crate) fn inverse(&mut self, z: &Dense, pole: Complex<f64>) -> Option<&[Dense; 2]> {
        let n = self.n;
        self.rows.fill(0.0);
        for j in 0..n {
            for (i, value) in z.column(j).iter().enumerate() {
                self.rows[4 * n * i + j] = *value;
            }
            self.rows[4 * n * j + j] -= pole.re;
            self.rows[4 * n * j + 2 * n + j] = -pole.im;
            self.rows[4 * n * j + n + j] = 1.0;
        }
        for k in 0..n {
            let size = |i: usize| self.at(i, k).norm_sqr();
            let best = (k + 1..n).fold(k, |best, i| if size(i) > size(best) { i } else { best });
            if best != k {
                let (low, high) = self.rows.split_at_mut(4 * n * best);
                low[4 * n * k..4 * n * (k + 1)].swap_with_slice(&mut high[..4 * n]);
            }
            let inverse = self.at(k, k).inv();
            if !inverse.is_finite() {
                return None;
            }
            for i in k + 1..n {
                let factor = self.at(i, k) * inverse;
                if factor.re != 0.0 || factor.im != 0.0 {
                    let (target, row) = self.two(i, k);
                    subtract(target, factor, row, k + 1);
                }
            }
        }
        for k in (0..n).rev() {
            let inverse = self.at(k, k).inv();
            for j in n..2 * n {
                let value = self.at(k, j) * inverse;
                self.rows[4 * n * k + j] = value.re;
                self.rows[4 * n * k + 2 * n + j] = value.im;
            }
            for i in 0..k {
                let factor = self.at(i, k);
                if factor.re != 0.0 || factor.im != 0.0 {
                    let (target, row) = self.two(i, k);
                    subtract(target, factor, row, n);
                }
            }
        }
        let [re, im] = &mut self.inverse;
        for i in 0..n {
            let row = &self.rows[4 * n * i..4 * n * (i + 1)];
            for j in 0..n {
                re.column_mut(j)[i] = row[n + j];
                im.column_mut(j)[i] = row[3 * n + j];
            }
        }
        Some(&self.inverse)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    #[test]
    fn the_product_is_the_identity() {
        let mut shifted = Shifted::new(3);
        // In the second the factor of an elimination is i, without a real part.
        for (z, pole) in [
            ([0.0, 2.0, 1.0, 1e3, 5.0, 7.0, -1.0, 0.5, 3.0], (0.25, -4.0)),
            ([0.0, 0.0, -1.0, 1.0, 2.0, 0.0, 0.0, 0.0, 3.0], (0.0, 1.0)),
        ] {
            let z = DMatrix::from_row_slice(3, 3, &z);
            let pole = Complex::new(pole.0, pole.1);
            let [re, im] = shifted.inverse(&Dense::of(&z), pole).unwrap();
            let entry = |i: usize, j: usize| Complex::new(re.column(j)[i], im.column(j)[i]);
            let inverse = DMatrix::from_fn(3, 3, entry);
            let matrix = z.map(|v| Complex::new(v, 0.0)) - DMatrix::identity(3, 3) * pole;
            let error = (matrix * inverse - DMatrix::identity(3, 3)).map(|v| v.norm());
            assert!(error.amax() < 1e-14, "{error}");
        }
        let singular = Dense::of(&DMatrix::from_element(3, 3, 1.0));
        assert!(shifted.inverse(&singular, Complex::new(0.0, 0.0)).is_none());
    }
}
