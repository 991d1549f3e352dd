//! Switches that a source of their own moves, in place of their control.

use super::{Affine, Circuit, Element, Kind, NodeId, Quantity, Source};
use crate::algebra::Value;

/// The control of such a switch: off and on, and what lies between.
const OFF: f64 = 0.0;
const ON: f64 = 1.0;
const BETWEEN: f64 = 0.5;

/// The name of the source that holds a switch.
#[must_use]
pub fn holder(switch: &str) -> String {
    format!("{switch}#held")
}

/// What that source is for a position.
#[must_use]
pub const fn held_at(on: bool) -> f64 {
    if on { ON } else { OFF }
}

impl Circuit {
    /// The circuit with a switch that the source [`holder`] moves, which stands on `on`: a last node and element more, and the same
    /// probes. `None` where there is no such switch, or it is part of a thyristor.
    #[must_use]
    pub fn with_held_switch(&self, name: &str, on: bool) -> Option<Self> {
        let mut circuit = Self {
            probes: self.probes(),
            ..self.clone()
        };
        let node = NodeId(circuit.nodes.len() as u32);
        let switch = circuit
            .elements
            .iter_mut()
            .find_map(|e| match &mut e.kind {
                Kind::Switch(switch) if e.name == name && switch.latch.is_none() => Some(switch),
                _ => None,
            })?;
        switch.control = Affine {
            terms: vec![(Value::decimal(1.0, 1, 0), Quantity::Voltage(node))],
            constant: 0.0,
        };
        (switch.on_above, switch.off_below) = (BETWEEN, BETWEEN);
        circuit.nodes.push(holder(name));
        circuit.elements.push(Element {
            name: holder(name),
            p: node,
            n: NodeId::GROUND,
            kind: Kind::VoltageSource(Source::constant(held_at(on))),
            ic: None,
            span: None,
        });
        Some(circuit)
    }
}
