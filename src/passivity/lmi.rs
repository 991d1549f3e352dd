//! The passivity matrix (45), its sign convention, and its solution by facial reduction and a barrier.

use nalgebra::{DMatrix, DVector};

use super::barrier::{self, Outcome};
use super::facial::{Face, Inconsistent};
use super::mixture::Mixture;
use super::{Certificate, Origin, System, Witness, scale, verify};

/// Unknowns of the barrier beyond which the matrix inequality is not attempted: its cost grows with their cube
/// (300 unknowns take seconds).
pub const MAX_UNKNOWNS: usize = 300;

/// Rounds of exposing vectors after the kernel equalities.
const ROUNDS: usize = 4;

/// Q(P) = [[AᵀP + PA, PB − Cᵀ], [BᵀP − C, −(D + Dᵀ)]] (RR-7158 (45)), (n+m)×(n+m); passive means Q(P) ⪯ 0.
#[must_use]
pub fn matrix(system: &System, p: &DMatrix<f64>) -> DMatrix<f64> {
    let pa = p * &system.a;
    let coupling = p * &system.b - system.c.transpose();
    assemble(
        &(&pa + pa.transpose()),
        &coupling,
        &-(&system.d + system.d.transpose()),
    )
}

/// The sizes of the terms that [`matrix`] adds up: |A|ᵀ|P| + |P||A| and so on.
#[must_use]
pub fn magnitude(system: &System, p: &DMatrix<f64>) -> DMatrix<f64> {
    let pa = p.abs() * system.a.abs();
    let coupling = p.abs() * system.b.abs() + system.c.abs().transpose();
    let d = system.d.abs();
    assemble(&(&pa + pa.transpose()), &coupling, &(&d + d.transpose()))
}

/// [[states, coupling], [couplingᵀ, ports]].
fn assemble(states: &DMatrix<f64>, coupling: &DMatrix<f64>, ports: &DMatrix<f64>) -> DMatrix<f64> {
    let (n, m) = coupling.shape();
    let mut q = DMatrix::zeros(n + m, n + m);
    q.view_mut((0, 0), (n, n)).copy_from(states);
    q.view_mut((0, n), (n, m)).copy_from(coupling);
    q.view_mut((n, 0), (m, n)).copy_from(&coupling.transpose());
    q.view_mut((n, n), (m, m)).copy_from(ports);
    q
}

/// Why no P came out.
#[derive(Debug, Clone, PartialEq)]
pub enum Unsolved {
    /// There is none, verified.
    Witness(Witness),
    /// Not decided, with the reason.
    Open(String),
}

/// Solves (45): balance, impose PBN = CᵀN on N = ker(D + Dᵀ), maximise the margin t by a barrier, expose a further face
/// where the margin is zero, and accept what [`verify`] accepts.
///
/// # Errors
/// A verified witness, or the reason why the question stays open.
pub fn solve(system: &System) -> Result<Certificate, Unsolved> {
    solve_with(system, barrier::maximise)
}

/// [`solve`] with the margin problem handed to any solver (the barrier, or a cone solver as a second opinion).
pub(super) fn solve_with(
    system: &System,
    maximise: impl Fn(&Face) -> Outcome,
) -> Result<Certificate, Unsolved> {
    let balanced = scale::balance(system);
    let face = match Face::kernel(&balanced.system) {
        Ok(face) => face,
        Err(Inconsistent::Witness(witness)) => {
            let witness = witness.unbalanced(&balanced);
            return Err(if witness.verify(system) {
                Unsolved::Witness(witness)
            } else {
                Unsolved::Open(
                    "the equalities P B N = CᵀN on ker(D + Dᵀ) are inconsistent only to rounding"
                        .into(),
                )
            });
        }
        Err(Inconsistent::Rounding(reason)) => return Err(Unsolved::Open(reason)),
    };
    let units = balanced.states.map(f64::recip);
    search(&face, maximise, |z| {
        let p = scale::scaled(&face.p(z), &units, &units);
        let residuals = verify::check(system, &p).map_err(|failure| failure.to_string())?;
        Ok(Certificate {
            p,
            from: Origin::Lmi,
            residuals,
        })
    })
    .map_err(|ended| {
        let mixture = ended
            .dual
            .and_then(|x| Mixture::of_dual(&balanced.system, &x))
            .map(|mixture| Witness::Mixture(mixture).unbalanced(&balanced));
        match mixture {
            Some(witness) if witness.verify(system) => Unsolved::Witness(witness),
            _ => Unsolved::Open(ended.reason),
        }
    })
}

/// How a search without a result ended.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ended {
    /// In words.
    pub(crate) reason: String,
    /// The multiplier X ⪰ 0 of F(z) ⪰ 0 where the whole face, not one exposed later, turned out infeasible.
    pub(crate) dual: Option<DMatrix<f64>>,
}

impl From<String> for Ended {
    fn from(reason: String) -> Self {
        Self { reason, dual: None }
    }
}

/// Looks for z with F(z) ⪰ 0 and P(z) ≻ 0 that `accept` accepts: the largest margin, then a smaller face where that
/// margin is zero. `accept` decides on the z of the given face.
///
/// # Errors
/// Where the search ended.
pub(crate) fn search<T>(
    whole: &Face,
    maximise: impl Fn(&Face) -> Outcome,
    accept: impl Fn(&DVector<f64>) -> Result<T, String>,
) -> Result<T, Ended> {
    if whole.unknowns() > MAX_UNKNOWNS {
        return Err(format!(
            "the inequality has {} unknowns, more than the {MAX_UNKNOWNS} attempted",
            whole.unknowns()
        )
        .into());
    }
    let whole = whole.rebased();
    let mut face = whole.clone();
    for round in 0..=ROUNDS {
        let outcome = maximise(&face);
        let z = face.original(outcome.unknowns());
        let failure = match accept(&z) {
            Ok(found) => return Ok(found),
            Err(failure) => failure,
        };
        face = match outcome {
            Outcome::Boundary { dual, margin, .. } => face.expose(&dual).ok_or_else(|| {
                format!("the inequality is feasible at best with margin {margin:.1e}, not confirmed: {failure}")
            })?,
            // The exposed face is known to the accuracy of the dual only: sharpen it by what F vanishes on.
            Outcome::Interior { .. } => whole
                .expose(&whole.nearly_null(&z))
                .ok_or_else(|| format!("the solution found for the inequality is not confirmed: {failure}"))?,
            Outcome::Infeasible { margin, dual, .. } => {
                return Err(Ended {
                    reason: format!(
                        "the inequality has margin {margin:.1e} < 0 after {round} rounds of facial reduction, but no \
                         violation was confirmed"
                    ),
                    dual: (round == 0 && !dual.is_empty()).then_some(dual),
                });
            }
            Outcome::Stalled { reason, .. } => return Err(reason.to_string().into()),
        };
    }
    Err(
        format!("the inequality is still not strictly feasible after {ROUNDS} exposing rounds")
            .into(),
    )
}
