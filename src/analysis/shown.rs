//! Rows of signals to rows of what is shown: expressions are computed.

use crate::circuit::Circuit;
use crate::integrate::{Block, Run};

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

/// The run with what its circuit shows in place of the signals that this needs.
#[must_use]
pub fn shown(circuit: &Circuit, mut run: Run) -> Run {
    if let Some(values) = shown_values(circuit, Block::of(&run.waveforms, &run.kinds)) {
        run.waveforms.values = values;
        run.waveforms.names = circuit.columns.iter().map(|c| c.name.clone()).collect();
        run.waveforms.units = circuit.columns.iter().map(|c| c.unit).collect();
    }
    run
}
