//! Positions of switches, comparators and diodes at one instant.

use std::cell::Cell;
use std::collections::HashMap;
use std::rc::Rc;

use super::network::{Device, Mode, Row};
use super::{Declined, Network, curved, spend};

/// What everything depends on at one instant: states, sources and the derivatives of the sources.
pub(super) struct Instant<'a> {
    pub(super) x: &'a [f64],
    pub(super) u: &'a [f64],
    pub(super) slopes: &'a [f64],
}

/// Modes that have been seen.
pub(super) struct Modes<'n> {
    pub(super) network: &'n Network,
    budget: &'n Cell<u64>,
    known: HashMap<Vec<bool>, Rc<Mode>>,
}

/// A guard within this part of the sum of its terms' sizes is zero; where positions do not settle, larger parts are.
const ZERO: [f64; 4] = [4e-15, 1e-13, 1e-11, 1e-9];

/// Value and derivative of a guard, each with the size of its terms.
struct Guard {
    value: f64,
    size: f64,
    rate: f64,
    rate_size: f64,
}

impl<'n> Modes<'n> {
    pub(super) fn new(network: &'n Network, budget: &'n Cell<u64>) -> Self {
        Self {
            network,
            budget,
            known: HashMap::new(),
        }
    }

    pub(super) fn get(&mut self, positions: &[bool]) -> Result<Rc<Mode>, Declined> {
        if let Some(mode) = self.known.get(positions) {
            return Ok(Rc::clone(mode));
        }
        spend(self.budget, self.network.work());
        let mode = Rc::new(self.network.mode(positions)?);
        self.known.insert(positions.to_vec(), Rc::clone(&mode));
        Ok(mode)
    }

    fn guard(&self, mode: &Mode, row: &Row, at: &Instant<'_>, known: &[f64]) -> Guard {
        let n = at.x.len();
        let terms = |values: &mut dyn Iterator<Item = (f64, f64)>| {
            values.fold((0.0, 0.0), |(s, m), (a, b)| (s + a * b, m + (a * b).abs()))
        };
        let (value, size) = terms(&mut row.iter().copied().zip(known.iter().copied()));
        let rates = mode.rates.iter().map(|r| curved::dot(r, known));
        let pairs = row[..n]
            .iter()
            .copied()
            .zip(rates)
            .chain(row[n..].iter().copied().zip(at.slopes.iter().copied()));
        let (rate, rate_size) = terms(&mut { pairs });
        Guard {
            value,
            size,
            rate,
            rate_size,
        }
    }

    /// Whether a device leaves its position now.
    fn leaves(&self, mode: &Mode, k: usize, on: bool, at: &Instant<'_>, zero: f64) -> bool {
        let known = curved::known(self.network, mode, at.x, at.u);
        let guard = self.guard(mode, &mode.guards[k], at, &known);
        if guard.value.abs() > zero * guard.size {
            return guard.value < 0.0;
        }
        if guard.rate.abs() > zero * guard.rate_size {
            return guard.rate < 0.0;
        }
        // A switch whose control rests on its threshold is off.
        on && matches!(self.network.devices[k], Device::Switch { on: a, off: b, .. } if a == b)
    }

    /// Positions in which everything agrees, starting from `positions`.
    pub(super) fn settle(
        &mut self,
        positions: &mut [bool],
        at: &Instant<'_>,
    ) -> Result<(), Declined> {
        for _ in 0..40 {
            self.settle_diodes(positions, at)?;
            let mode = self.get(positions)?;
            let moved: Vec<usize> = (0..positions.len())
                .filter(|&k| !matches!(self.network.devices[k], Device::Diode { .. }))
                .filter(|&k| self.leaves(&mode, k, positions[k], at, 1e-12))
                .collect();
            if moved.is_empty() {
                return Ok(());
            }
            moved.iter().for_each(|&k| positions[k] ^= true);
        }
        Err(Declined("switch positions do not settle".into()))
    }

    /// All that disagree at once, and after a while the first one alone (K. G. Murty's rule, which ends for a P-matrix).
    fn settle_diodes(&mut self, positions: &mut [bool], at: &Instant<'_>) -> Result<(), Declined> {
        for round in 0..400 {
            let zero = ZERO[round / 100];
            let mode = self.get(positions)?;
            let mut wrong = (0..positions.len())
                .filter(|&k| matches!(self.network.devices[k], Device::Diode { .. }))
                .filter(|&k| self.leaves(&mode, k, positions[k], at, zero));
            let wrong: Vec<usize> = if round % 100 < 8 {
                wrong.collect()
            } else {
                wrong.next().into_iter().collect()
            };
            if wrong.is_empty() {
                return Ok(());
            }
            wrong.iter().for_each(|&k| positions[k] ^= true);
        }
        Err(Declined("diodes do not settle".into()))
    }
}
