//! Independent sources as functions of time.

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
    /// offset + amplitude·e^{−damping (t−delay)}·sin(2π frequency (t−delay) + phase) for t ≥ delay, before it the value
    /// at the phase alone.
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
    },
    /// Trapezoids; a zero `rise` or `fall` is a true edge.
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
        /// Period, s.
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
}
