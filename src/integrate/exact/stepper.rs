//! The event-driven stepper: travel in a mode, find the next one, repeat.

mod pause;
mod periods;
mod sharing;

use std::sync::Arc;

use nalgebra::DVector;

use super::ahead::DenseOutput;
use super::assembler::{Assembler, Step};
use super::flow::longest_step;
use super::inspect::Inspector;
use super::key::{Key, Owner, Trigger};
use super::mode::Mode;
use super::passage::Passage;
use super::plant::ModeTable;
use super::report::{Report, row_jumps};
use super::rounding::resolution;
use super::sources::Sources;
use super::storage::Storage;
use super::transition::{Memory, PATIENCE, Transition};
use super::travel::{Arrival, Travel};
use crate::circuit::Source;
use crate::integrate::error::{Error, Reason};
use crate::integrate::grid::Times;
use crate::integrate::log::Log;
use crate::integrate::run::{Outcome, Stepper};
use crate::integrate::switching::fire;
use crate::settings::Settings;
use crate::settings::tolerances::exponentials::MOST_LOSS;
use crate::settings::tolerances::times::SAME_TIME;

pub(crate) use pause::Place;

/// Changes of mode that are kept for what the derivative of the flow or a measurement needs to know, at most.
pub(super) const MOST_PASSAGES: usize = 1_000_000;

/// Steps after which a run asks whether it may go on.
const REST: u64 = 1 << 12;

/// What a run of the exact integrator starts from.
pub struct Setup {
    /// The circuit.
    pub assembler: Assembler,
    /// Positions of the switches at the start.
    pub position: Vec<bool>,
    /// The waveforms of its inputs.
    pub inputs: Vec<Source>,
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
    table: ModeTable,
    sources: Sources,
    storage: Storage,
    travel: Travel,
    pub(super) dense: DenseOutput,
    inspector: Inspector,
    memory: Memory,
    report: Report,
    /// The mode, and its name or what it is to be.
    mode: Option<usize>,
    key: Key,
    /// Where the switches would stand after a change that failed.
    wanted: Option<Vec<bool>>,
    /// From start to end, s, and the end.
    duration: f64,
    until: f64,
    started: bool,
    /// A piece ended when the mode was last left.
    corner: bool,
    settings: Settings,
    row: Vec<f64>,
    /// By probe: a voltage.
    row_is_volts: Vec<bool>,
    /// Changes of mode, where they are asked for.
    passages: Option<Vec<Passage>>,
    /// What recurs period by period, where that may be taken together.
    periods: Option<periods::Periods>,
}

impl Exact {
    /// A stepper at its start, before the jump at t = 0+.
    ///
    /// # Errors
    /// The reduction's for the start position; sources that no finite linear system generates.
    pub fn new(setup: Setup) -> Result<Self, Error> {
        let Setup {
            assembler,
            position,
            inputs,
            t,
            until,
            start,
            h,
            energy,
            free,
            settings,
        } = setup;
        let mut table = ModeTable::new(assembler, h, energy, &settings);
        let mut key = Key {
            closed: vec![false; table.pairs],
            switches: position,
            sliding: Vec::new(),
        };
        let controls = table.controls();
        let lcs = &table.free(&key)?.lcs;
        let mut sources = Sources::new(inputs, controls, (t, until), free)?;
        let storage = Storage::new(lcs, start.as_slice(), energy);
        let row = vec![0.0; lcs.outputs.names.len()];
        let row_is_volts = lcs.outputs.units.iter().map(|u| *u == "V").collect();
        sources.position(&table.thresholds, &mut key.switches, t);
        fire(&table.thresholds, &mut key.switches);
        Ok(Self {
            table,
            sources,
            storage,
            travel: Travel::at(t),
            dense: DenseOutput::default(),
            inspector: Inspector::default(),
            memory: Memory::new(),
            report: Report::new(t),
            mode: None,
            key,
            wanted: None,
            duration: until - t,
            until,
            started: false,
            corner: false,
            settings,
            row,
            row_is_volts,
            passages: None,
            periods: None,
        })
    }

    /// Tells which pairs conducted before the start: of several modes that hold, the first one tried.
    pub fn expect(&mut self, conducting: &[bool]) {
        if !conducting.is_empty() {
            self.key.closed.copy_from_slice(conducting);
        }
    }

    /// Edges of the sources at the start have acted: the state is the one after them.
    pub(crate) fn start_after_edges(&mut self) {
        self.sources.before = self.sources.inputs(self.travel.t);
    }

    /// Steps so far.
    pub(crate) const fn steps(&self) -> u64 {
        self.travel.steps
    }

    fn ulps(&self) -> f64 {
        SAME_TIME * self.travel.t.abs()
    }

    #[cold]
    #[inline(never)]
    fn fail(&self, reason: Reason) -> Error {
        Error::at(self.travel.t, reason)
    }

    /// Reads the storage vector at the current state.
    fn take_storage(&mut self) {
        if let Some(at) = self.mode {
            self.storage
                .take(&mut self.table.modes[at], &mut self.travel);
        }
    }

    /// Reads how fast the storage moves, unless the mode was entered at this very instant: it then came here before.
    fn take_pace(&mut self) {
        if let Some(at) = self.mode
            && self.travel.age > resolution(self.travel.t)
        {
            let mode = &self.table.modes[at];
            self.inspector.note_pace(mode, &self.travel.now);
        }
    }

    /// Something happens now: a guard fell through zero, sources reach breakpoints, switches that sources drive move. All that
    /// happens at one instant is taken together before a mode is looked for.
    fn instant(&mut self, fired: Option<usize>, log: &mut Log) -> Result<(), Error> {
        let t = self.travel.t;
        let near = t + self.ulps();
        if let (Some(at), Some(guard)) = (self.mode, fired) {
            self.leave_here(at, guard)?;
        } else {
            self.memory.left_here.clear();
        }
        self.take_storage();
        self.take_pace();
        let (corner, known) = self.sources.due(near);
        self.inspector.forget_slips();
        self.corner = corner;
        let edge = corner && self.sources.take_pieces(t, near)?;
        let mut discontinuous = edge;
        self.sources.stand(t);
        let mut key = std::mem::take(&mut self.key);
        if known {
            discontinuous |= self.sources.move_clocked(&mut key, near);
        }
        if discontinuous {
            key.sliding.clear();
        }
        discontinuous |= self.move_guarded(&mut key, fired, (self.corner, edge));
        fire(&self.table.thresholds, &mut key.switches);
        let trigger = fired.map_or(Trigger::Sources, Trigger::Guard);
        self.change(key, discontinuous, trigger, log)
    }

    /// Takes note that mode `at` is left by a guard. One that is left at the instant at which it was entered was found by rounding:
    /// after [`PATIENCE`] of them none is entered again at this instant, and an instant without end is an internal error.
    fn leave_here(&mut self, at: usize, guard: usize) -> Result<(), Error> {
        if self.travel.age > f64::EPSILON * self.table.modes[at].flow.shortest() {
            self.memory.left_here.clear();
        }
        self.memory.left_here.push((at, guard));
        if self.memory.left_here.len()
            > PATIENCE + 2 * (self.table.pairs + self.table.thresholds.len())
        {
            let what = "modes are left at the instant at which they were entered, without end";
            let reason = Reason::internal("integrate::exact", what);
            return Err(self.fail(reason).device(self.table.owner_name(at, guard)));
        }
        Ok(())
    }

    /// Moves the switches whose guards end the mode now: the one that `fired` and all that pass their thresholds with it, in the
    /// present mode with the sources as they go on after a `corner`. Behind an `edge` the devices need not stand as they do in the present
    /// mode, and controls are asked when it is known how they do. Whether one moved.
    fn move_guarded(
        &mut self,
        key: &mut Key,
        fired: Option<usize>,
        (corner, edge): (bool, bool),
    ) -> bool {
        let Some(at) = self.mode else { return false };
        let mut moved = false;
        let owner = fired.map(|guard| self.table.modes[at].owner(guard));
        if let Some(guard) = fired {
            self.note_slip(at, guard);
        }
        match owner {
            // A thyristor's current ends, and no gate holds it.
            Some(Owner::Device(pair)) => {
                for i in self.table.released(pair, &key.switches) {
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
        let mode = &self.table.modes[at];
        let first = mode.device_guards.len();
        let may_pass = |k: usize| {
            let decided = !corner && fired == Some(first + k);
            let sources_turn = corner && !edge && mode.controlled_by_sources[k];
            !decided && (sources_turn || self.travel.is_at_zero(&mode.flow, first + k))
        };
        let candidates: Vec<usize> = (0..mode.guarded_switches.len())
            .filter(|&k| may_pass(k))
            .collect();
        if !candidates.is_empty() {
            let mode = &mut self.table.modes[at];
            let (t, now) = (self.travel.t, &self.travel.now[..mode.n]);
            self.inspector.look(mode, now, (t, &self.sources.z));
            for k in candidates {
                let mode = &self.table.modes[at];
                if self.inspector.leaves(mode, first + k, self.travel.t) {
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
        let mode = &self.table.modes[at];
        let slope = self.travel.now[mode.flow.dim() + mode.flow.guards() + guard];
        let t = self.travel.t;
        match mode.owner(guard) {
            owner @ Owner::Switch(_) => self.inspector.note_slip(owner, t, slope),
            Owner::Device(pair) => {
                let step = |step: &&Step| pair == step.pair || pair == step.pair + 1;
                if let Some(step) = self.table.steps().iter().find(step) {
                    for pair in [step.pair, step.pair + 1] {
                        self.inspector.note_slip(Owner::Device(pair), t, slope);
                    }
                }
            }
            Owner::Slide(..) => {}
        }
    }

    /// Tells the report how the devices stand in the present mode, but for the one that `fired`.
    fn look_back(&mut self, fired: Option<usize>) {
        let Some(at) = self.mode.filter(|_| self.started) else {
            return;
        };
        let mode = &self.table.modes[at];
        let guards = &self.travel.now[mode.flow.dim()..];
        let devices = mode.device_guards.iter().zip(guards).enumerate();
        let others = devices.filter(|(guard, _)| fired != Some(*guard));
        let sides = others.map(|(_, (&pair, g))| (pair, *g));
        let stored = || self.storage.amplitudes();
        self.report
            .note_hidden(&self.table, at, sides, stored, self.travel.t);
    }

    /// What a change of mode from here may look at and move.
    fn transition(&mut self) -> Transition<'_> {
        Transition {
            t: self.travel.t,
            mode: self.mode,
            key: &self.key,
            started: self.started,
            table: &mut self.table,
            sources: &mut self.sources,
            storage: &mut self.storage,
            inspector: &mut self.inspector,
            report: &mut self.report,
            memory: &mut self.memory,
        }
    }

    /// Enters the mode from here on, and keeps what the derivative of the flow needs to know of it. Where there is none, everything is as it
    /// was before.
    fn change(
        &mut self,
        key: Key,
        discontinuous: bool,
        trigger: Trigger,
        log: &mut Log,
    ) -> Result<(), Error> {
        if self.passages.is_some() {
            return self.pass(key, discontinuous, trigger, log);
        }
        self.change_to(key, discontinuous, trigger, log)
    }

    /// As [`Self::change`], and keeps the passage.
    #[cold]
    #[inline(never)]
    fn pass(
        &mut self,
        key: Key,
        discontinuous: bool,
        trigger: Trigger,
        log: &mut Log,
    ) -> Result<(), Error> {
        let (mode, before) = (self.mode, self.storage.values.clone());
        self.change_to(key, discontinuous, trigger, log)?;
        let room = self
            .passages
            .as_mut()
            .filter(|all| all.len() < MOST_PASSAGES);
        if let Some(passages) = room {
            let from = mode.map(|at| &self.table.modes[at]);
            passages.push(Passage {
                t: self.travel.t,
                from: from.map(|mode| Arc::clone(&mode.key)),
                to: Arc::new(self.key.clone()),
                cause: match trigger {
                    Trigger::Guard(guard) => from.map(|mode| mode.owner(guard)),
                    Trigger::Sources => None,
                },
                before,
                after: self.storage.values.clone(),
            });
        }
        Ok(())
    }

    /// Enters the mode from here on. Where there is none, everything is as it was before.
    fn change_to(
        &mut self,
        mut key: Key,
        discontinuous: bool,
        trigger: Trigger,
        log: &mut Log,
    ) -> Result<(), Error> {
        self.wanted = None;
        self.look_back(match trigger {
            Trigger::Guard(guard) => Some(guard),
            _ => None,
        });
        let left_row = (log.wants_rows() && self.started).then(|| {
            self.read_row();
            self.row.clone()
        });
        // Most changes are like one before.
        let followed = self.transition().follow(&key, trigger);
        if let Some((at, guards)) = &followed
            && guards.is_empty()
            && self.table.let_go(*at).next().is_none()
        {
            let at = *at;
            key.closed.clone_from(&self.table.modes[at].key.closed);
            self.enter(at, key, false, trigger, left_row, log);
            return Ok(());
        }
        self.search(key, (discontinuous, trigger), followed, left_row, log)
    }

    /// Looks for the mode to enter where it is none that is known to follow.
    #[cold]
    #[inline(never)]
    fn search(
        &mut self,
        mut key: Key,
        (discontinuous, trigger): (bool, Trigger),
        followed: Option<(usize, Vec<usize>)>,
        left_row: Option<Vec<f64>>,
        log: &mut Log,
    ) -> Result<(), Error> {
        let left = self.mode.map(|at| Key::clone(&self.table.modes[at].key));
        self.key = left.unwrap_or_else(|| key.clone());
        let (values, scale) = (self.storage.values.clone(), self.storage.scale.clone());
        let known = self.storage.known.clone();
        let (balance, switches) = (self.storage.balance, key.switches.clone());
        let (events, impulses) = (log.events.len(), log.impulses.len());
        if let Some(at) = self.mode {
            self.sources.leave(self.table.modes[at].n, &self.travel.now);
        }
        let mut transition = self.transition();
        let found = transition.search(&mut key, discontinuous, trigger, followed, log);
        match found {
            Ok((at, jumped)) => {
                if jumped {
                    let reason = transition.jump_reason(at, trigger);
                    let loss = self.storage.balance.lost_in_jumps() - balance.lost_in_jumps();
                    self.storage
                        .note_jump(self.travel.t, &values, loss, reason, log);
                }
                key.copy_from(&self.table.modes[at].key);
                self.enter(at, key, jumped, trigger, left_row, log);
                Ok(())
            }
            Err(error) => {
                self.storage.restore(values, scale, known);
                (self.storage.balance, self.wanted) = (balance, Some(switches));
                log.back_to(events, impulses);
                Err(error)
            }
        }
    }

    /// Enters mode `at`, which was inspected last, under its key.
    fn enter(
        &mut self,
        at: usize,
        key: Key,
        jumped: bool,
        trigger: Trigger,
        left_row: Option<Vec<f64>>,
        log: &mut Log,
    ) {
        let t = self.travel.t;
        if let (Some(from), false) = (self.mode, jumped) {
            self.table.modes[from].remember(trigger, at);
        }
        if let Some(from) = self.mode {
            self.table.leave(from);
        }
        let same = self.mode == Some(at);
        let from = self.mode.filter(|_| self.started);
        self.report
            .enter(&mut self.table, (from, at), t, jumped, log);
        self.mode = Some(at);
        self.key = key;
        self.travel.power = self.storage.power(self.duration);
        let Mode {
            flow, magnitudes, ..
        } = &self.table.modes[at];
        self.travel.enter(flow, t, &self.inspector.w, magnitudes);
        let span = (t, self.until);
        self.sources
            .look_ahead(&self.table.thresholds, &self.key.switches, span);
        if jumped {
            self.report.jumps += 1;
        }
        if let Some(before) = left_row {
            self.log_rows(&before, same, log);
        }
    }

    /// Logs the rows of an event, of which this is the first.
    #[cold]
    #[inline(never)]
    fn log_rows(&mut self, before: &[f64], same: bool, log: &mut Log) {
        let t = self.travel.t;
        self.read_row();
        let jumped = row_jumps(before, &self.row, &self.row_is_volts);
        if jumped {
            log.row(t, before);
        }
        if jumped || !same {
            log.row(t, &self.row);
        } else if self.corner {
            log.corner(t, &self.row);
        }
    }

    /// Steps over as many rows as nothing can happen on, `t` the first of them and `next` when something is known to happen.
    fn step_ahead(&mut self, at: usize, t: f64, next: f64) -> bool {
        // What happens at the end of a step is left to the step that arrives there.
        let longest = longest_step(self.table.output_step());
        let negligible = SAME_TIME * (t + longest).abs();
        let (before, last) = (next - negligible, self.until + negligible);
        let next = (next <= last).then_some(next);
        let mode = &mut self.table.modes[at];
        self.dense
            .step(&mut self.travel, mode, (t, before.min(last)), next)
    }

    /// Stands at the last row that was asked for, or where the step over the rows ends if that is no later than `t`.
    fn end_ahead(&mut self, t: f64) {
        if let Some(at) = self.mode {
            let flow = &mut self.table.modes[at].flow;
            let exosystem = &self.sources.exosystem;
            self.dense.end(&mut self.travel, flow, exosystem, t);
        }
    }

    fn read_row(&mut self) {
        if let Some(at) = self.mode {
            let mode = &self.table.modes[at];
            mode.outputs.apply(&self.travel.now, &mut self.row);
        }
    }

    fn start(&mut self, log: &mut Log) -> Result<(), Error> {
        self.sources.stand(self.travel.t);
        let key = std::mem::take(&mut self.key);
        self.change(key, true, Trigger::Sources, log)?;
        self.started = true;
        Ok(())
    }
}

impl Stepper for Exact {
    fn time(&self) -> f64 {
        if self.dense.leads() {
            self.dense.t
        } else {
            self.travel.t
        }
    }

    fn advance(&mut self, t: f64, log: &mut Log) -> Result<(), Error> {
        if !self.started {
            self.start(log)?;
        }
        if self.dense.leads() {
            if self.dense.take(t, self.table.output_step()) {
                return Ok(());
            }
            self.end_ahead(t);
        }
        loop {
            let next = self.sources.next_stop;
            let due = next <= t + SAME_TIME * t.abs();
            let stop = if due { next.min(t) } else { t };
            let Some(at) = self.mode else {
                return Err(self.fail(Reason::internal("integrate::exact", "a run in no mode")));
            };
            let flow = &self.table.modes[at].flow;
            if flow.loss > MOST_LOSS && flow.guards() > 0 {
                return Err(self.fail(Reason::NotGraded { loss: flow.loss }));
            }
            if (!due && t <= self.travel.t) || self.step_ahead(at, t, next) {
                return Ok(());
            }
            let (from, rest) = (self.travel.t, self.travel.steps + REST);
            self.travel.most = self.settings.max_steps.min(rest);
            match self.travel.advance(
                &mut self.table.modes[at].flow,
                &self.sources.exosystem,
                stop,
            ) {
                Arrival::Reached if due => {
                    self.instant(None, log)?;
                    if self.sources.next_stop <= next {
                        let what = "sources stop a run at one instant without end";
                        return Err(self.fail(Reason::internal("integrate::exact", what)));
                    }
                    self.note_change(true, t);
                }
                Arrival::Reached => return Ok(()),
                Arrival::Fired(guard) => {
                    self.instant(Some(guard), log)?;
                    self.note_change(false, t);
                    let (t, h) = (self.travel.t, self.table.output_step());
                    if let Some((events, span)) = self.report.accumulation.burst(t, h) {
                        let error = self.fail(Reason::EventsAccumulate { events, span });
                        return Err(error.device(self.table.owner_name(at, guard)));
                    }
                }
                Arrival::Overflow => return Err(self.fail(Reason::Overflow)),
                // A guard that rounding keeps near zero allows only steps of the fastest time constant, hidden from the output.
                Arrival::Resting => {
                    let (span, runs) = (self.travel.t - from, self.settings.max_steps / REST);
                    if self.travel.steps > rest && span * (runs as f64) < self.table.output_step() {
                        return Err(self.fail(Reason::NoProgress { steps: REST, span }));
                    }
                }
            }
            log.go_on(self.travel.t)?;
            if log.pauses() {
                return Ok(());
            }
            if self.travel.steps > self.settings.max_steps {
                return Err(self.fail(Reason::TooManySteps {
                    limit: self.settings.max_steps,
                }));
            }
        }
    }

    fn read(&mut self, row: &mut [f64]) {
        if let Some(values) = self.dense.row(row.len()) {
            row.copy_from_slice(values);
        } else if let Some(at) = self.mode {
            self.table.modes[at].outputs.apply(&self.travel.now, row);
        }
    }

    fn rows_ahead(&mut self, times: &Times, k: usize) -> &[f64] {
        let (columns, h) = (self.row.len(), self.table.output_step());
        self.dense.take_all(times, k, columns, h)
    }

    fn finish(&mut self) -> Outcome {
        self.end_ahead(self.dense.t);
        self.take_storage();
        let (t, duration) = (self.travel.t, self.duration);
        let mut outcome = self.report.finish(&self.table, t, duration);
        outcome.stats.steps = self.travel.steps;
        self.storage.note_capacity();
        outcome.energy = self.storage.balance.energy();
        outcome
    }
}
