//! `circ check`.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use super::args::{CheckArgs, MessageFormat};
use super::exit::{Exit, Failure};
use super::files;
use super::input::{self, Subject};
use super::output;
use super::render;
use super::streams::Streams;
use crate::check::{self, Fault, Report};
use crate::diagnostic::{Diagnostic, Severity, SourceMap};
use crate::mna;
use crate::model::Model;
use crate::netlist::Loaded;
use crate::report::html::Page;
use crate::report::json;

/// Prints faults, certificates and theorems; status 1 when there is a fault.
///
/// # Errors
/// See [`Failure`].
pub(super) fn check(args: &CheckArgs, streams: &Streams) -> Result<Exit, Failure> {
    let paths: Vec<&Path> = args.outputs.iter().map(PathBuf::as_path).collect();
    for path in &paths {
        let ending = path.extension().and_then(OsStr::to_str).unwrap_or_default();
        if !matches!(ending, "json" | "txt" | "html") {
            return Err(output::unknown_ending(path, "json, txt or html"));
        }
    }
    files::spare(&paths, [args.input.file.as_path()])?;
    files::writable(&paths)?;
    let Checked {
        report,
        model,
        findings,
        sources,
    } = checked(args, streams)?;
    let in_json = || json::line(&report) + "\n";
    for path in paths {
        let text = match path.extension().and_then(OsStr::to_str) {
            Some("json") => in_json(),
            Some("txt") => report.to_string(),
            _ => Page::of_report(&report)
                .with_circuit(model.as_deref())
                .html()?,
        };
        files::write(path, text.as_bytes())?;
    }
    if args.json {
        streams.data(in_json())?;
    } else {
        let mut text = String::new();
        if !report.title.is_empty() {
            text = report.title.clone() + "\n";
        }
        // Programs read findings from standard error, a person those of the report.
        if streams.messages == MessageFormat::Human {
            text += &render::render(&findings, &sources, streams.out_colours());
        } else {
            input::show(&findings, &sources, streams);
        }
        streams.data(text + &report.judgement().to_string())?;
    }
    Ok(if report.ok { Exit::Done } else { Exit::No })
}

/// The report with the findings it is of, and the model where there is one.
struct Checked {
    report: Report,
    model: Option<Box<Model>>,
    findings: Vec<Diagnostic>,
    sources: SourceMap,
}

impl Checked {
    /// What cannot run.
    fn faulty(title: &str, findings: Vec<Diagnostic>, sources: SourceMap) -> Self {
        debug_assert!(findings.iter().any(|d| d.severity == Severity::Error));
        let findings = input::most(findings);
        let faults = findings.iter().map(|d| Fault::of(d, &sources)).collect();
        Self {
            report: check::faulty(title, faults),
            model: None,
            findings,
            sources,
        }
    }
}

fn checked(args: &CheckArgs, streams: &Streams) -> Result<Checked, Failure> {
    if let Some(system) = input::system(&args.input)? {
        return Ok(Checked {
            report: check::system(&system.lcs),
            model: None,
            findings: vec![],
            sources: SourceMap::default(),
        });
    }
    let Loaded {
        sources,
        netlist,
        circuit,
        diagnostics,
    } = input::load(&args.input);
    if let Some(unreadable) = diagnostics.iter().find(|d| d.code == "unreadable") {
        return Err(Failure::Told {
            code: "unreadable",
            message: unreadable.message.clone(),
            help: unreadable.help.clone(),
        });
    }
    let Some(circuit) = circuit else {
        return Ok(Checked::faulty("", diagnostics, sources));
    };
    let title = circuit.title.clone();
    let choices = input::choices(&args.input);
    let model = match Model::of(netlist, sources, choices, circuit, diagnostics) {
        Ok(model) => model,
        Err(faults) => {
            return Ok(Checked::faulty(&title, faults.findings, faults.sources));
        }
    };
    let sources = model.sources().clone();
    let mut diagnostics = model.findings().to_vec();
    diagnostics.extend(model.multiport().notes.iter().cloned());
    let topology = mna::topology::findings(model.circuit());
    diagnostics.extend(topology.iter().cloned());
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
    let mut checked = match judged {
        Ok(mut report) => {
            report.ok = diagnostics.iter().all(|d| d.severity < Severity::Error);
            let findings = input::most(diagnostics);
            let faults = findings.iter().map(|d| Fault::of(d, &sources));
            report.faults.splice(0..0, faults);
            Checked {
                report,
                model: None,
                findings,
                sources,
            }
        }
        Err(failure) => {
            let failed = match (failure, &subject) {
                (Failure::Run(error), Subject::Circuit(model)) => error.diagnostic(model.circuit()),
                (failure, _) => Diagnostic::error("no-system", None, failure.to_string()),
            };
            if !topology.iter().any(|found| is_same(found, &failed)) {
                diagnostics.push(failed);
            }
            Checked::faulty(&title, diagnostics, sources)
        }
    };
    if let Subject::Circuit(model) = subject {
        checked.model = Some(model);
    }
    Ok(checked)
}

/// Whether two errors are of the same loop or cut: of one code, and of the same elements in words.
fn is_same(one: &Diagnostic, other: &Diagnostic) -> bool {
    let elements = |d: &Diagnostic| {
        let ends = [
            " form a loop",
            " are a cut-set",
            " is shorted",
            " has no way back",
        ];
        let end = ends.iter().find_map(|end| d.message.find(end));
        end.map(|end| d.message[..end].to_owned())
    };
    (one.code, one.severity) == (other.code, other.severity)
        && elements(one).is_some_and(|names| elements(other) == Some(names))
}
