//! Ideal transmission lines against the closed forms of their reflections.
#![allow(missing_docs, reason = "tests")]

mod runs;

use std::f64::consts::PI;

use circ::circuit::{Circuit, ElaborateOptions, elaborate};
use circ::diagnostic::{Severity, SourceMap};
use circ::integrate::start::{Values, operating_point};
use circ::integrate::{Error, Method, Run, SimOptions, simulate};
use circ::mna::behaviour;
use runs::{at, column};

fn read(text: &str) -> (Option<Circuit>, Vec<String>) {
    let mut sources = SourceMap::default();
    let root = sources.add("test.cir", format!("test\n{text}\n.end\n"));
    let (netlist, _) = circ::netlist::parse(&mut sources, root, &|_| unreachable!());
    let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
    let errors = findings.iter().filter(|d| d.severity == Severity::Error);
    let errors = errors.map(|d| d.message.clone()).collect();
    (circuit, errors)
}

fn circuit(text: &str) -> Circuit {
    let (circuit, errors) = read(text);
    circuit.unwrap_or_else(|| panic!("{errors:?}"))
}

fn try_run(text: &str, options: SimOptions<'_>) -> Result<Run, Error> {
    let circuit = circuit(text);
    let behaviour = behaviour(&circuit).expect("a sound circuit");
    simulate(&circuit, &behaviour, options)
}

fn run(text: &str) -> Run {
    try_run(text, SimOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn stepped(text: &str, step: f64) -> Run {
    let options = SimOptions {
        method: Method::Theta,
        step: Some(step),
        ..SimOptions::default()
    };
    try_run(text, options).unwrap_or_else(|e| panic!("{e}"))
}

fn close(what: &str, found: f64, expected: f64, within: f64) {
    assert!(
        (found - expected).abs() <= within,
        "{what}: {found} is not {expected} within {within}"
    );
}

/// Voltages of both ends at `t` for a unit step at 0 through `rs` into a line of 50 Ω and 10 ns, `rl` at its end: every
/// reflection adds its part (the bounce diagram).
fn staircase(rs: f64, rl: f64, t: f64) -> (f64, f64) {
    let z = 50.0;
    let gamma = |r: f64| {
        if r.is_finite() {
            (r - z) / (r + z)
        } else {
            1.0
        }
    };
    let (source, load) = (gamma(rs), gamma(rl));
    let mut wave = z / (z + rs);
    let (mut near, mut far) = (wave, 0.0);
    for trip in 1..200 {
        let arrived = t > f64::from(trip) * 10e-9;
        let end = if trip % 2 == 1 { &mut far } else { &mut near };
        let reflection = if trip % 2 == 1 { load } else { source };
        if arrived {
            *end += wave * (1.0 + reflection);
        }
        wave *= reflection;
    }
    (near, far)
}

#[test]
fn steps_climb_their_staircases() {
    let infinite = f64::INFINITY;
    for (rs, rl) in [
        (50.0, 50.0),
        (25.0, 150.0),
        (200.0, 10.0),
        (50.0, infinite),
        (10.0, infinite),
        (50.0, 0.0),
        (75.0, 0.0),
    ] {
        // The far end open: nothing but a conductance that is none.
        let load = if rl == infinite {
            "iload b 0 0".to_string()
        } else {
            format!("rload b 0 {rl}")
        };
        let text = format!(
            "v1 s 0 pulse(0 1 0 0 0 1 2)\nrs s a {rs}\nt1 a 0 b 0 z0=50 td=10n\n{load}\n.tran 1n 200n uic\n.save v(a) v(b)"
        );
        for run in [run(&text), stepped(&text, 1e-9), stepped(&text, 0.7e-9)] {
            for (k, &t) in run.waveforms.time.iter().enumerate() {
                let near_edge = (t / 10e-9 - (t / 10e-9).round()).abs() < 1e-6;
                if !near_edge {
                    let (near, far) = staircase(rs, rl, t);
                    close(
                        &format!("v(a) {rs} {rl} {t}"),
                        column(&run, "v(a)")[k],
                        near,
                        1e-12,
                    );
                    close(
                        &format!("v(b) {rs} {rl} {t}"),
                        column(&run, "v(b)")[k],
                        far,
                        1e-12,
                    );
                }
            }
            assert!(
                run.energy.residual_relative < 1e-12,
                "{rs} {rl} {:?}",
                run.energy
            );
        }
    }
}

#[test]
fn the_line_holds_its_energy() {
    // Half way through the first trip, 5 ns of 0.5 V and 10 mA are under way; after all of it V² C/2 with C = delay/Z.
    let text = |stop: &str| {
        format!(
            "v1 s 0 pulse(0 1 0 0 0 1 2)\nrs s a 50\nt1 a 0 b 0 z0=50 td=10n\niload b 0 0\n.tran 1n {stop} uic\n.save v(b)"
        )
    };
    close(
        "half way",
        run(&text("5n")).energy.stored,
        0.5 * 10e-3 * 5e-9,
        1e-22,
    );
    close(
        "full",
        run(&text("30n")).energy.stored,
        0.5 * 10e-9 / 50.0,
        1e-22,
    );
}

#[test]
fn frequency_and_wavelengths_are_a_delay() {
    let text = |delay: &str| {
        format!(
            "v1 s 0 pulse(0 1 0 0 0 1 2)\nrs s a 50\nt1 a 0 b 0 zo=50 {delay}\nrl b 0 50\n.tran 1n 50n uic\n.save v(b)"
        )
    };
    let expected = column(&run(&text("td=10n")), "v(b)");
    for other in ["f=25meg", "f=50meg nl=0.5", "nl=1 f=100meg"] {
        assert_eq!(column(&run(&text(other)), "v(b)"), expected, "{other}");
    }
}

#[test]
fn initial_conditions_travel() {
    // 1 V and no current everywhere are two waves of 1 V; both ends into 50 Ω lose it in one trip.
    let run = run(
        "r1 a 0 50\nt1 a 0 b 0 z0=50 td=10n ic=1,0,1,0\nr2 b 0 50\n.tran 1n 30n uic\n.save v(a) v(b)",
    );
    for name in ["v(a)", "v(b)"] {
        close(name, at(&run, name, 5e-9), 0.5, 1e-12);
        close(name, at(&run, name, 15e-9), 0.0, 1e-12);
    }
}

#[test]
fn at_rest_it_is_a_short() {
    let text = "v1 s 0 12\nrs s a 100\nt1 a 0 b 0 z0=50 td=10n\nrl b 0 200\n.tran 1n 100n\n.save v(a) v(b) i(v1)";
    let point = operating_point(
        &circuit(text),
        Values::Dc,
        false,
        &circ::settings::Settings::default(),
    );
    let nodes = point.unwrap_or_else(|e| panic!("{e}")).nodes;
    for name in ["a", "b"] {
        let found = nodes.iter().find(|n| n.0 == name).expect("a node").1;
        close(name, found, 8.0, 1e-12);
    }
    // A run that begins there stays there.
    let run = run(text);
    for (name, expected) in [("v(a)", 8.0), ("v(b)", 8.0), ("i(v1)", -0.04)] {
        for value in column(&run, name) {
            close(name, value, expected, 1e-12);
        }
    }
}

/// Steady state at the end of a line: v(b) of a unit sine at `f` through Rs = 25 Ω into 50 Ω, 10 ns and `load` (Ω).
fn phasor(f: f64, load: (f64, f64)) -> (f64, f64) {
    type Complex = (f64, f64);
    let add = |a: Complex, b: Complex| (a.0 + b.0, a.1 + b.1);
    let mul = |a: Complex, b: Complex| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
    let div = |a: Complex, b: Complex| {
        let size = b.0 * b.0 + b.1 * b.1;
        (
            (a.0 * b.0 + a.1 * b.1) / size,
            (a.1 * b.0 - a.0 * b.1) / size,
        )
    };
    // v_s = v_b [cos θ + j (Z/Z_L) sin θ] + Rs v_b [cos θ/Z_L + j sin θ/Z]
    let theta = 2.0 * PI * f * 10e-9;
    let (c, s) = ((theta.cos(), 0.0), (0.0, theta.sin()));
    let voltage = add(c, div(mul((50.0, 0.0), s), load));
    let current = add(div(c, load), div(s, (50.0, 0.0)));
    div((1.0, 0.0), add(voltage, mul((25.0, 0.0), current)))
}

/// Largest error of v(b) in the last two periods, against the steady state.
fn steady_error(step: f64) -> f64 {
    let f = 7e6;
    let w = 2.0 * PI * f;
    let run = stepped(
        &format!(
            "v1 s 0 sin(0 1 {f})\nrs s a 25\nt1 a 0 b 0 z0=50 td=10n\nrl b c 60\nll c 0 1u\n.tran 1n 2u\n.save v(b)"
        ),
        step,
    );
    let (re, im) = phasor(f, (60.0, w * 1e-6));
    let rows = run.waveforms.time.iter().zip(column(&run, "v(b)"));
    let late = rows.filter(|(t, _)| **t > 1.7e-6);
    late.map(|(t, v)| (v - (re * (w * t).sin() + im * (w * t).cos())).abs())
        .fold(0.0, f64::max)
}

#[test]
fn the_steps_are_of_second_order() {
    let errors: Vec<f64> = [1e-9, 0.5e-9, 0.25e-9].map(steady_error).to_vec();
    assert!(errors[2] < 2e-4, "{errors:?}");
    for pair in errors.windows(2) {
        let ratio = pair[0] / pair[1];
        assert!((3.5..4.6).contains(&ratio), "{errors:?}");
    }
}

#[test]
fn a_rectifier_sees_a_delayed_source() {
    // Matched at the source, 20 ns before a clamp: e = v_s(t − delay), and the diode conducts where e > 5 V.
    let run = run(
        "v1 s 0 sin(0 20 1meg)\nrs s a 50\nt1 a 0 b 0 z0=50 td=20n\nd1 b c ideal\nvc c 0 5\n.model ideal d(ideal)
         .tran 5n 3u uic\n.save v(b) i(d1)",
    );
    let w = 2.0 * PI * 1e6;
    for (k, &t) in run.waveforms.time.iter().enumerate() {
        // Branin: v = e − 50 i, with e twice the forward wave, v_s/2.
        let e = if t > 20e-9 {
            20.0 * (w * (t - 20e-9)).sin()
        } else {
            0.0
        };
        let i = ((e - 5.0) / 50.0).max(0.0);
        close("i(d1)", column(&run, "i(d1)")[k], i, 2e-4 * 0.4);
        close("v(b)", column(&run, "v(b)")[k], e - 50.0 * i, 2e-4 * 20.0);
    }
}

#[test]
fn a_switch_may_follow_what_arrives() {
    // The far end rises to 0.5 V after 10 ns and closes a switch there.
    let run = run(
        "v1 s 0 pulse(0 1 0 0 0 1 2)\nrs s a 50\nt1 a 0 b 0 z0=50 td=10n\nrl b 0 50\ns1 c 0 b 0 sw\nv2 d 0 1\nr2 d c 1k
         .model sw sw(ideal vt=0.25)\n.tran 1n 30n uic\n.save v(c)",
    );
    close("before", at(&run, "v(c)", 9e-9), 1.0, 1e-12);
    close("after", at(&run, "v(c)", 12e-9), 0.0, 1e-12);
}

#[test]
fn exact_integration_says_why_not() {
    let text = "v1 s 0 1\nrs s a 50\nt1 a 0 b 0 z0=50 td=10n\nrl b 0 50\n.tran 1n 30n";
    let options = SimOptions {
        method: Method::Exact,
        ..SimOptions::default()
    };
    let refusal = try_run(text, options).unwrap_err().to_string();
    assert!(
        refusal.contains("t1.e1 is a delayed wave on a transmission line"),
        "{refusal}"
    );
    assert!(
        run(text)
            .plan
            .iter()
            .any(|words| words.contains("delayed wave"))
    );
}

#[test]
fn a_delay_too_short_for_the_run_is_refused() {
    let text = "v1 s 0 1\nrs s a 50\nt1 a 0 b 0 z0=50 td=1f\nrl b 0 50\n.tran 1u 1m";
    let refusal = try_run(text, SimOptions::default())
        .unwrap_err()
        .to_string();
    assert!(
        refusal.contains("t1.e1: a delay of 1e-15 s asks for more than"),
        "{refusal}"
    );
}

#[test]
fn faults_are_located() {
    for (card, expected) in [
        ("t1 a 0 b 0 td=1n", "`t1` names no impedance `Z0`"),
        (
            "t1 a 0 b 0 z0=50",
            "`t1` names neither a delay `TD` nor a frequency `F`",
        ),
        (
            "t1 a 0 b 0 z0=-50 td=1n",
            "`t1` has an impedance or a delay that is not positive",
        ),
        (
            "t1 a 0 b 0 z0=50 td=0",
            "`t1` has an impedance or a delay that is not positive",
        ),
        (
            "t1 a 0 b 0 z0=50 f=0",
            "`t1` has an impedance or a delay that is not positive",
        ),
    ] {
        let (_, errors) = read(&format!("r1 a 0 1\nr2 b 0 1\n{card}"));
        assert_eq!(errors, [expected], "{card}");
    }
}
