//! Comparators whose inputs are sources alone: what they give is a source too, known before the run.

use std::collections::HashMap;

use super::source::{Rest, Source, Wave, crossings};
use super::{Affine, Circuit, Element, Kind, NodeId, Output, Probed, Quantity};
use crate::law::Law;

/// Most edges of one comparator; one with more is left to the run.
const MOST_EDGES: usize = 1 << 19;
/// Controlled sources between a comparator and the sources.
const MOST_LEVELS: u32 = 8;

/// A sum of sources.
struct Sum<'a> {
    constant: f64,
    terms: Vec<(f64, &'a Source)>,
}

impl Circuit {
    /// The circuit with edges, until the end of its transient, in place of each comparator (a function block of two levels) whose input is a
    /// sum of sources, and how many there are; `None` where there is none. Sources that nothing but these reads stand still then.
    #[must_use]
    pub(crate) fn with_comparisons_made(&self) -> Option<(Self, usize)> {
        let until = self.tran?.tstop;
        let is_block = |e: &Element| matches!(e.kind, Kind::Function { .. });
        if !self.elements.iter().any(is_block) {
            return None;
        }
        let held = self.held_nodes();
        let made: Vec<(usize, Kind)> = (self.elements.iter().enumerate())
            .filter_map(|(k, element)| Some((k, edges(&held, &element.kind, until)?)))
            .collect();
        let count = made.len();
        if count == 0 {
            return None;
        }
        let mut circuit = self.clone();
        for (k, kind) in made {
            circuit.elements[k].kind = kind;
        }
        for k in circuit.unseen_sources() {
            if let Kind::VoltageSource(source) = &mut circuit.elements[k].kind {
                source.wave = Wave::Dc(source.wave.value(0.0));
            }
        }
        Some((circuit, count))
    }

    /// Voltage sources between ground and a node that no other element touches and nothing reads: a carrier whose comparators are edges now.
    fn unseen_sources(&self) -> Vec<usize> {
        let mut touched = vec![0_u32; self.nodes.len()];
        let mut see = |node: NodeId| touched[node.index()] += 1;
        let mut watched = Vec::new();
        for element in &self.elements {
            let read: &[_] = match &element.kind {
                Kind::Controlled { control: sum, .. } | Kind::Function { input: sum, .. } => {
                    &sum.terms
                }
                Kind::Switch(switch) => &switch.control.terms,
                _ => &[],
            };
            for (_, quantity) in read {
                match *quantity {
                    Quantity::Voltage(node) => see(node),
                    Quantity::Current(id) => watched.push(id),
                }
            }
            see(element.p);
            see(element.n);
        }
        for probe in self.probes().iter().chain(&self.measured) {
            match probe.what {
                Probed::Voltage(a, b) => {
                    see(a);
                    see(b);
                }
                Probed::Current(id) => watched.push(id),
            }
        }
        let alone = |&k: &usize| {
            let Element { p, n, kind, .. } = &self.elements[k];
            let node = match (*p, *n) {
                (node, NodeId::GROUND) | (NodeId::GROUND, node) => node,
                _ => return false,
            };
            matches!(kind, Kind::VoltageSource(_))
                && touched[node.index()] == 1
                && watched.iter().all(|id| id.index() != k)
        };
        (0..self.elements.len()).filter(alone).collect()
    }

    /// By node the voltage that one element holds there against ground, with its sign.
    fn held_nodes(&self) -> HashMap<NodeId, (f64, &Kind)> {
        let holds = |kind: &Kind| {
            let voltage = Output::Voltage;
            matches!(kind, Kind::VoltageSource(_))
                || matches!(kind, Kind::Controlled { output, .. } if *output == voltage)
        };
        let held = self.elements.iter().filter(|e| holds(&e.kind));
        held.filter_map(|element| match (element.p, element.n) {
            (p, NodeId::GROUND) => Some((p, (1.0, &element.kind))),
            (NodeId::GROUND, n) => Some((n, (-1.0, &element.kind))),
            _ => None,
        })
        .collect()
    }
}

/// The source that a comparator is until a time, s.
fn edges(held: &HashMap<NodeId, (f64, &Kind)>, kind: &Kind, until: f64) -> Option<Kind> {
    let Kind::Function {
        output,
        input,
        law: Law::Curve(curve),
    } = kind
    else {
        return None;
    };
    let (level, low, high) = curve.step()?;
    let Sum { constant, terms } = sum_of(held, input, MOST_LEVELS)?;
    let side = |value: f64| if value > level { high } else { low };
    let total = |of: &dyn Fn(&Source) -> f64| -> f64 {
        constant + terms.iter().map(|(gain, s)| gain * of(s)).sum::<f64>()
    };
    let (at_rest, first) = (total(&|s| s.dc), total(&|s| s.value(0.0)));
    let found = crossings(&terms, (constant, level), Rest::IsNeither, 0.0, until);
    // What jumps at the start has another value at the operating point.
    let jumps = terms.iter().any(|(_, s)| s.is_edge(0.0));
    if at_rest == level || jumps || found.len() > MOST_EDGES {
        return None;
    }
    let start = match found.first() {
        Some(crossing) if crossing.rising => low,
        Some(_) => high,
        // What rests on the threshold is for the network to decide.
        None if first == level => return None,
        None => side(first),
    };
    let mut points = vec![(0.0, start)];
    for crossing in &found {
        let (before, after) = if crossing.rising {
            (low, high)
        } else {
            (high, low)
        };
        points.extend([(crossing.time, before), (crossing.time, after)]);
    }
    let wave = if found.is_empty() {
        Wave::Dc(start)
    } else {
        Wave::Pwl {
            points,
            repeat: None,
            delay: 0.0,
        }
    };
    let source = Source {
        dc: side(at_rest),
        wave,
    };
    Some(match output {
        Output::Voltage => Kind::VoltageSource(source),
        Output::Current => Kind::CurrentSource(source),
    })
}

/// What a sum of voltages is made of.
fn sum_of<'a>(
    held: &HashMap<NodeId, (f64, &'a Kind)>,
    sum: &Affine,
    levels: u32,
) -> Option<Sum<'a>> {
    let mut all = Sum {
        constant: sum.constant,
        terms: Vec::new(),
    };
    for &(gain, quantity) in &sum.terms {
        let Quantity::Voltage(node) = quantity else {
            return None;
        };
        if node == NodeId::GROUND {
            continue;
        }
        let (sign, kind) = held.get(&node)?;
        let gain = gain.f64 * sign;
        match kind {
            Kind::VoltageSource(Source {
                wave: Wave::Arriving { .. },
                ..
            }) => return None,
            Kind::VoltageSource(source) => all.terms.push((gain, source)),
            Kind::Controlled { control, .. } => {
                let inner = sum_of(held, control, levels.checked_sub(1)?)?;
                all.constant += gain * inner.constant;
                let terms = inner.terms.into_iter();
                all.terms
                    .extend(terms.map(|(g, source)| (gain * g, source)));
            }
            _ => return None,
        }
    }
    Some(all)
}

#[cfg(test)]
mod tests {
    use super::super::Diodes;
    use super::super::fixture::read;
    use super::*;

    /// What `b` of a circuit is made to.
    fn made(cards: &str) -> Option<Source> {
        let text = format!("{cards}\nrb b 0 1k\n.tran 1u 2m");
        let (circuit, _) = read(&text, Diodes::Auto);
        let (circuit, _) = circuit?.with_comparisons_made()?;
        let element = &circuit.elements[circuit.element("b1")?.index()];
        match &element.kind {
            Kind::VoltageSource(source) => Some(source.clone()),
            _ => None,
        }
    }

    #[test]
    fn a_triangle_against_a_level_gives_pulses_at_their_instants() {
        let cards = "vt t 0 pulse(-1 1 0 0.5m 0.5m 0 1m)\nvc c 0 0.5\nb1 b 0 v=v(c)>v(t) ? 5 : 0";
        let source = made(cards).expect("it is known");
        let Wave::Pwl { points, .. } = source.wave else {
            panic!("{source:?}");
        };
        // −1 + 4000 t = 0.5 at 0.375 ms, 3 − 4000 t at 0.625 ms.
        let expected = [
            (0.0, 5.0),
            (0.375e-3, 5.0),
            (0.375e-3, 0.0),
            (0.625e-3, 0.0),
            (0.625e-3, 5.0),
            (1.375e-3, 5.0),
            (1.375e-3, 0.0),
            (1.625e-3, 0.0),
            (1.625e-3, 5.0),
        ];
        assert_eq!(points.len(), expected.len());
        for (point, wanted) in points.iter().zip(expected) {
            assert!((point.0 - wanted.0).abs() < 1e-17 && point.1 == wanted.1);
        }
        assert_eq!(source.dc, 5.0);
    }

    #[test]
    fn a_sine_behind_controlled_sources_is_a_sum_of_sources_too() {
        let cards = "vs s 0 sin(0 1 1k)\ne1 n 0 s 0 -2\nb1 b 0 v=u(v(n)+1)";
        let source = made(cards).expect("it is known");
        // 1 − 2 sin(2π 1 kHz t) falls through 0 at a twelfth of a period.
        let edge = source.wave.next_breakpoint(0.0).expect("an edge");
        assert!((edge - 1e-3 / 12.0).abs() < 1e-17, "{edge}");
        assert_eq!(
            (source.wave.value(0.0), source.wave.value(edge)),
            (1.0, 0.0)
        );
    }

    #[test]
    fn a_carrier_stands_still_that_nothing_else_reads() {
        let wave = |more: &str| {
            let cards = "vt t 0 pulse(-1 1 0 0.5m 0.5m 0 1m)\nb1 b 0 v=v(t)>0.5 ? 5 : 0";
            let text = format!("{cards}\nrb b 0 1k\n.tran 1u 2m\n{more}");
            let circuit = read(&text, Diodes::Auto).0.expect("a circuit");
            let (circuit, _) = circuit.with_comparisons_made().expect("it is known");
            let carrier = circuit.element("vt").expect("it is there").index();
            match &circuit.elements[carrier].kind {
                Kind::VoltageSource(source) => source.wave.clone(),
                _ => unreachable!("it is a source"),
            }
        };
        assert_eq!(wave(".save v(b)"), Wave::Dc(-1.0));
        for seen in [
            ".save v(b) v(t)",
            ".save v(b) i(vt)",
            ".save v(b)\nr1 t 0 1k",
            ".save v(b)\ng1 0 b t 0 1",
            ".save v(b)\nf1 0 b vt 1",
            ".save v(b)\n.meas tran top max v(t)",
        ] {
            assert!(matches!(wave(seen), Wave::Pulse { .. }), "{seen}");
        }
    }

    #[test]
    fn what_the_network_decides_is_left_to_it() {
        let rc = "vs s 0 sin(0 1 1k)\nr1 s c 1k\nc1 c 0 1u\nb1 b 0 v=u(v(c))";
        assert_eq!(made(rc), None);
        // Rest on the threshold, at the operating point or without end.
        assert_eq!(made("vs s 0 0\nb1 b 0 v=u(v(s))"), None);
        assert_eq!(made("vs s 0 sin(0 1 1k)\nb1 b 0 v=u(v(s))"), None);
        // An edge at the start.
        let edge = "vs s 0 pulse(-1 1 0 0 1u 0.5m 1m)\nb1 b 0 v=u(v(s))";
        assert_eq!(made(edge), None);
        assert!(made(&edge.replace("-1 1 0 0", "-1 1 1u 0")).is_some());
        // More than two levels, and a saturation.
        assert_eq!(
            made("vs s 0 sin(0.1 1 1k)\nb1 b 0 v=sgn(v(s))+u(v(s)-0.5)"),
            None
        );
        assert_eq!(made("vs s 0 sin(0.1 1 1k)\nb1 b 0 v=limit(v(s),0,1)"), None);
    }
}
