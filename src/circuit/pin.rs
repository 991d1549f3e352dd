//! Currents into pins, which `.meas` and what is shown may name as LTspice does: `Id(m1)`, `Ib(q1)`, `Ix(x1:out)`.
//!
//! The current into a pin is what flows out of its node into the elements of the device: Σ i(e) over those that begin there, less
//! Σ i(e) over those that end there.

use super::builder::Builder;
use super::formula::Formula;
use super::scope::ScopeId;
use super::{Circuit, Element, ElementId, NodeId, Probe, Probed};
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{Binary, Expr, ExprKind, Name};

/// Functions that are the current into a pin of a transistor, with that pin as [`Builder::name_pins`] calls it.
const FUNCTIONS: [(&str, &str); 6] = [
    ("id", "d"),
    ("ig", "g"),
    ("is", "s"),
    ("ic", "c"),
    ("ib", "b"),
    ("ie", "e"),
];

/// The function for pins of subcircuits.
const OF_SUBCIRCUIT: &str = "ix";

/// A transistor, another device of parts or a subcircuit with the nodes that it has outside, first and last those between which its current flows.
#[derive(Debug, Clone, PartialEq)]
pub struct Pins {
    /// `m1`, `x1.q2`, `x1`.
    pub device: String,
    /// By what its pins are called.
    pub nodes: Vec<(String, NodeId)>,
    /// It is a subcircuit, whose elements may be at [`Self::common`] nodes without a pin.
    pub is_subcircuit: bool,
    /// Nodes of its pins that have one name everywhere.
    pub common: Vec<NodeId>,
}

/// The terms of a sum of signals: the probe and whether it counts positive.
type Terms = Vec<(Probe, bool)>;

/// Why a current is not known.
pub(super) struct Refused {
    pub(super) message: String,
    label: &'static str,
    pub(super) help: String,
}

impl Circuit {
    /// The current into a pin as a sum of the currents of elements; `None` where the function is none of a pin.
    pub(super) fn pin_current(
        &self,
        function: &str,
        argument: &str,
        prefix: &str,
    ) -> Option<Result<Terms, Refused>> {
        let refuse = |message: String, label, help: String| {
            Some(Err(Refused {
                message,
                label,
                help,
            }))
        };
        let (own, pin) = match FUNCTIONS.iter().find(|(known, _)| *known == function) {
            Some((_, pin)) => (argument, *pin),
            None if function == OF_SUBCIRCUIT => match argument.rsplit_once(':') {
                Some((device, pin)) => (device, pin),
                None => {
                    return refuse(
                        format!("`ix({argument})` names no pin"),
                        "write `Ix(x1:pin)`",
                        "write `Ix(x1:pin)`, with the name of the pin in the `.subckt`".into(),
                    );
                }
            },
            None => return None,
        };
        let device = format!("{prefix}{}", own.replace(':', "."));
        let is_subcircuit = function == OF_SUBCIRCUIT;
        let of_kind = |pins: &&Pins| pins.is_subcircuit == is_subcircuit;
        let known = self.pins.iter().filter(of_kind);
        let named = |pins: &&Pins| pins.device == device || pins.device == own;
        let Some(pins) = known.clone().find(named) else {
            let kind = if is_subcircuit {
                "subcircuit"
            } else {
                "transistor"
            };
            let mut names: Vec<&str> = known.map(|pins| &pins.device[..]).collect();
            names.truncate(8);
            let help = if self.element(own).is_some() && !is_subcircuit {
                format!("`i({own})` is the current through it, from its first node to its second")
            } else if names.is_empty() {
                format!("the circuit has no {kind}")
            } else {
                format!("there are {}", names.join(", "))
            };
            let message = format!("there is no {kind} `{own}`");
            return refuse(message, "not in the circuit", help);
        };
        let Some((_, node)) = pins.nodes.iter().find(|(known, _)| known == pin) else {
            let names: Vec<&str> = pins.nodes.iter().map(|(name, _)| &name[..]).collect();
            return refuse(
                format!("`{own}` has no pin `{pin}`"),
                "not a pin of it",
                format!("its pins are {}", names.join(", ")),
            );
        };
        let shared = pins.nodes.iter().filter(|(_, other)| other == node).count() > 1;
        if shared || pins.common.contains(node) {
            let label = if shared {
                "another pin is at the same node"
            } else {
                "elements inside may be at this node without the pin"
            };
            return refuse(
                format!("the current into this pin of `{own}` is not known by itself, as {label}"),
                label,
                "put a source of 0 V into the lead, `vm a b 0`, and take its current, `i(vm)`"
                    .into(),
            );
        }
        Some(Ok(self.currents_at(&pins.device, *node)))
    }

    fn currents_at(&self, device: &str, pin: NodeId) -> Terms {
        let own = |e: &Element| {
            let rest = e.name.strip_prefix(device);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        let elements = self.elements.iter().enumerate();
        let touching = elements.filter(|(_, e)| own(e) && (e.p == pin) != (e.n == pin));
        let term = |(k, e): (usize, &Element)| {
            let id = ElementId(k as u32);
            (self.probe_of(Probed::Current(id)), e.p == pin)
        };
        touching.map(term).collect()
    }
}

impl Refused {
    fn diagnostic(self, code: &'static str, name: Option<&Expr>) -> Box<Diagnostic> {
        let fault = Diagnostic::error(code, name.map(|name| name.span), self.message);
        Box::new(fault.label(self.label).help(self.help))
    }
}

/// The current into a pin that is to be shown.
///
/// # Errors
/// As [`Circuit::pin_current`].
pub(super) fn shown(circuit: &Circuit, expr: &Expr) -> Option<Result<Terms, Box<Diagnostic>>> {
    let ExprKind::Call(name, args) = &expr.kind else {
        return None;
    };
    let found = circuit.pin_current(&name.text, argument(args)?, "")?;
    Some(found.map_err(|refused| refused.diagnostic("unknown-probe", None)))
}

/// The name that is the only argument of a call.
fn argument(args: &[Expr]) -> Option<&str> {
    match args {
        [
            Expr {
                kind: ExprKind::Name(text) | ExprKind::Text(text),
                ..
            },
        ] => Some(text),
        _ => None,
    }
}

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
        let prefix = &self.scopes.get(scope).prefix;
        let found = self
            .circuit
            .pin_current(&name.text, argument(args)?, prefix)?;
        Some(found.map_err(|refused| refused.diagnostic("bad-meas", args.first())))
    }

    /// Remembers the nodes of a transistor.
    pub(super) fn name_pins(&mut self, device: &str, letters: &str, nodes: &[NodeId]) {
        let letters = letters.chars().map(String::from);
        self.circuit.pins.push(Pins {
            device: device.to_owned(),
            nodes: letters.zip(nodes.iter().copied()).collect(),
            is_subcircuit: false,
            common: Vec::new(),
        });
    }

    /// Remembers the nodes of all subcircuits.
    pub(super) fn name_ports(&mut self) {
        let globals = &self.names.globals;
        let is_common = |node: &NodeId| {
            *node == NodeId::GROUND || globals.contains(self.circuit.nodes[node.index()].as_str())
        };
        let instances = self.scopes.all().filter_map(|scope| {
            let device = scope.prefix.strip_suffix('.')?;
            let ports = scope.ports.iter();
            let mut nodes: Vec<_> = ports
                .map(|(name, node)| ((*name).to_owned(), *node))
                .collect();
            nodes.sort();
            let common = nodes
                .iter()
                .map(|(_, node)| *node)
                .filter(is_common)
                .collect();
            Some(Pins {
                device: device.to_owned(),
                nodes,
                is_subcircuit: true,
                common,
            })
        });
        let instances: Vec<Pins> = instances.collect();
        self.circuit.pins.extend(instances);
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
