//! Values on cards: numbers, braced expressions, names, texts.

use nom::Input as _;

use super::ast::{Expr, ExprKind, Unary};
use super::expr::expr;
use super::lex::{
    Fault, Input, Parsed, ahead, at_end, between, blank, mismatch, next_word, refuse, symbol, tell,
    word, written,
};
use super::value;
use crate::diagnostic::Diagnostic;

/// `{…}` or `'…'`.
pub(super) fn braced(i: Input<'_>) -> Parsed<'_, Expr> {
    let start = blank(i);
    let close = match start.fragment().chars().next() {
        Some('{') => '}',
        Some('\'') => '\'',
        _ => return mismatch(),
    };
    let (rest, mut inner) = expr(start.take_from(1))?;
    let Some(rest) = symbol(rest, close) else {
        let fault = if at_end(rest) {
            Diagnostic::error(
                "unbalanced",
                ahead(start, 1),
                format!(
                    "`{}` is never closed",
                    start.fragment().chars().next().unwrap_or(close)
                ),
            )
            .label(format!("no `{close}` follows"))
            .help("close it on this card; a card goes on in the next line after a `+`")
        } else {
            Diagnostic::error(
                "bad-expression",
                next_word(rest),
                "this does not continue the expression",
            )
            .label("expected an operator here")
            .help("join what stands side by side by an operator: `+ - * / ^`")
        };
        return Err(refuse(fault));
    };
    inner.span = between(start, rest);
    Ok((rest, inner))
}

/// A value on a card: a number, `{…}`, `'…'`, or a bare name.
pub(super) fn value(i: Input<'_>) -> Parsed<'_, Expr> {
    let start = blank(i);
    let (rest, item) = item(start)?;
    without_comma(start, rest)?;
    Ok((rest, item))
}

/// # Errors
/// After what was read from `start` a comma and a digit come.
pub(super) fn without_comma(start: Input<'_>, rest: Input<'_>) -> Result<(), nom::Err<Fault>> {
    let digit = |c: char| c.is_ascii_digit();
    let comma = rest.fragment().strip_prefix(',');
    if !comma.is_some_and(|after| after.starts_with(digit)) {
        return Ok(());
    }
    let (after, _) = word(rest.take_from(1))?;
    let span = between(start, after);
    let text = written(start, after);
    let message = format!("`{text}` has a decimal comma");
    Err(refuse(
        Diagnostic::error("decimal-comma", span, message)
            .label("not a number")
            .help(format!("write `{}`", with_a_point(text))),
    ))
}

/// The number with its last separator as the decimal point, and without those before it, which part its thousands.
fn with_a_point(text: &str) -> String {
    let point = text.rfind(['.', ',']);
    let digit = |(at, c): (usize, char)| match c {
        '.' | ',' => (point == Some(at)).then_some('.'),
        _ => Some(c),
    };
    text.char_indices().filter_map(digit).collect()
}

/// The same in a list, where a comma separates.
pub(super) fn item(i: Input<'_>) -> Parsed<'_, Expr> {
    let start = blank(i);
    if start.fragment().starts_with(['{', '\'']) {
        return braced(start);
    }
    if start.fragment().starts_with('"') {
        return quoted(start);
    }
    for sign in ["-", "+"] {
        if start.fragment().starts_with(sign) && start.fragment()[1..].starts_with(['{', '\'']) {
            let (rest, inner) = braced(start.take_from(1))?;
            let span = between(start, rest);
            let kind = if sign == "-" {
                ExprKind::Unary(Unary::Minus, Box::new(inner))
            } else {
                inner.kind
            };
            return Ok((rest, Expr { kind, span }));
        }
    }
    let (rest, name) = word(start)?;
    let text = written(start, rest);
    if !text.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.')) {
        return Ok((
            rest,
            Expr {
                kind: ExprKind::Name(name.text),
                span: name.span,
            },
        ));
    }
    match value::parse(text) {
        Ok(value) => {
            warn_of_unit(start, text);
            Ok((
                rest,
                Expr {
                    kind: ExprKind::Number(value),
                    span: name.span,
                },
            ))
        }
        // `-name`: a negated parameter.
        Err(value::NumberError::NoDigits)
            if text.len() > 1 && text[1..].starts_with(char::is_alphabetic) =>
        {
            let inner = Expr {
                kind: ExprKind::Name(name.text[1..].to_string()),
                span: name.span,
            };
            let kind = if text.starts_with('-') {
                ExprKind::Unary(Unary::Minus, Box::new(inner))
            } else {
                inner.kind
            };
            Ok((
                rest,
                Expr {
                    kind,
                    span: name.span,
                },
            ))
        }
        Err(error) => Err(refuse(bad_number(start, text, error))),
    }
}

/// A value that may be any text (`mfg=GI`, `type=1N4148x`): what is no number is kept as text.
pub(super) fn lenient(i: Input<'_>) -> Parsed<'_, Expr> {
    match value(i) {
        Err(nom::Err::Failure(Fault::Told(fault)))
            if fault.code == "bad-number" && !is_braced(i) =>
        {
            let (rest, name) = word(i)?;
            Ok((
                rest,
                Expr {
                    kind: ExprKind::Text(name.text),
                    span: name.span,
                },
            ))
        }
        other => other,
    }
}

fn is_braced(i: Input<'_>) -> bool {
    blank(i).fragment().starts_with(['{', '\''])
}

/// `"…"`: a text.
pub(super) fn quoted(i: Input<'_>) -> Parsed<'_, Expr> {
    let start = blank(i);
    let inner = start.fragment().strip_prefix('"');
    let Some((inner, length)) = inner.and_then(|text| text.find('"').map(|n| (text, n))) else {
        return mismatch();
    };
    let rest = start.take_from(length + 2);
    Ok((
        rest,
        Expr {
            kind: ExprKind::Text(inner[..length].to_string()),
            span: between(start, rest),
        },
    ))
}

/// Letters behind a number that are no unit change nothing: `22O` is 22.
pub(super) fn warn_of_unit(start: Input<'_>, written: &str) {
    let Some(letters) = value::no_unit(written) else {
        return;
    };
    let counts = &written[..written.len() - letters.len()];
    let span = ahead(start, written.len());
    let message = format!("`{written}` is read as {counts}: `{letters}` is no unit");
    let zero = format!("write `{counts}`, or `{counts}0` if the letter is a zero");
    let help = match letters {
        "o" | "O" => zero,
        _ => format!("write `{counts}`, or a suffix (t g meg k m u n p f) and a unit"),
    };
    let warning = Diagnostic::warning("no-unit", span, message);
    tell(start, warning.label("SPICE passes over it").help(help));
}

pub(super) fn bad_number(start: Input<'_>, written: &str, error: value::NumberError) -> Diagnostic {
    let span = ahead(start, written.len());
    let fault = Diagnostic::error("bad-number", span, format!("`{written}` is not a number"));
    let value::NumberError::Junk(at) = error else {
        return fault.label(error.to_string());
    };
    let fault = fault.label(format!(
        "`{}` does not belong to the number",
        &written[at..]
    ));
    if written[at..].starts_with(['*', '/', '+', '-', '^']) {
        fault.help(format!("put an expression into braces: `{{{written}}}`"))
    } else {
        fault.help("write digits, a suffix (t g meg k m u n p f) and a unit: `4.7k`, `4k7`, `10uF`")
    }
}
