//! An instant at which something happens: what moves at it, all of it together.

use super::Exact;
use crate::integrate::error::{Error, Reason};
use crate::integrate::exact::assembler::Step;
use crate::integrate::exact::key::{Key, Owner, Trigger};
use crate::integrate::exact::transition::PATIENCE;
use crate::integrate::log::Log;
use crate::integrate::switching::fire;

impl Exact {
    /// Something happens now: a guard fell through zero, sources reach breakpoints, switches that sources drive move. All that
    /// happens at one instant is taken together before a mode is looked for.
    pub(super) fn instant(&mut self, fired: Option<usize>, log: &mut Log) -> Result<(), Error> {
        let t = self.travel.t;
        let near = t + self.ulps();
        if let (Some(at), Some(guard)) = (self.mode, fired) {
            self.leave_here(at, guard)?;
        } else {
            self.memory.left_here.clear();
        }
        self.take_storage();
        self.take_pace();
        let (corner, known) = self.sources.due(near);
        self.inspector.forget_slips();
        self.corner = corner;
        let edge = corner && self.sources.take_pieces(t, near)?;
        let mut discontinuous = edge;
        self.sources.stand(t);
        let mut key = std::mem::take(&mut self.key);
        if known {
            discontinuous |= self.sources.move_clocked(&mut key, near);
        }
        // Between thresholds a switch slides as long as closing and opening contradict each other, of which sources may be the cause.
        let sharp = |(i, _): &(usize, bool)| self.table.thresholds[*i].is_sharp();
        discontinuous |= corner && !key.sliding.iter().all(sharp);
        if discontinuous {
            key.sliding.clear();
        }
        discontinuous |= self.move_guarded(&mut key, fired, (self.corner, edge));
        fire(&self.table.thresholds, &mut key.switches);
        let trigger = fired.map_or(Trigger::Sources, Trigger::Guard);
        self.change(key, discontinuous, trigger, log)
    }

    /// Takes note that mode `at` is left by a guard. One that is left at the instant at which it was entered was found by rounding:
    /// after [`PATIENCE`] of them none is entered again at this instant, and an instant without end is an internal error.
    fn leave_here(&mut self, at: usize, guard: usize) -> Result<(), Error> {
        // A mode that its own guard led back to itself has gone on where the time has: its transients alone may be rounding.
        let left = self.memory.left_here.last();
        let stays = left.is_some_and(|left| left.0 == at) && self.travel.age <= self.ulps();
        if !stays && self.travel.age > f64::EPSILON * self.table.modes[at].flow.shortest() {
            self.memory.left_here.clear();
        }
        self.memory.left_here.push((at, guard));
        if self.memory.left_here.len()
            > PATIENCE + 2 * (self.table.pairs + self.table.thresholds.len())
        {
            let what = "modes are left at the instant at which they were entered, without end";
            let reason = Reason::internal("integrate::exact", what);
            return Err(self.fail(reason).device(self.table.owner_name(at, guard)));
        }
        Ok(())
    }

    /// Moves the switches whose guards end the mode now: the one that `fired` and all that pass their thresholds with it, in the
    /// present mode with the sources as they go on after a `corner`. Behind an `edge` the devices need not stand as they do in the present
    /// mode, and controls are asked when it is known how they do. Whether one moved.
    pub(super) fn move_guarded(
        &mut self,
        key: &mut Key,
        fired: Option<usize>,
        (corner, edge): (bool, bool),
    ) -> bool {
        let Some(at) = self.mode else { return false };
        let mut moved = false;
        let owner = fired.map(|guard| self.table.modes[at].owner(guard));
        if let Some(guard) = fired {
            self.note_slip(at, guard);
        }
        match owner {
            // A thyristor's current ends, and no gate holds it.
            Some(Owner::Device(pair)) => {
                for i in self.table.released(pair, &key.switches) {
                    key.switches[i] = false;
                }
            }
            Some(Owner::Switch(i)) if !corner => {
                key.switches[i] = !key.switches[i];
                moved = true;
            }
            Some(Owner::Slide(i, on)) => {
                key.sliding.retain(|s| s.0 != i);
                key.switches[i] = on;
                moved = true;
            }
            Some(Owner::Switch(_)) | None => {}
        }
        let mode = &self.table.modes[at];
        let first = mode.device_guards.len();
        let may_pass = |k: usize| {
            let decided = !corner && fired == Some(first + k);
            let sources_turn = corner && !edge && mode.controlled_by_sources[k];
            !decided && (sources_turn || self.travel.is_at_zero(&mode.flow, first + k))
        };
        let candidates: Vec<usize> = (0..mode.guarded_switches.len())
            .filter(|&k| may_pass(k))
            .collect();
        if !candidates.is_empty() {
            let mode = &mut self.table.modes[at];
            let (t, now) = (self.travel.t, &self.travel.now[..mode.n]);
            self.inspector.look(mode, now, (t, &self.sources.z));
            for k in candidates {
                let mode = &self.table.modes[at];
                if self.inspector.leaves(mode, first + k, self.travel.t) {
                    let i = mode.guarded_switches[k];
                    key.switches[i] = !key.switches[i];
                    moved = true;
                    self.note_slip(at, first + k);
                }
            }
        }
        moved
    }

    /// Notes that a guard of mode `at` passes zero now, where its quantity goes on in the next mode: the control of a switch, the input of
    /// a function block on a step. Of a diode's current and voltage one begins where the other ends.
    fn note_slip(&mut self, at: usize, guard: usize) {
        let mode = &self.table.modes[at];
        let slope = self.travel.now[mode.flow.dim() + mode.flow.guards() + guard];
        let t = self.travel.t;
        match mode.owner(guard) {
            owner @ Owner::Switch(_) => self.inspector.note_slip(owner, t, slope),
            Owner::Device(pair) => {
                let step = |step: &&Step| pair == step.pair || pair == step.pair + 1;
                if let Some(step) = self.table.steps().iter().find(step) {
                    for pair in [step.pair, step.pair + 1] {
                        self.inspector.note_slip(Owner::Device(pair), t, slope);
                    }
                }
            }
            Owner::Slide(..) => {}
        }
    }
}
