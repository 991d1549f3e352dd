//! How fast a mode's solution can move, and for how long: eigenvalues of A and frequencies of the sources.

use nalgebra::DMatrix;

use crate::linalg::eigenvalues::eigenvalues;
use crate::linalg::expm;
use crate::settings::tolerances::exponentials::{
    CURVED, EXTINCT, FIRST_LOOK, GROWN, RESOLVED, TURNED,
};
use crate::settings::tolerances::ranks::EIGENVALUE;

/// One eigenvalue −decay ± i·frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rate {
    /// 1/s; negative where the mode grows.
    pub(crate) decay: f64,
    /// rad/s.
    pub(crate) frequency: f64,
}

/// All rates of a mode: what limits steps while a transient and all slower ones live, the fastest first.
#[derive(Debug, Clone)]
pub(crate) struct Spectrum {
    limits: Vec<Limit>,
    growth_limit: f64,
}

#[derive(Debug, Clone, Copy)]
struct Limit {
    /// The age at which the transient is extinct, s.
    until: f64,
    /// What oscillations and growth allow, s.
    resolved: f64,
    /// The first step after a change of mode, s.
    first: f64,
}

impl Spectrum {
    /// Eigenvalues of A (n×n) and the rates of the sources. Where the QR algorithm fails, bounds of the numerical range stand
    /// for them.
    pub(crate) fn new(a: &DMatrix<f64>, sources: &[Rate]) -> Self {
        let n = a.nrows();
        let mut rates = sources.to_vec();
        let mut growth = 0.0;
        if n > 0 {
            let d = expm::balance(a, 1.0);
            let balanced = DMatrix::from_fn(n, n, |i, j| a[(i, j)] * d[j] / d[i]);
            match eigenvalues(&balanced) {
                Some(found) => {
                    let largest = found.iter().map(|v| v.norm()).fold(0.0, f64::max);
                    let fastest = found.iter().map(|v| v.re).fold(0.0, f64::max);
                    if fastest > EIGENVALUE * largest {
                        growth = fastest;
                    }
                    rates.extend(found.iter().map(|v| Rate {
                        decay: -v.re,
                        frequency: v.im.abs(),
                    }));
                }
                None => rates.extend(numerical_range(&balanced)),
            }
        }
        // Those that do not decay come last.
        rates.sort_by(|a, b| b.decay.total_cmp(&a.decay));
        let mut limits = vec![Limit {
            until: f64::INFINITY,
            resolved: f64::INFINITY,
            first: f64::INFINITY,
        }];
        let mut fastest = 0.0_f64;
        for rate in rates.iter().rev() {
            let slower = limits[limits.len() - 1];
            fastest = fastest.max(rate.decay.abs()).max(rate.frequency);
            limits.push(Limit {
                until: if rate.decay > 0.0 {
                    EXTINCT / rate.decay
                } else {
                    f64::INFINITY
                },
                resolved: slower.resolved.min(RESOLVED / rate.frequency),
                first: FIRST_LOOK / fastest,
            });
        }
        limits.reverse();
        let growth_limit = GROWN / growth;
        for limit in &mut limits {
            limit.resolved = limit.resolved.min(growth_limit);
        }
        Self {
            limits,
            growth_limit,
        }
    }

    /// The longest step that hides nothing `age` seconds after the last change of mode: dead transients no longer count,
    /// decays are followed on steps that double, oscillations are resolved while they last.
    pub(crate) fn step_limit(&self, age: f64) -> f64 {
        let living = self.limits.iter().find(|limit| age <= limit.until);
        living.map_or(self.growth_limit, |limit| {
            let follows = if age > limit.first { age } else { limit.first };
            if follows < limit.resolved {
                follows
            } else {
                limit.resolved
            }
        })
    }

    /// The longest piece over which a polynomial of degree 8 follows the solution to rounding, `age` seconds after the last change of mode.
    pub(crate) fn curve_limit(&self, age: f64) -> f64 {
        let living = self.limits.iter().find(|limit| age <= limit.until);
        living.map_or(self.growth_limit, |limit| {
            let follows = (TURNED * limit.first).max(CURVED * age);
            follows.min(TURNED * limit.resolved)
        })
    }

    /// The longest step that follows what grows, s; infinite in a mode without growth.
    pub(crate) fn growth_limit(&self) -> f64 {
        self.growth_limit
    }
}

/// Bounds of the eigenvalues by the two parts of A (Bendixson 1902): none decays faster or slower than the eigenvalues of the
/// symmetric part, and none turns faster than the norm of the skew part. In coordinates near those of stored energy, which
/// balancing gives, the symmetric part of a passive circuit is dissipation alone.
fn numerical_range(a: &DMatrix<f64>) -> Vec<Rate> {
    let symmetric = 0.5 * (a + a.transpose());
    let frequency = (0.5 * (a - a.transpose())).norm();
    let decays = symmetric.symmetric_eigenvalues();
    decays
        .iter()
        .map(|v| Rate {
            decay: -v,
            frequency,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_grow_with_age_and_stop_at_living_oscillations() {
        // a fast decay 1e9 1/s beside an undamped oscillation of 1e3 rad/s
        let mut a = DMatrix::zeros(3, 3);
        a[(0, 0)] = -1e9;
        a[(1, 2)] = -1e6;
        a[(2, 1)] = 1.0;
        let spectrum = Spectrum::new(&a, &[]);
        assert!((spectrum.step_limit(0.0) - 0.5e-9).abs() < 1e-15);
        assert!((spectrum.step_limit(3e-9) - 3e-9).abs() < 1e-15);
        assert!(
            (spectrum.step_limit(1e-6) / 0.5e-3 - 1.0).abs() < 1e-9,
            "the decay is extinct"
        );
        assert!((spectrum.step_limit(1.0) / 0.7e-3 - 1.0).abs() < 1e-9);
        assert_eq!(
            Spectrum::new(&DMatrix::zeros(0, 0), &[]).step_limit(0.0),
            f64::INFINITY
        );
    }

    #[test]
    fn the_numerical_range_bounds_decay_and_frequency() {
        // A damped oscillation −1 ± 10i beside a decay 5, over a basis of its own.
        let a =
            DMatrix::from_row_slice(3, 3, &[-1.0, 10.0, 0.2, -10.0, -1.0, 0.1, -0.2, 0.3, -5.0]);
        let found = eigenvalues(&a).expect("eigenvalues");
        let bounds = numerical_range(&a);
        let slowest = bounds.iter().map(|r| r.decay).fold(f64::INFINITY, f64::min);
        let fastest = bounds.iter().map(|r| r.decay).fold(0.0, f64::max);
        for value in found {
            assert!((slowest..=fastest).contains(&-value.re), "{value}");
            assert!(value.im.abs() <= bounds[0].frequency, "{value}");
        }
        assert!(slowest > 0.5 && bounds[0].frequency < 15.0);
    }

    #[test]
    fn sources_count() {
        let source = Rate {
            decay: 0.0,
            frequency: 100.0,
        };
        assert!(
            (Spectrum::new(&DMatrix::zeros(0, 0), &[source]).step_limit(1.0) - 7e-3).abs() < 1e-12
        );
    }
}
