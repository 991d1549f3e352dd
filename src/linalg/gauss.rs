//! The rule of Gauss and Legendre with eight points, exact up to degree 15.
//!
//! Where Taylor's series is exact to rounding its coefficients fall like those of an exponential, so that half the points that a product of two such
//! polynomials takes in general integrate it to rounding.

/// Points of the rule.
pub(crate) const POINTS: usize = 8;
/// Nodes on [0, 1].
pub(crate) const NODES: [f64; POINTS] = [
    0.019855071751231884,
    0.10166676129318664,
    0.2372337950418355,
    0.4082826787521751,
    0.591717321247825,
    0.7627662049581645,
    0.8983332387068134,
    0.9801449282487681,
];
/// Their weights.
pub(crate) const WEIGHTS: [f64; POINTS] = [
    0.05061426814518813,
    0.11119051722668724,
    0.15685332293894363,
    0.181341891689181,
    0.181341891689181,
    0.15685332293894363,
    0.11119051722668724,
    0.05061426814518813,
];
