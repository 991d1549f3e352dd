//! Dense output: the quantities at any time within a step that was made.
//!
//! The state follows Hermite's cubic through both ends and their slopes, whose error is of fourth order as the step's own, where its mean over the step
//! is that of the stages (a slope that ends right behind the start, as of a current that a junction stops, makes another cubic); λ follows the
//! cubic through four of the stages. The other two stages test it: where λ bends (a diode that turns on) the polynomial is not trusted, and
//! λ is found on the laws, from the polynomials of the state: y = C x + D λ + G u + F. Where that does not meet the stages either (a large current
//! that a small error of the state decides), a step of the method from the start of the segment to the row takes its place. Sources are
//! evaluated at the time itself.

use super::tableau::{NODES, STAGES, STRAY, THROUGH, between_stages, interpolation};
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
    /// By state: what the mean of the cubic is off.
    stray: Vec<f64>,
    /// By stage: λ and y.
    lambdas: Vec<f64>,
    ys: Vec<f64>,
    /// What a row is read from; not asked yet where `None`.
    read_from: Option<Within>,
}

impl Segment {
    /// Hermite's cubic at a part of the step.
    fn state_at(&self, part: f64, state: &mut [f64]) {
        let (s, r, h) = (part, 1.0 - part, self.end - self.start.t);
        let (from, out) = (r * r * (1.0 + 2.0 * s), h * s * r * r);
        let (to, into) = (s * s * (3.0 - 2.0 * s), -h * s * s * r);
        for (k, state) in state.iter_mut().enumerate() {
            *state = from * self.start.x[k]
                + out * self.start.slope[k]
                + to * self.x[k]
                + into * self.slope[k];
        }
    }
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
    /// λ and y on the laws.
    found: (Vec<f64>, Vec<f64>),
    /// What λ is off, over [x | λ | u | u' | 1], and the largest |value| of every row so far.
    off: Vec<f64>,
    reached: Vec<f64>,
}

/// What a row within a step is read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Within {
    /// The polynomials.
    Polynomials,
    /// Those of the state, with λ on the laws.
    Laws,
    /// A step of the method from [`Segments::first`].
    Step,
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
        segment.stray.clear();
        segment.stray.resize(trial.x.len(), 0.0);
        for (weight, slopes) in STRAY.iter().zip(trial.slopes()) {
            for (stray, slope) in segment.stray.iter_mut().zip(slopes) {
                *stray += trial.h * weight * slope;
            }
        }
        segment.lambdas.clone_from(&trial.lambdas);
        segment.ys.clone_from(&trial.ys);
        segment.read_from = None;
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

    /// Where the first step started, and the sides on which its ideal ports were held.
    pub(crate) fn first(&self) -> (&Start, Option<&[bool]>) {
        (&self.kept[0].start, self.kept[0].held.as_deref())
    }

    /// Asks what a row of the first step is read from: what λ is off at the stages makes of every row, relative to what that has reached.
    pub(crate) fn within(
        &mut self,
        curved: &mut Curved,
        inputs: &Inputs,
        tolerance: f64,
    ) -> Within {
        self.reached.resize(curved.readings.units.len(), 0.0);
        if let Some(known) = self.kept[0].read_from {
            return known;
        }
        let within = ROWS * tolerance;
        let found = if !self.state_is_a_cubic(curved, within) {
            Within::Step
        } else if self.meet_stages(curved, within) {
            Within::Polynomials
        } else if self.laws_meet_stages(curved, inputs, within) {
            Within::Laws
        } else {
            Within::Step
        };
        self.kept[0].read_from = Some(found);
        found
    }

    /// Whether the state's polynomials have the mean of the stages.
    fn state_is_a_cubic(&mut self, curved: &Curved, within: f64) -> bool {
        self.off.clear();
        self.off.extend_from_slice(&self.kept[0].stray);
        self.off.resize(curved.forms.width(), 0.0);
        curved.readings.are_within(&self.off, &self.reached, within)
    }

    /// Whether the polynomials of λ meet the stages that they do not go through.
    fn meet_stages(&mut self, curved: &Curved, within: f64) -> bool {
        let Self {
            kept, off, reached, ..
        } = self;
        let segment = &kept[0];
        let (n, m) = (curved.n, curved.m);
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
            curved.readings.are_within(off, reached, within)
        })
    }

    /// Whether λ on the laws, from the polynomials of the state, meets the stages between both ends. Ideal ports are not asked: on a corner
    /// the state alone does not tell their λ.
    fn laws_meet_stages(&mut self, curved: &mut Curved, inputs: &Inputs, within: f64) -> bool {
        let (n, m) = (curved.n, curved.m);
        curved.ideal.is_empty()
            && (1..STAGES - 1).all(|tested| {
                if !self.find_on_laws(curved, inputs, NODES[tested]) {
                    return false;
                }
                self.off.clear();
                self.off.resize(curved.forms.width(), 0.0);
                for j in 0..m {
                    self.off[n + j] = self.found.0[j] - self.kept[0].lambdas[tested * m + j];
                }
                curved.readings.are_within(&self.off, &self.reached, within)
            })
    }

    /// x and u at a part of the first step into `w`, and λ on the laws there; `false` where Newton's method does not find them.
    fn find_on_laws(&mut self, curved: &mut Curved, inputs: &Inputs, part: f64) -> bool {
        let (n, m) = (curved.n, curved.m);
        let segment = &self.kept[0];
        self.w.resize(curved.forms.width(), 0.0);
        segment.state_at(part, &mut self.w[..n]);
        let t = segment.start.t + part * (segment.end - segment.start.t);
        let u = &mut self.w[n + m..n + m + curved.p];
        inputs.varying_at(t, &mut self.pieces, u);
        // From between the stages on both sides, which λ and y do not leave where they rise or fall.
        let (a, b, weight) = between_stages(part);
        for (all, found) in [
            (&segment.lambdas, &mut self.found.0),
            (&segment.ys, &mut self.found.1),
        ] {
            found.clear();
            found.extend((0..m).map(|j| (1.0 - weight) * all[a * m + j] + weight * all[b * m + j]));
        }
        let (x, u) = (&self.w[..n], &self.w[n + m..n + m + curved.p]);
        let (lambda, y) = &mut self.found;
        if !curved.at_once(x, u, (lambda, y)) {
            return false;
        }
        self.w[n..n + m].copy_from_slice(&self.found.0);
        true
    }

    /// Reads the rows of the first step at `t` from λ on the laws; `false` where they are not found.
    pub(crate) fn on_laws(
        &mut self,
        curved: &mut Curved,
        inputs: &Inputs,
        t: f64,
        row: &mut [f64],
    ) -> bool {
        let Segment { start, end, .. } = &self.kept[0];
        let found = self.find_on_laws(curved, inputs, (t - start.t) / (end - start.t));
        if found {
            self.read(curved, inputs, t, row);
        }
        found
    }

    /// Reads the rows of the first step at `t` from its polynomials.
    pub(crate) fn interpolate(
        &mut self,
        curved: &Curved,
        inputs: &Inputs,
        t: f64,
        row: &mut [f64],
    ) {
        let segment = &self.kept[0];
        let (n, m) = (curved.n, curved.m);
        let s = (t - segment.start.t) / (segment.end - segment.start.t);
        self.w.resize(curved.forms.width(), 0.0);
        segment.state_at(s, &mut self.w[..n]);
        let weights = interpolation(s);
        for &j in &curved.readings.ports {
            self.w[n + j] = (weights.iter().zip(THROUGH))
                .map(|(w, k)| w * segment.lambdas[k * m + j])
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
