//! `auto` goes on where exact integration alone ends.

use circ::integrate::{Method, Note, Reason, SimOptions};

use super::runs::at;
use super::try_run;

fn by(method: Method) -> SimOptions<'static> {
    SimOptions {
        method,
        ..SimOptions::default()
    }
}

/// A two-point controller whose hysteresis is so small that it switches every 4 fs.
const CHATTER: &str = "V1 1 0 10\nS1 1 2 ref out sw OFF\nR1 2 out 1k\nC1 out 0 1u IC=0\nR2 out 0 10k\n\
    Vref ref 0 PWL(0 5 1m 5 1.1m 8)\n.model sw SW(ideal Vt=0 Vh=1e-11)\n.tran 10u 2m uic\n.save v(out)";

#[test]
fn events_without_end_are_left_to_steps() {
    let error = try_run(CHATTER, by(Method::Exact)).expect_err("too many events");
    assert!(
        matches!(error.reason, Reason::EventsAccumulate { .. }),
        "{error}"
    );
    assert_eq!(error.elements, ["s1"]);
    // Closed: v' = 10⁴ − 1100 v from 0 to 5.
    let (rest, rate): (f64, f64) = (1e4 / 1.1e3, 1.1e3);
    let reach = -(1.0 - 5.0 / rest).ln() / rate;
    assert!((error.t.expect("a time") - reach).abs() < 1e-9, "{error}");

    let run = try_run(CHATTER, by(Method::Auto)).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(run.method, "exact");
    // The switch holds v at the reference until that rises faster than the circuit can follow.
    assert!((at(&run, "v(out)", 0.95e-3) - 5.0).abs() < 1e-3);
    let rise = |t: f64| rest + (5.0 - rest) * (-rate * (t - 1e-3)).exp();
    assert!((at(&run, "v(out)", 2e-3) - rise(2e-3)).abs() < 1e-3);
    assert!(run.energy.residual_relative < 1e-5, "{:?}", run.energy);
    let estimate = run.error.max.expect("the estimate of the steps");
    let error = (at(&run, "v(out)", 0.95e-3) - 5.0).abs() / 6.4;
    assert!(
        (error..100.0 * error).contains(&estimate),
        "{estimate:e} of {error:e}"
    );
    let notes: Vec<&Note> = run
        .notes
        .iter()
        .filter(|n| n.text.contains("took the place of exact integration"))
        .collect();
    assert_eq!(notes.len(), 1, "{:?}", run.notes);
    let words = [
        format!("{reach:e}")[..6].to_owned(),
        "s1: 1024 events".into(),
    ];
    assert!(words.iter().all(|w| notes[0].text.contains(w)), "{notes:?}");
    // Before and after, no step but the exact ones was needed.
    let seconds: f64 = notes[0]
        .text
        .split_once("times more, ")
        .and_then(|(_, rest)| rest.split_once(" s in all"))
        .and_then(|(seconds, _)| seconds.parse().ok())
        .expect("seconds in all");
    assert!((1e-3 - reach..5e-4).contains(&seconds), "{seconds}");
}

/// What steps cannot do either is an error that says where, with the reason of both.
#[test]
fn a_circuit_without_solution_is_an_error_of_both() {
    let text = "V1 1 0 SIN(0 1 1k)\nR1 1 2 1\nE1 3 0 2 0 3\nD1 2 3 d\nC1 2 0 1u\n.model d D(ideal)\n.tran 10u 2m uic";
    let error = try_run(text, by(Method::Auto)).expect_err("no solution");
    assert_eq!(error.elements, ["d1"]);
    let partial = error.partial.expect("the run so far");
    assert_eq!(partial.method, "theta");
    assert!(
        partial
            .notes
            .iter()
            .any(|n| n.text.contains("exact integration ended") && n.text.contains("d1")),
        "{:?}",
        partial.notes
    );
}

/// Two switches, a diode and a relay around one inductor: at 80 µs closing the switch takes an impulse, at 100 µs and on the
/// relay holds its input.
const ENTANGLED: &str = "V1 1 0 pulse(-5 5 0 0.1m 0.1m 0.4m 1m)\nVr ref 0 3\nR2 2 1 5k\nR3 3 1 9k\nR4 4 2 2k\nR5 5 3 80\n\
    C0 5 0 2u ic=0\nS1 2 5 1 ref sa\nD2 0 2 d\nS3 3 2 ref 5 sb\nC4 1 5 7u ic=5\nG5 2 0 4 0 -0.2m\nL6 2 1 0.4m ic=0\n\
    B7 x7 0 v=2*sgn(v(4)-v(ref))\nR7 x7 3 500\n.model d d(ideal)\n.model sa sw(ideal vt=0 vh=0)\n\
    .model sb sw(ron=0.1 roff=inf vt=0 vh=0.1)\n.tran 20u 1m uic\n.save v(5) i(l6)";

#[test]
fn entangled_switches_agree_with_steps() {
    let run = try_run(ENTANGLED, by(Method::Auto)).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(run.method, "exact");
    let steps = SimOptions {
        step: Some(2e-8),
        ..by(Method::Euler)
    };
    let moreau = try_run(ENTANGLED, steps).unwrap_or_else(|e| panic!("{e}"));
    for (a, b) in run.waveforms.values.iter().zip(&moreau.waveforms.values) {
        assert!((a - b).abs() < 0.05, "{a} {b}");
    }
}

/// v(ref) rises from the threshold of both switches: they close at the start, and the source is shorted through d8 and s2.
#[test]
fn a_start_without_an_answer_is_refused_by_steps_too() {
    let text = "V1 1 0 pulse(0 10 0 0 0 0.3m 1m)\nVr ref 0 pulse(0 5 0 1m 0 0 1m)\nR2 2 1 70\nR3 3 2 7\nR4 4 0 60\nR5 5 1 6\n\
        L0 5 4 0.4m ic=0.1\nS2 0 4 ref 0 sa\nC4 4 1 30n ic=0\nB5 x5 0 v=2*sgn(v(3)-v(ref))\nRb5 x5 4 200\nS6 4 3 ref 0 sa\n\
        B7 x7 0 v=2*sgn(v(2)-v(ref))\nRb7 x7 1 100\nD8 1 4 d\n.model d d(ideal)\n.model sa sw(ideal vt=0 vh=0)\n\
        .tran 20u 1m uic\n.save v(4) i(l0)";
    for method in [Method::Auto, Method::Theta] {
        let error = try_run(text, by(method)).unwrap_err().to_string();
        assert!(error.starts_with("at t = 0: d8: "), "{method:?}: {error}");
    }
}
