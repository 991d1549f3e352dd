//! Pictures as SVG.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::figure::{Axis, Figure, PANEL_WIDTH, Panel, Series};
use super::{PictureError, si};

/// Drawing units per CSS pixel: coordinates are whole numbers, so the drawing is made larger than it is shown.
const SCALE: u32 = 2;
const TITLE_HEIGHT: u32 = 80;
const PANEL_HEIGHT: u32 = 440;
const LABEL_WIDTH: u32 = 150;
const AXIS_HEIGHT: u32 = 90;
const FONT: &str = "sans-serif";
const TEXT_SIZE: u32 = 24;
const TITLE_SIZE: u32 = 30;
/// Lines of a legend that fit beside a panel.
const LEGEND_LINES: usize = 13;
const LEGEND_LINE_HEIGHT: i32 = 32;
/// Values are drawn within ±this; nothing is lost on a linear axis, and axis arithmetic stays finite.
const LARGEST: f64 = 1e100;
/// The narrowest y range, relative to the values in it.
const NARROWEST: f64 = 1e-9;

/// Colours that stay apart for colour-blind readers (Okabe and Ito 2008), darker ones first.
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(90, 90, 90),
    RGBColor(140, 86, 75),
];
const GRID: RGBColor = RGBColor(225, 225, 225);
const INK: RGBColor = RGBColor(40, 40, 40);

pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The colour of the k-th curve of a panel.
pub(super) fn colour(k: usize) -> RGBColor {
    COLOURS[k % COLOURS.len()]
}

/// Draws a figure of waveforms: one panel below the other over a common time axis, a legend beside each.
///
/// # Errors
/// [`PictureError::Empty`] without a curve or point, [`PictureError::Draw`] when the drawing library refuses.
pub fn draw(figure: &Figure) -> Result<String, PictureError> {
    let (start, end) = figure
        .span()
        .ok_or(PictureError::Empty("no waveform has a row"))?;
    let names = figure
        .panels
        .iter()
        .flat_map(|p| &p.series)
        .map(|s| s.name.as_str());
    let legend = legend_width(names);
    let n_panels = figure.panels.len() as u32;
    let width = LABEL_WIDTH + PANEL_WIDTH as u32 + legend;
    let height = TITLE_HEIGHT + n_panels * PANEL_HEIGHT + AXIS_HEIGHT;
    on_canvas(width, height, &figure.title, |mut rest| {
        for (k, panel) in figure.panels.iter().enumerate() {
            let last = k + 1 == figure.panels.len();
            let (area, below) = if last {
                (rest.clone(), rest)
            } else {
                rest.split_vertically(PANEL_HEIGHT)
            };
            draw_panel(&area, panel, (figure.axis, start, end), legend, last)?;
            rest = below;
        }
        Ok(())
    })
}

/// A white sheet with a title; `content` gets what is below it.
pub(super) fn on_canvas(
    width: u32,
    height: u32,
    title: &str,
    content: impl FnOnce(Area) -> Result<(), PictureError>,
) -> Result<String, PictureError> {
    let mut svg = String::new();
    {
        let sheet = SVGBackend::with_string(&mut svg, (width, height)).into_drawing_area();
        sheet.fill(&WHITE).map_err(refused)?;
        let (head, body) = sheet.split_vertically(TITLE_HEIGHT);
        let style = text_style(TITLE_SIZE).pos(Pos::new(HPos::Left, VPos::Center));
        let title = shortened(title, width as usize / 17);
        head.draw(&Text::new(title, (30, TITLE_HEIGHT as i32 / 2), style))
            .map_err(refused)?;
        content(body)?;
        sheet.present().map_err(refused)?;
    }
    let drawn = format!("<svg width=\"{width}\" height=\"{height}\"");
    let shown = format!(
        "<svg width=\"{}\" height=\"{}\"",
        width / SCALE,
        height / SCALE
    );
    Ok(svg.replacen(&drawn, &shown, 1))
}

fn draw_panel(
    area: &Area,
    panel: &Panel,
    (axis, start, end): (Axis, f64, f64),
    legend: u32,
    with_axis: bool,
) -> Result<(), PictureError> {
    let (low, high) = y_range(&panel.series);
    let ((time_factor, description), (y_factor, y_prefix)) = match axis {
        Axis::Time => {
            let (factor, prefix) = si::prefix(start.abs().max(end.abs()));
            let y = si::prefix(low.abs().max(high.abs()));
            ((factor, format!("time ({prefix}s)")), y)
        }
        // Decibels and degrees have no prefixes.
        Axis::Frequency => ((1.0, "frequency".into()), (1.0, "")),
    };
    let x_span = if end > start {
        (end - start) / time_factor
    } else {
        1.0
    };
    let x_range = start / time_factor..start / time_factor + x_span;
    let y_span = (high - low) / y_factor;
    let (plot, side) = area.split_horizontally(LABEL_WIDTH + PANEL_WIDTH as u32);
    let mut chart = ChartBuilder::on(&plot)
        .set_label_area_size(LabelAreaPosition::Left, LABEL_WIDTH)
        .set_label_area_size(
            LabelAreaPosition::Bottom,
            if with_axis { AXIS_HEIGHT } else { 0 },
        )
        .margin_top(12)
        .margin_left(16)
        .margin_bottom(16)
        .build_cartesian_2d(x_range, low / y_factor..high / y_factor)
        .map_err(refused)?;
    chart
        .configure_mesh()
        .x_labels(11)
        .y_labels(7)
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(INK)
        .label_style(text_style(TEXT_SIZE))
        .x_desc(if with_axis {
            description
        } else {
            String::new()
        })
        .y_desc(format!("{} ({y_prefix}{})", panel.quantity, panel.unit))
        .x_label_formatter(&|x| match axis {
            Axis::Time => tick(*x, x_span),
            Axis::Frequency => frequency_tick(*x, x_span),
        })
        .y_label_formatter(&|y| tick(*y, y_span))
        .draw()
        .map_err(refused)?;
    for (k, series) in panel.series.iter().enumerate() {
        let points = series
            .points
            .iter()
            .map(|&(t, y)| (t / time_factor, y.clamp(-LARGEST, LARGEST) / y_factor));
        chart
            .draw_series(LineSeries::new(points, colour(k).stroke_width(3)))
            .map_err(refused)?;
    }
    let names: Vec<&str> = panel.series.iter().map(|s| s.name.as_str()).collect();
    draw_legend(&side, &names, legend)
}

/// Names beside short strokes of their colours, top down; what does not fit is counted.
pub(super) fn draw_legend(area: &Area, names: &[&str], width: u32) -> Result<(), PictureError> {
    let style = text_style(TEXT_SIZE).pos(Pos::new(HPos::Left, VPos::Center));
    let shown = if names.len() > LEGEND_LINES {
        LEGEND_LINES - 1
    } else {
        names.len()
    };
    for (k, name) in names.iter().take(shown).enumerate() {
        let y = 34 + k as i32 * LEGEND_LINE_HEIGHT;
        let stroke = PathElement::new([(18, y), (58, y)], colour(k).stroke_width(5));
        area.draw(&stroke).map_err(refused)?;
        let name = shortened(name, (width as usize).saturating_sub(80) / 14);
        area.draw(&Text::new(name, (70, y), style.clone()))
            .map_err(refused)?;
    }
    if shown < names.len() {
        let y = 34 + shown as i32 * LEGEND_LINE_HEIGHT;
        let rest = format!("and {} more", names.len() - shown);
        area.draw(&Text::new(rest, (70, y), style))
            .map_err(refused)?;
    }
    Ok(())
}

/// Room for the longest name, within limits.
pub(super) fn legend_width<'a>(names: impl Iterator<Item = &'a str>) -> u32 {
    let longest = names.map(|n| n.chars().count()).max().unwrap_or(0) as u32;
    (90 + 15 * longest).clamp(160, 560)
}

pub(super) fn text_style(size: u32) -> TextStyle<'static> {
    (FONT, size).into_font().color(&INK)
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
    if size == 0.0 {
        return (-1.0, 1.0);
    }
    let air = if high - low > NARROWEST * size {
        0.06 * (high - low)
    } else {
        0.1 * size
    };
    (low - air, high + air)
}

/// A tick of an axis that spans `span`, with the decimals its steps need.
fn tick(value: f64, span: f64) -> String {
    let decimals = (1.0 - (span / 2.0).log10()).ceil().clamp(0.0, 15.0) as usize;
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    match text {
        "-0" => "0".into(),
        text if text.len() > 9 => si::plain(value, 4),
        text => text.into(),
    }
}

/// A tick at a decimal logarithm of a frequency; over more than two decades the whole ones alone.
fn frequency_tick(logarithm: f64, span: f64) -> String {
    let whole = (logarithm - logarithm.round()).abs() < 1e-6;
    if span > 2.0 && !whole {
        return String::new();
    }
    si::quantity(10f64.powf(logarithm), "Hz", 3)
}

pub(super) fn shortened(text: &str, limit: usize) -> String {
    if text.chars().count() <= limit {
        return text.into();
    }
    text.chars()
        .take(limit.saturating_sub(1))
        .chain(['…'])
        .collect()
}

pub(super) fn refused<E: std::error::Error + Send + Sync>(
    error: DrawingAreaErrorKind<E>,
) -> PictureError {
    PictureError::Draw(error.to_string())
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
        let svg = draw(&Figure::of_waveforms(&waves(&[0.0, 0.002, -0.001]))).unwrap();
        for text in [
            "a &lt;title&gt; &amp; more",
            "time (ms)",
            "voltage (mV)",
            "v(out)",
        ] {
            assert!(svg.contains(text), "{text} in {svg}");
        }
        assert!(!svg.contains("current"));
        assert_eq!(
            svg.matches("<polyline").count() - svg.matches("points=\"\"").count(),
            svg.matches("<polyline").count()
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
            let svg = draw(&Figure::of_waveforms(&waves(values))).unwrap();
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{values:?}");
        }
        assert!(matches!(
            draw(&Figure::of_waveforms(&waves(&[]))),
            Err(PictureError::Empty(_))
        ));
    }

    #[test]
    fn ticks_show_what_distinguishes_them() {
        assert_eq!(tick(0.25, 1.0), "0.25");
        assert_eq!(tick(-0.0, 1.0), "0");
        assert_eq!(tick(200.0, 1000.0), "200");
        assert_eq!(tick(100.02, 0.05), "100.02");
        assert_eq!(tick(1e100, 2e100), "1e100");
    }
}
