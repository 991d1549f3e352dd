//! What is known of a circuit before it runs.

use super::{Axis, Page, Table};
use crate::check::{Fault, Report, Theorem};

impl Page {
    /// Findings, certificates, and statement by statement which theorem holds and why.
    #[must_use]
    pub fn of_report(report: &Report) -> Self {
        let axis = Axis {
            name: "time".into(),
            unit: "s",
            log: false,
        };
        let mut page = Self::new(&report.title, axis);
        let finding = |fault: &Fault| {
            let place = match (&fault.file, fault.line, fault.column) {
                (Some(file), Some(line), Some(column)) => format!("{file}:{line}:{column}"),
                _ => String::new(),
            };
            let severity = format!("{:?}", fault.severity).to_lowercase();
            let help = fault.help.clone().unwrap_or_default();
            vec![
                format!("{severity}: {}", fault.code),
                place,
                fault.message.clone(),
                help,
            ]
        };
        let theorem = |theorem: &Theorem| {
            let holds = match theorem.holds {
                Some(true) => "holds",
                Some(false) => "fails",
                None => "not decided",
            };
            vec![
                theorem.statement.clone(),
                holds.to_owned(),
                theorem.because.clone(),
                theorem.gives.clone(),
            ]
        };
        page.tables = vec![
            Table::new(
                "Findings",
                &["what", "where", "message", "what to do"],
                report.faults.iter().map(finding),
            ),
            Table::new(
                "Theorems",
                &["statement", "holds", "because", "it gives"],
                report.theorems.iter().map(theorem),
            ),
        ];
        page.say("Certificates", report.to_string());
        page
    }
}
