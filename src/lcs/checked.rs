//! A complementarity system whose parts fit.

use std::ops::Deref;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::{LcsParts, Rows};
use crate::circuit::Source;
use crate::settings::tolerances::ranks::SYMMETRIC;

/// x' = A x + B λ + E u + e,  y = C x + D λ + G u + F,  −λ_j ∈ ∂φ_j(y_j), with [parts](LcsParts) that fit: shapes, symmetric energies, entries
/// that are finite.
///
/// Parts are read as fields (`lcs.a`); they are changed by [`Lcs::changed`], which checks again. A clone shares them.
#[derive(Debug, Clone, Default)]
pub struct Lcs(Arc<LcsParts>);

/// Why parts make no system.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LcsError {
    /// A matrix or list of another size than the numbers of states, ports, inputs and storage elements ask for.
    #[error("{part} is {} by {} where {} by {} is needed", .found.0, .found.1, .needed.0, .needed.1)]
    Shape {
        /// `A`, `storage.metric`, …
        part: &'static str,
        /// Rows and columns.
        found: (usize, usize),
        /// Rows and columns.
        needed: (usize, usize),
    },
    /// An entry that is infinite or no number.
    #[error(
        "an entry of {part} is not a finite number: the values of the circuit are too far apart for doubles"
    )]
    NotFinite {
        /// `A`, `storage.metric`, …
        part: &'static str,
    },
    /// A stored energy ½ xᵀPx is given by a symmetric P.
    #[error("{part} is not symmetric")]
    NotSymmetric {
        /// `energy` or `storage.metric`.
        part: &'static str,
    },
    /// A number of a state that there is none of.
    #[error("state {0} of {1} cannot be fast")]
    NoState(usize, usize),
}

impl Deref for Lcs {
    type Target = LcsParts;

    fn deref(&self) -> &LcsParts {
        &self.0
    }
}

impl Lcs {
    /// The system of these parts.
    ///
    /// # Errors
    /// Shapes that do not fit, energies that are not symmetric, entries that are not finite.
    pub fn new(parts: LcsParts) -> Result<Self, LcsError> {
        check(&parts)?;
        Ok(Self(Arc::new(parts)))
    }

    /// The same system with other parts.
    ///
    /// # Errors
    /// As [`Lcs::new`].
    pub fn changed(self, change: impl FnOnce(&mut LcsParts)) -> Result<Self, LcsError> {
        let mut parts = self.into_parts();
        change(&mut parts);
        Self::new(parts)
    }

    /// The same system with other waveforms at the inputs with these numbers.
    #[must_use]
    pub(crate) fn with_sources(&self, replaced: &[(usize, Source)]) -> Self {
        let mut other = self.clone();
        for (input, source) in replaced {
            Arc::make_mut(&mut other.0).inputs[*input].source = source.clone();
        }
        other
    }

    /// Bytes that its matrices take, about.
    pub(crate) fn bytes(&self) -> usize {
        let rows = |rows: &Rows| [&rows.x, &rows.lambda, &rows.u, &rows.du].map(DMatrix::len);
        let (outputs, storage) = (&self.outputs, &self.storage);
        let read = [
            &outputs.rows,
            &outputs.power_v,
            &outputs.power_i,
            &self.controls,
        ];
        let own = [&self.a, &self.b, &self.c, &self.d, &self.e, &self.g];
        let stored = [&self.energy, &storage.x, &storage.metric, &storage.inject];
        let numbers = (own.iter().chain(&stored)).map(|m| m.len());
        let numbers = numbers.chain(read.into_iter().flat_map(rows));
        numbers.sum::<usize>() * size_of::<f64>()
    }

    /// What it is made of.
    #[must_use]
    pub fn into_parts(self) -> LcsParts {
        Arc::unwrap_or_clone(self.0)
    }
}

fn check(parts: &LcsParts) -> Result<(), LcsError> {
    let (n, m, p) = (parts.n(), parts.m(), parts.p());
    let storage = &parts.storage;
    let q = storage.names.len();
    let matrices = [
        ("A", &parts.a, (n, n)),
        ("B", &parts.b, (n, m)),
        ("C", &parts.c, (m, n)),
        ("D", &parts.d, (m, m)),
        ("E", &parts.e, (n, p)),
        ("G", &parts.g, (m, p)),
        ("shift", &parts.shift, (n, p)),
        ("energy", &parts.energy, (n, n)),
        ("storage.x", &storage.x, (q, n)),
        ("storage.lambda", &storage.lambda, (q, m)),
        ("storage.u", &storage.u, (q, p)),
        ("storage.metric", &storage.metric, (q, q)),
        ("storage.inject", &storage.inject, (n, q)),
    ];
    for (part, matrix, needed) in matrices {
        let is_unknown = ["energy", "storage.metric"].contains(&part) && matrix.is_empty();
        if !is_unknown {
            fits(part, matrix, needed)?;
        }
    }
    let vectors = [
        ("e", &parts.e0, n),
        ("F", &parts.f, m),
        ("storage.one", &storage.one, q),
        ("storage.inject_one", &storage.inject_one, n),
        ("storage.initial", &storage.initial, q),
    ];
    for (part, vector, needed) in vectors {
        entries(part, vector, needed)?;
    }
    let (outputs, held) = (&parts.outputs, &parts.held);
    let all = [
        ("outputs", &outputs.rows, outputs.names.len()),
        ("outputs.power_v", &outputs.power_v, outputs.power.len()),
        ("outputs.power_i", &outputs.power_i, outputs.power.len()),
        ("controls", &parts.controls, parts.switches.len()),
        ("held.guard", &held.guard, held.pairs.len()),
        (
            "held.constraints",
            &held.constraints,
            held.constrained.len(),
        ),
    ];
    for (part, rows, count) in all {
        rows_fit(part, rows, count, (n, m, p))?;
    }
    symmetric("energy", &parts.energy)?;
    symmetric("storage.metric", &storage.metric)?;
    match parts.fast.iter().find(|&&k| k >= n) {
        Some(&k) => Err(LcsError::NoState(k, n)),
        None => Ok(()),
    }
}

fn fits(part: &'static str, matrix: &DMatrix<f64>, needed: (usize, usize)) -> Result<(), LcsError> {
    let found = matrix.shape();
    let is_empty = matrix.is_empty() && needed.0 * needed.1 == 0;
    if found != needed && !is_empty {
        return Err(LcsError::Shape {
            part,
            found,
            needed,
        });
    }
    if matrix.iter().all(|v| v.is_finite()) {
        Ok(())
    } else {
        Err(LcsError::NotFinite { part })
    }
}

fn entries(part: &'static str, vector: &DVector<f64>, needed: usize) -> Result<(), LcsError> {
    if vector.len() != needed {
        return Err(LcsError::Shape {
            part,
            found: vector.shape(),
            needed: (needed, 1),
        });
    }
    if vector.iter().all(|v| v.is_finite()) {
        Ok(())
    } else {
        Err(LcsError::NotFinite { part })
    }
}

fn rows_fit(
    part: &'static str,
    rows: &Rows,
    count: usize,
    (n, m, p): (usize, usize, usize),
) -> Result<(), LcsError> {
    fits(part, &rows.x, (count, n))?;
    fits(part, &rows.lambda, (count, m))?;
    fits(part, &rows.u, (count, p))?;
    fits(part, &rows.du, (count, p))?;
    entries(part, &rows.one, count)
}

fn symmetric(part: &'static str, matrix: &DMatrix<f64>) -> Result<(), LcsError> {
    let largest = matrix.amax();
    let all = (0..matrix.nrows()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let mut apart = all.map(|(i, j)| (matrix[(i, j)] - matrix[(j, i)]).abs());
    if apart.all(|d| d <= SYMMETRIC * largest) {
        Ok(())
    } else {
        Err(LcsError::NotSymmetric { part })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DVector, dmatrix};

    use super::*;
    use crate::integrate::fixtures;

    #[test]
    fn parts_that_do_not_fit_make_no_system() {
        let changed = |change: fn(&mut LcsParts)| fixtures::rlcd().changed(change).unwrap_err();
        let shape = changed(|s| s.b = DMatrix::zeros(1, 1));
        assert!(matches!(
            shape,
            LcsError::Shape {
                part: "B",
                found: (1, 1),
                ..
            }
        ));
        let shape = changed(|s| s.outputs.names.push("v(x)".into()));
        assert!(matches!(
            shape,
            LcsError::Shape {
                part: "outputs",
                ..
            }
        ));
        let shape = changed(|s| s.f = DVector::zeros(7));
        assert_eq!(shape.to_string(), "F is 7 by 1 where 1 by 1 is needed");
        let entry = changed(|s| s.a[(0, 1)] = f64::NAN);
        assert_eq!(entry, LcsError::NotFinite { part: "A" });
        let entry = changed(|s| s.storage.one[0] = f64::INFINITY);
        assert_eq!(
            entry,
            LcsError::NotFinite {
                part: "storage.one"
            }
        );
        let energy = changed(|s| s.energy = dmatrix![1.0, 0.5; 0.4, 1.0]);
        assert_eq!(energy, LcsError::NotSymmetric { part: "energy" });
        assert_eq!(changed(|s| s.fast = vec![2]), LcsError::NoState(2, 2));
        assert!(fixtures::rlcd().changed(|s| s.a *= 2.0).is_ok());
    }

    /// 1/RC of a resistor of 1e-160 Ω and a capacitor of 1e-160 F is none.
    #[test]
    fn a_circuit_beyond_doubles_is_refused_by_name() {
        let netlist = "t\nv1 1 0 1\nr1 1 2 1e-160\nc1 2 0 1e-160\n.end\n";
        let refused = crate::Model::parse(netlist, "t").unwrap().lcs();
        let reason = refused.unwrap_err().reason;
        let unfit = crate::lcs::ReduceError::Unfit(LcsError::NotFinite { part: "A" });
        assert_eq!(reason, crate::integrate::Reason::Circuit(unfit));
    }
}
