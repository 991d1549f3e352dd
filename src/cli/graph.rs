//! `circ graph`.

use std::path::{Path, PathBuf};

use super::args::GraphArgs;
use super::exit::{Exit, Failure};
use super::files::{self, STDOUT};
use super::input;
use super::output;
use super::streams::Streams;
use crate::report::graph;

/// Writes the circuit graph: Graphviz text on standard output, or a file of either form.
///
/// # Errors
/// See [`Failure`].
pub(super) fn graph(args: &GraphArgs, streams: &Streams) -> Result<Exit, Failure> {
    let path = args.output.as_deref().unwrap_or(Path::new(STDOUT));
    let ending = if path == Path::new(STDOUT) {
        args.format.clone()
    } else {
        let ending = path.extension().unwrap_or_default();
        ending.to_string_lossy().to_ascii_lowercase()
    };
    if !matches!(ending.as_str(), "dot" | "gv" | "svg" | "png") {
        return Err(output::unknown_ending(path, "dot, svg or png"));
    }
    let outputs: Vec<&Path> = args.output.iter().map(PathBuf::as_path).collect();
    let subject = input::open_as_it_stands(&args.input, &outputs, streams)?;
    let circuit = input::model_of(&args.input, &subject)?.circuit();
    match ending.as_str() {
        "dot" | "gv" => files::write(path, graph::dot(circuit).as_bytes())?,
        ending => output::picture_to_file(path, ending == "png", &graph::svg(circuit)?)?,
    }
    Ok(Exit::Done)
}
