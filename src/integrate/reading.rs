//! Rows over [x | λ | u | u' | 1] evaluated without allocation.

use nalgebra::DVector;

use crate::lcs::sparse::SparseRows;
use crate::lcs::{Lcs, Port, Role, Rows};

/// Where the quantities of a circuit stand at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Point<'a> {
    /// n states.
    pub x: &'a [f64],
    /// m port variables.
    pub lambda: &'a [f64],
    /// p inputs.
    pub u: &'a [f64],
    /// p slopes of the inputs.
    pub du: &'a [f64],
}

/// Row `i` of `rows` at a point. Blocks without columns (a system without devices, rows without u') count as zero.
#[must_use]
pub fn value(rows: &Rows, i: usize, at: Point<'_>) -> f64 {
    sum(rows, i, at, |term| term)
}

/// All rows for inputs u, where these alone decide them.
pub(crate) fn of_sources(rows: &Rows, u: &[f64]) -> Option<Vec<f64>> {
    let others = [&rows.x, &rows.lambda, &rows.du];
    if others.iter().any(|block| block.iter().any(|v| *v != 0.0)) {
        return None;
    }
    let at = Point {
        x: &[],
        lambda: &[],
        u,
        du: &[],
    };
    Some((0..rows.one.len()).map(|i| value(rows, i, at)).collect())
}

/// The sum of the magnitudes that [`value`] is computed from.
#[must_use]
pub fn magnitude(rows: &Rows, i: usize, at: Point<'_>) -> f64 {
    sum(rows, i, at, f64::abs)
}

fn sum(rows: &Rows, i: usize, at: Point<'_>, part: impl Fn(f64) -> f64) -> f64 {
    let mut sum = rows.one.get(i).map_or(0.0, |&one| part(one));
    for (block, values) in [
        (&rows.x, at.x),
        (&rows.lambda, at.lambda),
        (&rows.u, at.u),
        (&rows.du, at.du),
    ] {
        if i < block.nrows() {
            let columns = block.ncols().min(values.len());
            for (j, &v) in values.iter().enumerate().take(columns) {
                let weight = block[(i, j)];
                if weight != 0.0 {
                    sum += part(weight * v);
                }
            }
        }
    }
    sum
}

/// [`value`] of rows without their zeros.
pub(crate) fn sparse_value(rows: &SparseRows, i: usize, at: Point<'_>) -> f64 {
    let mut sum = rows.one[i];
    for (block, values) in [
        (&rows.x, at.x),
        (&rows.lambda, at.lambda),
        (&rows.u, at.u),
        (&rows.du, at.du),
    ] {
        if !values.is_empty() {
            sum += block.row(i).map(|(j, w)| w * values[j]).sum::<f64>();
        }
    }
    sum
}

/// y_j = C x + D λ + G u + F of port j; `None` where λ is not known.
pub(crate) fn output(lcs: &Lcs, j: usize, at: Point<'_>) -> Option<f64> {
    if at.lambda.len() < lcs.m() {
        return None;
    }
    let mut sum = lcs.f[j];
    for (block, values) in [(&lcs.c, at.x), (&lcs.d, at.lambda), (&lcs.g, at.u)] {
        sum += block
            .row(j)
            .iter()
            .zip(values)
            .map(|(a, b)| a * b)
            .sum::<f64>();
    }
    Some(sum)
}

/// The impulse (area) of row `i` for port impulses p and steps Δu of the inputs.
#[must_use]
pub fn impulse(rows: &Rows, i: usize, p: &[f64], step_of_u: &[f64]) -> f64 {
    let mut sum = 0.0;
    for (block, values) in [(&rows.lambda, p), (&rows.du, step_of_u)] {
        if i < block.nrows() {
            sum += (0..block.ncols().min(values.len()))
                .map(|j| block[(i, j)] * values[j])
                .sum::<f64>();
        }
    }
    sum
}

/// Voltage and current of each port from λ and y; of a function its input and output.
pub(crate) fn points(lcs: &Lcs, lambda: &DVector<f64>, y: &DVector<f64>) -> Vec<(f64, f64)> {
    let values = lcs.ports.iter().zip(lambda.iter().zip(y));
    let point = |(port, (&lambda, &y)): (&Port, (&f64, &f64))| match port.role {
        Role::Voltage => (-lambda, y),
        Role::Current | Role::Function => (-y, lambda),
    };
    values.map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{dmatrix, dvector};

    #[test]
    fn rows_of_sources_alone_need_no_state() {
        let mut rows = Rows {
            x: dmatrix![0.0; 0.0],
            u: dmatrix![2.0; -1.0],
            one: dvector![1.0, 0.5],
            ..Rows::default()
        };
        assert_eq!(of_sources(&rows, &[3.0]), Some(vec![7.0, -2.5]));
        rows.x[1] = 1e-300;
        assert_eq!(of_sources(&rows, &[3.0]), None);
    }
}
