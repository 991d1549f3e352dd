//! Periodic steady states against closed forms, long transients and published bifurcations.
#![allow(missing_docs, reason = "tests")]

use std::path::Path;

use circ::analysis::{
    Measurements, Orbit, OrbitKind, PeriodicOptions, orbit_start, periodic, periodic_measured,
    transient,
};
use circ::integrate::Reason;
use circ::{Error, Method, Model, Run, SimOptions};

fn parsed(text: &str) -> Model {
    Model::parse(text, "t.cir").expect("a circuit")
}

fn orbit_of(text: &str) -> (Orbit, Run) {
    periodic(&parsed(text), &PeriodicOptions::default()).expect("an orbit")
}

fn refused(text: &str) -> Error {
    match periodic(&parsed(text), &PeriodicOptions::default()) {
        Err(error) => error,
        Ok((orbit, _)) => panic!("{orbit:?}"),
    }
}

/// A source that repeats every 20 µs has no orbit of 7 or 30 µs; of two tones without a common period one may be asked for, and a note says how far they are off.
#[test]
fn a_period_that_was_asked_for_is_one_of_the_sources() {
    let model =
        parsed("t\nv1 a 0 pulse(0 1 0 0 0 5u 20u)\nr1 a b 1k\nc1 b 0 1n\n.tran 1u 100u\n.end\n");
    let asked = |model: &Model, period| {
        let options = PeriodicOptions {
            period: Some(period),
            ..PeriodicOptions::default()
        };
        periodic(model, &options)
    };
    for period in [7e-6, 10e-6, 30e-6] {
        let error = asked(&model, period).expect_err("no period").to_string();
        assert!(error.contains("v1 repeats every 2e-5 s"), "{error}");
    }
    for period in [20e-6, 40e-6] {
        let (orbit, run) = asked(&model, period).expect("an orbit");
        assert!(
            orbit.period == period && run.notes.is_empty(),
            "{:?}",
            run.notes
        );
    }
    let tones = parsed(
        "t\nv1 a 0 sin(0 1 50)\nr1 a b 1k\nv2 b 0 sin(0 1 50.0001)\nc1 b a 1n\n.tran 1m 40m\n.end\n",
    );
    let (_, run) = asked(&tones, 20e-3).expect("an orbit");
    assert!(
        run.notes
            .iter()
            .any(|note| note.text.starts_with("v2 is 2e-6 of its period")),
        "{:?}",
        run.notes
    );
}

/// Supplies of LTspice's `startup` have risen in the steady state.
#[test]
fn supplies_that_ramp_up_at_the_start_have_risen() {
    let text = "t\nv1 a 0 5\nv2 g 0 pulse(0 1 0 0 0 5u 20u)\nr2 g 0 1\nr1 a b 1k\nc1 b 0 1n\n.tran 0 100u 0 1u startup\n.save v(b)\n.end\n";
    let (_, run) = orbit_of(text);
    assert!(
        (row(&run, 3)[0] - 5.0).abs() < 1e-12 && run.notes.is_empty(),
        "{:?}",
        run.notes
    );
}

fn size([re, im]: [f64; 2]) -> f64 {
    re.hypot(im)
}

/// The columns of a row.
fn row(run: &Run, at: usize) -> &[f64] {
    let columns = run.waveforms.names.len();
    &run.waveforms.values[at * columns..(at + 1) * columns]
}

/// Amplitudes of the columns.
fn amplitudes(run: &Run) -> Vec<f64> {
    let columns = run.waveforms.names.len();
    let mut largest = vec![0.0_f64; columns];
    for row in run.waveforms.values.chunks_exact(columns) {
        for (largest, value) in largest.iter_mut().zip(row) {
            *largest = largest.max(value.abs());
        }
    }
    largest
}

/// Converters and rectifiers, exact, whose transient is at the orbit in reasonable time.
const SETTLING: [&str; 30] = [
    "netlists/buck-open-loop.cir",
    "netlists/flyback.cir",
    "netlists/buck.cir",
    "netlists/cockcroft-walton.cir",
    "netlists/capacitor-loop.cir",
    "netlists/clamp.cir",
    "netlists/isolated-rectifier.cir",
    "netlists/isolated-rectifier-ideal.cir",
    "netlists/maffezzoni.cir",
    "netlists/maffezzoni-ideal.cir",
    "netlists/rectifier.cir",
    "netlists/rlc.cir",
    "netlists/scr-bridge.cir",
    "netlists/scr-commutation.cir",
    "netlists/three-half-wave.cir",
    "netlists/three-phase-rectifier.cir",
    "netlists/triac-dimmer.cir",
    "netlists/voltage-doubler.cir",
    "netlists/parallel-inverters.cir",
    "netlists/bridge-source.cir",
    "netlists/inductor-cut-set.cir",
    "tests/findings/aliased_rows.cir",
    "tests/findings/complementary_sin.cir",
    "tests/findings/dead_time.cir",
    "tests/findings/diodes_share.cir",
    "tests/findings/halfbridge_submodule_ideal.cir",
    "tests/findings/multiphase_buck_8.cir",
    "tests/findings/six_pulse_large_roff.cir",
    "tests/findings/bridge_starts.cir",
    "tests/findings/pvroff_2_1e12.cir",
];

/// The same text over so many periods, with a row for each.
fn over(text: &str, period: f64, periods: u32) -> String {
    let line = |line: &str| {
        if !line.to_lowercase().starts_with(".tran ") {
            return line.to_string();
        }
        let uic = if line.to_lowercase().contains("uic") {
            " uic"
        } else {
            ""
        };
        format!(".tran {period:e} {:e}{uic}", period * f64::from(periods))
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n") + "\n"
}

#[test]
fn an_orbit_is_where_a_long_transient_ends() {
    for name in SETTLING {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        let text = std::fs::read_to_string(&path).expect("a netlist");
        let (orbit, run) = orbit_of(&text);
        assert!(
            orbit.kind == OrbitKind::Driven && orbit.stable,
            "{name}: {orbit:?}"
        );
        assert!(orbit.residual <= 1e-12, "{name}: {:e}", orbit.residual);
        let largest = orbit.multipliers.first().map_or(0.0, |m| size(*m));
        assert!(largest < 0.99, "{name}: {largest}");
        // What is left of the start is below 1e-13, and twenty periods at least.
        let periods = (30.0 / -largest.max(1e-9).ln()).ceil().max(20.0) as u32;
        let long = parsed(&over(&text, orbit.period, periods));
        let long = long.transient(SimOptions::default()).expect("a transient");
        let last = row(&long, long.waveforms.time.len() - 1);
        let names = run.waveforms.names.iter().zip(amplitudes(&run));
        for ((name_of, amplitude), (a, b)) in names.zip(row(&run, 0).iter().zip(last)) {
            let apart = (a - b).abs() / amplitude.max(f64::MIN_POSITIVE);
            assert!(apart < 1e-9, "{name} {name_of}: {a} {b}");
        }
    }
}

/// Where the current is interrupted the return is curved: without Broyden's changes of an old derivative its corrections were seven.
#[test]
fn corrections_learn_from_what_they_left() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("netlists/buck-open-loop.cir");
    let text = std::fs::read_to_string(path).expect("a netlist");
    let (orbit, _) = orbit_of(&text);
    assert!(orbit.iterations <= 6, "{orbit:?}");
}

/// i rises from i₀ to i₁ = i₀ + V/L·DT at a constant v, and falls through a diode; with an ideal filter v is D·V, and the ripple of i
/// is V D(1 − D)T/L. Resistances 0: the multipliers are those of the filter alone, e^{AT} with A = [0, −1/L; 1/C, −1/(RC)].
#[test]
fn a_synchronous_buck_is_linear_between_its_edges() {
    let text = "buck\nv1 1 0 10\ns1 1 2 g 0 sw\ns2 2 0 0 g inv\nl1 2 3 100u\nc1 3 0 100u\nr1 3 0 5\n\
                vg g 0 pulse(0 1 0 0 0 4u 10u)\n.model sw sw(vt=0.5 vh=0 ron=0 ideal=1)\n\
                .model inv sw(vt=-0.5 vh=0 ron=0 ideal=1)\n.tran 0.1u 10u\n.end\n";
    let (orbit, run) = orbit_of(text);
    let (l, c, r, t) = (1e-4, 1e-4, 5.0, 1e-5);
    let (half, square): (f64, f64) = (-1.0 / (2.0 * r * c), 1.0 / (l * c));
    let frequency = (square - half * half).sqrt();
    let (size_of, angle) = ((half * t).exp(), frequency * t);
    for (found, sign) in orbit.multipliers.iter().zip([1.0, -1.0]) {
        assert!((found[0] - size_of * angle.cos()).abs() < 1e-6, "{orbit:?}");
        assert!(
            (found[1] - sign * size_of * angle.sin()).abs() < 1e-6,
            "{orbit:?}"
        );
    }
    let mean = |name: &str| {
        let at = run
            .waveforms
            .names
            .iter()
            .position(|n| n == name)
            .expect("a column");
        let columns = run.waveforms.names.len();
        let values: Vec<f64> = run
            .waveforms
            .values
            .iter()
            .skip(at)
            .step_by(columns)
            .copied()
            .collect();
        let steps = values.len() - 1;
        values.windows(2).map(|w| 0.5 * (w[0] + w[1])).sum::<f64>() / steps as f64
    };
    // The mean of v(2) is D V, and no voltage stands across the inductor on average.
    assert!((mean("v(3)") - 4.0).abs() < 1e-6, "{}", mean("v(3)"));
}

/// The voltage-mode buck of E. Fossas, G. Olivar, Study of chaos in the buck converter, IEEE Trans. Circuits and Systems I 43 (1996): L = 20 mH,
/// C = 47 µF, R = 22 Ω, T = 400 µs, ramp 3.8 V to 8.2 V, gain 8.4, reference 11.3 V.
fn voltage_mode_buck(vin: f64, order: Option<usize>) -> Orbit {
    let text = format!(
        "* t\nv1 1 0 {vin}\ns1 1 2 ramp co sw\nd1 0 2 d\nl1 2 3 20m\nc1 3 0 47u ic=11\nr1 3 0 22\n\
         b1 co 0 v=8.4*(v(3)-11.3)\nvr ramp 0 pulse(3.8 8.2 0 400u 0 0 400u)\n.model d d(ideal)\n\
         .model sw sw(vt=0 vh=0 ron=0 ideal=1)\n.tran 1u 40m uic\n.end\n"
    );
    let options = PeriodicOptions {
        order,
        ..PeriodicOptions::default()
    };
    periodic(&parsed(&text), &options).expect("an orbit").0
}

/// Its orbit of one period loses its stability at 24.5 V by a doubling of the period, that of two at 31.1 V.
#[test]
fn a_voltage_mode_buck_doubles_its_period_where_it_is_known_to() {
    for (vin, order) in [
        (22.0, 1),
        (24.5, 1),
        (24.53, 2),
        (30.0, 2),
        (31.0, 2),
        (31.2, 4),
    ] {
        let orbit = voltage_mode_buck(vin, None);
        assert!(orbit.stable && orbit.order == order, "{vin} V: {orbit:?}");
        assert!(orbit.residual <= 1e-12, "{vin} V: {orbit:?}");
    }
    for vin in [26.0, 33.0] {
        let first = voltage_mode_buck(vin, Some(1));
        assert!(
            !first.stable && first.multipliers[0][0] < -1.2,
            "{vin} V: {first:?}"
        );
        // Between events the divergence is −1/(RC), and no event changes a volume: det M = e^{−T/(RC)}.
        let product = first.multipliers[0][0] * first.multipliers[1][0];
        let expected = (-400e-6_f64 / (22.0 * 47e-6)).exp();
        assert!((product - expected).abs() < 1e-6, "{product} {expected}");
    }
}

/// The current and voltage of `netlists/small-signal/current-mode.cir` one clock period later: the current rises to its peak while the capacitor discharges,
/// then both follow a damped oscillation about the input voltage.
fn current_mode_map(peak: f64, [i0, v0]: [f64; 2]) -> [f64; 2] {
    let (vin, l, c, r, period) = (10.0, 1e-3, 12e-6, 20.0, 1e-4);
    let on = l * (peak - i0) / vin;
    let (alpha, t) = (1.0 / (2.0 * r * c), period - on);
    let omega = (1.0 / (l * c) - alpha * alpha).sqrt();
    let (di, dv) = (peak - vin / r, v0 * (-on / (r * c)).exp() - vin);
    let (sin, cos) = (omega * t).sin_cos();
    let decay = (-alpha * t).exp();
    [
        vin / r + decay * (di * cos + (alpha * di - dv / l) / omega * sin),
        vin + decay * (dv * cos + (di / c - alpha * dv) / omega * sin),
    ]
}

/// Its period doubles at a peak of 1.7 A, and again; the multipliers of the orbit of one period are the eigenvalues of the map's derivative.
#[test]
fn a_current_mode_boost_has_the_multipliers_of_its_map() {
    let netlist = include_str!("../netlists/small-signal/current-mode.cir");
    for (peak, order) in [(1.0, 1), (1.6, 1), (2.0, 2), (2.5, 4)] {
        let text = netlist.replace(".param ipk=1", &format!(".param ipk={peak}"));
        let (stable, _) = orbit_of(&text);
        assert_eq!((stable.order, stable.stable), (order, true), "{peak} A");
        let options = PeriodicOptions {
            order: Some(1),
            ..PeriodicOptions::default()
        };
        let (orbit, run) = periodic(&parsed(&text), &options).expect("an orbit");
        let at = |name: &str| {
            let column = run.waveforms.names.iter().position(|n| n == name);
            row(&run, 0)[column.expect("a signal")]
        };
        // The comparator has 1 µV of hysteresis.
        let (peak, start) = (peak + 1e-6, [at("i(l1)"), at("v(out)")]);
        let after = current_mode_map(peak, start);
        for (a, b) in after.iter().zip(start) {
            assert!(
                (a - b).abs() < 1e-11 * b,
                "{peak} A: {start:?} to {after:?}"
            );
        }
        let column = |j: usize| {
            let h = 1e-5 * start[j];
            let ends = [-h, h].map(|h| {
                let mut moved = start;
                moved[j] += h;
                current_mode_map(peak, moved)
            });
            [0, 1].map(|k| (ends[1][k] - ends[0][k]) / (2.0 * h))
        };
        let [[a, c], [b, d]] = [column(0), column(1)];
        let (half, product) = (0.5 * (a + d), a * d - b * c);
        let root = (half * half - product).sqrt();
        let mut expected = [half - root, half + root];
        expected.sort_by(|x, y| y.abs().total_cmp(&x.abs()));
        for (found, expected) in orbit.multipliers.iter().zip(expected) {
            assert!(
                (found[0] - expected).abs() < 1e-8,
                "{peak} A: {orbit:?}, {expected}"
            );
        }
    }
}

/// A capacitor is charged through 10 kΩ to 7 V, and discharged to 3 V through 100 Ω: T = Σ τ ln((V∞ − V₀)/(V∞ − V₁)).
#[test]
fn a_relaxation_oscillator_has_the_period_of_its_closed_form() {
    let text = "* t\nv1 1 0 10\nr1 1 2 10k\nc1 2 0 1u ic=0\ns1 2 3 2 0 sw\nr2 3 0 100\n\
                .model sw sw(vt=5 vh=2 ron=0 ideal=1)\n.tran 1u 50m uic\n.end\n";
    let (orbit, run) = orbit_of(text);
    let (slow, fast) = (1e-2_f64, 1e-6 / (1e-4 + 1e-2));
    let rest: f64 = 10.0 * 100.0 / 10_100.0;
    let expected = slow * (7.0_f64 / 3.0).ln() + fast * ((7.0 - rest) / (3.0 - rest)).ln();
    assert_eq!(orbit.kind, OrbitKind::Autonomous);
    assert!(
        (orbit.period / expected - 1.0).abs() < 1e-12,
        "{} {expected}",
        orbit.period
    );
    assert_eq!(run.waveforms.time.last(), Some(&orbit.period));
    // The one multiplier is trivial.
    assert!(
        orbit.multipliers.is_empty() && orbit.section.is_some(),
        "{orbit:?}"
    );
}

/// A tank that rings down through a diode has events without end, and no orbit but its rest.
/// A buck whose switch has hysteresis: its transient's off times approach that of the orbit by 0.057 from period to period. Rounding puts the
/// event that closes the orbit right behind the end of the run that is made again for its derivative.
#[test]
fn a_hysteretic_buck_is_stable_and_its_multiplier_is_that_of_its_transient() {
    let buck = |uic: &str| {
        format!(
            "hysteretic buck\nv1 in 0 24\ns1 in sw ref out swm\nd1 0 sw di\nl1 sw out 47u ic=0\nc1 out 0 100u ic=0 rser=20m\nr1 out 0 4\nvref ref 0 5\n\
             .model swm sw(ron=10m roff=1meg vt=0 vh=20m)\n.model di d(ron=10m vfwd=0.4 roff=1meg)\n.tran 1u 1m {uic}\n.end\n"
        )
    };
    let (orbit, _) = orbit_of(&buck(""));
    let largest = size(orbit.multipliers[0]);
    assert!(orbit.stable, "{orbit:?}");
    let run = parsed(&buck("uic"))
        .transient(SimOptions::default())
        .expect("a run");
    let moves: Vec<(f64, bool)> = (run.events.iter())
        .flat_map(|event| event.changes.iter().map(move |change| (event.t, change)))
        .filter_map(|(t, change)| match change {
            circ::integrate::Change::Switch { on, .. } => Some((t, *on)),
            _ => None,
        })
        .collect();
    let off: Vec<f64> = (moves.windows(2))
        .filter(|pair| !pair[0].1)
        .map(|pair| pair[1].0 - pair[0].0)
        .collect();
    // From the third on the approach is geometric until rounding is seen.
    let ratio = (off[5] - off[4]) / (off[4] - off[3]);
    assert!(
        (largest / ratio.abs() - 1.0).abs() < 1e-2,
        "{largest} and {ratio}: {:?}",
        &off[..8]
    );
}

#[test]
fn what_rings_down_is_at_rest() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("netlists/bridge-resistor.cir");
    let model = Model::load(path, circ::ElaborateOptions::default()).expect("a netlist");
    let (orbit, _) = periodic(&model, &PeriodicOptions::default()).expect("its rest");
    assert!(
        orbit.kind == OrbitKind::Equilibrium && orbit.stable,
        "{orbit:?}"
    );
}

/// A capacitor that nothing charges keeps what it has.
#[test]
fn what_is_not_unique_is_named() {
    let text = "* t\nv1 1 0 sin(0 1 1k)\nr1 1 2 1k\nc1 2 0 1u\nc2 3 0 1u ic=5\nr3 3 4 1\nc4 4 0 1u ic=1\n.tran 1u 1m uic\n.end\n";
    let (_, run) = orbit_of(text);
    let told = run
        .notes
        .iter()
        .find(|note| note.text.contains("not unique"));
    let told = told.expect("a note").text.clone();
    assert!(
        told.contains("v(c2)") && told.contains("v(c4)") && !told.contains("v(c1)"),
        "{told}"
    );
}

/// The charge of an isolated capacitor, and what the steps of exponential diodes leave open, concern a run that begins on the orbit as well.
#[test]
fn a_run_that_begins_on_an_orbit_tells_what_is_not_known_of_it() {
    let begun = |text: &str| {
        let model = parsed(text);
        let (_, start) = orbit_start(&model, &PeriodicOptions::default()).expect("an orbit");
        let off = start.off;
        let options = SimOptions {
            start: Some(start),
            ..SimOptions::default()
        };
        (off, model.transient(options).expect("a run"))
    };
    let (off, run) = begun(
        "* t\nv1 1 0 sin(0 1 1k)\nr1 1 2 1k\nc1 2 0 1u\nc2 3 0 1u ic=5\nr3 3 4 1\nc4 4 0 1u ic=1\n.tran 1u 1m uic\n.end\n",
    );
    let told = run.notes.iter().any(|note| note.code == "orbit-not-unique");
    assert!(told && off == 0.0, "{off:e} {:?}", run.notes);
    let (off, run) = begun(
        "* t\nv1 1 0 sin(0 10 1k)\nd1 1 2 d\nc1 2 0 10u\nr1 2 0 1k\n.model d d(is=1e-12)\n.tran 1u 20u\n.end\n",
    );
    assert!(off > 0.0 && off < 1e-4, "{off:e}");
    assert!(
        run.error.max.is_some_and(|error| error >= off),
        "{off:e} {:?}",
        run.error
    );
}

#[test]
fn what_has_no_orbit_is_refused_with_a_reason() {
    let no_orbit = |error: &Error| matches!(error.reason, Reason::NoOrbit(_));
    // A tank driven at its resonance, and a source that charges a capacitor.
    let w = 1.0 / (2.0 * std::f64::consts::PI);
    for text in [
        format!("* t\nv1 1 0 sin(0 1 {w:e})\nl1 1 2 1\nc1 2 0 1\n.tran 0.1 50 uic\n.end\n"),
        "* t\ni1 0 1 pulse(0 1m 0 0 0 1u 10u)\nc1 1 0 1u\n.tran 1u 1m uic\n.end\n".to_string(),
        "* t\nv1 1 0 sin(0 1 50)\nr1 1 0 1\nv2 2 0 sin(0 1 50.0001)\nr2 2 0 1\n.tran 1m 1\n.end\n".to_string(),
        "* t\nv1 1 0 sin(0 1 1k)\nr1 1 2 50\nt1 2 0 3 0 z0=50 td=1u\nr2 3 0 70\n.tran 1u 1m\n.end\n".to_string(),
    ] {
        let error = refused(&text);
        assert!(no_orbit(&error), "{text}{error}");
    }
}

/// A buck with an exponential diode: its orbit differs from a long transient at a tolerance of 1e-9 by no more than it
/// states.
#[test]
fn an_orbit_of_steps_states_how_far_it_is_off() {
    let text = "* t\nv1 1 0 10\ns1 1 2 g 0 sw\nd1 0 2 d\nl1 2 3 20u\nc1 3 0 500n\nr1 3 0 3\n\
                vg g 0 pulse(0 1 0 0 0 4u 10u)\n.model sw sw(vt=0.5 vh=0 ron=0.1 roff=1meg)\n.model d d(is=1n n=1)\n\
                .tran 0.1u 10u\n.end\n";
    let (orbit, run) = orbit_of(text);
    let largest = orbit.multipliers.first().map_or(0.0, |m| size(*m));
    assert!(orbit.stable && largest < 0.9, "{orbit:?}");
    let long = parsed(&over(text, orbit.period, 20));
    let options = SimOptions {
        unestimated: true,
        settings: circ::settings::Settings {
            tol: 1e-9,
            ..circ::settings::Settings::default()
        },
        ..SimOptions::default()
    };
    let long = long.transient(options).expect("a transient");
    let last = row(&long, long.waveforms.time.len() - 1);
    let stated = run.error.max.expect("an error");
    assert!(stated < 1e-3, "{stated:e}");
    for ((name, amplitude), (a, b)) in
        (run.waveforms.names.iter().zip(amplitudes(&run))).zip(row(&run, 0).iter().zip(last))
    {
        let apart = (a - b).abs() / amplitude.max(f64::MIN_POSITIVE);
        assert!(apart <= stated, "{name}: {a} {b}, {apart:e} of {stated:e}");
    }
}

/// Measures see the orbit as a transient that began on it long ago.
#[test]
fn measurements_of_an_orbit_are_those_of_a_settled_transient() {
    let text = "rc\nv1 1 0 pulse(0 10 0 0 0 0.5m 1m)\nr1 1 2 1k\nc1 2 0 1u\n.tran 10u 40.25m\n.save v(2)\n\
        .meas tran mean avg v(2) from=20m to=30m\n.meas tran quarter find v(2) at=30.25m\n\
        .meas tran rise trig v(2) val=5 rise=1 td=30m targ v(2) val=5 rise=2 td=30m\n\
        .meas tran late when v(2)=5 fall=last\n.meas tran high max v(2)\n.four 1k v(2)\n.end\n";
    let model = parsed(text);
    let (_, run, found) = periodic_measured(&model, &PeriodicOptions::default()).expect("an orbit");
    let grid = run.kinds.iter().filter(|kind| kind.is_grid());
    assert_eq!((grid.count(), run.waveforms.names.len()), (101, 1));
    let settled = transient(&model, SimOptions::default());
    let (_, settled) = settled.run.expect("a run");
    let value =
        |found: &Measurements, k: usize| found.measured[k].result.clone().expect("a value").value;
    for k in 0..4 {
        let (orbit, transient) = (value(&found, k), value(&settled, k));
        // A transient that ends in the middle of a period has its last crossing there.
        let apart = if k == 3 {
            orbit - transient - 1e-3 * ((orbit - transient) / 1e-3).round()
        } else {
            orbit - transient
        };
        assert!(
            apart.abs() < 2e-6 * transient,
            "{k}: {orbit:e} {transient:e}"
        );
    }
    let swing = 5.0 * 0.25_f64.tanh();
    assert!((value(&found, 4) - 5.0 - swing).abs() < 1e-12);
    assert!((value(&found, 0) - 5.0).abs() < 1e-6);
    let mean = found.harmonics[0].result.clone().expect("harmonics").mean;
    assert!((mean - 5.0).abs() < 1e-6);
}

/// 500 carriers in a period: 2000 rows in all would be four to each of them.
#[test]
fn measurements_of_an_orbit_see_the_carrier_of_a_modulator() {
    let text = "class d\nva in 0 sin(0 0.7 500)\nvt tri 0 pulse(-1 1 0 2u 2u 0 4u)\ne1 sw 0 value={if(v(in)>v(tri),30,-30)}\nl1 sw out 22u\n\
                c1 out 0 1u\nrl out 0 4\n.tran 100u 4m 2m\n.meas pout avg v(out)*i(rl)\n.end\n";
    let model = circ::Model::parse(text, "d.cir").expect("a circuit");
    let options = circ::analysis::PeriodicOptions::default();
    let (_, _, found) = circ::analysis::periodic_measured(&model, &options).expect("an orbit");
    let table = circ::analysis::periodic_table(&model, (&[], &[]), &options).expect("a table");
    let (rows, exact) = (
        found.measured[0].result.as_ref().expect("a value").value,
        table.element("rl").expect("a load").power,
    );
    assert!((rows / exact - 1.0).abs() < 5e-4, "{rows} of {exact}");
}

/// A capacitor is charged by 1 mA and discharged by 2 mA between ±1 V, about. What follows it through 10 kΩ and 2 µF forgets by e^{−T/τ} from one
/// return to the next: the derivative of a return that ends with an event has more digits than differences of returns, 1e-8.
#[test]
fn the_multiplier_of_what_follows_an_oscillator_is_its_decay() {
    let text = "* t\nv1 1 0 10\nv2 4 0 -30\nr1 1 2 10k\nc1 2 0 1u ic=0\ns1 2 3 2 0 sw\nr2 3 4 10k\ne1 5 0 2 0 1\nr3 5 6 10k\nc2 6 0 2u ic=0\n\
                .model sw sw(vt=0 vh=1 ron=0 ideal=1)\n.tran 1u 50m uic\n.end\n";
    let (orbit, _) = orbit_of(text);
    let expected = (-orbit.period / 20e-3).exp();
    let [found] = orbit.multipliers[..] else {
        panic!("{orbit:?}");
    };
    assert!(
        (found[0] / expected - 1.0).abs() < 1e-12,
        "{found:?} {expected}"
    );
}

/// The second phase is on beyond the end of its period, and so it is at t = 0, before its delay: the run that starts on the orbit is on it from the first period on, exactly and in steps.
#[test]
fn phases_have_begun_before_a_run_that_starts_on_the_orbit() {
    let text = |steady: &str| {
        format!(
            "two phases\nvin in 0 24\nva ga 0 pulse(0 1 0 10n 10n 4u 10u)\nvb gb 0 pulse(0 1 7.5u 10n 10n 4u 10u)\n\
            s1 in a ga 0 sw\nd1 0 a d\nl1 a out 100u\ns2 in b gb 0 sw\nd2 0 b d\nl2 b out 100u\nc1 out 0 20u\nr1 out 0 2\n\
            vstep x 0 pwl(0 0 1m 0 1.1m 1)\nrx x 0 1\n.model sw sw(vt=0.5 ron=10m roff=10meg)\n.model d d(ideal)\n.tran 1u 0.1m{steady}\n\
            .meas tran first avg i(l2) from=0 to=10u\n.meas tran high max i(l2) from=0 to=10u\n.meas tran last avg i(l2) from=90u to=100u\n.meas tran top max i(l2) from=90u to=100u\n.end\n"
        )
    };
    let model = parsed(&text(""));
    let (_, start) = orbit_start(&model, &PeriodicOptions::default()).expect("an orbit");
    assert_eq!(start.begun, 1e-5);
    let (_, _, orbit) = periodic_measured(&model, &PeriodicOptions::default()).expect("an orbit");
    let card = parsed(&text(" steady"));
    for (model, method, close) in [
        (&model, Method::Exact, 1e-10),
        (&card, Method::Exact, 1e-10),
        (&model, Method::Theta, 2e-3),
    ] {
        let start = (!std::ptr::eq(model, &card)).then(|| start.clone());
        let options = SimOptions {
            method,
            start,
            ..SimOptions::default()
        };
        let finished = transient(model, options);
        let (_, found) = finished
            .run
            .filter(|_| finished.error.is_none())
            .expect("a run");
        for (own, exact) in found.measured.iter().zip(&orbit.measured) {
            let [own, exact] = [own, exact].map(|m| m.result.as_ref().expect(&m.name).value);
            assert!(
                (own - exact).abs() <= close * exact,
                "{method:?}: {own} {exact}"
            );
        }
    }
}

/// A clock sets a switch that a comparator of its current resets. At the level both contradict each other while the clock is high, and the switch slides; behind the clock's slope it is off, and
/// the current falls.
#[test]
fn a_switch_slides_no_longer_than_its_clock_asks_for_what_its_comparator_undoes() {
    let text = "latch\nv1 4 0 12\nv2 5 0 pulse(0 1 0 10n 10n 1u 10u)\ne1 8 0 3 2 1\nv3 6 0 0.36\nbq1 7 0 V=2*u(v(8,6))\ns1 4 1 5 7 m0\nd1 0 1 m1\n\
        l1 1 3 1.8m ic=0.12857142857142856\nr1 3 2 2.8\nc1 2 0 12u ic=7.2\nr2 2 0 56\n.model m0 sw(ron=5.6 roff=5.6e5 vt=0 vh=0.5)\n\
        .model m1 d(ron=5.6 vfwd=0.7 roff=5.6k)\n.tran 0.1u 10u uic\n\
        .meas tran held find i(l1) at=0.9u\n.meas tran later find i(l1) at=2.02u\n.meas tran slope deriv i(l1) at=1.1u\n.end\n";
    let finished = transient(&parsed(text), SimOptions::default());
    let (_, found) = finished.run.expect("a run");
    let [held, later, slope] = [0, 1, 2].map(|k| {
        let found = found.measured[k].result.as_ref();
        found.expect("a value").value
    });
    let level = 0.36 / 2.8;
    assert!((held - level).abs() < 1e-9 * level, "{held}");
    // v(1) = −0.7 − 5.6 i.
    let exact = (-0.7 - (5.6 + 2.8) * level - 7.2) / 1.8e-3;
    assert!((slope / exact - 1.0).abs() < 1e-2, "{slope} {exact}");
    assert!(
        (later - level - 1e-6 * exact).abs() < 1e-2 * 1e-6 * exact.abs(),
        "{later}"
    );
}

/// The current of a clamping diode that begins to conduct, 1e-5 A, is what two supplies of 5 V leave of 0.03 A each: their rounding was taken for its sign, steps took over
/// in the search for the orbit, and the rows ended 2e-4 of the amplitude from where they began, of which 3e-7 were stated.
#[test]
fn an_orbit_behind_supplies_that_add_up_to_nothing_closes() {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/findings/supplies_add_up_to_nothing.cir");
    let model = Model::load(path, circ::ElaborateOptions::default()).expect("a circuit");
    let options = PeriodicOptions {
        period: Some(3e-5),
        ..PeriodicOptions::default()
    };
    let (orbit, run) = periodic(&model, &options).expect("an orbit");
    let taken = run.notes.iter().find(|note| note.code == "steps-instead");
    assert!(orbit.stable && taken.is_none(), "{taken:?}");
    let last = run.waveforms.time.len() - 1;
    for (first, last) in row(&run, 0).iter().zip(row(&run, last)) {
        assert!((last - first).abs() < 1e-12, "{first} {last}");
    }
}

/// A buck that two comparators with hysteresis switch between 91.5 and 104.5 V takes 141 µs for a cycle: a run of 60 µs tells nothing of its period.
#[test]
fn an_orbit_may_be_longer_than_the_run_that_is_asked_for() {
    let text = "buck\nv1 3 0 325\nv2 4 0 98\ns1 3 1 4 2 m0\ns2 1 0 2 4 m0\nl1 1 2 2.1m\nc1 2 0 2.6u ic=48\nr1 2 0 19\n\
        .model m0 sw(ron=1.9m roff=190k vt=0 vh=6.5)\n.tran 3u TSTOP uic\n.end\n";
    let [short, long] = ["60u", "10m"].map(|stop| orbit_of(&text.replace("TSTOP", stop)).0);
    assert_eq!(short.kind, OrbitKind::Autonomous);
    assert!(
        (short.period / long.period - 1.0).abs() < 1e-9,
        "{short:?} {long:?}"
    );
    assert!((1.4e-4..1.42e-4).contains(&short.period));
}
