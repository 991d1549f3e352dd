//! From a circuit, or a system, to a run.

use std::cell::Cell;
use std::rc::Rc;
use std::sync::atomic::AtomicBool;

use crate::integrate::cpu::ThreadTime;
use crate::settings::tolerances::sparse::MOST_DENSE_STATES;
use crate::settings::tolerances::steps::{FIRST, HANDOVER_STEPS};
use nalgebra::DVector;

use crate::circuit::{Circuit, Tran};
use crate::integrate::beside::beside_handover;
use crate::integrate::companion::Accompanied;
use crate::integrate::error::{Error, Reason, is_final};
use crate::integrate::exact::Place;
use crate::integrate::grid::Grid;
use crate::integrate::log::Log;
use crate::integrate::problem::Problem;
use crate::integrate::ready::ready;
use crate::integrate::rows::{Asked, Sink};
use crate::integrate::run::{Frame, attempt, run};
use crate::integrate::theta::Stepping;
use crate::integrate::{Note, Run, Simulation};
use crate::lcs::Lcs;
use crate::mna::StaticMultiport;
use crate::plan::Plan;
use crate::settings::Settings;

/// Integration methods.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// What the plan finds best.
    #[default]
    Auto,
    /// Event-driven matrix exponentials.
    Exact,
    /// Moreau's scheme, θ = γ = 1.
    Euler,
    /// (θ, γ), by default ½ and ½.
    Theta,
}

impl Method {
    /// `auto`, `exact`, `euler`, `theta`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Exact => "exact",
            Self::Euler => "euler",
            Self::Theta => "theta",
        }
    }
}

/// What a simulation may be asked for.
#[derive(Default)]
pub struct SimOptions<'a> {
    /// The method.
    pub method: Method,
    /// θ, default ½ (1 for `euler`).
    pub theta: Option<f64>,
    /// γ, default ½ (1 for `euler`).
    pub gamma: Option<f64>,
    /// Fixed step, s; error-controlled where absent.
    pub step: Option<f64>,
    /// Rows at event times too. Where the circuit's `.tran` names no print step there are always rows at events and corners.
    pub events: bool,
    /// Rows at event times and at corners of sources too.
    pub corners: bool,
    /// Takes the rows as they come, besides [`Run::waveforms`].
    pub rows: Option<Sink<'a>>,
    /// Rows are for [`Self::rows`] alone: a run of any length needs no memory for them.
    pub discard: bool,
    /// Ends the run when set, with [`Reason::Interrupted`] and all rows so far.
    pub cancel: Option<&'a AtomicBool>,
    /// No further runs beside one in steps, which tell its error: the run takes less time, and its error is not known.
    pub unestimated: bool,
    /// Where the run begins, in place of the initial conditions or the operating point.
    pub start: Option<Standing>,
    /// Tolerances.
    pub settings: Settings,
    /// Called with the time reached, s.
    pub progress: Option<&'a mut dyn FnMut(f64)>,
}

impl SimOptions<'_> {
    /// The same once more, without what takes the rows.
    pub(crate) fn again(&mut self) -> SimOptions<'_> {
        SimOptions {
            rows: None,
            progress: match &mut self.progress {
                Some(progress) => Some(&mut **progress),
                None => None,
            },
            start: self.start.clone(),
            settings: self.settings.clone(),
            ..*self
        }
    }
}

/// Simulates a circuit over its `.tran`.
///
/// `behaviour` is the circuit's, laws included; piecewise-linear laws are turned into ideal pairs here. Probes are the circuit's.
///
/// # Errors
/// See [`Reason`]; the run so far is in [`Error::partial`].
pub fn simulate(
    circuit: &Circuit,
    behaviour: &StaticMultiport,
    options: SimOptions<'_>,
) -> Result<Run, Error> {
    simulate_beside(None, circuit, behaviour, options)
}

/// The same with the systems that a simulation of the same circuit has come through.
///
/// # Errors
/// As [`simulate`].
pub(crate) fn simulate_beside(
    other: Option<&Simulation>,
    circuit: &Circuit,
    behaviour: &StaticMultiport,
    mut options: SimOptions<'_>,
) -> Result<Run, Error> {
    let tran = circuit.tran.ok_or_else(no_transient)?;
    let start = options.start.take();
    let uic = tran.uic || start.is_some();
    // Steps of curved laws pass comparators as events that they have to find; a start tells what pairs there are.
    let plain = options.method == Method::Auto && start.is_none() && circuit.is_curved();
    let known = plain.then(|| circuit.with_comparisons_made()).flatten();
    let known = known.and_then(|(c, count)| Some((crate::mna::behaviour(&c).ok()?, c, count)));
    let (circuit, behaviour) = match &known {
        Some((behaviour, circuit, _)) => (circuit, behaviour),
        None => (circuit, behaviour),
    };
    let begun = start.as_ref();
    let begun = begun.and_then(|start| start.sources_of(behaviour, tran.tstop));
    let behaviour = begun.as_ref().unwrap_or(behaviour);
    let mut problem = Problem::of_circuit(circuit, behaviour, uic, &options.settings)?;
    if let Some(other) = other {
        problem = problem.sharing(other.problem());
    }
    if let Some((_, _, count)) = known {
        problem.known_comparators = count;
    }
    let (mut off, mut notes) = (0.0, vec![]);
    if let Some(standing) = start {
        (off, notes) = (standing.off, standing.notes);
        let place = Place {
            t: standing.t,
            storage: DVector::from_vec(standing.state),
            switches: standing.switches,
        };
        problem = problem.standing_at(place, standing.conducting);
    }
    let mut result = drive(problem, tran, options);
    let run = match &mut result {
        Ok(run) => Some(run),
        Err(error) => error.partial.as_deref_mut(),
    };
    if let Some(run) = run {
        run.error.begins_off(off);
        run.notes.append(&mut notes);
    }
    result
}

/// Where a run begins in the course of a transient: after the edges of its time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Standing {
    /// Time, s.
    pub t: f64,
    /// Capacitor voltages, V, and inductor currents, A.
    pub state: Vec<f64>,
    /// By switch: on.
    pub switches: Vec<bool>,
    /// By ideal pair: conducts; empty where not known.
    pub conducting: Vec<bool>,
    /// How long before t = 0 sources that repeat have begun to, s: those of an orbit do so for ever.
    pub begun: f64,
    /// How far the state may be off, in parts of its amplitudes: the run is by no less. Infinite where that is not known.
    pub off: f64,
    /// What is to be told of a run that begins here.
    pub notes: Vec<Note>,
}

impl Standing {
    /// A circuit in a run of so many seconds that begins here, where its sources are others then.
    pub(crate) fn sources_of(
        &self,
        behaviour: &StaticMultiport,
        span: f64,
    ) -> Option<StaticMultiport> {
        if self.begun == 0.0 {
            return None;
        }
        let mut own = behaviour.clone();
        for port in &mut own.sources {
            port.input.source.wave.begin_earlier(self.begun, span);
        }
        Some(own)
    }
}

fn no_transient() -> Error {
    Error::before(Reason::Unsupported(
        "the netlist asks for no .tran analysis".into(),
    ))
}

/// Simulates a system without a circuit behind it (the JSON of `circ lcs`), from state `x`.
///
/// # Errors
/// See [`Reason`].
pub fn simulate_system(
    lcs: &Lcs,
    x: &DVector<f64>,
    tran: Tran,
    options: SimOptions<'_>,
) -> Result<Run, Error> {
    match drive(Problem::of_system(lcs, x), tran, options) {
        Ok(run) => Ok(Run {
            balanced: false,
            ..run
        }),
        Err(mut error) => {
            if let Some(partial) = &mut error.partial {
                partial.balanced = false;
            }
            Err(error)
        }
    }
}

/// Steps chosen by their error.
pub(super) fn controlled(tran: &Tran) -> Stepping {
    Stepping::Controlled {
        span: tran.tstop,
        first: FIRST * tran.tstep,
    }
}

fn drive(problem: Problem, tran: Tran, options: SimOptions<'_>) -> Result<Run, Error> {
    let begin = ThreadTime::now();
    let elsewhere = Rc::<Cell<f64>>::default();
    let mut result = dispatch(problem, tran, options, Rc::clone(&elsewhere));
    let stats = match &mut result {
        Ok(run) => Some(&mut run.stats),
        Err(error) => error.partial.as_mut().map(|run| &mut run.stats),
    };
    if let Some(stats) = stats {
        stats.cpu_seconds = begin.elapsed().as_secs_f64() - elsewhere.get();
    }
    result
}

/// `elsewhere` counts the CPU seconds of what takes the rows.
fn dispatch(
    mut problem: Problem,
    tran: Tran,
    options: SimOptions<'_>,
    elsewhere: Rc<Cell<f64>>,
) -> Result<Run, Error> {
    check(&tran, &options)?;
    problem.rows_at_corners = options.corners || options.events || !tran.prints;
    let circuit = ready(&mut problem, &tran, &options)?;
    let Plan {
        method,
        scheme,
        mut words,
    } = circuit.plan(&problem, &options);
    if problem.known_comparators > 0 {
        words.push(format!(
            "comparators whose inputs are sources alone: {}, whose edges are computed before the run",
            problem.known_comparators
        ));
    }
    if let (Method::Exact, Some(obstacle)) = (options.method, circuit.not_exact()) {
        return Err(Error::before(Reason::Unsupported(format!(
            "no exact integration: {obstacle}"
        ))));
    }
    let grid = Grid::of(&tran);
    let Columns {
        title,
        names,
        units,
    } = Columns::of(&problem);
    let columns = names.len();
    let most = (!options.discard).then(|| Grid::most(columns, options.settings.max_held));
    grid.check(columns, most)?;
    let endless = problem
        .too_short(&tran, &options.settings)
        .or_else(|| circuit.too_many_edges(&tran, &options.settings));
    if let Some(error) = endless {
        return Err(error);
    }
    let frame = |method: Method, notes: Vec<Note>| Frame {
        title: title.clone(),
        names: names.clone(),
        units: units.clone(),
        grid,
        method: method.name().into(),
        plan: words.clone(),
        notes,
        progress: None,
    };
    let asked = Asked {
        events: options.events || !tran.prints,
        corners: options.corners || !tran.prints,
        sink: options.rows,
        discard: options.discard,
        most,
        cancel: options.cancel,
        elsewhere,
    };
    let mut log = Log::of(columns, grid.tstart, asked);
    let (mut method, mut notes) = (method, problem.notes.clone());
    let (mut progress, settings) = (options.progress, &options.settings);
    if options.method == Method::Exact {
        let mut exact = circuit.exact(&problem, &tran, settings)?;
        let frame = frame(method, notes);
        return run(&mut *exact, Frame { progress, ..frame }, log);
    }
    if method == Method::Exact {
        let frame = Frame {
            progress: progress.as_mut().map(|p| &mut **p as &mut dyn FnMut(f64)),
            ..frame(method, notes.clone())
        };
        let make = |steps| circuit.handover(&problem, &tran, settings, steps);
        let beside = if options.unestimated {
            vec![]
        } else {
            beside_handover(&make)
        };
        let attempted = make(HANDOVER_STEPS).and_then(|mut both| {
            let mut all = Accompanied::new(&mut *both, beside, &units, tran.tstop, options.cancel);
            attempt(&mut all, frame, &mut log, false)
        });
        match attempted {
            Ok(run) => return Ok(run),
            Err(error) if is_final(&error) => return Err(error),
            Err(error) => {
                let text = match log.again() {
                    None => format!(
                        "exact integration ended, and the whole run was made in steps instead: {error}"
                    ),
                    Some(t) => format!(
                        "exact integration ended, and the whole run was made in steps instead; rows until {t:e} s are exact: {error}"
                    ),
                };
                notes.push(Note::of("steps-instead", error.concerned(), text));
            }
        }
        method = Method::Theta;
        if circuit.is_apart() {
            problem.prepare(&tran, settings)?;
        }
    }
    let stepping = options.step.map_or(controlled(&tran), Stepping::Fixed);
    if circuit.is_large() {
        let beside = match options.step {
            _ if options.unestimated => vec![],
            Some(h) => problem.beside_fixed(&tran, scheme, (h, true), settings),
            None => problem.beside_large(&tran, scheme, settings),
        };
        let frame = Frame {
            progress: progress.as_mut().map(|p| &mut **p as &mut dyn FnMut(f64)),
            ..frame(method, notes.clone())
        };
        let (storage, pairs) = problem.size();
        let last = storage + pairs > MOST_DENSE_STATES;
        let attempted = problem
            .sparse(&tran, scheme, stepping, settings)
            .and_then(|mut sparse| {
                let mut all =
                    Accompanied::new(&mut sparse, beside, &units, tran.tstop, options.cancel);
                attempt(&mut all, frame, &mut log, last)
            });
        match attempted {
            Ok(run) => return Ok(run),
            Err(error) if last || is_final(&error) => return Err(error),
            Err(error) => {
                log.again();
                let text =
                    format!("steps on dense matrices were made instead of sparse ones: {error}");
                notes.push(Note::of("steps-instead", error.concerned(), text));
            }
        }
        problem.prepare(&tran, settings)?;
    }
    let mut theta = problem.stepper(problem.start.clone(), &tran, scheme, stepping, settings)?;
    let amplitudes = match options.step {
        Some(_) => None,
        None => problem.scout(&tran, settings),
    };
    if let Some(amplitudes) = &amplitudes {
        theta.expect_amplitudes(amplitudes.clone());
    }
    theta.read_between_steps(tran.tstop);
    let embedded = theta.is_smooth();
    let frame = frame(method, notes);
    let beside = match options.step {
        _ if options.unestimated => vec![],
        Some(h) => problem.beside_fixed(&tran, scheme, (h, false), settings),
        None => problem.beside_controlled(&tran, scheme, amplitudes.as_ref(), settings, embedded),
    };
    let mut all = Accompanied::new(&mut theta, beside, &units, tran.tstop, options.cancel);
    run(&mut all, Frame { progress, ..frame }, log)
}

/// What the rows of a problem are.
struct Columns {
    title: String,
    names: Vec<String>,
    units: Vec<&'static str>,
}

impl Columns {
    fn of(problem: &Problem) -> Self {
        let multiport = &problem.systems.multiport;
        let probes = &multiport.observed[..multiport.probes];
        Self {
            title: multiport.title.clone(),
            names: probes.iter().map(|probe| probe.name.clone()).collect(),
            units: probes.iter().map(|probe| probe.unit).collect(),
        }
    }
}

pub(super) fn check(tran: &Tran, options: &SimOptions<'_>) -> Result<(), Error> {
    let wrong = |what: &str| Err(Error::before(Reason::Unsupported(what.into())));
    let between = |v: Option<f64>| v.is_none_or(|v| (0.5..=1.0).contains(&v));
    if !between(options.theta) || !between(options.gamma) {
        return wrong("theta and gamma lie between 1/2 and 1");
    }
    if options.step.is_some_and(|h| !(h > 0.0 && h.is_finite())) {
        return wrong("the step must be a positive time");
    }
    let times = tran.tstep > 0.0 && tran.tstart >= 0.0 && tran.tstop > tran.tstart;
    if !times || !tran.tstop.is_finite() {
        return wrong(".tran needs 0 <= tstart < tstop and a positive tstep");
    }
    Ok(())
}
