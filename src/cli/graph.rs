//! `circ graph`.

use std::path::{Path, PathBuf};

use super::args::GraphArgs;
use super::exit::{Exit, Failure};
use super::files;
use super::input;
use super::output;
use super::streams::Streams;
use crate::report::graph;

/// Writes the circuit graph: Graphviz text on standard output, or a file of either form.
///
/// # Errors
/// See [`Failure`].
pub(super) fn graph(args: &GraphArgs, streams: &Streams) -> Result<Exit, Failure> {
    let ending = args.output.as_ref().map(|path| {
        (
            path,
            path.extension()
                .map(|e| e.to_string_lossy().to_ascii_lowercase())
                .unwrap_or_default(),
        )
    });
    if let Some((path, ending)) = &ending
        && !matches!(ending.as_str(), "dot" | "gv" | "svg" | "png")
    {
        return Err(output::unknown_ending(path, "dot, svg or png"));
    }
    let outputs: Vec<&Path> = args.output.iter().map(PathBuf::as_path).collect();
    let subject = input::open_as_it_stands(&args.input, &outputs, streams)?;
    let circuit = input::model_of(&args.input, &subject)?.circuit();
    match ending {
        None => streams.data(graph::dot(circuit))?,
        Some((path, ending)) if matches!(ending.as_str(), "dot" | "gv") => {
            files::write(path, graph::dot(circuit).as_bytes())?;
        }
        Some((path, _)) => output::picture_to_file(path, &graph::svg(circuit)?)?,
    }
    Ok(Exit::Done)
}
