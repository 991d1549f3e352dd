//! The exact integrator: within a mode the circuit is a linear system driven by an exosystem, and its solution is a
//! matrix exponential; between modes stands a complementarity problem.

mod exosystem;
mod expm;
mod flow;
mod kernel;
mod motion;
mod polynomial;
mod rays;
mod spectrum;
