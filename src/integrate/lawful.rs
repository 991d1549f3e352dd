//! What curved laws change for the integrators: the solver of a step, and which ports can carry an impulse.

use nalgebra::DMatrix;

use crate::lcs::{Lcs, Role};
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
    let ports = lcs.ports.iter().map(|port| PortLaw {
        law: port.law.clone(),
        current: port.role != Role::Voltage,
    });
    Driver::with_laws(m, ports.collect(), tolerance)
}

/// The ideal ports, and the system with no others: a curved law, which resists every change, carries no impulse.
pub(crate) fn ideal_part(lcs: &Lcs) -> (Vec<usize>, Lcs) {
    let ports: Vec<usize> = (0..lcs.m())
        .filter(|&j| lcs.ports[j].law.is_ideal_diode())
        .collect();
    let part = Lcs {
        ports: ports.iter().map(|&j| lcs.ports[j].clone()).collect(),
        b: lcs.b.select_columns(&ports),
        c: lcs.c.select_rows(&ports),
        d: lcs.d.select_rows(&ports).select_columns(&ports),
        g: lcs.g.select_rows(&ports),
        f: lcs.f.select_rows(&ports),
        ..lcs.clone()
    };
    (ports, part)
}
