//! What circuits cost as they grow: `cargo bench --bench large [FAMILY [SIZE…]]`. Each line is a process of its own, so that the memory is that
//! of one circuit.
#![allow(missing_docs, reason = "a bench")]
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a bench prints")]

mod families;

use std::process::Command;

use circ::Model;
use circ::integrate::{Method, SimOptions, simulate};
use circ::lcs::{Position, SparseLcs};
use cpu_time::ProcessTime;

/// The sizes of `docs/large.md`.
const SIZES: &[(&str, &[usize])] = &[
    ("mmc", &[8, 16, 32]),
    ("dab", &[15, 30, 60]),
    ("six-pulse", &[3, 6]),
    ("cockcroft-walton", &[5, 10]),
    ("cockcroft-walton-ideal", &[15, 30]),
    ("pv", &[2, 5, 10]),
    ("marx", &[3, 5]),
    ("h-bridges", &[5, 10, 20]),
    ("microgrid", &[5, 10]),
    ("led-matrix", &[4, 8, 16]),
    ("mesh", &[7, 12, 20]),
    ("interleaved", &[8, 16, 32]),
    ("ladder", &[100, 300]),
    ("copies", &[10, 100]),
];
/// Sections of the ladders whose set-up alone is measured.
const SECTIONS: &[usize] = &[12_500, 25_000, 50_000];

fn main() {
    let args: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--one", family, size] => one(family, number(size)),
        [] => {
            println!("| family | size | events | modes | CPU, s | memory, MB | energy residual |");
            println!("|---|---|---|---|---|---|---|");
            for (family, sizes) in SIZES {
                sizes.iter().for_each(|&size| apart(family, size));
            }
            println!(
                "\n| set-up of an RC ladder | elements | parsed and built, s | sparse system, s | memory, MB |"
            );
            println!("|---|---|---|---|---|");
            SECTIONS.iter().for_each(|&size| apart("set-up", size));
        }
        [family] => {
            let known = SIZES.iter().find(|(name, _)| *name == family);
            let sizes = known.map_or(&[][..], |(_, sizes)| sizes);
            sizes.iter().for_each(|&size| apart(family, size));
        }
        [family, ref sizes @ ..] => sizes.iter().for_each(|size| apart(family, number(size))),
    }
}

fn number(text: &str) -> usize {
    text.parse().unwrap_or_else(|_| panic!("{text} is no size"))
}

fn apart(family: &str, size: usize) {
    let program = std::env::current_exe().expect("this program");
    let status = Command::new(program)
        .args(["--one", family, &size.to_string()])
        .status();
    if !status.is_ok_and(|status| status.success()) {
        eprintln!("{family} {size}: failed");
    }
}

/// The largest memory of this process, MB; Linux alone tells.
fn memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let number = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    number.map_or(f64::NAN, |kilobytes| kilobytes / 1024.0)
}

fn one(family: &str, size: usize) {
    if family == "set-up" {
        return set_up(size);
    }
    let known = families::FAMILIES.iter().find(|f| f.name == family);
    let known = known.unwrap_or_else(|| panic!("no family {family}"));
    let text = (known.netlist)(size);
    let begin = ProcessTime::now();
    let model = Model::parse(&text, "large.cir").expect("a netlist");
    let options = SimOptions {
        method: Method::Exact,
        ..SimOptions::default()
    };
    let run = simulate(model.circuit(), model.multiport(), options).expect("a run");
    let seconds = begin.elapsed().as_secs_f64();
    println!(
        "| {family} | {size} {} | {} | {} | {seconds:.2} | {:.0} | {:.1e} |",
        known.unit,
        run.stats.events,
        run.stats.modes,
        memory(),
        run.energy.residual_relative
    );
}

fn set_up(sections: usize) {
    let text = families::ladder(sections);
    let begin = ProcessTime::now();
    let model = Model::parse(&text, "ladder.cir").expect("a netlist");
    let parsed = begin.elapsed().as_secs_f64();
    let begin = ProcessTime::now();
    let behaviour = model.multiport();
    let lcs = SparseLcs::of(behaviour, &Position::free(behaviour, Vec::new())).expect("a system");
    let reduced = begin.elapsed().as_secs_f64();
    assert_eq!(lcs.states.len(), sections);
    println!(
        "| {sections} sections | {} | {parsed:.2} | {reduced:.2} | {:.0} |",
        model.circuit().elements.len(),
        memory()
    );
}
