//! Switches and jumps.

use super::{at, circuit, simulate, times_after_start, times_of, try_simulate};
use crate::integrate::{self, Method, SimOptions};
use crate::mna;

const MAFFEZZONI_SWITCHING: [f64; 10] = [
    12.564487, 30.693306, 49.264901, 68.179976, 87.359148, 106.739990, 126.274023, 145.923954,
    165.661302, 185.464434,
];

/// Maffezzoni's closed-loop switched circuit; the sawtooth falls without an edge time.
fn maffezzoni(models: &str) -> String {
    format!(
        "V4 4 0 20\nS1 4 1 3 2 SWM ON\nD1 0 1 DM\nL1 1 2 200u IC=0\nR1 2 0 1\nV3 3 0 PULSE(7.5 -2.5 0 20u 0 0 20u)\n\
         {models}\n.tran 0.1u 200u uic\n.save i(L1)"
    )
}

#[test]
fn maffezzoni_without_hysteresis() {
    let run = simulate(&maffezzoni(
        ".model SWM SW(Vt=0 Vh=0 Ron=1m Roff=1k)\n.model DM D(Ron=1m Roff=1k Vfwd=0)",
    ));
    let peaks = [
        1.217756661,
        2.153347057,
        2.867549533,
        3.410012002,
        3.820425992,
        4.130004785,
        4.362988328,
        4.538022829,
        4.669348767,
        4.767783032,
    ];
    let ends = [
        1.173271783,
        2.055345254,
        2.717545430,
        3.214130750,
        3.586205968,
        3.864810108,
        4.073322606,
        4.229319604,
        4.345995076,
        4.433242386,
    ];
    let off = times_of(&run, "off");
    assert_eq!(off.len(), 10, "{:?}", run.events);
    for (k, t) in off.iter().enumerate() {
        assert!((t * 1e6 - MAFFEZZONI_SWITCHING[k]).abs() < 1e-6, "{t}");
        // control: e(t) = R i at the switching time
        let e = 7.5 - 0.5e6 * (t - k as f64 * 20e-6);
        assert!((e - peaks[k]).abs() < 1e-9, "{e}");
        let end = at(&run, (k as f64 + 1.0) * 20e-6, "i(l1)");
        assert!((end - ends[k]).abs() < 1e-9, "{end} {}", ends[k]);
    }
}
#[test]
fn maffezzoni_truly_ideal() {
    let run = simulate(&maffezzoni(
        ".model SWM SW(Vt=0 Vh=0 ideal)\n.model DM D(ideal)",
    ));
    // Between switchings i relaxes to 20 A or to 0 with L/R = 200 µs: an independent scalar iteration.
    let tau = 200e-6;
    let (mut i, mut k) = (0.0_f64, 0);
    let off = times_of(&run, "off");
    assert_eq!(off.len(), 10, "{:?}", run.events);
    while k < 10 {
        let rise = |s: f64| 20.0 + (i - 20.0) * (-s / tau).exp();
        let (mut low, mut high) = (0.0, 20e-6);
        for _ in 0..100 {
            let mid = 0.5 * (low + high);
            if 7.5 - 0.5e6 * mid > rise(mid) {
                low = mid
            } else {
                high = mid
            }
        }
        assert!(
            (off[k] - (k as f64 * 20e-6 + low)).abs() < 1e-15,
            "{}",
            off[k]
        );
        i = rise(low) * (-(20e-6 - low) / tau).exp();
        k += 1;
        assert!((at(&run, k as f64 * 20e-6, "i(l1)") - i).abs() < 1e-12);
    }
}

#[test]
fn charge_is_shared_through_a_closing_switch() {
    let run = simulate(
        "C1 1 0 1u IC=10\nC2 2 0 0.3u IC=0\nS1 1 2 3 0 sw OFF\nV3 3 0 PULSE(0 1 1u 0 0 1 2)\n\
         .model sw SW(Vt=0.5 Vh=0 ideal)\n.tran 1u 2u uic\n.save v(1) v(2)",
    );
    assert_eq!(at(&run, 0.0, "v(2)"), 0.0);
    for t in [1e-6, 2e-6] {
        assert!((at(&run, t, "v(1)") - 10.0 / 1.3).abs() < 1e-14);
        assert!((at(&run, t, "v(2)") - 10.0 / 1.3).abs() < 1e-14);
    }
    // ½ C1 C2/(C1 + C2) V²
    let loss = 0.5 * 1e-6 * 0.3e-6 / 1.3e-6 * 100.0;
    assert!(
        run.energy.dissipated == 0.0 && (run.energy.jumps - loss).abs() < 1e-12 * loss,
        "{:?}",
        run.energy
    );
}

/// By every method (energy from sources, lost in jumps), J.
fn energies(text: &str, expected: (f64, f64)) {
    let circuit = circuit(text);
    let behaviour = mna::behaviour(&circuit).expect("a sound circuit");
    for method in [Method::Exact, Method::Theta, Method::Euler] {
        let options = SimOptions {
            method,
            ..SimOptions::default()
        };
        let run = integrate::simulate(&circuit, &behaviour, options).expect("a run");
        let energy = run.energy;
        let near = |value: f64, exact: f64| (value - exact).abs() < 1e-11 * expected.0.abs();
        assert!(near(energy.source, expected.0), "{method:?} {energy:?}");
        assert!(near(energy.jumps, expected.1), "{method:?} {energy:?}");
        assert!(near(energy.dissipated, 0.0), "{method:?} {energy:?}");
        assert!(energy.residual_relative < 1e-12, "{method:?} {energy:?}");
    }
}

/// An edge charges a capacitive divider to 2.5 V, which closes a switch at the same instant, whereupon it is at 2 V: the source
/// brings 7.5 µC at 5 V in the mean, then 0.5 µC at 10 V.
#[test]
fn an_edge_that_moves_a_switch_works_once() {
    let text = "V1 a 0 PULSE(0 10 1u 0 0 1 2)\nC1 a b 1u\nC2 b 0 3u\nS1 b d b 0 sw\nC3 d 0 1u\n.model sw SW(Vt=1 Vh=0 ideal)\n\
        .tran 1u 2u uic\n.save v(b) v(d)";
    let run = simulate(text);
    assert!((at(&run, 2e-6, "v(b)") - 2.0).abs() < 1e-14);
    assert!((at(&run, 2e-6, "v(d)") - 2.0).abs() < 1e-14);
    energies(text, (42.5e-6, 2.5e-6));
}

/// A capacitor across a source takes its voltage at the start: 5 µC flow back into 5 V.
#[test]
fn a_source_takes_back_what_a_capacitor_has_too_much() {
    energies(
        "V1 1 0 5\nC1 1 0 1u IC=10\n.tran 1u 2u uic",
        (-25e-6, 12.5e-6),
    );
}

#[test]
fn freewheeling_diode_takes_over() {
    let run = simulate(
        "V1 1 0 5\nS1 1 2 3 0 sw ON\nD1 0 2 d\nL1 2 0 1m IC=2\nV3 3 0 PULSE(1 0 1m 0 0 1 2)\n.model d D(ideal)\n\
         .model sw SW(Vt=0.5 Vh=0 ideal)\n.tran 0.5m 3m uic\n.save v(2) i(L1) i(D1)",
    );
    // 2 A + 5 V/1 mH · 1 ms
    for t in [1e-3, 1.5e-3, 3e-3] {
        assert!((at(&run, t, "i(l1)") - 7.0).abs() < 1e-13);
        assert!(at(&run, t, "v(2)").abs() < 1e-14);
        assert!((at(&run, t, "i(d1)") - 7.0).abs() < 1e-13);
    }
    assert!((at(&run, 0.5e-3, "i(l1)") - 4.5).abs() < 1e-13);
}

#[test]
fn flux_is_shared_through_an_opening_switch() {
    let run = simulate(
        "L1 1 0 1m IC=1\nL2 1 0 3m IC=0\nS1 1 0 3 0 sw ON\nV3 3 0 PULSE(1 0 1m 0 0 1 2)\n\
         .model sw SW(Vt=0.5 Vh=0 ideal)\n.tran 1m 2m uic\n.save i(L1) i(L2)",
    );
    assert!((at(&run, 0.0, "i(l1)") - 1.0).abs() < 1e-15);
    for t in [1e-3, 2e-3] {
        assert!(
            (at(&run, t, "i(l1)") - 0.25).abs() < 1e-15,
            "{}",
            at(&run, t, "i(l1)")
        );
        assert!((at(&run, t, "i(l2)") + 0.25).abs() < 1e-15);
    }
}

/// A two-point controller without hysteresis keeps its output on a reference that stands, rises too fast, and stands.
#[test]
fn a_controller_slides_on_its_threshold() {
    slides_on_its_threshold("1 2", 1.0);
}

#[test]
fn a_controller_slides_whose_switch_stands_the_other_way() {
    slides_on_its_threshold("2 1", -1.0);
}

/// With the switch between these terminals, whose current has this sign.
fn slides_on_its_threshold(terminals: &str, sign: f64) {
    let run = simulate(&format!(
        "V1 1 0 10\nS1 {terminals} ref out sw OFF\nR1 2 out 1k\nC1 out 0 1u IC=0\nR2 out 0 10k\n\
         Vref ref 0 PWL(0 5 10m 5 11m 8)\n.model sw SW(ideal Vt=0 Vh=0)\n.tran 0.1m 20m uic\n.save v(out) i(S1) v(1,2)",
    ));
    // Closed: v' = 10⁴ − 1100 v.
    let (rest, rate): (f64, f64) = (1e4 / 1.1e3, 1.1e3);
    let reach = -(1.0 - 5.0 / rest).ln() / rate;
    let off = |v: f64| (1e4 - 3e3) / 1.1e3 - v;
    let leave = 10e-3 + off(5.0) / 3e3;
    let v_leave = 5.0 + off(5.0);
    let again = leave + ((rest - v_leave) / (rest - 8.0)).ln() / rate;
    let times = times_after_start(&run);
    for (t, expected) in times.iter().zip([reach, leave, again]) {
        assert!((t - expected).abs() < 1e-12, "{:?}", run.events);
    }
    assert_eq!(times.len(), 3, "{:?}", run.events);
    assert!((at(&run, 9e-3, "v(out)") - 5.0).abs() < 1e-13);
    assert!((at(&run, 9e-3, "i(s1)") - sign * 0.5e-3).abs() < 1e-15);
    assert!((at(&run, 9e-3, "v(1,2)") - 4.5).abs() < 1e-12);
    assert!((at(&run, 10.2e-3, "v(out)") - 5.6).abs() < 1e-12);
    assert!((at(&run, 20e-3, "v(out)") - 8.0).abs() < 1e-12);
    let told = run.notes.iter().find(|n| n.text.starts_with("s1 slides"));
    let text = &told.expect("a note").text;
    assert!(text.contains("2 times"), "{text}");
    let sum = text
        .rsplit(", ")
        .next()
        .and_then(|end| end.split(' ').next());
    let seconds: f64 = sum.expect("a sum").parse().unwrap();
    let expected = (leave - reach) + (20e-3 - again);
    assert!((seconds - expected).abs() < 1e-12, "{text} {expected}");
}

/// Three inverters in a ring without any delay: only the point at which all are half on is consistent. In the start position
/// each control is one that sources alone set; in others it is not.
#[test]
fn a_ring_of_inverters_rests_on_its_thresholds() {
    let run = simulate(
        "V1 v 0 5\nR1 v a 1k\nS1 a 0 c 0 sw\nR2 v b 1k\nS2 b 0 a 0 sw\nR3 v c 1k\nS3 c 0 b 0 sw\nR4 a x 1k\nC1 x 0 1u IC=0\n\
         .model sw SW(ideal Vt=2 Vh=0)\n.tran 0.1m 1m uic\n.save v(a) v(b) v(c) v(x)",
    );
    for t in [0.0, 0.5e-3, 1e-3] {
        for node in ["v(a)", "v(b)", "v(c)"] {
            assert!((at(&run, t, node) - 2.0).abs() < 1e-14, "{node}");
        }
        let charged = -2.0 * (-t / 1e-3).exp_m1();
        assert!((at(&run, t, "v(x)") - charged).abs() < 1e-14);
    }
}

/// More switches than could be tried with every sign at once.
#[test]
fn six_controllers_slide_together() {
    let stage = |k: u32| {
        format!(
            "S{k} 1 m{k} ref o{k} sw OFF\nR{k} m{k} o{k} 1k\nC{k} o{k} 0 1u IC=0\nRl{k} o{k} 0 10k\n"
        )
    };
    let stages: String = (1..=6).map(stage).collect();
    let run = simulate(&format!(
        "V1 1 0 10\nVref ref 0 5\n{stages}.model sw SW(ideal Vt=0 Vh=0)\n.tran 0.1m 5m uic\n.save v(o1) v(o6)"
    ));
    assert_eq!(
        (at(&run, 5e-3, "v(o1)"), at(&run, 5e-3, "v(o6)")),
        (5.0, 5.0)
    );
    let sliding = run
        .notes
        .iter()
        .filter(|n| n.text.contains("slides on its threshold"));
    assert_eq!(sliding.count(), 6, "{:?}", run.notes);
    assert!(run.events.len() <= 2, "{:?}", run.events);
}

/// 5 V join 1 V through a diode, and a source that copies the second onto a capacitor at 0 V: that its storage contradicts the start is no matter
/// of switches, and one diode competes with nobody.
#[test]
fn a_start_that_contradicts_itself_is_no_rival_of_a_diode() {
    let text = "C1 1 0 1 IC=1\nE1 2 0 1 0 1\nC2 2 0 1 IC=0\nD1 3 1 d\nC3 3 0 1 IC=5\n.model d D(ideal)\n.tran 1 1 uic\n.save v(1) v(2)";
    let run = try_simulate(text).expect("a run");
    assert!((at(&run, 0.0, "v(1)") - 3.0).abs() < 1e-14);
    assert!((at(&run, 0.0, "v(2)") - 3.0).abs() < 1e-14);
    let notes: Vec<&str> = run.notes.iter().map(|note| &note.text[..]).collect();
    assert!(
        notes.iter().all(|text| !text.contains("compete")),
        "{notes:?}"
    );
}
