//! XSPICE's analogue code models that are piecewise linear, as ngspice defines them (ngspice manual, chapter 8).
//!
//! Corners are sharp, where ngspice rounds them with a parabola as wide as `limit_range` or `input_domain`.

use std::fmt::Write;

use super::{Built, Refused, refused, values};
use crate::netlist::ast::{Assign, Element, Expr, Model, Name, PinGroup};

/// What is simulated.
pub(super) const KNOWN: [&str; 9] = [
    "gain", "summer", "mult", "limit", "climit", "int", "d_dt", "hyst", "slew",
];
/// How far ngspice rounds corners.
const ROUNDING: [&str; 4] = ["limit_range", "fraction", "input_domain", "range"];

/// The cards and expressions of the pins of a card.
#[derive(Default)]
struct Pins {
    pins: Vec<(String, Name)>,
    cards: String,
}

/// The subcircuit of a card.
pub(super) fn build(card: &Element, ports: &[PinGroup], model: &Model) -> Result<Built, Refused> {
    let kind = model.kind.text.as_str();
    if !KNOWN.contains(&kind) {
        return Err(super::unknown(card, &model.kind));
    }
    let at = &card.name;
    let wanted = match kind {
        "climit" => 4,
        _ => 2,
    };
    let many = matches!(kind, "summer" | "mult");
    let vectors = ports
        .iter()
        .enumerate()
        .all(|(k, p)| p.vector == (many && k == 0));
    if ports.len() != wanted || !vectors || model.base.is_some() {
        let message = format!("`{}` does not have the ports of `{kind}`", at.text);
        let help = match kind {
            "climit" => "in, upper limit, lower limit and out are needed",
            _ if many => "a vector of inputs `[a b]` and an output are needed",
            _ => "an input and an output are needed",
        };
        return Err(Box::new(refused(at, message, "other ports").help(help)));
    }
    let mut pins = Pins::default();
    let mut inputs = Vec::new();
    for port in &ports[..ports.len() - 1] {
        for nodes in &port.elements {
            inputs.push(pins.input(at, port, nodes)?);
        }
    }
    let output = &ports[ports.len() - 1];
    let (own, defaults) = parameters(card, model, inputs.len())?;
    let has = |name: &str| own.iter().any(|a| a.name.text == name);
    let value = pins.value(kind, &inputs, &has).map_err(|missing| {
        let message = format!("model `{}` names no {missing}", model.name.text);
        refused(&model.name, message, "needed here")
    })?;
    pins.output(at, output, &value)?;
    Ok(Built {
        title: kind.to_owned(),
        cards: pins.cards,
        pins: pins.pins,
        defaults,
        args: own,
        left_out: Vec::new(),
    })
}

/// The parameters of a model as those of the subcircuit, vectors taken apart, and the defaults of the others.
fn parameters(
    card: &Element,
    model: &Model,
    count: usize,
) -> Result<(Vec<Assign>, String), Refused> {
    let kind = model.kind.text.as_str();
    let mut known: Vec<(String, &str)> = Vec::new();
    let mut know = |list: &[(&str, &'static str)]| {
        known.extend(
            list.iter()
                .map(|(name, value)| ((*name).to_owned(), *value)),
        );
    };
    match kind {
        "gain" => know(&[("in_offset", "0"), ("gain", "1"), ("out_offset", "0")]),
        "limit" | "int" => know(&[("in_offset", "0"), ("gain", "1")]),
        "climit" => know(&[
            ("in_offset", "0"),
            ("gain", "1"),
            ("upper_delta", "0"),
            ("lower_delta", "0"),
        ]),
        "d_dt" => know(&[("gain", "1"), ("out_offset", "0")]),
        "hyst" => know(&[
            ("in_low", "0"),
            ("in_high", "1"),
            ("hyst", "0.1"),
            ("out_lower_limit", "0"),
            ("out_upper_limit", "1"),
        ]),
        "slew" => know(&[("rise_slope", "1e9"), ("fall_slope", "1e9")]),
        _ => know(&[("out_gain", "1"), ("out_offset", "0")]),
    }
    if kind == "int" {
        know(&[("out_ic", "0")]);
    }
    if matches!(kind, "summer" | "mult") {
        for k in 1..=count {
            known.push((format!("in_gain{k}"), "1"));
            known.push((format!("in_offset{k}"), "0"));
        }
    }
    let limits = ["out_lower_limit", "out_upper_limit"];
    let mut own = Vec::new();
    for Assign { name, value } in &model.params {
        let Some(value) = value else {
            continue;
        };
        let text = name.text.as_str();
        let parts = values(value);
        let vector = matches!(kind, "summer" | "mult") && text.starts_with("in_");
        if ROUNDING.contains(&text) {
            continue;
        } else if vector && parts.len() <= count {
            own.extend(
                parts
                    .into_iter()
                    .enumerate()
                    .map(|(k, part)| named(name, &format!("{text}{}", k + 1), part)),
            );
        } else if known.iter().any(|(own, _)| own == text) || limits.contains(&text) {
            own.push(named(name, text, value.clone()));
        } else {
            let message = format!(
                "`{text}` of model `{}` is not known to `{kind}`",
                model.name.text
            );
            let fault = refused(name, message, "not a parameter of it");
            return Err(Box::new(
                fault.help(format!("`{}` uses it", card.name.text)),
            ));
        }
    }
    let mut defaults = String::new();
    for (name, value) in known {
        _ = write!(defaults, " {name}={value}");
    }
    Ok((own, defaults))
}

fn named(place: &Name, text: &str, value: Expr) -> Assign {
    Assign {
        name: Name {
            text: text.to_owned(),
            span: place.span,
        },
        value: Some(value),
    }
}

impl Pins {
    /// A pin for a node.
    fn pin(&mut self, node: &Name) -> String {
        let pin = format!("p{}", self.pins.len() + 1);
        self.pins.push((pin.clone(), node.clone()));
        pin
    }

    /// What an input reads.
    fn input(&mut self, at: &Name, port: &PinGroup, nodes: &[Name]) -> Result<String, Refused> {
        let sort = port.sort.as_ref().map_or("v", |s| s.text.as_str());
        let pins: Vec<String> = nodes.iter().map(|node| self.pin(node)).collect();
        match (sort, pins.as_slice()) {
            ("v", [a]) => Ok(format!("v({a})")),
            ("vd", [a, b]) => Ok(format!("v({a},{b})")),
            ("i", [a]) => {
                _ = writeln!(self.cards, "vm{a} {a} 0 0");
                Ok(format!("i(vm{a})"))
            }
            ("id", [a, b]) => {
                _ = writeln!(self.cards, "vm{a} {a} {b} 0");
                Ok(format!("i(vm{a})"))
            }
            _ => Err(port_refused(at, sort, pins.len())),
        }
    }

    /// A source of the output.
    fn output(&mut self, at: &Name, port: &PinGroup, value: &str) -> Result<(), Refused> {
        let sort = port.sort.as_ref().map_or("v", |s| s.text.as_str());
        let nodes = port.elements.first().map_or(&[][..], Vec::as_slice);
        let mut pins: Vec<String> = nodes.iter().map(|node| self.pin(node)).collect();
        let letter = match (sort, pins.len()) {
            ("v", 1) | ("vd", 2) => 'V',
            ("i", 1) | ("id", 2) => 'I',
            (_, count) => return Err(port_refused(at, sort, count)),
        };
        pins.push("0".to_owned());
        _ = writeln!(self.cards, "bout {} {} {letter}={value}", pins[0], pins[1]);
        Ok(())
    }

    /// The expression of the output, with the cards that it needs.
    ///
    /// # Errors
    /// The parameter that is missing.
    fn value(
        &mut self,
        kind: &str,
        inputs: &[String],
        has: &dyn Fn(&str) -> bool,
    ) -> Result<String, &'static str> {
        let first = inputs.first().map_or("0", String::as_str);
        let limits = [has("out_lower_limit"), has("out_upper_limit")];
        let between = |value: String| match limits {
            [true, true] => format!("limit({value},out_lower_limit,out_upper_limit)"),
            [true, false] => format!("max({value},out_lower_limit)"),
            [false, true] => format!("min({value},out_upper_limit)"),
            [false, false] => value,
        };
        let each = |sign: &str| {
            let terms = inputs.iter().enumerate();
            let terms = terms.map(|(k, x)| format!("in_gain{0}*({x}+in_offset{0})", k + 1));
            let all: Vec<String> = terms.collect();
            format!("out_gain*({})+out_offset", all.join(sign))
        };
        let scaled = format!("gain*({first}+in_offset)");
        let cards = &mut self.cards;
        Ok(match kind {
            "gain" => format!("{scaled}+out_offset"),
            "summer" => each("+"),
            "mult" => each("*"),
            "limit" if !limits[0] => return Err("out_lower_limit"),
            "limit" if !limits[1] => return Err("out_upper_limit"),
            "limit" => between(scaled),
            "climit" => {
                let (upper, lower) = (&inputs[1], &inputs[2]);
                format!("min(max({scaled},{lower}+lower_delta),{upper}-upper_delta)")
            }
            "int" => {
                let start = between("out_ic".to_owned());
                _ = write!(
                    cards,
                    "bin 0 x I={scaled}\ncx x 0 1\n.ic v(x)={{{start}}}\n.model clamp D(ideal)\n"
                );
                for (own, clamp) in limits.into_iter().zip([
                    "vlow low 0 {out_lower_limit}\ndlow low x clamp\n",
                    "vhigh high 0 {out_upper_limit}\ndhigh x high clamp\n",
                ]) {
                    cards.push_str(if own { clamp } else { "" });
                }
                "v(x)".to_owned()
            }
            "d_dt" if limits != [false; 2] => {
                return Err("derivative without limits: what limits it cannot act on it");
            }
            "d_dt" => {
                _ = write!(cards, "bin x 0 V={first}\ncx x y 1\nvy y 0 0\n");
                "gain*i(vy)+out_offset".to_owned()
            }
            // The current that charges is at most the one slope and at least the other.
            "slew" => {
                _ = write!(
                    cards,
                    "bin b 0 V={first}\nirise b m {{rise_slope}}\ndrise m b clamp\n\
                     ifall x m {{fall_slope}}\ndfall m x clamp\ncx x 0 1\n.model clamp D(ideal)\n"
                );
                "v(x)".to_owned()
            }
            // Falling behind by `hyst` on the way up, and as far ahead on the way down.
            _ => {
                _ = write!(
                    cards,
                    "bin x 0 V={first}\nvq 0 q -1\ns1 q 0 x 0 way\n\
                     .model way SW(Ron=1 Roff=inf Vt={{0.5*(in_low+in_high)}} Vh={{0.5*(in_high-in_low)+hyst}})\n"
                );
                "limit(out_lower_limit+(out_upper_limit-out_lower_limit)/(in_high-in_low)\
                 *(v(x)+hyst*(2*i(vq)-1)-in_low),out_lower_limit,out_upper_limit)"
                    .to_owned()
            }
        })
    }
}

fn port_refused(at: &Name, sort: &str, count: usize) -> Refused {
    let message = format!(
        "`{}` has a port of type `{sort}` with {count} nodes",
        at.text
    );
    Box::new(refused(at, message, "not simulated").help("v and i have one node, vd and id two"))
}
