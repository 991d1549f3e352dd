//! Converters and rectifiers of all kinds (`tests/steady/`) reach their periodic steady state from rest without a hint, with ideal diodes and with exponential ones.
#![allow(missing_docs, reason = "tests")]

use std::path::Path;

use circ::analysis::{Orbit, OrbitKind, PeriodicOptions, periodic};
use circ::{Model, Run, SimOptions, Simulation};

/// Diodes as the files have them.
const IDEAL: &str = ".model d d(ron=10m roff=10meg)";
/// Straight lines near the exponential ones at currents of amperes.
const STRAIGHT: &str = ".model d d(ron=20m roff=1g vfwd=0.65)";
const EXPONENTIAL: &str = ".model d d(is=1e-12 n=1.05 rs=10m)";

/// Which take a machine minutes with exponential diodes, unoptimised: hundreds of switchings, or a search in vain, before the orbit is found.
const LONG: [&str; 3] = ["flyback-dcm", "pfc-boost", "twelve-pulse"];

/// Whose transients take seconds.
const QUICK: [&str; 7] = [
    "boost-ccm",
    "buck-ccm",
    "buck-esr",
    "buckboost",
    "clamp",
    "doubler",
    "halfwave-c",
];

fn decks() -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/steady");
    let files = std::fs::read_dir(folder).expect("a folder");
    let mut decks: Vec<(String, String)> = files
        .map(|file| {
            let path = file.expect("a file").path();
            let name = path.file_stem().expect("a name").to_string_lossy();
            let text = std::fs::read_to_string(&path).expect("a netlist");
            assert!(text.contains(IDEAL), "{name}");
            (name.into_owned(), text)
        })
        .collect();
    decks.sort();
    assert!(decks.len() >= 44, "{}", decks.len());
    decks
}

fn parsed(text: &str) -> Model {
    Model::parse(text, "t.cir").expect("a circuit")
}

fn orbit_of(name: &str, text: &str) -> (Orbit, Run) {
    let (orbit, run) = periodic(&parsed(text), &PeriodicOptions::default())
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    assert!(orbit.stable && orbit.order == 1, "{name}: {orbit:?}");
    (orbit, run)
}

fn size([re, im]: [f64; 2]) -> f64 {
    re.hypot(im)
}

/// The storage after so many periods of a transient, from the start that the file has.
fn settled(text: &str, period: f64, periods: f64, tol: f64) -> Vec<f64> {
    let tran = |line: &str| {
        let begins = line.starts_with(".tran ");
        let uic = if line.ends_with(" uic") { " uic" } else { "" };
        let (print, end) = (period / 10.0, period * periods);
        if begins {
            format!(".tran {print:e} {end:e}{uic}\n")
        } else {
            format!("{line}\n")
        }
    };
    let text: String = text.lines().map(tran).collect();
    let mut options = SimOptions::default();
    options.settings.tol = tol;
    let run = parsed(&text).transient(options).expect("a transient");
    run.storage
}

/// How far the storage of a settled transient is from where an orbit begins, by part of each or of a hundredth of the largest.
fn apart(orbit: &Run, settled: &[f64]) -> f64 {
    let all = orbit.storage.iter().zip(settled);
    let least = 1e-2 * all.clone().fold(0.0_f64, |m, (a, _)| m.max(a.abs()));
    let part = |(a, b): (&f64, &f64)| (a - b).abs() / a.abs().max(least);
    all.map(part).fold(0.0, f64::max)
}

/// The same by part of the amplitudes: the largest voltage of all nodes, the largest current of all inductors.
fn apart_of_amplitudes(text: &str, orbit: &Run, settled: &[f64]) -> f64 {
    let model = parsed(text);
    let simulation = Simulation::new(model.circuit(), model.multiport(), Default::default());
    let units = simulation.expect("a simulation").state_units().to_vec();
    let waves = &orbit.waveforms;
    let amplitude = |of: &str| {
        let columns = waves.names.iter().enumerate();
        let columns = columns.filter(|(_, name)| name.starts_with(of));
        let values = columns.flat_map(|(j, _)| waves.column(j));
        values.fold(0.0_f64, |m, value| m.max(value.abs()))
    };
    let [volts, amperes] = ["v(", "i(l"].map(amplitude);
    assert_eq!(settled.len(), units.len());
    let all = orbit.storage.iter().zip(settled).zip(units);
    let part = |((a, b), unit): ((&f64, &f64), &str)| {
        (a - b).abs() / if unit == "V" { volts } else { amperes }
    };
    all.map(part).fold(0.0, f64::max)
}

/// Periods after which this part is left of the start.
fn periods_until(part: f64, orbit: &Orbit) -> f64 {
    let largest = orbit.multipliers.first().map_or(0.0, |m| size(*m));
    (part.ln() / largest.max(1e-9).ln()).ceil().max(20.0)
}

#[test]
fn ideal_diodes_close_to_rounding_where_long_transients_end() {
    for (name, text) in decks() {
        let (orbit, run) = orbit_of(&name, &text);
        assert!(orbit.residual <= 1e-12, "{name}: {:e}", orbit.residual);
        let largest = orbit.multipliers.first().map_or(0.0, |m| size(*m));
        // What closes an orbit of its own begins at another time.
        if orbit.kind != OrbitKind::Driven || largest > 0.99 {
            continue;
        }
        let periods = periods_until(1e-13, &orbit);
        let settled = settled(&text, orbit.period, periods, 1e-4);
        let apart = apart(&run, &settled);
        assert!(apart < 1e-9, "{name}: {apart:e} after {periods} periods");
    }
}

/// What becomes of a disturbance hardly depends on the curvature of the diodes: exact integration has it from the variational equation of straight ones.
#[test]
fn exponential_diodes_close_and_have_the_multipliers_of_straight_ones() {
    for (name, text) in decks() {
        if LONG.contains(&&*name) {
            continue;
        }
        let (orbit, run) = orbit_of(&name, &text.replace(IDEAL, EXPONENTIAL));
        assert!(orbit.residual <= 1e-8, "{name}: {:e}", orbit.residual);
        let error = run.error.max.unwrap_or_else(|| panic!("{name}: no error"));
        assert!(error < 5e-3, "{name}: {error:e}");
        let straight = orbit_of(&name, &text.replace(IDEAL, STRAIGHT)).0;
        for (one, other) in orbit.multipliers.iter().zip(&straight.multipliers) {
            let both = (size(*one), size(*other));
            assert!((both.0 - both.1).abs() < 0.015, "{name}: {both:?}");
        }
    }
}

/// The tolerance of what is compared to nine digits: orbits keep a thousandth of it.
const CLOSE: f64 = 2e-8;

#[test]
fn exponential_diodes_close_where_long_transients_end() {
    for (name, text) in decks() {
        if !QUICK.contains(&&*name) {
            continue;
        }
        let curved = text.replace(IDEAL, EXPONENTIAL);
        let mut options = PeriodicOptions::default();
        options.settings.tol = CLOSE;
        let (orbit, run) =
            periodic(&parsed(&curved), &options).unwrap_or_else(|error| panic!("{name}: {error}"));
        let largest = orbit.multipliers.first().map_or(f64::NAN, |m| size(*m));
        if orbit.kind != OrbitKind::Driven || largest > 0.99 {
            continue;
        }
        let periods = periods_until(1e-11, &orbit);
        let settled = settled(&curved, orbit.period, periods, 1e-2 * CLOSE);
        let apart = apart_of_amplitudes(&curved, &run, &settled);
        assert!(apart < 1e-9, "{name}: {apart:e} after {periods} periods");
    }
}
