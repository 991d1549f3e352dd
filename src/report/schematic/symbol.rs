//! Symbols (after IEC 60617), each along the x axis with its first pin at the left; gates come from below.

use super::super::sheet::{INK, short};
use super::part::{Shape, Symbol, Transistor};
use crate::circuit::Output;

/// The colour of what conducts.
pub(super) const LIVE: &str = "#d55e00";
/// Where a gate's lead ends, px below the axis.
pub(super) const GATE: f64 = 28.0;
/// Half the length of a symbol without its leads, px.
const BODY: f64 = 20.0;

/// SVG of a symbol whose leads end at `ends` on the axis.
pub(super) fn drawn(symbol: Symbol, ends: (f64, f64), conducts: bool, has_gate: bool) -> String {
    let half = half_of(symbol);
    let mut path = format!(
        "M{} 0H{}M{} 0H{}",
        short(ends.0),
        short(-half),
        short(half),
        short(ends.1)
    );
    path.push_str(&outline(symbol, conducts));
    if has_gate {
        path.push_str(&format!("M{}V{GATE}", gate(symbol)));
    }
    let (colour, fill) = if conducts {
        (LIVE, LIVE)
    } else {
        (INK, "#fff")
    };
    let mut svg = String::new();
    let body = body(symbol);
    if !body.is_empty() {
        let is_filled = matches!(
            symbol,
            Symbol::Diode | Symbol::Zener | Symbol::Thyristor | Symbol::Triac
        );
        let fill = if is_filled { fill } else { "#fff" };
        svg.push_str(&format!(
            "<path d=\"{body}\" fill=\"{fill}\" stroke=\"{colour}\"/>"
        ));
    }
    svg.push_str(&format!(
        "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\"/>"
    ));
    let arrow = arrow(symbol);
    if !arrow.is_empty() {
        svg.push_str(&format!(
            "<path d=\"{arrow}\" fill=\"{colour}\" stroke=\"none\"/>"
        ));
    }
    svg
}

/// Whether it is a device that conducts at times.
pub(super) const fn can_conduct(symbol: Symbol) -> bool {
    matches!(
        symbol,
        Symbol::Diode
            | Symbol::Zener
            | Symbol::Thyristor
            | Symbol::Triac
            | Symbol::Switch
            | Symbol::Transistor(_)
    )
}

const fn half_of(symbol: Symbol) -> f64 {
    match symbol {
        Symbol::Capacitor => 4.0,
        Symbol::Diode | Symbol::Zener | Symbol::Thyristor => 10.0,
        Symbol::Triac => 12.0,
        Symbol::Switch => 15.0,
        Symbol::Source(..) => 17.0,
        _ => BODY,
    }
}

/// Where a gate's lead begins.
const fn gate(symbol: Symbol) -> &'static str {
    match symbol {
        Symbol::Thyristor => "10 0L18 10",
        Symbol::Triac => "12 0L18 10",
        Symbol::Transistor(Transistor::Mos { .. } | Transistor::Igbt) => "0 14",
        _ => "0 9",
    }
}

/// Where a gate's lead ends along the axis, px.
pub(super) const fn gate_along(symbol: Symbol) -> f64 {
    match symbol {
        Symbol::Thyristor | Symbol::Triac => 18.0,
        _ => 0.0,
    }
}

/// The closed outline that is filled.
const fn body(symbol: Symbol) -> &'static str {
    match symbol {
        Symbol::Resistor => "M-20 -7H20V7H-20Z",
        Symbol::Diode | Symbol::Zener | Symbol::Thyristor => "M-10 -10V10L10 0Z",
        Symbol::Triac => "M-12 -12V0L12 -6ZM12 12V0L-12 6Z",
        Symbol::Source(..) => "M-17 0A17 17 0 1 1 17 0A17 17 0 1 1 -17 0Z",
        Symbol::Controlled(_) => "M-20 0L0 -17L20 0L0 17Z",
        _ => "",
    }
}

/// Open lines.
fn outline(symbol: Symbol, conducts: bool) -> String {
    let polarity = "M-12 0H-4M-8 -4V4M8 -4V4";
    let arrow = "M-11 0H11M5 -5L11 0L5 5";
    let lines = match symbol {
        Symbol::Capacitor => "M-4 -13V13M4 -13V13",
        Symbol::Inductor => "M-20 0a5 5 0 0 1 10 0a5 5 0 0 1 10 0a5 5 0 0 1 10 0a5 5 0 0 1 10 0",
        Symbol::Diode | Symbol::Thyristor => "M10 -10V10",
        Symbol::Zener => "M5 -13L10 -10V10L15 13",
        Symbol::Triac => "M-12 -13V13M12 -13V13",
        Symbol::Switch if conducts => "M-15 0H15",
        Symbol::Switch => "M-15 0L12 -13",
        // The glyph stands upright, so it is not drawn here; + is beside the first lead.
        Symbol::Source(Output::Voltage, Shape::Sine | Shape::Pulse) => "M-29 -9H-21M-25 -13V-5",
        Symbol::Source(Output::Voltage, Shape::Plain) | Symbol::Controlled(Output::Voltage) => {
            polarity
        }
        Symbol::Source(Output::Current, _) | Symbol::Controlled(Output::Current) => arrow,
        Symbol::Transistor(Transistor::Bipolar { .. }) => "M-13 9H13M-20 0L-7 9M20 0L7 9",
        Symbol::Transistor(Transistor::Mos { .. }) => {
            "M-20 0H-12V9M20 0H12V9M-16 9H-7M-4.5 9H4.5M7 9H16M-13 14H13"
        }
        // A bipolar transistor's, with an insulated gate in place of the base.
        Symbol::Transistor(Transistor::Igbt) => "M-13 9H13M-20 0L-7 9M20 0L7 9M-13 14H13",
        Symbol::Transistor(Transistor::Junction { .. }) => "M-20 0H-10V9M20 0H10V9M-14 9H14",
        Symbol::Resistor | Symbol::Box => "",
    };
    lines.into()
}

/// Filled arrow heads and contacts.
const fn arrow(symbol: Symbol) -> &'static str {
    match symbol {
        Symbol::Switch => {
            "M-17.5 0a2.5 2.5 0 1 1 5 0a2.5 2.5 0 1 1 -5 0M12.5 0a2.5 2.5 0 1 1 5 0a2.5 2.5 0 1 1 -5 0"
        }
        Symbol::Transistor(Transistor::Bipolar { p: false } | Transistor::Igbt) => {
            "M19 0.7L14.4 7.6L10.4 1.9Z"
        }
        Symbol::Transistor(Transistor::Bipolar { p: true }) => "M8 8.3L16.6 6.1L12.6 0.4Z",
        Symbol::Transistor(Transistor::Mos { p: false }) => "M12 9L8.5 2H15.5Z",
        Symbol::Transistor(Transistor::Mos { p: true }) => "M12 0L8.5 7H15.5Z",
        Symbol::Transistor(Transistor::Junction { p: false }) => "M0 9L-4 16H4Z",
        Symbol::Transistor(Transistor::Junction { p: true }) => "M0 18L-4 11H4Z",
        _ => "",
    }
}

/// What stands upright in a source's circle.
pub(super) const fn glyph(symbol: Symbol) -> &'static str {
    match symbol {
        Symbol::Source(Output::Voltage, Shape::Sine) => "M-10 0c4 -10 6 -10 10 0c4 10 6 10 10 0",
        Symbol::Source(Output::Voltage, Shape::Pulse) => "M-11 5H-6V-6H3V5H8V-6H11",
        _ => "",
    }
}

/// Room between the axis and the words beside a symbol, px.
pub(super) const fn beside(symbol: Symbol) -> f64 {
    match symbol {
        Symbol::Resistor => 13.0,
        Symbol::Source(..) | Symbol::Controlled(_) => 22.0,
        Symbol::Transistor(_) | Symbol::Inductor => 12.0,
        _ => 18.0,
    }
}
