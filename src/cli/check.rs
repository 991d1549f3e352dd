//! `circ check`.

use super::args::CheckArgs;
use super::exit::{Exit, Failure};
use super::input::{self, Subject};
use super::streams::Streams;
use crate::check::{self, Fault, Report};
use crate::diagnostic::{Diagnostic, Severity, SourceMap};
use crate::mna;
use crate::netlist::Loaded;
use crate::report::json;

/// Prints faults, certificates and theorems; status 1 when there is a fault.
///
/// # Errors
/// See [`Failure`].
pub(super) fn check(args: &CheckArgs, streams: &Streams) -> Result<Exit, Failure> {
    let report = report(args, streams)?;
    let text = if args.json {
        json::line(&report) + "\n"
    } else {
        report.to_string()
    };
    streams.data(text)?;
    Ok(if report.ok { Exit::Done } else { Exit::No })
}

fn report(args: &CheckArgs, streams: &Streams) -> Result<Report, Failure> {
    if let Some(system) = input::system(&args.input)? {
        return Ok(check::system(&system.lcs));
    }
    let Loaded {
        sources,
        circuit,
        mut diagnostics,
        ..
    } = input::load(&args.input);
    if let Some(unreadable) = diagnostics.iter().find(|d| d.code == "unreadable") {
        return Err(Failure::Message(unreadable.message.clone()));
    }
    if !args.json {
        input::show(&diagnostics, &sources, streams);
    }
    let Some(circuit) = circuit else {
        return Ok(faulty("", &diagnostics, &sources));
    };
    let title = circuit.title.clone();
    let behaviour = match mna::behaviour(&circuit) {
        Ok(behaviour) => behaviour,
        Err(faults) => {
            diagnostics.extend(faults);
            return Ok(faulty(&title, &diagnostics, &sources));
        }
    };
    diagnostics.extend(behaviour.notes.iter().cloned());
    diagnostics.extend(mna::topology::findings(&circuit));
    input::positions(&behaviour, &args.switches)?;
    let subject = Subject::Circuit(Box::new((circuit, behaviour)));
    match input::start_system(&subject, &args.switches, Some(&sources), streams) {
        Ok((system, without)) => {
            let mut report = match &subject {
                Subject::Circuit(parts) => {
                    // A run would be refused, too; what follows is about the start from initial conditions.
                    diagnostics.extend(without.map(|error| error.diagnostic(&parts.0)));
                    check::circuit(&parts.0, &system.lcs)
                }
                Subject::System(_) => check::system(&system.lcs),
            };
            report.ok = diagnostics.iter().all(|d| d.severity < Severity::Error);
            let shown = input::most(diagnostics);
            let shown = shown.iter().map(|d| Fault::of(d, &sources));
            report.faults.splice(0..0, shown);
            Ok(report)
        }
        Err(failure) => {
            diagnostics.push(match (failure, &subject) {
                (Failure::Run(error), Subject::Circuit(parts)) => error.diagnostic(&parts.0),
                (failure, _) => Diagnostic::error("no-system", None, failure.to_string()),
            });
            Ok(faulty(&title, &diagnostics, &sources))
        }
    }
}

fn faulty(title: &str, diagnostics: &[Diagnostic], sources: &SourceMap) -> Report {
    debug_assert!(diagnostics.iter().any(|d| d.severity == Severity::Error));
    let shown = input::most(diagnostics.to_vec());
    check::faulty(title, shown.iter().map(|d| Fault::of(d, sources)).collect())
}
