//! State jumps: what an impulse of the devices does to the state in no time.
//!
//! The limit h → 0 of the step problem. Impulses p lie in Q_D, the solutions of LCP(0, D): p ≥ 0, Dp ≥ 0, (D + Dᵀ)p = 0, and
//! x⁺ = x + Bp satisfies Cx⁺ + Gu⁺ + F ∈ Q_D* with ⟨Cx⁺ + Gu⁺ + F, p⟩ = 0. For a passive network, where PBp = Cᵀp on
//! ker(D + Dᵀ), this is the projection x⁺ = argmin ½‖x⁺ − x‖²_P; Brogliato-Thibault (24)-(26) is the case D = 0. With
//! p = N z, N a basis of ker(D + Dᵀ) in which z are some of the components of p themselves, and V those rows of [N; DN] whose
//! sign z ≥ 0 does not settle, the conditions are the monotone complementarity problem
//!
//! ```text
//! 0 ≤ z ⟂ NᵀCBN z + Nᵀ(Cx + Gu⁺ + F) − Vᵀ s ≥ 0,   0 ≤ s ⟂ V z ≥ 0.
//! ```

use nalgebra::{DMatrix, DVector};

use crate::integrate::lawful;
use crate::lcs::Lcs;
use crate::solve::lcp::Scaling;
use crate::solve::{Driver, Status};

/// Prepared jump problem of one system.
#[derive(Debug, Clone)]
pub struct JumpProblem {
    /// m×k: N in the ports' own units; p = sigma · basis · z.
    basis: DMatrix<f64>,
    /// The unit of z, which brings the jump matrix near 1 (time has no scale in a jump).
    sigma: f64,
    driver: Driver,
    /// Whether D + Dᵀ and the jump matrix NᵀCBN are positive semidefinite, as for every passive network. If not, the jump is
    /// not given by this problem.
    pub monotone: bool,
    /// Where curved laws take part: the ideal ports and the system of them alone, which the rest is about.
    part: Option<Box<(Vec<usize>, Lcs)>>,
}

/// What a jump did.
#[derive(Debug, Clone, PartialEq)]
pub struct Jump {
    /// n: the state after.
    pub x: DVector<f64>,
    /// m: impulses of λ, in units of λ times s.
    pub p: DVector<f64>,
}

/// Changes below this, relative to the quantities they are computed from, are rounding and no jump.
const ROUNDING: f64 = 1e-12;

impl JumpProblem {
    /// Prepares the jump problem; `None` where no impulse can flow (D + Dᵀ positive definite, or no ports): then the plan
    /// leaves jumps out.
    #[must_use]
    pub fn new(lcs: &Lcs, tolerance: f64) -> Option<Self> {
        let m = lcs.m();
        if m == 0 || lcs.n() == 0 {
            return None;
        }
        if lawful::is_curved(lcs) {
            let (ports, part) = lawful::ideal_part(lcs);
            let problem = Self::new(&part, tolerance)?;
            return Some(Self {
                part: Some(Box::new((ports, part))),
                ..problem
            });
        }
        let cb = &lcs.c * &lcs.b;
        // Levelled with CB where D is zero, so that ports without feedthrough have a scale too.
        let scaling = Scaling::of(&levelled(&lcs.d, &cb));
        let d = DMatrix::from_diagonal(&scaling.d);
        let feedthrough = &d * &lcs.d * &d;
        let symmetric = &feedthrough + feedthrough.transpose();
        // Q_D lies in ker(D + Dᵀ) only for D + Dᵀ ⪰ 0; else the problem below is not used (see `monotone`).
        let semidefinite = is_semidefinite(&symmetric);
        let kernel = if semidefinite {
            kernel(symmetric)
        } else {
            DMatrix::identity(m, m)
        };
        let (n, v) = reduced(&kernel, &feedthrough);
        let k = n.ncols();
        let basis = &d * &n;
        if k == 0 || (&lcs.b * &basis).amax() == 0.0 {
            return None;
        }
        let h = basis.transpose() * &cb * &basis;
        let size = h.amax();
        let sigma = if size > 0.0 { 1.0 / size } else { 1.0 };
        let rows = v.nrows();
        let mut matrix = DMatrix::zeros(k + rows, k + rows);
        matrix.view_mut((0, 0), (k, k)).copy_from(&(h * sigma));
        matrix
            .view_mut((0, k), (k, rows))
            .copy_from(&-v.transpose());
        matrix.view_mut((k, 0), (rows, k)).copy_from(&v);
        let driver = Driver::new(matrix, tolerance);
        let monotone = semidefinite && driver.is_monotone();
        Some(Self {
            basis,
            sigma,
            driver,
            monotone,
            part: None,
        })
    }

    /// The jump from state `x` under inputs `u` (right limits). `Ok(None)` where the state is admissible as it is.
    ///
    /// # Errors
    /// [`Infeasible`] where no admissible state can be reached.
    pub fn solve(
        &mut self,
        lcs: &Lcs,
        x: &DVector<f64>,
        u: &DVector<f64>,
    ) -> Result<Option<Jump>, Infeasible> {
        if let Some(whole) = self.part.take() {
            let (ports, part) = &*whole;
            let found = self.solve(part, x, u);
            let to_whole = |jump: Jump| {
                let mut p = DVector::zeros(lcs.m());
                for (k, &j) in ports.iter().enumerate() {
                    p[j] = jump.p[k];
                }
                Jump { p, ..jump }
            };
            let found = match found {
                Ok(jump) => Ok(jump.map(to_whole)),
                Err(Infeasible { port }) => Err(Infeasible { port: ports[port] }),
            };
            self.part = Some(whole);
            return found;
        }
        let k = self.basis.ncols();
        let right = self.basis.transpose() * (&lcs.c * x + &lcs.g * u + &lcs.f);
        if right.amax() == 0.0 {
            return Ok(None);
        }
        let solution = self
            .driver
            .solve(&right.resize_vertically(self.driver.size(), 0.0));
        let worst = match &solution.status {
            Status::Solved => None,
            Status::Infeasible(ray) => Some(ray.clone()),
            Status::Failed => Some(solution.lambda.zip_map(&solution.y, |l, y| l.min(y).abs())),
        };
        if let Some(worst) = worst {
            return Err(Infeasible {
                port: (&self.basis * worst.rows(0, k)).iamax(),
            });
        }
        let z = solution.lambda.rows(0, k);
        let p = &self.basis * z * self.sigma;
        let change = &lcs.b * &p;
        let moved = |i: usize| change[i].abs() > ROUNDING * x[i].abs().max(change.amax());
        if !(0..x.len()).any(moved) || self.is_rounding(lcs, x, u, &p) {
            return Ok(None);
        }
        Ok(Some(Jump { x: x + change, p }))
    }

    /// Whether p only makes up for rounding in Cx + Gu + F.
    fn is_rounding(&self, lcs: &Lcs, x: &DVector<f64>, u: &DVector<f64>, p: &DVector<f64>) -> bool {
        let terms = lcs.c.abs() * x.abs() + lcs.g.abs() * u.abs() + lcs.f.abs();
        let corrected = &lcs.c * (&lcs.b * p);
        corrected
            .iter()
            .zip(terms.iter())
            .all(|(c, t)| c.abs() <= ROUNDING * t)
    }
}

/// No admissible state can be reached by an impulse of the devices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Infeasible {
    /// The port with the largest part in the contradiction.
    pub port: usize,
}

/// A basis of the kernel of S ⪰ 0 (entries near 1), by elimination on its diagonal: column j has 1 in a row of its own, so that
/// coordinates are components. What falls below rounding is zero, else noise would pass for a constraint.
fn kernel(mut s: DMatrix<f64>) -> DMatrix<f64> {
    let m = s.nrows();
    let zero = ROUNDING * s.amax();
    let mut free: Vec<usize> = (0..m).collect();
    while let Some(&i) = free
        .iter()
        .filter(|&&i| s[(i, i)] > zero)
        .max_by(|&&a, &&b| s[(a, a)].total_cmp(&s[(b, b)]))
    {
        free.retain(|&other| other != i);
        let row = s.row(i) / s[(i, i)];
        let column = s.column(i).into_owned();
        s -= column * &row;
        s.apply(|v| *v = if v.abs() <= zero { 0.0 } else { *v });
        s.set_row(i, &row);
    }
    let mut n = DMatrix::zeros(m, free.len());
    for (j, &f) in free.iter().enumerate() {
        for i in (0..m).filter(|i| !free.contains(i)) {
            n[(i, j)] = -s[(i, f)];
        }
        n[(f, j)] = 1.0;
    }
    n
}

/// The columns of N that p ≥ 0 and Dp ≥ 0 leave free, and the rows of [N; DN] that z ≥ 0 does not imply.
fn reduced(kernel: &DMatrix<f64>, d: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let feed = (d * kernel).map(|v| if v.abs() < ROUNDING { 0.0 } else { v });
    let mut columns: Vec<usize> = (0..kernel.ncols()).collect();
    let rows: Vec<_> = kernel.row_iter().chain(feed.row_iter()).collect();
    loop {
        // A row without positive entries allows only zeros where it is negative.
        let held = columns.iter().copied().find(|&j| {
            rows.iter()
                .any(|row| row[j] < 0.0 && columns.iter().all(|&i| row[i] <= 0.0))
        });
        match held {
            Some(j) => columns.retain(|&other| other != j),
            None => break,
        }
    }
    let open: Vec<_> = rows
        .iter()
        .filter(|row| columns.iter().any(|&j| row[j] < 0.0))
        .collect();
    let v = DMatrix::from_fn(open.len(), columns.len(), |i, j| open[i][columns[j]]);
    (kernel.select_columns(&columns), v)
}

fn is_semidefinite(symmetric: &DMatrix<f64>) -> bool {
    let eigenvalues = symmetric.symmetric_eigenvalues();
    eigenvalues.min() >= -ROUNDING * eigenvalues.amax()
}

/// |D| with the rows and columns that are zero taken from CB.
fn levelled(d: &DMatrix<f64>, cb: &DMatrix<f64>) -> DMatrix<f64> {
    let m = d.nrows();
    let empty = |j: usize| d.row(j).amax() == 0.0 && d.column(j).amax() == 0.0;
    DMatrix::from_fn(m, m, |i, j| {
        if empty(i) && empty(j) {
            cb[(i, j)]
        } else {
            d[(i, j)]
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::fixtures;
    use nalgebra::dvector;

    #[test]
    fn bridge_with_capacitor_filter_shares_charge() {
        let lcs = fixtures::bridge_cap_filter();
        let mut jumps = JumpProblem::new(&lcs, 1e-9).unwrap();
        assert!(jumps.monotone);
        let x = dvector![10.0, 0.0, 0.0];
        let jump = jumps.solve(&lcs, &x, &DVector::zeros(0)).unwrap().unwrap();
        // 1 µF at 10 V onto 0.3 µF at 0 V: 10/1.3 V on both, 0.3 µF · 10/1.3 V moved.
        assert!(
            (&jump.x - dvector![10.0 / 1.3, 0.0, 10.0 / 1.3]).norm() < 1e-13,
            "{jump:?}"
        );
        assert!((jump.p[2] - 3e-6 / 1.3).abs() < 1e-19, "{jump:?}");
        assert_eq!(jumps.solve(&lcs, &jump.x, &DVector::zeros(0)), Ok(None));
    }

    #[test]
    fn bridge_with_resistor_only_needs_no_jump_logic() {
        // Every impulse that D + Dᵀ would let pass is stopped by Dp ≥ 0.
        assert!(JumpProblem::new(&fixtures::bridge(), 1e-9).is_none());
    }

    #[test]
    fn half_wave_rectifier_with_resistor_needs_no_jump_logic() {
        assert!(JumpProblem::new(&fixtures::rlcd(), 1e-9).is_none());
    }

    #[test]
    fn diode_across_a_reversed_capacitor_is_infeasible_only_without_a_path() {
        // A diode across C with v = −(−3): y = −v must be ≥ 0; the impulse discharges it to 0.
        let lcs = fixtures::clamped_capacitor();
        let mut jumps = JumpProblem::new(&lcs, 1e-9).unwrap();
        let jump = jumps
            .solve(&lcs, &dvector![3.0], &DVector::zeros(0))
            .unwrap()
            .unwrap();
        assert!(jump.x[0].abs() < 1e-15);
        assert!((jump.p[0] - 3e-6).abs() < 1e-18);
        assert_eq!(
            jumps.solve(&lcs, &dvector![-3.0], &DVector::zeros(0)),
            Ok(None)
        );
    }
}
