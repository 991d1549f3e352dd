//! How a netlist is read where its numbers are not exact, and where formulas change over.

/// Two gains are one if they differ by less than so many roundings. Larger: distinct controls are merged; smaller: equal ones in different
/// spelling are not.
pub(crate) const SAME_GAIN: f64 = 8.0;

/// Two lines meet in a knot, or have one slope, if they differ by less than so many roundings. Larger:
/// jumps are taken for kinks; smaller: continuous laws are refused.
pub(crate) const SAME_KNOT: f64 = 64.0;

/// A diode whose emission coefficient is at most this is taken as ideal: users write 0.01 or 0.001 where they mean one. Larger: real diodes
/// lose their curve; smaller: ideal ones get one.
pub(crate) const IDEAL_EMISSION: f64 = 0.05;

/// Largest ratio of the conductances of two steps of a smooth switch. Larger: coarse stairs; smaller: more ports.
pub(crate) const STAIR: f64 = 10.0;

/// Where tangents touch a limited curve, besides 0 and infinity, in units of its knee: the choice with the least largest error.
pub(crate) const TANGENTS: [f64; 3] = [0.63, 1.11, 1.79];

/// Below this angle the series to θ⁴ of Filon's weights is exact to rounding. Larger: the series
/// loses digits; smaller: the closed form cancels them.
pub(crate) const SMALL_ANGLE: f64 = 1e-2;

/// A sine of whose period a run sees at most this part stands still in it, and its frequency is in the wrong unit. Larger: slow sines are warned of that
/// are meant; smaller: `10M` for 10 MHz passes in long runs.
pub(crate) const STANDS_STILL: f64 = 1e-3;
