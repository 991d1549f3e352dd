//! Fourier coefficients over the last period, as `.four` prints them.

use std::f64::consts::TAU;

use super::{Line, MeasureError, Trace};
use crate::settings::tolerances::netlists::SMALL_ANGLE;

/// One harmonic, magnitude·sin(2π k f t + phase) with t from the start of the period, as in SPICE.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonic {
    /// Its frequency, Hz.
    pub frequency: f64,
    /// Its magnitude.
    pub magnitude: f64,
    /// Its phase, degrees.
    pub phase: f64,
}

/// Mean value and harmonics of a waveform over one period.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// The mean.
    pub mean: f64,
    /// The harmonics 1 … n.
    pub harmonics: Vec<Harmonic>,
    /// Total harmonic distortion √(Σ_{k≥2} m_k²)/m_1; `None` without a fundamental.
    pub thd: Option<f64>,
}

/// The first `count` harmonics of `frequency` over the last period of a waveform, exactly for its straight pieces.
///
/// # Errors
/// [`MeasureError::Window`] where the run is shorter than a period.
pub fn fourier(trace: Trace<'_>, frequency: f64, count: usize) -> Result<Spectrum, MeasureError> {
    let period = frequency.recip();
    let to = trace.time.last().copied().unwrap_or(0.0);
    let from = to - period;
    let first = trace.time.first().copied().unwrap_or(0.0);
    if !(period.is_finite() && period > 0.0) || first - from > f64::EPSILON * to.abs() {
        return Err(MeasureError::Window { from, to });
    }
    let lines: Vec<Line> = trace
        .lines_within(from, to)
        .filter(|l| l.t1 > l.t0)
        .collect();
    let mean = lines
        .iter()
        .map(|l| 0.5 * (l.y0 + l.y1) * (l.t1 - l.t0))
        .sum::<f64>()
        * frequency;
    let mut harmonics = Vec::with_capacity(count);
    for k in 1..=count {
        let omega = TAU * frequency * k as f64;
        let (mut cosine, mut sine) = (0.0, 0.0);
        for line in &lines {
            let (c, s) = moments(line, omega, from);
            cosine += c;
            sine += s;
        }
        let (a, b) = (2.0 * frequency * cosine, 2.0 * frequency * sine);
        harmonics.push(Harmonic {
            frequency: frequency * k as f64,
            magnitude: a.hypot(b),
            phase: a.atan2(b).to_degrees(),
        });
    }
    let distortion = harmonics.iter().skip(1).map(|h| h.magnitude * h.magnitude);
    let distortion = distortion.sum::<f64>().sqrt();
    let fundamental = harmonics.first().map_or(0.0, |h| h.magnitude);
    Ok(Spectrum {
        mean,
        harmonics,
        thd: (fundamental > 0.0).then(|| distortion / fundamental),
    })
}

/// ∫ y cos ω(t − t₀) dt and ∫ y sin ω(t − t₀) dt over one straight piece, about its middle:
/// with y = m + d s, t = c + h s, s ∈ [−1, 1], θ = ωh: ∫ cos θs = 2 sinc θ and ∫ s sin θs = 2 (sinc θ − cos θ)/θ.
fn moments(line: &Line, omega: f64, origin: f64) -> (f64, f64) {
    let half = 0.5 * (line.t1 - line.t0);
    let (middle, rise) = (0.5 * (line.y0 + line.y1), 0.5 * (line.y1 - line.y0));
    let theta = omega * half;
    let (even, odd) = if theta < SMALL_ANGLE {
        let square = theta * theta;
        (
            1.0 - square / 6.0 * (1.0 - square / 20.0),
            theta / 3.0 * (1.0 - square / 10.0),
        )
    } else {
        let sinc = theta.sin() / theta;
        (sinc, (sinc - theta.cos()) / theta)
    };
    let (sin, cos) = (omega * (line.t0 + half - origin)).sin_cos();
    let (even, odd) = (2.0 * half * middle * even, 2.0 * half * rise * odd);
    (even * cos - odd * sin, even * sin + odd * cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_wave() {
        // ±1 with period 2 s: 4/(πk) for odd k.
        let square = Trace {
            time: &[0.0, 1.0, 1.0, 2.0],
            values: &[1.0, 1.0, -1.0, -1.0],
        };
        let spectrum = fourier(square, 0.5, 9).unwrap();
        assert!(spectrum.mean.abs() < 1e-15);
        for (k, harmonic) in (1..).zip(&spectrum.harmonics) {
            let expected = if k % 2 == 1 {
                4.0 / (std::f64::consts::PI * f64::from(k))
            } else {
                0.0
            };
            assert!((harmonic.magnitude - expected).abs() < 1e-14, "{k}");
        }
        assert!(spectrum.harmonics[0].phase.abs() < 1e-12);
        let odd: f64 = [3.0_f64, 5.0, 7.0, 9.0].iter().map(|k| k.powi(-2)).sum();
        assert!((spectrum.thd.unwrap() - odd.sqrt()).abs() < 1e-14);
    }

    #[test]
    fn a_fine_sine_has_its_amplitude_and_phase() {
        let time: Vec<f64> = (0..=20_000).map(|k| f64::from(k) * 1e-4).collect();
        let wave = |t: &f64| 1.0 + 3.0 * (TAU * t + 0.5).sin();
        let values: Vec<f64> = time.iter().map(wave).collect();
        let trace = Trace {
            time: &time,
            values: &values,
        };
        let spectrum = fourier(trace, 1.0, 3).unwrap();
        assert!((spectrum.mean - 1.0).abs() < 1e-12);
        // Chords of a sine lower its amplitude by (ωh)²/12.
        assert!((spectrum.harmonics[0].magnitude - 3.0).abs() < 3.0 * (TAU * 1e-4).powi(2) / 11.0);
        assert!((spectrum.harmonics[0].phase - 0.5_f64.to_degrees()).abs() < 1e-6);
        assert!(spectrum.thd.unwrap() < 1e-9);
        assert!(fourier(trace, 0.1, 3).is_err());
    }
}
