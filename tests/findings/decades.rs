//! Resistances that are twenty decades and more apart: what sets devices apart must not be lost beside what joins them. Values are those
//! of `tests/reference/digits.py`, in 120 digits, but for the network without storage, whose values are Ohm's law.

use circ::integrate::Method;

use super::changed;
use super::leaks::meets;
use crate::runs::column;

/// While s1 is open v1 drives d1 and d3 in parallel through 50.6 Ω, or d2 through 11.6 Ω in the other direction.
#[test]
fn diodes_in_parallel_share_what_a_resistor_brings() {
    for method in [Method::Auto, Method::Euler, Method::Theta] {
        let run = changed("parallel_1_nohm", &[], method);
        let [d1, d2] = ["i(d1)", "i(d2)"].map(|name| column(&run, name));
        let mut open = 0;
        for (k, t) in run.waveforms.time.iter().enumerate() {
            let v1 = 24.0 * (2e5 * std::f64::consts::PI * t).sin();
            let part = (t * 1e5).fract();
            // The triangle is above 0.25 V while s1 is open.
            if (0.13..0.87).contains(&part) && v1 > 1.0 {
                open += 1;
                let expected = 0.5 * (v1 - 0.7) / 50.6;
                assert!((d1[k] / expected - 1.0).abs() < 1e-7, "{t} {}", d1[k]);
            }
            if v1 < -1.0 {
                // What s1 or d1 and d3 bring beside is no more than their leaks.
                let expected = (-v1 - 0.7) / 11.6;
                let leaks = if (0.13..0.87).contains(&part) {
                    2e-9
                } else {
                    0.7 / 12.0
                };
                assert!((d2[k] - expected).abs() <= leaks + 1e-7, "{t} {}", d2[k]);
            }
        }
        assert!(open > 5);
    }
}

#[test]
fn a_six_pulse_rectifier_of_1_nohm_and_1_tohm_starts() {
    let values = [
        ("i(l1)", 2.608_695_652_173_913e-5, 2.586_790_638_439_451e-1),
        ("i(l3)", 2e-4, 1.8007124838446915),
        ("v(9,2)", 2e-4, 2.599_631_967_810_681),
    ];
    meets("six_pulse_1_nohm", &values);
    // Steps find a state at t = 0, too.
    let shorter = (".tran 8.695652173913044e-6 2e-4", ".tran 1e-6 5e-6");
    let run = changed("six_pulse_1_nohm", &[shorter], Method::Euler);
    assert_eq!(run.method, "euler");
}

#[test]
fn a_clamped_leg_that_is_split_in_two_starts() {
    let values = [
        ("i(l1)", 5.8378378378378376e-5, 7.576_485_431_000_252e-2),
        ("i(l1)", 6e-5, 7.859_288_458_739_776e-2),
    ];
    meets("clamped_leg_split", &values);
}

/// On the manifold on which the voltage behind 1.9 nΩ follows, the capacitor's current decides who conducts.
#[test]
fn a_body_diode_blocks_when_the_capacitor_behind_it_is_charged() {
    let values = [
        ("v(10,3)", 4.054_054_054_054_054e-6, 6.837_074_107_073_87e1),
        ("v(4)", 4.054_054_054_054_054e-6, 7.090_755_608_957_319),
        ("v(10,3)", 5e-5, 3.0527338169279968e1),
    ];
    meets("capacitor_behind_2_nohm", &values);
}

#[test]
fn currents_that_are_rounding_move_each_other_by_no_more() {
    let values = [
        ("i(l1)", 8.108_108_108_108_107e-6, 2.3573872510741126e-1),
        ("i(l3)", 1e-4, 1.259446641339713),
        ("v(9,2)", 1e-4, 3.780136735718876),
    ];
    meets("six_pulse_leaks", &values);
}

/// What the thyristor carries when it stops, 1e-14 A, is a difference of transients that are rounding: its guard led the mode back to itself a thousand times, and steps
/// that took over found no solution.
#[test]
fn a_mode_that_its_guard_ends_at_one_instant_again_and_again_is_left() {
    let values = [
        ("i(l1)", 5.837_837_837_837_838e-5, -8.467_627_604_611_859e-2),
        ("v(1,2)", 6e-5, 2.2094951238115935e-2),
    ];
    meets("six_pulse_thyristors_leak", &values);
}

#[test]
fn a_diode_that_blocks_at_0_v_leaks_nothing() {
    let values = [
        ("v(0,1)", 3e-6, 6.896_985_108_470_49e-1),
        ("v(8)", 3e-6, -1.2716296301950994e-2),
        ("i(l1)", 3e-6, -3.8709136678307383e-3),
    ];
    meets("leaks_nothing_at_rest", &values);
}

/// Each leg by itself has its values; in one piece the modes of both were tried against each other, and exact integration ended at 1.5 ns in steps that took
/// more than a minute.
#[test]
fn a_leg_beside_another_one_is_what_it_is_by_itself() {
    let values = [
        ("i(l1)", 5e-3, -0.177_445_924_750_251_37),
        ("v(12)", 5e-3, 11.228_445_240_977_92),
    ];
    meets("clamped_leg_beside_another", &values);
}
