//! Waveforms against ngspice: the committed references always, a live ngspice with `CIRC_NGSPICE=1`.
//!
//! A netlist's `*CIRC compare PROBE reltol=R abstol=A` lines say what is compared and how closely: at every reference row
//! |found − reference| ≤ R·(largest |reference|) + A. The tolerances are those of ngspice's runs (its steps, a drop of 1 mV across a
//! diode with N = 0.001, rise times of 10 ns), not of ours.
#![allow(missing_docs, reason = "tests")]

mod runs;

use std::io::Write;
use std::path::Path;

use circ::integrate::SimOptions;
use circ::netlist::value;
use circ::waveform::csv;

/// 64-bit FNV-1a of the lines that are not comments: the hash `make.py` writes.
fn digest(text: &str) -> String {
    let lines = text
        .split_inclusive('\n')
        .filter(|line| !line.starts_with('*'));
    let hashed = lines
        .flat_map(str::bytes)
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
    format!("{hashed:016x}")
}

/// (probe, reltol, abstol) of the `*CIRC compare` lines.
fn comparisons(text: &str) -> Vec<(String, f64, f64)> {
    let lines = text
        .lines()
        .filter_map(|line| line.strip_prefix("*CIRC compare "));
    lines
        .map(|line| {
            let mut words = line.split_whitespace();
            let probe = words.next().expect("a probe").to_owned();
            let mut value = |key: &str| {
                let word = words.next().and_then(|w| w.strip_prefix(key)).expect(key);
                number(word)
            };
            (probe, value("reltol="), value("abstol="))
        })
        .collect()
}

fn number(word: &str) -> f64 {
    value::parse(word)
        .unwrap_or_else(|_| panic!("`{word}` is no number"))
        .f64
}

/// Compares every netlist that asks for it with its reference in `folder`; the names of those that have one.
fn compare_all(folder: &Path) -> Vec<String> {
    let mut compared = Vec::new();
    for name in runs::all() {
        let text = runs::text(&name);
        let wanted = comparisons(&text);
        if wanted.is_empty() {
            continue;
        }
        let Ok(bytes) = std::fs::read_to_string(folder.join(format!("{name}.csv"))) else {
            continue;
        };
        assert!(
            bytes.contains(&format!("# netlist {name}.cir fnv1a {}\n", digest(&text))),
            "{name}.cir has changed since its reference was made: tests/reference/make.py {name}"
        );
        let table: String = bytes
            .split_inclusive('\n')
            .filter(|line| !line.starts_with('#'))
            .collect();
        let reference = csv::read(table.as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}"));
        let run = runs::run(&name, SimOptions::default());
        for (probe, reltol, abstol) in wanted {
            let expected: Vec<f64> = reference
                .column(reference.find(&probe).expect("a column"))
                .collect();
            let found = runs::column(&run, &probe);
            let amplitude = expected.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
            let limit = reltol * amplitude + abstol;
            for (&t, &expected) in reference.time.iter().zip(&expected) {
                let value = runs::interpolate(&run.waveforms.time, &found, t);
                assert!(
                    (value - expected).abs() <= limit,
                    "{name}: {probe} at {t} is {value}, ngspice {expected}, limit {limit}"
                );
            }
        }
        compared.push(name);
    }
    compared
}

/// Netlists with `*CIRC compare` lines.
fn comparable() -> Vec<String> {
    runs::all()
        .into_iter()
        .filter(|name| !comparisons(&runs::text(name)).is_empty())
        .collect()
}

/// Straight to standard error: the test harness swallows what macros print.
fn tell(text: &str) {
    writeln!(std::io::stderr(), "{text}").expect("a standard error");
}

#[test]
fn committed_references_are_met() {
    assert!(comparable().len() >= 22);
    assert_eq!(
        compare_all(&runs::root().join("tests/reference")),
        comparable()
    );
}

#[test]
fn live_ngspice_is_met() {
    if std::env::var_os("CIRC_NGSPICE").is_none_or(|v| v != "1") {
        return tell("NOT RUN: live ngspice (set CIRC_NGSPICE=1)");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let made = std::process::Command::new("python3")
        .arg(runs::root().join("tests/reference/make.py"))
        .args([Path::new("--into"), folder.path(), Path::new("all")])
        .output();
    let Ok(made) = made else {
        return tell("NOT RUN: live ngspice (tests/reference/make.py needs python3)");
    };
    // Other versions give up on other circuits ("timestep too small"); that is no fault of ours, silence about it would be.
    let report = String::from_utf8_lossy(&made.stdout);
    report
        .lines()
        .filter(|line| line.contains("gives up"))
        .for_each(tell);
    let compared = compare_all(folder.path());
    assert!(
        compared.len() >= 15,
        "{compared:?}\n{report}{}",
        String::from_utf8_lossy(&made.stderr)
    );
}
