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
        (0.0, 0.5),
        Rest::IsNeither,
        (0.0, 1e3),
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
