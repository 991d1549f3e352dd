//! Measurements of a run: the signals they need are simulated besides those that are shown, and taken away again.

use super::exit::Failure;
use super::input::Subject;
use super::sim::Request;
use crate::circuit::{Circuit, Probe, Tran};
use crate::integrate::{Grid, Run};
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
    /// Rows at events are shown.
    events: bool,
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
            events: request.events,
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
        run.waveforms = self.cut(waves);
        found
    }

    fn cut(&self, waves: &Waveforms) -> Waveforms {
        let grids = self.circuit.tran.zip(self.tstep()).map(|(tran, tstep)| {
            let fine = Tran { tstep, ..tran };
            (Grid::of(&tran), Grid::of(&fine))
        });
        let mut kept = Waveforms {
            title: waves.title.clone(),
            names: waves.names[..self.shown].to_vec(),
            units: waves.units[..self.shown].to_vec(),
            ..Waveforms::default()
        };
        let mut keep = |t: f64, k: usize| {
            kept.time.push(t);
            kept.values.extend_from_slice(&waves.row(k)[..self.shown]);
        };
        let mut next = 0;
        for (k, &t) in waves.time.iter().enumerate() {
            let Some((shown, fine)) = &grids else {
                keep(t, k);
                continue;
            };
            // Of the rows at one output time the last is the one of the grid.
            let on_grid =
                fine.time(next) == t && waves.time.get(k + 1).is_none_or(|&after| after > t);
            let last = next + 1 == fine.len();
            if on_grid && (last || next % self.divisions == 0) {
                let index = if last {
                    shown.len() - 1
                } else {
                    next / self.divisions
                };
                keep(shown.time(index), k);
            } else if self.events && !on_grid {
                keep(t, k);
            }
            next += usize::from(on_grid);
        }
        kept
    }
}
