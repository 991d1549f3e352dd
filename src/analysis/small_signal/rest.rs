//! A circuit made linear about its operating point.

use nalgebra::{Complex, DVector};

use super::resonance;
use crate::analysis::variation::{own_resistance, tangent};
use crate::circuit::Circuit;
use crate::integrate::{Error, Note, Values, operating_point};
use crate::lcs::sparse::SparseRows;
use crate::lcs::{Csr, Hold, Input, Position, SparseLcs, StorageHold, reduce};
use crate::linalg::pencil::Pencil;
use crate::mna::{Pair, StandardMultiport, StaticMultiport};
use crate::settings::Settings;

/// δx' = A δx + B δλ + E δu, α δλ + β (C δx + D δλ + G δu) = 0, δy = X δx + Λ δλ + U δu + U' δu'.
pub(super) struct Linear {
    pub(super) inputs: Vec<Input>,
    /// [jωI − A, −B; βC, α + βD].
    pencil: Pencil,
    /// [E; −βG].
    drive: Csr,
    rows: SparseRows,
}

impl Linear {
    /// Y(ω) for û, and what rounding may leave of it.
    pub(super) fn response(
        &mut self,
        omega: f64,
        drive: &DVector<Complex<f64>>,
    ) -> Result<(Vec<Complex<f64>>, f64), Error> {
        let drive = drive.as_slice();
        let at = self.pencil.at(omega).ok_or_else(|| resonance(omega))?;
        let state = at.solve(&times(&self.drive, drive));
        let state = state.ok_or_else(|| resonance(omega))?;
        let rounding = at.rounding(&state);
        let rates: Vec<Complex<f64>> = drive.iter().map(|u| u * Complex::new(0.0, omega)).collect();
        let n = self.rows.x.shape[1];
        let of_state = |state: &[Complex<f64>]| {
            let (x, lambda) = state.split_at(n);
            sum([times(&self.rows.x, x), times(&self.rows.lambda, lambda)])
        };
        let known = sum([times(&self.rows.u, drive), times(&self.rows.du, &rates)]);
        let values = sum([of_state(&state), known]);
        let size = |values: &[Complex<f64>]| values.iter().fold(0.0, |m: f64, v| m.max(v.norm()));
        let loss = size(&of_state(&rounding)) / size(&values).max(f64::MIN_POSITIVE);
        Ok((values, loss))
    }
}

/// The circuit about its operating point: ideal devices conduct or block as they do there, curved laws are their tangents.
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
    let lcs = precise(&multiport, &position, settings)?;
    let holds = position.devices.iter().zip(&point.ports);
    let curved = holds.filter(|(hold, _)| **hold == Hold::Free);
    let tangents = lcs
        .ports
        .iter()
        .zip(curved)
        .map(|(port, (_, &at))| tangent(port, at, own_resistance(at)));
    let tangents: Vec<(f64, f64)> = tangents.collect();
    let n = lcs.a.shape[0];
    let mut entries = Vec::new();
    let mut drive = Csr::new(lcs.inputs.len());
    for i in 0..n {
        let (mut own, others): (Vec<_>, Vec<_>) = lcs.a.row(i).partition(|(j, _)| *j == i);
        let (_, diagonal) = own.pop().unwrap_or((i, 0.0));
        entries.push((i, i, -diagonal, 1.0));
        entries.extend(others.into_iter().map(|(j, value)| (i, j, -value, 0.0)));
        entries.extend(lcs.b.row(i).map(|(j, value)| (i, n + j, -value, 0.0)));
        drive.push(lcs.e.row(i));
    }
    for (j, &(alpha, beta)) in tangents.iter().enumerate() {
        let (own, others): (Vec<_>, Vec<_>) = lcs.d.row(j).partition(|(k, _)| *k == j);
        let diagonal: f64 = own.iter().map(|(_, value)| value).sum();
        entries.push((n + j, n + j, alpha + beta * diagonal, 0.0));
        let rows = lcs
            .c
            .row(j)
            .chain(others.into_iter().map(|(k, value)| (n + k, value)));
        entries.extend(rows.map(|(k, value)| (n + j, k, beta * value, 0.0)));
        drive.push(lcs.g.row(j).map(|(k, value)| (k, -beta * value)));
    }
    Ok(Linear {
        pencil: Pencil::new(n + tangents.len(), &entries),
        drive,
        rows: lcs.output_rows,
        inputs: lcs.inputs,
    })
}

/// The system of a position; where entries of it are differences of large numbers, of not too many states, by exact ones.
fn precise(
    multiport: &StandardMultiport,
    position: &Position,
    settings: &Settings,
) -> Result<SparseLcs, Error> {
    let sparse = SparseLcs::of(multiport, position).map_err(|e| Error::before(e.into()))?;
    let states = multiport.storage.len() + multiport.pairs.len();
    if sparse.imprecise == 0 || states >= settings.large {
        return Ok(sparse);
    }
    let dense = reduce(multiport, position).map_err(|e| Error::before(e.into()))?;
    let rows = &dense.outputs.rows;
    Ok(SparseLcs {
        a: Csr::of(&dense.a),
        b: Csr::of(&dense.b),
        c: Csr::of(&dense.c),
        d: Csr::of(&dense.d),
        e: Csr::of(&dense.e),
        g: Csr::of(&dense.g),
        output_rows: SparseRows {
            x: Csr::of(&rows.x),
            lambda: Csr::of(&rows.lambda),
            u: Csr::of(&rows.u),
            du: Csr::of(&rows.du),
            one: rows.one.as_slice().to_vec(),
        },
        ..sparse
    })
}

/// M x.
fn times(matrix: &Csr, x: &[Complex<f64>]) -> Vec<Complex<f64>> {
    let rows = 0..matrix.shape[0];
    rows.map(|i| matrix.row(i).map(|(j, value)| x[j] * value).sum())
        .collect()
}

fn sum([a, b]: [Vec<Complex<f64>>; 2]) -> Vec<Complex<f64>> {
    a.iter().zip(&b).map(|(a, b)| a + b).collect()
}
