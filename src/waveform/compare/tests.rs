//! Distances known by hand.

use super::*;

fn waves(name: &str, time: &[f64], values: &[f64]) -> Waveforms {
    Waveforms {
        names: vec![name.into()],
        units: vec![super::super::unit_of(name)],
        time: time.to_vec(),
        values: values.to_vec(),
        ..Waveforms::default()
    }
}

#[test]
fn equal_curves_on_different_grids_differ_by_nothing() {
    let coarse = waves("v(a)", &[0.0, 1.0, 1.0, 2.0], &[0.0, 2.0, -2.0, 0.0]);
    let fine = waves(
        "V(A)",
        &[0.0, 0.5, 1.0, 1.0, 1.25, 2.0],
        &[0.0, 1.0, 2.0, -2.0, -1.5, 0.0],
    );
    let found = compare(&coarse, &fine, At::AllRows, 0.0).unwrap();
    let s = &found.signals[0];
    assert_eq!((s.max, s.rms, s.shifted, s.amplitude), (0.0, 0.0, 0.0, 2.0));
}

/// Where the first has an edge of its own it is compared on both of its sides; where it has none, on the nearer one.
#[test]
fn edges_of_both_are_compared_on_both_sides() {
    let at = [0.0, 1.0, 1.0, 2.0];
    let small = waves("v(a)", &at, &[0.0, 0.0, 1.0, 0.0]);
    let large = waves("v(a)", &at, &[0.0, 0.0, 3.0, 0.0]);
    let straight = waves("v(a)", &[0.0, 1.0, 2.0], &[0.0; 3]);
    let worst = |first, reference, at| compare(first, reference, at, 0.0).unwrap().signals[0].max;
    for kind in [At::AllRows, At::FirstRows, At::ReferenceRows] {
        assert!(worst(&small, &large, kind) > 0.0, "{kind:?}");
    }
    assert_eq!(worst(&straight, &large, At::FirstRows), 0.0);
}

#[test]
fn a_late_edge_is_a_large_error_that_a_shift_forgives() {
    let reference = waves("v(a)", &[0.0, 1.0, 1.0, 3.0], &[0.0, 0.0, 4.0, 4.0]);
    let late = waves("v(a)", &[0.0, 1.1, 1.1, 3.0], &[0.0, 0.0, 4.0, 4.0]);
    let found = compare(&late, &reference, At::AllRows, 0.2).unwrap();
    let s = &found.signals[0];
    assert_eq!((s.max, s.max_time, s.shifted), (1.0, 1.0, 0.0));
    // |a − b| = 4 for 0.1 s of 3 s.
    assert!((s.rms - (0.1f64 / 3.0).sqrt()).abs() < 1e-12);
    let strict = compare(&late, &reference, At::AllRows, 0.05).unwrap();
    assert_eq!(strict.signals[0].shifted, 1.0);
}

#[test]
fn a_spike_on_either_side_is_seen_through_the_shift() {
    let flat = waves("v(a)", &[0.0, 1.0], &[1.0, 1.0]);
    let spike = waves(
        "v(a)",
        &[0.0, 0.49, 0.5, 0.51, 1.0],
        &[1.0, 1.0, 3.0, 1.0, 1.0],
    );
    assert_eq!(
        compare(&flat, &spike, At::AllRows, 0.1).unwrap().signals[0].shifted,
        2.0 / 3.0
    );
    let found = compare(&spike, &flat, At::AllRows, 0.1).unwrap();
    assert_eq!(
        (found.signals[0].shifted, found.signals[0].shifted_time),
        (2.0, 0.5)
    );
}

#[test]
fn voltages_between_nodes_are_differences_of_the_reference() {
    let ours = waves("v(a,b)", &[0.0, 1.0], &[1.0, 1.0]);
    let reference = Waveforms {
        names: vec!["a".into(), "b".into()],
        units: vec!["V", "V"],
        time: vec![0.0, 1.0],
        values: vec![3.0, 2.0, 4.0, 2.5],
        ..Waveforms::default()
    };
    let found = compare(&ours, &reference, At::AllRows, 0.0).unwrap();
    assert_eq!(
        (found.signals[0].amplitude, found.signals[0].max_time),
        (1.5, 1.0)
    );
    let delta = difference(&ours, &reference).unwrap();
    assert_eq!(delta.values, [0.0, -0.5]);
}

#[test]
fn leakage_next_to_amperes_is_measured_against_the_amperes() {
    let both = |small: f64| Waveforms {
        names: vec!["i(d1)".into(), "i(v1)".into()],
        units: vec!["A", "A"],
        time: vec![0.0, 1.0],
        values: vec![small, 2.0, small, 2.0],
        ..Waveforms::default()
    };
    let found = compare(&both(0.0), &both(1e-12), At::AllRows, 0.0).unwrap();
    assert_eq!(found.signals[0].amplitude, 2e-9);
    assert!((found.signals[0].max - 5e-4).abs() < 1e-15);
    // A signal that should vanish and does not is not excused.
    assert!(
        compare(&both(1.0), &both(0.0), At::AllRows, 0.0)
            .unwrap()
            .signals[0]
            .max
            > 1e8
    );
}

#[test]
fn between_the_rows_of_another_program_nothing_is_claimed() {
    let parabola = |n: u32| {
        let time: Vec<f64> = (0..=n).map(|k| f64::from(k) / f64::from(n)).collect();
        let values: Vec<f64> = time.iter().map(|t| t * t).collect();
        waves("v(a)", &time, &values)
    };
    let error = |at| {
        compare(&parabola(64), &parabola(4), at, 0.0)
            .unwrap()
            .signals[0]
            .max
    };
    assert_eq!(
        (error(At::ReferenceRows), error(At::AllRows)),
        (0.0, 1.0 / 64.0)
    );
}

#[test]
fn a_row_at_a_jump_may_hold_either_limit() {
    let jump = waves("v(a)", &[0.0, 1.0, 1.0, 2.0], &[0.0, 0.0, 3.0, 3.0]);
    for value in [0.0, 3.0] {
        let rows = waves("v(a)", &[0.0, 1.0, 2.0], &[0.0, value, 3.0]);
        let error = |found: Result<Comparison, CompareError>| found.unwrap().signals[0].max;
        assert_eq!(error(compare(&jump, &rows, At::ReferenceRows, 0.0)), 0.0);
        assert_eq!(error(compare(&rows, &jump, At::FirstRows, 0.0)), 0.0);
        assert_eq!(error(compare(&rows, &jump, At::AllRows, 0.0)), 1.0);
    }
    let wrong = waves("v(a)", &[0.0, 1.0, 2.0], &[0.0, 1.0, 3.0]);
    assert_eq!(
        compare(&wrong, &jump, At::FirstRows, 0.0).unwrap().signals[0].max,
        1.0 / 3.0
    );
}

#[test]
fn nothing_in_common_is_an_error() {
    let a = waves("v(a)", &[0.0, 1.0], &[0.0, 0.0]);
    assert!(matches!(
        compare(&a, &waves("v(b)", &[0.0], &[0.0]), At::AllRows, 0.0),
        Err(CompareError::NoSignal { .. })
    ));
    let later = waves("v(a)", &[2.0, 3.0], &[0.0, 0.0]);
    let error = compare(&a, &later, At::AllRows, 0.0)
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "no common span of time: 0e0 s to 1e0 s and 2e0 s to 3e0 s"
    );
    assert!(compare(&a, &waves("v(a)", &[], &[]), At::AllRows, 0.0).is_err());
}
