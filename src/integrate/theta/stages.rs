//! Steps of circuits with curved laws: a diagonally implicit Runge–Kutta method whose stages are Moreau steps.
//!
//! ```text
//! X_j = B_j + γh f(X_j),      B_j = x + Σ_{k<j} (a_jk/γ) (X_k − B_k),      x⁺ = X_s
//! ```
//!
//! Every stage is an implicit Euler step of the same length γh, so one factorisation serves all, every stage is the monotone
//! problem of a Moreau step, and laws and constraints hold at the end of the step (the method is stiffly accurate). R. Alexander,
//! "Diagonally implicit Runge–Kutta methods for stiff ODEs", SIAM J. Numer. Anal. 14, 1977: three stages, order 3, L-stable.

use super::attempt::unsolved;
use super::*;
use crate::integrate::energy::StageLoss;
use crate::settings::tolerances::steps::{STAGE_ROUNDING, SUDDEN};

/// The coefficients of a method.
#[derive(Debug)]
pub(super) struct Tableau {
    /// Order for smooth solutions.
    pub(super) order: i32,
    /// The diagonal.
    gamma: f64,
    /// a_jk for k < j, row by row.
    lower: &'static [&'static [f64]],
    /// h P'(0) of the polynomial P' through the slopes at the stages, as a sum of the h f(X_j).
    pub(super) at_start: &'static [f64],
}

/// Moreau's scheme.
pub(super) static EULER: Tableau = Tableau {
    order: 1,
    gamma: 1.0,
    lower: &[&[]],
    at_start: &[1.0],
};

/// Alexander's method; γ is the root of γ³ − 3γ² + 3γ/2 = 1/6 near 0.436.
static ALEXANDER: Tableau = Tableau {
    order: 3,
    gamma: GAMMA,
    lower: &[&[], &[0.5 * (1.0 - GAMMA)], &[B1, B2]],
    // Lagrange's weights at 0 of the nodes γ, (1 + γ)/2 and 1.
    at_start: &[
        (1.0 + GAMMA) / ((1.0 - GAMMA) * (1.0 - GAMMA)),
        -4.0 * GAMMA / ((1.0 - GAMMA) * (1.0 - GAMMA)),
        GAMMA * (1.0 + GAMMA) / ((1.0 - GAMMA) * (1.0 - GAMMA)),
    ],
};
const B1: f64 = -0.25 * (6.0 * GAMMA * GAMMA - 16.0 * GAMMA + 1.0);
const B2: f64 = 0.25 * (6.0 * GAMMA * GAMMA - 20.0 * GAMMA + 5.0);
const GAMMA: f64 = 0.435_866_521_508_459;

impl Tableau {
    /// Where the first stage is, as a part of the step.
    pub(super) fn first(&self) -> f64 {
        self.gamma
    }

    /// The method for a system: `None` where all laws consist of straight pieces and the (θ, γ) step serves.
    pub(super) fn of(system: &System, scheme: Scheme) -> Option<&'static Self> {
        system.curved.then_some(match scheme {
            Scheme::MOREAU => &EULER,
            _ => &ALEXANDER,
        })
    }
}

impl Theta {
    /// Computes the step from now to t1 = now + h into `out` without committing it. After an edge or a jump one of Moreau's takes its place
    /// where a motion ends within the step: a stage of Alexander's starts far beyond where the ones before it came to, and a junction
    /// that clamped the motion in these does not hold it there. Two such steps agree, so that error control would not see it.
    pub(super) fn attempt_stages(
        &mut self,
        tableau: &'static Tableau,
        h: f64,
        t1: f64,
    ) -> Result<(), Error> {
        let slopes = self.attempt_tableau(tableau, h, t1)?;
        if self.now.settle && self.ends_suddenly(&slopes) {
            self.attempt_tableau(&EULER, h, t1)?;
        }
        Ok(())
    }

    /// Whether a state moves in the first stage of a step, by more than is granted, and much less in the last.
    fn ends_suddenly(&self, slopes: &[DVector<f64>]) -> bool {
        let [first, .., last] = slopes else {
            return false;
        };
        let granted = if self.control.is_some() {
            SUDDEN * self.settings.tol
        } else {
            SUDDEN
        };
        let lcs = &self.system().lcs;
        let mut moved = self.now.x.clone();
        (0..moved.len()).any(|k| {
            if last[k].abs() >= SUDDEN * first[k].abs() {
                return false;
            }
            moved[k] += first[k];
            let size = self.amplitudes.error(lcs, &self.now.x, &moved);
            moved[k] = self.now.x[k];
            size > granted
        })
    }

    /// The step by one method; the h f(X_j) of its stages.
    pub(super) fn attempt_tableau(
        &mut self,
        tableau: &'static Tableau,
        h: f64,
        t1: f64,
    ) -> Result<Vec<DVector<f64>>, Error> {
        let tolerance = self.settings.lcp_residual;
        let (t0, n) = (self.now.t, self.now.x.len());
        let slack = Self::slack(t1);
        let system = &mut self.plant.systems[self.now.system].1;
        let (step, new) = system
            .matrices(tableau.gamma * h, slack, Scheme::MOREAU, tolerance)
            .map_err(|reason| Error::at(t0, reason))?;
        self.stats.factorisations += u64::from(new);
        self.inputs.left(t1, &mut self.u_next);
        for (du, (a, b)) in self.du.iter_mut().zip(self.u_next.iter().zip(&self.now.u)) {
            *du = (a - b) / h;
        }
        let count = tableau.lower.len();
        // (X_k − B_k)/γ = h f(X_k).
        let mut slopes: Vec<DVector<f64>> = Vec::with_capacity(count);
        let (mut work, mut loss) = ((0.0, 0.0), StageLoss::default());
        let (mut last, mut residual) = (None, f64::EPSILON);
        let last_row = tableau.lower[count - 1];
        for (j, row) in tableau.lower.iter().enumerate() {
            let mut base = DVector::from_column_slice(&self.now.x);
            for (a, slope) in row.iter().zip(&slopes) {
                base.axpy(*a, slope, 1.0);
            }
            let c: f64 = row.iter().sum::<f64>() + tableau.gamma;
            let at_end = j + 1 == count;
            self.inputs
                .left(if at_end { t1 } else { t0 + c * h }, &mut self.u_next);
            let system = &mut self.plant.systems[self.now.system].1;
            system
                .columns
                .fill(base.as_slice(), &self.u_next, &self.now.u, &mut self.z);
            let matrices = system.step_mut(step);
            let q = matrices.q(&self.z);
            matrices.driver.suggest(&self.now.active);
            matrices.driver.suggest_point(&self.lambda, &self.y);
            let solution = if self.scouts {
                let near = matrices.driver.solve_near(&q);
                near.ok_or_else(|| Error::at(t0, Reason::Interrupted))?
            } else {
                matrices.driver.solve(&q)
            };
            self.stats.lcp_solves += 1;
            let x = matrices.x_next(&self.z, &solution.lambda);
            if x.iter().any(|v| !v.is_finite()) {
                return Err(Error::at(t0, Reason::Overflow));
            }
            if let Some(error) = unsolved(&solution, &system.lcs, t0, tolerance) {
                return Err(error);
            }
            self.lambda.copy_from_slice(solution.lambda.as_slice());
            self.y.copy_from_slice(solution.y.as_slice());
            self.worst_residual = self.worst_residual.max(solution.residual);
            residual = solution.residual.max(residual);
            if at_end {
                let sizes = system.step(step).x_sizes(&self.z, &solution.lambda);
                self.rounding
                    .copy_from_slice((sizes * STAGE_ROUNDING).as_slice());
            }
            let weight = last_row.get(j).copied().unwrap_or(tableau.gamma);
            let at = Point {
                x: x.as_slice(),
                lambda: &self.lambda,
                u: &self.u_next,
                du: &self.du,
            };
            let (source, dissipated) = energy::power(&system.lcs, at);
            work.0 += weight * h * source;
            work.1 += weight * h * dissipated;
            let slope = (&x - base) / tableau.gamma;
            loss.stage(&system.lcs, weight, at, &slope, h);
            slopes.push(slope);
            last = Some((x, solution));
        }
        let Some((x, solution)) = last else {
            return Ok(slopes);
        };
        let unseen = if self.control.is_some() {
            let matrices = self.system().step(step);
            self.unseen(tableau, h, &slopes, |change| {
                let carried = matrices.carried(change, &solution.lambda, &solution.y);
                carried.unwrap_or_else(|| change.clone())
            })
        } else {
            Vec::new()
        };
        let slope = slopes.last().map(|s| s.iter().map(|s| s / h).collect());
        let loss = loss.of_step(
            &self.system().lcs,
            (&self.now.x, &self.now.u),
            (x.as_slice(), &self.u_next),
        );
        self.out[..n].copy_from_slice(x.as_slice());
        for (out, (&on, (&lambda, &y))) in self.out[n..]
            .iter_mut()
            .zip((solution.basis.iter()).zip(solution.lambda.iter().zip(solution.y.iter())))
        {
            *out = if on { lambda } else { y };
        }
        self.attempt = Attempt {
            step,
            h,
            solved: Some((solution.basis, solution.active)),
            residual,
            work: Some((work, loss)),
            slope: slope.unwrap_or_default(),
            unseen,
            ..Attempt::default()
        };
        Ok(slopes)
    }
}
