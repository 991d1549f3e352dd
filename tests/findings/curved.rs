//! Curved laws: diodes and transistors that take part in jumps.

use circ::Model;
use circ::integrate::{Method, Run, SimOptions};
use circ::measure::{Over, Trace};
use circ::settings::Settings;

use super::runs::column;
use super::{changed, changed_at, run};

fn average(run: &Run, probe: &str, from: f64, to: f64) -> f64 {
    let values: Vec<f64> = super::runs::column(run, probe);
    let trace = Trace::lines(&run.waveforms.time, values);
    trace.over(Over::Average, from, to).unwrap()
}

/// A converter by steps of both kinds: the mean of its output is `expected` to `tolerance`, in V.
fn delivers(name: &str, from: f64, to: f64, expected: f64, tolerance: f64) {
    let found = run(name, Method::Auto);
    assert_eq!(found.method, "theta");
    let mean = average(&found, "v(out)", from, to);
    assert!(
        (mean - expected).abs() < tolerance,
        "{name}: {mean} V in place of {expected} V"
    );
    assert!(found.energy.residual_relative < 1e-3, "{:?}", found.energy);
}

// The transistors as SW with the same RON (KP and VTO at the gate's high level) and a diode of N = 0.05 by ngspice 39 with
// reltol = 1e-6 and steps of 10 ns at most.

#[test]
fn the_freewheel_diode_of_a_buck_takes_the_current() {
    delivers("nmos_exp_buck", 400e-6, 500e-6, 12.7413, 1e-3);
}

#[test]
fn the_output_diode_of_a_boost_takes_the_current() {
    delivers("nmos_exp_boost", 2.9e-3, 3e-3, 23.8661, 2e-3);
}

#[test]
fn a_buck_with_a_floating_driver_delivers() {
    delivers("mosfet_buck", 2e-3, 3e-3, 11.71048, 1e-3);
}

#[test]
fn a_buck_with_a_transistor_of_p_type_delivers() {
    delivers("pmos_buck", 2e-3, 3e-3, 4.54272, 1e-3);
}

#[test]
fn a_switch_and_a_schottky_diode_are_a_buck() {
    delivers("sw_schottky_buck", 400e-6, 500e-6, 12.90714, 1e-3);
}

#[test]
fn the_secondary_of_a_flyback_takes_the_flux() {
    // Runge and Kutta's steps of 5 ns for the current of either winding and the output.
    delivers("nmos_exp_flyback", 2.9e-3, 3e-3, 3.5975, 5e-4);
}

#[test]
fn an_ideal_diode_leaves_the_current_to_an_exponential_one() {
    // L i' = −N k T/q ln(1 + i/IS) by Runge and Kutta's method.
    for method in [Method::Theta, Method::Euler] {
        let found = run("lost_current", method);
        let i = super::runs::at(&found, "i(l1)", 50e-6);
        assert!((i - 0.958_337_993).abs() < 1e-5, "{method:?}: {i}");
        assert_eq!((found.stats.jumps, found.impulses.len()), (0, 0));
    }
}

#[test]
fn a_source_that_starts_at_zero_starts() {
    // ngspice 39, reltol = 1e-6 and steps of 5 ns.
    let found = run("one_diode_rlc_refused", Method::Auto);
    let at = |probe, t| super::runs::at(&found, probe, t);
    assert!((at("i(l1)", 15e-6) - 7.383_914).abs() < 1e-4);
    assert!((at("v(out)", 50e-6) - 8.025_838).abs() < 1e-4);
}

#[test]
fn a_junction_that_clamps_an_edge_is_not_left_behind() {
    // ngspice 39, reltol = 1e-6 and steps of 2 ns; given steps of 100 ns find the logarithm of the clamp to some tens of millivolts.
    for (step, tolerance) in [(None, 1e-4), (Some(100e-9), 0.1)] {
        let options = SimOptions {
            method: Method::Theta,
            step,
            ..SimOptions::default()
        };
        let found = super::changed_by("clamp_after_edge", &[], options);
        for (t, expected) in [(7e-6, -0.602_39), (30e-6, 9.456_90)] {
            let v = super::runs::at(&found, "v(2)", t);
            assert!((v - expected).abs() < tolerance, "{step:?}: {v} V at {t} s");
        }
    }
    // ngspice 39 as above; it begins at 0.2 ns, and what the source's 26 mV up to there are on the divider of capacitors is added.
    let found = run("clamp_at_start", Method::Theta);
    let v = super::runs::at(&found, "v(2)", 0.343e-6);
    assert!((v - 34.4812).abs() < 2e-3, "{v} V");
}

/// The current of a secondary or of a pump's diode stops within the first step after a switch closes or a ramp begins: all that it brought
/// its capacitor is in that step, where no stage sees it.
#[test]
fn a_current_that_stops_before_a_stage_brings_its_charge() {
    // The oracle of tests/converters with steps of its own; theta's of 0.7 ns say the same to 1e-7.
    for (name, probe, row, expected) in [
        ("charge_after_a_switch", "v(3)", 8, 0.028_072_906),
        ("charge_after_a_corner", "v(5)", 22, 70.4525),
    ] {
        let settings = Settings {
            tol: 1e-7,
            ..Settings::default()
        };
        let options = SimOptions {
            settings,
            ..SimOptions::default()
        };
        let found = super::changed_by(name, &[], options);
        let t = f64::from(row) * found.waveforms.time[1];
        let v = super::runs::at(&found, probe, t);
        let off = (v - expected).abs() / expected;
        assert!(off < 1e-6, "{name}: {v} V, {off:e} off");
    }
}

/// At 25 µs a sine, its negative and a triangle pass zero together: the comparator's switches move, and those that the sources alone drive
/// move with them, once. The values are those of the converters' oracle, to 2e-9.
#[test]
fn switches_that_pass_their_thresholds_with_others_move_once() {
    let found = run("crossings_together", Method::Auto);
    let volts = super::runs::column(&found, "v(8,7)");
    let near = |t: &f64| (t - 19.0 * 1.379_310_344_827_586_2e-6).abs() < 1e-12;
    let row = found.waveforms.time.iter().rposition(near).expect("a row");
    assert!(
        (volts[row] - 324.987_617_766_116_3).abs() < 1e-2,
        "{}",
        volts[row]
    );
}

/// 0.8 sin(2π·1 kHz·t) passes (0.2 ms − t)/50 µs, the falling side of a triangle, here to 19 digits: a comparator in a circuit that is stepped was
/// found up to 2⁻²⁴ of a step late, and a snubber's 87 ns made 2.7e-6 of its voltage of that.
#[test]
fn a_comparator_moves_when_its_sources_cross() {
    let found = run("comparator_and_snubber", Method::Auto);
    let off = found
        .events
        .iter()
        .map(|event| (event.t - 1.655_057_847_743_119_5e-4).abs());
    let off = off.fold(f64::INFINITY, f64::min);
    assert!(off < 5e-14, "{off} s");
}

/// A netlist of `netlists/` or of its converters with another print step.
fn printed(path: &str, card: &str, other: &str) -> Run {
    let text = std::fs::read_to_string(path).unwrap();
    assert!(text.contains(card), "{path}");
    let model = Model::parse(&text.replace(card, other), path).unwrap();
    model.transient(SimOptions::default()).unwrap()
}

#[test]
fn rows_do_not_depend_on_the_print_step() {
    // Columns at the rows of the coarser run, relative to what each reaches; the tolerance is 1e-4.
    for (path, card, finer, ratio) in [
        (
            "netlists/exponential-bridge.cir",
            ".tran 50u 60m",
            ".tran 1u 60m",
            50,
        ),
        (
            "netlists/exponential-clamp.cir",
            ".tran 2u 3m",
            ".tran 0.5u 3m",
            4,
        ),
        (
            "netlists/common-emitter.cir",
            ".tran 10u 4m",
            ".tran 1u 4m",
            10,
        ),
    ] {
        let (coarse, fine) = (printed(path, card, card), printed(path, card, finer));
        let width = coarse.waveforms.names.len();
        let rows = |run: &Run| run.waveforms.values.len() / width;
        assert_eq!((rows(&coarse) - 1) * ratio, rows(&fine) - 1, "{path}");
        for (column, name) in coarse.waveforms.names.iter().enumerate() {
            let value = |run: &Run, row: usize| run.waveforms.values[row * width + column];
            let size = (0..rows(&fine))
                .map(|k| value(&fine, k).abs())
                .fold(0.0, f64::max);
            for k in 0..rows(&coarse) {
                let off = (value(&coarse, k) - value(&fine, k * ratio)).abs();
                assert!(off <= 1e-4 * size, "{path} {name} row {k}: {off} of {size}");
            }
        }
        // Rows between choose no steps.
        let (few, many) = (coarse.stats.steps, fine.stats.steps);
        assert!(many < 2 * few, "{path}: {few} and {many} steps");
        // Nor are stages made for them but where a device turns on or off: of a step to each there are five.
        let [few, many] = [&coarse, &fine].map(|run| run.stats.lcp_solves);
        let more = (rows(&fine) - rows(&coarse)) as u64;
        assert!(many - few < more, "{path}: {few} and {many} solves");
    }
}

/// An inductor between an exponential diode and the ideal body diode of a transistor: no current below the leak of the first one is on the law as long as the
/// second one blocks, so that steps with ports on their sides end there. And rows within a step behind whose start a current stops: its slope there is no part of the
/// curve, and the cubic through it was up to 1.5 A off.
#[test]
fn a_current_that_a_junction_stops_is_followed() {
    for name in [
        "buck_with_a_body_diode",
        "flyback_with_a_body_diode",
        "buck_without_load",
        "flyback_commutates",
    ] {
        let circuit = super::circuit(name);
        let behaviour = circ::mna::behaviour(&circuit).expect("a behaviour");
        let with = |tol: f64| {
            let settings = Settings {
                tol,
                ..Settings::default()
            };
            let options = SimOptions {
                settings,
                unestimated: true,
                ..SimOptions::default()
            };
            circ::integrate::simulate(&circuit, &behaviour, options)
                .unwrap_or_else(|e| panic!("{name}: {e}"))
        };
        let (usual, exact) = (with(1e-4), with(1e-7));
        assert_eq!(usual.method, "theta", "{name}");
        for column in 0..usual.waveforms.names.len() {
            let rows = |run: &Run| run.waveforms.column(column).collect::<Vec<f64>>();
            let (usual, exact) = (rows(&usual), rows(&exact));
            let size = exact.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            for (k, (a, b)) in usual.iter().zip(&exact).enumerate() {
                let off = (a - b).abs();
                assert!(off < 5e-5 * size, "{name} row {k}: {a} for {b}");
            }
        }
    }
}

/// A triac with both halves fired at once, beside an exponential diode: the half whose current is the larger holds, and the other does not run
/// through the next half cycle (313 V where 249 V are the peak).
#[test]
fn a_triac_does_not_hold_itself_by_what_goes_round_in_it() {
    let name = "triac_keeps_one_half";
    for delay in ["5350u", "7600u"] {
        let ideal = changed(
            name,
            &[("5350u", delay), ("D(Is=3.2u N=1.5)", "D(ideal)")],
            Method::Exact,
        );
        let run = changed(name, &[("5350u", delay)], Method::Auto);
        let largest = |run: &Run| {
            let values = column(run, "v(out)");
            values.iter().fold(0.0_f64, |m, v| m.max(v.abs()))
        };
        let (expected, found) = (largest(&ideal), largest(&run));
        assert!(
            (found - expected).abs() < 0.02 * expected,
            "{delay}: {found} for {expected}"
        );
    }
}

/// Where v(a) is positive both diodes carry its current, through r2 and past it, else neither and v(out) is v(a). The amplifier's limits are laws
/// of ideal pairs in a loop of gain, where Newton finds no stages and the solvers of the other steps do.
#[test]
fn an_op_amp_with_limits_rectifies() {
    let (r, is, n_vt) = (1e4, 1e-9, 1.8 * 0.025_864_9);
    let junction = |v: f64| is * (v / n_vt).exp_m1();
    let zero_of = |f: &dyn Fn(f64) -> f64, (mut low, mut high): (f64, f64)| {
        for _ in 0..80 {
            let middle = f64::midpoint(low, high);
            *(if f(middle) > 0.0 { &mut low } else { &mut high }) = middle;
        }
        low
    };
    // From v(o): v(out), where what r2 brings flows through d1.
    let out = |o: f64| zero_of(&|out| -out / r - junction(out - o), (o - 1.0, 0.0));
    let run = changed("rectifier_with_op_amp", &[], Method::Auto);
    let (time, values) = (&run.waveforms.time, column(&run, "v(out)"));
    for (t, v) in time.iter().zip(&values) {
        let a = (2.0 * std::f64::consts::PI * 1e5 * t).sin();
        let expected = if a > 0.0 {
            let o = zero_of(&|o| -out(o) / r + junction(-o) - a / r, (-2.0, 0.0));
            out(o)
        } else {
            a
        };
        assert!((v - expected).abs() < 2e-4, "{t:e}: {v} for {expected}");
    }
}

/// By steps of this tolerance.
fn at_tolerance(name: &str, changes: &[(&str, &str)], tol: f64) -> Run {
    changed_at(name, changes, Method::Auto, tol)
}

#[test]
fn a_current_between_two_junctions_that_block_rests() {
    // Its slope swung from step to step, and steps of 1e-15 s had no end.
    let run = at_tolerance("current_between_junctions", &[], 1e-7);
    assert!(run.stats.steps < 10_000, "{:?}", run.stats);
    let finer = at_tolerance("current_between_junctions", &[], 1e-9);
    for probe in ["i(l1)", "i(l2)", "i(l4)", "v(o)", "v(p)"] {
        let values = column(&run, probe).into_iter().zip(column(&finer, probe));
        let largest = values.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(largest < 1e-6, "{probe}: {largest}");
    }
}

#[test]
fn a_bridge_that_hangs_on_junctions_has_a_place() {
    // Leakage alone decided it, half the amplitude off from run to run, in 71,587 steps.
    let run = at_tolerance("floating_bridge", &[], 1e-6);
    assert!(run.stats.steps < 3000, "{:?}", run.stats);
    assert!(
        run.error.max.is_some_and(|error| error < 1e-4),
        "{:?}",
        run.error
    );
    let [a1, b, p, n] = ["v(a1)", "v(b)", "v(p)", "v(n)"].map(|probe| column(&run, probe));
    for k in 0..p.len() {
        // Both sides mirror each other, whether two conduct or none does.
        let apart = p[k] + n[k] - a1[k] - b[k];
        assert!(apart.abs() < 1e-3, "{k}: {apart} V");
    }
    let tied = at_tolerance(
        "floating_bridge",
        &[("rg b 0 10Meg", "rg b 0 10Meg\nrn n b 1g\nrp p b 1g")],
        1e-6,
    );
    let difference = column(&run, "i(l1)")
        .into_iter()
        .zip(column(&tied, "i(l1)"));
    let largest = difference.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(largest < 1e-5, "{largest} A");
}

#[test]
fn what_a_junction_leaks_is_not_lost_beside_a_small_resistance() {
    // D was 10³ S [1, 1; 1, 1], whose product with 7 V has a rounding of 7e-13 A: 150,000 steps in 5 s, and no end.
    let run = at_tolerance("doubler_behind_a_choke", &[], 1e-8);
    assert!(run.stats.steps < 20_000, "{:?}", run.stats);
    assert!(
        run.error.max.is_some_and(|error| error < 1e-6),
        "{:?}",
        run.error
    );
}

#[test]
fn the_energies_of_a_slope_that_swings_add_up() {
    // λ of another instant stood beside the state: 47 mJ were dissipated of the 1.6 mJ that there are.
    let run = at_tolerance("half_wave_behind_a_choke", &[], 1e-4);
    assert!(
        run.energy.residual_relative.abs() < 1e-6,
        "{:?}",
        run.energy
    );
}

#[test]
fn junctions_without_a_current_have_no_voltage_at_the_start() {
    // They were read after a step, as the logarithm of what came to flow, which each step tells otherwise: an error of 0.5 was stated.
    let run = at_tolerance("centre_tap_at_start", &[], 1e-6);
    assert!(
        run.error.max.is_some_and(|error| error < 1e-5),
        "{:?}",
        run.error
    );
    for probe in ["v(p)", "v(a1)", "v(b1)"] {
        let volts = column(&run, probe)[0];
        assert!((volts - 13.01).abs() < 1e-12, "{probe}: {volts}");
    }
}

/// One step to the row leaves 4.5 nA of the current that ended, which are 18 mV on the blocking resistance: 7e-4 of the amplitude.
#[test]
fn what_a_leak_decides_right_behind_an_event_is_read() {
    let circuit = super::circuit("leak_behind_an_event");
    let behaviour = circ::mna::behaviour(&circuit).expect("a behaviour");
    let volts = [1e-4, 1e-8].map(|tol| {
        let settings = Settings {
            tol,
            ..Settings::default()
        };
        let options = SimOptions {
            settings,
            unestimated: true,
            ..SimOptions::default()
        };
        let run = circ::integrate::simulate(&circuit, &behaviour, options).expect("a run");
        super::runs::column(&run, "v(2)")
    });
    assert_eq!(volts[0].len(), volts[1].len());
    let pairs = volts[0].iter().zip(&volts[1]);
    let apart = pairs.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    assert!(apart < 1e-4 * 24.0, "{apart} V");
}

/// A row at the same time as a switching but for rounding is one after it: the rows before and after stand in this order.
#[test]
fn rows_of_a_switching_that_falls_on_a_row_are_in_order() {
    let found = run("passages_on_rows", Method::Auto);
    assert_eq!(found.method, "theta");
    let (time, x) = (&found.waveforms.time, column(&found, "v(x)"));
    assert!(time.is_sorted());
    // It rises by a line without length at 0.1 us and every 10 us after that, and falls at 4.3 us and every 10 us after that.
    let steep = (1..time.len()).filter(|&k| (x[k] - x[k - 1]).abs() > 50.0);
    let steep: Vec<usize> = steep.collect();
    assert_eq!(steep.len(), 20);
    for (count, &k) in steep.iter().enumerate() {
        assert!(time[k] - time[k - 1] < 1e-17, "{} {}", time[k - 1], time[k]);
        let (period, falls) = ((count / 2) as f64, count % 2 == 1);
        let expected = 10e-6 * period + if falls { 4.3e-6 } else { 0.1e-6 };
        assert!((time[k] - expected).abs() < 1e-15, "{} {expected}", time[k]);
        assert_eq!(x[k] < x[k - 1], falls);
    }
}
