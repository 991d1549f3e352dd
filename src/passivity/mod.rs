//! Is a linear system passive at its ports? Certificates, witnesses, and nothing in between.
//!
//! ```text
//! x' = A x + B λ        passive (RR-7158 Definition 1): there is P = Pᵀ ≻ 0 with
//! y  = C x + D λ
//!                       Q(P) = [ AᵀP + PA   PB − Cᵀ   ] ⪯ 0        (45)
//!                              [ BᵀP − C   −(D + Dᵀ) ]
//! ```
//!
//! The physics is asked first: the stored energy of the network ([`energy`]). Only if it fails is the matrix inequality
//! solved, after facial reduction ([`facial`]: the kernel N of D + Dᵀ forces PBN = CᵀN), by a dense barrier
//! ([`barrier`]). Whoever proposes a P, [`verify`] alone says "passive"; "not passive" is said by a [`witness`] that is
//! verified on its own; what neither can settle is reported as not decided.
//!
//! Passivity does not depend on which of a port's two quantities is called λ: a role swap is a principal pivot
//! ([`System::pivot`]) and keeps yᵀλ and P.

pub mod barrier;
pub mod energy;
pub mod facial;
pub mod gradient;
pub mod lmi;
pub mod mixture;
pub(crate) mod scale;
#[cfg(feature = "sdp")]
pub mod sdp;
pub mod strict;
mod sweep;
pub mod verify;
pub mod witness;

use nalgebra::DMatrix;

use crate::lcs::Lcs;
pub use strict::Strict;
pub use verify::Residuals;
pub use witness::Witness;

/// The linear part (A, B, C, D) of a complementarity system: n×n, n×m, m×n, m×m.
#[derive(Debug, Clone, PartialEq)]
pub struct System {
    /// n×n.
    pub a: DMatrix<f64>,
    /// n×m.
    pub b: DMatrix<f64>,
    /// m×n.
    pub c: DMatrix<f64>,
    /// m×m.
    pub d: DMatrix<f64>,
}

/// A storage function ½ xᵀPx and how well it fulfils (45).
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// P, n×n symmetric positive definite.
    pub p: DMatrix<f64>,
    /// Where it comes from.
    pub from: Origin,
    /// By how much it was verified.
    pub residuals: Residuals,
}

/// Where a certificate comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// The energy of the circuit's capacitors and inductors.
    StoredEnergy,
    /// The matrix inequality (45).
    Lmi,
}

impl Origin {
    /// `stored energy` or `lmi`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::StoredEnergy => "stored energy",
            Self::Lmi => "lmi",
        }
    }
}

/// The answer to "is it passive?".
#[derive(Debug, Clone, PartialEq)]
#[must_use]
pub enum Verdict {
    /// Yes, with a verified storage function.
    Passive(Certificate),
    /// No, with a verified witness.
    NotPassive(Witness),
    /// Neither could be verified.
    NotDecided {
        /// What was tried and where it ended.
        reason: String,
    },
}

impl Verdict {
    /// `Some(true)`, `Some(false)` or `None` for not decided.
    #[must_use]
    pub const fn answer(&self) -> Option<bool> {
        match self {
            Self::Passive(_) => Some(true),
            Self::NotPassive(_) => Some(false),
            Self::NotDecided { .. } => None,
        }
    }

    /// The certificate of a "yes".
    #[must_use]
    pub const fn certificate(&self) -> Option<&Certificate> {
        match self {
            Self::Passive(certificate) => Some(certificate),
            _ => None,
        }
    }
}

/// Decides passivity: stored energy, then witnesses, then the matrix inequality.
///
/// `energy` is the network's own candidate for P (n×n), if there is one.
///
/// # Cost
/// One symmetric eigenvalue problem of order n + m if the stored energy is a certificate. Otherwise a frequency sweep
/// (about 200 complex factorisations of order n) and a barrier method with up to n(n+1)/2 unknowns.
pub fn decide(system: &System, energy: Option<&DMatrix<f64>>) -> Verdict {
    if let Some(certificate) = energy.and_then(|p| energy::certificate(system, p)) {
        return Verdict::Passive(certificate);
    }
    if let Some(witness) = witness::search(system) {
        return Verdict::NotPassive(witness);
    }
    match lmi::solve(system) {
        Ok(certificate) => Verdict::Passive(certificate),
        Err(lmi::Unsolved::Witness(witness)) => Verdict::NotPassive(witness),
        Err(lmi::Unsolved::Open(reason)) => Verdict::NotDecided { reason },
    }
}

impl System {
    /// The linear part of a complementarity system.
    #[must_use]
    pub fn of(lcs: &Lcs) -> Self {
        Self {
            a: lcs.a.clone(),
            b: lcs.b.clone(),
            c: lcs.c.clone(),
            d: lcs.d.clone(),
        }
    }

    /// Number of states.
    #[must_use]
    pub fn n(&self) -> usize {
        self.a.nrows()
    }

    /// Number of ports.
    #[must_use]
    pub fn m(&self) -> usize {
        self.d.nrows()
    }

    /// The same system with A + αI for A: strictly passive with rate α if that is passive (below Definition 4).
    #[must_use]
    pub fn shifted(&self, alpha: f64) -> Self {
        let mut shifted = self.clone();
        for i in 0..self.n() {
            shifted.a[(i, i)] += alpha;
        }
        shifted
    }

    /// The same behaviour with λ and y exchanged at the given ports (a principal pivot on D_αα), or `None` where D_αα is
    /// singular to working precision. yᵀλ is unchanged, and so are passivity and its certificates P.
    #[must_use]
    pub fn pivot(&self, ports: &[usize]) -> Option<Self> {
        if ports.is_empty() {
            return Some(self.clone());
        }
        let rest: Vec<usize> = (0..self.m()).filter(|j| !ports.contains(j)).collect();
        let d_aa = self.d.select_rows(ports).select_columns(ports);
        if !scale::well_conditioned(&d_aa) {
            return None;
        }
        let inverse = d_aa.try_inverse()?;
        let b_a = self.b.select_columns(ports) * &inverse;
        let c_a = &inverse * self.c.select_rows(ports);
        let d_ab = &inverse * self.d.select_rows(ports).select_columns(&rest);
        let d_ba = self.d.select_rows(&rest).select_columns(ports);
        let a = &self.a - &b_a * self.c.select_rows(ports);
        let b_b = self.b.select_columns(&rest) - self.b.select_columns(ports) * &d_ab;
        let c_b = self.c.select_rows(&rest) - &d_ba * &c_a;
        let d_bb = self.d.select_rows(&rest).select_columns(&rest) - &d_ba * &d_ab;
        let d_ba = d_ba * &inverse;

        let (mut b, mut c, mut d) = (self.b.clone(), self.c.clone(), self.d.clone());
        for (i, &p) in ports.iter().enumerate() {
            b.set_column(p, &b_a.column(i));
            c.set_row(p, &(-c_a.row(i)));
            for (k, &q) in ports.iter().enumerate() {
                d[(p, q)] = inverse[(i, k)];
            }
            for (k, &q) in rest.iter().enumerate() {
                d[(p, q)] = -d_ab[(i, k)];
                d[(q, p)] = d_ba[(k, i)];
            }
        }
        for (i, &p) in rest.iter().enumerate() {
            b.set_column(p, &b_b.column(i));
            c.set_row(p, &c_b.row(i));
            for (k, &q) in rest.iter().enumerate() {
                d[(p, q)] = d_bb[(i, k)];
            }
        }
        Some(Self { a, b, c, d })
    }
}

#[cfg(test)]
mod tests;
