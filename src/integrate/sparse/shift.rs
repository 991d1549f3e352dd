//! Switches that sources drive: by what these move them, and what that does to what follows.

use super::Sparse;
use super::system::Largest;
use crate::integrate::error::{Error, Reason};
use crate::integrate::switching::Watched as _;
use crate::lcs::Input;
use crate::settings::tolerances::events::DECISIVE;
use crate::settings::tolerances::jumps::NO_JUMP;
use crate::settings::tolerances::sparse::INSIDE;

/// What makes switches that sources drive move at another time, and what that does.
#[derive(Debug)]
pub(super) struct Shift {
    /// s.
    pub(super) t: f64,
    /// Of each control: what it is of the sources, and its rate; nothing where it jumps there.
    pub(super) controls: Vec<(Vec<f64>, f64)>,
    /// Whether some control jumps.
    pub(super) held: bool,
    /// s' of all storage quantities before.
    pub(super) before: Vec<f64>,
    /// x' behind.
    pub(super) after: Vec<f64>,
    /// Outputs before less those behind.
    pub(super) step: Vec<f64>,
    /// Whether the storage jumps.
    pub(super) jumps: bool,
}

impl Shift {
    /// δt.
    pub(super) fn by(&self, u: &[f64], inputs: &[Input]) -> Result<f64, Error> {
        let mut all = self.controls.iter().map(|(gains, rate)| {
            let change = dot(gains, u);
            let size = gains
                .iter()
                .zip(u)
                .fold(0.0, |m: f64, (g, u)| m.max((g * u).abs()));
            let change = if change.abs() <= f64::EPSILON * size {
                0.0
            } else {
                change
            };
            (-change / rate, change)
        });
        let still = self.held.then_some((0.0, 0.0));
        let Some((first, change)) = still.or_else(|| all.next()) else {
            return Ok(0.0);
        };
        let alike = |(by, own): (f64, f64)| {
            (own == 0.0 && change == 0.0)
                || (by - first).abs() <= DECISIVE * first.abs().max(by.abs())
        };
        if self.jumps && (change != 0.0 || all.clone().any(|(_, own)| own != 0.0)) {
            let what = "a switch that the sine shifts makes charge or flux jump, which the response of a large circuit does not know";
            return Err(self.not_smooth(what, inputs, u));
        }
        if (change != 0.0 && !first.is_finite()) || !all.all(alike) {
            let what = "switches move at one instant that the sine does not shift alike, or where their control has a corner";
            return Err(self.not_smooth(what, inputs, u));
        }
        Ok(if change == 0.0 { 0.0 } else { first })
    }

    fn not_smooth(&self, what: &str, inputs: &[Input], u: &[f64]) -> Error {
        let moved = inputs.iter().zip(u).filter(|(_, u)| **u != 0.0);
        let names = moved.map(|(input, _)| input.name.as_str());
        Error::at(self.t, Reason::NotSmooth(what.into())).devices(names)
    }
}

fn dot(gains: &[f64], values: &[f64]) -> f64 {
    let terms = gains.iter().zip(values);
    terms.map(|(gain, value)| gain * value).sum()
}

impl Sparse {
    /// What shifts switches that are about to move, where that is asked; the side behind is not known yet.
    pub(super) fn shift_of(&mut self, moving: &[usize]) -> Option<Shift> {
        self.tape.as_ref().filter(|tape| tape.with_shifts)?;
        let t = self.now.t;
        let mut du = vec![0.0; self.now.u.len()];
        self.inputs
            .slopes(t - (1.0 - INSIDE) * self.now.last_h, &mut du);
        let mut left = self.now.u.clone();
        self.inputs.left(t, &mut left);
        let mut controls = Vec::new();
        let mut held = false;
        let system = self.system();
        for &i in moving {
            let (gains, _) = system.control_of_sources(i);
            let size: f64 = gains.iter().zip(&left).map(|(g, u)| (g * u).abs()).sum();
            let jump = dot(&gains, &self.now.u) - dot(&gains, &left);
            if jump.abs() > DECISIVE * size {
                held = true;
            } else {
                let rate = dot(&gains, &du);
                controls.push((gains, rate));
            }
        }
        let before = system.storage_rate(&self.now.slope, &du);
        Some(Shift {
            t,
            controls,
            held,
            before,
            after: Vec::new(),
            step: self.row(),
            jumps: false,
        })
    }

    /// Writes down what shifts the switches that have moved, from this storage.
    pub(super) fn shifted(&mut self, mut shift: Shift, before: &[f64]) {
        shift.after.clone_from(&self.now.slope);
        let behind = self.row();
        let step = shift.step.iter_mut().zip(behind);
        step.for_each(|(y, behind)| *y -= behind);
        let after = self.system().storage(&self.now.x, &self.now.u);
        let units = self.storage_units.iter().copied();
        let largest = Largest::of(units.clone().zip(self.seen.iter().copied()));
        let mut moved = before.iter().zip(&after).zip(units);
        shift.jumps = moved.any(|((a, b), unit)| (a - b).abs() > NO_JUMP * largest.among(unit));
        if let Some(tape) = &mut self.tape {
            tape.shifted(shift);
        }
    }
}
