//! Certificates of dissipation and witnesses against them, in balanced units.

/// How positive the largest eigenvalue of the equilibrated (45) may be, per row. The entries of a circuit's matrices carry relative errors up to
/// 1e-12. Larger: systems with a real (tiny) source of energy pass; smaller: lossless networks are refused for rounding.
pub(crate) const LMI: f64 = 1e-11;

/// How far PBN may be from CᵀN on N = ker(D + Dᵀ), and likewise the coupling on the lossless states, relative to the terms it is computed
/// from. [`LMI`] alone would let √LMI pass there.
pub(crate) const KERNEL: f64 = 1e-9;

/// Smallest eigenvalue that P, scaled to unit diagonal, must have. Larger: stiffly coupled storage is refused; smaller: rounding is accepted
/// as definiteness.
pub(crate) const DEFINITE: f64 = 1e-13;

/// Relative error assumed in every entry of A, B, C, D when a witness is verified: it must stand for all matrices within it. Larger: weakly
/// active networks are not recognised; smaller: rounding is taken for activity.
pub(crate) const ENTRIES: f64 = 1e-11;

/// Residual, relative to the terms it is the difference of, at which PB = Cᵀ counts as satisfied: given, found by feedback, or as the gradient
/// of a storage function. Larger: what only nearly is a gradient passes; smaller: rounding of a solve refuses it.
pub(crate) const MATCHED: f64 = 1e-9;

/// Bound on P relative to its start: solutions beyond it are not looked for. Larger: ill-conditioned certificates; smaller: those of stiff
/// systems are missed.
pub(crate) const RADIUS: f64 = 1e5;

/// The barrier's weight is divided by this between centrings. Larger: longer centrings; smaller: more of them.
pub(crate) const SHRINK: f64 = 8.0;

/// The duality gap at which a margin is final. Larger: margins that are truly positive are taken for zero; smaller: rounding of the Newton
/// systems decides.
pub(crate) const GAP: f64 = 1e-11;

/// A margin below the accuracy it is known to times this is zero; above it, it has a sign. Larger: margins stay undecided; smaller: rounding
/// decides them.
pub(crate) const SIGN: f64 = 30.0;

/// Newton decrement at which a point counts as centred. Larger: duals that are none; smaller: steps that add nothing.
pub(crate) const CENTRED: f64 = 1e-3;

/// A step of the barrier method shortened to this part leads nowhere.
pub(crate) const SHORTEST_STEP: f64 = 1e-12;

/// Size above which an inconsistency of the equalities of a face counts as real. Larger: faces that are empty are searched; smaller: rounding
/// empties them.
pub(crate) const INCONSISTENT: f64 = 1e-8;

/// Dual eigenvalues, relative to the largest, above which a direction is exposed: the dual of a margin that is zero is of rank one or more,
/// with a gap of many decades below. Anywhere in the gap.
pub(crate) const EXPOSED: f64 = 1e-5;

/// Eigenvalues at a solution, relative to the largest, that count as zero when the exposed face is sharpened. Larger: the face loses dimensions; smaller: it is not sharpened.
pub(crate) const NEARLY_NULL: f64 = 1e-7;

/// Relative width at which the bisection on the decay rate stops. Larger: fewer digits of the rate; smaller: slower.
pub(crate) const RATE_WIDTH: f64 = 1e-6;

/// A pole smaller than this does not widen the [`BAND`]: it is rounding of a pole at 0.
pub(crate) const POLE_AT_REST: f64 = 1e-12;

/// The band of frequencies that is searched for a violation, below the slowest and above the fastest pole. Wider: more solves; narrower: a
/// network that is active at its ends is called undecided.
pub(crate) const BAND: (f64, f64) = (1e-3, 1e3);

/// Distances from the axis, relative to a frequency, at which a violation is looked for beside a pole.
pub(crate) const SEARCHED_AROUND: [f64; 3] = [1e-4, 1e-2, 1.0];
