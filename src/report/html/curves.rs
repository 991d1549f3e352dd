//! The curves of a figure.

use std::collections::HashSet;

use super::scales::{self, Extent};
use super::{Axis, Curve, Page, Panel, axis};
use crate::report::figure::{self, Figure, Series};

/// The part of the time that a gate is at neither level, at most, and at either, at least; how near to one a value is that counts as at it (over what
/// is between the levels), and the least that is between them (over the larger).
const GATE: Gate = Gate {
    between: 0.05,
    at_either: 0.01,
    near: 0.02,
    apart: 0.1,
};

/// See [`GATE`].
struct Gate {
    between: f64,
    at_either: f64,
    near: f64,
    apart: f64,
}

/// Rows below which nothing is taken for a gate.
const FEWEST: usize = 8;

/// Curves with the series that they show.
type Named<'a> = Vec<(&'a Series, Curve)>;

impl Page {
    /// The curves of a figure, of a unit in several panels where one would flatten another.
    #[must_use]
    pub fn of_figure(figure: &Figure) -> Self {
        match figure.axis {
            figure::Axis::Time => Self::with_panels(figure, by_scale),
            figure::Axis::Frequency | figure::Axis::Swept { .. } => Self::of_panels(figure),
        }
    }

    /// A response over frequency, with measurements in words.
    #[must_use]
    pub fn of_response(figure: &Figure, measured: String) -> Self {
        let mut page = Self::of_panels(figure);
        page.say("Measurements", measured);
        page
    }

    /// The curves of a figure whose panels are as they are to be.
    pub(super) fn of_panels(figure: &Figure) -> Self {
        Self::with_panels(figure, |curves| vec![curves])
    }

    fn with_panels(figure: &Figure, apart: for<'a> fn(Named<'a>) -> Vec<Named<'a>>) -> Self {
        let (axis, place): (Axis, fn(f64) -> f64) = match &figure.axis {
            figure::Axis::Time => (axis("time", "s", false), |t| t),
            figure::Axis::Frequency => (axis("frequency", "Hz", true), |x| 10f64.powf(x)),
            figure::Axis::Swept { name, unit } => (axis(name, unit, false), |x| x),
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
                        run: series.run.clone(),
                        x,
                        y,
                        overview: None,
                    },
                ));
            }
            // Gates and switched nodes stand apart from other voltages.
            let may_be_gates = panel.unit == "V" && figure.axis == figure::Axis::Time;
            // Of several runs all say the same of a signal.
            let others: HashSet<&str> = panel
                .series
                .iter()
                .filter(|series| !may_be_gates || !is_gate(series))
                .map(signal)
                .collect();
            let (rest, gates): (Vec<_>, Vec<_>) = curves
                .into_iter()
                .partition(|(series, _)| others.contains(signal(series)));
            let quantity = match rest.is_empty() {
                true => &panel.quantity,
                false => "voltage at two levels",
            };
            let rest = apart(rest)
                .into_iter()
                .enumerate()
                .map(|(k, curves)| match k {
                    0 => (panel.quantity.clone(), curves),
                    _ => (format!("{} {}", panel.quantity, k + 1), curves),
                });
            for (quantity, curves) in rest.chain([(quantity.to_owned(), gates)]) {
                if curves.is_empty() {
                    continue;
                }
                page.panels.push(Panel {
                    quantity,
                    unit: panel.unit,
                    curves: curves.into_iter().map(|(_, curve)| curve).collect(),
                    dots: false,
                });
            }
        }
        page
    }
}

/// Curves of panels of their own where one would flatten another; of several runs all of a signal share one.
fn by_scale(curves: Named<'_>) -> Vec<Named<'_>> {
    let mut signals: Vec<&str> = curves.iter().map(|(series, _)| signal(series)).collect();
    let mut seen = HashSet::new();
    signals.retain(|name| seen.insert(*name));
    let extent = |name: &&str| {
        let own = curves.iter().filter(|(series, _)| signal(series) == *name);
        Extent::of(own.flat_map(|(series, _)| series.points.iter().map(|p| p.1)))
    };
    let extents: Vec<Extent> = signals.iter().map(extent).collect();
    let panels = scales::panels(&extents);
    let place = |series: &Series| {
        let named = signals.iter().position(|name| *name == signal(series));
        panels
            .iter()
            .position(|own| named.is_some_and(|k| own.contains(&k)))
    };
    let mut apart: Vec<Vec<_>> = panels.iter().map(|_| Vec::new()).collect();
    for (series, curve) in curves {
        if let Some(place) = place(series) {
            apart[place].push((series, curve));
        }
    }
    apart
}

/// The signal that a curve is of, without its run.
fn signal(series: &Series) -> &str {
    series
        .name
        .strip_suffix(&series.run[..])
        .unwrap_or(&series.name)
        .trim_end()
}

/// Whether a voltage stands at one of two levels nearly always.
fn is_gate(series: &Series) -> bool {
    let values = || series.points.iter().map(|p| p.1);
    let low = values().fold(f64::INFINITY, f64::min);
    let high = values().fold(f64::NEG_INFINITY, f64::max);
    let apart = high - low;
    if series.points.len() < FEWEST || apart <= GATE.apart * high.abs().max(low.abs()) {
        return false;
    }
    let near = GATE.near * apart;
    let span = series.points[series.points.len() - 1].0 - series.points[0].0;
    // At the low level, between, at the high one.
    let mut times = [0.0; 3];
    // The first rows tell mostly.
    let stays = series.points.windows(2).all(|pair| {
        if pair.iter().any(|p| p.1.is_nan()) {
            return true;
        }
        let half = 0.5 * (pair[1].0 - pair[0].0);
        for (_, v) in pair {
            let at = usize::from(*v > low + near) + usize::from(*v >= high - near);
            times[at] += half;
        }
        times[1] <= GATE.between * span
    });
    stays && times[0].min(times[2]) >= GATE.at_either * span
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(value: impl Fn(f64) -> f64) -> Series {
        named("v(a)", value)
    }

    fn named(name: &str, value: impl Fn(f64) -> f64) -> Series {
        let rows = (0..1000).map(|k| f64::from(k) / 1000.0);
        Series {
            name: name.into(),
            run: String::new(),
            points: rows.map(|t| (t, value(t))).collect(),
        }
    }

    #[test]
    fn a_gate_has_two_levels_and_a_triangle_has_none() {
        let gate = |t: f64| ((t * 10.0).fract().clamp(0.499, 0.5) - 0.499) * 5e3;
        assert!(is_gate(&series(gate)));
        assert!(!is_gate(&series(|t| (t * 10.0).fract())));
        assert!(!is_gate(&series(|_| 1.0)));
        // A supply that sags a little is none; rows at edges take no time.
        assert!(!is_gate(&series(
            |t| 24.0 - 0.1 * (t * 10.0).fract().round()
        )));
        let mut edges = series(|t| (t * 10.0).fract().round());
        for k in (1..1000).rev() {
            let (t, before) = (edges.points[k].0, edges.points[k - 1].1);
            edges.points.splice(k..k, [(t, before), (t, 0.5)]);
        }
        assert!(is_gate(&edges));
    }

    #[test]
    fn a_small_voltage_has_a_panel_of_its_own() {
        let page = |of: fn(&Figure) -> Page| {
            let ripple = |t: f64| 12.0 + 0.02 * (100.0 * t).sin();
            let run = |label: &str| Series {
                run: label.into(),
                ..named(&format!("v(out) {label}"), ripple)
            };
            let panel = figure::Panel {
                quantity: "voltage".into(),
                unit: "V",
                series: vec![named("v(in)", |_| 400.0), run("r=1"), run("r=2")],
            };
            let page = of(&Figure {
                title: String::new(),
                axis: figure::Axis::Time,
                panels: vec![panel],
            });
            let panels = page.panels.into_iter();
            panels
                .map(|p| (p.quantity, p.curves.into_iter().map(|c| c.name).collect()))
                .collect::<Vec<(String, Vec<String>)>>()
        };
        let name = |name: &str| name.to_owned();
        assert_eq!(
            page(Page::of_figure),
            [
                (
                    name("voltage"),
                    vec![name("v(out) r=1"), name("v(out) r=2")]
                ),
                (name("voltage 2"), vec![name("v(in)")])
            ]
        );
        assert_eq!(page(Page::of_panels).len(), 1);
    }

    #[test]
    fn gates_have_a_panel_of_their_own_beside_other_voltages() {
        let gate = |t: f64| f64::from(u8::from((t * 10.0).fract() > 0.5));
        let pulse = || named("v(g)", gate);
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
        assert_eq!(
            page(vec![pulse(), series(f64::sin)]),
            ["voltage", "voltage at two levels"]
        );
        // A signal that is one in one run of several alone is none.
        let runs = |second: fn(f64) -> f64| {
            let run = |label: &str, value: fn(f64) -> f64| Series {
                run: label.into(),
                ..named(&format!("v(g) {label}"), value)
            };
            page(vec![run("r=1", gate), run("r=2", second), series(f64::sin)])
        };
        assert_eq!(runs(gate), ["voltage", "voltage at two levels"]);
        assert_eq!(runs(f64::sin), ["voltage"]);
    }
}
