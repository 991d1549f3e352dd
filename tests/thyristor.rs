//! Thyristors and triacs against closed forms: firing, extinction at the zero of the current, commutation.
#![allow(missing_docs, reason = "tests")]

mod runs;

use std::f64::consts::PI;

use circ::circuit::{ElaborateOptions, elaborate};
use circ::diagnostic::SourceMap;
use circ::integrate::start::{Values, operating_point};
use circ::integrate::{Method, Run, SimOptions, simulate};
use circ::mna::behaviour;
use runs::{at, column, exact, fixed};

const W: f64 = 100.0 * PI;

fn circuit(text: &str) -> circ::circuit::Circuit {
    let mut sources = SourceMap::default();
    let root = sources.add("test.cir", format!("test\n{text}\n.end\n"));
    let (netlist, _) = circ::netlist::parse(&mut sources, root, &|_| unreachable!());
    let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
    circuit.unwrap_or_else(|| panic!("{findings:?}"))
}

fn run_by(text: &str, method: Method, step: Option<f64>) -> Run {
    let circuit = circuit(text);
    let behaviour = behaviour(&circuit).expect("a sound circuit");
    let options = SimOptions {
        method,
        step,
        ..SimOptions::default()
    };
    let run = simulate(&circuit, &behaviour, options).unwrap_or_else(|e| panic!("{e}"));
    assert!(
        run.energy.residual_relative < if step.is_none() { 1e-9 } else { 1e-2 },
        "{:?}",
        run.energy
    );
    run
}

fn run(text: &str) -> Run {
    run_by(text, Method::Exact, None)
}

fn close(what: &str, found: f64, expected: f64, within: f64) {
    assert!(
        (found - expected).abs() <= within,
        "{what}: {found} is not {expected} within {within}"
    );
}

/// The times at which the log says something.
fn times(run: &Run, what: &str) -> Vec<f64> {
    let said = run.events.iter().filter(|e| e.to_string().contains(what));
    said.map(|e| e.t).collect()
}

/// Current of a thyristor with R and L in series that fires at α, as a function of the angle x ≥ α, relative to V/Z: a steady
/// sine and its decaying start.
fn pulse(alpha: f64, phi: f64, x: f64) -> f64 {
    (x - phi).sin() - (alpha - phi).sin() * (-(x - alpha) / phi.tan()).exp()
}

/// Its extinction angle β > π, by bisection.
fn extinction(alpha: f64, phi: f64) -> f64 {
    let (mut low, mut high) = (PI, 2.0 * PI);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if pulse(alpha, phi, middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

const LOAD: &str = "r1 out b 10\nl1 b 0 20m";

/// Z and φ of [`LOAD`].
fn impedance() -> (f64, f64) {
    let x = W * 20e-3;
    (10_f64.hypot(x), (x / 10.0).atan())
}

#[test]
fn a_half_wave_rectifier_has_its_mean_and_its_shape() {
    for alpha in [20.0, 75.0, 90.0, 150.0_f64] {
        let run = run(&format!(
            "v1 a 0 sin(0 100 50)\nvg g out pulse(0 1 {{{alpha}/360/50}} 0 0 100u 20m)
             x1 a g out t\nr1 out 0 10\n.model t scr\n.tran 50u 40m\n.meas tran m avg v(out) from=0 to=40m"
        ));
        let alpha = alpha.to_radians();
        for (k, &t) in run.waveforms.time.iter().enumerate() {
            let x = (W * t) % (2.0 * PI);
            // At the edges themselves either side is right.
            if (x - alpha).abs() > 1e-6 && (x - PI).abs() > 1e-6 {
                let on = x > alpha && x < PI;
                let expected = if on { 100.0 * (W * t).sin() } else { 0.0 };
                close("v(out)", column(&run, "v(out)")[k], expected, 1e-9 * 100.0);
            }
        }
    }
}

#[test]
fn an_inductive_load_conducts_until_its_extinction_angle() {
    let (z, phi) = impedance();
    for alpha in [45.0, 60.0, 120.0_f64] {
        let run = run(&format!(
            "v1 a 0 sin(0 100 50)\nvg g out pulse(0 1 {{{alpha}/360/50}} 0 0 100u 20m)
             x1 a g out t\n{LOAD}\n.model t scr\n.tran 50u 60m\n.save i(l1) i(x1) v(out)"
        ));
        let alpha = alpha.to_radians();
        let beta = extinction(alpha, phi);
        let off = times(&run, "x1.latch off");
        assert_eq!(off.len(), 3);
        for (k, t) in off.iter().enumerate() {
            let expected = (beta + 2.0 * PI * k as f64) / W;
            close("extinction", *t, expected, 1e-13);
        }
        for (k, &t) in run.waveforms.time.iter().enumerate() {
            let x = (W * t) % (2.0 * PI);
            let inside = x > alpha && x < beta;
            let i = if inside {
                100.0 / z * pulse(alpha, phi, x)
            } else {
                0.0
            };
            close("i(x1)", column(&run, "i(x1)")[k], i, 1e-9 * 10.0);
            close("i(l1)", column(&run, "i(l1)")[k], i, 1e-9 * 10.0);
            if !inside && (x - beta).abs() > 1e-6 && (x - alpha).abs() > 1e-6 {
                close("v(out)", column(&run, "v(out)")[k], 0.0, 1e-9 * 100.0);
            }
        }
    }
}

#[test]
fn the_steppers_find_the_same_extinction() {
    let (_, phi) = impedance();
    let text = format!(
        "v1 a 0 sin(0 100 50)\nvg g out pulse(0 1 4m 0 0 100u 20m)\nx1 a g out t\n{LOAD}
         .model t scr\n.tran 50u 60m\n.save i(l1)"
    );
    let reference = run(&text);
    let beta = extinction(0.4 * PI, phi);
    for (method, within) in [(Method::Theta, 5e-3), (Method::Euler, 5e-2)] {
        let found = run_by(&text, method, Some(20e-6));
        let off = times(&found, "x1.latch off");
        assert_eq!(off.len(), 3, "{:?}", found.events);
        for (k, t) in off.iter().enumerate() {
            // Within one step after it.
            let expected = (beta + 2.0 * PI * k as f64) / W;
            assert!(
                *t >= expected - 20e-6 && *t <= expected + 40e-6,
                "{t} {expected}"
            );
        }
        for (a, b) in column(&reference, "i(l1)")
            .iter()
            .zip(column(&found, "i(l1)"))
        {
            close("i(l1)", b, *a, within * 10.0);
        }
    }
    let controlled = {
        let circuit = circuit(&text);
        let behaviour = behaviour(&circuit).expect("a sound circuit");
        let options = SimOptions {
            method: Method::Theta,
            ..SimOptions::default()
        };
        simulate(&circuit, &behaviour, options).unwrap_or_else(|e| panic!("{e}"))
    };
    for (a, b) in column(&reference, "i(l1)")
        .iter()
        .zip(column(&controlled, "i(l1)"))
    {
        close("i(l1)", b, *a, 1e-4 * 10.0);
    }
}

#[test]
fn a_triac_conducts_both_ways() {
    let (z, phi) = impedance();
    let alpha = 0.55 * PI;
    let beta = extinction(alpha, phi);
    let run = run(&format!(
        "v1 a 0 sin(0 100 50)\nvg g out pulse(0 1 {{0.55*10m}} 0 0 100u 10m)\nx1 a g out t\n{LOAD}
         .model t triac\n.tran 50u 60m\n.save i(l1) i(x1)"
    ));
    let i = |t: f64| {
        let half = (W * t / PI).floor();
        [half - 1.0, half]
            .iter()
            .map(|half| {
                let x = W * t - PI * half;
                let sign = if half.rem_euclid(2.0) == 0.0 {
                    1.0
                } else {
                    -1.0
                };
                if *half >= 0.0 && x > alpha && x < beta {
                    sign * 100.0 / z * pulse(alpha, phi, x)
                } else {
                    0.0
                }
            })
            .sum::<f64>()
    };
    for (k, &t) in run.waveforms.time.iter().enumerate() {
        close("i(x1)", column(&run, "i(x1)")[k], i(t), 1e-9 * 10.0);
    }
    // A negative gate fires it as well.
    let negative = run_by(
        &format!(
            "v1 a 0 sin(0 100 50)\nvg g out pulse(0 -1 {{0.55*10m}} 0 0 100u 10m)\nx1 a g out t\n{LOAD}
             .model t triac\n.tran 50u 60m\n.save i(l1) i(x1)"
        ),
        Method::Exact,
        None,
    );
    assert_eq!(column(&run, "i(x1)"), column(&negative, "i(x1)"));
}

#[test]
fn a_triac_with_its_gate_held_is_a_switch() {
    let text = |device: &str| {
        format!(
            "v1 a 0 sin(0 100 50)\nvg g out pulse(0 1 3m 0 0 1 2)\n{device}\n{LOAD}\n.tran 50u 60m\n.save i(l1)"
        )
    };
    let triac = run(&text("x1 a g out t\n.model t triac"));
    let switch = run(&text("s1 a out g out t\n.model t sw(ideal vt=0.5)"));
    for (a, b) in column(&triac, "i(l1)").iter().zip(column(&switch, "i(l1)")) {
        close("i(l1)", *a, b, 1e-9 * 10.0);
    }
}

#[test]
fn a_gate_in_reverse_leaves_nothing_behind() {
    for method in [Method::Exact, Method::Theta, Method::Euler] {
        let text = format!(
            "v1 a 0 sin(0 100 50)\nvg g out pulse(0 1 12m 0 0 6m 20m)\nx1 a g out t\n{LOAD}
             .model t scr\n.tran 50u 60m\n.save i(x1) v(out)"
        );
        let run = run_by(&text, method, Some(50e-6));
        assert_eq!(times(&run, "x1.latch on").len(), 3);
        assert_eq!(times(&run, "x1.latch off").len(), 3);
        // Steppers read voltages of inductors a fraction of a step late.
        let late = if method == Method::Exact { 1e-9 } else { 1e-3 };
        for (name, limit) in [("i(x1)", 1e-9), ("v(out)", late)] {
            let largest = column(&run, name)
                .iter()
                .fold(0.0_f64, |a, v| a.max(v.abs()));
            assert!(largest < limit, "{name} {largest}");
        }
    }
}

#[test]
fn a_gate_that_waits_in_reverse_fires_at_the_zero_of_the_voltage() {
    // The gate is on from 12 ms to 26 ms; the source turns positive at 20 ms.
    let run = run(
        "v1 a 0 sin(0 100 50)\nvg g out pulse(0 1 12m 0 0 14m 1)\nx1 a g out t\nr1 out 0 10
         .model t scr\n.tran 50u 60m\n.save v(out)",
    );
    for (k, &t) in run.waveforms.time.iter().enumerate() {
        let expected = if t > 20e-3 && t < 30e-3 {
            100.0 * (W * t).sin()
        } else {
            0.0
        };
        close("v(out)", column(&run, "v(out)")[k], expected, 1e-9 * 100.0);
    }
}

#[test]
fn it_lets_go_below_its_holding_current() {
    // 100 sin x / 10 = 1 at x = π − asin 0.1.
    let text =
        "v1 a 0 sin(0 100 50)\nvg g out pulse(0 1 3m 0 0 100u 20m)\nx1 a g out t\nr1 out 0 10
                .model t scr(ih=1)\n.tran 50u 40m\n.save v(out)";
    let expected = (PI - 0.1_f64.asin()) / W;
    let off = times(&run(text), "x1.latch off");
    assert_eq!(off.len(), 2);
    close("exact", off[0], expected, 1e-15);
    let stepped = times(&run_by(text, Method::Theta, Some(50e-6)), "x1.latch off");
    close("stepped", stepped[0], expected, 1e-10);
    // With less than the holding current it conducts only as long as its gate is on.
    let weak = run(
        "v1 a 0 100\nvg g out pulse(0 1 3m 0 0 100u 20m)\nx1 a g out t\nr1 out 0 101
         .model t scr(ih=1)\n.tran 50u 10m\n.save v(out)",
    );
    close("on", at(&weak, "v(out)", 3.05e-3), 100.0, 1e-9);
    close("off", at(&weak, "v(out)", 3.2e-3), 0.0, 1e-9);
}

#[test]
fn the_gate_draws_its_trigger_current() {
    // 0.8 V and 20 mA make 40 Ω; through 60 Ω that takes 2 V.
    let fires = |volts: f64| {
        let run = run(&format!(
            "v1 a 0 100\nvg h 0 pulse(0 {volts} 1m 0 0 1m 1)\nrg h g 60\nr1 a b 10\nx1 b g 0 t
             .model t scr(vgt=0.8 igt=20m)\n.tran 50u 3m\n.save v(b) v(g)"
        ));
        close("v(g)", at(&run, "v(g)", 1.5e-3), 0.4 * volts, 1e-12);
        at(&run, "v(b)", 2.5e-3) < 1e-9
    };
    assert!(!fires(1.999));
    assert!(fires(2.001));
}

#[test]
fn drop_and_resistance_follow_the_model() {
    for model in ["scr(vfwd=0.7 ron=0.02)", "thyristor(vtm=1.1 itm=20)"] {
        let run = run(&format!(
            "v1 a 0 10\nvg g out pulse(0 1 1m 0 0 1m 1)\nx1 a g out t\nr1 out 0 0.98\n.model t {model}
             .tran 50u 3m\n.save i(x1)"
        ));
        close("i(x1)", at(&run, "i(x1)", 2.5e-3), 9.3, 1e-11);
    }
    let leaks = run(
        "v1 a 0 -10\nvg g out 0\nx1 a g out t\nr1 out 0 1k\n.model t scr(roff=9k)\n.tran 50u 1m\n.save i(x1)",
    );
    close("leak", at(&leaks, "i(x1)", 0.5e-3), -1e-3, 1e-12);
}

#[test]
fn the_operating_point_knows_gates() {
    let point = |gate: f64| {
        let circuit = circuit(&format!(
            "v1 a 0 10\nvg g out {gate}\nx1 a g out t\nr1 out 0 1k\n.model t scr\n.tran 1u 1m"
        ));
        let point = operating_point(
            &circuit,
            Values::Dc,
            false,
            &circ::settings::Settings::default(),
        );
        let nodes = point.unwrap_or_else(|e| panic!("{e}")).nodes;
        nodes.iter().find(|n| n.0 == "out").expect("a node").1
    };
    assert_eq!(point(0.0), 0.0);
    close("gated", point(1.0), 10.0, 1e-12);
}

#[test]
fn forced_commutation_follows_its_exponentials() {
    let run = exact("scr-commutation");
    // c1 while x1 conducts relaxes to −100 V from what is left after 1 ms; then the load discharges it to 100 V.
    let first = -100.0 * (-1e-3_f64 / (1010.0 * 20e-6)).exp();
    let before = -100.0 + (first + 100.0) * (-3e-3_f64 / (1000.0 * 20e-6)).exp();
    for t in [4.1e-3, 4.5e-3, 6e-3] {
        let v = (100.0 - before) * (-(t - 4e-3) / 200e-6_f64).exp();
        close("v(y)", at(&run, "v(y)", t), v, 1e-9 * 200.0);
        close("i(x1)", at(&run, "i(x1)", t), 0.0, 1e-9 * 10.0);
        close("i(x2)", at(&run, "i(x2)", t), v / 10.0 + 0.1, 1e-9 * 10.0);
    }
    let off = times(&run, "x1.latch off");
    close("x1 ends where x2 fires", off[0], 4e-3, 1e-15);
    close(
        "x2 ends where x1 fires",
        times(&run, "x2.latch off")[0],
        11e-3,
        1e-15,
    );
}

#[test]
fn the_half_controlled_bridge_freewheels() {
    let run = exact("scr-rectifier");
    let v = column(&run, "v(p,n)");
    for (k, &t) in run.waveforms.time.iter().enumerate() {
        // From the first firing on the current never ends: the source above 60° of every half-wave, else 0 V.
        let x = (W * t) % PI;
        let away = [PI / 3.0, 0.0, PI]
            .iter()
            .all(|edge| (x - edge).abs() > 1e-6);
        if t > 3.34e-3 && away {
            let expected = if x > PI / 3.0 { 325.0 * x.sin() } else { 0.0 };
            close("v(p,n)", v[k], expected, 1e-9 * 325.0);
        }
    }
}

#[test]
fn the_controlled_bridge_has_its_mean_voltage() {
    // Mean of the output in the steady state: 3√3 V cos α/π − 3ωL I/π, where the mean current is that over 5 Ω.
    let run = exact("scr-bridge");
    let t = &run.waveforms.time;
    let mean = |values: &[f64]| {
        let from = t.iter().position(|t| *t >= 80e-3).expect("a time");
        let pairs =
            (from..t.len() - 1).map(|k| 0.5 * (values[k] + values[k + 1]) * (t[k + 1] - t[k]));
        pairs.sum::<f64>() / 20e-3
    };
    // The voltage jumps between rows, the current does not; in the steady state its mean is that of v/5 Ω.
    let i = mean(&column(&run, "i(lload)"));
    let ideal = 3.0 * 3_f64.sqrt() * 325.0 / PI * 45_f64.to_radians().cos();
    let overlap = 3.0 * W * 0.2e-3 * i / PI;
    close("5 i", 5.0 * i, ideal - overlap, 0.1 * overlap);
    let stepped = fixed("scr-bridge", 0.5, 0.5, 20e-6);
    let gap = |a: &Run, b: &Run| (at(a, "i(lload)", 90e-3) - at(b, "i(lload)", 90e-3)).abs();
    assert!(gap(&run, &stepped) < 1e-2, "{}", gap(&run, &stepped));
}

/// The errors of a netlist.
fn faults(text: &str) -> Vec<String> {
    let mut sources = SourceMap::default();
    let root = sources.add("test.cir", format!("test\n{text}\n.end\n"));
    let (netlist, _) = circ::netlist::parse(&mut sources, root, &|_| unreachable!());
    let (_, findings) = elaborate(&netlist, &ElaborateOptions::default());
    let errors = findings
        .into_iter()
        .filter(|d| d.severity == circ::diagnostic::Severity::Error);
    errors.map(|d| d.message).collect()
}

#[test]
fn faults_are_located() {
    let with =
        |card: &str, model: &str| faults(&format!("v1 a 0 1\nr1 a k 1\n{card}\n.model t {model}"));
    assert_eq!(with("x1 a k 0 t", "scr(vgt=1)"), Vec::<String>::new());
    for (card, model, expected) in [
        (
            "x1 a k t",
            "scr",
            "`x1` connects 2 nodes, a thyristor has 3",
        ),
        (
            "x1 a k 0 t",
            "d",
            "`x1` uses model `t`, which is of type `d`",
        ),
        (
            "x1 a k 0 t",
            "scr(vgt=0)",
            "Vgt of thyristor model `t` is out of range",
        ),
        (
            "x1 a k 0 t",
            "scr(ih=-1m)",
            "Ih of thyristor model `t` is out of range",
        ),
        (
            "x1 a k 0 t",
            "triac(vtm=1.5 itm=0)",
            "Ron of thyristor model `t` is out of range",
        ),
        ("x1 a k 0 u", "scr", "`x1` calls unknown subcircuit `u`"),
    ] {
        assert_eq!(with(card, model), [expected]);
    }
}
