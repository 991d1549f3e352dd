//! The systems of a circuit, one per switch position, each with its cached step matrices.

use nalgebra::DVector;

use crate::integrate::control::Amplitudes;
use crate::integrate::curved::Curved;
use crate::integrate::error::{Error, Reason};
use crate::integrate::inputs::Inputs;
use crate::integrate::jump::JumpProblem;
use crate::integrate::lawful;
use crate::integrate::step::{Back, Columns, Scheme, StepMatrices};
use crate::lcs::Lcs;

/// One system with everything that is computed from it once.
#[derive(Debug)]
pub(crate) struct System {
    /// The matrices.
    pub lcs: Lcs,
    /// Layout of z.
    pub columns: Columns,
    /// The jump problem, where an impulse can flow at all.
    pub jump: Option<JumpProblem>,
    /// Whether a law does not consist of straight pieces.
    pub curved: bool,
    /// Tables for steps of chosen lengths, where one was made.
    pub(crate) smooth: Option<Box<Curved>>,
    matrices: Vec<StepMatrices>,
    clock: u64,
}

/// Step lengths kept per system; the least recently used one goes first.
const KEPT_STEPS: usize = 96;

impl System {
    pub(crate) fn new(lcs: Lcs, inputs: &Inputs, t: f64, tolerance: f64) -> Self {
        let columns = Columns {
            n: lcs.n(),
            varying: inputs.varying().to_vec(),
            constant: inputs.all(t),
        };
        let jump = JumpProblem::new(&lcs, tolerance);
        Self {
            columns,
            curved: lawful::is_curved(&lcs),
            smooth: None,
            lcs,
            jump,
            matrices: Vec::new(),
            clock: 0,
        }
    }

    /// Its tables for steps of chosen lengths.
    pub(crate) fn smooth(&mut self) -> &mut Curved {
        let (lcs, columns) = (&self.lcs, &self.columns);
        (self.smooth).get_or_insert_with(|| Box::new(Curved::of(lcs, columns)))
    }

    /// Matrices for a step h; a cached step that differs by no more than `slack` (the rounding of the times it connects)
    /// serves as well. Returns the index and whether it was computed now.
    pub(crate) fn matrices(
        &mut self,
        h: f64,
        slack: f64,
        scheme: Scheme,
        tolerance: f64,
    ) -> Result<(usize, bool), Reason> {
        self.clock += 1;
        let clock = self.clock;
        let same = |s: &StepMatrices| s.scheme == scheme && (s.h - h).abs() <= slack;
        if let Some(at) = self.matrices.iter().position(same) {
            self.matrices[at].used = clock;
            return Ok((at, false));
        }
        let mut new = StepMatrices::new(&self.lcs, &self.columns, h, scheme, tolerance)
            .ok_or(Reason::Singular { h })?;
        new.used = clock;
        if self.matrices.len() < KEPT_STEPS {
            self.matrices.push(new);
            return Ok((self.matrices.len() - 1, true));
        }
        let oldest = (0..KEPT_STEPS)
            .min_by_key(|&k| self.matrices[k].used)
            .unwrap_or(0);
        self.matrices[oldest] = new;
        Ok((oldest, true))
    }

    /// Cached matrices by index.
    pub(crate) fn step(&self, index: usize) -> &StepMatrices {
        &self.matrices[index]
    }

    /// Cached matrices by index.
    pub(crate) fn step_mut(&mut self, index: usize) -> &mut StepMatrices {
        &mut self.matrices[index]
    }

    /// q of a step from z, with the solvers told what is uncertain in it.
    pub(crate) fn prepare(
        &mut self,
        step: usize,
        z: &[f64],
        amplitudes: &Amplitudes,
    ) -> DVector<f64> {
        let lcs = &self.lcs;
        let matrices = &mut self.matrices[step];
        matrices.blur(lcs, z, |k| amplitudes.rounding(lcs, k));
        matrices.q(z)
    }

    /// The fused mode of an active set.
    pub(crate) fn mode(&mut self, step: usize, active: &[bool]) -> (usize, bool) {
        self.matrices[step].mode(&self.lcs, &self.columns, active)
    }

    /// What leads from the λ of short steps to that of their start, on an active set.
    pub(crate) fn back(&mut self, step: usize, active: &[bool]) -> &Back {
        self.matrices[step].back(&self.lcs, &self.columns, active)
    }

    /// The physical storage vector s of a state.
    pub(crate) fn storage(&self, x: &[f64], u: &[f64]) -> DVector<f64> {
        let storage = &self.lcs.storage;
        &storage.x * DVector::from_column_slice(x)
            + &storage.u * DVector::from_column_slice(u)
            + &storage.one
    }

    /// The state that conserves charge and flux from storage s, in this system.
    pub(crate) fn state_from(&self, s: &DVector<f64>) -> DVector<f64> {
        let storage = &self.lcs.storage;
        &storage.inject * s + &storage.inject_one
    }
}

/// Reduces the circuit for a switch position.
pub type Reduce = Box<dyn FnMut(&[bool]) -> Result<Lcs, Error> + Send>;

/// All switch positions visited so far.
pub(crate) struct Plant {
    reduce: Reduce,
    /// Positions with their systems, in order of first visit.
    pub systems: Vec<(Vec<bool>, System)>,
    tolerance: f64,
}

impl Plant {
    pub(crate) fn new(reduce: Reduce, tolerance: f64) -> Self {
        Self {
            reduce,
            systems: Vec::new(),
            tolerance,
        }
    }

    /// Index of the system for a position.
    pub(crate) fn system(
        &mut self,
        position: &[bool],
        inputs: &Inputs,
        t: f64,
    ) -> Result<usize, Error> {
        if let Some(at) = self.systems.iter().position(|(p, _)| p == position) {
            return Ok(at);
        }
        let lcs = (self.reduce)(position)?;
        self.systems.push((
            position.to_vec(),
            System::new(lcs, inputs, t, self.tolerance),
        ));
        Ok(self.systems.len() - 1)
    }
}
