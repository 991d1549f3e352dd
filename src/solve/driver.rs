//! The chain warm active set → block pivoting → Lemke → clarabel, with one test on every way out.

use nalgebra::{DMatrix, DVector};

use super::active::ActiveSolve;
use super::lawful::{Lawful, PortLaw};
use super::lcp::{Answered, Lcp, Scaling, Solution, Status};
use super::lemke::{self, Lemke};
use super::parts::Parts;
use super::{convex, norm, pivot};
use crate::linalg::blocks::extreme_eigenvalues;
use crate::linalg::whole::{entrywise, largest, with_transposed};
use crate::settings::tolerances::complementarity::{NOTHING_TO_GAIN, SLACK};
use crate::settings::tolerances::ranks::{EIGENVALUE, RANK};

/// Factored active sets kept per matrix; the oldest goes first.
const KEPT_SETS: usize = 64;

/// A solver for many right-hand sides of one matrix M.
#[derive(Debug, Clone)]
pub struct Driver {
    /// M equilibrated, q unused.
    scaled: Lcp,
    scaling: Scaling,
    tolerance: f64,
    /// What q' is uncertain by.
    noise: DVector<f64>,
    monotone: bool,
    /// Whether M + Mᵀ ≻ 0 so clearly that no solution has another beside it.
    definite: bool,
    warm: Vec<bool>,
    sets: Vec<(Vec<bool>, ActiveSolve)>,
    /// Where M falls into parts; these then do everything.
    parts: Option<Parts>,
    /// Where a port has a law other than 0 ≤ λ ⟂ y ≥ 0.
    lawful: Option<Box<Lawful>>,
    /// Factorisations computed so far.
    pub factorisations: u64,
}

/// See [`Driver::least_norm`].
#[derive(Debug, Clone, PartialEq)]
pub struct LeastNorm {
    /// The least-norm member.
    pub solution: Solution,
    /// Whether there is no other.
    pub unique: bool,
    /// The ports with a positive λ or y that another member has otherwise: what the ideal model leaves open.
    pub chosen: Vec<usize>,
}

impl Driver {
    /// Prepares M; `tolerance` is the scaled residual at which a solution is accepted.
    #[must_use]
    pub fn new(m: DMatrix<f64>, tolerance: f64) -> Self {
        let scaling = Scaling::of(&m);
        let size = m.nrows();
        let scaled = scaling.apply(&Lcp {
            m,
            q: DVector::zeros(size),
        });
        let (monotone, definite) = definiteness(&scaled.m);
        Self {
            parts: Parts::of(&scaled.m, tolerance),
            scaled,
            scaling,
            tolerance,
            noise: DVector::zeros(size),
            monotone,
            definite,
            warm: vec![false; size],
            sets: Vec::new(),
            lawful: None,
            factorisations: 0,
        }
    }

    /// The number of pairs.
    #[must_use]
    pub fn size(&self) -> usize {
        self.scaled.size()
    }

    /// Prepares M for ports with any laws; see [`lawful`](super::lawful).
    #[must_use]
    pub fn with_laws(m: DMatrix<f64>, ports: Vec<PortLaw>, tolerance: f64) -> Self {
        let curved = ports.iter().any(|port| !port.law.is_ideal_diode());
        let scaling = Scaling::of(&m);
        let lawful = curved.then(|| Box::new(Lawful::new(&m, &scaling, ports, tolerance)));
        Self {
            lawful,
            ..Self::new(m, tolerance)
        }
    }

    /// Proposes a solution to start from, where that is of use: for curved laws.
    pub fn suggest_point(&mut self, lambda: &[f64], y: &[f64]) {
        if let Some(lawful) = &mut self.lawful {
            lawful.suggest(lambda, y);
        }
    }

    /// How λ answers a small change of q at a solution (λ, y) with curved laws; `None` for ideal ones, and where neither the
    /// network nor the laws determine it.
    #[must_use]
    pub fn response(
        &self,
        lambda: &DVector<f64>,
        y: &DVector<f64>,
        dq: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        self.lawful.as_ref()?.response(lambda, y, dq)
    }

    /// Whether M + Mᵀ ⪰ 0 (to rounding).
    #[must_use]
    pub fn is_monotone(&self) -> bool {
        self.monotone
    }

    /// Proposes the active set to try first.
    pub fn suggest(&mut self, active: &[bool]) {
        self.warm.copy_from_slice(active);
    }

    /// What each q_j is uncertain by from now on: where it is a small difference of large numbers, more than its own rounding.
    /// An ideal port judges by it; before the first call q is exact.
    pub fn blur(&mut self, noise: &DVector<f64>) {
        self.noise = noise.component_mul(&self.scaling.d);
        if let Some(parts) = &mut self.parts {
            parts.blur(&self.noise);
        }
    }

    /// Solves for one q near the last one by what costs little; `None` where curved laws need more than that.
    pub(crate) fn solve_near(&mut self, q: &DVector<f64>) -> Option<Solution> {
        match &mut self.lawful {
            Some(lawful) => lawful.solve_near(q),
            None => Some(self.solve(q)),
        }
    }

    /// Solves for one q.
    pub fn solve(&mut self, q: &DVector<f64>) -> Solution {
        if let Some(lawful) = &mut self.lawful {
            return lawful.solve(q);
        }
        self.scaled.q = entrywise(q, &self.scaling.d);
        if let Some(parts) = &mut self.parts {
            let found = parts.solve(&self.scaled.q, &self.warm);
            self.factorisations = parts.factorisations();
            if found.status == Status::Solved {
                self.warm.copy_from_slice(&found.basis);
            }
            return self.in_own_units(found);
        }
        let size = self.scaled.size();
        let slack = SLACK * largest(self.scaled.q.as_slice());
        let mut best = self.candidate(DVector::zeros(size), vec![false; size], Answered::Warm);
        // What is no number has no solution, and no pivot.
        if !q.iter().all(|q| q.is_finite()) {
            best.by = Answered::Nobody;
            return best;
        }
        let chain: [fn(&mut Self, f64) -> Option<Solution>; 4] = [
            Self::try_warm,
            Self::try_block,
            Self::try_lemke,
            Self::try_convex,
        ];
        for (k, method) in chain.iter().enumerate() {
            if k == 3 && best.residual <= self.tolerance {
                break;
            }
            if let Some(found) = method(self, slack) {
                if found.residual <= NOTHING_TO_GAIN {
                    return self.accept(found);
                }
                if found.residual < best.residual {
                    best = found;
                }
            }
            if best.residual <= NOTHING_TO_GAIN {
                return self.accept(best);
            }
            // Lemke's ray ends the search where it is a verified proof.
            if k == 2
                && best.residual > self.tolerance
                && let Some(ray) = self.infeasible()
            {
                best.status = Status::Infeasible(ray);
                best.by = Answered::Lemke;
                return best;
            }
        }
        if best.residual <= self.tolerance {
            return self.accept(best);
        }
        best.by = Answered::Nobody;
        best
    }

    /// The member with the least Σ λ_j² + y_j² of the solution set that `solution` belongs to. For matrices that are not monotone the
    /// solution is returned as it is, and counted as unique where M_aa is regular; with curved laws it is returned as it is.
    #[must_use]
    pub fn least_norm(&mut self, q: &DVector<f64>, solution: &Solution) -> LeastNorm {
        let ones = DVector::from_element(self.size(), 1.0);
        self.least_norm_in(&ones, q, solution, true)
    }

    /// The member alone; whether there is another is not asked.
    #[must_use]
    pub(crate) fn least_norm_alone(&mut self, q: &DVector<f64>, solution: &Solution) -> Solution {
        let ones = DVector::from_element(self.size(), 1.0);
        self.least_norm_in(&ones, q, solution, false).solution
    }

    /// [`Self::least_norm`] where λ_j is `units[j]` and y_j is 1/`units[j]` of what the norm is to see. `others` asks for the other members.
    pub(super) fn least_norm_in(
        &mut self,
        units: &DVector<f64>,
        q: &DVector<f64>,
        solution: &Solution,
        others: bool,
    ) -> LeastNorm {
        let as_it_is = |unique| LeastNorm {
            solution: solution.clone(),
            unique,
            chosen: Vec::new(),
        };
        if self.lawful.is_some() {
            return as_it_is(true);
        }
        self.scaled.q = entrywise(q, &self.scaling.d);
        let scaled = solution.lambda.component_div(&self.scaling.d);
        let y = self.scaled.y(&scaled);
        let units = entrywise(units, &self.scaling.d);
        if let Some(parts) = &mut self.parts {
            let solution = Solution {
                lambda: scaled,
                y,
                ..solution.clone()
            };
            let found = parts.least_norm(&units, &self.scaled.q, &solution, others);
            return LeastNorm {
                solution: self.in_own_units(found.solution),
                ..found
            };
        }
        let scale = largest(scaled.as_slice()).max(largest(self.scaled.q.as_slice()));
        let strict = scaled
            .iter()
            .zip(y.iter())
            .all(|(l, w)| l.max(*w) > self.tolerance * scale);
        let regular = self.on_set(&solution.basis).regular;
        if !self.monotone || (strict && regular) {
            return as_it_is(regular);
        }
        if self.definite {
            return as_it_is(true);
        }
        let least = norm::least(&self.scaled, &scaled, &units, others);
        let basis = solution.basis.clone();
        let found = self.candidate(least.lambda, basis, solution.by);
        if least.chosen.is_empty() && least.unique || found.residual > self.tolerance {
            return as_it_is(least.unique);
        }
        LeastNorm {
            solution: Solution {
                status: Status::Solved,
                ..found
            },
            unique: least.unique,
            chosen: least.chosen,
        }
    }

    /// A solution of the scaled problem in the units of M.
    fn in_own_units(&self, found: Solution) -> Solution {
        Solution {
            status: match found.status {
                Status::Infeasible(ray) => Status::Infeasible(self.scaling.unscale(&ray)),
                other => other,
            },
            lambda: self.scaling.unscale(&found.lambda),
            y: found.y.component_div(&self.scaling.d),
            ..found
        }
    }

    /// The solve on one active set, cached.
    fn on_set(&mut self, active: &[bool]) -> &ActiveSolve {
        let at = self.set(active);
        &self.sets[at].1
    }

    /// The place of the solve on one active set.
    fn set(&mut self, active: &[bool]) -> usize {
        if let Some(at) = self.sets.iter().position(|(set, _)| set == active) {
            at
        } else {
            if self.sets.len() == KEPT_SETS {
                self.sets.remove(0);
            }
            self.factorisations += 1;
            self.sets
                .push((active.to_vec(), ActiveSolve::new(&self.scaled.m, active)));
            self.sets.len() - 1
        }
    }

    fn refined_on(&mut self, active: &[bool]) -> DVector<f64> {
        let at = self.set(active);
        self.sets[at].1.refined(&self.scaled)
    }

    fn try_warm(&mut self, _: f64) -> Option<Solution> {
        let warm = self.warm.clone();
        Some(self.on(warm, Answered::Warm))
    }

    fn try_block(&mut self, slack: f64) -> Option<Solution> {
        let (lambda, set) = pivot::solve(&self.scaled, &self.warm, slack)?;
        Some(self.candidate(lambda, set, Answered::Block))
    }

    fn try_lemke(&mut self, _: f64) -> Option<Solution> {
        let mut last = None;
        for cover in covers(self.scaled.size()) {
            if let Lemke::Basis(active) = lemke::solve(&self.scaled, &cover) {
                let found = self.near(active, Answered::Lemke);
                let good = found.residual <= self.tolerance;
                last = Some(found);
                if good {
                    break;
                }
            }
        }
        last
    }

    fn try_convex(&mut self, _: f64) -> Option<Solution> {
        if !self.monotone {
            return None;
        }
        let rough = convex::solve(&self.scaled)?;
        let y = self.scaled.y(&rough);
        let active: Vec<bool> = (0..rough.len()).map(|j| rough[j] > y[j]).collect();
        Some(self.near(active, Answered::Convex))
    }

    /// The solve on an active set, as a candidate.
    fn on(&mut self, active: Vec<bool>, by: Answered) -> Solution {
        let lambda = self.refined_on(&active);
        self.candidate(lambda, active, by)
    }

    /// The best solve on an active set or near it, by exchanging the pair that is violated most until a set comes back. Where M_aa
    /// is singular but for rounding a degenerate port in the set makes λ any multiple of its kernel; a set without it solves.
    fn near(&mut self, mut active: Vec<bool>, by: Answered) -> Solution {
        let mut best = self.on(active.clone(), by);
        let mut seen = Vec::new();
        while best.residual > self.tolerance && !seen.contains(&active) {
            seen.push(active.clone());
            let lambda = self.refined_on(&active);
            let y = self.scaled.y(&lambda);
            let (worst, violation) = y.zip_map(&lambda, f64::min).argmin();
            if violation >= 0.0 {
                break;
            }
            active[worst] = !active[worst];
            let found = self.on(active.clone(), by);
            if found.residual < best.residual {
                best = found;
            }
        }
        best
    }

    /// A verified Farkas certificate v ≥ 0, Mᵀv ≤ 0, qᵀv < 0 from Lemke's rays, in the units of q: v scaled to qᵀv = −1.
    fn infeasible(&self) -> Option<DVector<f64>> {
        let size = self.scaled.size();
        covers(size).iter().find_map(|cover| {
            let Lemke::Ray(ray) = lemke::solve(&self.scaled, cover) else {
                return None;
            };
            let gain = self.scaled.q.dot(&ray);
            let columns = self.scaled.m.transpose() * &ray;
            let certain = gain
                < -self.tolerance * self.scaled.q.amax() * ray.amax() - self.noise.dot(&ray)
                && columns.max() <= self.tolerance * ray.amax();
            certain.then(|| self.scaling.unscale(&(ray / -gain)))
        })
    }

    /// λ' clipped to λ' ≥ 0 where it is negative by rounding, with its residual in scaled variables beyond what its index set makes of
    /// the uncertainty of q'; what is clipped leaves the index set.
    fn candidate(&mut self, scaled: DVector<f64>, mut basis: Vec<bool>, by: Answered) -> Solution {
        let size = scaled.len();
        let one = Scaling {
            d: DVector::from_element(size, 1.0),
        };
        let (of_lambda, of_y) = self.uncertain(&basis);
        let (scale, q) = (
            largest(scaled.as_slice()),
            largest(self.scaled.q.as_slice()),
        );
        let rounding = self.tolerance * scale.max(q);
        let mut clipped = scaled;
        for (j, active) in basis.iter_mut().enumerate() {
            if clipped[j] < 0.0 && clipped[j] >= -rounding.max(of_lambda[j]) {
                (clipped[j], *active) = (0.0, false);
            }
        }
        let y = self.scaled.y(&clipped);
        let residual = one.residual_beyond(&self.scaled, &clipped, &y, |j| of_y[j]);
        let active = one.active(&clipped, &y, self.tolerance);
        Solution {
            status: Status::Failed,
            lambda: self.scaling.unscale(&clipped),
            y: y.component_div(&self.scaling.d),
            residual,
            active,
            basis,
            by,
        }
    }

    /// What the uncertainty of q' is in λ'_a = −M_aa⁻¹ q'_a and in y'_ā = q'_ā + M_āa λ'_a.
    fn uncertain(&mut self, basis: &[bool]) -> (DVector<f64>, DVector<f64>) {
        let mut of_lambda = DVector::zeros(basis.len());
        if largest(self.noise.as_slice()) == 0.0 {
            return (of_lambda.clone(), of_lambda);
        }
        let mut of_y = self.noise.clone();
        let ActiveSolve {
            indices, inverse, ..
        } = self.on_set(basis);
        let (indices, inverse) = (indices.clone(), inverse.clone());
        let noise = self.noise.select_rows(&indices);
        let through = self.scaled.m.select_columns(&indices) * &inverse;
        for (k, v) in (inverse.abs() * &noise).iter().enumerate() {
            of_lambda[indices[k]] = *v;
        }
        of_y += through.abs() * noise;
        (of_lambda, of_y)
    }

    fn accept(&mut self, mut found: Solution) -> Solution {
        found.status = Status::Solved;
        self.warm.copy_from_slice(&found.basis);
        found
    }
}

/// Covering vectors for Lemke: ones, then two deterministic others for the rare run that rounding leads astray.
fn covers(size: usize) -> [DVector<f64>; 3] {
    let varied = |step: f64| DVector::from_fn(size, |i, _| 1.0 + (i as f64 * step).fract());
    [
        DVector::from_element(size, 1.0),
        varied(0.618_033_988_749_894_9),
        varied(0.414_213_562_373_095_1),
    ]
}

/// Whether M + Mᵀ has no eigenvalue below −[`EIGENVALUE`] times its largest, and whether the [kernel](norm) of it and of any q in its
/// units, |q_j| ≤ 1, is empty: then the least singular value of both is above [`RANK`] times the largest.
fn definiteness(m: &DMatrix<f64>) -> (bool, bool) {
    if m.is_empty() {
        return (true, true);
    }
    let [least, most] = extreme_eigenvalues(&with_transposed(m));
    let size = most.max(-least);
    let with_q = size + (m.nrows() as f64).sqrt();
    (
        least >= -EIGENVALUE * largest(m.as_slice()).max(size),
        least > RANK * with_q,
    )
}
