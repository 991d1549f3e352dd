//! One habit or fault a file, as netlists in the wild have them: each must be accepted, warned of or refused.
//!
//! The collection lies beside the project and is not part of it; `CIRC_CORPUS` may name another place. Without it the
//! test says so and checks nothing.
#![expect(clippy::print_stderr, reason = "a skipped test must be visible")]

use std::path::PathBuf;

use circ::circuit::{Diodes, ElaborateOptions};
use circ::diagnostic::Severity;
use circ::netlist::load;

/// Faults of the circuit rather than of the text: found when its equations are set up.
const OF_THE_EQUATIONS: [&str; 3] = ["v_loop", "vl_loop_dc", "i_into_c"];

fn corpus() -> Option<PathBuf> {
    let place = std::env::var_os("CIRC_CORPUS").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/corpus"),
        PathBuf::from,
    );
    place.join("quirks.csv").is_file().then_some(place)
}

/// The fields of a line of CSV.
fn fields(line: &str) -> Vec<String> {
    let mut all = vec![String::new()];
    let mut quoted = false;
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => all.push(String::new()),
            c => all.last_mut().unwrap().push(c),
        }
    }
    all
}

#[test]
fn quirks_are_met_row_by_row() {
    let Some(corpus) = corpus() else {
        eprintln!("SKIPPED: no corpus beside the project (set CIRC_CORPUS)");
        return;
    };
    let options = ElaborateOptions {
        diodes: Diodes::Ideal,
        ..ElaborateOptions::default()
    };
    let rows = std::fs::read_to_string(corpus.join("quirks.csv")).unwrap();
    let mut wrong = Vec::new();
    let mut met = 0;
    for row in rows.lines().skip(1).map(fields) {
        let (file, wanted) = (&row[0], row[3].as_str());
        let name = file.trim_start_matches("quirks/").trim_end_matches(".cir");
        let loaded = load(&corpus.join(file), &options);
        let accepted = loaded.circuit.is_some();
        let warned = loaded
            .diagnostics
            .iter()
            .any(|d| d.severity == Severity::Warning);
        let fits = if OF_THE_EQUATIONS.contains(&name) {
            accepted
        } else if wanted == "error or note" || wanted.contains("with note") {
            accepted && !loaded.diagnostics.is_empty()
        } else if wanted.starts_with("error naming model") {
            accepted
                && warned
                && load(&corpus.join(file), &ElaborateOptions::default())
                    .circuit
                    .is_none()
        } else if wanted.starts_with("error") {
            !accepted
        } else if wanted.contains("warn") && !wanted.contains("or warn") {
            accepted && warned
        } else {
            accepted
        };
        met += usize::from(fits);
        if !fits {
            wrong.push(format!(
                "{name}: {wanted}; accepted {accepted}, {:?}",
                loaded.diagnostics
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(met > 100, "only {met} rows");
}

#[test]
fn netlists_in_the_wild() {
    let Some(corpus) = corpus() else {
        eprintln!("SKIPPED: no corpus beside the project (set CIRC_CORPUS)");
        return;
    };
    let options = ElaborateOptions {
        diodes: Diodes::Ideal,
        ..ElaborateOptions::default()
    };
    let index = std::fs::read_to_string(corpus.join("index.csv")).unwrap();
    for row in index.lines().skip(1).map(fields) {
        let loaded = load(&corpus.join(&row[0]), &options);
        match loaded.circuit {
            Some(circuit) => assert!(circuit.tran.is_some(), "{} asks for a transient", row[0]),
            None => panic!("{}: {:?}", row[0], loaded.diagnostics),
        }
    }
}
