//! From one mode to the next: positions of the switches, impulse of the devices, conducting devices.

use nalgebra::DVector;

use super::inspect::{Finding, Inspector};
use super::key::{Key, Owner, Trigger};
use super::plant::ModeTable;
use super::report::Report;
use super::sources::Sources;
use super::storage::Storage;
use crate::integrate::error::{Error, Reason};
use crate::integrate::log::Log;
use crate::integrate::settle;
use crate::integrate::switching::fire;
use crate::settings::tolerances::exponentials::PROPOSALS;

/// Modes tried around the proposals before the search ends.
const MOST_NEIGHBOURS: usize = 400;

/// Modes left at the instant at which they were entered after which none of them is entered again there.
pub(super) const PATIENCE: usize = 2;

/// What is remembered from one change of mode to the next.
pub(super) struct Memory {
    /// [`PROPOSALS`], the latest successful first.
    proposals: [f64; PROPOSALS.len()],
    /// Modes left at the present instant, and by which guards.
    pub(super) left_here: Vec<(usize, usize)>,
}

impl Memory {
    pub(super) const fn new() -> Self {
        Self {
            proposals: PROPOSALS,
            left_here: Vec::new(),
        }
    }

    /// The guard that bars a mode from being entered again at this instant, as it ended it here and modes were left too often.
    fn bar(&self, at: usize) -> Option<usize> {
        let mut left = self.left_here.iter().rev();
        let (_, guard) = left.find(|(mode, _)| *mode == at)?;
        (self.left_here.len() > PATIENCE).then_some(*guard)
    }
}

/// A change of mode: from where, and what it may move.
pub(super) struct Transition<'a> {
    /// Time, s.
    pub(super) t: f64,
    /// The mode that is left, if any, and what stood in it.
    pub(super) mode: Option<usize>,
    pub(super) key: &'a Key,
    /// Whether there was a mode before.
    pub(super) started: bool,
    pub(super) table: &'a mut ModeTable,
    pub(super) sources: &'a mut Sources,
    pub(super) storage: &'a mut Storage,
    pub(super) inspector: &'a mut Inspector,
    pub(super) report: &'a mut Report,
    pub(super) memory: &'a mut Memory,
}

impl Transition<'_> {
    pub(super) fn fail(&self, reason: Reason) -> Error {
        Error::at(self.t, reason)
    }

    /// Finds the mode and whether the state jumps into it: positions of the switches, impulse of the devices, conducting devices.
    /// `followed` is what [`Self::follow`] found.
    pub(super) fn search(
        &mut self,
        key: &mut Key,
        mut discontinuous: bool,
        trigger: Trigger,
        followed: Option<(usize, Vec<usize>)>,
        log: &mut Log,
    ) -> Result<(usize, bool), Error> {
        let mut jumped = false;
        let mut positions: Vec<Vec<bool>> = Vec::new();
        let mut closed_sets: Vec<Vec<bool>> = Vec::new();
        let mut entry = None;
        let mut moving: Vec<usize> = Vec::new();
        let mut followed = Some(followed);
        for _ in 0..3 + 2 * self.table.thresholds.len() {
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
            if found.is_none() && self.table.pairs > 0 {
                found = self.jump_into(key, log)?;
                jumped |= found.is_some();
            }
            let Some((at, mut leaving)) = found else {
                let device = self.culprit(key, trigger);
                return Err(self.fail(Reason::Infeasible).devices(device));
            };
            key.closed.clone_from(&self.table.modes[at].key.closed);
            leaving.extend(self.table.let_go(at));
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
            fire(&self.table.thresholds, &mut key.switches);
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
                .map(|&i| self.table.thresholds[i].name.as_str());
            self.fail(Reason::SwitchesDoNotSettle).devices(names)
        })?;
        Ok((at, jumped))
    }

    /// See [`settle`]; whether a switch moved.
    fn settle(&mut self, key: &mut Key) -> Result<bool, Error> {
        if !key.sliding.is_empty() || key.switches.len() < 2 {
            return Ok(false);
        }
        let u = self.sources.inputs(self.t);
        let s = DVector::from_column_slice(&self.storage.values);
        let thresholds = self.table.thresholds.clone();
        let mut candidate = key.clone();
        settle::settle(
            &thresholds,
            &self.key.switches,
            &mut key.switches,
            |position| {
                candidate.switches.copy_from_slice(position);
                let lcs = &self.table.free(&candidate)?.lcs;
                let mut asking = settle::asking(lcs, &thresholds, position, &s, &u);
                asking.retain(|&i| !self.sources.control(i));
                let now: Vec<_> = asking.iter().map(|&i| settle::of_sources(lcs, i)).collect();
                if !asking.is_empty()
                    && self.mode.is_some()
                    && let Ok(left) = self.table.free(self.key)
                {
                    let mut now = now.into_iter();
                    asking.retain(|&i| {
                        let left = settle::of_sources(&left.lcs, i);
                        !settle::is_driven_alike(left, now.next().flatten())
                    });
                }
                Ok(asking)
            },
        )
    }

    /// The device or switches at which no mode goes on.
    fn culprit(&mut self, key: &Key, trigger: Trigger) -> Vec<String> {
        let moved: Vec<String> = (0..key.switches.len())
            .filter(|&i| !self.table.thresholds[i].is_rest())
            .filter(|&i| self.key.switches.get(i) != key.switches.get(i))
            .map(|i| self.table.thresholds[i].name.clone())
            .collect();
        if !moved.is_empty() {
            return moved;
        }
        let guard = match (trigger, self.mode) {
            (Trigger::Guard(guard), Some(from)) => Some((from, guard)),
            _ => self
                .table
                .mode(key, self.sources)
                .and_then(|at| match self.inspect(at) {
                    Finding::Refused(guard) => Some((at, guard)),
                    Finding::Inconsistent | Finding::Holds(_) => None,
                }),
        };
        let first = || self.table.device(0).map(String::from);
        guard
            .map(|(at, guard)| self.table.owner_name(at, guard))
            .or_else(first)
            .into_iter()
            .collect()
    }

    /// The mode in which these switches stay on their thresholds, where closing and opening contradict each other.
    fn slide(&mut self, key: &Key, switches: &[usize], closed_sets: &[Vec<bool>]) -> Option<usize> {
        // A latch has no position between on and off.
        if switches
            .iter()
            .any(|&i| self.table.thresholds[i].latch.is_some())
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
            let at = self.table.mode(&candidate, self.sources)?;
            let refused = match self.inspect(at) {
                Finding::Holds(leaving) => return leaving.is_empty().then_some(at),
                Finding::Refused(guard) => self.table.modes[at].owner(guard),
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
    pub(super) fn follow(&mut self, key: &Key, trigger: Trigger) -> Option<(usize, Vec<usize>)> {
        let from = self.mode?;
        for k in 0..self.table.modes[from].successors.len() {
            let (why, at) = self.table.modes[from].successors[k];
            if why == trigger
                && self.table.modes[at].key.same_switches(key)
                && let Some(leaving) = self.try_mode(at)
            {
                return Some((at, leaving));
            }
        }
        None
    }

    /// A mode that holds on some interval after now: from one implicit step of the complementarity system at several
    /// lengths, from their neighbours. Every candidate is inspected; a mode that passes
    /// is a solution, whoever proposed it.
    pub(super) fn find_mode(
        &mut self,
        key: &Key,
        trigger: Trigger,
    ) -> Result<Option<(usize, Vec<usize>)>, Error> {
        let mut tried: Vec<Vec<bool>> = Vec::new();
        // A thyristor that fires where ideal devices short it has its share of their current, by which it holds itself when the gate ends: the
        // mode before holds without it, too.
        let fires = self.table.fires(&self.key.switches, &key.switches);
        if trigger == Trigger::Sources && !fires || self.table.pairs == 0 {
            tried.push(key.closed.clone());
            if let Some(found) = self.try_key(key) {
                return Ok(Some(found));
            }
        }
        if self.table.pairs == 0 {
            return Ok(None);
        }
        if key.sliding.is_empty() || self.table.free(key).is_ok() {
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
        for j in 0..self.table.pairs {
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
        let mut walked: Vec<Vec<bool>> = Vec::new();
        for start in tried.iter().take(proposed) {
            let mut closed = start.clone();
            for _ in 0..2 * self.table.pairs {
                if walked.contains(&closed) {
                    break;
                }
                walked.push(closed.clone());
                let candidate = key.with_closed(closed.clone());
                let Some(at) = self.table.mode(&candidate, self.sources) else {
                    break;
                };
                match self.inspect(at) {
                    Finding::Holds(leaving) => return Some((at, leaving)),
                    Finding::Refused(guard) => {
                        let Owner::Device(pair) = self.table.modes[at].owner(guard) else {
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
            }
        }
        for closed in walked {
            if !tried.contains(&closed) {
                tried.push(closed);
            }
        }
        None
    }

    /// Modes proposed by one implicit step of several lengths.
    fn try_proposals(
        &mut self,
        key: &Key,
        tried: &mut Vec<Vec<bool>>,
    ) -> Result<Option<(usize, Vec<usize>)>, Error> {
        let t = self.t;
        let fastest = self.table.fastest();
        let free = self.table.free(key)?;
        let x = free.state_from(&self.storage.values);
        for (k, part) in self.memory.proposals.into_iter().enumerate() {
            let h = part / fastest;
            let u = self.sources.inputs(t + h);
            self.report.lcp_solves += 1;
            let Some(proposal) = self.table.free(key)?.propose(&x, &u, h) else {
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
                    self.memory.proposals[..=k].rotate_right(1);
                    return Ok(Some(found));
                }
            }
        }
        Ok(None)
    }

    pub(super) fn try_key(&mut self, key: &Key) -> Option<(usize, Vec<usize>)> {
        let at = self.table.mode(key, self.sources)?;
        self.try_mode(at).map(|leaving| (at, leaving))
    }

    fn inspect(&mut self, at: usize) -> Finding {
        if let Some(guard) = self.memory.bar(at) {
            return Finding::Refused(guard);
        }
        self.inspector.inspect(
            &mut self.table.modes[at],
            (&self.sources.exosystem, self.t, &self.sources.z),
            &self.storage.values,
            (&self.storage.scale, &self.storage.known),
        )
    }

    pub(super) fn try_mode(&mut self, at: usize) -> Option<Vec<usize>> {
        match self.inspect(at) {
            Finding::Holds(leaving) => Some(leaving),
            Finding::Inconsistent | Finding::Refused(_) => None,
        }
    }
}
