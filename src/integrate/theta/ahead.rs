//! From corner to corner of the sources and from switching to switching, where steps follow their error alone; see
//! [`embedded`](super::embedded).

use super::*;
use crate::settings::tolerances::stated::FINER_AND_COARSER;
use crate::settings::tolerances::steps::{ASKED_AHEAD, CUT, FIRST, SINE_EMBEDDED};
use crate::settings::tolerances::times::WHOLE;

/// The next stop of the steps.
#[derive(Debug, Default)]
pub(super) struct Ahead {
    /// Whether it was looked for since the last one.
    pub(super) known: bool,
    /// The next corner of a source, s.
    breakpoint: f64,
    /// Up to where switches that sources drive were asked, s; the first that moves, s, and which do.
    asked: f64,
    passage: f64,
    moving: Vec<usize>,
}

impl Theta {
    /// One step towards t at most, or beyond it where rows are read from dense output, and what happens at its end.
    pub(super) fn stride(&mut self, t: f64, log: &mut Log) -> Result<(), Error> {
        let until = match self.smooth.until {
            Some(until) => {
                log.hold_rows();
                until
            }
            None => t,
        };
        self.look_ahead();
        let Ahead {
            breakpoint,
            passage,
            ..
        } = self.smooth.ahead;
        let slack = Self::slack(until);
        let merged = (until - breakpoint).abs() <= slack;
        let limit = if merged {
            breakpoint.max(until)
        } else {
            breakpoint.min(until)
        };
        let early = passage < limit - Self::slack(limit);
        let stop = if early {
            passage
        } else if merged {
            until
        } else {
            limit
        };
        log.go_on(self.now.t)?;
        let position = self.switches.position();
        let before = (!self.smooth.ahead.moving.is_empty()).then(|| position.to_vec());
        let switched = self.chosen_step(stop, log)?;
        if switched {
            self.smooth.ahead.known = false;
        }
        if self.now.t < stop || log.pauses() && switched {
            return Ok(());
        }
        let at_passage = early || (passage - stop).abs() <= Self::slack(stop);
        let mut moving = if at_passage {
            std::mem::take(&mut self.smooth.ahead.moving)
        } else {
            Vec::new()
        };
        if let Some(before) = before {
            // What moved with another switch that passed its threshold there has moved.
            let position = self.switches.position();
            moving.retain(|&i| position[i] == before[i]);
        }
        let at_breakpoint = !early && (breakpoint - stop).abs() <= Self::slack(stop);
        if at_breakpoint || at_passage {
            self.smooth.ahead.known = false;
        }
        if at_breakpoint {
            self.edge(breakpoint.max(stop), log)?;
            let here = (self.now.t, Self::slack(self.now.t));
            let lcs = &self.system().lcs;
            (self.switches).add_late(lcs, &self.inputs, here, &mut moving);
        }
        if !moving.is_empty() {
            self.inputs
                .right_of_silent(passage.max(stop), &mut self.now.u);
        }
        if !moving.is_empty() || at_breakpoint && self.asked()? {
            self.switch(&moving, log)?;
            self.smooth.ahead.known = false;
        }
        Ok(())
    }

    /// Looks for the next corner of a source and the next switch that sources move, as far as the next step may reach.
    fn look_ahead(&mut self) {
        let now = self.now.t;
        if !self.smooth.ahead.known {
            let ahead = &mut self.smooth.ahead;
            ahead.known = true;
            ahead.breakpoint = self.inputs.next_corner(now);
            ahead.asked = now;
            ahead.passage = f64::INFINITY;
            ahead.moving.clear();
        }
        let reach = self.longest_step().min(self.preferred);
        let ahead = &mut self.smooth.ahead;
        if ahead.passage.is_finite() || ahead.asked >= (now + reach).min(ahead.breakpoint) {
            return;
        }
        let limit = (now + ASKED_AHEAD * reach).min(ahead.breakpoint);
        let lcs = &self.plant.systems[self.now.system].1.lcs;
        let slack = Self::slack(limit);
        let found = (self.switches).next_known(lcs, &self.inputs, ahead.asked, limit, slack);
        (ahead.passage, ahead.moving) = found;
        ahead.asked = limit;
    }

    fn longest_step(&self) -> f64 {
        let mut longest = SINE_EMBEDDED * self.inputs.largest_step();
        if self.smooth.until.is_none() {
            // Where rows are read from dense output a longest step is a question of rows.
            longest = longest.min(self.longest);
        }
        if self.whole {
            // A coarser run whose steps the sources limit as those of the run would see no error.
            longest *= FINER_AND_COARSER[1];
        }
        match self.stepping {
            // A switch that slides follows at the ends of steps.
            Stepping::Controlled { first, .. } if self.switches.chattering(CHATTER) => {
                longest.min(first / FIRST)
            }
            _ => longest,
        }
    }

    /// The length of the next step and its end, which times tell from now: whole lengths, the rest before a stop in one or two.
    fn next_step(&mut self, stop: f64) -> (f64, f64) {
        let now = self.now.t;
        let (rest, slack) = (stop - now, Self::slack(now));
        let h = self.preferred.min(self.longest_step()).max(slack);
        self.smooth.cut = false;
        if rest <= h * (1.0 + WHOLE) {
            // A coarser run makes it whole.
            let cut = !self.whole && rest < CUT * h && self.smooth.uncut != stop;
            self.smooth.cut = cut;
            if self.whole || cut || self.smooth.halved == stop || rest <= 2.0 * slack {
                return (rest, stop);
            }
            self.smooth.halved = stop;
            (0.5 * rest, now + 0.5 * rest)
        } else if rest < 2.0 * h {
            (0.5 * rest, now + 0.5 * rest)
        } else {
            (h, now + h)
        }
    }

    /// A step that is accepted, up to `stop` at most, with all its consequences; whether a switch moved at its end.
    fn chosen_step(&mut self, stop: f64, log: &mut Log) -> Result<bool, Error> {
        let mut impulse = false;
        let (mut h, mut t1) = self.next_step(stop);
        loop {
            let smallest = self.control.as_ref().map_or(0.0, Control::smallest);
            let last_chance = h <= smallest.max(Self::slack(t1));
            if self
                .embedded(t1, (last_chance, last_chance), &mut impulse)?
                .accept
            {
                break;
            }
            self.stats.rejected += 1;
            (h, t1) = self.next_step(stop);
        }
        self.report(log);
        let switches = self.asked()?;
        if switches {
            self.switch(&[], log)?;
        } else {
            self.switches.forget_chatter();
        }
        if impulse {
            self.now.settle = true;
        }
        self.report(log);
        Ok(switches)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::dvector;

    use crate::integrate::fixtures;
    use crate::integrate::step::Scheme;
    use crate::integrate::theta::Stepping;
    use crate::integrate::theta::tests::stepper;

    /// Errors that ask for steps shorter than times tell apart have them as short as times do.
    #[test]
    fn a_step_ends_later_than_it_begins() {
        let stepping = Stepping::Controlled {
            span: 1.0,
            first: 1e-3,
        };
        let lcs = fixtures::rlcd();
        let mut theta = stepper(&lcs, dvector![10.0, 0.0], Scheme::MIDPOINT, stepping);
        theta.now.t = 1.0;
        for stop in [1.0 + f64::EPSILON, 1.0 + 20.0 * f64::EPSILON, 2.0] {
            for preferred in [0.0, 1e-30, 1e-17, f64::EPSILON, 0.1] {
                (theta.preferred, theta.smooth.halved) = (preferred, f64::NEG_INFINITY);
                let (h, end) = theta.next_step(stop);
                assert!(h > 0.0 && 1.0 < end && end <= stop, "{h:e} to {end:e}");
            }
        }
    }
}
