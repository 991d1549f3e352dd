//! A change of mode, as the derivative of the flow needs it.

use std::sync::Arc;

use super::key::{Key, Owner};
use crate::settings::tolerances::jumps::FOLLOWS_JUMP;

/// At which corners of sources a stretch of a run ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Corners {
    /// Those of sources that the state or a probe sees.
    Seen,
    /// Those of sources that act through controls alone, too: values may move them.
    All,
}

/// From one mode to the next at one instant. Changes of mode at equal times follow each other; a corner of a source leads from a mode to
/// itself.
#[derive(Debug, Clone)]
pub(crate) struct Passage {
    /// Time, s.
    pub(crate) t: f64,
    /// The mode that was left; none where a run starts.
    pub(crate) from: Option<Arc<Key>>,
    /// The mode that was entered.
    pub(crate) to: Arc<Key>,
    /// Whose guard fell through zero; none where sources did it.
    pub(crate) cause: Option<Owner>,
    /// All capacitor voltages and inductor currents before, V and A.
    pub(crate) before: Vec<f64>,
    /// The same after.
    pub(crate) after: Vec<f64>,
}

impl Passage {
    /// Whether it is a corner of a source, at which the mode stays.
    pub(crate) fn is_corner(&self) -> bool {
        self.cause.is_none() && self.from.as_ref() == Some(&self.to)
    }

    /// How far the storage jumps, as a part of its largest value.
    fn jump(&self) -> f64 {
        let both = self.before.iter().zip(&self.after);
        let (apart, size) = both.fold((0.0_f64, 0.0_f64), |(apart, size), (a, b)| {
            (apart.max((a - b).abs()), size.max(a.abs()).max(b.abs()))
        });
        if apart > 0.0 { apart / size } else { 0.0 }
    }

    /// Whether sources alone make it, and the storage does not jump.
    pub(crate) fn is_clocked(&self) -> bool {
        self.cause.is_none() && self.jump() <= FOLLOWS_JUMP
    }
}
