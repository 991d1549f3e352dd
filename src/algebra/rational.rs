//! Exact rationals: the oracle and the last resort of an elimination.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One, Pow, ToPrimitive, Zero};

use super::ball::decompose;
use super::{Field, Value};

/// An arbitrary-precision rational.
pub type Rational = BigRational;

fn power(base: u32, exponent: i32) -> Rational {
    let p = BigInt::from(base).pow(exponent.unsigned_abs());
    if exponent < 0 {
        Rational::new(BigInt::one(), p)
    } else {
        Rational::from(p)
    }
}

impl Field for Rational {
    fn zero() -> Self {
        Zero::zero()
    }

    fn one() -> Self {
        One::one()
    }

    fn value(value: Value) -> Self {
        match value.decimal {
            Some((mantissa, exponent)) => Self::from(BigInt::from(mantissa)) * power(10, exponent),
            None => {
                let (mantissa, exponent) = decompose(value.f64);
                Self::from(BigInt::from(mantissa)) * power(2, exponent)
            }
        }
    }

    fn add(&self, other: &Self) -> Self {
        self + other
    }

    fn sub(&self, other: &Self) -> Self {
        self - other
    }

    fn mul(&self, other: &Self) -> Self {
        self * other
    }

    fn div(&self, other: &Self) -> Self {
        self / other
    }

    fn neg(&self) -> Self {
        -self
    }

    fn is_zero(&self) -> bool {
        Zero::is_zero(self)
    }

    fn to_f64(&self) -> f64 {
        ToPrimitive::to_f64(self).unwrap_or(f64::NAN)
    }

    fn error(&self) -> f64 {
        0.0
    }
}
