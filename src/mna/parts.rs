//! A multiport as parts that share nothing but ground and sources.
//!
//! Columns that sources determine alone are *known*: potentials of nodes that voltage sources hold. The one equation that holds the
//! current of a voltage source (the voltage of a current source) *tells* this quantity as the sum of what the parts add to it, and joins
//! nothing. Every other equation joins the unknown columns that it holds, and what is joined is a part. A part has copies of the sources
//! that act on it; a reading or power of the whole is the sum of those of its parts.

mod alike;
mod cut;

use std::collections::BTreeSet;

use petgraph::unionfind::UnionFind;

use super::{Column, LatchPort, StandardMultiport, StaticMultiport};
use crate::algebra::{Ball, Field};

/// A part of a multiport.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    /// The circuit that it is by itself; its probes are what it adds to those of the whole.
    pub(crate) multiport: StandardMultiport,
    /// The places of its storage, pairs, switches and probes in the whole, increasing.
    pub(crate) storage: Vec<usize>,
    /// See `storage`.
    pub(crate) pairs: Vec<usize>,
    /// See `storage`.
    pub(crate) switches: Vec<usize>,
    /// See `storage`.
    pub(crate) probes: Vec<usize>,
}

impl StandardMultiport {
    /// Its parts, in the order of their first columns; none where all storage, devices and switches are one. What moves by itself nowhere
    /// belongs to the first part.
    pub(crate) fn parts(&self) -> Vec<Part> {
        let mut barred = BTreeSet::new();
        loop {
            let mut columns = Columns::of(self, &barred);
            match columns.join() {
                Ok(()) => return cut::parts(self, columns),
                // A power has two unknown factors: the quantity is no mere sum.
                Err(column) => barred.insert(column),
            };
        }
    }
}

/// What is known of the columns of a multiport.
struct Columns<'a> {
    whole: &'a StaticMultiport,
    /// By observed quantity: the equation that defines it.
    definition: Vec<usize>,
    /// By equation: it defines a probe or a factor of a power, which joins nothing.
    reads: Vec<bool>,
    /// By column: sources determine it.
    known: Vec<bool>,
    /// By column: the equation that determines it, if it is no source itself.
    known_by: Vec<Option<usize>>,
    /// By equation: the column that it tells, and by column the equation that tells it.
    tells: Vec<Option<Column>>,
    told_by: Vec<Option<usize>>,
    /// The told columns; the equation of one holds none of those before it.
    told: Vec<Column>,
    joined: UnionFind<usize>,
}

impl<'a> Columns<'a> {
    /// Of a multiport in which these other quantities of sources are not told.
    fn of(whole: &'a StaticMultiport, barred: &BTreeSet<Column>) -> Self {
        let (columns, equations) = (whole.columns.len(), whole.equations.len());
        let mut observed = vec![None; columns];
        for (k, quantity) in whole.observed.iter().enumerate() {
            observed[quantity.column] = Some(k);
        }
        let mut controls = vec![false; whole.observed.len()];
        whole
            .switches
            .iter()
            .for_each(|s| controls[s.control] = true);
        let mut definition = vec![usize::MAX; whole.observed.len()];
        let mut reads = vec![false; equations];
        for (e, equation) in whole.equations.iter().enumerate() {
            if let Some(k) = equation.iter().find_map(|&(_, c)| observed[c]) {
                definition[k] = e;
                reads[e] = !controls[k];
            }
        }
        let mut found = Self {
            whole,
            definition,
            reads,
            known: vec![false; columns],
            known_by: vec![None; columns],
            tells: vec![None; equations],
            told_by: vec![None; columns],
            told: Vec::new(),
            joined: UnionFind::new(columns),
        };
        found.known[StaticMultiport::ONE] = true;
        for source in &whole.sources {
            found.known[source.value] = true;
            if let Some(rate) = source.rate {
                found.known[rate] = true;
            }
        }
        let holders = found.holders();
        found.tell(&holders, barred);
        found.determine(&holders);
        found
    }

    /// By column the equations that hold it, but for those that read.
    fn holders(&self) -> Vec<Vec<usize>> {
        let mut holders: Vec<Vec<usize>> = vec![Vec::new(); self.known.len()];
        for (e, equation) in self.whole.equations.iter().enumerate() {
            if self.reads[e] {
                continue;
            }
            for &(_, c) in equation {
                // A column that occurs twice may cancel: it is held by none alone.
                holders[c].push(e);
            }
        }
        holders
    }

    /// Finds the equations that tell the other quantities of sources: those in series follow each other.
    fn tell(&mut self, holders: &[Vec<usize>], barred: &BTreeSet<Column>) {
        let mut others = vec![false; self.known.len()];
        let sources = self.whole.sources.iter().map(|source| source.other);
        sources
            .clone()
            .filter(|c| !barred.contains(c))
            .for_each(|c| others[c] = true);
        let mut left: Vec<usize> = holders.iter().map(Vec::len).collect();
        let mut queue: Vec<Column> = sources
            .rev()
            .filter(|&c| others[c] && left[c] == 1)
            .collect();
        while let Some(c) = queue.pop() {
            let mut free = holders[c].iter().filter(|&&e| self.tells[e].is_none());
            let (Some(&e), None) = (free.next(), free.next()) else {
                continue;
            };
            (self.tells[e], self.told_by[c]) = (Some(c), Some(e));
            self.told.push(c);
            for &(_, other) in &self.whole.equations[e] {
                left[other] -= 1;
                if others[other] && left[other] == 1 && self.told_by[other].is_none() {
                    queue.push(other);
                }
            }
        }
    }

    /// Finds what sources determine: equations with a single unknown, one after the other.
    fn determine(&mut self, holders: &[Vec<usize>]) {
        let joins = |columns: &Self, e: usize| !columns.reads[e] && columns.tells[e].is_none();
        let mut queue: Vec<usize> = (0..self.whole.equations.len())
            .filter(|&e| joins(self, e))
            .rev()
            .collect();
        while let Some(e) = queue.pop() {
            let mut unknown = self.whole.equations[e]
                .iter()
                .filter(|(_, c)| !self.known[*c]);
            let (Some(&(x, c)), None) = (unknown.next(), unknown.next()) else {
                continue;
            };
            if self.told_by[c].is_some() || x.in_field::<Ball>().is_zero() {
                continue;
            }
            (self.known[c], self.known_by[c]) = (true, Some(e));
            let again = holders[c].iter().filter(|&&e| joins(self, e));
            queue.extend(again);
        }
    }

    /// Whether it is part of one part alone.
    fn is_unknown(&self, column: Column) -> bool {
        !self.known[column] && self.told_by[column].is_none()
    }

    /// Joins what belongs together.
    ///
    /// # Errors
    /// A told column that is no mere sum, as it or the other factor of a power would have to be known.
    fn join(&mut self) -> Result<(), Column> {
        let whole = self.whole;
        for (e, equation) in whole.equations.iter().enumerate() {
            if !self.reads[e] && self.tells[e].is_none() {
                self.join_all(equation.iter().map(|&(_, c)| c));
            }
        }
        for storage in &whole.storage {
            self.join_all([storage.state, storage.flow]);
        }
        for &(a, b, _) in whole.metric.iter().filter(|(a, b, _)| a != b) {
            let [a, b] = [a, b].map(|k| &whole.storage[k]);
            self.join_all([a.state, a.flow, b.state, b.flow]);
        }
        for pair in &whole.pairs {
            self.join_all([pair.reverse, pair.forward]);
        }
        for switch in &whole.switches {
            let control = whole.observed[switch.control].column;
            self.join_all([switch.v, switch.i, control]);
            let others: Vec<Column> = match &switch.latch {
                None => Vec::new(),
                Some(LatchPort::Rest(other)) => {
                    let other = &whole.switches[*other];
                    vec![other.v, other.i]
                }
                Some(LatchPort::Hold { gates, valve }) => {
                    let gates = gates.iter().map(|&k| &whole.switches[k]);
                    let valves = whole.pairs.iter().filter(|p| p.port.device == *valve);
                    let gates = gates.flat_map(|s| [s.v, s.i]);
                    gates
                        .chain(valves.flat_map(|p| [p.reverse, p.forward]))
                        .collect()
                }
            };
            self.join_all([switch.v, switch.i].into_iter().chain(others));
        }
        for power in &whole.power {
            let [v, i] = [power.v, power.i].map(|k| self.read_by(k));
            let told = |columns: &[Column]| {
                let mut told = columns.iter().filter(|&&c| self.told_by[c].is_some());
                told.next().copied()
            };
            match (told(&v), told(&i)) {
                _ if v.is_empty() || i.is_empty() => {}
                (Some(c), _) | (_, Some(c)) => return Err(c),
                (None, None) => self.join_all(v.into_iter().chain(i)),
            }
        }
        Ok(())
    }

    /// The columns that an observed quantity reads and that are not known.
    fn read_by(&self, observed: usize) -> Vec<Column> {
        let own = self.whole.observed[observed].column;
        let equation = &self.whole.equations[self.definition[observed]];
        let columns = equation.iter().map(|&(_, c)| c);
        columns.filter(|&c| c != own && !self.known[c]).collect()
    }

    fn join_all(&mut self, columns: impl IntoIterator<Item = Column>) {
        let mut first = None;
        for c in columns {
            if self.is_unknown(c) {
                let first = *first.get_or_insert(c);
                self.joined.union(first, c);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, dmatrix};

    use crate::integrate::fixtures;
    use crate::lcs::Role;
    use crate::mna::fixture::circuit;
    use crate::mna::{StaticMultiport, behaviour};

    /// Given as matrices: a device looks at the second state and drives the first one, x₁' = −x₁ + λ and y = x₂.
    #[test]
    fn what_a_device_looks_at_and_what_it_drives_are_one_part() {
        let lcs = fixtures::system(
            &[("v(c1)", "V"), ("v(c2)", "V"), ("v(c3)", "V")],
            &[("d1", Role::Current)],
            [
                -DMatrix::identity(3, 3),
                dmatrix![1.0; 0.0; 0.0],
                dmatrix![0.0, 1.0, 0.0],
                dmatrix![0.0],
            ],
            &[1.0, 1.0, 1.0],
        );
        let parts = StaticMultiport::from_lcs(&lcs).standard().parts();
        let storage: Vec<&[usize]> = parts.iter().map(|part| &part.storage[..]).collect();
        assert_eq!(storage, [&[0, 1][..], &[2]]);
    }

    /// The current of the source that stands on another one is that of what hangs on it, and adds to that of the other.
    #[test]
    fn sources_in_series_join_nothing() {
        let circuit = circuit(
            "v1 1 0 1\nv2 2 1 1\nr1 1 a 1\nc1 a 0 1\nr2 2 b 1\nc2 b 0 1\nr3 2 c 1\nc3 c 0 1",
        );
        assert_eq!(behaviour(&circuit).unwrap().standard().parts().len(), 3);
    }

    #[test]
    fn a_capacitor_across_a_source_is_a_part_that_has_its_voltage() {
        let circuit = circuit("v1 1 0 1\nc1 1 0 1\nr2 1 b 1\nc2 b 0 1");
        let whole = behaviour(&circuit).unwrap().standard();
        let parts = whole.parts();
        assert_eq!(parts.len(), 2);
        for part in parts {
            for (own, &k) in part.multiport.storage.iter().zip(&part.storage) {
                let name = |own: usize, of: usize| {
                    assert_eq!(part.multiport.columns[own], whole.columns[of]);
                };
                name(own.state, whole.storage[k].state);
                name(own.flow, whole.storage[k].flow);
            }
        }
    }
}
