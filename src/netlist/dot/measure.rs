//! `.meas tran`, `.meas ac`, `.four`.

use super::{Dot, signal, skip};
use crate::diagnostic::{Diagnostic, Span};
use crate::measure::{Edge, Instant, Measurement, Over, Window};
use crate::netlist::ast::{Expr, ExprKind, Four, Meas, MeasAnalysis, Name, Statement};
use crate::netlist::expr;
use crate::netlist::lex::{
    Input, Parsed, at_end, between, end, expect_word, missing, refuse, separator, symbol, word,
};
use crate::netlist::operand;

/// Analyses of which nothing is measured.
const OTHER_ANALYSES: [&str; 4] = ["dc", "op", "noise", "sp"];

/// `.meas [tran|ac] name …`, and the command without its dot.
pub(in crate::netlist) fn meas<'a>(
    start: Input<'a>,
    i: Input<'a>,
    command: bool,
) -> Parsed<'a, Dot> {
    let (mut rest, mut name) = expect_word(i, "the name of the measurement")?;
    if OTHER_ANALYSES.contains(&name.text.as_str()) && !at_end(rest) {
        return Ok((skip(rest), Dot::Skipped));
    }
    let analysis = match name.text.as_str() {
        "tran" => Some(MeasAnalysis::Tran),
        "ac" => Some(MeasAnalysis::Ac),
        _ => None,
    };
    if analysis.is_some() {
        (rest, name) = expect_word(rest, "the name of the measurement")?;
    }
    let (rest, what) = kind(rest)?;
    let (rest, ()) = end(rest)?;
    let meas = Meas {
        analysis,
        name,
        what,
        command,
        span: trimmed(start, rest),
    };
    Ok((rest, Dot::statement(Statement::Meas(Box::new(meas)))))
}

fn kind(i: Input<'_>) -> Parsed<'_, Measurement<Expr>> {
    let expected = "what to measure: AVG RMS MIN MAX PP INTEG FIND DERIV WHEN TRIG PARAM";
    let (rest, first) = expect_word(i, expected)?;
    let over = match first.text.as_str() {
        "avg" => Over::Average,
        "rms" => Over::Rms,
        "min" => Over::Minimum,
        "max" => Over::Maximum,
        "pp" => Over::PeakToPeak,
        "integ" | "integral" => Over::Integral,
        "min_at" => Over::WhenMinimum,
        "max_at" => Over::WhenMaximum,
        "find" | "deriv" | "derivative" => {
            let slope = first.text != "find";
            let (rest, of) = expr::expr(rest)?;
            let (rest, when) = find_at(rest)?;
            return Ok((rest, Measurement::Find { of, slope, when }));
        }
        "when" => return met(rest, None).map(|(rest, when)| (rest, Measurement::When(when))),
        "trig" => {
            let (rest, trig) = trigger(rest)?;
            let Some(rest) = keyword(rest, "targ") else {
                return Err(missing(rest, "`TARG`"));
            };
            let (rest, targ) = trigger(rest)?;
            return Ok((rest, Measurement::Delay(trig, targ)));
        }
        "param" | "eqn" => {
            let (rest, e) = expr::expr(symbol(rest, '=').unwrap_or(rest))?;
            return Ok((rest, Measurement::Param(e)));
        }
        other => {
            let fault = Diagnostic::error(
                "bad-meas",
                first.span,
                format!("`{other}` is no kind of measurement"),
            )
            .label("unknown");
            let known = [
                "avg", "rms", "min", "max", "pp", "integ", "min_at", "max_at", "find", "deriv",
                "when", "trig", "param",
            ];
            return Err(refuse(
                match crate::netlist::suggest::nearest(other, known) {
                    Some(near) => fault.help(format!("did you mean `{near}`?")),
                    None => fault.help(format!("write {expected}")),
                },
            ));
        }
    };
    let (rest, of) = expr::expr(rest)?;
    let (rest, window) = window(rest)?;
    Ok((rest, Measurement::Over(over, of, window)))
}

/// A keyword after blanks and commas.
fn keyword<'a>(i: Input<'a>, text: &str) -> Option<Input<'a>> {
    word(separator(i))
        .ok()
        .filter(|(_, name)| name.text == text)
        .map(|(rest, _)| rest)
}

/// `name=value`, `name value`.
fn option<'a>(i: Input<'a>, name: &Name) -> Parsed<'a, Expr> {
    let at = symbol(i, '=').unwrap_or_else(|| separator(i));
    if at_end(at) {
        return Err(missing(at, &format!("`{}=` and a value", name.text)));
    }
    expr::expr(at)
}

/// Whether an option has a value here: `=`, or a number or `LAST` alone.
fn has_value(i: Input<'_>) -> bool {
    symbol(i, '=').is_some()
        || keyword(i, "last").is_some()
        || separator(i)
            .fragment()
            .starts_with(|c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | '{' | '\''))
}

/// `FROM=a TO=b TD=c`, `TRIG … TARG …`.
fn window(i: Input<'_>) -> Parsed<'_, Window<Expr>> {
    let (mut from, mut to) = (None, None);
    let mut at = separator(i);
    while !at_end(at) {
        let (rest, name) = expect_word(at, "`FROM=`, `TO=`, `TRIG` or `TARG`")?;
        let slot = match name.text.as_str() {
            "from" | "td" | "trig" => &mut from,
            "to" | "targ" => &mut to,
            _ => return Err(unknown(&name, "`FROM=`, `TO=`, `TD=`, `TRIG` and `TARG`")),
        };
        let (rest, instant) = if matches!(name.text.as_str(), "trig" | "targ") {
            trigger(rest)?
        } else {
            let (rest, t) = option(rest, &name)?;
            (rest, Instant::At(t))
        };
        *slot = Some(instant);
        at = separator(rest);
    }
    Ok((at, Window { from, to }))
}

fn unknown(name: &Name, allowed: &str) -> nom::Err<crate::netlist::lex::Fault> {
    let fault = Diagnostic::error(
        "bad-meas",
        name.span,
        format!("`{}` does not belong here", name.text),
    );
    refuse(
        fault
            .label("unexpected")
            .help(format!("{allowed} may follow")),
    )
}

/// `AT=t` or `WHEN a=b …`.
fn find_at(i: Input<'_>) -> Parsed<'_, Instant<Expr>> {
    let (rest, name) = expect_word(separator(i), "`AT=` or `WHEN`")?;
    match name.text.as_str() {
        "at" => option(rest, &name).map(|(rest, t)| (rest, Instant::At(t))),
        "when" => met(rest, None),
        _ => Err(unknown(&name, "`AT=` or `WHEN`")),
    }
}

/// After `TRIG` or `TARG`: `AT=t`, or `expr VAL=level …`, or `a=b …`.
fn trigger(i: Input<'_>) -> Parsed<'_, Instant<Expr>> {
    if let Ok((rest, name)) = word(separator(i))
        && name.text == "at"
        && has_value(rest)
    {
        return option(rest, &name).map(|(rest, t)| (rest, Instant::At(t)));
    }
    met(i, Some("val"))
}

/// `a=b`, or with `level` also `a VAL=b`, and which of their meetings.
fn met<'a>(i: Input<'a>, level: Option<&str>) -> Parsed<'a, Instant<Expr>> {
    let (mut at, left) = expr::expr(separator(i))?;
    let mut right = None;
    if let Some(rest) = symbol(at, '=') {
        let (rest, e) = expr::expr(rest)?;
        (at, right) = (rest, Some(e));
    }
    let (mut edge, mut number) = (Edge::Cross, None);
    let (mut from, mut to) = (None, None);
    let mut counted = false;
    at = separator(at);
    while let Ok((rest, name)) = word(at) {
        let text = name.text.as_str();
        let slot = match text {
            "targ" | "trig" => break,
            "rise" | "fall" | "cross" => {
                let own = match text {
                    "rise" => Edge::Rise,
                    "fall" => Edge::Fall,
                    _ => Edge::Cross,
                };
                if edge == Edge::Cross {
                    edge = own;
                }
                // `CROSS=1 RISE`: the edge alone.
                if !has_value(rest) {
                    at = separator(rest);
                    continue;
                }
                let (rest, e) = option(rest, &name)?;
                let last = matches!(&e.kind, ExprKind::Name(name) if name == "last");
                number = (!last).then_some(e);
                counted = true;
                at = separator(rest);
                continue;
            }
            "td" | "from" => &mut from,
            "to" => &mut to,
            _ if level == Some(text) => &mut right,
            _ => return Err(unknown(&name, "`RISE= FALL= CROSS= TD= FROM= TO=`")),
        };
        let (rest, value) = option(rest, &name)?;
        *slot = Some(value);
        at = separator(rest);
    }
    let Some(right) = right else {
        let what = if level.is_some() {
            "`VAL=level`"
        } else {
            "`=level`"
        };
        return Err(missing(at, what));
    };
    if !counted {
        number = Some(Expr {
            kind: ExprKind::Number(crate::algebra::Value::decimal(1.0, 1, 0)),
            span: left.span,
        });
    }
    let crossing = Instant::Crossing {
        left,
        right,
        edge,
        number,
        from,
        to,
    };
    Ok((at, crossing))
}

/// `.four frequency [harmonics [periods]] v(a) i(r1) …`.
pub(in crate::netlist) fn four<'a>(start: Input<'a>, i: Input<'a>) -> Parsed<'a, Dot> {
    let (mut at, frequency) = operand::value(separator(i)).map_err(|e| match e {
        nom::Err::Error(_) => missing(i, "the frequency"),
        e => e,
    })?;
    let mut numbers = Vec::new();
    let mut signals = Vec::new();
    at = separator(at);
    while !at_end(at) {
        match signal(at) {
            Ok((rest, one)) => {
                signals.push(one);
                at = rest;
            }
            Err(nom::Err::Error(_)) if signals.is_empty() && numbers.len() < 2 => {
                let (rest, value) = operand::value(at).map_err(|e| match e {
                    nom::Err::Error(_) => missing(at, "a signal such as `v(out)`"),
                    e => e,
                })?;
                numbers.push(value);
                at = rest;
            }
            Err(nom::Err::Error(_)) => return Err(missing(at, "a signal such as `v(out)`")),
            Err(e) => return Err(e),
        }
        at = separator(at);
    }
    if signals.is_empty() {
        return Err(missing(at, "a signal such as `v(out)`"));
    }
    if let Some(periods) = numbers.get(1) {
        let fault = Diagnostic::error(
            "unsupported",
            periods.span,
            "`.four` over several periods is not supported",
        );
        return Err(refuse(fault.label("recognised only").help(
            "the analysis is over the last period; leave the number of periods out",
        )));
    }
    let four = Four {
        frequency,
        harmonics: numbers.into_iter().next(),
        signals,
        span: trimmed(start, at),
    };
    Ok((at, Dot::statement(Statement::Four(Box::new(four)))))
}

/// The place of a card without blanks at its end.
fn trimmed(start: Input<'_>, to: Input<'_>) -> Span {
    let span = between(start, to);
    let text = &start.fragment()[..span.end - span.start];
    Span {
        end: span.start + text.trim_end().len(),
        ..span
    }
}
