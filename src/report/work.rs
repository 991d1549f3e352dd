//! Error against run time: the work-precision picture.

use super::axis::Axis;
use super::sheet::Stroke;
use super::svg::{Legend, frame, titled};
use super::{PictureError, si, table};

/// The corner of the plotting area and its size, px.
const CORNER: (f64, f64) = (84.0, 40.0);
const SIZE: (f64, f64) = (560.0, 400.0);
const MARGIN: f64 = 12.0;
const BELOW: f64 = 48.0;
/// Errors and times are drawn at least this large, so that a zero has a place on a logarithmic axis.
const SMALLEST: f64 = 1e-17;

/// One method at one setting on one circuit.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
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
    /// User CPU of the solve alone, s; of another program that of its process less its start-up.
    pub cpu_seconds: f64,
    /// Largest error of any signal relative to its amplitude; `None` where the run failed.
    pub max_error: Option<f64>,
    /// Largest RMS error of any signal relative to its amplitude; `None` where the run failed.
    pub rms_error: Option<f64>,
    /// What the energy balance leaves, relative to the largest energy; `None` for other programs and where the run failed.
    pub energy_residual: Option<f64>,
    /// Every signal's own; none where the run failed.
    pub signals: Vec<SignalError>,
    /// What the error is measured against.
    pub reference: String,
    /// The failure in the failing program's own words.
    pub failure: Option<String>,
}

/// The error of one signal, relative to its amplitude.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SignalError {
    /// Its name.
    pub name: String,
    /// `V` or `A`.
    pub unit: &'static str,
    /// What errors are relative to, in `unit`.
    pub amplitude: f64,
    /// The largest error.
    pub max_error: f64,
    /// Where it is, s.
    pub max_time: f64,
    /// The root of the mean square.
    pub rms_error: f64,
}

impl Measurement {
    /// The same with these errors, and the largest of them for the whole.
    #[must_use]
    pub fn with(self, signals: Vec<SignalError>) -> Self {
        let largest = |error: fn(&SignalError) -> f64| signals.iter().map(error).reduce(f64::max);
        Self {
            max_error: largest(|s| s.max_error),
            rms_error: largest(|s| s.rms_error),
            signals,
            ..self
        }
    }

    /// The method without its setting.
    fn family(&self) -> &str {
        self.method.split(':').next().unwrap_or(&self.method)
    }
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

/// The errors of every signal as CSV: `circuit,method,parameter,signal,unit,amplitude,max_error,max_time,rms_error,reference`,
/// in the order of the measurements. A failure has no lines.
#[must_use]
pub fn signals_csv(measurements: &[Measurement]) -> String {
    let mut text = String::from(
        "circuit,method,parameter,signal,unit,amplitude,max_error,max_time,rms_error,reference\n",
    );
    for m in measurements {
        for s in &m.signals {
            let cells = [
                quoted(&m.circuit),
                quoted(&m.method),
                quoted(&m.parameter),
                quoted(&s.name),
                s.unit.into(),
                format!("{:e}", s.amplitude),
                format!("{:e}", s.max_error),
                format!("{:e}", s.max_time),
                format!("{:e}", s.rms_error),
                quoted(&m.reference),
            ];
            text.push_str(&cells.join(","));
            text.push('\n');
        }
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

/// Measurements as the lines of a table, failures with their words; below it the signals at the best point of each method.
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
                m.energy_residual
                    .map_or_else(String::new, |x| si::plain(x, 2)),
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
            "energy residual",
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
    text.push_str(&signals_text(measurements));
    text
}

/// A line for each signal at the best point of each method; empty where one signal is all there is.
fn signals_text(measurements: &[Measurement]) -> String {
    let mut best: Vec<&Measurement> = Vec::new();
    for m in measurements.iter().filter(|m| m.signals.len() > 1) {
        match best.iter_mut().find(|b| b.family() == m.family()) {
            Some(b) if (m.max_error, m.cpu_seconds) < (b.max_error, b.cpu_seconds) => *b = m,
            Some(_) => {}
            None => best.push(m),
        }
    }
    if best.is_empty() {
        return String::new();
    }
    let lines = |m: &&Measurement| {
        let name = format!("{} {}", m.method, m.parameter);
        let heads = std::iter::once(name.trim().to_owned()).chain(std::iter::repeat(String::new()));
        let line = |(head, s): (String, &SignalError)| {
            vec![
                head,
                s.name.clone(),
                si::quantity(s.amplitude, s.unit, 4),
                si::plain(s.max_error, 3),
                si::quantity(s.max_time, "s", 6),
                si::plain(s.rms_error, 3),
            ]
        };
        heads.zip(&m.signals).map(line).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<String>> = best.iter().flat_map(lines).collect();
    let header = [
        "best point",
        "signal",
        "amplitude",
        "max error",
        "at",
        "rms error",
    ];
    format!("\n{}", table::aligned(&header, &rows))
}

/// The picture: CPU seconds across, RMS error up, both logarithmic, one colour per series; the rungs of a ladder are joined, those of
/// another method or setting are not. Failures have no point.
///
/// # Errors
/// [`PictureError::Empty`] when every run failed.
pub fn draw(measurements: &[Measurement]) -> Result<String, PictureError> {
    let none = || PictureError::Empty("no run succeeded");
    let done: Vec<(&Measurement, (f64, f64))> = measurements
        .iter()
        .filter_map(|m| {
            let error = m.rms_error?.max(SMALLEST).log10();
            Some((m, (m.cpu_seconds.max(SMALLEST).log10(), error)))
        })
        .collect();
    let mut series: Vec<String> = Vec::new();
    for (m, _) in &done {
        if !series.contains(&m.series) {
            series.push(m.series.clone());
        }
    }
    let x_range = decades(done.iter().map(|d| d.1.0)).ok_or_else(none)?;
    let y_range = decades(done.iter().map(|d| d.1.1)).ok_or_else(none)?;
    let (left, top) = CORNER;
    let (right, bottom) = (left + SIZE.0, top + SIZE.1);
    let across = (
        "CPU (s): of circ the solve, of others the process less its start-up",
        "",
    );
    let across = Axis::logarithmic(x_range, (left, right), across);
    let up = ("RMS error relative to amplitude", "");
    let up = Axis::logarithmic(y_range, (bottom, top), up);
    let entries = series.iter().enumerate();
    let entries = entries.map(|(k, name)| (name.clone(), Stroke::curve(k)));
    let legend = Legend::of(entries.collect(), SIZE.1);
    let title = measurements.first().map_or("", |m| m.circuit.as_str());
    let (width, height) = (right + 2.0 * MARGIN + legend.width(), bottom + BELOW);
    let mut sheet = titled(width, height, &format!("{title}: error against run time"));
    frame(&mut sheet, &across, &up, true);
    let at = |(_, (x, y)): &(&Measurement, (f64, f64))| (across.at(*x), up.at(*y));
    let ladder = |m: &Measurement| (m.series.clone(), m.method.clone());
    for rungs in done.chunk_by(|a, b| ladder(a.0) == ladder(b.0)) {
        let k = series.iter().position(|s| *s == rungs[0].0.series);
        let stroke = Stroke::curve(k.unwrap_or(0));
        sheet.curve(rungs.iter().map(at), stroke);
        for rung in rungs {
            sheet.dot(at(rung), 3.5, stroke.colour);
        }
    }
    legend.draw(&mut sheet, (right + MARGIN, top));
    Ok(sheet.finish())
}

/// The whole powers of ten around some logarithms.
fn decades(values: impl Iterator<Item = f64> + Clone) -> Option<(f64, f64)> {
    let low = values.clone().min_by(f64::total_cmp)?.floor();
    let high = values.max_by(f64::total_cmp)?.ceil();
    Some((low, high.max(low + 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measurement(method: &str, cpu_seconds: f64, max_error: Option<f64>) -> Measurement {
        let blank = Measurement {
            circuit: "rectifier.cir".into(),
            method: method.into(),
            series: method.into(),
            parameter: "step=1e-6".into(),
            steps: 1000,
            cpu_seconds,
            reference: "exact".into(),
            ..Measurement::default()
        };
        let signal = |name: &str, unit, error| SignalError {
            name: name.into(),
            unit,
            amplitude: 5.0,
            max_error: error,
            max_time: 1e-3,
            rms_error: error / 2.0,
        };
        match max_error {
            Some(error) => blank.with(vec![
                signal("v(a,b)", "V", error),
                signal("i(d1)", "A", error / 10.0),
            ]),
            None => Measurement {
                failure: Some("Timestep too small".into()),
                ..blank
            },
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
        assert!(svg.contains("CPU (s): of circ the solve") && !svg.contains("ngspice"));
        // A line for the ladder of two rungs, none from one method to the other.
        let lines: Vec<&str> = svg.split(" d=\"").skip(1).collect();
        let curves = lines.iter().filter(|l| l.contains("stroke-width=\"15\""));
        let drawn = curves.filter(|l| l.split('"').next().is_some_and(|d| d.contains('l')));
        assert_eq!(drawn.count(), 1, "{svg}");
        assert!(text(&all, &[]).contains("ngspice step=1e-6: Timestep too small"));
        let csv = csv(&all);
        assert_eq!(
            csv.lines().last(),
            Some("rectifier.cir,ngspice,step=1e-6,1000,2e-1,,,failed: Timestep too small")
        );
        assert!(matches!(draw(&all[3..]), Err(PictureError::Empty(_))));
    }

    #[test]
    fn the_best_point_of_every_method_has_a_line_for_every_signal() {
        let all = [
            measurement("theta", 1e-3, Some(1e-4)),
            measurement("theta", 1e-2, Some(1e-6)),
            measurement("theta", 5e-3, Some(1e-6)),
            measurement("ngspice:reltol=1e-3", 0.1, Some(1e-2)),
            measurement("ngspice:reltol=1e-4", 0.2, Some(1e-3)),
            measurement("ngspice:reltol=1e-5", 0.2, None),
        ];
        assert_eq!(
            (all[0].max_error, all[0].rms_error),
            (Some(1e-4), Some(5e-5))
        );
        let table = text(&all, &[]);
        let (_, signals) = table.split_once("\n\n").unwrap();
        let lines: Vec<Vec<&str>> = signals
            .lines()
            .map(|l| {
                l.split("  ")
                    .map(str::trim)
                    .filter(|c| !c.is_empty())
                    .collect()
            })
            .collect();
        assert_eq!(lines.len(), 5, "{table}");
        assert_eq!(
            lines[1],
            ["theta step=1e-6", "v(a,b)", "5 V", "1e-6", "1 ms", "5e-7"]
        );
        assert_eq!(lines[2], ["i(d1)", "5 A", "1e-7", "1 ms", "5e-8"]);
        assert_eq!(lines[3][0], "ngspice:reltol=1e-4 step=1e-6");
        let csv = signals_csv(&all);
        assert_eq!(csv.lines().count(), 11);
        assert_eq!(
            csv.lines().nth(1),
            Some("rectifier.cir,theta,step=1e-6,\"v(a,b)\",V,5e0,1e-4,1e-3,5e-5,exact")
        );
    }
}
