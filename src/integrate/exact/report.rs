//! What a run tells: events in the log, notes at its end.

use std::sync::Arc;

use super::mode::Key;
use super::stepper::Exact;
use crate::integrate::run::Log;

/// Estimated relative loss of an exponential above which it is reported.
const LOSS: f64 = 1e-10;

/// The part of a state that the rounding of a fast rate may move over the run above which that is said: Roff = 1e12 passed where
/// 1e15 was wrong.
const SLOW_PART: f64 = 1e-3;

/// When a switch stayed on its threshold.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Slides {
    count: u32,
    first: f64,
    since: Option<f64>,
    seconds: f64,
}

impl Exact<'_> {
    /// Logs which devices and switches changed.
    pub(super) fn report(&mut self, at: usize, jumped: bool, log: &mut Log) {
        let changed = self.started && self.mode != Some(at);
        let mut words = None;
        if changed {
            let from = self.mode.unwrap_or(at);
            let label = match self.plant.modes[from].label(at) {
                Some(label) => label.clone(),
                None => {
                    let label: Arc<str> = self.label(from, at).into();
                    self.plant.modes[from].labels.push((at, label.clone()));
                    label
                }
            };
            words = Some(label).filter(|label| !label.is_empty());
            self.events += 1;
            self.notes.extend(self.accumulation.event(self.motion.t));
        }
        if jumped {
            words = Some(words.map_or("jump".into(), |label| format!("{label}, jump").into()));
        }
        if self.plant.modes[at].shared && !self.noted_shared {
            self.noted_shared = true;
            self.notes.push(format!(
                "at t = {:e} s the ideal model leaves a current among conducting devices or a voltage among blocking ones \
                 undetermined: the least-norm choice is shown",
                self.motion.t
            ));
        }
        if let Some(words) = words {
            log.event(self.motion.t, words);
        }
    }

    /// Whether some probe has another value in the present row than `before`, by more than rounding.
    pub(super) fn row_jumps(&self, before: &[f64]) -> bool {
        /// Relative to the largest value of one kind in both rows.
        const ROUNDING: f64 = 1e-9;
        [true, false].into_iter().any(|volts| {
            let of_kind = || {
                let rows = before.iter().zip(&self.row).zip(&self.row_is_volts);
                rows.filter(move |(_, v)| **v == volts)
                    .map(|(pair, _)| pair)
            };
            let largest = of_kind().fold(0.0_f64, |m, (a, b)| m.max(a.abs()).max(b.abs()));
            of_kind().any(|(a, b)| (a - b).abs() > ROUNDING * largest)
        })
    }

    /// Keeps account of what starts or ends to slide on entering mode `at`: switches on their thresholds, function blocks on
    /// their steps.
    pub(super) fn note_slides(&mut self, at: usize) {
        let t = self.motion.t;
        let key = &self.plant.modes[at].key;
        if key.sliding.is_empty() && self.slides.is_empty() && self.plant.steps().is_empty() {
            return;
        }
        let switches = key.sliding.iter().map(|s| s.0);
        let after = self.plant.thresholds.len();
        let on_step = |pair: usize| key.closed[pair] && !key.closed[pair + 1];
        let steps = self.plant.steps().iter().enumerate();
        let blocks = steps
            .filter(|(_, s)| on_step(s.pair))
            .map(|(k, _)| after + k);
        for (&i, slides) in &mut self.slides {
            if slides.since.is_some() && !switches.clone().chain(blocks.clone()).any(|j| j == i) {
                slides.seconds += t - slides.since.take().unwrap_or(t);
            }
        }
        for i in switches.chain(blocks) {
            let slides = self.slides.entry(i).or_insert(Slides {
                first: t,
                ..Slides::default()
            });
            if slides.since.is_none() {
                slides.since = Some(t);
                slides.count += 1;
            }
        }
    }

    /// Ends all slides now, where the run is left to another method.
    pub(super) fn close_slides(&mut self) {
        let t = self.motion.t;
        for slides in self.slides.values_mut() {
            slides.seconds += t - slides.since.take().unwrap_or(t);
        }
        self.key.sliding.clear();
    }

    /// Names of what differs between two modes.
    fn label(&self, from: usize, to: usize) -> String {
        let [old, new] = [from, to].map(|at| &self.plant.modes[at].key);
        let mut words: Vec<String> = Vec::new();
        let thresholds = self.plant.thresholds.iter().enumerate();
        for (i, threshold) in thresholds.filter(|(_, t)| !t.is_rest()) {
            let slides = |key: &Key| key.sliding.iter().any(|s| s.0 == i);
            if slides(new) {
                if !slides(old) {
                    words.push(format!("{} slides", threshold.name));
                }
            } else if slides(old) || new.switches[i] != old.switches[i] {
                let position = if new.switches[i] { "on" } else { "off" };
                words.push(format!("{} {position}", threshold.name));
            }
        }
        for pair in (0..self.plant.pairs).filter(|&pair| new.closed[pair] != old.closed[pair]) {
            let device = self.plant.device(pair).unwrap_or_default();
            if !words.iter().any(|word| word == device) {
                words.push(device.to_string());
            }
        }
        words.join(", ")
    }

    /// Notes about the run as a whole.
    pub(super) fn note_end(&mut self) {
        self.notes.extend(self.accumulation.end());
        let thresholds = &self.plant.thresholds;
        for (&i, slides) in &self.slides {
            let seconds = slides.seconds + slides.since.map_or(0.0, |since| self.motion.t - since);
            let what = match thresholds.get(i) {
                Some(switch) if switch.is_sharp() => format!(
                    "{} slides on its threshold, where closing and opening contradict each other. What is shown is the limit of \
                     ever faster switching; a delay that the circuit leaves out can make another mean",
                    switch.name
                ),
                Some(switch) => format!(
                    "{} slides between its thresholds: closing and opening contradict each other at once, hysteresis or not. The \
                     middle of the band is a choice; a delay or a capacitance that the circuit leaves out decides",
                    switch.name
                ),
                None => format!(
                    "{} slides: its input stays where its output jumps, and the output is in between. What is shown is the limit of \
                     ever faster switching; a delay that the circuit leaves out can make another mean",
                    self.plant.steps()[i - thresholds.len()].device
                ),
            };
            self.notes.push(format!(
                "{what} ({} times, first at t = {:e} s, {seconds:e} s in all)",
                slides.count, slides.first
            ));
        }
        let loss = self
            .plant
            .modes
            .iter()
            .map(|m| m.flow.loss)
            .fold(0.0, f64::max);
        let rates = self.plant.modes.iter().filter_map(|mode| mode.fast_sum());
        let fastest = rates.fold(0.0, f64::max);
        if fastest * f64::EPSILON * self.duration > SLOW_PART {
            self.notes.push(format!(
                "several currents or voltages decay together at {fastest:.0e} 1/s, by a Roff or Ron far from all other resistances; what \
                 changes slowly in them may have lost its digits, and the values be wrong: `--verify` or a Roff a thousand times \
                 smaller tells"
            ));
        }
        if loss > LOSS {
            self.notes.push(format!(
                "the circuit is stiff without being graded: the matrix exponential is accurate to about {loss:.0e} a step"
            ));
        }
    }
}
