//! A system given as matrices, as a behaviour: the same reduction then makes its modes.

use nalgebra::DMatrix;

use super::{Coefficient, Equation, Observed, Pair, SourcePort, StaticMultiport, StoragePort};
use crate::algebra::Value;
use crate::lcs::{Lcs, Role};

impl StaticMultiport {
    /// The behaviour x' = A x + B λ + E u + e, y = C x + D λ + G u + F, with the stored energy as metric where it is
    /// positive definite, else the identity.
    ///
    /// The doubles count as rounded: what cancels to less than their rounding is 0.
    #[must_use]
    pub fn from_lcs(lcs: &Lcs) -> Self {
        let (n, m, p) = (lcs.n(), lcs.m(), lcs.p());
        let mut out = Self {
            title: lcs.title.clone(),
            inexact: true,
            ..Self::default()
        };
        out.column("1");
        let metric = if lcs.energy.nrows() == n && is_definite(&lcs.energy) {
            lcs.energy.clone()
        } else {
            DMatrix::identity(n, n)
        };
        let x: Vec<_> = lcs
            .states
            .iter()
            .map(|s| out.column(s.name.clone()))
            .collect();
        let rate: Vec<_> = lcs
            .states
            .iter()
            .map(|s| out.column(format!("{}'", s.name)))
            .collect();
        let flow: Vec<_> = lcs
            .states
            .iter()
            .map(|s| out.column(format!("P {}'", s.name)))
            .collect();
        let u: Vec<_> = lcs
            .inputs
            .iter()
            .map(|s| out.column(s.name.clone()))
            .collect();
        let other: Vec<_> = lcs
            .inputs
            .iter()
            .map(|s| out.column(format!("{}.other", s.name)))
            .collect();
        let lambda: Vec<_> = lcs
            .ports
            .iter()
            .map(|s| out.column(s.lambda.clone()))
            .collect();
        let y: Vec<_> = lcs.ports.iter().map(|s| out.column(s.y.clone())).collect();
        out.internal.extend(&rate);

        let row = |m: &DMatrix<f64>, i: usize, columns: &[usize]| -> Equation {
            let entries = columns
                .iter()
                .enumerate()
                .filter(|(j, _)| m[(i, *j)] != 0.0);
            entries
                .map(|(j, &c)| (Coefficient::Plus(Value::binary(m[(i, j)])), c))
                .collect()
        };
        let constant = |value: f64| (Coefficient::Plus(Value::binary(value)), Self::ONE);
        for i in 0..n {
            let mut equation = row(&lcs.a, i, &x);
            equation.extend(row(&lcs.b, i, &lambda));
            equation.extend(row(&lcs.e, i, &u));
            equation.push(constant(lcs.e0[i]));
            equation.push((Coefficient::MINUS_ONE, rate[i]));
            out.equations.push(equation);
            let mut weighted = row(&metric, i, &rate);
            weighted.push((Coefficient::MINUS_ONE, flow[i]));
            out.equations.push(weighted);
            for j in 0..n {
                if metric[(i, j)] != 0.0 {
                    out.metric
                        .push((i, j, Coefficient::Plus(Value::binary(metric[(i, j)]))));
                }
            }
            out.storage.push(StoragePort {
                name: lcs.states[i].name.clone(),
                element: lcs.states[i].name.clone(),
                capacitor: lcs.states[i].unit == "V",
                state: x[i],
                flow: flow[i],
                initial: lcs.storage.initial.get(i).copied(),
            });
        }
        for i in 0..m {
            let mut equation = row(&lcs.c, i, &x);
            equation.extend(row(&lcs.d, i, &lambda));
            equation.extend(row(&lcs.g, i, &u));
            equation.push(constant(lcs.f[i]));
            equation.push((Coefficient::MINUS_ONE, y[i]));
            out.equations.push(equation);
            let port = lcs.ports[i].clone();
            let forward_is_lambda = port.role != Role::Voltage;
            let (reverse, forward) = if forward_is_lambda {
                (y[i], lambda[i])
            } else {
                (lambda[i], y[i])
            };
            out.pairs.push(Pair {
                reverse,
                forward,
                fixed_role: port.role == Role::Function,
                reverse_name: out.columns[reverse].clone(),
                forward_name: out.columns[forward].clone(),
                units: ("V", "A"),
                port,
            });
        }
        for j in 0..p {
            // The other quantity of the source does not exist: it is zero.
            out.equations.push(vec![(Coefficient::ONE, other[j])]);
            out.sources.push(SourcePort {
                input: lcs.inputs[j].clone(),
                value: u[j],
                other: other[j],
                rate: None,
            });
        }
        out.readings(lcs, &x, &lambda, &u);
        out
    }

    /// The named outputs; where one contains u', the input gets a column for it.
    fn readings(&mut self, lcs: &Lcs, x: &[usize], lambda: &[usize], u: &[usize]) {
        let rows = &lcs.outputs.rows;
        for j in 0..rows.du.ncols() {
            if rows.du.column(j).iter().any(|v| *v != 0.0) {
                let column = self.column(format!("{}'", lcs.inputs[j].name));
                self.sources[j].rate = Some(column);
            }
        }
        let rates: Vec<Option<usize>> = self.sources.iter().map(|s| s.rate).collect();
        for (k, name) in lcs.outputs.names.iter().enumerate() {
            let mut equation = Equation::new();
            let mut add = |value: f64, column: usize| {
                if value != 0.0 {
                    equation.push((Coefficient::Plus(Value::binary(value)), column));
                }
            };
            for (j, &c) in x.iter().enumerate() {
                add(rows.x[(k, j)], c);
            }
            for (j, &c) in lambda.iter().enumerate() {
                add(rows.lambda[(k, j)], c);
            }
            for (j, &c) in u.iter().enumerate() {
                add(rows.u[(k, j)], c);
                if let Some(rate) = rates[j] {
                    add(rows.du[(k, j)], rate);
                }
            }
            add(rows.one[k], Self::ONE);
            let column = self.column(name.clone());
            equation.push((Coefficient::MINUS_ONE, column));
            self.equations.push(equation);
            self.observed.push(Observed {
                name: name.clone(),
                unit: lcs.outputs.units[k],
                column,
            });
        }
        self.probes = self.observed.len();
    }
}

/// Whether a symmetric matrix is positive definite. A diagonal one, as uncoupled storage has, tells at once.
fn is_definite(m: &DMatrix<f64>) -> bool {
    let off = |j: usize| (0..m.nrows()).any(|i| i != j && m[(i, j)] != 0.0);
    if (0..m.ncols()).any(off) {
        m.clone().cholesky().is_some()
    } else {
        m.diagonal().iter().all(|d| *d > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn definite_is_what_every_state_has_energy_in() {
        use nalgebra::dmatrix;
        assert!(is_definite(&dmatrix![1.0, 0.0; 0.0, 2.0]));
        assert!(!is_definite(&dmatrix![1.0, 0.0; 0.0, 0.0]));
        assert!(is_definite(&dmatrix![1.0, 0.5; 0.5, 2.0]));
        assert!(!is_definite(&dmatrix![1.0, 2.0; 2.0, 2.0]));
    }
}
