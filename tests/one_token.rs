//! Any one token of a netlist deleted, doubled or replaced: a simulation or a located error comes out, never a panic, never
//! a run without end.
//!
//! The netlists are those of the project and, where `CIRC_CORPUS` names a folder with an `index.csv`, the ones listed there.
//! `TOKEN_CASES` sets the number of random cases; `TOKEN_CASES=all` goes through every token.

use std::fs;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use circ::circuit::{Circuit, Diodes, ElaborateOptions, Tran, elaborate};
use circ::diagnostic::{Diagnostic, Severity, SourceMap};
use circ::integrate::{Method, SimOptions, Values, operating_point, simulate};
use circ::mna::behaviour;
use circ::netlist::{decode, parse};
use circ::settings::Settings;
use proptest::prelude::*;
use proptest::test_runner::{TestError, TestRunner};

/// Rows of a run; the circuit is what matters, not how long it is watched.
const ROWS: f64 = 40.0;
/// Steps of a run.
const STEPS: u64 = 3000;
/// Devices of a circuit that is simulated; larger ones are read only.
const ELEMENTS: usize = 400;
/// No case comes near it, whatever else the machine does: who is here has no end.
const FOREVER: Duration = Duration::from_secs(300);

/// A netlist and its tokens: words, and single characters that are neither letter, digit nor blank.
struct Sample {
    path: PathBuf,
    text: String,
    tokens: Vec<(usize, usize)>,
}

fn samples() -> Vec<Sample> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths: Vec<PathBuf> = fs::read_dir(root.join("netlists"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "cir"))
        .collect();
    paths.push(root.join("tests/data/everything.cir"));
    paths.sort();
    if let Some(corpus) = std::env::var_os("CIRC_CORPUS").map(PathBuf::from) {
        let index = fs::read_to_string(corpus.join("index.csv")).unwrap();
        let files = index
            .lines()
            .skip(1)
            .filter_map(|line| line.split(',').next());
        paths.extend(files.map(|file| corpus.join(file)));
    }
    let sample = |path: PathBuf| {
        let text = decode(&fs::read(&path).unwrap());
        let tokens = tokens(&text);
        Sample { path, text, tokens }
    };
    paths.into_iter().map(sample).collect()
}

/// Where the tokens stand, comment lines left out.
fn tokens(text: &str) -> Vec<(usize, usize)> {
    let mut all = Vec::new();
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        if !line.trim_start().starts_with('*') {
            let mut open: Option<usize> = None;
            for (at, c) in line.char_indices() {
                if c.is_alphanumeric() || matches!(c, '.' | '_') {
                    open.get_or_insert(at);
                    continue;
                }
                all.extend(open.take().map(|from| (start + from, start + at)));
                if !c.is_whitespace() {
                    all.push((start + at, start + at + c.len_utf8()));
                }
            }
            all.extend(open.map(|from| (start + from, start + line.len())));
        }
        start += line.len();
    }
    all
}

/// What replaces a token.
const PIECES: [&str; 24] = [
    "", "0", "-1", "1e-30", "1e30", "1meg", "-1u", "nan", "inf", "(", ")", "{", "}", "=", "'", ",",
    "+", "\n", "\n+", ".end", "uic", "gnd", "list", "{1/0}",
];

#[derive(Debug, Clone, Copy)]
enum Edit {
    Delete,
    Double,
    /// By another token of the same netlist.
    Exchange(usize),
    /// By a piece of text.
    Replace(usize),
}

fn edited(sample: &Sample, token: usize, edit: Edit) -> String {
    let (start, end) = sample.tokens[token];
    let own = &sample.text[start..end];
    let other = match edit {
        Edit::Delete => String::new(),
        Edit::Double => format!("{own} {own}"),
        Edit::Exchange(other) => {
            let (start, end) = sample.tokens[other % sample.tokens.len()];
            sample.text[start..end].to_string()
        }
        Edit::Replace(piece) => PIECES[piece % PIECES.len()].to_string(),
    };
    format!("{}{other}{}", &sample.text[..start], &sample.text[end..])
}

/// What became of a text.
#[derive(Debug, PartialEq, Eq)]
enum Verdict {
    Simulated,
    Refused,
}

fn located(findings: &[Diagnostic]) -> bool {
    let mut errors = findings.iter().filter(|d| d.severity == Severity::Error);
    errors.any(|d| d.span.is_some())
}

/// Reads and simulates a text that stands at `path`.
fn carry_out(path: &Path, text: &str) -> Result<Verdict, String> {
    let mut sources = SourceMap::default();
    let root = sources.add(path.to_string_lossy(), text.to_string());
    let (netlist, mut findings) = parse(&mut sources, root, &|path| fs::read(path));
    let options = ElaborateOptions {
        diodes: Diodes::Ideal,
        ..ElaborateOptions::default()
    };
    let (circuit, more) = elaborate(&netlist, &options);
    findings.extend(more);
    let Some(circuit) = circuit else {
        return if located(&findings) {
            Ok(Verdict::Refused)
        } else {
            Err(format!("refused without a place: {findings:?}"))
        };
    };
    if circuit.elements.len() > ELEMENTS {
        return Ok(Verdict::Refused);
    }
    let behaviour = match behaviour(&circuit) {
        Ok(behaviour) => behaviour,
        Err(faults) if located(&faults) => return Ok(Verdict::Refused),
        Err(faults) => return Err(format!("refused without a place: {faults:?}")),
    };
    let Some(tran) = circuit.tran else {
        let settings = Settings::default();
        return Ok(
            match operating_point(&circuit, Values::Dc, false, &settings) {
                Ok(_) => Verdict::Simulated,
                Err(_) => Verdict::Refused,
            },
        );
    };
    let circuit = Circuit {
        tran: Some(Tran {
            tstop: tran.tstop.min(tran.tstart + ROWS * tran.tstep),
            ..tran
        }),
        ..circuit
    };
    let options = SimOptions {
        method: Method::Auto,
        settings: Settings {
            max_steps: STEPS,
            ..Settings::default()
        },
        ..SimOptions::default()
    };
    match simulate(&circuit, &behaviour, options) {
        Ok(run) if run.waveforms.values.iter().all(|v| v.is_finite()) => Ok(Verdict::Simulated),
        Ok(_) => Err("a value that is not finite".into()),
        Err(_) => Ok(Verdict::Refused),
    }
}

/// The same on a thread of its own, so that a panic and a run without end are found and named.
fn watched(path: &Path, text: &str) -> Result<Verdict, String> {
    let (send, receive) = channel();
    let (path, text) = (path.to_path_buf(), text.to_string());
    thread::spawn(move || {
        let outcome = catch_unwind(|| carry_out(&path, &text));
        let _ = send.send(outcome.unwrap_or_else(|_| Err("a panic".into())));
    });
    match receive.recv_timeout(FOREVER) {
        Ok(outcome) => outcome,
        Err(RecvTimeoutError::Timeout) => Err("no end".into()),
        Err(RecvTimeoutError::Disconnected) => Err("a lost thread".into()),
    }
}

fn judge(sample: &Sample, token: usize, edit: Edit) -> Result<Verdict, String> {
    let text = edited(sample, token, edit);
    watched(&sample.path, &text).map_err(|why| {
        let (start, end) = sample.tokens[token];
        let line = sample.text[..start].matches('\n').count() + 1;
        let own = &sample.text[start..end];
        format!("{}:{line}: `{own}` {edit:?}: {why}", sample.path.display())
    })
}

#[test]
fn one_token_changed() {
    let samples = samples();
    let cases = std::env::var("TOKEN_CASES").unwrap_or_else(|_| "300".into());
    if cases == "all" {
        let mut wrong = Vec::new();
        for sample in &samples {
            for token in 0..sample.tokens.len() {
                for edit in [
                    Edit::Delete,
                    Edit::Double,
                    Edit::Exchange(7 * token + 3),
                    Edit::Replace(token),
                ] {
                    wrong.extend(judge(sample, token, edit).err());
                }
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        return;
    }
    let config = ProptestConfig {
        cases: cases.parse().unwrap(),
        failure_persistence: Some(Box::new(
            proptest::test_runner::FileFailurePersistence::WithSource("regressions"),
        )),
        ..ProptestConfig::default()
    };
    let edit = prop_oneof![
        Just(Edit::Delete),
        Just(Edit::Double),
        any::<usize>().prop_map(Edit::Exchange),
        any::<usize>().prop_map(Edit::Replace),
    ];
    let strategy = (
        any::<prop::sample::Index>(),
        any::<prop::sample::Index>(),
        edit,
    );
    let (mut simulated, mut refused) = (0, 0);
    let outcome = TestRunner::new(config).run(&strategy, |(sample, token, edit)| {
        let sample = sample.get(&samples);
        let token = token.index(sample.tokens.len());
        match judge(sample, token, edit) {
            Ok(_) => Ok(()),
            Err(why) => Err(TestCaseError::fail(why)),
        }
    });
    if let Err(TestError::Fail(why, _)) = outcome {
        panic!("{why}");
    }
    // Both ends are reached: the netlists as they stand, and a fault of each.
    for sample in &samples {
        match judge(sample, 0, Edit::Exchange(0)) {
            Ok(Verdict::Simulated) => simulated += 1,
            Ok(Verdict::Refused) => refused += 1,
            Err(why) => panic!("{why}"),
        }
    }
    assert!(
        simulated > 9 * samples.len() / 10,
        "{simulated} simulated, {refused} refused"
    );
}

/// What the run through every token has found before.
#[test]
fn cases_met() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (file, from, to) in [
        // Time constants of 1e-28 s: the steps are counted inside a print step too.
        ("netlists/sepic.cir", "c1 out 0 100u", "c1 out 0 1e-30"),
        // A coupled inductance below zero.
        (
            "tests/data/everything.cir",
            "L1  sw out 47uH",
            "L1  sw out -1u",
        ),
    ] {
        let path = root.join(file);
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains(from));
        let outcome = watched(&path, &text.replace(from, to));
        assert!(outcome.is_ok(), "{file}: {outcome:?}");
    }
}
