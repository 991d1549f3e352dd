//! Stability, dependence on the start, invariance: RR-7158 Theorems 3 to 5.

use nalgebra::{DMatrix, DVector};

use super::{Hypotheses, Theorem, ZERO, passive};
use crate::check::facts::{Facts, Swap};
use crate::passivity::strict;

/// Autonomous, and x = 0 with λ = 0 is a solution (Assumption 7).
fn rests_at_zero(facts: &Facts, h: &mut Hypotheses) {
    if facts.is_autonomous() {
        h.need(true, "autonomous");
    } else {
        let names: Vec<&str> = facts.driven.iter().map(|(n, _)| n.as_str()).collect();
        h.need(
            false,
            format!("not autonomous: driven by {}", names.join(", ")),
        );
    }
    let rests = facts.e.amax() == 0.0
        && facts.laws.iter().zip(facts.f.iter()).all(|(law, &f)| {
            if law.half_line {
                f >= 0.0
            } else {
                law.through_origin && f == 0.0
            }
        });
    h.need(
        rests,
        if rests {
            "Assumption 7: x = 0 is a solution, Φ^{*,−} ≥ Φ^{*,−}(0)"
        } else {
            "Assumption 7 fails: x = 0 is no equilibrium (constant sources)"
        },
    );
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
    let strictly = |swap: &Swap| {
        swap.laws.iter().zip(swap.f.iter()).all(|(law, &f)| {
            if law.half_line {
                f > 0.0
            } else {
                law.strictly && f == 0.0
            }
        })
    };
    let found = facts.swaps.iter().find(|swap| strictly(swap));
    match found {
        Some(swap) => h.need(true, format!("Φ^{{*,−}}(z) > Φ^{{*,−}}(0) for z ≠ 0{}", swap.note())),
        None => h.need(
            false,
            "Φ^{*,−}(z) > Φ^{*,−}(0) for z ≠ 0 fails: ideal diodes have Φ^{*,−} = 0 on the whole half line",
        ),
    };
    let gives = facts.certificate().map_or_else(
        || "convergence to the largest invariant subset of {⟨PAz, z⟩ = 0}".into(),
        |c| {
            let pa = &c.p * &facts.system.a;
            format!(
                "every orbit tends to the largest invariant subset of {{⟨PAz, z⟩ = 0}}, of dimension {}",
                kernel_dimension(&(&pa + pa.transpose()), &(c.p.abs() * facts.system.a.abs()))
            )
        },
    );
    h.theorem("RR-7158 Theorem 5", gives)
}

/// The dissipation argument: where strict passivity or the laws leave no lossless motion, orbits tend to 0.
pub(super) fn dissipation(facts: &Facts) -> Theorem {
    let mut h = Hypotheses::default();
    rests_at_zero(facts, &mut h);
    passive(facts, &mut h);
    let gives = match facts.certificate() {
        None => "limit points in the lossless set".to_string(),
        Some(c) => {
            let q = crate::passivity::lmi::matrix(&facts.system, &c.p);
            let size = crate::passivity::lmi::magnitude(&facts.system, &c.p);
            let dimension = kernel_dimension(&q, &size);
            format!(
                "along limit solutions (x, λ) stays in ker Q(P), of dimension {dimension}: no energy is dissipated there{}",
                if dimension == 0 {
                    ", so every orbit tends to 0"
                } else {
                    ""
                }
            )
        }
    };
    h.theorem(
        "Dissipation argument (LaSalle, any Φ^{*,−} ≥ Φ^{*,−}(0))",
        gives,
    )
}

/// Dimension of the kernel of a symmetric matrix, relative to the sizes of its terms.
fn kernel_dimension(q: &DMatrix<f64>, size: &DMatrix<f64>) -> usize {
    if q.is_empty() {
        return 0;
    }
    let d = DVector::from_fn(q.nrows(), |i, _| {
        let s = size.row(i).amax().max(size.column(i).amax());
        if s > 0.0 { 1.0 / s.sqrt() } else { 1.0 }
    });
    let unit = DMatrix::from_fn(q.nrows(), q.ncols(), |i, j| d[i] * q[(i, j)] * d[j]);
    let values = unit.symmetric_eigenvalues();
    values
        .iter()
        .filter(|v| v.abs() <= ZERO * values.amax().max(1.0))
        .count()
}
