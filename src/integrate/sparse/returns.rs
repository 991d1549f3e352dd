//! Runs of a large circuit over one period again and again, with their derivatives by products.

use std::sync::atomic::AtomicBool;

use nalgebra::DVector;

use super::script::Script;
use super::tape::{Reads, Tape};
use super::{Now, Sparse};
use crate::circuit::{Circuit, Tran};
use crate::integrate::error::{Error, Reason};
use crate::integrate::log::Log;
use crate::integrate::problem::{Problem, Systems};
use crate::integrate::ready::sources_of_large;
use crate::integrate::rows::Asked;
use crate::integrate::run::Stepper as _;
use crate::integrate::simulate::{SimOptions, Standing, controlled};
use crate::integrate::switching::{Switches, Threshold};
use crate::lcs::Role;
use crate::mna::{StandardMultiport, StaticMultiport};
use crate::plan::scheme;
use crate::settings::Settings;
use crate::settings::tolerances::periodic::LEAST_WEIGHT;
use crate::settings::tolerances::sparse::KEPT_OF_RETURNS;

/// How long the steps of a return are.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Lengths<'a> {
    /// As their error allows.
    Free,
    /// These: (h, end), s.
    Same(&'a [(f64, f64)]),
    /// These in halves.
    Halves(&'a [(f64, f64)]),
}

/// What a return came to.
#[derive(Debug)]
pub(crate) struct Passed {
    /// All capacitor voltages, V, and inductor currents, A, where it ended.
    pub(crate) state: Vec<f64>,
    /// By switch: on.
    pub(crate) switches: Vec<bool>,
    /// The steps, where their error chose them: (h, end), s.
    pub(crate) steps: Vec<(f64, f64)>,
    /// The largest |value| of each storage quantity at its ends and at the ends of its steps.
    pub(crate) peaks: Vec<f64>,
    /// What its derivative is made of.
    pub(crate) tape: Tape,
}

/// A large circuit that is taken through the same span of time from one start after the other. It keeps the factors of all of them, which is what makes runs and
/// products cheap.
pub(crate) struct Returns {
    pub(super) sparse: Sparse,
    names: Vec<String>,
    start: Standing,
    /// By switch, where a transient starts, before the sources go anywhere: on.
    rest: Vec<bool>,
    notes: Vec<crate::integrate::Note>,
    /// Whether tapes know what shifts switches.
    pub(super) with_shifts: bool,
    /// No step is longer than asked for, s.
    pub(super) longest: f64,
}

impl Returns {
    /// Of a circuit whose transients are made in sparse steps, with its multiport as it is or [perturbed](StandardMultiport::perturbed); nothing of another.
    ///
    /// # Errors
    /// As [`simulate`](crate::integrate::simulate()) before its first row.
    pub(crate) fn of(
        circuit: &Circuit,
        multiport: &StaticMultiport,
        perturbed: Option<StandardMultiport>,
        (tran, settings): (&Tran, &Settings),
    ) -> Result<Option<Self>, Error> {
        // No operating point is looked for in vain.
        if multiport.storage.len() + multiport.ideal_pairs() < settings.large {
            return Ok(None);
        }
        let mut problem = Problem::of_circuit(circuit, multiport, tran.uic, settings)?;
        if let Some(perturbed) = perturbed {
            problem.systems = Systems::of(perturbed);
        }
        let asked = SimOptions::default();
        let scheme = scheme(&asked);
        if sources_of_large(&mut problem, scheme, settings)?.is_none() {
            return Ok(None);
        }
        let mut sparse = problem.sparse(tran, scheme, controlled(tran), settings)?;
        sparse.balanced = false;
        sparse.room = KEPT_OF_RETURNS;
        sparse.reads = Some(Reads::default());
        for (_, system) in &mut sparse.systems {
            system.kernel.keep(KEPT_OF_RETURNS);
        }
        let storage = problem.systems.multiport.storage.iter();
        let names = storage.map(|s| {
            let of = if s.capacitor { "v" } else { "i" };
            format!("{of}({})", s.element)
        });
        Ok(Some(Self {
            names: names.collect(),
            start: Standing {
                t: 0.0,
                state: problem.start.storage.as_slice().to_vec(),
                switches: sparse.at_first(&problem.start.switches),
                conducting: problem.conducting.clone(),
                ..Standing::default()
            },
            rest: problem.start.switches.clone(),
            notes: problem.notes.clone(),
            with_shifts: false,
            longest: sparse.longest,
            sparse,
        }))
    }

    /// Names of the storage quantities: `v(c1)`, `i(l1)`.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    /// Their units, `V` and `A`.
    pub(crate) fn units(&self) -> &[&'static str] {
        &self.sparse.storage_units
    }

    /// √C and √L: what makes √(2 energy) of a storage quantity; zero where it has none.
    pub(crate) fn scale(&self) -> Vec<f64> {
        self.sparse.system().storage_scale()
    }

    /// The same, none of them less than a part of the largest.
    pub(crate) fn weights(&self) -> DVector<f64> {
        let roots = DVector::from_vec(self.scale());
        let most = roots.amax();
        let least = if most > 0.0 { LEAST_WEIGHT * most } else { 1.0 };
        roots.map(|root| root.max(least))
    }

    /// Where a transient starts.
    pub(crate) const fn start(&self) -> &Standing {
        &self.start
    }

    /// The positions of the operating point. Where a control is on its threshold, those of the start are others.
    pub(crate) fn rest(&self) -> &[bool] {
        &self.rest
    }

    /// What is to be told of the circuit.
    pub(crate) fn notes(&self) -> &[crate::integrate::Note] {
        &self.notes
    }

    /// From a place to the time `until`, s.
    ///
    /// # Errors
    /// See [`Reason`].
    pub(crate) fn pass(
        &mut self,
        (from, state, switches): (f64, &[f64], &[bool]),
        until: f64,
        lengths: Lengths<'_>,
        cancel: Option<&AtomicBool>,
    ) -> Result<Passed, Error> {
        let (steps, next) = match lengths {
            Lengths::Free => (Vec::new(), None),
            Lengths::Same(steps) => (steps.to_vec(), Some(0)),
            Lengths::Halves(steps) => (Script::halved(steps), Some(0)),
        };
        let asked = Asked {
            cancel,
            ..Asked::default()
        };
        let mut log = Log::of(0, 0.0, asked);
        let sparse = &mut self.sparse;
        sparse.script = Some(Script { steps, next });
        let with_shifts = self.with_shifts;
        let passed = sparse.stand_at(from, state, switches).and_then(|()| {
            if let Some(tape) = &mut sparse.tape {
                tape.with_shifts = with_shifts;
            }
            sparse.advance(until, &mut log)
        });
        let script = sparse.script.take().unwrap_or_default();
        let tape = sparse.tape.take().unwrap_or_default();
        passed?;
        let end = sparse.system().storage(&sparse.now.x, &sparse.now.u);
        let mut peaks = sparse.peaks.clone();
        for ends in [state, &end] {
            for (peak, value) in peaks.iter_mut().zip(ends) {
                *peak = peak.max(value.abs());
            }
        }
        if end.iter().any(|value| !value.is_finite()) {
            return Err(Error::at(until, Reason::Overflow));
        }
        Ok(Passed {
            state: end,
            switches: sparse.switches.position().to_vec(),
            steps: script.steps,
            peaks,
            tape,
        })
    }

    /// Which ideal pairs conduct at a place.
    ///
    /// # Errors
    /// See [`Reason`].
    pub(crate) fn conducting(
        &mut self,
        (t, state, switches): (f64, &[f64], &[bool]),
    ) -> Result<Vec<bool>, Error> {
        self.sparse.stand_at(t, state, switches)?;
        self.sparse.tape = None;
        let ports = &self.sparse.system().lcs.ports;
        let sides = self.sparse.now.active.iter().zip(ports);
        let conducting = sides.map(|(on, port)| *on == (port.role != Role::Voltage));
        Ok(conducting.collect())
    }

    /// What the run that made a tape makes of a small change of its start; `None` where an active set on its way leaves that open.
    pub(crate) fn product(&mut self, tape: &Tape, change: &[f64]) -> Option<Vec<f64>> {
        tape.product(&mut self.sparse.systems, change)
    }
}

impl Sparse {
    /// Positions at the start, from these, where the sources are and go: a control may start on its threshold.
    fn at_first(&self, position: &[bool]) -> Vec<bool> {
        let misplaced = (self.switches).misplaced(self.system(), &self.inputs, self.now.t);
        let mut position = position.to_vec();
        misplaced.iter().for_each(|&i| position[i] = !position[i]);
        position
    }

    /// Goes to another time and state; edges of sources at that time have acted. What was seen of amplitudes, and all factors, stay.
    fn stand_at(&mut self, t: f64, storage: &[f64], position: &[bool]) -> Result<(), Error> {
        let at = self.system_of(position)?;
        let system = &self.systems[at].1;
        let thresholds = self.multiport.switches.iter().map(Threshold::of).collect();
        self.switches = Switches::new(position.to_vec(), thresholds, system);
        let (x, m) = (system.lcs.state_from(storage), system.m());
        let mut active = std::mem::take(&mut self.now.active);
        if active.len() != m || at != self.now.system {
            active = vec![false; m];
        }
        self.now = Now {
            t,
            system: at,
            slope: vec![0.0; x.len()],
            x,
            u: self.inputs.all(t),
            lambda: vec![0.0; m],
            active,
            settle: true,
            ..Now::default()
        };
        self.known = None;
        self.pending.clear();
        self.stats.steps = 0;
        self.progress = (0, t);
        self.started = true;
        self.peaks.clear();
        self.peaks.resize(storage.len(), 0.0);
        self.tape = Some(Tape::of(at));
        if self.reads.is_some() {
            let x = self.now.x.clone();
            self.tape_position((at, at), storage, &x);
        }
        let u = self.now.u.clone();
        self.jump(&u)
    }
}
