//! Values, breakpoints and pieces known by hand.

use super::*;

mod crossings;
mod random;

const MS: f64 = 1e-3;

fn source(kind: &str, args: &[f64]) -> Source {
    repeating(kind, args, None)
}

fn repeating(kind: &str, args: &[f64], repeat: Option<f64>) -> Source {
    let form = Form {
        kind: kind.into(),
        args: args.into(),
        repeat,
        delay: None,
    };
    Source {
        dc: 0.0,
        wave: form.wave(0.1 * MS, 6.0 * MS).unwrap(),
    }
}

/// The sources of tests/reference/sources.cir, in order.
fn sources() -> Vec<Source> {
    vec![
        source("sin", &[0.5, 2.0, 1e3, 0.7e-3, 200.0, 30.0]),
        source("sin", &[0.5, 2.0, 1.3e3, -0.4e-3, 100.0, -90.0]),
        source(
            "pulse",
            &[-1.0, 3.0, 0.33e-3, 0.1e-3, 0.2e-3, 0.3e-3, 0.9e-3],
        ),
        source(
            "pulse",
            &[0.0, 1.0, 1e-3, 0.1e-3, 0.2e-3, 0.5e-3, 1e-3, 2.0],
        ),
        source("pulse", &[0.0, 1.0, 1e-3, 0.5e-3, 0.5e-3, 0.5e-3, 1e-3]),
        source(
            "pulse",
            &[2.0, -1.0, -0.25e-3, 0.1e-3, 0.3e-3, 0.1e-3, 0.7e-3],
        ),
        source("pwl", &[0.5e-3, 1.0, 1e-3, 2.0, 1.7e-3, -1.0, 3e-3, 0.5]),
        repeating(
            "pwl",
            &[0.0, 0.0, 1e-3, 2.0, 1.7e-3, -1.0, 2.2e-3, 0.5],
            Some(1e-3),
        ),
        source("exp", &[1.0, 4.0, 0.3e-3, 0.2e-3, 2.1e-3, 0.5e-3]),
        source("sffm", &[0.5, 2.0, 1e3, 3.0, 100.0, 30.0, 60.0]),
        source("am", &[0.5, 2.0, 100.0, 1e3, 1e-3]),
    ]
}

#[test]
fn the_derivatives_of_what_grows_are_largest_at_its_end_whatever_its_sign() {
    for amplitude in [1.0, -1.0] {
        let growing = piece::Oscillation::exponential(amplitude, -3.0);
        let (first, second) = growing.derivative_bounds(0.0, 1.0);
        let ends = [growing.derivative(1.0), growing.second_derivative(1.0)];
        for (bound, end) in [first, second].into_iter().zip(ends) {
            assert!((end.abs() / bound - 1.0).abs() < 1e-15, "{end} {bound}");
        }
    }
}

/// A sin(m sin ωt) has f'' = A m ω² at its steepest turn, where m is small far more than what the rate alone, A (m ω)², allows.
#[test]
fn the_second_derivative_of_a_swept_tone_stays_within_its_bound() {
    let tone = piece::Tone {
        offset: 0.0,
        amplitude: 2.0,
        carrier: (0.0, 0.0),
        index: 0.1,
        signal: (1.0, 0.0),
    };
    let (first, second) = tone.derivative_bounds();
    let h = 1e-3;
    let times = || (0..6284).map(|k| f64::from(k) * h);
    let steepest = times().fold(0.0, |m: f64, t| m.max(tone.derivative(t).abs()));
    let turns = times().map(|t| (tone.derivative(t + h) - tone.derivative(t - h)) / (2.0 * h));
    let sharpest = turns.fold(0.0, |m: f64, turn| m.max(turn.abs()));
    assert!(
        0.99 * first < steepest && steepest <= first,
        "{steepest} {first}"
    );
    assert!(
        0.9 * second < sharpest && sharpest <= second,
        "{sharpest} {second}"
    );
}

#[test]
fn values_are_those_of_ngspice() {
    let text = include_str!("../../../tests/reference/sources.csv");
    let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    let mut compared = 0;
    for row in rows {
        let row: Vec<f64> = row.split(',').map(|field| field.parse().unwrap()).collect();
        for (k, source) in sources().iter().enumerate() {
            let (found, expected) = (source.value(row[0]), row[k + 1]);
            assert!(
                (found - expected).abs() < 1e-11,
                "v{} at {}: {found}, ngspice {expected}",
                k + 1,
                row[0]
            );
            compared += 1;
        }
    }
    assert_eq!(compared, 11 * 83);
}

#[test]
fn negative_delay_does_not_restart_a_sinusoid() {
    let wave = source("sin", &[1.0, 2.0, 1e3, -0.25e-3, 0.0, 0.0]);
    assert!((wave.value(0.0) - 3.0).abs() < 1e-15);
    assert_eq!(wave.next_breakpoint(0.0), None);
}

#[test]
fn before_its_delay_a_sinusoid_has_the_value_of_its_phase() {
    let wave = source("sin", &[1.0, 2.0, 1e3, 1e-3, 50.0, 90.0]);
    assert_eq!(wave.value(0.0), 3.0);
    assert_eq!(wave.derivative(0.5e-3), 0.0);
    assert_eq!(wave.next_breakpoint(0.0), Some(1e-3));
    assert!(!wave.is_edge(1e-3));
    // d/ds 2 e^{−50 s} cos ωs at 0 = −100
    assert!((wave.derivative(1e-3) + 100.0).abs() < 1e-9);
}

#[test]
fn zero_rise_is_an_edge_with_both_limits() {
    let wave = source("pulse", &[-1.0, 2.0, 1e-3, 0.0, 0.0, 0.5e-3, 1e-3]);
    for k in 0..1000 {
        let rise = 1e-3 + f64::from(k) * 1e-3;
        assert!(wave.is_edge(rise));
        assert_eq!((wave.value_left(rise), wave.value(rise)), (-1.0, 2.0));
        let fall = wave.next_breakpoint(rise).unwrap();
        assert!((fall - rise - 0.5e-3).abs() < 1e-12);
        assert_eq!((wave.value_left(fall), wave.value(fall)), (2.0, -1.0));
        assert_eq!(
            wave.next_breakpoint(fall),
            Some(1e-3 + f64::from(k + 1) * 1e-3)
        );
    }
}

#[test]
fn breakpoints_do_not_drift() {
    // 20 us is not a binary fraction; after a million periods the breakpoint is still the nearest product.
    let wave = source("pulse", &[0.0, 1.0, 0.0, 1e-6, 1e-6, 5e-6, 20e-6]);
    let mut t = 1e6 * 20e-6;
    assert_eq!(wave.next_breakpoint(t - 1e-6), Some(t));
    for corner in [1e-6, 6e-6, 7e-6, 20e-6] {
        let next = wave.next_breakpoint(t).unwrap();
        assert!(next > t && (next - (20.0 + corner)).abs() < 1e-14, "{next}");
        t = next;
    }
}

#[test]
fn a_pulse_as_long_as_its_period_in_decimals_has_no_sliver() {
    // 0.1 + 0.2 + 0.4 is not 0.7 in doubles.
    let wave = source("pulse", &[0.0, 1.0, 0.0, 0.1, 0.4, 0.2, 0.7]);
    let mut t = 0.0;
    for k in 0..300 {
        assert!(!wave.is_edge(t), "{t}");
        for corner in [0.1, 0.3, 0.7] {
            t = wave.next_breakpoint(t).unwrap();
            assert!(
                (t - 0.7 * f64::from(k) - corner).abs() < 1e-12,
                "lap {k}: {t}"
            );
        }
    }
}

#[test]
fn an_overfull_pulse_is_cut_by_the_next() {
    let wave = source("pulse", &[0.0, 1.0, 0.0, 0.5, 0.5, 0.25, 1.0]);
    assert!(wave.is_edge(1.0));
    assert!((wave.value_left(1.0) - 0.5).abs() < 1e-15);
    assert_eq!(wave.value(1.0), 0.0);
    assert_eq!(wave.value(1.25), 0.5);
}

#[test]
fn counted_pulses_end() {
    let wave = source("pulse", &[0.0, 1.0, 1.0, 0.0, 0.0, 0.5, 1.0, 2.0]);
    let edges: Vec<f64> =
        std::iter::successors(wave.next_breakpoint(-1.0), |&t| wave.next_breakpoint(t))
            .filter(|&t| wave.is_edge(t))
            .collect();
    assert_eq!(edges, [1.0, 1.5, 2.0, 2.5]);
    assert_eq!(wave.value(3.25), 0.0);
}

#[test]
fn pwl_edges_and_repetition() {
    let wave = repeating(
        "pwl",
        &[0.0, 1.0, 1.0, 3.0, 1.0, 0.0, 2.0, 0.0, 3.0, 5.0],
        Some(1.0),
    );
    assert_eq!((wave.value_left(1.0), wave.value(1.0)), (3.0, 0.0));
    assert!(wave.is_edge(1.0));
    // repeats from the first point at 1, so that 3 is an edge 5 → 3 → 0
    assert_eq!((wave.value_left(3.0), wave.value(3.0)), (5.0, 0.0));
    assert_eq!(wave.value(4.5), 2.5);
    assert_eq!((wave.value_left(2001.0), wave.value(2001.0)), (5.0, 0.0));
    let last = source("pwl", &[0.0, 1.0, 1.0, 3.0]);
    assert_eq!(
        (last.value(-1.0), last.value(7.0), last.next_breakpoint(1.0)),
        (1.0, 3.0, None)
    );
}

#[test]
fn exponentials_with_zero_time_constant_are_edges() {
    let wave = source("exp", &[0.0, 1.0, 1.0, 0.0, 2.0, 0.5]);
    assert_eq!(
        (wave.value_left(1.0), wave.value(1.0), wave.value(1.5)),
        (0.0, 1.0, 1.0)
    );
    assert!(wave.is_edge(1.0) && !wave.is_edge(2.0));
    assert!((wave.value(2.5) - (-1.0_f64).exp()).abs() < 1e-15);
    let wave = source("exp", &[0.0, 1.0, 1.0, 0.5, 2.0, 0.0]);
    assert!(wave.is_edge(2.0));
    assert!((wave.value(2.0) + (-2.0_f64).exp()).abs() < 1e-15);
}

#[test]
fn pieces_carry_the_exosystem() {
    let wave = source("sin", &[0.5, 2.0, 1e3, 0.7e-3, 200.0, 30.0]);
    let piece = wave.piece(1e-3).unwrap();
    assert_eq!(
        (piece.start, piece.end, piece.origin),
        (0.7e-3, f64::INFINITY, 0.7e-3)
    );
    let terms: Vec<_> = piece.terms().copied().collect();
    let expected = Oscillation {
        amplitude: 2.0,
        decay: 200.0,
        frequency: 2e3 * std::f64::consts::PI,
        phase: 30_f64.to_radians(),
    };
    assert_eq!(terms, [expected]);
    assert_eq!((piece.constant, piece.slope), (0.5, 0.0));
    assert_eq!(source("sffm", &[0.0, 1.0, 1e3, 1.0, 10.0]).piece(0.0), None);
    // all t of an interval see the same piece
    let ramp = source("pulse", &[0.0, 1.0, 0.0, 1.0, 1.0, 1.0, 5.0]);
    assert_eq!(ramp.piece(5.25), ramp.piece(5.75));
    assert_eq!(ramp.piece(5.25).unwrap().slope, 1.0);
}

#[test]
fn arguments_are_checked_and_defaults_filled() {
    let wave = |kind: &str, args: &[f64]| {
        Form {
            kind: kind.into(),
            args: args.into(),
            repeat: None,
            delay: None,
        }
        .wave(1e-6, 1e-3)
    };
    let Wave::Pulse {
        rise,
        fall,
        width,
        period,
        count,
        ..
    } = wave("PULSE", &[0.0, 1.0, 0.0, 0.0]).unwrap()
    else {
        panic!("not a pulse");
    };
    assert_eq!(
        (rise, fall, width, period, count),
        (0.0, 1e-6, 1e-3, 1e-3, None)
    );
    assert_eq!(
        wave("sin", &[1.0]).unwrap_err().to_string(),
        "`sin` takes 2 to 7 arguments, found 1"
    );
    assert_eq!(
        wave("pulse", &[0.0, 1.0, 0.0, -1e-9])
            .unwrap_err()
            .to_string(),
        "`pulse`: rise cannot be -0.000000001"
    );
    assert!(matches!(
        wave("pwl", &[0.0, 1.0, -1.0, 2.0]),
        Err(WaveError::Order { .. })
    ));
    assert!(matches!(
        wave("pwl", &[0.0, 1.0, f64::NAN, 2.0]),
        Err(WaveError::Argument { .. })
    ));
    assert!(matches!(
        wave("pwl", &[0.0, 1.0, 1.0]),
        Err(WaveError::Count { .. })
    ));
    assert!(matches!(wave("noise", &[]), Err(WaveError::Kind(_))));
}
