//! `.step`: a run for every combination of values, in parallel, with results in the order of the values.

use std::io::Write;

use rayon::prelude::*;

use super::args::{SimArgs, Summary};
use super::exit::{Exit, Failure};
use super::input;
use super::output::{self, Format};
use super::sim::{self, Request};
use super::stepped::Stepped;
use super::streams::Streams;
use crate::circuit::Circuit;
use crate::integrate::SimError;
use crate::report::figure::Figure;
use crate::report::steps::{self, Step};
use crate::report::{terminal, text};
use crate::waveform::csv;

/// What the runs have in common.
pub(super) struct Stepping<'a> {
    /// The command line.
    pub args: &'a SimArgs,
    /// The circuits.
    pub stepped: Stepped<'a>,
    /// How to integrate.
    pub request: Request,
}

/// A run as far as it came, and why and in which circuit not further.
type Outcome = (Option<Step>, Option<(SimError, Circuit)>);

impl Stepping<'_> {
    /// Runs, writes and tells.
    pub(super) fn sim(&self, formats: &[Format], streams: &Streams) -> Result<Exit, Failure> {
        let combinations = self.stepped.combinations();
        let bar = streams.progress(combinations.len() as u64, "stepping");
        let quiet = Streams {
            quiet: true,
            verbose: false,
        };
        let outcomes: Vec<Result<Outcome, Failure>> = combinations
            .par_iter()
            .map(|values| {
                let outcome = self.one(values, &quiet);
                bar.inc(1);
                outcome
            })
            .collect();
        bar.finish_and_clear();
        let (mut done, mut failures) = (Vec::new(), Vec::new());
        for (values, outcome) in combinations.iter().zip(outcomes) {
            let (step, error) = outcome?;
            done.extend(step);
            if let Some((error, circuit)) = error {
                let place = Some((&circuit, &self.stepped.sources));
                let failure = input::broke_off(&self.args.input, &error, place, streams);
                failures.push(format!("{failure} at {}", self.stepped.label(values)));
            }
        }
        if !done.is_empty() {
            self.write(&done, formats, !failures.is_empty(), streams)?;
        }
        if failures.is_empty() {
            Ok(Exit::Done)
        } else {
            Err(Failure::Message(failures.join("\nerror: ")))
        }
    }

    /// The run with these values.
    fn one(&self, values: &[f64], streams: &Streams) -> Result<Outcome, Failure> {
        let subject = self.stepped.subject(values, streams)?;
        let (finished, error) = sim::measured_run(&subject, &self.request, streams)?;
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
        formats: &[Format],
        broke_off: bool,
        streams: &Streams,
    ) -> Result<(), Failure> {
        let total = steps::total(done);
        let figure = || {
            let runs: Vec<_> = done.iter().map(|s| (s.label(), &s.run.waveforms)).collect();
            Figure::of_runs(&runs)
        };
        for (path, format) in self.args.outputs.iter().zip(formats) {
            match output::write(&total, &figure, *format, path) {
                // A picture of runs that broke off before their first row.
                Err(Failure::Picture(_)) if broke_off => {}
                written => written?,
            }
        }
        let wordy = streams.verbose || streams.err_is_terminal();
        match self.args.summary {
            Some(Summary::Json) => streams.error(steps::summary(done)),
            Some(Summary::Text) => streams.error(text::summary(&total, streams.verbose)),
            None if wordy => streams.say(text::summary(&total, streams.verbose)),
            None => {
                for note in &total.notes {
                    streams.say(format!("note: {note}"));
                }
            }
        }
        if !matches!(self.args.summary, Some(Summary::Json)) {
            streams.say(steps::measured(done));
        }
        if !self.args.outputs.is_empty() {
            return Ok(());
        }
        if streams.out_is_terminal() {
            let (lines, columns) = streams.size();
            for step in done {
                streams.data(step.label() + "\n")?;
                let room = (lines / done.len()).max(1);
                streams.data(terminal::plot(&step.run.waveforms, columns, room))?;
            }
            return Ok(());
        }
        let mut out = streams.out();
        csv::write(&mut out, &total.waveforms)?;
        Ok(out.flush()?)
    }
}
