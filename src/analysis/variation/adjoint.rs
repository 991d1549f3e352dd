//! The variational equation transposed: one pass back along a run has the derivatives of a measurement to any number of values.
//!
//! With costates ψ, ψᵀ δx what a later measurement makes of δx, and what weighs δt of an event, θ = ψ⁺ᵀ d + its own weight with the drift d that δt is times in δx⁺,
//!
//! ```text
//! ψ' = −Aᵀ ψ,      ψ⁻ = X⁻ᵀ J⁺ᵀ ψ⁺ − γ_x θ/γ̇,
//! dJ/dp = Σ ⟨A_p, ∫ ψ xᵀ dt⟩ + ⟨J_p, Σ ψ⁺ s⁻ᵀ⟩ − Σ θ γ_p/γ̇ + …
//! ```
//!
//! (Y. Cao, S. Li, L. Petzold, R. Serban, "Adjoint sensitivity analysis for differential-algebraic equations", 2003; I. A. Hiskens, M. A. Pai,
//! "Trajectory sensitivity analysis of hybrid systems", 2000, for the events). The sums are taken mode by mode, before there is any p: a value costs products of two matrices
//! per mode, however often the run changes mode. In the steady state what weighs the state that returns, λ = (I − Mᵀ)⁻¹ ψ₀, goes around once more.

use nalgebra::{DMatrix, DVector};

use super::Trajectory;
use super::carried::Carried;
use super::change::{Change, Guard, columns, short_columns};
use super::costate::Outer;
use super::drawing::{Drawing, LEVELS, Lines, Weighted};
use super::forms::Forms;
use super::linear::Motion;
use super::parameter::{Jump, read};
use crate::integrate::Error;
use crate::measure::INTERVALS;

/// Values of sums that are kept at most before they are carried to their integrals.
const MOST_SUMS: usize = 1 << 24;

/// A run to go back along.
pub(crate) struct Adjoint<'a> {
    pub(crate) trajectory: &'a Trajectory,
    pub(crate) forms: &'a Forms,
    pub(crate) lines: &'a Lines,
    pub(crate) drawing: &'a Drawing,
}

/// Adds Σ_c ψ_c rowᵀ to one block of each.
fn add(
    into: &mut [Change],
    psi: &DMatrix<f64>,
    row: &DVector<f64>,
    block: fn(&mut Change) -> &mut DMatrix<f64>,
) {
    for (into, psi) in into.iter_mut().zip(psi.column_iter()) {
        block(into).ger(1.0, &psi, row, 1.0);
    }
}

impl Trajectory {
    /// Whether variations that are told to part, or that rest, have to be looked at one by one.
    pub(crate) fn has_chances(&self) -> bool {
        let resting = self
            .segments
            .iter()
            .any(|segment| !segment.resting.is_empty());
        resting
            || self
                .saltations
                .iter()
                .any(|saltation| !saltation.others.is_empty())
    }
}

impl Adjoint<'_> {
    /// Goes back along the run: from what measurements weigh of it, and from what weighs its last storage, q×measurements, where that is given.
    ///
    /// # Errors
    /// An exponential does not exist in doubles.
    pub(crate) fn back(
        &self,
        motions: &mut [Motion<'_>],
        weighted: Option<&[Weighted]>,
        last: Option<&DMatrix<f64>>,
    ) -> Result<Carried, Error> {
        let costates = last.map_or_else(|| weighted.map_or(0, <[_]>::len), DMatrix::ncols);
        let trajectory = self.trajectory;
        let mut carried = Carried::none(trajectory, costates);
        let mut outer: Vec<Outer> = motions
            .iter()
            .map(|motion| Outer::of(motion.linear.generator.nrows(), costates))
            .collect();
        let k = trajectory.segments.len() - 1;
        let end = &trajectory.segments[k];
        let lcs = &trajectory.systems[end.system].lcs;
        let mut psi = DMatrix::zeros(lcs.n(), costates);
        if let Some(last) = last {
            let row = short_columns(&end.end, &self.forms.inputs(k, end.to).u);
            add(&mut carried.systems[end.system], last, &row, |c| {
                &mut c.storage
            });
            psi = lcs.storage.x.tr_mul(last);
        }
        for k in (0..trajectory.segments.len()).rev() {
            if k < trajectory.saltations.len() {
                psi = self.event(k, &psi, weighted, &mut carried);
            }
            let at = self.lines.starts[k].0;
            psi = self.segment(
                k,
                (&mut motions[at], &mut outer[at]),
                (&psi, weighted),
                &mut carried,
            )?;
            if outer.iter().map(Outer::values).sum::<usize>() > MOST_SUMS {
                for (motion, outer) in motions.iter_mut().zip(&mut outer) {
                    outer.settle(motion)?;
                }
            }
        }
        let first = &trajectory.segments[0];
        let system = &trajectory.systems[first.system];
        let u = self.forms.inputs(0, first.from).u;
        let row = short_columns(&system.storage(&first.start, &u), &u);
        add(&mut carried.systems[first.system], &psi, &row, |c| {
            &mut c.inject
        });
        carried.start = system.lcs.storage.inject.tr_mul(&psi);
        for (motion, outer) in motions.iter_mut().zip(outer) {
            let whole = outer.whole(motion)?;
            let system = motion.linear.system;
            let n = trajectory.systems[system].lcs.n();
            for (sums, whole) in carried.systems[system].iter_mut().zip(whole) {
                let [generator, output] = &motion.linear.sources;
                let whole = match &motion.linear.basis {
                    Some(basis) => basis.from.tr_mul(&whole) * basis.to.transpose(),
                    None => whole,
                };
                let read = read(n, output, generator, true);
                sums.rate += whole.rows(0, n) * read.transpose();
            }
        }
        Ok(carried)
    }

    /// ψ before the event after segment k.
    fn event(
        &self,
        k: usize,
        psi: &DMatrix<f64>,
        weighted: Option<&[Weighted]>,
        carried: &mut Carried,
    ) -> DMatrix<f64> {
        let trajectory = self.trajectory;
        let saltation = &trajectory.saltations[k];
        let jump = Jump::of(trajectory, self.forms, k);
        let (from, to) = (
            trajectory.segments[k].system,
            trajectory.segments[k + 1].system,
        );
        let mut theta = psi.tr_mul(&jump.drift);
        for (theta, weighted) in theta.iter_mut().zip(weighted.unwrap_or_default()) {
            *theta += weighted.shifts[k + 1];
        }
        let entering = jump
            .between
            .as_ref()
            .map_or(&jump.storage, |(_, then)| then);
        let row = short_columns(entering, &jump.after);
        add(&mut carried.systems[to], psi, &row, |c| &mut c.inject);
        let mut sigma = jump.to.lcs.storage.inject.tr_mul(psi);
        if let Some(((at, system), (between, _))) = saltation
            .through
            .zip(jump.through)
            .zip(jump.between.as_ref())
        {
            add(&mut carried.systems[at], &sigma, between, |c| {
                &mut c.storage
            });
            let psi = system.lcs.storage.x.tr_mul(&sigma);
            let row = short_columns(&jump.storage, &jump.after);
            add(&mut carried.systems[at], &psi, &row, |c| &mut c.inject);
            sigma = system.lcs.storage.inject.tr_mul(&psi);
        }
        add(&mut carried.systems[from], &sigma, &jump.left, |c| {
            &mut c.storage
        });
        let mut before = jump.from.lcs.storage.x.tr_mul(&sigma);
        match &saltation.timing {
            Some(timing) => {
                let segment = &trajectory.segments[k];
                let inputs = self.forms.inputs(k, saltation.t);
                let row = columns(&segment.end, &inputs.u, &inputs.du);
                let rows = theta.iter().map(|theta| &row * (-theta / timing.slope));
                let guard = Guard {
                    system: from,
                    owner: timing.guard,
                };
                carried.add_guard(guard, &rows.collect::<Vec<_>>());
                before.ger(1.0, &timing.x.transpose(), &theta, 1.0);
            }
            None => carried.edges[k] += theta,
        }
        before
    }

    /// ψ at the start of segment k, from ψ at its end.
    fn segment(
        &self,
        k: usize,
        (motion, outer): (&mut Motion<'_>, &mut Outer),
        (psi, weighted): (&DMatrix<f64>, Option<&[Weighted]>),
        carried: &mut Carried,
    ) -> Result<DMatrix<f64>, Error> {
        let linear = motion.linear;
        let n = psi.nrows();
        let seconds = self.drawing.seconds[k];
        let start = &self.lines.starts[k].1;
        // Of w in its own basis.
        let mut last = DMatrix::zeros(start.len(), psi.ncols());
        match &linear.basis {
            Some(basis) => last.copy_from(&basis.to.rows(0, n).tr_mul(psi)),
            None => last.rows_mut(0, n).copy_from(psi),
        }
        let mut phi = match weighted {
            Some(weighted) => self.seen(k, (motion, outer), (last, weighted), carried)?,
            None => {
                outer.back_over(motion, seconds, &mut last, start)?;
                last
            }
        };
        if let Some(basis) = &linear.basis {
            phi = basis.from.tr_mul(&phi);
        }
        Ok(phi.rows(0, n).into_owned())
    }

    /// φ at the start of segment k with what is weighed in it.
    fn seen(
        &self,
        k: usize,
        (motion, outer): (&mut Motion<'_>, &mut Outer),
        (mut last, weighted): (DMatrix<f64>, &[Weighted]),
        carried: &mut Carried,
    ) -> Result<DMatrix<f64>, Error> {
        let (drawing, linear) = (self.drawing, motion.linear);
        let seconds = drawing.seconds[k];
        let mut w = self.lines.starts[k].1.clone();
        let first = drawing.pieces.partition_point(|piece| piece.segment < k);
        let pieces = drawing.pieces[first..].iter();
        let pieces: Vec<_> = pieces.take_while(|piece| piece.segment == k).collect();
        let rows = |j: usize| (first + j) * drawing.columns..(first + j + 1) * drawing.columns;
        let is_weighed = |j: usize| {
            let mut all = weighted
                .iter()
                .flat_map(|weighted| &weighted.nodes[rows(j)]);
            all.any(|nodes| nodes.iter().any(|weight| *weight != 0.0))
        };
        // Beyond what is weighed, and where nothing is, the rest is one stretch.
        let count = (0..pieces.len())
            .rev()
            .find(|j| is_weighed(*j))
            .map_or(0, |j| j + 1);
        let mut nodes = Vec::with_capacity(count * INTERVALS);
        for piece in &pieces[..count] {
            for j in 0..INTERVALS {
                let age = piece.age + piece.length * j as f64 / INTERVALS as f64;
                let next = motion.after(piece.level + LEVELS, &w)?;
                nodes.push((age, std::mem::replace(&mut w, next)));
            }
        }
        if count == 0 {
            outer.back_over(motion, seconds, &mut last, &w)?;
            return Ok(last);
        }
        let end = pieces[count - 1].age + pieces[count - 1].length;
        // Where the segment ends on the way: before the end of the last piece or after it.
        let mut rest = Some(last);
        let mut phi = DMatrix::zeros(w.len(), weighted.len());
        if end <= seconds
            && let Some(mut rest) = rest.take()
        {
            outer.back_over(motion, seconds - end, &mut rest, &w)?;
            phi += rest;
        }
        let system = &mut carried.systems[linear.system];
        let [generator, output] = &linear.sources;
        let n = linear.generator.nrows() - generator.nrows();
        let read = read(n, output, generator, true);
        let mut weigh = |j: usize, node: usize, w: &DVector<f64>, phi: &mut DMatrix<f64>| {
            let mut columns = None;
            for (c, weighted) in weighted.iter().enumerate() {
                let own = weighted.nodes[rows(j)].iter().map(|nodes| nodes[node]);
                let own = DVector::from_iterator(drawing.columns, own);
                if own.iter().all(|weight| *weight == 0.0) {
                    continue;
                }
                let mut column = phi.column_mut(c);
                column += linear.rows[0].tr_mul(&own);
                let columns = columns.get_or_insert_with(|| match &linear.basis {
                    Some(basis) => &read * (&basis.to * w),
                    None => &read * w,
                });
                system[c].outputs.ger(1.0, &own, columns, 1.0);
            }
        };
        weigh(count - 1, INTERVALS, &w, &mut phi);
        for (at, (age, w)) in nodes.iter().enumerate().rev() {
            let (j, node) = (at / INTERVALS, at % INTERVALS);
            outer.back(motion, pieces[j].level + LEVELS, &mut phi, w)?;
            if *age <= seconds
                && let Some(mut rest) = rest.take()
            {
                outer.back_over(motion, seconds - age, &mut rest, w)?;
                phi += rest;
            }
            weigh(j, node, w, &mut phi);
            if node == 0 && j > 0 {
                weigh(j - 1, INTERVALS, w, &mut phi);
            }
        }
        Ok(phi)
    }
}
