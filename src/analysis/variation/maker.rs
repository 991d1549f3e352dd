//! A run is made into a trajectory: its segments, and a saltation between each and the next.

use nalgebra::{DMatrix, DVector};

use super::instant::Inputs;
use super::saltation::Side;
use super::{Resting, Saltation, Segment, System, Timing, Trajectory, not_smooth};
use crate::integrate::exact::{Assembler, Key, Owner, Passage};
use crate::integrate::switching::Threshold;
use crate::integrate::{Error, Reason, Simulation};
use crate::settings::tolerances::events::{AT_LEVEL, GRAZING, SAME_TIMING};
use crate::settings::tolerances::jumps::FOLLOWS_JUMP;
use crate::settings::tolerances::times::SAME_TIME;

/// Where a run is made into a [`Trajectory`].
pub(super) struct Maker {
    assembler: Assembler,
    thresholds: Vec<Threshold>,
    pub(super) systems: Vec<System>,
    /// Times within this are one, s.
    same: f64,
    /// The sources with which events have derivatives besides those with the state; `None` where guards that fall through zero at one instant need
    /// not do so whatever varies.
    pub(super) sources: Option<Vec<String>>,
}

impl Maker {
    pub(super) fn of(simulation: &Simulation, (from, until): (f64, f64)) -> Self {
        let assembler = simulation.assembler(until - from);
        Self {
            thresholds: assembler.thresholds(),
            assembler,
            systems: Vec::new(),
            sources: None,
            same: SAME_TIME * from.abs().max(until.abs()),
        }
    }

    /// The place of a mode's system.
    fn system(&mut self, key: &Key) -> Result<usize, Error> {
        if let Some(known) = self.systems.iter().position(|system| system.key == *key) {
            return Ok(known);
        }
        self.systems.push(System::of(key, &mut self.assembler)?);
        Ok(self.systems.len() - 1)
    }

    pub(super) fn make(
        mut self,
        passages: &[Passage],
        end: (f64, &[f64]),
    ) -> Result<Trajectory, Error> {
        let same = self.same;
        let mut instants = passages.chunk_by(|a, b| b.t - a.t <= same);
        let Some([.., first]) = instants.next() else {
            let what = "a run in no mode";
            return Err(Error::before(Reason::internal("analysis::variation", what)));
        };
        let (mut at, mut entry) = (self.system(&first.to)?, first.t);
        let mut start = self.systems[at].state(&first.after);
        let (mut segments, mut saltations) = (Vec::new(), Vec::new());
        for instant in instants {
            let (first, last) = (&instant[0], &instant[instant.len() - 1]);
            segments.push(self.segment(at, entry, start, (first.t, &first.before))?);
            let next = self.system(&last.to)?;
            saltations.push(self.saltation(instant, (at, next), first.t - entry)?);
            start = self.systems[next].state(&last.after);
            (at, entry) = (next, last.t);
        }
        segments.push(self.segment(at, entry, start, end)?);
        Ok(Trajectory {
            systems: self.systems,
            segments,
            saltations,
            same: self.same,
        })
    }

    fn segment(
        &self,
        system: usize,
        from: f64,
        start: DVector<f64>,
        (to, end): (f64, &[f64]),
    ) -> Result<Segment, Error> {
        let of = &self.systems[system];
        let propagator = if self.sources.is_none() {
            Some(DMatrix::default())
        } else {
            of.propagator(to - from)
        };
        let end = of.state(end);
        Ok(Segment {
            resting: self.resting(of, to, &end),
            system,
            from,
            to,
            start,
            propagator: propagator.ok_or_else(|| {
                not_smooth(from, "the exponential of a mode does not exist in doubles")
            })?,
            end,
        })
    }

    /// Guards of devices that are zero in a mode and stay so: a change of a value may move them off to one side alone.
    fn resting(&self, system: &System, t: f64, x: &DVector<f64>) -> Vec<Resting> {
        if self.sources.is_some() {
            return Vec::new();
        }
        let Some(inputs) = Inputs::before(&system.lcs.inputs, t, self.same) else {
            return Vec::new();
        };
        let rate = system.rate(x, &inputs.u);
        let mut found = Vec::new();
        for owner in (0..system.key.closed.len()).map(Owner::Device) {
            let limits = |i| self.assembler.limits(i);
            let guards = system.guards(owner, (&self.thresholds, limits));
            for (k, row) in guards.into_iter().enumerate() {
                let ((value, size), (slope, slopes)) =
                    (row.value(x, &inputs), row.rate(&rate, &inputs));
                let rests = value.abs() <= GRAZING * size && slope.abs() <= GRAZING * slopes;
                if rests && slopes > 0.0 {
                    found.push(Resting {
                        owner: (owner, k),
                        row,
                        name: self.name(owner),
                    });
                }
            }
        }
        found
    }

    /// The event that these passages at one instant make, from one mode, after so many seconds in it, to another.
    fn saltation(
        &mut self,
        instant: &[Passage],
        (from, to): (usize, usize),
        seconds: f64,
    ) -> Result<Saltation, Error> {
        let (first, last) = (&instant[0], &instant[instant.len() - 1]);
        let t = first.t;
        if self.sources.is_some()
            && first.before == last.after
            && instant.iter().all(Passage::is_corner)
        {
            return Ok(Saltation::none(t, &self.systems[from]));
        }
        let through = self.through(instant, to)?;
        let inputs = &self.systems[from].lcs.inputs;
        let limits = [
            Inputs::before(inputs, t, self.same),
            Inputs::after(inputs, t, self.same),
        ];
        let [Some(left), Some(right)] = limits else {
            return Err(not_smooth(t, "a source has no closed form"));
        };
        let systems = &self.systems;
        let before = Side {
            system: &systems[from],
            x: systems[from].state(&first.before),
            inputs: left,
        };
        let after = Side {
            system: &systems[to],
            x: systems[to].state(&last.after),
            inputs: right,
        };
        let (timing, others) = self.timing(instant, &before, seconds)?;
        if self.sources.is_none() {
            let happens = Saltation::happens(t, (&before, &after), timing);
            return Ok(Saltation {
                through,
                others,
                ..happens
            });
        }
        let jump = through.map(|at| &systems[at]);
        let saltation = Saltation::of(t, (&before, &after), timing, jump);
        Ok(Saltation {
            through,
            others,
            ..saltation
        })
    }

    /// The mode in whose directions the storage jumps, where that is not the one that follows.
    fn through(&mut self, instant: &[Passage], to: usize) -> Result<Option<usize>, Error> {
        let (first, last) = (&instant[0], &instant[instant.len() - 1]);
        let inputs = Inputs::after(&self.systems[to].lcs.inputs, last.t, self.same);
        let Some(Inputs { u, .. }) = inputs else {
            return Err(not_smooth(last.t, "a source has no closed form"));
        };
        let sizes = first.before.iter().zip(&last.after);
        let size = sizes.fold(0.0_f64, |m, (a, b)| m.max(a.abs()).max(b.abs()));
        let leads = |storage: &DVector<f64>| {
            let apart = storage.iter().zip(&last.after).map(|(a, b)| (a - b).abs());
            apart.fold(0.0, f64::max) <= FOLLOWS_JUMP * size
        };
        let target = &self.systems[to];
        if leads(&target.storage(&target.state(&first.before), &u)) {
            return Ok(None);
        }
        let own = &last.to.closed;
        let both = |other: &[bool]| own.iter().zip(other).map(|(a, b)| a | b).collect();
        let left = first.from.iter().map(|key| both(&key.closed));
        let one_more = (0..own.len()).filter(|&k| !own[k]).map(|k| {
            let mut closed = own.clone();
            closed[k] = true;
            closed
        });
        let candidates: Vec<Vec<bool>> = left.chain(one_more).collect();
        for closed in candidates {
            let Ok(at) = self.system(&last.to.with_closed(closed)) else {
                continue;
            };
            let (jump, target) = (&self.systems[at], &self.systems[to]);
            let storage = jump.storage(&jump.state(&first.before), &u);
            if leads(&target.storage(&target.state(storage.as_slice()), &u)) {
                return Ok(Some(at));
            }
        }
        Err(not_smooth(
            last.t,
            "the state jumps in several parts, whose derivative is not known",
        ))
    }

    /// When the event happens: by the guard that ends the mode, and by all that fall through zero with it.
    fn timing(
        &self,
        instant: &[Passage],
        before: &Side<'_>,
        seconds: f64,
    ) -> Result<(Option<Timing>, Vec<Timing>), Error> {
        let t = instant[0].t;
        let mut others = Vec::new();
        let rate = before.system.rate(&before.x, &before.inputs.u);
        let inputs = &before.system.lcs.inputs;
        let parts = |sources: &Vec<String>, a: &Timing, b: &Timing| {
            let [a, b] =
                [a, b].map(|timing| timing.of_sources(|k| sources.contains(&inputs[k].name)));
            !same_timing(&a, &b, seconds)
        };
        let mut found: Option<Timing> = None;
        let mut owners: Vec<Owner> = instant.iter().filter_map(|passage| passage.cause).collect();
        for passage in instant {
            let left = passage.from.as_ref().map_or(&[][..], |key| &key.switches);
            let moved = (0..left.len()).filter(|&i| left[i] != passage.to.switches[i]);
            owners.extend(
                moved
                    .filter(|&i| !self.thresholds[i].is_rest())
                    .map(Owner::Switch),
            );
        }
        let causes = owners.len();
        if self.sources.is_none() {
            // One that falls through zero with them may rest there afterwards, as a diode beside another one of a ladder does.
            owners.extend((0..instant[0].to.closed.len()).map(Owner::Device));
        }
        for (number, owner) in owners.into_iter().enumerate() {
            let limits = |i| self.assembler.limits(i);
            let guards = before.system.guards(owner, (&self.thresholds, limits));
            for (k, guard) in guards.into_iter().enumerate() {
                let (value, size) = guard.value(&before.x, &before.inputs);
                let (slope, slopes) = guard.rate(&rate, &before.inputs);
                // What changes sides as a consequence of another event is not at its level.
                if value.abs() > AT_LEVEL * (size + slopes * seconds) || slopes == 0.0 {
                    continue;
                }
                if number >= causes && slope >= -GRAZING * slopes {
                    continue;
                }
                if slope.abs() <= GRAZING * slopes {
                    let what = format!("{} grazes its threshold", self.name(owner));
                    return Err(not_smooth(t, what));
                }
                let timing = Timing::of((owner, k), &guard, slope);
                match &found {
                    Some(other) if !same_timing(other, &timing, seconds) => {
                        let sources = self.sources.as_ref();
                        if sources.is_some_and(|sources| parts(sources, other, &timing)) {
                            let what = format!("{} and another event coincide", self.name(owner));
                            return Err(not_smooth(t, what));
                        }
                        others.push(timing);
                    }
                    _ => found = Some(timing),
                }
            }
        }
        let by_itself = instant[0].cause.is_some();
        let edge = |passage: &Passage| {
            passage.cause.is_none() && passage.from.as_ref() != Some(&passage.to)
        };
        if by_itself && instant.iter().any(edge) {
            return Err(not_smooth(
                t,
                "an edge of a source and an event of the state coincide",
            ));
        }
        if by_itself && found.is_none() {
            let what = "when it happens does not follow from a guard of its mode";
            return Err(not_smooth(t, what));
        }
        Ok((found, others))
    }

    fn name(&self, owner: Owner) -> String {
        match owner {
            Owner::Switch(i) | Owner::Slide(i, _) => self.thresholds[i].name.clone(),
            Owner::Device(pair) => self.assembler.device(pair).unwrap_or_default().to_string(),
        }
    }
}

/// Whether two guards fall through zero together whatever varies, where nothing varies faster than in so many seconds.
pub(super) fn same_timing(a: &Timing, b: &Timing, seconds: f64) -> bool {
    let size = [&a.x, &b.x, &a.u, &b.u].map(|part| part.amax());
    let size = size.into_iter().fold(0.0, f64::max);
    let parts = [
        (&a.x, &b.x, size),
        (&a.u, &b.u, size),
        (&a.du, &b.du, size * seconds),
    ];
    parts.into_iter().all(|(a, b, size)| {
        let mut apart = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        apart.all(|apart| apart <= SAME_TIMING * size)
    })
}
