//! The formalisms of nonsmooth circuits as plain types, with conversions that check their hypotheses.
//!
//! | file | formalism | source |
//! |---|---|---|
//! | [`linear`] | linear complementarity system | Brogliato-Thibault (5) |
//! | [`lure`] | multivalued Lur'e system | RR-7158 (2) |
//! | [`inequality`] | evolution variational inequality of the second kind | RR-7158 (17) |
//! | [`cone`] | cone complementarity system | Brogliato-Thibault Lemma 3.8 |
//! | [`sweeping`] | perturbed sweeping process | Brogliato-Thibault (15), (20), (30) |
//! | [`projected`] | projected dynamical and gradient-type complementarity systems | Heemels et al. (4), (7) |
//! | [`unilateral`] | complementarity dynamical system, both unilateral inclusions | RR-5107 |
//! | [`nonlinear`] | nonlinear complementarity system | Brogliato-Thibault (34) |
//! | [`observer`] | state observer with multivalued output injection | RR-7158 (39)-(42) |
//! | [`feedback`] | output feedback u = Sx + Gλ | RR-7158 Remark 10 |
//! | [`json`] | all of them as files | |
//! | [`expression`] | functions of state and time in such files | |
//!
//! A conversion returns the new form, or [`FormError::Hypothesis`] with the condition that fails and its size. Every form
//! is a [`Complementarity`] problem and is integrated by the one implicit step of [`mod@step`].

pub mod cone;
pub mod expression;
pub mod feedback;
pub mod inequality;
pub mod json;
pub mod linear;
pub mod lure;
pub mod nonlinear;
pub mod observer;
pub mod polyhedron;
pub mod projected;
pub mod step;
pub mod sweeping;
pub mod unilateral;

pub use linear::{Linear, Signal, constant};
pub use polyhedron::Polyhedron;
pub use step::{Complementarity, Step, Trajectory, integrate, step};

/// Why a form could not be made or integrated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FormError {
    /// A hypothesis of the conversion fails.
    #[error("{statement}: {condition} (by {size:.3e})")]
    Hypothesis {
        /// The statement whose hypothesis it is.
        statement: &'static str,
        /// The condition.
        condition: &'static str,
        /// By how much it fails, in the condition's own units.
        size: f64,
    },
    /// Matrices whose shapes do not fit.
    #[error("{what} is {rows}×{columns}, which does not fit")]
    Shape {
        /// Which one.
        what: &'static str,
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
    },
    /// The one-step problem has no solution that could be found.
    #[error("no solution of the one-step problem at t = {t:.6e}: {reason}")]
    Step {
        /// Time, s.
        t: f64,
        /// Why.
        reason: &'static str,
    },
    /// A file that does not say what it should.
    #[error("{0}")]
    File(String),
}

/// Fails unless the condition holds.
fn require(
    holds: bool,
    statement: &'static str,
    condition: &'static str,
    size: f64,
) -> Result<(), FormError> {
    if holds {
        Ok(())
    } else {
        Err(FormError::Hypothesis {
            statement,
            condition,
            size,
        })
    }
}
