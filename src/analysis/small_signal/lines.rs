//! Transmission lines in a small-signal analysis: what arrives at a port is what left the other one, turned by the delay.
//!
//! ```text
//! w = P(ω) d,   d = d_û + D(ω) w:      (I − P D) w = P d_û,      Y = Y_û + Y_w w,
//! ```
//!
//! where w are the waves that arrive and d = w + 2 Z i those that leave, port by port, P swaps the ports of every line and turns by e^{−jωτ}, and D and Y_w are the
//! responses to waves of one volt.

use nalgebra::{Complex, DMatrix, DVector};

use super::resonance;
use super::rest::Linear;
use crate::circuit::{Circuit, Probe, Probed};
use crate::integrate::Error;
use crate::settings::tolerances::periodic::LEAST_KNOWN;

/// A port of a line.
#[derive(Debug)]
pub(super) struct Port {
    /// Z, Ω.
    impedance: f64,
    /// s.
    delay: f64,
    /// The input that is the wave that arrives, the row that is the current into the line, and the port at the other end.
    input: usize,
    current: usize,
    other: usize,
}

/// The circuit with the currents into its lines among the probes, after those that it has.
pub(super) fn probing(circuit: &Circuit) -> Circuit {
    let ports = circuit.lines.iter().flat_map(|line| line.ports);
    let mut probes = circuit.probes();
    probes.extend(ports.map(|port| Probe {
        name: format!("i({})", circuit.elements[port.impedance.index()].name),
        what: Probed::Current(port.impedance),
    }));
    Circuit {
        probes,
        columns: vec![],
        ..circuit.clone()
    }
}

/// The ports of the lines of a [`probing`] circuit, line by line.
pub(super) fn ports(circuit: &Circuit, linear: &Linear) -> Vec<Port> {
    let first = circuit.probes.len() - 2 * circuit.lines.len();
    let port = |k: usize| {
        let line = &circuit.lines[k / 2];
        let wave = &circuit.elements[line.ports[k % 2].wave.index()].name;
        let mut inputs = linear.inputs.iter();
        Some(Port {
            impedance: line.impedance.f64,
            delay: line.delay,
            input: inputs.position(|input| input.name == *wave)?,
            current: first + k,
            other: k ^ 1,
        })
    };
    (0..2 * circuit.lines.len()).filter_map(port).collect()
}

/// Y(ω) for û of a circuit with lines, without the currents into these, and what rounding may leave of it.
pub(super) fn response(
    linear: &mut Linear,
    ports: &[Port],
    omega: f64,
    drive: &DVector<Complex<f64>>,
) -> Result<(Vec<Complex<f64>>, f64), Error> {
    let (mut values, mut loss) = linear.response(omega, drive)?;
    let leaving = |values: &[Complex<f64>], wave: Option<usize>, port: &Port| {
        let own = if wave == Some(port.input) { 1.0 } else { 0.0 };
        own + 2.0 * port.impedance * values[port.current]
    };
    // P, applied to what leaves.
    let arriving = |values: &[Complex<f64>], wave: Option<usize>| {
        let of = |port: &Port| {
            let turned = Complex::from_polar(1.0, -omega * port.delay);
            turned * leaving(values, wave, &ports[port.other])
        };
        DVector::from_iterator(ports.len(), ports.iter().map(of))
    };
    let mut of_waves = Vec::new();
    let mut matrix = DMatrix::identity(ports.len(), ports.len());
    for (k, port) in ports.iter().enumerate() {
        let mut one = DVector::zeros(drive.len());
        one[port.input] = Complex::new(1.0, 0.0);
        let (values, own) = linear.response(omega, &one)?;
        matrix.set_column(k, &(matrix.column(k) - arriving(&values, Some(port.input))));
        loss = loss.max(own);
        of_waves.push(values);
    }
    let size = matrix.norm();
    let inverse = matrix.try_inverse().ok_or_else(|| resonance(omega))?;
    // What a rounding of the delays or of the response to a wave changes.
    let known = f64::EPSILON * size * inverse.norm();
    if known > LEAST_KNOWN {
        return Err(resonance(omega));
    }
    loss = loss.max(known);
    let waves = inverse * arriving(&values, None);
    for (wave, response) in waves.iter().zip(&of_waves) {
        for (value, response) in values.iter_mut().zip(response) {
            *value += wave * response;
        }
    }
    values.truncate(values.len() - ports.len());
    Ok((values, loss))
}
