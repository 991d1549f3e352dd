//! `auto` goes on where exact integration alone ends.

use circ::integrate::{Method, Reason, SimOptions};

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
    assert_eq!(error.device.as_deref(), Some("s1"));
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
    let notes: Vec<&String> = run
        .notes
        .iter()
        .filter(|n| n.contains("took the place of exact integration"))
        .collect();
    assert_eq!(notes.len(), 1, "{:?}", run.notes);
    let words = [
        format!("{reach:e}")[..6].to_owned(),
        "s1: 1024 events".into(),
    ];
    assert!(words.iter().all(|w| notes[0].contains(w)), "{notes:?}");
    // Before and after, no step but the exact ones was needed.
    let seconds: f64 = notes[0]
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
    assert_eq!(error.device.as_deref(), Some("d1"));
    let partial = error.partial.expect("the run so far");
    assert_eq!(partial.method, "theta");
    assert!(
        partial
            .notes
            .iter()
            .any(|n| n.contains("exact integration ended") && n.contains("d1")),
        "{:?}",
        partial.notes
    );
}
