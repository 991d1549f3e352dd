//! The linear complementarity system x' = Ax + Bλ + e(t), 0 ≤ λ ⟂ y = Cx + Dλ + f(t) ≥ 0 (Brogliato-Thibault (5) with
//! e = Eu, f = Gu + F).

use std::fmt;
use std::rc::Rc;

use nalgebra::{DMatrix, DVector};

use super::{Complementarity, FormError, Trajectory, integrate};
use crate::passivity::System;

/// A vector that depends on time.
pub type Signal = Rc<dyn Fn(f64) -> DVector<f64>>;

/// A signal that does not.
#[must_use]
pub fn constant(value: DVector<f64>) -> Signal {
    Rc::new(move |_| value.clone())
}

/// A linear complementarity system.
#[derive(Clone)]
pub struct Linear {
    /// (A, B, C, D).
    pub system: System,
    /// e(t), n.
    pub e: Signal,
    /// f(t), m.
    pub f: Signal,
}

impl fmt::Debug for Linear {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Linear")
            .field("system", &self.system)
            .finish_non_exhaustive()
    }
}

impl Linear {
    /// A system without constant or driven terms.
    ///
    /// # Errors
    /// [`FormError::Shape`].
    pub fn autonomous(system: System) -> Result<Self, FormError> {
        let (n, m) = (system.n(), system.m());
        Self::new(
            system,
            constant(DVector::zeros(n)),
            constant(DVector::zeros(m)),
        )
    }

    /// A system with its driven terms.
    ///
    /// # Errors
    /// [`FormError::Shape`].
    pub fn new(system: System, e: Signal, f: Signal) -> Result<Self, FormError> {
        let (n, m) = (system.n(), system.m());
        let shapes = [
            ("A", &system.a, (n, n)),
            ("B", &system.b, (n, m)),
            ("C", &system.c, (m, n)),
            ("D", &system.d, (m, m)),
        ];
        for (what, matrix, shape) in shapes {
            if matrix.shape() != shape {
                return Err(FormError::Shape {
                    what,
                    rows: matrix.nrows(),
                    columns: matrix.ncols(),
                });
            }
        }
        for (what, length, expected) in [("e", e(0.0).len(), n), ("f", f(0.0).len(), m)] {
            if length != expected {
                return Err(FormError::Shape {
                    what,
                    rows: length,
                    columns: 1,
                });
            }
        }
        Ok(Self { system, e, f })
    }

    /// `steps` implicit steps from x₀.
    ///
    /// # Errors
    /// [`FormError::Step`].
    pub fn integrate(
        &self,
        span: (f64, f64),
        x0: &DVector<f64>,
        steps: usize,
    ) -> Result<Trajectory, FormError> {
        integrate(self, span, x0, steps)
    }
}

impl Complementarity for Linear {
    fn size(&self) -> (usize, usize) {
        (self.system.n(), self.system.m())
    }

    fn drift(&self, t: f64, x: &DVector<f64>) -> DVector<f64> {
        &self.system.a * x + (self.e)(t)
    }

    fn drift_jacobian(&self, _: f64, _: &DVector<f64>) -> DMatrix<f64> {
        self.system.a.clone()
    }

    fn input(&self, _: &DVector<f64>) -> DMatrix<f64> {
        self.system.b.clone()
    }

    fn constraint(&self, t: f64, x: &DVector<f64>) -> DVector<f64> {
        &self.system.c * x + (self.f)(t)
    }

    fn constraint_jacobian(&self, _: f64, _: &DVector<f64>) -> DMatrix<f64> {
        self.system.c.clone()
    }

    fn feedthrough(&self) -> DMatrix<f64> {
        self.system.d.clone()
    }

    fn is_affine(&self) -> bool {
        true
    }
}
