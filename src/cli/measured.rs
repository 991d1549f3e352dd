//! Measurements of a run: the signals they need are simulated besides those that are shown, and taken away again.

use super::exit::Failure;
use super::input::Subject;
use super::rows;
use super::sim::Request;
use crate::circuit::{Circuit, Probe, Tran};
use crate::integrate::{Grid, RowKind, Run};
use crate::mna;
use crate::report::measured::Measurements;
use crate::waveform::Waveforms;

/// Rows that measurements see at least, besides those at events: a coarser print step is divided for them.
const ROWS: usize = 2000;

/// What a circuit's measurements need, and how its results are shown without that.
pub(super) struct Measuring<'a> {
    circuit: &'a Circuit,
    /// Rows that are computed for each row that is shown.
    divisions: usize,
    /// Columns that are shown.
    shown: usize,
}

/// Whether a circuit asks for measurements.
#[must_use]
pub(super) fn asked(circuit: &Circuit) -> bool {
    !circuit.measured.is_empty() || !circuit.measurements.is_empty()
}

/// The same circuit with the signals of its measurements after those that are shown.
///
/// # Errors
/// [`Failure::Message`] where its equations cannot be set up.
pub(super) fn with_signals(circuit: &Circuit) -> Result<Subject, Failure> {
    let mut probes = circuit.probes();
    for probe in &circuit.measured {
        if !probes.contains(probe) {
            probes.push(probe.clone());
        }
    }
    let circuit = Circuit {
        probes,
        ..circuit.clone()
    };
    let behaviour = mna::behaviour(&circuit).map_err(|faults| {
        let messages: Vec<String> = faults.into_iter().map(|fault| fault.message).collect();
        Failure::Message(messages.join("; "))
    })?;
    Ok(Subject::Circuit(Box::new((circuit, behaviour))))
}

impl<'a> Measuring<'a> {
    /// For a circuit as it was before [`with_signals`].
    #[must_use]
    pub(super) fn of(circuit: &'a Circuit, request: &Request) -> Self {
        let rows = circuit.tran.map_or(ROWS, |tran| Grid::of(&tran).len());
        Self {
            circuit,
            // A fixed step is the user's choice of accuracy, which rows between would change.
            divisions: if request.step.is_some() {
                1
            } else {
                ROWS.div_ceil(rows)
            },
            shown: circuit.probes().len(),
        }
    }

    /// The print step of the run, s.
    #[must_use]
    pub(super) fn tstep(&self) -> Option<f64> {
        self.circuit
            .tran
            .map(|tran| tran.tstep / self.divisions as f64)
    }

    /// Measures on all rows, then leaves only what is shown.
    pub(super) fn carry_out(&self, run: &mut Run) -> Measurements {
        let waves = &run.waveforms;
        let column = |probe: &Probe| {
            let index = waves.names.iter().position(|name| *name == probe.name)?;
            Some(waves.column(index).collect())
        };
        let found = Measurements {
            measured: self.circuit.measure(&waves.time, &column),
            harmonics: self.circuit.harmonics(&waves.time, &column),
        };
        (run.waveforms, run.kinds) = self.cut(waves, &run.kinds);
        found
    }

    /// The signals that are shown, at the print steps and between.
    fn cut(&self, waves: &Waveforms, kinds: &[RowKind]) -> (Waveforms, Vec<RowKind>) {
        let grid = self.circuit.tran.map(|tran| Grid::of(&tran));
        let fine = self.circuit.tran.zip(self.tstep());
        let fine = fine.map(|(tran, tstep)| Grid::of(&Tran { tstep, ..tran }).len());
        let mut kept = Waveforms {
            title: waves.title.clone(),
            names: waves.names[..self.shown].to_vec(),
            units: waves.units[..self.shown].to_vec(),
            ..Waveforms::default()
        };
        let mut kept_kinds = Vec::new();
        // The next of the fine grid.
        let mut next = 0;
        for (t, values, kind) in rows::block(waves, kinds).rows() {
            let mut time = Some(t);
            if let (RowKind::Grid, Some(grid), Some(fine)) = (kind, &grid, fine) {
                let shown = if next + 1 == fine {
                    Some(grid.len() - 1)
                } else {
                    (next % self.divisions == 0).then(|| next / self.divisions)
                };
                time = shown.map(|k| grid.time(k));
                next += 1;
            }
            if let Some(time) = time {
                kept.time.push(time);
                kept.values.extend_from_slice(&values[..self.shown]);
                kept_kinds.push(kind);
            }
        }
        (kept, kept_kinds)
    }
}
