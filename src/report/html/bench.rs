//! Error against run time.

use super::super::si;
use super::super::work::Measurement;
use super::{Axis, Curve, Page, Panel, Table};

impl Page {
    /// The largest and the RMS error over the CPU time, a curve for each ladder, and a table of all measurements.
    #[must_use]
    pub fn of_measurements(title: &str, measurements: &[Measurement]) -> Self {
        let axis = Axis {
            name: "CPU of the solve".into(),
            unit: "s",
            log: true,
        };
        let mut page = Self::new(title, axis);
        for (quantity, error) in [
            (
                "largest error",
                (|m| m.max_error) as fn(&Measurement) -> Option<f64>,
            ),
            ("RMS error", |m| m.rms_error),
        ] {
            let panel = page.ladders(measurements, quantity, error);
            page.panels.push(panel);
        }
        let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.1e}"));
        let row = |m: &Measurement| {
            vec![
                format!("{} {}", m.method, m.parameter),
                m.steps.to_string(),
                si::quantity(m.cpu_seconds, "s", 3),
                number(m.max_error),
                number(m.rms_error),
                m.failure.clone().unwrap_or_else(|| m.reference.clone()),
            ]
        };
        let header = [
            "method",
            "steps",
            "CPU",
            "largest error",
            "RMS error",
            "reference, or why it failed",
        ];
        page.tables = vec![Table::new(
            "Measurements",
            &header,
            measurements.iter().map(row),
        )];
        page
    }

    fn ladders(
        &mut self,
        measurements: &[Measurement],
        quantity: &str,
        error: fn(&Measurement) -> Option<f64>,
    ) -> Panel {
        let mut names: Vec<&str> = Vec::new();
        for m in measurements {
            if !names.contains(&m.series.as_str()) {
                names.push(&m.series);
            }
        }
        let mut curves = Vec::new();
        for name in names {
            let ladder = measurements.iter().filter(|m| m.series == name);
            let point = |m: &Measurement| Some((m.cpu_seconds, error(m)?));
            let mut points: Vec<(f64, f64)> = ladder.filter_map(point).collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            if points.is_empty() {
                continue;
            }
            curves.push(Curve {
                name: name.to_owned(),
                run: String::new(),
                x: self.column(points.iter().map(|p| p.0)),
                y: self.column(points.iter().map(|p| p.1)),
                overview: None,
            });
        }
        Panel {
            quantity: quantity.to_owned(),
            unit: "",
            curves,
            dots: true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ladder_is_a_curve_in_the_order_of_its_times_and_failures_are_in_the_table() {
        let rung = |series: &str, cpu_seconds, max_error| Measurement {
            series: series.into(),
            cpu_seconds,
            max_error,
            failure: max_error.is_none().then(|| "Timestep too small".into()),
            ..Measurement::default()
        };
        let all = [
            rung("theta", 1e-2, Some(1e-6)),
            rung("theta", 1e-3, Some(1e-4)),
            rung("ngspice", 1.0, None),
        ];
        let page = Page::of_measurements("buck", &all);
        let curves = &page.panels[0].curves;
        assert_eq!(curves.len(), 1);
        let times = super::super::Column::Numbers(vec![1e-3, 1e-2]);
        assert_eq!(page.columns[curves[0].x], times);
        assert_eq!(page.tables[0].rows[2][5], "Timestep too small");
    }
}
