//! A circuit made linear about its operating point.

use nalgebra::{Complex, DMatrix, DVector};

use super::{Resolvent, resonance};
use crate::analysis::variation::{shaped, times};
use crate::circuit::Circuit;
use crate::integrate::{Error, Note, Values, operating_point};
use crate::lcs::{Hold, Input, Lcs, Position, Role, StorageHold, reduce};
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
    let follows = tangents(&lcs, &curved.collect::<Vec<_>>());
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

/// δλ = L_x δx + L_u δu of ports with laws whose points (v, i) are these.
fn tangents(lcs: &Lcs, points: &[(f64, f64)]) -> Option<[DMatrix<f64>; 2]> {
    let (n, m, p) = (lcs.n(), lcs.m(), lcs.p());
    let (c, d, g) = (
        shaped(&lcs.c, m, n),
        shaped(&lcs.d, m, m),
        shaped(&lcs.g, m, p),
    );
    if m == 0 {
        return Some([DMatrix::zeros(0, n), DMatrix::zeros(0, p)]);
    }
    let (mut matrix, mut beta) = (d, DVector::zeros(m));
    for (j, (port, &(v, i))) in lcs.ports.iter().zip(points).enumerate() {
        // A resistance of the size of the point's own weighs voltage and current alike.
        let rho = if v != 0.0 && i != 0.0 {
            (v / i).abs()
        } else {
            1.0
        };
        let tangent = port.law.resolvent(rho, v + rho * i);
        let (alpha, own) = match port.role {
            Role::Voltage => (tangent.di, tangent.dv),
            Role::Current | Role::Function => (tangent.dv, tangent.di),
        };
        beta[j] = own;
        let mut row = matrix.row_mut(j);
        row *= own;
        matrix[(j, j)] += alpha;
    }
    let factors = matrix.lu();
    let scaled = |mut block: DMatrix<f64>| {
        for (mut row, beta) in block.row_iter_mut().zip(&beta) {
            row *= -beta;
        }
        factors.solve(&block)
    };
    Some([scaled(c)?, scaled(g)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::fixtures;
    use crate::law::{Exponential, Law};
    use nalgebra::dmatrix;

    /// g = (i + Is)/a at 1 µA, though the voltage is off by 1 nV, as one that is the difference of large potentials: of that error the
    /// tangent has 1/(1 + v g/i), not all of δv/a = 4e-8.
    #[test]
    fn a_tangent_weighs_the_voltage_and_the_current_of_its_point_alike() {
        let (is, slope, i) = (1e-30_f64, 0.025, 1e-6);
        let lcs = fixtures::system(
            &[("v(c1)", "V")],
            &[("d1", Role::Current)],
            [dmatrix![0.0], dmatrix![-1.0], dmatrix![-1.0], dmatrix![0.0]],
            &[1.0],
        );
        let lcs = lcs.changed(|parts| {
            parts.ports[0].law = Law::Exponential(Exponential {
                is,
                slope,
                rs: 0.0,
                breakdown: None,
            });
        });
        let v = slope * (i / is).ln_1p();
        let [found, _] = tangents(&lcs.unwrap(), &[(v + 1e-9, i)]).unwrap();
        let off = found[(0, 0)] / ((i + is) / slope) - 1.0;
        assert!(off.abs() < 1e-9, "{off:e}");
    }
}
