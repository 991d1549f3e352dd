//! Every numbered statement of the four papers, as a test that fails if the statement is violated.
//!
//! Data: random systems from a fixed seed, or the papers' own circuits with their misprints corrected (docs/theory.md).

mod brogliato_thibault;
mod heemels;
mod reference;
mod rr5107;
mod rr7158;
#[path = "../systems/passive.rs"]
mod systems;

use nalgebra::{DMatrix, DVector};

use systems::{C, L, R, Random, bridge, filter};

/// xᵀPx.
fn energy(p: &DMatrix<f64>, x: &DVector<f64>) -> f64 {
    x.dot(&(p * x))
}

/// [`systems::passive`] with energies within a factor of four.
fn passive(
    random: &mut Random,
    size: (usize, usize),
    rank: usize,
    damping: f64,
) -> (circ::passivity::System, DMatrix<f64>) {
    systems::passive(random, size, rank, damping, 2.0)
}
