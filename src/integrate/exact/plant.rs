//! The circuit in all positions visited so far.

use std::collections::BTreeMap;

use super::exosystem::Exosystem;
use super::free::Free;
use super::mode::{Key, Mode};
use super::schedule::Drive;
use crate::integrate::run::SimError;
use crate::integrate::switching::Threshold;
use crate::lcs::{Hold, Lcs};

/// Reduces the circuit with its devices held or free, for a switch position.
pub type Assemble<'a> = Box<dyn FnMut(&[Hold], &[bool]) -> Result<Lcs, SimError> + 'a>;

/// Systems and modes, created when first visited.
pub(crate) struct Plant<'a> {
    assemble: Assemble<'a>,
    /// Number of device pairs.
    pub(crate) pairs: usize,
    pub(crate) thresholds: Vec<Threshold>,
    /// Switches that sources alone drive.
    pub(crate) drives: Vec<Drive>,
    h: f64,
    energy: bool,
    tolerance: f64,
    frees: Vec<(Vec<bool>, Free)>,
    index: BTreeMap<Key, Option<usize>>,
    pub(crate) modes: Vec<Mode>,
}

impl<'a> Plant<'a> {
    /// A plant without modes; `h` is the output step, `energy` asks for the balance, `tolerance` that of complementarity residuals.
    pub(crate) fn new(
        assemble: Assemble<'a>,
        pairs: usize,
        thresholds: Vec<Threshold>,
        h: f64,
        energy: bool,
        tolerance: f64,
    ) -> Self {
        Self {
            assemble,
            pairs,
            drives: Vec::new(),
            thresholds,
            h,
            energy,
            tolerance,
            frees: Vec::new(),
            index: BTreeMap::new(),
            modes: Vec::new(),
        }
    }

    /// The complementarity system for a switch position.
    pub(crate) fn free(&mut self, switches: &[bool]) -> Result<&mut Free, SimError> {
        let at = match self.frees.iter().position(|(p, _)| p == switches) {
            Some(at) => at,
            None => {
                let lcs = (self.assemble)(&vec![Hold::Free; self.pairs], switches)?;
                self.frees
                    .push((switches.to_vec(), Free::new(lcs, self.tolerance)));
                self.frees.len() - 1
            }
        };
        Ok(&mut self.frees[at].1)
    }

    /// The mode of this name; `None` where the circuit has no such mode (its reduction or its numbers do not exist).
    pub(crate) fn mode(&mut self, key: &Key, exosystem: &Exosystem) -> Option<usize> {
        if let Some(&known) = self.index.get(key) {
            return known;
        }
        let holds: Vec<Hold> = key
            .closed
            .iter()
            .map(|&c| if c { Hold::Closed } else { Hold::Open })
            .collect();
        let mode = (self.assemble)(&holds, &key.switches).ok().and_then(|lcs| {
            Mode::new(
                key.clone(),
                &lcs,
                exosystem,
                &self.thresholds,
                &self.drives,
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

    /// The fastest rate seen, 1/s.
    pub(crate) fn fastest(&self) -> f64 {
        self.modes
            .iter()
            .map(|m| 1.0 / m.flow.step(m.flow.bottom()))
            .fold(1.0 / self.h, f64::max)
    }

    /// Factorisations spent in complementarity problems.
    pub(crate) fn factorisations(&self) -> u64 {
        self.frees.iter().map(|(_, f)| f.factorisations()).sum()
    }
}
