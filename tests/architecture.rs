//! Who may import whom: the rooms of docs/architecture.md, checked on the source text.
#![allow(missing_docs, reason = "tests")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Each room and the rooms it may import, in the order in which data flows.
const ROOMS: [(&str, &[&str]); 21] = [
    ("settings", &[]),
    ("algebra", &["settings"]),
    ("linalg", &["settings"]),
    ("diagnostic", &[]),
    ("law", &["algebra", "settings"]),
    ("measure", &["linalg", "settings"]),
    ("netlist", &["algebra", "diagnostic", "measure"]),
    (
        "circuit",
        &[
            "algebra",
            "diagnostic",
            "law",
            "measure",
            "netlist",
            "settings",
        ],
    ),
    (
        "mna",
        &["algebra", "circuit", "diagnostic", "law", "settings"],
    ),
    (
        "lcs",
        &[
            "algebra",
            "circuit",
            "diagnostic",
            "law",
            "linalg",
            "mna",
            "settings",
        ],
    ),
    ("solve", &["law", "linalg", "settings"]),
    ("waveform", &["settings"]),
    ("plan", &["lcs", "settings", "solve"]),
    (
        "integrate",
        &[
            "circuit",
            "diagnostic",
            "law",
            "lcs",
            "linalg",
            "mna",
            "plan",
            "settings",
            "solve",
            "waveform",
        ],
    ),
    (
        "model",
        &[
            "circuit",
            "diagnostic",
            "integrate",
            "lcs",
            "mna",
            "netlist",
            "settings",
        ],
    ),
    (
        "analysis",
        &[
            "algebra",
            "circuit",
            "integrate",
            "lcs",
            "linalg",
            "measure",
            "mna",
            "model",
            "settings",
            "waveform",
        ],
    ),
    ("passivity", &["lcs", "linalg", "settings"]),
    (
        "check",
        &[
            "circuit",
            "diagnostic",
            "law",
            "lcs",
            "mna",
            "passivity",
            "settings",
            "solve",
        ],
    ),
    (
        "forms",
        &["check", "lcs", "netlist", "passivity", "settings", "solve"],
    ),
    (
        "report",
        &[
            "analysis",
            "check",
            "circuit",
            "diagnostic",
            "integrate",
            "law",
            "lcs",
            "measure",
            "model",
            "netlist",
            "waveform",
        ],
    ),
    (
        "cli",
        &[
            "algebra",
            "analysis",
            "check",
            "circuit",
            "diagnostic",
            "forms",
            "integrate",
            "law",
            "lcs",
            "mna",
            "model",
            "netlist",
            "passivity",
            "plan",
            "report",
            "settings",
            "solve",
            "waveform",
        ],
    ),
];

/// Imports against the flow: (beginning of the path, room, why).
const EXCEPTIONS: [(&str, &str, &str); 3] = [
    (
        "netlist/mod.rs",
        "circuit",
        "re-exports `load`, which reads a file and elaborates it",
    ),
    (
        "mna/",
        "lcs",
        "ports and inputs pass through unchanged; a system file becomes a behaviour again",
    ),
    (
        "plan.rs",
        "integrate",
        "plans read the options they are made from",
    ),
];

/// What only certain files may name: (text, allowed beginnings of paths, why).
const CONFINED: [(&str, &[&str], &str); 6] = [
    ("nom::", &["netlist/"], "text is parsed in one room"),
    ("clap::", &["cli/"], "arguments belong to the command line"),
    (
        "miette::",
        &["cli/"],
        "findings are data; the command line renders them",
    ),
    (
        "clarabel::",
        &["solve/", "passivity/", "check/"],
        "one place a conic solver is called from each kind of problem",
    ),
    (
        "std::process",
        &["main.rs", "cli/"],
        "the library runs no programs",
    ),
    (
        "std::fs",
        &["cli/", "circuit/load.rs"],
        "the library opens no files but netlists",
    ),
];

/// Constants of type f64 that decide nothing, outside `settings/tolerances/`: (file, names, why).
const NO_TOLERANCES: [(&str, &[&str], &str); 27] = [
    (
        "analysis/variation/costate.rs",
        &["POWERS"],
        "of the nodes of a quadrature",
    ),
    (
        "algebra/ball.rs",
        &["EXACT_INTEGERS", "UP"],
        "bounds of the arithmetic of doubles",
    ),
    (
        "algebra/double.rs",
        &["ROUNDING", "SPLITTER"],
        "bounds of the arithmetic of doubles",
    ),
    (
        "algebra/long.rs",
        &["ROUNDING"],
        "a bound of the arithmetic of its numbers",
    ),
    (
        "analysis/variation/moved.rs",
        &["ROOM"],
        "the room that moves have",
    ),
    (
        "analysis/variation/near.rs",
        &["STEPS", "WEIGHTS"],
        "a formula of differences",
    ),
    ("circuit/bipolar.rs", &["RATED"], DEFAULT),
    ("circuit/drive.rs", &["STARTUP"], DEFAULT),
    ("circuit/passive.rs", &["PERCENT"], "how TCE is defined"),
    ("circuit/scope.rs", &["NOMINAL"], DEFAULT),
    (
        "circuit/held.rs",
        &["BETWEEN", "OFF", "ON"],
        "the values of a control that is set by hand",
    ),
    ("circuit/line.rs", &["QUARTER"], DEFAULT),
    (
        "circuit/measurement.rs",
        &["MAX_HARMONICS"],
        "the most that is read",
    ),
    (
        "circuit/model.rs",
        &["LEVELS"],
        "numbers of models in other programs",
    ),
    ("circuit/thyristor.rs", &["JUNCTIONS"], DEFAULT),
    (
        "circuit/transistor.rs",
        &["JUNCTION", "OXIDE", "SIDE"],
        DEFAULT,
    ),
    ("circuit/transistor/drive.rs", &["DRIVE"], DEFAULT),
    ("forms/nonlinear.rs", &["GAUSS"], "a quadrature"),
    (
        "integrate/curved/tableau.rs",
        &[
            "EMBEDDED", "ERROR", "GAMMA", "LOWER", "NODES", "STRAY", "WEIGHTS",
        ],
        "a tableau",
    ),
    (
        "integrate/theta/stages.rs",
        &["B1", "B2", "GAMMA"],
        "a tableau",
    ),
    ("law/exponential.rs", &["BOLTZMANN"], "physics"),
    ("linalg/eigenvalues.rs", &["SHIFT"], "a known shift"),
    (
        "linalg/powers.rs",
        &["LEVEL"],
        "a number that is rounded to a power of two",
    ),
    (
        "linalg/expm.rs",
        &["LAST", "PAIRS"],
        "poles of an approximant",
    ),
    ("linalg/gauss.rs", &["NODES", "WEIGHTS"], "a quadrature"),
    (
        "measure/curve.rs",
        &[
            "AT_NODES",
            "BARYCENTRIC",
            "COTES",
            "COTES_SUM",
            "PRODUCT",
            "SLOPES",
        ],
        "a polynomial and its quadrature",
    ),
    (
        "netlist/card/controlled.rs",
        &["MAX_POLY"],
        "the most that is read",
    ),
];
const DEFAULT: &str = "what a card means that does not say it";

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// (path below src, text without comments and tests) of every source file that is not a test.
fn files() -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut folders = vec![source()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path
                .file_name()
                .expect("a name")
                .to_string_lossy()
                .into_owned();
            let is_test = name == "tests"
                || name == "tests.rs"
                || name == "fixtures.rs"
                || name == "snapshots";
            if is_test {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let below = path.strip_prefix(source()).expect("below src");
                let text = std::fs::read_to_string(&path).expect("a source file");
                found.push((below.to_string_lossy().replace('\\', "/"), code(&text)));
            }
        }
    }
    found.sort();
    found
}

/// Without comments and without the module of tests that closes a file.
fn code(text: &str) -> String {
    let end = text
        .find("\n#[cfg(test)]\nmod tests {")
        .or_else(|| text.find("\n#[cfg(test)]\npub(crate) mod tests {"));
    let lines = text[..end.unwrap_or(text.len())].lines();
    lines
        .map(|line| line.split("//").next().unwrap_or(""))
        .collect::<Vec<_>>()
        .join("\n")
}

/// The rooms a text names as `crate::room` or `crate::{room, …}`.
fn imports(text: &str) -> BTreeSet<String> {
    let mut rooms = BTreeSet::new();
    for (at, _) in text.match_indices("crate::") {
        let rest = &text[at + "crate::".len()..];
        let Some(group) = rest.strip_prefix('{') else {
            rooms.insert(identifier(rest));
            continue;
        };
        let mut depth = 0;
        let mut start = true;
        for (k, c) in group.char_indices() {
            match c {
                '}' if depth == 0 => break,
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 0 => start = true,
                c if start && c.is_alphabetic() => {
                    rooms.insert(identifier(&group[k..]));
                    start = false;
                }
                _ => {}
            }
        }
    }
    rooms
}

fn identifier(text: &str) -> String {
    text.chars()
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect()
}

fn room(path: &str) -> String {
    identifier(path)
}

#[test]
fn imports_follow_the_flow_of_data() {
    let allowed: BTreeMap<&str, &[&str]> = ROOMS.into_iter().collect();
    let mut faults = Vec::new();
    let mut used = BTreeSet::new();
    for (path, text) in files() {
        let from = room(&path);
        if from == "lib" || from == "main" {
            continue;
        }
        let Some(allowed) = allowed.get(from.as_str()) else {
            faults.push(format!("{path}: the room `{from}` is not in the plan"));
            continue;
        };
        for to in imports(&text)
            .into_iter()
            .filter(|to| *to != from && !allowed.contains(&to.as_str()))
        {
            match EXCEPTIONS
                .iter()
                .position(|e| path.starts_with(e.0) && e.1 == to)
            {
                Some(k) => {
                    used.insert(k);
                }
                None => faults.push(format!("{path} imports {to}")),
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert_eq!(
        used.len(),
        EXCEPTIONS.len(),
        "an exception is no longer needed"
    );
}

#[test]
fn the_plan_itself_has_no_back_edges() {
    for (k, (room, imports)) in ROOMS.iter().enumerate() {
        for import in *imports {
            let j = ROOMS.iter().position(|r| r.0 == *import);
            assert!(
                j.is_some_and(|j| j < k),
                "{room} imports {import}, which stands after it"
            );
        }
    }
}

/// By file of the exact integrator: the files beside it that it names as `super::file`.
fn exact_files() -> BTreeMap<String, BTreeSet<String>> {
    let texts: Vec<(String, String)> = files()
        .into_iter()
        .filter_map(|(path, text)| {
            let name = path.strip_prefix("integrate/exact/")?.strip_suffix(".rs")?;
            (!name.contains('/') && name != "mod").then(|| (name.to_string(), text))
        })
        .collect();
    let names: BTreeSet<&String> = texts.iter().map(|(name, _)| name).collect();
    let named = |text: &str| {
        let named = text.match_indices("super::");
        let named = named.map(|(at, _)| identifier(&text[at + "super::".len()..]));
        named.filter(|name| names.contains(name)).collect()
    };
    texts
        .iter()
        .map(|(name, text)| (name.clone(), named(text)))
        .collect()
}

#[test]
fn files_of_the_exact_integrator_import_in_one_direction() {
    let mut left = exact_files();
    assert!(left.len() > 20, "the files are found");
    while let Some(free) = left
        .iter()
        .find(|(name, named)| named.iter().all(|n| n == *name || !left.contains_key(n)))
    {
        let free = free.0.clone();
        left.remove(&free);
    }
    assert!(left.is_empty(), "in or behind a circle: {:?}", left.keys());
}

#[test]
fn matrices_and_spice_stay_in_their_rooms() {
    for (path, text) in files() {
        if ["netlist", "circuit"].contains(&room(&path).as_str()) {
            assert!(
                !text.contains("nalgebra"),
                "{path}: text and circuits know no matrices"
            );
        }
        for (name, allowed, why) in CONFINED {
            if text.contains(name) {
                assert!(
                    allowed.iter().any(|a| path.starts_with(a)),
                    "{path} names {name}: {why}"
                );
            }
        }
    }
}

/// Names of the constants with an f64 in their type.
fn float_constants(text: &str) -> Vec<String> {
    let declared = text.match_indices("const ").filter_map(|(at, word)| {
        let (name, rest) = text[at + word.len()..].split_once(':')?;
        let kind = rest.split('=').next()?;
        let is_parameter = text[..at].ends_with('<');
        let is_name = !name.is_empty() && name == identifier(name) && !is_parameter;
        (is_name && kind.contains("f64") && !kind.contains("fn")).then(|| name.to_string())
    });
    declared.collect()
}

/// Literals below one in scientific notation, as tolerances are written.
fn small_literals(text: &str) -> Vec<String> {
    let words = text.split(|c: char| !(c.is_alphanumeric() || "._-".contains(c)));
    let small = words.filter(|word| {
        let (digits, exponent) = word.split_once("e-").unwrap_or_default();
        let is_number = |text: &str| text.starts_with(|c: char| c.is_ascii_digit());
        is_number(digits) && is_number(exponent)
    });
    small.map(str::to_owned).collect()
}

#[test]
fn what_decides_something_stands_among_the_tolerances() {
    let mut faults = Vec::new();
    let mut found = BTreeMap::<String, BTreeSet<String>>::new();
    for (path, text) in files() {
        // Figures, tables and the command line decide what is shown.
        if ["settings", "cli", "report"].contains(&room(&path).as_str()) {
            continue;
        }
        let listed = NO_TOLERANCES.iter().find(|n| n.0 == path);
        let listed = listed.map_or(&[][..], |n| n.1);
        for name in float_constants(&text) {
            if listed.contains(&name.as_str()) {
                found.entry(path.clone()).or_default().insert(name);
            } else {
                faults.push(format!("{path}: {name}"));
            }
        }
        // Defaults of model parameters, the sizes at which numbers are written with an exponent, netlists that are examples.
        let is_text = path.starts_with("circuit/")
            || path.starts_with("diagnostic/explain/")
            || path == "lcs/format.rs";
        if !is_text && listed.is_empty() && path != "lcs/json/read.rs" {
            faults.extend(
                small_literals(&text)
                    .into_iter()
                    .map(|l| format!("{path}: {l}")),
            );
        }
    }
    let advice = "belongs into settings/tolerances/, or into the list of what decides nothing";
    assert!(faults.is_empty(), "{advice}:\n{}", faults.join("\n"));
    for (path, names, _) in NO_TOLERANCES {
        let names: BTreeSet<String> = names.iter().map(|n| (*n).to_string()).collect();
        assert_eq!(
            found.get(path),
            Some(&names),
            "{path} no longer has one of these"
        );
    }
}

#[test]
fn every_tolerance_has_its_reason_and_its_use() {
    let folder = source().join("settings/tolerances");
    let rest: String = files().into_iter().map(|(_, text)| text).collect();
    let mut names = BTreeSet::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let text = std::fs::read_to_string(entry.expect("an entry").path()).expect("a file");
        let lines: Vec<&str> = text.lines().collect();
        for (k, line) in lines.iter().enumerate() {
            let Some(declared) = line.strip_prefix("pub(crate) const ") else {
                continue;
            };
            let name = identifier(declared);
            assert!(
                k > 0 && lines[k - 1].starts_with("///"),
                "{name} without a reason"
            );
            assert!(rest.matches(&name).count() > 1, "{name} is not used");
            assert!(
                names.insert(name.clone()),
                "two tolerances are called {name}"
            );
        }
    }
    assert!(names.len() > 100, "the tolerances are found");
}

#[test]
fn constants_and_literals_are_read() {
    let text = "const A: f64 = 1e-9;\n  pub(crate) const B: [f64; 2] = [2.0, 3e-4];\nconst N: usize = 3;\nconst fn f(x: f64) {}\nfn g<const P: usize>(s: [f64; P]) {}";
    assert_eq!(float_constants(text), ["A", "B"]);
    assert_eq!(small_literals(text), ["1e-9", "3e-4"]);
}

#[test]
fn groups_of_imports_are_read() {
    let text =
        "use crate::{lcs::{Lcs, reduce}, mna};\nlet x = crate::settings::Settings::default();";
    let expected: BTreeSet<String> = ["lcs", "mna", "settings"].map(str::to_owned).into();
    assert_eq!(imports(text), expected);
    assert!(
        code("a\n// crate::cli\nb").lines().count() == 3
            && imports("// \ncrate::algebra::x").contains("algebra")
    );
    assert!(imports(&code("// crate::cli")).is_empty());
}

#[test]
fn the_rooms_are_those_of_the_library() {
    let lib = std::fs::read_to_string(source().join("lib.rs")).expect("lib.rs");
    let declared: BTreeSet<&str> = lib
        .lines()
        .filter_map(|line| {
            let line = line.strip_prefix("pub ").unwrap_or(line);
            line.strip_prefix("mod ")?.strip_suffix(';')
        })
        .collect();
    let planned: BTreeSet<&str> = ROOMS.iter().map(|r| r.0).collect();
    assert_eq!(declared, planned);
    let drawn =
        std::fs::read_to_string(source().join("../docs/architecture.md")).expect("architecture.md");
    for room in planned {
        assert!(
            drawn.contains(&format!("`{room}`")),
            "docs/architecture.md does not mention `{room}`"
        );
    }
}

#[test]
fn every_page_of_the_documentation_is_in_the_book() {
    let docs = source().join("../docs");
    let summary = std::fs::read_to_string(docs.join("book/SUMMARY.md")).expect("SUMMARY.md");
    for folder in ["docs", "docs/decisions"] {
        for entry in std::fs::read_dir(source().join("..").join(folder)).expect("a folder") {
            let name = entry.expect("an entry").file_name();
            let page = format!("{folder}/{}", name.to_string_lossy());
            let is_listed = summary.contains(&format!("]({page})"));
            assert!(
                is_listed || !page.ends_with(".md"),
                "{page} is not in docs/book/SUMMARY.md"
            );
        }
    }
}
