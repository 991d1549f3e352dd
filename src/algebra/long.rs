//! Numbers of 256 binary digits, for what double-doubles lose.

use num_bigint::BigInt;
use num_traits::{One, ToPrimitive};

use super::{Digits, Rational, rational};

/// `mantissa · 2^exponent` with a mantissa of at most 256 digits.
#[derive(Debug, Clone)]
pub struct Long {
    mantissa: BigInt,
    exponent: i64,
}

/// Binary digits of a mantissa.
const BITS: u64 = 256;

impl Long {
    /// Without the digits that a mantissa has no room for.
    fn rounded(mantissa: BigInt, exponent: i64) -> Self {
        let excess = mantissa.bits().saturating_sub(BITS);
        Self {
            mantissa: mantissa >> excess,
            exponent: exponent + excess as i64,
        }
    }

    /// Above all digits.
    fn top(&self) -> i64 {
        self.exponent + self.mantissa.bits() as i64
    }
}

impl Digits for Long {
    /// What a mantissa has no room for is less than its last digit.
    const ROUNDING: f64 = 1.727_233_711_018_889e-77; // 2^-255

    fn double(x: f64) -> Self {
        Self::nearest(&rational(x)).0
    }

    fn nearest(exact: &Rational) -> (Self, f64) {
        let (numerator, denominator) = (exact.numer(), exact.denom());
        if denominator.is_one() && numerator.bits() <= BITS {
            return (Self::rounded(numerator.clone(), 0), 0.0);
        }
        let missing = (BITS + 1 + denominator.bits()).saturating_sub(numerator.bits());
        let value = Self::rounded((numerator << missing) / denominator, -(missing as i64));
        // What the quotient and the mantissa have no room for.
        let radius = 2.0 * Self::ROUNDING * value.to_f64().abs();
        (value, radius)
    }

    fn plus(&self, other: &Self) -> Self {
        let (a, b) = if self.exponent >= other.exponent {
            (self, other)
        } else {
            (other, self)
        };
        let bits = BITS as i64;
        if b.top() < a.top() - bits {
            return a.clone();
        }
        if a.top() < b.top() - bits {
            return b.clone();
        }
        let sum = (&a.mantissa << (a.exponent - b.exponent)) + &b.mantissa;
        Self::rounded(sum, b.exponent)
    }

    fn times(&self, other: &Self) -> Self {
        let exponent = self.exponent + other.exponent;
        Self::rounded(&self.mantissa * &other.mantissa, exponent)
    }

    fn negated(&self) -> Self {
        Self {
            mantissa: -&self.mantissa,
            exponent: self.exponent,
        }
    }

    fn recip(&self) -> Self {
        let quotient = (BigInt::one() << (2 * BITS + 1)) / &self.mantissa;
        Self::rounded(quotient, -(2 * BITS as i64 + 1) - self.exponent)
    }

    fn is_unit(&self) -> bool {
        self.exponent == 0 && self.mantissa.magnitude().is_one()
    }

    fn to_f64(&self) -> f64 {
        let half = self.exponent / 2;
        let power = |exponent: i64| match exponent {
            // The exponent of a normal double stands above the 52 digits of its mantissa.
            -1022..=1023 => f64::from_bits(((exponent + 1023) as u64) << 52),
            _ => 2_f64.powi(exponent.clamp(-9999, 9999) as i32),
        };
        self.mantissa.to_f64().unwrap_or(f64::NAN) * power(half) * power(self.exponent - half)
    }

    #[cfg(test)]
    fn exact(&self) -> Rational {
        let power = Rational::from_integer(BigInt::one() << self.exponent.unsigned_abs());
        let mantissa = Rational::from_integer(self.mantissa.clone());
        if self.exponent < 0 {
            mantissa / power
        } else {
            mantissa * power
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fractions would have thousands of digits.
    #[test]
    fn numbers_stay_as_short_as_they_are_made() {
        let third = Long::nearest(&Rational::new(1.into(), 3.into())).0;
        let (mut x, mut exact) = (third.clone(), third.exact());
        for _ in 0..6 {
            x = x.times(&x).plus(&third).recip();
            exact = (&exact * &exact + third.exact()).recip();
            assert!(x.mantissa.bits() <= BITS, "{x:?}");
        }
        assert!(exact.numer().bits() > 10 * BITS);
        let off = x.exact() / exact - rational(1.0);
        assert!(off != rational(0.0) && off.to_f64().unwrap().abs() < 1e-73);
    }
}
