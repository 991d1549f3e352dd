//! What is worth knowing about a run, with the place in the netlist where it shows.

use super::located::whole;
use crate::circuit::Circuit;
use crate::diagnostic::SourceMap;
use crate::diagnostic::explain::{Explanation, explain};

/// Something worth knowing about a run.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Note {
    /// A stable kebab-case name, e.g. `steps-instead`, which [`explain`](crate::diagnostic::explain::explain()) knows.
    pub code: &'static str,
    /// What.
    pub text: String,
    /// The elements concerned, or parts of them (`d3.1`); the first is where it shows.
    pub elements: Vec<String>,
}

impl Note {
    /// Something about these elements.
    pub fn of(
        code: &'static str,
        elements: impl IntoIterator<Item = impl Into<String>>,
        text: impl Into<String>,
    ) -> Self {
        Self {
            code,
            text: text.into(),
            elements: elements.into_iter().map(Into::into).collect(),
        }
    }
}

impl Note {
    /// Something about the run as a whole.
    pub fn run(code: &'static str, text: impl Into<String>) -> Self {
        Self::of(code, [""; 0], text)
    }

    /// What to do.
    #[must_use]
    pub fn help(&self) -> Option<String> {
        explain(self.code).map(Explanation::help)
    }

    /// These devices share a current or a voltage in a proportion that the ideal model leaves open.
    pub(crate) fn shared(devices: &[String]) -> Self {
        let text = format!(
            "voltages or currents of {} are not determined by the ideal model; the least-norm choice is shown",
            devices.join(", ")
        );
        Self::of("not-determined", devices, text)
    }
}

/// Adds what was not said yet.
pub(super) fn append(notes: &mut Vec<Note>, more: Vec<Note>) {
    for note in more {
        if !notes.contains(&note) {
            notes.push(note);
        }
    }
}

/// Where elements stand: their circuit, and the files that it was read from. A system without a netlist has neither.
#[derive(Debug, Clone, Copy, Default)]
pub struct Places<'a>(pub Option<(&'a Circuit, &'a SourceMap)>);

impl Places<'_> {
    /// `file:line:column: text`, with the place of the first of these elements that stands in a file; the text where none does.
    #[must_use]
    pub fn at(&self, elements: &[String], text: &str) -> String {
        let place = self.0.and_then(|(circuit, sources)| {
            let mut spans = elements
                .iter()
                .filter_map(|name| whole(circuit, name)?.span);
            let span = spans.next()?;
            let file = sources.files.get(span.file.0 as usize)?;
            let (line, column) = sources.line_column(span);
            Some(format!("{}:{line}:{column}: ", file.path))
        });
        place.unwrap_or_default() + text
    }

    /// A note at its place.
    #[must_use]
    pub fn of(&self, note: &Note) -> String {
        self.at(&note.elements, &note.text)
    }

    /// Notes at their places.
    #[must_use]
    pub fn all(&self, notes: &[Note]) -> Vec<String> {
        notes.iter().map(|note| self.of(note)).collect()
    }
}
