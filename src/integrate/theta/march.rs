//! From stop to stop in base steps, halved where the error or a switch asks for it.

use super::*;
use crate::integrate::control::Verdict;
use crate::settings::tolerances::jumps::IMPULSE_RATIO;
use crate::settings::tolerances::times::WHOLE;

/// What became of a part of a base step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tried {
    /// It must be halved.
    Halve,
    /// It is done.
    Done,
    /// It is done, and a switch moved at its end.
    Switched,
}

impl Theta {
    /// Advances to `stop`, which no breakpoint lies before; u is the left limit there.
    pub(super) fn interval(&mut self, stop: f64, log: &mut Log) -> Result<(), Error> {
        let (t0, span) = (self.now.t, stop - self.now.t);
        let longest = match self.stepping {
            Stepping::Fixed(h) => h.min(self.longest),
            Stepping::Controlled { .. } => self.longest.min(self.inputs.largest_step()),
        };
        // A quotient within rounding of an integer is that integer.
        let count = (span / longest * (1.0 - WHOLE)).ceil().max(1.0);
        let h = span / count;
        let simple = self.control.is_none() && !self.switches.watch();
        for k in 1..=count as u64 {
            let t1 = if k as f64 == count {
                stop
            } else {
                t0 + span * (k as f64 / count)
            };
            log.go_on(self.now.t)?;
            if simple {
                let h = self.fixed_step(h, t1)?;
                let changed = self.attempt.solved.is_some();
                let impulse = if changed { self.impulse(h)? } else { None };
                self.finish_step(t1, impulse, log)?;
            } else {
                self.divided_step(h, t1, log)?;
            }
            if log.pauses() {
                break;
            }
        }
        self.switches.forget_chatter();
        Ok(())
    }

    /// A step whose length is prescribed, not committed. After an edge or a jump the midpoint rule would swing around what is
    /// faster than the step, undamped; it starts with two halves of Moreau's scheme instead, which are damped and leave it
    /// its order (Rannacher 1984). So does one that is cut short and in which a device changes, whose error a run of other steps would have alike.
    /// Returns the length of the last part.
    fn fixed_step(&mut self, h: f64, t1: f64) -> Result<f64, Error> {
        let damped = self.now.settle && self.starts_damped();
        let whole = self.whole && self.is_cut(h);
        if !damped || whole {
            self.attempt(h, t1)?;
            let may_be_alike = self.scheme.order() == 2 && self.is_cut(h) && self.changes();
            if whole || !may_be_alike {
                return Ok(h);
            }
        }
        let middle = self.now.t + 0.5 * (t1 - self.now.t);
        self.attempt(0.5 * h, middle)?;
        self.commit(middle)?;
        self.now.settle |= damped;
        self.attempt(0.5 * h, t1)?;
        Ok(0.5 * h)
    }

    /// Whether a prescribed step is cut short by a row or an edge so much that it would be the same in a run of steps half as long.
    fn is_cut(&self, h: f64) -> bool {
        matches!(self.stepping, Stepping::Fixed(prescribed) if 2.0 * h <= prescribed)
    }

    /// Whether steps after edges and jumps are Moreau's: those of the midpoint rule with prescribed steps, where error control would not
    /// have it otherwise, and where a device that turned off leaves a current behind that decays faster than the step: error control does
    /// not see it, a blocking resistance does. Other θ and γ are taken as they are.
    pub(super) fn starts_damped(&self) -> bool {
        self.scheme.order() == 2 && (self.control.is_none() || self.damped || self.now.turned_off)
    }

    pub(super) fn finish_step(
        &mut self,
        t1: f64,
        impulse: Option<Vec<f64>>,
        log: &mut Log,
    ) -> Result<(), Error> {
        if let Some(p) = &impulse {
            self.log_spontaneous(t1, p, log);
        }
        self.commit(t1)?;
        if impulse.is_some() {
            self.now.settle = true;
        }
        if !self.pending.is_empty() {
            self.report(log);
        }
        Ok(())
    }

    /// A base step with halving: for the error and to locate state-driven switchings, after which the rest is a base step of its own.
    pub(super) fn divided_step(&mut self, base: f64, end: f64, log: &mut Log) -> Result<(), Error> {
        let finest = (base / 2_f64.powi(self.locate)).max(Self::slack(end));
        let mut base = base;
        while !self.halved_step(base, end, finest, log)? {
            base = end - self.now.t;
        }
        Ok(())
    }

    /// A base step up to its end, or to the first switching: `false`.
    fn halved_step(
        &mut self,
        base: f64,
        end: f64,
        finest: f64,
        log: &mut Log,
    ) -> Result<bool, Error> {
        const WHOLE: u64 = 1 << FINEST;
        let start = self.now.t;
        let mut done = 0;
        while done < WHOLE {
            log.go_on(self.now.t)?;
            let wanted = (base / self.preferred)
                .log2()
                .ceil()
                .clamp(0.0, f64::from(FINEST) - 1.0);
            let aligned = if done == 0 {
                0
            } else {
                FINEST - done.trailing_zeros()
            };
            let mut level = (wanted as u32).max(aligned);
            loop {
                let size = WHOLE >> level;
                let h = base / 2_f64.powi(level as i32);
                let t1 = if done + size == WHOLE {
                    end
                } else {
                    start + base * ((done + size) as f64 / WHOLE as f64)
                };
                match self.tentative(h, t1, level, finest, log)? {
                    Tried::Done => {
                        done += size;
                        break;
                    }
                    Tried::Switched => return Ok(self.now.t == end),
                    Tried::Halve => {
                        self.stats.rejected += 1;
                        let wanted = (base / self.preferred).log2().ceil();
                        level = (level + 1).max(wanted.min(f64::from(FINEST) - 1.0) as u32);
                    }
                }
            }
        }
        Ok(true)
    }

    /// One step of a divided base step: to be halved, or done with all its consequences.
    fn tentative(
        &mut self,
        h: f64,
        t1: f64,
        level: u32,
        finest: f64,
        log: &mut Log,
    ) -> Result<Tried, Error> {
        self.kept.copy_from(&self.now);
        let steps = self.stats.steps;
        let mut last_chance = level + 2 >= FINEST;
        if let Some(control) = &self.control {
            last_chance |= h <= control.smallest();
        }
        let mut impulse = false;
        if !self.advance(h, t1, last_chance, &mut impulse)? {
            self.back(steps);
            return Ok(Tried::Halve);
        }
        let mut tried = Tried::Done;
        let change = if self.switches.watch() {
            self.crossed()?
        } else {
            Demand::None
        };
        if change != Demand::None {
            let may_locate = h > finest && !last_chance && !self.switches.chattering(CHATTER);
            if change == Demand::Passage && may_locate {
                self.locate(finest, steps, &mut impulse, log)?;
                // The right limit is read as behind a step that ends there by itself: in a shorter one what sources move is rounding to the
                // solvers, and a control on its threshold decides nothing.
                self.last_h = h;
            }
            self.report(log);
            self.switch(&[], log)?;
            tried = Tried::Switched;
        }
        if impulse {
            self.now.settle = true;
        }
        if self.control.is_some() {
            let Self {
                amplitudes,
                plant,
                now,
                ..
            } = self;
            amplitudes.see(&plant.systems[now.system].1.lcs, &now.x);
        }
        self.report(log);
        Ok(tried)
    }

    /// Commits a step of h, of prescribed length or, as two halves, if error control accepts it: else `false`.
    fn advance(
        &mut self,
        h: f64,
        t1: f64,
        last_chance: bool,
        impulse: &mut bool,
    ) -> Result<bool, Error> {
        if self.control.is_none() {
            self.preferred = f64::INFINITY;
            self.fixed_step(h, t1)?;
            self.commit(t1)?;
            return Ok(true);
        }
        let steps = self.stats.steps;
        let mut verdict = self.controlled(h, t1, last_chance, impulse)?;
        // The midpoint rule may have rung at what an edge or a jump left behind: the same step once more, damped.
        if !verdict.accept && self.kept.settle && self.scheme.order() == 2 {
            self.back(steps);
            self.damped = true;
            verdict = self.controlled(h, t1, last_chance, impulse)?;
            self.damped = false;
        }
        Ok(verdict.accept || last_chance)
    }

    /// Goes back before a step in which switches passed their thresholds, and again to `finest` after the first of them did. The time is
    /// that of a straight line between the controls' distances at both ends of a bracket, aimed at a little behind the passage
    /// and a little before it in turn; every third time it is the middle.
    fn locate(
        &mut self,
        finest: f64,
        steps: u64,
        impulse: &mut bool,
        log: &mut Log,
    ) -> Result<(), Error> {
        let (mut end, mut beyond) = (self.now.t, self.excess()?);
        self.back(steps);
        let mut before = self.excess()?;
        let (mut low, mut aside) = (self.now.t, finest);
        for count in 0_u32.. {
            let (t0, width) = (self.now.t, end - low);
            let t1 = if width <= 2.0 * finest {
                end
            } else {
                let part = if count % 3 == 2 {
                    0.5
                } else {
                    passage(&before, &beyond)
                };
                low + (part * width + 0.5 * aside).clamp(finest, width - finest)
            };
            self.kept.copy_from(&self.now);
            let steps = self.stats.steps;
            self.advance(t1 - t0, t1, false, impulse)?;
            let excess = self.excess()?;
            if t1 == end {
                break;
            }
            if excess.iter().any(|e| *e > 0.0) {
                (end, beyond, aside) = (t1, excess, -finest);
                self.back(steps);
            } else if excess == before {
                // What moves the controls less than rounding would be lost step by step.
                (low, aside) = (t1, finest);
                self.back(steps);
            } else {
                (low, before, aside) = (t1, excess, finest);
                self.report(log);
            }
        }
        Ok(())
    }

    /// A step of h and two of h/2, the latter committed, and what error control says of their difference.
    fn controlled(
        &mut self,
        h: f64,
        t1: f64,
        last_chance: bool,
        impulse: &mut bool,
    ) -> Result<Verdict, Error> {
        let turned_off = self.now.turned_off;
        let steps = self.stats.steps;
        self.now.unseen.clear();
        self.look_closer(0.5 * h);
        self.attempt(h, t1)?;
        let n = self.now.x.len();
        self.coarse.copy_from_slice(&self.out[..n]);
        let mut changed = Vec::new();
        changed.extend(self.change_on_the_way(h));
        let hidden = self.hidden(h)?;
        let whole = std::mem::take(&mut self.attempt.unseen);
        let middle = self.now.t + 0.5 * (t1 - self.now.t);
        self.attempt(0.5 * h, middle)?;
        changed.extend(self.change_on_the_way(0.5 * h));
        self.keep_first_half();
        self.commit(middle)?;
        unseen::without_smooth(&whole, &mut self.now.unseen);
        self.now.turned_off |= turned_off;
        self.now.settle = self.damped || self.now.turned_off;
        self.attempt(0.5 * h, t1)?;
        let past = self.past_zero(0.5 * h);
        let unseen = self.part_unseen(0.5 * h) * 0.5 * h;
        if last_chance && self.attempt.solved.is_some() {
            *impulse = self.impulse(0.5 * h)?.is_some();
        }
        self.commit(t1)?;
        let behind = self.behind_a_change(0.5 * h, unseen)?;
        for (k, coarse) in self.coarse.iter_mut().enumerate() {
            if (*coarse - self.now.x[k]).abs() <= self.rounding[k] {
                *coarse = self.now.x[k];
            }
        }
        let error = self
            .amplitudes
            .error(&self.system().lcs, &self.coarse, &self.now.x);
        let hidden = [&self.now.unseen, &hidden, &past, &behind].map(|e| self.size_of(e));
        let unseen = hidden.into_iter().fold(0.0, f64::max);
        let judge = |theta: &Self, unseen: f64| match &theta.control {
            Some(control) => control.judge(h, error, unseen),
            None => Verdict {
                accept: true,
                next: h,
            },
        };
        let mut verdict = judge(self, unseen);
        for (h, tried, out) in changed {
            if verdict.accept && !last_chance {
                let hidden = self.hidden_on_the_way(h, (tried, &out))?;
                verdict = judge(self, unseen.max(self.size_of(&hidden)));
            }
        }
        self.preferred = verdict.next;
        if self.whole && (verdict.accept || last_chance) {
            self.back(steps);
            self.attempt(h, t1)?;
            self.commit(t1)?;
        }
        Ok(verdict)
    }

    pub(super) fn back(&mut self, steps: u64) {
        self.now.copy_from(&self.kept);
        self.inputs.lines_mut().back_to(self.now.t);
        self.stats.steps = steps;
        self.pending.clear();
        self.attempt.h = f64::NAN;
    }

    /// Moves pending mode changes into the log, with their rows.
    pub(super) fn report(&mut self, log: &mut Log) {
        for (t, what) in std::mem::take(&mut self.pending) {
            self.stats.events += 1;
            log.event(t, what, false);
            if log.wants_rows() && t == self.now.t {
                self.log_row(log);
            }
        }
    }

    /// Moves pending mode changes into the log where rows are written by the caller.
    pub(super) fn report_quietly(&mut self, log: &mut Log) {
        for (t, what) in self.pending.drain(..) {
            self.stats.events += 1;
            log.event(t, what, false);
        }
    }

    pub(super) fn log_row(&mut self, log: &mut Log) {
        let row = self.row();
        log.row(self.now.t, &row);
    }

    /// Probe values at the present.
    pub(super) fn row(&mut self) -> Vec<f64> {
        let mut row = vec![0.0; self.system().lcs.outputs.names.len()];
        self.read_point(&mut row);
        row
    }

    /// The impulse in the attempted step of a network that may jump by itself, if there is one: p = hλ is compared with that of half the
    /// step from the same state, port by port. A finite λ has half as much there and no part in it; what is left is taken to h = 0.
    /// Passive networks jump only where sources or switches do.
    pub(super) fn impulse(&mut self, h: f64) -> Result<Option<Vec<f64>>, Error> {
        let may = self
            .system()
            .jump
            .as_ref()
            .is_some_and(|jump| !jump.monotone);
        if !may {
            return Ok(None);
        }
        let whole: Vec<f64> = self.lambda.iter().map(|l| l * h).collect();
        let (out, lambda, attempt) = (self.out.clone(), self.lambda.clone(), self.attempt.clone());
        let middle = self.now.t + 0.5 * h;
        let half = self.attempt(0.5 * h, middle);
        let solved = self.attempt.solved.is_some();
        let part = self.lambda.iter().map(|l| 0.5 * h * l);
        let part: Vec<f64> = if solved {
            part.collect()
        } else {
            vec![0.0; whole.len()]
        };
        self.out = out;
        self.lambda = lambda;
        self.attempt = attempt;
        self.inputs.left(self.now.t + h, &mut self.u_next);
        let system = &self.plant.systems[self.now.system].1;
        system
            .columns
            .fill(&self.now.x, &self.u_next, &self.now.u, &mut self.z);
        let size = |p: &[f64]| p.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        if half.is_err() || size(&part) <= IMPULSE_RATIO * size(&whole) {
            return Ok(None);
        }
        let limit = |(part, whole): (&f64, &f64)| {
            if part.abs() > IMPULSE_RATIO * whole.abs() {
                2.0 * part - whole
            } else {
                0.0
            }
        };
        Ok(Some(part.iter().zip(&whole).map(limit).collect()))
    }

    fn log_spontaneous(&mut self, t: f64, p: &[f64], log: &mut Log) {
        self.stats.jumps += 1;
        let still = vec![0.0; self.now.u.len()];
        self.log_impulses(t, p, &still, log);
        self.note_impulse(t, p, log);
    }
}

/// The part of a bracket after which the first of several quantities that are positive at its end alone passes zero.
fn passage(before: &[f64], beyond: &[f64]) -> f64 {
    let pairs = before.iter().zip(beyond);
    let parts = pairs
        .filter(|(_, b)| **b > 0.0)
        .map(|(a, b)| -a.min(0.0) / (b - a.min(0.0)));
    parts.fold(1.0, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_several_passages_the_first_is_where_its_line_is_zero() {
        assert_eq!(passage(&[-1.0], &[1.0]), 0.5);
        assert_eq!(passage(&[-1.0, -1.0, -3.0], &[1.0, 3.0, -1.0]), 0.25);
        // What is positive at once passed where the bracket begins; what is not, passes nowhere in it.
        assert_eq!(passage(&[2.0], &[1.0]), 0.0);
        assert_eq!(passage(&[-2.0], &[0.0]), 1.0);
    }
}
