//! ngspice's batch line, and its log.
#![allow(missing_docs, reason = "tests")]

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

const NETLIST: &str = "\
* charging
v1 in 0 1
r1 in out {r}
c1 out 0 1u
.param r=1k
.tran 10u 5m uic
.meas tran last find v(out) at=4m
.meas tran rise trig v(out) val=0.25 rise=1 targ v(out) val=0.5 rise=1
.meas tran never when v(out)=2
.end
";

/// Status and standard error.
fn circ(directory: &Path, arguments: &str) -> (i32, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_circ"))
        .current_dir(directory)
        .args(arguments.split_whitespace())
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    (output.status.code().unwrap(), text)
}

fn place(netlist: &str) -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("rc.cir"), netlist).unwrap();
    directory
}

#[test]
fn a_batch_line_writes_rows_and_a_log() {
    let place = place(NETLIST);
    let read = |name: &str| fs::read(place.path().join(name)).unwrap();
    for line in [
        "-b rc.cir -r rc.raw -o rc.log",
        "-D ngbehavior=kiltpsa -n -a --batch --rawfile=rc.raw --output rc.log rc.cir",
        "-brrc.raw -orc.log -- rc.cir",
    ] {
        assert_eq!(circ(place.path(), line), (0, String::new()), "{line}");
        insta::assert_snapshot!("log", String::from_utf8(read("rc.log")).unwrap());
        let (status, _) = circ(place.path(), "sim -q rc.cir -o same.raw");
        assert_eq!((status, read("rc.raw")), (0, read("same.raw")), "{line}");
        fs::remove_file(place.path().join("rc.raw")).unwrap();
    }
    // Without an ending that says otherwise, rows are in ngspice's format.
    assert_eq!(circ(place.path(), "-b rc.cir -r rows -o rc.log").0, 0);
    assert_eq!(read("rows"), read("same.raw"));
}

/// Measurements of a response have the log's form, too.
#[test]
fn a_response_is_measured_in_the_log() {
    let place = place(
        "rc\nv1 in 0 ac 1\nr1 in out 1k\nc1 out 0 1u\n.ac dec 10 1 100k\n.meas ac gain find vdb(out) at=1\n.meas ac never when vdb(out)=3\n.end\n",
    );
    assert_eq!(circ(place.path(), "-b rc.cir -r rc.raw -o rc.log").0, 0);
    let log = fs::read_to_string(place.path().join("rc.log")).unwrap();
    let gain = log.lines().find_map(|line| line.strip_prefix("gain="));
    let value: f64 = gain.unwrap().split(' ').next().unwrap().parse().unwrap();
    let truth = -10.0 * (1.0 + (std::f64::consts::TAU * 1e-3).powi(2)).log10();
    assert!((value - truth).abs() < 1e-12, "{log}");
    assert!(
        log.contains("Measurement \"never\" FAIL'ed: the value 3 is not crossed"),
        "{log}"
    );
}

#[test]
fn steps_are_a_table_for_each_measurement() {
    let place = place(&NETLIST.replace(".tran", ".step param r list 1k 2k 1meg\n.tran"));
    let ran = circ(place.path(), "-b rc.cir -r rc.raw -o rc.log");
    assert_eq!(ran, (0, String::new()));
    insta::assert_snapshot!(
        "log_of_steps",
        fs::read_to_string(place.path().join("rc.log")).unwrap()
    );
}

#[test]
fn faults_are_in_the_log_and_their_number_on_standard_error() {
    let place = place("* bad\nr1 a b c d\n.tran 1u 1m\n.end\n");
    let (status, err) = circ(place.path(), "-b rc.cir -r rc.raw -o rc.log");
    assert_eq!((status, err.as_str()), (2, "error: rc.cir: 1 error\n"));
    let log = fs::read_to_string(place.path().join("rc.log")).unwrap();
    assert!(
        log.starts_with("Circuit: rc.cir\n") && log.contains("[rc.cir:2:10]"),
        "{log}"
    );
    assert!(!log.contains('\u{1b}') && !place.path().join("rc.raw").exists());
}

#[test]
fn what_is_no_batch_line_is_refused() {
    let place = place(NETLIST);
    for (line, told) in [
        ("-b", "<FILE>"),
        ("-b -s rc.cir", "unexpected argument '-s'"),
        ("-b rc.cir -o rc.cir", "would be overwritten"),
        ("-b rc.cir -o nowhere/rc.log", "nowhere/rc.log"),
        ("-b rc.cir -r nowhere/rc.raw", "nowhere/rc.raw"),
    ] {
        let (status, err) = circ(place.path(), line);
        assert!(status == 2 && err.contains(told), "{line}: {err}");
    }
    assert_eq!(
        fs::read_to_string(place.path().join("rc.cir")).unwrap(),
        NETLIST
    );
}
