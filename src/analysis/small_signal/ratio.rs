//! Signals and ratios of signals by their names, and the margins of a loop gain.

use nalgebra::Complex;

use crate::waveform::{Phasors, canonical_name};

/// A signal, or a ratio of two: `v(out)`, `v(a)/v(b)`, `-v(y)/v(x)`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ratio {
    /// As a column is called.
    pub name: String,
    /// Above the line.
    pub numerator: String,
    /// Below it.
    pub denominator: Option<String>,
    /// With a minus in front.
    pub negative: bool,
}

/// Where a loop gain crosses 1, or −180°.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margin {
    /// Hz, between two frequencies by a straight line in the logarithms.
    pub frequency: f64,
    /// What is left there.
    pub left: Left,
}

/// What is left until a loop is unstable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Left {
    /// Where the gain is 1: 180° and the phase, degrees in (−180, 180].
    Phase(f64),
    /// Where the phase is −180°: 1 over the gain, dB.
    Gain(f64),
}

impl Ratio {
    /// Reads a name; a plain one is a signal.
    #[must_use]
    pub fn parse(text: &str) -> Self {
        let text: String = text.chars().filter(|c| !c.is_whitespace()).collect();
        let (negative, positive) = match text.strip_prefix('-') {
            Some(rest) => (true, rest),
            None => (false, &text[..]),
        };
        let mut depth = 0_i32;
        let bar = positive.char_indices().find(|(_, c)| {
            depth += i32::from(*c == '(') - i32::from(*c == ')');
            depth == 0 && *c == '/'
        });
        let (numerator, denominator) = match bar {
            Some((at, _)) => {
                let (above, below) = (&positive[..at], &positive[at + 1..]);
                (canonical_name(above), Some(canonical_name(below)))
            }
            None => (canonical_name(positive), None),
        };
        let sign = if negative { "-" } else { "" };
        let name = match &denominator {
            Some(below) => format!("{sign}{numerator}/{below}"),
            None => format!("{sign}{numerator}"),
        };
        Self {
            name,
            numerator,
            denominator,
            negative,
        }
    }

    /// The signals that it needs.
    pub fn signals(&self) -> impl Iterator<Item = &String> {
        std::iter::once(&self.numerator).chain(&self.denominator)
    }
}

/// The columns that these ratios ask for, of every sideband; a denominator is that of the frequency itself. `None` where a signal is missing.
#[must_use]
pub fn ratios(of: &Phasors, asked: &[Ratio]) -> Option<Phasors> {
    let mut columns = Vec::new();
    let mut bands: Vec<&str> = Vec::new();
    for name in &of.names {
        let band = name
            .rsplit_once('@')
            .map_or("", |(own, _)| &name[own.len()..]);
        if !bands.contains(&band) {
            bands.push(band);
        }
    }
    for band in bands {
        for ratio in asked {
            let above = of.find(&format!("{}{band}", ratio.numerator))?;
            let below = match &ratio.denominator {
                Some(name) => Some(of.find(name)?),
                None => None,
            };
            columns.push((
                format!("{}{band}", ratio.name),
                above,
                below,
                ratio.negative,
            ));
        }
    }
    let unit = |above: usize, below: &Option<usize>| match below {
        None => of.units[above],
        Some(below) if of.units[above] == of.units[*below] => "",
        Some(below) if of.units[*below] == "A" => "Ω",
        Some(_) => "S",
    };
    let width = of.names.len().max(1);
    let row = |values: &[Complex<f64>]| {
        let column = |(_, above, below, negative): &(String, usize, Option<usize>, bool)| {
            let value = below.map_or(values[*above], |below| values[*above] / values[below]);
            if *negative { -value } else { value }
        };
        columns.iter().map(column).collect::<Vec<_>>()
    };
    Some(Phasors {
        title: of.title.clone(),
        frequency: of.frequency.clone(),
        values: of.values.chunks(width).flat_map(row).collect(),
        units: columns
            .iter()
            .map(|(_, above, below, _)| unit(*above, below))
            .collect(),
        names: columns.into_iter().map(|(name, ..)| name).collect(),
    })
}

/// The phase over frequency in degrees, without jumps: the first in (−180, 180], each next one the closest to the one before.
pub fn unwrapped(values: impl Iterator<Item = Complex<f64>>) -> Vec<f64> {
    let mut phases: Vec<f64> = Vec::new();
    for value in values {
        let own = value.arg().to_degrees();
        let turns = phases
            .last()
            .map_or(0.0, |last| ((last - own) / 360.0).round());
        phases.push(own + 360.0 * turns);
    }
    phases
}

/// Where a loop gain crosses 1 and where its phase crosses −180° (or 180° and any odd multiple), in order of frequency.
#[must_use]
pub fn margins(of: &Phasors, j: usize) -> Vec<Margin> {
    let gain: Vec<f64> = of.column(j).map(|value| value.norm().ln()).collect();
    let phase = unwrapped(of.column(j));
    let mut found = Vec::new();
    for k in 1..of.frequency.len() {
        let pair = |values: &[f64]| [values[k - 1], values[k]];
        let (g, p) = (pair(&gain), pair(&phase));
        let f = [of.frequency[k - 1], of.frequency[k]].map(f64::ln);
        let between = |[a, b]: [f64; 2], part: f64| a + (b - a) * part;
        if (g[0] > 0.0) != (g[1] > 0.0) && g[0].is_finite() && g[1].is_finite() {
            let part = g[0] / (g[0] - g[1]);
            let left = 180.0 + between(p, part);
            found.push(Margin {
                frequency: between(f, part).exp(),
                left: Left::Phase(left - 360.0 * ((left - 180.0) / 360.0).ceil()),
            });
        }
        // Odd multiples of 180° between the two phases.
        let half_turns = |phase: f64| ((phase + 180.0) / 360.0).floor();
        if half_turns(p[0]) != half_turns(p[1]) {
            let crossed = 360.0 * half_turns(p[0]).max(half_turns(p[1])) - 180.0;
            let part = (crossed - p[0]) / (p[1] - p[0]);
            found.push(Margin {
                frequency: between(f, part).exp(),
                left: Left::Gain(-between(g, part) * 20.0 / std::f64::consts::LN_10),
            });
        }
    }
    found.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1000/((1 + jf)(1 + jf/100)²) crosses −180° where 2 atan(f/100) + atan f = 180°: f² = 100² + 200, with a gain of 1000/(√(1 + f²)(1 + f²/100²)).
    #[test]
    fn margins_of_three_poles() {
        let frequency: Vec<f64> = (0..4000)
            .map(|k| 10f64.powf(f64::from(k) / 1000.0))
            .collect();
        let gain = |f: &f64| {
            let pole = |corner: f64| Complex::new(1.0, f / corner);
            Complex::from(1000.0) / (pole(1.0) * pole(100.0) * pole(100.0))
        };
        let phasors = Phasors {
            names: vec!["v(y)/v(x)".into()],
            units: vec![""],
            values: frequency.iter().map(gain).collect(),
            frequency,
            ..Phasors::default()
        };
        let found = margins(&phasors, 0);
        let [a, b] = &found[..] else {
            panic!("{found:?}")
        };
        let f = 10200f64.sqrt();
        let truth = -20.0 * (1000.0 / ((1.0 + f * f).sqrt() * (1.0 + f * f / 1e4))).log10();
        let Left::Gain(left) = a.left else {
            panic!("{a:?}")
        };
        assert!(
            (a.frequency / f - 1.0).abs() < 1e-5 && (left - truth).abs() < 1e-4,
            "{a:?}"
        );
        let Left::Phase(left) = b.left else {
            panic!("{b:?}")
        };
        let truth = gain(&b.frequency);
        assert!((truth.norm() - 1.0).abs() < 1e-5, "{b:?}");
        assert!(
            (left - (180.0 + truth.arg().to_degrees() - 360.0)).abs() < 1e-3,
            "{b:?} {truth}"
        );
    }

    #[test]
    fn names_are_signals_or_ratios() {
        let ratio = Ratio::parse("- V(a, b) / i(R1)");
        assert_eq!(ratio.name, "-v(a,b)/i(r1)");
        assert_eq!(ratio.signals().collect::<Vec<_>>(), ["v(a,b)", "i(r1)"]);
        let plain = Ratio::parse("out");
        assert_eq!((plain.name.as_str(), plain.denominator), ("v(out)", None));
    }
}
