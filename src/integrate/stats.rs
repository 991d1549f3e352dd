//! What a run did and what it found, besides the waveforms.

use std::sync::Arc;

use crate::integrate::rows::RowKind;
use crate::waveform::Waveforms;

/// Counters of one run; deterministic except `cpu_seconds`.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Stats {
    /// Accepted time steps.
    pub steps: u64,
    /// Rejected time steps.
    pub rejected: u64,
    /// Changes of mode.
    pub events: u64,
    /// Changes of state by an impulse.
    pub jumps: u64,
    /// Distinct modes (active sets, switch positions) visited.
    pub modes: u64,
    /// One-step complementarity problems solved (cached active sets that were accepted included).
    pub lcp_solves: u64,
    /// Of these, the ones where the cached active set did not hold and a solver ran.
    pub pivotings: u64,
    /// Factorisations computed.
    pub factorisations: u64,
    /// User CPU seconds of the solve alone.
    pub cpu_seconds: f64,
}

/// The energy balance of a run, J.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct Energy {
    /// Delivered by sources.
    pub source: f64,
    /// Dissipated in resistors, devices and by jumps.
    pub dissipated: f64,
    /// Stored at the end minus stored at the start.
    pub stored: f64,
    /// |source − dissipated − stored| relative to the largest energy seen.
    pub residual_relative: f64,
}

/// A current (or voltage) impulse.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Impulse {
    /// Time, s.
    pub t: f64,
    /// `i(d1)`.
    pub name: String,
    /// A·s or V·s.
    pub area: f64,
}

/// Everything a simulation returns.
#[derive(Debug, Clone, Default)]
pub struct Run {
    /// The waveforms on the output grid (with event rows if asked for); no row where they were for [`SimOptions::rows`] alone.
    ///
    /// [`SimOptions::rows`]: crate::integrate::SimOptions::rows
    pub waveforms: Waveforms,
    /// What each row stands at; empty where all are the grid's.
    pub kinds: Vec<RowKind>,
    /// `exact`, `theta`, `euler`.
    pub method: String,
    /// What the plan decided, in words.
    pub plan: Vec<String>,
    /// Counters.
    pub stats: Stats,
    /// The energy balance.
    pub energy: Energy,
    /// The error of the states that the steps themselves let expect, relative to their amplitudes; none for exact runs.
    pub error_estimate: Option<f64>,
    /// Impulses at jumps.
    pub impulses: Vec<Impulse>,
    /// Event times, s, with the devices whose state changed.
    pub events: Vec<(f64, Arc<str>)>,
    /// Things the user should know.
    pub notes: Vec<String>,
}
