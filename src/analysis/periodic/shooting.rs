//! The flow from one return to the next, its derivative, and Newton's method for its fixed points.
//!
//! With F(s) the storage at the return that follows s, an orbit is F(s) = s. Newton's correction of s is the least solution of
//!
//! ```text
//! (I − M) δ = F(s) − s,     M = ∂F/∂s,
//! ```
//!
//! in parts of the amplitudes. M's eigenvalues at the orbit are its Floquet multipliers. Where corrections are good, M is not computed anew: what
//! a correction left is Broyden's change of it (C. G. Broyden, Mathematics of Computation 19 (1965)).
//! (T. J. Aprille, T. N. Trick, Proceedings of the IEEE 60 (1972); for piecewise flows R. I. Leine, H. Nijmeijer 2004, section 8.)

use std::sync::atomic::AtomicBool;

use nalgebra::{DMatrix, DVector};

use super::multipliers::neutral_multipliers;
use super::rest::Sources;
use crate::analysis::variation::{System, Trajectory};
use crate::integrate::exact::{Corners, Passage};
use crate::integrate::{Change, Error, Reason, Simulation};
use crate::settings::tolerances::periodic::{
    AT_ROUNDING, DIFFERENCE, DIFFERENCE_AT_REST, EVENT_AGAIN, LEAST_AMPLITUDE, NEUTRAL, REUSED,
    ROUNDING_OF_RETURN, SIDES_OF_REST, STEPPED_DIFFERENCE,
};

/// Corrections of one attempt.
const MOST_CORRECTIONS: u32 = 24;

/// Halvings of a correction that makes the residual larger.
const HALVINGS: u32 = 8;

/// Points of a return at which amplitudes are read.
const SAMPLES: u32 = 16;

/// Events after which a return is given up.
const MOST_EVENTS: u32 = 100_000;

/// When the storage is compared with itself.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Return {
    /// After so many seconds.
    After(f64),
    /// At the next event of this kind, after so many seconds at most.
    At(Change, f64),
}

/// Where a return starts or ends.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stand {
    /// Capacitor voltages, V, and inductor currents, A.
    pub(super) state: Vec<f64>,
    /// By switch: on.
    pub(super) switches: Vec<bool>,
}

impl Stand {
    /// Where a simulation stands.
    pub(super) fn of(simulation: &mut Simulation) -> Self {
        Self {
            state: simulation.state(),
            switches: simulation.positions(),
        }
    }
}

/// A fixed point.
#[derive(Debug, Clone)]
pub(super) struct Fixed {
    pub(super) stand: Stand,
    /// max |F(s) − s| in parts of the amplitudes.
    pub(super) residual: f64,
    pub(super) corrections: u32,
    /// M in parts of the amplitudes.
    pub(super) derivative: DMatrix<f64>,
    /// M is another one to the other side of the place, and none that says what becomes of disturbances.
    pub(super) one_sided: bool,
    /// From one return to the next, s.
    pub(super) seconds: f64,
}

/// What a return made of a place.
pub(super) struct Closing {
    /// (F(s) − s) in parts of the amplitudes.
    residual: DVector<f64>,
    /// F(s).
    pub(super) after: Stand,
    /// How long it took, s.
    seconds: f64,
    /// The changes of mode on the way, where they are known.
    passages: Option<Vec<Passage>>,
}

impl Closing {
    fn size(&self) -> f64 {
        self.residual.amax()
    }
}

/// A simulation whose returns are compared.
pub(super) struct Shooting<'a> {
    pub(super) simulation: &'a mut Simulation,
    /// The time at which returns start, s.
    pub(super) from: f64,
    pub(super) returns: Return,
    /// So many returns are one.
    pub(super) order: usize,
    pub(super) amplitudes: Vec<f64>,
    /// States are next to nothing beside the sources, which are their amplitudes.
    pub(super) rests: bool,
    /// Corrections so far.
    pub(super) corrections: u32,
    /// The systems that its derivatives went through so far, of returns that take `.0` seconds.
    pub(super) systems: (f64, Vec<System>),
    /// Ends a return when set.
    pub(super) cancel: Option<&'a AtomicBool>,
}

impl Shooting<'_> {
    /// Goes to a place and on to the return that follows: where it is then, and how many seconds later.
    pub(super) fn shoot(&mut self, stand: &Stand) -> Result<(Stand, f64), Error> {
        self.simulation
            .stand_at(self.from, &stand.state, &stand.switches)?;
        let mut seconds = 0.0;
        match self.returns.clone() {
            Return::After(period) => {
                seconds = period * self.order as f64;
                let until = self.from + seconds;
                self.simulation.advance(until, false, self.cancel)?;
            }
            Return::At(section, limit) => {
                for _ in 0..self.order {
                    seconds = self.reach(&section, limit)? - self.from;
                }
            }
        }
        Ok((Stand::of(self.simulation), seconds))
    }

    /// Goes on to the next event of this kind; its time, s.
    fn reach(&mut self, section: &Change, limit: f64) -> Result<f64, Error> {
        let begin = self.simulation.time();
        for _ in 0..MOST_EVENTS {
            let stop = self.simulation.advance(begin + limit, true, self.cancel)?;
            let here = |change: &Change| change == section;
            if stop.events.iter().any(|e| e.changes.iter().any(here)) {
                return Ok(stop.time);
            }
            if stop.time >= begin + limit {
                break;
            }
        }
        let what = format!("{section} does not happen again within {limit:e} s");
        Err(Error::at(begin, Reason::NoOrbit(what)))
    }

    /// Takes the amplitudes of the next `seconds` from here, each at least [`LEAST_AMPLITUDE`] of the largest of its unit that was `seen` so far,
    /// or those of the sources where states are next to nothing beside them; where they end.
    pub(super) fn observe(
        &mut self,
        stand: &Stand,
        seconds: f64,
        seen: &[f64],
    ) -> Result<Stand, Error> {
        let extremes = self.extremes(stand, seconds)?;
        self.amplitudes.clear();
        self.amplitudes
            .extend(extremes.iter().map(|[low, high]| high.max(-low)));
        let units = self.simulation.state_units();
        let largest = |unit: &str| {
            let own = self.amplitudes.iter().zip(seen).zip(units);
            let own = own.filter(|(_, u)| **u == unit);
            own.fold(0.0_f64, |m, ((a, seen), _)| m.max(*a).max(*seen))
        };
        let least: Vec<f64> = units.iter().map(|unit| largest(unit)).collect();
        let any = least.iter().copied().fold(0.0, f64::max);
        for (amplitude, least) in self.amplitudes.iter_mut().zip(least) {
            // Of a unit of which nothing was seen any amount is as good as another.
            let least = if least > 0.0 { least } else { any.max(1.0) };
            *amplitude = amplitude.max(LEAST_AMPLITUDE * least);
        }
        let mut sources = Sources::of(self.simulation.circuit(), self.from, seconds);
        let units = self.simulation.state_units();
        // Steps know what has died out to a part of what it was; exact integration to one of what it is.
        if !self.simulation.is_exact() {
            sources = sources.or_seen(seen, units);
        }
        let sizes = extremes.iter().map(|[low, high]| high.max(-low));
        let beside = sources.beside(&sizes.collect::<Vec<_>>(), units);
        self.rests = beside.is_some();
        if let Some(beside) = beside {
            self.amplitudes = beside;
        }
        Ok(Stand::of(self.simulation))
    }

    /// Whether states move by more than [`LEAST_AMPLITUDE`] of what was `seen` of them in the next `seconds` from here.
    pub(super) fn moves(
        &mut self,
        stand: &Stand,
        seconds: f64,
        seen: &[f64],
    ) -> Result<bool, Error> {
        let extremes = self.extremes(stand, seconds)?;
        let mut both = extremes.iter().zip(seen);
        Ok(both.any(|([low, high], seen)| high - low > LEAST_AMPLITUDE * seen))
    }

    /// The least and the largest of each state at [`SAMPLES`] points in the next `seconds` from here.
    fn extremes(&mut self, stand: &Stand, seconds: f64) -> Result<Vec<[f64; 2]>, Error> {
        self.simulation
            .stand_at(self.from, &stand.state, &stand.switches)?;
        let mut extremes: Vec<[f64; 2]> = stand.state.iter().map(|v| [*v, *v]).collect();
        for k in 0..=SAMPLES {
            let part = f64::from(k) / f64::from(SAMPLES);
            let t = self.from + seconds * part;
            self.simulation.advance(t, false, self.cancel)?;
            for ([low, high], value) in extremes.iter_mut().zip(self.simulation.state()) {
                *low = low.min(value);
                *high = high.max(value);
            }
        }
        Ok(extremes)
    }

    pub(super) fn close(&mut self, stand: &Stand) -> Result<Closing, Error> {
        let (after, seconds, passages) = match self.returns {
            Return::After(period) if self.simulation.is_exact() => {
                let seconds = period * self.order as f64;
                let place = (self.from, &stand.state[..], &stand.switches[..]);
                let until = self.from + seconds;
                let passages =
                    self.simulation
                        .passages(place, until, Corners::Seen, self.cancel)?;
                (Stand::of(self.simulation), seconds, passages)
            }
            _ => {
                let (after, seconds) = self.shoot(stand)?;
                (after, seconds, None)
            }
        };
        Ok(Closing {
            residual: self.parts(&after, stand),
            after,
            seconds,
            passages,
        })
    }

    /// The difference of two places in parts of the amplitudes.
    fn parts(&self, one: &Stand, other: &Stand) -> DVector<f64> {
        let both = one.state.iter().zip(&other.state).zip(&self.amplitudes);
        let parts = both.map(|((one, other), amplitude)| (one - other) / amplitude);
        DVector::from_iterator(one.state.len(), parts)
    }

    /// Whether a return from here leads back.
    pub(super) fn closes(&mut self, stand: &Stand, closed: f64) -> bool {
        let found = self.close(stand);
        found.is_ok_and(|found| found.size() <= closed && found.after.switches == stand.switches)
    }

    /// M at a place from which a return leads to `closing`, in parts of the amplitudes: by its variational equation, or by differences where the
    /// flow has no derivative or is made of steps.
    fn derivative(&mut self, stand: &Stand, closing: &Closing) -> Result<DMatrix<f64>, Error> {
        if self.simulation.is_exact() {
            match self.variation(stand, closing) {
                Ok(Some(derivative)) => return Ok(derivative),
                Ok(None) => {}
                Err(error) if matches!(error.reason, Reason::NotSmooth(_)) => {}
                Err(error) => return Err(error),
            }
        }
        self.differences(stand, &closing.after)
    }

    /// `None` where an event stands at the end of the return or at its beginning.
    pub(super) fn variation(
        &mut self,
        stand: &Stand,
        closing: &Closing,
    ) -> Result<Option<DMatrix<f64>>, Error> {
        let seconds = closing.seconds;
        let until = self.from + seconds;
        let mut trajectory = match &closing.passages {
            Some(passages) => {
                let known = std::mem::take(&mut self.systems);
                let systems = if known.0 == seconds { known.1 } else { vec![] };
                let (span, end) = ((self.from, until), &closing.after.state);
                Trajectory::through(self.simulation, passages, span, end, systems)?
            }
            None => {
                let place = (self.from, &stand.state[..], &stand.switches[..]);
                // The event that closes the orbit happens in this run too, an ulp later or not.
                let later = match self.returns {
                    Return::After(_) => 0.0,
                    Return::At(..) => EVENT_AGAIN * until.abs(),
                };
                Trajectory::of(self.simulation, place, until + later, (&[], self.cancel))?
            }
        };
        let mut derivative = match self.returns {
            Return::After(_) if !trajectory.closes() => return Ok(None),
            Return::After(_) => trajectory.monodromy(),
            Return::At(..) if !trajectory.ends_with_event(EVENT_AGAIN) => return Ok(None),
            Return::At(..) => trajectory.return_map()?,
        };
        for (j, mut column) in derivative.column_iter_mut().enumerate() {
            for (value, amplitude) in column.iter_mut().zip(&self.amplitudes) {
                *value *= self.amplitudes[j] / amplitude;
            }
        }
        self.systems = (seconds, std::mem::take(&mut trajectory.systems));
        Ok(Some(derivative))
    }

    pub(super) fn differences(
        &mut self,
        stand: &Stand,
        after: &Stand,
    ) -> Result<DMatrix<f64>, Error> {
        let part = match (self.simulation.is_exact(), self.rests) {
            (true, _) => DIFFERENCE,
            (false, true) => DIFFERENCE_AT_REST,
            (false, false) => STEPPED_DIFFERENCE,
        };
        self.differences_of(part, stand, after)
    }

    /// Columns of M by differences of this part of the amplitudes.
    fn differences_of(
        &mut self,
        part: f64,
        stand: &Stand,
        after: &Stand,
    ) -> Result<DMatrix<f64>, Error> {
        let n = stand.state.len();
        let mut derivative = DMatrix::zeros(n, n);
        for j in 0..n {
            let mut moved = stand.clone();
            moved.state[j] += part * self.amplitudes[j];
            let by = (moved.state[j] - stand.state[j]) / self.amplitudes[j];
            let (end, _) = self.shoot(&moved)?;
            for i in 0..n {
                derivative[(i, j)] = (end.state[i] - after.state[i]) / self.amplitudes[i] / by;
            }
        }
        Ok(derivative)
    }

    /// Corrects `stand` until the residual falls no more; `None` where it does not come below `closed`.
    pub(super) fn solve(&mut self, stand: Stand, closed: f64) -> Result<Option<Fixed>, Error> {
        self.solve_from(stand, None, closed)
    }

    /// The same, first with the M of a flow that is almost this one.
    pub(super) fn solve_from(
        &mut self,
        stand: Stand,
        known: Option<&DMatrix<f64>>,
        closed: f64,
    ) -> Result<Option<Fixed>, Error> {
        let mut stand = stand;
        if stand.state.is_empty() {
            return self.without_states(stand);
        }
        let mut closing = self.close(&stand)?;
        let (mut derivative, mut made_at) = match known {
            Some(known) => (known.clone(), f64::INFINITY),
            None => (self.derivative(&stand, &closing)?, closing.size()),
        };
        let mut course = closing.passages.take();
        // M as the last corrections saw it.
        let mut secant = derivative.clone();
        let mut corrections = 0;
        while corrections < MOST_CORRECTIONS && closing.size() > AT_ROUNDING {
            corrections += 1;
            let before = closing.size();
            let mut old = false;
            match self.corrected(&stand, &closing.residual, &secant)? {
                Some((next, found)) => {
                    let by = self.parts(&next, &stand);
                    let left = &found.residual - &closing.residual + &by - &secant * &by;
                    // A correction below the rounding of the state teaches nothing.
                    let square = by.norm_squared();
                    if square > 0.0 {
                        secant.ger(square.recip(), &left, &by, 1.0);
                    }
                    (stand, closing) = (next, found);
                }
                None if made_at == before => break,
                // An old derivative may be the reason.
                None => old = true,
            }
            let slow = closing.size() > REUSED * before && closing.size() > closed;
            if slow || old {
                derivative = self.derivative(&stand, &closing)?;
                secant.clone_from(&derivative);
                (made_at, course) = (closing.size(), closing.passages.take());
            }
        }
        self.corrections += corrections;
        if closing.size() > closed || closing.after.switches != stand.switches {
            return Ok(None);
        }
        if made_at > NEUTRAL && !same_derivative(&course, &closing.passages) {
            derivative = self.derivative(&stand, &closing)?;
        }
        let mut one_sided = false;
        let sources = || Sources::of(self.simulation.circuit(), self.from, closing.seconds);
        // What comes to rest without sources does so from its own side.
        if self.rests && !sources().are_none() {
            match self.of_both_sides(&stand)? {
                // Without the curvature that one side leaves.
                Some(mean) if !self.simulation.is_exact() => derivative = mean,
                Some(_) => {}
                None => one_sided = true,
            }
        }
        Ok(Some(Fixed {
            stand,
            residual: closing.size(),
            corrections: self.corrections,
            derivative,
            one_sided,
            seconds: closing.seconds,
        }))
    }

    /// M by differences to both sides of a place where the circuit rests; `None` where it is another one to either side, as a switch or a device stands
    /// on its threshold.
    fn of_both_sides(&mut self, stand: &Stand) -> Result<Option<DMatrix<f64>>, Error> {
        let (after, _) = self.shoot(stand)?;
        let above = self.differences_of(DIFFERENCE_AT_REST, stand, &after)?;
        let below = self.differences_of(-DIFFERENCE_AT_REST, stand, &after)?;
        let same = |j: usize| {
            let (one, other) = (above.column(j), below.column(j));
            let largest = one.amax().max(other.amax()).max(1.0);
            (one - other).amax() <= SIDES_OF_REST * largest
        };
        Ok((0..above.ncols())
            .all(same)
            .then(|| (&above + &below) * 0.5))
    }

    /// A circuit that stores nothing is what its sources and switches are.
    fn without_states(&mut self, stand: Stand) -> Result<Option<Fixed>, Error> {
        let (after, seconds) = self.shoot(&stand)?;
        let closed = after.switches == stand.switches;
        Ok(closed.then(|| Fixed {
            stand,
            residual: 0.0,
            corrections: self.corrections,
            derivative: DMatrix::zeros(0, 0),
            one_sided: false,
            seconds,
        }))
    }

    /// The place that the correction leads to, or the longest half of it that makes the residual smaller.
    ///
    /// # Errors
    /// It was interrupted.
    fn corrected(
        &mut self,
        stand: &Stand,
        residual: &DVector<f64>,
        derivative: &DMatrix<f64>,
    ) -> Result<Option<(Stand, Closing)>, Error> {
        let n = residual.len();
        let svd = (DMatrix::identity(n, n) - derivative).svd(true, true);
        // Directions that a return leaves as they are stay.
        let still = svd.singular_values.min() <= NEUTRAL && neutral_multipliers(derivative) > 0;
        let least = if still { NEUTRAL } else { f64::EPSILON };
        let Ok(correction) = svd.solve(residual, least) else {
            return Ok(None);
        };
        let mut part = 1.0;
        let rounding = self.simulation.lap_tolerance();
        let tries = if residual.amax() > rounding.unwrap_or(ROUNDING_OF_RETURN) {
            HALVINGS
        } else {
            1
        };
        for _ in 0..tries {
            let mut next = stand.clone();
            for (j, value) in next.state.iter_mut().enumerate() {
                *value += part * correction[j] * self.amplitudes[j];
            }
            match self.close(&next) {
                Ok(found) if found.size() < residual.amax() => return Ok(Some((next, found))),
                Err(error) if error.is_interruption() => return Err(error),
                // Where no circuit is the correction was too long.
                Ok(_) | Err(_) => part *= 0.5,
            }
        }
        Ok(None)
    }
}

/// Whether returns through these changes of mode have one derivative: sources alone make both, at the same times, and nothing jumps.
fn same_derivative(one: &Option<Vec<Passage>>, other: &Option<Vec<Passage>>) -> bool {
    let (Some(one), Some(other)) = (one, other) else {
        return false;
    };
    let same = |(a, b): (&Passage, &Passage)| {
        a.t == b.t && (&a.from, &a.to) == (&b.from, &b.to) && a.is_clocked() && b.is_clocked()
    };
    one.len() == other.len() && one.iter().zip(other).all(same)
}
