//! Which numbers are zero, beside which others.

/// A singular value, eigenvalue or minor of an equilibrated matrix below this part of the largest is zero. Entries of a circuit's matrices are
/// accurate to about 1e-12. Larger: independent ports merged, regular matrices called singular; smaller: rounding mistaken for rank.
pub(crate) const RANK: f64 = 1e-10;

/// 1/cond₁ of an equilibrated active block, and a pivot beside its column's largest entry, from which on an inverse is trusted: a decade beyond
/// [`RANK`], because a residual test follows. Larger: least squares where a solve would do; smaller: residuals fail.
pub(crate) const INVERSE: f64 = 1e-11;

/// Two ports whose entry of D + Dᵀ with unit diagonal is larger follow each other. Larger: roles are kept that lose digits; smaller: more devices
/// than need be change roles.
pub(crate) const COUPLED: f64 = 0.1;

/// What a junction leaks, or conducts at rest, below this part of the conductance beside it is lost in the rounding of what that carries: ε V/a of it, V over
/// the voltage a in which the junction bends. Larger: roles are exchanged that lose nothing; smaller: steps follow that rounding.
pub(crate) const LEAKAGE: f64 = 1e-7;

/// A corner of a law is on the line through zero that its first ray is on where its coordinates, rounded three times, are so by this part.
/// Larger: a line that passes zero at a distance is moved; smaller: a device that blocks at 0 V leaks the rounding of its corner.
pub(crate) const ON_RAY: f64 = 4.0 * f64::EPSILON;

/// An entry of D, of a constraint or of a ray this far below the largest is rounding of a zero. Larger: weak couplings are lost; smaller: rounding couples
/// ports.
pub(crate) const ENTRY: f64 = 1e-12;

/// Real parts of eigenvalues below this part of the largest eigenvalue are rounding of the eigenvalue computation. Larger: slow growth and
/// decay are not seen; smaller: rounding gets a sign.
pub(crate) const EIGENVALUE: f64 = 1e-12;

/// A diagonal entry of a sparse matrix is taken as pivot where it is at least this part of the largest candidate of its column: the order of elimination was
/// chosen for diagonals. Larger: more fill; smaller: factors grow and digits are lost.
pub(crate) const DIAGONAL: f64 = 0.05;

/// A pivot of exact elimination must be at least this fraction of the largest candidate, relative to its row; among those the shortest row
/// wins. Larger: more fill; smaller: radii grow.
pub(crate) const PIVOT_CHOICE: f64 = 1e-2;

/// Relative radius up to which a ball counts as known. Larger: digits of the matrices are lost; smaller: rationals where double-doubles
/// would do.
pub(crate) const BALL_KNOWN: f64 = 1e-14;

/// A matrix of stored energy is symmetric to this part of its largest entry. Larger: energies that are none pass; smaller: rounding of a product
/// refuses them.
pub(crate) const SYMMETRIC: f64 = 1e-12;
