//! Crossings known by hand.

use super::*;

fn times(found: &[Crossing]) -> Vec<f64> {
    found.iter().map(|crossing| crossing.time).collect()
}

#[test]
fn crossings_of_ramps_and_edges_are_exact() {
    let wave = source("pulse", &[0.0, 1.0, 0.0, 0.25, 0.5, 0.25, 2.0]);
    let found = crossings(&[(1.0, &wave)], (0.0, 0.5), Rest::IsNeither, 0.0, 4.0);
    assert_eq!(times(&found), [0.125, 0.75, 2.125, 2.75]);
    assert_eq!(
        found.iter().map(|c| c.rising).collect::<Vec<_>>(),
        [true, false, true, false]
    );
    let edge = source("pulse", &[0.0, 1.0, 0.3, 0.0, 0.0, 0.25, 2.0]);
    assert_eq!(
        times(&crossings(
            &[(1.0, &edge)],
            (0.0, 0.5),
            Rest::IsNeither,
            0.0,
            2.0
        )),
        [0.3, 0.3 + 0.25]
    );
    // reached but not passed
    assert_eq!(
        crossings(&[(1.0, &edge)], (0.0, 1.0), Rest::IsNeither, 0.0, 2.0),
        []
    );
    assert_eq!(
        times(&crossings(
            &[(1.0, &edge)],
            (0.0, 0.0),
            Rest::IsNeither,
            0.0,
            2.0
        )),
        [0.3]
    );
}

#[test]
fn crossings_of_sinusoids_are_all_found_to_rounding() {
    let wave = source("sin", &[0.0, 1.0, 1e3, 0.0, 0.0, 0.0]);
    let found = crossings(&[(1.0, &wave)], (0.0, 0.5), Rest::IsNeither, 0.0, 20e-3);
    assert_eq!(found.len(), 40);
    for (k, crossing) in found.iter().enumerate() {
        let angle = if k % 2 == 0 { 30.0 } else { 150.0 };
        let expected = ((k / 2) as f64 + angle / 360.0) / 1e3;
        assert!(
            (crossing.time - expected).abs() < 1e-17,
            "{} {expected}",
            crossing.time
        );
        assert_eq!(crossing.rising, k % 2 == 0);
    }
    assert_eq!(
        crossings(
            &[(1.0, &wave)],
            (0.0, 1.0 + 1e-9),
            Rest::IsNeither,
            0.0,
            20e-3
        ),
        []
    );
    // two crossings 2·acos(1 − 1e-9)/ω = 0.0142 us apart around each crest
    let close = crossings(
        &[(1.0, &wave)],
        (0.0, 1.0 - 1e-9),
        Rest::IsNeither,
        0.0,
        20e-3,
    );
    assert_eq!(close.len(), 40);
    assert!(
        (close[1].time
            - close[0].time
            - 2.0 * (1.0_f64 - 1e-9).acos() / (2e3 * std::f64::consts::PI))
            .abs()
            < 1e-14
    );
}

#[test]
fn crossings_of_a_reference_against_a_carrier() {
    // PWM: 0.8 sin(2π 50 t) against a 1 kHz triangle from −1 to 1 crosses twice a period.
    let reference = source("sin", &[0.0, 0.8, 50.0, 0.0, 0.0, 0.0]);
    let carrier = source("pulse", &[-1.0, 1.0, 0.0, 0.5e-3, 0.5e-3, 0.0, 1e-3]);
    let terms = [(1.0, &reference), (-1.0, &carrier)];
    let found = crossings(&terms, (0.0, 0.0), Rest::IsNeither, 0.0, 20e-3);
    assert_eq!(found.len(), 40);
    for pair in found.windows(2) {
        assert_ne!(pair[0].rising, pair[1].rising);
    }
    for crossing in found {
        let gap = reference.value(crossing.time) - carrier.value(crossing.time);
        assert!(gap.abs() < 1e-12, "{gap}");
    }
}

#[test]
fn crossings_of_a_modulated_tone() {
    let wave = source("sffm", &[0.0, 1.0, 1e3, 3.0, 100.0]);
    let found = crossings(&[(1.0, &wave)], (0.0, 0.0), Rest::IsNeither, 0.0, 10e-3);
    // the phase runs over 10 turns in one signal period and is monotone (index·signal < carrier)
    assert_eq!(found.len(), 19);
    assert!(
        found
            .iter()
            .all(|crossing| wave.value(crossing.time).abs() < 1e-11)
    );
}

/// A clock of a thousand million periods is not followed to its end.
#[test]
fn the_first_crossing_that_is_wanted_ends_the_search() {
    let clock = source("pulse", &[0.0, 1.0, 0.0, 0.25e-6, 0.25e-6, 0.25e-6, 1e-6]);
    let mut seen = Vec::new();
    let terms = [(1.0, &clock)];
    let found = first_crossing(
        &terms,
        ((0.0, 0.5), Rest::IsNeither),
        (0.0, 1e3),
        0.0,
        |crossing| {
            seen.push(crossing);
            !crossing.rising
        },
    );
    assert_eq!(seen.len(), 2);
    assert!(
        found.is_some_and(|c| (c.time - 0.625e-6).abs() < 1e-20),
        "{found:?}"
    );
}

/// A ramp passes zero a rounding behind the start, and an edge takes it back below; before the side between was not known, and the edge was none.
#[test]
fn a_passage_that_rounds_to_the_start_has_been() {
    let saw = source("pulse", &[-0.5, 0.5, 0.0, 6.99e-7, 1e-9, 0.0, 7e-7]);
    let edge = source("pulse", &[0.0, 0.5, 0.0, 0.0, 0.0, 7e-8, 1.75e-7]);
    let terms = [(1.0, &saw), (-1.0, &edge)];
    let from = 1.7494999999999997e-6;
    let found = crossings(
        &terms,
        (0.0, 0.0),
        Rest::IsBelow,
        from,
        1.7500000000000034e-6,
    );
    let falls = Crossing {
        time: 1.75e-6,
        rising: false,
    };
    assert_eq!(found, [falls]);
}

/// A sine reaches the level where an edge takes it back, and passes it only as it would have gone on.
#[test]
fn a_passage_that_rounds_to_an_edge_is_what_follows_the_edge() {
    let edge = source("pulse", &[0.5, 1.5, 7.5e-7, 0.0, 0.0, 3.75e-7, 1.5e-6]);
    let sine = source("sin", &[0.5, 1.0, 1e6, 2.5e-7, 0.0, 0.0]);
    let terms = [(1.0, &edge), (-1.0, &sine)];
    let found = crossings(&terms, (0.0, 0.0), Rest::IsBelow, 8.2e-6, 8.3e-6);
    assert_eq!(found, []);
}

/// The same sine, written in two ways: their difference is rounding everywhere, and no passage.
#[test]
fn equal_sines_do_not_pass_each_other() {
    let one = source("sin", &[0.0, 2.0, 2e6, 1.25e-7, 0.0, 90.0]);
    let other = source("sin", &[0.0, 2.0, 2e6, 0.0, 0.0, 0.0]);
    let terms = [(1.0, &one), (-1.0, &other)];
    for rest in [Rest::IsBelow, Rest::IsNeither] {
        let found = crossings(&terms, (0.0, 0.0), rest, 1.3e-7, 3e-6);
        assert_eq!(found, []);
    }
    // An offset moves none of their sum's passages.
    let found = crossings(
        &[(0.5, &one), (0.5, &other)],
        (0.0, 1.0),
        Rest::IsBelow,
        1.3e-7,
        1.13e-6,
    );
    assert_eq!(found.len(), 4);
}

/// At the peak of a sine that touches a pulse the slope is rounding, and the curvature tells that the pulse is above; its edge falls a moment later.
#[test]
fn where_the_slope_vanishes_the_curvature_tells_the_side() {
    let pulse = source(
        "pulse",
        &[
            0.5,
            1.0,
            3.333333333e-7,
            0.0,
            0.0,
            1.333333333e-6,
            2.666666667e-6,
        ],
    );
    let sine = source("sin", &[0.0, 1.0, 250e3, 0.0, 0.0, 180.0]);
    let terms = [(1.0, &pulse), (-1.0, &sine)];
    let found = crossings(&terms, (0.0, 0.0), Rest::IsBelow, 1.5e-5, 1.56e-5);
    assert_eq!(found.len(), 1);
    assert!(!found[0].rising && found[0].time < 1.5001e-5, "{found:?}");
}

/// sin 180° is 1.2e-16, and falls.
#[test]
fn the_side_after_a_zero_is_where_the_slope_goes() {
    let sine = source("sin", &[0.0, 1.0, 1e3, 0.0, 0.0, 180.0]);
    assert_eq!(side_after(&[(1.0, &sine)], (0.0, 0.0), 0.0), -1);
    let cosine = source("sin", &[0.0, 1.0, 1e3, 0.0, 0.0, 90.0]);
    assert_eq!(side_after(&[(-1.0, &cosine)], (1.0, 0.0), 0.0), 1);
    assert_eq!(
        side_after(&[(1.0, &sine), (-1.0, &sine)], (1.0, 1.0), 0.0),
        0
    );
}
