//! A run in steps with coarser ones beside it, which tell its error.
//!
//! Companions go through the same circuit with longer steps from output row to output row, and every probe is compared there: voltages of
//! nodes and currents of devices as well as states. What they differ by is the run's own error and more. A companion stops at its own
//! rows only, so that rows close to each other do not make its steps those of the run.
//!
//! Where a device or switch has changed in one run and follows in the other before the next row, the rows between differ by a jump that is
//! only shifted: an error of the event's time. A change that does not follow is an error of the values.

use std::collections::VecDeque;
use std::sync::atomic::AtomicBool;

use crate::integrate::event::{Change, Event};
use crate::integrate::rows::Asked;
use crate::integrate::run::{Log, Outcome, Reason, SimError, Stepper, Times};
use crate::integrate::stats::StatedError;
use crate::settings::tolerances::steps::FAINT;

/// A companion begins with steps that double from this part of its first one on: what has ended within the first step of the run is seen.
const GRADED: i32 = 24;

/// How a companion is made and what it tells.
pub(crate) struct Coarser<'a> {
    /// Makes it, at its start.
    pub(crate) make: Box<dyn Fn() -> Result<Box<dyn Stepper>, SimError> + 'a>,
    /// It stops at one row of so many.
    pub(crate) stride: usize,
    /// A time, s, that its first steps divide.
    pub(crate) start: f64,
    /// What the run errs at most, over what the companion differs from it.
    pub(crate) share: f64,
}

/// A companion on its way.
struct Companion<'a> {
    by: Coarser<'a>,
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
    fn follow(&mut self, t: f64, events: &[Event]) -> Result<(), SimError> {
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
    /// Largest |value| of every probe.
    amplitude: Vec<f64>,
    /// The row to come.
    k: usize,
}

impl<'a> Accompanied<'a> {
    /// A run until `until`, s, with companions beside it, for probes of these units.
    pub(crate) fn new(
        run: &'a mut dyn Stepper,
        coarser: Vec<Coarser<'a>>,
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
            difference: Difference::new(columns),
        };
        Self {
            run,
            companions: coarser.into_iter().map(companion).collect(),
            units,
            until,
            amplitude: vec![0.0; columns],
            k: 0,
        }
    }

    /// What the probes are related to.
    fn scales(&self) -> Vec<f64> {
        let of = self.amplitude.iter().zip(self.units);
        let largest = |unit: &str| {
            let same = of.clone().filter(|(_, other)| **other == unit);
            same.fold(0.0_f64, |m, (a, _)| m.max(*a))
        };
        let scale = |(a, unit): (&f64, &&str)| a.max(FAINT * largest(unit));
        of.clone().map(scale).collect()
    }

    /// The error of the run; `own`: how far it knows itself that its events are off.
    fn stated(&mut self, own: StatedError) -> StatedError {
        let scales = self.scales();
        let (mut max, mut rms, mut time) = (0.0_f64, 0.0_f64, own.event_time.unwrap_or(0.0));
        for companion in &mut self.companions {
            if companion.lost {
                return own;
            }
            let share = companion.by.share;
            let (largest, mean) = companion.difference.over(&scales);
            // Nothing was compared.
            if companion.difference.rows == 0 {
                return own;
            }
            max = max.max(share * largest);
            rms = rms.max(share * mean);
            time = time.max(share * companion.difference.shift);
        }
        // Neither is it known where a value is no number.
        let known = |error: f64| error.is_finite().then_some(error);
        StatedError {
            max: known(max),
            rms: known(rms),
            event_time: Some(time),
        }
    }
}

impl Stepper for Accompanied<'_> {
    fn time(&self) -> f64 {
        self.run.time()
    }

    fn advance(&mut self, t: f64, log: &mut Log) -> Result<(), SimError> {
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
        grow(&mut self.amplitude, row);
        self.k += 1;
    }

    fn rows_ahead(&mut self, times: &Times, k: usize) -> &[f64] {
        if self.run.has_stepped() {
            return &[];
        }
        let (amplitude, passed) = (&mut self.amplitude, &mut self.k);
        let rows = self.run.rows_ahead(times, k);
        for row in rows.chunks_exact(self.units.len().max(1)) {
            grow(amplitude, row);
            *passed += 1;
        }
        rows
    }

    fn finish(&mut self) -> Outcome {
        let mut outcome = self.run.finish();
        if self.run.has_stepped() && !self.companions.is_empty() {
            outcome.error = self.stated(outcome.error);
        }
        outcome
    }
}

/// Takes the magnitudes of a row into account.
fn grow(amplitude: &mut [f64], row: &[f64]) {
    for (amplitude, value) in amplitude.iter_mut().zip(row) {
        *amplitude = amplitude.max(value.abs());
    }
}

/// Times of a change in one run that the other has not made yet.
#[derive(Debug)]
struct Ahead {
    change: Change,
    /// Whether they are of the first run.
    first: bool,
    times: VecDeque<f64>,
}

/// How far the rows of two runs differ, and how far their events.
#[derive(Debug, Default)]
struct Difference {
    ahead: Vec<Ahead>,
    /// The largest shift of an event, s.
    shift: f64,
    /// The largest |difference| of every column, and the sum of squares.
    worst: Vec<f64>,
    squares: Vec<f64>,
    rows: u32,
    /// The time of the last row, s, if it stood between an event in one run and in the other; its differences.
    doubtful: Option<f64>,
    held: Vec<f64>,
}

impl Difference {
    /// Of rows of so many columns.
    fn new(columns: usize) -> Self {
        Self {
            worst: vec![0.0; columns],
            squares: vec![0.0; columns],
            held: vec![0.0; columns],
            ..Self::default()
        }
    }

    /// Takes note of an event of the first or the second run.
    fn see(&mut self, event: &Event, first: bool) {
        for change in event.changes.iter() {
            let known = self.ahead.iter_mut().find(|ahead| ahead.change == *change);
            match known {
                Some(ahead) if ahead.first != first && !ahead.times.is_empty() => {
                    if let Some(t) = ahead.times.pop_front() {
                        self.shift = self.shift.max((event.t - t).abs());
                    }
                }
                Some(ahead) => {
                    ahead.first = first;
                    ahead.times.push_back(event.t);
                }
                None => self.ahead.push(Ahead {
                    change: change.clone(),
                    first,
                    times: VecDeque::from([event.t]),
                }),
            }
        }
    }

    /// The rows of both runs at `t`, all events until then being known.
    fn compare(&mut self, t: f64, first: &[f64], second: &[f64]) {
        if let Some(before) = self.doubtful.take() {
            // What has not followed by now does not.
            let mut lasts = false;
            for ahead in &mut self.ahead {
                while ahead.times.front().is_some_and(|t| *t <= before) {
                    ahead.times.pop_front();
                    lasts = true;
                }
            }
            if lasts {
                self.take();
            }
        }
        for (held, (a, b)) in self.held.iter_mut().zip(first.iter().zip(second)) {
            *held = (a - b).abs();
        }
        if self.ahead.iter().any(|ahead| !ahead.times.is_empty()) {
            self.doubtful = Some(t);
        } else {
            self.take();
        }
    }

    /// The differences that are held count.
    fn take(&mut self) {
        let sums = self.worst.iter_mut().zip(&mut self.squares);
        for ((worst, squares), d) in sums.zip(&self.held) {
            // What is no number is no small difference.
            let d = if d.is_nan() { f64::INFINITY } else { *d };
            *worst = worst.max(d);
            *squares += d * d;
        }
        self.rows += 1;
    }

    /// The largest difference of a column over its scale, and the largest root mean square.
    fn over(&mut self, scales: &[f64]) -> (f64, f64) {
        if self.doubtful.take().is_some() {
            self.take();
        }
        let count = f64::from(self.rows.max(1));
        let columns = self.worst.iter().zip(&self.squares).zip(scales);
        let relative = |d: f64, scale: f64| if d > 0.0 { d / scale } else { 0.0 };
        columns.fold((0.0, 0.0), |(max, rms): (f64, f64), ((d, s), scale)| {
            let mean = (s / count).sqrt();
            (
                max.max(relative(*d, *scale)),
                rms.max(relative(mean, *scale)),
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::event::conducts;

    #[test]
    fn a_row_between_an_event_and_its_shifted_self_is_an_error_of_time() {
        let mut found = Difference::new(1);
        found.see(&conducts("d1", 0.9), true);
        found.compare(1.0, &[5.0], &[0.0]);
        found.see(&conducts("d1", 1.2), false);
        found.compare(2.0, &[5.0], &[5.5]);
        assert!((found.shift - 0.3).abs() < 1e-15);
        assert_eq!(found.over(&[10.0]), (0.05, 0.05));
    }

    #[test]
    fn a_change_that_the_other_run_does_not_make_is_an_error_of_the_values() {
        let mut found = Difference::new(1);
        found.see(&conducts("d1", 0.9), true);
        found.compare(1.0, &[5.0], &[0.0]);
        found.compare(2.0, &[5.0], &[4.0]);
        assert_eq!(found.shift, 0.0);
        assert_eq!(found.over(&[10.0]).0, 0.5);
        assert!(found.over(&[0.0]).0.is_infinite());
    }
}
