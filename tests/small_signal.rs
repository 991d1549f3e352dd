//! Small-signal responses against closed forms.
#![allow(missing_docs, reason = "tests")]

use std::path::Path;

use circ::analysis::{
    About, PeriodicOptions, Response, SmallSignalOptions, orbit_start, periodic, small_signal,
    small_signal_measured,
};
use circ::integrate::Reason;
use circ::{Model, SimOptions};
use nalgebra::Complex;

fn response_of(text: &str, options: &SmallSignalOptions<'_>) -> Response {
    let model = Model::parse(text, "t.cir").expect("a circuit");
    small_signal(&model, options).expect("a response")
}

fn column(response: &Response, name: &str) -> Vec<Complex<f64>> {
    let at = response.phasors.names.iter().position(|n| n == name);
    response.phasors.column(at.expect("a column")).collect()
}

/// |found − true| at each frequency relative to the largest |true|.
fn apart(found: &[Complex<f64>], truth: impl Fn(f64) -> Complex<f64>, at: &[f64]) -> f64 {
    let truth: Vec<Complex<f64>> = at.iter().map(|f| truth(*f)).collect();
    let pairs = found.iter().zip(&truth);
    pairs.fold(0.0, |m, (a, b)| f64::max(m, (a - b).norm() / b.norm()))
}

const J: Complex<f64> = Complex::new(0.0, 1.0);
const TAU: f64 = std::f64::consts::TAU;

/// The filter of a buck, v(3)/v(2): L with its resistance in series, C with its own, R.
fn filter(f: f64) -> Complex<f64> {
    let s = J * (TAU * f);
    let capacitor = 0.02 + 1.0 / (s * 10e-6);
    let load = 1.0 / (1.0 / capacitor + 1.0 / 5.0);
    load / (load + s * 100e-6 + 0.05)
}

/// A synchronous buck whose switches compare a control with a sawtooth: D = 0.4 at 100 kHz.
fn buck(input: &str, control: &str, card: &str) -> String {
    format!(
        "buck\nv1 1 0 10 {input}\ns1 1 2 vc saw sw\ns2 2 0 saw vc sw\nl1 2 a 100u\nrl a 3 0.05\nrc 3 b 0.02\nc1 b 0 10u\nr1 3 0 5\n\
         vc vc 0 0.4 {control}\nvsaw saw 0 pulse(0 1 0 10u 0 0 10u)\n.model sw sw(vt=0 vh=0 ron=0 ideal=1)\n\
         .ac {card}\n.save v(3) i(l1) v(2)\n.end\n"
    )
}

#[test]
fn a_linear_circuit_is_its_transfer_function() {
    let text = "rlc\nv1 2 0 0 ac 2 30\nl1 2 a 100u\nrl a 3 0.05\nrc 3 b 0.02\nc1 b 0 10u\nr1 3 0 5\n.ac dec 7 1 100meg\n.end\n";
    let response = response_of(text, &SmallSignalOptions::default());
    assert_eq!(
        (response.about, response.phasors.frequency.len()),
        (About::Rest, 57)
    );
    let drive = Complex::from_polar(2.0, 30f64.to_radians());
    let out = column(&response, "v(3)");
    let error = apart(&out, |f| drive * filter(f), &response.phasors.frequency);
    assert!(error < 1e-12, "{error:e}");
}

/// A chain of n equal sections has v_n/v_0 = cosh(φ/2)/cosh((n + ½) φ) with cosh φ = 1 + jωRC/2.
#[test]
fn a_long_ladder_is_its_chain() {
    let n = 4000;
    let stage = |k: usize| format!("r{k} n{} n{k} 1\nc{k} n{k} 0 1n\n", k - 1);
    let stages: String = (1..=n).map(stage).collect();
    let text = format!("ladder\nv1 n0 0 0 ac 1\n{stages}.ac dec 4 1 10k\n.save v(n{n})\n.end\n");
    let response = response_of(&text, &SmallSignalOptions::default());
    let truth = |f: f64| {
        let phi = (1.0 + J * (TAU * f * 0.5e-9)).acosh();
        (0.5 * phi).cosh() / ((n as f64 + 0.5) * phi).cosh()
    };
    let out = column(&response, &format!("v(n{n})"));
    let error = apart(&out, truth, &response.phasors.frequency);
    assert!(error < 1e-8, "{error:e}");
    assert!(response.notes.is_empty(), "{:?}", response.notes);
}

/// `tests/reference/periodic_digits.py`: the orbit of a buck, its multiplier and its response up to ten times the switching frequency from 40 digits.
#[test]
fn the_orbit_of_a_buck_and_its_response_are_those_of_forty_digits() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(root.join("netlists/buck-open-loop.cir")).expect("a buck");
    let text = text
        .replace("rload out 0 20", "rload out 0 5")
        .replace("vin in 0 24", "vin in 0 dc 24 ac 1");
    let digits = std::fs::read_to_string(root.join("tests/reference/periodic.csv"));
    let digits = digits.expect("digits");
    let rows = digits.lines().skip(1).map(|line| {
        let (what, numbers) = line.split_once(',').expect("a row");
        let numbers: Vec<f64> = numbers.split(',').map(|n| n.parse().expect(n)).collect();
        (what, numbers[0], Complex::new(numbers[1], numbers[2]))
    });
    let (response, rest): (Vec<_>, Vec<_>) = rows.partition(|(what, ..)| *what == "y");
    let options = SmallSignalOptions {
        frequencies: response.iter().map(|row| row.1).collect(),
        ..SmallSignalOptions::default()
    };
    let found = column(&response_of(&text, &options), "v(out)");
    let model = Model::parse(&text, "t.cir").expect("a circuit");
    let (orbit, run) = periodic(&model, &PeriodicOptions::default()).expect("an orbit");
    let start = |name: &str| {
        let at = run.waveforms.names.iter().position(|n| n == name);
        Complex::from(run.waveforms.values[at.expect("a column")])
    };
    let [re, im] = orbit.multipliers[0];
    let all = [start("i(l1)"), start("v(out)"), Complex::new(re, im.abs())];
    assert_eq!((rest.len(), response.len()), (3, 10));
    for (own, (what, f, truth)) in all.iter().chain(&found).zip(rest.iter().chain(&response)) {
        let error = (own - truth).norm() / truth.norm();
        assert!(error < 1e-12, "{what} {f}: {own} {truth} {error:e}");
    }
}

/// Natural sampling moves the edge at t_k by T δd(t_k): pulses of area V T δd, whose baseband is V δd whatever the frequency.
#[test]
fn the_control_of_a_buck_with_natural_sampling_acts_through_its_filter_beyond_the_switching_frequency()
 {
    let response = response_of(
        &buck("", "ac 1", "dec 9 10 1meg"),
        &SmallSignalOptions::default(),
    );
    assert_eq!(response.about, About::Orbit);
    let out = column(&response, "v(3)");
    let error = apart(&out, |f| 10.0 * filter(f), &response.phasors.frequency);
    assert!(error < 1e-9, "{error:e}");
    // The edges of the switching node move, and nothing else of it does.
    let node = column(&response, "v(2)");
    let error = apart(&node, |_| Complex::from(10.0), &response.phasors.frequency);
    assert!(error < 1e-9, "{error:e}");
}

/// The input acts through q(t) = Σ c_k e^{jkω_s t}, c_k = sin(πkD)/(πk) e^{−jπkD}.
#[test]
fn the_input_of_a_buck_acts_in_sidebands() {
    let options = SmallSignalOptions {
        sidebands: 3,
        ..SmallSignalOptions::default()
    };
    let response = response_of(&buck("ac 1", "", "dec 9 10 1.1meg"), &options);
    for k in -3..=3_i32 {
        let name = if k == 0 {
            "v(3)".to_string()
        } else {
            format!("v(3)@{k}")
        };
        let out = column(&response, &name);
        let truth = |f: f64| {
            let x = std::f64::consts::PI * f64::from(k);
            let part = if k == 0 {
                Complex::from(0.4)
            } else {
                (x * 0.4).sin() / x * (-J * x * 0.4).exp()
            };
            part * filter(f + f64::from(k) * 1e5)
        };
        let error = apart(&out, truth, &response.phasors.frequency);
        assert!(error < 1e-9, "{k}: {error:e}");
    }
}

/// An exponential diode is its tangent: R in series with r = nV_T/(I + IS) at the current I of the operating point.
/// Each switch has a source of its own, whose edges cross the threshold together: they would part where one of these sources varies, but the input varies alone.
#[test]
fn the_input_of_a_buck_acts_through_gates_that_move_together() {
    let text = "buck\nv1 1 0 10 ac 1\ns1 1 2 g 0 sw\ns2 2 0 h 0 sw\nl1 2 a 100u\nrl a 3 0.05\nrc 3 b 0.02\nc1 b 0 10u\nr1 3 0 5\n\
        vg g 0 pulse(0 1 0 10n 10n 3.99u 10u)\nvh h 0 pulse(1 0 0 10n 10n 3.99u 10u)\n.model sw sw(vt=0.5 vh=0 ron=0 ideal=1)\n\
        .ac dec 5 10 100k\n.save v(3)\n.end\n";
    let response = response_of(text, &SmallSignalOptions::default());
    assert_eq!(response.about, About::Orbit);
    let out = column(&response, "v(3)");
    let off = apart(&out, |f| 0.4 * filter(f), &response.phasors.frequency);
    assert!(off < 1e-9, "{off:e}");
    // Where the gate itself varies the switches part.
    let gate = text
        .replace("10 ac 1", "10")
        .replace("vg g 0", "vg g 0 ac 1");
    let model = Model::parse(&gate, "t.cir").expect("a circuit");
    let refused = small_signal(&model, &SmallSignalOptions::default()).expect_err("no response");
    assert!(matches!(refused.reason, Reason::NotSmooth(_)), "{refused}");
}

#[test]
fn a_diode_is_its_tangent_at_the_operating_point() {
    let text = "d\nv1 1 0 dc 5 ac 1\nr1 1 2 1k\nd1 2 0 d\nc1 2 0 10n\n.model d d(is=1e-14 n=1.5)\n.ac dec 5 10 10meg\n.save v(2)\n.end\n";
    let response = response_of(text, &SmallSignalOptions::default());
    let point = Model::parse(text, "t.cir")
        .unwrap()
        .operating_point()
        .unwrap();
    let current = point
        .currents
        .iter()
        .find(|(name, _)| name == "d1")
        .unwrap()
        .1;
    let thermal = 1.380_649e-23 * 300.15 / 1.602_176_634e-19;
    let diode = 1.5 * thermal / (current + 1e-14);
    let out = column(&response, "v(2)");
    let truth = |f: f64| 1.0 / (1.0 + 1e3 / diode + J * TAU * f * 1e3 * 10e-9);
    let error = apart(&out, truth, &response.phasors.frequency);
    assert!(error < 1e-9, "{error:e}");
}

/// Where the orbit ends in the operating point, or the switch does not move, the two ways are one.
#[test]
fn about_an_orbit_without_events_is_about_the_operating_point() {
    let card = "r1 1 2 1k\nc1 2 0 1u\nd1 2 3 d\nr2 3 0 2k\n.model d d(ron=1 vfwd=0.5 roff=1meg)\n.ac dec 3 1 1meg\n.tran 1u 1m\n.save v(2)\n.end\n";
    let still = format!("t\nv1 1 0 dc 5 ac 1\n{card}");
    // A second source that repeats and does nothing makes an orbit of it.
    let moving = format!("t\nv1 1 0 dc 5 ac 1\nv2 4 0 sin(0 1 1k)\nr4 4 0 1k\n{card}");
    let a = response_of(&still, &SmallSignalOptions::default());
    let b = response_of(&moving, &SmallSignalOptions::default());
    assert_eq!((a.about, b.about), (About::Rest, About::Orbit));
    for (a, b) in column(&a, "v(2)").iter().zip(column(&b, "v(2)")) {
        assert!((a - b).norm() < 1e-12 * a.norm(), "{a} {b}");
    }
}

/// A bridge that a current of 1 A flows through commutates where the source crosses zero, once where the orbit begins: i(vs) is −sign(v), and a
/// shift of v by δ moves both edges by δ/(Aω₀): −2/(πA) δ at every frequency.
#[test]
fn an_event_where_the_orbit_begins_counts_once() {
    let text = "t\nvs a x sin(0 10 1k)\nvac x b 0 ac 1\nd1 a p d\nd2 b p d\nd3 n a d\nd4 n b d\ni1 p n 1\nrg n 0 1k\n.model d d(ideal)\n\
                .tran 10u 1m\n.ac list 10 300 2.7k\n.save i(vs)\n.end\n";
    for found in column(&response_of(text, &SmallSignalOptions::default()), "i(vs)") {
        let truth = -2.0 / (10.0 * std::f64::consts::PI);
        assert!((found - truth).norm() < 1e-9, "{found} {truth}");
    }
}

/// A circuit without storage: the diode conducts in a part of each period, from where the sine passes 0.6 V on.
#[test]
fn a_clipper_without_storage_lets_through_what_its_diode_leaves() {
    let text = "t\nv1 1 4 sin(0 5 1k)\nv2 4 0 0 ac 1\nr1 1 2 1k\nd1 2 0 d\n.model d d(ron=10 vfwd=0.6)\n.tran 1u 1m\n.ac list 10\n\
                .save v(2)\n.end\n";
    let found = column(&response_of(text, &SmallSignalOptions::default()), "v(2)")[0];
    let conducts = 0.5 - (0.6_f64 / 5.0).asin() / std::f64::consts::PI;
    let truth = 1.0 - conducts * (1.0 - 10.0 / 1010.0);
    assert!((found - truth).norm() < 1e-9, "{found} {truth}");
}

/// Inductors alone between sources keep what a slow sine puts into them for as long as a mode lasts: at 1e-7 of the switching frequency that is more
/// than doubles carry beside what is left, and said.
#[test]
fn a_frequency_far_below_the_circuit_is_told_to_lose_digits() {
    let text = |card: &str| {
        let netlist = include_str!("../netlists/scr-bridge.cir");
        let netlist = netlist.replace("va a 0 sin", "vd x 0 0 ac 1\nva a x sin");
        netlist.replace(".save", &format!(".ac list {card}\n.save i(vb)\n*"))
    };
    let slow = response_of(&text("5e-6"), &SmallSignalOptions::default());
    assert!(
        slow.notes.iter().any(|note| note.text.contains("rounding")),
        "{:?}",
        slow.notes
    );
    let sound = response_of(&text("50m"), &SmallSignalOptions::default());
    assert!(sound.notes.is_empty(), "{:?}", sound.notes);
    // What 1 V of direct voltage in phase a makes of the mean of i(vb), by orbits with ±1 mV.
    let found = column(&sound, "i(vb)")[0];
    assert!((found.re + 0.024_688_36).abs() < 1e-6, "{found}");
}

#[test]
fn what_has_no_response_is_refused_with_a_reason() {
    let refused = |text: &str| {
        let model = Model::parse(text, "t.cir").expect("a circuit");
        match small_signal(&model, &SmallSignalOptions::default()) {
            Err(error) => error,
            Ok(_) => panic!("{text}"),
        }
    };
    let without_card = refused("t\nv1 1 0 1 ac 1\nr1 1 0 1\n.end\n");
    assert!(
        without_card.to_string().contains(".ac dec"),
        "{without_card}"
    );
    let without_source = refused("t\nv1 1 0 1\nr1 1 0 1\n.ac dec 1 1 10\n.end\n");
    assert!(
        without_source.to_string().contains("AC"),
        "{without_source}"
    );
    // The product took 3 V and 0.4 V as numbers: no response is better than none of it.
    let product = refused(
        "t\nvc c 0 0.4 ac 1\nvd d 0 3\nb1 w 0 v={v(c)*v(d)}\nr1 w 0 1k\n.ac dec 1 1 10\n.end\n",
    );
    assert!(
        product.elements == ["vc"] && product.to_string().contains("number"),
        "{product}"
    );
    // A tank without loss has no response at its own frequency: L = C = 1/(2π).
    let tank = refused(
        "t\ni1 0 1 0 ac 1\nl1 1 0 0.15915494309189535\nc1 1 0 0.15915494309189535\n.ac list 1\n.end\n",
    );
    assert!(matches!(tank.reason, Reason::NotSmooth(_)), "{tank}");
}

/// An exponential rectifier has a response about its operating point, where its diode blocks, unless that about its orbit is asked for.
#[test]
fn what_is_smooth_is_made_linear_at_rest() {
    let text = "t\nv1 1 0 sin(0 5 1k)\nv2 2 1 0 ac 1\nd1 2 3 d\nr1 3 0 1k\nc1 3 0 1u\n.model d d(is=1e-14)\n.ac list 10\n.tran 1u 5m\n.save v(3)\n.end\n";
    let codes = |response: &Response| -> Vec<&str> {
        let notes = response.notes.iter();
        notes.map(|note| note.code).collect()
    };
    let rest = response_of(text, &SmallSignalOptions::default());
    assert_eq!(
        (rest.about, &codes(&rest)[..]),
        (About::Rest, &["about-rest"][..])
    );
    assert!(column(&rest, "v(3)")[0].norm() < 1e-8);
    let options = SmallSignalOptions {
        about: Some(About::Orbit),
        ..SmallSignalOptions::default()
    };
    let orbit = response_of(text, &options);
    assert_eq!(codes(&orbit), ["tangents"]);
    assert!((column(&orbit, "v(3)")[0].norm() - 0.8).abs() < 0.2);
}

/// What is wrong with `.ac` and `AC` does not stop a transient.
#[test]
fn faults_of_small_signals_are_warnings() {
    for (source, card) in [
        ("ac 1", ".ac dec 0 1 10"),
        ("ac 1", ".ac dec {n} 1 10"),
        ("ac {m}", ".ac dec 10 1 10"),
        ("ac 1", ".ac dec 10"),
    ] {
        let text = format!("t\nv1 1 0 1 {source}\nr1 1 0 1\n{card}\n.tran 1u 1m\n.end\n");
        let model = Model::parse(&text, "t.cir").expect("a circuit");
        assert!(!model.findings().is_empty(), "{text}");
        assert!(model.transient(SimOptions::default()).is_ok(), "{text}");
        assert!(
            small_signal(&model, &SmallSignalOptions::default()).is_err(),
            "{text}"
        );
    }
}

/// A load that doubles at 20 µs: until then nothing moves from period to period.
#[test]
fn a_transient_starts_at_the_orbit_and_a_step_follows() {
    let text = "buck\nv1 1 0 10\ns1 1 2 g 0 sw\nd1 0 2 d\nl1 2 3 20u\nc1 3 0 4.7u\nr1 3 0 3\ni1 3 0 pulse(0 1 200u 0 0 1 2)\n\
                vg g 0 pulse(0 1 0 0 0 4u 10u)\n.model sw sw(vt=0.5 vh=0 ron=10m roff=1meg)\n.model d d(ron=10m roff=1meg)\n\
                .tran 10u 400u\n.save v(3) i(l1)\n.end\n";
    let model = Model::parse(text, "t.cir").expect("a circuit");
    let (orbit, start) = orbit_start(&model, &PeriodicOptions::default()).expect("an orbit");
    assert!(orbit.stable && (orbit.period - 1e-5).abs() < 1e-18);
    let options = SimOptions {
        start: Some(start),
        ..SimOptions::default()
    };
    let run = model.transient(options).expect("a run");
    let (first, last) = (run.waveforms.row(0), run.waveforms.row(40));
    for k in 1..=20 {
        for (a, b) in run.waveforms.row(k).iter().zip(first) {
            assert!((a - b).abs() < 1e-11 * b.abs(), "{k}: {a} {b}");
        }
    }
    assert!(last[1] > first[1] + 0.5, "{last:?} {first:?}");
}

/// A switch that is on while the current of a capacitor across a sine, C A ω cos ωt, is positive: its edges at u' = 0 move by δu'/(A ω²) towards
/// each other or apart, twice a period T, and the pulses of V by 2 V δu'/(A ω² T) in the mean.
#[test]
fn a_switch_that_follows_the_slope_of_a_source_acts_on_its_filter() {
    let text = "slope\nvin c 0 sin(0 2 1k) ac 1\nc1 c 0 1u\nh1 h 0 vin 1k\nv1 1 0 10\ns1 1 2 0 h sw\ns2 2 0 h 0 sw\nr1 2 3 1k\nc2 3 0 1u\n\
        .model sw sw(vt=0 vh=0 ron=0 ideal=1)\n.ac dec 3 10 3k\n.save v(3)\n.end\n";
    let response = response_of(text, &SmallSignalOptions::default());
    assert_eq!(response.about, About::Orbit);
    let out = column(&response, "v(3)");
    let pulses = |f: f64| 2.0 * 10.0 * 1e3 / (2.0 * (TAU * 1e3).powi(2)) * J * TAU * f;
    let truth = |f: f64| pulses(f) / (1.0 + J * TAU * f * 1e-3);
    let error = apart(&out, truth, &response.phasors.frequency);
    assert!(error < 1e-9, "{error:e}");
}

/// What `.meas ac` cards find.
fn measured(text: &str) -> Vec<(String, Result<f64, String>)> {
    let model = Model::parse(text, "t.cir").expect("a circuit");
    let (response, found) =
        small_signal_measured(&model, &SmallSignalOptions::default()).expect("a response");
    assert_eq!(response.phasors.names.len(), model.circuit().probes().len());
    assert_eq!(response.phasors.frequency, model.circuit().ac);
    let found = found.into_iter().map(|m| {
        let value = m.result.map(|found| found.value);
        (m.name, value.map_err(|why| why.to_string()))
    });
    found.collect()
}

/// A resonance and a band-pass in closed form, as LTspice's and ngspice's users write their cards; rows are a tenth of a decade apart.
#[test]
fn responses_are_measured_between_their_rows() {
    let text = "band\nv1 in 0 ac 1\nr1 in out 1k\nl1 out 0 1m\nc1 out 0 1u\n.ac dec 10 100 1meg\n.save v(in)\n\
        .meas AC top MAX mag(V(out))\n.meas ac peak max_at vm(out)\n\
        .meas AC bw TRIG mag(V(out))=top/sqrt(2) RISE=1 TARG mag(V(out))=top/sqrt(2) FALL=LAST\n\
        .meas ac band trig vdb(out) val=-3.0102999566398120 rise=1 targ vdb(out) val=-3.0102999566398120 fall=1\n\
        .meas ac low when vp(out)=45\n.meas AC gain FIND V(out) AT=1k\n.meas ac db find vdb(out,in) at=1k\n\
        .meas ac turn find ph(V(out)) at=100k\n.meas ac amps find im(l1) at=1k\n.meas ac real find re(V(out)) when frequency=1k\n\
        .meas ac q param peak/bw\n.meas ac none when vdb(out)=3\n.meas ac far max vdb(out) from=2meg\n.meas ac sum pp re(v(out))\n.end\n";
    let (r, l, c) = (1e3_f64, 1e-3_f64, 1e-6_f64);
    let out = |f: f64| {
        let s = J * (TAU * f);
        1.0 / (1.0 + r * (s * c + 1.0 / (s * l)))
    };
    let resonance = 1.0 / (TAU * (l * c).sqrt());
    let width = 1.0 / (TAU * r * c);
    let lower = (resonance.powi(2) + 0.25 * width * width).sqrt() - 0.5 * width;
    let at = out(1e3);
    let found = measured(text);
    let value = |name: &str| {
        let own = found.iter().find(|(own, _)| own == name).expect(name);
        own.1.clone()
    };
    for (name, truth, tolerance) in [
        ("top", 1.0, 1e-9),
        ("peak", resonance, 1e-4),
        ("bw", width, 1e-6),
        ("band", width, 1e-6),
        ("low", lower, 1e-6),
        ("gain", at.norm(), 1e-12),
        (
            "db",
            20.0 * (at / (1.0 + 0.0 * J) - 1.0).norm().log10(),
            1e-12,
        ),
        ("turn", out(1e5).arg().to_degrees(), 1e-12),
        ("amps", (at / (J * TAU * 1e3 * l)).norm(), 1e-12),
        ("real", at.re, 1e-9),
        ("q", resonance / width, 1e-4),
        // 1 at the resonance, and nearly 0 at the ends.
        ("sum", 1.0 - out(1e6).re, 1e-6),
    ] {
        let found = value(name).expect(name);
        assert!(
            (found - truth).abs() <= tolerance * truth.abs(),
            "{name}: {found:e} is not {truth:e}"
        );
    }
    assert_eq!(value("none"), Err("the value 3 is not crossed".into()));
    let far = "no part of the response lies between 2000000 Hz and 1000000 Hz";
    assert_eq!(value("far"), Err(far.into()));
}

/// Beyond −180° the phase goes on, as it does in a Bode plot; a card without an analysis is of the one that the netlist asks for.
#[test]
fn phases_are_measured_without_jumps() {
    let text = "three\nv1 1 0 ac 1\ne1 a 0 1 0 1\nr1 a b 1k\nc1 b 0 1u\ne2 c 0 b 0 1\nr2 c d 1k\nc2 d 0 1u\ne3 e 0 d 0 1\nr3 e f 1k\nc3 f 0 1u\n\
        .ac dec 20 1 10k\n.meas beyond when vp(f)=-225\n.meas margin find 180+ph(v(f)) when vdb(f)=-60\n.end\n";
    let found = measured(text);
    let corner = 1.0 / (TAU * 1e-3);
    let tangent = 75f64.to_radians().tan();
    let beyond = found[0].1.clone().expect("a frequency");
    assert!((beyond / (corner * tangent) - 1.0).abs() < 1e-6, "{beyond}");
    // Each of three stages at −20 dB: 1 + x² = 100.
    let margin = found[1].1.clone().expect("a phase");
    let truth = 180.0 - 3.0 * 99f64.sqrt().atan().to_degrees();
    assert!((margin - truth).abs() < 1e-5, "{margin} {truth}");
}

/// Diodes and transistors at their operating points: `tests/reference/small-signal/`, made by `tests/reference/small_signal.py`.
#[test]
fn curved_laws_respond_as_in_ngspice() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference/small-signal");
    let of = |name: &str, ending: &str| {
        let path = folder.join(format!("{name}.{ending}"));
        std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    };
    for name in [
        "bridge",
        "common-emitter",
        "current-biased",
        "diode",
        "long-tailed-pair",
    ] {
        let response = response_of(&of(name, "cir"), &SmallSignalOptions::default());
        assert_eq!(response.about, About::Rest, "{name}");
        let signals: Vec<_> = (response.phasors.names.iter())
            .map(|name| (name, column(&response, name)))
            .collect();
        let reference = of(name, "csv");
        let lines = reference.lines().filter(|line| !line.starts_with('#'));
        let mut count = 0;
        for (line, (row, (signal, found))) in lines.skip(1).zip(
            (0..response.phasors.frequency.len())
                .flat_map(|row| signals.iter().map(move |signal| (row, signal))),
        ) {
            let words: Vec<&str> = line.split(',').collect();
            let number = |k: usize| words[k].parse::<f64>().expect("a number");
            let truth = Complex::new(number(2), number(3));
            assert_eq!(words[1], signal.as_str(), "{name}");
            let apart = (number(0) / response.phasors.frequency[row] - 1.0).abs();
            assert!(apart < 1e-12, "{name}: {line}");
            let error = (found[row] - truth).norm() / truth.norm();
            assert!(error < 1e-6, "{name}: {line}: {}, {error:e}", found[row]);
            count += 1;
        }
        assert_eq!(count, response.phasors.frequency.len() * signals.len());
    }
}

/// About an orbit in steps too, where no source can be moved to confirm it.
#[test]
fn an_amplitude_of_zero_has_no_response() {
    let text = "buck\nvin in 0 dc 12 ac 0\ns1 in sw g 0 m\nd1 0 sw d\nl1 sw out 22u\nc1 out 0 100u\nrload out 0 3\nvg g 0 pulse(0 5 0 20n 20n 3u 10u)\n\
                .model m sw(vt=2.5 ron=20m roff=1meg)\n.model d d(is=1e-9 n=1.05 rs=10m)\n.save v(out)\n.ac list 1k\n.end\n";
    let model = Model::parse(text, "t.cir").expect("a circuit");
    let found = small_signal(&model, &SmallSignalOptions::default()).expect("a response");
    assert!(found.phasors.values.iter().all(|v| v.norm() == 0.0));
}

/// Behind 50 Ω a line of 75 Ω and 10 ns that ends in 100 Ω: Z (Z_L + j Z tan ωτ)/(Z + j Z_L tan ωτ) at its input.
#[test]
fn a_transmission_line_is_its_closed_form() {
    let text = "line\nv1 a 0 ac 1\nr1 a b 50\nt1 b 0 c 0 z0=75 td=10n\nr2 c 0 100\n.ac lin 41 1meg 201meg\n.end\n";
    let response = response_of(text, &SmallSignalOptions::default());
    let (z, load) = (Complex::from(75.0), Complex::from(100.0));
    let input = |f: f64| {
        let (s, c) = (TAU * f * 10e-9).sin_cos();
        let seen = z * (load * c + J * z * s) / (z * c + J * load * s);
        seen / (seen + 50.0)
    };
    // Forward and backward waves at the input make the voltage at the end.
    let output = |f: f64| {
        let (s, c) = (TAU * f * 10e-9).sin_cos();
        input(f) / (c + J * z / load * s)
    };
    let at = &response.phasors.frequency;
    assert!(apart(&column(&response, "v(b)"), input, at) < 1e-13);
    assert!(apart(&column(&response, "v(c)"), output, at) < 1e-13);

    // Two in a row, with ends that cross, are one of both delays.
    let split = text
        .replace(
            "t1 b 0 c 0 z0=75 td=10n",
            "t1 b 0 m 0 z0=75 td=3n\nt2 c 0 m 0 z0=75 td=7n",
        )
        .replace(".end", ".save v(c)\n.end");
    let response = response_of(&split, &SmallSignalOptions::default());
    assert!(apart(&column(&response, "v(c)"), output, at) < 1e-13);

    // Open at both ends, it resonates at half a wavelength.
    let open = "open\ni1 0 b ac 1\nt1 b 0 c 0 z0=75 td=10n\n.ac list 50meg\n.end\n";
    let model = Model::parse(open, "t.cir").expect("a circuit");
    let fault = small_signal(&model, &SmallSignalOptions::default()).expect_err("a resonance");
    assert!(fault.to_string().contains("resonates"), "{fault}");
}
