//! What a netlist prescribes for the operating point: voltages held by a source, or guessed where something drives the node, and currents of inductors.

use super::statics::source;
use crate::circuit::{Circuit, Element, Kind, NodeId, Output, Quantity, Source, is_inside};
use crate::integrate::Note;
use crate::integrate::start::OperatingPoint;
use crate::settings::tolerances::jumps::CONSISTENT;

/// v(a) − v(b), V.
pub(super) type Voltage = (NodeId, NodeId, f64);

/// What sources hold.
#[derive(Debug, Clone, Default)]
pub(super) struct Held {
    pub(super) voltages: Vec<Voltage>,
    /// Of inductors, as places among the elements: A.
    pub(super) currents: Vec<(usize, f64)>,
}

/// What `.ic` and `.nodeset` ask for.
pub(super) struct Prescribed {
    /// Held by sources.
    pub(super) held: Held,
    /// Looked for: sources drive these nodes already.
    pub(super) guesses: Vec<Guess>,
}

/// A voltage of a node that something drives: of several solutions (a latch has two) the one with it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Guess {
    node: NodeId,
    volts: f64,
}

impl Prescribed {
    /// Those of `.ic` if `hold_ic`, else those of integrators alone, and the guesses of `.nodeset`.
    pub(super) fn of(circuit: &Circuit, hold_ic: bool) -> Self {
        let root = driven(circuit);
        let is_driven = |&&(a, b, _): &&Voltage| root[a.index()] == root[b.index()];
        let asked = circuit.initial_voltages.iter();
        let asked = asked.filter(|held| hold_ic || is_of_integrator(circuit, held));
        let (fixed, held): (Vec<&Voltage>, Vec<&Voltage>) = asked.partition(is_driven);
        let nodesets = circuit.nodesets.iter().filter(is_driven);
        let mut guesses: Vec<Guess> = Vec::new();
        for &(a, b, volts) in fixed.into_iter().chain(nodesets) {
            let guess = match (a, b) {
                (node, NodeId::GROUND) => Guess { node, volts },
                (NodeId::GROUND, node) => Guess {
                    node,
                    volts: -volts,
                },
                _ => continue,
            };
            if !guesses.iter().any(|known| known.node == guess.node) {
                guesses.push(guess);
            }
        }
        let currents = circuit.initial_currents.iter().filter(|_| hold_ic);
        Self {
            held: Held {
                voltages: held.into_iter().copied().collect(),
                currents: currents
                    .map(|(id, amperes)| (id.index(), *amperes))
                    .collect(),
            },
            guesses,
        }
    }
}

/// Whether a voltage is the value of an integrator among the `A` devices, which every operating point holds.
pub(super) fn is_of_integrator(circuit: &Circuit, &(node, ..): &Voltage) -> bool {
    is_inside(&circuit.nodes[node.index()])
}

/// Joins two nodes; whether they were not joined before.
fn join(root: &mut [usize], a: NodeId, b: NodeId) -> bool {
    let (a, b) = (root[a.index()], root[b.index()]);
    root.iter_mut().filter(|r| **r == b).for_each(|r| *r = a);
    a != b
}

/// By node: the first of those that voltage sources and shorts join it to.
fn driven(circuit: &Circuit) -> Vec<usize> {
    let mut root: Vec<usize> = (0..circuit.nodes.len()).collect();
    for element in &circuit.elements {
        let joins = match &element.kind {
            Kind::Resistor(r) => r.f64 == 0.0,
            Kind::VoltageSource(_) => true,
            Kind::Controlled { output, .. } | Kind::Function { output, .. } => {
                *output == Output::Voltage
            }
            _ => false,
        };
        if joins {
            join(&mut root, element.p, element.n);
        }
    }
    root
}

impl Guess {
    /// What an operating point found.
    pub(super) fn found(&self, point: &OperatingPoint) -> Self {
        Self {
            volts: point.nodes[self.node.index() - 1].1,
            ..*self
        }
    }

    /// Whether both are one but for rounding.
    pub(super) fn agrees(&self, other: &Self) -> bool {
        let size = self.volts.abs().max(other.volts.abs());
        (self.volts - other.volts).abs() <= CONSISTENT * size
    }

    /// What to say where the operating point has another voltage.
    pub(super) fn missed(&self, found: &Self, circuit: &Circuit) -> Note {
        let node = &circuit.nodes[self.node.index()];
        let here = |e: &&Element| [e.p, e.n].contains(&self.node);
        Note::of(
            "ic-not-held",
            circuit.elements.iter().find(here).map(|e| &e.name),
            format!(
                "a source drives v({node}), which starts at {} V; the {} V prescribed for it are a guess",
                found.volts, self.volts
            ),
        )
    }
}

/// Holds node voltages by sources; one per node or difference.
pub(super) fn hold_voltages(held: &[Voltage], statics: &mut Circuit) {
    for (k, &(a, b, volts)) in held.iter().enumerate() {
        let name = format!("ic:{k}");
        statics.elements.push(source(name, a, b, volts));
    }
}

/// Puts a source of its current in series with every inductor whose current is held.
pub(super) fn hold_currents(currents: &[(usize, f64)], statics: &mut Circuit) {
    for &(k, amperes) in currents {
        in_series(k, amperes, statics);
    }
}

fn in_series(k: usize, amperes: f64, statics: &mut Circuit) {
    let node = NodeId(statics.nodes.len() as u32);
    let name = format!("series:{}", statics.elements[k].name);
    statics.nodes.push(name.clone());
    let end = std::mem::replace(&mut statics.elements[k].n, node);
    statics.elements.push(Element {
        kind: Kind::CurrentSource(Source::constant(amperes)),
        ..source(name, node, end, 0.0)
    });
}

/// Takes the current from every inductor that would share it with a source which holds a voltage: the source has it all, as in
/// ngspice, so that it ends with the source. Returns these inductors.
pub(super) fn open_inductors(circuit: &Circuit, held: &Held, statics: &mut Circuit) -> Vec<usize> {
    if held.voltages.is_empty() {
        return Vec::new();
    }
    let is_given = |k: usize| held.currents.iter().any(|current| current.0 == k);
    let held = &held.voltages[..];
    let mut without = driven(circuit);
    let mut with = without.clone();
    for &(a, b, _) in held {
        join(&mut with, a, b);
    }
    let elements = circuit.elements.iter().enumerate();
    let inductors = elements.filter(|(k, e)| matches!(e.kind, Kind::Inductor(_)) && !is_given(*k));
    // Of several in one loop those at the held nodes.
    let is_held =
        |node: NodeId| node != NodeId::GROUND && held.iter().any(|h| h.0 == node || h.1 == node);
    let (at_held, others): (Vec<_>, Vec<_>) =
        inductors.partition(|(_, e)| is_held(e.p) || is_held(e.n));
    let mut opened = Vec::new();
    for (k, element) in others.into_iter().chain(at_held) {
        let shared = !join(&mut with, element.p, element.n);
        // A loop without a held voltage is the circuit's own.
        if shared && join(&mut without, element.p, element.n) {
            opened.push(k);
        }
    }
    for &k in &opened {
        in_series(k, 0.0, statics);
    }
    opened
}

/// Has everything that a guessed voltage controls see the guess.
pub(super) fn read_guesses(guesses: &[Guess], statics: &mut Circuit) {
    for guess in guesses {
        let node = NodeId(statics.nodes.len() as u32);
        let name = format!("guess:{}", statics.nodes[guess.node.index()]);
        statics.nodes.push(name.clone());
        for element in &mut statics.elements {
            let terms = match &mut element.kind {
                Kind::Controlled { control, .. } => &mut control.terms,
                Kind::Function { input, .. } => &mut input.terms,
                Kind::Switch(switch) => &mut switch.control.terms,
                _ => continue,
            };
            for (_, quantity) in terms {
                if *quantity == Quantity::Voltage(guess.node) {
                    *quantity = Quantity::Voltage(node);
                }
            }
        }
        statics
            .elements
            .push(source(name, node, NodeId::GROUND, guess.volts));
    }
}
