//! Currents into pins, which `.meas` may name as LTspice does: `Id(m1)`, `Ib(q1)`, `Ix(x1:out)`.
//!
//! The current into a pin is what flows out of its node into the elements of the device: Σ i(e) over those that begin there, less
//! Σ i(e) over those that end there.

use super::builder::Builder;
use super::formula::Formula;
use super::scope::{ScopeId, Scopes};
use super::{NodeId, Probe, Probed};
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{Binary, Expr, ExprKind, Name};

/// Functions that are the current into a pin of a transistor, with that pin as [`Builder::pins`] calls it.
const FUNCTIONS: [(&str, char); 6] = [
    ("id", 'd'),
    ("ig", 'g'),
    ("is", 's'),
    ("ic", 'c'),
    ("ib", 'b'),
    ("ie", 'e'),
];

/// The terms of a sum of signals: the probe and whether it counts positive.
type Terms = Vec<(Probe, bool)>;

impl<'n> Builder<'n, '_> {
    /// The current into a pin as a sum of the currents of elements; `None` where the call is none of a pin.
    ///
    /// # Errors
    /// There is no such device or pin, or its current is not known by itself.
    pub(super) fn pin_current(
        &self,
        name: &Name,
        args: &'n [Expr],
        scope: ScopeId,
    ) -> Option<Result<Terms, Box<Diagnostic>>> {
        let [Expr { kind, span }] = args else {
            return None;
        };
        let (ExprKind::Name(text) | ExprKind::Text(text)) = kind else {
            return None;
        };
        let refuse = |message: String, label: &str| {
            Some(Err(Box::new(
                Diagnostic::error("bad-meas", *span, message).label(label),
            )))
        };
        let here = |device: &str| format!("{}{device}", self.scopes.get(scope).prefix);
        let (device, pin, nodes) = if name.text == "ix" {
            let Some((device, pin)) = text.rsplit_once(':') else {
                return refuse(format!("`ix({text})` names no pin"), "write `Ix(x1:pin)`");
            };
            let device = here(&device.replace(':', "."));
            let Some(ports) = self.scopes.ports(&device) else {
                return refuse(
                    format!("there is no subcircuit `{device}`"),
                    "not in the circuit",
                );
            };
            let Some(&own) = ports.get(pin) else {
                return refuse(format!("`{device}` has no pin `{pin}`"), "not a pin");
            };
            (device, own, ports.values().copied().collect::<Vec<_>>())
        } else {
            let (_, pin) = FUNCTIONS.iter().find(|(known, _)| *known == name.text)?;
            let device = here(text);
            let Some(pins) = self.pins.get(&device) else {
                return refuse(
                    format!("there is no transistor `{text}`"),
                    "not in the circuit",
                );
            };
            let Some((_, own)) = pins.iter().find(|(known, _)| known == pin) else {
                return refuse(
                    format!("`{text}` has no pin for `{}`", name.text),
                    "another kind of transistor",
                );
            };
            (device, *own, pins.iter().map(|(_, node)| *node).collect())
        };
        let shared = nodes.iter().filter(|node| **node == pin).count() > 1;
        let common = name.text == "ix" && self.is_common(pin);
        if shared || common {
            let message = format!("the current into this pin of `{device}` is not known by itself");
            let label = if shared {
                "another pin is at the same node"
            } else {
                "elements inside may be at this node without the pin"
            };
            return refuse(message, label);
        }
        Some(Ok(self.currents_at(&device, pin)))
    }

    /// Remembers the nodes of a transistor.
    pub(super) fn name_pins(&mut self, device: &str, letters: &str, nodes: &[NodeId]) {
        let pins = letters.chars().zip(nodes.iter().copied());
        self.pins.insert(device.to_owned(), pins.collect());
    }

    /// Whether a node has one name everywhere.
    fn is_common(&self, node: NodeId) -> bool {
        node == NodeId::GROUND
            || self
                .names
                .globals
                .contains(self.circuit.nodes[node.index()].as_str())
    }

    fn currents_at(&self, device: &str, pin: NodeId) -> Terms {
        let elements = self.circuit.elements.iter();
        let own = elements.filter(|e| {
            let rest = e.name.strip_prefix(device);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        });
        let touching = own.filter(|e| (e.p == pin) != (e.n == pin));
        let term = |e: &super::Element| {
            let id = self.names.elements[&e.name];
            (self.circuit.probe_of(Probed::Current(id)), e.p == pin)
        };
        touching.map(term).collect()
    }
}

impl Scopes<'_> {
    /// The nodes of an instance by the names of its pins.
    fn ports(&self, instance: &str) -> Option<&std::collections::HashMap<&str, NodeId>> {
        let prefix = format!("{instance}.");
        let scope = self.all().find(|scope| scope.prefix == prefix)?;
        Some(&scope.ports)
    }
}

/// The sum of signals as a formula.
pub(super) fn sum(signals: impl Iterator<Item = (Formula, bool)>) -> Formula {
    signals
        .map(|(signal, positive)| {
            if positive {
                signal
            } else {
                Formula::Minus(Box::new(signal))
            }
        })
        .reduce(|a, b| Formula::Binary(Binary::Add, Box::new(a), Box::new(b)))
        .unwrap_or(Formula::Number(0.0))
}
