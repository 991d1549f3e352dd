//! Projected dynamical systems x' = Π_K(x, −F(x)) and gradient-type complementarity systems
//! x' = −F(x) + H(x)ᵀu, 0 ≤ h(x) ⟂ u ≥ 0, H = ∂h/∂x (Heemels et al. (4), (7)), K = {h ≥ 0}.

use std::fmt;
use std::rc::Rc;

use nalgebra::{DMatrix, DVector};

use super::{Complementarity, FormError, Polyhedron, require};
use crate::settings::tolerances::ranks::RANK;
use crate::settings::tolerances::theorems::ACTIVE;

/// A vector that depends on the state.
pub type VectorField = Rc<dyn Fn(&DVector<f64>) -> DVector<f64>>;

/// A matrix that depends on the state.
pub type MatrixField = Rc<dyn Fn(&DVector<f64>) -> DMatrix<f64>>;

/// A differentiable map Rⁿ → Rᵏ.
#[derive(Clone)]
pub struct Map {
    /// Its value.
    pub value: VectorField,
    /// Its Jacobian, k×n.
    pub jacobian: MatrixField,
    /// Whether it is affine.
    pub affine: bool,
}

impl fmt::Debug for Map {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Map")
            .field("affine", &self.affine)
            .finish_non_exhaustive()
    }
}

impl Map {
    /// x ↦ Mx + c.
    #[must_use]
    pub fn affine(m: DMatrix<f64>, c: DVector<f64>) -> Self {
        let jacobian = m.clone();
        Self {
            value: Rc::new(move |x| &m * x + &c),
            jacobian: Rc::new(move |_| jacobian.clone()),
            affine: true,
        }
    }

    /// Any map with its Jacobian.
    pub fn new(
        value: impl Fn(&DVector<f64>) -> DVector<f64> + 'static,
        jacobian: impl Fn(&DVector<f64>) -> DMatrix<f64> + 'static,
    ) -> Self {
        Self {
            value: Rc::new(value),
            jacobian: Rc::new(jacobian),
            affine: false,
        }
    }
}

/// A projected dynamical system PDS(F, K), and with the same data the gradient-type system GTCS(F, h).
#[derive(Debug, Clone)]
pub struct ProjectedSystem {
    /// F.
    pub field: Map,
    /// h, concave so that K = {h ≥ 0} is convex.
    pub set: Map,
    n: usize,
    m: usize,
}

impl ProjectedSystem {
    /// From F and h on Rⁿ.
    ///
    /// # Errors
    /// [`FormError::Shape`].
    pub fn new(field: Map, set: Map, n: usize) -> Result<Self, FormError> {
        let at = DVector::zeros(n);
        let f = (field.value)(&at);
        if f.len() != n {
            return Err(FormError::Shape {
                what: "F",
                rows: f.len(),
                columns: 1,
            });
        }
        let m = (set.value)(&at).len();
        let h = (set.jacobian)(&at);
        if h.shape() != (m, n) {
            return Err(FormError::Shape {
                what: "∂h/∂x",
                rows: h.nrows(),
                columns: h.ncols(),
            });
        }
        Ok(Self { field, set, n, m })
    }

    /// I(x), the constraints that x meets with equality.
    #[must_use]
    pub fn active(&self, x: &DVector<f64>) -> Vec<usize> {
        let h = (self.set.value)(x);
        (0..self.m)
            .filter(|&i| h[i].abs() <= ACTIVE * (1.0 + x.amax()))
            .collect()
    }

    /// H_I(x), the gradients of the active constraints.
    #[must_use]
    pub fn active_gradients(&self, x: &DVector<f64>) -> DMatrix<f64> {
        (self.set.jacobian)(x).select_rows(&self.active(x))
    }

    /// Assumption 4.2 at x: the active gradients are linearly independent.
    ///
    /// # Errors
    /// [`FormError::Hypothesis`] with their smallest singular value.
    pub fn qualified(&self, x: &DVector<f64>) -> Result<(), FormError> {
        let h = self.active_gradients(x);
        if h.is_empty() {
            return Ok(());
        }
        let values = if h.nrows() > h.ncols() {
            DVector::zeros(1)
        } else {
            h.singular_values()
        };
        require(
            values.min() > RANK * values.max(),
            "Heemels et al. Theorem 4.7",
            "Assumption 4.2: the active gradients are dependent",
            values.min(),
        )
    }

    /// Assumption 4.1 at points: every h_i lies under its linearisations, h(y) ≤ h(x) + ∇h(x)(y − x).
    ///
    /// # Errors
    /// [`FormError::Hypothesis`] with the largest excess over all pairs.
    pub fn concave(&self, points: &[DVector<f64>]) -> Result<(), FormError> {
        let mut excess = 0.0_f64;
        let mut rounding = 0.0_f64;
        for x in points {
            let (h, gradients) = ((self.set.value)(x), (self.set.jacobian)(x));
            for y in points {
                let (there, slope) = ((self.set.value)(y), &gradients * (y - x));
                let over = &there - &h - &slope;
                excess = over.iter().copied().fold(excess, f64::max);
                rounding = rounding.max(there.amax().max(h.amax()).max(slope.amax()));
            }
        }
        require(
            excess <= RANK * rounding,
            "Heemels et al. Theorem 4.7",
            "Assumption 4.1: h is not concave, K may not be convex",
            excess,
        )
    }

    /// The least B with which (11) ‖F(x)‖ ≤ B(1 + ‖x‖) holds at the points (Assumption 4.4).
    #[must_use]
    pub fn growth(&self, points: &[DVector<f64>]) -> f64 {
        points
            .iter()
            .map(|x| (self.field.value)(x).norm() / (1.0 + x.norm()))
            .fold(0.0, f64::max)
    }

    /// The least C with which (12) ⟨F(y) − F(x), x − y⟩ ≤ C‖x − y‖² holds between the points (Assumption 4.5); −∞ for fewer
    /// than two.
    #[must_use]
    pub fn one_sided(&self, points: &[DVector<f64>]) -> f64 {
        let mut least = f64::NEG_INFINITY;
        for (k, x) in points.iter().enumerate() {
            for y in &points[..k] {
                let apart = x - y;
                let size = apart.norm_squared();
                if size > 0.0 {
                    let change = (self.field.value)(y) - (self.field.value)(x);
                    least = least.max(change.dot(&apart) / size);
                }
            }
        }
        least
    }

    /// The cone of admissible velocities W(x) (16).
    #[must_use]
    pub fn admissible(&self, x: &DVector<f64>) -> Polyhedron {
        let g = self.active_gradients(x);
        Polyhedron {
            h: DVector::zeros(g.nrows()),
            g,
        }
    }

    /// Π_K(x, v) = v + H_Iᵀu with 0 ≤ u ⟂ H_I v + H_I H_Iᵀu ≥ 0 (23), and u.
    ///
    /// # Errors
    /// [`FormError::Step`] if the problem was not solved.
    pub fn project_velocity(
        &self,
        x: &DVector<f64>,
        v: &DVector<f64>,
    ) -> Result<(DVector<f64>, DVector<f64>), FormError> {
        self.admissible(x).project(v)
    }

    /// x' = Π_K(x, −F(x)).
    ///
    /// # Errors
    /// Those of [`ProjectedSystem::project_velocity`].
    pub fn velocity(&self, x: &DVector<f64>) -> Result<DVector<f64>, FormError> {
        Ok(self.project_velocity(x, &-(self.field.value)(x))?.0)
    }

    /// P_K(x), the nearest point of K: the step of the system without field.
    ///
    /// # Errors
    /// Those of [`step`](super::step()).
    pub fn nearest(&self, x: &DVector<f64>) -> Result<DVector<f64>, FormError> {
        let n = self.n;
        let still = Self {
            field: Map::affine(DMatrix::zeros(n, n), DVector::zeros(n)),
            ..self.clone()
        };
        Ok(super::step(&still, 0.0, x, 1.0)?.x)
    }
}

impl Complementarity for ProjectedSystem {
    fn size(&self) -> (usize, usize) {
        (self.n, self.m)
    }

    fn drift(&self, _: f64, x: &DVector<f64>) -> DVector<f64> {
        -(self.field.value)(x)
    }

    fn drift_jacobian(&self, _: f64, x: &DVector<f64>) -> DMatrix<f64> {
        -(self.field.jacobian)(x)
    }

    fn input(&self, x: &DVector<f64>) -> DMatrix<f64> {
        (self.set.jacobian)(x).transpose()
    }

    fn constraint(&self, _: f64, x: &DVector<f64>) -> DVector<f64> {
        (self.set.value)(x)
    }

    fn constraint_jacobian(&self, _: f64, x: &DVector<f64>) -> DMatrix<f64> {
        (self.set.jacobian)(x)
    }

    fn feedthrough(&self) -> DMatrix<f64> {
        DMatrix::zeros(self.m, self.m)
    }

    fn is_affine(&self) -> bool {
        self.field.affine && self.set.affine
    }
}
