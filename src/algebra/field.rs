//! The arithmetic an elimination needs, and its two implementors.

use super::Value;

/// Numbers over which [`eliminate`](super::eliminate) runs: zero tests are exact.
pub trait Field: Clone {
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
    /// Whether the number is exactly zero.
    fn is_zero(&self) -> bool;
    /// The nearest double.
    fn to_f64(&self) -> f64;
    /// A bound on |`to_f64()` − exact| beyond rounding to the nearest double.
    fn error(&self) -> f64;
}
