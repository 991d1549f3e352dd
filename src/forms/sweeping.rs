//! The perturbed sweeping process −ż ∈ N(S(t); z) + f(t, z) (Brogliato-Thibault (15), (20), (30)).

use nalgebra::{DMatrix, DVector};

use super::{Complementarity, FormError, Linear, Polyhedron, require};
use crate::check::Feedthrough;
use crate::passivity::{gradient, verify};
use crate::settings::Settings;
use crate::settings::tolerances::ranks::ENTRY;
use crate::solve::{Driver, Status};

/// S(t) = {z : Hz + w(t) ≥ 0}, z = Rx, −f(t, z) = RAR⁻¹z + R e(t) + RB₁ζ₁, where ζ₁ solves the P-matrix problem of the
/// ports with feedthrough (none in (15)).
#[derive(Debug, Clone)]
pub struct SweepingProcess {
    /// The complementarity system it comes from.
    pub linear: Linear,
    /// P with PB₂ = C₂ᵀ, R = √P.
    pub p: DMatrix<f64>,
    /// R, n×n.
    pub r: DMatrix<f64>,
    /// R⁻¹.
    pub r_inverse: DMatrix<f64>,
    /// Ports without feedthrough: they make the set.
    pub free: Vec<usize>,
    /// Ports with feedthrough D₁: they make the perturbation.
    pub fed: Vec<usize>,
}

impl SweepingProcess {
    /// Section 3.1: D = 0 and PB = Cᵀ with P ≻ 0 (Assumption 1.1). `energy` is tried first for P.
    ///
    /// # Errors
    /// Which of the two fails.
    pub fn of(linear: &Linear, energy: Option<&DMatrix<f64>>) -> Result<Self, FormError> {
        const STATEMENT: &str = "Brogliato-Thibault section 3.1";
        require(
            linear.system.d.amax() == 0.0,
            STATEMENT,
            "D = 0 fails",
            linear.system.d.amax(),
        )?;
        Self::partitioned(
            linear,
            energy,
            (0..linear.system.m()).collect(),
            Vec::new(),
            STATEMENT,
        )
    }

    /// Section 3.3: D = diag(D₁, 0) up to order, D₁ a P-matrix, P₂B₂ = C₂ᵀ with P₂ ≻ 0.
    ///
    /// # Errors
    /// Which of them fails.
    pub fn with_feedthrough(
        linear: &Linear,
        energy: Option<&DMatrix<f64>>,
    ) -> Result<Self, FormError> {
        const STATEMENT: &str = "Brogliato-Thibault section 3.3";
        let d = &linear.system.d;
        let (free, fed): (Vec<usize>, Vec<usize>) = (0..d.nrows())
            .partition(|&j| d.row(j).amax().max(d.column(j).amax()) <= ENTRY * d.amax());
        let d1 = d.select_rows(&fed).select_columns(&fed);
        let p_matrix = Feedthrough::of(&d1).p_matrix;
        require(
            p_matrix == Some(true),
            STATEMENT,
            "D₁ is not known to be a P-matrix",
            d1.determinant(),
        )?;
        Self::partitioned(linear, energy, free, fed, STATEMENT)
    }

    fn partitioned(
        linear: &Linear,
        energy: Option<&DMatrix<f64>>,
        free: Vec<usize>,
        fed: Vec<usize>,
        statement: &'static str,
    ) -> Result<Self, FormError> {
        let b = linear.system.b.select_columns(&free);
        let c = linear.system.c.select_rows(&free);
        let n = linear.system.n();
        let distance = energy.map_or_else(
            || (&b - c.transpose()).amax(),
            |p| gradient::residual(p, &b, &c),
        );
        let p = if free.is_empty() {
            energy.cloned().unwrap_or_else(|| DMatrix::identity(n, n))
        } else {
            gradient::storage(&b, &c, energy).ok_or(FormError::Hypothesis {
                statement,
                condition: "no P = Pᵀ ≻ 0 with PB = Cᵀ",
                size: distance,
            })?
        };
        let (r, r_inverse) = square_root(&p).ok_or(FormError::Hypothesis {
            statement,
            condition: "P is not positive definite",
            size: verify::definite(&p).err().map_or(0.0, |_| 1.0),
        })?;
        Ok(Self {
            linear: linear.clone(),
            p,
            r,
            r_inverse,
            free,
            fed,
        })
    }

    /// S(t) in the coordinates z.
    #[must_use]
    pub fn set(&self, t: f64) -> Polyhedron {
        Polyhedron {
            g: self.linear.system.c.select_rows(&self.free) * &self.r_inverse,
            h: (self.linear.f)(t).select_rows(&self.free),
        }
    }

    /// ζ₁(x, u(t)): the Lipschitz solution of the ports with feedthrough.
    ///
    /// # Errors
    /// [`FormError::Step`] if the P-matrix problem was not solved.
    pub fn zeta(&self, t: f64, x: &DVector<f64>) -> Result<DVector<f64>, FormError> {
        if self.fed.is_empty() {
            return Ok(DVector::zeros(0));
        }
        let system = &self.linear.system;
        let q = system.c.select_rows(&self.fed) * x + (self.linear.f)(t).select_rows(&self.fed);
        let d = system.d.select_rows(&self.fed).select_columns(&self.fed);
        let solution = Driver::new(d, Settings::default().lcp_residual).solve(&q);
        match solution.status {
            Status::Solved => Ok(solution.lambda),
            _ => Err(FormError::Step {
                t,
                reason: "the problem of the ports with feedthrough was not solved",
            }),
        }
    }

    /// −f(t, z) = RAR⁻¹z + Re(t) + RB₁ζ₁, what the motion would be inside S(t).
    ///
    /// # Errors
    /// Those of [`SweepingProcess::zeta`].
    pub fn drift(&self, t: f64, z: &DVector<f64>) -> Result<DVector<f64>, FormError> {
        let x = &self.r_inverse * z;
        let mut velocity = &self.linear.system.a * &x + (self.linear.e)(t);
        if !self.fed.is_empty() {
            velocity += self.linear.system.b.select_columns(&self.fed) * self.zeta(t, &x)?;
        }
        Ok(&self.r * velocity)
    }

    /// z⁺ = prox[S(t); z⁻] (25).
    ///
    /// # Errors
    /// [`FormError::Step`] if S(t) is empty.
    pub fn jump(&self, t: f64, z: &DVector<f64>) -> Result<DVector<f64>, FormError> {
        Ok(self.set(t).project(z)?.0)
    }

    /// One step of Moreau's catching-up algorithm, z⁺ = prox[S(t + h); z + h·drift(t, z)].
    ///
    /// # Errors
    /// Those of the projection and of [`SweepingProcess::drift`].
    pub fn catch_up(&self, t: f64, z: &DVector<f64>, h: f64) -> Result<DVector<f64>, FormError> {
        self.jump(t + h, &(z + self.drift(t, z)? * h))
    }

    /// The variational inequality below (15): min over v ∈ S(t) of ⟨ż − drift, v − z⟩, which must be ≥ 0. Checked at
    /// the point of S(t) nearest to z − (ż − drift): it is z itself iff the inequality holds. Returns that distance.
    ///
    /// # Errors
    /// Those of the projection.
    pub fn violation(
        &self,
        t: f64,
        z: &DVector<f64>,
        velocity: &DVector<f64>,
    ) -> Result<f64, FormError> {
        let force = velocity - self.drift(t, z)?;
        Ok((self.jump(t, &(z - force))? - z).norm())
    }
}

/// The symmetric positive definite square root and its inverse.
#[must_use]
pub fn square_root(p: &DMatrix<f64>) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    verify::definite(p).ok()?;
    let eigen = p.clone().symmetric_eigen();
    let root = eigen.eigenvalues.map(|v| v.max(0.0).sqrt());
    if root.iter().any(|&v| v == 0.0) {
        return None;
    }
    let vectors = &eigen.eigenvectors;
    let build = |d: DVector<f64>| vectors * DMatrix::from_diagonal(&d) * vectors.transpose();
    Some((build(root.clone()), build(root.map(f64::recip))))
}

impl Complementarity for SweepingProcess {
    fn size(&self) -> (usize, usize) {
        self.linear.size()
    }

    fn drift(&self, t: f64, z: &DVector<f64>) -> DVector<f64> {
        &self.r * self.linear.drift(t, &(&self.r_inverse * z))
    }

    fn drift_jacobian(&self, _: f64, _: &DVector<f64>) -> DMatrix<f64> {
        &self.r * &self.linear.system.a * &self.r_inverse
    }

    fn input(&self, _: &DVector<f64>) -> DMatrix<f64> {
        &self.r * &self.linear.system.b
    }

    fn constraint(&self, t: f64, z: &DVector<f64>) -> DVector<f64> {
        self.linear.constraint(t, &(&self.r_inverse * z))
    }

    fn constraint_jacobian(&self, _: f64, _: &DVector<f64>) -> DMatrix<f64> {
        &self.linear.system.c * &self.r_inverse
    }

    fn feedthrough(&self) -> DMatrix<f64> {
        self.linear.system.d.clone()
    }

    fn is_affine(&self) -> bool {
        true
    }
}
