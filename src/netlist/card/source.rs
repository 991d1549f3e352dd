//! V and I: a DC value, a waveform, an AC specification in any order.

use super::{Body, assign, assignment_follows, expect_value, keyword, nodes};
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{Assign, Device, Expr, Name, WaveArg, WaveCall};
use crate::netlist::lex::{
    Input, Parsed, ahead, at_end, missing, next_word, refuse, separator, symbol, tell, word,
};
use crate::netlist::suggest::nearest;
use crate::netlist::{expr, operand};

/// Waveforms, supported or only recognised.
const WAVES: [&str; 12] = [
    "sin", "sine", "pulse", "pwl", "exp", "sffm", "am", "trnoise", "trrandom", "external",
    "wavefile", "pwlfile",
];

/// Flags on a source.
const FLAGS: [&str; 3] = ["load", "distof1", "distof2"];

/// `V1 a b DC 5 AC 1 SIN(0 5 50) Rser=1`.
pub(super) fn source<'a>(i: Input<'a>, _: &Name) -> Parsed<'a, Body> {
    let (mut at, nodes) = nodes(i, 2, "node")?;
    let (mut dc, mut wave, mut ac, mut args) = (None, None, None, Vec::new());
    loop {
        at = separator(at);
        if at_end(at) {
            return Ok((at, (nodes, Device::Source { dc, wave, ac, args })));
        }
        if let Some(open) = symbol(at, '(')
            && let Some((_, name)) = word(open)
                .ok()
                .filter(|(_, name)| WAVES.contains(&name.text.as_str()))
        {
            // `(SIN 0 5 1k)`: the parenthesis in front.
            let (rest, call) = parenthesised(at, word(open)?.0, name, &mut args)?;
            (at, wave) = (rest, Some(Box::new(call)));
            continue;
        }
        if let Some(rest) = keyword(at, "dc") {
            let rest = symbol(rest, '=').unwrap_or(rest);
            // `DC SIN(…)`: the keyword without a value.
            if starts_wave(rest) || at_end(rest) {
                at = rest;
                continue;
            }
            let (rest, value) = dc_value(rest, "the DC value")?;
            (at, dc) = (rest, Some(value));
        } else if let Some(rest) = keyword(at, "ac") {
            let (rest, values) = stimulus(symbol(rest, '=').unwrap_or(rest));
            (at, ac) = (rest, Some(values));
        } else if starts_wave(at) {
            let (rest, name) = word(at)?;
            let (rest, call) = call(rest, name, &mut args)?;
            (at, wave) = (rest, Some(Box::new(call)));
        } else if assignment_follows(at) || FLAGS.iter().any(|flag| keyword(at, flag).is_some()) {
            let (rest, one) = assign(at)?;
            args.push(one);
            at = rest;
        } else if dc.is_none() {
            let (rest, value) = dc_value(at, "a value or waveform")?;
            if symbol(rest, '(').is_some() {
                const KNOWN: [&str; 6] = ["sin", "pulse", "pwl", "exp", "sffm", "am"];
                let (_, name) = word(at)?;
                let meant = nearest(&name.text, KNOWN);
                let meant = meant.map(|near| format!("did you mean {}? ", near.to_uppercase()));
                let all = KNOWN.map(str::to_uppercase).join(", ");
                let help = meant.unwrap_or_default() + "waveforms are " + &all;
                let fault =
                    Diagnostic::error("unknown-waveform", next_word(at), "unknown waveform");
                return Err(refuse(fault.label("not a waveform").help(help)));
            }
            (at, dc) = (rest, Some(value));
        } else {
            return Ok((at, (nodes, Device::Source { dc, wave, ac, args })));
        }
    }
}

/// A value, which may stand in parentheses.
fn dc_value<'a>(at: Input<'a>, what: &str) -> Parsed<'a, Expr> {
    if symbol(at, '(').is_some() {
        return expr::expr(at);
    }
    expect_value(at, what)
}

fn starts_wave(i: Input<'_>) -> bool {
    word(i).is_ok_and(|(rest, name)| {
        WAVES.contains(&name.text.as_str()) && symbol(rest, '=').is_none()
    })
}

/// Magnitude and phase of an AC specification, as far as they are given.
fn stimulus(mut at: Input<'_>) -> (Input<'_>, Vec<Expr>) {
    let mut values = Vec::new();
    for _ in 0..2 {
        let start = separator(at);
        if !start
            .fragment()
            .starts_with(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | '{' | '\''))
        {
            break;
        }
        let Ok((rest, value)) = operand::item(start) else {
            break;
        };
        values.push(value);
        at = rest;
    }
    (at, values)
}

/// The arguments of a waveform, with or without parentheses.
fn call<'a>(i: Input<'a>, name: Name, args: &mut Vec<Assign>) -> Parsed<'a, WaveCall> {
    let mut at = i;
    if name.text == "pwl"
        && let Some(rest) = keyword(at, "repeat")
    {
        at = repeat(rest, args)?.0;
    }
    if let Some(rest) = points_file(at, &name, args) {
        let list = Vec::new();
        return Ok((rest, WaveCall { name, args: list }));
    }
    if let Some(open) = symbol(at, '(') {
        return parenthesised(at, open, name, args);
    }
    let mut list = Vec::new();
    loop {
        at = separator(at);
        if at_end(at)
            || assignment_follows(at)
            || keyword(at, "ac").is_some()
            || keyword(at, "dc").is_some()
        {
            return Ok((at, WaveCall { name, args: list }));
        }
        at = argument(at, &mut list)?.0;
    }
}

/// `(…)` around the arguments; the closing one may be missing, PWL points may have parentheses of their own.
fn parenthesised<'a>(
    before: Input<'a>,
    i: Input<'a>,
    name: Name,
    args: &mut Vec<Assign>,
) -> Parsed<'a, WaveCall> {
    let mut at = i;
    let mut list = Vec::new();
    let mut depth = 1_usize;
    loop {
        at = separator(at);
        if let Some(rest) = symbol(at, ')') {
            at = rest;
            depth -= 1;
            let more_points = name.text == "pwl" && symbol(at, '(').is_some();
            if depth == 0 && !more_points {
                if let Some(rest) = keyword(at, "endrepeat") {
                    at = rest;
                }
                return Ok((at, WaveCall { name, args: list }));
            }
        } else if let Some(rest) = symbol(at, '(') {
            at = rest;
            depth += 1;
        } else if at_end(at) {
            tell(
                at,
                Diagnostic::warning(
                    "unbalanced",
                    ahead(separator(before), 1),
                    "`(` is never closed",
                )
                .label("no `)` follows")
                .help("it was read as closed at the end of the card"),
            );
            return Ok((at, WaveCall { name, args: list }));
        } else if name.text == "pwl" && list.is_empty() && keyword(at, "repeat").is_some() {
            at = repeat(word(at)?.0, args)?.0;
        } else if list.is_empty()
            && let Some(rest) = points_file(at, &name, args)
        {
            at = rest;
        } else if name.text == "pwl" && keyword(at, "endrepeat").is_some() {
            at = word(at)?.0;
        } else if assignment_follows(at) {
            let (rest, one) = assign(at)?;
            args.push(one);
            at = rest;
        } else {
            at = argument(at, &mut list)?.0;
        }
    }
}

/// `FILE "name"` after `PWL`, without `=`.
fn points_file<'a>(at: Input<'a>, wave: &Name, args: &mut Vec<Assign>) -> Option<Input<'a>> {
    let (rest, name) = word(at).ok()?;
    let wanted = wave.text == "pwl" && name.text == "file" && symbol(rest, '=').is_none();
    let (rest, value) = operand::lenient(separator(rest)).ok().filter(|_| wanted)?;
    args.push(Assign {
        name,
        value: Some(value),
    });
    Some(rest)
}

/// `FOREVER` or `FOR n` after `PWL REPEAT`.
fn repeat<'a>(at: Input<'a>, args: &mut Vec<Assign>) -> Parsed<'a, ()> {
    let (rest, name) = word(at).map_err(|_| missing(at, "`FOREVER` or `FOR n`"))?;
    match name.text.as_str() {
        "forever" => {
            args.push(Assign {
                name: Name {
                    text: "repeat".into(),
                    ..name
                },
                value: None,
            });
            Ok((rest, ()))
        }
        "for" => {
            let (rest, value) = expect_value(rest, "the number of repetitions")?;
            args.push(Assign {
                name: Name {
                    text: "repeat".into(),
                    ..name
                },
                value: Some(value),
            });
            Ok((rest, ()))
        }
        _ => Err(missing(at, "`FOREVER` or `FOR n`")),
    }
}

fn argument<'a>(at: Input<'a>, list: &mut Vec<WaveArg>) -> Parsed<'a, ()> {
    let plus = at.fragment().starts_with('+');
    let (rest, value) = operand::item(at).map_err(|e| match e {
        nom::Err::Error(_) => missing(at, "a number"),
        e => e,
    })?;
    list.push(WaveArg { value, plus });
    Ok((rest, ()))
}
