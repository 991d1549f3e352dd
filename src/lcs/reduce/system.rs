//! The system read off an elimination, and what is wrong where there is none.

use crate::algebra::{Field, SparseRow, add_scaled, entry, part};
use crate::circuit::source::Wave;
use crate::lcs::{Hold, Role};
use crate::mna::topology::{Class, Edge, conflict};

use super::eliminated::Eliminated;
use super::flow::Flow;
use super::frame::Frame;
use super::{Constraint, ReduceError, Reduction, StorageHold};

impl<F: Field> Eliminated<'_, F> {
    /// The system that the elimination has found.
    pub(super) fn system(self) -> Result<Reduction<F>, ReduceError> {
        let frame = Frame::new(&self)?;
        let constraints = self.constraints(&frame)?;
        let is_static = self.position.storage == StorageHold::Static;
        let storage = self.state.iter();
        let s: Vec<SparseRow<F>> = storage.map(|&c| frame.express(&self, c)).collect();
        if !is_static {
            self.check_storage(&frame, &s)?;
        }
        let mut flow = Flow::solve(&self, &frame, &s, is_static)?;
        let objectives = self.objectives(&frame, is_static);
        let (undetermined, notes) = flow.least_norm(&frame, &objectives);
        let guards: Vec<SparseRow<F>> = self
            .held
            .iter()
            .map(|&k| frame.express(&self, self.guard_column(k)))
            .collect();
        let kernel = guards
            .iter()
            .map(|g| flow.along(&frame, g, &undetermined))
            .collect();
        let mut y = Vec::with_capacity(self.free.len());
        for (k, role) in &frame.pairs {
            let (reverse, forward) = self.pairs[*k];
            let column = if *role == Role::Voltage {
                forward
            } else {
                reverse
            };
            let row = flow.finish(&frame, frame.express(&self, column)).0;
            let rates = part(&row, frame.du()).iter();
            let sources: Vec<String> = rates
                .map(|(c, _)| self.source(c - frame.du().start))
                .collect();
            if !sources.is_empty() {
                return Err(ReduceError::SourceRate {
                    port: self.device(*k),
                    sources,
                });
            }
            y.push(row);
        }
        let readings = (0..self.behaviour.observed.len())
            .map(|k| flow.finish(&frame, self.reading(&frame, k)))
            .collect();
        let image = self.times_metric(&s);
        let mut energy = vec![SparseRow::new(); frame.n];
        for (row, image) in s.iter().zip(&image) {
            for (j, x) in part(row, 0..frame.n) {
                add_scaled(&mut energy[*j], x, part(image, 0..frame.n));
            }
        }
        Ok(Reduction {
            rates: flow.rates(&frame),
            y,
            readings,
            guards: (guards.into_iter())
                .map(|guard| flow.finish(&frame, guard))
                .collect(),
            kernel,
            undetermined: undetermined.len(),
            constraints,
            shift: flow.shift.clone(),
            inject: flow.inject(&frame, &s),
            energy,
            s: (s.into_iter())
                .map(|row| flow.finish(&frame, row).0)
                .collect(),
            states: frame.states,
            fast: Vec::new(),
            pairs: frame.pairs,
            metric: self.reduced.metric.clone(),
            notes,
        })
    }

    /// P · rows.
    pub(super) fn times_metric(&self, rows: &[SparseRow<F>]) -> Vec<SparseRow<F>> {
        let mut product = vec![SparseRow::new(); rows.len()];
        for (a, b, x) in &self.reduced.metric {
            add_scaled(&mut product[*a], x, &rows[*b]);
        }
        product
    }

    /// Equations without a pivot: they relate sources alone, or accuse a port.
    fn constraints(&self, frame: &Frame) -> Result<Vec<Constraint<F>>, ReduceError> {
        let mut constraints = Vec::new();
        for r in (0..self.found.equations).filter(|&r| !self.found.used[r]) {
            let row = frame.gather(self.matrix.row(r), false, None);
            if row.is_empty() {
                continue;
            }
            let elements = self.pairs_in(frame, &row);
            if !elements.is_empty() {
                return Err(ReduceError::Port { elements });
            }
            if self.agree(frame, &row) {
                continue;
            }
            let of = |(c, _): &(usize, F)| self.source(c - frame.u().start);
            let named: Vec<String> = part(&row, frame.u()).iter().map(of).collect();
            let elements = conflict(&self.held_graph(), &named).unwrap_or(named);
            // At an operating point an inductor across a source is a constraint on its value at that instant.
            let instant = self.position.storage == StorageHold::Static;
            if self.held.is_empty() && !instant {
                return Err(ReduceError::Sources { elements });
            }
            constraints.push((normalised(part(&row, 0..frame.base)), elements));
        }
        Ok(constraints)
    }

    /// The circuit's graph with what this position makes short or open in the class of sources.
    fn held_graph(&self) -> Vec<Edge> {
        let mut graph = self.behaviour.graph.clone();
        let mut set = |name: &str, class: Class| {
            graph
                .iter_mut()
                .filter(|e| e.name == name)
                .for_each(|e| e.class = class);
        };
        for (switch, &on) in self.behaviour.switches.iter().zip(&self.position.switches) {
            match (on, switch.roff) {
                (true, _) if switch.ron.f64 == 0.0 => set(&switch.name, Class::Voltage),
                (false, None) => set(&switch.name, Class::Current),
                _ => {}
            }
        }
        for (pair, hold) in self.behaviour.pairs.iter().zip(&self.position.devices) {
            match hold {
                Hold::Free => {}
                Hold::Closed => set(&pair.port.device, Class::Voltage),
                Hold::Open => set(&pair.port.device, Class::Current),
            }
        }
        if self.position.storage == StorageHold::Static {
            for storage in &self.behaviour.storage {
                let class = if storage.capacitor {
                    Class::Current
                } else {
                    Class::Voltage
                };
                set(&storage.element, class);
            }
        }
        graph
    }

    /// The devices whose λ a row contains.
    fn pairs_in(&self, frame: &Frame, row: &[(usize, F)]) -> Vec<String> {
        let present = part(row, frame.lambda()).iter();
        present
            .map(|(c, _)| self.device(frame.pairs[c - frame.n].0))
            .collect()
    }

    /// Whether Σ a_k u_k + c vanishes because equal waveforms and constants cancel.
    fn agree(&self, frame: &Frame, row: &[(usize, F)]) -> bool {
        let source = |j: usize| &self.behaviour.sources[j].input.source;
        let mut constant = entry(row, frame.one()).cloned().unwrap_or_else(F::zero);
        let mut sums: Vec<(usize, F)> = Vec::new();
        for (c, x) in part(row, frame.u()) {
            let j = c - frame.u().start;
            if let Wave::Dc(value) = source(j).wave {
                constant = constant.add(&x.mul(&F::value(value.into())));
                continue;
            }
            match sums.iter_mut().find(|(k, _)| source(*k) == source(j)) {
                Some((_, sum)) => *sum = sum.add(x),
                None => sums.push((j, x.clone())),
            }
        }
        constant.is_zero() && sums.iter().all(|(_, sum)| sum.is_zero())
    }

    /// Dependent storage may follow other storage and sources, nothing else.
    fn check_storage(&self, frame: &Frame, s: &[SparseRow<F>]) -> Result<(), ReduceError> {
        for (k, row) in s.iter().enumerate() {
            let ports = self.pairs_in(frame, row);
            if !ports.is_empty() {
                return Err(ReduceError::Feedthrough {
                    storage: self.storage_label(k),
                    ports,
                });
            }
            if !part(row, frame.base..usize::MAX).is_empty() {
                return Err(ReduceError::Singular {
                    elements: vec![self.storage_label(k)],
                });
            }
        }
        Ok(())
    }

    /// The quantities whose squares a least-norm choice minimises, with names: first what the position leaves unknown of its devices, as the
    /// complementarity problem with these devices free chooses it; then everything else that it leaves unknown, in an operating
    /// point what is observed (node potentials) as well.
    fn objectives(&self, frame: &Frame, is_static: bool) -> Vec<Vec<(String, SparseRow<F>)>> {
        if frame.f.is_empty() {
            return Vec::new();
        }
        let guards: Vec<usize> = self.held.iter().map(|&k| self.guard_column(k)).collect();
        let row = |(c, name): &(usize, String)| (name.clone(), frame.express(self, *c));
        let (devices, others): (Vec<_>, Vec<_>) =
            self.unknown.iter().partition(|(c, _)| guards.contains(c));
        let mut rest: Vec<(String, SparseRow<F>)> = others.into_iter().map(row).collect();
        if is_static {
            for (k, observed) in self.behaviour.observed.iter().enumerate() {
                if self.unknown.iter().any(|(_, name)| *name == observed.name) {
                    continue;
                }
                let row = self.reading(frame, k);
                rest.push((observed.name.clone(), row));
            }
        }
        vec![devices.into_iter().map(row).collect(), rest]
    }
}

/// Scales a row so that its largest entry is ±1.
fn normalised<F: Field>(row: &[(usize, F)]) -> SparseRow<F> {
    let size = |x: &F| x.to_f64().abs();
    let largest = row.iter().map(|(_, x)| x);
    match largest.max_by(|a, b| size(a).total_cmp(&size(b))) {
        Some(largest) => row.iter().map(|(c, x)| (*c, x.div(largest))).collect(),
        None => SparseRow::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::rational;

    #[test]
    fn a_row_is_scaled_by_its_largest_entry() {
        let row = |entries: [(usize, f64); 2]| entries.map(|(c, x)| (c, rational(x))).to_vec();
        assert_eq!(
            normalised(&row([(0, 2.0), (2, -8.0)])),
            row([(0, -0.25), (2, 1.0)])
        );
    }
}
