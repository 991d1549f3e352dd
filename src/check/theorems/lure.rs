//! Multivalued Lur'e systems: RR-7158 Theorems 1 and 2.

use nalgebra::{DMatrix, DVector};

use super::semidefinite::assumption_4;
use super::{Hypotheses, Theorem, everything, input_output, over_swaps, split};
use crate::check::facts::{Facts, Swap};
use crate::check::feedthrough::Feedthrough;
use crate::check::program::Inequalities;

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
