//! Measurements on waveforms, as `.meas tran` and `.four` define them.
//!
//! Of a run in steps a waveform is the straight line from each row to the next, and two rows at one time are an edge. Of an exact run it is what happens
//! between events, as polynomials that follow it closely. Every measure is exact for these lines and polynomials.

mod curve;
mod expression;
mod fourier;
mod measurement;
mod pieces;
mod signals;
mod slopes;
mod trace;

use thiserror::Error;

pub use curve::Curve;
pub(crate) use curve::{INTERVALS, VALUES, basis, interpolated};
pub use expression::Expression;
pub use fourier::{Harmonic, Spectrum, fourier};
pub use measurement::{Found, Instant, Measurement, Scene, Use, Window};
pub use signals::{Curves, Signals};
pub(crate) use slopes::{Rival, TraceSlopes};
pub use trace::Trace;

/// Why a measurement has no value.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MeasureError {
    /// The window from … to … holds no piece of the waveform.
    #[error("{}", outside(*.from, *.to, *.span))]
    Window {
        /// Its start, s.
        from: f64,
        /// Its end, s.
        to: f64,
        /// Where the waveform begins and ends, s.
        span: (f64, f64),
    },
    /// The band from … to … holds no part of the response.
    #[error("no part of the response lies between {} Hz and {} Hz", short(*.from), short(*.to))]
    Band {
        /// Its start, Hz.
        from: f64,
        /// Its end, Hz.
        to: f64,
    },
    /// The run is shorter than a period.
    #[error("a period of {} Hz takes {} s, and the run no more than {} s", short(*.frequency), short(.frequency.recip()), short(*.seconds))]
    Period {
        /// Hz.
        frequency: f64,
        /// Of the run.
        seconds: f64,
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

/// A number without the last digits, which rounding makes.
fn short(value: f64) -> f64 {
    format!("{value:.12e}").parse().unwrap_or(value)
}

/// Where nothing is seen: after the run, before its first row, or between its ends.
fn outside(from: f64, to: f64, (first, last): (f64, f64)) -> String {
    if from > last {
        format!(
            "the run ends at {} s, before {} s",
            short(last),
            short(from)
        )
    } else if to < first {
        format!(
            "the rows of the run begin at {} s, after {} s",
            short(first),
            short(to)
        )
    } else {
        format!(
            "no part of the run lies between {} s and {} s",
            short(from),
            short(to)
        )
    }
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

#[cfg(test)]
impl Over {
    pub(crate) const ALL: [Self; 8] = [
        Self::Average,
        Self::Rms,
        Self::Integral,
        Self::Minimum,
        Self::Maximum,
        Self::PeakToPeak,
        Self::WhenMinimum,
        Self::WhenMaximum,
    ];
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

#[cfg(test)]
mod tests {
    use super::*;

    /// 0 → 2 in 1 s, an edge to −1, constant for 1 s, up to 0 in 1 s.
    const TIME: [f64; 5] = [0.0, 1.0, 1.0, 2.0, 3.0];
    const VALUES: [f64; 5] = [0.0, 2.0, -1.0, -1.0, 0.0];

    fn trace() -> Trace<'static> {
        Trace::lines(&TIME, &VALUES[..])
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
        assert_eq!(
            fault,
            Err(MeasureError::Window {
                from: 4.0,
                to: 5.0,
                span: (0.0, 3.0)
            })
        );
    }

    #[test]
    fn rms_of_a_ramp() {
        let ramp = Trace::lines(&[0.0, 1.0], vec![0.0, 3.0]);
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
        let event = Trace::lines(
            &[0.0, 1.0, 1.0, 2.0, 3.0, 3.0, 4.0],
            vec![
                0.0,
                5.0 + 4e-12,
                5.0 - 7e-12,
                7.0,
                5.0 - 4e-12,
                5.0 + 7e-12,
                0.0,
            ],
        );
        let when = |edge, n| event.crossing(5.0, edge, Which::Number(n), ALL);
        assert!((when(Edge::Rise, 1).unwrap() - 1.0).abs() < 1e-9);
        assert!((when(Edge::Fall, 1).unwrap() - 3.0).abs() < 1e-9);
        assert!(when(Edge::Rise, 2).is_err() && when(Edge::Cross, 3).is_err());
        // A row that stands on the level is on the side it came from.
        let row = Trace::lines(&[0.0, 1.0, 2.0], vec![-1.0, 0.0, 1.0]);
        assert_eq!(
            row.crossing(0.0, Edge::Rise, Which::Number(1), ALL),
            Ok(1.0)
        );
        assert!(
            row.crossing(0.0, Edge::Cross, Which::Number(2), ALL)
                .is_err()
        );
        // Touching is no crossing; passing along the level is one.
        let touch = Trace::lines(&[0.0, 1.0, 2.0, 3.0, 4.0], vec![1.0, 0.0, 1.0, 0.0, -1.0]);
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
