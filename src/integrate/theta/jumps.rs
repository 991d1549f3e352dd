//! What happens in no time: the start, edges of sources, switches.

use super::*;
use crate::integrate::impulses;
use crate::integrate::jump::Jump;
use crate::integrate::settle;
use crate::integrate::stats::{JumpReason, StateJump};
use crate::settings::tolerances::jumps::{IMPULSE_RATIO, NO_JUMP};
use crate::settings::tolerances::steps::SHORT;

impl Theta {
    /// The first jump: from inconsistent initial values, by edges of the sources at the start.
    pub(super) fn begin(&mut self, log: &mut Log) -> Result<(), Error> {
        let mut u = self.inputs.all(self.now.t);
        self.inputs.behind(self.now.t, &mut u);
        let before = std::mem::replace(&mut self.now.u, u);
        let at_rest = self.at_rest.take().filter(|_| before == self.now.u);
        match at_rest {
            None => self.jump(&before, log)?,
            Some(_) => self.start_anew(),
        }
        let start = std::mem::take(&mut self.start);
        // Steps that take over at an instant begin with what it brings.
        let reason = if self.now.t > 0.0 && before != self.now.u {
            JumpReason::SourceEdge
        } else {
            JumpReason::Start
        };
        self.note_jump(&start, 0.0, reason, log);
        self.note_energy();
        self.find_mode()?;
        if let Some(points) = at_rest {
            self.take_points(&points);
        }
        self.started = true;
        let Self {
            amplitudes,
            plant,
            now,
            ..
        } = self;
        amplitudes.see(&plant.systems[now.system].1.lcs, &now.x);
        self.break_waves()
    }

    /// Smooth laws at the start have these voltages and currents.
    fn take_points(&mut self, points: &[(f64, f64)]) {
        let system = &self.plant.systems[self.now.system].1;
        let is_told = self.is_smooth()
            && points.len() == system.lcs.m()
            && system
                .smooth
                .as_ref()
                .is_some_and(|curved| curved.ideal.is_empty());
        if !is_told {
            return;
        }
        for (j, (port, &(v, i))) in system.lcs.ports.iter().zip(points).enumerate() {
            (self.lambda[j], self.y[j]) = match port.role {
                Role::Voltage => (-v, i),
                Role::Current | Role::Function => (i, -v),
            };
        }
        self.start_from_lambda();
        // The row there needs no reading on the laws.
        self.jumped = f64::NEG_INFINITY;
    }

    /// At a breakpoint: inputs take their right limits, the state jumps if it must.
    pub(super) fn edge(&mut self, t: f64, log: &mut Log) -> Result<(), Error> {
        let mut u = self.now.u.clone();
        self.inputs.behind(t, &mut u);
        self.edge = self.now.t;
        // Where the inputs go on with another slope alone, x' does not jump.
        self.smooth.front.reach = 0.0;
        if !self.is_smooth() {
            self.forget_slope();
        }
        if u == self.now.u {
            if log.wants_corners() {
                let row = self.row();
                log.corner(self.now.t, &row);
            }
            return self.break_waves();
        }
        let rows = log.wants_rows();
        let before = rows.then(|| self.row());
        let storage = self.system().storage(&self.now.x, &self.now.u);
        let lost = self.now.balance.lost_in_jumps();
        let old = std::mem::replace(&mut self.now.u, u);
        if let Some(row) = &before {
            log.row(self.now.t, row);
        }
        self.jump(&old, log)?;
        self.note_jump(&storage, lost, JumpReason::SourceEdge, log);
        self.find_mode()?;
        self.break_waves()?;
        self.report_quietly(log);
        if rows {
            self.log_row(log);
        }
        Ok(())
    }

    /// The motion goes on from here with another slope. Where a curved step starts from is told by [`Self::find_mode`], which follows.
    fn forget_slope(&mut self) {
        self.now.slope.clear();
        self.looks.forget();
    }

    /// What is known of the motion before does not hold any more.
    fn start_anew(&mut self) {
        self.now.settle = true;
        self.forget_slope();
        self.attempt.h = f64::NAN;
    }

    /// The jump from inputs `old` to the present ones at the present time.
    pub(super) fn jump(&mut self, old: &[f64], log: &mut Log) -> Result<(), Error> {
        self.start_anew();
        let t = self.now.t;
        let x = DVector::from_column_slice(&self.now.x);
        let u = DVector::from_column_slice(&self.now.u);
        let System { lcs, jump, .. } = &mut self.plant.systems[self.now.system].1;
        let passive = jump.as_ref().is_none_or(|problem| problem.projects);
        let found = match jump {
            Some(problem) if problem.monotone => {
                let found = problem.solve(lcs, &x, &u).map_err(|e| {
                    Error::at(t, Reason::Infeasible).device(lcs.ports[e.port].device.clone())
                })?;
                if let Some(jump) = &found {
                    let checked = problem.verify(lcs, jump);
                    checked.map_err(|broken| Error::at(t, Reason::Internal(broken)))?;
                    if !self.noted_rivals
                        && let Some(note) = jump.note(lcs, t)
                    {
                        self.noted_rivals = true;
                        self.notes.push(note);
                    }
                }
                found
            }
            Some(_) => self.step_limit()?,
            None => None,
        };
        let lcs = &self.plant.systems[self.now.system].1.lcs;
        let (after, p) = match found {
            Some(jump) => (jump.x, jump.p),
            None => (x.clone(), DVector::zeros(lcs.m())),
        };
        let loss = energy::loss_of_jump(lcs, &x, &after, &u, &p, passive);
        let p = p.as_slice();
        let source =
            energy::source_work_of_jump(lcs, x.as_slice(), after.as_slice(), old, u.as_slice(), p);
        self.now.balance.add_jump((source, loss));
        let step: Vec<f64> = u.iter().zip(old).map(|(a, b)| a - b).collect();
        // A jump at the rounding of the amplitudes seen so far corrects the state and is not worth a word.
        let lcs = &self.plant.systems[self.now.system].1.lcs;
        let size = self.amplitudes.error(lcs, x.as_slice(), after.as_slice());
        self.now.x.copy_from_slice(after.as_slice());
        if size > NO_JUMP {
            self.jumped = t;
            self.stats.jumps += 1;
            log.event(t, Arc::default(), true);
        }
        if size > NO_JUMP || step.iter().any(|s| *s != 0.0) {
            self.log_impulses(t, p, &step, log);
        }
        Ok(())
    }

    /// Writes down that the storage jumped here from `before`, if it did by more than rounding; until then jumps had lost `lost`, J.
    pub(super) fn note_jump(
        &self,
        before: &DVector<f64>,
        lost: f64,
        reason: JumpReason,
        log: &mut Log,
    ) {
        let system = self.system();
        let storage = &system.lcs.storage;
        let after = system.storage(&self.now.x, &self.now.u);
        if before.len() != after.len() || before.len() != storage.elements.len() {
            return;
        }
        let size = |k: usize| before[k].abs().max(after[k].abs());
        let kind = |k: usize| {
            let same = (0..after.len()).filter(|&j| storage.units[j] == storage.units[k]);
            same.map(size).fold(0.0, f64::max)
        };
        let jumped: Vec<usize> = (0..after.len())
            .filter(|&k| (after[k] - before[k]).abs() > NO_JUMP * kind(k))
            .collect();
        if !jumped.is_empty() {
            let balance = &self.now.balance;
            let change = DVector::from_fn(after.len(), |k, _| after[k] - before[k]);
            let loss = balance.lost_in_jumps() - lost;
            let sizes = (
                loss,
                energy::of_change(&system.lcs, &change),
                balance.largest(),
            );
            let storage = (&*storage.elements, &*storage.units);
            log.state_jump(StateJump::new(self.now.t, storage, &jumped, sizes, reason));
        }
    }

    /// Writes down the jump that the impulses p make in the present step. What it loses is part of what the step's damping loses.
    pub(super) fn note_impulse(&mut self, t: f64, p: &[f64], log: &mut Log) {
        let lcs = &self.plant.systems[self.now.system].1.lcs;
        let storage = &lcs.storage;
        let p = DVector::from_column_slice(p);
        let step = &lcs.b * &p;
        let after = DVector::from_column_slice(&self.out[..lcs.n()]);
        let u = DVector::from_column_slice(&self.u_next);
        let loss = energy::loss_of_jump(lcs, &(&after - &step), &after, &u, &p, false);
        let moved = &storage.x * step;
        let kind = |k: usize| {
            let same = (0..moved.len()).filter(|&j| storage.units[j] == storage.units[k]);
            same.map(|j| moved[j].abs()).fold(0.0, f64::max)
        };
        let jumped: Vec<usize> = (0..moved.len())
            .filter(|&k| moved[k].abs() > NO_JUMP * kind(k))
            .collect();
        let devices: Vec<&str> = (0..lcs.m())
            .filter(|&j| p[j].abs() > NO_JUMP * p.amax())
            .map(|j| lcs.ports[j].device.as_str())
            .collect();
        let reason = JumpReason::Device(devices.join(", "));
        let change = energy::of_change(lcs, &moved);
        let sizes = (loss, change, self.now.balance.largest());
        let storage = (&*storage.elements, &*storage.units);
        log.state_jump(StateJump::new(t, storage, &jumped, sizes, reason));
        self.now.balance.reattribute_to_jump(loss);
    }

    /// The jump of a network that is not passive, where no projection exists: the limit of the implicit step, p = hλ at h and
    /// h/2 extrapolated. `None` where p vanishes with h.
    fn step_limit(&mut self) -> Result<Option<Jump>, Error> {
        let h = self.read_step();
        let mut p = |h: f64| -> Result<DVector<f64>, Error> {
            let step = self.prepare_short(h)?;
            Ok(self.solve_short(step)?.lambda * h)
        };
        let (whole, half) = (p(h)?, p(0.5 * h)?);
        if half.amax() <= IMPULSE_RATIO * whole.amax() {
            return Ok(None);
        }
        let p = half * 2.0 - whole;
        let x = DVector::from_column_slice(&self.now.x) + &self.system().lcs.b * &p;
        Ok(Some(Jump {
            x,
            p,
            rivals: vec![],
            rounding: 0.0,
        }))
    }

    /// Logs the impulses of a jump by port impulses p and steps of the inputs.
    pub(super) fn log_impulses(&self, t: f64, p: &[f64], step: &[f64], log: &mut Log) {
        let p = DVector::from_column_slice(p);
        let named = impulses::of_jump(&self.system().lcs, &p, step);
        for (name, area) in named {
            log.impulse(t, name, area);
        }
    }

    /// What the controls ask of the switches now.
    pub(super) fn crossed(&mut self) -> Result<Demand, Error> {
        if self.switches.needs_lambda() {
            self.read_lambda()?;
        }
        let lcs = &self.plant.systems[self.now.system].1.lcs;
        let at = self.now.point(&self.lambda, &self.du);
        Ok(self.switches.asked(lcs, at, &self.now.active))
    }

    /// Whether the controls ask a switch to move now.
    pub(super) fn asked(&mut self) -> Result<bool, Error> {
        Ok(self.switches.watch() && self.crossed()? != Demand::None)
    }

    /// How far the controls of switches that watch the state are beyond their thresholds now.
    pub(super) fn excess(&mut self) -> Result<Vec<f64>, Error> {
        if self.switches.needs_lambda() {
            self.read_lambda()?;
        }
        let lcs = &self.plant.systems[self.now.system].1.lcs;
        let at = self.now.point(&self.lambda, &self.du);
        let mut excess = Vec::new();
        (self.switches).excess(lcs, at, &self.now.active, &mut excess);
        Ok(excess)
    }

    /// Flips the switches `moving`, then those whose controls ask for it until none does, with the jumps this causes.
    pub(super) fn switch(&mut self, moving: &[usize], log: &mut Log) -> Result<(), Error> {
        if log.wants_rows() {
            self.log_row(log);
        }
        let storage = self.system().storage(&self.now.x, &self.now.u);
        let (lost, first) = (
            self.now.balance.lost_in_jumps(),
            self.switches.position().to_vec(),
        );
        let mut before = first.clone();
        // Where the last change of position started, and the storage where the next one does.
        let (mut started, mut s) = (None, storage.clone());
        self.switches.toggle(moving);
        for _ in 0..2 + 2 * before.len() {
            if self.switches.position() == before {
                let asking = self.asking()?;
                if asking.is_empty() {
                    if before == first {
                        self.switches.hesitate();
                    }
                    let moved = self.switches.moved(&first).join(", ");
                    self.note_jump(&storage, lost, JumpReason::Switch(moved), log);
                    self.break_waves()?;
                    if log.wants_rows() {
                        self.log_row(log);
                    }
                    return Ok(());
                }
                s = self.system().storage(&self.now.x, &self.now.u);
                match started
                    .take()
                    .and_then(|start| self.interrupt(start, &asking, &s))
                {
                    Some((there, first)) => {
                        s = there;
                        self.switches.follow(&first);
                    }
                    None => self.switches.follow(&asking),
                }
            }
            self.settle(&before, &s)?;
            self.stats.events += 1;
            log.event(self.now.t, self.switches.flipped(&before), false);
            started = Some((self.now.system, s.clone(), self.now.balance));
            self.change_position(&s, log)?;
            before = self.switches.position().to_vec();
        }
        // A switch whose positions contradict each other by less than the right limit is known to slides: it stays as it is.
        self.read_lambda()?;
        let at = self.now.point(&self.lambda, &self.du);
        if self.switches.undecided(&self.system().lcs, at, SHORT) {
            let moved = self.switches.moved(&first).join(", ");
            self.note_jump(&storage, lost, JumpReason::Switch(moved), log);
            self.break_waves()?;
            if log.wants_rows() {
                self.log_row(log);
            }
            return Ok(());
        }
        let asking = self.asking()?;
        self.switches.toggle(&asking);
        let moving = self.switches.moved(&before);
        Err(Error::at(self.now.t, Reason::SwitchesDoNotSettle).devices(moving))
    }

    /// The switches that controls ask to move in the present position.
    fn asking(&mut self) -> Result<Vec<usize>, Error> {
        if self.switches.needs_lambda() {
            self.read_lambda()?;
        }
        let lcs = &self.plant.systems[self.now.system].1.lcs;
        let at = self.now.point(&self.lambda, &self.du);
        Ok(self.switches.asking(lcs, at, &self.now.active))
    }

    /// Where the jump from `start` (system, storage, balance) to storage `end` stops because the first of the switches `asking` pass
    /// their thresholds on the way, and which these are; see [`settle::interruption`].
    fn interrupt(
        &mut self,
        (left, start, balance): (usize, DVector<f64>, Balance),
        asking: &[usize],
        end: &DVector<f64>,
    ) -> Option<(DVector<f64>, Vec<usize>)> {
        let systems = &self.plant.systems;
        let (left, entered) = (&systems[left].1.lcs, &systems[self.now.system].1.lcs);
        let u = DVector::from_column_slice(&self.now.u);
        let (part, first) = settle::interruption(
            (left, entered),
            self.switches.thresholds(),
            (self.switches.position(), asking),
            (&start, end),
            &u,
        )?;
        let change = end - &start;
        let square = energy::of_change(entered, &change);
        self.now.balance.take_part(&balance, part, square);
        Some((start + change * part, first))
    }

    /// Moves the switches that those which have left position `before` move, see [`settle`](settle::settle).
    fn settle(&mut self, before: &[bool], s: &DVector<f64>) -> Result<(), Error> {
        if before.len() < 2 {
            return Ok(());
        }
        let u = DVector::from_column_slice(&self.now.u);
        let thresholds = self.switches.thresholds().to_vec();
        let Self {
            plant,
            switches,
            inputs,
            now,
            ..
        } = self;
        switches.settle(before, |position| {
            let at = plant.system(position, inputs, now.t)?;
            let (left, lcs) = (&plant.systems[now.system].1.lcs, &plant.systems[at].1.lcs);
            let mut asking = settle::asking(lcs, &thresholds, position, s, &u);
            let [left, now] = [left, lcs].map(|lcs| move |i| settle::of_sources(lcs, i));
            asking.retain(|&i| !settle::is_driven_alike(left(i), now(i)));
            Ok(asking)
        })?;
        Ok(())
    }

    /// Takes storage s over into the system of the present switch position.
    fn change_position(&mut self, s: &DVector<f64>, log: &mut Log) -> Result<(), Error> {
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
        let x = system.state_from(s);
        self.now.x.clear();
        self.now.x.extend(x.iter());
        if self.now.active.len() != system.lcs.m() {
            self.now.active = vec![false; system.lcs.m()];
            self.now.pattern = vec![false; system.lcs.m()];
        }
        let joined = system.storage(&self.now.x, &self.now.u);
        self.now
            .balance
            .add_jump(energy::taking_over(&system.lcs, s.as_slice(), &x, &joined));
        self.resize();
        self.switches.rebuild(&self.plant.systems[at].1.lcs);
        let u = self.now.u.clone();
        self.jump(&u, log)?;
        self.find_mode()?;
        self.pending.clear();
        Ok(())
    }
}
