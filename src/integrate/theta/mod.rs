//! The (θ, γ) stepper: Moreau's scheme, Siconos' θ-scheme, the midpoint rule; fixed or error-controlled steps.
//!
//! Between two stops (output times, edges and kinks of sources, switching times known in advance) the span is divided into
//! equal base steps; a base step may be halved again and again, always at multiples of its halves, so that few step lengths
//! occur and every one of them keeps its factorisations. A step first tries the active set of the last one: one fused product
//! and a sign test. Where that fails, the step is solved with γ = 1 by the [`Driver`](crate::solve::Driver).

mod ahead;
mod attempt;
mod cancellation;
mod embedded;
mod jumps;
mod lines;
mod march;
mod now;
mod passage;
mod past_zero;
mod right_limit;
mod setup;
mod stages;
#[cfg(test)]
mod tests;
mod unseen;

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::DVector;

use crate::integrate::Note;
use crate::integrate::control::{Amplitudes, Control};
use crate::integrate::energy::{self, Balance};
use crate::integrate::error::{Error, Reason};
use crate::integrate::event::Change;
use crate::integrate::exact::Place;
use crate::integrate::inputs::Inputs;
use crate::integrate::log::Log;
use crate::integrate::reading::{self, Point};
use crate::integrate::run::{Outcome, Stepper};
use crate::integrate::stats::{StatedError, Stats};
use crate::integrate::step::Scheme;
use crate::integrate::switching::{Demand, Switches};
use crate::integrate::system::{Plant, System};
use crate::lcs::{Lcs, Port, Role};
use crate::settings::Settings;
use crate::solve::{Solution, Status};
use embedded::Smooth;
use now::{Attempt, Now};
use past_zero::FirstHalf;
pub use setup::{Setup, Start, Stepping};
use stages::Tableau;
use unseen::Looks;

/// Sub-steps of a base step are multiples of 2^−FINEST of it.
const FINEST: u32 = 40;
/// State-driven switching times are located to 2^−LOCATE of a base step: a transient that the switch starts is off by what that is of its time
/// constant. Controls that a solver decides are not known much better.
const LOCATE: i32 = 32;
/// The same where amplitudes alone are wanted.
const LOCATE_ROUGHLY: i32 = 8;
/// Switchings in one base step after which they are no longer located but taken at the ends of whole base steps
/// (chattering: the base step then decides how fast a sliding switch switches).
const CHATTER: u32 = 32;

/// See the [module](self).
pub struct Theta {
    plant: Plant,
    inputs: Inputs,
    switches: Switches,
    scheme: Scheme,
    stepping: Stepping,
    longest: f64,
    settings: Settings,
    now: Now,
    kept: Now,
    started: bool,
    /// Storage before the start.
    start: DVector<f64>,
    /// Settling steps of the midpoint rule are Moreau's for now.
    damped: bool,
    /// See [`Self::keep_whole_steps`].
    whole: bool,
    /// [`LOCATE`], or [`LOCATE_ROUGHLY`].
    locate: i32,
    /// See [`Self::scout`].
    scouts: bool,
    /// See [`Self::begin_at_rest`].
    at_rest: Option<Vec<(f64, f64)>>,
    preferred: f64,
    /// See [`Self::read_coarsely`].
    reads_coarsely: bool,
    last_h: f64,
    u_next: Vec<f64>,
    du: Vec<f64>,
    z: Vec<f64>,
    out: Vec<f64>,
    lambda: Vec<f64>,
    /// y of the last solve, where a law is curved.
    y: Vec<f64>,
    attempt: Attempt,
    coarse: Vec<f64>,
    first_half: FirstHalf,
    /// What differences of states are rounding, where a law is curved.
    rounding: Vec<f64>,
    /// Buffer for s.
    stock: Vec<f64>,
    control: Option<Control>,
    looks: Looks,
    /// The last breakpoint that acted, s.
    edge: f64,
    /// The start, or the last jump since, s: the state there has no error of a step.
    jumped: f64,
    /// Steps chosen by an embedded error, where laws are curved.
    smooth: Smooth,
    stats: Stats,
    modes: BTreeSet<(usize, Vec<bool>)>,
    not_unique: BTreeSet<String>,
    /// Whether a jump between rivals has been noted.
    noted_rivals: bool,
    notes: Vec<Note>,
    worst_residual: f64,
    pending: Vec<(f64, Arc<[Change]>)>,
    /// The ports of transmission lines.
    ports: Vec<lines::Port>,
    /// Largest |s| so far, by storage element: what the error control calls the amplitude.
    amplitudes: Amplitudes,
}

/// A point of a run in steps.
#[derive(Debug, Clone)]
pub(crate) struct Instant {
    /// The system in the position of the switches there, with all devices as ports.
    pub(crate) lcs: Lcs,
    pub(crate) x: DVector<f64>,
    pub(crate) u: DVector<f64>,
    pub(crate) lambda: DVector<f64>,
}

impl Theta {
    /// Sets the amplitudes known beforehand, by storage element.
    pub fn expect_amplitudes(&mut self, amplitudes: Amplitudes) {
        self.amplitudes = amplitudes;
    }

    /// Tells which devices conducted before the start: of several solutions that one is looked for.
    pub fn expect(&mut self, conducting: &[bool]) {
        let ports = &self.plant.systems[self.now.system].1.lcs.ports;
        for (active, (port, on)) in (self.now.active.iter_mut()).zip(ports.iter().zip(conducting)) {
            *active = *on == (port.role != Role::Voltage);
        }
    }

    /// Has steps whose error is controlled made whole in place of their halves, and so the first ones after edges and jumps where they are
    /// prescribed and cut short: the same steps with a larger error.
    pub(crate) fn keep_whole_steps(&mut self) {
        self.whole = true;
    }

    /// Has the run find amplitudes alone: switchings are located to a part of a step that is enough for these, and the run ends where Newton's method does not find a stage
    /// from the one before. Shorter steps have less need of the solvers that always end and cost a hundred times as much.
    pub(crate) fn scout(&mut self) {
        (self.scouts, self.locate) = (true, LOCATE_ROUGHLY);
    }

    /// The run begins at an operating point with these voltages, V, and currents, A, of the ports. Where no edge at the start moves the sources nothing jumps there, whatever a projection on
    /// ideal laws would make of it, and smooth laws have them at that instant: the voltage of a junction that blocks is not told by its current.
    pub(crate) fn begin_at_rest(&mut self, points: Vec<(f64, f64)>) {
        self.at_rest = Some(points);
    }

    /// Has λ at an instant read by a longer step, see [`READING`](crate::settings::tolerances::stated::READING), whose error is larger.
    pub(crate) fn read_coarsely(&mut self) {
        self.reads_coarsely = true;
    }

    /// The amplitudes seen so far.
    #[must_use]
    pub fn amplitudes(&self) -> &Amplitudes {
        &self.amplitudes
    }

    /// Takes note of the size of the present state and of every branch's voltage and current: a state that stays at zero
    /// would else be judged by its own rounding.
    pub fn see(&mut self) {
        let known = self.read_lambda().is_ok();
        let Self {
            amplitudes,
            plant,
            now,
            ..
        } = self;
        let lcs = &plant.systems[now.system].1.lcs;
        amplitudes.see(lcs, &now.x);
        if !known {
            return;
        }
        let at = now.point(&self.lambda, &self.du);
        for i in 0..lcs.outputs.power.len() {
            let v = reading::value(&lcs.outputs.power_v, i, at);
            amplitudes.see_branch(v, reading::value(&lcs.outputs.power_i, i, at));
        }
    }

    /// Control values of the switches at t = 0+, after the first jump in the start position.
    ///
    /// # Errors
    /// As [`Stepper::advance`].
    pub fn controls_at_start(&mut self) -> Result<Vec<f64>, Error> {
        self.begin(&mut Log::new(0, f64::INFINITY, false))?;
        self.read_lambda()?;
        let lcs = &self.plant.systems[self.now.system].1.lcs;
        let at = self.now.point(&self.lambda, &self.du);
        Ok((0..self.switches.len())
            .map(|i| reading::value(&lcs.controls, i, at))
            .collect())
    }

    /// The state x of the present system.
    #[must_use]
    pub fn state(&self) -> &[f64] {
        &self.now.x
    }

    /// Where the run stands, for another method to go on from.
    pub(crate) fn place(&self) -> Place {
        Place {
            t: self.now.t,
            storage: self.system().storage(&self.now.x, &self.now.u),
            switches: self.switches.position().to_vec(),
        }
    }

    /// Where the run stands at the right limit, and its system.
    ///
    /// # Errors
    /// λ cannot be found there.
    pub(crate) fn instant(&mut self) -> Result<Instant, Error> {
        self.read_lambda()?;
        let lcs = self.system().lcs.clone();
        let [x, u, lambda] = [&self.now.x, &self.now.u, &self.lambda]
            .map(|values| DVector::from_column_slice(values));
        Ok(Instant { lcs, x, u, lambda })
    }

    /// Has another balance from here on.
    pub(crate) fn set_balance(&mut self, balance: Balance) {
        self.now.balance = balance;
    }

    /// The balance so far.
    pub(crate) fn balance(&mut self) -> Balance {
        self.note_energy();
        self.now.balance
    }

    /// Starts a new energy balance from the present state.
    pub(crate) fn empty_account(&mut self) {
        let lcs = &self.plant.systems[self.now.system].1.lcs;
        let stored = energy::stored(lcs, &self.now.x, &self.now.u);
        self.now.balance = Balance::new(stored);
    }

    /// The largest complementarity residual of a step that the solvers solved.
    #[must_use]
    pub fn worst_residual(&self) -> f64 {
        self.worst_residual
    }

    /// The counters so far.
    #[must_use]
    pub fn stats(&self) -> &Stats {
        &self.stats
    }

    fn system(&self) -> &System {
        &self.plant.systems[self.now.system].1
    }

    /// Buffers for the present system.
    fn resize(&mut self) {
        let (n, m, width) = {
            let system = self.system();
            (system.lcs.n(), system.lcs.m(), system.columns.len())
        };
        self.z.resize(width, 0.0);
        self.out.resize(n + m, 0.0);
        self.lambda.clear();
        self.lambda.resize(m, 0.0);
        self.y.clear();
        self.y.resize(m, 0.0);
        self.coarse.resize(n, 0.0);
        self.rounding.clear();
        self.rounding.resize(n, 0.0);
        self.attempt.h = f64::NAN;
    }
}

impl Stepper for Theta {
    fn time(&self) -> f64 {
        match self.smooth.until {
            Some(_) if self.is_smooth() => self.smooth.at,
            _ => self.now.t,
        }
    }

    fn advance(&mut self, t: f64, log: &mut Log) -> Result<(), Error> {
        if !self.started {
            self.begin(log)?;
            self.inputs.slopes_behind(self.now.t, &mut self.du);
            let lcs = &self.plant.systems[self.now.system].1.lcs;
            let moving = self.switches.misplaced(lcs, &self.inputs, self.now.t);
            if !moving.is_empty() || self.asked()? {
                self.switch(&moving, log)?;
            }
        }
        (self.smooth.apart, self.smooth.at) = (t - self.smooth.at, t);
        while self.now.t < t && !self.is_at(t) {
            if self.is_smooth() {
                self.stride(t, log)?;
                if log.pauses() {
                    break;
                }
                continue;
            }
            let now = self.now.t;
            let breakpoint = self.inputs.next_corner(now);
            let merged = (t - breakpoint).abs() <= Self::slack(t);
            let limit = if merged {
                breakpoint.max(t)
            } else {
                breakpoint.min(t)
            };
            let (known, mut moving) = self.switches.next_known(
                &self.system().lcs,
                &self.inputs,
                now,
                limit,
                Self::slack(limit),
            );
            let mut stop = if merged { t } else { limit };
            let early = known < stop - Self::slack(stop);
            if early {
                stop = known;
            }
            let before = self.switches.position().to_vec();
            self.interval(stop, log)?;
            // What moved with another switch that passed its threshold there has moved.
            let position = self.switches.position();
            moving.retain(|&i| position[i] == before[i]);
            if log.pauses() && self.now.t < stop {
                break;
            }
            let at_breakpoint = !early && (breakpoint - stop).abs() <= Self::slack(stop);
            if at_breakpoint {
                self.edge(breakpoint.max(stop), log)?;
                let here = (self.now.t, Self::slack(self.now.t));
                let lcs = &self.system().lcs;
                (self.switches).add_late(lcs, &self.inputs, here, &mut moving);
            }
            if !moving.is_empty() {
                self.inputs
                    .right_of_silent(known.max(stop), &mut self.now.u);
            }
            if !moving.is_empty() || at_breakpoint && self.asked()? {
                self.switch(&moving, log)?;
            }
            if log.pauses() {
                break;
            }
        }
        if !self.is_behind() {
            self.note_energy();
        }
        Ok(())
    }

    fn read(&mut self, row: &mut [f64]) {
        if self.is_behind() {
            self.read_within(row);
        } else {
            self.read_point(row);
        }
    }

    fn finish(&mut self) -> Outcome {
        self.note_energy();
        self.stats.modes = self.modes.len().max(1) as u64;
        let systems = self.plant.systems.iter().map(|(_, system)| system);
        self.stats.positions = systems.len() as u64;
        let with_pairs = systems.clone().filter(|system| system.lcs.m() > 0);
        self.stats.systems = with_pairs.count() as u64;
        self.stats.impulsive = systems.filter(|system| system.jump.is_some()).count() as u64;
        let mut notes = self.notes.clone();
        if !self.not_unique.is_empty() {
            let devices: Vec<String> = self.not_unique.iter().cloned().collect();
            notes.push(Note::shared(&devices));
        }
        Outcome {
            error: StatedError {
                event_time: Some(self.now.event_step),
                ..StatedError::default()
            },
            common: self.smooth.common + self.smooth.largest,
            stats: self.stats.clone(),
            energy: self.now.balance.energy(),
            notes,
            storage: self.place().storage.as_slice().to_vec(),
        }
    }
}
