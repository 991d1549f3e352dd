//! λ, probes and devices at the right limit of the present time.

use super::attempt::unsolved;
use super::*;
use crate::settings::tolerances::stated::READING;
use crate::settings::tolerances::steps::NEARER;
use crate::settings::tolerances::steps::SHORT;
use crate::settings::tolerances::steps::SHORT_ON_LINES;

impl Theta {
    /// The step by which λ at the right limit is found, s.
    pub(super) fn read_step(&self) -> f64 {
        let base = match self.stepping {
            _ if self.last_h > 0.0 => self.last_h,
            Stepping::Fixed(h) => h.min(self.longest),
            Stepping::Controlled { first, .. } => first,
        };
        // Within the present piece of every source.
        let piece = self.inputs.next_corner(self.now.t) - self.now.t;
        base.min(piece) * SHORT
    }

    /// The step by which λ is read. A curved law tells its current at the instant itself, so only the ideal ports beside it need a
    /// step, and the sources move less in a shorter one; the rounding of the state grows to 2²⁴ε.
    fn reading_step(&self) -> f64 {
        let longer = if self.reads_coarsely { READING } else { 1.0 };
        let short = self.read_step() * longer;
        if self.system().curved {
            // Few lengths, so that their matrices are kept.
            (short * SHORT).log2().floor().exp2()
        } else if !self.ports.is_empty() {
            short * SHORT_ON_LINES
        } else {
            short
        }
    }

    /// z and the matrices of the short implicit step from now; slopes of the inputs go into `du`.
    pub(super) fn prepare_short(&mut self, h: f64) -> Result<usize, Error> {
        self.inputs.slopes_behind(self.now.t, &mut self.du);
        self.prepare_along(h)
    }

    /// The same where the inputs go on with the slopes in `du`.
    pub(super) fn prepare_along(&mut self, h: f64) -> Result<usize, Error> {
        for ((next, u), du) in self.u_next.iter_mut().zip(&self.now.u).zip(&self.du) {
            *next = u + h * du;
        }
        let Self {
            plant,
            now,
            settings,
            z,
            ..
        } = self;
        let system = &mut plant.systems[now.system].1;
        system.columns.fill(&now.x, &self.u_next, &now.u, z);
        let (step, _) = system
            .matrices(h, h * f64::EPSILON, Scheme::MOREAU, settings.lcp_residual)
            .map_err(|reason| Error::at(now.t, reason))?;
        Ok(step)
    }

    /// The complementarity problem of the right limit of now, solved.
    pub(super) fn right_limit(&mut self) -> Result<Solution, Error> {
        let step = self.prepare_short(self.reading_step())?;
        let solution = self.solve_short(step)?;
        if !(self.system().curved && self.switches.needs_lambda()) {
            return Ok(solution);
        }
        // A comparator whose input starts on its threshold has any output in so short a step: a whole one tells which way it goes.
        let step = self.prepare_short(self.read_step() / SHORT)?;
        match self.solve_short(step) {
            Ok(whole) if whole.basis != solution.basis => {
                self.lambda.copy_from_slice(whole.lambda.as_slice());
                self.y.copy_from_slice(whole.y.as_slice());
                let step = self.prepare_short(self.reading_step())?;
                self.solve_short(step)
            }
            _ => Ok(solution),
        }
    }

    /// The step prepared by [`Self::prepare_short`], with the least-norm λ.
    pub(super) fn solve_short(&mut self, step: usize) -> Result<Solution, Error> {
        let Self {
            plant,
            now,
            settings,
            z,
            lambda,
            y,
            amplitudes,
            ..
        } = self;
        let q = plant.systems[now.system].1.prepare(step, z, amplitudes);
        let matrices = plant.systems[now.system].1.step_mut(step);
        matrices.driver.suggest(&now.active);
        matrices.driver.suggest_point(lambda, y);
        let mut solution = matrices.driver.solve(&q);
        let lcs = &plant.systems[now.system].1.lcs;
        if let Some(error) = unsolved(&solution, lcs, now.t, settings.lcp_residual) {
            return Err(error);
        }
        let matrices = plant.systems[now.system].1.step_mut(step);
        let least = matrices.driver.least_norm(&q, &solution);
        if !least.unique {
            let ports = &plant.systems[now.system].1.lcs.ports;
            let chosen = least.chosen.iter().map(|&j| ports[j].device.clone());
            self.not_unique.extend(chosen);
            solution.lambda = least.solution.lambda;
        }
        Ok(solution)
    }

    /// λ at the right limit of now, by implicit steps much shorter than the last: λ after δ is off by δ λ' to first order, which δ/[`NEARER`] tells.
    pub(super) fn read_lambda(&mut self) -> Result<(), Error> {
        if self.smooth.front.known {
            // The end of a step is on the laws.
            self.inputs.slopes_behind(self.now.t, &mut self.du);
            self.lambda.copy_from_slice(&self.smooth.front.lambda);
            self.y.copy_from_slice(&self.smooth.front.y);
            return Ok(());
        }
        if self.last_h == 0.0 && self.state_tells_lambda() {
            return self.read_at_once();
        }
        let step = self.reading_step();
        self.read_after(step)?;
        // What lines carry is read by a step so short that a shorter one would be rounding.
        let is_known = self.lambda.is_empty() || self.system().curved || !self.ports.is_empty();
        if is_known {
            return Ok(());
        }
        let first = self.lambda.clone();
        if self.read_after(step / NEARER).is_err() {
            self.lambda = first;
            return Ok(());
        }
        for (near, far) in self.lambda.iter_mut().zip(first) {
            if *near > 0.0 && far > 0.0 {
                *near = (*near + (*near - far) / (NEARER - 1.0)).max(0.0);
            }
        }
        Ok(())
    }

    /// Whether λ is a function of the state and the sources alone, as D + Dᵀ > 0, in closed form.
    fn state_tells_lambda(&self) -> bool {
        let system = self.system();
        let beside_lines = !self.ports.is_empty();
        !beside_lines && !system.curved && system.jump.is_none() && !self.lambda.is_empty()
    }

    /// The one λ of the state itself: what blocks on a leakage behind an inductor may be faster than any step.
    fn read_at_once(&mut self) -> Result<(), Error> {
        let step = self.prepare_short(0.0)?;
        let solution = self.solve_short(step)?;
        self.lambda.copy_from_slice(solution.lambda.as_slice());
        Ok(())
    }

    /// λ after so many seconds, as far as may be taken back to now.
    fn read_after(&mut self, h: f64) -> Result<(), Error> {
        if self.lambda.is_empty() {
            self.prepare_short(h)?;
            return Ok(());
        }
        if self.system().curved {
            let step = self.prepare_short(h)?;
            let solution = self.solve_short(step)?;
            self.lambda.copy_from_slice(solution.lambda.as_slice());
            self.y.copy_from_slice(solution.y.as_slice());
            return Ok(());
        }
        // What steps err off a constraint on the state is led back by the first half, by whatever λ that takes: the second one tells it.
        let step = self.prepare_short(0.5 * h)?;
        let first = self.short_step(step)?;
        let active = first.as_ref().unwrap_or(&self.now.active);
        let system = &mut self.plant.systems[self.now.system].1;
        let back = system.back(step, active);
        back.take(&self.z, 1, active, &mut self.lambda);
        if !back.has_constraints() {
            return Ok(());
        }
        let n = self.now.x.len();
        system.columns.go_on(&self.out[..n], &mut self.z);
        let mut told = self.lambda.clone();
        if self.short_step(step).is_ok_and(|second| second == first) {
            let active = first.as_ref().unwrap_or(&self.now.active);
            let system = &mut self.plant.systems[self.now.system].1;
            let back = system.back(step, active);
            back.take(&self.z, 2, active, &mut self.lambda);
            back.correct(&mut told, &self.lambda);
        }
        self.lambda = told;
        Ok(())
    }

    /// λ and x⁺ of the short step from z, and its active set where that is not the present one.
    fn short_step(&mut self, step: usize) -> Result<Option<Vec<bool>>, Error> {
        let Self {
            plant,
            now,
            z,
            out,
            lambda,
            amplitudes,
            ..
        } = self;
        let system = &mut plant.systems[now.system].1;
        let (mode, _) = system.mode(step, &now.active);
        let n = now.x.len();
        let fused = system.step(step).fused(mode);
        let noise = |k| amplitudes.rounding(&system.lcs, k);
        if fused.step(z, n, out, noise) && fused.is_strict(z, &out[n..]) {
            fused.lambda(&out[n..], lambda);
            return Ok(None);
        }
        let solution = self.solve_short(step)?;
        self.lambda.copy_from_slice(solution.lambda.as_slice());
        let matrices = self.system().step(step);
        let x = matrices.x_next(&self.z, &solution.lambda);
        self.out[..n].copy_from_slice(x.as_slice());
        Ok(Some(solution.basis))
    }

    pub(super) fn read_point(&mut self, row: &mut [f64]) {
        // A row right behind an edge is that instant's; later ones have the λ of steps, whose error a blocking resistance would make any voltage.
        let read = if self.now.settle && self.state_tells_lambda() {
            self.read_at_once()
        } else {
            self.read_lambda()
        };
        // A circuit whose right limit has no solution fails in its next step, with its message; until then the last λ.
        if read.is_err() {
            self.lambda.fill(0.0);
        }
        let on_laws = self.on_laws();
        let lcs = &self.plant.systems[self.now.system].1.lcs;
        let at = (self.now).point(on_laws.as_ref().unwrap_or(&self.lambda), &self.du);
        for (i, value) in row.iter_mut().enumerate() {
            *value = reading::value(&lcs.outputs.rows, i, at);
        }
    }

    /// λ at the instant itself, from the λ that has been read: a junction behind an inductor without current has no voltage, and after any step
    /// the logarithm of what came to flow in it. Nothing where steps have led here, whose error in what a junction leaks may be any voltage.
    fn on_laws(&mut self) -> Option<Vec<f64>> {
        let front = &self.smooth.front;
        let has_arrived = front.known && front.reach > 0.0;
        let by_law = self.system().curved && self.ports.is_empty();
        if has_arrived || self.jumped != self.now.t || !by_law {
            return None;
        }
        let now = &self.now;
        let curved = self.plant.systems[now.system].1.smooth();
        let u: Vec<f64> = curved.varying.iter().map(|&j| now.u[j]).collect();
        curved.at_instant(&now.x, &u, (&self.lambda, &self.y))
    }

    pub(super) fn note_energy(&mut self) {
        let Self {
            plant,
            now,
            stock,
            inputs,
            ..
        } = self;
        let lcs = &plant.systems[now.system].1.lcs;
        let stored = energy::stored_with(lcs, &now.x, &now.u, stock);
        now.balance.note(stored + inputs.lines().stored(now.t));
    }
}
