//! What travels on ideal transmission lines: the waves that left their ports, until they have arrived at the others.
//!
//! The wave that leaves a port is a = v + Z i = 2 Z i + e, with e the wave that arrives there; it arrives at the other port
//! one delay later. It is recorded at every step and straight in between, which is of second order in the step; a jump is two
//! records at one time. Times are those of arrival, so that an edge arrives at the very time at which it is a breakpoint.

use crate::settings::tolerances::steps::{FOLLOWED, KINK, STEPS_PER_DELAY};
use crate::settings::tolerances::times::ARRIVED;
use std::collections::VecDeque;

/// A line as a run needs it; the elements are given by their names.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Z, Ω.
    pub impedance: f64,
    /// s.
    pub delay: f64,
    /// The impedance at each port.
    pub impedances: [String; 2],
    /// The source at each port of the wave that arrives.
    pub sources: [String; 2],
    /// What arrives before anything has, V.
    pub initial: [f64; 2],
}

impl Line {
    /// No step is longer than this, s.
    #[must_use]
    pub fn longest_step(&self) -> f64 {
        self.delay / STEPS_PER_DELAY
    }
}

/// Records kept beyond need before they are dropped together.
const SPARE: usize = 4096;

/// The wave to one port: (time of arrival, V), and the times at which it may break.
#[derive(Debug, Clone, Default)]
struct Track {
    initial: f64,
    records: Vec<(f64, f64)>,
    breaks: VecDeque<f64>,
    largest: f64,
}

impl Track {
    /// The value at `t` before record `next`, the first one later than `t`.
    fn before(&self, next: usize, t: f64) -> f64 {
        match (
            next.checked_sub(1).map(|k| self.records[k]),
            self.records.get(next),
        ) {
            (None, _) => self.initial,
            (Some((_, last)), None) => last,
            (Some((t0, a)), Some(&(t1, b))) => a + (b - a) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0),
        }
    }

    /// Stops and arrivals that differ by rounding are one time: before it the value before a jump, after it the one after.
    fn right(&self, t: f64) -> f64 {
        let late = t + ARRIVED * t.abs();
        self.before(self.records.partition_point(|r| r.0 <= late), t)
    }

    fn left(&self, t: f64) -> f64 {
        let early = t - ARRIVED * t.abs();
        self.before(self.records.partition_point(|r| r.0 < early), t)
    }

    /// The slope between records k and k + 1; `None` at a jump or beyond the records.
    fn slope_of(&self, k: usize) -> Option<f64> {
        let ((t0, a), (t1, b)) = (*self.records.get(k)?, *self.records.get(k + 1)?);
        (t1 > t0).then(|| (b - a) / (t1 - t0))
    }

    fn slope(&self, t: f64) -> f64 {
        let late = t + ARRIVED * t.abs();
        let next = self.records.partition_point(|r| r.0 <= late);
        let last = next.checked_sub(1);
        last.and_then(|k| self.slope_of(k)).unwrap_or(0.0)
    }

    fn record(&mut self, arrival: f64, value: f64) {
        if self.records.is_empty() {
            self.largest = self.initial.abs();
            self.records.push((arrival, self.initial));
        }
        self.largest = self.largest.max(value.abs());
        let count = self.records.len();
        if count >= 2 && self.records[count - 2].0 == arrival {
            // Several things at one instant: the value before and that after all of them.
            self.records.pop();
        }
        self.records.push((arrival, value));
    }

    /// Whether the wave jumps or bends at `t`, one of the breaks.
    fn is_broken(&self, t: f64, delay: f64) -> bool {
        let first = self.records.partition_point(|r| r.0 < t);
        let end = self.records.partition_point(|r| r.0 <= t);
        if first == end {
            return false;
        }
        let limit = FOLLOWED * self.largest;
        let last = end - 1;
        if (self.records[last].1 - self.records[first].1).abs() > limit {
            return true;
        }
        let slope = |k: Option<usize>| k.and_then(|k| self.slope_of(k));
        let (before, after) = (slope(first.checked_sub(1)), slope(Some(last)));
        let (Some(before), Some(after)) = (before, after) else {
            return true;
        };
        let bend = |near: f64, far: Option<f64>| far.map_or(0.0, |far| (far - near).abs());
        let smooth = bend(before, slope(first.checked_sub(2))).max(bend(after, slope(Some(end))));
        let kink = (after - before).abs();
        kink * delay > limit && kink > KINK * smooth
    }

    /// ∫ a² from `t` to `until`, the end of the records, V² s, by the midpoint rule that the steps take power by.
    fn square(&self, t: f64, until: f64) -> f64 {
        let next = self.records.partition_point(|r| r.0 <= t);
        let end = (until, self.records.last().map_or(self.initial, |r| r.1));
        let mut last = (t, self.right(t));
        let mut sum = 0.0;
        for &(time, value) in self.records[next..].iter().chain([&end]) {
            let (a, b) = (last.1, value);
            sum += (time - last.0) * (0.5 * (a + b)).powi(2);
            last = (time, value);
        }
        sum
    }

    /// Forgets what was recorded to arrive after `t`.
    fn back_to(&mut self, t: f64) {
        while self.records.last().is_some_and(|r| r.0 > t) {
            self.records.pop();
        }
        while self.breaks.back().is_some_and(|b| *b > t) {
            self.breaks.pop_back();
        }
    }

    /// Drops what has arrived before `t`, now and then.
    fn forget(&mut self, t: f64) {
        let past = self.records.partition_point(|r| r.0 < t).saturating_sub(4);
        if past > SPARE {
            self.records.drain(..past);
        }
        while self.breaks.front().is_some_and(|b| *b < t) {
            self.breaks.pop_front();
        }
    }
}

/// The lines of a run.
#[derive(Debug, Clone, Default)]
pub(crate) struct Lines {
    lines: Vec<Traffic>,
}

/// One line: the waves to its two ports.
#[derive(Debug, Clone)]
struct Traffic {
    impedance: f64,
    delay: f64,
    arriving: [Track; 2],
}

impl Lines {
    pub(crate) fn new(lines: &[Line]) -> Self {
        let track = |initial: f64| Track {
            initial,
            largest: initial.abs(),
            ..Track::default()
        };
        let lines = lines.iter().map(|line| Traffic {
            impedance: line.impedance,
            delay: line.delay,
            arriving: line.initial.map(track),
        });
        Self {
            lines: lines.collect(),
        }
    }

    /// Longest step, s.
    pub(crate) fn longest_step(&self) -> f64 {
        let delays = self.lines.iter().map(|line| line.delay / STEPS_PER_DELAY);
        delays.fold(f64::INFINITY, f64::min)
    }

    /// The wave that arrives at a port right after `t`, V.
    pub(crate) fn right(&self, (line, port): (usize, usize), t: f64) -> f64 {
        self.lines[line].arriving[port].right(t)
    }

    /// As [`Self::right`], right before `t`.
    pub(crate) fn left(&self, (line, port): (usize, usize), t: f64) -> f64 {
        self.lines[line].arriving[port].left(t)
    }

    /// Its slope after `t`, V/s.
    pub(crate) fn slope(&self, (line, port): (usize, usize), t: f64) -> f64 {
        self.lines[line].arriving[port].slope(t)
    }

    /// The first time after `t` at which an arriving wave breaks.
    pub(crate) fn next_breakpoint(&self, t: f64) -> f64 {
        let first = |line: &Traffic| {
            let track = |track: &Track| {
                let from = track.breaks.partition_point(|b| *b <= t);
                let mut later = track.breaks.range(from..);
                later.find(|b| track.is_broken(**b, line.delay)).copied()
            };
            line.arriving
                .iter()
                .filter_map(track)
                .fold(f64::INFINITY, f64::min)
        };
        self.lines.iter().map(first).fold(f64::INFINITY, f64::min)
    }

    /// A current `i` enters a port at `t`, where a wave `e` arrives: what leaves it travels to the other port.
    pub(crate) fn depart(&mut self, (line, port): (usize, usize), t: f64, i: f64, e: f64) {
        let line = &mut self.lines[line];
        let track = &mut line.arriving[1 - port];
        track.record(t + line.delay, 2.0 * line.impedance * i + e);
        track.forget(t - line.delay);
    }

    /// The waves that leave at `t` may break.
    pub(crate) fn note_break(&mut self, t: f64) {
        for line in &mut self.lines {
            for track in &mut line.arriving {
                let arrival = t + line.delay;
                if track.breaks.back() != Some(&arrival) {
                    track.breaks.push_back(arrival);
                }
            }
        }
    }

    /// Takes back what left after `t`.
    pub(crate) fn back_to(&mut self, t: f64) {
        for line in &mut self.lines {
            for track in &mut line.arriving {
                track.back_to(t + line.delay);
            }
        }
    }

    /// The energy under way at `t`, J: a wave carries a²/4Z.
    pub(crate) fn stored(&self, t: f64) -> f64 {
        let of_line = |line: &Traffic| {
            let squares = line
                .arriving
                .iter()
                .map(|track| track.square(t, t + line.delay));
            squares.sum::<f64>() / (4.0 * line.impedance)
        };
        self.lines.iter().map(of_line).sum()
    }
}
