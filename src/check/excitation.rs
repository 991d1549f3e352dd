//! What the hypotheses of the theorems ask of the sources: constant, continuous, bounded by what.

use crate::circuit::Source;
use crate::circuit::source::Wave;

/// A source's waveform as a theorem sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Excitation {
    /// Least value over all times.
    pub low: f64,
    /// Greatest value over all times.
    pub high: f64,
    /// Whether it has edges: then it is right-continuous of locally bounded variation, else locally absolutely continuous.
    pub jumps: bool,
    /// Whether it consists of pieces that a finite linear system makes: polynomials, exponentials, sinusoids.
    pub pieces: bool,
}

impl Excitation {
    /// The facts about a source.
    #[must_use]
    pub fn of(source: &Source) -> Self {
        let range = |values: &[f64], jumps: bool| Self {
            low: values.iter().copied().fold(f64::INFINITY, f64::min),
            high: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            jumps,
            pieces: source.piece(0.0).is_some(),
        };
        match &source.wave {
            Wave::Dc(value) => range(&[*value], false),
            Wave::Sin {
                offset,
                amplitude,
                damping,
                cycles,
                ..
            } => {
                // A negative damping grows without bound.
                let size = if *damping < 0.0 {
                    f64::INFINITY
                } else {
                    amplitude.abs()
                };
                if *amplitude == 0.0 {
                    range(&[*offset], false)
                } else {
                    // Cut off where it is not back at its start.
                    let cut = cycles.is_some_and(|n| n.fract() != 0.0 || *damping != 0.0);
                    range(&[offset - size, offset + size], cut)
                }
            }
            // What arrives is as large as what the circuit sends.
            Wave::Arriving { .. } => range(&[f64::NEG_INFINITY, f64::INFINITY], true),
            Wave::Sffm {
                offset, amplitude, ..
            } => range(&[offset - amplitude.abs(), offset + amplitude.abs()], false),
            Wave::Am {
                amplitude, offset, ..
            } => {
                let size = amplitude.abs() * (offset.abs() + 1.0);
                range(&[-size, size], false)
            }
            Wave::Pulse {
                v1, v2, rise, fall, ..
            } => range(&[*v1, *v2], v1 != v2 && (*rise == 0.0 || *fall == 0.0)),
            Wave::Pwl { points, repeat, .. } => {
                let values: Vec<f64> = points.iter().map(|p| p.1).collect();
                let edge = points
                    .windows(2)
                    .any(|w| w[0].0 == w[1].0 && w[0].1 != w[1].1);
                let wraps = repeat.is_some_and(|start| {
                    let last = points.last().map(|p| p.1);
                    let first = points.iter().find(|p| p.0 >= start).map(|p| p.1);
                    last != first
                });
                if values.is_empty() {
                    range(&[0.0], false)
                } else {
                    range(&values, edge || wraps)
                }
            }
            Wave::Exp {
                v1,
                v2,
                rise_tau,
                fall_tau,
                ..
            } => range(
                &[*v1, *v2],
                v1 != v2 && (*rise_tau == 0.0 || *fall_tau == 0.0),
            ),
        }
    }

    /// Whether it never changes.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        self.low == self.high
    }
}
