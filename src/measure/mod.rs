//! Measurements on waveforms, as `.meas tran` and `.four` define them.
//!
//! Between two rows a waveform is the straight line through them, and every measure is exact for that line; two rows at
//! one time are an edge.

mod fourier;
mod measurement;

use thiserror::Error;

use crate::settings::tolerances::times::{NO_STEP, SAME_TIME};

pub use fourier::{Harmonic, Spectrum, fourier};
pub use measurement::{Found, Instant, Measurement, Scene, Use, Window};

/// Why a measurement has no value.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MeasureError {
    /// The window from … to … holds no piece of the waveform.
    #[error("no part of the run lies between {from} s and {to} s")]
    Window {
        /// Its start, s.
        from: f64,
        /// Its end, s.
        to: f64,
    },
    /// The crossing asked for does not happen.
    #[error("{}", crossings(*.level, *.found))]
    NoCrossing {
        /// The level.
        level: f64,
        /// Crossings that there are.
        found: usize,
    },
    /// The number of a crossing is no whole number from 1 on.
    #[error("there is no crossing number {0}")]
    Count(f64),
    /// The value is not a finite number.
    #[error("the value is not a finite number")]
    NotFinite,
    /// Another measurement that this one needs has no value.
    #[error("`{0}` has no value")]
    Needs(String),
    /// It refers to what the circuit does not have.
    #[error("it refers to what the circuit does not have")]
    Unread,
    /// The measurement needs its own result.
    #[error("its own result is needed first")]
    Circular,
}

fn crossings(level: f64, found: usize) -> String {
    match found {
        0 => format!("the value {level} is not crossed"),
        1 => format!("the value {level} is crossed once only"),
        _ => format!("the value {level} is crossed {found} times only"),
    }
}

/// What is computed over a window of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Over {
    /// (1/T) ∫ y dt.
    Average,
    /// √((1/T) ∫ y² dt).
    Rms,
    /// The least value.
    Minimum,
    /// The greatest value.
    Maximum,
    /// Greatest minus least.
    PeakToPeak,
    /// ∫ y dt.
    Integral,
    /// When the least value is reached first.
    WhenMinimum,
    /// When the greatest value is reached first.
    WhenMaximum,
}

/// Which crossings of a level count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    /// From below.
    Rise,
    /// From above.
    Fall,
    /// Either.
    Cross,
}

/// One of the crossings, from 1, or the last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// The n-th, n ≥ 1.
    Number(usize),
    /// The last.
    Last,
}

/// A waveform: times in s, nondecreasing, and as many values.
#[derive(Debug, Clone, Copy)]
pub struct Trace<'a> {
    /// Times, s.
    pub time: &'a [f64],
    /// Values.
    pub values: &'a [f64],
}

/// One straight piece, (t0, y0) to (t1, y1) with t0 ≤ t1.
#[derive(Debug, Clone, Copy)]
struct Line {
    t0: f64,
    y0: f64,
    t1: f64,
    y1: f64,
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

impl<'a> Trace<'a> {
    fn lines(&self) -> impl Iterator<Item = Line> + Clone + use<'a> {
        let (time, values) = (self.time, self.values);
        time.windows(2).zip(values.windows(2)).map(|(t, y)| Line {
            t0: t[0],
            y0: y[0],
            t1: t[1],
            y1: y[1],
        })
    }

    /// The pieces of from ≤ t ≤ to, those at its ends cut.
    fn lines_within(&self, from: f64, to: f64) -> impl Iterator<Item = Line> + Clone + use<'a> {
        let first = self.time.partition_point(|t| *t < from).saturating_sub(1);
        let after = self.time.partition_point(|t| *t <= to) + 1;
        let inside = first..after.min(self.time.len()).max(first);
        let part = Self {
            time: &self.time[inside.clone()],
            values: &self.values[inside],
        };
        part.lines().filter_map(move |line| line.clipped(from, to))
    }

    /// A measure over from ≤ t ≤ to.
    ///
    /// # Errors
    /// [`MeasureError::Window`] where the run has no piece of positive length there.
    pub fn over(&self, what: Over, from: f64, to: f64) -> Result<f64, MeasureError> {
        let lines = self.lines_within(from, to);
        let length: f64 = lines.clone().map(|l| l.t1 - l.t0).sum();
        if length.is_nan() || length <= 0.0 {
            return Err(MeasureError::Window { from, to });
        }
        let sum = |f: fn(&Line) -> f64| lines.clone().map(|l| (l.t1 - l.t0) * f(&l)).sum::<f64>();
        let integral = || sum(|l| 0.5 * (l.y0 + l.y1));
        let least = || {
            lines
                .clone()
                .fold(f64::INFINITY, |m, l| m.min(l.y0).min(l.y1))
        };
        let greatest = || {
            lines
                .clone()
                .fold(f64::NEG_INFINITY, |m, l| m.max(l.y0).max(l.y1))
        };
        Ok(match what {
            Over::Average => integral() / length,
            Over::Integral => integral(),
            Over::Rms => (sum(|l| (l.y0 * l.y0 + l.y0 * l.y1 + l.y1 * l.y1) / 3.0) / length).sqrt(),
            Over::Minimum => least(),
            Over::Maximum => greatest(),
            Over::PeakToPeak => greatest() - least(),
            Over::WhenMinimum => reached(lines.clone(), least()),
            Over::WhenMaximum => reached(lines.clone(), greatest()),
        })
    }

    /// The value at `t`; at an edge the value after it.
    ///
    /// # Errors
    /// [`MeasureError::Window`] outside the run.
    pub fn at(&self, t: f64) -> Result<f64, MeasureError> {
        let after = self.time.partition_point(|&own| own <= t);
        let missing = MeasureError::Window { from: t, to: t };
        let k = after.checked_sub(1).ok_or_else(|| missing.clone())?;
        match (self.time.get(after), self.values.get(after)) {
            (Some(&t1), Some(&y1)) => Ok(Line {
                t0: self.time[k],
                y0: self.values[k],
                t1,
                y1,
            }
            .at(t)),
            _ if self.time[k] == t => Ok(self.values[k]),
            _ => Err(missing),
        }
    }

    /// The slope at `t`, of the piece to its right, at the end of the run to its left.
    ///
    /// # Errors
    /// [`MeasureError::Window`] outside the run.
    pub fn slope(&self, t: f64) -> Result<f64, MeasureError> {
        self.lines()
            .filter(|l| l.t0 <= t && t <= l.t1 && l.t0 < l.t1)
            .last()
            .map(|l| (l.y1 - l.y0) / (l.t1 - l.t0))
            .ok_or(MeasureError::Window { from: t, to: t })
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
        let largest = self.values.iter().fold(level.abs(), |m, v| m.max(v.abs()));
        for line in self.lines_within(within.0, within.1) {
            // The two rows of one event, which may stand on either side of its level by rounding, are no jump.
            let at_once = line.t1 - line.t0 <= SAME_TIME * line.t1.abs();
            if at_once && (line.y1 - line.y0).abs() <= NO_STEP * largest {
                continue;
            }
            let (a, b) = (line.y0 - level, line.y1 - level);
            if side == 0.0 && a != 0.0 {
                side = a.signum();
            }
            if b != 0.0 && side != 0.0 && b.signum() != side {
                let t = if a == 0.0 {
                    line.t0
                } else {
                    line.t0 + (line.t1 - line.t0) * (a / (a - b))
                };
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
        }
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

/// The first end of a piece that has this value.
fn reached(lines: impl Iterator<Item = Line>, value: f64) -> f64 {
    let mut ends = lines.flat_map(|l| [(l.t0, l.y0), (l.t1, l.y1)]);
    ends.find(|&(_, y)| y == value).map_or(f64::NAN, |(t, _)| t)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0 → 2 in 1 s, an edge to −1, constant for 1 s, up to 0 in 1 s.
    const TIME: [f64; 5] = [0.0, 1.0, 1.0, 2.0, 3.0];
    const VALUES: [f64; 5] = [0.0, 2.0, -1.0, -1.0, 0.0];

    fn trace() -> Trace<'static> {
        Trace {
            time: &TIME,
            values: &VALUES,
        }
    }

    const ALL: (f64, f64) = (0.0, f64::INFINITY);

    #[test]
    fn windows() {
        let over = |what, from, to| trace().over(what, from, to).unwrap();
        assert_eq!(over(Over::Integral, 0.0, 3.0), 1.0 - 1.0 - 0.5);
        assert_eq!(over(Over::Average, 0.0, 1.0), 1.0);
        assert_eq!(over(Over::Average, 0.5, 1.5), 0.25);
        // ∫ (2t)² = 4/3 over 1 s.
        assert!((over(Over::Rms, 0.0, 1.0) - (4.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert_eq!(over(Over::Maximum, 0.0, 0.5), 1.0);
        assert_eq!(over(Over::Minimum, 2.5, 3.0), -0.5);
        assert_eq!(over(Over::PeakToPeak, 0.0, 3.0), 3.0);
        assert_eq!(over(Over::WhenMaximum, 0.0, 3.0), 1.0);
        assert_eq!(over(Over::WhenMinimum, 1.5, 3.0), 1.5);
        let fault = trace().over(Over::Average, 4.0, 5.0);
        assert_eq!(fault, Err(MeasureError::Window { from: 4.0, to: 5.0 }));
    }

    #[test]
    fn rms_of_a_ramp() {
        let ramp = Trace {
            time: &[0.0, 1.0],
            values: &[0.0, 3.0],
        };
        assert!((ramp.over(Over::Rms, 0.0, 1.0).unwrap() - 3.0_f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn values_and_slopes() {
        assert_eq!(trace().at(0.25), Ok(0.5));
        assert_eq!(trace().at(1.0), Ok(-1.0));
        assert_eq!(trace().at(3.0), Ok(0.0));
        assert!(trace().at(3.5).is_err() && trace().at(-1.0).is_err());
        assert_eq!(trace().slope(0.5), Ok(2.0));
        assert_eq!(trace().slope(1.0), Ok(0.0));
        assert_eq!(trace().slope(3.0), Ok(1.0));
    }

    #[test]
    fn crossings() {
        let when = |level, edge, which| trace().crossing(level, edge, which, ALL);
        assert_eq!(when(1.0, Edge::Rise, Which::Number(1)), Ok(0.5));
        assert_eq!(when(1.0, Edge::Fall, Which::Number(1)), Ok(1.0));
        assert_eq!(when(-0.5, Edge::Cross, Which::Last), Ok(2.5));
        let early = trace().crossing(-0.5, Edge::Cross, Which::Last, (0.0, 2.0));
        assert_eq!(early, Ok(1.0));
        let none = MeasureError::NoCrossing {
            level: 1.0,
            found: 1,
        };
        assert_eq!(when(1.0, Edge::Rise, Which::Number(2)), Err(none));
        // The two rows of an event on its level, by rounding on either side of it.
        let event = Trace {
            time: &[0.0, 1.0, 1.0, 2.0, 3.0, 3.0, 4.0],
            values: &[
                0.0,
                5.0 + 4e-12,
                5.0 - 7e-12,
                7.0,
                5.0 - 4e-12,
                5.0 + 7e-12,
                0.0,
            ],
        };
        let when = |edge, n| event.crossing(5.0, edge, Which::Number(n), ALL);
        assert!((when(Edge::Rise, 1).unwrap() - 1.0).abs() < 1e-9);
        assert!((when(Edge::Fall, 1).unwrap() - 3.0).abs() < 1e-9);
        assert!(when(Edge::Rise, 2).is_err() && when(Edge::Cross, 3).is_err());
        // Touching is no crossing; passing along the level is one.
        let touch = Trace {
            time: &[0.0, 1.0, 2.0, 3.0, 4.0],
            values: &[1.0, 0.0, 1.0, 0.0, -1.0],
        };
        assert_eq!(
            touch.crossing(0.0, Edge::Fall, Which::Number(1), ALL),
            Ok(3.0)
        );
        assert!(
            touch
                .crossing(0.0, Edge::Rise, Which::Number(1), ALL)
                .is_err()
        );
    }
}
