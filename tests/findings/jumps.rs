//! Changes of mode: switches that move together, and jumps.

use circ::integrate::{Method, Note, Run};

use super::runs::{at, column};
use super::{changed, run};

/// The largest difference of a probe between two runs on the same grid, in parts of its amplitude.
fn difference(a: &Run, b: &Run, probe: &str) -> f64 {
    let (a, b) = (column(a, probe), column(b, probe));
    assert_eq!(a.len(), b.len());
    let amplitude = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let pairs = a.iter().zip(&b);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / amplitude
}

/// The exact run of a netlist with ideal switches approaches those with resistances of 1 mΩ and 1 MΩ, then 1 µΩ and 1 GΩ, by three decades.
fn is_the_limit(name: &str, probe: &str, time: f64) {
    let ideal = run(name, Method::Exact);
    let error = |resistances: &str| {
        let real = changed(
            name,
            &[("SW(ideal", &format!("SW({resistances}"))],
            Method::Exact,
        );
        (at(&real, probe, time) - at(&ideal, probe, time)).abs()
    };
    let (coarse, fine) = (error("Ron=1m Roff=1meg"), error("Ron=1u Roff=1g"));
    let scale = at(&ideal, probe, time).abs();
    assert!(coarse < 1e-2 * scale, "{name}: {coarse} of {scale}");
    assert!(
        fine < 2e-3 * coarse && fine > 2e-4 * coarse,
        "{name}: {coarse} {fine}"
    );
}

#[test]
fn two_switches_on_one_crossing_keep_the_current_of_the_inductor() {
    for name in ["halfbridge_submodule_ideal", "complementary_sin"] {
        let exact = run(name, Method::Exact);
        assert_eq!(exact.stats.jumps, 0, "{name}");
        is_the_limit(name, "i(l1)", 4e-3);
    }
    let exact = run("halfbridge_submodule_ideal", Method::Exact);
    assert!((at(&exact, "i(l1)", 4e-3) - 2.0497).abs() < 1e-4);
}

#[test]
fn a_pair_of_switches_on_a_state_keeps_its_output_within_the_band() {
    for resistances in ["ideal", "Ron=1u Roff=1g", "Ron=1m Roff=1meg"] {
        let name = "hysteretic_sync_buck";
        let run = changed(name, &[("ideal", resistances)], Method::Exact);
        let (time, v) = (&run.waveforms.time, column(&run, "v(out)"));
        let late: Vec<f64> = (0..v.len())
            .filter(|&k| time[k] > 2e-3)
            .map(|k| v[k])
            .collect();
        let mean = late.iter().sum::<f64>() / late.len() as f64;
        let range = late
            .iter()
            .fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
        assert!((mean - 5.0).abs() < 0.02, "{resistances}: {mean}");
        assert!(range.0 > 4.8 && range.1 < 5.2, "{resistances}: {range:?}");
    }
    is_the_limit("hysteretic_sync_buck", "v(out)", 0.3e-3);
}

#[test]
fn a_switch_that_another_one_drives_moves_with_it_by_all_methods() {
    let name = "switch_drives_switch";
    let exact = run(name, Method::Exact);
    // The pair of complementary_sin in other words.
    let pair = run("complementary_sin", Method::Exact);
    for t in [1e-3, 2.5e-3, 4e-3] {
        let (a, b) = (at(&exact, "i(l1)", t), at(&pair, "i(l1)", t));
        assert!((a - b).abs() < 1e-12 * b.abs().max(1.0), "{t}: {a} {b}");
    }
    let stepped = run(name, Method::Theta);
    assert!((at(&stepped, "i(l1)", 4e-3) - at(&exact, "i(l1)", 4e-3)).abs() < 1e-3);
}

#[test]
fn a_switch_whose_control_rests_on_its_threshold_is_off() {
    let name = "switch_at_threshold";
    let exact = run(name, Method::Exact);
    let stepped = run(name, Method::Theta);
    // The gate is above 0 for 5.02 µs of 10 µs: nearly what a threshold of 1 nV makes of it.
    let above = changed(name, &[("SW(Ron=1m", "SW(Vt=1n Ron=1m")], Method::Exact);
    for t in [1e-3, 2e-3, 3e-3] {
        let v = at(&exact, "v(out)", t);
        assert!((v - at(&above, "v(out)", t)).abs() < 1e-6, "{t}: {v}");
        assert!((v - at(&stepped, "v(out)", t)).abs() < 1e-2, "{t}: {v}");
    }
    assert!((at(&exact, "v(out)", 3e-3) - 5.8657).abs() < 1e-3);
}

#[test]
fn what_is_recorded_changes_nothing_where_a_kink_and_an_edge_coincide() {
    let name = "coincident_kink_and_edge";
    let without = changed(name, &[], Method::Exact);
    let with = changed(name, &[("v(3)", "v(3) v(g)")], Method::Exact);
    let stepped = changed(name, &[], Method::Theta);
    for probe in ["v(1)", "v(2)", "v(3)"] {
        assert!(difference(&without, &with, probe) < 1e-12, "{probe}");
        assert!(difference(&without, &stepped, probe) < 1e-3, "{probe}");
    }
}

#[test]
fn a_hysteretic_switch_that_slides_is_a_choice_and_says_so() {
    let sliding = run("hysteretic_switch_slides", Method::Exact);
    let told = |n: &Note| {
        n.text.contains("s0 slides between its thresholds") && n.text.contains("a choice")
    };
    assert!(sliding.notes.iter().any(told), "{:?}", sliding.notes);
}

/// The current stays at the limit, 0.76 V / 0.16 Ω, until the clock ends; where the switch's current was negative the run was refused.
#[test]
fn a_switch_slides_whichever_way_it_stands() {
    for terminals in ["s1 4 1", "s1 1 4"] {
        let replaced = [("s1 4 1", terminals)];
        let found = changed("peak_current_slides", &replaced, Method::Exact);
        let slides = |n: &Note| n.text.contains("s1 slides between its thresholds");
        assert!(found.notes.iter().any(slides), "{:?}", found.notes);
        let limit = super::runs::at(&found, "i(l1)", 10.0 * 1.081_081_081_081_081_2e-6);
        assert!((limit - 4.75).abs() < 1e-12, "{limit} A");
    }
}

#[test]
fn a_pair_of_switches_moves_together_on_a_steep_edge() {
    // The saw tooth returns at 10⁸ V/s: the rounding of the time is more than that of the control.
    let name = "sync_boost_sawtooth";
    let ideal = changed(name, &[], Method::Exact);
    assert_eq!(ideal.stats.jumps, 0);
    let real = changed(name, &[("SW(ideal", "SW(Ron=1u Roff=1g")], Method::Exact);
    for probe in ["v(o)", "i(l1)"] {
        let distance = difference(&ideal, &real, probe);
        assert!(distance < 1e-4, "{probe}: {distance}");
    }
}

#[test]
fn diodes_that_compete_for_an_impulse_are_named_and_a_ladder_of_them_is_not() {
    let resistive = |name: &str, first: &str, second: &str| {
        let models = format!(".model d1 D(ron={first})\n.model d2 D(ron={second})");
        let (from, to) = match name {
            "rival_diodes" => ("D2 b d di", "D2 b d d2"),
            _ => ("D2 c d di", "D2 c d d2"),
        };
        let replacements = [
            ("D1 b c di", "D1 b c d1"),
            (from, to),
            (".model di D(ideal)", models.as_str()),
            ("SW(ideal", "SW(ron=1u"),
            ("10u uic", "200u uic"),
        ];
        at(&changed(name, &replacements, Method::Exact), "v(d)", 200e-6)
    };
    let told = |run: &Run| {
        run.notes
            .iter()
            .any(|n| n.text.contains("d1, d2 compete for an impulse"))
    };
    for method in [Method::Exact, Method::Theta] {
        assert!(told(&run("rival_diodes", method)));
        let ladder = run("diode_ladder", method);
        assert!(!told(&ladder));
        assert!((at(&ladder, "v(d)", 10e-6) - 2.5).abs() < 1e-9);
    }
    // The note is true: ratios of resistances decide there, and do not on the ladder.
    for (first, second) in [("1m", "1m"), ("1", "1m"), ("1m", "1")] {
        assert!((resistive("diode_ladder", first, second) - 2.5).abs() < 1e-6);
    }
    assert!(resistive("rival_diodes", "1m", "1") < 4.4);
    assert!(resistive("rival_diodes", "1", "1m") > 5.9);
}

/// A diode and a switch charge one capacitor from two others: the note is true, ratios of resistances decide. Where the switch takes what
/// the diode gives they do not.
#[test]
fn a_switch_competes_with_a_diode() {
    let name = "rival_switch";
    let told = |run: &Run| {
        run.notes
            .iter()
            .any(|n| n.text.contains("d1, s1 compete for an impulse"))
    };
    let apart = ("C2 5 0 29u IC=0", "C2 5 0 29u IC=-40");
    assert!(told(&changed(name, &[], Method::Exact)));
    assert!(!told(&changed(name, &[apart], Method::Exact)));
    let resistive = |diode: &str, switch: &str, start: (&str, &str)| {
        let diode = format!("D(Ron={diode} Roff=1g)");
        let switch = format!("SW(Ron={switch} Roff=1g");
        let replacements = [
            ("D(ideal)", diode.as_str()),
            ("SW(ideal", switch.as_str()),
            (".tran 1u 10u", ".tran 1m 10m"),
            start,
        ];
        at(&changed(name, &replacements, Method::Exact), "v(3)", 10e-3)
    };
    // All three together: −14 V · 25/68 = −5.147 V, unless the diode is faster.
    let (slow, fast) = (
        resistive("1", "1m", ("IC=-14", "IC=-14")),
        resistive("1m", "1", ("IC=-14", "IC=-14")),
    );
    assert!((slow + 5.147).abs() < 0.1 && fast < -8.0, "{slow} {fast}");
    let ideal = at(&changed(name, &[apart], Method::Exact), "v(3)", 10e-6);
    for (diode, switch) in [("1", "1m"), ("1m", "1")] {
        let v = resistive(diode, switch, apart);
        assert!((v - ideal).abs() < 1e-2, "{v} is not {ideal}");
    }
}

#[test]
fn a_jump_ends_where_it_moves_a_switch() {
    // Both switches of a pair are open within ±13 mV: the current falls until the control of the other threshold is reached, not to 0.
    let name = "current_control_dead_band";
    let real = changed(name, &[("SW(ideal", "SW(Ron=1u Roff=1g")], Method::Exact);
    for method in [Method::Exact, Method::Theta] {
        let ideal = changed(name, &[], method);
        let distance = difference(&real, &ideal, "i(l1)");
        assert!(distance < 1e-4, "{method:?}: {distance}");
        // What Roff dissipates is lost in the jumps.
        let lost = ideal.energy.dissipated + ideal.energy.jumps - real.energy.dissipated;
        assert!(
            lost.abs() < 1e-4 * real.energy.dissipated,
            "{method:?}: {lost}"
        );
        assert!(ideal.energy.residual_relative < 1e-10, "{method:?}");
    }
}

#[test]
fn a_comparator_that_runs_beside_its_saw_tooth_is_on_one_side() {
    // Where the transistor is off the control rises at 129.4 V/ms and the saw tooth at 130 V/ms: the rounding of an event that the steep
    // change before has found stands for longer than the time can tell.
    let name = "pfc_beside_saw_tooth";
    let end = |run: &Run| at(run, "v(out)", 9.3e-3);
    let run = changed(name, &[], Method::Exact);
    let coarse = changed(name, &[("15.45u", "31u")], Method::Exact);
    assert!((end(&run) - end(&coarse)).abs() < 1e-9 * end(&run));
    assert!(run.energy.residual_relative < 1e-9, "{:?}", run.energy);
}

/// 2 µF at 5 V more take 10 µA·s from the source, 3 mH at 2 A more 6 mV·s.
#[test]
fn sources_that_jump_across_storage_give_impulses_by_every_method() {
    for method in [Method::Exact, Method::Theta, Method::Euler] {
        for recorded in ["v(a) v(b) i(v1)", "i(r1)"] {
            let run = changed(
                "sources_across_storage",
                &[("v(a) v(b) i(v1)", recorded)],
                method,
            );
            let mut areas = Vec::new();
            for (name, area) in [("i(v1)", -10e-6), ("v(i1)", -6e-3)] {
                let of_name = run.impulses.iter().filter(|i| i.name == name);
                areas.extend(of_name.map(|i| (i.t, i.area / area)));
            }
            let right = [(1e-3, 1.0), (2e-3, -1.0), (1.5e-3, 1.0), (2.5e-3, -1.0)];
            assert_eq!(areas.len(), right.len(), "{method:?}: {:?}", run.impulses);
            for (found, right) in areas.iter().zip(right) {
                let off = (found.0 - right.0)
                    .abs()
                    .max((found.1 - right.1).abs() * 1e-3);
                assert!(off < 1e-12, "{method:?}: {:?}", run.impulses);
            }
        }
    }
}

#[test]
fn a_switch_that_starts_on_its_threshold_goes_by_the_slope_of_its_control() {
    // The triangle rises at 20 V/ms, the sine at 2.5 V/ms, from 0 V both.
    for method in [Method::Theta, Method::Euler, Method::Exact] {
        let run = run("tie_at_start", method);
        for (probe, expected) in [("v(2)", 5.0 / 1.001), ("v(3)", 5.0 / 1001.0)] {
            let v = super::runs::at(&run, probe, 20e-6);
            assert!((v - expected).abs() < 1e-3, "{method:?}: {probe} is {v}");
        }
    }
}

/// Two equal diodes beside one another, with Ron and Roff 21 decades apart: rounding passed for a path of impulses, and "the projection"
/// created 7 kA from 5 V by every method. The value is that of the same leg with one diode instead of two, by events and by an
/// independent simulator.
#[test]
fn a_jump_that_would_create_energy_is_none() {
    for (method, tolerance) in [(Method::Exact, 1e-9), (Method::Theta, 1e-4)] {
        let run = changed("clamped_leg_extreme", &[], method);
        let current = column(&run, "i(l1)")[16];
        assert!(
            (current - 2.230_485_007_56).abs() < tolerance,
            "{method:?} {current}"
        );
        assert_eq!(run.state_jumps.all.0, 0, "{method:?}");
    }
}

/// Sources move on with the edge of the last row, and so do the switches that they control: v(4) follows v(2).
#[test]
fn an_edge_on_the_last_row_moves_source_and_switch() {
    for method in [Method::Exact, Method::Theta] {
        let run = changed("edge_on_the_last_row", &[], method);
        let last = |probe: &str| column(&run, probe).last().copied().expect("rows");
        assert!((last("v(2)") - 15.0).abs() < 1e-12, "{method:?}");
        assert!(
            (last("v(4)") - 12.0).abs() < 1e-12,
            "{method:?} {}",
            last("v(4)")
        );
    }
}

/// An edge of a source behind a diode that clamps: what a switch and a gate see of it is what the diode lets through, by every method, and not
/// what the source would be without it.
#[test]
fn a_control_on_a_clamped_node_does_not_see_the_edge_before_the_clamp() {
    let name = "clamp_before_a_switch";
    for method in [Method::Exact, Method::Theta, Method::Euler] {
        let run = changed(name, &[], method);
        // (12/5 + 0.4/0.1) / (1/5 + 1/0.1) V; 12 V over 1 kΩ and 1 MΩ.
        for (probe, expected) in [("v(b)", 6.4 / 10.2), ("v(x)", 12.0 / 1.001), ("v(y)", 10.0)] {
            let found = at(&run, probe, 3e-6);
            assert!(
                (found - expected).abs() < 1e-6,
                "{method:?} {probe}: {found}"
            );
        }
    }
    // Without the clamp both see 12 V.
    let run = changed(name, &[("d5 b 0 db", "r5 b 0 1meg")], Method::Exact);
    assert!(at(&run, "v(x)", 3e-6) < 2e-3 && at(&run, "v(y)", 3e-6) < 1e-9);
}
