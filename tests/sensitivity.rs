//! Derivatives of measurements against closed forms.
#![allow(missing_docs, reason = "tests")]

use circ::analysis::{
    Sensitivity, SensitivityOptions, WorstOptions, sensitivity, transient, worst,
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
