//! Circuits for tests, from a line an element: `c1 1 0 1u`, `d1 a k`, `e1 p n a b gain`, `f1 p n v1 gain`,
//! `k1 l1 l2 0.5`, `s1 p n ron roff`, `rel1 out 0 a b` (a relay), nodes by any name.

use crate::algebra::Value;
use crate::circuit::source::Wave;
use crate::circuit::{
    Affine, Circuit, Coupling, Element, ElementId, Kind, NodeId, Output, Quantity, Source, Switch,
};
use crate::law::{Curve, Exponential, Law};

/// A decimal with an engineering suffix, exactly.
pub(crate) fn value(text: &str) -> Value {
    let suffixes = [
        ("meg", 6),
        ("f", -15),
        ("p", -12),
        ("n", -9),
        ("u", -6),
        ("m", -3),
        ("k", 3),
        ("g", 9),
    ];
    let (digits, suffix) = suffixes
        .iter()
        .find_map(|(s, e)| text.strip_suffix(s).map(|d| (d, *e)))
        .unwrap_or((text, 0));
    let (digits, power) = digits.split_once('e').unwrap_or((digits, "0"));
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let mantissa: i128 = format!("{whole}{fraction}").parse().unwrap();
    let exponent = power.parse::<i32>().unwrap() + suffix - fraction.len() as i32;
    Value::decimal(
        format!("{mantissa}e{exponent}").parse().unwrap(),
        mantissa,
        exponent,
    )
}

fn node(circuit: &mut Circuit, name: &str) -> NodeId {
    circuit.node(name).unwrap_or_else(|| {
        circuit.nodes.push(name.to_string());
        NodeId(circuit.nodes.len() as u32 - 1)
    })
}

/// The circuit that some lines describe.
pub(crate) fn circuit(text: &str) -> Circuit {
    let mut circuit = Circuit {
        nodes: vec!["0".into()],
        ..Circuit::default()
    };
    for line in text.lines().map(str::trim).filter(|l| !l.is_empty()) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let name = words[0];
        if name.starts_with('k') {
            let find = |n: &str| circuit.element(n).unwrap();
            let (a, b, k) = (find(words[1]), find(words[2]), value(words[3]));
            circuit.couplings.push(Coupling {
                name: name.into(),
                a,
                b,
                k,
                span: None,
            });
            continue;
        }
        let p = node(&mut circuit, words[1]);
        let n = node(&mut circuit, words[2]);
        let number = |k: usize| value(words[k]);
        let source = || {
            let dc = words.get(3).map_or(0.0, |w| value(w).f64);
            Source {
                dc,
                wave: Wave::Dc(dc),
            }
        };
        let difference = |circuit: &mut Circuit, k: usize, gain: &str| {
            let (a, b) = (node(circuit, words[k]), node(circuit, words[k + 1]));
            Affine {
                terms: vec![
                    (value(gain), Quantity::Voltage(a)),
                    (value(gain).negated(), Quantity::Voltage(b)),
                ],
                constant: 0.0,
            }
        };
        let current = |circuit: &Circuit, k: usize, gain: &str| Affine {
            terms: vec![(
                value(gain),
                Quantity::Current(circuit.element(words[k]).unwrap()),
            )],
            constant: 0.0,
        };
        let (voltage, amperes) = (Output::Voltage, Output::Current);
        let kind = match &name[..1] {
            "r" if name.starts_with("rel") => Kind::Function {
                output: voltage,
                input: difference(&mut circuit, 3, "1"),
                law: Law::Curve(Curve {
                    kind: "relay",
                    vertices: vec![(value("0"), value("-1")), (value("0"), value("1"))],
                    first: (value("1"), value("0")),
                    last: (value("1"), value("0")),
                }),
            },
            "r" => Kind::Resistor(number(3)),
            "c" => Kind::Capacitor(number(3)),
            "l" => Kind::Inductor(number(3)),
            "v" => Kind::VoltageSource(source()),
            "i" => Kind::CurrentSource(source()),
            "d" if words.len() > 3 => Kind::Device(Law::Diode {
                vfwd: number(3),
                ron: number(4),
                roff: words.get(5).map(|w| value(w)),
            }),
            "d" => Kind::Device(Law::ideal_diode()),
            "j" => Kind::Device(Law::Exponential(Exponential {
                is: number(3).f64,
                slope: 0.025,
                rs: 0.0,
                leak: 0.0,
                breakdown: None,
            })),
            "z" => Kind::Device(Law::Curve(Curve {
                kind: "zener",
                vertices: vec![(number(3), value("0")), (number(4), value("0"))],
                first: (value("0"), value("1")),
                last: (value("0"), value("1")),
            })),
            "e" => Kind::Controlled {
                output: voltage,
                control: difference(&mut circuit, 3, words[5]),
            },
            "g" => Kind::Controlled {
                output: amperes,
                control: difference(&mut circuit, 3, words[5]),
            },
            "h" => Kind::Controlled {
                output: voltage,
                control: current(&circuit, 3, words[4]),
            },
            "f" => Kind::Controlled {
                output: amperes,
                control: current(&circuit, 3, words[4]),
            },
            "s" => Kind::Switch(Switch {
                control: Affine {
                    terms: vec![(value("1"), Quantity::Voltage(p))],
                    constant: 0.0,
                },
                ron: number(3),
                roff: words.get(4).map(|w| value(w)),
                on_above: 0.0,
                off_below: 0.0,
                initial: None,
                latch: None,
            }),
            other => panic!("no such element: {other}"),
        };
        circuit.elements.push(Element {
            name: name.into(),
            p,
            n,
            kind,
            ic: None,
            span: None,
        });
    }
    circuit
}

/// Replaces the waveform of a source.
pub(crate) fn drive(circuit: &mut Circuit, name: &str, wave: Wave) {
    let ElementId(k) = circuit.element(name).unwrap();
    match &mut circuit.elements[k as usize].kind {
        Kind::VoltageSource(source) | Kind::CurrentSource(source) => source.wave = wave,
        _ => panic!("{name} is not a source"),
    }
}
