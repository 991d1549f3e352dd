//! How what a mode is made of changes with a value, by one reduction of the circuit with a source wherever some value stands.
//!
//! A source e in x' = A x + E u + b e + e₀ that stands for changes of coefficients is e = d · [x | u | u' | 1] δp, with the readings d of what they multiply: so A_p = b d_x and
//! so on, matrices of rank 1 for each equation and storage element that the value stands in. The reduction is one per mode for all values.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, RowDVector};

use super::change::{Change, Changes, Guard};
use super::forms::{Forms, Moving};
use super::instant::Inputs;
use super::near::difference;
use super::system::Row;
use super::{System, Trajectory, shaped};
use crate::circuit::Source;
use crate::integrate::Error;
use crate::integrate::exact::{Assembler, Owner};
use crate::integrate::switching::Threshold;
use crate::lcs::{Hold, Lcs, Position, Rows, StorageHold, reduce};
use crate::linalg::product::add_outer;
use crate::mna::{Perturbation, StandardMultiport};
use crate::settings::tolerances::periodic::{NEAR_THRESHOLD, SAME_REDUCTION};

/// The modes of a trajectory with sources for changes.
pub(crate) struct Tableau {
    /// The equations, storage elements and columns that have a source, or are read.
    equations: Vec<usize>,
    storage: Vec<usize>,
    read: Vec<usize>,
    /// The columns of flows of all storage.
    flows: Vec<usize>,
    systems: Vec<System>,
    /// The guards of the trajectory.
    guards: Vec<Guard>,
    /// P⁻¹.
    inverse: Option<DMatrix<f64>>,
    thresholds: Vec<Threshold>,
    assembler: Assembler,
}

/// An operating point with sources for changes.
pub(crate) struct Rest {
    lcs: Lcs,
    u: DVector<f64>,
}

/// Adds what is not there yet.
fn add(all: &mut Vec<usize>, one: usize) {
    if !all.contains(&one) {
        all.push(one);
    }
}

impl Tableau {
    /// For these values; `None` where the circuit with sources is reduced to other states.
    pub(crate) fn of(
        multiport: &StandardMultiport,
        perturbations: &[&Perturbation],
        trajectory: &Trajectory,
    ) -> Option<Self> {
        let (mut equations, mut storage, mut read) = (vec![], vec![], vec![]);
        let flows: Vec<usize> = multiport
            .storage
            .iter()
            .map(|storage| storage.flow)
            .collect();
        for perturbation in perturbations {
            for (equation, column, _) in &perturbation.coefficients {
                add(&mut equations, *equation);
                add(&mut read, *column);
            }
            for (row, column, _) in &perturbation.metric {
                add(&mut storage, *row);
                add(&mut storage, *column);
                flows.iter().for_each(|flow| add(&mut read, *flow));
            }
        }
        let ends = trajectory.segments.first().zip(trajectory.segments.last());
        let span = ends.map_or(1.0, |(first, last)| last.to - first.from);
        let perturbed = multiport.perturbed(&equations, &storage, &read);
        let mut assembler = Assembler::new(Arc::new(perturbed)).with_span(span);
        let mut systems = Vec::new();
        for system in &trajectory.systems {
            let own = System::of(&system.key, &mut assembler).ok()?;
            let close = |a: &DMatrix<f64>, b: &DMatrix<f64>| {
                a.shape() == b.shape() && (a - b).amax() <= SAME_REDUCTION * a.amax()
            };
            let same = own.lcs.states == system.lcs.states
                && own.lcs.fast == system.lcs.fast
                && close(&own.lcs.a, &system.lcs.a)
                && close(&own.lcs.storage.x, &system.lcs.storage.x);
            if !same {
                return None;
            }
            systems.push(own);
        }
        let metric = trajectory.systems.first();
        Some(Self {
            equations,
            storage,
            read,
            flows,
            systems,
            guards: trajectory.guards(),
            inverse: metric.and_then(|system| system.lcs.storage.metric.clone().try_inverse()),
            thresholds: assembler.thresholds(),
            assembler,
        })
    }

    /// What each source is with ln p over [x | u | u' | 1] in a mode, by number of the source, from p columns of u on.
    fn drives(
        &self,
        at: usize,
        perturbation: &Perturbation,
        (n, p): (usize, usize),
    ) -> Option<Vec<(usize, RowDVector<f64>)>> {
        let lcs = &self.systems[at].lcs;
        let (rows, count) = (&lcs.outputs.power_v, lcs.outputs.power.len());
        let first = count - self.read.len();
        let reading = |column: usize| {
            let k = first + self.read.iter().position(|own| *own == column)?;
            Some(reading(rows, k, (n, p)))
        };
        let mut found: Vec<(usize, RowDVector<f64>)> = Vec::new();
        let mut add = |source: usize, row: RowDVector<f64>| match found
            .iter_mut()
            .find(|(own, _)| *own == source)
        {
            Some((_, own)) => *own += row,
            None => found.push((source, row)),
        };
        for (equation, column, values) in &perturbation.coefficients {
            let source = self.equations.iter().position(|own| own == equation)?;
            add(source, reading(*column)? * difference(*values));
        }
        if !perturbation.metric.is_empty() {
            let shares = self.shares(perturbation)?;
            for (j, storage) in self.storage.iter().enumerate() {
                for (k, flow) in self.flows.iter().enumerate() {
                    let share = shares[(*storage, k)];
                    if share != 0.0 {
                        add(self.equations.len() + j, reading(*flow)? * share);
                    }
                }
            }
        }
        Some(found)
    }

    /// δP P⁻¹.
    fn shares(&self, perturbation: &Perturbation) -> Option<DMatrix<f64>> {
        let inverse = self.inverse.as_ref()?;
        Some(change_of_metric(perturbation, inverse.nrows()) * inverse)
    }

    /// How all changes with a value; `None` where sources of these places have effects of their derivatives.
    ///
    /// # Errors
    /// A source has no closed form.
    pub(crate) fn changes(
        &self,
        trajectory: &Trajectory,
        perturbation: &Perturbation,
        (sources, start): ([Vec<Source>; 4], DVector<f64>),
    ) -> Result<Option<Changes>, Error> {
        let (mut systems, mut drives) = (Vec::new(), Vec::new());
        for (at, system) in trajectory.systems.iter().enumerate() {
            let shape = (system.lcs.n(), system.lcs.p());
            let Some(own) = self.drives(at, perturbation, shape) else {
                return Ok(None);
            };
            let Some(change) = self.change(system, at, (perturbation, &own)) else {
                return Ok(None);
            };
            systems.push(change);
            drives.push(own);
        }
        let mut guards = Vec::new();
        for &guard in &self.guards {
            let system = &trajectory.systems[guard.system];
            let (n, p) = (system.lcs.n(), system.lcs.p());
            let Some(row) = self.guard(guard.system, guard.owner) else {
                return Ok(None);
            };
            let mut change = RowDVector::zeros(n + 2 * p + 1);
            for (source, drive) in &drives[guard.system] {
                if row.du[p + source] != 0.0 {
                    return Ok(None);
                }
                change += drive * row.u[p + source];
            }
            guards.push((guard, change));
        }
        Ok(Some(Changes {
            systems,
            guards,
            moving: Moving::among(trajectory, sources.each_ref().map(|all| &all[..]))?,
            start,
        }))
    }

    /// The operating point that a run from this storage begins at; `None` where the static equations of the mode that it begins in have another one, or one that is near a change of mode.
    pub(crate) fn at_rest(&self, trajectory: &Trajectory, state: &[f64]) -> Option<Rest> {
        let key = &trajectory.systems[trajectory.segments[0].system].key;
        let hold = |&closed: &bool| if closed { Hold::Closed } else { Hold::Open };
        let position = Position {
            devices: key.closed.iter().map(hold).collect(),
            switches: key.switches.clone(),
            storage: StorageHold::Static,
        };
        if !key.sliding.is_empty() {
            return None;
        }
        let lcs = reduce(self.assembler.multiport(), &position).ok()?;
        let inputs = lcs.inputs.iter();
        let u = DVector::from_iterator(lcs.p(), inputs.map(|input| input.source.value_left(0.0)));
        let storage = &lcs.storage;
        let found = shaped(&storage.u, storage.one.len(), lcs.p()) * &u + &storage.one;
        let own = DVector::from_column_slice(state);
        let same =
            found.len() == own.len() && (&found - &own).amax() <= SAME_REDUCTION * own.amax();
        let guards = &lcs.held.guard;
        let of_u = shaped(&guards.u, guards.one.len(), lcs.p());
        let apart = (0..guards.one.len()).all(|k| {
            let terms = (0..u.len()).map(|i| of_u[(k, i)] * u[i]);
            let (value, size) = terms
                .fold((guards.one[k], guards.one[k].abs()), |(sum, size), term| {
                    (sum + term, size + term.abs())
                });
            value > NEAR_THRESHOLD * size || u.amax() == 0.0
        });
        (same && apart && lcs.held.kernel.ncols() == 0).then_some(Rest { lcs, u })
    }

    /// ∂s/∂ln p of an operating point.
    pub(crate) fn rest_change(
        &self,
        rest: &Rest,
        perturbation: &Perturbation,
        near: &[Vec<Source>; 4],
    ) -> Option<DVector<f64>> {
        let (lcs, p) = (&rest.lcs, rest.lcs.p());
        let first = lcs.outputs.power.len() - self.read.len();
        let at = super::change::columns(&DVector::zeros(0), &rest.u, &DVector::zeros(p));
        let mut du = DVector::zeros(p);
        for (i, du) in du.iter_mut().enumerate().take(near[0].len()) {
            *du = difference(near.each_ref().map(|all| all[i].value_left(0.0)));
        }
        for (equation, column, values) in &perturbation.coefficients {
            let source = self.equations.iter().position(|own| own == equation)?;
            let k = first + self.read.iter().position(|own| own == column)?;
            let value = (reading(&lcs.outputs.power_v, k, (0, p)) * &at)[0];
            du[near[0].len() + source] += value * difference(*values);
        }
        let storage = &lcs.storage;
        Some(shaped(&storage.u, storage.one.len(), p) * du)
    }

    /// Whether no switch begins so near its threshold that small changes of a value have it begin on the other side.
    pub(crate) fn starts_apart(&self, trajectory: &Trajectory, forms: &Forms) -> bool {
        let first = &trajectory.segments[0];
        let inputs = forms.inputs(0, first.from);
        let still = |own: &DVector<f64>| {
            own.clone()
                .resize_vertically(self.systems[first.system].lcs.p(), 0.0)
        };
        let inputs = Inputs {
            u: still(&inputs.u),
            du: still(&inputs.du),
            ddu: still(&inputs.ddu),
        };
        (0..self.thresholds.len()).all(|i| {
            let Some(row) = self.guard(first.system, (Owner::Switch(i), 0)) else {
                return true;
            };
            let (value, size) = row.value(&first.start, &inputs);
            value.abs() > NEAR_THRESHOLD * size
        })
    }

    fn guard(&self, at: usize, (owner, which): (Owner, usize)) -> Option<Row> {
        let limits = |i| self.assembler.limits(i);
        let mut guards = self.systems[at].guards(owner, (&self.thresholds, limits));
        (which < guards.len()).then(|| guards.swap_remove(which))
    }

    fn change(
        &self,
        system: &System,
        at: usize,
        (perturbation, drives): (&Perturbation, &[(usize, RowDVector<f64>)]),
    ) -> Option<Change> {
        let own = &self.systems[at];
        let (n, p) = (system.lcs.n(), system.lcs.p());
        let (q, m) = (
            system.lcs.storage.names.len(),
            system.lcs.outputs.names.len(),
        );
        let all = own.lcs.p();
        let outputs = &own.lcs.outputs.rows;
        let [of_u, of_du] = [&outputs.u, &outputs.du].map(|block| shaped(block, m, all));
        let mut change = Change {
            rate: DMatrix::zeros(n, n + 2 * p + 1),
            outputs: DMatrix::zeros(m, n + 2 * p + 1),
            storage: DMatrix::zeros(q, n + p + 1),
            inject: DMatrix::zeros(n, q + p + 1),
        };
        for (source, drive) in drives {
            let column = p + source;
            let still = |block: &DMatrix<f64>| block.column(column).iter().all(|v| *v == 0.0);
            if !still(&of_du) || !still(&own.storage_inputs) {
                return None;
            }
            let [inputs, of_u] = [&own.inputs, &of_u].map(|block| block.column(column));
            add_outer(&mut change.rate, inputs.as_slice(), drive.as_slice());
            add_outer(&mut change.outputs, of_u.as_slice(), drive.as_slice());
        }
        if !perturbation.metric.is_empty() {
            let storage = &system.lcs.storage;
            let metric = change_of_metric(perturbation, q);
            // s⁺ − s⁻ over [s⁻ | u⁺ | 1].
            let mut jump = DMatrix::zeros(q, q + p + 1);
            let kept = &storage.x * &storage.inject;
            jump.columns_mut(0, q)
                .copy_from(&(kept - DMatrix::identity(q, q)));
            jump.columns_mut(q, p).copy_from(&system.storage_inputs);
            let constant = &storage.x * &storage.inject_one + &storage.one;
            jump.set_column(q + p, &constant);
            for (j, storage) in self.storage.iter().enumerate() {
                let area = metric.row(*storage) * &jump;
                let column = p + self.equations.len() + j;
                let inputs = own.inputs.column(column);
                add_outer(&mut change.inject, inputs.as_slice(), area.as_slice());
            }
        }
        Some(change)
    }
}

fn change_of_metric(perturbation: &Perturbation, q: usize) -> DMatrix<f64> {
    let mut change = DMatrix::zeros(q, q);
    for (row, column, values) in &perturbation.metric {
        change[(*row, *column)] += difference(*values);
    }
    change
}

/// Row k over [x | u | u' | 1] of the first p inputs.
fn reading(rows: &Rows, k: usize, (n, p): (usize, usize)) -> RowDVector<f64> {
    let mut row = RowDVector::zeros(n + 2 * p + 1);
    let mut put = |at: usize, block: &DMatrix<f64>, count: usize| {
        if k < block.nrows() && block.ncols() >= count {
            row.columns_mut(at, count)
                .copy_from(&block.view((k, 0), (1, count)));
        }
    };
    put(0, &rows.x, n);
    put(n, &rows.u, p);
    put(n + p, &rows.du, p);
    row[n + 2 * p] = rows.one[k];
    row
}
