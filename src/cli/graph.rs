//! `circ graph`.

use std::path::{Path, PathBuf};

use super::args::GraphArgs;
use super::exit::{Exit, Failure};
use super::files::{self, STDOUT};
use super::input;
use super::output;
use super::streams::Streams;
use crate::analysis::conducting;
use crate::report::{graph, schematic};

/// Writes the circuit graph as Graphviz text, on standard output or to a file, or the picture of the circuit.
///
/// # Errors
/// See [`Failure`].
pub(super) fn graph(args: &GraphArgs, streams: &Streams) -> Result<Exit, Failure> {
    let to_stdout = [PathBuf::from(STDOUT)];
    let outputs = if args.outputs.is_empty() {
        &to_stdout[..]
    } else {
        &args.outputs
    };
    let endings = outputs.iter().map(|path| ending(path, args));
    let endings = endings.collect::<Result<Vec<_>, _>>()?;
    let paths: Vec<&Path> = args.outputs.iter().map(PathBuf::as_path).collect();
    let subject = input::open_as_it_stands(&args.input, &paths, streams)?;
    let model = input::model_of(&args.input, &subject)?;
    if args.at.is_some() && model.circuit().tran.is_none() {
        let file = args.input.file.display();
        return Err(Failure::told(
            "no-analysis",
            format!(
                "{file}: --at takes an instant of a run, and the netlist asks for no .tran analysis"
            ),
        ));
    }
    let stop = model.circuit().tran.map_or(0.0, |tran| tran.tstop);
    if let Some(t) = args.at.filter(|t| *t > stop) {
        let text = format!("--at {t:e}: the run of .tran ends at {stop:e} s");
        return Err(Failure::told("bad-option", text));
    }
    let live = match args.at {
        Some(t) => conducting(model, t)
            .map_err(|e| input::broke_off(&args.input, &e, model.places(), streams))?,
        None => Vec::new(),
    };
    for (path, ending) in outputs.iter().zip(endings) {
        match ending.as_str() {
            "dot" | "gv" => files::write(path, graph::dot(model.circuit()).as_bytes())?,
            ending => {
                output::picture_to_file(path, ending == "png", &schematic::svg(model, &live)?)?;
            }
        }
    }
    Ok(Exit::Done)
}

/// What a file is to hold, by its name.
fn ending(path: &Path, args: &GraphArgs) -> Result<String, Failure> {
    let ending = if path == Path::new(STDOUT) {
        args.format.clone()
    } else {
        let ending = path.extension().unwrap_or_default();
        ending.to_string_lossy().to_ascii_lowercase()
    };
    if !matches!(ending.as_str(), "dot" | "gv" | "svg" | "png") {
        return Err(output::unknown_ending(path, "dot, svg or png"));
    }
    if args.at.is_some() && matches!(ending.as_str(), "dot" | "gv") {
        let message = "--at colours a picture: svg or png, by -o or --format";
        return Err(Failure::told("output-format", message.into()));
    }
    Ok(ending)
}
