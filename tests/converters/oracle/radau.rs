//! Radau IIA of order 5 (E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II", IV.8) from event to event.

use std::cell::Cell;
use std::rc::Rc;

use super::network::{Mode, Network};
use super::positions::{Instant, Modes};
use super::waves::{Piece, piece, stops};
use super::{Accuracy, Answer, Declined, Factors, curved, spend};
use crate::circuit::Circuit;

/// √6.
const S: f64 = 2.449_489_742_783_178;
const C: [f64; 3] = [(4.0 - S) / 10.0, (4.0 + S) / 10.0, 1.0];
const A: [[f64; 3]; 3] = [
    [
        (88.0 - 7.0 * S) / 360.0,
        (296.0 - 169.0 * S) / 1800.0,
        (-2.0 + 3.0 * S) / 225.0,
    ],
    [
        (296.0 + 169.0 * S) / 1800.0,
        (88.0 + 7.0 * S) / 360.0,
        (-2.0 - 3.0 * S) / 225.0,
    ],
    [(16.0 - S) / 36.0, (16.0 + S) / 36.0, 1.0 / 9.0],
];
/// The real eigenvalue of the inverse of A.
const REAL: f64 = 3.637_834_252_744_496;
/// Weights of the stages in the estimate of the error.
const D: [f64; 3] = [-(13.0 + 7.0 * S) / 3.0, (-13.0 + 7.0 * S) / 3.0, -1.0 / 3.0];

/// Events and steps after which the oracle gives up.
const EVENTS: usize = 4000;
const STEPS: usize = 20_000;
/// What a step costs beside its matrix, in multiplications; an exponential diode costs eight times as much.
const OVERHEAD: usize = 1000;
/// Why there is no answer once the budget is spent.
const OUT_OF_WORK: &str = "more work than its budget";

struct March<'n> {
    modes: Modes<'n>,
    budget: &'n Cell<u64>,
    pieces: Vec<Piece>,
    positions: Vec<bool>,
    mode: Rc<Mode>,
    x: Vec<f64>,
    /// Largest value of each state so far.
    amplitudes: Vec<f64>,
    accuracy: Accuracy,
    answer: Answer,
}

/// A step: the stages' states, the error relative to the tolerance.
struct Step {
    stages: [Vec<f64>; 3],
    error: f64,
}

pub(super) fn run(
    network: &Network,
    circuit: &Circuit,
    accuracy: Accuracy,
    budget: &Cell<u64>,
) -> Result<Answer, Declined> {
    let stops = stops(circuit);
    let mut modes = Modes::new(network, budget);
    let positions = vec![false; network.devices.len()];
    let mode = modes.get(&positions)?;
    let mut march = March {
        modes,
        budget,
        pieces: vec![],
        positions,
        mode,
        x: network.start.clone(),
        amplitudes: vec![0.0; network.states()],
        accuracy,
        answer: Answer::default(),
    };
    let mut t = 0.0;
    for (stop, is_row) in stops {
        let middle = 0.5 * (t + stop);
        march.pieces = network.waves.iter().map(|w| piece(w, middle)).collect();
        march.settle(t)?;
        march.advance(t, stop)?;
        t = stop;
        if is_row {
            let row = network.shown.iter().map(|&k| march.x[k]).collect();
            if march.answer.rows.is_empty() {
                // What states were given at the start, and lost since, is not what rows show.
                march.amplitudes = march.x.iter().map(|x| x.abs()).collect();
            }
            march.answer.rows.push(row);
        }
    }
    Ok(march.answer)
}

impl March<'_> {
    fn sources(&self, t: f64) -> Vec<f64> {
        self.pieces.iter().map(|p| p.value(t)).collect()
    }

    fn settle(&mut self, t: f64) -> Result<(), Declined> {
        let (u, slopes) = (
            self.sources(t),
            self.pieces.iter().map(|p| p.slope(t)).collect::<Vec<_>>(),
        );
        let at = Instant {
            x: &self.x,
            u: &u,
            slopes: &slopes,
        };
        self.modes.settle(&mut self.positions, &at)?;
        self.mode = self.modes.get(&self.positions)?;
        Ok(())
    }

    fn known(&self, x: &[f64], t: f64) -> Vec<f64> {
        curved::known(self.modes.network, &self.mode, x, &self.sources(t))
    }

    fn rates(&self, x: &[f64], t: f64) -> Vec<f64> {
        let known = self.known(x, t);
        self.mode
            .rates
            .iter()
            .map(|r| curved::dot(r, &known))
            .collect()
    }

    /// From x at `t` over `h`.
    fn step(&self, t: f64, h: f64) -> Option<Step> {
        let n = self.x.len();
        if n == 0 {
            let stages = [vec![], vec![], vec![]];
            return Some(Step { stages, error: 0.0 });
        }
        let network = self.modes.network;
        let is_curved = !network.curved.is_empty();
        let start = if is_curved {
            self.x.clone()
        } else {
            vec![0.0; n]
        };
        let mut stages = [start.clone(), start.clone(), start];
        let mut done = false;
        let mut last = f64::INFINITY;
        for _ in 0..if is_curved { 12 } else { 1 } {
            let mut rates = Vec::new();
            let mut jacobians = Vec::new();
            for (c, x) in C.iter().zip(&stages) {
                let u = self.sources(t + c * h);
                let known = curved::known(network, &self.mode, x, &u);
                rates.push(
                    self.mode
                        .rates
                        .iter()
                        .map(|r| curved::dot(r, &known))
                        .collect::<Vec<_>>(),
                );
                jacobians.push(curved::jacobian(network, &self.mode, &known, n));
            }
            let mut matrix = vec![0.0; 9 * n * n];
            let mut right = vec![0.0; 3 * n];
            for i in 0..3 {
                for k in 0..n {
                    let row = i * n + k;
                    right[row] = self.x[k] - stages[i][k];
                    for j in 0..3 {
                        right[row] += h * A[i][j] * rates[j][k];
                        for l in 0..n {
                            matrix[row * 3 * n + j * n + l] =
                                -h * A[i][j] * jacobians[j][k * n + l];
                        }
                    }
                    matrix[row * 3 * n + row] += 1.0;
                }
            }
            let devices = 1 + 8 * network.curved.len();
            spend(self.budget, 9 * n * n * n + 60 * n * n + OVERHEAD * devices);
            let step = Factors::new(3 * n, matrix)?.solve(&right);
            let mut size = 0.0_f64;
            for i in 0..3 {
                for k in 0..n {
                    stages[i][k] += step[i * n + k];
                    let scale = self.amplitudes[k].max(stages[i][k].abs()).max(1e-12);
                    size = size.max(step[i * n + k].abs() / scale);
                }
            }
            if !size.is_finite() {
                return None;
            }
            if !is_curved || size < 1e-12 || size < 1e-9 && size * size / last < 1e-14 {
                done = true;
                break;
            }
            last = size;
        }
        if !done {
            return None;
        }
        let error = self.error(t, h, &stages)?;
        Some(Step { stages, error })
    }

    fn error(&self, t: f64, h: f64, stages: &[Vec<f64>; 3]) -> Option<f64> {
        let n = self.x.len();
        let known = self.known(&self.x, t);
        let jacobian = curved::jacobian(self.modes.network, &self.mode, &known, n);
        let mut matrix: Vec<f64> = jacobian.iter().map(|a| -a).collect();
        let mut right = self.rates(&self.x, t);
        for k in 0..n {
            matrix[k * n + k] += REAL / h;
            for (d, stage) in D.iter().zip(stages) {
                right[k] += d * (stage[k] - self.x[k]) / h;
            }
        }
        let errors = Factors::new(n, matrix)?.solve(&right);
        let largest = self.floors();
        let relative = errors.iter().enumerate().map(|(k, e)| {
            let scale = self.amplitudes[k]
                .max(stages[2][k].abs())
                .max(self.x[k].abs());
            e.abs() / (self.accuracy.tolerance * scale.max(largest[k]))
        });
        Some(relative.fold(0.0, f64::max))
    }

    /// Below this part of the largest state nothing counts.
    fn floors(&self) -> Vec<f64> {
        let largest = self.amplitudes.iter().fold(1e-12_f64, |m, a| m.max(*a));
        vec![1e-4 * largest; self.x.len()]
    }

    /// The smallest guard relative to its terms; negative once a device leaves its position.
    fn guards(&self, x: &[f64], t: f64) -> f64 {
        let known = self.known(x, t);
        let relative = self.mode.guards.iter().map(|row| {
            let (value, size) = row
                .iter()
                .zip(&known)
                .fold((0.0, 0.0), |(v, s), (a, b)| (v + a * b, s + (a * b).abs()));
            if size > 0.0 { value / size } else { 0.0 }
        });
        relative.fold(f64::INFINITY, f64::min)
    }

    /// The state inside a step, by the polynomial through its start and stages.
    fn inside(&self, step: &Step, s: f64) -> Vec<f64> {
        let at = [0.0, C[0], C[1], C[2]];
        let weight = |i: usize| -> f64 {
            (0..4)
                .filter(|&j| j != i)
                .map(|j| (s - at[j]) / (at[i] - at[j]))
                .product()
        };
        let weights = [weight(0), weight(1), weight(2), weight(3)];
        (0..self.x.len())
            .map(|k| {
                let stages = step.stages.iter().zip(&weights[1..]);
                weights[0] * self.x[k] + stages.map(|(x, w)| w * x[k]).sum::<f64>()
            })
            .collect()
    }

    /// Where a guard is seen to be passed first, as the part of the step.
    fn passed(&self, step: &Step, t: f64, h: f64) -> Option<(f64, f64)> {
        if self.mode.guards.is_empty() {
            return None;
        }
        let points = [0.05, C[0], 0.3, 0.5, C[1], 0.8, 0.9, 1.0];
        let mut before = 0.0;
        for s in points {
            let x = if s == 1.0 {
                step.stages[2].clone()
            } else {
                self.inside(step, s)
            };
            if self.guards(&x, t + s * h) < -1e-12 {
                return Some((before, s));
            }
            before = s;
        }
        None
    }

    fn take(&mut self, step: &Step) {
        self.x.clone_from(&step.stages[2]);
        for (a, x) in self.amplitudes.iter_mut().zip(&self.x) {
            *a = a.max(x.abs());
        }
        self.answer.steps += 1;
    }

    fn advance(&mut self, start: f64, stop: f64) -> Result<(), Declined> {
        let longest = self.accuracy.longest * (stop - start);
        let (mut t, mut h) = (start, longest);
        let mut still = 0;
        while stop - t > 1e-15 * stop {
            if self.budget.get() == 0 {
                return Err(Declined(OUT_OF_WORK.into()));
            }
            if self.answer.steps > STEPS || self.answer.events.len() > EVENTS {
                return Err(Declined("too many steps or events".into()));
            }
            h = h.min(stop - t).min(longest);
            let step = self.step(t, h);
            // Smaller by what the error asks for; what overflowed has none.
            let error = step.as_ref().map_or(1e4, |s| s.error);
            let error = if error.is_nan() { 1e4 } else { error };
            let Some(step) = step.filter(|s| s.error <= 1.0) else {
                h *= (0.9 * error.powf(-0.25)).clamp(0.05, 0.7);
                if h < 1e-16 * stop {
                    return Err(Declined("a step too small".into()));
                }
                continue;
            };
            let larger = (0.9 * step.error.max(1e-8).powf(-0.25)).min(8.0);
            let Some((mut low, mut high)) = self.passed(&step, t, h) else {
                self.take(&step);
                t = if h == stop - t { stop } else { t + h };
                h *= larger;
                continue;
            };
            // The polynomial may be late: what it takes for the lower end may be past the crossing.
            let is_past = |s: f64| {
                let trial = self.step(t, s * h);
                trial.is_some_and(|trial| self.guards(&trial.stages[2], t + s * h) < 0.0)
            };
            if low > 0.0 && is_past(low) {
                (low, high) = (0.0, low);
            }
            // The instant, on steps that end there.
            let (mut g_low, mut g_high) = (1e-12_f64, -1e-12_f64);
            let mut found = None;
            for round in 0..100 {
                let s = match round {
                    0 => high,
                    k if k % 3 == 2 => 0.5 * (low + high),
                    _ => (low + (high - low) * g_low / (g_low - g_high)).clamp(low, high),
                };
                let trial = self
                    .step(t, s * h)
                    .ok_or_else(|| Declined("no step to an event".into()))?;
                let g = self.guards(&trial.stages[2], t + s * h);
                if g < 0.0 {
                    (high, g_high) = (s, g);
                    found = Some((trial, s));
                } else {
                    (low, g_low) = (s, g.max(1e-300));
                    if round == 0 {
                        break;
                    }
                }
                if g < 0.0 && g > -4e-16 || (high - low) * h <= 4e-16 * (t + h) {
                    break;
                }
            }
            let Some((trial, s)) = found else {
                // The dense output alone had seen a crossing: the step is too long.
                if h < 1e-13 * stop {
                    self.take(&step);
                    t += h;
                } else {
                    h *= 0.5;
                }
                continue;
            };
            self.take(&trial);
            still = if s * h < 1e-13 * stop { still + 1 } else { 0 };
            if still > 60 {
                return Err(Declined("events without progress".into()));
            }
            t = (t + s * h).min(stop);
            self.answer.events.push(t);
            self.settle(t)?;
            h = stop - t;
        }
        Ok(())
    }
}
