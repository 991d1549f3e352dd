//! Error control: how large a step may be.
//!
//! A step h is done once whole and once in two halves; for a method of order p the halves' error is the difference divided
//! by 2^p − 1. It may use up the part h/span of the tolerance: the flow of a passive circuit with ideal diodes is a contraction, so
//! the errors of all steps together stay below the tolerance. Step sizes change by factors of two only.

use crate::integrate::inputs::Inputs;
use crate::lcs::Lcs;
use crate::settings::Settings;
use crate::settings::tolerances::steps::{
    FAINT, LONGER, NO_LONGER, ROOM, SHORTEN, SHORTER, STATE_ROUNDING,
};

/// Accepts or halves steps.
#[derive(Debug, Clone)]
pub struct Control {
    order: i32,
    grant: f64,
    tol: f64,
    span: f64,
    smallest: f64,
}

/// What to do with a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// Whether the error is small enough.
    pub accept: bool,
    /// The step to try next, s.
    pub next: f64,
}

impl Control {
    /// Control of a method of an order, over a span, s; steps shorter than the part `grant` of the span are granted that part
    /// of the tolerance.
    #[must_use]
    pub fn new(order: i32, grant: f64, settings: &Settings, span: f64) -> Self {
        Self {
            order,
            grant,
            tol: settings.tol,
            span,
            smallest: settings.min_step * span,
        }
    }

    /// Steps this short are not halved again, s.
    #[must_use]
    pub fn smallest(&self) -> f64 {
        self.smallest
    }

    /// Judges a step of length h whose halves differ from it by `difference`, and that may not have seen as much as `unseen` of its start,
    /// both relative to the amplitude. What is not seen shrinks with h at least.
    #[must_use]
    pub fn judge(&self, h: f64, difference: f64, unseen: f64) -> Verdict {
        let error = (difference / (2_f64.powi(self.order) - 1.0)).max(unseen);
        let allowed = self.tol * (h / self.span).max(self.grant);
        let accept = error <= allowed;
        let shorter = (unseen / allowed).log2().ceil().exp2();
        let mut next = if accept {
            h
        } else {
            h / shorter.clamp(2.0, SHORTEN)
        };
        if accept {
            let doubled = 2_f64.powi(self.order);
            let mut expected = error * ROOM * doubled;
            while expected <= allowed && next < self.span {
                next *= 2.0;
                expected *= doubled;
            }
        }
        Verdict { accept, next }
    }

    /// Judges a step of length h by what it says of its own error, relative to the amplitude. Lengths are 2^(−k/2) of the span, so that few
    /// of them occur.
    ///
    /// The next step is longer by up to [`LONGER`] times, or, after one that was `refused`, no longer: where steps are made in vain the error
    /// grows faster than its order says.
    pub(crate) fn judge_embedded(&self, h: f64, error: f64, refused: bool) -> Verdict {
        let allowed = self.tol * (h / self.span).max(self.grant);
        let accept = error <= allowed;
        let factor = SHORTER * (allowed / error).powf(1.0 / f64::from(self.order + 1));
        let factor = if accept {
            factor.clamp(0.5, if refused { NO_LONGER } else { LONGER })
        } else {
            factor.clamp(1.0 / SHORTEN, 0.5)
        };
        let wanted = (2.0 * (self.span / (h * factor)).log2()).ceil();
        let next = self.span * (-0.5 * wanted).exp2();
        Verdict { accept, next }
    }
}

/// The size of each storage element's voltage or current so far, for relative errors.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Amplitudes {
    names: Vec<String>,
    units: Vec<&'static str>,
    values: Vec<f64>,
    /// Largest source or branch quantity, by unit: (V, A).
    branches: (f64, f64),
}

impl Amplitudes {
    /// Nothing seen yet but what the inputs can reach.
    #[must_use]
    pub fn new(lcs: &Lcs, inputs: &Inputs) -> Self {
        let mut branches = (0.0_f64, 0.0_f64);
        for (input, value) in lcs.inputs.iter().zip(inputs.amplitudes()) {
            let side = if input.unit == "V" {
                &mut branches.0
            } else {
                &mut branches.1
            };
            *side = side.max(value.abs());
        }
        let mut new = Self {
            branches,
            ..Self::default()
        };
        new.see(lcs, &vec![0.0; lcs.n()]);
        new
    }

    /// Takes note of a state.
    pub fn see(&mut self, lcs: &Lcs, x: &[f64]) {
        // States come in the same order for one system, so position k is nearly always right.
        for (k, state) in lcs.states.iter().enumerate() {
            let at = self.position(k, &state.name).unwrap_or_else(|| {
                self.names.push(state.name.clone());
                self.units.push(state.unit);
                self.values.push(0.0);
                self.names.len() - 1
            });
            self.values[at] = self.values[at].max(x[k].abs());
        }
    }

    /// Takes note of the voltage and the current of a branch.
    pub fn see_branch(&mut self, v: f64, i: f64) {
        let (volts, amperes) = self.branches;
        self.branches = (volts.max(v.abs()), amperes.max(i.abs()));
    }

    /// The largest source or branch quantity, (V, A).
    pub(crate) fn branches(&self) -> (f64, f64) {
        self.branches
    }

    /// What arithmetic alone leaves uncertain in state k, in its unit.
    #[must_use]
    pub fn rounding(&self, lcs: &Lcs, k: usize) -> f64 {
        let at = self.position(k, &lcs.states[k].name);
        STATE_ROUNDING * at.map_or(0.0, |at| self.values[at])
    }

    fn position(&self, guess: usize, name: &str) -> Option<usize> {
        if self.names.get(guess).is_some_and(|other| other == name) {
            return Some(guess);
        }
        self.names.iter().position(|other| other == name)
    }

    /// max_k |a_k − b_k| / amplitude_k.
    #[must_use]
    pub fn error(&self, lcs: &Lcs, a: &[f64], b: &[f64]) -> f64 {
        self.part(lcs, b, |k| a[k] - b[k])
    }

    /// max_k |change_k| / amplitude_k at a state x.
    pub(crate) fn part(&self, lcs: &Lcs, x: &[f64], change: impl Fn(usize) -> f64) -> f64 {
        let largest = |unit: &str| {
            let seen = self
                .values
                .iter()
                .zip(&self.units)
                .filter(|(_, u)| **u == unit);
            let branch = if unit == "V" {
                self.branches.0
            } else {
                self.branches.1
            };
            seen.map(|(v, _)| *v).fold(branch, f64::max)
        };
        let (volts, amperes) = (largest("V"), largest("A"));
        let mut worst = 0.0_f64;
        for (k, state) in lcs.states.iter().enumerate() {
            let seen = self
                .position(k, &state.name)
                .map_or(0.0, |at| self.values[at]);
            let floor = FAINT * if state.unit == "V" { volts } else { amperes };
            let scale = seen.max(floor).max(x[k].abs());
            let difference = change(k).abs();
            if difference > 0.0 {
                worst = worst.max(difference / scale);
            }
        }
        worst
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::tolerances::steps::CORNER;

    #[test]
    fn order_decides_the_growth() {
        let control = Control::new(2, CORNER, &Settings::default(), 1.0);
        let h = 0.01;
        // tol·h = 1e-6; the estimate is a third of the difference.
        assert!(!control.judge(h, 4e-6, 0.0).accept);
        let fair = control.judge(h, 2e-6, 0.0);
        assert!(fair.accept && fair.next == h);
        assert_eq!(control.judge(h, 1e-7, 0.0).next, 2.0 * h);
    }
}
