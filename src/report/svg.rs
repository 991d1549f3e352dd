//! Pictures of waveforms as SVG.

use super::PictureError;
use super::axis::Axis;
use super::figure::{self, Figure, PANEL_WIDTH, Panel, Series};
use super::sheet::{Anchor, GRID, INK, Sheet, Stroke, shortened, width_of};

const MARGIN: f64 = 12.0;
const TITLE_HEIGHT: f64 = 40.0;
/// Height of a panel's plotting area, and of the gap to the next.
const PANEL: (f64, f64) = (210.0, 18.0);
/// Room left of a plotting area for its labels and title.
const LABELS: f64 = 72.0;
/// Room below the last panel for the common axis.
const BELOW: f64 = 48.0;
const TEXT: f64 = 12.0;
const TITLE: f64 = 15.0;
/// Distance of the lines of a legend, and the stroke before a name.
const LEGEND_LINE: f64 = 16.0;
const SAMPLE: f64 = 26.0;
/// Values are drawn within ±this; nothing is lost on a linear axis, and axis arithmetic stays finite.
const LARGEST: f64 = 1e100;
/// A curve of this filling and more is drawn pale, px/px.
const FILLS: f64 = 30.0;
/// The narrowest y range, relative to the values in it.
const NARROWEST: f64 = 1e-9;

/// Draws a figure: one panel below the other over a common axis, a legend beside each.
///
/// # Errors
/// [`PictureError::Empty`] without a curve or point.
pub fn draw(figure: &Figure) -> Result<String, PictureError> {
    let (start, end) = figure
        .span()
        .ok_or(PictureError::Empty("no waveform has a row"))?;
    let end = if end > start {
        end
    } else {
        start + start.abs().max(1.0)
    };
    let left = MARGIN + LABELS;
    let right = left + PANEL_WIDTH as f64;
    let across = match &figure.axis {
        figure::Axis::Time => Axis::linear((start, end), (left, right), 80.0, ("time", "s")),
        figure::Axis::Frequency => {
            Axis::logarithmic((start, end), (left, right), ("frequency", "Hz"))
        }
        figure::Axis::Swept { name, unit } => {
            Axis::linear((start, end), (left, right), 80.0, (name, unit))
        }
    };
    let runs = figure.runs();
    let legend = |panel: &Panel| {
        let names = panel.series.iter().map(|s| s.name.clone());
        let strokes = strokes(panel, &runs);
        Legend::of(names.zip(strokes).collect(), PANEL.0)
    };
    let legends: Vec<Legend> = figure.panels.iter().map(legend).collect();
    let beside = legends.iter().map(Legend::width).fold(0.0, f64::max);
    let n_panels = figure.panels.len() as f64;
    let width = right + MARGIN + beside + MARGIN;
    let height = TITLE_HEIGHT + n_panels * (PANEL.0 + PANEL.1) - PANEL.1 + BELOW;
    let mut sheet = titled(width, height, &figure.title);
    let mut top = TITLE_HEIGHT;
    for (k, (panel, legend)) in figure.panels.iter().zip(&legends).enumerate() {
        let what = (panel.quantity.as_str(), panel.unit);
        let up = Axis::linear(y_range(&panel.series), (top + PANEL.0, top), 36.0, what);
        frame(&mut sheet, &across, &up, k + 1 == figure.panels.len());
        let curves = panel.series.iter().zip(&legend.entries);
        let mut curves: Vec<_> = curves
            .map(|(series, (_, stroke))| {
                let points = series.points.iter();
                let at = |&(x, y): &(f64, f64)| (across.at(x), up.at(y.clamp(-LARGEST, LARGEST)));
                let points: Vec<_> = points.map(at).collect();
                (filling(&points), points, *stroke)
            })
            .collect();
        // A signal is pale in all runs or in none.
        let places = places(panel);
        let filled = (places.iter().zip(&curves)).filter(|(_, curve)| curve.0 > FILLS);
        let filled: Vec<usize> = filled.map(|(place, _)| *place).collect();
        for (place, (_, _, stroke)) in places.iter().zip(&mut curves) {
            stroke.pale = filled.contains(place);
        }
        // What fills an area lies beneath what is a line.
        curves.sort_by(|one, other| other.0.total_cmp(&one.0));
        for (_, points, stroke) in curves {
            // Where values are no numbers a curve is broken; between two breaks it may be a point.
            for part in points.split(|(_, y)| y.is_nan()) {
                match part {
                    [] => {}
                    [alone] => sheet.dot(*alone, stroke.width, stroke.colour),
                    _ => sheet.curve(part.iter().copied(), stroke),
                }
            }
        }
        legend.draw(&mut sheet, (right + MARGIN, top));
        top += PANEL.0 + PANEL.1;
    }
    Ok(sheet.finish())
}

/// By curve of a panel: its place among those of its run.
fn places(panel: &Panel) -> Vec<usize> {
    let before = |k: usize| {
        let run = &panel.series[k].run;
        let same = panel.series[..k].iter().filter(|other| other.run == *run);
        same.count()
    };
    (0..panel.series.len()).map(before).collect()
}

/// How the curves of a panel are drawn: by run where there are several.
fn strokes(panel: &Panel, runs: &[&str]) -> Vec<Stroke> {
    let places = places(panel);
    let strokes = panel.series.iter().enumerate().map(|(k, series)| {
        let Some(run) = runs.iter().position(|run| *run == series.run) else {
            return Stroke::curve(k);
        };
        Stroke::of_run((run, runs.len()), places[k])
    });
    strokes.collect()
}

/// How far a curve goes up and down, px for each pixel of the panel's width: a line has little of it, what switches fast fills an area.
fn filling(points: &[(f64, f64)]) -> f64 {
    let steps = points.iter().zip(points.iter().skip(1));
    let ways = steps.map(|(a, b)| (b.1 - a.1).abs());
    ways.filter(|way| !way.is_nan()).sum::<f64>() / PANEL_WIDTH as f64
}

/// A sheet with a headline.
pub(super) fn titled(width: f64, height: f64, title: &str) -> Sheet {
    let mut sheet = Sheet::new(width, height, title);
    let shown = shortened(title, width - 2.0 * MARGIN, TITLE);
    sheet.text(&shown, (MARGIN, TITLE_HEIGHT / 2.0), TITLE, Anchor::Start);
    sheet
}

/// The grid between two axes, with their labels; the lower one's only where asked for.
pub(super) fn frame(sheet: &mut Sheet, across: &Axis, up: &Axis, labelled: bool) {
    let ((left, right), (bottom, top)) = (across.ends(), up.ends());
    let (grid, faint) = (Stroke::plain(GRID, 1.0), Stroke::plain("#f2f2f2", 1.0));
    let of = |label: &str| if label.is_empty() { faint } else { grid };
    for (value, label) in &across.ticks {
        let x = across.at(*value);
        sheet.line((x, bottom), (x, top), of(label));
        if labelled {
            sheet.text(label, (x, bottom + 13.0), TEXT, Anchor::Middle);
        }
    }
    for (value, label) in &up.ticks {
        let y = up.at(*value);
        sheet.line((left, y), (right, y), of(label));
        sheet.text(label, (left - 7.0, y), TEXT, Anchor::End);
    }
    let ink = Stroke::plain(INK, 1.0);
    sheet.line((left, bottom), (right, bottom), ink);
    sheet.line((left, bottom), (left, top), ink);
    if labelled {
        let middle = (f64::midpoint(left, right), bottom + 34.0);
        sheet.text(&across.title, middle, TEXT, Anchor::Middle);
    }
    sheet.upwards(&up.title, (MARGIN + 6.0, f64::midpoint(bottom, top)), TEXT);
}

/// Names beside strokes as their curves are drawn, in as many columns as the height asks for.
#[derive(Debug)]
pub(super) struct Legend {
    entries: Vec<(String, Stroke)>,
    lines: usize,
    column: f64,
}

impl Legend {
    /// For names and how their curves are drawn, in order.
    pub(super) fn of(entries: Vec<(String, Stroke)>, height: f64) -> Self {
        let widths = entries.iter().map(|(name, _)| width_of(name, TEXT));
        let widest = widths.fold(0.0, f64::max);
        let lines = ((height / LEGEND_LINE) as usize).max(1);
        Self {
            entries,
            lines,
            column: SAMPLE + 8.0 + widest + MARGIN,
        }
    }

    /// Room that it takes, px.
    pub(super) fn width(&self) -> f64 {
        self.column * self.entries.len().div_ceil(self.lines) as f64
    }

    /// Draws it below and right of a point.
    pub(super) fn draw(&self, sheet: &mut Sheet, (left, top): (f64, f64)) {
        for (k, (name, stroke)) in self.entries.iter().enumerate() {
            let x = left + (k / self.lines) as f64 * self.column;
            let y = top + LEGEND_LINE * (0.5 + (k % self.lines) as f64);
            let stroke = Stroke {
                width: 2.5,
                ..*stroke
            };
            sheet.line((x, y), (x + SAMPLE, y), stroke);
            sheet.text(name, (x + SAMPLE + 8.0, y), TEXT, Anchor::Start);
        }
    }
}

/// The values' range with a little air; never empty.
fn y_range(series: &[Series]) -> (f64, f64) {
    let values = || {
        series
            .iter()
            .flat_map(|s| &s.points)
            .map(|p| p.1.clamp(-LARGEST, LARGEST))
    };
    let low = values().fold(f64::INFINITY, f64::min);
    let high = values().fold(f64::NEG_INFINITY, f64::max);
    let size = low.abs().max(high.abs());
    if low > high || size < 1.0 / LARGEST {
        return (-1.0, 1.0);
    }
    let air = if high - low > NARROWEST * size {
        0.06 * (high - low)
    } else {
        0.1 * size
    };
    (low - air, high + air)
}

#[cfg(test)]
mod tests {
    use super::super::figure::Figure;
    use super::*;
    use crate::waveform::Waveforms;

    fn waves(values: &[f64]) -> Waveforms {
        Waveforms {
            title: "a <title> & more".into(),
            names: vec!["v(out)".into()],
            units: vec!["V"],
            time: (0..values.len()).map(|k| k as f64 * 1e-3).collect(),
            values: values.to_vec(),
        }
    }

    #[test]
    fn a_picture_names_its_axes_with_prefixed_units() {
        let svg = draw(&Figure::of_waveforms(
            &waves(&[0.0, 0.002, -0.001]),
            PANEL_WIDTH,
        ))
        .unwrap();
        for text in [
            "a &lt;title&gt; &amp; more",
            "time (ms)",
            "voltage (mV)",
            "v(out)",
        ] {
            assert!(svg.contains(text), "{text} in {svg}");
        }
        assert!(!svg.contains("current"));
    }

    #[test]
    fn a_million_rows_of_many_signals_stay_a_small_file() {
        let names: Vec<String> = (0..16).map(|k| format!("v(x1.x2.node{k})")).collect();
        let time: Vec<f64> = (0..62_500).map(|k| f64::from(k) * 1e-6).collect();
        let ringing = |t: f64, k: usize| (t * 1e5).sin() * (k + 1) as f64;
        let values = time
            .iter()
            .flat_map(|&t| (0..16).map(move |k| ringing(t, k)));
        let waves = Waveforms {
            title: String::new(),
            units: vec!["V"; names.len()],
            values: values.collect(),
            names,
            time,
        };
        let svg = draw(&Figure::of_waveforms(&waves, PANEL_WIDTH)).unwrap();
        assert!(svg.len() < 350_000, "{} bytes", svg.len());
        for name in &waves.names {
            assert!(svg.contains(&format!(">{name}<")), "{name}");
        }
    }

    #[test]
    fn a_curve_is_broken_where_values_are_no_numbers() {
        let rows = [0.0, 1.0, f64::NAN, 1.0, f64::NAN, f64::NAN, 0.0, 1.0];
        let figure = Figure::of_waveforms(&waves(&rows), PANEL_WIDTH);
        let svg = draw(&figure).unwrap();
        assert_eq!(svg.matches("stroke-linejoin").count(), 2, "{svg}");
        assert_eq!(svg.matches("<circle").count(), 1, "{svg}");
        let nothing = Figure::of_waveforms(&waves(&[f64::NAN; 2]), PANEL_WIDTH);
        assert!(!draw(&nothing).unwrap().contains("NaN"));
    }

    #[test]
    fn what_fills_an_area_is_drawn_pale_and_first() {
        let rows = 20_000;
        let waves = Waveforms {
            names: vec!["v(out)".into(), "v(sw)".into()],
            units: vec!["V", "V"],
            time: (0..rows).map(f64::from).collect(),
            values: (0..rows)
                .flat_map(|k| [5.0, f64::from(10 * (k % 2))])
                .collect(),
            ..Waveforms::default()
        };
        let svg = draw(&Figure::of_waveforms(&waves, figure::PANEL_COLUMNS)).unwrap();
        let curves: Vec<&str> = svg.split("stroke-linejoin").skip(1).collect();
        let is_pale = |curve: &str| curve[..curve.find("/>").unwrap()].contains("stroke-opacity");
        assert_eq!(curves.len(), 2);
        assert!(is_pale(curves[0]) && !is_pale(curves[1]));
        // In the legend all are as they are named.
        assert_eq!(svg.matches("stroke-opacity").count(), 1);
    }

    #[test]
    fn a_signal_is_pale_in_all_runs_or_in_none() {
        let series = |run: &str, height: f64, rows: u32| Series {
            name: format!("v(sw) {run}"),
            run: run.into(),
            points: (0..rows)
                .map(|k| (f64::from(k), height * f64::from(k % 2)))
                .collect(),
        };
        let waves = Waveforms {
            names: vec!["v(sw)".into()],
            units: vec!["V"],
            time: vec![0.0, 1.0],
            values: vec![0.0, 1.0],
            ..Waveforms::default()
        };
        let mut figure = Figure::of_waveforms(&waves, PANEL_WIDTH);
        let pale = |figure: &Figure| draw(figure).unwrap().matches("stroke-opacity").count();
        figure.panels[0].series = vec![series("r=1", 10.0, 2), series("r=2", 1.0, 2)];
        assert_eq!(pale(&figure), 0);
        figure.panels[0].series = vec![series("r=1", 10.0, 20_000), series("r=2", 1.0, 2)];
        assert_eq!(pale(&figure), 2);
    }

    #[test]
    fn a_run_has_one_colour_in_all_panels() {
        let waves = Waveforms {
            names: vec!["v(a)".into(), "v(b)".into(), "i(l)".into()],
            units: vec!["V", "V", "A"],
            time: vec![0.0, 1.0],
            values: vec![1.0; 6],
            ..Waveforms::default()
        };
        let runs = [("r=1".to_owned(), &waves), ("r=2".to_owned(), &waves)];
        let figure = Figure::of_runs(&runs, figure::PANEL_COLUMNS);
        let runs = figure.runs();
        let of = |panel: usize| strokes(&figure.panels[panel], &runs);
        assert_eq!(
            of(1),
            [Stroke::of_run((0, 2), 0), Stroke::of_run((1, 2), 0)]
        );
        let volts = of(0);
        assert_eq!(volts[0].colour, volts[1].colour);
        assert_ne!(volts[0].dash, volts[1].dash);
        assert_eq!(volts[2], of(1)[1]);
    }

    #[test]
    fn many_runs_have_a_colour_each() {
        let waves = waves(&[0.0, 1.0]);
        let label = |k: usize| (format!("r={k}"), &waves);
        let runs: Vec<_> = (0..20).map(label).collect();
        let svg = draw(&Figure::of_runs(&runs, PANEL_WIDTH)).unwrap();
        let of_curve = |curve: &str| curve.split("stroke=\"").nth(1).unwrap()[..7].to_owned();
        let mut colours: Vec<String> = svg.split("stroke-linejoin").skip(1).map(of_curve).collect();
        assert_eq!(
            (colours.len(), &colours[0][..], &colours[19][..]),
            (20, "#0d0887", "#f48849")
        );
        colours.sort();
        colours.dedup();
        assert_eq!(colours.len(), 20);
    }

    #[test]
    fn a_legend_is_on_its_sheet_however_many_curves_there_are() {
        let entries = (0..100).map(|k| (format!("v({k})"), Stroke::curve(k)));
        let legend = Legend::of(entries.collect(), 210.0);
        let mut sheet = Sheet::new(1.0, 1.0, "");
        legend.draw(&mut sheet, (0.0, 0.0));
        let svg = sheet.finish();
        let places = |letter: &str| {
            let texts = svg.split("<text ").skip(1);
            let of = texts.map(|t| t.split(letter).nth(1).unwrap().split('"').next().unwrap());
            of.map(|n| n.parse::<f64>().unwrap()).fold(0.0, f64::max)
        };
        assert!(
            places(" y=\"") <= 210.0 && places("x=\"") + width_of("v(99)", TEXT) <= legend.width()
        );
    }

    #[test]
    fn extreme_values_are_drawn_in_finite_time() {
        for values in [
            &[f64::MAX, f64::MIN][..],
            &[1e15, 1e15 + 0.125],
            &[5e-324, 0.0],
            &[0.0],
            &[1e-30, 2e-30],
            &[-7.0, -7.0],
        ] {
            let svg = draw(&Figure::of_waveforms(&waves(values), PANEL_WIDTH)).unwrap();
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{values:?}");
        }
        assert!(matches!(
            draw(&Figure::of_waveforms(&waves(&[]), PANEL_WIDTH)),
            Err(PictureError::Empty(_))
        ));
    }
}
