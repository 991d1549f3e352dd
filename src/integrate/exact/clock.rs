//! Switches controlled by straight sources alone: when they move is known before the run, and no guard watches them.

use crate::circuit::Source;
use crate::circuit::source::Straight;
use crate::integrate::switching::{Known, Threshold};
use crate::mna::SourceControl;
use crate::settings::tolerances::events::CONTROL_ROUNDINGS;
use crate::settings::tolerances::times::SAME_TIME;

/// What rounding leaves of a sum of terms of this size.
fn rounding_of(size: f64) -> f64 {
    CONTROL_ROUNDINGS * f64::EPSILON * size
}

/// A control at one time and as it goes on.
struct Course {
    /// Where the first of its pieces ends, s.
    end: f64,
    value: f64,
    slope: f64,
    /// What the value, with the resolution of its time, and the slope are summed from.
    size: f64,
    steepness: f64,
}

impl Course {
    /// Whether a switch leaves position `on` with it.
    fn leaves(&self, threshold: &Threshold, on: bool) -> bool {
        let known = |value, size| Known {
            value,
            noise: rounding_of(size),
        };
        threshold.leaves(
            on,
            known(self.value, self.size),
            known(self.slope, self.steepness),
        )
    }
}

/// A switch whose control is a constant plus multiples of straight sources.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Clock {
    /// The switch.
    pub(crate) switch: usize,
    constant: f64,
    /// Input, factor, present piece.
    terms: Vec<(usize, f64, Straight)>,
    /// When the switch next moves, s.
    pub(crate) next: f64,
    /// The position in which `next` was found.
    on: bool,
}

impl Clock {
    /// The clock of a control, with its sources at t. `None` where a source has no closed form.
    pub(crate) fn new(control: SourceControl, sources: &[Source], t: f64) -> Option<Self> {
        let SourceControl {
            switch,
            constant,
            terms,
        } = control;
        let terms = terms
            .into_iter()
            .map(|(input, factor)| Some((input, factor, sources[input].wave.line(t)?)))
            .collect::<Option<_>>()?;
        Some(Self {
            switch,
            constant,
            terms,
            next: f64::NEG_INFINITY,
            on: false,
        })
    }

    /// The inputs that its control follows.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = usize> {
        self.terms.iter().map(|(input, ..)| *input)
    }

    /// Goes to time t, forwards or backwards.
    #[inline(never)]
    pub(crate) fn stand_at(&mut self, sources: &[Source], t: f64) {
        self.next = f64::NEG_INFINITY;
        for (input, _, line) in &mut self.terms {
            if let Some(there) = sources[*input].wave.line(t) {
                *line = there;
            }
        }
    }

    /// The control on the present pieces, from t on.
    fn course(&self, t: f64) -> Course {
        let mut course = Course {
            end: f64::INFINITY,
            value: 0.0,
            slope: 0.0,
            size: self.constant.abs(),
            steepness: 0.0,
        };
        for (_, factor, line) in &self.terms {
            let (slope, since) = (factor * line.slope, t - line.origin);
            course.value += factor * (line.first + line.slope * since);
            course.slope += slope;
            course.size += (factor * line.first).abs() + (slope * since).abs();
            course.steepness += slope.abs();
            course.end = course.end.min(line.end);
        }
        course.value += self.constant;
        course.size += course.steepness * t.abs();
        course
    }

    /// Whether the switch leaves position `on` right after t on the present pieces.
    pub(crate) fn leaves(&self, threshold: &Threshold, on: bool, t: f64) -> bool {
        self.course(t).leaves(threshold, on)
    }

    /// Finds when the switch next moves after t, if that is not known; nothing matters after `until`.
    pub(crate) fn look_ahead(
        &mut self,
        threshold: &Threshold,
        on: bool,
        (t, until): (f64, f64),
        sources: &[Source],
    ) {
        if self.next > t && self.on == on {
            return;
        }
        // The pieces stand where the last move was expected.
        if (t - self.next).abs() > SAME_TIME * t.abs() {
            self.stand_at(sources, t);
        }
        self.on = on;
        self.next = self.first_move(threshold, (t, until), sources);
    }

    /// The next move of the switch from the pieces at t on.
    fn first_move(
        &mut self,
        threshold: &Threshold,
        (mut t, until): (f64, f64),
        sources: &[Source],
    ) -> f64 {
        let mut moved = false;
        loop {
            let course = self.course(t);
            if moved && course.leaves(threshold, self.on) {
                return t;
            }
            moved = true;
            let (end, value, slope) = (course.end, course.value, course.slope);
            if end > t {
                // Pieces of one slope leave a rounding of it.
                let flat = rounding_of(course.steepness);
                let (level, towards) = if self.on {
                    (threshold.off_below, slope < -flat)
                } else {
                    (threshold.on_above, slope > flat)
                };
                if towards {
                    let passage = t + ((level - value) / slope).max(0.0);
                    if passage < end {
                        return passage;
                    }
                }
                t = end;
            }
            // An edge on the last row is due there, on whichever side of it rounding has put the time.
            if t > until + SAME_TIME * until.abs() {
                return f64::INFINITY;
            }
            for (input, _, line) in &mut self.terms {
                if line.end <= t {
                    match sources[*input].wave.line_after(line, t) {
                        Some(next) if next.end > t => *line = next,
                        // A piece too short for the resolution of t.
                        _ => line.end = t.next_up(),
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::circuit::source::Wave;

    fn pulse() -> Vec<Source> {
        let wave = Wave::Pulse {
            v1: 0.0,
            v2: 1.0,
            delay: 1.0,
            rise: 0.5,
            fall: 0.0,
            width: 2.0,
            period: 5.0,
            count: None,
        };
        vec![Source { dc: 0.0, wave }]
    }

    /// The times at which a clock moves a switch with this threshold, and its position before the first.
    fn moves(sources: &[Source], level: f64) -> (bool, Vec<f64>) {
        let threshold = Threshold {
            name: "s".into(),
            on_above: level,
            off_below: level,
            latch: None,
        };
        let control = SourceControl {
            switch: 0,
            constant: 0.0,
            terms: vec![(0, 1.0)],
        };
        let mut clock = Clock::new(control, sources, 0.0).unwrap();
        let first = clock.leaves(&threshold, false, 0.0);
        let (mut t, mut on, mut moves) = (0.0, first, Vec::new());
        loop {
            clock.look_ahead(&threshold, on, (t, 12.0), sources);
            if clock.next == f64::INFINITY {
                return (first, moves);
            }
            (t, on) = (clock.next, !on);
            moves.push(t);
        }
    }

    #[test]
    fn a_gate_at_rest_on_the_threshold_is_off_and_one_that_touches_it_stays() {
        // Falls at 3.5 to rest on 0, rises from it at 1.
        assert_eq!(
            moves(&pulse(), 0.0),
            (false, vec![1.0, 3.5, 6.0, 8.5, 11.0])
        );
        let triangle = Wave::Pulse {
            v1: 1.0,
            v2: 0.0,
            delay: 0.0,
            rise: 1.0,
            fall: 1.0,
            width: 0.0,
            period: 2.0,
            count: None,
        };
        let triangle = vec![Source {
            dc: 0.0,
            wave: triangle,
        }];
        assert_eq!(moves(&triangle, 0.0), (true, vec![]));
        assert_eq!(moves(&triangle, 1.0), (false, vec![]));
    }

    #[test]
    fn a_pulse_moves_its_switch_twice_a_period() {
        let sources = pulse();
        let threshold = Threshold {
            name: "s".into(),
            on_above: 0.5,
            off_below: 0.5,
            latch: None,
        };
        let control = SourceControl {
            switch: 0,
            constant: 0.0,
            terms: vec![(0, 1.0)],
        };
        let mut clock = Clock::new(control, &sources, 0.0).unwrap();
        let (mut t, mut on, mut moves) = (0.0, false, Vec::new());
        loop {
            clock.look_ahead(&threshold, on, (t, 12.0), &sources);
            // Asked again it stays.
            clock.look_ahead(&threshold, on, (t + 0.1, 12.0), &sources);
            if clock.next == f64::INFINITY {
                break;
            }
            (t, on) = (clock.next, !on);
            moves.push(t);
        }
        assert_eq!(moves, [1.25, 3.5, 6.25, 8.5, 11.25]);
        // From another position at another time.
        clock.stand_at(&sources, 2.0);
        assert_eq!(clock.course(2.0).value, 1.0);
        clock.look_ahead(&threshold, true, (2.0, 12.0), &sources);
        assert_eq!(clock.next, 3.5);
    }
}
