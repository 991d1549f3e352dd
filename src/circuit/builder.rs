//! The walk over the cards: definitions first, then elements in file order, then what refers to them.

use std::collections::{HashSet, VecDeque};

use super::draw::{self, Draw};
use super::elaborate::ElaborateOptions;
use super::names::Names;
use super::scope::{ScopeId, Scopes};
use super::transistor::Channel;
use super::{Circuit, Element, ElementId, NodeId};
use crate::algebra::Value;
use crate::diagnostic::{Diagnostic, Severity, Span};
use crate::netlist::Netlist;
use crate::netlist::ast::{
    self, Block, Control, Device, Expr, Name, Signal, Statement, Subckt, Wanted,
};
use crate::netlist::suggest::directive;

/// Most elements of a circuit.
const MAX_ELEMENTS: usize = 1_000_000;

/// A control that is resolved when all elements are known.
pub(super) struct Pending<'n> {
    pub(super) element: ElementId,
    pub(super) scope: ScopeId,
    pub(super) control: &'n Control,
    pub(super) span: Span,
}

/// A coupling that is resolved when all elements are known.
pub(super) struct PendingCoupling<'n> {
    pub(super) name: String,
    pub(super) scope: ScopeId,
    pub(super) inductors: &'n [Name],
    pub(super) k: &'n Expr,
    pub(super) span: Span,
}

/// The circuit being built.
pub(super) struct Builder<'n, 'o> {
    pub(super) options: &'o ElaborateOptions,
    pub(super) scopes: Scopes<'n>,
    pub(super) circuit: Circuit,
    pub(super) names: Names<'n>,
    pub(super) pending: Vec<Pending<'n>>,
    pub(super) couplings: Vec<PendingCoupling<'n>>,
    /// The channels of transistors, until their gate drives are known.
    pub(super) channels: Vec<Channel>,
    pub(super) trans: Vec<&'n ast::Tran>,
    pub(super) other_analysis: bool,
    pub(super) ics: Vec<(ScopeId, &'n [(Signal, Expr)])>,
    pub(super) nodesets: Vec<(ScopeId, &'n [(Signal, Expr)])>,
    /// `.temp`.
    pub(super) temperature: Option<&'n Expr>,
    /// Of `.options tnom=`.
    pub(super) nominal: Option<&'n Expr>,
    /// Of `.options gmin=`.
    pub(super) gmin: Option<&'n Expr>,
    pub(super) saves: Vec<(ScopeId, &'n [Wanted])>,
    /// What `.print dc` asks for, which counts where there is no `.tran`.
    pub(super) dc_saves: Vec<(ScopeId, &'n [Wanted])>,
    pub(super) measurements: Vec<(ScopeId, &'n ast::Meas)>,
    pub(super) fours: Vec<(ScopeId, &'n ast::Four)>,
    pub(super) step_cards: Vec<&'n ast::Sweep>,
    /// The parameters that they step.
    pub(super) stepped: Vec<&'n Name>,
    pub(super) dc_cards: Option<&'n [ast::Sweep]>,
    pub(super) ac_card: Option<&'n ast::Frequencies>,
    pub(super) pss_card: Option<&'n ast::Pss>,
    /// `.thermal`.
    pub(super) thermals: Vec<&'n ast::Thermal>,
    /// Their nodes, in the network.
    pub(super) thermal_nodes: Vec<NodeId>,
    /// Names of the cards of the network.
    pub(super) thermal_names: HashSet<&'n str>,
    /// Values that `alter` sets, by element; the last one counts.
    pub(super) altered: Vec<(&'n Name, Value)>,
    /// Names of the elements of the top level.
    pub(super) root_elements: HashSet<&'n str>,
    /// Which branch of each `.if` was taken, in the order of the walk.
    pub(super) choices: VecDeque<Option<usize>>,
    /// The subcircuits being expanded, from the outside in.
    pub(super) nesting: Vec<&'n Subckt>,
    /// The `A` card being expanded: its parts have no cards that anyone wrote.
    pub(super) code_card: Option<Span>,
    pub(super) used: HashSet<Span>,
    pub(super) instances: usize,
    /// Model parameters that had no effect, by model.
    pub(super) unused_parameters: Vec<(String, Span)>,
    /// Models of transistors whose approximation was told.
    pub(super) told_models: Vec<String>,
    /// The nodes of the auxiliary sources that behavioural elements share.
    pub(super) auxiliary_nodes: Vec<Option<NodeId>>,
    /// The node whose voltage is the time, if there is one.
    pub(super) clock: Option<NodeId>,
}

impl<'n, 'o> Builder<'n, 'o> {
    pub(super) fn new(options: &'o ElaborateOptions) -> Self {
        let mut circuit = Circuit::default();
        circuit.nodes.push("0".into());
        Self {
            options,
            scopes: Scopes::new(),
            circuit,
            names: Names::new(),
            pending: Vec::new(),
            couplings: Vec::new(),
            channels: Vec::new(),
            trans: Vec::new(),
            other_analysis: false,
            ics: Vec::new(),
            nodesets: Vec::new(),
            temperature: None,
            nominal: None,
            gmin: None,
            saves: Vec::new(),
            dc_saves: Vec::new(),
            measurements: Vec::new(),
            fours: Vec::new(),
            step_cards: Vec::new(),
            stepped: Vec::new(),
            dc_cards: None,
            ac_card: None,
            pss_card: None,
            thermals: Vec::new(),
            thermal_nodes: Vec::new(),
            thermal_names: HashSet::new(),
            altered: Vec::new(),
            root_elements: HashSet::new(),
            choices: VecDeque::new(),
            nesting: Vec::new(),
            code_card: None,
            used: HashSet::new(),
            instances: 0,
            unused_parameters: Vec::new(),
            told_models: Vec::new(),
            auxiliary_nodes: Vec::new(),
            clock: None,
        }
    }

    /// Builds the circuit and gives it with everything found.
    pub(super) fn build(mut self, netlist: &'n Netlist) -> (Circuit, Vec<Diagnostic>) {
        self.circuit.title.clone_from(&netlist.title);
        let read = netlist
            .body
            .faults
            .iter()
            .all(|d| d.severity < Severity::Error);
        self.scopes.draw = Draw::of(self.options);
        self.scopes.tolerances.clone_from(&self.options.tolerances);
        for (name, value) in &self.options.params {
            let name = name.to_lowercase();
            let value = Value::binary(*value);
            let value = self.scopes.toleranced(value, &name, None);
            self.scopes.fix(ScopeId::ROOT, &name, Some(value));
        }
        self.define(&netlist.body, ScopeId::ROOT);
        self.check_overrides();
        self.check_altered();
        self.circuit.tran = self.transient();
        self.steady();
        self.dc_sweeps();
        self.frequencies();
        self.thermal_network(&netlist.body);
        self.elements(&netlist.body, ScopeId::ROOT);
        if self.circuit.elements.is_empty() && read && !self.failed() {
            self.tell(
                Diagnostic::error("no-elements", netlist.end, "the netlist has no elements")
                    .label("nothing up to here"),
            );
        }
        self.resolve();
        self.set_gmin();
        self.report_unused(&netlist.body);
        self.warn_of_idle_steps();
        if !self.circuit.elements.is_empty() && read && !self.failed() {
            self.check_ground(netlist.end);
            self.note_oddities();
            self.warn_of_thresholds();
        }
        if read && self.trans.is_empty() && !self.other_analysis {
            self.tell(
                Diagnostic::note(
                    "no-analysis",
                    netlist.end,
                    "the netlist asks for no analysis",
                )
                .label("no `.tran` up to here")
                .help("add `.tran tstep tstop` to simulate it"),
            );
        }
        self.circuit.params = self.scopes.evaluated(ScopeId::ROOT);
        self.circuit.random = self.scopes.random;
        (self.circuit, self.scopes.findings.into_list())
    }

    pub(super) fn tell(&mut self, finding: Diagnostic) {
        self.scopes.findings.tell(finding);
    }

    pub(super) fn tell_all(&mut self, findings: &[Diagnostic]) {
        for finding in findings {
            self.tell(finding.clone());
        }
    }

    fn failed(&self) -> bool {
        self.scopes.findings.any_error()
    }

    /// Adds the elements of a block, in order.
    pub(super) fn elements(&mut self, block: &'n Block, scope: ScopeId) {
        for statement in &block.statements {
            match statement {
                Statement::Element(element)
                    if scope == ScopeId::ROOT
                        && self.thermal_names.contains(element.name.text.as_str()) => {}
                Statement::Element(element) => self.element(element, scope),
                Statement::If(branches) => {
                    if let Some(branch) = self
                        .choices
                        .pop_front()
                        .flatten()
                        .and_then(|i| branches.get(i))
                    {
                        self.elements(&branch.body, scope);
                    }
                }
                _ => {}
            }
        }
    }

    fn element(&mut self, card: &'n ast::Element, scope: ScopeId) {
        if self.circuit.elements.len() >= MAX_ELEMENTS {
            let message = format!("the circuit has more than {MAX_ELEMENTS} elements");
            self.tell(Diagnostic::error("too-large", None, message));
            return;
        }
        self.scopes.place = draw::place(&self.full_name(&card.name, scope));
        match &card.device {
            Device::Passive { values, args } => self.passive(card, values, args, scope),
            Device::Source { dc, wave, ac, args } => {
                let driven = (wave.as_deref(), ac.is_some());
                self.source(card, dc.as_ref(), driven, args, scope);
                self.stimulus(card, ac.as_deref(), scope);
            }
            Device::Coupling { inductors, k } => self.couplings.push(PendingCoupling {
                name: self.full_name(&card.name, scope),
                scope,
                inductors,
                k,
                span: card.span,
            }),
            Device::Controlled {
                voltage,
                control,
                args,
            } => self.controlled(card, *voltage, control, args, scope),
            Device::Diode { model, area, args } => {
                self.diode(card, model, area.as_ref(), args, scope)
            }
            Device::Switch {
                control,
                model,
                initial,
            } => self.switch(card, control, model, *initial, scope),
            Device::Transistor { words, area, args } => {
                if card.name.text.starts_with('q') {
                    self.bipolar(card, words, area.as_ref(), args, scope);
                } else {
                    self.transistor(card, words, area.as_ref(), args, scope);
                }
            }
            Device::Line { args, ic } => self.line(card, args, ic, scope),
            Device::Call { subckt, args } => self.call(card, subckt, args, scope),
            // Replaced where the netlist was read, or at fault.
            Device::Code { .. } => {}
            Device::Unsupported { what } => {
                let message = format!(
                    "`{}` is {what}, which is recognised but not supported yet",
                    card.name.text
                );
                let help = match directive(&card.name.text) {
                    Some(meant) => format!("did you mean `{meant}`?"),
                    None => {
                        "supported elements are R C L K V I E F G H B D S W M Q J Z T X A".into()
                    }
                };
                self.tell(
                    Diagnostic::error("unsupported-element", card.span, message)
                        .label("not supported yet")
                        .help(help),
                );
            }
        }
    }

    /// The canonical name of an element.
    pub(super) fn full_name(&self, name: &Name, scope: ScopeId) -> String {
        format!("{}{}", self.scopes.get(scope).prefix, name.text)
    }

    /// The node a name means here, new if need be.
    pub(super) fn node(&mut self, name: &Name, scope: ScopeId) -> NodeId {
        match self.names.node(&name.text, &self.scopes, scope) {
            Some(id) => id,
            None => self.new_node(self.names.full_node_name(&name.text, &self.scopes, scope)),
        }
    }

    /// A node with a canonical name.
    pub(super) fn new_node(&mut self, name: String) -> NodeId {
        let next = NodeId(u32::try_from(self.circuit.nodes.len()).unwrap_or(u32::MAX));
        let nodes = &mut self.circuit.nodes;
        *self.names.nodes.entry(name).or_insert_with_key(|name| {
            nodes.push(name.clone());
            next
        })
    }

    /// Adds an element; a second one with the same name is an error.
    pub(super) fn add(&mut self, mut element: Element) -> Option<ElementId> {
        element.span = self.code_card.or(element.span);
        let id = ElementId(u32::try_from(self.circuit.elements.len()).unwrap_or(u32::MAX));
        if let Some(first) = self.names.elements.get(&element.name) {
            let message = format!("element `{}` is defined again", element.name);
            let first = self.circuit.elements[first.0 as usize].span;
            self.tell(
                Diagnostic::error("duplicate-element", element.span, message)
                    .label("the name is taken already")
                    .first_at(first)
                    .help("rename one of the two; capital letters make no difference"),
            );
            return None;
        }
        self.names.elements.insert(element.name.clone(), id);
        self.circuit.elements.push(element);
        Some(id)
    }

    /// The element a card refers to; reports if there is none.
    pub(super) fn expect_element(
        &mut self,
        name: &Name,
        scope: ScopeId,
        what: &str,
    ) -> Option<ElementId> {
        let found = self
            .names
            .expect_element(name, &self.scopes, scope, what, &[]);
        found.map_err(|fault| self.tell(*fault)).ok()
    }

    /// The node a card refers to; reports if there is none.
    pub(super) fn expect_node(&mut self, name: &Name, scope: ScopeId) -> Option<NodeId> {
        let found = self.names.expect_node(name, &self.scopes, scope);
        found.map_err(|fault| self.tell(*fault)).ok()
    }

    /// Everything that refers to elements and nodes by name.
    fn resolve(&mut self) {
        self.find_rails();
        self.open_channels();
        for pending in std::mem::take(&mut self.pending) {
            if let Some(form) = self.control(&pending) {
                self.place(pending.element, form);
            }
        }
        self.couple();
        self.cases();
        for (scope, list) in std::mem::take(&mut self.ics) {
            self.initial(list, scope);
        }
        for (scope, list) in std::mem::take(&mut self.nodesets) {
            self.nodeset(list, scope);
        }
        let saves = if self.circuit.tran.is_some() || self.circuit.dc.is_empty() {
            std::mem::take(&mut self.saves)
        } else {
            std::mem::take(&mut self.dc_saves)
        };
        self.name_ports();
        // Expressions that are shown take what has a value by now.
        self.circuit.params = self.scopes.evaluated(ScopeId::ROOT);
        for (scope, list) in saves {
            self.save(list, scope);
        }
        self.circuit.settle_columns();
        self.circuit.known = self.scopes.rails_read.iter().copied().collect();
        let cards = std::mem::take(&mut self.measurements);
        self.measure(&cards);
        for (scope, card) in std::mem::take(&mut self.fours) {
            self.fourier(card, scope);
        }
    }
}
