//! Waveforms as what they are, straight lines between rows, and the distances of two of them.

use std::collections::VecDeque;

use super::At;
use crate::waveform::Waveforms;

/// A signal as straight lines between rows.
pub(super) struct Curve<'a> {
    pub(super) time: &'a [f64],
    pub(super) values: Vec<f64>,
}

impl<'a> Curve<'a> {
    pub(super) fn of(waves: &'a Waveforms, j: usize) -> Self {
        Self {
            time: &waves.time,
            values: waves.column(j).collect(),
        }
    }

    /// The limit from the left at t.
    pub(super) fn before(&self, t: f64) -> f64 {
        let k = self.time.partition_point(|&s| s < t);
        if k == self.time.len() {
            self.values[k - 1]
        } else {
            self.between(k, t)
        }
    }

    /// The limit from the right at t.
    pub(super) fn after(&self, t: f64) -> f64 {
        let k = self.time.partition_point(|&s| s <= t);
        match k {
            0 => self.values[0],
            k if self.time[k - 1] == t || k == self.time.len() => self.values[k - 1],
            k => self.between(k, t),
        }
    }

    /// On the line from row k − 1 to row k.
    fn between(&self, k: usize, t: f64) -> f64 {
        if k == 0 || self.time[k] == t {
            return self.values[k];
        }
        let weight = (t - self.time[k - 1]) / (self.time[k] - self.time[k - 1]);
        self.values[k - 1] * (1.0 - weight) + self.values[k] * weight
    }

    pub(super) fn amplitude(&self, grid: &[f64]) -> f64 {
        grid.iter()
            .map(|&t| self.before(t).abs().max(self.after(t).abs()))
            .fold(0.0, f64::max)
    }
}

/// max |a − b| with its time, and √(∫(a − b)² dt / T).
pub(super) fn difference_norms(a: &Curve, b: &Curve, grid: &[f64], at: At) -> (f64, f64, f64) {
    let (mut max, mut max_time) = (0.0, grid[0]);
    let mut integral = 0.0;
    let mut previous: Option<(f64, f64)> = None;
    for &t in grid {
        let (a, b) = ((a.before(t), a.after(t)), (b.before(t), b.after(t)));
        let (mut left, mut right) = (a.0 - b.0, a.1 - b.1);
        let single = match at {
            At::AllRows => false,
            At::FirstRows => a.0 == a.1,
            At::ReferenceRows => b.0 == b.1,
        };
        if single {
            let nearer = if left.abs() < right.abs() {
                left
            } else {
                right
            };
            (left, right) = (nearer, nearer);
        }
        let here = left.abs().max(right.abs());
        if here > max {
            (max, max_time) = (here, t);
        }
        if let Some((t0, d)) = previous {
            integral += (t - t0) * (d * d + d * left + left * left) / 3.0;
        }
        previous = Some((t, right));
    }
    let span = grid[grid.len() - 1] - grid[0];
    (
        max,
        max_time,
        if span > 0.0 {
            (integral / span).sqrt()
        } else {
            max
        },
    )
}

/// The largest distance of `a(t)` from the range of `b` on [t − shift, t + shift] over the grid, and its time.
pub(super) fn tube_distance(a: &Curve, b: &Curve, grid: &[f64], shift: f64) -> (f64, f64) {
    let (mut worst, mut worst_time) = (0.0, grid[0]);
    let (mut lows, mut highs) = (VecDeque::<usize>::new(), VecDeque::<usize>::new());
    let mut next = 0;
    for &t in grid {
        let (start, end) = (t - shift, t + shift);
        while next < b.time.len() && b.time[next] <= end {
            let value = b.values[next];
            while lows.back().is_some_and(|&k| b.values[k] >= value) {
                lows.pop_back();
            }
            while highs.back().is_some_and(|&k| b.values[k] <= value) {
                highs.pop_back();
            }
            lows.push_back(next);
            highs.push_back(next);
            next += 1;
        }
        while lows.front().is_some_and(|&k| b.time[k] < start) {
            lows.pop_front();
        }
        while highs.front().is_some_and(|&k| b.time[k] < start) {
            highs.pop_front();
        }
        let ends = [b.before(start), b.after(start), b.before(end), b.after(end)];
        let low = lows
            .front()
            .map(|&k| b.values[k])
            .into_iter()
            .chain(ends)
            .fold(f64::INFINITY, f64::min);
        let high = highs
            .front()
            .map(|&k| b.values[k])
            .into_iter()
            .chain(ends)
            .fold(f64::NEG_INFINITY, f64::max);
        for value in [a.before(t), a.after(t)] {
            let distance = (low - value).max(value - high);
            if distance > worst {
                (worst, worst_time) = (distance, t);
            }
        }
    }
    (worst, worst_time)
}
