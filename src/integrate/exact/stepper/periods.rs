//! Periods taken together: a run that clocks alone lead through the same modes period by period goes on by its stroboscopic map.
//!
//! Along a leg of a period w moves by exp(𝒜 τ), and from one leg to the next the storage is kept, so that w after a period is P w before it. The guards
//! where legs begin and end are rows over that w, too: a period is taken where they stay clear of zero by more than a step asks for, and what is
//! less clear is left to steps.

use std::sync::Arc;

use super::{Exact, MOST_PASSAGES};
use crate::integrate::exact::passage::Passage;
use crate::integrate::exact::plant::ModeTable;
use crate::linalg::kernel::Kernel;
use crate::settings::tolerances::events::{CERTAIN, CLEAR_OF_ZERO};
use crate::settings::tolerances::jumps::CONSISTENT;
use crate::settings::tolerances::times::SAME_TIME;

/// Legs of a period at most.
const MOST_LEGS: usize = 64;
/// Periods that are taken together at most: the next one goes leg by leg, and amplitudes and sources are read anew.
const TOGETHER: usize = 127;
/// Changes of mode to wait for where the first period was not clear.
const PATIENCE: usize = 64;

/// A change of mode by clocks alone, and how many steps were made before it.
#[derive(Debug, Clone, Copy)]
struct Change {
    t: f64,
    mode: usize,
    steps: u64,
}

/// From one change of mode to the next.
#[derive(Debug)]
struct Leg {
    mode: usize,
    /// How long it takes, s.
    seconds: f64,
    /// Rounding of its guards and of their slopes.
    noise: Vec<f64>,
}

/// The stroboscopic map from a change of mode to the same one a period later.
#[derive(Debug)]
struct PeriodMap {
    legs: Vec<Leg>,
    /// w after the period, below it by leg `[g | g']` where it begins and ends, and by leg the storage where it ends, over w before it.
    map: Kernel,
    dim: usize,
    after: Vec<f64>,
    /// Where the storage begins in these rows.
    ends: usize,
    /// The storage where legs end, period by period, of those taken last.
    passed: Vec<f64>,
}

/// What a run knows of its periods.
#[derive(Debug)]
pub(super) struct Periods {
    /// s.
    period: f64,
    /// Since a period ago.
    changes: Vec<Change>,
    map: Option<PeriodMap>,
    /// Changes of mode to wait for.
    wait: usize,
    /// Jumps of the run so far.
    jumps: u64,
    /// Periods taken together so far.
    taken: u64,
}

impl PeriodMap {
    /// That of these changes of mode, of which the last one is the first again. `None` where a leg does not recur, a mode exists where something
    /// vanishes, which is asked whenever it is entered, or an exponential does not exist in doubles. Of the storage where legs end it keeps so many values.
    fn of(table: &mut ModeTable, changes: &[Change], kept: usize) -> Option<Self> {
        let mut legs = Vec::new();
        let mut spans = Vec::new();
        for pair in changes.windows(2) {
            let (mode, seconds) = (pair[0].mode, pair[1].t - pair[0].t);
            let own = &mut table.modes[mode];
            if !own.constraints.is_empty() {
                return None;
            }
            spans.push(own.flow.recurs(seconds, SAME_TIME * pair[1].t)?);
            let noise = own.magnitudes.noise.clone();
            legs.push(Leg {
                mode,
                seconds,
                noise,
            });
        }
        let dim = table.modes[legs.first()?.mode].flow.dim();
        let ends = dim + legs.iter().map(|leg| 2 * leg.noise.len()).sum::<usize>();
        let rows = ends + legs.len() * kept;
        let mut exists = true;
        let map = Kernel::of_columns(rows, dim, |j, column| {
            let (own, ends) = column.split_at_mut(ends);
            exists &= along(table, &legs, &spans, j, (own, ends)).is_some();
        });
        exists.then(|| Self {
            legs,
            map,
            dim,
            after: vec![0.0; rows],
            ends,
            passed: Vec::new(),
        })
    }

    /// Whether it is that of these changes.
    fn is_of(&self, changes: &[Change]) -> bool {
        let mut pairs = changes.windows(2).zip(&self.legs);
        changes.len() == self.legs.len() + 1
            && pairs.all(|(pair, leg)| {
                let off = pair[1].t - pair[0].t - leg.seconds;
                pair[0].mode == leg.mode && off.abs() <= SAME_TIME * pair[1].t
            })
    }

    /// Takes w along as many periods as are clear, `most` at most: how many.
    fn go(&mut self, w: &mut [f64], most: usize) -> usize {
        self.passed.clear();
        for taken in 0..most {
            self.map.apply(w, &mut self.after);
            if !self.is_clear() {
                return taken;
            }
            w.copy_from_slice(&self.after[..self.dim]);
            self.passed.extend_from_slice(&self.after[self.ends..]);
        }
        most
    }

    /// The changes of mode in the periods taken last, of which the first one began at `t`; nothing where the storage is not kept.
    fn passages(&self, table: &ModeTable, t: f64, period: f64) -> impl Iterator<Item = Passage> {
        let stored = (self.after.len() - self.ends) / self.legs.len();
        let key = |leg: &Leg| Arc::clone(&table.modes[leg.mode].key);
        let mut age = 0.0;
        let storages = self.passed.chunks_exact(stored.max(1)).enumerate();
        storages.map(move |(passed, storage)| {
            let (whole, k) = (passed / self.legs.len(), passed % self.legs.len());
            age = self.legs[k].seconds + if k > 0 { age } else { 0.0 };
            Passage {
                t: t + (whole as f64 * period + age),
                from: Some(key(&self.legs[k])),
                to: key(&self.legs[(k + 1) % self.legs.len()]),
                cause: None,
                before: storage.to_vec(),
                after: storage.to_vec(),
            }
        })
    }

    /// Whether all guards stay clear of zero: by the cubics through values and slopes.
    fn is_clear(&self) -> bool {
        let mut guards = &self.after[self.dim..];
        self.legs.iter().all(|leg| {
            let (own, others) = guards.split_at(2 * leg.noise.len());
            guards = others;
            let count = leg.noise.len() / 2;
            let third = leg.seconds / 3.0;
            (0..count).all(|i| {
                let [g0, s0, g1, s1] = [0, 1, 2, 3].map(|part| own[part * count + i]);
                let cubic = [g0, g0 + third * s0, g1 - third * s1, g1];
                let low = cubic.into_iter().fold(f64::INFINITY, f64::min);
                let high = cubic.into_iter().fold(f64::NEG_INFINITY, f64::max);
                let noise = leg.noise[i] + third * leg.noise[count + i];
                low > CLEAR_OF_ZERO * (high - low) + CERTAIN * noise
            })
        })
    }
}

/// Column j of [`PeriodMap::map`]; `None` also where a leg begins with another storage than the one before it ended with, and by chance did not this time.
fn along(
    table: &mut ModeTable,
    legs: &[Leg],
    spans: &[usize],
    j: usize,
    (column, mut ends): (&mut [f64], &mut [f64]),
) -> Option<()> {
    let first = &table.modes[legs[0].mode].flow;
    let (mut w, mut next) = (vec![0.0; first.dim() + 2 * first.guards()], Vec::new());
    let [mut storage, mut kept, mut work] = [const { Vec::new() }; 3];
    let stored = ends.len() / legs.len();
    let (own, mut rows) = column.split_at_mut(first.dim());
    w[j] = 1.0;
    for (k, (leg, span)) in legs.iter().zip(spans).enumerate() {
        let mode = &mut table.modes[leg.mode];
        let dim = mode.flow.dim();
        mode.flow.read_guards(&mut w);
        next.resize(w.len(), 0.0);
        let flow = &mut mode.flow;
        flow.leap_span(*span, leg.seconds, &w[..dim], &mut next)?;
        for guards in [&w[dim..], &next[dim..]] {
            let (here, others) = rows.split_at_mut(guards.len());
            here.copy_from_slice(guards);
            rows = others;
        }
        mode.storage_at(&next, &mut storage);
        let (here, others) = ends.split_at_mut(stored);
        here.copy_from_slice(&storage[..stored]);
        ends = others;
        let sources = &next[mode.n..dim];
        let to = &table.modes[legs[(k + 1) % legs.len()].mode];
        to.state_from_part(&storage, sources[0], &mut w);
        w.extend_from_slice(sources);
        to.settle(&mut w, &mut work);
        if !to.keeps {
            to.storage_at(&w, &mut kept);
            let largest = storage.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
            let moved = |(a, b): (&f64, &f64)| {
                (a - b).abs() > CONSISTENT * a.abs().max(b.abs()) + f64::EPSILON * largest
            };
            if storage.iter().zip(&kept).any(moved) {
                return None;
            }
        }
        w.resize(to.flow.dim() + 2 * to.flow.guards(), 0.0);
    }
    own.copy_from_slice(&w[..own.len()]);
    Some(())
}

impl Exact {
    /// Has the run take periods together from here on. What happens in them is counted and told as passages alone, and energy is not integrated.
    pub(crate) fn take_periods(&mut self) {
        self.periods = self.sources.period().map(|period| Periods {
            period,
            changes: Vec::new(),
            map: None,
            wait: 0,
            jumps: self.report.jumps,
            taken: 0,
        });
    }

    /// Each change of mode is told from here on; how many periods were taken together.
    pub(crate) fn leave_periods(&mut self) -> u64 {
        self.periods.take().map_or(0, |periods| periods.taken)
    }

    /// Takes note that clocks alone have changed the mode now, or that something else has happened, and takes as many periods together as
    /// can be until a time.
    pub(super) fn note_change(&mut self, clocked: bool, until: f64) {
        let Some(mut periods) = self.periods.take() else {
            return;
        };
        let jumps = self.report.jumps;
        let jumped = std::mem::replace(&mut periods.jumps, jumps) != jumps;
        match self.mode.filter(|_| clocked && !jumped && !self.corner) {
            Some(mode) if self.key.sliding.is_empty() && !self.table.modes[mode].flow.works() => {
                self.go_periods(&mut periods, mode, until);
            }
            _ => periods.changes.clear(),
        }
        self.periods = Some(periods);
    }

    fn go_periods(&mut self, periods: &mut Periods, mode: usize, until: f64) {
        let (t, steps, period) = (self.travel.t, self.travel.steps, periods.period);
        let changes = &mut periods.changes;
        let same = SAME_TIME * t;
        if changes.last().is_some_and(|last| last.steps + 1 != steps) {
            changes.clear();
        }
        changes.push(Change { t, mode, steps });
        let before = |change: &&Change| change.t < t - period - same;
        let older = changes.iter().take_while(before).count();
        changes.drain(..older);
        periods.wait = periods.wait.saturating_sub(1);
        let first = changes[0];
        let whole = (t - period - first.t).abs() <= same && first.mode == mode;
        // One is left to arrive at what comes then.
        let recurs = |next: f64| {
            let mut changes = changes.iter();
            changes.any(|change| (change.t + period - next).abs() <= same)
        };
        let last = until.min(self.sources.next_other(recurs)) - t;
        let most = ((last / period) as usize).saturating_sub(1).min(TOGETHER);
        if !whole || changes.len() > MOST_LEGS || periods.wait > 0 || most == 0 {
            return;
        }
        if !periods.map.as_ref().is_some_and(|map| map.is_of(changes)) {
            let kept = self.passages.as_ref().map(|_| self.storage.values.len());
            periods.map = PeriodMap::of(&mut self.table, changes, kept.unwrap_or(0));
        }
        let Some(map) = &mut periods.map else {
            return;
        };
        let mut w = self.travel.now[..map.dim].to_vec();
        let taken = map.go(&mut w, most);
        let (legs, ahead) = (map.legs.len(), map.legs[0].seconds);
        let later = t + taken as f64 * period;
        if taken == 0 || !self.skip(mode, w, (later, ahead)) {
            periods.wait = PATIENCE;
            return;
        }
        if let Some(passages) = &mut self.passages {
            let room = MOST_PASSAGES.saturating_sub(passages.len());
            passages.extend(map.passages(&self.table, t, period).take(room));
        }
        let passed = (taken * legs) as u64;
        self.travel.steps += passed;
        self.report.count_events(passed);
        periods.taken += taken as u64;
        changes.clear();
        changes.push(Change {
            t: self.travel.t,
            mode,
            steps: self.travel.steps,
        });
    }

    /// Stands at w in the present mode at a later time, so many seconds `ahead` of the next change; `false`, and nothing is moved, where
    /// the clocks differ.
    fn skip(&mut self, mode: usize, mut w: Vec<f64>, (t, ahead): (f64, f64)) -> bool {
        let places = (&*self.table.thresholds, &*self.key.switches);
        if !self.sources.skip(places, (t, ahead), self.until) {
            return false;
        }
        // The time resolves less than it did in the period of the map.
        let t = self.sources.next_stop - ahead;
        self.sources.stand(t);
        let mode = &self.table.modes[mode];
        w[mode.n..].copy_from_slice(&self.sources.z);
        let mut values = Vec::new();
        mode.storage_at(&w, &mut values);
        self.storage.set(&values);
        w.resize(mode.flow.dim() + 2 * mode.flow.guards(), 0.0);
        mode.flow.read_guards(&mut w);
        self.travel.enter(&mode.flow, t, &w, &mode.magnitudes);
        self.inspector.forget_slips();
        self.memory.left_here.clear();
        true
    }
}
