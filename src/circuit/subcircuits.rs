//! Calls of subcircuits: their nodes, their arguments, and what stands in them.

use std::collections::BTreeSet;

use super::builder::Builder;
use super::scope::ScopeId;
use crate::diagnostic::Diagnostic;
use crate::netlist::BUILT_IN;
use crate::netlist::ast::{self, Assign, Name};
use crate::netlist::suggest::nearest;

/// Most subcircuit instances.
const MAX_INSTANCES: usize = 200_000;
/// Deepest nesting of subcircuits.
const MAX_NESTING: usize = 50;

impl<'n> Builder<'n, '_> {
    /// Expands a subcircuit.
    pub(super) fn call(
        &mut self,
        card: &'n ast::Element,
        name: &'n Name,
        args: &'n [Assign],
        scope: ScopeId,
    ) {
        let Some(subckt) = self.scopes.subckt(scope, &name.text) else {
            if self.scopes.model(scope, &name.text).is_some() {
                return self.thyristor(card, name, args, scope);
            }
            let message = format!(
                "`{}` calls unknown subcircuit `{}`",
                card.name.text, name.text
            );
            let fault =
                Diagnostic::error("unknown-subcircuit", name.span, message).label("not defined");
            let near = self
                .scopes
                .near(scope, &name.text, |s| s.subckts.keys().copied());
            let fault = match near {
                Some(near) => fault.help(format!("did you mean `{near}`?")),
                None => fault.help("define it with `.subckt`, or include the file that does; `--lib DIR` names a folder of such files"),
            };
            self.scopes.findings.miss(&name.text, fault);
            return;
        };
        self.used.insert(subckt.name.span);
        if subckt.nodes.len() != card.nodes.len() {
            let plural = |n: usize| {
                if n == 1 {
                    "1 node".to_string()
                } else {
                    format!("{n} nodes")
                }
            };
            let message = format!(
                "`{}` connects {}, subcircuit `{}` has {}",
                card.name.text,
                plural(card.nodes.len()),
                subckt.name.text,
                plural(subckt.nodes.len())
            );
            let ports: Vec<&str> = subckt.nodes.iter().map(|n| n.text.as_str()).collect();
            let help = format!(
                "the nodes of `{}` are: {}",
                subckt.name.text,
                ports.join(" ")
            );
            self.tell(
                Diagnostic::error("wrong-arity", card.span, message)
                    .label("wrong number of nodes")
                    .help(help),
            );
            return;
        }
        self.instances += 1;
        let recursive = self.nesting.iter().any(|open| std::ptr::eq(*open, subckt));
        if recursive || self.nesting.len() >= MAX_NESTING || self.instances > MAX_INSTANCES {
            let message = if recursive {
                format!("subcircuit `{}` contains itself", subckt.name.text)
            } else {
                format!(
                    "subcircuits are nested more than {MAX_NESTING} deep, or more than {MAX_INSTANCES} in all"
                )
            };
            self.tell(
                Diagnostic::error("recursive-subcircuit", name.span, message)
                    .label("expanded without end"),
            );
            return;
        }
        let inner = self.scopes.open(scope, &card.name.text);
        for (port, node) in subckt.nodes.iter().zip(&card.nodes) {
            let id = self.node(node, scope);
            self.scopes.get_mut(inner).ports.insert(&port.text, id);
        }
        for Assign { name, value } in &subckt.params {
            if let Some(value) = value {
                self.scopes.define(inner, name, value);
            }
        }
        self.scopes.get_mut(inner).declared.clear();
        for Assign { name, value } in args {
            let Some(value) = value else { continue };
            let number = self.scopes.number(value, scope);
            if name.text == "m"
                && !subckt.params.iter().any(|p| p.name.text == "m")
                && number.is_some_and(|v| v.f64 != 1.0)
            {
                let message = "the multiplier `m` of a subcircuit is not supported yet";
                self.tell(
                    Diagnostic::error("unsupported", name.span, message).label("recognised only"),
                );
            }
            self.scopes.fix(inner, &name.text, number);
        }
        self.nesting.push(subckt);
        // The choices of this instance come before those that wait outside it.
        let waiting = std::mem::take(&mut self.choices);
        let is_ours = subckt.name.text.starts_with(BUILT_IN);
        let outer = self.code_card;
        if is_ours {
            self.code_card = Some(card.span);
        }
        self.tell_all(&subckt.body.faults);
        self.define(&subckt.body, inner);
        self.elements(&subckt.body, inner);
        self.code_card = outer;
        if self.choices.is_empty() && !is_ours {
            self.unknown_arguments(subckt, args, inner);
        }
        self.choices = waiting;
        self.nesting.pop();
    }

    /// Warns of arguments that a subcircuit neither declares nor asks for.
    fn unknown_arguments(&mut self, subckt: &'n ast::Subckt, args: &'n [Assign], inner: ScopeId) {
        let own = subckt.params.iter().map(|p| p.name.text.as_str());
        let declared = self.scopes.get(inner).declared.iter().copied();
        let known: BTreeSet<&str> = own.chain(declared).collect();
        for Assign { name, .. } in args {
            let text = name.text.as_str();
            if text == "m" || known.contains(text) || self.scopes.is_asked(inner, text) {
                continue;
            }
            let message = format!(
                "subcircuit `{}` has no parameter `{text}`",
                subckt.name.text
            );
            let fault = Diagnostic::warning("unknown-parameter", name.span, message);
            let help = match nearest(text, known.iter().copied()) {
                Some(near) => format!("did you mean `{near}`?"),
                None if known.is_empty() => "it has none: take this one out".into(),
                None => {
                    let known: Vec<&str> = known.iter().copied().collect();
                    format!("it has {}", known.join(", "))
                }
            };
            self.tell(fault.label("without effect").help(help));
        }
    }
}
