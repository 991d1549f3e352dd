//! From a circuit, or a system, to a run.

use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::sync::atomic::AtomicBool;

use cpu_time::ThreadTime;
use nalgebra::DVector;

use crate::circuit::{self, Circuit, ElementId, Tran};
use crate::integrate::Run;
use crate::integrate::control::Amplitudes;
use crate::integrate::exact::{self, Exact, Place};
use crate::integrate::handover::Handover;
use crate::integrate::inputs::Inputs;
use crate::integrate::line::Line;
use crate::integrate::rows::{Asked, Sink};
use crate::integrate::run::{Frame, Grid, Log, Reason, SimError, Stepper, attempt, is_final, run};
use crate::integrate::step::Scheme;
use crate::integrate::switching::{Threshold, at_start};
use crate::integrate::theta::{Setup, Start, Stepping, Theta};
use crate::integrate::{reading, roles, start};
use crate::lcs::{Hold, Input, Lcs, Position, StorageHold, reduce};
use crate::mna::Behaviour;
use crate::plan::{Plan, not_exact, plan};
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
        SimError::before(Reason::Unsupported(
            "the netlist asks for no .tran analysis".into(),
        ))
    })?;
    let standard = behaviour.standard();
    let initial = start::initial(circuit, &standard, tran.uic, &options.settings)?;
    let mut notes: Vec<String> = behaviour.notes.iter().map(|n| n.message.clone()).collect();
    notes.extend(initial.notes);
    let problem = Problem {
        lines: lines(circuit, &initial.waves),
        position: initial.switches,
        conducting: initial.conducting,
        settle: standard
            .switches
            .iter()
            .map(|s| tran.uic && s.initial.is_none())
            .collect(),
        start: initial.storage,
        notes,
        known: RefCell::default(),
        original: behaviour,
        behaviour: standard,
    };
    drive(problem, tran, options)
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
) -> Result<Run, SimError> {
    let original = Behaviour::from_lcs(lcs);
    let behaviour = original.standard();
    let mut start = DVector::zeros(behaviour.storage.len());
    start.rows_mut(0, x.len()).copy_from(x);
    let problem = Problem {
        lines: vec![],
        position: vec![],
        conducting: vec![],
        settle: vec![],
        start,
        notes: vec![],
        known: RefCell::default(),
        original: &original,
        behaviour,
    };
    drive(problem, tran, options)
}

/// The transmission lines of a circuit; `waves` are what arrives at first, line by line.
fn lines(circuit: &Circuit, waves: &[[f64; 2]]) -> Vec<Line> {
    let name = |id: ElementId| circuit.elements[id.index()].name.clone();
    let line = |(line, initial): (&circuit::Line, &[f64; 2])| Line {
        impedance: line.impedance.f64,
        delay: line.delay,
        impedances: line.ports.map(|port| name(port.impedance)),
        sources: line.ports.map(|port| name(port.wave)),
        initial: *initial,
    };
    circuit.lines.iter().zip(waves).map(line).collect()
}

/// What the steppers share.
struct Problem<'a> {
    /// As given.
    original: &'a Behaviour,
    /// All laws as ideal pairs.
    behaviour: Behaviour,
    /// Transmission lines.
    lines: Vec<Line>,
    position: Vec<bool>,
    /// See [`start::Initial::conducting`]; empty where not known.
    conducting: Vec<bool>,
    /// Switches whose start position follows from the start state.
    settle: Vec<bool>,
    /// Storage vector s⁻ before the start.
    start: DVector<f64>,
    notes: Vec<String>,
    /// See [`Problem::free`].
    known: RefCell<Vec<(Vec<bool>, Lcs)>>,
}

/// Steps of the run that finds the amplitudes beforehand.
const SCOUT_STEPS: f64 = 256.0;
/// The scout gives up after this many steps (trains of many pulses); what it has seen by then is used.
const SCOUT_LIMIT: u64 = 20_000;

impl Problem<'_> {
    fn reduce(&self, devices: &[Hold], switches: &[bool]) -> Result<Lcs, SimError> {
        let position = Position {
            devices: devices.to_vec(),
            switches: switches.to_vec(),
            storage: StorageHold::Dynamic,
        };
        reduce(&self.behaviour, &position).map_err(|error| SimError::before(error.into()))
    }

    /// The system of a position with all devices free.
    fn free(&self, switches: &[bool]) -> Result<Lcs, SimError> {
        let mut known = self.known.borrow_mut();
        if let Some((_, lcs)) = known.iter().find(|(position, _)| position == switches) {
            return Ok(lcs.clone());
        }
        let lcs = self.reduce(&vec![Hold::Free; self.behaviour.pairs.len()], switches)?;
        known.push((switches.to_vec(), lcs.clone()));
        Ok(lcs)
    }

    fn thresholds(&self) -> Vec<Threshold> {
        self.behaviour.switches.iter().map(Threshold::of).collect()
    }

    /// `lcs` is the system of the start position.
    fn exact(&self, tran: &Tran, lcs: &Lcs, settings: &Settings) -> Result<Exact<'_>, SimError> {
        let mut exact = Exact::new(exact::Setup {
            assembler: exact::Assembler::new(&self.behaviour)
                .with_steps_of(self.original)
                .knowing(&self.position, lcs),
            position: self.position.clone(),
            t: 0.0,
            until: tran.tstop,
            start: self.start.clone(),
            h: tran.tstep,
            energy: true,
            settings: settings.clone(),
        })?;
        exact.expect(&self.conducting);
        Ok(exact)
    }

    fn start(&self) -> Place {
        Place {
            t: 0.0,
            storage: self.start.clone(),
            switches: self.position.clone(),
        }
    }

    fn stepper(
        &self,
        place: Place,
        tran: &Tran,
        scheme: Scheme,
        stepping: Stepping,
        settings: &Settings,
    ) -> Result<Theta<'_>, SimError> {
        let mut theta = Theta::new(Setup {
            reduce: Box::new(|position| self.free(position)),
            position: place.switches,
            thresholds: self.thresholds(),
            t: place.t,
            start: Start::Storage(place.storage),
            scheme,
            stepping,
            longest: tran.tmax.unwrap_or(f64::INFINITY),
            settings: settings.clone(),
        })?;
        theta.attach(&self.lines);
        theta.expect(&self.conducting);
        Ok(theta)
    }

    /// See [`roles`]; returns the system of the start position.
    fn choose_roles(&mut self, tran: &Tran) -> Result<Lcs, SimError> {
        let lcs = self.free(&self.position)?;
        if roles::doubtful(&lcs, tran.tstop) {
            let other = self.behaviour.in_other_roles();
            let first = std::mem::replace(&mut self.behaviour, other);
            let known = self.known.take();
            match self.free(&self.position) {
                Ok(other) if roles::better(&lcs, &other) => return Ok(other),
                _ => (self.behaviour, self.known) = (first, RefCell::new(known)),
            }
        }
        Ok(lcs)
    }

    /// Positions of switches without `ON`/`OFF` that agree with their controls at the start state; whether one moved.
    fn settle_switches(&mut self, tran: &Tran, settings: &Settings) -> Result<bool, SimError> {
        let mut seen = Vec::new();
        while self.settle.contains(&true) {
            let lcs = self.free(&self.position)?;
            let controls =
                match reading::of_sources(&lcs.controls, &Inputs::new(&lcs.inputs).all(0.0)) {
                    Some(controls) => controls,
                    None => {
                        let stepping = Stepping::Fixed(tran.tstep);
                        self.stepper(self.start(), tran, Scheme::MOREAU, stepping, settings)?
                            .controls_at_start()?
                    }
                };
            let asked: Vec<bool> = (0..controls.len())
                .map(|k| {
                    let switch = &self.behaviour.switches[k];
                    let on = self.position[k];
                    if self.settle[k] {
                        Threshold::of(switch).position(on, controls[k])
                    } else {
                        on
                    }
                })
                .collect();
            let wanted = at_start(&self.behaviour.switches, asked);
            // Positions that contradict each other are left to the run.
            if wanted == self.position || seen.contains(&wanted) {
                break;
            }
            let next = self.step_towards(wanted, &seen);
            seen.push(std::mem::replace(&mut self.position, next));
        }
        Ok(!seen.is_empty())
    }

    /// `wanted`, or where shorts and open branches contradict each other in it the first position on the way, one switch further,
    /// that is a circuit and not `seen`: what that switch drives may ask for another position.
    fn step_towards(&self, wanted: Vec<bool>, seen: &[Vec<bool>]) -> Vec<bool> {
        if self.free(&wanted).is_ok() {
            return wanted;
        }
        let moving = (0..wanted.len()).filter(|&k| wanted[k] != self.position[k]);
        let positions = moving.map(|k| {
            let mut position = self.position.clone();
            position[k] = wanted[k];
            at_start(&self.behaviour.switches, position)
        });
        let mut sound = positions.filter(|p| !seen.contains(p) && self.free(p).is_ok());
        sound.next().unwrap_or(wanted)
    }

    /// The error of a line whose delay asks for more steps than a run may take.
    fn too_short(&self, tran: &Tran, settings: &Settings) -> Option<SimError> {
        let limit = settings.max_steps;
        let asks = |line: &&Line| tran.tstop / line.longest_step() > limit as f64;
        let line = self.lines.iter().find(asks)?;
        let what = format!(
            "a delay of {:e} s asks for more than {limit} steps until {:e} s; a resistor or a short may take the line's place",
            line.delay, tran.tstop
        );
        Some(SimError::before(Reason::Unsupported(what)).device(line.sources[0].clone()))
    }

    /// The error of a source with more edges and kinks than a run may take steps.
    fn too_many_edges(&self, lcs: &Lcs, tran: &Tran, settings: &Settings) -> Option<SimError> {
        let limit = settings.max_steps;
        let corners = |input: &Input| input.source.wave.corners(tran.tstop);
        let input = lcs.inputs.iter().find(|i| corners(i) > limit as f64)?;
        let what = format!(
            "it has {:.1e} edges and kinks until {:e} s, where a run may take {limit} steps",
            corners(input),
            tran.tstop
        );
        Some(SimError::before(Reason::Unsupported(what)).device(input.name.clone()))
    }

    /// Amplitudes from a coarse run.
    fn scout(&self, tran: &Tran, settings: &Settings) -> Option<Amplitudes> {
        let settings = Settings {
            max_steps: SCOUT_LIMIT,
            ..settings.clone()
        };
        let stepping = Stepping::Fixed(tran.tstop / SCOUT_STEPS);
        let mut theta = self
            .stepper(self.start(), tran, Scheme::MOREAU, stepping, &settings)
            .ok()?;
        let mut log = Log::new(0, f64::INFINITY, false);
        for k in 1..=SCOUT_STEPS as u32 {
            // A failure here will be met, and reported, by the run itself.
            if theta
                .advance(tran.tstop * f64::from(k) / SCOUT_STEPS, &mut log)
                .is_err()
            {
                break;
            }
            theta.see();
        }
        Some(theta.amplitudes().clone())
    }
}

/// Moreau's steps in an output step where they take the place of exact integration.
const HANDOVER_STEPS: f64 = 128.0;

impl Problem<'_> {
    /// Exact integration with Moreau's steps where it cannot go on.
    fn handover<'a>(
        &'a self,
        tran: &'a Tran,
        lcs: &Lcs,
        settings: &'a Settings,
    ) -> Result<Handover<'a>, SimError> {
        // An error control would follow every switching of a chattering circuit.
        let step = tran.tstep / HANDOVER_STEPS;
        let stepping = Stepping::Fixed(step);
        Ok(Handover::new(
            self.exact(tran, lcs, settings)?,
            Box::new(move |place| {
                self.stepper(place.clone(), tran, Scheme::MOREAU, stepping, settings)
            }),
            step,
            tran.tstep,
        ))
    }
}

/// Steps chosen by their error.
fn controlled(tran: &Tran) -> Stepping {
    Stepping::Controlled {
        span: tran.tstop,
        first: tran.tstep / 64.0,
    }
}

fn drive(problem: Problem<'_>, tran: Tran, options: SimOptions<'_>) -> Result<Run, SimError> {
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
    mut problem: Problem<'_>,
    tran: Tran,
    options: SimOptions<'_>,
    elsewhere: Rc<Cell<f64>>,
) -> Result<Run, SimError> {
    check(&tran, &options)?;
    let mut lcs = problem.choose_roles(&tran)?;
    if problem.settle_switches(&tran, &options.settings)? {
        lcs = problem.free(&problem.position)?;
    }
    let Plan {
        method,
        scheme,
        words,
    } = plan(&lcs, &options);
    if let (Method::Exact, Some(obstacle)) = (options.method, not_exact(&lcs)) {
        return Err(SimError::before(Reason::Unsupported(format!(
            "no exact integration: {obstacle}"
        ))));
    }
    let grid = Grid::of(&tran);
    let columns = lcs.outputs.names.len();
    let most =
        (!options.discard).then(|| options.settings.max_held / ((columns + 1) * size_of::<f64>()));
    grid.check(columns, most)?;
    let endless = problem
        .too_short(&tran, &options.settings)
        .or_else(|| problem.too_many_edges(&lcs, &tran, &options.settings));
    if let Some(error) = endless {
        return Err(error);
    }
    let frame = |method: Method, notes: Vec<String>| Frame {
        title: lcs.title.clone(),
        names: lcs.outputs.names.clone(),
        units: lcs.outputs.units.clone(),
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
        let mut exact = problem.exact(&tran, &lcs, settings)?;
        let frame = frame(method, notes);
        return run(&mut exact, Frame { progress, ..frame }, log);
    }
    if method == Method::Exact {
        let frame = Frame {
            progress: progress.as_mut().map(|p| &mut **p as &mut dyn FnMut(f64)),
            ..frame(method, notes.clone())
        };
        let handover = problem.handover(&tran, &lcs, settings);
        match handover.and_then(|mut both| attempt(&mut both, frame, &mut log, false)) {
            Ok(run) => return Ok(run),
            Err(error) if is_final(&error) => return Err(error),
            Err(error) => notes.push(match log.again() {
                None => format!(
                    "exact integration ended, and the whole run was made in steps instead: {error}"
                ),
                Some(t) => format!(
                    "exact integration ended, and the whole run was made in steps instead; rows until {t:e} s are exact: {error}"
                ),
            }),
        }
        method = Method::Theta;
    }
    let stepping = options.step.map_or(controlled(&tran), Stepping::Fixed);
    let mut theta = problem.stepper(problem.start(), &tran, scheme, stepping, settings)?;
    if options.step.is_none()
        && let Some(amplitudes) = problem.scout(&tran, settings)
    {
        theta.expect_amplitudes(amplitudes);
    }
    theta.estimate_errors();
    let frame = frame(method, notes);
    run(&mut theta, Frame { progress, ..frame }, log)
}

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
