//! The guards of a mode along its flow: their values, rounding, and Taylor polynomials.

use nalgebra::DMatrix;

use super::Flow;
use crate::linalg::dense::BLOCK;
use crate::linalg::kernel::SparseKernel;
use crate::linalg::series::{MAX_DEGREE, Series};
use crate::settings::tolerances::events::{GROUP, NOISE};

impl Flow {
    /// Number of guards.
    pub(crate) fn guards(&self) -> usize {
        self.guards
    }

    /// 𝒢.
    pub(crate) fn guard_matrix(&self) -> DMatrix<f64> {
        DMatrix::from_row_slice(self.guards, self.dim, &self.guard_rows)
    }

    /// A row of 𝒢.
    pub(crate) fn guard_row(&self, guard: usize) -> &[f64] {
        &self.guard_rows[guard * self.dim..(guard + 1) * self.dim]
    }

    /// Fills g and g' behind w.
    pub(crate) fn read_guards(&self, state: &mut [f64]) {
        let (w, g) = state.split_at_mut(self.dim);
        self.rows.apply_first(w, g);
    }

    /// Rounding noise of g and g' where |w| ≤ `amplitude`.
    pub(crate) fn noise(&self, amplitude: &[f64], floors: &mut Vec<f64>) {
        floors.resize(2 * self.guards, 0.0);
        self.row_sizes.apply_first(amplitude, floors);
        for floor in floors {
            *floor *= NOISE * f64::EPSILON;
        }
    }

    /// The first term of Taylor's series of guard i, from order `from` on, that is more than `noise` times rounding: a source acts on a
    /// diode behind a chain of n sections with its n-th derivative.
    pub(crate) fn first_term(
        &self,
        i: usize,
        from: usize,
        w: &[f64],
        sizes: &[f64],
        noise: f64,
    ) -> Option<f64> {
        let dt = self.steps[self.bottom as usize];
        let row = self.guard_row(i);
        let padded = |values: &[f64]| {
            let mut values = values[..self.dim].to_vec();
            values.resize(self.dim.next_multiple_of(BLOCK), 0.0);
            values
        };
        let (mut term, mut whole) = (padded(w), padded(sizes));
        let mut next = whole.clone();
        for k in 1..=MAX_DEGREE {
            for (values, kernel) in [
                (&mut term, &self.generator_kernel),
                (&mut whole, &self.generator_sizes),
            ] {
                next_term(kernel, values, dt / k as f64, &mut next);
                std::mem::swap(values, &mut next);
            }
            if k < from {
                continue;
            }
            let values = row.iter().zip(term.iter().zip(&whole));
            let (value, size) = values.fold((0.0, 0.0), |(value, size), (g, (term, whole))| {
                (value + g * term, size + g.abs() * whole)
            });
            if value.abs() > noise * f64::EPSILON * size {
                return Some(value);
            }
        }
        None
    }

    /// Of guard i, which stands on zero, the first coefficient of its [polynomial](Self::guard_polynomial) over `dt` that is more than
    /// rounding, and than what an error `time` of the time makes of the next one, decides as where a mode is inspected: where it is
    /// positive the guard rises, and no coefficient before it that rounding makes negative turns it around; nor does a slope that the curvature
    /// turns around before the guard has left `floor`. `sizes` are those that w can have had.
    pub(crate) fn settle_polynomial(
        &self,
        i: usize,
        polynomial: &mut [f64],
        sizes: &[f64],
        ([dt, time], floor): ([f64; 2], f64),
        (term, next): (&mut Vec<f64>, &mut Vec<f64>),
    ) {
        let row = self.guard_row(i);
        term.clear();
        term.extend_from_slice(&sizes[..self.dim]);
        let mut dips = false;
        for values in [&mut *term, &mut *next] {
            values.resize(self.dim.next_multiple_of(BLOCK), 0.0);
        }
        for k in 1..polynomial.len() {
            next_term(&self.generator_sizes, term, dt / k as f64, next);
            std::mem::swap(term, next);
            let whole: f64 = row.iter().zip(&*term).map(|(g, w)| g.abs() * w).sum();
            let (value, after) = (polynomial[k], polynomial.get(k + 1).copied().unwrap_or(0.0));
            let noise = GROUP * f64::EPSILON * whole + time / dt * (k + 1) as f64 * after.abs();
            if value.abs() <= noise {
                if dips {
                    return;
                }
                continue;
            }
            if value > 0.0 {
                for earlier in &mut polynomial[1..k] {
                    *earlier = earlier.max(0.0);
                }
                return;
            }
            dips = k == 1 && after > 0.0 && value.powi(2) <= 2.0 * floor * after;
            if !dips {
                return;
            }
        }
    }

    /// Of every guard in the fraction of Taylor's step: coefficients 2 and 3, and a bound on what the higher ones add up to.
    pub(crate) fn guard_cubics(&self, series: &Series, rest: &mut Vec<f64>, values: &mut Vec<f64>) {
        let m = self.guards;
        values.clear();
        values.resize(3 * m, 0.0);
        for k in 2..=series.degree().min(3) {
            let value = &mut values[(k - 2) * m..(k - 1) * m];
            self.rows.apply_first(series.term(k), value);
        }
        series.rest(4, rest);
        self.row_sizes.apply_first(rest, &mut values[2 * m..]);
    }

    /// Guard i as a polynomial in the fraction of Taylor's step.
    pub(crate) fn guard_polynomial(&self, i: usize, series: &Series) -> [f64; MAX_DEGREE + 1] {
        let mut polynomial = [0.0; MAX_DEGREE + 1];
        let row = self.guard_row(i);
        for (k, coefficient) in polynomial.iter_mut().enumerate().take(series.degree() + 1) {
            let terms = row.iter().zip(series.term(k));
            *coefficient = terms.map(|(g, term)| g * term).sum();
        }
        polynomial
    }
}

/// 𝒜 w · factor, with zeros behind the last component.
fn next_term(generator: &SparseKernel, w: &[f64], factor: f64, next: &mut [f64]) {
    let (blocks, _) = next.as_chunks_mut::<BLOCK>();
    generator.apply(w, blocks);
    for value in next {
        *value *= factor;
    }
}
