//! Newton's method for the orbits of large circuits, whose derivative M is never written down: products M v alone are made.
//!
//! ```text
//! (I − M) δ = F(s) − s    by GMRES in z = W s,      W_i = √(C_i or L_i)
//! ```
//!
//! A passive circuit with ideal devices is a contraction in these coordinates, so that the eigenvalues of W M W⁻¹ and what GMRES sees of it lie in the unit disc. Steps and active sets of the
//! return stay as they are in a product (see [`Returns`]): F is piecewise affine, and a correction that stays in its piece closes the orbit to what GMRES leaves.

use std::sync::atomic::AtomicBool;

use nalgebra::DVector;

use super::super::shooting::Stand;
use crate::integrate::{Error, Lengths, Passed, Reason, Returns, grow};
use crate::linalg::krylov::{Ritz, gmres, leading};
use crate::settings::tolerances::periodic::{
    CLOSED_AT_BEST, CLOSED_ENOUGH, GOES_ON, KEPT_ITS_WORD, LEAST_AMPLITUDE, LEAST_WEIGHT,
    LEFT_OF_RESIDUAL, NEUTRAL, STEPPED_DIFFERENCE, STEPS_ANEW,
};

/// Corrections of one attempt.
const MOST_CORRECTIONS: u32 = 32;

/// Halvings of a correction that makes the residual larger.
const HALVINGS: u32 = 6;

/// Returns that are let pass in one attempt where no correction makes the residual smaller.
const MOST_RELAXED: u32 = 8;

/// Vectors of one correction.
const MOST_VECTORS: usize = 100;

/// Multipliers that are looked for, and vectors in which they are.
const MULTIPLIERS: (usize, usize) = (6, 160);

/// A place, and what a return makes of it.
pub(super) struct Shot {
    pub(super) stand: Stand,
    pub(super) passed: Passed,
    /// W (F(s) − s).
    residual: DVector<f64>,
    /// max |F(s) − s| in parts of the amplitudes.
    pub(super) size: f64,
}

impl Shot {
    /// Whether it is an orbit to this part of its amplitudes.
    pub(super) fn closes(&self, closed: f64) -> bool {
        self.size <= closed && self.passed.switches == self.stand.switches
    }
}

/// The steps of a return.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Steps {
    Anew,
    Same,
    Halves,
}

/// Returns that are compared with where they began.
pub(super) struct Shooting<'a> {
    pub(super) returns: Returns,
    pub(super) from: f64,
    pub(super) until: f64,
    pub(super) cancel: Option<&'a AtomicBool>,
    /// The largest of each quantity so far.
    seen: Vec<f64>,
    pub(super) amplitudes: Vec<f64>,
    /// W.
    weights: Vec<f64>,
    /// The steps of the last return whose steps were chosen: (h, end), s.
    steps: Vec<(f64, f64)>,
    pub(super) corrections: u32,
    pub(super) products: u64,
    /// A residual that is small enough.
    enough: f64,
    /// Returns so far.
    pub(super) made: u64,
    /// The smallest residual.
    pub(super) least: f64,
}

impl<'a> Shooting<'a> {
    pub(super) fn of(
        returns: Returns,
        (from, until): (f64, f64),
        cancel: Option<&'a AtomicBool>,
    ) -> Self {
        let n = returns.names().len();
        Self {
            returns,
            from,
            until,
            cancel,
            seen: vec![0.0; n],
            amplitudes: vec![1.0; n],
            weights: vec![1.0; n],
            steps: Vec::new(),
            corrections: 0,
            products: 0,
            enough: CLOSED_ENOUGH,
            made: 0,
            least: f64::INFINITY,
        }
    }

    /// Lets a return pass.
    pub(super) fn pass(&mut self, stand: &Stand) -> Result<Stand, Error> {
        let place = (self.from, &stand.state[..], &stand.switches[..]);
        let passed = self
            .returns
            .pass(place, self.until, Lengths::Free, self.cancel)?;
        self.made += 1;
        self.observe(&passed.peaks);
        Ok(Stand {
            state: passed.state,
            switches: passed.switches,
        })
    }

    /// Takes the amplitudes of a return with these peaks, each at least [`LEAST_AMPLITUDE`] of the largest of its unit so far, and what they make of W.
    fn observe(&mut self, peaks: &[f64]) {
        grow(&mut self.seen, peaks);
        let units = self.returns.units();
        let largest = |unit: &str| {
            let own = self.seen.iter().zip(units).filter(|(_, u)| **u == unit);
            own.fold(0.0_f64, |most, (seen, _)| most.max(*seen))
        };
        let (volts, amperes) = (largest("V"), largest("A"));
        let any = volts.max(amperes);
        let any = if any > 0.0 { any } else { 1.0 };
        let least = |unit: &str| match if unit == "V" { volts } else { amperes } {
            0.0 => any,
            most => most,
        };
        let floors = units.iter().map(|unit| LEAST_AMPLITUDE * least(unit));
        let sizes = peaks.iter().zip(floors);
        self.amplitudes = sizes.map(|(peak, floor)| peak.max(floor)).collect();
        let energies = self.returns.scale();
        let roots = energies.iter().zip(&self.amplitudes).map(|(e, a)| e * a);
        let most = roots.clone().fold(0.0_f64, f64::max);
        let most = if most > 0.0 { most } else { 1.0 };
        let weights = roots.zip(&self.amplitudes);
        self.weights = weights
            .map(|(root, amplitude)| root.max(LEAST_WEIGHT * most) / (amplitude * most))
            .collect();
    }

    fn shoot(&mut self, stand: Stand, steps: Steps) -> Result<Shot, Error> {
        let lengths = match steps {
            Steps::Anew => Lengths::Free,
            Steps::Same => Lengths::Same(&self.steps),
            Steps::Halves => Lengths::Halves(&self.steps),
        };
        let place = (self.from, &stand.state[..], &stand.switches[..]);
        let passed = self.returns.pass(place, self.until, lengths, self.cancel)?;
        self.made += 1;
        let mut shot = Shot {
            residual: DVector::zeros(stand.state.len()),
            stand,
            passed,
            size: 0.0,
        };
        self.measure(&mut shot);
        Ok(shot)
    }

    /// How far a return is from closed, in present amplitudes and weights.
    fn measure(&self, shot: &mut Shot) {
        let both = shot.passed.state.iter().zip(&shot.stand.state);
        let moved = both.map(|(a, b)| a - b);
        let parts = moved.clone().zip(&self.amplitudes);
        shot.size = parts.fold(0.0_f64, |most, (d, a)| most.max((d / a).abs()));
        for (residual, (d, w)) in shot.residual.iter_mut().zip(moved.zip(&self.weights)) {
            *residual = d * w;
        }
    }

    /// W M W⁻¹ v at a place: along the active sets of its return, and where these leave it open by the difference of two returns.
    ///
    /// # Errors
    /// See [`Reason`].
    fn product(&mut self, shot: &Shot, v: &DVector<f64>) -> Result<DVector<f64>, Error> {
        self.products += 1;
        if let Some(cancel) = self.cancel
            && cancel.load(std::sync::atomic::Ordering::Relaxed)
        {
            return Err(Error::before(Reason::Interrupted));
        }
        let change: Vec<f64> = v.iter().zip(&self.weights).map(|(v, w)| v / w).collect();
        let made = match self.returns.product(&shot.passed.tape, &change) {
            Some(made) => made,
            None => self.difference(shot, &change)?,
        };
        let weighted = made.iter().zip(&self.weights).map(|(d, w)| d * w);
        Ok(DVector::from_iterator(v.len(), weighted))
    }

    fn difference(&mut self, shot: &Shot, change: &[f64]) -> Result<Vec<f64>, Error> {
        let parts = change.iter().zip(&self.amplitudes);
        let largest = parts.fold(0.0_f64, |most, (d, a)| most.max((d / a).abs()));
        let part = STEPPED_DIFFERENCE / largest.max(f64::MIN_POSITIVE);
        let mut moved = shot.stand.clone();
        for (value, d) in moved.state.iter_mut().zip(change) {
            *value += part * d;
        }
        let other = self.shoot(moved, Steps::Same)?;
        let ends = other.passed.state.iter().zip(&shot.passed.state);
        Ok(ends.map(|(a, b)| (a - b) / part).collect())
    }

    /// δ in units of the storage, by the derivative at `base`.
    fn correction(
        &mut self,
        base: &Shot,
        residual: &DVector<f64>,
        reduction: f64,
    ) -> Result<Vec<f64>, Error> {
        let mut product = |v: &DVector<f64>| Ok::<_, Error>(v - self.product(base, v)?);
        let found = gmres(&mut product, residual, (reduction, NEUTRAL), MOST_VECTORS)?;
        Ok(found
            .iter()
            .zip(&self.weights)
            .map(|(d, w)| d / w)
            .collect())
    }

    /// The place that a correction leads to, or the longest half of it that makes the residual smaller.
    fn corrected(
        &mut self,
        (shot, base): (&Shot, &Shot),
        halves: bool,
        reduction: f64,
    ) -> Result<Option<Shot>, Error> {
        let correction = self.correction(base, &shot.residual, reduction)?;
        let parts = correction.iter().zip(&self.amplitudes);
        let moves = parts.fold(0.0_f64, |most, (d, a)| most.max((d / a).abs()));
        let mut part = 1.0;
        for _ in 0..=HALVINGS {
            let mut next = shot.stand.clone();
            for (value, d) in next.state.iter_mut().zip(&correction) {
                *value += part * d;
            }
            let steps = match halves {
                true => Steps::Halves,
                false if part * moves > STEPS_ANEW => Steps::Anew,
                false => Steps::Same,
            };
            match self.shoot(next, steps) {
                Ok(found) if found.residual.norm() < shot.residual.norm() => {
                    return Ok(Some(found));
                }
                Err(error) if error.reason == Reason::Interrupted => return Err(error),
                // Where no circuit is the correction was too long.
                _ => part *= 0.5,
            }
            if shot.size <= self.enough {
                break;
            }
        }
        Ok(None)
    }

    /// Corrects a place until the residual falls no more; `None` where it does not come below `closed`.
    ///
    /// # Errors
    /// See [`Reason`].
    pub(super) fn solve(&mut self, stand: Stand, closed: f64) -> Result<Option<Shot>, Error> {
        let mut shot = self.shoot(stand, Steps::Anew)?;
        self.take_steps(&mut shot);
        let (mut relaxed, mut reduction) = (0, LEFT_OF_RESIDUAL);
        for _ in 0..MOST_CORRECTIONS {
            self.least = self.least.min(shot.size);
            if shot.size <= self.enough {
                break;
            }
            self.corrections += 1;
            let before = shot.size;
            if let Some(next) = self.corrected((&shot, &shot), false, reduction)? {
                shot = next;
                self.take_steps(&mut shot);
                // Where the return went on as it did all that is left can be corrected at once.
                let kept = shot.size < KEPT_ITS_WORD * reduction * before;
                let all = (0.5 * self.enough / shot.size).min(LEFT_OF_RESIDUAL);
                reduction = if kept { all } else { LEFT_OF_RESIDUAL };
                if shot.closes(closed) && shot.size > GOES_ON * before {
                    break;
                }
            } else if shot.closes(closed) || relaxed == MOST_RELAXED {
                break;
            } else {
                relaxed += 1;
                let after = Stand {
                    state: shot.passed.state,
                    switches: shot.passed.switches,
                };
                shot = self.shoot(after, Steps::Anew)?;
                self.take_steps(&mut shot);
            }
        }
        self.least = self.least.min(shot.size);
        Ok(shot.closes(closed).then_some(shot))
    }

    /// Steps of a return.
    pub(super) fn steps(&self) -> usize {
        self.steps.len()
    }

    /// Takes over the steps of a return, and its amplitudes.
    fn take_steps(&mut self, shot: &mut Shot) {
        if shot.passed.steps.is_empty() {
            return;
        }
        std::mem::swap(&mut self.steps, &mut shot.passed.steps);
        shot.passed.steps.clear();
        // What a transient has not come to yet is larger here.
        let peaks = std::mem::take(&mut shot.passed.peaks);
        self.observe(&peaks);
        self.measure(shot);
    }

    /// The orbit of steps half as long near one whose largest multiplier is `largest`, by the derivative of that one; `None` where it is not found.
    ///
    /// # Errors
    /// [`Reason::Interrupted`].
    pub(super) fn halved(
        &mut self,
        shot: &Shot,
        closed: f64,
        largest: f64,
    ) -> Result<Option<Shot>, Error> {
        let slow = (1.0 - largest).abs().min(1.0);
        self.enough = (CLOSED_ENOUGH * slow).max(CLOSED_AT_BEST);
        let mut fine = match self.shoot(shot.stand.clone(), Steps::Halves) {
            Ok(fine) => fine,
            Err(error) if error.reason == Reason::Interrupted => return Err(error),
            Err(_) => return Ok(None),
        };
        for _ in 0..MOST_CORRECTIONS {
            let before = fine.size;
            if before <= self.enough {
                break;
            }
            self.corrections += 1;
            match self.corrected((&fine, shot), true, LEFT_OF_RESIDUAL)? {
                Some(next) => fine = next,
                None => break,
            }
            if fine.closes(closed) && fine.size > GOES_ON * before {
                break;
            }
        }
        Ok(fine.closes(closed).then_some(fine))
    }

    /// The leading multipliers, and of each of them the quantities that take part in it, in parts of the largest.
    ///
    /// # Errors
    /// See [`Reason`].
    pub(super) fn multipliers(&mut self, shot: &Shot) -> Result<Option<Vec<Ritz>>, Error> {
        let n = shot.stand.state.len();
        let mut product = |v: &DVector<f64>| self.product(shot, v);
        let Some(mut found) = leading(&mut product, n, MULTIPLIERS)? else {
            return Ok(None);
        };
        for ritz in &mut found {
            let scales = self.weights.iter().zip(&self.amplitudes);
            for (value, (w, a)) in ritz.vector.iter_mut().zip(scales) {
                *value /= w * a;
            }
            let size = ritz.vector.amax();
            if size > 0.0 {
                ritz.vector /= size;
            }
        }
        Ok(Some(found))
    }
}
