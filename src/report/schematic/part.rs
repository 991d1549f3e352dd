//! What stands in a circuit picture: symbols with their pins and words.

use crate::circuit::{Circuit, Element, Kind, NodeId, Output};

use super::super::si;

/// What is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Symbol {
    Resistor,
    Capacitor,
    Inductor,
    Diode,
    Zener,
    Thyristor,
    Triac,
    Switch,
    Source(Output, Shape),
    Controlled(Output),
    Transistor(Transistor),
    /// A subcircuit, a line: pins at its upper and lower edge.
    Box,
}

/// What stands in the circle of a source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    Plain,
    Sine,
    Pulse,
}

/// A transistor whose current flows towards its second main pin, or (`p`) away from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Transistor {
    Bipolar { p: bool },
    Mos { p: bool },
    Igbt,
    Junction { p: bool },
}

impl Transistor {
    /// Whether its first main pin belongs below.
    pub(super) const fn is_p(self) -> bool {
        match self {
            Self::Bipolar { p } | Self::Mos { p } | Self::Junction { p } => p,
            Self::Igbt => false,
        }
    }
}

/// A symbol with what it is connected to.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Part {
    pub(super) name: String,
    /// Its value in words, whole.
    pub(super) value: String,
    /// What controls it, where no wire shows it.
    pub(super) control: String,
    pub(super) symbol: Symbol,
    /// The two main pins (anode first, drain or collector first), then the gate; of a box all pins.
    pub(super) nets: Vec<usize>,
    /// Names of a box's pins.
    pub(super) pins: Vec<String>,
    /// One of several coupled inductors: its first pin has a dot.
    pub(super) is_wound: bool,
}

/// All parts of a circuit.
#[derive(Debug, Clone, Default)]
pub(super) struct Parts {
    pub(super) parts: Vec<Part>,
    /// Names of the nets; 0 is ground.
    pub(super) nets: Vec<String>,
    /// Coupled inductors, pair by pair, with the name and coefficient of their card.
    pub(super) couplings: Vec<(usize, usize, String)>,
}

impl Parts {
    /// The elements of a circuit, subcircuits expanded.
    pub(super) fn of_circuit(circuit: &Circuit) -> Self {
        let mut all = Self {
            nets: circuit.nodes.clone(),
            ..Self::default()
        };
        all.parts = circuit.elements.iter().map(of_element).collect();
        for coupling in &circuit.couplings {
            let words = format!("{} {}", coupling.name, si::plain(coupling.k.f64, 4));
            all.couple(coupling.a.index(), coupling.b.index(), words);
        }
        all
    }

    pub(super) fn couple(&mut self, a: usize, b: usize, words: String) {
        self.parts[a].is_wound = true;
        self.parts[b].is_wound = true;
        self.couplings.push((a, b, words));
    }
}

fn of_element(element: &Element) -> Part {
    let (symbol, value) = match &element.kind {
        Kind::Resistor(v) => (Symbol::Resistor, si::quantity(v.f64, "Ω", 4)),
        Kind::Capacitor(v) => (Symbol::Capacitor, si::quantity(v.f64, "F", 4)),
        Kind::Inductor(v) => (Symbol::Inductor, si::quantity(v.f64, "H", 4)),
        Kind::VoltageSource(_) => (Symbol::Source(Output::Voltage, Shape::Plain), String::new()),
        Kind::CurrentSource(_) => (Symbol::Source(Output::Current, Shape::Plain), String::new()),
        Kind::Controlled { output, .. } | Kind::Function { output, .. } => {
            (Symbol::Controlled(*output), String::new())
        }
        Kind::Device(law) => (Symbol::Diode, law.kind().replace('_', " ")),
        Kind::Switch(_) => (Symbol::Switch, String::new()),
    };
    let ends: [NodeId; 2] = [element.p, element.n];
    Part {
        name: element.name.clone(),
        value,
        control: String::new(),
        symbol,
        nets: ends.map(NodeId::index).into(),
        pins: Vec::new(),
        is_wound: false,
    }
}

/// Words of at most so many letters.
pub(super) fn brief(words: &str, longest: usize) -> String {
    if words.chars().count() <= longest {
        return words.into();
    }
    words.chars().take(longest - 1).chain(['…']).collect()
}
