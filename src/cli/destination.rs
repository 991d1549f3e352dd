//! Where the results of a command go, and what it says of them.

use super::args::{Input, MessageFormat, ResultArgs, Summary};
use super::exit::{Exit, Failure};
use super::input;
use super::output::{Format, Outputs, Told};
use super::rows::{Columns, Shown};
use super::streams::Streams;
use crate::analysis::{Finished, Measurements};
use crate::circuit::Tran;
use crate::integrate::{Block, Error, Method, Places, Reason, Run, Verified};
use crate::model::Model;
use crate::report::figure::Figure;
use crate::report::{json, log, terminal, text};

/// What a command line asks of its results.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted<'a> {
    pub(super) input: &'a Input,
    pub(super) results: &'a ResultArgs,
    /// The step was named.
    pub(super) fixed_step: bool,
    /// A second run.
    pub(super) verify: bool,
}

/// Where the results of a command go, and what it says.
pub(super) struct Destination<'a> {
    wanted: Wanted<'a>,
    formats: &'a [Format],
    tran: Option<Tran>,
    /// Of what is simulated; a system has none.
    pub(super) model: Option<&'a Model>,
    /// A plot on a terminal.
    pub(super) plots: bool,
    pub(super) streams: &'a Streams,
}

impl<'a> Destination<'a> {
    /// As the command line asks for it.
    pub(super) fn of(
        wanted: Wanted<'a>,
        formats: &'a [Format],
        tran: Option<Tran>,
        model: Option<&'a Model>,
        streams: &'a Streams,
    ) -> Self {
        Self {
            wanted,
            formats,
            tran,
            model,
            plots: wanted.results.outputs.is_empty() && streams.out_is_terminal(),
            streams,
        }
    }

    /// Where elements stand.
    pub(super) fn places(&self) -> Places<'a> {
        self.model.map_or_else(Places::default, Model::places)
    }

    /// Whether anything is looked at.
    pub(super) fn has_pictures(&self) -> bool {
        self.plots || self.formats.iter().any(|format| format.is_picture())
    }

    /// Whether rows are read as numbers.
    pub(super) fn has_numbers(&self) -> bool {
        let to_pipe = self.wanted.results.outputs.is_empty() && !self.plots;
        to_pipe || self.formats.iter().any(|format| !format.is_picture())
    }

    /// Opens files.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(super) fn open(&self, columns: &Columns) -> Result<Outputs, Failure> {
        let between = self.tran.is_some_and(|tran| !tran.prints);
        let shown = Shown {
            events: self.wanted.results.events || between,
            corners: between,
        };
        let to_pipe = !self.plots;
        Outputs::open(
            &self.wanted.results.outputs,
            self.formats,
            to_pipe,
            shown,
            columns,
        )
    }

    /// Writes what a run gave, or as much of it as there is, and says why it ended early. `feeds`: the rows have not been written yet.
    ///
    /// # Errors
    /// See [`Failure`].
    pub(super) fn finish(
        &self,
        mut outputs: Outputs,
        Finished { run, error }: Finished,
        feeds: bool,
        signal: Option<(i32, &str)>,
    ) -> Result<Exit, Failure> {
        let Some((run, found)) = run else {
            return error.map_or(Ok(Exit::Done), |error| self.ended(&error, signal, ""));
        };
        if self.wanted.fixed_step && run.method == Method::Exact.name() {
            self.streams.note(
                "unused-option",
                "--step is of no use to exact integration, which has no steps",
            );
        }
        if feeds {
            // A failure is told by `finish`.
            let _ = outputs.take(Block::of(&run.waveforms, &run.kinds));
        }
        let last = outputs.last().or(run.waveforms.time.last().copied());
        let until = last.map_or("before its first row".into(), |t| format!("at {t:e} s"));
        let incomplete = error.as_ref().map(|_| format!("incomplete: ends {until}"));
        let files = outputs.words();
        let figure = |pixels| Figure::of_waveforms(&run.waveforms, pixels);
        let measured = found.words();
        let told = Told {
            run: &run,
            measured: &measured,
            conduction: &found.conduction,
            steps: &[],
            model: self.model,
        };
        let written = outputs.finish(told, &figure, incomplete.as_deref());
        self.summarise(&run, &found);
        if self.plots {
            let (lines, columns) = self.streams.size();
            let plot = terminal::plot(&run.waveforms, columns, lines, self.streams.out_colours());
            self.streams.data(plot)?;
        }
        if let Err(failure) = written {
            if let (false, Some(t)) = (failure.is_closed_pipe() || files.is_empty(), last) {
                self.streams
                    .note("incomplete", format!("rows were written until {t:e} s"));
            }
            return Err(failure);
        }
        let Some(error) = error else {
            return self.verdict(&run, signal);
        };
        let kept = match (files.is_empty(), last) {
            (false, Some(t)) => format!("; the rows until {t:e} s are in {files}"),
            _ => String::new(),
        };
        self.ended(&error, signal, &kept)
    }

    /// Says why a run ended early, and what of it is `kept`.
    fn ended(
        &self,
        error: &Error,
        signal: Option<(i32, &str)>,
        kept: &str,
    ) -> Result<Exit, Failure> {
        match signal {
            Some((signal, name)) if error.reason == Reason::Interrupted => {
                let file = self.wanted.input.file.display();
                self.streams
                    .error(format!("{file}: {error} by {name}{kept}"));
                Ok(Exit::Signal(signal))
            }
            _ => match self.failure(error) {
                Failure::Faults(message) => Err(Failure::Faults(message + kept)),
                Failure::Told {
                    code,
                    message,
                    help,
                } => Err(Failure::Told {
                    code,
                    message: message + kept,
                    help,
                }),
                other => Err(other),
            },
        }
    }

    /// What the second run, if one was asked for, says of the first.
    fn verdict(&self, run: &Run, signal: Option<(i32, &str)>) -> Result<Exit, Failure> {
        let file = self.wanted.input.file.display();
        match &run.verified {
            Some(verified) if !verified.holds() => {
                let Verified {
                    method,
                    max_difference,
                    tolerance,
                    signal,
                    time,
                    until: _,
                } = verified;
                self.streams.error(format!(
                    "{file}: not verified: {signal} differs by {max_difference:.1e} of its amplitude from a second run ({method}) at \
                     t = {time:e} s, where {tolerance:.1e} is tolerated"
                ));
                Ok(Exit::No)
            }
            None if self.wanted.verify => match signal {
                Some((signal, name)) => {
                    self.streams
                        .error(format!("{file}: the second run was interrupted by {name}"));
                    Ok(Exit::Signal(signal))
                }
                None => Err(Failure::told(
                    "not-verified",
                    format!("{file}: the second run failed; the rows are those of the first"),
                )),
            },
            _ => Ok(Exit::Done),
        }
    }

    fn failure(&self, error: &Error) -> Failure {
        input::broke_off(self.wanted.input, error, self.places(), self.streams)
    }

    /// On standard error: JSON where asked for; words where asked for, for a person, and with `-v`; else the notes alone.
    /// What was measured is in all of them.
    fn summarise(&self, run: &Run, found: &Measurements) {
        let (places, streams, summary) = (self.places(), self.streams, self.wanted.results.summary);
        let in_words = summary == Some(Summary::Text)
            || summary.is_none()
                && (streams.verbose || streams.err_is_terminal())
                && streams.messages == MessageFormat::Human;
        if !in_words {
            streams.warnings(places, &text::warnings(run));
        }
        match summary {
            Some(Summary::Json) => return streams.error(json::summary(run, found, places)),
            Some(Summary::Text) => streams.error(text::summary(run, places, streams.verbose)),
            None if in_words => {
                streams.say(text::summary(run, places, streams.verbose));
            }
            None => streams.notes(places, &run.notes),
        }
        let notes = found.table.iter().map(|table| &table.notes);
        for notes in notes.chain(found.worst.iter().map(|worst| &worst.notes)) {
            streams.notes(places, notes);
        }
        // Asked for, as a summary is.
        if !found.is_empty() {
            match streams.log {
                Some(_) => streams.error(log::run(found)),
                None => streams.error(found.words()),
            }
        }
    }
}
