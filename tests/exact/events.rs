//! Rows at event times: one where nothing jumps, the values before and after where something does.

use circ::integrate::{Method, Run, SimOptions};

use super::try_run;

fn run(text: &str, method: Method) -> Run {
    let options = SimOptions {
        method,
        events: true,
        step: (method == Method::Euler).then_some(1e-5),
        ..SimOptions::default()
    };
    try_run(text, options).unwrap_or_else(|e| panic!("{e}"))
}

/// Rows that are not on the grid of half milliseconds, and pairs on it.
fn rows(run: &Run) -> Vec<(f64, Vec<f64>)> {
    let width = run.waveforms.names.len();
    let all: Vec<(f64, Vec<f64>)> = run
        .waveforms
        .time
        .iter()
        .zip(run.waveforms.values.chunks(width))
        .map(|(t, row)| ((t * 1e9).round() * 1e-6, row.to_vec()))
        .collect();
    let on_grid = |t: f64| (t / 0.5 - (t / 0.5).round()).abs() < 1e-9;
    let twice = |t: f64| all.iter().filter(|r| r.0 == t).count() > 1;
    all.iter()
        .filter(|(t, _)| !on_grid(*t) || twice(*t))
        .cloned()
        .collect()
}

/// A source drives a switch by an edge, then by a ramp; the output follows at once, a capacitor's voltage later.
const DRIVEN: &str = "V1 1 0 5\nS1 1 2 g 0 sw\nR1 2 0 1k\nR2 2 c 1k\nC1 c 0 1u IC=0\n\
    Vg g 0 PWL(0 0 1.1m 0 1.1m 1 3m 1 4m 0)\n.model sw SW(ideal Vt=0.25 Vh=0)\n.tran 0.5m 5m uic\n.save v(g) v(2) v(c) i(S1)";

#[test]
fn switches_that_sources_drive_list_before_and_after() {
    let charged = 5.0 * -(-2.65_f64).exp_m1();
    // On from 1.1 ms, C through R2; off when the ramp is at 0.25, then through R1 + R2.
    let expected = [
        (1.1, vec![0.0, 0.0, 0.0, 0.0]),
        (1.1, vec![1.0, 5.0, 0.0, 10e-3]),
        (
            3.75,
            vec![0.25, 5.0, charged, 5e-3 + (5.0 - charged) * 1e-3],
        ),
        (3.75, vec![0.25, 0.5 * charged, charged, 0.0]),
    ];
    let exact = run(DRIVEN, Method::Exact);
    let found = rows(&exact);
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for ((t, row), (time, values)) in found.iter().zip(&expected) {
        assert!((t - time).abs() < 1e-9, "{t} {time}");
        for (a, b) in row.iter().zip(values) {
            assert!((a - b).abs() < 1e-12, "{t}: {row:?} {values:?}");
        }
    }
    let events: Vec<String> = exact.events.iter().map(ToString::to_string).collect();
    assert_eq!(events, ["s1 on", "s1 off"]);
    // The stepper lists the same rows.
    let stepped = rows(&run(DRIVEN, Method::Euler));
    assert_eq!(stepped.len(), expected.len(), "{stepped:?}");
    for ((t, row), (time, values)) in stepped.iter().zip(&expected) {
        assert!((t - time).abs() < 1e-9, "{t} {time}");
        for (a, b) in row.iter().zip(values) {
            assert!((a - b).abs() < 0.05, "{t}: {row:?} {values:?}");
        }
    }
}

#[test]
fn edges_without_a_switch_are_pairs_and_continuous_events_single_rows() {
    // The edge at 1.1 ms moves a probe and nothing else.
    let run = run(
        "V1 1 0 SIN(0 1 750)\nD1 1 2 d\nR1 2 0 1k\nV2 e 0 PULSE(0 1 1.1m 0 0 1 2)\nR2 e 0 1k\nC1 2 0 1p IC=0\n\
         .model d D(ideal)\n.tran 0.5m 1.5m uic\n.save v(2) v(e)",
        Method::Exact,
    );
    let found = rows(&run);
    // Off near 2/3 ms, the edge, on again at 4/3 ms: a sine at zero is no small quantity.
    let times: Vec<f64> = found.iter().map(|r| (r.0 * 1e3).round()).collect();
    assert_eq!(times, [667.0, 1100.0, 1100.0, 1333.0], "{found:?}");
    assert_eq!((found[1].1[1], found[2].1[1]), (0.0, 1.0));
    assert!(
        run.events.iter().all(|e| e.concerns("d1")),
        "{:?}",
        run.events
    );
}
