//! Strict passivity (RR-7158 Definition 2) and the decay rate it certifies.

use nalgebra::DMatrix;

use super::{Origin, System, facial, lmi, scale, verify, witness};
use crate::settings::tolerances::passivity::RATE_WIDTH;
use crate::settings::tolerances::ranks::RANK;

/// States beyond which the rate is only computed for the given P.
const LARGEST: usize = 30;

/// Unknowns beyond which the rate is only maximised for the given P, not over all P.
const MAX_UNKNOWNS: usize = 60;

/// ‖x(t)‖ ≤ `bound`·‖x₀‖·exp(−`decay_rate`·t) for the autonomous system (RR-7158 Theorem 3).
#[derive(Debug, Clone, PartialEq)]
pub struct Strict {
    /// The largest certified α = ε/2 of (46), 1/s; zero if only passive.
    pub decay_rate: f64,
    /// √(‖P‖/λ_min(P)) of the certificate of that rate.
    pub bound: f64,
    /// The P that certifies the rate.
    pub p: DMatrix<f64>,
    /// Where P comes from.
    pub from: Origin,
}

/// √(‖P‖/λ_min(P)), the constant of RR-7158 Theorems 3 and 4.
#[must_use]
pub fn overshoot(p: &DMatrix<f64>) -> f64 {
    let (values, _) = scale::eigen(p);
    match (values.iter().copied().next(), values.iter().copied().last()) {
        (Some(low), Some(high)) if low > 0.0 => (high / low).sqrt(),
        _ => 1.0,
    }
}

/// The largest rate α for which (A + αI, B, C, D) is verified passive, starting from a certificate P of α = 0.
///
/// # Cost
/// One eigenvalue problem and one verification for the given P; up to 30 states also about 25 solutions of (45).
#[must_use]
pub fn maximise(system: &System, p: &DMatrix<f64>, from: Origin) -> Strict {
    let mut best = Strict {
        decay_rate: 0.0,
        bound: overshoot(p),
        p: p.clone(),
        from,
    };
    if system.n() == 0 {
        return best;
    }
    let certified = |alpha: f64| alpha > 0.0 && verify::check(&system.shifted(alpha), p).is_ok();
    if let Some(rate) = fixed(system, p)
        && certified(rate * (1.0 - RATE_WIDTH))
    {
        best.decay_rate = rate * (1.0 - RATE_WIDTH);
    }
    if system.n() > LARGEST {
        return best;
    }
    let limit = -witness::eigenvalues(&system.a)
        .iter()
        .map(|s| s.re)
        .fold(f64::NEG_INFINITY, f64::max);
    if !(limit.is_finite() && limit > 0.0) {
        return best;
    }
    // Only what the equalities on ker(D + Dᵀ) leave free can give a larger rate.
    let free =
        facial::Face::kernel(&scale::balance(system).system).map_or(0, |face| face.unknowns());
    if free == 0 || free > MAX_UNKNOWNS {
        return best;
    }
    let solved = bisect(best.decay_rate, limit, limit, |alpha| {
        lmi::solve(&system.shifted(alpha)).ok()
    });
    if let Some((alpha, certificate)) = solved
        && alpha > best.decay_rate * (1.0 + RATE_WIDTH)
    {
        best = Strict {
            decay_rate: alpha,
            bound: overshoot(&certificate.p),
            p: certificate.p,
            from: Origin::Lmi,
        };
    }
    best
}

/// The largest α with Q(P) + 2α diag(P, 0) ⪯ 0 for this P: ½ λ_min of −(Q₁₁ − Q₁₂Q₂₂⁺Q₂₁) in the metric P.
fn fixed(system: &System, p: &DMatrix<f64>) -> Option<f64> {
    let (n, m) = (system.n(), system.m());
    let q = lmi::matrix(system, p);
    let coupling = q.view((0, n), (n, m)).into_owned();
    let (values, vectors) = scale::eigen(&q.view((n, n), (m, m)).into_owned());
    let size = values.amax();
    let lossy: Vec<usize> = (0..values.len())
        .filter(|&k| values[k].abs() > RANK * size)
        .collect();
    let reach = coupling * vectors.select_columns(&lossy);
    let inverse = DMatrix::from_diagonal(&values.select_rows(&lossy).map(f64::recip));
    let loss = &reach * inverse * reach.transpose() - q.view((0, 0), (n, n));
    let lower = p.clone().cholesky()?.l();
    let half = lower.solve_lower_triangular(&loss)?;
    let metric = lower.solve_lower_triangular(&half.transpose())?;
    scale::eigen(&metric)
        .0
        .iter()
        .copied()
        .next()
        .map(|v| 0.5 * v)
}

/// The largest α in (low, high] that `certify` accepts, to relative width of `scale`, with what it returned.
fn bisect<T>(
    mut low: f64,
    mut high: f64,
    scale: f64,
    certify: impl Fn(f64) -> Option<T>,
) -> Option<(f64, T)> {
    let mut best = None;
    // The limit itself is attained by symmetric networks (RC): try just below it first.
    let first = high * (1.0 - RATE_WIDTH);
    if first > low
        && let Some(found) = certify(first)
    {
        return Some((first, found));
    }
    while high - low > RATE_WIDTH * scale {
        let middle = 0.5 * (low + high);
        match certify(middle) {
            Some(found) => {
                best = Some((middle, found));
                low = middle;
            }
            None => high = middle,
        }
    }
    best
}
