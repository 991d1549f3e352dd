//! What becomes of a change of one value: the variational equation with a column for it.
//!
//! ```text
//! δx' = A δx + E δu + A_p x + E_p u + e_p,     δt = −(γ_x δx⁻ + γ_u δu + γ_p)/γ̇,
//! δx⁺ = J⁺ (X⁻ (δx⁻ + f⁻ δt) + U⁻ (δu + u' δt)) − f⁺ δt + ∂_p [J⁺ (X⁻ x⁻ + U⁻ u + k⁻) + j⁺]
//! ```
//!
//! at the time at which the event was without the change; an edge of a source has the δt of that source.

use nalgebra::{DMatrix, DVector};

use super::change::{Changes, Guard, columns, over, short_columns};
use super::drawing::{Drawing, Piece};
use super::flow::{Flow, Flows, Sources};
use super::forms::{Forms, edge};
use super::instant::Inputs;
use super::moved::Moved;
use super::near::WEIGHTS;
use super::saltation::{Side, Timing};
use super::{Saltation, System, Trajectory, not_smooth};
use crate::circuit::source;
use crate::integrate::Error;
use crate::integrate::exact::{Exosystem, Shape};
use crate::linalg::product::{add_product, product};
use crate::measure::{INTERVALS, VALUES};
use crate::settings::tolerances::events::SAME_TIMING;
use crate::settings::tolerances::periodic::VALUE_STEP;
use crate::settings::tolerances::times::SAME_LENGTH;

/// A trajectory and what changes along it.
pub(crate) struct Parameter<'a> {
    pub(crate) trajectory: &'a Trajectory,
    pub(crate) forms: &'a Forms,
    pub(crate) changes: &'a Changes,
}

/// What the storage jumps by at an event, besides its time.
pub(super) struct Jump<'a> {
    /// The system that is left, the one in whose directions the storage jumps, and the one that follows.
    pub(super) from: &'a System,
    pub(super) through: Option<&'a System>,
    pub(super) to: &'a System,
    /// [x | u | 1] and s before.
    pub(super) left: DVector<f64>,
    pub(super) storage: DVector<f64>,
    /// [x | u | 1] and s in the directions of the jump.
    pub(super) between: Option<(DVector<f64>, DVector<f64>)>,
    /// u afterwards.
    pub(super) after: DVector<f64>,
    /// What δt is times in δx⁺.
    pub(super) drift: DVector<f64>,
}

impl<'a> Jump<'a> {
    /// Of the event after segment k.
    pub(super) fn of(trajectory: &'a Trajectory, forms: &Forms, k: usize) -> Self {
        let (segments, systems) = (&trajectory.segments, &trajectory.systems);
        let saltation = &trajectory.saltations[k];
        let t = saltation.t;
        let side = |k: usize, x: &DVector<f64>| Side {
            system: &systems[segments[k].system],
            x: x.clone(),
            inputs: forms.inputs(k, t),
        };
        let before = side(k, &segments[k].end);
        let after = side(k + 1, &segments[k + 1].start);
        let through = saltation.through.map(|at| &systems[at]);
        let inject = &after.system.lcs.storage.inject;
        let mut drift = -after.rate();
        let mut rate = before.storage_rate();
        let storage = before.system.storage(&before.x, &before.inputs.u);
        let mut between = None;
        if let Some(jump) = through {
            rate = product(
                &jump.lcs.storage.x,
                &product(&jump.lcs.storage.inject, &rate),
            );
            rate += product(&jump.storage_inputs, &after.inputs.du);
            let x = jump.state(storage.as_slice());
            let then = jump.storage(&x, &after.inputs.u);
            between = Some((short_columns(&x, &after.inputs.u), then));
        }
        add_product(drift.as_mut_slice(), inject, rate.as_slice());
        Self {
            from: before.system,
            through,
            to: after.system,
            left: short_columns(&before.x, &before.inputs.u),
            storage,
            between,
            after: after.inputs.u,
            drift,
        }
    }
}

impl Parameter<'_> {
    /// δu at t, as segment k has it.
    fn du(&self, k: usize, t: f64) -> DVector<f64> {
        self.source_change(k, t, source::Piece::value)
    }

    fn source_change(
        &self,
        k: usize,
        t: f64,
        value: fn(&source::Piece, f64) -> f64,
    ) -> DVector<f64> {
        let mut du = DVector::zeros(self.forms.on(k).len());
        for moving in self.changes.moving.iter().filter(|moving| !moving.is_told) {
            du[moving.input] = moving.change(k, t, value);
        }
        du
    }

    /// δx at the start of the first segment, where δs is that of the storage.
    fn start(&self, ds: &DVector<f64>) -> DVector<f64> {
        let first = &self.trajectory.segments[0];
        let system = &self.trajectory.systems[first.system];
        let u = self.forms.inputs(0, first.from).u;
        let storage = system.storage(&first.start, &u);
        let changes = &self.changes.systems[first.system].inject;
        changes * short_columns(&storage, &u) + &system.lcs.storage.inject * ds
    }

    /// δs where δx is that of the state at the end.
    fn end(&self, dx: &DVector<f64>) -> DVector<f64> {
        let k = self.trajectory.segments.len() - 1;
        let last = &self.trajectory.segments[k];
        let system = &self.trajectory.systems[last.system];
        let u = self.forms.inputs(k, last.to).u;
        let changes = &self.changes.systems[last.system].storage;
        changes * short_columns(&last.end, &u)
            + &system.lcs.storage.x * dx
            + &system.storage_inputs * self.du(k, last.to)
    }

    /// The equation of segment k among those that are known, and w where it begins.
    fn enter(&self, flows: &mut Flows, k: usize, dx: &DVector<f64>) -> (usize, DVector<f64>) {
        let segment = &self.trajectory.segments[k];
        let own = self.forms.on(k);
        let (n, p) = (dx.len(), own.len());
        // The sources that move have their closed forms beside them.
        let moving = self.changes.moving.iter();
        let moving: Vec<_> = moving
            .filter(|moving| !moving.is_told)
            .filter(|moving| moving.near[k].iter().any(|near| *near != own[moving.input]))
            .collect();
        let beside = moving.iter().flat_map(|moving| moving.near[k]);
        let pieces: Vec<source::Piece> = own.iter().copied().chain(beside).collect();
        let shapes: Vec<Shape> = pieces.iter().map(|piece| Shape::of([piece])).collect();
        let exosystem = Exosystem::new(&shapes, pieces);
        let dz = exosystem.dim();
        let own = exosystem.output().rows(0, p).into_owned();
        let mut change = DMatrix::zeros(p, dz);
        for (j, moving) in moving.iter().enumerate() {
            for (m, weight) in WEIGHTS.iter().enumerate() {
                let row = exosystem.output().row(p + 4 * j + m) * (weight / VALUE_STEP);
                let mut sum = change.row_mut(moving.input);
                sum += row;
            }
        }
        let sources = Sources {
            own,
            change,
            generator: exosystem.generator().clone(),
        };
        let system = &self.trajectory.systems[segment.system];
        let at = flows.place((segment.system, system), sources, |sources| {
            self.equation(segment.system, sources)
        });
        let mut w = DVector::zeros(2 * n + dz);
        w.rows_mut(0, n).copy_from(&segment.start);
        exosystem.write(segment.from, &mut w.as_mut_slice()[n..n + dz]);
        w.rows_mut(n + dz, n).copy_from(dx);
        (at, flows.at(at).entered(w))
    }

    /// 𝒢, and δy over w, in a mode with these sources.
    fn equation(&self, at: usize, sources: &Sources) -> (DMatrix<f64>, DMatrix<f64>) {
        let (system, changes) = (&self.trajectory.systems[at], &self.changes.systems[at]);
        let (n, p) = (system.lcs.n(), sources.own.nrows());
        let dz = sources.own.ncols();
        let outputs = over(&system.lcs.outputs.rows, (n, p));
        let (count, dim) = (outputs.nrows(), 2 * n + dz);
        // [x | u | u' | 1] over [x | z], and what of that the sources' change makes.
        let own = read(n, &sources.own, &sources.generator, true);
        let change = read(n, &sources.change, &sources.generator, false);
        let plain = DMatrix::from_fn(n, n + 2 * p + 1, |i, j| {
            if j < n {
                system.lcs.a[(i, j)]
            } else if j < n + p {
                system.inputs[(i, j - n)]
            } else if j < n + 2 * p {
                0.0
            } else {
                system.lcs.e0[i]
            }
        });
        let mut generator = DMatrix::zeros(dim, dim);
        let mut put = |i: usize, j: usize, block: &DMatrix<f64>| {
            let mut view = generator.view_mut((i, j), block.shape());
            view += block;
        };
        put(0, 0, &(&plain * &own));
        put(n, n, &sources.generator);
        put(n + dz, 0, &(&changes.rate * &own + &plain * &change));
        put(n + dz, n + dz, &system.lcs.a);
        let mut rows = DMatrix::zeros(count, dim);
        rows.columns_mut(0, n + dz)
            .copy_from(&(&changes.outputs * &own + &outputs * &change));
        rows.columns_mut(n + dz, n)
            .copy_from(&outputs.columns(0, n));
        (generator, rows)
    }

    /// Goes along the trajectory from δs: how what is drawn of it moves, and δs at the end.
    ///
    /// # Errors
    /// The derivative does not exist.
    pub(crate) fn along(
        &self,
        ds: &DVector<f64>,
        drawing: Option<&Drawing>,
    ) -> Result<(Moved, DVector<f64>), Error> {
        let segments = &self.trajectory.segments;
        let mut moved = Moved {
            changes: Vec::new(),
            ends: vec![0.0],
        };
        let mut dx = self.start(ds);
        let mut flows = Flows::default();
        let pieces = drawing.map_or(&[][..], |drawing| &drawing.pieces);
        let mut by_segment = pieces.chunk_by(|a, b| a.segment == b.segment).peekable();
        for (k, segment) in segments.iter().enumerate() {
            let (at, mut w) = self.enter(&mut flows, k, &dx);
            let flow = flows.at(at);
            let seconds = segment.to - segment.from;
            if let Some(pieces) = by_segment.next_if(|pieces| pieces[0].segment == k) {
                see(flow, &w, pieces, &mut moved.changes)?;
            }
            flow.advance(&mut w, seconds, SAME_LENGTH * segment.to.abs())?;
            dx = flow.left(&w, dx.len());
            if drawing.is_some() {
                self.stays(k, &dx)?;
            }
            let Some(saltation) = self.trajectory.saltations.get(k) else {
                moved.ends.push(0.0);
                dx = self.end(&dx);
                break;
            };
            let dt = self.shift(k, saltation, &dx)?;
            moved.ends.push(dt);
            dx = self.passed(k, &dx, dt);
        }
        Ok((moved, dx))
    }

    /// Whether what rests at its threshold in segment k stays there, so that both signs of a change have the same derivative.
    fn stays(&self, k: usize, dx: &DVector<f64>) -> Result<(), Error> {
        let segment = &self.trajectory.segments[k];
        for resting in &segment.resting {
            let inputs = self.forms.inputs(k, segment.to);
            let row = &resting.row;
            let size = row.value(&segment.end, &inputs).1;
            let guard = Guard {
                system: segment.system,
                owner: resting.owner,
            };
            let of_sources = self.guard_sources(k, (&row.u, &row.du), segment.to);
            let change = self.guard_change(k, guard, &inputs)? + of_sources + row.x.dot(dx);
            if change.abs() > SAME_TIMING * size {
                let what = format!(
                    "{} rests at its threshold, which it leaves on one side of this value alone",
                    resting.name
                );
                return Err(not_smooth(segment.to, what));
            }
        }
        Ok(())
    }

    /// δt of the event after segment k.
    fn shift(&self, k: usize, saltation: &Saltation, dx: &DVector<f64>) -> Result<f64, Error> {
        let (segment, t) = (&self.trajectory.segments[k], saltation.t);
        let Some(timing) = &saltation.timing else {
            return edge(self.trajectory, (self.forms, &self.changes.moving), k);
        };
        let own = self.shift_of(k, (timing, t), dx)?;
        for other in &saltation.others {
            let apart = (self.shift_of(k, (other, t), dx)? - own).abs();
            if apart > SAME_TIMING * own.abs().max(segment.to - segment.from) {
                let what = "two events coincide that part when the value is another";
                return Err(not_smooth(t, what));
            }
        }
        Ok(own)
    }

    /// The same by one of its guards.
    fn shift_of(
        &self,
        k: usize,
        (timing, t): (&Timing, f64),
        dx: &DVector<f64>,
    ) -> Result<f64, Error> {
        let guard = Guard {
            system: self.trajectory.segments[k].system,
            owner: timing.guard,
        };
        let change = self.guard_change(k, guard, &self.forms.inputs(k, t))?;
        let rows = [&timing.u, &timing.du].map(|row| row.transpose());
        let of_sources = self.guard_sources(k, (&rows[0], &rows[1]), t);
        Ok((&timing.x * dx)[0] + of_sources - change / timing.slope)
    }

    /// Derivative of a guard with ln p where state and sources stay as they are at the end of segment k.
    fn guard_change(&self, k: usize, guard: Guard, inputs: &Inputs) -> Result<f64, Error> {
        let segment = &self.trajectory.segments[k];
        let row = self.changes.guard(guard).ok_or_else(|| {
            let what = "an event has no guard where the value is another";
            not_smooth(segment.to, what)
        })?;
        Ok((row * columns(&segment.end, &inputs.u, &inputs.du))[0])
    }

    /// What the sources' change at t makes of rows over u and u'.
    fn guard_sources(&self, k: usize, (u, du): (&DVector<f64>, &DVector<f64>), t: f64) -> f64 {
        u.dot(&self.du(k, t)) + du.dot(&self.source_change(k, t, source::Piece::derivative))
    }

    /// δx after the event that follows segment k.
    fn passed(&self, k: usize, dx: &DVector<f64>, dt: f64) -> DVector<f64> {
        let jump = Jump::of(self.trajectory, self.forms, k);
        let (segments, t) = (&self.trajectory.segments, self.trajectory.saltations[k].t);
        let changes = |at: usize| &self.changes.systems[at];
        let after = self.du(k + 1, t);
        let mut storage = &jump.storage;
        let mut ds = &changes(segments[k].system).storage * &jump.left
            + &jump.from.lcs.storage.x * dx
            + &jump.from.storage_inputs * self.du(k, t);
        let through = self.trajectory.saltations[k].through;
        if let Some(((at, system), (left, then))) =
            through.zip(jump.through).zip(jump.between.as_ref())
        {
            let dx = &changes(at).inject * short_columns(storage, &jump.after)
                + &system.lcs.storage.inject * ds;
            ds = &changes(at).storage * left
                + &system.lcs.storage.x * dx
                + &system.storage_inputs * &after;
            storage = then;
        }
        &changes(segments[k + 1].system).inject * short_columns(storage, &jump.after)
            + &jump.to.lcs.storage.inject * ds
            + jump.drift * dt
    }
}

/// [x | u | u' | 1] over [x | z], where u = H z and z' = S z; without x and 1 where `whole` is false.
pub(super) fn read(n: usize, h: &DMatrix<f64>, s: &DMatrix<f64>, whole: bool) -> DMatrix<f64> {
    let (p, dz) = h.shape();
    let mut all = DMatrix::zeros(n + 2 * p + 1, n + dz);
    all.view_mut((n, n), (p, dz)).copy_from(h);
    all.view_mut((n + p, n), (p, dz)).copy_from(&(h * s));
    if whole {
        (0..n).for_each(|i| all[(i, i)] = 1.0);
        all[(n + 2 * p, n)] = 1.0;
    }
    all
}

/// How the pieces of a segment move at times that stay, from w on.
fn see(
    flow: &mut Flow,
    w: &DVector<f64>,
    pieces: &[Piece],
    changes: &mut Vec<[f64; VALUES]>,
) -> Result<(), Error> {
    let mut w = w.clone();
    for piece in pieces {
        let begun = changes.len();
        changes.resize(begun + flow.outputs(), [0.0; VALUES]);
        for j in 0..VALUES {
            if j > 0 {
                flow.advance(&mut w, piece.length / INTERVALS as f64, 0.0)?;
            }
            let row = flow.sample(&w);
            for (changes, value) in changes[begun..].iter_mut().zip(row.iter()) {
                changes[j] = *value;
            }
        }
    }
    Ok(())
}
