//! Bode pictures: gain in decibels above, phase in degrees below, over the logarithm of the frequency.

use super::figure::{Axis, Figure, Panel, Series};
use super::si;
use crate::analysis::{Left, Margin, margins, unwrapped};
use crate::waveform::Phasors;

/// Decibels below the largest gain from which on a value is no more than rounding, and has no point.
const DEPTH: f64 = 240.0;

/// Gain and phase of all columns where they are not zero; of ratios without a unit their margins, marked where they are.
#[must_use]
pub fn figure(of: &Phasors) -> Figure {
    let positive = |k: &usize| of.frequency[*k] > 0.0;
    let rows: Vec<usize> = (0..of.frequency.len()).filter(positive).collect();
    let norms = (0..of.names.len()).flat_map(|j| of.column(j).map(|value| value.norm()));
    let lowest = norms.fold(0.0, f64::max) * 10f64.powf(-DEPTH / 20.0);
    let (mut gains, mut phases) = (Vec::new(), Vec::new());
    for (j, name) in of.names.iter().enumerate() {
        let gain: Vec<f64> = of
            .column(j)
            .map(|value| 20.0 * value.norm().log10())
            .collect();
        let seen: Vec<bool> = of.column(j).map(|value| value.norm() > lowest).collect();
        let phase = unwrapped(of.column(j));
        let curve = |values: &[f64]| Series {
            // A curve that is missing is told by its name.
            name: if seen.contains(&true) {
                name.clone()
            } else {
                format!("{name} = 0")
            },
            // Of `.step`, as `v(out)[r=1000]`.
            run: name
                .strip_suffix(']')
                .and_then(|name| name.split_once('['))
                .map_or_else(String::new, |(_, run)| run.to_owned()),
            points: rows
                .iter()
                .filter(|&&k| seen[k])
                .map(|&k| (of.frequency[k].log10(), values[k]))
                .collect(),
        };
        gains.push(curve(&gain));
        phases.push(curve(&phase));
    }
    for (j, name) in of.names.iter().enumerate() {
        if !of.units[j].is_empty() || name.contains('@') {
            continue;
        }
        for margin in margins(of, j) {
            let x = margin.frequency.log10();
            let (panel, from, to) = match margin.left {
                Left::Phase(left) => {
                    let at = below_phase(&phases[j], x);
                    (&mut phases, at, at - left)
                }
                Left::Gain(left) => (&mut gains, -left, 0.0),
            };
            panel.push(Series {
                name: words(&margin),
                run: String::new(),
                points: vec![(x, from), (x, to)],
            });
        }
    }
    let panel = |quantity: &str, unit, series| Panel {
        quantity: quantity.into(),
        unit,
        series,
    };
    Figure {
        title: of.title.clone(),
        axis: Axis::Frequency,
        panels: vec![panel("gain", "dB", gains), panel("phase", "°", phases)],
    }
}

/// A curve's value at x, by a straight line.
fn below_phase(curve: &Series, x: f64) -> f64 {
    let after = curve.points.iter().position(|(own, _)| *own >= x);
    match after {
        Some(k) if k > 0 => {
            let ((a, from), (b, to)) = (curve.points[k - 1], curve.points[k]);
            from + (to - from) * (x - a) / (b - a)
        }
        _ => curve.points.first().map_or(0.0, |(_, y)| *y),
    }
}

/// A margin, for a legend: `52.1° at 10.2 kHz`.
#[must_use]
pub fn words(margin: &Margin) -> String {
    let at = si::quantity(margin.frequency, "Hz", 4);
    match margin.left {
        Left::Phase(left) => format!("{}° at {at}", si::plain(left, 4)),
        Left::Gain(left) => format!("{} dB at {at}", si::plain(left, 4)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Complex;

    #[test]
    fn what_is_zero_has_no_decibels_and_no_phase() {
        let real = |re: f64| Complex::new(re, 0.0);
        let phasors = Phasors {
            title: String::new(),
            names: vec!["v(a)".into(), "v(b)".into()],
            units: vec!["V", "V"],
            frequency: vec![1.0, 10.0],
            values: [10.0, 0.0, 1.0, 1e-14].map(real).into(),
        };
        let panels = figure(&phasors).panels;
        assert_eq!(panels[1].series[1].name, "v(b) = 0");
        assert_eq!(panels[0].series[0].points, [(0.0, 20.0), (1.0, 0.0)]);
        assert!(panels.iter().all(|p| p.series[1].points.is_empty()));
    }
}
