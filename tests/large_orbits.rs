//! Periodic steady states by products in sparse steps: against those by dense matrices on circuits that both master, and what is said where there is none.
#![allow(missing_docs, reason = "tests")]

use std::fmt::Write as _;

use circ::Model;
use circ::analysis::{
    PeriodicOptions, SensitivityOptions, SmallSignalOptions, orbit_start, periodic,
    periodic_measured, periodic_table, sensitivity, small_signal,
};
use circ::circuit::ElaborateOptions;
use circ::integrate::{Orbit, Reason, Run, SimOptions, Standing};
use circ::settings::Settings;

fn model(text: &str) -> Model {
    Model::parse(text, "orbit.cir").unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Sparse steps whatever the size.
fn options() -> PeriodicOptions<'static> {
    let settings = Settings {
        large: 0,
        ..Settings::default()
    };
    PeriodicOptions {
        settings,
        ..PeriodicOptions::default()
    }
}

/// What was made: returns, steps of each of them, products; nothing where matrices were dense.
fn work(run: &Run) -> Option<[u64; 3]> {
    let word = run
        .plan
        .iter()
        .find(|word| word.starts_with("orbit by products"))?;
    let digits = |c: char| !c.is_ascii_digit();
    let numbers = word.split(digits).filter_map(|part| part.parse().ok());
    Some(
        numbers
            .collect::<Vec<u64>>()
            .try_into()
            .expect("three counts"),
    )
}

fn found(text: &str, options: &PeriodicOptions<'_>) -> (Orbit, Run, Standing) {
    let model = model(text);
    let (orbit, run) = periodic(&model, options).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let (_, standing) = orbit_start(&model, options).expect("the same orbit");
    (orbit, run, standing)
}

/// Sparse and dense orbits of a circuit agree: rows and states to what the sparse one states, multipliers to 1e-4; at most so many products are made.
fn agree(text: &str, products: u64) -> (Orbit, Run) {
    let (exact, dense, place) = found(text, &PeriodicOptions::default());
    let (orbit, run, standing) = found(text, &options());
    assert_eq!(work(&dense), None);
    let [returns, steps, made] = work(&run).expect("an orbit by products");
    let stated = run.error.max.expect("a stated error");
    assert!(stated < 1e-4, "{stated:e}\n{text}");
    let units: Vec<bool> = model(text)
        .multiport()
        .storage
        .iter()
        .map(|s| s.capacitor)
        .collect();
    for unit in [true, false] {
        let states = place.state.iter().zip(&standing.state).zip(&units);
        let states = states.filter(|(_, u)| **u == unit).map(|(pair, _)| pair);
        let size = states.clone().fold(1e-12_f64, |m, (a, _)| m.max(a.abs()));
        let apart = states.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(
            apart <= stated * size,
            "{apart:e} of {size:e}, {stated:e} stated\n{text}"
        );
    }
    let apart = distance(&dense, &run);
    assert!(
        apart <= stated,
        "rows: {apart:e}, {stated:e} stated\n{text}"
    );
    let [first, other] = [&exact, &orbit].map(|orbit| orbit.multipliers[0]);
    let apart = (first[0] - other[0]).hypot(first[1].abs() - other[1].abs());
    assert!(apart < 1e-4, "{first:?} {other:?}\n{text}");
    assert_eq!(
        (exact.stable, exact.period, exact.order),
        (orbit.stable, orbit.period, orbit.order)
    );
    assert!(orbit.residual < 1e-9, "{orbit:?}");
    assert!(
        made <= products,
        "{returns} returns of {steps} steps, {made} products\n{text}"
    );
    (orbit, run)
}

/// The largest distance of rows of the grid, over the largest value of each unit, but for those at edges, where one may be a left and the other a right limit.
fn distance(a: &Run, b: &Run) -> f64 {
    let (a, b) = (&a.waveforms, &b.waveforms);
    assert_eq!(a.time.len(), b.time.len());
    let columns = a.names.len();
    let size = |unit: &str| {
        let all = a.values.iter().enumerate();
        let own = all.filter(|(k, _)| a.units[k % columns] == unit);
        own.fold(1e-12_f64, |m, (_, v)| m.max(v.abs()))
    };
    let sizes = [size("V"), size("A")];
    let pairs = a.values.iter().zip(&b.values).enumerate();
    pairs.fold(0.0, |worst, (k, (x, y))| {
        let size = sizes[usize::from(a.units[k % columns] != "V")];
        worst.max((x - y).abs() / size)
    })
}

fn ladder(sections: usize, head: &str) -> String {
    let mut text = format!("ladder\n{head}\n");
    let farads = 1e-5 / sections as f64;
    for k in 0..sections {
        let next = k + 1;
        let _ = writeln!(
            text,
            "r{next} n{k} n{next} 10\nc{next} n{next} 0 {farads:e}"
        );
    }
    let _ = write!(
        text,
        "rend n{sections} 0 1k\n.tran 17u 2m\n.save v(n{}) v(n{sections})\n.end\n",
        sections / 2
    );
    text
}

/// Clocked bucks on one bus, each with values of its own.
fn bucks(count: usize, load: f64, diode: &str) -> String {
    let mut text = format!(
        "bucks\nvs src 0 48\nls src bus 1u\ncs bus 0 47u\nvc c 0 pulse(0 1 0 0 0 4u 10u)\n.model sw sw(vt=0.5 vh=0 ron=10m roff=1meg)\n.model dm d({diode})\n"
    );
    for k in 0..count {
        let f = 1.0 + 0.1 * k as f64;
        let _ = writeln!(
            text,
            "s{k} bus x{k} c 0 sw\nd{k} 0 x{k} dm\nl{k} x{k} o{k} {:e}\nc{k} o{k} 0 {:e}\nr{k} o{k} 0 {:e}",
            20e-6 * f,
            10e-6 / f,
            load * f
        );
    }
    text += ".tran 0.17u 100u\n.save v(bus) v(o0) i(l1)\n.end\n";
    text
}

#[test]
fn ladders_have_the_orbit_of_dense_matrices() {
    agree(&ladder(40, "v1 n0 0 pulse(0 10 0 1u 1u 0.4m 1m)"), 80);
    let rectifier = "v1 in 0 sin(0 10 1k)\nd1 in n0 dm\n.model dm d(ideal)\nrl n0 0 10k";
    agree(&ladder(40, rectifier), 80);
    // The edge of a source is a jump of charge in a capacitor at its end.
    agree(
        &ladder(30, "v1 n0 0 pulse(0 10 0 0 0 0.4m 1m)\ncin n0 0 1n"),
        80,
    );
}

/// In continuous and discontinuous conduction, and with forward drops: corrections change active sets.
#[test]
fn bucks_on_one_bus_have_the_orbit_of_dense_matrices() {
    agree(&bucks(6, 5.0, "ideal"), 250);
    agree(&bucks(6, 100.0, "ideal"), 250);
    agree(&bucks(4, 30.0, "ron=20m roff=1meg vfwd=0.7"), 250);
}

fn boost(load: &str) -> String {
    format!(
        "boost\nvin in 0 12\nl1 in x 100u\ns1 x 0 c 0 sw\nd1 x out dm\nc1 out 0 1000u\n{load}\nvc c 0 pulse(0 1 0 0 0 4u 10u)\n\
         .model sw sw(vt=0.5 vh=0 ron=20m roff=1meg)\n.model dm d(ideal)\n.tran 0.17u 100u uic\n.save v(out) i(l1)\n.end\n"
    )
}

/// A filter that forgets 2e-4 a period: thousands of periods of transient, a few products.
#[test]
fn a_slow_orbit_is_found_in_few_products() {
    let (orbit, _) = agree(&boost("r1 out 0 50"), 60);
    assert!(orbit.multipliers[0][0] > 0.999, "{orbit:?}");
    let (_, run) = agree(
        &bucks(3, 8.0, "ideal").replace("ls src", "rs src y 1\nl9 y"),
        250,
    );
    assert!(run.notes.iter().all(|note| note.code != "unstable-orbit"));
}

/// What closes after one period closes after two, with the squares of the multipliers.
#[test]
fn an_order_that_is_asked_for_is_the_orbit_of_so_many_periods() {
    let text = bucks(3, 5.0, "ideal");
    let (one, ..) = found(&text, &options());
    let two = PeriodicOptions {
        order: Some(2),
        ..options()
    };
    let (two, run, _) = found(&text, &two);
    assert!(work(&run).is_some());
    assert_eq!((two.order, two.period), (2, 2.0 * one.period));
    let [re, im] = one.multipliers[0];
    let squared = [re * re - im * im, 2.0 * re * im.abs()];
    let apart =
        (squared[0] - two.multipliers[0][0]).hypot(squared[1] - two.multipliers[0][1].abs());
    assert!(apart < 1e-5, "{one:?} {two:?}");
}

/// An RC with a negative conductance across C: v grows by e^{T/RC} a period around an orbit.
#[test]
fn an_unstable_orbit_is_told() {
    let text = "unstable\ni1 0 a sin(0 1m 1k)\nc1 a 0 1u\ng1 0 a a 0 0.2m\n.tran 17u 2m\n.end\n";
    let (orbit, run, _) = found(text, &options());
    assert!(work(&run).is_some() && !orbit.stable, "{orbit:?}");
    assert!(
        (orbit.multipliers[0][0] - 0.2_f64.exp()).abs() < 1e-6,
        "{orbit:?}"
    );
    assert!(run.notes.iter().any(|note| note.code == "unstable-orbit"));
}

/// The charge between two capacitors in series stays what it is.
#[test]
fn an_orbit_that_is_one_of_many_is_told() {
    let text = "shared\nv1 a 0 sin(0 1 1k)\nr1 a b 1k\nc1 b m 1u ic=2\nc2 m 0 1u\nr2 b 0 1k\nr3 b q 1k\nc3 q 0 1u\n.tran 17u 2m uic\n.end\n";
    let (orbit, run, _) = found(text, &options());
    assert!((orbit.multipliers[0][0] - 1.0).abs() < 1e-6, "{orbit:?}");
    let note = run
        .notes
        .iter()
        .find(|note| note.code == "orbit-not-unique");
    let note = note.unwrap_or_else(|| panic!("{:?}", run.notes));
    assert!(
        note.text.contains("v(c1), v(c2)") && !note.text.contains("c3"),
        "{}",
        note.text
    );
}

/// A capacitor that is charged in each period for good has no orbit: the search ends, and says what it saw.
#[test]
fn a_circuit_without_an_orbit_is_refused() {
    let text = "drift\ni1 0 a pulse(0 1m 0 0 0 0.5m 1m)\nc1 a 0 1u\nr1 a b 1k\nc2 b 0 1u\n.tran 17u 2m uic\n.end\n";
    let error = periodic(&model(text), &options()).expect_err("no orbit");
    assert!(matches!(error.reason, Reason::NoOrbit(_)), "{error}");
    let said = error.to_string();
    assert!(
        said.contains("by products") && said.contains("asked for"),
        "{said}"
    );
}

#[test]
fn a_period_that_is_none_is_refused() {
    let text = ladder(10, "v1 n0 0 pulse(0 10 0 1u 1u 0.4m 1m)");
    for (period, says) in [(1.5e-3, "no multiple"), (-1.0, "no period")] {
        let asked = PeriodicOptions {
            period: Some(period),
            ..options()
        };
        let error = periodic(&model(&text), &asked).expect_err("no period");
        assert!(error.to_string().contains(says), "{error}");
    }
}

/// Rows, tables, measurements and transients from the orbit on are those of other orbits in steps.
#[test]
fn what_follows_from_an_orbit_follows_from_this_one() {
    let rectifier = "v1 in 0 sin(0 10 1k)\nd1 in n0 dm\n.model dm d(ideal)\nrl n0 0 10k\n.meas tran top max v(n10)";
    let text = ladder(10, rectifier);
    let circuit = model(&text);
    let exact = PeriodicOptions::default();
    let (_, run) = periodic(&circuit, &options()).expect("an orbit");
    let columns = run.waveforms.names.len();
    let (first, last) = (
        &run.waveforms.values[..columns],
        &run.waveforms.values[run.waveforms.values.len() - columns..],
    );
    for (a, b) in first.iter().zip(last) {
        assert!((a - b).abs() < 1e-5, "{first:?} {last:?}");
    }
    assert_eq!(
        (
            run.waveforms.time[0],
            *run.waveforms.time.last().expect("rows")
        ),
        (0.0, 1e-3)
    );
    let [by_products, dense] = [&options(), &exact].map(|options| {
        let (_, _, found) = periodic_measured(&circuit, options).expect("an orbit");
        found.measured[0].result.as_ref().expect("a value").value
    });
    assert!(
        (by_products - dense).abs() < 1e-4 * dense.abs(),
        "{by_products} {dense}"
    );
    let table = |options| periodic_table(&circuit, (&[], &[]), options).expect("a table");
    let [by_products, dense] = [&options(), &exact].map(table);
    assert!(!by_products.exact && dense.exact);
    let [one, other] =
        [&by_products, &dense].map(|table| table.element("rend").expect("rend").power);
    assert!((one - other).abs() < 1e-4 * other, "{one} {other}");
    let (_, start) = orbit_start(&circuit, &options()).expect("an orbit");
    let run = circuit.transient(SimOptions {
        start: Some(start),
        settings: options().settings,
        ..SimOptions::default()
    });
    let run = run.expect("a transient");
    let rows: Vec<&[f64]> = run.waveforms.values.chunks_exact(columns).collect();
    let whole = rows.last().expect("rows");
    for (a, b) in rows[0].iter().zip(*whole) {
        assert!((a - b).abs() < 1e-3, "{a} {b}");
    }
}

/// A switch that follows the state is left to dense matrices, and so is a circuit below the limit: to the last bit.
#[test]
fn other_circuits_have_their_orbits_as_before() {
    let follows = "hysteresis\nv1 in 0 sin(0 10 1k)\nr1 in a 1k\nc1 a 0 0.1u\ns1 a b a 0 sw\nr2 b 0 1k\n.model sw sw(vt=2 vh=0.5 ron=1 roff=1meg)\n.tran 17u 2m\n.end\n";
    let model = model(follows);
    let [one, other] = [&options(), &PeriodicOptions::default()]
        .map(|options| periodic(&model, options).expect("an orbit").1);
    assert_eq!(work(&one), None);
    assert_eq!(one.waveforms.values, other.waveforms.values);
}

/// `CIRC_ORBITS='a.cir b.cir' cargo test --release --test large_orbits -- --ignored`: orbits of files agree with those of a tolerance 100 times as tight to what they state.
#[test]
#[ignore = "files from elsewhere, which may take long"]
fn orbits_of_files_are_those_of_a_tighter_tolerance() {
    let paths = std::env::var("CIRC_ORBITS").unwrap_or_default();
    for path in paths.split_whitespace() {
        let model = Model::load(path, ElaborateOptions::default()).expect("a circuit");
        let [(stated, loose), (_, tight)] = [1e-4, 1e-6].map(|tol| {
            let mut options = options();
            options.settings.tol = tol;
            let (_, run) = periodic(&model, &options).unwrap_or_else(|e| panic!("{path}: {e}"));
            let (_, standing) = orbit_start(&model, &options).expect("the same orbit");
            (run.error.max.expect("a stated error"), standing.state)
        });
        let units = model.multiport().storage.iter().map(|s| s.capacitor);
        let units: Vec<bool> = units.collect();
        for unit in [true, false] {
            let both = loose.iter().zip(&tight).zip(&units);
            let both = both.filter(|(_, u)| **u == unit).map(|(pair, _)| pair);
            let size = both.clone().fold(1e-12_f64, |m, (_, b)| m.max(b.abs()));
            let apart = both.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(
                apart <= stated * size,
                "{path}: {apart:e} of {size:e}, {stated:e}"
            );
        }
    }
}

/// The largest distance of a response in sparse steps from that of the exact orbit, relative to the largest value of each frequency, and what its note states.
fn response_apart(text: &str, sidebands: u16) -> (f64, f64) {
    let asked = SmallSignalOptions {
        sidebands,
        ..SmallSignalOptions::default()
    };
    let exact = small_signal(&model(text), &asked).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let asked = SmallSignalOptions {
        settings: options().settings,
        ..asked
    };
    let found = small_signal(&model(text), &asked).unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert_eq!(found.phasors.names, exact.phasors.names);
    let note = found.notes.iter().find(|note| note.code == "tangents");
    let words = note.expect("a stated error").text.split_whitespace();
    let words: Vec<&str> = words.collect();
    let at = words.windows(2).position(|pair| pair == ["response", "by"]);
    let stated: f64 = words[at.expect("a stated error") + 2]
        .parse()
        .expect("a number");
    let width = exact.phasors.names.len();
    let rows = exact.phasors.values.chunks(width);
    let apart = rows
        .zip(found.phasors.values.chunks(width))
        .map(|(exact, found)| {
            let size = exact.iter().fold(0.0_f64, |m, v| m.max(v.norm()));
            let both = exact.iter().zip(found);
            both.fold(0.0_f64, |m, (a, b)| m.max((a - b).norm())) / size
        });
    (apart.fold(0.0, f64::max), stated)
}

/// Inputs, controls by natural sampling, loads and sidebands, up to ten times the switching frequency; a rectifier, bucks in both kinds of conduction, switches on
/// common and on shifted clocks.
#[test]
fn responses_in_sparse_steps_are_those_of_exact_orbits() {
    let buck = |input: &str, control: &str, load: &str| {
        format!(
            "buck\nv1 1 0 dc 10 {input}\ns1 1 2 vc saw sw\ns2 2 0 saw vc sw\nl1 2 a 100u\nrl a 3 0.05\nrc 3 b 0.02\nc1 b 0 10u\nr1 3 0 5\ni1 0 3 dc 0 {load}\n\
             vc vc 0 dc 0.4 {control}\nvsaw saw 0 pulse(0 1 0 10u 1n 1n 10u)\n.model sw sw(vt=0 vh=0 ron=1m roff=1g)\n\
             .ac dec 2 100 1meg\n.save v(3) i(l1) v(2)\n.end\n"
        )
    };
    let rectifier = "rectifier\nv1 in 0 dc 0 ac 1 sin(0 10 1k)\nd1 in a d\nr0 a 0 1k\nr1 a b 10\nc1 b 0 1u\nl1 b c 1m\nc2 c 0 2u\nr2 c 0 300\n\
                     .model d d(ron=1m roff=1g vfwd=0.5)\n.ac dec 2 10 10k\n.save v(b) v(c)\n.end\n";
    let diode = |load: &str, control: &str| {
        format!(
            "buck with a diode\nv1 1 0 dc 10 ac 1\ns1 1 2 vc saw sw\nd1 0 2 d\nl1 2 3 20u\nc1 3 0 10u\nr1 3 0 {load}\n\
             vc vc 0 dc 0.4 {control}\nvsaw saw 0 pulse(0 1 0 9u 1u 1n 10u)\n.model sw sw(vt=0 vh=0 ron=1m roff=1g)\n.model d d(ron=1m roff=1g)\n\
             .ac dec 2 100 100k\n.save v(3) i(l1)\n.end\n"
        )
    };
    for (text, sidebands) in [
        (buck("ac 1", "", ""), 2),
        (buck("", "ac 1", ""), 1),
        (buck("ac 1", "ac 0.1 30", "ac 1"), 0),
        (rectifier.to_string(), 1),
        (diode("2", "ac 0.1"), 1),
        (diode("100", ""), 0),
        (diode("100", "ac 0.1"), 0),
    ] {
        let (apart, stated) = response_apart(&text, sidebands);
        assert!(
            stated < 1e-3 && apart <= 2.0 * stated,
            "{apart:e}, {stated:e} stated\n{text}"
        );
    }
}

/// A current that goes over from two diodes of a bridge to the others as it passes zero: multipliers and responses depend on how that instant moves, as does a response of a voltage that jumps where a current ends.
#[test]
fn instants_at_which_devices_change_move_with_the_state() {
    let bridge = "bridge behind an inductor\nv1 in 0 dc 0 ac 1 sin(0 10 1k)\nl1 in a 1m\nr1 a b 0.5\nd1 b p d\nd2 0 p d\nd3 n b d\nd4 n 0 d\nc1 p n 100u\nr2 p n 2\n\
                  .model d d(ideal)\n.tran 1u 1m\n.ac dec 2 10 10k\n.save v(p,n) i(l1) v(b)\n.end\n";
    agree(bridge, 40);
    let ended = "buck with a diode\nv1 1 0 dc 10 ac 1\ns1 1 2 g 0 sw\nd1 0 2 d\nl1 2 3 20u\nc1 3 0 10u\nr1 3 0 100\n\
                 vg g 0 pulse(0 1 0 10n 10n 4u 10u)\n.model sw sw(vt=0.5 vh=0 ron=1m roff=1meg)\n.model d d(ron=1m roff=1meg)\n\
                 .ac dec 2 100 100k\n.save v(2) v(3)\n.end\n";
    for text in [bridge, ended] {
        let (apart, stated) = response_apart(text, 0);
        assert!(
            stated < 1e-3 && apart <= 2.0 * stated,
            "{apart:e}, {stated:e} stated\n{text}"
        );
    }
}

/// A circuit that dense matrices do not master: its static response is what the means of orbits move by with the source, and its derivatives are told without them.
#[test]
fn the_orbit_of_many_elements_has_a_response_and_derivatives() {
    let stage = |k: usize| format!("r{k} n{} n{k} 1\nc{k} n{k} 0 10n\n", k - 1);
    let stages: String = (1..=1300).map(stage).collect();
    let text = |dc: f64| {
        format!(
            "ladder behind a rectifier\nv1 in 0 dc 0 ac 1 sin({dc} 10 1k)\nd1 in n0 ideal\n.model ideal d(n=0.001)\nr0 n0 0 1k\n{stages}.tran 1u 10m\n.ac list 1m\n.meas tran m avg v(n9)\n.save v(n9)\n.end\n"
        )
    };
    let own = model(&text(0.0));
    let response = small_signal(&own, &SmallSignalOptions::default()).expect("a response");
    let found = response.phasors.values[0];
    let mean = |dc: f64| {
        let (_, run, measured) =
            periodic_measured(&model(&text(dc)), &PeriodicOptions::default()).expect("an orbit");
        drop(run);
        measured.measured[0].result.as_ref().expect("a mean").value
    };
    let moved = (mean(0.01) - mean(-0.01)) / 0.02;
    assert!((found.re - moved).abs() < 1e-3 * moved, "{found} {moved}");
    let asked = |to: &[&str]| SensitivityOptions {
        steady: true,
        to: to.iter().map(ToString::to_string).collect(),
        ..SensitivityOptions::default()
    };
    let derivatives = sensitivity(&own, &asked(&[])).expect("derivatives");
    let found = derivatives.derivative("m", "r0").expect("a derivative");
    assert!(!derivatives.exact && derivatives.at.len() > 2600);
    let mean = |r0: f64| {
        let text = text(0.0).replace("r0 n0 0 1k", &format!("r0 n0 0 {r0}"));
        let (_, _, measured) =
            periodic_measured(&model(&text), &PeriodicOptions::default()).expect("an orbit");
        measured.measured[0].result.as_ref().expect("a mean").value
    };
    let moved = (mean(1010.0) - mean(990.0)) / 20.0;
    assert!((found - moved).abs() < 1e-3 * moved, "{found} {moved}");
}
