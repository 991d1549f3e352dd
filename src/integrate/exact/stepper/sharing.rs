//! Taking turns with the modes of circuits that are alike.

use super::Exact;
use crate::integrate::exact::modes::Modes;

impl Exact {
    /// Whether it has the modes of another: their circuits differ in names, initial values and waveforms alone, and the waveforms in what
    /// moves along them alone.
    pub(crate) fn is_alike(&self, other: &Self) -> bool {
        self.sources.is_alike(&other.sources) && self.table.is_alike(&other.table)
    }

    /// Has other modes from here on, those of a circuit that is alike; gives its own for them.
    pub(crate) fn exchange_modes(&mut self, modes: &mut Modes) {
        std::mem::swap(&mut self.table.modes, modes);
        self.periods = None;
    }

    /// Modes and systems keep so many bytes at most.
    pub(crate) fn keep_at_most(&mut self, bytes: (usize, usize)) {
        self.table.keep_at_most(bytes);
    }
}
