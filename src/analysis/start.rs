//! Where a transient begins.

use std::sync::atomic::AtomicBool;

use super::periodic::{PeriodicOptions, orbit_start};
use crate::circuit::SteadyState;
use crate::integrate::{Error, Note, Reason, Standing};
use crate::model::Model;
use crate::settings::Settings;

/// Where a transient begins: where it is `given`, else on the orbit that `.tran … steady` asks for, else (`None`) at its initial conditions or
/// operating point. A note tells of the card; an orbit that is not found is no error.
///
/// # Errors
/// [`Reason::Interrupted`].
pub(super) fn beginning(
    model: &Model,
    given: Option<Standing>,
    (cancel, settings): (Option<&AtomicBool>, &Settings),
) -> Result<(Option<Standing>, Option<Note>), Error> {
    if given.is_some() || model.circuit().steady != Some(SteadyState::Start) {
        return Ok((given, None));
    }
    let asked = PeriodicOptions {
        cancel,
        settings: settings.clone(),
        ..PeriodicOptions::default()
    };
    match orbit_start(model, &asked) {
        Ok((_, standing)) => {
            let text = "`steady` of `.tran`: the run begins at its periodic steady state";
            Ok((Some(standing), Some(text.to_string().into())))
        }
        Err(error) if matches!(error.reason, Reason::Interrupted) => Err(error),
        Err(error) => {
            let text = format!("`steady` of `.tran` is left out: {error}");
            Ok((None, Some(Note::of(error.elements, text))))
        }
    }
}
