//! Exact integration that gives way to Moreau's steps where no mode can be found, and takes over again soon after.
//!
//! Steps have no events to miss and no modes to find: where events accumulate, switches contradict each other or the
//! complementarity problem at an event has no mode as its solution, the implicit step still has a solution.

#[cfg(test)]
mod tests;

use crate::integrate::exact::{Exact, Place};
use crate::integrate::run::{Log, Outcome, Reason, SimError, Stepper, Times, is_final, named};
use crate::integrate::stats::{StatedError, Stats};
use crate::integrate::theta::Theta;

/// Makes a stepper that starts at a place.
pub(crate) type Takeover<'a> = Box<dyn Fn(&Place) -> Result<Theta<'a>, SimError> + 'a>;

/// Kinds of interruptions told one by one; of the others only the number is.
const MOST_NOTES: usize = 8;

/// Interruptions by one device for one reason.
#[derive(Debug, Clone)]
struct Interruption {
    elements: Vec<String>,
    reason: Reason,
    count: u32,
    /// Start and end of the first, s.
    first: (f64, f64),
    /// s in all.
    seconds: f64,
}

/// Steps in place of the exact integration.
struct Stepping<'a> {
    theta: Theta<'a>,
    since: f64,
    /// When the exact integration is tried again, s.
    until: f64,
}

/// See the [module](self).
pub(crate) struct Handover<'a> {
    exact: Exact<'a>,
    takeover: Takeover<'a>,
    stepping: Option<Stepping<'a>>,
    /// The steps, s.
    step: f64,
    /// Shortest interval of steps, s.
    shortest: f64,
    interval: f64,
    /// When the exact integration was last taken up again, s.
    resumed: f64,
    interruptions: Vec<Interruption>,
    stats: Stats,
    notes: Vec<String>,
    /// The estimated error of all steps, relative to amplitudes: the exact integration adds none.
    error: StatedError,
}

impl<'a> Handover<'a> {
    /// Exact integration that leaves what it cannot do to steps of `step` seconds, for `shortest` seconds at least.
    pub(crate) fn new(exact: Exact<'a>, takeover: Takeover<'a>, step: f64, shortest: f64) -> Self {
        Self {
            exact,
            takeover,
            step,
            stepping: None,
            shortest,
            interval: shortest,
            resumed: f64::NEG_INFINITY,
            interruptions: Vec::new(),
            stats: Stats::default(),
            notes: Vec::new(),
            error: StatedError::default(),
        }
    }

    /// Steps go on from where the exact integration failed.
    fn give_way(&mut self, error: SimError) -> Result<(), SimError> {
        if is_final(&error) || matches!(error.reason, Reason::TooManySteps { .. }) {
            return Err(error);
        }
        let place = self.exact.leave();
        // An interval that was not long enough is doubled.
        self.interval = if place.t - self.resumed < self.interval {
            2.0 * self.interval
        } else {
            self.shortest
        };
        self.interrupt(error, place.t);
        let mut theta = (self.takeover)(&place)?;
        theta.estimate_errors();
        self.stepping = Some(Stepping {
            theta,
            since: place.t,
            until: place.t + self.interval,
        });
        Ok(())
    }

    fn interrupt(&mut self, error: SimError, t: f64) {
        let SimError {
            elements, reason, ..
        } = error;
        let same = |i: &Interruption| {
            i.elements == elements
                && std::mem::discriminant(&i.reason) == std::mem::discriminant(&reason)
        };
        // The one in progress stands last.
        let known = match self.interruptions.iter().position(same) {
            Some(at) => self.interruptions.remove(at),
            None => Interruption {
                elements,
                reason,
                count: 0,
                first: (t, t),
                seconds: 0.0,
            },
        };
        self.interruptions.push(Interruption {
            count: known.count + 1,
            ..known
        });
    }

    /// The exact integration goes on from where the steps are, if a mode holds there; else the steps go on.
    fn take_back(&mut self) {
        let Some(mut stepping) = self.stepping.take() else {
            return;
        };
        let place = stepping.theta.place();
        let outcome = stepping.theta.finish();
        if self.exact.resume(&place, &outcome.energy).is_ok() {
            self.resumed = place.t;
            self.account(stepping.since, place.t, outcome);
            return;
        }
        // Resuming has booked the energy; the steps go on with an empty account.
        self.interval *= 2.0;
        stepping.until = place.t + self.interval;
        stepping.theta.empty_account();
        self.stepping = Some(stepping);
    }

    /// Books the steps taken since `since`.
    fn account(&mut self, since: f64, t: f64, outcome: Outcome) {
        let Outcome {
            stats,
            notes,
            error,
            ..
        } = outcome;
        // The exact integration adds none: what several parts err adds up at most.
        for (sum, part) in [
            (&mut self.error.max, error.max),
            (&mut self.error.rms, error.rms),
        ] {
            if let Some(part) = part {
                *sum.get_or_insert(0.0) += part;
            }
        }
        self.stats.steps += stats.steps;
        self.stats.rejected += stats.rejected;
        self.stats.events += stats.events;
        self.stats.jumps += stats.jumps;
        self.stats.lcp_solves += stats.lcp_solves;
        self.stats.pivotings += stats.pivotings;
        self.stats.factorisations += stats.factorisations;
        for note in notes {
            if !self.notes.contains(&note) {
                self.notes.push(note);
            }
        }
        if let Some(last) = self.interruptions.last_mut() {
            if last.count == 1 {
                last.first = (since, t);
            }
            last.seconds += t - since;
        }
    }

    fn interruption_notes(&self) -> Vec<String> {
        let told = self.interruptions.iter().take(MOST_NOTES).map(|i| {
            let device = named(&i.elements);
            let (from, to) = i.first;
            let again = if i.count > 1 {
                format!(" (and {} times more, {:e} s in all)", i.count - 1, i.seconds)
            } else {
                String::new()
            };
            format!(
                "between t = {from:e} s and t = {to:e} s Moreau's steps of {:e} s took the place of exact integration{again}: {device}{}",
                self.step, i.reason
            )
        });
        let mut notes: Vec<String> = told.collect();
        if let Some(rest) = self
            .interruptions
            .get(MOST_NOTES..)
            .filter(|r| !r.is_empty())
        {
            let times: u32 = rest.iter().map(|i| i.count).sum();
            notes.push(format!(
                "Moreau's steps took the place of exact integration {times} times for other reasons"
            ));
        }
        notes
    }
}

impl Stepper for Handover<'_> {
    fn time(&self) -> f64 {
        match &self.stepping {
            Some(stepping) => stepping.theta.time(),
            None => self.exact.time(),
        }
    }

    fn advance(&mut self, t: f64, log: &mut Log) -> Result<(), SimError> {
        loop {
            let Some(stepping) = &mut self.stepping else {
                match self.exact.advance(t, log) {
                    Ok(()) => return Ok(()),
                    Err(error) => self.give_way(error)?,
                }
                continue;
            };
            let until = stepping.until;
            stepping.theta.advance(until.min(t), log)?;
            if until > t {
                return Ok(());
            }
            self.take_back();
        }
    }

    fn read(&mut self, row: &mut [f64]) {
        match &mut self.stepping {
            Some(stepping) => stepping.theta.read(row),
            None => self.exact.read(row),
        }
    }

    fn rows_ahead(&mut self, times: &Times, k: usize) -> &[f64] {
        match &self.stepping {
            Some(_) => &[],
            None => self.exact.rows_ahead(times, k),
        }
    }

    fn finish(&mut self) -> Outcome {
        if let Some(mut stepping) = self.stepping.take() {
            let place = stepping.theta.place();
            let outcome = stepping.theta.finish();
            self.exact.stand_at(&place, &outcome.energy);
            self.account(stepping.since, place.t, outcome);
        }
        let mut outcome = self.exact.finish();
        let Stats {
            steps,
            rejected,
            events,
            jumps,
            lcp_solves,
            pivotings,
            factorisations,
            ..
        } = self.stats;
        let stats = &mut outcome.stats;
        stats.steps += steps;
        stats.rejected += rejected;
        stats.events += events;
        stats.jumps += jumps;
        stats.lcp_solves += lcp_solves;
        stats.pivotings += pivotings;
        stats.factorisations += factorisations;
        outcome.error = self.error;
        outcome.notes.extend(self.interruption_notes());
        outcome.notes.append(&mut self.notes);
        outcome
    }
}
