//! The curves of a figure.

use super::{Axis, Curve, Page, Panel, axis};
use crate::report::figure::{self, Figure, Series};

/// Rows of a gate that are at neither level, at most, and how near to one a row is that counts as at it (over what is between the levels).
const GATE: (f64, f64) = (0.05, 0.02);
/// Rows below which nothing is taken for a gate.
const FEWEST: usize = 8;

impl Page {
    /// The curves of a figure.
    #[must_use]
    pub fn of_figure(figure: &Figure) -> Self {
        let (axis, place): (Axis, fn(f64) -> f64) = match figure.axis {
            figure::Axis::Time => (axis("time", "s", false), |t| t),
            figure::Axis::Frequency => (axis("frequency", "Hz", true), |x| 10f64.powf(x)),
        };
        let mut page = Self::new(&figure.title, axis);
        // Curves of one run have one column of times.
        let mut latest: Option<(usize, &[(f64, f64)])> = None;
        for panel in &figure.panels {
            let mut curves = Vec::new();
            for series in &panel.series {
                let points = &series.points[..];
                let times = || points.iter().map(|p| p.0);
                let known = latest.filter(|(_, known)| known.iter().map(|p| p.0).eq(times()));
                let fresh = || (page.column(times().map(place)), points);
                let (x, _) = *latest.insert(known.unwrap_or_else(fresh));
                let y = page.column(points.iter().map(|p| p.1));
                curves.push((
                    series,
                    Curve {
                        name: series.name.clone(),
                        x,
                        y,
                        overview: None,
                    },
                ));
            }
            // Gates stand apart from other voltages.
            let may_be_gates = panel.unit == "V" && figure.axis == figure::Axis::Time;
            let (gates, rest): (Vec<_>, Vec<_>) = curves
                .into_iter()
                .partition(|(series, _)| may_be_gates && is_gate(series));
            let quantity = match rest.is_empty() {
                true => &panel.quantity,
                false => "gates",
            };
            for (quantity, curves) in [(panel.quantity.as_str(), rest), (quantity, gates)] {
                if curves.is_empty() {
                    continue;
                }
                page.panels.push(Panel {
                    quantity: quantity.to_owned(),
                    unit: panel.unit,
                    curves: curves.into_iter().map(|(_, curve)| curve).collect(),
                    dots: false,
                });
            }
        }
        page
    }
}

/// Whether a voltage stands at one of two levels nearly always.
fn is_gate(series: &Series) -> bool {
    let values = || series.points.iter().map(|p| p.1);
    let low = values().fold(f64::INFINITY, f64::min);
    let high = values().fold(f64::NEG_INFINITY, f64::max);
    if low >= high || series.points.len() < FEWEST {
        return false;
    }
    let (part, near) = (GATE.0 * series.points.len() as f64, GATE.1 * (high - low));
    let between = values().filter(|v| *v > low + near && *v < high - near);
    // The first rows tell mostly.
    between.take(part as usize + 1).count() as f64 <= part
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(value: impl Fn(f64) -> f64) -> Series {
        let rows = (0..1000).map(|k| f64::from(k) / 1000.0);
        Series {
            name: "v(a)".into(),
            points: rows.map(|t| (t, value(t))).collect(),
        }
    }

    #[test]
    fn a_gate_has_two_levels_and_a_triangle_has_none() {
        let gate = |t: f64| (t * 10.0).fract().clamp(0.499, 0.5) * 5e3;
        assert!(is_gate(&series(gate)));
        assert!(!is_gate(&series(|t| (t * 10.0).fract())));
        assert!(!is_gate(&series(|_| 1.0)));
    }

    #[test]
    fn gates_have_a_panel_of_their_own_beside_other_voltages() {
        let pulse = || series(|t| f64::from(u8::from((t * 10.0).fract() > 0.5)));
        let page = |all: Vec<Series>| {
            let panel = figure::Panel {
                quantity: "voltage".into(),
                unit: "V",
                series: all,
            };
            let page = Page::of_figure(&Figure {
                title: String::new(),
                axis: figure::Axis::Time,
                panels: vec![panel],
            });
            let panels = page.panels.iter().map(|p| p.quantity.clone());
            panels.collect::<Vec<_>>()
        };
        assert_eq!(page(vec![pulse()]), ["voltage"]);
        assert_eq!(page(vec![pulse(), series(f64::sin)]), ["voltage", "gates"]);
    }
}
