//! Results of a run: the ending of a file chooses the format.

use std::io::{self, BufWriter, Cursor, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::exit::Failure;
use super::files::{self, STDOUT, Written};
use super::rows::{Columns, Form, Shown, Stream};
use super::streams::Streams;
use crate::analysis::Conduction;
use crate::integrate::{Block, Places, Run};
use crate::model::Model;
use crate::report::figure::{Figure, PANEL_COLUMNS};
use crate::report::html::Page;
use crate::report::steps::Step;
use crate::report::{PictureError, png, svg};
use crate::waveform::{csv, json, npz, raw};

/// Formats of a run's results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Comma-separated values.
    Csv,
    /// ngspice's binary format.
    Raw,
    /// NumPy's archive.
    Npz,
    /// JSON.
    Json,
    /// A drawing.
    Svg,
    /// A picture.
    Png,
    /// A page.
    Html,
}

impl Format {
    /// The formats of these outputs: what the ending names, else what was asked for, else CSV on standard output.
    ///
    /// # Errors
    /// A message that lists the known endings; standard output twice, or bytes for a terminal; a format that nothing takes.
    pub(super) fn of(
        paths: &[PathBuf],
        asked: Option<Self>,
        streams: &Streams,
    ) -> Result<Vec<Self>, Failure> {
        let to_out = |path: &&PathBuf| path.as_path() == Path::new(STDOUT);
        if paths.iter().filter(to_out).count() > 1 {
            return Err(Failure::told(
                "output-format",
                "`-o -` is given twice: there is one standard output".into(),
            ));
        }
        if let (Some(asked), true) = (
            asked,
            paths.iter().all(|path| Self::of_ending(path).is_ok()),
        ) {
            return Err(Failure::told(
                "output-format",
                format!(
                    "--format {}: the endings of all outputs name another; it is for `-o -`",
                    asked.name()
                ),
            ));
        }
        let format = |path: &PathBuf| {
            if !to_out(&path) {
                return asked.map_or_else(|| Self::of_ending(path), Ok);
            }
            let format = asked.unwrap_or(Self::Csv);
            if streams.out_is_terminal() && matches!(format, Self::Raw | Self::Npz | Self::Png) {
                return Err(Failure::told(
                    "output-format",
                    format!(
                        "`-o -`: {} is no text for a terminal; send it to a file or a pipe",
                        format.name()
                    ),
                ));
            }
            Ok(format)
        };
        paths
            .iter()
            .map(|path| Self::of_ending(path).or_else(|_| format(path)))
            .collect()
    }

    fn name(self) -> String {
        let value = self.to_possible_value();
        value.map_or_else(String::new, |value| value.get_name().to_owned())
    }

    fn of_ending(path: &Path) -> Result<Self, Failure> {
        let ending = path
            .extension()
            .map(|e| e.to_string_lossy().to_ascii_lowercase());
        Ok(match ending.as_deref() {
            Some("csv") => Self::Csv,
            Some("raw") => Self::Raw,
            Some("npz") => Self::Npz,
            Some("json") => Self::Json,
            Some("svg") => Self::Svg,
            Some("png") => Self::Png,
            Some("html" | "htm") => Self::Html,
            _ => {
                return Err(unknown_ending(
                    path,
                    "csv, raw, npz, json, svg, png or html",
                ));
            }
        })
    }

    /// Whether it is looked at: events, jumps and corners belong in it then.
    #[must_use]
    pub const fn is_picture(self) -> bool {
        matches!(self, Self::Svg | Self::Png | Self::Html)
    }
}

/// The failure that a file's ending chooses none of these formats.
pub(super) fn unknown_ending(path: &Path, known: &str) -> Failure {
    Failure::told(
        "output-format",
        format!(
            "{}: the ending chooses the format and must be {known}",
            path.display()
        ),
    )
}

/// The failure that standard output has none of these formats.
pub(super) fn unknown_format(known: &str) -> Failure {
    let example = known.rsplit(' ').next().unwrap_or_default();
    Failure::told(
        "output-format",
        format!(
            "`-o -`: `--format` chooses the format of standard output and must be {known}, as in `--format {example}`"
        ),
    )
}

/// A run, what was measured in it, and its model.
#[derive(Clone, Copy)]
pub(super) struct Told<'a> {
    pub(super) run: &'a Run,
    /// In words.
    pub(super) measured: &'a str,
    pub(super) conduction: &'a [Conduction],
    /// Those of `.step` that it stands for.
    pub(super) steps: &'a [Step],
    pub(super) model: Option<&'a Model>,
}

/// The results of a run: those that are written as rows come, and those that need all of them.
pub(super) struct Outputs {
    streams: Vec<Stream>,
    held: Vec<(Written, Format)>,
    shown: Shown,
    names: Vec<PathBuf>,
}

impl Outputs {
    /// Files for these paths, which appear under their names at the end; without any, rows to standard output if `to_pipe`.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(super) fn open(
        paths: &[PathBuf],
        formats: &[Format],
        to_pipe: bool,
        shown: Shown,
        columns: &Columns,
    ) -> Result<Self, Failure> {
        let mut outputs = Self {
            streams: Vec::new(),
            held: Vec::new(),
            shown,
            names: paths.to_vec(),
        };
        let stream = |form, file| Stream::new(form, file, shown, columns.clone());
        for (path, format) in paths.iter().zip(formats) {
            let file = Written::create(path)?;
            match format {
                Format::Csv => outputs.streams.push(stream(Form::Csv, Some(file))),
                Format::Raw if file.can_seek() => {
                    outputs.streams.push(stream(Form::Raw, Some(file)));
                }
                format => outputs.held.push((file, *format)),
            }
        }
        if paths.is_empty() && to_pipe {
            outputs.streams.push(stream(Form::Csv, None));
        }
        Ok(outputs)
    }

    /// Whether something needs all rows at once.
    pub(super) fn hold(&self) -> bool {
        !self.held.is_empty()
    }

    /// Writes rows; a run ends where that fails.
    pub(super) fn take(&mut self, block: Block<'_>) -> ControlFlow<()> {
        let mut done = true;
        for stream in &mut self.streams {
            done &= stream.take(block);
        }
        if done {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    }

    /// Time of the last row written, s.
    pub(super) fn last(&self) -> Option<f64> {
        self.streams.first().and_then(Stream::last)
    }

    /// The files, in words.
    pub(super) fn words(&self) -> String {
        let name = |path: &PathBuf| match path.as_path() == Path::new(STDOUT) {
            true => "standard output".into(),
            false => path.display().to_string(),
        };
        let names: Vec<String> = self.names.iter().map(name).collect();
        names.join(", ")
    }

    /// Writes what needs all rows, and gives all files their names; `incomplete` says why a run ended early, `figure` what is to be seen for so
    /// many pixels. Every file is tried.
    ///
    /// # Errors
    /// The first failure.
    pub(super) fn finish(
        self,
        told: Told<'_>,
        figure: &dyn Fn(usize) -> Figure,
        incomplete: Option<&str>,
    ) -> Result<(), Failure> {
        let mut first = Ok(());
        for mut stream in self.streams {
            // What came before a failure is kept.
            let failure = stream.failure();
            let said = incomplete.or(failure.as_ref().map(|_| "incomplete: not all was written"));
            let finished = stream.finish(said);
            first = first.and(failure.map_or(finished, Err));
        }
        for (file, format) in self.held {
            let written = match write(told, figure, self.shown, format, file, incomplete) {
                // A picture of a run that broke off before its first row.
                Err(Failure::Picture(_)) if incomplete.is_some() => Ok(()),
                written => written,
            };
            first = first.and(written);
        }
        first
    }
}

/// Writes a run to a file; pictures show `figure`.
fn write(
    told: Told<'_>,
    figure: &dyn Fn(usize) -> Figure,
    shown: Shown,
    format: Format,
    mut file: Written,
    incomplete: Option<&str>,
) -> Result<(), Failure> {
    let titled =
        |title: &str| incomplete.map_or(title.to_owned(), |why| format!("{title} ({why})"));
    let drawing = |pixels| {
        let mut figure = figure(pixels);
        figure.title = titled(&figure.title);
        figure
    };
    let waves = || {
        let mut waves = shown.of(&told.run.waveforms, &told.run.kinds);
        waves.title = titled(&waves.title);
        waves
    };
    let result = match format {
        Format::Html => {
            let places = told.model.map_or_else(Places::default, Model::places);
            let page = Page::of_run(
                &drawing(usize::MAX),
                told.run,
                told.measured.to_owned(),
                places,
            )
            .with_conduction(told.conduction)
            .with_steps(told.steps)
            .with_circuit(told.model);
            file.append(page.html()?.as_bytes())
        }
        Format::Svg => file.append(svg::draw(&drawing(PANEL_COLUMNS))?.as_bytes()),
        Format::Png => file.append(&png::from_svg(&svg::draw(&drawing(PANEL_COLUMNS))?)?),
        Format::Npz if file.can_seek() => npz::write(BufWriter::new(&mut file), &waves()),
        Format::Npz => {
            let mut bytes = Cursor::new(Vec::new());
            npz::write(&mut bytes, &waves()).and_then(|()| file.append(bytes.get_ref()))
        }
        Format::Json => buffered(&mut file, |to| json::write(to, &waves())),
        Format::Csv => buffered(&mut file, |to| csv::write(to, &waves())),
        Format::Raw => buffered(&mut file, |to| raw::write(to, &waves())),
    };
    result.map_err(|e| file.failure(e))?;
    file.finish()
}

fn buffered(
    file: &mut Written,
    content: impl FnOnce(&mut BufWriter<&mut Written>) -> io::Result<()>,
) -> io::Result<()> {
    let mut file = BufWriter::new(file);
    content(&mut file)?;
    file.flush()
}

/// Writes a drawing as it is, or rasterised.
///
/// # Errors
/// Those of the file and of rasterising.
pub fn picture_to_file(path: &Path, is_png: bool, drawing: &str) -> Result<(), Failure> {
    let rasterised: Result<Vec<u8>, PictureError> = if is_png {
        png::from_svg(drawing)
    } else {
        Ok(drawing.as_bytes().to_vec())
    };
    files::write(path, &rasterised?)
}
