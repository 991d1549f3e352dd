//! Derivatives along sparse steps: against those of exact runs, on circuits that both master, and against differences where nothing else answers.
#![allow(missing_docs, reason = "tests")]

use circ::Model;
use circ::analysis::{Sensitivity, SensitivityOptions, sensitivity};
use circ::settings::Settings;

fn found(text: &str, steady: bool, large: bool) -> Sensitivity {
    let model = Model::parse(text, "values.cir").unwrap_or_else(|error| panic!("{error}\n{text}"));
    let own = Settings::default();
    let settings = Settings {
        large: if large { 0 } else { own.large },
        ..own
    };
    let options = SensitivityOptions {
        steady,
        settings,
        ..SensitivityOptions::default()
    };
    sensitivity(&model, &options).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// All derivatives p ∂J/∂p of sparse steps and exact runs agree to this part of the largest of each measurement.
fn agree(text: &str, steady: bool, part: f64) -> Sensitivity {
    let exact = found(text, steady, false);
    let stepped = found(text, steady, true);
    assert!(exact.exact && !stepped.exact, "{:?}", exact.notes);
    assert!(stepped.passes.backward > 0, "{:?}", stepped.notes);
    assert_eq!(exact.at, stepped.at);
    for (a, b) in exact.of.iter().zip(&stepped.of) {
        let all = a.to.iter().zip(&b.to).zip(&exact.at);
        let all = all.map(|(((name, a), (_, b)), (_, value))| {
            let [a, b] = [a, b].map(|d| d.expect("a derivative") * value);
            (name, a, b)
        });
        let all: Vec<(&String, f64, f64)> = all.collect();
        let largest = all.iter().fold(0.0_f64, |m, (_, a, _)| m.max(a.abs()));
        for (name, a, b) in all {
            assert!(
                (a - b).abs() <= part * largest,
                "{} {name}: {a:e} exact, {b:e} in steps\n{text}\n{:?}",
                exact.of[0].name,
                stepped.notes
            );
        }
    }
    stepped
}

const BUCK: &str = "buck\nvin in 0 24\nrs in a 0.1\nls a p 1u ic=0.5\ncs p 0 47u ic=23\nvg g 0 pulse(0 1 0 50n 50n 4u 10u)\ns1 p x g 0 sw\nd1 0 x dm\n\
    l1 x y 22u ic=0.7\nr1 y o 50m\nc1 o c 22u ic=8\nrc c 0 20m\nrl o 0 LOAD\n.param k=3\nrk o 0 {100*k}\n\
    .model sw sw(vt=0.5 vh=0 ron=20m roff=1meg)\n.model dm d(ideal)\n.tran 0.1u 100u UIC\n\
    .meas tran vo avg v(o) from=50u to=100u\n.meas tran pk max i(l1) from=50u to=100u\n.meas tran last find v(o) at=97.3u\n\
    .meas tran heat rms i(rl)\n.end\n";

fn buck(load: &str, uic: &str) -> String {
    BUCK.replace("LOAD", load).replace("UIC", uic)
}

#[test]
fn a_transient_from_given_values() {
    agree(&buck("3", "uic"), false, 1e-5);
}

#[test]
fn a_transient_from_its_operating_point() {
    let text = buck("3", "").replace("pulse(0 1 0", "pulse(0 1 2u");
    agree(&text, false, 1e-5);
}

#[test]
fn a_current_that_ends_by_itself() {
    agree(&buck("60", "uic"), false, 1e-5);
}

#[test]
fn the_steady_state() {
    agree(&buck("3", "uic"), true, 1e-5);
    agree(&buck("60", "uic"), true, 1e-5);
}

/// Flux of coupled windings, charge that a switch shares between capacitors, and a loop of capacitors and a source: all of it from where it is told to begin, and in the steady state.
#[test]
fn coupled_windings_and_shared_charge() {
    let flyback = "flyback\nvin in 0 48\nlp in p 100u ic=0.4\nls 0 s 25u\nk1 lp ls 0.98\nvg g 0 pulse(0 1 0 50n 50n 4u 10u)\ns1 p 0 g 0 sw\nrsn p q 1k\ncsn q 0 1n\nd1 s o dm\nc1 o 0 47u ic=15\nrl o 0 8\n\
        .model sw sw(vt=0.5 vh=0 ron=20m roff=1meg)\n.model dm d(ideal)\n.tran 0.1u 60u uic\n.meas tran vo avg v(o)\n.meas tran ip max i(lp) from=35u to=60u\n.end\n";
    agree(flyback, false, 1e-5);
    agree(flyback, true, 1e-5);
    let shared = "charge pump\nv1 in 0 10\nvg g 0 pulse(0 1 0 10n 10n 4u 10u)\nvh h 0 pulse(0 1 5u 10n 10n 4u 10u)\nr0 in a 1\nca a 0 2u ic=9\ns1 a f g 0 sw\ncf f e 1u ic=8\ns2 e 0 g 0 sw\n\
        s3 f o h 0 sw\ns4 e a h 0 sw\nco o 0 3u ic=15\nc2 o x 1u ic=5\nv2 x 0 10\nrl o 0 50\n.model sw sw(vt=0.5 vh=0 ron=0 roff=1e12)\n\
        .tran 0.1u 50u uic\n.meas tran vo avg v(o) from=20u to=50u\n.meas tran last find v(f,e) at=47u\n.end\n";
    agree(shared, false, 1e-5);
    agree(shared, true, 1e-5);
}

/// A sine and a triangle begin together: the switch stands on its threshold, and goes where they go.
#[test]
fn a_control_that_starts_on_its_threshold() {
    let text = "leg\nv1 1 0 200\nv3 6 0 sin(0 0.8 4k)\nv4 7 0 pulse(0 1 0 24.95u 25u 50n 50u)\ns1 1 4 6 7 m0\ns2 4 0 7 6 m0\nl1 4 9 8.6m ic=0\nr1 9 10 1.1\nv6 10 0 60\n\
        .model m0 sw(ron=1.1 roff=11k vt=0 vh=0)\n.tran 5u 100u uic\n.meas tran im avg i(l1)\n.meas tran last find i(l1) at=79u\n.end\n";
    let stepped = agree(text, false, 1e-5);
    let exact = found(text, false, false);
    for (a, b) in exact.of.iter().zip(&stepped.of) {
        let (Ok(a), Ok(b)) = (&a.value, &b.value) else {
            panic!("no values");
        };
        assert!((a - b).abs() < 1e-5 * a.abs(), "{a:e} {b:e}");
    }
}

/// Two sources of one voltage charge a capacitor; the switch that lets the second one in stands on its threshold, open, and goes on with the sources: at rest only the first one counts.
#[test]
fn a_rest_with_a_control_on_its_threshold() {
    let text = "pair\nv1 1 0 10\nv2 2 0 10\nr1 1 3 100\nr2 2 4 100\nvc c 0 pulse(0.5 1 0 1u 1u 1 2)\ns1 4 3 c 0 m0\nc1 3 0 1u\nr3 3 5 1\nc2 5 0 1n\n\
        .model m0 sw(ron=1 roff=1g vt=0.5 vh=0)\n.tran 1u 20u\n.meas tran last find v(3) at=15u\n.end\n";
    let stepped = agree(text, false, 1e-5);
    let by = stepped.derivative("last", "v2").expect("a derivative");
    // From rest at v1 towards (v1 + 1.01 v2/1.01…)/2 with a time constant of about 50 µs.
    assert!((by - 0.13).abs() < 0.01, "{by}");
}

/// What moves a switch, or a waveform, has differences of runs, and a note says so; a threshold is no coefficient.
#[test]
fn values_that_move_switches() {
    let text = buck("3", "uic")
        .replace("4u 10u)", "{d*10u} 10u)")
        .replace(".param k=3", ".param k=3 d=0.4 vt=0.5");
    let text = text
        .replace("vt=0.5 vh", "vt={vt} vh")
        .replace(".meas tran last find v(o) at=97.3u\n", "");
    let exact = found(&text, false, false);
    let stepped = found(&text, false, true);
    assert_eq!(exact.at, stepped.at);
    assert!(stepped.notes.iter().any(|note| note.code == "not-exact"));
    for (name, value) in [("d", 0.4), ("k", 3.0), ("l1", 22e-6), ("vt", 0.5)] {
        let [a, b] =
            [&exact, &stepped].map(|s| value * s.derivative("vo", name).expect("a derivative"));
        let largest = exact.derivative("vo", "d").expect("a derivative") * 0.4;
        assert!((a - b).abs() < 1e-3 * largest, "{name}: {a:e} {b:e}");
    }
    let sawtooth = buck("3", "uic")
        .replace(
            "vg g 0 pulse(0 1 0 50n 50n 4u 10u)",
            "vr ref 0 0.4\nvs saw 0 pulse(0 1 0 9.8u 0.1u 0.1u 10u)",
        )
        .replace("s1 p x g 0 sw", "s1 p x ref saw sw")
        .replace("vt=0.5 vh=0", "vt=0 vh=0");
    let [a, b] = [false, true].map(|large| {
        let found = found(&sawtooth, false, large);
        0.4 * found.derivative("vo", "vr").expect("a derivative")
    });
    assert!((a - b).abs() < 1e-3 * a, "{a:e} {b:e}");
}

/// Diodes that take a current over from one another while it passes zero: its slope jumps, and what is found later depends on when that was; so does a mean of a voltage that jumps, and a
/// peak at the corner.
#[test]
fn a_current_that_changes_over() {
    let doubler = "doubler\nv1 1 0 sin(0 12 100k)\nr1 1 3 72m\nl1 3 2 1.4u ic=0\nc1 2 4 260u ic=0\nd1 0 4 m0\nd2 4 5 m0\nc2 0 5 260u ic=0\nr2 5 0 72\n.model m0 d(ideal)\n\
        .tran 1u 20u uic\n.meas tran im avg i(l1)\n.meas tran ir find i(l1) at=15.8u\n.meas tran vx avg v(2)\n.meas tran vo find v(5) at=15.8u\n.end\n";
    agree(doubler, false, 1e-3);
    let bridge = "bridge\nv1 1 0 sin(0 5 100k 0 0 90)\nr1 1 3 0.49\nl1 3 2 9.8u ic=0\nd1 2 4 m0\nd2 0 4 m0\nd3 5 2 m0\nd4 5 0 m0\nl2 4 6 930u ic=0.1\nc1 6 5 4.9u ic=0\nr4 6 5 49\n\
        .model m0 d(ron=4.9 roff=49meg)\n.tran 1u 20u uic\n.meas tran p pp i(l2)\n.end\n";
    agree(bridge, false, 1e-3);
    // Neither diode conducts for the 1e-11 s that leaks take to charge the node between them.
    let leaks = "doubler\nv1 1 0 sin(0 400 1k)\nr1 1 3 0.78\nl1 3 2 1.6m ic=0\nc1 2 5 160u ic=0\nd1 0 5 m0\nd2 5 4 m0\nc2 4 0 180u ic=0\nr2 4 0 78\ni1 4 0 pulse(0 2.6 1m 2u 2u 1m 2m)\n\
        .model m0 d(ron=78m vfwd=0.7 roff=78meg)\n.tran 0.16m 3m uic\n.meas tran im avg i(l1)\n.meas tran ir rms i(l1)\n.end\n";
    agree(leaks, false, 1e-3);
}

/// Memory for what a few values multiply has them one after the other, and less than that of one is refused.
#[test]
fn values_are_taken_as_memory_allows() {
    let model = Model::parse(&buck("3", "uic"), "values.cir").expect("a circuit");
    let held = |max_held| {
        let settings = Settings {
            large: 0,
            max_held,
            ..Settings::default()
        };
        let options = SensitivityOptions {
            settings,
            ..SensitivityOptions::default()
        };
        sensitivity(&model, &options)
    };
    let (all, few) = (held(1 << 30).expect("all"), held(400_000).expect("few"));
    for (all, few) in all.of.iter().zip(&few.of) {
        for ((name, a), (_, b)) in all.to.iter().zip(&few.to) {
            let (a, b) = (a.expect("a derivative"), b.expect("a derivative"));
            assert!(
                (a - b).abs() <= 1e-9 * a.abs().max(1e-9),
                "{name} {a:e} {b:e}"
            );
        }
    }
    let refused = held(10_000).expect_err("a run that does not fit");
    assert!(
        refused
            .to_string()
            .contains("does not fit into 10000 bytes"),
        "{refused}"
    );
}
