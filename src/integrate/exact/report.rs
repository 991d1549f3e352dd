//! What a run tells: events in the log, notes at its end.

use std::sync::Arc;

use super::mode::Key;
use super::stepper::Exact;
use crate::integrate::Note;
use crate::integrate::event::Change;
use crate::integrate::run::Log;

/// Estimated relative loss of an exponential above which it is reported.
const LOSS: f64 = 1e-10;
/// Estimated relative loss of an exponential above which the signs of guards are not known: steps take over.
pub(super) const MOST_LOSS: f64 = 1e-8;

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

impl Exact {
    /// Logs which devices and switches changed.
    pub(super) fn report(&mut self, at: usize, jumped: bool, log: &mut Log) {
        let changed = self.started && self.mode != Some(at);
        let mut changes: Arc<[Change]> = Arc::default();
        if changed {
            let from = self.mode.unwrap_or(at);
            changes = match self.plant.modes[from].label(at) {
                Some(label) => label.clone(),
                None => {
                    let label = self.label(from, at);
                    self.plant.modes[from].labels.push((at, label.clone()));
                    label
                }
            };
            self.events += 1;
            let ended = self.accumulation.event(self.motion.t);
            self.notes.extend(ended.map(Note::from));
        }
        if !self.plant.modes[at].shared.is_empty() && !self.noted_shared {
            self.noted_shared = true;
            let pairs = self.plant.modes[at].shared.iter();
            let mut devices: Vec<String> = pairs
                .filter_map(|&pair| Some(self.plant.device(pair)?.to_string()))
                .collect();
            devices.dedup();
            self.notes.push(Note::shared(&devices));
        }
        if jumped || !changes.is_empty() {
            log.event(self.motion.t, changes, jumped);
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

    /// What differs between two modes.
    fn label(&self, from: usize, to: usize) -> Arc<[Change]> {
        let [old, new] = [from, to].map(|at| &self.plant.modes[at].key);
        let mut changes: Vec<Change> = Vec::new();
        let thresholds = self.plant.thresholds.iter().enumerate();
        for (i, threshold) in thresholds.filter(|(_, t)| !t.is_rest()) {
            let slides = |key: &Key| key.sliding.iter().any(|s| s.0 == i);
            if slides(new) {
                if !slides(old) {
                    changes.push(Change::Slides(threshold.name.as_str().into()));
                }
            } else if slides(old) || new.switches[i] != old.switches[i] {
                changes.push(Change::Switch {
                    name: threshold.name.as_str().into(),
                    on: new.switches[i],
                });
            }
        }
        for pair in (0..self.plant.pairs).filter(|&pair| new.closed[pair] != old.closed[pair]) {
            let device = self.plant.device(pair).unwrap_or_default();
            if !changes.iter().any(|change| change.name() == device) {
                let own = (0..self.plant.pairs).filter(|&p| self.plant.device(p) == Some(device));
                changes.push(Change::Device {
                    name: device.into(),
                    conducts: own.into_iter().any(|p| new.closed[p]),
                });
            }
        }
        changes.into()
    }

    /// Notes about the run as a whole.
    pub(super) fn note_end(&mut self) {
        self.notes.extend(self.accumulation.end().map(Note::from));
        let thresholds = &self.plant.thresholds;
        for (&i, slides) in &self.slides {
            let seconds = slides.seconds + slides.since.map_or(0.0, |since| self.motion.t - since);
            let (name, what) = match thresholds.get(i) {
                Some(switch) if switch.is_sharp() => (
                    &switch.name,
                    "slides on its threshold, where closing and opening contradict each other. What is shown is the limit of \
                     ever faster switching; a delay that the circuit leaves out can make another mean",
                ),
                Some(switch) => (
                    &switch.name,
                    "slides between its thresholds: closing and opening contradict each other at once, hysteresis or not. The \
                     middle of the band is a choice; a delay or a capacitance that the circuit leaves out decides",
                ),
                None => (
                    &self.plant.steps()[i - thresholds.len()].device,
                    "slides: its input stays where its output jumps, and the output is in between. What is shown is the limit of \
                     ever faster switching; a delay that the circuit leaves out can make another mean",
                ),
            };
            let text = format!(
                "{name} {what} ({} times, first at t = {:e} s, {seconds:e} s in all)",
                slides.count, slides.first
            );
            self.notes.push(Note::of([name], text));
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
            let text = format!(
                "several currents or voltages decay together at {fastest:.0e} 1/s, by a Roff or Ron far from all other resistances; what \
                 changes slowly in them may have lost its digits, and the values be wrong: `--verify` or a Roff a thousand times \
                 smaller tells"
            );
            self.notes.push(text.into());
        }
        if loss > LOSS {
            let text = format!(
                "the circuit is stiff without being graded: the matrix exponential is accurate to about {loss:.0e} a step"
            );
            self.notes.push(text.into());
        }
    }
}
