//! A model whose measurements are differentiated, and those near it.

use std::sync::atomic::AtomicBool;

use super::SensitivityOptions;
use crate::analysis::measured::{measured, periodic_measured};
use crate::analysis::periodic::PeriodicOptions;
use crate::analysis::table::entries;
use crate::circuit::{Circuit, Measured};
use crate::integrate::{Error, Reason, SimOptions, Simulation, SimulationOptions};
use crate::model::Model;

/// A model and those near it.
pub(super) struct Beside<'a> {
    pub(super) model: &'a Model,
    pub(super) options: &'a SensitivityOptions<'a>,
    /// The entries of the table that are measured in place of `.meas`, by their group.
    pub(super) entries: Option<usize>,
}

impl Beside<'_> {
    /// Gives a value to a model that measures what this does.
    pub(super) fn set(&self, model: &mut Model, name: &str, value: f64) -> Result<(), Error> {
        model.set(name, value)?;
        if self.entries.is_some() {
            *model = model.with_circuit(self.measuring(model.circuit())?)?;
        }
        Ok(())
    }

    /// A circuit with what is measured.
    pub(super) fn measuring(&self, circuit: &Circuit) -> Result<Circuit, Error> {
        let Some(group) = self.entries else {
            return Ok(circuit.clone());
        };
        let SensitivityOptions {
            inputs,
            outputs,
            steady,
            ..
        } = self.options;
        // What the netlist shows, not what is measured by now.
        let showing = Circuit {
            probes: self.model.circuit().probes.clone(),
            ..circuit.clone()
        };
        let all = entries(&showing, (inputs, outputs), *steady)?;
        let group = all.into_iter().nth(group).unwrap_or_default();
        Ok(group.measured_in(circuit))
    }

    /// From when to when measurements see an orbit that repeats, s: entries of the table see what repeats.
    pub(super) fn seen_span(&self, circuit: &Circuit) -> (f64, f64) {
        match self.entries {
            None => circuit.measured_span(),
            Some(_) => (0.0, 0.0),
        }
    }

    pub(super) fn periodic(&self) -> PeriodicOptions<'_> {
        PeriodicOptions {
            period: self.options.period,
            cancel: self.options.cancel,
            settings: self.options.settings.clone(),
            ..PeriodicOptions::default()
        }
    }

    /// The model with this value, which shows the signals of its measurements.
    pub(super) fn with(&self, change: Option<(&str, f64)>) -> Result<Model, Error> {
        let mut model = self.model.clone();
        if let Some((name, value)) = change {
            model.set(name, value)?;
        }
        let circuit = self.measuring(model.circuit())?;
        let circuit = Circuit {
            probes: circuit.measured.clone(),
            columns: vec![],
            ..circuit
        };
        model.with_circuit(circuit)
    }

    pub(super) fn simulation(&self, model: &Model) -> Result<Simulation, Error> {
        let options = SimulationOptions {
            settings: self.options.settings.clone(),
            ..SimulationOptions::default()
        };
        Simulation::closed(model.circuit(), model.multiport(), options)
    }

    pub(super) fn go_on(&self) -> Result<(), Error> {
        let set = |cancel: &AtomicBool| cancel.load(std::sync::atomic::Ordering::Relaxed);
        if self.options.cancel.is_some_and(set) {
            return Err(Error::before(Reason::Interrupted));
        }
        Ok(())
    }

    /// What `.meas` finds in a run with this value.
    pub(super) fn measured(&self, change: Option<(&str, f64)>) -> Result<Vec<Measured>, Error> {
        let model = self.with(change)?;
        if self.options.steady {
            return Ok(periodic_measured(&model, &self.periodic())?.2.measured);
        }
        let asked = SimOptions {
            cancel: self.options.cancel,
            settings: self.options.settings.clone(),
            unestimated: true,
            ..SimOptions::default()
        };
        // Differences of runs need one grid.
        measured(&model, asked, false)
    }
}
