//! Numbers with an exact zero test and an error bound: a residue, a double-double and a radius.

use num_bigint::BigInt;
use num_traits::{Float, Signed, ToPrimitive};

use super::{Digits, Double, Field, Long, Rational, Value};
use crate::settings::tolerances::ranks::BALL_KNOWN;

/// An element of ℚ known by its residue modulo p = 2⁶¹ − 1 and by an interval.
///
/// The residue decides what is 0: a nonzero residue proves the number nonzero, and a number whose residue is 0 is
/// taken to be exactly 0 (a wrong zero needs a numerator divisible by p: probability about 4·10⁻¹⁹ a test). The interval
/// `value ± radius` always contains the exact number; where it becomes too wide the computation is repeated over
/// [`Rational`].
///
/// One made by [`inexact`](Interval::inexact) stands for a measured double; it has no residue, and counts as 0 as soon as its
/// interval contains 0.
#[derive(Debug, Clone, Copy)]
pub struct Interval<V> {
    residue: u64,
    value: V,
    radius: f64,
}

/// An interval around a double-double, 30 digits.
pub type Ball = Interval<Double>;

/// An interval around 75 digits.
pub type LongBall = Interval<Long>;

/// The Mersenne prime 2⁶¹ − 1.
const P: u64 = (1 << 61) - 1;
/// In place of a residue: the number is known by its interval only.
const INEXACT: u64 = u64::MAX;
/// Covers the rounding of the radius computations themselves.
const UP: f64 = 1.0 + 8.0 * f64::EPSILON;

fn mul_mod(a: u64, b: u64) -> u64 {
    let x = u128::from(a) * u128::from(b);
    let s = (x as u64 & P) + (x >> 61) as u64;
    if s >= P { s - P } else { s }
}

fn add_mod(a: u64, b: u64) -> u64 {
    let s = a + b;
    if s >= P { s - P } else { s }
}

fn neg_mod(a: u64) -> u64 {
    if a == 0 { 0 } else { P - a }
}

/// a⁻¹ = a^(p−2), p − 2 = 4 (2⁵⁹ − 1) + 1.
fn inv_mod(a: u64) -> u64 {
    // Most pivots of a circuit's incidence are units.
    if a == 1 || a == P - 1 {
        return a;
    }
    let square = |x: u64, times: u32| (0..times).fold(x, |x, _| mul_mod(x, x));
    // a^(2^(2k) − 1) and a^(2^(k + 1) − 1) from a^(2^k − 1); 59 is 111011 in binary.
    let double = |x: u64, k: u32| mul_mod(square(x, k), x);
    let next = |x: u64| mul_mod(square(x, 1), a);
    let x3 = next(double(a, 1));
    let x7 = next(double(x3, 3));
    let x14 = double(x7, 7);
    let x29 = next(double(x14, 14));
    let x59 = next(double(x29, 29));
    mul_mod(square(x59, 2), a)
}

fn residue_of(n: &BigInt) -> u64 {
    let r = (n.abs() % P).to_u64().unwrap_or(0);
    if n.is_negative() { neg_mod(r) } else { r }
}

impl<V: Digits> Interval<V> {
    /// A double known to half a unit in the last place; integers of up to 2⁵³ are taken as exact.
    #[must_use]
    pub fn inexact(x: f64) -> Self {
        /// Integers from here on may be rounded.
        const EXACT_INTEGERS: f64 = 9_007_199_254_740_992.0;
        if x.fract() == 0.0 && x.abs() < EXACT_INTEGERS {
            return Self::exactly(x);
        }
        Self {
            residue: INEXACT,
            value: V::double(x),
            radius: x.abs() * f64::EPSILON / 2.0,
        }
    }

    /// The ball around an exact number.
    #[must_use]
    pub fn from_rational(exact: &Rational) -> Self {
        let (value, radius) = V::nearest(exact);
        let denominator = residue_of(exact.denom());
        Self {
            residue: mul_mod(residue_of(exact.numer()), inv_mod(denominator)),
            value,
            radius,
        }
        .settle()
    }

    /// The ball around a double m 2^e, and 0 where it is not finite: modulo p, 2^61 is 1.
    fn exactly(x: f64) -> Self {
        if x == 0.0 || !x.is_finite() {
            return Self::zero();
        }
        let (mantissa, exponent, _) = x.integer_decode();
        let power = 1 << i32::from(exponent).rem_euclid(61);
        let residue = mul_mod(mantissa, power);
        Self {
            residue: if x < 0.0 { neg_mod(residue) } else { residue },
            value: V::double(x),
            radius: 0.0,
        }
    }

    /// The ball around mantissa · 10^exponent where both are exact doubles.
    fn decimal(mantissa: i128, exponent: i32) -> Option<Self> {
        /// 10^22 is the largest power of ten among the doubles.
        const POWERS: u32 = 22;
        let size = exponent.unsigned_abs();
        if mantissa.unsigned_abs() >= 1 << 53 || size > POWERS {
            return None;
        }
        let (mut residue, mut value) = (1, 1.0);
        for _ in 0..size {
            residue = mul_mod(residue, 10);
            value *= 10.0;
        }
        let power = Self {
            residue,
            value: V::double(value),
            radius: 0.0,
        };
        let mantissa = Self::exactly(mantissa as f64);
        Some(if exponent < 0 {
            mantissa.div(&power)
        } else {
            mantissa.mul(&power)
        })
    }

    /// 1/self.
    fn recip(&self) -> Self {
        if self.radius == 0.0 && self.value.is_unit() {
            return self.clone();
        }
        let value = self.value.recip();
        let size = self.value.to_f64().abs();
        // |1/x − 1/(x ± r)| ≤ r / (|x| (|x| − r)); an interval that contains 0 has no bound.
        let spread = if self.radius < size {
            self.radius / (size * (size - self.radius))
        } else {
            f64::INFINITY
        };
        Self {
            residue: if self.residue == INEXACT {
                INEXACT
            } else {
                inv_mod(self.residue)
            },
            radius: (spread + value.to_f64().abs() * V::ROUNDING) * UP,
            value,
        }
    }

    /// Brings a result into the form in which 0 has no radius.
    fn settle(self) -> Self {
        let zero = match self.residue {
            0 => true,
            INEXACT => self.value.to_f64().abs() <= self.radius,
            _ => false,
        };
        if zero { Self::zero() } else { self }
    }

    fn bound(&self) -> f64 {
        self.value.to_f64().abs() + self.radius
    }
}

impl<V: Digits> Field for Interval<V> {
    fn zero() -> Self {
        Self {
            residue: 0,
            value: V::double(0.0),
            radius: 0.0,
        }
    }

    fn one() -> Self {
        Self {
            residue: 1,
            value: V::double(1.0),
            radius: 0.0,
        }
    }

    fn value(value: Value) -> Self {
        match value.as_decimal() {
            Some((m, e)) => {
                Self::decimal(m, e).unwrap_or_else(|| Self::from_rational(&value.exact()))
            }
            None => Self::exactly(value.f64),
        }
    }

    fn is_zero(&self) -> bool {
        self.residue == 0
    }

    fn add(&self, other: &Self) -> Self {
        if self.is_zero() {
            return other.clone();
        }
        if other.is_zero() {
            return self.clone();
        }
        let value = self.value.plus(&other.value);
        let inexact = self.residue == INEXACT || other.residue == INEXACT;
        Self {
            residue: if inexact {
                INEXACT
            } else {
                add_mod(self.residue, other.residue)
            },
            radius: (self.radius + other.radius + value.to_f64().abs() * V::ROUNDING) * UP,
            value,
        }
        .settle()
    }

    fn mul(&self, other: &Self) -> Self {
        if self.is_zero() || other.is_zero() {
            return Self::zero();
        }
        let value = self.value.times(&other.value);
        let inexact = self.residue == INEXACT || other.residue == INEXACT;
        Self {
            residue: if inexact {
                INEXACT
            } else {
                mul_mod(self.residue, other.residue)
            },
            radius: (self.bound() * other.radius
                + self.radius * other.value.to_f64().abs()
                + value.to_f64().abs() * V::ROUNDING
                + f64::MIN_POSITIVE)
                * UP,
            value,
        }
        .settle()
    }

    fn neg(&self) -> Self {
        let residue = if self.residue == INEXACT {
            INEXACT
        } else {
            neg_mod(self.residue)
        };
        Self {
            residue,
            value: self.value.negated(),
            radius: self.radius,
        }
    }

    fn sub(&self, other: &Self) -> Self {
        self.add(&other.neg())
    }

    fn div(&self, other: &Self) -> Self {
        self.mul(&other.recip())
    }

    fn to_f64(&self) -> f64 {
        self.value.to_f64()
    }

    fn is_precise(&self) -> bool {
        let size = self.value.to_f64().abs();
        self.residue == INEXACT && size.is_finite() || self.radius <= BALL_KNOWN * size
    }

    fn radius(&self) -> f64 {
        self.radius
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::algebra::{Value as Number, rational};

    fn contains<V: Digits>(ball: &Interval<V>, exact: &Rational) -> bool {
        let error = exact - ball.value.exact();
        error.abs() <= rational(ball.radius)
    }

    /// Whether the interval contains what exact arithmetic gives, and its zeros are those.
    fn encloses<V: Digits>([a, b, c]: [&Rational; 3]) -> Result<(), TestCaseError> {
        let [x, y, z] = [a, b, c].map(Interval::<V>::from_rational);
        let mut w = x;
        w.sub_mul(&y, &z);
        let exact = a - b * c;
        prop_assert!(contains(&w, &exact));
        prop_assert_eq!(w.is_zero(), exact == rational(0.0));
        if !w.is_zero() {
            let inverse = exact.recip();
            prop_assert!(contains(&w.recip(), &inverse));
            prop_assert!(w.recip().mul(&w).add(&Interval::one().neg()).is_zero());
        }
        Ok(())
    }

    #[test]
    fn cancellation_to_nothing_is_exactly_zero() {
        let third = Ball::from_rational(&Rational::new(1.into(), 3.into()));
        let mut x = Ball::one();
        x.sub_mul(&third, &Ball::from_rational(&rational(3.0)));
        assert!(x.is_zero());
        assert_eq!(x.to_f64(), 0.0);
    }

    #[test]
    fn cancellation_to_something_tiny_is_not_zero_and_not_precise() {
        // 1/3 · 3 − (1 − 10⁻⁴⁰): nonzero, far below double-double resolution.
        let third = Ball::from_rational(&Rational::new(1.into(), 3.into()));
        let tiny = Rational::new(1.into(), BigInt::from(10).pow(40));
        let mut x = Ball::from_rational(&(rational(1.0) - tiny));
        x.sub_mul(&third, &Ball::from_rational(&rational(3.0)));
        assert!(!x.is_zero());
        assert!(!x.is_precise());
    }

    #[test]
    fn what_cancels_in_a_double_double_is_known_in_a_long_ball() {
        // 1/3 · 3 − (1 − 10⁻⁴⁰) again, and a cancellation that 75 digits do not show either.
        for (digits, known) in [(40, true), (80, false)] {
            let third = LongBall::from_rational(&Rational::new(1.into(), 3.into()));
            let tiny = Rational::new(1.into(), BigInt::from(10).pow(digits));
            let mut x = LongBall::from_rational(&(rational(1.0) - tiny));
            x.sub_mul(&third, &LongBall::from_rational(&rational(3.0)));
            assert!(!x.is_zero());
            assert_eq!(x.is_precise(), known, "{x:?}");
        }
    }

    #[test]
    fn inexact_doubles_vanish_within_their_error() {
        let x = Ball::inexact(0.1)
            .add(&Ball::inexact(0.2))
            .add(&Ball::inexact(-0.3));
        assert!(x.is_zero());
        assert!(!Ball::inexact(1.0).add(&Ball::inexact(-2.0)).is_zero());
    }

    fn number() -> impl Strategy<Value = Rational> {
        (-999i64..1000, 1i64..1000, -15i32..13).prop_map(|(n, d, e)| {
            Rational::new(n.into(), d.into()) * Number::decimal(0.0, 1, e).exact()
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 256, failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))), ..Default::default() })]
        #[test]
        fn a_short_decimal_is_the_rational(mantissa in -(1i128 << 54)..1 << 54, exponent in -25i32..26) {
            let value = Number::decimal(0.0, mantissa, exponent);
            let (ball, exact) = (<Ball as Field>::value(value), value.exact());
            let slow = Ball::from_rational(&exact);
            prop_assert_eq!((ball.residue, ball.value.hi), (slow.residue, slow.value.hi));
            prop_assert!(contains(&ball, &exact));
            prop_assert!(ball.radius <= 1e-29 * ball.value.hi.abs());
        }

        #[test]
        fn a_double_is_the_rational(x in prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO) {
            let (ball, slow) = (<Ball as Field>::value(x.into()), Ball::from_rational(&rational(x)));
            prop_assert_eq!((ball.residue, ball.value, ball.radius), (slow.residue, slow.value, slow.radius));
        }

        #[test]
        fn the_interval_contains_the_exact_result(a in number(), b in number(), c in number()) {
            encloses::<Double>([&a, &b, &c])?;
            encloses::<Long>([&a, &b, &c])?;
        }
    }
}
