//! λ at an instant on curved laws, where the state jumped or a run begins.
//!
//! A junction behind an inductor without current has no voltage, and after the shortest step the logarithm of what came to flow in it: any step
//! tells another λ. The laws tell it at the instant itself, y = C x + D λ + G u + F, where D alone couples the ports and often none: Newton's method
//! needs ports scaled by what their junctions conduct.

use super::Curved;
use crate::law::Law;
use crate::linalg::powers::power_of_two;
use crate::settings::tolerances::steps::{SOLVED, STAGE_ROUNDING};
use crate::solve::PortLaw;
use crate::solve::newton::Newton;

impl Curved {
    /// λ on the laws at x and u, near a λ and y that a step has read, or from nothing. Ideal ports keep the λ of the step. `None` where they would have to
    /// change, and where Newton's method finds none.
    pub(crate) fn at_instant(
        &self,
        x: &[f64],
        u: &[f64],
        (lambda, y): (&[f64], &[f64]),
    ) -> Option<Vec<f64>> {
        let [.., d] = &self.system;
        let ideal = |j: &usize| self.ideal.contains(j);
        let lawful: Vec<usize> = (0..self.m).filter(|j| !ideal(j)).collect();
        let (mut scales, mut least) = (vec![1.0; lawful.len()], 0.0_f64);
        for (scale, &j) in scales.iter_mut().zip(&lawful) {
            let port = &self.laws[j];
            if let Law::Exponential(diode) = &port.law {
                let i = if port.current { lambda[j] } else { y[j] };
                let ohms = diode.rs + diode.slope / (diode.is + i.abs());
                let ratio = if port.current { ohms.recip() } else { ohms };
                *scale = power_of_two(ratio.sqrt());
                least = least.max(diode.slope / ohms.sqrt());
            }
        }
        let laws: Vec<PortLaw> = lawful.iter().map(|&j| self.laws[j].clone()).collect();
        let within = d.select_rows(&lawful).select_columns(&lawful);
        let mut newton = Newton::near(&within, &laws, &scales, least);
        let held = |j: usize| {
            self.ideal
                .iter()
                .map(|&i| d[(j, i)] * lambda[i])
                .sum::<f64>()
        };
        let q: Vec<f64> = (lawful.iter())
            .map(|&j| self.free(j, x, u) + held(j))
            .collect();
        let of_step = |values: &[f64]| lawful.iter().map(|&j| values[j]).collect::<Vec<f64>>();
        let nothing = vec![0.0; lawful.len()];
        let guesses = [(of_step(lambda), of_step(y)), (nothing.clone(), nothing)];
        let found = guesses.into_iter().find_map(|(mut lambda, mut y)| {
            let found = newton.solve(&q, &mut lambda, &mut y, (SOLVED, STAGE_ROUNDING));
            found.then_some(lambda)
        })?;
        let mut told = lambda.to_vec();
        for (&j, found) in lawful.iter().zip(found) {
            told[j] = found;
        }
        let keeps = |&i: &usize| {
            let moved: f64 = (lawful.iter())
                .map(|&j| d[(i, j)] * (told[j] - lambda[j]))
                .sum();
            moved == 0.0 || lambda[i] == 0.0 && y[i] + moved >= 0.0
        };
        self.ideal.iter().all(keeps).then_some(told)
    }
}
