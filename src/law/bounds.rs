//! Where a law ends: what decides which impulses a device can carry.
//!
//! In no time only what is unbounded counts. An impulse of voltage across a device meets a finite current, so it needs a current at
//! which the voltage runs away: a bound of dom φ*, the currents of the law. An impulse of current needs a voltage at which the
//! current runs away: a bound of dom φ, its voltages. In terms of recession functions,
//!
//! ```text
//! φ∞(v) = sup { i v : i a current of the law },      φ*∞(i) = sup { v i : v a voltage of the law },
//! ```
//!
//! are the energy that an impulse of voltage v or of current i costs, and where one of them is infinite there is no such impulse.
//!
//! | law | currents | voltages | an impulse of voltage | an impulse of current |
//! |---|---|---|---|---|
//! | ideal diode | i ≥ 0 | v ≤ 0 | in reverse, at i = 0 | forward, at v = 0 |
//! | exponential, any RS | i > −Is | all | in reverse, at i = −Is | none |
//! | exponential with breakdown | all | all | none | none |
//! | rounded corners without leakage | i ≥ 0 | all | in reverse, at i = 0 | none |
//! | rounded corners with leakage or breakdown | all | all | none | none |
//!
//! A conductance beside a junction ([`Exponential::leak`](super::Exponential::leak)) counts as none: an ampere would meet 10¹² V there.
//!
//! So an exponential diode takes any forward current of an inductor at once, at a voltage that grows as its logarithm. It carries no
//! impulse of charge even with RS = 0: capacitors that it joins approach each other as a ln t, and never meet.

use super::Law;

impl Law {
    /// The greatest lower bound of the law's currents, A; `None` where reverse currents have none.
    #[must_use]
    pub fn least_current(&self) -> Option<f64> {
        match self {
            Self::Exponential(diode) => diode.breakdown.is_none().then_some(-diode.is),
            Self::Rounded(diode) => {
                let blocks = diode.g == 0.0 && diode.reverse.is_none_or(|c| c.g == 0.0);
                blocks.then_some(0.0)
            }
            Self::Diode { .. } | Self::Curve(_) => {
                let curve = self.curve()?;
                let (_, i) = curve.vertices.first()?;
                (curve.first.1.f64 == 0.0).then_some(i.f64)
            }
        }
    }

    /// The least upper bound of the law's voltages, V; `None` where forward voltages have none.
    #[must_use]
    pub fn greatest_voltage(&self) -> Option<f64> {
        match self {
            Self::Exponential(_) | Self::Rounded(_) => None,
            Self::Diode { .. } | Self::Curve(_) => {
                let curve = self.curve()?;
                let (v, _) = curve.vertices.last()?;
                (curve.last.0.f64 == 0.0).then_some(v.f64)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::{Breakdown, Corner, Exponential, Rounded};

    #[test]
    fn bounds_are_where_the_resolvent_goes_far_out() {
        let exponential = |breakdown| {
            Law::Exponential(Exponential {
                is: 1e-6,
                slope: 0.026,
                rs: 0.0,
                leak: 0.0,
                breakdown,
            })
        };
        let conducts = |v, g| Corner { v, g, width: 0.1 };
        let rounded = |g, reverse| {
            Law::Rounded(Rounded {
                g,
                forward: conducts(0.7, 10.0),
                reverse,
            })
        };
        let drop = Law::Diode {
            vfwd: 0.7.into(),
            ron: 0.0.into(),
            roff: None,
        };
        let breakdown = Breakdown {
            bv: 5.0,
            ibv: 1e-3,
            slope: 0.026,
        };
        let laws = [
            (Law::ideal_diode(), Some(0.0), Some(0.0)),
            (drop, Some(0.0), Some(0.7)),
            (exponential(None), Some(-1e-6), None),
            (exponential(Some(breakdown)), None, None),
            (rounded(0.0, None), Some(0.0), None),
            (rounded(1e-3, None), None, None),
            (rounded(0.0, Some(conducts(5.0, 10.0))), None, None),
        ];
        for (law, current, voltage) in laws {
            assert_eq!(
                (law.least_current(), law.greatest_voltage()),
                (current, voltage),
                "{law:?}"
            );
            // Far out along v + i = z the law is at its bound, or as far out itself.
            let (low, high) = (law.resolvent(1.0, -1e9), law.resolvent(1.0, 1e9));
            match current {
                Some(least) => assert!((low.i - least).abs() < 1e-12, "{law:?}"),
                None => assert!(low.i < -1e5, "{law:?}"),
            }
            if let Some(greatest) = voltage {
                assert!((high.v - greatest).abs() < 1e-12, "{law:?}");
            }
        }
    }
}
