//! Steady states that are rest, or of which a part rests.

use circ::analysis::{Orbit, OrbitKind, PeriodicOptions, periodic};
use circ::circuit::{Diodes, ElaborateOptions};
use circ::{Model, Run};

use super::runs::column;

/// The steady state of a netlist, its diodes as its models say or all exponential.
fn settled(path: &str, diodes: Diodes) -> (Orbit, Run) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    let options = ElaborateOptions {
        diodes,
        ..ElaborateOptions::default()
    };
    let model = Model::load(&path, options).expect("a circuit");
    let found = periodic(&model, &PeriodicOptions::default());
    found.unwrap_or_else(|error| panic!("{path:?}: {error}"))
}

fn codes(run: &Run) -> Vec<&str> {
    run.notes.iter().map(|note| note.code).collect()
}

/// Its reference is held at 0, so that a controller rests; what exponential diodes leak, 1e-13 V, is no orbit whose digits count. Multipliers
/// are those of ideal diodes, which block.
#[test]
fn controllers_at_rest_have_the_multipliers_of_ideal_diodes() {
    for name in ["buck-feedback", "buck-double-crossing", "buck-mos"] {
        let path = format!("netlists/{name}.cir");
        let (exact, of_lines) = settled(&path, Diodes::Auto);
        let (steps, of_curves) = settled(&path, Diodes::Exp);
        assert!(exact.stable && steps.stable, "{name}: {exact:?} {steps:?}");
        assert!(steps.residual < 1e-9, "{name}: {steps:?}");
        for (a, b) in exact.multipliers.iter().zip(&steps.multipliers) {
            assert!((a[0] - b[0]).abs() < 1e-5, "{name}: {exact:?} {steps:?}");
            assert!((a[1] - b[1]).abs() < 1e-5, "{name}: {exact:?} {steps:?}");
        }
        // A loop of large gain makes I − M next to singular; no multiplier is 1.
        assert_eq!(codes(&of_lines), ["held-source"], "{name}");
        assert_eq!(
            codes(&of_curves),
            ["next-to-nothing", "held-source"],
            "{name}"
        );
    }
}

/// A comparator of infinite gain rests with its input where its output jumps: to one side a disturbance dies out, to the other one it makes the
/// transistor conduct.
#[test]
fn a_rest_on_a_threshold_has_no_multipliers() {
    for diodes in [Diodes::Auto, Diodes::Exp] {
        let (orbit, run) = settled("netlists/buck-sliding.cir", diodes);
        assert!(orbit.multipliers.is_empty() && !orbit.stable, "{orbit:?}");
        assert!(codes(&run).ends_with(&["held-source", "rests-on-threshold"]));
        let v = column(&run, "v(3)");
        assert!(v.iter().all(|v| v.abs() < 1e-9), "{v:?}");
    }
}

/// Exact integration makes steps as short as the period of a tank, though it rests: the orbit is made in steps of the period of the source.
#[test]
fn a_tank_that_rests_beside_a_rectifier_has_an_orbit_in_steps() {
    let path = "tests/findings/tank_at_rest.cir";
    let (orbit, run) = settled(path, Diodes::Auto);
    assert!(codes(&run).contains(&"steps-instead"), "{:?}", run.notes);
    let text = std::fs::read_to_string(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(path));
    let text = text.expect("a netlist");
    let alone = text
        .replace("L2 3 0 1p IC=0", "R2 3 0 1")
        .replace("C2 3 0 1n IC=0", "");
    let model = Model::parse(&alone, "alone.cir").expect("a circuit");
    let (exact, reference) = periodic(&model, &PeriodicOptions::default()).expect("an orbit");
    // Steps that damp the tank know nothing of its multipliers, which lie on the unit circle.
    assert!(orbit.multipliers.is_empty() && !orbit.stable, "{orbit:?}");
    assert!(exact.stable, "{exact:?}");
    let stated = run.error.max.expect("steps state an error");
    let (a, b) = (column(&run, "v(2)"), column(&reference, "v(2)"));
    let largest = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    assert!(a.len() == b.len() && stated < 1e-2, "{stated:e}");
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() <= stated * largest, "{a} {b} {stated:e}");
    }
    assert!(column(&run, "v(3)").iter().all(|v| v.abs() < 1e-12));
}

/// An inductor takes the current over from diodes that drop 9 mV, for 500 times as long as the run: at rest all of it flows there, at no voltage.
#[test]
fn a_rest_that_is_far_from_the_end_of_the_run_is_found() {
    let (orbit, run) = settled("tests/findings/fixed_step_estimate_zero.cir", Diodes::Exp);
    assert!(
        orbit.kind == OrbitKind::Equilibrium && orbit.stable,
        "{orbit:?}"
    );
    let [v1, v2, total, taken] =
        ["v(1)", "v(2)", "i(v1)", "i(l6)"].map(|name| column(&run, name)[0]);
    assert!(v2.abs() < 1e-12, "{v2:e}");
    assert!((total + (10.0 - v1) / 1.754011).abs() < 1e-9);
    // The diodes from node 1 to nodes at 0 V: two on the way to the inductor, and one beside.
    let diode = -total - v1 / 335.51176 - v1 / 2560.6;
    let expected = -(2.0 / 3.0 * diode + v1 / 335.51176);
    assert!((taken - expected).abs() < 1e-6, "{taken} {expected}");
}

/// A current that has died out in a diode is 1e-30 A, of which no digit is looked for.
#[test]
fn rows_of_a_rest_take_no_more_steps_than_those_of_an_orbit() {
    let (orbit, run) = settled("tests/findings/lost_current.cir", Diodes::Exp);
    assert_eq!(orbit.kind, OrbitKind::Equilibrium);
    assert!(run.stats.steps < 10_000, "{}", run.stats.steps);
}
