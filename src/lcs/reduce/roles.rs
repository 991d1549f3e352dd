//! Other quantities of those devices whose D keeps too few digits of what sets them apart.
//!
//! Two diodes with Ron in parallel, and R in series with both: with λ = −v of both D = 1/(2 Ron) [1, −1; −1, 1] + 1/(4R) [1, 1; 1, 1] for
//! Ron ≪ R, and of 1/R there is what 1/Ron leaves of the digits of doubles, nothing where these are 16 decades apart. With λ = i of one of
//! them its row and column are ±1 and D of the other is 1/R.

use nalgebra::DMatrix;

use super::Reduction;
use crate::algebra::Field;
use crate::lcs::Role;
use crate::mna::StaticMultiport;
use crate::settings::tolerances::ranks::{COUPLED, RANK};

/// The pairs that others follow in D + Dᵀ but for less than [`RANK`] of themselves, which is not nothing: the independent ones of them, by the
/// largest pivots of an exact factorisation L Δ Lᵀ. `None` where there are none.
pub(super) fn lost<F: Field>(reduction: &Reduction<F>) -> Option<Vec<usize>> {
    let (n, m) = (reduction.states.len(), reduction.pairs.len());
    let entry = |i: usize, j: usize| reduction.y[i][n + j].add(&reduction.y[j][n + i]);
    let unit: Vec<f64> = (0..m)
        .map(|j| match entry(j, j).to_f64() {
            d if d > 0.0 => d.sqrt().recip(),
            _ => 0.0,
        })
        .collect();
    if !is_suspect(m, |i, j| entry(i, j).to_f64() * unit[i] * unit[j]) {
        return None;
    }
    let mut rest: Vec<Vec<F>> = (0..m)
        .map(|i| (0..m).map(|j| entry(i, j)).collect())
        .collect();
    // Part of its diagonal that is left of each pair, and pivots with their columns of L in units of the diagonals.
    let mut left: Vec<f64> = unit.iter().map(|u| f64::from(*u > 0.0)).collect();
    let mut pivots: Vec<(usize, Vec<f64>)> = Vec::new();
    let mut lost = Vec::new();
    while let Some(p) = (0..m)
        .filter(|&j| left[j] > RANK)
        .max_by(|&a, &b| left[a].total_cmp(&left[b]))
    {
        let row = rest[p].clone();
        let share = |j: usize| row[j].to_f64() * unit[p] * unit[j] / left[p].sqrt();
        pivots.push((p, (0..m).map(share).collect()));
        for i in (0..m).filter(|&i| !row[i].is_zero()) {
            let factor = row[i].div(&row[p]);
            for (target, entry) in rest[i].iter_mut().zip(&row) {
                target.sub_mul(&factor, entry);
            }
        }
        for j in 0..m {
            let before = std::mem::replace(&mut left[j], rest[j][j].to_f64() * unit[j] * unit[j]);
            if before > RANK && left[j] <= RANK && !rest[j][j].is_zero() {
                let followed = pivots.iter().filter(|(_, share)| share[j].abs() > COUPLED);
                lost.extend(followed.map(|(p, _)| reduction.pairs[*p].0));
            }
        }
    }
    lost.sort_unstable();
    lost.dedup();
    (!lost.is_empty()).then_some(lost)
}

/// Whether an eigenvalue of a matrix with unit diagonal is so small that it may be lost.
fn is_suspect(m: usize, entry: impl Fn(usize, usize) -> f64) -> bool {
    let scaled = DMatrix::from_fn(m, m, entry);
    let sound = scaled.iter().all(|v| v.is_finite());
    m > 1 && sound && scaled.symmetric_eigenvalues().min() <= RANK * m as f64
}

/// The behaviour with the other quantity of these devices preferred as λ.
pub(super) fn exchanged(behaviour: &StaticMultiport, pairs: &[usize]) -> StaticMultiport {
    let mut other = behaviour.clone();
    for &k in pairs {
        let role = &mut other.pairs[k].port.role;
        *role = match *role {
            Role::Voltage => Role::Current,
            Role::Current => Role::Voltage,
            Role::Function => Role::Function,
        };
    }
    other
}
