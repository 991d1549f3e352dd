//! Reading the fields of a form file.

use nalgebra::{DMatrix, DVector};
use serde_json::{Map, Value};

use super::Affine;
use crate::forms::FormError;
use crate::forms::lure::Phi;
use crate::passivity::System;

/// Access to the fields of a form file.
pub(super) struct Fields<'a>(pub(super) &'a Map<String, Value>);

impl Fields<'_> {
    pub(super) fn bad(name: &str) -> FormError {
        FormError::File(format!(
            "`{name}` is not a matrix or vector of finite numbers"
        ))
    }

    pub(super) fn numbers(name: &str, value: &Value) -> Result<Vec<f64>, FormError> {
        let list = value.as_array().ok_or_else(|| Self::bad(name))?;
        list.iter()
            .map(|v| {
                v.as_f64()
                    .filter(|v| v.is_finite())
                    .ok_or_else(|| Self::bad(name))
            })
            .collect()
    }

    /// A matrix of the given number of columns; `None` if absent.
    pub(super) fn matrix(
        &self,
        name: &'static str,
        columns: Option<usize>,
    ) -> Result<Option<DMatrix<f64>>, FormError> {
        let Some(value) = self.0.get(name) else {
            return Ok(None);
        };
        let rows = value.as_array().ok_or_else(|| Self::bad(name))?;
        let rows: Vec<Vec<f64>> = rows
            .iter()
            .map(|row| Self::numbers(name, row))
            .collect::<Result<_, _>>()?;
        let width = columns.or_else(|| rows.first().map(Vec::len)).unwrap_or(0);
        if rows.iter().any(|row| row.len() != width) {
            return Err(FormError::Shape {
                what: name,
                rows: rows.len(),
                columns: rows.first().map_or(0, Vec::len),
            });
        }
        Ok(Some(DMatrix::from_fn(rows.len(), width, |i, j| rows[i][j])))
    }

    /// A matrix of the given shape, zero if absent.
    pub(super) fn shaped(
        &self,
        name: &'static str,
        (rows, columns): (usize, usize),
    ) -> Result<DMatrix<f64>, FormError> {
        match self.matrix(name, Some(columns))? {
            Some(m) if m.nrows() == rows => Ok(m),
            Some(m) => Err(FormError::Shape {
                what: name,
                rows: m.nrows(),
                columns: m.ncols(),
            }),
            None => Ok(DMatrix::zeros(rows, columns)),
        }
    }

    pub(super) fn needed(&self, name: &'static str) -> Result<DMatrix<f64>, FormError> {
        self.matrix(name, None)?
            .ok_or_else(|| FormError::File(format!("`{name}` is missing")))
    }

    pub(super) fn vector(
        &self,
        name: &'static str,
        length: usize,
    ) -> Result<DVector<f64>, FormError> {
        let Some(value) = self.0.get(name) else {
            return Ok(DVector::zeros(length));
        };
        let numbers = Self::numbers(name, value)?;
        if numbers.len() != length {
            return Err(FormError::Shape {
                what: name,
                rows: numbers.len(),
                columns: 1,
            });
        }
        Ok(DVector::from_vec(numbers))
    }

    pub(super) fn number(&self, name: &str) -> f64 {
        self.0.get(name).and_then(Value::as_f64).unwrap_or(0.0)
    }

    pub(super) fn phi(&self, count: usize) -> Result<Vec<Phi>, FormError> {
        let list: Vec<Phi> = self
            .0
            .get("phi")
            .cloned()
            .map_or_else(|| Ok(vec![Phi::HalfLine; count]), serde_json::from_value)
            .map_err(|e| FormError::File(format!("`phi`: {e}")))?;
        if list.len() == count {
            Ok(list)
        } else {
            Err(FormError::Shape {
                what: "phi",
                rows: list.len(),
                columns: 1,
            })
        }
    }

    pub(super) fn inputs(&self) -> usize {
        self.0
            .get("inputs")
            .and_then(Value::as_array)
            .map_or(0, Vec::len)
    }

    /// A, B, C, D, E, G, e, F, P under their own names; B, C may be given by H instead (B = Hᵀ, C = H).
    pub(super) fn plant(&self) -> Result<Affine, FormError> {
        let a = self.needed("A")?;
        let n = a.nrows();
        let (b, c) = match self.matrix("H", Some(n))? {
            Some(h) => (h.transpose(), h),
            None => {
                let c = self
                    .matrix("C", Some(n))?
                    .unwrap_or_else(|| DMatrix::zeros(0, n));
                (self.shaped("B", (n, c.nrows()))?, c)
            }
        };
        let (m, p) = (c.nrows(), self.inputs());
        Ok(Affine {
            e: self.shaped("E", (n, p))?,
            g: self.shaped("G", (m, p))?,
            e0: self.vector("e", n)?,
            f: self.vector("F", m)?,
            p: if self.0.contains_key("P") {
                Some(self.shaped("P", (n, n))?)
            } else {
                None
            },
            system: System {
                a,
                b,
                c,
                d: self.shaped("D", (m, m))?,
            },
        })
    }

    /// (sign) M, c on {Hx + k ≷ 0} as a system with B = Cᵀ.
    pub(super) fn on_a_set(&self, sign: f64) -> Result<Affine, FormError> {
        let m = self.needed("M")?;
        let n = m.nrows();
        let h = self.shaped("H", (self.needed("H")?.nrows(), n))? * sign;
        let (ports, p) = (h.nrows(), self.inputs());
        Ok(Affine {
            e: self.shaped("E", (n, p))?,
            g: self.shaped("G", (ports, p))? * sign,
            e0: -self.vector("c", n)?,
            f: self.vector("k", ports)? * sign,
            p: Some(DMatrix::identity(n, n)),
            system: System {
                a: -m,
                b: h.transpose(),
                c: h,
                d: DMatrix::zeros(ports, ports),
            },
        })
    }
}
