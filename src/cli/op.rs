//! `circ op`.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::{Map, Value};

use super::args::{Input, OpArgs};
use super::exit::{Exit, Failure};
use super::files;
use super::input;
use super::output::Format;
use super::streams::Streams;
use crate::analysis::steps as runs;
use crate::circuit::is_inside;
use crate::integrate::OperatingPoint;
use crate::model::Model;
use crate::report::{json, si, steps, table};
use crate::waveform::csv;

/// Prints or writes the operating point with the sources' DC values, with `.step` that of every combination of its values.
///
/// # Errors
/// See [`Failure`].
pub(super) fn op(args: &OpArgs, streams: &Streams) -> Result<Exit, Failure> {
    let formats = Format::of(&args.outputs, None, streams)?;
    let paths: Vec<&Path> = args.outputs.iter().map(PathBuf::as_path).collect();
    let subject = input::open(&args.input, &[], &paths, streams)?;
    let model = input::model_of(&args.input, &subject)?;
    let outputs = (&args.outputs[..], &formats[..]);
    of_model(&args.input, model, outputs, args.json, streams)
}

/// The same of a netlist that was read.
///
/// # Errors
/// See [`Failure`].
pub(super) fn of_model(
    input: &Input,
    model: &Model,
    (outputs, formats): (&[PathBuf], &[Format]),
    in_json: bool,
    streams: &Streams,
) -> Result<Exit, Failure> {
    let is_other =
        |(_, format): &(&PathBuf, &Format)| !matches!(format, Format::Csv | Format::Json);
    if let Some((path, _)) = outputs.iter().zip(formats).find(is_other) {
        let message = format!(
            "{}: an operating point is written as csv or json",
            path.display()
        );
        return Err(Failure::told("output-format", message));
    }
    let found = Found::of(input, model, streams)?;
    if !in_json {
        found.tell(streams);
    }
    for (path, format) in outputs.iter().zip(formats) {
        match format {
            Format::Json => files::write(path, found.json(input, model, streams)?.as_bytes())?,
            _ => files::write(path, &found.csv()?)?,
        }
    }
    if in_json {
        streams.data(found.json(input, model, streams)?)?;
    } else if outputs.is_empty() {
        streams.data(found.words())?;
    }
    if found.failures.is_empty() {
        Ok(Exit::Done)
    } else {
        Err(Failure::told(
            "failed-runs",
            found.failures.join("\nerror: "),
        ))
    }
}

/// A point and its notes in words.
type Solved = (OperatingPoint, Vec<String>);

fn solved(input: &Input, model: &Model, streams: &Streams) -> Result<Solved, Failure> {
    let places = model.places();
    let point = model
        .operating_point()
        .map_err(|error| input::broke_off(input, &error, places, streams))?;
    let notes = places.all(&point.notes);
    Ok((point, notes))
}

/// The points of a netlist: one, or those of `.step` under their values.
struct Found {
    points: Vec<(Vec<(String, f64)>, Solved)>,
    /// Why there are not more.
    failures: Vec<String>,
}

impl Found {
    fn of(input: &Input, model: &Model, streams: &Streams) -> Result<Self, Failure> {
        let (mut points, mut failures) = (Vec::new(), Vec::new());
        if model.circuit().steps.is_empty() {
            points.push((Vec::new(), solved(input, model, streams)?));
            return Ok(Self { points, failures });
        }
        for variant in runs(model) {
            let values = variant.named();
            match solved(input, &input::variant(input, &variant, streams)?, streams) {
                Ok(point) => points.push((values, point)),
                Err(failure) => failures.push(format!("{failure} at {}", steps::label(&values))),
            }
        }
        Ok(Self { points, failures })
    }

    /// Tells the notes.
    fn tell(&self, streams: &Streams) {
        for (values, (point, notes)) in &self.points {
            for (note, text) in point.notes.iter().zip(notes) {
                streams.note(
                    note.code,
                    match &values[..] {
                        [] => text.clone(),
                        values => format!("{}: {text}", steps::label(values)),
                    },
                );
            }
        }
    }

    fn words(&self) -> String {
        let block = |(values, (point, _)): &(Vec<_>, Solved)| match &values[..] {
            [] => words(point),
            values => format!("{}\n{}\n", steps::label(values), words(point)),
        };
        self.points.iter().map(block).collect()
    }

    /// Rows of CSV: what is stepped, the innermost first, then voltages, currents and switches (1 on, 0 off).
    fn csv(&self) -> std::io::Result<Vec<u8>> {
        let mut text = Vec::new();
        for (k, (values, (point, _))) in self.points.iter().enumerate() {
            let found = quantities(point).map(|quantity| (quantity.name, quantity.value));
            let (names, row): (Vec<String>, Vec<f64>) = values.iter().cloned().chain(found).unzip();
            let ([axis, names @ ..], [first, row @ ..]) = (&names[..], &row[..]) else {
                continue;
            };
            if k == 0 {
                csv::header(&mut text, axis, names)?;
            }
            csv::row(&mut text, *first, row)?;
        }
        Ok(text)
    }

    /// A line of JSON; of `.step` the point with the values as they stand, as of a netlist without it, then all others.
    fn json(&self, input: &Input, model: &Model, streams: &Streams) -> Result<String, Failure> {
        if let [(values, (point, notes))] = &self.points[..]
            && values.is_empty()
        {
            return Ok(json::line(&Document::of(point, notes)) + "\n");
        }
        let (own, notes) = solved(input, model, streams)?;
        let steps = self
            .points
            .iter()
            .map(|(values, (point, notes))| StepDocument {
                values: values
                    .iter()
                    .map(|(n, v)| (n.clone(), (*v).into()))
                    .collect(),
                point: Document::of(point, notes),
            });
        let document = SteppedDocument {
            point: Document::of(&own, &notes),
            steps: steps.collect(),
        };
        Ok(json::line(&document) + "\n")
    }
}

/// What is shown of a point.
struct Quantity {
    name: String,
    value: f64,
    /// V or A; none of a switch.
    unit: &'static str,
}

/// Voltages, currents and switches (1 on, 0 off), without what is inside of `A` devices.
fn quantities(point: &OperatingPoint) -> impl Iterator<Item = Quantity> {
    let is_shown = |name: &String| !is_inside(name);
    let quantity = |name: String, value: f64, unit: &'static str| Quantity { name, value, unit };
    let nodes = point.nodes.iter().filter(move |(n, _)| is_shown(n));
    let currents = point.currents.iter().filter(move |(n, _)| is_shown(n));
    let switches = point.switches.iter().filter(move |(n, _)| is_shown(n));
    let nodes = nodes.map(move |(n, v)| quantity(format!("v({n})"), *v, "V"));
    let currents = currents.map(move |(n, i)| quantity(format!("i({n})"), *i, "A"));
    let switches = switches.map(move |(n, on)| quantity(n.clone(), f64::from(u8::from(*on)), ""));
    nodes.chain(currents).chain(switches)
}

#[derive(Serialize)]
struct SteppedDocument<'a> {
    #[serde(flatten)]
    point: Document<'a>,
    steps: Vec<StepDocument<'a>>,
}

#[derive(Serialize)]
struct StepDocument<'a> {
    values: Map<String, Value>,
    #[serde(flatten)]
    point: Document<'a>,
}

#[derive(Serialize)]
struct Document<'a> {
    nodes: Map<String, Value>,
    currents: Map<String, Value>,
    switches: Map<String, Value>,
    notes: &'a [String],
}

impl<'a> Document<'a> {
    fn of(point: &'a OperatingPoint, notes: &'a [String]) -> Self {
        let numbers = |values: &[(String, f64)]| {
            values
                .iter()
                .map(|(n, v)| (n.clone(), Value::from(*v)))
                .collect()
        };
        Self {
            nodes: numbers(&point.nodes),
            currents: numbers(&point.currents),
            switches: point
                .switches
                .iter()
                .map(|(n, on)| (n.clone(), position(*on).into()))
                .collect(),
            notes,
        }
    }
}

const fn position(on: bool) -> &'static str {
    if on { "on" } else { "off" }
}

fn words(point: &OperatingPoint) -> String {
    let row = |Quantity { name, value, unit }: Quantity| match unit {
        "" => vec![name, position(value != 0.0).into()],
        unit => vec![name, si::quantity(value, unit, 6)],
    };
    let rows: Vec<Vec<String>> = quantities(point).map(row).collect();
    table::aligned(&["quantity", "value"], &rows)
}
