//! Element cards: one parser per letter. After the letter nothing is tried again: a card is read or refused.

mod controlled;
mod device;
mod passive;
mod source;

use nom::Input as _;

use super::ast::{Assign, Device, Element, Expr, ExprKind, Name};
use super::lex::{
    Fault, Input, Parsed, ahead, at_end, blank, end, missing, node, refuse, separator, symbol, word,
};
use super::suggest::directive;
use super::{expr, operand, value};
use crate::diagnostic::{Diagnostic, Span};

/// What an element letter stands for, as `a resistor`.
pub(crate) const fn describe(letter: char) -> &'static str {
    match letter {
        'r' => "a resistor",
        'c' => "a capacitor",
        'l' => "an inductor",
        'k' => "a coupling of inductors",
        'v' => "a voltage source",
        'i' => "a current source",
        'e' => "a voltage-controlled voltage source",
        'f' => "a current-controlled current source",
        'g' => "a voltage-controlled current source",
        'h' => "a current-controlled voltage source",
        'b' => "a behavioural source",
        'd' => "a diode",
        's' => "a voltage-controlled switch",
        'w' => "a current-controlled switch",
        'x' => "a subcircuit",
        'm' => "a MOSFET",
        'q' => "a bipolar transistor",
        'j' => "a JFET",
        'z' => "a MESFET or IGBT",
        't' => "a transmission line",
        'o' => "a lossy transmission line",
        'u' => "a distributed RC line or digital device",
        'a' => "a code model",
        'p' => "a coupled transmission line",
        'y' => "a single lossy line",
        'n' => "a Verilog-A device",
        _ => "an unknown element",
    }
}

/// An element card.
pub(super) fn element(i: Input<'_>) -> Parsed<'_, Element> {
    let start = blank(i);
    let (rest, name) = word(start)?;
    let letter = name.text.chars().next().unwrap_or(' ');
    let parser = match letter {
        'r' | 'c' | 'l' => passive::passive,
        'k' => passive::coupling,
        'v' | 'i' => source::source,
        'e' | 'g' => controlled::by_voltage,
        'f' | 'h' => controlled::by_current,
        'b' => controlled::behavioural,
        'd' => device::diode,
        's' => device::voltage_switch,
        'w' => device::current_switch,
        'x' => device::call,
        'm' | 'q' | 'j' | 'z' => device::transistor,
        'a' => device::code_model,
        't' => device::line,
        'o' | 'u' | 'p' | 'y' | 'n' => device::unsupported,
        _ => {
            let message = format!(
                "`{}` is no element: no element begins with `{letter}`",
                name.text
            );
            return Err(refuse(
                Diagnostic::error("unknown-element", name.span, message)
                    .label("unknown element letter")
                    .help("elements are R C L K V I E F G H B D S W M Q J Z T X; a comment begins with `*` or `;`"),
            ));
        }
    };
    let read = parser(rest, &name).and_then(|(rest, body)| Ok((end(rest)?.0, body)));
    let (rest, (nodes, device)) = read.map_err(|fault| match directive(&name.text) {
        Some(meant) => fault.map(|fault| fault.helped(&format!("did you mean `{meant}`?"))),
        None => fault,
    })?;
    Ok((
        rest,
        Element {
            name,
            nodes,
            device,
            span: trimmed(start),
        },
    ))
}

/// The place of a whole card.
fn trimmed(start: Input<'_>) -> crate::diagnostic::Span {
    ahead(start, start.fragment().trim_end().len())
}

/// Nodes and the rest of a card.
type Body = (Vec<Name>, Device);

/// A number of node names, with or without parentheses and commas around them.
fn nodes<'a>(i: Input<'a>, count: usize, what: &str) -> Parsed<'a, Vec<Name>> {
    let mut names = Vec::with_capacity(count);
    let mut open = None;
    let mut at = i;
    for k in 0..count {
        at = separator(at);
        if open.is_none()
            && let Some(rest) = symbol(at, '(')
        {
            open = Some(at);
            at = separator(rest);
        }
        let Ok((rest, name)) = node(at) else {
            let which = ["the first", "the second", "the third", "the fourth"][k.min(3)];
            return Err(missing(at, &format!("{which} {what}")));
        };
        names.push(name);
        at = rest;
        if open.is_some()
            && let Some(rest) = symbol(separator(at), ')')
        {
            open = None;
            at = rest;
        }
    }
    if let Some(open) = open {
        return Err(refuse(
            Diagnostic::error("unbalanced", ahead(open, 1), "`(` is never closed")
                .label("no `)` after the nodes"),
        ));
    }
    Ok((at, names))
}

/// Whether a word and `=` come next.
pub(super) fn assignment_follows(i: Input<'_>) -> bool {
    word(i).is_ok_and(|(rest, _)| symbol(rest, '=').is_some())
}

/// `name=value`, or a flag alone.
pub(super) fn assign(i: Input<'_>) -> Parsed<'_, Assign> {
    let (rest, name) = word(i)?;
    let Some(rest) = symbol(rest, '=') else {
        return Ok((rest, Assign { name, value: None }));
    };
    if let Some(open) = symbol(rest, '[') {
        let (rest, value) = vector(open)?;
        let value = Some(value);
        return Ok((rest, Assign { name, value }));
    }
    let list = name.text == "tc";
    let (mut next, value) = if let ("tol", Some((next, value))) =
        (name.text.as_str(), percent(rest))
    {
        Ok((next, value))
    } else if matches!(name.text.as_str(), "flux" | "q") {
        expr::expr(rest)
    } else if list {
        operand::item(rest)
    } else {
        operand::lenient(rest)
    }
    .map_err(|e| {
        if e == nom::Err::Error(Fault::Mismatch) {
            missing(rest, &format!("the value of `{}`", name.text))
                .map(|fault| fault.helped(&format!("write `{}=VALUE`, or take it out", name.text)))
        } else {
            e
        }
    })?;
    let mut values = vec![value];
    while list && let Some(comma) = symbol(next, ',') {
        let (after, value) = operand::item(comma)?;
        values.push(value);
        next = after;
    }
    let value = if values.len() == 1 {
        values.pop()
    } else {
        let start = blank(rest);
        let length = start.fragment().len() - next.fragment().len();
        Some(bracketed(values, ahead(start, length)))
    };
    Ok((next, Assign { name, value }))
}

/// A number with a percent sign, as LTspice writes tolerances.
fn percent(i: Input<'_>) -> Option<(Input<'_>, Expr)> {
    let start = blank(i);
    let (rest, name) = word(start).ok()?;
    let value = value::parse(name.text.strip_suffix('%')?).ok()?;
    let kind = ExprKind::Number(value);
    Some((
        rest,
        Expr {
            kind,
            span: name.span,
        },
    ))
}

/// The values up to `]`, as a call of a function of the name `[]`.
fn vector(open: Input<'_>) -> Parsed<'_, Expr> {
    let Some(length) = open.fragment().find(']') else {
        return Err(missing(open, "`]`"));
    };
    let inside = open.take(length);
    let (mut list, mut at) = (Vec::new(), separator(inside));
    while !at_end(at) {
        let (rest, value) = operand::item(at)?;
        list.push(value);
        at = separator(rest);
    }
    let value = bracketed(list, ahead(open, length));
    Ok((open.take_from(length + 1), value))
}

fn bracketed(list: Vec<Expr>, span: Span) -> Expr {
    let text = "[]".into();
    let kind = ExprKind::Call(Box::new(Name { text, span }), list);
    Expr { kind, span }
}

/// All that is left of a card as `name=value` and flags, blanks or commas between.
pub(super) fn assigns(i: Input<'_>) -> Parsed<'_, Vec<Assign>> {
    let mut all = Vec::new();
    let mut at = separator(i);
    while !at_end(at) {
        match assign(at) {
            Ok((rest, one)) => {
                all.push(one);
                at = separator(rest);
            }
            Err(nom::Err::Error(_)) => break,
            Err(e) => return Err(e),
        }
    }
    Ok((at, all))
}

/// Numbers up to the end of the card, parentheses and commas ignored; `what` names one of them.
fn numbers<'a>(i: Input<'a>, what: &str) -> Parsed<'a, Vec<super::ast::Expr>> {
    let mut all = Vec::new();
    let mut at = i;
    loop {
        at = separator(at);
        if at.fragment().starts_with(['(', ')']) {
            at = at.take_from(1);
        } else if at_end(at) || assignment_follows(at) {
            return Ok((at, all));
        } else {
            let (rest, value) = operand::item(at).map_err(|e| match e {
                nom::Err::Error(_) => missing(at, what),
                e => e,
            })?;
            all.push(value);
            at = rest;
        }
    }
}

/// A keyword at this place, any case, as a whole word.
fn keyword<'a>(i: Input<'a>, text: &str) -> Option<Input<'a>> {
    word(i)
        .ok()
        .filter(|(_, name)| name.text == text)
        .map(|(rest, _)| rest)
}

/// A value that is expected; the message says what it should be.
fn expect_value<'a>(i: Input<'a>, what: &str) -> Parsed<'a, super::ast::Expr> {
    operand::value(i).map_err(|e| match e {
        nom::Err::Error(_) => missing(i, what),
        e => e,
    })
}
