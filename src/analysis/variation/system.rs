//! The linear system of a mode, with all that a variation of its state is read through.

use nalgebra::{DMatrix, DVector};

use super::instant::Inputs;
use crate::integrate::exact::{Assembler, Key, Owner};
use crate::integrate::switching::Threshold;
use crate::integrate::{Error, reading};
use crate::lcs::{Hold, Lcs, Rows, fast_states};
use crate::linalg::decouple::{Decoupled, decoupled};
use crate::linalg::expm::Ladders;
use crate::linalg::product::add_product;
use crate::linalg::rays;
use crate::settings::tolerances::exponentials::SQUARED;

/// x' = A x + E u + e₀ in a mode, s = X x + U u + k its storage, x = J s + j.
#[derive(Debug, Clone)]
pub(crate) struct System {
    pub(crate) key: Key,
    pub(crate) lcs: Lcs,
    /// U, q×p.
    pub(crate) storage_inputs: DMatrix<f64>,
    /// E, n×p.
    pub(crate) inputs: DMatrix<f64>,
    /// The basis in which fast states owe nothing to the others, where there are any, and these.
    pub(crate) basis: Option<Decoupled>,
    pub(super) fast: Vec<usize>,
}

/// A row over [x | u | u' | 1].
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) x: DVector<f64>,
    pub(super) u: DVector<f64>,
    pub(super) du: DVector<f64>,
    pub(super) one: f64,
}

impl Row {
    /// Row k of `rows`, with n states and p inputs.
    fn of(rows: &Rows, k: usize, (n, p): (usize, usize)) -> Self {
        let part = |block: &DMatrix<f64>, columns: usize| {
            if k < block.nrows() && block.ncols() == columns {
                block.row(k).transpose()
            } else {
                DVector::zeros(columns)
            }
        };
        Self {
            x: part(&rows.x, n),
            u: part(&rows.u, p),
            du: part(&rows.du, p),
            one: rows.one[k],
        }
    }

    /// self + factor · other
    fn plus(mut self, factor: f64, other: &Self) -> Self {
        self.x.axpy(factor, &other.x, 1.0);
        self.u.axpy(factor, &other.u, 1.0);
        self.du.axpy(factor, &other.du, 1.0);
        self.one += factor * other.one;
        self
    }

    /// All of it.
    pub(super) fn columns(&self) -> DVector<f64> {
        let parts = self.x.iter().chain(&self.u).chain(&self.du).copied();
        let all: Vec<f64> = parts.chain([self.one]).collect();
        DVector::from_vec(all)
    }

    /// The value, and the sum of the magnitudes of its terms.
    pub(super) fn value(&self, x: &DVector<f64>, inputs: &Inputs) -> (f64, f64) {
        let parts = [(&self.x, x), (&self.u, &inputs.u), (&self.du, &inputs.du)];
        let terms = parts
            .into_iter()
            .flat_map(|(row, values)| row.iter().zip(values));
        terms.fold((self.one, self.one.abs()), |(sum, size), (row, value)| {
            (sum + row * value, size + (row * value).abs())
        })
    }

    /// The same of the rate, where x moves at `rate`.
    pub(super) fn rate(&self, rate: &DVector<f64>, inputs: &Inputs) -> (f64, f64) {
        let parts = [
            (&self.x, rate),
            (&self.u, &inputs.du),
            (&self.du, &inputs.ddu),
        ];
        let terms = parts
            .into_iter()
            .flat_map(|(row, values)| row.iter().zip(values));
        terms.fold((0.0, 0.0), |(sum, size), (row, value)| {
            (sum + row * value, size + (row * value).abs())
        })
    }
}

/// `block` with this shape: one without entries may have any.
pub(crate) fn shaped(block: &DMatrix<f64>, rows: usize, columns: usize) -> DMatrix<f64> {
    if block.shape() == (rows, columns) {
        block.clone()
    } else {
        DMatrix::zeros(rows, columns)
    }
}

/// The basis in which the fast states of a generator owe nothing to the others, for the first of these sets for which there is one; and that set.
pub(super) fn apart<const N: usize>(
    generator: &DMatrix<f64>,
    sets: [Vec<usize>; N],
) -> (Option<Decoupled>, Vec<usize>) {
    let sets = sets.into_iter().filter(|fast| !fast.is_empty());
    let mut bases = sets.filter_map(|fast| Some((Some(decoupled(generator, &fast)?), fast)));
    bases.next().unwrap_or_default()
}

impl System {
    pub(super) fn of(key: &Key, assembler: &mut Assembler) -> Result<Self, Error> {
        let hold = |&closed: &bool| if closed { Hold::Closed } else { Hold::Open };
        let holds: Vec<Hold> = key.closed.iter().map(hold).collect();
        let lcs = assembler.assemble(&holds, &key.switches, &key.sliding_switches())?;
        let (n, p, q) = (lcs.n(), lcs.p(), lcs.storage.names.len());
        // Those that are coupled by little are no loss to the run, whose steps are few; derivatives go through many.
        let fast = fast_states(&lcs, assembler.span());
        let (basis, fast) = apart(&lcs.a, [fast, lcs.fast.clone()]);
        Ok(Self {
            key: key.clone(),
            storage_inputs: shaped(&lcs.storage.u, q, p),
            inputs: shaped(&lcs.e, n, p),
            basis,
            fast,
            lcs,
        })
    }

    /// Whether states or outputs see this input: what nothing but switches sees does not.
    pub(super) fn sees(&self, input: usize) -> bool {
        let rows = &self.lcs.outputs.rows;
        let mut all = [&self.inputs, &rows.u, &rows.du].into_iter();
        all.any(|part| input < part.ncols() && part.column(input).iter().any(|value| *value != 0.0))
    }

    /// x = J s + j.
    pub(super) fn state(&self, storage: &[f64]) -> DVector<f64> {
        let mut x = self.lcs.storage.inject_one.clone();
        add_product(x.as_mut_slice(), &self.lcs.storage.inject, storage);
        x
    }

    /// s = X x + U u + k.
    pub(super) fn storage(&self, x: &DVector<f64>, u: &DVector<f64>) -> DVector<f64> {
        let mut s = self.lcs.storage.one.clone();
        add_product(s.as_mut_slice(), &self.lcs.storage.x, x.as_slice());
        add_product(s.as_mut_slice(), &self.storage_inputs, u.as_slice());
        s
    }

    /// x' at x.
    pub(super) fn rate(&self, x: &DVector<f64>, u: &DVector<f64>) -> DVector<f64> {
        let mut rate = self.lcs.e0.clone();
        add_product(rate.as_mut_slice(), &self.lcs.a, x.as_slice());
        add_product(rate.as_mut_slice(), &self.inputs, u.as_slice());
        rate
    }

    /// e^{A τ}; `None` where it does not exist in doubles.
    pub(super) fn propagator(&self, seconds: f64) -> Option<DMatrix<f64>> {
        let n = self.lcs.n();
        let increment = |a: &DMatrix<f64>, fast: &[usize]| {
            let increment = Ladders::new(a, fast, seconds, SQUARED, 0).increment(0)?;
            let identity = |i: usize, j: usize| f64::from(u8::from(i == j));
            Some(DMatrix::from_fn(n, n, |i, j| {
                increment.column(j)[i] + identity(i, j)
            }))
        };
        if n == 0 || seconds <= 0.0 {
            return Some(DMatrix::identity(n, n));
        }
        match &self.basis {
            Some(basis) => Some(&basis.to * increment(&basis.generator, &self.fast)? * &basis.from),
            None => increment(&self.lcs.a, &[]),
        }
    }

    /// The guards of an owner: what must stay positive.
    pub(super) fn guards(
        &self,
        owner: Owner,
        (thresholds, limits): (&[Threshold], impl Fn(usize) -> (f64, f64)),
    ) -> Vec<Row> {
        let lcs = &self.lcs;
        let shape = (lcs.n(), lcs.p());
        match owner {
            Owner::Device(pair) => {
                let Some(at) = lcs.held.pairs.iter().position(|&held| held == pair) else {
                    return vec![];
                };
                let kernel = &lcs.held.kernel;
                if kernel.ncols() == 0 || kernel.row(at).iter().all(|v| *v == 0.0) {
                    return vec![Row::of(&lcs.held.guard, at, shape)];
                }
                let rays = rays::extreme_rays(kernel);
                let rays = rays.iter().flat_map(DMatrix::row_iter);
                let of_pair = rays.filter(|ray| ray[at] != 0.0);
                let combined = of_pair.map(|ray| {
                    let all = ray.iter().enumerate().filter(|(_, r)| **r != 0.0);
                    let rows = all.map(|(k, r)| (*r, Row::of(&lcs.held.guard, k, shape)));
                    rows.reduce(|(a, sum), (r, row)| (a, sum.plus(r / a, &row)))
                });
                combined.flatten().map(|(_, row)| row).collect()
            }
            Owner::Switch(i) => {
                let sliding = self.key.sliding_switches();
                let threshold = &thresholds[i];
                let at = i - sliding.iter().filter(|&&k| k < i).count();
                if sliding.contains(&i) || at >= lcs.controls.one.len() {
                    return vec![];
                }
                let mut row = Row::of(&lcs.controls, at, shape);
                row.one -= if self.key.switches[i] {
                    threshold.off_below
                } else {
                    threshold.on_above
                };
                vec![row]
            }
            Owner::Slide(i, on) => {
                let power = &lcs.outputs.power;
                let Some(term) = power.iter().position(|p| p.element == thresholds[i].name) else {
                    return vec![];
                };
                let v = Row::of(&lcs.outputs.power_v, term, shape);
                let current = Row::of(&lcs.outputs.power_i, term, shape);
                let (ron, goff) = limits(i);
                vec![if on {
                    v.plus(-ron, &current)
                } else {
                    current.plus(-goff, &v)
                }]
            }
        }
    }

    /// The outputs at x, with inputs that move.
    pub(super) fn outputs(&self, x: &DVector<f64>, inputs: &Inputs) -> DVector<f64> {
        let rows = &self.lcs.outputs.rows;
        let point = reading::Point {
            x: x.as_slice(),
            lambda: &[],
            u: inputs.u.as_slice(),
            du: inputs.du.as_slice(),
        };
        DVector::from_fn(rows.one.len(), |k, _| reading::value(rows, k, point))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::dvector;

    #[test]
    fn a_sum_of_guards_has_the_sum_of_their_values() {
        let row = |x: f64, u: f64, du: f64, one: f64| Row {
            x: dvector![x],
            u: dvector![u],
            du: dvector![du],
            one,
        };
        let (a, b) = (row(1.0, 2.0, 3.0, 4.0), row(0.5, -1.0, 7.0, 16.0));
        let inputs = Inputs {
            u: dvector![0.5],
            du: dvector![2.0],
            ddu: dvector![0.0],
        };
        let value = |row: &Row| row.value(&dvector![3.0], &inputs).0;
        assert_eq!((value(&a), value(&b)), (14.0, 31.0));
        assert_eq!(value(&a.plus(-2.0, &b)), 14.0 - 2.0 * 31.0);
    }
}
