//! The circuits of docs/performance.md against 40 digits: `tests/reference/fourteen.csv`, made by `fourteen.py` from the cards alone.
#![allow(missing_docs, reason = "tests")]

use std::collections::BTreeMap;
use std::path::Path;

use circ::integrate::event::Change;
use circ::integrate::{Method, Run, SimOptions, simulate};
use circ::{mna, netlist};

/// Times of the states, of each circuit.
const ROWS: usize = 20;
/// Of a state, relative to its largest value.
const STATE: f64 = 2e-12;
/// Of an event, relative to the run.
const EVENT: f64 = 1e-13;
/// What happens within this time of the start belongs to it, s.
const START: f64 = 1e-20;

/// (quantity, time, value) of a circuit.
fn reference(circuit: &str) -> Vec<(&str, f64, f64)> {
    include_str!("reference/fourteen.csv")
        .lines()
        .filter_map(|line| {
            let (name, rest) = line.split_once(",\"")?;
            let (quantity, rest) = rest.split_once("\",")?;
            let (time, value) = rest.split_once(',')?;
            let number = |text: &str| text.parse().expect("a number");
            (name == circuit).then(|| (quantity, number(time), number(value)))
        })
        .collect()
}

/// A run over the reference's span with all voltages and currents in its rows.
fn run(circuit: &str, tstop: f64) -> Run {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("netlists")
        .join(circuit)
        .with_extension("cir");
    let loaded = netlist::load(&path, &Default::default());
    let mut circuit = loaded.circuit.expect("a sound netlist");
    circuit.probes.clear();
    let tran = circuit.tran.as_mut().expect("a .tran card");
    (tran.tstop, tran.tstep) = (tstop, tstop / ROWS as f64);
    let behaviour = mna::behaviour(&circuit).expect("a behaviour");
    let options = SimOptions {
        method: Method::Exact,
        ..SimOptions::default()
    };
    simulate(&circuit, &behaviour, options).expect("a run")
}

/// The column of a quantity: of `v(a,b)` the difference of two.
fn column(run: &Run, quantity: &str) -> Vec<f64> {
    let of = |name: &str| -> Option<Vec<f64>> {
        let at = run.waveforms.find(name)?;
        Some(run.waveforms.column(at).collect())
    };
    of(quantity).unwrap_or_else(|| {
        let (a, b) = quantity[2..quantity.len() - 1]
            .split_once(',')
            .expect("two nodes");
        let node = |name: &str| match name {
            "0" => vec![0.0; ROWS + 1],
            _ => of(&format!("v({name})")).expect("a node"),
        };
        node(a).iter().zip(node(b)).map(|(a, b)| a - b).collect()
    })
}

/// When each device and switch changes after the start, and to what.
fn changes(run: &Run) -> BTreeMap<String, Vec<(f64, f64)>> {
    let mut all: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
    for event in run.events.iter().filter(|event| event.t > 0.0) {
        for change in event.changes.iter() {
            let on = match change {
                Change::Switch { on, .. } => *on,
                Change::Device { conducts, .. } => *conducts,
                Change::Slides(_) => continue,
            };
            let of = all.entry(change.name().to_owned()).or_default();
            of.push((event.t, f64::from(u8::from(on))));
        }
    }
    all
}

fn meets(circuit: &str, states: usize, events: usize) {
    let rows = reference(circuit);
    let is_state = |quantity: &str| quantity.ends_with(')');
    let tstop = rows
        .iter()
        .filter(|r| is_state(r.0))
        .map(|r| r.1)
        .fold(0.0, f64::max);
    let run = run(circuit, tstop);
    let mut expected: BTreeMap<&str, Vec<(f64, f64)>> = BTreeMap::new();
    for &(quantity, t, value) in &rows {
        expected.entry(quantity).or_default().push((t, value));
    }
    let changes = changes(&run);
    let mut counted = (0, 0);
    for (quantity, values) in expected {
        if !is_state(quantity) {
            let expected: Vec<_> = values.into_iter().filter(|(t, _)| *t > START).collect();
            let none = Vec::new();
            let found = changes.get(quantity).unwrap_or(&none);
            assert_eq!(
                found.len(),
                expected.len(),
                "{circuit} {quantity}: {found:?}\n{expected:?}"
            );
            for (&(t, on), &(exact, is_on)) in found.iter().zip(&expected) {
                let off = (t - exact).abs() / tstop;
                assert!(
                    on == is_on && off <= EVENT,
                    "{circuit} {quantity} at {t}: {off:e}"
                );
            }
            counted.1 += expected.len();
            continue;
        }
        let found = column(&run, quantity);
        let size = values.iter().map(|v| v.1.abs()).fold(0.0, f64::max);
        for (k, (t, value)) in values.into_iter().enumerate() {
            let off = (found[k + 1] - value).abs() / size;
            assert!(
                off <= STATE,
                "{circuit} {quantity} at {t}: {} for {value}: {off:e}",
                found[k + 1]
            );
            counted.0 += 1;
        }
    }
    assert_eq!(counted, (states * ROWS, events), "{circuit}");
}

#[test]
fn circuits_without_clocks_meet_forty_digits() {
    meets("rlcd", 2, 16);
    meets("bridge-resistor", 2, 64);
    meets("bridge-capacitor-filter", 3, 62);
    meets("clamp", 1, 10);
    meets("rectifier", 1, 22);
    meets("voltage-doubler", 2, 13);
    meets("isolated-rectifier", 3, 54);
    meets("three-phase-rectifier", 4, 69);
    meets("cockcroft-walton", 8, 296);
    meets("peak-detector", 1, 17);
}

#[test]
fn converters_meet_forty_digits() {
    meets("buck", 2, 199);
    meets("boost", 2, 242);
    meets("flyback", 4, 160);
    meets("buck-open-loop", 2, 79);
}
