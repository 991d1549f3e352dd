//! The theorems, one by one: each hypothesis with its number, what follows, or which hypothesis fails.

mod complementarity;
mod lure;
mod semidefinite;
mod stability;
mod sweeping;

use nalgebra::DMatrix;

use super::equilibria::Equilibrium;
use super::facts::{Facts, Swap};
use crate::passivity::{gradient, scale};
use crate::settings::tolerances::passivity::MATCHED;
use crate::settings::tolerances::ranks::RANK;

/// One statement of the literature, applied to this system.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Theorem {
    /// `RR-7158 Theorem 2`.
    pub statement: String,
    /// Whether its hypotheses hold; `null` where one could not be decided.
    pub holds: Option<bool>,
    /// The hypotheses with their numbers, or the ones that fail.
    pub because: String,
    /// What follows for the user if it holds.
    pub gives: String,
}

/// Hypotheses as they are checked.
#[derive(Debug, Default, Clone)]
struct Hypotheses(Vec<(Option<bool>, String)>);

impl Hypotheses {
    fn need(&mut self, holds: impl Into<Option<bool>>, text: impl Into<String>) -> &mut Self {
        self.0.push((holds.into(), text.into()));
        self
    }

    fn hold(&self) -> Option<bool> {
        if self.0.iter().any(|(h, _)| *h == Some(false)) {
            Some(false)
        } else if self.0.iter().any(|(h, _)| h.is_none()) {
            None
        } else {
            Some(true)
        }
    }

    fn theorem(&self, statement: &str, gives: impl Into<String>) -> Theorem {
        let holds = self.hold();
        let texts: Vec<&str> = self
            .0
            .iter()
            .filter(|(h, _)| *h == holds || holds.is_none() && h.is_none())
            .map(|(_, text)| text.as_str())
            .collect();
        Theorem {
            statement: statement.into(),
            holds,
            because: texts.join("; "),
            gives: gives.into(),
        }
    }
}

/// The first swap for which all hypotheses hold, else what the given roles say.
fn over_swaps(facts: &Facts, check: impl Fn(&Swap, &mut Hypotheses)) -> Hypotheses {
    let mut first = None;
    for swap in &facts.swaps {
        let mut hypotheses = Hypotheses::default();
        check(swap, &mut hypotheses);
        if hypotheses.hold() == Some(true) {
            return hypotheses;
        }
        first.get_or_insert(hypotheses);
    }
    first.unwrap_or_default()
}

/// All statements, in the order of the report.
pub(super) fn all(facts: &Facts, equilibria: &[Equilibrium]) -> Vec<Theorem> {
    let mut list = Vec::new();
    if facts.system.m() == 0 {
        list.push(linear());
    } else {
        list.extend([
            sweeping::sweeping(facts),
            sweeping::block_sweeping(facts),
            lure::kato(facts),
            lure::maximal_monotone(facts),
            complementarity::inputs(facts),
            complementarity::p_matrix(facts),
            complementarity::leading_markov(facts),
        ]);
        let well_posed = [0, 1, 2, 3]
            .iter()
            .any(|&k: &usize| list[k].holds == Some(true));
        list.push(complementarity::order(facts, well_posed));
    }
    list.extend([
        stability::stability(facts),
        stability::lipschitz(facts),
        stability::invariance(facts),
        stability::dissipation(facts, equilibria),
    ]);
    list
}
fn linear() -> Theorem {
    Hypotheses::default()
        .need(true, "no devices: x' = Ax + Eu + e is linear")
        .theorem(
            "Linear system (no devices)",
            "unique solution for every initial state and every integrable source",
        )
}
fn half_lines(swap: &Swap, h: &mut Hypotheses) {
    let other: Vec<&str> = swap
        .laws
        .iter()
        .filter(|l| !l.half_line)
        .map(|l| l.device.as_str())
        .collect();
    if other.is_empty() {
        h.need(true, "all devices are complementary pairs 0 ≤ λ ⟂ y ≥ 0");
    } else {
        h.need(
            false,
            format!("not a complementary pair: {}", other.join(", ")),
        );
    }
}
fn input_output(facts: &Facts, swap: &Swap, ports: &[usize], h: &mut Hypotheses) {
    let b = swap.system.b.select_columns(ports);
    let c = swap.system.c.select_rows(ports);
    match facts.storage(swap, ports) {
        Some(p) => {
            let from = if gradient::residual(&facts.energy, &b, &c) <= MATCHED && p == facts.energy {
                "the stored energy"
            } else {
                "some P ≻ 0"
            };
            h.need(true, format!("PB = Cᵀ with {from}, residual {:.1e}{}", gradient::residual(&p, &b, &c), swap.note()))
        }
        None => h.need(
            false,
            format!(
                "no P = Pᵀ ≻ 0 with PB = Cᵀ (residual {:.1e} for the stored energy), whatever the roles of the ports",
                gradient::residual(&facts.energy, &b, &c)
            ),
        ),
    };
}
fn regularity(facts: &Facts, h: &mut Hypotheses) -> &'static str {
    let edges = facts.edges();
    if edges.is_empty() {
        h.need(true, "Gu is locally absolutely continuous");
        "a unique locally absolutely continuous solution; its state jumps only at t = 0 from an inadmissible start"
    } else {
        h.need(
            true,
            format!(
                "Gu is right-continuous of bounded variation (edges of {})",
                edges.join(", ")
            ),
        );
        "a unique right-continuous solution of bounded variation; at a jump x⁺ is the projection of x⁻ in the metric P"
    }
}
fn everything(swap: &Swap) -> Vec<usize> {
    (0..swap.system.m()).collect()
}
/// Ports whose rows and columns of D vanish (I), and the others (II): RR-7158 (6), Brogliato-Thibault (27).
fn split(d: &DMatrix<f64>) -> (Vec<usize>, Vec<usize>) {
    let size = d.amax();
    (0..d.nrows()).partition(|&j| d.row(j).amax().max(d.column(j).amax()) <= RANK * size)
}
/// An orthonormal basis of ker(D + Dᵀ).
fn lossless(d: &DMatrix<f64>) -> DMatrix<f64> {
    let (values, vectors) = scale::eigen(&(d + d.transpose()));
    let size = d.amax();
    let kernel: Vec<usize> = (0..values.len())
        .filter(|&k| values[k].abs() <= RANK * size)
        .collect();
    vectors.select_columns(&kernel)
}

fn passive(facts: &Facts, h: &mut Hypotheses) {
    match facts.certificate() {
        Some(c) => h.need(
            true,
            format!(
                "passive: (45) with P from the {}, eigenvalue {:.1e}",
                c.from.name(),
                c.residuals.lmi_max_eigenvalue
            ),
        ),
        None => h.need(
            facts.verdict.answer(),
            "not passive, or not decided (see above)",
        ),
    };
}
