//! `circ lcs`.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use super::args::{LcsArgs, SystemFormat};
use super::exit::{Exit, Failure};
use super::files::{self, STDOUT};
use super::input::{self, Subject};
use super::output;
use super::streams::Streams;
use crate::lcs::format::{Format, format};
use crate::lcs::siconos::siconos;
use crate::lcs::{json, sparse_format};

/// Prints the complementarity system.
///
/// # Errors
/// See [`Failure`].
pub(super) fn lcs(args: &LcsArgs, streams: &Streams) -> Result<Exit, Failure> {
    let outputs: Vec<&Path> = args.output.iter().map(PathBuf::as_path).collect();
    let subject = input::open_as_it_stands(&args.input, &outputs, streams)?;
    let asked = asked(args)?;
    if let Subject::Circuit(model) = &subject
        && (asked == SystemFormat::Mtx || input::is_large(model.multiport()))
    {
        return sparse(args, asked, &subject, streams);
    }
    let system = input::start_system(&subject, &args.switches, streams);
    let (system, without) = system.map_err(|failure| match failure {
        Failure::Run(error) if matches!(subject, Subject::Circuit(_)) => {
            input::broke_off(&args.input, &error, subject.places(), streams)
        }
        failure => failure,
    })?;
    if let Some(error) = without {
        let text = format!("{error}; the start state is the initial conditions");
        streams.note("no-operating-point", text);
    }
    let text = match asked {
        SystemFormat::Json => json::write(&system.lcs, &system.x0, system.tran),
        SystemFormat::Text => format(&system.lcs, Format::Text),
        SystemFormat::Numpy => format(&system.lcs, Format::Numpy),
        SystemFormat::Matlab => format(&system.lcs, Format::Matlab),
        SystemFormat::Latex => format(&system.lcs, Format::Latex),
        SystemFormat::Siconos => {
            let script = siconos(&system.lcs, &system.x0, system.tran);
            let file = args.input.file.display();
            script.map_err(|why| {
                Failure::told("output-format", format!("{file}: --format siconos: {why}"))
            })?
        }
        SystemFormat::Mtx => {
            let what = "--format mtx: takes a netlist; scipy.io.mmwrite writes the matrices of a system file";
            return Err(Failure::told("output-format", what.into()));
        }
    };
    let text = if text.ends_with('\n') {
        text
    } else {
        text + "\n"
    };
    put(args, text, streams)
}

/// The form that `--format` or the ending of the output asks for.
fn asked(args: &LcsArgs) -> Result<SystemFormat, Failure> {
    let path = match (args.format, &args.output) {
        (Some(format), _) => return Ok(format),
        (None, None) => return Ok(SystemFormat::Text),
        (None, Some(path)) => path,
    };
    let ending = path.extension().and_then(OsStr::to_str).unwrap_or_default();
    match ending.to_lowercase().as_str() {
        _ if path == Path::new(STDOUT) => Ok(SystemFormat::Text),
        "txt" => Ok(SystemFormat::Text),
        "json" => Ok(SystemFormat::Json),
        "py" => Ok(SystemFormat::Numpy),
        "m" => Ok(SystemFormat::Matlab),
        "tex" => Ok(SystemFormat::Latex),
        "mtx" => Ok(SystemFormat::Mtx),
        _ => Err(output::unknown_ending(
            path,
            "txt, json, py, m, tex or mtx without `--format`",
        )),
    }
}

fn put(args: &LcsArgs, text: String, streams: &Streams) -> Result<Exit, Failure> {
    match &args.output {
        Some(path) => files::write(path, text.as_bytes())?,
        None => streams.data(text)?,
    }
    Ok(Exit::Done)
}

/// The system without its zeros.
fn sparse(
    args: &LcsArgs,
    asked: SystemFormat,
    subject: &Subject,
    streams: &Streams,
) -> Result<Exit, Failure> {
    let (system, x0) = input::sparse_system(subject, &args.switches, streams)?;
    let tran = match subject {
        Subject::Circuit(model) => model.circuit().tran,
        Subject::System(_) => None,
    };
    let text = match asked {
        SystemFormat::Json => json::write_sparse(&system, &x0, tran),
        SystemFormat::Text => sparse_format::summary(&system),
        SystemFormat::Numpy => sparse_format::numpy(&system),
        SystemFormat::Matlab => sparse_format::matlab(&system),
        SystemFormat::Latex | SystemFormat::Siconos => {
            let n = system.states.len();
            let what = "--format latex and siconos take small systems";
            return Err(Failure::told(
                "output-format",
                format!("{what}, not one of {n} states; use json, numpy, matlab or mtx"),
            ));
        }
        SystemFormat::Mtx => {
            let matrices = sparse_format::matrix_market(&system);
            let to_file = |path: &&PathBuf| path.as_path() != Path::new(STDOUT);
            let Some(path) = args.output.as_ref().filter(to_file) else {
                let texts: Vec<String> = matrices.into_iter().map(|(_, text)| text).collect();
                streams.data(texts.concat())?;
                return Ok(Exit::Done);
            };
            for (letter, text) in matrices {
                files::write(
                    &path.with_extension(format!("{letter}.mtx")),
                    text.as_bytes(),
                )?;
            }
            return Ok(Exit::Done);
        }
    };
    put(args, text, streams)
}
