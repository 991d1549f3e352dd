//! Output feedback u = Sx + Gλ that makes a system passive (RR-7158 Remark 10, problems P1 and P2).
//!
//! With x' = Ax + Bλ + Eu, y = Cx + Dλ + Fu the closed loop is (A + ES, B + EG, C + FS, D + FG). (48) is bilinear in
//! (P, S, G), but after the congruence diag(X, I) with X = P⁻¹ it is linear in X, S̃ = SX and G:
//!
//! ```text
//! [ AX + XAᵀ + ES̃ + S̃ᵀEᵀ     B + EG − XCᵀ − S̃ᵀFᵀ     ]
//! [ (·)ᵀ                      −(D + FG) − (D + FG)ᵀ   ] ⪯ 0
//! ```

use nalgebra::{DMatrix, DVector};

use super::FormError;
use super::observer::{blocks, bounded, combine, expose_lossless, units};
use crate::passivity::facial::Face;
use crate::passivity::{Residuals, System, barrier, lmi, scale, verify};
use crate::settings::tolerances::passivity::MATCHED;
use crate::settings::tolerances::theorems::LARGEST_GAIN;

/// A feedback with the certificate of the closed loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Feedback {
    /// S, inputs×n.
    pub s: DMatrix<f64>,
    /// G, inputs×m.
    pub g: DMatrix<f64>,
    /// P of the closed loop.
    pub p: DMatrix<f64>,
    /// How well the closed loop was verified.
    pub residuals: Residuals,
}

fn shapes(system: &System, e: &DMatrix<f64>, f: &DMatrix<f64>) -> Result<usize, FormError> {
    let inputs = e.ncols();
    for (what, matrix, shape) in [
        ("E", e, (system.n(), inputs)),
        ("F", f, (system.m(), inputs)),
    ] {
        if matrix.shape() != shape {
            return Err(FormError::Shape {
                what,
                rows: matrix.nrows(),
                columns: matrix.ncols(),
            });
        }
    }
    Ok(inputs)
}

/// (A + ES, B + EG, C + FS, D + FG).
#[must_use]
pub fn close(
    system: &System,
    e: &DMatrix<f64>,
    f: &DMatrix<f64>,
    s: &DMatrix<f64>,
    g: &DMatrix<f64>,
) -> System {
    System {
        a: &system.a + e * s,
        b: &system.b + e * g,
        c: &system.c + f * s,
        d: &system.d + f * g,
    }
}

/// Problem P1 for a given P: the least S, G with P(B + EG) = (C + FS)ᵀ.
///
/// # Errors
/// [`FormError::Hypothesis`] with the residual if there are none.
pub fn match_output(
    system: &System,
    e: &DMatrix<f64>,
    f: &DMatrix<f64>,
    p: &DMatrix<f64>,
) -> Result<(DMatrix<f64>, DMatrix<f64>), FormError> {
    let inputs = shapes(system, e, f)?;
    let (n, m) = (system.n(), system.m());
    // vec(PEG − SᵀFᵀ) = vec(Cᵀ − PB), unknowns (G, S) by columns.
    let mut rows = DMatrix::zeros(n * m, inputs * (m + n));
    let pe = p * e;
    for i in 0..n {
        for j in 0..m {
            for k in 0..inputs {
                rows[(i + j * n, k + j * inputs)] = pe[(i, k)];
                rows[(i + j * n, inputs * m + k + i * inputs)] = -f[(j, k)];
            }
        }
    }
    let target = system.c.transpose() - p * &system.b;
    let rhs = DVector::from_column_slice(target.as_slice());
    let failed = |size| FormError::Hypothesis {
        statement: "RR-7158 Remark 10, P1",
        condition: "no S, G with P(B + EG) = (C + FS)ᵀ",
        size,
    };
    let solution = rows
        .clone()
        .svd(true, true)
        .solve(&rhs, f64::EPSILON.sqrt() * rows.amax())
        .map_err(|_| failed(rhs.amax()))?;
    let residual = (&rows * &solution - &rhs).amax();
    if residual > MATCHED * (system.c.amax() + (p * &system.b).amax()) {
        return Err(failed(residual));
    }
    let g = DMatrix::from_column_slice(inputs, m, &solution.as_slice()[..inputs * m]);
    let s = DMatrix::from_column_slice(inputs, n, &solution.as_slice()[inputs * m..]);
    Ok((s, g))
}

impl Feedback {
    /// Problem P2: S, G and P that make the closed loop passive, with rate at least `rate` (1/s) if that is positive.
    ///
    /// # Errors
    /// Shapes, or that no feedback was found.
    pub fn design(
        system: &System,
        e: &DMatrix<f64>,
        f: &DMatrix<f64>,
        rate: f64,
    ) -> Result<Self, FormError> {
        let inputs = shapes(system, e, f)?;
        let (n, m) = (system.n(), system.m());
        // One matrix K = [S̃ G] of all feedback unknowns.
        let at = |x: &DMatrix<f64>, k: &DMatrix<f64>, constant: f64| {
            let (s, g) = (k.columns(0, n).into_owned(), k.columns(n, m).into_owned());
            let states = &system.a * x + e * &s + x * rate;
            let coupling = &system.b * constant + e * &g
                - x * system.c.transpose()
                - s.transpose() * f.transpose();
            let ports = &system.d * constant + f * &g;
            -blocks(
                &(&states + states.transpose()),
                &coupling,
                &-(&ports + ports.transpose()),
            )
        };
        let list = units(n, inputs, n + m);
        let zero = (DMatrix::zeros(n, n), DMatrix::zeros(inputs, n + m));
        let whole = Face::new(
            at(&zero.0, &zero.1, 1.0),
            list.iter().map(|(x, k)| at(x, k, 0.0)).collect(),
            bounded(&zero.0, &zero.1, LARGEST_GAIN),
            list.iter().map(|(x, k)| bounded(x, k, 0.0)).collect(),
        );
        // Lossless port patterns that no feedback reaches: (D + Dᵀ)N = 0 and FᵀN = 0.
        let ports = &system.d + system.d.transpose();
        let unit = |m: DMatrix<f64>| if m.amax() > 0.0 { &m / m.amax() } else { m };
        let mut stacked = DMatrix::zeros(m + inputs, m);
        stacked.rows_mut(0, m).copy_from(&unit(ports));
        stacked.rows_mut(m, inputs).copy_from(&unit(f.transpose()));
        let null = scale::split(&stacked, 0.0).kernel;
        let failed = FormError::Hypothesis {
            statement: "RR-7158 Remark 10, P2",
            condition: "no feedback u = Sx + Gλ was found that makes the system passive",
            size: rate,
        };
        let face = expose_lossless(&whole, &null, n).ok_or_else(|| failed.clone())?;
        lmi::search(&face, barrier::maximise, |z| {
            let (x, k) = combine(&list, &face.original(z), (n, inputs, n + m));
            let p = x.try_inverse().ok_or("X is singular")?;
            let p = (&p + p.transpose()) * 0.5;
            let s = k.columns(0, n) * &p;
            let g = k.columns(n, m).into_owned();
            let closed = close(system, e, f, &s, &g);
            let residuals =
                verify::check(&closed.shifted(rate), &p).map_err(|failure| failure.to_string())?;
            Ok(Self { s, g, p, residuals })
        })
        .map_err(|_| failed)
    }
}
