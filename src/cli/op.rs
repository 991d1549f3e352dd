//! `circ op`.

use serde::Serialize;
use serde_json::{Map, Value};

use super::args::{Input, OpArgs};
use super::exit::{Exit, Failure};
use super::input;
use super::streams::Streams;
use crate::analysis::steps as runs;
use crate::integrate::OperatingPoint;
use crate::model::Model;
use crate::report::{json, si, steps, table};

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
    let solved = |model: &Model| {
        let places = model.places();
        let point = model
            .operating_point()
            .map_err(|error| input::broke_off(input, &error, places, streams))?;
        let notes = places.all(&point.notes);
        Ok::<_, Failure>((point, notes))
    };
    let sweeps = &model.circuit().steps;
    if sweeps.is_empty() {
        return one(in_json, &solved(model)?, streams);
    }
    let (mut points, mut failures) = (Vec::new(), Vec::new());
    for variant in runs(model) {
        let values = variant.named();
        match solved(&input::variant(input, &variant, streams)?) {
            Ok((point, notes)) => points.push((values, point, notes)),
            Err(failure) => failures.push(format!("{failure} at {}", steps::label(&values))),
        }
    }
    if in_json {
        // The point with the values as they stand, as of a netlist without `.step`.
        let (own, notes) = solved(model)?;
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
            for (note, text) in point.notes.iter().zip(notes) {
                streams.note(note.code, format!("{label}: {text}"));
            }
            streams.data(format!("{label}\n{}\n", words(point)))?;
        }
    }
    if failures.is_empty() {
        Ok(Exit::Done)
    } else {
        Err(Failure::told("failed-runs", failures.join("\nerror: ")))
    }
}

fn one(
    in_json: bool,
    (point, notes): &(OperatingPoint, Vec<String>),
    streams: &Streams,
) -> Result<Exit, Failure> {
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
