//! `circ explain`.

use std::fmt::Write;

use super::args::ExplainArgs;
use super::exit::{Exit, Failure};
use super::streams::Streams;
use crate::diagnostic::explain::{AREAS, Example, Explanation, explain as find};
use crate::netlist::suggest::nearest;

/// Tells what a code means, or what codes there are.
///
/// # Errors
/// [`Failure::Told`] for a code that there is not; those of standard output.
pub(super) fn explain(args: &ExplainArgs, streams: &Streams) -> Result<Exit, Failure> {
    let text = match &args.code {
        None => list(),
        Some(code) => {
            // `error[unknown-model]`, as it stands in a message.
            let code = code.rsplit('[').next().unwrap_or(code);
            let code = code.trim_end_matches([']', ':']).to_lowercase();
            page(find(&code).ok_or_else(|| unknown(&code))?)
        }
    };
    streams.data(text)?;
    Ok(Exit::Done)
}

fn unknown(code: &str) -> Failure {
    let codes = AREAS.iter().flat_map(|area| area.codes);
    let near = nearest(code, codes.map(|known| known.code));
    Failure::told(
        "unknown-code",
        match near {
            Some(near) => format!("there is no code `{code}`: did you mean `{near}`?"),
            None => format!("there is no code `{code}`"),
        },
    )
}

/// All codes, a line each.
fn list() -> String {
    let all = || AREAS.iter().flat_map(|area| area.codes);
    let width = all().map(|known| known.code.len()).max().unwrap_or(0);
    let mut text = String::new();
    for area in AREAS {
        let _ = writeln!(text, "{}", area.title);
        for Explanation { code, meaning, .. } in area.codes {
            let _ = writeln!(text, "  {code:width$}  {meaning}");
        }
        text.push('\n');
    }
    text + "`circ explain CODE` tells the cause, what to do, and shows an example.\n"
}

/// All of one code.
fn page(explanation: &Explanation) -> String {
    let Explanation {
        code,
        meaning,
        cause,
        remedy,
        example,
    } = explanation;
    let mut text = format!("{code}\n\n{meaning}\n\nUsual cause: {cause}\nWhat to do:  {remedy}\n");
    if let Some(Example { netlist, command }) = example {
        let _ = writeln!(text, "\nFor example, `circ {command} FILE` of\n");
        for line in netlist.lines() {
            let _ = writeln!(text, "    {line}");
        }
    }
    text
}
