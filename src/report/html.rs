//! One self-contained page of a result: curves that can be zoomed and measured, who conducts when, what the run did.
//!
//! The page is `page/page.html` with its style and scripts (drawn by uPlot, bundled with its licence) and the result as JSON, columns as
//! base64 of little-endian doubles, so that what a cursor reads is what was computed. `circPage(element, data)` of `page/page.js` shows
//! such data in any element.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde::Serialize;

use super::figure::{self, Figure};
use super::{PictureError, schematic, sheet, si, text};
use crate::analysis::Measurements;
use crate::integrate::{Change, Event, Places, Run};
use crate::model::Model;

const TEMPLATE: &str = include_str!("page/page.html");
const STYLES: [&str; 2] = [
    include_str!("page/uplot/uPlot.min.css"),
    include_str!("page/page.css"),
];
const SCRIPTS: [&str; 5] = [
    include_str!("page/uplot/uPlot.iife.min.js"),
    include_str!("page/columns.js"),
    include_str!("page/spectrum.js"),
    include_str!("page/chart.js"),
    include_str!("page/page.js"),
];

/// Devices of a strip, those that change first.
const MOST_STRIPS: usize = 40;
/// Rows of a table.
const MOST_ROWS: usize = 10_000;

/// What a page shows.
#[derive(Debug, Clone, Serialize)]
pub struct Page {
    title: String,
    /// The line below the title.
    about: String,
    axis: Axis,
    /// Numbers that curves refer to.
    columns: Vec<Column>,
    panels: Vec<Panel>,
    strips: Vec<Strip>,
    tables: Vec<Table>,
    texts: Vec<Text>,
    /// A picture of the circuit in SVG, see [`schematic::with_both_states`].
    circuit: Option<String>,
}

/// The common axis of all panels.
#[derive(Debug, Clone, Copy, Serialize)]
struct Axis {
    name: &'static str,
    unit: &'static str,
    log: bool,
}

/// Little-endian doubles in base64.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
struct Column(String);

impl Column {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let bytes: Vec<u8> = values.flat_map(f64::to_le_bytes).collect();
        Self(BASE64_STANDARD.encode(bytes))
    }
}

/// Curves that share an axis of values.
#[derive(Debug, Clone, Serialize)]
struct Panel {
    quantity: String,
    unit: &'static str,
    curves: Vec<Curve>,
}

/// A curve, by the numbers of its columns.
#[derive(Debug, Clone, Serialize)]
struct Curve {
    name: String,
    x: usize,
    y: usize,
}

/// When a switch is on or a device conducts.
#[derive(Debug, Clone, Serialize)]
struct Strip {
    name: String,
    on: &'static str,
    off: &'static str,
    /// Before the first change.
    start: Option<bool>,
    times: Vec<f64>,
    states: Vec<u8>,
}

/// Rows of words under a heading.
#[derive(Debug, Clone, Serialize)]
struct Table {
    heading: String,
    header: [&'static str; 2],
    rows: Vec<[String; 2]>,
}

/// Text as it is, under a heading.
#[derive(Debug, Clone, Serialize)]
struct Text {
    heading: &'static str,
    text: String,
}

impl Page {
    /// The curves of a figure.
    #[must_use]
    pub fn of_figure(figure: &Figure) -> Self {
        let (axis, place): (Axis, fn(f64) -> f64) = match figure.axis {
            figure::Axis::Time => (axis("time", "s", false), |t| t),
            figure::Axis::Frequency => (axis("frequency", "Hz", true), |x| 10f64.powf(x)),
        };
        let mut columns = Vec::new();
        let mut panels = Vec::new();
        // Curves of one run have one column of times.
        let mut latest: Option<(usize, &[(f64, f64)])> = None;
        for panel in &figure.panels {
            let mut curves = Vec::new();
            for series in &panel.series {
                let points = &series.points[..];
                let times = || points.iter().map(|p| p.0);
                let known = latest.filter(|(_, known)| known.iter().map(|p| p.0).eq(times()));
                let (x, _) = *latest.insert(known.unwrap_or_else(|| {
                    columns.push(Column::of(times().map(place)));
                    (columns.len() - 1, points)
                }));
                columns.push(Column::of(points.iter().map(|p| p.1)));
                curves.push(Curve {
                    name: series.name.clone(),
                    x,
                    y: columns.len() - 1,
                });
            }
            panels.push(Panel {
                quantity: panel.quantity.clone(),
                unit: panel.unit,
                curves,
            });
        }
        Self {
            title: figure.title.clone(),
            about: format!("circ {}", env!("CARGO_PKG_VERSION")),
            axis,
            columns,
            panels,
            strips: Vec::new(),
            tables: Vec::new(),
            texts: Vec::new(),
            circuit: None,
        }
    }

    /// The same with what the run did: events, impulses, measurements, energies and notes.
    #[must_use]
    pub fn of_run(figure: &Figure, run: &Run, found: &Measurements, model: Option<&Model>) -> Self {
        let places = model.map_or_else(Places::default, Model::places);
        let mut page = Self::of_figure(figure).with_circuit(model);
        page.about = format!("{} · {}", page.about, run.method);
        let (strips, left) = strips(&run.events);
        page.strips = strips;
        let events = run
            .events
            .iter()
            .map(|event| [time(event.t), event.to_string()]);
        let impulses = run.impulses.iter().map(|impulse| {
            let unit = if impulse.name.starts_with("i(") {
                "A·s"
            } else {
                "V·s"
            };
            let area = si::quantity(impulse.area, unit, 5);
            [time(impulse.t), format!("{} {area}", impulse.name)]
        });
        page.tables = vec![
            table("Events", ["time", "what"], events),
            table("Impulses", ["time", "area"], impulses),
        ];
        let mut say = |heading, text: String| {
            if !text.trim().is_empty() {
                page.texts.push(Text { heading, text });
            }
        };
        say("Measurements", found.words());
        say("Run", text::summary(run, places, false));
        say("Plan", run.plan.join("\n"));
        if left > 0 {
            say(
                "Left out",
                format!("{left} more devices and switches change; the events name them"),
            );
        }
        page
    }

    /// The same with a picture of the circuit, where it can be drawn.
    #[must_use]
    pub fn with_circuit(self, model: Option<&Model>) -> Self {
        Self {
            circuit: model.and_then(|model| schematic::with_both_states(model).ok()),
            ..self
        }
    }

    /// The document, without references to anything outside itself.
    ///
    /// # Errors
    /// [`PictureError::Empty`] without a curve, [`PictureError::Page`] where the data are no JSON.
    pub fn html(&self) -> Result<String, PictureError> {
        if self.panels.iter().all(|panel| panel.curves.is_empty()) {
            return Err(PictureError::Empty("no signals"));
        }
        let data = serde_json::to_string(self)?;
        Ok(filled(
            TEMPLATE,
            &[
                ("title", sheet::escaped(&self.title)),
                ("style", STYLES.join("\n")),
                // Within a script nothing else ends it.
                ("data", data.replace("</", "<\\/")),
                ("script", SCRIPTS.join("\n")),
            ],
        ))
    }
}

/// A page, where there is one, with messages above it in a block of this role (WAI-ARIA: `alert`, `note`), and a script at its end.
#[must_use]
pub fn with_messages(page: Option<String>, (role, messages): (&str, &str), script: &str) -> String {
    const BARE: &str = "<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>circ</title><link rel=\"icon\" href=\"data:,\"><style>{{style}}</style>\n\
                        <body><main></main></body></html>\n";
    let page = page.unwrap_or_else(|| filled(BARE, &[("style", STYLES.join("\n"))]));
    let messages = sheet::escaped(messages.trim_end());
    let above = if messages.is_empty() {
        String::new()
    } else {
        format!("<pre role=\"{role}\" class=\"messages\">{messages}</pre>")
    };
    page.replacen("<main", &format!("{above}<main"), 1) + &format!("<script>{script}</script>\n")
}

const fn axis(name: &'static str, unit: &'static str, log: bool) -> Axis {
    Axis { name, unit, log }
}

fn time(t: f64) -> String {
    si::quantity(t, "s", 9)
}

/// At most [`MOST_ROWS`] rows; the heading says where there are more.
fn table(
    heading: &str,
    header: [&'static str; 2],
    rows: impl ExactSizeIterator<Item = [String; 2]>,
) -> Table {
    let all = rows.len();
    let heading = if all > MOST_ROWS {
        format!("{heading}, the first {MOST_ROWS} of {all}")
    } else {
        heading.to_owned()
    };
    Table {
        heading,
        header,
        rows: rows.take(MOST_ROWS).collect(),
    }
}

/// A strip for each switch and device that changes, in order of their first changes, and how many were left out.
fn strips(events: &[Event]) -> (Vec<Strip>, usize) {
    let mut strips: Vec<Strip> = Vec::new();
    let mut places = std::collections::HashMap::new();
    for event in events {
        for change in event.changes.iter() {
            let (on, words) = match change {
                Change::Switch { on, .. } => (*on, ["on", "off"]),
                Change::Device { conducts, .. } => (*conducts, ["conducts", "blocks"]),
                Change::Slides(_) => continue,
            };
            let place = *places.entry(change.name()).or_insert_with(|| {
                strips.push(Strip {
                    name: change.name().to_owned(),
                    on: words[0],
                    off: words[1],
                    start: Some(!on),
                    times: Vec::new(),
                    states: Vec::new(),
                });
                strips.len() - 1
            });
            strips[place].times.push(event.t);
            strips[place].states.push(on.into());
        }
    }
    let left = strips.len().saturating_sub(MOST_STRIPS);
    strips.truncate(MOST_STRIPS);
    (strips, left)
}

/// A template with values in place of `{{name}}`; what stands in values is left as it is.
fn filled(template: &str, values: &[(&str, String)]) -> String {
    let mut document =
        String::with_capacity(values.iter().map(|v| v.1.len()).sum::<usize>() + template.len());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        document.push_str(before);
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        let value = values.iter().find(|(known, _)| *known == name);
        document.push_str(value.map_or("", |(_, value)| value));
        rest = after;
    }
    document + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::Impulse;
    use crate::integrate::event::conducts;
    use crate::waveform::Waveforms;

    fn page(title: &str) -> Page {
        let run = Run {
            waveforms: Waveforms {
                title: title.into(),
                names: vec!["v(out)".into(), "v(in)".into(), "i(r1)".into()],
                units: vec!["V", "V", "A"],
                time: vec![0.0, 0.1],
                values: vec![0.1, 0.2, 0.3, 0.4, 0.5, 0.6],
            },
            events: vec![conducts("d1", 0.05)],
            impulses: vec![Impulse {
                t: 0.05,
                name: "i(d1)".into(),
                area: 1e-6,
            }],
            ..Run::default()
        };
        let figure = Figure::of_waveforms(&run.waveforms, usize::MAX);
        Page::of_run(&figure, &run, &Measurements::default(), None)
    }

    #[test]
    fn the_page_stands_alone_and_its_title_is_text() {
        let html = page("</script><script>alert(1)</script>").html().unwrap();
        assert_eq!(html.matches("</script>").count(), 2);
        assert!(html.contains("<title>&lt;/script&gt;"));
        assert!(!html.contains("src=") && !html.contains("<link rel=\"stylesheet\""));
        assert!(!html.contains("{{"));
    }

    #[test]
    fn columns_are_the_numbers_and_times_stand_once() {
        let page = page("x");
        assert_eq!(page.columns.len(), 4);
        let [volts, amperes] = &page.panels[..] else {
            panic!("{:?}", page.panels)
        };
        assert!(volts.curves.iter().chain(&amperes.curves).all(|c| c.x == 0));
        let bytes = BASE64_STANDARD
            .decode(&page.columns[amperes.curves[0].y].0)
            .unwrap();
        let numbers: Vec<f64> = bytes
            .chunks(8)
            .map(|b| f64::from_le_bytes(b.try_into().unwrap()))
            .collect();
        assert_eq!(numbers, [0.3, 0.6]);
    }

    #[test]
    fn a_strip_begins_with_the_other_state() {
        let page = page("x");
        let strip = &page.strips[0];
        assert_eq!((strip.name.as_str(), strip.start), ("d1", Some(false)));
        assert_eq!(
            (&strip.times[..], &strip.states[..]),
            (&[0.05][..], &[1][..])
        );
        assert_eq!(
            page.tables[1].rows,
            [["50 ms".to_owned(), "i(d1) 1 µA·s".to_owned()]]
        );
    }

    #[test]
    fn without_a_curve_there_is_no_page() {
        let figure = Figure {
            title: String::new(),
            axis: figure::Axis::Time,
            panels: Vec::new(),
        };
        assert!(matches!(
            Page::of_figure(&figure).html(),
            Err(PictureError::Empty(_))
        ));
    }
}
