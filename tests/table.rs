//! Tables of means and powers against closed forms, quadrature and the energy balance.
#![allow(missing_docs, reason = "tests")]

use std::f64::consts::PI;

use circ::analysis::{PeriodicOptions, Table, TableOptions, periodic_table, table};
use circ::{Method, Model, SimOptions};

fn parsed(text: &str) -> Model {
    Model::parse(text, "t.cir").expect("a circuit")
}

fn table_of(text: &str) -> Table {
    let table = table(&parsed(text), &TableOptions::default()).expect("a table");
    let stored = |note: &circ::integrate::Note| note.text.contains("of the input");
    assert!(
        table.exact && table.notes.iter().all(stored),
        "{:?}",
        table.notes
    );
    table
}

fn orbit_of(text: &str, (inputs, outputs): (&[String], &[String])) -> Table {
    let table = periodic_table(
        &parsed(text),
        (inputs, outputs),
        &PeriodicOptions::default(),
    );
    table.expect("a table")
}

fn near(found: f64, truth: f64, size: f64) {
    let error = (found - truth).abs();
    assert!(
        error <= 1e-13 * size.abs().max(truth.abs()),
        "{found:e} is not {truth:e}"
    );
}

/// min(10 sin θ, 5): the first harmonic is a sum over stretches that begin at 0°, 30° and 150°.
#[test]
fn a_clipped_sine() {
    let table = table_of(
        "clipper\nv1 1 0 sin(0 10 50)\nr1 1 2 1k\nd1 2 3 d\nv2 3 0 5\n.model d d(ideal)\n.tran 1m 20m\n.save v(2)\n.end\n",
    );
    let root = 3_f64.sqrt();
    // ∫ sin and ∫ sin² from 30° to 150°.
    let (sine, square) = (root, PI / 3.0 + root / 4.0);
    let mean = (5.0 * 2.0 * PI / 3.0 - 10.0 * sine) / (2.0 * PI);
    let squared = 50.0 + (25.0 * 2.0 * PI / 3.0 - 100.0 * square) / (2.0 * PI);
    let first = (10.0 + (5.0 * sine - 10.0 * square) / PI) / 2_f64.sqrt();
    let signal = table.signal("v(2)").expect("v(2)");
    near(signal.value.mean, mean, 1.0);
    near(signal.value.rms, squared.sqrt(), 1.0);
    let distorted = (squared - mean * mean - first * first).sqrt() / first;
    near(signal.thd.expect("a distortion"), distorted, 1.0);
}

#[test]
fn rectified_sines() {
    let card = "rectifier\nv1 1 0 sin(0 10 50)\nd1 1 2 d\nr1 2 0 5\n.model d d(ideal)\n.tran 1m 60m 20m\n.save i(r1) v(1)\n.end\n";
    let table = table_of(card);
    let load = table.element("r1").expect("r1");
    near(load.i.mean, 2.0 / PI, 1.0);
    near(load.i.rms, 1.0, 1.0);
    near(load.i.max, 2.0, 1.0);
    near(load.i.min, 0.0, 1.0);
    near(load.power, 5.0, 1.0);
    let diode = table.element("d1").expect("d1");
    near(diode.v.min, -10.0, 1.0);
    near(diode.v.mean, -10.0 / PI, 1.0);
    near(diode.power, 0.0, 1.0);
    // Half sines: Y₁ = ½ of the amplitude.
    let current = table.signal("i(r1)").expect("i(r1)");
    let first = 0.5_f64.sqrt();
    let truth = (1.0 - (2.0 / PI).powi(2) - first * first).sqrt() / first;
    near(current.thd.expect("a distortion"), truth, 1.0);
    // The last period alone counts: here nothing flows in the first.
    let late = table_of(&card.replace("50)", "50 20m)").replace("60m 20m", "40m"));
    let current = late.signal("i(r1)").expect("i(r1)");
    near(current.thd.expect("a distortion"), truth, 1.0);
    // Of a sine rounding leaves the root of what is left of the square.
    assert!(
        table
            .signal("v(1)")
            .and_then(|s| s.thd)
            .expect("a fundamental")
            < 1e-7
    );
    near(table.power.efficiency.expect("a load"), 1.0, 1.0);
    assert_eq!(table.power.outputs, ["r1"]);
}

/// A capacitor is charged and discharged over 1 kΩ in turn: v = 5 ∓ 5 tanh ¼, and the current starts at ±(5 + 5 tanh ¼) mA.
#[test]
fn the_orbit_of_a_pulsed_capacitor() {
    let text = "rc\nv1 1 0 pulse(0 10 0 0 0 0.5m 1m)\nr1 1 2 1k\nc1 2 0 1u\n.tran 10u 1m\n.save v(2)\n.end\n";
    let outputs = ["r1".to_string()];
    let table = orbit_of(text, (&[], &outputs));
    assert!(table.exact);
    let swing = 5.0 * 0.25_f64.tanh();
    let out = table.signal("v(2)").expect("v(2)");
    near(out.value.mean, 5.0, 1.0);
    near(out.value.min, 5.0 - swing, 1.0);
    near(out.value.max, 5.0 + swing, 1.0);
    near(out.ripple, 2.0 * swing, 1.0);
    let (peak, decay) = ((5.0 + swing) * 1e-3, 1.0 - (-1.0_f64).exp());
    let load = table.element("r1").expect("r1");
    near(load.i.rms, peak * decay.sqrt(), 1e-3);
    near(load.i.max, peak, 1e-3);
    near(load.i.min, -peak, 1e-3);
    near(load.power, 1e3 * peak * peak * decay, 1e-3);
    near(table.element("c1").expect("c1").power, 0.0, 1e-2);
    near(table.power.efficiency.expect("an output"), 1.0, 1.0);
    // A square wave of ±5 V: its fundamental is 4/π times as high.
    let source = table.element("v1").expect("v1");
    near(source.v.rms, 50.0_f64.sqrt(), 1.0);
    assert_eq!(table.fundamental, Some(1e3));
}

/// A synchronous buck without losses: its output has the mean D V. Into L and R alone the current is made of exponentials.
#[test]
fn a_buck_in_continuous_conduction() {
    let switches = "v1 1 0 10\ns1 1 2 vc saw sw\ns2 2 0 saw vc sw\nvc vc 0 0.4\nvsaw saw 0 pulse(0 1 0 10u 0 0 10u)\n\
        .model sw sw(vt=0 vh=0 ron=0 ideal=1)\n";
    let text = format!("buck\n{switches}l1 2 3 100u\nc1 3 0 10u\nr1 3 0 5\n.save v(3)\n.end\n");
    let outputs = ["r1".to_string()];
    let inputs = ["v1".to_string()];
    let table = orbit_of(&text, (&inputs, &outputs));
    near(table.signal("v(3)").expect("v(3)").value.mean, 4.0, 1.0);
    near(table.element("l1").expect("l1").i.mean, 0.8, 1.0);
    near(table.power.efficiency.expect("an output"), 1.0, 10.0);
    let text = format!("buck\n{switches}l1 2 3 100u\nr1 3 0 5\n.save v(3)\n.end\n");
    let table = orbit_of(&text, (&inputs, &outputs));
    // From least to greatest in D T towards V/R, back to 0 in (1 − D) T.
    let (on, off) = ((-0.2_f64).exp(), (-0.3_f64).exp());
    let greatest = 2.0 * (1.0 - on) / (1.0 - on * off);
    let least = greatest * off;
    let choke = table.element("l1").expect("l1");
    near(choke.i.mean, 0.8, 1.0);
    near(choke.i.max, greatest, 1.0);
    near(choke.i.min, least, 1.0);
    let (tau, below) = (20e-6, 2.0 - least);
    let rising =
        4.0 * 4e-6 - 4.0 * below * tau * (1.0 - on) + below * below * 0.5 * tau * (1.0 - on * on);
    let falling = greatest * greatest * 0.5 * tau * (1.0 - off * off);
    near(choke.i.rms, ((rising + falling) / 10e-6).sqrt(), 1.0);
    near(choke.v.mean, 0.0, 1.0);
    near(
        table.element("s1").expect("s1").i.rms,
        (rising / 10e-6).sqrt(),
        1.0,
    );
}

/// The nodes and weights of the rule of Gauss and Legendre with four points on [0, 1].
const RULE: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// Netlists, and elements of them.
const QUADRATURE: [(&str, &[&str]); 7] = [
    ("netlists/bt-fig-2-2-steps.cir", &["l1", "d1", "i1"]),
    ("netlists/bridge-capacitor-filter.cir", &[]),
    ("netlists/jump-inductors.cir", &[]),
    ("netlists/jump-capacitors.cir", &[]),
    ("netlists/scr-rectifier.cir", &[]),
    ("netlists/voltage-doubler.cir", &[]),
    ("netlists/capacitor-loop.cir", &[]),
];

#[test]
fn tables_are_what_fine_quadrature_finds() {
    for (file, only) in QUADRATURE {
        let model = Model::load(file, circ::ElaborateOptions::default()).expect(file);
        let table = table(&model, &TableOptions::default()).expect(file);
        assert!(table.exact, "{file}");
        let circuit = model.circuit();
        // What has parts has their power, too.
        let is_whole = |name: &str| {
            let inside = format!("{name}.");
            circuit.elements.iter().any(|e| e.name.starts_with(&inside))
        };
        let elements = circuit.elements.iter().filter(|e| !is_whole(&e.name));
        let chosen = elements.filter(|e| only.is_empty() || only.contains(&e.name.as_str()));
        let chosen: Vec<(&str, String, String)> = chosen
            .take(4)
            .map(|e| {
                let node = |node: circ::circuit::NodeId| &circuit.nodes[node.index()];
                (
                    e.name.as_str(),
                    format!("i({})", e.name),
                    format!("v({},{})", node(e.p), node(e.n)),
                )
            })
            .collect();
        let probes = chosen
            .iter()
            .flat_map(|(_, i, v)| [i, v])
            .map(|name| circuit.probe(name).expect("a probe"));
        let tran = circuit.tran.expect("a transient");
        let shown = circ::Circuit {
            probes: probes.collect(),
            tran: Some(circ::circuit::Tran {
                tstep: tran.tstep.min((tran.tstop - tran.tstart) / 400.0),
                ..tran
            }),
            ..circuit.clone()
        };
        let model = Model::of_circuit(shown).expect("a circuit");
        let names: Vec<String> = model
            .circuit()
            .probes()
            .into_iter()
            .map(|p| p.name)
            .collect();
        let run = model
            .transient(SimOptions {
                corners: true,
                ..SimOptions::default()
            })
            .expect("a run");
        let mut simulation = model
            .simulation(circ::SimulationOptions::default())
            .expect("a simulation");
        let mut sums = vec![[0.0; 3]; chosen.len()];
        let mut squares = vec![0.0; chosen.len()];
        for pair in run
            .waveforms
            .time
            .windows(2)
            .filter(|pair| pair[1] > pair[0])
        {
            // Fast transients follow events.
            let h = pair[1] - pair[0];
            let parts = (0..6).map(|k| {
                (
                    pair[0] + h * 0.25_f64.powi(6 - k),
                    h * 0.75 * 0.25_f64.powi(5 - k),
                )
            });
            let first = (pair[0], h * 0.25_f64.powi(6));
            for (from, length) in std::iter::once(first).chain(parts) {
                for (node, weight) in RULE {
                    simulation
                        .advance_to(from + node * length)
                        .expect("an advance");
                    let mut value = |k: usize| simulation.value(&names[k]).expect("a value");
                    for k in 0..chosen.len() {
                        let (i, v) = (value(2 * k), value(2 * k + 1));
                        for (sum, part) in sums[k].iter_mut().zip([i, v, v * i]) {
                            *sum += weight * length * part;
                        }
                        squares[k] += weight * length * i * i;
                    }
                }
            }
        }
        let seconds = tran.tstop - tran.tstart;
        for (k, (name, ..)) in chosen.iter().enumerate() {
            let element = table.element(name).expect("an element");
            let jumps = run.state_jumps.all.0 > 0;
            let close = |found: f64, truth: f64, size: f64| {
                let error = (found - truth).abs() / size.max(1e-9);
                assert!(error < 1e-10, "{file} {name}: {found:e} is not {truth:e}");
            };
            let column = |c: usize| {
                run.waveforms
                    .column(c)
                    .fold((f64::MAX, f64::MIN), |(a, b), y| (a.min(y), b.max(y)))
            };
            let (size_i, size_v) = (
                element.i.min.abs().max(element.i.max),
                element.v.min.abs().max(element.v.max),
            );
            if !jumps {
                close(element.i.mean, sums[k][0] / seconds, size_i);
                close(element.v.mean, sums[k][1] / seconds, size_v);
                close(element.power, sums[k][2] / seconds, size_i * size_v);
            }
            close(element.i.rms, (squares[k] / seconds).sqrt(), size_i);
            // Rows come as near to an extremum as they are dense.
            for (mean, c) in [(element.i, 2 * k), (element.v, 2 * k + 1)] {
                let (least, greatest) = column(c);
                let slack = 1e-12 * mean.min.abs().max(mean.max.abs());
                let span = 2e-2 * (mean.max - mean.min) + slack;
                assert!(
                    mean.min <= least + slack && mean.min >= least - span,
                    "{file} {name} {} {least}",
                    mean.min
                );
                assert!(
                    mean.max >= greatest - slack && mean.max <= greatest + span,
                    "{file} {name} {} {greatest}",
                    mean.max
                );
            }
        }
    }
}

/// Without controlled sources, and without a jump at the start.
const BALANCED: [&str; 14] = [
    "boost.cir",
    "bt-fig-2-2-steps.cir",
    "capacitor-loop.cir",
    "clamp.cir",
    "cuk.cir",
    "flyback.cir",
    "isolated-rectifier.cir",
    "jump-clamp.cir",
    "jump-inductors.cir",
    "jump-capacitors.cir",
    "peak-detector.cir",
    "rlc.cir",
    "scr-bridge.cir",
    "three-phase-rectifier.cir",
];

#[test]
fn powers_add_up_to_the_energy_balance() {
    for file in BALANCED {
        let model = Model::load(
            format!("netlists/{file}"),
            circ::ElaborateOptions::default(),
        );
        let model = model.expect(file);
        let tran = model.circuit().tran.map(|tran| circ::circuit::Tran {
            tstart: 0.0,
            ..tran
        });
        let circuit = circ::Circuit {
            tran,
            ..model.circuit().clone()
        };
        let model = Model::of_circuit(circuit).expect(file);
        let energy = model.transient(SimOptions::default()).expect(file).energy;
        let table = table(&model, &TableOptions::default()).expect(file);
        let size = energy
            .source
            .abs()
            .max(energy.dissipated)
            .max(energy.stored.abs());
        let seconds = table.span.to - table.span.from;
        let input = table.power.input * seconds;
        assert!(
            (input - energy.source).abs() <= 1e-12 * size,
            "{file}: {input:e} {:e}",
            energy.source
        );
        // Into all elements together nothing goes but what jumps lose.
        let all: f64 = table.elements.iter().map(|element| element.power).sum();
        let lost = all * seconds + energy.jumps;
        assert!(lost.abs() <= 1e-12 * size, "{file}: {lost:e}");
    }
}

#[test]
fn a_battery_that_is_charged_is_no_input_and_what_is_stored_is_told() {
    let model = parsed(
        "charger\nv1 1 0 10\nr1 1 2 1\nv2 2 0 8\nr2 1 3 1k\nc1 3 0 1m\n.tran 1m uic\n.end\n",
    );
    let options = TableOptions {
        outputs: vec!["v2".into()],
        ..TableOptions::default()
    };
    let charged = table(&model, &options).expect("a table");
    assert_eq!(charged.power.inputs, ["v1"]);
    let efficiency = charged.power.efficiency.expect("an efficiency");
    assert!((0.79..0.8).contains(&efficiency), "{efficiency}");
    assert!(charged.notes.is_empty(), "{:?}", charged.notes);
    let filter =
        parsed("rc\nv1 1 0 10\nr1 1 2 1\nc1 2 0 1m\nr2 2 0 10\n.save i(r2)\n.tran 1m uic\n.end\n");
    let found = table(&filter, &TableOptions::default()).expect("a table");
    assert_eq!(found.notes.len(), 1);
    // v = V (1 − e^{−t/τ}) with V = 100/11 V and τ = 1/1.1 ms; the source delivers ∫ 10 V (10 V − v)/1 Ω dt.
    let (end, tau, t) = (100.0 / 11.0, 1e-3 / 1.1, 1e-3);
    let left = f64::exp(-1.1);
    let stored = 0.5 * 1e-3 * (end * (1.0 - left)).powi(2);
    let input = 10.0 * (10.0 * t - end * (t - tau * (1.0 - left)));
    let text = format!(
        "{:.1} % of the input went into capacitors",
        100.0 * stored / input
    );
    assert!(
        found.notes[0].text.starts_with(&text),
        "{text}: {:?}",
        found.notes
    );
}

#[test]
fn an_element_has_the_power_of_its_parts() {
    let table = table_of(
        "parts\nv1 d 0 10\nvg g s 10\nm1 d g s s n\nl1 s a 1m rser=1\nr1 a 0 4\n.model n nmos(vto=3 kp=1 rd=2)\n.tran 1m\n.end\n",
    );
    let power = |name: &str| table.element(name).expect(name).power;
    let conducts = power("m1.channel");
    assert!(conducts > 0.1);
    near(power("m1"), conducts + power("m1.body"), conducts);
    let (m1, channel) = (
        table.element("m1").unwrap(),
        table.element("m1.channel").unwrap(),
    );
    assert_eq!(m1.v, channel.v);
    // At rest an inductor takes what its resistance does.
    near(
        power("l1"),
        table.element("l1").unwrap().i.rms.powi(2),
        conducts,
    );
}

#[test]
fn a_run_in_steps_says_so() {
    let text = "rc\nv1 1 0 sin(0 1 50)\nr1 1 2 1k\nc1 2 0 1u\n.tran 0.1m 20m\n.end\n";
    let exact = table_of(text);
    let options = TableOptions {
        method: Method::Theta,
        ..TableOptions::default()
    };
    let steps = table(&parsed(text), &options).expect("a table");
    assert!(!steps.exact && steps.notes.len() == 1);
    for (a, b) in exact.elements.iter().zip(&steps.elements) {
        for (a, b) in [
            (a.i.rms, b.i.rms),
            (a.v.rms, b.v.rms),
            (a.v.max, b.v.max),
            (a.power, b.power),
        ] {
            assert!((a - b).abs() < 1e-4 * a.abs(), "{a:e} {b:e}");
        }
    }
}

/// 10 A change between a switch and a diode at 400 V, 100 kHz: E = 1 mJ at 400 V and 10 A and 25 °C, half as much again at 125 °C.
const COMMUTATION: &str = "commutation\nv1 a 0 400\ns1 a b g 0 sm\nd1 0 b dm\ni1 b 0 10\nvg g 0 pulse(0 5 0 0 0 4u 10u)\n\
    .model sm sw(ideal vt=2.5 rthjc=[0.1 0.1]\n+ vloss=[0 800] iloss=[0 20] tloss=[25 125] eon=[0 0 0 4u 0 0 0 6u] eoff=[0 0 0 8u 0 0 0 12u])\n\
    .model dm d(ideal vloss=400 iloss=10 err=2u)\n.tran 1u 1m\n.save v(b)\n";

/// What a device loses: counts and energies of turning on and off and of recovering.
fn lost(table: &Table, name: &str) -> [Option<(usize, f64)>; 3] {
    let losses = table.element(name).and_then(|e| e.losses.clone());
    let losses = losses.expect("losses");
    [losses.on, losses.off, losses.recovery].map(|l| l.map(|l| (l.count, l.energy)))
}

#[test]
fn a_switch_and_a_diode_lose_what_their_tables_say() {
    let text = COMMUTATION.replace(" rthjc=[0.1 0.1]", "");
    let table = table_of(&text);
    let [on, off, recovery] = lost(&table, "s1");
    let ((ons, on), (offs, off)) = (on.expect("on"), off.expect("off"));
    // From 0⁺ on, the edge of the end included. `.temp` is 27 °C.
    assert_eq!((ons, offs, recovery), (100, 100, None));
    near(on, 100.0 * 1e-6 * 1.01, 1e-6);
    near(off, 100.0 * 2e-6 * 1.01, 1e-6);
    let [none, neither, recovery] = lost(&table, "d1");
    assert_eq!((none, neither), (None, None));
    let (count, energy) = recovery.expect("recoveries");
    assert_eq!(count, 100);
    near(energy, 100.0 * 2e-6, 1e-6);
    let power = &table.power;
    near(power.switching.expect("tables"), 0.303 + 0.2, 1.0);
    // The edge at tstart is no part of what comes after it, the one at tstop is.
    let late = table_of(&text.replace(".tran 1u 1m", ".tran 1u 1m 0.5m"));
    assert_eq!(
        lost(&late, "s1").map(|l| l.map(|l| l.0)),
        [Some(50), Some(50), None]
    );
}

/// A current of 10 A that comes out of the load: the upper switch blocks 400 V and then leads it backwards, and so without loss.
#[test]
fn a_current_against_the_voltage_costs_nothing() {
    let text = "leg\nv1 a 0 400\ns1 a b g 0 sm\ns2 b 0 h 0 sm\ni1 0 b 10\nvg g 0 pulse(0 5 1u 0 0 4u 10u)\nvh h 0 pulse(5 0 1u 0 0 4u 10u)\n\
        .model sm sw(ron=1u roff=1g vt=2.5 vloss=400 iloss=10 eon=1u eoff=2u)\n.tran 1u 1m\n.save v(b)\n";
    let table = orbit_of(text, (&[], &[]));
    let energies = |name: &str| {
        lost(&table, name).map(|l| l.map(|(count, energy)| (count, (energy * 1e9).round())))
    };
    assert_eq!(energies("s1"), [Some((1, 0.0)), Some((1, 0.0)), None]);
    assert_eq!(energies("s2"), [Some((1, 1e3)), Some((1, 2e3)), None]);
}

/// A period of what switches at its ends has each change once: by a clock with a diode of an exponential law, and by hysteresis, whose orbit begins at an
/// event.
#[test]
fn what_changes_where_a_period_ends_changes_once() {
    let stepped = COMMUTATION
        .replace(" rthjc=[0.1 0.1]", "")
        .replace("d(ideal vloss", "d(is=1e-12 n=1 vloss")
        .replace("sw(ideal", "sw(ron=1m");
    let hysteresis = "hysteresis\nv1 a 0 12\ns1 a b 0 o sm\nd1 0 b dm\nl1 b o 100u\nc1 o 0 10u\nr1 o 0 5\n\
        .model sm sw(ron=1m vt=-5 vh=0.1 vloss=12 iloss=1 eon=1u eoff=1u)\n.model dm d(ideal err=1u)\n.tran 1u 5m\n.save v(o)\n";
    let regulators = (0..12).map(|k| {
        let henries = format!("l1 b o {}u", 100.0 + 7.3 * f64::from(k));
        (hysteresis.replace("l1 b o 100u", &henries), true)
    });
    for (text, exact) in regulators.chain([(stepped, false)]) {
        let table = orbit_of(&text, (&[], &[]));
        assert_eq!(table.exact, exact);
        let counts = |name: &str| lost(&table, name).map(|l| l.map(|(count, _)| count));
        assert_eq!(counts("s1"), [Some(1), Some(1), None], "{text}");
        assert_eq!(counts("d1"), [None, None, Some(1)], "{text}");
    }
}

/// T = 40 + 0.7 P_s + 0.5 P_d with P_s = 0.3 (1 + 0.005 (T_s − 25)) and P_d = 0.2.
#[test]
fn losses_and_temperatures_agree() {
    let sink = ".thermal hs s1 d1\nrh hs amb 0.5\nch hs 0 10\nvamb amb 0 40\n";
    let table = orbit_of(&format!("{COMMUTATION}{sink}"), (&[], &[]));
    assert!(table.exact, "{:?}", table.notes);
    let [on, off, _] = lost(&table, "s1");
    let [_, _, recovery] = lost(&table, "d1");
    let counts = [on, off, recovery].map(|l| l.expect("losses").0);
    assert_eq!(counts, [1, 1, 1]);
    let of = |name: &str| table.element(name).and_then(|e| e.losses.clone());
    let (s, d) = (of("s1").expect("s1"), of("d1").expect("d1"));
    let warm = (40.0 + 0.7 * 0.3 * (1.0 - 0.125) + 0.5 * 0.2) / (1.0 - 0.7 * 0.0015);
    near(s.temperature.expect("warm"), warm, 1.0);
    let power = 0.3 * (1.0 + 0.005 * (warm - 25.0));
    near(s.switching, power, 1.0);
    near(s.total, power, 1.0);
    let sink = 40.0 + 0.5 * (power + 0.2);
    near(d.temperature.expect("warm"), sink, 1.0);
    assert_eq!(table.temperatures[0].0, "hs");
    near(table.temperatures[0].1, sink, 1.0);
    // 2 MW/K is more than leaves.
    let steep = COMMUTATION.replace("0 0 0 6u]", "0 0 0 6]");
    let table = orbit_of(&steep, (&[], &[]));
    assert!(
        table
            .notes
            .iter()
            .any(|n| n.text.contains("thermal runaway"))
    );
    assert_eq!(
        table
            .element("s1")
            .and_then(|e| e.losses.clone())
            .expect("s1")
            .temperature,
        None
    );
}

/// A half bridge of MOSFETs with a dead time: the current of the load, 10 A out of it, flows through the body of the lower one in it, which recovers
/// when the upper one turns on; the lower one turns on and off without voltage.
#[test]
fn a_body_diode_recovers_and_its_channel_switches_softly() {
    let tables = "ron=0 rthjc=1 vloss=400 iloss=10 eon=1u eoff=2u err=4u";
    let text = format!(
        "leg\nv1 a 0 400\nm1 a g b b fet\nm2 b h 0 0 fet\ni1 b 0 10\nvg g b pulse(0 9 1u 0 0 4u 10u)\nvh h 0 pulse(9 0 0 0 0 6u 10u)\n\
         .model fet vdmos(vto=3 {tables})\n.tran 1u 1m\n.save v(b)\n"
    );
    for exact in [true, false] {
        let table = if exact {
            orbit_of(&text, (&[], &[]))
        } else {
            let options = TableOptions {
                method: Method::Theta,
                ..TableOptions::default()
            };
            let text = text.replace(".tran 1u 1m", ".tran 0.1u 10.5u");
            table(&parsed(&text), &options).expect("a table")
        };
        assert_eq!(table.exact, exact);
        let upper = lost(&table, "m1").map(|l| l.expect("tables"));
        let lower = lost(&table, "m2").map(|l| l.expect("tables"));
        assert_eq!(upper.map(|(count, _)| count), [1, 1, 0]);
        assert_eq!(lower.map(|(count, _)| count), [1, 1, 1]);
        for (energy, truth) in [upper[0].1, upper[1].1, lower[0].1, lower[1].1, lower[2].1]
            .into_iter()
            .zip([1e-6, 2e-6, 0.0, 0.0, 4e-6])
        {
            assert!((energy - truth).abs() < 1e-12, "{energy} {truth} {exact}");
        }
    }
}

/// Two diodes in parallel take 5 A each, where the table has a knee, and half the resistance to the case.
#[test]
fn devices_in_parallel_share_current_and_heat() {
    let one = "d1 0 b dm\n";
    let text = COMMUTATION.replace(
        "vloss=400 iloss=10 err=2u",
        "vloss=400 iloss=[0 5 20] err=[0 1u 10u] rthjc=8",
    );
    for (card, energy, kelvin) in [(one, 4e-6, 0.4 * 8.0), ("d1 0 b dm 2\n", 2e-6, 0.2 * 4.0)] {
        let table = orbit_of(&text.replace(one, card), (&[], &[]));
        let losses = table
            .element("d1")
            .and_then(|e| e.losses.clone())
            .expect("d1");
        near(losses.recovery.expect("a recovery").energy, energy, 1e-6);
        near(losses.temperature.expect("warm"), 27.0 + kelvin, 1.0);
    }
}
