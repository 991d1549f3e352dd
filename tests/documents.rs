//! Every command of the README and of the tutorials does what it should, in a folder with the netlists.
#![cfg(all(unix, feature = "cli"))]
#![allow(missing_docs, reason = "tests")]

use std::fs;
use std::path::Path;
use std::process::Command;

/// Pages whose commands are run: those of blocks marked `sh` that begin with `circ`; netlists marked `title=NAME` stand in the folder.
const PAGES: [&str; 6] = [
    "README.md",
    "docs/netlist.md",
    "docs/from-ltspice.md",
    "docs/from-plecs.md",
    "docs/for-researchers.md",
    "docs/periodic.md",
];

/// The fenced blocks of a page: what they are marked, and their text.
fn blocks(page: &str) -> Vec<(&str, String)> {
    let mut blocks = Vec::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        if let Some(mark) = line.strip_prefix("```") {
            let text: Vec<&str> = lines
                .by_ref()
                .take_while(|l| !l.starts_with("```"))
                .collect();
            blocks.push((mark, text.join("\n") + "\n"));
        }
    }
    blocks
}

#[test]
fn every_command_runs() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let program = Path::new(env!("CARGO_BIN_EXE_circ"))
        .parent()
        .expect("a folder");
    let path = format!(
        "{}:{}",
        program.display(),
        std::env::var("PATH").unwrap_or_default()
    );
    let mut faults = Vec::new();
    for page in PAGES {
        let text = fs::read_to_string(root.join(page)).expect("a page");
        let folder = tempfile::tempdir().expect("a folder");
        std::os::unix::fs::symlink(root.join("netlists"), folder.path().join("netlists"))
            .expect("a link");
        let mut count = 0;
        for (mark, text) in blocks(&text) {
            if let Some((_, name)) = mark.split_once("title=") {
                fs::write(folder.path().join(name), text).expect("a netlist");
            } else if mark == "sh" {
                for command in text.lines().filter(|line| line.starts_with("circ ")) {
                    count += 1;
                    let ran = Command::new("sh")
                        .args(["-c", command])
                        .current_dir(folder.path())
                        .env("PATH", &path)
                        .output()
                        .expect("sh");
                    if !ran.status.success() {
                        let said = String::from_utf8_lossy(&ran.stderr).into_owned();
                        faults.push(format!("{page}: {command}: {}\n{said}", ran.status));
                    }
                }
            }
        }
        assert!(count > 0, "{page} has commands");
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn blocks_are_read() {
    let found = blocks("a\n```sh\ncirc a\n```\n```spice title=b.cir\nb\n```\n");
    assert_eq!(
        found,
        [
            ("sh", "circ a\n".to_owned()),
            ("spice title=b.cir", "b\n".to_owned())
        ]
    );
}
