//! Parts of gates and flip-flops whose volts and amperes are numbers.

use petgraph::unionfind::UnionFind;

use super::{Circuit, Element, Kind, NodeId, is_inside};

impl Circuit {
    /// By element: a part of an `A` device from which no current flows to a pin nor to what stores energy. It stands for what is true or false, not for power.
    pub(crate) fn logic(&self) -> Vec<bool> {
        let mut joined = UnionFind::<usize>::new(self.nodes.len());
        let inside: Vec<bool> = self.elements.iter().map(|e| is_inside(&e.name)).collect();
        let parts = self.elements.iter().zip(&inside);
        for (element, _) in parts.filter(|(_, inside)| **inside) {
            if element.p != NodeId::GROUND && element.n != NodeId::GROUND {
                joined.union(element.p.index(), element.n.index());
            }
        }
        let mut has_power = vec![false; self.nodes.len()];
        for (k, name) in self.nodes.iter().enumerate().skip(1) {
            has_power[joined.find(k)] |= !is_inside(name);
        }
        let stores = |e: &&Element| matches!(e.kind, Kind::Capacitor(_) | Kind::Inductor(_));
        for element in self.elements.iter().filter(stores) {
            for node in [element.p, element.n] {
                has_power[joined.find(node.index())] |= node != NodeId::GROUND;
            }
        }
        let reaches = |node: NodeId| node != NodeId::GROUND && has_power[joined.find(node.index())];
        let parts = self.elements.iter().zip(inside);
        let is_logic = |e: &Element| !reaches(e.p) && !reaches(e.n);
        parts.map(|(e, inside)| inside && is_logic(e)).collect()
    }
}
