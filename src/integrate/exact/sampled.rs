//! Output rows that follow a state of a calm mode, an output step apart.

use super::flow::{Flow, LONG};
use crate::linalg::dense::Dense;
use crate::linalg::kernel::Kernel;

/// Rows of a long step at most.
pub(super) const MOST: usize = 1 << LONG;
/// A mode's rows are tabulated after so many single ones for each dimension of w: before, that is more work than it spares.
const PATIENCE: usize = 6;
/// Entries of a table at most; rows of larger circuits cost so much that long steps spare little.
const LARGEST: usize = 1 << 16;

/// The output rows that follow one state of a mode.
#[derive(Debug, Clone)]
pub(crate) struct SampledRows {
    pub(super) columns: usize,
    /// Whether tables are worth their entries.
    pub(super) fits: bool,
    /// Single rows so far, and after how many there is a table.
    singles: usize,
    patience: usize,
    /// C exp(𝒜kh) for k = 1…MOST, one below the other, once tabulated.
    pub(super) table: Option<Kernel>,
}

impl SampledRows {
    /// For `columns` outputs over w of length `dim`.
    pub(crate) fn new(columns: usize, dim: usize) -> Self {
        let fits = MOST * columns * dim <= LARGEST;
        Self {
            columns,
            fits,
            singles: 0,
            patience: PATIENCE * dim,
            table: None,
        }
    }

    /// Whether there is a table, made once it is worth it.
    pub(super) fn ready(&mut self, flow: &mut Flow, outputs: &Kernel) -> bool {
        if self.table.is_none() && self.fits {
            self.singles += 1;
            if self.singles >= self.patience {
                self.table = flow
                    .increment()
                    .map(|step| followed(outputs, self.columns, &step));
            }
        }
        self.table.is_some()
    }
}

/// The rows of so many columns after exp(𝒜h) − I = `step` and every further one, [`MOST`] one below the other.
fn followed(outputs: &Kernel, columns: usize, step: &Dense) -> Kernel {
    let dim = step.columns();
    let (mut increment, mut product) = (step.clone(), Dense::zeros(dim, dim));
    let mut table = Dense::zeros(MOST * columns, dim);
    let (mut column, mut output) = (vec![0.0; dim], vec![0.0; columns]);
    for k in 0..MOST {
        for j in 0..dim {
            column.copy_from_slice(increment.column(j));
            column[j] += 1.0;
            outputs.apply(&column, &mut output);
            table.column_mut(j)[k * columns..(k + 1) * columns].copy_from_slice(&output);
        }
        // (I + E)(I + F) = I + E + F + E F
        product.set_product(&increment, step);
        increment.add(step);
        increment.add(&product);
    }
    Kernel::of(&table)
}
