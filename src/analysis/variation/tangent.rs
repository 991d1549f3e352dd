//! Systems made linear at a point: laws are their tangents there.

use nalgebra::{DMatrix, DVector};

use super::system::{System, apart, shaped};
use crate::integrate::exact::Key;
use crate::integrate::reading;
use crate::integrate::theta::Instant;
use crate::lcs::{Hold, Lcs, LcsParts, Port, Role, Rows};
use crate::settings::tolerances::periodic::CARRIES;

/// Voltage and current of each port at a point.
pub(super) fn points(at: &Instant) -> Vec<(f64, f64)> {
    let lcs = &at.lcs;
    let (n, m, p) = (lcs.n(), lcs.m(), lcs.p());
    let y = shaped(&lcs.c, m, n) * &at.x
        + shaped(&lcs.d, m, m) * &at.lambda
        + shaped(&lcs.g, m, p) * &at.u
        + &lcs.f;
    reading::points(lcs, &at.lambda, &y)
}

/// Devices that carry nothing at their points are open, as what they resist is no part of the circuit: a current that they interrupt is gone; ideal ones are
/// closed where they conduct. Pairs of functions, and laws of straight pieces that resist, stay as they are.
pub(super) fn holds(lcs: &Lcs, points: &[(f64, f64)], resistance: f64) -> Vec<Hold> {
    let hold = |(port, (v, i)): (&Port, &(f64, f64))| {
        let law = &port.law;
        let tangent = law.resolvent(resistance, v + resistance * i);
        let (voltage, current) = (tangent.dv, tangent.di * resistance);
        let may_open = law.is_ideal_diode() || !law.is_piecewise_linear();
        match port.role {
            Role::Function => Hold::Free,
            _ if may_open && current <= CARRIES * voltage => Hold::Open,
            _ if law.is_ideal_diode() => Hold::Closed,
            _ => Hold::Free,
        }
    };
    lcs.ports.iter().zip(points).map(hold).collect()
}

impl System {
    /// The linear system x' = A' x + E' u + e' that touches a system at a point, where ports have these voltages and currents: δλ = L_x δx + L_u δu by its
    /// laws' tangents, with voltages and currents weighed by a `resistance`, Ω. `None` where these leave λ open.
    pub(super) fn touching(
        lcs: &Lcs,
        key: Key,
        (x, u): (&DVector<f64>, &DVector<f64>),
        (points, resistance): (&[(f64, f64)], f64),
    ) -> Option<Self> {
        let (n, p, q) = (lcs.n(), lcs.p(), lcs.storage.names.len());
        let [follows_x, follows_u] = tangents(lcs, points, |_| resistance)?;
        let ports = lcs.ports.iter().zip(points);
        let lambda = ports.map(|(port, &(v, i))| match port.role {
            Role::Voltage => -v,
            Role::Current | Role::Function => i,
        });
        let lambda = DVector::from_iterator(points.len(), lambda);
        let follows = Follows {
            one: lambda - &follows_x * x - &follows_u * u,
            x: follows_x,
            u: follows_u,
        };
        let lcs = lcs.clone().changed(|parts| follows.take(parts)).ok()?;
        let (basis, fast) = apart(&lcs.a, [lcs.fast.clone()]);
        Some(Self {
            key,
            storage_inputs: shaped(&lcs.storage.u, q, p),
            inputs: shaped(&lcs.e, n, p),
            basis,
            fast,
            lcs,
        })
    }
}

/// λ = L_x x + L_u u + l.
struct Follows {
    x: DMatrix<f64>,
    u: DMatrix<f64>,
    one: DVector<f64>,
}

impl Follows {
    /// Puts λ into all that depends on it; no port is left.
    fn take(&self, parts: &mut LcsParts) {
        let (n, m, p, q) = (parts.n(), parts.m(), parts.p(), parts.storage.names.len());
        let b = shaped(&parts.b, n, m);
        parts.a += &b * &self.x;
        parts.e = shaped(&parts.e, n, p) + &b * &self.u;
        parts.e0 += &b * &self.one;
        parts.b = DMatrix::zeros(n, 0);
        parts.c = DMatrix::zeros(0, n);
        parts.d = DMatrix::zeros(0, 0);
        parts.g = DMatrix::zeros(0, p);
        parts.f = DVector::zeros(0);
        parts.ports.clear();
        parts.storage.lambda = DMatrix::zeros(q, 0);
        let (outputs, held) = (&mut parts.outputs, &mut parts.held);
        let all = [
            &mut held.guard,
            &mut held.constraints,
            &mut outputs.rows,
            &mut outputs.power_v,
            &mut outputs.power_i,
            &mut parts.controls,
        ];
        for rows in all {
            self.take_rows(rows, (n, m, p));
        }
    }

    fn take_rows(&self, rows: &mut Rows, (n, m, p): (usize, usize, usize)) {
        let k = rows.one.len();
        let lambda = shaped(&rows.lambda, k, m);
        rows.x = shaped(&rows.x, k, n) + &lambda * &self.x;
        rows.u = shaped(&rows.u, k, p) + &lambda * &self.u;
        rows.one += &lambda * &self.one;
        rows.lambda = DMatrix::zeros(k, 0);
    }
}

/// A resistance of the size of a point's own, which weighs its voltage and current alike, Ω.
pub(crate) fn own_resistance((v, i): (f64, f64)) -> f64 {
    if v != 0.0 && i != 0.0 {
        (v / i).abs()
    } else {
        1.0
    }
}

/// (α, β) with α δλ + β δy = 0 along the law of a port near whose point (v, i) this is: on the law v + ρ i is what it is here.
pub(crate) fn tangent(port: &Port, (v, i): (f64, f64), rho: f64) -> (f64, f64) {
    let tangent = port.law.resolvent(rho, v + rho * i);
    match port.role {
        Role::Voltage => (tangent.di, tangent.dv),
        Role::Current | Role::Function => (tangent.dv, tangent.di),
    }
}

/// δλ = L_x δx + L_u δu of ports with laws near whose points (v, i) these are: on the law v + ρ i is what it is here, with a resistance ρ for each.
pub(crate) fn tangents(
    lcs: &Lcs,
    points: &[(f64, f64)],
    resistance: impl Fn((f64, f64)) -> f64,
) -> Option<[DMatrix<f64>; 2]> {
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
        let (alpha, own) = tangent(port, (v, i), resistance((v, i)));
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
                leak: 0.0,
                breakdown: None,
            });
        });
        let v = slope * (i / is).ln_1p();
        let [found, _] = tangents(&lcs.unwrap(), &[(v + 1e-9, i)], own_resistance).unwrap();
        let off = found[(0, 0)] / ((i + is) / slope) - 1.0;
        assert!(off.abs() < 1e-9, "{off:e}");
    }
}
