//! A change of mode, as the derivative of the flow needs it.

use super::key::{Key, Owner};

/// From one mode to the next at one instant. Changes of mode at equal times follow each other; a corner of a source leads from a mode to
/// itself.
#[derive(Debug, Clone)]
pub(crate) struct Passage {
    /// Time, s.
    pub(crate) t: f64,
    /// The mode that was left; none where a run starts.
    pub(crate) from: Option<Key>,
    /// The mode that was entered.
    pub(crate) to: Key,
    /// Whose guard fell through zero; none where sources did it.
    pub(crate) cause: Option<Owner>,
    /// All capacitor voltages and inductor currents before, V and A.
    pub(crate) before: Vec<f64>,
    /// The same after.
    pub(crate) after: Vec<f64>,
}
