//! Hand-derived systems of small circuits.

use circ::algebra::Value;
use circ::circuit::{Circuit, Element, Kind, NodeId};
use circ::law::Law;
use circ::lcs::{Hold, Position, StorageHold, reduce};
use circ::mna::behaviour;

fn circuit(nodes: u32, elements: &[(&str, u32, u32, Kind)]) -> Circuit {
    Circuit {
        title: "test".into(),
        nodes: (0..nodes).map(|n| n.to_string()).collect(),
        elements: elements
            .iter()
            .map(|(name, p, n, kind)| Element {
                name: (*name).into(),
                p: NodeId(*p),
                n: NodeId(*n),
                kind: kind.clone(),
                ic: None,
                span: None,
            })
            .collect(),
        ..Circuit::default()
    }
}

#[test]
fn half_wave_rlcd() {
    let c = circuit(
        3,
        &[
            ("c1", 1, 0, Kind::Capacitor(Value::decimal(1e-6, 1, -6))),
            ("l1", 1, 0, Kind::Inductor(Value::decimal(1e-2, 1, -2))),
            ("r1", 1, 2, Kind::Resistor(Value::decimal(1e3, 1, 3))),
            ("d1", 2, 0, Kind::Device(Law::ideal_diode())),
        ],
    );
    let b = behaviour(&c).unwrap();
    let lcs = reduce(&b.standard(), &Position::free(&b, vec![])).unwrap();
        "{:?} {:?}\nA{}B{}C{}D{}P{}",
        lcs.states, lcs.ports, lcs.a, lcs.b, lcs.c, lcs.d, lcs.energy
    );
    for hold in [Hold::Closed, Hold::Open] {
        let mode = reduce(
            &b,
            &Position {
                devices: vec![hold],
                switches: vec![],
                storage: StorageHold::Dynamic,
            },
        )
        .unwrap();
    }
    let op = reduce(
        &b,
        &Position {
            devices: vec![Hold::Free],
            switches: vec![],
            storage: StorageHold::Static,
        },
    );
}

#[test]
fn bridge_with_capacitor() {
    let d = || Kind::Device(Law::ideal_diode());
    let c = circuit(
        4,
        &[
            ("c1", 1, 0, Kind::Capacitor(Value::decimal(1e-6, 1, -6))),
            ("l1", 1, 0, Kind::Inductor(Value::decimal(1e-2, 1, -2))),
            ("df1", 1, 2, d()),
            ("dr1", 0, 2, d()),
            ("dr2", 3, 1, d()),
            ("df2", 3, 0, d()),
            ("r1", 2, 3, Kind::Resistor(Value::decimal(1e3, 1, 3))),
            ("cf", 2, 3, Kind::Capacitor(Value::decimal(3e-7, 3, -7))),
        ],
    );
    let b = behaviour(&c).unwrap();
    let start = std::time::Instant::now();
    let lcs = reduce(&b, &Position::free(&b, vec![])).unwrap();
        "{:?} {:?}\nA{}B{}C{}D{}P{}",
        lcs.states, lcs.ports, lcs.a, lcs.b, lcs.c, lcs.d, lcs.energy
    );
    use Hold::{Closed, Open};
    for hold in [[Closed, Open, Open, Closed], [Open; 4], [Closed; 4]] {
        let start = std::time::Instant::now();
        let mode = reduce(
            &b,
            &Position {
                devices: hold.to_vec(),
                switches: vec![],
                storage: StorageHold::Dynamic,
            },
        )
        .unwrap();
            "{hold:?} {:?} A{} guard{} kernel{} J{}",
            mode.states, mode.a, mode.held.guard.x, mode.held.kernel, mode.storage.inject
        );
    }
}

#[test]
fn a_system_file_reads_back_and_reduces_to_itself() {
    let c = circuit(
        3,
        &[
            ("c1", 1, 0, Kind::Capacitor(Value::decimal(1e-6, 1, -6))),
            ("l1", 1, 0, Kind::Inductor(Value::decimal(1e-2, 1, -2))),
            ("r1", 1, 2, Kind::Resistor(Value::decimal(1e3, 1, 3))),
            ("d1", 2, 0, Kind::Device(Law::ideal_diode())),
        ],
    );
    let b = behaviour(&c).unwrap();
    let lcs = reduce(&b, &Position::free(&b, vec![])).unwrap();
    let text = circ::lcs::json::write(&lcs, &lcs.storage.initial, None);
    let file = circ::lcs::json::read(&text).unwrap();
    assert_eq!((&file.lcs.a, &file.lcs.b, &file.lcs.c, &file.lcs.d), (&lcs.a, &lcs.b, &lcs.c, &lcs.d));
    let again = circ::mna::Behaviour::from_lcs(&file.lcs);
    let same = reduce(&again, &Position::free(&again, vec![])).unwrap();
    assert_eq!((&same.a, &same.b, &same.c, &same.d), (&lcs.a, &lcs.b, &lcs.c, &lcs.d));
    assert_eq!(same.outputs.rows.x, lcs.outputs.rows.x);
}
