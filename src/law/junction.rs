//! An exponential junction behind a resistance, evaluated again and again near where it was.
//!
//! ```text
//! v + r i = z,   i = Is (exp(v/a) − 1):      i = (a/r) ω(x) − Is,   di/dz = ω/(1 + ω)/r,   x = z/a + r Is/a + ln(r Is/a)
//! ```
//!
//! with Wright's ω, see [`wright_omega`]. Where x has moved little ω starts from its Taylor polynomial, and one step of the
//! iteration, whose error is of fourth order, ends it. Where ω is below the rounding of 1 the junction is its blocking line, i = −Is. With a conductance g
//! beside it r and z are those over 1 + r g, and i is g v more.

use super::wright_omega;
use crate::settings::tolerances::exponentials::{BLOCKED_JUNCTION, OMEGA_ENDS, OMEGA_NEAR};

/// A junction behind a resistance, with the point where it was evaluated last.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Junction {
    is: f64,
    /// 1/a, 1/V.
    per_volt: f64,
    /// a/r, A.
    scale: f64,
    /// 1/r, S.
    conductance: f64,
    /// r, Ω, and g, S.
    r: f64,
    leak: f64,
    /// 1/(1 + r g) with the r that was given.
    part: f64,
    shift: f64,
    x: f64,
    omega: f64,
}

impl Junction {
    /// A junction of saturation current `is`, A, and a = N k T/q, V, with a conductance `leak`, S, beside it, behind r > 0, Ω.
    pub(crate) fn new(is: f64, a: f64, r: f64, leak: f64) -> Self {
        let part = 1.0 / (1.0 + r * leak);
        let r = r * part;
        Self {
            r,
            leak,
            part,
            is,
            per_volt: 1.0 / a,
            scale: a / r,
            conductance: 1.0 / r,
            shift: (r * is / a).ln() + r * is / a,
            x: f64::NAN,
            omega: 0.0,
        }
    }

    /// i and di/dz where v + r i = z.
    #[inline]
    pub(crate) fn at(&mut self, z: f64) -> (f64, f64) {
        let z = z * self.part;
        let x = self.shift + z * self.per_volt;
        let (i, di) = if x < -BLOCKED_JUNCTION {
            (-self.is, 0.0)
        } else {
            let omega = self.omega_near(x);
            let i = self.scale * omega - self.is;
            (i, omega / (1.0 + omega) * self.conductance)
        };
        if self.leak == 0.0 {
            return (i, di);
        }
        let (v, dv) = (z - self.r * i, 1.0 - self.r * di);
        (i + self.leak * v, (di + self.leak * dv) * self.part)
    }

    fn omega_near(&mut self, x: f64) -> f64 {
        let p = 1.0 + self.omega;
        let moved = (x - self.x) / p;
        // False where nothing is known yet.
        let near = moved.abs() < OMEGA_NEAR;
        let omega = if near {
            let mut w = self.omega * (1.0 + moved + 0.5 * moved * moved / p);
            for _ in 0..3 {
                let r = x - w - w.ln();
                let p = 1.0 + w;
                let q = r / p / (2.0 * (p + 2.0 / 3.0 * r));
                w *= 1.0 + r / p * (1.0 - q) / (1.0 - 2.0 * q);
                if r.abs() < OMEGA_ENDS {
                    break;
                }
            }
            w
        } else {
            wright_omega(x)
        };
        (self.x, self.omega) = (x, omega);
        omega
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::law::Exponential;

    proptest! {
        #[test]
        fn a_walk_along_the_curve_stays_on_it(
            is in -16.0..-6.0f64, a in 0.02..0.1f64, r in -6.0..6.0f64,
            leak in -14.0..-8.0f64, start in -20.0..20.0f64, moves in proptest::collection::vec(-0.5..0.5f64, 1..40),
        ) {
            let (is, r, leak) = (10_f64.powf(is), 10_f64.powf(r), 10_f64.powf(leak));
            let diode = Exponential { is, slope: a, rs: 0.0, leak, breakdown: None };
            let mut junction = Junction::new(is, a, r, leak);
            let mut z = start;
            for step in moves {
                z += step;
                let (i, di) = junction.at(z);
                let exact = diode.resolvent(r, z);
                let size = exact.i.abs() + is + z.abs() / r;
                prop_assert!((i - exact.i).abs() <= 1e-12 * size, "{i} {exact:?}");
                prop_assert!((di - exact.di).abs() * r <= 1e-12 + 4.0 * f64::EPSILON, "{di} {exact:?}");
            }
        }
    }
}
