//! `circ sweep`, random functions and tolerances: what is drawn, that it is drawn again, and what becomes of failures.
#![allow(missing_docs, reason = "tests")]

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::ops::ControlFlow;
use std::path::Path;
use std::process::{Command, Stdio};

use circ::analysis::{Row, SweepOptions, Variant, samples, steps, sweep, variants};
use circ::circuit::{ElaborateOptions, Spread, Tolerance};
use circ::{Model, diagnostic::Diagnostic};

/// A voltage that is drawn, as a measurement sees it.
fn drawn(expression: &str, parameters: &str) -> String {
    format!(
        "t\n{parameters}\nv1 a 0 {{{expression}}}\nr1 a 0 1k\n.tran 1m 2m\n.meas tran v find v(a) at=1m\n.end\n"
    )
}

fn parsed(text: &str) -> Model {
    Model::parse(text, "t.cir").expect("a circuit")
}

fn rows(variants: &[Variant<'_>]) -> Vec<Row> {
    let mut rows = vec![];
    let take = |row| {
        rows.push(row);
        ControlFlow::Continue(())
    };
    sweep(variants, &SweepOptions::default(), take).expect("a sweep");
    rows
}

fn values(text: &str, count: u64) -> Vec<f64> {
    let model = parsed(text);
    let found = rows(&samples(&variants(&model, &[]), count));
    let value = |row: &Row| row.measured[0].expect("a value");
    found.iter().map(value).collect()
}

/// Mean and standard deviation about it.
fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    (mean, (squares / (n - 1.0)).sqrt())
}

/// Largest distance between the fraction of values below a point and the distribution there, times √n (Kolmogorov): below 1.63 in 99 of 100.
fn distance(values: &[f64], distribution: impl Fn(f64) -> f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let at = |(k, v): (usize, &f64)| {
        let expected = distribution(*v);
        (expected - k as f64 / n)
            .abs()
            .max(((k + 1) as f64 / n - expected).abs())
    };
    sorted.iter().enumerate().map(at).fold(0.0, f64::max) * n.sqrt()
}

/// Φ(z), by the integral of its density.
fn normal(z: f64) -> f64 {
    let parts = 2000;
    let h = z / f64::from(parts);
    let density = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
    let middle = |k: i32| density((f64::from(k) + 0.5) * h);
    0.5 + h * (0..parts).map(middle).sum::<f64>()
}

#[test]
fn values_have_the_distributions_of_ltspice_and_ngspice() {
    let evenly = |from: f64, to: f64| move |x: f64| ((x - from) / (to - from)).clamp(0.0, 1.0);
    let about = |mean: f64, sigma: f64| move |x: f64| normal((x - mean) / sigma);
    type Distribution = Box<dyn Fn(f64) -> f64>;
    let cases: [(&str, Distribution); 7] = [
        ("mc(10, 0.05)", Box::new(evenly(9.5, 10.5))),
        ("unif(10, 0.05)", Box::new(evenly(9.5, 10.5))),
        ("10+flat(3)", Box::new(evenly(7.0, 13.0))),
        ("aunif(10, 2)", Box::new(evenly(8.0, 12.0))),
        ("10+gauss(0.5)", Box::new(about(10.0, 0.5))),
        ("gauss(10, 0.3, 3)", Box::new(about(10.0, 1.0))),
        ("agauss(10, 6, 3)", Box::new(about(10.0, 2.0))),
    ];
    for (expression, distribution) in cases {
        let found = values(&drawn(expression, ""), 1000);
        let far = distance(&found, distribution);
        assert!(far < 1.63, "{expression}: {far}");
    }
    let found = values(&drawn("limit(10, 2)", ""), 1000);
    assert!(found.iter().all(|v| *v == 8.0 || *v == 12.0));
    assert!((moments(&found).0 - 10.0).abs() < 0.2);
}

/// Without a sample everything is nominal, and a note says so.
#[test]
fn nominal_is_nominal() {
    let model = parsed(&drawn(
        "mc(10, 0.5)+flat(3)+limit(1, 1)+gauss(2, 0.1, 3)",
        "",
    ));
    assert_eq!(model.circuit().value("v1"), Some(13.0));
    let codes: Vec<_> = model
        .findings()
        .iter()
        .map(|d: &Diagnostic| d.code)
        .collect();
    assert_eq!(codes, ["random"]);
}

/// What is shared is drawn once: a parameter, a model; what stands on several cards or in several instances is drawn for each.
#[test]
fn a_parameter_is_drawn_once_and_a_card_each() {
    let text = "\
t
.param p={mc(1, 0.5)}
.func spread(x)={mc(x, 0.5)}
.subckt half a
r1 a 0 {mc(1k, 0.5)}
.ends
v1 a 0 1
r1 a 0 {1k*p}
r2 a 0 {1k*p}
r3 a 0 {mc(1k, 0.5)}
r4 a 0 {mc(1k, 0.5)}
r5 a 0 {spread(500)+spread(500)}
x1 a half
x2 a half
s1 a b a 0 on
s2 a c a 0 on
rb b 0 1
rc c 0 1
.model on sw(ron={mc(1, 0.5)} roff=1g vt=0.5)
.tran 1m 2m
.end
";
    let options = ElaborateOptions {
        sample: Some(5),
        ..ElaborateOptions::default()
    };
    let model = Model::parse_with(text, "t.cir", options).expect("a circuit");
    let value = |name: &str| model.circuit().value(name).expect("a value");
    assert_eq!(value("r1"), value("r2"));
    let each = ["r1", "r3", "r4", "r5", "x1.r1", "x2.r1"];
    let different: BTreeSet<u64> = each.iter().map(|name| value(name).to_bits()).collect();
    assert_eq!(different.len(), each.len());
    let kind = |name: &str| {
        let id = model.circuit().element(name).expect("a switch");
        format!("{:?}", model.circuit().elements[id.index()].kind)
    };
    let on = |name: &str| {
        let kind = kind(name);
        let from = kind.find("ron").expect("an on-resistance");
        kind[from..]
            .split(',')
            .next()
            .unwrap_or_default()
            .to_string()
    };
    assert_eq!(on("s1"), on("s2"));
    // Two calls of one function on one card are two draws: twice one of them is never their sum.
    let apart = values(
        &drawn("spread(5)-spread(5)", ".func spread(x)={mc(x, 0.5)}"),
        50,
    );
    assert!(apart.iter().all(|v| *v != 0.0));
}

/// A sample does not depend on what else is drawn, or on what is set.
#[test]
fn what_is_drawn_depends_on_its_place_alone() {
    let options = |tolerances: &[&str]| ElaborateOptions {
        sample: Some(3),
        seed: 9,
        tolerances: tolerances
            .iter()
            .map(|name| Tolerance {
                name: (*name).into(),
                spread: Spread::Normal,
                relative: 0.1,
            })
            .collect(),
        ..ElaborateOptions::default()
    };
    let text =
        "t\n.param a=2 b={a}\nv1 n 0 {b}\nr1 n 0 1k tol=5\nr2 n 0 {mc(1k,.1)}\n.tran 1m 2m\n.end\n";
    let parse = |tolerances: &[&str]| {
        Model::parse_with(text, "t.cir", options(tolerances)).expect("a circuit")
    };
    let (few, many) = (parse(&["a"]), parse(&["r1", "v1", "a"]));
    let (few, many) = (few.circuit(), many.circuit());
    assert_eq!(few.value("r2"), many.value("r2"));
    assert_eq!(few.value("a"), many.value("a"));
    // What follows from a parameter follows from its sample.
    assert_eq!(few.value("v1"), few.value("a"));
    assert_ne!(few.value("a"), Some(2.0));
    // The tolerance of the card, then the one given beside it.
    let (card, given) = (few.value("r1"), many.value("r1"));
    assert!(card.is_some_and(|r| r != 1e3 && (950.0..1050.0).contains(&r)));
    assert_ne!(card, given);
    let mut set = parse(&["a"]);
    set.set("r1", 2e3).expect("a circuit");
    assert_eq!(set.circuit().value("r2"), few.value("r2"));
    assert_eq!(set.circuit().value("r1"), card.map(|r| 2.0 * r));
}

/// `.step` draws a random function anew for every run, as LTspice does.
#[test]
fn every_step_draws_anew() {
    let text = drawn("mc(10, 0.1)", ".step param run 1 20 1");
    let model = parsed(&text);
    let found: BTreeSet<u64> = rows(&steps(&model))
        .iter()
        .map(|row| row.measured[0].expect("a value").to_bits())
        .collect();
    assert_eq!(found.len(), 20);
}

fn circ(directory: &Path, arguments: &str, threads: &str) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_circ"))
        .current_dir(directory)
        .args(arguments.split_whitespace())
        .env("RAYON_NUM_THREADS", threads)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    (
        output.status.code().unwrap(),
        String::from_utf8(output.stdout).unwrap(),
        String::from_utf8(output.stderr).unwrap(),
    )
}

const DIVIDER: &str = "\
a divider
.param r=1k
v1 in 0 10
r1 in out {r}
r2 out 0 {mc(1k, 0.1)} tol=5
.tran 1m 10m
.meas tran out find v(out) at=9m
.meas tran never when v(out)=11
.end
";

fn place(netlist: &str) -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("a.cir"), netlist).unwrap();
    directory
}

#[test]
fn rows_are_those_of_single_runs_in_any_number_of_threads() {
    let place = place(DIVIDER);
    let arguments = "sweep a.cir --param r=1k,3k --param v1=lin:1:3:3 --mc 40 --sigma-of r=1%";
    let (status, out, err) = circ(place.path(), arguments, "1");
    assert_eq!(status, 0, "{err}");
    assert!(
        !err.contains("nominal") && err.contains("out: mean"),
        "{err}"
    );
    assert_eq!(circ(place.path(), arguments, "3").1, out);
    let mut lines = out.lines();
    assert_eq!(lines.next(), Some("r,v1,sample,r,r2,out,never,error"));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 2 * 3 * 40);
    let number = |text: &str| text.parse::<f64>().unwrap();
    for row in &rows {
        let expected = number(row[1]) * number(row[4]) / (number(row[3]) + number(row[4]));
        assert!((number(row[5]) - expected).abs() < 1e-13, "{row:?}");
        assert_eq!((row[6], row[7]), ("", ""));
    }
    // The last parameter changes fastest, after the samples.
    let order: Vec<f64> = rows.iter().step_by(40).map(|row| number(row[1])).collect();
    assert_eq!(order, [1.0, 2.0, 3.0, 1.0, 2.0, 3.0]);
    let alone =
        "sim a.cir --param r=3k --param v1=2 --sample 7 --sigma-of r=1% --probe v(out) -o -";
    let alone = alone.replace("--param v1=2 ", "");
    let (status, out, err) = circ(place.path(), &alone, "1");
    assert_eq!(status, 0, "{err}");
    let last = number(out.lines().last().unwrap().split(',').nth(1).unwrap());
    let row = rows
        .iter()
        .find(|row| number(row[0]) == 3e3 && number(row[1]) == 1.0 && number(row[2]) == 7.0);
    assert!((last / 10.0 - number(row.unwrap()[5])).abs() < 1e-14);
}

#[test]
fn files_hold_the_same_rows() {
    let place = place(DIVIDER);
    let arguments = "sweep a.cir --mc 5 --of out -o a.csv -o a.jsonl -o a.npz";
    let (status, out, err) = circ(place.path(), arguments, "2");
    assert_eq!((status, out.as_str()), (0, ""), "{err}");
    let read = |name: &str| fs::read_to_string(place.path().join(name)).unwrap();
    let csv = read("a.csv");
    let mut column = vec![];
    for (line, object) in csv.lines().skip(1).zip(read("a.jsonl").lines()) {
        let object: serde_json::Value = serde_json::from_str(object).unwrap();
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(
            object["sample"].as_f64().unwrap(),
            cells[0].parse::<f64>().unwrap()
        );
        assert_eq!(
            object["out"].as_f64().unwrap(),
            cells[2].parse::<f64>().unwrap()
        );
        column.push(cells[2].parse::<f64>().unwrap());
    }
    assert_eq!(column.len(), 5);
    let mut archive =
        zip::ZipArchive::new(File::open(place.path().join("a.npz")).unwrap()).unwrap();
    let npy = npyz::NpyFile::new(archive.by_name("out.npy").unwrap()).unwrap();
    assert_eq!(npy.into_vec::<f64>().unwrap(), column);
}

/// A short circuit at one value, a singular one: rows with their reason.
#[test]
fn failures_are_rows() {
    let place = place(
        "t\nv1 a 0 1\nv2 b 0 {v}\nr1 a b {r}\n.param v=1 r=1\n.tran 1m 2m\n.meas tran i find i(r1) at=1m\n.end\n",
    );
    let (status, out, err) = circ(place.path(), "sweep a.cir --param v=1,2 --param r=0,1", "2");
    assert_eq!(status, 0, "{err}");
    let rows: Vec<&str> = out.lines().collect();
    assert_eq!(rows.len(), 5);
    assert!(
        rows[4].ends_with("e0,") && rows[4].contains(",-1.0"),
        "{out}"
    );
    assert!(rows[3].contains(",,\""), "{out}");
    assert!(err.contains("runs failed"), "{err}");
}

#[test]
fn mistakes_are_told_before_anything_is_written() {
    let place = place(DIVIDER);
    for (arguments, told) in [
        ("--param y=1,2", "no parameter `y`"),
        ("--param x1=log:0:1:3", "values of one sign"),
        ("--param r=lin:0:1:1", "from 2 to"),
        ("--of nothing", "there is no `.meas` `nothing`"),
        ("--mc 3 --tol-of nowhere=5%", "`nowhere` with a tolerance"),
        ("--mc 3 --sample 3", "cannot be used with"),
        ("--param r=1,2 -o a.svg", "csv, jsonl or npz"),
        ("--mc 9999999999", "more than 10000000 runs"),
    ] {
        let (status, out, err) = circ(place.path(), &format!("sweep a.cir {arguments}"), "1");
        assert_eq!((status, out.as_str()), (2, ""), "{arguments}: {err}");
        assert!(err.contains(told), "{arguments}: {err}");
    }
    let (status, _, err) = circ(place.path(), "sim a.cir --param r=1,2", "1");
    assert!(
        status == 2 && err.contains("`circ sweep` takes several"),
        "{err}"
    );
}

#[test]
fn a_sweep_that_measures_nothing_is_a_mistake() {
    let place = place("nothing\nv1 a 0 10\nr1 a 0 100 tol=5\n.tran 1m 10m\n.end\n");
    let (status, out, err) = circ(place.path(), "sweep a.cir --mc 2", "1");
    assert_eq!((status, out.as_str()), (2, ""), "{err}");
    assert!(err.contains("the netlist measures nothing"), "{err}");
}
