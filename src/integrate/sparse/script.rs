//! Runs that are made again in the same steps, so that what they come to is a smooth function of where they begin.

use super::Sparse;
use crate::integrate::error::{Error, Reason};
use crate::integrate::log::Log;
use crate::integrate::theta::Stepping;
use crate::settings::tolerances::sparse::FIRST_TRIED;
use crate::settings::tolerances::steps::SINE_EMBEDDED;

/// The steps between two instants are parts of the time between these by powers of two, down to this one: few lengths, and few factors.
const FINEST: u32 = 40;

/// The lengths of the steps of a run, and where it stands among them.
#[derive(Debug, Clone, Default)]
pub(super) struct Script {
    /// (h, end), s.
    pub(super) steps: Vec<(f64, f64)>,
    /// The next one; nothing where steps are chosen and written down.
    pub(super) next: Option<usize>,
}

impl Script {
    /// The same with each step in halves.
    pub(super) fn halved(steps: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let halves = steps.iter().flat_map(|&(h, end)| {
            let half = 0.5 * h;
            [(half, end - half), (half, end)]
        });
        halves.collect()
    }
}

impl Sparse {
    /// Advances to `stop` by the steps of the script, or by such as are written into it.
    pub(super) fn scripted(&mut self, stop: f64, log: &mut Log) -> Result<(), Error> {
        let Some(script) = &self.script else {
            return Ok(());
        };
        if script.next.is_none() {
            return self.chosen(stop, log);
        }
        while self.now.t < stop {
            log.go_on(self.now.t)?;
            let known = self.script.as_mut().and_then(|script| {
                let at = script.next?;
                script.next = Some(at + 1);
                script.steps.get(at).copied()
            });
            let Some((h, end)) = known.filter(|(_, end)| *end <= stop + Self::slack(stop)) else {
                let what = "a run that is made again has other instants";
                let reason = Reason::internal("integrate::sparse::script", what);
                return Err(Error::at(self.now.t, reason));
            };
            let end = if (end - stop).abs() <= Self::slack(stop) {
                stop
            } else {
                end
            };
            self.attempt(h, end)?;
            self.commit()?;
            self.pending.clear();
        }
        Ok(())
    }

    /// The same by steps that their error allows. They begin longer than those behind an instant of a run that is made once: steps in vain are not written down.
    fn chosen(&mut self, stop: f64, log: &mut Log) -> Result<(), Error> {
        let (begin, whole) = (self.now.t, 1_u64 << FINEST);
        let length = stop - begin;
        let mut done = 0;
        self.preferred = self.preferred.max(FIRST_TRIED * length);
        while done < whole {
            log.go_on(self.now.t)?;
            let longest = self.longest.min(SINE_EMBEDDED * self.inputs.largest_step());
            let longest = match self.stepping {
                Stepping::Fixed(h) => longest.min(h),
                Stepping::Controlled { .. } => longest.min(self.preferred),
            };
            let parts = (length / longest).log2().ceil().max(0.0);
            let mut part = whole >> (parts as u32).min(FINEST);
            while !done.is_multiple_of(part) {
                part /= 2;
            }
            let h = length * (part as f64 / whole as f64);
            let end = done + part;
            let t1 = if end == whole {
                stop
            } else {
                begin + length * (end as f64 / whole as f64)
            };
            // No shorter one can be told from it.
            let last = part == 1 || t1 <= self.now.t;
            if self.accepted(h, t1)? || last {
                done = end;
                if t1 <= self.now.t {
                    continue;
                }
                self.commit()?;
                self.watch_progress()?;
                self.pending.clear();
                if let Some(script) = &mut self.script {
                    script.steps.push((h, t1));
                }
            }
        }
        Ok(())
    }
}
