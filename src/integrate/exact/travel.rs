//! Moving along a mode until a time or until a guard falls through zero.

mod amplitudes;
mod guards;

use super::energy_integral::{Sizes, Stretch};
use super::exosystem::Exosystem;
use super::flow::{Flow, LONG};
use super::magnitudes::Magnitudes;
use super::rounding::resolution;
use super::slaved::Follower;
use crate::linalg::polynomial;
use crate::linalg::refill::refill;
use crate::linalg::series::Series;
use crate::settings::tolerances::events::SIMULTANEOUS;
use crate::settings::tolerances::times::SAME_TIME;
use guards::Verdict;

/// Table steps after which the exosystem is set from its closed form again.
const REFRESH: u32 = 64;

/// As [`f64::max`] where neither is NaN, in one instruction.
#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// A count as a number: of 128 bits at once that is a call.
#[inline]
fn float(count: u128) -> f64 {
    let [low, high] = [count as u64, (count >> u64::BITS) as u64];
    high as f64 * (1_u128 << u64::BITS) as f64 + low as f64
}

/// As [`f64::min`] where neither is NaN.
#[inline]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Steps whose energy waits for the end of the mode, at most.
const MOST_WAITING: usize = 1024;

/// How a stretch ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Arrival {
    /// At the time asked for.
    Reached,
    /// A guard falls through zero here: its row.
    Fired(usize),
    /// The flow left the range of doubles.
    Overflow,
    /// On the way, after as many steps as allowed at a time.
    Resting,
}

/// A step over a span that recurs: its place, where it ends, and how much longer it is than what recurs, s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leap {
    span: usize,
    pub(crate) stop: f64,
    off: f64,
}

/// The state of a run inside a mode: time, `[w | g | g']`, and work space that lives as long as the run.
#[derive(Debug, Clone, Default)]
pub(crate) struct Travel {
    /// Current time, s.
    pub(crate) t: f64,
    /// `[w | g | g']` at `t`.
    pub(crate) now: Vec<f64>,
    /// How long ago the mode was entered, s; the time itself may not resolve it.
    pub(crate) age: f64,
    /// Steps taken.
    pub(crate) steps: u64,
    /// [`Self::advance`] rests here.
    pub(crate) most: u64,
    /// Energy from sources and energy dissipated on Taylor's steps since last taken, J.
    energy: [f64; 2],
    /// The steps of the table and spans since then, and the states w that they began at: their energy waits for the amplitudes of the
    /// whole way.
    waiting: Vec<Stretch>,
    begins: Vec<f64>,
    /// Energy of the run over its duration, W.
    pub(crate) power: f64,
    next: Vec<f64>,
    series: Series,
    /// Work space: what the series' higher terms add up to, how large w can have been, a guard's polynomial, the sizes of its terms.
    sizes: Vec<f64>,
    cubics: Vec<f64>,
    term: Vec<f64>,
    next_term: Vec<f64>,
    /// Largest |w| that noise is measured by; at least `peak`.
    amplitude: Vec<f64>,
    /// Largest |x| met in this mode.
    peak: Vec<f64>,
    floors: Vec<f64>,
    /// How far below zero each guard was on entry, by rounding of the time or of simultaneous events.
    slack: Vec<f64>,
    /// States that follow others some time after the entry, how many of them do by now, and the age at which the next one does, s.
    followers: Vec<Follower>,
    following: usize,
    follows: f64,
    /// See [`Self::settles`].
    pub(crate) steady: bool,
    /// No long step goes beyond, s: there one ended that was not clear.
    barrier: f64,
    since_refresh: u32,
}

impl Travel {
    /// One that stands at `t` in no mode yet.
    pub(crate) fn at(t: f64) -> Self {
        Self {
            t,
            ..Self::default()
        }
    }

    /// Enters a mode at `t` at `[w | g | g']`.
    pub(crate) fn enter(&mut self, flow: &Flow, t: f64, w: &[f64], magnitudes: &Magnitudes) {
        let dim = flow.dim();
        self.t = t;
        self.age = 0.0;
        refill(&mut self.now, w);
        self.next.resize(w.len(), 0.0);
        self.steady = flow.guards() == 0 && flow.step_limit(0.0) >= flow.step(LONG);
        self.barrier = f64::INFINITY;
        refill(&mut self.amplitude, &magnitudes.sizes);
        self.peak.clear();
        self.peak.resize(flow.states(), 0.0);
        self.note_peak();
        let guards = &w[dim..dim + flow.guards()];
        self.slack.clear();
        for g in guards {
            self.slack.push(larger(-g, 0.0));
        }
        self.followers.clone_from(&magnitudes.followers);
        self.following = 0;
        self.note_next_follower();
        refill(&mut self.floors, &magnitudes.noise);
        self.add_slack();
    }

    /// Energy from sources and energy dissipated since last taken, J.
    pub(crate) fn take_energy(&mut self, flow: &mut Flow) -> [f64; 2] {
        if self.waiting.is_empty() {
            return std::mem::take(&mut self.energy);
        }
        let sizes = Sizes {
            amplitude: &self.amplitude,
            power: self.power,
        };
        let begins = self.begins.chunks_exact(flow.dim());
        let stretches = self.waiting.iter().copied().zip(begins);
        let [source, dissipated] = flow.energy(stretches, sizes);
        let energy = [self.energy[0] + source, self.energy[1] + dissipated];
        self.energy = [0.0; 2];
        self.waiting.clear();
        self.begins.clear();
        energy
    }

    /// Moves to `stop` or to the first guard that falls through zero before it.
    #[inline]
    pub(crate) fn advance(&mut self, flow: &mut Flow, exosystem: &Exosystem, stop: f64) -> Arrival {
        let off = stop - self.t - flow.step(LONG);
        if off.abs() <= SAME_TIME * stop.abs() && self.settles(flow) {
            if !flow.leap(LONG, &self.now, &mut self.next) {
                return Arrival::Overflow;
            }
            if self.judge(flow, flow.step(LONG)) == Verdict::Clear {
                self.accept(flow, exosystem, LONG, stop);
                return Arrival::Reached;
            }
        }
        self.crawl(flow, exosystem, stop)
    }

    /// A step over as many output steps as nothing happens on, to `end` at most: their number, at least 2. The run stays where it is
    /// until [`Self::arrive`].
    pub(crate) fn leap_ahead(&mut self, flow: &mut Flow, end: f64) -> Option<usize> {
        if self.t >= self.barrier {
            self.barrier = f64::INFINITY;
        }
        let limit = flow.step_limit(self.age);
        let longest = limit.min(end.min(self.barrier) - self.t);
        let mut level = flow.level_within(0, longest)?;
        loop {
            if !flow.leap(level, &self.now, &mut self.next) {
                return None;
            }
            let step = flow.step(level);
            if self.judge(flow, step) == Verdict::Clear {
                return Some(1 << (LONG - level));
            }
            let part = self.crossing(flow, step).unwrap_or(0.5);
            self.barrier = self.t + part * step;
            level = flow.level_within(level + 1, part * step)?;
        }
    }

    /// Goes along `taken` output steps, to `t`: the whole step of [`Self::leap_ahead`] where that is `count` of them.
    pub(crate) fn arrive(
        &mut self,
        flow: &mut Flow,
        exosystem: &Exosystem,
        taken: usize,
        count: Option<usize>,
        t: f64,
    ) {
        if let Some(count) = count.filter(|count| *count == taken) {
            self.accept(flow, exosystem, LONG - count.ilog2(), t);
        } else {
            for left in (0..taken).rev() {
                // It was clear as part of the long step.
                flow.leap(LONG, &self.now, &mut self.next);
                self.accept(flow, exosystem, LONG, t - left as f64 * flow.step(LONG));
            }
        }
    }

    /// The general case.
    fn crawl(&mut self, flow: &mut Flow, exosystem: &Exosystem, stop: f64) -> Arrival {
        if stop <= self.t {
            return Arrival::Reached;
        }
        match self.leap_span(flow, stop) {
            Some(leap) => self.take_span(flow, exosystem, leap),
            None => {
                let arrival = self.climb(flow, exosystem, stop);
                if arrival != Arrival::Reached {
                    return arrival;
                }
            }
        }
        self.settles(flow);
        Arrival::Reached
    }

    /// One step to `stop` if that span recurs and nothing happens on it. The run stays where it is until [`Self::take_span`].
    pub(crate) fn leap_span(&mut self, flow: &mut Flow, stop: f64) -> Option<Leap> {
        let rest = stop - self.t;
        let same = SAME_TIME * stop.abs();
        // The output step is in the table.
        if rest > flow.step_limit(self.age) || (rest - flow.step(LONG)).abs() <= same {
            return None;
        }
        let span = flow.recurs(rest, same)?;
        let off = flow.leap_span(span, rest, &self.now, &mut self.next);
        let off = off.filter(|_| self.judge(flow, rest) == Verdict::Clear);
        if off.is_none() {
            flow.refuse(span);
        }
        off.map(|off| Leap { span, stop, off })
    }

    /// w at `t` on a span that is known to be clear, if the time until then recurs.
    pub(crate) fn look_ahead(&self, flow: &mut Flow, t: f64, w: &mut Vec<f64>) -> bool {
        let time = t - self.t;
        let Some(span) = flow.recurs(time, SAME_TIME * t.abs()) else {
            return false;
        };
        w.resize(flow.dim(), 0.0);
        flow.go_span(span, time, &self.now, w).is_some()
    }

    /// Ends [`Self::leap_span`].
    pub(crate) fn take_span(&mut self, flow: &mut Flow, exosystem: &Exosystem, leap: Leap) {
        let Leap { span, stop, off } = leap;
        if off != 0.0 && flow.works() {
            let power = flow.power(&self.next);
            for (sum, power) in self.energy.iter_mut().zip(power) {
                *sum += off * power;
            }
        }
        self.wait_for_energy(flow, Stretch::Span(span));
        let rest = stop - self.t;
        self.age += rest;
        let steps = rest / flow.step(LONG);
        let begun = u32::from(f64::from(steps as u32) < steps);
        self.take_next(flow, exosystem, stop, (steps as u32).saturating_add(begun));
    }

    /// Whether steps of the output grid are short enough from here on.
    fn settles(&mut self, flow: &Flow) -> bool {
        self.steady |= flow.step_limit(self.age) >= flow.step(LONG);
        self.steady
    }

    /// Taylor's series for what the table of halved steps does not cover, then table steps that grow from small to large, each halved
    /// where the guards are not clear.
    fn climb(&mut self, flow: &mut Flow, exosystem: &Exosystem, stop: f64) -> Arrival {
        let bottom = flow.bottom();
        let unit = flow.step(bottom);
        let rest = stop - self.t;
        let mut units = (rest / unit).floor();
        let mut fraction = rest - units * unit;
        let negligible = SAME_TIME * stop.abs();
        if unit - fraction <= negligible {
            units += 1.0;
            fraction = 0.0;
        }
        let mut units = units as u128;
        if fraction > negligible.min(rest * 0.5) || units == 0 {
            let end = if units == 0 {
                stop
            } else {
                stop - units as f64 * unit
            };
            match self.taylor(flow, exosystem, fraction, end) {
                Arrival::Reached => {}
                other => return other,
            }
        }
        // The level that was needed, and how many units remain where a guard is expected to fall through zero: no step goes beyond.
        // They are counted, as the time itself may not resolve them.
        let (mut needed, mut barrier) = (0_u32, 0_u128);
        while units > 0 {
            if self.steps > self.most {
                return Arrival::Resting;
            }
            let limit = flow.step_limit(self.age);
            let aligned = bottom - units.trailing_zeros().min(bottom);
            let mut level = aligned.max(needed);
            while level < bottom && flow.step(level) > limit {
                level += 1;
            }
            loop {
                while level < bottom && 1_u128 << (bottom - level) > units - barrier {
                    level += 1;
                }
                let span = 1_u128 << (bottom - level);
                let end = if units == span {
                    stop
                } else {
                    stop - float(units - span) * unit
                };
                let mut clear = false;
                if span <= units - barrier {
                    if !flow.leap(level, &self.now, &mut self.next) {
                        return Arrival::Overflow;
                    }
                    clear = self.judge(flow, flow.step(level)) == Verdict::Clear;
                }
                if clear {
                    self.accept(flow, exosystem, level, end);
                    needed = needed.saturating_sub(1);
                } else if let Some(guard) = self.fallen(flow, flow.step(level)) {
                    return Arrival::Fired(guard);
                } else if level == bottom {
                    match self.taylor(flow, exosystem, unit, end) {
                        Arrival::Reached => barrier = 0,
                        other => return other,
                    }
                } else {
                    match self.crossing(flow, flow.step(level)) {
                        // A part of 1 and rounding may be more units than are left.
                        Some(part) => {
                            barrier = units.saturating_sub((part * span as f64) as u128);
                        }
                        None => needed = level + 1,
                    }
                    level += 1;
                    continue;
                }
                units -= span;
                break;
            }
        }
        Arrival::Reached
    }

    /// One Taylor step over `dt` ≤ h/2^K to `end`, which differs from that by what the time does not resolve; every guard is
    /// followed as a polynomial, so nothing hides.
    fn taylor(&mut self, flow: &mut Flow, exosystem: &Exosystem, dt: f64, end: f64) -> Arrival {
        let (dim, m) = (flow.dim(), flow.guards());
        flow.expand(&mut self.series, &self.now, dt);
        self.series.at(1.0, &mut self.next[..dim]);
        if !self.next[..dim].iter().all(|v| v.is_finite()) {
            return Arrival::Overflow;
        }
        let mut first = (1.0, None);
        flow.guard_cubics(&self.series, &mut self.sizes, &mut self.cubics);
        for i in 0..m {
            let [g, slope] = [0, m].map(|from| self.now[dim + from + i]);
            let [second, third, rest] = [0, m, 2 * m].map(|from| self.cubics[from + i]);
            let floor = self.floors[i];
            if polynomial::cubic_holds([g, slope * dt, second, third], rest, floor) {
                continue;
            }
            let mut coefficients = flow.guard_polynomial(i, &self.series);
            // A slope that is rounding beside a curvature that is not makes no crossing.
            let [_, slope, curvature, ..] = &mut coefficients;
            if *slope < 0.0 && -*slope <= self.floors[m + i] * dt && *curvature > 0.0 {
                *slope = 0.0;
            }
            let coefficients = &mut coefficients[..=self.series.degree()];
            if g <= floor {
                let work = (&mut self.term, &mut self.next_term);
                let times = [dt, resolution(self.t)];
                let zero = (times, SIMULTANEOUS * floor);
                flow.settle_polynomial(i, coefficients, &self.amplitude, zero, work);
            }
            let crossing = polynomial::first_crossing(coefficients, floor);
            if let Some(s) = crossing.filter(|&s| s < first.0 || first.1.is_none()) {
                first = (s, Some(i));
            }
        }
        let (s, fired) = first;
        let t = if fired.is_some() {
            self.t + s * dt
        } else {
            end
        };
        if flow.works() {
            let energy = flow.energy_of_series(&self.series, s, s * dt);
            for (sum, energy) in self.energy.iter_mut().zip(energy) {
                *sum += energy;
            }
        }
        if fired.is_some() {
            self.series.at(s, &mut self.next[..dim]);
        }
        std::mem::swap(&mut self.now, &mut self.next);
        self.t = t;
        self.age += s * dt;
        self.steps += 1;
        let n = dim - exosystem.dim();
        exosystem.write(t, &mut self.now[n..dim]);
        flow.read_guards(&mut self.now);
        self.refresh_noise(flow);
        fired.map_or(Arrival::Reached, Arrival::Fired)
    }

    #[inline]
    fn accept(&mut self, flow: &mut Flow, exosystem: &Exosystem, level: u32, t: f64) {
        self.wait_for_energy(flow, Stretch::Table(level));
        self.age += flow.step(level);
        self.take_next(flow, exosystem, t, 1_u32 << LONG.saturating_sub(level));
    }

    /// Remembers that the energy of a stretch from `now` is to be taken.
    #[inline]
    fn wait_for_energy(&mut self, flow: &mut Flow, stretch: Stretch) {
        if flow.works() {
            if self.waiting.len() == MOST_WAITING {
                self.energy = self.take_energy(flow);
            }
            self.waiting.push(stretch);
            self.begins.extend_from_slice(&self.now[..flow.dim()]);
        }
    }

    /// Stands at `next` and t; what the exosystem accumulates counts as that of so many steps.
    #[inline]
    fn take_next(&mut self, flow: &Flow, exosystem: &Exosystem, t: f64, steps: u32) {
        std::mem::swap(&mut self.now, &mut self.next);
        self.note_peak();
        self.t = t;
        self.steps += 1;
        self.since_refresh += steps;
        if self.since_refresh >= REFRESH || self.age >= self.follows {
            let n = flow.dim() - exosystem.dim();
            exosystem.write(t, &mut self.now[n..flow.dim()]);
            flow.read_guards(&mut self.now);
            self.refresh_noise(flow);
        }
    }
}
