//! Random rectifiers of exponential diodes behind inductances, floating or tied, at random tolerances: every run has an end, its energies add up, and the
//! error that it states bounds what voltages and currents are off from those of a run at a hundredth of the tolerance, to a factor of three.
//!
//! `CIRC_RECTIFIERS=N` runs so many of them from `CIRC_RECTIFIERS_SEED` on, in place of the fixed ones.
#![allow(missing_docs, reason = "tests")]

use circ::circuit::{ElaborateOptions, elaborate};
use circ::diagnostic::SourceMap;
use circ::integrate::{Run, SimOptions, simulate};
use circ::mna::behaviour;
use circ::netlist::parse;
use circ::settings::Settings;
use circ::waveform::Waveforms;

use crate::random::Random;

#[path = "converters/random.rs"]
#[expect(dead_code, reason = "a part of it serves here")]
mod random;

/// A supply, its inductance and diodes, a capacitor or a choke behind them, and a load.
fn rectifier(random: &mut Random) -> String {
    let frequency = random.value(50.0, 1e5);
    let volts = random.value(3.0, 400.0);
    let load = volts / random.value(1e-2, 30.0);
    let reactance = load / (std::f64::consts::TAU * frequency);
    let line = reactance * random.value(1e-3, 0.5);
    let farads = random.value(0.1, 100.0) / (std::f64::consts::TAU * frequency * load);
    let mut text = String::from("random rectifier\n");
    let supply = |name: &str, a: &str, b: &str, degrees: i32| {
        format!("v{name} {a} {b} sin(0 {volts:e} {frequency:e} 0 0 {degrees})\n")
    };
    let mut diodes = 0;
    let mut diode = |a: &str, b: &str| {
        diodes += 1;
        format!("d{diodes} {a} {b} d\n")
    };
    match random.below(5) {
        0 => {
            for (phase, degrees) in [("a", 0), ("b", -120), ("c", -240)] {
                text += &supply(phase, phase, "0", degrees);
                text += &format!("l{phase} {phase} {phase}1 {line:e}\n");
                text += &diode(&format!("{phase}1"), "p");
                text += &diode("n", &format!("{phase}1"));
            }
        }
        1 => {
            text += &supply("1", "a", "b", 0);
            text += &format!("rg b 0 {:e}\nl1 a a1 {line:e}\n", random.value(1e3, 1e9));
            for (a, b) in [("a1", "p"), ("b", "p"), ("n", "a1"), ("n", "b")] {
                text += &diode(a, b);
            }
        }
        2 => {
            text += &supply("1", "a", "0", 0);
            text += &format!("l1 a a1 {line:e}\nrn n 0 1m\n");
            text += &(diode("a1", "p") + &diode("n", "p"));
        }
        3 => {
            text += &supply("1", "a", "0", 0);
            text += &format!("l1 a a1 {line:e}\ncc a1 m {farads:e}\nrn n 0 1m\n");
            text += &(diode("n", "m") + &diode("m", "p"));
        }
        _ => {
            text += &(supply("1", "a", "0", 0) + &supply("2", "b", "0", 180));
            text += &format!("l1 a a1 {line:e}\nl2 b b1 {line:e}\nrn n 0 1m\n");
            text += &(diode("a1", "p") + &diode("b1", "p"));
        }
    }
    if random.one_in(2) {
        text += &format!("lo p o {:e}\n", reactance * random.value(1e-2, 30.0));
    } else {
        text += "ro p o 1m\n";
    }
    text += &format!("co o n {farads:e} ic={:e}\n", volts * random.even(0.0, 1.2));
    text += &format!("rl o n {load:e}\n");
    text += &format!(
        ".model d d(is={:e} rs={:e} n={})\n",
        random.value(1e-16, 1e-6),
        random.value(1e-4, 1.0),
        random.pick(&[1.0, 1.5, 1.9])
    );
    let rows = random.pick(&[20.0, 50.0, 200.0]);
    let periods = random.even(1.0, 6.0);
    text + &format!(
        ".tran {:e} {:e} uic\n.end\n",
        1.0 / (rows * frequency),
        periods / frequency
    )
}

/// By steps of a tolerance, so many at most.
fn run(text: &str, tol: f64, max_steps: u64) -> Result<Run, String> {
    let mut sources = SourceMap::default();
    let root = sources.add("random.cir", text);
    let (netlist, _) = parse(&mut sources, root, &|_| {
        Err(std::io::ErrorKind::NotFound.into())
    });
    let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
    let circuit = circuit.unwrap_or_else(|| panic!("{findings:?}\n{text}"));
    let options = SimOptions {
        settings: Settings {
            tol,
            max_steps,
            ..Settings::default()
        },
        ..SimOptions::default()
    };
    simulate(&circuit, &behaviour(&circuit).unwrap(), options).map_err(|e| e.to_string())
}

/// The largest difference of a voltage or current, relative to its amplitude or a thousandth of the largest of its unit.
fn apart(a: &Run, b: &Run) -> f64 {
    let Waveforms { names, units, .. } = &b.waveforms;
    let width = names.len();
    let rows = |run: &Run| -> Vec<Vec<f64>> {
        let rows = run.waveforms.values.chunks_exact(width);
        rows.map(<[f64]>::to_vec).collect()
    };
    let (of_a, of_b) = (rows(a), rows(b));
    assert_eq!(of_a.len(), of_b.len());
    let mut amplitudes = vec![0.0_f64; width];
    for row in &of_b {
        for (amplitude, value) in amplitudes.iter_mut().zip(row) {
            *amplitude = amplitude.max(value.abs());
        }
    }
    let largest = |unit: &str| {
        let same = amplitudes.iter().zip(units).filter(|(_, u)| **u == unit);
        same.fold(0.0, |most: f64, (a, _)| most.max(*a))
    };
    let scales: Vec<f64> = (amplitudes.iter().zip(units))
        .map(|(amplitude, unit)| amplitude.max(1e-3 * largest(unit)))
        .collect();
    let mut worst = 0.0_f64;
    for (x, y) in of_a.iter().zip(&of_b) {
        for ((x, y), scale) in x.iter().zip(y).zip(&scales) {
            worst = worst.max((x - y).abs() / scale);
        }
    }
    worst
}

/// What is wrong with the rectifier of a seed.
fn judge(seed: u64) -> Option<String> {
    let mut random = Random::new(seed);
    let text = rectifier(&mut random);
    let tol = random.value(1e-9, 3e-4);
    let coarse = match run(&text, tol, 150_000) {
        Ok(run) => run,
        Err(error) => return Some(format!("seed {seed}, tolerance {tol:e}: {error}\n{text}")),
    };
    let stated = coarse.error.max.unwrap_or(f64::INFINITY);
    let energy = coarse.energy.residual_relative.abs();
    if energy > 1e-3 {
        return Some(format!(
            "seed {seed}, tolerance {tol:e}: energies {energy:e}\n{text}"
        ));
    }
    let fine = match run(&text, (1e-2 * tol).max(1e-10), 1_000_000) {
        Ok(run) => run,
        Err(error) => return Some(format!("seed {seed}, the finer run: {error}\n{text}")),
    };
    let apart = apart(&coarse, &fine);
    let allowed = (3.0 * stated).max(10.0 * tol);
    (apart > allowed).then(|| {
        format!("seed {seed}, tolerance {tol:e}: {apart:e} apart, {stated:e} stated\n{text}")
    })
}

/// Steps of 1e-13 s followed the leakage of a three-phase bridge without an end.
const FOUND: [u64; 1] = [5364];

#[test]
fn random_rectifiers_end_and_are_as_right_as_they_say() {
    let number = |name: &str| std::env::var(name).ok()?.parse::<u64>().ok();
    let count = number("CIRC_RECTIFIERS").unwrap_or(40);
    let first = number("CIRC_RECTIFIERS_SEED").unwrap_or(1);
    let seeds = FOUND.into_iter().chain(first..first + count);
    let wrong: Vec<String> = seeds.filter_map(judge).collect();
    assert!(
        wrong.is_empty(),
        "{} of {count}:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
}
