//! The time loop, shared by all methods: a [`Stepper`] moves, the loop writes rows.

use crate::integrate::error::{Error, is_final};
use crate::integrate::grid::{Grid, Times};
use crate::integrate::log::Log;
use crate::integrate::note;
use crate::integrate::{Energy, Note, Run, StatedError, Stats};
use crate::waveform::Waveforms;

/// One integration method on one circuit.
pub trait Stepper {
    /// Current time, s.
    fn time(&self) -> f64;
    /// Advances to exactly `t` (≥ the current time); afterwards the state is the right limit at `t`. Every event and jump
    /// on the way, one at `t` itself included, goes into `log`.
    ///
    /// # Errors
    /// See [`Reason`](super::Reason); the stepper stays at the last time it reached.
    fn advance(&mut self, t: f64, log: &mut Log) -> Result<(), Error>;
    /// Probe values at the current time (right limit), one per output name.
    fn read(&mut self, row: &mut [f64]);
    /// Advances over the output times k + 1, … of the grid whose rows are known already, and returns them behind that of time k, at which
    /// it stands, one after the other; nothing where that row is to be read.
    fn rows_ahead(&mut self, _times: &Times, _k: usize) -> &[f64] {
        &[]
    }
    /// Whether steps have been made that err.
    fn has_stepped(&self) -> bool {
        true
    }
    /// Counters, energy, notes.
    fn finish(&mut self) -> Outcome;
}

/// What a stepper knows at the end.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Counters.
    pub stats: Stats,
    /// Energy balance.
    pub energy: Energy,
    /// See [`Run::error`].
    pub error: StatedError,
    /// What runs beside it cannot tell of the error, as they make the same steps, relative to the amplitudes.
    pub common: f64,
    /// Things the user should know.
    pub notes: Vec<Note>,
    /// Capacitor voltages, V, and inductor currents, A, where it ends; empty where they are not told.
    pub storage: Vec<f64>,
}

/// What every run needs besides its stepper.
pub struct Frame<'a> {
    /// Title for the waveforms.
    pub title: String,
    /// Column names.
    pub names: Vec<String>,
    /// Column units.
    pub units: Vec<&'static str>,
    /// Output times.
    pub grid: Grid,
    /// `exact`, `theta`, `euler`.
    pub method: String,
    /// What the plan decided.
    pub plan: Vec<String>,
    /// Notes from before the run.
    pub notes: Vec<Note>,
    /// Called with the time reached, s, after an output row or several.
    pub progress: Option<&'a mut dyn FnMut(f64)>,
}

/// Runs a stepper over the output grid.
///
/// # Errors
/// The stepper's, with the run so far in [`Error::partial`].
pub fn run(stepper: &mut dyn Stepper, frame: Frame<'_>, mut log: Log<'_>) -> Result<Run, Error> {
    attempt(stepper, frame, &mut log, true)
}

/// The same with a log that can be used [again](Log::again): after a failure of what is not the `last` attempt, unless [`is_final`],
/// the rows stay in it.
pub(crate) fn attempt(
    stepper: &mut dyn Stepper,
    frame: Frame<'_>,
    log: &mut Log<'_>,
    last: bool,
) -> Result<Run, Error> {
    let Frame {
        title,
        names,
        units,
        grid,
        method,
        plan,
        notes,
        mut progress,
    } = frame;
    let mut row = vec![0.0; names.len()];
    let mut failure = None;
    let times = grid.times();
    log.rows.expect(times.len);
    let mut k = 0;
    while k < times.len {
        let advanced = stepper.advance(times.at(k), log).and_then(|()| {
            let known = stepper.rows_ahead(&times, k);
            let after = if known.is_empty() {
                stepper.read(&mut row);
                log.rows.grid(&times, k..k + 1, &row)?;
                k + 1
            } else {
                let after = k + known.len() / row.len();
                log.rows.grid(&times, k..after, known)?;
                after
            };
            if after < times.len {
                log.go_on(times.at(after - 1))?;
            }
            Ok(after)
        });
        match advanced {
            Ok(after) => k = after,
            Err(error) => {
                failure = Some(error);
                break;
            }
        }
        if let Some(report) = progress.as_mut() {
            report(times.at(k - 1));
        }
    }
    let outcome = stepper.finish();
    let mut all_notes = notes;
    note::append(&mut all_notes, outcome.notes);
    if log.events.len() == Log::LISTED {
        let text = format!("the first {} events are listed", Log::LISTED);
        all_notes.push(Note::run("more", text));
    }
    let failure = match failure {
        Some(error) if !last && !is_final(&error) => return Err(error),
        failure => failure,
    };
    log.rows.end();
    let (time, values, kinds) = log.rows.collected();
    let (mut stats, mut state_jumps) = (outcome.stats, std::mem::take(&mut log.state_jumps));
    if state_jumps.forget_rounding(outcome.energy.at_hand()) {
        stats.jumps = stats.jumps.saturating_sub(1);
    }
    let run = Run {
        waveforms: Waveforms {
            title,
            names,
            units,
            time,
            values,
        },
        kinds,
        method,
        plan,
        stats,
        energy: outcome.energy,
        balanced: true,
        error: outcome.error,
        impulses: std::mem::take(&mut log.impulses),
        events: std::mem::take(&mut log.events),
        state_jumps,
        notes: all_notes,
        aliased: None,
        verified: None,
        orbit: None,
        storage: outcome.storage,
    };
    match failure {
        None => Ok(run),
        Some(mut error) => {
            error.partial = Some(Box::new(run));
            Err(error)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::Reason;
    use std::sync::Arc;

    /// x = t, one "event" with a jump row pair at t = 1 and a failure after 2.
    struct Ramp(f64);
    impl Stepper for Ramp {
        fn time(&self) -> f64 {
            self.0
        }
        fn advance(&mut self, t: f64, log: &mut Log) -> Result<(), Error> {
            if t > 2.0 {
                return Err(Error::at(2.5, Reason::Infeasible).device("d1"));
            }
            if self.0 < 1.0 && t >= 1.0 {
                log.event(1.0, Arc::default(), true);
                log.row(1.0, &[-1.0]);
                log.row(1.0, &[1.0]);
            }
            self.0 = t;
            Ok(())
        }
        fn read(&mut self, row: &mut [f64]) {
            row[0] = self.0;
        }
        fn finish(&mut self) -> Outcome {
            Outcome::default()
        }
    }

    fn ramp(events: bool) -> Error {
        let grid = Grid {
            tstart: 0.0,
            tstep: 1.0,
            tstop: 3.0,
        };
        let frame = Frame {
            title: String::new(),
            names: vec!["v(1)".into()],
            units: vec!["V"],
            grid,
            method: "ramp".into(),
            plan: vec![],
            notes: vec![],
            progress: None,
        };
        run(&mut Ramp(0.0), frame, Log::new(1, 0.0, events)).unwrap_err()
    }

    #[test]
    fn failure_keeps_the_waveform_and_names_time_and_device() {
        let error = ramp(false);
        assert!(
            error
                .to_string()
                .starts_with("at t = 2.5e0 s: d1: the one-step"),
            "{error}"
        );
        let kept = error.partial.unwrap().waveforms;
        assert_eq!(kept.time, [0.0, 1.0, 2.0]);
        assert_eq!(kept.values, [0.0, 1.0, 2.0]);
    }

    #[test]
    fn event_rows_do_not_repeat_the_grid_row() {
        let kept = ramp(true).partial.unwrap().waveforms;
        assert_eq!(kept.time, [0.0, 1.0, 1.0, 2.0]);
        assert_eq!(kept.values, [0.0, -1.0, 1.0, 2.0]);
    }
}
