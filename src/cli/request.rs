//! What a run is asked for on the command line, and the run.

use std::sync::atomic::AtomicBool;

use super::args::{self, MethodArgs};
use super::exit::Failure;
use super::input::Subject;
use super::streams::Streams;
use crate::circuit::{Circuit, Tran};
use crate::integrate::{Error, Method, Reason, Run, SimOptions, Sink, simulate, simulate_system};
use crate::report::si::quantity;
use crate::settings::Settings;

/// Divisions of the progress bar.
const PROGRESS: f64 = 1000.0;

/// How a subject is to be integrated.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Request {
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
    /// No further runs beside one in steps, whose error is then not known.
    pub unestimated: bool,
    /// No run of more steps, where that is not for the settings to say.
    pub most_steps: Option<u64>,
}

impl Request {
    /// The tolerances.
    pub(super) fn settings(&self) -> Settings {
        let mut settings = Settings::default();
        if let Some(tol) = self.tol {
            settings.tol = tol;
        }
        if let Some(most) = self.most_steps {
            settings.max_steps = most;
        }
        settings
    }

    /// What the flags ask for; θ or γ without a method ask for `theta`.
    ///
    /// # Errors
    /// [`Failure::Told`] when θ or γ are given to another method.
    pub(super) fn of(args: &MethodArgs, events: bool) -> Result<Self, Failure> {
        let shaped = args.theta.is_some() || args.gamma.is_some();
        let method = match args.method {
            args::Method::Auto if shaped => Method::Theta,
            args::Method::Auto => Method::Auto,
            args::Method::Exact => Method::Exact,
            args::Method::Euler => Method::Euler,
            args::Method::Theta => Method::Theta,
        };
        if shaped && method != Method::Theta {
            return Err(Failure::told(
                "option-conflict",
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
            unestimated: args.no_estimate,
            most_steps: None,
        })
    }
}

/// Where the rows of a run go.
#[derive(Default)]
pub(super) struct Route<'a> {
    /// Rows at events and corners.
    pub corners: bool,
    /// Rows between those, which pictures want.
    pub pictures: bool,
    /// Rows are read as numbers.
    pub numbers: bool,
    /// Takes rows as they come.
    pub sink: Option<Sink<'a>>,
    /// Rows are for the sink alone.
    pub discard: bool,
    /// Ends the run.
    pub cancel: Option<&'a AtomicBool>,
    /// Bytes for rows at most, if not the usual.
    pub held: Option<usize>,
    /// Begins at the periodic steady state.
    pub from_orbit: bool,
}

/// Simulates over the subject's `.tran`, with `tstep` in place of its print step if given.
///
/// # Errors
/// See [`Error`].
pub(super) fn run(
    subject: &Subject,
    request: &Request,
    tstep: Option<f64>,
    streams: &Streams,
) -> Result<Run, Error> {
    run_to(subject, request, tstep, Route::default(), streams)
}

/// The same with rows on their way.
pub(super) fn run_to(
    subject: &Subject,
    request: &Request,
    tstep: Option<f64>,
    route: Route<'_>,
    streams: &Streams,
) -> Result<Run, Error> {
    let tran = subject.tran().map(|t| Tran {
        tstep: tstep.unwrap_or(t.tstep),
        ..t
    });
    with_options(tran, request, route, streams, |options| {
        match (subject, tran) {
            (Subject::Circuit(model), _) => {
                let circuit = Circuit {
                    tran,
                    ..model.circuit().clone()
                };
                simulate(&circuit, model.multiport(), options)
            }
            (Subject::System(system), Some(tran)) => {
                simulate_system(&system.lcs, &system.x0, tran, options)
            }
            (Subject::System(_), None) => Err(no_tran()),
        }
    })
}

/// Runs what takes options, with a progress bar over the span of `tran`.
pub(super) fn with_options<R>(
    tran: Option<Tran>,
    request: &Request,
    route: Route<'_>,
    streams: &Streams,
    run: impl FnOnce(SimOptions<'_>) -> R,
) -> R {
    let mut sink = route.sink;
    let sink = sink.as_mut().map(|s| &mut **s as Sink<'_>);
    let bar = streams.progress(PROGRESS as u64, "setting up");
    let span = tran.map_or(1.0, |t| t.tstop);
    let mut shown = 0;
    let mut report = |t: f64| {
        let position = (t / span * PROGRESS) as u64;
        if position != shown {
            shown = position;
            bar.set_position(position);
            bar.set_message(format!(
                "simulating {} of {}",
                quantity(t, "s", 3),
                quantity(span, "s", 3)
            ));
        }
    };
    let mut settings = request.settings();
    if let Some(held) = route.held {
        settings.max_held = held;
    }
    let result = run(SimOptions {
        method: request.method,
        theta: request.theta,
        gamma: request.gamma,
        step: request.step,
        events: request.events,
        corners: route.corners,
        rows: sink,
        discard: route.discard,
        cancel: route.cancel,
        settings,
        unestimated: request.unestimated,
        start: None,
        progress: (!bar.is_hidden()).then_some(&mut report),
    });
    bar.finish_and_clear();
    result
}

pub(super) fn no_tran() -> Error {
    let reason = "the system has no \"tran\": {\"tstep\", \"tstop\"}";
    Error::before(Reason::Unsupported(reason.into()))
}
