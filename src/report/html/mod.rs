//! One self-contained page of a result: curves that can be zoomed and measured, who conducts when, what the run did.
//!
//! The page is `page/page.html` with its style and scripts (drawn by uPlot, bundled with its licence) and the result as JSON, columns as
//! base64 of little-endian doubles, so that what a cursor reads is what was computed. `circPage(element, data)` of `page/page.js` shows
//! such data in any element.

mod bench;
mod check;
mod comparison;
mod curves;
mod run;
mod scales;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde::{Serialize, Serializer};

use super::{PictureError, schematic, sheet};
use crate::model::Model;
use crate::waveform::thin::thinned;

const TEMPLATE: &str = include_str!("../page/page.html");
const STYLES: [&str; 2] = [
    include_str!("../page/uplot/uPlot.min.css"),
    include_str!("../page/page.css"),
];
const SCRIPTS: [&str; 9] = [
    include_str!("../page/uplot/uPlot.iife.min.js"),
    include_str!("../page/columns.js"),
    include_str!("../page/spectrum.js"),
    include_str!("../page/look.js"),
    include_str!("../page/strips.js"),
    include_str!("../page/readings.js"),
    include_str!("../page/chart.js"),
    include_str!("../page/drawing.js"),
    include_str!("../page/page.js"),
];

/// Rows from which on a curve is drawn by an overview until the browser has read all of them.
const LONG: usize = 50_000;
/// Pixels of an overview.
const OVERVIEW: usize = 1000;
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
#[derive(Debug, Clone, Serialize)]
struct Axis {
    name: String,
    unit: &'static str,
    log: bool,
}

/// Numbers, in JSON as base64 of little-endian doubles.
#[derive(Debug, Clone, PartialEq)]
enum Column {
    Numbers(Vec<f64>),
    /// Those that follow behind what draws, `null` in JSON.
    Later,
}

impl Column {
    fn base64(values: &[f64]) -> String {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        BASE64_STANDARD.encode(bytes)
    }
}

impl Serialize for Column {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Numbers(values) => to.serialize_str(&Self::base64(values)),
            Self::Later => to.serialize_none(),
        }
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
    /// The run that it is of, where there are several.
    #[serde(skip_serializing_if = "String::is_empty")]
    run: String,
    x: usize,
    y: usize,
    /// A long one has another pair, of some of its rows, by which the page draws it until all are there.
    #[serde(skip_serializing_if = "Option::is_none")]
    overview: Option<[usize; 2]>,
}

/// When a switch is on or a device conducts.
#[derive(Debug, Clone, Serialize)]
struct Strip {
    name: String,
    /// The run that it is of, where there are several.
    #[serde(skip_serializing_if = "String::is_empty")]
    run: String,
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
    /// The run that it is of, where there are several.
    #[serde(skip_serializing_if = "String::is_empty")]
    run: String,
    header: Vec<&'static str>,
    rows: Vec<Vec<String>>,
    /// How many there are, where not all are here.
    all: usize,
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
        self.columns.push(Column::Numbers(values.collect()));
        self.columns.len() - 1
    }

    /// The same with a picture of the circuit, where it can be drawn, and what was found in its netlist.
    #[must_use]
    pub fn with_circuit(mut self, model: Option<&Model>) -> Self {
        if let Some(model) = model {
            self.circuit = schematic::with_both_states(model).ok();
            let found = model.findings().iter();
            let lines: Vec<String> = found.map(|f| f.line(model.sources())).collect();
            self.say("Netlist", lines.join("\n"));
        }
        self
    }

    /// The page with overviews of its long curves, and their columns for behind it: a browser draws the one while it reads the other.
    fn apart(&self) -> (Self, String) {
        let mut head = Self {
            title: self.title.clone(),
            about: self.about.clone(),
            axis: self.axis.clone(),
            columns: Vec::new(),
            panels: self.panels.clone(),
            strips: self.strips.clone(),
            tables: self.tables.clone(),
            texts: self.texts.clone(),
            circuit: self.circuit.clone(),
        };
        let long = |column: &Column| matches!(column, Column::Numbers(v) if v.len() > LONG);
        let mut rest = String::new();
        for (k, column) in self.columns.iter().enumerate() {
            head.columns.push(match column {
                Column::Numbers(values) if long(column) => {
                    let column = Column::base64(values);
                    rest += &format!(
                        "<script type=\"text/plain\" data-column=\"{k}\">{column}</script>\n"
                    );
                    Column::Later
                }
                _ => column.clone(),
            });
        }
        let panels = self.panels.iter().enumerate();
        for (p, c) in panels.flat_map(|(p, panel)| (0..panel.curves.len()).map(move |c| (p, c))) {
            let Curve { x, y, .. } = self.panels[p].curves[c];
            if let (Column::Numbers(x), Column::Numbers(y)) = (&self.columns[x], &self.columns[y])
                && x.len() > LONG
            {
                let all = x.iter().copied().zip(y.iter().copied());
                let some = thinned(all.collect(), OVERVIEW);
                let x = head.column(some.iter().map(|p| p.0));
                let y = head.column(some.iter().map(|p| p.1));
                head.panels[p].curves[c].overview = Some([x, y]);
            }
        }
        if !rest.is_empty() {
            rest += "<script>circRest(window.circ);</script>\n";
        }
        (head, rest)
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
        let (head, rest) = self.apart();
        let data = serde_json::to_string(&head)?;
        Ok(filled(
            TEMPLATE,
            &[
                ("title", sheet::escaped(&self.title)),
                ("style", STYLES.join("\n")),
                // Within a script a text like `</script>` ends it, and `<!--` hides its end.
                ("data", data.replace('<', "\\u003c")),
                ("script", SCRIPTS.join("\n")),
                ("rest", rest),
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

fn axis(name: &str, unit: &'static str, log: bool) -> Axis {
    let name = name.to_owned();
    Axis { name, unit, log }
}

impl Table {
    /// At most [`MOST_ROWS`] rows.
    fn new(
        heading: &str,
        header: &[&'static str],
        rows: impl ExactSizeIterator<Item = Vec<String>>,
    ) -> Self {
        let all = rows.len();
        Self {
            heading: heading.to_owned(),
            run: String::new(),
            header: header.to_vec(),
            all,
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
    use crate::report::figure::{self, Figure};

    /// What stands before the script that draws names overviews of some rows; all rows follow behind it.
    #[test]
    fn columns_of_long_curves_follow_behind_an_overview() {
        let mut page = Page::new("long", axis("time", "s", false));
        let rows = LONG + 1;
        let x = page.column((0..rows).map(|k| k as f64));
        let y = page.column((0..rows).map(|k| (k % 7) as f64));
        let name = "v(a)".to_owned();
        let curves = vec![Curve {
            name,
            run: String::new(),
            x,
            y,
            overview: None,
        }];
        page.panels = vec![Panel {
            quantity: "voltage".into(),
            unit: "V",
            curves,
            dots: false,
        }];
        let (head, rest) = page.apart();
        assert_eq!(head.columns[..2], [Column::Later, Column::Later]);
        let Some([x, y]) = head.panels[0].curves[0].overview else {
            panic!("{:?}", head.panels)
        };
        let (Column::Numbers(x), Column::Numbers(y)) = (&head.columns[x], &head.columns[y]) else {
            panic!("no overview")
        };
        assert!(x.len() == y.len() && x.len() <= 4 * OVERVIEW);
        assert!(x.iter().zip(y).all(|(x, y)| (*x as usize % 7) as f64 == *y));
        assert_eq!(x.last(), Some(&(LONG as f64)));
        let html = page.html().unwrap();
        let at = html.find("data-column=\"1\"").unwrap();
        assert!(
            html.find("circPage(document").unwrap() < at
                && html.ends_with(&format!("{rest}</body>\n</html>\n"))
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
