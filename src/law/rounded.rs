//! The diode of straight lines with rounded corners: LTspice's `Epsilon` and `Revepsilon`.
//!
//! ```text
//! i = g₀ v + (g₁ − g₀) r(v − V₁, ε₁) − (g₂ − g₀) r(−V₂ − v, ε₂)
//! r(x, ε) = 0 for x ≤ −ε/2,   (x + ε/2)²/(2ε) for |x| ≤ ε/2,   x for x ≥ ε/2
//! ```
//!
//! A parabola of width ε around each corner, tangent to both lines: i is a continuous, nondecreasing function of v with a
//! continuous slope, and φ its integral, so that resolvent and conjugate are roots of quadratic equations.

use super::Resolvent;

/// A corner: where the lines meet, the conductance beyond, and the width of its rounding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// V₁ > 0 above which, or V₂ with −V₂ below which, the diode conducts, V.
    pub v: f64,
    /// Conductance there, S; more than that between the corners.
    pub g: f64,
    /// ε, V; 0 is a sharp corner.
    pub width: f64,
}

/// The parameters of the law; the corners' roundings do not overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounded {
    /// Conductance between the corners, S.
    pub g: f64,
    /// Forward conduction.
    pub forward: Corner,
    /// Reverse breakdown.
    pub reverse: Option<Corner>,
}

impl Corner {
    /// r and its slope at a distance beyond the corner.
    fn ramp(&self, x: f64) -> (f64, f64) {
        let start = x + 0.5 * self.width;
        if start <= 0.0 {
            (0.0, 0.0)
        } else if start < self.width {
            (0.5 * start * start / self.width, start / self.width)
        } else {
            (x, 1.0)
        }
    }

    /// ∫ r.
    fn area(&self, x: f64) -> f64 {
        let start = x + 0.5 * self.width;
        if start <= 0.0 {
            0.0
        } else if start < self.width {
            start.powi(3) / (6.0 * self.width)
        } else {
            0.5 * x * x + self.width * self.width / 24.0
        }
    }

    /// How far beyond the start of the rounding v is, where the voltage and ρ times the current above g₀ v add up to
    /// `rest` above their sum there: `slope` = 1 + ρ g₀, `more` = ρ (g − g₀).
    fn beyond(&self, slope: f64, more: f64, rest: f64) -> f64 {
        let at_end = slope * self.width + 0.5 * more * self.width;
        if rest < at_end {
            // slope x + more x²/(2 width) = rest.
            let root = (slope * slope + 2.0 * more * rest / self.width).sqrt();
            2.0 * rest / (slope + root)
        } else {
            self.width + (rest - at_end) / (slope + more)
        }
    }
}

impl Rounded {
    /// Whether the parameters are in their ranges.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let at_least = |x: f64, least: f64| x.is_finite() && x >= least;
        let corner =
            |c: &Corner| c.v.is_finite() && at_least(c.g, self.g) && at_least(c.width, 0.0);
        let start = self.forward.v - 0.5 * self.forward.width;
        let end = self
            .reverse
            .map_or(f64::NEG_INFINITY, |c| -c.v + 0.5 * c.width);
        at_least(self.g, 0.0)
            && corner(&self.forward)
            && self.reverse.iter().all(corner)
            && start >= end
    }

    /// The law of `factor` such diodes in parallel.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        let more = |c: Corner| Corner {
            g: c.g * factor,
            ..c
        };
        Self {
            g: self.g * factor,
            forward: more(self.forward),
            reverse: self.reverse.map(more),
        }
    }

    /// i at a voltage v, A.
    #[must_use]
    pub fn current(&self, v: f64) -> f64 {
        self.at(v).0
    }

    /// i and di/dv.
    fn at(&self, v: f64) -> (f64, f64) {
        let (r, dr) = self.forward.ramp(v - self.forward.v);
        let more = self.forward.g - self.g;
        let (mut i, mut g) = (self.g * v + more * r, self.g + more * dr);
        if let Some(reverse) = self.reverse {
            let (r, dr) = reverse.ramp(-reverse.v - v);
            i -= (reverse.g - self.g) * r;
            g += (reverse.g - self.g) * dr;
        }
        (i, g)
    }

    /// φ(v) = ∫₀ᵛ i dv, W.
    #[must_use]
    pub fn potential(&self, v: f64) -> f64 {
        let part = |c: &Corner, x: f64, zero: f64| (c.g - self.g) * (c.area(x) - c.area(zero));
        let reverse = self.reverse.map_or(0.0, |c| part(&c, -c.v - v, -c.v));
        0.5 * self.g * v * v + part(&self.forward, v - self.forward.v, -self.forward.v) + reverse
    }

    /// The point (v, i) with v + ρ i = z, for ρ > 0 in Ω, and the slopes there.
    #[must_use]
    pub fn resolvent(&self, rho: f64, z: f64) -> Resolvent {
        let slope = 1.0 + rho * self.g;
        let forward = self.forward.v - 0.5 * self.forward.width;
        let mut v = z / slope;
        if v > forward {
            let more = rho * (self.forward.g - self.g);
            v = forward + self.forward.beyond(slope, more, z - slope * forward);
        }
        if let Some(corner) = self.reverse {
            let reverse = -corner.v + 0.5 * corner.width;
            if v < reverse {
                let more = rho * (corner.g - self.g);
                v = reverse - corner.beyond(slope, more, slope * reverse - z);
            }
        }
        let (i, g) = self.at(v);
        let whole = 1.0 / (1.0 + rho * g);
        Resolvent {
            v,
            i,
            dv: whole,
            di: g * whole,
        }
    }

    /// φ*(i) = sup v i − φ(v), W; ∞ where no voltage carries i.
    #[must_use]
    pub fn conjugate(&self, i: f64) -> f64 {
        // v with i(v) = i is the limit of resolvents: v + ρ i(v) = ρ i for large ρ; where g₀ = 0 and i = 0 any v will do.
        if i == 0.0 {
            return -self.potential(0.0);
        }
        let (corner, sign) = match (i > self.current(0.0), self.reverse) {
            (true, _) => (self.forward, 1.0),
            (false, Some(reverse)) => (reverse, -1.0),
            (false, None) if self.g > 0.0 => return 0.5 * i * i / self.g,
            (false, None) => return f64::INFINITY,
        };
        let start = corner.v - 0.5 * corner.width;
        let rest = i.abs() - self.g * start;
        let v = if rest > 0.0 {
            start + corner.beyond(self.g, corner.g - self.g, rest)
        } else {
            i.abs() / self.g
        };
        sign * v * i - self.potential(sign * v)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_law() -> impl Strategy<Value = Rounded> {
        let corner = || (0.0..2.0f64, 0.1..50.0f64, prop::option::of(0.01..1.0f64));
        (
            prop::option::of(1e-6..0.1f64),
            corner(),
            prop::option::of(corner()),
        )
            .prop_map(|(g, f, r)| {
                let make = |(v, g, width): (f64, f64, Option<f64>)| {
                    let width = width.unwrap_or(0.0);
                    Corner {
                        v: v + 0.5 * width,
                        g,
                        width,
                    }
                };
                Rounded {
                    g: g.unwrap_or(0.0),
                    forward: make(f),
                    reverse: r.map(make),
                }
            })
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 512, failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))), ..Default::default() })]

        #[test]
        fn the_resolvent_is_nonexpansive_and_on_the_curve(
            law in any_law(), rho in -3.0..3.0f64, a in -20.0..20.0f64, b in -20.0..20.0f64,
        ) {
            let rho = 10_f64.powf(rho);
            prop_assert!(law.is_sound());
            let (p, q) = (law.resolvent(rho, a), law.resolvent(rho, b));
            prop_assert!((p.v + rho * p.i - a).abs() <= 1e-11 * (1.0 + a.abs()), "{:?}", p);
            prop_assert!((p.v - q.v).abs() <= (a - b).abs() + 1e-12);
            prop_assert!((p.v - q.v) * (p.i - q.i) >= -1e-12);
            prop_assert!((p.dv + rho * p.di - 1.0).abs() < 1e-12 && p.dv >= 0.0 && p.di >= 0.0);
        }

        #[test]
        fn the_current_is_the_subgradient_and_the_conjugate_is_exact(
            law in any_law(), v in -5.0..5.0f64, w in -5.0..5.0f64,
        ) {
            let (i, j) = (law.current(v), law.current(w));
            let (f, g) = (law.potential(v), law.potential(w));
            prop_assert!(g >= f + i * (w - v) - 1e-12 * (1.0 + f + g));
            // φ(v) + φ*(j) ≥ v j with equality at v = w.
            prop_assert!(f + law.conjugate(j) >= v * j - 1e-10 * (1.0 + f + g));
            prop_assert!((g + law.conjugate(j) - w * j).abs() <= 1e-10 * (1.0 + g));
        }
    }

    #[test]
    fn a_corner_is_a_parabola_between_its_tangents() {
        let law = Rounded {
            g: 0.1,
            forward: Corner {
                v: 1.0,
                g: 2.1,
                width: 0.4,
            },
            reverse: None,
        };
        // i = 0.1 v below 0.8 V, 0.1 v + 2 (v − 1) above 1.2 V, and 2·0.2²/0.8 more than 0.1 v at 1 V.
        assert!((law.current(0.8) - 0.08).abs() < 1e-15);
        assert!((law.current(1.2) - 0.52).abs() < 1e-15);
        assert!((law.current(1.0) - 0.2).abs() < 1e-15);
        let at = law.resolvent(1.0, 1.2);
        assert!((at.v - 1.0).abs() < 1e-15 && (at.di / at.dv - 1.1).abs() < 1e-14);
        let overlapping = Rounded {
            reverse: Some(Corner {
                v: 0.0,
                g: 1.0,
                width: 2.0,
            }),
            ..law
        };
        assert!(law.is_sound() && !overlapping.is_sound());
        assert_eq!(law.times(2.0).current(1.0), 2.0 * law.current(1.0));
    }
}
