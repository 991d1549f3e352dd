//! Eight circuits over eighteen decades of stiffness, by every method, against `tests/stability/stiffness.csv`: all states at twenty times in 20 digits,
//! which `tests/reference/stiff.py` makes from the cards alone. The table of docs/stability.md shows the same runs, by `tests/stability/table.py`.
#![allow(missing_docs, reason = "tests")]

use std::collections::BTreeMap;
use std::path::Path;

use circ::circuit::ElaborateOptions;
use circ::integrate::{Method, Run, SimOptions, simulate};
use circ::mna::behaviour;
use circ::netlist::load;
use circ::settings::Settings;

/// Of a state, relative to the largest magnitude that it has at the twenty times. Exact runs are measured at 2e-12, chosen steps at 1e-4 (`euler`)
/// and 3e-5 (`theta`): the last two may miss by ten times their tolerance of 1e-4.
const ERROR: [(&str, Method, f64); 3] = [
    ("exact", Method::Exact, 1e-11),
    ("euler", Method::Euler, 1e-3),
    ("theta", Method::Theta, 1e-3),
];
/// Of one run.
const STEPS: u64 = 2_000_000;
/// Netlist, ratio and method of rows that take more: after an event their steps stay far below the time constant and do not grow. docs/stability.md has what
/// they come to.
const MORE: [(&str, &str, &str); 3] = [
    ("buck-l", "1e12", "euler"),
    ("rectifier-c", "1e18", "theta"),
    ("rectifier-l", "1e18", "theta"),
];

/// One value of the element, and the states: (time, value) of each.
struct Row {
    netlist: &'static str,
    ratio: &'static str,
    x: f64,
    states: BTreeMap<&'static str, Vec<(f64, f64)>>,
}

fn rows() -> Vec<Row> {
    let number = |word: &str| -> f64 { word.parse().expect("a number") };
    let mut rows: Vec<Row> = Vec::new();
    for line in include_str!("stability/stiffness.csv").lines().skip(1) {
        let words: Vec<&str> = line.split(',').collect();
        let [netlist, ratio, x, _, quantity, time, value] = words[..] else {
            panic!("{line}")
        };
        if rows
            .last()
            .is_none_or(|row| (row.netlist, row.ratio) != (netlist, ratio))
        {
            rows.push(Row {
                netlist,
                ratio,
                x: number(x),
                states: BTreeMap::new(),
            });
        }
        let states = &mut rows.last_mut().expect("a row").states;
        let values = states.entry(quantity).or_default();
        values.push((number(time), number(value)));
    }
    rows
}

fn run(row: &Row, method: Method) -> Result<Run, String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/stability/stiff")
        .join(row.netlist)
        .with_extension("cir");
    let elaborate = ElaborateOptions {
        params: vec![("x".to_owned(), row.x)],
        ..ElaborateOptions::default()
    };
    let loaded = load(&path, &elaborate);
    let mut circuit = loaded
        .circuit
        .ok_or_else(|| format!("{:?}", loaded.diagnostics))?;
    circuit.probes.clear();
    let behaviour = behaviour(&circuit).map_err(|e| format!("{e:?}"))?;
    let options = SimOptions {
        method,
        unestimated: true,
        settings: Settings {
            max_steps: STEPS,
            ..Settings::default()
        },
        ..SimOptions::default()
    };
    simulate(&circuit, &behaviour, options).map_err(|e| e.to_string())
}

/// The largest error of a state, and where it is.
fn error(row: &Row, run: &Run) -> (f64, String) {
    let mut worst = (0.0, String::new());
    for (quantity, values) in &row.states {
        let column = run.waveforms.find(quantity).expect("a state");
        let found: Vec<f64> = run.waveforms.column(column).collect();
        assert_eq!(found.len(), values.len() + 1);
        let size = values.iter().map(|v| v.1.abs()).fold(0.0, f64::max);
        for (k, (t, right)) in values.iter().enumerate() {
            assert!((run.waveforms.time[k + 1] - t).abs() <= 1e-9 * t);
            let off = (found[k + 1] - right).abs() / size;
            // A value that is no number is worse than all others.
            if off.is_nan() || off > worst.0 {
                let off = if off.is_nan() { f64::INFINITY } else { off };
                worst = (
                    off,
                    format!("{quantity} at {t}: {} for {right}", found[k + 1]),
                );
            }
        }
    }
    worst
}

/// Every row of a circuit by every method.
fn holds(netlist: &str) {
    let mut held = 0;
    for row in rows().iter().filter(|row| row.netlist == netlist) {
        for (word, method, allowed) in ERROR {
            let case = format!("{netlist}, ratio {}, {word}", row.ratio);
            let run = run(row, method);
            if MORE.contains(&(netlist, row.ratio, word)) {
                let reason = run.err().unwrap_or_else(|| panic!("{case}: runs"));
                assert!(reason.contains("more than"), "{case}: {reason}");
            } else {
                let run = run.unwrap_or_else(|e| panic!("{case}: {e}"));
                let (off, what) = error(row, &run);
                assert!(off <= allowed, "{case}: {what}, off by {off:.1e}");
            }
            held += 1;
        }
    }
    assert_eq!(held, 7 * ERROR.len(), "{netlist}");
}

#[test]
fn a_rectifier_over_its_roff() {
    holds("rectifier-roff");
}

#[test]
fn a_rectifier_over_its_ron() {
    holds("rectifier-ron");
}

#[test]
fn a_rectifier_over_an_inductor() {
    holds("rectifier-l");
}

#[test]
fn a_rectifier_over_a_capacitor() {
    holds("rectifier-c");
}

#[test]
fn a_buck_converter_over_its_roff() {
    holds("buck-roff");
}

#[test]
fn a_buck_converter_over_its_ron() {
    holds("buck-ron");
}

#[test]
fn a_buck_converter_over_an_inductor() {
    holds("buck-l");
}

#[test]
fn a_buck_converter_over_a_capacitor() {
    holds("buck-c");
}

#[test]
fn every_circuit_and_ratio_stands_in_the_reference() {
    let ratios = ["1", "1e3", "1e6", "1e9", "1e12", "1e15", "1e18"];
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/stability/stiff");
    let mut expected: Vec<(String, &str)> = Vec::new();
    for entry in std::fs::read_dir(folder).expect("the folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().expect("a name").to_string_lossy();
        expected.extend(ratios.map(|ratio| (name.clone().into_owned(), ratio)));
    }
    let mut found: Vec<(String, &str)> = rows()
        .iter()
        .map(|row| (row.netlist.to_owned(), row.ratio))
        .collect();
    expected.sort_unstable();
    found.sort_unstable();
    assert_eq!(found, expected);
    assert_eq!(found.len(), 8 * ratios.len());
}
