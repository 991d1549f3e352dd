//! Where every motion of an autonomous passive circuit ends.

use nalgebra::DVector;

use super::equilibria::Equilibrium;
use super::facts::{Facts, Swap};
use super::limit::{self, Known, LimitSet};
use crate::passivity::{lmi, scale};
use crate::settings::tolerances::ranks::RANK;
use crate::settings::tolerances::theorems::{AT_ZERO, NOT_AT_ZERO};

/// What is certified of the long run.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Convergence {
    /// The statement that says so.
    pub by: &'static str,
    /// The state that every motion converges to; `null` where it depends on the start or where states keep moving.
    pub to: Option<Vec<f64>>,
    /// Dimension of the smallest known linear space that holds all differences of limit points.
    pub dimension: usize,
    /// States that nothing certified brings to rest; if empty, every motion converges to an equilibrium.
    pub moving: Vec<String>,
    /// Frequencies of the undamped motions, Hz, where λ does not take part in them.
    pub frequencies_hz: Vec<f64>,
}

/// The name of the argument of [`limit`](super::limit), for laws that Theorem 5 leaves out, ideal diodes first of all.
pub(super) const DISSIPATION: &str = "Dissipation argument";

/// The name of Theorem 5.
pub(super) const INVARIANCE: &str = "RR-7158 Theorem 5";

/// The roles under which Φ^{*,−}(z) > Φ^{*,−}(0) for z ≠ 0: λ = 0 on limit sets.
pub(super) fn strict_laws(facts: &Facts) -> Option<&Swap> {
    facts.swaps.iter().find(|swap| {
        swap.laws.iter().zip(swap.f.iter()).all(|(law, &f)| {
            if law.half_line {
                f > 0.0
            } else {
                law.strictly && f == 0.0
            }
        })
    })
}

/// The limit set of Theorem 5, where its hypotheses hold.
pub(super) fn invariant_set(facts: &Facts) -> Option<LimitSet> {
    let certificate = facts.certificate()?;
    let swap = strict_laws(facts).filter(|_| facts.is_autonomous() && facts.rests_at_zero())?;
    let known = vec![Known::Lambda; swap.laws.len()];
    Some(limit::set(&swap.system, &certificate.p, &known))
}

/// The limit set that dissipation leaves around an equilibrium.
pub(super) fn dissipative_set(facts: &Facts, equilibrium: &Equilibrium) -> Option<LimitSet> {
    let certificate = facts.certificate()?;
    let known = relations(facts, equilibrium);
    Some(limit::set(&facts.system, &certificate.p, &known))
}

/// What V' = 0 says of each port. For half lines (λ − λ*)(y − y*) = −λ*y − λy* = 0; for other laws through the origin λy = 0.
fn relations(facts: &Facts, equilibrium: &Equilibrium) -> Vec<Known> {
    let system = &facts.system;
    let x = DVector::from_column_slice(&equilibrium.x);
    let lambda = DVector::from_column_slice(&equilibrium.lambda);
    let y = &system.c * &x + &system.d * &lambda + &facts.f;
    let y_size = system.c.abs() * x.abs() + system.d.abs() * lambda.abs() + facts.f.abs();
    let ports = scale::balance(system).ports;
    let lambda = lambda.component_div(&ports);
    let lambda_size = lambda.amax();
    let size = |value: f64, of: f64| if of > 0.0 { value.abs() / of } else { 0.0 };
    let port = |(j, law): (usize, &super::laws::PortLaw)| {
        if !law.half_line {
            return match (law.strictly, law.strictly_swapped) {
                (true, true) => Known::Both,
                (true, false) => Known::Lambda,
                (false, true) => Known::Y,
                (false, false) => Known::Nothing,
            };
        }
        let (lambda, y) = (size(lambda[j], lambda_size), size(y[j], y_size[j]));
        if lambda <= AT_ZERO && y <= AT_ZERO {
            Known::Signs
        } else if y > NOT_AT_ZERO {
            Known::Lambda
        } else if lambda > NOT_AT_ZERO {
            Known::Y
        } else {
            Known::Nothing
        }
    };
    facts.laws.iter().enumerate().map(port).collect()
}

/// The long run by Theorem 5 where it applies, by dissipation otherwise; `None` where neither does.
pub(super) fn find(facts: &Facts, equilibria: &[Equilibrium]) -> Option<Convergence> {
    let equilibrium = equilibria.first().filter(|e| !e.x.is_empty())?;
    let (by, set) = match invariant_set(facts) {
        Some(set) => (INVARIANCE, set),
        None => (DISSIPATION, dissipative_set(facts, equilibrium)?),
    };
    Some(Convergence {
        by,
        to: (set.dimension == 0).then(|| equilibrium.x.clone()),
        dimension: set.dimension,
        moving: set
            .moving
            .iter()
            .map(|&k| facts.state_names[k].clone())
            .collect(),
        frequencies_hz: set
            .frequencies
            .iter()
            .map(|w| w / std::f64::consts::TAU)
            .collect(),
    })
}

/// Dimension of the kernel of Q(P): of the lossless pairs (x, λ).
pub(super) fn lossless_pairs(facts: &Facts) -> usize {
    facts.certificate().map_or(0, |certificate| {
        let d = scale::equilibrate(&lmi::magnitude(&facts.system, &certificate.p));
        let q = scale::scaled(&lmi::matrix(&facts.system, &certificate.p), &d, &d);
        let (values, _) = scale::eigen(&q);
        values.iter().filter(|v| v.abs() <= RANK).count()
    })
}
