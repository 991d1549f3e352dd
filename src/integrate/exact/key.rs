//! The name of a mode, whose guards end it, and why.

/// Which devices conduct and where the switches stand.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(crate) struct Key {
    /// By pair: conducting.
    pub(crate) closed: Vec<bool>,
    /// By switch: on.
    pub(crate) switches: Vec<bool>,
    /// Switches on their thresholds, in order, and whether their voltage and current are positive.
    pub(crate) sliding: Vec<(usize, bool)>,
}

impl Key {
    /// Takes over another key without allocating.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.closed.clone_from(&other.closed);
        self.switches.clone_from(&other.switches);
        self.sliding.clone_from(&other.sliding);
    }

    /// The same switch positions with other conducting devices.
    pub(crate) fn with_closed(&self, closed: Vec<bool>) -> Self {
        Self {
            closed,
            switches: self.switches.clone(),
            sliding: self.sliding.clone(),
        }
    }

    /// Switches on their thresholds.
    pub(crate) fn sliding_switches(&self) -> Vec<usize> {
        self.sliding.iter().map(|s| s.0).collect()
    }

    /// Whether the switches of another key stand as here.
    pub(crate) fn same_switches(&self, other: &Self) -> bool {
        self.switches == other.switches && self.sliding == other.sliding
    }
}

/// Who ends the mode when a guard falls through zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Owner {
    /// A device: this pair, or several with it as the first.
    Device(usize),
    /// A switch.
    Switch(usize),
    /// A switch on its threshold, which ends fully on or off.
    Slide(usize, bool),
}

/// Why a mode is left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Trigger {
    /// This guard fell through zero.
    Guard(usize),
    /// Sources or switches they drive changed.
    Sources,
}
