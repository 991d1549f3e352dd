//! Straight lines through corner points, repeated with a period: `PULSE` and `PWL`.

use super::Side;
use super::piece::{Segment, Straight};
use crate::settings::tolerances::times::SAME_TIME;

/// Corner points (time, value), shifted, repeated and stopped.
pub(super) struct Polyline<'a> {
    points: &'a [(f64, f64)],
    offset: f64,
    /// (point where a lap begins, its length): lap k ≥ 1 runs through `points[from..]` shifted by k·period.
    laps: Option<(usize, f64)>,
    /// The first value again from this time on.
    stop: f64,
}

/// The corners of one period of a pulse, (0, v1) to (period, ·); a pulse longer than its period is cut.
pub(super) fn pulse_corners(
    v1: f64,
    v2: f64,
    rise: f64,
    fall: f64,
    width: f64,
    period: f64,
) -> [(f64, f64); 5] {
    let mut corners = [
        (0.0, v1),
        (rise, v2),
        (rise + width, v2),
        (rise + width + fall, v1),
        (period, v1),
    ];
    if period <= 0.0 || !period.is_finite() {
        corners[4].0 = corners[3].0;
        return corners;
    }
    if corners[3].0 < period * (1.0 - SAME_TIME) {
        return corners;
    }
    for k in 1..5 {
        let (before, corner) = (corners[k - 1], corners[k]);
        if corner.0 > period * (1.0 + SAME_TIME) {
            let cut =
                before.1 + (corner.1 - before.1) * ((period - before.0) / (corner.0 - before.0));
            corners[k..].fill((period, cut));
            break;
        }
        if corner.0 >= period * (1.0 - SAME_TIME) {
            corners[k].0 = period;
        }
    }
    corners
}

/// One lap on the axis of time.
struct Lap {
    /// Where time 0 of the points is, s.
    begin: f64,
    /// Where the next lap begins, s.
    next: f64,
    /// The points from here on are the first of the next lap, s.
    whole: f64,
}

impl Lap {
    /// Time of a point.
    fn time(&self, &(at, _): &(f64, f64)) -> f64 {
        let time = self.begin + at;
        if at >= self.whole || time > self.next {
            self.next
        } else {
            time
        }
    }
}

impl<'a> Polyline<'a> {
    pub(super) fn pulse(
        corners: &'a [(f64, f64); 5],
        delay: f64,
        period: f64,
        count: Option<f64>,
    ) -> Self {
        let laps = (period > 0.0 && period.is_finite()).then_some((0, period));
        let stop = match (count, laps) {
            (Some(count), Some(_)) => delay + count * period,
            _ => f64::INFINITY,
        };
        Self {
            points: corners,
            offset: delay,
            laps,
            stop,
        }
    }

    /// Repeats from the point at time `repeat`; from the first point after it if no point stands there.
    pub(super) fn pwl(points: &'a [(f64, f64)], repeat: Option<f64>, delay: f64) -> Self {
        let laps = repeat.and_then(|repeat| {
            let from = points.partition_point(|point| point.0 < repeat);
            let period = points.last()?.0 - points.get(from)?.0;
            (period > 0.0).then_some((from, period))
        });
        Self {
            points,
            offset: delay,
            laps,
            stop: f64::INFINITY,
        }
    }

    /// Lap `k` on the axis of time.
    fn on_axis(&self, k: f64) -> Lap {
        let Some((from, period)) = self.laps else {
            return Lap {
                begin: self.offset,
                next: f64::INFINITY,
                whole: f64::INFINITY,
            };
        };
        Lap {
            begin: self.offset + k * period,
            next: (self.offset + (k + 1.0) * period) + self.points[from].0,
            whole: self.points[self.points.len() - 1].0,
        }
    }

    /// The segment around `t`.
    #[inline(never)]
    pub(super) fn straight(&self, t: f64, side: Side) -> Straight {
        let Some(&(_, initial)) = self.points.first() else {
            return Straight::constant(0.0, f64::NEG_INFINITY, f64::INFINITY);
        };
        if !side.before(t, self.stop) {
            return Straight::constant(initial, self.stop, f64::INFINITY);
        }
        let (number, lap) = self.lap(t, side);
        let passed = self.passed(&lap, self.begin(number), t, side);
        self.between((number, &lap), passed, initial)
    }

    /// The segment right after `t`, which is not before `line`: mostly the next one.
    pub(super) fn go_on(&self, line: &Straight, t: f64) -> Straight {
        let (mut number, mut passed) = (line.lap, line.next);
        let mut lap = self.on_axis(number);
        if t >= lap.next {
            number += 1.0;
            (lap, passed) = (self.on_axis(number), self.begin(number));
        }
        let (Some(&(_, initial)), true) = (self.points.first(), t < lap.next && t < self.stop)
        else {
            return self.straight(t, Side::Right);
        };
        let later = self.points[passed..].iter();
        passed += later.take_while(|point| t >= lap.time(point)).count();
        self.between((number, &lap), passed, initial)
    }

    /// The point where a lap begins.
    fn begin(&self, lap: f64) -> usize {
        if lap > 0.0 {
            self.laps.map_or(0, |(from, _)| from)
        } else {
            0
        }
    }

    /// The segment of a lap that ends at a point.
    fn between(&self, (number, lap): (f64, &Lap), next: usize, initial: f64) -> Straight {
        let mut line = if next == self.begin(number) {
            Straight::constant(initial, f64::NEG_INFINITY, lap.time(&self.points[next]))
        } else {
            let point = self.points[next - 1];
            let (start, (_, first)) = (lap.time(&point), point);
            match self.points.get(next) {
                None => Straight::constant(first, start, f64::INFINITY),
                Some(point) => {
                    let (end, last) = (lap.time(point), point.1);
                    Straight {
                        end,
                        slope: (last - first) / (end - start),
                        last,
                        ..Straight::constant(first, start, end)
                    }
                }
            }
        };
        (line.lap, line.next) = (number, next);
        if line.end > self.stop {
            self.end(&mut line);
        }
        line
    }

    /// Ends a segment where the lines stop.
    #[cold]
    #[inline(never)]
    fn end(&self, line: &mut Straight) {
        line.end = self.stop;
        line.last = Segment::from(*line).piece.value(self.stop);
    }

    /// Index after the last point of the lap that `t` has passed.
    fn passed(&self, lap: &Lap, begin: usize, t: f64, side: Side) -> usize {
        // Unlike `partition_point` with branches: the answer is mostly the one before.
        let (mut low, mut high) = (begin, self.points.len());
        while low < high {
            let middle = (low + high) / 2;
            if side.before(t, lap.time(&self.points[middle])) {
                high = middle;
            } else {
                low = middle + 1;
            }
        }
        low
    }

    /// The lap `t` falls into, and its number, from 0.
    fn lap(&self, t: f64, side: Side) -> (f64, Lap) {
        let Some((from, period)) = self.laps else {
            return (0.0, self.on_axis(0.0));
        };
        // The quotient may be one off for rounding, never more; beyond 2^53 laps k + 1 = k.
        let guess = ((t - self.offset - self.points[from].0) / period) as i64;
        let mut number = guess.saturating_sub(1).max(0) as f64;
        let mut lap = self.on_axis(number);
        for _ in 0..3 {
            if side.before(t, lap.next) {
                break;
            }
            number += 1.0;
            lap = self.on_axis(number);
        }
        (number, lap)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From one end to the next, over any number of them, and to times in between.
    #[test]
    fn going_on_finds_what_a_search_finds() {
        let corners = pulse_corners(0.0, 1.0, 1e-8, 1e-8, 5.8e-6, 1e-5);
        let points = [(0.0, 1.0), (1e-6, 2.0), (1e-6, 0.5), (3e-6, -1.0)];
        for line in [
            Polyline::pulse(&corners, 0.0, 1e-5, None),
            Polyline::pulse(&corners, 3.3e-6, 1e-5, Some(7.0)),
            Polyline::pulse(&corners, 1.0, 0.0, None),
            Polyline::pwl(&points, None, 2e-6),
            Polyline::pwl(&points, Some(1e-6), 2e-6),
        ] {
            let mut here = line.straight(0.0, Side::Right);
            for k in 0..1000 {
                let end = here.end.min(1e-3);
                for t in [end, end.next_up(), end + 1e-7, end + 3e-6, end + 3.3e-5] {
                    assert_eq!(
                        line.go_on(&here, t),
                        line.straight(t, Side::Right),
                        "{k} {t}"
                    );
                }
                here = line.go_on(&here, end);
            }
        }
    }

    /// Late on the axis of time a corner shortly before the end of its lap may round to beyond it.
    #[test]
    fn no_corner_stands_beyond_the_next_lap() {
        let lap = Lap {
            begin: 1.0,
            next: 1.5,
            whole: 0.5 + 2.0 * f64::EPSILON,
        };
        assert_eq!(lap.time(&(0.25, 0.0)), 1.25);
        assert_eq!(lap.time(&(0.5 + f64::EPSILON, 0.0)), 1.5);
        assert_eq!(lap.time(&(lap.whole, 0.0)), 1.5);
    }
}
