//! Dense output: the quantities at any time within a step that was made.
//!
//! The state follows Hermite's cubic through both ends and their slopes, whose error is of fourth order as the step's own; λ follows the
//! cubic through four of the stages. The other two stages test it: where λ bends (a diode that turns on) the polynomial is not trusted, and a
//! step of the method from the start of the segment to the row takes its place. Sources are evaluated at the time itself.

use super::tableau::{NODES, STAGES, THROUGH, interpolation};
use super::{Curved, Start, Trial};
use crate::integrate::grow;
use crate::integrate::inputs::{Inputs, Pieces};
use crate::settings::tolerances::steps::ROWS;

/// One step that was made.
#[derive(Debug, Default)]
struct Segment {
    start: Start,
    end: f64,
    system: usize,
    /// The sides on which its ideal ports were held, where they were.
    held: Option<Vec<bool>>,
    x: Vec<f64>,
    slope: Vec<f64>,
    /// By stage: λ.
    lambdas: Vec<f64>,
    /// Whether λ may be interpolated; not asked yet where `None`.
    trusted: Option<bool>,
}

/// The steps from the one that the present row lies in up to the last.
#[derive(Debug, Default)]
pub(crate) struct Segments {
    /// The first `used` are in use, in the order of time.
    kept: Vec<Segment>,
    used: usize,
    /// Point at which the last row was read: [x | λ | u | u' | 1].
    w: Vec<f64>,
    pieces: Pieces,
    du: Vec<f64>,
    /// What λ is off, over [x | λ | u | u' | 1], and the largest |value| of every row so far.
    off: Vec<f64>,
    reached: Vec<f64>,
}

/// What a row within a step is read from.
pub(crate) enum Within<'a> {
    /// The polynomials.
    Polynomials,
    /// A step of the method from here takes their place, with ideal ports held on these sides.
    Step(&'a Start, Option<&'a [bool]>),
}

impl Segments {
    /// Keeps the step that a trial has made in a system, with its ideal ports on the sides `held`.
    pub(crate) fn keep(
        &mut self,
        start: &Start,
        (system, held): (usize, Option<&[bool]>),
        trial: &Trial,
    ) {
        if self.used == self.kept.len() {
            self.kept.push(Segment::default());
        }
        let segment = &mut self.kept[self.used];
        self.used += 1;
        segment.start.copy_from(start);
        segment.end = start.t + trial.h;
        segment.system = system;
        match (&mut segment.held, held) {
            (Some(kept), Some(held)) if kept.len() == held.len() => kept.copy_from_slice(held),
            (kept, held) => *kept = held.map(<[bool]>::to_vec),
        }
        segment.x.clone_from(&trial.x);
        segment.slope.clear();
        segment.slope.extend_from_slice(trial.end_slope());
        segment.lambdas.clone_from(&trial.lambdas);
        segment.trusted = None;
    }

    /// Forgets the steps that end before `t`, whose rows have been read.
    pub(crate) fn forget_before(&mut self, t: f64) {
        let past = self.kept[..self.used].iter().take_while(|s| s.end < t);
        let past = past.count();
        self.kept[..self.used].rotate_left(past);
        self.used -= past;
    }

    /// The system in which the first step kept was made.
    pub(crate) fn system(&self) -> Option<usize> {
        self.kept[..self.used].first().map(|segment| segment.system)
    }

    /// Asks whether a row of the first step is read from its polynomials: what λ is off there makes of every row, relative to what that has
    /// reached.
    pub(crate) fn within(&mut self, curved: &Curved, tolerance: f64) -> Within<'_> {
        let Self {
            kept, off, reached, ..
        } = self;
        let segment = &mut kept[0];
        let (n, m) = (curved.n, curved.m);
        reached.resize(curved.readings.units.len(), 0.0);
        let trusted = *segment.trusted.get_or_insert_with(|| {
            [1, 4].into_iter().all(|tested| {
                let weights = interpolation(NODES[tested]);
                off.clear();
                off.resize(curved.forms.width(), 0.0);
                for &j in &curved.readings.ports {
                    let polynomial: f64 = (weights.iter().zip(THROUGH))
                        .map(|(w, k)| w * segment.lambdas[k * m + j])
                        .sum();
                    off[n + j] = polynomial - segment.lambdas[tested * m + j];
                }
                curved.readings.are_within(off, reached, ROWS * tolerance)
            })
        });
        if trusted {
            Within::Polynomials
        } else {
            Within::Step(&segment.start, segment.held.as_deref())
        }
    }

    /// Reads the rows of the first step at `t` from its polynomials.
    pub(crate) fn interpolate(
        &mut self,
        curved: &Curved,
        inputs: &Inputs,
        t: f64,
        row: &mut [f64],
    ) {
        let Segment {
            start,
            end,
            x,
            slope,
            lambdas,
            ..
        } = &self.kept[0];
        let (n, m) = (curved.n, curved.m);
        let h = end - start.t;
        let s = (t - start.t) / h;
        let r = 1.0 - s;
        // Hermite's basis.
        let (from, out) = (r * r * (1.0 + 2.0 * s), h * s * r * r);
        let (to, into) = (s * s * (3.0 - 2.0 * s), -h * s * s * r);
        self.w.resize(curved.forms.width(), 0.0);
        for k in 0..n {
            self.w[k] = from * start.x[k] + out * start.slope[k] + to * x[k] + into * slope[k];
        }
        let weights = interpolation(s);
        for &j in &curved.readings.ports {
            self.w[n + j] = (weights.iter().zip(THROUGH))
                .map(|(w, k)| w * lambdas[k * m + j])
                .sum();
        }
        let u = &mut self.w[n + m..n + m + curved.p];
        inputs.varying_at(t, &mut self.pieces, u);
        self.read(curved, inputs, t, row);
    }

    /// Reads the rows at the end of a step that a trial has made.
    pub(crate) fn at_end(
        &mut self,
        curved: &Curved,
        inputs: &Inputs,
        (t, trial): (f64, &Trial),
        row: &mut [f64],
    ) {
        let (n, m) = (curved.n, curved.m);
        self.w.resize(curved.forms.width(), 0.0);
        self.w[..n].copy_from_slice(&trial.x);
        let last = (STAGES - 1) * m;
        self.w[n..n + m].copy_from_slice(&trial.lambdas[last..last + m]);
        self.w[n + m..n + m + curved.p].copy_from_slice(&trial.u);
        self.read(curved, inputs, t, row);
    }

    /// Rows at x, λ and u in `w`.
    fn read(&mut self, curved: &Curved, inputs: &Inputs, t: f64, row: &mut [f64]) {
        let (at, p) = (curved.n + curved.m, curved.p);
        if curved.readings.slopes {
            self.du.resize(inputs.len(), 0.0);
            inputs.slopes(t, &mut self.du);
            for (k, &j) in curved.varying.iter().enumerate() {
                self.w[at + p + k] = self.du[j];
            }
        }
        self.w[at + 2 * p] = 1.0;
        for (i, value) in row.iter_mut().enumerate() {
            *value = curved.readings.value(i, &self.w);
        }
        grow(&mut self.reached, row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of a second from 0 s, 1 s and 2 s.
    fn three() -> Segments {
        let segment = |k: usize| Segment {
            start: Start {
                t: k as f64,
                ..Start::default()
            },
            end: (k + 1) as f64,
            system: k,
            ..Segment::default()
        };
        Segments {
            kept: (0..3).map(segment).collect(),
            used: 3,
            ..Segments::default()
        }
    }

    #[test]
    fn a_step_that_ends_at_a_time_stays_for_its_row() {
        for (t, first) in [(0.5, Some(0)), (1.0, Some(0)), (1.5, Some(1)), (3.5, None)] {
            let mut segments = three();
            segments.forget_before(t);
            assert_eq!(segments.system(), first, "{t}");
        }
    }
}
