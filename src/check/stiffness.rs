//! Time constants and condition numbers over the modes: of the linear system that is left when devices conduct or block.

use nalgebra::{DMatrix, DVector};

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

/// How many digits a solution in floating point may lose, in units in which the system is balanced, at worst over the modes looked at: a relative
/// error of the entries comes out κ times as large (G. H. Golub, C. F. Van Loan 2013, section 2.6.2).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Conditioning {
    /// κ₂ of what a mode solves for λ: D and the constraints of its conducting devices, without their kernels; 1 where nothing is solved.
    pub feedthrough: f64,
    /// log₁₀ of it.
    pub digits: f64,
    /// log₁₀ of the longest time constant over the shortest of one mode: digits that a mode's slowest motion may lose where its
    /// stiffness does not come from the sizes of elements alone.
    pub slowest_digits: f64,
}

impl std::fmt::Display for Conditioning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "κ = {:.1e} where a mode solves for λ: {:.1} digits at worst; {:.1} of its slowest motion",
            self.feedthrough, self.digits, self.slowest_digits
        )
    }
}

/// What is left in one mode.
struct Mode {
    /// |s|.
    rates: Vec<f64>,
    /// κ₂ of what is solved for λ.
    condition: f64,
}

/// The time constants and condition numbers of a system, over all modes or a bounded set of them.
pub(super) fn over_modes(system: &System) -> (Stiffness, Conditioning) {
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
    let (mut feedthrough, mut spread): (f64, f64) = (1.0, 1.0);
    for set in &sets {
        let Some(Mode { rates, condition }) = mode(&balanced.system, set) else {
            continue;
        };
        feedthrough = feedthrough.max(condition);
        let top = rates.iter().copied().fold(0.0, f64::max);
        for rate in rates.into_iter().filter(|&r| r > EIGENVALUE * top) {
            spread = spread.max(top / rate);
            let rate = rate * balanced.omega;
            let (low, high) = range.unwrap_or((rate, rate));
            range = Some((low.min(rate), high.max(rate)));
        }
    }
    let stiffness = Stiffness {
        fastest_s: range.map(|r| 1.0 / r.1),
        slowest_s: range.map(|r| 1.0 / r.0),
        modes: sets.len(),
    };
    let conditioning = Conditioning {
        feedthrough,
        digits: feedthrough.log10(),
        slowest_digits: spread.log10(),
    };
    (stiffness, conditioning)
}

/// |s| and condition of x' = Ax + Bλ, 0 = C_α x + D_αα λ_α, λ = 0 elsewhere, by index reduction in orthonormal coordinates. `None` where
/// λ is not determined in a way that moves x (the mode does not exist).
fn mode(system: &System, on: &[usize]) -> Option<Mode> {
    let mut condition: f64 = 1.0;
    let mut a = system.a.clone();
    let mut b = system.b.select_columns(on);
    let mut c = system.c.select_rows(on);
    let mut d = system.d.select_rows(on).select_columns(on);
    for _ in 0..=system.n() {
        // λ = V₁α + V₂β with D = U₁ΣV₁ᵀ: α is determined, β is free, U₂ᵀCx = 0 is a constraint.
        let parts = scale::split(&d, RANK);
        condition = condition.max(spread_of(&parts.values));
        let sigma = DMatrix::from_diagonal(&parts.values.map(f64::recip));
        let feedback = &b * &parts.row_space * sigma * parts.range.transpose();
        a -= feedback * &c;
        b *= &parts.kernel;
        c = parts.left_kernel.transpose() * &c;
        let constraint = scale::split(&c, RANK);
        if constraint.values.is_empty() {
            return (b.amax() <= RANK).then(|| Mode {
                rates: witness::eigenvalues(&a).iter().map(|s| s.norm()).collect(),
                condition,
            });
        }
        condition = condition.max(spread_of(&constraint.values));
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

/// The largest singular value over the smallest.
fn spread_of(values: &DVector<f64>) -> f64 {
    if values.is_empty() {
        1.0
    } else {
        values.max() / values.min()
    }
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
        let (found, _) = over_modes(&system);
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
        let Some(Mode { rates, condition }) = mode(&system, &[0]) else {
            panic!("no mode")
        };
        assert_eq!((rates.len(), condition), (1, 1.0));
        assert!((rates[0] - 3.0).abs() < 1e-12);
    }

    /// Sizes of ports are taken out by balancing; of D = [[1, 1], [1, 1 + ε]], ε = 10⁻⁶, what is left is its condition, 4/ε.
    #[test]
    fn what_balancing_cannot_take_out_costs_digits() {
        let none = |r, c| DMatrix::zeros(r, c);
        let of = |d: DMatrix<f64>| {
            let (a, b, c) = (none(0, 0), none(0, 2), none(2, 0));
            over_modes(&System { a, b, c, d }).1
        };
        let graded = of(dmatrix![1.0 + 1e-8, 1e-8; 1e-8, 1e-4 + 1e-8]);
        assert!(graded.feedthrough < 10.0, "{graded:?}");
        let near = of(dmatrix![1.0, 1.0; 1.0, 1.0 + 1e-6]);
        assert!((near.digits - 4e6_f64.log10()).abs() < 0.01, "{near:?}");
        assert_eq!(near.slowest_digits, 0.0);
    }
}
