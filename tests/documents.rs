//! Every command of the README and of the tutorials does what it should, in a folder with the netlists.
#![cfg(all(unix, feature = "cli"))]
#![allow(missing_docs, reason = "tests")]

use std::fs;
use std::path::Path;
use std::process::Command;

/// Pages whose commands are run: those of blocks marked `sh` that begin with `circ`; netlists marked `title=NAME` stand in the folder.
const PAGES: [&str; 7] = [
    "README.md",
    "docs/running.md",
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

/// A page without the breaks of its lines.
fn flowing(page: &str) -> String {
    page.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// What stands between backquotes.
fn quoted(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

/// docs/claims.md quotes what its pages say, and names files and tests that are there.
#[test]
fn every_claim_is_kept_by_what_it_names() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |path: &str| fs::read_to_string(root.join(path)).ok();
    let claims = read("docs/claims.md").expect("a page");
    let rows = claims.lines().filter(|line| line.starts_with("| ")).skip(1);
    let (mut count, mut faults) = (0, Vec::new());
    for row in rows {
        count += 1;
        let cells: Vec<String> = row
            .replace("\\|", "\u{0}")
            .split(" | ")
            .map(|cell| {
                cell.replace('\u{0}', "|")
                    .trim_matches(['|', ' '])
                    .to_string()
            })
            .collect();
        let [page, words, by] = &cells[..] else {
            faults.push(format!("not three cells: {row}"));
            continue;
        };
        if !read(page).is_some_and(|text| flowing(&text).contains(words)) {
            faults.push(format!("{page} does not say: {words}"));
        }
        let files: Vec<String> = quoted(by).filter_map(read).collect();
        if files.is_empty() {
            faults.push(format!("no file keeps: {words}"));
        }
        let tests = quoted(by).filter(|name| name.contains('_') && !name.contains(['/', '=']));
        for test in tests {
            let defined = |file: &String| {
                [format!("fn {test}("), format!("def {test}(")]
                    .iter()
                    .any(|definition| file.contains(definition))
            };
            if !files.iter().any(defined) {
                faults.push(format!("no test `{test}` where it is looked for: {words}"));
            }
        }
    }
    assert!(count > 30, "{count} claims are read");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
