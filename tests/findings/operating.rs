//! Operating points, and small signals about them: what integrators, sources and temperatures are there, from ngspice 39.

use circ::analysis::{SmallSignalOptions, small_signal};
use circ::{Model, OperatingPoint, SimOptions};

/// A netlist with pieces of its text replaced; each must occur.
fn model(name: &str, replacements: &[(&str, &str)]) -> Model {
    let mut text = std::fs::read_to_string(super::path(name)).expect("a netlist");
    for (from, to) in replacements {
        assert!(text.contains(from), "{name}: {from}");
        text = text.replace(from, to);
    }
    Model::parse(&text, name).expect("a circuit")
}

fn point(name: &str, replacements: &[(&str, &str)]) -> OperatingPoint {
    let point = model(name, replacements).operating_point();
    point.unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn volts(point: &OperatingPoint, node: &str) -> f64 {
    let found = point.nodes.iter().find(|(name, _)| name == node);
    found.expect("a node").1
}

fn agree(point: &OperatingPoint, expected: &[(&str, f64)]) {
    for &(node, expected) in expected {
        let found = volts(point, node);
        assert!((found - expected).abs() < 1e-6, "v({node}) = {found}");
    }
}

/// It was charged up to its limit, where it has no response, and without limits it had no operating point.
#[test]
fn an_integrator_holds_its_initial_value() {
    let name = "integrator_at_rest";
    let without = (" out_lower_limit=-5 out_upper_limit=5", "");
    let over = ("out_ic=2", "out_ic=7");
    let positions = (
        "r1 y 0 1k",
        "r1 y 0 1k\n.nodeset v(b)=1\ns1 b 0 y 0 sw\nr2 b 0 1k\n.model sw sw(vt=1)",
    );
    for (replaced, expected) in [
        (&[][..], 2.0),
        (&[without], 2.0),
        (&[over], 5.0),
        (&[positions], 2.0),
    ] {
        let found = volts(&point(name, replaced), "y");
        assert!((found - expected).abs() < 1e-12, "{replaced:?}: {found}");
    }
    // 100/(jω).
    for replaced in [&[][..], &[without]] {
        let response = small_signal(&model(name, replaced), &SmallSignalOptions::default());
        let phasors = response.expect("a response").phasors;
        for (y, f) in phasors.column(0).zip(&phasors.frequency) {
            let expected = -100.0 / (std::f64::consts::TAU * f);
            assert!(y.re.abs() < 1e-12 && (y.im - expected).abs() < 1e-9, "{y}");
        }
    }
}

/// Without a `DC` value they have the value before t = 0. What rises at once at t = 0 had risen, and the exponential had fallen below where it began, as
/// nothing is as short as its defaults without `.tran`.
#[test]
fn sources_have_the_value_before_zero() {
    let name = "sources_before_zero";
    let expected = [
        ("a", 1.0),
        ("b", 1.0),
        ("c", 0.0),
        ("d", 5.0),
        ("e", 2.0),
        ("f", 1.0),
        ("g", 0.0),
        ("h", 2.0),
        ("k", 0.370_559_217_6),
    ];
    agree(&point(name, &[]), &expected);
    agree(&point(name, &[(".end", ".tran 1u 1m\n.end")]), &expected);
    // A diode of rd = VT/I in series with 1 kΩ.
    let response = small_signal(&model(name, &[]), &SmallSignalOptions::default());
    let gain = response.expect("a response").phasors.column(0).next();
    let expected = 0.370_559_2 / (0.370_559_2 + 0.025_864_9);
    let gain = gain.expect("a frequency").norm();
    assert!((gain - expected).abs() < 1e-5, "{gain}");
}

/// The option was skipped, with a note that it changes nothing: v(b) and v(c) were 633 mV.
#[test]
fn models_hold_at_the_nominal_temperature_of_options() {
    let expected = [
        ("b", 0.717_658_2),
        ("c", 0.717_914_0),
        ("d", 0.633_429_2),
        ("e", 2.529_084_5),
    ];
    agree(&point("nominal_temperature", &[]), &expected);
}

/// Next to no current flows through the mirror: its voltage is that of its knee, and large terms, as those of milliohms at volts that cancel, hide that it is not. By scipy on the
/// equations of Ebers and Moll, with `gmin` beside every junction: a leakage that circ has where something hangs on it, which moves v(c1) by its part of the current.
#[test]
fn a_mirror_without_current_has_the_voltage_of_its_knee() {
    let point = point("mirror_far_from_its_knee", &[]);
    for (node, expected) in [
        ("c1", 14.07526),
        ("c2", -1.16720),
        ("b2", -0.172562),
        ("e", -1.215718),
    ] {
        let found = volts(&point, node);
        assert!((found - expected).abs() < 5e-5, "v({node}) = {found}");
    }
}

/// A transient begins at its operating point, and stays there.
#[test]
fn a_transient_stays_at_rest() {
    for (name, steps) in [
        ("mirror_far_from_its_knee", 200),
        ("reverse_transistor_feeds_a_coil", 200),
        ("junction_blocks_a_coil", 200),
        ("follower_at_rest", 200),
        ("doubler_at_rest", 200),
    ] {
        let model = model(name, &[]);
        let rest = model.operating_point().expect("an operating point");
        let run = model.transient(SimOptions::default()).expect("a run");
        assert_eq!(run.state_jumps.all.0, 0, "{name}");
        assert!(run.stats.steps < steps, "{name}: {} steps", run.stats.steps);
        for (column, signal) in run.waveforms.names.iter().enumerate() {
            let Some(node) = signal
                .strip_prefix("v(")
                .and_then(|rest| rest.strip_suffix(')'))
            else {
                continue;
            };
            let expected = volts(&rest, node);
            let off = run.waveforms.column(column).map(|v| (v - expected).abs());
            let off = off.fold(0.0, f64::max);
            assert!(
                off < 1e-6 * (1.0 + expected.abs()),
                "{name}: v({node}) by {off:e}"
            );
        }
    }
}

/// After its pulse everything that flows is leakage: steps do not shrink for the rounding of larger terms. They were 266,453.
#[test]
fn what_rests_after_a_pulse_takes_long_steps() {
    let model = model("regulator_after_a_pulse", &[]);
    let run = model.transient(SimOptions::default()).expect("a run");
    assert!(run.stats.steps < 2000, "{} steps", run.stats.steps);
}
