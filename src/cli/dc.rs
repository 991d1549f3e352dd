//! `circ sim` of a netlist with `.dc`.

use super::args::SimArgs;
use super::exit::{Exit, Failure};
use super::files;
use super::input;
use super::output::{self, Format};
use super::streams::Streams;
use crate::analysis::{self, Unsolved};
use crate::integrate::Places;
use crate::model::Model;
use crate::report::figure::Figure;
use crate::report::html::Page;
use crate::report::{steps, svg};
use crate::waveform::csv;

/// Writes the operating points as CSV with a column per swept quantity, the innermost first, then the probes, or as a picture over the innermost.
///
/// # Errors
/// See [`Failure`].
pub(super) fn sim(
    args: &SimArgs,
    model: &Model,
    formats: &[Format],
    streams: &Streams,
) -> Result<Exit, Failure> {
    for (path, format) in args.results.outputs.iter().zip(formats) {
        if !format.is_picture() && *format != Format::Csv {
            let path = path.display();
            let message = format!("{path}: a `.dc` sweep is written as csv, svg, png or html");
            return Err(Failure::told("output-format", message));
        }
    }
    if !model.circuit().steps.is_empty() {
        streams.note(
            "left-out",
            "`.step` is left out: `.dc` is computed with the values as they stand",
        );
    }
    input::tell_expressions(model, streams);
    let found = analysis::dc(model).map_err(|Unsolved { at, circuit, error }| {
        let Some(circuit) = &circuit else {
            return input::refused(&args.input, &error, streams);
        };
        let places = Places(Some((circuit, model.sources())));
        let failure = input::broke_off(&args.input, &error, places, streams);
        Failure::Faults(format!("{failure} at {}", steps::label(&at)))
    })?;
    let mut text = Vec::new();
    if let Some((axis, others)) = found.names.split_first() {
        let mut writer = csv::Writer::over(&mut text, axis, others)?;
        for row in &found.rows {
            if let Some((value, others)) = row.split_first() {
                writer.row(*value, others)?;
            }
        }
    }
    let figure = || Figure::of_characteristic(&found);
    for (path, format) in args.results.outputs.iter().zip(formats) {
        match format {
            Format::Html => {
                let page = Page::of_figure(&figure()).with_circuit(Some(model));
                files::write(path, page.html()?.as_bytes())?;
            }
            Format::Svg | Format::Png => {
                let drawing = svg::draw(&figure())?;
                output::picture_to_file(path, *format == Format::Png, &drawing)?;
            }
            _ => files::write(path, &text)?,
        }
    }
    if args.results.outputs.is_empty() {
        streams.data(text)?;
    }
    Ok(Exit::Done)
}
