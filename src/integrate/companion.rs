//! A run in steps with others beside it, which tell its error.
//!
//! Companions go through the same circuit in other steps from output row to output row, and every probe is compared there: voltages of
//! nodes and currents of devices as well as states. What they differ by is the run's own error and more. A companion stops at its own
//! rows only, so that rows close to each other do not make its steps those of the run.
//!
//! What is compared, and how, is told by [`crate::integrate::difference`].

use std::sync::atomic::AtomicBool;

use crate::integrate::difference::{Difference, grow, scales};
use crate::integrate::error::{Error, Reason};
use crate::integrate::event::Event;
use crate::integrate::grid::Times;
use crate::integrate::log::Log;
use crate::integrate::rows::Asked;
use crate::integrate::run::{Outcome, Stepper};
use crate::integrate::stats::StatedError;
use crate::settings::tolerances::stated::{EVENTS, IMPRECISE, ROUGHLY};

/// A companion begins with steps that double from this part of its first one on: what has ended within the first step of the run is seen.
const GRADED: i32 = 24;

/// How a companion is made and what it tells.
pub(crate) struct Beside<'a> {
    /// Makes it, at its start.
    pub(crate) make: Box<dyn Fn() -> Result<Box<dyn Stepper>, Error> + 'a>,
    /// It stops at one row of so many.
    pub(crate) stride: usize,
    /// A time, s, that its first steps divide.
    pub(crate) start: f64,
    /// What the run errs at most, over what the companion differs from it.
    pub(crate) share: f64,
}

/// A companion on its way.
struct Companion<'a> {
    by: Beside<'a>,
    /// None before the run has made steps, and where the companion could not go on.
    stepper: Option<Box<dyn Stepper>>,
    lost: bool,
    /// It has left its start.
    started: bool,
    log: Log<'a>,
    row: Vec<f64>,
    /// The row it stops at next.
    next: usize,
    /// Events of the run that were taken into account.
    told: usize,
    difference: Difference,
}

impl Companion<'_> {
    /// Goes to `t`, row `k` of the run, whose events so far these are.
    fn follow(&mut self, t: f64, events: &[Event]) -> Result<(), Error> {
        let stepper = match &mut self.stepper {
            Some(stepper) => stepper,
            none => none.insert((self.by.make)()?),
        };
        let from = stepper.time();
        if !self.started && t > from {
            self.started = true;
            for k in (0..GRADED).rev() {
                let early = from + self.by.start * 0.5_f64.powi(k);
                stepper.advance(early.min(t), &mut self.log)?;
            }
        }
        stepper.advance(t, &mut self.log)?;
        stepper.read(&mut self.row);
        for event in events.get(self.told..).unwrap_or_default() {
            self.difference.see(event, true);
        }
        self.told = events.len();
        for event in &self.log.events {
            self.difference.see(event, false);
        }
        self.log.again();
        Ok(())
    }
}

/// A run with companions, see the [module](self).
pub(crate) struct Accompanied<'a> {
    run: &'a mut dyn Stepper,
    companions: Vec<Companion<'a>>,
    units: &'a [&'static str],
    /// The last row, s.
    until: f64,
    /// Largest |value| of every probe; rows that an exact step passes do not count, so that it is no larger than it is.
    amplitude: Vec<f64>,
    /// The row to come.
    k: usize,
}

impl<'a> Accompanied<'a> {
    /// A run until `until`, s, with companions beside it, for probes of these units.
    pub(crate) fn new(
        run: &'a mut dyn Stepper,
        beside: Vec<Beside<'a>>,
        units: &'a [&'static str],
        until: f64,
        cancel: Option<&'a AtomicBool>,
    ) -> Self {
        let columns = units.len();
        let companion = |by| Companion {
            by,
            stepper: None,
            lost: false,
            started: false,
            log: Log::of(
                columns,
                f64::INFINITY,
                Asked {
                    cancel,
                    ..Asked::default()
                },
            ),
            row: vec![0.0; columns],
            next: 0,
            told: 0,
            difference: Difference::new(columns, f64::INFINITY),
        };
        Self {
            run,
            companions: beside.into_iter().map(companion).collect(),
            units,
            until,
            amplitude: vec![0.0; columns],
            k: 0,
        }
    }

    /// The error of the run; `own`: how far it knows itself that its events are off; `common`: what companions do not see.
    fn stated(&mut self, own: StatedError, common: f64) -> StatedError {
        let scales = scales(&self.amplitude, self.units);
        let (mut max, mut rms, mut time) = (0.0_f64, 0.0_f64, own.event_time.unwrap_or(0.0));
        for companion in &mut self.companions {
            if companion.lost {
                return own;
            }
            let share = companion.by.share;
            let (largest, mean) = companion.difference.over(&scales);
            // Nothing was compared.
            if companion.difference.rows() == 0 {
                return own;
            }
            max = max.max(share * largest);
            rms = rms.max(share * mean);
            time = time.max(share.min(EVENTS) * companion.difference.shift());
        }
        // Neither is it known where a value is no number.
        let known = |error: f64| {
            let error = error * (1.0 + error / IMPRECISE).min(ROUGHLY);
            error.is_finite().then_some(error)
        };
        StatedError {
            max: known(max + common),
            rms: known(rms + common),
            event_time: Some(time),
        }
    }
}

impl Accompanied<'_> {
    /// Compares a row of the run with those companions that stand at its time.
    fn compare(&mut self, row: &[f64]) {
        let t = self.run.time();
        let here = |c: &&mut Companion<'_>| c.stepper.as_ref().is_some_and(|s| s.time() == t);
        for companion in self.companions.iter_mut().filter(here) {
            let Companion {
                difference,
                row: other,
                ..
            } = companion;
            difference.compare(t, row, other);
            companion.next += companion.by.stride;
        }
    }
}

impl Stepper for Accompanied<'_> {
    fn time(&self) -> f64 {
        self.run.time()
    }

    fn advance(&mut self, t: f64, log: &mut Log) -> Result<(), Error> {
        self.run.advance(t, log)?;
        if !self.run.has_stepped() {
            return Ok(());
        }
        let due = |c: &&mut Companion<'_>| !c.lost && (self.k >= c.next || t >= self.until);
        for companion in self.companions.iter_mut().filter(due) {
            match companion.follow(t, &log.events) {
                Ok(()) => {}
                Err(error) if error.reason == Reason::Interrupted => return Err(error),
                // It is not the run that failed.
                Err(_) => companion.lost = true,
            }
            companion.next = self.k;
        }
        Ok(())
    }

    fn read(&mut self, row: &mut [f64]) {
        self.run.read(row);
        if self.run.has_stepped() {
            self.compare(row);
        }
        grow(&mut self.amplitude, row);
        self.k += 1;
    }

    fn rows_ahead(&mut self, times: &Times, k: usize) -> &[f64] {
        if self.run.has_stepped() {
            return &[];
        }
        let (rows, columns) = (self.run.rows_ahead(times, k), self.amplitude.len());
        if let Some(row) = rows.get(..columns) {
            grow(&mut self.amplitude, row);
        }
        self.k += rows.len() / columns.max(1);
        rows
    }

    fn finish(&mut self) -> Outcome {
        let mut outcome = self.run.finish();
        if self.run.has_stepped() && !self.companions.is_empty() {
            outcome.error = self.stated(outcome.error, outcome.common);
        }
        outcome
    }
}
