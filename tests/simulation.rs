//! Runs that their caller drives: they give what whole runs give, whatever happens in between.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "tests"
)]

use circ::{Method, Model, Run, SimOptions, Simulation, SimulationOptions, StopReason};

const BUCK: &str = "vin in 0 24\ns1 in sw g 0 sw\nd1 0 sw d\nl1 sw out 47u\nc1 out 0 22u\nr1 out 0 5\n\
    vg g 0 pulse(0 1 3.3u 0 0 4.1u 10u)\n.model sw sw(vt=0.5 vh=0 ron=10m roff=10meg)\n.model d d(ideal)\n.tran 1u 400u uic\n";
/// Its output decides when the switches move.
const HYSTERETIC: &str = "vin in 0 12\ns1 in sw ref out s\ns2 sw 0 out ref s\nvref ref 0 5\nl1 sw out 22u\nrc out x 20m\nc1 x 0 47u\n\
    r1 out 0 2\n.model s sw(vt=0 vh=0.05 ron=1m roff=1meg)\n.tran 1u 300u uic\n";
const RECTIFIER: &str = "v1 a 0 sin(0 10 1k)\nr1 a b 1\nd1 b c d\nc1 c 0 47u\nr2 c 0 100\n.model d d(ideal)\n.tran 20u 3m uic\n";
/// Made in steps.
const CURVED: &str = "v1 a 0 sin(0 10 1k)\nr1 a b 1\nd1 b c d\nc1 c 0 47u\nr2 c 0 100\n.model d d(is=1e-14)\n.tran 20u 3m uic\n";

fn model(cards: &str) -> Model {
    Model::parse(&format!("test\n{cards}.end\n"), "test.cir").unwrap()
}

fn simulation(cards: &str, options: SimulationOptions) -> Simulation {
    model(cards).simulation(options).unwrap()
}

fn whole(cards: &str, method: Method) -> Run {
    let options = SimOptions {
        method,
        ..SimOptions::default()
    };
    model(cards).transient(options).unwrap()
}

/// The largest difference of the rows of a run from what `value` says at their times, relative to amplitudes.
fn apart(run: &Run, mut value: impl FnMut(f64, &str) -> f64) -> f64 {
    let waves = &run.waveforms;
    let columns = waves.names.len();
    let mut amplitudes = vec![f64::MIN_POSITIVE; columns];
    let mut far = vec![0.0_f64; columns];
    for (row, t) in waves.values.chunks(columns).zip(&waves.time) {
        for (k, expected) in row.iter().enumerate() {
            amplitudes[k] = amplitudes[k].max(expected.abs());
            far[k] = far[k].max((expected - value(*t, &waves.names[k])).abs());
        }
    }
    far.iter()
        .zip(&amplitudes)
        .map(|(f, a)| f / a)
        .fold(0.0, f64::max)
}

#[test]
fn simulations_can_be_sent_to_threads() {
    fn sent<T: Send + 'static>() {}
    sent::<Simulation>();
    sent::<Model>();
    sent::<circ::Checkpoint>();
}

#[test]
fn stops_on_the_way_change_nothing() {
    for cards in [BUCK, HYSTERETIC, RECTIFIER] {
        let run = whole(cards, Method::Auto);
        let mut driven = simulation(cards, SimulationOptions::default());
        let mut now = 0.0;
        let far = apart(&run, |t, name| {
            // Stops at odd times, rows or none.
            while now < t {
                now = (now + 0.37 * run.waveforms.time[1]).min(t);
                driven.advance_to(now).unwrap();
            }
            driven.value(name).unwrap()
        });
        assert!(far < 1e-10, "{far:e} of\n{cards}");
        let whole = driven.finish();
        assert_eq!(whole.stats.jumps, run.stats.jumps);
        assert!(whole.energy.residual_relative < 1e-10, "{:?}", whole.energy);
        assert!((whole.energy.source / run.energy.source - 1.0).abs() < 1e-9);
    }
}

#[test]
fn it_stops_at_every_event() {
    for (cards, method) in [
        (BUCK, Method::Auto),
        (HYSTERETIC, Method::Auto),
        (RECTIFIER, Method::Euler),
    ] {
        let run = whole(cards, method);
        let until = *run.waveforms.time.last().unwrap();
        let step = (method == Method::Euler).then_some(1e-6);
        let mut driven = simulation(
            cards,
            SimulationOptions {
                method,
                step,
                ..SimulationOptions::default()
            },
        );
        let run = if step.is_some() {
            model(cards)
                .transient(SimOptions {
                    method,
                    step,
                    ..SimOptions::default()
                })
                .unwrap()
        } else {
            run
        };
        let mut events = Vec::new();
        loop {
            let stop = driven.advance_to_event(until).unwrap();
            if stop.reason == StopReason::Event {
                assert!(stop.events.iter().all(|e| e.t <= stop.time), "{stop:?}");
                assert_eq!(stop.events.last().map(|e| e.t), Some(stop.time));
            }
            events.extend(stop.events);
            if stop.reason == StopReason::Time {
                break;
            }
        }
        let expected: Vec<_> = run.events.iter().filter(|e| e.t > 0.0).collect();
        assert_eq!(events.len(), expected.len(), "{cards}");
        for (found, expected) in events.iter().zip(expected) {
            assert!(
                (found.t - expected.t).abs() < 1e-12 + 1e-3 * step.unwrap_or(0.0),
                "{found} {expected}"
            );
            assert_eq!(found.changes, expected.changes);
        }
    }
}

/// Sources that are set are those that a netlist moves at the same times.
#[test]
fn a_source_that_is_set_is_an_edge() {
    for (cards, within) in [(RECTIFIER, 1e-11), (CURVED, 2e-3)] {
        let moved = cards.replace("sin(0 10 1k)", "pwl(0 8 0.4m 8 0.4m -3 1.1m -3 1.1m 12)");
        let held = cards.replace("sin(0 10 1k)", "8");
        let run = whole(&moved, Method::Auto);
        let mut driven = simulation(&held, SimulationOptions::default());
        let far = apart(&run, |t, name| {
            for (at, value) in [(0.4e-3, -3.0), (1.1e-3, 12.0)] {
                if driven.time() < at && t >= at {
                    driven.advance_to(at).unwrap();
                    driven.set_source("v1", value).unwrap();
                }
            }
            driven.advance_to(t).unwrap();
            driven.value(name).unwrap()
        });
        assert!(far < within, "{far:e}");
        let energy = driven.finish().energy;
        assert!(energy.residual_relative < 1e-9, "{energy:?}");
        assert!(
            (energy.source / run.energy.source - 1.0).abs() < within,
            "{energy:?} {:?}",
            run.energy
        );
    }
}

/// So is a sine, and a source that only moves a switch.
#[test]
fn whatever_waveform_a_source_had_it_can_be_set() {
    let mut driven = simulation(RECTIFIER, SimulationOptions::default());
    driven.advance_to(1e-3).unwrap();
    driven.set_source("v1", 5.0).unwrap();
    driven.advance_to(3e-3).unwrap();
    let v = driven.value("v(a)").unwrap();
    assert_eq!(v, 5.0);
    let mut driven = simulation(BUCK, SimulationOptions::default());
    driven.advance_to(5e-6).unwrap();
    // On since 3.3 us, and for ever.
    driven.set_source("vg", 1.0).unwrap();
    let stop = driven.advance_to(400e-6).unwrap();
    assert!(
        stop.events.iter().all(|e| !e.concerns("s1")),
        "{:?}",
        stop.events
    );
    let on = whole(&BUCK.replace("4.1u 10u", "1 2"), Method::Auto);
    let expected = on.waveforms.column(column(&on, "v(out)")).last().unwrap();
    let out = driven.value("v(out)").unwrap();
    assert!((out - expected).abs() < 1e-9, "{out} {expected}");
}

/// Two sources are set one after the other before a switch closes for the first time: three resistors of 1 kΩ then have (2 V + 4 V)/3.
#[test]
fn sources_that_are_set_stay_so_in_every_position_of_the_switches() {
    let cards = "v1 a 0 0\nv2 b 0 0\nr1 a out 1k\nr2 b out 1k\nc1 out 0 1u\nr3 out x 1k\ns1 x 0 g 0 sw\n\
        vg g 0 pulse(0 1 5m 0 0 1 2)\n.model sw sw(ideal vt=0.5)\n.tran 1m 20m uic\n";
    for method in [Method::Exact, Method::Theta] {
        let options = SimulationOptions {
            method,
            ..SimulationOptions::default()
        };
        let mut driven = simulation(cards, options);
        driven.advance_to(1e-3).unwrap();
        driven.set_source("v1", 2.0).unwrap();
        driven.set_source("v2", 4.0).unwrap();
        driven.advance_to(20e-3).unwrap();
        let out = driven.value("v(out)").unwrap();
        assert!((out - 2.0).abs() < 1e-9, "{method:?}: {out}");
    }
}

/// A source is set before a switch is taken over, where 1 µΩ between two capacitors makes a state of a picosecond that stands apart: five time
/// constants of 2 ms later the other one is at 1 − e⁻⁵ of what was set, and 1 MΩ beside 1 kΩ takes a thousandth.
#[test]
fn sources_that_are_set_stay_so_where_fast_states_stand_apart() {
    let cards = "v1 in 0 5\nr1 in a 1k\nc1 a 0 1u\nr2 a b 1u\nc2 b 0 1u\ns1 b x g 0 sw\nr3 x 0 1meg\nvg g 0 0\n\
        .model sw sw(vt=0.5 vh=0 ron=1 roff=1g)\n.tran 10u 10m uic\n";
    let mut driven = simulation(cards, SimulationOptions::default());
    driven.set_source("v1", 10.0).unwrap();
    driven.set_switch("s1", true).unwrap();
    driven.advance_to(10e-3).unwrap();
    let out = driven.value("v(b)").unwrap();
    assert!(
        (out - 10.0 * (1.0 - (-5.0_f64).exp())).abs() < 2e-2,
        "{out}"
    );
}

#[test]
fn a_switch_that_is_set_moves_like_one_that_is_controlled() {
    let run = whole(BUCK, Method::Auto);
    let idle = BUCK.replace("pulse(0 1 3.3u 0 0 4.1u 10u)", "0");
    let mut driven = simulation(&idle, SimulationOptions::default());
    let edges: Vec<(f64, bool)> = (0..40)
        .flat_map(|k| {
            let start = 3.3e-6 + 1e-5 * f64::from(k);
            [(start, true), (start + 4.1e-6, false)]
        })
        .collect();
    let mut next = edges.iter().peekable();
    let far = apart(&run, |t, name| {
        while let Some((at, on)) = next.next_if(|(at, _)| *at <= t) {
            driven.advance_to(*at).unwrap();
            let events = driven.set_switch("s1", *on).unwrap();
            assert!(events.iter().any(|e| e.turns("s1", *on)), "{at} {events:?}");
        }
        driven.advance_to(t).unwrap();
        if name == "v(g)" {
            run_gate(&edges, t)
        } else {
            driven.value(name).unwrap()
        }
    });
    assert!(far < 1e-9, "{far:e}");
    assert_eq!(driven.positions().len(), 1);
    assert!(driven.finish().energy.residual_relative < 1e-10);
}

fn run_gate(edges: &[(f64, bool)], t: f64) -> f64 {
    let on = edges
        .iter()
        .rev()
        .find(|(at, _)| *at <= t)
        .is_some_and(|(_, on)| *on);
    f64::from(u8::from(on))
}

/// A run taken up again from a checkpoint goes the same way, also where sources and switches were moved in between.
#[test]
fn checkpoints_lead_back() {
    for (cards, within) in [
        (BUCK, 1e-11),
        (HYSTERETIC, 1e-9),
        (RECTIFIER, 1e-11),
        (CURVED, 1e-3),
    ] {
        let run = whole(cards, Method::Auto);
        let until = *run.waveforms.time.last().unwrap();
        let mut driven = simulation(cards, SimulationOptions::default());
        driven.advance_to(0.3 * until).unwrap();
        let kept = driven.checkpoint().unwrap();
        let state = driven.state();
        driven.advance_to(0.6 * until).unwrap();
        let source = if cards.contains("vin") { "vin" } else { "v1" };
        driven.set_source(source, -2.0).unwrap();
        if !driven.switches().is_empty() {
            driven.set_switch("s1", true).unwrap();
        }
        driven.advance_to(0.9 * until).unwrap();
        driven.restore(&kept).unwrap();
        assert_eq!(driven.time(), 0.3 * until);
        for (a, b) in driven.state().iter().zip(&state) {
            assert!((a - b).abs() <= 1e-12 * b.abs().max(1e-3), "{a} {b}");
        }
        let far = apart(&run, |t, name| {
            if t < driven.time() {
                return run
                    .waveforms
                    .column(column(&run, name))
                    .nth(row(&run, t))
                    .unwrap();
            }
            driven.advance_to(t).unwrap();
            driven.value(name).unwrap()
        });
        assert!(far < within, "{far:e} of\n{cards}");
        let energy = driven.finish().energy;
        assert!(
            (energy.source / run.energy.source - 1.0).abs() < within.max(1e-9),
            "{energy:?} {:?}",
            run.energy
        );
        assert!(energy.residual_relative < 1e-9, "{energy:?}");
    }
}

fn column(run: &Run, name: &str) -> usize {
    run.waveforms.names.iter().position(|n| n == name).unwrap()
}

fn row(run: &Run, t: f64) -> usize {
    run.waveforms.time.iter().position(|s| *s == t).unwrap()
}

#[test]
fn what_cannot_be_done_is_said() {
    let mut driven = simulation(BUCK, SimulationOptions::default());
    driven.advance_to(1e-5).unwrap();
    let back = driven.advance_to(0.0).unwrap_err().to_string();
    assert!(back.contains("stands at 1e-5 s"), "{back}");
    assert!(
        driven
            .advance_to(1.0)
            .unwrap_err()
            .to_string()
            .contains("ends at 4e-4 s")
    );
    assert!(
        driven
            .set_source("vx", 1.0)
            .unwrap_err()
            .to_string()
            .contains("there are vin vg")
    );
    assert!(
        driven
            .set_switch("s2", true)
            .unwrap_err()
            .to_string()
            .contains("there are s1")
    );
    assert!(driven.set_source("vin", f64::NAN).is_err());
    assert!(
        driven
            .value("v(nowhere)")
            .unwrap_err()
            .to_string()
            .contains("v(out)")
    );
    let line = "v1 1 0 1\nt1 1 0 2 0 z0=50 td=1n\nr1 2 0 50\n.tran 1n 10n\n";
    let mut driven = simulation(line, SimulationOptions::default());
    assert!(
        driven
            .set_source("v1", 2.0)
            .unwrap_err()
            .to_string()
            .contains("transmission lines")
    );
}

#[test]
fn a_model_takes_other_values() {
    let mut model = model(
        "v1 in 0 pulse(0 {high} 0 0 0 1 2)\n.param high=5\nr1 in out 1k\nc1 out 0 1u\nx1 out s\n.subckt s a\nr1 a 0 1g\n.ends\n.tran 1u 1m uic\n",
    );
    let at_end = |model: &Model| {
        let run = model.transient(SimOptions::default()).unwrap();
        let out = column(&run, "v(out)");
        run.waveforms.column(out).last().unwrap()
    };
    let settled = |high: f64, tau: f64| high * (1.0 - (-1e-3 / tau).exp());
    assert!((at_end(&model) - settled(5.0, 1e-3)).abs() < 1e-5);
    model.set("c1", 2e-6).unwrap();
    assert!((at_end(&model) - settled(5.0, 2e-3)).abs() < 1e-5);
    model.set("R1", 500.0).unwrap();
    model.set("high", 3.0).unwrap();
    assert!((at_end(&model) - settled(3.0, 1e-3)).abs() < 1e-5);
    for (name, says) in [
        ("v1", "waveform"),
        ("x1.r1", "subcircuit"),
        ("nothing", "no parameter"),
    ] {
        let error = model.set(name, 1.0).unwrap_err().to_string();
        assert!(error.contains(says), "{name}: {error}");
    }
    assert!((at_end(&model) - settled(3.0, 1e-3)).abs() < 1e-5);
}

/// A product took 3 V and 0.4 V as numbers: what it gives would not follow.
#[test]
fn a_source_that_an_expression_took_as_a_number_is_not_set() {
    let text =
        "t\nvc c 0 0.4\nvd d 0 3\nb1 w 0 v={v(c)*v(d)}\nr1 w 0 1k\nc1 w 0 1u\n.tran 1u 1m\n.end\n";
    let model = circ::Model::parse(text, "t.cir").expect("a circuit");
    let mut simulation = model
        .simulation(circ::SimulationOptions::default())
        .expect("a simulation");
    let error = simulation.set_source("vc", 0.8).expect_err("a refusal");
    assert_eq!(error.elements, ["vc"]);
}
