//! `circ ac`.

use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

use super::args::{About, AcArgs, Input, SimArgs};
use super::exit::{Exit, Failure};
use super::files;
use super::input;
use super::output::{self, Format};
use super::signals::Signals;
use super::streams::Streams;
use crate::analysis::{
    self, Measurements, Ratio, SmallSignalOptions, margins, ratios, small_signal_measured,
};
use crate::circuit::Measured;
use crate::model::Model;
use crate::report::html::Page;
use crate::report::{bode, log, steps, svg, terminal, text};
use crate::waveform::Phasors;

/// Finds the small-signal response and writes it.
///
/// # Errors
/// See [`Failure`].
pub(super) fn ac(args: &AcArgs, streams: &Streams) -> Result<Exit, Failure> {
    // An ending that is no format is told before anything is read.
    let formats = Format::of(&args.outputs, args.format, streams)?;
    let asked: Vec<Ratio> = args.probes.iter().map(|text| Ratio::parse(text)).collect();
    let mut signals: Vec<String> = Vec::new();
    for signal in asked.iter().flat_map(Ratio::signals) {
        if !signals.contains(signal) {
            signals.push(signal.clone());
        }
    }
    let paths: Vec<&Path> = args.outputs.iter().map(PathBuf::as_path).collect();
    let subject = input::open(&args.input, &signals, &paths, streams)?;
    let model = input::model_of(&args.input, &subject)?;
    if let Some(column) = model.circuit().columns.first()
        && !asked.is_empty()
    {
        let message = format!(
            "--probe {}: the response is of signals and ratios of two",
            column.name
        );
        return Err(Failure::told("unknown-signal", message));
    }
    let watch = Signals::watch()?;
    let options = SmallSignalOptions {
        about: args.about.map(|about| match about {
            About::Pss => analysis::About::Orbit,
            About::Op => analysis::About::Rest,
        }),
        sidebands: args.sidebands,
        period: args.period,
        cancel: Some(watch.flag()),
        ..SmallSignalOptions::default()
    };
    let (phasors, measured) = phasors(&args.input, model, (&options, &asked), streams)?;
    write(
        (&phasors, &measured),
        model,
        (&args.outputs, &formats),
        streams,
    )?;
    Ok(Exit::Done)
}

/// `circ sim` of a netlist with `.ac` and without `.tran`.
///
/// # Errors
/// See [`Failure`].
pub(super) fn sim(
    args: &SimArgs,
    model: &Model,
    formats: &[Format],
    streams: &Streams,
) -> Result<Exit, Failure> {
    let options = SmallSignalOptions::default();
    let probes = &model.circuit().probes;
    let is_shown = |signal: &String| probes.iter().any(|probe| probe.name == *signal);
    let asked: Vec<Ratio> = args
        .results
        .probes
        .iter()
        .map(|text| Ratio::parse(text))
        .collect();
    // Other expressions than ratios have no response: the signals in them are shown.
    let are_ratios = asked.iter().flat_map(Ratio::signals).all(is_shown);
    let asked = if are_ratios { &asked[..] } else { &[] };
    let (phasors, measured) = phasors(&args.input, model, (&options, asked), streams)?;
    let outputs = (&args.results.outputs[..], formats);
    write((&phasors, &measured), model, outputs, streams)?;
    Ok(Exit::Done)
}

/// The response of all signals or of the ratios asked for, with `.step` that of every combination of its values beside each other, and what `.meas ac`
/// finds on it; notes are told.
fn phasors(
    input: &Input,
    model: &Model,
    asked: (&SmallSignalOptions<'_>, &[Ratio]),
    streams: &Streams,
) -> Result<(Phasors, Measurements), Failure> {
    if asked.1.is_empty() {
        input::tell_expressions(model, streams);
    }
    if model.circuit().steps.is_empty() {
        return one(input, model, asked, streams);
    }
    let (mut runs, mut all) = (Vec::new(), Measurements::default());
    for variant in analysis::steps(model) {
        let label = steps::label(&variant.named());
        let own = input::variant(input, &variant, streams)?;
        let (phasors, found) = one(input, &own, asked, streams)
            .map_err(|failure| Failure::Faults(format!("{failure} at {label}")))?;
        all.measured
            .extend(found.measured.into_iter().map(|one| Measured {
                name: format!("{} {label}", one.name),
                ..one
            }));
        runs.push((label, phasors));
    }
    let beside = Phasors::beside(&runs).ok_or_else(|| {
        let file = input.file.display();
        let message = format!(
            "{file}: the frequencies of `.ac` change with `.step`; take the parameter out of `.ac`"
        );
        Failure::told("option-conflict", message)
    })?;
    Ok((beside, all))
}

/// The same of one model.
fn one(
    input: &Input,
    model: &Model,
    (options, asked): (&SmallSignalOptions<'_>, &[Ratio]),
    streams: &Streams,
) -> Result<(Phasors, Measurements), Failure> {
    let busy = streams.busy("finding the response");
    let found = small_signal_measured(model, options);
    drop(busy);
    let (response, measured) =
        found.map_err(|error| input::broke_off(input, &error, model.places(), streams))?;
    streams.notes(model.places(), &response.notes);
    if streams.verbose {
        streams.say(match &response.orbit {
            Some(orbit) => text::orbit(orbit),
            None => "about the operating point".into(),
        });
    }
    let found = Measurements {
        measured,
        ..Measurements::default()
    };
    let phasors = match asked {
        [] => response.phasors,
        _ => ratios(&response.phasors, asked).unwrap_or(response.phasors),
    };
    Ok((phasors, found))
}

/// The margins of ratios without a unit, in words.
fn tell_margins(phasors: &Phasors, streams: &Streams) {
    for (j, name) in phasors.names.iter().enumerate() {
        if !phasors.units[j].is_empty() || name.contains('@') {
            continue;
        }
        for margin in margins(phasors, j) {
            streams.say(format!("{name}: margin {}", bode::words(&margin)));
        }
    }
}

/// Writes the files, or without any CSV to standard output, and tells the margins and measurements.
fn write(
    (phasors, measured): (&Phasors, &Measurements),
    model: &Model,
    (outputs, formats): (&[PathBuf], &[Format]),
    streams: &Streams,
) -> Result<(), Failure> {
    tell_margins(phasors, streams);
    // Results, which `-q` does not hide.
    if !measured.is_empty() {
        match streams.log {
            Some(_) => streams.error(log::run(measured)),
            None => streams.error(measured.words()),
        }
    }
    if outputs.is_empty() && streams.out_is_terminal() {
        let (lines, columns) = streams.size();
        let plot = terminal::response(
            &bode::figure(phasors),
            columns,
            lines,
            streams.out_colours(),
        );
        streams.data(plot)?;
        return Ok(());
    }
    if outputs.is_empty() {
        let mut out = streams.out();
        phasors.write_csv(&mut out)?;
        out.flush()?;
    }
    for (path, format) in outputs.iter().zip(formats) {
        let mut bytes = Cursor::new(Vec::new());
        match format {
            Format::Csv => phasors.write_csv(&mut bytes)?,
            Format::Raw => phasors.write_raw(&mut bytes)?,
            Format::Npz => phasors.write_npz(&mut bytes)?,
            Format::Json => phasors.write_json(&mut bytes)?,
            Format::Svg | Format::Png => {
                let drawing = svg::draw(&bode::figure(phasors))?;
                output::picture_to_file(path, *format == Format::Png, &drawing)?;
                continue;
            }
            Format::Html => {
                let page = Page::of_response(&bode::figure(phasors), measured.words())
                    .with_circuit(Some(model))
                    .html()?;
                bytes.get_mut().extend_from_slice(page.as_bytes());
            }
        }
        files::write(path, bytes.get_ref())?;
    }
    Ok(())
}
