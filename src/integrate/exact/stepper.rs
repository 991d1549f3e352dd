//! The event-driven stepper: travel in a mode, find the next one, repeat.

use std::collections::BTreeMap;

use nalgebra::DVector;

use super::accumulation::Accumulation;
use super::ahead::Ahead;
use super::assembler::{Assembler, Step};
use super::clock::Clock;
use super::exosystem::Exosystem;
use super::inspect::{Inspector, resolution};
use super::metric::Metric;
use super::mode::{Key, Owner};
use super::motion::{Arrival, Motion};
use super::plant::Plant;
use super::report::{MOST_LOSS, Slides};
use super::transition::{PATIENCE, PROPOSALS, Trigger};
use crate::circuit::Source;
use crate::integrate::Note;
use crate::integrate::energy::Balance;
use crate::integrate::run::{Log, Outcome, Reason, SimError, Stepper, Times};
use crate::integrate::switching::fire;
use crate::settings::Settings;

/// Times closer than this many units in the last place are one time.
pub(super) const SAME_TIME_ULPS: f64 = 4.0;

/// Steps after which a run asks whether it may go on.
const REST: u64 = 1 << 12;

/// What a run of the exact integrator starts from.
pub struct Setup {
    /// The circuit.
    pub assembler: Assembler,
    /// Positions of the switches at the start.
    pub position: Vec<bool>,
    /// Start, s.
    pub t: f64,
    /// End, s.
    pub until: f64,
    /// Storage vector s⁻ before the start.
    pub start: DVector<f64>,
    /// Distance of output times, s.
    pub h: f64,
    /// Whether to integrate the energy balance.
    pub energy: bool,
    /// Whether sources may be given other values on the way.
    pub free: bool,
    /// Tolerances.
    pub settings: Settings,
}

/// See the [module](super).
pub struct Exact {
    pub(super) plant: Plant,
    pub(super) sources: Vec<Source>,
    pub(super) exosystem: Exosystem,
    pub(super) motion: Motion,
    pub(super) inspector: Inspector,
    pub(super) mode: Option<usize>,
    pub(super) key: Key,
    /// Storage vector before the start or at the last change.
    pub(super) storage: Vec<f64>,
    /// Largest values of the storage elements so far, levelled by kind.
    pub(super) scale: Vec<f64>,
    /// ½ sᵀ M s of these, J.
    pub(super) capacity: f64,
    /// How large w and the storage can have been since the last event.
    reach: Vec<f64>,
    largest: Vec<f64>,
    pub(super) volts: Vec<bool>,
    /// By storage element: its name, and the unit of its state.
    pub(super) elements: Vec<String>,
    pub(super) units: Vec<&'static str>,
    /// Where the switches would stand after a change that failed.
    pub(super) wanted: Option<Vec<bool>>,
    /// z at the last change or breakpoint.
    pub(super) z: Vec<f64>,
    /// u before a jump: at the end of the mode that is left, or before the start.
    pub(super) before: DVector<f64>,
    /// [`PROPOSALS`], the latest successful first.
    pub(super) proposals: [f64; PROPOSALS.len()],
    /// Modes left at the present instant.
    pub(super) left_here: Vec<usize>,
    pub(super) metric: Metric,
    /// From start to end, s.
    pub(super) duration: f64,
    pub(super) until: f64,
    pub(super) ahead: Ahead,
    pub(super) started: bool,
    /// When the next piece of a source ends, s.
    next_piece: f64,
    /// The next time at which something is known to happen, s.
    next_stop: f64,
    /// A piece ended when the mode was last left.
    pub(super) corner: bool,
    pub(super) settings: Settings,
    pub(super) energy: bool,
    pub(super) balance: Balance,
    pub(super) events: u64,
    pub(super) jumps: u64,
    pub(super) lcp_solves: u64,
    pub(super) notes: Vec<Note>,
    pub(super) accumulation: Accumulation,
    pub(super) noted_shared: bool,
    /// Whether a jump between rivals has been noted.
    pub(super) noted_rivals: bool,
    /// By switch, then by step of a function block: when it slid.
    pub(super) slides: BTreeMap<usize, Slides>,
    pub(super) row: Vec<f64>,
    /// By probe: a voltage.
    pub(super) row_is_volts: Vec<bool>,
}

impl Exact {
    /// A stepper at its start, before the jump at t = 0+.
    ///
    /// # Errors
    /// The reduction's for the start position; sources that no finite linear system generates.
    pub fn new(setup: Setup) -> Result<Self, SimError> {
        let Setup {
            assembler,
            mut position,
            t,
            until,
            start,
            h,
            energy,
            free,
            settings,
        } = setup;
        let mut plant = Plant::new(assembler, h, energy, settings.lcp_residual);
        let mut key = Key {
            closed: vec![false; plant.pairs],
            switches: position.clone(),
            sliding: Vec::new(),
        };
        let lcs = plant.free(&key)?.lcs.clone();
        let sources: Vec<Source> = lcs.inputs.iter().map(|i| i.source.clone()).collect();
        let unsupported = || {
            SimError::before(Reason::Unsupported(
                "a source has no closed form as a linear system".to_string(),
            ))
        };
        let (silent, controls) = plant.controls();
        let before = sources.iter().zip(&silent);
        let before = before.map(|(s, silent)| if *silent { 0.0 } else { s.value_left(t) });
        let before = DVector::from_iterator(sources.len(), before);
        let exosystem =
            Exosystem::of(&sources, silent, (t, until), free).ok_or_else(unsupported)?;
        plant.clocks = controls
            .into_iter()
            .map(|control| Clock::new(control, &sources, t))
            .collect::<Option<_>>()
            .ok_or_else(unsupported)?;
        let mut z = vec![0.0; exosystem.dim()];
        exosystem.write(t, &mut z);
        for clock in &plant.clocks {
            let i = clock.switch;
            position[i] ^= clock.leaves(&plant.thresholds[i], position[i], t);
        }
        fire(&plant.thresholds, &mut position);
        key.switches = position;
        let volts = lcs.storage.units.iter().map(|unit| *unit == "V").collect();
        let (elements, units) = (lcs.storage.elements.clone(), lcs.storage.units.clone());
        let metric = Metric::new(&lcs.storage.metric);
        let stored = metric.stored(start.as_slice());
        let columns = lcs.outputs.names.len();
        let mut exact = Self {
            plant,
            sources,
            exosystem,
            motion: Motion::at(t),
            inspector: Inspector::default(),
            mode: None,
            key,
            storage: start.as_slice().to_vec(),
            scale: vec![0.0; start.len()],
            capacity: 0.0,
            reach: vec![],
            largest: vec![],
            volts,
            elements,
            units,
            wanted: None,
            z,
            before,
            proposals: PROPOSALS,
            left_here: Vec::new(),
            metric,
            duration: until - t,
            until,
            ahead: Ahead::default(),
            started: false,
            next_piece: f64::NEG_INFINITY,
            next_stop: f64::NEG_INFINITY,
            corner: false,
            settings,
            energy,
            balance: Balance::new(stored),
            events: 0,
            jumps: 0,
            lcp_solves: 0,
            notes: Vec::new(),
            accumulation: Accumulation::new(t),
            noted_shared: false,
            noted_rivals: false,
            slides: BTreeMap::new(),
            row: vec![0.0; columns],
            row_is_volts: lcs.outputs.units.iter().map(|u| *u == "V").collect(),
        };
        exact.rescale();
        Ok(exact)
    }

    /// Tells which pairs conducted before the start: of several modes that hold, the first one tried.
    pub fn expect(&mut self, conducting: &[bool]) {
        if !conducting.is_empty() {
            self.key.closed.copy_from_slice(conducting);
        }
    }

    /// Raises the amplitudes to the present storage; elements of one kind share the largest.
    pub(super) fn rescale(&mut self) {
        let mut largest = [0.0_f64; 2];
        for ((&volts, s), &scale) in self.volts.iter().zip(&self.storage).zip(&self.scale) {
            let largest = &mut largest[usize::from(volts)];
            *largest = largest.max(s.abs()).max(scale);
        }
        for (&volts, scale) in self.volts.iter().zip(&mut self.scale) {
            *scale = largest[usize::from(volts)];
        }
        self.capacity = self.metric.stored(&self.scale);
    }

    fn ulps(&self) -> f64 {
        SAME_TIME_ULPS * f64::EPSILON * self.motion.t.abs()
    }

    pub(super) fn fail(&self, reason: Reason) -> SimError {
        SimError::at(self.motion.t, reason)
    }

    /// u at the current time on the current pieces.
    pub(super) fn inputs(&self, t: f64) -> DVector<f64> {
        let mut z = DVector::zeros(self.exosystem.dim());
        self.exosystem.write(t, z.as_mut_slice());
        self.exosystem.output() * z
    }

    /// u at the end of mode `at`.
    pub(super) fn inputs_at_end_of(&self, at: usize) -> DVector<f64> {
        let n = self.plant.modes[at].n;
        let z = &self.motion.now[n..n + self.exosystem.dim()];
        self.exosystem.output() * DVector::from_column_slice(z)
    }

    /// Reads the storage vector at the current state.
    pub(super) fn take_storage(&mut self) {
        if let Some(at) = self.mode {
            let mode = &mut self.plant.modes[at];
            let [source, dissipated] = self.motion.take_energy(&mut mode.flow);
            self.balance.add((source, dissipated));
            mode.storage_at(&self.motion.now, &mut self.storage);
            // An event often finds a current at zero: its size is what it was on the way.
            self.motion.reach(&mut self.reach);
            mode.storage.largest(&self.reach, &mut self.largest);
            for (scale, largest) in self.scale.iter_mut().zip(&self.largest) {
                *scale = scale.max(*largest);
            }
            self.rescale();
            self.note_stored();
        }
    }

    /// Reads how fast the storage moves, unless the mode was entered at this very instant: it then came here before.
    fn take_pace(&mut self) {
        if let Some(at) = self.mode
            && self.motion.age > resolution(self.motion.t)
        {
            let mode = &self.plant.modes[at];
            self.inspector.note_pace(mode, &self.motion.now);
        }
    }

    /// Notes the stored energy.
    pub(super) fn note_stored(&mut self) {
        if self.energy {
            self.balance.note(self.metric.stored(&self.storage));
        }
    }

    /// Something happens now: a guard fell through zero, sources reach breakpoints, switches that sources drive move. All that
    /// happens at one instant is taken together before a mode is looked for.
    fn instant(&mut self, fired: Option<usize>, log: &mut Log) -> Result<(), SimError> {
        let t = self.motion.t;
        let near = t + self.ulps();
        if let (Some(at), Some(guard)) = (self.mode, fired) {
            self.leave_here(at, guard)?;
        } else {
            self.left_here.clear();
        }
        self.take_storage();
        self.take_pace();
        let known = self.next_stop <= near;
        self.inspector.forget_slips();
        self.corner = self.next_piece <= near;
        let mut discontinuous = self.corner && self.take_pieces(near)?;
        self.exosystem.write(t, &mut self.z);
        let mut key = std::mem::take(&mut self.key);
        if known {
            discontinuous |= self.move_clocked(&mut key, near);
        }
        if discontinuous {
            key.sliding.clear();
        }
        discontinuous |= self.move_guarded(&mut key, fired, self.corner);
        fire(&self.plant.thresholds, &mut key.switches);
        let trigger = fired.map_or(Trigger::Sources, Trigger::Guard);
        self.change(key, discontinuous, trigger, log)
    }

    /// Takes note that mode `at` is left by a guard. One that is left at the instant at which it was entered was found by rounding:
    /// after [`PATIENCE`] of them none is entered again at this instant, and an instant without end is an internal error.
    fn leave_here(&mut self, at: usize, guard: usize) -> Result<(), SimError> {
        if self.motion.age > f64::EPSILON * self.plant.modes[at].flow.shortest() {
            self.left_here.clear();
        }
        self.left_here.push(at);
        if self.left_here.len() > PATIENCE + 2 * (self.plant.pairs + self.plant.thresholds.len()) {
            let what = "modes are left at the instant at which they were entered, without end";
            let reason = Reason::internal("integrate::exact", what);
            return Err(self.fail(reason).device(self.owner_name(at, guard)));
        }
        Ok(())
    }

    /// Moves the switches that sources alone control and that are due before `near`; whether one moved.
    pub(super) fn move_clocked(&self, key: &mut Key, near: f64) -> bool {
        let mut moved = false;
        for clock in &self.plant.clocks {
            if clock.next <= near {
                key.switches[clock.switch] = !key.switches[clock.switch];
                moved = true;
            }
        }
        moved
    }

    /// Moves the switches whose guards end the mode now: the one that `fired` and all that pass their thresholds with it, in the
    /// present mode with the sources as they go on after a `corner`. Whether one moved.
    pub(super) fn move_guarded(
        &mut self,
        key: &mut Key,
        fired: Option<usize>,
        corner: bool,
    ) -> bool {
        let Some(at) = self.mode else { return false };
        let mut moved = false;
        let owner = fired.map(|guard| self.plant.modes[at].owner(guard));
        if let Some(guard) = fired {
            self.note_slip(at, guard);
        }
        match owner {
            // A thyristor's current ends, and no gate holds it.
            Some(Owner::Device(pair)) => {
                for i in self.plant.released(pair, &key.switches) {
                    key.switches[i] = false;
                }
            }
            Some(Owner::Switch(i)) if !corner => {
                key.switches[i] = !key.switches[i];
                moved = true;
            }
            Some(Owner::Slide(i, on)) => {
                key.sliding.retain(|s| s.0 != i);
                key.switches[i] = on;
                moved = true;
            }
            Some(Owner::Switch(_)) | None => {}
        }
        let mode = &self.plant.modes[at];
        let first = mode.device_guards.len();
        let may_pass = |k: usize| {
            let decided = !corner && fired == Some(first + k);
            let sources_turn = corner && mode.controlled_by_sources[k];
            !decided && (sources_turn || self.motion.is_at_zero(&mode.flow, first + k))
        };
        let candidates: Vec<usize> = (0..mode.guarded_switches.len())
            .filter(|&k| may_pass(k))
            .collect();
        if !candidates.is_empty() {
            let now = &self.motion.now[..mode.n];
            self.inspector.look(mode, now, &self.z);
            for k in candidates {
                let mode = &self.plant.modes[at];
                if self.inspector.leaves(mode, first + k, self.motion.t) {
                    let i = mode.guarded_switches[k];
                    key.switches[i] = !key.switches[i];
                    moved = true;
                    self.note_slip(at, first + k);
                }
            }
        }
        moved
    }

    /// Notes that a guard of mode `at` passes zero now, where its quantity goes on in the next mode: the control of a switch, the input of
    /// a function block on a step. Of a diode's current and voltage one begins where the other ends.
    fn note_slip(&mut self, at: usize, guard: usize) {
        let mode = &self.plant.modes[at];
        let slope = self.motion.now[mode.flow.dim() + mode.flow.guards() + guard];
        let t = self.motion.t;
        match mode.owner(guard) {
            owner @ Owner::Switch(_) => self.inspector.note_slip(owner, t, slope),
            Owner::Device(pair) => {
                let step = |step: &&Step| pair == step.pair || pair == step.pair + 1;
                if let Some(step) = self.plant.steps().iter().find(step) {
                    for pair in [step.pair, step.pair + 1] {
                        self.inspector.note_slip(Owner::Device(pair), t, slope);
                    }
                }
            }
            Owner::Slide(..) => {}
        }
    }

    /// Sources whose pieces end go on along the next ones; returns whether one of them jumps.
    fn take_pieces(&mut self, near: f64) -> Result<bool, SimError> {
        let mut edge = false;
        for i in 0..self.sources.len() {
            let old = self.exosystem.piece(i);
            let end = old.end;
            if end <= near {
                let last = old.value(end);
                let Some(piece) = self.sources[i].piece(end.max(self.motion.t)) else {
                    return Err(
                        self.fail(Reason::Unsupported("a source lost its closed form".into()))
                    );
                };
                edge |= last != piece.value(end);
                self.exosystem.set_piece(i, piece);
            }
        }
        Ok(edge)
    }

    /// When the driven switches move next on the present pieces, and what is known to happen first.
    pub(super) fn look_ahead(&mut self) {
        let end = self.exosystem.next_breakpoint();
        (self.next_piece, self.next_stop) = (end, end);
        for clock in &mut self.plant.clocks {
            let i = clock.switch;
            let (threshold, on) = (&self.plant.thresholds[i], self.key.switches[i]);
            clock.look_ahead(threshold, on, (self.motion.t, self.until), &self.sources);
            self.next_stop = self.next_stop.min(clock.next);
        }
    }

    pub(super) fn read_row(&mut self) {
        if let Some(at) = self.mode {
            let mode = &self.plant.modes[at];
            mode.outputs.apply(&self.motion.now, &mut self.row);
        }
    }

    pub(super) fn start(&mut self, log: &mut Log) -> Result<(), SimError> {
        self.exosystem.write(self.motion.t, &mut self.z);
        let key = std::mem::take(&mut self.key);
        self.change(key, true, Trigger::Sources, log)?;
        self.started = true;
        Ok(())
    }
}

impl Stepper for Exact {
    fn time(&self) -> f64 {
        if self.ahead.leads() {
            self.ahead.t
        } else {
            self.motion.t
        }
    }

    fn advance(&mut self, t: f64, log: &mut Log) -> Result<(), SimError> {
        if !self.started {
            self.start(log)?;
        }
        if self.has_row(t) {
            return Ok(());
        }
        loop {
            let next = self.next_stop;
            let due = next <= t + SAME_TIME_ULPS * f64::EPSILON * t.abs();
            let stop = if due { next.min(t) } else { t };
            let Some(at) = self.mode else {
                return Err(self.fail(Reason::internal("integrate::exact", "a run in no mode")));
            };
            let flow = &self.plant.modes[at].flow;
            if flow.loss > MOST_LOSS && flow.guards() > 0 {
                return Err(self.fail(Reason::NotGraded { loss: flow.loss }));
            }
            if (!due && t <= self.motion.t) || self.step_ahead(at, t, next) {
                return Ok(());
            }
            let (from, rest) = (self.motion.t, self.motion.steps + REST);
            self.motion.most = self.settings.max_steps.min(rest);
            match self
                .motion
                .travel(&mut self.plant.modes[at].flow, &self.exosystem, stop)
            {
                Arrival::Reached if due => self.instant(None, log)?,
                Arrival::Reached => return Ok(()),
                Arrival::Fired(guard) => {
                    self.instant(Some(guard), log)?;
                    let (t, h) = (self.motion.t, self.plant.output_step());
                    if let Some((events, span)) = self.accumulation.burst(t, h) {
                        let error = self.fail(Reason::EventsAccumulate { events, span });
                        return Err(error.device(self.owner_name(at, guard)));
                    }
                }
                Arrival::Overflow => return Err(self.fail(Reason::Overflow)),
                // A guard that rounding keeps near zero allows only steps of the fastest time constant, hidden from the output.
                Arrival::Resting => {
                    let (span, runs) = (self.motion.t - from, self.settings.max_steps / REST);
                    if self.motion.steps > rest && span * (runs as f64) < self.plant.output_step() {
                        return Err(self.fail(Reason::NoProgress { steps: REST, span }));
                    }
                }
            }
            log.go_on(self.motion.t)?;
            if log.pauses() {
                return Ok(());
            }
            if self.motion.steps > self.settings.max_steps {
                return Err(self.fail(Reason::TooManySteps {
                    limit: self.settings.max_steps,
                }));
            }
        }
    }

    fn read(&mut self, row: &mut [f64]) {
        if let Some(values) = self.ahead.row(row.len()) {
            row.copy_from_slice(values);
        } else if let Some(at) = self.mode {
            self.plant.modes[at].outputs.apply(&self.motion.now, row);
        }
    }

    fn rows_ahead(&mut self, times: &Times, k: usize) -> &[f64] {
        self.take_rows(times, k)
    }

    fn finish(&mut self) -> Outcome {
        self.end_ahead();
        self.take_storage();
        self.note_end();
        let mut outcome = Outcome {
            notes: std::mem::take(&mut self.notes),
            ..Outcome::default()
        };
        outcome.stats.steps = self.motion.steps;
        outcome.stats.events = self.events;
        outcome.stats.jumps = self.jumps;
        outcome.stats.modes = self.plant.modes.len() as u64;
        outcome.stats.lcp_solves = self.lcp_solves;
        outcome.stats.factorisations = self.plant.factorisations();
        outcome.energy = self.balance.energy();
        outcome
    }
}
