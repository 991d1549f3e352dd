//! Findings as text, with the place underlined.

use std::fmt;

use miette::{
    GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteError, MietteSpanContents,
    SourceCode, SourceSpan, SpanContents,
};

use super::args::MessageFormat;
use crate::check::Fault;
use crate::diagnostic::explain::{Explanation, explain};
use crate::diagnostic::{Diagnostic, Severity, SourceMap, Span};
use crate::report;

/// Width of messages in columns.
const WIDTH: usize = 100;
/// Bytes of a line that are shown before and from a place on: the rest of a longer line is left out.
const SHOWN: usize = 160;

/// All findings, each with `file:line:col` and the text underlined, with or without terminal colours.
#[must_use]
pub fn render(diagnostics: &[Diagnostic], sources: &SourceMap, colour: bool) -> String {
    let theme = if colour {
        GraphicalTheme::unicode()
    } else {
        GraphicalTheme::unicode_nocolor()
    };
    let handler = GraphicalReportHandler::new_themed(theme)
        .with_width(WIDTH)
        .with_context_lines(0)
        .with_links(false);
    let mut text = String::new();
    for diagnostic in diagnostics {
        let shown = Shown::new(diagnostic, sources);
        // Writing to a string fails only if a Display does; then the bare message remains.
        if handler.render_report(&mut text, &shown).is_err() {
            text.push_str(&diagnostic.message);
        }
        text.push('\n');
    }
    text
}

/// A line for each finding: `file:line:col: severity[code]: message`, with its help behind it.
#[must_use]
pub(super) fn short(diagnostics: &[Diagnostic], sources: &SourceMap) -> String {
    let line = |diagnostic: &Diagnostic| {
        let Fault {
            code,
            severity,
            message,
            file,
            line,
            column,
            help,
        } = Fault::of(diagnostic, sources);
        let place = match (file, line, column) {
            (Some(file), Some(line), Some(column)) => format!("{file}:{line}:{column}: "),
            _ => String::new(),
        };
        let help = help.map_or_else(String::new, |help| format!(" ({help})"));
        let severity = word(severity);
        format!("{place}{severity}[{code}]: {message}{help}")
    };
    lines(diagnostics.iter().map(line))
}

/// A JSON object for each finding on a line of its own: code, severity, message, file, line, column, help.
#[must_use]
pub(super) fn json(diagnostics: &[Diagnostic], sources: &SourceMap) -> String {
    let line = |diagnostic: &Diagnostic| report::json::line(&Fault::of(diagnostic, sources));
    lines(diagnostics.iter().map(line))
}

/// A failure without a place, with what to do.
pub(super) fn failure(
    message: &str,
    (code, help): (&'static str, Option<String>),
    form: MessageFormat,
) -> String {
    let failure = [Diagnostic {
        help: help.clone(),
        ..Diagnostic::error(code, None, message)
    }];
    match form {
        MessageFormat::Human => headed(&format!("error[{code}]: {message}"), help.as_deref()),
        MessageFormat::Short => short(&failure, &SourceMap::default()),
        MessageFormat::Json => json(&failure, &SourceMap::default()),
    }
}

/// A line, with what to do on the next.
pub(super) fn headed(line: &str, help: Option<&str>) -> String {
    help.map_or_else(|| line.to_owned(), |help| format!("{line}\n  help: {help}"))
}

/// What there is to say of a run, which may begin with its place, `file:line:col: `, as a line; with what to do, of notes for programs alone.
pub(super) fn remark(
    (severity, code): (Severity, &'static str),
    text: &str,
    form: MessageFormat,
) -> String {
    let help = explain(code).map(Explanation::help);
    let kind = format!("{}[{code}]", word(severity));
    let (place, message) = placed(text);
    match form {
        MessageFormat::Human => {
            let help = help.filter(|_| severity != Severity::Note);
            headed(&format!("{kind}: {text}"), help.as_deref())
        }
        MessageFormat::Short => {
            let help = help.map_or_else(String::new, |help| format!(" ({help})"));
            let place = place.map_or_else(String::new, |(file, line, column)| {
                format!("{file}:{line}:{column}: ")
            });
            format!("{place}{kind}: {message}{help}")
        }
        MessageFormat::Json => report::json::line(&Fault {
            code,
            severity,
            message: message.to_owned(),
            file: place.map(|(file, ..)| file.to_owned()),
            line: place.map(|(_, line, _)| line),
            column: place.map(|(.., column)| column),
            help,
        }),
    }
}

/// The place that a text begins with, and the rest.
fn placed(text: &str) -> (Option<(&str, usize, usize)>, &str) {
    let place = text.match_indices(": ").find_map(|(at, _)| {
        let mut parts = text[..at].rsplitn(3, ':');
        let column = parts.next()?.parse().ok()?;
        let line = parts.next()?.parse().ok()?;
        Some(((parts.next()?, line, column), &text[at + 2..]))
    });
    place.map_or((None, text), |(place, rest)| (Some(place), rest))
}

const fn word(severity: Severity) -> &'static str {
    match severity {
        Severity::Note => "note",
        Severity::Warning => "warning",
        Severity::Error => "error",
    }
}

fn lines(lines: impl Iterator<Item = String>) -> String {
    lines
        .map(|line| line.replace('\n', " "))
        .collect::<Vec<_>>()
        .join("\n")
}

/// A finding with the file it points into.
#[derive(Debug)]
struct Shown<'a> {
    diagnostic: &'a Diagnostic,
    source: Option<WholeLines>,
}

impl<'a> Shown<'a> {
    fn new(diagnostic: &'a Diagnostic, sources: &SourceMap) -> Self {
        let file = diagnostic
            .span
            .and_then(|span| sources.files.get(span.file.0 as usize));
        let source = file.map(|file| WholeLines {
            path: file.path.clone(),
            text: file.text.clone(),
        });
        Self { diagnostic, source }
    }
}

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.diagnostic.message)
    }
}

impl std::error::Error for Shown<'_> {}

impl miette::Diagnostic for Shown<'_> {
    fn code<'b>(&'b self) -> Option<Box<dyn fmt::Display + 'b>> {
        Some(Box::new(self.diagnostic.code))
    }

    fn severity(&self) -> Option<miette::Severity> {
        Some(match self.diagnostic.severity {
            Severity::Note => miette::Severity::Advice,
            Severity::Warning => miette::Severity::Warning,
            Severity::Error => miette::Severity::Error,
        })
    }

    fn help<'b>(&'b self) -> Option<Box<dyn fmt::Display + 'b>> {
        let help = match self.diagnostic.severity {
            // Nothing has to be done: what a note does not say itself is for programs alone.
            Severity::Note => self.diagnostic.help.clone(),
            Severity::Warning | Severity::Error => self.diagnostic.remedy(),
        };
        help.map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.source.as_ref().map(|source| source as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = self.diagnostic.span.filter(|_| self.source.is_some())?;
        let text = &self.source.as_ref()?.text;
        let part = |span: Span| {
            let end = boundary(text, span.end.min(span.start + SHOWN));
            SourceSpan::from((span.start, end - span.start))
        };
        let first = self.diagnostic.first.filter(|at| at.file == span.file);
        let first = first.map(|at| LabeledSpan::new_with_span(Some("first here".into()), part(at)));
        let label = &self.diagnostic.label;
        let label = (!label.is_empty()).then(|| label.clone());
        let here = LabeledSpan::new_primary_with_span(label, part(span));
        Some(Box::new(first.into_iter().chain([here])))
    }
}

/// The beginning of the character at a byte, which may be the end of the text.
fn boundary(text: &str, at: usize) -> usize {
    let at = at.min(text.len());
    (0..=at)
        .rev()
        .find(|&k| text.is_char_boundary(k))
        .unwrap_or(0)
}

/// A file that shows whole lines (as much of them as can be read) around a place, where miette alone would show the place only.
#[derive(Debug)]
struct WholeLines {
    path: String,
    text: String,
}

impl SourceCode for WholeLines {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        _: usize,
        _: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let place = (
            span.offset(),
            (span.offset() + span.len()).min(self.text.len()),
        );
        let (Some(before), Some(after)) = (self.text.get(..place.0), self.text.get(place.1..))
        else {
            return Err(MietteError::OutOfBounds);
        };
        let line = before.rfind('\n').map_or(0, |i| i + 1);
        let end = after.find('\n').map_or(self.text.len(), |i| place.1 + i);
        let start = boundary(&self.text, line.max(place.0.saturating_sub(SHOWN)));
        let end = boundary(&self.text, end.min(place.1 + SHOWN));
        Ok(Box::new(MietteSpanContents::new_named(
            self.path.clone(),
            &self.text.as_bytes()[start..end],
            SourceSpan::from((start, end - start)),
            before.matches('\n').count(),
            before[line..].chars().count(),
            self.text.lines().count(),
        )))
    }
}
