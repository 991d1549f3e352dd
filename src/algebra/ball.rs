//! A number known three ways: its residue modulo a prime, a double-double, and a bound on the latter's error.

use super::{Field, Value};

/// 2^61 − 1. A rational whose numerator this prime divides would be taken for zero; values with at most a few dozen
/// decimal digits meet that with probability about 2^−61 per test, and the choice is the same on every run.
const PRIME: u64 = (1 << 61) - 1;
/// Half the spacing of double-double numbers at 1, with room for one more rounding.
const ROUND: f64 = 1.0 / (1u128 << 101) as f64;

/// See the module.
#[derive(Debug, Clone, Copy)]
pub struct Ball {
    residue: u64,
    hi: f64,
    lo: f64,
    /// |hi + lo − exact| ≤ err.
    err: f64,
}

fn reduce(x: u128) -> u64 {
    let folded = (x & u128::from(PRIME)) as u64 + (x >> 61) as u64;
    if folded >= PRIME {
        folded - PRIME
    } else {
        folded
    }
}

fn mul_mod(a: u64, b: u64) -> u64 {
    reduce(u128::from(a) * u128::from(b))
}

fn add_mod(a: u64, b: u64) -> u64 {
    let s = a + b;
    if s >= PRIME { s - PRIME } else { s }
}

fn pow_mod(mut base: u64, mut exponent: u64) -> u64 {
    let mut power = 1;
    while exponent > 0 {
        if exponent & 1 == 1 {
            power = mul_mod(power, base);
        }
        base = mul_mod(base, base);
        exponent >>= 1;
    }
    power
}

/// Inverse by Fermat's little theorem.
fn invert(a: u64) -> u64 {
    pow_mod(a, PRIME - 2)
}

fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let bb = s - a;
    (s, (a - (s - bb)) + (b - bb))
}

fn quick_two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    (s, b - (s - a))
}

fn two_prod(a: f64, b: f64) -> (f64, f64) {
    let p = a * b;
    (p, a.mul_add(b, -p))
}

/// Residue of `|m|·base^exponent` with sign.
fn residue_of(mantissa: i128, base: u64, exponent: i32) -> u64 {
    let magnitude = reduce_wide(mantissa.unsigned_abs());
    let mut power = pow_mod(base, u64::from(exponent.unsigned_abs()));
    if exponent < 0 {
        power = invert(power);
    }
    let r = mul_mod(magnitude, power);
    if mantissa < 0 && r != 0 { PRIME - r } else { r }
}

fn reduce_wide(x: u128) -> u64 {
    reduce(u128::from(reduce(x & ((1 << 122) - 1))) + (x >> 122))
}

/// The exact `mantissa · 2^exponent` of a finite double.
pub(super) fn decompose(x: f64) -> (i128, i32) {
    let bits = x.to_bits();
    let exponent = ((bits >> 52) & 0x7ff) as i32;
    let fraction = i128::from(bits & ((1 << 52) - 1));
    let (mantissa, exponent) = if exponent == 0 {
        (fraction, -1074)
    } else {
        (fraction | (1 << 52), exponent - 1075)
    };
    (if x < 0.0 { -mantissa } else { mantissa }, exponent)
}

impl Ball {
    const fn new(residue: u64, hi: f64, lo: f64, err: f64) -> Self {
        Self {
            residue,
            hi,
            lo,
            err,
        }
    }

    /// The exact sum of two doubles.
    #[must_use]
    pub fn from_pair(hi: f64, lo: f64) -> Self {
        Self::from_double(hi).add(&Self::from_double(lo))
    }

    /// The exact binary rational of a double.
    #[must_use]
    pub fn from_double(x: f64) -> Self {
        let (mantissa, exponent) = decompose(x);
        Self::new(residue_of(mantissa, 2, exponent), x, 0.0, 0.0)
    }

    /// A double known to half a unit in its last place only: rank decisions treat what cancels to below the bound as zero.
    #[must_use]
    pub fn rounded(x: f64) -> Self {
        let mut ball = Self::from_double(x);
        ball.err = x.abs() * (f64::EPSILON / 2.0);
        ball
    }

    /// The result of an operation; a zero residue is an exact zero.
    fn settled(residue: u64, hi: f64, lo: f64, err: f64) -> Self {
        if residue == 0 {
            return Self::zero();
        }
        Self::new(residue, hi, lo, err + hi.abs() * ROUND)
    }
}

impl Field for Ball {
    fn zero() -> Self {
        Self::new(0, 0.0, 0.0, 0.0)
    }

    fn one() -> Self {
        Self::new(1, 1.0, 0.0, 0.0)
    }

    fn value(value: Value) -> Self {
        let Some((mantissa, exponent)) = value.decimal else {
            return Self::from_double(value.f64);
        };
        if mantissa == 0 {
            return Self::zero();
        }
        // The mantissa is exact in a double-double up to 106 bits; powers of ten up to 10^22 are exact doubles.
        let high = mantissa as f64;
        let low = (mantissa - high as i128) as f64;
        let mut number = Self::new(residue_of(mantissa, 10, 0), high, low, high.abs() * ROUND);
        let mut left = exponent;
        while left != 0 {
            let step = left.clamp(-22, 22);
            let ten = Self::new(
                pow_mod(10, u64::from(step.unsigned_abs())),
                10f64.powi(step.abs()),
                0.0,
                0.0,
            );
            number = if step > 0 {
                number.mul(&ten)
            } else {
                number.div(&ten)
            };
            left -= step;
        }
        number
    }

    fn add(&self, other: &Self) -> Self {
        let (s, e) = two_sum(self.hi, other.hi);
        let (t, f) = two_sum(self.lo, other.lo);
        let (s, e) = quick_two_sum(s, e + t);
        let (s, e) = quick_two_sum(s, e + f);
        // The rounding of a sum is relative to the operands, not to a cancelled result.
        let rounding = (self.hi.abs() + other.hi.abs()) * ROUND;
        Self::settled(
            add_mod(self.residue, other.residue),
            s,
            e,
            self.err + other.err + rounding,
        )
    }

    fn sub(&self, other: &Self) -> Self {
        self.add(&other.neg())
    }

    fn mul(&self, other: &Self) -> Self {
        let (p, e) = two_prod(self.hi, other.hi);
        let (p, e) = quick_two_sum(p, e + (self.hi * other.lo + self.lo * other.hi));
        let err = self.hi.abs() * other.err + other.hi.abs() * self.err + self.err * other.err;
        Self::settled(
            mul_mod(self.residue, other.residue),
            p,
            e,
            err * (1.0 + f64::EPSILON) + 4.0 * p.abs() * ROUND,
        )
    }

    fn div(&self, other: &Self) -> Self {
        let q1 = self.hi / other.hi;
        let (p, e) = two_prod(q1, other.hi);
        let (r, f) = two_sum(self.hi, -p);
        let r = r + (f + self.lo - e - q1 * other.lo);
        let q2 = r / other.hi;
        let (q, ql) = quick_two_sum(q1, q2);
        let (p, e) = two_prod(q, other.hi);
        let (r, f) = two_sum(self.hi, -p);
        let r = r + (f + self.lo - e - q * other.lo - ql * other.hi);
        let (q, ql) = quick_two_sum(q, ql + r / other.hi);
        let divisor = (other.hi.abs() - other.err).max(f64::MIN_POSITIVE);
        let err = (self.err + q.abs() * other.err) / divisor;
        let residue = mul_mod(self.residue, invert(other.residue));
        Self::settled(
            residue,
            q,
            ql,
            err * (1.0 + f64::EPSILON) + 8.0 * q.abs() * ROUND,
        )
    }

    fn neg(&self) -> Self {
        let residue = if self.residue == 0 {
            0
        } else {
            PRIME - self.residue
        };
        Self::new(residue, -self.hi, -self.lo, self.err)
    }

    fn is_zero(&self) -> bool {
        self.residue == 0
    }

    fn to_f64(&self) -> f64 {
        self.hi
    }

    fn error(&self) -> f64 {
        self.err
    }
}
