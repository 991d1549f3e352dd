//! Reports on the circuits of the papers and of CIRCUITS.

use nalgebra::{DMatrix, DVector, dmatrix};

use super::*;
use crate::algebra::Value;
use crate::circuit::Source;
use crate::circuit::source::Wave;
use crate::law::Law;
use crate::lcs::{Input, LcsParts, Port, Role, State, Storage};

mod hypotheses;
mod report;
mod rest;

/// An autonomous system of ideal diodes with the given roles (`i` for λ = i, `v` for λ = −v).
pub(super) fn lcs(
    roles: &str,
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    d: DMatrix<f64>,
    energy: DMatrix<f64>,
) -> Lcs {
    let (n, m) = (a.nrows(), d.nrows());
    let port = |(j, role): (usize, char)| Port {
        device: format!("d{}", j + 1),
        role: if role == 'i' {
            Role::Current
        } else {
            Role::Voltage
        },
        lambda: String::new(),
        y: String::new(),
        law: Law::ideal_diode(),
    };
    Lcs::new(LcsParts {
        states: (0..n)
            .map(|k| State {
                name: format!("x{}", k + 1),
                unit: "V",
            })
            .collect(),
        ports: roles.chars().enumerate().map(port).collect(),
        e: DMatrix::zeros(n, 0),
        g: DMatrix::zeros(m, 0),
        e0: DVector::zeros(n),
        f: DVector::zeros(m),
        shift: DMatrix::zeros(n, 0),
        a,
        b,
        c,
        d,
        energy,
        storage: Storage {
            inject_one: DVector::zeros(n),
            ..Storage::default()
        },
        ..LcsParts::default()
    })
    .unwrap()
}

/// Changes parts of a system.
pub(super) fn change(lcs: &mut Lcs, change: impl FnOnce(&mut LcsParts)) {
    *lcs = std::mem::take(lcs).changed(change).unwrap();
}

/// Adds a source with columns (E, G).
pub(super) fn drive(lcs: &mut Lcs, name: &str, wave: Wave, e: &[f64], g: &[f64]) {
    let p = lcs.p();
    let driven = std::mem::take(lcs).changed(|parts| {
        parts.inputs.push(Input {
            name: name.into(),
            unit: "V",
            source: Source { dc: 0.0, wave },
        });
        parts.e = parts.e.clone().insert_column(p, 0.0);
        parts.g = parts.g.clone().insert_column(p, 0.0);
        parts.shift = parts.shift.clone().insert_column(p, 0.0);
        parts.e.column_mut(p).copy_from_slice(e);
        parts.g.column_mut(p).copy_from_slice(g);
    });
    *lcs = driven.unwrap();
}

const C: f64 = 1e-6;
const L: f64 = 1e-2;
const R: f64 = 1e3;

fn bridge() -> Lcs {
    lcs(
        "vvii",
        dmatrix![0.0, -1.0 / C; 1.0 / L, 0.0],
        dmatrix![0.0, 0.0, -1.0 / C, 1.0 / C; 0.0, 0.0, 0.0, 0.0],
        dmatrix![0.0, 0.0; 0.0, 0.0; -1.0, 0.0; 1.0, 0.0],
        dmatrix![1.0 / R, 1.0 / R, -1.0, 0.0; 1.0 / R, 1.0 / R, 0.0, -1.0; 1.0, 0.0, 0.0, 0.0; 0.0, 1.0, 0.0, 0.0],
        dmatrix![C, 0.0; 0.0, L],
    )
}

fn filtered() -> Lcs {
    lcs(
        "ivii",
        dmatrix![-1.0 / (R * C)],
        dmatrix![1.0 / C, 0.0, 1.0 / C, 0.0],
        dmatrix![1.0; 0.0; 1.0; 0.0],
        dmatrix![0.0, -1.0, 0.0, 0.0; 1.0, 0.0, 1.0, -1.0; 0.0, -1.0, 0.0, 0.0; 0.0, 1.0, 0.0, 0.0],
        dmatrix![C],
    )
}

fn theorem<'r>(report: &'r Report, statement: &str) -> &'r Theorem {
    report
        .theorems
        .iter()
        .find(|t| t.statement.starts_with(statement))
        .expect("statement present")
}

/// 0 and 1 in turn, for half a second each.
fn square() -> Wave {
    Wave::Pulse {
        v1: 0.0,
        v2: 1.0,
        delay: 0.0,
        rise: 0.0,
        fall: 0.0,
        width: 0.5,
        period: 1.0,
        count: None,
    }
}

#[test]
fn bridge_of_36_and_37_is_theorem_2_with_its_stored_energy() {
    let report = system(&bridge());
    assert_eq!(
        (report.passive, report.p_from),
        (Some(true), Some("stored energy"))
    );
    assert_eq!(report.strictly_passive, Some(false));
    assert!(report.residuals.unwrap().lmi_max_eigenvalue <= 1e-12);
    assert_eq!(
        theorem(&report, "RR-7158 Theorem 2").holds,
        Some(true),
        "{report}"
    );
    assert_eq!(
        theorem(&report, "RR-7158 Theorem 1").holds,
        Some(false),
        "{report}"
    );
    assert_eq!(
        theorem(&report, "Brogliato-Thibault Theorem 3.5").holds,
        Some(false),
        "{report}"
    );
    assert_eq!(theorem(&report, "RR-7158 Theorem 3").holds, Some(true));
    assert_eq!(theorem(&report, "RR-7158 Theorem 4").holds, Some(true));
    let five = theorem(&report, "RR-7158 Theorem 5");
    assert_eq!(five.holds, Some(false));
    assert!(five.because.contains("half line"));
    let bound: f64 = (L / C).sqrt();
    assert!((report.bound.unwrap() / bound - 1.0).abs() < 1e-12);
    insta::assert_snapshot!(report.to_string());
}

#[test]
fn capacitor_filter_of_38_is_the_skew_case() {
    let report = system(&filtered());
    let class = report.feedthrough.clone().unwrap();
    assert!(class.skew && class.psd && class.rank == 2);
    assert_eq!(
        theorem(&report, "RR-7158 Theorem 2").holds,
        Some(true),
        "{report}"
    );
    assert!((report.decay_rate * R * C - 1.0).abs() < 1e-5, "{report}");
    assert_eq!(report.jumps.states, ["x1"], "{report}");
    assert_eq!(report.equilibria.clone().unwrap()[0].x, [0.0]);
}

#[test]
fn a_driven_output_leaves_theorem_2_to_the_result_with_inputs() {
    let mut driven = filtered();
    let sine = Wave::Sin {
        offset: 0.0,
        amplitude: 10.0,
        frequency: 1e3,
        delay: 0.0,
        damping: 0.0,
        phase: 0.0,
        cycles: None,
    };
    drive(&mut driven, "v1", sine, &[0.0], &[0.0, 0.0, -1.0, 1.0]);
    let report = system(&driven);
    assert_eq!(theorem(&report, "RR-7158 Theorem 2").holds, Some(false));
    assert!(theorem(&report, "RR-7158 Theorem 2").because.contains("v1"));
    assert_eq!(theorem(&report, "RR-7158 Theorem 3").holds, Some(false));
    // λ is not unique: the loop current through the four diodes moves no state.
    let inputs = theorem(&report, "Camlibel-Heemels-Schumacher");
    assert_eq!(inputs.holds, Some(false));
    assert!(inputs.because.contains("rank"), "{}", inputs.because);
}

#[test]
fn current_source_into_an_inductor_is_example_3_1() {
    // (8): x' = ζ, 0 ≤ ζ ⟂ x − i(t) ≥ 0, in amperes with L = 10 mH: B = 1/L, P = L.
    let mut circuit = lcs(
        "v",
        dmatrix![0.0],
        dmatrix![1.0 / L],
        dmatrix![1.0],
        dmatrix![0.0],
        dmatrix![L],
    );
    drive(&mut circuit, "i1", square(), &[0.0], &[-1.0]);
    let report = system(&circuit);
    let sweeping = theorem(&report, "Brogliato-Thibault Theorem 3.5");
    assert_eq!(sweeping.holds, Some(true), "{report}");
    assert!(
        sweeping.gives.contains("projection") && sweeping.because.contains("i1"),
        "{sweeping:?}"
    );
    assert_eq!(report.jumps.sources, ["i1"]);
    assert_eq!(report.jumps.metric, "stored energy");
}

#[test]
fn rc_with_a_diode_in_series_is_a_differential_equation() {
    // (7) with its sign corrected, x the capacitor voltage: w = −u/R − x/R + ζ/R. Passive, D = 1/R > 0.
    let circuit = lcs(
        "v",
        dmatrix![-1.0 / (R * C)],
        dmatrix![1.0 / (R * C)],
        dmatrix![-1.0 / R],
        dmatrix![1.0 / R],
        dmatrix![C],
    );
    let report = system(&circuit);
    assert_eq!(report.p_from, Some("stored energy"));
    for statement in [
        "Brogliato-Thibault section A.4",
        "Brogliato-Thibault section 3.3",
        "RR-7158 Theorem 1",
        "RR-7158 Theorem 2",
    ] {
        assert_eq!(
            theorem(&report, statement).holds,
            Some(true),
            "{statement}\n{report}"
        );
    }
    assert!(
        theorem(&report, "RR-7158 Theorem 2")
            .because
            .contains("exchanged at d1")
    );
    assert!(report.jumps.states.is_empty() && report.jumps.analysed);
}

#[test]
fn verdicts_do_not_depend_on_roles() {
    // The half-wave rectifier with λ = −v: D = 1/R and no PB = Cᵀ; with λ = i: the same circuit.
    let (a, energy) = (
        dmatrix![0.0, -1.0 / C; 1.0 / L, 0.0],
        dmatrix![C, 0.0; 0.0, L],
    );
    let current = lcs(
        "i",
        a,
        dmatrix![-1.0 / C; 0.0],
        dmatrix![-1.0, 0.0],
        dmatrix![R],
        energy,
    );
    let pivoted = crate::passivity::System::of(&current).pivot(&[0]).unwrap();
    let mut voltage = current.clone();
    change(&mut voltage, |s| {
        (s.a, s.b, s.c, s.d) = (pivoted.a, pivoted.b, pivoted.c, pivoted.d)
    });
    change(&mut voltage, |s| s.ports[0].role = Role::Voltage);
    let (one, other) = (system(&current), system(&voltage));
    assert_eq!(one.passive, other.passive);
    for (t, s) in one.theorems.iter().zip(&other.theorems) {
        assert_eq!(
            t.holds, s.holds,
            "{}: {} / {}",
            t.statement, t.because, s.because
        );
    }
    assert_eq!(theorem(&other, "RR-7158 Theorem 2").holds, Some(true));
}

#[test]
fn colpitts_has_unique_steps_and_no_certificate() {
    let (l, c1, c2, rc, re, forward, reverse) = (0.1, 2.0, 0.8, 10.0, 20.0, 0.99, 0.015);
    let mut colpitts = lcs(
        "ii",
        dmatrix![
            -1.0 / (rc * c1), -1.0 / (rc * c1), 1.0 / c1;
            -1.0 / (rc * c2), -(1.0 / rc + 1.0 / re) / c2, 1.0 / c2;
            -1.0 / l, -1.0 / l, 0.0
        ],
        dmatrix![1.0 / c1, -forward / c1; (1.0 - reverse) / c2, (1.0 - forward) / c2; 0.0, 0.0],
        dmatrix![1.0, 1.0, 0.0; 0.0, 1.0, 0.0],
        DMatrix::zeros(2, 2),
        DMatrix::from_diagonal(&DVector::from_column_slice(&[c1, c2, l])),
    );
    let e0 =
        DVector::from_column_slice(&[10.0 / (rc * c1), (10.0 / rc - 20.0 / re) / c2, 10.0 / l]);
    change(&mut colpitts, |s| s.e0 = e0);
    let report = system(&colpitts);
    assert_ne!(report.passive, Some(true), "{report}");
    assert_eq!(
        theorem(&report, "Leading Markov").holds,
        Some(true),
        "{report}"
    );
    assert_eq!(
        theorem(&report, "Brogliato-Thibault Theorem 3.5").holds,
        Some(false),
        "{report}"
    );
}

#[test]
fn forward_drops_make_theorem_5_apply() {
    // Half-wave rectifier with a 0.7 V diode: Φ^{*,−}(z) = 0.7 z on z ≥ 0.
    let mut circuit = lcs(
        "i",
        dmatrix![0.0, -1.0 / C; 1.0 / L, 0.0],
        dmatrix![-1.0 / C; 0.0],
        dmatrix![-1.0, 0.0],
        dmatrix![R],
        dmatrix![C, 0.0; 0.0, L],
    );
    assert_eq!(
        theorem(&system(&circuit), "RR-7158 Theorem 5").holds,
        Some(false)
    );
    change(&mut circuit, |s| {
        s.ports[0].law = Law::Diode {
            vfwd: Value::binary(0.7),
            ron: Value::binary(0.0),
            roff: None,
        }
    });
    let report = system(&circuit);
    let five = theorem(&report, "RR-7158 Theorem 5");
    assert_eq!(five.holds, Some(true), "{report}");
    // The lossless tank itself: every point of the plane has ⟨PAz, z⟩ = 0, and swings below 0.7 V never end.
    assert!(
        five.gives.contains("motions of x1, x2 in 2 dimensions"),
        "{}",
        five.gives
    );
    let long_run = report.convergence.unwrap();
    assert_eq!((long_run.by, &long_run.to), ("RR-7158 Theorem 5", &None));
    assert_eq!(long_run.moving, ["x1", "x2"]);
    let tank = 1.0 / (std::f64::consts::TAU * (L * C).sqrt());
    assert!(
        (long_run.frequencies_hz[0] / tank - 1.0).abs() < 1e-9,
        "{long_run:?}"
    );
    // A resistor across the tank brings it to rest.
    change(&mut circuit, |s| s.a[(0, 0)] = -1.0 / (R * C));
    let report = system(&circuit);
    assert_eq!(report.convergence.unwrap().to, Some(vec![0.0, 0.0]));
    assert!(
        theorem(&system(&circuit), "RR-7158 Theorem 5")
            .gives
            .contains("one point")
    );
}
