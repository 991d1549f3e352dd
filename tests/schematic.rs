//! LTspice's schematics are the netlists that they stand for.
#![cfg(feature = "cli")]
#![allow(missing_docs, reason = "tests")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use insta::assert_snapshot;

fn circ(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_circ"));
    command.args(arguments).output().expect("circ")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("text")
}

fn drawn() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("netlists/schematics");
    let files = fs::read_dir(folder).expect("a folder");
    let mut files: Vec<PathBuf> = files.map(|file| file.expect("a file").path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "cir"));
    files.sort();
    files
}

#[test]
fn a_schematic_and_its_netlist_are_one_system_and_one_run() {
    let netlists = drawn();
    assert!(netlists.len() >= 10);
    for netlist in netlists {
        let sheet = netlist.with_extension("asc");
        let both = [&netlist, &sheet].map(|file| {
            let file = file.to_str().expect("a name");
            let system = circ(&["lcs", file, "--format", "json"]);
            let run = circ(&["sim", "-q", file]);
            assert!(system.status.success() && run.status.success(), "{file}");
            [text(&system.stdout), text(&run.stdout)]
        });
        assert_eq!(both[0], both[1], "{}", netlist.display());
        assert!(both[0][1].lines().count() > 100);
    }
}

#[test]
fn findings_point_into_the_schematic() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, text: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, text).expect("a file");
        path
    };
    file(
        "block.asy",
        b"Version 4\nSymbolType BLOCK\nPIN 0 0 LEFT 8\nPINATTR PinName a\nPINATTR SpiceOrder 1\n",
    );
    file("block.asc", b"Version 4\nSHEET 1 1 1\nFLAG 16 16 a\nFLAG 16 96 0\nSYMBOL res 0 0 R0\nSYMATTR InstName R1\nSYMATTR Value 1q\n");
    let sheet = b"Version 4\nSHEET 1 880 680\nWIRE 0 16 96 16\nWIRE 96 16 96\nFLAG 0 16 in\nFLAG 96 16 also\nFLAG 0 96 0\n\
        SYMBOL voltage 0 0 R0\nSYMATTR InstName V1\nSYMATTR Value SINE(0 1 1k) AC 1 \xb5\n\
        SYMBOL res 80 0 R45\nSYMBOL cap 80 16 R0\nSYMATTR Value 1\xb5\n\
        SYMBOL diode 80 16 R0\nSYMATTR InstName D1\nSYMATTR Value 1N4148\n\
        SYMBOL Opamps\\\\LT1001 200 200 R0\nSYMATTR InstName U1\n\
        SYMBOL block 0 16 R0\nSYMATTR InstName X1\n\
        TEXT 0 300 Left 2 !.tran 1m\\n+ 5m 2\\n.model sw SW(Vt=\\n.meas x avg V(in)\n";
    let path = file("faulty.asc", sheet);
    let output = circ(&[
        "check",
        "--message-format",
        "short",
        path.to_str().expect("a name"),
    ]);
    assert_eq!(output.status.code(), Some(1));
    let folder = format!("{}/", folder.path().display());
    assert_snapshot!(text(&output.stderr).replace(&folder, ""));
}

#[test]
fn the_text_underlined_is_that_of_the_schematic() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.asc");
    let sheet = "Version 4\nSHEET 1 880 680\nFLAG 16 16 a\nFLAG 16 96 0\nSYMBOL res 0 0 R0\nSYMATTR InstName R1\nSYMATTR Value 10k tol=1% pwr=o,1\n";
    fs::write(&path, sheet).expect("a file");
    let output = circ(&[
        "check",
        "--message-format",
        "json",
        path.to_str().expect("a name"),
    ]);
    let said = text(&output.stderr);
    let finding: serde_json::Value =
        serde_json::from_str(said.lines().next().expect("a finding")).expect("JSON");
    let (line, column) = (
        &finding["line"],
        finding["column"].as_u64().expect("a column"),
    );
    assert_eq!(*line, 7, "{said}");
    let written: String = sheet
        .lines()
        .nth(6)
        .expect("a line")
        .chars()
        .skip(column as usize - 1)
        .collect();
    assert!(
        written.starts_with("o,1") || written.starts_with("pwr"),
        "{written}"
    );
}

#[test]
fn what_is_no_number_of_pins_of_a_sheet_is_refused_without_end() {
    let folder = tempfile::tempdir().expect("a folder");
    // A block that is its own sheet.
    fs::write(
        folder.path().join("me.asy"),
        "Version 4\nSymbolType BLOCK\nPIN 0 0 LEFT 8\nPINATTR PinName a\nPINATTR SpiceOrder 1\n",
    )
    .expect("a file");
    let sheet = "Version 4\nSHEET 1 1 1\nFLAG 0 0 a\nFLAG 0 96 0\nSYMBOL me 0 0 R0\nSYMATTR InstName X1\nSYMBOL res -16 0 R0\nSYMATTR InstName R1\nSYMATTR Value 1\n";
    let path = folder.path().join("me.asc");
    fs::write(&path, sheet).expect("a file");
    let output = circ(&["check", path.to_str().expect("a name")]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        !text(&output.stderr).contains("panicked"),
        "{}",
        text(&output.stderr)
    );
}
