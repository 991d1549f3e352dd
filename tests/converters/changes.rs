//! Changes of a circuit that must not change its answer, or change it in a known way.

use std::collections::BTreeMap;

use crate::circuit::{Card, Circuit, Core, DiodeModel, Part, Wave, states, wholly_coupled};
use crate::random::Random;

/// Another netlist of the same circuit.
pub(crate) struct Change {
    pub(crate) name: &'static str,
    pub(crate) text: String,
    /// Its circuit, of which rows and instants count.
    pub(crate) circuit: Circuit,
    /// Every so many of its rows is a row of the original.
    pub(crate) every: usize,
    /// What each of the original's states is called, and its factor.
    pub(crate) signals: Vec<(String, f64)>,
}

pub(crate) const KINDS: [&str; 10] = [
    "more signals",
    "one signal",
    "print step",
    "order",
    "names and orientation",
    "polarity",
    "volts",
    "amperes",
    "seconds",
    "copy beside it",
];

/// A change by its place in [`KINDS`], or the splitting of elements for any other number; `None` where it does not apply.
pub(crate) fn change(circuit: &Circuit, kind: usize, random: &mut Random) -> Option<Change> {
    let same = |names: Vec<String>| names.into_iter().map(|n| (n, 1.0)).collect::<Vec<_>>();
    let own = states(circuit);
    if own.is_empty() {
        return None;
    }
    let of = |name, changed: Circuit, signals| Change {
        name,
        text: changed.text(),
        circuit: changed,
        every: 1,
        signals,
    };
    let name = KINDS.get(kind).copied().unwrap_or("split elements");
    let mut changed = circuit.clone();
    Some(match kind {
        0 => Change {
            text: circuit.text_saving(&with_nodes(circuit, &own), circuit.rows),
            ..of(name, changed, same(own))
        },
        1 => {
            let one = own[random.below(own.len())].clone();
            Change {
                text: circuit.text_saving(std::slice::from_ref(&one), circuit.rows),
                ..of(name, changed, vec![(one, 1.0)])
            }
        }
        2 => {
            let every = random.pick(&[2, 3, 7]);
            changed.rows *= every;
            Change {
                every,
                ..of(name, changed, same(own))
            }
        }
        3 => {
            random.shuffle(&mut changed.cards);
            of(name, changed, same(own))
        }
        4 => renamed(changed, random),
        5 => {
            mirror(&mut changed)?;
            of(name, changed, own.into_iter().map(|n| (n, -1.0)).collect())
        }
        6 => {
            let factor = random.pick(&[1e-3, 0.25, 7.0, 1e3]);
            scale_volts(&mut changed, factor)?;
            of(
                name,
                changed,
                own.into_iter().map(|n| (n, factor)).collect(),
            )
        }
        7 => {
            let factor = random.pick(&[1e-3, 0.25, 7.0, 1e3]);
            scale_ohms(&mut changed, factor);
            let of_kind = |n: String| {
                let by = if n.starts_with('i') {
                    1.0 / factor
                } else {
                    1.0
                };
                (n, by)
            };
            of(name, changed, own.into_iter().map(of_kind).collect())
        }
        8 => {
            scale_seconds(&mut changed, random.pick(&[1e-3, 0.25, 7.0, 1e3]));
            of(name, changed, same(own))
        }
        9 => {
            let mut copy = circuit.clone();
            if random.one_in(2) {
                scale_seconds(&mut copy, random.pick(&[0.5, 0.7, 1.3, 2.0]));
            }
            for mut card in copy.cards {
                for node in card.nodes.iter_mut().filter(|n| *n != "0") {
                    node.push('x');
                }
                card.name.push('x');
                if let Part::K(a, b, _) = &mut card.part {
                    a.push('x');
                    b.push('x');
                }
                changed.cards.push(card);
            }
            Change {
                text: changed.text_saving(&own, changed.rows),
                ..of(name, changed, same(own))
            }
        }
        _ => {
            split(&mut changed, random);
            Change {
                text: changed.text_saving(&own, changed.rows),
                ..of(name, changed, same(own))
            }
        }
    })
}

/// All node voltages after the signals.
fn with_nodes(circuit: &Circuit, signals: &[String]) -> Vec<String> {
    let mut all = signals.to_vec();
    let nodes = circuit.cards.iter().flat_map(|c| &c.nodes);
    for node in nodes.filter(|n| *n != "0") {
        let name = format!("v({node})");
        if !all.contains(&name) {
            all.push(name);
        }
    }
    all
}

fn renamed(mut circuit: Circuit, random: &mut Random) -> Change {
    let coupled: Vec<String> = circuit
        .cards
        .iter()
        .filter_map(|c| match &c.part {
            Part::K(a, b, _) => Some([a.clone(), b.clone()]),
            _ => None,
        })
        .flatten()
        .collect();
    let mut nodes: BTreeMap<String, String> = BTreeMap::from([("0".into(), "0".into())]);
    let mut names: BTreeMap<String, String> = BTreeMap::new();
    for card in &circuit.cards {
        for node in &card.nodes {
            let next = format!("n{:03}{}", random.below(1000), nodes.len());
            nodes.entry(node.clone()).or_insert(next);
        }
        let letter = &card.name[..1];
        let next = format!("{letter}{:03}z{}", random.below(1000), names.len());
        names.insert(card.name.clone(), next);
    }
    let hidden = wholly_coupled(&circuit);
    let mut signs = Vec::new();
    for card in &mut circuit.cards {
        let turned = random.one_in(2) && !coupled.contains(&card.name);
        let is_state = match &mut card.part {
            Part::R(_) if turned => {
                card.nodes.reverse();
                false
            }
            Part::C(_, ic) | Part::L(_, ic) | Part::Core(Core { ic, .. }) => {
                if turned {
                    card.nodes.reverse();
                    *ic = 0.0 - *ic;
                }
                !hidden.contains(&card.name)
            }
            Part::K(a, b, _) => {
                (*a, *b) = (names[a].clone(), names[b].clone());
                false
            }
            _ => false,
        };
        if is_state {
            signs.push(if turned { -1.0 } else { 1.0 });
        }
        for node in &mut card.nodes {
            *node = nodes[node].clone();
        }
        card.name = names[&card.name].clone();
    }
    // A state with its sign, before the cards are put into another order.
    let mut own: Vec<(String, f64)> = states(&circuit).into_iter().zip(signs).collect();
    for (name, sign) in &mut own {
        // `v(0,a)` is written the other way round.
        if let Some(node) = name.strip_prefix("v(0,") {
            (*name, *sign) = (format!("v({node}"), -*sign);
        }
    }
    random.shuffle(&mut circuit.cards);
    let names: Vec<String> = own.iter().map(|s| s.0.clone()).collect();
    Change {
        name: KINDS[4],
        text: circuit.text_saving(&names, circuit.rows),
        circuit,
        every: 1,
        signals: own,
    }
}

fn scale_wave(wave: &mut Wave, factor: f64) {
    match wave {
        Wave::Dc(v) => *v *= factor,
        Wave::Sin(offset, amplitude, _, _) => {
            *offset *= factor;
            *amplitude *= factor;
        }
        Wave::Pulse { levels, .. } => levels.iter_mut().for_each(|v| *v *= factor),
        Wave::Pwl(corners) => corners.iter_mut().for_each(|c| c.1 *= factor),
    }
}

/// All voltages and currents the other way round; there is no thyristor whose gate is at its anode.
fn mirror(circuit: &mut Circuit) -> Option<()> {
    for card in &mut circuit.cards {
        match &mut card.part {
            Part::C(_, ic) | Part::L(_, ic) | Part::Core(Core { ic, .. }) => *ic = 0.0 - *ic,
            Part::Thyristor(_) => return None,
            Part::V(wave) | Part::I(wave) => scale_wave(wave, -1.0),
            Part::D(_) => card.nodes.reverse(),
            Part::S(_) => card.nodes.swap(2, 3),
            Part::Comparator(levels, _) => {
                levels.iter_mut().for_each(|v| *v = 0.0 - *v);
                card.nodes.swap(2, 3);
            }
            Part::M(m) => {
                m.vto = -m.vto;
                m.p_channel = !m.p_channel;
            }
            Part::R(_) | Part::K(..) | Part::Gain(_) => {}
        }
    }
    Some(())
}

fn scale_volts(circuit: &mut Circuit, factor: f64) -> Option<()> {
    for card in &mut circuit.cards {
        match &mut card.part {
            Part::C(_, ic) | Part::L(_, ic) => *ic *= factor,
            Part::V(wave) | Part::I(wave) => scale_wave(wave, factor),
            Part::D(DiodeModel::Lines(vfwd, ..)) => *vfwd *= factor,
            Part::D(DiodeModel::Curved(..)) => return None,
            Part::S(m) => (m.vt, m.vh) = (m.vt * factor, m.vh * factor),
            Part::Comparator(levels, _) => levels.iter_mut().for_each(|v| *v *= factor),
            Part::M(m) => m.vto *= factor,
            Part::Thyristor(t) => (t.lines[0], t.vgt) = (t.lines[0] * factor, t.vgt * factor),
            Part::Core(core) => (core.knee, core.ic) = (core.knee * factor, core.ic * factor),
            Part::R(_) | Part::K(..) | Part::Gain(_) => {}
        }
    }
    Some(())
}

fn scale_ohms(circuit: &mut Circuit, factor: f64) {
    for card in &mut circuit.cards {
        match &mut card.part {
            Part::R(r) => *r *= factor,
            Part::C(c, _) => *c /= factor,
            Part::L(l, ic) => (*l, *ic) = (*l * factor, *ic / factor),
            Part::I(wave) => scale_wave(wave, 1.0 / factor),
            Part::D(DiodeModel::Lines(_, ron, roff)) => {
                (*ron, *roff) = (*ron * factor, *roff * factor);
            }
            Part::D(DiodeModel::Curved(is, _, rs)) => (*is, *rs) = (*is / factor, *rs * factor),
            Part::S(m) => (m.ron, m.roff) = (m.ron * factor, m.roff * factor),
            Part::M(m) => {
                (m.ron, m.roff) = (m.ron * factor, m.roff * factor);
                m.rb *= factor;
            }
            Part::Thyristor(t) => t.lines[1..].iter_mut().for_each(|r| *r *= factor),
            Part::Core(core) => {
                (core.knee, core.ic) = (core.knee / factor, core.ic / factor);
                (core.henries, core.saturated) = (core.henries * factor, core.saturated * factor);
            }
            Part::K(..) | Part::V(_) | Part::Gain(_) | Part::Comparator(..) => {}
        }
    }
}

fn scale_seconds(circuit: &mut Circuit, factor: f64) {
    circuit.stop *= factor;
    for card in &mut circuit.cards {
        match &mut card.part {
            Part::C(c, _) => *c *= factor,
            Part::L(l, _) => *l *= factor,
            Part::Core(core) => {
                (core.henries, core.saturated) = (core.henries * factor, core.saturated * factor);
            }
            Part::V(wave) | Part::I(wave) => match wave {
                Wave::Dc(_) => {}
                Wave::Sin(_, _, f, _) => *f /= factor,
                Wave::Pulse {
                    delay,
                    rise,
                    fall,
                    width,
                    period,
                    ..
                } => [delay, rise, fall, width, period]
                    .into_iter()
                    .for_each(|t| *t *= factor),
                Wave::Pwl(corners) => corners.iter_mut().for_each(|c| c.0 *= factor),
            },
            _ => {}
        }
    }
}

/// Some elements become two of the same together: in series, or (capacitors, switches) in parallel.
fn split(circuit: &mut Circuit, random: &mut Random) {
    let coupled: Vec<String> = circuit
        .cards
        .iter()
        .filter_map(|c| match &c.part {
            Part::K(a, b, _) => Some([a.clone(), b.clone()]),
            _ => None,
        })
        .flatten()
        .collect();
    let mut added = Vec::new();
    for card in &mut circuit.cards {
        if !random.one_in(2) || coupled.contains(&card.name) {
            continue;
        }
        let mut second = Card {
            name: format!("{}y", card.name),
            ..card.clone()
        };
        let in_series = match (&mut card.part, &mut second.part) {
            (Part::R(a), Part::R(b)) => {
                (*a, *b) = (*a * 0.5, *b * 0.5);
                true
            }
            (Part::L(a, _), Part::L(b, _)) => {
                (*a, *b) = (*a * 0.5, *b * 0.5);
                true
            }
            (Part::C(a, _), Part::C(b, _)) => {
                (*a, *b) = (*a * 0.5, *b * 0.5);
                false
            }
            (Part::Core(a), Part::Core(b)) => {
                (a.henries, a.saturated) = (a.henries * 0.5, a.saturated * 0.5);
                *b = *a;
                true
            }
            (Part::S(a), Part::S(b)) => {
                (a.ron, a.roff) = (a.ron * 2.0, a.roff * 2.0);
                *b = *a;
                false
            }
            (Part::D(DiodeModel::Lines(vfwd, ron, roff)), Part::D(b)) => {
                (*ron, *roff) = (*ron * 2.0, *roff * 2.0);
                *b = DiodeModel::Lines(*vfwd, *ron, *roff);
                false
            }
            _ => continue,
        };
        if in_series {
            let middle = format!("{}mid", card.name);
            card.nodes[1].clone_from(&middle);
            second.nodes[0] = middle;
        }
        added.push(second);
    }
    circuit.cards.extend(added);
}
