//! Affine forms in voltages and currents with piecewise-linear parts, exact where the text was.

use super::model::{ONE, ZERO};
use super::piecewise::Piecewise;
use super::{Affine, Quantity};
use crate::algebra::Value;
use crate::settings::tolerances::netlists::SAME_GAIN;

/// `constant + Σ gain · quantity + Σ f(Σ gain · quantity)`, exact where the text was.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Form {
    pub(super) constant: Value,
    pub(super) terms: Vec<(Value, Quantity)>,
    /// What is piecewise linear; no two along the same sum.
    pub(super) ridges: Vec<Ridge>,
}

/// A piecewise-linear function of one sum of quantities.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ridge {
    /// The sum, as [`direction`] states it.
    pub(super) along: Direction,
    pub(super) curve: Piecewise,
}

/// A sum of quantities, the gain of the first being 1.
pub(super) type Direction = Vec<(Value, Quantity)>;

impl Form {
    pub(super) fn number(value: impl Into<Value>) -> Self {
        Self {
            constant: value.into(),
            terms: Vec::new(),
            ridges: Vec::new(),
        }
    }

    pub(super) fn quantity(quantity: Quantity) -> Self {
        Self {
            terms: vec![(ONE, quantity)],
            ..Self::number(ZERO)
        }
    }

    pub(super) fn is_constant(&self) -> bool {
        self.terms.is_empty() && self.ridges.is_empty()
    }

    /// Whether all numbers are finite.
    pub(super) fn is_finite(&self) -> bool {
        let finite =
            |terms: &[(Value, Quantity)]| terms.iter().all(|(gain, _)| gain.f64.is_finite());
        self.constant.f64.is_finite()
            && finite(&self.terms)
            && self
                .ridges
                .iter()
                .all(|r| finite(&r.along) && r.curve.is_finite())
    }

    /// The affine part.
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
        if factor.f64 == 0.0 {
            self.ridges.clear();
        }
        for ridge in &mut self.ridges {
            ridge.curve =
                std::mem::replace(&mut ridge.curve, Piecewise::line(0.0, 0.0)).scaled(factor.f64);
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
        for ridge in other.ridges {
            self = self.plus_ridge(ridge);
        }
        self
    }

    /// Adds a function of one sum, which may turn out to be affine.
    pub(super) fn plus_ridge(mut self, ridge: Ridge) -> Self {
        let Ridge { along, mut curve } = ridge;
        if let Some(k) = self.ridges.iter().position(|r| parallel(&r.along, &along)) {
            curve = self.ridges.remove(k).curve.plus(&curve);
        }
        let Some((slope, constant)) = curve.as_line() else {
            self.ridges.push(Ridge { along, curve });
            return self;
        };
        let line = Self {
            constant: constant.into(),
            terms: along,
            ridges: Vec::new(),
        };
        let constant = line.constant;
        self.plus(
            Self {
                constant: ZERO,
                ..line
            }
            .scaled(slope.into()),
        )
        .plus(Self::number(constant))
    }

    /// The same as a function of one sum of quantities, if it is one.
    pub(super) fn one_dimensional(&self) -> Option<Ridge> {
        let own = direction(&self.terms);
        let (along, slope) = match (&own, self.ridges.first()) {
            (Some((along, gain)), _) => (along.clone(), *gain),
            (None, Some(ridge)) => (ridge.along.clone(), 0.0),
            (None, None) => return None,
        };
        let mut curve = Piecewise::line(slope, self.constant.f64);
        for ridge in &self.ridges {
            if !parallel(&ridge.along, &along) {
                return None;
            }
            curve = curve.plus(&ridge.curve);
        }
        Some(Ridge { along, curve })
    }
}

/// Terms in a fixed order, divided by the first gain, and that gain; `None` if there are none.
pub(super) fn direction(terms: &[(Value, Quantity)]) -> Option<(Direction, f64)> {
    let mut along: Direction = terms
        .iter()
        .copied()
        .filter(|(g, _)| g.f64 != 0.0)
        .collect();
    along.sort_by_key(|(_, quantity)| match quantity {
        Quantity::Voltage(node) => (0, node.0),
        Quantity::Current(element) => (1, element.0),
    });
    let first = along.first()?.0;
    for (gain, _) in &mut along {
        *gain = if first.f64.abs() == 1.0 {
            product(*gain, first)
        } else if *gain == first {
            ONE
        } else if gain.f64 == -first.f64 {
            ONE.negated()
        } else {
            Value::binary(gain.f64 / first.f64)
        };
    }
    Some((along, first.f64))
}

pub(super) fn parallel(a: &[(Value, Quantity)], b: &[(Value, Quantity)]) -> bool {
    a.len() == b.len()
        && a.iter().zip(b).all(|((g, q), (h, r))| {
            q == r && (g.f64 - h.f64).abs() <= SAME_GAIN * f64::EPSILON * g.f64.abs()
        })
}

/// Keeps the decimal where a factor is ±1.
fn product(a: Value, b: Value) -> Value {
    match (a.f64, b.f64) {
        (1.0, _) => b,
        (_, 1.0) => a,
        (-1.0, _) => b.negated(),
        (_, -1.0) => a.negated(),
        (x, y) => Value::binary(x * y),
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
