//! Time constants over the modes: eigenvalues of the linear system that is left when devices conduct or block.

use nalgebra::DMatrix;

use crate::passivity::{System, scale, witness};
use crate::settings::tolerances::ranks::EIGENVALUE;
use crate::settings::tolerances::ranks::RANK;

/// Ports up to which all 2ᵐ modes are looked at; beyond it: all blocking, all conducting, and one at a time.
const ALL_MODES: usize = 8;

/// Largest n³·modes that is spent, and largest n at all.
const WORK: usize = 3_000_000_000;
const LARGEST: usize = 300;

/// Shortest and longest time constant 1/|s| over the modes looked at.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Stiffness {
    /// s; `null` if there is no finite one.
    pub fastest_s: Option<f64>,
    /// s.
    pub slowest_s: Option<f64>,
    /// How many modes were looked at.
    pub modes: usize,
}

/// The time constants of a system, over all modes or a bounded set of them.
pub(super) fn over_modes(system: &System) -> Stiffness {
    let (n, m) = (system.n(), system.m());
    let cost = n * n * n + 1;
    let sets: Vec<Vec<usize>> = if n > LARGEST {
        Vec::new()
    } else if m <= ALL_MODES && cost << m <= WORK {
        (0..1_usize << m)
            .map(|mask| (0..m).filter(|j| mask >> j & 1 == 1).collect())
            .collect()
    } else {
        let ends = [Vec::new(), (0..m).collect()];
        let singles = if cost * m <= WORK { m } else { 0 };
        ends.into_iter()
            .chain((0..singles).map(|j| vec![j]))
            .collect()
    };
    let balanced = scale::balance(system);
    let mut range: Option<(f64, f64)> = None;
    for set in &sets {
        let Some(rates) = mode(&balanced.system, set) else {
            continue;
        };
        let top = rates.iter().copied().fold(0.0, f64::max);
        for rate in rates.into_iter().filter(|&r| r > EIGENVALUE * top) {
            let rate = rate * balanced.omega;
            let (low, high) = range.unwrap_or((rate, rate));
            range = Some((low.min(rate), high.max(rate)));
        }
    }
    Stiffness {
        fastest_s: range.map(|r| 1.0 / r.1),
        slowest_s: range.map(|r| 1.0 / r.0),
        modes: sets.len(),
    }
}

/// |s| of x' = Ax + Bλ, 0 = C_α x + D_αα λ_α, λ = 0 elsewhere, by index reduction in orthonormal coordinates. `None` where
/// λ is not determined in a way that moves x (the mode does not exist).
fn mode(system: &System, on: &[usize]) -> Option<Vec<f64>> {
    let mut a = system.a.clone();
    let mut b = system.b.select_columns(on);
    let mut c = system.c.select_rows(on);
    let mut d = system.d.select_rows(on).select_columns(on);
    for _ in 0..=system.n() {
        // λ = V₁α + V₂β with D = U₁ΣV₁ᵀ: α is determined, β is free, U₂ᵀCx = 0 is a constraint.
        let parts = scale::split(&d, RANK);
        let sigma = DMatrix::from_diagonal(&parts.values.map(f64::recip));
        let feedback = &b * &parts.row_space * sigma * parts.range.transpose();
        a -= feedback * &c;
        b *= &parts.kernel;
        c = parts.left_kernel.transpose() * &c;
        let constraint = scale::split(&c, RANK);
        if constraint.values.is_empty() {
            return (b.amax() <= RANK)
                .then(|| witness::eigenvalues(&a).iter().map(|s| s.norm()).collect());
        }
        // Independent constraints only; their derivative joins the next round.
        let rows = constraint.row_space.transpose();
        let stay = &constraint.kernel;
        d = &rows * &b;
        c = &rows * &a * stay;
        b = stay.transpose() * &b;
        a = stay.transpose() * &a * stay;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::dmatrix;

    #[test]
    fn a_clamped_capacitor_has_no_time_constant_and_a_free_one_has_rc() {
        // C x' = −x/R + λ, y = x: blocking (λ = 0) decays with RC, conducting (x = 0) has nothing left.
        let (r, c) = (1e3, 1e-6);
        let system = System {
            a: dmatrix![-1.0 / (r * c)],
            b: dmatrix![1.0 / c],
            c: dmatrix![1.0],
            d: dmatrix![0.0],
        };
        let found = over_modes(&system);
        assert_eq!(found.modes, 2);
        assert!((found.fastest_s.unwrap() / (r * c) - 1.0).abs() < 1e-12);
        assert!((found.slowest_s.unwrap() / (r * c) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn index_two_modes_are_reduced() {
        // L i' = v + …: x = (v_C, i_L), the port forces v_C = 0 through a current: i stays, v is fixed.
        let system = System {
            a: dmatrix![0.0, -1.0; 1.0, -3.0],
            b: dmatrix![1.0; 0.0],
            c: dmatrix![1.0, 0.0],
            d: dmatrix![0.0],
        };
        assert_eq!(mode(&system, &[0]).map(|r| r.len()), Some(1));
        assert!((mode(&system, &[0]).unwrap()[0] - 3.0).abs() < 1e-12);
    }
}
