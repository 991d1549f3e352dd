//! Derivatives of measurements against closed forms.
#![allow(missing_docs, reason = "tests")]

use circ::analysis::{
    Sensitivity, SensitivityMethod, SensitivityOptions, WorstOptions, sensitivity, transient, worst,
};
use circ::{Model, SimOptions};

fn found(text: &str, steady: bool) -> Sensitivity {
    let model = Model::parse(text, "t.cir").expect("a circuit");
    let options = SensitivityOptions {
        steady,
        ..SensitivityOptions::default()
    };
    sensitivity(&model, &options).expect("derivatives")
}

fn by(text: &str, steady: bool, method: SensitivityMethod) -> Sensitivity {
    let model = Model::parse(text, "t.cir").expect("a circuit");
    let options = SensitivityOptions {
        steady,
        method,
        ..SensitivityOptions::default()
    };
    sensitivity(&model, &options).expect("derivatives")
}

/// Forward and backward along the run the derivatives are the same to 1e-12 of the largest p ∂J/∂p of each measurement. (A slope is a difference of values over a piece of the curve: it
/// has what rounding leaves of them.)
fn both_ways(text: &str, steady: bool) -> Sensitivity {
    let forward = by(text, steady, SensitivityMethod::Forward);
    let backward = by(text, steady, SensitivityMethod::Adjoint);
    assert!(forward.exact && backward.exact);
    assert_eq!(forward.passes.forward, forward.at.len());
    assert_eq!(forward.passes.backward, 0);
    assert_eq!(backward.passes.forward, 0, "{:?}", backward.passes);
    assert!(backward.passes.backward > 0 && backward.of.len() == forward.of.len());
    for (a, b) in forward.of.iter().zip(&backward.of) {
        assert!(a.value.is_ok(), "{a:?}");
        let scaled = |k: usize| forward.at[k].1 * a.to[k].1.expect("a derivative");
        let largest = (0..a.to.len()).fold(0.0, |m: f64, k| m.max(scaled(k).abs()));
        for (k, (name, own)) in b.to.iter().enumerate() {
            let own = forward.at[k].1 * own.expect("a derivative");
            let close = if a.name == "slope" { 1e-9 } else { 1e-12 };
            assert!(
                (own - scaled(k)).abs() <= close * largest,
                "{} to {name}: {own:e} {:e} of {largest:e}",
                a.name,
                scaled(k)
            );
        }
    }
    backward
}

fn near(found: &Sensitivity, of: &str, to: &str, value: f64, truth: f64, tolerance: f64) {
    let own = found.derivative(of, to).expect("a derivative") * value;
    let error = (own - truth).abs() / truth.abs().max(1e-12);
    assert!(error < tolerance, "{of} to {to}: {own:e} is not {truth:e}");
}

/// v = V (1 − e^{−t/τ}): when it crosses V/2, its mean over 1 ms, its value at 1 ms.
#[test]
fn a_capacitor_that_is_charged() {
    let text = "rc\nv1 1 0 {vin}\nr1 1 2 1k\nc1 2 0 {c}\n.param vin=4 c=1u\n.tran 1u 2m uic\n.meas tran half when v(2)=2\n\
        .meas tran mean avg v(2) from=0 to=1m\n.meas tran last find v(2) at=1m\n.meas tran power rms i(r1)\n\
        .meas tran lag trig v(2) val=1 rise=1 targ v(2) val=3 rise=1\n.end\n";
    let found = found(text, false);
    assert!(found.exact && found.notes.is_empty());
    let e = (-1.0_f64).exp();
    let close = 1e-9;
    for (name, value) in [("r1", 1e3), ("c1", 1e-6), ("c", 1e-6)] {
        near(&found, "half", name, value, 1e-3 * 2.0_f64.ln(), close);
        near(&found, "last", name, value, -4.0 * e, close);
        near(&found, "lag", name, value, 1e-3 * 3.0_f64.ln(), close);
        // ⟨v⟩ = V (1 − τ/T (1 − e^{−T/τ}))
        near(&found, "mean", name, value, -4.0 * (1.0 - 2.0 * e), close);
    }
    near(&found, "last", "vin", 4.0, 4.0 * (1.0 - e), close);
    near(&found, "half", "vin", 4.0, -1e-3, close);
}

/// The mean output of a synchronous buck is D V: its duty is a parameter that moves edges, upright or as the middles of ramps.
#[test]
fn the_output_of_a_buck() {
    for gate in ["0 0 {d*10u}", "10n 10n {d*10u-10n}"] {
        let text = format!(
            "buck\nv1 1 0 {{vin}}\ns1 1 2 g 0 sw\ns2 2 0 0 g sn\nvg g 0 pulse(0 1 0 {gate} 10u)\nl1 2 3 100u\nc1 3 0 10u\nr1 3 0 5\n\
            .model sw sw(vt=0.5 vh=0 ron=0 ideal=1)\n.model sn sw(vt=-0.5 vh=0 ron=0 ideal=1)\n.param vin=10 d=0.4\n.save v(3)\n\
            .tran 0.1u 20u\n.meas tran out avg v(3)\n.meas tran ripple pp i(l1)\n.end\n"
        );
        let found = found(&text, true);
        assert!(found.exact);
        near(&found, "out", "vin", 10.0, 4.0, 1e-6);
        near(&found, "out", "d", 0.4, 4.0, 1e-6);
        for (name, value) in [("l1", 1e-4), ("c1", 1e-5), ("r1", 5.0)] {
            let own = found.derivative("out", name).expect("a derivative") * value;
            assert!(own.abs() < 1e-6, "{name}: {own:e}");
        }
    }
}

/// A period that changes moves the edges of the hundredth pulse by many times their rise: as sources of a filter and as gates of its switches.
/// The gates of a synchronous buck are sources of their own, whose edges cross the threshold together. What moves both of them alike, or none, has a derivative: the mean output is
/// D v1 r1/(r1 + rl).
#[test]
fn the_steady_state_behind_gates_that_move_together() {
    let text = "buck\n.param on=3.99u\nv1 1 0 10\ns1 1 2 g 0 sw\ns2 2 0 h 0 sw\nl1 2 a 100u\nrl a 3 0.05\nc1 3 0 10u\nr1 3 0 5\n\
        vg g 0 pulse(0 1 0 10n 10n {on} 10u)\nvh h 0 pulse(1 0 0 10n 10n {on} 10u)\n.model sw sw(vt=0.5 vh=0 ron=0 ideal=1)\n\
        .tran 1u 50u\n.meas tran mean avg v(3) from=0 to=10u\n.end\n";
    let of = found(text, true);
    assert!(of.exact);
    let mean = 4.0 * 5.0 / 5.05;
    near(&of, "mean", "v1", 10.0, mean, 1e-9);
    near(&of, "mean", "rl", 0.05, -mean * 0.05 / 5.05, 1e-9);
    near(&of, "mean", "on", 3.99e-6, mean * 3.99 / 4.0, 1e-9);
    assert!(of.derivative("mean", "l1").expect("a derivative").abs() * 100e-6 < 1e-9);
    // What moves one of them alone parts the switches.
    let one = text.replace(
        "vh h 0 pulse(1 0 0 10n 10n {on}",
        "vh h 0 pulse(1 0 0 10n 10n 3.99u",
    );
    let model = Model::parse(&one, "t.cir").expect("a circuit");
    let options = SensitivityOptions {
        steady: true,
        to: vec!["on".into()],
        ..SensitivityOptions::default()
    };
    let refused = sensitivity(&model, &options).expect_err("no derivative");
    assert!(
        refused.to_string().contains("two events coincide"),
        "{refused}"
    );
}

#[test]
fn edges_that_move_far() {
    for head in [
        "v1 1 0 pulse(0 1 0 10n 10n {t/2} {t})\n",
        "v2 2 0 1\ns1 2 1 g 0 sw\ns2 1 0 0 g sn\nvg g 0 pulse(0 1 0 10n 10n {t/2} {t})\n",
    ] {
        let text = format!(
            "filter\n{head}r1 1 out 1k\nc1 out 0 100n\n.model sw sw(vt=0.5 vh=0 ron=0 ideal=1)\n\
            .model sn sw(vt=-0.5 vh=0 ron=0 ideal=1)\n.param t=10u\n.tran 0.1u 1003u\n.save v(out)\n.meas tran last find v(out) at=1003u\n.end\n"
        );
        let found = found(&text, false);
        assert!(found.exact);
        let last = |t: f64| {
            let mut model = Model::parse(&text, "t.cir").expect("a circuit");
            model.set("t", t).expect("a period");
            let run = transient(&model, SimOptions::default());
            let (_, found) = run.run.expect("a run");
            found.measured[0].result.as_ref().expect("a value").value
        };
        let slope = (last(1e-5 * (1.0 + 1e-7)) - last(1e-5 * (1.0 - 1e-7))) / 2e-7;
        assert!(slope.abs() > 0.1, "{slope}");
        near(&found, "last", "t", 1e-5, slope, 1e-6);
    }
}

/// Into L and R alone the current swings between I = (V/R) (1 − a)/(1 − a b) and b I with a = e^{−D T/τ}, b = e^{−(1 − D) T/τ}.
#[test]
fn the_ripple_of_a_buck() {
    let text = "buck\nv1 1 0 {vin}\ns1 1 2 g 0 sw\ns2 2 0 0 g sn\nvg g 0 pulse(0 1 0 0 0 {d*10u} 10u)\nl1 2 3 100u\nr1 3 0 5\n\
        .model sw sw(vt=0.5 vh=0 ron=0 ideal=1)\n.model sn sw(vt=-0.5 vh=0 ron=0 ideal=1)\n.param vin=10 d=0.4\n.save v(3)\n\
        .tran 0.1u 20u\n.meas tran ripple pp i(l1)\n.meas tran crest max i(l1)\n.meas tran power rms i(l1)\n.end\n";
    let found = found(text, true);
    let swing = |[vin, d, l, r]: [f64; 4]| {
        let (a, b) = ((-d * 1e-5 * r / l).exp(), (-(1.0 - d) * 1e-5 * r / l).exp());
        let crest = vin / r * (1.0 - a) / (1.0 - a * b);
        [crest * (1.0 - b), crest]
    };
    let point = [10.0, 0.4, 1e-4, 5.0];
    for (k, name) in ["vin", "d", "l1", "r1"].into_iter().enumerate() {
        let at = |h: f64| {
            let mut moved = point;
            moved[k] *= 1.0 + h;
            swing(moved)
        };
        let (low, high) = (at(-1e-5), at(1e-5));
        for (j, of) in ["ripple", "crest"].into_iter().enumerate() {
            near(&found, of, name, point[k], (high[j] - low[j]) / 2e-5, 1e-6);
        }
    }
}

#[test]
fn runs_in_steps_are_differentiated_by_differences() {
    let text = "clamp\nv1 1 0 {a}\nr1 1 2 1k\nd1 2 0 d\n.model d d(is=1e-14)\n.param a=5\n.tran 1u 100u\n.meas tran v avg v(2)\n.end\n";
    let found = found(text, false);
    assert!(!found.exact && found.notes.len() == 1);
    // r_d/(R + r_d) with r_d = V_T/I.
    let slope = found.derivative("v", "a").expect("a derivative");
    assert!((5e-3..7e-3).contains(&slope), "{slope:e}");
}

/// A constant source of which other things are made: a factor of a product, and the duty of what it is compared with.
#[test]
fn a_source_that_stands_in_something_else_too() {
    let text = "product\nvk k 0 2\nvs s 0 sin(1 1 1k)\nb1 o 0 v=v(k)*v(s)\nro o 0 1k\n.tran 1u 2m\n\
        .meas tran mean avg v(o) from=0 to=2m\n.meas tran both avg v(o)*v(k) from=0 to=2m\n.end\n";
    let own = both_ways(text, false);
    near(&own, "mean", "vk", 2.0, 2.0, 1e-12);
    near(&own, "both", "vk", 2.0, 8.0, 1e-12);
    let text = "duty\nvin in 0 10\nvk k 0 0.4\nvt t 0 pulse(0 1 0 10u 0 0 10u)\ns1 in o k t sw\nro o 0 1k\n.model sw sw(vt=0 ron=1m roff=1g)\n\
        .tran 1u 1m\n.meas tran mean avg v(o) from=0 to=100u\n.end\n";
    let own = both_ways(text, true);
    let near = |of, to, value, truth| near(&own, of, to, value, truth, 1e-5);
    near("mean", "vk", 0.4, 4.0);
    near("mean", "vin", 10.0, 4.0);
}

/// A divider: v = V R₂/(R₁ + R₂) is monotone in each of its values, so that its range is that of the corners.
#[test]
fn the_range_of_a_divider() {
    let text = "divider\nv1 1 0 {vin}\nr1 1 2 1k tol=5\nr2 2 0 {r} m=2\n.param vin=12 r=4k\n.tran 1u 10u\n.meas tran out avg v(2)\n.end\n";
    let model = Model::parse(text, "t.cir").expect("a circuit");
    assert_eq!(model.circuit().tolerances, [("r1".to_string(), 0.05)]);
    let options = WorstOptions {
        tolerances: vec![("vin".into(), 0.01), ("r".into(), 0.02)],
        ..WorstOptions::default()
    };
    let range = worst(&model, "OUT", &options).expect("a range");
    let out = |vin: f64, r1: f64, r2: f64| vin * r2 / (r1 + r2);
    for (bound, side) in [(&range.least, -1.0), (&range.greatest, 1.0)] {
        let truth = out(
            12.0 * (1.0 + 0.01 * side),
            1e3 * (1.0 - 0.05 * side),
            2e3 * (1.0 + 0.02 * side),
        );
        assert!(
            (bound.value - truth).abs() < 1e-9,
            "{} {truth}",
            bound.value
        );
        assert!((bound.estimate - truth).abs() < 0.05 * (truth - range.nominal).abs());
    }
    assert!(range.notes.is_empty() && (range.nominal - 8.0).abs() < 1e-9);
    // Twice r2 in parallel: its card's value is twice what it is in the circuit.
    let found = found(text, false);
    near(&found, "out", "r2", 4e3, 12.0 * 1e3 * 2e3 / 9e6, 2e-6);
    near(&found, "out", "r", 4e3, 12.0 * 1e3 * 2e3 / 9e6, 2e-6);
}

/// The steady state depends on its period otherwise than on a value: by default such a parameter is left out, and asked for it is refused.
#[test]
fn what_changes_the_period_of_a_steady_state_is_left_out() {
    let text = "filter\nv1 1 0 pulse(0 {a} 0 0 0 {t/2} {t})\nr1 1 2 1k\nc1 2 0 1u\n.param t=1m a=2\n.tran 1u 1m\n.meas tran out avg v(2)\n.end\n";
    let found = found(text, true);
    assert!(found.exact && found.at.iter().all(|(name, _)| name != "t"));
    assert!(
        found
            .notes
            .iter()
            .any(|note| note.text.contains("`t` is left out"))
    );
    near(&found, "out", "a", 2.0, 1.0, 1e-9);
    let model = Model::parse(text, "t.cir").expect("a circuit");
    let options = SensitivityOptions {
        to: vec!["t".into()],
        steady: true,
        ..SensitivityOptions::default()
    };
    let error = sensitivity(&model, &options).expect_err("a period that moves");
    assert!(error.to_string().contains("changes the period"), "{error}");
}

/// All kinds of measurements on v(out) and i(l1), the first crossing of a level among them.
fn measurements(from: &str, at: &str, level: &str) -> String {
    let window = format!("from={from}");
    format!(
        ".meas tran mean avg v(out) {window}\n.meas tran charge integ i(l1) {window}\n.meas tran power rms i(l1) {window}\n\
        .meas tran given avg v(out)*i(l1)\n.meas tran last find v(out) at={at}\n.meas tran slope deriv v(out) at={at}\n\
        .meas tran least min v(out) {window}\n.meas tran most max i(l1) {window}\n.meas tran ripple pp i(l1) {window}\n\
        .meas tran when when v(out)={level} cross=1\n.meas tran then find i(l1) when v(out)={level} cross=1\n\
        .meas tran ratio param='mean/last+when*1e4'\n.meas tran lag trig v(out) val={level} cross=1 targ at={at}\n\
        .meas tran part avg v(out) trig v(out) val={level} cross=1 targ at={at}\n"
    )
}

/// A boost converter whose diode turns off with its current and by its clock, of ideal devices and of finite ones with a snubber.
#[test]
fn back_along_a_boost_converter() {
    let ideal = ".model sw sw(vt=0.5 vh=0 ron=0 ideal=1)\n.model d d(ideal)\n";
    let finite = "cs 3 s 1n\nrs s 0 50\n.model sw sw(vt=0.5 vh=0 ron=20m roff=1meg)\n.model d d(ron=30m roff=1meg vfwd=0.5)\n";
    for (devices, levels) in [(ideal, ["7.2", "7.6"]), (finite, ["7.1", "7.2"])] {
        let head = format!(
            "boost\nv1 1 0 5\nl1 1 2 100u\nrl 2 3 0.1\ns1 3 0 g 0 sw\nvg g 0 pulse(0 1 0 0 0 4u 20u)\nd1 3 out d\n\
            c1 out 4 2u ic=6\nrc 4 0 20m\nr1 out 0 200\n{devices}"
        );
        let transient = measurements("150u", "233u", levels[0]);
        let found = both_ways(
            &format!("{head}.tran 1u 300u uic\n{transient}.end\n"),
            false,
        );
        assert!(found.at.len() >= 6);
        let steady = measurements("0", "13u", levels[1]);
        both_ways(&format!("{head}.tran 1u 20u\n{steady}.end\n"), true);
    }
}

/// A converter whose switch follows its output, from its operating point on.
#[test]
fn back_along_a_converter_with_a_comparator() {
    let text = format!(
        "hysteretic\nv1 1 0 {{vin}}\ns1 1 2 ref out sw\nd1 0 2 d\nl1 2 3 100u\nrl 3 out 0.2\nc1 out 4 20u\nrc 4 0 50m\nr1 out 0 5\nvr ref 0 5\n\
        .model sw sw(vt=0 vh=20m ron=10m roff=1meg)\n.model d d(ron=10m roff=1meg vfwd=0.4)\n.param vin=12\n.tran 1u 400u uic\n{}.end\n",
        measurements("300u", "333u", "4.9")
    );
    let found = both_ways(&text, false);
    assert!(found.derivative("when", "vin").is_some_and(|d| d < 0.0));
}

/// Charge that is shared when an ideal switch joins two capacitors: the state jumps, by an amount that their values decide.
#[test]
fn back_along_jumps() {
    let text = format!(
        "share\nv1 1 0 {{vin}}\nr1 1 out 1k\nc1 out 0 1u ic=1\nc2 2 0 {{2*c}} ic=0\nr2 2 0 5k\ns1 out 2 g 0 sw\nl1 2 3 10m\nr3 3 0 1k\n\
        vg g 0 pulse(0 1 200u 0 0 300u 1m)\n.model sw sw(vt=0.5 vh=0 ron=0 ideal=1)\n.param vin=4 c=250n\n.tran 1u 1.6m uic\n{}.end\n",
        measurements("100u", "1.35m", "1.2")
    );
    let found = both_ways(&text, false);
    // At 200 us v(out) = (v₁ C₁ + v₂ C₂)/(C₁ + C₂).
    assert!(found.derivative("last", "c").is_some());
}

/// Two windings in series have L = L₁ + L₂ + 2 M with M = k √(L₁ L₂), and i = V/R (1 − e^{−R t/L}).
#[test]
fn coupled_inductors() {
    for k in [0.6, 1.0] {
        let text = format!(
            "coupled\nv1 1 0 5\nr1 1 2 10\nl1 2 3 1m\nl2 3 0 4m\nk1 l1 l2 {k}\n.tran 1u 1m uic\n.meas tran i find i(r1) at=0.5m\n.end\n"
        );
        let found = found(&text, false);
        let l: f64 = 5e-3 + 4e-3 * k;
        let of_l = -0.5 * (-5e-3 / l).exp() * 5e-3 / l;
        near(&found, "i", "l1", 1e-3, of_l * (1e-3 + 2e-3 * k) / l, 1e-9);
        near(&found, "i", "l2", 4e-3, of_l * (4e-3 + 2e-3 * k) / l, 1e-9);
        both_ways(&text, false);
    }
}

/// A half-wave rectifier whose diodes leave time constants of L/Roff beside those of its filter: differences in 120 digits (tests/reference/digits.py with
/// one value 1e-25 larger and smaller) have these p ∂/∂p at 2.37 ms.
#[test]
fn a_rectifier_with_decaying_leaks() {
    let text = "half wave\nv1 1 0 sin(0 24 1k 0 0 30)\nl1 1 2 36u ic=0\nd1 2 3 m0\nd2 0 3 m0\nl2 3 4 2.3m ic=8.6\nc1 4 0 16m ic=0\nr1 4 0 1.8\n\
        .model m0 d(ron=1.8m vfwd=0 roff=1.8meg)\n.save i(l1) v(4)\n.tran 150u 3m uic\n\
        .meas tran i find i(l1) at=2.37m\n.meas tran v find v(4) at=2.37m\n.meas tran mean avg v(4)\n.end\n";
    let truths = [
        ("i", "l2", 2.3e-3, -7.625704349735634),
        ("i", "c1", 16e-3, 0.8232116487295259),
        ("v", "l2", 2.3e-3, -0.5789060547559229),
        ("v", "c1", 16e-3, -1.7194831981914543),
    ];
    for method in [SensitivityMethod::Forward, SensitivityMethod::Adjoint] {
        let found = by(text, false, method);
        for (of, to, value, truth) in truths {
            near(&found, of, to, value, truth, 5e-13);
        }
    }
}

/// Parameters of a duty cycle move edges, one of ramps moves waveforms: that one goes forward.
#[test]
fn edges_go_backward_and_ramps_forward() {
    let text = |gate: &str| {
        format!(
            "buck\nv1 1 0 {{vin}}\ns1 1 2 g 0 sw\ns2 2 0 0 g sn\nvg g 0 pulse(0 1 0 {gate} 10u)\nl1 2 out 100u\nc1 out 0 10u\nr1 out 0 5\n\
            .model sw sw(vt=0.5 vh=0 ron=10m roff=1meg)\n.model sn sw(vt=-0.5 vh=0 ron=10m roff=1meg)\n.param vin=10 d=0.4\n\
            .tran 0.1u 20u\n{}.end\n",
            measurements("0", "13u", "4")
        )
    };
    both_ways(&text("0 0 {d*10u}"), true);
    let found = by(
        &text("10n 10n {d*10u-10n}"),
        true,
        SensitivityMethod::Adjoint,
    );
    assert_eq!(found.passes.forward, 1);
}

/// By default values that are more than the measurements cost one pass for each of these, however many values there are.
#[test]
fn passes_are_as_many_as_measurements_or_values() {
    let ladder = |cells: usize| {
        let cell = |k: usize| {
            format!(
                "l{k} n{k} m{k} {}u\nr{k} m{k} n{} 0.3\nc{k} n{} 0 {}u\n",
                10 + k,
                k + 1,
                k + 1,
                1 + k
            )
        };
        let cells: String = (0..cells).map(cell).collect();
        format!(
            "ladder\nv1 n0 0 pulse(0 1 0 0 0 20u 50u)\n{cells}.tran 1u 200u uic\n.meas tran a avg v(n1)\n.meas tran b find v(n1) at=130u\n.end\n"
        )
    };
    for cells in [1, 2, 5] {
        let found = by(&ladder(cells), false, SensitivityMethod::Automatic);
        assert_eq!(found.at.len(), 3 * cells);
        assert_eq!((found.passes.forward, found.passes.backward), (0, 2));
    }
    let model = Model::parse(&ladder(5), "t.cir").expect("a circuit");
    let options = SensitivityOptions {
        to: vec!["l1".into(), "c1".into()],
        ..SensitivityOptions::default()
    };
    let found = sensitivity(&model, &options).expect("derivatives");
    assert_eq!((found.passes.forward, found.passes.backward), (2, 0));
    both_ways(&ladder(3), false);
}

/// Thirteen capacitors: `circ sim` has rows for so many states, 1 ms apart here, and straight lines between them.
#[test]
fn what_rows_would_have_found_otherwise_is_told() {
    let ladder = |count: usize| {
        let stage = |k: usize| format!("r{k} n{} n{k} 1k\nc{k} n{k} 0 1u\n", k - 1);
        let stages: String = (1..=count).map(stage).collect();
        format!(
            "ladder\nv1 n0 0 1\n{stages}.tran 1m 50m uic\n.meas tran v integ v(n{count})\n.end\n"
        )
    };
    let said = |text: &str| {
        let notes = found(text, false).notes;
        let mut codes = notes.iter().map(|note| note.code);
        codes.any(|code| code == "measured-between-events")
    };
    assert!(said(&ladder(13)) && !said(&ladder(12)));
}

/// The same by differences of runs, where differences to both sides are not the same; of one that both peaks have in common, or where one peak is lower, they are.
#[test]
fn differences_of_runs_tell_an_extremum_that_is_reached_twice() {
    let phases = |last: &str| {
        format!(
            "two phases\nva a 0 sin(0 10 50 0 0 0)\nvb b 0 sin(0 10 50 0 0 180)\nra a a1 {{r}}\nrb b b1 {last}\nd1 a1 p d\nd2 b1 p d\nrl p 0 10\n\
            .param r=1 vt=1\nvt t 0 {{vt}}\nrt t 0 1\n.model d d(is=1e-12)\n.tran 10u 20m\n.meas tran top max v(p)\n.meas tran at max_at v(p)\n.meas tran rip pp v(p)\n\
            .meas tran mean avg v(p)\n.end\n"
        )
    };
    let said = |text: &str| {
        let found = found(text, false);
        assert!(!found.exact);
        let notes = found.notes.into_iter();
        let notes = notes.filter(|note| note.code == "one-sided");
        notes.map(|note| note.text).collect::<Vec<_>>()
    };
    let notes = said(&phases("1"));
    assert_eq!(notes.len(), 3, "{notes:?}");
    for (note, name) in notes.iter().zip(["`top`", "`at`", "`rip`"]) {
        let begin = format!("{name} moves otherwise with ra, rb, ");
        assert!(note.starts_with(&begin), "{note}");
    }
    assert!(notes[0].contains("rb, r upward"), "{notes:?}");
    let together = said(&phases("{r}"));
    assert!(together[0].contains("ra, rb upward"), "{together:?}");
    assert_eq!(said(&phases("2")), Vec::<String>::new());
}

/// v = V R₂/(R₁ + R₂), and nothing that an orbit could return to.
#[test]
fn the_steady_state_of_resistances_alone_has_derivatives() {
    let text = "divider\nv1 a 0 pulse(0 1 0 25u 25u 25u 100u)\nr1 a b 1k\nr2 b 0 3k\n.tran 1u 200u\n.meas tran top max v(b)\n.end\n";
    for method in [SensitivityMethod::Forward, SensitivityMethod::Adjoint] {
        let found = by(text, true, method);
        near(&found, "top", "r1", 1e3, -3.0 / 16.0, 1e-11);
    }
}

/// The peaks of a three-phase rectifier are equal, and each moves with the resistances of its own phases: no derivative. A peak that an orbit repeats in every lap is one; so is a plateau.
#[test]
fn an_extremum_that_is_reached_twice_is_told_to_have_no_derivative() {
    let phases = |last: &str| {
        format!(
            "three phases\nva a 0 sin(0 100 50 0 0 0)\nvb b 0 sin(0 100 50 0 0 -120)\nvc c 0 sin(0 100 50 0 0 120)\nra a a1 1\nrb b b1 1\nrc c c1 {last}\nd1 a1 p ideal\nd2 b1 p ideal\nd3 c1 p ideal\nrl p 0 10\ncl p 0 100u\n.model ideal d(n=0.001)\n.tran 10u 60m\n.meas tran top max v(p) from=20m to=60m\n.meas tran rip pp v(p) from=20m to=60m\n.meas tran at max_at v(p) from=20m to=60m\n.meas tran m avg v(p) from=20m to=60m\n.end\n"
        )
    };
    let pulse = "plateau\nv1 a 0 pulse(0 1 0 25n 25n 25n 100n)\nr1 a b 1k\nr2 b 0 1k\nr3 a c 1k\nc3 c 0 1p\n.tran 1n 200n\n.meas tran top max v(b)\n.meas tran low min v(b)\n.end\n";
    for method in [SensitivityMethod::Forward, SensitivityMethod::Adjoint] {
        let said = |text: &str, steady| {
            let notes = by(text, steady, method).notes.into_iter();
            let notes = notes.filter(|note| note.code == "one-sided");
            notes.map(|note| note.text).collect::<Vec<_>>()
        };
        for steady in [false, true] {
            let notes = said(&phases("1"), steady);
            assert_eq!(notes.len(), 3, "{notes:?}");
            for (note, name) in notes.iter().zip(["`top`", "`rip`", "`at`"]) {
                assert!(
                    note.contains(name) && note.contains("with ra, rb, rc:"),
                    "{note}"
                );
            }
            let notes = said(&phases("1.01"), steady);
            assert!(notes.iter().all(|note| !note.contains("rc")), "{notes:?}");
        }
        for steady in [false, true] {
            assert_eq!(said(pulse, steady), Vec::<String>::new());
        }
    }
}

/// The power in a load that matches its source is the greatest there is: no end of the tolerance has as much, and the range holds it.
#[test]
fn the_range_about_an_extremum_holds_it() {
    let text = "matched\nv1 1 0 2\nr1 1 2 1k\nr2 2 0 1k tol=10\n.tran 1u 10u\n.meas tran p avg v(2)*i(r2)\n.end\n";
    let model = Model::parse(text, "t.cir").expect("a circuit");
    let range = worst(&model, "p", &WorstOptions::default()).expect("a range");
    let power = |r2: f64| 4.0 * r2 / ((1e3 + r2) * (1e3 + r2));
    assert!((range.greatest.value - power(1e3)).abs() < 1e-15);
    assert_eq!(range.greatest.at[0].1, 1e3);
    // Which end the derivative, which is rounding, points to is left open; both are below.
    let ends = [power(900.0), power(1100.0)];
    assert!(
        ends.iter()
            .any(|end| (range.least.value - end).abs() < 1e-15)
    );
    assert!(range.notes.iter().any(|note| note.code == "not-straight"));
}
