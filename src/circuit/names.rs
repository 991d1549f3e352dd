//! Names of nodes and elements of the flattened circuit, and what they mean inside a subcircuit.

use std::collections::{HashMap, HashSet};

use super::form::Form;
use super::scope::{ScopeId, Scopes};
use super::{ElementId, NodeId, Quantity};
use crate::algebra::Value;
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{Name, Signal};
use crate::netlist::suggest::nearest;

/// Names that are listed where one is unknown; more are no help.
const MOST: usize = 8;

/// All nodes and elements by canonical name.
#[derive(Debug)]
pub(super) struct Names<'n> {
    pub(super) nodes: HashMap<String, NodeId>,
    pub(super) elements: HashMap<String, ElementId>,
    /// Nodes of `.global`.
    pub(super) globals: HashSet<&'n str>,
}

impl<'n> Names<'n> {
    pub(super) fn new() -> Self {
        let ground = [("0".into(), NodeId::GROUND), ("gnd".into(), NodeId::GROUND)];
        Self {
            nodes: HashMap::from(ground),
            elements: HashMap::new(),
            globals: HashSet::new(),
        }
    }

    /// The node a name means in a scope, if it exists.
    pub(super) fn node(&self, name: &str, scopes: &Scopes<'n>, scope: ScopeId) -> Option<NodeId> {
        if matches!(name, "0" | "gnd") {
            return Some(NodeId::GROUND);
        }
        let here = scopes.get(scope);
        here.ports.get(name).copied().or_else(|| {
            self.nodes
                .get(&self.full_node_name(name, scopes, scope))
                .copied()
        })
    }

    /// The canonical name of a node that is no terminal.
    pub(super) fn full_node_name(&self, name: &str, scopes: &Scopes<'n>, scope: ScopeId) -> String {
        if self.globals.contains(name) {
            name.to_string()
        } else {
            format!("{}{name}", scopes.get(scope).prefix)
        }
    }

    /// The node a reference means: of this instance, else by its full name (`x1.n`, also `x1:n`), else at a pin of a subcircuit (`x1:out`).
    pub(super) fn expect_node(
        &self,
        name: &Name,
        scopes: &Scopes<'n>,
        scope: ScopeId,
    ) -> Result<NodeId, Box<Diagnostic>> {
        let text = name.text.as_str();
        let found = self
            .node(text, scopes, scope)
            .or_else(|| self.nodes.get(text).copied());
        found
            .or_else(|| self.nodes.get(&text.replace(':', ".")).copied())
            .or_else(|| scopes.port(text))
            .ok_or_else(|| {
                let fault = Diagnostic::error(
                    "unknown-node",
                    name.span,
                    format!("there is no node `{text}`"),
                )
                .label("no element is connected to it");
                let prefix = scopes.get(scope).prefix.as_str();
                let known = || self.nodes.keys().filter_map(|n| n.strip_prefix(prefix));
                match nearest(text, known()).or_else(|| longer_by_one(text, known())) {
                    Some(near) => Box::new(fault.help(format!("did you mean `{near}`?"))),
                    None => Box::new(fault),
                }
            })
    }

    /// The element a reference means: of this instance, else by its full name (`x1.d1`, also `x1:d1` and ngspice's `d.x1.d1`). None of `others`, which stand
    /// beside it, was meant.
    pub(super) fn expect_element(
        &self,
        name: &Name,
        scopes: &Scopes<'n>,
        scope: ScopeId,
        what: &str,
        others: &[Name],
    ) -> Result<ElementId, Box<Diagnostic>> {
        let text = name.text.as_str();
        let prefix = scopes.get(scope).prefix.as_str();
        let found = self
            .elements
            .get(&format!("{prefix}{text}"))
            .or_else(|| self.elements.get(text));
        found
            .or_else(|| self.elements.get(&without_letter(text)?))
            .or_else(|| self.elements.get(&text.replace(':', ".")))
            .copied()
            .ok_or_else(|| {
                let fault = Diagnostic::error(
                    "unknown-element",
                    name.span,
                    format!("there is no {what} `{text}`"),
                )
                .label("not in the circuit");
                let known = self.elements.keys().filter_map(|n| n.strip_prefix(prefix));
                let meant = |n: &&str| others.iter().all(|other| other.text != *n);
                let known: Vec<&str> = known.filter(meant).collect();
                if let Some(near) = nearest(text, known.iter().copied()) {
                    return Box::new(fault.help(format!("did you mean `{near}`?")));
                }
                let is_alike = |known: &&str| known.get(..1) == text.get(..1);
                let mut alike: Vec<&str> = known.into_iter().filter(is_alike).collect();
                alike.sort_unstable();
                Box::new(match alike.len() {
                    1 => fault.help(format!("there is `{}`", alike[0])),
                    2..=MOST => fault.help(format!("there are {}", alike.join(", "))),
                    _ => fault,
                })
            })
    }

    /// What `v(…)` or `i(…)` means.
    pub(super) fn signal(
        &self,
        signal: &Signal,
        scopes: &Scopes<'n>,
        scope: ScopeId,
    ) -> Result<Form, Box<Diagnostic>> {
        match signal {
            Signal::Voltage(a, b) => {
                let a = self.expect_node(a, scopes, scope)?;
                let b = b
                    .as_ref()
                    .map_or(Ok(NodeId::GROUND), |b| self.expect_node(b, scopes, scope))?;
                Ok(difference(a, b))
            }
            Signal::Current(name) => Ok(current(self.expect_element(
                name,
                scopes,
                scope,
                "element",
                &[],
            )?)),
        }
    }
}

/// The first name of one letter that is another one with a letter typed twice or beside it: `b` for `bb`.
fn longer_by_one<'a>(text: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    let mut typed = text.chars();
    let (first, second) = (typed.next()?, typed.next()?);
    let is_meant = |name: &&str| {
        let mut letters = name.chars();
        let own = letters.next();
        letters.next().is_none() && (own == Some(first) || own == Some(second))
    };
    let found = known.filter(is_meant).min().map(str::to_owned);
    found.filter(|_| typed.next().is_none())
}

/// `x1.d1` of ngspice's `d.x1.d1`, whose first letter repeats the one of the element.
pub(super) fn without_letter(name: &str) -> Option<String> {
    let rest = name.get(2..).filter(|_| name.get(1..2) == Some("."))?;
    let last = rest.rsplit('.').next()?;
    (last.get(..1) == name.get(..1) && rest.contains('.')).then(|| rest.to_string())
}

/// The name of the device that was written: `x1.a1` of `x1.a1.sm`, a part of a gate or flip-flop that its `A` card does not name.
pub(crate) fn written(name: &str) -> &str {
    let mut end = 0;
    for part in name.split('.') {
        end += part.len();
        if part.starts_with('a') {
            break;
        }
        end += 1;
    }
    name.get(..end).unwrap_or(name)
}

/// v(a) − v(b) as a form.
pub(super) fn difference(a: NodeId, b: NodeId) -> Form {
    let terms = [(1, a), (-1, b)]
        .into_iter()
        .filter(|(_, node)| *node != NodeId::GROUND && a != b)
        .map(|(sign, node)| {
            (
                Value::decimal(f64::from(sign), i128::from(sign), 0),
                Quantity::Voltage(node),
            )
        })
        .collect();
    Form {
        terms,
        ..Form::number(Value::decimal(0.0, 0, 0))
    }
}

/// The current of an element as a form.
pub(super) fn current(id: ElementId) -> Form {
    Form::quantity(Quantity::Current(id))
}
