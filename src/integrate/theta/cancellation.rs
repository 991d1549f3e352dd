//! States that are lost in the rounding of strong currents.
//!
//! Two junctions without a resistance across a source carry what their laws say, 10⁷⁰ A at a few volts each. What charges a capacitor between
//! them is the difference of two such currents, of which doubles keep nothing.

use super::*;
use crate::settings::tolerances::stated::IMPRECISE;
use crate::settings::tolerances::steps::STAGE_ROUNDING;

impl Theta {
    /// Refuses the end x of a step whose voltages are known no better than to [`IMPRECISE`] of their amplitudes: λ are so strong that what
    /// the ports were `solved` to, relative to the terms of x, is more. Laws never give voltages so strong that they would do the
    /// same to currents.
    pub(super) fn refuse_cancellation(
        &self,
        x: &[f64],
        (lambda, y): (&[f64], &[f64]),
        solved: f64,
    ) -> Result<(), Error> {
        let lcs = &self.system().lcs;
        let lost = |k: usize| match lcs.states[k].unit {
            "V" => solved / STAGE_ROUNDING * self.rounding[k],
            _ => 0.0,
        };
        if self.amplitudes.part(lcs, x, lost) <= IMPRECISE {
            return Ok(());
        }
        let current = |j: usize| match lcs.ports[j].role {
            Role::Voltage => y[j].abs(),
            Role::Current | Role::Function => lambda[j].abs(),
        };
        let current_max = (0..lcs.m()).map(current).fold(0.0, f64::max);
        let strong = (0..lcs.m()).filter(|&j| 2.0 * current(j) >= current_max);
        let devices = strong.map(|j| lcs.ports[j].device.clone());
        let reason = Reason::Cancellation {
            current: current_max,
        };
        Err(Error::at(self.now.t, reason).devices(devices))
    }
}
