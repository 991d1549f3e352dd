//! Fourier coefficients over the last period, as `.four` prints them.

use std::f64::consts::TAU;

use super::trace::{Line, Piece};
use super::{MeasureError, Trace};
use crate::linalg::gauss::POINTS;
use crate::settings::tolerances::netlists::SMALL_ANGLE;
use crate::settings::tolerances::periodic::FUNDAMENTAL;
use crate::settings::tolerances::times::SAME_TIME;

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

/// The first `count` harmonics of `frequency` over the last period of a waveform, exactly for its lines and polynomials.
///
/// # Errors
/// [`MeasureError::Period`] where the run is shorter than a period.
pub fn fourier(trace: &Trace<'_>, frequency: f64, count: usize) -> Result<Spectrum, MeasureError> {
    let period = frequency.recip();
    let (first, to) = trace.span().unwrap_or_default();
    let from = to - period;
    if !(period.is_finite() && period > 0.0) || first - from > SAME_TIME * to.abs() {
        return Err(MeasureError::Period {
            frequency,
            seconds: to - first,
        });
    }
    let mut parts: Vec<Part> = vec![];
    trace.pieces((from, to), |piece| {
        if piece.length() > 0.0 {
            parts.push(Part::of(&piece));
        }
    });
    let mean = parts.iter().map(|p| 2.0 * p.half * p.terms[0]);
    let impulses = trace.impulses.iter().filter(|(t, _)| *t > from && *t <= to);
    let mean = (mean.sum::<f64>() + impulses.clone().map(|i| i.1).sum::<f64>()) * frequency;
    let mut harmonics = Vec::with_capacity(count);
    for k in 1..=count {
        let omega = TAU * frequency * k as f64;
        let (mut cosine, mut sine) = (0.0, 0.0);
        for part in &parts {
            let (c, s) = part.moments(omega, from);
            cosine += c;
            sine += s;
        }
        for (t, area) in impulses.clone() {
            let (s, c) = (omega * (t - from)).sin_cos();
            cosine += area * c;
            sine += area * s;
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
    let magnitudes = harmonics.iter().map(|h| h.magnitude);
    let largest = magnitudes.fold(mean.abs(), f64::max);
    Ok(Spectrum {
        mean,
        harmonics,
        thd: (fundamental > FUNDAMENTAL * largest).then(|| distortion / fundamental),
    })
}

/// A piece as y = Σ_n c_n P_n(s) with Legendre's polynomials, t = middle + half s, −1 ≤ s ≤ 1.
struct Part {
    middle: f64,
    half: f64,
    terms: [f64; POINTS],
    /// Terms that may not be 0.
    count: usize,
}

impl Part {
    fn of(piece: &Piece) -> Self {
        let mut terms = [0.0; POINTS];
        let (begin, end) = piece.span();
        let count = match piece {
            Piece::Line(Line { y0, y1, .. }) => {
                terms[..2].copy_from_slice(&[0.5 * (y0 + y1), 0.5 * (y1 - y0)]);
                2
            }
            Piece::Curve(curve, (low, high)) => {
                for (n, term) in terms.iter_mut().enumerate() {
                    let sum = curve.gauss((*low, *high), |y, s| y * legendre(n, s));
                    *term = (2 * n + 1) as f64 * sum / (high - low);
                }
                POINTS
            }
        };
        Self {
            middle: begin + 0.5 * (end - begin),
            half: 0.5 * piece.length(),
            terms,
            count,
        }
    }

    /// ∫ y cos ω(t − t₀) dt and ∫ y sin ω(t − t₀) dt: ∫ P_n(s) e^{jθs} ds = 2 jⁿ j_n(θ) with the spherical Bessel functions (DLMF 10.54.2).
    fn moments(&self, omega: f64, origin: f64) -> (f64, f64) {
        let bessel = spherical_bessel(omega * self.half, self.count);
        let (mut even, mut odd) = (0.0, 0.0);
        for (n, (term, bessel)) in self.terms.iter().zip(bessel).enumerate().take(self.count) {
            let signed = if n % 4 < 2 { *term } else { -*term };
            *if n % 2 == 0 { &mut even } else { &mut odd } += signed * bessel;
        }
        let (sin, cos) = (omega * (self.middle - origin)).sin_cos();
        let both = 2.0 * self.half;
        (
            both * (even * cos - odd * sin),
            both * (even * sin + odd * cos),
        )
    }
}

/// P_n(s).
fn legendre(n: usize, s: f64) -> f64 {
    let (mut before, mut now) = (0.0, 1.0);
    for k in 0..n {
        let k = k as f64;
        (before, now) = (now, ((2.0 * k + 1.0) * s * now - k * before) / (k + 1.0));
    }
    now
}

/// j_0(θ) … of so many orders: by their recurrence upwards where that is stable, else downwards (DLMF 10.74(iv)).
fn spherical_bessel(theta: f64, count: usize) -> [f64; POINTS] {
    /// Orders above the last one in which the recurrence downwards forgets where it began.
    const ABOVE: usize = 20;
    let mut j = [0.0; POINTS];
    if theta < SMALL_ANGLE {
        // θⁿ/(2n + 1)!! (1 − θ²/(4n + 6) (1 − θ²/(8n + 20)))
        let mut lead = 1.0;
        for (n, j) in j.iter_mut().enumerate().take(count) {
            let n = n as f64;
            let square = theta * theta;
            *j = lead * (1.0 - square / (4.0 * n + 6.0) * (1.0 - square / (8.0 * n + 20.0)));
            lead *= theta / (2.0 * n + 3.0);
        }
        return j;
    }
    let (sin, cos) = theta.sin_cos();
    let first = [sin / theta, (sin / theta - cos) / theta];
    if theta >= count as f64 {
        j[..2].copy_from_slice(&first);
        for n in 2..count {
            j[n] = (2 * n - 1) as f64 / theta * j[n - 1] - j[n - 2];
        }
        return j;
    }
    let (mut above, mut now) = (0.0, f64::MIN_POSITIVE);
    for n in (0..count + ABOVE).rev() {
        (above, now) = (now, (2 * n + 3) as f64 / theta * now - above);
        if n < count {
            j[n] = now;
        }
        // As far as it has grown.
        if now.abs() > f64::MAX.sqrt() {
            let scale = now.abs().recip();
            j.iter_mut().for_each(|j| *j *= scale);
            (above, now) = (above * scale, now * scale);
        }
    }
    // The larger one of the two that are known.
    let known = if first[0].abs() > first[1].abs() {
        0
    } else {
        1
    };
    let scale = first[known] / j[known];
    j.map(|j| j * scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::Curve;

    #[test]
    fn what_is_constant_to_rounding_has_no_fundamental() {
        let values = vec![12.0, 12.0 + 2e-15, 12.0 - 2e-15, 12.0];
        let constant = Trace::lines(&[0.0, 0.5, 1.5, 2.0], values);
        assert_eq!(fourier(&constant, 0.5, 9).unwrap().thd, None);
    }

    #[test]
    fn a_square_wave() {
        // ±1 with period 2 s: 4/(πk) for odd k.
        let square = Trace::lines(&[0.0, 1.0, 1.0, 2.0], vec![1.0, 1.0, -1.0, -1.0]);
        let spectrum = fourier(&square, 0.5, 9).unwrap();
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
        let trace = Trace::lines(&time, values);
        let spectrum = fourier(&trace, 1.0, 3).unwrap();
        assert!((spectrum.mean - 1.0).abs() < 1e-12);
        // Chords of a sine lower its amplitude by (ωh)²/12.
        assert!((spectrum.harmonics[0].magnitude - 3.0).abs() < 3.0 * (TAU * 1e-4).powi(2) / 11.0);
        assert!((spectrum.harmonics[0].phase - 0.5_f64.to_degrees()).abs() < 1e-6);
        assert!(spectrum.thd.unwrap() < 1e-9);
        assert!(fourier(&trace, 0.1, 3).is_err());
    }
    #[test]
    fn polynomials_have_their_harmonics_however_high() {
        // t⁴ over one second, in two pieces.
        let values =
            |a: f64, b: f64| std::array::from_fn(|k| (a + (b - a) * k as f64 / 8.0).powi(4));
        let piece = |a: f64, b: f64| Curve {
            begin: a,
            length: b - a,
            until: 1.0,
            values: values(a, b),
        };
        let trace = Trace::curves(vec![piece(0.0, 0.3), piece(0.3, 1.0)], vec![]);
        let spectrum = fourier(&trace, 1.0, 500).unwrap();
        assert!((spectrum.mean - 0.2).abs() < 1e-15);
        for harmonic in &spectrum.harmonics {
            let w = TAU * harmonic.frequency;
            // By parts over whole periods: cosine 4/ω² − 24/ω⁴, sine −1/ω + 12/ω³.
            let (c, s) = (
                4.0 / w.powi(2) - 24.0 / w.powi(4),
                12.0 / w.powi(3) - 1.0 / w,
            );
            let off = harmonic.magnitude - 2.0 * c.hypot(s);
            assert!(off.abs() < 1e-14, "{} {off:e}", harmonic.frequency);
        }
    }

    #[test]
    fn bessel_functions() {
        for theta in [
            1e-3_f64,
            0.0099,
            0.0101,
            0.5,
            3.0,
            std::f64::consts::PI,
            7.99,
            8.01,
            40.0,
        ] {
            let j = spherical_bessel(theta, POINTS);
            for n in 1..POINTS - 1 {
                let sum = j[n - 1] + j[n + 1];
                assert!(
                    (sum - (2 * n + 1) as f64 / theta * j[n]).abs() < 1e-14,
                    "{theta} {n}"
                );
            }
            assert!((j[0] - theta.sin() / theta).abs() < 1e-15);
        }
    }
}
