//! How far two runs of one circuit differ: the comparison of a run with its companions, and with the run that verifies it.
//!
//! Rows of the output grid are compared column by column, relative to what the column reaches in either direction. Where a device or switch has
//! changed in one run and follows in the other before the next row, the row between differs by a jump that is only shifted: an error of
//! the event's time. A change that does not follow is an error of the values.

use std::collections::VecDeque;

use crate::integrate::event::{Change, Event};
use crate::settings::tolerances::steps::FAINT;

/// Takes the magnitudes of a row into account; what is no number has none.
#[inline]
pub(crate) fn grow(amplitude: &mut [f64], row: &[f64]) {
    let raise = |amplitude: &mut f64, value: f64| {
        // As `f64::max`, in one instruction.
        let size = value.abs();
        *amplitude = if size > *amplitude { size } else { *amplitude };
    };
    let (pairs, last) = amplitude.as_chunks_mut::<2>();
    let (values, rest) = row.as_chunks::<2>();
    for ([a, b], [v, w]) in pairs.iter_mut().zip(values) {
        raise(a, *v);
        raise(b, *w);
    }
    if let ([a], [v]) = (last, rest) {
        raise(a, *v);
    }
}

/// What columns of these units are related to, from the largest |value| of each.
pub(crate) fn scales(amplitude: &[f64], units: &[&'static str]) -> Vec<f64> {
    let of = amplitude.iter().zip(units);
    let largest = |unit: &str| {
        let same = of.clone().filter(|(_, other)| **other == unit);
        same.fold(0.0_f64, |m, (a, _)| m.max(*a))
    };
    let scale = |(a, unit): (&f64, &&str)| a.max(FAINT * largest(unit));
    of.clone().map(scale).collect()
}

/// Times of a change in one run that the other has not made yet.
#[derive(Debug)]
struct Ahead {
    change: Change,
    /// Whether they are of the first run.
    first: bool,
    times: VecDeque<f64>,
}

/// How far the rows of two runs differ, and how far their events; see the [module](self).
#[derive(Debug, Default)]
pub(crate) struct Difference {
    ahead: Vec<Ahead>,
    /// The largest shift of an event, s.
    shift: f64,
    /// An event that is shifted by more, s, excuses no row.
    excused: f64,
    /// The largest |difference| of every column, its time, s, and the sum of squares.
    worst: Vec<f64>,
    at: Vec<f64>,
    squares: Vec<f64>,
    rows: u32,
    /// The time of the last row, s, if it stood between an event in one run and in the other; its differences.
    doubtful: Option<f64>,
    held: Vec<f64>,
    /// The event that the last row stood behind has followed too late.
    late: bool,
}

impl Difference {
    /// Of rows of so many columns; events may be shifted by `excused`, s.
    pub(crate) fn new(columns: usize, excused: f64) -> Self {
        Self {
            excused,
            worst: vec![0.0; columns],
            at: vec![0.0; columns],
            squares: vec![0.0; columns],
            held: vec![0.0; columns],
            ..Self::default()
        }
    }

    /// Takes note of an event of the first or the second run.
    pub(crate) fn see(&mut self, event: &Event, first: bool) {
        for change in event.changes.iter() {
            let known = self.ahead.iter_mut().find(|ahead| ahead.change == *change);
            match known {
                Some(ahead) if ahead.first != first && !ahead.times.is_empty() => {
                    if let Some(t) = ahead.times.pop_front() {
                        let shift = (event.t - t).abs();
                        self.shift = self.shift.max(shift);
                        self.late |= shift > self.excused;
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
    pub(crate) fn compare(&mut self, t: f64, first: &[f64], second: &[f64]) {
        if let Some(before) = self.doubtful.take() {
            // What has not followed by now does not.
            let mut lasts = self.late;
            for ahead in &mut self.ahead {
                while ahead.times.front().is_some_and(|t| *t <= before) {
                    ahead.times.pop_front();
                    lasts = true;
                }
            }
            if lasts {
                self.take(before);
            }
        }
        self.late = false;
        for (held, (a, b)) in self.held.iter_mut().zip(first.iter().zip(second)) {
            *held = (a - b).abs();
        }
        if self.ahead.iter().any(|ahead| !ahead.times.is_empty()) {
            self.doubtful = Some(t);
        } else {
            self.take(t);
        }
    }

    /// The differences that are held, of the row at `t`, count.
    fn take(&mut self, t: f64) {
        let sums = self
            .worst
            .iter_mut()
            .zip(&mut self.at)
            .zip(&mut self.squares);
        for (((worst, at), squares), d) in sums.zip(&self.held) {
            // What is no number is no small difference.
            let d = if d.is_nan() { f64::INFINITY } else { *d };
            if d > *worst {
                (*worst, *at) = (d, t);
            }
            *squares += d * d;
        }
        self.rows += 1;
    }

    /// The last row counts if nothing has followed its event.
    fn close(&mut self) {
        if let Some(t) = self.doubtful.take() {
            self.take(t);
        }
    }

    /// How many rows were compared.
    pub(crate) fn rows(&self) -> u32 {
        self.rows
    }

    /// The largest shift of an event, s.
    pub(crate) fn shift(&self) -> f64 {
        self.shift
    }

    /// The largest difference of a column over its scale, and the largest root mean square.
    pub(crate) fn over(&mut self, scales: &[f64]) -> (f64, f64) {
        self.close();
        let count = f64::from(self.rows.max(1));
        let means = self.squares.iter().map(|s| (s / count).sqrt());
        let largest = self.worst.iter().zip(scales);
        (
            largest.map(|(d, s)| relative(*d, *s)).fold(0.0, f64::max),
            means
                .zip(scales)
                .map(|(d, s)| relative(d, *s))
                .fold(0.0, f64::max),
        )
    }

    /// The largest difference of every column over its scale, and its time, s.
    pub(crate) fn columns(&mut self, scales: &[f64]) -> Vec<(f64, f64)> {
        self.close();
        let columns = self.worst.iter().zip(&self.at).zip(scales);
        columns.map(|((d, t), s)| (relative(*d, *s), *t)).collect()
    }
}

fn relative(difference: f64, scale: f64) -> f64 {
    if difference > 0.0 {
        difference / scale
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::event::conducts;

    #[test]
    fn a_row_between_an_event_and_its_shifted_self_is_an_error_of_time() {
        let mut found = Difference::new(1, f64::INFINITY);
        found.see(&conducts("d1", 0.9), true);
        found.compare(1.0, &[5.0], &[0.0]);
        found.see(&conducts("d1", 1.2), false);
        found.compare(2.0, &[5.0], &[5.5]);
        assert!((found.shift - 0.3).abs() < 1e-15);
        assert_eq!(found.over(&[10.0]), (0.05, 0.05));
    }

    #[test]
    fn a_change_that_the_other_run_does_not_make_is_an_error_of_the_values() {
        let mut found = Difference::new(1, f64::INFINITY);
        found.see(&conducts("d1", 0.9), true);
        found.compare(1.0, &[5.0], &[0.0]);
        found.compare(2.0, &[5.0], &[4.0]);
        assert_eq!(found.shift, 0.0);
        assert_eq!(found.over(&[10.0]).0, 0.5);
        assert!(found.over(&[0.0]).0.is_infinite());
    }

    #[test]
    fn an_event_that_follows_too_late_excuses_no_row() {
        for (excused, expected) in [(0.5, 0.05), (0.1, 0.5)] {
            let mut found = Difference::new(1, excused);
            found.see(&conducts("d1", 0.9), true);
            found.compare(1.0, &[5.0], &[0.0]);
            found.see(&conducts("d1", 1.2), false);
            found.compare(2.0, &[5.0], &[5.5]);
            assert_eq!(found.columns(&[10.0])[0].0, expected);
        }
    }
}
