//! Other quantities of those devices whose D keeps too few digits of what sets them apart.
//!
//! Two diodes with Ron in parallel, and R in series with both: with λ = −v of both D = 1/(2 Ron) [1, −1; −1, 1] + 1/(4R) [1, 1; 1, 1] for
//! Ron ≪ R, and of 1/R there is what 1/Ron leaves of the digits of doubles, nothing where these are 16 decades apart. With λ = i of one of
//! them its row and column are ±1 and D of the other is 1/R. What a junction leaks counts with D, though it is part of its law, or what it conducts at
//! rest where it leaks nothing: beside 1 mΩ and 7 V the rounding of D λ is 10⁻¹² A.

use std::collections::BTreeSet;

use nalgebra::DMatrix;

use super::Reduction;
use crate::algebra::{Field, entry, part};
use crate::law::Law;
use crate::lcs::Role;
use crate::mna::StaticMultiport;
use crate::settings::tolerances::ranks::{COUPLED, LEAKAGE, RANK};

/// Of what digits are looked for: an exchange may hide leaks that were seen before, and is not to undo others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Digits {
    All,
    Leaks,
}

/// The pairs that others follow in D + Dᵀ but for less than [`RANK`] of themselves, which is not nothing: the independent ones of them, by the
/// largest pivots of an exact factorisation L Δ Lᵀ. `None` where there are none.
pub(super) fn lost<F: Field>(
    behaviour: &StaticMultiport,
    reduction: &Reduction<F>,
    of: Digits,
) -> Option<Vec<usize>> {
    let blocks = blocks(reduction);
    let blocks = blocks.iter().filter(|block| block.len() > 1);
    let mut lost: Vec<usize> = blocks
        .flat_map(|block| lost_in(behaviour, reduction, block, of))
        .collect();
    lost.sort_unstable();
    lost.dedup();
    (!lost.is_empty()).then_some(lost)
}

/// The ports that D connects, in order.
fn blocks<F: Field>(reduction: &Reduction<F>) -> Vec<Vec<usize>> {
    let (n, m) = (reduction.states.len(), reduction.pairs.len());
    let mut neighbours = vec![Vec::new(); m];
    for (i, y) in reduction.y.iter().enumerate() {
        for (c, _) in part(y, n..n + m) {
            neighbours[i].push(c - n);
            neighbours[c - n].push(i);
        }
    }
    let mut open = vec![true; m];
    let mut blocks = Vec::new();
    for first in 0..m {
        let (mut block, mut next) = (Vec::new(), 0);
        if std::mem::take(&mut open[first]) {
            block.push(first);
        }
        while let Some(&i) = block.get(next) {
            next += 1;
            let others = neighbours[i].iter();
            block.extend(others.filter(|&&j| std::mem::take(&mut open[j])));
        }
        block.sort_unstable();
        blocks.push(block);
    }
    blocks
}

/// Those of a block, by their pairs.
fn lost_in<F: Field>(
    behaviour: &StaticMultiport,
    reduction: &Reduction<F>,
    block: &[usize],
    of: Digits,
) -> Vec<usize> {
    let (n, m) = (reduction.states.len(), block.len());
    let d = |i: usize, j: usize| {
        let d = entry(&reduction.y[block[i]], n + block[j]);
        d.cloned().unwrap_or_else(F::zero)
    };
    let mut rest: Vec<Vec<F>> = (0..m)
        .map(|i| (0..m).map(|j| d(i, j).add(&d(j, i))).collect())
        .collect();
    let unit: Vec<f64> = (0..m)
        .map(|j| match rest[j][j].to_f64() {
            d if d > 0.0 => d.sqrt().recip(),
            _ => 0.0,
        })
        .collect();
    let scaled = DMatrix::from_fn(m, m, |i, j| rest[i][j].to_f64() * unit[i] * unit[j]);
    if !is_suspect(&scaled) {
        return Vec::new();
    }
    let leaks = |j: usize| {
        let (pair, _) = reduction.pairs[block[j]];
        let Law::Exponential(diode) = behaviour.pairs[pair].port.law else {
            return false;
        };
        let siemens = if diode.leak > 0.0 {
            diode.leak
        } else {
            diode.conductance_at_rest()
        };
        siemens * unit[j] * unit[j] <= LEAKAGE
    };
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
            let is_lost = leaks(j) || of == Digits::All && !rest[j][j].is_zero();
            if j != p && before > RANK && left[j] <= RANK && is_lost {
                let followed = pivots.iter().filter(|(_, share)| share[j].abs() > COUPLED);
                lost.extend(followed.map(|(p, _)| reduction.pairs[block[*p]].0));
            }
        }
    }
    lost
}

/// Whether an eigenvalue of a matrix with unit diagonal is so small that it may be lost.
fn is_suspect(scaled: &DMatrix<f64>) -> bool {
    let sound = scaled.iter().all(|v| v.is_finite());
    sound && scaled.symmetric_eigenvalues().min() <= RANK * scaled.nrows() as f64
}

/// The behaviour with the other quantity of these devices preferred as λ.
pub(super) fn exchanged(behaviour: &StaticMultiport, pairs: &BTreeSet<usize>) -> StaticMultiport {
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
