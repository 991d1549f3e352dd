//! Expressions: `{2*pi*f}`, `'a+b'`, `V(a)>2 ? 1 : 0`.
//!
//! From loose to tight: `?:`, `||`, `&&`, comparisons, `+ -`, `* / %`, unary `- + !`, `^` and `**` (to the right).

use nom::Input as _;

use super::ast::{Binary, Expr, ExprKind, Name, Signal, Unary};
use super::lex::{
    Fault, Input, Line, Parsed, State, ahead, at_end, between, blank, ends_word, input, missing,
    next_word, refuse, symbol,
};
use super::operand::{bad_number, braced, quoted, warn_of_unit};
use super::value;
use crate::diagnostic::{Diagnostic, FileId};

/// Deepest nesting of parentheses, calls and signs in one expression.
const MAX_DEPTH: usize = 64;
/// Most operators in one expression.
const MAX_OPERATORS: usize = 500;

/// An expression without braces, as on the right of `.param a = 1 / f`; stops where it is complete.
pub(super) fn expr(i: Input<'_>) -> Parsed<'_, Expr> {
    let start = i;
    if start.extra.state.depth.get() == 0 {
        start.extra.state.operators.set(0);
    }
    nested(start, ternary)
}

/// An expression that is the whole text, for files that are no netlists.
///
/// # Errors
/// What is wrong with it.
pub fn expression(text: &str) -> Result<Expr, Box<Diagnostic>> {
    let line = Line {
        file: FileId(0),
        start: 0,
        text: text.to_owned(),
        pieces: Vec::new(),
    };
    let state = State::default();
    let fault = match expr(input(&line, &state)) {
        Ok((rest, found)) if at_end(rest) => return Ok(found),
        Ok((rest, _)) => Diagnostic::error(
            "bad-expression",
            next_word(rest),
            "this does not continue the expression",
        ),
        Err(nom::Err::Error(Fault::Told(told)) | nom::Err::Failure(Fault::Told(told))) => {
            return Err(told);
        }
        Err(_) => Diagnostic::error("bad-expression", None, "this is no expression"),
    };
    Err(Box::new(fault))
}

/// Runs a parser one level deeper.
fn nested<'a>(i: Input<'a>, parser: fn(Input<'a>) -> Parsed<'a, Expr>) -> Parsed<'a, Expr> {
    let depth = &i.extra.state.depth;
    if depth.get() >= MAX_DEPTH {
        return Err(refuse(
            Diagnostic::error(
                "too-deep",
                next_word(i),
                format!("the expression is nested more than {MAX_DEPTH} levels"),
            )
            .label("too deep here"),
        ));
    }
    depth.set(depth.get() + 1);
    let result = parser(i);
    depth.set(depth.get() - 1);
    result
}

fn ternary(i: Input<'_>) -> Parsed<'_, Expr> {
    let start = blank(i);
    let (rest, condition) = climb(start, 0)?;
    let Some(rest) = symbol(rest, '?') else {
        return Ok((rest, condition));
    };
    let (rest, then) = nested(rest, ternary)?;
    let Some(rest) = symbol(rest, ':') else {
        return Err(missing(rest, "`:` and the other value"));
    };
    let (rest, otherwise) = nested(rest, ternary)?;
    let kind = ExprKind::If(Box::new([condition, then, otherwise]));
    Ok((
        rest,
        Expr {
            kind,
            span: between(start, rest),
        },
    ))
}

/// Operators with their level; longer ones first.
const OPERATORS: [(&str, Binary, u8); 18] = [
    ("||", Binary::Or, 0),
    ("|", Binary::Or, 0),
    ("&&", Binary::And, 1),
    ("&", Binary::And, 1),
    ("==", Binary::Equal, 2),
    ("!=", Binary::NotEqual, 2),
    ("<>", Binary::NotEqual, 2),
    ("<=", Binary::LessEqual, 2),
    (">=", Binary::GreaterEqual, 2),
    ("<", Binary::Less, 2),
    (">", Binary::Greater, 2),
    ("+", Binary::Add, 3),
    ("-", Binary::Sub, 3),
    ("**", Binary::Pow, 5),
    ("*", Binary::Mul, 4),
    ("/", Binary::Div, 4),
    ("%", Binary::Rem, 4),
    ("^", Binary::Pow, 5),
];

/// The level of a power, which binds to the right.
const POWER: u8 = 5;

/// Precedence climbing: operators of at least this level.
fn climb(i: Input<'_>, level: u8) -> Parsed<'_, Expr> {
    let start = blank(i);
    let (mut rest, mut left) = unary(start)?;
    loop {
        let here = blank(rest);
        let Some(&(text, op, own)) = OPERATORS
            .iter()
            .find(|(text, ..)| here.fragment().starts_with(text))
        else {
            return Ok((rest, left));
        };
        if own < level {
            return Ok((rest, left));
        }
        let count = &here.extra.state.operators;
        count.set(count.get() + 1);
        if count.get() > MAX_OPERATORS {
            let message = format!("the expression has more than {MAX_OPERATORS} operators");
            return Err(refuse(
                Diagnostic::error("too-long", ahead(here, text.len()), message)
                    .label("too long here"),
            ));
        }
        let after = here.take_from(text.len());
        // a^b^c = a^(b^c): the right side takes the next power too.
        let (next, right) = if own == POWER {
            nested(after, |i| climb(i, POWER))?
        } else {
            climb(after, own + 1)?
        };
        left = Expr {
            kind: ExprKind::Binary(op, Box::new(left), Box::new(right)),
            span: between(start, next),
        };
        rest = next;
    }
}

fn unary(i: Input<'_>) -> Parsed<'_, Expr> {
    let start = blank(i);
    let op = match start.fragment().chars().next() {
        Some('-') => Some(Unary::Minus),
        Some('+') => None,
        Some('!' | '~') => Some(Unary::Not),
        _ => return primary(start),
    };
    // A sign binds looser than a power: −2^2 = −(2^2).
    let (rest, inner) = nested(start.take_from(1), |i| climb(i, POWER))?;
    let span = between(start, rest);
    Ok((
        rest,
        Expr {
            kind: op.map_or(inner.kind.clone(), |op| {
                ExprKind::Unary(op, Box::new(inner))
            }),
            span,
        },
    ))
}

fn primary(i: Input<'_>) -> Parsed<'_, Expr> {
    let start = blank(i);
    let Some(first) = start.fragment().chars().next() else {
        return Err(missing(start, "a value"));
    };
    match first {
        '(' => {
            let (rest, mut inner) = nested(start.take_from(1), ternary)?;
            let Some(rest) = symbol(rest, ')') else {
                return Err(unclosed(start, rest));
            };
            inner.span = between(start, rest);
            Ok((rest, inner))
        }
        '{' | '\'' => braced(start),
        '"' => quoted(start).map_err(|_| missing(start, "a value")),
        '0'..='9' | '.' => number(start),
        c if c.is_alphabetic() || matches!(c, '_' | '@' | '$' | '#') => named(start),
        _ => Err(missing(start, "a value")),
    }
}

/// "`(` is never closed", or what stands in the way of its closing.
fn unclosed(open: Input<'_>, rest: Input<'_>) -> nom::Err<Fault> {
    let ends = at_end(rest) || blank(rest).fragment().starts_with(['}', '\'']);
    refuse(if ends {
        Diagnostic::error("unbalanced", ahead(open, 1), "`(` is never closed")
            .label("no `)` follows")
            .help("put a `)` where the bracket is to end")
    } else {
        Diagnostic::error(
            "bad-expression",
            next_word(rest),
            "this does not continue the expression",
        )
        .label("expected an operator or `)` here")
        .help("join what stands side by side by an operator, `+ - * / ^`, or close the `(`")
    })
}

fn number(start: Input<'_>) -> Parsed<'_, Expr> {
    match value::prefix(start.fragment()) {
        Ok((value, length)) => {
            let rest = start.take_from(length);
            warn_of_unit(start, &start.fragment()[..length]);
            Ok((
                rest,
                Expr {
                    kind: ExprKind::Number(value),
                    span: between(start, rest),
                },
            ))
        }
        Err(error) => {
            let length = start
                .fragment()
                .find(ends_word)
                .unwrap_or(start.fragment().len());
            Err(refuse(bad_number(
                start,
                &start.fragment()[..length.max(1)],
                error,
            )))
        }
    }
}

/// A parameter, a function call, or a voltage or current.
fn named(start: Input<'_>) -> Parsed<'_, Expr> {
    let length = start
        .fragment()
        .find(|c: char| {
            !(c.is_alphanumeric() || matches!(c, '_' | '.' | '@' | '$' | '#' | '[' | ']'))
        })
        .unwrap_or(start.fragment().len());
    let rest = start.take_from(length);
    let name = Name {
        text: start.fragment()[..length].to_lowercase(),
        span: between(start, rest),
    };
    let rest_open = blank(rest);
    let Some(open) = symbol(rest, '(') else {
        return Ok((
            rest,
            Expr {
                kind: ExprKind::Name(name.text),
                span: name.span,
            },
        ));
    };
    if matches!(name.text.as_str(), "v" | "i") {
        let (rest, signal) = signal_arguments(open, &name)?;
        return Ok((
            rest,
            Expr {
                kind: ExprKind::Signal(Box::new(signal)),
                span: between(start, rest),
            },
        ));
    }
    if name.text == "ix" {
        return pin(start, open, name);
    }
    let mut args = Vec::new();
    let mut at = open;
    if let Some(rest) = symbol(at, ')') {
        at = rest;
    } else {
        loop {
            let (rest, arg) = nested(at, ternary)?;
            args.push(arg);
            if let Some(rest) = symbol(rest, ',') {
                at = rest;
            } else if let Some(rest) = symbol(rest, ')') {
                at = rest;
                break;
            } else {
                return Err(unclosed(rest_open, rest));
            }
        }
    }
    Ok((
        at,
        Expr {
            kind: ExprKind::Call(Box::new(name), args),
            span: between(start, at),
        },
    ))
}

/// The inside of `Ix(x1:pin)`, a name with a colon.
fn pin<'a>(start: Input<'a>, open: Input<'a>, function: Name) -> Parsed<'a, Expr> {
    let inside = blank(open);
    let Some((text, _)) = inside.fragment().split_once(')') else {
        return Err(unclosed(open, open));
    };
    let argument = Expr {
        kind: ExprKind::Text(text.trim_end().to_lowercase()),
        span: ahead(inside, text.trim_end().len()),
    };
    let rest = inside.take_from(text.len() + 1);
    let call = Expr {
        kind: ExprKind::Call(Box::new(function), vec![argument]),
        span: between(start, rest),
    };
    Ok((rest, call))
}

/// The inside of `v(…)` or `i(…)`: one or two names, each anything up to a comma or the closing parenthesis.
pub(super) fn signal_arguments<'a>(open: Input<'a>, function: &Name) -> Parsed<'a, Signal> {
    let mut names = Vec::new();
    let mut at = open;
    loop {
        let start = blank(at);
        let mut depth = 0_usize;
        let length = start.fragment().find(|c: char| {
            match c {
                '(' => depth += 1,
                ')' if depth > 0 => depth -= 1,
                ')' | ',' => return depth == 0,
                _ => {}
            }
            false
        });
        let Some(length) = length else {
            return Err(refuse(
                Diagnostic::error(
                    "unbalanced",
                    function.span,
                    format!("`{}(` is never closed", function.text),
                )
                .label("no `)` follows")
                .help("put a `)` where the bracket is to end"),
            ));
        };
        let text = start.fragment()[..length].trim_end();
        let span = ahead(start, text.len());
        if text.is_empty() {
            let what = if function.text == "v" {
                "a node"
            } else {
                "an element"
            };
            return Err(missing(start, what));
        }
        names.push(Name {
            text: text.to_lowercase(),
            span,
        });
        let after = start.take_from(length);
        at = after.take_from(1);
        if after.fragment().starts_with(')') {
            break;
        }
    }
    let mut names = names.into_iter();
    match (names.next(), names.next(), names.next()) {
        (Some(a), b, None) if function.text == "v" => Ok((at, Signal::Voltage(a, b))),
        (Some(name), None, None) => Ok((at, Signal::Current(name))),
        _ => Err(refuse(
            Diagnostic::error(
                "bad-expression",
                function.span,
                format!("`{}` has too many arguments", function.text),
            )
            .label(if function.text == "v" {
                "takes one node or two"
            } else {
                "takes one element"
            }),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<String, String> {
        let line = Line {
            file: FileId(0),
            start: 0,
            text: text.to_string(),
            pieces: Vec::new(),
        };
        let state = State::default();
        match expr(input(&line, &state)) {
            Ok((rest, e)) => Ok(format!("{e}{}", if at_end(rest) { "" } else { " …" })),
            Err(nom::Err::Failure(Fault::Told(d))) => Err(d.message.clone()),
            Err(other) => panic!("{other:?}"),
        }
    }

    #[test]
    fn precedence() {
        for (text, expected) in [
            ("1+2*3", "(1 + (2 * 3))"),
            ("2^3+2**2", "((2 ^ 3) + (2 ^ 2))"),
            ("-2^2", "-(2 ^ 2)"),
            ("2^-1", "(2 ^ -1)"),
            ("a - b - c", "((a - b) - c)"),
            ("a>b ? 1 : c<2 ? 3 : 4", "((a > b) ? 1 : ((c < 2) ? 3 : 4))"),
            ("a>1 && b<2 || !c", "(((a > 1) && (b < 2)) || !c)"),
            (
                "limit(1k*(V(In+)-V(a,b)), -1, i(X1.R1))",
                "limit((1000 * (v(in+) - v(a,b))), -1, i(x1.r1))",
            ),
            ("{1/f}*'g'", "((1 / f) * g)"),
            ("V(Net-(R1-Pad1), 0)", "v(net-(r1-pad1),0)"),
            ("1/f b=3", "(1 / f) …"),
        ] {
            assert_eq!(read(text).as_deref(), Ok(expected), "{text}");
        }
    }

    #[test]
    fn faults_say_what_is_missing() {
        for (text, expected) in [
            ("", "a value is missing"),
            ("1+", "a value is missing"),
            ("(1+2", "`(` is never closed"),
            ("f(1 2)", "this does not continue the expression"),
            ("{a", "`{` is never closed"),
            ("a ? 1", "`:` and the other value is missing"),
            ("v(a,b,c)", "`v` has too many arguments"),
            ("v(a", "`v(` is never closed"),
            ("1.5k5*2", "`1.5k5*2` is not a number"),
        ] {
            assert_eq!(read(text), Err(expected.to_string()), "{text}");
        }
    }

    #[test]
    fn depth_and_length_are_limited() {
        let deep = "(".repeat(100_000);
        assert!(read(&deep).unwrap_err().contains("nested"));
        let signs = "-".repeat(100_000);
        assert!(read(&signs).unwrap_err().contains("nested"));
        let powers = vec!["2"; 100_000].join("^");
        assert!(read(&powers).unwrap_err().contains("nested"));
        let sums = vec!["2"; 100_000].join("+");
        assert!(read(&sums).unwrap_err().contains("operators"));
        let ternaries = "a?".repeat(100_000);
        assert!(read(&ternaries).unwrap_err().contains("nested"));
    }
}
