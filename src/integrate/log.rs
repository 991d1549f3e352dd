//! What a stepper tells on its way: events, jumps, impulses, rows at them.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::integrate::error::Error;
use crate::integrate::event::{Change, Event};
use crate::integrate::rows::{Asked, RowKind, Sheet};
use crate::integrate::{Impulse, StateJump, StateJumps};

/// Collects what happens between output times.
#[derive(Default)]
pub struct Log<'a> {
    /// The first [`Self::LISTED`].
    pub events: Vec<Event>,
    /// Impulses at jumps; the first [`Self::LISTED`].
    pub impulses: Vec<Impulse>,
    /// Jumps of the state.
    pub state_jumps: StateJumps,
    pub(super) rows: Sheet<'a>,
    /// The number of events above which steppers pause.
    pause: Option<usize>,
}

impl<'a> Log<'a> {
    /// Events and impulses listed; those after them are only counted.
    pub const LISTED: usize = 1 << 20;

    /// A log for rows of `columns` values from time `from` on, all of them collected; event rows only if `wants_rows`.
    #[must_use]
    pub fn new(columns: usize, from: f64, wants_rows: bool) -> Self {
        let asked = Asked {
            events: wants_rows,
            ..Asked::default()
        };
        Self::of(columns, from, asked)
    }

    /// The same for the rows that are asked for.
    #[must_use]
    pub fn of(columns: usize, from: f64, asked: Asked<'a>) -> Self {
        Self {
            rows: Sheet::new(columns, from, asked),
            ..Self::default()
        }
    }

    /// A device or switch changed its state at `t`, or the state jumped.
    pub fn event(&mut self, t: f64, changes: Arc<[Change]>, jump: bool) {
        if self.events.len() < Self::LISTED {
            self.events.push(Event { t, changes, jump });
        }
    }

    /// An impulse of this area at `t`.
    pub fn impulse(&mut self, t: f64, name: impl Into<String>, area: f64) {
        if self.impulses.len() < Self::LISTED {
            self.impulses.push(Impulse {
                t,
                name: name.into(),
                area,
            });
        }
    }

    /// A jump of the state.
    pub fn state_jump(&mut self, jump: StateJump) {
        self.state_jumps.add(jump);
    }

    /// Whether rows at event times were asked for.
    #[must_use]
    pub fn wants_rows(&self) -> bool {
        self.rows.wants_events()
    }

    /// Whether rows at corners of sources were asked for.
    #[must_use]
    pub fn wants_corners(&self) -> bool {
        self.rows.wants_corners()
    }

    /// What cancels the run.
    pub(super) fn cancel(&self) -> Option<&'a AtomicBool> {
        self.rows.cancel()
    }

    /// Whether a run that stands at `t` may go on: steppers ask at every step.
    ///
    /// # Errors
    /// [`Reason::Interrupted`](super::Reason::Interrupted) when it was cancelled or nobody takes its rows any more, [`Reason::TooManyRows`](super::Reason::TooManyRows) when more were
    /// collected than allowed.
    #[inline]
    pub fn go_on(&self, t: f64) -> Result<(), Error> {
        self.rows.go_on(t)
    }

    /// Has steppers pause at the next event, or no longer do so.
    pub(crate) fn pause_at_event(&mut self, pause: bool) {
        self.pause = pause.then_some(self.events.len());
    }

    /// Whether a stepper that has just logged what happened is to return before the time it was to reach.
    pub(crate) fn pauses(&self) -> bool {
        self.pause.is_some_and(|known| self.events.len() > known)
    }

    /// Takes back what was logged since there were `events` events and `impulses` impulses.
    pub(crate) fn back_to(&mut self, events: usize, impulses: usize) {
        self.events.truncate(events);
        self.impulses.truncate(impulses);
    }

    /// Rows between those of the grid come before the grid's: they are put in order.
    pub(crate) fn hold_rows(&mut self) {
        self.rows.hold();
    }

    /// A row at an event: once at a continuous event, twice (left limit, right limit) at a jump. Ignored unless
    /// [`Self::wants_rows`].
    pub fn row(&mut self, t: f64, row: &[f64]) {
        self.rows.between(t, row, RowKind::Event);
    }

    /// A row at a corner of a source. Ignored unless [`Self::wants_corners`], and where there is a row.
    pub fn corner(&mut self, t: f64, row: &[f64]) {
        if self.wants_corners() {
            self.rows.between(t, row, RowKind::Corner);
        }
    }

    /// Forgets an attempt that failed, for another one from the start. Rows that were handed on stay: returns the time of the last, s.
    pub(crate) fn again(&mut self) -> Option<f64> {
        self.back_to(0, 0);
        self.state_jumps = StateJumps::default();
        self.rows.again()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_attempt_that_failed_leaves_nothing_in_the_log() {
        let mut log = Log::new(1, 0.0, true);
        log.event(0.0, Vec::new().into(), true);
        log.impulse(0.0, "i(d1)", 1.0);
        log.state_jumps.all = (1, 2.0);
        assert_eq!(log.again(), None);
        assert!(log.events.is_empty() && log.impulses.is_empty());
        assert_eq!(log.state_jumps, StateJumps::default());
    }
}
