//! `circ op`.

use std::path::PathBuf;

use serde::Serialize;
use serde_json::{Map, Value};

use super::args::{Input, OpArgs};
use super::exit::{Exit, Failure};
use super::files;
use super::input;
use super::output::Format;
use super::streams::Streams;
use crate::analysis::steps as runs;
use crate::integrate::OperatingPoint;
use crate::model::Model;
use crate::report::{json, si, steps, table};
use crate::waveform::csv;

/// Prints the operating point with the sources' DC values, with `.step` that of every combination of its values.
///
/// # Errors
/// See [`Failure`].
pub(super) fn op(args: &OpArgs, streams: &Streams) -> Result<Exit, Failure> {
    let subject = input::open(&args.input, &[], &[], streams)?;
    let model = input::model_of(&args.input, &subject)?;
    of_model(&args.input, model, args.json, streams)
}

/// The same of a netlist that was read.
///
/// # Errors
/// See [`Failure`].
pub(super) fn of_model(
    input: &Input,
    model: &Model,
    in_json: bool,
    streams: &Streams,
) -> Result<Exit, Failure> {
    let sweeps = &model.circuit().steps;
    if sweeps.is_empty() {
        return one(in_json, &solved(input, model, streams)?, streams);
    }
    let (points, failures) = stepped(input, model, streams)?;
    if in_json {
        // The point with the values as they stand, as of a netlist without `.step`.
        let (own, notes) = solved(input, model, streams)?;
        let steps = points.iter().map(|(values, point, notes)| StepDocument {
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
        streams.data(json::line(&document) + "\n")?;
    } else {
        for (values, point, notes) in &points {
            let label = steps::label(values);
            tell(&label, point, notes, streams);
            streams.data(format!("{label}\n{}\n", words(point)))?;
        }
    }
    ended(&failures)
}

/// Writes the points of `.step` as rows of CSV: what is stepped, the innermost first, then voltages, currents and switches (1 on, 0 off).
///
/// # Errors
/// See [`Failure`]; a netlist without `.step` has one point, which is printed.
pub(super) fn to_files(
    input: &Input,
    model: &Model,
    (outputs, formats): (&[PathBuf], &[Format]),
    streams: &Streams,
) -> Result<Exit, Failure> {
    let other = |(_, format): &(&PathBuf, &Format)| **format != Format::Csv;
    let file = input.file.display();
    let refused = match model.circuit().steps.is_empty() {
        true => outputs
            .first()
            .map(|path| (path, "an operating point is printed")),
        false => outputs
            .iter()
            .zip(formats)
            .find(other)
            .map(|(path, _)| (path, "the operating points of `.step` are written as csv")),
    };
    if let Some((path, what)) = refused {
        let message = format!(
            "{}: {what}, `circ op {file} --json` for other programs",
            path.display()
        );
        return Err(Failure::told("output-format", message));
    }
    let (points, failures) = stepped(input, model, streams)?;
    let mut text = Vec::new();
    for (k, (values, point, notes)) in points.iter().enumerate() {
        let on = |on: bool| f64::from(u8::from(on));
        let nodes = point.nodes.iter().map(|(n, v)| (format!("v({n})"), *v));
        let currents = point.currents.iter().map(|(n, i)| (format!("i({n})"), *i));
        let switches = point.switches.iter().map(|(n, s)| (n.clone(), on(*s)));
        let all = values
            .iter()
            .cloned()
            .chain(nodes)
            .chain(currents)
            .chain(switches);
        let (names, row): (Vec<String>, Vec<f64>) = all.unzip();
        let ([axis, names @ ..], [first, row @ ..]) = (&names[..], &row[..]) else {
            continue;
        };
        tell(&steps::label(values), point, notes, streams);
        if k == 0 {
            csv::header(&mut text, axis, names)?;
        }
        csv::row(&mut text, *first, row)?;
    }
    for path in outputs {
        files::write(path, &text)?;
    }
    ended(&failures)
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

/// A point under its values, with its notes in words.
type Stepped = (Vec<(String, f64)>, OperatingPoint, Vec<String>);

/// The points of `.step`, and why there are not more.
fn stepped(
    input: &Input,
    model: &Model,
    streams: &Streams,
) -> Result<(Vec<Stepped>, Vec<String>), Failure> {
    let (mut points, mut failures) = (Vec::new(), Vec::new());
    for variant in runs(model) {
        let values = variant.named();
        match solved(input, &input::variant(input, &variant, streams)?, streams) {
            Ok((point, notes)) => points.push((values, point, notes)),
            Err(failure) => failures.push(format!("{failure} at {}", steps::label(&values))),
        }
    }
    Ok((points, failures))
}

/// Tells the notes of a run.
fn tell(label: &str, point: &OperatingPoint, notes: &[String], streams: &Streams) {
    for (note, text) in point.notes.iter().zip(notes) {
        streams.note(note.code, format!("{label}: {text}"));
    }
}

fn ended(failures: &[String]) -> Result<Exit, Failure> {
    if failures.is_empty() {
        Ok(Exit::Done)
    } else {
        Err(Failure::told("failed-runs", failures.join("\nerror: ")))
    }
}

fn one(in_json: bool, (point, notes): &Solved, streams: &Streams) -> Result<Exit, Failure> {
    if in_json {
        streams.data(json::line(&Document::of(point, notes)) + "\n")?;
        return Ok(Exit::Done);
    }
    for (note, text) in point.notes.iter().zip(notes) {
        streams.note(note.code, text);
    }
    streams.data(words(point))?;
    Ok(Exit::Done)
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
    let row = |name: String, value: f64, unit: &str| vec![name, si::quantity(value, unit, 6)];
    let mut rows: Vec<Vec<String>> = point
        .nodes
        .iter()
        .map(|(n, v)| row(format!("v({n})"), *v, "V"))
        .collect();
    rows.extend(
        point
            .currents
            .iter()
            .map(|(n, i)| row(format!("i({n})"), *i, "A")),
    );
    rows.extend(
        point
            .switches
            .iter()
            .map(|(n, on)| vec![n.clone(), position(*on).into()]),
    );
    table::aligned(&["quantity", "value"], &rows)
}
