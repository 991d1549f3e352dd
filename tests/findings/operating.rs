//! Operating points, and small signals about them: what integrators, sources and temperatures are there, from ngspice 39.

use circ::analysis::{SmallSignalOptions, small_signal};
use circ::{Model, OperatingPoint};

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
