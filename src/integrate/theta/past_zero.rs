//! Devices that go on as they are past a zero in the second half of a step.
//!
//! **Currents.** With γ < 1 the λ of a step stands for the time t + γ h, and of a step with θ = γ = ½ it is the mean: a device whose λ falls through zero behind
//! that time conducts to the end. A step and its two halves may do so alike, and their difference is then nothing, at any tolerance. The λ of the
//! two halves tell where it is at the end, λ₁ < 0, and what the line between them carries the wrong way,
//!
//! ```text
//! B_j ∫ min(λ_j, 0) dt = −B_j λ₁²/2|λ'|,
//! ```
//!
//! is an error of the step.
//!
//! **Voltages.** With θ < 1 a step that is solved has the voltage of t + θ h: a device whose voltage falls through zero behind that time blocks to
//! the end, in the step and in its halves alike. There it is negative. With the devices that the same step of Moreau's scheme finds at its end λ would rise
//! from nothing at the zero: they move the state by half of what that step does by them, for the part of the step that is left.

use super::*;

/// The λ of the first half of a step, and where in it they are.
#[derive(Debug, Default)]
pub(super) struct FirstHalf {
    lambda: Vec<f64>,
    gamma: f64,
    /// What devices that block past their zeros in it would have carried: a change of x.
    blocked: Vec<f64>,
}

impl Theta {
    /// γ of the attempted step where it has λ of devices that are as they were, and no stages.
    fn gamma_of_attempt(&self) -> Option<f64> {
        let system = self.system();
        let plain = self.attempt.solved.is_none() && !system.curved;
        plain.then(|| system.step(self.attempt.step).scheme.gamma)
    }

    /// Keeps what the attempt of the first half tells.
    pub(super) fn keep_first_half(&mut self) {
        let gamma = self.gamma_of_attempt();
        let FirstHalf {
            lambda, blocked, ..
        } = &mut self.first_half;
        *blocked = std::mem::take(&mut self.attempt.blocked);
        lambda.clear();
        if let Some(gamma) = gamma {
            lambda.extend_from_slice(&self.out[self.now.x.len()..]);
            self.first_half.gamma = gamma;
        }
    }

    /// What devices that block past their zeros in the attempted step, as `out` has it, would carry: a change of x, empty where none does. `beyond`
    /// has their negative voltages at its end, `mean` the voltages at t + θ h. The attempt is gone, and `out` with it.
    pub(super) fn blocked_past_zero(
        &mut self,
        (h, t1): (f64, f64),
        beyond: &[f64],
        mean: &[f64],
    ) -> Vec<f64> {
        let n = self.now.x.len();
        // What was negative before is the error of an earlier step.
        let before = |j: usize| self.now.beyond.get(j).copied().unwrap_or(0.0);
        let passing = (0..beyond.len()).filter(|&j| beyond[j] < before(j));
        let parts = passing.map(|j| {
            let whole = beyond[j] - mean[n + j].max(0.0);
            (beyond[j] - before(j)) / whole
        });
        let left = (1.0 - self.scheme.theta) * parts.fold(0.0, f64::max);
        if left == 0.0 || self.control.is_none() {
            return Vec::new();
        }
        self.stats.lcp_solves += 1;
        if self.solve_with(Scheme::MOREAU, h, t1).is_err() || !self.changes() {
            return Vec::new();
        }
        let changed = self.out[..n].to_vec();
        let system = &mut self.plant.systems[self.now.system].1;
        let (mode, _) = system.mode(self.attempt.step, &self.now.active);
        let fused = system.step(self.attempt.step).fused(mode);
        fused.step(&self.z, n, &mut self.out, |_| 0.0);
        let moved = changed.iter().zip(&self.out);
        moved.map(|(a, b)| 0.5 * left * (a - b)).collect()
    }

    /// What devices carry past their zeros in the attempted second half, of length `half`, and what they do not carry in either half: a change of x,
    /// empty where none does.
    pub(super) fn past_zero(&self, half: f64) -> Vec<f64> {
        let mut change = self.carried_past_zero(half);
        for blocked in [&self.first_half.blocked, &self.attempt.blocked] {
            change.resize(change.len().max(blocked.len()), 0.0);
            for (change, blocked) in change.iter_mut().zip(blocked) {
                *change += blocked;
            }
        }
        change
    }

    fn carried_past_zero(&self, half: f64) -> Vec<f64> {
        let n = self.now.x.len();
        let FirstHalf { lambda, gamma, .. } = &self.first_half;
        let Some(second) = self.gamma_of_attempt().filter(|_| !lambda.is_empty()) else {
            return Vec::new();
        };
        let apart = half * (1.0 + second - gamma);
        let left = half * (1.0 - second);
        let mut change = Vec::new();
        for (j, before) in lambda
            .iter()
            .enumerate()
            .filter(|(j, _)| self.now.active[*j])
        {
            let now = self.out[n + j];
            let slope = (now - before) / apart;
            let end = now + slope * left;
            if now >= 0.0 && end < 0.0 {
                change.resize(n, 0.0);
                let area = 0.5 * end * end / slope;
                let column = self.system().lcs.b.column(j);
                for (change, b) in change.iter_mut().zip(column.iter()) {
                    *change += b * area;
                }
            }
        }
        change
    }
}
