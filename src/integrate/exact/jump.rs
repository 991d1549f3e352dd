//! Jumps of the state: by projection in the energy metric, or into a mode that small steps propose.

use nalgebra::DVector;

use super::inspect::Finding;
use super::key::{Key, Trigger};
use super::transition::Transition;
use crate::integrate::energy::{self, Balance};
use crate::integrate::error::{Error, Reason};
use crate::integrate::impulses;
use crate::integrate::jump::rivals_note;
use crate::integrate::log::Log;
use crate::integrate::settle;
use crate::integrate::stats::JumpReason;
use crate::settings::tolerances::events::NOISE;
use crate::settings::tolerances::exponentials::PROPOSALS;
use crate::settings::tolerances::jumps::NO_JUMP;

/// What stood before a jump.
pub(super) struct Before {
    storage: Vec<f64>,
    balance: Balance,
    /// Impulses in the log.
    impulses: usize,
}

impl Transition<'_> {
    /// What stands before a jump from here.
    pub(super) fn before_jump(&self, log: &Log) -> Before {
        Before {
            storage: self.storage.values.clone(),
            balance: self.storage.balance,
            impulses: log.impulses.len(),
        }
    }

    /// Ends a jump into `key` where the first of the switches `leaving` pass their thresholds on the way, and returns these, see
    /// [`settle::interruption`].
    pub(super) fn interrupt(
        &mut self,
        before: &Before,
        key: &Key,
        leaving: &[usize],
        log: &mut Log,
    ) -> Result<Option<Vec<usize>>, Error> {
        let left = self.key.clone();
        if !left.sliding.is_empty() || !key.sliding.is_empty() {
            return Ok(None);
        }
        let u = self.sources.inputs(self.t);
        let [start, end] =
            [&before.storage, &self.storage.values].map(|s| DVector::from_column_slice(s));
        let left = self.table.free(&left)?.lcs.clone();
        let thresholds = self.table.thresholds.clone();
        let found = settle::interruption(
            (&left, &self.table.free(key)?.lcs),
            &thresholds,
            (&key.switches, leaving),
            (&start, &end),
            &u,
        );
        let Some((part, first)) = found else {
            return Ok(None);
        };
        let change = end - &start;
        let square = self.storage.stored(change.as_slice());
        self.storage
            .balance
            .take_part(&before.balance, part, square);
        self.storage
            .values
            .copy_from_slice((start + change * part).as_slice());
        for impulse in &mut log.impulses[before.impulses..] {
            impulse.area *= part;
        }
        Ok(Some(first))
    }

    /// The devices' impulse at the present storage in a switch position, by projection in the energy metric. Returns
    /// whether the storage moved.
    pub(super) fn project(&mut self, key: &Key, log: &mut Log) -> Result<bool, Error> {
        let t = self.t;
        let u = self.sources.inputs(t);
        self.note_switch_rivals(key, &u);
        let free = self.table.free(key).map_err(|mut error| {
            error.t = error.t.or(Some(t));
            error
        })?;
        let x = free.state_from(&self.storage.values);
        self.report.lcp_solves += u64::from(free.lcs.m() > 0);
        // Where the projection finds nothing admissible, jumps into proposed modes are tried.
        let (after, p) = match free.jump(&x, &u) {
            Ok(Some(jump)) => {
                let checked = free.verify(&jump);
                let checked = checked.map_err(|broken| Error::at(t, Reason::Internal(broken)));
                checked?;
                if !self.report.noted_rivals
                    && let Some(note) = jump.note(&free.lcs, t)
                {
                    self.report.noted_rivals = true;
                    self.report.notes.push(note);
                }
                (jump.x, jump.p)
            }
            Ok(None) | Err(_) => (x.clone(), DVector::zeros(free.lcs.m())),
        };
        self.leap(key, &x, &after, &p, log)
    }

    /// Notes switches that join capacitors now (or part inductors) while devices would take an impulse without them, where each of the
    /// two impulses takes from the other, ⟨Δs of the switches, Δs of the devices⟩ > 0 in the energy metric: with resistances the
    /// faster of them leaves less for the other, and the order of their ends depends on ratios.
    fn note_switch_rivals(&mut self, key: &Key, u: &DVector<f64>) {
        if self.report.noted_rivals || self.table.pairs == 0 || !key.sliding.is_empty() {
            return;
        }
        let moved = |i: &usize| {
            let stood = if self.started {
                self.key.switches[*i]
            } else {
                false
            };
            key.switches[*i] != stood
        };
        let moved: Vec<usize> = (0..key.switches.len()).filter(moved).collect();
        let mut before = key.clone();
        for &i in &moved {
            before.switches[i] = !before.switches[i];
        }
        let s = DVector::from_column_slice(&self.storage.values);
        let Ok(free) = self.table.free(key) else {
            return;
        };
        let joining = free.storage(&free.state_from(&self.storage.values), u) - &s;
        let sizes = self.storage.scale.iter().zip(&joining);
        if moved.is_empty() || sizes.clone().all(|(size, d)| d.abs() <= NO_JUMP * size) {
            return;
        }
        let Ok(free) = self.table.free(&before) else {
            return;
        };
        let x = free.state_from(&self.storage.values);
        let Ok(Some(jump)) = free.jump(&x, u) else {
            return;
        };
        let change = free.storage(&jump.x, u) - free.storage(&x, u);
        let [one, other, both] = [&joining, &change, &(&joining + &change)]
            .map(|change| self.storage.stored(change.as_slice()));
        // 2⟨a, b⟩ = ‖a + b‖² − ‖a‖² − ‖b‖²
        if both - one - other <= NO_JUMP * one.max(other) {
            return;
        }
        let ports = free.lcs.ports.iter().zip(&jump.p);
        let devices = ports
            .filter(|(_, p)| **p > 0.0)
            .map(|(port, _)| port.device.clone());
        let mut names: Vec<String> = devices.collect();
        names.dedup();
        let switches = moved.iter().map(|&i| self.table.thresholds[i].name.clone());
        names.extend(switches);
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        self.report.noted_rivals = true;
        let note = rivals_note(&names, self.t);
        self.report.notes.push(note);
    }

    /// Carries out a jump of the free state from x to `after` by impulses p, with its impulses and energies.
    pub(super) fn leap(
        &mut self,
        key: &Key,
        x: &DVector<f64>,
        after: &DVector<f64>,
        p: &DVector<f64>,
        log: &mut Log,
    ) -> Result<bool, Error> {
        let t = self.t;
        let u = self.sources.inputs(t);
        let free = self.table.free(key)?;
        let mut s = free.storage(after, &u);
        // What fast and slow states of another basis add up to nothing is no change; what is rounding of the value before is zero, so that a
        // circuit which comes to rest is at rest.
        let rounding = free.storage_rounding(after, &u);
        for ((new, old), rounding) in s.iter_mut().zip(&self.storage.values).zip(&rounding) {
            if (*new - old).abs() <= *rounding {
                *new = *old;
            } else if new.abs() <= NOISE * f64::EPSILON * old.abs() {
                *new = 0.0;
            }
        }
        let joined = free.storage(x, &self.sources.before);
        let lcs = &free.lcs;
        self.storage
            .balance
            .add_jump(energy::taking_over(lcs, &self.storage.values, x, &joined));
        let step = &u - &self.sources.before;
        if after != x || [p, &step].iter().any(|all| all.iter().any(|v| *v != 0.0)) {
            for (name, area) in impulses::of_jump(lcs, p, step.as_slice()) {
                log.impulse(t, name, area);
            }
            let source = energy::source_work_of_jump(
                lcs,
                x.as_slice(),
                after.as_slice(),
                self.sources.before.as_slice(),
                u.as_slice(),
                p.as_slice(),
            );
            let loss = energy::loss_of_jump(lcs, x, after, &u, p, free.is_projected());
            self.storage.balance.add_jump((source, loss));
        }
        self.sources.before = u;
        let moved = s
            .iter()
            .zip(&self.storage.values)
            .zip(&self.storage.scale)
            .any(|((a, b), scale)| (a - b).abs() > NO_JUMP * scale.max(a.abs()));
        self.storage.values.copy_from_slice(s.as_slice());
        if moved {
            self.inspector.forget_pace();
        }
        self.storage.rescale();
        Ok(moved)
    }

    /// What makes the state jump into mode `at`.
    pub(super) fn jump_reason(&self, at: usize, trigger: Trigger) -> JumpReason {
        if !self.started {
            return JumpReason::Start;
        }
        let new = &self.table.modes[at].key.switches;
        let thresholds = self.table.thresholds.iter().enumerate();
        let moved = thresholds
            .filter(|(i, t)| !t.is_rest() && self.key.switches.get(*i) != new.get(*i))
            .map(|(_, t)| t.name.as_str());
        let moved: Vec<&str> = moved.collect();
        match (trigger, self.mode) {
            _ if !moved.is_empty() => JumpReason::Switch(moved.join(", ")),
            (Trigger::Guard(guard), Some(from)) => {
                JumpReason::Device(self.table.owner_name(from, guard))
            }
            _ => JumpReason::SourceEdge,
        }
    }

    /// A jump into a mode that small implicit steps propose, proved by its impulse.
    pub(super) fn jump_into(
        &mut self,
        key: &Key,
        log: &mut Log,
    ) -> Result<Option<(usize, Vec<usize>)>, Error> {
        let t = self.t;
        let fastest = self.table.fastest();
        let x = self.table.free(key)?.state_from(&self.storage.values);
        for part in PROPOSALS {
            let h = part / fastest;
            let u = self.sources.inputs(t + h);
            self.report.lcp_solves += 1;
            let free = self.table.free(key)?;
            let Some(proposal) = free.propose(&x, &u, h) else {
                continue;
            };
            let candidate = key.with_closed(proposal.open());
            let Some(at) = self.table.mode(&candidate, self.sources) else {
                continue;
            };
            let mode = &self.table.modes[at];
            let Some(s) = self
                .inspector
                .project(mode, &self.sources.z, &self.storage.values)
            else {
                continue;
            };
            let free = self.table.free(key)?;
            let after = free.state_from(&s);
            let Some(p) = free.impulse_between(&x, &after, &candidate.closed) else {
                continue;
            };
            let mode = &mut self.table.modes[at];
            if let Finding::Holds(leaving) = self.inspector.inspect(
                mode,
                (&self.sources.exosystem, t, &self.sources.z),
                &s,
                (&self.storage.scale, &self.storage.scale),
            ) {
                self.leap(key, &x, &after, &p, log)?;
                return Ok(Some((at, leaving)));
            }
        }
        Ok(None)
    }
}
