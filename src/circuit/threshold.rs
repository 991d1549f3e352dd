//! Switches whose control comes to rest exactly on their threshold, or never passes it.

use super::builder::Builder;
use super::names::written;
use super::source::Wave;
use super::{Circuit, Element, Kind, NodeId, Output, Quantity, Switch};
use crate::diagnostic::Diagnostic;
use crate::law::Law;

/// Combinations of levels that are looked at for one control.
const MOST: usize = 64;

impl Builder<'_, '_> {
    /// Warns of switches without hysteresis whose control rests on the threshold (they are on exactly above it), and of switches
    /// whose control changes and never passes it.
    pub(super) fn warn_of_thresholds(&mut self) {
        let circuit = &self.circuit;
        let warnings: Vec<Diagnostic> = circuit
            .elements
            .iter()
            .filter_map(|element| match &element.kind {
                Kind::Switch(switch) => on_threshold(circuit, element, switch).or_else(|| {
                    never_passes(circuit, element, switch).filter(|_| is_alone(circuit, element))
                }),
                _ => None,
            })
            .collect();
        for warning in warnings {
            self.tell(warning);
        }
    }
}

fn on_threshold(circuit: &Circuit, element: &Element, switch: &Switch) -> Option<Diagnostic> {
    if switch.on_above != switch.off_below || switch.latch.is_some() {
        return None;
    }
    // (value, who is at which level)
    let mut sums = vec![(switch.control.constant, String::new())];
    for (gain, quantity) in &switch.control.terms {
        let Quantity::Voltage(node) = *quantity else {
            return None;
        };
        if node == NodeId::GROUND {
            continue;
        }
        let (driver, levels) = driver(circuit, node)?;
        if levels.is_empty() || sums.len() * levels.len() > MOST {
            return None;
        }
        let with = |(sum, words): &(f64, String)| {
            let add = |level: &f64| {
                let comma = if words.is_empty() { "" } else { ", " };
                let words = format!("{words}{comma}`{driver}` is at {level}");
                (sum + gain.f64 * level, words)
            };
            levels.iter().map(add).collect::<Vec<_>>()
        };
        sums = sums.iter().flat_map(with).collect();
    }
    let (_, when) = sums.iter().find(|(sum, _)| *sum == switch.on_above)?;
    if when.is_empty() {
        return None;
    }
    let message = format!(
        "`{}` rests exactly on its threshold while {when}",
        written(&element.name)
    );
    Some(
        Diagnostic::warning("on-threshold", element.span, message)
            .label(format!("off there: on above {} only", switch.on_above))
            .help(
                "a threshold between the levels (`Vt` in the model), or hysteresis (`Vh`), decides",
            ),
    )
}

/// What is said of a switch that sources alone control, where their lowest and highest values leave it in one position.
fn never_passes(circuit: &Circuit, element: &Element, switch: &Switch) -> Option<Diagnostic> {
    if switch.latch.is_some() || switch.initial.is_some() {
        return None;
    }
    let (mut low, mut high) = (switch.control.constant, switch.control.constant);
    if let Some((a, b)) = floating(circuit, switch) {
        low += a.min(b);
        high += a.max(b);
        return stays(element, switch, (low, high));
    }
    for (gain, quantity) in &switch.control.terms {
        let Quantity::Voltage(node) = *quantity else {
            return None;
        };
        if node == NodeId::GROUND {
            continue;
        }
        let (a, b) = tied(circuit, node).find_map(|(sign, element)| match &element.kind {
            Kind::VoltageSource(source) => {
                range(&source.wave).map(|(a, b)| (gain.f64 * sign * a, gain.f64 * sign * b))
            }
            _ => None,
        })?;
        low += a.min(b);
        high += a.max(b);
    }
    stays(element, switch, (low, high))
}

/// The ends of the range of a control that is the voltage of one source between two nodes.
fn floating(circuit: &Circuit, switch: &Switch) -> Option<(f64, f64)> {
    let [(gain, Quantity::Voltage(p)), (other, Quantity::Voltage(n))] = &switch.control.terms[..]
    else {
        return None;
    };
    if gain.f64 != -other.f64 {
        return None;
    }
    circuit.elements.iter().find_map(|element| {
        let sign = match (element.p, element.n) {
            ends if ends == (*p, *n) => gain.f64,
            ends if ends == (*n, *p) => other.f64,
            _ => return None,
        };
        let Kind::VoltageSource(source) = &element.kind else {
            return None;
        };
        range(&source.wave).map(|(a, b)| (sign * a, sign * b))
    })
}

/// What is said of a switch whose control stays in a range.
fn stays(element: &Element, switch: &Switch, (low, high): (f64, f64)) -> Option<Diagnostic> {
    // A constant control is meant.
    if low == high {
        return None;
    }
    let (never, limit) = if high <= switch.on_above {
        ("on", format!("it turns on above {}", switch.on_above))
    } else if low >= switch.off_below {
        ("off", format!("it turns off below {}", switch.off_below))
    } else {
        return None;
    };
    let message = format!(
        "`{}` never turns {never}: its control is between {low} and {high}",
        written(&element.name)
    );
    Some(
        Diagnostic::warning("never-switches", element.span, message)
            .label(limit)
            .help("change the levels of the source, or the threshold in the model"),
    )
}

/// Whether a card makes no other switch: of a staircase the upper steps may be out of reach.
fn is_alone(circuit: &Circuit, element: &Element) -> bool {
    let is_switch = |other: &&Element| matches!(other.kind, Kind::Switch(_));
    let of_card = |other: &&Element| other.span == element.span;
    let switches = circuit.elements.iter().filter(is_switch);
    switches.filter(of_card).count() == 1
}

/// The elements between a node and ground, and +1 where the node is their first one.
fn tied(circuit: &Circuit, node: NodeId) -> impl Iterator<Item = (f64, &Element)> {
    circuit.elements.iter().filter_map(move |element| {
        let sign = match (element.p, element.n) {
            (p, NodeId::GROUND) if p == node => 1.0,
            (NodeId::GROUND, n) if n == node => -1.0,
            _ => return None,
        };
        Some((sign, element))
    })
}

/// The lowest and the highest value of a waveform, if they are known.
fn range(wave: &Wave) -> Option<(f64, f64)> {
    let of = |values: &[f64]| {
        let low = values.iter().copied().reduce(f64::min)?;
        Some((low, values.iter().copied().fold(low, f64::max)))
    };
    match wave {
        Wave::Dc(value) => Some((*value, *value)),
        Wave::Pulse { v1, v2, .. } | Wave::Exp { v1, v2, .. } => of(&[*v1, *v2]),
        Wave::Pwl { points, .. } => of(&points.iter().map(|p| p.1).collect::<Vec<_>>()),
        Wave::Sin {
            offset,
            amplitude,
            damping,
            ..
        } if *damping >= 0.0 => of(&[offset - amplitude, offset + amplitude]),
        Wave::Sin { .. } | Wave::Sffm { .. } | Wave::Am { .. } | Wave::Arriving { .. } => None,
    }
}

/// What ties a node to ground, and the voltages it rests at.
fn driver(circuit: &Circuit, node: NodeId) -> Option<(&str, Vec<f64>)> {
    tied(circuit, node).find_map(|(sign, element)| {
        let levels = match &element.kind {
            Kind::VoltageSource(source) => levels(&source.wave),
            Kind::Function {
                output: Output::Voltage,
                law,
                ..
            } => outputs(law),
            _ => return None,
        };
        let levels = levels.into_iter().map(|level| sign * level + 0.0).collect();
        Some((element.name.as_str(), levels))
    })
}

/// The values at which a waveform stays for a while.
fn levels(wave: &Wave) -> Vec<f64> {
    match wave {
        Wave::Dc(value) => vec![*value],
        Wave::Pulse { v1, v2, width, .. } if *width > 0.0 => vec![*v1, *v2],
        Wave::Pulse { v1, .. } | Wave::Exp { v1, .. } => vec![*v1],
        Wave::Pwl { points, .. } => {
            let flat = points
                .windows(2)
                .filter(|w| w[0].1 == w[1].1 && w[0].0 < w[1].0);
            let ends = points.first().into_iter().chain(points.last());
            ends.map(|p| p.1).chain(flat.map(|w| w[0].1)).collect()
        }
        Wave::Sin { .. } | Wave::Sffm { .. } | Wave::Am { .. } | Wave::Arriving { .. } => vec![],
    }
}

/// The values at which a function block stays over a range of its input.
fn outputs(law: &Law) -> Vec<f64> {
    let Some(curve) = law.curve() else {
        return vec![];
    };
    let vertices = &curve.vertices;
    let flat = vertices.windows(2).filter(|w| w[0].1.f64 == w[1].1.f64);
    let first = vertices.first().filter(|_| curve.first.1.f64 == 0.0);
    let last = vertices.last().filter(|_| curve.last.1.f64 == 0.0);
    let ends = first.into_iter().chain(last).map(|v| v.1.f64);
    ends.chain(flat.map(|w| w[0].1.f64)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Diodes;
    use super::super::fixture::read;

    fn said(control: &str, model: &str) -> Vec<String> {
        let text = format!("V1 a 0 1\nR1 a b 1\nS1 b 0 c 0 ms\n{control}\n.model ms {model}");
        let (_, findings) = read(&text, Diodes::Auto);
        let own = findings.iter().filter(|f| f.code == "never-switches");
        own.map(|f| f.message.clone()).collect()
    }

    #[test]
    fn a_switch_that_its_sources_never_move_is_named() {
        let pulse = "Vc c 0 pulse(0 5 0 1n 1n 1u 2u)";
        let never = |word, low, high| {
            vec![format!(
                "`s1` never turns {word}: its control is between {low} and {high}"
            )]
        };
        assert_eq!(said(pulse, "SW(Ron=1 Vt=5 Vh=0.5)"), never("on", 0, 5));
        assert_eq!(said(pulse, "SW(Ron=1 Vt=-1 Vh=0.5)"), never("off", 0, 5));
        let turned = "Vc 0 c pulse(0 5 0 1n 1n 1u 2u)";
        assert_eq!(said(turned, "SW(Ron=1 Vt=1 Vh=0)"), never("on", -5, 0));
        // Between two nodes that float.
        let floating = "Vc c b pulse(0 2 0 1n 1n 1u 2u)\nS2 a 0 c b ms";
        let (_, findings) = read(
            &format!("V1 a 0 1\nR1 b 0 1\n{floating}\n.model ms SW(Ron=1 Vt=3)"),
            Diodes::Auto,
        );
        assert!(
            findings
                .iter()
                .any(|f| f.message.contains("`s2` never turns on"))
        );
        let sine = "Vc c 0 sin(1 2 1k)";
        assert_eq!(said(sine, "SW(Ron=1 Vt=4 Vh=0)"), never("on", -1, 3));
        // What passes, what is constant on purpose, and what the circuit decides.
        for (control, model) in [
            (pulse, "SW(Ron=1 Vt=4 Vh=0.5)"),
            (sine, "SW(Ron=1 Vt=2.9 Vh=0)"),
            ("Vc c 0 0", "SW(Ron=1 Vt=4 Vh=0.5)"),
            (
                "Rc c 0 1\nIc 0 c pulse(0 1 0 1n 1n 1u 2u)",
                "SW(Ron=1 Vt=4 Vh=0.5)",
            ),
            // The upper steps of a smooth transition.
            (pulse, "SW(Ron=1 Roff=1Meg Vt=5 Vh=-2)"),
        ] {
            assert_eq!(said(control, model), [""; 0], "{control} {model}");
        }
    }
}
