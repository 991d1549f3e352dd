//! The parts of a circuit picture as the cards of a netlist say them.

use super::part::{Part, Parts, Shape, Symbol, Transistor};
use crate::circuit::{Circuit, Output};
use crate::diagnostic::{SourceMap, Span};
use crate::netlist::BUILT_IN;
use crate::netlist::ast::{self, Control, Device, Statement, WaveCall};

/// The cards of a netlist; those of an `.if` where the circuit has them.
pub(super) fn parts(netlist: &ast::Netlist, sources: &SourceMap, circuit: &Circuit) -> Parts {
    let mut reader = Reader {
        all: Parts {
            nets: vec!["0".into()],
            ..Parts::default()
        },
        models: Vec::new(),
        subckts: Vec::new(),
        couplings: Vec::new(),
        sources,
        circuit,
    };
    reader.define(&netlist.body.statements);
    reader.read(&netlist.body.statements, true);
    reader.finish()
}

/// What a pin of an `A` device is called; those of other boxes have their names.
pub(super) fn pin_of<'a>(device: &str, pin: &'a str) -> &'a str {
    match (device, pin) {
        ("", _) => pin,
        ("dflop", "p1") => "d",
        ("dflop", "p3") => "clk",
        ("dflop", "p4") => "pre",
        ("dflop", "p5") => "clr",
        ("srflop", "p1") => "s",
        ("srflop", "p2") => "r",
        ("dflop" | "srflop", "p7") => "q",
        ("dflop" | "srflop", "p6") => "q̄",
        _ => pin.strip_prefix('p').unwrap_or(pin),
    }
}

/// Reads the cards of a netlist.
struct Reader<'a> {
    all: Parts,
    models: Vec<&'a ast::Model>,
    subckts: Vec<&'a ast::Subckt>,
    couplings: Vec<(&'a [ast::Name], String)>,
    sources: &'a SourceMap,
    circuit: &'a Circuit,
}

impl<'a> Reader<'a> {
    fn define(&mut self, statements: &'a [Statement]) {
        for statement in statements {
            match statement {
                Statement::Model(model) => self.models.push(model),
                Statement::Subckt(subckt) => self.subckts.push(subckt),
                Statement::If(branches) => branches
                    .iter()
                    .for_each(|b| self.define(&b.body.statements)),
                _ => {}
            }
        }
    }

    fn read(&mut self, statements: &'a [Statement], is_sure: bool) {
        for statement in statements {
            match statement {
                Statement::Element(card) if is_sure || self.is_in_circuit(card) => self.card(card),
                Statement::If(branches) => {
                    for branch in branches {
                        self.read(&branch.body.statements, false);
                    }
                }
                _ => {}
            }
        }
    }

    /// Whether the circuit has what a card of a branch of `.if` says.
    fn is_in_circuit(&self, card: &ast::Element) -> bool {
        let (elements, name) = (&self.circuit.elements, card.name.text.as_str());
        if let Some(element) = elements.iter().find(|e| e.name == name) {
            return element.span == Some(card.span);
        }
        let is_of = |own: &str| {
            own.strip_prefix(name)
                .is_some_and(|rest| rest.starts_with('.'))
        };
        elements.iter().any(|e| is_of(&e.name))
            || self
                .circuit
                .couplings
                .iter()
                .any(|k| k.span == Some(card.span))
    }

    fn card(&mut self, card: &'a ast::Element) {
        if let Device::Coupling { inductors, k } = &card.device {
            let words = format!("{} {}", card.name.text, self.text(k.span));
            self.couplings.push((inductors, words));
            return;
        }
        let nets: Vec<usize> = card.nodes.iter().map(|node| self.net(&node.text)).collect();
        let control = self.control(&card.device);
        let (symbol, value) = self.symbol(card);
        let mut part = Part {
            name: card.name.text.clone(),
            value,
            control,
            symbol,
            nets,
            pins: Vec::new(),
            is_wound: false,
        };
        match symbol {
            // Drain, gate, source and anode, gate, cathode: the gate comes last here.
            Symbol::Transistor(_) | Symbol::Thyristor | Symbol::Triac if part.nets.len() > 2 => {
                part.nets.truncate(3);
                part.nets.swap(1, 2);
            }
            Symbol::Box => part.pins = self.pins(card),
            _ => part.nets.truncate(2),
        }
        if part.nets.len() > 1 {
            self.all.parts.push(part);
        }
    }

    fn net(&mut self, name: &str) -> usize {
        let name = if name == "gnd" { "0" } else { name };
        let nets = &mut self.all.nets;
        nets.iter().position(|own| own == name).unwrap_or_else(|| {
            nets.push(name.into());
            nets.len() - 1
        })
    }

    fn text(&self, span: Span) -> String {
        let words = self.sources.text(span).split_whitespace();
        words.collect::<Vec<_>>().join(" ")
    }

    fn kind(&self, model: &str) -> &str {
        let found = self.models.iter().find(|m| m.name.text == model);
        found.map_or("", |m| m.kind.text.as_str())
    }

    fn symbol(&self, card: &ast::Element) -> (Symbol, String) {
        let first = |name: &ast::Name| name.text.clone();
        match &card.device {
            Device::Passive { values, args } => {
                let symbol = match card.name.text.chars().next() {
                    Some('c') => Symbol::Capacitor,
                    Some('l') => Symbol::Inductor,
                    _ => Symbol::Resistor,
                };
                let named = args
                    .iter()
                    .filter(|a| a.name.text.len() == 1)
                    .filter_map(|a| a.value.as_ref());
                let value = values.iter().chain(named).next();
                (symbol, value.map_or(String::new(), |v| self.text(v.span)))
            }
            Device::Source { dc, wave, .. } => self.source(card, dc.as_ref(), wave.as_deref()),
            Device::Controlled { voltage, .. } => {
                let output = if *voltage {
                    Output::Voltage
                } else {
                    Output::Current
                };
                (Symbol::Controlled(output), String::new())
            }
            Device::Diode { model, .. } => (self.diode(model), first(model)),
            Device::Switch { .. } => (Symbol::Switch, String::new()),
            Device::Transistor { words, .. } => self.transistor(card, words),
            Device::Call { subckt, .. } => match self.kind(&subckt.text) {
                "scr" => (Symbol::Thyristor, first(subckt)),
                "triac" => (Symbol::Triac, first(subckt)),
                _ => (
                    Symbol::Box,
                    self.device(subckt).unwrap_or_else(|| first(subckt)),
                ),
            },
            Device::Line { args, .. } => {
                let of = |name: &str| {
                    args.iter()
                        .find(|a| a.name.text == name)
                        .and_then(|a| a.value.as_ref())
                };
                let value = of("z0")
                    .or(of("zo"))
                    .map_or(String::new(), |v| self.text(v.span));
                (Symbol::Box, value)
            }
            Device::Code { model, .. } => (Symbol::Box, first(model)),
            Device::Coupling { .. } | Device::Unsupported { .. } => (Symbol::Box, String::new()),
        }
    }

    /// What an `A` device is, in lower case, where a subcircuit stands for one.
    fn device(&self, subckt: &ast::Name) -> Option<String> {
        let found = self.subckts.iter().find(|s| s.name.text == subckt.text)?;
        let file = self.sources.files.get(found.name.span.file.0 as usize)?;
        let kind = file.path.strip_prefix(BUILT_IN)?;
        Some(kind.trim().to_lowercase())
    }

    fn source(
        &self,
        card: &ast::Element,
        dc: Option<&ast::Expr>,
        wave: Option<&WaveCall>,
    ) -> (Symbol, String) {
        let output = if card.name.text.starts_with('i') {
            Output::Current
        } else {
            Output::Voltage
        };
        let shape = match wave.map(|w| w.name.text.as_str()) {
            Some("sin" | "sine" | "sffm" | "am") => Shape::Sine,
            Some("pulse") => Shape::Pulse,
            _ => Shape::Plain,
        };
        let words = match (wave, dc) {
            (Some(wave), _) => self.wave(wave),
            (None, Some(dc)) => self.text(dc.span),
            (None, None) => "0".into(),
        };
        (Symbol::Source(output, shape), words)
    }

    /// A diode, with bent ends where its model breaks down.
    fn diode(&self, model: &ast::Name) -> Symbol {
        let found = self.models.iter().find(|m| m.name.text == model.text);
        let breaks = |p: &ast::Assign| matches!(p.name.text.as_str(), "bv" | "vrev");
        if found.is_some_and(|m| m.params.iter().any(breaks)) {
            Symbol::Zener
        } else {
            Symbol::Diode
        }
    }

    fn transistor(&self, card: &ast::Element, words: &[ast::Name]) -> (Symbol, String) {
        let is_model = |word: &&ast::Name| !self.kind(&word.text).is_empty();
        let model = words.iter().rev().find(is_model).or(words.last());
        let p = model.is_some_and(|m| self.is_p(&m.text));
        let symbol = match card.name.text.chars().next() {
            Some('q') => Transistor::Bipolar { p },
            Some('m') => Transistor::Mos { p },
            _ if model.is_some_and(|m| self.kind(&m.text) == "nigbt") => Transistor::Igbt,
            _ => Transistor::Junction { p },
        };
        let name = model.map_or(String::new(), |m| m.text.clone());
        (Symbol::Transistor(symbol), name)
    }

    fn is_p(&self, model: &str) -> bool {
        let found = self.models.iter().find(|m| m.name.text == model);
        found.is_some_and(|m| {
            let is_flagged = m.params.iter().any(|p| p.name.text == "pchan");
            is_flagged || matches!(m.kind.text.as_str(), "pnp" | "pmos" | "pjf" | "pmf")
        })
    }

    /// A source's waveform by what matters first.
    fn wave(&self, wave: &WaveCall) -> String {
        let arg = |k: usize| {
            wave.args
                .get(k)
                .map(|a| self.text(a.value.span))
                .unwrap_or_default()
        };
        match wave.name.text.as_str() {
            "sin" | "sine" => format!("{} {}Hz", arg(1), arg(2)),
            "pulse" | "exp" => format!("{} … {}", arg(0), arg(1)),
            name => name.into(),
        }
    }

    fn control(&self, device: &Device) -> String {
        let (Device::Controlled { control, .. } | Device::Switch { control, .. }) = device else {
            return String::new();
        };
        let pair = |(a, b): &(ast::Name, ast::Name)| match b.text.as_str() {
            "0" | "gnd" => format!("v({})", a.text),
            b => format!("v({},{b})", a.text),
        };
        let gain = |gains: &[ast::Expr]| match gains {
            // A constant, mostly none, and the gain.
            [_, gain] => format!("{}·", self.text(gain.span)),
            _ => String::new(),
        };
        match control {
            Control::Nodes(pairs, gains) => {
                gain(gains) + &pairs.iter().map(pair).collect::<Vec<_>>().join(" ")
            }
            Control::Currents(names, gains) => {
                let names = names.iter().map(|n| format!("i({})", n.text));
                gain(gains) + &names.collect::<Vec<_>>().join(" ")
            }
            Control::Expression(expr) | Control::Table(expr, _) => self.text(expr.span),
            Control::Other(name) => name.text.clone(),
        }
    }

    fn pins(&self, card: &ast::Element) -> Vec<String> {
        let of_subckt = match &card.device {
            Device::Call { subckt, .. } => self.subckts.iter().find(|s| s.name.text == subckt.text),
            _ => None,
        };
        match of_subckt {
            Some(subckt) => {
                let device = self.device(&subckt.name).unwrap_or_default();
                let pin = |node: &ast::Name| pin_of(&device, &node.text).to_owned();
                subckt.nodes.iter().map(pin).collect()
            }
            None => vec![String::new(); card.nodes.len()],
        }
    }

    fn finish(mut self) -> Parts {
        for (inductors, words) in std::mem::take(&mut self.couplings) {
            let parts = &self.all.parts;
            let found = inductors
                .iter()
                .filter_map(|name| parts.iter().position(|p| p.name == name.text));
            let found: Vec<usize> = found.collect();
            for pair in found.windows(2) {
                self.all.couple(pair[0], pair[1], words.clone());
            }
        }
        self.all
    }
}
