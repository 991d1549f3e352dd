//! Sources between two neighbouring corners, where each is a straight line or a sine.

use crate::circuit::{Circuit, Part, Wave};

/// A source on an interval.
#[derive(Debug, Clone, Copy)]
pub(super) enum Piece {
    /// Value at the time, slope.
    Line(f64, f64, f64),
    /// Offset, amplitude, rad/s, rad.
    Sine(f64, f64, f64, f64),
}

impl Piece {
    pub(super) fn value(&self, t: f64) -> f64 {
        match *self {
            Self::Line(t0, v, slope) => v + slope * (t - t0),
            Self::Sine(offset, a, omega, phase) => offset + a * (omega * t + phase).sin(),
        }
    }

    pub(super) fn slope(&self, t: f64) -> f64 {
        match *self {
            Self::Line(_, _, slope) => slope,
            Self::Sine(_, a, omega, phase) => a * omega * (omega * t + phase).cos(),
        }
    }
}

/// The piece that holds around `t`, which is no corner.
pub(super) fn piece(wave: &Wave, t: f64) -> Piece {
    match wave {
        Wave::Dc(v) => Piece::Line(0.0, *v, 0.0),
        Wave::Sin(offset, a, f, phase) => Piece::Sine(
            *offset,
            *a,
            2.0 * std::f64::consts::PI * f,
            phase.to_radians(),
        ),
        Wave::Pulse {
            levels: [low, high],
            delay,
            rise,
            fall,
            width,
            period,
        } => {
            if t < *delay {
                return Piece::Line(0.0, *low, 0.0);
            }
            let start = delay + ((t - delay) / period).floor() * period;
            let s = t - start;
            if s < *rise {
                Piece::Line(start, *low, (high - low) / rise)
            } else if s < rise + width {
                Piece::Line(start, *high, 0.0)
            } else if s < rise + width + fall {
                Piece::Line(start + rise + width, *high, (low - high) / fall)
            } else {
                Piece::Line(start, *low, 0.0)
            }
        }
        Wave::Pwl(corners) => {
            let k = corners.partition_point(|&(c, _)| c <= t);
            match (k.checked_sub(1).map(|k| corners[k]), corners.get(k)) {
                (Some((a, va)), Some(&(b, vb))) => Piece::Line(a, va, (vb - va) / (b - a)),
                (Some((_, v)), None) | (None, Some(&(_, v))) => Piece::Line(0.0, v, 0.0),
                (None, None) => Piece::Line(0.0, 0.0, 0.0),
            }
        }
    }
}

/// Corners of all sources.
pub(crate) fn corners(circuit: &Circuit) -> Vec<f64> {
    let mut times = Vec::new();
    for card in &circuit.cards {
        let (Part::V(wave) | Part::I(wave)) = &card.part else {
            continue;
        };
        match wave {
            Wave::Dc(_) | Wave::Sin(..) => {}
            Wave::Pulse {
                delay,
                rise,
                fall,
                width,
                period,
                ..
            } => {
                let count = ((circuit.stop - delay) / period).ceil().max(0.0) as usize;
                for k in 0..=count {
                    let start = delay + k as f64 * period;
                    for corner in [0.0, *rise, rise + width, rise + width + fall] {
                        times.push(start + corner);
                    }
                }
            }
            Wave::Pwl(corners) => times.extend(corners.iter().map(|c| c.0)),
        }
    }
    times
}

/// Corners of all sources and the instants of rows, in order, each once; rows are marked.
pub(super) fn stops(circuit: &Circuit) -> Vec<(f64, bool)> {
    let corners = corners(circuit).into_iter();
    let mut times: Vec<(f64, bool)> = corners.map(|t| (t, false)).collect();
    times.extend((1..=circuit.rows).map(|k| (circuit.stop * k as f64 / circuit.rows as f64, true)));
    times.retain(|&(t, _)| t > 0.0 && t <= circuit.stop);
    times.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Corners that differ by rounding are one.
    let mut merged: Vec<(f64, bool)> = Vec::new();
    for (t, row) in times {
        match merged.last_mut() {
            Some(last) if t - last.0 <= 1e-11 * circuit.stop => last.1 |= row,
            _ => merged.push((t, row)),
        }
    }
    merged
}
