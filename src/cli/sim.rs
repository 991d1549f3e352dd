//! `circ sim`.

use std::io::Write;

use super::args::{self, MethodArgs, SimArgs, Summary};
use super::dc;
use super::exit::{Exit, Failure};
use super::forms;
use super::input::{self, Subject};
use super::measured::{self, Measuring};
use super::output::{self, Format};
use super::stepped::Stepped;
use super::steps::Stepping;
use super::streams::Streams;
use crate::circuit::{Circuit, Tran};
use crate::diagnostic::SourceMap;
use crate::integrate::{Method, Run, SimError, SimOptions, simulate, simulate_system};
use crate::report::figure::Figure;
use crate::report::measured::Measurements;
use crate::report::{json, terminal, text};
use crate::settings::Settings;
use crate::waveform::csv;

/// Divisions of the progress bar.
const PROGRESS: f64 = 1000.0;

/// Simulates and writes what was asked for; a run that broke off is written as far as it came.
///
/// # Errors
/// See [`Failure`].
pub fn sim(args: &SimArgs, streams: &Streams) -> Result<Exit, Failure> {
    let formats = args
        .outputs
        .iter()
        .map(|path| Format::of(path))
        .collect::<Result<Vec<_>, _>>()?;
    let request = Request::of(&args.method, args.events)?;
    if let Some(form) = forms::open(&args.input)? {
        let finished = (forms::run(&form, args)?, Measurements::default());
        return finish(args, &formats, (Some(finished), None), None, streams);
    }
    let (subject, cards) = input::open_with_cards(&args.input, &args.probes, streams)?;
    let sources = cards.as_ref().map(|(_, sources)| sources.clone());
    if let (Subject::Circuit(both), Some((netlist, sources))) = (&subject, cards) {
        let (circuit, _) = &**both;
        if circuit.tran.is_none() && !circuit.dc.is_empty() {
            return dc::sim(args, circuit, &netlist, &sources, streams);
        }
        if !circuit.steps.is_empty() {
            let stepped = Stepped {
                input: &args.input,
                probes: &args.probes,
                sweeps: &circuit.steps,
                netlist,
                sources,
            };
            let stepping = Stepping {
                args,
                stepped,
                request,
            };
            return stepping.sim(&formats, streams);
        }
    }
    let finished = measured_run(&subject, &request, streams)?;
    let circuit = input::circuit_of(&args.input, &subject);
    let place = circuit.ok().zip(sources.as_ref());
    finish(args, &formats, finished, place, streams)
}

/// Writes what a run gave, or as much of it as there is, and says why it ended early.
fn finish(
    args: &SimArgs,
    formats: &[Format],
    (finished, error): Finished,
    place: Option<(&Circuit, &SourceMap)>,
    streams: &Streams,
) -> Result<Exit, Failure> {
    if let Some((run, found)) = &finished {
        if args.method.step.is_some() && run.method == Method::Exact.name() {
            streams.say("note: --step is of no use to exact integration, which has no steps");
        }
        for (path, format) in args.outputs.iter().zip(formats) {
            let figure = || Figure::of_waveforms(&run.waveforms);
            match output::write(run, &figure, *format, path) {
                // A picture of a run that broke off before its first row.
                Err(Failure::Picture(_)) if error.is_some() => {}
                written => written?,
            }
        }
        summarise(run, found, args, streams);
        if args.outputs.is_empty() {
            show(run, streams)?;
        }
    }
    match error {
        None => Ok(Exit::Done),
        Some(error) => Err(input::broke_off(&args.input, &error, place, streams)),
    }
}

/// A run, or as much of it as there is, and what its measurements found.
pub(super) type Finished = (Option<(Run, Measurements)>, Option<SimError>);

/// Simulates, and measures where the circuit asks for it: on the rows at events too.
///
/// # Errors
/// See [`Failure`].
pub(super) fn measured_run(
    subject: &Subject,
    request: &Request,
    streams: &Streams,
) -> Result<Finished, Failure> {
    let measuring = match subject {
        Subject::Circuit(both) if measured::asked(&both.0) => Some((
            Measuring::of(&both.0, request),
            measured::with_signals(&both.0)?,
        )),
        _ => None,
    };
    let request = Request {
        events: request.events || measuring.is_some(),
        ..request.clone()
    };
    let tstep = measuring
        .as_ref()
        .and_then(|(measuring, _)| measuring.tstep());
    let subject = measuring.as_ref().map_or(subject, |(_, subject)| subject);
    let (finished, error) = match run(subject, &request, tstep, streams) {
        Ok(run) => (Some(run), None),
        Err(mut error) => (error.partial.take().map(|run| *run), Some(error)),
    };
    let finished = finished.map(|mut run| {
        let found = measuring.map(|(measuring, _)| measuring.carry_out(&mut run));
        (run, found.unwrap_or_default())
    });
    Ok((finished, error))
}

/// How a subject is to be integrated.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// The method.
    pub method: Method,
    /// θ.
    pub theta: Option<f64>,
    /// γ.
    pub gamma: Option<f64>,
    /// Fixed step, s.
    pub step: Option<f64>,
    /// Relative tolerance.
    pub tol: Option<f64>,
    /// Rows at events.
    pub events: bool,
}

impl Request {
    /// What the flags ask for; θ or γ without a method ask for `theta`.
    ///
    /// # Errors
    /// [`Failure::Message`] when θ or γ are given to another method.
    pub fn of(args: &MethodArgs, events: bool) -> Result<Self, Failure> {
        let shaped = args.theta.is_some() || args.gamma.is_some();
        let method = match args.method {
            args::Method::Auto if shaped => Method::Theta,
            args::Method::Auto => Method::Auto,
            args::Method::Exact => Method::Exact,
            args::Method::Euler => Method::Euler,
            args::Method::Theta => Method::Theta,
        };
        if shaped && method != Method::Theta {
            return Err(Failure::Message(
                "--theta and --gamma belong to `--method theta`".into(),
            ));
        }
        let MethodArgs {
            theta,
            gamma,
            step,
            tol,
            ..
        } = *args;
        Ok(Self {
            method,
            theta,
            gamma,
            step,
            tol,
            events,
        })
    }
}

/// Simulates over the subject's `.tran`, with `tstep` in place of its print step if given.
///
/// # Errors
/// See [`SimError`].
pub fn run(
    subject: &Subject,
    request: &Request,
    tstep: Option<f64>,
    streams: &Streams,
) -> Result<Run, SimError> {
    let tran = tran(subject).map(|t| Tran {
        tstep: tstep.unwrap_or(t.tstep),
        ..t
    });
    let bar = streams.progress(PROGRESS as u64, "simulating");
    let span = tran.map_or(1.0, |t| t.tstop);
    let mut shown = 0;
    let mut report = |t: f64| {
        let position = (t / span * PROGRESS) as u64;
        if position != shown {
            shown = position;
            bar.set_position(position);
        }
    };
    let mut settings = Settings::default();
    if let Some(tol) = request.tol {
        settings.tol = tol;
    }
    let options = SimOptions {
        method: request.method,
        theta: request.theta,
        gamma: request.gamma,
        step: request.step,
        events: request.events,
        settings,
        progress: (!bar.is_hidden()).then_some(&mut report),
    };
    let circuit = match subject {
        Subject::Circuit(both) => Circuit {
            tran,
            ..both.0.clone()
        },
        Subject::System(_) => Circuit::default(),
    };
    let result = match (subject, tran) {
        (Subject::Circuit(both), _) => simulate(&circuit, &both.1, options),
        (Subject::System(system), Some(tran)) => {
            simulate_system(&system.lcs, &system.x0, tran, options)
        }
        (Subject::System(_), None) => {
            let reason = "the system has no \"tran\": {\"tstep\", \"tstop\"}";
            Err(SimError::before(crate::integrate::Reason::Unsupported(
                reason.into(),
            )))
        }
    };
    bar.finish_and_clear();
    result
}

/// The transient that a subject asks for.
#[must_use]
pub fn tran(subject: &Subject) -> Option<Tran> {
    match subject {
        Subject::Circuit(both) => both.0.tran,
        Subject::System(system) => system.tran,
    }
}

/// On standard error: JSON where asked for; words where asked for, for a person, and with `-v`; else the notes alone.
/// What was measured is in all of them.
fn summarise(run: &Run, found: &Measurements, args: &SimArgs, streams: &Streams) {
    match args.summary {
        Some(Summary::Json) => return streams.error(json::summary(run, found)),
        Some(Summary::Text) => streams.error(text::summary(run, streams.verbose)),
        None if streams.verbose || streams.err_is_terminal() => {
            streams.say(text::summary(run, streams.verbose));
        }
        None => {
            for note in &run.notes {
                streams.say(format!("note: {note}"));
            }
        }
    }
    if !found.is_empty() {
        streams.say(found.words());
    }
}

/// On standard output: a character plot for a person, CSV for a program.
fn show(run: &Run, streams: &Streams) -> Result<(), Failure> {
    if streams.out_is_terminal() {
        let (lines, columns) = streams.size();
        return Ok(streams.data(terminal::plot(&run.waveforms, columns, lines))?);
    }
    let mut out = streams.out();
    csv::write(&mut out, &run.waveforms)?;
    Ok(out.flush()?)
}
