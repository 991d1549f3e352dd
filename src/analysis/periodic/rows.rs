//! The rows of an orbit, and what is to be told with them.

use super::PeriodicOptions;
use super::multipliers::neutral;
use super::shooting::Fixed;
use crate::circuit::{Circuit, Tran};
use crate::integrate::{
    Error, Method, Note, Orbit, OrbitKind, Run, SimOptions, Simulation, Standing, simulate_beside,
};
use crate::mna::StaticMultiport;
use crate::settings::tolerances::periodic::{CLOSED, NEXT_TO_SOURCES};
use crate::settings::tolerances::times::SPAN_PARTS;

/// How the rows of an orbit are made.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Steps {
    pub(super) method: Method,
    /// Steps of this length, s, in place of an error control.
    pub(super) step: Option<f64>,
    /// No error is stated.
    pub(super) unestimated: bool,
}

/// One period of waveforms, from 0 on.
pub(super) fn rows(
    (circuit, multiport, simulation): (&Circuit, &StaticMultiport, Option<&Simulation>),
    standing: Standing,
    (period, steps): (f64, Steps),
    options: &PeriodicOptions<'_>,
    grid: impl FnOnce(Tran) -> Tran,
) -> Result<Run, Error> {
    let from = standing.t;
    let asked = circuit
        .tran
        .filter(|tran| tran.prints && tran.tstep < period);
    let circuit = Circuit {
        tran: Some(grid(Tran {
            tstep: asked.map_or(period / SPAN_PARTS, |tran| tran.tstep),
            prints: asked.is_some(),
            tstop: from + period,
            tstart: from,
            tmax: circuit.tran.and_then(|tran| tran.tmax),
            uic: true,
        })),
        ..circuit.clone()
    };
    let mut run = simulate_beside(
        simulation,
        &circuit,
        multiport,
        SimOptions {
            start: Some(standing),
            events: options.events,
            corners: options.corners,
            method: steps.method,
            step: steps.step,
            unestimated: steps.unestimated,
            cancel: options.cancel,
            settings: options.settings.clone(),
            ..SimOptions::default()
        },
    )?;
    shift(&mut run, from);
    Ok(run)
}

/// Has a run begin at 0.
fn shift(run: &mut Run, from: f64) {
    if from == 0.0 {
        return;
    }
    run.waveforms.time.iter_mut().for_each(|t| *t -= from);
    run.events.iter_mut().for_each(|event| event.t -= from);
    run.impulses
        .iter_mut()
        .for_each(|impulse| impulse.t -= from);
    run.state_jumps
        .first
        .iter_mut()
        .for_each(|jump| jump.t -= from);
}

/// Rows of exact integration are off by no less than they end from where they begin: where steps took over in the search for the orbit, or in them.
pub(super) fn closing_error(run: &mut Run, begin: &[f64], amplitudes: &[f64]) {
    let ends = run.storage.iter().zip(begin).zip(amplitudes);
    let parts = ends.map(|((end, begin), amplitude)| (end - begin).abs() / amplitude);
    let open = parts.fold(0.0, f64::max);
    if open > CLOSED {
        for error in [&mut run.error.max, &mut run.error.rms] {
            *error = Some(error.map_or(open, |error| error.max(open)));
        }
    }
}

/// That rows show nothing of a circuit at rest.
pub(super) fn next_to_nothing() -> Note {
    let text = format!(
        "the circuit rests: all its capacitors and inductors stay below {NEXT_TO_SOURCES:e} of its sources (without any, of what they began with); rows show what leakage and rounding leave, and the residual is one in parts of these"
    );
    Note::run("next-to-nothing", text)
}

/// Sources that do not repeat.
pub(super) fn held_sources(held: &[String]) -> Option<Note> {
    if held.is_empty() {
        return None;
    }
    let text = format!(
        "{}: held at the value at 0-, as it does not repeat (a pulse with a period longer than the run of `.tran` is a step)",
        held.join(", ")
    );
    Some(Note::of("held-source", held, text))
}

/// What is to be told of an orbit that is not stable.
pub(super) fn unstable(orbit: &Orbit) -> Option<Note> {
    let [re, im] = *orbit.multipliers.first().filter(|_| !orbit.stable)?;
    let text =
        format!("the orbit is unstable: a multiplier is {re:.6}{im:+.6}i; transients leave it");
    Some(Note::run("unstable-orbit", text))
}

/// What the user should know of an orbit.
pub(super) fn notes(orbit: &Orbit, fixed: &Fixed, names: &[String], held: &[String]) -> Vec<Note> {
    let mut notes = Vec::new();
    notes.extend(held_sources(held));
    if fixed.one_sided {
        let text = "the circuit rests with a switch or a device on its threshold: what becomes of small disturbances depends on their sign, and there are no multipliers";
        notes.push(Note::run("rests-on-threshold", text));
    }
    notes.extend(of_start(orbit, fixed, names));
    notes
}

/// What of it concerns what begins on it.
pub(super) fn of_start(orbit: &Orbit, fixed: &Fixed, names: &[String]) -> Vec<Note> {
    let mut notes = Vec::from_iter(unstable(orbit));
    if !fixed.one_sided && orbit.kind != OrbitKind::Autonomous {
        let directions = neutral(&fixed.derivative);
        let taking_part = |j: &usize| directions.iter().any(|direction| direction.contains(j));
        let states: Vec<&str> = (0..names.len())
            .filter(taking_part)
            .map(|j| names[j].as_str())
            .collect();
        if !states.is_empty() {
            let text = format!(
                "the orbit is not unique: {} may be another, as a period leaves them as they are in {} direction{}",
                states.join(", "),
                directions.len(),
                if directions.len() == 1 { "" } else { "s" },
            );
            notes.push(Note::run("orbit-not-unique", text));
        }
    }
    notes
}
