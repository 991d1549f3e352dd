//! `.step`, `.dc`, `.ac`, `.pss`.

use super::{Dot, skip};
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{Expr, Frequencies, Points, Pss, Spacing, Statement, Sweep, Target};
use crate::netlist::lex::{
    Fault, Input, Parsed, at_end, between, blank, end, expect_word, missing, next_word, refuse,
    separator, symbol, tell, word,
};
use crate::netlist::operand;
use crate::netlist::suggest::spacing_meant;

/// `.step [lin | dec | oct] [param] name start stop n`, `.step [param] name list a b c`.
pub(super) fn step(i: Input<'_>) -> Parsed<'_, Dot> {
    let (rest, sweep) = sweep(i)?;
    let (rest, ()) = end(rest).map_err(|fault| match &sweep.points {
        Points::Linear([first, ..]) => spelled(fault, first),
        _ => fault,
    })?;
    Ok((rest, Dot::statement(Statement::Step(Box::new(sweep)))))
}

/// `.dc v1 start stop increment [v2 start stop increment …]`.
pub(super) fn dc(i: Input<'_>) -> Parsed<'_, Dot> {
    let mut all = Vec::new();
    let mut at = separator(i);
    loop {
        let (rest, one) = sweep(at)?;
        all.push(one);
        at = separator(rest);
        if at_end(at) {
            return Ok((at, Dot::statement(Statement::Dc(all))));
        }
    }
}

/// `.ac dec|oct|lin n f1 f2`, `.ac list f1 f2 …`. What is no such card is left out with a warning: it does not concern other analyses.
pub(super) fn ac<'a>(start: Input<'a>, i: Input<'a>) -> (Input<'a>, Dot) {
    let (rest, spacing) = match scale(i) {
        Some((rest, Scale::Linear)) => (rest, Spacing::Linear),
        Some((rest, Scale::Logarithmic(base))) => (rest, Spacing::Logarithmic(base)),
        Some((rest, Scale::List)) => (rest, Spacing::List),
        None => (i, Spacing::Linear),
    };
    let (mut values, mut at) = (Vec::new(), rest);
    while let Ok((rest, value)) = operand::value(separator(at)) {
        values.push(value);
        at = rest;
    }
    let whole = at_end(separator(at));
    let card = Frequencies {
        spacing,
        span: between(start, at),
        values,
    };
    let enough = match spacing {
        Spacing::List => !card.values.is_empty(),
        _ => card.values.len() == 3,
    };
    if whole && enough {
        if let ([points, ..], true) = (&card.values[..], rest.fragment() == i.fragment()) {
            let fault = Diagnostic::warning(
                "bad-ac",
                points.span,
                "this `.ac` does not say how its points are spaced",
            )
            .label("taken as `lin`")
            .help("write `dec`, `oct` or `lin` before the number of points");
            tell(start, fault);
        }
        return (separator(at), Dot::statement(Statement::Ac(card)));
    }
    let fault = Diagnostic::warning("bad-ac", card.span, "this `.ac` is left out")
        .label("a number of points, the first and the last frequency are needed")
        .help("write `.ac dec 20 10 1meg`");
    tell(start, fault);
    (skip(i), Dot::Nothing)
}

/// A fault of a sweep whose first value is a word: with the hint that it was to say how the values are spaced.
fn spelled(fault: nom::Err<Fault>, first: &Expr) -> nom::Err<Fault> {
    match spacing_meant(first) {
        Some(meant) => fault.map(|fault| fault.helped(&format!("did you mean `{meant}`?"))),
        None => fault,
    }
}

#[derive(Clone, Copy)]
enum Scale {
    Linear,
    Logarithmic(u32),
    List,
}

fn scale(i: Input<'_>) -> Option<(Input<'_>, Scale)> {
    let (rest, name) = word(separator(i)).ok()?;
    let scale = match name.text.as_str() {
        "lin" => Scale::Linear,
        "dec" => Scale::Logarithmic(10),
        "oct" => Scale::Logarithmic(2),
        "list" => Scale::List,
        _ => return None,
    };
    Some((rest, scale))
}

/// What follows the type in LTspice's `npn 2n2222(bf)`.
fn model_parameter(i: Input<'_>) -> Option<(Input<'_>, Target)> {
    let (rest, model) = word(i).ok()?;
    let (rest, parameter) = word(symbol(rest, '(')?).ok()?;
    Some((symbol(rest, ')')?, Target::Model(model, parameter)))
}

fn sweep(i: Input<'_>) -> Parsed<'_, Sweep> {
    let start = blank(separator(i));
    let (rest, before) = match scale(start) {
        Some((rest, scale)) => (rest, Some(scale)),
        None => (start, None),
    };
    let (rest, name) = expect_word(separator(rest), "a source, `param name` or `temp`")?;
    let (rest, target) = match name.text.as_str() {
        "param" => {
            let (rest, name) = expect_word(rest, "the name of the parameter")?;
            (rest, Target::Param(name))
        }
        "temp" | "temper" => (rest, Target::Temperature(name.span)),
        _ => (rest, Target::Element(name)),
    };
    let (rest, target) = match model_parameter(rest) {
        Some((rest, target)) => (rest, target),
        None => (rest, target),
    };
    let (mut at, scale) = match (before, scale(rest)) {
        (None, Some((rest, scale))) => (rest, scale),
        (before, _) => (rest, before.unwrap_or(Scale::Linear)),
    };
    let mut values: Vec<Expr> = Vec::new();
    loop {
        let next = separator(at);
        let full = !matches!(scale, Scale::List) && values.len() == 3;
        if full || at_end(next) {
            break;
        }
        let (rest, value) = operand::value(next).map_err(|e| match e {
            nom::Err::Error(_) => missing(next, "a value"),
            e => e,
        })?;
        values.push(value);
        at = rest;
    }
    let span = between(start, at);
    let points = match scale {
        Scale::List if values.is_empty() => return Err(missing(at, "a value")),
        Scale::List => Points::List(values),
        Scale::Linear | Scale::Logarithmic(_) => {
            let range: [Expr; 3] = values.try_into().map_err(|values: Vec<Expr>| {
                let what = match (values.len(), scale) {
                    (0, _) => "the first value",
                    (1, _) => "the last value",
                    (_, Scale::Linear) => "the increment",
                    _ => "the number of values per decade or octave",
                };
                let fault = if at_end(at) {
                    missing(at, what)
                } else {
                    let fault =
                        Diagnostic::error("missing", next_word(at), format!("expected {what}"));
                    refuse(fault.label("expected a value"))
                };
                match values.first() {
                    Some(first) => spelled(fault, first),
                    None => fault,
                }
            })?;
            match scale {
                Scale::Logarithmic(base) => Points::Logarithmic { base, range },
                _ => Points::Linear(range),
            }
        }
    };
    Ok((
        at,
        Sweep {
            target,
            points,
            span,
        },
    ))
}

/// `.pss gfreq tstab oscnob psspoints …`. What is no such card is left out, as other analyses are that do not change a transient.
pub(super) fn pss<'a>(start: Input<'a>, i: Input<'a>) -> (Input<'a>, Dot) {
    let value = |at| operand::value(separator(at)).ok();
    let node = |at| {
        let named = word(separator(at)).map(|(rest, _)| rest).ok();
        named.or_else(|| Some(value(at)?.0))
    };
    let card = || {
        let (rest, frequency) = value(i)?;
        let (rest, settling) = value(rest)?;
        let (mut at, points) = value(node(rest)?)?;
        let mut uic = false;
        // The number of harmonics and how ngspice iterates.
        while !at_end(separator(at)) {
            at = match word(separator(at)) {
                Ok((rest, name)) if name.text == "uic" => {
                    uic = true;
                    rest
                }
                _ => value(at)?.0,
            };
        }
        let span = between(start, at);
        let card = Pss {
            frequency,
            settling,
            points,
            uic,
            span,
        };
        Some((
            separator(at),
            Dot::statement(Statement::Pss(Box::new(card))),
        ))
    };
    card().unwrap_or_else(|| {
        let rest = skip(i);
        let message = "`.pss` is not read, as a value is missing";
        let warning = Diagnostic::warning("ignored", between(start, rest), message);
        let warning = warning.label("frequency, time to settle, node and points are needed");
        tell(
            start,
            warning.help("write `.pss 1k 10m out 100 10`: frequency, time to settle, node, points, harmonics"),
        );
        (rest, Dot::Skipped)
    })
}
