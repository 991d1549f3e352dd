//! The published circuits against exact solutions and against the rows of Siconos's reference files.
//!
//! `tests/reference/exact.csv` comes from `exact.py`, an event-driven solution in 40 digits that knows nothing of this library.
#![allow(missing_docs, reason = "tests")]

mod runs;

use circ::integrate::{Method, Run, SimOptions};
use runs::{at, column, exact, fixed, interpolate, run};

const US: f64 = 1e-6;
const MS: f64 = 1e-3;

fn close(what: &str, found: f64, expected: f64, within: f64) {
    assert!(
        (found - expected).abs() <= within,
        "{what}: {found} is not {expected} within {within}"
    );
}

/// Rows (signal, time, value or mode) of exact.csv for a circuit.
fn solution(circuit: &str) -> Vec<(String, f64, String)> {
    include_str!("reference/exact.csv")
        .lines()
        .filter_map(|line| {
            let (name, rest) = line.split_once(',')?;
            // v(2,3) holds a comma
            let (head, value) = rest.rsplit_once(',')?;
            let (signal, time) = head.rsplit_once(',')?;
            (name == circuit).then(|| (signal.to_owned(), time.parse().unwrap(), value.to_owned()))
        })
        .collect()
}

/// Event times to 1e-12 of the span and all values to 1e-10, by exact integration.
fn meets_solution(circuit: &str, events: usize) {
    let run = exact(circuit);
    let rows = solution(circuit);
    let expected: Vec<f64> = rows
        .iter()
        .filter(|r| r.0 == "event")
        .map(|r| r.1)
        .collect();
    assert_eq!(expected.len(), events);
    let found: Vec<f64> = run
        .events
        .iter()
        .filter(|event| !event.changes.is_empty())
        .map(|event| event.t)
        .collect();
    assert_eq!(found.len(), events, "{circuit}: {:?}", run.events);
    for (found, expected) in found.into_iter().zip(expected) {
        close(&format!("{circuit} event"), found, expected, 5e-15);
    }
    let mut compared = 0;
    for (signal, t, value) in rows.iter().filter(|r| r.0 != "event") {
        let expected = value.parse().unwrap();
        close(
            &format!("{circuit} {signal} {t}"),
            at(&run, signal, *t),
            expected,
            1e-10,
        );
        compared += 1;
    }
    assert!(compared >= 8, "{compared} values");
    assert!(run.energy.residual_relative < 1e-10, "{:?}", run.energy);
}

#[test]
fn half_wave_meets_its_exact_solution() {
    meets_solution("rlcd", 16);
}

#[test]
fn bridge_with_resistor_meets_its_exact_solution() {
    meets_solution("bridge-resistor", 16);
}

#[test]
fn bridge_with_capacitor_filter_meets_its_exact_solution() {
    meets_solution("bridge-capacitor-filter", 31);
}

#[test]
fn bridge_on_a_source_meets_its_exact_solution() {
    meets_solution("bridge-source", 32);
}

/// v of a parallel RLC from 10 V: C v' = −i − v/R, L i' = v.
fn ringing(t: f64) -> f64 {
    let (alpha, w) = (500.0, (1e8_f64 - 250_000.0).sqrt());
    10.0 * (-alpha * t).exp() * ((w * t).cos() - alpha / w * (w * t).sin())
}

#[test]
fn the_bridge_resistor_sees_the_absolute_value() {
    let run = exact("bridge-resistor");
    let (v, rail) = (column(&run, "v(1)"), column(&run, "v(2,3)"));
    for (k, &t) in run.waveforms.time.iter().enumerate() {
        close("v(1)", v[k], ringing(t), 1e-10);
        close("v(2,3)", rail[k], ringing(t).abs(), 1e-10);
    }
}

// With θ ≠ γ a resistor in series with a diode is advanced by γ where the diode's current is λ (as published) and by θ where its
// voltage is, as here; the rows for θ = ½ stand in the tests of the steppers, on the published system.
#[test]
fn euler_on_the_half_wave_circuit_is_the_published_one() {
    let euler = |h| at(&fixed("rlcd", 1.0, 1.0, h), "v(1)", 5.0 * MS);
    close("v_C, Euler 1 us", euler(US), 2.174755, 5e-7);
    close("v_C, Euler 10 us", euler(10.0 * US), 0.211313, 5e-7);
}

#[test]
fn siconos_rows_of_the_bridge() {
    let run = fixed("bridge-resistor", 0.5, 1.0, US);
    close("v_C", at(&run, "v(1)", US), 9.989510751, 5e-10);
    close("i_L", at(&run, "i(l1)", US), 9.994755376e-4, 5e-14);
    close("v_C", at(&run, "v(1)", MS), -4.97842134, 5e-9);
    close("i_L", at(&run, "i(l1)", MS), -0.0322822484, 5e-11);
    close("v_C", at(&run, "v(1)", 4.999 * MS), 0.7863839107, 5e-11);
    close("i_L", at(&run, "i(l1)", 4.999 * MS), -2.830718054e-3, 5e-13);
}

#[test]
fn siconos_rows_of_the_bridge_with_capacitor_filter() {
    let run = fixed("bridge-capacitor-filter", 1.0, 1.0, US);
    close("v_C", at(&run, "v(1)", US), 7.685804319, 5e-10);
    close("v_C", at(&run, "v(1)", MS), -4.25133218, 5e-9);
    let v = |theta, h| at(&fixed("bridge-capacitor-filter", theta, 1.0, h), "v(1)", MS);
    close("Euler, 0.1 us", v(1.0, 0.1 * US), -4.418276, 5e-7);
    // From the state after the jump; -4.43782072 if the first step has to carry the impulse with half of i(l1).
    close("theta = 1/2, 1 us", v(0.5, US), -4.43738745, 5e-9);
}

/// Largest error of v(1) over 5 ms.
fn bridge_error(run: &Run) -> f64 {
    let v = column(run, "v(1)");
    let errors = run
        .waveforms
        .time
        .iter()
        .zip(v)
        .map(|(&t, v)| (v - ringing(t)).abs());
    errors.fold(0.0, f64::max)
}

#[test]
fn the_bridge_converges_at_first_order() {
    // Published maxima over the steps (rows stand on 1 us, so that only steps of 1 us are the same maximum).
    close(
        "theta = 1/2",
        bridge_error(&fixed("bridge-resistor", 0.5, 1.0, US)),
        0.0191,
        5e-5,
    );
    close(
        "Euler",
        bridge_error(&fixed("bridge-resistor", 1.0, 1.0, US)),
        0.351,
        5e-4,
    );
    let fine = bridge_error(&fixed("bridge-resistor", 1.0, 1.0, 0.1 * US));
    let order = (0.351 / fine).log10();
    assert!((0.9..1.1).contains(&order), "order {order}");
}

/// (t_off, peak, current at the end of the period) of Maffezzoni's circuit with Ron = 1 mΩ, Roff = 1 kΩ.
const MAFFEZZONI: [(f64, f64, f64); 10] = [
    (12.564487, 1.217756661, 1.173271783),
    (30.693306, 2.153347057, 2.055345254),
    (49.264901, 2.867549533, 2.717545430),
    (68.179976, 3.410012002, 3.214130750),
    (87.359148, 3.820425992, 3.586205968),
    (106.739990, 4.130004785, 3.864810108),
    (126.274023, 4.362988328, 4.073322606),
    (145.923954, 4.538022829, 4.229319604),
    (165.661302, 4.669348767, 4.345995076),
    (185.464434, 4.767783032, 4.433242386),
];

#[test]
fn maffezzonis_switch_meets_its_exact_solution() {
    let run = exact("maffezzoni");
    let times: Vec<f64> = run.events.iter().map(|e| e.t).collect();
    for (k, (t_off, peak, end)) in MAFFEZZONI.into_iter().enumerate() {
        let nearest = times
            .iter()
            .map(|t| (t - t_off * US).abs())
            .fold(f64::INFINITY, f64::min);
        assert!(
            nearest < 5e-13,
            "t_off {t_off}: {nearest} away in {times:?}"
        );
        let current = column(&run, "i(l1)");
        let found = interpolate(&run.waveforms.time, &current, t_off * US);
        close("peak", found, peak, 1e-6);
        close(
            "end",
            at(&run, "i(l1)", (k + 1) as f64 * 20.0 * US),
            end,
            5e-9,
        );
    }
}

#[test]
fn maffezzonis_switch_without_resistances_is_close_to_it() {
    // On: L i' = 20 − i from 0 until i = e(t); then the diode: L i' = −i. First period by hand.
    let run = exact("maffezzoni-ideal");
    let tau = 200.0 * US;
    let on = |t: f64| 20.0 * (1.0 - (-t / tau).exp());
    let (mut a, mut b) = (0.0, 20.0 * US);
    for _ in 0..60 {
        let c = 0.5 * (a + b);
        if on(c) < 7.5 - 0.5e6 * c {
            a = c
        } else {
            b = c
        }
    }
    let end = on(a) * (-(20.0 * US - a) / tau).exp();
    close(
        "end of the first period",
        at(&run, "i(l1)", 20.0 * US),
        end,
        1e-12,
    );
    close(
        "last period",
        at(&run, "i(l1)", 200.0 * US),
        MAFFEZZONI[9].2,
        0.1,
    );
    assert!(run.energy.residual_relative < 1e-10);
}

/// A loop without a limit on its gain: the current source of figure 2.2 and its running maximum.
#[test]
fn the_inductor_of_figure_2_2_keeps_the_running_maximum() {
    let run = exact("bt-fig-2-2");
    let source = |t: f64| (20.0 * t).exp() * (100.0 * std::f64::consts::PI * t).sin();
    let current = column(&run, "i(l1)");
    // The crests: tan(ωt) = −ω/20.
    let w = 100.0 * std::f64::consts::PI;
    let crests: Vec<f64> = (0..4)
        .map(|k| ((-(w / 20.0)).atan() + std::f64::consts::PI * f64::from(2 * k + 1)) / w)
        .collect();
    for (k, &t) in run.waveforms.time.iter().enumerate() {
        let passed = crests
            .iter()
            .filter(|&&crest| crest <= t)
            .map(|&crest| source(crest));
        let expected = passed.fold(source(t).max(0.0), f64::max);
        close(&format!("i(l1) at {t}"), current[k], expected, 1e-9);
    }
}

#[test]
fn steps_of_the_source_of_figure_2_2_make_the_current_jump() {
    let run = exact("bt-fig-2-2-steps");
    for (t, expected) in [
        (4.0, 0.0),
        (5.0, 1.0),
        (12.0, 1.0),
        (19.0, 1.0),
        (20.0, 1.5),
        (30.0, 1.5),
    ] {
        close(
            &format!("i(l1) at {t} ms"),
            at(&run, "i(l1)", t * MS),
            expected,
            1e-12,
        );
    }
    // L times the jump, in Vs, as the impulse of the diode's voltage.
    let areas: Vec<f64> = run
        .impulses
        .iter()
        .map(|i| i.area.abs())
        .filter(|&a| a > 1e-9)
        .collect();
    assert!(
        areas.iter().any(|a| (a - 10.0e-3).abs() < 1e-12),
        "{:?}",
        run.impulses
    );
    assert!(
        areas.iter().any(|a| (a - 5.0e-3).abs() < 1e-12),
        "{:?}",
        run.impulses
    );
}

#[test]
fn the_capacitor_of_equation_38_discharges_alone() {
    let run = exact("rr7158-eq-38");
    let v = column(&run, "v(2,3)");
    for (k, &t) in run.waveforms.time.iter().enumerate() {
        close("v(2,3)", v[k], 5.0 * (-t / 0.3e-3).exp(), 1e-12);
    }
}

#[test]
fn jump_a_of_the_bridge_conserves_charge() {
    for run in [
        exact("bridge-capacitor-filter"),
        fixed("bridge-capacitor-filter", 1.0, 1.0, US),
    ] {
        close("v(1)", column(&run, "v(1)")[0], 10.0 / 1.3, 1e-12);
        close("v(2,3)", column(&run, "v(2,3)")[0], 10.0 / 1.3, 1e-12);
        let charge = run
            .impulses
            .iter()
            .find(|i| i.name == "i(df1)")
            .expect("an impulse")
            .area;
        close("charge", charge, 3e-6 / 1.3, 1e-15);
    }
}

#[test]
fn jump_b_of_two_capacitors_conserves_charge() {
    let run = exact("jump-capacitors");
    close("before", at(&run, "v(a)", 0.99 * MS), 10.0, 1e-12);
    for t in [1.0, 1.5, 2.0] {
        close("v(a)", at(&run, "v(a)", t * MS), 10.0 / 1.3, 1e-12);
        close("v(b)", at(&run, "v(b)", t * MS), 10.0 / 1.3, 1e-12);
    }
    // ½·10²·1 uF − ½·(10/1.3)²·1.3 uF is lost in the jump.
    close(
        "lost in the jump",
        run.energy.jumps,
        50e-6 - 50e-6 / 1.3,
        1e-15,
    );
    assert_eq!(run.energy.dissipated, 0.0);
}

#[test]
fn jump_c_of_a_clamped_inductor_keeps_its_current() {
    let run = exact("jump-clamp");
    let tau = MS;
    let peak = 1.0 - (-2.0_f64).exp();
    for t in [0.5, 1.0, 1.99, 2.0, 2.5, 4.0] {
        let expected = if t < 2.0 {
            1.0 - (-t * MS / tau).exp()
        } else {
            peak * (-(t - 2.0)).exp()
        };
        close(
            &format!("i(l1) at {t} ms"),
            at(&run, "i(l1)", t * MS),
            expected,
            1e-12,
        );
        close(
            &format!("v(1) at {t} ms"),
            at(&run, "v(1)", t * MS),
            if t < 2.0 { 10.0 } else { 0.0 },
            1e-12,
        );
    }
}

#[test]
fn jump_d_of_two_inductors_conserves_flux() {
    let run = exact("jump-inductors");
    close("before", at(&run, "i(l1)", 0.99 * US), 1.0, 1e-12);
    let decay = |t: f64| 0.25 * (-(t - 1.0) * US / 4e-3).exp();
    for t in [1.0, 5.0, 10.0] {
        close("i(l1)", at(&run, "i(l1)", t * US), decay(t), 1e-12);
        close("i(l2)", at(&run, "i(l2)", t * US), decay(t), 1e-12);
    }
}

#[test]
fn every_netlist_runs_and_balances_its_energy() {
    let names = runs::all();
    assert!(names.len() >= 24, "{names:?}");
    for name in names {
        let run = run(&name, SimOptions::default());
        assert!(run.waveforms.values.iter().all(|v| v.is_finite()), "{name}");
        // What steps lose by themselves is a part of the balance.
        let limit = match name.as_str() {
            // The waves on a line are straight between steps: of second order, and steps are an eighth of the delay.
            "line-rectifier" => 2e-5,
            _ => 1e-9,
        };
        assert!(
            run.energy.residual_relative < limit,
            "{name}: {:?}",
            run.energy
        );
    }
}

#[test]
fn adaptive_steps_agree_with_the_exact_integrator() {
    for name in ["rectifier", "rlcd", "voltage-doubler", "clipper"] {
        let exact = run(name, SimOptions::default());
        assert_eq!(exact.method, "exact");
        let theta = run(
            name,
            SimOptions {
                method: Method::Theta,
                ..SimOptions::default()
            },
        );
        // Voltages only: a capacitor's charging current jumps at an event that a stepper places within a step.
        let names = exact.waveforms.names.iter().filter(|n| n.starts_with("v("));
        for probe in names {
            let (a, b) = (column(&exact, probe), column(&theta, probe));
            let amplitude = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            for (k, (a, b)) in a.iter().zip(&b).enumerate() {
                let t = exact.waveforms.time[k];
                close(&format!("{name} {probe} at {t}"), *b, *a, 5e-3 * amplitude);
            }
        }
    }
}
