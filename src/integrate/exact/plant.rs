//! The circuit in all positions visited so far.

use std::collections::{BTreeMap, VecDeque};

use super::assembler::{Assembler, Step};
use super::flow::longest_step;
use super::free::Free;
use super::key::{Key, Owner};
use super::mode::{Mode, SwitchFacts};
use super::sources::Sources;
use crate::integrate::error::Error;
use crate::integrate::switching::Threshold;
use crate::lcs::Hold;
use crate::mna::SourceControl;
use crate::settings::Settings;

/// Modes and systems that are kept whatever they take: those that a period of a circuit goes through by turns.
const TURNS: usize = 8;

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
    /// See [`Settings::max_kept`].
    most: usize,
    /// Those made last first.
    frees: VecDeque<(Key, Free)>,
    /// Bytes of their matrices, and factorisations of those given up.
    free_bytes: usize,
    given_up: u64,
    index: BTreeMap<Key, Option<usize>>,
    pub(crate) modes: Vec<Mode>,
    /// By mode: when it was left last, counted in changes of mode, and the bytes that its flow kept then; their sum.
    left: Vec<(u64, usize)>,
    changes: u64,
    kept: usize,
}

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
            frees: VecDeque::new(),
            free_bytes: 0,
            given_up: 0,
            index: BTreeMap::new(),
            modes: Vec::new(),
            left: Vec::new(),
            changes: 0,
            kept: 0,
        }
    }

    /// Takes note that mode `at` is left. Where modes keep more than [`Settings::max_kept`] together, those that were left longest ago give up what
    /// can be made again.
    pub(crate) fn leave(&mut self, at: usize) {
        self.changes += 1;
        self.left.resize(self.modes.len(), (0, 0));
        let kept = self.modes[at].flow.kept();
        self.kept = self.kept + kept - self.left[at].1;
        self.left[at] = (self.changes, kept);
        if self.kept <= self.most {
            return;
        }
        let mut oldest: Vec<usize> = (0..self.left.len())
            .filter(|&k| self.left[k].1 > 0)
            .collect();
        oldest.sort_unstable_by_key(|&k| self.left[k].0);
        oldest.truncate(oldest.len().saturating_sub(TURNS));
        for k in oldest {
            if self.kept <= self.most / 2 {
                break;
            }
            self.modes[k].flow.forget();
            self.kept -= std::mem::take(&mut self.left[k].1);
        }
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
                self.frees
                    .push_front((key.clone(), Free::new(lcs, self.tolerance)));
                while self.free_bytes > self.most && self.frees.len() > TURNS {
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
        if let Some(&known) = self.index.get(key) {
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
        let at = mode.map(|mode| {
            self.modes.push(mode);
            self.modes.len() - 1
        });
        self.index.insert(key.clone(), at);
        at
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
        } = &self.modes[at].key;
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
    pub(crate) fn factorisations(&self) -> u64 {
        let known = self.frees.iter().map(|(_, f)| f.factorisations());
        self.given_up + known.sum::<u64>()
    }
}
