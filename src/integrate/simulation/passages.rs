//! What the derivative of the flow needs to know of a run.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::Simulation;
use super::way::Way;
use crate::integrate::error::Error;
use crate::integrate::exact::{Assembler, Corners, Passage};
use crate::integrate::stats::Impulse;
use crate::integrate::theta::Instant;

impl Simulation {
    /// The changes of mode on the way from a place, as for [`Self::stand_at`], to time `until`, s: the first is the one into the mode there.
    /// `None` where the way is not exact throughout. It ends when `cancel` is set.
    ///
    /// # Errors
    /// As [`Self::advance_to`].
    pub(crate) fn passages(
        &mut self,
        (t, state, switches): (f64, &[f64], &[bool]),
        until: f64,
        corners: Corners,
        cancel: Option<&AtomicBool>,
    ) -> Result<Option<Vec<Passage>>, Error> {
        let Way::Exact(exact) = &mut self.way else {
            return Ok(None);
        };
        exact.keep_passages(corners);
        self.stand_at(t, state, switches)?;
        self.advance(until, false, cancel)?;
        let passages = match &mut self.way {
            Way::Exact(exact) => exact.take_passages(),
            Way::Steps(_) => None,
        };
        let whole = |passages: &Vec<Passage>| {
            let mut from = passages.iter().map(|passage| passage.from.is_some());
            from.next() == Some(false) && from.all(|known| known)
        };
        Ok(passages.filter(whole))
    }

    /// Goes from a place, as for [`Self::stand_at`], to time `until`, s: whether the way is exact throughout. It ends when `cancel` is set.
    ///
    /// # Errors
    /// As [`Self::advance_to`].
    pub(crate) fn pass(
        &mut self,
        (t, state, switches): (f64, &[f64], &[bool]),
        until: f64,
        cancel: Option<&AtomicBool>,
    ) -> Result<bool, Error> {
        self.stand_at(t, state, switches)?;
        self.advance(until, false, cancel)?;
        Ok(self.is_exact() && !self.way.stepper().has_stepped())
    }

    /// Where a run in steps stands; `None` of one that is exact.
    ///
    /// # Errors
    /// λ cannot be found there.
    pub(crate) fn instant(&mut self) -> Result<Option<Instant>, Error> {
        match &mut self.way {
            Way::Exact(_) => Ok(None),
            Way::Steps(theta) => theta.instant().map(Some),
        }
    }

    /// Reduces the circuit with devices that are open for a run as long as `span`, s; the laws of others are to be put back.
    pub(crate) fn opener(&self, span: f64) -> Assembler {
        let multiport = &self.problem.systems.multiport;
        Assembler::new(Arc::new(multiport.with_ideal_diodes())).with_span(span)
    }

    /// The impulses of devices and sources so far.
    pub(crate) fn impulses(&self) -> &[Impulse] {
        &self.impulses
    }

    /// Reduces the circuit for its modes, where no step is longer than `span`, s.
    pub(crate) fn assembler(&self, span: f64) -> Assembler {
        let systems = &self.problem.systems;
        Assembler::new(Arc::clone(&systems.multiport))
            .with_span(span)
            .sharing(&systems.reduced)
    }
}
