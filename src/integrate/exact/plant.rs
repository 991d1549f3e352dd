//! The circuit in all positions visited so far.

use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

use super::assembler::{Assembler, Step};
use super::flow::longest_step;
use super::free::Free;
use super::key::{Key, Owner};
use super::mode::{Mode, SwitchFacts};
use super::modes::{Modes, TURNS};
use super::sources::Sources;
use crate::integrate::error::Error;
use crate::integrate::event::Change;
use crate::integrate::stats::Stats;
use crate::integrate::switching::Threshold;
use crate::lcs::Hold;
use crate::mna::SourceControl;
use crate::settings::Settings;

/// Systems and modes, created when first visited.
pub(crate) struct ModeTable {
    assembler: Assembler,
    /// Number of device pairs.
    pub(crate) pairs: usize,
    pub(crate) thresholds: Vec<Threshold>,
    /// By switch: the pair in series with a thyristor's.
    pub(crate) valves: Vec<Option<usize>>,
    h: f64,
    energy: bool,
    tolerance: f64,
    /// What modes keep at most, and what systems do, bytes: see [`Settings::max_kept`].
    most: usize,
    most_of_systems: usize,
    /// Those made last first.
    frees: VecDeque<(Key, Free)>,
    /// Bytes of their matrices.
    free_bytes: usize,
    /// Factorisations of those given up.
    given_up: u64,
    /// How many were made, and how many of them with jump logic.
    made: (u64, u64),
    pub(crate) modes: Modes,
    /// By mode: what the log says about a change from there to other modes.
    labels: Vec<Vec<Label>>,
}

/// What the log says about a change to this mode.
type Label = (usize, Arc<[Change]>);

impl ModeTable {
    /// A table without modes; `h` is the output step, `energy` asks for the balance.
    pub(crate) fn new(assembler: Assembler, h: f64, energy: bool, settings: &Settings) -> Self {
        let thresholds = assembler.thresholds();
        let valve = |t: &Threshold| {
            let valve = t.valve()?;
            (0..assembler.pairs()).find(|&pair| assembler.device(pair) == Some(valve))
        };
        Self {
            pairs: assembler.pairs(),
            valves: thresholds.iter().map(valve).collect(),
            thresholds,
            assembler: assembler.with_span(longest_step(h)),
            h,
            energy,
            tolerance: settings.lcp_residual,
            most: settings.max_kept,
            most_of_systems: settings.max_kept,
            frees: VecDeque::new(),
            free_bytes: 0,
            given_up: 0,
            made: (0, 0),
            modes: Modes::default(),
            labels: Vec::new(),
        }
    }

    /// Whether its circuit differs from another's in names and waveforms alone.
    pub(crate) fn is_alike(&self, other: &Self) -> bool {
        (self.h, self.energy) == (other.h, other.energy)
            && self.assembler.is_alike(&other.assembler)
    }

    /// What modes and systems keep at most, bytes.
    pub(crate) fn keep_at_most(&mut self, (modes, systems): (usize, usize)) {
        (self.most, self.most_of_systems) = (modes, systems);
    }

    /// Takes note that mode `at` is left, see [`Modes::leave`].
    pub(crate) fn leave(&mut self, at: usize) {
        self.modes.leave(at, self.most);
    }

    /// What the log says about a change from one mode to another, found once.
    pub(crate) fn label(
        &mut self,
        from: usize,
        to: usize,
        find: impl FnOnce(&Self) -> Arc<[Change]>,
    ) -> Arc<[Change]> {
        let known = self.labels.get(from).map_or(&[][..], |known| known);
        if let Some((_, label)) = known.iter().find(|(at, _)| *at == to) {
            return Arc::clone(label);
        }
        let label = find(self);
        if self.labels.len() <= from {
            self.labels.resize(from + 1, Vec::new());
        }
        self.labels[from].push((to, Arc::clone(&label)));
        label
    }

    /// The complementarity system for the switch positions of a mode.
    pub(crate) fn free(&mut self, key: &Key) -> Result<&mut Free, Error> {
        let at = match self.frees.iter().position(|(k, _)| k.same_switches(key)) {
            Some(at) => at,
            None => {
                let free = vec![Hold::Free; self.pairs];
                let sliding = key.sliding_switches();
                let lcs = self.assembler.assemble(&free, &key.switches, &sliding)?;
                self.free_bytes += lcs.bytes();
                let free = Free::new(lcs, self.tolerance);
                self.made.0 += u64::from(free.lcs.m() > 0);
                self.made.1 += u64::from(free.is_impulsive());
                self.frees.push_front((key.clone(), free));
                while self.free_bytes > self.most_of_systems && self.frees.len() > TURNS {
                    if let Some((_, free)) = self.frees.pop_back() {
                        self.free_bytes -= free.lcs.bytes();
                        self.given_up += free.factorisations();
                    }
                }
                0
            }
        };
        Ok(&mut self.frees[at].1)
    }

    /// The mode of this name; `None` where the circuit has no such mode (its reduction or its numbers do not exist).
    pub(super) fn mode(&mut self, key: &Key, sources: &Sources) -> Option<usize> {
        if let Some(&known) = self.modes.index.get(key) {
            return known;
        }
        // A control that depends on nothing does not stay on its threshold.
        if key.sliding.iter().any(|s| sources.control(s.0)) {
            return None;
        }
        let holds: Vec<Hold> = key
            .closed
            .iter()
            .map(|&c| if c { Hold::Closed } else { Hold::Open })
            .collect();
        let limits: Vec<(f64, f64)> = key
            .sliding
            .iter()
            .map(|&(k, _)| self.assembler.limits(k))
            .collect();
        let sliding = key.sliding_switches();
        // Where there are no devices the system of the position is that of the mode.
        let system = if self.pairs == 0 && sliding.is_empty() {
            self.free(key).map(|free| free.lcs.clone())
        } else {
            self.assembler.assemble(&holds, &key.switches, &sliding)
        };
        let mode = system.ok().and_then(|lcs| {
            let facts = SwitchFacts {
                thresholds: &self.thresholds,
                limits: &limits,
                clocks: &sources.clocks,
            };
            Mode::new(
                key.clone(),
                &lcs,
                &sources.exosystem,
                &facts,
                self.h,
                self.energy,
            )
        });
        self.modes.insert(key, mode)
    }

    /// The switches of thyristors that hold themselves with valve `pair` in series.
    pub(crate) fn released(&self, pair: usize, position: &[bool]) -> Vec<usize> {
        let latches = self.thresholds.iter().zip(&self.valves).enumerate();
        let holding = latches.filter(|(i, (threshold, valve))| {
            **valve == Some(pair) && threshold.holds(position[*i], position)
        });
        holding.map(|(i, _)| i).collect()
    }

    /// Whether a thyristor's latch is on in position `after` and was off in `before`.
    pub(crate) fn fires(&self, before: &[bool], after: &[bool]) -> bool {
        let pairs = before.iter().zip(after).zip(&self.valves);
        let mut fired = pairs.map(|((before, after), valve)| valve.is_some() && !before && *after);
        fired.any(|fires| fires)
    }

    /// Thyristors that hold themselves in mode `at` although their valves block.
    pub(crate) fn let_go(&self, at: usize) -> impl Iterator<Item = usize> {
        let Key {
            closed, switches, ..
        } = &*self.modes[at].key;
        let blocks = |i: usize| self.valves[i].is_some_and(|pair| !closed[pair]);
        let thresholds = self.thresholds.iter().enumerate();
        let holding = thresholds.filter(|(i, t)| t.holds(switches[*i], switches));
        holding.map(|(i, _)| i).filter(move |&i| blocks(i))
    }

    /// The device or switch of a guard of mode `at`.
    pub(crate) fn owner_name(&self, at: usize, guard: usize) -> String {
        let name = match self.modes[at].owner(guard) {
            Owner::Switch(i) | Owner::Slide(i, _) => Some(self.thresholds[i].name.as_str()),
            Owner::Device(pair) => self.device(pair),
        };
        name.unwrap_or_default().to_string()
    }

    /// See [`Assembler::controls`].
    pub(crate) fn controls(&self) -> (Vec<bool>, Vec<SourceControl>) {
        self.assembler.controls()
    }

    /// Where function blocks jump.
    pub(crate) fn steps(&self) -> &[Step] {
        self.assembler.steps()
    }

    /// Distance of output times, s.
    pub(crate) fn output_step(&self) -> f64 {
        self.h
    }

    /// The device of a pair.
    pub(crate) fn device(&self, pair: usize) -> Option<&str> {
        self.assembler.device(pair)
    }

    /// The fastest rate seen, 1/s.
    pub(crate) fn fastest(&self) -> f64 {
        self.modes
            .iter()
            .map(|m| 1.0 / m.flow.step(m.flow.bottom()))
            .fold(1.0 / self.h, f64::max)
    }

    /// Factorisations spent in complementarity problems.
    pub(crate) fn made(&self) -> Stats {
        let positions = self.modes.index.iter().filter(|(_, mode)| mode.is_some());
        let positions: BTreeSet<_> = positions
            .map(|(key, _)| (&key.switches, &key.sliding))
            .collect();
        Stats {
            modes: self.modes.len() as u64,
            positions: positions.len() as u64,
            systems: self.made.0,
            impulsive: self.made.1,
            factorisations: self.factorisations(),
            ..Stats::default()
        }
    }

    fn factorisations(&self) -> u64 {
        let known = self.frees.iter().map(|(_, f)| f.factorisations());
        self.given_up + known.sum::<u64>()
    }
}
