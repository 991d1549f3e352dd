//! Devices that change within a step, where rates or outputs jump: the instant moves with the state, which active sets that stay do not tell.
//!
//! ```text
//! δt = −(g_x δx + g_u δu)/ġ,      δx⁺ = δx + (f⁻ − f⁺) δt,      ∫ δy dt = (y⁻ − y⁺) δt,
//! ```
//!
//! with the guard g, a λ or y that passes zero, as the set before has it (I. A. Hiskens, M. A. Pai, "Trajectory sensitivity analysis of hybrid systems", IEEE Trans. Circuits Syst. I 47, 2000).
//! All of it is that of the beginning of the step: the error falls with its length. Where a device begins to hold a state on a constraint, or its law is continuous, implicit stages
//! tell by themselves.

use super::Sparse;
use super::kernel::{Kernel, Step};
use super::system::System;
use super::tape::{Move, Set};
use crate::integrate::curved::tableau::{GAMMA, STAGES};
use crate::integrate::reading::Point;
use crate::settings::tolerances::sparse::{ALIKE, INSTANT, LEAPS, PRIMARY, PUSH};

/// Changes in one step.
const MOST_CHANGES: usize = 16;

/// See the [module](self).
#[derive(Debug)]
pub(crate) struct Bend {
    /// g_x/ġ and g_u/ġ.
    pub(super) states: Vec<f64>,
    pub(super) inputs: Vec<f64>,
    /// f⁻ − f⁺.
    pub(super) rate: Vec<f64>,
    /// y⁻ and y⁺.
    pub(crate) before: Vec<f64>,
    pub(crate) behind: Vec<f64>,
    /// What is [read](super::tape::Reads) at the beginning of the step.
    pub(super) row: Vec<f64>,
    /// When it is, s.
    pub(crate) t: f64,
}

impl Bend {
    /// δt.
    pub(super) fn by(&self, x: &[f64], u: &[f64]) -> f64 {
        -dot(&self.states, x) - dot(&self.inputs, u)
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A guard that may be the one.
struct Guard {
    states: Vec<f64>,
    inputs: Vec<f64>,
    /// ġ, 1/s, and when it is zero, s from now.
    rate: f64,
    due: f64,
}

/// The changes of devices in a step that rates or outputs jump at, in order, with the sets behind them, and the set at its end.
struct Changes {
    bends: Vec<(Bend, Vec<bool>)>,
    end: Vec<bool>,
}

impl Sparse {
    /// Writes the step that is about to be taken into the tape.
    pub(super) fn tape_step(&mut self) {
        let Some(mut tape) = self.tape.take() else {
            return;
        };
        let rows = std::mem::take(&mut self.trial.rows);
        tape.see(&rows, self.system().lcs.outputs.len());
        let end = self.trial.t1;
        let times = (end, self.now.system, (self.trial.h, Self::slack(end)));
        let mut sets = std::mem::take(&mut self.trial.sets);
        if self.reads.is_some() && sets.iter().any(|set| **set != *self.now.active) {
            let changes = self.changes(&rows, &tape.largest);
            tape.open |= changes.is_none();
            let width = rows.len() / STAGES;
            let last = &rows[rows.len() - width..];
            let Changes { bends, end } = changes.unwrap_or(Changes {
                bends: Vec::new(),
                end: Vec::new(),
            });
            for (bend, behind) in bends {
                tape.moves.push(Move::Bend(Box::new(bend)));
                let h = INSTANT * self.span;
                let instant = (self.now.t, self.now.system, (h, Self::slack(h)));
                let set: Set = tape.set(&behind);
                tape.jump(instant, (vec![set.clone(), set], [last, last].concat()));
                // Of no stage before it.
                let after = tape.set(&end);
                sets.iter_mut().for_each(|set| *set = after.clone());
            }
        }
        tape.step(times, (&sets, rows));
        self.tape = Some(tape);
    }

    /// The changes in the step that is about to be taken, with outputs of these amplitudes; nothing where several devices change by themselves.
    fn changes(&mut self, rows: &[f64], largest: &[f64]) -> Option<Changes> {
        let mut du = vec![0.0; self.now.u.len()];
        self.inputs.slopes_behind(self.now.t, &mut du);
        let Self {
            systems,
            now,
            trial,
            span,
            ..
        } = self;
        let system = &mut systems[now.system].1;
        let (instant, h) = (INSTANT * *span, trial.h);
        let mut at = Now {
            x: now.x.clone(),
            u: now.u.clone(),
            set: now.active.clone(),
            rate: now.slope.clone(),
            lambda: now.lambda.clone(),
        };
        let (mut passed, mut bends) = (0.0, Vec::new());
        while at.set != trial.active {
            let stage = (GAMMA * h, Self::slack(trial.t1));
            let primary = at.due(system, &trial.active, (stage, &du))?;
            let first = primary
                .first()
                .filter(|first| passed + first.due < (1.0 + PRIMARY) * h);
            let Some(first) = first.filter(|_| bends.len() < MOST_CHANGES) else {
                if !bends.is_empty() {
                    break;
                }
                // It has no instant of its own.
                let behind = at.behind(system, (instant, &trial.active), &du, largest)?;
                if behind.leaps {
                    return None;
                }
                at.set.clone_from(&trial.active);
                break;
            };
            let due = first.due.max(0.0);
            passed += due;
            at.go(due, &du);
            let mut active = at.successor(system, (PUSH * h, instant), &du)?;
            if active != trial.active && !holds(system, (instant, &active), (first, &at.rate)) {
                // A moment of leaks, on which nothing depends.
                active = at.successor(system, ((h - passed).max(PUSH * h), instant), &du)?;
            }
            if active == at.set {
                return None;
            }
            let behind = at.behind(system, (instant, &active), &du, largest)?;
            if behind.leaps {
                let mut together = primary
                    .iter()
                    .filter(|other| other.due - first.due < 2.0 * PUSH * h);
                if !together.all(|other| first.is_like(other, &system.kernel)) {
                    return None;
                }
                let part = |v: &[f64]| v.iter().map(|v| v / first.rate).collect();
                let rate = behind.left.iter().zip(&behind.rate);
                let bend = Bend {
                    states: part(&first.states),
                    inputs: part(&first.inputs),
                    rate: rate.map(|(a, b)| a - b).collect(),
                    before: behind.shown,
                    behind: behind.outputs,
                    row: rows[..rows.len() / STAGES].to_vec(),
                    // Both sides of it have a length.
                    t: now.t + passed.clamp(PUSH * h, (1.0 - PUSH) * h),
                };
                bends.push((bend, active.clone()));
            }
            at.set = active;
            (at.rate, at.lambda) = (behind.rate, behind.lambda);
        }
        let end = at.set;
        Some(Changes { bends, end })
    }
}

/// Whether a set holds the states where they are due, so that nothing of how they got there is left.
fn holds(
    system: &mut System,
    (instant, set): (f64, &[bool]),
    (guard, rate): (&Guard, &[f64]),
) -> bool {
    let mut left = rate.to_vec();
    let made = system
        .kernel
        .change((instant, Sparse::slack(instant)), set, &mut left);
    made && dot(&guard.states, &left).abs() < 0.5 * dot(&guard.states, rate).abs()
}

/// Where the step is looked at.
struct Now {
    x: Vec<f64>,
    u: Vec<f64>,
    set: Vec<bool>,
    rate: Vec<f64>,
    lambda: Vec<f64>,
}

/// What another set makes of the same place.
struct Behind {
    /// Rates before and behind.
    left: Vec<f64>,
    rate: Vec<f64>,
    lambda: Vec<f64>,
    /// Outputs before and behind.
    shown: Vec<f64>,
    outputs: Vec<f64>,
    /// Whether they jump, or rates do otherwise than constraints take by themselves.
    leaps: bool,
}

impl Now {
    fn go(&mut self, seconds: f64, du: &[f64]) {
        let rates = self.x.iter_mut().zip(&self.rate);
        rates.for_each(|(x, k)| *x += seconds * k);
        let rates = self.u.iter_mut().zip(du);
        rates.for_each(|(u, du)| *u += seconds * du);
    }

    /// The set so much later, by an implicit step of next to no length.
    fn successor(
        &self,
        system: &mut System,
        (later, instant): (f64, f64),
        du: &[f64],
    ) -> Option<Vec<bool>> {
        let ends = self.x.iter().zip(&self.rate);
        let mut step = Step {
            active: self.set.clone(),
            lambda: vec![0.0; self.set.len()],
            x: ends.map(|(x, k)| x + later * k).collect(),
            q: Vec::new(),
        };
        let ends = self.u.iter().zip(du);
        let u: Vec<f64> = ends.map(|(u, du)| u + later * du).collect();
        let times = (0.0, instant, Sparse::slack(instant));
        system.implicit(times, &u, &mut step).ok()?;
        Some(step.active)
    }

    /// The guards of devices that are on another side in a later set, by when they are due; not those that have been so for long.
    fn due(
        &self,
        system: &mut System,
        later: &[bool],
        ((h, slack), du): ((f64, f64), &[f64]),
    ) -> Option<Vec<Guard>> {
        let sides = self.set.iter().zip(later).enumerate();
        let mut found = Vec::new();
        for (j, _) in sides.filter(|(_, (own, later))| own != later) {
            let place = (&self.x[..], &self.lambda[..], &self.u[..]);
            let (value, mut guard) = system.guard(j, ((h, slack), &self.set), place)?;
            guard.rate = dot(&guard.states, &self.rate) + dot(&guard.inputs, du);
            guard.due = -value / guard.rate;
            if guard.rate < 0.0 && guard.due > -PRIMARY * h {
                found.push(guard);
            }
        }
        found.sort_by(|a, b| a.due.total_cmp(&b.due));
        Some(found)
    }

    fn behind(
        &self,
        system: &mut System,
        (instant, set): (f64, &[bool]),
        du: &[f64],
        largest: &[f64],
    ) -> Option<Behind> {
        let mut of = |set: &[bool]| {
            let u = &self.u[..];
            let (x, lambda) = system.held(instant, set, (&self.x, u))?;
            let mut row = vec![0.0; largest.len()];
            let at = Point {
                x: &x,
                lambda: &lambda,
                u,
                du,
            };
            system.read(at, &mut row);
            Some((system.rate(&x, &lambda, u), row, lambda))
        };
        let (before, shown, _) = of(&self.set)?;
        let (rate, behind, lambda) = of(set)?;
        let mut left: Vec<f64> = before.iter().zip(&rate).map(|(a, b)| a - b).collect();
        let held = (instant, Sparse::slack(instant));
        if !system.kernel.change(held, set, &mut left) {
            return None;
        }
        let size = |v: &[f64]| system.kernel.size(v);
        let rates_leap = size(&left) > LEAPS * (size(&before) + size(&rate));
        let mut outputs = shown.iter().zip(&behind).zip(largest);
        let leaps = outputs.any(|((a, b), largest)| (a - b).abs() > LEAPS * largest);
        Some(Behind {
            left: before,
            rate,
            lambda,
            shown,
            outputs: behind,
            leaps: leaps || rates_leap,
        })
    }
}

impl Guard {
    /// Whether both are due at the same time wherever the state is.
    fn is_like(&self, other: &Self, kernel: &Kernel) -> bool {
        let all =
            |guard: &Self| -> Vec<f64> { guard.states.iter().map(|v| v / guard.rate).collect() };
        let (own, other) = (all(self), all(other));
        let apart: Vec<f64> = own.iter().zip(&other).map(|(a, b)| a - b).collect();
        kernel.size_of_form(&apart) <= ALIKE * kernel.size_of_form(&own)
    }
}

impl System {
    /// x and λ behind two implicit steps of next to no length on an active set, from x with inputs u.
    fn held(
        &mut self,
        h: f64,
        active: &[bool],
        (x, u): (&[f64], &[f64]),
    ) -> Option<(Vec<f64>, Vec<f64>)> {
        let lcs = &self.lcs;
        let mut q = lcs.f.clone();
        lcs.g.add_times(1.0, u, &mut q);
        let (mut x, mut lambda) = (x.to_vec(), Vec::new());
        for _ in 0..2 {
            lcs.e.add_times(h, u, &mut x);
            x.iter_mut().zip(&lcs.e0).for_each(|(x, e0)| *x += h * e0);
            if !self
                .kernel
                .change_with((h, Sparse::slack(h)), active, &mut x, (&q, &mut lambda))
            {
                return None;
            }
        }
        Some((x, lambda))
    }

    /// λ_j of a device in an active set, or y_j of another, and how it follows states and inputs on that set.
    fn guard(
        &mut self,
        j: usize,
        ((h, slack), active): ((f64, f64), &[bool]),
        (x, lambda, u): (&[f64], &[f64], &[f64]),
    ) -> Option<(f64, Guard)> {
        let lcs = &self.lcs;
        let mut states = vec![0.0; x.len()];
        let mut ports = vec![0.0; lambda.len()];
        let mut inputs = vec![0.0; u.len()];
        let value = if active[j] {
            ports[j] = 1.0;
            lambda[j]
        } else {
            lcs.c.row(j).for_each(|(k, c)| states[k] = c);
            lcs.d.row(j).for_each(|(k, d)| ports[k] = d);
            lcs.g.row(j).for_each(|(k, g)| inputs[k] = g);
            lcs.f[j] + dot(&states, x) + dot(&ports, lambda) + dot(&inputs, u)
        };
        if !self
            .kernel
            .back((h, slack), active, &mut states, &mut ports)
        {
            return None;
        }
        let lcs = &self.lcs;
        lcs.e.add_transposed(h, &states, &mut inputs);
        lcs.g.add_transposed(1.0, &ports, &mut inputs);
        Some((
            value,
            Guard {
                states,
                inputs,
                rate: 0.0,
                due: 0.0,
            },
        ))
    }
}
