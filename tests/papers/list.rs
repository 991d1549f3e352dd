//! docs/theory.md names tests that exist, and every test of the papers has its row.

use std::path::{Path, PathBuf};

/// Names after `fn ` under a folder, with the lines before them: (is a test, name).
fn functions(folder: &Path, found: &mut Vec<(bool, String)>) {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut paths: Vec<PathBuf> = entries.map(|e| e.expect("an entry").path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            functions(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            let text = std::fs::read_to_string(&path).expect("a source file");
            let lines: Vec<&str> = text.lines().map(str::trim).collect();
            for (k, line) in lines.iter().enumerate() {
                if let Some(rest) = line.strip_prefix("fn ") {
                    let name = rest.split('(').next().unwrap_or_default();
                    found.push((k > 0 && lines[k - 1] == "#[test]", name.into()));
                }
            }
        }
    }
}

#[test]
fn every_row_names_a_test_and_every_test_has_a_row() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let list = std::fs::read_to_string(root.join("docs/theory.md")).expect("the list");
    let rows = list.lines().filter(|l| l.matches(" | ").count() >= 3);
    let names: Vec<&str> = rows
        .filter_map(|row| row.trim_end_matches(" |").rsplit(" | ").next())
        .flat_map(|tests| tests.split('`').skip(1).step_by(2))
        .filter_map(|path| path.strip_suffix('…')?.rsplit("::").next())
        .collect();
    assert!(names.len() > 90, "{}", names.len());
    let (mut papers, mut all) = (Vec::new(), Vec::new());
    functions(&root.join("tests/papers"), &mut papers);
    functions(&root.join("src"), &mut all);
    all.extend(papers.clone());
    for name in &names {
        let exists = |(is_test, test): &(bool, String)| *is_test && test.starts_with(name);
        assert!(all.iter().any(exists), "no test {name}…");
    }
    let own = "every_row_names_a_test_and_every_test_has_a_row";
    for (_, test) in papers
        .iter()
        .filter(|(is_test, test)| *is_test && test != own)
    {
        let named = |name: &&str| !name.is_empty() && test.starts_with(*name);
        let assumptions = test.starts_with("assumption") || test.starts_with("without_assumption");
        assert!(assumptions || names.iter().any(named), "no row for {test}");
    }
}
