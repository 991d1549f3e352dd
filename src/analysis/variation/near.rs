//! The circuit with a value p a little aside, and differences of it.
//!
//! Matrices, guards and sources are differentiated by extrapolated differences of the circuits with p (1 ± h) and p (1 ± 2h), which are reduced for the
//! same modes: they are rational functions of p, so that nothing of a run's events is in the differences.

use nalgebra::DMatrix;

use super::system::Row;
use super::{System, Trajectory, not_smooth};
use crate::circuit::Source;
use crate::integrate::exact::{Assembler, Owner};
use crate::integrate::switching::Threshold;
use crate::integrate::{Error, Simulation};
use crate::settings::tolerances::periodic::VALUE_STEP;

/// The circuits that are compared, in steps of p h.
pub(crate) const STEPS: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];

/// (8 (f(h) − f(−h)) − (f(2h) − f(−2h)))/12h
pub(super) const WEIGHTS: [f64; 4] = [1.0 / 12.0, -8.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0];

/// Σ weights · f over the circuits, over h: the derivative with ln p; nothing where all are the same.
pub(crate) fn difference(near: [f64; 4]) -> f64 {
    difference_by(near, VALUE_STEP)
}

/// The same over another step.
pub(crate) fn difference_by([a, b, c, d]: [f64; 4], step: f64) -> f64 {
    (8.0 * (c - b) - (d - a)) / (12.0 * step)
}

/// The same of matrices.
pub(super) fn difference_of([a, b, c, d]: [DMatrix<f64>; 4]) -> DMatrix<f64> {
    ((c - b) * 8.0 - (d - a)) / (12.0 * VALUE_STEP)
}

/// The circuit with p a little aside, in the modes of a trajectory.
pub(crate) struct Near {
    pub(super) systems: Vec<System>,
    pub(super) sources: Vec<Source>,
    thresholds: Vec<Threshold>,
    assembler: Assembler,
    /// Where its transient begins.
    pub(crate) state: Vec<f64>,
}

impl Near {
    /// Of its simulation.
    ///
    /// # Errors
    /// It has other states.
    pub(crate) fn of(simulation: &mut Simulation, trajectory: &Trajectory) -> Result<Self, Error> {
        let ends = trajectory.segments.first().zip(trajectory.segments.last());
        let span = ends.map_or(1.0, |(first, last)| last.to - first.from);
        let state = simulation.state();
        let mut assembler = simulation.assembler(span);
        let mut systems = Vec::new();
        for system in &trajectory.systems {
            let near = System::of(&system.key, &mut assembler)?;
            let same = near.lcs.states == system.lcs.states && near.lcs.fast == system.lcs.fast;
            if !same {
                return Err(not_smooth(0.0, "another value makes other states"));
            }
            systems.push(near);
        }
        let inputs = systems.first().map_or(&[][..], |near| &near.lcs.inputs);
        Ok(Self {
            sources: inputs.iter().map(|input| input.source.clone()).collect(),
            thresholds: assembler.thresholds(),
            systems,
            assembler,
            state,
        })
    }

    /// A guard of an owner in a mode.
    pub(super) fn guard(&self, at: usize, (owner, which): (Owner, usize)) -> Result<Row, Error> {
        let limits = |i| self.assembler.limits(i);
        let mut guards = self.systems[at].guards(owner, (&self.thresholds, limits));
        if which >= guards.len() {
            let what = "an event has no guard where the value is another";
            return Err(not_smooth(0.0, what));
        }
        Ok(guards.swap_remove(which))
    }
}
