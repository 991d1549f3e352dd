//! What a run tells: events in the log, notes at its end.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::accumulation::Accumulation;
use super::key::Key;
use super::plant::ModeTable;
use crate::integrate::Note;
use crate::integrate::event::Change;
use crate::integrate::log::Log;
use crate::integrate::run::Outcome;
use crate::integrate::stats::Stats;
use crate::settings::tolerances::events::WRONG_SIDE;
use crate::settings::tolerances::exponentials::{LOSS, SLOW_PART};
use crate::settings::tolerances::jumps::CONSISTENT;

/// When a switch stayed on its threshold.
#[derive(Debug, Clone, Copy, Default)]
struct Slides {
    count: u32,
    first: f64,
    since: Option<f64>,
    seconds: f64,
}

/// What a run tells, and how much happened.
pub(super) struct Report {
    pub(super) notes: Vec<Note>,
    pub(super) accumulation: Accumulation,
    noted_shared: bool,
    noted_hidden: bool,
    /// The largest current of a conducting device and voltage of a blocking device so far, A and V.
    largest: [f64; 2],
    /// Whether a jump between rivals has been noted.
    pub(super) noted_rivals: bool,
    /// By switch, then by step of a function block: when it slid.
    slides: BTreeMap<usize, Slides>,
    events: u64,
    pub(super) jumps: u64,
    pub(super) lcp_solves: u64,
}

impl Report {
    /// Of a run that starts at t.
    pub(super) fn new(t: f64) -> Self {
        Self {
            notes: Vec::new(),
            accumulation: Accumulation::new(t),
            noted_shared: false,
            noted_hidden: false,
            largest: [0.0; 2],
            noted_rivals: false,
            slides: BTreeMap::new(),
            events: 0,
            jumps: 0,
            lcp_solves: 0,
        }
    }

    /// Logs which devices and switches change at t from mode `from` to mode `at`, and whether the state jumps.
    pub(super) fn enter(
        &mut self,
        table: &mut ModeTable,
        (from, at): (Option<usize>, usize),
        t: f64,
        jumped: bool,
        log: &mut Log,
    ) {
        let from = from.filter(|from| *from != at);
        let changes = from.map(|from| table.label(from, at, |table| label(table, from, at)));
        if changes.is_some() {
            self.events += 1;
            if let Some(text) = self.accumulation.event(t, at) {
                self.notes.push(accumulated(text));
            }
        }
        if !table.modes[at].shared.is_empty() && !self.noted_shared {
            self.note_shared(table, at);
        }
        if jumped || changes.as_ref().is_some_and(|changes| !changes.is_empty()) {
            log.event(t, changes.unwrap_or_default(), jumped);
        }
        let slides = !table.modes[at].key.sliding.is_empty() || !self.slides.is_empty();
        if slides || !table.steps().is_empty() {
            self.note_slides(table, at, t);
        }
    }

    /// So many changes of mode that are not told.
    pub(super) fn count_events(&mut self, events: u64) {
        self.events += events;
    }

    /// Notes that devices of mode `at` share what the ideal model does not determine.
    #[cold]
    #[inline(never)]
    fn note_shared(&mut self, table: &ModeTable, at: usize) {
        self.noted_shared = true;
        let pairs = table.modes[at].shared.iter();
        let mut devices: Vec<String> = pairs
            .filter_map(|&pair| Some(table.device(pair)?.to_string()))
            .collect();
        devices.dedup();
        self.notes.push(Note::shared(&devices));
    }

    /// Notes the first device that stands wrongly at the end of mode `at`, at t: `sides` has pairs and guards, which are negative there. A
    /// guard that rounding hides has not ended the mode. `stored` are the largest current and voltage of the storage so far.
    pub(super) fn note_hidden(
        &mut self,
        table: &ModeTable,
        at: usize,
        sides: impl Iterator<Item = (usize, f64)> + Clone,
        stored: impl Fn() -> [f64; 2],
        t: f64,
    ) {
        if self.noted_hidden {
            return;
        }
        let closed = &table.modes[at].key.closed;
        let is = |pair: usize| closed.get(pair).copied().unwrap_or(true);
        let mut negative = false;
        for (pair, g) in sides.clone() {
            let largest = &mut self.largest[usize::from(!is(pair))];
            *largest = largest.max(g.abs());
            negative |= g < 0.0;
        }
        if negative {
            self.note_wrong_sides((table, at), sides, stored(), t);
        }
    }

    /// Notes the first of them that is negative beyond rounding.
    #[cold]
    #[inline(never)]
    fn note_wrong_sides(
        &mut self,
        (table, at): (&ModeTable, usize),
        sides: impl Iterator<Item = (usize, f64)> + Clone,
        stored: [f64; 2],
        t: f64,
    ) {
        let closed = &table.modes[at].key.closed;
        let is = |pair: usize| closed.get(pair).copied().unwrap_or(true);
        for (side, (largest, stored)) in [true, false]
            .into_iter()
            .zip(self.largest.into_iter().zip(stored))
        {
            let largest = largest.max(stored);
            let guards = sides.clone().filter(|(pair, _)| is(*pair) == side);
            let mut wrong = guards.filter(|(_, g)| *g < -WRONG_SIDE * largest);
            let Some((device, g)) = wrong.find_map(|(pair, g)| Some((table.device(pair)?, g)))
            else {
                continue;
            };
            self.noted_hidden = true;
            let (stands, unit) = if side {
                ("conducts", "A")
            } else {
                ("blocks", "V")
            };
            let text = format!(
                "until t = {t:e} s {device} {stands} with {:.1e} {unit} of the wrong sign, which rounding beside an enormous Roff or a tiny Ron \
                 hides: the values may be wrong by as much, and a Roff a thousand times smaller tells",
                -g
            );
            self.notes.push(Note::of("wrong-sign", [device], text));
        }
    }

    /// Keeps account of what starts or ends to slide on entering mode `at`: switches on their thresholds, function blocks on
    /// their steps.
    #[cold]
    #[inline(never)]
    fn note_slides(&mut self, table: &ModeTable, at: usize, t: f64) {
        let key = &table.modes[at].key;
        let switches = key.sliding.iter().map(|s| s.0);
        let after = table.thresholds.len();
        let on_step = |pair: usize| key.closed[pair] && !key.closed[pair + 1];
        let steps = table.steps().iter().enumerate();
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
    pub(super) fn close_slides(&mut self, t: f64) {
        for slides in self.slides.values_mut() {
            slides.seconds += t - slides.since.take().unwrap_or(t);
        }
    }

    /// The outcome of a run of `duration` seconds that ends at t, notes about the run as a whole included.
    pub(super) fn finish(&mut self, table: &ModeTable, t: f64, duration: f64) -> Outcome {
        self.note_end(table, t, duration);
        let mut outcome = Outcome {
            notes: std::mem::take(&mut self.notes),
            ..Outcome::default()
        };
        outcome.stats = Stats {
            events: self.events,
            jumps: self.jumps,
            lcp_solves: self.lcp_solves,
            ..table.made()
        };
        outcome
    }

    /// Notes about the run as a whole.
    fn note_end(&mut self, table: &ModeTable, t: f64, duration: f64) {
        self.notes.extend(self.accumulation.end().map(accumulated));
        let thresholds = &table.thresholds;
        for (&i, slides) in &self.slides {
            let seconds = slides.seconds + slides.since.map_or(0.0, |since| t - since);
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
                    &table.steps()[i - thresholds.len()].device,
                    "slides: its input stays where its output jumps, and the output is in between. What is shown is the limit of \
                     ever faster switching; a delay that the circuit leaves out can make another mean",
                ),
            };
            let text = format!(
                "{name} {what} ({} times, first at t = {:e} s, {seconds:e} s in all)",
                slides.count, slides.first
            );
            self.notes.push(Note::of("slides", [name], text));
        }
        let loss = table.modes.iter().map(|m| m.flow.loss).fold(0.0, f64::max);
        let rates = table.modes.iter().filter_map(|mode| mode.fast_sum());
        let fastest = rates.fold(0.0, f64::max);
        if fastest * f64::EPSILON * duration > SLOW_PART {
            let text = format!(
                "several currents or voltages decay together at {fastest:.0e} 1/s, by a Roff or Ron far from all other resistances; what \
                 changes slowly in them may have lost its digits, and the values be wrong: `--verify` or a Roff a thousand times \
                 smaller tells"
            );
            self.notes.push(Note::run("rounding", text));
        }
        if loss > LOSS {
            let text = format!(
                "the circuit is stiff without being graded: the matrix exponential is accurate to about {loss:.0e} a step"
            );
            self.notes.push(Note::run("rounding", text));
        }
    }
}

/// That events accumulated, in words.
fn accumulated(text: String) -> Note {
    Note::run("events-accumulate", text)
}

/// What differs between two modes.
fn label(table: &ModeTable, from: usize, to: usize) -> Arc<[Change]> {
    let [old, new] = [from, to].map(|at| &table.modes[at].key);
    let mut changes: Vec<Change> = Vec::new();
    let thresholds = table.thresholds.iter().enumerate();
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
    for pair in (0..table.pairs).filter(|&pair| new.closed[pair] != old.closed[pair]) {
        let device = table.device(pair).unwrap_or_default();
        if !changes.iter().any(|change| change.name() == device) {
            let own = (0..table.pairs).filter(|&p| table.device(p) == Some(device));
            changes.push(Change::Device {
                name: device.into(),
                conducts: own.into_iter().any(|p| new.closed[p]),
            });
        }
    }
    changes.into()
}

/// Whether some probe has another value `after` than `before`, by more than rounding.
pub(crate) fn row_jumps(before: &[f64], after: &[f64], is_volts: &[bool]) -> bool {
    [true, false].into_iter().any(|volts| {
        let of_kind = || {
            let rows = before.iter().zip(after).zip(is_volts);
            rows.filter(move |(_, v)| **v == volts)
                .map(|(pair, _)| pair)
        };
        let largest = of_kind().fold(0.0_f64, |m, (a, b)| m.max(a.abs()).max(b.abs()));
        of_kind().any(|(a, b)| (a - b).abs() > CONSISTENT * largest)
    })
}
