//! Devices that conduct past the zero of their current in the second half of a step.
//!
//! With γ < 1 the λ of a step stands for the time t + γ h, and of a step with θ = γ = ½ it is the mean: a device whose λ falls through zero behind
//! that time conducts to the end. A step and its two halves may do so alike, and their difference is then nothing, at any tolerance. The λ of the
//! two halves tell where it is at the end, λ₁ < 0, and what the line between them carries the wrong way,
//!
//! ```text
//! B_j ∫ min(λ_j, 0) dt = −B_j λ₁²/2|λ'|,
//! ```
//!
//! is an error of the step.

use super::*;

/// The λ of the first half of a step, and where in it they are.
#[derive(Debug, Default)]
pub(super) struct FirstHalf {
    lambda: Vec<f64>,
    gamma: f64,
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
        let FirstHalf { lambda, .. } = &mut self.first_half;
        lambda.clear();
        if let Some(gamma) = gamma {
            lambda.extend_from_slice(&self.out[self.now.x.len()..]);
            self.first_half.gamma = gamma;
        }
    }

    /// What devices carry past their zeros in the attempted second half, of length `half`: a change of x, empty where none does.
    pub(super) fn past_zero(&self, half: f64) -> Vec<f64> {
        let n = self.now.x.len();
        let FirstHalf { lambda, gamma } = &self.first_half;
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
