//! λ at an instant on curved laws, where the state jumped or a run begins.
//!
//! A junction behind an inductor without current has no voltage, and after the shortest step the logarithm of what came to flow in it: any step
//! tells another λ. The laws tell it at the instant itself, y = C x + D λ + G u + F, where D alone couples the ports and often none: Newton's method
//! needs ports scaled by what their junctions conduct.

use super::Curved;
use crate::law::Law;
use crate::linalg::powers::power_of_two;
use crate::settings::tolerances::steps::{SOLVED, STAGE_ROUNDING};
use crate::solve::newton::Newton;

impl Curved {
    /// λ on the laws at x and u, near a λ and y that a step has read, or from nothing; `None` beside ideal ports, whose λ is not theirs alone, and where
    /// Newton's method finds none.
    pub(crate) fn at_instant(
        &self,
        x: &[f64],
        u: &[f64],
        (lambda, y): (&[f64], &[f64]),
    ) -> Option<Vec<f64>> {
        if !self.ideal.is_empty() {
            return None;
        }
        let (mut scales, mut least) = (vec![1.0; self.m], 0.0_f64);
        for (j, port) in self.laws.iter().enumerate() {
            if let Law::Exponential(diode) = &port.law {
                let i = if port.current { lambda[j] } else { y[j] };
                let ohms = diode.rs + diode.slope / (diode.is + i.abs());
                let ratio = if port.current { ohms.recip() } else { ohms };
                scales[j] = power_of_two(ratio.sqrt());
                least = least.max(diode.slope / ohms.sqrt());
            }
        }
        let [.., d] = &self.system;
        let mut newton = Newton::near(d, &self.laws, &scales, least);
        let q: Vec<f64> = (0..self.m).map(|j| self.free(j, x, u)).collect();
        let nothing = vec![0.0; self.m];
        let guesses = [(lambda, y), (&nothing[..], &nothing[..])];
        guesses.into_iter().find_map(|(lambda, y)| {
            let (mut lambda, mut y) = (lambda.to_vec(), y.to_vec());
            let found = newton.solve(&q, &mut lambda, &mut y, (SOLVED, STAGE_ROUNDING));
            found.then_some(lambda)
        })
    }
}
