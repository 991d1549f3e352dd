//! Arbitrary-precision rationals as a [`Field`]: the oracle and the fallback.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One, Signed, ToPrimitive, Zero};

use super::{Field, Value};

/// An exact number.
pub type Rational = BigRational;

/// The exact number of a finite double; 0 for what is not finite.
#[must_use]
pub fn rational(x: f64) -> Rational {
    BigRational::from_float(x).unwrap_or_else(<Rational as Zero>::zero)
}

impl Value {
    /// The exact number this value stands for.
    #[must_use]
    pub fn exact(&self) -> Rational {
        /// Decimal exponents of finite doubles, with room for the digits of the mantissa.
        const EXPONENTS: std::ops::RangeInclusive<i32> = -400..=400;
        match self.as_decimal() {
            Some((mantissa, exponent)) if EXPONENTS.contains(&exponent) => {
                let power = BigInt::from(10).pow(exponent.unsigned_abs());
                if exponent >= 0 {
                    Rational::from_integer(BigInt::from(mantissa) * power)
                } else {
                    Rational::new(BigInt::from(mantissa), power)
                }
            }
            _ => rational(self.f64),
        }
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
        value.exact()
    }

    fn is_zero(&self) -> bool {
        Zero::is_zero(self)
    }

    fn add(&self, other: &Self) -> Self {
        self + other
    }

    fn mul(&self, other: &Self) -> Self {
        self * other
    }

    fn neg(&self) -> Self {
        -self
    }

    fn sub(&self, other: &Self) -> Self {
        self - other
    }

    fn div(&self, other: &Self) -> Self {
        self / other
    }

    fn to_f64(&self) -> f64 {
        let x = ToPrimitive::to_f64(self).unwrap_or(f64::NAN);
        if x.is_nan() {
            if self.is_negative() {
                f64::MIN
            } else {
                f64::MAX
            }
        } else {
            x
        }
    }

    fn is_precise(&self) -> bool {
        true
    }

    fn radius(&self) -> f64 {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decimal_is_what_was_written() {
        let tenth = Value::decimal(0.1, 1, -1).exact();
        assert_eq!(tenth, Rational::new(1.into(), 10.into()));
        assert_ne!(tenth, rational(0.1));
        assert_eq!(
            Value::decimal(4700.0, 47, 2).exact(),
            Rational::from_integer(4700.into())
        );
        assert_eq!(Value::binary(0.1).exact(), rational(0.1));
    }
}
