//! Dense output: the quantities at any time within a step that was made.
//!
//! The state follows Hermite's cubic through both ends and their slopes, whose error is of fourth order as the step's own, where its mean over the step
//! is that of the stages (a slope that ends right behind the start, as of a current that a junction stops, makes another cubic); λ follows the
//! cubic through four of the stages. The other two stages test it: where λ bends (a diode that turns on) the polynomial is not trusted, and
//! λ is found on the laws, from the polynomials of the state: y = C x + D λ + G u + F. Where that does not meet the stages either (a large current
//! that a small error of the state decides), a step of the method to the middle makes the state's polynomial one of degree 5, through the middle
//! and its slope too; the one of degree 4 that leaves out that slope tests it. Where that does not hold, or the rows are few, a step from the start of
//! the segment to the row takes its place. Sources are evaluated at the time itself.

use super::tableau::{NODES, STAGES, STRAY, THROUGH, between_stages, interpolation};
use super::{Curved, Start, Trial};
use crate::integrate::grow;
use crate::integrate::inputs::{Inputs, Pieces};
use crate::settings::tolerances::steps::ROWS;

/// So many rows ahead are worth a step to the middle.
const FEW: u32 = 2;

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
    /// The state in the middle and its slope, where it was asked for.
    has_middle: bool,
    middle: [Vec<f64>; 2],
    /// By state: what the mean of the cubic is off.
    stray: Vec<f64>,
    /// By stage: λ and y.
    lambdas: Vec<f64>,
    ys: Vec<f64>,
    /// What a row is read from; not asked yet where `None`.
    read_from: Option<Within>,
}

/// Which polynomial the state follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Degree {
    /// Hermite's, through both ends.
    Three,
    /// Through the middle too, without its slope.
    Four,
    /// With it.
    Five,
}

impl Segment {
    fn state_at(&self, part: f64, degree: Degree, state: &mut [f64]) {
        match degree {
            Degree::Three => self.cubic(part, state),
            Degree::Four | Degree::Five => self.through_middle(part, degree, state),
        }
    }

    /// Hermite's polynomial over both ends and the middle, in τ from −1 to 1; that of degree 4 differs by a multiple of τ (1 − τ²)².
    fn through_middle(&self, part: f64, degree: Degree, state: &mut [f64]) {
        let [x, slope] = &self.middle;
        let (tau, half) = (2.0 * part - 1.0, 0.5 * (self.end - self.start.t));
        let square = |v: f64| v * v;
        let (before, after) = (
            square(0.5 * tau * (tau - 1.0)),
            square(0.5 * tau * (tau + 1.0)),
        );
        let between = square(1.0 - tau * tau);
        for (k, state) in state.iter_mut().enumerate() {
            let (from, to) = (self.start.x[k], self.x[k]);
            let (out, into) = (half * self.start.slope[k], half * self.slope[k]);
            let mid = match degree {
                Degree::Five => half * slope[k],
                _ => 0.75 * (to - from) - 0.25 * (out + into),
            };
            *state = before * (from + (tau + 1.0) * (3.0 * from + out))
                + between * (x[k] + tau * mid)
                + after * (to - (tau - 1.0) * (3.0 * to - into));
        }
    }

    /// Hermite's cubic at a part of the step.
    fn cubic(&self, part: f64, state: &mut [f64]) {
        let ends = [
            (&self.start.x[..], &self.start.slope[..]),
            (&self.x, &self.slope),
        ];
        hermite((part, self.end - self.start.t), ends, state);
    }
}

/// The cubic with these values and slopes at both ends, at a part of the length h.
fn hermite((part, h): (f64, f64), [from, to]: [(&[f64], &[f64]); 2], state: &mut [f64]) {
    let (s, r) = (part, 1.0 - part);
    let (begin, out) = (r * r * (1.0 + 2.0 * s), h * s * r * r);
    let (end, into) = (s * s * (3.0 - 2.0 * s), -h * s * s * r);
    for (k, state) in state.iter_mut().enumerate() {
        *state = begin * from.0[k] + out * from.1[k] + end * to.0[k] + into * to.1[k];
    }
}

/// The cubic of port j through the stages [`THROUGH`], from values by stage.
fn through_stages(weights: [f64; 4], values: &[f64], (m, j): (usize, usize)) -> f64 {
    (weights.iter().zip(THROUGH))
        .map(|(w, k)| w * values[k * m + j])
        .sum()
}

impl Trial {
    /// State, λ and y at a part of the step from `start`, on the polynomials that rows are read from.
    pub(crate) fn at_part(
        &self,
        start: &Start,
        part: f64,
        (x, lambda, y): (&mut [f64], &mut [f64], &mut [f64]),
    ) {
        let ends = [
            (&start.x[..], &start.slope[..]),
            (&self.x, self.end_slope()),
        ];
        hermite((part, self.h), ends, x);
        let (weights, m) = (interpolation(part), lambda.len());
        for j in 0..m {
            lambda[j] = through_stages(weights, &self.lambdas, (m, j));
            y[j] = through_stages(weights, &self.ys, (m, j));
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
        segment.has_middle = false;
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

    /// The time in the middle of the first step, where a step to it serves rows that are `apart` from one at `t` on; `None` where it was made, the
    /// rows are few, or ports are ideal: on a corner the state alone does not tell their λ.
    pub(crate) fn middle(&self, curved: &Curved, (t, apart): (f64, f64)) -> Option<f64> {
        let segment = &self.kept[0];
        let serves = t + f64::from(FEW) * apart <= segment.end
            && !segment.has_middle
            && curved.ideal.is_empty();
        serves.then_some(0.5 * (segment.start.t + segment.end))
    }

    /// Takes the step to the middle, and asks again what a row is read from.
    pub(crate) fn take_middle(
        &mut self,
        curved: &mut Curved,
        inputs: &Inputs,
        tolerance: f64,
        trial: &Trial,
    ) -> Within {
        let segment = &mut self.kept[0];
        segment.has_middle = true;
        let [x, slope] = &mut segment.middle;
        x.clone_from(&trial.x);
        slope.clear();
        slope.extend_from_slice(trial.end_slope());
        let found = if self.degrees_agree(curved, inputs, ROWS * tolerance) {
            Within::Laws
        } else {
            Within::Step
        };
        self.kept[0].read_from = Some(found);
        found
    }

    /// Whether the polynomials of degree 4 and 5 make the same rows where they are farthest apart.
    fn degrees_agree(&mut self, curved: &mut Curved, inputs: &Inputs, within: f64) -> bool {
        let (n, m) = (curved.n, curved.m);
        let farthest = 0.5 / 5_f64.sqrt();
        [0.5 - farthest, 0.5 + farthest].into_iter().all(|part| {
            if !self.find_on_laws(curved, inputs, (part, Degree::Four)) {
                return false;
            }
            self.off.clone_from(&self.w);
            if !self.find_on_laws(curved, inputs, (part, Degree::Five)) {
                return false;
            }
            for (off, w) in self.off[..n + m].iter_mut().zip(&self.w) {
                *off -= w;
            }
            self.off[n + m..].fill(0.0);
            curved.readings.are_within(&self.off, &self.reached, within)
        })
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
                let polynomial = through_stages(weights, &segment.lambdas, (m, j));
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
                if !self.find_on_laws(curved, inputs, (NODES[tested], Degree::Three)) {
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
    fn find_on_laws(
        &mut self,
        curved: &mut Curved,
        inputs: &Inputs,
        (part, degree): (f64, Degree),
    ) -> bool {
        let (n, m) = (curved.n, curved.m);
        let segment = &self.kept[0];
        self.w.resize(curved.forms.width(), 0.0);
        segment.state_at(part, degree, &mut self.w[..n]);
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
        let Segment {
            start,
            end,
            has_middle,
            ..
        } = &self.kept[0];
        let part = (t - start.t) / (end - start.t);
        let degree = if *has_middle {
            Degree::Five
        } else {
            Degree::Three
        };
        let found = self.find_on_laws(curved, inputs, (part, degree));
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
        segment.cubic(s, &mut self.w[..n]);
        let weights = interpolation(s);
        for &j in &curved.readings.ports {
            self.w[n + j] = through_stages(weights, &segment.lambdas, (m, j));
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

    /// A step of two seconds from −1 s along a polynomial.
    fn along(polynomial: &[f64]) -> Segment {
        let at = |t: f64| polynomial.iter().rev().fold(0.0, |sum, c| sum * t + c);
        let slope = |t: f64| (at(t + 1e-4) - at(t - 1e-4)) / 2e-4;
        Segment {
            start: Start {
                t: -1.0,
                x: vec![at(-1.0)],
                slope: vec![slope(-1.0)],
                ..Start::default()
            },
            end: 1.0,
            x: vec![at(1.0)],
            slope: vec![slope(1.0)],
            has_middle: true,
            middle: [vec![at(0.0)], vec![slope(0.0)]],
            ..Segment::default()
        }
    }

    #[test]
    fn a_state_is_the_polynomial_that_its_degree_can_be() {
        let all = [0.3, -1.0, 2.0, 0.7, -0.4, 1.1];
        let degrees = [(Degree::Three, 3), (Degree::Four, 4), (Degree::Five, 5)];
        for (degree, highest) in degrees {
            for terms in 0..=highest {
                let segment = along(&all[..=terms]);
                for part in [0.0, 0.2, 0.5, 0.9, 1.0] {
                    let t: f64 = 2.0 * part - 1.0;
                    let expected = all[..=terms].iter().rev().fold(0.0, |sum, c| sum * t + c);
                    let mut state = [0.0];
                    segment.state_at(part, degree, &mut state);
                    assert!(
                        (state[0] - expected).abs() < 1e-6,
                        "{degree:?} {terms} {part}"
                    );
                }
            }
            let mut state = [0.0];
            along(&all).state_at(0.2, degree, &mut state);
            let expected = all.iter().rev().fold(0.0, |sum, c| sum * -0.6 + c);
            let met = (state[0] - expected).abs() < 1e-6;
            assert_eq!(met, degree == Degree::Five, "{degree:?}");
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
