//! Where the files of `.include` and `.lib` are found, and what is said where they are not.
#![cfg(feature = "cli")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use circ::circuit::ElaborateOptions;
use circ::diagnostic::Severity;
use circ::{Error, Model};
use tempfile::TempDir;

/// `lib/Diodes.LIB`, `more/sub/Part.Sub` and a netlist of these cards below a title.
fn place(cards: &str) -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    for (file, text) in [
        (
            "lib/Diodes.LIB",
            "* diodes\n.model d1n D(Ron=1 Vfwd=0.5)\n.include parts.txt\n",
        ),
        ("lib/Parts.TXT", "* parts\n.model other D(Ron=2)\n"),
        (
            "more/sub/Part.Sub",
            "* parts\n.subckt load a b\nr1 a b 7\n.ends\n",
        ),
    ] {
        let path = directory.path().join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    let text = format!("title\n{cards}\n.tran 1m 2m\n.end\n");
    fs::write(directory.path().join("a.cir"), text).unwrap();
    directory
}

fn load(directory: &Path, folders: &[&str]) -> Result<Model, Error> {
    let libraries = folders.iter().map(|f| directory.join(f)).collect();
    let options = ElaborateOptions {
        libraries,
        ..ElaborateOptions::default()
    };
    Model::load(directory.join("a.cir"), options)
}

/// Severity, code and message of all findings.
fn said(model: &Model) -> Vec<(Severity, &'static str, String)> {
    let findings = model.findings().iter();
    findings
        .map(|d| (d.severity, d.code, d.message.clone()))
        .collect()
}

#[test]
fn libraries_come_after_the_folder_of_the_netlist() {
    let cards = "v1 a 0 5\nd1 a b d1n\nr1 b 0 1\n.lib diodes.lib";
    let directory = place(cards);
    assert_eq!(said(&load(directory.path(), &["lib"]).unwrap()), []);
    let model = load(directory.path(), &["more", "lib"]).unwrap();
    let read: Vec<&str> = model
        .sources()
        .files
        .iter()
        .map(|f| f.path.as_str())
        .collect();
    assert!(
        read[1].ends_with("lib/Diodes.LIB") && read[2].ends_with("lib/Parts.TXT"),
        "{read:?}"
    );
    let refused = load(directory.path(), &[]).unwrap_err();
    let codes: Vec<&str> = refused.findings().iter().map(|d| d.code).collect();
    assert_eq!(codes, ["missing-file", "unknown-model"]);
    // What lies beside the netlist comes first.
    fs::write(
        directory.path().join("DIODES.lib"),
        "*\n.model d1n D(Ron=9)\n",
    )
    .unwrap();
    let model = load(directory.path(), &["lib"]).unwrap();
    assert!(model.sources().files[1].path.ends_with("DIODES.lib"));
    assert_eq!(model.sources().files.len(), 2);
}

#[test]
fn a_model_is_read_again_from_the_files_it_has() {
    let directory = place("v1 a 0 5\nd1 a b other\nr1 b 0 1\n.lib 'C:\\LTspice\\DIODES.lib'");
    let model = load(directory.path(), &["lib"]).unwrap();
    let again = Model::of_files(&model.sources().files, model.options().clone()).unwrap();
    assert_eq!(again.sources(), model.sources());
}

#[test]
fn of_paths_of_other_machines_the_name_counts() {
    for written in [
        r"C:\Users\x\LTspice\lib\sub\PART.SUB",
        "/Users/x/part.sub",
        "~/lib/part.sub",
        r"sub\part.sub",
        "Sub/PART.sub",
    ] {
        let directory = place(&format!("v1 a 0 5\nx1 a 0 load\n.include \"{written}\""));
        let found = load(directory.path(), &["lib", "more", "more/sub"]).unwrap();
        let notes = said(&found);
        let relative = written.to_lowercase().starts_with("sub");
        assert_eq!(notes.len(), usize::from(!relative), "{written}: {notes:?}");
        for (severity, code, message) in notes {
            assert_eq!((severity, code), (Severity::Note, "found-elsewhere"));
            assert!(message.contains(written) && message.ends_with("Part.Sub` is read"));
        }
        let point = found.operating_point().unwrap();
        let (_, current) = point.currents.iter().find(|(n, _)| n == "x1.r1").unwrap();
        assert!((current * 7.0 / 5.0 - 1.0).abs() < 1e-15, "{point:?}");
    }
}

#[test]
fn a_missing_name_is_told_once_with_its_uses() {
    let cards = "v1 a 0 5\nd1 a b dx\nd2 a b dx\nx1 b c some\nx2 c 0 some\nx3 c 0 thing\nd3 c 0 dy";
    let refused = load(place(cards).path(), &[]).unwrap_err();
    let told: Vec<(String, String)> = refused
        .findings()
        .iter()
        .map(|d| (d.message.clone(), d.help.clone().unwrap_or_default()))
        .collect();
    let messages: Vec<&str> = told.iter().map(|(m, _)| m.as_str()).collect();
    assert_eq!(
        messages,
        [
            "`d1` uses unknown model `dx`, the first of 2 that do",
            "`x1` calls unknown subcircuit `some`, the first of 2 that do",
            "`x3` calls unknown subcircuit `thing`",
            "`d3` uses unknown model `dy`",
        ]
    );
    assert!(told[0].1.contains("`--diodes ideal`"), "{told:?}");
    assert!(told[1].1.contains("`--lib DIR`"), "{told:?}");
}

#[test]
fn folders_are_named_on_the_command_line_and_in_the_environment() {
    let directory =
        place("v1 a 0 5\nd1 a b d1n\nr1 b 0 1\nx1 b 0 load\n.lib diodes.lib\n.inc part.sub");
    let run = |arguments: &[&str], variable: &[&str]| {
        let folders: Vec<PathBuf> = variable.iter().map(PathBuf::from).collect();
        let output = Command::new(env!("CARGO_BIN_EXE_circ"))
            .current_dir(directory.path())
            .args(["op", "a.cir"])
            .args(arguments)
            .env("CIRC_LIB", std::env::join_paths(folders).unwrap())
            .output()
            .unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        (output.status.code().unwrap(), said)
    };
    assert_eq!(run(&["--lib", "lib", "--lib", "more/sub"], &[]).0, 0);
    assert_eq!(run(&[], &["more/sub", "lib"]).0, 0);
    assert_eq!(run(&["--lib", "lib"], &["nowhere", "more/sub"]).0, 0);
    let (status, said) = run(&["--lib", "lib"], &[]);
    assert!(
        status == 2 && said.contains("and the folder of `--lib`"),
        "{said}"
    );
    let (status, said) = run(&["--lib", "nowhere"], &[]);
    assert!(
        status == 2 && said.contains("there is no such folder"),
        "{said}"
    );
}
