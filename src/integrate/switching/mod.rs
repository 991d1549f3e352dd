//! Switches: their positions, thresholds, and when controls cross them.
//!
//! The switch of a thyristor is a latch: on while one of its gates is, afterwards as long as the valve in series conducts more
//! than the holding current. It therefore turns on only with a gate and off only without one, at the zero of its current.

mod threshold;

use std::sync::Arc;

pub use self::threshold::Threshold;
pub(crate) use self::threshold::{Known, at_start, fire};

use crate::circuit::source::Rest;
use crate::integrate::error::Error;
use crate::integrate::event::Change;
use crate::integrate::inputs::Inputs;
use crate::integrate::reading::{self, Point};
use crate::integrate::settle::settle;
use crate::lcs::{Input, Lcs, Port, Role, Rows};
use crate::settings::tolerances::events::DECISIVE;

/// What switches see of the system they stand in.
pub(crate) trait Watched {
    /// The sources.
    fn inputs(&self) -> &[Input];
    /// The pairs (λ, y).
    fn ports(&self) -> &[Port];
    /// What u, by source, has in it, and its constant.
    fn control_of_sources(&self, i: usize) -> (Vec<f64>, f64);
    /// Whether this has no part in it.
    fn control_is_free_of(&self, i: usize, of: Part) -> bool;
}

/// What a control may consist of besides sources.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    /// x.
    States,
    /// λ.
    Devices,
    /// u'.
    Slopes,
}

impl Watched for Lcs {
    fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    fn ports(&self) -> &[Port] {
        &self.ports
    }

    fn control_of_sources(&self, i: usize) -> (Vec<f64>, f64) {
        let Rows { u, one, .. } = &self.controls;
        (u.row(i).iter().copied().collect(), one[i])
    }

    fn control_is_free_of(&self, i: usize, of: Part) -> bool {
        let block = match of {
            Part::States => &self.controls.x,
            Part::Devices => &self.controls.lambda,
            Part::Slopes => &self.controls.du,
        };
        i >= block.nrows() || block.row(i).iter().all(|v| *v == 0.0)
    }
}

/// What controls ask of the switches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Demand {
    /// They stay.
    None,
    /// Thyristors whose current has ended block from now on: nothing moves at this moment.
    Release,
    /// Some move, at the time at which a control passes its threshold.
    Passage,
}

/// The switches of a run.
#[derive(Debug, Clone)]
pub(crate) struct Switches {
    position: Vec<bool>,
    thresholds: Vec<Threshold>,
    /// Whether each control depends on sources alone, in the present system.
    driven: Vec<bool>,
    /// Whether that is so since the present system was entered.
    newly_driven: Vec<bool>,
    /// By switch: the port of a latch's valve in the present system, and whether it conducts where it is in the active set.
    valves: Vec<Option<(usize, bool)>>,
    /// By switch: the other half of a triac, which the same gates fire.
    twins: Vec<Option<usize>>,
    needs_lambda: bool,
    in_this_step: u32,
}

impl Switches {
    pub(crate) fn new(
        mut position: Vec<bool>,
        thresholds: Vec<Threshold>,
        lcs: &impl Watched,
    ) -> Self {
        fire(&thresholds, &mut position);
        let mut switches = Self {
            position,
            thresholds,
            driven: vec![],
            newly_driven: vec![],
            valves: vec![],
            twins: vec![],
            needs_lambda: false,
            in_this_step: 0,
        };
        switches.rebuild(lcs);
        switches
    }

    /// Classifies the controls of a system.
    pub(crate) fn rebuild(&mut self, lcs: &impl Watched) {
        let state_free = |i: usize| {
            let mut parts = [Part::States, Part::Devices, Part::Slopes].into_iter();
            parts.all(|part| lcs.control_is_free_of(i, part))
        };
        // What arrives on a line is no more known beforehand than a state is.
        let arrives = |input: &Input| input.source.wave.is_arriving();
        let lines = lcs.inputs().iter().any(arrives);
        let known = |i: usize| {
            let (gains, _) = lcs.control_of_sources(i);
            let mut parts = lcs.inputs().iter().zip(gains);
            !parts.any(|(input, gain)| gain != 0.0 && arrives(input))
        };
        let known = |i: usize| !lines || known(i);
        let thresholds = || self.thresholds.iter().enumerate();
        let driven: Vec<bool> = thresholds()
            .map(|(i, t)| state_free(i) && known(i) && t.latch.is_none())
            .collect();
        let before = self.driven.iter().copied().chain(std::iter::repeat(true));
        self.newly_driven = driven
            .iter()
            .zip(before)
            .map(|(now, before)| *now && !before)
            .collect();
        self.driven = driven;
        let port = |t: &Threshold| {
            let valve = t.valve()?;
            let at = lcs.ports().iter().position(|port| port.device == valve)?;
            Some((at, lcs.ports()[at].role != Role::Voltage))
        };
        self.valves = self.thresholds.iter().map(port).collect();
        let twin = |(i, t): (usize, &Threshold)| {
            let gates = t.hold_gates()?;
            let is_other = |(j, u): (usize, &Threshold)| j != i && u.hold_gates() == Some(gates);
            self.thresholds.iter().enumerate().position(is_other)
        };
        self.twins = thresholds().map(twin).collect();
        let both = |i: usize| self.twins[i].is_some();
        self.needs_lambda = (0..self.thresholds.len())
            .any(|i| both(i) || !lcs.control_is_free_of(i, Part::Devices));
    }

    pub(crate) fn len(&self) -> usize {
        self.thresholds.len()
    }

    pub(crate) fn position(&self) -> &[bool] {
        &self.position
    }

    /// Whether some control depends on the state and has to be watched in every step.
    pub(crate) fn watch(&self) -> bool {
        let watched = |(i, t): (usize, &Threshold)| {
            !self.driven[i] && (t.latch.is_none() || t.holds(self.position[i], &self.position))
        };
        self.thresholds.iter().enumerate().any(watched)
    }

    pub(crate) fn needs_lambda(&self) -> bool {
        self.needs_lambda
    }

    pub(crate) fn forget_chatter(&mut self) {
        self.in_this_step = 0;
    }

    pub(crate) fn chattering(&self, limit: u32) -> bool {
        self.in_this_step >= limit
    }

    /// Switches driven by sources alone whose controls ask for another position right after the start at `t`.
    pub(crate) fn misplaced(&self, lcs: &impl Watched, inputs: &Inputs, t: f64) -> Vec<usize> {
        let wrong = |&i: &usize| {
            let (on, threshold) = (self.position[i], &self.thresholds[i]);
            match inputs.side_behind(lcs.control_of_sources(i), threshold.level(on), t) {
                0 => on && threshold.is_sharp(),
                side => on == (side < 0),
            }
        };
        let driven = (0..self.thresholds.len()).filter(|&i| self.driven[i]);
        driven.filter(wrong).collect()
    }

    /// Flips switches that controls have asked to move, and counts them.
    pub(crate) fn follow(&mut self, asking: &[usize]) {
        self.toggle(asking);
        self.in_this_step += asking.len() as u32;
    }

    /// Counts a passage at whose right limit no control asks: what is shorter than the reading of the right limit is not followed for ever.
    pub(crate) fn hesitate(&mut self) {
        self.in_this_step += 1;
    }

    /// See [`settle`](crate::integrate::settle::settle).
    pub(crate) fn settle(
        &mut self,
        left: &[bool],
        asking: impl FnMut(&[bool]) -> Result<Vec<usize>, Error>,
    ) -> Result<bool, Error> {
        settle(&self.thresholds, left, &mut self.position, asking)
    }

    pub(crate) fn thresholds(&self) -> &[Threshold] {
        &self.thresholds
    }

    /// Flips the given switches.
    pub(crate) fn toggle(&mut self, which: &[usize]) {
        for &i in which {
            self.position[i] = !self.position[i];
        }
        fire(&self.thresholds, &mut self.position);
    }

    /// Whether the valve in series with a latch conducts, by the active set: a current far below the tolerance of the steps holds
    /// the latch, too. Of the halves of a triac that both conduct, which short each other, it is the one with the larger current: what
    /// goes round in the two is no current of the triac.
    fn carries(&self, i: usize, lcs: &Lcs, at: Point<'_>, active: &[bool]) -> bool {
        let current = |i: usize| {
            let (port, is_current) = self.valves[i]?;
            // A port whose λ is a voltage has y for a current.
            let y = || reading::output(lcs, port, at);
            let conducts = active[port] == is_current;
            conducts.then(|| {
                if is_current {
                    at.lambda.get(port).copied()
                } else {
                    y()
                }
            })
        };
        let Some(own) = current(i) else { return false };
        // A basis may hold a port with neither a current nor, beside another valve that conducts the other way, a voltage of its own.
        if own == Some(0.0) {
            return false;
        }
        let other = self.twins[i].and_then(current);
        !matches!((own, other), (Some(own), Some(Some(other))) if own < other)
    }

    /// What controls that depend on the state ask for with this active set. Switches that sources alone drive
    /// move at the times of [`Self::next_known`] only.
    pub(crate) fn asked(&self, lcs: &Lcs, at: Point<'_>, active: &[bool]) -> Demand {
        (0..self.len())
            .filter(|&i| !self.driven[i])
            .map(|i| self.change(i, lcs, at, active))
            .max()
            .unwrap_or(Demand::None)
    }

    /// The switches that controls ask to move in a position that was just entered. One that sources alone drive since then, as the
    /// state has lost its part in the control, is asked too, if it is beyond its threshold by more than rounding.
    pub(crate) fn asking(&self, lcs: &Lcs, at: Point<'_>, active: &[bool]) -> Vec<usize> {
        let asks = |&i: &usize| {
            let beyond = || {
                let control = reading::value(&lcs.controls, i, at);
                let noise = DECISIVE * reading::magnitude(&lcs.controls, i, at);
                self.thresholds[i].excess(self.position[i], control) > noise
            };
            let waits = self.driven[i] && !(self.newly_driven[i] && beyond());
            !waits && self.change(i, lcs, at, active) != Demand::None
        };
        (0..self.len()).filter(asks).collect()
    }

    fn change(&self, i: usize, lcs: &Lcs, at: Point<'_>, active: &[bool]) -> Demand {
        let (threshold, on) = (&self.thresholds[i], self.position[i]);
        let control = || reading::value(&lcs.controls, i, at);
        match threshold.latch {
            None if threshold.position(on, control()) != on => Demand::Passage,
            Some(_) if threshold.holds(on, &self.position) => {
                if !self.carries(i, lcs, at, active) {
                    Demand::Release
                } else if threshold.off_below > 0.0 && control() <= threshold.off_below {
                    Demand::Passage
                } else {
                    Demand::None
                }
            }
            _ => Demand::None,
        }
    }

    /// Whether the controls that ask for another position are no further past their thresholds than the part `uncertain` of what
    /// they are computed from.
    pub(crate) fn undecided(&self, lcs: &Lcs, at: Point<'_>, uncertain: f64) -> bool {
        self.thresholds.iter().enumerate().all(|(i, threshold)| {
            let (on, control) = (self.position[i], reading::value(&lcs.controls, i, at));
            let level = if on {
                threshold.off_below
            } else {
                threshold.on_above
            };
            let size = reading::magnitude(&lcs.controls, i, at);
            self.driven[i]
                || threshold.position(on, control) == on
                || (control - level).abs() <= uncertain * size
        })
    }

    /// How far each control that depends on the state is beyond its threshold, positive where the switch is to move at the passage;
    /// far below where a switch waits for nothing. They go to the end of `excess`.
    pub(crate) fn excess(&self, lcs: &Lcs, at: Point<'_>, active: &[bool], excess: &mut Vec<f64>) {
        let waits = |i: usize, threshold: &Threshold| {
            !self.driven[i]
                && match threshold.latch {
                    None => true,
                    Some(_) => {
                        threshold.holds(self.position[i], &self.position)
                            && threshold.off_below > 0.0
                            && self.carries(i, lcs, at, active)
                    }
                }
        };
        let thresholds = self.thresholds.iter().enumerate();
        excess.extend(thresholds.map(|(i, threshold)| {
            if waits(i, threshold) {
                threshold.excess(self.position[i], reading::value(&lcs.controls, i, at))
            } else {
                f64::MIN
            }
        }));
    }

    fn different(&self, before: &[bool]) -> impl Iterator<Item = (usize, &Threshold)> {
        let thresholds = self.thresholds.iter().enumerate();
        thresholds.filter(move |(i, t)| !t.is_rest() && before[*i] != self.position[*i])
    }

    /// Names of those that differ from `before`.
    pub(crate) fn moved(&self, before: &[bool]) -> Vec<String> {
        self.different(before)
            .map(|(_, t)| t.name.clone())
            .collect()
    }

    /// The switches whose positions differ from `before`.
    pub(crate) fn flipped(&self, before: &[bool]) -> Arc<[Change]> {
        let switch = |(i, t): (usize, &Threshold)| Change::Switch {
            name: t.name.as_str().into(),
            on: self.position[i],
        };
        self.different(before).map(switch).collect()
    }

    /// The first time in (t, limit + slack] at which controls that depend on sources alone pass the thresholds of their switches, and
    /// which ones do at that time or no more than `slack` later (edges of several sources that are one but for rounding); an
    /// infinite time and none where nothing happens. A passage that rounding puts behind `limit` is one at `limit`: asked from there on, a control that
    /// is on its threshold but for rounding may have passed it.
    pub(crate) fn next_known(
        &self,
        lcs: &impl Watched,
        inputs: &Inputs,
        t: f64,
        limit: f64,
        slack: f64,
    ) -> (f64, Vec<usize>) {
        let mut first = f64::INFINITY;
        let mut passages = Vec::new();
        let limit = limit + slack;
        for i in (0..self.thresholds.len()).filter(|&i| self.driven[i]) {
            let (on, threshold) = (self.position[i], &self.thresholds[i]);
            // Without hysteresis a switch whose control rests on the threshold is off.
            let rest = if threshold.is_sharp() {
                Rest::IsBelow
            } else {
                Rest::IsNeither
            };
            let control = lcs.control_of_sources(i);
            let span = (t, (first + slack).min(limit));
            let Some(time) = inputs.passage(control, (threshold.level(on), rest, !on), span, slack)
            else {
                continue;
            };
            first = first.min(time);
            passages.push((time, i));
        }
        passages.retain(|(time, _)| *time <= first + slack);
        (first, passages.into_iter().map(|(_, i)| i).collect())
    }

    /// Adds the switches that sources move by edges which rounding puts behind the corner at `t`. A step to them would end at their left limits, and
    /// the next corner is beyond them.
    pub(crate) fn add_late(
        &self,
        lcs: &impl Watched,
        inputs: &Inputs,
        (t, slack): (f64, f64),
        moving: &mut Vec<usize>,
    ) {
        let end = inputs.end_of_instant(t);
        if end > t {
            moving.extend(self.next_known(lcs, inputs, t, end, slack).1);
            moving.sort_unstable();
            moving.dedup();
        }
    }
}
