use super::super::{Circuit, ElaborateOptions, elaborate};
use super::*;
use crate::diagnostic::{Diagnostic, SourceMap};
use crate::integrate::{SimOptions, simulate};
use crate::netlist::parse;
use crate::waveform::Waveforms;

fn read(text: &str) -> (Option<Circuit>, Vec<Diagnostic>) {
    let mut sources = SourceMap::default();
    let root = sources.add("test.cir", format!("title\n{text}\n"));
    let (netlist, _) = parse(&mut sources, root, &|_| {
        Err(std::io::ErrorKind::NotFound.into())
    });
    elaborate(&netlist, &ElaborateOptions::default())
}

fn circuit(text: &str) -> Circuit {
    let (circuit, findings) = read(text);
    circuit.unwrap_or_else(|| panic!("{findings:?}"))
}

/// `b1` of a circuit with a ramp at `a`, a sine at `b` and ±5 V rails.
fn element(value: &str) -> Circuit {
    circuit(&format!(
        "Va a 0 PWL(0 -4 8 4)\nVb b 0 SIN(0 1 1)\nVp vp 0 5\nVn 0 vn 5\nB1 out 0 V={value}\nR1 out 0 1k\n.tran 0.1 8"
    ))
}

fn curve(value: &str) -> (Affine, Curve, usize) {
    let circuit = element(value);
    let id = circuit.element("b1").expect("b1");
    match &circuit.elements[id.index()].kind {
        Kind::Function {
            input,
            law: Law::Curve(curve),
            output: Output::Voltage,
        } => (input.clone(), curve.clone(), circuit.elements.len()),
        other => panic!("{value}: {other:?}"),
    }
}

fn numbers(points: &[(Value, Value)]) -> Vec<(f64, f64)> {
    points.iter().map(|(x, y)| (x.f64, y.f64)).collect()
}

#[test]
fn one_input_is_one_curve() {
    // Expression, name of the curve, corners, slope below and above.
    type Case = (&'static str, &'static str, &'static [(f64, f64)], f64, f64);
    let cases: [Case; 11] = [
        ("max(V(a), 0)", "table", &[(0.0, 0.0)], 0.0, 1.0),
        (
            "V(a) > 2 ? 5 : 0",
            "relay",
            &[(2.0, 0.0), (2.0, 5.0)],
            0.0,
            0.0,
        ),
        (
            "if(V(a) > V(b), 5, -5)",
            "relay",
            &[(0.0, -5.0), (0.0, 5.0)],
            0.0,
            0.0,
        ),
        ("sgn(V(a))", "relay", &[(0.0, -1.0), (0.0, 1.0)], 0.0, 0.0),
        ("2*u(V(a)-1)", "relay", &[(1.0, 0.0), (1.0, 2.0)], 0.0, 0.0),
        (
            "limit(1k*V(a), -2, 2)",
            "saturation",
            &[(-2e-3, -2.0), (2e-3, 2.0)],
            0.0,
            0.0,
        ),
        // Falling: the curve of the negated input.
        (
            "limit(-1k*V(a), 3, -2)",
            "saturation",
            &[(-2e-3, -2.0), (3e-3, 3.0)],
            0.0,
            0.0,
        ),
        (
            "limit(10*V(a,b), V(vn)+1, V(vp)-1)",
            "saturation",
            &[(-0.4, -4.0), (0.4, 4.0)],
            0.0,
            0.0,
        ),
        (
            "table(V(a), 0, 0, 1, 2, 3, 3)",
            "table",
            &[(0.0, 0.0), (1.0, 2.0), (3.0, 3.0)],
            0.0,
            0.0,
        ),
        (
            "pwl(V(a), 0, 0, 1, 2, 3, 3)",
            "table",
            &[(1.0, 2.0)],
            2.0,
            0.5,
        ),
        (
            "V(a) > 1 ? V(a)-1 : V(a) < -1 ? V(a)+1 : 0",
            "dead_zone",
            &[(-1.0, 0.0), (1.0, 0.0)],
            1.0,
            1.0,
        ),
    ];
    for (value, kind, vertices, first, last) in cases {
        let (input, curve, elements) = curve(value);
        assert_eq!(curve.kind, kind, "{value}");
        assert_eq!(numbers(&curve.vertices), vertices, "{value}");
        assert_eq!(
            (curve.first.1.f64, curve.last.1.f64),
            (first, last),
            "{value}"
        );
        assert_eq!((input.constant, elements), (0.0, 6), "{value}");
    }
}

#[test]
fn logic_of_one_input_is_a_staircase() {
    let (_, curve, _) = curve("(V(a)>=-2 && V(a)<1) || V(a)>0.5 || !(V(a) < 3) ? 5 : 1");
    assert_eq!(numbers(&curve.vertices), [(-2.0, 1.0), (-2.0, 5.0)]);
    // Up at −2, down at 1: two relays.
    let circuit = element("V(a)>=-2 && V(a)<1 ? 5 : 0");
    let names: Vec<&str> = circuit.elements.iter().map(|e| e.name.as_str()).collect();
    assert_eq!(names[5..], ["r1", "b1.1", "b1.2"]);
}

#[test]
fn what_is_affine_stays_affine() {
    for value in [
        "max(V(a), V(a)-1)",
        "uramp(V(a)) - uramp(-V(a))",
        "V(vp)*V(a)/5",
        "V(a)*(2 > 1)",
    ] {
        let circuit = element(value);
        let id = circuit.element("b1").expect("b1");
        let Kind::Controlled { control, .. } = &circuit.elements[id.index()].kind else {
            panic!("{value}");
        };
        let terms: Vec<f64> = control.terms.iter().map(|t| t.0.f64).collect();
        assert_eq!((terms, control.constant), (vec![1.0], 0.0), "{value}");
    }
}

#[test]
fn time_alone_is_a_waveform() {
    let wave = |value: &str| {
        let circuit = element(value);
        let id = circuit.element("b1").expect("b1");
        match &circuit.elements[id.index()].kind {
            Kind::VoltageSource(source) => source.wave.clone(),
            other => panic!("{value}: {other:?}"),
        }
    };
    let pwl = |points: &[(f64, f64)]| Wave::Pwl {
        points: points.to_vec(),
        repeat: None,
        delay: 0.0,
    };
    assert_eq!(wave("1+2*time"), pwl(&[(0.0, 1.0), (8.0, 17.0)]));
    let edge = pwl(&[(0.0, 1.0), (2.0, 1.0), (2.0, 4.0), (8.0, 4.0)]);
    assert_eq!(wave("1 + (time > 2 ? 3 : 0)"), edge);
    let Wave::Sin {
        offset,
        amplitude,
        frequency,
        phase,
        ..
    } = wave("2-3*cos(2*pi*50*time)")
    else {
        panic!("a sine");
    };
    assert_eq!(
        (offset, amplitude, frequency, phase),
        (2.0, -3.0, 50.0, 90.0)
    );
    let decay = wave("4*exp(-time/2)");
    assert_eq!(decay.value(0.0), 4.0);
    assert!((decay.value(3.0) - 4.0 * (-1.5_f64).exp()).abs() < 1e-15);
}

#[test]
fn what_is_not_piecewise_linear_is_named() {
    for (value, named) in [
        ("1 + V(a)*V(b)", "(v(a) * v(b))"),
        ("max(sqrt(V(a)), 0)", "sqrt(v(a))"),
        ("V(a)^2", "(v(a) ^ 2)"),
        ("V(b) > 0 ? V(a) : 0", "((v(b) > 0) ? v(a) : 0)"),
        ("exp(time)", "exp(time)"),
        ("time*V(a)", "(time * v(a))"),
    ] {
        let (circuit, findings) = read(&format!(
            "Va a 0 PWL(0 -4 8 4)\nVb b 0 SIN(0 1 1)\nB1 out 0 V={value}\nR1 out 0 1k\n.tran 0.1 8"
        ));
        assert!(circuit.is_none(), "{value}");
        let fault = findings
            .iter()
            .find(|d| d.code == "not-linear")
            .expect(value);
        assert!(
            fault.message.starts_with(&format!("`{named}`")),
            "{}",
            fault.message
        );
    }
    let (circuit, findings) = read("V1 a 0 1\nE1 b 0 TABLE {V(a)} = (0,1) (2,3) (1,4)\nR1 b 0 1");
    assert!(circuit.is_none() && findings.iter().any(|d| d.code == "bad-table"));
}

fn run(circuit: &Circuit) -> Waveforms {
    let behaviour = crate::mna::behaviour(circuit).unwrap_or_else(|e| panic!("{e:?}"));
    let run = simulate(circuit, &behaviour, SimOptions::default());
    let run = run.unwrap_or_else(|e| panic!("{e}"));
    run.waveforms
}

/// Largest difference of v(out) from a closed form in t, away from its jumps.
fn error(value: &str, expected: impl Fn(f64) -> Option<f64>) -> f64 {
    let waves = run(&element(value));
    let column = waves.find("v(out)").expect("v(out)");
    let rows = waves.time.iter().zip(waves.column(column));
    rows.filter_map(|(&t, v)| Some((v - expected(t)?).abs()))
        .fold(0.0, f64::max)
}

#[test]
fn simulations_agree_with_the_expressions() {
    let a = |t: f64| t - 4.0;
    let b = |t: f64| (std::f64::consts::TAU * t).sin();
    let apart = |x: f64, y: f64, v: f64| ((x - y).abs() > 1e-6).then_some(v);
    assert!(error("max(V(a), V(b))", |t| Some(a(t).max(b(t)))) < 1e-9);
    assert!(
        error("abs(V(a)) - min(V(b), 0.5)", |t| Some(
            a(t).abs() - b(t).min(0.5)
        )) < 1e-9
    );
    assert!(
        error("limit(3*V(a), V(b)-1, 2)", |t| Some(
            (3.0 * a(t)).clamp(b(t) - 1.0, 2.0)
        )) < 1e-9
    );
    assert!(
        error("limit(3*V(a), V(b), -V(b))", |t| {
            let (low, high) = (b(t).min(-b(t)), b(t).max(-b(t)));
            Some((3.0 * a(t)).clamp(low, high))
        }) < 1e-9
    );
    let comparator = |t| apart(a(t), b(t), if a(t) > b(t) { 5.0 } else { -1.0 });
    assert!(error("V(a) > V(b) ? 5 : -1", comparator) < 1e-9);
    let window = |t: f64| {
        let inside = a(t) > -2.0 && a(t) < 1.0;
        apart(a(t), -2.0, 0.0).and(apart(a(t), 1.0, f64::from(u8::from(inside)) * 5.0))
    };
    assert!(error("V(a)>=-2 && V(a)<1 ? 5 : 0", window) < 1e-9);
    assert!(
        error("max(time-2, 0)*2 + V(b)", |t| Some(
            (t - 2.0).max(0.0) * 2.0 + b(t)
        )) < 1e-9
    );
    assert!(
        error("max(abs(V(a))-V(b), abs(V(a)-1))", |t| {
            Some((a(t).abs() - b(t)).max((a(t) - 1.0).abs()))
        }) < 1e-9
    );
}

#[test]
fn an_ideal_rectifier_charges_a_capacitor() {
    // RC = 1 s behind max(0, V(s)) with v(s) = −1 V until 1 s, then 2 V: v(c) = 2 (1 − e^{−(t−1)}).
    let waves = run(&circuit(
        "Vs s 0 PULSE(-1 2 1 0 0 10 20)\nE1 r 0 VALUE={max(0, V(s))}\nR1 r c 1\nC1 c 0 1\n.tran 0.1 4",
    ));
    let column = waves.find("v(c)").expect("v(c)");
    for (&t, v) in waves.time.iter().zip(waves.column(column)) {
        let expected = if t < 1.0 {
            0.0
        } else {
            2.0 * (1.0 - (1.0 - t).exp())
        };
        assert!((v - expected).abs() < 1e-9, "{t}: {v} {expected}");
    }
}
