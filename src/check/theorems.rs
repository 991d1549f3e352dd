//! The theorems, one by one: each hypothesis with its number, what follows, or which hypothesis fails.

use nalgebra::{DMatrix, DVector};

use super::facts::{Facts, Swap};
use super::feedthrough::Feedthrough;
use super::program::Inequalities;
use crate::passivity::{gradient, strict};

/// Corners of the box of source values up to which "S(t) is nonempty" is checked one by one.
const MAX_CORNERS: usize = 1 << 10;

/// Relative size at which a constant term or the kernel of a matrix counts as zero.
const ZERO: f64 = 1e-10;

/// One statement of the literature, applied to this system.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Theorem {
    /// `RR-7158 Theorem 2`.
    pub statement: String,
    /// Whether its hypotheses hold; `null` where one could not be decided.
    pub holds: Option<bool>,
    /// The hypotheses with their numbers, or the ones that fail.
    pub because: String,
    /// What follows for the user if it holds.
    pub gives: String,
}

/// Hypotheses as they are checked.
#[derive(Debug, Default, Clone)]
struct Hypotheses(Vec<(Option<bool>, String)>);

impl Hypotheses {
    fn need(&mut self, holds: impl Into<Option<bool>>, text: impl Into<String>) -> &mut Self {
        self.0.push((holds.into(), text.into()));
        self
    }

    fn hold(&self) -> Option<bool> {
        if self.0.iter().any(|(h, _)| *h == Some(false)) {
            Some(false)
        } else if self.0.iter().any(|(h, _)| h.is_none()) {
            None
        } else {
            Some(true)
        }
    }

    fn theorem(&self, statement: &str, gives: impl Into<String>) -> Theorem {
        let holds = self.hold();
        let texts: Vec<&str> = self
            .0
            .iter()
            .filter(|(h, _)| *h == holds || holds.is_none() && h.is_none())
            .map(|(_, text)| text.as_str())
            .collect();
        Theorem {
            statement: statement.into(),
            holds,
            because: texts.join("; "),
            gives: gives.into(),
        }
    }
}

/// The first swap for which all hypotheses hold, else what the given roles say.
fn over_swaps(facts: &Facts, check: impl Fn(&Swap, &mut Hypotheses)) -> Hypotheses {
    let mut first = None;
    for swap in &facts.swaps {
        let mut hypotheses = Hypotheses::default();
        check(swap, &mut hypotheses);
        if hypotheses.hold() == Some(true) {
            return hypotheses;
        }
        first.get_or_insert(hypotheses);
    }
    first.unwrap_or_default()
}

/// All statements, in the order of the report.
pub(super) fn all(facts: &Facts) -> Vec<Theorem> {
    let mut list = Vec::new();
    if facts.system.m() == 0 {
        list.push(linear());
    } else {
        list.extend([
            sweeping(facts),
            block_sweeping(facts),
            kato(facts),
            maximal_monotone(facts),
            inputs(facts),
            p_matrix(facts),
            leading_markov(facts),
        ]);
        let well_posed = [0, 1, 2, 3]
            .iter()
            .any(|&k: &usize| list[k].holds == Some(true));
        list.push(order(facts, well_posed));
    }
    list.extend([
        stability(facts),
        lipschitz(facts),
        invariance(facts),
        dissipation(facts),
    ]);
    list
}

fn linear() -> Theorem {
    Hypotheses::default()
        .need(true, "no devices: x' = Ax + Eu + e is linear")
        .theorem(
            "Linear system (no devices)",
            "unique solution for every initial state and every integrable source",
        )
}

fn half_lines(swap: &Swap, h: &mut Hypotheses) {
    let other: Vec<&str> = swap
        .laws
        .iter()
        .filter(|l| !l.half_line)
        .map(|l| l.device.as_str())
        .collect();
    if other.is_empty() {
        h.need(true, "all devices are complementary pairs 0 ≤ λ ⟂ y ≥ 0");
    } else {
        h.need(
            false,
            format!("not a complementary pair: {}", other.join(", ")),
        );
    }
}

fn input_output(facts: &Facts, swap: &Swap, ports: &[usize], h: &mut Hypotheses) {
    let b = swap.system.b.select_columns(ports);
    let c = swap.system.c.select_rows(ports);
    match facts.storage(swap, ports) {
        Some(p) => {
            let from = if gradient::residual(&facts.energy, &b, &c) <= gradient::RESIDUAL && p == facts.energy {
                "the stored energy"
            } else {
                "some P ≻ 0"
            };
            h.need(true, format!("PB = Cᵀ with {from}, residual {:.1e}{}", gradient::residual(&p, &b, &c), swap.note()))
        }
        None => h.need(
            false,
            format!(
                "no P = Pᵀ ≻ 0 with PB = Cᵀ (residual {:.1e} for the stored energy), whatever the roles of the ports",
                gradient::residual(&facts.energy, &b, &c)
            ),
        ),
    };
}

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

fn regularity(facts: &Facts, h: &mut Hypotheses) -> &'static str {
    let edges = facts.edges();
    if edges.is_empty() {
        h.need(true, "Gu is locally absolutely continuous");
        "a unique locally absolutely continuous solution; its state jumps only at t = 0 from an inadmissible start"
    } else {
        h.need(
            true,
            format!(
                "Gu is right-continuous of bounded variation (edges of {})",
                edges.join(", ")
            ),
        );
        "a unique right-continuous solution of bounded variation; at a jump x⁺ is the projection of x⁻ in the metric P"
    }
}

fn everything(swap: &Swap) -> Vec<usize> {
    (0..swap.system.m()).collect()
}

/// Brogliato-Thibault Theorem 3.5.
fn sweeping(facts: &Facts) -> Theorem {
    let gives = regularity(facts, &mut Hypotheses::default());
    over_swaps(facts, |swap, h| {
        half_lines(swap, h);
        let zero = swap.system.d.amax() <= ZERO * (1.0 + swap.system.b.amax().min(1.0));
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

/// Ports whose rows and columns of D vanish (I), and the others (II): RR-7158 (6), Brogliato-Thibault (27).
fn split(d: &DMatrix<f64>) -> (Vec<usize>, Vec<usize>) {
    let size = d.amax();
    (0..d.nrows()).partition(|&j| d.row(j).amax().max(d.column(j).amax()) <= ZERO * size)
}

/// Brogliato-Thibault section 3.3.
fn block_sweeping(facts: &Facts) -> Theorem {
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
        .filter(|&k| svd.singular_values[k] > ZERO * top)
        .collect();
    let q = u.select_columns(&basis);
    (&inner - &q * (q.transpose() * &inner))
        .column_iter()
        .map(|c| c.norm())
        .fold(0.0, f64::max)
}

/// An orthonormal basis of ker(D + Dᵀ).
fn lossless(d: &DMatrix<f64>) -> DMatrix<f64> {
    if d.is_empty() {
        return DMatrix::zeros(0, 0);
    }
    let eigen = (d + d.transpose()).symmetric_eigen();
    let size = d.amax();
    let kernel: Vec<usize> = (0..d.nrows())
        .filter(|&k| eigen.eigenvalues[k].abs() <= ZERO * size)
        .collect();
    eigen.eigenvectors.select_columns(&kernel)
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
        range <= ZERO.sqrt() && kernel <= ZERO.sqrt(),
        format!("(21) R(C_II) ⊂ R(D_II + D_IIᵀ) ⊂ ker(B_II)⊥ up to {range:.1e} and {kernel:.1e}"),
    );
}

/// RR-7158 Theorem 1.
fn kato(facts: &Facts) -> Theorem {
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
fn maximal_monotone(facts: &Facts) -> Theorem {
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

/// Camlibel-Heemels-Schumacher 2002, passive systems with inputs.
fn inputs(facts: &Facts) -> Theorem {
    let mut h = Hypotheses::default();
    half_lines(&facts.swaps[0], &mut h);
    passive(facts, &mut h);
    let system = &facts.system;
    let n = lossless(&system.d);
    // [B; D + Dᵀ] has full column rank iff B is injective on ker(D + Dᵀ).
    let mut bn = &system.b * &n;
    for mut row in bn.row_iter_mut() {
        let size = row.amax();
        if size > 0.0 {
            row /= size;
        }
    }
    let values = if bn.is_empty() {
        DVector::zeros(0)
    } else {
        bn.clone().singular_values()
    };
    let rank = values.iter().filter(|&&s| s > ZERO * values.max()).count();
    let full = rank == n.ncols();
    h.need(
        full,
        if full {
            "[B; D + Dᵀ] has full column rank".into()
        } else {
            format!(
                "[B; D + Dᵀ] lacks {} of full column rank: λ is not unique",
                n.ncols() - rank
            )
        },
    );
    h.need(
        true,
        "the sources are piecewise sums of polynomials, exponentials and sinusoids",
    );
    h.theorem(
        "Camlibel-Heemels-Schumacher 2002 Theorem 7.5 (passive systems with inputs)",
        "a unique solution (x, λ, y) for every initial state and input; impulses only at t = 0 and at edges of the sources",
    )
}

/// Cottle-Pang-Stone Theorem 3.3.7 on the instantaneous problem.
fn p_matrix(facts: &Facts) -> Theorem {
    let mut h = Hypotheses::default();
    half_lines(&facts.swaps[0], &mut h);
    let class = Feedthrough::of(&facts.system.d);
    h.need(
        class.p_matrix,
        match class.p_matrix {
            Some(true) => "D is a P-matrix",
            Some(false) => "D is not a P-matrix",
            None => "whether D is a P-matrix is not decided",
        },
    );
    h.theorem(
        "Brogliato-Thibault section A.4 (D a P-matrix)",
        "λ is a Lipschitz function of x and u: an ordinary differential equation, no state jumps",
    )
}

/// The leading Markov parameter decides whether small implicit steps have exactly one solution.
fn leading_markov(facts: &Facts) -> Theorem {
    let mut h = Hypotheses::default();
    half_lines(&facts.swaps[0], &mut h);
    let system = &facts.system;
    if system.d.amax() == 0.0 {
        let markov = &system.c * &system.b;
        let class = Feedthrough::of(&markov);
        h.need(
            class.p_matrix,
            match class.p_matrix {
                Some(true) => "D = 0 and CB is a P-matrix",
                Some(false) => "D = 0 but CB is not a P-matrix",
                None => "D = 0; whether CB is a P-matrix is not decided",
            },
        );
    } else {
        h.need(false, "D ≠ 0: the leading Markov parameter is D itself");
    }
    h.theorem(
        "Leading Markov parameter a P-matrix",
        "every implicit step D + hC(I − hθA)⁻¹B with h small enough has exactly one solution",
    )
}

/// RR-7158 Remark 7.
fn order(facts: &Facts, well_posed: bool) -> Theorem {
    let mut h = Hypotheses::default();
    let cones = facts.laws.iter().all(|l| l.half_line);
    h.need(
        well_posed,
        if well_posed {
            "the system is well posed by one of the above"
        } else {
            "none of the above applies"
        },
    );
    h.need(
        true,
        if cones {
            "all φ are indicator functions"
        } else {
            "some φ is not an indicator function"
        },
    );
    h.theorem(
        "RR-7158 Remark 7",
        if cones {
            "implicit Euler converges with order 1"
        } else {
            "implicit Euler converges with order 1/2 at least"
        },
    )
}

fn passive(facts: &Facts, h: &mut Hypotheses) {
    match facts.certificate() {
        Some(c) => h.need(
            true,
            format!(
                "passive: (45) with P from the {}, eigenvalue {:.1e}",
                c.from.name(),
                c.residuals.lmi_max_eigenvalue
            ),
        ),
        None => h.need(
            facts.verdict.answer(),
            "not passive, or not decided (see above)",
        ),
    };
}

/// Autonomous, and x = 0 with λ = 0 is a solution (Assumption 7).
fn rests_at_zero(facts: &Facts, h: &mut Hypotheses) {
    if facts.is_autonomous() {
        h.need(true, "autonomous");
    } else {
        let names: Vec<&str> = facts.driven.iter().map(|(n, _)| n.as_str()).collect();
        h.need(
            false,
            format!("not autonomous: driven by {}", names.join(", ")),
        );
    }
    let rests = facts.e.amax() == 0.0
        && facts.laws.iter().zip(facts.f.iter()).all(|(law, &f)| {
            if law.half_line {
                f >= 0.0
            } else {
                law.through_origin && f == 0.0
            }
        });
    h.need(
        rests,
        if rests {
            "Assumption 7: x = 0 is a solution, Φ^{*,−} ≥ Φ^{*,−}(0)"
        } else {
            "Assumption 7 fails: x = 0 is no equilibrium (constant sources)"
        },
    );
}

/// RR-7158 Theorem 3 with Propositions 4 and 5.
fn stability(facts: &Facts) -> Theorem {
    let mut h = Hypotheses::default();
    rests_at_zero(facts, &mut h);
    passive(facts, &mut h);
    let gives = match &facts.strict {
        Some(s) if s.decay_rate > 0.0 => {
            h.need(
                true,
                format!("strictly passive: (46) with ε/2 = {:.6e} 1/s", s.decay_rate),
            );
            format!("‖x(t)‖ ≤ {:.4}·‖x₀‖·exp(−{:.6e} t)", s.bound, s.decay_rate)
        }
        Some(s) => format!("‖x(t)‖ ≤ {:.4}·‖x₀‖", s.bound),
        None => "a bound on ‖x(t)‖ by ‖x₀‖".into(),
    };
    h.theorem("RR-7158 Theorem 3", gives)
}

/// RR-7158 Theorem 4.
fn lipschitz(facts: &Facts) -> Theorem {
    let mut h = Hypotheses::default();
    rests_at_zero(facts, &mut h);
    passive(facts, &mut h);
    let gives = facts.certificate().map_or_else(
        || "Lipschitz dependence on the initial state".into(),
        |c| {
            format!(
                "‖x₁(t) − x₂(t)‖ ≤ {:.4}·‖x₁(0) − x₂(0)‖",
                strict::overshoot(&c.p)
            )
        },
    );
    h.theorem("RR-7158 Theorem 4", gives)
}

/// RR-7158 Theorem 5.
fn invariance(facts: &Facts) -> Theorem {
    let mut h = Hypotheses::default();
    rests_at_zero(facts, &mut h);
    passive(facts, &mut h);
    let strictly = |swap: &Swap| {
        swap.laws.iter().zip(swap.f.iter()).all(|(law, &f)| {
            if law.half_line {
                f > 0.0
            } else {
                law.strictly && f == 0.0
            }
        })
    };
    let found = facts.swaps.iter().find(|swap| strictly(swap));
    match found {
        Some(swap) => h.need(true, format!("Φ^{{*,−}}(z) > Φ^{{*,−}}(0) for z ≠ 0{}", swap.note())),
        None => h.need(
            false,
            "Φ^{*,−}(z) > Φ^{*,−}(0) for z ≠ 0 fails: ideal diodes have Φ^{*,−} = 0 on the whole half line",
        ),
    };
    let gives = facts.certificate().map_or_else(
        || "convergence to the largest invariant subset of {⟨PAz, z⟩ = 0}".into(),
        |c| {
            let pa = &c.p * &facts.system.a;
            format!(
                "every orbit tends to the largest invariant subset of {{⟨PAz, z⟩ = 0}}, of dimension {}",
                kernel_dimension(&(&pa + pa.transpose()), &(c.p.abs() * facts.system.a.abs()))
            )
        },
    );
    h.theorem("RR-7158 Theorem 5", gives)
}

/// The dissipation argument: where strict passivity or the laws leave no lossless motion, orbits tend to 0.
fn dissipation(facts: &Facts) -> Theorem {
    let mut h = Hypotheses::default();
    rests_at_zero(facts, &mut h);
    passive(facts, &mut h);
    let gives = match facts.certificate() {
        None => "limit points in the lossless set".to_string(),
        Some(c) => {
            let q = crate::passivity::lmi::matrix(&facts.system, &c.p);
            let size = crate::passivity::lmi::magnitude(&facts.system, &c.p);
            let dimension = kernel_dimension(&q, &size);
            format!(
                "along limit solutions (x, λ) stays in ker Q(P), of dimension {dimension}: no energy is dissipated there{}",
                if dimension == 0 {
                    ", so every orbit tends to 0"
                } else {
                    ""
                }
            )
        }
    };
    h.theorem(
        "Dissipation argument (LaSalle, any Φ^{*,−} ≥ Φ^{*,−}(0))",
        gives,
    )
}

/// Dimension of the kernel of a symmetric matrix, relative to the sizes of its terms.
fn kernel_dimension(q: &DMatrix<f64>, size: &DMatrix<f64>) -> usize {
    if q.is_empty() {
        return 0;
    }
    let d = DVector::from_fn(q.nrows(), |i, _| {
        let s = size.row(i).amax().max(size.column(i).amax());
        if s > 0.0 { 1.0 / s.sqrt() } else { 1.0 }
    });
    let unit = DMatrix::from_fn(q.nrows(), q.ncols(), |i, j| d[i] * q[(i, j)] * d[j]);
    let values = unit.symmetric_eigenvalues();
    values
        .iter()
        .filter(|v| v.abs() <= ZERO * values.amax().max(1.0))
        .count()
}
