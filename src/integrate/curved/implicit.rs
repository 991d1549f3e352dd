//! One implicit stage of a system with curved laws.
//!
//! ```text
//! X = B + g (A X + B λ + E u + e)      =  W (B + g (E u + e)) + R λ,    W = (I − g A)⁻¹,  R = g W B,  g = γh
//! y = C X + D λ + G u + F              =  M λ + q,                      M = D + C R
//! ```
//!
//! u are the inputs that vary here; what the others bring is part of e and F.

use nalgebra::{DMatrix, DVector};

use super::forms::{Forms, Readings, dot};
use crate::integrate::error::Reason;
use crate::integrate::lawful;
use crate::integrate::step::Columns;
use crate::law::Law;
use crate::lcs::{Lcs, Role};
use crate::settings::tolerances::steps::{SOLVED, STAGE_ROUNDING};
use crate::solve::PortLaw;
use crate::solve::active::equilibrated_inverse;
use crate::solve::newton::Newton;

/// A system's tables, row by row, with its step matrices.
#[derive(Debug)]
pub(crate) struct Curved {
    pub(super) n: usize,
    pub(super) m: usize,
    pub(super) p: usize,
    /// A, B, C, D.
    pub(super) system: [DMatrix<f64>; 4],
    pub(super) laws: Vec<PortLaw>,
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
    e: Vec<f64>,
    g: Vec<f64>,
    /// e and F.
    pub(super) constant: Vec<f64>,
    offset: Vec<f64>,
    /// Which inputs vary.
    pub(crate) varying: Vec<usize>,
    /// The ideal ports: λ ⟂ y.
    pub(crate) ideal: Vec<usize>,
    /// The largest conductance beside a junction, S: currents below what it carries are no signal.
    pub(crate) leak: f64,
    /// The ports of devices; those of function blocks carry no current.
    pub(crate) devices: Vec<usize>,
    pub(super) forms: Forms,
    pub(super) readings: Readings,
    steps: Vec<Implicit>,
    clock: u64,
    /// At one instant, M = D.
    instant: Newton,
    q: Vec<f64>,
}

/// Matrices of stages with one g, row by row.
#[derive(Debug)]
struct Implicit {
    /// g = γh, s.
    g: f64,
    used: u64,
    w: Vec<f64>,
    r: Vec<f64>,
    newton: Newton,
}

/// Step lengths kept per system; the least recently used one goes first.
const KEPT: usize = 64;

impl Curved {
    /// The tables of a system.
    pub(crate) fn of(lcs: &Lcs, columns: &Columns) -> Self {
        let of_kind =
            |wanted: &dyn Fn(usize) -> bool| (0..lcs.m()).filter(|&j| wanted(j)).collect();
        let (e, constant) = split(&lcs.e, &lcs.e0, columns);
        let (g, offset) = split(&lcs.g, &lcs.f, columns);
        let leaks = lcs.ports.iter().map(|port| match port.law {
            Law::Exponential(diode) => diode.leak,
            _ => 0.0,
        });
        Self {
            leak: leaks.fold(0.0, f64::max),
            n: lcs.n(),
            m: lcs.m(),
            p: columns.varying.len(),
            system: [lcs.a.clone(), lcs.b.clone(), lcs.c.clone(), lcs.d.clone()],
            laws: lawful::laws(lcs),
            a: by_rows(&lcs.a),
            b: by_rows(&lcs.b),
            c: by_rows(&lcs.c),
            e,
            g,
            constant,
            offset,
            varying: columns.varying.clone(),
            ideal: of_kind(&|j| lcs.ports[j].law.is_ideal_diode()),
            devices: of_kind(&|j| lcs.ports[j].role != Role::Function),
            forms: Forms::of(lcs, columns),
            readings: Readings::of(lcs, columns),
            steps: Vec::new(),
            clock: 0,
            instant: Newton::new(&lcs.d, &lawful::laws(lcs)),
            q: vec![0.0; lcs.m()],
        }
    }

    /// The place of the matrices for g; one that differs by no more than `slack`, s, serves as well. `true` where they were made now.
    pub(super) fn matrices(&mut self, g: f64, slack: f64) -> Result<(usize, bool), Reason> {
        self.clock += 1;
        if let Some(at) = self.steps.iter().position(|s| (s.g - g).abs() <= slack) {
            self.steps[at].used = self.clock;
            return Ok((at, false));
        }
        let new = Implicit {
            used: self.clock,
            ..Implicit::new(&self.system, &self.laws, g).ok_or(Reason::Singular { h: g })?
        };
        if self.steps.len() < KEPT {
            self.steps.push(new);
            return Ok((self.steps.len() - 1, true));
        }
        let oldest = (0..KEPT).min_by_key(|&k| self.steps[k].used).unwrap_or(0);
        self.steps[oldest] = new;
        Ok((oldest, true))
    }

    /// X for λ = 0 into `x`, q into `q`, from B under inputs u; `right` holds B and takes B + g (E u + e).
    pub(super) fn prepare(
        &self,
        at: usize,
        right: &mut [f64],
        u: &[f64],
        x: &mut [f64],
        q: &mut [f64],
    ) {
        let Implicit { g, w, .. } = &self.steps[at];
        let (n, p) = (self.n, self.p);
        for (k, right) in right.iter_mut().enumerate() {
            *right += g * (dot(&self.e[k * p..(k + 1) * p], u) + self.constant[k]);
        }
        for (i, x) in x.iter_mut().enumerate() {
            *x = dot(&w[i * n..(i + 1) * n], right);
        }
        for (j, q) in q.iter_mut().enumerate() {
            *q = self.free(j, x, u);
        }
    }

    /// y of port j for λ = 0: C x + G u + F.
    pub(super) fn free(&self, j: usize, x: &[f64], u: &[f64]) -> f64 {
        let (n, p) = (self.n, self.p);
        dot(&self.c[j * n..(j + 1) * n], x) + dot(&self.g[j * p..(j + 1) * p], u) + self.offset[j]
    }

    /// λ and y on the laws at one instant, from a guess that they replace; `false` where Newton's method does not find them.
    pub(super) fn at_once(
        &mut self,
        x: &[f64],
        u: &[f64],
        (lambda, y): (&mut [f64], &mut [f64]),
    ) -> bool {
        for j in 0..self.m {
            self.q[j] = self.free(j, x, u);
        }
        self.instant
            .solve(&self.q, lambda, y, (SOLVED, STAGE_ROUNDING))
    }

    /// λ and y on the laws, from a guess.
    pub(super) fn newton(&mut self, at: usize) -> &mut Newton {
        &mut self.steps[at].newton
    }

    /// How far λ and y at a stage are off where the state is off by `change`, with a buffer for q.
    pub(super) fn shifted(
        &mut self,
        at: usize,
        change: &[f64],
        q: &mut [f64],
        (lambda, y): (&mut [f64], &mut [f64]),
    ) {
        for (j, q) in q.iter_mut().enumerate() {
            *q = dot(&self.c[j * self.n..(j + 1) * self.n], change);
        }
        self.steps[at].newton.response(q, lambda, y);
    }

    /// X += R λ.
    pub(super) fn respond(&self, at: usize, lambda: &[f64], x: &mut [f64]) {
        let rows = self.steps[at].r.chunks_exact(self.m);
        for (x, row) in x.iter_mut().zip(rows) {
            *x += dot(row, lambda);
        }
    }

    /// x' = A x + B λ + E u + e.
    pub(crate) fn slope(&self, x: &[f64], lambda: &[f64], u: &[f64], slope: &mut [f64]) {
        for (i, slope) in slope.iter_mut().enumerate() {
            *slope = dot(&self.a[i * self.n..(i + 1) * self.n], x)
                + dot(&self.b[i * self.m..(i + 1) * self.m], lambda)
                + dot(&self.e[i * self.p..(i + 1) * self.p], u)
                + self.constant[i];
        }
    }

    /// How far a state of a stage moves where λ move by these, in magnitude.
    pub(super) fn reach(&self, at: usize, lambda: &[f64], state: usize) -> f64 {
        let row = &self.steps[at].r[state * self.m..(state + 1) * self.m];
        row.iter().zip(lambda).map(|(r, l)| (r * l).abs()).sum()
    }

    /// The sum of the magnitudes that a state of a stage is made of, where `right` is as [`Self::prepare`] left it.
    pub(super) fn size(&self, at: usize, right: &[f64], lambda: &[f64], state: usize) -> f64 {
        let Implicit { w, r, .. } = &self.steps[at];
        let sum = |row: &[f64], values: &[f64]| -> f64 {
            row.iter().zip(values).map(|(a, v)| (a * v).abs()).sum()
        };
        sum(&w[state * self.n..(state + 1) * self.n], right)
            + sum(&r[state * self.m..(state + 1) * self.m], lambda)
    }
}

impl Implicit {
    /// `None` where I − g A is singular.
    fn new([a, b, c, d]: &[DMatrix<f64>; 4], laws: &[PortLaw], g: f64) -> Option<Self> {
        let n = a.nrows();
        let w = if n == 0 {
            DMatrix::zeros(0, 0)
        } else {
            equilibrated_inverse(&(DMatrix::identity(n, n) - a * g))?
        };
        let r = &w * b * g;
        let m = d + c * &r;
        let finite = |table: &DMatrix<f64>| table.iter().all(|v| v.is_finite());
        (finite(&w) && finite(&r) && finite(&m)).then(|| Self {
            g,
            used: 0,
            w: by_rows(&w),
            r: by_rows(&r),
            newton: Newton::new(&m, laws),
        })
    }
}

/// The columns of the inputs that vary, row by row, and what the others add to `one`.
fn split(inputs: &DMatrix<f64>, one: &DVector<f64>, columns: &Columns) -> (Vec<f64>, Vec<f64>) {
    let mut one = one.clone();
    for j in (0..inputs.ncols()).filter(|j| !columns.varying.contains(j)) {
        one += inputs.column(j) * columns.constant[j];
    }
    let varying = inputs.select_columns(&columns.varying);
    (by_rows(&varying), one.as_slice().to_vec())
}

fn by_rows(table: &DMatrix<f64>) -> Vec<f64> {
    table.transpose().as_slice().to_vec()
}
