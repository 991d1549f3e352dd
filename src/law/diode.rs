//! The ideal diode, with forward drop, on-resistance and leakage if wanted.
//!
//! φ is the indicator of v ≤ 0 for the ideal diode: i ≥ 0 at v = 0, i = 0 below.

use super::{Curve, Law, ONE, ZERO};
use crate::algebra::Value;

impl Law {
    /// The ideal diode: 0 ≤ i ⟂ −v ≥ 0.
    #[must_use]
    pub const fn ideal_diode() -> Self {
        Self::Diode {
            vfwd: ZERO,
            ron: ZERO,
            roff: None,
        }
    }

    /// Whether this is exactly the ideal diode.
    #[must_use]
    pub fn is_ideal_diode(&self) -> bool {
        matches!(self, Self::Diode { vfwd, ron, roff: None } if vfwd.f64 == 0.0 && ron.f64 == 0.0)
    }
}

/// The curve of a diode: the line i = v/roff (or i = 0) up to where it meets i = (v − vfwd)/ron. Lines that do not meet
/// are one line through the origin.
pub(super) fn curve(vfwd: Value, ron: Value, roff: Option<Value>) -> Curve {
    let (corner, first) = match roff {
        None => ((vfwd, ZERO), (ONE, ZERO)),
        Some(roff) if vfwd.f64 == 0.0 || roff.f64 == ron.f64 => ((ZERO, ZERO), (roff, ONE)),
        Some(roff) => {
            let i = vfwd.f64 / (roff.f64 - ron.f64);
            ((Value::binary(roff.f64 * i), Value::binary(i)), (roff, ONE))
        }
    };
    Curve {
        kind: "diode",
        vertices: vec![corner],
        first,
        last: (ron, ONE),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ideal_diode_blocks_or_conducts() {
        let curve = Law::ideal_diode().curve().unwrap();
        assert_eq!(curve.resolvent(2.0, -3.0), (-3.0, 0.0));
        assert_eq!(curve.resolvent(2.0, 3.0), (0.0, 1.5));
        assert_eq!(curve.potential(-1.0), 0.0);
        assert_eq!(curve.potential(1.0), f64::INFINITY);
    }

    #[test]
    fn drop_and_resistances_shape_the_curve() {
        let law = Law::Diode {
            vfwd: 0.7.into(),
            ron: 0.1.into(),
            roff: Some(1e3.into()),
        };
        let curve = law.curve().unwrap();
        // Conducting: v = 0.7 + 0.1 i.
        assert!(curve.contains(0.8, 1.0, 1.0, 1e-12));
        // Leaking: i = v / 1 kΩ.
        assert!(curve.contains(-5.0, -5e-3, 1.0, 1e-12));
        assert!(!law.is_ideal_diode() && Law::ideal_diode().is_ideal_diode());
    }
}
