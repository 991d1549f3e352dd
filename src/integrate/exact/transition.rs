//! From one mode to the next: positions of the switches, impulse of the devices, conducting devices.

use nalgebra::DVector;

use super::inspect::Finding;
use super::mode::{Key, Mode, Owner};
use super::stepper::Exact;
use crate::integrate::run::{Log, Reason, SimError};
use crate::integrate::settle;
use crate::integrate::switching::fire;

/// Lengths of the implicit step that proposes the next mode, in units of the fastest time constant seen. The long ones are for stiff
/// circuits: a current that starts without a slope is no more than rounding on the others.
pub(super) const PROPOSALS: [f64; 9] = [1e-6, 1e-4, 1e-8, 1e-2, 1e-10, 1.0, 1e2, 1e4, 1e6];
/// Modes tried around the proposals before the search ends.
const MOST_NEIGHBOURS: usize = 400;

/// Modes left at the instant at which they were entered after which none of them is entered again there.
pub(super) const PATIENCE: usize = 2;

/// Why a mode is left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Trigger {
    /// This guard fell through zero.
    Guard(usize),
    /// Sources or switches they drive changed.
    Sources,
}

impl Exact {
    /// Enters the mode from here on. Where there is none, everything is as it was before.
    pub(super) fn change(
        &mut self,
        mut key: Key,
        discontinuous: bool,
        trigger: Trigger,
        log: &mut Log,
    ) -> Result<(), SimError> {
        self.wanted = None;
        let left_row = (log.wants_rows() && self.started).then(|| {
            self.read_row();
            self.row.clone()
        });
        // Most changes are like one before.
        let followed = self.follow(&key, trigger);
        if let Some((at, guards)) = &followed
            && guards.is_empty()
            && self.let_go(*at).next().is_none()
        {
            let at = *at;
            key.closed.clone_from(&self.plant.modes[at].key.closed);
            self.enter(at, key, false, trigger, left_row, log);
            return Ok(());
        }
        let left = self.mode.map(|at| self.plant.modes[at].key.clone());
        self.key = left.unwrap_or_else(|| key.clone());
        let (storage, scale) = (self.storage.clone(), self.scale.clone());
        let (balance, switches) = (self.balance, key.switches.clone());
        let (events, impulses) = (log.events.len(), log.impulses.len());
        if let Some(at) = self.mode {
            self.before = self.inputs_at_end_of(at);
        }
        let found = self.search(&mut key, discontinuous, trigger, followed, log);
        match found {
            Ok((at, jumped)) => {
                if jumped {
                    let loss = self.balance.lost_in_jumps() - balance.lost_in_jumps();
                    let reason = self.jump_reason(at, trigger);
                    self.note_jump(&storage, loss, reason, log);
                }
                key.copy_from(&self.plant.modes[at].key);
                self.enter(at, key, jumped, trigger, left_row, log);
                Ok(())
            }
            Err(error) => {
                (self.storage, self.scale) = (storage, scale);
                (self.balance, self.wanted) = (balance, Some(switches));
                log.back_to(events, impulses);
                Err(error)
            }
        }
    }

    /// Finds the mode and whether the state jumps into it: positions of the switches, impulse of the devices, conducting devices.
    /// `followed` is what [`Self::follow`] found.
    fn search(
        &mut self,
        key: &mut Key,
        mut discontinuous: bool,
        trigger: Trigger,
        followed: Option<(usize, Vec<usize>)>,
        log: &mut Log,
    ) -> Result<(usize, bool), SimError> {
        let mut jumped = false;
        let mut positions: Vec<Vec<bool>> = Vec::new();
        let mut closed_sets: Vec<Vec<bool>> = Vec::new();
        let mut entry = None;
        let mut moving: Vec<usize> = Vec::new();
        let mut followed = Some(followed);
        for _ in 0..3 + 2 * self.plant.thresholds.len() {
            if discontinuous && self.settle(key)? {
                followed = None;
            }
            // A device event in a convex circuit is continuous; an edge or a switch may need an impulse.
            let mut found = match followed.take() {
                Some(found) => found,
                None => self.follow(key, trigger),
            };
            if found.is_none() && !discontinuous {
                found = self.find_mode(key, trigger)?;
            }
            if found.is_none() && !key.sliding.is_empty() {
                key.sliding.clear();
                discontinuous = true;
                continue;
            }
            let mut jump = None;
            if found.is_none() {
                let before = self.before_jump(log);
                if self.project(key, log)? {
                    jumped = true;
                    jump = Some(before);
                }
                found = self.find_mode(key, trigger)?;
            }
            if found.is_none() && self.plant.pairs > 0 {
                found = self.jump_into(key, log)?;
                jumped |= found.is_some();
            }
            let Some((at, mut leaving)) = found else {
                let device = self.culprit(key, trigger);
                return Err(self.fail(Reason::Infeasible).devices(device));
            };
            key.closed.clone_from(&self.plant.modes[at].key.closed);
            leaving.extend(self.let_go(at));
            leaving.sort_unstable();
            leaving.dedup();
            if leaving.is_empty() {
                entry = Some(at);
                break;
            }
            if let Some(before) = jump
                && let Some(first) = self.interrupt(&before, key, &leaving, log)?
            {
                leaving = first;
            }
            // Settling may lead back to a position that was left.
            let again = positions.contains(&key.switches);
            closed_sets.push(key.closed.clone());
            positions.push(key.switches.clone());
            for &i in &leaving {
                key.switches[i] = !key.switches[i];
                if !moving.contains(&i) {
                    moving.push(i);
                }
            }
            fire(&self.plant.thresholds, &mut key.switches);
            if again || positions.contains(&key.switches) {
                // The switches that moved last contradict themselves, or all that moved contradict each other.
                entry = self
                    .slide(key, &leaving, &closed_sets)
                    .or_else(|| self.slide(key, &moving, &closed_sets));
                if !again || entry.is_some() {
                    break;
                }
            }
            discontinuous = true;
        }
        let at = entry.ok_or_else(|| {
            let names = moving
                .iter()
                .map(|&i| self.plant.thresholds[i].name.as_str());
            self.fail(Reason::SwitchesDoNotSettle).devices(names)
        })?;
        Ok((at, jumped))
    }

    /// See [`settle`]; whether a switch moved.
    fn settle(&mut self, key: &mut Key) -> Result<bool, SimError> {
        if !key.sliding.is_empty() || key.switches.len() < 2 {
            return Ok(false);
        }
        let u = self.inputs(self.motion.t);
        let s = DVector::from_column_slice(&self.storage);
        let thresholds = self.plant.thresholds.clone();
        let mut candidate = key.clone();
        settle::settle(
            &thresholds,
            &self.key.switches,
            &mut key.switches,
            |position| {
                candidate.switches.copy_from_slice(position);
                let lcs = &self.plant.free(&candidate)?.lcs;
                let mut asking = settle::asking(lcs, &thresholds, position, &s, &u);
                asking.retain(|i| self.plant.clocks.iter().all(|clock| clock.switch != *i));
                Ok(asking)
            },
        )
    }

    /// Enters mode `at`, which was inspected last, under its key.
    fn enter(
        &mut self,
        at: usize,
        key: Key,
        jumped: bool,
        trigger: Trigger,
        left_row: Option<Vec<f64>>,
        log: &mut Log,
    ) {
        let t = self.motion.t;
        if let (Some(from), false) = (self.mode, jumped) {
            self.plant.modes[from].remember(trigger, at);
        }
        let same = self.mode == Some(at);
        self.report(at, jumped, log);
        self.note_slides(at);
        self.mode = Some(at);
        self.key = key;
        if self.energy {
            self.motion.power = self.capacity.max(self.balance.largest()) / self.duration;
        }
        let Mode {
            flow, magnitudes, ..
        } = &self.plant.modes[at];
        self.motion.enter(flow, t, &self.inspector.w, magnitudes);
        self.look_ahead();
        if jumped {
            self.jumps += 1;
        }
        if let Some(before) = left_row {
            self.read_row();
            let jumped = self.row_jumps(&before);
            if jumped {
                log.row(t, &before);
            }
            if jumped || !same {
                log.row(t, &self.row);
            } else if self.corner {
                log.corner(t, &self.row);
            }
        }
    }

    /// Thyristors that hold themselves in mode `at` although their valves block.
    fn let_go(&self, at: usize) -> impl Iterator<Item = usize> {
        let Key {
            closed, switches, ..
        } = &self.plant.modes[at].key;
        let blocks = |i: usize| self.plant.valves[i].is_some_and(|pair| !closed[pair]);
        let thresholds = self.plant.thresholds.iter().enumerate();
        let holding = thresholds.filter(|(i, t)| t.holds(switches[*i], switches));
        holding.map(|(i, _)| i).filter(move |&i| blocks(i))
    }

    /// The device or switches at which no mode goes on.
    fn culprit(&mut self, key: &Key, trigger: Trigger) -> Vec<String> {
        let moved: Vec<String> = (0..key.switches.len())
            .filter(|&i| !self.plant.thresholds[i].is_rest())
            .filter(|&i| self.key.switches.get(i) != key.switches.get(i))
            .map(|i| self.plant.thresholds[i].name.clone())
            .collect();
        if !moved.is_empty() {
            return moved;
        }
        let guard = match (trigger, self.mode) {
            (Trigger::Guard(guard), Some(from)) => Some((from, guard)),
            _ => self
                .plant
                .mode(key, &self.exosystem)
                .and_then(|at| match self.inspect(at) {
                    Finding::Refused(guard) => Some((at, guard)),
                    Finding::Inconsistent | Finding::Holds(_) => None,
                }),
        };
        let first = || self.plant.device(0).map(String::from);
        guard
            .map(|(at, guard)| self.owner_name(at, guard))
            .or_else(first)
            .into_iter()
            .collect()
    }

    /// The device or switch of a guard of mode `at`.
    pub(super) fn owner_name(&self, at: usize, guard: usize) -> String {
        let name = match self.plant.modes[at].owner(guard) {
            Owner::Switch(i) | Owner::Slide(i, _) => Some(self.plant.thresholds[i].name.as_str()),
            Owner::Device(pair) => self.plant.device(pair),
        };
        name.unwrap_or_default().to_string()
    }

    /// The mode in which these switches stay on their thresholds, where closing and opening contradict each other.
    fn slide(&mut self, key: &Key, switches: &[usize], closed_sets: &[Vec<bool>]) -> Option<usize> {
        // A latch has no position between on and off.
        if switches
            .iter()
            .any(|&i| self.plant.thresholds[i].latch.is_some())
        {
            return None;
        }
        let neighbours = closed_sets.iter().flat_map(|set| {
            (0..set.len()).map(|j| {
                let mut closed = set.clone();
                closed[j] = !closed[j];
                closed
            })
        });
        let candidates: Vec<Vec<bool>> = closed_sets.iter().cloned().chain(neighbours).collect();
        candidates
            .into_iter()
            .find_map(|closed| self.slide_with(key.with_closed(closed), switches))
    }

    /// As [`Self::slide`], with these devices conducting. The flow does not depend on the signs of the switches' voltages and
    /// currents, so that a sign that is refused is the other one.
    fn slide_with(&mut self, mut candidate: Key, switches: &[usize]) -> Option<usize> {
        candidate
            .sliding
            .extend(switches.iter().map(|&i| (i, true)));
        candidate.sliding.sort_unstable();
        candidate.sliding.dedup_by_key(|s| s.0);
        // The position that a sliding switch came from does not matter.
        for &(i, _) in &candidate.sliding {
            candidate.switches[i] = false;
        }
        for _ in 0..=switches.len() {
            let at = self.plant.mode(&candidate, &self.exosystem)?;
            let refused = match self.inspect(at) {
                Finding::Holds(leaving) => return leaving.is_empty().then_some(at),
                Finding::Refused(guard) => self.plant.modes[at].owner(guard),
                Finding::Inconsistent => return None,
            };
            let Owner::Slide(i, _) = refused else {
                return None;
            };
            let slide = candidate.sliding.iter_mut().find(|s| **s == (i, true))?;
            slide.1 = false;
        }
        None
    }

    /// The mode that followed the same trigger before, if it holds now.
    fn follow(&mut self, key: &Key, trigger: Trigger) -> Option<(usize, Vec<usize>)> {
        let from = self.mode?;
        for k in 0..self.plant.modes[from].successors.len() {
            let (why, at) = self.plant.modes[from].successors[k];
            if why == trigger
                && self.plant.modes[at].key.same_switches(key)
                && !self.is_barred(at)
                && let Some(leaving) = self.try_mode(at)
            {
                return Some((at, leaving));
            }
        }
        None
    }

    /// Whether a mode was left at this instant too often to be entered again.
    fn is_barred(&self, at: usize) -> bool {
        self.left_here.len() > PATIENCE && self.left_here.contains(&at)
    }

    /// A mode that holds on some interval after now: from one implicit step of the complementarity system at several
    /// lengths, from their neighbours. Every candidate is inspected; a mode that passes
    /// is a solution, whoever proposed it.
    pub(super) fn find_mode(
        &mut self,
        key: &Key,
        trigger: Trigger,
    ) -> Result<Option<(usize, Vec<usize>)>, SimError> {
        let mut tried: Vec<Vec<bool>> = Vec::new();
        if trigger == Trigger::Sources || self.plant.pairs == 0 {
            tried.push(key.closed.clone());
            if let Some(found) = self.try_key(key) {
                return Ok(Some(found));
            }
        }
        if self.plant.pairs == 0 {
            return Ok(None);
        }
        if key.sliding.is_empty() || self.plant.free(key).is_ok() {
            if let Some(found) = self.try_proposals(key, &mut tried)? {
                return Ok(Some(found));
            }
        } else if !tried.contains(&key.closed) {
            // On a threshold the circuit may have no complementarity system; the modes around the present one remain.
            tried.push(key.closed.clone());
            if let Some(found) = self.try_key(key) {
                return Ok(Some(found));
            }
        }
        // Where the steps have no solution to the digits the present devices are the proposal.
        if tried.is_empty() {
            tried.push(key.closed.clone());
            if let Some(found) = self.try_key(key) {
                return Ok(Some(found));
            }
        }
        // Neighbours of the first proposal, then far ones, then all others.
        let (mut next, proposed) = (0, tried.len());
        while next < tried.len() && tried.len() < MOST_NEIGHBOURS {
            if let Some(found) = self.try_neighbours(key, next, &mut tried) {
                return Ok(Some(found));
            }
            if next == 0
                && let Some(found) = self.walk(key, proposed, &mut tried)
            {
                return Ok(Some(found));
            }
            next += 1;
        }
        Ok(None)
    }

    /// The modes in which one device stands otherwise than in `tried[which]`.
    fn try_neighbours(
        &mut self,
        key: &Key,
        which: usize,
        tried: &mut Vec<Vec<bool>>,
    ) -> Option<(usize, Vec<usize>)> {
        for j in 0..self.plant.pairs {
            let mut closed = tried[which].clone();
            closed[j] = !closed[j];
            if tried.contains(&closed) {
                continue;
            }
            tried.push(closed.clone());
            let candidate = key.with_closed(closed);
            if let Some(found) = self.try_key(&candidate) {
                return Some(found);
            }
        }
        None
    }

    /// From each of the sets of conducting devices that were `proposed` on, what refuses a mode changes sides, one device after the other (Murty's
    /// pivoting, Operations Research 22 (1974)): devices that change together, far from every proposal, are found as many modes
    /// away as there are devices.
    fn walk(
        &mut self,
        key: &Key,
        proposed: usize,
        tried: &mut Vec<Vec<bool>>,
    ) -> Option<(usize, Vec<usize>)> {
        for start in 0..proposed {
            let mut closed = tried[start].clone();
            for _ in 0..2 * self.plant.pairs {
                let candidate = key.with_closed(closed.clone());
                let Some(at) = self.plant.mode(&candidate, &self.exosystem) else {
                    break;
                };
                match self.inspect(at) {
                    Finding::Holds(leaving) => return Some((at, leaving)),
                    Finding::Refused(guard) => {
                        let Owner::Device(pair) = self.plant.modes[at].owner(guard) else {
                            break;
                        };
                        // The pair of a switch on its threshold stays closed.
                        let Some(side) = closed.get_mut(pair) else {
                            break;
                        };
                        *side = !*side;
                    }
                    Finding::Inconsistent => break,
                }
                if tried.contains(&closed) {
                    break;
                }
                tried.push(closed.clone());
            }
        }
        None
    }

    /// Modes proposed by one implicit step of several lengths.
    fn try_proposals(
        &mut self,
        key: &Key,
        tried: &mut Vec<Vec<bool>>,
    ) -> Result<Option<(usize, Vec<usize>)>, SimError> {
        let t = self.motion.t;
        let fastest = self.plant.fastest();
        let free = self.plant.free(key)?;
        let x = free.state_from(&self.storage);
        for (k, part) in self.proposals.into_iter().enumerate() {
            let h = part / fastest;
            let u = self.inputs(t + h);
            self.lcp_solves += 1;
            let Some(proposal) = self.plant.free(key)?.propose(&x, &u, h) else {
                continue;
            };
            for closed in [proposal.open(), proposal.as_before(&key.closed)] {
                if tried.contains(&closed) {
                    continue;
                }
                tried.push(closed.clone());
                let candidate = key.with_closed(closed);
                if let Some(found) = self.try_key(&candidate) {
                    // What was found once is tried first from now on.
                    self.proposals[..=k].rotate_right(1);
                    return Ok(Some(found));
                }
            }
        }
        Ok(None)
    }

    pub(super) fn try_key(&mut self, key: &Key) -> Option<(usize, Vec<usize>)> {
        let at = self.plant.mode(key, &self.exosystem)?;
        if self.is_barred(at) {
            return None;
        }
        self.try_mode(at).map(|leaving| (at, leaving))
    }

    fn inspect(&mut self, at: usize) -> Finding {
        self.inspector.inspect(
            &mut self.plant.modes[at],
            (&self.exosystem, self.motion.t, &self.z),
            &self.storage,
            &self.scale,
        )
    }

    pub(super) fn try_mode(&mut self, at: usize) -> Option<Vec<usize>> {
        match self.inspect(at) {
            Finding::Holds(leaving) => Some(leaving),
            Finding::Inconsistent | Finding::Refused(_) => None,
        }
    }
}
