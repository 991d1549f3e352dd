//! `circ lcs`.

use std::path::{Path, PathBuf};

use super::args::{LcsArgs, SystemFormat};
use super::exit::{Exit, Failure};
use super::files;
use super::input::{self, Subject};
use super::streams::Streams;
use crate::lcs::format::{Format, format};
use crate::lcs::json;

/// Prints the complementarity system.
///
/// # Errors
/// See [`Failure`].
pub(super) fn lcs(args: &LcsArgs, streams: &Streams) -> Result<Exit, Failure> {
    let outputs: Vec<&Path> = args.output.iter().map(PathBuf::as_path).collect();
    let subject = input::open_as_it_stands(&args.input, &outputs, streams)?;
    let system = input::start_system(&subject, &args.switches, streams);
    let (system, without) = system.map_err(|failure| match failure {
        Failure::Run(error) if matches!(subject, Subject::Circuit(_)) => {
            input::broke_off(&args.input, &error, subject.places(), streams)
        }
        failure => failure,
    })?;
    if let Some(error) = without {
        streams.say(format!(
            "note: {error}; the start state is the initial conditions"
        ));
    }
    let text = match args.format {
        SystemFormat::Json => json::write(&system.lcs, &system.x0, system.tran),
        SystemFormat::Text => format(&system.lcs, Format::Text),
        SystemFormat::Numpy => format(&system.lcs, Format::Numpy),
        SystemFormat::Matlab => format(&system.lcs, Format::Matlab),
        SystemFormat::Latex => format(&system.lcs, Format::Latex),
    };
    let text = if text.ends_with('\n') {
        text
    } else {
        text + "\n"
    };
    match &args.output {
        Some(path) => files::write(path, text.as_bytes())?,
        None => streams.data(text)?,
    }
    Ok(Exit::Done)
}
