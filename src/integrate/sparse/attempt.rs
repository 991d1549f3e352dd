//! One step that is not made yet, and the step made.

use super::system::Largest;
use super::tape::Set;
use super::{Now, Rule, Sparse};
use crate::integrate::curved::tableau::{ERROR, GAMMA, LOWER, NODES, STAGES, WEIGHTS};
use crate::integrate::error::{Error, Reason};
use crate::integrate::event::changes_of_devices;
use crate::integrate::reading::Point;
use crate::lcs::Role;
use crate::settings::tolerances::sparse::INSIDE;
use crate::settings::tolerances::steps::{FAINT, SHORT, STAGE_ROUNDING};

/// A step that is not made yet.
#[derive(Debug, Clone, Default)]
pub(super) struct Trial {
    pub(super) t1: f64,
    pub(super) h: f64,
    x: Vec<f64>,
    u: Vec<f64>,
    lambda: Vec<f64>,
    /// Whether λ is that of its end.
    lambda_known: bool,
    pub(super) active: Vec<bool>,
    slope: Vec<f64>,
    /// What the states may be off by.
    difference: Vec<f64>,
    /// Energy from sources and into resistors and devices, J.
    work: (f64, f64),
    /// Energy that the damping takes, J.
    loss: f64,
    /// x' of every stage.
    slopes: [Vec<f64>; STAGES],
    /// The active sets of the implicit ones, where they are asked for.
    pub(super) sets: Vec<Set>,
    /// What is read at all stages, where that is asked for.
    pub(super) rows: Vec<f64>,
}

impl Sparse {
    /// Computes the step of h from now to t1 into the trial.
    pub(super) fn attempt(&mut self, h: f64, t1: f64) -> Result<(), Error> {
        self.trial.h = h;
        self.trial.t1 = t1;
        self.trial.u.clone_from(&self.now.u);
        self.inputs.left(t1, &mut self.trial.u);
        self.step.active.clone_from(&self.now.active);
        self.step.lambda.clone_from(&self.now.lambda);
        self.trial.work = (0.0, 0.0);
        self.trial.loss = 0.0;
        let rule = match self.rule {
            // After an edge or a jump a step of the midpoint rule would swing around what is faster than the step (Rannacher 1984).
            Rule::Theta(theta) if theta == 0.5 && self.now.settle => Rule::Theta(1.0),
            rule => rule,
        };
        match rule {
            Rule::Theta(theta) => self.attempt_theta(theta, h)?,
            Rule::Stages => self.attempt_stages(h)?,
        }
        let Self {
            trial,
            systems,
            now,
            step,
            ..
        } = self;
        let system = &systems[now.system].1;
        trial.lambda.clone_from(&step.lambda);
        trial.active.clone_from(&step.active);
        if !self.balanced {
            return Ok(());
        }
        let [before, after] = [(&now.x, &now.u), (&trial.x, &trial.u)].map(|(x, u)| {
            let s = system.storage(x, u);
            0.5 * system.product(&s, &s)
        });
        trial.loss -= after - before;
        Ok(())
    }

    fn attempt_theta(&mut self, theta: f64, h: f64) -> Result<(), Error> {
        let (t0, t1) = (self.now.t, self.trial.t1);
        let mix = |a: f64, b: f64| theta * b + (1.0 - theta) * a;
        let ends = self.now.u.iter().zip(&self.trial.u);
        let u: Vec<f64> = ends.clone().map(|(a, b)| mix(*a, *b)).collect();
        let du: Vec<f64> = ends.map(|(a, b)| (b - a) / h).collect();
        self.step.x.clone_from(&self.now.x);
        self.stats.lcp_solves += u64::from(!self.now.lambda.is_empty());
        let times = (t0, theta * h, Self::slack(t1));
        self.systems[self.now.system]
            .1
            .implicit(times, &u, &mut self.step)?;
        let moved = self.step.x.iter().zip(&self.now.x);
        let slope: Vec<f64> = moved.map(|(x, old)| (x - old) / (theta * h)).collect();
        let x = self.now.x.iter().zip(&slope);
        self.trial.x = x.map(|(x, k)| x + h * k).collect();
        let changes = slope.iter().zip(&self.now.slope);
        self.trial.difference = changes.map(|(k, old)| 0.5 * h * (k - old)).collect();
        self.trial.lambda_known = theta == 1.0;
        self.add_stage(h, &slope, (&u, &du));
        self.trial.slope = slope;
        Ok(())
    }

    fn attempt_stages(&mut self, h: f64) -> Result<(), Error> {
        let (t0, t1) = (self.now.t, self.trial.t1);
        if self.balanced {
            self.know_lambda()?;
        }
        self.trial.sets.clear();
        self.trial.rows.clear();
        let mut u = self.now.u.clone();
        let mut du = vec![0.0; u.len()];
        self.inputs.slopes_behind(t0, &mut du);
        self.step.x.clone_from(&self.now.x);
        let first = self.now.slope.clone();
        self.step.lambda.clone_from(&self.now.lambda);
        self.add_stage(h * WEIGHTS[0], &first, (&u, &du));
        self.write_stage(&first, (&u, &du));
        self.trial.slopes[0] = first;
        let mut base = Vec::with_capacity(self.now.x.len());
        for stage in 1..STAGES {
            base.clone_from(&self.now.x);
            for (slope, weight) in self.trial.slopes.iter().zip(LOWER[stage]) {
                let add = base.iter_mut().zip(slope);
                add.for_each(|(x, k)| *x += h * weight * k);
            }
            // Slopes at the end are those before it.
            let inside = NODES[stage].min(INSIDE);
            self.inputs.slopes(t0 + inside * h, &mut du);
            if stage == STAGES - 1 {
                u.clone_from(&self.trial.u);
            } else {
                self.inputs.right(t0 + NODES[stage] * h, &mut u);
            }
            self.step.x.clone_from(&base);
            self.stats.lcp_solves += u64::from(!self.now.lambda.is_empty());
            let times = (t0, GAMMA * h, Self::slack(t1));
            self.systems[self.now.system]
                .1
                .implicit(times, &u, &mut self.step)?;
            if let Some(tape) = &mut self.tape {
                self.trial.sets.push(tape.set(&self.step.active));
            }
            let moved = self.step.x.iter().zip(&base);
            let slope: Vec<f64> = moved.map(|(x, old)| (x - old) / (GAMMA * h)).collect();
            if WEIGHTS[stage] != 0.0 {
                self.add_stage(h * WEIGHTS[stage], &slope, (&u, &du));
            }
            self.write_stage(&slope, (&u, &du));
            self.trial.slopes[stage] = slope;
        }
        let trial = &mut self.trial;
        trial.x.clone_from(&self.step.x);
        trial.slope.clone_from(&trial.slopes[STAGES - 1]);
        trial.lambda_known = true;
        trial.difference.clear();
        for (i, x) in trial.x.iter().enumerate() {
            let (mut sum, mut size) = (0.0, x.abs());
            for (slope, weight) in trial.slopes.iter().zip(ERROR) {
                let part = h * weight * slope[i];
                sum += part;
                size += part.abs();
            }
            let known = sum.abs() > STAGE_ROUNDING * size;
            trial.difference.push(if known { sum } else { 0.0 });
        }
        Ok(())
    }

    /// Adds the energies of a part of the step, s, at the state, λ and slope of a stage.
    fn add_stage(&mut self, part: f64, slope: &[f64], (u, du): (&[f64], &[f64])) {
        if !self.balanced {
            return;
        }
        let system = &self.systems[self.now.system].1;
        let (x, lambda) = (&self.step.x, &self.step.lambda);
        let (source, dissipated) = system.power(Point { x, lambda, u, du });
        self.trial.work.0 += part * source;
        self.trial.work.1 += part * dissipated;
        let (s, rate) = (system.storage(x, u), system.storage_rate(slope, du));
        self.trial.loss += part * system.product(&s, &rate);
    }

    /// Writes down what is read at a stage.
    fn write_stage(&mut self, slope: &[f64], (u, du): (&[f64], &[f64])) {
        let Some(reads) = &self.reads else {
            return;
        };
        let (x, lambda) = (&self.step.x, &self.step.lambda);
        let at = Point { x, lambda, u, du };
        self.systems[self.now.system]
            .1
            .write(reads, (at, slope), &mut self.trial.rows);
    }

    /// The largest of what the trial's states may be off by, relative to their amplitudes.
    pub(super) fn error(&self) -> f64 {
        let system = self.system();
        let seen = self.storage_units.iter().copied();
        let seen = Largest::of(seen.zip(self.seen.iter().copied()));
        let scales = |k: usize| {
            let unit = system.lcs.states[k].unit;
            let floor = FAINT * self.sources.among(unit).max(seen.among(unit));
            let seen = self.seen[system.storage_of()[k]];
            seen.max(self.trial.x[k].abs()).max(floor)
        };
        // What is faint in energy too is made of the rounding of the others.
        let energies = system.kernel.state_scale();
        let energy = |(k, root): (usize, &f64)| scales(k) * root;
        let most = energies.iter().enumerate().map(energy).fold(0.0, f64::max);
        let mut worst = 0.0_f64;
        for (k, (difference, root)) in self.trial.difference.iter().zip(energies).enumerate() {
            if *difference != 0.0 {
                let scale = scales(k).max(FAINT * FAINT * most / root);
                worst = worst.max(difference.abs() / scale);
            }
        }
        worst
    }

    /// Makes the trial the present.
    pub(super) fn commit(&mut self) -> Result<(), Error> {
        self.stats.steps += 1;
        if self.stats.steps > self.settings.max_steps {
            let limit = self.settings.max_steps;
            return Err(Error::at(self.now.t, Reason::TooManySteps { limit }));
        }
        self.tape_step();
        let trial = &mut self.trial;
        let now = &mut self.now;
        now.balance.add(trial.work);
        now.balance.add_numerical(trial.loss);
        now.t = trial.t1;
        now.last_h = trial.h;
        now.lambda_known = trial.lambda_known;
        now.settle = false;
        std::mem::swap(&mut now.x, &mut trial.x);
        std::mem::swap(&mut now.slope, &mut trial.slope);
        std::mem::swap(&mut now.lambda, &mut trial.lambda);
        now.u.copy_from_slice(&trial.u);
        let active = std::mem::take(&mut trial.active);
        if active != now.active {
            now.event_step = now.event_step.max(trial.h);
        }
        self.take_active(active);
        self.see();
        Ok(())
    }

    /// Takes over an active set; a device that began or ceased to conduct is an event.
    pub(super) fn take_active(&mut self, active: Vec<bool>) {
        let ports = &self.systems[self.now.system].1.lcs.ports;
        if active != self.now.active && self.started {
            let conducting = |set: &[bool]| -> Vec<bool> {
                let sides = set.iter().zip(ports);
                sides
                    .map(|(on, port)| *on == (port.role != Role::Voltage))
                    .collect()
            };
            let [before, after] = [&self.now.active, &active].map(|set| conducting(set));
            let changes = changes_of_devices(ports, &before, &after);
            self.pending.push((self.now.t, changes.into()));
        }
        self.modes.insert((self.now.system, active.clone()));
        self.now.active = active;
    }

    /// Finds λ of this instant where the rule does not tell it: by a short implicit step.
    pub(super) fn know_lambda(&mut self) -> Result<(), Error> {
        if self.now.lambda_known || self.now.lambda.is_empty() {
            return Ok(());
        }
        let h = self.now.last_h * SHORT;
        let mut du = vec![0.0; self.now.u.len()];
        self.inputs.slopes_behind(self.now.t, &mut du);
        let ends = self.now.u.iter().zip(&du);
        let u: Vec<f64> = ends.map(|(u, du)| u + h * du).collect();
        let Now { x, active, .. } = &self.now;
        self.step.x.clone_from(x);
        self.step.active.clone_from(active);
        self.step.lambda.resize(active.len(), 0.0);
        let times = (self.now.t, h, Self::slack(self.now.t));
        self.systems[self.now.system]
            .1
            .implicit(times, &u, &mut self.step)?;
        self.now.lambda.clone_from(&self.step.lambda);
        self.now.lambda_known = true;
        Ok(())
    }
}
