//! Axes: where values stand on a sheet, and which of them are written beside it.

use super::si;

/// Lengths of steps between ticks, in powers of ten.
const STEPS: [f64; 4] = [1.0, 2.0, 5.0, 10.0];
/// Steps that divide a turn, degrees.
const ANGLES: [f64; 5] = [15.0, 30.0, 45.0, 90.0, 180.0];
/// Digits of a tick beyond which it is written with an exponent.
const LONGEST: usize = 9;

/// Values from `low` to `high` between two places of a sheet.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
    /// Where grid lines stand, with their labels (empty for none).
    pub(super) ticks: Vec<(f64, String)>,
    /// What it shows, with its unit.
    pub(super) title: String,
}

impl Axis {
    /// With round numbers in the prefix that suits the largest, about one every `apart` px.
    pub(super) fn linear(
        range: (f64, f64),
        place: (f64, f64),
        apart: f64,
        what: (&str, &str),
    ) -> Self {
        let (low, high) = range;
        let (name, unit) = what;
        let count = ((place.1 - place.0).abs() / apart).max(2.0);
        let (factor, prefix) = match unit {
            // These have no prefixes.
            "dB" | "°" | "" => (1.0, ""),
            _ => si::prefix(low.abs().max(high.abs())),
        };
        let step = step((high - low) / factor / count, unit == "°");
        let first = (low / factor / step).ceil();
        let last = (high / factor / step).floor();
        let decimals = (-step.log10().floor()).clamp(0.0, 15.0) as usize;
        let ticks = (0..=(last - first).clamp(0.0, 4.0 * count) as u32).map(|k| {
            let value = (first + f64::from(k)) * step;
            (value * factor, label(value, decimals))
        });
        Self {
            low,
            high,
            from: place.0,
            to: place.1,
            ticks: ticks.collect(),
            title: match unit {
                "" => name.to_owned(),
                unit => format!("{name} ({prefix}{unit})"),
            },
        }
    }

    /// For values given by their decimal logarithms: lines at 1 … 9 of every decade, or at the decades alone where there are many.
    pub(super) fn logarithmic(
        (low, high): (f64, f64),
        place: (f64, f64),
        (name, unit): (&str, &str),
    ) -> Self {
        let decades = high - low;
        let every = (decades / 10.0).ceil().max(1.0) as i32;
        let mut ticks = Vec::new();
        for decade in low.floor() as i32..=high.ceil() as i32 {
            for digit in 1..10 {
                let at = f64::from(decade) + f64::from(digit).log10();
                let is_named = match digit {
                    1 => decade % every == 0,
                    2 | 5 => decades <= 2.0,
                    _ => decades <= 0.7,
                };
                let within = at > low - 1e-9 && at < high + 1e-9;
                if within && (digit == 1 || decades <= 6.0) {
                    let value = f64::from(digit) * 10f64.powi(decade);
                    let text = match (is_named, unit) {
                        (false, _) => String::new(),
                        (true, "") => format!("{digit}e{decade}"),
                        (true, unit) => si::quantity(value, unit, 3),
                    };
                    ticks.push((at, text));
                }
            }
        }
        Self {
            low,
            high,
            from: place.0,
            to: place.1,
            ticks,
            title: name.into(),
        }
    }

    /// The place of a value.
    pub(super) fn at(&self, value: f64) -> f64 {
        let part = (value - self.low) / (self.high - self.low);
        self.from + part * (self.to - self.from)
    }

    /// Its two ends.
    pub(super) const fn ends(&self) -> (f64, f64) {
        (self.from, self.to)
    }
}

/// A round number not below `least`.
fn step(least: f64, is_angle: bool) -> f64 {
    if is_angle && let Some(angle) = ANGLES.into_iter().find(|a| *a >= least && least > 5.0) {
        return angle;
    }
    let power = 10f64.powf(least.log10().floor());
    let factor = STEPS.into_iter().find(|s| s * power >= least);
    factor.unwrap_or(10.0) * power
}

/// A tick with the decimals that tell it from its neighbours.
fn label(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.trim_start_matches('-') {
        digits if digits.chars().all(|c| "0.".contains(c)) => "0".into(),
        _ if text.len() > LONGEST => si::plain(value, 6),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64) -> Vec<String> {
        let axis = Axis::linear((low, high), (0.0, 500.0), 100.0, ("x", "V"));
        axis.ticks.into_iter().map(|t| t.1).collect()
    }

    #[test]
    fn ticks_are_round_and_show_what_distinguishes_them() {
        assert_eq!(labels(0.0, 1.0), ["0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(-1.0, 2.0), ["-1", "0", "1", "2"]);
        assert_eq!(labels(100.0, 100.05).last().unwrap(), "100.05");
        assert_eq!(labels(1e99, 2e99)[0], "1e87");
    }

    #[test]
    fn angles_divide_a_turn_and_decades_have_their_names() {
        let phase = Axis::linear((-200.0, 10.0), (0.0, 200.0), 40.0, ("phase", "°"));
        let phase: Vec<_> = phase.ticks.iter().map(|t| t.1.as_str()).collect();
        assert_eq!(phase, ["-180", "-135", "-90", "-45", "0"]);
        let axis = Axis::logarithmic((1.0, 4.0), (0.0, 700.0), ("frequency", "Hz"));
        let named: Vec<_> = axis.ticks.iter().filter(|t| !t.1.is_empty()).collect();
        let names: Vec<_> = named.iter().map(|t| t.1.as_str()).collect();
        assert_eq!(names, ["10 Hz", "100 Hz", "1 kHz", "10 kHz"]);
        assert_eq!(axis.ticks.len(), 28);
    }

    #[test]
    fn values_have_their_places() {
        let axis = Axis::linear((-1.0, 3.0), (200.0, 100.0), 20.0, ("x", "A"));
        assert_eq!([-1.0, 1.0, 3.0].map(|v| axis.at(v)), [200.0, 150.0, 100.0]);
    }
}
