//! Switches that come to rest exactly on their threshold.

use super::builder::Builder;
use super::source::Wave;
use super::{Circuit, Element, Kind, NodeId, Output, Quantity, Switch};
use crate::diagnostic::Diagnostic;
use crate::law::Law;

/// Combinations of levels that are looked at for one control.
const MOST: usize = 64;

impl Builder<'_, '_> {
    /// Warns of switches without hysteresis whose control rests on the threshold: they are on exactly above it.
    pub(super) fn warn_of_thresholds(&mut self) {
        let warnings: Vec<Diagnostic> = self
            .circuit
            .elements
            .iter()
            .filter_map(|element| match &element.kind {
                Kind::Switch(switch) => on_threshold(&self.circuit, element, switch),
                _ => None,
            })
            .collect();
        for warning in warnings {
            self.tell(warning);
        }
    }
}

fn on_threshold(circuit: &Circuit, element: &Element, switch: &Switch) -> Option<Diagnostic> {
    if switch.on_above != switch.off_below || switch.latch.is_some() {
        return None;
    }
    // (value, who is at which level)
    let mut sums = vec![(switch.control.constant, String::new())];
    for (gain, quantity) in &switch.control.terms {
        let Quantity::Voltage(node) = *quantity else {
            return None;
        };
        if node == NodeId::GROUND {
            continue;
        }
        let (driver, levels) = driver(circuit, node)?;
        if levels.is_empty() || sums.len() * levels.len() > MOST {
            return None;
        }
        let with = |(sum, words): &(f64, String)| {
            let add = |level: &f64| {
                let comma = if words.is_empty() { "" } else { ", " };
                let words = format!("{words}{comma}`{driver}` is at {level}");
                (sum + gain.f64 * level, words)
            };
            levels.iter().map(add).collect::<Vec<_>>()
        };
        sums = sums.iter().flat_map(with).collect();
    }
    let (_, when) = sums.iter().find(|(sum, _)| *sum == switch.on_above)?;
    if when.is_empty() {
        return None;
    }
    let message = format!(
        "`{}` rests exactly on its threshold while {when}",
        element.name
    );
    Some(
        Diagnostic::warning("on-threshold", element.span, message)
            .label(format!("off there: on above {} only", switch.on_above))
            .help(
                "a threshold between the levels (`Vt` in the model), or hysteresis (`Vh`), decides",
            ),
    )
}

/// What ties a node to ground, and the voltages it rests at.
fn driver(circuit: &Circuit, node: NodeId) -> Option<(&str, Vec<f64>)> {
    circuit.elements.iter().find_map(|element| {
        let sign = match (element.p, element.n) {
            (p, NodeId::GROUND) if p == node => 1.0,
            (NodeId::GROUND, n) if n == node => -1.0,
            _ => return None,
        };
        let levels = match &element.kind {
            Kind::VoltageSource(source) => levels(&source.wave),
            Kind::Function {
                output: Output::Voltage,
                law,
                ..
            } => outputs(law),
            _ => return None,
        };
        let levels = levels.into_iter().map(|level| sign * level + 0.0).collect();
        Some((element.name.as_str(), levels))
    })
}

/// The values at which a waveform stays for a while.
fn levels(wave: &Wave) -> Vec<f64> {
    match wave {
        Wave::Dc(value) => vec![*value],
        Wave::Pulse { v1, v2, width, .. } if *width > 0.0 => vec![*v1, *v2],
        Wave::Pulse { v1, .. } | Wave::Exp { v1, .. } => vec![*v1],
        Wave::Pwl { points, .. } => {
            let flat = points
                .windows(2)
                .filter(|w| w[0].1 == w[1].1 && w[0].0 < w[1].0);
            let ends = points.first().into_iter().chain(points.last());
            ends.map(|p| p.1).chain(flat.map(|w| w[0].1)).collect()
        }
        Wave::Sin { .. } | Wave::Sffm { .. } | Wave::Am { .. } | Wave::Arriving { .. } => vec![],
    }
}

/// The values at which a function block stays over a range of its input.
fn outputs(law: &Law) -> Vec<f64> {
    let Some(curve) = law.curve() else {
        return vec![];
    };
    let vertices = &curve.vertices;
    let flat = vertices.windows(2).filter(|w| w[0].1.f64 == w[1].1.f64);
    let first = vertices.first().filter(|_| curve.first.1.f64 == 0.0);
    let last = vertices.last().filter(|_| curve.last.1.f64 == 0.0);
    let ends = first.into_iter().chain(last).map(|v| v.1.f64);
    ends.chain(flat.map(|w| w[0].1.f64)).collect()
}
