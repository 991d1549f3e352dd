//! Every command of the README and of the tutorials does what it should, in a folder with the netlists.
#![cfg(all(unix, feature = "cli"))]
#![allow(missing_docs, reason = "tests")]

use std::fs;
use std::path::Path;
use std::process::Command;

/// What a command that no test runs says of itself, before the reason.
const MARK: &str = "not in the tests: ";

/// The pages of the project, from its root.
fn pages(root: &Path) -> Vec<String> {
    let mut pages = vec!["README.md".to_owned(), "CONTRIBUTING.md".to_owned()];
    for folder in ["docs", "docs/decisions", "python"] {
        let entries = fs::read_dir(root.join(folder)).expect("a folder");
        let names = entries.map(|entry| entry.expect("an entry").file_name());
        let names = names.map(|name| format!("{folder}/{}", name.to_string_lossy()));
        pages.extend(names.filter(|name| name.ends_with(".md")));
    }
    pages.sort();
    pages
}

/// The commands of a block, those of several lines as one.
fn commands(text: &str) -> Vec<String> {
    let joined = text.replace("\\\n", " ");
    let lines = joined.lines().map(str::trim);
    let lines = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
    lines.map(str::to_owned).collect()
}

/// What a command that no test runs names and does not exist: tests and benches of cargo, scripts and their options.
fn missing(root: &Path, command: &str) -> Vec<String> {
    let command = command.split('#').next().unwrap_or_default();
    let words: Vec<&str> = command.split_whitespace().collect();
    let manifest = fs::read_to_string(root.join("Cargo.toml")).expect("a manifest");
    let (mut missing, mut script) = (Vec::new(), None);
    for (k, word) in words.iter().enumerate() {
        let next = words.get(k + 1).copied().unwrap_or_default();
        let is_there = match *word {
            "--test" => [format!("tests/{next}.rs"), format!("tests/{next}/main.rs")]
                .iter()
                .any(|file| root.join(file).is_file()),
            "--bench" => manifest.contains(&format!("name = \"{next}\"")),
            _ if word.ends_with(".py") => {
                script = fs::read_to_string(root.join(word)).ok();
                script.is_some()
            }
            _ if word.starts_with("--") && word.len() > 2 => script
                .as_ref()
                .is_none_or(|text| text.contains(&format!("\"{word}\""))),
            _ => true,
        };
        if !is_there {
            missing.push(format!("{word} {next}"));
        }
    }
    missing
}

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

/// Commands of blocks marked `sh` run, those that begin with `circ`; netlists marked `title=NAME` stand in the folder. All others say that they are not run and why, and
/// what they name is there.
#[test]
fn every_command_runs_or_says_why_not() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let program = Path::new(env!("CARGO_BIN_EXE_circ"))
        .parent()
        .expect("a folder");
    let path = format!(
        "{}:{}",
        program.display(),
        std::env::var("PATH").unwrap_or_default()
    );
    let (mut faults, mut left_out, mut ran) = (Vec::new(), Vec::new(), Vec::new());
    for page in pages(root) {
        let text = fs::read_to_string(root.join(&page)).expect("a page");
        let folder = tempfile::tempdir().expect("a folder");
        std::os::unix::fs::symlink(root.join("netlists"), folder.path().join("netlists"))
            .expect("a link");
        let mut count = 0;
        for (mark, text) in blocks(&text) {
            if let Some((_, name)) = mark.split_once("title=") {
                fs::write(folder.path().join(name), text).expect("a netlist");
                continue;
            }
            if mark != "sh" {
                continue;
            }
            for command in commands(&text) {
                if !command.starts_with("circ ") {
                    match command.split_once(MARK) {
                        Some((_, why)) => left_out.push(format!("{page}: {why}")),
                        None => faults.push(format!(
                            "{page}: {command}: is not run, and does not say `# {MARK}…`"
                        )),
                    }
                    let missing = missing(root, &command);
                    faults.extend(
                        missing
                            .iter()
                            .map(|what| format!("{page}: {command}: there is no {what}")),
                    );
                    continue;
                }
                count += 1;
                let ran = Command::new("sh")
                    .args(["-c", &command])
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
        if count > 0 {
            ran.push(page);
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    insta::assert_snapshot!(
        "commands",
        format!(
            "run:\n{}\n\nleft out:\n{}",
            ran.join("\n"),
            left_out.join("\n")
        )
    );
}

#[test]
fn commands_are_read_and_what_they_name_is_looked_for() {
    let text =
        "# a word\nA=1 \\\n    cargo test --test documents   # not in the tests: b\ncirc c\n";
    let found = commands(text);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[0].starts_with("A=1 ") && found[0].ends_with("not in the tests: b"));
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let all = |command: &str| missing(root, command).len();
    assert_eq!(all(&found[0]), 0);
    assert_eq!(all("cargo test --test nowhere"), 1);
    assert_eq!(all("cargo bench --bench large"), 0);
    assert_eq!(all("cargo bench --bench larger"), 1);
    assert_eq!(all("python3 tests/reference/corpus.py F --circ c"), 0);
    assert_eq!(all("python3 tests/reference/corpus.py F --cirq c"), 1);
    assert_eq!(all("tests/reference/nowhere.py"), 1);
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
