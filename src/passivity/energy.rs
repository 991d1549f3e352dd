//! The first candidate for P: the energy stored in the circuit's capacitors and inductors.

use nalgebra::DMatrix;

use super::{Certificate, Origin, System, verify};

/// The stored energy ½ xᵀPx as a certificate, if it is one: for a network of resistors, capacitors, inductors and
/// transformers seen through (v, i) ports it always is.
#[must_use]
pub fn certificate(system: &System, p: &DMatrix<f64>) -> Option<Certificate> {
    let residuals = verify::check(system, p).ok()?;
    Some(Certificate {
        p: p.clone(),
        from: Origin::StoredEnergy,
        residuals,
    })
}
