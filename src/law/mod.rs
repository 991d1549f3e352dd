//! Device laws: maximal monotone curves in the (v, i) plane, −λ ∈ ∂φ(y).

mod bounds;
mod curve;
mod dead_zone;
mod diode;
mod exponential;
mod junction;
mod limited;
mod relay;
mod rounded;
mod saturation;
mod table;
mod zener;

use crate::algebra::Value;
pub use curve::CurveError;
pub use exponential::{Breakdown, Exponential, wright_omega};
pub(crate) use junction::Junction;
pub use limited::Side;
pub use rounded::{Corner, Rounded};

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
    /// The exponential diode.
    Exponential(Exponential),
    /// Straight lines with rounded corners.
    Rounded(Rounded),
}

/// The resolvent of a law: the point (v, i) with v + ρ i = z, and how it moves with z. dv/dz and ρ di/dz lie between 0 and 1
/// and add up to 1 (an element of Clarke's generalised derivative at a corner).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolvent {
    /// V.
    pub v: f64,
    /// A.
    pub i: f64,
    /// dv/dz.
    pub dv: f64,
    /// di/dz, S.
    pub di: f64,
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
            Self::Exponential(_) => "exponential",
            Self::Rounded(_) => "rounded",
        }
    }

    /// Whether the law consists of straight pieces.
    #[must_use]
    pub const fn is_piecewise_linear(&self) -> bool {
        !matches!(self, Self::Exponential(_) | Self::Rounded(_))
    }

    /// The voltage in which the law bends, V: 0 for corners.
    #[must_use]
    pub const fn bend(&self) -> f64 {
        match self {
            Self::Diode { .. } | Self::Curve(_) => 0.0,
            Self::Exponential(diode) => diode.slope,
            Self::Rounded(diode) => diode.forward.width,
        }
    }

    /// The point of the law with v + ρ i = z, for ρ > 0 in Ω: z ↦ v is the resolvent (I + ρ ∂φ)⁻¹, nonexpansive and defined
    /// for every z.
    #[must_use]
    pub fn resolvent(&self, rho: f64, z: f64) -> Resolvent {
        match self {
            Self::Diode { vfwd, ron, roff } => diode::curve(*vfwd, *ron, *roff).slopes(rho, z),
            Self::Curve(curve) => curve.slopes(rho, z),
            Self::Exponential(diode) => diode.resolvent(rho, z),
            Self::Rounded(diode) => diode.resolvent(rho, z),
        }
    }

    /// The law as a curve of straight pieces, if it is one.
    #[must_use]
    pub fn curve(&self) -> Option<Curve> {
        match self {
            Self::Diode { vfwd, ron, roff } => Some(diode::curve(*vfwd, *ron, *roff)),
            Self::Curve(curve) => Some(curve.clone()),
            Self::Exponential(_) | Self::Rounded(_) => None,
        }
    }
}
