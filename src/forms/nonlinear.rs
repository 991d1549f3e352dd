//! The nonlinear complementarity system (Brogliato-Thibault (34)) with its state map and prox-regularity radius.
//!
//! ```text
//! x' = a(x) + e(x, u(t)) + Bζ,   0 ≤ ζ ⟂ w = c(x) + g(u(t)) ≥ 0,   ∂c/∂x = BᵀV''(x)        (34), (35)
//! z = h(x), h' = Λ(x) = V''(x)^½ (36):  −z' + … ∈ N(S(t); z),  S(t) = {z : k(z) + g(u(t)) ≥ 0}, k = c ∘ h⁻¹ (40)
//! ```

use std::cell::RefCell;
use std::fmt;
use std::rc::Rc;

use nalgebra::{DMatrix, DVector};

use super::projected::{Map, MatrixField};
use super::sweeping::square_root;
use super::{Complementarity, FormError, Signal, require};
use crate::settings::tolerances::passivity::MATCHED;
use crate::settings::tolerances::theorems::MAP_INVERTED;

/// A vector field that depends on time.
pub type Field = Rc<dyn Fn(f64, &DVector<f64>) -> DVector<f64>>;

/// Its Jacobian in x.
pub type FieldJacobian = Rc<dyn Fn(f64, &DVector<f64>) -> DMatrix<f64>>;

/// Ports up to which the constant of (38) is computed exactly, over all faces of the orthant.
const MAX_PORTS: usize = 12;

/// Newton steps and relative change of the inversion of the state map.
const NEWTON_STEPS: usize = 50;

/// A nonlinear complementarity system with storage function V.
#[derive(Clone)]
pub struct NonlinearComplementarity {
    /// a(x) + e(x, u(t)), n.
    pub field: Field,
    /// Its Jacobian, n×n.
    pub field_jacobian: FieldJacobian,
    /// B, n×m.
    pub b: DMatrix<f64>,
    /// c.
    pub c: Map,
    /// g(u(t)), m.
    pub g: Signal,
    /// V''(x), n×n symmetric positive definite.
    pub hessian: MatrixField,
}

impl fmt::Debug for NonlinearComplementarity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("NonlinearComplementarity")
            .field("b", &self.b)
            .field("c", &self.c)
            .finish_non_exhaustive()
    }
}

impl NonlinearComplementarity {
    /// Checks Assumption 4.1 at the given points: ∂c/∂x = BᵀV'' and V'' ≻ 0.
    ///
    /// # Errors
    /// The condition that fails, with its size.
    pub fn check_storage(&self, points: &[DVector<f64>]) -> Result<(), FormError> {
        const STATEMENT: &str = "Brogliato-Thibault Assumption 4.1";
        for x in points {
            let hessian = (self.hessian)(x);
            let expected = self.b.transpose() * &hessian;
            let found = (self.c.jacobian)(x);
            let size = expected.amax().max(found.amax());
            let residual = (&expected - &found).amax();
            require(
                residual <= MATCHED * size,
                STATEMENT,
                "∂c/∂x = BᵀV'' fails",
                residual,
            )?;
            require(
                square_root(&hessian).is_some(),
                STATEMENT,
                "V'' is not positive definite",
                hessian.determinant(),
            )?;
        }
        Ok(())
    }

    /// Λ(x) = V''(x)^½, the Jacobian of the state map z = h(x) (36).
    #[must_use]
    pub fn lambda(&self, x: &DVector<f64>) -> Option<DMatrix<f64>> {
        square_root(&(self.hessian)(x)).map(|(root, _)| root)
    }

    /// The state map h along the ray from 0: h(x) = ∫₀¹ Λ(sx)x ds by Gauss-Legendre quadrature of order 10; it is the state
    /// map whenever Λ is integrable (36).
    #[must_use]
    pub fn state_map(&self, x: &DVector<f64>) -> Option<DVector<f64>> {
        let mut z = DVector::zeros(x.len());
        for (node, weight) in GAUSS {
            for s in [0.5 * (1.0 - node), 0.5 * (1.0 + node)] {
                z += self.lambda(&(x * s))? * x * (0.5 * weight);
            }
        }
        Some(z)
    }

    /// x = h⁻¹(z), by Newton's method from `near`.
    #[must_use]
    pub fn inverse_state_map(&self, z: &DVector<f64>, near: &DVector<f64>) -> Option<DVector<f64>> {
        let mut x = near.clone();
        for _ in 0..NEWTON_STEPS {
            let residual = z - self.state_map(&x)?;
            let (_, inverse) = square_root(&(self.hessian)(&x))?;
            let step = inverse * residual;
            x += &step;
            if step.amax() <= MAP_INVERTED * (1.0 + x.amax()) {
                return Some(x);
            }
        }
        None
    }

    /// The system in the coordinates z (40), in which jumps are projections onto S(t).
    ///
    /// # Errors
    /// [`FormError::Hypothesis`] if V'' is not positive definite at the start.
    pub fn in_z(&self, x0: &DVector<f64>) -> Result<SweepingForm<'_>, FormError> {
        self.check_storage(std::slice::from_ref(x0))?;
        Ok(SweepingForm {
            original: self,
            last: RefCell::new(x0.clone()),
        })
    }

    /// The largest ρ with ρ𝔹 ⊂ BᵀΛ(x)𝔹 − R₊ᵐ (38), which is min ‖ΛBμ‖ over μ ≥ 0, ‖μ‖ = 1. `None` for more ports than
    /// are enumerated.
    #[must_use]
    pub fn slope(&self, x: &DVector<f64>) -> Option<f64> {
        let m = self.b.ncols();
        if m > MAX_PORTS {
            return None;
        }
        let reach = self.lambda(x)? * &self.b;
        let gram = reach.transpose() * &reach;
        // The minimum of μᵀΓμ on a face of the orthant is interior to one of its faces: an eigenvector of one sign.
        let mut least = f64::INFINITY;
        for mask in 1..1_usize << m {
            let set: Vec<usize> = (0..m).filter(|j| mask >> j & 1 == 1).collect();
            let eigen = gram
                .select_rows(&set)
                .select_columns(&set)
                .symmetric_eigen();
            for (k, &value) in eigen.eigenvalues.iter().enumerate() {
                let v = eigen.eigenvectors.column(k);
                let rounding = f64::EPSILON.sqrt();
                if v.iter().all(|&c| c >= -rounding) || v.iter().all(|&c| c <= rounding) {
                    least = least.min(value.max(0.0));
                }
            }
        }
        Some(least.sqrt())
    }

    /// r = ρ/sup ‖k''‖ (44) for the least ρ over the given points and a bound on the second derivative of k = c ∘ h⁻¹;
    /// infinite for affine k (convex sets).
    ///
    /// # Errors
    /// (38) fails: ρ = 0.
    pub fn prox_regularity(
        &self,
        points: &[DVector<f64>],
        curvature: f64,
    ) -> Result<f64, FormError> {
        let rho = points
            .iter()
            .map(|x| self.slope(x).unwrap_or(0.0))
            .fold(f64::INFINITY, f64::min);
        require(
            rho > 0.0,
            "Brogliato-Thibault Theorem 4.3",
            "inclusion (38) fails: ρ = 0",
            rho,
        )?;
        Ok(if curvature > 0.0 {
            rho / curvature
        } else {
            f64::INFINITY
        })
    }
}

/// Positive nodes and weights of Gauss-Legendre quadrature of order 10 on [−1, 1] (exact for polynomials of degree 19).
const GAUSS: [(f64, f64); 5] = [
    (0.148_874_338_981_631_22, 0.295_524_224_714_752_87),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
];

/// The perturbed sweeping process (40) of a nonlinear complementarity system, stepped in z.
#[derive(Debug)]
pub struct SweepingForm<'a> {
    original: &'a NonlinearComplementarity,
    /// The last x found: where the next inversion of the state map starts.
    last: RefCell<DVector<f64>>,
}

impl SweepingForm<'_> {
    /// x of a z; the last one found if the inversion fails, which the step notices as an iteration that does not settle.
    fn x(&self, z: &DVector<f64>) -> DVector<f64> {
        let near = self.last.borrow().clone();
        let x = self.original.inverse_state_map(z, &near).unwrap_or(near);
        self.last.replace(x.clone());
        x
    }

    fn lambda(&self, x: &DVector<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
        square_root(&(self.original.hessian)(x)).unwrap_or_else(|| {
            (
                DMatrix::identity(x.len(), x.len()),
                DMatrix::identity(x.len(), x.len()),
            )
        })
    }
}

impl Complementarity for SweepingForm<'_> {
    fn size(&self) -> (usize, usize) {
        self.original.b.shape()
    }

    fn drift(&self, t: f64, z: &DVector<f64>) -> DVector<f64> {
        let x = self.x(z);
        self.lambda(&x).0 * (self.original.field)(t, &x)
    }

    /// ΛJΛ⁻¹: the derivative of Λ itself is left to the iteration.
    fn drift_jacobian(&self, t: f64, z: &DVector<f64>) -> DMatrix<f64> {
        let x = self.x(z);
        let (root, inverse) = self.lambda(&x);
        root * (self.original.field_jacobian)(t, &x) * inverse
    }

    fn input(&self, z: &DVector<f64>) -> DMatrix<f64> {
        self.lambda(&self.x(z)).0 * &self.original.b
    }

    fn constraint(&self, t: f64, z: &DVector<f64>) -> DVector<f64> {
        (self.original.c.value)(&self.x(z)) + (self.original.g)(t)
    }

    fn constraint_jacobian(&self, _: f64, z: &DVector<f64>) -> DMatrix<f64> {
        self.original.b.transpose() * self.lambda(&self.x(z)).0
    }

    fn feedthrough(&self) -> DMatrix<f64> {
        DMatrix::zeros(self.original.b.ncols(), self.original.b.ncols())
    }

    fn is_affine(&self) -> bool {
        false
    }
}

impl Complementarity for NonlinearComplementarity {
    fn size(&self) -> (usize, usize) {
        self.b.shape()
    }

    fn drift(&self, t: f64, x: &DVector<f64>) -> DVector<f64> {
        (self.field)(t, x)
    }

    fn drift_jacobian(&self, t: f64, x: &DVector<f64>) -> DMatrix<f64> {
        (self.field_jacobian)(t, x)
    }

    fn input(&self, _: &DVector<f64>) -> DMatrix<f64> {
        self.b.clone()
    }

    fn constraint(&self, t: f64, x: &DVector<f64>) -> DVector<f64> {
        (self.c.value)(x) + (self.g)(t)
    }

    fn constraint_jacobian(&self, _: f64, x: &DVector<f64>) -> DMatrix<f64> {
        (self.c.jacobian)(x)
    }

    fn feedthrough(&self) -> DMatrix<f64> {
        DMatrix::zeros(self.b.ncols(), self.b.ncols())
    }

    fn is_affine(&self) -> bool {
        false
    }
}
