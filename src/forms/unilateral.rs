//! The complementarity dynamical system and the two unilateral differential inclusions of RR-5107, on C = {h ≤ 0}:
//!
//! ```text
//! (CDS)   −x' = f(x) + g(t) + ∇h(x)λ,  0 ≥ h(x) ⟂ λ ≥ 0
//! (UDI-C) −x' ∈ f(x) + g(t) + N_C(x)           (UDI-T_C) −x' ∈ f(x) + g(t) + N_{T_C(x)}(x')
//! (PDS)    x' = proj_{T_C(x)}(−f(x) − g(t))
//! ```

use nalgebra::{DMatrix, DVector};

use super::projected::{Map, ProjectedSystem};
use super::{Complementarity, FormError, Polyhedron, Signal};

/// The data f, g, h of all four problems.
#[derive(Clone)]
pub struct Unilateral {
    /// f with K = {−h ≥ 0} as a projected system without g.
    inner: ProjectedSystem,
    /// g(t).
    g: Signal,
}

impl std::fmt::Debug for Unilateral {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Unilateral")
            .field("inner", &self.inner)
            .finish_non_exhaustive()
    }
}

impl Unilateral {
    /// From f, g and convex differentiable h on Rⁿ (C = {h ≤ 0}).
    ///
    /// # Errors
    /// [`FormError::Shape`].
    pub fn new(f: Map, g: Signal, h: &Map, n: usize) -> Result<Self, FormError> {
        let (value, jacobian) = (h.value.clone(), h.jacobian.clone());
        let set = Map {
            value: std::rc::Rc::new(move |x| -value(x)),
            jacobian: std::rc::Rc::new(move |x| -jacobian(x)),
            affine: h.affine,
        };
        if g(0.0).len() != n {
            return Err(FormError::Shape {
                what: "g",
                rows: g(0.0).len(),
                columns: 1,
            });
        }
        Ok(Self {
            inner: ProjectedSystem::new(f, set, n)?,
            g,
        })
    }

    /// v = −f(x) − g(t), the velocity that the constraint set sees.
    #[must_use]
    pub fn free_velocity(&self, t: f64, x: &DVector<f64>) -> DVector<f64> {
        -(self.inner.field.value)(x) - (self.g)(t)
    }

    /// T^h(x) = {d : ⟨∇h_i(x), d⟩ ≤ 0 for active i}; T_C(x) where a qualification condition holds (7).
    #[must_use]
    pub fn tangent(&self, x: &DVector<f64>) -> Polyhedron {
        self.inner.admissible(x)
    }

    /// (QC.3): the active gradients are linearly independent.
    ///
    /// # Errors
    /// [`FormError::Hypothesis`] with their smallest singular value.
    pub fn qualified(&self, x: &DVector<f64>) -> Result<(), FormError> {
        self.inner.qualified(x)
    }

    /// The right-hand side of (PDS): also the slow velocity, of least norm in −f − g − N_C(x) (Corollary 2).
    ///
    /// # Errors
    /// Those of the projection.
    pub fn slow_velocity(&self, t: f64, x: &DVector<f64>) -> Result<DVector<f64>, FormError> {
        Ok(self.inner.project_velocity(x, &self.free_velocity(t, x))?.0)
    }

    /// The distance of a velocity from the right-hand side of (UDI-C): from −f − g − N_C(x).
    ///
    /// # Errors
    /// Those of the projection.
    pub fn distance_to_inclusion(
        &self,
        t: f64,
        x: &DVector<f64>,
        velocity: &DVector<f64>,
    ) -> Result<f64, FormError> {
        self.tangent(x).distance_to_normal(
            &DVector::zeros(x.len()),
            &(self.free_velocity(t, x) - velocity),
        )
    }

    /// The distance of a velocity from fulfilling (UDI-T_C): v − x' ∈ N_{T_C(x)}(x'), x' ∈ T_C(x).
    ///
    /// # Errors
    /// Those of the projection.
    pub fn distance_to_tangent_inclusion(
        &self,
        t: f64,
        x: &DVector<f64>,
        velocity: &DVector<f64>,
    ) -> Result<f64, FormError> {
        let tangent = self.tangent(x);
        let outside = (tangent.project(velocity)?.0 - velocity).norm();
        let normal =
            tangent.distance_to_normal(velocity, &(self.free_velocity(t, x) - velocity))?;
        Ok(outside.max(normal))
    }

    /// λ of (CDS) for a velocity of (UDI-C): λ ≥ 0 on the active constraints with ∇h λ = v − x'.
    ///
    /// # Errors
    /// Those of the projection.
    pub fn multiplier(
        &self,
        t: f64,
        x: &DVector<f64>,
        velocity: &DVector<f64>,
    ) -> Result<DVector<f64>, FormError> {
        // The polar part of v − x' in Moreau's decomposition, with the multipliers that make it.
        let (_, mu) = self
            .tangent(x)
            .project(&(self.free_velocity(t, x) - velocity))?;
        Ok(mu)
    }
}

impl Complementarity for Unilateral {
    fn size(&self) -> (usize, usize) {
        self.inner.size()
    }

    fn drift(&self, t: f64, x: &DVector<f64>) -> DVector<f64> {
        self.free_velocity(t, x)
    }

    fn drift_jacobian(&self, t: f64, x: &DVector<f64>) -> DMatrix<f64> {
        self.inner.drift_jacobian(t, x)
    }

    fn input(&self, x: &DVector<f64>) -> DMatrix<f64> {
        self.inner.input(x)
    }

    fn constraint(&self, t: f64, x: &DVector<f64>) -> DVector<f64> {
        self.inner.constraint(t, x)
    }

    fn constraint_jacobian(&self, t: f64, x: &DVector<f64>) -> DMatrix<f64> {
        self.inner.constraint_jacobian(t, x)
    }

    fn feedthrough(&self) -> DMatrix<f64> {
        self.inner.feedthrough()
    }

    fn is_affine(&self) -> bool {
        self.inner.is_affine()
    }
}
