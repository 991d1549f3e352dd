//! Where a transient begins, and its course where it is exact throughout.

use std::sync::atomic::AtomicBool;

use super::periodic::{PeriodicOptions, orbit_start};
use super::variation::Course;
use crate::circuit::SteadyState;
use crate::integrate::{Error, Method, Note, Reason, Simulation, SimulationOptions, Standing};
use crate::model::Model;
use crate::settings::Settings;
use crate::settings::tolerances::times::LEAD;

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

/// The transient of a model from a little before a time on, or from where it begins, until another, s; `None` where steps are made before that, or another
/// method is asked for.
///
/// # Errors
/// The simulation's.
pub(super) fn course(
    model: &Model,
    method: Method,
    start: Option<&Standing>,
    (from, until): (f64, f64),
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
    let begun = start.and_then(|start| start.sources_of(model.multiport(), until));
    let multiport = begun.as_ref().unwrap_or(model.multiport());
    let mut simulation = Simulation::closed(model.circuit(), multiport, options)?;
    if !simulation.is_exact() {
        return Ok(None);
    }
    let (mut t, mut state, mut switches) = match start {
        Some(start) => (start.t, start.state.clone(), start.switches.clone()),
        None => (0.0, simulation.state(), simulation.positions()),
    };
    let begin = from - LEAD * until;
    if begin > t {
        let passed = simulation.pass((t, &state, &switches), begin, cancel)?;
        if passed.is_none() {
            return Ok(None);
        }
        (t, state, switches) = (begin, simulation.state(), simulation.positions());
    }
    Course::of(&mut simulation, (t, &state, &switches), until, cancel)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A buck converter whose current is interrupted: edges, and diodes that turn off on their own.
    #[test]
    fn a_course_that_begins_late_is_the_end_of_the_whole_one() {
        let text = "buck\nvin in 0 24\ns1 in sw g 0 sw\nd1 0 sw d\nl1 sw out 47u\nc1 out 0 22u\nr1 out 0 50\n\
            vg g 0 pulse(0 1 3.3u 10n 10n 2u 10u)\n.model sw sw(vt=0.5 ron=10m roff=10meg)\n.model d d(ideal)\n.tran 1u 1m uic\n.end\n";
        let model = Model::parse(text, "buck.cir").expect("a circuit");
        let settings = Settings::default();
        let over = |from| {
            let found = course(&model, Method::Auto, None, (from, 1e-3), (None, &settings));
            found.expect("a run").expect("an exact one")
        };
        let (whole, late) = (over(0.0), over(0.9e-3));
        let count = late.stretches.len();
        assert!(7 * count < whole.stretches.len(), "{count}");
        // The first one begins on the way.
        let both = whole
            .stretches
            .iter()
            .rev()
            .zip(late.stretches.iter().rev());
        for (one, other) in both.take(count - 1) {
            assert!((one.from - other.from).abs() < 1e-15 && (one.to - other.to).abs() < 1e-15);
            assert!((&one.start - &other.start).amax() < 1e-12 * one.start.amax());
            assert_eq!(
                whole.systems[one.system].key,
                late.systems[other.system].key
            );
        }
    }
}
