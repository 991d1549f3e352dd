//! What is legal and odd, or missing, once the whole circuit is known.

use super::builder::Builder;
use super::{Element, Kind, NodeId, Quantity, is_inside};
use crate::diagnostic::{Diagnostic, Severity, Span};
use crate::netlist::ast::{Block, Statement};
use crate::netlist::suggest::nearest;

impl<'n> Builder<'n, '_> {
    /// Faults inside subcircuits that nobody uses are worth a warning only.
    pub(super) fn report_unused(&mut self, block: &'n Block) {
        for statement in &block.statements {
            let Statement::Subckt(subckt) = statement else {
                continue;
            };
            let errors = subckt
                .body
                .faults
                .iter()
                .filter(|d| d.severity == Severity::Error)
                .count();
            if errors > 0 && !self.used.contains(&subckt.name.span) {
                let first = &subckt.body.faults[0];
                let message = format!(
                    "subcircuit `{}`, which is not used, has faults: {}",
                    subckt.name.text, first.message
                );
                let span = first.span.unwrap_or(subckt.name.span);
                self.tell(
                    Diagnostic::warning("unused-subcircuit", span, message)
                        .label(first.label.clone()),
                );
            }
        }
    }

    /// A ground node must exist.
    pub(super) fn check_ground(&mut self, end: Span) {
        let grounded = self
            .circuit
            .elements
            .iter()
            .any(|e| e.p == NodeId::GROUND || e.n == NodeId::GROUND);
        if !grounded {
            self.tell(
                Diagnostic::error("no-ground", end, "the circuit has no ground")
                    .label("no element up to here is connected to node `0`")
                    .help("call one node `0` (or `gnd`); in a schematic, place a ground symbol"),
            );
        }
    }

    /// Notes on things that are legal and odd.
    pub(super) fn note_oddities(&mut self) {
        let mut terminals = vec![0_usize; self.circuit.nodes.len()];
        let mut notes = Vec::new();
        for element in &self.circuit.elements {
            terminals[element.p.index()] += 1;
            terminals[element.n.index()] += 1;
            let control = match &element.kind {
                Kind::Controlled { control, .. } => Some(control),
                Kind::Function { input, .. } => Some(input),
                Kind::Switch(switch) => Some(&switch.control),
                _ => None,
            };
            for (_, quantity) in control.iter().flat_map(|c| &c.terms) {
                if let Quantity::Voltage(node) = quantity {
                    terminals[node.index()] += 1;
                }
            }
            if element.p == element.n {
                let message = format!(
                    "both ends of `{}` are at node `{}`",
                    element.name,
                    self.circuit.nodes[element.p.index()]
                );
                notes.push(
                    Diagnostic::note("self-loop", element.span, message)
                        .label("no current flows through it from outside"),
                );
            }
        }
        // What nothing is connected to at an `A` device is an output that is not used.
        for element in self.circuit.elements.iter().filter(|e| is_inside(&e.name)) {
            terminals[element.p.index()] += 1;
            terminals[element.n.index()] += 1;
        }
        for rail in &self.scopes.rails_read {
            terminals[rail.index()] += 1;
        }
        let dangling: Vec<&str> = terminals
            .iter()
            .zip(&self.circuit.nodes)
            .skip(1)
            .filter_map(|(count, name)| (*count == 1).then_some(name.as_str()))
            .collect();
        if !dangling.is_empty() {
            let shown = dangling
                .iter()
                .take(5)
                .copied()
                .collect::<Vec<_>>()
                .join(", ");
            let more = if dangling.len() > 5 {
                format!(" and {} more", dangling.len() - 5)
            } else {
                String::new()
            };
            let first = terminals.iter().skip(1).position(|count| *count == 1);
            let at_first =
                |e: &&Element| first.is_some_and(|k| [e.p, e.n].iter().any(|n| n.index() == k + 1));
            let element = self.circuit.elements.iter().find(at_first);
            let message = format!("connected at one end only: node {shown}{more}");
            let note = Diagnostic::note("dangling", element.and_then(|e| e.span), message);
            let note = note.label(format!("nothing else is at node {}", dangling[0]));
            let others = self.circuit.nodes.iter().skip(1).map(String::as_str);
            let near = nearest(
                dangling[0],
                others.filter(|name| !dangling[1..].contains(name)),
            );
            notes.push(note.help(match near {
                Some(near) => format!("did you mean node `{near}`? an open end that is meant does no harm"),
                None => "connect another element to this node; an open end that is meant does no harm".into(),
            }));
        }
        let uic = self.circuit.tran.is_some_and(|t| t.uic);
        // Currents of `.ic` are held at the operating point.
        let held = |k: usize| {
            let mut currents = self.circuit.initial_currents.iter();
            currents.any(|(id, _)| id.index() == k)
        };
        let elements = self.circuit.elements.iter().enumerate();
        let ignored = elements.filter(|(_, e)| e.ic.is_some_and(|ic| ic != 0.0));
        let ignored = ignored.filter(|(k, _)| !held(*k));
        let ignored: Vec<&Element> = ignored.map(|(_, element)| element).collect();
        if let (false, Some(_), [first, more @ ..]) = (uic, self.circuit.tran, &ignored[..]) {
            let others = match more.len() {
                0 => String::new(),
                1 => format!(" and `{}`", more[0].name),
                count => format!(" and {count} more"),
            };
            let message = format!(
                "`IC=` of `{}`{others} has no effect: the run starts from the operating point",
                first.name
            );
            notes.push(
                Diagnostic::warning("ic-without-uic", first.span, message)
                    .label("ignored without `uic`")
                    .help("add `uic` to `.tran`, or set node voltages and inductor currents with `.ic`"),
            );
        }
        for note in notes {
            self.tell(note);
        }
        if !self.unused_parameters.is_empty() {
            let (_, span) = self.unused_parameters[0];
            let names: Vec<String> = self
                .unused_parameters
                .drain(..)
                .map(|(name, _)| name)
                .collect();
            let message = format!("parameters without effect here: {}", names.join(", "));
            self.tell(
                Diagnostic::note("unused-parameters", span, message).label("the first of them"),
            );
        }
    }
}
