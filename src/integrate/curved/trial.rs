//! A step on its way: its stages, its energies, and what it says of its error.

use super::Curved;
use super::tableau::{ERROR, GAMMA, LOWER, NODES, STAGES, WEIGHTS, extrapolation};
use crate::integrate::error::{Error, Reason};
use crate::integrate::inputs::{Inputs, Pieces};
use crate::settings::tolerances::steps::{AHEAD, SOLVED, STAGE_ROUNDING};

/// Where a step starts.
#[derive(Debug, Default)]
pub(crate) struct Start {
    /// Whether what is here is known: nothing of it is right after a jump.
    pub(crate) known: bool,
    /// Time, s.
    pub(crate) t: f64,
    /// State, its slope, and the right limits of the inputs that vary.
    pub(crate) x: Vec<f64>,
    pub(crate) slope: Vec<f64>,
    pub(crate) u: Vec<f64>,
    /// λ and y on the laws, and how they moved at last, 1/s.
    pub(crate) lambda: Vec<f64>,
    pub(crate) y: Vec<f64>,
    pub(crate) lambda_rate: Vec<f64>,
    pub(crate) y_rate: Vec<f64>,
    /// Up to which step length that tells anything of a stage ahead, s.
    pub(crate) reach: f64,
}

impl Start {
    /// Becomes another one without allocation.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        (self.known, self.t, self.reach) = (other.known, other.t, other.reach);
        for (to, from) in [
            (&mut self.x, &other.x),
            (&mut self.slope, &other.slope),
            (&mut self.u, &other.u),
            (&mut self.lambda, &other.lambda),
            (&mut self.y, &other.y),
            (&mut self.lambda_rate, &other.lambda_rate),
            (&mut self.y_rate, &other.y_rate),
        ] {
            to.clone_from(from);
        }
    }

    /// Becomes the end of a step.
    pub(crate) fn take_end(&mut self, t: f64, trial: &Trial) {
        let (n, m) = (trial.n, trial.m);
        let (last, before) = ((STAGES - 1) * m, (STAGES - 2) * m);
        let time = (1.0 - NODES[STAGES - 2]) * trial.h;
        (self.t, self.reach) = (t, trial.h);
        self.x.copy_from_slice(&trial.x);
        self.u.copy_from_slice(&trial.u);
        self.slope
            .copy_from_slice(&trial.slopes[(STAGES - 1) * n..]);
        for (all, value, rate) in [
            (&trial.lambdas, &mut self.lambda, &mut self.lambda_rate),
            (&trial.ys, &mut self.y, &mut self.y_rate),
        ] {
            value.copy_from_slice(&all[last..]);
            for (j, rate) in rate.iter_mut().enumerate() {
                *rate = (all[last + j] - all[before + j]) / time;
            }
        }
    }
}

/// The buffers of a step.
#[derive(Debug, Default)]
pub(crate) struct Trial {
    pub(super) n: usize,
    m: usize,
    pub(crate) h: f64,
    /// By stage: slopes, λ and y.
    pub(super) slopes: Vec<f64>,
    pub(super) lambdas: Vec<f64>,
    pub(super) ys: Vec<f64>,
    base: Vec<f64>,
    /// What the last stage's state is made of, see [`Curved::prepare`].
    pub(super) right: Vec<f64>,
    /// State and inputs that vary of the last stage that was made.
    pub(crate) x: Vec<f64>,
    pub(crate) u: Vec<f64>,
    /// All inputs.
    all: Vec<f64>,
    pub(super) pieces: Pieces,
    pub(super) q: Vec<f64>,
    pub(super) guess: (Vec<f64>, Vec<f64>),
    w: Vec<f64>,
    du: Vec<f64>,
    change: Vec<f64>,
    /// Energy from sources, into resistors and devices, and lost by the method, J.
    pub(crate) work: (f64, f64),
    pub(crate) loss: f64,
    /// By state: what the step may err.
    pub(crate) error: Vec<f64>,
    /// By port: what the mean of λ over the step may err, and λ and y at its end because of the state's error.
    pub(crate) mean_error: Vec<f64>,
    pub(crate) end_error: (Vec<f64>, Vec<f64>),
    /// The largest residual that a stage was solved to, relative to the terms it is a sum of.
    pub(crate) residual: f64,
    pub(super) matrices: usize,
    /// Stages solved and factorisations so far.
    pub(crate) solves: u64,
    pub(crate) factorisations: u64,
}

/// Solves a stage that Newton's method does not: q to (λ, y), which hold a guess; its residual.
pub(crate) type Robust<'a> =
    &'a mut dyn FnMut(&[f64], &mut [f64], &mut [f64]) -> Result<f64, Error>;

impl Trial {
    fn resize(&mut self, curved: &Curved) {
        let (n, m, p) = (curved.n, curved.m, curved.p);
        if (self.n, self.m, self.u.len()) == (n, m, p) && self.w.len() == curved.forms.width() {
            return;
        }
        (self.n, self.m) = (n, m);
        for (buffer, len) in [
            (&mut self.slopes, STAGES * n),
            (&mut self.lambdas, STAGES * m),
            (&mut self.ys, STAGES * m),
            (&mut self.base, n),
            (&mut self.right, n),
            (&mut self.x, n),
            (&mut self.u, p),
            (&mut self.q, m),
            (&mut self.guess.0, m),
            (&mut self.guess.1, m),
            (&mut self.w, curved.forms.width()),
            (&mut self.du, p),
            (&mut self.change, n + p),
            (&mut self.error, n),
            (&mut self.mean_error, m),
            (&mut self.end_error.0, m),
            (&mut self.end_error.1, m),
        ] {
            buffer.clear();
            buffer.resize(len, 0.0);
        }
    }

    /// λ and y at the end.
    pub(crate) fn at_end(&self) -> (&[f64], &[f64]) {
        self.at_stage(STAGES - 1)
    }

    /// λ and y at a stage.
    pub(crate) fn at_stage(&self, stage: usize) -> (&[f64], &[f64]) {
        let ports = stage * self.m..(stage + 1) * self.m;
        (&self.lambdas[ports.clone()], &self.ys[ports])
    }

    /// x' of the stages; without states none.
    pub(crate) fn slopes(&self) -> impl Iterator<Item = &[f64]> {
        self.slopes.chunks_exact(self.n.max(1))
    }

    /// x' at the end of the step.
    pub(crate) fn end_slope(&self) -> &[f64] {
        &self.slopes[(STAGES - 1) * self.n..]
    }

    /// Makes the stages of a step from `start` to t1; stages are solved to [`SOLVED`], to `granted` at least, with the ideal ports on the side
    /// that they have in `held`.
    ///
    /// # Errors
    /// Those of `robust`; [`Reason::Singular`], [`Reason::Overflow`].
    pub(crate) fn make(
        &mut self,
        curved: &mut Curved,
        inputs: &Inputs,
        start: &Start,
        (t1, held): (f64, Option<&[bool]>),
        (slack, granted): (f64, f64),
        robust: Robust<'_>,
    ) -> Result<(), Error> {
        self.resize(curved);
        let h = t1 - start.t;
        self.h = h;
        let fail = |reason| Error::at(start.t, reason);
        let (at, new) = curved.matrices(GAMMA * h, slack).map_err(fail)?;
        self.matrices = at;
        curved.newton(at).hold(held);
        self.factorisations += u64::from(new);
        let (n, m) = (self.n, self.m);
        self.slopes[..n].copy_from_slice(&start.slope);
        self.lambdas[..m].copy_from_slice(&start.lambda);
        self.ys[..m].copy_from_slice(&start.y);
        self.all.resize(inputs.len(), 0.0);
        inputs.left(t1, &mut self.all);
        for (u, &j) in self.u.iter_mut().zip(&curved.varying) {
            *u = self.all[j];
        }
        for (du, (a, b)) in self.du.iter_mut().zip(self.u.iter().zip(&start.u)) {
            *du = (a - b) / h;
        }
        (self.work, self.loss, self.residual) = ((0.0, 0.0), 0.0, f64::EPSILON);
        self.x.copy_from_slice(&start.x);
        self.u.copy_from_slice(&start.u);
        self.account(curved, 0);
        for stage in 1..STAGES {
            self.stage(curved, inputs, start, stage, granted, robust)?;
            self.account(curved, stage);
        }
        self.lose(curved, start);
        self.estimate(curved);
        Ok(())
    }

    fn stage(
        &mut self,
        curved: &mut Curved,
        inputs: &Inputs,
        start: &Start,
        stage: usize,
        granted: f64,
        robust: Robust<'_>,
    ) -> Result<(), Error> {
        let (n, m, h) = (self.n, self.m, self.h);
        let at_end = stage + 1 == STAGES;
        if at_end {
            for (u, &j) in self.u.iter_mut().zip(&curved.varying) {
                *u = self.all[j];
            }
        } else {
            let t = start.t + NODES[stage] * h;
            inputs.varying_at(t, &mut self.pieces, &mut self.u);
        }
        self.base.copy_from_slice(&start.x);
        for (k, a) in LOWER[stage].iter().enumerate().filter(|(_, a)| **a != 0.0) {
            let slope = &self.slopes[k * n..(k + 1) * n];
            for (base, slope) in self.base.iter_mut().zip(slope) {
                *base += h * a * slope;
            }
        }
        let at = self.matrices;
        self.right.copy_from_slice(&self.base);
        curved.prepare(at, &mut self.right, &self.u, &mut self.x, &mut self.q);
        self.guess(start, stage);
        let (lambda, y) = (
            &mut self.lambdas[stage * m..(stage + 1) * m],
            &mut self.ys[stage * m..(stage + 1) * m],
        );
        lambda.copy_from_slice(&self.guess.0);
        y.copy_from_slice(&self.guess.1);
        self.solves += 1;
        let newton = curved.newton(at);
        let known = newton.factorisations;
        let found = newton.solve(&self.q, lambda, y, (SOLVED.min(granted), granted));
        self.factorisations += newton.factorisations - known;
        if !found {
            lambda.copy_from_slice(&self.guess.0);
            y.copy_from_slice(&self.guess.1);
            self.residual = robust(&self.q, lambda, y)?.max(self.residual);
        }
        curved.respond(at, lambda, &mut self.x);
        if self.x.iter().any(|x| !x.is_finite()) {
            return Err(Error::at(start.t, Reason::Overflow));
        }
        let slopes = &mut self.slopes[stage * n..(stage + 1) * n];
        for (slope, (x, base)) in slopes.iter_mut().zip(self.x.iter().zip(&self.base)) {
            *slope = (x - base) / (GAMMA * h);
        }
        Ok(())
    }

    /// Where λ and y of a stage are looked for first.
    fn guess(&mut self, start: &Start, stage: usize) {
        let m = self.m;
        if stage == 1 {
            let ahead = NODES[1] * self.h;
            let ahead = if ahead <= AHEAD * start.reach {
                ahead
            } else {
                0.0
            };
            for j in 0..m {
                self.guess.0[j] = start.lambda[j] + ahead * start.lambda_rate[j];
                self.guess.1[j] = start.y[j] + ahead * start.y_rate[j];
            }
            return;
        }
        self.guess.0.fill(0.0);
        self.guess.1.fill(0.0);
        for (k, weight) in extrapolation(stage) {
            for j in 0..m {
                self.guess.0[j] += weight * self.lambdas[k * m + j];
                self.guess.1[j] += weight * self.ys[k * m + j];
            }
        }
    }

    /// Adds a stage's energies.
    fn account(&mut self, curved: &Curved, stage: usize) {
        let weight = WEIGHTS[stage];
        if weight == 0.0 {
            return;
        }
        let (n, m, p, h) = (self.n, self.m, self.u.len(), self.h);
        self.w[..n].copy_from_slice(&self.x);
        self.w[n..n + m].copy_from_slice(&self.lambdas[stage * m..(stage + 1) * m]);
        self.w[n + m..n + m + p].copy_from_slice(&self.u);
        self.w[n + m + p..n + m + 2 * p].copy_from_slice(&self.du);
        self.w[n + m + 2 * p] = 1.0;
        let (source, dissipated) = curved.forms.power(&self.w);
        self.work.0 += weight * h * source;
        self.work.1 += weight * h * dissipated;
        let slope = &self.slopes[stage * n..(stage + 1) * n];
        let taken = curved.forms.taken_up(slope, &self.du, &self.x, &self.u);
        self.loss += weight * h * taken;
    }

    /// Takes what is stored from what was taken up.
    fn lose(&mut self, curved: &Curved, start: &Start) {
        let n = self.n;
        let (dx, du) = self.change.split_at_mut(n);
        for (change, (after, before)) in dx.iter_mut().zip(self.x.iter().zip(&start.x)) {
            *change = after - before;
        }
        for (change, (after, before)) in du.iter_mut().zip(self.u.iter().zip(&start.u)) {
            *change = after - before;
        }
        let forms = &curved.forms;
        let before = forms.taken_up(dx, du, &start.x, &start.u);
        let after = forms.taken_up(dx, du, &self.x, &self.u);
        self.loss -= 0.5 * (before + after);
    }

    fn estimate(&mut self, curved: &mut Curved) {
        let (n, m) = (self.n, self.m);
        self.error.fill(0.0);
        self.mean_error.fill(0.0);
        for (stage, weight) in ERROR.iter().enumerate().filter(|(_, w)| **w != 0.0) {
            for (k, error) in self.error.iter_mut().enumerate() {
                *error += self.h * weight * self.slopes[stage * n + k];
            }
            for (j, error) in self.mean_error.iter_mut().enumerate() {
                *error += weight * self.lambdas[stage * m + j];
            }
        }
        self.follow(curved);
    }

    /// What differences of states are rounding: small differences of large terms are not known better than these.
    pub(crate) fn rounding(&self, curved: &Curved, rounding: &mut [f64]) {
        let lambda = &self.lambdas[(STAGES - 1) * self.m..];
        for (k, rounding) in rounding.iter_mut().enumerate() {
            *rounding = STAGE_ROUNDING * curved.size(self.matrices, &self.right, lambda, k);
        }
    }

    /// How far states are off at the end because λ is known to the rounding of its equations alone: all that flows may be less than that.
    pub(crate) fn noise(&mut self, curved: &mut Curved, noise: &mut Vec<f64>) {
        curved.newton(self.matrices).rounding(&mut self.guess.0);
        noise.clear();
        noise.extend((0..self.n).map(|k| curved.reach(self.matrices, &self.guess.0, k)));
    }

    /// Takes what is rounding from the error, and from that of devices what follows it.
    pub(crate) fn forgive(&mut self, curved: &mut Curved, rounding: impl Fn(usize) -> f64) {
        for (k, error) in self.error.iter_mut().enumerate() {
            if error.abs() <= rounding(k) {
                *error = 0.0;
            }
        }
        self.follow(curved);
    }

    /// How far λ and y at the end are off because of the state's error.
    fn follow(&mut self, curved: &mut Curved) {
        if self.n > 0 {
            let (lambda, y) = &mut self.end_error;
            curved.shifted(self.matrices, &self.error, &mut self.q, (lambda, y));
        }
    }
}
