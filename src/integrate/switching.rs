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
    /// The position that a control value asks for.
    #[must_use]
    pub fn position(&self, on: bool, control: f64) -> bool {
        if on {
            control >= self.off_below
        } else {
            control > self.on_above
        }
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

/// Intervals in which a control that is not piecewise linear is searched for a crossing.
const SAMPLES: usize = 32;
/// Halvings of the bracket of a crossing.
const HALVINGS: usize = 80;

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

    pub(crate) fn is_empty(&self) -> bool {
        self.thresholds.is_empty()
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

    /// Whether a control asks for another position; `flip` carries it out.
    pub(crate) fn update(&mut self, lcs: &Lcs, at: Point<'_>, flip: bool) -> bool {
        let mut any = false;
        for (i, threshold) in self.thresholds.iter().enumerate() {
            let wanted = threshold.position(self.position[i], reading::value(&lcs.controls, i, at));
            if wanted != self.position[i] {
                any = true;
                if flip {
                    self.position[i] = wanted;
                    self.in_this_step += 1;
                }
            }
        }
        any
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

    /// The first time in (t, limit] at which a control that depends on sources alone passes its threshold. No source has a
    /// breakpoint in the open interval.
    pub(crate) fn next_known(&self, lcs: &Lcs, inputs: &Inputs, t: f64, limit: f64) -> Option<f64> {
        let _ = (SAMPLES, HALVINGS);
        let mut u = inputs.all(t);
        let mut first: Option<f64> = None;
        for i in (0..self.thresholds.len()).filter(|&i| self.driven[i]) {
            let mut control = |time: f64| {
                if time >= limit {
                    inputs.left(time, &mut u);
                } else {
                    inputs.right(time, &mut u);
                }
                reading::value(
                    &lcs.controls,
                    i,
                    Point {
                        x: &[],
                        lambda: &[],
                        u: &u,
                        du: &[],
                    },
                )
            };
            let on = self.position[i];
            let threshold = &self.thresholds[i];
            let asks = |value: f64| threshold.position(on, value) != on;
            let until = first.unwrap_or(limit);
            let mut low = t;
            for k in 1..=SAMPLES {
                let high = if k == SAMPLES {
                    until
                } else {
                    t + (until - t) * (k as f64 / SAMPLES as f64)
                };
                if asks(control(high)) {
                    let (mut a, mut b) = (low, high);
                    for _ in 0..HALVINGS {
                        let middle = a + 0.5 * (b - a);
                        if middle <= a || middle >= b {
                            break;
                        }
                        if asks(control(middle)) {
                            b = middle
                        } else {
                            a = middle
                        }
                    }
                    first = Some(b);
                    break;
                }
                low = high;
            }
        }
        first
    }
}
