//! `.meas tran` and `.four` as written.

use super::{Expr, Name, Signal};
use crate::diagnostic::Span;
use crate::measure::Measurement;

/// The analysis that a measurement is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeasAnalysis {
    /// `.meas tran`.
    Tran,
    /// `.meas ac`.
    Ac,
}

/// `.meas tran name …`, `.meas ac name …`.
#[derive(Debug, Clone, PartialEq)]
pub struct Meas {
    /// What it is of; where it is not written, of what the netlist asks for.
    pub analysis: Option<MeasAnalysis>,
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
