//! Where circuits come to rest, and whether they do.

use nalgebra::dmatrix;

use super::*;

#[test]
fn a_negative_resistor_makes_rc_active() {
    let report = system(&lcs(
        "i",
        dmatrix![1.0 / (R * C)],
        dmatrix![1.0 / C],
        dmatrix![1.0],
        dmatrix![R],
        dmatrix![C],
    ));
    assert_eq!((report.passive, report.p.clone()), (Some(false), None));
    assert!(report.passive_because.unwrap().contains("grows"));
    assert_eq!(report.strictly_passive, Some(false));
}

#[test]
fn a_negative_resistor_with_a_diode_rests_in_two_states() {
    // x' = −x + λ + 1/2, y = x − 3/2 λ: statically M = D − CA⁻¹B = −1/2, q = 1/2.
    let mut circuit = lcs(
        "i",
        dmatrix![-1.0],
        dmatrix![1.0],
        dmatrix![1.0],
        dmatrix![-1.5],
        dmatrix![1.0],
    );
    change(&mut circuit, |s| s.e0[0] = 0.5);
    let report = system(&circuit);
    assert_eq!(report.passive, Some(false));
    let equilibria = report.equilibria.clone().unwrap();
    assert_eq!(equilibria.len(), 2, "{report}");
    assert!(equilibria.iter().all(|e| e.unique == Some(false)));
    let states: Vec<f64> = equilibria.iter().map(|e| e.x[0]).collect();
    assert!(
        (states[0] - 0.5).abs() < 1e-12 && (states[1] - 1.5).abs() < 1e-12,
        "{states:?}"
    );
}

#[test]
fn circuits_without_states_show_their_solutions_or_that_there_is_none() {
    // A source, −R and a diode: y = q − Rλ. q = 1: λ = 0 or λ = 1/R; q = −1: neither.
    let none = DMatrix::zeros(0, 0);
    let mut circuit = lcs(
        "i",
        none.clone(),
        DMatrix::zeros(0, 1),
        DMatrix::zeros(1, 0),
        dmatrix![-R],
        none,
    );
    change(&mut circuit, |s| s.ports[0].lambda = "i(d1)".into());
    change(&mut circuit, |s| s.f[0] = 1.0);
    let report = system(&circuit);
    let currents: Vec<f64> = report
        .equilibria
        .iter()
        .flatten()
        .map(|e| e.lambda[0])
        .collect();
    assert_eq!(currents, [0.0, 1.0 / R]);
    assert!(
        report
            .to_string()
            .contains("equilibrium   i(d1) = 1.000000e-3"),
        "{report}"
    );
    change(&mut circuit, |s| s.f[0] = -1.0);
    let report = system(&circuit);
    assert_eq!(report.equilibria, Some(Vec::new()));
    assert!(
        report.to_string().contains("equilibrium   none"),
        "{report}"
    );
}

#[test]
fn dissipation_decides_where_a_circuit_with_ideal_diodes_comes_to_rest() {
    // The bridge on a tank: Theorem 5 does not apply, yet every motion ends at 0.
    let report = system(&bridge());
    let long_run = report.convergence.clone().unwrap();
    assert_eq!(
        (long_run.by, long_run.to),
        ("Dissipation argument", Some(vec![0.0, 0.0]))
    );
    assert!(
        report
            .to_string()
            .contains("converges to  x1 = 0.000000e0, x2 = 0.000000e0 from every start")
    );

    // A 5 V source, R, a diode and C in series: C charges to 5 V and keeps whatever is above. λ = i, y = x − 5 + Ri.
    let mut detector = lcs(
        "i",
        dmatrix![0.0],
        dmatrix![1.0 / C],
        dmatrix![1.0],
        dmatrix![R],
        dmatrix![C],
    );
    change(&mut detector, |s| s.f[0] = -5.0);
    let report = system(&detector);
    let long_run = report.convergence.unwrap();
    assert_eq!(
        (long_run.dimension, long_run.to),
        (1, None),
        "{:?}",
        report.equilibria
    );
    assert!(long_run.moving.is_empty());
    // With a load across C the diode conducts at rest: (5 − v)/R = v/R.
    change(&mut detector, |s| s.a[(0, 0)] = -1.0 / (R * C));
    let report = system(&detector);
    let to = report.convergence.unwrap().to.unwrap();
    assert!((to[0] - 2.5).abs() < 1e-9, "{to:?}");
    assert_eq!(report.equilibria.unwrap()[0].unique, Some(true));

    // A damped RC with a diode beside a lossless tank that nothing touches: the tank swings on.
    let apart = lcs(
        "i",
        dmatrix![0.0, -1.0 / C, 0.0; 1.0 / L, 0.0, 0.0; 0.0, 0.0, -1.0 / (R * C)],
        dmatrix![0.0; 0.0; 1.0 / C],
        dmatrix![0.0, 0.0, 1.0],
        dmatrix![R],
        DMatrix::from_diagonal(&DVector::from_column_slice(&[C, L, C])),
    );
    let long_run = system(&apart).convergence.unwrap();
    assert_eq!(long_run.moving, ["x1", "x2"]);
    assert_eq!(long_run.frequencies_hz.len(), 1);

    // A source that changes: nothing is said.
    let mut driven = bridge();
    let square = Wave::Sin {
        offset: 0.0,
        amplitude: 1.0,
        frequency: 1.0,
        delay: 0.0,
        damping: 0.0,
        phase: 0.0,
        cycles: None,
    };
    drive(&mut driven, "v1", square, &[1.0, 0.0], &[0.0; 4]);
    assert_eq!(system(&driven).convergence, None);
}

#[test]
fn comparators_are_read_with_the_sign_of_their_feedback() {
    // x' = −x + w, w = sgn(−x) as a block with input −x: λ = −w ∈ −∂φ(y) with y = −x makes (−1, −1, −1, 0).
    let curve = crate::law::Curve {
        kind: "relay",
        vertices: vec![
            (Value::binary(0.0), Value::binary(-1.0)),
            (Value::binary(0.0), Value::binary(1.0)),
        ],
        first: (Value::binary(1.0), Value::binary(0.0)),
        last: (Value::binary(1.0), Value::binary(0.0)),
    };
    let mut relay = lcs(
        "i",
        dmatrix![-1.0],
        dmatrix![1.0],
        dmatrix![-1.0],
        dmatrix![0.0],
        dmatrix![1.0],
    );
    change(&mut relay, |s| s.ports[0].role = Role::Function);
    change(&mut relay, |s| s.ports[0].law = Law::Curve(curve));
    let report = system(&relay);
    assert_eq!(
        theorem(&report, "RR-7158 Theorem 2").holds,
        Some(true),
        "{report}"
    );
    assert!(theorem(&report, "RR-7158 Remark 7").gives.contains("1/2"));
    // With positive feedback there is no P with PB = Cᵀ.
    change(&mut relay, |s| s.c = dmatrix![1.0]);
    assert_eq!(
        theorem(&system(&relay), "RR-7158 Theorem 2").holds,
        Some(false)
    );
}

#[test]
fn a_leak_that_nothing_carries_away_is_no_equilibrium() {
    // A detector that a source of δ fills further: x' = λ + δ, λ ≥ 0, y = x − 5 + λ. Beside it a capacitor that δ fills and a
    // loaded one that rests at 1 V. Nothing rests, however small δ is.
    for delta in [1e-3, 1e-6, 1e-8, 1e-9, 1e-10] {
        let mut detector = lcs(
            "i",
            dmatrix![0.0],
            dmatrix![1.0],
            dmatrix![1.0],
            dmatrix![1.0],
            dmatrix![1.0],
        );
        change(&mut detector, |s| (s.e0[0], s.f[0]) = (delta, -5.0));
        assert_eq!(system(&detector).equilibria, None, "δ = {delta}");
        let mut leaky = lcs(
            "i",
            dmatrix![0.0, 0.0; 0.0, -1.0],
            dmatrix![0.0; 1.0],
            dmatrix![0.0, 1.0],
            dmatrix![1.0],
            DMatrix::identity(2, 2),
        );
        change(&mut leaky, |s| s.e0.copy_from_slice(&[delta, 1.0]));
        assert_eq!(system(&leaky).equilibria, None, "δ = {delta}");
    }
    // Where δ is carried away, by the other diode of a channel, the rest is found: λ₂ − λ₁ = δ, |x| ≤ 5.
    for delta in [1.0, 1e-2, 1e-4] {
        let mut channel = lcs(
            "ii",
            dmatrix![0.0],
            dmatrix![1.0, -1.0],
            dmatrix![1.0; -1.0],
            DMatrix::zeros(2, 2),
            dmatrix![1.0],
        );
        change(&mut channel, |s| {
            s.e0[0] = delta;
            s.f.fill(5.0);
        });
        let rest = system(&channel).equilibria.unwrap_or_default();
        let rest = rest.first().unwrap_or_else(|| panic!("δ = {delta}"));
        assert!((rest.x[0] - 5.0).abs() < 1e-9, "{rest:?}");
        assert!(
            rest.lambda[0].abs() < 1e-12 && (rest.lambda[1] - delta).abs() < 1e-12,
            "{rest:?}"
        );
    }
}

#[test]
fn a_small_part_of_a_circuit_rests_to_its_own_digits() {
    // The detector of 5 V rests wherever it was charged; a loaded capacitor on a source of δ beside it rests at δ.
    for delta in [1e-3, 1e-6, 1e-9] {
        let mut circuit = lcs(
            "i",
            dmatrix![0.0, 0.0; 0.0, -1.0],
            dmatrix![1.0; 0.0],
            dmatrix![1.0, 0.0],
            dmatrix![1.0],
            DMatrix::identity(2, 2),
        );
        change(&mut circuit, |s| (s.e0[1], s.f[0]) = (delta, -5.0));
        let found = system(&circuit).equilibria.unwrap_or_default();
        let rest = found.first().unwrap_or_else(|| panic!("δ = {delta}"));
        assert!((rest.x[0] - 5.0).abs() < 1e-8, "{rest:?}");
        assert!((rest.x[1] / delta - 1.0).abs() < 1e-6, "{rest:?}");
    }
}
