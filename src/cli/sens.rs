//! `circ sens`.

use super::args::SensArgs;
use super::exit::{Exit, Failure};
use super::input;
use super::signals::Signals;
use super::streams::Streams;
use crate::analysis::{SensitivityOptions, sensitivity};
use crate::report::json;

/// Prints the derivatives of what `.meas` finds.
///
/// # Errors
/// See [`Failure`].
pub(super) fn sens(args: &SensArgs, streams: &Streams) -> Result<Exit, Failure> {
    let subject = input::open(&args.input, &[], &[], streams)?;
    let model = input::model_of(&args.input, &subject)?;
    if !model.circuit().steps.is_empty() {
        streams.note(
            "left-out",
            "`.step` is left out: these are the derivatives at the values as they stand",
        );
    }
    let signals = Signals::watch()?;
    let options = SensitivityOptions {
        of: args.of.clone(),
        to: args.to.clone(),
        steady: args.pss,
        period: args.period,
        table: args.table,
        inputs: args.inputs.clone(),
        outputs: args.outputs.clone(),
        cancel: Some(signals.flag()),
        ..SensitivityOptions::default()
    };
    let places = subject.places();
    let found = sensitivity(model, &options)
        .map_err(|error| input::broke_off(&args.input, &error, places, streams))?;
    streams.notes(places, &found.notes);
    if args.json {
        streams.data(json::line(&found) + "\n")?;
    } else {
        streams.data(found.words())?;
    }
    Ok(Exit::Done)
}
