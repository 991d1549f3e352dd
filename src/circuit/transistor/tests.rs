use super::super::{Circuit, ElaborateOptions, elaborate};
use super::*;
use crate::diagnostic::SourceMap;
use crate::netlist::parse;

fn read(text: &str) -> (Option<Circuit>, Vec<Diagnostic>) {
    let mut sources = SourceMap::default();
    let root = sources.add("test.cir", format!("title\nV1 a 0 5\nR1 a b 1\n{text}\n"));
    let (netlist, faults) = parse(&mut sources, root, &|_| {
        Err(std::io::ErrorKind::NotFound.into())
    });
    let (circuit, mut findings) = elaborate(&netlist, &ElaborateOptions::default());
    findings.extend(faults);
    (circuit, findings)
}

fn circuit(text: &str) -> Circuit {
    let (circuit, findings) = read(text);
    circuit.unwrap_or_else(|| panic!("{findings:?}"))
}

/// Threshold, on-resistance, and the gain of the gate in the control.
fn channel(text: &str) -> (f64, f64, f64) {
    let circuit = circuit(text);
    let kind = |e: &Element| match &e.kind {
        Kind::Switch(s) => Some((s.on_above, s.ron.f64, s.control.terms[0].0.f64)),
        _ => None,
    };
    circuit.elements.iter().find_map(kind).unwrap()
}

fn close(a: (f64, f64, f64), b: (f64, f64, f64)) {
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
    assert!(
        near(a.0, b.0) && near(a.1, b.1) && near(a.2, b.2),
        "{a:?} {b:?}"
    );
}

#[test]
fn thresholds_and_resistances() {
    for (text, expected) in [
        // 0.1 + 0.2 + 1/(2 (10 − 3)).
        (
            "M1 b g 0 m\n.model m VDMOS(Vto=3 Rd=0.1 Rs=0.2 Kp=2)",
            (3.0, 0.3 + 1.0 / 14.0, 1.0),
        ),
        // The gate reaches 12 V: 1/(2 (12 − 3)).
        (
            "M1 b g 0 m\nVg h 0 PULSE(0 12 0 1n 1n 1u 2u)\nRg h g 10\n.model m VDMOS(Vto=3 Kp=2)",
            (3.0, 1.0 / 18.0, 1.0),
        ),
        // β = 2e-5·10: 1/(2e-4 (5 − 1)).
        (
            "M1 b g 0 0 m W=10u L=1u\nVg g 0 5\n.model m NMOS(Vto=1)",
            (1.0, 1250.0, 1.0),
        ),
        // p-channel, source at 5 V, gate down to 0 V: 1/(1 (5 − 2)).
        (
            "M1 b g a a m\nVg g 0 PULSE(5 0 0 1n 1n 1u 2u)\n.model m VDMOS(pchan Vto=-2 Kp=1)",
            (2.0, 1.0 / 3.0, -1.0),
        ),
        // Two in parallel, and a datasheet value alone.
        (
            "M1 b g 0 m m=2\n.model m VDMOS(Vto=3 Ron=0.1 Vds=100)",
            (3.0, 0.05, 1.0),
        ),
        // An explicit 0 is an ideal channel.
        ("M1 b g 0 m\n.model m VDMOS(Vto=3 Ron=0)", (3.0, 0.0, 1.0)),
        // A JFET at 0 V: 1/(2·1e-3·(0 + 3)) + 1 + 2.
        (
            "J1 b g 0 m\n.model m NJF(Vto=-3 Beta=1m Rd=1 Rs=2)",
            (-3.0, 3.0 + 1.0 / 6e-3, 1.0),
        ),
        // An IGBT: 1/(2 (15 − 5)), driven by a source of its own.
        (
            "Z1 b g 0 m\nVg g 0 15\n.model m NIGBT(VT=5 KP=2)",
            (5.0, 0.05, 1.0),
        ),
    ] {
        close(channel(text), expected);
    }
}

#[test]
fn body_diodes_follow_the_polarity() {
    let diode = |text: &str| {
        let circuit = circuit(text);
        let of = |e: &Element| {
            (
                e.name.clone(),
                circuit.nodes[e.p.index()].clone(),
                circuit.nodes[e.n.index()].clone(),
            )
        };
        let devices = circuit
            .elements
            .iter()
            .filter(|e| matches!(e.kind, Kind::Device(_)));
        devices.map(of).collect::<Vec<_>>()
    };
    let named = |all: &[(&str, &str, &str)]| -> Vec<(String, String, String)> {
        all.iter()
            .map(|(a, b, c)| ((*a).into(), (*b).into(), (*c).into()))
            .collect()
    };
    let n = "\n.model m VDMOS(Vto=3)";
    assert_eq!(
        diode(&format!("M1 b g 0 m{n}")),
        named(&[("m1.body", "0", "m1.d")])
    );
    let p = "\n.model m PMOS(Vto=-3 KP=1)";
    assert_eq!(
        diode(&format!("M1 b g a a m{p}")),
        named(&[("m1.body", "m1.d", "a")])
    );
    // A bulk of its own has a diode to either side.
    assert_eq!(
        diode("M1 b g s 0 m\nR2 s 0 1\n.model m NMOS(Vto=1)"),
        named(&[("m1.bd", "0", "m1.d"), ("m1.bs", "0", "s")])
    );
    // A JFET has none; an IGBT conducts one way only.
    assert_eq!(diode("J1 b g 0 m\n.model m NJF"), Vec::new());
    assert_eq!(
        diode("Z1 b g 0 m\n.model m NIGBT"),
        named(&[("z1", "b", "z1.d")])
    );
}

#[test]
fn every_model_is_told_once_and_what_is_no_switch_is_refused() {
    let codes = |text: &str| -> Vec<(&'static str, bool)> {
        let (circuit, findings) = read(text);
        findings
            .iter()
            .filter(|d| d.code != "no-analysis")
            .map(|d| (d.code, circuit.is_some()))
            .collect()
    };
    assert_eq!(
        codes("M1 b g 0 m\nM2 b h 0 m\nRg g h 1\n.model m VDMOS(Vto=3)"),
        [("transistor-as-switch", true)]
    );
    let helps = |model: &str| {
        let (_, findings) = read(&format!("M1 b g 0 0 m\n.model m NMOS{model}"));
        let helps = findings.iter().filter(|d| d.code == "transistor-as-switch");
        helps.map(|d| d.help.is_some()).collect::<Vec<_>>()
    };
    assert_eq!(helps(""), [true]);
    assert_eq!(helps("(Ron=1)"), [false]);
    assert_eq!(helps("(KP=5)"), [false]);
    assert_eq!(
        codes("M1 b b 0 m\n.model m VDMOS(Vto=3)"),
        [("not-a-switch", false)]
    );
    assert_eq!(
        codes("M1 b g 0 0 m\n.model m NMOS(level=8 vth0=0.4)"),
        [("unsupported-model", false)]
    );
    assert_eq!(codes("M1 b g 0 m\n.model m D"), [("wrong-model", false)]);
    assert_eq!(codes("M1 b g 0 m"), [("unknown-model", false)]);
    assert_eq!(
        codes("M1 b g 0 m W=0\n.model m NMOS"),
        [("bad-value", false)]
    );
}
