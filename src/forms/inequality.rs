//! The evolution variational inequality of the second kind (RR-7158 (17)) behind a Lur'e system.

use std::rc::Rc;

use nalgebra::{DMatrix, DVector};

use super::lure::{Lure, Phi};
use super::sweeping::square_root;
use super::{FormError, Linear, require};
use crate::check::Feedthrough;
use crate::passivity::{System, gradient};
use crate::settings::tolerances::ranks::ENTRY;

/// ⟨X' − VAV⁻¹X − Λ(X) − Vf(t), v − X⟩ + Ξ(v) − Ξ(X) ≥ 0 for all v, with X = Vx, Ξ = Φ_I ∘ C_I V⁻¹ and the Lipschitz
/// operator Λ(X) = VB_II(D_II + ∂Φ_II^{*,−})⁻¹(−C_II V⁻¹X).
#[derive(Debug, Clone)]
pub struct VariationalInequality {
    /// The Lur'e system it comes from.
    pub lure: Lure,
    /// V, the square root of P with PB_I = C_Iᵀ (the identity where there are no ports I).
    pub v: DMatrix<f64>,
    /// V⁻¹.
    pub v_inverse: DMatrix<f64>,
    /// Ports with vanishing rows and columns of D.
    pub multivalued: Vec<usize>,
    /// The others.
    pub single: Vec<usize>,
    /// The system of the ports II alone.
    fed: Lure,
}

impl VariationalInequality {
    /// Section 3.1.1: W²B_I = C_Iᵀ (Assumption 2) and D_II ≻ 0 or, for complementary pairs, a P-matrix (Assumption 4 by
    /// Propositions 1 and 2).
    ///
    /// # Errors
    /// The assumption that fails.
    pub fn of(lure: &Lure, energy: Option<&DMatrix<f64>>) -> Result<Self, FormError> {
        const STATEMENT: &str = "RR-7158 Theorem 1";
        let system = &lure.linear.system;
        let n = system.n();
        let d = &system.d;
        let (multivalued, single): (Vec<usize>, Vec<usize>) = (0..d.nrows())
            .partition(|&j| d.row(j).amax().max(d.column(j).amax()) <= ENTRY * d.amax());
        let d_ii = d.select_rows(&single).select_columns(&single);
        let class = Feedthrough::of(&d_ii);
        let pairs = single.iter().all(|&j| lure.phi[j] == Phi::HalfLine);
        require(
            class.pd || pairs && class.p_matrix == Some(true),
            STATEMENT,
            "Assumption 4: D_II is neither positive definite nor a P-matrix with complementary pairs",
            if d_ii.is_empty() {
                0.0
            } else {
                (&d_ii + d_ii.transpose()).symmetric_eigenvalues().min()
            },
        )?;
        let b = system.b.select_columns(&multivalued);
        let c = system.c.select_rows(&multivalued);
        let p = if multivalued.is_empty() {
            DMatrix::identity(n, n)
        } else {
            gradient::storage(&b, &c, energy).ok_or_else(|| FormError::Hypothesis {
                statement: STATEMENT,
                condition: "Assumption 2: no W with W²B_I = C_Iᵀ",
                size: (&b - c.transpose()).amax(),
            })?
        };
        let (v, v_inverse) = square_root(&p).ok_or(FormError::Hypothesis {
            statement: STATEMENT,
            condition: "Assumption 2: W is singular",
            size: 0.0,
        })?;
        let fed = ports_alone(lure, &single)?;
        Ok(Self {
            lure: lure.clone(),
            fed,
            v,
            v_inverse,
            multivalued,
            single,
        })
    }

    /// λ_II = (D_II + ∂Φ_II^{*,−})⁻¹(−C_II x − f_II).
    ///
    /// # Errors
    /// [`FormError::Step`] if it was not found.
    pub fn lambda(&self, t: f64, x: &DVector<f64>) -> Result<DVector<f64>, FormError> {
        Ok(self.fed.ports(t, x)?.0)
    }

    /// VAV⁻¹X + Λ(X) + Ve(t).
    ///
    /// # Errors
    /// Those of [`VariationalInequality::lambda`].
    pub fn drift(&self, t: f64, big_x: &DVector<f64>) -> Result<DVector<f64>, FormError> {
        let system = &self.lure.linear.system;
        let x = &self.v_inverse * big_x;
        let b = system.b.select_columns(&self.single);
        Ok(&self.v * (&system.a * &x + b * self.lambda(t, &x)? + (self.lure.linear.e)(t)))
    }

    /// Ξ(X) = Φ_I(C_I V⁻¹X + f_I), with points off the domain by less than `tolerance` moved onto it.
    #[must_use]
    pub fn xi(&self, t: f64, big_x: &DVector<f64>, tolerance: f64) -> f64 {
        let system = &self.lure.linear.system;
        let y = &system.c * (&self.v_inverse * big_x) + (self.lure.linear.f)(t);
        self.multivalued
            .iter()
            .map(|&j| {
                let at = y[j];
                [at, at + tolerance, at - tolerance]
                    .into_iter()
                    .map(|v| self.lure.phi[j].value(v))
                    .find(|v| v.is_finite())
                    .unwrap_or(f64::INFINITY)
            })
            .sum()
    }

    /// The left-hand side of (17) for a test point v: nonnegative along solutions.
    ///
    /// # Errors
    /// Those of [`VariationalInequality::lambda`].
    pub fn left_side(
        &self,
        t: f64,
        big_x: &DVector<f64>,
        velocity: &DVector<f64>,
        v: &DVector<f64>,
        tolerance: f64,
    ) -> Result<f64, FormError> {
        let force = velocity - self.drift(t, big_x)?;
        Ok(force.dot(&(v - big_x)) + self.xi(t, v, 0.0) - self.xi(t, big_x, tolerance))
    }
}

/// (A, B_II, C_II, D_II) with the laws of those ports.
fn ports_alone(lure: &Lure, ports: &[usize]) -> Result<Lure, FormError> {
    let (system, f) = (&lure.linear.system, lure.linear.f.clone());
    let chosen = ports.to_vec();
    let linear = Linear::new(
        System {
            a: system.a.clone(),
            b: system.b.select_columns(ports),
            c: system.c.select_rows(ports),
            d: system.d.select_rows(ports).select_columns(ports),
        },
        lure.linear.e.clone(),
        Rc::new(move |t| f(t).select_rows(&chosen)),
    )?;
    Lure::new(linear, ports.iter().map(|&j| lure.phi[j]).collect())
}
