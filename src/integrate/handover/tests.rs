//! Handing over on the way, whatever the reason.

use super::*;
use crate::integrate::exact::tests::bridges::BRIDGE;
use crate::integrate::exact::tests::{circuit, prepare_circuit};
use crate::integrate::step::Scheme;
use crate::integrate::theta::{Setup, Start, Stepping as Steps};
use crate::settings::Settings;

const STEP: f64 = 1e-7;
const SHORTEST: f64 = 2e-5;

/// The bridge, which is a parallel RLC circuit for its capacitor.
fn bridge() -> Handover {
    let circuit = circuit(&format!("{BRIDGE}.tran 1u 5m uic\n.save v(1)"));
    let (exact, lcs, _) = prepare_circuit(&circuit, true);
    let takeover: Takeover = Box::new(move |place| {
        let lcs = lcs.clone();
        Theta::new(Setup {
            reduce: Box::new(move |_| Ok(lcs.clone())),
            position: place.switches.clone(),
            thresholds: vec![],
            t: place.t,
            start: Start::Storage(place.storage.clone()),
            scheme: Scheme::MOREAU,
            stepping: Steps::Fixed(STEP),
            longest: f64::INFINITY,
            settings: Settings::default(),
        })
    });
    Handover::new(exact, takeover, STEP, SHORTEST)
}

/// v of the capacitor, V: R = 1 kΩ, L = 10 mH, C = 1 µF from 10 V.
fn voltage(t: f64) -> f64 {
    let alpha: f64 = 500.0;
    let omega = (1e8 - alpha * alpha).sqrt();
    10.0 * (-alpha * t).exp() * ((omega * t).cos() - alpha / omega * (omega * t).sin())
}

fn no_mode(t: f64) -> Error {
    Error::at(t, Reason::Infeasible).device("df1")
}

#[test]
fn steps_take_over_where_no_mode_is_found_and_give_back() {
    let mut run = bridge();
    let mut log = Log::new(1, 0.0, false);
    let mut row = [0.0];
    let mut error = |run: &mut Handover, t: f64| {
        run.read(&mut row);
        (row[0] - voltage(t)).abs() / 10.0
    };
    run.advance(1e-3, &mut log).unwrap();
    assert!(error(&mut run, 1e-3) < 1e-12);
    run.give_way(no_mode(1e-3)).unwrap();
    run.advance(1.01e-3, &mut log).unwrap();
    assert!(run.stepping.is_some() && run.time() == 1.01e-3);
    // The exact integration starts from where the steps came to, off by what they were.
    let mut largest = error(&mut run, 1.01e-3);
    assert!((1e-6..1e-3).contains(&largest), "{largest:e}");
    for t in [1.5e-3, 2e-3, 3e-3, 4e-3, 5e-3] {
        run.advance(t, &mut log).unwrap();
        assert!(run.stepping.is_none());
        largest = largest.max(error(&mut run, t));
    }
    assert!((1e-6..1e-3).contains(&largest), "{largest:e}");
    assert!((run.resumed - 1.02e-3).abs() < 1e-15);
    let outcome = run.finish();
    assert_eq!(
        outcome.notes,
        [Note::of(
            "steps-instead",
            ["df1"],
            "between t = 1e-3 s and t = 1.02e-3 s Moreau's steps of 1e-7 s took the place of exact integration: df1: the \
             one-step complementarity problem has no solution (no state of the devices satisfies the circuit equations)"
        )]
    );
    assert!(outcome.stats.steps > 200);
    assert!(
        outcome.energy.residual_relative < 1e-3,
        "{:?}",
        outcome.energy
    );
}

#[test]
fn an_interval_that_was_too_short_is_doubled() {
    let mut run = bridge();
    let mut log = Log::new(1, 0.0, false);
    run.advance(1e-3, &mut log).unwrap();
    for doubled in [1.0, 2.0, 4.0] {
        let t = run.time();
        run.give_way(no_mode(t)).unwrap();
        let until = t + doubled * SHORTEST;
        assert!((run.stepping.as_ref().unwrap().until - until).abs() < 1e-15);
        run.advance(until + 1e-6, &mut log).unwrap();
        assert!(run.stepping.is_none());
    }
    run.advance(3e-3, &mut log).unwrap();
    run.give_way(no_mode(3e-3)).unwrap();
    assert_eq!(run.stepping.as_ref().unwrap().until, 3e-3 + SHORTEST);
    run.advance(4e-3, &mut log).unwrap();
    let notes = run.finish().notes;
    assert!(
        notes.len() == 1 && notes[0].text.contains("(and 3 times more"),
        "{notes:?}"
    );
}

#[test]
fn too_many_steps_are_not_answered_with_more() {
    let mut run = bridge();
    run.advance(1e-3, &mut Log::new(1, 0.0, false)).unwrap();
    let error = Error::at(1e-3, Reason::TooManySteps { limit: 7 });
    assert_eq!(
        run.give_way(error).unwrap_err().reason,
        Reason::TooManySteps { limit: 7 }
    );
}
