//! Waveforms in ngspice's words.

use std::fmt::Write;

use crate::circuit::source::{Form, Wave};

/// Chords in a cycle of a sine that ends: they are 5e-6 of the amplitude below their arc.
const CHORDS: f64 = 1000.0;

/// A waveform in SPICE's words, and whether an edge had to be given the width `edge`, s.
pub(super) fn words(wave: &Wave, edge: f64) -> (String, bool) {
    let mut wave = wave.clone();
    let stretched = widen(&mut wave, edge);
    let Form {
        kind,
        args,
        repeat,
        delay,
    } = Form::from(&wave);
    let args: Vec<String> = args.iter().map(|x| format!("{x:e}")).collect();
    let mut text = if let Wave::Dc(_) = wave {
        args.join(" ")
    } else {
        format!("{kind}({})", args.join(" "))
    };
    // Writing to a string does not fail.
    for (name, value) in [("r", repeat), ("td", delay)] {
        if let Some(value) = value {
            let _ = write!(text, " {name}={value:e}");
        }
    }
    (text, stretched)
}

/// Replaces what ngspice does not have: true edges, and sines that end. Whether there was an edge.
fn widen(wave: &mut Wave, edge: f64) -> bool {
    let mut stretched = false;
    match wave {
        Wave::Sin {
            frequency,
            delay,
            cycles: Some(cycles),
            ..
        } => {
            let (start, end) = (*delay, *delay + *cycles / *frequency);
            let count = (*cycles * CHORDS).ceil();
            let mut points: Vec<(f64, f64)> = (0..count as usize)
                .map(|k| start + (end - start) * (k as f64 / count))
                .map(|t| (t, wave.value(t)))
                .collect();
            if wave.is_edge(end) {
                points.push((end - edge, wave.value_left(end)));
                stretched = true;
            }
            points.push((end, wave.value(end)));
            *wave = Wave::Pwl {
                points,
                repeat: None,
                delay: 0.0,
            };
        }
        // Of no width it would last until the end.
        Wave::Pulse {
            rise, fall, width, ..
        } => {
            for duration in [rise, fall, width] {
                if *duration == 0.0 {
                    *duration = edge;
                    stretched = true;
                }
            }
        }
        Wave::Pwl { points, .. } => {
            let mut previous = f64::NEG_INFINITY;
            for (t, _) in points {
                if *t <= previous {
                    *t = previous + edge;
                    stretched = true;
                }
                previous = *t;
            }
        }
        _ => {}
    }
    stretched
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_get_a_width_and_the_rest_its_own_words() {
        let points = vec![(0.0, 0.0), (1.0, 2.0), (1.0, 3.0)];
        let pwl = Wave::Pwl {
            points,
            repeat: Some(0.5),
            delay: 0.25,
        };
        let words = |wave: &Wave| words(wave, 0.125);
        let text = "pwl(0e0 0e0 1e0 2e0 1.125e0 3e0) r=5e-1 td=2.5e-1";
        assert_eq!(words(&pwl), (text.into(), true));
        let mut sine = Wave::Sin {
            offset: 1.0,
            amplitude: 2.0,
            frequency: 4.0,
            delay: 0.0,
            damping: 0.0,
            phase: 90.0,
            cycles: None,
        };
        assert_eq!(words(&sine), ("sin(1e0 2e0 4e0 0e0 0e0 9e1)".into(), false));
        let Wave::Sin { cycles, .. } = &mut sine else {
            unreachable!()
        };
        // Half a cycle from 3 to −1, and back to 3 at its end.
        *cycles = Some(0.5);
        let (text, stretched) = words(&sine);
        assert!(stretched && text.starts_with("pwl(0e0 3e0 "), "{text}");
        assert!(text.ends_with(" 0e0 -1e0 1.25e-1 3e0)"), "{text}");
        assert_eq!(text.split(' ').count(), 2 * 502);
    }
}
