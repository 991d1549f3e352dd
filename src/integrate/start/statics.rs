//! The circuit of an operating point: everything observed, lines as shorts, what only capacitors hold tied to 0 V.

use super::prescribed::Voltage;
use crate::circuit::source::Wave;
use crate::circuit::{Circuit, Element, ElementId, Kind, NodeId, Output, Probe, Probed, Source};
use crate::integrate::Note;

/// The circuit with all node voltages and element currents as probes.
pub(super) fn observed_circuit(circuit: &Circuit) -> Circuit {
    let currents = circuit.currents_of(|_| true);
    Circuit {
        probes: circuit.all_voltages().chain(currents).collect(),
        ..circuit.clone()
    }
}

/// Has what leaves the ends of lines arrive at the others at once, which makes them shorts: v₁ = v₂, i₁ = −i₂.
pub(super) fn without_delay(statics: &mut Circuit) {
    for line in statics.lines.clone() {
        for (here, there) in [(0, 1), (1, 0)] {
            let control = line.leaving(there, statics);
            statics.elements[line.ports[here].wave.index()].kind = Kind::Controlled {
                output: Output::Voltage,
                control,
            };
        }
    }
}

pub(super) fn source(name: String, p: NodeId, n: NodeId, volts: f64) -> Element {
    let kind = Kind::VoltageSource(Source {
        dc: volts,
        wave: Wave::Dc(volts),
    });
    Element {
        name,
        p,
        n,
        kind,
        ic: None,
        span: None,
    }
}

/// Nodes joined by anything that carries direct current or fixes a voltage.
pub(super) fn conductive(circuit: &Circuit, with_capacitors: bool) -> Vec<usize> {
    let mut root: Vec<usize> = (0..circuit.nodes.len()).collect();
    fn find(root: &mut [usize], mut i: usize) -> usize {
        while root[i] != i {
            root[i] = root[root[i]];
            i = root[i];
        }
        i
    }
    for e in &circuit.elements {
        let joins = match &e.kind {
            Kind::Capacitor(_) => with_capacitors,
            Kind::CurrentSource(_) => false,
            Kind::Controlled { output, .. } | Kind::Function { output, .. } => {
                *output == crate::circuit::Output::Voltage
            }
            _ => true,
        };
        if joins {
            let (a, b) = (find(&mut root, e.p.index()), find(&mut root, e.n.index()));
            // The smaller index stays the root: ground, else the first node in file order.
            root[a.max(b)] = a.min(b);
        }
    }
    (0..root.len()).map(|i| find(&mut root, i)).collect()
}

/// Ties every part of the circuit that only capacitors hold to 0 V; returns a node of each.
pub(super) fn tie_floating(
    circuit: &Circuit,
    statics: &mut Circuit,
    held: &[Voltage],
    notes: &mut Vec<Note>,
) -> Vec<usize> {
    let mut tied = Vec::new();
    let (dc, all) = (conductive(circuit, false), conductive(circuit, true));
    for (i, &root) in dc.iter().enumerate() {
        // Its own root, not ground, and joined by capacitors to something with a smaller index.
        let floats = i == root && i != 0 && all[i] != i;
        let held = held.iter().any(|(a, b, _)| {
            [a, b]
                .iter()
                .any(|n| n.index() != 0 && dc[n.index()] == root)
        });
        if floats && !held {
            let name = &circuit.nodes[i];
            let tie = source(format!("tie:{name}"), NodeId(i as u32), NodeId::GROUND, 0.0);
            statics.probes.push(Probe {
                name: format!("i({})", tie.name),
                what: Probed::Current(ElementId(statics.elements.len() as u32)),
            });
            statics.elements.push(tie);
            let here = |e: &&Element| [e.p, e.n].iter().any(|n| n.index() == i);
            notes.push(Note::of(
                "floating-start",
                circuit.elements.iter().find(here).map(|e| &e.name),
                format!("node {name} is held by capacitors alone and starts at 0 V"),
            ));
            tied.push(i);
        }
    }
    tied
}

/// Elements that drive a current into the part of the circuit that a node belongs to and only capacitors hold.
pub(super) fn feeding(circuit: &Circuit, node: usize) -> impl Iterator<Item = &str> {
    let parts = conductive(circuit, false);
    let inside = move |id: NodeId| parts[id.index()] == parts[node];
    let elements = circuit.elements.iter();
    elements
        .filter(move |e| inside(e.p) != inside(e.n) && !matches!(e.kind, Kind::Capacitor(_)))
        .map(|e| e.name.as_str())
}
