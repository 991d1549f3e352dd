//! What to print: `.save`, `.print`, `.probe`, `.plot`, and names given by the user.

use super::builder::Builder;
use super::names::without_letter;
use super::scope::ScopeId;
use super::{Circuit, ElementId, NodeId, Probe, Probed};
use crate::diagnostic::{Diagnostic, Span};
use crate::netlist::ast::{Name, Signal, Wanted};
use crate::netlist::suggest::nearest;

impl<'n> Builder<'n, '_> {
    pub(super) fn save(&mut self, list: &'n [Wanted], scope: ScopeId) {
        for wanted in list {
            let (text, span) = match wanted {
                Wanted::All(Name { text, span }) | Wanted::Other(Name { text, span }) => {
                    self.save_text(text, *span);
                    continue;
                }
                Wanted::Signal(signal) => (signal.to_string(), signal.span()),
                Wanted::Bare(name) => (name.text.clone(), name.span),
            };
            let prefixed = match wanted {
                Wanted::Signal(Signal::Voltage(a, None)) => {
                    format!("v({}{})", self.scopes.get(scope).prefix, a.text)
                }
                Wanted::Signal(Signal::Current(a)) => {
                    format!("i({}{})", self.scopes.get(scope).prefix, a.text)
                }
                _ => text.clone(),
            };
            match self
                .circuit
                .probe(&prefixed)
                .or_else(|| self.circuit.probe(&text))
            {
                Some(probe) => self.circuit.print(probe),
                None if prefixed.contains(['*', '?']) => self.save_text(&prefixed, span),
                None => {
                    let message = format!("`{text}` is not in the circuit and cannot be printed");
                    let warning = Diagnostic::warning("unknown-probe", span, message);
                    let help = self.circuit.what_there_is(&text);
                    self.tell(warning.label("ignored").help(help));
                }
            }
        }
    }

    /// A pattern or an expression.
    fn save_text(&mut self, text: &str, span: Span) {
        let text = text.trim_matches(['{', '}', '\'']);
        if let Err(fault) = self.circuit.print_text(text) {
            let mut message = format!("`{text}` cannot be printed");
            if !fault.message.ends_with(&format!("`{text}`")) {
                message = format!("{message}: {}", fault.message);
            }
            let warning = if fault.code == "unknown-probe" {
                Diagnostic::warning("unknown-probe", span, message)
            } else {
                Diagnostic::warning("ignored", span, message)
            };
            let warning = warning.label("ignored");
            let help = "voltages `v(a)`, `v(a,b)`, currents `i(r1)` and expressions of them can";
            self.tell(warning.help(fault.help.unwrap_or_else(|| help.to_owned())));
        }
    }
}

impl Circuit {
    /// The probe a user's name means: `v(a)`, `v(a,b)`, `i(d1)`, `@d1[i]`, `v1#branch`, or a bare node.
    ///
    /// Names are compared without case; `x1:n` is `x1.n`, or the node at the pin `n` of `x1`, and ngspice's `d.x1.d1` is `x1.d1`. `None` if there is no such
    /// node or element.
    #[must_use]
    pub fn probe(&self, text: &str) -> Option<Probe> {
        let text: String = text.to_lowercase().split_whitespace().collect();
        let inside = |prefix: &str, suffix: &str| {
            text.strip_prefix(prefix)
                .and_then(|t| t.strip_suffix(suffix))
        };
        if let Some(nodes) = inside("v(", ")") {
            if let Some(node) = self.node_like(nodes) {
                return Some(self.voltage(node, NodeId::GROUND));
            }
            let (a, b) = nodes.split_once(',')?;
            return Some(self.voltage(self.node_like(a)?, self.node_like(b)?));
        }
        let current = inside("i(", ")")
            .or(inside("@", "[i]"))
            .or(inside("@", "[id]"))
            .or(inside("", "#branch"))
            .or_else(|| main_current(&text));
        match current {
            Some(name) => self.element_like(name).map(|id| self.current(id)),
            None => self
                .node_like(&text)
                .map(|node| self.voltage(node, NodeId::GROUND)),
        }
    }

    /// A probe with its canonical name.
    pub(super) fn probe_of(&self, what: Probed) -> Probe {
        let node = |node: NodeId| &self.nodes[node.index()];
        let name = match what {
            Probed::Voltage(a, NodeId::GROUND) => format!("v({})", node(a)),
            Probed::Voltage(a, b) => format!("v({},{})", node(a), node(b)),
            Probed::Current(id) => format!("i({})", self.elements[id.index()].name),
        };
        Probe { name, what }
    }

    fn voltage(&self, a: NodeId, b: NodeId) -> Probe {
        self.probe_of(Probed::Voltage(a, b))
    }

    fn current(&self, id: ElementId) -> Probe {
        self.probe_of(Probed::Current(id))
    }

    fn node_like(&self, name: &str) -> Option<NodeId> {
        if matches!(name, "0" | "gnd") {
            return Some(NodeId::GROUND);
        }
        self.node(name)
            .or_else(|| self.node(&name.replace(':', ".")))
            .or_else(|| self.at_pin(name))
    }

    fn element_like(&self, name: &str) -> Option<ElementId> {
        self.element(name)
            .or_else(|| self.element(&without_letter(name)?))
            .or_else(|| self.element(&name.replace(':', ".")))
    }

    /// The node that other programs name by a pin: `x1:out` of a subcircuit, `m1:d` of a transistor, `r1:2` of an element.
    fn at_pin(&self, name: &str) -> Option<NodeId> {
        let (device, pin) = name.rsplit_once(':')?;
        let device = device.replace(':', ".");
        if let Some(pins) = self.pins.iter().find(|pins| pins.device == device) {
            let found = pins.nodes.iter().find(|(known, _)| known == pin);
            return found.map(|(_, node)| *node);
        }
        let element = &self.elements[self.element(&device)?.index()];
        match pin {
            "1" => Some(element.p),
            "2" => Some(element.n),
            _ => None,
        }
    }

    /// The signal that was probably meant, or else the first ones of its kind.
    pub(super) fn what_there_is(&self, text: &str) -> String {
        /// More names are no help.
        const MOST: usize = 8;
        let text = text.to_lowercase();
        let current = text.starts_with("i(") || text.starts_with('@');
        let name = match text.strip_prefix('@') {
            Some(rest) => rest.split('[').next(),
            None => text
                .rsplit('(')
                .next()
                .map(|rest| rest.trim_end_matches(')')),
        };
        let name = name.unwrap_or_default();
        if let (false, Some(id)) = (current, self.element_like(name)) {
            let element = &self.elements[id.index()];
            let across = self.voltage(element.p, element.n).name;
            return format!(
                "`{}` is an element: the voltage across it is `{across}`",
                element.name
            );
        }
        let names: Vec<&str> = match current {
            true => self.elements.iter().map(|e| &e.name[..]).collect(),
            false => self.nodes.iter().skip(1).map(|n| &n[..]).collect(),
        };
        let signal = |name: &str| format!("{}({name})", if current { 'i' } else { 'v' });
        if let Some(near) = nearest(&name.replace(':', "."), names.iter().copied()) {
            return format!("did you mean `{}`?", signal(&near));
        }
        let known: Vec<String> = names.into_iter().map(signal).collect();
        let more = known.len().saturating_sub(MOST);
        let first = known[..known.len() - more].join(", ");
        match more {
            0 => format!("there are {first}"),
            _ => format!("there are {first} and {more} more"),
        }
    }
}

/// The transistor of `id(m1)` or `ic(q1)`, whose current is the one into this pin.
fn main_current(text: &str) -> Option<&str> {
    let (function, rest) = text.split_once('(')?;
    let name = rest.strip_suffix(')')?;
    let letter = name.rsplit(['.', ':']).next()?.chars().next()?;
    let own = match function {
        "id" => matches!(letter, 'm' | 'j' | 'z'),
        "ic" => letter == 'q',
        _ => false,
    };
    own.then_some(name)
}
