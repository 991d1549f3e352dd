//! Brogliato, Goeleven 2009 (RR-7158): well-posedness, stability and invariance of multivalued Lur'e systems.

mod feedback;
mod feedthrough;
mod invariance;
mod passivity;
mod well_posed;

use circ::passivity::System;
use circ::solve::{Driver, Status};
use nalgebra::{DMatrix, DVector, dmatrix};

/// λ of the complementarity problem (q, M).
fn solution(m: &DMatrix<f64>, q: &DVector<f64>) -> DVector<f64> {
    let solution = Driver::new(m.clone(), 1e-9).solve(q);
    assert_eq!(solution.status, Status::Solved);
    solution.lambda
}

/// Figure 2 (33), misprints corrected: charges x₁, x₂ of two R-C meshes that share a capacitor, x₃ the voltage of the last
/// one with diode 2 across it, diode 1 in mesh 1. Returned with its stored energy.
fn figure_2() -> (System, DMatrix<f64>) {
    let (r, c) = (2.0, 0.5);
    let system = System {
        a: dmatrix![
            -2.0 / (r * c), 1.0 / (r * c), 0.0;
            1.0 / (r * c), -2.0 / (r * c), -1.0 / r;
            1.0 / (r * c * c), -2.0 / (r * c * c), -1.0 / (r * c)
        ],
        b: dmatrix![0.0, 1.0 / r; 0.0, 0.0; 1.0 / c, 0.0],
        c: dmatrix![0.0, 0.0, 1.0; -2.0 / (r * c), 1.0 / (r * c), 0.0],
        d: dmatrix![0.0, 0.0; 0.0, 1.0 / r],
    };
    (
        system,
        dmatrix![2.0 / c, -1.0 / c, 0.0; -1.0 / c, 2.0 / c, 0.0; 0.0, 0.0, c],
    )
}
