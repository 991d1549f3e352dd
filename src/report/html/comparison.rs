//! Two sides of a run.

use super::{Page, Table};
use crate::report::figure::Figure;
use crate::report::{si, text};
use crate::waveform::compare::Comparison;

impl Page {
    /// The curves of both sides with their difference, the verdict, and how far every signal is off.
    #[must_use]
    pub fn of_comparison(figure: &Figure, found: &Comparison, verdict: &str) -> Self {
        let mut page = Self::of_panels(figure);
        let header = [
            "signal",
            "amplitude",
            "max",
            "at",
            "rms",
            "max, edges shifted",
            "at",
        ];
        let heading = format!(
            "Differences over amplitudes; edges shifted: forgiven where they stand {} earlier or later",
            si::quantity(found.shift, "s", 3)
        );
        let rows = found.signals.iter().map(text::difference);
        page.tables.push(Table::new(&heading, &header, rows));
        page.say("Verdict", verdict.to_owned());
        page.say("Not in the reference", found.missing.join(" "));
        page
    }
}
