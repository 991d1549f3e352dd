//! Measurements of a run: the signals they need are simulated besides those that are shown, and taken away again.

use super::exit::Failure;
use super::input::Subject;
use crate::circuit::{Circuit, Probe};
use crate::integrate::{Grid, Run};
use crate::mna;
use crate::report::measured::Measurements;
use crate::waveform::Waveforms;

/// What a circuit's measurements need, and how its results are shown without that.
pub(super) struct Measuring<'a> {
    circuit: &'a Circuit,
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
    /// For a circuit as it was before [`with_signals`]; `events` are to be shown.
    #[must_use]
    pub(super) fn of(circuit: &'a Circuit, events: bool) -> Self {
        Self {
            circuit,
            shown: circuit.probes().len(),
            events,
        }
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
        let grid = self.circuit.tran.map(|tran| Grid {
            tstart: tran.tstart,
            tstep: tran.tstep,
            tstop: tran.tstop,
        });
        let mut kept = Waveforms {
            title: waves.title.clone(),
            names: waves.names[..self.shown].to_vec(),
            units: waves.units[..self.shown].to_vec(),
            ..Waveforms::default()
        };
        let mut next = 0;
        for (k, &t) in waves.time.iter().enumerate() {
            // Of the rows at one output time the last is the one of the grid.
            let on_grid = grid.is_none_or(|grid| grid.time(next) == t)
                && waves.time.get(k + 1).is_none_or(|&after| after > t);
            if self.events || on_grid {
                kept.time.push(t);
                kept.values.extend_from_slice(&waves.row(k)[..self.shown]);
            }
            next += usize::from(on_grid);
        }
        kept
    }
}
