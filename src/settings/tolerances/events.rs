//! When a guard is zero, a control beyond its threshold, and a run of events without end.

/// Rounding of a computed guard, in units of 2⁻⁵³ Σ |row| |w|. Larger: events are seen late; smaller: rounding makes events.
pub(crate) const NOISE: f64 = 16.0;

/// Guards within this, in the units of [`NOISE`], are zero together: simultaneous events of symmetric circuits differ by the roundings of a
/// few operations. Larger: distinct events fall together; smaller: symmetric devices switch one after the other.
pub(crate) const GROUP: f64 = 128.0;

/// [`GROUP`] in units of a guard's noise.
pub(crate) const SIMULTANEOUS: f64 = GROUP / NOISE;

/// Rounding of a control, and of the time at which it passes its threshold, in units of the last place of its terms: a control is a sum over
/// sources whose values are sums. Larger: thresholds that are only touched count as passed; smaller: rounding passes them.
pub(crate) const CONTROL_ROUNDINGS: f64 = 64.0;

/// A control beyond its threshold by less than this part of its terms decides nothing in the settling of an instant, and storage that moves by
/// less than this part of its energy's square root stays. Larger: small hysteresis is lost; smaller: a residual of the jump moves a switch.
pub(crate) const DECISIVE: f64 = 1e-9;

/// A guard of an implicit step this far below zero, relative to the sum of the magnitudes it is computed from, is zero: the step's matrix is
/// an inverse and carries the condition of one. Larger: reverse currents pass; smaller: the active set is solved anew for rounding.
pub(crate) const STEP_GUARD: f64 = 1e-12;

/// Required distance of a guard's control polygon from zero, relative to its spread. The error of the cubic through values and slopes,
/// (ωh)²/48 of the spread at ωh = [`RESOLVED`](super::exponentials::RESOLVED), is below it. Larger: polynomials are searched where nothing
/// happens; smaller: an event between two points is missed.
pub(crate) const CLEAR_OF_ZERO: f64 = 0.02;

/// Required distance of a guard from zero where periods are taken together, over its rounding. Larger: periods are taken leg by leg where nothing
/// happens; smaller: amplitudes that grow in them have their rounding taken for a sign.
pub(crate) const CERTAIN: f64 = 1024.0;

/// A device whose voltage (current) has the wrong sign by more than this part of the largest voltage across blocking devices and capacitors
/// (current of conducting ones and inductors) so far stands wrongly: no rounding of voltages of one size does that. Larger: wrong states
/// pass unsaid; smaller: notes on rounding.
pub(crate) const WRONG_SIDE: f64 = 1e-6;

/// Intervals between events that shrink to this part within a dozen events accumulate at a time. Larger: a burst of pulses is taken for it;
/// smaller: more events before it is seen.
pub(crate) const ACCUMULATES: f64 = 1e-3;

/// A thousand events within this part of a print step are a burst that does not end by itself. Larger: fast carriers are handed to steps;
/// smaller: chattering is followed for longer.
pub(crate) const BURST: f64 = 1e-4;

/// A guard that ended a mode is at zero where it is below this part of its terms and of what it changed by in the mode. Larger: what changes sides as a
/// consequence of an event counts as its cause; smaller: rounding of the event's time hides the cause.
pub(crate) const AT_LEVEL: f64 = 1e-7;

/// A guard whose rate at its zero is below this part of the rate's terms grazes it: there is no derivative to anything. Larger: refusals; smaller:
/// derivatives made of rounding.
pub(crate) const GRAZING: f64 = 1e-9;

/// Guards that fall through zero at one instant are one event where the derivatives of its time agree to this part. Larger: events that part
/// when something varies count as one; smaller: symmetric devices are told apart by rounding.
pub(crate) const SAME_TIMING: f64 = 1e-6;

/// A current below this part of the largest that its device carried is no conduction in a picture: what leaks through open switches is less. Larger: the end
/// of a decay is not seen; smaller: open switches of 1 MΩ in circuits of a few hundred ohms conduct.
pub(crate) const LEAKING: f64 = 1e-3;

/// A step that moves a guard by less than this part of its rounding moves nothing. Larger: transients are cut short; smaller: steps without end.
pub(crate) const NO_MOVE: f64 = 1.0 / 64.0;

/// A falling guard that no step moves any further has fallen where this part of its rounding is left. Larger: as above; smaller: it rests above for ever.
pub(crate) const NEARLY_FALLEN: f64 = 1.0 / 8.0;
