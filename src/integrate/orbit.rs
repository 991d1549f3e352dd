//! What is known of a periodic steady state besides its waveforms.

use serde::Serialize;

/// What repeats an orbit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum OrbitKind {
    /// Sources.
    Driven,
    /// The circuit itself.
    Autonomous,
    /// Nothing moves.
    Equilibrium,
}

/// A periodic steady state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Orbit {
    /// From closing to closing, s; of an equilibrium the time over which it was seen to stay.
    pub period: f64,
    /// max |s(T) − s(0)| over the states, relative to their amplitudes.
    pub residual: f64,
    /// Newton corrections.
    pub iterations: u32,
    /// Eigenvalues (real and imaginary part) of ∂s(T)/∂s(0), the largest first; of an autonomous orbit without the one that is trivial, of a
    /// large circuit the leading ones alone. None where there is no derivative.
    pub multipliers: Vec<[f64; 2]>,
    /// Whether no multiplier is larger than 1; not so where there is no derivative.
    pub stable: bool,
    /// What repeats it.
    pub kind: OrbitKind,
    /// The period in periods of the sources, or in returns to the section.
    pub order: usize,
    /// The event after which the rows of an autonomous orbit begin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub section: Option<String>,
}
