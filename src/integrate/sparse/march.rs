//! From stop to stop: how long steps are.

use super::Sparse;
use crate::integrate::error::{Error, Reason};
use crate::integrate::log::Log;
use crate::integrate::theta::Stepping;
use crate::settings::tolerances::sparse::{PROGRESS, PROGRESS_STEPS};
use crate::settings::tolerances::steps::{LONGER, SINE_EMBEDDED};
use crate::settings::tolerances::times::WHOLE;

impl Sparse {
    /// Advances to `stop`, which no breakpoint lies before.
    pub(super) fn interval(&mut self, stop: f64, log: &mut Log) -> Result<(), Error> {
        if self.script.is_some() {
            return self.scripted(stop, log);
        }
        while self.now.t < stop {
            log.go_on(self.now.t)?;
            let left = stop - self.now.t;
            let wanted = match self.stepping {
                Stepping::Fixed(h) => h.min(self.longest),
                Stepping::Controlled { .. } => self
                    .preferred
                    .min(self.longest)
                    .min(SINE_EMBEDDED * self.inputs.largest_step()),
            };
            // A quotient within rounding of an integer is that integer.
            let count = (left / wanted * (1.0 - WHOLE)).ceil().max(1.0);
            let h = left / count;
            let t1 = if count == 1.0 { stop } else { self.now.t + h };
            if self.accepted(h, t1)? {
                self.commit()?;
                self.watch_progress()?;
                self.report(log);
            }
        }
        Ok(())
    }

    /// # Errors
    /// [`Reason::NoProgress`] where [`PROGRESS_STEPS`] steps come no further than [`PROGRESS`] of the span.
    pub(super) fn watch_progress(&mut self) -> Result<(), Error> {
        let (steps, since) = self.progress;
        if self.stats.steps < steps + PROGRESS_STEPS {
            return Ok(());
        }
        self.progress = (self.stats.steps, self.now.t);
        let span = self.now.t - since;
        if span > PROGRESS * self.span {
            return Ok(());
        }
        let steps = PROGRESS_STEPS;
        Err(Error::at(self.now.t, Reason::NoProgress { steps, span }))
    }

    /// Whether the step of h, which is then the trial, is accurate enough, or as short as steps may be.
    pub(super) fn accepted(&mut self, h: f64, t1: f64) -> Result<bool, Error> {
        self.attempt(h, t1)?;
        let Some(control) = &self.control else {
            return Ok(true);
        };
        let verdict = control.judge_embedded(h, self.error(), self.refused);
        let accept = verdict.accept || self.preferred <= control.smallest();
        self.refused = !accept;
        self.preferred = if accept {
            // A step that a stop cut short says nothing against longer ones.
            verdict.next.max(self.preferred.min(LONGER * h))
        } else {
            self.stats.rejected += 1;
            verdict.next.max(control.smallest())
        };
        Ok(accept)
    }
}
