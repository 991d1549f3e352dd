//! Where an autonomous circuit can rest: 0 = Ax + Bλ + e, 0 ≤ λ ⟂ Cx + Dλ + f ≥ 0.

use nalgebra::{DMatrix, DVector};

use super::facts::Facts;
use super::program;
use crate::passivity::scale;
use crate::settings::Settings;
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

/// Residual, relative to the terms, at which the interior point method's answer counts as an equilibrium.
const ROUGH: f64 = 1e-6;

/// The equilibria of an autonomous system of complementary pairs; all of them where A is regular and m ≤ 16.
pub(super) fn all(facts: &Facts) -> Vec<Equilibrium> {
    if !facts.is_autonomous() || facts.laws.iter().any(|l| !l.half_line) {
        return Vec::new();
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
    let inverse = if scale::well_conditioned(&system.a) {
        system.a.clone().try_inverse()
    } else {
        None
    };
    let Some(inverse) = inverse else {
        return singular(facts)
            .map(|(x, lambda)| equilibrium(&x, &lambda, unique(1)))
            .into_iter()
            .collect();
    };
    let at = |lambda: &DVector<f64>| -(&inverse * (&system.b * lambda + &facts.e));
    let m = &system.d - &system.c * &inverse * &system.b;
    let q = &facts.f - &system.c * &inverse * &facts.e;
    let Ok(lcp) = Lcp::new(m, q) else {
        return Vec::new();
    };
    let tolerance = Settings::default().lcp_residual;
    let mut driver = Driver::new(lcp.m.clone(), tolerance);
    if driver.is_monotone() || lcp.size() > enumerate::LARGEST {
        let solution = driver.solve(&lcp.q);
        if solution.status != Status::Solved {
            return Vec::new();
        }
        let (lambda, only) = driver.least_norm(&lcp.q, &solution);
        let x = at(&lambda);
        let unique = if driver.is_monotone() && only {
            Some(true)
        } else {
            unique(1)
        };
        return vec![equilibrium(&x, &lambda, unique)];
    }
    let found = enumerate::solve(&lcp, tolerance);
    let count = found.len();
    found
        .iter()
        .map(|lambda| equilibrium(&at(lambda), lambda, Some(count == 1)))
        .collect()
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
/// the equilibria.
fn singular(facts: &Facts) -> Option<(DVector<f64>, DVector<f64>)> {
    let certificate = facts.certificate()?;
    let system = &facts.system;
    let (n, m) = (system.n(), system.m());
    let objective = -crate::passivity::lmi::matrix(system, &certificate.p);
    let mut linear = DVector::zeros(n + m);
    linear
        .rows_mut(0, n)
        .copy_from(&-(&certificate.p * &facts.e));
    linear.rows_mut(n, m).copy_from(&facts.f);
    let mut rows = DMatrix::zeros(n + 2 * m, n + m);
    rows.view_mut((0, 0), (n, n)).copy_from(&system.a);
    rows.view_mut((0, n), (n, m)).copy_from(&system.b);
    rows.view_mut((n, 0), (m, n)).copy_from(&system.c);
    rows.view_mut((n, n), (m, m)).copy_from(&system.d);
    rows.view_mut((n + m, n), (m, m)).fill_with_identity();
    let mut offsets = DVector::zeros(n + 2 * m);
    offsets.rows_mut(0, n).copy_from(&facts.e);
    offsets.rows_mut(n, m).copy_from(&facts.f);
    let z = program::minimise(&objective, &linear, &rows, &offsets, n)?;
    let (x, lambda) = (z.rows(0, n).into_owned(), z.rows(n, m).map(|v| v.max(0.0)));
    let rest = &system.a * &x + &system.b * &lambda + &facts.e;
    let terms = system.a.abs() * x.abs() + system.b.abs() * &lambda + facts.e.abs();
    let y = &system.c * &x + &system.d * &lambda + &facts.f;
    let sizes = system.c.abs() * x.abs() + system.d.abs() * &lambda + facts.f.abs();
    let still = (0..n).all(|i| rest[i].abs() <= ROUGH * terms.amax());
    let complementary = (0..m).all(|j| {
        y[j] >= -ROUGH * sizes.amax()
            && y[j].abs().min(lambda[j]) <= ROUGH * sizes.amax().max(lambda.amax())
    });
    (still && complementary).then_some((x, lambda))
}
