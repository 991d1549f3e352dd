//! Slopes that swing from step to step at a state that rests.
//!
//! A current into two junctions that both block is 0 at any voltage between them, and its slope f is what the last stage needed to bring it there.
//! The next step starts with f₁ = f, and its stages take h f₁ back, until none of it is left, as the method is L-stable: f₆ = 0 f₁. But where a stage wants a
//! voltage for that beyond those of the junctions, one of them conducts and X moves: f₆ has then the size of f₁ and the other sign, step after step,
//! and the embedded method tells an error however short the steps are.
//!
//! Euler's backward method knows nothing of f₁:
//!
//! ```text
//! f = (X − x) / g,      X = x + g f(X, t + g),      g = γh
//! ```

use super::Curved;
use super::tableau::{GAMMA, IN_TIME, STAGES, WEIGHTS};
use super::trial::{Start, Trial};
use crate::integrate::inputs::Inputs;
use crate::settings::tolerances::steps::{GOES_NOWHERE, SOLVED};

/// Changes of sign from stage to stage that no smooth slope has within one step.
const SWINGS: usize = 3;

impl Trial {
    /// Whether a state's slope swings between the stages while the state goes nowhere.
    fn swings(&self, state: usize) -> bool {
        let slope = |stage: usize| self.slopes[stage * self.n + state];
        let largest = (0..STAGES).fold(0.0_f64, |most, stage| most.max(slope(stage).abs()));
        let mean: f64 = (0..STAGES).map(|stage| WEIGHTS[stage] * slope(stage)).sum();
        let changes = IN_TIME
            .windows(2)
            .filter(|pair| slope(pair[0]) * slope(pair[1]) < 0.0);
        mean.abs() < GOES_NOWHERE * largest && changes.count() >= SWINGS
    }

    /// Where slopes swing in this step, whose end is `start`, the next one starts with those of Euler's method; λ and y stay those of `start`, to whose
    /// state they belong. Ideal ports are on the sides `held`, and the stage is solved to `granted`; where Newton's method does not find it nothing changes.
    pub(crate) fn calm(
        &mut self,
        curved: &mut Curved,
        inputs: &Inputs,
        start: &mut Start,
        (held, granted): (Option<&[bool]>, f64),
    ) {
        if !(0..self.n).any(|state| self.swings(state)) {
            return;
        }
        let (at, g) = (self.matrices, GAMMA * self.h);
        inputs.varying_at(start.t + g, &mut self.pieces, &mut self.u);
        self.right.copy_from_slice(&start.x);
        curved.prepare(at, &mut self.right, &self.u, &mut self.x, &mut self.q);
        let (lambda, y) = (&mut self.guess.0, &mut self.guess.1);
        lambda.copy_from_slice(&start.lambda);
        y.copy_from_slice(&start.y);
        self.solves += 1;
        let newton = curved.newton(at);
        newton.hold(held);
        if !newton.solve(&self.q, lambda, y, (SOLVED.min(granted), granted)) {
            return;
        }
        curved.respond(at, lambda, &mut self.x);
        for state in (0..self.n).filter(|&state| self.swings(state)) {
            start.slope[state] = (self.x[state] - start.x[state]) / g;
        }
    }
}
