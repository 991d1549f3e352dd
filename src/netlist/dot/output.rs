//! `.save`, `.print`, `.probe`, `.plot`.

use nom::Input as _;

use super::{Dot, signal, skip};
use crate::netlist::ast::{Name, Statement, Wanted};
use crate::netlist::lex::{
    Input, Parsed, ahead, at_end, between, missing, separator, symbol, word,
};

/// Analyses that `.print` and `.plot` may name.
const ANALYSES: [&str; 11] = [
    "tran", "ac", "dc", "op", "noise", "four", "disto", "tf", "pz", "sp", "sens",
];

/// `.save v(a) i(d1) out @d1[i] all`, `.print tran …`.
pub(super) fn save(i: Input<'_>, analysis: bool) -> Parsed<'_, Dot> {
    let mut at = separator(i);
    let mut statement: fn(Vec<Wanted>) -> Statement = Statement::Save;
    if let Ok((rest, name)) = word(at)
        && ANALYSES.contains(&name.text.as_str())
        && symbol(rest, '(').is_none()
        && (analysis || name.text == "tran")
    {
        match name.text.as_str() {
            "tran" => statement = Statement::SaveTran,
            "dc" => statement = Statement::SaveDc,
            _ => return Ok((skip(at), Dot::Skipped)),
        }
        at = separator(rest);
    }
    let mut all = Vec::new();
    while !at_end(at) {
        let (rest, one) = wanted(at)?;
        all.extend(one);
        at = separator(rest);
    }
    Ok((at, Dot::statement(statement(all))))
}

/// One thing to print; `None` for the limits of a plot.
fn wanted(at: Input<'_>) -> Parsed<'_, Option<Wanted>> {
    let length = spaceless(at.fragment());
    let whole = at.take_from(length);
    let span = ahead(at, length);
    let text = at.fragment()[..length].to_lowercase();
    if text.starts_with('(') {
        return Ok((whole, None));
    }
    let other = Ok((
        whole,
        Some(Wanted::Other(Name {
            text: text.clone(),
            span,
        })),
    ));
    if matches!(
        text.as_str(),
        "all" | "allv" | "alli" | "v(*)" | "i(*)" | "*"
    ) {
        return Ok((whole, Some(Wanted::All(Name { text, span }))));
    }
    match signal(at) {
        Ok((rest, signal)) => {
            let follows = rest.fragment().chars().next();
            if follows.is_some_and(|c| !matches!(c, ' ' | ',' | '(')) {
                other
            } else {
                Ok((rest, Some(Wanted::Signal(signal))))
            }
        }
        Err(nom::Err::Error(_)) => match word(at) {
            Ok((rest, name)) if between(at, rest) == span => Ok((rest, Some(Wanted::Bare(name)))),
            _ if length > 0 => other,
            _ => Err(missing(at, "something to print")),
        },
        Err(e) => Err(e),
    }
}

/// The length up to a blank or comma outside parentheses and braces.
fn spaceless(text: &str) -> usize {
    let mut depth = 0_i64;
    for (at, c) in text.char_indices() {
        match c {
            '(' | '{' => depth += 1,
            ')' | '}' => depth -= 1,
            ' ' | ',' if depth <= 0 => return at,
            _ => {}
        }
    }
    text.len()
}
