//! The (θ, γ) stepper: Moreau's scheme, Siconos' θ-scheme, the midpoint rule; fixed or error-controlled steps.
//!
//! Between two stops (output times, edges and kinks of sources, switching times known in advance) the span is divided into
//! equal base steps; a base step may be halved again and again, always at multiples of its halves, so that few step lengths
//! occur and every one of them keeps its factorisations. A step first tries the active set of the last one: one fused product
//! and a sign test. Where that fails, the step is solved with γ = 1 by the [`Driver`](crate::solve::Driver).

use std::collections::BTreeSet;

use nalgebra::DVector;

use crate::integrate::control::{Amplitudes, Control};
use crate::integrate::energy::{self, Balance};
use crate::integrate::inputs::Inputs;
use crate::integrate::reading::{self, Point};
use crate::integrate::run::{Log, Outcome, Reason, SimError, Stepper};
use crate::integrate::stats::Stats;
use crate::integrate::step::Scheme;
use crate::integrate::switching::{Switches, Threshold};
use crate::integrate::system::{Plant, Reduce, System};
use crate::lcs::Role;
use crate::settings::Settings;
use crate::solve::Status;

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
pub struct Setup<'a> {
    /// Reduces the circuit for a switch position.
    pub reduce: Reduce<'a>,
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

/// Sub-steps of a base step are multiples of 2^−FINEST of it.
const FINEST: u32 = 40;
/// State-driven switching times are located to 2^−LOCATE of a base step.
const LOCATE: u32 = 24;
/// Switchings in one base step after which they are no longer located but taken at the ends of whole base steps
/// (chattering: the base step then decides how fast a sliding switch switches).
const CHATTER: u32 = 32;
/// λ at an output time is that of one implicit step shorter than the last one by 2^READ: its error is 2^−READ of the step's,
/// the amplified rounding of the state 2^READ ε.
const READ: i32 = 12;
/// A spontaneous impulse is recognised by p = hλ that does not shrink with h: p(h/2) above this part of p(h), where
/// a finite λ gives at most one half.
const IMPULSE_RATIO: f64 = 0.75;

/// See the [module](self).
pub struct Theta<'a> {
    plant: Plant<'a>,
    inputs: Inputs,
    switches: Switches,
    scheme: Scheme,
    stepping: Stepping,
    longest: f64,
    settings: Settings,
    now: Now,
    kept: Now,
    started: bool,
    preferred: f64,
    last_h: f64,
    u_next: Vec<f64>,
    du: Vec<f64>,
    z: Vec<f64>,
    out: Vec<f64>,
    lambda: Vec<f64>,
    attempt: Attempt,
    coarse: Vec<f64>,
    control: Option<Control>,
    storage: DVector<f64>,
    stats: Stats,
    modes: BTreeSet<(usize, Vec<bool>)>,
    not_unique: BTreeSet<String>,
    notes: Vec<String>,
    pending: Vec<(f64, String)>,
    /// Largest |s| so far, by storage element: what the error control calls the amplitude.
    amplitudes: Amplitudes,
}

/// Everything a rejected step has to give back.
#[derive(Debug, Clone, Default)]
struct Now {
    t: f64,
    x: Vec<f64>,
    /// Right limit of u at t.
    u: Vec<f64>,
    active: Vec<bool>,
    /// The next step must have γ = 1: the constraints may not hold at t.
    settle: bool,
    system: usize,
    balance: Balance,
}

impl Now {
    fn copy_from(&mut self, other: &Self) {
        self.x.clone_from(&other.x);
        self.u.clone_from(&other.u);
        self.active.clone_from(&other.active);
        self.t = other.t;
        self.settle = other.settle;
        self.system = other.system;
        self.balance = other.balance;
    }
}

/// How the present attempt was made.
#[derive(Debug, Clone, Default)]
struct Attempt {
    step: usize,
    mode: usize,
    h: f64,
    /// The active set after the step, where the solvers ran.
    solved: Option<Vec<bool>>,
}

impl<'a> Theta<'a> {
    /// A stepper at its start, before the jump at t = 0+.
    ///
    /// # Errors
    /// The reduction's for the start position.
    pub fn new(setup: Setup<'a>) -> Result<Self, SimError> {
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
        let u = inputs.all(t);
        let system = &plant.systems[at].1;
        let (x, storage) = match start {
            Start::Storage(s) => (system.state_from(&s), s),
            Start::State(x) => {
                let s = system.storage(x.as_slice(), &u);
                (x, s)
            }
        };
        let metric = &system.lcs.storage.metric;
        let stored = if metric.nrows() == storage.len() {
            0.5 * storage.dot(&(metric * &storage))
        } else {
            energy::stored(&system.lcs, x.as_slice(), &u)
        };
        let now = Now {
            t,
            x: x.as_slice().to_vec(),
            u: u.clone(),
            active: vec![false; system.lcs.m()],
            settle: true,
            system: at,
            balance: Balance::new(stored),
        };
        let amplitudes = Amplitudes::new(&system.lcs, &inputs);
        let switches = Switches::new(position, thresholds, &system.lcs);
        let (control, preferred) = match stepping {
            Stepping::Fixed(_) => (None, f64::INFINITY),
            Stepping::Controlled { span, first } => {
                (Some(Control::new(scheme, &settings, span)), first)
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
            preferred,
            last_h: 0.0,
            z: Vec::new(),
            out: Vec::new(),
            lambda: Vec::new(),
            attempt: Attempt::default(),
            coarse: Vec::new(),
            control,
            storage,
            stats: Stats::default(),
            modes: BTreeSet::new(),
            not_unique: BTreeSet::new(),
            notes: Vec::new(),
            pending: Vec::new(),
            amplitudes,
        };
        theta.resize();
        Ok(theta)
    }

    /// Sets the amplitudes known beforehand, by storage element.
    pub fn expect_amplitudes(&mut self, amplitudes: Amplitudes) {
        self.amplitudes = amplitudes;
    }

    /// The amplitudes seen so far.
    #[must_use]
    pub fn amplitudes(&self) -> &Amplitudes {
        &self.amplitudes
    }

    /// The state x of the present system.
    #[must_use]
    pub fn state(&self) -> &[f64] {
        &self.now.x
    }

    /// The counters so far.
    #[must_use]
    pub fn stats(&self) -> &Stats {
        &self.stats
    }

    fn system(&self) -> &System {
        &self.plant.systems[self.now.system].1
    }

    fn system_mut(&mut self) -> &mut System {
        &mut self.plant.systems[self.now.system].1
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
        self.coarse.resize(n, 0.0);
        self.attempt.h = f64::NAN;
    }

    // ---- one step ----------------------------------------------------------------------------------------------

    /// Rounding of the difference of two times near `t`.
    fn slack(t: f64) -> f64 {
        8.0 * f64::EPSILON * t.abs()
    }

    /// Computes the step from now to t1 = now + h into `out` without committing it.
    fn attempt(&mut self, h: f64, t1: f64) -> Result<(), SimError> {
        self.inputs.left(t1, &mut self.u_next);
        self.stats.lcp_solves += 1;
        let scheme = if self.now.settle {
            self.scheme.implicit_in_lambda()
        } else {
            self.scheme
        };
        let Self {
            plant,
            now,
            attempt,
            settings,
            ..
        } = self;
        let system = &mut plant.systems[now.system].1;
        system
            .columns
            .fill(&now.x, &self.u_next, &now.u, &mut self.z);
        let same = attempt.h == h && system.step(attempt.step).scheme == scheme;
        if !same || attempt.solved.is_some() {
            let tolerance = settings.lcp_residual;
            let (step, new) = system
                .matrices(h, Self::slack(t1), scheme, tolerance)
                .map_err(|reason| SimError::at(now.t, reason))?;
            let (mode, fused) = system.mode(step, &now.active);
            self.stats.factorisations += u64::from(new) + u64::from(fused);
            *attempt = Attempt {
                step,
                mode,
                h,
                solved: None,
            };
        }
        let n = now.x.len();
        let fused = system.step(attempt.step).fused(attempt.mode);
        if fused.step(&self.z, n, &mut self.out) {
            return Ok(());
        }
        self.solve_step(h, t1)
    }

    /// The step with γ = 1 by the solvers.
    #[cold]
    fn solve_step(&mut self, h: f64, t1: f64) -> Result<(), SimError> {
        self.stats.pivotings += 1;
        let scheme = self.scheme.implicit_in_lambda();
        let tolerance = self.settings.lcp_residual;
        let now = &self.now;
        let system = &mut self.plant.systems[now.system].1;
        let (step, new) = system
            .matrices(h, Self::slack(t1), scheme, tolerance)
            .map_err(|reason| SimError::at(now.t, reason))?;
        self.stats.factorisations += u64::from(new);
        let matrices = system.step_mut(step);
        let q = matrices.q(&self.z);
        let before = matrices.driver.factorisations;
        matrices.driver.suggest(&now.active);
        let solution = matrices.driver.solve(&q);
        self.stats.factorisations += matrices.driver.factorisations - before;
        let x = matrices.x_next(&self.z, &solution.lambda);
        if x.iter().any(|v| !v.is_finite()) {
            return Err(SimError::at(now.t, Reason::Overflow));
        }
        let device = |active: &[bool], at: Option<usize>| {
            let j = at.or_else(|| (0..active.len()).find(|&j| active[j] != now.active[j]));
            j.map(|j| system.lcs.ports[j].device.clone())
        };
        let failure = match solution.status {
            Status::Solved => None,
            Status::Infeasible(ref ray) => Some((Reason::Infeasible, Some(ray.imax()))),
            Status::Failed => Some((
                Reason::Residual {
                    residual: solution.residual,
                    tolerance,
                },
                None,
            )),
        };
        if let Some((reason, at)) = failure {
            let mut error = SimError::at(now.t, reason);
            error.device = device(&solution.active, at);
            return Err(error);
        }
        let n = now.x.len();
        self.out[..n].copy_from_slice(x.as_slice());
        for j in 0..solution.active.len() {
            self.out[n + j] = if solution.active[j] {
                solution.lambda[j]
            } else {
                solution.y[j]
            };
        }
        self.lambda.copy_from_slice(solution.lambda.as_slice());
        self.attempt = Attempt {
            step,
            mode: 0,
            h,
            solved: Some(solution.active),
        };
        Ok(())
    }

    /// Makes the attempt the present.
    fn commit(&mut self, t1: f64) -> Result<(), SimError> {
        let n = self.now.x.len();
        self.stats.steps += 1;
        if self.stats.steps > self.settings.max_steps {
            let reason = Reason::TooManySteps {
                limit: self.settings.max_steps,
            };
            return Err(SimError::at(self.now.t, reason));
        }
        if let Some(active) = self.attempt.solved.take() {
            self.commit_solved(active, t1)?;
        } else {
            let system = &self.plant.systems[self.now.system].1;
            let fused = system.step(self.attempt.step).fused(self.attempt.mode);
            self.now.balance.add(fused.power.over_step(&self.z));
        }
        self.now.settle = false;
        self.now.x.copy_from_slice(&self.out[..n]);
        self.now.u.copy_from_slice(&self.u_next);
        self.now.t = t1;
        self.last_h = self.attempt.h;
        Ok(())
    }

    #[cold]
    fn commit_solved(&mut self, active: Vec<bool>, t1: f64) -> Result<(), SimError> {
        let n = self.now.x.len();
        let h = self.attempt.h;
        // Energy at the end of the step (γ = 1) from the solution itself.
        for (du, (a, b)) in self.du.iter_mut().zip(self.u_next.iter().zip(&self.now.u)) {
            *du = (a - b) / h;
        }
        let at = Point {
            x: &self.out[..n],
            lambda: &self.lambda,
            u: &self.u_next,
            du: &self.du,
        };
        let (source, dissipated) = energy::power(&self.system().lcs, at);
        self.now.balance.add((source * h, dissipated * h));
        if active != self.now.active {
            let lcs = &self.plant.systems[self.now.system].1.lcs;
            let changed: Vec<&str> = (0..active.len())
                .filter(|&j| active[j] != self.now.active[j])
                .map(|j| lcs.ports[j].device.as_str())
                .collect();
            if self.started {
                self.pending.push((t1, changed.join(" ")));
            }
            self.modes.insert((self.now.system, active.clone()));
            self.now.active = active;
        }
        self.attempt.h = f64::NAN;
        Ok(())
    }

    // ---- base steps --------------------------------------------------------------------------------------------

    /// Advances to `stop`, which no breakpoint lies before; u is the left limit there.
    fn interval(&mut self, stop: f64, log: &mut Log) -> Result<(), SimError> {
        let (t0, span) = (self.now.t, stop - self.now.t);
        let longest = match self.stepping {
            Stepping::Fixed(h) => h.min(self.longest),
            Stepping::Controlled { .. } => self.longest.min(self.inputs.largest_step()),
        };
        // A quotient within rounding of an integer is that integer.
        let count = (span / longest * (1.0 - 1e-9)).ceil().max(1.0);
        let h = span / count;
        let simple = self.control.is_none() && !self.switches.watch();
        for k in 1..=count as u64 {
            let t1 = if k as f64 == count {
                stop
            } else {
                t0 + span * (k as f64 / count)
            };
            if simple {
                self.attempt(h, t1)?;
                let changed = self.attempt.solved.is_some();
                let impulse = changed && self.impulsive(h)?;
                self.finish_step(t1, impulse, log)?;
            } else {
                self.divided_step(h, t1, log)?;
            }
        }
        self.switches.forget_chatter();
        Ok(())
    }

    fn finish_step(&mut self, t1: f64, impulse: bool, log: &mut Log) -> Result<(), SimError> {
        if impulse {
            self.log_spontaneous(t1, log);
        }
        self.commit(t1)?;
        if impulse {
            self.now.settle = true;
        }
        if !self.pending.is_empty() {
            self.report(log);
        }
        Ok(())
    }

    /// A base step with halving: for the error and to locate state-driven switchings.
    fn divided_step(&mut self, base: f64, end: f64, log: &mut Log) -> Result<(), SimError> {
        const WHOLE: u64 = 1 << FINEST;
        let start = self.now.t;
        let mut done = 0;
        while done < WHOLE {
            let wanted = (base / self.preferred)
                .log2()
                .ceil()
                .clamp(0.0, f64::from(FINEST) - 1.0);
            let aligned = if done == 0 {
                0
            } else {
                FINEST - done.trailing_zeros()
            };
            let mut level = (wanted as u32).max(aligned);
            loop {
                let size = WHOLE >> level;
                let h = base / 2_f64.powi(level as i32);
                let t1 = if done + size == WHOLE {
                    end
                } else {
                    start + base * ((done + size) as f64 / WHOLE as f64)
                };
                if self.tentative(h, t1, level, log)? {
                    done += size;
                    break;
                }
                self.stats.rejected += 1;
                level += 1;
            }
        }
        Ok(())
    }

    /// One step of a divided base step: `false` to have it halved, else it is done, with all its consequences.
    fn tentative(&mut self, h: f64, t1: f64, level: u32, log: &mut Log) -> Result<bool, SimError> {
        self.kept.copy_from(&self.now);
        let steps = self.stats.steps;
        let mut last_chance = level + 2 >= FINEST;
        if let Some(control) = &self.control {
            last_chance |= h <= control.smallest();
        }
        let mut impulse = false;
        if self.control.is_some() {
            self.attempt(h, t1)?;
            let n = self.now.x.len();
            self.coarse.copy_from_slice(&self.out[..n]);
            let middle = self.now.t + 0.5 * (t1 - self.now.t);
            self.attempt(0.5 * h, middle)?;
            self.commit(middle)?;
            self.attempt(0.5 * h, t1)?;
            if last_chance && self.attempt.solved.is_some() {
                impulse = self.impulsive(0.5 * h)?;
            }
            self.commit(t1)?;
            let error = self
                .amplitudes
                .error(&self.system().lcs, &self.coarse, &self.now.x);
            let Some(control) = &self.control else {
                return Ok(true);
            };
            let verdict = control.judge(h, error);
            self.preferred = verdict.next;
            if !verdict.accept && !last_chance {
                self.back(steps);
                return Ok(false);
            }
        } else {
            self.preferred = f64::INFINITY;
            self.attempt(h, t1)?;
            self.commit(t1)?;
        }
        if self.switches.watch() && self.crossed()? {
            if level < LOCATE && !last_chance && !self.switches.chattering(CHATTER) {
                self.back(steps);
                self.preferred = f64::INFINITY;
                return Ok(false);
            }
            self.preferred = h;
            self.report(log);
            self.switch(log)?;
        }
        if impulse {
            self.now.settle = true;
        }
        if self.control.is_some() {
            let Self {
                amplitudes,
                plant,
                now,
                ..
            } = self;
            amplitudes.see(&plant.systems[now.system].1.lcs, &now.x);
        }
        self.report(log);
        Ok(true)
    }

    fn back(&mut self, steps: u64) {
        self.now.copy_from(&self.kept);
        self.stats.steps = steps;
        self.pending.clear();
        self.attempt.h = f64::NAN;
    }

    /// Moves pending mode changes into the log, with their rows.
    fn report(&mut self, log: &mut Log) {
        for (t, what) in std::mem::take(&mut self.pending) {
            self.stats.events += 1;
            log.event(t, what);
            if log.wants_rows() && t == self.now.t {
                self.log_row(log);
            }
        }
    }

    fn log_row(&mut self, log: &mut Log) {
        let mut row = vec![0.0; self.system().lcs.outputs.names.len()];
        self.read(&mut row);
        log.row(self.now.t, &row);
    }

    /// Whether the attempted step of a network that may jump by itself contains an impulse: p = hλ is compared with that
    /// of half the step from the same state. Passive networks jump only where sources or switches do.
    fn impulsive(&mut self, h: f64) -> Result<bool, SimError> {
        let may = self
            .system()
            .jump
            .as_ref()
            .is_some_and(|jump| !jump.monotone);
        if !may {
            return Ok(false);
        }
        let whole: Vec<f64> = self.lambda.iter().map(|l| l * h).collect();
        let (out, lambda, attempt) = (self.out.clone(), self.lambda.clone(), self.attempt.clone());
        let middle = self.now.t + 0.5 * h;
        let half = self.attempt(0.5 * h, middle);
        let solved = self.attempt.solved.is_some();
        let size = |p: &[f64]| p.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let part = if solved {
            0.5 * h * size(&self.lambda)
        } else {
            0.0
        };
        self.out = out;
        self.lambda = lambda;
        self.attempt = attempt;
        self.inputs.left(self.now.t + h, &mut self.u_next);
        let system = &self.plant.systems[self.now.system].1;
        system
            .columns
            .fill(&self.now.x, &self.u_next, &self.now.u, &mut self.z);
        Ok(half.is_ok() && part > IMPULSE_RATIO * size(&whole))
    }

    fn log_spontaneous(&mut self, t: f64, log: &mut Log) {
        self.stats.jumps += 1;
        let p: Vec<f64> = self.lambda.iter().map(|l| l * self.attempt.h).collect();
        let still = vec![0.0; self.now.u.len()];
        self.log_impulses(t, &p, &still, log);
    }

    // ---- jumps and switches ------------------------------------------------------------------------------------

    /// The first jump, from inconsistent initial values.
    fn begin(&mut self, log: &mut Log) -> Result<(), SimError> {
        // Folding the storage vector into a state is part of the start: what it loses is dissipated.
        let u = self.now.u.clone();
        let folded = energy::stored(&self.system().lcs, &self.now.x, &u);
        let lost = self.now.balance.first() - folded;
        self.now.balance.add((0.0, lost));
        self.jump(&u, None, log)?;
        self.note_energy();
        self.started = true;
        let Self {
            amplitudes,
            plant,
            now,
            ..
        } = self;
        amplitudes.see(&plant.systems[now.system].1.lcs, &now.x);
        Ok(())
    }

    /// At a breakpoint: inputs take their right limits, the state jumps if it must.
    fn edge(&mut self, t: f64, log: &mut Log) -> Result<(), SimError> {
        let mut u = self.now.u.clone();
        self.inputs.right(t, &mut u);
        if u == self.now.u {
            return Ok(());
        }
        let rows = log.wants_rows();
        let before = if rows {
            let mut row = vec![0.0; self.system().lcs.outputs.names.len()];
            self.read_before(&mut row);
            Some(row)
        } else {
            None
        };
        let old = std::mem::replace(&mut self.now.u, u);
        if let Some(row) = &before {
            log.row(self.now.t, row);
        }
        self.jump(&old, before.as_deref(), log)?;
        if rows {
            self.log_row(log);
        }
        Ok(())
    }

    /// The jump from inputs `old` to the present ones at the present time.
    fn jump(
        &mut self,
        old: &[f64],
        _before: Option<&[f64]>,
        log: &mut Log,
    ) -> Result<(), SimError> {
        self.now.settle = true;
        self.attempt.h = f64::NAN;
        let t = self.now.t;
        let x = DVector::from_column_slice(&self.now.x);
        let u = DVector::from_column_slice(&self.now.u);
        let System { lcs, jump, .. } = &mut self.plant.systems[self.now.system].1;
        let found = match jump {
            Some(problem) if problem.monotone => problem
                .solve(lcs, &x, &u)
                .map_err(|_| SimError::at(t, Reason::Infeasible))?,
            _ => None,
        };
        let (after, p) = match found {
            Some(jump) => (jump.x, jump.p.as_slice().to_vec()),
            None => (x.clone(), vec![0.0; lcs.m()]),
        };
        let source =
            energy::source_work_of_jump(lcs, x.as_slice(), after.as_slice(), old, u.as_slice(), &p);
        let gain = energy::stored(lcs, after.as_slice(), u.as_slice())
            - energy::stored(lcs, x.as_slice(), old);
        self.now.balance.add((source, source - gain));
        let step: Vec<f64> = u.iter().zip(old).map(|(a, b)| a - b).collect();
        if p.iter().any(|&p| p != 0.0) {
            self.stats.jumps += 1;
            log.event(t, "jump");
        }
        self.now.x.copy_from_slice(after.as_slice());
        self.log_impulses(t, &p, &step, log);
        Ok(())
    }

    /// Impulses of the ports and of the outputs, by name, once each.
    fn log_impulses(&self, t: f64, p: &[f64], step: &[f64], log: &mut Log) {
        let lcs = &self.system().lcs;
        let mut named: Vec<(String, f64)> = Vec::new();
        let mut add = |name: String, area: f64, scale: f64| {
            if area.abs() > 1e-12 * scale && !named.iter().any(|(other, _)| *other == name) {
                named.push((name, area));
            }
        };
        let through = &lcs.d * DVector::from_column_slice(p);
        for kind in [Role::Current, Role::Voltage] {
            // λ and y of the ports as currents first, then as voltages; scales are those of all ports together.
            let scale = |values: &[f64]| values.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            for (j, port) in lcs.ports.iter().enumerate() {
                let current = format!("i({})", port.device);
                let voltage = format!("v({})", port.device);
                match (port.role, kind) {
                    (Role::Current, Role::Current) => add(current, p[j], scale(p)),
                    (Role::Voltage, Role::Current) => {
                        add(current, through[j], scale(through.as_slice()));
                    }
                    (Role::Voltage, _) => add(voltage, -p[j], scale(p)),
                    (Role::Current, _) => {
                        add(voltage, -through[j], scale(through.as_slice()));
                    }
                    (Role::Function, _) => add(port.lambda.clone(), p[j], scale(p)),
                }
            }
        }
        let outputs = &lcs.outputs;
        for (i, name) in outputs.names.iter().enumerate() {
            let area = reading::impulse(&outputs.rows, i, p, step);
            let size = (0..p.len())
                .map(|j| {
                    if i < outputs.rows.lambda.nrows() && j < outputs.rows.lambda.ncols() {
                        (outputs.rows.lambda[(i, j)] * p[j]).abs()
                    } else {
                        0.0
                    }
                })
                .fold(0.0, f64::max);
            add(name.clone(), area, size);
        }
        for (name, area) in named {
            log.impulse(t, name, area);
        }
    }

    /// Whether a switch's control is beyond its threshold now.
    fn crossed(&mut self) -> Result<bool, SimError> {
        if self.switches.needs_lambda() {
            self.read_lambda()?;
        }
        let lcs = &self.plant.systems[self.now.system].1.lcs;
        let at = Point {
            x: &self.now.x,
            lambda: &self.lambda,
            u: &self.now.u,
            du: &self.du,
        };
        Ok(self.switches.update(lcs, at, false))
    }

    /// Flips the switches whose controls ask for it until none does, with the jumps this causes.
    fn switch(&mut self, log: &mut Log) -> Result<(), SimError> {
        if log.wants_rows() {
            self.log_row(log);
        }
        for _ in 0..2 + 2 * self.switches.len() {
            if self.switches.needs_lambda() {
                self.read_lambda()?;
            }
            let lcs = &self.plant.systems[self.now.system].1.lcs;
            let at = Point {
                x: &self.now.x,
                lambda: &self.lambda,
                u: &self.now.u,
                du: &self.du,
            };
            let before = self.switches.position().to_vec();
            if !self.switches.update(lcs, at, true) {
                if log.wants_rows() {
                    self.log_row(log);
                }
                return Ok(());
            }
            let names = self.switches.flipped(&before);
            self.stats.events += 1;
            log.event(self.now.t, names);
            self.change_position(log)?;
        }
        Err(SimError::at(self.now.t, Reason::SwitchesDoNotSettle)
            .device(self.switches.flipped(&[])))
    }

    /// Takes the storage over into the system of the present switch position.
    fn change_position(&mut self, log: &mut Log) -> Result<(), SimError> {
        let old = self.system();
        let s = old.storage(&self.now.x, &self.now.u);
        let stored = energy::stored(&old.lcs, &self.now.x, &self.now.u);
        let position = self.switches.position().to_vec();
        let at = self
            .plant
            .system(&position, &self.inputs, self.now.t)
            .map_err(|mut error| {
                error.t = error.t.or(Some(self.now.t));
                error
            })?;
        self.now.system = at;
        let system = &self.plant.systems[at].1;
        let x = system.state_from(&s);
        self.now.x.clear();
        self.now.x.extend(x.iter());
        if self.now.active.len() != system.lcs.m() {
            self.now.active = vec![false; system.lcs.m()];
        }
        // What the instant of switching loses (net of what sources deliver in it) is dissipated.
        let gain = energy::stored(&system.lcs, &self.now.x, &self.now.u) - stored;
        self.now.balance.add((0.0, -gain));
        self.modes.insert((at, self.now.active.clone()));
        self.resize();
        self.switches.rebuild(&self.plant.systems[at].1.lcs);
        let u = self.now.u.clone();
        self.jump(&u, None, log)
    }

    // ---- reading -----------------------------------------------------------------------------------------------

    /// λ at the right limit of now, by one implicit step much shorter than the last; slopes of the inputs into `du`.
    fn read_lambda(&mut self) -> Result<(), SimError> {
        let base = if self.last_h > 0.0 {
            self.last_h
        } else {
            match self.stepping {
                Stepping::Fixed(h) => h.min(self.longest),
                Stepping::Controlled { first, .. } => first,
            }
        };
        let h = base * 2_f64.powi(-READ);
        self.inputs.slopes(self.now.t, &mut self.du);
        for ((next, u), du) in self.u_next.iter_mut().zip(&self.now.u).zip(&self.du) {
            *next = u + h * du;
        }
        let Self {
            plant,
            now,
            settings,
            z,
            out,
            lambda,
            ..
        } = self;
        let system = &mut plant.systems[now.system].1;
        let m = system.lcs.m();
        if m == 0 {
            return Ok(());
        }
        system.columns.fill(&now.x, &self.u_next, &now.u, z);
        let slack = h * f64::EPSILON;
        let (step, _) = system
            .matrices(h, slack, Scheme::MOREAU, settings.lcp_residual)
            .map_err(|reason| SimError::at(now.t, reason))?;
        let (mode, _) = system.mode(step, &now.active);
        let n = now.x.len();
        let fused = system.step(step).fused(mode);
        if fused.step(z, n, out) && fused.regular {
            fused.lambda(&out[n..], lambda);
            return Ok(());
        }
        let matrices = system.step_mut(step);
        let q = matrices.q(z);
        matrices.driver.suggest(&now.active);
        let solution = matrices.driver.solve(&q);
        if solution.status != Status::Solved {
            let reason = Reason::Residual {
                residual: solution.residual,
                tolerance: settings.lcp_residual,
            };
            return Err(SimError::at(now.t, reason));
        }
        let (least, unique) = matrices.driver.least_norm(&q, &solution);
        lambda.copy_from_slice(least.as_slice());
        if !unique {
            let differs = (0..m).filter(|&j| least[j] > 0.0 || solution.lambda[j] > 0.0);
            let names = differs.map(|j| system.lcs.ports[j].device.clone());
            self.not_unique.extend(names);
        }
        Ok(())
    }

    fn read_point(&mut self, row: &mut [f64]) {
        // A circuit whose right limit has no solution fails in its next step, with its message; until then the last λ.
        if self.read_lambda().is_err() {
            self.lambda.fill(0.0);
        }
        let lcs = &self.plant.systems[self.now.system].1.lcs;
        let at = Point {
            x: &self.now.x,
            lambda: &self.lambda,
            u: &self.now.u,
            du: &self.du,
        };
        for (i, value) in row.iter_mut().enumerate() {
            *value = reading::value(&lcs.outputs.rows, i, at);
        }
    }

    /// The left limit at an edge: as [`Self::read_point`], with the slopes of the far side left out.
    fn read_before(&mut self, row: &mut [f64]) {
        self.read_point(row);
    }

    fn note_energy(&mut self) {
        let stored = energy::stored(&self.system().lcs, &self.now.x, &self.now.u);
        self.now.balance.note(stored);
    }
}

impl Stepper for Theta<'_> {
    fn time(&self) -> f64 {
        self.now.t
    }

    fn advance(&mut self, t: f64, log: &mut Log) -> Result<(), SimError> {
        if !self.started {
            self.begin(log)?;
        }
        while self.now.t < t {
            let now = self.now.t;
            let mut after = now;
            let breakpoint = loop {
                let next = self.inputs.next_breakpoint(after);
                if next - now > Self::slack(next) || !next.is_finite() {
                    break next;
                }
                after = next;
            };
            let known =
                self.switches
                    .next_known(&self.system().lcs, &self.inputs, now, breakpoint.min(t));
            let mut stop = t.min(breakpoint);
            if (t - breakpoint).abs() <= Self::slack(t) {
                stop = t;
            }
            let switching = known.is_some_and(|k| k < stop - Self::slack(stop));
            if switching && let Some(known) = known {
                stop = known;
            }
            self.interval(stop, log)?;
            let at_breakpoint = !switching && (breakpoint - stop).abs() <= Self::slack(stop);
            if at_breakpoint {
                self.edge(breakpoint.max(stop), log)?;
            }
            if !self.switches.is_empty() && (at_breakpoint || known.is_some()) && self.crossed()? {
                self.switch(log)?;
            }
        }
        self.note_energy();
        Ok(())
    }

    fn read(&mut self, row: &mut [f64]) {
        self.read_point(row);
    }

    fn finish(&mut self) -> Outcome {
        self.note_energy();
        self.stats.modes = self.modes.len().max(1) as u64;
        let mut notes = self.notes.clone();
        if !self.not_unique.is_empty() {
            let names: Vec<&str> = self.not_unique.iter().map(String::as_str).collect();
            notes.push(format!(
                "currents through {} are not determined by the ideal model; the least-norm choice is shown",
                names.join(", ")
            ));
        }
        Outcome {
            stats: self.stats.clone(),
            energy: self.now.balance.energy(),
            notes,
        }
    }
}
