//! The complementarity dynamical system and the two unilateral differential inclusions of RR-5107, on C = {h ≤ 0}:
//!
//! ```text
//! (CDS)   −x' = f(x) + g(t) + ∇h(x)λ,  0 ≥ h(x) ⟂ λ ≥ 0
//! (UDI-C) −x' ∈ f(x) + g(t) + N_C(x)           (UDI-T_C) −x' ∈ f(x) + g(t) + N_{T_C(x)}(x')
//! (PDS)    x' = proj_{T_C(x)}(−f(x) − g(t))
//! ```

use nalgebra::{DMatrix, DVector};

use super::projected::{Map, ProjectedSystem};
use super::{Complementarity, FormError, Polyhedron, Signal, require};
use crate::check::program::{Inequalities, Point, minimise};

/// Linearisations of h after which the search for a Slater point ends.
const CUTS: usize = 60;

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

    /// (QC.1) at x, Mangasarian and Fromovitz: some d has ⟨∇h_i(x), d⟩ < 0 for all active i. Then T^h = T_C, N^h = N_C, and (CDS) is
    /// (UDI-C) (Proposition 3).
    ///
    /// # Errors
    /// [`FormError::Hypothesis`] with the greatest slack of such a d (gradients and d of size one).
    pub fn qualified(&self, x: &DVector<f64>) -> Result<(), FormError> {
        let inward = self.tangent(x);
        if inward.h.is_empty() {
            return Ok(());
        }
        let strict = vec![true; inward.h.len()];
        let point = Inequalities {
            g: inward.g,
            h: inward.h,
            strict,
        }
        .widest();
        require(
            point.as_ref().is_some_and(Point::is_strict),
            "RR-5107 Proposition 3",
            "(QC.1): no direction leads into all active constraints",
            point.map_or(0.0, |p| p.slack),
        )
    }

    /// The dual of (QC.1): the length of the shortest Σ λ_i ∇h_i(x) over the active i with λ ≥ 0, Σ λ_i = 1. (QC.2) holds where it is
    /// positive; infinite without active constraints.
    #[must_use]
    pub fn shortest_combination(&self, x: &DVector<f64>) -> f64 {
        let g = self.tangent(x).g;
        let k = g.nrows();
        if k == 0 {
            return f64::INFINITY;
        }
        let mut a = DMatrix::zeros(1 + k, k);
        a.row_mut(0).fill(1.0);
        a.view_mut((1, 0), (k, k)).fill_with_identity();
        let mut b = DVector::zeros(1 + k);
        b[0] = -1.0;
        let gram = &g * g.transpose();
        minimise(&gram, &DVector::zeros(k), &a, &b, 1)
            .map_or(0.0, |lambda| (g.transpose() * lambda).norm())
    }

    /// (QC.3) at x: the active gradients are linearly independent.
    ///
    /// # Errors
    /// [`FormError::Hypothesis`] with their smallest singular value.
    pub fn independent(&self, x: &DVector<f64>) -> Result<(), FormError> {
        self.inner.qualified(x)
    }

    /// (QC.4), Slater: a point with h < 0 for convex h, from linearisations at the points found so far (Kelley); `None` if they leave no
    /// room, or after 60 of them.
    #[must_use]
    pub fn slater(&self, near: &DVector<f64>) -> Option<DVector<f64>> {
        let (mut at, n) = (near.clone(), near.len());
        let (mut g, mut h) = (DMatrix::zeros(0, n), DVector::zeros(0));
        for _ in 0..CUTS {
            let (value, slope) = ((self.inner.set.value)(&at), (self.inner.set.jacobian)(&at));
            if value.iter().all(|&v| v > 0.0) {
                return Some(at);
            }
            let (rows, m) = (g.nrows(), slope.nrows());
            g = g.resize_vertically(rows + m, 0.0);
            h = h.resize_vertically(rows + m, 0.0);
            h.rows_mut(rows, m).copy_from(&(value - &slope * &at));
            g.rows_mut(rows, m).copy_from(&slope);
            let cuts = Inequalities {
                g: g.clone(),
                h: h.clone(),
                strict: vec![true; rows + m],
            };
            at = cuts.widest().filter(Point::is_strict)?.z;
        }
        None
    }

    /// The right-hand side of (PDS): also the slow velocity, of least norm in −f − g − N_C(x) (Corollary 2).
    ///
    /// # Errors
    /// Those of the projection.
    pub fn slow_velocity(&self, t: f64, x: &DVector<f64>) -> Result<DVector<f64>, FormError> {
        Ok(self.inner.project_velocity(x, &self.free_velocity(t, x))?.0)
    }

    /// The distance of a velocity from the right-hand side of (UDI-h), −f − g − N^h(x): of (UDI-C) where [`Self::qualified`].
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

    /// λᵀẇ = ⟨∇h(x)λ, x'⟩ of a velocity of (UDI-C), w = h(x): zero, for velocities in the tangent cone, iff x' is slow (section 3).
    #[must_use]
    pub fn constraint_power(&self, t: f64, x: &DVector<f64>, velocity: &DVector<f64>) -> f64 {
        (self.free_velocity(t, x) - velocity).dot(velocity)
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
