//! Acary, Brogliato, Daniilidis, Lemaréchal 2004 (RR-5107): equivalence of projected, complementarity and unilateral systems.

mod cones;
mod constraints;
mod solutions;

use circ::forms::projected::Map;
use circ::forms::unilateral::Unilateral;
use circ::forms::{Signal, constant};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

/// h: C = {‖x‖² ≤ 1, x₁ ≤ 1/2}.
fn h(x: &DVector<f64>) -> DVector<f64> {
    dvector![x.norm_squared() - 1.0, x[0] - 0.5]
}

/// ∇hᵀ.
fn gradients(x: &DVector<f64>) -> DMatrix<f64> {
    dmatrix![2.0 * x[0], 2.0 * x[1]; 1.0, 0.0]
}

/// f(x) = x − (2, 1) + rotation (monotone), on C.
fn problem() -> Unilateral {
    driven(constant(dvector![0.0, 0.5]))
}

/// With any g.
fn driven(g: Signal) -> Unilateral {
    let f = Map::affine(dmatrix![1.0, 1.0; -1.0, 1.0], dvector![-2.0, -1.0]);
    Unilateral::new(f, g, &Map::new(h, gradients), 2).unwrap()
}

/// The nearest point of C: of the candidates disc, line and corner the nearest in C.
fn nearest(x: &DVector<f64>) -> DVector<f64> {
    let inside = |x: &DVector<f64>| h(x).max() <= 1e-14;
    if inside(x) {
        return x.clone();
    }
    let (up, down) = (
        dvector![0.5, 0.75_f64.sqrt()],
        dvector![0.5, -0.75_f64.sqrt()],
    );
    let candidates = [x / x.norm().max(1.0), dvector![0.5, x[1]], up, down];
    let distance = |y: &DVector<f64>| (y - x).norm();
    candidates
        .into_iter()
        .filter(|y| h(y).max() <= 1e-12)
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .expect("the corners are in C")
}

/// Points of the boundary of C: on the disc, on the line, at the corner.
fn boundary() -> [DVector<f64>; 3] {
    [
        dvector![-0.6, 0.8],
        dvector![0.5, 0.2],
        dvector![0.5, 0.75_f64.sqrt()],
    ]
}
