//! A run in steps, made linear along its way.
//!
//! Between two instants at which switches move or sources have corners, the variational equation δx' = A(t) δx + E(t) δu has the tangents of curved
//! laws in it. Part by part A and E stand for what they are in the middle of it, with the exponential of A: the exponential midpoint rule, of
//! order 2 (the first term of the Magnus expansion: S. Blanes, F. Casas, J. A. Oteo, J. Ros, Physics Reports 470 (2009)). Parts twice as long tell its
//! error.

mod parts;

use std::sync::atomic::AtomicBool;

use self::parts::Touch;
use super::instant::Inputs;
use super::saltation::Side;
use super::system::System;
use super::tangent::{own_resistance, points};
use super::{Saltation, Segment, Timing, Trajectory, not_smooth, same_timing};
use crate::integrate::exact::{Assembler, Owner};
use crate::integrate::switching::{Threshold, fire};
use crate::integrate::theta::Instant;
use crate::integrate::{Change, Error, Event, Simulation};
use crate::lcs::{Hold, Input, Lcs};
use crate::settings::tolerances::events::{AT_LEVEL, GRAZING};
use crate::settings::tolerances::jumps::FOLLOWS_JUMP_IN_STEPS;
use crate::settings::tolerances::periodic::{BEFORE_EVENT, BEHIND_EVENT, LINEAR_PARTS};
use crate::settings::tolerances::times::SAME_TIME;

/// A run in steps, from instant to instant.
struct Way<'a> {
    simulation: &'a mut Simulation,
    /// Ends the run when set.
    cancel: Option<&'a AtomicBool>,
    thresholds: Vec<Threshold>,
    assembler: Assembler,
    /// Systems in which devices are open, in positions of the switches.
    opened: Vec<(Vec<Hold>, Vec<bool>, Lcs)>,
    /// The length of a part, s, times within which are one, and where the run ends.
    part: f64,
    same: f64,
    until: f64,
    /// See [`Self::resistance`].
    resistance: f64,
    /// See [`Linearised`].
    unknown: f64,
}

/// A time at which switches move, or sources alone have corners.
#[derive(Debug, Clone, Copy)]
struct Stop {
    t: f64,
    moves: bool,
}

/// An instant at which switches move or sources have corners, and what touches the run on its two sides.
struct Passed {
    before: Touch,
    saltation: Saltation,
    after: Touch,
}

/// What is made of the parts: of each as a whole, or of its halves.
#[derive(Default)]
struct Made {
    systems: Vec<System>,
    segments: Vec<Segment>,
    saltations: Vec<Saltation>,
}

/// A run in steps made linear.
pub(crate) struct Linearised {
    /// In halves of parts and in whole ones.
    pub(crate) trajectories: [Trajectory; 2],
    /// How long tangents are not known, as they change within the shortest parts, s.
    pub(crate) unknown: f64,
}

impl Trajectory {
    /// The run of a simulation in steps from a place, as for [`Simulation::stand_at`], until a time or until `cancel` is set: in [`LINEAR_PARTS`] parts or more.
    ///
    /// # Errors
    /// [`Reason::NotSmooth`](crate::integrate::Reason::NotSmooth) where the state jumps, or an event has no derivative; else the simulation's.
    pub(crate) fn of_steps(
        simulation: &mut Simulation,
        (from, state, switches): (f64, &[f64], &[bool]),
        until: f64,
        cancel: Option<&AtomicBool>,
    ) -> Result<Linearised, Error> {
        let assembler = simulation.opener(until - from);
        let mut way = Way {
            thresholds: assembler.thresholds(),
            assembler,
            opened: Vec::new(),
            part: (until - from) / LINEAR_PARTS,
            same: SAME_TIME * from.abs().max(until.abs()),
            resistance: 1.0,
            unknown: 0.0,
            simulation,
            cancel,
            until,
        };
        way.simulation.stand_at(from, state, switches)?;
        way.resistance = way.resistance()?;
        way.simulation.stand_at(from, state, switches)?;
        let stops = way.stops()?;
        way.simulation.stand_at(from, state, switches)?;
        let mut both = [Made::default(), Made::default()];
        for stop in stops {
            way.stretch(stop, &mut both)?;
        }
        let (same, unknown) = (way.same, way.unknown);
        let trajectories = both.map(|made| Self {
            systems: made.systems,
            segments: made.segments,
            saltations: made.saltations,
            same,
        });
        Ok(Linearised {
            trajectories,
            unknown,
        })
    }
}

impl Way<'_> {
    fn go_to(&mut self, t: f64) -> Result<(), Error> {
        self.simulation.advance(t, false, self.cancel).map(drop)
    }

    fn instant(&mut self) -> Result<Instant, Error> {
        let t = self.simulation.time();
        let found = self.simulation.instant()?;
        found.ok_or_else(|| not_smooth(t, "it is exact in part"))
    }

    /// The largest voltage of the devices on the way from here over their largest current, Ω.
    fn resistance(&mut self) -> Result<f64, Error> {
        let (from, mut sizes) = (self.simulation.time(), (0.0_f64, 0.0_f64));
        for k in 1..LINEAR_PARTS as usize {
            self.go_to(from + k as f64 * self.part)?;
            for (v, i) in points(&self.instant()?) {
                sizes = (sizes.0.max(v.abs()), sizes.1.max(i.abs()));
            }
        }
        Ok(own_resistance(sizes))
    }

    /// All stops from here on, the end included.
    fn stops(&mut self) -> Result<Vec<Stop>, Error> {
        let inputs = self.instant()?.lcs.inputs.clone();
        let (from, end) = (self.simulation.time(), self.until - self.same);
        let mut stops = Vec::new();
        for input in inputs {
            let next = |t: &f64| input.source.next_breakpoint(*t);
            let corners = std::iter::successors(next(&from), next).take_while(|t| *t < end);
            stops.extend(corners.map(|t| Stop { t, moves: false }));
        }
        loop {
            let stop = self.simulation.advance(self.until, true, self.cancel)?;
            let moves = stop.events.iter().filter(|event| is_switching(event));
            let moves = moves.map(|event| Stop {
                t: event.t,
                moves: true,
            });
            stops.extend(moves.filter(|stop| stop.t < end));
            if stop.time >= self.until {
                break;
            }
        }
        stops.sort_by(|a, b| a.t.total_cmp(&b.t));
        stops.dedup_by(|next, first| {
            let one = next.t - first.t <= self.same;
            first.moves |= one && next.moves;
            one
        });
        let (t, moves) = (self.until, false);
        stops.push(Stop { t, moves });
        Ok(stops)
    }

    /// The parts from here to a stop, and what happens there.
    fn stretch(&mut self, stop: Stop, both: &mut [Made; 2]) -> Result<(), Error> {
        let begin = self.simulation.time();
        let switches = self.simulation.positions();
        let count = ((stop.t - begin) / self.part).ceil().max(1.0) as usize;
        let mut parts = self.march((begin, stop.t), count, &switches)?;
        if self.simulation.positions() != switches {
            let what = "a switch moves at another time in a run with other steps";
            return Err(not_smooth(begin, what));
        }
        let Some(last) = parts.last() else {
            return Ok(());
        };
        let passed = if stop.t >= self.until {
            None
        } else if stop.moves {
            let quarter = 0.25 * (last.to - last.from);
            Some(self.switching((stop.t, quarter), &switches)?)
        } else {
            Some(self.corner(stop.t, &last.touches[2])?)
        };
        let end = match passed {
            Some(_) => self.simulation.time(),
            None => stop.t,
        };
        let (state, after) = (self.simulation.state(), self.simulation.positions());
        if self.refine(&mut parts, &switches)? && passed.is_some() {
            self.simulation.stand_at(end, &state, &after)?;
        }
        if let Some(last) = parts.last_mut() {
            last.to = end;
        }
        let [halves, whole] = both;
        for part in parts {
            let [first, middle, last] = part.touches;
            let half = middle.t;
            halves.part(first, (part.from, half), self.same)?;
            halves.part(last, (half, part.to), self.same)?;
            whole.part(middle, (part.from, part.to), self.same)?;
        }
        if let Some(passed) = passed {
            for made in both {
                made.part(passed.before.clone(), (end, end), self.same)?;
                made.saltations.push(passed.saltation.clone());
                made.part(passed.after.clone(), (end, end), self.same)?;
            }
        }
        Ok(())
    }

    /// Goes on to a corner of sources behind a part.
    fn corner(&mut self, t: f64, last: &Touch) -> Result<Passed, Error> {
        self.go_to(t)?;
        let next = self.touch(&last.system.key.switches)?;
        let [left, right] = self.limits(t, &last.system)?;
        let (before, after) = (last.side(left), next.side(right));
        let saltation = Saltation::of(t, (&before, &after), None, None);
        Ok(Passed {
            before: last.clone(),
            saltation,
            after: next,
        })
    }

    /// Goes on to where switches move, at about `t`, a quarter of a part after the last place.
    fn switching(&mut self, (t, quarter): (f64, f64), left: &[bool]) -> Result<Passed, Error> {
        self.go_to(t - BEFORE_EVENT * quarter)?;
        let mut near = self.touch(left)?;
        let events = loop {
            let stop = self.simulation.advance(t + quarter, true, self.cancel)?;
            if stop.events.iter().any(is_switching) {
                break stop.events;
            }
            if stop.time >= t + quarter {
                let what = "a switch moves at another time in a run with other steps";
                return Err(not_smooth(t, what));
            }
        };
        let (t, switches) = self.moved(&events, left);
        let [inputs, right] = self.limits(t, &near.system)?;
        let rate = near.system.rate(&near.x, &inputs.u);
        near.x += rate * (t - near.t);
        let before = near.side(inputs);
        // The step in which it happened ends later; at the instant itself rounding may have a control on its other side.
        let storage = before.system.storage(&before.x, &before.inputs.u);
        let behind = t + BEHIND_EVENT * quarter;
        self.simulation
            .stand_at(behind, storage.as_slice(), &switches)?;
        let next = self.touch(&switches)?;
        let after = next.side(right);
        let led = after.system.state(storage.as_slice());
        let size = led.amax().max(after.x.amax());
        if (&led - &after.x).amax() > FOLLOWS_JUMP_IN_STEPS * size {
            let what = "the state jumps in steps, which have no derivative there";
            return Err(not_smooth(t, what));
        }
        let moved = (0..left.len()).filter(|&i| left[i] != switches[i]);
        let timing = self.timing((t, quarter), &before, moved)?;
        let saltation = Saltation::of(t, (&before, &after), timing, None);
        Ok(Passed {
            before: near,
            saltation,
            after: next,
        })
    }

    /// When the first switches move, s, and how all stand then: the step in which they do so may see more.
    fn moved(&self, events: &[Event], left: &[bool]) -> (f64, Vec<bool>) {
        let mut switches = left.to_vec();
        let mut moving = events.iter().filter(|event| is_switching(event));
        let t = moving.next().map_or(0.0, |event| event.t);
        let now = events
            .iter()
            .filter(|event| (event.t - t).abs() <= self.same);
        for change in now.flat_map(|event| event.changes.iter()) {
            let Change::Switch { name, on } = change else {
                continue;
            };
            let all = self.thresholds.iter().zip(&mut switches);
            all.filter(|(threshold, _)| threshold.name == **name)
                .for_each(|(_, position)| *position = *on);
        }
        fire(&self.thresholds, &mut switches);
        (t, switches)
    }

    fn limits(&self, t: f64, system: &System) -> Result<[Inputs; 2], Error> {
        let inputs = &system.lcs.inputs;
        let (left, right) = (
            Inputs::before(inputs, t, self.same),
            Inputs::after(inputs, t, self.same),
        );
        let both = left.zip(right).map(|(left, right)| [left, right]);
        both.ok_or_else(|| not_smooth(t, "a source has no closed form"))
    }

    /// When these switches move: by the guard that is at zero.
    fn timing(
        &self,
        (t, seconds): (f64, f64),
        before: &Side<'_>,
        moved: impl Iterator<Item = usize>,
    ) -> Result<Option<Timing>, Error> {
        let rate = before.rate();
        let mut found: Option<Timing> = None;
        for i in moved.filter(|&i| !self.thresholds[i].is_rest()) {
            let owner = Owner::Switch(i);
            let guards = before
                .system
                .guards(owner, (&self.thresholds, |_| (0.0, 0.0)));
            for guard in guards {
                let (value, size) = guard.value(&before.x, &before.inputs);
                let (slope, slopes) = guard.rate(&rate, &before.inputs);
                // What follows another switch, or an edge, is not at its level.
                if value.abs() > AT_LEVEL * (size + slopes * seconds) || slopes == 0.0 {
                    continue;
                }
                let name = &self.thresholds[i].name;
                if slope.abs() <= GRAZING * slopes {
                    return Err(not_smooth(t, format!("{name} grazes its threshold")));
                }
                let timing = Timing::of((owner, 0), &guard, slope);
                if let Some(other) = &found
                    && !same_timing(other, &timing, seconds)
                {
                    return Err(not_smooth(t, format!("{name} and another event coincide")));
                }
                found = Some(timing);
            }
        }
        let is_edge = |input: &Input| input.source.is_edge(t);
        if found.is_none() && !before.system.lcs.inputs.iter().any(is_edge) {
            let what = "when a switch moves does not follow from its control";
            return Err(not_smooth(t, what));
        }
        Ok(found)
    }
}

impl Made {
    /// Adds a part from one time to another; between two in which other devices carry a current what is interrupted is gone.
    fn part(&mut self, touch: Touch, (from, to): (f64, f64), same: f64) -> Result<(), Error> {
        let propagator = touch.system.propagator(to - from).ok_or_else(|| {
            not_smooth(from, "the exponential of a mode does not exist in doubles")
        })?;
        if self.segments.len() > self.saltations.len()
            && let (Some(last), Some(segment)) = (self.systems.last(), self.segments.last())
        {
            let between = if last.key == touch.system.key {
                Saltation::none(from, &touch.system)
            } else {
                let inputs = Inputs::after(&touch.system.lcs.inputs, from, same);
                let inputs =
                    inputs.ok_or_else(|| not_smooth(from, "a source has no closed form"))?;
                let before = Side {
                    system: last,
                    x: segment.end.clone(),
                    inputs: inputs.clone(),
                };
                Saltation::of(from, (&before, &touch.side(inputs)), None, None)
            };
            self.saltations.push(between);
        }
        let Touch { system, x, .. } = touch;
        self.segments.push(Segment {
            system: self.systems.len(),
            from,
            to,
            start: x.clone(),
            propagator,
            end: x,
            resting: Vec::new(),
        });
        self.systems.push(system);
        Ok(())
    }
}

/// Whether a switch moves.
fn is_switching(event: &Event) -> bool {
    let mut changes = event.changes.iter();
    changes.any(|change| matches!(change, Change::Switch { .. }))
}
