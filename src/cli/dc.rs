//! `.dc`: the operating point at every value of the sweeps.

use rayon::prelude::*;

use super::args::SimArgs;
use super::exit::{Exit, Failure};
use super::files;
use super::input;
use super::output::Format;
use super::streams::Streams;
use crate::circuit::{Circuit, Probed, combinations, elaborate};
use crate::diagnostic::SourceMap;
use crate::integrate::{OperatingPoint, Places, Values, operating_point};
use crate::netlist::Netlist;
use crate::report::steps;
use crate::settings::Settings;
use crate::waveform::csv;

/// Carries out the sweeps of a netlist without `.tran`: CSV with a column per swept quantity, the innermost first, then
/// the probes.
///
/// # Errors
/// See [`Failure`].
pub(super) fn sim(
    args: &SimArgs,
    circuit: &Circuit,
    netlist: &Netlist,
    sources: &SourceMap,
    streams: &Streams,
) -> Result<Exit, Failure> {
    for path in &args.outputs {
        if Format::of(path)? != Format::Csv {
            let message = format!("{}: a `.dc` sweep is written as csv", path.display());
            return Err(Failure::Message(message));
        }
    }
    if !circuit.steps.is_empty() {
        streams.say("note: `.step` is left out: `.dc` is computed with the values as they stand");
    }
    let point = |values: &Vec<f64>| -> Result<Vec<f64>, Failure> {
        let options = input::choices(&args.input).at(&circuit.dc, values);
        let (circuit, findings) = elaborate(netlist, &options);
        let Some(mut circuit) = circuit else {
            input::show(&findings, sources, streams);
            return Err(input::faults(&args.input, &findings));
        };
        input::keep_probes(&mut circuit, &args.probes)?;
        let point = operating_point(&circuit, Values::Dc, false, &Settings::default());
        let point = point.map_err(|error| {
            let names = circuit.dc.iter().map(|s| s.what.name().to_string());
            let label = steps::label(&names.zip(values.iter().copied()).collect::<Vec<_>>());
            let failure = input::broke_off(
                &args.input,
                &error,
                Places(Some((&circuit, sources))),
                streams,
            );
            Failure::Faults(format!("{failure} at {label}"))
        })?;
        Ok(values
            .iter()
            .copied()
            .chain(readings(&circuit, &point))
            .collect())
    };
    let rows: Vec<Result<Vec<f64>, Failure>> =
        combinations(&circuit.dc).par_iter().map(point).collect();
    let rows: Vec<Vec<f64>> = rows.into_iter().collect::<Result<_, _>>()?;

    let swept = circuit.dc.iter().map(|sweep| sweep.what.name().to_string());
    let probes = circuit.probes().into_iter().map(|probe| probe.name);
    let names: Vec<String> = swept.chain(probes).collect();
    let mut text = Vec::new();
    if let Some((axis, others)) = names.split_first() {
        let mut writer = csv::Writer::over(&mut text, axis, others)?;
        for row in &rows {
            if let Some((value, others)) = row.split_first() {
                writer.row(*value, others)?;
            }
        }
    }
    for path in &args.outputs {
        files::write(path, &text)?;
    }
    if args.outputs.is_empty() {
        streams.data(text)?;
    }
    Ok(Exit::Done)
}

/// The probes of a circuit at an operating point.
fn readings(circuit: &Circuit, point: &OperatingPoint) -> Vec<f64> {
    let node = |index: usize| index.checked_sub(1).map_or(0.0, |k| point.nodes[k].1);
    let reading = |what| match what {
        Probed::Voltage(a, b) => node(a.index()) - node(b.index()),
        Probed::Current(id) => point.currents[id.index()].1,
    };
    circuit
        .probes()
        .iter()
        .map(|probe| reading(probe.what))
        .collect()
}
