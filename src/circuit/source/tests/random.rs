//! Any waveform.

use proptest::prelude::*;

use super::*;

/// Times that put breakpoints both apart and together.
fn duration() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), 1e-9..1e-3, Just(1e-4)]
}

fn waves() -> impl Strategy<Value = Wave> {
    let level = -5.0..5.0;
    prop_oneof![
        (
            level.clone(),
            level.clone(),
            1.0..1e5,
            -1e-3..1e-3,
            -500.0..500.0,
            -180.0..180.0,
            prop_oneof![Just(None), (0.5..4.0).prop_map(Some), Just(Some(3.0))]
        )
            .prop_map(
                |(offset, amplitude, frequency, delay, damping, phase, cycles)| Wave::Sin {
                    offset,
                    amplitude,
                    frequency,
                    delay,
                    damping,
                    phase,
                    cycles,
                }
            ),
        (
            level.clone(),
            level.clone(),
            -1e-3..1e-3,
            duration(),
            duration(),
            duration(),
            duration(),
            proptest::option::of(0.0..20.0)
        )
            .prop_map(
                |(v1, v2, delay, rise, fall, width, period, count)| Wave::Pulse {
                    v1,
                    v2,
                    delay,
                    rise,
                    fall,
                    width,
                    period,
                    count
                }
            ),
        (
            proptest::collection::vec((duration(), level.clone()), 1..8),
            proptest::option::of(0.0..2e-3),
            -1e-3..1e-3
        )
            .prop_map(|(steps, repeat, delay)| {
                let mut t = 0.0;
                let points = steps
                    .into_iter()
                    .map(|(step, value)| {
                        t += step;
                        (t, value)
                    })
                    .collect();
                Wave::Pwl {
                    points,
                    repeat,
                    delay,
                }
            }),
        (
            level.clone(),
            level.clone(),
            -1e-3..1e-3,
            duration(),
            -1e-3..2e-3,
            duration()
        )
            .prop_map(
                |(v1, v2, rise_delay, rise_tau, fall_delay, fall_tau)| Wave::Exp {
                    v1,
                    v2,
                    rise_delay,
                    rise_tau,
                    fall_delay,
                    fall_tau
                }
            ),
        (
            level.clone(),
            level.clone(),
            1.0..1e4,
            1.0..1e5,
            -1e-3..1e-3
        )
            .prop_map(|(amplitude, offset, modulation, carrier, delay)| Wave::Am {
                amplitude,
                offset,
                modulation,
                carrier,
                delay
            }),
        (level.clone(), level, 1.0..1e5, 0.0..5.0, 1.0..1e4).prop_map(
            |(offset, amplitude, carrier, index, signal)| Wave::Sffm {
                offset,
                amplitude,
                carrier,
                index,
                signal,
                carrier_phase: 10.0,
                signal_phase: 20.0
            }
        ),
    ]
}

/// Values of a damped sinusoid grow as e^{500·5 ms}; rounding of ω t near 1e5·2π·5 ms is 1e-12.
const CLOSE: f64 = 1e-8;

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))), ..ProptestConfig::with_cases(512) })]

    #[test]
    fn breakpoints_increase_and_pieces_join(wave in waves(), start in -2e-3..4e-3) {
        let mut t = start;
        for _ in 0..40 {
            let next = wave.next_breakpoint(t);
            let end = next.unwrap_or(t + 1e-3);
            prop_assert!(end > t);
            if let Some(piece) = wave.piece(t) {
                prop_assert_eq!(piece.end, next.unwrap_or(f64::INFINITY));
                prop_assert!(piece.start <= t && piece.origin.is_finite());
                for s in [0.0, 0.25, 0.5, 0.75] {
                    let at = t + s * (end - t);
                    if at < end {
                        prop_assert_eq!(wave.value(at), piece.value(at));
                        prop_assert_eq!(wave.piece(at), Some(piece));
                        prop_assert!(wave.value(at).is_finite() && wave.derivative(at).is_finite());
                        prop_assert!(!wave.is_edge(at) || at == piece.start);
                    }
                }
                prop_assert!((piece.value(end) - wave.value_left(end)).abs() < CLOSE);
            }
            let jump = (wave.value(end) - wave.value_left(end)).abs();
            prop_assert!(wave.is_edge(end) || jump == 0.0);
            t = end;
        }
    }

    #[test]
    fn the_derivative_is_that_of_the_value(wave in waves(), t in -2e-3..4e-3) {
        let h = 1e-9;
        if wave.next_breakpoint(t).is_none_or(|next| next > t + 2.0 * h) {
            let slope = (-3.0 * wave.value(t) + 4.0 * wave.value(t + h) - wave.value(t + 2.0 * h)) / (2.0 * h);
            let scale = 1e6 + wave.derivative(t).abs();
            prop_assert!((slope - wave.derivative(t)).abs() < 2e-3 * scale, "{} {}", slope, wave.derivative(t));
        }
    }

    #[test]
    fn json_keeps_every_bit(wave in waves()) {
        let text = serde_json::to_string(&Form::from(&wave)).unwrap();
        let form: Form = serde_json::from_str(&text).unwrap();
        prop_assert_eq!(form.wave(1e-6, 1e-3).unwrap(), wave);
    }

    #[test]
    fn crossings_agree_with_sampling(a in waves(), b in waves(), gain in -2.0..2.0, level in -3.0..3.0) {
        let (a, b) = (Source { dc: 0.0, wave: a }, Source { dc: 0.0, wave: b });
        let value = |t: f64| a.value(t) + gain * b.value(t) - level;
        let found = crossings(&[(1.0, &a), (gain, &b)], (0.0, level), Rest::IsNeither, 0.0, 1e-3);
        prop_assert!(found.windows(2).all(|w| w[0].time <= w[1].time && w[0].rising != w[1].rising));
        // Between passages the sampled sign is the one the last passage left.
        let mut above = None;
        let mut next = 0;
        for k in 0..=2000 {
            let t = f64::from(k) * 0.5e-6;
            while next < found.len() && found[next].time <= t {
                above = Some(found[next].rising);
                next += 1;
            }
            if value(t).abs() > CLOSE {
                let sampled = value(t) > 0.0;
                prop_assert_eq!(*above.get_or_insert(sampled), sampled, "at {}", t);
            }
        }
    }
}
