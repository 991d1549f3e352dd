//! The impulses of a jump by name: those of the devices, of the sources and of what is recorded.

use nalgebra::DVector;

use super::reading;
use crate::lcs::{Lcs, Outputs, Role, Rows};
use crate::settings::tolerances::jumps::NO_JUMP;

/// Areas (A s, V s) in a jump by port impulses p and steps Δu of the inputs, each name once: of the devices their currents, then their
/// voltages; of independent sources and outputs what a step across a capacitor, or through an inductor, adds to those.
pub(crate) fn of_jump(lcs: &Lcs, p: &DVector<f64>, step: &[f64]) -> Vec<(String, f64)> {
    let mut all = of_devices(lcs, p);
    let outputs = &lcs.outputs;
    let Outputs {
        power_v, power_i, ..
    } = outputs;
    let mut add = |name: String, rows: &Rows, i: usize| {
        let area = reading::impulse(rows, i, p.as_slice(), step);
        if area.abs() > NO_JUMP * largest_term(rows, i, p, step)
            && all.iter().all(|(other, _)| *other != name)
        {
            all.push((name, area));
        }
    };
    for (i, name) in outputs.names.iter().enumerate() {
        add(name.clone(), &outputs.rows, i);
    }
    for (k, term) in outputs.power.iter().enumerate() {
        if lcs.inputs.iter().any(|input| input.name == term.element) {
            add(format!("i({})", term.element), power_i, k);
            add(format!("v({})", term.element), power_v, k);
        }
    }
    all
}

/// The largest term of [`reading::impulse`].
fn largest_term(rows: &Rows, i: usize, p: &DVector<f64>, step: &[f64]) -> f64 {
    let parts = [(&rows.lambda, p.as_slice()), (&rows.du, step)];
    let parts = parts.into_iter().filter(|(block, _)| i < block.nrows());
    let terms = parts.flat_map(|(block, values)| {
        let row = block.row(i).into_iter().copied().collect::<Vec<f64>>();
        row.into_iter().zip(values).map(|(g, v)| (g * v).abs())
    });
    terms.fold(0.0, f64::max)
}

fn of_devices(lcs: &Lcs, p: &DVector<f64>) -> Vec<(String, f64)> {
    let through = &lcs.d * p;
    let (mut currents, mut voltages) = (Vec::new(), Vec::new());
    let Outputs {
        power,
        power_v,
        power_i,
        ..
    } = &lcs.outputs;
    let element = |name: &str| power.iter().position(|term| term.element == name);
    for (j, port) in lcs.ports.iter().enumerate() {
        // Of a device of several pairs, `d1.2`, its own current and voltage.
        let whole = port
            .device
            .rsplit_once('.')
            .filter(|_| element(&port.device).is_none());
        if let Some((device, k)) = whole.and_then(|(device, _)| Some((device, element(device)?))) {
            let area = |rows: &Rows| rows.lambda.row(k).transpose().dot(p);
            currents.push((format!("i({device})"), area(power_i)));
            voltages.push((format!("v({device})"), area(power_v)));
            continue;
        }
        let (current, voltage) = match port.role {
            Role::Current => (p[j], -through[j]),
            Role::Voltage => (through[j], -p[j]),
            Role::Function => {
                currents.push((port.lambda.clone(), p[j]));
                continue;
            }
        };
        currents.push((format!("i({})", port.device), current));
        voltages.push((format!("v({})", port.device), voltage));
    }
    let mut all: Vec<(String, f64)> = Vec::new();
    for kind in [currents, voltages] {
        let largest = kind.iter().fold(0.0_f64, |a, (_, area)| a.max(area.abs()));
        for (name, area) in kind {
            if area.abs() > NO_JUMP * largest && !all.iter().any(|(n, _)| *n == name) {
                all.push((name, area));
            }
        }
    }
    all
}
