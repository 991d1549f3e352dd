//! A number that remembers the exact rational it stands for.

use std::fmt;

/// A component value: a double for arithmetic and the exact rational for rank decisions.
///
/// A decimal literal such as `4.7k` is the rational 47·10²; an evaluated expression is the binary rational of its double.
#[derive(Clone, Copy, PartialEq)]
pub struct Value {
    /// The nearest double, in SI units.
    pub f64: f64,
    /// The mantissa of a decimal literal in halves: an `i128` would stand on sixteen bytes, and values make up most of a large circuit.
    mantissa: (i64, u64),
    /// Its exponent; `None` for a double.
    exponent: Option<i32>,
}

impl Value {
    /// The binary rational of a double.
    #[must_use]
    pub const fn binary(f64: f64) -> Self {
        Self {
            f64,
            mantissa: (0, 0),
            exponent: None,
        }
    }

    /// `mantissa · 10^exponent`, exactly, where the text was a decimal literal.
    #[must_use]
    pub const fn as_decimal(self) -> Option<(i128, i32)> {
        let (high, low) = self.mantissa;
        match self.exponent {
            Some(exponent) => Some(((high as i128) << 64 | low as i128, exponent)),
            None => None,
        }
    }

    /// The negative.
    #[must_use]
    pub const fn negated(self) -> Self {
        match self.as_decimal() {
            Some((mantissa, exponent)) => Self::decimal(-self.f64, -mantissa, exponent),
            None => Self::binary(-self.f64),
        }
    }

    /// The decimal rational `mantissa · 10^exponent`; `f64` must be its nearest double.
    #[must_use]
    pub const fn decimal(f64: f64, mantissa: i128, exponent: i32) -> Self {
        Self {
            f64,
            mantissa: ((mantissa >> 64) as i64, mantissa as u64),
            exponent: Some(exponent),
        }
    }
}

impl fmt::Debug for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Value")
            .field("f64", &self.f64)
            .field("decimal", &self.as_decimal())
            .finish()
    }
}

impl From<f64> for Value {
    fn from(f64: f64) -> Self {
        Self::binary(f64)
    }
}
