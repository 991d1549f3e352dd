//! The outputs of a run as the smooth pieces that measurements see, and what measurements weigh of how they move.

use nalgebra::{DMatrix, DVector};

use super::course::Stretch;
use super::forms::Forms;
use super::linear::{Linear, Motion, Part, parts};
use super::{System, Trajectory};
use crate::circuit::{Weights, source};
use crate::integrate::Error;
use crate::measure::{Curves, INTERVALS, VALUES};

/// Which part of a run is seen, and in which steps.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sight {
    /// Segments that end later, s.
    pub(crate) from: f64,
    /// Steps are halvings of it, s.
    pub(crate) unit: f64,
    /// Values at most.
    pub(crate) most: usize,
}

/// The segments of a run as w' = 𝒜 w: the equations, and by segment which one it is and w where it begins. Sources that no system sees are zero in them.
pub(crate) struct Lines {
    known: Vec<Linear>,
    pub(super) starts: Vec<(usize, DVector<f64>)>,
}

/// A piece of a segment.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub(super) segment: usize,
    /// Since the segment began, s.
    pub(super) age: f64,
    /// When it begins, s.
    pub(super) begin: f64,
    /// Halvings of the unit that make its length.
    pub(super) level: u32,
    /// s.
    pub(super) length: f64,
    /// The part of it that belongs to the segment.
    pub(super) until: f64,
}

/// See the [module](self).
pub(crate) struct Drawing {
    pub(super) columns: usize,
    pub(super) pieces: Vec<Piece>,
    /// By piece and output.
    pub(super) values: Vec<[f64; VALUES]>,
    /// Their rates.
    pub(super) rates: Vec<[f64; VALUES]>,
    /// By segment, s.
    pub(super) seconds: Vec<f64>,
}

/// What a measurement weighs: dJ = Σ nodes · δy at times that stay + Σ shifts · δt of the events.
#[derive(Debug, Clone)]
pub(crate) struct Weighted {
    /// By piece and output.
    pub(super) nodes: Vec<[f64; VALUES]>,
    /// By segment of the time at which it begins, and of the last one's end.
    pub(super) shifts: Vec<f64>,
}

impl Weighted {
    /// Of values by piece and output, and of times.
    pub(crate) const fn of_values(nodes: Vec<[f64; VALUES]>, shifts: Vec<f64>) -> Self {
        Self { nodes, shifts }
    }

    /// What times weigh.
    pub(crate) fn shifts(&self) -> &[f64] {
        &self.shifts
    }

    /// What values weigh, by piece and output.
    pub(crate) fn nodes(&self) -> &[[f64; VALUES]] {
        &self.nodes
    }

    /// What the difference of both weighs.
    pub(crate) fn minus(mut self, other: &Self) -> Self {
        let nodes = other.nodes.as_flattened();
        let all = self.nodes.as_flattened_mut().iter_mut();
        let all = all
            .zip(nodes)
            .chain(self.shifts.iter_mut().zip(&other.shifts));
        all.for_each(|(own, other)| *own -= other);
        self
    }

    /// Whether it weighs the same to a part of the largest weight of values.
    pub(crate) fn is_like(&self, other: &Self, part: f64) -> bool {
        let all = self.nodes.iter().flatten();
        let largest = all.clone().fold(0.0, |m: f64, a| m.max(a.abs()));
        let mut all = all.zip(other.nodes.iter().flatten());
        all.all(|(a, b)| (a - b).abs() <= part * largest)
    }
}

impl Lines {
    /// Of all segments.
    pub(crate) fn of(trajectory: &Trajectory, forms: &Forms) -> Self {
        let systems: &[System] = &trajectory.systems;
        let inputs = systems.first().map_or(0, |system| system.lcs.p());
        let seen = |input: usize| systems.iter().any(|system| system.sees(input));
        let seen: Vec<bool> = (0..inputs).map(seen).collect();
        let piece = |(piece, seen): (&source::Piece, &bool)| {
            if *seen { *piece } else { source::Piece::zero() }
        };
        let (mut known, mut starts) = (Vec::new(), Vec::new());
        for (k, segment) in trajectory.segments.iter().enumerate() {
            let stretch = Stretch {
                system: segment.system,
                from: segment.from,
                to: segment.to,
                start: segment.start.clone(),
                pieces: forms.on(k).iter().zip(&seen).map(piece).collect(),
            };
            starts.push(Linear::of(&mut known, systems, &stretch));
        }
        Self { known, starts }
    }

    /// Their motions over halvings of so many seconds.
    pub(crate) fn motions(&self, unit: f64) -> Vec<Motion<'_>> {
        self.known.iter().map(|linear| linear.over(unit)).collect()
    }
}

impl Drawing {
    /// The outputs in these segments; nothing where they take too many values.
    ///
    /// # Errors
    /// An exponential does not exist in doubles.
    pub(crate) fn of(
        trajectory: &Trajectory,
        (lines, motions): (&Lines, &mut [Motion<'_>]),
        sight: Sight,
    ) -> Result<Option<Self>, Error> {
        let system = trajectory.systems.first();
        let segments = trajectory.segments.iter();
        let mut drawing = Self {
            columns: system.map_or(0, |system| system.lcs.outputs.names.len()),
            pieces: Vec::new(),
            values: Vec::new(),
            rates: Vec::new(),
            seconds: segments.map(|segment| segment.to - segment.from).collect(),
        };
        let most = sight.most / (drawing.columns * VALUES).max(1);
        for (k, segment) in trajectory.segments.iter().enumerate() {
            if segment.to <= sight.from {
                continue;
            }
            let (at, mut w) = (lines.starts[k].0, lines.starts[k].1.clone());
            let (seconds, motion) = (drawing.seconds[k], &mut motions[at]);
            let whole = (0.0, seconds);
            let parts: Vec<Part> = parts(&motion.linear.spectrum, sight.unit, whole)
                .take(most + 1)
                .collect();
            if drawing.pieces.len() + parts.len() > most {
                return Ok(None);
            }
            for parts in parts.chunk_by(|a, b| a.level == b.level) {
                let mut starts = DMatrix::zeros(w.len(), parts.len());
                for (mut start, part) in starts.column_iter_mut().zip(parts) {
                    start.copy_from(&w);
                    w = motion.after(part.level, &w)?;
                    drawing.pieces.push(Piece {
                        segment: k,
                        age: part.age,
                        begin: segment.from + part.age,
                        level: part.level,
                        length: part.length,
                        until: ((seconds - part.age) / part.length).min(1.0),
                    });
                }
                let [values, rates] = motion.seen(parts[0].level)?;
                let seen = [(&mut drawing.values, values), (&mut drawing.rates, rates)];
                for (all, rows) in seen {
                    all.extend((rows * &starts).as_slice().as_chunks().0);
                }
            }
        }
        Ok(Some(drawing))
    }

    /// As measurements see them.
    pub(crate) fn curves(&self) -> Curves {
        let mut curves = Curves::of(self.columns);
        let values = self.values.chunks_exact(self.columns.max(1));
        for (piece, values) in self.pieces.iter().zip(values) {
            curves.push((piece.begin, piece.length, piece.until), values);
        }
        curves
    }

    /// What derivatives to the pieces are ones to: their ends move with the events, and what is between with its age.
    pub(crate) fn weighted(&self, weights: &Weights) -> Weighted {
        let mut nodes = vec![[0.0; VALUES]; self.values.len()];
        let mut shifts = vec![0.0; self.seconds.len() + 1];
        let all = weights.values.chunks_exact(self.columns.max(1));
        for (k, own) in all.enumerate() {
            if own.as_flattened().iter().all(|weight| *weight == 0.0) {
                continue;
            }
            let piece = &self.pieces[k];
            let rows = k * self.columns..(k + 1) * self.columns;
            let (mut begin, mut length) = (0.0, 0.0);
            for ((own, nodes), rates) in own
                .iter()
                .zip(&mut nodes[rows.clone()])
                .zip(&self.rates[rows])
            {
                for (j, ((own, node), rate)) in own.iter().zip(nodes).zip(rates).enumerate() {
                    *node += own;
                    begin += own * rate;
                    length += own * rate * j as f64 / INTERVALS as f64;
                }
            }
            self.add_shifts(piece, (begin, length), &mut shifts);
        }
        let ends = weights.begins.iter().zip(&weights.lengths);
        for (piece, (begin, length)) in self.pieces.iter().zip(ends) {
            self.add_shifts(piece, (*begin, *length), &mut shifts);
        }
        Weighted { nodes, shifts }
    }

    /// Where a piece begins moves by δt₀ + strain · age, and it is longer by strain · length, with the strain (δt₁ − δt₀)/seconds of its segment.
    fn add_shifts(&self, piece: &Piece, (begin, length): (f64, f64), shifts: &mut [f64]) {
        let strain = (begin * piece.age + length * piece.length) / self.seconds[piece.segment];
        shifts[piece.segment] += begin - strain;
        shifts[piece.segment + 1] += strain;
    }
}
