//! The circuit as a graph: nets are vertices, elements are edges.

use layout::backends::svg::SVGWriter;
use layout::gv::{DotParser, GraphBuilder};
use petgraph::dot::{Config, Dot};
use petgraph::graph::{NodeIndex, UnGraph};

use super::{PictureError, si};
use crate::circuit::{Circuit, Element, Kind, NodeId};
use crate::law::Law;

/// The name of ground.
const GROUND: &str = "0";
/// Elements up to which the drawing's edge crossings are minimised; beyond it that takes too long.
const UNTANGLED: usize = 150;

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
    written(&graph)
}

/// The graph drawn in layers, with a ground of its own for each grounded element as in a schematic.
///
/// # Errors
/// [`PictureError::Draw`] when the layout refuses the graph.
pub fn svg(circuit: &Circuit) -> Result<String, PictureError> {
    let mut graph = UnGraph::<&str, String>::default();
    let nets: Vec<_> = circuit
        .nodes
        .iter()
        .map(|name| graph.add_node(name))
        .collect();
    for element in &circuit.elements {
        let mut end = |node: NodeId| {
            if node == NodeId::GROUND {
                graph.add_node(GROUND)
            } else {
                nets[node.index()]
            }
        };
        let (p, n) = (end(element.p), end(element.n));
        graph.add_edge(p, n, label(element));
    }
    graph.retain_nodes(|graph, net| graph.neighbors(net).next().is_some());
    if graph.node_count() == 0 {
        return Err(PictureError::Empty("no element connects two nodes"));
    }
    let tree = DotParser::new(&written(&graph))
        .process()
        .map_err(PictureError::Draw)?;
    let mut builder = GraphBuilder::new();
    builder.visit_graph(&tree);
    let mut picture = SVGWriter::new();
    builder.get().do_it(
        false,
        circuit.elements.len() > UNTANGLED,
        false,
        &mut picture,
    );
    Ok(picture.finalize())
}

fn written(graph: &UnGraph<&str, String>) -> String {
    let dot = Dot::with_attr_getters(
        graph,
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

    #[test]
    fn parallel_shorted_and_lonely_elements_are_drawn() {
        let svg = svg(&circuit(
            &["0", "a", "b", "c"],
            &[("r1", 1, 0), ("r2", 1, 0), ("r3", 1, 1), ("d1", 2, 3)],
        ));
        let svg = svg.unwrap();
        for name in ["r1 1 kΩ", "r2 1 kΩ", "r3 1 kΩ", "d1 ideal diode"] {
            assert!(svg.contains(name), "{name} in {svg}");
        }
        assert!(matches!(
            super::svg(&circuit(&["0"], &[])),
            Err(PictureError::Empty(_))
        ));
    }

    #[test]
    fn a_ladder_of_two_hundred_sections_is_laid_out() {
        let nodes: Vec<String> = (0..=200).map(|k| k.to_string()).collect();
        let names: Vec<&str> = nodes.iter().map(String::as_str).collect();
        let elements: Vec<_> = (1..=200)
            .flat_map(|k| [("r1", k, k - 1), ("d1", k, 0)])
            .collect();
        assert!(svg(&circuit(&names, &elements)).unwrap().contains("200"));
    }
}
