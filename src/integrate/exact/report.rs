//! What a run tells: events in the log, notes at its end.

use super::mode::Key;
use super::stepper::Exact;
use crate::integrate::run::{Log, SimError};

/// Estimated relative loss of an exponential above which it is reported.
const LOSS: f64 = 1e-10;

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
    pub(super) fn report(
        &mut self,
        at: usize,
        jumped: bool,
        log: &mut Log,
    ) -> Result<(), SimError> {
        let changed = self.started && self.plant.modes[at].key != self.key;
        let mut words = String::new();
        if changed {
            let pair = (self.mode.unwrap_or(at), at);
            if !self.labels.contains_key(&pair) {
                let label = self.label(at)?;
                self.labels.insert(pair, label);
            }
            words.clone_from(&self.labels[&pair]);
            self.events += 1;
            self.notes.extend(self.accumulation.event(self.motion.t));
        }
        if jumped {
            words += if words.is_empty() { "jump" } else { ", jump" };
        }
        if self.plant.modes[at].shared && !self.noted_shared {
            self.noted_shared = true;
            self.notes.push(format!(
                "at t = {:e} s the ideal model leaves a current among conducting devices or a voltage among blocking ones \
                 undetermined: the least-norm choice is shown",
                self.motion.t
            ));
        }
        if !words.is_empty() {
            log.event(self.motion.t, words);
        }
        Ok(())
    }

    /// Keeps account of switches that start or end to slide on entering mode `at`, or at the end of the run.
    pub(super) fn note_slides(&mut self, at: usize) {
        let t = self.motion.t;
        let now = &self.plant.modes[at].key.sliding;
        for &(i, _) in &self.key.sliding {
            if let Some(slides) = self
                .slides
                .get_mut(&i)
                .filter(|_| now.iter().all(|s| s.0 != i))
            {
                slides.seconds += t - slides.since.take().unwrap_or(t);
            }
        }
        for &(i, _) in now {
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

    /// Names of what differs between the present mode and another.
    fn label(&mut self, at: usize) -> Result<String, SimError> {
        let new = self.plant.modes[at].key.clone();
        let mut words: Vec<String> = Vec::new();
        for (i, threshold) in self.plant.thresholds.iter().enumerate() {
            let slides = |key: &Key| key.sliding.iter().any(|s| s.0 == i);
            if slides(&new) {
                if !slides(&self.key) {
                    words.push(format!("{} slides", threshold.name));
                }
            } else if slides(&self.key) || new.switches[i] != self.key.switches[i] {
                let position = if new.switches[i] { "on" } else { "off" };
                words.push(format!("{} {position}", threshold.name));
            }
        }
        let free = self.plant.free(&new)?;
        for (j, port) in free.lcs.ports.iter().enumerate() {
            if new.closed.get(j) != self.key.closed.get(j) && !words.contains(&port.device) {
                words.push(port.device.clone());
            }
        }
        Ok(words.join(", "))
    }

    /// Notes about the run as a whole.
    pub(super) fn note_end(&mut self) {
        self.notes.extend(self.accumulation.end());
        for (&i, slides) in &self.slides {
            let seconds = slides.seconds + slides.since.map_or(0.0, |since| self.motion.t - since);
            self.notes.push(format!(
                "{} slides on its threshold, where closing and opening contradict each other: {} times, first at t = {:e} s, \
                 {seconds:e} s in all",
                self.plant.thresholds[i].name, slides.count, slides.first
            ));
        }
        let loss = self
            .plant
            .modes
            .iter()
            .map(|m| m.flow.loss)
            .fold(0.0, f64::max);
        if loss > LOSS {
            self.notes.push(format!(
                "the circuit is stiff without being graded: the matrix exponential is accurate to about {loss:.0e} a step"
            ));
        }
    }
}
