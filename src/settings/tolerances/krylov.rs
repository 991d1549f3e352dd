//! Linear systems and eigenvalues by products alone.

/// A product that lies in the space of the vectors before it but for this part of it adds no direction. Larger: spaces end too early; smaller: directions of rounding.
pub(crate) const BREAKDOWN: f64 = 1e-14;

/// An eigenvalue is told where its vector solves the equation to this part of it. Larger: multipliers of fewer digits; smaller: products of directions that are close to each other.
pub(crate) const RITZ: f64 = 1e-7;

/// Eigenvalues below this are told to [`RITZ`] of it: what is gone so fast needs no digits. Larger: fast multipliers lose digits; smaller: products for what does not matter.
pub(crate) const FAINT_RITZ: f64 = 1e-2;

/// A small matrix is shifted by so much more than an eigenvalue to find its vector, relative to its size: the factors are then regular. Larger: vectors of several eigenvalues mix; smaller: no vector where
/// rounding makes a pivot zero.
pub(crate) const CLEAR_OF_EIGENVALUE: f64 = 1e-13;
