//! exp(A h) − I for small dense A, accurate when the eigenvalues of A h lie many decades apart.
//!
//! The difference from the identity is kept: where steps are short it carries digits that exp(A h) itself would drop, and
//! a run of many steps would lose them systematically.

use nalgebra::{Complex, DMatrix};

/// ‖A h‖₁ up to which scaling and squaring of the diagonal Padé approximant [13/13] is used: its loss, about
/// 2.5e-17·‖A h‖, stays near rounding below this.
const DIAGONAL_LIMIT: f64 = 1e3;

/// Largest ‖Z‖₁ for which the diagonal approximant [13/13] of exp(Z) is exact to rounding (Higham, SIAM J. Matrix Anal.
/// Appl. 26 (2005), table 2.3).
const THETA_13: f64 = 5.371_920_351_148_152;

/// Coefficients of the numerator of the [13/13] approximant.
const PADE_13: [f64; 14] = [
    64_764_752_532_480_000.0,
    32_382_376_266_240_000.0,
    7_771_770_303_897_600.0,
    1_187_353_796_428_800.0,
    129_060_195_264_000.0,
    10_559_470_521_600.0,
    670_442_572_800.0,
    33_522_128_640.0,
    1_323_241_920.0,
    40_840_800.0,
    960_960.0,
    16_380.0,
    182.0,
    1.0,
];

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

/// Squarings of the [7/8] approximant: with 2³ steps its error on the whole negative axis is below 1e-13.
const SQUARINGS: u32 = 3;

/// exp(A h) − I, and what is known about its error.
#[derive(Debug, Clone)]
pub(crate) struct Exponential {
    /// exp(A h) − I.
    pub(crate) increment: DMatrix<f64>,
    /// Where A h is stiff: max|R(h) − R(h/2)²| relative to max|R(h)|, in the balanced coordinates.
    pub(crate) loss: Option<f64>,
}

/// exp(A h) − I. `None` if an entry is not finite or a factor is singular.
///
/// Diagonal Padé [13/13] with scaling and squaring for ‖A h‖₁ ≤ 1e3 after balancing; beyond, the L-stable sub-diagonal
/// approximant [7/8] in product form with 2³ squarings, whose cost does not grow with ‖A h‖ and whose error is not
/// multiplied by it when A is graded (spread storage elements).
pub(crate) fn exponential(a: &DMatrix<f64>, h: f64) -> Option<Exponential> {
    let scale = balance(a, h);
    let z = DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| {
        a[(i, j)] * h * scale[j] / scale[i]
    });
    let norm = norm_1(&z);
    if !norm.is_finite() {
        return None;
    }
    let (mut r, loss) = if norm <= DIAGONAL_LIMIT {
        (diagonal(&z, norm)?, None)
    } else {
        let whole = subdiagonal(&z)?;
        let half = subdiagonal(&(&z * 0.5))?;
        let twice = &half * &half;
        let loss = (&twice - &whole).amax() / whole.amax().max(f64::MIN_POSITIVE);
        let identity = DMatrix::identity(z.nrows(), z.nrows());
        (whole - identity, Some(loss))
    };
    for j in 0..r.ncols() {
        for i in 0..r.nrows() {
            r[(i, j)] *= scale[i] / scale[j];
        }
    }
    r.iter()
        .all(|v| v.is_finite())
        .then_some(Exponential { increment: r, loss })
}

/// Powers of two d such that diag(d)⁻¹ A h diag(d) has rows and columns of like size (Osborne; Parlett and Reinsch,
/// Numer. Math. 13 (1969)). A column whose row is empty (an input) is scaled down to entries of at most 1.
pub(crate) fn balance(a: &DMatrix<f64>, h: f64) -> Vec<f64> {
    /// Sweeps after which the scaling is as good as it gets for the sizes of circuits.
    const SWEEPS: usize = 40;
    let n = a.nrows();
    let mut d = vec![1.0; n];
    let entry = |d: &[f64], i: usize, j: usize| (a[(i, j)] * h * d[j] / d[i]).abs();
    for _ in 0..SWEEPS {
        let mut changed = false;
        for k in 0..n {
            let column: f64 = (0..n).filter(|&i| i != k).map(|i| entry(&d, i, k)).sum();
            let row: f64 = (0..n).filter(|&j| j != k).map(|j| entry(&d, k, j)).sum();
            let factor = if column == 0.0 {
                1.0
            } else if row == 0.0 {
                if column > 1.0 {
                    power_of_two(1.0 / column)
                } else {
                    1.0
                }
            } else {
                power_of_two((row / column).sqrt())
            };
            let scaled = d[k] * factor;
            if !(0.7..=1.5).contains(&factor) && (1e-120..1e120).contains(&scaled) {
                d[k] = scaled;
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    d
}

/// The power of two nearest to `x` in the logarithm, 1 where that is not finite.
fn power_of_two(x: f64) -> f64 {
    let exponent = x.log2().round();
    if exponent.is_finite() {
        exponent.clamp(-900.0, 900.0).exp2()
    } else {
        1.0
    }
}

/// Largest absolute column sum.
pub(crate) fn norm_1(a: &DMatrix<f64>) -> f64 {
    a.column_iter()
        .map(|c| c.iter().map(|v| v.abs()).sum::<f64>())
        .fold(0.0, f64::max)
}

/// Padé [13/13] with scaling and squaring (Higham 2005, algorithm 2.3), less the identity: r − I = (V − U)⁻¹ 2U, and
/// (I + X)² − I = 2X + X².
fn diagonal(z: &DMatrix<f64>, norm: f64) -> Option<DMatrix<f64>> {
    let squarings = if norm > THETA_13 {
        (norm / THETA_13).log2().ceil() as i32
    } else {
        0
    };
    let z = z * (-f64::from(squarings)).exp2();
    let identity = DMatrix::identity(z.nrows(), z.nrows());
    let b = &PADE_13;
    let z2 = &z * &z;
    let z4 = &z2 * &z2;
    let z6 = &z4 * &z2;
    let u = &z
        * (&z6 * (&z6 * b[13] + &z4 * b[11] + &z2 * b[9])
            + &z6 * b[7]
            + &z4 * b[5]
            + &z2 * b[3]
            + &identity * b[1]);
    let v = &z6 * (&z6 * b[12] + &z4 * b[10] + &z2 * b[8])
        + &z6 * b[6]
        + &z4 * b[4]
        + &z2 * b[2]
        + &identity * b[0];
    let mut r = (&v - &u).lu().solve(&(&u * 2.0))?;
    for _ in 0..squarings {
        r = &r * &r + &r * 2.0;
    }
    Some(r)
}

/// Padé [7/8] of exp(Z/8) as a product of (Z − z)(Z − p)⁻¹ = I + (p − z)(Z − p)⁻¹ over its zeros and poles, squared three
/// times.
fn subdiagonal(z: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = z.nrows();
    let z = z.map(|v| Complex::new(v / f64::from(1_u32 << SQUARINGS), 0.0));
    let shifted_inverse = |pole: Complex<f64>| {
        let mut shifted = z.clone();
        for i in 0..n {
            shifted[(i, i)] -= pole;
        }
        shifted.lu().try_inverse()
    };
    let (zero, pole) = LAST;
    // (Z − z)(Z − p)⁻¹(Z − p̄)⁻¹ = Im((p − z)(Z − p)⁻¹)/Im p, which is −z/|p|² at Z = 0.
    let weight = -pole.norm_sqr() / (zero * pole.im);
    let factor = (pole - zero) * weight;
    let mut r = shifted_inverse(pole)?.map(|v| (v * factor).im);
    for (zero, pole) in PAIRS {
        let mut m = shifted_inverse(pole)? * (pole - zero);
        for i in 0..n {
            m[(i, i)] += 1.0;
        }
        let (re, im) = (m.map(|v| v.re), m.map(|v| v.im));
        r = (&re * &re + &im * &im) * r * (pole.norm_sqr() / zero.norm_sqr());
    }
    for _ in 0..SQUARINGS {
        r = &r * &r;
    }
    Some(r)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn whole(a: &DMatrix<f64>, h: f64) -> DMatrix<f64> {
        exponential(a, h).unwrap().increment + DMatrix::identity(a.nrows(), a.nrows())
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

    #[test]
    fn both_approximants_agree_where_both_hold() {
        let a = DMatrix::from_row_slice(3, 3, &[-3.0, 1.0, 0.5, 2.0, -5.0, 1.0, 0.0, 1.0, -0.2]);
        let first = diagonal(&a, norm_1(&a)).unwrap() + DMatrix::identity(3, 3);
        let second = subdiagonal(&a).unwrap();
        assert!((first - second).amax() < 1e-14);
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
            let sum = exponential(&a, s + t).unwrap();
            let product = whole(&a, s) * whole(&a, t);
            let exact = whole(&a, s + t);
            let error = (&exact - product).amax() / exact.amax();
            assert!(error < 1e-12, "1e{decades}: {error:e}");
            assert!(sum.loss.unwrap_or(0.0) < 1e-12);
        }
    }
}
