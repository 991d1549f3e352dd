//! The error a run of steps carries, from the steps themselves.
//!
//! With prescribed steps the local error is read from differences of consecutive states, h²x''/2 ≈ (x_{k+1} − 2x_k + x_{k−1})/2 for
//! methods of order 1 (an upper estimate for θ = ½, γ = 1, where only λ is of order 1) and h³x'''/12 ≈ ∇³x/12 for the midpoint rule (E. Hairer, G. Wanner, Solving Ordinary Differential
//! Equations II, IV.8), and carried along by the step's own map, e ← R (e + local), so that what is forgotten leaves the estimate too
//! and what decays within the step hardly counts (Shampine, see [`StepError`]) but at a start, where it may have moved a device.
//! A step that changes the active set counts with order 1: somewhere in it x' has a kink. Where no steps went before it, as at a start with
//! a transient inside the first step, it counts as if there had been rest before. Steps after an edge or a jump come in pairs of halves of order 1,
//! whose difference tells the error of both.
//!
//! With curved laws the stages tell both: e is carried by their derivatives, and the local error is the change of the embedded difference
//! d = O(hᵖ) from step to step, which has the order of the error, times the ratio of the two constants.
//!
//! With chosen steps the errors of all of them are added: the flow of a passive circuit is a contraction. One that changes the active set
//! counts with order 1.

#[cfg(test)]
mod tests;

use crate::integrate::control::Amplitudes;
use crate::integrate::stats::StatedError;
use crate::integrate::theta::stages::StepError;
use crate::lcs::Lcs;

/// Differences tell the error itself, so that the true one is above it as often as below: what is stated is twice as much. The sum over
/// chosen steps needs no margin.
const MARGIN: f64 = 2.0;
/// Steps whose difference in length is below this part are one step length.
const SAME: f64 = 1e-9;

/// See the [module](self).
#[derive(Debug, Clone, Default)]
pub(super) struct Estimate {
    h: f64,
    /// How many steps in a row of this length the differences come from.
    known: u8,
    /// The next step is the second half of a pair: its differences go on from the first.
    paired: bool,
    /// Whether some step told an error.
    sampled: bool,
    difference: Vec<f64>,
    second: Vec<f64>,
    error: Vec<f64>,
    carried: Vec<f64>,
    unfiltered: Vec<f64>,
    /// Largest |e| and |x| of each state since the present system was entered.
    largest: Vec<f64>,
    amplitude: Vec<f64>,
    /// ∫ e² dt of each state since then.
    squares: Vec<f64>,
    /// The largest relative error in the systems left, or the sum of errors of chosen steps.
    relative: f64,
    /// ∫ of its square over the time so far, s.
    mean_square: f64,
    span: f64,
}

impl Estimate {
    /// For a system of n states whose start carries the error `error`.
    pub(super) fn enter(&mut self, error: impl Iterator<Item = f64>) {
        self.error.clear();
        self.error.extend(error);
        let n = self.error.len();
        for v in [
            &mut self.difference,
            &mut self.second,
            &mut self.carried,
            &mut self.unfiltered,
            &mut self.largest,
            &mut self.amplitude,
            &mut self.squares,
        ] {
            v.clear();
            v.resize(n, 0.0);
        }
        self.known = 0;
    }

    /// Copies another estimate into this one's buffers.
    pub(super) fn copy_from(&mut self, other: &Self) {
        (self.h, self.known, self.relative) = (other.h, other.known, other.relative);
        (self.paired, self.sampled) = (other.paired, other.sampled);
        (self.mean_square, self.span) = (other.mean_square, other.span);
        self.squares.clone_from(&other.squares);
        self.difference.clone_from(&other.difference);
        self.second.clone_from(&other.second);
        self.error.clone_from(&other.error);
        self.carried.clone_from(&other.carried);
        self.largest.clone_from(&other.largest);
        self.amplitude.clone_from(&other.amplitude);
    }

    /// e now.
    pub(super) fn error(&self) -> &[f64] {
        &self.error
    }

    /// The differences so far say nothing about the next step: the state jumped, or a source did.
    pub(super) fn restart(&mut self) {
        if !std::mem::take(&mut self.paired) {
            self.known = 0;
        }
    }

    /// The next step, a half of the same length, goes on from the last although it is one after an edge or a jump.
    pub(super) fn pair(&mut self) {
        self.paired = true;
    }

    /// Adds the error of an accepted step of chosen length h, relative to the amplitude.
    pub(super) fn add(&mut self, error: f64, h: f64) {
        self.sampled = true;
        self.relative += error;
        self.span += h;
        self.mean_square += h * self.relative * self.relative;
    }

    /// A step of length h from `before` to `after`. `map` holds the rows of R (and whatever follows in them, `width` in
    /// all), where the active set stayed.
    #[inline]
    pub(super) fn step(
        &mut self,
        h: f64,
        before: &[f64],
        after: &[f64],
        map: Option<(&[f64], usize)>,
        second_order: bool,
    ) {
        if (h - self.h).abs() > SAME * h {
            (self.h, self.known) = (h, 0);
        }
        self.carried.copy_from_slice(&self.error);
        // The first steps in a row have no differences; the first that has them counts for those too.
        let (rest, one, two) = match (self.known, second_order && map.is_some()) {
            (0, _) if map.is_none() => (0.5, 0.0, 0.0),
            (0, _) | (1, true) => (0.0, 0.0, 0.0),
            (1, false) => (0.0, 1.0, 0.0),
            (_, false) => (0.0, 0.5, 0.0),
            (2, true) => (0.0, 0.0, 3.0 / 12.0),
            (_, true) => (0.0, 0.0, 1.0 / 12.0),
        };
        self.sampled |= rest + one + two > 0.0;
        for i in 0..before.len() {
            let first = after[i] - before[i];
            let second = first - self.difference[i];
            let third = second - self.second[i];
            let local = rest * first + one * second + two * third;
            if self.known < 2 {
                self.unfiltered[i] = local;
            } else {
                self.carried[i] += local;
            }
            self.amplitude[i] = self.amplitude[i].max(after[i].abs());
            (self.difference[i], self.second[i]) = (first, second);
        }
        match map {
            Some((rows, width)) => {
                for (e, row) in self.error.iter_mut().zip(rows.chunks_exact(width)) {
                    *e = row.iter().zip(&self.carried).map(|(r, e)| r * e).sum();
                }
            }
            None => self.error.copy_from_slice(&self.carried),
        }
        if self.known < 2 {
            let errors = self.error.iter_mut().zip(&self.unfiltered);
            errors.for_each(|(e, local)| *e += local);
        }
        self.note(h);
        self.known = match map {
            Some(_) => (self.known + 1).min(3),
            None => 0,
        };
    }

    /// A step of length h to `after` of which the stages tell the error.
    pub(super) fn stages(&mut self, h: f64, after: &[f64], step: StepError) {
        let ratio = if self.known > 0 {
            (h / self.h).powi(step.order)
        } else {
            0.0
        };
        // The first step in a row has no other to compare with: as if there had been rest before it.
        for (i, x) in after.iter().enumerate() {
            let change = step.embedded[i] - ratio * self.difference[i];
            self.error[i] = step.carried[i] + step.constant * change;
            self.amplitude[i] = self.amplitude[i].max(x.abs());
            self.difference[i] = step.embedded[i];
        }
        (self.h, self.known) = (h, 1);
        self.sampled = true;
        self.note(h);
    }

    /// Takes note of e after a step of h.
    fn note(&mut self, h: f64) {
        self.span += h;
        let notes = self.largest.iter_mut().zip(&mut self.squares);
        for (e, (largest, square)) in self.error.iter().zip(notes) {
            *largest = largest.max(e.abs());
            *square += h * e * e;
        }
    }

    /// A switch should have moved somewhere in the step from `before` to `after`, and does so at its end: the state is off by what
    /// the step did to it. A switch that chatters makes up for that the next time, so that nothing is carried along.
    pub(super) fn switched_late(&mut self, before: &[f64], after: &[f64]) {
        for (i, largest) in self.largest.iter_mut().enumerate() {
            *largest = largest.max(self.error[i].abs() + (after[i] - before[i]).abs());
        }
    }

    /// Takes the largest error in the present system into account, relative to amplitudes.
    pub(super) fn settle(&mut self, lcs: &Lcs, amplitudes: &mut Amplitudes) {
        amplitudes.see(lcs, &self.amplitude);
        let nothing = vec![0.0; self.largest.len()];
        let worst = amplitudes.error(lcs, &self.largest, &nothing);
        self.relative = self.relative.max(worst);
        let squares: Vec<f64> = self.squares.iter().map(|s| s.sqrt()).collect();
        self.squares.fill(0.0);
        self.mean_square += amplitudes.error(lcs, &squares, &nothing).powi(2);
    }

    /// The estimate, relative to the amplitude of the state it is largest for; nothing where no step told an error.
    pub(super) fn stated(&self) -> StatedError {
        let margin = if self.error.is_empty() { 1.0 } else { MARGIN };
        // Nor is it known where no state moved.
        let told = self.sampled && self.relative > 0.0;
        let known = |error: f64| (told && error.is_finite()).then_some(margin * error);
        let mean = if self.span > 0.0 {
            self.mean_square / self.span
        } else {
            0.0
        };
        StatedError {
            max: known(self.relative),
            rms: known(mean.sqrt()),
        }
    }
}
