//! What happens in no time: the start, edges of sources, switches.

use super::Sparse;
use super::kernel::Step;
use super::system::{Largest, System};
use crate::integrate::error::{Error, Reason};
use crate::integrate::log::Log;
use crate::integrate::reading::Point;
use crate::integrate::stats::{JumpReason, StateJump};
use crate::settings::tolerances::events::DECISIVE;
use crate::settings::tolerances::jumps::NO_JUMP;
use crate::settings::tolerances::sparse::{AFTER, INSTANT, INSTANTS, RESTS};

/// (from sources, lost), J, where storage elements s become those of x because a switch joins them to one another or to sources, see
/// [`taking_over`](crate::integrate::energy).
pub(super) fn taking_over(system: &System, s: &[f64], x: &[f64], u: &[f64]) -> (f64, f64) {
    let after = system.storage(x, u);
    let step: Vec<f64> = after.iter().zip(s).map(|(a, b)| a - b).collect();
    let of_sources = system.storage(&vec![0.0; x.len()], u);
    (
        system.product(&of_sources, &step),
        0.5 * system.product(&step, &step),
    )
}

impl Sparse {
    /// The start: edges of the sources there, inconsistent initial values, switches that are asked to move at once.
    pub(super) fn begin(&mut self, log: &mut Log) -> Result<(), Error> {
        let before = self.now.u.clone();
        self.now.u = self.inputs.all(self.now.t);
        self.inputs.behind(self.now.t, &mut self.now.u);
        self.jump(&before)?;
        let start = std::mem::take(&mut self.start);
        self.note_jump(&start, 0.0, JumpReason::Start, log);
        self.note_energy();
        self.started = true;
        self.see();
        let moving = (self.switches).misplaced(self.system(), &self.inputs, self.now.t);
        if !moving.is_empty() {
            self.switch(&moving, log)?;
        }
        Ok(())
    }

    /// At a breakpoint: inputs take their right limits, the state jumps if it must.
    pub(super) fn edge(&mut self, t: f64, log: &mut Log) -> Result<(), Error> {
        let mut u = self.now.u.clone();
        self.inputs.behind(t, &mut u);
        if u == self.now.u {
            if log.wants_corners() {
                let row = self.row();
                log.corner(self.now.t, &row);
            }
            return Ok(());
        }
        let rows = log.wants_rows();
        if rows {
            self.log_row(log);
        }
        let storage = self.system().storage(&self.now.x, &self.now.u);
        let lost = self.now.balance.lost_in_jumps();
        let before = std::mem::replace(&mut self.now.u, u);
        self.jump(&before)?;
        self.note_jump(&storage, lost, JumpReason::SourceEdge, log);
        for (t, what) in std::mem::take(&mut self.pending) {
            self.stats.events += 1;
            log.event(t, what, false);
        }
        if rows {
            self.log_row(log);
        }
        Ok(())
    }

    /// The jump where inputs step from `before` to the present ones, and λ, x' behind it: implicit steps of next to no length, the first of which take up
    /// the jump, the last of which tells x' for the way back to the instant.
    pub(super) fn jump(&mut self, before: &[f64]) -> Result<(), Error> {
        let h = INSTANT * self.span;
        let t = self.now.t;
        let mut du = vec![0.0; self.now.u.len()];
        self.inputs.slopes_behind(t, &mut du);
        self.step.x.clone_from(&self.now.x);
        self.step.active.clone_from(&self.now.active);
        self.step.lambda.clear();
        self.step.lambda.resize(self.now.active.len(), 0.0);
        let mut first = self.now.x.clone();
        let mut impulse = vec![0.0; self.now.active.len()];
        let mut u = self.now.u.clone();
        let mut made = 0;
        let (mut sets, mut rows) = (Vec::new(), Vec::new());
        let second = loop {
            for (u, du) in u.iter_mut().zip(&du) {
                *u += h * du;
            }
            let before = self.reads.as_ref().map(|_| self.step.x.clone());
            let system = &mut self.systems[self.now.system].1;
            system.implicit((t, h, Self::slack(h)), &u, &mut self.step)?;
            made += 1;
            if let Some((reads, before)) = self.reads.as_ref().zip(before) {
                let Step { x, lambda, .. } = &self.step;
                let moved = x.iter().zip(before);
                let slope: Vec<f64> = moved.map(|(x, before)| (x - before) / h).collect();
                let (u, du) = (&u[..], &du[..]);
                system.write(reads, (Point { x, lambda, u, du }, &slope), &mut rows);
            }
            if let Some(tape) = &mut self.tape {
                sets.push(tape.set(&self.step.active));
            }
            let rests = made > 1 && system.are_within(RESTS, &first, &self.step.x);
            if rests || made == INSTANTS {
                break self.step.x.clone();
            }
            first.clone_from(&self.step.x);
            let add = impulse.iter_mut().zip(&self.step.lambda);
            add.for_each(|(p, lambda)| *p += h * lambda);
        };
        if let Some(tape) = &mut self.tape {
            let times = (t, self.now.system, (h, Self::slack(h)));
            tape.jump(times, (sets, rows));
        }
        let steps = f64::from(made - 1);
        let lasting = impulse.iter_mut().zip(&self.step.lambda);
        lasting.for_each(|(p, lambda)| *p -= steps * h * lambda);
        let slope: Vec<f64> = if self.balanced {
            let ends = second.iter().zip(&first);
            ends.map(|(b, a)| (b - a) / h).collect()
        } else {
            // The same without the rounding of a difference over h: the step behind may be long.
            let system = &self.systems[self.now.system].1;
            system.rate(&second, &self.step.lambda, &u)
        };
        let after = first.iter().zip(&slope).map(|(x, k)| x - steps * h * k);
        let after: Vec<f64> = after.collect();
        self.account_for_jump(before, after, &impulse);
        self.now.slope = slope;
        self.now.lambda.clone_from(&self.step.lambda);
        self.now.lambda_known = true;
        self.now.settle = true;
        self.preferred = AFTER * h;
        self.refused = false;
        let active = self.step.active.clone();
        self.take_active(active);
        self.see();
        Ok(())
    }

    /// Moves the state to `after`, by impulses of the ports and a step of the inputs, with the energies; a move that is rounding is none.
    fn account_for_jump(&mut self, before: &[f64], after: Vec<f64>, impulse: &[f64]) {
        let system = &self.systems[self.now.system].1;
        let now = &mut self.now;
        let moved = !system.are_within(DECISIVE, &now.x, &after);
        let no_lambda = [];
        let at = |x, u| Point {
            x,
            lambda: &no_lambda,
            u,
            du: &[],
        };
        let step: Vec<f64> = now.u.iter().zip(before).map(|(a, b)| a - b).collect();
        let still = vec![0.0; impulse.len()];
        let source =
            system.work_of_sources(at(&now.x, before), at(&now.x, &now.u), (&still, &step));
        now.balance.add_jump((source, 0.0));
        if !moved {
            return;
        }
        let still = vec![0.0; step.len()];
        let source =
            system.work_of_sources(at(&now.x, &now.u), at(&after, &now.u), (impulse, &still));
        let change: Vec<f64> = after.iter().zip(&now.x).map(|(a, b)| a - b).collect();
        let change = system.storage_rate(&change, &still);
        let taken = system.taken_by_drops(at(&after, &now.u), impulse);
        let loss = 0.5 * system.product(&change, &change) + taken;
        now.balance.add_jump((source, loss));
        now.x = after;
    }

    /// Writes down that the storage jumped here from `before`, if it did by more than rounding; until then jumps had lost `lost`, J.
    fn note_jump(&mut self, before: &[f64], lost: f64, reason: JumpReason, log: &mut Log) {
        let system = &self.systems[self.now.system].1;
        let after = system.storage(&self.now.x, &self.now.u);
        let units = &self.storage_units[..];
        let sizes = before.iter().zip(&after).map(|(b, a)| b.abs().max(a.abs()));
        let largest = Largest::of(units.iter().copied().zip(sizes));
        let change: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
        let jumped: Vec<usize> = (0..after.len())
            .filter(|&k| change[k].abs() > NO_JUMP * largest.among(units[k]))
            .collect();
        if jumped.is_empty() {
            return;
        }
        self.stats.jumps += 1;
        log.event(self.now.t, std::sync::Arc::default(), true);
        let elements = self.multiport.storage.iter().map(|s| s.element.clone());
        let elements: Vec<String> = elements.collect();
        let balance = &self.now.balance;
        let sizes = (
            balance.lost_in_jumps() - lost,
            0.5 * system.product(&change, &change),
            balance.largest(),
        );
        log.state_jump(StateJump::new(
            self.now.t,
            (&elements, units),
            &jumped,
            sizes,
            reason,
        ));
    }

    /// Flips the switches `moving`, with the jump this causes.
    pub(super) fn switch(&mut self, moving: &[usize], log: &mut Log) -> Result<(), Error> {
        if log.wants_rows() {
            self.log_row(log);
        }
        self.known = None;
        let storage = self.system().storage(&self.now.x, &self.now.u);
        let lost = self.now.balance.lost_in_jumps();
        let before = self.switches.position().to_vec();
        let shift = self.shift_of(moving);
        self.switches.toggle(moving);
        self.stats.events += 1;
        log.event(self.now.t, self.switches.flipped(&before), false);
        self.take_position(&storage)?;
        if let Some(shift) = shift {
            self.shifted(shift, &storage);
        }
        let moved = self.switches.moved(&before).join(", ");
        self.note_jump(&storage, lost, JumpReason::Switch(moved), log);
        if log.wants_rows() {
            self.log_row(log);
        }
        Ok(())
    }

    /// Gives up factors of the positions that were left longest ago where all together are more than may be kept.
    fn bound_factors(&mut self) {
        let here = self.now.system;
        self.systems[here].1.entered = self.stats.events;
        let systems = || self.systems.iter().enumerate();
        let mut total: usize = systems().map(|(_, (_, s))| s.kernel.bytes()).sum();
        if total <= self.settings.max_kept {
            return;
        }
        let mut oldest: Vec<(u64, usize)> = systems().map(|(at, (_, s))| (s.entered, at)).collect();
        oldest.sort_unstable();
        for (_, at) in oldest.into_iter().filter(|(_, at)| *at != here) {
            // Half of it, so that this is not asked at each change.
            if 2 * total <= self.settings.max_kept {
                return;
            }
            let kernel = &mut self.systems[at].1.kernel;
            total -= kernel.bytes();
            kernel.forget();
        }
    }

    /// Writes a change of position down, with what the storage s jumps by as states x.
    pub(super) fn tape_position(&mut self, (from, to): (usize, usize), s: &[f64], x: &[f64]) {
        let Some(tape) = &mut self.tape else {
            return;
        };
        let jumped = self.reads.as_ref().map(|reads| {
            let after = self.systems[to].1.storage(x, &self.now.u);
            let rates = reads.rates.iter();
            rates.map(|&k| after[k] - s[k]).collect()
        });
        tape.position(from, to, jumped.unwrap_or_default());
    }

    /// Takes storage s over into the system of the present switch position.
    fn take_position(&mut self, s: &[f64]) -> Result<(), Error> {
        let position = self.switches.position().to_vec();
        let from = self.now.system;
        self.now.system = self.system_of(&position)?;
        self.bound_factors();
        let system = &self.systems[self.now.system].1;
        let x = system.lcs.state_from(s);
        self.tape_position((from, self.now.system), s, &x);
        let system = &self.systems[self.now.system].1;
        let account = taking_over(system, s, &x, &self.now.u);
        self.now.balance.add_jump(account);
        self.now.x = x;
        let m = system.m();
        if self.now.active.len() != m {
            self.now.active = vec![false; m];
        }
        self.now.lambda.clear();
        self.now.lambda.resize(m, 0.0);
        self.switches.rebuild(system);
        if self.switches.watch() {
            let what = "a switch whose control follows the state beside so many others";
            return Err(Error::at(self.now.t, Reason::Unsupported(what.into())));
        }
        let u = self.now.u.clone();
        self.jump(&u)?;
        self.pending.clear();
        Ok(())
    }
}
