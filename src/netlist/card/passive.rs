//! R, C, L and K.

use nom::Input as _;

use super::{Body, assignment_follows, assigns, keyword, nodes};
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{Assign, Device, Expr, ExprKind, Name};
use crate::netlist::expr::expr;
use crate::netlist::lex::{
    Input, Parsed, ahead, at_end, blank, ends_word, missing, next_word, refuse, separator, symbol,
    tell, word,
};
use crate::netlist::operand;

/// `R1 a b 1k`, `R1 a b R=1k`, `R1 a b {r} model tc1=…`.
pub(super) fn passive<'a>(i: Input<'a>, name: &Name) -> Parsed<'a, Body> {
    let (mut at, nodes) = nodes(i, 2, "node")?;
    let mut values: Vec<Expr> = Vec::with_capacity(1);
    while values.len() < 2
        && !at_end(at)
        && !assignment_follows(at)
        && keyword(at, "noiseless").is_none()
    {
        let (rest, value) = operand::value(at).map_err(|e| match e {
            nom::Err::Error(_) => missing(at, "a value"),
            e => e,
        })?;
        warn_of_suffix(at, name, &value);
        values.push(value);
        at = rest;
    }
    if values.is_empty() && at_end(at) {
        let (a, b) = (&nodes[0].text, &nodes[1].text);
        return Err(refuse(
            Diagnostic::error(
                "missing",
                next_word(at),
                format!("`{}` has no value", name.text),
            )
            .label("a value should follow")
            .help(format!(
                "`{a}` and `{b}` were read as its nodes; write `{} {a} {b} VALUE`",
                name.text
            )),
        ));
    }
    let (at, own) = own_expression(at);
    let (at, others) = assigns(at)?;
    let args = own.into_iter().chain(others).collect();
    Ok((at, (nodes, Device::Passive { values, args })))
}

/// `R=100*x`, `C=…`, `L=…`, `Q=…`: an expression without braces, which LTspice takes there. What is a plain value is left.
fn own_expression(i: Input<'_>) -> (Input<'_>, Option<Assign>) {
    const OPERATORS: &[char] = &[
        '+', '-', '*', '/', '^', '<', '>', '?', '!', '&', '|', '%', '(',
    ];
    let found = || {
        let (rest, name) = word(separator(i)).ok()?;
        let open = symbol(rest, '=').filter(|_| matches!(&*name.text, "r" | "c" | "l" | "q"))?;
        let is_plain = operand::value(open).is_ok_and(|(after, value)| {
            let name = match &value.kind {
                ExprKind::Name(name) => name,
                _ => "",
            };
            !name.contains(OPERATORS) && !blank(after).fragment().starts_with(OPERATORS)
        });
        let (rest, value) = expr(open).ok().filter(|_| !is_plain)?;
        let value = Some(value);
        Some((rest, Assign { name, value }))
    };
    found().map_or((i, None), |(rest, own)| (rest, Some(own)))
}

/// Suffixes that SPICE reads otherwise than people do: 1M Ω is 1 mΩ, 1F is 1 fF, 1a is 1.
pub(super) fn warn_of_suffix(at: Input<'_>, name: &Name, value: &Expr) {
    let at = separator(at);
    let ExprKind::Number(number) = &value.kind else {
        return;
    };
    let written = at.fragment();
    let written = &written[..written.find(ends_word).unwrap_or(written.len())];
    // `1MOhm` means to be no more than `1M`.
    let end = written.trim_end_matches(|c: char| !c.is_ascii_digit() && c != '.');
    let unit = &written[end.len()..];
    let Some(last) = unit.chars().next() else {
        return;
    };
    let rest = unit[last.len_utf8()..].to_lowercase();
    let own = match last {
        'M' => ["", "ohm", "ohms", "ω", "r"].contains(&rest.as_str()),
        'F' => ["", "arad", "arads"].contains(&rest.as_str()),
        _ => rest.is_empty(),
    };
    let digits = end;
    if number.f64 == 0.0 || !own || digits.is_empty() {
        return;
    }
    let capital = "SPICE suffixes know no capitals";
    let (code, message, label, help) = match (name.text.chars().next(), last) {
        (Some('r'), 'M') => (
            "suffix-m",
            format!("`{written}` is {digits} milli"),
            capital,
            format!("write `{digits}Meg` for {digits} MΩ, `{digits}m` for {digits} mΩ"),
        ),
        (Some('r' | 'l'), 'F') => (
            "suffix-f",
            format!("`{written}` is {digits} femto"),
            capital,
            format!("write `{digits}`, or `{digits}f` for {digits} femto"),
        ),
        (Some('c'), 'F') => (
            "suffix-f",
            format!("`{written}` is {digits} femto"),
            capital,
            format!("write `{digits}` for {digits} F, `{digits}f` for {digits} fF"),
        ),
        (Some('r' | 'c' | 'l'), 'a' | 'A') => (
            "suffix-a",
            format!("`{written}` is {digits}, its `{last}` the unit ampere"),
            "not atto",
            format!("write `{digits}e-18` for {digits} atto"),
        ),
        _ => return,
    };
    let warning = Diagnostic::warning(code, value.span, message);
    tell(at, warning.label(label).help(help));
}

/// `K1 L1 L2 0.99`, `K1 (L1 L2 L3) {k}`.
pub(super) fn coupling<'a>(i: Input<'a>, name: &Name) -> Parsed<'a, Body> {
    let mut all: Vec<Expr> = Vec::new();
    let mut at = i;
    loop {
        at = separator(at);
        if at.fragment().starts_with(['(', ')']) {
            at = at.take_from(1);
        } else if at_end(at) {
            break;
        } else {
            let (rest, value) = operand::item(at).map_err(|e| match e {
                nom::Err::Error(_) => missing(at, "an inductor or the coefficient"),
                e => e,
            })?;
            all.push(value);
            at = rest;
        }
    }
    let Some(k) = all.pop().filter(|_| all.len() >= 2) else {
        return Err(refuse(
            Diagnostic::error(
                "missing",
                ahead(i, i.fragment().trim_end().len()),
                format!("`{}` is incomplete", name.text),
            )
            .label("needs two inductors and the coefficient")
            .help(format!("write `{} L1 L2 0.99`", name.text)),
        ));
    };
    let mut inductors = Vec::with_capacity(all.len());
    for one in all {
        let ExprKind::Name(text) = one.kind else {
            return Err(refuse(
                Diagnostic::error("bad-name", one.span, "this is not the name of an inductor")
                    .label("expected an inductor"),
            ));
        };
        inductors.push(Name {
            text,
            span: one.span,
        });
    }
    Ok((at, (Vec::new(), Device::Coupling { inductors, k })))
}
