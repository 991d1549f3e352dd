//! A circuit made linear about its operating point.

use nalgebra::{Complex, DMatrix, DVector};

use super::{Resolvent, resonance};
use crate::analysis::variation::{own_resistance, shaped, tangents, times};
use crate::circuit::Circuit;
use crate::integrate::{Error, Note, Values, operating_point};
use crate::lcs::{Hold, Input, Position, StorageHold, reduce};
use crate::mna::{Pair, StaticMultiport};
use crate::settings::Settings;

/// δx' = A δx + E δu, δy = X δx + U δu + U' δu'.
pub(super) struct Linear {
    pub(super) inputs: Vec<Input>,
    a: DMatrix<f64>,
    e: DMatrix<f64>,
    x: DMatrix<f64>,
    u: DMatrix<f64>,
    du: DMatrix<f64>,
}

impl Linear {
    /// Y(ω) for û, and what rounding may leave of it.
    pub(super) fn response(
        &self,
        omega: f64,
        drive: &DVector<Complex<f64>>,
    ) -> Result<(Vec<Complex<f64>>, f64), Error> {
        let resolvent = Resolvent::of(&self.a, None, omega);
        let state = resolvent.solve(times(&self.e, drive));
        let state = state.ok_or_else(|| resonance(omega))?;
        let rates = times(&self.du, drive) * Complex::new(0.0, omega);
        let values = times(&self.x, &state) + times(&self.u, drive) + rates;
        Ok((values.iter().copied().collect(), resolvent.loss()))
    }
}

/// The circuit about its operating point: ideal devices conduct or block as they do there, curved laws are their tangents (v', i'),
/// i' δv = v' δi, which leaves δλ = −(α + β D)⁻¹ β (C δx + G δu) with α δλ + β δy = 0.
pub(super) fn linear(
    circuit: &Circuit,
    multiport: &StaticMultiport,
    settings: &Settings,
    notes: &mut Vec<Note>,
) -> Result<Linear, Error> {
    let point = operating_point(circuit, Values::Dc, false, settings)?;
    notes.extend(point.notes.iter().cloned());
    let multiport = multiport.standard();
    let hold = |(pair, conducts): (&Pair, &bool)| match (pair.port.law.is_ideal_diode(), conducts) {
        (false, _) => Hold::Free,
        (true, true) => Hold::Closed,
        (true, false) => Hold::Open,
    };
    let position = Position {
        devices: multiport
            .pairs
            .iter()
            .zip(&point.conducting)
            .map(hold)
            .collect(),
        switches: point.switches.iter().map(|(_, on)| *on).collect(),
        storage: StorageHold::Dynamic,
    };
    let lcs = reduce(&multiport, &position).map_err(|e| Error::before(e.into()))?;
    let curved = position.devices.iter().zip(&point.ports);
    let curved = curved
        .filter(|(hold, _)| **hold == Hold::Free)
        .map(|(_, at)| *at);
    let follows = tangents(&lcs, &curved.collect::<Vec<_>>(), own_resistance);
    let Some([follows_x, follows_u]) = follows else {
        return Err(resonance(0.0));
    };
    let rows = &lcs.outputs.rows;
    let (n, m, p, k) = (lcs.n(), lcs.m(), lcs.p(), rows.one.len());
    let (b, lambda) = (shaped(&lcs.b, n, m), shaped(&rows.lambda, k, m));
    Ok(Linear {
        a: &lcs.a + &b * &follows_x,
        e: shaped(&lcs.e, n, p) + &b * &follows_u,
        x: shaped(&rows.x, k, n) + &lambda * &follows_x,
        u: shaped(&rows.u, k, p) + &lambda * &follows_u,
        du: shaped(&rows.du, k, p),
        inputs: lcs.inputs.clone(),
    })
}
