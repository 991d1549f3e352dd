//! The complementarity system of one switch position: jumps, and proposals for the next mode.

use nalgebra::{DMatrix, DVector};

use crate::diagnostic::Internal;
use crate::integrate::jump::{Infeasible, Jump, JumpProblem};
use crate::lcs::{Lcs, Role};
use crate::linalg::whole::{magnitudes, sizes};
use crate::settings::tolerances::events::NOISE;
use crate::settings::tolerances::jumps::CONSISTENT;
use crate::solve::{Driver, Status, norm};

/// One implicit step prepared: λ solves LCP(M, q) with M = D + hC W⁻¹B, W = I − hA.
#[derive(Debug, Clone)]
struct Step {
    h: f64,
    /// C W⁻¹, m×n.
    reach: DMatrix<f64>,
    driver: Driver,
}

/// Which pairs conduct; `None` for those whose current and voltage are both zero.
#[derive(Debug, Clone)]
pub(crate) struct Proposal(Vec<Option<bool>>);

impl Proposal {
    /// Pairs that are zero on both sides block.
    pub(crate) fn open(&self) -> Vec<bool> {
        self.0.iter().map(|pair| pair.unwrap_or(false)).collect()
    }

    /// Pairs that are zero on both sides stay as they are.
    pub(crate) fn as_before(&self, before: &[bool]) -> Vec<bool> {
        let pairs = self.0.iter().zip(before);
        pairs
            .map(|(pair, before)| pair.unwrap_or(*before))
            .collect()
    }
}

/// The system with every pair free.
#[derive(Debug, Clone)]
pub(crate) struct Free {
    /// Its matrices.
    pub(crate) lcs: Lcs,
    jump: Option<JumpProblem>,
    steps: Vec<Step>,
    tolerance: f64,
}

impl Free {
    pub(crate) fn new(lcs: Lcs, tolerance: f64) -> Self {
        let jump = JumpProblem::new(&lcs, tolerance);
        Self {
            lcs,
            jump,
            steps: Vec::new(),
            tolerance,
        }
    }

    /// The state that conserves charge and flux from storage s.
    pub(crate) fn state_from(&self, s: &[f64]) -> DVector<f64> {
        &self.lcs.storage.inject * DVector::from_column_slice(s) + &self.lcs.storage.inject_one
    }

    /// The storage vector of a state.
    pub(crate) fn storage(&self, x: &DVector<f64>, u: &DVector<f64>) -> DVector<f64> {
        &self.lcs.storage.x * x + &self.lcs.storage.u * u + &self.lcs.storage.one
    }

    /// What is rounding in [`Self::storage`], by the magnitudes that it is summed from.
    pub(crate) fn storage_rounding(&self, x: &DVector<f64>, u: &DVector<f64>) -> DVector<f64> {
        let map = &self.lcs.storage;
        (magnitudes(&map.x) * sizes(x) + magnitudes(&map.u) * sizes(u) + sizes(&map.one))
            * (NOISE * f64::EPSILON)
    }

    /// Whether devices may need an impulse.
    pub(crate) fn is_impulsive(&self) -> bool {
        self.jump.is_some()
    }

    /// Whether jumps are projections in the metric of stored energy: where no device can carry an impulse too.
    pub(crate) fn is_projected(&self) -> bool {
        self.jump.as_ref().is_none_or(|jump| jump.projects)
    }

    /// The impulse of the devices at state x, if one is needed. Active networks have no energy to project in; their jump
    /// is left to the limit of small steps.
    pub(crate) fn jump(
        &mut self,
        x: &DVector<f64>,
        u: &DVector<f64>,
    ) -> Result<Option<Jump>, Infeasible> {
        match &mut self.jump {
            Some(problem) if problem.monotone => problem.solve(&self.lcs, x, u),
            _ => Ok(None),
        }
    }

    /// See [`JumpProblem::verify`].
    pub(crate) fn verify(&self, jump: &Jump) -> Result<(), Internal> {
        let problem = self.jump.as_ref();
        problem.map_or(Ok(()), |problem| problem.verify(&self.lcs, jump))
    }

    /// Which pairs conduct during one implicit step of length `h` from x to inputs `u`: the candidate for the next mode.
    pub(crate) fn propose(
        &mut self,
        x: &DVector<f64>,
        u: &DVector<f64>,
        h: f64,
    ) -> Option<Proposal> {
        let at = match self.steps.iter().position(|s| s.h == h) {
            Some(at) => at,
            None => {
                let n = self.lcs.n();
                let w = DMatrix::identity(n, n) - &self.lcs.a * h;
                let inverse = w.lu().try_inverse()?;
                let reach = &self.lcs.c * inverse;
                let m = &self.lcs.d + &reach * &self.lcs.b * h;
                if !m.iter().all(|v| v.is_finite()) {
                    return None;
                }
                self.steps.push(Step {
                    h,
                    reach,
                    driver: Driver::new(m, self.tolerance),
                });
                self.steps.len() - 1
            }
        };
        let Step { reach, driver, .. } = &mut self.steps[at];
        let lcs = &self.lcs;
        let ahead = x + (&lcs.e * u + &lcs.e0) * h;
        let q = &*reach * ahead + &lcs.g * u + &lcs.f;
        if !q.iter().all(|v| v.is_finite()) {
            return None;
        }
        let solution = driver.solve(&q);
        if solution.status != Status::Solved {
            return None;
        }
        let active = driver.least_norm_alone(&q, &solution).active;
        let pairs = lcs.ports.iter().zip(&active);
        let conducts =
            pairs.map(|(port, active)| active.map(|active| active == (port.role != Role::Voltage)));
        Some(Proposal(conducts.collect()))
    }

    /// The impulse that takes state x to state `after` with these pairs conducting, if there is one: p ≥ 0 acts on the
    /// pairs whose λ is free, B p = after − x, D p vanishes on them and is nonnegative on the others. It proves the jump
    /// where the projection does not apply (active networks).
    pub(crate) fn impulse_between(
        &self,
        x: &DVector<f64>,
        after: &DVector<f64>,
        closed: &[bool],
    ) -> Option<DVector<f64>> {
        let lcs = &self.lcs;
        let (n, m) = (lcs.n(), lcs.m());
        let active: Vec<usize> = (0..m)
            .filter(|&j| closed[j] == (lcs.ports[j].role != Role::Voltage))
            .collect();
        // Rows in the metric of stored energy, columns to unit length.
        let weight = |i: usize| {
            let stored = if i < lcs.energy.nrows() {
                lcs.energy[(i, i)]
            } else {
                0.0
            };
            if stored > 0.0 { stored.sqrt() } else { 1.0 }
        };
        let length = |j: usize| {
            let norm = (0..n)
                .map(|i| (weight(i) * lcs.b[(i, j)]).powi(2))
                .sum::<f64>()
                .sqrt();
            if norm > 0.0 { norm } else { 1.0 }
        };
        let feedthrough = lcs.d.amax().max(f64::MIN_POSITIVE);
        let mut e = DMatrix::zeros(n + active.len(), active.len());
        let mut f = DVector::zeros(n + active.len());
        for (k, &j) in active.iter().enumerate() {
            for i in 0..n {
                e[(i, k)] = weight(i) * lcs.b[(i, j)] / length(j);
            }
            for (r, &i) in active.iter().enumerate() {
                e[(n + r, k)] = lcs.d[(i, j)] / feedthrough;
            }
        }
        for i in 0..n {
            f[i] = weight(i) * (after[i] - x[i]);
        }
        let scaled = norm::nonnegative_least_squares(&e, &f);
        if (&e * &scaled - &f).norm() > CONSISTENT * f.norm() {
            return None;
        }
        let mut p = DVector::zeros(m);
        for (k, &j) in active.iter().enumerate() {
            p[j] = scaled[k] / length(j);
        }
        let through = &lcs.d * &p;
        let least = -CONSISTENT * lcs.d.amax() * p.amax();
        through.iter().all(|&v| v >= least).then_some(p)
    }

    /// Factorisations spent in proposals.
    pub(crate) fn factorisations(&self) -> u64 {
        self.steps.iter().map(|s| s.driver.factorisations).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::fixtures;
    use nalgebra::{dmatrix, dvector};

    /// A diode across 1 F at 3 V, and a voltage of `gain` times its current across another one, with a resistor.
    fn impulse(gain: f64) -> Option<DVector<f64>> {
        let lcs = fixtures::system(
            &[("v(c1)", "V")],
            &[("d1", Role::Current), ("d2", Role::Current)],
            [
                dmatrix![0.0],
                dmatrix![-1.0, 0.0],
                dmatrix![-1.0; 0.0],
                dmatrix![0.0, 0.0; gain, 1.0],
            ],
            &[1.0],
        );
        Free::new(lcs, 1e-9).impulse_between(&dvector![3.0], &dvector![0.0], &[true, false])
    }

    #[test]
    fn an_impulse_of_voltage_may_be_nothing_but_not_forward() {
        for gain in [1.0, 0.0] {
            let p = impulse(gain).expect("an impulse");
            assert!((p - dvector![3.0, 0.0]).amax() < 1e-15);
        }
        assert_eq!(impulse(-1.0), None);
    }
}
