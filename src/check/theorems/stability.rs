//! Stability, dependence on the start, invariance: RR-7158 Theorems 3 to 5.

use super::{Hypotheses, Theorem, passive};
use crate::check::convergence::{self, DISSIPATION, INVARIANCE};
use crate::check::equilibria::Equilibrium;
use crate::check::facts::Facts;
use crate::check::limit::LimitSet;
use crate::passivity::strict;

/// Autonomous, and x = 0 with λ = 0 is a solution (Assumption 7).
fn rests_at_zero(facts: &Facts, h: &mut Hypotheses) {
    autonomous(facts, h);
    let rests = facts.rests_at_zero();
    h.need(
        rests,
        if rests {
            "Assumption 7: x = 0 is a solution, Φ^{*,−} ≥ Φ^{*,−}(0)"
        } else {
            "Assumption 7 fails: x = 0 is no equilibrium (constant sources)"
        },
    );
}

fn autonomous(facts: &Facts, h: &mut Hypotheses) {
    if facts.is_autonomous() {
        h.need(true, "autonomous");
    } else {
        let names: Vec<&str> = facts.driven.iter().map(|(n, _)| n.as_str()).collect();
        h.need(
            false,
            format!("not autonomous: driven by {}", names.join(", ")),
        );
    }
}

/// RR-7158 Theorem 3 with Propositions 4 and 5.
pub(super) fn stability(facts: &Facts) -> Theorem {
    let mut h = Hypotheses::default();
    rests_at_zero(facts, &mut h);
    passive(facts, &mut h);
    let gives = match &facts.strict {
        Some(s) if s.decay_rate > 0.0 => {
            h.need(
                true,
                format!("strictly passive: (46) with ε/2 = {:.6e} 1/s", s.decay_rate),
            );
            format!("‖x(t)‖ ≤ {:.4}·‖x₀‖·exp(−{:.6e} t)", s.bound, s.decay_rate)
        }
        Some(s) => format!("‖x(t)‖ ≤ {:.4}·‖x₀‖", s.bound),
        None => "a bound on ‖x(t)‖ by ‖x₀‖".into(),
    };
    h.theorem("RR-7158 Theorem 3", gives)
}

/// RR-7158 Theorem 4.
pub(super) fn lipschitz(facts: &Facts) -> Theorem {
    let mut h = Hypotheses::default();
    rests_at_zero(facts, &mut h);
    passive(facts, &mut h);
    let gives = facts.certificate().map_or_else(
        || "Lipschitz dependence on the initial state".into(),
        |c| {
            format!(
                "‖x₁(t) − x₂(t)‖ ≤ {:.4}·‖x₁(0) − x₂(0)‖",
                strict::overshoot(&c.p)
            )
        },
    );
    h.theorem("RR-7158 Theorem 4", gives)
}

/// RR-7158 Theorem 5.
pub(super) fn invariance(facts: &Facts) -> Theorem {
    let mut h = Hypotheses::default();
    rests_at_zero(facts, &mut h);
    passive(facts, &mut h);
    match convergence::strict_laws(facts) {
        Some(swap) => h.need(true, format!("Φ^{{*,−}}(z) > Φ^{{*,−}}(0) for z ≠ 0{}", swap.note())),
        None => h.need(
            false,
            "Φ^{*,−}(z) > Φ^{*,−}(0) for z ≠ 0 fails: ideal diodes have Φ^{*,−} = 0 on the whole half line",
        ),
    };
    let gives = convergence::invariant_set(facts).map_or_else(
        || "convergence to the largest invariant subset of {⟨PAz, z⟩ = 0}".into(),
        |set| {
            format!(
                "every motion tends to the largest invariant subset of {{⟨PAz, z⟩ = 0}}, {}",
                describe(facts, &set)
            )
        },
    );
    h.theorem(INVARIANCE, gives)
}

/// The dissipation argument of [`limit`](crate::check): what ideal diodes leave room for, under its own name.
pub(super) fn dissipation(facts: &Facts, equilibria: &[Equilibrium]) -> Theorem {
    let mut h = Hypotheses::default();
    autonomous(facts, &mut h);
    passive(facts, &mut h);
    let set = equilibria
        .first()
        .and_then(|equilibrium| convergence::dissipative_set(facts, equilibrium));
    h.need(
        !equilibria.is_empty(),
        if equilibria.is_empty() {
            "no equilibrium was found"
        } else {
            "an equilibrium solves the static complementarity problem"
        },
    );
    let gives = set.map_or_else(
        || "limit points without dissipation".into(),
        |set| {
            format!(
                "along limit motions (x, λ) differs from the equilibrium within ker Q(P), of dimension {}, and the ports \
                 keep their sides: what is left is {}",
                convergence::lossless_pairs(facts),
                describe(facts, &set)
            )
        },
    );
    h.theorem(DISSIPATION, gives)
}

/// A limit set in words.
fn describe(facts: &Facts, set: &LimitSet) -> String {
    if set.dimension == 0 {
        return "one point: every motion converges to the equilibrium".into();
    }
    if set.rests() {
        return format!(
            "states of rest in {} dimensions: every motion converges to one of the equilibria",
            set.dimension
        );
    }
    let names: Vec<&str> = set
        .moving
        .iter()
        .map(|&k| facts.state_names[k].as_str())
        .collect();
    format!(
        "motions of {} in {} dimensions",
        names.join(", "),
        set.dimension
    )
}
