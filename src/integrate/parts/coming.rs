//! What parts that run ahead tell, until its time has come.

use std::collections::VecDeque;

use crate::integrate::event::Event;
use crate::integrate::log::Log;
use crate::integrate::rows::RowKind;
use crate::integrate::stats::{Impulse, StateJumps};
use crate::settings::tolerances::times::SAME_TIME;

/// A time at which a row is due.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Instant {
    /// s.
    pub(super) t: f64,
    /// What happens.
    pub(super) kind: RowKind,
    /// Devices or switches change, or the state jumps: what a stepper pauses at.
    pub(super) is_event: bool,
}

/// Events, impulses, jumps and rows that are not told yet.
#[derive(Default)]
pub(super) struct Coming {
    events: VecDeque<Event>,
    impulses: VecDeque<Impulse>,
    state_jumps: StateJumps,
    instants: VecDeque<Instant>,
    /// By instant: the row of its part.
    rows: Vec<f64>,
}

impl Coming {
    /// What a log holds.
    pub(super) fn of(mut log: Log<'_>) -> Self {
        let (times, rows, kinds) = log.rows.collected();
        let mut events = log.events.iter().map(|event| event.t).peekable();
        let instants = times.into_iter().zip(kinds).map(|(t, kind)| {
            while events.next_if(|event| *event < t).is_some() {}
            Instant {
                t,
                kind,
                is_event: events.peek() == Some(&t),
            }
        });
        Self {
            instants: instants.collect(),
            events: log.events.into(),
            impulses: log.impulses.into(),
            state_jumps: log.state_jumps,
            rows,
        }
    }

    /// Takes the instants, of those at one time the last.
    pub(super) fn take_instants(&mut self) -> VecDeque<Instant> {
        let mut instants: Vec<Instant> = std::mem::take(&mut self.instants).into();
        instants.reverse();
        instants.dedup_by_key(|instant| instant.t);
        instants.into_iter().rev().collect()
    }

    /// At how many times something happens.
    pub(super) fn instants(&self) -> usize {
        let pairs = self.instants.iter().zip(self.instants.iter().skip(1));
        let same = pairs.filter(|(a, b)| a.t == b.t).count();
        self.instants.len() - same
    }

    /// What happens, an event if anything is one.
    pub(super) fn kind(&self) -> Option<RowKind> {
        self.instants.iter().map(|instant| instant.kind).min()
    }

    /// All but the instants.
    pub(super) fn without_instants(mut self) -> Self {
        self.instants.clear();
        self
    }

    /// Adds what another part tells.
    pub(super) fn add(&mut self, other: Self) {
        self.events.extend(other.events);
        self.impulses.extend(other.impulses);
        self.state_jumps.add_beside(&other.state_jumps);
        self.instants.extend(other.instants);
    }

    /// Brings everything into the order of time; what happens at one time stays in the order of the parts.
    pub(super) fn sort(&mut self) {
        let events = self.events.make_contiguous();
        events.sort_by(|a, b| a.t.total_cmp(&b.t));
        let impulses = self.impulses.make_contiguous();
        impulses.sort_by(|a, b| a.t.total_cmp(&b.t));
        let instants = self.instants.make_contiguous();
        instants.sort_by(|a, b| a.t.total_cmp(&b.t));
    }

    /// The time of the first instant, s.
    pub(super) fn next_time(&self) -> Option<f64> {
        self.instants.front().map(|instant| instant.t)
    }

    /// The first instant, with all that are no later by more than the rounding of time: an event, if one of them is.
    pub(super) fn pop_instant(&mut self) -> Option<Instant> {
        let mut first = self.instants.pop_front()?;
        let end = first.t + SAME_TIME * first.t.abs();
        while let Some(same) = pop_until(&mut self.instants, |next| next.t, end) {
            first.kind = first.kind.min(same.kind);
        }
        Some(first)
    }

    /// The rows before and after the jump that it holds.
    pub(super) fn jump(&self) -> Option<(&[f64], &[f64])> {
        let count = self.instants.len();
        let jumps = count > 1 && self.instants[count - 1].t == self.instants[count - 2].t;
        let width = self.rows.len() / count.max(1);
        let row = |k: usize| &self.rows[k * width..(k + 1) * width];
        jumps.then(|| (row(count - 2), row(count - 1)))
    }

    /// Tells what has happened by `t`.
    pub(super) fn tell(&mut self, t: f64, log: &mut Log) {
        let near = t + SAME_TIME * t.abs();
        while let Some(event) = pop_until(&mut self.events, |event| event.t, near) {
            log.event(event.t, event.changes, event.jump);
        }
        while let Some(impulse) = pop_until(&mut self.impulses, |impulse| impulse.t, near) {
            log.impulse(impulse.t, impulse.name, impulse.area);
        }
        log.state_jumps
            .add_beside(&std::mem::take(&mut self.state_jumps));
    }
}

/// The first of these, if its time is no later than `end`, s.
fn pop_until<T>(all: &mut VecDeque<T>, time: impl Fn(&T) -> f64, end: f64) -> Option<T> {
    let due = all.front().is_some_and(|first| time(first) <= end);
    due.then(|| all.pop_front()).flatten()
}
