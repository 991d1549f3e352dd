//! What happened at an instant, and what must hold there.

/// Changes of storage and areas of impulses below this part of what they are computed from are rounding and no jump. Larger: small jumps are
/// lost from the events and the balance; smaller: rounding is listed as jumps.
pub(crate) const NO_JUMP: f64 = 1e-12;

/// What must hold exactly at an instant may be off by this part of its terms: constraints of a start, voltages prescribed twice, the storage of
/// a mode that is entered without impulse, the impulse of a device, rows before and after an event. Larger: contradictions pass; smaller:
/// circuits with resistances 10⁹ apart are refused for rounding.
pub(crate) const CONSISTENT: f64 = 1e-9;

/// Two impulses are rivals where H couples them by more than this part of √(H_ii H_jj), and both move by more than this part of the largest.
/// Larger: what one device takes from another is not seen; smaller: rounding makes rivals, and the impulses are looked for at length.
pub(crate) const RIVAL: f64 = 1e-9;

/// A forward impulse of voltage below this part of the largest impulse, in equilibrated variables, is the residual that a solution may have.
/// Larger: an impulse that no device takes passes; smaller: right jumps are refused.
pub(crate) const FORWARD: f64 = 1e-6;

/// A spontaneous impulse is recognised by p = hλ that does not shrink with h: p(h/2) above this part of p(h), where a finite λ gives at most
/// one half. Between the two.
pub(crate) const IMPULSE_RATIO: f64 = 0.75;

/// A jump that loses more than this part of the energy at hand destroys a current or a charge; below it lies a current of 3e-5 of its
/// amplitude, as a switch that opens where a current is meant to be zero finds it. Larger: losses pass unsaid; smaller: notes on every
/// switch.
pub(crate) const DESTROYED: f64 = 1e-9;

/// A jump is the one into a mode where the two lead to storages that differ by no more than this part of the largest value. Larger: jumps in
/// several parts pass for one; smaller: rounding of a jump refuses its derivative.
pub(crate) const FOLLOWS_JUMP: f64 = 1e-9;

/// The same in runs in steps, whose states are known to the residual of their solver and are read a little before the event.
pub(crate) const FOLLOWS_JUMP_IN_STEPS: f64 = 1e-6;
