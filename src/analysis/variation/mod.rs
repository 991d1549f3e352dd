//! The variational equation of a run that is exact throughout: what becomes of small changes of its state, its sources and its values.
//!
//! In a mode δx' = A δx + E δu; from one mode to the next stands a [saltation](saltation). The derivative of the flow from t₀ to t₁,
//!
//! ```text
//! M = ∂s(t₁)/∂s(t₀) = X ∏ (e^{A τ} · saltation) J,
//! ```
//!
//! is a product of exponentials and saltations, without differences.

mod adjoint;
mod carried;
mod change;
mod costate;
mod course;
mod drawing;
mod flow;
mod forms;
mod instant;
mod length;
mod linear;
mod maker;
mod moved;
mod near;
mod parameter;
mod saltation;
mod steps;
mod sums;
mod system;
mod tableau;
mod tangent;

use std::sync::atomic::AtomicBool;

use nalgebra::{DMatrix, DVector, RowDVector};

use crate::integrate::exact::{Corners, Owner, Passage};
use crate::integrate::{Error, Reason, Simulation};

pub(crate) use adjoint::Adjoint;
pub(crate) use carried::{Carried, Summed};
pub(crate) use change::Changes;
pub(crate) use course::{Course, Leap};
pub(crate) use drawing::{Drawing, Lines, Sight, Weighted};
pub(crate) use forms::Forms;
use instant::Inputs;
pub(crate) use linear::{Linear, Motion, parts, unit};
use maker::{Maker, same_timing};
pub(crate) use moved::Moved;
pub(crate) use near::{Near, STEPS, difference, difference_by};
pub(crate) use parameter::Parameter;
use saltation::Side;
pub(crate) use saltation::{Saltation, Timing, times};
pub(crate) use steps::Linearised;
use system::Row;
pub(crate) use system::{System, shaped};
pub(crate) use tableau::{Rest, Tableau};
pub(crate) use tangent::{own_resistance, tangent};

/// A stretch of a run in one mode.
#[derive(Debug, Clone)]
pub(crate) struct Segment {
    /// Its place among the systems.
    pub(crate) system: usize,
    /// From when to when, s.
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// x where it begins.
    pub(crate) start: DVector<f64>,
    /// e^{A (to − from)}; empty where events that coincide by chance are kept, as nothing takes it there.
    pub(crate) propagator: DMatrix<f64>,
    /// x where it ends.
    pub(crate) end: DVector<f64>,
    /// Guards of devices that are zero there and stay so, where events that coincide by chance are kept.
    resting: Vec<Resting>,
}

/// A guard that is zero at the end of a segment and stays so.
#[derive(Debug, Clone)]
struct Resting {
    /// Whose it is, and which of that one's.
    owner: (Owner, usize),
    row: Row,
    name: String,
}

/// A run from one time to another, with what its derivative is made of.
#[derive(Debug, Clone)]
pub(crate) struct Trajectory {
    pub(crate) systems: Vec<System>,
    pub(crate) segments: Vec<Segment>,
    /// Between each segment and the next.
    pub(crate) saltations: Vec<Saltation>,
    /// Times within this are one, s.
    same: f64,
}

/// A run whose derivative does not exist, or is not known.
fn not_smooth(t: f64, what: impl Into<String>) -> Error {
    Error::at(t, Reason::NotSmooth(what.into()))
}

fn stepped(t: f64) -> Error {
    not_smooth(t, "steps are made in it, and their derivative is not known")
}

impl Trajectory {
    /// The run of a simulation from a place, as for [`Simulation::stand_at`], until a time or until `cancel` is set. Its events have derivatives with
    /// the state and with these sources; of guards that coincide and part where others vary all are kept.
    ///
    /// # Errors
    /// [`Reason::NotSmooth`] where the derivative of the flow does not exist or is not known; else the simulation's.
    pub(crate) fn of(
        simulation: &mut Simulation,
        place: (f64, &[f64], &[bool]),
        until: f64,
        (sources, cancel): (&[String], Option<&AtomicBool>),
    ) -> Result<Self, Error> {
        Self::made(
            simulation,
            place,
            until,
            (Some(sources), cancel),
            Vec::new(),
        )?
        .ok_or_else(|| stepped(place.0))
    }

    /// That of the same simulation from another place, as long a run whose modes are known.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub(crate) fn again(
        self,
        simulation: &mut Simulation,
        place: (f64, &[f64], &[bool]),
        until: f64,
        (sources, cancel): (&[String], Option<&AtomicBool>),
    ) -> Result<Self, Error> {
        Self::made(
            simulation,
            place,
            until,
            (Some(sources), cancel),
            self.systems,
        )?
        .ok_or_else(|| stepped(place.0))
    }

    /// The same; events that coincide by chance are kept with all their guards, for a variation that tells whether they part. `None` where steps are made.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub(crate) fn by_chance(
        simulation: &mut Simulation,
        place: (f64, &[f64], &[bool]),
        until: f64,
        cancel: Option<&AtomicBool>,
    ) -> Result<Option<Self>, Error> {
        Self::made(simulation, place, until, (None, cancel), Vec::new())
    }

    fn made(
        simulation: &mut Simulation,
        place: (f64, &[f64], &[bool]),
        until: f64,
        (sources, cancel): (Option<&[String]>, Option<&AtomicBool>),
        systems: Vec<System>,
    ) -> Result<Option<Self>, Error> {
        let from = place.0;
        let Some(passages) = simulation.passages(place, until, Corners::All, cancel)? else {
            return Ok(None);
        };
        let end = simulation.state();
        let mut maker = Maker::of(simulation, (from, until));
        (maker.sources, maker.systems) = (sources.map(<[String]>::to_vec), systems);
        let made = maker.make(&passages, (until, &end));
        made.map(Some)
    }

    /// The run through these changes of mode, from one time to another, at which the storage is `end`; its events have derivatives with the
    /// state. `systems` are those of a run as long that are known.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub(crate) fn through(
        simulation: &Simulation,
        passages: &[Passage],
        span: (f64, f64),
        end: &[f64],
        systems: Vec<System>,
    ) -> Result<Self, Error> {
        let mut maker = Maker::of(simulation, span);
        (maker.sources, maker.systems) = (Some(vec![]), systems);
        maker.make(passages, (span.1, end))
    }

    /// M = ∂s(t₁)/∂s(t₀), q×q, at the times t₀ and t₁.
    pub(crate) fn monodromy(&self) -> DMatrix<f64> {
        &self.last_system().lcs.storage.x * self.state_derivative().0
    }

    /// ∂s/∂s(t₀) at the event that t₁ is the time of, whenever it happens: M + ṡ⁺ ∂t₁/∂s(t₀), q×q.
    ///
    /// # Errors
    /// The run does not end with an event.
    pub(crate) fn return_map(&self) -> Result<DMatrix<f64>, Error> {
        let (m, dt) = self.state_derivative();
        let (Some(segment), Some(dt)) = (self.segments.last(), dt) else {
            let what = "a run that does not end with an event";
            return Err(Error::before(Reason::internal("analysis::variation", what)));
        };
        let system = self.last_system();
        let inputs = Inputs::after(&system.lcs.inputs, segment.to, self.same);
        let Some(inputs) = inputs else {
            return Err(not_smooth(segment.to, "a source has no closed form"));
        };
        let side = Side {
            system,
            x: segment.end.clone(),
            inputs,
        };
        Ok(&system.lcs.storage.x * m + side.storage_rate() * dt)
    }

    /// Whether it ends in the mode that it begins in: where it does not, an event at its end has not happened yet, or not yet at its start.
    pub(crate) fn closes(&self) -> bool {
        let ends = self.segments.first().zip(self.segments.last());
        ends.is_some_and(|(first, last)| first.system == last.system)
    }

    /// Whether it closes with an event no longer than this part of the time before its end: one in its middle is not the one that it returns to.
    pub(crate) fn ends_with_event(&self, part: f64) -> bool {
        let last = self.segments.last();
        self.closes() && last.is_some_and(|last| last.to - last.from <= 2.0 * part * last.to.abs())
    }

    /// The middle of the longest segment, s.
    pub(crate) fn calmest(&self) -> Option<f64> {
        let length = |segment: &&Segment| segment.to - segment.from;
        let mut segments = self.segments.iter();
        let first = segments.next()?;
        let longest = segments.fold(first, |longest, segment| {
            if length(&segment) > length(&longest) {
                segment
            } else {
                longest
            }
        });
        Some(0.5 * (longest.from + longest.to))
    }

    fn last_system(&self) -> &System {
        &self.systems[self.segments.last().map_or(0, |segment| segment.system)]
    }

    /// ∂x(t₁)/∂s(t₀), and ∂t/∂s(t₀) of the last event where it moves.
    fn state_derivative(&self) -> (DMatrix<f64>, Option<RowDVector<f64>>) {
        let first = self.segments.first().map_or(0, |segment| segment.system);
        let mut m = self.systems[first].lcs.storage.inject.clone();
        let mut dt = None;
        for (k, segment) in self.segments.iter().enumerate() {
            m = &segment.propagator * m;
            if let Some(saltation) = self.saltations.get(k) {
                dt = saltation.timing.as_ref().map(|timing| &timing.x * &m);
                m = &saltation.x * m;
            }
        }
        (m, dt)
    }
}
