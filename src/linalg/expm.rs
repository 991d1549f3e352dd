//! exp(A h/2^k) − I for small dense A and k = 0, 1, …, accurate when the eigenvalues of A h lie many decades apart.
//!
//! The difference from the identity is kept: where steps are short it carries digits that exp(A h) itself would drop, and
//! a run of many steps would lose them systematically.

use nalgebra::{Complex, DMatrix};

use super::dense::Dense;
use super::eigenvalues::eigenvalues;
use super::powers::{halved, power_of_two, two_to};
use super::shifted::Shifted;
use crate::settings::tolerances::exponentials::{MISSING, SERIES, TURNS};

/// Conjugate pairs (zero, pole) of the sub-diagonal approximant [7/8] of exp.
const PAIRS: [(Complex<f64>, Complex<f64>); 3] = [
    (
        Complex::new(-10.520_394_801_787_253, 3.665_410_463_372_832_6),
        Complex::new(9.406_371_213_690_74, 4.969_217_287_623_294),
    ),
    (
        Complex::new(-9.139_631_189_381_745, 7.422_677_294_570_236),
        Complex::new(7.738_688_146_830_548, 8.370_879_306_237_983),
    ),
    (
        Complex::new(-6.365_470_802_864_828, 11.473_438_117_035_917),
        Complex::new(4.685_494_632_821_197, 12.010_578_599_813_79),
    ),
];

/// The real zero of the [7/8] approximant and the pole it is paired with.
const LAST: (f64, Complex<f64>) = (
    -10.949_006_411_932_347,
    Complex::new(10.169_446_006_657_515, 1.649_201_796_822_227_7),
);

/// Of so many stiff rungs one is computed anew, and the others are squares: fewer squarings than the approximant has itself.
const ANEW: u32 = 3;

/// Squarings of the [7/8] approximant: with 2³ steps its error on the whole negative axis is below 1e-13.
const SQUARINGS: u32 = 3;

/// The same of fast states apart: with 2⁴ steps it is below 1e-22, and nothing is left of what has decayed; rounding that one squaring more doubles is no loss where nothing is slow.
const FAST_SQUARINGS: u32 = 4;

/// exp(A h/2^k) − I for all k, computed when asked for, each from the next where that is accurate.
///
/// Where ‖A h/2^k‖₁ is small after balancing, the series; up to a limit the square of the half step; beyond, for every third rung
/// the L-stable sub-diagonal approximant [7/8] in product form with 2³ squarings, whose cost does not grow with ‖A h‖ and whose
/// error is not multiplied by it when A is graded (spread storage elements). It damps an oscillation of many turns a step, so that
/// where there is one the square is taken instead.
#[derive(Debug, Clone)]
pub(crate) struct Ladder {
    /// A h in balanced coordinates.
    whole: Dense,
    norm: f64,
    /// Balanced coordinates times these are the original ones.
    scale: Vec<f64>,
    /// ‖A h‖₁ up to which steps are squared.
    limit: f64,
    /// Rungs below this one are squares in any case.
    doubled: u32,
    /// Those of the approximant.
    squarings: u32,
    /// Complex eigenvalues of A h, with Im > 0; `None` until they are asked for.
    turning: Option<Vec<Complex<f64>>>,
    rungs: Vec<Option<Dense>>,
}

impl Ladder {
    /// The ladder of A below h, squared while ‖A h/2^k‖₁ ≤ `limit` and for k < `doubled`: what that loses is what repeated steps of
    /// rung `doubled` lose as well.
    pub(crate) fn new(a: &DMatrix<f64>, h: f64, limit: f64, doubled: u32) -> Self {
        let scale = balance(a, h);
        let whole = Dense::from_fn(a.nrows(), a.ncols(), |i, j| {
            a[(i, j)] * h * scale[j] / scale[i]
        });
        Self {
            norm: whole.norm_1(),
            whole,
            scale,
            limit,
            doubled,
            squarings: SQUARINGS,
            turning: None,
            rungs: Vec::new(),
        }
    }

    /// ‖A h‖₁ after balancing.
    pub(crate) fn norm(&self) -> f64 {
        self.norm
    }

    /// Gives up what was computed.
    fn forget(&mut self) {
        self.rungs = Vec::new();
    }

    fn norm_at(&self, k: u32) -> f64 {
        halved(self.norm, k)
    }

    fn stiff(&self, k: u32) -> bool {
        self.norm_at(k) > self.limit && k >= self.doubled
    }

    /// Whether a rung is neither a series nor a square.
    fn anew(&mut self, k: u32) -> bool {
        self.stiff(k)
            && ((k - self.doubled).is_multiple_of(ANEW) || !self.stiff(k + 1))
            && self.turned(k) == 0.0
    }

    /// |λ| h/2^k of the fastest oscillation that the approximant would not follow, 0 where it follows all. Where eigenvalues are not
    /// found ‖A h‖₁ may be one.
    fn turned(&mut self, k: u32) -> f64 {
        let (whole, norm) = (&self.whole, self.norm);
        let turning = self.turning.get_or_insert_with(|| {
            let n = whole.columns();
            let whole = DMatrix::from_fn(n, n, |i, j| whole.column(j)[i]);
            let mut found = eigenvalues(&whole).unwrap_or_else(|| vec![Complex::new(0.0, norm)]);
            found.retain(|value| value.im > 0.0);
            found
        });
        let squarings = self.squarings;
        let lost = turning.iter().filter(|value| {
            let exact = (*value * halved(1.0, k)).exp();
            let found = at(*value * halved(1.0, k + squarings)).powu(1 << squarings);
            let off = (found - exact).norm() / exact.norm().max(1.0);
            off.is_nan() || off > TURNS
        });
        halved(lost.map(|value| value.norm()).fold(0.0, f64::max), k)
    }

    /// exp(A h/2^k) − I; `None` if an entry is not finite or a factor is singular.
    pub(crate) fn increment(&mut self, k: u32) -> Option<Dense> {
        let mut increment = self.rung(k)?.clone();
        // Powers of two: no product of them rounds.
        for (j, scale) in self.scale.iter().enumerate() {
            let inverse = scale.recip();
            let column = increment.column_mut(j).iter_mut().zip(&self.scale);
            column.for_each(|(value, scale)| *value *= scale * inverse);
        }
        increment.is_finite().then_some(increment)
    }

    /// Where exp(A h/2^k) is computed anew max|R(t) − R(t/2)²| relative to max(|R(t)|, 1), in the balanced coordinates; where it is a power
    /// because of an oscillation what rounding leaves of the angle that this one turns in 2⁻ᵏ h; else 0.
    pub(crate) fn loss(&mut self, k: u32) -> Option<f64> {
        if !self.anew(k) {
            // The fastest of those because of which this rung or one that it is a power of is a square.
            let (mut fastest, mut rung) = (0.0, k);
            while self.stiff(rung) && !self.anew(rung) {
                fastest = self.turned(rung).max(0.5 * fastest);
                rung += 1;
            }
            return Some(f64::EPSILON * fastest * two_to((rung - k) as i32 - 1));
        }
        let mut twice = squared(self.rung(k + 1)?);
        let rung = self.rung(k)?;
        twice.combine(1.0, -1.0, rung);
        let mut whole = rung.clone();
        whole.shift(1.0);
        Some(twice.amax() / whole.amax().max(1.0))
    }

    /// exp(A h/2^k) − I in the balanced coordinates.
    fn rung(&mut self, k: u32) -> Option<&Dense> {
        if self.rungs.len() <= k as usize {
            self.rungs.resize(k as usize + 1, None);
        }
        if self.rungs[k as usize].is_none() {
            let rung = if self.norm_at(k) <= SERIES {
                self.series(k)
            } else if self.anew(k) {
                let mut rung = subdiagonal(&self.whole, k, self.squarings)?;
                rung.shift(-1.0);
                rung
            } else {
                squared(self.rung(k + 1)?)
            };
            self.rungs[k as usize] = Some(rung);
        }
        self.rungs[k as usize].as_ref()
    }

    /// Σ Z^j/j! − I by Horner's rule, up to terms below [`MISSING`].
    fn series(&self, k: u32) -> Dense {
        let n = self.whole.columns();
        let norm = self.norm_at(k);
        let (mut terms, mut left) = (1, norm * norm / 2.0);
        while left > MISSING {
            terms += 1;
            left *= norm / f64::from(terms + 1);
        }
        let mut z = self.whole.clone();
        z.combine(halved(1.0, k), 0.0, &self.whole);
        let mut sum = z.clone();
        let mut product = Dense::zeros(n, n);
        for j in (2..=terms).rev() {
            // sum ← Z + Z sum/j
            product.set_product(&z, &sum);
            sum.combine(0.0, 1.0, &z);
            sum.combine(1.0, 1.0 / f64::from(j), &product);
        }
        sum
    }
}

/// The ladders of the parts of A that owe nothing to each other.
#[derive(Debug, Clone)]
pub(crate) struct Ladders {
    /// The rows and columns of each.
    parts: Vec<(Vec<usize>, Ladder)>,
}

impl Ladders {
    /// As [`Ladder::new`], of an A in which the states `fast` are not coupled with the others.
    pub(crate) fn new(a: &DMatrix<f64>, fast: &[usize], h: f64, limit: f64, doubled: u32) -> Self {
        let slow = (0..a.nrows()).filter(|j| !fast.contains(j)).collect();
        let parts = [(slow, SQUARINGS), (fast.to_vec(), FAST_SQUARINGS)];
        let parts = parts.into_iter().filter(|(part, _)| !part.is_empty());
        let ladder = |(part, squarings): (Vec<usize>, u32)| {
            let block = a.select_rows(&part).select_columns(&part);
            let ladder = Ladder {
                squarings,
                ..Ladder::new(&block, h, limit, doubled)
            };
            (part, ladder)
        };
        Self {
            parts: parts.map(ladder).collect(),
        }
    }

    /// The largest ‖A h‖₁ after balancing.
    pub(crate) fn norm(&self) -> f64 {
        let norms = self.parts.iter().map(|(_, ladder)| ladder.norm());
        norms.fold(0.0, f64::max)
    }

    /// Gives up what was computed: it is computed again when asked for.
    pub(crate) fn forget(&mut self) {
        self.parts
            .iter_mut()
            .for_each(|(_, ladder)| ladder.forget());
    }

    /// See [`Ladder::increment`].
    pub(crate) fn increment(&mut self, k: u32) -> Option<Dense> {
        if let [(_, ladder)] = &mut self.parts[..] {
            return ladder.increment(k);
        }
        let dim = self.parts.iter().map(|(part, _)| part.len()).sum();
        let mut whole = Dense::zeros(dim, dim);
        for (part, ladder) in &mut self.parts {
            let increment = ladder.increment(k)?;
            for (j, &column) in part.iter().enumerate() {
                let values = part.iter().zip(increment.column(j));
                values.for_each(|(&row, value)| whole.column_mut(column)[row] = *value);
            }
        }
        Some(whole)
    }

    /// The largest [loss](Ladder::loss) of a part.
    pub(crate) fn loss(&mut self, k: u32) -> Option<f64> {
        let mut losses = self.parts.iter_mut().map(|(_, ladder)| ladder.loss(k));
        losses.try_fold(0.0, |most, loss| Some(loss?.max(most)))
    }
}

/// (I + X)² − I.
fn squared(x: &Dense) -> Dense {
    let mut square = Dense::zeros(x.rows(), x.columns());
    square.set_product(x, x);
    square.combine(1.0, 2.0, x);
    square
}

/// Powers of two d such that diag(d)⁻¹ A h diag(d) has rows and columns of like size (Osborne; Parlett and Reinsch,
/// Numer. Math. 13 (1969); a factor is taken where it makes their sum smaller, so that it ends). A column whose row is empty (an input) is scaled down to entries of at most 1.
pub(crate) fn balance(a: &DMatrix<f64>, h: f64) -> Vec<f64> {
    /// Sweeps after which the scaling is as good as it gets for the sizes of circuits.
    const SWEEPS: usize = 40;
    let n = a.nrows();
    let mut d = vec![1.0; n];
    let mut sizes = a.map(|entry| (entry * h).abs());
    sizes.fill_diagonal(0.0);
    for _ in 0..SWEEPS {
        let mut changed = false;
        for (k, d) in d.iter_mut().enumerate() {
            let entries = sizes.as_slice();
            let column: f64 = entries[k * n..(k + 1) * n].iter().sum();
            let row: f64 = entries[k..].iter().step_by(n).sum();
            let (factor, smaller) = if row == 0.0 {
                let factor = power_of_two(1.0 / column);
                (factor, factor < 1.0)
            } else {
                let factor = power_of_two((row / column).sqrt());
                // What gains less than a twentieth may come back in every sweep.
                let sum = column * factor + row / factor;
                (factor, sum < 0.95 * (column + row))
            };
            let scaled = *d * factor;
            if smaller && (1e-120..1e120).contains(&scaled) {
                *d = scaled;
                sizes.column_mut(k).scale_mut(factor);
                sizes.row_mut(k).unscale_mut(factor);
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    d
}

/// Padé [7/8] of exp(z).
fn at(z: Complex<f64>) -> Complex<f64> {
    let one = Complex::new(1.0, 0.0);
    let (zero, pole) = LAST;
    let first = (one - z / zero) / ((one - z / pole) * (one - z / pole.conj()));
    let pairs = PAIRS.iter().map(|&(zero, pole)| {
        let [zeros, poles] = [zero, pole].map(|x| (one - z / x, one - z / x.conj()));
        (zeros.0 / poles.0) * (zeros.1 / poles.1)
    });
    pairs.fold(first, |product, factor| product * factor)
}

/// Padé [7/8] of exp(Z/2^m), Z = A h/2^k, as a product of (Z − z)(Z − p)⁻¹ = I + (p − z)(Z − p)⁻¹ over its zeros and poles,
/// squared m times.
fn subdiagonal(whole: &Dense, k: u32, squarings: u32) -> Option<Dense> {
    let n = whole.columns();
    let mut z = whole.clone();
    z.combine(halved(1.0, k + squarings), 0.0, whole);
    let mut shifted = Shifted::new(n);
    let (zero, pole) = LAST;
    // (Z − z)(Z − p)⁻¹(Z − p̄)⁻¹ = Im((p − z)(Z − p)⁻¹)/Im p, which is −z/|p|² at Z = 0.
    let weight = -pole.norm_sqr() / (zero * pole.im);
    let factor = (pole - zero) * weight;
    let [re, im] = shifted.inverse(&z, pole)?;
    let mut r = re.clone();
    r.combine(factor.im, factor.re, im);
    let (mut square, mut product) = (Dense::zeros(n, n), Dense::zeros(n, n));
    for (zero, pole) in PAIRS {
        let factor = pole - zero;
        let [re, im] = shifted.inverse(&z, pole)?;
        // M = I + (p − z)(Z − p)⁻¹
        let (mut m_re, mut m_im) = (re.clone(), im.clone());
        m_re.combine(factor.re, -factor.im, im);
        m_im.combine(factor.re, factor.im, re);
        m_re.shift(1.0);
        square.set_product(&m_re, &m_re);
        product.set_product(&m_im, &m_im);
        square.add(&product);
        product.set_product(&square, &r);
        r.combine(0.0, pole.norm_sqr() / zero.norm_sqr(), &product);
    }
    for _ in 0..squarings {
        product.set_product(&r, &r);
        std::mem::swap(&mut r, &mut product);
    }
    Some(r)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::tolerances::exponentials::SQUARED;

    fn matrix(dense: &Dense) -> DMatrix<f64> {
        DMatrix::from_fn(dense.rows(), dense.columns(), |i, j| dense.column(j)[i])
    }

    fn whole(a: &DMatrix<f64>, h: f64) -> DMatrix<f64> {
        let increment = Ladder::new(a, h, SQUARED, 0).increment(0).unwrap();
        matrix(&increment) + DMatrix::identity(a.nrows(), a.nrows())
    }

    #[test]
    fn rotation() {
        let omega = 1e4;
        let a = DMatrix::from_row_slice(2, 2, &[0.0, -1e6, 100.0, 0.0]);
        for h in [1e-9, 1e-6, 3.3e-5, 1e-3, 2e-2] {
            let r = whole(&a, h);
            let (s, c) = (omega * h).sin_cos();
            assert!((r[(0, 0)] - c).abs() < 1e-15 * (4.0 + omega * h), "{h}");
            assert!((r[(0, 1)] + 100.0 * s).abs() < 1e-13 * (4.0 + omega * h));
            assert!((r[(1, 0)] - 0.01 * s).abs() < 1e-17 * (4.0 + omega * h));
        }
    }

    /// A coil and a capacitor with a source: rates across of a ratio of 2 are as good as they get, and no sweep moves both on and on.
    #[test]
    fn balancing_ends_where_nothing_is_gained() {
        let a = [-200.0, -2e4, 4.8e5, 1e4, -500.0, 0.0, 0.0, 0.0, 0.0];
        let a = DMatrix::from_row_slice(3, 3, &a);
        for h in [1e-12, 1e-5, 1.0, 1e6] {
            let d = balance(&a, h);
            let balanced = DMatrix::from_fn(3, 3, |i, j| a[(i, j)] * h * d[j] / d[i]);
            assert!(balanced.column(2).amax() <= 2.0, "{h}: {d:?}");
            assert_eq!(balance(&balanced, 1.0), [1.0; 3], "{h}: {d:?}");
            let rates = [(0, 1), (1, 0)].map(|at| balanced[at].abs());
            assert!(
                rates[0] <= 2.0 * rates[1] && rates[1] <= 2.0 * rates[0],
                "{h}: {d:?}"
            );
            assert!(d[0] / d[1] < 16.0 && d[0] < 1e9 && d[1] < 1e9, "{h}: {d:?}");
        }
    }

    /// The approximant would damp these turns to nothing, and its half step would say the same.
    #[test]
    fn turns_of_any_number_keep_their_size() {
        // Beside them something fast that decays, so that the norm says nothing.
        for (fast, omega) in [(1.0, 1e4), (1e9, 30.0), (1e9, 1e3), (1e12, 1e7)] {
            let a = DMatrix::from_row_slice(
                3,
                3,
                &[0.0, -omega, 0.0, omega, 0.0, 0.0, 0.5 * fast, 0.0, -fast],
            );
            let mut ladder = Ladder::new(&a, 1.0, SQUARED, 0);
            for k in 0..6 {
                let angle = halved(omega, k);
                let increment = matrix(&ladder.increment(k).unwrap());
                let off = (increment[(0, 0)] + 1.0 - angle.cos()).abs()
                    + (increment[(1, 0)] - angle.sin()).abs();
                let loss = ladder.loss(k).unwrap();
                assert!(
                    off < 1e-15 * (100.0 + angle),
                    "{fast}, {omega}, {k}: {off:e}"
                );
                assert!(
                    loss < 1e-12 + 4e-16 * angle,
                    "{fast}, {omega}, {k}: {loss:e}"
                );
                assert!((increment[(2, 2)] + 1.0).abs() < 1e-12 || fast < 1e9);
            }
        }
    }

    #[test]
    fn both_approximants_agree_where_both_hold() {
        let a = DMatrix::from_row_slice(3, 3, &[-3.0, 1.0, 0.5, 2.0, -5.0, 1.0, 0.0, 1.0, -0.2]);
        let first = whole(&a, 1.0);
        let second = matrix(&subdiagonal(&Dense::of(&a), 0, SQUARINGS).unwrap());
        assert!((first - second).amax() < 1e-14);
    }

    /// Of e^{−1000} the approximant with 2³ steps leaves 8e-14, its most.
    #[test]
    fn nothing_is_left_of_what_fast_states_apart_were() {
        let a = DMatrix::from_diagonal(&nalgebra::dvector![-1.0, -1e3, -3e3]);
        let increment = Ladders::new(&a, &[1, 2], 1.0, 1.0, 0).increment(0);
        let left = matrix(&increment.unwrap()) + DMatrix::identity(3, 3);
        assert!((left[(0, 0)] - (-1.0_f64).exp()).abs() < 1e-15);
        assert!(left[(1, 1)].abs() < 1e-15 && left[(2, 2)].abs() < 1e-15);
    }

    #[test]
    fn an_input_column_of_any_size_costs_no_accuracy() {
        // x' = −x + 1e12·1
        let a = DMatrix::from_row_slice(2, 2, &[-1.0, 1e12, 0.0, 0.0]);
        let r = whole(&a, 0.5);
        let exact = 1e12 * -(-0.5_f64).exp_m1();
        assert!((r[(0, 1)] / exact - 1.0).abs() < 1e-15);
        assert!((r[(1, 1)] - 1.0).abs() < 1e-15);
    }

    /// A graded RC line: eigenvalues from about 1 to `fast`. Its conductances are those of a symmetric M-matrix.
    fn graded(n: usize, fast: f64) -> DMatrix<f64> {
        let capacitance = |i: usize| fast.powf(-(i as f64) / (n as f64 - 1.0));
        DMatrix::from_fn(n, n, |i, j| {
            let g = if i == j {
                2.0
            } else if i.abs_diff(j) == 1 {
                -1.0
            } else {
                0.0
            };
            -g / capacitance(i)
        })
    }

    #[test]
    fn graded_stiffness_to_1e15() {
        // The same flow by repeated implicit steps is out of reach; the semigroup property at unequal steps with
        // different approximants is the independent check: exp(A(s+t)) = exp(As) exp(At).
        for decades in [3, 6, 9, 12, 15] {
            let a = graded(5, 10f64.powi(decades));
            let (s, t) = (0.7e-2, 0.3e-2 + 0.001);
            let mut ladder = Ladder::new(&a, s + t, SQUARED, 0);
            let loss = ladder.loss(0).unwrap();
            let product = whole(&a, s) * whole(&a, t);
            let exact = whole(&a, s + t);
            let error = (&exact - product).amax() / exact.amax();
            assert!(error < 1e-12, "1e{decades}: {error:e}");
            assert!(loss < 1e-12);
            let squares = Ladder::new(&a, s + t, SQUARED, 4).increment(0).unwrap();
            let squares = matrix(&squares) + DMatrix::identity(5, 5);
            assert!((squares - &exact).amax() / exact.amax() < 1e-12);
            for k in 1..20 {
                let rung = ladder.increment(k).unwrap();
                let anew = whole(&a, halved(s + t, k));
                let rung = matrix(&rung) + DMatrix::identity(5, 5);
                let error = (rung - &anew).amax() / anew.amax();
                assert!(error < 1e-13, "1e{decades}, rung {k}: {error:e}");
            }
        }
    }
}
