//! What converters are put together from: sources, gates, switches and diodes in one of many styles.

use crate::circuit::{
    Card, Circuit, Core, DiodeModel, MosModel, Part, SwitchModel, ThyristorModel, Wave, Writing,
};
use crate::random::{Random, digits};

/// How a circuit's switches are modelled; resistances in Ω.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Switches {
    /// Ron and Roff, 0 and infinite for ideal ones.
    Sw(f64, f64),
    /// The same as MOSFETs where a pulse drives them.
    Mos(f64, f64),
}

/// What closes a switch: v(p,n) against Vt ± Vh.
#[derive(Debug, Clone)]
pub(crate) struct Gate {
    pub(crate) p: String,
    pub(crate) n: String,
    pub(crate) vt: f64,
    pub(crate) vh: f64,
    /// The pulse that is the control, where it is one.
    pub(crate) pulse: Option<Wave>,
}

impl Gate {
    /// On while this one is off, moved by the same crossings.
    pub(crate) fn complement(&self) -> Self {
        let pulse = self.pulse.clone().map(|wave| match wave {
            Wave::Pulse {
                levels: [a, b],
                delay,
                rise,
                fall,
                width,
                period,
            } => Wave::Pulse {
                levels: [b, a],
                delay,
                rise,
                fall,
                width,
                period,
            },
            other => other,
        });
        Self {
            p: self.n.clone(),
            n: self.p.clone(),
            vt: 0.0 - self.vt,
            vh: self.vh,
            pulse,
        }
    }
}

/// A circuit that grows.
pub(crate) struct Bench<'r> {
    pub(crate) random: &'r mut Random,
    pub(crate) circuit: Circuit,
    /// The size of voltages, V.
    pub(crate) volts: f64,
    /// The size of the load, Ω.
    pub(crate) ohms: f64,
    /// Of switching or of the mains, s.
    pub(crate) period: f64,
    pub(crate) switches: Switches,
    pub(crate) diodes: DiodeModel,
    /// What every second diode is instead.
    pub(crate) others: Option<DiodeModel>,
    /// Whether some chokes saturate.
    pub(crate) saturates: bool,
    nodes: usize,
}

impl<'r> Bench<'r> {
    pub(crate) fn new(random: &'r mut Random) -> Self {
        let volts = random.pick(&[5.0, 10.0, 12.0, 24.0, 48.0, 100.0, 325.0, 400.0]);
        let ohms = random.value(1.0, 200.0);
        let period = random.pick(&[1e-3, 1e-4, 5e-5, 2e-5, 1e-5, 1e-6]);
        Self {
            switches: Switches::Sw(0.0, f64::INFINITY),
            diodes: DiodeModel::Lines(0.0, 0.0, f64::INFINITY),
            others: None,
            saturates: false,
            random,
            circuit: Circuit::default(),
            volts,
            ohms,
            period,
            nodes: 0,
        }
    }

    /// The size of currents, A.
    pub(crate) fn amps(&self) -> f64 {
        self.volts / self.ohms
    }

    /// A new node.
    pub(crate) fn node(&mut self) -> String {
        self.nodes += 1;
        format!("{}", self.nodes)
    }

    fn add(&mut self, letter: char, nodes: &[&str], part: Part) -> String {
        let number = 1 + self
            .circuit
            .cards
            .iter()
            .filter(|c| c.name.starts_with(letter))
            .count();
        let name = format!("{letter}{number}");
        let nodes = nodes.iter().map(|n| (*n).to_string()).collect();
        let card = Card {
            name: name.clone(),
            nodes,
            part,
        };
        self.circuit.cards.push(card);
        name
    }

    pub(crate) fn r(&mut self, a: &str, b: &str, ohms: f64) {
        self.add('r', &[a, b], Part::R(ohms));
    }

    pub(crate) fn c(&mut self, a: &str, b: &str, farads: f64, ic: f64) {
        self.add('c', &[a, b], Part::C(farads, ic));
    }

    pub(crate) fn l(&mut self, a: &str, b: &str, henries: f64, ic: f64) -> String {
        self.add('l', &[a, b], Part::L(henries, ic))
    }

    pub(crate) fn k(&mut self, a: &str, b: &str, k: f64) {
        self.add('k', &[], Part::K(a.into(), b.into(), k));
    }

    pub(crate) fn v(&mut self, a: &str, b: &str, wave: Wave) {
        self.add('v', &[a, b], Part::V(wave));
    }

    pub(crate) fn dc(&mut self, volts: f64) -> String {
        let node = self.node();
        self.v(&node, "0", Wave::Dc(volts));
        node
    }

    pub(crate) fn gain(&mut self, nodes: [&str; 4], gain: f64) {
        self.add('e', &nodes, Part::Gain(gain));
    }

    pub(crate) fn comparator(&mut self, nodes: [&str; 4], levels: [f64; 2]) {
        let writing = self
            .random
            .pick(&[Writing::Ternary, Writing::If, Writing::Step]);
        self.add('q', &nodes, Part::Comparator(levels, writing));
    }

    /// A diode of the circuit's style.
    pub(crate) fn diode(&mut self, anode: &str, cathode: &str) {
        let model = match self.others {
            Some(other) if self.random.one_in(2) => other,
            _ => self.diodes,
        };
        self.add('d', &[anode, cathode], Part::D(model));
    }

    /// A thyristor whose gate is on from `delay` on for `width` (fractions of the period); its diode is of the circuit's style.
    pub(crate) fn thyristor(&mut self, anode: &str, cathode: &str, delay: f64, width: f64) {
        let lines = match self.diodes {
            DiodeModel::Lines(vfwd, ron, roff) => [vfwd, ron, roff],
            DiodeModel::Curved(..) => [0.7, 1e-3 * self.ohms, 1e6 * self.ohms],
        };
        let (gate, period) = (self.node(), self.period);
        let wave = Wave::Pulse {
            levels: [0.0, 2.0],
            delay: digits(delay * period, 6),
            rise: 0.0,
            fall: 0.0,
            width: digits(width * period, 6),
            period,
        };
        self.v(&gate, cathode, wave);
        let model = ThyristorModel { lines, vgt: 1.0 };
        self.add('x', &[anode, cathode, &gate], Part::Thyristor(model));
    }

    /// A switch of the circuit's style; as a MOSFET it conducts backwards, from `b` to `a`, too.
    pub(crate) fn switch(&mut self, a: &str, b: &str, gate: &Gate) {
        match (self.switches, &gate.pulse) {
            (Switches::Mos(ron, roff), Some(wave)) => {
                // A model's Ron of zero counts as none.
                let ron = if ron == 0.0 {
                    digits(1e-9 * self.ohms, 2)
                } else {
                    ron
                };
                let driven = self.node();
                let p_channel = self.random.one_in(4);
                let rb = if self.random.one_in(2) { ron } else { 0.0 };
                // The pulse of a complement is turned round itself.
                let (vto, terminals) = if p_channel {
                    (-gate.vt.abs(), [b, driven.as_str(), a])
                } else {
                    (gate.vt.abs(), [a, driven.as_str(), b])
                };
                let model = MosModel {
                    vto,
                    p_channel,
                    ron,
                    roff,
                    rb,
                };
                self.add('m', &terminals, Part::M(model));
                let pins = if p_channel {
                    [a, &driven]
                } else {
                    [&driven, b]
                };
                self.v(pins[0], pins[1], wave.clone());
            }
            (Switches::Sw(ron, roff) | Switches::Mos(ron, roff), _) => {
                let model = SwitchModel {
                    ron,
                    roff,
                    vt: gate.vt,
                    vh: gate.vh,
                };
                self.add('s', &[a, b, &gate.p, &gate.n], Part::S(model));
            }
        }
        if self.random.one_in(12) {
            // A snubber.
            let (x, ohms) = (self.node(), digits(0.3 * self.ohms, 2));
            let farads = digits(self.period / self.ohms * 3e-3, 2);
            self.r(a, &x, ohms);
            self.c(&x, b, farads, 0.0);
        }
    }

    /// The converter's supply: constant, or with corners at edges of the gates.
    pub(crate) fn supply(&mut self) -> String {
        if !self.random.one_in(8) {
            return self.dc(self.volts);
        }
        let (x, v, t) = (self.node(), self.volts, self.period);
        let low = digits(0.8 * v, 2);
        let edge = if self.random.one_in(2) { 0.0 } else { 0.25 * t };
        let corners = vec![
            (0.0, v),
            (t, v),
            (t + edge, low),
            (2.0 * t, low),
            (2.25 * t, v),
        ];
        self.v(&x, "0", Wave::Pwl(corners));
        x
    }

    /// A bidirectional switch with a diode across it, if the circuit has such.
    pub(crate) fn leg_switch(&mut self, a: &str, b: &str, gate: &Gate, with_diode: bool) {
        self.switch(a, b, gate);
        let is_mos = matches!(self.switches, Switches::Mos(..)) && gate.pulse.is_some();
        if with_diode && !is_mos {
            self.diode(b, a);
        }
    }

    /// A pulse from `delay` on for `width` (fractions of the period), on at Vt = half its height.
    pub(crate) fn pulse_gate(&mut self, delay: f64, width: f64) -> Gate {
        let height = self.random.pick(&[1.0, 5.0, 10.0, 15.0]);
        let period = self.period;
        let edge = if self.random.one_in(3) {
            digits(period * self.random.pick(&[1e-3, 1e-2]), 3)
        } else {
            0.0
        };
        let wave = Wave::Pulse {
            levels: [0.0, height],
            delay: digits(delay * period, 6),
            rise: edge,
            fall: edge,
            width: digits(width * period - edge, 6),
            period,
        };
        let g = self.node();
        self.v(&g, "0", wave.clone());
        Gate {
            p: g,
            n: "0".into(),
            vt: 0.5 * height,
            vh: 0.0,
            pulse: Some(wave),
        }
    }

    /// A duty cycle of few digits.
    pub(crate) fn duty(&mut self) -> f64 {
        self.random
            .pick(&[0.1, 0.2, 0.25, 0.3, 0.4, 0.5, 0.5, 0.6, 0.7, 0.75, 0.8, 0.9])
    }

    /// A triangle or sawtooth between the two levels, with the switching period.
    pub(crate) fn carrier(&mut self, low: f64, high: f64, delay: f64) -> String {
        let t = self.period;
        let c = self.node();
        let (rise, fall) = match self.random.below(3) {
            0 => (t, 0.0),
            1 => (0.25 * t, 0.75 * t),
            _ => (0.5 * t, 0.5 * t),
        };
        let wave = Wave::Pulse {
            levels: [low, high],
            delay: digits(delay * t, 6),
            rise,
            fall,
            width: 0.0,
            period: t,
        };
        self.v(&c, "0", wave);
        c
    }

    /// A triangle of equal sides.
    pub(crate) fn triangle(&mut self, low: f64, high: f64, delay: f64) -> String {
        let t = self.period;
        let c = self.node();
        let wave = Wave::Pulse {
            levels: [low, high],
            delay: digits(delay * t, 6),
            rise: 0.5 * t,
            fall: 0.5 * t,
            width: 0.0,
            period: t,
        };
        self.v(&c, "0", wave);
        c
    }

    /// Through a comparator, or directly, rarely with a little hysteresis.
    pub(crate) fn compared(&mut self, p: &str, n: &str) -> Gate {
        if self.random.one_in(2) {
            return Gate {
                p: p.into(),
                n: n.into(),
                vt: 0.0,
                vh: self.random.pick(&[0.0, 0.0, 0.0, 0.01]),
                pulse: None,
            };
        }
        let q = self.node();
        let high = self.random.pick(&[1.0, 5.0, 10.0]);
        self.comparator([&q, "0", p, n], [high, 0.0]);
        Gate {
            p: q,
            n: "0".into(),
            vt: 0.5 * high,
            vh: 0.0,
            pulse: None,
        }
    }

    /// A gate of open-loop control: a pulse, or a level or slow sine against a carrier.
    pub(crate) fn open_gate(&mut self) -> Gate {
        let duty = self.duty();
        match self.random.below(4) {
            0 | 1 => {
                let delay = self.random.pick(&[0.0, 0.0, 0.25, 0.5, 0.1]);
                self.pulse_gate(delay, duty)
            }
            2 => {
                let reference = self.dc(duty);
                let carrier = self.carrier(0.0, 1.0, 0.0);
                self.compared(&reference, &carrier)
            }
            _ => {
                let reference = self.sine_reference(duty.clamp(0.3, 0.7), 0.25, 0.0);
                let carrier = self.carrier(0.0, 1.0, 0.0);
                self.compared(&reference, &carrier)
            }
        }
    }

    /// A node with a sine of a few switching periods.
    pub(crate) fn sine_reference(&mut self, offset: f64, amplitude: f64, phase: f64) -> String {
        let r = self.node();
        let periods = self.random.pick(&[5.0, 8.0, 10.0, 20.0]);
        let f = digits(1.0 / (periods * self.period), 6);
        self.v(&r, "0", Wave::Sin(offset, amplitude, f, phase));
        r
    }

    /// A gate of any control that makes v(`out`) follow a reference in a step-down converter. `sense` is a small resistance in the
    /// path of the inductor's current, for peak-current control.
    pub(crate) fn any_gate(&mut self, out: &str, sense: Option<(&str, &str, f64)>) -> Gate {
        let target = digits(self.volts * self.random.even(0.2, 0.8), 2);
        match self.random.below(7) {
            // A band around the reference.
            0 => {
                let reference = self.dc(target);
                let vh = digits(self.volts * self.random.pick(&[2e-3, 5e-3, 2e-2, 1e-1]), 2);
                Gate {
                    p: reference,
                    n: out.into(),
                    vt: 0.0,
                    vh,
                    pulse: None,
                }
            }
            // The error, amplified, against a carrier.
            1 => {
                let (reference, error) = (self.dc(target), self.node());
                let gain = self.random.pick(&[0.5, 1.0, 2.0, 5.0]);
                self.gain([&error, "0", &reference, out], gain);
                let height = digits(self.volts * 0.4 * gain, 2);
                let carrier = self.carrier(-0.2 * height, 0.8 * height, 0.0);
                self.compared(&error, &carrier)
            }
            // Peak current: a clock sets, a comparator resets, a switch with hysteresis remembers.
            2 if sense.is_some() => {
                let (a, b, ohms) = sense.expect("checked");
                let (clock, limit, reset) = (self.node(), self.node(), self.node());
                let t = self.period;
                let pulse = Wave::Pulse {
                    levels: [0.0, 1.0],
                    delay: 0.0,
                    rise: 0.0,
                    fall: 0.0,
                    width: 0.1 * t,
                    period: t,
                };
                self.v(&clock, "0", pulse);
                let peak = digits(self.amps() * ohms * self.random.even(0.5, 1.5), 2);
                let sensed = self.node();
                self.gain([&sensed, "0", a, b], 1.0);
                self.v(&limit, "0", Wave::Dc(peak));
                self.comparator([&reset, "0", &sensed, &limit], [2.0, 0.0]);
                Gate {
                    p: clock,
                    n: reset,
                    vt: 0.0,
                    vh: 0.5,
                    pulse: None,
                }
            }
            _ => self.open_gate(),
        }
    }

    /// An inductance whose current ripples by the fraction.
    pub(crate) fn henries(&mut self) -> f64 {
        let ripple = self.random.even((0.05_f64).ln(), (3.0_f64).ln()).exp();
        digits(self.ohms * self.period / ripple, 2)
    }

    /// A capacitance whose voltage ripples by the fraction.
    pub(crate) fn farads(&mut self) -> f64 {
        let ripple = self.random.even((0.005_f64).ln(), (0.5_f64).ln()).exp();
        digits(self.period / (self.ohms * ripple), 2)
    }

    /// A start value: nothing, or a part of the whole.
    pub(crate) fn start(&mut self, whole: f64) -> f64 {
        if self.random.one_in(2) {
            return 0.0;
        }
        digits(whole * self.random.even(0.1, 1.0), 2)
    }

    /// A filter capacitor with a load across it, between the node and ground; `start` its voltage.
    pub(crate) fn output(&mut self, out: &str, ground: &str, whole: f64) {
        let (farads, ic) = (self.farads(), self.start(whole));
        if self.random.one_in(4) {
            let (inner, esr) = (self.node(), digits(self.ohms * 0.02, 2));
            self.r(out, &inner, esr);
            self.c(&inner, ground, farads, ic);
        } else {
            self.c(out, ground, farads, ic);
        }
        let load = self.ohms;
        self.r(out, ground, load);
        if self.random.one_in(6) {
            // A step of the load, at an edge of the gates.
            let (amps, t) = (digits(0.5 * self.amps(), 2), self.period);
            let delay = self.random.pick(&[0.5, 1.0, 1.25]) * t;
            let wave = Wave::Pulse {
                levels: [0.0, amps],
                delay,
                rise: 0.0,
                fall: 0.0,
                width: t,
                period: 2.0 * t,
            };
            self.add('i', &[out, ground], Part::I(wave));
        }
    }

    /// An inductor between two nodes, sometimes with a resistance in series.
    pub(crate) fn choke(&mut self, a: &str, b: &str) {
        let (henries, whole) = (self.henries(), self.amps());
        let ic = self.start(whole);
        if self.saturates && self.random.one_in(2) {
            let knee = digits(whole * self.random.even(0.2, 1.5), 2);
            let saturated = digits(henries * self.random.pick(&[0.02, 0.1, 0.5]), 2);
            let core = Core {
                henries,
                knee,
                saturated,
                ic,
            };
            self.add('l', &[a, b], Part::Core(core));
            // In series with another inductor its flux has no other way to move by itself.
            let across = digits(1e4 * self.ohms, 2);
            self.r(a, b, across);
            return;
        }
        if self.random.one_in(4) {
            let (inner, ohms) = (self.node(), digits(self.ohms * 0.01, 2));
            self.l(a, &inner, henries, ic);
            self.r(&inner, b, ohms);
        } else {
            self.l(a, b, henries, ic);
        }
    }

    /// Two gates, each on while the other is off; `dead` is the fraction of the period in which neither is.
    pub(crate) fn leg_gates(&mut self, dead: f64) -> [Gate; 2] {
        if dead == 0.0 {
            let gate = self.open_gate();
            let other = gate.complement();
            return [gate, other];
        }
        let duty = self.duty().clamp(0.2, 0.8);
        let high = self.pulse_gate(0.0, duty - dead);
        let low = self.pulse_gate(duty, 1.0 - duty - dead);
        [high, low]
    }

    /// No dead time, mostly.
    pub(crate) fn dead_time(&mut self) -> f64 {
        self.random.pick(&[0.0, 0.0, 0.0, 0.02, 0.05])
    }
}
