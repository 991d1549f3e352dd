//! What every piecewise-linear law answers: membership, potential, resolvent.

use super::{Curve, Resolvent};

/// Why points and directions are no maximal monotone curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CurveError {
    /// There is no vertex.
    #[error("a curve needs at least one vertex")]
    Empty,
    /// A coordinate is not finite.
    #[error("a coordinate is not finite")]
    NotFinite,
    /// A piece turns back in one coordinate.
    #[error("the curve turns back: voltage and current must not decrease along it")]
    Backwards,
    /// A ray without direction.
    #[error("a ray needs a direction")]
    NoDirection,
}

/// A straight piece: it starts at `from` (or, for the first ray, ends there) and runs along `along`.
#[derive(Debug, Clone, Copy)]
struct Piece {
    from: (f64, f64),
    along: (f64, f64),
}

impl Curve {
    /// The threshold and both levels of a curve that is one step, as a comparator's is.
    #[must_use]
    pub(crate) fn step(&self) -> Option<(f64, f64, f64)> {
        let flat = self.first.1.f64 == 0.0 && self.last.1.f64 == 0.0;
        match self.vertices[..] {
            [(a, low), (b, high)] if flat && a.f64 == b.f64 => Some((a.f64, low.f64, high.f64)),
            _ => None,
        }
    }

    /// Whether the points and directions are a maximal monotone curve.
    ///
    /// # Errors
    /// [`CurveError`] says what is wrong.
    pub fn check(&self) -> Result<(), CurveError> {
        let points = self.vertices.iter().chain([&self.first, &self.last]);
        if self.vertices.is_empty() {
            return Err(CurveError::Empty);
        }
        if !points
            .clone()
            .all(|p| p.0.f64.is_finite() && p.1.f64.is_finite())
        {
            return Err(CurveError::NotFinite);
        }
        if self
            .pieces()
            .iter()
            .any(|p| p.along.0 < 0.0 || p.along.1 < 0.0)
        {
            return Err(CurveError::Backwards);
        }
        if [self.first, self.last]
            .iter()
            .any(|d| d.0.f64 == 0.0 && d.1.f64 == 0.0)
        {
            return Err(CurveError::NoDirection);
        }
        Ok(())
    }

    /// First ray, segments, last ray.
    fn pieces(&self) -> Vec<Piece> {
        let point = |p: &(crate::algebra::Value, crate::algebra::Value)| (p.0.f64, p.1.f64);
        let vertices: Vec<(f64, f64)> = self.vertices.iter().map(point).collect();
        let (Some(&start), Some(&end)) = (vertices.first(), vertices.last()) else {
            return Vec::new();
        };
        let segments = vertices.windows(2).map(|w| Piece {
            from: w[0],
            along: (w[1].0 - w[0].0, w[1].1 - w[0].1),
        });
        std::iter::once(Piece {
            from: start,
            along: point(&self.first),
        })
        .chain(segments)
        .chain(std::iter::once(Piece {
            from: end,
            along: point(&self.last),
        }))
        .collect()
    }

    /// The point (v, i) of the curve with v + ρ i = z: the resolvent `v = (I + ρ ∂φ)⁻¹ z` and `i = (z − v)/ρ`, for ρ > 0 in Ω.
    ///
    /// The map z ↦ v is nonexpansive and defined for every z, because v + ρ i grows strictly from −∞ to ∞ along a maximal
    /// monotone curve (Minty).
    #[must_use]
    pub fn resolvent(&self, rho: f64, z: f64) -> (f64, f64) {
        let at = self.slopes(rho, z);
        (at.v, at.i)
    }

    /// [`Self::resolvent`] with its slopes, those of the piece the point is on.
    pub(super) fn slopes(&self, rho: f64, z: f64) -> Resolvent {
        let pieces = self.pieces();
        let last = pieces.len().saturating_sub(1);
        for (k, piece) in pieces.iter().enumerate() {
            let (v, i) = piece.from;
            let (dv, di) = piece.along;
            let length = dv + rho * di;
            let t = (z - v - rho * i) / length;
            // The first ray has t ≤ 0, segments 0 ≤ t ≤ 1, the last ray t ≥ 0.
            if (k == 0 && t <= 0.0) || (k > 0 && (t <= 1.0 || k == last)) {
                return Resolvent {
                    v: v + t * dv,
                    i: i + t * di,
                    dv: dv / length,
                    di: di / length,
                };
            }
        }
        Resolvent {
            v: z,
            i: 0.0,
            dv: 1.0,
            di: 0.0,
        }
    }

    /// Whether i ∈ ∂φ(v) to within `tolerance` (V), currents weighted by ρ (Ω): the resolvent leaves the point where it is.
    #[must_use]
    pub fn contains(&self, v: f64, i: f64, rho: f64, tolerance: f64) -> bool {
        (self.resolvent(rho, v + rho * i).0 - v).abs() <= tolerance
    }

    /// φ(v) = ∫ i dv from the first vertex, in W; ∞ where the curve does not reach v.
    #[must_use]
    pub fn potential(&self, v: f64) -> f64 {
        let pieces = self.pieces();
        let Some(start) = pieces.first().map(|p| p.from.0) else {
            return 0.0;
        };
        let mut sum = 0.0;
        let last = pieces.len() - 1;
        for (k, piece) in pieces.iter().enumerate() {
            let before = k == 0;
            if before != (v < start) {
                continue;
            }
            let (dv, di) = piece.along;
            // How far v lies along this piece, in units of its direction; segments end at 1.
            let distance = v - piece.from.0;
            if dv == 0.0 {
                if before || (k == last && distance > 0.0) {
                    return f64::INFINITY;
                }
                continue;
            }
            let t = if before || k == last {
                distance / dv
            } else {
                (distance / dv).clamp(0.0, 1.0)
            };
            if t > 0.0 || before {
                sum += dv * t * (piece.from.1 + di * t / 2.0);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::algebra::Value;

    fn any_curve() -> impl Strategy<Value = Curve> {
        let step = || (0.0..3.0f64, 0.0..3.0f64, 0..4);
        (
            prop::collection::vec(step(), 0..5),
            step(),
            step(),
            -2.0..2.0f64,
            -2.0..2.0f64,
        )
            .prop_map(|(steps, first, last, v, i)| {
                // Now and then a vertical or a horizontal piece.
                let along = |s: (f64, f64, i32)| match s.2 {
                    0 => (s.0 + 0.1, 0.0),
                    1 => (0.0, s.1 + 0.1),
                    _ => (s.0 + 0.01, s.1),
                };
                let value = |p: (f64, f64)| (Value::binary(p.0), Value::binary(p.1));
                let mut at = (v, i);
                let mut vertices = vec![value(at)];
                for s in steps {
                    let d = along(s);
                    at = (at.0 + d.0, at.1 + d.1);
                    vertices.push(value(at));
                }
                Curve {
                    kind: "table",
                    vertices,
                    first: value(along(first)),
                    last: value(along(last)),
                }
            })
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 256, failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))), ..Default::default() })]

        #[test]
        fn the_resolvent_is_nonexpansive_and_on_the_curve(
            curve in any_curve(), rho in 0.01..10.0f64, a in -20.0..20.0f64, b in -20.0..20.0f64,
        ) {
            prop_assert_eq!(curve.check(), Ok(()));
            let (va, ia) = curve.resolvent(rho, a);
            let (vb, ib) = curve.resolvent(rho, b);
            prop_assert!((va + rho * ia - a).abs() < 1e-9 * (1.0 + a.abs()));
            prop_assert!((va - vb).abs() <= (a - b).abs() + 1e-9);
            prop_assert!((va - vb) * (ia - ib) >= -1e-9);
            prop_assert!(curve.contains(va, ia, 1.0, 1e-9));
            prop_assert!(!curve.contains(va + 0.5, ia - 0.5, 1.0, 1e-9));
        }

        #[test]
        fn the_current_is_a_subgradient_of_the_potential(
            curve in any_curve(), z in -20.0..20.0f64, w in -20.0..20.0f64,
        ) {
            let (v, i) = curve.resolvent(1.0, z);
            let (u, _) = curve.resolvent(1.0, w);
            let (at_v, at_u) = (curve.potential(v), curve.potential(u));
            // At the end of a vertical ray rounding can leave the domain.
            if at_v.is_finite() && at_u.is_finite() {
                prop_assert!(at_u >= at_v + i * (u - v) - 1e-9 * (1.0 + at_u.abs() + at_v.abs()));
            }
        }
    }

    #[test]
    fn faults_are_named() {
        let zener = Curve::zener((5.1.into(), 0.0.into()), (0.7.into(), 0.0.into()), None);
        assert_eq!(zener.check(), Ok(()));
        let broken = |change: &dyn Fn(&mut Curve)| {
            let mut curve = zener.clone();
            change(&mut curve);
            curve.check()
        };
        assert_eq!(broken(&|c| c.vertices.clear()), Err(CurveError::Empty));
        assert_eq!(
            broken(&|c| c.vertices.reverse()),
            Err(CurveError::Backwards)
        );
        assert_eq!(
            broken(&|c| c.last = (0.0.into(), 0.0.into())),
            Err(CurveError::NoDirection)
        );
        assert_eq!(
            broken(&|c| c.first.0 = f64::NAN.into()),
            Err(CurveError::NotFinite)
        );
    }
}
