//! What small changes of sources make of a run in sparse steps: its variational equation, in the steps and along the active sets of its [`Tape`].
//!
//! ```text
//! stage      (I − γh Â) δx_i = δx + h Σ_{j<i} a_ij δk_j + γh Ê δu(t_i),
//! integral   ∫ δy e^{−jΩt} dt = h Σ b_i δy_i e^{−jΩt_i},
//! ```
//!
//! both of the order of the method. A switch whose control γ(u) passes its threshold moves by δt = −γ_u δu/γ̇, which leaves
//!
//! ```text
//! δs⁻ + s'⁻ δt before the change of position,      δx⁺ − x'⁺ δt behind it,      (y⁻ − y⁺) δt e^{−jΩt} in the integral.
//! ```

use nalgebra::Complex;

use super::Returns;
use super::bend::Bend;
use super::shift::Shift;
use super::system::System;
use super::tape::{Move, Set, Tape};
use crate::integrate::curved::tableau::{GAMMA, LOWER, NODES, STAGES, WEIGHTS};
use crate::integrate::error::Error;
use crate::integrate::reading::Point;
use crate::lcs::Input;

/// A sine on sources: δu(t) = part of û e^{jω(t − origin)}.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sine<'a> {
    /// û.
    pub(crate) phasors: &'a [Complex<f64>],
    /// rad/s.
    pub(crate) omega: f64,
    /// s.
    pub(crate) origin: f64,
}

/// The real or the imaginary part of a sine.
#[derive(Debug, Clone, Copy)]
struct Part<'a> {
    sine: Sine<'a>,
    imaginary: bool,
}

impl Part<'_> {
    /// δu and δu'.
    fn at(&self, t: f64) -> [Vec<f64>; 2] {
        let Sine {
            phasors,
            omega,
            origin,
        } = self.sine;
        let turn = Complex::from_polar(1.0, omega * (t - origin));
        let part = |turn: Complex<f64>| {
            let values = phasors.iter().map(|phasor| phasor * turn);
            values
                .map(|value| if self.imaginary { value.im } else { value.re })
                .collect()
        };
        [part(turn), part(turn * Complex::new(0.0, omega))]
    }
}

/// Where the variation stands.
struct Now<'a> {
    systems: &'a mut [(Vec<bool>, System)],
    part: Part<'a>,
    /// Ω, rad/s.
    bands: &'a [f64],
    /// By band: ∫ δy e^{−jΩt} dt of every output.
    integrals: Vec<Vec<Complex<f64>>>,
    system: usize,
    x: Vec<f64>,
    lambda: Vec<f64>,
    slope: Vec<f64>,
    /// What the state behind a shifted change of position is off by.
    behind: Vec<f64>,
}

impl Tape {
    /// What a change of all storage quantities at its start and a sine of the sources come to at its end, and the integrals over it for these Ω, rad/s. The change is a complex one, as is the sine:
    /// both parts are driven by themselves. `None` where an active set leaves it open.
    ///
    /// # Errors
    /// The switches have no derivative.
    pub(super) fn driven(
        &self,
        systems: &mut [(Vec<bool>, System)],
        change: &[Complex<f64>],
        (sine, bands): (Sine<'_>, &[f64]),
    ) -> Result<Option<Driven>, Error> {
        if self.open {
            return Ok(None);
        }
        let [re, im] = [false, true].map(|imaginary| {
            let change = change.iter();
            let change = change.map(|change| if imaginary { change.im } else { change.re });
            let part = Part { sine, imaginary };
            self.part_driven(systems, &change.collect::<Vec<f64>>(), (part, bands))
        });
        let (re, im) = (re?, im?);
        Ok(re.zip(im).map(|(re, im)| re.plus_turned(&im)))
    }

    fn part_driven(
        &self,
        systems: &mut [(Vec<bool>, System)],
        change: &[f64],
        (part, bands): (Part<'_>, &[f64]),
    ) -> Result<Option<Driven>, Error> {
        let first = &systems[self.first].1;
        let outputs = first.lcs.outputs.len();
        let x = first.change_of_storage(change);
        let mut now = Now {
            part,
            bands,
            integrals: vec![vec![Complex::default(); outputs]; bands.len()],
            system: self.first,
            lambda: vec![0.0; first.m()],
            slope: vec![0.0; x.len()],
            behind: Vec::new(),
            x,
            systems,
        };
        let mut t = part.sine.origin;
        for part in &self.moves {
            let made = match part {
                Move::Position { to, shift, .. } => {
                    now.moves(*to, t, shift.as_deref())?;
                    Some(())
                }
                Move::Bend(bend) => {
                    now.bends(bend);
                    Some(())
                }
                Move::Jump { t, h, sets, .. } => now.jumps(*t, *h, sets),
                Move::Step { end, h, sets, .. } => {
                    t = *end;
                    now.steps(*end, *h, sets)
                }
            };
            if made.is_none() {
                return Ok(None);
            }
        }
        let [u, _] = part.at(t);
        let end = now.systems[now.system].1.storage_rate(&now.x, &u);
        Ok(Some(Driven {
            end: end.into_iter().map(Complex::from).collect(),
            integrals: now.integrals,
        }))
    }
}

/// What a sine makes of a run.
#[derive(Debug)]
pub(crate) struct Driven {
    /// By storage quantity, at its end.
    pub(crate) end: Vec<Complex<f64>>,
    /// By Ω and output.
    pub(crate) integrals: Vec<Vec<Complex<f64>>>,
}

impl Driven {
    /// This, and j times the other.
    fn plus_turned(mut self, other: &Self) -> Self {
        let j = Complex::new(0.0, 1.0);
        let sums = self.integrals.iter_mut().zip(&other.integrals);
        for (own, other) in sums.chain([(&mut self.end, &other.end)]) {
            let both = own.iter_mut().zip(other);
            both.for_each(|(own, other)| *own += j * other);
        }
        self
    }
}

impl Now<'_> {
    fn moves(&mut self, to: usize, t: f64, shift: Option<&Shift>) -> Result<(), Error> {
        let t = shift.map_or(t, |shift| shift.t);
        let [u, _] = self.part.at(t);
        let mut storage = self.systems[self.system].1.storage_rate(&self.x, &u);
        self.behind.clear();
        if let Some(shift) = shift {
            let by = shift.by(&u, &self.systems[to].1.lcs.inputs)?;
            if by != 0.0 {
                let moved = storage.iter_mut().zip(&shift.before);
                moved.for_each(|(s, rate)| *s += rate * by);
                self.behind = shift.after.iter().map(|rate| rate * by).collect();
                for (band, sums) in self.bands.iter().zip(&mut self.integrals) {
                    let turn = Complex::from_polar(by, -band * (t - self.part.sine.origin));
                    let steps = sums.iter_mut().zip(&shift.step);
                    steps.for_each(|(sum, step)| *sum += turn * step);
                }
            }
        }
        self.x = self.systems[to].1.change_of_storage(&storage);
        self.system = to;
        Ok(())
    }

    fn bends(&mut self, bend: &Bend) {
        let [u, _] = self.part.at(bend.t);
        let by = bend.by(&self.x, &u);
        let moved = self.x.iter_mut().zip(&bend.rate);
        moved.for_each(|(x, rate)| *x += rate * by);
        for (band, sums) in self.bands.iter().zip(&mut self.integrals) {
            let turn = Complex::from_polar(by, -band * (bend.t - self.part.sine.origin));
            let sides = bend.before.iter().zip(&bend.behind);
            let steps = sums.iter_mut().zip(sides);
            steps.for_each(|(sum, (before, behind))| *sum += turn * (before - behind));
        }
    }

    fn jumps(&mut self, t: f64, h: (f64, f64), sets: &[Set]) -> Option<()> {
        let [u, _] = self.part.at(t);
        let mut base = Vec::new();
        for set in sets {
            base.clone_from(&self.x);
            self.implicit(h, set, &u)?;
        }
        // Back to the instant, as the run goes.
        let back = sets.len().saturating_sub(1) as f64;
        let ends = self.x.iter().zip(&base);
        self.x = ends.map(|(b, a)| a - back * (b - a)).collect();
        if !self.behind.is_empty() {
            let moved = self.x.iter_mut().zip(&self.behind);
            moved.for_each(|(x, by)| *x -= by);
            self.behind.clear();
            let kept = self.x.clone();
            self.implicit(h, sets.last()?, &u)?;
            self.x = kept;
        }
        self.slope = self.systems[self.system]
            .1
            .rate_of_change(&self.x, &self.lambda, &u);
        Some(())
    }

    fn steps(&mut self, end: f64, (h, slack): (f64, f64), sets: &[Option<Set>]) -> Option<()> {
        let start = self.x.clone();
        let mut slopes: [Vec<f64>; STAGES] = Default::default();
        slopes[0] = std::mem::take(&mut self.slope);
        self.add(end - h, h * WEIGHTS[0]);
        for (stage, set) in (1..STAGES).zip(sets) {
            let t = end - (1.0 - NODES[stage]) * h;
            let mut base = start.clone();
            for (slope, weight) in slopes.iter().zip(LOWER[stage]) {
                let add = base.iter_mut().zip(slope);
                add.for_each(|(x, k)| *x += h * weight * k);
            }
            self.x.clone_from(&base);
            let [u, _] = self.part.at(t);
            self.implicit((GAMMA * h, slack), set.as_ref()?, &u)?;
            let moved = self.x.iter().zip(&base);
            slopes[stage] = moved.map(|(x, old)| (x - old) / (GAMMA * h)).collect();
            self.add(t, h * WEIGHTS[stage]);
        }
        self.slope = std::mem::take(&mut slopes[STAGES - 1]);
        Some(())
    }

    /// x and λ of an implicit step from x with the sources at its end.
    fn implicit(&mut self, h: (f64, f64), set: &[bool], u: &[f64]) -> Option<()> {
        let System { lcs, kernel, .. } = &mut self.systems[self.system].1;
        lcs.e.add_times(h.0, u, &mut self.x);
        let mut q = vec![0.0; lcs.ports.len()];
        lcs.g.add_times(1.0, u, &mut q);
        let made = kernel.change_with(h, set, &mut self.x, (&q, &mut self.lambda));
        made.then_some(())
    }

    /// Adds the outputs at a time, weighed, to the integrals.
    fn add(&mut self, t: f64, weight: f64) {
        if self.bands.is_empty() || weight == 0.0 {
            return;
        }
        let [u, du] = self.part.at(t);
        let at = Point {
            x: &self.x,
            lambda: &self.lambda,
            u: &u,
            du: &du,
        };
        let values = self.systems[self.system].1.output_change(at);
        for (band, sums) in self.bands.iter().zip(&mut self.integrals) {
            let turn = Complex::from_polar(weight, -band * (t - self.part.sine.origin));
            let both = sums.iter_mut().zip(&values);
            both.for_each(|(sum, value)| *sum += turn * value);
        }
    }
}

impl Returns {
    /// The sources.
    pub(crate) fn inputs(&self) -> &[Input] {
        &self.sparse.system().lcs.inputs
    }

    /// No step is longer than this from now on, s, nor than asked for; what shifts switches is written down.
    pub(crate) fn resolve(&mut self, longest: f64) {
        self.sparse.longest = self.longest.min(longest);
        self.with_shifts = true;
    }

    /// What a change of the storage where a tape begins and a sine of the sources come to, and the integrals of the outputs for these Ω, rad/s; `None` where an active set leaves
    /// it open.
    ///
    /// # Errors
    /// [`Reason::NotSmooth`]: switches that the sine shifts have no derivative.
    pub(crate) fn driven(
        &mut self,
        tape: &Tape,
        change: &[Complex<f64>],
        sine: (Sine<'_>, &[f64]),
    ) -> Result<Option<Driven>, Error> {
        tape.driven(&mut self.sparse.systems, change, sine)
    }
}
