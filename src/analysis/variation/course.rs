//! A run that is exact throughout, as stretches in one mode and on one piece of every source.

use std::sync::atomic::AtomicBool;

use nalgebra::DVector;

use super::instant::Inputs;
use super::{System, not_smooth, shaped};
use crate::circuit::source::Piece;
use crate::integrate::exact::{Assembler, Corners, Key, Passage};
use crate::integrate::{Error, Impulse, Reason, Simulation};
use crate::lcs::Hold;
use crate::settings::tolerances::times::SAME_TIME;

/// A stretch of a run in one mode and on one piece of every source.
#[derive(Debug, Clone)]
pub(crate) struct Stretch {
    /// Its place among the systems.
    pub(crate) system: usize,
    /// From when to when, s.
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// x where it begins.
    pub(crate) start: DVector<f64>,
    /// By input; zero for those that nothing but controls of switches sees.
    pub(crate) pieces: Vec<Piece>,
}

/// An instant at which the storage jumps.
#[derive(Debug, Clone)]
pub(crate) struct Leap {
    /// Time, s.
    pub(crate) t: f64,
    /// The stretch that begins there.
    pub(crate) into: usize,
    /// Areas of the outputs' impulses.
    pub(crate) areas: DVector<f64>,
    /// The part of them that edges of sources make by themselves, without devices: C Δu.
    pub(crate) direct: DVector<f64>,
}

/// A run that is exact throughout.
#[derive(Debug, Clone, Default)]
pub(crate) struct Course {
    pub(crate) systems: Vec<System>,
    pub(crate) stretches: Vec<Stretch>,
    pub(crate) leaps: Vec<Leap>,
}

impl Course {
    /// The run of a simulation from a place, as for [`Simulation::stand_at`], until a time or until `cancel` is set; `None` where steps are made in it.
    ///
    /// # Errors
    /// The simulation's.
    pub(crate) fn of(
        simulation: &mut Simulation,
        place: (f64, &[f64], &[bool]),
        until: f64,
        cancel: Option<&AtomicBool>,
    ) -> Result<Option<Self>, Error> {
        let (from, told) = (place.0, simulation.impulses().len());
        let Some(passages) = simulation.passages(place, until, Corners::Seen, cancel)? else {
            return Ok(None);
        };
        let silent = simulation.silent_sources();
        let mut course = Self::default();
        let mut assembler = simulation.assembler(until - from);
        let same = SAME_TIME * from.abs().max(until.abs());
        let impulses = &simulation.impulses()[told..];
        let mut begun: Option<(usize, f64, DVector<f64>)> = None;
        for instant in passages.chunk_by(|a, b| b.t - a.t <= same) {
            let (first, last) = (&instant[0], &instant[instant.len() - 1]);
            if let Some(begun) = begun.take() {
                course.stretch(begun, (first.t, same), &silent)?;
                course.leap(instant, &mut assembler, impulses, same)?;
            }
            let system = course.system(&last.to, &mut assembler)?;
            let start = course.systems[system].state(&last.after);
            begun = Some((system, last.t, start));
        }
        let Some(begun) = begun else {
            let what = "a run in no mode";
            return Err(Error::before(Reason::internal("analysis::variation", what)));
        };
        course.stretch(begun, (until, same), &silent)?;
        Ok(Some(course))
    }

    fn system(&mut self, key: &Key, assembler: &mut Assembler) -> Result<usize, Error> {
        if let Some(known) = self.systems.iter().position(|system| system.key == *key) {
            return Ok(known);
        }
        self.systems.push(System::of(key, assembler)?);
        Ok(self.systems.len() - 1)
    }

    fn stretch(
        &mut self,
        (system, from, start): (usize, f64, DVector<f64>),
        (to, same): (f64, f64),
        silent: &[bool],
    ) -> Result<(), Error> {
        let inputs = self.systems[system].lcs.inputs.iter().zip(silent);
        let pieces = inputs.map(|(input, silent)| {
            if *silent {
                Some(Piece::zero())
            } else {
                input.source.piece(from + same)
            }
        });
        let pieces = pieces.collect::<Option<_>>();
        self.stretches.push(Stretch {
            system,
            from,
            to,
            start,
            pieces: pieces.ok_or_else(|| not_smooth(from, "a source has no closed form"))?,
        });
        Ok(())
    }

    fn leap(
        &mut self,
        instant: &[Passage],
        assembler: &mut Assembler,
        impulses: &[Impulse],
        same: f64,
    ) -> Result<(), Error> {
        let (first, last) = (&instant[0], &instant[instant.len() - 1]);
        let parts = first.before.iter().zip(&last.after);
        let storage = DVector::from_iterator(first.before.len(), parts.map(|(a, b)| a - b));
        if storage.iter().all(|change| *change == 0.0) {
            return Ok(());
        }
        let devices = vec![Hold::Free; last.to.closed.len()];
        let sliding = last.to.sliding_switches();
        let lcs = assembler.assemble(&devices, &last.to.switches, &sliding)?;
        let sides = [
            Inputs::before(&lcs.inputs, first.t, same),
            Inputs::after(&lcs.inputs, first.t, same),
        ];
        let [Some(before), Some(after)] = sides else {
            return Err(not_smooth(first.t, "a source has no closed form"));
        };
        let rows = &lcs.outputs.rows;
        let slopes = shaped(&rows.du, rows.one.len(), lcs.p());
        // What a switch joins is told by the storage alone.
        let now = |impulse: &&Impulse| (impulse.t - first.t).abs() <= same;
        let mut areas = if impulses.iter().any(|impulse| now(&impulse)) {
            DVector::zeros(rows.one.len())
        } else {
            let system = self.system(&last.to, assembler)?;
            let rows = &self.systems[system].lcs.outputs.impulse;
            shaped(rows, lcs.outputs.names.len(), storage.len()) * storage
        };
        for impulse in impulses.iter().filter(now) {
            let mut names = lcs.outputs.names.iter();
            if let Some(at) = names.position(|name| *name == impulse.name) {
                areas[at] += impulse.area;
            }
        }
        self.leaps.push(Leap {
            t: first.t,
            into: self.stretches.len(),
            areas,
            direct: slopes * (after.u - before.u),
        });
        Ok(())
    }
}
