//! The input-output property PB = Cᵀ (Brogliato-Thibault Assumption 1.1, RR-7158 Assumptions 2 and 5).

use nalgebra::DMatrix;

use super::{System, facial, scale, verify};
use crate::settings::tolerances::passivity::MATCHED;
use crate::settings::tolerances::ranks::RANK;

/// States beyond which only the candidate is tried: constructing P takes a full singular value decomposition.
const LARGEST: usize = 200;

/// max |PB − Cᵀ| relative to |P||B| + |C|ᵀ, entry by entry (0 where both vanish).
#[must_use]
pub fn residual(p: &DMatrix<f64>, b: &DMatrix<f64>, c: &DMatrix<f64>) -> f64 {
    let difference = p * b - c.transpose();
    let size = p.abs() * b.abs() + c.abs().transpose();
    let largest = size.iter().copied().fold(0.0, f64::max);
    difference
        .iter()
        .zip(size.iter())
        .map(|(d, s)| {
            if *s > RANK * largest {
                d.abs() / s
            } else {
                0.0
            }
        })
        .fold(0.0, f64::max)
}

/// Some P = Pᵀ ≻ 0 with PB = Cᵀ, the candidate first; `None` if there is none (to rounding).
#[must_use]
pub fn storage(
    b: &DMatrix<f64>,
    c: &DMatrix<f64>,
    candidate: Option<&DMatrix<f64>>,
) -> Option<DMatrix<f64>> {
    let fits = |p: &DMatrix<f64>| verify::definite(p).is_ok() && residual(p, b, c) <= MATCHED;
    if let Some(p) = candidate.filter(|p| p.shape() == (b.nrows(), b.nrows()) && fits(p)) {
        return Some(p.clone());
    }
    // A has no say here: balance B against C alone.
    let (n, m) = b.shape();
    if n > LARGEST {
        return None;
    }
    let system = System {
        a: DMatrix::zeros(n, n),
        b: b.clone(),
        c: c.clone(),
        d: DMatrix::zeros(m, m),
    };
    let balanced = scale::balance(&system);
    let (p0, _) = facial::equalities(
        &balanced.system.b,
        &balanced.system.c.transpose(),
        &DMatrix::identity(m, m),
    )
    .ok()?;
    let t = balanced.states.map(f64::recip);
    Some(scale::scaled(&p0, &t, &t)).filter(fits)
}
