//! The exponential diode: Shockley's junction with breakdown, in series with a resistance.
//!
//! ```text
//! i = Is (exp(v_d/a) − 1) + g v_d − Ibv exp(−(v_d + BV)/b),      v = v_d + RS i,      a = N k T/q
//! ```
//!
//! i is a strictly increasing function of v, so the law is maximal monotone and has φ, conjugate and resolvent in closed form
//! but for one scalar equation, v_d + R i(v_d) = z. With one exponential its solution is Wright's ω, ω(x) + ln ω(x) = x (R. M.
//! Corless, D. J. Jeffrey, "The Wright ω function", 2002), which neither overflows nor cancels; the other exponential is
//! added by Newton's method where it is not below rounding.

use super::{Junction as Behind, Resolvent};
use crate::settings::tolerances::exponentials::EXTINCT;

/// k/q, V/K.
const BOLTZMANN: f64 = 1.380_649e-23 / 1.602_176_634e-19;

/// The parameters of the law, all finite, `is`, `slope` positive, the others not negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exponential {
    /// Saturation current Is, A.
    pub is: f64,
    /// a = N k T/q, V.
    pub slope: f64,
    /// Series resistance RS, Ω.
    pub rs: f64,
    /// g, a conductance beside the junction, S: 0 but where a part of the circuit hangs on junctions alone.
    pub leak: f64,
    /// Breakdown; `None` for a diode that blocks any reverse voltage.
    pub breakdown: Option<Breakdown>,
}

/// Breakdown: the current is −`ibv` at −`bv`, and e times larger another `slope` below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Breakdown {
    /// BV, V.
    pub bv: f64,
    /// Ibv, A.
    pub ibv: f64,
    /// b = NBV k T/q, V.
    pub slope: f64,
}

/// The junction at one point.
struct Junction {
    /// Voltage across the junction, V.
    v: f64,
    /// Current, A.
    i: f64,
    /// di/dv, S.
    g: f64,
}

/// Iterations of Newton's method for two exponentials that overlap; it converges quadratically from within one slope.
const POLISH: u32 = 50;

impl Exponential {
    /// k T/q at a temperature in °C, V.
    #[must_use]
    pub fn thermal_voltage(celsius: f64) -> f64 {
        BOLTZMANN * (celsius + 273.15)
    }

    /// Whether the parameters are in their ranges.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        positive(self.is)
            && positive(self.slope)
            && self.rs.is_finite()
            && self.rs >= 0.0
            && self.leak.is_finite()
            && self.leak >= 0.0
            && self
                .breakdown
                .is_none_or(|b| positive(b.bv) && positive(b.ibv) && positive(b.slope))
    }

    /// di/dv of the junction at v = 0 without what leaks beside it, IS/a, S.
    pub(crate) fn conductance_at_rest(&self) -> f64 {
        self.is / self.slope
    }

    /// The law of `factor` such diodes in parallel.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self {
            is: self.is * factor,
            rs: self.rs / factor,
            leak: self.leak * factor,
            breakdown: self.breakdown.map(|b| Breakdown {
                ibv: b.ibv * factor,
                ..b
            }),
            ..self
        }
    }

    /// The junction behind its own and another resistance ρ > 0, Ω, and the z = v + ρ i, V, from which on that is the law: below, its
    /// breakdown carries more than the rounding of Is. `None` where that begins above 0 V.
    pub(crate) fn behind(&self, rho: f64) -> Option<(Behind, f64)> {
        // Where the current is negative v is no smaller than z.
        let from = self.breakdown.map_or(f64::NEG_INFINITY, |b| {
            b.slope * (b.ibv / (f64::EPSILON * self.is)).ln() - b.bv
        });
        let sound = from < 0.0 && (self.rs + rho).is_finite();
        let behind = || Behind::new(self.is, self.slope, self.rs + rho, self.leak);
        sound.then(|| (behind(), from))
    }

    /// The point (v, i) with v + ρ i = z, for ρ > 0 in Ω, and the slopes there.
    #[must_use]
    pub fn resolvent(&self, rho: f64, z: f64) -> Resolvent {
        let Junction { v, i, g } = self.junction(self.rs + rho, z);
        let whole = 1.0 / (1.0 + (self.rs + rho) * g);
        Resolvent {
            v: v + self.rs * i,
            i,
            dv: (1.0 + self.rs * g) * whole,
            di: g * whole,
        }
    }

    /// i at a voltage v: the one element of ∂φ(v), A.
    #[must_use]
    pub fn current(&self, v: f64) -> f64 {
        self.junction(self.rs, v).i
    }

    /// φ(v) = ∫₀ᵛ i dv, W.
    #[must_use]
    pub fn potential(&self, v: f64) -> f64 {
        let Junction { v, i, .. } = self.junction(self.rs, v);
        let mut sum = self.is * (self.slope * (v / self.slope).exp_m1() - v);
        if let Some(Breakdown { bv, ibv, slope }) = self.breakdown {
            sum += ibv * slope * ((-(v + bv) / slope).exp() - (-bv / slope).exp());
        }
        sum + 0.5 * self.leak * v * v + 0.5 * self.rs * i * i
    }

    /// φ*(i) = sup v i − φ(v), W; ∞ below the least current. At i the supremum is where i(v) = i (Fenchel's equality).
    #[must_use]
    pub fn conjugate(&self, i: f64) -> f64 {
        match self.voltage(i) {
            Some(v) => v * i - self.potential(v),
            None => f64::INFINITY,
        }
    }

    /// v at a current, V; `None` at or below −Is where nothing breaks down or leaks.
    #[must_use]
    pub fn voltage(&self, i: f64) -> Option<f64> {
        let unbounded = self.breakdown.is_some() || self.leak > 0.0;
        if !unbounded {
            return (i > -self.is).then(|| self.slope * (i / self.is).ln_1p() + self.rs * i);
        }
        // v + ρ i = z has v as a nondecreasing function of z, and i as a strictly increasing one: bisect z.
        let start = self.breakdown.map_or(self.slope, |b| b.bv + b.slope);
        let (mut low, mut high) = (-start, self.slope);
        for _ in 0..1100 {
            if self.current(low) < i {
                break;
            }
            low *= 2.0;
        }
        for _ in 0..1100 {
            if self.current(high) > i {
                break;
            }
            high *= 2.0;
        }
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if self.current(middle) < i {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(0.5 * (low + high))
    }

    /// v_d with v_d + R i(v_d) = z, for R ≥ 0: with g beside it that of R/(1 + R g) and z/(1 + R g) without.
    fn junction(&self, r: f64, z: f64) -> Junction {
        let part = 1.0 / (1.0 + r * self.leak);
        let Junction { v, i, g } = self.without_leak(r * part, z * part);
        Junction {
            v,
            i: i + self.leak * v,
            g: g + self.leak,
        }
    }

    fn without_leak(&self, r: f64, z: f64) -> Junction {
        if r == 0.0 {
            let (i, g) = self.direct(z);
            return Junction { v: z, i, g };
        }
        let (v, e) = alone(self.is, self.slope, r, z + r * self.is);
        let mut found = Junction {
            v,
            i: e - self.is,
            g: e / self.slope,
        };
        let reverse = self.breakdown.filter(|b| v < -0.5 * b.bv);
        if let Some(b) = reverse {
            let (u, e) = alone(b.ibv, b.slope, r, -z - b.bv - r * self.is);
            found = Junction {
                v: -u - b.bv,
                i: -e - self.is,
                g: e / b.slope,
            };
        }
        // The exponential left out above.
        let (other, slope, sign) = match (reverse, self.breakdown) {
            (Some(_), _) => (self.is * (found.v / self.slope).exp(), self.slope, 1.0),
            (None, Some(b)) => (b.ibv * (-(found.v + b.bv) / b.slope).exp(), b.slope, -1.0),
            (None, None) => (0.0, self.slope, 1.0),
        };
        // Near 0 V both v and i above are small differences of large numbers.
        let cancelled = found.v.abs() < self.slope;
        if cancelled
            || r * other > f64::EPSILON * (z.abs() + self.slope)
            || other > slope * f64::EPSILON / r
        {
            let mut v = found.v;
            let (mut i, mut g) = self.direct(v);
            for _ in 0..POLISH {
                let step = (v + r * i - z) / (1.0 + r * g);
                v -= step;
                (i, g) = self.direct(v);
                if step.abs() <= 4.0 * f64::EPSILON * v.abs() {
                    break;
                }
            }
            // Where it is steeper than the resistance the exponential is the worse way to i.
            if r * g > 1.0 {
                i = (z - v) / r;
            }
            found = Junction { v, i, g };
        } else {
            found.i += sign * other;
            found.g += other / slope;
        }
        found
    }

    /// i and di/dv at a junction voltage.
    fn direct(&self, v: f64) -> (f64, f64) {
        let forward = self.is * (v / self.slope).exp_m1();
        let (i, g) = (forward, (forward + self.is) / self.slope);
        match self.breakdown {
            None => (i, g),
            Some(b) => {
                let reverse = b.ibv * (-(v + b.bv) / b.slope).exp();
                (i - reverse, g + reverse / b.slope)
            }
        }
    }
}

/// v and I exp(v/a) where v + R I exp(v/a) = z.
fn alone(current: f64, a: f64, r: f64, z: f64) -> (f64, f64) {
    let shift = (r * current / a).ln();
    let omega = wright_omega(shift + z / a);
    // ln ω tells v without cancellation where the junction conducts, z where it does not.
    let v = if omega > 1.0 {
        a * (omega.ln() - shift)
    } else {
        z - a * omega
    };
    (v, a * omega / r)
}

/// ω with ω + ln ω = x: positive, e^x for x → −∞, x − ln x for x → ∞.
///
/// Two steps of the iteration of F. N. Fritsch, R. E. Shafer and W. P. Crowley (Algorithm 443, CACM 16, 1973), whose error
/// is of fourth order.
#[must_use]
pub fn wright_omega(x: f64) -> f64 {
    if x < -EXTINCT {
        return x.exp();
    }
    let mut w = if x > 1.0 {
        x - x.ln()
    } else if x > -2.0 {
        // ω(0) = 0.567…, ω(1) = 1.
        (0.567 + 0.39 * x).max(0.1)
    } else {
        x.exp()
    };
    for _ in 0..3 {
        let r = x - w - w.ln();
        let p = 1.0 + w;
        // r over 2 (1 + w)(1 + w + 2r/3), without its overflow.
        let q = r / p / (2.0 * (p + 2.0 / 3.0 * r));
        w *= 1.0 + r / p * (1.0 - q) / (1.0 - 2.0 * q);
    }
    w
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_diode() -> impl Strategy<Value = Exponential> {
        let breakdown = prop::option::of((0.5..200.0f64, -9.0..0.0f64, 0.02..0.1f64));
        (
            -18.0..-3.0f64,
            0.02..0.2f64,
            prop::bool::ANY,
            -4.0..2.0f64,
            prop::option::of(-13.0..-6.0f64),
            breakdown,
        )
            .prop_map(|(is, slope, series, rs, leak, breakdown)| Exponential {
                is: 10_f64.powf(is),
                slope,
                rs: if series { 10_f64.powf(rs) } else { 0.0 },
                leak: leak.map_or(0.0, |g| 10_f64.powf(g)),
                breakdown: breakdown.map(|(bv, ibv, slope)| Breakdown {
                    bv,
                    ibv: 10_f64.powf(ibv),
                    slope,
                }),
            })
    }

    /// φ(v) = ∫₀ᵛ i dv, by Simpson's rule, with a breakdown so near that a current flows at 0 V.
    #[test]
    fn the_potential_is_the_integral_of_the_current_from_0() {
        let near = Breakdown {
            bv: 0.1,
            ibv: 1e-3,
            slope: 0.05,
        };
        let diode = Exponential {
            is: 1e-3,
            slope: 0.05,
            rs: 0.0,
            leak: 1e-3,
            breakdown: Some(near),
        };
        assert_eq!(diode.potential(0.0), 0.0);
        for v in [-0.2, 0.2_f64] {
            let panels = 1000;
            let h = v / f64::from(2 * panels);
            let sum: f64 = (0..=2 * panels)
                .map(|k| {
                    let ends = k == 0 || k == 2 * panels;
                    let weight = if ends {
                        1.0
                    } else if k % 2 == 1 {
                        4.0
                    } else {
                        2.0
                    };
                    weight * diode.current(f64::from(k) * h)
                })
                .sum();
            let integral = sum * h / 3.0;
            let found = diode.potential(v);
            assert!((found / integral - 1.0).abs() < 1e-10, "{found} {integral}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 512, failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))), ..Default::default() })]

        #[test]
        fn omega_solves_its_equation(x in -800.0..1e6f64) {
            let w = wright_omega(x);
            prop_assert!(w >= 0.0);
            if x > -700.0 {
                prop_assert!((w + w.ln() - x).abs() <= 1e-14 * x.abs().max(1.0), "{x}: {w}");
            }
        }

        #[test]
        fn the_resolvent_is_nonexpansive_and_on_the_curve(
            diode in any_diode(), rho in -3.0..6.0f64, a in -1e3..1e3f64, b in -1e3..1e3f64,
        ) {
            let rho = 10_f64.powf(rho);
            let (p, q) = (diode.resolvent(rho, a), diode.resolvent(rho, b));
            prop_assert!((p.v + rho * p.i - a).abs() <= 1e-12 * a.abs().max(1.0));
            prop_assert!((p.v - q.v).abs() <= (a - b).abs() * (1.0 + 1e-12) + 1e-12);
            prop_assert!((p.v - q.v) * (p.i - q.i) >= -1e-12 * (p.v - q.v).abs() * p.i.abs().max(q.i.abs()));
            prop_assert!(p.dv >= 0.0 && p.di >= 0.0);
            prop_assert!((p.dv + rho * p.di - 1.0).abs() < 1e-12);
            // i is what the law says at v; an error in v is worth g times as much in i.
            let error = (diode.current(p.v) - p.i).abs();
            prop_assert!(error <= 1e-11 * (p.i.abs() + diode.is) + 4e-16 * p.v.abs() * p.di / p.dv, "{p:?} {error}");
        }

        #[test]
        fn small_currents_have_all_their_digits(diode in any_diode(), rho in -6.0..6.0f64, decades in -40.0..-1.0f64, up in prop::bool::ANY) {
            let rho = 10_f64.powf(rho);
            let z = diode.slope * 10_f64.powf(decades) * if up { 1.0 } else { -1.0 };
            let at = diode.resolvent(rho, z);
            // A breakdown near 0 V leaves a current there, whose voltage across rs the junction takes back: a difference of the two.
            let taken_back = diode.breakdown.map_or(0.0, |_| diode.rs * at.i.abs());
            let size = 1e-14 * z.abs().max(at.v.abs()) + f64::EPSILON * taken_back;
            prop_assert!((at.v + rho * at.i - z).abs() <= size, "{at:?}");
            let junction = at.v - diode.rs * at.i;
            // Where the resistance takes most of z, the digits of the junction's voltage are those of what it leaves.
            let left = 1e-14 + 1e-15 * z.abs() / junction.abs();
            if diode.breakdown.is_none() {
                let law = diode.is * (junction / diode.slope).exp_m1() + diode.leak * junction;
                prop_assert!((law / at.i - 1.0).abs() <= left, "{at:?} {law}");
            }
        }

        #[test]
        fn slopes_are_those_of_the_resolvent(diode in any_diode(), rho in 0.1..10.0f64, z in -300.0..300.0f64) {
            let h = 1e-6;
            let (low, high) = (diode.resolvent(rho, z - h), diode.resolvent(rho, z + h));
            let at = diode.resolvent(rho, z);
            prop_assert!(((high.v - low.v) / (2.0 * h) - at.dv).abs() < 1e-4, "{at:?}");
        }

        #[test]
        fn the_current_is_a_subgradient_and_the_conjugate_is_exact(
            diode in any_diode(), z in -30.0..30.0f64, w in -30.0..30.0f64,
        ) {
            let (at, other) = (diode.resolvent(1.0, z), diode.resolvent(1.0, w));
            let (f, g) = (diode.potential(at.v), diode.potential(other.v));
            let size = f.abs() + g.abs() + at.i.abs() * (at.v.abs() + other.v.abs()) + diode.is;
            prop_assert!(g >= f + at.i * (other.v - at.v) - 1e-12 * size);
            // φ(v) + φ*(i) ≥ v i, with equality where i = i(v).
            let dual = diode.conjugate(other.i);
            if dual.is_finite() {
                prop_assert!(f + dual >= at.v * other.i - 1e-9 * (size + dual.abs() + (at.v * other.i).abs()));
            }
        }
    }

    #[test]
    fn shockley_at_a_hand_calculated_point() {
        let diode = Exponential {
            is: 1e-14,
            slope: Exponential::thermal_voltage(27.0),
            rs: 0.0,
            leak: 0.0,
            breakdown: None,
        };
        assert!((diode.slope - 0.025_864_926).abs() < 1e-8);
        // 1 mA: v = a ln(1e11 + 1).
        let v = diode.slope * 1e11_f64.ln_1p();
        assert!((diode.current(v) - 1e-3).abs() < 1e-15);
        assert!((diode.voltage(1e-3).unwrap() - v).abs() < 1e-14);
        // 1 kΩ from v + 1 V.
        let at = diode.resolvent(1e3, v + 1.0);
        assert!((at.i - 1e-3).abs() < 1e-15 && (at.v - v).abs() < 1e-13);
        assert_eq!(diode.voltage(-1e-14), None);
        assert_eq!(diode.conjugate(-2e-14), f64::INFINITY);
    }

    #[test]
    fn breakdown_carries_its_current_at_its_voltage() {
        let zener = Exponential {
            is: 1e-14,
            slope: 0.026,
            rs: 2.0,
            leak: 0.0,
            breakdown: Some(Breakdown {
                bv: 5.1,
                ibv: 1e-3,
                slope: 0.026,
            }),
        };
        assert!((zener.current(-5.1 - 2e-3) + 1e-3).abs() < 1e-12);
        // Ten times the current, a ln 10 further.
        let v = -5.1 - 0.026 * 10_f64.ln() - 0.02;
        assert!((zener.current(v) + 1e-2).abs() < 1e-11);
        let five = zener.times(5.0);
        assert!((five.current(-5.1 - 2e-3) + 5e-3).abs() < 1e-11);
    }

    #[test]
    fn nothing_overflows() {
        let diode = Exponential {
            is: 1e-16,
            slope: 0.0259,
            rs: 0.0,
            leak: 0.0,
            breakdown: Some(Breakdown {
                bv: 100.0,
                ibv: 1e-3,
                slope: 0.0259,
            }),
        };
        for z in [1e9, 1e280, -1e9, -1e280] {
            for rho in [1e-12, 1.0, 1e12] {
                let at = diode.resolvent(rho, z);
                assert!(
                    [at.v, at.i, at.dv, at.di].iter().all(|x| x.is_finite()),
                    "{at:?}"
                );
                assert!((at.v + rho * at.i - z).abs() <= 1e-12 * z.abs(), "{at:?}");
            }
        }
    }
}
