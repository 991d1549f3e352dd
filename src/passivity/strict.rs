//! Strict passivity (RR-7158 Definition 2) and the decay rate it certifies.

use nalgebra::DMatrix;

use super::{Origin, System, facial, lmi, scale, verify, witness};

/// Relative width at which the bisection on the rate stops.
const WIDTH: f64 = 1e-6;

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
    /// An upper bound on every rate: −max Re eig(A).
    pub limit: f64,
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
/// About 25 verifications for the given P and as many solutions of the matrix inequality.
#[must_use]
pub fn maximise(system: &System, p: &DMatrix<f64>, from: Origin) -> Strict {
    let limit = -witness::eigenvalues(&system.a)
        .iter()
        .map(|s| s.re)
        .fold(f64::NEG_INFINITY, f64::max);
    let mut best = Strict {
        decay_rate: 0.0,
        bound: overshoot(p),
        p: p.clone(),
        from,
        limit,
    };
    if system.n() == 0 || !(limit.is_finite() && limit > 0.0) {
        return best;
    }
    best.decay_rate = bisect(0.0, limit, limit, |alpha| {
        verify::check(&system.shifted(alpha), p)
            .is_ok()
            .then_some(())
    })
    .map_or(0.0, |(alpha, ())| alpha);
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
        && alpha > best.decay_rate * (1.0 + WIDTH)
    {
        best = Strict {
            decay_rate: alpha,
            bound: overshoot(&certificate.p),
            p: certificate.p,
            from: Origin::Lmi,
            limit,
        };
    }
    best
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
    let first = high * (1.0 - WIDTH);
    if first > low
        && let Some(found) = certify(first)
    {
        return Some((first, found));
    }
    while high - low > WIDTH * scale {
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
