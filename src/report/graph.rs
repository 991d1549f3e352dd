//! The circuit as a graph: nets are vertices, elements are edges.

use petgraph::dot::{Config, Dot};
use petgraph::graph::{NodeIndex, UnGraph};

use super::si;
use crate::circuit::{Circuit, Element, Kind, NodeId};
use crate::law::Law;

/// The name of ground.
const GROUND: &str = "0";

/// The graph in Graphviz's language: `graph { 0 [ label = "out" ] … 0 -- 1 [ label = "r1 1 kΩ" ] }`.
#[must_use]
pub fn dot(circuit: &Circuit) -> String {
    let mut graph = UnGraph::<&str, String>::default();
    for name in &circuit.nodes {
        graph.add_node(name);
    }
    let end = |node: NodeId| NodeIndex::new(node.index());
    for element in &circuit.elements {
        graph.add_edge(end(element.p), end(element.n), label(element));
    }
    let dot = Dot::with_attr_getters(
        &graph,
        &[Config::EdgeNoLabel, Config::NodeNoLabel],
        &|_, edge| format!("label = \"{}\"", escaped(edge.weight())),
        &|_, (_, name)| {
            let shape = if *name == GROUND { "box" } else { "ellipse" };
            format!("label = \"{}\", shape = {shape}", escaped(name))
        },
    );
    dot.to_string()
}

fn label(element: &Element) -> String {
    let value = match &element.kind {
        Kind::Resistor(v) => si::quantity(v.f64, "Ω", 4),
        Kind::Capacitor(v) => si::quantity(v.f64, "F", 4),
        Kind::Inductor(v) => si::quantity(v.f64, "H", 4),
        Kind::VoltageSource(_) => "V source".into(),
        Kind::CurrentSource(_) => "A source".into(),
        Kind::Controlled { .. } => "controlled".into(),
        Kind::Function { law, .. } | Kind::Device(law) => law_name(law).replace('_', " "),
        Kind::Switch(_) => "switch".into(),
    };
    format!("{} {value}", element.name)
}

fn law_name(law: &Law) -> &'static str {
    match law {
        Law::Diode { .. } if *law == Law::ideal_diode() => "ideal_diode",
        Law::Diode { .. } => "diode",
        Law::Curve(_) | Law::Exponential(_) | Law::Rounded(_) => law.kind(),
    }
}

fn escaped(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circuit(nodes: &[&str], elements: &[(&str, u32, u32)]) -> Circuit {
        Circuit {
            nodes: nodes.iter().map(|&n| n.into()).collect(),
            elements: elements
                .iter()
                .map(|&(name, p, n)| Element {
                    name: name.into(),
                    p: NodeId(p),
                    n: NodeId(n),
                    kind: if name.starts_with('d') {
                        Kind::Device(Law::ideal_diode())
                    } else {
                        Kind::Resistor(1e3.into())
                    },
                    ic: None,
                    span: None,
                })
                .collect(),
            ..Circuit::default()
        }
    }

    #[test]
    fn every_net_is_a_vertex_and_every_element_an_edge() {
        let text = dot(&circuit(
            &["0", "in", "n\"1\""],
            &[("r1", 1, 2), ("d1", 2, 0)],
        ));
        insta::assert_snapshot!(text, @r#"
        graph {
            0 [ label = "0", shape = box]
            1 [ label = "in", shape = ellipse]
            2 [ label = "n\"1\"", shape = ellipse]
            1 -- 2 [ label = "r1 1 kΩ"]
            2 -- 0 [ label = "d1 ideal diode"]
        }
        "#);
    }
}
