//! Hand-derived systems of small circuits.

use circ::algebra::Value;
use circ::circuit::{Circuit, Element, Kind, NodeId};
use circ::law::Law;
use circ::lcs::{Hold, Position, StorageHold, reduce};
use circ::mna::behaviour;
use nalgebra::{DMatrix, DVector};

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
    // λ = −v(d1), y = i(d1) = (v + λ)/R.
    assert_eq!(lcs.ports[0].lambda, "-v(d1)");
    assert_eq!(
        lcs.a,
        DMatrix::from_row_slice(2, 2, &[-1e3, -1e6, 100.0, 0.0])
    );
    assert_eq!(lcs.b, DMatrix::from_row_slice(2, 1, &[-1e3, 0.0]));
    assert_eq!(lcs.c, DMatrix::from_row_slice(1, 2, &[1e-3, 0.0]));
    assert_eq!(lcs.d, DMatrix::from_row_slice(1, 1, &[1e-3]));
    assert_eq!(
        lcs.energy,
        DMatrix::from_row_slice(2, 2, &[1e-6, 0.0, 0.0, 1e-2])
    );
    let held = |hold| {
        let storage = StorageHold::Dynamic;
        reduce(
            &b,
            &Position {
                devices: vec![hold],
                switches: vec![],
                storage,
            },
        )
        .unwrap()
    };
    let (closed, open) = (held(Hold::Closed), held(Hold::Open));
    assert_eq!(closed.a, lcs.a);
    assert_eq!(
        closed.held.guard.x,
        DMatrix::from_row_slice(1, 2, &[1e-3, 0.0])
    );
    assert_eq!(
        open.a,
        DMatrix::from_row_slice(2, 2, &[0.0, -1e6, 100.0, 0.0])
    );
    assert_eq!(
        open.held.guard.x,
        DMatrix::from_row_slice(1, 2, &[-1.0, 0.0])
    );
}

#[test]
fn a_closing_bridge_ties_its_capacitors_and_conserves_charge() {
    use Hold::{Closed, Open};
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
    let held = |devices: [Hold; 4]| {
        let storage = StorageHold::Dynamic;
        reduce(
            &b,
            &Position {
                devices: devices.to_vec(),
                switches: vec![],
                storage,
            },
        )
        .unwrap()
    };
    // v(df1) = v(df2) = 0: one voltage, 10 V on 1 µF shared with 0.3 µF.
    let tied = held([Closed, Open, Open, Closed]);
    let x = &tied.storage.inject * DVector::from_column_slice(&[10.0, 0.0, 0.0]);
    let s = &tied.storage.x * &x;
    let order: Vec<f64> = ["v(c1)", "v(cf)"]
        .iter()
        .map(|n| s[tied.storage.names.iter().position(|m| m == n).unwrap()])
        .collect();
    assert!(
        (order[0] - 10.0 / 1.3).abs() < 1e-14 && (order[1] - order[0]).abs() < 1e-14,
        "{s}"
    );
    // All blocking: the voltages inside the bridge share by symmetry, one direction stays open.
    let open = held([Open; 4]);
    assert_eq!(open.held.kernel.ncols(), 1);
    // All conducting: both capacitors short, the circulating current is open.
    let closed = held([Closed; 4]);
    assert_eq!((closed.n(), closed.held.kernel.ncols()), (1, 1));
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
    assert_eq!(
        (&file.lcs.a, &file.lcs.b, &file.lcs.c, &file.lcs.d),
        (&lcs.a, &lcs.b, &lcs.c, &lcs.d)
    );
    let again = circ::mna::StaticMultiport::from_lcs(&file.lcs);
    let same = reduce(&again, &Position::free(&again, vec![])).unwrap();
    assert_eq!(
        (&same.a, &same.b, &same.c, &same.d),
        (&lcs.a, &lcs.b, &lcs.c, &lcs.d)
    );
    assert_eq!(same.outputs.rows.x, lcs.outputs.rows.x);
}
