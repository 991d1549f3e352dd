//! From one mode to the next: positions of the switches, impulse of the devices, conducting devices.

use super::free::Degenerate;
use super::inspect::{Finding, Inspector};
use super::mode::Key;
use super::stepper::Exact;
use crate::integrate::run::{Log, Reason, SimError};

/// Lengths of the implicit step that proposes the next mode, in units of the fastest time constant seen.
pub(super) const PROPOSALS: [f64; 7] = [1e-6, 1e-4, 1e-8, 1e-2, 1e-10, 1.0, 1e2];
/// Modes tried around the proposals before the search ends.
const MOST_NEIGHBOURS: usize = 400;
/// Events at one instant after which modes already left there are not entered again.
const PATIENCE: usize = 2;

/// Transitions remembered; the oldest goes first.
const MOST_SUCCESSORS: usize = 64;

/// Why a mode is left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Trigger {
    /// This guard fell through zero.
    Guard(usize),
    /// Sources or switches they drive changed.
    Sources,
}

/// Relative to the largest output: two rows at one time that differ by more are a step, not rounding.
const STEP: f64 = 1e-10;

/// Whether an output steps from one row to the other: with a source, or because a switch moves.
fn is_step(left: &[f64], right: &[f64]) -> bool {
    let rows = || left.iter().zip(right);
    let largest = rows().fold(0.0, |most: f64, (a, b)| most.max(a.abs()).max(b.abs()));
    rows().any(|(a, b)| (a - b).abs() > STEP * largest)
}

impl Exact<'_> {
    /// Finds the mode from here on: positions of the switches, impulse of the devices, conducting devices.
    pub(super) fn change(
        &mut self,
        mut key: Key,
        mut discontinuous: bool,
        trigger: Trigger,
        log: &mut Log,
    ) -> Result<(), SimError> {
        let t = self.motion.t;
        let wants_rows = log.wants_rows();
        if wants_rows && self.started {
            self.read_row();
        }
        let left_row = (wants_rows && self.started).then(|| self.row.clone());
        let mut jumped = false;
        let mut positions = vec![key.switches.clone()];
        let mut closed_sets: Vec<Vec<bool>> = Vec::new();
        let mut entry = None;
        for _ in 0..3 + 2 * self.plant.thresholds.len() {
            // A device event in a convex circuit is continuous; an edge or a switch may need an impulse.
            let mut found = self.follow(&key, trigger);
            if found.is_none() && !discontinuous {
                found = self.find_mode(&key, trigger)?;
            }
            if found.is_none() && !key.sliding.is_empty() {
                key.sliding.clear();
                discontinuous = true;
                continue;
            }
            if found.is_none() {
                jumped |= self.project(&key, log)?;
                found = self.find_mode(&key, trigger)?;
            }
            if found.is_none() && self.plant.pairs > 0 {
                found = self.jump_into(&key, log)?;
                jumped |= found.is_some();
            }
            let Some((at, leaving)) = found else {
                return Err(self.fail(Reason::Infeasible));
            };
            key.closed.clone_from(&self.plant.modes[at].key.closed);
            if leaving.is_empty() {
                entry = Some(at);
                break;
            }
            closed_sets.push(key.closed.clone());
            for &i in &leaving {
                key.switches[i] = !key.switches[i];
            }
            if positions.contains(&key.switches) {
                entry = self.slide(&key, &leaving, &closed_sets);
                break;
            }
            positions.push(key.switches.clone());
            discontinuous = true;
        }
        let Some(at) = entry else {
            let names: Vec<&str> = self
                .plant
                .thresholds
                .iter()
                .map(|t| t.name.as_str())
                .collect();
            return Err(self
                .fail(Reason::SwitchesDoNotSettle)
                .device(names.join(", ")));
        };
        if let (Some(from), false) = (self.mode, jumped) {
            self.remember((from, trigger, at));
        }
        let same = self.mode == Some(at);
        self.report(at, jumped, log)?;
        self.note_slides(at);
        self.mode = Some(at);
        self.key.clone_from(&self.plant.modes[at].key);
        let mode = &self.plant.modes[at];
        let Inspector { x, amplitude, .. } = &self.inspector;
        self.motion
            .enter(&mode.flow, &self.exosystem, t, x, amplitude);
        self.look_ahead();
        if jumped {
            self.jumps += 1;
        }
        if let Some(left) = left_row {
            self.read_row();
            let step = jumped || is_step(&left, &self.row);
            if step {
                log.row(t, &left);
            }
            if step || !same {
                log.row(t, &self.row);
            }
        }
        Ok(())
    }

    /// The mode in which these switches stay on their thresholds, where closing and opening contradict each other.
    fn slide(&mut self, key: &Key, switches: &[usize], closed_sets: &[Vec<bool>]) -> Option<usize> {
        /// Switches that may start to slide together.
        const MOST: usize = 4;
        if switches.len() > MOST {
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
        for closed in candidates {
            for signs in 0..1_u32 << switches.len() {
                let mut candidate = key.with_closed(closed.clone());
                let new = switches
                    .iter()
                    .enumerate()
                    .map(|(k, &i)| (i, signs >> k & 1 == 0));
                candidate.sliding.extend(new);
                candidate.sliding.sort_unstable();
                candidate.sliding.dedup_by_key(|s| s.0);
                // The position that a sliding switch came from does not matter.
                for &(i, _) in &candidate.sliding {
                    candidate.switches[i] = false;
                }
                if let Some((at, leaving)) = self.try_key(&candidate, &[])
                    && leaving.is_empty()
                {
                    return Some(at);
                }
            }
        }
        None
    }

    /// Remembers what followed.
    fn remember(&mut self, step: (usize, Trigger, usize)) {
        if let Some(k) = self.successors.iter().position(|s| *s == step) {
            self.successors.swap(k, 0);
        } else {
            if self.successors.len() == MOST_SUCCESSORS {
                self.successors.pop();
            }
            self.successors.insert(0, step);
        }
    }

    /// The mode that followed the same trigger before, if it holds now.
    fn follow(&mut self, key: &Key, trigger: Trigger) -> Option<(usize, Vec<usize>)> {
        let from = self.mode?;
        for k in 0..self.successors.len() {
            let (left, why, at) = self.successors[k];
            if (left, why) == (from, trigger)
                && self.plant.modes[at].key.same_switches(key)
                && !(self.left_here.len() > PATIENCE && self.left_here.contains(&at))
                && let Some(leaving) = self.try_mode(at)
            {
                return Some((at, leaving));
            }
        }
        None
    }

    /// Modes that were left at this instant too often to be entered again.
    fn barred(&self) -> Vec<usize> {
        if self.left_here.len() > PATIENCE {
            self.left_here.clone()
        } else {
            Vec::new()
        }
    }

    /// A mode that holds on some interval after now: from one implicit step of the complementarity system at several
    /// lengths, from their neighbours. Every candidate is inspected; a mode that passes
    /// is a solution, whoever proposed it.
    pub(super) fn find_mode(
        &mut self,
        key: &Key,
        trigger: Trigger,
    ) -> Result<Option<(usize, Vec<usize>)>, SimError> {
        let barred = self.barred();
        let mut tried: Vec<Vec<bool>> = Vec::new();
        if trigger == Trigger::Sources || self.plant.pairs == 0 {
            tried.push(key.closed.clone());
            if let Some(found) = self.try_key(key, &barred) {
                return Ok(Some(found));
            }
        }
        if self.plant.pairs == 0 {
            return Ok(None);
        }
        if key.sliding.is_empty() || self.plant.free(key).is_ok() {
            if let Some(found) = self.try_proposals(key, &mut tried, &barred)? {
                return Ok(Some(found));
            }
        } else if !tried.contains(&key.closed) {
            // On a threshold the circuit may have no complementarity system; the modes around the present one remain.
            tried.push(key.closed.clone());
            if let Some(found) = self.try_key(key, &barred) {
                return Ok(Some(found));
            }
        }
        // Neighbours, nearest first.
        let mut next = 0;
        while next < tried.len() && tried.len() < MOST_NEIGHBOURS {
            for j in 0..self.plant.pairs {
                let mut closed = tried[next].clone();
                closed[j] = !closed[j];
                if tried.contains(&closed) {
                    continue;
                }
                tried.push(closed.clone());
                let candidate = key.with_closed(closed);
                if let Some(found) = self.try_key(&candidate, &barred) {
                    return Ok(Some(found));
                }
            }
            next += 1;
        }
        Ok(None)
    }

    /// Modes proposed by one implicit step of several lengths.
    fn try_proposals(
        &mut self,
        key: &Key,
        tried: &mut Vec<Vec<bool>>,
        barred: &[usize],
    ) -> Result<Option<(usize, Vec<usize>)>, SimError> {
        let t = self.motion.t;
        let fastest = self.plant.fastest();
        let free = self.plant.free(key)?;
        let x = free.state_from(&self.storage);
        for part in PROPOSALS {
            let h = part / fastest;
            let u = self.inputs(t + h);
            self.lcp_solves += 1;
            for degenerate in [Degenerate::Open, Degenerate::As(&key.closed)] {
                let proposal = self.plant.free(key)?.propose(&x, &u, h, degenerate);
                let Some(closed) = proposal.filter(|c| !tried.contains(c)) else {
                    continue;
                };
                tried.push(closed.clone());
                let candidate = key.with_closed(closed);
                if let Some(found) = self.try_key(&candidate, barred) {
                    return Ok(Some(found));
                }
            }
        }
        Ok(None)
    }

    pub(super) fn try_key(&mut self, key: &Key, barred: &[usize]) -> Option<(usize, Vec<usize>)> {
        let at = self
            .plant
            .mode(key, &self.exosystem)
            .filter(|at| !barred.contains(at))?;
        self.try_mode(at).map(|leaving| (at, leaving))
    }

    pub(super) fn try_mode(&mut self, at: usize) -> Option<Vec<usize>> {
        let mode = &self.plant.modes[at];
        match self.inspector.inspect(
            mode,
            &self.exosystem,
            self.motion.t,
            &self.storage,
            &self.scale,
        ) {
            Finding::Holds(leaving) => Some(leaving),
            Finding::Inconsistent | Finding::Refused(_) => None,
        }
    }
}
