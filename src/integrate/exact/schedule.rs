//! Switches that piecewise straight sources alone control: their times need no guard.

use nalgebra::{DMatrix, DVector};

use super::clock::Clock;
use super::exosystem::Exosystem;
use super::mode::over_w;
use crate::integrate::switching::{Known, ROUNDINGS, Threshold};
use crate::lcs::{Lcs, Rows};

/// The control of one switch as a combination of straight columns of z, less nothing: c = row · z.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Drive {
    /// The switch.
    pub(crate) switch: usize,
    /// What is not zero in its row over z, by column.
    terms: Vec<(usize, f64)>,
    /// The same of its derivative, row · S.
    slopes: Vec<(usize, f64)>,
    /// When its control next passes the threshold on the present pieces, s.
    pub(crate) next: f64,
}

/// The drives of a system's switches but the clocks; switches with another control are guarded instead.
pub(crate) fn drives(lcs: &Lcs, exosystem: &Exosystem, clocks: &[Clock]) -> Vec<Drive> {
    let Rows { x, lambda, .. } = &lcs.controls;
    let zero = |m: &DMatrix<f64>, i: usize| i >= m.nrows() || m.row(i).iter().all(|v| *v == 0.0);
    let rows = over_w(&lcs.controls, lcs.n(), exosystem);
    (0..rows.nrows())
        .filter(|&i| zero(x, i) && zero(lambda, i))
        .filter(|&i| clocks.iter().all(|clock| clock.switch != i))
        .filter_map(|i| {
            let row: Vec<f64> = rows.row(i).iter().skip(lcs.n()).copied().collect();
            let straight = row
                .iter()
                .enumerate()
                .all(|(k, v)| *v == 0.0 || exosystem.is_straight(k));
            straight.then(|| Drive {
                switch: i,
                terms: terms(&row),
                slopes: terms(
                    exosystem
                        .generator()
                        .tr_mul(&DVector::from_column_slice(&row))
                        .as_slice(),
                ),
                next: f64::INFINITY,
            })
        })
        .collect()
}

/// What is not zero in a row, by column.
fn terms(row: &[f64]) -> Vec<(usize, f64)> {
    let entries = row.iter().copied().enumerate();
    entries.filter(|(_, r)| *r != 0.0).collect()
}

/// Such a row times z.
fn dot(terms: &[(usize, f64)], z: &[f64]) -> f64 {
    terms.iter().map(|&(k, r)| r * z[k]).sum()
}

impl Drive {
    /// Whether it is the control with this row over z.
    pub(crate) fn is(&self, row: &[f64]) -> bool {
        self.terms == terms(row)
    }

    /// c at z.
    pub(crate) fn control(&self, z: &[f64]) -> f64 {
        dot(&self.terms, z)
    }

    /// Whether the switch leaves position `on` right after time t with the sources at z.
    pub(crate) fn leaves(&self, threshold: &Threshold, on: bool, t: f64, z: &[f64]) -> bool {
        let size =
            |terms: &[(usize, f64)]| -> f64 { terms.iter().map(|&(k, r)| (r * z[k]).abs()).sum() };
        let steepness = size(&self.slopes);
        let control = Known {
            value: self.control(z),
            noise: ROUNDINGS * f64::EPSILON * (size(&self.terms) + steepness * t.abs()),
        };
        let slope = Known {
            value: dot(&self.slopes, z),
            noise: ROUNDINGS * f64::EPSILON * steepness,
        };
        threshold.leaves(on, control, slope)
    }

    /// Finds the next passage after t, where the sources stand at z and their pieces last until `end`.
    pub(crate) fn look_ahead(
        &mut self,
        threshold: &Threshold,
        on: bool,
        t: f64,
        z: &[f64],
        end: f64,
    ) {
        let slope = dot(&self.slopes, z);
        let level = if on {
            threshold.off_below
        } else {
            threshold.on_above
        };
        let towards = if on { slope < 0.0 } else { slope > 0.0 };
        let passage = t + ((level - self.control(z)) / slope).max(0.0);
        self.next = if towards && passage < end {
            passage
        } else {
            f64::INFINITY
        };
    }
}
