//! A number that remembers the exact rational it stands for.

/// A component value: a double for arithmetic and the exact rational for rank decisions.
///
/// A decimal literal such as `4.7k` is the rational 47·10²; an evaluated expression is the binary rational of its double.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// The nearest double, in SI units.
    pub f64: f64,
    /// `mantissa · 10^exponent`, exactly, where the text was a decimal literal.
    pub decimal: Option<(i128, i32)>,
}

impl Value {
    /// The binary rational of a double.
    #[must_use]
    pub const fn binary(f64: f64) -> Self {
        Self { f64, decimal: None }
    }

    /// The negative.
    #[must_use]
    pub const fn negated(self) -> Self {
        let decimal = match self.decimal {
            Some((mantissa, exponent)) => Some((-mantissa, exponent)),
            None => None,
        };
        Self {
            f64: -self.f64,
            decimal,
        }
    }

    /// The decimal rational `mantissa · 10^exponent`; `f64` must be its nearest double.
    #[must_use]
    pub const fn decimal(f64: f64, mantissa: i128, exponent: i32) -> Self {
        Self {
            f64,
            decimal: Some((mantissa, exponent)),
        }
    }
}

impl From<f64> for Value {
    fn from(f64: f64) -> Self {
        Self::binary(f64)
    }
}
