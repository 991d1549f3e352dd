//! The event-driven stepper: travel in a mode, find the next one, repeat.

mod change;
mod instant;
mod pause;
mod periods;
mod sharing;

use nalgebra::DVector;

use super::ahead::DenseOutput;
use super::assembler::Assembler;
use super::flow::longest_step;
use super::inspect::Inspector;
use super::key::{Key, Trigger};
use super::passage::Passage;
use super::plant::ModeTable;
use super::report::Report;
use super::rounding::resolution;
use super::sources::Sources;
use super::storage::Storage;
use super::transition::Memory;
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
        outcome.storage.clone_from(&self.storage.values);
        outcome
    }
}
