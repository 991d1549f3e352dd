//! Any bytes, and any netlist with a few tokens scrambled, are read without panic or hang.
//!
//! `FUZZ_CASES` sets the number of cases.

use std::io;

use circ::circuit::{Diodes, ElaborateOptions, elaborate};
use circ::diagnostic::{Diagnostic, SourceMap};
use circ::netlist::{decode, parse};
use proptest::prelude::*;

const EVERYTHING: &str = include_str!("data/everything.cir");
/// With the devices that the first one lacks.
const OTHERS: [&str; 5] = [
    include_str!("data/rectifier.cir"),
    include_str!("../netlists/triac-dimmer.cir"),
    include_str!("../netlists/scr-commutation.cir"),
    include_str!("../netlists/line-rectifier.cir"),
    include_str!("../netlists/common-emitter.cir"),
];

/// Lines of schematics.
const SHEETS: [&str; 16] = [
    "WIRE 0 16 96 16",
    "WIRE 96 16 96 96",
    "WIRE 0 0 80 80",
    "FLAG 0 16 in",
    "FLAG 96 96 0",
    "IOPIN 0 16 In",
    "SYMBOL res 0 0 R0",
    "SYMBOL voltage 96 0 M90",
    "SYMBOL Digital\\\\dflop 96 0 R270",
    "SYMBOL nmos 0 16 M180",
    "SYMATTR InstName R1",
    "SYMATTR Value 10k tol=1% µ",
    "SYMATTR SpiceLine Rser=1",
    "SYMATTR Prefix X",
    "TEXT 0 0 Left 2 !.tran 1m\\n+ uic\\n.param a=1",
    "SYMATTR SpiceModel self.lib",
];

/// Reads a text as a netlist that includes itself as `self.cir`; every finding points into a file.
fn read(bytes: &[u8]) {
    let mut sources = SourceMap::default();
    let root = sources.add("root.cir", decode(bytes));
    let loader = |path: &std::path::Path| {
        if path.ends_with("self.cir") {
            Ok(bytes.to_vec())
        } else {
            Err(io::ErrorKind::NotFound.into())
        }
    };
    let (netlist, findings) = parse(&mut sources, root, &loader);
    check(&findings, &sources);
    for diodes in [Diodes::Auto, Diodes::Ideal] {
        let options = ElaborateOptions {
            diodes,
            ..ElaborateOptions::default()
        };
        let (circuit, findings) = elaborate(&netlist, &options);
        check(&findings, &sources);
        let Some(circuit) = circuit else { continue };
        assert!(
            circuit
                .elements
                .iter()
                .all(|e| e.p.index() < circuit.nodes.len() && e.n.index() < circuit.nodes.len())
        );
        assert!(
            circuit
                .tran
                .is_none_or(|t| t.tstop > t.tstart && t.tstep > 0.0)
        );
    }
}

fn check(findings: &[Diagnostic], sources: &SourceMap) {
    for finding in findings {
        let Some(span) = finding.span else { continue };
        let text = &sources.files[span.file.0 as usize].text;
        assert!(span.start <= span.end, "{finding:?}");
        assert!(
            text.get(span.start..span.end).is_some(),
            "{finding:?} in {} bytes",
            text.len()
        );
    }
}

/// Words, numbers and single characters.
fn tokens(text: &str) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for c in text.chars() {
        match all.last_mut() {
            Some(last) if c.is_alphanumeric() && last.ends_with(char::is_alphanumeric) => {
                last.push(c)
            }
            _ => all.push(c.to_string()),
        }
    }
    all
}

/// Pieces that are likely to confuse.
const PIECES: [&str; 40] = [
    "(",
    ")",
    "{",
    "}",
    "'",
    "\"",
    ",",
    "=",
    "+",
    "-",
    "*",
    "/",
    "^",
    "?",
    ":",
    ";",
    "$ ",
    "//",
    "\n",
    "\n+",
    "\n.ends\n",
    "\n.subckt a 1 2\n",
    "\n.if (1)\n",
    "\n.else\n",
    "\n.endif\n",
    "\n.include self.cir\n",
    "\n.lib self.cir tt\n",
    "\n.control\n",
    "\n.endl\n",
    "1e400",
    "1e-400",
    "-0",
    "4k7",
    "µ",
    "poly(2)",
    "pwl",
    "repeat",
    "params:",
    "inf",
    "x1",
];

#[derive(Debug, Clone)]
enum Edit {
    Delete(usize),
    Double(usize),
    Swap(usize, usize),
    Put(usize, usize),
    Cut(usize),
}

fn edits() -> impl Strategy<Value = Vec<Edit>> {
    let any = any::<usize>;
    let edit = prop_oneof![
        any().prop_map(Edit::Delete),
        any().prop_map(Edit::Double),
        (any(), any()).prop_map(|(a, b)| Edit::Swap(a, b)),
        (any(), any()).prop_map(|(a, b)| Edit::Put(a, b)),
        any().prop_map(Edit::Cut),
    ];
    prop::collection::vec(edit, 1..6)
}

fn apply(text: &str, edits: &[Edit]) -> String {
    let mut tokens = tokens(text);
    for edit in edits {
        let n = tokens.len().max(1);
        if tokens.is_empty() {
            break;
        }
        match *edit {
            Edit::Delete(a) => drop(tokens.remove(a % n)),
            Edit::Double(a) => tokens.insert(a % n, tokens[a % n].clone()),
            Edit::Swap(a, b) => tokens.swap(a % n, b % n),
            Edit::Put(a, b) => tokens.insert(a % n, PIECES[b % PIECES.len()].into()),
            Edit::Cut(a) => tokens.truncate(n - a % 20_usize.min(n)),
        }
    }
    tokens.concat()
}

fn cases() -> ProptestConfig {
    let cases = std::env::var("FUZZ_CASES")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(500);
    ProptestConfig {
        cases,
        failure_persistence: Some(Box::new(
            proptest::test_runner::FileFailurePersistence::WithSource("regressions"),
        )),
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        read(&bytes);
    }

    #[test]
    fn any_text_of_netlist_characters(text in r"[-+*/(){}',=.;$\n a-eA-Z0-9µ]{0,200}") {
        read(format!("t\n{text}").as_bytes());
    }

    #[test]
    fn any_pieces(picks in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 0..40)) {
        let words = tokens(EVERYTHING);
        let text: String = picks.iter().flat_map(|(a, b)| [words[a.index(words.len())].as_str(), " ", PIECES[b.index(PIECES.len())]]).collect();
        read(format!("t\nR1 {text}").as_bytes());
        read(text.as_bytes());
    }

    #[test]
    fn any_sheet(lines in prop::collection::vec((0..SHEETS.len(), any::<prop::sample::Index>(), any::<prop::sample::Index>(), any::<i16>()), 0..60)) {
        // Lines of schematics, in part with others' words or numbers.
        let mut text = String::from("Version 4\nSHEET 1 880 680\n");
        for (kind, word, other, number) in lines {
            let words: Vec<&str> = SHEETS[kind].split(' ').collect();
            let others: Vec<&str> = SHEETS[other.index(SHEETS.len())].split(' ').collect();
            let swapped = word.index(2 * words.len());
            for (k, own) in words.iter().enumerate() {
                match k == swapped {
                    false => text += own,
                    true if number % 3 == 0 => text += &number.to_string(),
                    true => text += others[word.index(others.len())],
                }
                text += " ";
            }
            text += "\n";
        }
        read(text.as_bytes());
    }

    #[test]
    fn scrambled_netlists(edits in edits(), other in 0..OTHERS.len()) {
        read(apply(EVERYTHING, &edits).as_bytes());
        read(apply(OTHERS[other], &edits).as_bytes());
    }
}

#[test]
fn blowups_are_refused() {
    let mut doubling = String::from("t\nV1 a 0 1\nX1 a 0 s40\n.subckt s0 p n\nR1 p n 1\n.ends\n");
    for k in 1..=40 {
        doubling += &format!(
            ".subckt s{k} p n\nX1 p n s{}\nX2 p n s{}\n.ends\n",
            k - 1,
            k - 1
        );
    }
    let mut functions = String::from("t\nV1 a 0 {f40(1)}\n.func f0(x) {x}\n");
    for k in 1..=40 {
        functions += &format!(".func f{k}(x) {{f{}(x)+f{}(x)}}\n", k - 1, k - 1);
    }
    let mut chain = String::from("t\nV1 a 0 {p0}\n");
    for k in 0..5000 {
        chain += &format!(".param p{k}={{p{}}}\n", k + 1);
    }
    let sum = format!("t\nR1 a 0 {{{}}}\n", vec!["1"; 400].join("+"));
    let nested = format!("t\n{}", ".if (1)\n.subckt a b\n".repeat(10_000));
    let deep = format!("t\nR1 a 0 {{{}}}\n", "(".repeat(100_000));
    for text in [doubling, functions, chain, sum, nested, deep] {
        read(text.as_bytes());
    }
}
