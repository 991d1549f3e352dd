//! How exact modes travel: which exponential, which step, and what rounding leaves of it.

/// ‖A h‖₁ up to which exponentials of shorter steps are squared: what that loses, about 2.5e-17·‖A h‖, stays near rounding below this.
/// Larger: digits are lost; smaller: more rational approximants.
pub(crate) const SQUARED: f64 = 1e3;

/// Error of the rational approximant at a complex eigenvalue of A h, relative to the larger of 1 and its exponential, beyond which steps are
/// squared whatever ‖A h‖: it damps what turns. Larger: oscillations lose amplitude; smaller: squares where the approximant would do.
pub(crate) const TURNS: f64 = 1e-13;

/// ‖A h‖₁ up to which Taylor's series is summed; longer steps begin with a part of this size. Larger: more terms; smaller: more squarings.
pub(crate) const SERIES: f64 = 0.125;

/// What may be missing of the series of an exponential, in every entry of the balanced matrix; their sizes are not comparable. 14 terms at
/// [`SERIES`]; larger, and small entries of a chain of states lose digits.
pub(crate) const MISSING: f64 = 2.2e-26;

/// A term of a series is nothing where every component is below this part of the largest that it had so far. Larger: digits are lost;
/// smaller: terms that add nothing.
pub(crate) const TERM_IS_NOTHING: f64 = 0.1 * f64::EPSILON;

/// Fast states are separated from those that are slower by this factor: below, exponentials over long steps are products of short ones, which
/// lose nothing ([`SQUARED`]); above, they lose 2⁻⁵³ of its square.
pub(crate) const APART: f64 = 1e3;

/// A round that changes a row of the decoupling of fast states by no more than this part of its largest entry ends the iteration. Larger: fast
/// and slow states stay coupled; smaller: rounds that only move rounding.
pub(crate) const DECOUPLED: f64 = 1e-13;

/// ‖𝒜‖ t beyond which the exponentials of energy are no longer squared but computed anew: what squaring loses is 2⁻⁵³ ‖𝒜‖ t, and a balance
/// needs fewer digits than a state ([`SQUARED`]).
pub(crate) const ENERGY_SQUARED: f64 = 1e5;

/// Rounding of a power below this part of the run's is no loss. Larger: balances of 1e-12 cannot be had; smaller: forms are made anew for
/// powers that add nothing.
pub(crate) const HARMLESS_POWER: f64 = 1e-13;

/// Amplitudes below this part of the largest count as this large: their squares stay normal numbers.
pub(crate) const SMALLEST_AMPLITUDE: f64 = 1e-60;

/// Forms of energy are made anew for amplitudes so many times those that they were made for. Larger: small powers are lost beside large ones;
/// smaller: they are made more often.
pub(crate) const OUTGROWN: f64 = 1e3;

/// Rows of a form of energy below this part of the largest are rounding. Larger: dissipation is lost; smaller: rows that add nothing.
pub(crate) const POWER_ROW: f64 = 1e-13;

/// A transient e^{−x} is below the rounding of what it started from where x exceeds −ln 2⁻⁵³. Larger: dead transients keep steps short;
/// smaller: living ones are dropped.
pub(crate) const EXTINCT: f64 = 37.0;

/// So many time constants leave nothing of what a component was before, even where it was 10²⁷ times as large: e⁻¹⁰⁰ = 4e-44. Larger:
/// slaved states are known later; smaller: their old size is taken for rounding.
pub(crate) const FORGOTTEN: f64 = 100.0;

/// ωh up to which a cubic through values and slopes at both ends follows an oscillation to (ωh)⁴/384 of its amplitude. Larger: an event
/// between two points is missed; smaller: more steps.
pub(crate) const RESOLVED: f64 = 0.7;

/// The part of the age of a mode over which a polynomial of degree 8 follows a decay, to 5e-15 of what it began with. Larger: less exact measurements;
/// smaller: more values for them.
pub(crate) const CURVED: f64 = 0.1;

/// The part of the longest step that resolves an oscillation, or of the first step, over which such a polynomial follows what moves, to 7e-15 of its
/// amplitude, and what grows to 2e-13. Larger and smaller as [`CURVED`].
pub(crate) const TURNED: f64 = 0.5;

/// λh up to which the exponentials follow a solution that grows as e^{λt}: those of long stiff steps are meant for decay and take any e^{λh}
/// to 0.
pub(crate) const GROWN: f64 = 1.0;

/// First step after a change of mode, in units of the fastest time constant. Larger: an event right after the change is missed; smaller: more
/// steps.
pub(crate) const FIRST_LOOK: f64 = 0.5;

/// Entries of a row above this part of the largest of all belong to the fast rate.
pub(crate) const FAST_ENTRY: f64 = 1e-6;

/// Entries of two guards that agree to this part of themselves are equal, and the guards one. Larger: distinct guards fall together; smaller:
/// symmetric ones are followed twice.
pub(crate) const EQUAL: f64 = 1e-14;

/// Estimated relative loss of an exponential above which it is reported. Larger: losses pass unsaid; smaller: notes on what nobody sees.
pub(crate) const LOSS: f64 = 1e-10;

/// Estimated relative loss of an exponential above which the signs of guards are not known: steps take over. Larger: wrong modes; smaller:
/// steps where exact integration would do.
pub(crate) const MOST_LOSS: f64 = 1e-8;

/// The part of a state that the rounding of a fast rate may move over the run above which that is said: Roff = 1e12 passed where 1e15 was
/// wrong.
pub(crate) const SLOW_PART: f64 = 1e-3;

/// Ages from which on states follow the others that differ by this factor are of different levels: when the faster ones follow, the others
/// still move.
pub(crate) const LEVEL: f64 = 1e3;

/// A sweep over the sizes of slaved states goes on where it takes one to less than this part.
pub(crate) const SHRINKS: f64 = 0.9;

/// A component is slaved where it is at most this part of its amplitude: otherwise the amplitude is good enough. Larger: more manifolds than
/// tell anything; smaller: the noise of fast states is overestimated.
pub(crate) const SLAVED: f64 = 1.0 / 64.0;

/// The largest part of its decay that a component may owe to others that decay as well.
pub(crate) const MOST_COUPLED: f64 = 0.9;

/// Components that decay together keep at least this part of what they decay by alone. Larger: the currents of windings with little leakage
/// count as large as they ever were; smaller: the matrix that tells has no digit left.
pub(crate) const LEAST_PART: f64 = 1e-6;

/// Lengths of the implicit step that proposes the next mode, in units of the fastest time constant seen, in the order in which they are tried.
/// The long ones are for stiff circuits: a current that starts without a slope is no more than rounding on the others.
pub(crate) const PROPOSALS: [f64; 9] = [1e-6, 1e-4, 1e-8, 1e-2, 1e-10, 1.0, 1e2, 1e4, 1e6];

/// The conductance beside a junction that alone connects a part of the circuit with the rest where `.options gmin=` names none, S: that of ngspice and
/// LTspice. Larger: what blocks leaks; smaller: rounding of currents decides voltages.
pub(crate) const GMIN: f64 = 1e-12;

/// x below minus this has ω(x) below half the rounding of 1: a junction there is its blocking line. Larger: exponentials of what is rounding;
/// smaller: leakage loses digits.
pub(crate) const BLOCKED_JUNCTION: f64 = 37.0;

/// A relative change of ω up to which its Taylor polynomial of second order is a start. Larger: more iterations; smaller: starts from nothing.
pub(crate) const OMEGA_NEAR: f64 = 0.5;

/// A residual of ω + ln ω = x whose fourth power, the error after one more step, is rounding. Larger: digits are lost; smaller: a step in vain.
pub(crate) const OMEGA_ENDS: f64 = 1e-4;
