//! The exact runs of the shipped netlists: CPU of the solve with its set-up and energy balance.
//!
//! `cargo bench --bench netlists [-- RUNS FILE...]` prints one line per netlist: the fastest and the median of so many runs.
#![allow(clippy::print_stdout, missing_docs, reason = "a bench prints")]

use std::path::{Path, PathBuf};

use circ::circuit::ElaborateOptions;
use circ::integrate::{Method, SimOptions, Stats, simulate};
use circ::{mna, netlist};

/// That of the command.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const NETLISTS: [&str; 14] = [
    "bridge-resistor",
    "bridge-capacitor-filter",
    "buck",
    "rectifier",
    "rlcd",
    "clamp",
    "peak-detector",
    "voltage-doubler",
    "three-phase-rectifier",
    "isolated-rectifier",
    "cockcroft-walton",
    "buck-open-loop",
    "boost",
    "flyback",
];

fn runs(file: &Path, count: usize) -> Vec<Stats> {
    let loaded = netlist::load(file, &ElaborateOptions::default());
    let circuit = loaded.circuit.expect("a sound netlist");
    let behaviour = mna::behaviour(&circuit).expect("a sound circuit");
    let run = || {
        let options = SimOptions {
            method: Method::Exact,
            ..SimOptions::default()
        };
        let run = simulate(&circuit, &behaviour, options);
        run.expect("a run").stats
    };
    (0..count).map(|_| run()).collect()
}

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    let count = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(25);
    let mut files: Vec<PathBuf> = arguments.map(PathBuf::from).collect();
    if files.is_empty() {
        let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("netlists");
        files = NETLISTS
            .map(|n| folder.join(n).with_extension("cir"))
            .into();
    }
    for file in files {
        let mut runs = runs(&file, count);
        runs.sort_by(|a, b| a.cpu_seconds.total_cmp(&b.cpu_seconds));
        let (first, median) = (&runs[0], &runs[count / 2]);
        println!(
            "{:24} {:8.3} ms, median {:8.3} ms, {} steps, {} events, {} modes",
            file.file_stem().unwrap_or_default().to_string_lossy(),
            1e3 * first.cpu_seconds,
            1e3 * median.cpu_seconds,
            first.steps,
            first.events,
            first.modes
        );
    }
}
