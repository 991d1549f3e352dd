//! Character plots, sized to a terminal.

use textplots::{Chart, LabelBuilder, LabelFormat, Plot, Shape};

use super::si;
use crate::waveform::Waveforms;

/// Dots per character across and down (braille).
const DOTS: (u32, u32) = (2, 4);
/// Characters right of a chart that its y labels take.
const LABEL_WIDTH: usize = 12;
/// The narrowest chart, in characters.
const MIN_WIDTH: usize = 24;
/// The lowest and the tallest chart, in lines.
const CHART_LINES: (usize, usize) = (4, 12);
/// Lines around a chart: its heading, one that the canvas adds, the time axis, a blank.
const FRAME_LINES: usize = 4;
/// Values are drawn within ±this, in the signal's prefix.
const LARGEST: f64 = 1e30;

/// One chart per signal, as many as fit into `lines` lines of `columns` characters; a last line counts the others.
///
/// Empty when there is no row.
#[must_use]
pub fn plot(waves: &Waveforms, columns: usize, lines: usize) -> String {
    let (Some(&start), Some(&end)) = (waves.time.first(), waves.time.last()) else {
        return String::new();
    };
    let shown = (lines / (CHART_LINES.0 + FRAME_LINES))
        .clamp(1, waves.width().max(1))
        .min(waves.width());
    if shown == 0 {
        return String::new();
    }
    let rows = (lines / shown)
        .saturating_sub(FRAME_LINES)
        .clamp(CHART_LINES.0, CHART_LINES.1);
    let width = columns.saturating_sub(LABEL_WIDTH).max(MIN_WIDTH);
    let mut text = String::new();
    for j in 0..shown {
        text.push_str(&waves.names[j]);
        text.push('\n');
        text.push_str(&chart(waves, j, (start, end), width, rows));
        text.push('\n');
    }
    if shown < waves.width() {
        let rest = waves.names[shown..].join(" ");
        text.push_str(&format!("not shown: {rest}\n"));
    }
    text
}

fn chart(
    waves: &Waveforms,
    j: usize,
    (start, end): (f64, f64),
    width: usize,
    rows: usize,
) -> String {
    let unit = waves.units[j];
    let largest = waves.column(j).map(f64::abs).fold(0.0, f64::max);
    let (factor, _) = si::prefix(largest);
    let (time_factor, time_prefix) = si::prefix(start.abs().max(end.abs()));
    let scaled = |t: f64, y: f64| {
        (
            ((t - start) / time_factor) as f32,
            (y / factor).clamp(-LARGEST, LARGEST) as f32,
        )
    };
    let points: Vec<(f32, f32)> = waves
        .thinned(j, width * DOTS.0 as usize)
        .into_iter()
        .map(|(t, y)| scaled(t, y))
        .collect();
    let low = points.iter().map(|p| p.1).fold(f32::INFINITY, f32::min);
    let high = points.iter().map(|p| p.1).fold(f32::NEG_INFINITY, f32::max);
    // A chart needs a range: a constant stands in the middle of one.
    let half = if high > low {
        0.0
    } else {
        (0.5 * high.abs()).max(0.5)
    };
    let span = (((end - start) / time_factor) as f32).max(f32::MIN_POSITIVE);
    let (width, height) = (width as u32 * DOTS.0, rows as u32 * DOTS.1);
    let shape = Shape::Lines(&points);
    let mut chart = Chart::new_with_y_range(width, height, 0.0, span, low - half, high + half);
    let chart = chart
        .x_label_format(LabelFormat::Custom(Box::new(move |t| {
            let time = (f64::from(t) * time_factor + start) / time_factor;
            format!("{} {time_prefix}s", si::plain(time, 5))
        })))
        .y_label_format(LabelFormat::Custom(Box::new(move |y| {
            si::quantity(f64::from(y) * factor, unit, 4)
        })))
        .lineplot(&shape);
    chart.axis();
    chart.figures();
    chart.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waves(n_signals: usize) -> Waveforms {
        let time: Vec<f64> = (0..=200).map(|k| f64::from(k) * 1e-4).collect();
        let values = time
            .iter()
            .flat_map(|t| (0..n_signals).map(move |j| (314.0 * t).sin() / (j + 1) as f64))
            .collect();
        Waveforms {
            title: String::new(),
            names: (0..n_signals).map(|j| format!("v({j})")).collect(),
            units: vec!["V"; n_signals],
            time,
            values,
        }
    }

    #[test]
    fn fits_the_terminal_and_counts_the_rest() {
        let text = plot(&waves(5), 80, 24);
        assert!(text.lines().all(|l| l.chars().count() <= 80), "{text}");
        assert!(text.lines().count() <= 26, "{text}");
        assert!(text.contains("20 ms") && text.contains("1 V"), "{text}");
        assert!(text.ends_with("not shown: v(3) v(4)\n"), "{text}");
    }

    #[test]
    fn nothing_and_constants_and_tiny_terminals_are_fine() {
        assert_eq!(plot(&Waveforms::default(), 80, 24), "");
        let constant = Waveforms {
            values: vec![0.0; 201],
            ..waves(1)
        };
        assert!(plot(&constant, 0, 0).contains("v(0)"));
        let huge = Waveforms {
            values: vec![f64::MAX; 201],
            ..waves(1)
        };
        assert!(plot(&huge, 80, 24).contains("v(0)"));
    }
}
