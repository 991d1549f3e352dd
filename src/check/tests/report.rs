//! What stands in every report.

use nalgebra::dmatrix;

use super::*;

#[test]
fn json_has_the_contracted_keys() {
    let json = serde_json::to_value(system(&bridge())).unwrap();
    for key in [
        "ok",
        "faults",
        "islands",
        "normal_tree",
        "size",
        "feedthrough",
        "passive",
        "strictly_passive",
        "decay_rate",
        "P",
        "P_from",
        "residuals",
        "theorems",
        "stiffness",
        "conditioning",
    ] {
        assert!(json.get(key).is_some(), "{key}");
    }
    assert_eq!(json["P_from"], "stored energy");
    assert_eq!(json["feedthrough"]["rank"], 4);
    assert!(json["residuals"]["pb_minus_ct"].is_number());
    assert_eq!(json["theorems"][3]["holds"], true);
    assert!(json["stiffness"]["fastest_s"].is_number());
}

#[test]
fn circuits_without_states_or_ports_are_reported_too() {
    let none = DMatrix::zeros(0, 0);
    let resistive = lcs(
        "i",
        none.clone(),
        DMatrix::zeros(0, 1),
        DMatrix::zeros(1, 0),
        dmatrix![R],
        none.clone(),
    );
    let report = system(&resistive);
    assert_eq!((report.passive, report.size.n), (Some(true), 0));
    assert_eq!(
        theorem(&report, "Brogliato-Thibault section A.4").holds,
        Some(true),
        "{report}"
    );
    let linear = lcs(
        "",
        dmatrix![-1.0 / (R * C)],
        DMatrix::zeros(1, 0),
        DMatrix::zeros(0, 1),
        none.clone(),
        dmatrix![C],
    );
    let report = system(&linear);
    assert_eq!(theorem(&report, "Linear system").holds, Some(true));
    assert!((report.decay_rate * R * C - 1.0).abs() < 1e-5);
    let empty = system(&Lcs::default());
    assert_eq!(empty.passive, Some(true), "{empty}");
}

#[test]
fn an_energy_that_is_not_given_is_looked_for() {
    let unknown = bridge().changed(|parts| parts.energy = DMatrix::zeros(0, 0));
    let circuit = unknown.unwrap();
    let report = system(&circuit);
    assert_eq!((report.passive, report.p_from), (Some(true), Some("lmi")));
    assert_eq!(
        theorem(&report, "RR-7158 Theorem 2").holds,
        Some(true),
        "{report}"
    );
}
