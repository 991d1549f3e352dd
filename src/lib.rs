//! Electrical circuits with *ideal* devices, from netlist text to waveforms.
//!
//! A circuit of resistors, capacitors, inductors, sources and devices that obey a maximal monotone law (the ideal
//! diode first of all) is the complementarity system
//!
//! ```text
//! x'(t) = A x + B λ + E u(t) + e        x: n states (capacitor voltages in V, inductor currents in A)
//! y(t)  = C x + D λ + G u(t) + F        λ, y: m ports, one pair per device;  u: p source values
//! −λ_j  ∈ ∂φ_j(y_j)                      φ_j convex; the ideal diode is 0 ≤ λ_j ⟂ y_j ≥ 0
//! ```
//!
//! | matrix | A | B | C | D | E | G | e | F |
//! |---|---|---|---|---|---|---|---|---|
//! | shape | n×n | n×m | m×n | m×m | n×p | m×p | n | m |
//!
//! Data flows one way, and the modules stand in that order:
//!
//! ```text
//! netlist → circuit → mna → lcs → plan → integrate (with solve) → waveform → report
//! ```

// Lets the systems under tests/ be used by the library's own tests as well.
#[cfg(test)]
extern crate self as circ;

pub mod algebra;
pub mod check;
pub mod circuit;
pub mod diagnostic;
pub mod forms;
pub mod integrate;
pub mod law;
pub mod lcs;
pub mod measure;
pub mod mna;
pub mod netlist;
pub mod passivity;
pub mod plan;
pub mod report;
pub mod settings;
pub mod solve;
pub mod waveform;

#[cfg(feature = "cli")]
pub mod cli;

/// Compiles and runs the README's example.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
