//! Energy of the storage elements.

use nalgebra::DMatrix;

/// The energy metric M by what is not zero in it.
#[derive(Debug, Clone)]
pub(super) struct Metric(Vec<(usize, usize, f64)>);

impl Metric {
    pub(super) fn new(metric: &DMatrix<f64>) -> Self {
        let columns = (0..metric.ncols()).flat_map(|j| (0..metric.nrows()).map(move |i| (i, j)));
        let entries = columns.map(|(i, j)| (i, j, metric[(i, j)]));
        Self(entries.filter(|(.., m)| *m != 0.0).collect())
    }

    /// ½ sᵀ M s, J.
    pub(super) fn stored(&self, s: &[f64]) -> f64 {
        let terms = self.0.iter().map(|&(i, j, m)| m * s[i] * s[j]);
        0.5 * terms.sum::<f64>()
    }
}
