//! E, G, F, H and B.

use nom::Input as _;

use super::{Body, assigns, expect_value, keyword, nodes, numbers};
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{Control, Device, Expr, ExprKind, Name, Signal};
use crate::netlist::expr;
use crate::netlist::lex::{
    Input, Parsed, between, expect_word, missing, refuse, separator, symbol, word,
};

/// Most dimensions of `POLY(n)`.
const MAX_POLY: f64 = 1000.0;

/// E and G: `E1 p n cp cn gain`, `POLY(n) …`, `VALUE={…}`, `TABLE {…} = …`.
pub(super) fn by_voltage<'a>(i: Input<'a>, name: &Name) -> Parsed<'a, Body> {
    let voltage = name.text.starts_with('e');
    let (at, own) = nodes(i, 2, "node")?;
    let (at, control) = match special(at, true)? {
        (at, Some(control)) => (at, control),
        (at, None) => {
            let (at, pair) = nodes(at, 2, "controlling node")?;
            let pair = pairs(pair);
            if let (Some(points), [across]) = (keyword(separator(at), "table"), &pair[..]) {
                // LTspice's: of the voltage between the controlling nodes.
                let (rest, points) = table(symbol(points, '=').unwrap_or(points))?;
                return finish(
                    rest,
                    own,
                    voltage,
                    Control::Table(voltage_of(across.clone()), points),
                );
            }
            match special(at, true)? {
                // `LAPLACE=` stands behind the nodes.
                (rest, Some(other @ Control::Other(_))) => (rest, other),
                _ => {
                    let (at, gain) = expect_value(separator(at), "the gain")?;
                    (at, Control::Nodes(pair, linear(gain)))
                }
            }
        }
    };
    finish(at, own, voltage, control)
}

/// F and H: `F1 p n vsense gain`, `POLY(n) …`, `VALUE={…}`.
pub(super) fn by_current<'a>(i: Input<'a>, name: &Name) -> Parsed<'a, Body> {
    let voltage = name.text.starts_with('h');
    let (at, own) = nodes(i, 2, "node")?;
    let (at, control) = match special(at, false)? {
        (at, Some(control)) => (at, control),
        (at, None) => {
            let (at, source) = nodes(at, 1, "controlling voltage source")?;
            let (at, gain) = expect_value(separator(at), "the gain")?;
            (at, Control::Currents(source, linear(gain)))
        }
    };
    finish(at, own, voltage, control)
}

/// B: `B1 p n V=…` or `I=…`.
pub(super) fn behavioural<'a>(i: Input<'a>, name: &Name) -> Parsed<'a, Body> {
    let (at, own) = nodes(i, 2, "node")?;
    let at = separator(at);
    let (rest, kind) = expect_word(at, "`V=` or `I=`")?;
    let (Some(rest), "v" | "i") = (symbol(rest, '='), kind.text.as_str()) else {
        return Err(refuse(
            Diagnostic::error(
                "missing",
                kind.span,
                format!("`{}` has no `V=` or `I=`", name.text),
            )
            .label("expected `V=` or `I=`")
            .help(format!(
                "write `{} {} {} V=…`",
                name.text, own[0].text, own[1].text
            )),
        ));
    };
    let (at, value) = expr::expr(rest)?;
    finish(at, own, kind.text == "v", Control::Expression(value))
}

fn finish(at: Input<'_>, own: Vec<Name>, voltage: bool, control: Control) -> Parsed<'_, Body> {
    let (at, args) = assigns(at)?;
    Ok((
        at,
        (
            own,
            Device::Controlled {
                voltage,
                control,
                args,
            },
        ),
    ))
}

fn pairs(nodes: Vec<Name>) -> Vec<(Name, Name)> {
    let mut nodes = nodes.into_iter();
    std::iter::from_fn(|| Some((nodes.next()?, nodes.next()?))).collect()
}

/// A single gain as the coefficients `0, gain`.
fn linear(gain: Expr) -> Vec<Expr> {
    let zero = Expr {
        kind: ExprKind::Number(crate::algebra::Value::decimal(0.0, 0, 0)),
        span: gain.span,
    };
    vec![zero, gain]
}

/// The forms that begin with a word: `POLY`, `VALUE`, `TABLE`, `LAPLACE`, …
fn special(i: Input<'_>, by_voltage: bool) -> Parsed<'_, Option<Control>> {
    let at = separator(i);
    let Ok((rest, name)) = word(at) else {
        return Ok((i, None));
    };
    match name.text.as_str() {
        "poly" => poly(rest, by_voltage).map(|(rest, control)| (rest, Some(control))),
        "value" | "vol" | "cur" | "v" | "i"
            if symbol(rest, '=').is_some() || symbol(rest, '{').is_some() =>
        {
            let (rest, value) = expr::expr(symbol(rest, '=').unwrap_or(rest))?;
            Ok((rest, Some(Control::Expression(value))))
        }
        "table" => {
            let (rest, input) = expr::expr(symbol(rest, '=').unwrap_or(rest))?;
            let (rest, points) = table(symbol(rest, '=').unwrap_or(rest))?;
            Ok((rest, Some(Control::Table(input, points))))
        }
        "laplace" | "freq" | "chebyshev" | "opamp" | "transformer" | "delay" | "pwl" | "vcvs"
        | "vccs" => {
            let length = rest.fragment().len();
            Ok((rest.take_from(length), Some(Control::Other(name))))
        }
        _ => Ok((i, None)),
    }
}

/// The points of a table, `(x,y) (x,y) …` or `(x y, x y, …)`.
fn table(start: Input<'_>) -> Parsed<'_, Vec<(Expr, Expr)>> {
    let (rest, list) = numbers(start, "a pair of numbers")?;
    if list.len() < 2 || list.len() % 2 == 1 {
        let message = format!(
            "a table needs pairs of numbers, this one has {}",
            list.len()
        );
        let fault = Diagnostic::error("bad-table", between(start, rest), message);
        return Err(refuse(fault.label("(x,y) (x,y) …")));
    }
    let mut list = list.into_iter();
    let points = std::iter::from_fn(|| Some((list.next()?, list.next()?))).collect();
    Ok((rest, points))
}

/// v(a,b).
fn voltage_of((a, b): (Name, Name)) -> Expr {
    let signal = Signal::Voltage(a, Some(b));
    Expr {
        span: signal.span(),
        kind: ExprKind::Signal(Box::new(signal)),
    }
}

/// `POLY(n)`, n controls, coefficients.
fn poly(i: Input<'_>, by_voltage: bool) -> Parsed<'_, Control> {
    let open = symbol(i, '(');
    let (rest, dimension) = expect_value(open.unwrap_or(i), "the number of dimensions")?;
    let dimensions = match &dimension.kind {
        ExprKind::Number(n) if n.f64.fract() == 0.0 && (1.0..=MAX_POLY).contains(&n.f64) => {
            n.f64 as usize
        }
        _ => {
            let fault = Diagnostic::error(
                "bad-poly",
                dimension.span,
                "POLY needs a whole number of dimensions",
            );
            return Err(refuse(fault.label("expected 1, 2, …")));
        }
    };
    let rest = match (open, symbol(rest, ')')) {
        (None, _) => rest,
        (_, Some(rest)) => rest,
        (Some(_), None) => return Err(missing(rest, "`)`")),
    };
    let mut at = rest;
    let mut controls = Vec::new();
    for _ in 0..dimensions {
        let (rest, more) = if by_voltage {
            nodes(at, 2, "controlling node")?
        } else {
            nodes(at, 1, "controlling voltage source")?
        };
        controls.extend(more);
        at = rest;
    }
    let (rest, coefficients) = numbers(at, "a coefficient")?;
    if coefficients.is_empty() {
        return Err(missing(at, "a coefficient"));
    }
    let control = if by_voltage {
        Control::Nodes(pairs(controls), coefficients)
    } else {
        Control::Currents(controls, coefficients)
    };
    Ok((rest, control))
}
