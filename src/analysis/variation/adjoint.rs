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

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixView, DVector};

use super::Trajectory;
use super::carried::Carried;
use super::change::{Change, Guard, columns, short_columns};
use super::costate::Outer;
use super::drawing::{Drawing, Lines, Piece, Weighted};
use super::forms::Forms;
use super::length::Length;
use super::linear::Motion;
use super::parameter::{Jump, read};
use crate::integrate::Error;
use crate::linalg::product::add_outer;
use crate::measure::VALUES;
use crate::settings::tolerances::times::SAME_LENGTH;

/// Values of sums that are kept at most before they are carried to their integrals.
const MOST_SUMS: usize = 1 << 24;

/// A run to go back along.
pub(crate) struct Adjoint<'a> {
    pub(crate) trajectory: &'a Trajectory,
    pub(crate) forms: &'a Forms,
    pub(crate) lines: &'a Lines,
    pub(crate) drawing: &'a Drawing,
}

/// What measurements see of a segment.
struct View {
    /// Its first piece in the drawing.
    first: usize,
    /// How many of its pieces lead to the last one that is weighed.
    weighed: usize,
    /// How many of these end before it does.
    whole: usize,
    /// What it takes beyond these: beyond what is weighed, and where nothing is, the rest is one stretch, and so is what it has of a piece that ends later.
    rest: Length,
}

/// Adds Σ_c ψ_c rowᵀ to one block of each.
fn add(
    into: &mut [Change],
    psi: &DMatrix<f64>,
    row: &DVector<f64>,
    block: fn(&mut Change) -> &mut DMatrix<f64>,
) {
    for (into, psi) in into.iter_mut().zip(psi.column_iter()) {
        add_outer(block(into), psi.as_slice(), row.as_slice());
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
        weighted: &[&Weighted],
        last: Option<&DMatrix<f64>>,
    ) -> Result<Carried, Error> {
        let (mut carried, outer) = self.along(motions, weighted, last)?;
        for (motion, outer) in motions.iter_mut().zip(outer) {
            let system = motion.linear.system;
            let n = self.trajectory.systems[system].lcs.n();
            let sources = &motion.linear.exosystem;
            let (generator, output) = (sources.generator(), sources.output());
            let read = read(n, output, generator, true).transpose();
            let basis = motion.linear.basis.as_ref();
            let all = carried.systems[system].iter_mut();
            for (sums, (mut whole, mut outputs)) in all.zip(outer.whole(motion)?) {
                if let Some(basis) = basis {
                    let to = basis.to.transpose();
                    whole = basis.from.tr_mul(&whole) * &to;
                    outputs *= to;
                }
                sums.rate += whole.rows(0, n) * &read;
                sums.outputs += outputs * &read;
            }
        }
        Ok(carried)
    }

    /// What weighs the storage at the start, q×measurements, alone: see [`Self::back`].
    ///
    /// # Errors
    /// An exponential does not exist in doubles.
    pub(crate) fn to_start(
        &self,
        motions: &mut [Motion<'_>],
        weighted: &[&Weighted],
    ) -> Result<DMatrix<f64>, Error> {
        Ok(self.along(motions, weighted, None)?.0.start)
    }

    /// The same as [`Self::back`], where the integrals of the segments are left as sums.
    fn along<'m>(
        &self,
        motions: &mut [Motion<'m>],
        weighted: &[&Weighted],
        last: Option<&DMatrix<f64>>,
    ) -> Result<(Carried, Vec<Outer<'m>>), Error> {
        let costates = weighted.len();
        let views = self.views(motions, weighted);
        let trajectory = self.trajectory;
        let mut carried = Carried::none(trajectory, costates);
        let mut outer: Vec<Outer<'m>> = motions
            .iter()
            .map(|motion| Outer::of(motion.linear, costates))
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
                (&psi, weighted, &views[k]),
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
        Ok((carried, outer))
    }

    /// ψ before the event after segment k.
    fn event(
        &self,
        k: usize,
        psi: &DMatrix<f64>,
        weighted: &[&Weighted],
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
        for (theta, weighted) in theta.iter_mut().zip(weighted) {
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

    /// How measurements see the segments.
    fn views(&self, motions: &[Motion<'_>], weighted: &[&Weighted]) -> Vec<View> {
        let drawing = self.drawing;
        let mut first = 0;
        let mut views = Vec::with_capacity(drawing.seconds.len());
        for (k, seconds) in drawing.seconds.iter().enumerate() {
            first += drawing.pieces[first..].partition_point(|piece| piece.segment < k);
            let pieces = drawing.pieces[first..].iter();
            let pieces = pieces.take_while(|piece| piece.segment == k).count();
            let pieces = &drawing.pieces[first..first + pieces];
            let weighed = (0..pieces.len()).rev();
            let mut weighed = weighed.skip_while(|j| !self.is_weighed(first + j, weighted));
            let weighed = weighed.next().map_or(0, |j| j + 1);
            let ends = |piece: &Piece| piece.age + piece.length;
            let whole = pieces[..weighed].partition_point(|piece| ends(piece) <= *seconds);
            let age = pieces[..whole].last().map_or(0.0, ends);
            let rest = Length {
                seconds: seconds - age,
                recurs: false,
            };
            views.push(View {
                first,
                weighed,
                whole,
                rest,
            });
        }
        let stretches = views.iter().zip(&self.lines.starts);
        let stretches = stretches.map(|(view, (at, _))| (*at, view.rest.seconds));
        let dims = motions.iter().map(|motion| motion.linear.generator.nrows());
        let until = self.trajectory.segments.last().map_or(0.0, |last| last.to);
        let lengths = Length::of(
            &stretches.collect::<Vec<_>>(),
            &dims.collect::<Vec<_>>(),
            SAME_LENGTH * until.abs(),
        );
        for (view, rest) in views.iter_mut().zip(lengths) {
            view.rest = rest;
        }
        views
    }

    /// Whether outputs are weighed in a piece of the drawing.
    fn is_weighed(&self, piece: usize, weighted: &[&Weighted]) -> bool {
        let rows = self.rows(piece..piece + 1);
        weighted.iter().any(|weighted| {
            let nodes = weighted.nodes[rows.clone()].as_flattened();
            nodes.iter().any(|weight| *weight != 0.0)
        })
    }

    /// Where the outputs of pieces stand.
    fn rows(&self, pieces: Range<usize>) -> Range<usize> {
        pieces.start * self.drawing.columns..pieces.end * self.drawing.columns
    }

    /// ψ at the start of segment k, from ψ at its end.
    fn segment(
        &self,
        k: usize,
        (motion, outer): (&mut Motion<'_>, &mut Outer<'_>),
        (psi, weighted, view): (&DMatrix<f64>, &[&Weighted], &View),
    ) -> Result<DMatrix<f64>, Error> {
        let basis = motion.linear.basis.as_ref();
        let n = psi.nrows();
        let start = &self.lines.starts[k].1;
        // Of w in its own basis.
        let mut phi = DMatrix::zeros(start.len(), psi.ncols());
        match basis {
            Some(basis) => phi.copy_from(&basis.to.rows(0, n).tr_mul(psi)),
            None => phi.rows_mut(0, n).copy_from(psi),
        }
        let pieces = &self.drawing.pieces[view.first..view.first + view.weighed];
        let mut starts = DMatrix::zeros(start.len(), view.whole + 1);
        let mut w = start.clone();
        for (j, piece) in pieces[..view.whole].iter().enumerate() {
            starts.set_column(j, &w);
            w = motion.after(piece.level, &w)?;
        }
        starts.set_column(view.whole, &w);
        outer.back_over(motion, view.rest, &mut phi, &w)?;
        let mut end = pieces.len();
        for alike in pieces.chunk_by(|a, b| a.level == b.level).rev() {
            let (level, from) = (alike[0].level, end - alike.len());
            let rows = self.rows(view.first + from..view.first + end);
            let weights = weighted.iter().map(|weighted| {
                let nodes = weighted.nodes[rows.clone()].as_flattened();
                DMatrixView::from_slice(nodes, self.drawing.columns * VALUES, alike.len())
            });
            let weights: Vec<_> = weights.collect();
            let w = starts.columns(from, alike.len());
            let seen = outer.weigh(motion, level, &weights, w.as_view())?;
            for j in (from..end).rev() {
                if j < view.whole {
                    let w = starts.column(j);
                    outer.back(motion, level, &mut phi, w.as_slice())?;
                }
                for (mut phi, seen) in phi.column_iter_mut().zip(&seen) {
                    phi += seen.column(j - from);
                }
            }
            end = from;
        }
        if let Some(basis) = basis {
            phi = basis.from.tr_mul(&phi);
        }
        Ok(phi.rows(0, n).into_owned())
    }
}
