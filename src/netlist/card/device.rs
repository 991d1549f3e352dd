//! D, S, W, M, Q, J, Z, X, and the letters that are only recognised.

use nom::Input as _;

use super::{Body, assign, assignment_follows, assigns, describe, nodes, numbers};
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{Control, Device, Name, PinGroup};
use crate::netlist::lex::{
    Input, Parsed, ahead, at_end, blank, expect_word, missing, node, refuse, separator, symbol,
    word, written,
};
use crate::netlist::operand;

/// `D1 a k model [area] [off] [ic=…]`.
pub(super) fn diode<'a>(i: Input<'a>, _: &Name) -> Parsed<'a, Body> {
    let (at, nodes) = nodes(i, 2, "node")?;
    let (at, model) = expect_word(at, "the model name")?;
    let numeric = blank_number(at) && !assignment_follows(at);
    let (at, area) = if numeric {
        let (at, value) = operand::value(at)?;
        (at, Some(value))
    } else {
        (at, None)
    };
    let (at, args) = assigns(at)?;
    Ok((at, (nodes, Device::Diode { model, area, args })))
}

fn blank_number(at: Input<'_>) -> bool {
    separator(at)
        .fragment()
        .starts_with(|c: char| c.is_ascii_digit() || matches!(c, '.' | '{' | '\''))
}

/// `S1 p n cp cn model [on|off]`.
pub(super) fn voltage_switch<'a>(i: Input<'a>, _: &Name) -> Parsed<'a, Body> {
    let (at, own) = nodes(i, 2, "node")?;
    let (at, control) = nodes(at, 2, "controlling node")?;
    let mut control = control.into_iter();
    let pair = control.next().zip(control.next());
    switch(
        at,
        own,
        Control::Nodes(pair.into_iter().collect(), Vec::new()),
    )
}

/// `W1 p n vsense model [on|off]`.
pub(super) fn current_switch<'a>(i: Input<'a>, _: &Name) -> Parsed<'a, Body> {
    let (at, own) = nodes(i, 2, "node")?;
    let (at, source) = nodes(at, 1, "controlling voltage source")?;
    switch(at, own, Control::Currents(source, Vec::new()))
}

fn switch(at: Input<'_>, own: Vec<Name>, control: Control) -> Parsed<'_, Body> {
    let (mut at, model) = expect_word(at, "the model name")?;
    let mut initial = None;
    if let Ok((rest, name)) = word(at) {
        match name.text.as_str() {
            "on" => (at, initial) = (rest, Some(true)),
            "off" => (at, initial) = (rest, Some(false)),
            _ => {}
        }
    }
    Ok((
        at,
        (
            own,
            Device::Switch {
                control,
                model,
                initial,
            },
        ),
    ))
}

/// `M1 d g s [b] model [w=… l=…] [off]`, `Q1 c b e [s] model [area]`, `J1 d g s model [area]`, `Z1 d g s model [area]`. Which of
/// the words after the third node is the model is known only when all models are.
pub(super) fn transistor<'a>(i: Input<'a>, name: &Name) -> Parsed<'a, Body> {
    let (mut at, nodes) = nodes(i, 3, "node")?;
    let most = if name.text.starts_with(['m', 'q']) {
        3
    } else {
        2
    };
    let (mut words, mut area) = (Vec::new(), None);
    while words.len() < most && !assignment_follows(separator(at)) {
        let Ok((rest, one)) = node(separator(at)) else {
            break;
        };
        if one.text == "off" {
            break;
        }
        // `2n3904` and `2` may both be read as numbers.
        area = operand::value(separator(at)).ok().map(|(_, value)| value);
        words.push(one);
        at = rest;
    }
    if words.is_empty() {
        return Err(missing(at, "the model name"));
    }
    let (at, args) = assigns(at)?;
    Ok((at, (nodes, Device::Transistor { words, area, args })))
}

/// `X1 nodes subckt [params:] name=value …`.
pub(super) fn call<'a>(i: Input<'a>, name: &Name) -> Parsed<'a, Body> {
    let mut words: Vec<Name> = Vec::new();
    let mut at = i;
    loop {
        at = separator(at);
        if at_end(at) || assignment_follows(at) {
            break;
        }
        if let Some(rest) = symbol(at, '(').or_else(|| symbol(at, ')')) {
            at = rest;
            continue;
        }
        let (rest, one) = node(at).map_err(|_| missing(at, "a node or the subcircuit"))?;
        at = rest;
        if matches!(one.text.as_str(), "params:" | "param:") {
            break;
        }
        words.push(one);
    }
    let Some(subckt) = words.pop() else {
        return Err(refuse(
            Diagnostic::error(
                "missing",
                ahead(i, i.fragment().len()),
                format!("`{}` names no subcircuit", name.text),
            )
            .label("nodes and the name of a subcircuit should follow"),
        ));
    };
    let (at, args) = assigns(at)?;
    if let Some(flag) = args.iter().find(|a| a.value.is_none()) {
        return Err(refuse(
            Diagnostic::error(
                "unexpected",
                flag.name.span,
                format!("unexpected `{}`", flag.name.text),
            )
            .label("expected `name=value`"),
        ));
    }
    Ok((at, (words, Device::Call { subckt, args })))
}

/// `A1 in out model`, `A1 [a b] %vd(c d) model` of XSPICE, `A1 a b c d e f g h AND Td=1n` of LTspice.
pub(super) fn code_model<'a>(i: Input<'a>, card: &Name) -> Parsed<'a, Body> {
    let mut ports: Vec<PinGroup> = Vec::new();
    let (mut sort, mut open) = (None, false);
    let mut at = i;
    loop {
        at = separator(at);
        if at_end(at) || assignment_follows(at) {
            break;
        }
        if let Some(rest) = symbol(at, ']').filter(|_| open) {
            (at, open) = (rest, false);
        } else if let Some(rest) = symbol(at, '[') {
            ports.push(PinGroup {
                sort: sort.take(),
                elements: Vec::new(),
                vector: true,
            });
            (at, open) = (rest, true);
        } else if let Some(rest) = symbol(at, '%') {
            // `%vd[` too.
            let (after, _) = expect_word(rest, "the type of a port")?;
            let start = blank(rest);
            let whole = written(start, after);
            let length = whole.find('[').unwrap_or(whole.len());
            let name = Name {
                text: whole[..length].to_lowercase(),
                span: ahead(start, length),
            };
            (at, sort) = (start.take_from(length), Some(name));
        } else {
            let (rest, nodes) = element(at, card)?;
            at = rest;
            match ports.last_mut().filter(|_| open) {
                Some(port) => port.elements.push(nodes),
                None => ports.push(PinGroup {
                    sort: sort.take(),
                    elements: vec![nodes],
                    vector: false,
                }),
            }
        }
    }
    let last = ports.pop().filter(|port| !port.vector);
    let model = last.and_then(|port| port.elements.into_iter().next()?.into_iter().next());
    let Some(model) = model.filter(|_| !open) else {
        return Err(missing(at, "the model name"));
    };
    let (at, args) = assigns(at)?;
    let elements = ports.iter().flat_map(|port| &port.elements);
    let nodes = elements.flatten().cloned().collect();
    Ok((at, (nodes, Device::Code { ports, model, args })))
}

/// A node, or two in parentheses.
fn element<'a>(at: Input<'a>, card: &Name) -> Parsed<'a, Vec<Name>> {
    let Some(mut at) = symbol(at, '(') else {
        return part(at, card).map(|(rest, node)| (rest, vec![node]));
    };
    let mut nodes = Vec::new();
    loop {
        at = separator(at);
        if let Some(rest) = symbol(at, ')') {
            return Ok((rest, nodes));
        }
        let (rest, node) = part(at, card)?;
        nodes.push(node);
        at = rest;
    }
}

/// A name that ends at a bracket too, unless it has its own (`q[0]`).
fn part<'a>(at: Input<'a>, card: &Name) -> Parsed<'a, Name> {
    let (after, _) = node(at).map_err(|_| missing(at, &format!("a node of `{}`", card.text)))?;
    let at = blank(at);
    let text = written(at, after);
    let end = match text.find(['[', ']']) {
        Some(k) if k > 0 && text[k..].starts_with(']') => k,
        _ => text.len(),
    };
    let name = Name {
        text: text[..end].to_lowercase(),
        span: ahead(at, end),
    };
    Ok((at.take_from(end), name))
}

/// `T1 a b c d z0=50 td=10n [ic=v1,i1,v2,i2]`, or `f=1meg nl=0.25` in place of `td`.
pub(super) fn line<'a>(i: Input<'a>, _: &Name) -> Parsed<'a, Body> {
    let (mut at, nodes) = nodes(i, 4, "node")?;
    let (mut args, mut ic) = (Vec::new(), Vec::new());
    loop {
        at = separator(at);
        let initial = word(at).ok().filter(|(_, name)| name.text == "ic");
        if let Some(rest) = initial.and_then(|(rest, _)| symbol(rest, '=')) {
            (at, ic) = numbers(rest, "an initial value")?;
        } else if !at_end(at)
            && let Ok((rest, one)) = assign(at)
        {
            args.push(one);
            at = rest;
        } else {
            return Ok((at, (nodes, Device::Line { args, ic })));
        }
    }
}

/// A card that is recognised but not supported.
pub(super) fn unsupported<'a>(i: Input<'a>, name: &Name) -> Parsed<'a, Body> {
    let what = describe(name.text.chars().next().unwrap_or(' '));
    let length = i.fragment().len();
    Ok((
        i.take_from(length),
        (Vec::new(), Device::Unsupported { what }),
    ))
}
