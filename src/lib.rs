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
//! A [`Model`] is a circuit from a netlist, or built by a program; everything else is asked of it.
//!
//! ```
//! use circ::{Model, SimOptions};
//!
//! let rectifier = "rectifier\nv1 in 0 sin(0 10 50)\nd1 in out d\nc1 out 0 100u\nr1 out 0 1k\n\
//!     .model d d(ideal)\n.tran 0.1m 40m\n.end\n";
//! let model = Model::parse(rectifier, "rectifier.cir")?;
//! let run = model.transient(SimOptions::default())?;
//! let peak = run.waveforms.column(1).fold(0.0, f64::max);
//! assert!((peak - 10.0).abs() < 1e-3);
//! assert!(run.events[0].concerns("d1"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | to | take |
//! |---|---|
//! | read a netlist, change values | [`Model`] |
//! | simulate from start to end | [`Model::transient`], with [`SimOptions`] |
//! | drive a simulation, with a controller in the loop | [`Model::simulation`]: [`Simulation`], [`Stop`], [`Checkpoint`] |
//! | see what happened | [`Run`], [`Event`], [`Waveforms`] |
//! | sweep, measure, ask for operating points | [`analysis`] |
//! | have the matrices | [`Model::lcs`]: [`Lcs`] |
//! | build a circuit without text | [`Circuit::named`] |
//!
//! Data flows one way, and the modules stand in that order:
//!
//! ```text
//! netlist → circuit → mna → lcs → plan → integrate (with solve) → model → analysis → report
//! ```

// Lets the systems under tests/ be used by the library's own tests as well.
#[cfg(test)]
extern crate self as circ;

pub mod algebra;
pub mod analysis;
pub mod check;
pub mod circuit;
pub mod diagnostic;
pub mod forms;
pub mod integrate;
pub mod law;
pub mod lcs;
mod linalg;
pub mod measure;
pub mod mna;
pub mod model;
pub mod netlist;
pub mod passivity;
pub mod plan;
pub mod report;
pub mod settings;
pub mod solve;
pub mod waveform;

#[cfg(feature = "cli")]
pub mod cli;

pub use circuit::{Circuit, Diodes, ElaborateOptions};
pub use diagnostic::{Diagnostic, Faults, Severity};
pub use integrate::{
    Change, Checkpoint, Error, Event, Method, OperatingPoint, Run, SimOptions, Simulation,
    SimulationOptions, Stop, StopReason,
};
pub use lcs::Lcs;
pub use model::Model;
pub use waveform::Waveforms;

/// Compiles and runs the README's example.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
