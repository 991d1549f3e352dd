//! Coupled inductors: which windings keep a flux state and which are ideal transformers of the others.
//!
//! With S = diag √L the inductance matrix is L = S K S, and its rank is that of the matrix K of coupling coefficients,
//! decided exactly on the k's as written. A winding d in the span of the basis windings j obeys
//! v_d = Σ t_dj v_j, t_dj = c_dj √(L_d/L_j), and adds its current to their flux: i_mj = i_j + Σ_d t_dj i_d.

use std::collections::BTreeMap;

use petgraph::unionfind::UnionFind;

use super::Coefficient;
use crate::algebra::{Elimination, Field, Rational, Table, sparse};
use crate::circuit::{Circuit, ElementId, Kind};
use crate::diagnostic::Diagnostic;

/// One inductor as the multiport sees it.
#[derive(Debug, Clone)]
pub(super) struct Winding {
    /// The inductor.
    pub(super) element: ElementId,
    /// For a dependent winding: its ratios t_dj to basis windings j (indices of windings).
    pub(super) transformer: Option<Vec<(Coefficient, usize)>>,
    /// For a basis winding: the dependent windings d whose current it carries, with t_dj.
    pub(super) carries: Vec<(Coefficient, usize)>,
    /// For a basis winding: its row of the inductance matrix (value, winding).
    pub(super) inductance: Vec<(Coefficient, usize)>,
    /// `IC=` of the flux state.
    pub(super) initial: Option<f64>,
}

/// All inductors (zero ones excepted), in circuit order.
pub(super) fn couple(circuit: &Circuit) -> Result<Vec<Winding>, Vec<Diagnostic>> {
    let inductors: Vec<(ElementId, f64, Option<f64>)> = circuit
        .elements
        .iter()
        .enumerate()
        .filter_map(|(i, e)| match e.kind {
            Kind::Inductor(l) if l.f64 != 0.0 => Some((ElementId(i as u32), l.f64, e.ic)),
            _ => None,
        })
        .collect();
    let n = inductors.len();
    let place = |id: ElementId| inductors.binary_search_by_key(&id, |(e, _, _)| *e).ok();
    let mut k = Coefficients::default();
    let mut groups = UnionFind::<usize>::new(n);
    let mut faults = Vec::new();
    for coupling in &circuit.couplings {
        let (Some(a), Some(b)) = (place(coupling.a), place(coupling.b)) else {
            continue;
        };
        if coupling.k.f64.abs() > 1.0 {
            faults.push(
                Diagnostic::error(
                    "coupling",
                    coupling.span,
                    format!(
                        "coupling coefficient of `{}` is {}",
                        coupling.name, coupling.k.f64
                    ),
                )
                .help("|k| ≤ 1; k = 1 is an ideal transformer with magnetising inductance"),
            );
        }
        groups.union(a, b);
        k.0.insert((a, b), Rational::value(coupling.k));
        k.0.insert((b, a), Rational::value(coupling.k));
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    let mut windings: Vec<Winding> = inductors
        .iter()
        .map(|&(element, _, initial)| Winding {
            element,
            transformer: None,
            carries: Vec::new(),
            inductance: Vec::new(),
            initial,
        })
        .collect();
    // Groups in the order of their first members.
    let mut members_of: Vec<Vec<usize>> = vec![Vec::new(); n];
    let mut first_of = vec![None; n];
    for i in 0..n {
        let first = *first_of[groups.find(i)].get_or_insert(i);
        members_of[first].push(i);
    }
    for members in members_of.into_iter().filter(|members| !members.is_empty()) {
        let Some((basis, combos)) = split(&k, &members) else {
            let names: Vec<&str> = members
                .iter()
                .map(|&m| circuit.elements[inductors[m].0.index()].name.as_str())
                .collect();
            faults.push(
                Diagnostic::error(
                    "coupling",
                    circuit.couplings.iter().find(|c| place(c.a).is_some_and(|a| members.contains(&a))).and_then(|c| c.span),
                    format!("the couplings among {} contradict each other", names.join(", ")),
                )
                .help("the matrix of coupling coefficients must be positive semidefinite: no set of windings has it"),
            );
            continue;
        };
        for (d, combo) in combos {
            let mut ratios = Vec::new();
            for (&j, c) in basis.iter().zip(&combo) {
                if !Field::is_zero(c) {
                    let ratio = Coefficient::Pair(
                        c.to_f64() * (inductors[d].1 / inductors[j].1).sqrt(),
                        0.0,
                    );
                    ratios.push((ratio, j));
                    windings[j].carries.push((ratio, d));
                    let extra = inductors[d]
                        .2
                        .map(|ic| ic * ratio.in_field::<Rational>().to_f64());
                    windings[j].initial = match (windings[j].initial, extra) {
                        (Some(a), Some(b)) => Some(a + b),
                        (a, b) => a.or(b),
                    };
                }
            }
            windings[d].transformer = Some(ratios);
        }
        for &a in &basis {
            for &b in &basis {
                if !Field::is_zero(&k.at(a, b)) {
                    windings[a]
                        .inductance
                        .push((mutual(circuit, &inductors, &k, a, b), b));
                }
            }
        }
    }
    if faults.is_empty() {
        Ok(windings)
    } else {
        Err(faults)
    }
}

/// The matrix K of coupling coefficients, but for its diagonal of ones and its zeros.
#[derive(Debug, Default)]
struct Coefficients(BTreeMap<(usize, usize), Rational>);

impl Coefficients {
    fn at(&self, a: usize, b: usize) -> Rational {
        if a == b {
            return Field::one();
        }
        let known = self.0.get(&(a, b)).cloned();
        known.unwrap_or_else(<Rational as Field>::zero)
    }
}

/// k √(L_a L_b) to about 30 digits.
fn mutual(
    circuit: &Circuit,
    inductors: &[(ElementId, f64, Option<f64>)],
    k: &Coefficients,
    a: usize,
    b: usize,
) -> Coefficient {
    let exact = |i: usize| match circuit.elements[inductors[i].0.index()].kind {
        Kind::Inductor(l) => l,
        _ => 0.0.into(),
    };
    if a == b {
        return Coefficient::Plus(exact(a));
    }
    let product = Rational::value(exact(a)).mul(&Rational::value(exact(b)));
    let root = product.to_f64().sqrt();
    // One Newton step in exact arithmetic doubles the digits.
    let r = Rational::value(root.into());
    let two = <Rational as Field>::one().add(&Field::one());
    let refined = r
        .add(&product.sub(&r.mul(&r)).div(&two.mul(&r)))
        .mul(&k.at(a, b));
    let hi = refined.to_f64();
    let lo = refined.sub(&Rational::value(hi.into())).to_f64();
    Coefficient::Pair(hi, lo)
}

/// Splits a group into a basis and, for every other winding, its combination c of basis windings; `None` if K is
/// indefinite.
#[allow(clippy::type_complexity)]
fn split(k: &Coefficients, members: &[usize]) -> Option<(Vec<usize>, Vec<(usize, Vec<Rational>)>)> {
    let mut basis: Vec<usize> = Vec::new();
    let mut combos = Vec::new();
    for &m in members {
        // Solve K_bb c = K_bm and look at the Schur complement 1 − K_mb c.
        let c = solve(k, &basis, m);
        let schur = basis
            .iter()
            .zip(&c)
            .fold(<Rational as Field>::one(), |s, (&b, c)| {
                s.sub(&k.at(m, b).mul(c))
            });
        if Field::is_zero(&schur) {
            combos.push((m, c));
        } else if schur.to_f64() < 0.0 {
            return None;
        } else {
            basis.push(m);
        }
    }
    // A dependent winding must be the same combination with respect to every other winding.
    for (d, c) in &mut combos {
        *c = solve(k, &basis, *d);
        for &m in members {
            let seen = basis
                .iter()
                .zip(c.iter())
                .fold(<Rational as Field>::zero(), |s, (&b, c)| {
                    s.add(&k.at(m, b).mul(c))
                });
            if !Field::is_zero(&seen.sub(&k.at(m, *d))) {
                return None;
            }
        }
    }
    Some((basis, combos))
}

fn solve(k: &Coefficients, basis: &[usize], m: usize) -> Vec<Rational> {
    let n = basis.len();
    let row = |&a: &usize| sparse(basis.iter().chain([&m]).map(|&b| k.at(a, b)));
    let mut table = Table::new(basis.iter().map(row).collect(), n + 1);
    let mut found = Elimination::new(n, n + 1);
    for column in 0..n {
        table.eliminate(column, &mut found);
    }
    table.settle(&found);
    let value = |j: usize| table.at(found.pivot[j]?, n).cloned();
    (0..n)
        .map(|j| value(j).unwrap_or_else(<Rational as Field>::zero))
        .collect()
}
