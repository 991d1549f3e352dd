//! `--table`: means, powers and extrema of all elements over a run.

use std::sync::atomic::AtomicBool;

use super::args::{Input, SimArgs, TableArgs};
use super::exit::Failure;
use super::request::Request;
use crate::analysis::{self, PeriodicOptions, Table, TableOptions};
use crate::integrate::Error;
use crate::model::Model;

/// That the model has the inputs and outputs of a table that is asked for, before anything runs.
///
/// # Errors
/// The first one that is not there.
pub(super) fn known(args: &TableArgs, input: &Input, model: &Model) -> Result<(), Failure> {
    let found = match args.table {
        true => analysis::table_names(model.circuit(), &args.inputs, &args.outputs),
        false => Ok(()),
    };
    found.map_err(|error| Failure::of_run(&format!("{}: ", input.file.display()), &error))
}

/// The table of a model's transient, which begins where its rows do.
///
/// # Errors
/// The run's.
pub(super) fn table(
    args: &SimArgs,
    model: &Model,
    request: &Request,
    cancel: &AtomicBool,
) -> Result<Table, Error> {
    let start = args.from_pss.then(|| {
        let asked = PeriodicOptions {
            cancel: Some(cancel),
            settings: request.settings(),
            ..PeriodicOptions::default()
        };
        analysis::orbit_start(model, &asked).map(|(_, start)| start)
    });
    let options = TableOptions {
        inputs: args.table.inputs.clone(),
        outputs: args.table.outputs.clone(),
        start: start.transpose()?,
        method: request.method,
        theta: request.theta,
        gamma: request.gamma,
        step: request.step,
        cancel: Some(cancel),
        settings: request.settings(),
    };
    analysis::table(model, &options)
}
