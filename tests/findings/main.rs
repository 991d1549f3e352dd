//! Netlists that once ended with a wrong answer, an endless run or a refusal without help, each with what is right.
//!
//! Answers come from closed forms, from ngspice with converged steps, or from the same circuit with finite resistances; the
//! netlists stand beside this file.

#![allow(dead_code, reason = "each module uses its part")]

mod curved;
mod decades;
mod energy;
mod entered;
mod front;
mod guards;
mod jumps;
mod leaks;
mod notes;
mod numbers;
mod operating;
mod output;
mod past_zero;
mod read;
mod rest;
#[path = "../runs/mod.rs"]
mod runs;
mod tables;
mod turn_off;

use std::path::{Path, PathBuf};

use circ::circuit::{Circuit, ElaborateOptions, elaborate};
use circ::diagnostic::SourceMap;
use circ::integrate::{Error, Method, Run, SimOptions, simulate};
use circ::mna::behaviour;
use circ::netlist::load;
use circ::settings::Settings;

/// The path of `tests/findings/NAME.cir`.
fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/findings/{name}.cir"))
}

/// The circuit of `tests/findings/NAME.cir`.
fn circuit(name: &str) -> Circuit {
    let loaded = load(&path(name), &ElaborateOptions::default());
    loaded
        .circuit
        .unwrap_or_else(|| panic!("{name}: {:?}", loaded.diagnostics))
}

/// Its run by a method, with rows at events.
fn attempt(name: &str, method: Method) -> Result<Run, Error> {
    let circuit = circuit(name);
    let behaviour = behaviour(&circuit).unwrap_or_else(|e| panic!("{name}: {e:?}"));
    let options = SimOptions {
        method,
        events: true,
        ..SimOptions::default()
    };
    simulate(&circuit, &behaviour, options)
}

/// As [`attempt`], of a run that must end well.
fn run(name: &str, method: Method) -> Run {
    attempt(name, method).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// As [`run`], with pieces of the netlist's text replaced; each must occur.
fn changed(name: &str, replacements: &[(&str, &str)], method: Method) -> Run {
    let options = SimOptions {
        method,
        ..SimOptions::default()
    };
    changed_by(name, replacements, options)
}

/// As [`changed`], at a tolerance.
fn changed_at(name: &str, replacements: &[(&str, &str)], method: Method, tol: f64) -> Run {
    let options = SimOptions {
        method,
        settings: Settings {
            tol,
            ..Settings::default()
        },
        ..SimOptions::default()
    };
    changed_by(name, replacements, options)
}

/// As [`changed`], with all options.
fn changed_by(name: &str, replacements: &[(&str, &str)], options: SimOptions<'_>) -> Run {
    attempt_changed(name, replacements, options).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// As [`changed_by`], of a run that may fail.
fn attempt_changed(
    name: &str,
    replacements: &[(&str, &str)],
    options: SimOptions<'_>,
) -> Result<Run, Error> {
    let mut text = std::fs::read_to_string(path(name)).expect("a netlist");
    for (from, to) in replacements {
        assert!(text.contains(from), "{name} has no `{from}`");
        text = text.replace(from, to);
    }
    let mut sources = SourceMap::default();
    let root = sources.add(name, text);
    let (netlist, _) = circ::netlist::parse(&mut sources, root, &|_| unreachable!());
    let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
    let circuit = circuit.unwrap_or_else(|| panic!("{name}: {findings:?}"));
    let behaviour = behaviour(&circuit).unwrap_or_else(|e| panic!("{name}: {e:?}"));
    simulate(&circuit, &behaviour, options)
}
