//! Relays.

use super::{at, circuit, simulate_circuit};
use crate::algebra::Value;
use crate::circuit::{Affine, Circuit, Kind, Output, Quantity};
use crate::integrate::{Method, SimOptions};
use crate::law::{Curve, Law};
use crate::mna;

/// A voltage source that becomes a relay: its name, its input Σ gain·v(node), its two values.
type Relay<'a> = (&'a str, &'a [(f64, &'a str)], f64, f64);

/// A netlist with relays in the place of voltage sources.
fn with_relays(text: &str, relays: &[Relay<'_>]) -> Circuit {
    let mut circuit = circuit(text);
    for (name, input, low, high) in relays {
        let terms = input
            .iter()
            .map(|(gain, node)| {
                (
                    Value::binary(*gain),
                    Quantity::Voltage(circuit.node(node).expect("a node")),
                )
            })
            .collect();
        let (low, high) = (Value::binary(*low), Value::binary(*high));
        let law = Law::Curve(Curve::relay(Value::binary(0.0), low, high));
        let element = circuit.element(name).expect("an element");
        circuit.elements[element.index()].kind = Kind::Function {
            output: Output::Voltage,
            input: Affine {
                terms,
                constant: 0.0,
            },
            law,
        };
    }
    circuit
}

/// x1' = −s1 + 2 s2, x2' = −2 s1 − s2 with s_i in sgn(x_i).
#[test]
fn two_relays_pass_their_accumulation_point() {
    let circuit = with_relays(
        "C1 1 0 1 IC=1\nC2 2 0 1 IC=0.3\nE1 a 0 x 0 0\nE2 b 0 x 0 0\nVx x 0 0\nVs1 s1 0 0\nVs2 s2 0 0\n\
         G1 1 0 s1 0 1\nG2 0 1 s2 0 2\nG3 2 0 s1 0 2\nG4 2 0 s2 0 1\n.tran 10m 3 uic\n.save v(1) v(2)",
        &[
            ("vs1", &[(1.0, "1")], -1.0, 1.0),
            ("vs2", &[(1.0, "2")], -1.0, 1.0),
        ],
    );
    let run = simulate_circuit(&circuit).unwrap_or_else(|e| panic!("{e}"));
    // From (1, 0.3): x2 = 0 after 0.1 s, x1 = 0 after another 1.1/3 s, then every interval is a third of the last:
    // the sum is 0.1 + 1.1/3 · 3/2.
    let last = run.events.last().expect("events").t;
    assert!((last - 0.65).abs() < 1e-13, "{last}");
    assert!(
        run.notes.iter().any(|n| n.text.contains("accumulate")),
        "{:?}",
        run.notes
    );
    assert_eq!(at(&run, 3.0, "v(1)"), 0.0);
    assert_eq!(at(&run, 3.0, "v(2)"), 0.0);
}

/// Three parallel inverters (CIRCUITS 3.10), x = (v0, v0', i2, i3) on capacitors of 1 F, relays λ = −sgn(C x − v_ref).
#[test]
fn parallel_inverters_slide() {
    let (cp, leq, rl, m) = (60e-6, 0.385e-3, 5.0, 3.0);
    let (l, r, e) = ([1.5e-3, 1.22e-3, 0.9e-3], [94e-3, 116e-3, 100e-3], 70.0);
    let (k1, k2) = (1.0, 6e-5);
    let a = [
        [0.0, 1.0, 0.0, 0.0],
        [
            -1.0 / (cp * leq) - r[0] / (cp * l[0] * rl),
            -r[0] / l[0] - 1.0 / (cp * rl),
            r[0] / (cp * l[0]) - r[1] / (cp * l[1]),
            r[0] / (cp * l[0]) - r[2] / (cp * l[2]),
        ],
        [-1.0 / l[1], 0.0, -r[1] / l[1], 0.0],
        [-1.0 / l[2], 0.0, 0.0, -r[2] / l[2]],
    ];
    let b = [
        [0.0, 0.0, 0.0],
        [e / (cp * l[0]), e / (cp * l[1]), e / (cp * l[2])],
        [0.0, e / l[1], 0.0],
        [0.0, 0.0, e / l[2]],
    ];
    let kappa = cp * k1 / k2;
    let c = [
        [kappa + (m - 1.0) / rl, m * cp, -m, -m],
        [kappa - 1.0 / rl, 0.0, m, 0.0],
        [kappa - 1.0 / rl, 0.0, 0.0, m],
    ];
    let mut text = String::from("Vref ref 0 SIN(0 55 50)\n");
    for (k, ic) in [50.0, 7.0, 4.0, 4.0].iter().enumerate() {
        text += &format!("Cx{k} x{k} 0 1 IC={ic}\n");
        for (j, a) in a[k].iter().enumerate().filter(|(_, a)| **a != 0.0) {
            text += &format!("Ga{k}{j} 0 x{k} x{j} 0 {a:e}\n");
        }
        for (j, b) in b[k].iter().enumerate().filter(|(_, b)| **b != 0.0) {
            text += &format!("Gb{k}{j} 0 x{k} s{j} 0 {b:e}\n");
        }
    }
    for j in 0..3 {
        text += &format!("Vs{j} s{j} 0 0\n");
    }
    text += ".tran 10u 5m uic\n.save v(x0) v(x1) v(x2) v(x3)";
    let nodes = ["x0", "x1", "x2", "x3"];
    let inputs: Vec<Vec<(f64, &str)>> = c
        .iter()
        .map(|row| {
            row.iter()
                .zip(nodes)
                .map(|(c, n)| (-c, n))
                .chain([(1.0, "ref")])
                .collect()
        })
        .collect();
    let circuit = with_relays(
        &text,
        &[
            ("vs0", &inputs[0], -1.0, 1.0),
            ("vs1", &inputs[1], -1.0, 1.0),
            ("vs2", &inputs[2], -1.0, 1.0),
        ],
    );
    let exact = simulate_circuit(&circuit).unwrap_or_else(|e| panic!("{e}"));
    // From some time on all three slide: C x = v_ref, with few events.
    let end = 5e-3;
    let x: Vec<f64> = nodes
        .iter()
        .map(|n| at(&exact, end, &format!("v({n})")))
        .collect();
    let reference = 55.0 * (100.0 * std::f64::consts::PI * end).sin();
    for row in c {
        let y: f64 = row.iter().zip(&x).map(|(c, x)| c * x).sum();
        assert!((y - reference).abs() < 1e-9, "{y} {reference}");
    }
    let behaviour = mna::behaviour(&circuit).expect("a sound circuit");
    let error = |step: f64| {
        let options = SimOptions {
            method: Method::Euler,
            step: Some(step),
            ..SimOptions::default()
        };
        let run = crate::integrate::simulate(&circuit, &behaviour, options)
            .unwrap_or_else(|e| panic!("{e}"));
        [0, 2, 3].map(|j| {
            (0..exact.waveforms.time.len())
                .map(|k| {
                    (exact.waveforms.values[4 * k + j] - run.waveforms.values[4 * k + j]).abs()
                })
                .fold(0.0, f64::max)
        })
    };
    let (coarse, fine) = (error(5e-7), error(2.5e-7));
    for (coarse, fine) in coarse.iter().zip(fine) {
        assert!(
            fine < 0.5 && (1.6..2.6).contains(&(coarse / fine)),
            "{coarse} {fine} {:?}",
            exact.stats
        );
    }
}
