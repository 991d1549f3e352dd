//! What a file holds: a circuit from a netlist, or a system in JSON.

use std::io;
use std::path::{Path, PathBuf};

use super::args::{Assigned, Diodes, Input, MessageFormat, STDIN};
use super::exit::Failure;
use super::files;
use super::forms;
use super::render;
use super::streams::Streams;
use crate::analysis::Variant;
use crate::circuit::{self, Circuit, ElaborateOptions, Spread, Tolerance, Tran, load};
use crate::diagnostic::explain::{Explanation, explain};
use crate::diagnostic::{Diagnostic, Severity, SourceMap};
use crate::forms::json;
use crate::integrate::{Error, Places, Reason, start};
use crate::lcs::json::SystemFile;
use crate::lcs::sparse::{MANY, SparseLcs};
use crate::lcs::{Lcs, Position, reduce};
use crate::mna::StaticMultiport;
use crate::model::Model;
use crate::netlist::{self, Loaded};
use crate::report::steps;
use crate::settings::Settings;
use crate::waveform::canonical_name;

/// What there is to simulate.
pub enum Subject {
    /// From a netlist.
    Circuit(Box<Model>),
    /// From a file of `circ lcs`.
    System(Box<SystemFile>),
}

impl Subject {
    /// Where its elements stand.
    pub fn places(&self) -> Places<'_> {
        match self {
            Self::Circuit(model) => model.places(),
            Self::System(_) => Places::default(),
        }
    }

    /// The model of a circuit.
    pub fn model(&self) -> Option<&Model> {
        match self {
            Self::Circuit(model) => Some(model),
            Self::System(_) => None,
        }
    }

    /// The transient that it asks for.
    pub fn tran(&self) -> Option<Tran> {
        match self {
            Self::Circuit(model) => model.circuit().tran,
            Self::System(system) => system.tran,
        }
    }
}

/// Reads a file whose first character is `{` as a system; `None` for everything else.
///
/// # Errors
/// [`Failure::Told`] when it is JSON but no system, with the failed hypothesis of a nonlinear form.
pub fn system(input: &Input) -> Result<Option<SystemFile>, Failure> {
    let Ok(bytes) = bytes(input) else {
        return Ok(None);
    };
    let text = String::from_utf8_lossy(bytes);
    if !text.trim_start().starts_with('{') {
        return Ok(None);
    }
    if forms::open(input)?.is_some() {
        return Err(Failure::told(
            "not-for-system",
            format!(
                "{}: a nonlinear form, sound at its start; it has no matrices to work on, and is for `circ sim` alone",
                input.file.display()
            ),
        ));
    }
    let system = json::read(&text)
        .map_err(|e| Failure::told("broken-system", format!("{}: {e}", input.file.display())))?;
    Ok(Some(system))
}

/// Reads a netlist with the choices made on the command line.
#[must_use]
pub fn load(input: &Input) -> Loaded {
    let bytes = bytes(input).map(<[u8]>::to_vec);
    netlist::load_read(&input.file, bytes, &choices(input))
}

/// What the file holds; it is read once, as standard input can be.
///
/// # Errors
/// Those of reading.
pub(super) fn bytes(input: &Input) -> io::Result<&[u8]> {
    if input.read.get().is_none() {
        let read = if input.file == Path::new(STDIN) {
            load::read_all(io::stdin().lock())
        } else {
            load::read(&input.file)
        };
        let _ = input.read.set(read?);
    }
    Ok(input.read.get().map_or(&[], Vec::as_slice))
}

/// What the command line changes in a circuit.
#[must_use]
pub fn choices(input: &Input) -> ElaborateOptions {
    let diodes = match input.diodes {
        Diodes::Auto => circuit::Diodes::Auto,
        Diodes::Ideal => circuit::Diodes::Ideal,
        Diodes::Exp => circuit::Diodes::Exp,
    };
    let random = &input.random;
    let of = |spread| {
        move |(name, relative): &(String, f64)| Tolerance {
            name: name.clone(),
            spread,
            relative: *relative,
        }
    };
    let evenly = random.tolerances.iter().map(of(Spread::Uniform));
    let normally = random.deviations.iter().map(of(Spread::Normal));
    // Several values are those of a sweep.
    let one = |given: &Assigned| match given.values[..] {
        [value] => Some((given.name.clone(), value)),
        _ => None,
    };
    ElaborateOptions {
        diodes,
        libraries: libraries(input),
        params: input.params.iter().filter_map(one).collect(),
        sample: random.sample,
        seed: random.seed,
        tolerances: evenly.chain(normally).collect(),
        ..ElaborateOptions::default()
    }
}

/// The folders of `--lib`, then those of the environment's `CIRC_LIB`, between which stands what stands between those of `PATH`.
fn libraries(input: &Input) -> Vec<PathBuf> {
    let named = std::env::var_os("CIRC_LIB").unwrap_or_default();
    let named = std::env::split_paths(&named).filter(|folder| !folder.as_os_str().is_empty());
    input.libraries.iter().cloned().chain(named).collect()
}

/// Reads a file as [`open()`] does, for a command that takes the values as they stand and says so of a netlist with `.step`.
///
/// # Errors
/// As [`open()`].
pub fn open_as_it_stands(
    input: &Input,
    outputs: &[&Path],
    streams: &Streams,
) -> Result<Subject, Failure> {
    let subject = open(input, &[], outputs, streams)?;
    if let Subject::Circuit(model) = &subject
        && !model.circuit().steps.is_empty()
    {
        streams.note(
            "left-out",
            "`.step` is left out: these are the values as they stand",
        );
    }
    Ok(subject)
}

/// Reads a file, shows what was found in it, and keeps the named probes if there are any; none of the `outputs` may be one of the
/// files that were read, and all must be writable.
///
/// # Errors
/// [`Failure::Faults`] when the circuit cannot be built, [`Failure::Told`] for an unknown probe and for such an output.
pub fn open(
    input: &Input,
    probes: &[String],
    outputs: &[&Path],
    streams: &Streams,
) -> Result<Subject, Failure> {
    files::spare(outputs, [input.file.as_path()])?;
    if let Some(mut system) = system(input)? {
        files::writable(outputs)?;
        system.lcs = keep_outputs(system.lcs, probes)?;
        return Ok(Subject::System(Box::new(system)));
    }
    let busy = streams.busy(&format!("reading {}", input.file.display()));
    let Loaded {
        sources,
        netlist,
        circuit,
        diagnostics,
    } = load(input);
    drop(busy);
    show(&diagnostics, &sources, streams);
    for given in &input.params {
        if let Some(written) = &given.milli {
            let text = format!(
                "`{}`: `{written}` is milli, as SPICE suffixes know no capitals; mega is `Meg`",
                given.name
            );
            streams.warning("suffix-m", text);
        }
    }
    files::spare(outputs, sources.files.iter().map(|f| Path::new(&f.path)))?;
    files::writable(outputs)?;
    let mut circuit = circuit.ok_or_else(|| faults(input, &diagnostics))?;
    keep_probes(&mut circuit, probes)?;
    let _busy = streams.busy("reducing");
    let model = Model::of(netlist, sources, choices(input), circuit, Vec::new())
        .map_err(|faults| refused(input, &faults.into(), streams))?;
    Ok(Subject::Circuit(Box::new(model.having_found(diagnostics))))
}

/// The model of one of the runs of `.step`.
///
/// # Errors
/// [`Failure::Faults`] where the netlist is no circuit with these values.
pub(super) fn variant(
    input: &Input,
    variant: &Variant<'_>,
    streams: &Streams,
) -> Result<Model, Failure> {
    variant.model().map_err(|error| {
        let failure = refused(input, &error, streams);
        Failure::Faults(format!("{failure} at {}", steps::label(&variant.named())))
    })
}

/// A netlist that is no circuit: shows why.
pub(super) fn refused(input: &Input, error: &Error, streams: &Streams) -> Failure {
    match &error.reason {
        Reason::Netlist(faults) => {
            show(&faults.findings, &faults.sources, streams);
            self::faults(input, &faults.findings)
        }
        _ => Failure::of_run("", error),
    }
}

/// Leaves exactly the probes named on the command line, if there are any.
///
/// # Errors
/// [`Failure::Told`] for an unknown one.
fn keep_probes(circuit: &mut Circuit, probes: &[String]) -> Result<(), Failure> {
    if probes.is_empty() {
        return Ok(());
    }
    let shown = circuit.show(probes);
    shown.map_err(|fault| Failure::Told {
        code: "unknown-signal",
        message: format!("--probe {}", fault.message),
        help: fault
            .help
            .or_else(|| explain(fault.code).map(Explanation::help)),
    })
}

/// A note where expressions are asked for of an analysis that shows signals alone.
pub(super) fn tell_expressions(model: &Model, streams: &Streams) {
    if let Some(column) = model.circuit().columns.iter().find(|c| !c.is_signal()) {
        let name = &column.name;
        let text = format!("`{name}` is an expression: shown are the signals in it");
        streams.note("expression", text);
    }
}

/// The model of a subject.
///
/// # Errors
/// [`Failure::Told`]: a system has no circuit.
pub fn model_of<'s>(input: &Input, subject: &'s Subject) -> Result<&'s Model, Failure> {
    match subject {
        Subject::Circuit(model) => Ok(model),
        Subject::System(_) => {
            let message = "is a system without a circuit; this command needs a netlist";
            Err(Failure::told(
                "not-for-system",
                format!("{} {message}", input.file.display()),
            ))
        }
    }
}

/// The system that a subject starts as: matrices in the start position of its switches (or the one asked for), and x there; and
/// why the initial conditions had to take the place of its operating point, if they had to.
///
/// # Errors
/// [`Failure::Told`] for an unknown switch, [`Failure::Run`] for a circuit that is no system.
pub fn start_system(
    subject: &Subject,
    wanted: &[(String, bool)],
    streams: &Streams,
) -> Result<(SystemFile, Option<Error>), Failure> {
    let (circuit, behaviour) = match subject {
        Subject::Circuit(model) => (model.circuit(), model.multiport()),
        Subject::System(system) if wanted.is_empty() => {
            return Ok(((**system).clone(), None));
        }
        Subject::System(_) => {
            return Err(Failure::told(
                "not-for-system",
                "--switch: a system file holds one position of its switches".into(),
            ));
        }
    };
    let uic = circuit.tran.is_some_and(|t| t.uic);
    let settings = Settings::default();
    let (initial, without) = match start::initial(circuit, behaviour, uic, &settings) {
        Ok(initial) => (initial, None),
        Err(error) => {
            let initial = start::initial(circuit, behaviour, true, &settings);
            (initial.map_err(Box::new)?, Some(error))
        }
    };
    streams.notes(subject.places(), &initial.notes);
    let mut switches = initial.switches;
    for (k, on) in positions(behaviour, wanted)? {
        switches[k] = on;
    }
    let lcs = reduce(behaviour, &Position::free(behaviour, switches))
        .map_err(|error| Box::new(Error::before(error.into())))?;
    let x0 = &lcs.storage.inject * &initial.storage + &lcs.storage.inject_one;
    let system = SystemFile {
        lcs,
        x0,
        tran: circuit.tran,
    };
    Ok((system, without))
}

/// Whether a circuit has so many states and ports that its system is handled without its zeros.
pub fn is_large(behaviour: &StaticMultiport) -> bool {
    behaviour.storage.len() + behaviour.pairs.len() > MANY
}

/// As [`start_system`], without its zeros, and the state at the start.
///
/// # Errors
/// Those of the operating point and of the reduction.
pub fn sparse_system(
    subject: &Subject,
    wanted: &[(String, bool)],
    streams: &Streams,
) -> Result<(SparseLcs, Vec<f64>), Failure> {
    let Subject::Circuit(model) = subject else {
        return Err(Failure::told(
            "not-for-system",
            "a system file is not reduced".into(),
        ));
    };
    let (circuit, behaviour) = (model.circuit(), model.multiport());
    let uic = circuit.tran.is_some_and(|t| t.uic);
    let initial = start::initial(circuit, behaviour, uic, &Settings::default());
    let initial = match initial {
        Ok(initial) => initial,
        Err(error) => {
            let text = format!("{error}; the start state is the initial conditions");
            streams.note("no-operating-point", text);
            start::initial(circuit, behaviour, true, &Settings::default()).map_err(Box::new)?
        }
    };
    streams.notes(subject.places(), &initial.notes);
    let mut switches = initial.switches;
    for (k, on) in positions(behaviour, wanted)? {
        switches[k] = on;
    }
    let system = SparseLcs::of(behaviour, &Position::free(behaviour, switches))
        .map_err(|error| Box::new(Error::before(error.into())))?;
    if system.imprecise > 0 {
        let count = system.imprecise;
        let text = format!(
            "{count} entries are small differences of large numbers and not known to be within 1e-14 of the exact ones"
        );
        streams.note("rounding", text);
    }
    let x0 = system.state_from(initial.storage.as_slice());
    Ok((system, x0))
}

/// Indices and positions of the switches named on the command line.
///
/// # Errors
/// [`Failure::Told`] for an unknown switch.
pub fn positions(
    behaviour: &StaticMultiport,
    wanted: &[(String, bool)],
) -> Result<Vec<(usize, bool)>, Failure> {
    let known: Vec<&str> = behaviour.switches.iter().map(|s| s.name.as_str()).collect();
    let found = wanted.iter().map(|(name, on)| {
        let unknown = || match known[..] {
            [] => Failure::told(
                "unknown-switch",
                format!("--switch {name}: the circuit has no switch"),
            ),
            _ => Failure::told(
                "unknown-switch",
                format!("--switch {name}: the circuit has {}", known.join(" ")),
            ),
        };
        Ok((
            known.iter().position(|n| n == name).ok_or_else(unknown)?,
            *on,
        ))
    });
    found.collect()
}

/// Findings shown of one netlist.
const MOST: usize = 100;

/// The first findings, errors before the rest where there are too many, and how many are left out.
#[must_use]
pub fn most(mut diagnostics: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let Some(more) = diagnostics.len().checked_sub(MOST).filter(|more| *more > 0) else {
        return diagnostics;
    };
    diagnostics.sort_by_key(|d| d.severity != Severity::Error);
    let severity = diagnostics[MOST].severity;
    diagnostics.truncate(MOST);
    let message = format!("and {more} findings more");
    diagnostics.push(Diagnostic::new("more", severity, None, message));
    diagnostics
}

/// Shows findings on standard error: errors always, the rest unless quiet.
pub fn show(diagnostics: &[Diagnostic], sources: &SourceMap, streams: &Streams) {
    let shown: Vec<Diagnostic> = diagnostics
        .iter()
        .filter(|d| d.severity == Severity::Error || !streams.quiet)
        .cloned()
        .collect();
    if !shown.is_empty() {
        let shown = most(shown);
        streams.error(match streams.messages {
            MessageFormat::Human => render::render(&shown, sources, streams.colours()),
            MessageFormat::Short => render::short(&shown, sources),
            MessageFormat::Json => render::json(&shown, sources),
        });
    }
}

/// A run that broke off: shows why, at the card of the element where it shows.
pub(super) fn broke_off(
    input: &Input,
    error: &Error,
    places: Places<'_>,
    streams: &Streams,
) -> Failure {
    let file = input.file.display();
    let Some((circuit, sources)) = places.0 else {
        return Failure::of_run(&format!("{file}: "), error);
    };
    show(&[error.diagnostic(circuit)], sources, streams);
    Failure::Faults(match error.t {
        Some(t) if t > 0.0 => format!("{file}: the run ended at t = {t:e} s"),
        _ => format!("{file}: the circuit cannot be simulated"),
    })
}

fn faults(input: &Input, diagnostics: &[Diagnostic]) -> Failure {
    let count = diagnostics
        .iter()
        .filter(|d| d.severity == Severity::Error)
        .count();
    let noun = if count == 1 { "error" } else { "errors" };
    Failure::Faults(format!("{}: {count} {noun}", input.file.display()))
}

fn keep_outputs(lcs: Lcs, probes: &[String]) -> Result<Lcs, Failure> {
    if probes.is_empty() {
        return Ok(lcs);
    }
    let names: Vec<String> = lcs
        .outputs
        .names
        .iter()
        .map(|n| canonical_name(n))
        .collect();
    let kept = probes
        .iter()
        .map(|name| {
            let known = || {
                Failure::told(
                    "unknown-signal",
                    format!("--probe {name}: the system has {}", names.join(" ")),
                )
            };
            names
                .iter()
                .position(|n| *n == canonical_name(name))
                .ok_or_else(known)
        })
        .collect::<Result<Vec<usize>, _>>()?;
    let changed = lcs.changed(|parts| parts.outputs.keep(&kept));
    changed.map_err(|error| Failure::told("broken-system", error.to_string()))
}
