//! A transient with its measurements: the signals they need are simulated besides those that are shown, and taken away again.

use crate::circuit::{Circuit, Harmonics, Measured, Probe, Tran};
use crate::integrate::{Block, Error, Grid, RowKind, Run, SimOptions};
use crate::model::Model;
use crate::waveform::Waveforms;

/// Rows that measurements see at least, besides those at events: a coarser print step is divided for them.
const ROWS: usize = 2000;

/// The outcome of the measurements of one run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Measurements {
    /// Of `.meas`, in file order.
    pub measured: Vec<Measured>,
    /// Of `.four`, in file order.
    pub harmonics: Vec<Harmonics>,
}

impl Measurements {
    /// Whether nothing was asked for.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.measured.is_empty() && self.harmonics.is_empty()
    }
}

/// A run, or as much of it as there is.
#[derive(Debug)]
pub struct Finished {
    /// The rows, and what was measured on them.
    pub run: Option<(Run, Measurements)>,
    /// Why it ended early.
    pub error: Option<Error>,
}

impl Finished {
    /// A run without measurements.
    #[must_use]
    pub fn of(result: Result<Run, Error>) -> Self {
        let (run, error) = match result {
            Ok(run) => (Some(run), None),
            Err(mut error) => (error.partial.take().map(|run| *run), Some(error)),
        };
        Self {
            run: run.map(|run| (run, Measurements::default())),
            error,
        }
    }
}

/// Whether a circuit asks for measurements; then [`transient`] holds its rows until the end.
#[must_use]
pub fn is_measured(circuit: &Circuit) -> bool {
    !circuit.measured.is_empty() || !circuit.measurements.is_empty()
}

/// The transient that `.tran` asks for, with what `.meas` and `.four` ask of it.
///
/// Measurements see the rows at events and at corners of sources too, and at least 2000 of the grid unless the step is fixed. Where
/// there are any, [`SimOptions::rows`] and [`SimOptions::discard`] are not heeded: the rows are those of the run.
///
/// # Returns
/// A run that broke off as far as it came, measured.
#[must_use]
pub fn transient(model: &Model, options: SimOptions<'_>) -> Finished {
    let circuit = model.circuit();
    if !is_measured(circuit) {
        return Finished::of(model.transient(options));
    }
    let measuring = Measuring::of(circuit, options.step.is_some());
    let measured = match measuring.model(model) {
        Ok(measured) => measured,
        Err(error) => return Finished::of(Err(error)),
    };
    let mut finished = Finished::of(measured.transient(SimOptions {
        corners: true,
        rows: None,
        discard: false,
        ..options
    }));
    if let Some((run, found)) = &mut finished.run {
        *found = measuring.carry_out(run);
    }
    finished
}

/// What a circuit's measurements need, and how its results are shown without that.
struct Measuring<'a> {
    circuit: &'a Circuit,
    /// Rows that are computed for each row that is shown.
    divisions: usize,
    /// Columns that are shown.
    shown: usize,
}

impl<'a> Measuring<'a> {
    fn of(circuit: &'a Circuit, fixed_step: bool) -> Self {
        let rows = circuit.tran.map_or(ROWS, |tran| Grid::of(&tran).len());
        Self {
            circuit,
            // A fixed step is the user's choice of accuracy, which rows between would change.
            divisions: if fixed_step { 1 } else { ROWS.div_ceil(rows) },
            shown: circuit.probes().len(),
        }
    }

    /// The same circuit with a finer grid, and the signals of its measurements after those that are shown.
    fn model(&self, model: &Model) -> Result<Model, Error> {
        let mut probes = self.circuit.probes();
        for probe in &self.circuit.measured {
            if !probes.contains(probe) {
                probes.push(probe.clone());
            }
        }
        model.with_circuit(Circuit {
            probes,
            tran: self.fine(),
            ..self.circuit.clone()
        })
    }

    /// The transient with the print step of the run.
    fn fine(&self) -> Option<Tran> {
        self.circuit.tran.map(|tran| Tran {
            tstep: tran.tstep / self.divisions as f64,
            ..tran
        })
    }

    /// Measures on all rows, then leaves only what is shown.
    fn carry_out(&self, run: &mut Run) -> Measurements {
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
        let fine = self.fine().map(|tran| Grid::of(&tran).len());
        let mut kept = Waveforms {
            title: waves.title.clone(),
            names: waves.names[..self.shown].to_vec(),
            units: waves.units[..self.shown].to_vec(),
            ..Waveforms::default()
        };
        let mut kept_kinds = Vec::new();
        // The next of the fine grid.
        let mut next = 0;
        for (t, values, kind) in Block::of(waves, kinds).rows() {
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
