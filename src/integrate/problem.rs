//! What the steppers share of a circuit, or of a system: its systems by switch position, its start, and what is chosen from them.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::DVector;

use crate::circuit::{self, Circuit, ElementId, Source, Tran};
use crate::integrate::Note;
use crate::integrate::control::Amplitudes;
use crate::integrate::error::{Error, Reason};
use crate::integrate::exact::{self, Exact, Place};
use crate::integrate::handover::Handover;
use crate::integrate::inputs::Inputs;
use crate::integrate::line::Line;
use crate::integrate::log::Log;
use crate::integrate::run::Stepper;
use crate::integrate::step::Scheme;
use crate::integrate::switching::{Threshold, at_start};
use crate::integrate::theta::{Setup, Start, Stepping, Theta};
use crate::integrate::{reading, roles, start};
use crate::lcs::{Input, Lcs, Position, reduce};
use crate::mna::{StandardMultiport, StaticMultiport, SwitchPort};
use crate::settings::Settings;
use crate::settings::tolerances::steps::SCOUT_STEPS;

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

/// The systems of a circuit by switch position, all devices free, each reduced once.
#[derive(Debug, Clone)]
pub(super) struct Systems {
    /// All laws as ideal pairs.
    pub(super) multiport: Arc<StandardMultiport>,
    known: Arc<Mutex<Known>>,
    /// Those of modes too.
    pub(super) reduced: Arc<exact::Reduced>,
}

#[derive(Debug, Default)]
struct Known {
    systems: Vec<(Vec<bool>, Lcs)>,
    /// Waveforms that were given to inputs in place of their own.
    replaced: Vec<(usize, Source)>,
}

impl Known {
    /// With the sources as they are now.
    fn adapted(&self, lcs: &Lcs) -> Lcs {
        lcs.with_sources(&self.replaced)
    }
}

impl Systems {
    pub(super) fn of(multiport: StandardMultiport) -> Self {
        Self {
            multiport: Arc::new(multiport),
            known: Arc::default(),
            reduced: Arc::default(),
        }
    }

    /// The system of a position.
    pub(super) fn free(&self, switches: &[bool]) -> Result<Lcs, Error> {
        let mut known = self.known();
        let found = known.systems.iter().find(|(p, _)| p == switches);
        if let Some((_, lcs)) = found {
            return Ok(known.adapted(lcs));
        }
        let position = Position::free(&self.multiport, switches.to_vec());
        let lcs = reduce(&self.multiport, &position).map_err(|e| Error::before(e.into()))?;
        let adapted = known.adapted(&lcs);
        self.reduced.keep(position, &lcs);
        known.systems.push((switches.to_vec(), lcs));
        Ok(adapted)
    }

    /// An input has another waveform in every system asked for from now on.
    pub(super) fn replace_source(&self, input: usize, source: Source) {
        let mut known = self.known();
        known.replaced.retain(|(other, _)| *other != input);
        known.replaced.push((input, source));
    }

    /// Just these inputs have other waveforms than their own in every system asked for from now on.
    pub(super) fn replace_sources(&self, sources: Vec<(usize, Source)>) {
        self.known().replaced = sources;
    }

    /// The inputs with other waveforms than their own.
    pub(super) fn replaced(&self) -> Vec<(usize, Source)> {
        self.known().replaced.clone()
    }

    fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What the steppers share.
#[derive(Debug, Clone)]
pub(super) struct Problem {
    pub(super) systems: Systems,
    /// Where function blocks jump.
    pub(super) steps: Vec<exact::Step>,
    /// Transmission lines.
    pub(super) lines: Vec<Line>,
    /// Where it starts.
    pub(super) start: Place,
    /// See [`start::Initial::conducting`]; empty where not known.
    pub(super) conducting: Vec<bool>,
    /// See [`start::Initial::at_rest`].
    pub(super) at_rest: Option<Vec<(f64, f64)>>,
    /// Switches whose start position follows from the start state.
    pub(super) settle: Vec<bool>,
    pub(super) notes: Vec<Note>,
    /// Whether sources may be given other values on the way.
    pub(super) free_sources: bool,
    /// The start is a right limit: edges of sources there have acted.
    pub(super) after_edges: bool,
    /// Comparators that were made to sources of edges.
    pub(super) known_comparators: usize,
    /// Rows are asked for at corners of the sources that are recorded.
    pub(super) rows_at_corners: bool,
    /// The exact integration keeps the energy balance.
    pub(super) balanced: bool,
}

/// The scout gives up after this many steps (trains of many pulses); what it has seen by then is used.
const SCOUT_LIMIT: u64 = 4096;

impl Problem {
    /// The transient of a circuit, from its initial conditions if `uic`, else from its operating point.
    pub(super) fn of_circuit(
        circuit: &Circuit,
        behaviour: &StaticMultiport,
        uic: bool,
        settings: &Settings,
    ) -> Result<Self, Error> {
        let standard = behaviour.standard();
        let initial = start::initial(circuit, &standard, uic, settings)?;
        let of_circuit = behaviour.notes.iter();
        let of_circuit = of_circuit.map(|note| Note::run(note.code, note.message.clone()));
        let mut notes: Vec<Note> = of_circuit.collect();
        notes.extend(initial.notes);
        let switches = standard.switches.iter();
        Ok(Self {
            lines: lines(circuit, &initial.waves),
            start: Place {
                t: 0.0,
                storage: initial.storage,
                switches: initial.switches,
            },
            conducting: initial.conducting,
            at_rest: initial.at_rest,
            settle: switches.map(|s| uic && s.initial.is_none()).collect(),
            notes,
            steps: exact::steps_of(behaviour),
            systems: Systems::of(standard),
            free_sources: false,
            after_edges: false,
            known_comparators: 0,
            rows_at_corners: true,
            balanced: true,
        })
    }

    /// The transient of a system from state x.
    pub(super) fn of_system(lcs: &Lcs, x: &DVector<f64>) -> Self {
        let original = StaticMultiport::from_lcs(lcs);
        let behaviour = original.standard();
        let mut storage = DVector::zeros(behaviour.storage.len());
        storage.rows_mut(0, x.len()).copy_from(x);
        let mut notes = vec![Note::run(
            "not-balanced",
            "a system without a circuit has no powers to balance: the energies are not computed",
        )];
        let held = lcs.held_switches();
        if !held.is_empty() {
            let text =
                format!("switches stay as they are, as a system has one position of them: {held}");
            notes.push(Note::run("switches-stay", text));
        }
        Self {
            lines: vec![],
            start: Place {
                t: 0.0,
                storage,
                switches: vec![],
            },
            conducting: vec![],
            at_rest: None,
            settle: vec![],
            notes,
            steps: exact::steps_of(&original),
            systems: Systems::of(behaviour),
            free_sources: false,
            after_edges: false,
            known_comparators: 0,
            rows_at_corners: true,
            balanced: true,
        }
    }

    /// The same with sources that may be given other values on the way.
    pub(super) fn with_free_sources(self) -> Self {
        Self {
            free_sources: true,
            at_rest: None,
            ..self
        }
    }

    /// The same without an energy balance.
    pub(super) fn unbalanced(self) -> Self {
        Self {
            balanced: false,
            ..self
        }
    }

    /// The same with the systems of a simulation of this circuit, of which some are known.
    pub(super) fn sharing(self, other: &Self) -> Self {
        Self {
            systems: other.systems.clone(),
            ..self
        }
    }

    /// The same circuit from another place on; `conducting` as in [`start::Initial`].
    pub(super) fn standing_at(self, start: Place, conducting: Vec<bool>) -> Self {
        Self {
            settle: vec![false; start.switches.len()],
            start,
            conducting,
            at_rest: None,
            after_edges: true,
            ..self
        }
    }

    /// Whether it has transmission lines.
    pub(super) fn has_lines(&self) -> bool {
        !self.lines.is_empty()
    }

    /// Chooses what is a state and settles the switches; returns the system of the start position.
    pub(super) fn prepare(&mut self, tran: &Tran, settings: &Settings) -> Result<Lcs, Error> {
        let lcs = self.choose_roles(tran)?;
        if self.settle_switches(tran, settings)? {
            return self.systems.free(&self.start.switches);
        }
        Ok(lcs)
    }

    /// Storage elements and ideal pairs.
    pub(super) fn size(&self) -> (usize, usize) {
        let multiport = &self.systems.multiport;
        (multiport.storage.len(), multiport.pairs.len())
    }

    fn switches(&self) -> &[SwitchPort] {
        &self.systems.multiport.switches
    }

    fn thresholds(&self) -> Vec<Threshold> {
        self.switches().iter().map(Threshold::of).collect()
    }

    /// `lcs` is the system of the start position.
    pub(super) fn exact(
        &self,
        tran: &Tran,
        lcs: &Lcs,
        settings: &Settings,
    ) -> Result<Exact, Error> {
        let mut exact = Exact::new(exact::Setup {
            assembler: exact::Assembler::new(Arc::clone(&self.systems.multiport))
                .with_steps(self.steps.clone())
                .sharing(&self.systems.reduced)
                .knowing(&self.start.switches, lcs),
            position: self.start.switches.clone(),
            inputs: lcs.inputs.iter().map(|i| i.source.clone()).collect(),
            t: self.start.t,
            until: tran.tstop,
            start: self.start.storage.clone(),
            h: tran.tstep,
            energy: self.balanced,
            free: self.free_sources,
            settings: settings.clone(),
        })?;
        exact.expect(&self.conducting);
        if self.after_edges {
            exact.start_after_edges();
        }
        Ok(exact)
    }

    pub(super) fn stepper(
        &self,
        place: Place,
        tran: &Tran,
        scheme: Scheme,
        stepping: Stepping,
        settings: &Settings,
    ) -> Result<Theta, Error> {
        let systems = self.systems.clone();
        let at_rest = self.at_rest.clone().filter(|_| place == self.start);
        let mut theta = Theta::new(Setup {
            reduce: Box::new(move |position| systems.free(position)),
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
        if !self.free_sources {
            let multiport = &self.systems.multiport;
            let silent = if self.rows_at_corners {
                multiport.source_controls().0
            } else {
                multiport.acting_by_switches()
            };
            theta.pass_silent_corners(&silent);
        }
        theta.expect(&self.conducting);
        if let Some(points) = at_rest {
            theta.begin_at_rest(points);
        }
        Ok(theta)
    }

    /// See [`roles`]; returns the system of the start position.
    fn choose_roles(&mut self, tran: &Tran) -> Result<Lcs, Error> {
        let lcs = self.systems.free(&self.start.switches)?;
        if roles::doubtful(&lcs, tran.tstop) {
            let others = Systems::of(self.systems.multiport.in_other_roles());
            if let Ok(other) = others.free(&self.start.switches)
                && roles::better(&lcs, &other)
            {
                self.systems = others;
                return Ok(other);
            }
        }
        Ok(lcs)
    }

    /// Positions of switches without `ON`/`OFF` that agree with their controls at the start state; whether one moved.
    fn settle_switches(&mut self, tran: &Tran, settings: &Settings) -> Result<bool, Error> {
        let mut seen = Vec::new();
        while self.settle.contains(&true) {
            let lcs = self.systems.free(&self.start.switches)?;
            let controls =
                match reading::of_sources(&lcs.controls, &Inputs::new(&lcs.inputs).all(0.0)) {
                    Some(controls) => controls,
                    None => {
                        let stepping = Stepping::Fixed(tran.tstep);
                        self.stepper(self.start.clone(), tran, Scheme::MOREAU, stepping, settings)?
                            .controls_at_start()?
                    }
                };
            let asked: Vec<bool> = (0..controls.len())
                .map(|k| {
                    let switch = &self.switches()[k];
                    let on = self.start.switches[k];
                    if self.settle[k] {
                        Threshold::of(switch).position(on, controls[k])
                    } else {
                        on
                    }
                })
                .collect();
            let wanted = at_start(self.switches(), asked);
            // Positions that contradict each other are left to the run.
            if wanted == self.start.switches || seen.contains(&wanted) {
                break;
            }
            let next = self.step_towards(wanted, &seen);
            seen.push(std::mem::replace(&mut self.start.switches, next));
        }
        Ok(!seen.is_empty())
    }

    /// `wanted`, or where shorts and open branches contradict each other in it the first position on the way, one switch further,
    /// that is a circuit and not `seen`: what that switch drives may ask for another position.
    fn step_towards(&self, wanted: Vec<bool>, seen: &[Vec<bool>]) -> Vec<bool> {
        if self.systems.free(&wanted).is_ok() {
            return wanted;
        }
        let moving = (0..wanted.len()).filter(|&k| wanted[k] != self.start.switches[k]);
        let positions = moving.map(|k| {
            let mut position = self.start.switches.clone();
            position[k] = wanted[k];
            at_start(self.switches(), position)
        });
        let mut sound = positions.filter(|p| !seen.contains(p) && self.systems.free(p).is_ok());
        sound.next().unwrap_or(wanted)
    }

    /// The error of a line whose delay asks for more steps than a run may take.
    pub(super) fn too_short(&self, tran: &Tran, settings: &Settings) -> Option<Error> {
        let limit = settings.max_steps;
        let asks = |line: &&Line| tran.tstop / line.longest_step() > limit as f64;
        let line = self.lines.iter().find(asks)?;
        let what = format!(
            "a delay of {:e} s asks for more than {limit} steps until {:e} s; a resistor or a short may take the line's place",
            line.delay, tran.tstop
        );
        Some(Error::before(Reason::Unsupported(what)).device(line.sources[0].clone()))
    }

    /// Amplitudes from a coarse run.
    pub(super) fn scout(&self, tran: &Tran, settings: &Settings) -> Option<Amplitudes> {
        let settings = Settings {
            max_steps: SCOUT_LIMIT,
            ..settings.clone()
        };
        let stepping = Stepping::Fixed(tran.tstop / SCOUT_STEPS);
        let mut theta = self
            .stepper(
                self.start.clone(),
                tran,
                Scheme::MOREAU,
                stepping,
                &settings,
            )
            .ok()?;
        theta.scout();
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

/// The error of a source with more edges and kinks than a run may take steps.
pub(super) fn too_many_edges(inputs: &[Input], tran: &Tran, settings: &Settings) -> Option<Error> {
    let limit = settings.max_steps;
    let corners = |input: &Input| input.source.wave.corners(tran.tstop);
    let input = inputs.iter().find(|i| corners(i) > limit as f64)?;
    let what = format!(
        "it has {:.1e} edges and kinks until {:e} s, where a run may take {limit} steps",
        corners(input),
        tran.tstop
    );
    Some(Error::before(Reason::Unsupported(what)).device(input.name.clone()))
}

impl Problem {
    /// Exact integration with Moreau's steps where it cannot go on.
    pub(super) fn handover(
        &self,
        tran: &Tran,
        lcs: &Lcs,
        settings: &Settings,
        steps: f64,
    ) -> Result<Handover, Error> {
        // An error control would follow every switching of a chattering circuit.
        let step = tran.tstep / steps;
        let stepping = Stepping::Fixed(step);
        let (problem, span, settings_of_steps) = (self.clone(), *tran, settings.clone());
        Ok(Handover::new(
            self.exact(tran, lcs, settings)?,
            Box::new(move |place| {
                let place = place.clone();
                problem.stepper(place, &span, Scheme::MOREAU, stepping, &settings_of_steps)
            }),
            step,
            tran.tstep,
        ))
    }
}
