//! A behaviour eliminated in class order.

use crate::algebra::{Elimination, Field, SparseRow, Table, summed};
use crate::diagnostic::Internal;
use crate::mna::{Column, Reduced, StaticMultiport};

use super::frame::Frame;
use super::{ClassOrder, Hold, Position, ReduceError, StorageHold};

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
    pub(super) behaviour: &'b StaticMultiport,
    pub(super) reduced: &'b Reduced<F>,
    pub(super) position: &'b Position,
    /// The equations.
    pub(super) matrix: Table<F>,
    /// Columns that are a multiple of another one: v = R i of a switch.
    folded: Vec<(usize, F, usize)>,
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
    pub(super) held: Vec<usize>,
    /// Names of the columns that are `Unknown`, where they have one.
    pub(super) unknown: Vec<(usize, String)>,
}

impl<'b, F: Field> Eliminated<'b, F> {
    pub(super) fn new(
        behaviour: &'b StaticMultiport,
        reduced: &'b Reduced<F>,
        position: &'b Position,
        order: ClassOrder,
    ) -> Result<Self, ReduceError> {
        let matrix = reduced.equations.clone();
        // Every column but the internal ones that were eliminated has a place.
        let place = |c: Column| {
            let name = || behaviour.columns.get(c).map_or("a column", String::as_str);
            let lost = || Internal::new("lcs::reduce", format!("{} has no place", name()));
            let place = reduced.place.get(c).copied().flatten();
            place.ok_or_else(|| ReduceError::Internal(lost()))
        };
        let storage = behaviour.storage.iter();
        let pairs = behaviour.pairs.iter();
        let mut eliminated = Self {
            behaviour,
            reduced,
            position,
            found: Elimination::new(matrix.rows(), matrix.cols()),
            columns: vec![Columns::Unknown; matrix.cols()],
            matrix,
            folded: Vec::new(),
            state: (storage.clone().map(|s| place(s.state))).collect::<Result<_, _>>()?,
            rate: storage.map(|s| place(s.flow)).collect::<Result<_, _>>()?,
            pairs: pairs
                .map(|p| Ok((place(p.reverse)?, place(p.forward)?)))
                .collect::<Result<_, ReduceError>>()?,
            free: Vec::new(),
            held: Vec::new(),
            unknown: Vec::new(),
        };
        eliminated.assign(&place)?;
        eliminated.run(order);
        Ok(eliminated)
    }

    /// Says of every column what it is, and puts held quantities in.
    fn assign(
        &mut self,
        place: &impl Fn(Column) -> Result<usize, ReduceError>,
    ) -> Result<(), ReduceError> {
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
            self.columns[place(source.value)?] = Columns::Given(k);
            if let Some(rate) = source.rate {
                self.columns[place(rate)?] = Columns::GivenRate(k);
            }
            let letter = if source.input.unit == "V" { 'i' } else { 'v' };
            self.unknown.push((
                place(source.other)?,
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
            let (v, i) = (place(switch.v)?, place(switch.i)?);
            let (ron, roff) = &self.reduced.switches[k];
            match if self.position.switches[k] {
                Some(ron)
            } else {
                roff.as_ref()
            } {
                // v = R i
                Some(resistance) => {
                    self.matrix.fold(v, resistance, i);
                    self.columns[v] = Columns::Gone;
                    self.folded.push((v, resistance.clone(), i));
                    self.unknown.push((i, format!("i({})", switch.name)));
                }
                None => {
                    self.drop_column(i);
                    self.unknown.push((v, format!("v({})", switch.name)));
                }
            }
        }
        for &c in &self.reduced.free {
            self.unknown.push((place(c)?, behaviour.columns[c].clone()));
        }
        self.columns[place(StaticMultiport::ONE)?] = Columns::One;
        self.folded.sort_by_key(|(v, ..)| *v);
        Ok(())
    }

    /// Observed quantity k in frame order.
    pub(super) fn reading(&self, frame: &Frame, k: usize) -> SparseRow<F> {
        let mut terms = Vec::new();
        for (c, x) in &self.reduced.readings[k] {
            let folded = self.folded.binary_search_by_key(c, |(v, ..)| *v);
            let (c, x) = match folded.map(|at| &self.folded[at]) {
                Ok((_, resistance, i)) => (*i, &x.mul(resistance)),
                Err(_) => (*c, x),
            };
            match self.found.pivot[c] {
                Some(r) => {
                    let minus = x.neg();
                    let others = self.matrix.row(r).iter().filter(|(other, _)| *other != c);
                    terms.extend(
                        others.filter_map(|(c, part)| Some((frame.place[*c]?, part.mul(&minus)))),
                    );
                }
                None => terms.extend(frame.place[c].map(|at| (at, x.clone()))),
            }
        }
        summed(terms)
    }

    fn drop_column(&mut self, column: usize) {
        self.columns[column] = Columns::Gone;
        self.matrix.clear(column);
    }

    /// The column of a held pair that the position leaves unknown: i of a conducting, −v of a blocking one.
    pub(super) fn guard_column(&self, pair: usize) -> usize {
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
        let mut is_held = vec![false; self.columns.len()];
        held.iter().for_each(|&c| is_held[c] = true);
        // The input of a function block is a reading like any other: it is y, whatever it reads.
        let inputs = self
            .free
            .iter()
            .filter(|&&k| self.behaviour.pairs[k].fixed_role);
        let unknown = (0..self.columns.len())
            .filter(|c| self.columns[*c] == Columns::Unknown && !is_held[*c])
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
        self.matrix.settle(&self.found);
    }

    fn eliminate(&mut self, columns: Vec<usize>) {
        for c in columns {
            self.matrix.eliminate(c, &mut self.found);
        }
    }

    /// Of each free device the quantity that should be y, and what held pairs leave unknown; then the other quantity of
    /// the devices not used yet; then exchanges.
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
        self.exchange_roles();
    }

    pub(super) fn device(&self, pair: usize) -> String {
        self.behaviour.pairs[pair].port.device.clone()
    }

    pub(super) fn storage_label(&self, k: usize) -> String {
        self.behaviour.storage[k].name.clone()
    }

    pub(super) fn source(&self, k: usize) -> String {
        self.behaviour.sources[k].input.name.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mna::behaviour;
    use crate::mna::fixture::circuit;

    #[test]
    fn a_column_without_a_place_is_an_internal_error_that_names_it() {
        let behaviour = behaviour(&circuit("v1 1 0 1\n r1 1 2 1\n c1 2 0 1u")).unwrap();
        let position = Position::free(&behaviour, Vec::new());
        let mut reduced = behaviour.ball().clone();
        reduced.place[behaviour.storage[0].state] = None;
        let Err(error) = Eliminated::new(&behaviour, &reduced, &position, ClassOrder::Standard)
        else {
            panic!("a system without the place of a state");
        };
        let words = error.to_string();
        assert!(words.contains("lcs::reduce: v(c1) has no place"), "{words}");
    }
}
