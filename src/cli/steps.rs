//! `.step`: a run for every combination of values, in parallel, with results in the order of the values.

use super::args::{SimArgs, Summary};
use super::destination::Destination;
use super::exit::{Exit, Failure};
use super::input;
use super::output::{Format, Outputs, Told};
use super::request::{Request, Route};
use super::rows::Columns;
use super::signals::Signals;
use super::sim;
use super::streams::Streams;
use super::tabulate;
use crate::analysis::{self, Finished, Variant, each, shown};
use crate::integrate::{Block, Error, Grid, Reason};
use crate::model::Model;
use crate::report::figure::Figure;
use crate::report::steps::{self, Step};
use crate::report::{log, terminal, text};
use crate::settings::Settings;

/// What the runs have in common.
pub(super) struct Stepping<'a> {
    /// The command line.
    pub args: &'a SimArgs,
    /// With the values as they stand.
    pub model: &'a Model,
    /// How to integrate.
    pub request: Request,
    /// What ends the runs.
    pub signals: &'a Signals,
}

/// A run as far as it came, and why and with which model not further.
type Outcome = (Option<Step>, Option<(Error, Model)>);

impl Stepping<'_> {
    /// Runs, writes and tells.
    pub(super) fn sim(&self, formats: &[Format], streams: &Streams) -> Result<Exit, Failure> {
        let circuit = self.model.circuit();
        let variants = analysis::steps(self.model);
        let columns = self.columns();
        let held = Settings::default().max_held / variants.len().max(1);
        if let Some(tran) = circuit.tran {
            let most = held / ((columns.names.len() + 1) * size_of::<f64>());
            let refused = |error: Error| {
                let (file, runs) = (self.args.input.file.display(), variants.len());
                Failure::of_run(&format!("{file}: each of {runs} runs of `.step`: "), &error)
            };
            Grid::of(&tran)
                .check(columns.names.len(), Some(most))
                .map_err(refused)?;
        }
        let model = Some(self.model);
        let destination =
            Destination::of(self.args.wanted(), formats, circuit.tran, model, streams);
        let outputs = destination.open(&columns)?;
        let bar = streams.progress(variants.len() as u64, "stepping");
        let outcomes: Vec<Result<Outcome, Failure>> = each(&variants, |variant| {
            let outcome = self.one(variant, &destination, (held, streams));
            bar.inc(1);
            outcome
        });
        bar.finish_and_clear();
        let (mut done, mut failures, mut interrupted) = (Vec::new(), Vec::new(), false);
        for (variant, outcome) in variants.iter().zip(outcomes) {
            let (step, error) = outcome?;
            done.extend(step);
            let Some((error, model)) = error else {
                continue;
            };
            if error.reason == Reason::Interrupted {
                interrupted = true;
                continue;
            }
            let failure = input::broke_off(&self.args.input, &error, model.places(), streams);
            failures.push(format!("{failure} at {}", steps::label(&variant.named())));
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
            let (file, runs) = (self.args.input.file.display(), variants.len());
            streams.error(format!(
                "{file}: interrupted by {name}: {} of {runs} runs were begun",
                done.len()
            ));
            return Ok(Exit::Signal(signal));
        }
        if failures.is_empty() {
            Ok(Exit::Done)
        } else {
            Err(Failure::told("failed-runs", failures.join("\nerror: ")))
        }
    }

    /// Those of the signals, then what is stepped.
    fn columns(&self) -> Columns {
        let circuit = self.model.circuit();
        let mut columns = Columns::of_circuit(circuit);
        for sweep in &circuit.steps {
            columns.names.push(sweep.what.name().to_string());
            columns.units.push("");
        }
        columns
    }

    /// The run with these values, of so many bytes at most.
    fn one(
        &self,
        variant: &Variant<'_>,
        destination: &Destination<'_>,
        (held, streams): (usize, &Streams),
    ) -> Result<Outcome, Failure> {
        if self.signals.received().is_some() {
            let error = Error::before(Reason::Interrupted);
            return Ok((None, Some((error, self.model.clone()))));
        }
        let quiet = Streams {
            quiet: true,
            verbose: false,
            ..*streams
        };
        let model = input::variant(&self.args.input, variant, &quiet)?;
        let route = Route {
            corners: destination.has_pictures(),
            pictures: destination.has_pictures(),
            numbers: destination.has_numbers(),
            cancel: Some(self.signals.flag()),
            held: Some(held),
            from_orbit: self.args.from_pss,
            ..Route::default()
        };
        let Finished { mut run, mut error } = sim::transient(&model, &self.request, route, &quiet);
        if let (true, Some((_, found)), None) = (self.args.table.table, &mut run, &error) {
            match tabulate::table(self.args, &model, &self.request, self.signals.flag()) {
                Ok(table) => found.table = Some(table),
                Err(failed) => error = Some(failed),
            }
        }
        let step = run.map(|(run, found)| Step {
            values: variant.named(),
            run: shown(model.circuit(), run),
            found,
        });
        Ok((step, error.map(|error| (error, model))))
    }

    fn write(
        &self,
        done: &[Step],
        mut outputs: Outputs,
        incomplete: Option<&str>,
        destination: &Destination<'_>,
    ) -> Result<(), Failure> {
        let (streams, places) = (destination.streams, destination.places());
        let total = steps::total(done);
        let figure = |pixels| {
            let runs: Vec<_> = done.iter().map(|s| (s.label(), &s.run.waveforms)).collect();
            Figure::of_runs(&runs, pixels)
        };
        // A failure is told by `finish`.
        let _ = outputs.take(Block::of(&total.waveforms, &total.kinds));
        let measured = steps::measured(done);
        let told = Told {
            run: &total,
            measured: &measured,
            conduction: &[],
            steps: done,
            model: destination.model,
        };
        let written = outputs.finish(told, &figure, incomplete);
        let wordy = streams.verbose || streams.err_is_terminal();
        match self.args.results.summary {
            Some(Summary::Json) => streams.error(steps::summary(done, places)),
            Some(Summary::Text) => streams.error(text::summary(&total, places, streams.verbose)),
            None if wordy => streams.say(text::summary(&total, places, streams.verbose)),
            None => {
                streams.notes(places, &total.notes);
            }
        }
        if !matches!(self.args.results.summary, Some(Summary::Json)) {
            streams.notes(places, &steps::table_notes(done));
            match streams.log {
                Some(_) => streams.say(log::steps(done)),
                // Results, which `-q` does not hide.
                None if !measured.is_empty() => streams.error(measured),
                None => {}
            }
        }
        if destination.plots {
            let (lines, columns) = streams.size();
            for step in done {
                streams.data(step.label() + "\n")?;
                let room = (lines / done.len()).max(1);
                let plot =
                    terminal::plot(&step.run.waveforms, columns, room, streams.out_colours());
                streams.data(plot)?;
            }
        }
        written
    }
}
