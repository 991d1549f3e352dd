//! `.meas` and `.four` from card to result: closed forms, ngspice's own answers, and what is said of failures.

use std::fs;
use std::process::{Command, Stdio};

use serde_json::Value;

/// Runs `circ sim` with a summary; (the summary, all of standard error).
fn sim(netlist: &str) -> (Value, String) {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("a.cir"), netlist).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_circ"))
        .current_dir(directory.path())
        .args(["sim", "a.cir", "-o", "a.csv", "--summary", "json"])
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}");
    let header = fs::read_to_string(directory.path().join("a.csv")).unwrap();
    assert_eq!(header.lines().next().unwrap(), "time,v(out)");
    let line = text.lines().find(|line| line.starts_with('{')).unwrap();
    (serde_json::from_str(line).unwrap(), text)
}

fn value(summary: &Value, name: &str) -> f64 {
    entry(summary, name)["value"]
        .as_f64()
        .unwrap_or_else(|| panic!("{name} has no value"))
}

fn entry<'a>(summary: &'a Value, name: &str) -> &'a Value {
    let all = summary["measurements"].as_array().unwrap();
    all.iter().find(|m| m["name"] == name).unwrap()
}

/// A pulse train with true edges: levels, areas and instants are rational.
#[test]
fn a_pulse_train_is_measured_exactly() {
    let (found, _) = sim("\
pulses of 5 V, 1 ms of every 4 ms, on a grid that misses the edges
.param level=2.5
v1 out 0 pulse(0 5 0.5m 0 0 1m 4m)
r1 out 0 1k
.tran 0.3m 8.5m
.save v(out)
.func half(x) {x/2}
.meas tran mean avg v(out) from=0.5m to=8.5m
.meas tran heat integ v(out)*-i(v1) from=0 to=4.5m
.meas tran effective rms v(out) from=0.5m to=4.5m
.meas tran up when v(out)=level rise=2
.meas tran down when v(out)='level' fall=last
.meas tran width trig v(out) val=2.5 rise=1 targ v(out) val=2.5 fall=1
.meas tran top find par('v(out)+1') at=0.7m
.meas tran inside avg v(out) trig v(out) val=1 rise=1 targ v(out) val=1 fall=1
.meas later param='twice/2+half(width)'
.meas tran twice param 2*mean
.end
");
    for (name, expected) in [
        ("mean", 1.25),
        ("heat", 25e-3 * 1e-3),
        ("effective", 2.5),
        ("up", 4.5e-3),
        ("down", 5.5e-3),
        ("width", 1e-3),
        ("top", 6.0),
        ("inside", 5.0),
        ("twice", 2.5),
        ("later", 1.25 + 0.5e-3),
    ] {
        let found = value(&found, name);
        assert!(
            (found - expected).abs() < 1e-12 * expected.max(1e-3),
            "{name} {found}"
        );
    }
}

/// The numbers on the right are what ngspice 39 prints for this netlist (with its own steps of at most 10 µs).
#[test]
fn a_filter_agrees_with_ngspice() {
    let (found, _) = sim("\
rc
v1 in 0 sin(0 5 50)
r1 in out 1k
c1 out 0 1u ic=0
.tran 10u 100m uic
.save v(out)
.meas tran vmax MAX v(out)
.meas tran vmin MIN v(out) from=20m to=40m
.meas tran vavg AVG v(out) from=20m to=50m
.meas tran vrms RMS v(out) from=20m to=60m
.meas tran q INTEG i(v1) from=0 to=5m
.meas tran f1 FIND v(out) AT=12.3m
.meas tran f2 FIND v(out) WHEN v(in)=2.5 RISE=2
.meas tran w1 WHEN v(out)=1 CROSS=3
.meas tran w2 WHEN v(out)=v(in) FALL=1
.meas tran w3 WHEN v(out)=1 FALL=LAST
.meas tran d1 TRIG v(in) VAL=1 RISE=1 TARG v(out) VAL=1 RISE=1
.meas tran d2 TRIG AT=1m TARG v(out) VAL=1 TD=25m FALL=1
.meas tran slope DERIV v(out) AT=30m
.four 50 v(out)
.end
");
    for (name, ngspice, tolerance) in [
        ("vmax", 4.773810, 1e-5),
        ("vmin", -4.770137, 1e-5),
        ("vavg", 9.658400e-1, 2e-4),
        ("vrms", 3.37300, 1e-5),
        ("q", -4.56050e-6, 1e-4),
        ("f1", -1.937094, 1e-5),
        ("f2", 1.037276, 1e-5),
        ("w1", 2.16412e-2, 1e-5),
        ("w2", 1.59689e-2, 1e-5),
        ("w3", 9.02966e-2, 1e-5),
        ("d1", 7.620706e-4, 2e-5),
        ("d2", 2.929664e-2, 1e-5),
    ] {
        let found = value(&found, name);
        assert!(
            (found / ngspice - 1.0).abs() < tolerance,
            "{name} {found}, ngspice {ngspice}"
        );
    }
    // Steady state: amplitude 5/√(1 + (ωRC)²), phase −atan ωRC, at 30 ms = 1.5 periods.
    let omega = 100.0 * std::f64::consts::PI;
    let (amplitude, phase) = (5.0 / (omega * 1e-3).hypot(1.0), -(omega * 1e-3).atan());
    let expected = amplitude * omega * (omega * 0.03 + phase).cos();
    assert!((value(&found, "slope") / expected - 1.0).abs() < 2e-3);
    let harmonics = &found["fourier"][0];
    let first = &harmonics["harmonics"][0];
    assert!((first["magnitude"].as_f64().unwrap() / amplitude - 1.0).abs() < 1e-5);
    assert!((first["phase"].as_f64().unwrap() - phase.to_degrees()).abs() < 1e-3);
    assert!(harmonics["thd"].as_f64().unwrap() < 1e-9);
}

#[test]
fn what_cannot_be_measured_is_said() {
    let (found, text) = sim("\
failures
v1 out 0 sin(0 5 50)
r1 out 0 1k
.tran 10u 20m
.save v(out)
.meas tran never when v(out)=6
.meas tran late avg v(out) from=30m
.meas tran typo max v(oot)
.meas tran from_none param 1+never
.meas tran round param round_again
.meas tran round_again param round
.meas tran zeroth when v(out)=1 rise=0.5
.meas tran infinite avg 1/(v(out)-v(out))
.meas tran fine max v(out)
.end
");
    for (name, reason) in [
        ("never", "the value 6 is not crossed"),
        ("late", "no part of the run lies between 0.03 s and 0.02 s"),
        ("typo", "it refers to what the circuit does not have"),
        ("from_none", "`never` has no value"),
        ("round", "its own result is needed first"),
        ("round_again", "its own result is needed first"),
        ("zeroth", "there is no crossing number 0.5"),
        ("infinite", "the value is not a finite number"),
    ] {
        assert_eq!(entry(&found, name)["error"], reason, "{name}");
        assert!(entry(&found, name)["value"].is_null());
    }
    assert!((value(&found, "fine") - 5.0).abs() < 1e-12);
    let warning = "there is no node `oot`; this measurement is left out";
    assert!(
        text.contains(warning) && text.contains("a.cir:8:23"),
        "{text}"
    );
}

/// Pulses of an eighth of the period: harmonics 4/(πk)·sin(πk/8), 67.5°, 45°, 22.5° ahead of a sine.
/// Without a summary the results stand on standard error, one line each, as ngspice prints them.
#[test]
fn results_are_printed() {
    let directory = tempfile::tempdir().unwrap();
    let netlist = "\
square wave
v1 out 0 pulse(-1 1 0 0 0 0.25m 2m)
r1 out 0 1k
.tran 0.1m 4m
.meas tran peak max v(out)
.meas tran never when v(out)=2
.four 500 3 v(out)
.end
";
    fs::write(directory.path().join("a.cir"), netlist).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_circ"))
        .current_dir(directory.path())
        .args(["sim", "a.cir", "-o", "a.csv"])
        .stdin(Stdio::null())
        .output()
        .unwrap();
    insta::assert_snapshot!(String::from_utf8(output.stderr).unwrap(), @r"
    peak                =  1.000000e+00 from=  0.000000e+00 to=  4.000000e-03
    never                failed: the value 2 is not crossed
    Fourier analysis for v(out) at 500 Hz: THD 122.521688 %
    harmonic  frequency  magnitude  phase  norm. mag  norm. phase
    0                 0      -0.75      0          0            0
    1               500   0.487248   67.5          1            0
    2              1000   0.450158     45    0.92388        -22.5
    3              1500   0.392107   22.5   0.804738          -45
    ");
}
