//! Sweeping processes: Brogliato-Thibault Theorem 3.5 and section 3.3.

use nalgebra::DVector;

use super::{
    Hypotheses, Theorem, everything, half_lines, input_output, over_swaps, regularity, split,
};
use crate::check::facts::{Facts, Swap};
use crate::check::feedthrough::Feedthrough;
use crate::check::program::Inequalities;
use crate::settings::tolerances::ranks::RANK;

/// Corners of the box of source values up to which "S(t) is nonempty" is checked one by one.
const MAX_CORNERS: usize = 1 << 10;

/// K(t) = {x : Cx + Gu(t) + F ≥ 0} is nonempty: by (22) Rge(C) − R₊ᵐ = Rᵐ, or at every corner of the box of source values.
fn nonempty(facts: &Facts, swap: &Swap, ports: &[usize], h: &mut Hypotheses) {
    let c = swap.system.c.select_rows(ports);
    let all = vec![true; ports.len()];
    let qualified = Inequalities {
        g: c.clone(),
        h: DVector::zeros(ports.len()),
        strict: all.clone(),
    }
    .widest();
    if let Some(point) = qualified.filter(|p| p.is_strict()) {
        h.need(
            true,
            format!(
                "S(t) is never empty: (22) holds, some x has Cx > 0 (slack {:.2})",
                point.slack
            ),
        );
        return;
    }
    let f = swap.f.select_rows(ports);
    let g = swap.g.select_rows(ports);
    let moving: Vec<usize> = (0..g.ncols())
        .filter(|&k| g.column(k).amax() > 0.0)
        .collect();
    if moving.len() >= usize::BITS as usize || 1_usize << moving.len() > MAX_CORNERS {
        h.need(
            None,
            "(22) fails, and there are too many sources to check that S(t) is never empty",
        );
        return;
    }
    for corner in 0..1_usize << moving.len() {
        let mut offset = f.clone();
        for (bit, &k) in moving.iter().enumerate() {
            let excitation = facts.driven[k].1;
            let value = if corner >> bit & 1 == 1 {
                excitation.high
            } else {
                excitation.low
            };
            if !value.is_finite() {
                h.need(
                    None,
                    format!("(22) fails and {} is unbounded", facts.driven[k].0),
                );
                return;
            }
            offset += g.column(k) * value;
        }
        let point = Inequalities {
            g: c.clone(),
            h: offset,
            strict: all.clone(),
        }
        .widest();
        if !point.is_some_and(|p| p.is_feasible()) {
            h.need(
                false,
                "(22) fails and S(t) is empty for some values of the sources",
            );
            return;
        }
    }
    h.need(
        true,
        "S(t) is nonempty at every corner of the range of the sources (though (22) fails)",
    );
}
/// Brogliato-Thibault Theorem 3.5.
pub(super) fn sweeping(facts: &Facts) -> Theorem {
    let gives = regularity(facts, &mut Hypotheses::default());
    over_swaps(facts, |swap, h| {
        half_lines(swap, h);
        let zero = swap.system.d.amax() <= RANK * (1.0 + swap.system.b.amax().min(1.0));
        h.need(
            zero,
            if zero {
                "D = 0".into()
            } else {
                format!("D ≠ 0 (largest entry {:.2e})", swap.system.d.amax())
            },
        );
        if zero {
            input_output(facts, swap, &everything(swap), h);
            nonempty(facts, swap, &everything(swap), h);
            regularity(facts, h);
        }
    })
    .theorem("Brogliato-Thibault Theorem 3.5", gives)
}
/// Brogliato-Thibault section 3.3.
pub(super) fn block_sweeping(facts: &Facts) -> Theorem {
    let gives = regularity(facts, &mut Hypotheses::default());
    over_swaps(facts, |swap, h| {
        half_lines(swap, h);
        let (free, fed) = split(&swap.system.d);
        let d1 = swap.system.d.select_rows(&fed).select_columns(&fed);
        let class = Feedthrough::of(&d1);
        h.need(
            if fed.is_empty() {
                Some(false)
            } else {
                class.p_matrix
            },
            match class.p_matrix {
                _ if fed.is_empty() => "D = 0: this is Theorem 3.5".into(),
                Some(true) => format!(
                    "D = diag(D₁, 0) with D₁ ({0}×{0}) a P-matrix{1}",
                    fed.len(),
                    swap.note()
                ),
                Some(false) => format!("D₁ ({0}×{0}) is not a P-matrix", fed.len()),
                None => format!(
                    "whether D₁ ({0}×{0}) is a P-matrix is not decided",
                    fed.len()
                ),
            },
        );
        if class.p_matrix == Some(true) && !fed.is_empty() {
            if free.is_empty() {
                h.need(
                    true,
                    "no port without feedthrough: the system is a Lipschitz differential equation",
                );
            } else {
                input_output(facts, swap, &free, h);
                nonempty(facts, swap, &free, h);
            }
            regularity(facts, h);
        }
    })
    .theorem("Brogliato-Thibault section 3.3", gives)
}
