//! State jumps: what an impulse of the devices does to the state in no time.
//!
//! The limit h → 0 of the step problem. Impulses p lie in Q_D, the solutions of LCP(0, D): p ≥ 0, Dp ≥ 0, (D + Dᵀ)p = 0, and
//! x⁺ = x + Bp satisfies Cx⁺ + Gu⁺ + F ∈ Q_D* with ⟨Cx⁺ + Gu⁺ + F, p⟩ = 0. For a passive network, where PBp = Cᵀp on
//! ker(D + Dᵀ), this is the projection x⁺ = argmin ½‖x⁺ − x‖²_P; Brogliato-Thibault (24)-(26) is the case D = 0. With
//! p = N z, N a basis of ker(D + Dᵀ), and W = [N; DN] the conditions are the monotone complementarity problem
//!
//! ```text
//! NᵀCBN z + Nᵀ(Cx + Gu⁺ + F) = Wᵀ s,   0 ≤ s ⟂ W z ≥ 0.
//! ```

use nalgebra::{DMatrix, DVector};

use crate::integrate::lawful;
use crate::lcs::Lcs;
use crate::solve::lcp::Scaling;
use crate::solve::{Driver, Status, norm};

/// Prepared jump problem of one system.
#[derive(Debug, Clone)]
pub struct JumpProblem {
    /// m×k: N in the ports' own units; p = sigma · basis · z.
    basis: DMatrix<f64>,
    /// The unit of z, which brings the jump matrix near 1 (time has no scale in a jump).
    sigma: f64,
    driver: Driver,
    /// Whether z had to be split into z⁺ − z⁻ (N is not the identity).
    split: bool,
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
        let split = symmetric.amax() > 0.0;
        // Q_D lies in ker(D + Dᵀ) only for D + Dᵀ ⪰ 0; else the problem below is not used (see `monotone`).
        let semidefinite = is_semidefinite(&symmetric);
        let n = if split && semidefinite {
            norm::kernel(&symmetric)
        } else {
            DMatrix::identity(m, m)
        };
        if n.ncols() == 0 {
            return None;
        }
        // N is orthonormal and D levelled: what is below rounding is zero, else noise would pass for a constraint.
        let n = cleaned(n);
        let k = n.ncols();
        let basis = &d * &n;
        if (&lcs.b * &basis).amax() == 0.0 {
            return None;
        }
        let h = basis.transpose() * &cb * &basis;
        let (feed, size) = (cleaned(&feedthrough * &n), h.amax());
        let sigma = if size > 0.0 { 1.0 / size } else { 1.0 };
        let matrix = if split {
            let w = stack(&n, &feed);
            let rows = w.nrows();
            let mut big = DMatrix::zeros(2 * k + rows, 2 * k + rows);
            for (i, j, sign) in [(0, 0, 1.0), (0, k, -1.0), (k, 0, -1.0), (k, k, 1.0)] {
                big.view_mut((i, j), (k, k))
                    .copy_from(&(&h * (sign * sigma)));
            }
            for (at, sign) in [(0, 1.0), (k, -1.0)] {
                big.view_mut((at, 2 * k), (k, rows))
                    .copy_from(&(w.transpose() * -sign));
                big.view_mut((2 * k, at), (rows, k)).copy_from(&(&w * sign));
            }
            big
        } else {
            let mut big = DMatrix::zeros(2 * m, 2 * m);
            big.view_mut((0, 0), (m, m)).copy_from(&(&h * sigma));
            big.view_mut((0, m), (m, m)).copy_from(&(-feed.transpose()));
            big.view_mut((m, 0), (m, m)).copy_from(&feed);
            big
        };
        let driver = Driver::new(matrix, tolerance);
        let monotone = semidefinite && driver.is_monotone();
        Some(Self {
            basis,
            sigma,
            driver,
            split,
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
        let (m, k) = (lcs.m(), self.basis.ncols());
        let right = self.basis.transpose() * (&lcs.c * x + &lcs.g * u + &lcs.f);
        if right.amax() == 0.0 {
            return Ok(None);
        }
        let mut q = DVector::zeros(if self.split { 2 * k + 2 * m } else { 2 * m });
        q.rows_mut(0, k).copy_from(&right);
        if self.split {
            q.rows_mut(k, k).copy_from(&-right);
        }
        let solution = self.driver.solve(&q);
        match &solution.status {
            Status::Solved => {}
            Status::Infeasible(ray) => {
                let mut z = ray.rows(0, k).into_owned();
                if self.split {
                    z -= ray.rows(k, k);
                }
                return Err(Infeasible {
                    port: (&self.basis * z).iamax(),
                });
            }
            Status::Failed => return Err(Infeasible { port: 0 }),
        }
        let mut z = solution.lambda.rows(0, k).into_owned();
        if self.split {
            z -= solution.lambda.rows(k, k);
        }
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

fn stack(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(a.nrows() + b.nrows(), a.ncols());
    all.rows_mut(0, a.nrows()).copy_from(a);
    all.rows_mut(a.nrows(), b.nrows()).copy_from(b);
    all
}

fn cleaned(a: DMatrix<f64>) -> DMatrix<f64> {
    a.map(|v| if v.abs() < ROUNDING { 0.0 } else { v })
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
    fn bridge_with_resistor_only_has_no_jump() {
        let lcs = fixtures::bridge();
        let mut jumps = JumpProblem::new(&lcs, 1e-9).unwrap();
        for v in [10.0, -3.0] {
            assert_eq!(
                jumps.solve(&lcs, &dvector![v, 0.1], &DVector::zeros(0)),
                Ok(None)
            );
        }
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
