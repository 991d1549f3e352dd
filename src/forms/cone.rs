//! The cone complementarity system of Brogliato-Thibault Lemma 3.8.

use nalgebra::{DMatrix, DVector};

use super::{FormError, Linear, require};
use crate::settings::tolerances::theorems::FACTORED;

/// x' = Ax + e + BW⁻¹ζ̄, C_{W⁻¹} ∋ ζ̄ ⟂ w̄ = V⁻¹(Cx + f) + D̄ζ̄ ∈ C_V with V = Wᵀ, D = VD̄W, D̄ = diag(D₁, 0).
#[derive(Debug, Clone)]
pub struct ConeComplementarity {
    /// The linear complementarity system it stands for.
    pub linear: Linear,
    /// V, m×m.
    pub v: DMatrix<f64>,
    /// V⁻¹.
    pub v_inverse: DMatrix<f64>,
    /// D̄, m×m; zero outside its leading q×q block.
    pub d_bar: DMatrix<f64>,
    /// q = rank D.
    pub rank: usize,
}

impl ConeComplementarity {
    /// Lemma 3.8 with a given V.
    ///
    /// # Errors
    /// V is singular, or D̄ = V⁻¹DV⁻ᵀ is not of the form diag(D₁, 0) with D₁ of the rank of D.
    pub fn with(linear: &Linear, v: &DMatrix<f64>) -> Result<Self, FormError> {
        const STATEMENT: &str = "Brogliato-Thibault Lemma 3.8";
        let m = linear.system.m();
        if v.shape() != (m, m) {
            return Err(FormError::Shape {
                what: "V",
                rows: v.nrows(),
                columns: v.ncols(),
            });
        }
        let v_inverse = v.clone().try_inverse().ok_or(FormError::Hypothesis {
            statement: STATEMENT,
            condition: "V is singular",
            size: v.determinant(),
        })?;
        let mut d_bar = &v_inverse * &linear.system.d * v_inverse.transpose();
        let terms = v_inverse.abs() * linear.system.d.abs() * v_inverse.abs().transpose();
        let zero =
            |i: usize, j: usize, d: &DMatrix<f64>| d[(i, j)].abs() <= FACTORED * terms[(i, j)];
        let rank = (0..m)
            .filter(|&k| !(0..m).all(|i| zero(i, k, &d_bar) && zero(k, i, &d_bar)))
            .count();
        let mut outside = 0.0_f64;
        for i in 0..m {
            for j in 0..m {
                if i >= rank || j >= rank {
                    if !zero(i, j, &d_bar) {
                        outside = outside.max(d_bar[(i, j)].abs());
                    }
                    d_bar[(i, j)] = 0.0;
                }
            }
        }
        require(
            outside == 0.0,
            STATEMENT,
            "V⁻¹DV⁻ᵀ is not diag(D₁, 0)",
            outside,
        )?;
        let d1 = d_bar.view((0, 0), (rank, rank)).into_owned();
        require(
            rank == 0 || d1.is_invertible(),
            STATEMENT,
            "D₁ is singular",
            if rank == 0 { 0.0 } else { d1.determinant() },
        )?;
        Ok(Self {
            linear: linear.clone(),
            v: v.clone(),
            v_inverse,
            d_bar,
            rank,
        })
    }

    /// Lemma 3.8 for D whose kernel is that of Dᵀ (symmetric, skew, or any D ⪰ 0): V is orthogonal, its first columns span
    /// the range of D.
    ///
    /// # Errors
    /// ker D ≠ ker Dᵀ.
    pub fn orthogonal(linear: &Linear) -> Result<Self, FormError> {
        let parts = crate::passivity::scale::split(&linear.system.d, 0.0);
        let (m, rank) = (linear.system.m(), parts.values.len());
        let mut v = DMatrix::zeros(m, m);
        v.columns_mut(0, rank).copy_from(&parts.range);
        v.columns_mut(rank, m - rank).copy_from(&parts.left_kernel);
        let mismatch = (&linear.system.d * &parts.left_kernel).amax();
        require(
            mismatch <= FACTORED * linear.system.d.amax(),
            "Brogliato-Thibault Lemma 3.8",
            "ker D differs from ker Dᵀ, no orthogonal V",
            mismatch,
        )?;
        // Rounding outside the block is removed with the factor itself.
        let mut cleaned = linear.clone();
        let d1 = parts.range.transpose() * &linear.system.d * &parts.range;
        cleaned.system.d = &parts.range * d1 * parts.range.transpose();
        let mut cone = Self::with(&cleaned, &v)?;
        cone.linear = linear.clone();
        Ok(cone)
    }

    /// ζ̄ = Wζ and w̄ = V⁻¹w.
    #[must_use]
    pub fn variables(&self, zeta: &DVector<f64>, w: &DVector<f64>) -> (DVector<f64>, DVector<f64>) {
        (self.v.transpose() * zeta, &self.v_inverse * w)
    }

    /// ζ = W⁻¹ζ̄ and w = Vw̄.
    #[must_use]
    pub fn original(
        &self,
        zeta_bar: &DVector<f64>,
        w_bar: &DVector<f64>,
    ) -> (DVector<f64>, DVector<f64>) {
        (self.v_inverse.transpose() * zeta_bar, &self.v * w_bar)
    }

    /// By how much (x, ζ̄, w̄) violates (31) at t: the equation, membership in the cones, orthogonality.
    #[must_use]
    pub fn violation(
        &self,
        t: f64,
        x: &DVector<f64>,
        zeta_bar: &DVector<f64>,
        w_bar: &DVector<f64>,
    ) -> f64 {
        let equation = &self.v_inverse * (&self.linear.system.c * x + (self.linear.f)(t))
            + &self.d_bar * zeta_bar
            - w_bar;
        let (zeta, w) = self.original(zeta_bar, w_bar);
        let outside = |v: &DVector<f64>| v.iter().map(|v| (-v).max(0.0)).fold(0.0, f64::max);
        equation
            .amax()
            .max(outside(&zeta))
            .max(outside(&w))
            .max(zeta_bar.dot(w_bar).abs())
    }
}
