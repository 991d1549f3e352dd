//! The circuits of a netlist with `.step`: one for every combination of values.

use super::args::Input;
use super::exit::Failure;
use super::input::{self, Subject};
use super::streams::Streams;
use crate::circuit::{Sweep, combinations, elaborate};
use crate::diagnostic::{Diagnostic, SourceMap};
use crate::mna;
use crate::netlist::Netlist;
use crate::report::steps;

/// What the circuits follow from.
pub(super) struct Stepped<'a> {
    /// The file, and what the command line changes.
    pub input: &'a Input,
    /// `--probe`.
    pub probes: &'a [String],
    /// What is stepped.
    pub sweeps: &'a [Sweep],
    /// The cards.
    pub netlist: Netlist,
    /// The files they stand in.
    pub sources: SourceMap,
}

impl Stepped<'_> {
    /// All combinations of values, in order.
    pub(super) fn combinations(&self) -> Vec<Vec<f64>> {
        combinations(self.sweeps)
    }

    /// Values with the names of what they are values of.
    pub(super) fn named(&self, values: &[f64]) -> Vec<(String, f64)> {
        let names = self.sweeps.iter().map(|s| s.what.name().to_string());
        names.zip(values.iter().copied()).collect()
    }

    /// `r=1000 c=1e-6`.
    pub(super) fn label(&self, values: &[f64]) -> String {
        steps::label(&self.named(values))
    }

    /// The circuit with these values.
    ///
    /// # Errors
    /// As [`input::open`].
    pub(super) fn subject(&self, values: &[f64], streams: &Streams) -> Result<Subject, Failure> {
        let options = input::choices(self.input).at(self.sweeps, values);
        let refused = |findings: &[Diagnostic]| {
            input::show(findings, &self.sources, streams);
            let faults = input::faults(self.input, findings);
            Failure::Faults(format!("{faults} at {}", self.label(values)))
        };
        let (circuit, findings) = elaborate(&self.netlist, &options);
        let mut circuit = circuit.ok_or_else(|| refused(&findings))?;
        input::keep_probes(&mut circuit, self.probes)?;
        let behaviour = mna::behaviour(&circuit).map_err(|findings| refused(&findings))?;
        Ok(Subject::Circuit(Box::new((circuit, behaviour))))
    }
}
