//! A circuit built without text: a voltage multiplier of any number of stages.
#![allow(clippy::print_stdout, reason = "an example prints")]

use circ::circuit::Source;
use circ::circuit::source::Wave;
use circ::{Circuit, Model, SimOptions};

/// Cockcroft and Walton's, of ideal diodes.
fn multiplier(stages: usize, amplitude: f64, frequency: f64) -> Circuit {
    let mut circuit = Circuit::named(format!("a multiplier of {stages} stages"));
    let wave = Wave::Sin {
        offset: 0.0,
        amplitude,
        frequency,
        delay: 0.0,
        damping: 0.0,
        phase: 0.0,
        cycles: None,
    };
    circuit.voltage_source("v1", ["a0", "0"], Source { dc: 0.0, wave });
    let column = |letter: char, k: usize| match (letter, k) {
        ('b', 0) => "0".to_string(),
        _ => format!("{letter}{k}"),
    };
    for k in 1..=stages {
        let [a0, a1, b0, b1] = [
            column('a', k - 1),
            column('a', k),
            column('b', k - 1),
            column('b', k),
        ];
        circuit
            .capacitor(&format!("ca{k}"), [&a0, &a1], 1e-6)
            .diode(&format!("da{k}"), [&b0, &a1])
            .diode(&format!("db{k}"), [&a1, &b1])
            .capacitor(&format!("cb{k}"), [&b0, &b1], 1e-6);
    }
    let out = column('b', stages);
    circuit
        .resistor("rl", [&out, "0"], 1e8)
        .show_voltage(&out)
        .transient(0.1 / frequency, 200.0 / frequency);
    circuit
}

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    for stages in 1..=3 {
        let run =
            Model::of_circuit(multiplier(stages, 100.0, 1e3))?.transient(SimOptions::default())?;
        let out = run.waveforms.column(0).last().unwrap_or_default();
        println!("{stages} stages: {out:.2} V");
        assert!((out - 200.0 * stages as f64).abs() < 1.0 * stages as f64);
    }
    Ok(())
}
