//! Independent sources as functions of time, with the exact closed form of every piece.
//!
//! Waveforms are right-continuous: [`Source::value`] at an edge is the value after it, [`Source::value_left`] the one
//! before. Breakpoints are computed as delay + k·period + corner, never accumulated, by one function that the values, the
//! pieces and [`Source::next_breakpoint`] share, so that they agree to the last bit.

mod crossings;
mod piece;
mod polyline;
mod repeating;
mod spice;

pub use crossings::{Crossing, Rest, crossings};
pub(crate) use crossings::{first_crossing, side_after};
pub use piece::{Oscillation, Piece};
pub(crate) use piece::{Straight, decayed};
pub use spice::{Form, WaveError};

use piece::Segment;
use polyline::Polyline;

/// A source: its value for the operating point and its waveform for a transient.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// `DC` value, V or A, used by `.op`.
    pub dc: f64,
    /// The waveform.
    pub wave: Wave,
}

/// Waveforms with SPICE's parameters, defaults already filled in. Times in s, frequencies in Hz, phases in degrees.
#[derive(Debug, Clone, PartialEq)]
pub enum Wave {
    /// A constant.
    Dc(f64),
    /// offset + amplitude·e^{−damping (t−delay)}·sin(2π frequency (t−delay) + phase) for t ≥ delay, before it and after its
    /// cycles the value at the phase alone.
    Sin {
        /// Offset.
        offset: f64,
        /// Amplitude.
        amplitude: f64,
        /// Frequency, Hz.
        frequency: f64,
        /// Delay, s.
        delay: f64,
        /// Damping, 1/s.
        damping: f64,
        /// Phase, degrees.
        phase: f64,
        /// Number of cycles; `None` is without end.
        cycles: Option<f64>,
    },
    /// Trapezoids; a zero `rise` or `fall` is a true edge. A pulse longer than its period is cut by the next one.
    Pulse {
        /// Initial value.
        v1: f64,
        /// Pulsed value.
        v2: f64,
        /// Delay, s.
        delay: f64,
        /// Rise time, s.
        rise: f64,
        /// Fall time, s.
        fall: f64,
        /// Pulse width, s.
        width: f64,
        /// Period, s; 0: it comes once.
        period: f64,
        /// Number of periods; `None` is without end.
        count: Option<f64>,
    },
    /// Straight lines between points (time, value); two points at one time are an edge.
    Pwl {
        /// The points, times nondecreasing.
        points: Vec<(f64, f64)>,
        /// Repeat from this time on.
        repeat: Option<f64>,
        /// Shift of all times, s.
        delay: f64,
    },
    /// Two exponentials.
    Exp {
        /// Initial value.
        v1: f64,
        /// Pulsed value.
        v2: f64,
        /// Rise delay, s.
        rise_delay: f64,
        /// Rise time constant, s.
        rise_tau: f64,
        /// Fall delay, s.
        fall_delay: f64,
        /// Fall time constant, s.
        fall_tau: f64,
    },
    /// Frequency modulation, offset + amplitude·sin(2π carrier t + carrier_phase + index·sin(2π signal t + signal_phase)).
    Sffm {
        /// Offset.
        offset: f64,
        /// Amplitude.
        amplitude: f64,
        /// Carrier frequency, Hz.
        carrier: f64,
        /// Modulation index.
        index: f64,
        /// Signal frequency, Hz.
        signal: f64,
        /// Phase of the carrier, degrees.
        carrier_phase: f64,
        /// Phase of the signal, degrees.
        signal_phase: f64,
    },
    /// Amplitude modulation, amplitude·(offset + sin(2π modulation s))·sin(2π carrier s) with s = t − delay ≥ 0, before it 0.
    Am {
        /// Amplitude.
        amplitude: f64,
        /// Offset of the modulation.
        offset: f64,
        /// Modulating frequency, Hz.
        modulation: f64,
        /// Carrier frequency, Hz.
        carrier: f64,
        /// Delay, s.
        delay: f64,
    },
    /// The wave that arrives at a port of a transmission line: what left the other port `delay` before, which only the run
    /// knows; `initial` before anything has arrived.
    Arriving {
        /// Delay of the line, s.
        delay: f64,
        /// Initial value.
        initial: f64,
    },
}

impl Source {
    /// A constant source.
    #[must_use]
    pub const fn constant(value: f64) -> Self {
        Self {
            dc: value,
            wave: Wave::Dc(value),
        }
    }

    /// A source with a `DC` value; without one it has the value before t = 0 in operating points, as where a transient starts.
    #[must_use]
    pub fn new(dc: Option<f64>, wave: Wave) -> Self {
        Self {
            dc: dc.unwrap_or_else(|| wave.value_left(0.0)),
            wave,
        }
    }

    /// Adds a constant; whether the waveform has a parameter for that.
    pub(crate) fn raise(&mut self, by: f64) -> bool {
        self.dc += by;
        match &mut self.wave {
            Wave::Dc(value) => *value += by,
            Wave::Sin { offset, .. } | Wave::Sffm { offset, .. } => *offset += by,
            Wave::Pulse { v1, v2, .. } | Wave::Exp { v1, v2, .. } => {
                *v1 += by;
                *v2 += by;
            }
            Wave::Pwl { points, .. } => points.iter_mut().for_each(|(_, value)| *value += by),
            Wave::Am { .. } | Wave::Arriving { .. } => return false,
        }
        true
    }

    /// The value at `t`, V or A; at an edge the value after it. See [`Wave::value`].
    #[must_use]
    pub fn value(&self, t: f64) -> f64 {
        self.wave.value(t)
    }

    /// The limit from the left at `t`.
    #[must_use]
    pub fn value_left(&self, t: f64) -> f64 {
        self.wave.value_left(t)
    }

    /// The derivative to the right of `t`, V/s or A/s.
    #[must_use]
    pub fn derivative(&self, t: f64) -> f64 {
        self.wave.derivative(t)
    }

    /// The first breakpoint strictly after `after`. See [`Wave::next_breakpoint`].
    #[must_use]
    pub fn next_breakpoint(&self, after: f64) -> Option<f64> {
        self.wave.next_breakpoint(after)
    }

    /// Whether the value jumps at `t`. See [`Wave::is_edge`].
    #[must_use]
    pub fn is_edge(&self, t: f64) -> bool {
        self.wave.is_edge(t)
    }

    /// The closed form from `t` to the next breakpoint. See [`Wave::piece`].
    #[must_use]
    pub fn piece(&self, t: f64) -> Option<Piece> {
        self.wave.piece(t)
    }
}

impl Wave {
    /// The value at `t`; at an edge the value after it.
    #[must_use]
    pub fn value(&self, t: f64) -> f64 {
        self.tone().map_or_else(
            || self.segment(t, Side::Right).piece.value(t),
            |tone| tone.value(t),
        )
    }

    /// The limit from the left at `t`; the same as [`Wave::value`], to the last bit, where there is no edge.
    #[must_use]
    pub fn value_left(&self, t: f64) -> f64 {
        match self.edge(t) {
            Some((before, _)) => before,
            None => self.value(t),
        }
    }

    /// The derivative to the right of `t`.
    #[must_use]
    pub fn derivative(&self, t: f64) -> f64 {
        self.tone().map_or_else(
            || self.segment(t, Side::Right).piece.derivative(t),
            |tone| tone.derivative(t),
        )
    }

    /// The first time strictly after `after` where the value or its slope changes abruptly; `None` if there is none.
    #[must_use]
    pub fn next_breakpoint(&self, after: f64) -> Option<f64> {
        Some(self.segment(after, Side::Right).piece.end).filter(|end| end.is_finite())
    }

    /// About how many breakpoints lie in [0, `until`].
    #[must_use]
    pub fn corners(&self, until: f64) -> f64 {
        let laps = |delay: f64, period: f64, count: f64| {
            if period > 0.0 {
                ((until - delay).max(0.0) / period).min(count)
            } else {
                1.0
            }
        };
        match self {
            Self::Pulse {
                delay,
                rise,
                fall,
                period,
                count,
                ..
            } => {
                let kinks = if *rise == 0.0 && *fall == 0.0 {
                    2.0
                } else {
                    4.0
                };
                kinks * laps(*delay, *period, count.unwrap_or(f64::INFINITY))
            }
            Self::Pwl {
                points,
                repeat: Some(from),
                delay,
            } => {
                let period = points.last().map_or(0.0, |last| last.0 - from);
                points.len() as f64 * laps(*delay, period, f64::INFINITY)
            }
            Self::Pwl { points, .. } => points.len() as f64,
            _ => 2.0,
        }
    }

    /// Whether the value jumps at `t`. Decided on the waveform's parameters, not on rounded values.
    #[must_use]
    pub fn is_edge(&self, t: f64) -> bool {
        self.edge(t).is_some()
    }

    /// The closed form on [start, end) around `t`, where start and end are breakpoints (or ∓∞). It is the same object for
    /// every `t` of the interval. `None` for frequency modulation and waves on lines, which no finite linear system generates.
    #[must_use]
    pub fn piece(&self, t: f64) -> Option<Piece> {
        match self {
            Self::Sffm { .. } | Self::Arriving { .. } => None,
            _ => Some(self.segment(t, Side::Right).piece),
        }
    }

    /// The shortest period in which it repeats, s; of a modulated wave that of its highest frequency. `None` if it does not repeat.
    #[must_use]
    pub fn period(&self) -> Option<f64> {
        let of = |frequency: f64| (frequency > 0.0).then(|| 1.0 / frequency);
        match *self {
            Self::Sin {
                amplitude,
                frequency,
                ..
            } => of(frequency).filter(|_| amplitude != 0.0),
            Self::Pulse {
                v1,
                v2,
                period,
                count,
                ..
            } => {
                let repeats = v1 != v2 && count.is_none_or(|count| count > 1.0);
                Some(period).filter(|period| repeats && *period > 0.0)
            }
            Self::Pwl {
                ref points, repeat, ..
            } => {
                let (from, to) = (repeat?, points.last()?.0);
                Some(to - from).filter(|period| *period > 0.0)
            }
            Self::Sffm {
                amplitude,
                carrier,
                index,
                signal,
                ..
            } => of(carrier.abs() + (index * signal).abs()).filter(|_| amplitude != 0.0),
            Self::Am {
                amplitude,
                modulation,
                carrier,
                ..
            } => of(carrier.abs() + modulation.abs()).filter(|_| amplitude != 0.0),
            Self::Dc(_) | Self::Exp { .. } | Self::Arriving { .. } => None,
        }
    }

    /// Whether it has corners wherever it is not straight.
    #[must_use]
    pub const fn has_corners(&self) -> bool {
        matches!(self, Self::Pulse { .. } | Self::Pwl { .. })
    }

    /// Whether it is the wave that arrives on a transmission line.
    #[must_use]
    pub const fn is_arriving(&self) -> bool {
        matches!(self, Self::Arriving { .. })
    }

    /// The values (before, after) of the edge at `t`.
    fn edge(&self, t: f64) -> Option<(f64, f64)> {
        let before = self.segment(t, Side::Left);
        let after = self.segment(t, Side::Right);
        (before.piece.end <= t && before.last != after.first).then_some((before.last, after.first))
    }

    /// As [`Self::piece`], of waveforms that consist of straight lines.
    pub(crate) fn line(&self, t: f64) -> Option<Straight> {
        self.straight(t, Side::Right)
    }

    /// As [`Self::line`], `t` not before this one.
    pub(crate) fn line_after(&self, line: &Straight, t: f64) -> Option<Straight> {
        self.straight_by(|corners| corners.go_on(line, t))
    }

    fn straight(&self, t: f64, side: Side) -> Option<Straight> {
        self.straight_by(|corners| corners.straight(t, side))
    }

    /// What is to be found among the corners of a waveform of straight lines.
    #[inline]
    fn straight_by(&self, find: impl FnOnce(&Polyline<'_>) -> Straight) -> Option<Straight> {
        match *self {
            Self::Dc(value) => {
                let line = Straight::constant(value, f64::NEG_INFINITY, f64::INFINITY);
                Some(line)
            }
            Self::Pulse {
                v1,
                v2,
                delay,
                rise,
                fall,
                width,
                period,
                count,
            } => {
                let corners = polyline::pulse_corners(v1, v2, rise, fall, width, period);
                Some(find(&Polyline::pulse(&corners, delay, period, count)))
            }
            Self::Pwl {
                ref points,
                repeat,
                delay,
            } => Some(find(&Polyline::pwl(points, repeat, delay))),
            _ => None,
        }
    }

    /// The segment around `t`; at a breakpoint the one on the given side.
    fn segment(&self, t: f64, side: Side) -> Segment {
        if let Some(line) = self.straight(t, side) {
            return line.into();
        }
        match *self {
            Self::Sin {
                offset,
                amplitude,
                frequency,
                delay,
                damping,
                phase,
                cycles,
            } => {
                let oscillation = Oscillation {
                    amplitude,
                    decay: damping,
                    frequency: std::f64::consts::TAU * frequency,
                    phase: phase.to_radians(),
                };
                let start = offset + oscillation.value(0.0);
                let end = cycles.map_or(f64::INFINITY, |n| delay + n / frequency);
                if side.before(t, delay) {
                    Segment::constant(start, f64::NEG_INFINITY, delay)
                } else if side.before(t, end) {
                    let piece = Piece::with_terms(delay, end, offset, [oscillation]);
                    // Whole cycles end where they began, to the last bit.
                    let last = match cycles {
                        None => f64::NAN,
                        Some(n) if damping == 0.0 && n.fract() == 0.0 => start,
                        Some(_) => piece.value(end),
                    };
                    Segment {
                        piece,
                        first: start,
                        last,
                    }
                } else {
                    Segment::constant(start, end, f64::INFINITY)
                }
            }
            Self::Exp {
                v1,
                v2,
                rise_delay,
                rise_tau,
                fall_delay,
                fall_tau,
            } => piece::exponentials(
                (v1, v2),
                (rise_delay, rise_tau),
                (fall_delay, fall_tau),
                t,
                side,
            ),
            Self::Arriving { initial, .. } => {
                Segment::constant(initial, f64::NEG_INFINITY, f64::INFINITY)
            }
            Self::Am {
                amplitude,
                offset,
                modulation,
                carrier,
                delay,
            } => {
                if side.before(t, delay) {
                    Segment::constant(0.0, f64::NEG_INFINITY, delay)
                } else {
                    let piece =
                        piece::amplitude_modulation(amplitude, offset, modulation, carrier, delay);
                    Segment {
                        piece,
                        first: 0.0,
                        last: f64::NAN,
                    }
                }
            }
            // A tone has no closed form, and lines are done.
            Self::Sffm { .. } | Self::Dc(_) | Self::Pulse { .. } | Self::Pwl { .. } => {
                Segment::constant(f64::NAN, f64::NEG_INFINITY, f64::INFINITY)
            }
        }
    }

    /// The frequency-modulated tone, if it is one.
    fn tone(&self) -> Option<piece::Tone> {
        match *self {
            Self::Sffm {
                offset,
                amplitude,
                carrier,
                index,
                signal,
                carrier_phase,
                signal_phase,
            } => Some(piece::Tone {
                offset,
                amplitude,
                carrier: (std::f64::consts::TAU * carrier, carrier_phase.to_radians()),
                index,
                signal: (std::f64::consts::TAU * signal, signal_phase.to_radians()),
            }),
            _ => None,
        }
    }
}

/// Which one-sided limit is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Left,
    Right,
}

impl Side {
    /// Whether `t`, approached from this side, lies before the breakpoint `at`.
    fn before(self, t: f64, at: f64) -> bool {
        match self {
            Self::Left => t <= at,
            Self::Right => t < at,
        }
    }
}

#[cfg(test)]
mod tests;
