//! Every hypothesis that `check::theorems` checks, on a circuit where it alone fails and beside it one where it holds.
//!
//! The systems are so small that the hypotheses can be read off their matrices; x' = −x + … is a leaky 1 F capacitor.

mod complementarity;

use super::*;
use crate::law::Curve;

/// What the report says of a theorem: whether it holds, and why.
fn verdict(circuit: &Lcs, statement: &str) -> (Option<bool>, String) {
    let report = system(circuit);
    let theorem = theorem(&report, statement);
    (theorem.holds, theorem.because.clone())
}

#[track_caller]
fn holds(circuit: &Lcs, statement: &str) {
    assert_eq!(
        verdict(circuit, statement).0,
        Some(true),
        "{}",
        system(circuit)
    );
}

/// The theorem fails, and this hypothesis is the one and only reason.
#[track_caller]
fn fails_by(circuit: &Lcs, statement: &str, hypothesis: &str) {
    let (holds, because) = verdict(circuit, statement);
    assert_eq!(holds, Some(false), "{}", system(circuit));
    assert!(because.contains(hypothesis), "{because}");
    assert!(!because.contains("; "), "another one fails: {because}");
}

/// n = 1, P = 1: x' = −x + Σ b_j λ_j, y = bᵀx + Dλ, with as many current ports as `d` has rows.
fn leaky(b: &[f64], d: DMatrix<f64>) -> Lcs {
    let b = DMatrix::from_row_slice(1, b.len(), b);
    let c = b.transpose();
    lcs(&"i".repeat(c.len()), dmatrix![-1.0], b, c, d, dmatrix![1.0])
}

/// Two ideal diodes across one capacitor, in opposite directions: y = (x, −x).
fn antiparallel() -> Lcs {
    leaky(&[1.0, -1.0], DMatrix::zeros(2, 2))
}

/// A straight line in two rays through (v, i): directions (dv, di).
fn curve(at: (f64, f64), first: (f64, f64), last: (f64, f64)) -> Law {
    let value = |p: (f64, f64)| (Value::binary(p.0), Value::binary(p.1));
    Law::Curve(Curve {
        kind: "table",
        vertices: vec![value(at)],
        first: value(first),
        last: value(last),
    })
}

fn with_laws(mut circuit: Lcs, laws: &[Law]) -> Lcs {
    change(&mut circuit, |parts| {
        for (port, law) in parts.ports.iter_mut().zip(laws) {
            port.law = law.clone();
        }
    });
    circuit
}

fn with_offsets(mut circuit: Lcs, f: &[f64]) -> Lcs {
    change(&mut circuit, |parts| parts.f.copy_from_slice(f));
    circuit
}

fn driven(mut circuit: Lcs, wave: Wave, e: f64, g: &[f64]) -> Lcs {
    let name = format!("v{}", circuit.p() + 1);
    drive(&mut circuit, &name, wave, &[e], g);
    circuit
}

/// Between offset − amplitude and offset + amplitude for damping ≥ 0.
fn sine(offset: f64, amplitude: f64, damping: f64) -> Wave {
    Wave::Sin {
        offset,
        amplitude,
        frequency: 1.0,
        delay: 0.0,
        damping,
        phase: 0.0,
        cycles: None,
    }
}

const KATO: &str = "RR-7158 Theorem 1";
const MONOTONE: &str = "RR-7158 Theorem 2";
const SWEEPING: &str = "Brogliato-Thibault Theorem 3.5";
const BLOCKS: &str = "Brogliato-Thibault section 3.3";

#[test]
fn assumption_1_asks_for_an_interval_of_lambda() {
    // λ = 1 A whatever y is: dom φ* is a point. A resistor of 1 Ω has all of R.
    let source = curve((0.0, 1.0), (1.0, 0.0), (1.0, 0.0));
    let resistor = curve((0.0, 0.0), (1.0, 1.0), (1.0, 1.0));
    for statement in [KATO, MONOTONE] {
        let circuit = leaky(&[1.0], dmatrix![0.0]);
        fails_by(
            &with_laws(circuit.clone(), std::slice::from_ref(&source)),
            statement,
            "Assumption 1 fails at d1",
        );
        holds(
            &with_laws(circuit, std::slice::from_ref(&resistor)),
            statement,
        );
    }
}

#[test]
fn assumption_2_asks_for_an_energy_that_couples_the_ports() {
    let mut reversed = leaky(&[1.0], dmatrix![0.0]);
    change(&mut reversed, |s| s.c[(0, 0)] = -1.0);
    for statement in [KATO, SWEEPING] {
        holds(&leaky(&[1.0], dmatrix![0.0]), statement);
        assert_eq!(verdict(&reversed, statement).0, Some(false));
        assert!(
            verdict(&reversed, statement)
                .1
                .contains("no P = Pᵀ ≻ 0 with PB = Cᵀ (residual 1.0e0")
        );
    }
    // Any P will do, not the stored energy alone: B = 1, C = 3.
    let mut other = leaky(&[1.0], dmatrix![0.0]);
    change(&mut other, |s| s.c[(0, 0)] = 3.0);
    holds(&other, KATO);
    assert!(verdict(&other, KATO).1.contains("some P ≻ 0"));
}

#[test]
fn assumption_3_asks_for_a_state_inside_the_domain() {
    // x > 0 and −x > 0: none. With forward drops of 1 V: −1 < x < 1.
    fails_by(&antiparallel(), KATO, "Assumption 3");
    holds(&with_offsets(antiparallel(), &[1.0, 1.0]), KATO);
    fails_by(
        &with_offsets(antiparallel(), &[1.0, -1.0]),
        KATO,
        "Assumption 3",
    );
}

#[test]
fn proposition_1_takes_any_law_and_proposition_2_cones_alone() {
    let zener = curve((0.0, 0.0), (2.0, 1.0), (1.0, 2.0));
    // Principal minors 1, 1, 1, but D + Dᵀ is indefinite.
    let p_matrix = leaky(&[1.0, 0.5], dmatrix![1.0, 3.0; 0.0, 1.0]);
    holds(&p_matrix, KATO);
    assert!(verdict(&p_matrix, KATO).1.contains("Proposition 2"));
    fails_by(
        &with_laws(p_matrix, &[zener.clone(), zener.clone()]),
        KATO,
        "neither positive semidefinite nor known to be a P-matrix",
    );
    let definite = leaky(&[1.0, 0.5], dmatrix![1.0, 1.0; 0.0, 1.0]);
    let definite = with_laws(definite, &[zener.clone(), zener]);
    holds(&definite, KATO);
    assert!(verdict(&definite, KATO).1.contains("Proposition 1"));
    fails_by(
        &leaky(&[1.0], dmatrix![-1.0]),
        KATO,
        "neither positive semidefinite",
    );
}

#[test]
fn proposition_3_asks_for_20() {
    // ker(D + Dᵀ) = span (1, 1), D(1, 1) = 0, (1, 1) ≥ 0.
    fails_by(
        &leaky(&[1.0, -1.0], dmatrix![0.5, -0.5; -0.5, 0.5]),
        KATO,
        "(20) fails",
    );
    // ker = span (1, −1): no direction of it is ≥ 0.
    let crossed = leaky(&[1.0, 1.0], dmatrix![0.5, 0.5; 0.5, 0.5]);
    holds(&crossed, KATO);
    assert!(verdict(&crossed, KATO).1.contains("Proposition 3"));
    // ker = span e₂, De₂ = ∓e₁: with the upper sign outside of the dual cone.
    let turned = |d: f64| leaky(&[1.0, 0.0], dmatrix![1.0, -d; d, 0.0]);
    holds(&turned(1.0), KATO);
    assert!(verdict(&turned(1.0), KATO).1.contains("Proposition 3"));
    fails_by(&turned(-1.0), KATO, "(20) fails");
    // I − uuᵀ with u ∝ (1, 2, 3): D u is rounding, not a direction.
    let u = DVector::from_column_slice(&[1.0, 2.0, 3.0]).normalize();
    let d = DMatrix::identity(3, 3) - &u * u.transpose();
    fails_by(&leaky(&[3.0, 0.0, -1.0], d), KATO, "(20) fails");
}

#[test]
fn proposition_3_asks_for_21() {
    // C ⊄ R(D + Dᵀ) and B·ker(D + Dᵀ) ≠ 0.
    fails_by(
        &leaky(&[1.0, 2.0], dmatrix![0.5, 0.5; 0.5, 0.5]),
        KATO,
        "(21)",
    );
    // C alone, B alone.
    let mut circuit = leaky(&[1.0, 1.0], dmatrix![0.5, 0.5; 0.5, 0.5]);
    change(&mut circuit, |s| s.c[(1, 0)] = 2.0);
    fails_by(&circuit, KATO, "up to 3.2e-1 and");
    let mut circuit = leaky(&[1.0, 1.0], dmatrix![0.5, 0.5; 0.5, 0.5]);
    change(&mut circuit, |s| s.b[(0, 1)] = -1.0);
    fails_by(&circuit, KATO, "and 1.4e0");
}

#[test]
fn corollary_1_knows_cones_other_than_the_orthant() {
    // A diode the other way round is λ, y ≤ 0; a wire is y = 0 and any λ.
    let reversed = curve((0.0, 0.0), (0.0, 1.0), (1.0, 0.0));
    let wire = curve((0.0, 0.0), (0.0, 1.0), (0.0, 1.0));
    let [along, crossed] = [0.5, -0.5].map(|d| dmatrix![0.5, d; d, 0.5]);
    // K = R₊ × R₋: the kernels (1, −1) and (1, 1) change parts.
    let laws = [Law::ideal_diode(), reversed];
    fails_by(
        &with_laws(leaky(&[1.0, 1.0], along.clone()), &laws),
        KATO,
        "(20) fails",
    );
    holds(&with_laws(leaky(&[1.0, -1.0], crossed), &laws), KATO);
    // K = R₊ × {0}: λ₂ takes either sign, so (1, −1) lies in K* × …, and D(1, −1) = 0.
    let laws = [Law::ideal_diode(), wire];
    fails_by(
        &with_laws(leaky(&[1.0, 1.0], along), &laws),
        KATO,
        "(20) fails",
    );
}

#[test]
fn theorem_1_asks_for_a_continuous_f_and_a_free_output() {
    let circuit = leaky(&[1.0], dmatrix![1.0]);
    holds(
        &driven(circuit.clone(), sine(0.0, 1.0, 0.0), 1.0, &[0.0]),
        KATO,
    );
    fails_by(
        &driven(circuit.clone(), square(), 1.0, &[0.0]),
        KATO,
        "f = Eu jumps (v1)",
    );
    fails_by(
        &driven(circuit.clone(), sine(0.0, 1.0, 0.0), 0.0, &[1.0]),
        KATO,
        "y depends on time through v1",
    );
    // Theorem 2 asks for the second alone.
    holds(&driven(circuit.clone(), square(), 1.0, &[0.0]), MONOTONE);
    fails_by(
        &driven(circuit, square(), 1.0, &[1.0]),
        MONOTONE,
        "y depends on time through v1",
    );
}

#[test]
fn theorem_2_asks_for_a_monotone_feedthrough_and_a_common_range() {
    fails_by(
        &leaky(&[1.0], dmatrix![-1.0]),
        MONOTONE,
        "D + Dᵀ has a negative eigenvalue",
    );
    // R(C) = span (1, −1) touches R(∂Φ*) = −R₊² at 0 alone; forward drops move it inside.
    fails_by(&antiparallel(), MONOTONE, "relative interior");
    holds(&with_offsets(antiparallel(), &[1.0, 1.0]), MONOTONE);
    // A resistance in series with either diode: R(D + ∂Φ*) is everything.
    holds(&leaky(&[1.0, -1.0], DMatrix::identity(2, 2)), MONOTONE);
}

#[test]
fn assumption_7_asks_for_rest_at_zero() {
    let quiet = leaky(&[1.0], dmatrix![1.0]);
    let mut fed = quiet.clone();
    change(&mut fed, |s| s.e0[0] = 1.0);
    let reversed = with_offsets(quiet.clone(), &[-1.0]);
    // A law that passes 0 by: 1 A at 0 V.
    let offset = with_laws(quiet.clone(), &[curve((0.0, 1.0), (1.0, 1.0), (1.0, 1.0))]);
    for statement in ["RR-7158 Theorem 3", "RR-7158 Theorem 4"] {
        holds(&quiet, statement);
        // A forward drop is no source: λ = 0 stays a solution.
        holds(&with_offsets(quiet.clone(), &[1.0]), statement);
        for circuit in [&fed, &reversed, &offset] {
            fails_by(circuit, statement, "Assumption 7 fails");
        }
        fails_by(
            &driven(quiet.clone(), square(), 1.0, &[0.0]),
            statement,
            "not autonomous: driven by v1",
        );
        let mut active = quiet.clone();
        change(&mut active, |s| s.a[(0, 0)] = 1.0);
        fails_by(&active, statement, "not passive");
    }
    // Theorem 5 needs φ* to grow: a forward drop does it, an ideal diode does not.
    holds(&with_offsets(quiet.clone(), &[1.0]), "RR-7158 Theorem 5");
    fails_by(&quiet, "RR-7158 Theorem 5", "for z ≠ 0 fails");
}

#[test]
fn the_order_of_steps_asks_for_a_well_posed_system_and_for_cones() {
    let order = |circuit: &Lcs| {
        let report = system(circuit);
        let found = theorem(&report, "RR-7158 Remark 7").clone();
        (found.holds, found.gives)
    };
    let (holds, gives) = order(&leaky(&[1.0], dmatrix![1.0]));
    assert!(
        holds == Some(true) && gives.ends_with("with order 1"),
        "{gives}"
    );
    let resistor = curve((0.0, 0.0), (1.0, 1.0), (1.0, 1.0));
    let (holds, gives) = order(&with_laws(leaky(&[1.0], dmatrix![1.0]), &[resistor]));
    assert!(
        holds == Some(true) && gives.ends_with("with order 1/2 at least"),
        "{gives}"
    );
    fails_by(
        &leaky(&[1.0], dmatrix![-1.0]),
        "RR-7158 Remark 7",
        "none of the above applies",
    );
}

#[test]
fn the_dissipation_argument_asks_for_rest_and_passivity() {
    const DISSIPATION: &str = "Dissipation argument";
    let quiet = leaky(&[1.0], dmatrix![1.0]);
    holds(&quiet, DISSIPATION);
    // Driven, there is no equilibrium to ask for either.
    let (driven_holds, because) =
        verdict(&driven(quiet.clone(), square(), 1.0, &[0.0]), DISSIPATION);
    assert_eq!(driven_holds, Some(false));
    assert!(
        because.starts_with("not autonomous: driven by v1; no equilibrium"),
        "{because}"
    );
    let mut active = quiet.clone();
    change(&mut active, |s| s.a[(0, 0)] = 1.0);
    fails_by(&active, DISSIPATION, "not passive");
    // A source that fills a capacitor for ever.
    let mut filled = quiet;
    change(&mut filled, |s| (s.a[(0, 0)], s.e0[0]) = (0.0, 1.0));
    fails_by(&filled, DISSIPATION, "no equilibrium was found");
}
