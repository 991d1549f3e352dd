//! Steps of circuits with curved laws whose lengths follow the error alone; the method stands in [`curved`](crate::integrate::curved).
//!
//! They go from corner to corner of the sources and from switching to switching, over corners of sources that act by switches alone and over any
//! rows between: these are read from dense output.
//! Where a caller stands still at any time it likes, steps end there.

use super::ahead::Ahead;
use super::attempt::unsolved;
use super::passage::Guards;
use super::*;
use crate::integrate::control::Verdict;
use crate::integrate::curved::tableau::GAMMA;
use crate::integrate::curved::{Curved, Segments, Start as From, Trial, Within};
use crate::integrate::grow;
use crate::law::Law;
use crate::settings::tolerances::steps::{
    CREEPS, CUT, FAINT, GRANT_EMBEDDED, SOLVED, STAGE_SOLVED,
};
use crate::settings::tolerances::times::SPAN_PARTS;

/// What steps of chosen lengths need besides the rest.
#[derive(Debug, Default)]
pub(super) struct Smooth {
    /// Where the next step starts.
    pub(super) front: From,
    pub(super) trial: Trial,
    pub(super) guards: Guards,
    /// The step to a row, and the middle where its second half starts.
    reader: Trial,
    halfway: From,
    segments: Segments,
    /// The end of the run, s, where rows are read from dense output.
    pub(super) until: Option<f64>,
    /// A caller moves the run by hand: its steps are those of the halves.
    by_hand: bool,
    /// The time of the last row, and how far that is from the one before, s.
    pub(super) at: f64,
    pub(super) apart: f64,
    /// Largest |λ| and |y| so far, by port of a system.
    pub(super) sizes: [Vec<f64>; 2],
    sizes_of: Option<usize>,
    /// See [`Trial::noise`].
    noise: Vec<f64>,
    /// The stop before which a step was halved, so that coarser runs make another one, s.
    pub(super) halved: f64,
    /// Whether the step is not halved, as a stop cuts it to a small part of the length that the steps before had room for; and the stop, s,
    /// before which its error turned out to be larger than that lets expect.
    pub(super) cut: bool,
    pub(super) uncut: f64,
    /// What the steps say of their own errors, relative to the amplitudes: of the present one, all cut ones together, and the largest, which bounds
    /// what polynomials between its ends are off.
    tells: f64,
    /// Whether the last trial erred too much.
    refused: bool,
    pub(super) common: f64,
    pub(super) largest: f64,
    pub(super) ahead: Ahead,
}

impl Theta {
    /// Has steps go over rows, in a run until `until`, s, that is read at rising times and never moved by hand.
    pub(crate) fn read_between_steps(&mut self, until: f64) {
        (self.smooth.until, self.smooth.at) = (Some(until), self.now.t);
    }

    /// Has a run that is stopped, set and taken up again go on in steps and halves.
    pub(crate) fn move_by_hand(&mut self) {
        self.smooth.by_hand = true;
        self.inputs.silence(&[]);
    }

    /// Has steps of curved laws go over corners of sources that act through controls of switches alone.
    pub(crate) fn pass_silent_corners(&mut self, silent: &[bool]) {
        if self.system().curved {
            self.inputs.silence(silent);
        }
    }

    /// Ends the run after so many more steps.
    pub(crate) fn make_at_most(&mut self, steps: u64) {
        self.settings.max_steps = self.stats.steps + steps;
    }

    /// The amplitudes of states and, by what the ports of the present system had, of branches so far: for steps that are made again.
    pub(crate) fn amplitudes_of_ports(&self) -> Amplitudes {
        let mut seen = self.amplitudes.clone();
        let [lambda, y] = &self.smooth.sizes;
        for (port, (lambda, y)) in self.system().lcs.ports.iter().zip(lambda.iter().zip(y)) {
            match port.role {
                Role::Current => seen.see_branch(*y, *lambda),
                Role::Voltage => seen.see_branch(*lambda, *y),
                Role::Function => {}
            }
        }
        seen
    }

    /// Whether the steps are those of this module.
    pub(crate) fn is_smooth(&self) -> bool {
        self.control.is_some()
            && !self.smooth.by_hand
            && self.scheme != Scheme::MOREAU
            && self.ports.is_empty()
            && self.system().curved
    }

    /// Whether the last row lies within the last step.
    pub(super) fn is_behind(&self) -> bool {
        let at = self.smooth.at;
        self.smooth.until.is_some() && at < self.now.t - Self::slack(at)
    }

    /// Whether the steps have come to t, but for the rounding of times: a row at an edge is the one after it.
    pub(super) fn is_at(&self, t: f64) -> bool {
        self.smooth.until.is_some() && self.is_smooth() && t - self.now.t <= Self::slack(t)
    }

    /// A step to t1, or to where a guard passes before, committed where its error allows it or it is to be `taken` all the same;
    /// [`Verdict::accept`] says which. The smallest one may contain an impulse, where the network may jump by itself.
    pub(super) fn embedded(
        &mut self,
        t1: f64,
        (taken, smallest): (bool, bool),
        impulse: &mut bool,
    ) -> Result<Verdict, Error> {
        self.start_here()?;
        let h = t1 - self.now.t;
        let mut tried = self.try_step(t1);
        if self.smooth.guards.hold && (taken || tried.is_err() || self.barely_passes(t1)) {
            // Where ports cannot stay as they are, the step itself finds where they go.
            self.smooth.guards.hold = false;
            tried = self.try_step(t1);
        }
        let mut verdict = match tried {
            Ok(()) => self.judge(h),
            Err(error) if taken && error.reason == Reason::Overflow => return Err(error),
            // Stages that Newton does not find have the solvers of the other steps.
            Err(_) if taken => {
                self.attempt(h, t1)?;
                *impulse = self.impulse(h)?.is_some();
                self.forget_start();
                self.commit(t1)?;
                return Ok(Verdict {
                    accept: true,
                    next: h,
                });
            }
            Err(_) => Verdict {
                accept: false,
                next: 0.25 * h,
            },
        };
        if self.smooth.cut && verdict.accept && CUT * verdict.next < h {
            self.smooth.uncut = t1;
            verdict.accept = taken;
            verdict.next = self.preferred;
        }
        // A step that a stop cut short says nothing against a longer one.
        self.preferred = if verdict.accept && h < self.preferred {
            verdict.next.max(self.preferred)
        } else {
            verdict.next
        };
        if taken && !verdict.accept {
            verdict.accept = true;
            let jumps = self.system().jump.as_ref();
            if smallest && jumps.is_some_and(|jump| !jump.monotone) {
                self.attempt(h, t1)?;
                *impulse = self.impulse(h)?.is_some();
                self.forget_start();
                self.commit(t1)?;
                return Ok(verdict);
            }
        }
        if verdict.accept {
            let Smooth {
                cut,
                tells,
                common,
                largest,
                ..
            } = &mut self.smooth;
            *largest = largest.max(*tells);
            if *cut {
                *common += *tells;
            }
            let end = match self.stop_at_passage(t1) {
                Err(_) if self.smooth.guards.hold => {
                    // Where ports have no solution on their sides up to the passage (a junction that can carry no more in reverse), they are free too.
                    self.smooth.guards.hold = false;
                    self.try_step(t1)?;
                    let again = self.judge(h);
                    if !again.accept && !taken {
                        self.preferred = again.next;
                        return Ok(again);
                    }
                    self.stop_at_passage(t1)?
                }
                end => end?,
            };
            if end.t < t1 {
                // The rest up to the stop is another step.
                self.smooth.halved = f64::NEG_INFINITY;
            }
            self.commit_trial(end.t)?;
            if verdict.next <= h {
                self.calm();
            }
            self.pass(end)?;
        }
        Ok(verdict)
    }

    /// What the next step starts from is not known any more.
    pub(super) fn forget_start(&mut self) {
        self.smooth.front.known = false;
        self.smooth.ahead.known = false;
    }

    /// Finds what the next step starts from, where it is not the end of the last one.
    fn start_here(&mut self) -> Result<(), Error> {
        if self.smooth.front.known {
            return Ok(());
        }
        self.read_lambda()?;
        self.start_from_lambda();
        Ok(())
    }

    /// The next step starts from the λ and y that have just been read.
    pub(super) fn start_from_lambda(&mut self) {
        let Self {
            plant,
            now,
            smooth,
            lambda,
            y,
            amplitudes,
            ..
        } = self;
        let system = &mut plant.systems[now.system].1;
        let curved = system.smooth();
        let front = &mut smooth.front;
        (front.known, front.t, front.reach) = (true, now.t, 0.0);
        front.x.clone_from(&now.x);
        front.u.clear();
        front.u.extend(curved.varying.iter().map(|&j| now.u[j]));
        front.lambda.clone_from(lambda);
        front.y.clone_from(y);
        front.slope.resize(now.x.len(), 0.0);
        curved.slope(&now.x, lambda, &front.u, &mut front.slope);
        for rate in [&mut front.lambda_rate, &mut front.y_rate] {
            rate.clear();
            rate.resize(lambda.len(), 0.0);
        }
        // What is small beside the others of its kind, or in its own law, is judged by these.
        let (volts, amperes) = amplitudes.branches();
        let of_kind = |port: &Port| {
            let (own_volts, own_amperes) = match port.law {
                Law::Exponential(diode) => (diode.slope, diode.is),
                _ => (0.0, 0.0),
            };
            let (volts, amperes) = (volts.max(own_volts), amperes.max(own_amperes));
            match port.role {
                Role::Current => [amperes, volts],
                Role::Voltage => [volts, amperes],
                Role::Function => [volts.max(amperes); 2],
            }
        };
        let fresh = smooth.sizes_of != Some(now.system);
        smooth.sizes_of = Some(now.system);
        for (kind, (sizes, values)) in smooth.sizes.iter_mut().zip([lambda, y]).enumerate() {
            if fresh {
                sizes.clear();
                let ports = system.lcs.ports.iter();
                sizes.extend(ports.map(|port| FAINT * of_kind(port)[kind]));
            }
            grow(sizes, values);
        }
    }

    /// The stages of a step to t1.
    pub(super) fn try_step(&mut self, t1: f64) -> Result<(), Error> {
        let Smooth {
            front,
            trial,
            guards,
            ..
        } = &mut self.smooth;
        let system = &mut self.plant.systems[self.now.system].1;
        let held = guards.hold.then_some(&self.now.active[..]);
        Self::make(
            (system, &self.now.active, &self.settings),
            &self.inputs,
            (front, t1, held),
            (trial, &mut self.stats),
        )
    }

    /// The stages of a step to t1 in a system, with its ideal ports on the sides `held`.
    fn make(
        (system, active, settings): (&mut System, &[bool], &Settings),
        inputs: &Inputs,
        (start, t1, held): (&From, f64, Option<&[bool]>),
        (trial, stats): (&mut Trial, &mut Stats),
    ) -> Result<(), Error> {
        let Some(mut curved) = system.smooth.take() else {
            let reason = Reason::Singular { h: t1 - start.t };
            return Err(Error::at(start.t, reason));
        };
        let slack = Self::slack(t1);
        let g = GAMMA * (t1 - start.t);
        let granted = Self::stage_solved(&curved, settings);
        let mut robust = |q: &[f64], lambda: &mut [f64], y: &mut [f64]| {
            if held.is_some() {
                return Err(Error::at(start.t, Reason::Singular { h: g }));
            }
            let accepted = settings.lcp_residual;
            let (step, _) = system
                .matrices(g, slack, Scheme::MOREAU, accepted)
                .map_err(|reason| Error::at(start.t, reason))?;
            let driver = &mut system.step_mut(step).driver;
            driver.suggest(active);
            driver.suggest_point(lambda, y);
            let solution = driver.solve(&DVector::from_column_slice(q));
            if let Some(error) = unsolved(&solution, &system.lcs, start.t, accepted) {
                return Err(error);
            }
            lambda.copy_from_slice(solution.lambda.as_slice());
            y.copy_from_slice(solution.y.as_slice());
            Ok(solution.residual)
        };
        let known = (trial.solves, trial.factorisations);
        let made = trial.make(
            &mut curved,
            inputs,
            start,
            (t1, held),
            (slack, granted),
            &mut robust,
        );
        stats.lcp_solves += trial.solves - known.0;
        stats.factorisations += trial.factorisations - known.1;
        system.smooth = Some(curved);
        made
    }

    /// What the last step of Newton's method at a stage may be.
    fn stage_solved(curved: &Curved, settings: &Settings) -> f64 {
        let granted = STAGE_SOLVED * GRANT_EMBEDDED * settings.tol;
        if curved.ideal.is_empty() {
            granted
        } else {
            granted.min(SOLVED)
        }
    }

    /// Has the next step start without the slopes that swing at the end of the last one.
    fn calm(&mut self) {
        let Smooth {
            front,
            trial,
            guards,
            ..
        } = &mut self.smooth;
        let held = guards.hold.then_some(&self.now.active[..]);
        let system = &mut self.plant.systems[self.now.system].1;
        if let Some(curved) = &mut system.smooth {
            let granted = Self::stage_solved(curved, &self.settings);
            let known = trial.solves;
            trial.calm(curved, &self.inputs, front, (held, granted));
            self.stats.lcp_solves += trial.solves - known;
        }
    }

    /// What error control says of the trial step of length h.
    fn judge(&mut self, h: f64) -> Verdict {
        let (Some(control), Stepping::Controlled { span, .. }) = (&self.control, self.stepping)
        else {
            return Verdict {
                accept: true,
                next: h,
            };
        };
        let moment = span / SPAN_PARTS;
        let system = &mut self.plant.systems[self.now.system].1;
        let lcs = &system.lcs;
        let Smooth {
            trial,
            sizes,
            noise,
            refused,
            ..
        } = &mut self.smooth;
        let refused = *refused;
        let Some(curved) = &mut system.smooth else {
            return Verdict {
                accept: false,
                next: h,
            };
        };
        let verdict = |trial: &Trial, curved: &Curved, moved: &mut Vec<f64>| {
            let worst = |errors: &[f64], sizes: &[f64]| {
                let relative = (curved.devices.iter()).map(|&j| errors[j].abs() / sizes[j]);
                relative.fold(0.0, f64::max)
            };
            // A mean current that is off for a part of the span counts as that part; one that is off for less than a moment as that part of it.
            let mean = worst(&trial.mean_error, &sizes[0]) * (h / span);
            let (lambda, y) = &trial.end_error;
            let end = worst(lambda, &sizes[0]).max(worst(y, &sizes[1])) * (h / moment).min(1.0);
            let of_devices = mean.max(end * (h / span).max(GRANT_EMBEDDED));
            moved.clear();
            moved.extend(trial.x.iter().zip(&trial.error).map(|(x, e)| x + e));
            let error = (self.amplitudes).error(lcs, moved, &trial.x);
            let error = error.max(of_devices);
            (error, control.judge_embedded(h, error, refused))
        };
        let first = verdict(trial, curved, &mut self.coarse);
        trial.rounding(curved, &mut self.rounding);
        let creeps = curved.leak > 0.0 && h < CREEPS * span && first.1.next <= h;
        let (error, verdict) = if first.1.accept && !creeps {
            first
        } else {
            let leakage = if creeps {
                curved.leak * self.amplitudes.branches().0
            } else {
                0.0
            };
            trial.noise(curved, noise);
            trial.forgive(curved, |k| {
                let rounding = self.rounding[k] + noise[k];
                match lcs.states[k].unit {
                    "A" => rounding.max(leakage),
                    _ => rounding,
                }
            });
            if creeps && trial.error.iter().all(|error| *error == 0.0) {
                // What a leakage makes of the voltage between junctions that block is none either, for so short a time.
                trial.mean_error.fill(0.0);
            }
            verdict(trial, curved, &mut self.coarse)
        };
        self.smooth.tells = error;
        self.smooth.refused = !verdict.accept;
        verdict
    }

    /// Makes the trial step the present.
    fn commit_trial(&mut self, t1: f64) -> Result<(), Error> {
        self.stats.steps += 1;
        if self.stats.steps > self.settings.max_steps {
            let reason = Reason::TooManySteps {
                limit: self.settings.max_steps,
            };
            return Err(Error::at(self.now.t, reason));
        }
        let trial = &self.smooth.trial;
        self.refuse_cancellation(&trial.x, trial.at_end(), trial.residual)?;
        let Smooth {
            front,
            trial,
            segments,
            sizes,
            until,
            guards,
            ..
        } = &mut self.smooth;
        if until.is_some() {
            let held = guards.hold.then_some(&self.now.active[..]);
            segments.keep(front, (self.now.system, held), trial);
        }
        front.take_end(t1, trial);
        grow(&mut sizes[0], &front.lambda);
        grow(&mut sizes[1], &front.y);
        let now = &mut self.now;
        now.balance.add(trial.work);
        now.balance.add_numerical(trial.loss);
        now.x.copy_from_slice(&front.x);
        for (u, &j) in front.u.iter().zip(self.inputs.varying()) {
            now.u[j] = *u;
        }
        now.t = t1;
        (now.settle, now.turned_off) = (false, false);
        self.last_h = trial.h;
        let system = &self.plant.systems[self.now.system].1;
        self.amplitudes.see(&system.lcs, &self.now.x);
        if guards.hold {
            return Ok(());
        }
        guards.hold = true;
        let ideal = system
            .smooth
            .as_ref()
            .map_or(&[][..], |curved| &curved.ideal);
        let on = |j: usize| front.lambda[j] > front.y[j];
        if ideal.iter().any(|&j| on(j) != self.now.active[j]) {
            let mut basis = vec![false; front.lambda.len()];
            let mut seen = vec![None; basis.len()];
            for &j in ideal {
                basis[j] = on(j);
                seen[j] = Some(on(j));
            }
            let (known, h) = (self.pending.len(), trial.h);
            self.take_pattern(basis, &seen, t1);
            self.note_event_step(known, h);
        }
        Ok(())
    }

    /// The row at a time within the last steps.
    pub(super) fn read_within(&mut self, row: &mut [f64]) {
        let Smooth {
            segments,
            at,
            apart,
            reader,
            halfway,
            ..
        } = &mut self.smooth;
        let (t, apart) = (*at, *apart);
        segments.forget_before(t);
        let Some(index) = segments.system() else {
            return;
        };
        let system = &mut self.plant.systems[index].1;
        let Some(curved) = &mut system.smooth else {
            return;
        };
        let (inputs, tol) = (&self.inputs, self.settings.tol);
        let mut from = segments.within(curved, inputs, tol);
        let middle = segments.middle(curved, (t, apart));
        let stats = &mut self.stats;
        let active = &self.now.active[..];
        let mut step =
            |start: (&From, Option<&[bool]>), t: f64, system: &mut System, reader: &mut Trial| {
                let known = (system, active, &self.settings);
                Self::make(known, inputs, (start.0, t, start.1), (reader, &mut *stats))
            };
        if let (Within::Step, Some(middle)) = (from, middle)
            && step(segments.first(), middle, system, reader).is_ok()
            && let Some(curved) = &mut system.smooth
        {
            from = segments.take_middle(curved, inputs, tol, reader);
        }
        if let (Within::Laws, Some(curved)) = (from, &mut system.smooth)
            && segments.on_laws(curved, inputs, t, row)
        {
            return;
        }
        if from != Within::Polynomials {
            let (start, held) = segments.first();
            let ends = [0.5 * (start.t + t), t];
            halfway.copy_from(start);
            // Behind an event one step leaves part of a motion that has ended. Two leave the square of it; a coarser run, which starts from the same
            // point, makes one and tells.
            let in_one = self.whole || start.reach > 0.0;
            let made = ends[usize::from(in_one)..].iter().all(|&end| {
                let made = step((halfway, held), end, system, reader).is_ok();
                halfway.take_end(end, reader);
                made
            });
            if let (true, Some(curved)) = (made, &system.smooth) {
                return segments.at_end(curved, inputs, (t, reader), row);
            }
        }
        if let Some(curved) = &system.smooth {
            segments.interpolate(curved, &self.inputs, t, row);
        }
    }
}
