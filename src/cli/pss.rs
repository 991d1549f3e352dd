//! `circ pss`.

use std::path::{Path, PathBuf};

use super::args::{PssArgs, TableArgs};
use super::destination::{Destination, Wanted};
use super::exit::{Exit, Failure};
use super::input::{self, Subject};
use super::output::Format;
use super::rows::Columns;
use super::signals::Signals;
use super::streams::Streams;
use super::tabulate;
use crate::analysis::{Finished, PeriodicOptions, periodic_measured, periodic_table, shown};
use crate::integrate::Run;

/// Finds the periodic steady state and writes one period of it.
///
/// # Errors
/// See [`Failure`].
pub(super) fn pss(args: &PssArgs, streams: &Streams) -> Result<Exit, Failure> {
    let formats = Format::of(&args.results.outputs, args.results.format, streams)?;
    let paths: Vec<&Path> = args.results.outputs.iter().map(PathBuf::as_path).collect();
    let subject = input::open(&args.input, &args.results.probes, &paths, streams)?;
    let signals = Signals::watch()?;
    orbit(args, &subject, &formats, &signals, streams)
}

/// The same of what was opened.
///
/// # Errors
/// See [`Failure`].
pub(super) fn orbit(
    args: &PssArgs,
    subject: &Subject,
    formats: &[Format],
    signals: &Signals,
    streams: &Streams,
) -> Result<Exit, Failure> {
    let model = input::model_of(&args.input, subject)?;
    tabulate::known(&args.table, &args.input, model)?;
    if !model.circuit().steps.is_empty() {
        streams.note(
            "left-out",
            "`.step` is left out: this is the orbit of the values as they stand",
        );
    }
    let wanted = Wanted {
        input: &args.input,
        results: &args.results,
        fixed_step: false,
        verify: false,
    };
    let tran = model.circuit().tran;
    let destination = Destination::of(wanted, formats, tran, Some(model), streams);
    let outputs = destination.open(&Columns::of_subject(subject))?;
    let options = PeriodicOptions {
        period: args.period,
        order: args.order.map(usize::from),
        tol: args.tol,
        events: args.results.events,
        corners: destination.has_pictures(),
        cancel: Some(signals.flag()),
        ..PeriodicOptions::default()
    };
    let busy = streams.busy("looking for the periodic steady state");
    let found = periodic_measured(model, &options).and_then(|(orbit, run, mut found)| {
        let TableArgs {
            table,
            inputs,
            outputs,
        } = &args.table;
        if *table {
            found.table = Some(periodic_table(model, (inputs, outputs), &options)?);
        }
        let run = Run {
            orbit: Some(orbit),
            ..shown(model.circuit(), run)
        };
        Ok((run, found))
    });
    drop(busy);
    let finished = match found {
        Ok(run) => Finished {
            run: Some(run),
            error: None,
        },
        Err(error) => Finished::of(Err(error)),
    };
    destination.finish(outputs, finished, true, signals.received())
}
