//! All index sets, one after the other: slow, simple, and therefore the oracle of the tests.

use nalgebra::DVector;

use super::active::ActiveSolve;
use super::lcp::{Lcp, Scaling};

/// Largest m for which enumeration is offered (2^m index sets).
pub const LARGEST: usize = 16;

/// Every solution that some index set gives (least-norm where M_aa is singular), without repetitions, in the order of the
/// sets read as binary numbers. `tolerance` bounds the scaled residual. Empty for m > [`LARGEST`].
#[must_use]
pub fn solve(lcp: &Lcp, tolerance: f64) -> Vec<DVector<f64>> {
    let size = lcp.size();
    if size > LARGEST {
        return Vec::new();
    }
    let scaling = Scaling::of(&lcp.m);
    let scaled = scaling.apply(lcp);
    let mut found: Vec<DVector<f64>> = Vec::new();
    for bits in 0..1_u32 << size {
        let set: Vec<bool> = (0..size).map(|j| bits >> j & 1 == 1).collect();
        let lambda = scaling.unscale(&ActiveSolve::new(&scaled.m, &set).refined(&scaled));
        let solves = scaling.residual(lcp, &lambda, &lcp.y(&lambda)) <= tolerance;
        let amplitude = lambda.amax().max(f64::MIN_POSITIVE);
        if solves
            && !found
                .iter()
                .any(|f| (f - &lambda).amax() <= 100.0 * tolerance * amplitude)
        {
            found.push(lambda);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{dmatrix, dvector};

    #[test]
    fn finds_all_three_solutions_of_a_nonmonotone_problem() {
        let lcp = Lcp {
            m: dmatrix![-1.0],
            q: dvector![1.0],
        };
        assert_eq!(solve(&lcp, 1e-12), [dvector![0.0], dvector![1.0]]);
        let none = Lcp {
            m: dmatrix![-1.0],
            q: dvector![-1.0],
        };
        assert!(solve(&none, 1e-12).is_empty());
    }
}
