//! The parts of a stretch, and what touches the run in them.

use nalgebra::DVector;

use super::Way;
use crate::analysis::variation::not_smooth;
use crate::analysis::variation::system::System;
use crate::integrate::Error;
use crate::settings::tolerances::periodic::{QUICKEST, SHORTEST_PART, TANGENT_CHANGE};

/// Parts into which one is divided.
const DIVIDED: usize = 8;

/// A system that touches the run at a time, s.
pub(super) struct Touch {
    pub(super) t: f64,
    pub(super) system: System,
    pub(super) x: DVector<f64>,
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
        let quickest = QUICKEST * SHORTEST_PART * self.part;
        let system = System::touching(&at, switches, quickest).ok_or_else(|| {
            not_smooth(t, "the tangents of the devices leave their currents open")
        })?;
        let x = at.x;
        Ok(Touch { t, system, x })
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
                self.simulation.advance_to(at(first))?;
            }
            let state = self.simulation.state();
            let mut touch = |k: usize| {
                self.simulation.advance_to(at(first + k))?;
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
            if !parts.iter().zip(&changing).any(divides) {
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

/// How far apart the propagators of two systems from one to the other are, in coordinates of equal energy.
fn apart(a: &Touch, b: &Touch) -> f64 {
    if a.system.lcs.a == b.system.lcs.a {
        return 0.0;
    }
    let both = [a, b].map(|touch| touch.system.propagator(b.t - a.t));
    let [Some(one), Some(other)] = both else {
        return f64::INFINITY;
    };
    let energy = &a.system.lcs.energy;
    let size = |k: usize| {
        if energy.is_empty() {
            1.0
        } else {
            energy[(k, k)].abs().sqrt()
        }
    };
    let scaled = (one - other).map_with_location(|i, j, v| v.abs() * size(i) / size(j));
    let finite = scaled.iter().filter(|v| v.is_finite());
    finite.fold(0.0, |m: f64, v| m.max(*v))
}
