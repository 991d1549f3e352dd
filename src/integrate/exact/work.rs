//! Energy over a step: ∫ wᵀ Q w dt along the flow, exactly.

use nalgebra::DMatrix;

/// Terms of the series of a Gramian over a step with ‖𝒜‖ h ≤ 1: 2^k/k! is below rounding beyond.
const TERMS: usize = 30;

/// Nodes and weights of Gauss-Legendre's rule with 8 points on [0, 1]; exact to degree 15, and to 1e-18 for products of two
/// exponentials over one radius of contraction.
const GAUSS: [(f64, f64); 8] = [
    (0.019855071751231884, 0.05061426814518813),
    (0.10166676129318664, 0.11119051722668724),
    (0.2372337950418355, 0.15685332293894363),
    (0.4082826787521751, 0.181341891689181),
    (0.591717321247825, 0.181341891689181),
    (0.7627662049581645, 0.15685332293894363),
    (0.8983332387068134, 0.11119051722668724),
    (0.9801449282487681, 0.05061426814518813),
];

/// A quadratic form wᵀ Q w, upper triangle row by row with doubled off-diagonal entries.
#[derive(Debug, Clone)]
pub(crate) struct Form {
    dim: usize,
    packed: Vec<f64>,
}

impl Form {
    /// Packs a symmetric matrix.
    pub(crate) fn new(q: &DMatrix<f64>) -> Self {
        let dim = q.nrows();
        let packed = (0..dim)
            .flat_map(|i| (i..dim).map(move |j| (i, j)))
            .map(|(i, j)| {
                if i == j {
                    q[(i, i)]
                } else {
                    q[(i, j)] + q[(j, i)]
                }
            })
            .collect();
        Self { dim, packed }
    }

    /// wᵀ Q w.
    #[inline]
    pub(crate) fn value(&self, w: &[f64]) -> f64 {
        let mut rest = &self.packed[..];
        let mut sum = 0.0;
        for i in 0..self.dim {
            let (row, tail) = rest.split_at(self.dim - i);
            sum += w[i] * row.iter().zip(&w[i..]).map(|(q, w)| q * w).sum::<f64>();
            rest = tail;
        }
        sum
    }
}

/// ∫₀ʰ e^{𝒜ᵀt} Q e^{𝒜t} dt for a step with ‖𝒜‖ h ≤ 1, by its series Q_{k+1} = 𝒜ᵀ Q_k + Q_k 𝒜.
pub(crate) fn gramian(generator: &DMatrix<f64>, q: &DMatrix<f64>, h: f64) -> DMatrix<f64> {
    let mut term = q * h;
    let mut sum = term.clone();
    for k in 1..TERMS {
        let product = &term * generator;
        term = (&product + product.transpose()) * (h / (k as f64 + 1.0));
        sum += &term;
    }
    sum
}

/// ∫ wᵀ Q w dt along a Taylor polynomial w = Σ terms s^k, s = t/h, for two forms.
/// `part` is the fraction of the polynomial's step, `w` work space of its dimension.
pub(crate) fn along_taylor(
    forms: &[Form; 2],
    terms: &[f64],
    degree: usize,
    h: f64,
    part: f64,
    w: &mut [f64],
) -> [f64; 2] {
    let dim = w.len();
    let mut sums = [0.0; 2];
    for (node, weight) in GAUSS {
        let s = node * part;
        for (i, out) in w.iter_mut().enumerate() {
            *out = (0..=degree)
                .rev()
                .fold(0.0, |sum, k| sum * s + terms[k * dim + i]);
        }
        for (sum, form) in sums.iter_mut().zip(forms) {
            *sum += weight * h * part * form.value(w);
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    /// x' = −x/τ: ∫₀ʰ x² dt = x₀² τ/2 (1 − e^{−2h/τ}).
    #[test]
    fn both_integrals_of_a_decay() {
        let tau = 2e-3;
        let (a, q) = (
            DMatrix::from_element(1, 1, -1.0 / tau),
            DMatrix::from_element(1, 1, 1.0),
        );
        let h = 1.5e-3;
        let exact = |h: f64| -9.0 * tau / 2.0 * (-2.0 * h / tau).exp_m1();
        let form = Form::new(&gramian(&a, &q, h));
        assert!((form.value(&[3.0]) / exact(h) - 1.0).abs() < 1e-15);
        let terms: Vec<f64> = (0..=20)
            .scan(3.0, |t, k| {
                let now = *t;
                *t *= -h / tau / (f64::from(k) + 1.0);
                Some(now)
            })
            .collect();
        let forms = [Form::new(&q), Form::new(&(q * 2.0))];
        let along = along_taylor(&forms, &terms, 20, h, 0.4, &mut [0.0]);
        assert!((along[0] / exact(0.4 * h) - 1.0).abs() < 1e-14);
        assert!((along[1] / exact(0.4 * h) - 2.0).abs() < 1e-14);
    }

    #[test]
    fn packed_form() {
        let q = DMatrix::from_row_slice(3, 3, &[1.0, 2.0, 3.0, 2.0, 5.0, 6.0, 3.0, 6.0, 9.0]);
        let w = DVector::from_row_slice(&[1.0, -2.0, 0.5]);
        assert_eq!(Form::new(&q).value(w.as_slice()), w.dot(&(&q * &w)));
    }
}
