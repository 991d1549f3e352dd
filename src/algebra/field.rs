//! The arithmetic an elimination needs.

use super::{Rational, Value};

/// Numbers over which an [`Elimination`](super::Elimination) runs: zero tests are exact.
pub trait Field: Clone + std::fmt::Debug {
    /// The number zero.
    fn zero() -> Self;
    /// The number one.
    fn one() -> Self;
    /// The exact rational of a component value.
    fn value(value: Value) -> Self;
    /// `self + other`.
    fn add(&self, other: &Self) -> Self;
    /// `self − other`.
    fn sub(&self, other: &Self) -> Self;
    /// `self · other`.
    fn mul(&self, other: &Self) -> Self;
    /// `self / other`; `other` must not be zero.
    fn div(&self, other: &Self) -> Self;
    /// `−self`.
    fn neg(&self) -> Self;
    /// self ← self − a·b.
    fn sub_mul(&mut self, a: &Self, b: &Self) {
        *self = self.sub(&a.mul(b));
    }
    /// Whether the number is exactly zero.
    fn is_zero(&self) -> bool;
    /// The nearest double.
    fn to_f64(&self) -> f64;
    /// Whether [`to_f64`](Self::to_f64) is within 1e-14 of the exact number, relative to it.
    fn is_precise(&self) -> bool;
    /// Bound on what the computation may have lost of the number, besides the rounding to the nearest double.
    fn radius(&self) -> f64;
}

/// The approximate numbers that intervals are around.
pub trait Digits: Clone + std::fmt::Debug {
    /// Relative error bound of one operation.
    const ROUNDING: f64;
    /// A double, exactly.
    fn double(x: f64) -> Self;
    /// What is nearest to an exact number, and how far it may be from it.
    fn nearest(exact: &Rational) -> (Self, f64);
    /// `self + other`.
    fn plus(&self, other: &Self) -> Self;
    /// `self · other`.
    fn times(&self, other: &Self) -> Self;
    /// `−self`.
    fn negated(&self) -> Self;
    /// `1/self`.
    fn recip(&self) -> Self;
    /// Whether it is 1 or −1.
    fn is_unit(&self) -> bool;
    /// The nearest double.
    fn to_f64(&self) -> f64;
    /// As an exact number.
    #[cfg(test)]
    fn exact(&self) -> Rational;
}
