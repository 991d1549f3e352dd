//! Statements on the complementarity system as it stands: inputs, P-matrices, order of convergence.

use nalgebra::DVector;

use super::{Hypotheses, Theorem, half_lines, lossless, passive};
use crate::check::facts::Facts;
use crate::check::feedthrough::Feedthrough;
use crate::settings::tolerances::ranks::RANK;

/// Camlibel-Heemels-Schumacher 2002, passive systems with inputs.
pub(super) fn inputs(facts: &Facts) -> Theorem {
    let mut h = Hypotheses::default();
    half_lines(&facts.swaps[0], &mut h);
    passive(facts, &mut h);
    let system = &facts.system;
    let n = lossless(&system.d);
    // [B; D + Dᵀ] has full column rank iff B is injective on ker(D + Dᵀ).
    let mut bn = &system.b * &n;
    for mut row in bn.row_iter_mut() {
        let size = row.amax();
        if size > 0.0 {
            row /= size;
        }
    }
    let values = if bn.is_empty() {
        DVector::zeros(0)
    } else {
        bn.clone().singular_values()
    };
    let rank = values.iter().filter(|&&s| s > RANK * values.max()).count();
    let full = rank == n.ncols();
    h.need(
        full,
        if full {
            "[B; D + Dᵀ] has full column rank".into()
        } else {
            format!(
                "[B; D + Dᵀ] lacks {} of full column rank: λ is not unique",
                n.ncols() - rank
            )
        },
    );
    let others = facts.driven.iter().filter(|(_, source)| !source.pieces);
    let others: Vec<&str> = others.map(|(name, _)| name.as_str()).collect();
    h.need(
        others.is_empty(),
        if others.is_empty() {
            "the sources are piecewise sums of polynomials, exponentials and sinusoids".into()
        } else {
            format!(
                "{} {} no sum of polynomials, exponentials and sinusoids",
                others.join(", "),
                if others.len() == 1 { "is" } else { "are" }
            )
        },
    );
    h.theorem(
        "Camlibel-Heemels-Schumacher 2002 Theorem 7.5 (passive systems with inputs)",
        "a unique solution (x, λ, y) for every initial state and input; impulses only at t = 0 and at edges of the sources",
    )
}

/// Cottle-Pang-Stone Theorem 3.3.7 on the instantaneous problem.
pub(super) fn p_matrix(facts: &Facts) -> Theorem {
    let mut h = Hypotheses::default();
    half_lines(&facts.swaps[0], &mut h);
    let class = Feedthrough::of(&facts.system.d);
    h.need(
        class.p_matrix,
        match class.p_matrix {
            Some(true) => "D is a P-matrix",
            Some(false) => "D is not a P-matrix",
            None => "whether D is a P-matrix is not decided",
        },
    );
    h.theorem(
        "Brogliato-Thibault section A.4 (D a P-matrix)",
        "λ is a Lipschitz function of x and u: an ordinary differential equation, no state jumps",
    )
}

/// The leading Markov parameter decides whether small implicit steps have exactly one solution.
pub(super) fn leading_markov(facts: &Facts) -> Theorem {
    let mut h = Hypotheses::default();
    half_lines(&facts.swaps[0], &mut h);
    let system = &facts.system;
    if system.d.amax() == 0.0 {
        let markov = &system.c * &system.b;
        let class = Feedthrough::of(&markov);
        h.need(
            class.p_matrix,
            match class.p_matrix {
                Some(true) => "D = 0 and CB is a P-matrix",
                Some(false) => "D = 0 but CB is not a P-matrix",
                None => "D = 0; whether CB is a P-matrix is not decided",
            },
        );
    } else {
        h.need(false, "D ≠ 0: the leading Markov parameter is D itself");
    }
    h.theorem(
        "Leading Markov parameter a P-matrix",
        "every implicit step D + hC(I − hθA)⁻¹B with h small enough has exactly one solution",
    )
}

/// RR-7158 Remark 7.
pub(super) fn order(facts: &Facts, well_posed: bool) -> Theorem {
    let mut h = Hypotheses::default();
    let cones = facts.laws.iter().all(|l| l.half_line);
    h.need(
        well_posed,
        if well_posed {
            "the system is well posed by one of the above"
        } else {
            "none of the above applies"
        },
    );
    h.need(
        true,
        if cones {
            "all φ are indicator functions"
        } else {
            "some φ is not an indicator function"
        },
    );
    h.theorem(
        "RR-7158 Remark 7",
        if cones {
            "implicit Euler converges with order 1"
        } else {
            "implicit Euler converges with order 1/2 at least"
        },
    )
}
