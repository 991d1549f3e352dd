//! `.step`: a run for every combination of values, in parallel, with results in the order of the values.

use rayon::prelude::*;

use super::args::{SimArgs, Summary};
use super::exit::{Exit, Failure};
use super::input;
use super::output::{Format, Outputs};
use super::rows::{self, Columns};
use super::signals::Signals;
use super::sim::{self, Destination, Request, Route};
use super::stepped::Stepped;
use super::streams::Streams;
use crate::circuit::Circuit;
use crate::integrate::{Grid, Places, Reason, SimError};
use crate::report::figure::Figure;
use crate::report::steps::{self, Step};
use crate::report::{terminal, text};
use crate::settings::Settings;

/// What the runs have in common.
pub(super) struct Stepping<'a> {
    /// The command line.
    pub args: &'a SimArgs,
    /// With the values as they stand.
    pub circuit: &'a Circuit,
    /// The circuits.
    pub stepped: Stepped<'a>,
    /// How to integrate.
    pub request: Request,
    /// What ends the runs.
    pub signals: &'a Signals,
}

/// A run as far as it came, and why and in which circuit not further.
type Outcome = (Option<Step>, Option<(SimError, Circuit)>);

impl Stepping<'_> {
    /// Runs, writes and tells.
    pub(super) fn sim(&self, formats: &[Format], streams: &Streams) -> Result<Exit, Failure> {
        let combinations = self.stepped.combinations();
        let columns = self.columns();
        let held = Settings::default().max_held / combinations.len().max(1);
        if let Some(tran) = self.circuit.tran {
            let most = held / ((columns.names.len() + 1) * size_of::<f64>());
            let refused = |error: SimError| {
                let (file, runs) = (self.args.input.file.display(), combinations.len());
                Failure::Message(format!("{file}: each of {runs} runs of `.step`: {error}"))
            };
            Grid::of(&tran)
                .check(columns.names.len(), Some(most))
                .map_err(refused)?;
        }
        let places = Places(Some((self.circuit, &self.stepped.sources)));
        let destination = Destination::of(self.args, formats, self.circuit.tran, places, streams);
        let outputs = destination.open(&columns)?;
        let bar = streams.progress(combinations.len() as u64, "stepping");
        let outcomes: Vec<Result<Outcome, Failure>> = combinations
            .par_iter()
            .map(|values| {
                let outcome = self.one(values, &destination, held);
                bar.inc(1);
                outcome
            })
            .collect();
        bar.finish_and_clear();
        let (mut done, mut failures, mut interrupted) = (Vec::new(), Vec::new(), false);
        for (values, outcome) in combinations.iter().zip(outcomes) {
            let (step, error) = outcome?;
            done.extend(step);
            let Some((error, circuit)) = error else {
                continue;
            };
            if error.reason == Reason::Interrupted {
                interrupted = true;
                continue;
            }
            let places = Places(Some((&circuit, &self.stepped.sources)));
            let failure = input::broke_off(&self.args.input, &error, places, streams);
            failures.push(format!("{failure} at {}", self.stepped.label(values)));
        }
        if !done.is_empty() {
            let incomplete = if interrupted {
                Some("incomplete: interrupted")
            } else {
                (!failures.is_empty()).then_some("incomplete: runs broke off")
            };
            self.write(&done, outputs, incomplete, &destination)?;
        }
        if let (true, Some((signal, name))) = (interrupted, self.signals.received()) {
            let (file, runs) = (self.args.input.file.display(), combinations.len());
            streams.error(format!(
                "{file}: interrupted by {name}: {} of {runs} runs were begun",
                done.len()
            ));
            return Ok(Exit::Signal(signal));
        }
        if failures.is_empty() {
            Ok(Exit::Done)
        } else {
            Err(Failure::Message(failures.join("\nerror: ")))
        }
    }

    /// Those of the signals, then what is stepped.
    fn columns(&self) -> Columns {
        let mut columns = Columns::of_circuit(self.circuit);
        for sweep in self.stepped.sweeps {
            columns.names.push(sweep.what.name().to_string());
            columns.units.push("");
        }
        columns
    }

    /// The run with these values, of so many bytes at most.
    fn one(
        &self,
        values: &[f64],
        destination: &Destination<'_>,
        held: usize,
    ) -> Result<Outcome, Failure> {
        if self.signals.received().is_some() {
            let error = SimError::before(Reason::Interrupted);
            return Ok((None, Some((error, self.circuit.clone()))));
        }
        let quiet = Streams {
            quiet: true,
            verbose: false,
        };
        let subject = self.stepped.subject(values, &quiet)?;
        let route = Route {
            corners: destination.has_pictures(),
            cancel: Some(self.signals.flag()),
            held: Some(held),
            ..Route::default()
        };
        let (finished, error) = sim::measured_run(&subject, &self.request, route, &quiet)?;
        let step = finished.map(|(run, found)| Step {
            values: self.stepped.named(values),
            run,
            found,
        });
        let circuit = || input::circuit_of(&self.args.input, &subject).ok().cloned();
        Ok((step, error.and_then(|error| Some((error, circuit()?)))))
    }

    fn write(
        &self,
        done: &[Step],
        mut outputs: Outputs,
        incomplete: Option<&str>,
        destination: &Destination<'_>,
    ) -> Result<(), Failure> {
        let streams = destination.streams;
        let total = steps::total(done);
        let figure = || {
            let runs: Vec<_> = done.iter().map(|s| (s.label(), &s.run.waveforms)).collect();
            Figure::of_runs(&runs)
        };
        // A failure is told by `finish`.
        let _ = outputs.take(rows::block(&total.waveforms, &total.kinds));
        let written = outputs.finish((&total, destination.places), &figure, incomplete);
        let wordy = streams.verbose || streams.err_is_terminal();
        match self.args.summary {
            Some(Summary::Json) => streams.error(steps::summary(done, destination.places)),
            Some(Summary::Text) => {
                streams.error(text::summary(&total, destination.places, streams.verbose))
            }
            None if wordy => {
                streams.say(text::summary(&total, destination.places, streams.verbose))
            }
            None => {
                for note in destination.places.all(&total.notes) {
                    streams.say(format!("note: {note}"));
                }
            }
        }
        if !matches!(self.args.summary, Some(Summary::Json)) {
            streams.say(steps::measured(done));
        }
        if destination.plots {
            let (lines, columns) = streams.size();
            for step in done {
                streams.data(step.label() + "\n")?;
                let room = (lines / done.len()).max(1);
                streams.data(terminal::plot(&step.run.waveforms, columns, room))?;
            }
        }
        written
    }
}
