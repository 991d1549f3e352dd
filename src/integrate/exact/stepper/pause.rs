//! Leaving a run to another method, taking it up again, and giving sources other values on the way.

use nalgebra::DVector;

use super::Exact;
use super::MOST_PASSAGES;
use crate::circuit::Source;
use crate::integrate::Energy;
use crate::integrate::energy::Balance;
use crate::integrate::error::Error;
use crate::integrate::exact::accumulation::Accumulation;
use crate::integrate::exact::key::{Key, Trigger};
use crate::integrate::exact::passage::{Corners, Passage};
use crate::integrate::log::Log;
use crate::integrate::switching::fire;

/// Where one method leaves a run and another goes on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Place {
    /// Time, s.
    pub(crate) t: f64,
    /// All capacitor voltages and inductor currents at t⁻.
    pub(crate) storage: DVector<f64>,
    /// By switch: on.
    pub(crate) switches: Vec<bool>,
}

impl Exact {
    /// Where the run stands.
    pub(crate) fn stand(&mut self) -> Place {
        self.end_ahead(self.dense.t);
        self.take_storage();
        Place {
            t: self.travel.t,
            storage: DVector::from_column_slice(&self.storage.values),
            switches: self.key.switches.clone(),
        }
    }

    /// Which ideal pairs conduct.
    pub(crate) fn conducting(&self) -> &[bool] {
        &self.key.closed
    }

    /// Keeps changes of mode and these corners of sources from here on, [`MOST_PASSAGES`] at most.
    pub(crate) fn keep_passages(&mut self, corners: Corners) {
        self.passages = Some(Vec::new());
        self.sources.at_all_corners = corners == Corners::All;
    }

    /// The changes of mode and corners since [`Self::keep_passages`], unless there are too many to keep; none are kept from here on.
    pub(crate) fn take_passages(&mut self) -> Option<Vec<Passage>> {
        self.sources.at_all_corners = false;
        self.passages.take().filter(|all| all.len() < MOST_PASSAGES)
    }

    /// By source whether it acts through controls of switches alone.
    pub(crate) fn silent_sources(&self) -> &[bool] {
        self.sources.exosystem.silent()
    }

    /// Events seen so far say nothing about those to come.
    pub(crate) fn forget_events(&mut self) {
        self.report.accumulation = Accumulation::new(f64::NEG_INFINITY);
    }

    /// The balance so far; another one to go on with.
    pub(crate) const fn balance(&mut self) -> &mut Balance {
        &mut self.storage.balance
    }

    /// A source has another waveform from here on; what that makes happen is left to [`Self::resume`].
    pub(crate) fn replace_source(&mut self, input: usize, source: Source) {
        self.sources.replace(input, source);
    }

    /// A source has another waveform from here on: an edge now. For an integrator made for sources that are free.
    ///
    /// # Errors
    /// As [`Stepper::advance`](crate::integrate::Stepper::advance).
    pub(crate) fn set_source(
        &mut self,
        input: usize,
        source: Source,
        log: &mut Log,
    ) -> Result<(), Error> {
        if !self.started {
            self.start(log)?;
        }
        self.end_ahead(self.dense.t);
        self.take_storage();
        self.memory.left_here.clear();
        self.inspector.forget_slips();
        self.inspector.forget_pace();
        let t = self.travel.t;
        self.sources.replace(input, source);
        self.sources.take_piece(input, t)?;
        let mut key = std::mem::take(&mut self.key);
        let thresholds = &self.table.thresholds;
        self.sources.position(thresholds, &mut key.switches, t);
        key.sliding.clear();
        self.corner = true;
        self.move_guarded(&mut key, None, (true, true));
        fire(&self.table.thresholds, &mut key.switches);
        self.change(key, true, Trigger::Sources, log)
    }

    /// Ends in the present mode and tells where the run stands.
    pub(crate) fn leave(&mut self) -> Place {
        self.end_ahead(self.dense.t);
        self.take_storage();
        self.report.close_slides(self.travel.t);
        self.key.sliding.clear();
        self.mode = None;
        Place {
            t: self.travel.t,
            storage: DVector::from_column_slice(&self.storage.values),
            switches: self
                .wanted
                .take()
                .unwrap_or_else(|| self.key.switches.clone()),
        }
    }

    /// Goes on from a place that another method has reached with this energy since [`Self::leave`].
    ///
    /// # Errors
    /// No mode holds there; the run may be taken up at a later place.
    pub(crate) fn resume(&mut self, place: &Place, energy: &Energy) -> Result<(), Error> {
        self.stand_at(place, energy);
        self.sources.resume(place.t)?;
        let mut switches = place.switches.clone();
        let thresholds = &self.table.thresholds;
        self.sources.position(thresholds, &mut switches, place.t);
        self.inspector.forget_slips();
        self.inspector.forget_pace();
        self.memory.left_here.clear();
        // Its edges have acted.
        self.sources.before = self.sources.inputs(place.t);
        let key = Key {
            closed: self.key.closed.clone(),
            switches,
            sliding: Vec::new(),
        };
        // Its state satisfies the constraints up to rounding; what is left of a jump is not worth a word.
        let mut log = Log::new(0, f64::INFINITY, false);
        let jumps = self.report.jumps;
        self.started = false;
        let result = self.change(key, true, Trigger::Sources, &mut log);
        self.started = true;
        self.report.jumps = jumps;
        result
    }

    /// Takes over a place, without a mode, with the energy spent since [`Self::leave`].
    pub(crate) fn stand_at(&mut self, place: &Place, energy: &Energy) {
        self.travel.t = place.t;
        self.storage.set(place.storage.as_slice());
        self.storage.balance.add_part(energy);
        self.storage.note_stored();
    }
}
