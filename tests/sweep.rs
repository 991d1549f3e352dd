//! `.step` and `.dc`: values, their order, what comes out, and what is refused.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use circ::circuit::{ElaborateOptions, Swept, combinations, elaborate};
use circ::diagnostic::SourceMap;
use circ::netlist::parse;
use serde_json::Value;

const DISCHARGE: &str = "\
a capacitor discharges
c1 out 0 {c} ic=1
r1 out 0 {r}
.param r=7k
.tran 0.5m 1m uic
.step param r list 1k 2k
.step dec param c 1u 10u 1
.meas tran half when v(out)=0.5 fall=1
.save v(out)
.end
";

fn circ(directory: &Path, arguments: &str) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_circ"))
        .current_dir(directory)
        .args(arguments.split_whitespace())
        .stdin(Stdio::null())
        .output()
        .unwrap();
    (
        output.status.code().unwrap(),
        String::from_utf8(output.stdout).unwrap(),
        String::from_utf8(output.stderr).unwrap(),
    )
}

fn place(netlist: &str) -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("a.cir"), netlist).unwrap();
    directory
}

fn table(csv: &str) -> (Vec<&str>, Vec<Vec<f64>>) {
    let mut lines = csv.lines();
    let names = lines.next().unwrap().split(',').collect();
    let row = |line: &str| line.split(',').map(|cell| cell.parse().unwrap()).collect();
    (names, lines.map(row).collect())
}

/// Rows of all runs below each other, the first `.step` innermost: v = exp(−t/rc).
#[test]
fn every_combination_is_run_in_order() {
    let place = place(DISCHARGE);
    let (status, out, err) = circ(place.path(), "sim a.cir");
    assert_eq!(status, 0, "{err}");
    let (names, rows) = table(&out);
    assert_eq!(names, ["time", "v(out)", "r", "c"]);
    let mut expected = Vec::new();
    for c in [1e-6, 1e-5] {
        for r in [1e3, 2e3] {
            for t in [0.0, 0.5e-3, 1e-3] {
                expected.push([t, f64::exp(-t / (r * c)), r, c]);
            }
        }
    }
    assert_eq!(rows.len(), expected.len());
    for (row, expected) in rows.iter().zip(&expected) {
        for (a, b) in row.iter().zip(expected) {
            assert!(
                (a - b).abs() <= 1e-9 * b.abs(),
                "{row:?} is not {expected:?}"
            );
        }
    }
    // Half of the voltage after rc·ln 2, where the run is long enough.
    insta::assert_snapshot!(err, @r"
    r        c          half
    1000  1e-6  0.0006931472
    2000  1e-6        failed
    1000  1e-5        failed
    2000  1e-5        failed
    half failed at r=2000 c=1e-6: the value 0.5 is not crossed
    half failed at r=1000 c=1e-5: the value 0.5 is not crossed
    half failed at r=2000 c=1e-5: the value 0.5 is not crossed
    ");
}

#[test]
fn files_and_summary_hold_all_runs() {
    let place = place(DISCHARGE);
    let arguments =
        "sim a.cir -o a.csv -o a.json -o a.raw -o a.npz -o a.svg -o a.html --summary json";
    let (status, _, err) = circ(place.path(), arguments);
    assert_eq!(status, 0, "{err}");
    let summary: Value = serde_json::from_str(err.lines().last().unwrap()).unwrap();
    let runs = summary["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 4);
    assert_eq!(runs[1]["values"]["r"], 2000.0);
    let half = runs[0]["measurements"][0]["value"].as_f64().unwrap();
    assert!((half / (1e-3 * 2_f64.ln()) - 1.0).abs() < 1e-6);
    let work = |summary: &Value| summary["steps"].as_u64().unwrap();
    assert_eq!(work(&summary), runs.iter().map(work).sum::<u64>());
    let read = |name: &str| fs::read(place.path().join(name)).unwrap();
    let picture = String::from_utf8(read("a.svg")).unwrap();
    for label in ["v(out) r=1000 c=1e-6", "v(out) r=2000 c=1e-5"] {
        assert!(picture.contains(label), "{label}");
    }
    let json: Value = serde_json::from_slice(&read("a.json")).unwrap();
    assert_eq!(json["time"].as_array().unwrap().len(), 12);
    assert!(!read("a.raw").is_empty() && !read("a.npz").is_empty() && !read("a.html").is_empty());
}

#[test]
fn a_value_from_outside_is_not_stepped() {
    let place = place(DISCHARGE);
    let (status, out, err) = circ(place.path(), "sim a.cir --param r=3k --param c=1u");
    assert_eq!(status, 0, "{err}");
    let (names, rows) = table(&out);
    assert_eq!(names, ["time", "v(out)"]);
    assert!((rows[2][1] - f64::exp(-1.0 / 3.0)).abs() < 1e-12);
}

/// A run that breaks off is named, and written as far as it came; the others are written whole.
#[test]
fn a_run_that_fails_does_not_take_the_others_with_it() {
    let place = place(
        "a current that the diode blocks from 1 ms on, if it is positive
i1 0 a pwl(0 -1 2m {i})
d1 0 a di
.model di d(ideal)
.tran 0.5m 2m
.step param i list 1 -1
.save v(a) i(d1)
.end
",
    );
    let (status, out, err) = circ(place.path(), "sim a.cir");
    assert_eq!(status, 2);
    let rows = table(&out).1;
    let times = |i: f64| -> Vec<f64> { rows.iter().filter(|r| r[3] == i).map(|r| r[0]).collect() };
    assert_eq!(times(1.0), [0.0, 0.5e-3, 1e-3]);
    assert_eq!(times(-1.0), [0.0, 0.5e-3, 1e-3, 1.5e-3, 2e-3]);
    assert!(
        err.contains("a.cir: the run ended at t = 1e-3 s at i=1") && !err.contains("i=-1"),
        "{err}"
    );
}

/// A value that makes no circuit ends it all, and is named.
#[test]
fn a_value_without_a_circuit_is_named() {
    let place = place(
        "a conductance
v1 a 0 1
r1 a 0 {1/g}
.tran 1m 2m
.step param g 1 0 1
.end
",
    );
    let (status, out, err) = circ(place.path(), "sim a.cir");
    assert_eq!((status, out.as_str()), (2, ""));
    assert!(
        err.contains("1 error at g=0") && err.contains("divides by zero"),
        "{err}"
    );
}

/// A divider with a diode: v = (v1/r + i1 + 0.7/rd) / (2/r + 1/rd) where it conducts, else (v1/r + i1)·r/2.
#[test]
fn operating_points_over_two_sources() {
    let place = place(
        "a clamp
v1 in 0 pulse(0 1 0 1 1 1 4)
r1 in out 1k
d1 out 0 di
r2 out 0 1k
i1 0 out 0
.model di d(ron=1 vfwd=0.7)
.dc v1 -1 3 1 i1 0 1m 0.5m
.print dc v(out) i(d1)
.print tran v(in)
.end
",
    );
    let (status, out, err) = circ(place.path(), "sim a.cir");
    assert_eq!(status, 0, "{err}");
    let (names, rows) = table(&out);
    assert_eq!(names, ["v1", "i1", "v(out)", "i(d1)"]);
    let mut expected = rows.iter();
    for i1 in [0.0, 0.5e-3, 1e-3] {
        for v1 in [-1.0, 0.0, 1.0, 2.0, 3.0] {
            let row = expected.next().unwrap();
            let blocks = (v1 / 1e3 + i1) * 500.0;
            let conducts = (v1 / 1e3 + i1 + 0.7) / (2e-3 + 1.0);
            let out = if blocks > 0.7 { conducts } else { blocks };
            assert_eq!(row[..2], [v1, i1]);
            assert!((row[2] - out).abs() < 1e-12, "{row:?} {out}");
            assert!((row[3] - (out - 0.7).max(0.0)).abs() < 1e-12, "{row:?}");
        }
    }
    assert!(expected.next().is_none());
}

fn steps(card: &str) -> (Vec<(Swept, Vec<f64>)>, Vec<String>) {
    let text = format!("t\nv1 a 0 1\nr1 a 0 {{1k+temp+x}}\n.param x=1\n.tran 1 2\n{card}\n.end\n");
    let mut sources = SourceMap::default();
    let root = sources.add("a.cir", text);
    let (netlist, mut findings) = parse(&mut sources, root, &|_| {
        Err(std::io::ErrorKind::NotFound.into())
    });
    let (circuit, more) = elaborate(&netlist, &ElaborateOptions::default());
    findings.extend(more);
    let sweeps = circuit.map_or(vec![], |c| {
        c.steps.into_iter().map(|s| (s.what, s.values)).collect()
    });
    (sweeps, findings.into_iter().map(|d| d.message).collect())
}

#[test]
fn values_of_sweeps() {
    let x = || Swept::Param("x".into());
    let v1 = || Swept::Element("v1".into());
    for (card, what, expected) in [
        (
            ".step param x 1 2 0.25",
            x(),
            vec![1.0, 1.25, 1.5, 1.75, 2.0],
        ),
        (
            ".step param x 0.1 0.5 0.1",
            x(),
            vec![0.1, 0.2, 0.30000000000000004, 0.4, 0.5],
        ),
        (".step x 3 0 -2", x(), vec![3.0, 1.0]),
        (".step v1 3 0 2", v1(), vec![3.0, 1.0]),
        (
            ".step lin r1 1k 2k 1k",
            Swept::Element("r1".into()),
            vec![1e3, 2e3],
        ),
        (
            ".step temp list -40 27 {2*50}",
            Swept::Temperature,
            vec![-40.0, 27.0, 100.0],
        ),
        (".step oct v1 1 8 1", v1(), vec![1.0, 2.0, 4.0, 8.0]),
        (".step param x dec 100 1 1", x(), vec![100.0, 10.0, 1.0]),
        (
            ".step param y list 4\nr2 a 0 {y}",
            Swept::Param("y".into()),
            vec![4.0],
        ),
    ] {
        let (sweeps, findings) = steps(card);
        assert_eq!(findings, Vec::<String>::new(), "{card}");
        assert_eq!(sweeps.len(), 1, "{card}");
        assert_eq!(sweeps[0].0, what);
        assert_eq!(
            sweeps[0].1.len(),
            expected.len(),
            "{card} {:?}",
            sweeps[0].1
        );
        for (a, b) in sweeps[0].1.iter().zip(&expected) {
            assert!((a - b).abs() <= 1e-12 * b.abs(), "{card}");
        }
    }
    for (card, message) in [
        (".step param x 1 2", "the increment is missing"),
        (".step param x 1 2 0", "the increment of the sweep is zero"),
        (".step param x 0 1 1e-9", "the sweep has too many values"),
        (
            ".step dec param x 0 1 5",
            "a logarithmic sweep needs values of one sign, and at least one per decade or octave",
        ),
        (
            ".step v7 0 1 1",
            "there is neither a source nor a parameter `v7`",
        ),
        (
            ".step d dmod(is) 1 2 1",
            "there is no model `dmod` to sweep",
        ),
        (".step param x list", "a value is missing"),
        (".step", "a source, `param name` or `temp` is missing"),
    ] {
        let (sweeps, findings) = steps(card);
        assert!(
            sweeps.is_empty() && findings == [message],
            "{card}: {findings:?}"
        );
    }
}

#[test]
fn nothing_to_sweep_is_one_combination() {
    assert_eq!(combinations(&[]), [Vec::<f64>::new()]);
}

#[test]
fn a_slip_in_the_spacing_of_values_is_named() {
    for card in ["r lst 1", "r lst 1 2", "r lst 1 2 3"] {
        let folder = place(&DIVIDERS.replace("r list 1k 3k", card));
        let (status, _, err) = circ(folder.path(), "a.cir");
        assert!(
            status == 2 && err.contains("did you mean `list`?"),
            "{card}: {err}"
        );
    }
}

/// The temperature is the name `temp` of expressions; a resistance and a source are set by their names.
#[test]
fn what_is_swept_is_set() {
    let netlist = "\
t
v1 a 0 1
r1 a b {1k+temp}
r2 b 0 1k
.dc temp 0 100 100 v1 1 2 1 r2 1k 3k 2k
.end
";
    let place = place(netlist);
    let (status, out, err) = circ(place.path(), "sim a.cir --probe v(b)");
    assert_eq!(status, 0, "{err}");
    let (names, rows) = table(&out);
    assert_eq!(names, ["temp", "v1", "r2", "v(b)"]);
    assert_eq!(rows.len(), 8);
    for row in rows {
        let [temp, v1, r2, vb] = row[..] else {
            panic!()
        };
        assert!((vb - v1 * r2 / (r2 + 1e3 + temp)).abs() < 1e-12);
    }
}

const DIVIDERS: &str = "\
dividers
v1 in 0 dc 10
r1 in out 1k
r2 out 0 {r}
.param r=1k
.step param r list 1k 3k
.tran 1m 3m
.save v(out)
.end
";

/// v(out) = 10 r/(1 kΩ + r) at every value, and at the value as it stands where a netlist without `.step` has its own.
#[test]
fn the_operating_point_of_every_step() {
    let place = place(DIVIDERS);
    let (status, out, err) = circ(place.path(), "op a.cir --json");
    assert_eq!((status, err.as_str()), (0, ""));
    let found: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(found["nodes"]["out"], 5.0);
    let steps = found["steps"].as_array().unwrap();
    assert_eq!(steps.len(), 2);
    for (step, (r, v)) in steps.iter().zip([(1e3, 5.0), (3e3, 7.5)]) {
        assert_eq!(step["values"]["r"], r);
        assert_eq!(step["nodes"]["out"], v);
        assert!(step["notes"].as_array().unwrap().is_empty());
    }
    let (status, out, err) = circ(place.path(), "op a.cir");
    assert_eq!((status, err.as_str()), (0, ""));
    let (first, second) = out.split_once("\n\n").unwrap();
    assert!(
        first.starts_with("r=1000\n") && second.starts_with("r=3000\n"),
        "{out}"
    );
    assert!(second.contains("7.5 V"), "{out}");
    let (_, out, _) = circ(place.path(), "op a.cir --param r=4k --json");
    let found: Value = serde_json::from_str(&out).unwrap();
    assert!(
        found["nodes"]["out"] == 8.0 && found.get("steps").is_none(),
        "{out}"
    );
}

/// A row for each value; of one point, which is printed, there is no file.
#[test]
fn the_operating_points_of_all_steps_are_rows_of_a_file() {
    let netlist = DIVIDERS.replace(".tran 1m 3m\n", ".op\n");
    let folder = place(&netlist);
    let (status, out, err) = circ(folder.path(), "a.cir -o a.csv");
    assert_eq!((status, out.as_str(), err.as_str()), (0, "", ""));
    let csv = fs::read_to_string(folder.path().join("a.csv")).unwrap();
    let (names, rows) = table(&csv);
    assert_eq!(names[..3], ["r", "v(in)", "v(out)"]);
    let points: Vec<_> = rows.iter().map(|row| (row[0], row[2])).collect();
    assert_eq!(points, [(1e3, 5.0), (3e3, 7.5)]);
    let (status, _, err) = circ(folder.path(), "a.cir -o a.npz");
    assert!(
        status == 2 && err.contains("is written as csv or json"),
        "{err}"
    );
    let (_, in_json, _) = circ(folder.path(), "op a.cir --json");
    let (status, _, err) = circ(folder.path(), "a.cir -o a.json");
    let written = fs::read_to_string(folder.path().join("a.json")).unwrap();
    assert!(status == 0 && written == in_json, "{err}{written}");
}

/// 1/|1 + jωRC| at every value, R of a low-pass and its `.meas ac`.
#[test]
fn every_step_has_its_response() {
    let folder = place(
        "low-pass\n.param r=1k\nv1 a 0 ac 1\nr1 a b {r}\nc1 b 0 1u\n.step param r list 1k 3k\n.ac list 100\n.meas ac top max mag(v(b))\n.end\n",
    );
    let (status, out, err) = circ(folder.path(), "ac a.cir --probe v(b)/v(a)");
    assert_eq!(status, 0, "{err}");
    let (names, rows) = table(&out);
    assert_eq!(names[1], "re(v(b)/v(a)[r=1000])");
    assert_eq!(names[3], "re(v(b)/v(a)[r=3000])");
    for (k, r) in [(1, 1e3), (3, 3e3)] {
        let gain = (1.0 + (200.0 * std::f64::consts::PI * r * 1e-6).powi(2))
            .sqrt()
            .recip();
        assert!((rows[0][k].hypot(rows[0][k + 1]) - gain).abs() < 1e-12);
    }
    assert!(
        err.contains("top r=1000") && err.contains("top r=3000"),
        "{err}"
    );
    let (status, plain, err) = circ(folder.path(), "sim a.cir");
    assert!(status == 0 && plain.contains("re(v(b)[r=3000])"), "{err}");
}

/// A diode carries 1 A one way and no current the other.
#[test]
fn a_step_without_an_operating_point_is_named_and_the_others_are_told() {
    let place = place(
        "one way\ni1 0 a dc {i}\nd1 0 a di\n.model di d(ideal)\n.step param i list 1 -1\n.op\n.end\n",
    );
    let (status, out, err) = circ(place.path(), "op a.cir");
    assert_eq!(status, 2);
    assert!(out.starts_with("i=-1\n") && !out.contains("i=1\n"), "{out}");
    assert!(
        err.contains("the circuit cannot be simulated at i=1\n"),
        "{err}"
    );
}

/// With ngspice where it is installed, else the missing program is named, once for every step.
#[test]
fn every_step_is_compared_with_ngspice() {
    let place = place(DIVIDERS);
    let (status, out, err) = circ(place.path(), "compare a.cir --json");
    if Command::new("ngspice").arg("--version").output().is_err() {
        assert_eq!(
            (status, err.matches("ngspice is not installed").count()),
            (2, 2)
        );
        return;
    }
    assert_eq!(status, 0, "{err}");
    let found: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(found["within"], true);
    let amplitudes = found["steps"].as_array().unwrap().iter().map(|step| {
        let signal = &step["signals"][0];
        assert_eq!(signal["name"], "v(out)");
        (
            step["values"]["r"].as_f64().unwrap(),
            signal["amplitude"].as_f64().unwrap(),
        )
    });
    for ((r, amplitude), expected) in amplitudes.zip([(1e3, 5.0), (3e3, 7.5)]) {
        assert!(
            r == expected.0 && (amplitude - expected.1).abs() < 1e-6,
            "{out}"
        );
    }
    let (status, _, err) = circ(place.path(), "compare a.cir -o a.svg");
    assert!(
        status == 2 && err.contains("`-o` and `--keep` take one run"),
        "{err}"
    );
}

/// A value that is set is the one on the card: what its temperature, its model and `m=` make of it stays.
#[test]
fn a_value_that_is_set_is_the_cards() {
    let netlist = "\
a divider at 77 degrees
.temp 77
v1 a 0 1
r1 a b rm 1k tc1=2m m=2
.model rm r(r=3)
r2 b 0 1k
.meas tran m find v(b) at=1m
.tran 0.1m 1m
.end
";
    let place = place(netlist);
    let (status, out, err) = circ(place.path(), "sweep a.cir --param r1=1k,2k -o -");
    assert_eq!(status, 0, "{err}");
    let rows: Vec<Vec<f64>> = (out.lines().skip(1))
        .map(|line| {
            line.split(',')
                .take(2)
                .map(|cell| cell.parse().unwrap())
                .collect()
        })
        .collect();
    for (row, r1) in rows.iter().zip([1e3, 2e3]) {
        let expected = 1.0 / (1.0 + r1 * 3.0 * 1.1 / 2.0 / 1e3);
        assert_eq!(row[0], r1);
        assert!((row[1] - expected).abs() < 1e-14, "{row:?} {expected}");
    }
    assert_eq!(rows.len(), 2);
}

/// A run that grows beyond the range of numbers is a row that says so.
#[test]
fn a_run_that_overflows_is_a_row_with_its_reason() {
    let netlist = "\
unstable
v1 n1 0 1
r1 n1 a 1
r2 a 0 -0.5
c1 a 0 1u ic=0.1
.meas tran m0 max v(a)
.tran 10u 1m uic
.end
";
    let place = place(netlist);
    let (status, out, err) = circ(place.path(), "sweep a.cir --param r1=1,0.25 -o -");
    assert_eq!(status, 0, "{err}");
    let rows: Vec<&str> = out.lines().skip(1).collect();
    assert!(
        rows[0].contains(",,\"") && rows[0].contains("beyond the range of numbers"),
        "{out}"
    );
    assert!(rows[1].ends_with(','), "{out}");
    assert!(err.contains("1 of 2 runs failed"), "{err}");
}
