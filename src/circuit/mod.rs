//! The flattened circuit: nodes, elements with evaluated values, sources, initial conditions, what to print.
//!
//! [`elaborate`] fills it from a netlist; nothing here knows SPICE text or matrices.

mod analysis;
mod audit;
mod behaviour;
mod bipolar;
mod build;
mod builder;
mod compared;
mod controlled;
mod define;
mod diode;
mod draw;
mod drive;
mod elaborate;
mod eval;
mod exponential;
#[cfg(test)]
mod fixture;
mod form;
mod formula;
mod functions;
mod gmin;
mod gradient;
mod held;
mod line;
pub(crate) mod load;
mod logic;
mod losses;
mod measurement;
mod model;
mod names;
mod parameters;
mod passive;
mod piecewise;
mod pin;
mod place;
mod probe;
mod response;
mod saturable;
mod scope;
mod shown;
mod slopes;
mod small_signal;
mod smooth;
pub mod source;
mod subcircuits;
mod sweep;
mod switch;
mod thermal;
mod threshold;
mod thyristor;
mod tones;
mod transistor;

use std::collections::BTreeSet;

use crate::algebra::Value;
use crate::diagnostic::Span;
use crate::law::Law;
pub use crate::netlist::ast::Binary;
pub use draw::{Spread, Tolerance};
pub use elaborate::{Diodes, ElaborateOptions, elaborate};
pub use formula::Formula;
pub(crate) use gradient::{Weights, weights};
pub use held::{held_at, holder};
pub use losses::{EnergyTable, Losses};
pub use measurement::{FourierAnalysis, Harmonics, Measured, NamedMeasurement};
pub(crate) use measurement::{Seen, carried_out};
pub(crate) use names::written;
pub use pin::Pins;
pub use shown::Column;
pub use source::Source;
pub use sweep::{Sweep, Swept, combinations};
pub use thermal::Thermal;

/// A node; 0 is ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);

impl NodeId {
    /// Node `0`.
    pub const GROUND: Self = Self(0);

    /// As an index into [`Circuit::nodes`].
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// An element, as an index into [`Circuit::elements`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ElementId(pub u32);

impl ElementId {
    /// As an index into [`Circuit::elements`].
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// A circuit ready for analysis. Names are lower case; inside subcircuits `x1.r1`, node `x1.n`.
#[derive(Debug, Clone, Default)]
pub struct Circuit {
    /// The title line.
    pub title: String,
    /// Node names by [`NodeId`]; `nodes[0]` is `"0"`.
    pub nodes: Vec<String>,
    /// Elements in file order, subcircuits expanded in place.
    pub elements: Vec<Element>,
    /// Coupled inductors, pair by pair.
    pub couplings: Vec<Coupling>,
    /// Ideal transmission lines; their ports are elements.
    pub lines: Vec<Line>,
    /// The transient analysis asked for.
    pub tran: Option<Tran>,
    /// Whether the netlist asks for the periodic steady state.
    pub steady: Option<SteadyState>,
    /// What `.save`, `.print`, `.probe`, `.plot tran` ask for; empty means the default set.
    pub probes: Vec<Probe>,
    /// What is shown of a transient, as functions of the probes; empty where these are shown as they are.
    pub columns: Vec<Column>,
    /// `.ic v(n)=…` (and differences `v(a,b)=…`): nodes and volts.
    pub initial_voltages: Vec<(NodeId, NodeId, f64)>,
    /// `.ic i(l)=…`: inductors and amperes; they stand as [`Element::ic`] too.
    pub initial_currents: Vec<(ElementId, f64)>,
    /// `.nodeset v(n)=…`: nodes and volts from which the switches of the operating point are looked for.
    pub nodesets: Vec<(NodeId, NodeId, f64)>,
    /// `.step`, the first one innermost; the circuit has the values as they stand.
    pub steps: Vec<Sweep>,
    /// `.dc`, the first sweep innermost.
    pub dc: Vec<Sweep>,
    /// Whether `.op` asks for the operating point.
    pub op: bool,
    /// `.ac`: frequencies, Hz; none without the card.
    pub ac: Vec<f64>,
    /// The sources with an `AC` value, in file order.
    pub stimuli: Vec<Stimulus>,
    /// Nodes whose voltage against ground an expression took as known (a constant, sines): what their sources do besides is not in it.
    pub known: Vec<NodeId>,
    /// The parameters of the top level that something uses, with their values, by name.
    pub params: Vec<(String, f64)>,
    /// `tol=5` on elements of the top level, as parts of their values (0.05).
    pub tolerances: Vec<(String, f64)>,
    /// Whether a value is drawn from a distribution by a random function, such as `mc` or `gauss`.
    pub random: bool,
    /// Transistors and subcircuits with the nodes of their pins.
    pub pins: Vec<Pins>,
    /// `.meas tran`, in file order.
    pub measurements: Vec<NamedMeasurement>,
    /// `.four`, in file order.
    pub fourier: Vec<FourierAnalysis>,
    /// The signals that measurements need.
    pub measured: Vec<Probe>,
    /// `.meas ac`, in file order.
    pub responses: Vec<NamedMeasurement>,
    /// The signals that those need.
    pub responded: Vec<Probe>,
    /// Devices whose models have tables of losses, or a way of their heat to the case.
    pub losses: Vec<Losses>,
    /// Where their heat goes.
    pub thermal: Thermal,
}

/// One branch of the circuit (or a controlled output), from node `p` to node `n`.
///
/// Its voltage is v(p) − v(n); its current is positive from `p` through the element to `n`.
#[derive(Debug, Clone)]
pub struct Element {
    /// Canonical lower-case name, unique.
    pub name: String,
    /// First node (anode of a diode).
    pub p: NodeId,
    /// Second node.
    pub n: NodeId,
    /// What it is.
    pub kind: Kind,
    /// `IC=` on the card, or `.ic` of an inductor's current: volts for a capacitor, amperes for an inductor.
    pub ic: Option<f64>,
    /// The card it comes from.
    pub span: Option<Span>,
}

/// What an element is, with its values in SI units.
#[derive(Debug, Clone)]
pub enum Kind {
    /// Ω; zero is a short, negative is allowed.
    Resistor(Value),
    /// F.
    Capacitor(Value),
    /// H.
    Inductor(Value),
    /// V.
    VoltageSource(Source),
    /// A, flowing from `p` through the source to `n`.
    CurrentSource(Source),
    /// E, F, G, H and affine behavioural sources: the output is an affine function of circuit quantities.
    Controlled {
        /// Whether the output is a voltage or a current.
        output: Output,
        /// Its value, V or A.
        control: Affine,
    },
    /// Comparator, saturation, hinge: the output is a monotone function of one affine input (the port
    /// y = input, λ = output of the complementarity system).
    Function {
        /// Whether the output is a voltage or a current.
        output: Output,
        /// The input y.
        input: Affine,
        /// The curve (input, output), e.g. a relay or saturation.
        law: Law,
    },
    /// A two-terminal device with a law between its voltage and current.
    Device(Law),
    /// S or W.
    Switch(Switch),
}

/// The sort of a controlled output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// A voltage source from `p` to `n`.
    Voltage,
    /// A current from `p` through the element to `n`.
    Current,
}

/// A quantity of the circuit that something may depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// v(node) against its reference.
    Voltage(NodeId),
    /// The current through an element.
    Current(ElementId),
}

/// `constant + Σ gain · quantity`.
#[derive(Debug, Clone, Default)]
pub struct Affine {
    /// Gains and quantities.
    pub terms: Vec<(Value, Quantity)>,
    /// The constant term; `Value::binary(0.0)` for none.
    pub constant: f64,
}

/// A switch with hysteresis: on when the control rises above `on_above`, off when it falls below `off_below`.
#[derive(Debug, Clone)]
pub struct Switch {
    /// The control, V or A.
    pub control: Affine,
    /// Ω when on; zero is a short.
    pub ron: Value,
    /// Ω when off; `None` is open.
    pub roff: Option<Value>,
    /// Turns on when the control exceeds this.
    pub on_above: f64,
    /// Turns off when the control is below this (≤ `on_above`; equal for no hysteresis).
    pub off_below: f64,
    /// `ON`/`OFF` on the card.
    pub initial: Option<bool>,
    /// A switch inside a thyristor, which the control alone does not move.
    pub latch: Option<Latch>,
}

/// What moves the switches inside a thyristor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Latch {
    /// On while a gate is, afterwards as long as the valve conducts and the control, the switch's own current, exceeds
    /// `off_below`.
    Hold {
        /// Switches that turn it on.
        gates: Vec<ElementId>,
        /// The diode in series.
        valve: ElementId,
    },
    /// On while this latch is off: a resistance that gives the diode 0 V where no current flows, and so a voltage.
    Rest(ElementId),
}

/// `K`: two inductors and their coupling coefficient.
#[derive(Debug, Clone)]
pub struct Coupling {
    /// Name of the card.
    pub name: String,
    /// First inductor.
    pub a: ElementId,
    /// Second inductor.
    pub b: ElementId,
    /// −1 ≤ k ≤ 1.
    pub k: Value,
    /// The card.
    pub span: Option<Span>,
}

/// `T`: a lossless line by its characteristics. Each port is the impedance in series with a source of the wave that arrives
/// there, e₁(t) = a₂(t − delay) with a₂ = v₂ + Z i₂ = 2 Z i₂ + e₂ the wave that left the other port (F. H. Branin, "Transient
/// analysis of lossless transmission lines", Proc. IEEE 55, 1967).
#[derive(Debug, Clone)]
pub struct Line {
    /// Name of the card.
    pub name: String,
    /// Z, Ω.
    pub impedance: Value,
    /// s.
    pub delay: f64,
    /// Its ends.
    pub ports: [LinePort; 2],
}

/// One end of a line: an impedance from the port's first node, in series with the wave source to its second node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinePort {
    /// The impedance; its current enters the line.
    pub impedance: ElementId,
    /// The source, a [`source::Wave::Arriving`].
    pub wave: ElementId,
}

/// `.tran tstep tstop [tstart [tmax]] [uic]`, in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tran {
    /// Distance of output times; (tstop − tstart)/1000 where the card names none.
    pub tstep: f64,
    /// The card names the print step. Where it does not, rows stand at events and corners of sources too, as other programs keep the
    /// steps they take.
    pub prints: bool,
    /// Last time.
    pub tstop: f64,
    /// First time written.
    pub tstart: f64,
    /// Largest internal step.
    pub tmax: Option<f64>,
    /// Start from initial conditions instead of the operating point.
    pub uic: bool,
}

/// What a netlist wants of its periodic steady state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SteadyState {
    /// `.tran … steady`: the transient begins on it.
    Start,
    /// `.pss` without `.tran`: one period of it, with rows and a span of search as [`Circuit::tran`] has them.
    Orbit,
}

/// A column of the output.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// Canonical name: `v(out)`, `v(a,b)`, `i(d1)`.
    pub name: String,
    /// What it is.
    pub what: Probed,
}

/// `AC magnitude phase` on a source: what it does in a small-signal analysis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stimulus {
    /// The source.
    pub source: ElementId,
    /// V or A.
    pub magnitude: f64,
    /// Degrees.
    pub phase: f64,
}

/// What a probe shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Probed {
    /// v(a) − v(b); b = ground for a single node.
    Voltage(NodeId, NodeId),
    /// The current of an element.
    Current(ElementId),
}

impl Circuit {
    /// The element with this canonical name.
    #[must_use]
    pub fn element(&self, name: &str) -> Option<ElementId> {
        self.elements
            .iter()
            .position(|e| e.name == name)
            .map(|i| ElementId(i as u32))
    }

    /// Whether a law does not consist of straight pieces.
    #[must_use]
    pub(crate) fn is_curved(&self) -> bool {
        self.elements.iter().any(|element| match &element.kind {
            Kind::Device(law) | Kind::Function { law, .. } => !law.is_piecewise_linear(),
            _ => false,
        })
    }

    /// Whether an expression took what this source does as known, so that it cannot be changed by itself.
    #[must_use]
    pub fn is_known(&self, source: ElementId) -> bool {
        let Element { p, n, .. } = self.elements[source.index()];
        let at_ground =
            |node: NodeId, other: NodeId| other == NodeId::GROUND && self.known.contains(&node);
        at_ground(p, n) || at_ground(n, p)
    }

    /// The node with this canonical name.
    #[must_use]
    pub fn node(&self, name: &str) -> Option<NodeId> {
        self.nodes
            .iter()
            .position(|n| n == name)
            .map(|i| NodeId(i as u32))
    }

    /// What to print: the probes asked for, else all node voltages, then voltage-source and inductor currents.
    #[must_use]
    pub fn probes(&self) -> Vec<Probe> {
        if !self.probes.is_empty() {
            return self.probes.clone();
        }
        let shown = |e: &Element| matches!(e.kind, Kind::VoltageSource(_) | Kind::Inductor(_));
        let all = self.all_voltages().chain(self.currents_of(shown));
        let name = |probe: &Probe| match probe.what {
            Probed::Voltage(node, _) => self.nodes[node.index()].as_str(),
            Probed::Current(id) => self.elements[id.index()].name.as_str(),
        };
        let elements: BTreeSet<&str> = self.elements.iter().map(|e| e.name.as_str()).collect();
        let is_part = |name: &str| wholes(name).any(|whole| elements.contains(whole));
        // What nobody wrote is shown where it is asked for.
        all.filter(|probe| !is_inside(name(probe)) && !is_part(name(probe)))
            .collect()
    }

    /// The voltages of all nodes but ground.
    pub(crate) fn all_voltages(&self) -> impl Iterator<Item = Probe> {
        let nodes = self.nodes.iter().enumerate().skip(1);
        nodes.map(|(i, name)| Probe {
            name: format!("v({name})"),
            what: Probed::Voltage(NodeId(i as u32), NodeId::GROUND),
        })
    }

    /// The currents of these elements.
    pub(crate) fn currents_of(
        &self,
        shown: impl Fn(&Element) -> bool,
    ) -> impl Iterator<Item = Probe> {
        let elements = self.elements.iter().enumerate();
        let shown = elements.filter(move |(_, e)| shown(e));
        shown.map(|(i, e)| Probe {
            name: format!("i({})", e.name),
            what: Probed::Current(ElementId(i as u32)),
        })
    }
}

/// What an element or node of this name may be a part of: `x1` and `x1.m1` of `x1.m1.body`.
pub(crate) fn wholes(name: &str) -> impl Iterator<Item = &str> {
    name.match_indices('.').map(|(dot, _)| &name[..dot])
}

/// Whether a node or an element is a part of an `A` device: `a1.q`, `x1.a1.q`.
pub(crate) fn is_inside(name: &str) -> bool {
    let mut parts = name.split('.');
    parts.next_back();
    parts.any(|part| part.starts_with('a'))
}
