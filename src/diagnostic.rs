//! What is wrong with the input, as data. Rendering is the command line's business.

pub mod explain;

use std::fmt::{self, Display, Formatter};

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Worth knowing; nothing was changed or guessed.
    Note,
    /// Something was ignored, replaced or is probably not what was meant.
    Warning,
    /// The circuit cannot be built.
    Error,
}

/// A file of a [`SourceMap`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FileId(pub u32);

/// A byte range in one file.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Span {
    /// The file.
    pub file: FileId,
    /// First byte.
    pub start: usize,
    /// One past the last byte.
    pub end: usize,
}

impl Span {
    /// From the start of this span to the end of another one in the same file.
    #[must_use]
    pub fn to(self, other: Self) -> Self {
        if self.file == other.file {
            Self {
                end: other.end.max(self.end),
                ..self
            }
        } else {
            self
        }
    }
}

impl fmt::Debug for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}..{}", self.file.0, self.start, self.end)
    }
}

/// One file as read: its name for messages and its text (already UTF-8).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceFile {
    /// The path as the user or the including file wrote it.
    pub path: String,
    /// The whole text.
    pub text: String,
}

/// All files that a netlist was read from, in the order of reading.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SourceMap {
    /// The files; a [`FileId`] is an index into this.
    pub files: Vec<SourceFile>,
}

impl SourceMap {
    /// Adds a file.
    pub fn add(&mut self, path: impl Into<String>, text: impl Into<String>) -> FileId {
        self.files.push(SourceFile {
            path: path.into(),
            text: text.into(),
        });
        FileId(u32::try_from(self.files.len() - 1).unwrap_or(u32::MAX))
    }

    /// The text a span covers.
    #[must_use]
    pub fn text(&self, span: Span) -> &str {
        self.files
            .get(span.file.0 as usize)
            .and_then(|f| f.text.get(span.start..span.end))
            .unwrap_or("")
    }

    /// The line on which a span starts.
    fn line(&self, span: Span) -> &str {
        let text = self.files.get(span.file.0 as usize).map_or("", |f| &f.text);
        let at = span.start.min(text.len());
        let (before, after) = text.split_at_checked(at).unwrap_or((text, ""));
        let start = before.rfind('\n').map_or(0, |i| i + 1);
        let end = after.find('\n').map_or(text.len(), |i| at + i);
        text.get(start..end).unwrap_or("")
    }

    /// `file:line:column: message`.
    fn placed(&self, finding: &Diagnostic) -> String {
        let message = self.message(finding);
        let Some(span) = finding.span else {
            return message;
        };
        let (line, column) = self.line_column(span);
        let path = &self.files[span.file.0 as usize].path;
        format!("{path}:{line}:{column}: {message}")
    }

    /// The headline, with where the same thing stands for the first time.
    pub(crate) fn message(&self, finding: &Diagnostic) -> String {
        let Some(first) = finding.first else {
            return finding.message.clone();
        };
        let line = self.line_column(first).0;
        let here = finding.span.is_some_and(|span| span.file == first.file);
        let file = self.files.get(first.file.0 as usize).filter(|_| !here);
        let file = file.map_or_else(String::new, |file| format!(" of {}", file.path));
        format!("{}; first in line {line}{file}", finding.message)
    }

    /// The 1-based line and column (in characters) where a span starts.
    #[must_use]
    pub fn line_column(&self, span: Span) -> (usize, usize) {
        let Some(file) = self.files.get(span.file.0 as usize) else {
            return (0, 0);
        };
        let before = file
            .text
            .get(..span.start.min(file.text.len()))
            .unwrap_or("");
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        (
            before.matches('\n').count() + 1,
            before[line_start..].chars().count() + 1,
        )
    }
}

/// One finding: what is wrong, where, and what would be right.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// A stable kebab-case name, e.g. `unknown-model`.
    pub code: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// The headline: if only one thing can be shown, it is this. Lower case, no full stop.
    pub message: String,
    /// Where; `None` for findings about the circuit as a whole.
    pub span: Option<Span>,
    /// A few words under the underlined text.
    pub label: String,
    /// Where the same thing stands for the first time.
    pub first: Option<Span>,
    /// What would be right, or what to do.
    pub help: Option<String>,
}

/// Those of `more` that are no consequence of a card that could not be read: what such a card names is not called unknown.
pub(crate) fn independent(
    more: Vec<Diagnostic>,
    read: &[Diagnostic],
    sources: &SourceMap,
) -> Vec<Diagnostic> {
    let refused = read.iter().filter(|d| d.severity == Severity::Error);
    let lines: Vec<String> = refused
        .filter_map(|d| Some(sources.line(d.span?).to_lowercase()))
        .collect();
    let is_named = |name: &str| {
        let mut words = lines
            .iter()
            .flat_map(|line| line.split(|c: char| !c.is_alphanumeric() && !matches!(c, '_' | '.')));
        words.any(|word| word == name)
    };
    let follows = |d: &Diagnostic| {
        let written = d.span.map_or("", |span| sources.text(span));
        let name = written.trim_matches(['{', '}', '\'', '"', ' ']);
        d.code.starts_with("unknown-") && is_named(&name.to_lowercase())
    };
    more.into_iter().filter(|d| !follows(d)).collect()
}

impl Diagnostic {
    /// A finding at a place.
    pub fn new(
        code: &'static str,
        severity: Severity,
        span: impl Into<Option<Span>>,
        message: impl Into<String>,
    ) -> Self {
        Self {
            code,
            severity,
            message: message.into(),
            span: span.into(),
            label: String::new(),
            first: None,
            help: None,
        }
    }

    /// An error at a place.
    pub fn error(
        code: &'static str,
        span: impl Into<Option<Span>>,
        message: impl Into<String>,
    ) -> Self {
        Self::new(code, Severity::Error, span, message)
    }

    /// A warning at a place.
    pub fn warning(
        code: &'static str,
        span: impl Into<Option<Span>>,
        message: impl Into<String>,
    ) -> Self {
        Self::new(code, Severity::Warning, span, message)
    }

    /// A note at a place.
    pub fn note(
        code: &'static str,
        span: impl Into<Option<Span>>,
        message: impl Into<String>,
    ) -> Self {
        Self::new(code, Severity::Note, span, message)
    }

    /// In a line: `file:line:column: message (help)`.
    pub(crate) fn line(&self, sources: &SourceMap) -> String {
        let help = self.help.as_ref();
        let help = help.map_or_else(String::new, |help| format!(" ({help})"));
        sources.placed(self) + &help
    }

    /// Adds the words under the underlined text.
    #[must_use]
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }

    /// Adds where the same thing stands for the first time.
    #[must_use]
    pub fn first_at(mut self, span: impl Into<Option<Span>>) -> Self {
        self.first = span.into();
        self
    }

    /// Adds what would be right.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// What to do: its own help, else that of its code.
    #[must_use]
    pub fn remedy(&self) -> Option<String> {
        let of_code = || explain::explain(self.code).map(explain::Explanation::help);
        self.help.clone().or_else(of_code)
    }
}

/// A broken invariant of this program: its own fault, never the circuit's, and never a result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Internal {
    /// Where in the program, `lcs::reduce`.
    pub place: &'static str,
    /// What does not hold, with the names of the circuit's elements concerned.
    pub what: String,
}

impl Internal {
    /// What does not hold at this place.
    pub fn new(place: &'static str, what: impl Into<String>) -> Self {
        Self {
            place,
            what: what.into(),
        }
    }
}

impl fmt::Display for Internal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { place, what } = self;
        write!(
            f,
            "internal error in {place}: {what}; this is a fault of circ, not of the circuit: please report it with the netlist"
        )
    }
}

impl std::error::Error for Internal {}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

/// Everything that is wrong with a netlist; prints a line a finding, `file:line:column: message`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Faults {
    /// The findings, those that are no errors included.
    pub findings: Vec<Diagnostic>,
    /// The files they point into.
    pub sources: SourceMap,
}

impl Display for Faults {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let errors = self
            .findings
            .iter()
            .filter(|d| d.severity == Severity::Error);
        for (k, finding) in errors.enumerate() {
            if k > 0 {
                writeln!(f)?;
            }
            f.write_str(&self.sources.placed(finding))?;
        }
        Ok(())
    }
}

impl std::error::Error for Faults {}

/// "d1, d2 and d3"; of many, how many more there are.
pub(crate) fn listed(names: &[&str]) -> String {
    /// More would not be read.
    const MOST: usize = 6;
    match names {
        [] => String::new(),
        [one] => (*one).to_string(),
        [rest @ .., last] if names.len() <= MOST => format!("{} and {last}", rest.join(", ")),
        _ => format!(
            "{} and {} more",
            names[..MOST].join(", "),
            names.len() - MOST
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_internal_error_names_the_place_and_asks_for_the_netlist() {
        let error = Internal::new("lcs::reduce", "v(c1) has no column").to_string();
        assert!(
            error.contains("lcs::reduce: v(c1) has no column"),
            "{error}"
        );
        assert!(error.contains("report it with the netlist"), "{error}");
    }
}
