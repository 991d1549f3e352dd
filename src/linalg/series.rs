//! Taylor's series of a mode's flow, w(t + s·dt) = Σ (𝒜 dt)^k w/k! · s^k: what tables of exponentials do not cover.

use super::dense::{BLOCK, Block};
use super::kernel::SparseKernel;
use crate::settings::tolerances::exponentials::TERM_IS_NOTHING;

/// Highest degree; where ‖𝒜‖ dt ≤ 1 the rest is below rounding.
pub(crate) const MAX_DEGREE: usize = 20;

/// The terms of one step, in blocks of four with zeros behind the last component.
#[derive(Debug, Clone, Default)]
pub(crate) struct Series {
    /// Blocks of a term.
    blocks: usize,
    degree: usize,
    terms: Vec<Block>,
    /// Largest components so far.
    largest: Vec<Block>,
}

impl Series {
    /// The terms for `dt` from w on, w' = 𝒜 w.
    pub(crate) fn expand(&mut self, generator: &SparseKernel, w: &[f64], dt: f64) {
        let blocks = w.len().div_ceil(BLOCK);
        self.blocks = blocks;
        self.terms.resize((MAX_DEGREE + 1) * blocks, [0.0; BLOCK]);
        let first = self.terms[..blocks].as_flattened_mut();
        first[..w.len()].copy_from_slice(w);
        first[w.len()..].fill(0.0);
        self.largest.clear();
        let first = self.terms[..blocks].iter();
        self.largest.extend(first.map(|block| block.map(f64::abs)));
        self.degree = MAX_DEGREE;
        let mut nothing_before = false;
        for k in 1..=MAX_DEGREE {
            let (known, rest) = self.terms.split_at_mut(k * blocks);
            let term = &mut rest[..blocks];
            generator.apply(known[(k - 1) * blocks..].as_flattened(), term);
            let nothing = settle(term, &mut self.largest, dt / k as f64);
            if nothing && nothing_before {
                self.degree = k;
                break;
            }
            nothing_before = nothing;
        }
    }

    /// The highest power.
    pub(crate) fn degree(&self) -> usize {
        self.degree
    }

    /// Term k, zeros behind its last component.
    pub(crate) fn term(&self, k: usize) -> &[f64] {
        self.terms[k * self.blocks..(k + 1) * self.blocks].as_flattened()
    }

    /// w at the fraction s of the step, by Horner's rule.
    pub(crate) fn at(&self, s: f64, w: &mut [f64]) {
        let (lower, last) = self.terms.split_at(self.degree * self.blocks);
        for (b, (w, &last)) in w.chunks_mut(BLOCK).zip(last).enumerate() {
            let mut sums = last;
            for term in lower.chunks_exact(self.blocks).rev() {
                for (sum, term) in sums.iter_mut().zip(&term[b]) {
                    *sum = *sum * s + term;
                }
            }
            for (w, sum) in w.iter_mut().zip(sums) {
                *w = sum;
            }
        }
    }

    /// Component j of w at some fractions of the step.
    #[inline]
    pub(crate) fn component<const P: usize>(&self, j: usize, s: [f64; P]) -> [f64; P] {
        let (lower, rest) = self.terms.split_at(self.degree * self.blocks);
        let mut w = [rest.as_flattened()[j]; P];
        for term in lower.chunks_exact(self.blocks).rev() {
            let term = term.as_flattened()[j];
            for p in 0..P {
                w[p] = w[p] * s[p] + term;
            }
        }
        w
    }

    /// `sum` = Σ |terms| from power `first` on.
    pub(crate) fn rest(&self, first: usize, sum: &mut Vec<f64>) {
        sum.clear();
        sum.resize(self.blocks * BLOCK, 0.0);
        for k in first..=self.degree {
            for (sum, term) in sum.iter_mut().zip(self.term(k)) {
                *sum += term.abs();
            }
        }
    }
}

/// Scales a term, and raises `largest` to it; returns whether it was nothing beside what they were.
#[inline]
fn settle(term: &mut [Block], largest: &mut [Block], factor: f64) -> bool {
    let mut beyond = [0.0_f64; BLOCK];
    for (term, largest) in term.iter_mut().zip(largest) {
        for ((value, largest), beyond) in term.iter_mut().zip(largest).zip(&mut beyond) {
            *value *= factor;
            let size = value.abs();
            let by = size - TERM_IS_NOTHING * *largest;
            // As `f64::max` where neither is NaN, in one instruction.
            *beyond = if *beyond > by { *beyond } else { by };
            *largest = if *largest > size { *largest } else { size };
        }
    }
    beyond.iter().all(|by| *by <= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    #[test]
    fn a_term_that_grows_smaller_leaves_the_largest() {
        let (mut term, mut largest) = ([[1.0; BLOCK]], [[2.0; BLOCK]]);
        assert!(!settle(&mut term, &mut largest, 0.5));
        assert_eq!((term, largest), ([[0.5; BLOCK]], [[2.0; BLOCK]]));
        assert!(!settle(&mut term, &mut largest, 6.0));
        assert_eq!(largest, [[3.0; BLOCK]]);
        assert!(settle(&mut term, &mut largest, 0.1 * TERM_IS_NOTHING));
    }

    /// Rotations at rates 1, 2, … beside a constant: any number of blocks, the same series.
    #[test]
    fn rotations_of_any_dimension() {
        for pairs in [1, 2, 3, 5, 7, 8, 10] {
            let dim = 2 * pairs + 1;
            let mut a = DMatrix::zeros(dim, dim);
            for k in 0..pairs {
                a[(2 * k, 2 * k + 1)] = -((k + 1) as f64);
                a[(2 * k + 1, 2 * k)] = (k + 1) as f64;
            }
            let start: Vec<f64> = (0..dim).map(|i| [1.0, 0.0][i % 2]).collect();
            let (mut series, mut w) = (Series::default(), vec![0.0; dim]);
            let dt = 1.0 / pairs as f64;
            series.expand(&SparseKernel::new(&a), &start, dt);
            assert!((14..=MAX_DEGREE).contains(&series.degree()));
            for s in [0.0, 0.3, 1.0] {
                series.at(s, &mut w);
                for (k, w) in w.as_chunks::<2>().0.iter().enumerate() {
                    let (sin, cos) = ((k + 1) as f64 * s * dt).sin_cos();
                    assert!(
                        (w[0] - cos).abs() < 4e-16 && (w[1] - sin).abs() < 4e-16,
                        "{w:?}"
                    );
                }
                assert_eq!(w[dim - 1], 1.0);
            }
            let mut rest = Vec::new();
            series.rest(2, &mut rest);
            // cosh 1 − 1 and sinh 1 − 1 of the fastest
            assert!((rest[dim - 3] - (1_f64.cosh() - 1.0)).abs() < 1e-15);
            assert!((rest[dim - 2] - (1_f64.sinh() - 1.0)).abs() < 1e-15);
        }
    }
}
