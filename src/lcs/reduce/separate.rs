//! Fast states apart from slow ones, before their numbers are rounded.
//!
//! Currents that share an enormous resistance R decay together: with M the metric of stored energy and i = bᵀx the current through R
//!
//! ```text
//! x' = A x = (A_slow − M⁻¹b R bᵀ) x,
//! ```
//!
//! and in the entries of A written as doubles A_slow has no digit left once R is 10¹⁶ times what else moves x. It has all of them in the
//! states ξ = T⁻¹x made of i and of what M⁻¹b leaves alone. With p the state of the largest |A_pp| (M-symmetric A_fast: the pivot of
//! complete pivoting, whatever the units) they are
//!
//! ```text
//! ξ_p = x_p + Σ_j α_j x_j,   α_j = A_pj/A_pp,             ξ_j = x_j − β_j ξ_p,   β_j = (M⁻¹b)_j/(M⁻¹b)_p.
//! ```
//!
//! α takes R out of all columns but p, β out of all rows but p. T is exact as A is, so that nothing is approximated: where α and β are
//! not those of A_fast alone the rest is slow. Several resistances take one such step each. Resistances close to 0 between capacitors are
//! the same with voltages.

use nalgebra::DMatrix;

use crate::algebra::{Field, SparseRow, add_scaled, add_term, entry, part};
use crate::lcs::Lcs;
use crate::settings::tolerances::exponentials::APART;

use super::Reduction;

/// Whether a system, as it was reduced in the basis of its names, has fast states to be taken apart from slow ones.
pub(crate) fn is_coupled(lcs: &Lcs, span: f64) -> bool {
    let states: Vec<usize> = (0..lcs.n()).collect();
    !fast_among(&states, &lcs.a, &lcs.energy, 1.0 / span, true).is_empty()
}

/// The states of a system that are faster than all the others and than what moves within `span` seconds by [`APART`], those among them that it was reduced with and
/// those that are coupled with the others by little.
pub(crate) fn fast_states(lcs: &Lcs, span: f64) -> Vec<usize> {
    let others = (0..lcs.n()).filter(|k| !lcs.fast.contains(k));
    let others: Vec<usize> = others.collect();
    let more = fast_among(&others, &lcs.a, &lcs.energy, 1.0 / span, false);
    lcs.fast.iter().copied().chain(more).collect()
}

/// Of these states of x' = A x those that are faster than all the others and than `slowest`, 1/s, by [`APART`], in the order of
/// elimination; if their coupling with the others is, too, where `coupled` asks for it.
fn fast_among(
    states: &[usize],
    a: &DMatrix<f64>,
    energy: &DMatrix<f64>,
    slowest: f64,
    coupled: bool,
) -> Vec<usize> {
    let n = states.len();
    // In units of √energy the coupling of a passive circuit is as large in one direction as in the other.
    let stored = |&i: &usize| energy.get((i, i)).map_or(0.0, |stored| stored.sqrt());
    let unit: Vec<f64> = states.iter().map(stored).collect();
    if n < 2 || !unit.iter().all(|u| *u > 0.0 && u.is_finite()) {
        return Vec::new();
    }
    let whole = DMatrix::from_fn(n, n, |i, j| a[(states[i], states[j])] * unit[i] / unit[j]);
    let largest = |rows: &[usize], columns: &[usize], of: &DMatrix<f64>| {
        let entries = rows
            .iter()
            .flat_map(|&i| columns.iter().map(move |&j| (i, j)));
        entries.fold(0.0_f64, |m, at| m.max(of[at].abs()))
    };
    let mut rest = whole.clone();
    let (mut slow, mut fast): (Vec<usize>, Vec<usize>) = ((0..n).collect(), Vec::new());
    let (mut fastest, mut apart) = (f64::INFINITY, 0);
    while slow.len() > 1 {
        let size = |k: usize| rest[(k, k)].abs();
        let p = slow
            .iter()
            .copied()
            .fold(slow[0], |p, k| if size(k) > size(p) { k } else { p });
        let pivot = rest[(p, p)];
        fastest = fastest.min(pivot.abs());
        if fastest <= APART * slowest {
            break;
        }
        slow.retain(|&j| j != p);
        fast.push(p);
        for &i in &slow {
            let factor = rest[(i, p)] / pivot;
            for &j in &slow {
                rest[(i, j)] -= factor * rest[(p, j)];
            }
        }
        let left = largest(&slow, &slow, &rest).max(slowest);
        let coupling = largest(&slow, &fast, &whole).max(largest(&fast, &slow, &whole));
        let rate = if coupled {
            fastest.min(coupling)
        } else {
            fastest
        };
        if rate > APART * left {
            apart = fast.len();
        }
    }
    fast.truncate(apart);
    fast.into_iter().map(|k| states[k]).collect()
}

impl<F: Field> Reduction<F> {
    /// Changes the basis of the states so that fast and slow ones are coupled by no more than the slow rates. A system without such a
    /// coupling stays as it is.
    pub(super) fn separate(&mut self, span: f64) {
        let n = self.states.len();
        let mut slow: Vec<usize> = (0..n).collect();
        loop {
            let of = |rows: &[SparseRow<F>]| {
                let mut matrix = DMatrix::zeros(n, n);
                for (i, row) in rows.iter().enumerate() {
                    for (j, x) in part(row, 0..n) {
                        matrix[(i, *j)] = x.to_f64();
                    }
                }
                matrix
            };
            let fast = fast_among(&slow, &of(&self.rates), &of(&self.energy), 1.0 / span, true);
            if fast.is_empty() {
                return;
            }
            for p in fast {
                slow.retain(|&j| j != p);
                self.take_apart(p, &slow);
                self.fast.push(p);
            }
        }
    }

    /// Makes state p the fast one beside these others.
    fn take_apart(&mut self, p: usize, others: &[usize]) {
        let share = |rates: &[SparseRow<F>], i: usize, j: usize| {
            Some(entry(&rates[i], j)?.div(entry(&rates[p], p)?))
        };
        let alpha = others.iter().map(|&j| share(&self.rates, p, j));
        for (&j, alpha) in others.iter().zip(alpha.collect::<Vec<_>>()) {
            if let Some(alpha) = alpha {
                self.add_to_state(p, j, &alpha);
            }
        }
        let beta = others.iter().map(|&j| share(&self.rates, j, p));
        for (&j, beta) in others.iter().zip(beta.collect::<Vec<_>>()) {
            if let Some(beta) = beta {
                self.add_to_state(j, p, &beta.neg());
            }
        }
    }

    /// x_to ← x_to + factor · x_from: in what is written over x the column of `from` loses that part of the column of `to`.
    fn add_to_state(&mut self, to: usize, from: usize, factor: &F) {
        if factor.is_zero() {
            return;
        }
        let minus = factor.neg();
        for rows in [&mut self.rates, &mut self.shift, &mut self.inject] {
            let row = rows[from].clone();
            add_scaled(&mut rows[to], factor, &row);
        }
        let row = self.energy[to].clone();
        add_scaled(&mut self.energy[from], &minus, &row);
        let rows = (self.rates.iter_mut())
            .chain(&mut self.y)
            .chain(&mut self.s)
            .chain(&mut self.energy)
            .chain(self.readings.iter_mut().map(|r| &mut r.0))
            .chain(self.guards.iter_mut().map(|g| &mut g.0))
            .chain(self.constraints.iter_mut().map(|c| &mut c.0));
        for row in rows {
            if let Some(x) = entry(row, to).cloned() {
                add_term(row, from, &minus, &x);
            }
        }
    }
}
