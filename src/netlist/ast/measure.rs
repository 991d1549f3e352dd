//! `.meas tran` and `.four` as written.

use super::{Expr, Name, Signal};
use crate::diagnostic::Span;
use crate::measure::Measurement;

/// `.meas tran name …`.
#[derive(Debug, Clone, PartialEq)]
pub struct Meas {
    /// Its name, under which others may use it.
    pub name: Name,
    /// What is measured.
    pub what: Measurement<Expr>,
    /// Written as a command inside `.control`.
    pub command: bool,
    /// The whole card.
    pub span: Span,
}

/// `.four frequency [harmonics] signal …`.
#[derive(Debug, Clone, PartialEq)]
pub struct Four {
    /// The fundamental, Hz.
    pub frequency: Expr,
    /// How many harmonics; SPICE's nine where it is not written.
    pub harmonics: Option<Expr>,
    /// The signals.
    pub signals: Vec<Signal>,
    /// The whole card.
    pub span: Span,
}
