//! Rows of signals to rows of what is shown: expressions are computed.

use crate::circuit::Circuit;
use crate::integrate::{Block, Note, Run};

/// Where expressions have no value: 1/x at x = 0, the logarithm of what is not positive.
#[derive(Debug, Clone, Default)]
pub struct Undefined {
    /// By column: how many rows, and the time of the first, s.
    rows: Vec<(usize, f64)>,
}

impl Undefined {
    /// Looks at rows of what is shown, row after row.
    pub fn see(&mut self, time: &[f64], values: &[f64]) {
        let columns = values.len() / time.len().max(1);
        self.rows.resize(columns, (0, 0.0));
        for (t, row) in time.iter().zip(values.chunks_exact(columns.max(1))) {
            for ((count, first), value) in self.rows.iter_mut().zip(row) {
                if !value.is_finite() {
                    if *count == 0 {
                        *first = *t;
                    }
                    *count += 1;
                }
            }
        }
    }

    /// Names of what has no value in some row, and where.
    #[must_use]
    pub fn note(&self, circuit: &Circuit) -> Option<Note> {
        let columns = circuit.columns.iter().zip(&self.rows);
        let some = columns.filter(|(_, (count, _))| *count > 0);
        let words = some.map(|(column, (count, first))| {
            let rows = if *count == 1 { "row" } else { "rows" };
            format!("{} ({count} {rows}, first at t = {first:e} s)", column.name)
        });
        let words: Vec<String> = words.collect();
        (!words.is_empty()).then(|| {
            let text = format!(
                "no number everywhere, by a division by 0 or the like: {}",
                words.join(", ")
            );
            Note::run("no-number", text)
        })
    }
}

/// The values of these rows that a circuit shows, row after row; `None` where these are the values themselves.
#[must_use]
pub fn shown_values(circuit: &Circuit, block: Block<'_>) -> Option<Vec<f64>> {
    if circuit.columns.is_empty() {
        return None;
    }
    let mut values = Vec::with_capacity(block.time.len() * circuit.columns.len());
    for (t, probes, _) in block.rows() {
        circuit.shown_row(t, probes, &mut values);
    }
    Some(values)
}

/// The run with what its circuit shows in place of the signals that this needs; a note tells what has no value.
#[must_use]
pub fn shown(circuit: &Circuit, mut run: Run) -> Run {
    if let Some(values) = shown_values(circuit, Block::of(&run.waveforms, &run.kinds)) {
        let mut undefined = Undefined::default();
        undefined.see(&run.waveforms.time, &values);
        run.notes.extend(undefined.note(circuit));
        run.waveforms.values = values;
        run.waveforms.names = circuit.columns.iter().map(|c| c.name.clone()).collect();
        run.waveforms.units = circuit.columns.iter().map(|c| c.unit).collect();
    }
    run
}
