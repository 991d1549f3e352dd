//! Double-double arithmetic: an unevaluated sum of two doubles, 106 bits.

use super::{Digits, Field, Rational, rational};

/// `hi + lo` with |lo| ≤ ½ ulp(hi).
///
/// # References
/// Dekker, *A floating-point technique for extending the available precision* (1971); error bounds of Joldes,
/// Muller and Popescu, *Tight and rigorous error bounds for basic building blocks of double-word arithmetic* (2017).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Double {
    /// The nearest double.
    pub hi: f64,
    /// The rest.
    pub lo: f64,
}

/// Relative error bound of one operation here (the references prove 2⁻¹⁰², 3·2⁻¹⁰⁶ and 10·2⁻¹⁰⁶).
const ROUNDING: f64 = 7.888_609_052_210_118e-31; // 2^-100

/// a + b and its rounding error.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let t = s - a;
    (s, (a - (s - t)) + (b - t))
}

/// a + b and its rounding error, for |a| ≥ |b|.
fn quick_two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    (s, b - (s - a))
}

/// Veltkamp's splitting of a double into two halves of 26 bits.
fn split(a: f64) -> (f64, f64) {
    const SPLITTER: f64 = 134_217_729.0; // 2^27 + 1
    let t = SPLITTER * a;
    let hi = t - (t - a);
    (hi, a - hi)
}

/// a · b and its rounding error (Dekker's product: it needs no fused multiply-add).
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let p = a * b;
    let (ah, al) = split(a);
    let (bh, bl) = split(b);
    (p, ((ah * bh - p) + ah * bl + al * bh) + al * bl)
}

impl Double {
    /// The sum of two doubles, exactly.
    #[must_use]
    pub fn sum(a: f64, b: f64) -> Self {
        let (hi, lo) = two_sum(a, b);
        Self { hi, lo }
    }

    /// self + other.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        let (s, e) = two_sum(self.hi, other.hi);
        let (t, f) = two_sum(self.lo, other.lo);
        let (s, e) = quick_two_sum(s, e + t);
        let (hi, lo) = quick_two_sum(s, e + f);
        Self { hi, lo }
    }

    /// self · other.
    #[must_use]
    pub fn times(self, other: Self) -> Self {
        let (p, e) = two_product(self.hi, other.hi);
        let (hi, lo) = quick_two_sum(p, e + (self.hi * other.lo + self.lo * other.hi));
        Self { hi, lo }
    }

    /// −self.
    #[must_use]
    pub fn negated(self) -> Self {
        Self {
            hi: -self.hi,
            lo: -self.lo,
        }
    }

    /// 1/self: Newton's iteration from the double quotient, twice.
    #[must_use]
    pub fn recip(self) -> Self {
        let mut q = Self {
            hi: 1.0 / self.hi,
            lo: 0.0,
        };
        for _ in 0..2 {
            let residual = Self { hi: 1.0, lo: 0.0 }.plus(self.times(q).negated());
            q = q.plus(q.times(residual));
        }
        q
    }

    /// √self for self ≥ 0.
    #[must_use]
    pub fn sqrt(self) -> Self {
        if self.hi <= 0.0 {
            return Self::default();
        }
        let mut r = Self {
            hi: self.hi.sqrt(),
            lo: 0.0,
        };
        for _ in 0..2 {
            let residual = self.plus(r.times(r).negated());
            let half = Self { hi: 0.5, lo: 0.0 };
            r = r.plus(residual.times(r.recip()).times(half));
        }
        r
    }
}

impl Digits for Double {
    const ROUNDING: f64 = ROUNDING;

    fn double(x: f64) -> Self {
        Self { hi: x, lo: 0.0 }
    }

    fn nearest(exact: &Rational) -> (Self, f64) {
        let hi = Field::to_f64(exact);
        let lo = Field::to_f64(&(exact - rational(hi)));
        (Self::sum(hi, lo), lo.abs() * f64::EPSILON)
    }

    fn plus(&self, other: &Self) -> Self {
        Self::plus(*self, *other)
    }

    fn times(&self, other: &Self) -> Self {
        Self::times(*self, *other)
    }

    fn negated(&self) -> Self {
        Self::negated(*self)
    }

    fn recip(&self) -> Self {
        Self::recip(*self)
    }

    fn is_unit(&self) -> bool {
        self.hi.abs() == 1.0 && self.lo == 0.0
    }

    fn to_f64(&self) -> f64 {
        self.hi
    }

    #[cfg(test)]
    fn exact(&self) -> Rational {
        rational(self.hi) + rational(self.lo)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reciprocal_and_root_have_thirty_digits() {
        for x in [3.0, 7e-15, 1.1e12, 0.1] {
            let d = Double {
                hi: x,
                lo: x * 1e-17,
            };
            let one = d.times(d.recip());
            assert!(((one.hi - 1.0) + one.lo).abs() < 1e-30, "{x}");
            let r = d.sqrt();
            let back = r.times(r).plus(d.negated());
            assert!(((back.hi + back.lo) / x).abs() < 1e-30, "{x}");
        }
    }
}
