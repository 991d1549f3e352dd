//! A circuit to be analysed again and again, with other values.

use std::path::Path;
use std::sync::Arc;

use crate::circuit::source::Wave;
use crate::circuit::{
    Circuit, ElaborateOptions, Element, Kind, Sweep, Swept, Tolerance, Tran, elaborate, load,
};
use crate::diagnostic::{Diagnostic, Faults, SourceFile, SourceMap, independent};
use crate::integrate::{
    Error, OperatingPoint, Places, Reason, Run, SimOptions, Simulation, SimulationOptions, Values,
    operating_point, simulate,
};
use crate::lcs::{Lcs, Position, reduce};
use crate::mna::{self, StaticMultiport};
use crate::netlist::{self, Files, Netlist};
use crate::settings::Settings;

/// A circuit with the netlist behind it: values are changed without parsing again.
///
/// # Example
/// The cut-off of a low-pass filter, for two capacitances.
/// ```
/// use circ::Model;
///
/// let mut model = Model::parse("filter\nv1 in 0 1\nr1 in out 1k\nc1 out 0 1u\n.end\n", "filter.cir")?;
/// assert_eq!(model.lcs()?.a[(0, 0)], -1e3);
/// model.set("c1", 2e-6)?;
/// assert_eq!(model.lcs()?.a[(0, 0)], -500.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Model {
    /// None behind a circuit that was built by a program.
    netlist: Option<Arc<Netlist>>,
    sources: Arc<SourceMap>,
    options: ElaborateOptions,
    circuit: Circuit,
    multiport: StaticMultiport,
    findings: Vec<Diagnostic>,
}

impl Model {
    /// Reads a netlist file and what it includes.
    ///
    /// # Errors
    /// Everything that is wrong with it, in [`Error::findings`].
    pub fn load(path: impl AsRef<Path>, options: ElaborateOptions) -> Result<Self, Error> {
        let load::Loaded {
            sources,
            netlist,
            circuit,
            diagnostics,
        } = load::load(path.as_ref(), &options);
        match (netlist, circuit) {
            (Some(netlist), Some(circuit)) => Ok(Self::of(
                Some(netlist),
                sources,
                options,
                circuit,
                diagnostics,
            )?),
            _ => Err(refused(diagnostics, sources)),
        }
    }

    /// Reads a netlist from text; files it includes are read beside `name`.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(text: &str, name: &str) -> Result<Self, Error> {
        Self::parse_with(text, name, ElaborateOptions::default())
    }

    /// The same with other choices.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse_with(text: &str, name: &str, options: ElaborateOptions) -> Result<Self, Error> {
        Self::read(text, name, options, &load::read, &load::names)
    }

    /// Reads a netlist from files as [`Self::sources`] gives them, the root first: those that it includes are taken from there, and from
    /// nowhere else.
    ///
    /// # Errors
    /// As [`Self::load`]; there is no file.
    pub fn of_files(files: &[SourceFile], options: ElaborateOptions) -> Result<Self, Error> {
        let Some((root, included)) = files.split_first() else {
            let none = Diagnostic::error("unreadable", None, "there is no file to read");
            return Err(refused(vec![none], SourceMap::default()));
        };
        let read = |path: &Path| {
            let name = path.to_string_lossy();
            let found = included.iter().find(|file| file.path == name);
            let missing = || std::io::Error::from(std::io::ErrorKind::NotFound);
            Ok(found.ok_or_else(missing)?.text.clone().into_bytes())
        };
        let names = |folder: &Path| {
            let below = |file: &SourceFile| {
                let inside = Path::new(&file.path).strip_prefix(folder).ok()?;
                let first = inside.components().next()?.as_os_str().to_str()?;
                Some(first.to_string())
            };
            included.iter().filter_map(below).collect()
        };
        Self::read(&root.text, &root.path, options, &read, &names)
    }

    fn read(
        text: &str,
        name: &str,
        options: ElaborateOptions,
        read: &dyn Fn(&Path) -> std::io::Result<Vec<u8>>,
        names: &dyn Fn(&Path) -> Vec<String>,
    ) -> Result<Self, Error> {
        let mut sources = SourceMap::default();
        let root = sources.add(name, text);
        let libraries = &options.libraries;
        let search = Files {
            read,
            names,
            libraries,
        };
        let (netlist, mut findings) = netlist::parse_among(&mut sources, root, search);
        let (circuit, more) = elaborate(&netlist, &options);
        findings.extend(independent(more, &findings, &sources));
        match circuit {
            Some(circuit) => Ok(Self::of(
                Some(netlist),
                sources,
                options,
                circuit,
                findings,
            )?),
            None => Err(refused(findings, sources)),
        }
    }

    /// A circuit that a program built.
    ///
    /// # Errors
    /// Findings on its topology: shorts and open branches that contradict each other.
    pub fn of_circuit(circuit: Circuit) -> Result<Self, Error> {
        let (sources, options) = (SourceMap::default(), ElaborateOptions::default());
        Ok(Self::of(None, sources, options, circuit, vec![])?)
    }

    pub(crate) fn of(
        netlist: Option<Netlist>,
        sources: SourceMap,
        options: ElaborateOptions,
        circuit: Circuit,
        mut findings: Vec<Diagnostic>,
    ) -> Result<Self, Faults> {
        match mna::behaviour(&circuit) {
            Ok(multiport) => Ok(Self {
                netlist: netlist.map(Arc::new),
                sources: Arc::new(sources),
                options,
                circuit,
                multiport,
                findings,
            }),
            Err(faults) => {
                findings.extend(faults);
                Err(Faults { findings, sources })
            }
        }
    }

    /// Gives an element of the top level (a resistance, capacitance, inductance, the DC value of a source) or a `.param` another
    /// value; everything that depends on it follows.
    ///
    /// # Errors
    /// There is no such element or parameter, or the circuit is none with that value; the model stays as it was.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), Error> {
        let (circuit, options) = self.circuit_with(&[(name.to_lowercase(), value)])?;
        match mna::behaviour(&circuit) {
            Ok(multiport) => {
                (self.circuit, self.multiport, self.options) = (circuit, multiport, options);
                Ok(())
            }
            Err(findings) => Err(self.faults(findings)),
        }
    }

    /// The circuit with these values, as [`Self::set`] gives them, and the choices that lead to it.
    ///
    /// # Errors
    /// As [`Self::set`], but for faults of the circuit's equations.
    pub(crate) fn circuit_with(
        &self,
        values: &[(String, f64)],
    ) -> Result<(Circuit, ElaborateOptions), Error> {
        let mut options = self.options.clone();
        for (name, value) in values {
            if !value.is_finite() {
                return Err(self.faults(vec![no_number(name, *value)]));
            }
            options.set(&self.swept(name)?, *value);
        }
        let Some(netlist) = &self.netlist else {
            let mut circuit = self.circuit.clone();
            for (name, value) in values {
                let Some(id) = circuit.element(name) else {
                    let message = format!("the circuit has no element `{name}`");
                    return Err(self.faults(vec![Diagnostic::error("set", None, message)]));
                };
                circuit.elements[id.index()].kind.set_value(*value);
            }
            return Ok((circuit, options));
        };
        let (circuit, findings) = elaborate(netlist, &options);
        let Some(mut circuit) = circuit else {
            return Err(self.faults(findings));
        };
        if self.circuit.columns.is_empty() {
            circuit.probes.clone_from(&self.circuit.probes);
            circuit.columns.clear();
        } else {
            self.show_in(&mut circuit);
        }
        Ok((circuit, options))
    }

    /// The model whose samples are drawn from this seed, with these tolerances and those of its cards.
    #[must_use]
    pub fn toleranced(mut self, seed: u64, tolerances: Vec<Tolerance>) -> Self {
        (self.options.seed, self.options.tolerances) = (seed, tolerances);
        self
    }

    /// What a name means that a value is given to: an element of the top level, else a `.param`, which need not exist.
    ///
    /// # Errors
    /// An element that has no value to be set.
    pub fn swept(&self, name: &str) -> Result<Swept, Error> {
        let name = name.to_lowercase();
        let Some(id) = self.circuit.element(&name) else {
            return Ok(Swept::Param(name));
        };
        match not_settable(&self.circuit.elements[id.index()]) {
            None => Ok(Swept::Element(name)),
            Some(reason) => {
                let message = format!("`{name}` cannot be set: {reason}");
                Err(self.faults(vec![Diagnostic::error("set", None, message)]))
            }
        }
    }

    /// The model with these values in place of those of the sweeps, and the sample that is drawn, where one is.
    ///
    /// # Errors
    /// The netlist is no circuit with them, or there is no netlist.
    pub fn at(&self, sweeps: &[Sweep], values: &[f64], sample: Option<u64>) -> Result<Self, Error> {
        let circuit = self.circuit_at(sweeps, values, sample)?;
        self.of_options(circuit, self.options_at(sweeps, values, sample))
    }

    /// The same, which shows what is measured alone.
    ///
    /// # Errors
    /// As [`Self::at`].
    pub(crate) fn measured_at(
        &self,
        sweeps: &[Sweep],
        values: &[f64],
        sample: Option<u64>,
    ) -> Result<Self, Error> {
        let mut circuit = self.circuit_at(sweeps, values, sample)?;
        circuit.probes.clone_from(&circuit.measured);
        circuit.columns.clear();
        self.of_options(circuit, self.options_at(sweeps, values, sample))
    }

    /// The model of the circuit to which these choices lead.
    fn of_options(&self, circuit: Circuit, options: ElaborateOptions) -> Result<Self, Error> {
        match mna::behaviour(&circuit) {
            Ok(multiport) => Ok(Self {
                netlist: self.netlist.clone(),
                sources: Arc::clone(&self.sources),
                options,
                circuit,
                multiport,
                findings: self.findings.clone(),
            }),
            Err(findings) => Err(self.faults(findings)),
        }
    }

    /// The circuit of that model, with the probes of this one.
    pub(crate) fn circuit_at(
        &self,
        sweeps: &[Sweep],
        values: &[f64],
        sample: Option<u64>,
    ) -> Result<Circuit, Error> {
        let Some(netlist) = &self.netlist else {
            let message = "a circuit without a netlist has no sweeps";
            return Err(self.faults(vec![Diagnostic::error("sweep", None, message)]));
        };
        let given = sweeps.iter().map(|sweep| sweep.what.name()).zip(values);
        if let Some((name, value)) = given.into_iter().find(|(_, value)| !value.is_finite()) {
            return Err(self.faults(vec![no_number(name, *value)]));
        }
        let (circuit, findings) = elaborate(netlist, &self.options_at(sweeps, values, sample));
        let mut circuit = circuit.ok_or_else(|| self.faults(findings))?;
        let probes = self.circuit.probes.iter().map(|p| circuit.probe(&p.name));
        if self.circuit.columns.is_empty()
            && let Some(probes) = probes.collect()
        {
            circuit.probes = probes;
            circuit.columns.clear();
        } else {
            self.show_in(&mut circuit);
        }
        Ok(circuit)
    }

    fn options_at(
        &self,
        sweeps: &[Sweep],
        values: &[f64],
        sample: Option<u64>,
    ) -> ElaborateOptions {
        let options = self.options.at(sweeps, values);
        ElaborateOptions {
            sample: sample.or(options.sample),
            ..options
        }
    }

    /// The model with this circuit, whose values are the same.
    ///
    /// # Errors
    /// Its equations cannot be set up.
    pub(crate) fn with_circuit(&self, circuit: Circuit) -> Result<Self, Error> {
        match mna::behaviour(&circuit) {
            Ok(multiport) => Ok(Self {
                circuit,
                multiport,
                ..self.clone()
            }),
            Err(findings) => Err(self.faults(findings)),
        }
    }

    /// The model with another transient, where one is given, and with these signals ([`Circuit::show`]), where there are any.
    ///
    /// # Errors
    /// [`Reason::Unknown`] for what is no signal of the circuit.
    pub fn asked(&self, tran: Option<Tran>, probes: &[String]) -> Result<Self, Error> {
        let mut circuit = self.circuit.clone();
        circuit.tran = tran.or(circuit.tran);
        if !probes.is_empty() {
            let found = circuit.show(probes);
            found.map_err(|fault| {
                let help = fault.help.map(|help| format!("; {help}"));
                Error::before(Reason::Unknown(fault.message + &help.unwrap_or_default()))
            })?;
        }
        self.with_circuit(circuit)
    }

    /// Shows in a circuit of other values what this one shows, where it has all of it.
    fn show_in(&self, circuit: &mut Circuit) {
        let names = self.circuit.columns.iter().map(|c| c.name.clone());
        let _ = circuit.show(&names.collect::<Vec<_>>());
    }

    fn faults(&self, findings: Vec<Diagnostic>) -> Error {
        refused(findings, SourceMap::clone(&self.sources))
    }

    /// Warnings and notes of the netlist.
    #[must_use]
    pub fn findings(&self) -> &[Diagnostic] {
        &self.findings
    }

    /// The same with what was found before.
    #[cfg(feature = "cli")]
    pub(crate) fn having_found(self, findings: Vec<Diagnostic>) -> Self {
        Self { findings, ..self }
    }

    /// The files it was read from.
    #[must_use]
    pub fn sources(&self) -> &SourceMap {
        &self.sources
    }

    /// Its cards; none behind a circuit that was built by a program.
    #[must_use]
    pub fn netlist(&self) -> Option<&Netlist> {
        self.netlist.as_deref()
    }

    /// The choices it was elaborated with, and the values that were set since.
    #[must_use]
    pub const fn options(&self) -> &ElaborateOptions {
        &self.options
    }

    /// Where its elements stand in them.
    #[must_use]
    pub fn places(&self) -> Places<'_> {
        Places(
            self.netlist
                .as_ref()
                .map(|_| (&self.circuit, &*self.sources)),
        )
    }

    /// The flattened circuit.
    #[must_use]
    pub const fn circuit(&self) -> &Circuit {
        &self.circuit
    }

    /// Its static multiport: the circuit without storage, sources and devices.
    #[must_use]
    pub const fn multiport(&self) -> &StaticMultiport {
        &self.multiport
    }

    /// Simulates the transient that `.tran` asks for.
    ///
    /// # Errors
    /// See [`Reason`]; the run so far is in [`Error::partial`].
    pub fn transient(&self, options: SimOptions<'_>) -> Result<Run, Error> {
        simulate(&self.circuit, &self.multiport, options)
    }

    /// A transient whose caller drives it.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn simulation(&self, options: SimulationOptions) -> Result<Simulation, Error> {
        Simulation::new(&self.circuit, &self.multiport, options)
    }

    /// The operating point with the sources' DC values.
    ///
    /// # Errors
    /// See [`operating_point`].
    pub fn operating_point(&self) -> Result<OperatingPoint, Error> {
        operating_point(&self.circuit, Values::Dc, false, &Settings::default())
    }

    /// The complementarity system where switches stand as their cards say, off where they say nothing.
    ///
    /// # Errors
    /// Shorts and open branches contradict each other.
    pub fn lcs(&self) -> Result<Lcs, Error> {
        let switches = self.multiport.switches.iter();
        let start = switches.map(|s| s.initial.unwrap_or(false)).collect();
        let position = Position::free(&self.multiport, start);
        reduce(&self.multiport, &position).map_err(|error| Error::before(error.into()))
    }
}

fn no_number(name: &str, value: f64) -> Diagnostic {
    let message = format!("`{name}` cannot be set to {value}: it is no number");
    Diagnostic::error("set", None, message)
}

fn refused(findings: Vec<Diagnostic>, sources: SourceMap) -> Error {
    Faults { findings, sources }.into()
}

/// Why an element has no value that can be replaced.
fn not_settable(element: &Element) -> Option<&'static str> {
    if element.name.contains('.') {
        return Some("it stands in a subcircuit; a `.param` in its place can be set");
    }
    match &element.kind {
        Kind::Resistor(_) | Kind::Capacitor(_) | Kind::Inductor(_) => None,
        Kind::VoltageSource(source) | Kind::CurrentSource(source) => match source.wave {
            Wave::Dc(_) => None,
            _ => Some("its waveform has several values; each may be a `.param`, which can be set"),
        },
        _ => Some("it is neither a resistor, capacitor, inductor nor a source"),
    }
}
