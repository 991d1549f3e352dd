//! Where Newton's method starts, and which orbit it is to find.

use super::PeriodicOptions;
use super::multipliers::{growth, multipliers};
use super::shooting::{Fixed, Return, Shooting, Stand};
use crate::integrate::{Change, Error, Event, Orbit, OrbitKind, Reason, Simulation, grow};
use crate::settings::tolerances::periodic::{
    AT_REST, CLOSED, COARSE_CLOSED, NEUTRAL, NUDGE, PARTS_FORESEEN, RETURNS, STEPPED_CLOSED,
};

/// Periods of transient before each attempt.
const TRANSIENTS: [usize; 5] = [4, 24, 96, 384, 1536];

/// The largest order that is looked for.
const MOST_ORDER: usize = 32;

/// Parts of the span of a transient without sources, and how often it is prolonged.
const PARTS: usize = 10;
const PROLONGED: usize = 40;

/// A search, with the simulation it moves.
pub(super) struct Search<'a, 'o> {
    simulation: &'a mut Simulation,
    options: &'a PeriodicOptions<'o>,
    corrections: u32,
    /// States were seen to be next to nothing beside the sources.
    rests: bool,
}

/// An orbit that was found.
pub(super) struct Found {
    pub(super) fixed: Fixed,
    /// The time from which on it stands there, s.
    pub(super) from: f64,
    kind: OrbitKind,
    order: usize,
    returns: Return,
    pub(super) amplitudes: Vec<f64>,
    /// States are next to nothing beside the sources.
    pub(super) rests: bool,
    /// Its derivative is that of steps which damp what swings faster, or noise of theirs.
    pub(super) underived: bool,
}

impl Found {
    pub(super) fn orbit(&self) -> Orbit {
        let known = !self.fixed.one_sided && !self.underived;
        let known = known.then_some(&self.fixed.derivative);
        let mut multipliers = known.and_then(multipliers).unwrap_or_default();
        // A return to the section takes away what moves along the orbit.
        if self.kind == OrbitKind::Autonomous {
            multipliers.pop();
        }
        Orbit {
            period: self.fixed.seconds,
            residual: self.fixed.residual,
            iterations: self.fixed.corrections,
            stable: !self.underived && is_stable(&self.fixed),
            multipliers,
            kind: self.kind,
            order: self.order,
            section: match &self.returns {
                Return::At(section, _) => Some(section.to_string()),
                Return::After(_) => None,
            },
        }
    }
}

/// Whether disturbances of an orbit are known to die out.
fn is_stable(fixed: &Fixed) -> bool {
    !fixed.one_sided && growth(&fixed.derivative).is_none()
}

fn none(what: String) -> Error {
    Error::before(Reason::NoOrbit(what))
}

impl<'a, 'o> Search<'a, 'o> {
    pub(super) const fn of(
        simulation: &'a mut Simulation,
        options: &'a PeriodicOptions<'o>,
    ) -> Self {
        Self {
            simulation,
            options,
            corrections: 0,
            rests: false,
        }
    }

    /// An orbit that sources drive.
    fn of_sources(
        &self,
        fixed: Fixed,
        (period, from): (f64, f64),
        order: usize,
        amplitudes: &[f64],
    ) -> Found {
        Found {
            fixed,
            from,
            kind: OrbitKind::Driven,
            order,
            returns: Return::After(period),
            amplitudes: amplitudes.to_vec(),
            rests: self.rests,
            underived: false,
        }
    }

    fn closed(&self) -> f64 {
        let usual = if self.simulation.is_exact() {
            CLOSED
        } else {
            STEPPED_CLOSED
        };
        let asked = self.options.tol.unwrap_or(usual);
        // Places between which the choice of a step changes are apart by its error: the orbit is found again in finer ones.
        let steps = self.simulation.lap_tolerance();
        steps.map_or(asked, |steps| asked.max(COARSE_CLOSED * steps))
    }

    pub(super) fn shooting(&mut self, from: f64, returns: Return) -> Shooting<'_> {
        Shooting {
            simulation: self.simulation,
            from,
            returns,
            order: 1,
            amplitudes: Vec::new(),
            rests: self.rests,
            corrections: self.corrections,
            systems: Default::default(),
            cancel: self.options.cancel,
        }
    }

    /// Lets so many periods pass from a place on: where each of them ends.
    fn pass(
        &mut self,
        stand: &mut Stand,
        (period, from): (f64, f64),
        periods: usize,
    ) -> Result<Vec<Stand>, Error> {
        self.simulation
            .stand_at(from, &stand.state, &stand.switches)?;
        self.go_on(stand, (period, from), periods)
    }

    /// The same from where the simulation stands, at most a period after `from`.
    fn go_on(
        &mut self,
        stand: &mut Stand,
        (period, from): (f64, f64),
        periods: usize,
    ) -> Result<Vec<Stand>, Error> {
        let one = |k| {
            let t = from + k as f64 * period;
            self.simulation.advance(t, false, self.options.cancel)?;
            *stand = Stand::of(self.simulation);
            Ok(stand.clone())
        };
        (1..=periods).map(one).collect()
    }

    /// The orbit of this simulation that is near one of another, if there is one.
    pub(super) fn again(&mut self, found: &Found) -> Result<Option<Fixed>, Error> {
        let closed = self.closed();
        let mut shooting = self.shooting(found.from, found.returns.clone());
        shooting.order = found.order;
        shooting.amplitudes.clone_from(&found.amplitudes);
        shooting.rests = found.rests;
        shooting.corrections = found.fixed.corrections;
        let Fixed {
            stand, derivative, ..
        } = &found.fixed;
        shooting.solve_from(stand.clone(), Some(derivative), closed)
    }

    /// Goes a little way from here.
    ///
    /// # Errors
    /// So many steps of exact integration were made on it that a period would take more than are made.
    fn foresee(&mut self, from: f64, period: f64) -> Result<(), Error> {
        let limit = self.options.settings.max_steps;
        for part in PARTS_FORESEEN {
            let before = self.simulation.exact_steps();
            let begin = self.simulation.time();
            self.simulation
                .advance(begin.max(from + period / part), false, self.options.cancel)?;
            let made = self.simulation.exact_steps() - before;
            if made as f64 * part <= limit as f64 {
                return Ok(());
            }
        }
        Err(Error::at(
            self.simulation.time(),
            Reason::TooManySteps { limit },
        ))
    }

    /// The orbit of a circuit whose sources repeat after `period` seconds from `from` on.
    pub(super) fn driven(&mut self, period: f64, from: f64) -> Result<Found, Error> {
        let closed = self.closed();
        if from > 0.0 {
            self.simulation.advance(from, false, self.options.cancel)?;
        }
        let mut stand = Stand::of(self.simulation);
        self.foresee(from, period)?;
        let asked = self.options.order;
        let (mut last, mut seen) = (None, vec![0.0; stand.state.len()]);
        grow(&mut seen, &stand.state);
        let mut since_start = (from / period).round() as usize;
        for (k, periods) in TRANSIENTS.into_iter().enumerate() {
            let mut passed = if k == 0 {
                self.go_on(&mut stand, (period, from), periods - 1)?
            } else {
                self.pass(&mut stand, (period, from), periods - 1)?
            };
            since_start += periods;
            passed
                .iter()
                .for_each(|stand| grow(&mut seen, &stand.state));
            let mut shooting = self.shooting(from, Return::After(period));
            shooting.order = asked.unwrap_or(1);
            stand = shooting.observe(&stand, period, &seen)?;
            passed.push(stand.clone());
            let found = shooting.solve(stand.clone(), closed);
            let amplitudes = shooting.amplitudes.clone();
            (self.corrections, self.rests) = (shooting.corrections, shooting.rests);
            match found {
                Ok(Some(fixed)) if asked.is_some() || fixed.one_sided || is_stable(&fixed) => {
                    return Ok(self.of_sources(
                        fixed,
                        (period, from),
                        asked.unwrap_or(1),
                        &amplitudes,
                    ));
                }
                Ok(Some(fixed)) => {
                    let other = self.beyond(&fixed, (period, from), &amplitudes)?;
                    return Ok(other.unwrap_or_else(|| {
                        self.of_sources(fixed, (period, from), 1, &amplitudes)
                    }));
                }
                Ok(None) => {}
                Err(error) if error.is_interruption() => return Err(error),
                Err(error) => last = Some(error),
            }
            // Where the transient has settled on an orbit of another order, no other one need exist.
            if let (None, Some(order)) = (asked, order_of(&passed, &amplitudes))
                && order > 1
            {
                // In the phase of the transient.
                let more = since_start.next_multiple_of(order) - since_start;
                let mut begin = stand.clone();
                self.pass(&mut begin, (period, from), more)?;
                if let Some(found) = self.of_order(order, &begin, (period, from), &amplitudes)? {
                    return Ok(found);
                }
            }
        }
        let periods: usize = TRANSIENTS.iter().sum();
        Err(match last {
            Some(error) => error,
            None => none(format!(
                "Newton's method does not close an orbit of {period:e} s, and {periods} periods of transient do not come to one"
            )),
        })
    }

    /// The stable orbit to which transients go that leave an unstable one.
    fn beyond(
        &mut self,
        fixed: &Fixed,
        (period, from): (f64, f64),
        amplitudes: &[f64],
    ) -> Result<Option<Found>, Error> {
        let mut stand = fixed.stand.clone();
        for (value, amplitude) in stand.state.iter_mut().zip(amplitudes) {
            *value += NUDGE * amplitude;
        }
        for periods in TRANSIENTS {
            let passed = self.pass(&mut stand, (period, from), periods.max(2 * MOST_ORDER))?;
            if let Some(order) = order_of(&passed, amplitudes)
                && let Some(found) = self.of_order(order, &stand, (period, from), amplitudes)?
                && (order > 1 || is_stable(&found.fixed))
            {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// The orbit of this order near a place, if it is stable.
    fn of_order(
        &mut self,
        order: usize,
        stand: &Stand,
        (period, from): (f64, f64),
        amplitudes: &[f64],
    ) -> Result<Option<Found>, Error> {
        let closed = self.closed();
        let mut shooting = self.shooting(from, Return::After(period));
        shooting.order = order;
        shooting.amplitudes = amplitudes.to_vec();
        let mut fixed = match shooting.solve(stand.clone(), closed) {
            Ok(Some(fixed)) => fixed,
            Err(error) if error.is_interruption() => return Err(error),
            Ok(None) | Err(_) => return Ok(None),
        };
        // What closes after two periods closes after four.
        for part in (1..order).filter(|part| order.is_multiple_of(*part)) {
            shooting.order = part;
            if shooting.closes(&fixed.stand, closed)
                && let Ok(Some(shorter)) = shooting.solve(fixed.stand.clone(), closed)
            {
                fixed = shorter;
                break;
            }
            shooting.order = order;
        }
        let order = shooting.order;
        self.corrections = shooting.corrections;
        Ok(is_stable(&fixed).then(|| self.of_sources(fixed, (period, from), order, amplitudes)))
    }

    /// The orbit of a circuit in which no source varies, or its rest, after a transient of `span` seconds.
    pub(super) fn autonomous(&mut self, span: f64) -> Result<Found, Error> {
        let part = span / PARTS as f64;
        let mut before = self.simulation.state();
        let begin = Stand::of(self.simulation);
        self.foresee(0.0, span)?;
        self.simulation
            .stand_at(0.0, &begin.state, &begin.switches)?;
        let (mut amplitudes, mut last) = (vec![0.0; before.len()], None);
        grow(&mut amplitudes, &before);
        let (mut events, mut looked) = (Vec::new(), 0);
        for k in 1..=PROLONGED * PARTS {
            let begin = self.simulation.time();
            let cancel = self.options.cancel;
            let stop = self.simulation.advance(begin + part, false, cancel)?;
            let now = self.simulation.state();
            grow(&mut amplitudes, &now);
            let still = now.iter().zip(&before).zip(&amplitudes);
            let still = still.fold(0.0_f64, |m, ((a, b), size)| {
                m.max((a - b).abs() / size.max(f64::MIN_POSITIVE))
            });
            let stand = Stand::of(self.simulation);
            before = now;
            let quiet = stop.events.is_empty();
            events.extend(stop.events);
            if k < PARTS {
                continue;
            }
            let tried = if quiet && still <= AT_REST {
                self.at_rest(&stand, part, &amplitudes)
            } else if k % PARTS == 0 {
                // A period may be longer than the span.
                let often = recurring(&events);
                if often.is_empty() {
                    continue;
                }
                let seconds = (k - looked) as f64 * part;
                looked = k;
                events.clear();
                self.around(&often, (&stand, &amplitudes), seconds)
            } else {
                continue;
            };
            match tried {
                Ok(Some(found)) => return Ok(found),
                Ok(None) => {}
                Err(error) if error.is_interruption() => return Err(error),
                Err(error) => last = Some(error),
            }
            // The attempts moved the simulation.
            self.simulation
                .stand_at(0.0, &stand.state, &stand.switches)?;
        }
        Err(last.unwrap_or_else(|| {
            none(format!(
                "no source varies, and within {:e} s the circuit neither comes to rest nor repeats an event regularly; `--period` names the period of what swings without events",
                span * PROLONGED as f64
            ))
        }))
    }

    /// The stable equilibrium near the place where the simulation stands, of transients of `span` seconds.
    pub(super) fn rest_from_here(&mut self, span: f64) -> Result<Option<Found>, Error> {
        let stand = Stand::of(self.simulation);
        let mut seen = vec![0.0; stand.state.len()];
        grow(&mut seen, &stand.state);
        let found = match self.at_rest(&stand, span / PARTS as f64, &seen) {
            Err(error) if !error.is_interruption() => return Ok(None),
            found => found?,
        };
        let dies_out = |found: &Found| {
            let largest = found.orbit().multipliers.first().copied();
            largest.is_none_or(|[re, im]| re.hypot(im) < 1.0 - NEUTRAL)
        };
        Ok(found.filter(|found| !found.fixed.one_sided && dies_out(found)))
    }

    /// The equilibrium near a place.
    fn at_rest(
        &mut self,
        stand: &Stand,
        seconds: f64,
        seen: &[f64],
    ) -> Result<Option<Found>, Error> {
        let closed = self.closed();
        let mut shooting = self.shooting(0.0, Return::After(seconds));
        shooting.observe(stand, seconds, seen)?;
        let fixed = shooting.solve(stand.clone(), closed)?;
        let (returns, amplitudes) = (shooting.returns.clone(), shooting.amplitudes.clone());
        (self.corrections, self.rests) = (shooting.corrections, shooting.rests);
        let rests = self.rests;
        Ok(fixed.map(|fixed| Found {
            fixed,
            from: 0.0,
            kind: OrbitKind::Equilibrium,
            order: 1,
            returns,
            amplitudes,
            rests,
            underived: false,
        }))
    }

    /// The orbit that repeats one of these changes, which is the one that closes it, of those of so many seconds.
    fn around(
        &mut self,
        changes: &[Change],
        (stand, seen): (&Stand, &[f64]),
        seconds: f64,
    ) -> Result<Option<Found>, Error> {
        let (closed, order) = (self.closed(), self.options.order.unwrap_or(1));
        for section in changes {
            let mut shooting = self.shooting(0.0, Return::At(section.clone(), 2.0 * seconds));
            let (start, _) = shooting.shoot(stand)?;
            let (_, period) = shooting.shoot(&start)?;
            shooting.observe(&start, period, seen)?;
            shooting.order = order;
            let found = shooting.solve(start, closed)?;
            let moves = match &found {
                Some(fixed) => shooting.moves(&fixed.stand, fixed.seconds, seen)?,
                None => false,
            };
            let (returns, amplitudes) = (shooting.returns.clone(), shooting.amplitudes.clone());
            self.corrections = shooting.corrections;
            // Events that follow each other ever faster around a point come to rest there.
            if let (Some(fixed), false) = (&found, moves) {
                return self.at_rest(&fixed.stand.clone(), seconds, seen);
            }
            if let Some(fixed) = found {
                return Ok(Some(Found {
                    fixed,
                    from: 0.0,
                    kind: OrbitKind::Autonomous,
                    order,
                    returns,
                    amplitudes,
                    rests: false,
                    underived: false,
                }));
            }
        }
        Ok(None)
    }
}

/// The changes that happened often enough to be those of an orbit, the rarest first.
fn recurring(events: &[Event]) -> Vec<Change> {
    /// An event that repeats happened so often.
    const OFTEN: usize = 3;
    let mut kinds: Vec<(usize, &Change)> = Vec::new();
    for change in events.iter().flat_map(|event| event.changes.iter()) {
        match kinds.iter_mut().find(|(_, known)| *known == change) {
            Some((count, _)) => *count += 1,
            None => kinds.push((1, change)),
        }
    }
    kinds.retain(|(count, _)| *count >= OFTEN);
    kinds.sort_by_key(|(count, _)| *count);
    kinds
        .into_iter()
        .map(|(_, change)| change.clone())
        .collect()
}

/// After how many periods the last of these places returns, if it does.
fn order_of(passed: &[Stand], amplitudes: &[f64]) -> Option<usize> {
    let (last, before) = passed.split_last()?;
    let near = |other: &Stand| {
        let parts = last.state.iter().zip(&other.state).zip(amplitudes);
        let apart = parts.fold(0.0_f64, |m, ((a, b), size)| m.max((a - b).abs() / size));
        apart <= RETURNS && last.switches == other.switches
    };
    let latest = before.iter().rev().take(MOST_ORDER);
    latest
        .enumerate()
        .find(|(_, other)| near(other))
        .map(|(k, _)| k + 1)
}
