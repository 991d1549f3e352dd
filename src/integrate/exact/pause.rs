//! Leaving a run to another method, and taking it up again.

use nalgebra::DVector;

use super::mode::Key;
use super::stepper::Exact;
use super::transition::Trigger;
use crate::integrate::Energy;
use crate::integrate::run::{Log, Reason, SimError};

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

impl Exact<'_> {
    /// Ends in the present mode and tells where the run stands.
    pub(crate) fn leave(&mut self) -> Place {
        self.end_ahead(f64::NEG_INFINITY);
        self.take_storage();
        self.close_slides();
        self.mode = None;
        Place {
            t: self.motion.t,
            storage: DVector::from_column_slice(&self.storage),
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
    pub(crate) fn resume(&mut self, place: &Place, energy: &Energy) -> Result<(), SimError> {
        self.stand_at(place, energy);
        for i in 0..self.sources.len() {
            let Some(piece) = self.sources[i].piece(place.t) else {
                return Err(self.fail(Reason::Unsupported("a source has no closed form".into())));
            };
            self.exosystem.set_piece(i, piece);
        }
        let mut switches = place.switches.clone();
        for clock in &mut self.plant.clocks {
            let i = clock.switch;
            clock.stand_at(&self.sources, place.t);
            switches[i] ^= clock.leaves(&self.plant.thresholds[i], switches[i], place.t);
        }
        self.inspector.forget_slips();
        self.left_here.clear();
        self.exosystem.write(place.t, &mut self.z);
        // Its edges have acted.
        self.before = self.inputs(place.t);
        let key = Key {
            closed: self.key.closed.clone(),
            switches,
            sliding: Vec::new(),
        };
        // Its state satisfies the constraints up to rounding; what is left of a jump is not worth a word.
        let mut log = Log::new(0, f64::INFINITY, false);
        let jumps = self.jumps;
        self.started = false;
        let result = self.change(key, true, Trigger::Sources, &mut log);
        self.started = true;
        self.jumps = jumps;
        result
    }

    /// Takes over a place, without a mode, with the energy spent since [`Self::leave`].
    pub(crate) fn stand_at(&mut self, place: &Place, energy: &Energy) {
        self.motion.t = place.t;
        self.storage.copy_from_slice(place.storage.as_slice());
        self.rescale();
        self.balance.add_part(energy);
        self.note_stored();
    }
}
