//! The buck converter with feedback (RR-7061 section 5) in five variants, against Moreau's scheme.

use circ::integrate::{Method, Run, SimOptions};

use super::runs::{column, text};
use super::try_run;

/// The first microseconds of a netlist.
fn run(name: &str, span: u32, options: SimOptions<'_>) -> Run {
    let text = text(name).replace(".tran 0.1u 200u", &format!(".tran 0.1u {span}u"));
    let (_title, cards) = text.split_once('\n').expect("a title");
    try_run(cards.trim_end_matches(".end\n"), options).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn exact(name: &str, span: u32) -> Run {
    let run = run(
        name,
        span,
        SimOptions {
            method: Method::Exact,
            ..SimOptions::default()
        },
    );
    assert!(
        run.energy.residual_relative < 1e-10,
        "{name}: {:?}",
        run.energy
    );
    run
}

/// Largest distance of a probe from a run of Moreau's scheme, relative to its amplitude, at steps of `h` and h/2.
fn errors(name: &str, span: u32, exact: &Run, probe: &str, h: f64) -> (f64, f64) {
    let reference = column(exact, probe);
    let amplitude = reference.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
    let error = |step: f64| {
        let moreau = run(
            name,
            span,
            SimOptions {
                method: Method::Euler,
                step: Some(step),
                ..SimOptions::default()
            },
        );
        let values = column(&moreau, probe);
        assert_eq!(values.len(), reference.len());
        let distance = values.iter().zip(&reference).map(|(a, b)| (a - b).abs());
        distance.fold(0.0, f64::max) / amplitude
    };
    (error(h), error(0.5 * h))
}

/// First order, and below `within` at h/2.
fn converges(name: &str, span: u32, probe: &str, h: f64, within: f64) -> Run {
    let exact = exact(name, span);
    let (coarse, fine) = errors(name, span, &exact, probe, h);
    let ratio = coarse / fine;
    assert!(
        fine < within && (1.6..2.6).contains(&ratio),
        "{name} {probe}: {coarse:e} {fine:e}"
    );
    exact
}

#[test]
fn standard_values() {
    let run = converges("buck-feedback", 100, "i(l1)", 20e-9, 3e-3);
    // Between the transistors the inductor's current goes through a body diode.
    assert!(
        run.events.iter().any(|e| e.concerns("dn")),
        "{:?}",
        run.events
    );
}

#[test]
fn square_law_transistors() {
    converges("buck-mos", 20, "i(l1)", 4e-9, 2e-3);
}

/// At every crossing of the comparator both transistors contradict each other by what the right limit is off.
#[test]
fn steps_pass_crossings_that_contradict_each_other() {
    let options = SimOptions {
        method: Method::Euler,
        step: Some(2e-9),
        ..SimOptions::default()
    };
    run("buck-double-crossing", 30, options);
}

#[test]
fn double_crossings() {
    converges("buck-double-crossing", 20, "v(3)", 4e-9, 0.03);
    let run = exact("buck-double-crossing", 200);
    // After the start the comparator's output leaves its rails more than once in each direction within some period.
    let period = 1.6667e-6;
    let most = (0..119)
        .map(|k| {
            let inside = |t: f64| t >= f64::from(k) * period && t < f64::from(k + 1) * period;
            let opened = run
                .events
                .iter()
                .filter(|e| inside(e.t) && e.turns("sn", true));
            opened.count()
        })
        .max();
    assert!(most >= Some(2), "{most:?} {:?}", run.events);
}

/// With an infinite gain behind two lags (the filter's inductor, the amplifier's pole) the comparator does not hold the
/// amplifier on the ramp: its crossings come faster and faster, down to a cycle that the pole sets.
#[test]
fn a_multivalued_comparator_behind_lags_cycles() {
    converges("buck-multivalued", 20, "i(l1)", 4e-9, 0.02);
    let run = exact("buck-multivalued", 200);
    assert!(run.notes.iter().all(|n| !n.text.contains("bcomp slides")));
    let crossings: Vec<f64> = run
        .events
        .iter()
        .filter(|e| e.turns("sn", true))
        .map(|e| e.t)
        .collect();
    let intervals = crossings.windows(2).map(|w| w[1] - w[0]);
    let (shortest, longest) = intervals.fold((f64::INFINITY, 0.0_f64), |(s, l), dt| {
        (s.min(dt), l.max(dt))
    });
    assert!((5e-9..1e-7).contains(&shortest), "{shortest:e}");
    assert!(longest > 1e-6, "{longest:e}");
}

/// Where the comparator reaches the amplifier's slope at once, it slides once a period, with few events.
#[test]
fn a_multivalued_comparator_slides() {
    converges("buck-sliding", 100, "i(l1)", 20e-9, 6e-3);
    let run = exact("buck-sliding", 20);
    assert!(
        run.notes
            .iter()
            .any(|n| n.text.starts_with("bcomp slides") && n.text.contains("12 times")),
        "{:?}",
        run.notes
    );
    // Onto the ramp, off it at the ramp's end: no chatter.
    assert!(run.events.len() <= 3 * 12, "{} events", run.events.len());
    // On the ramp the amplifier has the ramp's value and the comparator's output is between its levels.
    let time = &run.waveforms.time;
    let (amplifier, output) = (column(&run, "v(5)"), column(&run, "v(7)"));
    let mut held = 0;
    for (k, t) in time.iter().enumerate().skip(1) {
        if (0.01..2.99).contains(&output[k]) {
            held += 1;
            let ramp = 2.25 / 1.655e-6 * (t - (t / 1.6667e-6).floor() * 1.6667e-6);
            assert!((amplifier[k] - ramp).abs() < 1e-9, "{t:e}");
        }
    }
    assert!(held > 100, "{held}");
}
