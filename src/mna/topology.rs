//! What the graph of a circuit says before any number is looked at: the loops and cut-sets that make a circuit
//! impossible or take a state away, and nodes that lead nowhere.

use petgraph::unionfind::UnionFind;

use super::graph::Graph;
use crate::algebra::Field;
use crate::circuit::source::Wave;
use crate::circuit::{Circuit, Element, Kind, NodeId, Output};
use crate::diagnostic::Diagnostic;

/// The classes of the normal tree, in its order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Class {
    Voltage,
    Capacitor,
    Middle,
    Inductor,
    Current,
}

fn class(element: &Element) -> Class {
    match &element.kind {
        Kind::Resistor(r) if r.f64 == 0.0 => Class::Voltage,
        Kind::Inductor(l) if l.f64 == 0.0 => Class::Voltage,
        Kind::Capacitor(c) if c.f64 == 0.0 => Class::Current,
        Kind::VoltageSource(_) => Class::Voltage,
        Kind::CurrentSource(_) => Class::Current,
        Kind::Controlled { output, .. } | Kind::Function { output, .. } => match output {
            Output::Voltage => Class::Voltage,
            Output::Current => Class::Current,
        },
        Kind::Capacitor(_) => Class::Capacitor,
        Kind::Inductor(_) => Class::Inductor,
        Kind::Resistor(_) | Kind::Device(_) | Kind::Switch(_) => Class::Middle,
    }
}

/// The nodes of every part of the circuit without a path to ground, in file order: the first is its reference. Terminals
/// are joined by every element; a controlled source joins its output terminals only, and coupled inductors are no paths.
#[must_use]
pub fn islands(circuit: &Circuit) -> Vec<Vec<usize>> {
    let mut parts = UnionFind::<usize>::new(circuit.nodes.len());
    for element in &circuit.elements {
        parts.union(element.p.index(), element.n.index());
    }
    let ground = NodeId::GROUND.index();
    let mut islands: Vec<Vec<usize>> = Vec::new();
    for node in (1..circuit.nodes.len()).filter(|&node| !parts.equiv(node, ground)) {
        match islands.iter_mut().find(|part| parts.equiv(part[0], node)) {
            Some(part) => part.push(node),
            None => islands.push(vec![node]),
        }
    }
    islands
}

/// The spanning forest grown in the order of the classes, and that order: capacitor links close loops of capacitors and
/// voltage sources, inductors in the tree form cut-sets with current sources.
fn forest(circuit: &Circuit) -> (Graph, Vec<usize>) {
    let mut order: Vec<usize> = (0..circuit.elements.len()).collect();
    order.sort_by_key(|&k| class(&circuit.elements[k]));
    let edges = (0..circuit.elements.len())
        .map(|k| ends(circuit, k))
        .collect();
    (Graph::new(circuit.nodes.len(), edges, &order), order)
}

/// Names of the elements of the normal tree, and of the links that close its loops; voltage sources first, then
/// capacitors, everything resistive, inductors, current sources.
#[must_use]
pub fn normal_tree(circuit: &Circuit) -> (Vec<String>, Vec<String>) {
    let (graph, order) = forest(circuit);
    let (tree, links): (Vec<usize>, Vec<usize>) = order.iter().partition(|&&k| graph.in_tree[k]);
    let names = |list: Vec<usize>| {
        let name = |k: usize| circuit.elements[k].name.clone();
        list.into_iter().map(name).collect()
    };
    (names(tree), names(links))
}

/// Loops of voltage sources and cut-sets of current sources (errors); capacitor loops and inductor cut-sets
/// (notes); with the elements by name.
#[must_use]
pub fn findings(circuit: &Circuit) -> Vec<Diagnostic> {
    let (graph, _) = forest(circuit);
    let mut diagnostics = Vec::new();
    for (k, element) in circuit.elements.iter().enumerate() {
        let class = class(element);
        let finding = match (class, graph.in_tree[k]) {
            (Class::Voltage, false) => voltage_loop(circuit, &graph.loop_of(k)),
            (Class::Current, true) => current_cut(circuit, &graph.cut_of(k)),
            (Class::Capacitor, false) => capacitor_loop(circuit, &graph.loop_of(k)),
            (Class::Inductor, true) => inductor_cut(circuit, &graph.cut_of(k)),
            _ => None,
        };
        diagnostics.extend(finding);
    }
    diagnostics
}

/// An element as an edge of the graph, for messages about a position of devices and switches.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edge {
    /// The element.
    pub name: String,
    /// Its nodes.
    pub ends: (usize, usize),
    /// Its class in the normal tree.
    pub(crate) class: Class,
}

/// The edges of a circuit.
pub(crate) fn edges(circuit: &Circuit) -> Vec<Edge> {
    let edge = |(k, e): (usize, &Element)| Edge {
        name: e.name.clone(),
        ends: ends(circuit, k),
        class: class(e),
    };
    circuit.elements.iter().enumerate().map(edge).collect()
}

/// The loop of voltage sources and shorts, or else the cut-set of current sources and open branches, that one of the
/// named elements is in; in the order of the edges.
pub(crate) fn conflict(edges: &[Edge], named: &[String]) -> Option<Vec<String>> {
    let nodes = edges.iter().map(|e| e.ends.0.max(e.ends.1) + 1).max()?;
    let mut order: Vec<usize> = (0..edges.len()).collect();
    order.sort_by_key(|&k| edges[k].class);
    let graph = Graph::new(nodes, edges.iter().map(|e| e.ends).collect(), &order);
    let loops = (0..edges.len())
        .filter(|&k| edges[k].class == Class::Voltage && !graph.in_tree[k])
        .map(|k| graph.loop_of(k));
    let cuts = (0..edges.len())
        .filter(|&k| edges[k].class == Class::Current && graph.in_tree[k])
        .map(|k| graph.cut_of(k));
    loops.chain(cuts).find_map(|members| {
        let mut members: Vec<usize> = members.into_iter().map(|m| m.0).collect();
        members.sort_unstable();
        let names: Vec<String> = members.iter().map(|&k| edges[k].name.clone()).collect();
        names
            .iter()
            .any(|name| named.contains(name))
            .then_some(names)
    })
}

fn ends(circuit: &Circuit, k: usize) -> (usize, usize) {
    (circuit.elements[k].p.index(), circuit.elements[k].n.index())
}

fn listed(circuit: &Circuit, members: &[(usize, f64)]) -> String {
    let mut members: Vec<usize> = members.iter().map(|m| m.0).collect();
    members.sort_unstable();
    let names: Vec<&str> = members
        .iter()
        .map(|&k| circuit.elements[k].name.as_str())
        .collect();
    match names.as_slice() {
        [rest @ .., last] if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        _ => names.join(", "),
    }
}

/// Whether Σ ± source = 0 for all time, `None` where something other than independent sources and shorts takes part.
fn cancels(circuit: &Circuit, members: &[(usize, f64)]) -> Option<bool> {
    let mut constant = <crate::algebra::Rational as Field>::zero();
    let mut sums: Vec<(&Wave, f64)> = Vec::new();
    for &(k, sign) in members {
        match &circuit.elements[k].kind {
            Kind::VoltageSource(source) | Kind::CurrentSource(source) => match &source.wave {
                Wave::Dc(value) => constant += crate::algebra::rational(sign * value),
                wave => match sums.iter_mut().find(|(w, _)| *w == wave) {
                    Some((_, sum)) => *sum += sign,
                    None => sums.push((wave, sign)),
                },
            },
            Kind::Resistor(_) | Kind::Inductor(_) | Kind::Capacitor(_) => {}
            _ => return None,
        }
    }
    Some(Field::is_zero(&constant) && sums.iter().all(|(_, sum)| *sum == 0.0))
}

fn voltage_loop(circuit: &Circuit, members: &[(usize, f64)]) -> Option<Diagnostic> {
    if cancels(circuit, members)? {
        return None;
    }
    let span = members.last().and_then(|m| circuit.elements[m.0].span);
    let what = listed(circuit, members);
    let message = if let [_] = members {
        format!("{what} is shorted")
    } else {
        format!("{what} form a loop of voltage sources that contradict each other")
    };
    Some(
        Diagnostic::error("voltage-loop", span, message)
            .help("a small resistor in the loop decides how the sources share"),
    )
}

fn current_cut(circuit: &Circuit, members: &[(usize, f64)]) -> Option<Diagnostic> {
    if cancels(circuit, members)? {
        return None;
    }
    let span = members.first().and_then(|m| circuit.elements[m.0].span);
    let what = listed(circuit, members);
    let message = if let [_] = members {
        format!("the current of {what} has no way back")
    } else {
        format!("{what} are a cut-set of current sources that contradict each other")
    };
    Some(
        Diagnostic::error("current-cutset", span, message)
            .help("a resistor across one of them gives its current a path"),
    )
}

fn capacitor_loop(circuit: &Circuit, members: &[(usize, f64)]) -> Option<Diagnostic> {
    let link = &circuit.elements[members.last()?.0];
    let what = listed(circuit, members);
    let message = if let [_] = members {
        format!("{what} is shorted: its voltage is 0")
    } else {
        format!("{what} form a loop: the capacitor voltages in it are not independent states")
    };
    Some(Diagnostic::note("capacitor-loop", link.span, message))
}

fn inductor_cut(circuit: &Circuit, members: &[(usize, f64)]) -> Option<Diagnostic> {
    let mut inductors = members
        .iter()
        .filter(|m| class(&circuit.elements[m.0]) == Class::Inductor);
    let first = &circuit.elements[inductors.next()?.0];
    let what = listed(circuit, members);
    let message = if let [_] = members {
        format!("{what} leads nowhere: its current is 0")
    } else {
        format!("{what} are a cut-set: the inductor currents in it are not independent states")
    };
    Some(Diagnostic::note("inductor-cutset", first.span, message))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Severity;
    use crate::mna::fixture::{circuit, drive};

    fn messages(text: &str) -> Vec<(&'static str, String)> {
        findings(&circuit(text))
            .into_iter()
            .map(|d| (d.code, d.message))
            .collect()
    }

    #[test]
    fn capacitors_across_a_source_are_links_and_inductors_come_last() {
        let (tree, links) = normal_tree(&circuit("l1 1 2 1\n c1 1 0 1\n r1 2 0 1\n v1 1 0 1"));
        assert_eq!(tree, ["v1", "r1"]);
        assert_eq!(links, ["c1", "l1"]);
    }

    #[test]
    fn transformer_secondaries_are_islands() {
        let secondaries = circuit("l1 1 0 1\n l2 2 3 1\n r2 3 2 1\n l3 4 5 1\n r3 4 5 1");
        let names: Vec<Vec<&str>> = islands(&secondaries)
            .iter()
            .map(|part| {
                part.iter()
                    .map(|&n| secondaries.nodes[n].as_str())
                    .collect()
            })
            .collect();
        assert_eq!(names, [["2", "3"], ["4", "5"]]);
    }

    #[test]
    fn voltage_sources_in_a_loop_are_named() {
        let found = messages("v1 1 0 5\n v2 2 1 1\n r1 2 0 1k\n v3 2 0 7");
        let message = "v1, v2 and v3 form a loop of voltage sources that contradict each other";
        assert_eq!(found, [("voltage-loop", message.to_string())]);
        assert_eq!(messages("v1 1 0 5\n v2 2 1 1\n r1 2 0 1k\n v3 2 0 6"), []);
        assert_eq!(messages("v1 1 1 5\n r1 1 0 1")[0].1, "v1 is shorted");
    }

    #[test]
    fn equal_waveforms_agree_only_in_the_same_direction() {
        let wave = Wave::Exp {
            v1: 0.0,
            v2: 1.0,
            rise_delay: 0.0,
            rise_tau: 1.0,
            fall_delay: 2.0,
            fall_tau: 1.0,
        };
        for (second, faults) in [("v2 1 0 0", 0), ("v2 0 1 0", 1)] {
            let mut c = circuit(&format!("v1 1 0 0\n r1 1 0 1\n {second}"));
            drive(&mut c, "v1", wave.clone());
            drive(&mut c, "v2", wave.clone());
            assert_eq!(findings(&c).len(), faults, "{second}");
        }
    }

    #[test]
    fn current_sources_without_a_way_back_are_named() {
        let found = messages("i1 0 1 1\n i2 1 2 2\n r1 2 0 1k");
        let message = "i1 and i2 are a cut-set of current sources that contradict each other";
        assert_eq!(found, [("current-cutset", message.to_string())]);
        assert_eq!(messages("i1 0 1 1\n i2 1 2 1\n r1 2 0 1k"), []);
        let alone = messages("i1 0 1 1\n r1 2 0 1k");
        assert_eq!(alone[0].1, "the current of i1 has no way back");
    }

    #[test]
    fn loops_of_capacitors_and_cut_sets_of_inductors_are_notes() {
        let t = findings(&circuit("v1 1 0 5\n c1 1 2 1u\n c2 2 0 1u\n r1 2 0 1"));
        assert_eq!(t.len(), 1);
        assert_eq!(t[0].severity, Severity::Note);
        assert_eq!(
            t[0].message,
            "v1, c1 and c2 form a loop: the capacitor voltages in it are not independent states"
        );
        let found = messages("v1 1 0 5\n r1 1 2 1\n l1 2 3 1m\n l2 3 0 1m");
        assert_eq!(
            found,
            [(
                "inductor-cutset",
                "l1 and l2 are a cut-set: the inductor currents in it are not independent states"
                    .to_string()
            )]
        );
    }
}
