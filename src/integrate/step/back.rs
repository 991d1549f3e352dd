//! From the λ of short implicit steps to that of the instant at which they start.

use nalgebra::{DMatrix, DVector};

use super::{Columns, KEPT_MODES, StepMatrices};
use crate::lcs::Lcs;

/// What leads from the λ of short steps to that of their start, see [`StepMatrices::back`].
#[derive(Debug, Clone)]
pub(crate) struct Back {
    /// What the first λ lacks, over z.
    rows: DMatrix<f64>,
    /// K⁸: the part of a λ that keeps a constraint on the state. It leads a state that is off it back at once, so that the next step tells it.
    keeps: DMatrix<f64>,
}

impl Back {
    /// λ of a step from z, or of the one behind it, back at the start of the first.
    pub(crate) fn take(&self, z: &[f64], steps: u8, active: &[bool], lambda: &mut [f64]) {
        for (j, l) in lambda.iter_mut().enumerate().filter(|(j, _)| active[*j]) {
            let change: f64 = self.rows.row(j).iter().zip(z).map(|(a, b)| a * b).sum();
            *l = (*l + f64::from(steps) * change).max(0.0);
        }
    }

    /// Whether a λ keeps any constraint on the state; their number is the trace of a projector.
    pub(crate) fn has_constraints(&self) -> bool {
        self.keeps.trace().round() > 0.0
    }

    /// Has the part of λ that keeps a constraint be that of the second step.
    pub(crate) fn correct(&self, lambda: &mut [f64], second: &[f64]) {
        let change = DVector::from_iterator(
            lambda.len(),
            second.iter().zip(&*lambda).map(|(b, a)| b - a),
        );
        let kept = &self.keeps * change;
        for (l, change) in lambda.iter_mut().zip(kept.iter()) {
            *l = (*l + change).max(0.0);
        }
    }
}

impl StepMatrices {
    /// What a λ of this implicit step lacks to be that at its start: where λ follows from x and u at every instant,
    /// D_aa λ + C x + G u + F = 0, the step has moved these by h(C x' + G u'), and a small resistance makes much of it. Where λ is what keeps
    /// a constraint, it is that of a step. With M = D + E, E = h C W B, the former lacks D⁻¹ h(C x' + G u') = (I − K)⁻¹ M⁻¹ h(C x' + G u')
    /// with K = M⁻¹ E, and of the latter K = I. The sum I + K + … + K⁷ = (I + K)(I + K²)(I + K⁴) times I − K⁸ is right for both, up to
    /// 2 K⁸ where K is small.
    pub(crate) fn back(&mut self, lcs: &Lcs, columns: &Columns, active: &[bool]) -> &Back {
        let at = self.back.iter().position(|(known, _)| known == active);
        let at = at.unwrap_or_else(|| {
            if self.back.len() == KEPT_MODES {
                self.back.clear();
            }
            let back = self.make_back(lcs, columns, active);
            self.back.push((active.to_vec(), back));
            self.back.len() - 1
        });
        &self.back[at].1
    }

    fn make_back(&self, lcs: &Lcs, columns: &Columns, active: &[bool]) -> Back {
        let (lambda, solve) = self.lambda_rows(active);
        let m = self.m.nrows();
        let mut made = Back {
            rows: DMatrix::zeros(m, self.q.ncols()),
            keeps: DMatrix::zeros(m, m),
        };
        if !solve.regular {
            return made;
        }
        let scale = DVector::from_iterator(
            solve.indices.len(),
            solve.indices.iter().map(|&j| self.scaling.d[j]),
        );
        let scale = DMatrix::from_diagonal(&scale);
        let inverse = &scale * &solve.inverse * &scale;
        let before = columns.rows(&lcs.c, &lcs.g, 0.0, &lcs.f);
        let moved = &self.q - before + (&self.m - &lcs.d) * lambda;
        let moved = moved.select_rows(&solve.indices);
        let direct = lcs
            .d
            .select_rows(&solve.indices)
            .select_columns(&solve.indices);
        let first = &inverse * direct;
        let one = DMatrix::identity(solve.indices.len(), solve.indices.len());
        let k = &one - &first;
        let squared = &k * &k;
        let fourth = &squared * &squared;
        let eighth = &fourth * &fourth;
        // A network that is not passive may have a K that grows.
        let passive = eighth.amax() <= 1.0;
        let back = if passive {
            (&one - &eighth) * (&one + k) * (&one + squared) * (&one + fourth)
        } else {
            first
        };
        let back = back * (&inverse * moved);
        for (row, &j) in back.row_iter().zip(&solve.indices) {
            made.rows.set_row(j, &row);
        }
        if passive {
            for (column, &i) in eighth.column_iter().zip(&solve.indices) {
                for (value, &j) in column.iter().zip(&solve.indices) {
                    made.keeps[(j, i)] = *value;
                }
            }
        }
        made
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::dmatrix;

    use super::*;
    use crate::integrate::fixtures;
    use crate::integrate::step::Scheme;
    use crate::lcs::Role;

    /// One state and no inputs.
    const ONE: Columns = Columns {
        n: 1,
        varying: vec![],
        constant: vec![],
    };

    /// Two diodes share the current of a capacitor through one resistor: how is not known, nor what each of them had at the start of a step.
    #[test]
    fn currents_that_only_their_sum_determines_are_not_taken_back() {
        let lcs = fixtures::system(
            &[("v(c1)", "V")],
            &[("d1", Role::Current), ("d2", Role::Current)],
            [
                dmatrix![0.0],
                dmatrix![-1.0, -1.0],
                dmatrix![-1.0; -1.0],
                dmatrix![1.0, 1.0; 1.0, 1.0],
            ],
            &[1.0],
        );
        let mut step = StepMatrices::new(&lcs, &ONE, 0.5, Scheme::MOREAU, 1e-9).unwrap();
        // Alone i = v: behind a step of h it is v/(1 + h), and lacks v K with K = h/(1 + h), but for 2 K⁸ of it.
        let alone = step.back(&lcs, &ONE, &[true, false]).rows[(0, 0)];
        let k: f64 = 0.5 / 1.5;
        let found = k * (1.0 - k.powi(8)).powi(2);
        assert!((alone - found).abs() < 1e-15, "{alone}");
        assert_eq!(step.back(&lcs, &ONE, &[true, true]).rows.amax(), 0.0);
    }

    /// A current that holds a capacitor, without a resistance, is a constraint; through one it is none.
    #[test]
    fn a_current_that_holds_a_capacitor_keeps_a_constraint() {
        for (ohms, expected) in [(0.0, 1.0), (1e3, 0.0)] {
            let lcs = fixtures::system(
                &[("v(c1)", "V")],
                &[("d1", Role::Current)],
                [
                    dmatrix![0.0],
                    dmatrix![-1.0],
                    dmatrix![-1.0],
                    dmatrix![ohms],
                ],
                &[1.0],
            );
            let mut step = StepMatrices::new(&lcs, &ONE, 0.5, Scheme::MOREAU, 1e-9).unwrap();
            let back = step.back(&lcs, &ONE, &[true]);
            assert!((back.keeps[(0, 0)] - expected).abs() < 1e-12, "{back:?}");
            assert_eq!(back.has_constraints(), expected > 0.0);
            let mut lambda = [4.0];
            back.correct(&mut lambda, &[3.0]);
            assert!((lambda[0] - (4.0 - expected)).abs() < 1e-12);
        }
    }
}
