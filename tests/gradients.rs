//! Derivatives of twelve circuits of docs/performance.md against differences in 270 digits: `tests/reference/gradients.csv`, made by `gradients.py` from the
//! cards alone. `cockcroft-walton` has none, as with equal capacitors diodes rest at their thresholds;
//! `peak-detector`, whose diode begins to conduct as its capacitor has just been emptied, is refused.
#![allow(missing_docs, reason = "tests")]

use std::collections::BTreeMap;
use std::path::Path;

use circ::Model;
use circ::analysis::{Sensitivity, SensitivityMethod, SensitivityOptions, sensitivity};

/// Print steps of a run, as in `tests/reference/fourteen.py`.
const ROWS: f64 = 20.0;

const CLOSE: f64 = 1e-10;

/// More than what diodes of 1e50 ohms let through, V or A.
const NOTHING: f64 = 1e-30;

/// By quantity and time as they are written: the derivatives to the elements.
type Reference<'a> = BTreeMap<(&'a str, &'a str), Vec<(&'a str, f64)>>;

fn reference(circuit: &str) -> Reference<'static> {
    let mut all = Reference::new();
    for line in include_str!("reference/gradients.csv").lines().skip(1) {
        let (head, rest) = line.split_once(",\"").expect("a quantity");
        let (name, element) = head.split_once(',').expect("an element");
        let (quantity, rest) = rest.split_once("\",").expect("a quantity");
        let (time, derivative) = rest.split_once(',').expect("a derivative");
        if name == circuit {
            let of = all.entry((quantity, time)).or_default();
            of.push((element, derivative.parse().expect("a number")));
        }
    }
    all
}

/// The netlist over the reference's span, with a measurement for each quantity and time in their order.
fn measured(circuit: &str, reference: &Reference<'_>) -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("netlists")
        .join(circuit)
        .with_extension("cir");
    let text = std::fs::read_to_string(&path).expect("a netlist");
    let number = |time: &str| time.parse::<f64>().expect("a time");
    let times = reference.keys().map(|(_, time)| number(time));
    let stop = times.fold(0.0, f64::max);
    let card = |line: &str| match line.strip_prefix(".tran ") {
        Some(rest) => {
            let uic = if rest.ends_with("uic") { " uic" } else { "" };
            format!(".tran {:e} {stop:e}{uic}\n", stop / ROWS)
        }
        None if line == ".end" => String::new(),
        None => format!("{line}\n"),
    };
    let mut text: String = text.lines().map(card).collect();
    for (k, (quantity, time)) in reference.keys().enumerate() {
        text += &format!(".meas tran m{k} find {quantity} at={time}\n");
    }
    Model::parse(&(text + ".end\n"), circuit).expect("a sound netlist")
}

fn derivatives(model: &Model, to: &[String], method: SensitivityMethod) -> Sensitivity {
    let options = SensitivityOptions {
        to: to.to_vec(),
        method,
        ..SensitivityOptions::default()
    };
    let found = sensitivity(model, &options).expect("derivatives");
    assert!(found.exact, "{:?}", found.notes);
    found
}

/// Derivatives p ∂J/∂p of so many states, times and elements, relative to the largest of them for the same J, or to a thousandth of what the state reaches where all are smaller.
fn meets(circuit: &str, count: usize, method: SensitivityMethod) {
    let reference = reference(circuit);
    let model = measured(circuit, &reference);
    let first = reference.values().next().expect("derivatives");
    let to: Vec<String> = first.iter().map(|(name, _)| (*name).to_owned()).collect();
    let found = derivatives(&model, &to, method);
    let mut met = 0;
    for (gradient, (of, all)) in found.of.iter().zip(&reference) {
        let scaled = |(name, truth): &(&str, f64)| {
            let at = found.at.iter().find(|(own, _)| own == name);
            let value = at.expect("a value").1;
            let own = found.derivative(&gradient.name, name);
            (value * own.expect("a derivative"), value * truth)
        };
        let pairs: Vec<(f64, f64)> = all.iter().map(scaled).collect();
        let own = found.of.iter().zip(reference.keys());
        let own = own.filter(|(_, (quantity, _))| *quantity == of.0);
        let size = own.fold(0.0_f64, |m, (gradient, _)| {
            m.max(gradient.value.as_ref().expect("a value").abs())
        });
        let largest = pairs
            .iter()
            .fold(NOTHING.max(1e-3 * size), |m, pair| m.max(pair.1.abs()));
        for ((own, truth), (name, _)) in pairs.iter().zip(all) {
            let error = (own - truth).abs() / largest;
            assert!(
                error < CLOSE,
                "{circuit} {of:?} to {name}: {own:e} for {truth:e}, {error:e}"
            );
            met += 1;
        }
    }
    assert_eq!(met, count, "{circuit}");
}

const COUNTS: [(&str, usize); 12] = [
    ("bridge-capacitor-filter", 48),
    ("bridge-resistor", 24),
    ("clamp", 8),
    ("isolated-rectifier", 72),
    ("rectifier", 8),
    ("rlcd", 24),
    ("three-phase-rectifier", 96),
    ("voltage-doubler", 32),
    ("boost", 32),
    ("buck", 32),
    ("buck-open-loop", 32),
    ("flyback", 112),
];

#[test]
fn derivatives_meet_differences_in_270_digits() {
    for (circuit, count) in COUNTS {
        meets(circuit, count, SensitivityMethod::Forward);
        meets(circuit, count, SensitivityMethod::Adjoint);
    }
}
