//! Netlists simulated by the steppers, against closed forms, exact columns and conservation.
#![allow(missing_docs, reason = "tests")]

use circ::circuit::{ElaborateOptions, elaborate};
use circ::diagnostic::SourceMap;
use circ::integrate::{
    Error, Method, Run, SimOptions, Values, operating_point, simulate as run_simulation,
};
use circ::mna::behaviour;
use circ::netlist::parse;
use circ::settings::Settings;

fn circuit(text: &str) -> circ::circuit::Circuit {
    let mut sources = SourceMap::default();
    let root = sources.add("test.cir", format!("test\n{text}\n.end\n"));
    let (netlist, findings) = parse(&mut sources, root, &|_| {
        Err(std::io::ErrorKind::NotFound.into())
    });
    let (circuit, more) = elaborate(&netlist, &ElaborateOptions::default());
    circuit.unwrap_or_else(|| panic!("{findings:?} {more:?}"))
}

fn attempt(text: &str, options: SimOptions<'_>) -> Result<Run, Error> {
    let circuit = circuit(text);
    let behaviour = behaviour(&circuit).expect("a behaviour");
    run_simulation(&circuit, &behaviour, options)
}

fn simulate(text: &str, options: SimOptions<'_>) -> Run {
    attempt(text, options).unwrap_or_else(|e| panic!("{e}"))
}

fn theta<'a>() -> SimOptions<'a> {
    SimOptions {
        method: Method::Theta,
        ..SimOptions::default()
    }
}

fn fixed<'a>(method: Method, h: f64) -> SimOptions<'a> {
    SimOptions {
        method,
        step: Some(h),
        ..SimOptions::default()
    }
}

/// The column of a probe.
fn column(run: &Run, name: &str) -> Vec<f64> {
    let names = &run.waveforms.names;
    let j = names
        .iter()
        .position(|n| n == name)
        .unwrap_or_else(|| panic!("{name} of {names:?}"));
    run.waveforms
        .values
        .iter()
        .skip(j)
        .step_by(names.len())
        .copied()
        .collect()
}

fn at(run: &Run, name: &str, t: f64) -> f64 {
    let k = run
        .waveforms
        .time
        .iter()
        .rposition(|&x| (x - t).abs() <= 1e-9 * t)
        .expect("a row");
    column(run, name)[k]
}

fn close(value: f64, expected: f64, within: f64) {
    assert!(
        (value - expected).abs() <= within,
        "{value} is not {expected} within {within}"
    );
}

const IDEAL: &str = ".model di d(ron=0 vfwd=0 n=0.01)";

/// 1 µF at 10 V is joined to 1 µF at 0 V through a source of k times the voltage of the second: v_1 = (1 + k) v_2 and v_1 + v_2 = 10 V. The
/// charge q falls through 10 V at first and nothing at last, and meets k v_2/2 in the source on average.
#[test]
fn a_jump_through_a_controlled_source_balances_its_energy() {
    for k in [0.5, -0.5] {
        let text = format!(
            "c1 a 0 1u ic=10\ne1 a b c 0 {k}\nd1 b c dm\nc2 c 0 1u ic=0\nr1 c 0 1k\n.model dm d(ideal)\n.tran 10u 1m uic"
        );
        let charge = 1e-6 * 10.0 / (2.0 + k);
        for method in [Method::Exact, Method::Theta, Method::Euler] {
            let options = SimOptions {
                method,
                ..SimOptions::default()
            };
            let energy = simulate(&text, options).energy;
            assert!(
                (energy.jumps / (5.0 * charge) - 1.0).abs() < 1e-12,
                "{method:?} {energy:?}"
            );
            assert!(energy.residual_relative < 1e-11, "{method:?} {energy:?}");
        }
    }
}

/// Two capacitors that an edge leaves at −1.12 V and 5 mΩ discharge within nanoseconds, until a diode holds them at 0 V: the area below that
/// voltage is in the inductor's current for good, and no step that ends behind it sees it, nor do its halves.
#[test]
fn steps_see_what_ends_at_a_diode_within_them() {
    let text = "v1 n 0 pulse(4 -3 1u 0 0 10u 20u)\nl1 n a 10u ic=5\nc0 n a 54.4n ic=4\nc1 a 0 285.6n\nd1 a 0 dm\nr1 a 0 5m
.model dm d(ideal)\n.tran 0.5u 3u uic";
    let exact = at(&simulate(text, SimOptions::default()), "i(l1)", 3e-6);
    for (method, tol) in [
        (Method::Theta, 1e-5),
        (Method::Theta, 1e-7),
        (Method::Euler, 1e-5),
    ] {
        let options = SimOptions {
            method,
            settings: Settings {
                tol,
                ..Settings::default()
            },
            ..SimOptions::default()
        };
        let found = at(&simulate(text, options), "i(l1)", 3e-6);
        close(found, exact, tol * 5.4);
    }
}

/// Steps of the midpoint rule at this tolerance.
fn midpoint(tol: f64) -> SimOptions<'static> {
    SimOptions {
        method: Method::Theta,
        settings: Settings {
            tol,
            ..Settings::default()
        },
        ..SimOptions::default()
    }
}

/// A sine of 1.5 V charges a capacitor over a diode, and two others clamp it at 0.7 V and 1.1 mΩ, with a time constant of 0.16 µs, until all three end within a microsecond:
/// a step of 9 µs and both its halves had them off from their start, with the capacitor 1 mV higher.
#[test]
fn steps_see_devices_that_end_early_in_them() {
    let text = "v1 1 0 sin(0 1.5 1.694915254237288k)\nd0 1 2 dm\nd2 2 0 dm\nd5 2 0 dm\nc3 0 2 301.4u\nrg2 2 0 9.57
.model dm d(ron=1.1m roff=11k vfwd=0.7)\n.tran 9.077u 0.2m uic";
    let exact = at(&simulate(text, SimOptions::default()), "v(2)", 0.2e-3);
    for tol in [1e-4, 1e-5, 1e-6] {
        let found = at(&simulate(text, midpoint(tol)), "v(2)", 0.2e-3);
        close(found, exact, tol * 0.7);
    }
}

/// A source falls by 5 V/µs, and the 46 A that it drives through two diodes end within 0.9 µs, in the second half of a step: the first diode
/// would keep its 0 V until the end of that step, and of the step's second half, at any tolerance.
#[test]
fn steps_see_a_current_that_ends_behind_its_mean() {
    let text = "v1 n 0 pulse(5 0 1u 1u 1u 1 2)\nc1 n a 122.2n ic=5\nc0 a 0 342.2n\nc2 a b 792.2n\nd0 b 0 di\nd1 n b dr\nr3 a 0 253\nr4 b 0 582
.model di d(ideal)\n.model dr d(ron=0.1 roff=1meg vfwd=0.4)\n.tran 0.5u 5u uic";
    let exact = at(&simulate(text, SimOptions::default()), "v(b)", 5e-6);
    for tol in [1e-4, 1e-5, 1e-7] {
        let found = at(&simulate(text, midpoint(tol)), "v(b)", 5e-6);
        close(found, exact, tol * 5.0);
    }
}

/// A source that begins to rise by 5 V/µs, into 42.81 nF behind which a diode leads 114.3 nF to ground: their current begins at once, and that
/// through 11.2 Ω and a diode beside the first one grows from nothing within microseconds.
#[test]
fn a_current_at_an_edge_is_that_of_the_instant() {
    let text = "v1 n 0 pulse(0 5 0.1m 1u 1u 0.2m 0.5m)\nr1 m n 11.2\nc1 n a 42.81n ic=0\nc2 a b 114.3n ic=0\nd1 m a dm\nd2 b 0 dm\nr2 b 0 27
.model dm d(ideal)\n.tran 5u 0.15m uic";
    let series = 1.0 / (1.0 / 42.81e-9 + 1.0 / 114.3e-9);
    for method in [Method::Exact, Method::Theta, Method::Euler] {
        let options = SimOptions {
            method,
            ..SimOptions::default()
        };
        let run = simulate(text, options);
        close(at(&run, "i(v1)", 1e-4), -5e6 * series, 2e-6 * 0.16);
    }
}

/// Capacitors of 1 V and 0 V that a loop with sources of −3 V and 1 V joins, the second one controlled by a third capacitor: 5 V are too much
/// around the loop, and a charge of 0.5 µF times them passes both sources.
#[test]
fn capacitors_joined_through_a_controlled_source_balance_their_energy() {
    let text = "v1 n 0 -3\nc1 a 0 1u ic=1\ne1 m a b 0 -1\nc2 m n 1u ic=0\nc3 b 0 1 ic=-1\nr1 a 0 1k\n.tran 10u 1m uic";
    for method in [Method::Exact, Method::Theta, Method::Euler] {
        let options = SimOptions {
            method,
            ..SimOptions::default()
        };
        let run = simulate(text, options);
        let (energy, first) = (&run.energy, &run.state_jumps.first[0]);
        close(first.loss, 0.5 * 0.5e-6 * 25.0, 1e-15);
        // c1 ends at 1 V − 2.5 V.
        close(at(&run, "v(a)", 0.0), -1.5, 1e-12);
        assert!(energy.residual_relative < 1e-12, "{method:?} {energy:?}");
    }
}

/// Windings with k = 1 share one magnetising current, i_1 + √(L_2/L_1) i_2 = 1 A + 2 · 0.5 A at first, of which each has its part where it
/// can flow: through 1 Ω ∥ 4 Ω/2² it makes −1 V.
#[test]
fn initial_currents_of_windings_without_leakage_add_up() {
    let run = simulate(
        "l1 a 0 1m ic=1\nl2 b 0 4m ic=0.5\nk1 l1 l2 1\nr1 a 0 1\nr2 b 0 4\n.tran 1u 10u uic",
        SimOptions::default(),
    );
    assert!((column(&run, "v(a)")[0] + 1.0).abs() < 1e-12);
    assert!((column(&run, "v(b)")[0] + 2.0).abs() < 1e-12);
}

#[test]
fn rc_charging_meets_its_closed_form() {
    let run = simulate("v1 1 0 1\nr1 1 2 1k\nc1 2 0 1u\n.tran 10u 5m uic", theta());
    for t in [1e-3, 5e-3] {
        close(at(&run, "v(2)", t), 1.0 - (-t / 1e-3_f64).exp(), 1e-4);
    }
    assert!(run.energy.residual_relative < 1e-12, "{:?}", run.energy);
    close(run.energy.source, 1e-6 * (1.0 - (-5.0_f64).exp()), 1e-10);
}

#[test]
fn without_uic_the_operating_point_starts_the_run() {
    let run = simulate("v1 1 0 1\nr1 1 2 1k\nc1 2 0 1u\n.tran 10u 1m", theta());
    close(column(&run, "v(2)")[0], 1.0, 0.0);
    close(at(&run, "v(2)", 1e-3), 1.0, 1e-12);
}

#[test]
fn maffezzonis_switch_against_the_exact_periods() {
    let text = "v4 4 0 20\ns1 4 1 3 2 sw\nd1 0 1 dm\nl1 1 2 200u ic=0\nr1 2 0 1\n\
        v3 3 0 pulse(7.5 -2.5 0 20u 0 0 20u)\n\
        .model sw sw(ron=1m roff=1k vt=0 vh=0)\n.model dm d(ron=1m roff=1k vfwd=0)\n\
        .tran 0.1u 200u uic\n.save i(l1)";
    let exact = [
        1.173271783,
        2.055345254,
        2.717545430,
        3.214130750,
        3.586205968,
    ];
    let run = simulate(text, theta());
    for (k, exact) in exact.iter().enumerate() {
        close(at(&run, "i(l1)", 20e-6 * (k + 1) as f64), *exact, 5e-4);
    }
    let offs = [12.564487, 30.693306, 49.264901, 68.179976];
    let seen: Vec<f64> = run
        .events
        .iter()
        .filter(|event| event.turns("s1", false))
        .map(|event| event.t * 1e6)
        .collect();
    for (seen, exact) in seen.iter().zip(offs) {
        close(*seen, exact, 2e-3);
    }
}

#[test]
fn source_driven_switch_closes_two_capacitors_together() {
    let text = "c1 1 0 1u ic=10\nc2 2 0 0.3u ic=0\ns1 1 2 3 0 sw\nv3 3 0 pulse(0 1 10u 0 0 1 2)\n\
        r1 1 0 1g\n.model sw sw(vt=0.5 vh=0 ron=0 roff=1t)\n.tran 1u 20u uic\n.save v(1) v(2)";
    let options = SimOptions {
        events: true,
        ..theta()
    };
    let run = simulate(text, options);
    close(at(&run, "v(2)", 20e-6), 10.0 / 1.3, 1e-6);
    close(at(&run, "v(1)", 10e-6), 10.0 / 1.3, 1e-6);
    // Rows before and after at the switching time.
    let rows = run
        .waveforms
        .time
        .iter()
        .filter(|&&t| (t - 10e-6).abs() < 1e-15)
        .count();
    assert_eq!(rows, 2, "{:?}", run.events);
    close(
        run.energy.jumps,
        0.5 * 1e-4 - 0.5 * 1.3e-6 * (10.0_f64 / 1.3).powi(2),
        1e-10,
    );
}

#[test]
fn edge_into_a_bridge_capacitor_jumps_and_reports_its_charge() {
    let text = format!(
        "v1 1 0 pulse(0 5 10u 0 0 1 2)\nd1 1 2 di\nc1 2 0 1u ic=0\nr1 2 0 1k\n{IDEAL}\n\
         .tran 1u 30u uic\n.save v(2) i(d1)"
    );
    let run = simulate(&text, theta());
    close(at(&run, "v(2)", 10e-6), 5.0, 1e-12);
    assert_eq!(run.stats.jumps, 1);
    let impulse = run
        .impulses
        .iter()
        .find(|i| i.name == "i(d1)")
        .expect("an impulse");
    close(impulse.area, 5e-6, 1e-17);
    close(at(&run, "i(d1)", 20e-6), 5e-3, 1e-8);
    assert!(run.energy.residual_relative < 1e-9, "{:?}", run.energy);
}

#[test]
fn rows_do_not_depend_on_the_step() {
    let text =
        format!("v1 1 0 sin(0 10 1k)\nd1 1 2 di\nc1 2 0 1u\nr1 2 0 1k\n{IDEAL}\n.tran 30u 1m uic");
    let time = |h| simulate(&text, fixed(Method::Euler, h)).waveforms.time;
    assert_eq!(time(1e-6), time(7.7e-6));
    assert_eq!(time(1e-6).last(), Some(&1e-3));
}

#[test]
fn half_wave_rectifier_follows_the_source_while_conducting() {
    let text = format!(
        "v1 1 0 sin(0 10 1k)\nd1 1 2 di\nc1 2 0 1u\nr1 2 0 1k\n{IDEAL}\n.tran 10u 250u uic"
    );
    for options in [theta(), fixed(Method::Euler, 1e-7)] {
        let run = simulate(&text, options);
        for t in [50e-6, 100e-6, 200e-6] {
            close(at(&run, "v(2)", t), at(&run, "v(1)", t), 1e-12);
        }
    }
}

#[test]
fn operating_points() {
    let settings = Settings::default();
    let op = |text: &str| operating_point(&circuit(text), Values::Dc, false, &settings);
    let point = op(&format!(
        "v1 1 0 5\nr1 1 2 1k\nd1 2 0 di\nc1 2 0 1u\nl1 1 3 1m\nr2 3 0 10\n{IDEAL}"
    ))
    .unwrap();
    assert_eq!(point.nodes[1], ("2".to_string(), 0.0));
    let currents: std::collections::BTreeMap<_, _> = point.currents.into_iter().collect();
    close(currents["d1"], 5e-3, 1e-15);
    close(currents["l1"], 0.5, 1e-13);
    close(currents["v1"], -0.505, 1e-13);

    let floating = op("v1 1 0 5\nc2 2 0 1u\nc1 1 2 1u").unwrap();
    assert_eq!(floating.nodes[1], ("2".to_string(), 0.0));
    assert!(
        floating.notes[0].text.contains("capacitors alone"),
        "{:?}",
        floating.notes
    );

    let shorted = op("v1 1 0 5\nl1 1 0 1m").unwrap_err();
    assert!(shorted.to_string().contains("uic"), "{shorted}");
    let blocked = op("i1 0 1 1\nc1 1 0 1u").unwrap_err();
    assert!(blocked.to_string().contains("uic"), "{blocked}");
}

#[test]
fn initial_node_voltages_are_held_and_released() {
    let text = "v1 1 0 1\nr1 1 2 1k\nc1 2 0 1u\n.ic v(2)=0.25\n.tran 10u 1m";
    let run = simulate(text, theta());
    close(column(&run, "v(2)")[0], 0.25, 1e-15);
    close(at(&run, "v(2)", 1e-3), 1.0 - 0.75 * (-1.0_f64).exp(), 1e-4);
}

#[test]
fn initial_inductor_currents_are_held_and_released() {
    // A freewheeling inductor: its current goes on through the diode, from where `.ic` holds it.
    let text = format!(
        "v1 1 0 10\nr1 1 2 10k\nl1 2 3 1m\nr2 3 0 5\nd1 0 2 di\n.ic i(l1)=2\n{IDEAL}\n.tran 10u 1m\n.save i(l1) v(3)"
    );
    let run = simulate(&text, SimOptions::default());
    assert!(run.notes.is_empty(), "{:?}", run.notes);
    close(column(&run, "i(l1)")[0], 2.0, 1e-15);
    close(at(&run, "i(l1)", 1e-4), 2.0 * (-0.5_f64).exp(), 1e-12);
    // With a voltage: a converter that starts where it works.
    let text = format!(
        "v1 1 0 10\nl1 1 2 1m\nd1 2 3 di\nc1 3 0 100u\nr1 3 0 5\n.ic i(l1)=3 v(3)=12\n{IDEAL}\n.tran 10u 1m\n.save i(l1) v(3)"
    );
    let run = simulate(&text, SimOptions::default());
    close(column(&run, "i(l1)")[0], 3.0, 1e-14);
    close(column(&run, "v(3)")[0], 12.0, 1e-14);
    // Into a capacitor alone nothing rests.
    let text = "v1 1 0 10\nl1 1 2 1m\nc1 2 0 1u\n.ic i(l1)=3\n.tran 10u 1m\n.save i(l1)";
    let run = simulate(text, SimOptions::default());
    close(column(&run, "i(l1)")[0], 0.0, 1e-15);
    let told = |note: &circ::integrate::Note| note.text.contains("not held");
    assert!(run.notes.iter().any(told), "{:?}", run.notes);
}

#[test]
fn a_failure_names_the_time_and_keeps_the_rows() {
    // An ideal diode across a voltage source that turns positive: no state of the diode exists.
    let text = format!(
        "v1 1 0 pulse(-1 1 10u 0 0 1 2)\nd1 1 0 di\nc1 1 2 1u\nr1 2 0 1k\n{IDEAL}\n.tran 1u 20u uic"
    );
    let error = attempt(&text, theta()).unwrap_err();
    assert!(error.to_string().contains("d1"), "{error}");
    assert_eq!(error.partial.unwrap().waveforms.time.len(), 10);
}

#[test]
fn controlled_methods_agree_within_their_tolerance() {
    let text = format!(
        "v1 1 0 sin(0 10 1k)\nl1 1 2 1m\nd1 2 3 di\nd2 0 2 di\nc1 3 0 1u\nr1 3 0 1k\n{IDEAL}\n\
         .tran 20u 3m uic\n.save v(3) i(l1)"
    );
    let run = |method, tol| {
        let settings = Settings {
            tol,
            ..Settings::default()
        };
        simulate(
            &text,
            SimOptions {
                method,
                settings,
                ..SimOptions::default()
            },
        )
    };
    let fine = run(Method::Theta, 1e-7);
    for (method, tol) in [
        (Method::Theta, 1e-4),
        (Method::Theta, 1e-5),
        (Method::Euler, 1e-3),
    ] {
        let other = run(method, tol);
        for name in ["v(3)", "i(l1)"] {
            let (a, b) = (column(&fine, name), column(&other, name));
            let amplitude = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            let worst = a
                .iter()
                .zip(&b)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            assert!(
                worst <= 2.0 * tol * amplitude,
                "{method:?} {name}: {:e}",
                worst / amplitude
            );
        }
    }
}

#[test]
fn exact_and_stepping_agree_on_a_bridge() {
    let text = format!(
        "c1 1 0 1u ic=10\nl1 1 0 10m ic=0\ndf1 1 2 di\ndr1 0 2 di\ndr2 3 1 di\ndf2 3 0 di\nr1 2 3 1k\n\
         {IDEAL}\n.tran 50u 5m uic\n.save v(1)"
    );
    let exact = simulate(&text, SimOptions::default());
    assert_eq!(exact.method, "exact");
    let other = simulate(&text, theta());
    let pairs = column(&exact, "v(1)")
        .into_iter()
        .zip(column(&other, "v(1)"));
    let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 10.0 * 1e-4, "{worst:e}");
    close(at(&exact, "v(1)", 5e-3), 0.790322820, 1e-9);
}

const BUCK: &str = "v1 1 0 20\ns1 1 2 3 0 sw\nd1 0 2 di\nl1 2 4 200u\nc1 4 0 10u\nr1 4 0 5\n\
    v3 3 0 pulse(0 1 0 0 0 5u 10u)\n.model sw sw(vt=0.5 vh=0 ron=0 roff=1g)\n\
    .model di d(ron=0 vfwd=0 n=0.01)\n.tran 1u 500u uic\n.save v(4) i(l1)";

#[test]
fn buck_with_a_source_driven_switch() {
    let run = simulate(BUCK, fixed(Method::Theta, 0.1e-6));
    let exact = simulate(
        BUCK,
        SimOptions {
            method: Method::Exact,
            ..SimOptions::default()
        },
    );
    for t in [100e-6, 300e-6, 500e-6] {
        close(at(&run, "v(4)", t), at(&exact, "v(4)", t), 2e-3);
        close(at(&run, "i(l1)", t), at(&exact, "i(l1)", t), 2e-3);
    }
    // At 5, 10, … 500 µs; the switch starts closed.
    assert_eq!(
        run.events
            .iter()
            .filter(|event| event.concerns("s1"))
            .count(),
        100
    );
    assert!(run.energy.residual_relative < 1e-4, "{:?}", run.energy);
}

#[test]
fn counters_of_a_run() {
    let run = simulate(BUCK, theta());
    let mut stats = run.stats;
    assert!(stats.cpu_seconds > 0.0);
    stats.cpu_seconds = 0.0;
    insta::assert_debug_snapshot!((stats, run.plan));
}

/// A source's edge and a switch that moves are steps of the outputs: with events, a row before and one after.
#[test]
fn steps_of_the_outputs_have_two_rows() {
    for method in [Method::Exact, Method::Theta] {
        let options = SimOptions {
            method,
            events: true,
            ..SimOptions::default()
        };
        let run = simulate(
            "v1 in 0 pulse(0 2 0.25m 0 0 1)
             vc c 0 pwl(0 0 1m 1)
             s1 in out c 0 sw1
             r1 out 0 1
             .model sw1 sw(vt=0.5 ron=0 roff=inf)
             .tran 0.2m 1m
             .save v(in) v(out)",
            options,
        );
        let rows_at = |t: f64| -> Vec<[f64; 2]> {
            let waves = &run.waveforms;
            (0..waves.len())
                .filter(|&k| (waves.time[k] - t).abs() < 1e-15)
                .map(|k| [waves.row(k)[0], waves.row(k)[1]])
                .collect()
        };
        assert_eq!(rows_at(0.25e-3), [[0.0, 0.0], [2.0, 0.0]], "{method:?}");
        assert_eq!(rows_at(0.5e-3), [[2.0, 0.0], [2.0, 2.0]], "{method:?}");
    }
}

/// 1 A charges 1 F to the 0 V of a diode at 1 s, which then carries it into a source of as many volts as amperes: 1 C charges 1 F more in no time,
/// against a capacitor that hardly moves. In steps of ⅛ s the current works at v of their ends, of which ½ Σ ⅛² V² is damping.
#[test]
fn a_jump_that_no_edge_makes_is_seen_in_steps() {
    let text = "i1 0 a 1\nc1 a 0 1 ic=-1\nd1 a b dm\nvm b 0 0\nh1 c e vm 1\nc3 e 0 1e15 ic=0\nd2 c d dm\nc2 0 d 1 ic=0\n\
        .model dm d(ideal)\n.tran 125m 2 uic";
    let run = simulate(text, fixed(Method::Euler, 0.125));
    close(at(&run, "v(d)", 2.0), 1.0, 1e-12);
    let jumps = &run.state_jumps.first;
    assert_eq!((jumps.len(), run.stats.jumps), (1, 1), "{jumps:?}");
    assert_eq!(jumps[0].elements, ["c2"]);
    close(jumps[0].loss, 0.5, 1e-12);
    // What the first diode carries in that step is no impulse.
    for impulse in &run.impulses {
        close(impulse.area.abs(), 1.0, 1e-12);
    }
    let energy = run.energy;
    close(energy.jumps, 0.5, 1e-12);
    close(energy.numerical, 0.0625, 1e-12);
    close(energy.source, 1.0 - 28.0 / 64.0, 1e-12);
    close(energy.residual, 0.0, 1e-12);
}

/// The current of 1 H falls by 1 A/s against a drop of 1 V: in steps of ⅛ s the diode takes Σ ⅛ i of their ends, and ½ Σ ⅛² A² is damping.
#[test]
fn a_drop_takes_its_voltage_times_the_current_in_steps() {
    let text = "l1 0 a 1 ic=1\nd1 a 0 dm\n.model dm d(ron=0 vfwd=1)\n.tran 125m 500m uic";
    let energy = simulate(text, fixed(Method::Euler, 0.125)).energy;
    close(energy.dissipated, (4.0 - 10.0 / 8.0) / 8.0, 1e-14);
    close(energy.numerical, 0.5 * 4.0 / 64.0, 1e-14);
    close(energy.residual, 0.0, 1e-14);
}
