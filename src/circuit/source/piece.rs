//! The closed form of a waveform between two breakpoints.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::Side;

/// amplitude·e^{−decay·s}·sin(frequency·s + phase), s = t − origin of the piece. A decaying exponential has frequency 0 and
/// phase π/2.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Oscillation {
    /// Amplitude, V or A.
    pub amplitude: f64,
    /// σ, 1/s; negative grows.
    pub decay: f64,
    /// ω, rad/s.
    pub frequency: f64,
    /// φ, rad.
    pub phase: f64,
}

/// e^{−σs}; of most sources σ is 0.
pub(crate) fn decayed(sigma: f64, s: f64) -> f64 {
    if sigma == 0.0 {
        1.0
    } else {
        (-sigma * s).exp()
    }
}

impl Oscillation {
    pub(super) const fn exponential(amplitude: f64, decay: f64) -> Self {
        Self {
            amplitude,
            decay,
            frequency: 0.0,
            phase: FRAC_PI_2,
        }
    }

    fn envelope(&self, s: f64) -> f64 {
        self.amplitude * decayed(self.decay, s)
    }

    /// Whether the sum with another one is one.
    pub(super) fn goes_with(&self, other: &Self) -> bool {
        (self.frequency, self.decay) == (other.frequency, other.decay)
    }

    /// The sum with one that goes with it, from the same origin.
    pub(super) fn plus(&self, other: &Self) -> Self {
        let parts = |term: &Self| {
            let (sin, cos) = term.phase.sin_cos();
            (term.amplitude * cos, term.amplitude * sin)
        };
        let ((a, b), (c, d)) = (parts(self), parts(other));
        Self {
            amplitude: (a + c).hypot(b + d),
            phase: (b + d).atan2(a + c),
            ..*self
        }
    }

    /// The value at `s` after the origin.
    #[must_use]
    pub fn value(&self, s: f64) -> f64 {
        self.envelope(s) * (self.frequency * s + self.phase).sin()
    }

    /// The derivative at `s` after the origin.
    #[must_use]
    pub fn derivative(&self, s: f64) -> f64 {
        let (sin, cos) = (self.frequency * s + self.phase).sin_cos();
        self.envelope(s) * (self.frequency * cos - self.decay * sin)
    }

    /// The second derivative at `s` after the origin.
    #[must_use]
    pub fn second_derivative(&self, s: f64) -> f64 {
        let (sin, cos) = (self.frequency * s + self.phase).sin_cos();
        let (sigma, omega) = (self.decay, self.frequency);
        self.envelope(s) * ((sigma * sigma - omega * omega) * sin - 2.0 * sigma * omega * cos)
    }

    /// Bounds of |f'| and |f''| on [a, b] after the origin.
    pub(super) fn derivative_bounds(&self, a: f64, b: f64) -> (f64, f64) {
        let envelope = self.envelope(a).abs().max(self.envelope(b).abs());
        let rate = self.decay.hypot(self.frequency);
        (envelope * rate, envelope * rate * rate)
    }
}

/// constant + slope·(t − origin) + Σ oscillations on [start, end).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// First time of the piece, a breakpoint or −∞.
    pub start: f64,
    /// The next breakpoint, or ∞.
    pub end: f64,
    /// Reference time of the closed form, finite.
    pub origin: f64,
    /// Constant term, V or A.
    pub constant: f64,
    /// Linear term, V/s or A/s.
    pub slope: f64,
    terms: [Oscillation; 3],
}

impl Piece {
    /// Zero at all times.
    pub(crate) fn zero() -> Self {
        Self::line(f64::NEG_INFINITY, f64::INFINITY, 0.0, 0.0, 0.0)
    }

    /// The oscillating and decaying terms (at most three).
    pub fn terms(&self) -> impl Iterator<Item = &Oscillation> {
        self.terms.iter().filter(|term| term.amplitude != 0.0)
    }

    /// The closed form at `t` (which may lie outside the interval).
    #[must_use]
    pub fn value(&self, t: f64) -> f64 {
        let s = t - self.origin;
        let line = if self.slope == 0.0 {
            self.constant
        } else {
            self.constant + self.slope * s
        };
        self.terms().fold(line, |sum, term| sum + term.value(s))
    }

    /// The derivative of the closed form at `t`.
    #[must_use]
    pub fn derivative(&self, t: f64) -> f64 {
        let s = t - self.origin;
        self.terms()
            .fold(self.slope, |sum, term| sum + term.derivative(s))
    }

    /// The second derivative of the closed form at `t`.
    #[must_use]
    pub fn second_derivative(&self, t: f64) -> f64 {
        let s = t - self.origin;
        self.terms().map(|term| term.second_derivative(s)).sum()
    }

    pub(super) fn line(start: f64, end: f64, origin: f64, constant: f64, slope: f64) -> Self {
        Self {
            start,
            end,
            origin,
            constant,
            slope,
            terms: [Oscillation::default(); 3],
        }
    }

    pub(super) fn with_terms<const N: usize>(
        start: f64,
        end: f64,
        constant: f64,
        terms: [Oscillation; N],
    ) -> Self {
        let mut piece = Self::line(start, end, start, constant, 0.0);
        piece.terms[..N].copy_from_slice(&terms);
        piece
    }
}

/// A piece with its limits as the parameters give them: the value at its start and the limit at its end (NaN for no end).
/// Two neighbours with equal limits join without an edge.
pub(super) struct Segment {
    pub(super) piece: Piece,
    pub(super) first: f64,
    pub(super) last: f64,
}

impl Segment {
    pub(super) fn constant(value: f64, start: f64, end: f64) -> Self {
        Straight::constant(value, start, end).into()
    }
}

/// A segment without terms: first + slope (t − origin) on [start, end).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Straight {
    pub(super) start: f64,
    /// The next breakpoint, or ∞.
    pub(crate) end: f64,
    /// Reference time, finite.
    pub(crate) origin: f64,
    /// The value there, V or A.
    pub(crate) first: f64,
    /// V/s or A/s.
    pub(crate) slope: f64,
    /// The limit at the end.
    pub(super) last: f64,
    /// Of a line through corner points: its lap, and the point at which it ends.
    pub(super) lap: f64,
    pub(super) next: usize,
}

impl Straight {
    pub(super) fn constant(value: f64, start: f64, end: f64) -> Self {
        let origin = if start.is_finite() {
            start
        } else if end.is_finite() {
            end
        } else {
            0.0
        };
        Self {
            start,
            end,
            origin,
            first: value,
            slope: 0.0,
            last: value,
            lap: 0.0,
            next: 0,
        }
    }
}

impl From<Straight> for Segment {
    fn from(line: Straight) -> Self {
        Self {
            piece: Piece::line(line.start, line.end, line.origin, line.first, line.slope),
            first: line.first,
            last: line.last,
        }
    }
}

/// `EXP`: v1, from the rise delay on v1 + (v2 − v1)(1 − e^{−(t−td1)/tau1}), from the fall delay on plus
/// (v1 − v2)(1 − e^{−(t−td2)/tau2}). A zero time constant is an edge.
pub(super) fn exponentials(
    (v1, v2): (f64, f64),
    (rise_delay, rise_tau): (f64, f64),
    (fall_delay, fall_tau): (f64, f64),
    t: f64,
    side: Side,
) -> Segment {
    let swing = v2 - v1;
    // What is left of the rise, of the fall, s after its delay.
    let rest = |tau: f64, s: f64| {
        if tau > 0.0 {
            swing * (-s / tau).exp()
        } else {
            0.0
        }
    };
    let rate = |tau: f64| if tau > 0.0 { 1.0 / tau } else { 0.0 };
    let fall_delay = fall_delay.max(rise_delay);
    let lag = fall_delay - rise_delay;
    let (start, top) = (
        if rise_tau > 0.0 { v1 } else { v2 },
        v2 - rest(rise_tau, lag),
    );
    if side.before(t, rise_delay) {
        Segment::constant(v1, f64::NEG_INFINITY, rise_delay)
    } else if side.before(t, fall_delay) {
        let rise = Oscillation::exponential(-rest(rise_tau, 0.0), rate(rise_tau));
        Segment {
            piece: Piece::with_terms(rise_delay, fall_delay, v2, [rise]),
            first: start,
            last: top,
        }
    } else {
        let rise = Oscillation::exponential(-rest(rise_tau, lag), rate(rise_tau));
        let fall = Oscillation::exponential(rest(fall_tau, 0.0), rate(fall_tau));
        let piece = Piece::with_terms(fall_delay, f64::INFINITY, v1, [rise, fall]);
        let top = if lag > 0.0 { top } else { start };
        let first = if fall_tau > 0.0 { top } else { top - swing };
        Segment {
            piece,
            first,
            last: f64::NAN,
        }
    }
}

/// A·(o + sin ms)·sin cs = A o sin cs + A/2 (cos (c−m)s − cos (c+m)s).
pub(super) fn amplitude_modulation(
    amplitude: f64,
    offset: f64,
    modulation: f64,
    carrier: f64,
    delay: f64,
) -> Piece {
    let cosine = |amplitude: f64, hertz: f64| Oscillation {
        amplitude,
        decay: 0.0,
        frequency: TAU * hertz,
        phase: FRAC_PI_2,
    };
    let sine = Oscillation {
        amplitude: amplitude * offset,
        decay: 0.0,
        frequency: TAU * carrier,
        phase: 0.0,
    };
    let terms = [
        sine,
        cosine(0.5 * amplitude, carrier - modulation),
        cosine(-0.5 * amplitude, carrier + modulation),
    ];
    Piece::with_terms(delay, f64::INFINITY, 0.0, terms)
}

/// `SFFM` with angular frequencies: offset + amplitude·sin(ω_c t + φ_c + index·sin(ω_s t + φ_s)).
#[derive(Debug, Clone, Copy)]
pub(super) struct Tone {
    pub(super) offset: f64,
    pub(super) amplitude: f64,
    pub(super) carrier: (f64, f64),
    pub(super) index: f64,
    pub(super) signal: (f64, f64),
}

impl Tone {
    fn angles(&self, t: f64) -> (f64, f64) {
        let signal = self.signal.0 * t + self.signal.1;
        (
            self.carrier.0 * t + self.carrier.1 + self.index * signal.sin(),
            signal,
        )
    }

    pub(super) fn value(&self, t: f64) -> f64 {
        self.offset + self.amplitude * self.angles(t).0.sin()
    }

    pub(super) fn derivative(&self, t: f64) -> f64 {
        let (angle, signal) = self.angles(t);
        self.amplitude * angle.cos() * (self.carrier.0 + self.index * self.signal.0 * signal.cos())
    }

    /// Bounds of |f'| and |f''| everywhere.
    pub(super) fn derivative_bounds(&self) -> (f64, f64) {
        let rate = self.carrier.0.abs() + (self.index * self.signal.0).abs();
        let chirp = (self.index * self.signal.0 * self.signal.0).abs();
        (
            self.amplitude.abs() * rate,
            self.amplitude.abs() * (rate * rate + chirp),
        )
    }
}
