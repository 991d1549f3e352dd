//! Devices that go on as they are past a zero in the second half of a step, which then agrees with its halves at any tolerance.
//!
//! **Currents.** With γ < 1 the λ of a step stands for the time t + γ h, and of a step with θ = γ = ½ it is the mean: a device whose λ falls through zero behind
//! that time conducts to the end. The λ of the two halves tell where it is at the end, λ₁ < 0, and what the line between them carries the wrong way,
//!
//! ```text
//! B_j ∫ min(λ_j, 0) dt = −B_j λ₁²/2|λ'|,
//! ```
//!
//! is an error of the step.
//!
//! **Voltages.** A device whose voltage falls through zero late in a step blocks to the end. From there on ẋ is another, which the right limit of the
//! end tells; the difference rises from nothing at the zero, so that x moves by half of it in the time that is left.
//!
//! **Behind a change.** Where a device changes within a step the λ of others jump with it. A step that is solved has the mean of each (γ = 1), and
//! one that is positive in the mean but negative behind the change goes on to the end: a diode between two capacitors that another one charges
//! from then on. Where the two hold the state the step and its halves agree to rounding. Where a half was solved there is no line, and ẋ may have been
//! that of the right limit for as long as the second half. Sources go on there as they came.

use super::*;
use crate::settings::tolerances::steps::CLOSER;

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

    /// The γ of the two halves where neither was solved, the attempted one last.
    fn gammas(&self) -> Option<[f64; 2]> {
        let FirstHalf { lambda, gamma, .. } = &self.first_half;
        let both = lambda.len() == self.out.len() - self.now.x.len();
        let second = self.gamma_of_attempt().filter(|_| both)?;
        Some([*gamma, second])
    }

    /// The lines of λ, or y, through the attempted half, of length `half`, and the one before, which are negative at its end: of each the port, its
    /// value in this half, at its end, and its slope. The values stand for these parts of the halves.
    fn falling(
        &self,
        half: f64,
        [first, second]: [f64; 2],
    ) -> impl Iterator<Item = (usize, [f64; 3])> + '_ {
        let n = self.now.x.len();
        let apart = half * (1.0 + second - first);
        let left = half * (1.0 - second);
        let lines = self.first_half.lambda.iter().enumerate();
        let lines = lines.map(move |(j, before)| {
            let now = self.out[n + j];
            let slope = (now - before) / apart;
            (j, [now, now + slope * left, slope])
        });
        lines.filter(|(_, [_, end, _])| *end < 0.0)
    }

    /// The part of the attempted second half, of length `half`, for which ẋ may have been that of the right limit of its end; half of the time where the
    /// difference rises from nothing. A λ that holds a state is a mean with γ = 1 too.
    pub(super) fn part_unseen(&self, half: f64) -> f64 {
        let Some(gammas) = self.gammas() else {
            return 1.0;
        };
        let falling = self.falling(half, gammas.map(|gamma| gamma.min(0.5)));
        let is_mean = gammas[1] == 1.0;
        let blocks = falling.filter(|(j, [now, ..])| is_mean || !self.now.active[*j] || *now < 0.0);
        blocks.fold(0.0, |part: f64, (_, [_, end, slope])| {
            part.max(0.5 * (end / (slope * half)).clamp(0.0, 1.0))
        })
    }

    /// What devices that are others at the right limit of now would have changed x by in the time `unseen`, where the last step was one of `half`: empty
    /// where none are.
    pub(super) fn behind_a_change(&mut self, half: f64, unseen: f64) -> Result<Vec<f64>, Error> {
        if unseen == 0.0 || self.control.is_none() || self.system().curved {
            return Ok(Vec::new());
        }
        self.stats.lcp_solves += 1;
        let short = half / CLOSER;
        // As the inputs came there: a corner at the end is none of the step.
        let t = self.now.t;
        self.inputs.slopes(t - Self::slack(t), &mut self.du);
        let step = self.prepare_along(short);
        self.inputs.slopes_behind(t, &mut self.du);
        let step = step?;
        let n = self.now.x.len();
        let system = &mut self.plant.systems[self.now.system].1;
        let (mode, _) = system.mode(step, &self.now.active);
        let fused = system.step(step).fused(mode);
        let noise = |k| self.amplitudes.rounding(&system.lcs, k);
        if fused.step(&self.z, n, &mut self.out, noise) {
            return Ok(Vec::new());
        }
        let q = system.prepare(step, &self.z, &self.amplitudes);
        let matrices = system.step_mut(step);
        matrices.driver.suggest(&self.now.active);
        let solution = matrices.driver.solve(&q);
        if solution.status != Status::Solved || solution.basis == self.now.active {
            return Ok(Vec::new());
        }
        let changed = matrices.x_next(&self.z, &solution.lambda);
        let moved = changed.iter().zip(&self.out[..n]);
        Ok(moved.map(|(a, b)| unseen / short * (a - b)).collect())
    }

    /// What devices carry past their zeros in the attempted second half, of length `half`: a change of x, empty where none does.
    pub(super) fn past_zero(&self, half: f64) -> Vec<f64> {
        let mut change = Vec::new();
        let gammas = self.gammas().into_iter();
        let falling = gammas.flat_map(|gammas| self.falling(half, gammas));
        let carries = falling.filter(|(j, [now, ..])| self.now.active[*j] && *now >= 0.0);
        for (j, [_, end, slope]) in carries {
            change.resize(self.now.x.len(), 0.0);
            let area = 0.5 * end * end / slope;
            let column = self.system().lcs.b.column(j);
            for (change, b) in change.iter_mut().zip(column.iter()) {
                *change += b * area;
            }
        }
        change
    }
}
