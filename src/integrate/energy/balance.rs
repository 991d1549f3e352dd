//! The energies of a run, added up.

use crate::integrate::Energy;

/// Sums of a run.
#[derive(Debug, Clone, Copy, Default)]
pub struct Balance {
    source: f64,
    dissipated: f64,
    jumps: f64,
    numerical: f64,
    first: f64,
    last: f64,
    largest: f64,
}

impl Balance {
    /// A balance that starts with this stored energy, J.
    #[must_use]
    pub fn new(stored: f64) -> Self {
        Self {
            first: stored,
            last: stored,
            largest: stored.abs(),
            ..Self::default()
        }
    }

    /// So much more is stored from the start on, J.
    pub(crate) fn hold(&mut self, more: f64) {
        self.first += more;
        self.last += more;
        self.largest = self.largest.max(self.last.abs());
    }

    /// The largest energy noted, J.
    pub(crate) fn largest(&self) -> f64 {
        self.largest
    }

    /// Adds energy from sources and dissipated energy, J.
    #[inline]
    pub fn add(&mut self, (source, dissipated): (f64, f64)) {
        self.source += source;
        self.dissipated += dissipated;
    }

    /// Adds a jump in which sources brought and which lost so much energy, J.
    pub fn add_jump(&mut self, (source, loss): (f64, f64)) {
        self.source += source;
        self.jumps += loss;
    }

    /// Takes back all but a part of the jumps since `before`, whose storage changed by Δ in all with `square` = ½ΔᵀMΔ: sources deliver
    /// in proportion, and where the whole loses L, a part a loses a(L + square) − a² square.
    pub(crate) fn take_part(&mut self, before: &Self, part: f64, square: f64) {
        let (source, loss) = (self.source - before.source, self.jumps - before.jumps);
        *self = *before;
        self.add_jump((part * source, part * (loss + square) - part * part * square));
    }

    /// Energy lost in jumps so far, J.
    pub(crate) fn lost_in_jumps(&self) -> f64 {
        self.jumps
    }

    /// Adds what a scheme lost by itself, J.
    #[inline]
    pub fn add_numerical(&mut self, loss: f64) {
        self.numerical += loss;
    }

    /// So much of what a scheme lost was a jump's, J.
    pub(crate) fn reattribute_to_jump(&mut self, loss: f64) {
        self.numerical -= loss;
        self.jumps += loss;
    }

    /// Adds the flows of a part of the run that was balanced elsewhere.
    pub fn add_part(&mut self, part: &Energy) {
        self.source += part.source;
        self.dissipated += part.dissipated;
        self.jumps += part.jumps;
        self.numerical += part.numerical;
    }

    /// Adds that of a part that shares nothing with this one. The largest energies need not have been there at one time; their sum is what a
    /// residual is measured by.
    pub(crate) fn add_beside(&mut self, other: &Self) {
        self.source += other.source;
        self.dissipated += other.dissipated;
        self.jumps += other.jumps;
        self.numerical += other.numerical;
        self.first += other.first;
        self.last += other.last;
        self.largest += other.largest;
    }

    /// Notes the stored energy now, J.
    pub fn note(&mut self, stored: f64) {
        self.last = stored;
        self.largest = self
            .largest
            .max(stored.abs())
            .max(self.source.abs())
            .max(self.dissipated.abs())
            .max(self.jumps.abs());
    }

    /// Energies that are rounding of one of this size, J, are no measure for a residual.
    pub(crate) fn note_rounding(&mut self, of: f64) {
        self.largest = self.largest.max(f64::EPSILON.sqrt() * of);
    }

    /// The result.
    #[must_use]
    pub fn energy(&self) -> Energy {
        let stored = self.last - self.first;
        let residual = self.source - self.dissipated - self.jumps - self.numerical - stored;
        let residual_relative = if self.largest > 0.0 {
            residual.abs() / self.largest
        } else {
            0.0
        };
        Energy {
            source: self.source,
            dissipated: self.dissipated,
            stored,
            jumps: self.jumps,
            numerical: self.numerical,
            residual,
            residual_relative,
        }
    }
}
