//! Error against run time: the work-precision picture.

use plotters::prelude::*;

use super::svg::{colour, draw_legend, legend_width, on_canvas, refused, text_style};
use super::{PictureError, si, table};

const WIDTH: u32 = 1200;
const HEIGHT: u32 = 900;
const AXIS: u32 = 130;
const TEXT_SIZE: u32 = 24;
/// Errors and times are drawn at least this large, so that a zero has a place on a logarithmic axis.
const SMALLEST: f64 = 1e-17;

/// One method at one setting on one circuit.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Measurement {
    /// The netlist.
    pub circuit: String,
    /// `exact`, `theta`, `euler`, `ngspice:reltol=1e-4`…
    pub method: String,
    /// The ladder that it is a rung of: one line in the picture.
    pub series: String,
    /// The setting on the ladder, `step=1e-6`, `tol=1e-4`, `method=gear;diodes=n0.01`.
    pub parameter: String,
    /// Accepted steps.
    pub steps: u64,
    /// User CPU of the solve alone, s.
    pub cpu_seconds: f64,
    /// Largest error of any signal relative to its amplitude; `None` where the run failed.
    pub max_error: Option<f64>,
    /// Largest RMS error of any signal relative to its amplitude; `None` where the run failed.
    pub rms_error: Option<f64>,
    /// What the error is measured against.
    pub reference: String,
    /// The failure in the failing program's own words.
    pub failure: Option<String>,
}

/// The observed order of a ladder of steps: the error behaves like h to this power.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Order {
    /// The ladder.
    pub series: String,
    /// Of the maximum error.
    pub max: f64,
    /// Of the RMS error.
    pub rms: f64,
}

/// Measurements as CSV: `circuit,method,parameter,steps,cpu_seconds,max_error,rms_error,reference`. A failure has no errors, and its
/// words stand in place of the reference.
#[must_use]
pub fn csv(measurements: &[Measurement]) -> String {
    let mut text =
        String::from("circuit,method,parameter,steps,cpu_seconds,max_error,rms_error,reference\n");
    let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:e}"));
    for m in measurements {
        let failed = m.failure.as_ref().map(|words| format!("failed: {words}"));
        let reference = failed.as_ref().unwrap_or(&m.reference);
        let cells = [
            quoted(&m.circuit),
            quoted(&m.method),
            quoted(&m.parameter),
            m.steps.to_string(),
            format!("{:e}", m.cpu_seconds),
            number(m.max_error),
            number(m.rms_error),
            quoted(reference),
        ];
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.into()
    }
}

/// Measurements as the lines of a table, failures with their words.
#[must_use]
pub fn text(measurements: &[Measurement], orders: &[Order]) -> String {
    let number = |x: Option<f64>| x.map_or_else(|| "failed".into(), |x| si::plain(x, 3));
    let rows: Vec<Vec<String>> = measurements
        .iter()
        .map(|m| {
            vec![
                m.method.clone(),
                m.parameter.clone(),
                m.steps.to_string(),
                si::quantity(m.cpu_seconds, "s", 3),
                number(m.max_error),
                number(m.rms_error),
            ]
        })
        .collect();
    let mut text = table::aligned(
        &[
            "method",
            "parameter",
            "steps",
            "cpu",
            "max error",
            "rms error",
        ],
        &rows,
    );
    for m in measurements {
        if let Some(failure) = &m.failure {
            text.push_str(&format!("{} {}: {failure}\n", m.method, m.parameter));
        }
    }
    for order in orders {
        text.push_str(&format!(
            "{}: observed order {:.2} (rms {:.2})\n",
            order.series, order.max, order.rms
        ));
    }
    text
}

/// The picture: CPU seconds across, largest error down, both logarithmic, one colour per series. Failures have no point.
///
/// # Errors
/// [`PictureError::Empty`] when every run failed, [`PictureError::Draw`] when the drawing library refuses.
pub fn draw(measurements: &[Measurement]) -> Result<String, PictureError> {
    let points: Vec<(&str, f64, f64)> = measurements
        .iter()
        .filter_map(|m| {
            Some((
                m.method.as_str(),
                m.cpu_seconds.max(SMALLEST),
                m.max_error?.max(SMALLEST),
            ))
        })
        .collect();
    let mut methods: Vec<&str> = Vec::new();
    for (method, ..) in &points {
        if !methods.contains(method) {
            methods.push(method);
        }
    }
    let x_range =
        decades(points.iter().map(|p| p.1)).ok_or(PictureError::Empty("no run succeeded"))?;
    let y_range =
        decades(points.iter().map(|p| p.2)).ok_or(PictureError::Empty("no run succeeded"))?;
    let legend = legend_width(methods.iter().copied());
    let title = measurements.first().map_or("", |m| m.circuit.as_str());
    on_canvas(
        WIDTH + legend,
        HEIGHT,
        &format!("{title}: error against run time"),
        |body| {
            let (plot, side) = body.split_horizontally(WIDTH);
            let mut chart = ChartBuilder::on(&plot)
                .set_label_area_size(LabelAreaPosition::Left, AXIS)
                .set_label_area_size(LabelAreaPosition::Bottom, 90)
                .margin(12)
                .build_cartesian_2d(x_range.log_scale(), y_range.log_scale())
                .map_err(refused)?;
            chart
                .configure_mesh()
                .light_line_style(TRANSPARENT)
                .bold_line_style(RGBColor(225, 225, 225))
                .label_style(text_style(TEXT_SIZE))
                .x_desc("user CPU of the solve (s)")
                .y_desc("largest error relative to amplitude")
                .x_label_formatter(&power)
                .y_label_formatter(&power)
                .draw()
                .map_err(refused)?;
            for (k, method) in methods.iter().enumerate() {
                let own = points.iter().filter(|p| p.0 == *method).map(|p| (p.1, p.2));
                chart
                    .draw_series(LineSeries::new(own.clone(), colour(k).stroke_width(2)))
                    .map_err(refused)?;
                let dots = own.map(|at| Circle::new(at, 8, colour(k).filled()));
                chart.draw_series(dots).map_err(refused)?;
            }
            draw_legend(&side, &methods, legend)
        },
    )
}

/// The whole powers of ten around some positive values.
fn decades(values: impl Iterator<Item = f64> + Clone) -> Option<std::ops::Range<f64>> {
    let low = values.clone().min_by(f64::total_cmp)?;
    let high = values.max_by(f64::total_cmp)?;
    let (low, high) = (low.log10().floor(), high.log10().ceil());
    Some(10f64.powf(low)..10f64.powf(high.max(low + 1.0)))
}

fn power(value: &f64) -> String {
    format!("{value:.0e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measurement(method: &str, cpu_seconds: f64, max_error: Option<f64>) -> Measurement {
        Measurement {
            circuit: "rectifier.cir".into(),
            method: method.into(),
            series: method.into(),
            parameter: "step=1e-6".into(),
            steps: 1000,
            cpu_seconds,
            max_error,
            rms_error: max_error.map(|e| e / 2.0),
            reference: "exact".into(),
            failure: max_error.is_none().then(|| "Timestep too small".into()),
        }
    }

    #[test]
    fn every_success_is_a_dot_and_every_failure_has_its_words() {
        let all = [
            measurement("theta", 1e-3, Some(1e-4)),
            measurement("theta", 1e-2, Some(1e-6)),
            measurement("exact", 0.0, Some(0.0)),
            measurement("ngspice", 0.2, None),
        ];
        let svg = draw(&all).unwrap();
        assert_eq!(svg.matches("<circle").count(), 3);
        assert!(svg.contains("user CPU of the solve (s)") && !svg.contains("ngspice"));
        assert!(text(&all, &[]).contains("ngspice step=1e-6: Timestep too small"));
        let csv = csv(&all);
        assert_eq!(
            csv.lines().last(),
            Some("rectifier.cir,ngspice,step=1e-6,1000,2e-1,,,failed: Timestep too small")
        );
        assert!(matches!(draw(&all[3..]), Err(PictureError::Empty(_))));
    }
}
