//! Infeasibility of (45) by duality: a mixture of motions that no storage function can pay for.
//!
//! For pairs (x_k, v_k) with ẋ_k = Ax_k + Bv_k and y_k = Cx_k + Dv_k a storage function ½ xᵀPx would give
//! x_kᵀPẋ_k ≤ v_kᵀy_k for each, hence in sum
//!
//! ```text
//! ½⟨P, G⟩ ≤ σ,   G = Σ (x_k ẋ_kᵀ + ẋ_k x_kᵀ),   σ = Σ v_kᵀ y_k.
//! ```
//!
//! G ⪰ 0 and σ < 0 contradict every P ⪰ 0 at once. Σ (x_k, v_k)(x_k, v_k)ᵀ is a dual solution of the inequality; the barrier finds one
//! whenever its margin is negative, also where no single motion at one complex frequency gains energy.

use crate::settings::tolerances::passivity::ENTRIES;
use crate::settings::tolerances::ranks::RANK;
use nalgebra::DMatrix;

use super::{System, facial, scale};

/// Pairs (x_k, v_k) in the columns of two matrices.
#[derive(Debug, Clone, PartialEq)]
pub struct Mixture {
    /// n×r.
    pub states: DMatrix<f64>,
    /// m×r.
    pub inputs: DMatrix<f64>,
    /// σ.
    pub supply: f64,
}

impl Mixture {
    fn new(system: &System, states: DMatrix<f64>, inputs: DMatrix<f64>) -> Self {
        let y = &system.c * &states + &system.d * &inputs;
        Self {
            supply: inputs.dot(&y),
            states,
            inputs,
        }
    }

    /// G.
    fn growth(&self, system: &System) -> DMatrix<f64> {
        let rate = &system.a * &self.states + &system.b * &self.inputs;
        let half = rate * self.states.transpose();
        &half + half.transpose()
    }

    /// Whether G ≻ 0 and σ < 0 for this system and every system whose entries differ by rounding.
    pub(super) fn verify(&self, system: &System) -> bool {
        let (n, m) = (system.n(), system.m());
        if self.states.nrows() != n
            || self.inputs.shape() != (m, self.states.ncols())
            || !self
                .states
                .iter()
                .chain(&self.inputs)
                .all(|v| v.is_finite())
        {
            return false;
        }
        let magnitude = Self {
            states: self.states.abs(),
            inputs: self.inputs.abs(),
            supply: 0.0,
        };
        let sizes = System {
            a: system.a.abs(),
            b: system.b.abs(),
            c: system.c.abs(),
            d: system.d.abs(),
        };
        let terms = magnitude.growth(&sizes);
        let d = scale::equilibrate(&terms);
        let growth = scale::scaled(&self.growth(system), &d, &d);
        let error = ENTRIES * scale::scaled(&terms, &d, &d).norm();
        let grows = scale::eigen(&growth).0.iter().all(|&v| v > error);
        let spent = Self::new(&sizes, magnitude.states, magnitude.inputs).supply;
        let supply = Self::new(system, self.states.clone(), self.inputs.clone()).supply;
        grows && supply < -ENTRIES * spent
    }

    /// From the multiplier X of F = −WᵀQ(P)W ⪰ 0 on the solutions of PBN = CᵀN ([`facial::Face::kernel`]), of a balanced
    /// system.
    ///
    /// The multiplier Y of the equalities follows from what G must be: with BN = U₁ΣVᵀ, G = G₀ + BNYᵀ + Y(BN)ᵀ is given on the
    /// complement of U₁ and free elsewhere; it is made block diagonal there with τI, τ such that half of σ is left. The
    /// lossless inputs then take the least second moment that keeps the whole positive semidefinite, which supplies nothing.
    pub(super) fn of_dual(system: &System, dual: &DMatrix<f64>) -> Option<Self> {
        let n = system.n();
        let (null, rest) = facial::lossless(&system.d);
        let lower = scale::symmetric(dual).cholesky()?.l();
        let states = lower.rows(0, n).into_owned();
        let lossy = rest * lower.rows(n, lower.nrows() - n);
        let start = Self::new(system, states.clone(), lossy.clone());
        let given = start.growth(system);
        let reach = scale::split(&(&system.b * &null), RANK * system.b.amax());
        let (u1, u2) = (&reach.range, &reach.left_kernel);
        let free = u2 * u2.transpose() * &given * u2 * u2.transpose();
        let with = |tau: f64| -> Option<Self> {
            let wanted = &free + u1 * u1.transpose() * tau - &given;
            let half = &wanted * u1 - u1 * (u1.transpose() * &wanted * u1) * 0.5;
            // Y = half Σ⁻¹Vᵀ; the lossless rows of the factor are (Yᵀ 0) L⁻ᵀ.
            let y = half
                * DMatrix::from_diagonal(&reach.values.map(f64::recip))
                * reach.row_space.transpose();
            let mut padded = DMatrix::zeros(lower.nrows(), y.ncols());
            padded.rows_mut(0, n).copy_from(&y);
            let moments = lower.solve_lower_triangular(&padded)?.transpose();
            Some(Self::new(system, states.clone(), &lossy + &null * moments))
        };
        let zero = with(0.0)?;
        if u1.ncols() == 0 || zero.supply >= 0.0 {
            return Some(zero);
        }
        let slope = with(1.0)?.supply - zero.supply;
        if slope > 0.0 {
            with(-0.5 * zero.supply / slope)
        } else {
            with(1.0)
        }
    }
}
