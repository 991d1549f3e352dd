//! How what a mode is made of changes with ln p.

use nalgebra::{DMatrix, DVector, RowDVector};

use super::forms::{Course, Forms, Moving};
use super::near::{Near, difference, difference_of};
use super::{System, Trajectory, shaped};
use crate::integrate::Error;
use crate::integrate::exact::Owner;
use crate::lcs::Rows;

/// Derivatives with ln p in a mode of n states, p inputs, q storage elements and m outputs.
#[derive(Debug, Clone)]
pub(crate) struct Change {
    /// Of x' over [x | u | u' | 1], n×(n + 2p + 1).
    pub(super) rate: DMatrix<f64>,
    /// Of the outputs over the same, m×(n + 2p + 1).
    pub(super) outputs: DMatrix<f64>,
    /// Of s = X x + U u + k over [x | u | 1], q×(n + p + 1).
    pub(super) storage: DMatrix<f64>,
    /// Of x⁺ = J s⁻ + j over [s⁻ | u⁺ | 1], n×(q + p + 1).
    pub(super) inject: DMatrix<f64>,
}

/// A guard of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Guard {
    /// Its mode's place among the systems.
    pub(super) system: usize,
    /// Whose it is, and which of that one's.
    pub(super) owner: (Owner, usize),
}

/// All that changes with ln p along a trajectory.
#[derive(Debug, Clone)]
pub(crate) struct Changes {
    pub(super) systems: Vec<Change>,
    /// By guard of the trajectory: its derivative over [x | u | u' | 1].
    pub(super) guards: Vec<(Guard, RowDVector<f64>)>,
    /// Sources that differ.
    pub(super) moving: Vec<Moving>,
    /// Of the storage where the transient begins.
    pub(super) start: DVector<f64>,
}

/// [x | u | u' | 1]
pub(super) fn columns(x: &DVector<f64>, u: &DVector<f64>, du: &DVector<f64>) -> DVector<f64> {
    let parts = x.iter().chain(u.iter()).chain(du.iter());
    let all: Vec<f64> = parts.copied().chain([1.0]).collect();
    DVector::from_vec(all)
}

/// [x | u | 1]
pub(super) fn short_columns(x: &DVector<f64>, u: &DVector<f64>) -> DVector<f64> {
    let all: Vec<f64> = x.iter().chain(u.iter()).copied().chain([1.0]).collect();
    DVector::from_vec(all)
}

/// These blocks side by side.
fn beside(blocks: &[&DMatrix<f64>]) -> DMatrix<f64> {
    let rows = blocks.first().map_or(0, |block| block.nrows());
    let mut all = DMatrix::zeros(rows, blocks.iter().map(|block| block.ncols()).sum());
    let mut at = 0;
    for block in blocks {
        all.columns_mut(at, block.ncols()).copy_from(block);
        at += block.ncols();
    }
    all
}

fn column(vector: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_column_slice(vector.len(), 1, vector.as_slice())
}

/// Rows over [x | u | u' | 1].
pub(super) fn over(rows: &Rows, (n, p): (usize, usize)) -> DMatrix<f64> {
    let count = rows.one.len();
    let [x, u, du] = [
        shaped(&rows.x, count, n),
        shaped(&rows.u, count, p),
        shaped(&rows.du, count, p),
    ];
    beside(&[&x, &u, &du, &column(&rows.one)])
}

impl Change {
    /// What the differences are of.
    fn parts(system: &System) -> [DMatrix<f64>; 4] {
        let lcs = &system.lcs;
        let (n, p) = (lcs.n(), lcs.p());
        let q = lcs.storage.names.len();
        let still = |rows: usize| DMatrix::zeros(rows, p);
        let storage = &lcs.storage;
        [
            beside(&[&lcs.a, &system.inputs, &still(n), &column(&lcs.e0)]),
            over(&lcs.outputs.rows, (n, p)),
            beside(&[
                &shaped(&storage.x, q, n),
                &system.storage_inputs,
                &column(&storage.one),
            ]),
            beside(&[
                &shaped(&storage.inject, n, q),
                &still(n),
                &column(&storage.inject_one),
            ]),
        ]
    }

    fn of(near: [&System; 4]) -> Self {
        let mut all = near.map(Self::parts);
        let mut take =
            |k: usize| difference_of(all.each_mut().map(|parts| std::mem::take(&mut parts[k])));
        Self {
            rate: take(0),
            outputs: take(1),
            storage: take(2),
            inject: take(3),
        }
    }
}

impl Trajectory {
    /// What a guard of it has of an input.
    fn of_input(&self, guard: Guard, input: usize) -> f64 {
        let segments = self.segments.iter().enumerate();
        let mut own = segments.filter(|(_, segment)| segment.system == guard.system);
        let found = own.find_map(|(k, segment)| {
            let mut resting = segment.resting.iter();
            if let Some(resting) = resting.find(|resting| resting.owner == guard.owner) {
                return Some(resting.row.u[input]);
            }
            let saltation = self.saltations.get(k)?;
            let mut timings = saltation.timing.iter().chain(&saltation.others);
            let timing = timings.find(|timing| timing.guard == guard.owner)?;
            Some(-timing.slope * timing.u[input])
        });
        found.unwrap_or(0.0)
    }

    /// The guards that decide when its events are, and those that rest.
    pub(super) fn guards(&self) -> Vec<Guard> {
        let mut all: Vec<Guard> = Vec::new();
        let mut add = |system: usize, owner| {
            let guard = Guard { system, owner };
            if !all.contains(&guard) {
                all.push(guard);
            }
        };
        for (k, segment) in self.segments.iter().enumerate() {
            for resting in &segment.resting {
                add(segment.system, resting.owner);
            }
            if let Some(saltation) = self.saltations.get(k) {
                let timings = saltation.timing.iter().chain(&saltation.others);
                timings.for_each(|timing| add(segment.system, timing.guard));
            }
        }
        all
    }
}

impl Changes {
    /// By differences of the circuits nearby.
    ///
    /// # Errors
    /// An event has no guard there; a source has no closed form.
    pub(crate) fn of(trajectory: &Trajectory, near: &[Near; 4]) -> Result<Self, Error> {
        let places = 0..trajectory.systems.len();
        let systems = places.map(|at| Change::of(near.each_ref().map(|near| &near.systems[at])));
        let mut guards = Vec::new();
        for guard in trajectory.guards() {
            let [a, b, c, d] = near.each_ref().map(|near| {
                let row = near.guard(guard.system, guard.owner)?;
                Ok::<_, Error>(row.columns())
            });
            let parts = [a?, b?, c?, d?].map(|row| column(&row));
            let row = difference_of(parts);
            guards.push((guard, RowDVector::from_row_slice(row.as_slice())));
        }
        let states = near.each_ref().map(|near| &near.state);
        let start = (0..states[0].len()).map(|i| difference(states.map(|state| state[i])));
        Ok(Self {
            systems: systems.collect(),
            guards,
            moving: Moving::of(trajectory, near)?,
            start: DVector::from_vec(start.collect()),
        })
    }

    /// Of the storage where the transient begins.
    pub(crate) fn start(&self) -> &DVector<f64> {
        &self.start
    }

    /// Of a guard.
    pub(super) fn guard(&self, guard: Guard) -> Option<&RowDVector<f64>> {
        let found = self.guards.iter().find(|(own, _)| *own == guard);
        found.map(|(_, row)| row)
    }

    /// Whether every source that moves does so by a constant, or with its edges.
    pub(crate) fn is_plain(&self) -> bool {
        self.moving.iter().all(|moving| moving.is_told)
    }

    /// The same with what constant changes of sources make among the constants.
    pub(crate) fn with_constants(mut self, trajectory: &Trajectory, forms: &Forms) -> Self {
        for at in 0..self.moving.len() {
            let moving = &mut self.moving[at];
            let (i, Course::Constant(by)) = (moving.input, moving.course(forms)) else {
                continue;
            };
            moving.is_told = true;
            for (change, system) in self.systems.iter_mut().zip(&trajectory.systems) {
                let count = change.outputs.nrows();
                let outputs = shaped(&system.lcs.outputs.rows.u, count, system.lcs.p());
                let blocks = [
                    (&mut change.rate, &system.inputs),
                    (&mut change.outputs, &outputs),
                    (&mut change.storage, &system.storage_inputs),
                ];
                for (block, rows) in blocks {
                    let last = block.ncols() - 1;
                    block.column_mut(last).axpy(by, &rows.column(i), 1.0);
                }
            }
            for (guard, row) in &mut self.guards {
                let last = row.len() - 1;
                row[last] += by * trajectory.of_input(*guard, i);
            }
        }
        self
    }
}
