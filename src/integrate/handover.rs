//! Exact integration that gives way to Moreau's steps where no mode can be found, and takes over again soon after.
//!
//! Steps have no events to miss and no modes to find: where events accumulate, switches contradict each other or the
//! complementarity problem at an event has no mode as its solution, the implicit step still has a solution.

#[cfg(test)]
mod tests;

use crate::circuit::Source;
use crate::integrate::Note;
use crate::integrate::energy::Balance;
use crate::integrate::error::{Error, Reason, is_final, named};
use crate::integrate::exact::{Corners, Exact, Passage, Place};
use crate::integrate::grid::Times;
use crate::integrate::log::Log;
use crate::integrate::run::{Outcome, Stepper};
use crate::integrate::stats::{Energy, StatedError, Stats};
use crate::integrate::theta::Theta;

/// Makes a stepper that starts at a place.
pub(crate) type Takeover = Box<dyn Fn(&Place) -> Result<Theta, Error> + Send>;

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
struct Stepping {
    theta: Theta,
    since: f64,
    /// When the exact integration is tried again, s.
    until: f64,
}

/// See the [module](self).
pub(crate) struct Handover {
    exact: Box<Exact>,
    takeover: Takeover,
    stepping: Option<Box<Stepping>>,
    /// The steps, s.
    step: f64,
    /// Shortest interval of steps, s.
    shortest: f64,
    interval: f64,
    /// When the exact integration was last taken up again, s.
    resumed: f64,
    interruptions: Vec<Interruption>,
    stats: Stats,
    notes: Vec<Note>,
    /// How far the steps let expect that events are aside: the exact integration knows its own.
    error: StatedError,
}

impl Handover {
    /// Exact integration that leaves what it cannot do to steps of `step` seconds, for `shortest` seconds at least.
    pub(crate) fn new(exact: Exact, takeover: Takeover, step: f64, shortest: f64) -> Self {
        Self {
            exact: Box::new(exact),
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
    fn give_way(&mut self, error: Error) -> Result<(), Error> {
        if is_final(&error) || matches!(error.reason, Reason::TooManySteps { .. }) {
            return Err(error);
        }
        // Where energies are no numbers any more nothing could check what steps make of it: they begin anew.
        if !self.exact.balance().energy().residual.is_finite() {
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
        let theta = (self.takeover)(&place)?;
        self.stepping = Some(Box::new(Stepping {
            theta,
            since: place.t,
            until: place.t + self.interval,
        }));
        Ok(())
    }

    fn interrupt(&mut self, error: Error, t: f64) {
        let Error {
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
        let both = self.error.event_time.into_iter().chain(error.event_time);
        self.error.event_time = both.reduce(f64::max);
        // Modes are those of the exact integration.
        self.stats.add(&stats.of_shared_modes());
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

    fn interruption_notes(&self) -> Vec<Note> {
        let told = self.interruptions.iter().take(MOST_NOTES).map(|i| {
            let device = named(&i.elements);
            let (from, to) = i.first;
            let again = if i.count > 1 {
                format!(" (and {} times more, {:e} s in all)", i.count - 1, i.seconds)
            } else {
                String::new()
            };
            let text = format!(
                "between t = {from:e} s and t = {to:e} s Moreau's steps of {:e} s took the place of exact integration{again}: {device}{}",
                self.step, i.reason
            );
            Note::of("steps-instead", &i.elements, text)
        });
        let mut notes: Vec<Note> = told.collect();
        if let Some(rest) = self
            .interruptions
            .get(MOST_NOTES..)
            .filter(|r| !r.is_empty())
        {
            let times: u32 = rest.iter().map(|i| i.count).sum();
            let text = format!(
                "Moreau's steps took the place of exact integration {times} times for other reasons"
            );
            notes.push(Note::run("steps-instead", text));
        }
        notes
    }
}

impl Handover {
    /// What integrates exactly.
    pub(super) const fn integrator(&self) -> &Exact {
        &self.exact
    }

    /// The same.
    pub(super) const fn integrator_mut(&mut self) -> &mut Exact {
        &mut self.exact
    }

    /// Where the run stands.
    pub(crate) fn place(&mut self) -> Place {
        match &self.stepping {
            Some(stepping) => stepping.theta.place(),
            None => self.exact.stand(),
        }
    }

    /// Which ideal pairs conducted when exact integration last held.
    pub(crate) fn conducting(&self) -> &[bool] {
        self.exact.conducting()
    }

    /// See [`Exact::take_periods`].
    pub(crate) fn take_periods(&mut self) {
        self.exact.take_periods();
    }

    /// See [`Exact::leave_periods`].
    pub(crate) fn leave_periods(&mut self) -> u64 {
        self.exact.leave_periods()
    }

    /// See [`Exact::keep_passages`].
    pub(crate) fn keep_passages(&mut self, corners: Corners) {
        self.exact.keep_passages(corners);
    }

    /// The changes of mode since [`Self::keep_passages`], and where the run stood when it was exact throughout; `None` where there are too many or steps were made
    /// since.
    pub(crate) fn take_passages(&mut self) -> Option<Vec<Passage>> {
        let passages = self.exact.take_passages();
        passages.filter(|_| self.stepping.is_none())
    }

    /// Energy so far.
    pub(crate) fn balance(&mut self) -> Balance {
        let steps = self.stepping.as_mut().map(|s| s.theta.balance().energy());
        let balance = self.exact.balance();
        let mut sum = *balance;
        if let Some(steps) = steps {
            sum.add_part(&steps);
        }
        sum
    }

    /// Has another balance from here on.
    pub(crate) fn set_balance(&mut self, balance: Balance) {
        if let Some(stepping) = &mut self.stepping {
            stepping.theta.empty_account();
        }
        *self.exact.balance() = balance;
    }

    /// Goes to a place where these pairs conduct and the sources are these; `false` where exact integration cannot go on there.
    pub(crate) fn restore(
        &mut self,
        place: &Place,
        conducting: &[bool],
        sources: impl Iterator<Item = Source>,
    ) -> bool {
        if let Some(stepping) = self.stepping.take() {
            let (since, outcome) = (stepping.since, { stepping }.theta.finish());
            self.account(since, since, outcome);
        }
        self.exact.leave();
        for (input, source) in sources.enumerate() {
            self.exact.replace_source(input, source);
        }
        self.exact.expect(conducting);
        self.exact.forget_events();
        self.exact.resume(place, &Energy::default()).is_ok()
    }

    /// Steps of exact integration so far.
    pub(crate) const fn exact_steps(&self) -> u64 {
        self.exact.steps()
    }

    /// A source has another waveform from here on, which the takeover knows already: an edge now.
    ///
    /// # Errors
    /// As [`Stepper::advance`].
    pub(crate) fn set_source(
        &mut self,
        input: usize,
        source: Source,
        log: &mut Log,
    ) -> Result<(), Error> {
        if let Some(stepping) = &mut self.stepping {
            self.exact.replace_source(input, source);
            let place = stepping.theta.place();
            let theta = (self.takeover)(&place)?;
            let (since, outcome) = (stepping.since, stepping.theta.finish());
            self.exact.stand_at(&place, &outcome.energy);
            (stepping.theta, stepping.since) = (theta, place.t);
            self.account(since, place.t, outcome);
            return Ok(());
        }
        match self.exact.set_source(input, source, log) {
            Ok(()) => Ok(()),
            Err(error) => self.give_way(error),
        }
    }
}

impl Stepper for Handover {
    fn time(&self) -> f64 {
        match &self.stepping {
            Some(stepping) => stepping.theta.time(),
            None => self.exact.time(),
        }
    }

    fn advance(&mut self, t: f64, log: &mut Log) -> Result<(), Error> {
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
            if until > t || log.pauses() {
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

    fn has_stepped(&self) -> bool {
        !self.interruptions.is_empty()
    }

    fn finish(&mut self) -> Outcome {
        if let Some(mut stepping) = self.stepping.take() {
            let place = stepping.theta.place();
            let outcome = stepping.theta.finish();
            self.exact.stand_at(&place, &outcome.energy);
            self.account(stepping.since, place.t, outcome);
        }
        let mut outcome = self.exact.finish();
        outcome.stats.add(&self.stats);
        outcome.error = self.error;
        outcome.notes.extend(self.interruption_notes());
        outcome.notes.append(&mut self.notes);
        outcome
    }
}
