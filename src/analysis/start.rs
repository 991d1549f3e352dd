//! Where a transient begins, and its course where it is exact throughout.

use std::sync::atomic::AtomicBool;

use super::periodic::{PeriodicOptions, orbit_start};
use super::variation::Course;
use crate::circuit::SteadyState;
use crate::integrate::{Error, Method, Note, Reason, Simulation, SimulationOptions, Standing};
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
            Ok((Some(standing), Some(Note::run("steady-start", text))))
        }
        Err(error) if matches!(error.reason, Reason::Interrupted) => Err(error),
        Err(error) => {
            let text = format!("`steady` of `.tran` is left out: {error}");
            Ok((None, Some(Note::of("steady-start", error.elements, text))))
        }
    }
}

/// The transient of a model until a time, s, from where it begins; `None` where steps are made in it, or another method is asked for.
///
/// # Errors
/// The simulation's.
pub(super) fn course(
    model: &Model,
    method: Method,
    start: Option<&Standing>,
    until: f64,
    (cancel, settings): (Option<&AtomicBool>, &Settings),
) -> Result<Option<Course>, Error> {
    if !matches!(method, Method::Auto | Method::Exact) {
        return Ok(None);
    }
    let options = SimulationOptions {
        method,
        settings: settings.clone(),
        ..SimulationOptions::default()
    };
    let mut simulation = Simulation::closed(model.circuit(), model.multiport(), options)?;
    if !simulation.is_exact() {
        return Ok(None);
    }
    let (t, state, switches) = match start {
        Some(start) => (start.t, start.state.clone(), start.switches.clone()),
        None => (0.0, simulation.state(), simulation.positions()),
    };
    Course::of(&mut simulation, (t, &state, &switches), until, cancel)
}
