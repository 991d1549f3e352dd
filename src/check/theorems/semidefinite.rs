//! Assumption 4 of RR-7158: λ_II, or B_II λ_II, is a Lipschitz function of the state (Propositions 1 to 3, Corollary 1).

use nalgebra::{DMatrix, DVector};

use super::{Hypotheses, lossless};
use crate::check::facts::Swap;
use crate::check::feedthrough::Feedthrough;
use crate::check::laws::PortLaw;
use crate::check::program::Inequalities;
use crate::settings::tolerances::ranks::RANK;

/// Largest angle by which range(inner) leaves range(outer): ‖(I − QQᵀ)inner‖ relative to ‖inner‖, column-scaled.
fn leaves(inner: &DMatrix<f64>, outer: &DMatrix<f64>) -> f64 {
    let unit = |m: &DMatrix<f64>| {
        let columns: Vec<DVector<f64>> = m
            .column_iter()
            .filter(|c| c.amax() > 0.0)
            .map(|c| c.normalize())
            .collect();
        if columns.is_empty() {
            DMatrix::zeros(m.nrows(), 0)
        } else {
            DMatrix::from_columns(&columns)
        }
    };
    let (inner, outer) = (unit(inner), unit(outer));
    if inner.ncols() == 0 {
        return 0.0;
    }
    if outer.ncols() == 0 {
        return 1.0;
    }
    let svd = outer.clone().svd(true, false);
    let Some(u) = svd.u else { return 1.0 };
    let top = svd.singular_values.max();
    let basis: Vec<usize> = (0..svd.singular_values.len())
        .filter(|&k| svd.singular_values[k] > RANK * top)
        .collect();
    let q = u.select_columns(&basis);
    (&inner - &q * (q.transpose() * &inner))
        .column_iter()
        .map(|c| c.norm())
        .fold(0.0, f64::max)
}

/// Assumption 4 through Propositions 1, 2 or 3.
pub(super) fn assumption_4(swap: &Swap, fed: &[usize], h: &mut Hypotheses) {
    let d = swap.system.d.select_rows(fed).select_columns(fed);
    let class = Feedthrough::of(&d);
    let cones = fed.iter().all(|&j| swap.laws[j].half_line);
    if class.pd {
        h.need(true, format!("Proposition 1: D_II ≻ 0{}", swap.note()));
        return;
    }
    if cones && class.p_matrix == Some(true) {
        h.need(
            true,
            format!(
                "Proposition 2: D_II is a P-matrix and λ, y are complementary{}",
                swap.note()
            ),
        );
        return;
    }
    if !class.psd {
        h.need(
            if cones && class.p_matrix.is_none() {
                None
            } else {
                Some(false)
            },
            "Assumption 4: D_II is neither positive semidefinite nor known to be a P-matrix",
        );
        return;
    }
    let n = lossless(&d);
    let laws: Vec<&PortLaw> = fed.iter().map(|&j| &swap.laws[j]).collect();
    let unbounded = recedes(&laws, &d, &n);
    let c = swap.system.c.select_rows(fed);
    let b = swap.system.b.select_columns(fed);
    let sum = &d + d.transpose();
    let range = leaves(&c, &sum);
    let size = b.amax().max(f64::MIN_POSITIVE);
    let kernel = (&b * &n).amax() / size;
    h.need(
        !unbounded,
        if unbounded {
            "Proposition 3: (20) fails"
        } else {
            "Proposition 3: D_II ⪰ 0 and (20)"
        },
    );
    h.need(
        range <= RANK.sqrt() && kernel <= RANK.sqrt(),
        format!("(21) R(C_II) ⊂ R(D_II + D_IIᵀ) and ker(D_II + D_IIᵀ) ⊂ ker(B_II) up to {range:.1e} and {kernel:.1e}"),
    );
}

/// Whether (20) fails: some z ≠ 0 in ker(D + Dᵀ), of which `n` is a basis, recedes in dom Φ^{*,−} with Dz in the dual cone of
/// dom (Φ^{*,−})_∞. Port by port z_j ≥ 0 where λ_j is bounded below; (φ_j^{*,−})_∞(z) = sup {−zy : y ∈ dom φ_j} is finite for
/// z > 0 where y_j is bounded below, and then (Dz)_j ≥ 0. For bounds above with the signs reversed.
fn recedes(laws: &[&PortLaw], d: &DMatrix<f64>, n: &DMatrix<f64>) -> bool {
    // Rows are scaled to size one below: rounding must not become a direction.
    let clean =
        |m: &DMatrix<f64>, size: f64| m.map(|v| if v.abs() <= RANK * size { 0.0 } else { v });
    let (z, w) = (clean(n, 1.0), clean(&(d * n), d.amax()));
    let mut rows = Vec::new();
    for (j, law) in laws.iter().enumerate() {
        for (row, bounds) in [(z.row(j), law.lambda), (w.row(j), law.y)] {
            if bounds.0.is_finite() {
                rows.push(row.into_owned());
            }
            if bounds.1.is_finite() {
                rows.push(-row);
            }
        }
    }
    let k = n.ncols();
    let mut g = DMatrix::zeros(rows.len() + 1, k);
    for (i, row) in rows.iter().enumerate() {
        g.set_row(i, row);
    }
    let mut strict = vec![false; rows.len() + 1];
    strict[rows.len()] = true;
    (0..2 * k).any(|way| {
        let mut g = g.clone();
        g[(rows.len(), way / 2)] = if way % 2 == 0 { 1.0 } else { -1.0 };
        let cone = Inequalities {
            h: DVector::zeros(g.nrows()),
            g,
            strict: strict.clone(),
        };
        cone.widest().is_some_and(|point| point.is_strict())
    })
}
