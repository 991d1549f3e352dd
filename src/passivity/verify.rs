//! The only place that says "passive": a given P is checked by eigenvalues and Cholesky factors in scaled variables.

use nalgebra::DMatrix;

use super::{System, lmi, scale};
use crate::settings::tolerances::passivity::{DEFINITE, KERNEL, LMI};
use crate::settings::tolerances::ranks::RANK;

/// By how much a P fulfils (45).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Residuals {
    /// Largest eigenvalue of DQ(P)D, where the diagonal D makes every row of |A|ᵀ|P| + |P||A|, |P||B| + |C|, |D| + |D|ᵀ
    /// of size one (dimensionless; ≤ 0 in exact arithmetic).
    pub lmi_max_eigenvalue: f64,
    /// ‖PBN − CᵀN‖ in the same scaling, N an orthonormal basis of ker(D + Dᵀ).
    pub pb_minus_ct: f64,
    /// Smallest eigenvalue of P scaled to unit diagonal.
    pub p_min_eigenvalue: f64,
}

/// Why a P is no certificate.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Failure {
    /// P has an entry that is not a number, or the wrong shape.
    #[error("P is not an n×n matrix of finite numbers")]
    NotAMatrix,
    /// P is not symmetric positive definite.
    #[error("P is not positive definite (smallest eigenvalue {0:.2e} at unit diagonal)")]
    Indefinite(f64),
    /// (45) fails.
    #[error("the passivity matrix has the eigenvalue {0:.2e} in equilibrated variables")]
    Inequality(f64),
    /// (45) holds to rounding only because a necessary equality is violated below its square root.
    #[error("P B N differs from CᵀN by {0:.2e} on the kernel of D + Dᵀ")]
    Kernel(f64),
}

/// Checks that P ≻ 0 and Q(P) ⪯ 0 (45), up to the rounding of the entries.
///
/// # Errors
/// The first condition that fails, with its size.
pub fn check(system: &System, p: &DMatrix<f64>) -> Result<Residuals, Failure> {
    let (n, m) = (system.n(), system.m());
    if p.shape() != (n, n) || !p.iter().all(|v| v.is_finite()) {
        return Err(Failure::NotAMatrix);
    }
    let p_min_eigenvalue = definite(p)?;
    let magnitude = lmi::magnitude(system, p);
    let d = scale::equilibrate(&magnitude);
    let q = scale::scaled(&lmi::matrix(system, p), &d, &d);
    let (values, _) = scale::eigen(&q);
    let lmi_max_eigenvalue = values.iter().copied().last().unwrap_or(0.0);

    // On the kernel of either diagonal block the coupling must vanish: v ∈ ker ⇒ Qv = 0 for every Q ⪯ 0.
    let coupling = q.view((0, n), (n, m)).into_owned();
    let losses = q.view((0, 0), (n, n)).into_owned();
    let ports = q.view((n, n), (m, m)).into_owned();
    let on_ports = (&coupling * null_space(&ports)).amax();
    let on_states = (coupling.transpose() * null_space(&losses)).amax();
    if lmi_max_eigenvalue.is_nan() || lmi_max_eigenvalue > LMI * (n + m) as f64 {
        return Err(Failure::Inequality(lmi_max_eigenvalue));
    }
    if on_ports.max(on_states) > KERNEL {
        return Err(Failure::Kernel(on_ports.max(on_states)));
    }
    Ok(Residuals {
        lmi_max_eigenvalue,
        pb_minus_ct: on_ports,
        p_min_eigenvalue,
    })
}

/// P = Pᵀ ≻ 0: a Cholesky factor and the smallest eigenvalue at unit diagonal, which is returned.
///
/// # Errors
/// [`Failure::Indefinite`] with that eigenvalue.
pub fn definite(p: &DMatrix<f64>) -> Result<f64, Failure> {
    let n = p.nrows();
    if n == 0 {
        return Ok(1.0);
    }
    if (0..n).any(|i| p[(i, i)] <= 0.0) {
        return Err(Failure::Indefinite(p.diagonal().min()));
    }
    let d = p.diagonal().map(|v| 1.0 / v.sqrt());
    let unit = scale::scaled(p, &d, &d);
    if (&unit - unit.transpose()).amax() > LMI {
        return Err(Failure::NotAMatrix);
    }
    let smallest = scale::eigen(&unit).0[0];
    if smallest > DEFINITE && unit.cholesky().is_some() {
        Ok(smallest)
    } else {
        Err(Failure::Indefinite(smallest))
    }
}

/// The kernel of a (nearly) negative semidefinite block at relative accuracy of the equilibrated scale.
fn null_space(block: &DMatrix<f64>) -> DMatrix<f64> {
    let (values, vectors) = scale::eigen(block);
    let kernel: Vec<usize> = (0..values.len())
        .filter(|&i| values[i].abs() <= RANK)
        .collect();
    vectors.select_columns(&kernel)
}
