//! Relays.

use super::{at, circuit, simulate_circuit};
use crate::algebra::Value;
use crate::circuit::{Affine, Circuit, Kind, Output, Quantity};
use crate::law::{Curve, Law};

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
        let zero = Value::binary(0.0);
        let along = (Value::binary(1.0), zero);
        let law = Law::Curve(Curve {
            kind: "relay",
            vertices: vec![(zero, Value::binary(*low)), (zero, Value::binary(*high))],
            first: along,
            last: along,
        });
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
    let last = run.events.last().expect("events").0;
    assert!((last - 0.65).abs() < 1e-13, "{last}");
    assert!(
        run.notes.iter().any(|n| n.contains("accumulate")),
        "{:?}",
        run.notes
    );
    assert_eq!(at(&run, 3.0, "v(1)"), 0.0);
    assert_eq!(at(&run, 3.0, "v(2)"), 0.0);
}
