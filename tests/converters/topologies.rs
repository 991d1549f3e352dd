//! Random converters: a power stage, a control and a style of devices, from a seed.

use std::f64::consts::PI;

use crate::bench::{Bench, Gate, Switches};
use crate::circuit::{Circuit, DiodeModel, Part, SwitchModel, Wave};
use crate::random::{Random, digits};

/// How devices are modelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Style {
    /// Everything ideal.
    Ideal,
    /// Ron and Roff in every switch and diode, within reach of the oracle.
    Finite,
    /// The same up to 1e-9 Ω and 1e15 Ω.
    Extreme,
    /// Some ideal, some not.
    Mixed,
    /// Exponential diodes.
    Curved,
    /// Exponential diodes beside ones of lines.
    Both,
}

/// A power stage.
type Stage = fn(&mut Bench<'_>);

/// Their names and builders.
const STAGES: [(&str, Stage); 28] = [
    ("random network", random_network),
    ("buck", buck),
    ("synchronous buck", synchronous_buck),
    ("boost", boost),
    ("synchronous boost", synchronous_boost),
    ("inverting", inverting),
    ("flyback", flyback),
    ("forward", forward),
    ("push-pull", push_pull),
    ("sepic", sepic),
    ("cuk", cuk),
    ("half bridge", half_bridge),
    ("full bridge", full_bridge),
    ("three-phase bridge", three_phase_bridge),
    ("submodules", submodules),
    ("flying capacitor", flying_capacitor),
    ("neutral point clamped", neutral_point_clamped),
    ("llc", llc),
    ("series resonant", series_resonant),
    ("half-wave rectifier", half_wave),
    ("bridge rectifier", bridge_rectifier),
    ("three-pulse rectifier", three_pulse),
    ("six-pulse rectifier", six_pulse),
    ("doubler", doubler),
    ("multiplier", multiplier),
    ("dickson pump", dickson),
    ("switched capacitor", switched_capacitor),
    ("interleaved buck", interleaved_buck),
];

/// Further ones.
const MORE_STAGES: [(&str, Stage); 5] = [
    ("controlled half wave", controlled_half_wave),
    ("controlled bridge", controlled_bridge),
    ("controlled six-pulse", controlled_six_pulse),
    ("dimmer", dimmer),
    ("freewheeling leg", freewheeling_leg),
];

/// Seeds from here on draw from further stages, styles and devices too; the earlier ones are as they were, as findings name them.
const FURTHER: u64 = 8_000_000;

/// A circuit and how it came to be.
#[derive(Debug, Clone)]
pub(crate) struct Case {
    pub(crate) stage: &'static str,
    pub(crate) style: Style,
    pub(crate) circuit: Circuit,
}

/// The case of a seed.
pub(crate) fn case(seed: u64) -> Case {
    use Style::{Both, Curved, Extreme, Finite, Ideal, Mixed};
    let mut random = Random::new(seed);
    if seed >= FURTHER {
        let style = random.pick(&[Ideal, Ideal, Finite, Extreme, Mixed, Curved, Both]);
        return build(seed, style, &mut random);
    }
    let style = random.pick(&[
        Ideal, Ideal, Ideal, Ideal, Ideal, Finite, Finite, Finite, Extreme, Extreme, Mixed, Mixed,
        Curved,
    ]);
    build(seed, style, &mut random)
}

/// A case of a style for other simulators: switches without body diodes, edges that take time.
pub(crate) fn plain_case(seed: u64, style: Style) -> Case {
    let mut random = Random::new(seed);
    let mut case = build(seed, style, &mut random);
    case.circuit.rows = 19;
    for card in &mut case.circuit.cards {
        let edge = |t: &mut f64, of: f64| {
            if *t == 0.0 {
                *t = 1e-3 * of;
            }
        };
        match &mut card.part {
            Part::V(wave) | Part::I(wave) => match wave {
                Wave::Pulse {
                    rise,
                    fall,
                    width,
                    period,
                    ..
                } => {
                    // ngspice 39 takes a width of zero for none given.
                    [&mut *rise, fall, width]
                        .into_iter()
                        .for_each(|t| edge(t, *period));
                    *rise -= (*rise + *fall + *width - *period).max(0.0);
                }
                Wave::Pwl(corners) => {
                    let length = corners.last().map_or(0.0, |c| c.0);
                    for k in 1..corners.len() {
                        if corners[k].0 <= corners[k - 1].0 {
                            corners[k].0 = corners[k - 1].0 + 1e-3 * length;
                        }
                    }
                }
                Wave::Dc(_) | Wave::Sin(..) => {}
            },
            Part::M(m) => {
                let [drain, gate, source] = [0, 1, 2].map(|k| card.nodes[k].clone());
                let (p, n) = if m.p_channel {
                    (source.clone(), gate)
                } else {
                    (gate, source.clone())
                };
                let model = SwitchModel {
                    ron: m.ron,
                    roff: m.roff,
                    vt: m.vto.abs(),
                    vh: 0.0,
                };
                card.name.insert(0, 's');
                card.nodes = vec![drain, source, p, n];
                card.part = Part::S(model);
            }
            _ => {}
        }
    }
    case
}

fn build(seed: u64, style: Style, random: &mut Random) -> Case {
    let is_further = seed >= FURTHER;
    let (stage, build) = if is_further && random.one_in(2) {
        random.pick(&MORE_STAGES)
    } else {
        random.pick(&STAGES)
    };
    let mut bench = Bench::new(random);
    devices(&mut bench, style);
    // Where ideal devices leave a saturable inductor's current no path but itself, its flux is refused.
    let is_finite = matches!(style, Style::Finite | Style::Curved | Style::Both);
    bench.saturates = is_further && is_finite && bench.random.one_in(2);
    build(&mut bench);
    let periods = bench.random.pick(&[2.0, 3.0, 4.0, 5.0]);
    // Odd, so that rows seldom meet edges.
    let rows = bench.random.pick(&[23, 29, 37]);
    let period = bench.period;
    let mut circuit = bench.circuit;
    circuit.title = format!("{stage}, {style:?}, seed {seed}");
    circuit.stop = digits(periods * period, 6);
    circuit.rows = rows;
    Case {
        stage,
        style,
        circuit,
    }
}

fn devices(b: &mut Bench<'_>, style: Style) {
    let z = b.ohms;
    let ideal = (0.0, f64::INFINITY);
    let finite = |random: &mut Random| {
        let ron = digits(z * random.pick(&[1e-1, 1e-2, 1e-3, 1e-4]), 2);
        let roff = digits(z * random.pick(&[1e2, 1e3, 1e4, 1e6]), 2);
        (ron, roff)
    };
    let extreme = |random: &mut Random| {
        let ron = random.pick(&[1e-9, 1e-6, 1e-3, 1e-2]);
        let roff = random.pick(&[1e6, 1e9, 1e12, 1e15]);
        (ron, roff)
    };
    let pair = |random: &mut Random| match style {
        Style::Ideal => ideal,
        Style::Finite | Style::Curved | Style::Both => finite(random),
        Style::Extreme => extreme(random),
        Style::Mixed => match random.below(4) {
            0 => ideal,
            1 => (finite(random).0, f64::INFINITY),
            2 => (0.0, finite(random).1),
            _ => finite(random),
        },
    };
    let (ron, roff) = pair(b.random);
    b.switches = if b.random.one_in(4) {
        Switches::Mos(ron, roff)
    } else {
        Switches::Sw(ron, roff)
    };
    let (ron, roff) = pair(b.random);
    let drop = match style {
        Style::Ideal => b.random.pick(&[0.0, 0.0, 0.0, 0.7]),
        _ => b.random.pick(&[0.0, 0.3, 0.7]),
    };
    let lines = DiodeModel::Lines(drop, ron, roff);
    b.diodes = if matches!(style, Style::Curved | Style::Both) {
        let is = b.random.pick(&[1e-14, 1e-12, 1e-9, 1e-6]);
        let n = b.random.pick(&[1.0, 1.05, 1.8]);
        let rs = b.random.pick(&[0.0, 1e-3, 1e-2]);
        DiodeModel::Curved(is, n, rs * z)
    } else {
        lines
    };
    if style == Style::Both {
        b.others = Some(lines);
    }
}

fn buck(b: &mut Bench<'_>) {
    let (sw, out, x) = (b.node(), b.node(), b.node());
    let input = b.supply();
    let sense = digits(b.ohms * 0.05, 2);
    let gate = b.any_gate(&out, Some((&x, &out, sense)));
    b.switch(&input, &sw, &gate);
    b.diode("0", &sw);
    b.choke(&sw, &x);
    b.r(&x, &out, sense);
    let whole = 0.5 * b.volts;
    b.output(&out, "0", whole);
}

fn synchronous_buck(b: &mut Bench<'_>) {
    let (sw, out) = (b.node(), b.node());
    let input = b.supply();
    let dead = b.dead_time();
    let [high, low] = if dead == 0.0 {
        let gate = b.any_gate(&out, None);
        let low = gate.complement();
        [gate, low]
    } else {
        b.leg_gates(dead)
    };
    let with_diodes = dead > 0.0 && !b.random.one_in(4) || b.random.one_in(3);
    b.leg_switch(&input, &sw, &high, with_diodes);
    b.leg_switch(&sw, "0", &low, with_diodes);
    b.choke(&sw, &out);
    let whole = 0.5 * b.volts;
    b.output(&out, "0", whole);
}

fn interleaved_buck(b: &mut Bench<'_>) {
    let input = b.supply();
    let out = b.node();
    let phases = 2 + b.random.below(3);
    let (duty, equal) = (b.duty(), b.random.one_in(2));
    let synchronous = b.random.one_in(2);
    let henries = b.henries();
    for k in 0..phases {
        let sw = b.node();
        let duty = if equal { duty } else { b.duty() };
        let gate = b.pulse_gate(k as f64 / phases as f64, duty);
        b.switch(&input, &sw, &gate);
        if synchronous {
            b.switch(&sw, "0", &gate.complement());
        } else {
            b.diode("0", &sw);
        }
        if equal {
            b.l(&sw, &out, henries, 0.0);
        } else {
            b.choke(&sw, &out);
        }
    }
    let whole = 0.5 * b.volts;
    b.output(&out, "0", whole);
}

fn boost(b: &mut Bench<'_>) {
    let (sw, out) = (b.node(), b.node());
    let input = b.supply();
    let gate = b.open_gate();
    b.choke(&input, &sw);
    b.switch(&sw, "0", &gate);
    b.diode(&sw, &out);
    let whole = 1.5 * b.volts;
    b.output(&out, "0", whole);
}

fn synchronous_boost(b: &mut Bench<'_>) {
    let (sw, out) = (b.node(), b.node());
    let input = b.supply();
    let dead = b.dead_time();
    let [low, high] = b.leg_gates(dead);
    let with_diodes = dead > 0.0 || b.random.one_in(3);
    b.choke(&input, &sw);
    b.leg_switch(&sw, "0", &low, with_diodes);
    b.leg_switch(&out, &sw, &high, with_diodes);
    let whole = 1.5 * b.volts;
    b.output(&out, "0", whole);
}

fn inverting(b: &mut Bench<'_>) {
    let (sw, out) = (b.node(), b.node());
    let input = b.supply();
    let gate = b.open_gate();
    b.switch(&input, &sw, &gate);
    b.choke(&sw, "0");
    if b.random.one_in(3) {
        b.switch(&sw, &out, &gate.complement());
    } else {
        b.diode(&out, &sw);
    }
    let whole = -b.volts;
    b.output(&out, "0", whole);
}

/// Windings of a transformer with its turns ratio; the coupling is whole or leaves a leakage.
fn windings(b: &mut Bench<'_>, nodes: &[[&str; 2]], ratios: &[f64], magnetising: f64) {
    let whole = b.random.one_in(2);
    let k = if whole {
        1.0
    } else {
        b.random.pick(&[0.9, 0.98, 0.99])
    };
    let names: Vec<String> = nodes
        .iter()
        .zip(ratios)
        .map(|(n, ratio)| b.l(n[0], n[1], magnetising * ratio * ratio, 0.0))
        .collect();
    for i in 0..names.len() {
        for j in 0..i {
            b.k(&names[j], &names[i], k);
        }
    }
}

fn flyback(b: &mut Bench<'_>) {
    let (sw, sec, out) = (b.node(), b.node(), b.node());
    let input = b.supply();
    let gate = b.open_gate();
    let ratio = b.random.pick(&[0.5, 1.0, 2.0]);
    let henries = b.henries();
    windings(b, &[[&input, &sw], ["0", &sec]], &[1.0, ratio], henries);
    b.switch(&sw, "0", &gate);
    if b.random.one_in(2) {
        // A clamp for what the leakage holds.
        let clamp = b.node();
        b.diode(&sw, &clamp);
        let (farads, ohms) = (b.farads(), b.ohms * 10.0);
        b.c(&clamp, &input, farads, b.volts);
        b.r(&clamp, &input, ohms);
    }
    b.diode(&sec, &out);
    let whole = b.volts * ratio;
    b.output(&out, "0", whole);
}

fn forward(b: &mut Bench<'_>) {
    let (sw, reset, sec, x, out) = (b.node(), b.node(), b.node(), b.node(), b.node());
    let input = b.supply();
    let duty = b.random.pick(&[0.2, 0.3, 0.4, 0.45, 0.5]);
    let gate = b.pulse_gate(0.0, duty);
    let ratio = b.random.pick(&[0.5, 1.0, 2.0]);
    let henries = digits(b.henries() * 20.0, 2);
    let pins = [[input.as_str(), &sw], [&reset, &input], [&sec, "0"]];
    windings(b, &pins, &[1.0, 1.0, ratio], henries);
    b.switch(&sw, "0", &gate);
    b.diode("0", &reset);
    b.diode(&sec, &x);
    b.diode("0", &x);
    b.choke(&x, &out);
    let whole = b.volts * ratio * duty;
    b.output(&out, "0", whole);
}

fn push_pull(b: &mut Bench<'_>) {
    let (s1, s2, a1, a2, x, out) = (b.node(), b.node(), b.node(), b.node(), b.node(), b.node());
    let input = b.supply();
    let duty = b.random.pick(&[0.2, 0.3, 0.4, 0.45, 0.48]);
    let (first, second) = (b.pulse_gate(0.0, duty), b.pulse_gate(0.5, duty));
    let ratio = b.random.pick(&[0.5, 1.0, 2.0]);
    let henries = digits(b.henries() * 20.0, 2);
    let pins = [[input.as_str(), &s1], [&s2, &input], [&a1, "0"], ["0", &a2]];
    windings(b, &pins, &[1.0, 1.0, ratio, ratio], henries);
    b.switch(&s1, "0", &first);
    b.switch(&s2, "0", &second);
    b.diode(&a1, &x);
    b.diode(&a2, &x);
    b.choke(&x, &out);
    let whole = b.volts * ratio * 2.0 * duty;
    b.output(&out, "0", whole);
}

fn sepic(b: &mut Bench<'_>) {
    let (sw, mid, out) = (b.node(), b.node(), b.node());
    let input = b.supply();
    let gate = b.open_gate();
    b.choke(&input, &sw);
    b.switch(&sw, "0", &gate);
    let farads = b.farads();
    b.c(&sw, &mid, farads, b.volts);
    b.choke(&mid, "0");
    b.diode(&mid, &out);
    let whole = b.volts;
    b.output(&out, "0", whole);
}

fn cuk(b: &mut Bench<'_>) {
    let (sw, mid, out) = (b.node(), b.node(), b.node());
    let input = b.supply();
    let gate = b.open_gate();
    b.choke(&input, &sw);
    b.switch(&sw, "0", &gate);
    let farads = b.farads();
    b.c(&sw, &mid, farads, 2.0 * b.volts);
    b.diode(&mid, "0");
    b.choke(&out, &mid);
    let whole = -b.volts;
    b.output(&out, "0", whole);
}

/// A load between two nodes: R, RL, RLC or a filter with R.
fn load(b: &mut Bench<'_>, a: &str, z: &str) {
    match b.random.below(4) {
        0 => {
            let x = b.node();
            let ohms = b.ohms;
            b.r(a, &x, ohms);
            b.choke(&x, z);
        }
        1 => {
            let x = b.node();
            b.choke(a, &x);
            b.output(&x, z, 0.0);
        }
        2 => {
            let (x, y) = (b.node(), b.node());
            let (ohms, farads) = (b.ohms, b.farads());
            b.choke(a, &x);
            b.r(&x, &y, ohms);
            b.c(&y, z, farads, 0.0);
        }
        _ => {
            let (x, ohms) = (b.node(), b.ohms);
            let back = digits(0.3 * b.volts, 2);
            b.choke(a, &x);
            let y = b.node();
            b.r(&x, &y, 0.1 * ohms);
            b.v(&y, z, Wave::Dc(back));
        }
    }
}

/// Halves of a direct voltage: the outer nodes around ground.
fn split_supply(b: &mut Bench<'_>) -> [String; 2] {
    let (top, bottom) = (b.node(), b.node());
    let half = 0.5 * b.volts;
    b.v(&top, "0", Wave::Dc(half));
    b.v("0", &bottom, Wave::Dc(half));
    [top, bottom]
}

/// A leg between the rails.
fn leg(b: &mut Bench<'_>, rails: [&str; 2], gates: &[Gate; 2], with_diodes: bool) -> String {
    let x = b.node();
    b.leg_switch(rails[0], &x, &gates[0], with_diodes);
    b.leg_switch(&x, rails[1], &gates[1], with_diodes);
    x
}

fn half_bridge(b: &mut Bench<'_>) {
    let [top, bottom] = split_supply(b);
    let dead = b.dead_time();
    let gates = b.leg_gates(dead);
    let with_diodes = dead > 0.0 && !b.random.one_in(4) || b.random.one_in(2);
    let x = leg(b, [&top, &bottom], &gates, with_diodes);
    load(b, &x, "0");
}

fn full_bridge(b: &mut Bench<'_>) {
    let input = b.supply();
    let with_diodes = b.random.one_in(2);
    let (first, second) = match b.random.below(4) {
        // Both legs at once, from one control.
        0 => {
            let gates = b.leg_gates(0.0);
            let other = [gates[1].clone(), gates[0].clone()];
            (gates, other)
        }
        // A shifted phase.
        1 => {
            let shift = b.random.pick(&[0.1, 0.25, 0.5]);
            let (one, two) = (b.pulse_gate(0.0, 0.5), b.pulse_gate(shift, 0.5));
            let complements = (one.complement(), two.complement());
            ([one, complements.0], [two, complements.1])
        }
        // A sine and its negative against one triangle.
        2 => {
            let phase = b.random.pick(&[0.0, 30.0, 90.0]);
            let r = b.sine_reference(0.0, 0.8, phase);
            let minus = b.node();
            b.gain([&minus, "0", "0", &r], 1.0);
            let carrier = b.triangle(-1.0, 1.0, 0.0);
            let (one, two) = (b.compared(&r, &carrier), b.compared(&minus, &carrier));
            let complements = (one.complement(), two.complement());
            ([one, complements.0], [two, complements.1])
        }
        _ => {
            let (one, two) = (b.leg_gates(0.0), b.leg_gates(0.0));
            (one, two)
        }
    };
    let x = leg(b, [&input, "0"], &first, with_diodes);
    let y = leg(b, [&input, "0"], &second, with_diodes);
    load(b, &x, &y);
}

fn three_phase_bridge(b: &mut Bench<'_>) {
    let [top, bottom] = split_supply(b);
    let with_diodes = b.random.one_in(2);
    let carrier = b.triangle(-1.0, 1.0, 0.0);
    let star = b.node();
    let f = digits(1.0 / (b.random.pick(&[5.0, 10.0, 20.0]) * b.period), 6);
    let (henries, ohms) = (b.henries(), b.ohms);
    let equal = b.random.one_in(2);
    let amplitude = b.random.pick(&[0.5, 0.8, 0.9]);
    for phase in [0.0, -120.0, 120.0] {
        let (r, y) = (b.node(), b.node());
        b.v(&r, "0", Wave::Sin(0.0, amplitude, f, phase));
        let gate = b.compared(&r, &carrier);
        let gates = [gate.clone(), gate.complement()];
        let x = leg(b, [&top, &bottom], &gates, with_diodes);
        let henries = if equal { henries } else { b.henries() };
        b.l(&x, &y, henries, 0.0);
        b.r(&y, &star, ohms);
    }
}

/// An arm of a modular multilevel converter: half- or full-bridge cells with capacitors, in series with an inductor.
fn submodules(b: &mut Bench<'_>) {
    let input = b.supply();
    let cells = 1 + b.random.below(3);
    let x = b.node();
    let ohms = b.ohms;
    b.choke(&input, &x);
    let full = b.random.one_in(3);
    let with_diodes = b.random.one_in(3);
    let shared = b.random.one_in(2);
    let reference = b.sine_reference(0.5, 0.45, 0.0);
    let level = digits(b.volts / cells as f64, 2);
    let farads = b.farads();
    let mut upper = x;
    for k in 0..cells {
        let lower = b.node();
        let shift = if shared { 0.0 } else { k as f64 / cells as f64 };
        let carrier = b.triangle(0.0, 1.0, shift);
        let gate = b.compared(&reference, &carrier);
        let other = gate.complement();
        let plus = b.node();
        if full {
            let minus = b.node();
            let second = b.open_gate();
            b.leg_switch(&plus, &upper, &gate, with_diodes);
            b.leg_switch(&upper, &minus, &other, with_diodes);
            b.leg_switch(&plus, &lower, &second, with_diodes);
            b.leg_switch(&lower, &minus, &second.complement(), with_diodes);
            b.c(&plus, &minus, farads, level);
        } else {
            b.leg_switch(&plus, &upper, &gate, with_diodes);
            b.leg_switch(&upper, &lower, &other, with_diodes);
            b.c(&plus, &lower, farads, level);
        }
        upper = lower;
    }
    b.r(&upper, "0", ohms);
}

fn flying_capacitor(b: &mut Bench<'_>) {
    let input = b.supply();
    let (top, x, bottom) = (b.node(), b.node(), b.node());
    let duty = b.duty();
    let (outer, inner) = (b.pulse_gate(0.0, duty), b.pulse_gate(0.5, duty));
    let with_diodes = b.random.one_in(2);
    let farads = b.farads();
    let half = 0.5 * b.volts;
    b.leg_switch(&input, &top, &outer, with_diodes);
    b.leg_switch(&top, &x, &inner, with_diodes);
    b.leg_switch(&x, &bottom, &inner.complement(), with_diodes);
    b.leg_switch(&bottom, "0", &outer.complement(), with_diodes);
    b.c(&top, &bottom, farads, half);
    load(b, &x, "0");
}

/// Three levels, each pair of switches on one crossing.
fn neutral_point_clamped(b: &mut Bench<'_>) {
    let [top, bottom] = split_supply(b);
    let (a, x, c) = (b.node(), b.node(), b.node());
    let reference = b.sine_reference(0.0, 0.8, 0.0);
    let upper = b.triangle(0.0, 1.0, 0.0);
    let lower = b.triangle(-1.0, 0.0, 0.0);
    let (first, second) = (
        b.compared(&reference, &upper),
        b.compared(&reference, &lower),
    );
    let with_diodes = b.random.one_in(2);
    b.leg_switch(&top, &a, &first, with_diodes);
    b.leg_switch(&a, &x, &second, with_diodes);
    b.leg_switch(&x, &c, &first.complement(), with_diodes);
    b.leg_switch(&c, &bottom, &second.complement(), with_diodes);
    b.diode("0", &a);
    b.diode(&c, "0");
    load(b, &x, "0");
}

/// A square wave: two switches on a split supply, or a source of that shape.
fn square(b: &mut Bench<'_>) -> String {
    let gate = b.pulse_gate(0.0, 0.5);
    if b.random.one_in(2) {
        let [top, bottom] = split_supply(b);
        let with_diodes = b.random.one_in(2);
        return leg(
            b,
            [&top, &bottom],
            &[gate.clone(), gate.complement()],
            with_diodes,
        );
    }
    let (x, half, t) = (b.node(), 0.5 * b.volts, b.period);
    let wave = Wave::Pulse {
        levels: [-half, half],
        delay: 0.0,
        rise: 0.0,
        fall: 0.0,
        width: 0.5 * t,
        period: t,
    };
    b.v(&x, "0", wave);
    x
}

/// L and C of a tank near the switching frequency.
fn tank(b: &mut Bench<'_>) -> [f64; 2] {
    let omega = 2.0 * PI / b.period / b.random.even(0.7, 1.4);
    let z = b.ohms * b.random.even(0.2, 2.0);
    [digits(z / omega, 3), digits(1.0 / (z * omega), 3)]
}

fn llc(b: &mut Bench<'_>) {
    let x = square(b);
    let [henries, farads] = tank(b);
    let (y, z, a1, a2, out) = (b.node(), b.node(), b.node(), b.node(), b.node());
    b.c(&x, &y, farads, 0.0);
    b.l(&y, &z, henries, 0.0);
    let ratio = b.random.pick(&[0.5, 1.0]);
    let magnetising = henries * b.random.pick(&[3.0, 5.0, 10.0]);
    windings(
        b,
        &[[&z, "0"], [&a1, "0"], ["0", &a2]],
        &[1.0, ratio, ratio],
        magnetising,
    );
    b.diode(&a1, &out);
    b.diode(&a2, &out);
    let whole = 0.5 * b.volts * ratio;
    b.output(&out, "0", whole);
}

fn series_resonant(b: &mut Bench<'_>) {
    let x = square(b);
    let [henries, farads] = tank(b);
    let (y, z, p, n) = (b.node(), b.node(), b.node(), b.node());
    b.l(&x, &y, henries, 0.0);
    b.c(&y, &z, farads, 0.0);
    b.diode(&z, &p);
    b.diode(&n, &z);
    b.diode("0", &p);
    b.diode(&n, "0");
    let whole = 0.3 * b.volts;
    b.output(&p, &n, whole);
}

/// A mains source behind a resistance, an inductance or nothing.
fn mains(b: &mut Bench<'_>, phase: f64, neutral: &str) -> String {
    let x = b.node();
    let (f, volts) = (digits(1.0 / b.period, 6), b.volts);
    b.v(&x, neutral, Wave::Sin(0.0, volts, f, phase));
    x
}

/// What stands between the mains and a rectifier, the same in every phase.
fn line_part(b: &mut Bench<'_>, kind: usize, x: String) -> String {
    let y = b.node();
    let (small, ohms) = (
        digits(0.02 * b.ohms * b.period, 2),
        digits(0.01 * b.ohms, 2),
    );
    match kind {
        0 => {
            b.l(&x, &y, small, 0.0);
            y
        }
        1 => {
            b.r(&x, &y, ohms);
            y
        }
        _ => {
            let z = b.node();
            b.r(&x, &z, ohms);
            b.l(&z, &y, small, 0.0);
            y
        }
    }
}

/// C ∥ R, RL or L with C ∥ R.
fn rectified_load(b: &mut Bench<'_>, p: &str, n: &str) {
    let whole = 0.8 * b.volts;
    match b.random.below(4) {
        0 => {
            let (x, ohms) = (b.node(), b.ohms);
            b.choke(p, &x);
            b.r(&x, n, ohms);
        }
        1 => {
            let x = b.node();
            b.choke(p, &x);
            b.output(&x, n, whole);
        }
        _ => b.output(p, n, whole),
    }
}

fn half_wave(b: &mut Bench<'_>) {
    let phase = b.random.pick(&[0.0, 0.0, 30.0, 90.0, -45.0]);
    let kind = b.random.below(3);
    let x = mains(b, phase, "0");
    let (y, p) = (line_part(b, kind, x), b.node());
    b.diode(&y, &p);
    if b.random.one_in(2) {
        b.diode("0", &p);
    }
    rectified_load(b, &p, "0");
}

fn bridge_rectifier(b: &mut Bench<'_>) {
    let phase = b.random.pick(&[0.0, 0.0, 30.0, 90.0]);
    let kind = b.random.below(3);
    let x = mains(b, phase, "0");
    let (y, p, n) = (line_part(b, kind, x), b.node(), b.node());
    b.diode(&y, &p);
    b.diode("0", &p);
    b.diode(&n, &y);
    b.diode(&n, "0");
    rectified_load(b, &p, &n);
}

fn three_pulse(b: &mut Bench<'_>) {
    let (p, kind) = (b.node(), b.random.below(3));
    for phase in [0.0, -120.0, 120.0] {
        let x = mains(b, phase, "0");
        let y = line_part(b, kind, x);
        b.diode(&y, &p);
    }
    rectified_load(b, &p, "0");
}

fn six_pulse(b: &mut Bench<'_>) {
    let (p, n, kind) = (b.node(), b.node(), b.random.below(3));
    for phase in [0.0, -120.0, 120.0] {
        let x = mains(b, phase, "0");
        let y = line_part(b, kind, x);
        b.diode(&y, &p);
        b.diode(&n, &y);
    }
    rectified_load(b, &p, &n);
}

fn doubler(b: &mut Bench<'_>) {
    let kind = b.random.below(3);
    let x = mains(b, 0.0, "0");
    let y = line_part(b, kind, x);
    let (farads, ohms, p) = (b.farads(), b.ohms, b.node());
    if b.random.one_in(2) {
        // Delon: a capacitor for each half wave.
        let n = b.node();
        b.diode(&y, &p);
        b.diode(&n, &y);
        b.c(&p, "0", farads, 0.0);
        b.c("0", &n, farads, 0.0);
        b.r(&p, &n, ohms);
    } else {
        // Greinacher: a clamp and a peak detector.
        let m = b.node();
        b.c(&y, &m, farads, 0.0);
        b.diode("0", &m);
        b.diode(&m, &p);
        b.output(&p, "0", 0.0);
    }
}

fn multiplier(b: &mut Bench<'_>) {
    let kind = 1 + b.random.below(2);
    let x = mains(b, 0.0, "0");
    let y = line_part(b, kind, x);
    let (farads, ohms) = (b.farads(), b.ohms);
    let stages = 1 + b.random.below(3);
    let (mut pumped, mut smooth) = (y, "0".to_string());
    for _ in 0..stages {
        let (m, out) = (b.node(), b.node());
        b.c(&pumped, &m, farads, 0.0);
        b.diode(&smooth, &m);
        b.diode(&m, &out);
        b.c(&smooth, &out, farads, 0.0);
        (pumped, smooth) = (m, out);
    }
    b.r(&smooth, "0", 10.0 * ohms);
}

fn dickson(b: &mut Bench<'_>) {
    let input = b.supply();
    let (volts, t) = (b.volts, b.period);
    let stages = 1 + b.random.below(3);
    let (farads, ohms) = (b.farads(), b.ohms);
    let series = digits(0.02 * ohms, 2);
    let sharp = b.random.one_in(2);
    let edge = if sharp { 0.0 } else { 0.01 * t };
    let mut from = input;
    for k in 0..stages {
        let (m, clock, x) = (b.node(), b.node(), b.node());
        let levels = if k % 2 == 0 {
            [0.0, volts]
        } else {
            [volts, 0.0]
        };
        let wave = Wave::Pulse {
            levels,
            delay: 0.25 * t,
            rise: edge,
            fall: edge,
            width: 0.5 * t - edge,
            period: t,
        };
        b.v(&clock, "0", wave);
        b.r(&clock, &x, series);
        b.diode(&from, &m);
        b.c(&x, &m, farads, 0.0);
        from = m;
    }
    let out = b.node();
    b.diode(&from, &out);
    b.output(&out, "0", volts);
}

fn switched_capacitor(b: &mut Bench<'_>) {
    let input = b.supply();
    let (a, c, out) = (b.node(), b.node(), b.node());
    let gate = b.pulse_gate(0.0, 0.5);
    let other = gate.complement();
    let farads = b.farads();
    let half = 0.5 * b.volts;
    let ic = b.start(half);
    b.switch(&input, &a, &gate);
    b.switch(&c, &out, &gate);
    b.switch(&a, &out, &other);
    b.switch(&c, "0", &other);
    let x = b.node();
    let series = digits(0.02 * b.ohms, 2);
    b.r(&a, &x, series);
    b.c(&x, &c, farads, ic);
    b.output(&out, "0", half);
}

/// The angle at which thyristors fire and for how long their gates stay on, in parts of the period; without pulses that begin at a natural
/// commutation.
fn firing(b: &mut Bench<'_>) -> (f64, f64) {
    let angle = b.random.pick(&[0.03, 0.1, 0.17, 0.25, 0.32, 0.41]);
    let width = b.random.pick(&[1e-3, 0.01, 0.05, 0.2, 0.5 - angle]);
    (angle, width)
}

fn controlled_half_wave(b: &mut Bench<'_>) {
    let kind = b.random.below(3);
    let x = mains(b, 0.0, "0");
    let (y, p) = (line_part(b, kind, x), b.node());
    let (angle, width) = firing(b);
    b.thyristor(&y, &p, angle, width);
    if b.random.one_in(2) {
        b.diode("0", &p);
    }
    rectified_load(b, &p, "0");
}

/// Four thyristors, or two and two diodes.
fn controlled_bridge(b: &mut Bench<'_>) {
    let kind = b.random.below(3);
    let x = mains(b, 0.0, "0");
    let (y, p, n) = (line_part(b, kind, x), b.node(), b.node());
    let (angle, width) = firing(b);
    b.thyristor(&y, &p, angle, width);
    b.thyristor("0", &p, angle + 0.5, width);
    if b.random.one_in(2) {
        b.diode(&n, &y);
        b.diode(&n, "0");
    } else {
        b.thyristor(&n, "0", angle, width);
        b.thyristor(&n, &y, angle + 0.5, width);
    }
    rectified_load(b, &p, &n);
}

fn controlled_six_pulse(b: &mut Bench<'_>) {
    let (p, n, kind) = (b.node(), b.node(), b.random.below(3));
    let (angle, width) = firing(b);
    let width = width.max(0.2);
    for (k, phase) in [0.0, -120.0, 120.0].into_iter().enumerate() {
        let x = mains(b, phase, "0");
        let y = line_part(b, kind, x);
        let delay = angle + 1.0 / 12.0 + k as f64 / 3.0;
        b.thyristor(&y, &p, delay, width);
        b.thyristor(&n, &y, delay + 0.5, width);
    }
    rectified_load(b, &p, &n);
}

/// Two thyristors back to back before a load.
fn dimmer(b: &mut Bench<'_>) {
    let kind = b.random.below(3);
    let x = mains(b, 0.0, "0");
    let (y, z) = (line_part(b, kind, x), b.node());
    let (angle, width) = firing(b);
    b.thyristor(&y, &z, angle, width);
    b.thyristor(&z, &y, angle + 0.5, width);
    load(b, &z, "0");
}

/// An inductor that a switch leaves to several diodes in parallel and in series, each of its own kind.
fn freewheeling_leg(b: &mut Bench<'_>) {
    let (sw, out, m) = (b.node(), b.node(), b.node());
    let input = b.supply();
    let gate = b.open_gate();
    b.switch(&input, &sw, &gate);
    b.diode("0", &sw);
    if b.random.one_in(2) {
        b.diode("0", &m);
        b.diode(&m, &sw);
    }
    if b.random.one_in(2) {
        b.diode("0", &sw);
    }
    b.choke(&sw, &out);
    let whole = 0.5 * b.volts;
    b.output(&out, "0", whole);
}

/// A driven tree of resistors with everything across it.
fn random_network(b: &mut Bench<'_>) {
    let nodes: Vec<String> = (0..2 + b.random.below(4)).map(|_| b.node()).collect();
    let x = mains(b, 0.0, "0");
    let ohms = b.ohms;
    b.r(&x, &nodes[0], digits(0.3 * ohms, 2));
    for k in 1..nodes.len() {
        let value = b.random.value(0.3 * ohms, 10.0 * ohms);
        b.r(&nodes[k], &nodes[k - 1], value);
    }
    for _ in 0..3 + b.random.below(7) {
        let pick = |b: &mut Bench<'_>| match b.random.below(nodes.len() + 1) {
            0 => "0".to_string(),
            k => nodes[k - 1].clone(),
        };
        let (p, n) = (pick(b), pick(b));
        if p == n {
            continue;
        }
        match b.random.below(7) {
            0 | 1 => {
                let (farads, volts) = (b.farads(), b.volts);
                let ic = b.start(volts);
                b.c(&p, &n, farads, ic);
            }
            2 | 3 => b.choke(&p, &n),
            4 | 5 => b.diode(&p, &n),
            _ => {
                let gate = b.open_gate();
                b.switch(&p, &n, &gate);
            }
        }
    }
}
