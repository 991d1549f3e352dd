//! The parts of a stretch, and what touches the run in them.

use nalgebra::DVector;

use super::Way;
use crate::analysis::variation::instant::Inputs;
use crate::analysis::variation::not_smooth;
use crate::analysis::variation::saltation::Side;
use crate::analysis::variation::system::System;
use crate::analysis::variation::tangent::{holds, points};
use crate::integrate::Error;
use crate::integrate::exact::Key;
use crate::integrate::theta::Instant;
use crate::lcs::{Hold, Lcs, LcsParts};
use crate::settings::tolerances::periodic::{MOST_DIVIDED, SHORTEST_PART, TANGENT_CHANGE};

/// Parts into which one is divided.
const DIVIDED: usize = 8;

/// A system that touches the run at a time, s.
#[derive(Clone)]
pub(super) struct Touch {
    pub(super) t: f64,
    pub(super) system: System,
    pub(super) x: DVector<f64>,
}

impl Touch {
    pub(super) fn side(&self, inputs: Inputs) -> Side<'_> {
        Side {
            system: &self.system,
            x: self.x.clone(),
            inputs,
        }
    }
}

/// A part from one time to another, s: the storage where it begins, and what touches it after one, two and three quarters.
pub(super) struct Part {
    pub(super) from: f64,
    pub(super) to: f64,
    state: Vec<f64>,
    pub(super) touches: [Touch; 3],
}

impl Way<'_> {
    /// What touches the run here.
    pub(super) fn touch(&mut self, switches: &[bool]) -> Result<Touch, Error> {
        let (t, at) = (self.simulation.time(), self.instant()?);
        let points = points(&at);
        let holds = holds(&at.lcs, &points, self.resistance);
        let lcs = self.system(&at, &holds, switches)?;
        let storage = DVector::from_vec(self.simulation.state());
        let x = &lcs.storage.inject * storage + &lcs.storage.inject_one;
        let free = points.into_iter().zip(&holds);
        let free = free.filter(|(_, hold)| **hold == Hold::Free);
        let free: Vec<(f64, f64)> = free.map(|(point, _)| point).collect();
        let key = Key {
            closed: holds.iter().map(|hold| *hold != Hold::Open).collect(),
            switches: switches.to_vec(),
            sliding: Vec::new(),
        };
        let system = System::touching(&lcs, key, (&x, &at.u), (&free, self.resistance));
        let what = "the tangents of the devices leave their currents open";
        let system = system.ok_or_else(|| not_smooth(t, what))?;
        Ok(Touch { t, system, x })
    }

    /// The system in a position of the switches with some of the devices open.
    fn system(&mut self, at: &Instant, holds: &[Hold], switches: &[bool]) -> Result<Lcs, Error> {
        if holds.iter().all(|hold| *hold == Hold::Free) {
            return Ok(at.lcs.clone());
        }
        let is_own = |own: &&(Vec<Hold>, Vec<bool>, Lcs)| own.0 == holds && own.1 == switches;
        if let Some((.., lcs)) = self.opened.iter().find(is_own) {
            return Ok(lcs.clone());
        }
        let lcs = self.assembler.assemble(holds, switches, &[])?;
        let all = at.lcs.ports.iter().zip(holds);
        let free = all.filter(|(_, hold)| **hold == Hold::Free);
        let laws: Vec<_> = free.map(|(port, _)| port.law.clone()).collect();
        let put_back = |parts: &mut LcsParts| {
            for (port, law) in parts.ports.iter_mut().zip(laws) {
                port.law = law;
            }
        };
        let lcs = lcs.changed(put_back);
        let lcs = lcs.map_err(|error| not_smooth(self.simulation.time(), error.to_string()))?;
        self.opened
            .push((holds.to_vec(), switches.to_vec(), lcs.clone()));
        Ok(lcs)
    }

    /// So many parts from here to a time, short of what happens there.
    pub(super) fn march(
        &mut self,
        (begin, end): (f64, f64),
        count: usize,
        switches: &[bool],
    ) -> Result<Vec<Part>, Error> {
        let quarter = 0.25 * (end - begin) / count as f64;
        let at = |k: usize| {
            if k == 4 * count {
                end
            } else {
                begin + k as f64 * quarter
            }
        };
        let mut parts = Vec::with_capacity(count);
        for first in (0..count).map(|k| 4 * k) {
            if first > 0 {
                self.go_to(at(first))?;
            }
            let state = self.simulation.state();
            let mut touch = |k: usize| {
                self.go_to(at(first + k))?;
                self.touch(switches)
            };
            parts.push(Part {
                from: at(first),
                to: at(first + 4),
                state,
                touches: [touch(1)?, touch(2)?, touch(3)?],
            });
        }
        Ok(parts)
    }

    /// Divides parts in which the tangents change, until they are short; whether there were any.
    pub(super) fn refine(
        &mut self,
        parts: &mut Vec<Part>,
        switches: &[bool],
    ) -> Result<bool, Error> {
        let mut any = false;
        loop {
            let changing = changing(parts);
            let shortest = SHORTEST_PART * self.part;
            let divides =
                |(part, apart): (&Part, &f64)| *apart > 0.0 && part.to - part.from > shortest;
            let divided = parts.iter().zip(&changing).filter(|part| divides(*part));
            let divided = divided.count();
            if divided == 0 || parts.len() + DIVIDED * divided > MOST_DIVIDED {
                self.unknown += changing.iter().sum::<f64>();
                return Ok(any);
            }
            any = true;
            let mut finer = Vec::with_capacity(parts.len());
            for (part, apart) in std::mem::take(parts).into_iter().zip(changing) {
                if divides((&part, &apart)) {
                    self.simulation.stand_at(part.from, &part.state, switches)?;
                    finer.extend(self.march((part.from, part.to), DIVIDED, switches)?);
                } else {
                    finer.push(part);
                }
            }
            *parts = finer;
        }
    }
}

/// By part: how long the tangents in it change by more than [`TANGENT_CHANGE`], s; between two parts it is both that are concerned.
fn changing(parts: &[Part]) -> Vec<f64> {
    let mut seconds = vec![0.0; parts.len()];
    let mut before: Option<(usize, &Touch)> = None;
    for (k, part) in parts.iter().enumerate() {
        for touch in &part.touches {
            if let Some((last, other)) = before
                && apart(other, touch) > TANGENT_CHANGE
            {
                for between in &mut seconds[last..=k] {
                    *between += touch.t - other.t;
                }
            }
            before = Some((k, touch));
        }
    }
    seconds
}

/// How far apart what two systems make of the storage from one to the other is, in coordinates of equal energy.
fn apart(a: &Touch, b: &Touch) -> f64 {
    if a.system.key == b.system.key && a.system.lcs.a == b.system.lcs.a {
        return 0.0;
    }
    let map = |touch: &Touch| {
        let storage = &touch.system.lcs.storage;
        let propagator = touch.system.propagator(b.t - a.t)?;
        Some(&storage.x * propagator * &storage.inject)
    };
    let (Some(one), Some(other)) = (map(a), map(b)) else {
        return f64::INFINITY;
    };
    let metric = &a.system.lcs.storage.metric;
    let size = |k: usize| {
        if metric.is_empty() {
            1.0
        } else {
            metric[(k, k)].abs().sqrt()
        }
    };
    let scaled = (one - other).map_with_location(|i, j, v| v.abs() * size(i) / size(j));
    let finite = scaled.iter().filter(|v| v.is_finite());
    finite.fold(0.0, |m: f64, v| m.max(*v))
}
