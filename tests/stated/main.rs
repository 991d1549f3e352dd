//! How far the error that a run states bounds its true one, measured on random circuits.
//!
//! `CIRC_STATED=N cargo test --release --test stated -- --nocapture` measures N circuits for each setting and prints the table of
//! docs/running.md; `CIRC_STATED_SEED` is the first seed, `CIRC_STATED_SETTING` one row alone, and with `CIRC_STATED_ALL` every circuit is
//! told. `CIRC_STATED_DECK=SEED` (and `CIRC_STATED_CURVED=1`) prints the netlist of a seed in the test `deck`.
#![allow(
    missing_docs,
    dead_code,
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "tests; the converters are shared"
)]

#[path = "../converters/bench.rs"]
mod bench;
#[path = "../converters/circuit.rs"]
mod circuit;
mod measure;
mod networks;
#[path = "../converters/random.rs"]
mod random;
mod table;
#[path = "../converters/topologies.rs"]
mod topologies;

use table::{Row, SETTINGS};

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

/// Seeds of the part that always runs, and the settings that take little time.
const FIXED: (u64, u64) = (1, 20);
const QUICK: [usize; 3] = [0, 1, 3];

/// What docs/running.md says of many circuits, on a few.
#[test]
fn the_stated_error_bounds_the_true_one() {
    std::thread::scope(|scope| {
        for k in QUICK {
            scope.spawn(move || {
                let row = Row::of(&SETTINGS[k], FIXED.0, FIXED.1);
                assert!(row.told >= 8 && row.unknown == 0, "{row}");
                assert_eq!(row.bounded, row.told, "{row}");
                assert!(row.quantile(0.5) < 10.0, "{row}");
            });
        }
    });
}

/// Seed 66 has a row 0.25 time constants after an edge, and seed 42180 one 0.5 µs after a corner behind which a diode begins to conduct: the first step there is the
/// same in coarser runs, unless these make it in one part.
#[test]
fn a_step_that_a_row_cuts_short_is_seen() {
    for seed in [66, 42180] {
        let row = Row::of(&SETTINGS[1], seed, 1);
        assert_eq!((row.told, row.bounded), (1, 1), "{seed}: {row}");
    }
}

/// The table of docs/running.md.
#[test]
fn table_of_many_circuits() {
    let Some(count) = number("CIRC_STATED") else {
        eprintln!("NOT RUN: the stated error on many circuits (set CIRC_STATED=N)");
        return;
    };
    let first = number("CIRC_STATED_SEED").unwrap_or(1);
    let only = number("CIRC_STATED_SETTING");
    println!("{}", Row::HEAD);
    for (k, setting) in SETTINGS.iter().enumerate() {
        if only.is_none_or(|only| only == k as u64) {
            println!("{}", Row::of(setting, first, count));
        }
    }
}

/// Prints the netlist of a seed.
#[test]
fn deck() {
    if let Some(seed) = number("CIRC_STATED_DECK") {
        let curved = number("CIRC_STATED_CURVED").is_some();
        println!("{}", measure::netlist(seed, curved));
    }
}
