//! `circ check`.

use super::args::CheckArgs;
use super::exit::{Exit, Failure};
use super::input::{self, Subject};
use super::streams::Streams;
use crate::check::{self, Fault, Report};
use crate::diagnostic::{Diagnostic, Severity, SourceMap};
use crate::mna;
use crate::model::Model;
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
        netlist,
        circuit,
        diagnostics,
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
    let choices = input::choices(&args.input);
    let model = match Model::of(netlist, sources, choices, circuit, diagnostics) {
        Ok(model) => model,
        Err(faults) => return Ok(faulty(&title, &faults.findings, &faults.sources)),
    };
    let sources = model.sources().clone();
    let mut diagnostics = model.findings().to_vec();
    diagnostics.extend(model.multiport().notes.iter().cloned());
    diagnostics.extend(mna::topology::findings(model.circuit()));
    input::positions(model.multiport(), &args.switches)?;
    let subject = Subject::Circuit(Box::new(model));
    let judged = match &subject {
        Subject::Circuit(model) if input::is_large(model.multiport()) => {
            let system = input::sparse_system(&subject, &args.switches, streams);
            system.map(|(system, _)| check::large(model.circuit(), &system))
        }
        Subject::Circuit(model) => {
            let system = input::start_system(&subject, &args.switches, streams);
            system.map(|(system, without)| {
                let circuit = model.circuit();
                // A run would be refused, too; what follows is about the start from initial conditions.
                diagnostics.extend(without.map(|error| error.diagnostic(circuit)));
                check::circuit(circuit, &system.lcs)
            })
        }
        Subject::System(system) => Ok(check::system(&system.lcs)),
    };
    match judged {
        Ok(mut report) => {
            report.ok = diagnostics.iter().all(|d| d.severity < Severity::Error);
            let shown = input::most(diagnostics);
            let shown = shown.iter().map(|d| Fault::of(d, &sources));
            report.faults.splice(0..0, shown);
            Ok(report)
        }
        Err(failure) => {
            diagnostics.push(match (failure, &subject) {
                (Failure::Run(error), Subject::Circuit(model)) => error.diagnostic(model.circuit()),
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
