//! Events that accumulate at one time (Zeno): the state reaches the point of accumulation to rounding after finitely many,
//! or, where it does not, the events come in a burst without end.

use crate::settings::tolerances::events::{ACCUMULATES, BURST};
use std::collections::VecDeque;

/// Shrinking intervals in a row that count as an accumulation where they shrink to [`ACCUMULATES`].
const EVENTS: u32 = 12;

/// So many of them lead into a mode that one of them led into before: events of one device after the other, in a circuit of many, accumulate nowhere.
const AGAIN: u32 = EVENTS / 2;

/// So many events within [`BURST`] of an output step are a burst that does not end by itself.
const EVENTS_OF_BURST: usize = 1024;

/// Watches the intervals between events.
#[derive(Debug, Clone)]
pub(crate) struct Accumulation {
    since: f64,
    last: f64,
    first_interval: f64,
    interval: f64,
    count: u32,
    /// The modes that the first of them led into.
    modes: Vec<usize>,
    /// How many led into one of these again.
    again: u32,
    /// Times of the latest events.
    latest: VecDeque<f64>,
}

impl Accumulation {
    /// A watch that starts at t.
    pub(crate) fn new(t: f64) -> Self {
        Self {
            since: t,
            last: t,
            first_interval: f64::INFINITY,
            interval: f64::INFINITY,
            count: 0,
            modes: Vec::new(),
            again: 0,
            latest: VecDeque::new(),
        }
    }

    /// The number of events and their span, s, where an event at t belongs to a burst, with output steps of length h.
    pub(crate) fn burst(&mut self, t: f64, h: f64) -> Option<(usize, f64)> {
        if self.latest.len() == EVENTS_OF_BURST {
            let span = t - self.latest.pop_front()?;
            if span <= BURST * h {
                self.latest.clear();
                return Some((EVENTS_OF_BURST, span));
            }
        }
        self.latest.push_back(t);
        None
    }

    /// An event at t that leads into a mode; returns the note of an accumulation that it ends.
    pub(crate) fn event(&mut self, t: f64, mode: usize) -> Option<String> {
        let interval = t - self.last;
        if interval <= 0.0 {
            return None;
        }
        let mut note = None;
        if interval < self.interval && self.count > 0 {
            self.count += 1;
        } else {
            note = self.end();
            self.since = self.last;
            self.first_interval = interval;
            self.count = 1;
        }
        if self.modes.contains(&mode) {
            self.again += 1;
        } else if self.modes.len() < EVENTS as usize {
            self.modes.push(mode);
        }
        self.interval = interval;
        self.last = t;
        note
    }

    #[cold]
    #[inline(never)]
    fn note(&self) -> String {
        format!(
            "events accumulate between t = {:e} s and t = {:e} s ({} events in shrinking intervals); the solution goes on \
             beyond",
            self.since, self.last, self.count
        )
    }

    /// The note of an accumulation in progress, which ends.
    pub(crate) fn end(&mut self) -> Option<String> {
        let found = self.count >= EVENTS
            && self.again >= AGAIN
            && self.interval < ACCUMULATES * self.first_interval;
        let note = found.then(|| self.note());
        (self.count, self.again) = (0, 0);
        self.modes.clear();
        note
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_is_told_from_a_clock() {
        let mut watch = Accumulation::new(0.0);
        let bursts = |watch: &mut Accumulation, dt: f64| {
            (0..3 * EVENTS_OF_BURST)
                .filter(|&k| watch.burst(1.0 + k as f64 * dt, 1e-3).is_some())
                .count()
        };
        assert_eq!(bursts(&mut watch, 2e-10), 0);
        let mut watch = Accumulation::new(0.0);
        assert_eq!(bursts(&mut watch, 5e-11), 2);
    }

    #[test]
    fn a_geometric_series_is_noted_and_a_clock_is_not() {
        let mut watch = Accumulation::new(0.0);
        let (mut t, mut dt) = (0.0, 1.0);
        for k in 0..20 {
            t += dt;
            dt /= 2.0;
            assert_eq!(watch.event(t, k % 2), None);
        }
        assert!(
            watch
                .event(5.0, 0)
                .is_some_and(|note| note.contains("20 events"))
        );
        for k in 0..50 {
            assert_eq!(watch.event(6.0 + k as f64, k % 2), None);
        }
        assert_eq!(watch.end(), None);
    }

    #[test]
    fn devices_that_change_one_after_the_other_do_not_accumulate() {
        let mut watch = Accumulation::new(0.0);
        let (mut t, mut dt) = (0.0, 1.0);
        for mode in 0..40 {
            t += dt;
            dt /= 2.0;
            assert_eq!(watch.event(t, mode), None);
        }
        assert_eq!(watch.end(), None);
    }
}
