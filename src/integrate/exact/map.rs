//! Linear maps with bounds of their values.

use nalgebra::DMatrix;

use crate::linalg::kernel::SparseKernel;
use crate::linalg::whole::magnitudes;

/// A map, and how large its values can be.
#[derive(Debug, Clone)]
pub(crate) struct Map {
    map: SparseKernel,
    /// |map|.
    sizes: SparseKernel,
}

impl Map {
    pub(super) fn new(matrix: &DMatrix<f64>) -> Self {
        let map = SparseKernel::new(matrix);
        Self {
            sizes: map.map(f64::abs),
            map,
        }
    }

    /// As [`Self::new`], with what the entries were summed from.
    pub(super) fn with_sizes(matrix: &DMatrix<f64>, sizes: &DMatrix<f64>) -> Self {
        Self {
            map: SparseKernel::new(matrix),
            sizes: SparseKernel::new(sizes),
        }
    }

    /// `values` = map · w.
    pub(crate) fn values(&self, w: &[f64], values: &mut Vec<f64>) {
        values.resize(self.map.rows(), 0.0);
        self.map.apply_first(w, values);
    }

    /// The first of these values.
    pub(super) fn first_values(&self, count: usize, w: &[f64], values: &mut Vec<f64>) {
        values.resize(count, 0.0);
        self.map.apply_first(w, values);
    }

    /// `largest` = |map| · sizes.
    pub(crate) fn largest(&self, sizes: &[f64], largest: &mut Vec<f64>) {
        largest.resize(self.map.rows(), 0.0);
        self.sizes.apply_first(sizes, largest);
    }
}

/// What the entries of a mode's matrices were summed from, where that is more than the entries themselves.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sizes {
    /// Of the guards' rows.
    pub(crate) guards: DMatrix<f64>,
    /// Of 𝒜.
    pub(crate) summed: DMatrix<f64>,
}

impl Sizes {
    /// Guards and below them their derivatives along w' = 𝒜 w, so many orders, and the sums of magnitudes that their entries come from.
    pub(crate) fn jets(
        &self,
        guards: &DMatrix<f64>,
        generator: &DMatrix<f64>,
        orders: usize,
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let (m, dim) = guards.shape();
        let (mut jets, mut whole) = (
            DMatrix::zeros(orders * m, dim),
            DMatrix::zeros(orders * m, dim),
        );
        let (mut rows, mut sizes) = (guards.clone(), self.guards.clone());
        for k in 0..orders {
            jets.rows_mut(k * m, m).copy_from(&rows);
            whole.rows_mut(k * m, m).copy_from(&sizes);
            if k + 1 == orders {
                break;
            }
            let next = &rows * generator;
            sizes = magnitudes(&next).sup(&(magnitudes(&rows) * &self.summed));
            rows = next;
        }
        (jets, whole)
    }
}
