//! One self-contained page of a result: curves that can be zoomed and measured, who conducts when, what the run did.
//!
//! The page is `page/page.html` with its style and scripts (drawn by uPlot, bundled with its licence) and the result as JSON, columns as
//! base64 of little-endian doubles, so that what a cursor reads is what was computed. `circPage(element, data)` of `page/page.js` shows
//! such data in any element.

mod bench;
mod check;
mod comparison;
mod run;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde::Serialize;

use super::figure::{self, Figure};
use super::{PictureError, schematic, sheet};
use crate::model::Model;

const TEMPLATE: &str = include_str!("../page/page.html");
const STYLES: [&str; 2] = [
    include_str!("../page/uplot/uPlot.min.css"),
    include_str!("../page/page.css"),
];
const SCRIPTS: [&str; 5] = [
    include_str!("../page/uplot/uPlot.iife.min.js"),
    include_str!("../page/columns.js"),
    include_str!("../page/spectrum.js"),
    include_str!("../page/chart.js"),
    include_str!("../page/page.js"),
];

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
    /// Points are marked, and their axis is logarithmic.
    dots: bool,
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
    header: Vec<&'static str>,
    rows: Vec<Vec<String>>,
}

/// Text as it is, under a heading.
#[derive(Debug, Clone, Serialize)]
struct Text {
    heading: &'static str,
    text: String,
}

impl Page {
    /// An empty page.
    fn new(title: &str, axis: Axis) -> Self {
        Self {
            title: title.to_owned(),
            about: format!("circ {}", env!("CARGO_PKG_VERSION")),
            axis,
            columns: Vec::new(),
            panels: Vec::new(),
            strips: Vec::new(),
            tables: Vec::new(),
            texts: Vec::new(),
            circuit: None,
        }
    }

    /// A text, where there is any.
    fn say(&mut self, heading: &'static str, text: String) {
        if !text.trim().is_empty() {
            self.texts.push(Text { heading, text });
        }
    }

    /// A column more, by its number.
    fn column(&mut self, values: impl Iterator<Item = f64>) -> usize {
        self.columns.push(Column::of(values));
        self.columns.len() - 1
    }

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
                curves.push(Curve {
                    name: series.name.clone(),
                    x,
                    y,
                });
            }
            page.panels.push(Panel {
                quantity: panel.quantity.clone(),
                unit: panel.unit,
                curves,
                dots: false,
            });
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
    /// [`PictureError::Empty`] where there is nothing to show, [`PictureError::Page`] where the data are no JSON.
    pub fn html(&self) -> Result<String, PictureError> {
        let has_curves = self.panels.iter().any(|panel| !panel.curves.is_empty());
        if !has_curves && self.tables.is_empty() && self.texts.is_empty() {
            return Err(PictureError::Empty("no signals"));
        }
        let data = serde_json::to_string(self)?;
        Ok(filled(
            TEMPLATE,
            &[
                ("title", sheet::escaped(&self.title)),
                ("style", STYLES.join("\n")),
                // Within a script a text like `</script>` ends it, and `<!--` hides its end.
                ("data", data.replace('<', "\\u003c")),
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

impl Table {
    /// At most [`MOST_ROWS`] rows; the heading says where there are more.
    fn new(
        heading: &str,
        header: &[&'static str],
        rows: impl ExactSizeIterator<Item = Vec<String>>,
    ) -> Self {
        let all = rows.len();
        let heading = if all > MOST_ROWS {
            format!("{heading}, the first {MOST_ROWS} of {all}")
        } else {
            heading.to_owned()
        };
        Self {
            heading,
            header: header.to_vec(),
            rows: rows.take(MOST_ROWS).collect(),
        }
    }
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
