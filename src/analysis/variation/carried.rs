//! What measurements make of all that may change along a run, before there is a value that changes it.

use nalgebra::{DMatrix, DVector};

use super::change::{Change, Changes, Guard};
use super::forms::{Forms, edge};
use super::{System, Trajectory};
use crate::integrate::Error;

/// What measurements make of changes, by measurement.
#[derive(Debug, Clone)]
pub(crate) struct Carried {
    /// By system what its [`Change`] is times.
    pub(super) systems: Vec<Vec<Change>>,
    /// What a guard's change over [x | u | u' | 1] is times.
    pub(super) guards: Vec<(Guard, Vec<DVector<f64>>)>,
    /// By event what δt is times where sources decide it.
    pub(super) edges: Vec<DVector<f64>>,
    /// What δs at the start is times, q×measurements.
    pub(crate) start: DMatrix<f64>,
}

/// A sum, and the absolute values of its terms together: rounding is relative to these.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Summed {
    pub(crate) sum: f64,
    pub(crate) terms: f64,
}

impl Summed {
    /// Adds ⟨a, b⟩.
    fn add_dot(&mut self, a: &[f64], b: &[f64]) {
        let mut own = Self::default();
        for (a, b) in a.iter().zip(b) {
            own.add(a * b);
        }
        self.sum += own.sum;
        self.terms += own.terms;
    }

    fn add(&mut self, term: f64) {
        self.sum += term;
        self.terms += term.abs();
    }
}

impl Carried {
    pub(super) fn none(trajectory: &Trajectory, costates: usize) -> Self {
        let of = |system: &System| {
            let lcs = &system.lcs;
            let (n, p, q) = (lcs.n(), lcs.p(), lcs.storage.names.len());
            let none = Change {
                rate: DMatrix::zeros(n, n + 2 * p + 1),
                outputs: DMatrix::zeros(lcs.outputs.names.len(), n + 2 * p + 1),
                storage: DMatrix::zeros(q, n + p + 1),
                inject: DMatrix::zeros(n, q + p + 1),
            };
            vec![none; costates]
        };
        Self {
            systems: trajectory.systems.iter().map(of).collect(),
            guards: Vec::new(),
            edges: vec![DVector::zeros(costates); trajectory.saltations.len()],
            start: DMatrix::zeros(0, costates),
        }
    }

    pub(super) fn add_guard(&mut self, guard: Guard, rows: &[DVector<f64>]) {
        match self.guards.iter_mut().find(|(own, _)| *own == guard) {
            Some((_, own)) => own.iter_mut().zip(rows).for_each(|(own, row)| *own += row),
            None => self.guards.push((guard, rows.to_vec())),
        }
    }

    /// dJ with ln p by measurement, where the storage at the start changes as `start` has it, if it does.
    ///
    /// # Errors
    /// The derivative does not exist.
    pub(crate) fn with(
        &self,
        (trajectory, forms): (&Trajectory, &Forms),
        changes: &Changes,
        start: Option<&DVector<f64>>,
    ) -> Result<Vec<Summed>, Error> {
        let costates = self.start.ncols();
        let mut found = vec![Summed::default(); costates];
        for (change, sums) in changes.systems.iter().zip(&self.systems) {
            for (found, sums) in found.iter_mut().zip(sums) {
                for (change, sums) in [
                    (&change.rate, &sums.rate),
                    (&change.outputs, &sums.outputs),
                    (&change.storage, &sums.storage),
                    (&change.inject, &sums.inject),
                ] {
                    found.add_dot(change.as_slice(), sums.as_slice());
                }
            }
        }
        for (guard, rows) in &self.guards {
            if let Some(change) = changes.guard(*guard) {
                for (found, row) in found.iter_mut().zip(rows) {
                    found.add_dot(change.as_slice(), row.as_slice());
                }
            }
        }
        let moves = !changes.moving.is_empty();
        for (k, weights) in self.edges.iter().enumerate().filter(|_| moves) {
            if weights.iter().any(|weight| *weight != 0.0) {
                let dt = edge(trajectory, (forms, &changes.moving), k)?;
                found
                    .iter_mut()
                    .zip(weights)
                    .for_each(|(found, weight)| found.add(weight * dt));
            }
        }
        if let Some(start) = start {
            let own = found.iter_mut().zip(self.start.column_iter());
            own.for_each(|(found, own)| found.add_dot(own.as_slice(), start.as_slice()));
        }
        Ok(found)
    }
}
