//! What is to be seen in a picture of waveforms, before anyone draws it.

use super::steps;
use crate::analysis::Characteristic;
use crate::waveform::Waveforms;

/// Width of a panel's plotting area in a drawing, px.
pub const PANEL_WIDTH: usize = 700;

/// Columns into which rows fall in a drawing: half a pixel each, so that the strokes of a dense curve meet.
pub const PANEL_COLUMNS: usize = 2 * PANEL_WIDTH;

/// What stands on the common axis of a figure.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Axis {
    /// Seconds.
    #[default]
    Time,
    /// The decimal logarithm of a frequency in Hz.
    Frequency,
    /// What `.dc` sweeps.
    Swept {
        /// Its name.
        name: String,
        /// Its unit, where it has one.
        unit: &'static str,
    },
}

/// Panels over one axis, top to bottom.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// The headline.
    pub title: String,
    /// What the panels have in common.
    pub axis: Axis,
    /// At least one for a picture.
    pub panels: Vec<Panel>,
}

/// Curves that share a y axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What the y axis shows: `voltage`, `current`, `difference`.
    pub quantity: String,
    /// Its unit, `V` or `A`.
    pub unit: &'static str,
    /// The curves, in the order of the legend.
    pub series: Vec<Series>,
}

/// A named curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// For the legend.
    pub name: String,
    /// The run that it is of, where there are several; empty otherwise.
    pub run: String,
    /// (value on the figure's axis, unit of the panel), the first nondecreasing.
    pub points: Vec<(f64, f64)>,
}

impl Series {
    /// Column j, thinned to so many pixels.
    fn column(waves: &Waveforms, j: usize, name: String, pixels: usize) -> Self {
        Self {
            name,
            run: String::new(),
            points: waves.thinned(j, pixels),
        }
    }
}

impl Figure {
    /// Volts above, amperes below, then a panel for every other unit. Of the rows that fall on one of so many pixels the first, the lowest,
    /// the highest and the last are points.
    #[must_use]
    pub fn of_waveforms(waves: &Waveforms, pixels: usize) -> Self {
        Self::of_runs(&[(String::new(), waves)], pixels)
    }

    /// The same with the curves of several runs, each under its label.
    #[must_use]
    pub fn of_runs(runs: &[(String, &Waveforms)], pixels: usize) -> Self {
        let series = |unit: &str| {
            let mut all = Vec::new();
            for (label, waves) in runs {
                for j in (0..waves.width()).filter(|&j| waves.units[j] == unit) {
                    let name = format!("{} {label}", waves.names[j]);
                    all.push(Series {
                        run: label.clone(),
                        ..Series::column(waves, j, name.trim_end().into(), pixels)
                    });
                }
            }
            all
        };
        let mut units = vec!["V", "A"];
        for unit in runs.iter().flat_map(|(_, waves)| &waves.units) {
            if !units.contains(unit) {
                units.push(unit);
            }
        }
        let panels = units.into_iter().map(|unit| Panel {
            quantity: quantity(unit).into(),
            unit,
            series: series(unit),
        });
        Self {
            title: runs.first().map_or(String::new(), |(_, w)| w.title.clone()),
            axis: Axis::Time,
            panels: panels.filter(|p| !p.series.is_empty()).collect(),
        }
    }

    /// The probes of a `.dc` sweep over what is swept innermost, a run for each combination of the others.
    #[must_use]
    pub fn of_characteristic(of: &Characteristic) -> Self {
        let outer = |row: &[f64]| -> Vec<(String, f64)> {
            let others = of.names.iter().cloned().zip(row.iter().copied());
            others.take(of.swept).skip(1).collect()
        };
        let runs = of.rows.chunk_by(|a, b| a[1..of.swept] == b[1..of.swept]);
        let runs: Vec<(String, &[Vec<f64>])> = runs
            .map(|rows| (steps::label(&outer(&rows[0])), rows))
            .collect();
        let curve = |j: usize, (label, rows): &(String, &[Vec<f64>])| {
            let mut points: Vec<(f64, f64)> = rows.iter().map(|row| (row[0], row[j])).collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            Series {
                name: format!("{} {label}", of.names[j]).trim_end().into(),
                run: label.clone(),
                points,
            }
        };
        let panel = |unit: &'static str| Panel {
            quantity: quantity(unit).into(),
            unit,
            series: (of.swept..of.names.len())
                .filter(|&j| of.units[j] == unit)
                .flat_map(|j| runs.iter().map(move |run| (j, run)))
                .map(|(j, run)| curve(j, run))
                .collect(),
        };
        Self {
            title: of.title.clone(),
            axis: Axis::Swept {
                name: of.names.first().cloned().unwrap_or_default(),
                unit: of.units.first().copied().unwrap_or_default(),
            },
            panels: ["V", "A"]
                .map(panel)
                .into_iter()
                .filter(|panel| !panel.series.is_empty())
                .collect(),
        }
    }

    /// For each named signal a panel with both curves and one with their difference.
    #[must_use]
    pub fn of_comparison(
        waves: &Waveforms,
        reference: &Waveforms,
        difference: &Waveforms,
        reference_name: &str,
        signals: &[String],
        pixels: usize,
    ) -> Self {
        let mut panels = Vec::new();
        for name in signals {
            let Some((ours, delta)) = waves.find(name).zip(difference.find(name)) else {
                continue;
            };
            let mut both = vec![Series::column(waves, ours, format!("{name} circ"), pixels)];
            if let Some(theirs) = reference.find(name) {
                both.push(Series::column(
                    reference,
                    theirs,
                    format!("{name} {reference_name}"),
                    pixels,
                ));
            }
            let unit = waves.units[ours];
            panels.push(Panel {
                quantity: quantity(unit).into(),
                unit,
                series: both,
            });
            let series = vec![Series::column(
                difference,
                delta,
                format!("{name} difference"),
                pixels,
            )];
            panels.push(Panel {
                quantity: "difference".into(),
                unit,
                series,
            });
        }
        Self {
            title: waves.title.clone(),
            axis: Axis::Time,
            panels,
        }
    }

    /// The runs that its curves are of, in order; none where there is one.
    pub(super) fn runs(&self) -> Vec<&str> {
        let mut runs = Vec::new();
        for series in self.panels.iter().flat_map(|panel| &panel.series) {
            if !series.run.is_empty() && !runs.contains(&series.run.as_str()) {
                runs.push(&series.run);
            }
        }
        runs
    }

    /// First and last time over all curves; `None` without a point.
    #[must_use]
    pub fn span(&self) -> Option<(f64, f64)> {
        let points = || {
            self.panels
                .iter()
                .flat_map(|p| &p.series)
                .flat_map(|s| &s.points)
        };
        let first = points().map(|p| p.0).min_by(f64::total_cmp)?;
        let last = points().map(|p| p.0).max_by(f64::total_cmp)?;
        Some((first, last))
    }
}

/// What is measured in a unit.
fn quantity(unit: &str) -> &'static str {
    match unit {
        "V" => "voltage",
        "A" => "current",
        "W" => "power",
        "J" => "energy",
        _ => "value",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_has_a_panel() {
        let waves = Waveforms {
            title: String::new(),
            names: ["i(r1)", "p(r1)", "v(a)", "i(v1)"]
                .map(str::to_owned)
                .into(),
            units: vec!["A", "W", "V", "A"],
            time: vec![0.0],
            values: vec![1.0, 2.0, 3.0, 4.0],
        };
        let panels = Figure::of_waveforms(&waves, PANEL_WIDTH).panels;
        let shown: Vec<_> = panels
            .iter()
            .map(|p| (p.quantity.as_str(), p.series.len()))
            .collect();
        assert_eq!(shown, [("voltage", 1), ("current", 2), ("power", 1)]);
    }
}
