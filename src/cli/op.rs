//! `circ op`.

use serde::Serialize;
use serde_json::{Map, Value};

use super::args::OpArgs;
use super::exit::{Exit, Failure};
use super::input;
use super::streams::Streams;
use crate::integrate::{OperatingPoint, Values, operating_point};
use crate::report::{json, si, table};
use crate::settings::Settings;

/// Prints the operating point with the sources' DC values.
///
/// # Errors
/// See [`Failure`].
pub(super) fn op(args: &OpArgs, streams: &Streams) -> Result<Exit, Failure> {
    let (circuit, _) = input::circuit(&args.input, streams)?;
    let point = operating_point(&circuit, Values::Dc, false, &Settings::default())
        .map_err(|e| Failure::Message(format!("{}: {e}", args.input.file.display())))?;
    if args.json {
        streams.data(json::line(&Document::of(&point)) + "\n")?;
        return Ok(Exit::Done);
    }
    for note in &point.notes {
        streams.say(format!("note: {note}"));
    }
    streams.data(words(&point))?;
    Ok(Exit::Done)
}

#[derive(Serialize)]
struct Document<'a> {
    nodes: Map<String, Value>,
    currents: Map<String, Value>,
    switches: Map<String, Value>,
    notes: &'a [String],
}

impl<'a> Document<'a> {
    fn of(point: &'a OperatingPoint) -> Self {
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
            notes: &point.notes,
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
