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

/// A capacitor that is charged at 1 V/s, seen from the time at which rows begin.
#[test]
fn measurements_begin_where_the_rows_do() {
    let (found, _) = sim("\
a ramp
i1 0 out 1u
c1 out 0 1u ic=0
.tran 10m 2 1 uic
.save v(out)
.meas tran mean avg v(out)
.meas tran least min v(out)
.meas tran area integ v(out)
.end
");
    for (name, expected) in [("mean", 1.5), ("least", 1.0), ("area", 1.5)] {
        assert!((value(&found, name) - expected).abs() < 1e-12, "{found}");
    }
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
        ("late", "the run ends at 0.02 s, before 0.03 s"),
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

/// A switch interrupts 5 A, which its gigaohm turns into gigavolts for femtoseconds: the mean voltage of the inductor is L Δi/T, and the switch takes
/// ½ L i² each time.
#[test]
fn a_spike_between_rows_counts() {
    let (found, _) = sim("\
interrupted
v1 in 0 10
vg g 0 pulse(0 5 0 1n 1n 5u 10u)
s1 in out g 0 swm
l1 out 0 10u
.model swm sw(ron=1u roff=1g vt=2.5 vh=0)
.tran 1u 100u
.save v(out)
.meas tran flux integ v(out)
.meas tran il find i(l1) at=100u
.meas tran heat integ v(in,out)*i(s1)
.meas tran most min v(out)
.meas tran top max i(l1) from=0 to=10u
.end
");
    let value = |name| value(&found, name);
    // The control passes its level half an edge of 1 ns after it begins, and so 5.001 µs later.
    let peak = 10.0 * 5.001e-6 / 10e-6;
    assert!(
        (value("top") - peak).abs() < 1e-6 * peak,
        "{}",
        value("top")
    );
    let spikes = 10.0 * peak * 10e-6;
    let flux = value("flux") - 10e-6 * value("il");
    assert!(flux.abs() < 1e-8 * spikes, "{flux:e}");
    let heat = 10.0 * 0.5 * 10e-6 * peak * peak;
    assert!(
        (value("heat") - heat).abs() < 1e-5 * heat,
        "{}",
        value("heat")
    );
    assert!((value("most") + 1e9 * peak).abs() < 1e-5 * 1e9 * peak);
}

/// 159 MHz of which 1 µs shows nothing: v = V (1 − e^{−at} (cos wt + a/w sin wt)) after a step.
#[test]
fn ringing_between_rows_is_measured() {
    let (found, _) = sim("\
ringing
v1 in 0 pulse(0 10 1u 0 0 1 2)
r1 in a 20m
l1 a out 1n
c1 out 0 1n
.tran 1u 20u
.save v(out)
.meas tran top max v(out)
.meas tran first when v(out)=10 rise=1
.meas tran fifth when v(out)=10 rise=5
.meas tran swing trig v(out) val=10 rise=1 targ v(out) val=10 fall=1
.meas tran steep deriv v(out) when v(out)=10 rise=1
.meas tran heat integ v(in,a)*i(r1)
.meas tran away integ abs(v(out)-10) from=1u
.end
");
    let (a, w0) = (0.5 * 20e-3 / 1e-9, 1e9);
    let w = f64::sqrt(w0 * w0 - a * a);
    let half = std::f64::consts::PI / w;
    let near = |name: &str, expected: f64, tolerance: f64| {
        let found = value(&found, name);
        assert!(
            (found - expected).abs() < tolerance * expected.abs(),
            "{name} {found:e} {expected:e}"
        );
    };
    near("top", 10.0 * (1.0 + f64::exp(-a * half)), 1e-9);
    // cos wt + a/w sin wt = 0.
    let rise = (std::f64::consts::FRAC_PI_2 + (a / w).atan()) / w;
    near("first", 1e-6 + rise, 1e-11);
    near("fifth", 1e-6 + rise + 8.0 * half, 1e-11);
    near("swing", half, 1e-6);
    let slope = 10.0 * w0 * w0 / w * f64::exp(-a * rise) * f64::sin(w * rise);
    near("steep", slope, 1e-6);
    near("heat", 0.5 * 1e-9 * 100.0, 1e-8);
    // ∫ |e^{−at} (cos wt + a/w sin wt)| dt by pieces between zeros, of which each is e^{−aπ/w} times the one before.
    let primitive = |t: f64| {
        let (sin, cos) = (w * t).sin_cos();
        f64::exp(-a * t) * (-2.0 * a * cos + (w - a * a / w) * sin) / (w0 * w0)
    };
    let ratio = f64::exp(-a * half);
    let lobe = (primitive(rise + half) - primitive(rise)).abs();
    let away = 10.0 * (primitive(rise) - primitive(0.0) + lobe / (1.0 - ratio));
    near("away", away, 1e-7);
}

/// What a capacitor takes at the edges of a source without resistance is an impulse: its charge is in the mean of the current.
#[test]
fn impulses_are_in_means() {
    let (found, _) = sim("\
charged at once
v1 out 0 pulse(0 5 1u 0 0 4u 10u)
c1 out 0 1u
r1 out 0 1k
.tran 1u 8u
.save v(out)
.meas tran up integ i(c1) from=0 to=2u
.meas tran both integ i(c1)
.meas tran mean avg -2*i(c1)+1 from=0 to=2u
.meas tran r avg i(r1) from=1u to=5u
.end
");
    let value = |name| value(&found, name);
    assert!((value("up") - 5e-6).abs() < 1e-18 && value("both").abs() < 1e-18);
    assert!((value("mean") + 4.0).abs() < 1e-12 && (value("r") - 5e-3).abs() < 1e-15);
}

/// What `.meas` finds on a converter does not depend on the print step, and is what `--table` finds.
#[test]
fn the_print_step_does_not_matter() {
    let buck = |tran: &str| {
        let netlist = format!(
            "buck\nv1 in 0 24\nvg g 0 pulse(0 5 0 1n 1n 4u 10u)\ns1 in sw g 0 swm\nd1 0 sw dm\nl1 sw out 47u\nc1 out 0 100u\n\
             r1 out 0 5\n.model swm sw(ron=10m roff=1meg vt=2.5 vh=0)\n.model dm d(ideal)\n.tran {tran}\n.save v(out)\n\
             .meas tran mean avg v(out) from=1m to=2m\n.meas tran ripple pp i(l1) from=1m to=2m\n.meas tran heat rms i(s1) from=1m to=2m\n\
             .meas tran power avg v(out)*i(r1) from=1m to=2m\n.meas tran turn when i(l1)=5 fall=1\n.four 100k i(l1)\n.end\n"
        );
        sim(&netlist).0
    };
    let (coarse, fine) = (buck("100u 2m"), buck("0.1u 2m"));
    for name in ["mean", "ripple", "heat", "power", "turn"] {
        let [a, b] = [&coarse, &fine].map(|found| value(found, name));
        assert!((a - b).abs() < 1e-10 * a.abs(), "{name} {a} {b}");
    }
    let magnitude = |found: &Value| {
        found["fourier"][0]["harmonics"][0]["magnitude"]
            .as_f64()
            .unwrap()
    };
    let [a, b] = [&coarse, &fine].map(magnitude);
    assert!((a - b).abs() < 1e-10 * a && a > 0.1, "{a} {b}");
}

/// Of thirteen capacitors measurements see rows, and a note says how much depends on these; of twelve they see what lies between.
#[test]
fn lines_between_rows_are_told() {
    let ladder = |count: usize| {
        let stage = |k: usize| format!("r{k} n{} n{k} 1k\nc{k} n{k} 0 1u\n", k - 1);
        let stages: String = (1..=count).map(stage).collect();
        let text = format!(
            "ladder\nv1 n0 0 1\n{stages}rx n1 out 1k\nro out 0 1k\n.save v(out)\n.tran 1m 50m uic\n.meas tran mean avg v(n{count})\n.end\n"
        );
        let (_, said) = sim(&text);
        let note = said.split_once("straight lines between the rows of this run");
        note.map(|(_, note)| {
            let (_, rest) = note.split_once("by up to ").unwrap();
            rest.split_once(' ').unwrap().0.parse::<f64>().unwrap()
        })
    };
    assert_eq!(ladder(12), None);
    let part = ladder(13).unwrap();
    assert!(part > 1e-9 && part < 1e-2, "{part}");
}

/// Two edges of area 1 uV s between rows 1 us apart, beside an exponential diode, for which the run is made in steps.
#[test]
fn a_spectrum_in_steps_does_not_depend_on_the_print_step() {
    let (found, said) = sim("\
snubbed edge beside an exponential diode
v1 in 0 pulse(0 10 3.3u 0 0 37.7u 100u)
r0 in a 10
c1 a out 1n
r1 out 0 100
v2 c 0 sin(0 5 10k)
d1 c b dx
r2 b 0 1k
.model dx d(is=1e-12)
.tran 1u 1m
.four 10k 5 v(out)
.save v(out)
.end
");
    assert!(said.contains("theta"), "{said}");
    let first = found["fourier"][0]["harmonics"][0]["magnitude"]
        .as_f64()
        .unwrap();
    // 2 f |∫ v e^{-jωt} dt|: the edges are 37.7 us apart, of opposite areas R1 C1 10 V.
    let exact = 2.0 * 10e3 * 100.0 * 1e-9 * 10.0 * 2.0 * (std::f64::consts::PI * 0.377).sin();
    assert!((first / exact - 1.0).abs() < 5e-3, "{first} {exact}");
}
