//! The derivative of the flow over a period by its variational equation, and by differences.

use std::path::Path;

use super::attempt::{By, Pace};
use super::multipliers::{growth, is_dissipative};
use super::rows::closing_error;
use super::search::Search;
use super::shooting::Return;
use super::{PeriodicOptions, period, simulation, steady};
use crate::circuit::ElaborateOptions;
use crate::integrate::Run;
use crate::mna::behaviour;
use crate::model::Model;

/// Converters and rectifiers: clocks, diodes that end by themselves, jumps, state-controlled switches, thyristors, coupled inductors.
const CIRCUITS: [&str; 20] = [
    "netlists/buck-open-loop.cir",
    "netlists/flyback.cir",
    "netlists/buck.cir",
    "netlists/cockcroft-walton.cir",
    "netlists/capacitor-loop.cir",
    "netlists/clamp.cir",
    "netlists/isolated-rectifier.cir",
    "netlists/isolated-rectifier-ideal.cir",
    "netlists/maffezzoni.cir",
    "netlists/maffezzoni-ideal.cir",
    "netlists/rectifier.cir",
    "netlists/rlc.cir",
    "netlists/scr-bridge.cir",
    "netlists/three-phase-rectifier.cir",
    "netlists/triac-dimmer.cir",
    "netlists/voltage-doubler.cir",
    "netlists/parallel-inverters.cir",
    "netlists/inductor-cut-set.cir",
    "tests/findings/multiphase_buck_8.cir",
    "tests/findings/six_pulse_large_roff.cir",
];

#[test]
fn the_variational_equation_agrees_with_differences() {
    for name in CIRCUITS {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        let model = Model::load(path, ElaborateOptions::default()).expect("a circuit");
        let options = PeriodicOptions::default();
        let (circuit, _) = period::repeating(model.circuit());
        let period = period::common(&circuit).expect("a period");
        let multiport = behaviour(&circuit).expect("a multiport");
        let seconds = period.seconds.expect("a driven circuit");
        let parts = (&circuit, &multiport);
        let mut simulation = simulation(parts, period.seconds, Pace::first(By::PLAN), &options)
            .expect("a simulation");
        let mut search = Search::of(&mut simulation, &options);
        let found = search.driven(seconds, period.from).expect("an orbit");
        let mut shooting = search.shooting(found.from, Return::After(seconds));
        shooting.amplitudes.clone_from(&found.amplitudes);
        let stand = &found.fixed.stand;
        let closing = shooting.close(stand).expect("a period");
        let by_equation = shooting.variation(stand, &closing);
        let by_equation = by_equation.unwrap_or_else(|error| panic!("{name}: {error}"));
        let by_equation = by_equation.expect("a derivative");
        let by_differences = shooting
            .differences(stand, &closing.after)
            .expect("differences");
        let apart = (&by_equation - &by_differences).amax();
        assert!(
            apart < 1e-5,
            "{name}: {apart:e}, {by_equation}{by_differences}"
        );
    }
}

/// Exponential diodes: a snubber, inductors that are interrupted, a bridge, switches that the state moves.
const CURVED: [&str; 4] = [
    "v1 in 0 12\nl1 in sw 47u\ns1 sw 0 c saw m\nd1 sw out d\ncs sw x 1n\nrs x 0 20\nc1 out 1 10u\nrc 1 0 5m\nrload out 0 10\nvc c 0 0.8\n\
     vsaw saw 0 pulse(0 2 0 9.9u 0 0.1u 10u)",
    "v1 in 0 12\ns1 in sw c saw m\nd1 0 sw d\nl1 sw out 4.7u\nc1 out 0 10u\nrload out 0 50\nvc c 0 0.8\nvsaw saw 0 pulse(0 2 0 9.9u 0 0.1u 10u)",
    "v1 a b sin(0 30 50)\nd1 a p d\nd2 b p d\nd3 n a d\nd4 n b d\nrg n 0 1m\nl1 p q 5m\nc1 q 0 470u\nrload q 0 30",
    "vin vin 0 10\nl1 vin sw 1m\ns1 sw 0 g 0 g\nd1 sw out d\nc1 out 0 12u\nrl out 0 20\nvclk clk 0 pulse(0 1 0 0 0 1u 100u)\n\
     bsense sense 0 v=i(l1)\nvpeak peak 0 1\na1 sense peak 0 0 0 0 over 0 schmitt vt=0 vh=1u\na2 clk over 0 0 0 0 g 0 srflop vhigh=10 ref=0.5",
];

#[test]
fn tangents_along_an_orbit_in_steps_agree_with_differences() {
    for cards in CURVED {
        let text = format!(
            "t\n{cards}\n.model d d(is=1e-12 n=1.2 rs=10m)\n.model m sw(vt=0 vh=0 ron=10m roff=1meg)\n.model g sw(vt=5 vh=0 ron=10m roff=1meg)\n\
             .tran 1u 1m\n.end\n"
        );
        let model = Model::parse(&text, "t.cir").expect("a circuit");
        let found = steady(&model, &PeriodicOptions::default());
        let mut found = found.unwrap_or_else(|error| panic!("{cards}: {error}"));
        let made = found.linearised(None);
        let made = made.unwrap_or_else(|error| panic!("{cards}: {error}"));
        let (run, _) = made.expect("an orbit in steps");
        let amplitudes = &found.found.amplitudes;
        let [halves, _] = run.trajectories;
        let mut by_tangents = halves.monodromy();
        for (j, mut column) in by_tangents.column_iter_mut().enumerate() {
            for (value, amplitude) in column.iter_mut().zip(amplitudes) {
                *value *= amplitudes[j] / amplitude;
            }
        }
        let by_differences = &found.found.fixed.derivative;
        let apart = (&by_tangents - by_differences).amax();
        assert!(
            apart < 1e-3,
            "{cards}: {apart:e}, {by_tangents}{by_differences}"
        );
    }
}

/// Where steps took over in the search, or in the rows, these end elsewhere.
#[test]
fn rows_that_do_not_close_are_off_by_that() {
    let run = |end: f64| Run {
        storage: vec![1.0, end],
        ..Run::default()
    };
    for (end, expected) in [(2.0 + 1e-12, None), (2.006, Some(2e-3))] {
        let mut run = run(end);
        closing_error(&mut run, &[1.0, 2.0], &[1.0, 3.0]);
        let close = |max: f64, expected: f64| (max - expected).abs() < 1e-12;
        match (run.error.max, expected) {
            (Some(max), Some(expected)) => assert!(close(max, expected), "{max}"),
            (found, expected) => assert_eq!(found, expected),
        }
    }
}

/// A resonant converter whose bridge is a source: differences of its steps said that disturbances grow by 1.9 a period.
#[test]
fn disturbances_grow_where_something_feeds_them() {
    let of = |cards: &str| {
        let text = format!(
            "llc\nv1 1 0 pulse(-5 5 0 1n 1n 0.5u 1u)\nc1 1 2 1n\nl1 2 3 28u\nl2 3 0 84u\nl3 4 0 21u\nk1 l2 l3 1\nd1 4 5 d\nc2 5 0 59n\nr1 5 0 100\n{cards}\n.model d d(is=1e-14)\n.tran 1u 5u\n.end\n"
        );
        let model = Model::parse(&text, "llc.cir").expect("a circuit");
        is_dissipative(model.circuit())
    };
    assert!(of("") && of("i1 5 0 sin(0 1 1k)"));
    let feeding = [
        "r2 5 0 -10",
        "e1 6 0 5 0 2\nr2 6 0 1",
        "s1 5 0 5 0 s\n.model s sw(vt=1 ron=1)",
    ];
    assert!(!feeding.into_iter().any(of));
    let derivative = |a: f64| nalgebra::dmatrix![a, 1.0; -1.0, a];
    assert_eq!(growth(&derivative(0.0)), None);
    assert!(growth(&derivative(1.0)).is_some_and(|size| (size - 2_f64.sqrt()).abs() < 1e-12));
}
