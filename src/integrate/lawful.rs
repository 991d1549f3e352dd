//! What curved laws change for the integrators: the solver of a step.

use nalgebra::DMatrix;

use crate::lcs::{Lcs, Port, Role};
use crate::solve::{Driver, PortLaw};

/// Whether a port has a law that does not consist of straight pieces. All others are ideal pairs here.
pub(crate) fn is_curved(lcs: &Lcs) -> bool {
    lcs.ports.iter().any(|port| !port.law.is_ideal_diode())
}

/// A solver of y = M λ + q for the ports of a system.
pub(crate) fn driver(lcs: &Lcs, m: DMatrix<f64>, tolerance: f64) -> Driver {
    if !is_curved(lcs) {
        return Driver::new(m, tolerance);
    }
    Driver::with_laws(m, laws(lcs), tolerance)
}

/// The laws of the ports.
pub(crate) fn laws(lcs: &Lcs) -> Vec<PortLaw> {
    let law = |port: &Port| PortLaw {
        law: port.law.clone(),
        current: port.role != Role::Voltage,
    };
    lcs.ports.iter().map(law).collect()
}
