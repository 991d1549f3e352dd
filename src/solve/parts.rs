//! Problems that fall into parts without an entry of M between them.
//!
//! Each part is solved alone and accepted at its own size: a rectifier of nanovolts beside one of gigavolts would else be rounding.

use nalgebra::{DMatrix, DVector};

use super::driver::{Driver, LeastNorm};
use super::lcp::{Answered, Solution, Status};
use crate::linalg::blocks::connected;

/// The drivers of the parts of M, with the ports each has; none where M is one part.
#[derive(Debug, Clone)]
pub(super) struct Parts(Vec<(Vec<usize>, Driver)>);

impl Parts {
    /// The parts of M, at least two of them.
    pub(super) fn of(m: &DMatrix<f64>, tolerance: f64) -> Option<Self> {
        let groups = connected(m);
        let driver = |group: Vec<usize>| {
            let part = m.select_rows(&group).select_columns(&group);
            (group, Driver::new(part, tolerance))
        };
        (groups.len() > 1).then(|| Self(groups.into_iter().map(driver).collect()))
    }

    /// See [`Driver::blur`].
    pub(super) fn blur(&mut self, noise: &DVector<f64>) {
        for (group, driver) in &mut self.0 {
            driver.blur(&noise.select_rows(&*group));
        }
    }

    /// Solves all parts, each first with its part of `warm`.
    pub(super) fn solve(&mut self, q: &DVector<f64>, warm: &[bool]) -> Solution {
        let size = q.len();
        let mut whole = Solution {
            status: Status::Solved,
            lambda: DVector::zeros(size),
            y: DVector::zeros(size),
            residual: 0.0,
            active: vec![None; size],
            basis: vec![false; size],
            by: Answered::Warm,
        };
        for (group, driver) in &mut self.0 {
            let first: Vec<bool> = group.iter().map(|&j| warm[j]).collect();
            driver.suggest(&first);
            let found = driver.solve(&q.select_rows(&*group));
            for (k, &j) in group.iter().enumerate() {
                whole.lambda[j] = found.lambda[k];
                whole.y[j] = found.y[k];
                whole.active[j] = found.active[k];
                whole.basis[j] = found.basis[k];
            }
            whole.residual = whole.residual.max(found.residual);
            match (found.status, &whole.status) {
                (Status::Infeasible(ray), Status::Solved | Status::Failed) => {
                    let mut all = DVector::zeros(size);
                    group.iter().zip(ray.iter()).for_each(|(&j, v)| all[j] = *v);
                    (whole.status, whole.by) = (Status::Infeasible(all), found.by);
                }
                (Status::Failed, Status::Solved) => {
                    (whole.status, whole.by) = (Status::Failed, found.by);
                }
                (_, Status::Solved) if found.by != Answered::Warm => whole.by = found.by,
                _ => {}
            }
        }
        whole
    }

    /// See [`Driver::least_norm_in`].
    pub(super) fn least_norm(
        &mut self,
        units: &DVector<f64>,
        q: &DVector<f64>,
        solution: &Solution,
        others: bool,
    ) -> LeastNorm {
        let mut whole = LeastNorm {
            solution: solution.clone(),
            unique: true,
            chosen: Vec::new(),
        };
        for (group, driver) in &mut self.0 {
            let part = Solution {
                status: Status::Solved,
                lambda: solution.lambda.select_rows(&*group),
                y: solution.y.select_rows(&*group),
                residual: solution.residual,
                active: group.iter().map(|&j| solution.active[j]).collect(),
                basis: group.iter().map(|&j| solution.basis[j]).collect(),
                by: solution.by,
            };
            let [units, q] = [units, q].map(|all| all.select_rows(&*group));
            let found = driver.least_norm_in(&units, &q, &part, others);
            for (k, &j) in group.iter().enumerate() {
                whole.solution.lambda[j] = found.solution.lambda[k];
                whole.solution.y[j] = found.solution.y[k];
                whole.solution.active[j] = found.solution.active[k];
            }
            whole.unique &= found.unique;
            whole.chosen.extend(found.chosen.iter().map(|&k| group[k]));
        }
        whole
    }

    /// Factorisations computed so far.
    pub(super) fn factorisations(&self) -> u64 {
        self.0.iter().map(|(_, driver)| driver.factorisations).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{dmatrix, dvector};

    #[test]
    fn a_small_part_is_solved_beside_a_large_one() {
        let m = dmatrix![2.0, 0.0, 0.0; 0.0, 1.0, 1.0; 0.0, -1.0, 0.0];
        let mut driver = Driver::new(m, 1e-9);
        let found = driver.solve(&dvector![-1e-9, -1e9, 2.0]);
        assert_eq!(found.status, Status::Solved);
        assert_eq!(found.lambda, dvector![5e-10, 2.0, 1e9 - 2.0]);
        assert_eq!(found.active, vec![Some(true); 3]);
    }

    #[test]
    fn the_ray_of_one_part_is_a_ray_of_the_whole() {
        let mut driver = Driver::new(dmatrix![1.0, 0.0; 0.0, 0.0], 1e-9);
        let found = driver.solve(&dvector![-1.0, -2.0]);
        assert_eq!(found.status, Status::Infeasible(dvector![0.0, 0.5]));
    }

    #[test]
    fn an_entry_on_either_side_of_the_diagonal_couples() {
        for m in [dmatrix![1.0, -1.0; 0.0, 1.0], dmatrix![1.0, 0.0; -1.0, 1.0]] {
            assert!(Parts::of(&m, 1e-9).is_none(), "{m}");
        }
        let chain = dmatrix![
            1.0, 0.0, 2.0, 0.0;
            0.0, 1.0, 0.0, 0.0;
            0.0, 0.0, 1.0, 3.0;
            0.0, 0.0, 0.0, 1.0
        ];
        let Some(Parts(parts)) = Parts::of(&chain, 1e-9) else {
            panic!("two parts")
        };
        let groups: Vec<_> = parts.into_iter().map(|(group, _)| group).collect();
        assert_eq!(groups, [vec![0, 2, 3], vec![1]]);
    }

    /// The first part has every λ ≥ 0 as its solution, the second one.
    #[test]
    fn the_least_norm_is_that_of_every_part() {
        let mut driver = Driver::new(dmatrix![0.0, 0.0; 0.0, 2.0], 1e-9);
        let q = dvector![0.0, -8.0];
        let found = driver.solve(&q);
        assert_eq!(found.lambda[1], 4.0);
        let another = Solution {
            lambda: dvector![5.0, 4.0],
            y: dvector![0.0, 0.0],
            basis: vec![true, true],
            ..found
        };
        let least = driver.least_norm(&q, &another);
        assert_eq!(least.solution.lambda, dvector![0.0, 4.0]);
        assert!(!least.unique && least.chosen.is_empty());
        let mut regular = Driver::new(dmatrix![1.0, 0.0; 0.0, 2.0], 1e-9);
        let found = regular.solve(&dvector![-1.0, -8.0]);
        let least = regular.least_norm(&dvector![-1.0, -8.0], &found);
        assert_eq!(least.solution.lambda, dvector![1.0, 4.0]);
        assert!(least.unique);
    }

    #[test]
    fn every_part_starts_with_its_own_set_and_keeps_its_factors() {
        let mut driver = Driver::new(dmatrix![1.0, 0.0; 0.0, 2.0], 1e-9);
        driver.suggest(&[true, true]);
        let found = driver.solve(&dvector![-1.0, -8.0]);
        assert_eq!((found.by, driver.factorisations), (Answered::Warm, 2));
        assert_eq!(found.basis, [true, true]);
        // The set of the last solution comes first now.
        let found = driver.solve(&dvector![-2.0, -4.0]);
        assert_eq!((found.by, driver.factorisations), (Answered::Warm, 2));
        assert_eq!(found.lambda, dvector![2.0, 2.0]);
        driver.suggest(&[false, false]);
        let found = driver.solve(&dvector![1.0, -4.0]);
        assert_ne!(found.by, Answered::Warm);
        assert_eq!(found.basis, [false, true]);
    }

    /// What is no number has no solution; the part beside it has its own.
    #[test]
    fn a_part_that_fails_fails_the_whole() {
        let mut driver = Driver::new(dmatrix![1.0, 0.0; 0.0, 2.0], 1e-9);
        let found = driver.solve(&dvector![f64::NAN, -8.0]);
        assert_eq!((found.status, found.lambda[1]), (Status::Failed, 4.0));
        assert_eq!(found.residual, f64::INFINITY);
    }
}
