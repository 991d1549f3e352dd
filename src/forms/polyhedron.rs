//! Closed convex polyhedra {z : Gz + h ≥ 0}, their projections and cones.

use nalgebra::{DMatrix, DVector};

use super::FormError;
use crate::check::program;
use crate::settings::Settings;
use crate::settings::tolerances::theorems::ACTIVE;
use crate::solve::{Driver, Status};

/// {z ∈ Rⁿ : Gz + h ≥ 0}.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyhedron {
    /// m×n, inward normals as rows.
    pub g: DMatrix<f64>,
    /// m.
    pub h: DVector<f64>,
}

impl Polyhedron {
    /// Gz + h, m.
    #[must_use]
    pub fn slack(&self, z: &DVector<f64>) -> DVector<f64> {
        &self.g * z + &self.h
    }

    /// Whether z lies in it, up to a distance `tolerance`.
    #[must_use]
    pub fn contains(&self, z: &DVector<f64>, tolerance: f64) -> bool {
        self.slack(z)
            .iter()
            .zip(self.g.row_iter())
            .all(|(s, g)| *s >= -tolerance * g.norm().max(1.0))
    }

    /// The Euclidean projection of z, z + Gᵀμ with 0 ≤ μ ⟂ G(z + Gᵀμ) + h ≥ 0 (Heemels et al. Theorem 5.4), and μ.
    ///
    /// # Errors
    /// [`FormError::Step`] if the polyhedron is empty.
    pub fn project(&self, z: &DVector<f64>) -> Result<(DVector<f64>, DVector<f64>), FormError> {
        if self.h.is_empty() {
            return Ok((z.clone(), DVector::zeros(0)));
        }
        let mut driver = Driver::new(
            &self.g * self.g.transpose(),
            Settings::default().lcp_residual,
        );
        let solution = driver.solve(&self.slack(z));
        match solution.status {
            Status::Solved => Ok((z + self.g.transpose() * &solution.lambda, solution.lambda)),
            Status::Infeasible(_) => Err(FormError::Step {
                t: 0.0,
                reason: "the set is empty",
            }),
            Status::Failed => Err(FormError::Step {
                t: 0.0,
                reason: "the projection was not found",
            }),
        }
    }

    /// The same projection as the minimiser of ½‖w − z‖² by the interior point method: an independent second path.
    ///
    /// # Errors
    /// [`FormError::Step`] if the polyhedron is empty.
    pub fn nearest(&self, z: &DVector<f64>) -> Result<DVector<f64>, FormError> {
        let n = z.len();
        program::minimise(&DMatrix::identity(n, n), &-z, &self.g, &self.h, 0).ok_or(
            FormError::Step {
                t: 0.0,
                reason: "the set is empty",
            },
        )
    }

    /// Indices of the constraints that z meets with equality.
    #[must_use]
    pub fn active(&self, z: &DVector<f64>) -> Vec<usize> {
        let terms = self.g.abs() * z.abs() + self.h.abs();
        let slack = self.slack(z);
        (0..slack.len())
            .filter(|&i| slack[i].abs() <= ACTIVE * terms[i].max(self.g.row(i).norm()))
            .collect()
    }

    /// The tangent cone at z: {w : G_active w ≥ 0}.
    #[must_use]
    pub fn tangent(&self, z: &DVector<f64>) -> Self {
        let active = self.active(z);
        Self {
            g: self.g.select_rows(&active),
            h: DVector::zeros(active.len()),
        }
    }

    /// The distance of v from the (outward) normal cone at z, {−Gᵀ_active μ : μ ≥ 0}: by Moreau, the length of the
    /// projection of v onto the tangent cone.
    ///
    /// # Errors
    /// Those of [`Polyhedron::project`].
    pub fn distance_to_normal(&self, z: &DVector<f64>, v: &DVector<f64>) -> Result<f64, FormError> {
        Ok(self.tangent(z).project(v)?.0.norm())
    }
}
