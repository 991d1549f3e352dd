//! Switches: their positions, thresholds, and when controls cross them.

use crate::integrate::inputs::Inputs;
use crate::integrate::reading::{self, Point};
use crate::lcs::Lcs;

/// Thresholds of one switch.
#[derive(Debug, Clone, PartialEq)]
pub struct Threshold {
    /// The switch's name.
    pub name: String,
    /// Turns on when the control exceeds this.
    pub on_above: f64,
    /// Turns off when the control is below this.
    pub off_below: f64,
}

impl Threshold {
    /// How far a control value is beyond the threshold that a switch in this position waits for.
    #[must_use]
    pub fn excess(&self, on: bool, control: f64) -> f64 {
        if on {
            self.off_below - control
        } else {
            control - self.on_above
        }
    }

    /// The position that a control value asks for.
    #[must_use]
    pub fn position(&self, on: bool, control: f64) -> bool {
        on != (self.excess(on, control) > 0.0)
    }
}

/// The switches of a run.
#[derive(Debug, Clone)]
pub(crate) struct Switches {
    position: Vec<bool>,
    thresholds: Vec<Threshold>,
    /// Whether each control depends on sources alone, in the present system.
    driven: Vec<bool>,
    needs_lambda: bool,
    in_this_step: u32,
}

impl Switches {
    pub(crate) fn new(position: Vec<bool>, thresholds: Vec<Threshold>, lcs: &Lcs) -> Self {
        let mut switches = Self {
            position,
            thresholds,
            driven: vec![],
            needs_lambda: false,
            in_this_step: 0,
        };
        switches.rebuild(lcs);
        switches
    }

    /// Classifies the controls of a system.
    pub(crate) fn rebuild(&mut self, lcs: &Lcs) {
        let zero = |block: &nalgebra::DMatrix<f64>, i: usize| {
            i >= block.nrows() || block.row(i).iter().all(|v| *v == 0.0)
        };
        let rows = &lcs.controls;
        let state_free = |i: usize| zero(&rows.x, i) && zero(&rows.lambda, i) && zero(&rows.du, i);
        self.driven = (0..self.thresholds.len()).map(state_free).collect();
        self.needs_lambda = (0..self.thresholds.len()).any(|i| !zero(&rows.lambda, i));
    }

    pub(crate) fn len(&self) -> usize {
        self.thresholds.len()
    }

    pub(crate) fn position(&self) -> &[bool] {
        &self.position
    }

    /// Whether some control depends on the state and has to be watched in every step.
    pub(crate) fn watch(&self) -> bool {
        self.driven.iter().any(|d| !d)
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

    /// Switches driven by sources alone whose controls ask for another position at the start.
    pub(crate) fn misplaced(&self, lcs: &Lcs, u: &[f64]) -> Vec<usize> {
        let at = Point {
            x: &[],
            lambda: &[],
            u,
            du: &[],
        };
        let wrong = |&i: &usize| {
            let control = reading::value(&lcs.controls, i, at);
            self.driven[i]
                && self.thresholds[i].position(self.position[i], control) != self.position[i]
        };
        (0..self.thresholds.len()).filter(wrong).collect()
    }

    /// Flips the given switches.
    pub(crate) fn toggle(&mut self, which: &[usize]) {
        for &i in which {
            self.position[i] = !self.position[i];
        }
    }

    /// The switches whose controls depend on the state, with how far these are beyond their thresholds. Switches that sources alone drive move at the times of [`Self::next_known`] only.
    fn watched<'a>(
        &'a self,
        lcs: &'a Lcs,
        at: Point<'a>,
    ) -> impl Iterator<Item = (usize, f64)> + 'a {
        let watched = (0..self.thresholds.len()).filter(|&i| !self.driven[i]);
        watched.map(move |i| {
            let control = reading::value(&lcs.controls, i, at);
            (i, self.thresholds[i].excess(self.position[i], control))
        })
    }

    /// Whether a control that depends on the state asks for another position.
    pub(crate) fn beyond(&self, lcs: &Lcs, at: Point<'_>) -> bool {
        self.watched(lcs, at).any(|(_, excess)| excess > 0.0)
    }

    /// How far each control that depends on the state is beyond its threshold, positive where the switch is to move.
    pub(crate) fn excess(&self, lcs: &Lcs, at: Point<'_>) -> Vec<f64> {
        self.watched(lcs, at).map(|(_, excess)| excess).collect()
    }

    /// Moves the switches whose controls depend on the state and ask for another position; whether there is one.
    pub(crate) fn update(&mut self, lcs: &Lcs, at: Point<'_>) -> bool {
        let moving: Vec<usize> = self
            .watched(lcs, at)
            .filter(|(_, excess)| *excess > 0.0)
            .map(|(i, _)| i)
            .collect();
        self.toggle(&moving);
        self.in_this_step += u32::try_from(moving.len()).unwrap_or(u32::MAX);
        !moving.is_empty()
    }

    /// Names with their positions, of those that differ from `before` (all if `None`).
    pub(crate) fn flipped(&self, before: &[bool]) -> String {
        let names = self
            .thresholds
            .iter()
            .enumerate()
            .filter(|(i, _)| before.get(*i).is_none_or(|b| *b != self.position[*i]));
        let words: Vec<String> = names
            .map(|(i, t)| format!("{} {}", t.name, if self.position[i] { "on" } else { "off" }))
            .collect();
        words.join(" ")
    }

    /// The first time in (t, limit] at which controls that depend on sources alone pass the thresholds of their switches, and
    /// which ones; an infinite time and none where nothing happens.
    pub(crate) fn next_known(
        &self,
        lcs: &Lcs,
        inputs: &Inputs,
        t: f64,
        limit: f64,
    ) -> (f64, Vec<usize>) {
        let mut first = f64::INFINITY;
        let mut which = Vec::new();
        for i in (0..self.thresholds.len()).filter(|&i| self.driven[i]) {
            let (on, threshold) = (self.position[i], &self.thresholds[i]);
            let level = if on {
                threshold.off_below
            } else {
                threshold.on_above
            };
            let gains: Vec<f64> = lcs.controls.u.row(i).iter().copied().collect();
            let until = first.min(limit);
            let passage = inputs.passage(&gains, lcs.controls.one[i], level, !on, t, until);
            let Some(time) = passage else { continue };
            if time < first {
                first = time;
                which.clear();
            }
            which.push(i);
        }
        (first, which)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hysteresis_keeps_the_position_inside_the_band() {
        let switch = Threshold {
            name: "s1".into(),
            on_above: 2.0,
            off_below: 1.0,
        };
        assert_eq!(
            [0.5, 1.0, 1.5, 2.0, 2.5].map(|v| switch.position(false, v)),
            [false, false, false, false, true]
        );
        assert_eq!(
            [0.5, 1.0, 1.5, 2.0, 2.5].map(|v| switch.position(true, v)),
            [false, true, true, true, true]
        );
    }
}
