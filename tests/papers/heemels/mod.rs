//! Heemels, Schumacher, Weiland 2000: projected dynamical systems in a complementarity formalism.
//!
//! K = {h ≥ 0} is convex for concave h (the paper's "convex" is a misprint).

mod assumptions;
mod projection;
mod trajectories;

use circ::forms::projected::{Map, ProjectedSystem};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

/// F(x) = x − target + a rotation, on the unit disc cut by x₂ ≥ −1/2: drives the state into and along the boundary.
fn on_a_cut_disc() -> ProjectedSystem {
    in_the_cut_disc(Map::affine(turn(), dvector![1.0, 2.5]))
}

/// ∂F/∂x.
fn turn() -> DMatrix<f64> {
    dmatrix![1.0, -2.0; 2.0, 1.0]
}

/// Any field on that set.
fn in_the_cut_disc(field: Map) -> ProjectedSystem {
    ProjectedSystem::new(field, Map::new(constraints, gradients), 2).unwrap()
}

/// h.
fn constraints(x: &DVector<f64>) -> DVector<f64> {
    dvector![1.0 - x.norm_squared(), x[1] + 0.5]
}

/// H = ∂h/∂x.
fn gradients(x: &DVector<f64>) -> DMatrix<f64> {
    dmatrix![-2.0 * x[0], -2.0 * x[1]; 0.0, 1.0]
}

/// Where circle and line meet.
fn corner() -> DVector<f64> {
    dvector![0.75_f64.sqrt(), -0.5]
}
