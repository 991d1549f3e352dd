//! Netlist to [`Circuit`]: parameters evaluated, subcircuits expanded, models turned into laws.

use std::path::PathBuf;

use super::builder::Builder;
use super::draw::Tolerance;
use super::{Circuit, Sweep, Swept};
use crate::diagnostic::{Diagnostic, Severity};
use crate::netlist::Netlist;

/// Which law a diode model becomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Diodes {
    /// What the model says: `Ron Roff Vfwd`, `N ≤ 0.05` or `ideal` is piecewise linear, everything else exponential.
    #[default]
    Auto,
    /// Every exponential model is replaced by the ideal diode in series with its RS.
    Ideal,
    /// Every model is exponential.
    Exp,
}

/// Choices of the user that change the circuit.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ElaborateOptions {
    /// How diode models are read.
    pub diodes: Diodes,
    /// Folders in which `.include` and `.lib` look for files after that of the netlist; used where a netlist is read.
    pub libraries: Vec<PathBuf>,
    /// `--param NAME=VALUE`: replaces the values of `.param` at the top level.
    pub params: Vec<(String, f64)>,
    /// Values that a sweep gives to elements of the top level: sources' DC values, resistances.
    pub values: Vec<(String, f64)>,
    /// The temperature that a sweep sets, °C.
    pub temperature: Option<f64>,
    /// The sample of random values and tolerances that is drawn; `None` is nominal.
    pub sample: Option<u64>,
    /// What the samples are drawn from.
    pub seed: u64,
    /// Tolerances besides those that cards name with `tol=`; the last of a name counts.
    pub tolerances: Vec<Tolerance>,
}

impl ElaborateOptions {
    /// The same choices, with these values in place of those of the sweeps.
    #[must_use]
    pub fn at(&self, sweeps: &[Sweep], values: &[f64]) -> Self {
        let mut options = self.clone();
        for (sweep, &value) in sweeps.iter().zip(values) {
            options.set(&sweep.what, value);
        }
        options
    }

    /// Gives a value, in place of another one if there is.
    pub(crate) fn set(&mut self, what: &Swept, value: f64) {
        let (values, name) = match what {
            Swept::Param(name) => (&mut self.params, name),
            Swept::Element(name) => (&mut self.values, name),
            Swept::Temperature => return self.temperature = Some(value),
        };
        values.retain(|(other, _)| !other.eq_ignore_ascii_case(name));
        values.push((name.clone(), value));
    }
}

/// Builds the circuit a netlist describes.
///
/// # Returns
/// The circuit, unless there is an error here or in reading the netlist; the findings here in file order.
#[must_use]
pub fn elaborate(
    netlist: &Netlist,
    options: &ElaborateOptions,
) -> (Option<Circuit>, Vec<Diagnostic>) {
    let (circuit, mut findings) = Builder::new(options).build(netlist);
    findings.sort_by_key(|d| {
        d.span
            .map_or((u32::MAX, usize::MAX), |s| (s.file.0, s.start))
    });
    let sound = findings
        .iter()
        .chain(&netlist.body.faults)
        .all(|d| d.severity < Severity::Error);
    (sound.then_some(circuit), findings)
}
