//! Spanning forests with their fundamental loops and cut-sets.

use std::collections::VecDeque;

use petgraph::unionfind::UnionFind;

/// A spanning forest grown in a given order of edges.
pub(super) struct Graph {
    edges: Vec<(usize, usize)>,
    pub(super) in_tree: Vec<bool>,
    /// For each node the tree edges at it.
    at: Vec<Vec<usize>>,
}

impl Graph {
    pub(super) fn new(nodes: usize, edges: Vec<(usize, usize)>, order: &[usize]) -> Self {
        let mut sets = UnionFind::<usize>::new(nodes);
        let mut in_tree = vec![false; edges.len()];
        let mut at = vec![Vec::new(); nodes];
        for &k in order {
            let (p, n) = edges[k];
            if sets.union(p, n) {
                in_tree[k] = true;
                at[p].push(k);
                at[n].push(k);
            }
        }
        Self { edges, in_tree, at }
    }

    /// The edges of the loop that a link closes, the link last, each with the sign of its voltage around the loop.
    pub(super) fn loop_of(&self, link: usize) -> Vec<(usize, f64)> {
        let (p, n) = self.edges[link];
        // Breadth-first from p to n through the tree; `via` is the edge by which a node was reached.
        let mut via: Vec<Option<usize>> = vec![None; self.at.len()];
        let mut queue = VecDeque::from([p]);
        while let Some(node) = queue.pop_front() {
            for &k in &self.at[node] {
                let next = self.far(k, node);
                if next != p && via[next].is_none() {
                    via[next] = Some(k);
                    queue.push_back(next);
                }
            }
        }
        let mut members = vec![(link, -1.0)];
        let mut node = n;
        while let (true, Some(k)) = (node != p, via[node]) {
            let before = self.far(k, node);
            members.push((k, if self.edges[k].0 == before { 1.0 } else { -1.0 }));
            node = before;
        }
        members.reverse();
        members
    }

    /// The edges between the two parts that removing a tree edge leaves, each with the sign of its current.
    pub(super) fn cut_of(&self, branch: usize) -> Vec<(usize, f64)> {
        let (p, _) = self.edges[branch];
        let mut inside = vec![false; self.at.len()];
        inside[p] = true;
        let mut queue = VecDeque::from([p]);
        while let Some(node) = queue.pop_front() {
            for &k in self.at[node].iter().filter(|&&k| k != branch) {
                let next = self.far(k, node);
                if !inside[next] {
                    inside[next] = true;
                    queue.push_back(next);
                }
            }
        }
        let crossing = self
            .edges
            .iter()
            .enumerate()
            .filter(|(_, e)| inside[e.0] != inside[e.1]);
        crossing
            .map(|(k, e)| (k, if inside[e.0] { 1.0 } else { -1.0 }))
            .collect()
    }

    fn far(&self, edge: usize, node: usize) -> usize {
        let (p, n) = self.edges[edge];
        if p == node { n } else { p }
    }
}
