//! An independent simulator for the tests: a tableau of the circuit's own cards, solved densely; Radau IIA of order 5 between
//! events, which are located on the steps themselves. It shares no code and no formulation with `circ`.
//!
//! Every switch, diode and comparator has a position; with finite resistances the network of given positions is regular, and
//! the capacitor voltages and inductor currents determine everything else. Positions at an instant: first the diodes, until all
//! agree, then all switches and comparators whose control has passed move at once.

mod curved;
mod network;
mod positions;
mod radau;
mod waves;

use std::cell::Cell;

use crate::circuit::Circuit;
pub(crate) use network::Network;
pub(crate) use waves::corners;

/// Why the oracle has no answer: the circuit, or the accuracy, is beyond it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Declined(pub(crate) String);

/// States in the order of [`crate::circuit::states`], a row per instant k·stop/rows, k = 1, …
#[derive(Debug, Clone, Default)]
pub(crate) struct Answer {
    pub(crate) rows: Vec<Vec<f64>>,
    /// When devices moved between corners of the sources, s.
    pub(crate) events: Vec<f64>,
    pub(crate) steps: usize,
}

/// How finely to step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Accuracy {
    /// Of one step, relative to the largest value of each state since the first row.
    pub(crate) tolerance: f64,
    /// The longest step in parts of the time between neighbouring corners and rows.
    pub(crate) longest: f64,
}

/// What an answer is made with, and what tells its error: never the same steps.
pub(crate) const FINE: Accuracy = Accuracy {
    tolerance: 1e-7,
    longest: 0.5,
};
pub(crate) const COARSE: Accuracy = Accuracy {
    tolerance: 1e-6,
    longest: 1.0,
};

/// Simulates. Multiplications are taken from `budget`, a count rather than a time, so that a seed has the same answer on every
/// machine.
pub(crate) fn simulate(
    circuit: &Circuit,
    accuracy: Accuracy,
    budget: &Cell<u64>,
) -> Result<Answer, Declined> {
    let network = Network::new(circuit)?;
    radau::run(&network, circuit, accuracy, budget)
}

/// Takes `work` from the budget; nothing is left when it does not suffice.
fn spend(budget: &Cell<u64>, work: usize) {
    budget.set(budget.get().saturating_sub(work as u64));
}

/// A square matrix by rows, factorised in place with partial pivoting after its rows have been scaled.
#[derive(Debug, Clone, Default)]
pub(crate) struct Factors {
    n: usize,
    a: Vec<f64>,
    order: Vec<usize>,
    scale: Vec<f64>,
}

impl Factors {
    /// `None` where a pivot is below 1e-14 of its scaled row.
    pub(crate) fn new(n: usize, mut a: Vec<f64>) -> Option<Self> {
        let mut order: Vec<usize> = (0..n).collect();
        let mut scale = vec![1.0; n];
        for (row, scale) in a.chunks_mut(n).zip(&mut scale) {
            let largest = row.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            if !(largest > 0.0 && largest.is_finite()) {
                return None;
            }
            *scale = 1.0 / largest;
            row.iter_mut().for_each(|x| *x *= *scale);
        }
        for k in 0..n {
            let pivot =
                (k..n).max_by(|&i, &j| a[i * n + k].abs().total_cmp(&a[j * n + k].abs()))?;
            if a[pivot * n + k].abs() < 1e-26 {
                return None;
            }
            if pivot != k {
                order.swap(pivot, k);
                for j in 0..n {
                    a.swap(pivot * n + j, k * n + j);
                }
            }
            let (upper, lower) = a.split_at_mut((k + 1) * n);
            let top = &upper[k * n..];
            for row in lower.chunks_mut(n) {
                if row[k] != 0.0 {
                    let factor = row[k] / top[k];
                    row[k] = factor;
                    for (x, y) in row[k + 1..].iter_mut().zip(&top[k + 1..]) {
                        *x -= factor * y;
                    }
                }
            }
        }
        Some(Self { n, a, order, scale })
    }

    pub(crate) fn solve(&self, b: &[f64]) -> Vec<f64> {
        let n = self.n;
        let mut x: Vec<f64> = self.order.iter().map(|&i| b[i] * self.scale[i]).collect();
        for i in 0..n {
            let row = &self.a[i * n..i * n + i];
            let sum: f64 = row.iter().zip(&x[..i]).map(|(a, x)| a * x).sum();
            x[i] -= sum;
        }
        for i in (0..n).rev() {
            let row = &self.a[i * n..(i + 1) * n];
            let sum: f64 = row[i + 1..]
                .iter()
                .zip(&x[i + 1..])
                .map(|(a, x)| a * x)
                .sum();
            x[i] = (x[i] - sum) / row[i];
        }
        x
    }
}

/// a + b and what rounding took.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let t = s - a;
    (s, (a - (s - t)) + (b - t))
}

/// Solves with factors of `a`, in twice the precision by refinement of the residual; entries of `a` count as exact. Each value comes with what rounding took, as
/// the voltage across a small resistance is the difference of two large ones.
pub(crate) fn refined(factors: &Factors, a: &[f64], b: &[f64]) -> Vec<(f64, f64)> {
    let n = b.len();
    let mut x = vec![(0.0, 0.0); n];
    for _ in 0..6 {
        let mut residual = vec![0.0; n];
        for i in 0..n {
            let mut sum = (b[i], 0.0);
            for (a, x) in a[i * n..(i + 1) * n].iter().zip(&x) {
                if *a == 0.0 || x.0 == 0.0 {
                    continue;
                }
                let p = -a * x.0;
                let low = (-a).mul_add(x.0, -p) - a * x.1;
                let (high, rest) = two_sum(sum.0, p);
                sum = (high, sum.1 + rest + low);
            }
            residual[i] = sum.0 + sum.1;
        }
        if residual.iter().all(|r| *r == 0.0) {
            break;
        }
        for (x, d) in x.iter_mut().zip(factors.solve(&residual)) {
            let (high, rest) = two_sum(x.0, d);
            let low = x.1 + rest;
            let sum = high + low;
            *x = (sum, low - (sum - high));
        }
    }
    x
}
