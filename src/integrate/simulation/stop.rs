//! What a simulation is asked for, where it stops, and where it may be taken up again.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::circuit::{Circuit, Source};
use crate::integrate::energy::Balance;
use crate::integrate::event::Event;
use crate::integrate::problem::Problem;
use crate::integrate::simulate::{Method, SimOptions};
use crate::integrate::stats::{Impulse, StateJumps};
use crate::settings::Settings;

/// What a simulation may be asked for.
#[derive(Debug, Clone, Default)]
pub struct SimulationOptions {
    /// The method.
    pub method: Method,
    /// θ, default ½ (1 for `euler`).
    pub theta: Option<f64>,
    /// γ, default ½ (1 for `euler`).
    pub gamma: Option<f64>,
    /// Fixed step, s; error-controlled where absent.
    pub step: Option<f64>,
    /// Where it ends at the latest, s; by default where the circuit's `.tran` does.
    pub until: Option<f64>,
    /// Ends an advance when set, with [`Reason::Interrupted`](crate::integrate::Reason::Interrupted) and the simulation where it came to.
    pub cancel: Option<Arc<AtomicBool>>,
    /// Tolerances.
    pub settings: Settings,
}

/// Why [`Simulation::advance_to_event`](super::Simulation::advance_to_event) came back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The time asked for is reached.
    Time,
    /// A device or switch changed its state, or the state jumped.
    Event,
}

/// Where a simulation stands after an advance, and what happened on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// Time, s.
    pub time: f64,
    /// Why it stands here.
    pub reason: StopReason,
    /// What happened since the last stop, one at this time included.
    pub events: Vec<Event>,
}

/// A state of a simulation to return to.
#[derive(Debug, Clone)]
pub struct Checkpoint {
    pub(super) circuit: Arc<Circuit>,
    pub(super) problem: Problem,
    /// Waveforms that were given to sources.
    pub(super) replaced: Vec<(usize, Source)>,
    pub(super) balance: Balance,
    pub(super) impulses: Vec<Impulse>,
    pub(super) state_jumps: StateJumps,
}

impl Checkpoint {
    /// Its time, s.
    #[must_use]
    pub const fn time(&self) -> f64 {
        self.problem.start.t
    }
}

impl SimulationOptions {
    /// The same as options of a whole run.
    pub(super) fn as_asked(&self) -> SimOptions<'static> {
        SimOptions {
            method: self.method,
            theta: self.theta,
            gamma: self.gamma,
            step: self.step,
            settings: self.settings.clone(),
            ..SimOptions::default()
        }
    }
}
