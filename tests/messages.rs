//! Thirty-one typical mistakes and what circ says of them, as docs/messages.md shows; `CIRC_MESSAGES=1` writes the page afresh.
#![cfg(feature = "cli")]
#![allow(missing_docs, reason = "tests")]

#[path = "messages/cases.rs"]
mod cases;

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;

use cases::{CIRCUIT, Case, NETLIST, RUN};

const HEAD: &str = "\
# What circ says of typical mistakes

Each with the netlist, the command and the exact message. `circ explain CODE` tells more of a code. The page is made by
`CIRC_MESSAGES=1 cargo test --test messages`, and the test fails where it is not what circ says.
";

/// What is said, on either stream.
fn said(folder: &Path, case: &Case) -> String {
    fs::write(folder.join(case.file), case.netlist).expect("a file");
    let ran = Command::new(env!("CARGO_BIN_EXE_circ"))
        .current_dir(folder)
        .args(case.command.split_whitespace())
        .output()
        .expect("circ");
    assert_eq!(ran.status.code(), Some(case.status), "{}", case.title);
    let [out, err] = [ran.stdout, ran.stderr].map(|text| String::from_utf8(text).expect("text"));
    // A report begins with what it is of.
    let report = out
        .find("\nverdict")
        .filter(|_| case.command.starts_with("check"));
    report.map_or(err, |end| out[..=end].to_owned())
}

/// The lines without blanks at their ends.
fn trimmed(text: &str) -> String {
    let lines: Vec<&str> = text.trim_end().lines().map(str::trim_end).collect();
    lines.join("\n")
}

fn page() -> String {
    let mut page = HEAD.to_owned();
    for (title, cases) in [
        ("Mistakes in a netlist", &NETLIST[..]),
        ("Mistakes in a circuit", &CIRCUIT),
        ("Mistakes in a run", &RUN),
    ] {
        let _ = writeln!(page, "\n## {title}");
        for case in cases {
            let folder = tempfile::tempdir().expect("a folder");
            let said = said(folder.path(), case);
            let place = format!("[{}:", case.file);
            let line = format!("]: {}:", case.file);
            let located = match case.named {
                Some(name) => said.contains(name),
                None => [place, line].iter().any(|place| said.contains(place)),
            };
            assert!(located, "{}: where is it? {said}", case.title);
            assert!(
                said.contains(case.remedy),
                "{}: what is to do? {said}",
                case.title
            );
            let netlist = case.netlist.trim_end();
            let _ = write!(
                page,
                "\n### {}\n\n```spice\n{netlist}\n```\n\n`circ {}`, status {}:\n\n```text\n{}\n```\n",
                case.title,
                case.command,
                case.status,
                trimmed(&said)
            );
        }
    }
    page
}

#[test]
fn the_page_shows_what_is_said() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/messages.md");
    let made = page();
    if std::env::var_os("CIRC_MESSAGES").is_some() {
        fs::write(&path, &made).expect("the page");
    }
    let kept = fs::read_to_string(path).expect("the page");
    for (k, (own, made)) in kept.lines().zip(made.lines()).enumerate() {
        assert_eq!(
            own,
            made,
            "docs/messages.md:{}; CIRC_MESSAGES=1 writes it afresh",
            k + 1
        );
    }
    assert_eq!(
        kept, made,
        "docs/messages.md; CIRC_MESSAGES=1 writes it afresh"
    );
}

/// Warnings and errors say what to do, where not of themselves by their code.
#[test]
fn every_finding_has_a_remedy() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = "ends\nv1 a 0 1\nr1 a 0 1k\n.ends\n.tran 1m 5m\n.end\n";
    fs::write(folder.path().join("ends.cir"), text).expect("a file");
    for (form, words) in [
        ("human", "\n  help: take it out"),
        (
            "short",
            "ends.cir:4:1: error[unexpected]: `.ends` without `.subckt` (take it out",
        ),
        ("json", "\"help\":\"take it out"),
    ] {
        let ran = Command::new(env!("CARGO_BIN_EXE_circ"))
            .current_dir(folder.path())
            .args(["ends.cir", "--message-format", form])
            .output()
            .expect("circ");
        let said = String::from_utf8(ran.stderr).expect("text");
        assert!(said.contains(words), "{form}: {said}");
    }
}

#[test]
fn there_are_thirty_one() {
    assert_eq!((NETLIST.len(), CIRCUIT.len(), RUN.len()), (15, 8, 8));
}
