//! Where the motions of an autonomous passive system can end up: the limit set that dissipation leaves.
//!
//! With an equilibrium (x*, λ*, y*) and P from (45), V = ½(x − x*)ᵀP(x − x*) falls along every motion:
//!
//! ```text
//! V' = ½ zᵀQ(P)z + Σ (λ_j − λ_j*)(y_j − y_j*),   z = (x − x*, λ − λ*),   no term positive
//! ```
//!
//! and vanishes on limit sets, where motions are moreover almost periodic (RR-7158 Theorem 4 makes them nonexpansive in the
//! metric P; Dafermos and Slemrod 1973). So on a limit set
//!
//! 1. Q(P)z = 0, and every port keeps one of the relations [`Known`] says of its law;
//! 2. x stays in the span X of the limit set, hence x' = Az_x + Bz_λ ∈ X (an output-nulling subspace, by iteration);
//! 3. a quantity g(z) ≥ 0 vanishes if it is at most νᵀx' less other nonnegative ones: νᵀx is then monotone, and constant because it is
//!    almost periodic. By duality those are the g with no positive value among the z of rest, [A B]z = 0.
//!
//! If what is left moves nowhere, every motion converges to an equilibrium; if it is one point, to x*.

use nalgebra::{DMatrix, DVector};

use super::program;
use crate::passivity::{System, lmi, scale, witness};
use crate::settings::tolerances::ranks::RANK;
use crate::settings::tolerances::theorems::{FAINT_CONSTRAINT, VANISHES};

/// What is known of a port's deviations from the equilibrium on a limit set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Known {
    /// λ keeps its value.
    Lambda,
    /// y keeps its value.
    Y,
    /// Both do.
    Both,
    /// Both may grow, neither may fall.
    Signs,
    /// Nothing.
    Nothing,
}

/// A linear space that holds all differences of limit points.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LimitSet {
    /// Its dimension in x.
    pub(super) dimension: usize,
    /// The states that can move on it.
    pub(super) moving: Vec<usize>,
    /// Angular frequencies of its motions, rad/s, ascending; empty if the motions are not determined by x alone.
    pub(super) frequencies: Vec<f64>,
}

impl LimitSet {
    /// Every motion converges to an equilibrium.
    pub(super) const fn rests(&self) -> bool {
        self.moving.is_empty()
    }
}

/// The limit set of a system with certificate P, ports known as given.
pub(super) fn set(system: &System, p: &DMatrix<f64>, known: &[Known]) -> LimitSet {
    let (n, m) = (system.n(), system.m());
    let balanced = scale::balance(system);
    let p = scale::scaled(p, &balanced.states, &balanced.states);
    let system = &balanced.system;
    // Units in which every row of Q has size one; x̂ = diag(d_x) ζ.
    let d = scale::equilibrate(&lmi::magnitude(system, &p));
    let q = scale::scaled(&lmi::matrix(system, &p), &d, &d);
    let (values, vectors) = scale::eigen(&q);
    let lossy: Vec<usize> = (0..n + m).filter(|&k| values[k].abs() > RANK).collect();
    let mut flow = joined(&system.a, &system.b, &d);
    for (mut row, d) in flow.row_iter_mut().zip(d.iter()) {
        row /= *d;
    }
    let y = joined(&system.c, &system.d, &d);

    let mut space = Space(DMatrix::identity(n + m, n + m));
    space.constrain(&vectors.select_columns(&lossy).transpose());
    let mut signs = Vec::new();
    for (j, known) in known.iter().enumerate() {
        let lambda = DMatrix::from_fn(1, n + m, |_, k| if k == n + j { 1.0 } else { 0.0 });
        let y = units(&y.rows(j, 1).into_owned());
        match known {
            Known::Lambda => space.constrain(&lambda),
            Known::Y => space.constrain(&y),
            Known::Both => {
                space.constrain(&lambda);
                space.constrain(&y);
            }
            Known::Signs => signs.extend([lambda, y]),
            Known::Nothing => {}
        }
    }
    loop {
        let before = space.dimension();
        let vanishing = space.vanishing_at_rest(&units(&flow), &signs);
        let mut others = Vec::new();
        for (row, vanishes) in signs.into_iter().zip(vanishing) {
            if vanishes {
                space.constrain(&row);
            } else {
                others.push(row);
            }
        }
        signs = others;
        let span = scale::split(&space.0.rows(0, n).into_owned(), FAINT_CONSTRAINT);
        space.constrain(&units(&(span.left_kernel.transpose() * &flow)));
        if space.dimension() == before {
            return describe(&space, &span, &flow, balanced.omega);
        }
    }
}

fn describe(space: &Space, span: &scale::Split, flow: &DMatrix<f64>, omega: f64) -> LimitSet {
    let visible = units(flow) * &space.0;
    let moving: Vec<usize> = (0..visible.nrows())
        .filter(|&k| visible.row(k).amax() > FAINT_CONSTRAINT)
        .collect();
    let rates = flow * &space.0;
    // x' as a function of x on the set, where λ does not move x by itself.
    let x = space.0.rows(0, rates.nrows()).into_owned();
    let still = &rates * scale::split(&x, FAINT_CONSTRAINT).kernel;
    let frequencies = if still.amax() <= FAINT_CONSTRAINT && !moving.is_empty() {
        let back = scale::split(&x, FAINT_CONSTRAINT);
        let inverse = &back.row_space
            * DMatrix::from_diagonal(&back.values.map(f64::recip))
            * back.range.transpose();
        let map = span.range.transpose() * &rates * inverse * &span.range;
        let mut found: Vec<f64> = witness::eigenvalues(&map)
            .iter()
            .map(|s| s.im * omega)
            .filter(|&w| w > FAINT_CONSTRAINT * omega)
            .collect();
        found.sort_by(f64::total_cmp);
        found.dedup_by(|a, b| (*a - *b).abs() <= FAINT_CONSTRAINT * b.abs());
        found
    } else {
        Vec::new()
    };
    LimitSet {
        dimension: span.range.ncols(),
        moving,
        frequencies,
    }
}

/// [L R] diag(d).
fn joined(l: &DMatrix<f64>, r: &DMatrix<f64>, d: &DVector<f64>) -> DMatrix<f64> {
    let n = l.ncols();
    DMatrix::from_fn(l.nrows(), n + r.ncols(), |i, k| {
        d[k] * if k < n { l[(i, k)] } else { r[(i, k - n)] }
    })
}

/// The rows scaled to unit size.
fn units(rows: &DMatrix<f64>) -> DMatrix<f64> {
    let mut rows = rows.clone();
    for mut row in rows.row_iter_mut() {
        let size = row.amax();
        if size > 0.0 {
            row /= size;
        }
    }
    rows
}

/// A linear space by an orthonormal basis in its columns.
struct Space(DMatrix<f64>);

impl Space {
    fn dimension(&self) -> usize {
        self.0.ncols()
    }

    /// Keeps the z with rows·z = 0.
    fn constrain(&mut self, rows: &DMatrix<f64>) {
        if rows.nrows() > 0 && self.dimension() > 0 {
            self.0 = &self.0 * scale::split(&(rows * &self.0), FAINT_CONSTRAINT).kernel;
        }
    }

    /// Which rows are zero wherever all of them are ≥ 0 and z rests.
    fn vanishing_at_rest(&self, flow: &DMatrix<f64>, rows: &[DMatrix<f64>]) -> Vec<bool> {
        let mut rest = Self(self.0.clone());
        rest.constrain(flow);
        let k = rest.dimension();
        let count = rows.len();
        if k == 0 || count == 0 {
            return vec![true; count];
        }
        // maximise Σ s_i subject to 0 ≤ s_i ≤ 1, s_i ≤ row_i·w: on a cone every s_i is 0 or 1.
        let mut a = DMatrix::zeros(3 * count, k + count);
        let mut b = DVector::zeros(3 * count);
        for (i, row) in rows.iter().enumerate() {
            a.view_mut((i, 0), (1, k)).copy_from(&(row * &rest.0));
            a[(i, k + i)] = -1.0;
            a[(count + i, k + i)] = 1.0;
            a[(2 * count + i, k + i)] = -1.0;
            b[2 * count + i] = 1.0;
        }
        let mut objective = DVector::zeros(k + count);
        objective.rows_mut(k, count).fill(-1.0);
        let zero = DMatrix::zeros(k + count, k + count);
        let Some(found) = program::minimise(&zero, &objective, &a, &b, 0) else {
            return vec![false; count];
        };
        (0..count).map(|i| found[k + i] < VANISHES).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::dmatrix;

    const SIGNS: [Known; 4] = [Known::Signs; 4];

    #[test]
    fn a_bridge_with_a_resistor_brings_its_tank_to_rest() {
        // RR-7158 (36)-(37): no diode conducts at rest, and only the signs of all four exclude an undamped swing.
        let system = System {
            a: dmatrix![0.0, -1.0; 1.0, 0.0],
            b: dmatrix![0.0, 0.0, -1.0, 1.0; 0.0, 0.0, 0.0, 0.0],
            c: dmatrix![0.0, 0.0; 0.0, 0.0; -1.0, 0.0; 1.0, 0.0],
            d: dmatrix![1.0, 1.0, -1.0, 0.0; 1.0, 1.0, 0.0, -1.0; 1.0, 0.0, 0.0, 0.0; 0.0, 1.0, 0.0, 0.0],
        };
        let p = DMatrix::identity(2, 2);
        let found = set(&system, &p, &SIGNS);
        assert_eq!((found.dimension, found.rests()), (0, true));
        // Without what is known of the diodes the tank may swing on.
        let free = set(&system, &p, &[Known::Nothing; 4]);
        assert_eq!(free.moving, [0, 1]);
    }

    #[test]
    fn a_half_wave_load_damps_by_the_mean_of_the_swing() {
        // A tank with a diode and a resistor across it: λ = 0 leaves −v ≥ 0 for ever, which a swing of mean zero cannot do.
        let system = System {
            a: dmatrix![0.0, -1.0; 1.0, 0.0],
            b: dmatrix![-1.0; 0.0],
            c: dmatrix![-1.0, 0.0],
            d: dmatrix![1.0],
        };
        let found = set(&system, &DMatrix::identity(2, 2), &[Known::Signs]);
        assert_eq!((found.dimension, found.rests()), (0, true));
        // Where the diode carries a forward drop, small swings stay: λ = 0 is all that is known.
        let found = set(&system, &DMatrix::identity(2, 2), &[Known::Lambda]);
        assert_eq!((found.dimension, found.moving.len()), (2, 2));
        assert!((found.frequencies[0] - 1.0).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn a_capacitor_behind_a_diode_rests_anywhere() {
        // x' = λ, y = x + λ: x ≥ 0 stays where it is.
        let system = System {
            a: dmatrix![0.0],
            b: dmatrix![1.0],
            c: dmatrix![1.0],
            d: dmatrix![1.0],
        };
        let found = set(&system, &dmatrix![1.0], &[Known::Signs]);
        assert_eq!((found.dimension, found.rests()), (1, true));
    }
}
