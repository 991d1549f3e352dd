//! Where an autonomous circuit can rest: 0 = Ax + Bλ + e, 0 ≤ λ ⟂ Cx + Dλ + f ≥ 0.

use nalgebra::{DMatrix, DVector};

use super::facts::Facts;
use super::program;
use crate::passivity::scale;
use crate::settings::Settings;
use crate::settings::tolerances::ranks::ENTRY;
use crate::settings::tolerances::theorems::ROUGH_EQUILIBRIUM;
use crate::solve::enumerate;
use crate::solve::{Driver, Lcp, Status};

/// A state at which nothing changes.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Equilibrium {
    /// x, in the order of the states.
    pub x: Vec<f64>,
    /// λ, in the order of the ports.
    pub lambda: Vec<f64>,
    /// Whether x is the only one; `null` if that was not settled.
    pub unique: Option<bool>,
}

/// The equilibria of an autonomous system of complementary pairs: all of them where A is regular and m ≤ 16, else one; of a
/// system with other laws x = 0 where it is one. `None` where nothing is known, an empty list where there is none.
pub(super) fn all(facts: &Facts) -> Option<Vec<Equilibrium>> {
    if !facts.is_autonomous() {
        return None;
    }
    let system = &facts.system;
    let incremental = facts.strict.as_ref().is_some_and(|s| s.decay_rate > 0.0);
    let unique = |count: usize| {
        if incremental {
            Some(true)
        } else if count > 1 {
            Some(false)
        } else {
            None
        }
    };
    if facts.laws.iter().any(|l| !l.half_line) {
        let zero = || {
            equilibrium(
                &DVector::zeros(system.n()),
                &DVector::zeros(system.m()),
                unique(1),
            )
        };
        return facts.rests_at_zero().then(|| vec![zero()]);
    }
    let inverse = if scale::well_conditioned(&system.a) {
        system.a.clone().try_inverse()
    } else {
        None
    };
    let Some(inverse) = inverse else {
        return singular(facts).map(|(x, lambda)| vec![equilibrium(&x, &lambda, unique(1))]);
    };
    let at = |lambda: &DVector<f64>| -(&inverse * (&system.b * lambda + &facts.e));
    let m = &system.d - &system.c * &inverse * &system.b;
    let q = &facts.f - &system.c * &inverse * &facts.e;
    let lcp = Lcp::new(m, q).ok()?;
    let tolerance = Settings::default().lcp_residual;
    let mut driver = Driver::new(lcp.m.clone(), tolerance);
    if driver.is_monotone() || lcp.size() > enumerate::LARGEST {
        let solution = driver.solve(&lcp.q);
        match solution.status {
            Status::Solved => {}
            Status::Infeasible(_) => return Some(Vec::new()),
            Status::Failed => return None,
        }
        let least = driver.least_norm(&lcp.q, &solution);
        let lambda = least.solution.lambda;
        let x = at(&lambda);
        let unique = if driver.is_monotone() && least.unique {
            Some(true)
        } else {
            unique(1)
        };
        return Some(vec![equilibrium(&x, &lambda, unique)]);
    }
    let found = enumerate::solve(&lcp, tolerance);
    let one = |lambda| equilibrium(&at(lambda), lambda, Some(found.len() == 1));
    Some(found.iter().map(one).collect())
}

/// −0 reads like a sign.
fn positive_zero(v: &DVector<f64>) -> Vec<f64> {
    v.iter().map(|v| v + 0.0).collect()
}

fn equilibrium(x: &DVector<f64>, lambda: &DVector<f64>, unique: Option<bool>) -> Equilibrium {
    Equilibrium {
        x: positive_zero(x),
        lambda: positive_zero(lambda),
        unique,
    }
}

/// For singular A and a passive system: λᵀy − xᵀP(Ax + Bλ + e) = −½ zᵀQ(P)z + … is convex in z = (x, λ), and vanishes at
/// the equilibria. Of those on the sides that its minimum finds for the ports, the one of least norm in balanced units.
fn singular(facts: &Facts) -> Option<(DVector<f64>, DVector<f64>)> {
    let certificate = facts.certificate()?;
    let (n, m) = (facts.system.n(), facts.system.m());
    let balanced = scale::balance(&facts.system);
    let system = &balanced.system;
    let p = scale::scaled(&certificate.p, &balanced.states, &balanced.states);
    let e = facts.e.component_div(&balanced.states) / balanced.omega;
    let f = facts.f.component_mul(&balanced.ports) / balanced.omega;
    // Equilibria are homogeneous in the constant terms.
    let size = e.amax().max(f.amax());
    if size == 0.0 {
        return Some((DVector::zeros(n), DVector::zeros(m)));
    }
    let (e, f) = (e / size, f / size);

    let mut linear = DVector::zeros(n + m);
    linear.rows_mut(0, n).copy_from(&-(&p * &e));
    linear.rows_mut(n, m).copy_from(&f);
    let mut flow = system.a.clone().resize_horizontally(n + m, 0.0);
    flow.columns_mut(n, m).copy_from(&system.b);
    let mut output = system.c.clone().resize_horizontally(n + m, 0.0);
    output.columns_mut(n, m).copy_from(&system.d);
    let lambda = DMatrix::from_fn(m, n + m, |j, k| if k == n + j { 1.0 } else { 0.0 });
    let stack = |blocks: &[(&DMatrix<f64>, &DVector<f64>)]| {
        let rows = blocks.iter().flat_map(|(a, _)| a.row_iter());
        let offsets = blocks.iter().flat_map(|(_, b)| b.iter().copied());
        let rows: Vec<_> = rows.map(|row| row.into_owned()).collect();
        (
            DMatrix::from_rows(&rows),
            DVector::from_iterator(rows.len(), offsets),
        )
    };
    let none = DVector::zeros(m);
    let (a, b) = stack(&[(&flow, &e), (&output, &f), (&lambda, &none)]);
    let objective = -crate::passivity::lmi::matrix(system, &p);
    let z = program::minimise(&objective, &linear, &a, &b, n)?;

    let y = &output * &z + &f;
    let conducts = |j: usize| z[n + j] > y[j];
    let pick = |yes: bool| {
        let on = |j| {
            if conducts(j) == yes {
                (&output, f[j])
            } else {
                (&lambda, 0.0)
            }
        };
        let rows: Vec<_> = (0..m).map(|j| on(j).0.row(j).into_owned()).collect();
        let rows = if m == 0 {
            DMatrix::zeros(0, n)
        } else {
            DMatrix::from_rows(&rows)
        };
        (rows, DVector::from_iterator(m, (0..m).map(|j| on(j).1)))
    };
    let (zero, positive) = (pick(true), pick(false));
    let (a, b) = stack(&[(&flow, &e), (&zero.0, &zero.1), (&positive.0, &positive.1)]);
    let norm = DMatrix::from_fn(n + m, n + m, |i, k| if i == k { 1.0 } else { 0.0 });
    let z = program::minimise(&norm, &DVector::zeros(n + m), &a, &b, n + m)?;

    let size_of_z = z.amax().max(1.0);
    // Each x_k' beside its own terms, down to rounding: a small leak that nothing carries away is no rest.
    let rest = (&flow * &z + &e).abs();
    let terms = flow.abs() * z.abs() + e.abs();
    let rests =
        (0..n).all(|k| rest[k] <= ROUGH_EQUILIBRIUM * terms[k].min(size_of_z) + ENTRY * size_of_z);
    let y = &output * &z + &f;
    let sides = (0..m).map(|j| y[j].min(z[n + j]).abs()).fold(0.0, f64::max);
    let found = (
        z.rows(0, n).component_mul(&balanced.states) * size,
        z.rows(n, m)
            .map(|v| v.max(0.0))
            .component_mul(&balanced.ports)
            * size,
    );
    (rests && sides <= ROUGH_EQUILIBRIUM * size_of_z).then_some(found)
}
