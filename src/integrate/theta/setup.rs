//! What a run of the stepper starts from, and the stepper at its start.

use std::collections::BTreeSet;

use nalgebra::DVector;

use super::embedded::Smooth;
use super::now::{Attempt, Now};
use super::past_zero::FirstHalf;
use super::stages::Tableau;
use super::unseen::Looks;
use super::{LOCATE, Theta};
use crate::integrate::control::{Amplitudes, Control};
use crate::integrate::energy::{self, Balance};
use crate::integrate::error::Error;
use crate::integrate::inputs::Inputs;
use crate::integrate::stats::Stats;
use crate::integrate::step::Scheme;
use crate::integrate::switching::{Switches, Threshold};
use crate::integrate::system::{Plant, Reduce};
use crate::settings::Settings;
use crate::settings::tolerances::steps::{CORNER, FIRST, GRANT, GRANT_EMBEDDED};
use crate::settings::tolerances::times::SPAN_PARTS;

/// How steps are chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stepping {
    /// Steps of this length, s (shortened so that they land on stops).
    Fixed(f64),
    /// Steps that keep the error over the span, s, within `Settings::tol`; the first is tried at `first` s.
    Controlled {
        /// The simulated span, s.
        span: f64,
        /// First step, s.
        first: f64,
    },
}

/// What a run of the stepper starts from.
pub struct Setup {
    /// Reduces the circuit for a switch position.
    pub reduce: Reduce,
    /// Start position of every switch.
    pub position: Vec<bool>,
    /// Thresholds of every switch.
    pub thresholds: Vec<Threshold>,
    /// Start time, s.
    pub t: f64,
    /// Where the run starts.
    pub start: Start,
    /// θ and γ.
    pub scheme: Scheme,
    /// Step choice.
    pub stepping: Stepping,
    /// No step is longer than this, s.
    pub longest: f64,
    /// Tolerances.
    pub settings: Settings,
}

/// The state before t = 0+.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// All capacitor voltages and inductor currents, s⁻.
    Storage(DVector<f64>),
    /// The state x of the first system.
    State(DVector<f64>),
}

impl Theta {
    /// A stepper at its start, before the jump at t = 0+.
    ///
    /// # Errors
    /// The reduction's for the start position.
    pub fn new(setup: Setup) -> Result<Self, Error> {
        let Setup {
            mut reduce,
            position,
            thresholds,
            t,
            start,
            scheme,
            stepping,
            longest,
            settings,
        } = setup;
        let first = reduce(&position)?;
        let inputs = Inputs::new(&first.inputs);
        let mut plant = Plant::new(reduce, settings.lcp_residual);
        let at = plant.system(&position, &inputs, t)?;
        // Edges at the start act when the run begins.
        let u = inputs.all_before(t);
        let system = &plant.systems[at].1;
        let (x, storage) = match start {
            Start::Storage(s) => (system.state_from(&s), s),
            Start::State(x) => {
                let s = system.storage(x.as_slice(), &u);
                (x, s)
            }
        };
        let metric = &system.lcs.storage.metric;
        let balance = if metric.nrows() == storage.len() {
            let mut balance = Balance::new(0.5 * storage.dot(&(metric * &storage)));
            let joined = system.storage(x.as_slice(), &u);
            balance.add_jump(energy::taking_over(
                &system.lcs,
                storage.as_slice(),
                &x,
                &joined,
            ));
            balance
        } else {
            Balance::new(energy::stored(&system.lcs, x.as_slice(), &u))
        };
        let now = Now {
            t,
            x: x.as_slice().to_vec(),
            u: u.clone(),
            active: vec![false; system.lcs.m()],
            pattern: vec![false; system.lcs.m()],
            settle: true,
            system: at,
            balance,
            ..Now::default()
        };
        let amplitudes = Amplitudes::new(&system.lcs, &inputs);
        let switches = Switches::new(position, thresholds, &system.lcs);
        let tableau = Tableau::of(system, scheme);
        let order = tableau.map_or(scheme.order(), |t| t.order);
        let corner = match tableau {
            Some(_) if scheme != Scheme::MOREAU => GRANT_EMBEDDED,
            Some(_) => GRANT,
            None => CORNER,
        };
        let (control, preferred) = match stepping {
            Stepping::Fixed(_) => (None, f64::INFINITY),
            Stepping::Controlled { span, first } => {
                // Rows between choose no steps, the first one neither.
                let embedded = tableau.is_some() && scheme != Scheme::MOREAU;
                let first = if embedded {
                    FIRST * span / SPAN_PARTS
                } else {
                    first
                };
                (Some(Control::new(order, corner, &settings, span)), first)
            }
        };
        let mut theta = Self {
            plant,
            u_next: u.clone(),
            du: vec![0.0; u.len()],
            inputs,
            switches,
            scheme,
            stepping,
            longest,
            settings,
            kept: now.clone(),
            now,
            started: false,
            start: storage.clone(),
            damped: false,
            whole: false,
            locate: LOCATE,
            scouts: false,
            at_rest: None,
            preferred,
            reads_coarsely: false,
            last_h: 0.0,
            z: Vec::new(),
            out: Vec::new(),
            lambda: Vec::new(),
            y: Vec::new(),
            attempt: Attempt::default(),
            coarse: Vec::new(),
            first_half: FirstHalf::default(),
            rounding: Vec::new(),
            stock: Vec::new(),
            control,
            looks: Looks::default(),
            edge: t,
            jumped: t,
            smooth: Smooth::default(),
            stats: Stats::default(),
            modes: BTreeSet::new(),
            not_unique: BTreeSet::new(),
            noted_rivals: false,
            notes: Vec::new(),
            worst_residual: 0.0,
            pending: Vec::new(),
            ports: Vec::new(),
            amplitudes,
        };
        theta.resize();
        Ok(theta)
    }
}
