//! `.param`, `.func`, `.model`, `.subckt`.

use super::Dot;
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{Assign, Func, Model, Name, Statement};
use crate::netlist::card::{assign, assignment_follows, assigns};
use crate::netlist::lex::{
    Input, Parsed, at_end, between, blank, end, expect_word, missing, node, refuse, separator,
    symbol, tell, word,
};
use crate::netlist::{expr, operand};

/// `.param a = 1 b={2*a} c 3 f(x)={x^2}`.
pub(super) fn params<'a>(i: Input<'a>, directive: &Name) -> Parsed<'a, Dot> {
    let mut all = Vec::new();
    let mut at = separator(i);
    while !at_end(at) {
        let (rest, name) = expect_word(at, "`name=value`")?;
        if symbol(rest, '(').is_some() && all.is_empty() {
            return func(at);
        }
        let bare = separator(rest);
        let written = match symbol(rest, '=') {
            Some(rest) => Some(blank(rest)),
            // `.param r 100`.
            None if at_end(bare) || assignment_follows(bare) => None,
            None => Some(bare),
        };
        let value = written.map(|written| {
            let (rest, value) = expr::expr(written)?;
            operand::without_comma(written, rest)?;
            Ok((rest, value))
        });
        let value = value.transpose()?;
        let Some((rest, value)) = value else {
            let fault = Diagnostic::error(
                "missing",
                name.span,
                format!("`{}` has no value", name.text),
            );
            return Err(refuse(
                fault.label(format!("expected `{}=value`", name.text)),
            ));
        };
        all.push(Assign {
            name,
            value: Some(value),
        });
        at = separator(rest);
    }
    if all.is_empty() {
        return Err(missing(
            at,
            &format!("`name=value` after `{}`", directive.text),
        ));
    }
    Ok((at, Dot::statement(Statement::Param(all))))
}

/// `.func f(x,y) {…}`, `.func f(x) = …`.
pub(super) fn func(i: Input<'_>) -> Parsed<'_, Dot> {
    let (rest, name) = expect_word(i, "the name of the function")?;
    let Some(mut at) = symbol(rest, '(') else {
        return Err(missing(rest, "`(` and the arguments"));
    };
    let mut args = Vec::new();
    let rest = loop {
        at = separator(at);
        if let Some(rest) = symbol(at, ')') {
            break rest;
        }
        let (rest, arg) = expect_word(at, "an argument or `)`")?;
        args.push(arg);
        at = rest;
    };
    let (rest, body) = expr::expr(symbol(rest, '=').unwrap_or(rest))?;
    let (rest, ()) = end(rest)?;
    Ok((
        rest,
        Dot::statement(Statement::Func(Func { name, args, body })),
    ))
}

/// `.model name type (a=1 b=2 flag)`, parentheses (or braces) and commas optional.
pub(super) fn model(i: Input<'_>) -> Parsed<'_, Dot> {
    let (rest, name) = expect_word(i, "the name of the model")?;
    let (mut rest, mut kind) = expect_word(rest, "the type of the model")?;
    let mut base = None;
    if let Some(of) = kind.text.strip_prefix("ako:") {
        if of.is_empty() {
            let (next, name) = expect_word(rest, "the model to extend")?;
            (rest, base) = (next, Some(name));
        } else {
            base = Some(Name {
                text: of.to_string(),
                span: kind.span,
            });
        }
        kind = Name {
            text: String::new(),
            span: kind.span,
        };
        if let Ok((next, name)) = word(rest)
            && symbol(next, '=').is_none()
        {
            (rest, kind) = (next, name);
        }
    }
    let mut params = Vec::new();
    let mut depth = 0_i64;
    let mut at = rest;
    loop {
        at = separator(at);
        if let Some(next) = symbol(at, '(').or_else(|| symbol(at, '{')) {
            depth += 1;
            at = next;
        } else if let Some(next) = symbol(at, ')').or_else(|| symbol(at, '}')) {
            depth -= 1;
            at = next;
        } else if at_end(at) {
            break;
        } else {
            let (next, one) = assign(at).map_err(|e| match e {
                nom::Err::Error(_) => missing(at, "`name=value`"),
                e => e,
            })?;
            params.push(one);
            at = next;
        }
    }
    if depth != 0 {
        let (what, help) = if depth > 0 {
            ("unclosed `(`", "`)`")
        } else {
            ("a `)` too many", "nothing")
        };
        tell(
            at,
            Diagnostic::warning(
                "unbalanced",
                between(blank(i), at),
                format!("model `{}` has {what}", name.text),
            )
            .label("read as if it were balanced")
            .help(format!("the card should end with {help}")),
        );
    }
    Ok((
        at,
        Dot::statement(Statement::Model(Model {
            name,
            kind,
            base,
            params,
        })),
    ))
}

/// `.subckt name nodes [params:] a=1 …`.
pub(super) fn subckt(i: Input<'_>) -> Parsed<'_, Dot> {
    let (mut at, name) = expect_word(i, "the name of the subcircuit")?;
    let mut nodes = Vec::new();
    loop {
        at = separator(at);
        if let Some(rest) = symbol(at, '(').or_else(|| symbol(at, ')')) {
            at = rest;
            continue;
        }
        if at_end(at) {
            break;
        }
        let (rest, one) = node(at).map_err(|_| missing(at, "a node or `name=value`"))?;
        if symbol(rest, '=').is_some() {
            break;
        }
        at = rest;
        if matches!(one.text.as_str(), "params:" | "param:") {
            break;
        }
        nodes.push(one);
    }
    let (at, params) = assigns(at)?;
    let (at, ()) = end(at)?;
    Ok((at, Dot::Subckt(name, nodes, params)))
}
