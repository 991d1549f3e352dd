//! The closed forms of the sources along a run, and those of circuits beside it.

use super::instant::Inputs;
use super::near::{Near, difference};
use super::{Trajectory, not_smooth};
use crate::circuit::Source;
use crate::circuit::source::Piece;
use crate::integrate::Error;
use crate::settings::tolerances::events::SAME_TIMING;
use nalgebra::DVector;

/// The sources on every segment.
pub(crate) struct Forms(Vec<Vec<Piece>>);

/// A source that is another one where the value is another.
#[derive(Debug, Clone)]
pub(crate) struct Moving {
    /// Its number.
    pub(super) input: usize,
    /// Whether it moves by a constant, which is told elsewhere, or with its edges alone.
    pub(super) is_told: bool,
    /// By segment its closed forms in the circuits that are compared: the pieces of the same number, wherever their edges have moved to.
    pub(super) near: Vec<[Piece; 4]>,
}

/// How a source moves while no edge of it passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Course {
    /// By so much throughout: 0 where its edges alone move.
    Constant(f64),
    /// Otherwise.
    Curved,
}

fn piece(source: &Source, t: f64) -> Result<Piece, Error> {
    let piece = source.piece(t);
    piece.ok_or_else(|| not_smooth(t, "a source has no closed form"))
}

/// The piece after one: the last is followed by itself.
fn following(source: &Source, standing: &Piece) -> Result<Piece, Error> {
    let mut t = standing.end;
    while t.is_finite() {
        let next = piece(source, t)?;
        if next.end > standing.end {
            return Ok(next);
        }
        t = t.next_up();
    }
    Ok(*standing)
}

/// The pieces of several sources by segment, on each as many edges from t = 0 on as the first one has passed by then.
fn walk<const N: usize>(
    trajectory: &Trajectory,
    sources: [&Source; N],
) -> Result<Vec<[Piece; N]>, Error> {
    let mut standing = Vec::with_capacity(N);
    for source in sources {
        standing.push(piece(source, 0.0)?);
    }
    let mut found = Vec::with_capacity(trajectory.segments.len());
    for segment in &trajectory.segments {
        while standing[0].end <= 0.5 * (segment.from + segment.to) {
            for (source, standing) in sources.iter().zip(&mut standing) {
                *standing = following(source, standing)?;
            }
        }
        found.push(std::array::from_fn(|m| standing[m]));
    }
    Ok(found)
}

impl Forms {
    /// Of the run's own sources.
    ///
    /// # Errors
    /// One has no closed form.
    pub(crate) fn of(trajectory: &Trajectory) -> Result<Self, Error> {
        let inputs = trajectory.systems.first();
        let inputs = inputs.map_or(&[][..], |system| &system.lcs.inputs);
        let mut by_segment = vec![Vec::with_capacity(inputs.len()); trajectory.segments.len()];
        for input in inputs {
            let all = walk(trajectory, [&input.source])?;
            for (pieces, [piece]) in by_segment.iter_mut().zip(all) {
                pieces.push(piece);
            }
        }
        Ok(Self(by_segment))
    }

    /// On segment k.
    pub(crate) fn on(&self, k: usize) -> &[Piece] {
        &self.0[k]
    }

    /// u and its rates at t, as segment k has them.
    pub(super) fn inputs(&self, k: usize, t: f64) -> Inputs {
        let pieces = &self.0[k];
        let values = |value: fn(&Piece, f64) -> f64| {
            DVector::from_iterator(pieces.len(), pieces.iter().map(|piece| value(piece, t)))
        };
        Inputs {
            u: values(Piece::value),
            du: values(Piece::derivative),
            ddu: values(Piece::second_derivative),
        }
    }
}

impl Moving {
    /// The sources that differ among these circuits.
    ///
    /// # Errors
    /// One has no closed form.
    pub(super) fn of(trajectory: &Trajectory, near: &[Near; 4]) -> Result<Vec<Self>, Error> {
        Self::among(trajectory, near.each_ref().map(|near| &near.sources[..]))
    }

    /// The same of their sources.
    ///
    /// # Errors
    /// One has no closed form.
    pub(super) fn among(trajectory: &Trajectory, near: [&[Source]; 4]) -> Result<Vec<Self>, Error> {
        let Some(own) = trajectory.systems.first() else {
            return Ok(vec![]);
        };
        let mut found = Vec::new();
        for (input, own) in own.lcs.inputs.iter().enumerate() {
            let near = near.map(|sources| &sources[input]);
            if near.iter().all(|near| **near == own.source) {
                continue;
            }
            let [a, b, c, d] = near;
            let all = walk(trajectory, [&own.source, a, b, c, d])?;
            let near = all.into_iter().map(|[_, a, b, c, d]| [a, b, c, d]);
            found.push(Self {
                input,
                is_told: false,
                near: near.collect(),
            });
        }
        Ok(found)
    }

    /// Its change with ln p at t of what `value` tells, as segment k has it.
    pub(super) fn change(&self, k: usize, t: f64, value: fn(&Piece, f64) -> f64) -> f64 {
        difference(self.near[k].each_ref().map(|piece| value(piece, t)))
    }

    /// How it moves on all segments.
    pub(super) fn course(&self, forms: &Forms) -> Course {
        let mut found: Option<f64> = None;
        for (k, near) in self.near.iter().enumerate() {
            let own = &forms.on(k)[self.input];
            let level = |piece: &Piece| {
                (piece.slope == 0.0 && piece.terms().next().is_none()).then_some(piece.constant)
            };
            let levels = near.each_ref().map(level);
            let change = match (level(own), levels) {
                (Some(_), [Some(a), Some(b), Some(c), Some(d)]) => difference([a, b, c, d]),
                _ => return Course::Curved,
            };
            if found.is_some_and(|found| found != change) {
                return Course::Curved;
            }
            found = Some(change);
        }
        Course::Constant(found.unwrap_or(0.0))
    }
}

/// δt of the sources that jump after segment k, by those that move.
pub(super) fn edge(
    trajectory: &Trajectory,
    (forms, moving): (&Forms, &[Moving]),
    k: usize,
) -> Result<f64, Error> {
    if moving.is_empty() {
        return Ok(0.0);
    }
    let (segment, t) = (&trajectory.segments[k], trajectory.saltations[k].t);
    let (own, after) = (forms.on(k), forms.on(k + 1));
    let jumps = |i: &usize| {
        let (left, right) = (own[*i].value(t), after[*i].value(t));
        (left - right).abs() > 64.0 * f64::EPSILON * left.abs().max(right.abs())
    };
    let mut found: Option<f64> = None;
    for i in (0..own.len()).filter(jumps) {
        let moves = moving.iter().find(|moving| moving.input == i);
        let ends = moves.map_or([0.0; 4], |moving| moving.near[k].map(|piece| piece.end));
        let change = difference(ends);
        let change = if change.is_finite() { change } else { 0.0 };
        let length = segment.to - segment.from;
        match found {
            Some(other)
                if (other - change).abs()
                    > SAME_TIMING * other.abs().max(change.abs()).max(SAME_TIMING * length) =>
            {
                let what = "edges of sources coincide that part when the value is another";
                return Err(not_smooth(t, what));
            }
            _ => found = Some(change),
        }
    }
    Ok(found.unwrap_or(0.0))
}
