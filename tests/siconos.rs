//! Systems as scripts for Siconos, and Siconos's answers where one is there: `CIRC_SICONOS` names a Python with it.
#![allow(missing_docs, reason = "tests")]
#![expect(clippy::print_stderr, reason = "a skipped test must be visible")]

use std::env;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

const CLIPPER: &str = "\
clipper
v1 in 0 sin(0 5 1k)
i1 0 out pulse(0 1m 0.2m 0 0.1m 0.3m)
v2 bias 0 pwl(0 1 1m 2)
r1 in out 1k
c1 out 0 100n
d1 out bias ideal
.model ideal d(ideal)
.tran 10u 2m
.save v(out) i(d1)
.end
";

fn run(program: &str, arguments: &[&str], directory: &Path) -> (bool, String, String) {
    let output = Command::new(program)
        .args(arguments)
        .current_dir(directory)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (
        output.status.success(),
        text(output.stdout),
        text(output.stderr),
    )
}

fn circ(arguments: &[&str], directory: &Path) -> (bool, String, String) {
    run(env!("CARGO_BIN_EXE_circ"), arguments, directory)
}

#[test]
fn the_script_has_the_system_and_its_sources() {
    let place = tempfile::tempdir().unwrap();
    fs::write(place.path().join("clipper.cir"), CLIPPER).unwrap();
    let (done, script, err) = circ(&["lcs", "clipper.cir", "--format", "siconos"], place.path());
    assert!(done, "{err}");
    insta::assert_snapshot!("siconos", script);
}

#[test]
fn what_siconos_cannot_hold_is_refused() {
    let place = tempfile::tempdir().unwrap();
    for (from, to, told) in [
        ("d(ideal)", "d(ron=1 vfwd=0.7)", "the law of `d1`"),
        ("d1 out bias ideal", "", "1 states and 0 ports"),
        ("c1 out 0 100n", "", "0 states and 1 ports"),
        (".tran 10u 2m", "", "there is no `.tran`"),
        ("sin(0 5 1k)", "exp(0 5 0 1m)", "the source `v1`"),
    ] {
        fs::write(place.path().join("a.cir"), CLIPPER.replace(from, to)).unwrap();
        let (done, _, err) = circ(&["lcs", "a.cir", "--format", "siconos"], place.path());
        assert!(!done && err.contains(told), "{to}: {err}");
    }
}

/// Names and rows.
fn rows(csv: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut reader = csv::ReaderBuilder::new().from_reader(csv.as_bytes());
    let names = reader
        .headers()
        .unwrap()
        .iter()
        .map(str::to_string)
        .collect();
    let number = |cell: &str| cell.parse::<f64>().unwrap();
    let rows = reader
        .records()
        .map(|row| row.unwrap().iter().map(number).collect());
    (names, rows.collect())
}

/// Siconos's own Lemke solver finds what implicit Euler finds here, at every step.
#[test]
fn siconos_finds_the_same() {
    let Ok(python) = env::var("CIRC_SICONOS") else {
        eprintln!("CIRC_SICONOS is not set: Siconos is left out");
        return;
    };
    let place = tempfile::tempdir().unwrap();
    let netlists = Path::new(env!("CARGO_MANIFEST_DIR")).join("netlists");
    // What is a function of the states and sources: λ is not unique everywhere, and impulses are densities of the step.
    for (name, signals) in [
        ("clipper", "v(out)"),
        ("bridge-resistor", "v(1) i(l1) v(2,3)"),
        ("bt-fig-2-1", "v(a,b) v(in)"),
        ("bt-fig-2-2-steps", "i(l1)"),
        ("capacitor-loop", "v(a)"),
        ("inductor-cut-set", "i(l1) i(l2) i(l3)"),
        ("jump-clamp", "i(l1)"),
        ("peak-detector", "v(in) v(out)"),
        ("rlcd", "v(1) i(l1)"),
        ("rr7158-eq-38", "v(2,3)"),
        ("voltage-doubler", "v(p) v(n)"),
    ] {
        let text = match name {
            "clipper" => CLIPPER.to_string(),
            name => fs::read_to_string(netlists.join(name).with_extension("cir")).unwrap(),
        };
        fs::write(place.path().join("a.cir"), text).unwrap();
        for (format, to) in [("siconos", "a.py"), ("json", "a.json")] {
            let arguments = [
                "lcs", "a.cir", "--diodes", "ideal", "--format", format, "-o", to,
            ];
            let (done, _, err) = circ(&arguments, place.path());
            assert!(done, "{name}: {err}");
        }
        let script = fs::read_to_string(place.path().join("a.py")).unwrap();
        let step = script
            .split("theta = ")
            .nth(1)
            .and_then(|rest| rest.split(',').next());
        let (done, theirs, err) = run(&python, &["a.py"], place.path());
        assert!(done, "{name}: {err}");
        let arguments = [
            "sim",
            "a.json",
            "--method",
            "euler",
            "--step",
            step.unwrap(),
            "-o",
            "-",
        ];
        let (done, ours, err) = circ(&arguments, place.path());
        assert!(done, "{name}: {err}");
        let ((names, theirs), (known, ours)) = (rows(&theirs), rows(&ours));
        assert_eq!(theirs.len() + 1, ours.len(), "{name}");
        for signal in signals.split(' ') {
            let column = |names: &[String]| names.iter().position(|n| n == signal);
            let (k, j) = (column(&names).unwrap(), column(&known).unwrap());
            for (theirs, ours) in theirs.iter().zip(&ours[1..]) {
                let far = (theirs[k] - ours[j]).abs();
                assert!(
                    far <= 1e-9 * (1.0 + ours[j].abs()),
                    "{name}, {signal}, t = {}: {far}",
                    ours[0]
                );
            }
        }
    }
}
