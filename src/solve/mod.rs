//! One-step problems: linear complementarity problems 0 ≤ λ ⟂ M λ + q ≥ 0 of monotone circuits.
//!
//! | file | what | needs |
//! |---|---|---|
//! | [`lcp`] | the problem, its residual, statuses | |
//! | [`active`] | solution on a known active set | M_aa nonsingular, else least norm |
//! | [`pivot`] | block principal pivoting | nonsingular principal minors on its way |
//! | [`lemke`] | Lemke with lexicographic ties | M copositive-plus for a certain end |
//! | [`convex`] | clarabel on min λᵀ(Mλ + q) | M + Mᵀ ⪰ 0 |
//! | [`enumerate`] | all index sets: the oracle of the tests | m ≤ 16 |
//! | [`lawful`] | any maximal monotone laws: Newton, splitting | M + Mᵀ ⪰ 0 for a certain end |
//! | `newton` | curved laws from a near guess, without allocation | steps that contract |
//! | `parts` | decoupled parts, each solved at its own size | |
//! | [`norm`] | the least-norm member of the solution set | |
//! | [`driver`] | the chain warm → block → Lemke → clarabel | |
//!
//! Whatever produced a solution, it is accepted on [`Scaling::residual`](lcp::Scaling::residual) alone.

pub mod active;
pub mod convex;
pub mod driver;
pub mod enumerate;
pub mod lawful;
pub mod lcp;
pub mod lemke;
pub(crate) mod newton;
pub mod norm;
mod parts;
pub mod pivot;

pub use driver::{Driver, LeastNorm};
pub use lawful::PortLaw;
pub use lcp::{Answered, Lcp, Solution, Status};
