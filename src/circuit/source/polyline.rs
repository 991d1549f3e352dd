//! Straight lines through corner points, repeated with a period: `PULSE` and `PWL`.

use super::Side;
use super::piece::{Piece, Segment};
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
    pub(super) fn segment(&self, t: f64, side: Side) -> Segment {
        let Some(&(_, initial)) = self.points.first() else {
            return Segment::constant(0.0, f64::NEG_INFINITY, f64::INFINITY);
        };
        if !side.before(t, self.stop) {
            return Segment::constant(initial, self.stop, f64::INFINITY);
        }
        let mut segment = self.unstopped(t, side, initial);
        if segment.piece.end > self.stop {
            segment.piece.end = self.stop;
            segment.last = segment.piece.value(self.stop);
        }
        segment
    }

    fn unstopped(&self, t: f64, side: Side, initial: f64) -> Segment {
        let number = self.lap(t, side);
        let begin = if number > 0.0 {
            self.laps.map_or(0, |(from, _)| from)
        } else {
            0
        };
        let lap = self.on_axis(number);
        let passed = self.passed(&lap, begin, t, side);
        if passed == begin {
            return Segment::constant(initial, f64::NEG_INFINITY, lap.time(&self.points[begin]));
        }
        let point = self.points[passed - 1];
        let (start, (_, first)) = (lap.time(&point), point);
        let Some(next) = self.points.get(passed) else {
            return Segment::constant(first, start, f64::INFINITY);
        };
        let (end, (_, last)) = (lap.time(next), *next);
        let slope = (last - first) / (end - start);
        Segment {
            piece: Piece::line(start, end, start, first, slope),
            first,
            last,
        }
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

    /// The lap `t` falls into, from 0.
    fn lap(&self, t: f64, side: Side) -> f64 {
        let Some((from, period)) = self.laps else {
            return 0.0;
        };
        // The quotient may be one off for rounding, never more; beyond 2^53 laps k + 1 = k.
        let guess = ((t - self.offset - self.points[from].0) / period) as i64;
        let mut lap = guess.saturating_sub(1).max(0) as f64;
        for _ in 0..3 {
            if side.before(t, self.on_axis(lap).next) {
                break;
            }
            lap += 1.0;
        }
        lap
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
