//! Affine forms in voltages and currents, exact where the text was.

use super::{Affine, Quantity};
use crate::algebra::Value;

/// `constant + Σ gain · quantity`, exact where the text was.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Form {
    pub(super) constant: Value,
    pub(super) terms: Vec<(Value, Quantity)>,
}

impl Form {
    pub(super) fn number(value: impl Into<Value>) -> Self {
        Self {
            constant: value.into(),
            terms: Vec::new(),
        }
    }

    pub(super) fn is_constant(&self) -> bool {
        self.terms.is_empty()
    }

    pub(super) fn into_affine(self) -> Affine {
        Affine {
            terms: self.terms,
            constant: self.constant.f64,
        }
    }

    pub(super) fn negated(self) -> Self {
        self.scaled(Value::decimal(-1.0, -1, 0))
    }

    pub(super) fn scaled(mut self, factor: Value) -> Self {
        self.constant = product(self.constant, factor);
        for (gain, _) in &mut self.terms {
            *gain = product(*gain, factor);
        }
        self
    }

    pub(super) fn plus(mut self, other: Self) -> Self {
        self.constant = sum(self.constant, other.constant);
        for (gain, quantity) in other.terms {
            match self.terms.iter_mut().find(|(_, q)| *q == quantity) {
                Some((own, _)) => *own = sum(*own, gain),
                None => self.terms.push((gain, quantity)),
            }
        }
        self.terms.retain(|(gain, _)| gain.f64 != 0.0);
        self
    }
}

/// Keeps the decimal where a factor is ±1.
fn product(a: Value, b: Value) -> Value {
    match (a.f64, b.f64) {
        (1.0, _) => b,
        (_, 1.0) => a,
        (-1.0, _) => negative(b),
        (_, -1.0) => negative(a),
        (x, y) => Value::binary(x * y),
    }
}

fn negative(a: Value) -> Value {
    Value {
        f64: -a.f64,
        decimal: a.decimal.map(|(mantissa, exponent)| (-mantissa, exponent)),
    }
}

fn sum(a: Value, b: Value) -> Value {
    if a.f64 == 0.0 {
        b
    } else if b.f64 == 0.0 {
        a
    } else {
        Value::binary(a.f64 + b.f64)
    }
}
