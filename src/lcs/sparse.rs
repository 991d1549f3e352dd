//! Systems of many states: matrices without their zeros.

use serde::{Deserialize, Serialize};

use super::{Input, Port, Position, PowerKind, ReduceError, State, reduce};
use crate::mna::StaticMultiport;

/// States and ports from which on a system is written without its zeros.
pub const MANY: usize = 1000;

/// A matrix in compressed rows: the entries of row i are `data[indptr[i]..indptr[i + 1]]`, in the columns `indices[…]`, increasing.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Csr {
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Where each row begins, and the end.
    pub indptr: Vec<usize>,
    /// Columns.
    pub indices: Vec<usize>,
    /// Entries, none of them zero.
    pub data: Vec<f64>,
}

impl Csr {
    /// A matrix of no rows yet.
    #[must_use]
    pub fn new(columns: usize) -> Self {
        Self {
            shape: [0, columns],
            indptr: vec![0],
            ..Self::default()
        }
    }

    /// A matrix without its zeros.
    pub(crate) fn of(matrix: &nalgebra::DMatrix<f64>) -> Self {
        let mut own = Self::new(matrix.ncols());
        for row in matrix.row_iter() {
            let entries = row.iter().copied().enumerate();
            own.push(
                entries
                    .filter(|(_, value)| *value != 0.0)
                    .collect::<Vec<_>>(),
            );
        }
        own
    }

    /// Appends a row of entries (column, value), columns increasing.
    pub fn push(&mut self, row: impl IntoIterator<Item = (usize, f64)>) {
        for (column, value) in row {
            self.indices.push(column);
            self.data.push(value);
        }
        self.shape[0] += 1;
        self.indptr.push(self.data.len());
    }

    /// The entries (row, column, value), row by row.
    pub fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let rows = self.indptr.windows(2).enumerate();
        rows.flat_map(move |(i, ends)| {
            (ends[0]..ends[1]).map(move |k| (i, self.indices[k], self.data[k]))
        })
    }

    /// Whether the parts fit together.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let [rows, columns] = self.shape;
        self.indptr.len() == rows + 1
            && self.indptr.first() == Some(&0)
            && self.indptr.last() == Some(&self.data.len())
            && self.indices.len() == self.data.len()
            && self.indptr.is_sorted()
            && self.indices.iter().all(|&j| j < columns)
    }

    /// The entries (column, value) of row i.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> {
        let ends = self.indptr[i]..self.indptr[i + 1];
        ends.map(|k| (self.indices[k], self.data[k]))
    }

    /// y + factor M x, in y.
    pub(crate) fn add_times(&self, factor: f64, x: &[f64], y: &mut [f64]) {
        for (i, y) in y.iter_mut().enumerate() {
            *y += factor * self.row(i).map(|(j, value)| value * x[j]).sum::<f64>();
        }
    }

    /// y + factor Mᵀ x, in y.
    pub(crate) fn add_transposed(&self, factor: f64, x: &[f64], y: &mut [f64]) {
        for (i, x) in x.iter().enumerate() {
            if *x != 0.0 {
                self.row(i)
                    .for_each(|(j, value)| y[j] += factor * value * x);
            }
        }
    }

    /// M x.
    ///
    /// # Panics
    /// Where `x` has not one value a column.
    #[must_use]
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        assert_eq!(x.len(), self.shape[1], "one value a column");
        let mut y = vec![0.0; self.shape[0]];
        for (i, j, value) in self.entries() {
            y[i] += value * x[j];
        }
        y
    }
}

/// Rows over [x | λ | u | u' | 1], as [`Rows`](super::Rows) without their zeros.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SparseRows {
    /// Over x.
    pub x: Csr,
    /// Over λ.
    pub lambda: Csr,
    /// Over u.
    pub u: Csr,
    /// Over u'.
    pub du: Csr,
    /// Constants.
    pub one: Vec<f64>,
}

/// What a run reads of a system besides [`SparseLcs`].
#[derive(Debug, Clone, Default)]
pub(crate) struct Readings {
    /// Of each state the storage element.
    pub(crate) storage_of: Vec<usize>,
    /// Control of each switch.
    pub(crate) controls: SparseRows,
    /// See [`Outputs::power`](super::Outputs::power).
    pub(crate) power: Vec<PowerKind>,
    /// See [`Outputs::power_v`](super::Outputs::power_v).
    pub(crate) power_v: SparseRows,
    /// The other factor.
    pub(crate) power_i: SparseRows,
    /// s = X x + U u + k, all storage quantities: no λ, no u'.
    pub(crate) storage: SparseRows,
    /// Stored energy is ½ sᵀ M s.
    pub(crate) metric: Csr,
}

/// x' = A x + B λ + E u + e, y = C x + D λ + G u + F with −λ_j ∈ ∂φ_j(y_j), of one position of the switches; what its parts are
/// says [`LcsParts`](super::LcsParts).
#[derive(Debug, Clone, Default)]
pub struct SparseLcs {
    /// The netlist's title.
    pub title: String,
    /// Names and units of x.
    pub states: Vec<State>,
    /// Names, units and waveforms of u.
    pub inputs: Vec<Input>,
    /// The pairs (λ, y) and their laws.
    pub ports: Vec<Port>,
    /// n×n, 1/s.
    pub a: Csr,
    /// n×m.
    pub b: Csr,
    /// m×n.
    pub c: Csr,
    /// m×m.
    pub d: Csr,
    /// n×p.
    pub e: Csr,
    /// m×p.
    pub g: Csr,
    /// n: the constant term of x'.
    pub e0: Vec<f64>,
    /// m: the constant term of y.
    pub f: Vec<f64>,
    /// n×p: physical state = x + shift·u.
    pub shift: Csr,
    /// n×n symmetric: stored energy at u = 0 is ½ xᵀ P x.
    pub energy: Csr,
    /// x = inject · s + `inject_one` conserves charge and flux of all storage quantities s, n×q.
    pub inject: Csr,
    /// See `inject`.
    pub inject_one: Vec<f64>,
    /// Names and units of the probes.
    pub outputs: Vec<(String, &'static str)>,
    /// Their rows.
    pub output_rows: SparseRows,
    /// Switch names and the position the system was assembled for.
    pub switches: Vec<(String, bool)>,
    /// Least-norm choices.
    pub notes: Vec<String>,
    /// Entries that are not known to be within 1e-14 of the exact ones: differences of large numbers.
    pub imprecise: usize,
}

impl SparseLcs {
    /// Reduces a behaviour to the system of one position, without a dense matrix on the way.
    ///
    /// Ranks are exact as those of [`reduce`](super::reduce()). Entries that 106 bits do not settle to 1e-14 are counted, not computed again in
    /// rationals.
    ///
    /// # Errors
    /// [`ReduceError`], naming elements, where the position has no such system.
    pub fn of(behaviour: &StaticMultiport, position: &Position) -> Result<Self, ReduceError> {
        Ok(Self::with_readings(behaviour, position)?.0)
    }

    /// The same with what a run reads besides.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub(crate) fn with_readings(
        behaviour: &StaticMultiport,
        position: &Position,
    ) -> Result<(Self, Readings), ReduceError> {
        reduce::reduce_sparse(behaviour, position)
    }

    /// The (shifted) state where all capacitor voltages and inductor currents are these.
    #[must_use]
    pub fn state_from(&self, storage: &[f64]) -> Vec<f64> {
        let mut x = self.inject.times(storage);
        for (x, one) in x.iter_mut().zip(&self.inject_one) {
            *x += one;
        }
        x
    }

    /// The matrices with their letters.
    #[must_use]
    pub fn matrices(&self) -> [(&'static str, &Csr); 6] {
        [
            ("A", &self.a),
            ("B", &self.b),
            ("C", &self.c),
            ("D", &self.d),
            ("E", &self.e),
            ("G", &self.g),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lcs::reduce::reduce;
    use crate::mna::behaviour;
    use crate::mna::fixture::circuit;

    #[test]
    fn sparse_and_dense_are_one_system() {
        // A capacitor loop with a source, coupled inductors, a diode bridge and a switch.
        let netlist = "v1 a 0 10\n c1 a b 1u\n c2 b 0 2u\n r1 b c 10\n l1 c d 1m\n l2 e 0 2m\n k1 l1 l2 0.5\n r2 e 0 5\n \
                       d1 d p\n d2 n d\n d3 0 p\n d4 n 0\n cd p n 1m\n r3 p n 50\n s1 p q 1m 1k\n r4 q n 1";
        let behaviour = behaviour(&circuit(netlist)).unwrap();
        for on in [false, true] {
            let position = Position::free(&behaviour, vec![on; behaviour.switches.len()]);
            let dense = reduce(&behaviour, &position).unwrap();
            let sparse = SparseLcs::of(&behaviour, &position).unwrap();
            let whole = |m: &Csr| {
                let mut whole = nalgebra::DMatrix::zeros(m.shape[0], m.shape[1]);
                m.entries().for_each(|(i, j, v)| whole[(i, j)] = v);
                assert!(m.is_sound());
                whole
            };
            for ((_, sparse), dense) in sparse
                .matrices()
                .into_iter()
                .zip([&dense.a, &dense.b, &dense.c, &dense.d, &dense.e, &dense.g])
            {
                assert_eq!(&whole(sparse), dense);
            }
            assert_eq!(whole(&sparse.energy), dense.energy);
            assert_eq!(whole(&sparse.shift), dense.shift);
            assert_eq!(whole(&sparse.inject), dense.storage.inject);
            assert_eq!(whole(&sparse.output_rows.x), dense.outputs.rows.x);
            assert_eq!(whole(&sparse.output_rows.du), dense.outputs.rows.du);
            assert_eq!(sparse.e0, dense.e0.as_slice());
            assert_eq!(sparse.f, dense.f.as_slice());
            assert_eq!(sparse.imprecise, 0);
        }
    }
}
