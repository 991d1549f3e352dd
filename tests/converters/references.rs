//! Fixed cases against ngspice with converged steps: `tests/reference/converters.py` makes the file, this reads it.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use circ::integrate::Method;
use serde::Deserialize;

use crate::circuit::{Card, Circuit, DiodeModel, Part, states};
use crate::compare::run;
use crate::topologies::{Style, plain_case};

#[derive(Deserialize)]
struct File {
    cases: Vec<Reference>,
}

/// A case of the file.
#[derive(Deserialize)]
struct Reference {
    name: String,
    netlist: String,
    signals: Vec<String>,
    times: Vec<f64>,
    /// A row per time.
    values: Vec<Vec<f64>>,
    /// What the values change by, relative to amplitudes, with steps and corners four times finer: the error of the reference.
    error: f64,
}

fn file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference/converters.json")
}

/// The relative difference allowed beside the reference's own error.
const ALLOWED: f64 = 2e-5;
/// A multiple of what four times finer steps change: that error falls at least with the step.
const TRUST: f64 = 3.0;

/// Compares a part of the cases: those with index ≡ `part` mod `parts`. Names of those compared, and what differs.
pub(crate) fn compare(part: usize, parts: usize) -> (Vec<String>, Vec<String>) {
    let text = std::fs::read_to_string(file()).expect("tests/reference/converters.json");
    let references = serde_json::from_str::<File>(&text)
        .expect("references")
        .cases;
    let mut wrong = Vec::new();
    let mut names = Vec::new();
    for reference in references.iter().skip(part).step_by(parts) {
        names.push(reference.name.clone());
        if let Err(what) = meets(reference) {
            wrong.push(format!("{}: {what}", reference.name));
        }
    }
    (names, wrong)
}

fn meets(reference: &Reference) -> Result<(), String> {
    let run = run(&reference.netlist, Method::Auto)?;
    for (j, signal) in reference.signals.iter().enumerate() {
        let column = run
            .waveforms
            .find(signal)
            .ok_or_else(|| format!("no {signal}"))?;
        let amplitude = reference
            .values
            .iter()
            .fold(0.0_f64, |m, row| m.max(row[j].abs()));
        let largest = reference
            .values
            .iter()
            .flatten()
            .fold(0.0_f64, |m, x| m.max(x.abs()));
        let scale = amplitude.max(1e-3 * largest);
        for (t, row) in reference.times.iter().zip(&reference.values) {
            let close = |&time: &f64| (time - t).abs() <= 1e-9 * t;
            let k = run.waveforms.time.iter().rposition(close);
            let value = run
                .waveforms
                .row(k.ok_or_else(|| format!("no row at {t}"))?)[column];
            let difference = (value - row[j]).abs() / scale;
            if difference.is_nan() || difference > ALLOWED + TRUST * reference.error {
                return Err(format!(
                    "{signal} at {t:e} s is {value}, ngspice {}: {difference:.1e} of the amplitude, its own error {:.1e}",
                    row[j], reference.error
                ));
            }
        }
    }
    Ok(())
}

/// Writes the netlists and ngspice's decks, with `@TMAX` and `@EPS` where the script puts steps and widths of corners.
pub(crate) fn write_decks(folder: &Path, count: u64) {
    for seed in 0..count {
        let style = if seed % 4 == 3 {
            Style::Curved
        } else {
            Style::Finite
        };
        let case = plain_case(seed, style);
        let write = |ending: &str, text: String| {
            let path = folder.join(format!("{seed:03}.{ending}"));
            std::fs::write(path, text).expect("a file");
        };
        write("cir", case.circuit.text());
        write("deck", deck(&case.circuit));
        write("signals", states(&case.circuit).join("\n"));
    }
}

/// As ngspice reads it: piecewise-linear diodes are its code model.
fn deck(circuit: &Circuit) -> String {
    let plain = circuit.text();
    let mut text = String::new();
    let mut models = String::new();
    for (k, line) in plain.lines().enumerate() {
        let card = k.checked_sub(1).and_then(|k| circuit.cards.get(k));
        match card {
            Some(Card {
                name,
                nodes,
                part: Part::D(DiodeModel::Lines(vfwd, ron, roff)),
            }) => {
                writeln!(text, "a{name} {} {} m{name}", nodes[0], nodes[1]).expect("memory");
                writeln!(
                    models,
                    ".model m{name} sidiode(ron={ron:e} roff={roff:e} vfwd={vfwd:e} epsilon=@EPS)"
                )
                .expect("memory");
            }
            Some(Card {
                name,
                nodes,
                part: Part::Comparator([high, low], _),
            }) => {
                let difference = format!("v({})-v({})", nodes[2], nodes[3]).replace("v(0)", "0");
                writeln!(
                    text,
                    "b{name} {} {} V={difference} > 0 ? {high:e} : {low:e}",
                    nodes[0], nodes[1]
                )
                .expect("memory");
            }
            _ if line.starts_with(".save")
                || line.starts_with(".end")
                || line.contains(" d(ron") => {}
            _ if line.starts_with(".tran") => {
                let words: Vec<&str> = line.split_whitespace().collect();
                writeln!(text, ".tran {} {} 0 @TMAX uic", words[1], words[2]).expect("memory");
            }
            _ => {
                text += line;
                text.push('\n');
            }
        }
    }
    text + &models + ".end\n"
}
