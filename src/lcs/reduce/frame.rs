//! The free columns of an elimination, in the order of the published system.

use crate::algebra::{Field, SparseRow};

use super::eliminated::{Columns, Eliminated};
use super::{ReduceError, Role, StorageHold};

/// The free columns in the order [x | λ | u | u' | 1 | f].
pub(super) struct Frame {
    pub(super) n: usize,
    pub(super) m: usize,
    pub(super) p: usize,
    /// n + m + 2p + 1: the width without f.
    pub(super) base: usize,
    /// Storage indices of the states.
    pub(super) states: Vec<usize>,
    /// The free pairs and their roles.
    pub(super) pairs: Vec<(usize, Role)>,
    /// Columns of the undetermined quantities.
    pub(super) f: Vec<usize>,
    /// For every free column its place.
    pub(super) place: Vec<Option<usize>>,
}

impl Frame {
    pub(super) fn new<F: Field>(e: &Eliminated<F>) -> Result<Self, ReduceError> {
        let free = |c: usize| e.found.pivot[c].is_none();
        let is_static = e.position.storage == StorageHold::Static;
        let states: Vec<usize> = (0..e.state.len())
            .filter(|&k| !is_static && free(e.state[k]))
            .collect();
        let mut pairs = Vec::with_capacity(e.free.len());
        let mut lambdas = Vec::with_capacity(e.free.len());
        for &k in &e.free {
            let (reverse, forward) = e.pairs[k];
            let fixed = e.behaviour.pairs[k].fixed_role;
            let (role, lambda) = match (free(reverse), free(forward)) {
                (false, true) => (Role::Current, forward),
                (true, false) if !fixed => (Role::Voltage, reverse),
                _ => {
                    return Err(ReduceError::Port {
                        elements: vec![e.device(k)],
                    });
                }
            };
            pairs.push((k, if fixed { Role::Function } else { role }));
            lambdas.push(lambda);
        }
        let (n, m, p) = (states.len(), pairs.len(), e.behaviour.sources.len());
        let base = n + m + 2 * p + 1;
        let mut place = vec![None; e.columns.len()];
        let mut f = Vec::new();
        for (c, kind) in e.columns.iter().enumerate().filter(|(c, _)| free(*c)) {
            place[c] = match *kind {
                Columns::Gone => None,
                Columns::Given(k) => Some(n + m + k),
                Columns::GivenRate(k) => Some(n + m + p + k),
                Columns::One => Some(base - 1),
                Columns::Pair(k) if lambdas[k] == c => Some(n + k),
                Columns::State(k) if !is_static => states.binary_search(&k).ok(),
                Columns::Unknown | Columns::State(_) | Columns::Rate | Columns::Pair(_) => {
                    f.push(c);
                    Some(base + f.len() - 1)
                }
            };
        }
        Ok(Self {
            n,
            m,
            p,
            base,
            states,
            pairs,
            f,
            place,
        })
    }

    pub(super) fn lambda(&self) -> std::ops::Range<usize> {
        self.n..self.n + self.m
    }

    pub(super) fn u(&self) -> std::ops::Range<usize> {
        self.n + self.m..self.n + self.m + self.p
    }

    pub(super) fn du(&self) -> std::ops::Range<usize> {
        self.u().end..self.u().end + self.p
    }

    pub(super) fn one(&self) -> usize {
        self.base - 1
    }

    /// A row of the table in frame order, negated if asked, without one column.
    pub(super) fn gather<F: Field>(
        &self,
        row: &[(usize, F)],
        negate: bool,
        without: Option<usize>,
    ) -> SparseRow<F> {
        let entries = row.iter().filter(|(c, _)| Some(*c) != without);
        let mut gathered: SparseRow<F> = entries
            .filter_map(|(c, x)| Some((self.place[*c]?, if negate { x.neg() } else { x.clone() })))
            .collect();
        gathered.sort_unstable_by_key(|(k, _)| *k);
        gathered
    }

    /// A column in terms of the free ones.
    pub(super) fn express<F: Field>(&self, e: &Eliminated<F>, column: usize) -> SparseRow<F> {
        if let Some(row) = e.found.pivot[column] {
            return self.gather(e.matrix.row(row), true, Some(column));
        }
        let unit = self.place[column].map(|k| (k, F::one()));
        unit.into_iter().collect()
    }
}
