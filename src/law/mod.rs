//! Device laws: maximal monotone curves in the (v, i) plane, −λ ∈ ∂φ(y).

mod curve;
mod dead_zone;
mod diode;
mod relay;
mod saturation;
mod table;
mod zener;

use crate::algebra::Value;
pub use curve::CurveError;

const ZERO: Value = Value::decimal(0.0, 0, 0);
const ONE: Value = Value::decimal(1.0, 1, 0);

/// A law between the two quantities of a port.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// Diode: v ≤ vfwd blocks (i = v/roff, 0 where `roff` is `None`), else i = (v − vfwd)/ron, a vertical line for ron = 0.
    Diode {
        /// Forward drop, V.
        vfwd: Value,
        /// On-resistance, Ω.
        ron: Value,
        /// Off-resistance, Ω; `None` is infinite.
        roff: Option<Value>,
    },
    /// Any other piecewise-linear monotone curve.
    Curve(Curve),
}

/// A piecewise-linear maximal monotone curve: a ray into `vertices[0]`, segments, a ray out of the last vertex.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// `ideal_diode`, `zener`, `table`, `relay`, `saturation`, `dead_zone`: the name shown to the user.
    pub kind: &'static str,
    /// Corner points (v, i), both coordinates nondecreasing; at least one.
    pub vertices: Vec<(Value, Value)>,
    /// Direction (dv, di) ≥ 0 of the first ray, traversed towards the first vertex.
    pub first: (Value, Value),
    /// Direction (dv, di) ≥ 0 of the last ray, leaving the last vertex.
    pub last: (Value, Value),
}

impl Law {
    /// The name shown to the user and written to files.
    #[must_use]
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Diode { .. } => "ideal_diode",
            Self::Curve(curve) => curve.kind,
        }
    }

    /// The law as a curve of straight pieces.
    #[must_use]
    pub fn curve(&self) -> Curve {
        match self {
            Self::Diode { vfwd, ron, roff } => diode::curve(*vfwd, *ron, *roff),
            Self::Curve(curve) => curve.clone(),
        }
    }
}
