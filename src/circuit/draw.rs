//! Random values: the functions of Monte Carlo runs, and tolerances.
//!
//! A value that is drawn depends on the seed, the number of the sample and the place in the netlist where it stands, and on nothing else: not
//! on the order of evaluation, on threads, or on what else is drawn.

use chacha20::ChaCha8Rng;
use chacha20::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};

use super::elaborate::ElaborateOptions;
use super::scope::Scopes;
use crate::algebra::Value;
use crate::diagnostic::{Diagnostic, Span};

/// How a deviation is distributed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spread {
    /// Evenly between −1 and 1.
    Uniform,
    /// Normally, with mean 0 and standard deviation 1.
    Normal,
    /// −1 or 1, as likely.
    Extreme,
}

/// How the value of an element or parameter is drawn about its nominal one.
#[derive(Debug, Clone, PartialEq)]
pub struct Tolerance {
    /// The element, or the `.param`, in lower case.
    pub name: String,
    /// The distribution.
    pub spread: Spread,
    /// What the deviation is multiplied with, relative to the nominal value.
    pub relative: f64,
}

/// A sample of a sequence of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Draw {
    seed: u64,
    sample: u64,
}

impl Draw {
    /// The sample that the options ask for.
    pub(super) fn of(options: &ElaborateOptions) -> Option<Self> {
        let seed = options.seed;
        options.sample.map(|sample| Self { seed, sample })
    }

    /// The deviation at a place, in −1…1, or with standard deviation 1.
    fn deviation(self, place: u64, spread: Spread) -> f64 {
        let mut key = [0; 32];
        let words = [self.seed, self.sample, place];
        for (bytes, word) in key.chunks_exact_mut(8).zip(words) {
            bytes.copy_from_slice(&word.to_le_bytes());
        }
        let mut generator = ChaCha8Rng::from_seed(key);
        let half: f64 = match spread {
            Spread::Normal => return StandardNormal.sample(&mut generator),
            Spread::Uniform | Spread::Extreme => StandardUniform.sample(&mut generator),
        };
        let uniform = 2.0 * half - 1.0;
        if spread == Spread::Uniform {
            uniform
        } else {
            1.0_f64.copysign(uniform)
        }
    }
}

/// Where in a netlist something stands, as a number: that of a name.
pub(super) fn place(name: &str) -> u64 {
    beneath(0, name.as_bytes())
}

/// The number of a place beneath another one (FNV-1a).
fn beneath(place: u64, bytes: &[u8]) -> u64 {
    let start = place ^ 0xcbf2_9ce4_8422_2325;
    let mix = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3);
    bytes.iter().fold(start, mix)
}

impl Scopes<'_> {
    /// The place of an expression in what is being evaluated.
    pub(super) fn beneath(&self, span: Span) -> u64 {
        let place = beneath(self.place, &span.file.0.to_le_bytes());
        beneath(place, &span.start.to_le_bytes())
    }

    /// What a random function gives: its nominal value where no sample is drawn.
    pub(super) fn random(
        &mut self,
        span: Span,
        (spread, nominal, width): (Spread, f64, f64),
    ) -> f64 {
        if self.draw.is_none() && !self.random {
            let message = "random values are nominal here";
            let note = Diagnostic::note("random", span, message).label("drawn from a distribution");
            let help = "`circ sweep --mc N` draws N samples, `--sample K` one; `.step` draws anew for every run";
            self.findings.tell(note.help(help));
        }
        self.random = true;
        let place = self.beneath(span);
        let deviation = self.draw.map_or(0.0, |draw| draw.deviation(place, spread));
        nominal + width * deviation
    }

    /// The value of an element or parameter with a tolerance, in the sample that is drawn.
    pub(super) fn toleranced(&self, value: Value, name: &str, own: Option<f64>) -> Value {
        let Some(draw) = self.draw else {
            return value;
        };
        let given = self.tolerances.iter().rev().find(|t| t.name == name);
        let given = given.map(|t| (t.spread, t.relative));
        match given.or(own.map(|relative| (Spread::Uniform, relative))) {
            Some((spread, relative)) => {
                let deviation = draw.deviation(place(name), spread);
                Value::binary(value.f64 * (1.0 + relative * deviation))
            }
            None => value,
        }
    }

    /// Evaluates what does not depend on where it is asked for: a parameter, the values of a model.
    pub(super) fn alone<T>(&mut self, name: &str, evaluate: impl FnOnce(&mut Self) -> T) -> T {
        let outer = std::mem::replace(&mut self.place, place(name));
        let found = evaluate(self);
        self.place = outer;
        found
    }
}
