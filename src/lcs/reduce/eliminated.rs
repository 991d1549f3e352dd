//! A behaviour eliminated in class order, and the system read off it.

use crate::algebra::{Elimination, Field, Matrix};
use crate::circuit::source::Wave;
use crate::mna::topology::{Class, Edge, conflict};
use crate::mna::{Behaviour, Column, Reduced};

use super::flow::{Flow, add_scaled};
use super::frame::Frame;
use super::{ClassOrder, Hold, Position, ReduceError, Reduction, Role, StorageHold};

/// What a column of the behaviour is in a position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Columns {
    /// Held at 0, or replaced.
    Gone,
    /// The value of input k.
    Given(usize),
    /// The derivative of input k.
    GivenRate(usize),
    /// Nobody prescribes it.
    Unknown,
    /// Storage quantity k.
    State(usize),
    /// Rate of a storage quantity.
    Rate,
    /// A quantity of free pair k.
    Pair(usize),
    /// The constant 1.
    One,
}

/// A behaviour after the elimination in class order.
pub(super) struct Eliminated<'b, F> {
    pub(super) behaviour: &'b Behaviour,
    pub(super) reduced: &'b Reduced<F>,
    pub(super) position: &'b Position,
    pub(super) matrix: Matrix<F>,
    pub(super) found: Elimination,
    /// What each column is.
    pub(super) columns: Vec<Columns>,
    /// Columns of storage quantities and of their rates.
    pub(super) state: Vec<usize>,
    pub(super) rate: Vec<usize>,
    /// Columns (reverse, forward) of all pairs.
    pub(super) pairs: Vec<(usize, usize)>,
    /// Indices of the free and of the held pairs.
    pub(super) free: Vec<usize>,
    held: Vec<usize>,
    /// Names of the columns that are `Unknown`, where they have one.
    unknown: Vec<(usize, String)>,
}

impl<'b, F: Field> Eliminated<'b, F> {
    pub(super) fn new(
        behaviour: &'b Behaviour,
        reduced: &'b Reduced<F>,
        position: &'b Position,
        order: ClassOrder,
    ) -> Self {
        let matrix = reduced.matrix.clone();
        // Every column but the internal ones that were eliminated has a place.
        let place = |c: Column| reduced.place[c].unwrap_or_default();
        let mut eliminated = Self {
            behaviour,
            reduced,
            position,
            found: Elimination::new(reduced.equations, matrix.cols()),
            columns: vec![Columns::Unknown; matrix.cols()],
            matrix,
            state: behaviour.storage.iter().map(|s| place(s.state)).collect(),
            rate: behaviour.storage.iter().map(|s| place(s.flow)).collect(),
            pairs: behaviour
                .pairs
                .iter()
                .map(|p| (place(p.reverse), place(p.forward)))
                .collect(),
            free: Vec::new(),
            held: Vec::new(),
            unknown: Vec::new(),
        };
        eliminated.assign(&place);
        eliminated.run(order);
        eliminated
    }

    /// Says of every column what it is, and puts held quantities in.
    fn assign(&mut self, place: &impl Fn(Column) -> usize) {
        let behaviour = self.behaviour;
        let is_static = self.position.storage == StorageHold::Static;
        for k in 0..self.state.len() {
            self.columns[self.state[k]] = Columns::State(k);
            self.columns[self.rate[k]] = Columns::Rate;
            if is_static {
                self.drop_column(self.rate[k]);
                let storage = &behaviour.storage[k];
                if !storage.capacitor {
                    self.unknown.push((self.state[k], storage.name.clone()));
                }
            }
        }
        for (k, source) in behaviour.sources.iter().enumerate() {
            self.columns[place(source.value)] = Columns::Given(k);
            if let Some(rate) = source.rate {
                self.columns[place(rate)] = Columns::GivenRate(k);
            }
            let letter = if source.input.unit == "V" { 'i' } else { 'v' };
            self.unknown.push((
                place(source.other),
                format!("{letter}({})", source.input.name),
            ));
        }
        for (k, hold) in self.position.devices.iter().enumerate() {
            let (reverse, forward) = self.pairs[k];
            let pair = &behaviour.pairs[k];
            match hold {
                Hold::Free => {
                    self.columns[reverse] = Columns::Pair(self.free.len());
                    self.columns[forward] = Columns::Pair(self.free.len());
                    self.free.push(k);
                }
                Hold::Closed => {
                    self.drop_column(reverse);
                    self.unknown.push((forward, pair.forward_name.clone()));
                    self.held.push(k);
                }
                Hold::Open => {
                    self.drop_column(forward);
                    self.unknown.push((reverse, pair.reverse_name.clone()));
                    self.held.push(k);
                }
            }
        }
        for (k, switch) in behaviour.switches.iter().enumerate() {
            let (v, i) = (place(switch.v), place(switch.i));
            let (ron, roff) = &self.reduced.switches[k];
            match if self.position.switches[k] {
                Some(ron)
            } else {
                roff.as_ref()
            } {
                // v = R i
                Some(resistance) => {
                    for r in 0..self.matrix.rows() {
                        let entry = self.matrix.at(r, v).mul(resistance);
                        if !entry.is_zero() {
                            self.matrix.set(r, i, self.matrix.at(r, i).add(&entry));
                        }
                    }
                    self.drop_column(v);
                    self.unknown.push((i, format!("i({})", switch.name)));
                }
                None => {
                    self.drop_column(i);
                    self.unknown.push((v, format!("v({})", switch.name)));
                }
            }
        }
        for &c in &self.reduced.free {
            self.unknown.push((place(c), behaviour.columns[c].clone()));
        }
        self.columns[place(Behaviour::ONE)] = Columns::One;
    }

    fn drop_column(&mut self, column: usize) {
        self.columns[column] = Columns::Gone;
        for r in 0..self.matrix.rows() {
            self.matrix.set(r, column, F::zero());
        }
    }

    /// The column of a held pair that the position leaves unknown: i of a conducting, −v of a blocking one.
    fn guard_column(&self, pair: usize) -> usize {
        let (reverse, forward) = self.pairs[pair];
        if self.columns[reverse] == Columns::Gone {
            forward
        } else {
            reverse
        }
    }

    /// Eliminates in class order.
    fn run(&mut self, order: ClassOrder) {
        let is_static = self.position.storage == StorageHold::Static;
        let devices_first = matches!(order, ClassOrder::DevicesFirst | ClassOrder::OtherRoleFirst);
        let other_role = matches!(order, ClassOrder::OtherRole | ClassOrder::OtherRoleFirst);
        let held: Vec<usize> = self.held.iter().map(|&k| self.guard_column(k)).collect();
        // The input of a function block is a reading like any other: it is y, whatever it reads.
        let inputs = self
            .free
            .iter()
            .filter(|&&k| self.behaviour.pairs[k].fixed_role);
        let unknown = (0..self.columns.len())
            .filter(|c| self.columns[*c] == Columns::Unknown && !held.contains(c))
            .chain(inputs.map(|&k| self.pairs[k].0))
            .collect();
        self.eliminate(unknown);
        if devices_first {
            self.eliminate_pairs(&held, other_role);
        }
        self.eliminate(if is_static {
            self.state.clone()
        } else {
            self.rate.clone()
        });
        if !devices_first {
            self.eliminate_pairs(&held, other_role);
        }
        if !is_static {
            // States, those first whose rate stayed free, so that the same element is the link in both.
            let (links, rest): (Vec<usize>, Vec<usize>) =
                (0..self.state.len()).partition(|&k| self.found.pivot[self.rate[k]].is_none());
            self.eliminate(
                links
                    .into_iter()
                    .chain(rest)
                    .map(|k| self.state[k])
                    .collect(),
            );
        }
    }

    fn eliminate(&mut self, columns: Vec<usize>) {
        for c in columns {
            self.matrix.eliminate(c, &mut self.found);
        }
    }

    /// Of each free device the quantity that should be y, and what held pairs leave unknown; then the other quantity of
    /// the devices not used yet.
    fn eliminate_pairs(&mut self, held: &[usize], other_role: bool) {
        let devices = self
            .free
            .iter()
            .filter(|&&k| !self.behaviour.pairs[k].fixed_role);
        let choices: Vec<(usize, usize)> = devices
            .map(|&k| {
                let (reverse, forward) = self.pairs[k];
                let current = self.behaviour.pairs[k].prefers_current_as_y() != other_role;
                if current {
                    (forward, reverse)
                } else {
                    (reverse, forward)
                }
            })
            .collect();
        let mut first: Vec<usize> = choices
            .iter()
            .map(|c| c.0)
            .chain(held.iter().copied())
            .collect();
        first.sort_unstable();
        self.eliminate(first);
        let unused = |c: &&(usize, usize)| self.found.pivot[c.0].is_none();
        let second = choices.iter().filter(unused).map(|c| c.1).collect();
        self.eliminate(second);
    }

    pub(super) fn device(&self, pair: usize) -> String {
        self.behaviour.pairs[pair].port.device.clone()
    }

    pub(super) fn storage_label(&self, k: usize) -> String {
        self.behaviour.storage[k].name.clone()
    }

    fn source(&self, k: usize) -> String {
        self.behaviour.sources[k].input.name.clone()
    }

    /// The system that the elimination has found.
    pub(super) fn system(self) -> Result<Reduction<F>, ReduceError> {
        let frame = Frame::new(&self)?;
        let constraints = self.constraints(&frame)?;
        let is_static = self.position.storage == StorageHold::Static;
        let s: Vec<Vec<F>> = self
            .state
            .iter()
            .map(|&c| frame.express(&self, c))
            .collect();
        if !is_static {
            self.check_storage(&frame, &s)?;
        }
        let mut flow = Flow::solve(&self, &frame, &s, is_static)?;
        let objective = self.objective(&frame, is_static);
        let (undetermined, notes) = flow.least_norm(&frame, &objective);
        let guards: Vec<Vec<F>> = self
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
            let row = flow.finish(&frame, &frame.express(&self, column)).0;
            let rates = frame
                .du()
                .filter(|&c| !row[c].is_zero())
                .map(|c| c - frame.du().start);
            let sources: Vec<String> = rates.map(|j| self.source(j)).collect();
            if !sources.is_empty() {
                return Err(ReduceError::SourceRate {
                    port: self.device(*k),
                    sources,
                });
            }
            y.push(row);
        }
        let readings = (self.found.equations..self.matrix.rows())
            .map(|r| flow.finish(&frame, &frame.gather(self.matrix.row(r), false, None)))
            .collect();
        let image = self.times_metric(&s);
        let mut energy = vec![vec![F::zero(); frame.n]; frame.n];
        for (row, image) in s.iter().zip(&image) {
            for (target, x) in energy.iter_mut().zip(row).filter(|(_, x)| !x.is_zero()) {
                add_scaled(target, x, &image[..frame.n]);
            }
        }
        Ok(Reduction {
            rates: flow.rates(&frame),
            y,
            readings,
            guards: guards.iter().map(|g| flow.finish(&frame, g)).collect(),
            kernel,
            constraints,
            shift: flow.shift.clone(),
            inject: flow.inject(&frame, &s),
            energy,
            s: s.iter().map(|row| flow.finish(&frame, row).0).collect(),
            states: frame.states,
            pairs: frame.pairs,
            metric: self.reduced.metric.clone(),
            notes,
        })
    }

    /// P · rows.
    pub(super) fn times_metric(&self, rows: &[Vec<F>]) -> Vec<Vec<F>> {
        let width = rows.first().map_or(0, Vec::len);
        let mut product = vec![vec![F::zero(); width]; rows.len()];
        for (a, b, x) in &self.reduced.metric {
            for (sum, value) in product[*a].iter_mut().zip(&rows[*b]) {
                if !value.is_zero() {
                    *sum = sum.add(&x.mul(value));
                }
            }
        }
        product
    }

    /// Equations without a pivot: they relate sources alone, or accuse a port.
    fn constraints(&self, frame: &Frame) -> Result<Vec<Vec<F>>, ReduceError> {
        let mut constraints = Vec::new();
        for r in (0..self.found.equations).filter(|&r| !self.found.used[r]) {
            let row = frame.gather(self.matrix.row(r), false, None);
            if row.iter().all(F::is_zero) {
                continue;
            }
            let elements = self.pairs_in(frame, &row);
            if !elements.is_empty() {
                return Err(ReduceError::Port { elements });
            }
            if self.agree(frame, &row) {
                continue;
            }
            // At an operating point an inductor across a source is a constraint on its value at that instant.
            let instant = self.position.storage == StorageHold::Static;
            if self.held.is_empty() && !instant {
                let of = |c: usize| self.source(c - frame.u().start);
                let named: Vec<String> = frame.u().filter(|&c| !row[c].is_zero()).map(of).collect();
                let elements = conflict(&self.held_graph(), &named).unwrap_or(named);
                return Err(ReduceError::Sources { elements });
            }
            constraints.push(normalised(&row[..frame.base]));
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
    fn pairs_in(&self, frame: &Frame, row: &[F]) -> Vec<String> {
        let present = frame.lambda().filter(|&c| !row[c].is_zero());
        present
            .map(|c| self.device(frame.pairs[c - frame.n].0))
            .collect()
    }

    /// Whether Σ a_k u_k + c vanishes because equal waveforms and constants cancel.
    fn agree(&self, frame: &Frame, row: &[F]) -> bool {
        let source = |j: usize| &self.behaviour.sources[j].input.source;
        let mut constant = row[frame.one()].clone();
        let mut sums: Vec<(usize, F)> = Vec::new();
        for c in frame.u().filter(|&c| !row[c].is_zero()) {
            let j = c - frame.u().start;
            if let Wave::Dc(value) = source(j).wave {
                constant = constant.add(&row[c].mul(&F::value(value.into())));
                continue;
            }
            match sums.iter_mut().find(|(k, _)| source(*k) == source(j)) {
                Some((_, sum)) => *sum = sum.add(&row[c]),
                None => sums.push((j, row[c].clone())),
            }
        }
        constant.is_zero() && sums.iter().all(|(_, sum)| sum.is_zero())
    }

    /// Dependent storage may follow other storage and sources, nothing else.
    fn check_storage(&self, frame: &Frame, s: &[Vec<F>]) -> Result<(), ReduceError> {
        for (k, row) in s.iter().enumerate() {
            let ports = self.pairs_in(frame, row);
            if !ports.is_empty() {
                return Err(ReduceError::Feedthrough {
                    storage: self.storage_label(k),
                    ports,
                });
            }
            if row[frame.base..].iter().any(|x| !x.is_zero()) {
                return Err(ReduceError::Singular {
                    elements: vec![self.storage_label(k)],
                });
            }
        }
        Ok(())
    }

    /// The quantities whose squares a least-norm choice minimises, with names: everything a position leaves unknown; in an
    /// operating point what is observed (node potentials) as well.
    fn objective(&self, frame: &Frame, is_static: bool) -> Vec<(String, Vec<F>)> {
        if frame.f.is_empty() {
            return Vec::new();
        }
        let unknown = self.unknown.iter();
        let mut rows: Vec<(String, Vec<F>)> = unknown
            .map(|(c, name)| (name.clone(), frame.express(self, *c)))
            .collect();
        if is_static {
            for (k, observed) in self.behaviour.observed.iter().enumerate() {
                let row = self.matrix.row(self.found.equations + k);
                rows.push((observed.name.clone(), frame.gather(row, false, None)));
            }
        }
        rows
    }
}

/// Scales a row so that its largest entry is ±1.
fn normalised<F: Field>(row: &[F]) -> Vec<F> {
    let size = |x: &F| x.to_f64().abs();
    let largest = row
        .iter()
        .filter(|x| !x.is_zero())
        .max_by(|a, b| size(a).total_cmp(&size(b)));
    match largest {
        Some(largest) => row.iter().map(|x| x.div(largest)).collect(),
        None => row.to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::rational;

    #[test]
    fn a_row_is_scaled_by_its_largest_entry() {
        let row: Vec<_> = [2.0, -8.0, 0.0].map(rational).to_vec();
        assert_eq!(normalised(&row), [-0.25, 1.0, 0.0].map(rational).to_vec());
    }
}
