//! Floquet multipliers, and directions that a return leaves as they are.

use nalgebra::DMatrix;

use crate::algebra::Value;
use crate::circuit::{Circuit, Kind};
use crate::settings::tolerances::periodic::{NEUTRAL, TAKES_PART};

/// Eigenvalues of M, the largest first; `None` where they are not found.
pub(super) fn multipliers(derivative: &DMatrix<f64>) -> Option<Vec<[f64; 2]>> {
    if derivative.is_empty() {
        return Some(vec![]);
    }
    let found = crate::linalg::eigenvalues::eigenvalues(derivative)?;
    let mut found: Vec<[f64; 2]> = found.iter().map(|v| [v.re, v.im]).collect();
    let size = |v: &[f64; 2]| v[0].hypot(v[1]);
    found.sort_by(|a, b| {
        size(b)
            .total_cmp(&size(a))
            .then(b[0].total_cmp(&a[0]))
            .then(b[1].total_cmp(&a[1]))
    });
    Some(found)
}

/// The size of the largest multiplier, where disturbances grow by it.
pub(super) fn growth(derivative: &DMatrix<f64>) -> Option<f64> {
    let [re, im] = *multipliers(derivative)?.first()?;
    Some(re.hypot(im)).filter(|size| *size >= 1.0 + NEUTRAL)
}

/// Whether no disturbance grows in a circuit, whatever its sources do: where resistances are positive and laws monotone, ½ δxᵀ M δx of two of its
/// solutions falls.
pub(super) fn is_dissipative(circuit: &Circuit) -> bool {
    let is_positive = |value: &Value| value.f64 >= 0.0;
    circuit.elements.iter().all(|element| match &element.kind {
        Kind::Resistor(value) | Kind::Capacitor(value) | Kind::Inductor(value) => {
            is_positive(value)
        }
        Kind::VoltageSource(_) | Kind::CurrentSource(_) | Kind::Device(_) => true,
        Kind::Controlled { .. } | Kind::Function { .. } | Kind::Switch(_) => false,
    })
}

/// How many multipliers are 1. Where large gains make one state of another, I − M shrinks a direction that has none.
pub(super) fn neutral_multipliers(derivative: &DMatrix<f64>) -> usize {
    let is_one = |[re, im]: &&[f64; 2]| (re - 1.0).hypot(*im) <= NEUTRAL;
    multipliers(derivative).map_or(derivative.nrows(), |all| all.iter().filter(is_one).count())
}

/// The states that a return leaves as they are together: by direction with multiplier 1, those that take part in it.
pub(super) fn neutral(derivative: &DMatrix<f64>) -> Vec<Vec<usize>> {
    let n = derivative.nrows();
    if n == 0 {
        return vec![];
    }
    let svd = (DMatrix::identity(n, n) - derivative).svd(false, true);
    let Some(directions) = svd.v_t else {
        return vec![];
    };
    let still = svd.singular_values.iter().enumerate();
    let mut still: Vec<_> = still.filter(|(_, value)| **value <= NEUTRAL).collect();
    if still.is_empty() {
        return vec![];
    }
    still.sort_by(|(_, one), (_, other)| one.total_cmp(other));
    still.truncate(neutral_multipliers(derivative));
    let taking_part = |k: usize| {
        let row = directions.row(k);
        let row = row.iter().enumerate();
        row.filter(|(_, v)| v.abs() > TAKES_PART)
            .map(|(j, _)| j)
            .collect()
    };
    still.iter().map(|(k, _)| taking_part(*k)).collect()
}
