//! Every tolerance and limit, once: name, default, unit, scale, and what either direction costs. Users choose [`Settings`]; what else decides
//! something stands in `tolerances`.

pub(crate) mod tolerances;

/// Numerical settings of a simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Target of the error-controlled steppers: local error relative to each signal's amplitude so far
    /// (dimensionless, default 1e-4). Smaller: more steps; larger: visible error.
    pub tol: f64,
    /// Complementarity residual `‖min(λ, y)‖∞` at which an LCP solution is accepted, in the circuit's own scales
    /// (dimensionless, default 1e-9). Smaller: correct solutions refused for rounding; larger: wrong modes accepted.
    pub lcp_residual: f64,
    /// Smallest step of the error-controlled steppers relative to the simulated span (default 1e-12).
    pub min_step: f64,
    /// Limit of steps in one run (default 200 million); reaching it is an error that names the time.
    pub max_steps: u64,
    /// Most memory for the rows of one run, bytes (default 1 GiB); a run that would need more is refused before it starts, or ends
    /// where rows at events fill it. Rows that are written as they come do not count.
    pub max_held: usize,
    /// Bytes that the exact integrator keeps of what can be made again: exponentials and forms of energy of its modes, and as many for the
    /// systems with free devices. What was used longest ago is given up first; the answer is the same to rounding.
    pub max_kept: usize,
    /// So many capacitors, inductors, ideal pairs and switches together make a circuit one that is solved in parts, where it falls into parts
    /// that share nothing but ground and sources (default 32: from there on it is no dearer where all switch together, and where each has its own times the modes of
    /// the whole are the products of those of the parts).
    pub apart: usize,
    /// So many capacitors, inductors and ideal pairs together make a circuit one that is integrated in steps on matrices without their zeros, unless exact
    /// integration is asked for (default 600). Larger: dense matrices, whose cost grows with the third power; smaller: steps for circuits that exact integration
    /// masters as fast, and exactly.
    pub large: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tol: 1e-4,
            lcp_residual: 1e-9,
            min_step: 1e-12,
            max_steps: 200_000_000,
            max_held: 1 << 30,
            max_kept: 1 << 28,
            apart: 32,
            large: 600,
        }
    }
}
