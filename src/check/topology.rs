//! The graph of a circuit: parts without a path to ground, and its normal tree.

use petgraph::unionfind::UnionFind;

use super::NormalTree;
use crate::circuit::{Circuit, Element, Kind, NodeId, Output};

/// Nodes (the reference, first in file order, first) of every part of the circuit without a path to ground. Coupled
/// inductors and controls are no paths.
#[must_use]
pub fn islands(circuit: &Circuit) -> Vec<Vec<String>> {
    let mut parts = UnionFind::<usize>::new(circuit.nodes.len());
    for element in &circuit.elements {
        parts.union(element.p.index(), element.n.index());
    }
    let ground = NodeId::GROUND.index();
    let mut islands: Vec<(usize, Vec<String>)> = Vec::new();
    for (node, name) in circuit.nodes.iter().enumerate().skip(1) {
        if parts.equiv(node, ground) {
            continue;
        }
        let part = parts.find(node);
        match islands.iter_mut().find(|(p, _)| *p == part) {
            Some((_, names)) => names.push(name.clone()),
            None => islands.push((part, vec![name.clone()])),
        }
    }
    islands.into_iter().map(|(_, names)| names).collect()
}

/// The place of an element in the order in which the normal tree takes branches: voltage sources, capacitors, everything
/// resistive, inductors, current sources.
fn class(element: &Element) -> u8 {
    match &element.kind {
        Kind::VoltageSource(_)
        | Kind::Controlled {
            output: Output::Voltage,
            ..
        }
        | Kind::Function {
            output: Output::Voltage,
            ..
        } => 0,
        Kind::Capacitor(_) => 1,
        Kind::Resistor(_) | Kind::Device(_) | Kind::Switch(_) => 2,
        Kind::Inductor(_) => 3,
        Kind::CurrentSource(_)
        | Kind::Controlled {
            output: Output::Current,
            ..
        }
        | Kind::Function {
            output: Output::Current,
            ..
        } => 4,
    }
}

/// The normal tree (Kruskal's algorithm in the order of [`class`], file order within a class) and the links. Capacitor links
/// close loops of capacitors and voltage sources; inductors in the tree form cut-sets with current sources.
#[must_use]
pub fn normal_tree(circuit: &Circuit) -> NormalTree {
    let mut parts = UnionFind::<usize>::new(circuit.nodes.len());
    let mut branches: Vec<&Element> = circuit.elements.iter().collect();
    branches.sort_by_key(|element| class(element));
    let mut tree = NormalTree::default();
    for element in branches {
        let list = if parts.union(element.p.index(), element.n.index()) {
            &mut tree.tree
        } else {
            &mut tree.links
        };
        list.push(element.name.clone());
    }
    tree
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::Value;
    use crate::circuit::Source;

    fn circuit(nodes: &[&str], elements: &[(&str, u32, u32, Kind)]) -> Circuit {
        Circuit {
            nodes: nodes.iter().map(|n| (*n).to_string()).collect(),
            elements: elements
                .iter()
                .map(|(name, p, n, kind)| Element {
                    name: (*name).to_string(),
                    p: NodeId(*p),
                    n: NodeId(*n),
                    kind: kind.clone(),
                    ic: None,
                    span: None,
                })
                .collect(),
            ..Circuit::default()
        }
    }

    #[test]
    fn capacitors_across_a_source_are_links_and_inductors_come_last() {
        let value = Value::binary(1.0);
        let found = normal_tree(&circuit(
            &["0", "a", "b"],
            &[
                ("l1", 1, 2, Kind::Inductor(value)),
                ("c1", 1, 0, Kind::Capacitor(value)),
                ("r1", 2, 0, Kind::Resistor(value)),
                ("v1", 1, 0, Kind::VoltageSource(Source::constant(1.0))),
            ],
        ));
        assert_eq!(found.tree, ["v1", "r1"]);
        assert_eq!(found.links, ["c1", "l1"]);
    }

    #[test]
    fn a_transformer_secondary_is_an_island() {
        let value = Value::binary(1.0);
        let secondary = circuit(
            &["0", "in", "s1", "s2"],
            &[
                ("l1", 1, 0, Kind::Inductor(value)),
                ("l2", 2, 3, Kind::Inductor(value)),
                ("r2", 3, 2, Kind::Resistor(value)),
            ],
        );
        assert_eq!(islands(&secondary), [["s1", "s2"]]);
    }
}
