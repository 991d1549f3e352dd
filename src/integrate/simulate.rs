//! From a circuit, or a system, to a run.

use cpu_time::ThreadTime;
use nalgebra::DVector;

use crate::circuit::{Circuit, Tran};
use crate::integrate::control::Amplitudes;
use crate::integrate::exact::{self, Exact};
use crate::integrate::run::{Frame, Grid, Log, Reason, SimError, Stepper, run};
use crate::integrate::start;
use crate::integrate::step::Scheme;
use crate::integrate::switching::Threshold;
use crate::integrate::system::Reduce;
use crate::integrate::theta::{Setup, Start, Stepping, Theta};
use crate::integrate::Run;
use crate::lcs::{Hold, Lcs, Position, StorageHold, reduce};
use crate::mna::Behaviour;
use crate::plan::{Plan, plan};
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
    /// Rows at event times too.
    pub events: bool,
    /// Tolerances.
    pub settings: Settings,
    /// Called with the time reached, s.
    pub progress: Option<&'a mut dyn FnMut(f64)>,
}

/// Simulates a circuit over its `.tran`.
///
/// `behaviour` is the circuit's, laws included; piecewise-linear laws are turned into ideal pairs here. Probes are the circuit's.
///
/// # Errors
/// See [`Reason`]; the run so far is in [`SimError::partial`].
pub fn simulate(
    circuit: &Circuit,
    behaviour: &Behaviour,
    options: SimOptions<'_>,
) -> Result<Run, SimError> {
    let tran = circuit.tran.ok_or_else(|| {
        SimError::before(Reason::Unsupported("the netlist asks for no .tran analysis".into()))
    })?;
    let standard = behaviour.standard();
    let initial = start::initial(circuit, &standard, tran.uic, &options.settings)?;
    let thresholds: Vec<Threshold> = standard
        .switches
        .iter()
        .map(|s| Threshold {
            name: s.name.clone(),
            on_above: s.on_above,
            off_below: s.off_below,
        })
        .collect();
    let settle: Vec<bool> =
        standard.switches.iter().map(|s| tran.uic && s.initial.is_none()).collect();
    let reduce_at = |devices: &[Hold], switches: &[bool]| -> Result<Lcs, SimError> {
        let position = Position {
            devices: devices.to_vec(),
            switches: switches.to_vec(),
            storage: StorageHold::Dynamic,
        };
        reduce(&standard, &position)
            .map_err(|error| SimError::before(Reason::Circuit(error.to_string())))
    };
    let mut notes: Vec<String> = behaviour.notes.iter().map(|n| n.message.clone()).collect();
    notes.extend(initial.notes);
    let problem = Problem {
        reduce: &reduce_at,
        pairs: standard.pairs.len(),
        position: initial.switches,
        settle,
        thresholds,
        start: Start::Storage(initial.storage),
        notes,
    };
    drive(problem, tran, options)
}

/// Simulates a system without a circuit behind it (the JSON of `circ lcs`), from state `x`.
///
/// # Errors
/// See [`Reason`].
pub fn simulate_system(
    lcs: &Lcs,
    x: DVector<f64>,
    tran: Tran,
    options: SimOptions<'_>,
) -> Result<Run, SimError> {
    let reduce_at = |_: &[Hold], _: &[bool]| Ok(lcs.clone());
    let problem = Problem {
        reduce: &reduce_at,
        pairs: lcs.m(),
        position: lcs.switches.iter().map(|(_, on)| *on).collect(),
        settle: vec![],
        thresholds: vec![],
        start: Start::State(x),
        notes: vec![],
    };
    drive(problem, tran, options)
}

/// What the steppers share.
struct Problem<'p> {
    reduce: &'p dyn Fn(&[Hold], &[bool]) -> Result<Lcs, SimError>,
    pairs: usize,
    position: Vec<bool>,
    /// Switches whose start position follows from the start state.
    settle: Vec<bool>,
    thresholds: Vec<Threshold>,
    start: Start,
    notes: Vec<String>,
}

/// Steps of the run that finds the amplitudes beforehand.
const SCOUT_STEPS: f64 = 256.0;
/// The scout gives up after this many steps (trains of many pulses); what it has seen by then is used.
const SCOUT_LIMIT: u64 = 20_000;

impl Problem<'_> {
    /// The system with all devices free.
    fn system(&self, position: &[bool]) -> Result<Lcs, SimError> {
        (self.reduce)(&vec![Hold::Free; self.pairs], position)
    }

    fn reducer(&self) -> Reduce<'_> {
        Box::new(move |position: &[bool]| self.system(position))
    }

    fn stepper(
        &self,
        tran: &Tran,
        scheme: Scheme,
        stepping: Stepping,
        settings: &Settings,
    ) -> Result<Theta<'_>, SimError> {
        Theta::new(Setup {
            reduce: self.reducer(),
            position: self.position.clone(),
            thresholds: self.thresholds.clone(),
            t: 0.0,
            start: self.start.clone(),
            scheme,
            stepping,
            longest: tran.tmax.unwrap_or(f64::INFINITY),
            settings: settings.clone(),
        })
    }

    /// Positions of switches without `ON`/`OFF` that agree with their controls at the start state.
    fn settle_switches(&mut self, tran: &Tran, settings: &Settings) -> Result<(), SimError> {
        let mut seen = Vec::new();
        while self.settle.contains(&true) {
            let stepping = Stepping::Fixed(tran.tstep);
            let mut theta = self.stepper(tran, Scheme::MOREAU, stepping, settings)?;
            let controls = theta.controls_at_start()?;
            let wanted: Vec<bool> = (0..controls.len())
                .map(|k| {
                    if self.settle[k] {
                        controls[k] > self.thresholds[k].on_above
                    } else {
                        self.position[k]
                    }
                })
                .collect();
            drop(theta);
            if wanted == self.position {
                break;
            }
            if seen.contains(&wanted) {
                return Err(SimError::at(0.0, Reason::SwitchesDoNotSettle));
            }
            seen.push(std::mem::replace(&mut self.position, wanted));
        }
        Ok(())
    }

    /// Amplitudes from a coarse run.
    fn scout(&self, tran: &Tran, settings: &Settings) -> Option<Amplitudes> {
        let settings = Settings { max_steps: SCOUT_LIMIT, ..settings.clone() };
        let stepping = Stepping::Fixed(tran.tstop / SCOUT_STEPS);
        let mut theta = self.stepper(tran, Scheme::MOREAU, stepping, &settings).ok()?;
        let mut log = Log::new(0, f64::INFINITY, false);
        for k in 1..=SCOUT_STEPS as u32 {
            // A failure here will be met, and reported, by the run itself.
            if theta.advance(tran.tstop * f64::from(k) / SCOUT_STEPS, &mut log).is_err() {
                break;
            }
            theta.see();
        }
        Some(theta.amplitudes().clone())
    }
}

fn drive(problem: Problem<'_>, tran: Tran, options: SimOptions<'_>) -> Result<Run, SimError> {
    let begin = ThreadTime::now();
    let mut result = dispatch(problem, tran, options);
    let stats = match &mut result {
        Ok(run) => Some(&mut run.stats),
        Err(error) => error.partial.as_mut().map(|run| &mut run.stats),
    };
    if let Some(stats) = stats {
        stats.cpu_seconds = begin.elapsed().as_secs_f64();
    }
    result
}

fn dispatch(
    mut problem: Problem<'_>,
    tran: Tran,
    options: SimOptions<'_>,
) -> Result<Run, SimError> {
    check(&tran, &options)?;
    problem.settle_switches(&tran, &options.settings)?;
    let lcs = problem.system(&problem.position)?;
    let Plan { method, scheme, words } = plan(&lcs, &options);
    let grid = Grid { tstart: tran.tstart, tstep: tran.tstep, tstop: tran.tstop };
    let frame = Frame {
        title: lcs.title.clone(),
        names: lcs.outputs.names.clone(),
        units: lcs.outputs.units.clone(),
        grid,
        method: method.name().into(),
        plan: words,
        notes: problem.notes.clone(),
        progress: options.progress,
    };
    let log = Log::new(frame.names.len(), grid.tstart, options.events);
    if method == Method::Exact {
        let Start::Storage(start) = problem.start.clone() else {
            return Err(SimError::before(Reason::Unsupported(NO_MODES.into())));
        };
        let mut exact = Exact::new(exact::Setup {
            assemble: Box::new(|devices: &[Hold], position: &[bool]| {
                (problem.reduce)(devices, position)
            }),
            pairs: problem.pairs,
            position: problem.position.clone(),
            thresholds: problem.thresholds.clone(),
            t: 0.0,
            until: tran.tstop,
            start,
            h: tran.tmax.map_or(tran.tstep, |tmax| tmax.min(tran.tstep)),
            energy: true,
            settings: options.settings,
        })?;
        return run(&mut exact, frame, log);
    }
    let stepping = match options.step {
        Some(h) => Stepping::Fixed(h),
        None => Stepping::Controlled { span: tran.tstop, first: tran.tstep / FIRST_STEP },
    };
    let mut theta = problem.stepper(&tran, scheme, stepping, &options.settings)?;
    if options.step.is_none()
        && let Some(amplitudes) = problem.scout(&tran, &options.settings)
    {
        theta.expect_amplitudes(amplitudes);
    }
    run(&mut theta, frame, log)
}

/// A system file has one set of matrices and no circuit to take the modes from.
const NO_MODES: &str = "exact integration needs the circuit behind the system; use euler or theta";

/// The first step of the error control is the output step divided by this.
const FIRST_STEP: f64 = 64.0;

fn check(tran: &Tran, options: &SimOptions<'_>) -> Result<(), SimError> {
    let wrong = |what: &str| Err(SimError::before(Reason::Unsupported(what.into())));
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
