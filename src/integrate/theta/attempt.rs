//! One step: tried with the present active set, else solved, then committed.

use super::*;
use crate::integrate::event::changes_of_devices;
use crate::settings::tolerances::times::SAME_TIME;

impl Theta {
    /// Rounding of the difference of two times near `t`.
    pub(super) fn slack(t: f64) -> f64 {
        SAME_TIME * t.abs()
    }

    /// Computes the step from now to t1 = now + h into `out` without committing it.
    pub(super) fn attempt(&mut self, h: f64, t1: f64) -> Result<(), Error> {
        if let Some(tableau) = Tableau::of(self.system(), self.scheme) {
            return self.attempt_stages(tableau, h, t1);
        }
        self.inputs.left(t1, &mut self.u_next);
        self.stats.lcp_solves += u64::from(!self.lambda.is_empty());
        let damped = self.starts_damped();
        let settle = self.now.settle && (damped || !self.lambda.is_empty());
        let scheme = if settle && damped {
            Scheme::MOREAU
        } else {
            self.scheme
        };
        let Self {
            plant,
            now,
            attempt,
            amplitudes,
            settings,
            ..
        } = self;
        let system = &mut plant.systems[now.system].1;
        system
            .columns
            .fill(&now.x, &self.u_next, &now.u, &mut self.z);
        let same = attempt.h == h && attempt.settle == settle && attempt.solved.is_none();
        if !same {
            let (slack, tolerance) = (Self::slack(t1), settings.lcp_residual);
            let found = if settle {
                change_matrices(system, h, slack, scheme, tolerance)
            } else {
                system.matrices(h, slack, scheme, tolerance)
            };
            let (step, new) = found.map_err(|reason| Error::at(now.t, reason))?;
            let (mode, fused) = system.mode(step, &now.active);
            self.stats.factorisations += u64::from(new) + u64::from(fused);
            *attempt = Attempt {
                step,
                mode,
                h,
                settle,
                ..Attempt::default()
            };
        }
        let n = now.x.len();
        let fused = system.step(attempt.step).fused(attempt.mode);
        let noise = |k| amplitudes.rounding(&system.lcs, k);
        if fused.step(&self.z, n, &mut self.out, noise) {
            return Ok(());
        }
        let tried = attempt.clone();
        self.solve_step(scheme, h, t1)?;
        self.confirm(tried);
        // What ends within the step rings by the midpoint rule, and a device that clamps it hides that from error control.
        if settle && !damped && self.scheme.order() == 2 && self.changes() {
            self.solve_step(Scheme::MOREAU, h, t1)?;
        }
        Ok(())
    }

    /// Returns to the tried step where the solvers find its active set: then y ≥ 0 where they look for it, and what the guards of blocking
    /// ports refused was the error of their short step or rounding, or is an error that [`past_zero`] tells. Currents must be as they are with
    /// γ = 1, zero or more.
    #[cold]
    fn confirm(&mut self, tried: Attempt) {
        let found = |(basis, _): &(Vec<bool>, _)| *basis == self.now.active;
        let n = self.now.x.len();
        let system = &self.plant.systems[self.now.system].1;
        let fused = system.step(tried.step).fused(tried.mode);
        if !fused.regular || !self.attempt.solved.as_ref().is_some_and(found) {
            return;
        }
        let solved = self.out.clone();
        fused.step(&self.z, n, &mut self.out, |_| 0.0);
        // A port that conducts has λ for a current, or y where its λ is a voltage.
        let carries = |j: usize| self.now.active[j] == (system.lcs.ports[j].role != Role::Voltage);
        let as_far = |j: usize| self.out[n + j] >= 2.0 * solved[n + j].min(0.0);
        if (0..self.now.active.len()).all(|j| !carries(j) || as_far(j)) {
            self.attempt = tried;
        } else {
            self.out = solved;
        }
    }

    /// The step with γ = 1 by the solvers. Where the user's own γ = 1 > θ leaves a stiff step without solution, θ = 1 has one.
    #[cold]
    pub(super) fn solve_step(&mut self, scheme: Scheme, h: f64, t1: f64) -> Result<(), Error> {
        self.stats.pivotings += 1;
        let first = self.solve_with(scheme, h, t1);
        if first.is_err() && scheme != Scheme::MOREAU {
            return self.solve_with(Scheme::MOREAU, h, t1);
        }
        first
    }

    pub(super) fn solve_with(&mut self, scheme: Scheme, h: f64, t1: f64) -> Result<(), Error> {
        let tolerance = self.settings.lcp_residual;
        let now = &self.now;
        let system = &mut self.plant.systems[now.system].1;
        let (step, new) = change_matrices(system, h, Self::slack(t1), scheme, tolerance)
            .map_err(|reason| Error::at(now.t, reason))?;
        self.stats.factorisations += u64::from(new);
        let q = system.prepare(step, &self.z, &self.amplitudes);
        let matrices = system.step_mut(step);
        let before = matrices.driver.factorisations;
        matrices.driver.suggest(&now.active);
        let solution = matrices.driver.solve(&q);
        self.stats.factorisations += matrices.driver.factorisations - before;
        let x = matrices.x_next(&self.z, &solution.lambda);
        if x.iter().any(|v| !v.is_finite()) {
            return Err(Error::at(now.t, Reason::Overflow));
        }
        if let Some(error) = unsolved(&solution, &system.lcs, now.t, tolerance) {
            return Err(error);
        }
        let n = now.x.len();
        self.out[..n].copy_from_slice(x.as_slice());
        for j in 0..solution.active.len() {
            self.out[n + j] = if solution.basis[j] {
                solution.lambda[j]
            } else {
                solution.y[j]
            };
        }
        self.lambda.copy_from_slice(solution.lambda.as_slice());
        self.worst_residual = self.worst_residual.max(solution.residual);
        let sets = solution.basis.iter().zip(&now.active);
        let off = |(port, (after, before)): (&Port, (&bool, &bool))| {
            after != before && *after == (port.role == Role::Voltage)
        };
        let off = system.lcs.ports.iter().zip(sets).any(off);
        self.attempt = Attempt {
            step,
            mode: 0,
            h,
            turned_off: off && self.scheme.order() == 2,
            solved: Some((solution.basis, solution.active)),
            ..Attempt::default()
        };
        Ok(())
    }

    /// Makes the attempt the present.
    pub(super) fn commit(&mut self, t1: f64) -> Result<(), Error> {
        let n = self.now.x.len();
        self.stats.steps += 1;
        if self.stats.steps > self.settings.max_steps {
            let reason = Reason::TooManySteps {
                limit: self.settings.max_steps,
            };
            return Err(Error::at(self.now.t, reason));
        }
        if self.attempt.work.is_some() {
            let ports = (&self.lambda[..], &self.y[..]);
            self.refuse_cancellation(&self.out[..n], ports, self.attempt.residual)?;
        }
        if let Some((basis, pattern)) = self.attempt.solved.take() {
            self.commit_solved(basis, pattern, t1);
        } else {
            let system = &self.plant.systems[self.now.system].1;
            let fused = system.step(self.attempt.step).fused(self.attempt.mode);
            self.now.balance.add(fused.power.over_step(&self.z));
            let loss = fused.power.numerical(&self.z, &self.out, n);
            self.now.balance.add_numerical(loss);
            self.decide(t1);
        }
        self.now.slope.clone_from(&self.attempt.slope);
        self.now.unseen.clone_from(&self.attempt.unseen);
        self.now.turned_off = self.attempt.turned_off;
        self.now.settle = self.now.turned_off;
        self.now.x.copy_from_slice(&self.out[..n]);
        self.now.u.copy_from_slice(&self.u_next);
        self.now.t = t1;
        self.last_h = self.attempt.h;
        self.send_waves()
    }

    #[cold]
    pub(super) fn commit_solved(&mut self, basis: Vec<bool>, pattern: Vec<Option<bool>>, t1: f64) {
        let n = self.now.x.len();
        let h = self.attempt.h;
        let known = self.pending.len();
        if let Some((work, loss)) = self.attempt.work {
            self.now.balance.add(work);
            self.now.balance.add_numerical(loss);
            self.take_pattern(basis, &pattern, t1);
            self.note_event_step(known, h);
            self.attempt.h = f64::NAN;
            return;
        }
        let step = self.system().step(self.attempt.step);
        let theta = step.scheme.theta;
        for (du, (a, b)) in self.du.iter_mut().zip(self.u_next.iter().zip(&self.now.u)) {
            *du = (a - b) / h;
        }
        let (source, dissipated, loss) = energy::of_solved(
            &self.plant.systems[self.now.system].1.lcs,
            (theta, h),
            (&self.now.x, &self.now.u),
            (&self.out[..n], &self.u_next),
            &self.du,
            (&basis, &self.lambda),
        );
        self.now.balance.add((source, dissipated));
        self.now.balance.add_numerical(loss);
        self.take_pattern(basis, &pattern, t1);
        self.note_event_step(known, h);
        self.attempt.h = f64::NAN;
    }

    /// Devices whose λ and y both vanished where the solvers found them, and that carry a current or a voltage at the end of the attempt.
    fn decide(&mut self, t1: f64) {
        let Self {
            plant,
            now,
            attempt,
            ..
        } = self;
        let system = &plant.systems[now.system].1;
        let on = |j: usize| now.active[j] == (system.lcs.ports[j].role != Role::Voltage);
        let open = |j: &usize| on(*j) != now.pattern[*j];
        if !(0..now.active.len()).any(|j| open(&j)) {
            return;
        }
        let fused = system.step(attempt.step).fused(attempt.mode);
        let guards = &self.out[now.x.len()..];
        let strict = |j: &usize| fused.is_strict_at(*j, &self.z, guards[*j]);
        let mut pattern = now.pattern.clone();
        let decided = (0..pattern.len()).filter(open).filter(strict);
        decided.for_each(|j| pattern[j] = on(j));
        let (basis, h) = (now.active.clone(), attempt.h);
        let known = self.pending.len();
        self.change_pattern(basis, pattern, t1);
        self.note_event_step(known, h);
    }

    /// A step of h in which a device changed, if there are more than `known` events.
    pub(super) fn note_event_step(&mut self, known: usize, h: f64) {
        if self.pending.len() > known {
            self.now.event_step = self.now.event_step.max(h);
        }
    }

    /// Takes over what the devices do; a change between conducting (a current flows) and blocking is an event.
    pub(super) fn take_pattern(&mut self, basis: Vec<bool>, seen: &[Option<bool>], t: f64) {
        let ports = &self.system().lcs.ports;
        let on =
            |(&lambda, port): (&Option<bool>, &Port)| lambda == Some(port.role != Role::Voltage);
        let pattern = seen.iter().zip(ports).map(on).collect();
        self.change_pattern(basis, pattern, t);
    }

    fn change_pattern(&mut self, basis: Vec<bool>, pattern: Vec<bool>, t: f64) {
        let ports = &self.system().lcs.ports;
        let before = &self.now.pattern;
        if pattern != *before && self.started {
            let changes = changes_of_devices(ports, before, &pattern);
            self.pending.push((t, changes.into()));
        }
        self.modes.insert((self.now.system, pattern.clone()));
        self.now.active = basis;
        self.now.pattern = pattern;
    }

    /// The active set and the devices' states at the right limit of now, after a start, an edge or a switching.
    pub(super) fn find_mode(&mut self) -> Result<(), Error> {
        if self.now.active.is_empty() {
            return Ok(());
        }
        let found = self.right_limit()?;
        self.take_pattern(found.basis, &found.active, self.now.t);
        if self.is_smooth() {
            self.lambda.copy_from_slice(found.lambda.as_slice());
            self.y.copy_from_slice(found.y.as_slice());
            self.start_from_lambda();
        }
        Ok(())
    }
}

/// Matrices for a step in which the active set changes or the state may jump: the scheme's θ with γ = 1, or Moreau's where
/// the scheme has γ < 1 and that would cost M its monotonicity.
fn change_matrices(
    system: &mut System,
    h: f64,
    slack: f64,
    scheme: Scheme,
    tolerance: f64,
) -> Result<(usize, bool), Reason> {
    let (step, new) = system.matrices(h, slack, scheme.implicit_in_lambda(), tolerance)?;
    if scheme.gamma == 1.0 || system.step(step).driver.is_monotone() {
        return Ok((step, new));
    }
    system.matrices(h, slack, Scheme::MOREAU, tolerance)
}

/// The error of a step problem without a solution; it names the device with the largest part in the contradiction, or
/// with the largest residual.
pub(super) fn unsolved(solution: &Solution, lcs: &Lcs, t: f64, tolerance: f64) -> Option<Error> {
    let (reason, port) = match &solution.status {
        Status::Solved => return None,
        Status::Infeasible(ray) => (Reason::Infeasible, ray.imax()),
        Status::Failed => {
            let violation = solution.lambda.zip_map(&solution.y, |l, y| l.min(y).abs());
            (
                Reason::Residual {
                    residual: solution.residual,
                    tolerance,
                },
                violation.imax(),
            )
        }
    };
    Some(Error::at(t, reason).device(lcs.ports[port].device.clone()))
}
