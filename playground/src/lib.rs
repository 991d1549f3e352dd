//! What the page of the playground asks of `circ`: netlist text in, JSON out.

use circ::analysis::{Finished, pictured};
use circ::diagnostic::{SourceFile, SourceMap};
use circ::report::figure::Figure;
use circ::report::html::Page;
use circ::report::schematic;
use circ::{Diagnostic, Diodes, ElaborateOptions, Error, Model, Severity, SimOptions};
use serde::Serialize;
use wasm_bindgen::prelude::wasm_bindgen;

/// The name under which findings speak of the text.
const FILE: &str = "circuit.cir";

/// A finding, with its place in the text in UTF-16 code units, as JavaScript counts.
#[derive(Debug, Serialize)]
struct Finding {
    severity: &'static str,
    code: &'static str,
    message: String,
    label: String,
    help: Option<String>,
    start: Option<usize>,
    end: Option<usize>,
    line: usize,
}

/// What is known of a netlist without running it.
#[derive(Debug, Default, Serialize)]
struct Checked {
    title: String,
    findings: Vec<Finding>,
    /// SVG with both states of every device; none where there is no circuit or nothing to draw.
    schematic: Option<String>,
    /// There is a transient to run.
    runs: bool,
}

/// What a run gave, as far as it came.
#[derive(Debug, Default, Serialize)]
struct Ran {
    /// See [`circ::report::html`].
    page: Option<Page>,
    findings: Vec<Finding>,
}

/// Findings and the picture of a netlist, as JSON.
#[wasm_bindgen]
#[must_use]
pub fn check(netlist: &str) -> String {
    let checked = match read(netlist) {
        Ok(model) => Checked {
            title: model.circuit().title.clone(),
            findings: findings(model.findings(), netlist, model.sources()),
            schematic: schematic::with_both_states(&model).ok(),
            runs: model.circuit().tran.is_some(),
        },
        Err(error) => Checked {
            findings: refused(&error, netlist),
            ..Checked::default()
        },
    };
    json(&checked)
}

/// The transient of a netlist, as JSON.
#[wasm_bindgen]
#[must_use]
pub fn run(netlist: &str) -> String {
    let ran = match read(netlist) {
        Ok(model) => carried_out(&model, netlist),
        Err(error) => Ran {
            findings: refused(&error, netlist),
            ..Ran::default()
        },
    };
    json(&ran)
}

fn read(netlist: &str) -> Result<Model, Error> {
    let file = SourceFile {
        path: FILE.into(),
        text: netlist.into(),
    };
    let options = ElaborateOptions {
        diodes: Diodes::Auto,
        ..ElaborateOptions::default()
    };
    Model::of_files(&[file], options)
}

fn carried_out(model: &Model, netlist: &str) -> Ran {
    let options = SimOptions {
        events: true,
        corners: true,
        ..SimOptions::default()
    };
    let Finished { run, error } = pictured(model, options);
    let failure = error.map(|error| error.diagnostic(model.circuit()));
    let findings = findings(failure.as_slice(), netlist, model.sources());
    let Some((run, found)) = run else {
        return Ran {
            findings,
            ..Ran::default()
        };
    };
    let figure = Figure::of_waveforms(&run.waveforms, usize::MAX);
    Ran {
        page: Some(
            Page::of_run(&figure, &run, found.words(), model.places())
                .with_conduction(&found.conduction),
        ),
        findings,
    }
}

fn refused(error: &Error, netlist: &str) -> Vec<Finding> {
    if error.findings().is_empty() {
        let own = Diagnostic::error("refused", None, error.to_string());
        return findings(&[own], netlist, &SourceMap::default());
    }
    let mut sources = SourceMap::default();
    sources.add(FILE, netlist);
    findings(error.findings(), netlist, &sources)
}

fn findings(all: &[Diagnostic], netlist: &str, sources: &SourceMap) -> Vec<Finding> {
    let units = |end: usize| {
        netlist
            .get(..end)
            .map(|before| before.encode_utf16().count())
    };
    let of = |own: &Diagnostic| Finding {
        severity: match own.severity {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        },
        code: own.code,
        message: own.message.clone(),
        label: own.label.clone(),
        help: own.help.clone(),
        start: own.span.and_then(|span| units(span.start)),
        end: own.span.and_then(|span| units(span.end)),
        line: own.span.map_or(0, |span| sources.line_column(span).0),
    };
    all.iter().map(of).collect()
}

fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value)
        .unwrap_or_else(|error| format!("{{\"findings\":[{{\"message\":\"{error}\"}}]}}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BUCK: &str = include_str!("../../netlists/buck.cir");

    #[test]
    fn a_netlist_is_drawn_and_run() {
        let checked = check(BUCK);
        assert!(
            checked.contains("\"runs\":true") && checked.contains("<svg "),
            "{checked}"
        );
        let ran: serde_json::Value = serde_json::from_str(&run(BUCK)).unwrap();
        let curves = |k: usize| ran["page"]["panels"][k]["curves"].as_array().unwrap().len();
        // The output, the switched node, the inductor's current.
        assert_eq!([0, 1, 2].map(curves), [1, 1, 1]);
        assert!(ran["page"]["columns"].as_array().unwrap().len() == 4);
        assert_eq!(ran["findings"].as_array().unwrap().len(), 0);
    }

    #[test]
    fn a_finding_says_where_as_javascript_counts() {
        let text = "µ𝄞 title\nr1 a 0 1k\nd1 a 0 none\n.end\n";
        let checked: serde_json::Value = serde_json::from_str(&check(text)).unwrap();
        let finding = &checked["findings"][0];
        let units: Vec<u16> = text.encode_utf16().collect();
        let place = |key: &str| finding[key].as_u64().unwrap() as usize;
        assert_eq!(
            String::from_utf16(&units[place("start")..place("end")]).unwrap(),
            "none"
        );
        assert_eq!(
            (finding["severity"].as_str(), place("line")),
            (Some("error"), 3)
        );
    }

    #[test]
    fn files_are_not_read() {
        let checked = check("t\n.include Cargo.toml\nr1 a 0 1\n.end\n");
        assert!(
            checked.contains("missing-file") && checked.contains("Cargo.toml"),
            "{checked}"
        );
    }
}
