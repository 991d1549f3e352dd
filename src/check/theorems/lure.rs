//! Multivalued Lur'e systems: RR-7158 Theorems 1 and 2.

use nalgebra::{DMatrix, DVector};

use super::{Hypotheses, Theorem, everything, input_output, lossless, over_swaps, split};
use crate::check::facts::{Facts, Swap};
use crate::check::feedthrough::Feedthrough;
use crate::check::program::Inequalities;
use crate::settings::tolerances::ranks::RANK;

fn undriven_output(facts: &Facts, h: &mut Hypotheses) {
    if facts.drives_y() {
        let names: Vec<&str> = (0..facts.driven.len())
            .filter(|&k| facts.g_driven.column(k).amax() > 0.0)
            .map(|k| facts.driven[k].0.as_str())
            .collect();
        h.need(
            false,
            format!("y depends on time through {}", names.join(", ")),
        );
    } else {
        h.need(true, "y does not depend explicitly on time");
    }
}

fn continuous_forcing(facts: &Facts, h: &mut Hypotheses) {
    let edges: Vec<&str> = facts
        .driven
        .iter()
        .filter(|(_, x)| x.jumps)
        .map(|(n, _)| n.as_str())
        .collect();
    if edges.is_empty() {
        h.need(
            true,
            "f = Eu is continuous with locally integrable derivative",
        );
    } else {
        h.need(false, format!("f = Eu jumps ({})", edges.join(", ")));
    }
}

/// Assumption 1: every φ_j^{*,−} is continuous somewhere, i.e. λ_j ranges over an interval.
fn assumption_1(swap: &Swap, h: &mut Hypotheses) {
    let points: Vec<&str> = swap
        .laws
        .iter()
        .filter(|l| l.lambda.0 >= l.lambda.1)
        .map(|l| l.device.as_str())
        .collect();
    if points.is_empty() {
        h.need(
            true,
            "Assumption 1: every conjugate is finite on an interval",
        );
    } else {
        h.need(
            false,
            format!("Assumption 1 fails at {}", points.join(", ")),
        );
    }
}

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
fn assumption_4(swap: &Swap, fed: &[usize], h: &mut Hypotheses) {
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
    // (20): no nonzero z in ker(D + Dᵀ) ∩ K∞ with Dz ∈ K∞*; for half lines z ≥ 0, Dz ≥ 0.
    let n = lossless(&d);
    let unbounded = cones && {
        let rows = 2 * fed.len() + 1;
        let mut g = DMatrix::zeros(rows, n.ncols());
        g.view_mut((0, 0), n.shape()).copy_from(&n);
        g.view_mut((fed.len(), 0), n.shape()).copy_from(&(&d * &n));
        let sum = DMatrix::from_element(1, fed.len(), 1.0) * &n;
        g.view_mut((2 * fed.len(), 0), sum.shape()).copy_from(&sum);
        let mut strict = vec![false; rows];
        strict[2 * fed.len()] = true;
        Inequalities {
            g,
            h: DVector::zeros(rows),
            strict,
        }
        .widest()
        .is_some_and(|p| p.is_strict())
    };
    let c = swap.system.c.select_rows(fed);
    let b = swap.system.b.select_columns(fed);
    let sum = &d + d.transpose();
    let range = leaves(&c, &sum);
    let size = b.amax().max(f64::MIN_POSITIVE);
    let kernel = (&b * &n).amax() / size;
    if !cones {
        h.need(
            None,
            "Proposition 3: (20) is checked for complementary pairs only",
        );
    }
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

/// RR-7158 Theorem 1.
pub(super) fn kato(facts: &Facts) -> Theorem {
    over_swaps(facts, |swap, h| {
        undriven_output(facts, h);
        continuous_forcing(facts, h);
        assumption_1(swap, h);
        let (free, fed) = split(&swap.system.d);
        if !free.is_empty() {
            input_output(facts, swap, &free, h);
            slater(swap, &free, h);
        }
        if !fed.is_empty() {
            assumption_4(swap, &fed, h);
        }
    })
    .theorem(
        "RR-7158 Theorem 1",
        "a unique continuous solution with locally bounded derivative, for every admissible initial state",
    )
}

/// Assumption 3: some x has C_I x + F in the interior of dom Φ_I.
fn slater(swap: &Swap, free: &[usize], h: &mut Hypotheses) {
    let c = swap.system.c.select_rows(free);
    let point = interior(
        &c,
        &DMatrix::zeros(free.len(), 0),
        &swap.f.select_rows(free),
        swap,
        free,
    );
    match point {
        Some(slack) => h.need(
            true,
            format!("Assumption 3: Cx is interior to dom Φ for some x (slack {slack:.2})"),
        ),
        None => h.need(false, "Assumption 3: no x has Cx in the interior of dom Φ"),
    };
}

/// The slack with which y = Cx + Dλ + F lies inside dom Φ for some x and some λ in the closure of dom Φ^{*,−}.
fn interior(
    c: &DMatrix<f64>,
    d: &DMatrix<f64>,
    f: &DVector<f64>,
    swap: &Swap,
    ports: &[usize],
) -> Option<f64> {
    let (n, m) = (c.ncols(), d.ncols());
    let (mut rows, mut offsets, mut strict) = (Vec::new(), Vec::new(), Vec::new());
    for (k, &j) in ports.iter().enumerate() {
        let law = &swap.laws[j];
        let mut y = DVector::zeros(n + m);
        y.rows_mut(0, n).copy_from(&c.row(k).transpose());
        y.rows_mut(n, m).copy_from(&d.row(k).transpose());
        if law.y.0.is_finite() {
            rows.push(y.clone());
            offsets.push(f[k] - law.y.0);
            strict.push(true);
        }
        if law.y.1.is_finite() {
            rows.push(-&y);
            offsets.push(law.y.1 - f[k]);
            strict.push(true);
        }
        if m > 0 {
            let mut unit = DVector::zeros(n + m);
            unit[n + k] = 1.0;
            if law.lambda.0.is_finite() {
                rows.push(unit.clone());
                offsets.push(-law.lambda.0);
                strict.push(false);
            }
            if law.lambda.1.is_finite() {
                rows.push(-&unit);
                offsets.push(law.lambda.1);
                strict.push(false);
            }
        }
    }
    if rows.is_empty() {
        return Some(1.0);
    }
    let g = DMatrix::from_columns(&rows).transpose();
    let point = Inequalities {
        g,
        h: DVector::from_vec(offsets),
        strict,
    }
    .widest()?;
    point.is_strict().then_some(point.slack)
}

/// RR-7158 Theorem 2.
pub(super) fn maximal_monotone(facts: &Facts) -> Theorem {
    over_swaps(facts, |swap, h| {
        undriven_output(facts, h);
        assumption_1(swap, h);
        input_output(facts, swap, &everything(swap), h);
        let psd = Feedthrough::of(&swap.system.d).psd;
        h.need(psd, if psd { "D ⪰ 0" } else { "D + Dᵀ has a negative eigenvalue" });
        if psd {
            match interior(&swap.system.c, &swap.system.d, &swap.f, swap, &everything(swap)) {
                Some(slack) => {
                    h.need(true, format!("R(CR⁻¹) meets the relative interior of R(D + ∂Φ^{{*,−}}) (slack {slack:.2})"))
                }
                None => h.need(false, "R(CR⁻¹) does not meet the relative interior of R(D + ∂Φ^{*,−})"),
            };
        }
    })
    .theorem("RR-7158 Theorem 2", "a unique Lipschitz continuous solution from every x₀ with −Cx₀ ∈ R(D + ∂Φ^{*,−})")
}
