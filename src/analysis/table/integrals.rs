//! Integrals over a stretch in closed form.
//!
//! With w' = 𝒜 w the integrals of w, of w wᵀ and of w e^{−jωt} over a span follow from those over half of it:
//!
//! ```text
//! m(2t) = m(t) + Φ m(t),   L(2t) L(2t)ᵀ = L Lᵀ + Φ L (Φ L)ᵀ + d dᵀ/2t with d = Φ m − m,   F(2t) = F + e^{−jωt} Φ F,   Φ = e^{𝒜 t}.
//! ```
//!
//! The factor L of ∫ (w − m/t) (w − m/t)ᵀ is kept instead of ∫ w wᵀ, by a QR factorisation at each doubling: a small difference of large quantities, the
//! voltage across a small resistance, then loses the digits that it loses at a single instant, and not twice as many; and so does a ripple on a large mean.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector};

use crate::analysis::variation::{Motion, times};
use crate::integrate::Error;
use crate::linalg::gauss::{NODES, POINTS, WEIGHTS};
use crate::linalg::powers::halvings;
use crate::settings::tolerances::exponentials::SERIES;

/// The integrals of w over a stretch.
pub(super) struct Integrals {
    /// ∫ w dt.
    pub(super) mean: DVector<f64>,
    /// L of ∫ (w − w̄) (w − w̄)ᵀ dt = L Lᵀ with the mean w̄.
    pub(super) factor: DMatrix<f64>,
    /// ∫ w e^{−jω(t − t₀)} dt, where t₀ is the beginning.
    pub(super) harmonic: Option<DVector<Complex<f64>>>,
}

/// Over the whole of a motion from w; with the harmonic of an angular frequency, rad/s.
pub(super) fn over(
    motion: &mut Motion<'_>,
    w: &DVector<f64>,
    omega: Option<f64>,
) -> Result<Integrals, Error> {
    let turns = omega.map_or(0.0, |omega| omega * motion.seconds / SERIES);
    let halvings = motion.bottom.max(halvings(turns));
    let t = motion.part(halvings);
    let series = motion.series(w, t);
    let at = |s: f64| {
        let terms = series.column_iter().rev();
        terms.fold(DVector::zeros(w.len()), |sum, term| sum * s + term)
    };
    let mut found = Integrals {
        mean: DVector::zeros(w.len()),
        factor: DMatrix::zeros(w.len(), POINTS),
        harmonic: omega.map(|_| DVector::zeros(w.len())),
    };
    for (k, (node, weight)) in NODES.into_iter().zip(WEIGHTS).enumerate() {
        let value = at(node);
        found.mean.axpy(weight * t, &value, 1.0);
        found.factor.set_column(k, &value);
        if let (Some(omega), Some(harmonic)) = (omega, &mut found.harmonic) {
            let turn = Complex::from_polar(weight * t, -omega * node * t);
            *harmonic += value.map(|v| turn * v);
        }
    }
    let mean = &found.mean / t;
    for (mut column, weight) in found.factor.column_iter_mut().zip(WEIGHTS) {
        column -= &mean;
        column *= (weight * t).sqrt();
    }
    for k in (1..=halvings).rev() {
        let part = motion.part(k);
        let step = motion.step(k)?;
        let apart = step * &found.mean;
        let second = &found.factor + step * &found.factor;
        let count = second.ncols();
        let mut second = second.insert_column(count, 0.0);
        second.set_column(count, &(&apart / (2.0 * part).sqrt()));
        found.mean = &found.mean * 2.0 + apart;
        found.factor = joined(&found.factor, &second);
        if let (Some(omega), Some(harmonic)) = (omega, &mut found.harmonic) {
            let turn = Complex::from_polar(1.0, (-omega * part) % TAU);
            let moved = times(step, harmonic) + &*harmonic;
            *harmonic += moved * turn;
        }
    }
    Ok(found)
}

/// L with L Lᵀ = a aᵀ + b bᵀ.
fn joined(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, columns) = (a.nrows(), a.ncols() + b.ncols());
    let mut both = DMatrix::zeros(columns, rows);
    both.rows_mut(0, a.ncols()).copy_from(&a.transpose());
    both.rows_mut(a.ncols(), b.ncols())
        .copy_from(&b.transpose());
    if columns <= rows.max(2 * POINTS) {
        return both.transpose();
    }
    both.qr().r().transpose()
}
