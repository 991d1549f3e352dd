//! A waveform: straight lines between rows, or smooth pieces one after the other.

use std::borrow::Cow;

use super::curve::Curve;
use super::pieces::Pieces;
use super::{Edge, MeasureError, Over, Which};
use crate::settings::tolerances::times::{NO_STEP, SAME_TIME};

/// A waveform.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace<'a> {
    pub(super) shape: Shape<'a>,
    /// Times, s, and areas of impulses.
    pub(super) impulses: Vec<(f64, f64)>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape<'a> {
    /// Straight lines between rows, of which two at one time are an edge.
    Lines {
        time: &'a [f64],
        values: Cow<'a, [f64]>,
    },
    /// Pieces in the order of time; an edge is where one does not begin at the value at which the one before ends.
    Curves(Pieces),
}

/// A part of a waveform.
#[derive(Debug, Clone, Copy)]
pub(super) enum Piece {
    Line(Line),
    /// From s to s.
    Curve(Curve, (f64, f64)),
}

/// One straight piece, (t0, y0) to (t1, y1) with t0 ≤ t1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    pub(super) t0: f64,
    pub(super) y0: f64,
    pub(super) t1: f64,
    pub(super) y1: f64,
}

impl Line {
    fn at(&self, t: f64) -> f64 {
        if t >= self.t1 {
            self.y1
        } else {
            self.y0 + (self.y1 - self.y0) * ((t - self.t0) / (self.t1 - self.t0))
        }
    }

    fn clipped(&self, from: f64, to: f64) -> Option<Self> {
        let (t0, t1) = (self.t0.max(from), self.t1.min(to));
        (t0 <= t1).then(|| Self {
            t0,
            y0: if t0 == self.t0 { self.y0 } else { self.at(t0) },
            t1,
            y1: if t1 == self.t1 { self.y1 } else { self.at(t1) },
        })
    }
}

/// When a monotone part meets a level, s.
type Meets<'a> = &'a dyn Fn(f64) -> f64;

impl Piece {
    /// s.
    pub(super) fn length(&self) -> f64 {
        match self {
            Self::Line(line) => line.t1 - line.t0,
            Self::Curve(curve, (low, high)) => curve.length * (high - low),
        }
    }

    /// From when to when, s.
    pub(super) fn span(&self) -> (f64, f64) {
        match self {
            Self::Line(line) => (line.t0, line.t1),
            Self::Curve(curve, (low, high)) => (curve.time(*low), curve.time(*high)),
        }
    }

    /// ∫ y dt.
    fn integral(&self) -> f64 {
        match self {
            Self::Line(line) => self.length() * 0.5 * (line.y0 + line.y1),
            Self::Curve(curve, part) => curve.length * curve.integral(*part),
        }
    }

    /// ∫ y² dt.
    fn square(&self) -> f64 {
        match self {
            Self::Line(Line { y0, y1, .. }) => self.length() * (y0 * y0 + y0 * y1 + y1 * y1) / 3.0,
            Self::Curve(curve, part) => curve.length * curve.gauss(*part, |y, _| y * y),
        }
    }

    /// Visits times and values of it, between which it is monotone.
    fn corners(&self, mut see: impl FnMut(f64, f64)) {
        match self {
            Self::Line(line) => {
                see(line.t0, line.y0);
                see(line.t1, line.y1);
            }
            Self::Curve(curve, part) => curve.corners(*part, |s, y| see(curve.time(s), y)),
        }
    }

    /// Visits its monotone parts, each of which may tell when it meets a level.
    fn sections(&self, see: &mut dyn FnMut(Line, Meets<'_>)) {
        match self {
            Self::Line(line) => see(*line, &|level| {
                let (a, b) = (line.y0 - level, line.y1 - level);
                line.t0 + (line.t1 - line.t0) * (a / (a - b))
            }),
            Self::Curve(curve, part) => {
                let mut before: Option<(f64, f64)> = None;
                curve.corners(*part, |s, y| {
                    if let Some((s0, y0)) = before {
                        let line = Line {
                            t0: curve.time(s0),
                            y0,
                            t1: curve.time(s),
                            y1: y,
                        };
                        see(line, &|level| {
                            curve.time(curve.meets(level, (s0, y0 - level), s))
                        });
                    }
                    before = Some((s, y));
                });
            }
        }
    }
}

impl<'a> Trace<'a> {
    /// Straight lines between rows: times in s, nondecreasing, and as many values. Two rows at one time are an edge.
    #[must_use]
    pub fn lines(time: &'a [f64], values: impl Into<Cow<'a, [f64]>>) -> Self {
        let values = values.into();
        Self {
            shape: Shape::Lines { time, values },
            impulses: vec![],
        }
    }

    /// Smooth pieces in the order of time, and impulses: their times, s, and areas.
    #[must_use]
    pub fn curves(curves: Vec<Curve>, impulses: Vec<(f64, f64)>) -> Self {
        Self {
            shape: Shape::Curves(Pieces::once(curves)),
            impulses,
        }
    }

    /// The same of pieces that may repeat.
    pub(super) const fn pieced(pieces: Pieces, impulses: Vec<(f64, f64)>) -> Self {
        Self {
            shape: Shape::Curves(pieces),
            impulses,
        }
    }

    /// Where it begins and ends, s.
    pub(super) fn span(&self) -> Option<(f64, f64)> {
        match &self.shape {
            Shape::Lines { time, .. } => Some((*time.first()?, *time.last()?)),
            Shape::Curves(pieces) => pieces.span(),
        }
    }

    /// Its value where that is the same at all times.
    pub(super) fn constant(&self) -> Option<f64> {
        let same = |value: f64, first: Option<f64>| Some(value) == first;
        match &self.shape {
            Shape::Lines { values, .. } => {
                let first = values.first().copied();
                first.filter(|_| values.iter().all(|value| same(*value, first)))
            }
            Shape::Curves(pieces) => {
                let first = pieces.values().next();
                first.filter(|_| pieces.values().all(|value| same(value, first)))
            }
        }
    }

    /// Visits the pieces of from ≤ t ≤ to, those at its ends cut.
    pub(super) fn pieces(&self, (from, to): (f64, f64), mut see: impl FnMut(Piece)) {
        match &self.shape {
            Shape::Lines { time, values } => {
                let first = time.partition_point(|t| *t < from).saturating_sub(1);
                let after = time.partition_point(|t| *t <= to) + 1;
                let inside = first..after.min(time.len()).max(first);
                let pairs = time[inside.clone()].windows(2);
                for (t, y) in pairs.zip(values[inside].windows(2)) {
                    let line = Line {
                        t0: t[0],
                        y0: y[0],
                        t1: t[1],
                        y1: y[1],
                    };
                    line.clipped(from, to)
                        .into_iter()
                        .for_each(|l| see(Piece::Line(l)));
                }
            }
            Shape::Curves(pieces) => {
                let mut before: Option<f64> = None;
                for (_, curve, part) in pieces.parts((from, to)) {
                    let (t, begins) = (curve.time(part.0), curve.at(part.0));
                    if let Some(ends) = before.filter(|ends| *ends != begins) {
                        see(Piece::Line(Line {
                            t0: t,
                            y0: ends,
                            t1: t,
                            y1: begins,
                        }));
                    }
                    see(Piece::Curve(curve, part));
                    before = Some(curve.at(part.1));
                }
            }
        }
    }

    /// The same without edges, which have no length and no values but those beside them, and without laps that are as one that is seen: how many there are of each.
    fn without_edges(&self, window: (f64, f64), mut see: impl FnMut(Piece, f64)) {
        match &self.shape {
            Shape::Lines { .. } => self.pieces(window, |piece| see(piece, 1.0)),
            Shape::Curves(pieces) => pieces
                .counted(window)
                .for_each(|(_, curve, part, count)| see(Piece::Curve(curve, part), count)),
        }
    }

    /// A measure over from ≤ t ≤ to; an impulse at `from` counts in the window before.
    ///
    /// # Errors
    /// [`MeasureError::Window`] where the run has no piece of positive length there.
    pub fn over(&self, what: Over, from: f64, to: f64) -> Result<f64, MeasureError> {
        let sum = |f: &dyn Fn(&Piece) -> f64| {
            let mut sum = 0.0;
            self.without_edges((from, to), |piece, count| sum += count * f(&piece));
            sum
        };
        let length = sum(&|piece| piece.length());
        if length.is_nan() || length <= 0.0 {
            return Err(self.outside(from, to));
        }
        let begin = self.span().map_or(from, |span| span.0);
        let integral = || {
            // Of two windows that meet at an impulse it belongs to the first; that at the begin of all has none before.
            let inside = (self.impulses.iter())
                .filter(|(t, _)| *t <= to && (*t > from || *t >= from && from <= begin));
            sum(&|piece| piece.integral()) + inside.map(|(_, area)| area).sum::<f64>()
        };
        // When and how much.
        let extremes = || {
            let (mut least, mut most) = ((f64::NAN, f64::INFINITY), (f64::NAN, f64::NEG_INFINITY));
            self.without_edges((from, to), |piece, _| {
                piece.corners(|t, y| {
                    if y < least.1 {
                        least = (t, y);
                    }
                    if y > most.1 {
                        most = (t, y);
                    }
                });
            });
            (least, most)
        };
        Ok(match what {
            Over::Average => integral() / length,
            Over::Integral => integral(),
            Over::Rms => (sum(&|piece| piece.square()) / length).sqrt(),
            Over::Minimum => extremes().0.1,
            Over::Maximum => extremes().1.1,
            Over::PeakToPeak => {
                let (least, most) = extremes();
                most.1 - least.1
            }
            Over::WhenMinimum => extremes().0.0,
            Over::WhenMaximum => extremes().1.0,
        })
    }

    /// The fault that a window holds no piece of the waveform.
    fn outside(&self, from: f64, to: f64) -> MeasureError {
        let span = self.span().unwrap_or((f64::NAN, f64::NAN));
        MeasureError::Window { from, to, span }
    }

    /// The value at `t`; at an edge the value after it.
    ///
    /// # Errors
    /// [`MeasureError::Window`] outside the run.
    pub fn at(&self, t: f64) -> Result<f64, MeasureError> {
        let missing = self.outside(t, t);
        match &self.shape {
            Shape::Lines { time, values } => {
                let after = time.partition_point(|&own| own <= t);
                let k = after.checked_sub(1).ok_or_else(|| missing.clone())?;
                match (time.get(after), values.get(after)) {
                    (Some(&t1), Some(&y1)) => Ok(Line {
                        t0: time[k],
                        y0: values[k],
                        t1,
                        y1,
                    }
                    .at(t)),
                    _ if time[k] == t => Ok(values[k]),
                    _ => Err(missing),
                }
            }
            Shape::Curves(_) => {
                let curve = self.curve_at(t).ok_or(missing)?;
                Ok(curve.at(curve.place(t)))
            }
        }
    }

    /// The last piece that has begun by `t`.
    fn curve_at(&self, t: f64) -> Option<Curve> {
        let Shape::Curves(pieces) = &self.shape else {
            return None;
        };
        let near = SAME_TIME * t.abs();
        let (_, curve) = pieces.begun_by(t + near)?;
        (t <= curve.end() + near).then_some(curve)
    }

    /// The slope at `t`, of the piece to its right, at the end of the run to its left.
    ///
    /// # Errors
    /// [`MeasureError::Window`] outside the run.
    pub fn slope(&self, t: f64) -> Result<f64, MeasureError> {
        let missing = self.outside(t, t);
        if let Shape::Curves(_) = &self.shape {
            let curve = self.curve_at(t).ok_or(missing)?;
            return Ok(curve.slope(curve.place(t)));
        }
        let mut slope = None;
        self.pieces((f64::NEG_INFINITY, f64::INFINITY), |piece| {
            if let Piece::Line(l) = piece
                && l.t0 <= t
                && t <= l.t1
                && l.t0 < l.t1
            {
                slope = Some((l.y1 - l.y0) / (l.t1 - l.t0));
            }
        });
        slope.ok_or(missing)
    }

    /// When the waveform crosses a level within a window: the time at which it leaves the level or passes through it.
    ///
    /// # Errors
    /// [`MeasureError::NoCrossing`] where there are fewer crossings.
    pub fn crossing(
        &self,
        level: f64,
        edge: Edge,
        which: Which,
        within: (f64, f64),
    ) -> Result<f64, MeasureError> {
        let mut found = Vec::new();
        // The side of the level the waveform came from, kept while it runs along it.
        let mut side = 0.0;
        let largest = match &self.shape {
            Shape::Lines { values, .. } => values.iter().fold(level.abs(), |m, v| m.max(v.abs())),
            Shape::Curves(pieces) => pieces.values().fold(level.abs(), |m, v| m.max(v.abs())),
        };
        self.pieces(within, |piece| {
            piece.sections(&mut |line, meets| {
                // The two rows of one event, which may stand on either side of its level by rounding, are no jump.
                let at_once = line.t1 - line.t0 <= SAME_TIME * line.t1.abs();
                if at_once && (line.y1 - line.y0).abs() <= NO_STEP * largest {
                    return;
                }
                let (a, b) = (line.y0 - level, line.y1 - level);
                if side == 0.0 && a != 0.0 {
                    side = a.signum();
                }
                if b != 0.0 && side != 0.0 && b.signum() != side {
                    // What came here by such a row is there already.
                    let passes = a != 0.0 && a.signum() == side;
                    let t = if passes { meets(level) } else { line.t0 };
                    let counts = match edge {
                        Edge::Rise => side < 0.0,
                        Edge::Fall => side > 0.0,
                        Edge::Cross => true,
                    };
                    if counts {
                        found.push(t);
                    }
                }
                if b != 0.0 {
                    side = b.signum();
                }
            });
        });
        let wanted = match which {
            Which::Number(n) => n.checked_sub(1).and_then(|k| found.get(k)),
            Which::Last => found.last(),
        };
        wanted.copied().ok_or(MeasureError::NoCrossing {
            level,
            found: found.len(),
        })
    }
}
