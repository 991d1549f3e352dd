//! The static network: a tableau of node voltages and branch currents for given positions of everything that has any.

use std::collections::HashMap;

use super::{Declined, Factors, refined};
use crate::circuit::{Card, Circuit, DiodeModel, Part, Wave};

/// An affine function of states, sources and exponential diodes' currents: coefficients, constant last.
pub(super) type Row = Vec<f64>;

/// A branch of the tableau.
#[derive(Debug, Clone)]
enum Branch {
    /// v − r i = 0.
    Resistor(f64),
    /// v = state; i is its current.
    Capacitor(usize),
    /// i = state; v is its voltage.
    Inductor(usize),
    /// v = source.
    Voltage(usize),
    /// i = source.
    Current(usize),
    /// v = gain · v(a,b).
    Gain(f64, [usize; 2]),
    /// v = level of the position.
    Comparator(usize, [f64; 2]),
    /// On: v = ron i, off: v = roff i.
    Switch(usize, [f64; 2]),
    /// On: v = vfwd + ron i, off: v = roff i.
    Diode(usize, [f64; 3]),
    /// i = state, and `more` of what it is beyond the level of either of two devices.
    Core {
        state: usize,
        beyond: [usize; 2],
        level: f64,
        more: f64,
    },
    /// i = current of an exponential diode, in series with a resistance.
    Curved(usize, f64),
    /// The first winding of a transformer without leakage: i + Σ ratio·i(others) = state.
    Magnetising(usize, Vec<(usize, f64)>),
    /// Another one: v − ratio·v(first) = 0.
    Winding(f64, usize),
}

#[derive(Debug, Clone)]
struct Wire {
    nodes: [usize; 2],
    branch: Branch,
}

/// What has a position, and how it keeps it.
#[derive(Debug, Clone)]
pub(super) enum Device {
    /// Control v(a,b), on above, off below.
    Switch {
        control: [usize; 2],
        on: f64,
        off: f64,
    },
    Comparator {
        control: [usize; 2],
    },
    /// Branch; voltage and current of the corner. Of a thyristor the device that stands where its gate does: while that is off a diode that
    /// is off stays so.
    Diode {
        wire: usize,
        corner: [f64; 2],
        gate: Option<usize>,
    },
    /// Whether a state, in the direction of the sign, is above a level.
    Level {
        state: usize,
        sign: f64,
        level: f64,
    },
}

/// What moves the states in given positions.
#[derive(Debug, Clone)]
pub(super) struct Mode {
    /// Derivatives of the states.
    pub(super) rates: Vec<Row>,
    /// Per device: not negative while it keeps its position.
    pub(super) guards: Vec<Row>,
    /// Voltages across exponential diodes (without their series resistance).
    pub(super) drops: Vec<Row>,
}

pub(crate) struct Network {
    nodes: usize,
    wires: Vec<Wire>,
    pub(super) devices: Vec<Device>,
    /// Waves of the sources.
    pub(super) waves: Vec<Wave>,
    pub(super) start: Vec<f64>,
    /// Inverse inductance between inductor states, capacitances else.
    storage: Vec<Stored>,
    pub(super) curved: Vec<(f64, f64)>,
    /// Indices of the states that are compared.
    pub(super) shown: Vec<usize>,
}

#[derive(Debug, Clone)]
enum Stored {
    /// Branch, 1/C.
    Charge(usize, f64),
    /// Σ factor · v(branch).
    Flux(Vec<(usize, f64)>),
}

struct Builder<'c> {
    circuit: &'c Circuit,
    names: HashMap<String, usize>,
    network: Network,
}

impl Network {
    pub(crate) fn new(circuit: &Circuit) -> Result<Self, Declined> {
        let network = Self {
            nodes: 0,
            wires: vec![],
            devices: vec![],
            waves: vec![],
            start: vec![],
            storage: vec![],
            curved: vec![],
            shown: vec![],
        };
        let names = HashMap::from([("0".to_string(), 0)]);
        let mut builder = Builder {
            circuit,
            names,
            network,
        };
        for card in &circuit.cards {
            builder.card(card);
        }
        builder.inductors()?;
        builder.network.nodes = builder.names.len();
        Ok(builder.network)
    }

    pub(super) fn states(&self) -> usize {
        self.start.len()
    }

    /// The length of a [`Row`].
    fn width(&self) -> usize {
        self.states() + self.waves.len() + self.curved.len() + 1
    }

    /// Multiplications that a mode costs: one factorisation, and six refinements of each column.
    pub(super) fn work(&self) -> usize {
        let n = self.nodes + self.wires.len();
        n * n * n / 3 + 12 * n * n * self.width()
    }

    /// The network in positions, one per device.
    pub(super) fn mode(&self, positions: &[bool]) -> Result<Mode, Declined> {
        let (free, width) = (self.nodes - 1, self.width());
        let n = free + self.wires.len();
        let mut a = vec![0.0; n * n];
        let mut b = vec![vec![0.0; n]; width];
        let (sources, curved) = (self.states(), self.states() + self.waves.len());
        for (k, wire) in self.wires.iter().enumerate() {
            let current = free + k;
            for (node, sign) in [(wire.nodes[0], 1.0), (wire.nodes[1], -1.0)] {
                if node > 0 {
                    a[(node - 1) * n + current] += sign;
                }
            }
            let row = current * n;
            let mut volts = |pins: [usize; 2], factor: f64| {
                for (node, sign) in [(pins[0], factor), (pins[1], -factor)] {
                    if node > 0 {
                        a[row + node - 1] += sign;
                    }
                }
            };
            let (mut ohms, mut known) = (0.0, None);
            match &wire.branch {
                Branch::Resistor(r) => {
                    volts(wire.nodes, 1.0);
                    ohms = -r;
                }
                Branch::Capacitor(x) => {
                    volts(wire.nodes, 1.0);
                    known = Some((*x, 1.0));
                }
                Branch::Inductor(x) => {
                    ohms = 1.0;
                    known = Some((*x, 1.0));
                }
                Branch::Core {
                    state,
                    beyond,
                    level,
                    more,
                } => {
                    ohms = 1.0;
                    let parts = beyond.iter().zip([1.0, -1.0]);
                    let parts = parts.filter(|(device, _)| positions[**device]);
                    let mut factor = 1.0;
                    for (_, sign) in parts {
                        factor += more;
                        b[width - 1][current] -= sign * more * level;
                    }
                    known = Some((*state, factor));
                }
                Branch::Voltage(u) => {
                    volts(wire.nodes, 1.0);
                    known = Some((sources + u, 1.0));
                }
                Branch::Current(u) => {
                    ohms = 1.0;
                    known = Some((sources + u, 1.0));
                }
                Branch::Gain(gain, pins) => {
                    volts(wire.nodes, 1.0);
                    volts(*pins, -gain);
                }
                Branch::Comparator(device, levels) => {
                    volts(wire.nodes, 1.0);
                    let level = levels[usize::from(!positions[*device])];
                    known = Some((width - 1, level));
                }
                Branch::Switch(device, values) => {
                    let r = values[usize::from(!positions[*device])];
                    if r.is_finite() {
                        volts(wire.nodes, 1.0);
                        ohms = -r;
                    } else {
                        ohms = 1.0;
                    }
                }
                Branch::Diode(device, [vfwd, ron, roff]) => {
                    let on = positions[*device];
                    if on || roff.is_finite() {
                        volts(wire.nodes, 1.0);
                        ohms = if on { -ron } else { -roff };
                        known = on.then_some((width - 1, *vfwd));
                    } else {
                        ohms = 1.0;
                    }
                }
                Branch::Curved(d, _) => {
                    ohms = 1.0;
                    known = Some((curved + d, 1.0));
                }
                Branch::Magnetising(x, others) => {
                    ohms = 1.0;
                    for (wire, ratio) in others {
                        a[row + free + wire] += ratio;
                    }
                    known = Some((*x, 1.0));
                }
                Branch::Winding(ratio, first) => {
                    volts(wire.nodes, 1.0);
                    volts(self.wires[*first].nodes, -ratio);
                }
            }
            a[row + current] += ohms;
            if let Some((column, factor)) = known {
                b[column][current] += factor;
            }
        }
        let singular = || Declined("a position without a solution".into());
        let factors = Factors::new(n, a.clone()).ok_or_else(singular)?;
        let columns: Vec<Vec<(f64, f64)>> = b.iter().map(|b| refined(&factors, &a, b)).collect();
        Ok(self.read(&columns, positions))
    }

    fn read(&self, columns: &[Vec<(f64, f64)>], positions: &[bool]) -> Mode {
        let free = self.nodes - 1;
        type Column = [(f64, f64)];
        let row = |f: &dyn Fn(&Column) -> f64| columns.iter().map(|c| f(c)).collect::<Row>();
        let volts = |c: &Column, [p, n]: [usize; 2]| {
            let at = |node: usize| if node == 0 { (0.0, 0.0) } else { c[node - 1] };
            (at(p).0 - at(n).0) + (at(p).1 - at(n).1)
        };
        let rates = self.storage.iter().map(|stored| match stored {
            Stored::Charge(wire, factor) => row(&|c| c[free + wire].0 * factor),
            Stored::Flux(parts) => row(&|c| {
                let part =
                    |&(wire, factor): &(usize, f64)| volts(c, self.wires[wire].nodes) * factor;
                parts.iter().map(part).sum()
            }),
        });
        let guards = self.devices.iter().zip(positions).map(|(device, &on)| {
            let sign = if on { 1.0 } else { -1.0 };
            let (mut row, level) = match device {
                Device::Switch {
                    control,
                    on: above,
                    off: below,
                } => (
                    row(&|c| volts(c, *control)),
                    if on { *below } else { *above },
                ),
                Device::Comparator { control } => (row(&|c| volts(c, *control)), 0.0),
                Device::Diode { wire, corner, .. } if on => (row(&|c| c[free + wire].0), corner[1]),
                Device::Diode {
                    gate: Some(gate), ..
                } if !positions[*gate] => (vec![0.0; columns.len()], 1.0),
                Device::Diode { wire, corner, .. } => {
                    (row(&|c| volts(c, self.wires[*wire].nodes)), corner[0])
                }
                Device::Level { state, sign, level } => {
                    let mut row = vec![0.0; columns.len()];
                    row[*state] = *sign;
                    (row, *level)
                }
            };
            if let Some(constant) = row.last_mut() {
                *constant -= level;
            }
            row.iter_mut().for_each(|x| *x *= sign);
            row
        });
        let drops = self.wires.iter().enumerate().filter_map(|(k, wire)| {
            let Branch::Curved(_, series) = wire.branch else {
                return None;
            };
            Some(row(&|c| volts(c, wire.nodes) - series * c[free + k].0))
        });
        Mode {
            rates: rates.collect(),
            guards: guards.collect(),
            drops: drops.collect(),
        }
    }
}

impl Builder<'_> {
    fn node(&mut self, name: &str) -> usize {
        let next = self.names.len();
        *self.names.entry(name.to_string()).or_insert(next)
    }

    fn pins(&mut self, card: &Card, k: usize) -> [usize; 2] {
        [self.node(&card.nodes[k]), self.node(&card.nodes[k + 1])]
    }

    fn wire(&mut self, nodes: [usize; 2], branch: Branch) -> usize {
        self.network.wires.push(Wire { nodes, branch });
        self.network.wires.len() - 1
    }

    fn diode(&mut self, nodes: [usize; 2], [vfwd, ron, roff]: [f64; 3]) {
        let i = if roff.is_finite() {
            vfwd / (roff - ron)
        } else {
            0.0
        };
        let v = if roff.is_finite() { roff * i } else { vfwd };
        let device = self.network.devices.len();
        let wire = self.wire(nodes, Branch::Diode(device, [vfwd, ron, roff]));
        let corner = [v, i];
        let gate = None;
        self.network
            .devices
            .push(Device::Diode { wire, corner, gate });
    }

    fn switch(&mut self, nodes: [usize; 2], control: [usize; 2], levels: [f64; 2], ohms: [f64; 2]) {
        let device = self.network.devices.len();
        self.wire(nodes, Branch::Switch(device, ohms));
        let [on, off] = levels;
        self.network
            .devices
            .push(Device::Switch { control, on, off });
    }

    fn card(&mut self, card: &Card) {
        if matches!(card.part, Part::K(..)) {
            return;
        }
        let nodes = self.pins(card, 0);
        match &card.part {
            Part::R(r) => drop(self.wire(nodes, Branch::Resistor(*r))),
            Part::C(farads, ic) => {
                let x = self.network.states();
                let wire = self.wire(nodes, Branch::Capacitor(x));
                self.network.start.push(*ic);
                self.network
                    .storage
                    .push(Stored::Charge(wire, 1.0 / farads));
                self.network.shown.push(x);
            }
            Part::L(_, ic) => {
                let x = self.network.states();
                let wire = self.wire(nodes, Branch::Inductor(x));
                self.network.start.push(*ic);
                // What it stands with comes in `inductors`.
                self.network.storage.push(Stored::Flux(vec![(wire, 0.0)]));
                self.network.shown.push(x);
            }
            Part::V(wave) | Part::I(wave) => {
                let u = self.network.waves.len();
                self.network.waves.push(wave.clone());
                let branch = match card.part {
                    Part::V(_) => Branch::Voltage(u),
                    _ => Branch::Current(u),
                };
                self.wire(nodes, branch);
            }
            Part::K(..) => {}
            Part::Gain(gain) => {
                let control = self.pins(card, 2);
                self.wire(nodes, Branch::Gain(*gain, control));
            }
            Part::Comparator(levels, _) => {
                let (control, device) = (self.pins(card, 2), self.network.devices.len());
                self.wire(nodes, Branch::Comparator(device, *levels));
                self.network.devices.push(Device::Comparator { control });
            }
            Part::S(m) => {
                let control = self.pins(card, 2);
                self.switch(nodes, control, [m.vt + m.vh, m.vt - m.vh], [m.ron, m.roff]);
            }
            Part::D(DiodeModel::Lines(vfwd, ron, roff)) => self.diode(nodes, [*vfwd, *ron, *roff]),
            Part::D(DiodeModel::Curved(is, n, rs)) => {
                let d = self.network.curved.len();
                self.network.curved.push((*is, *n));
                self.wire(nodes, Branch::Curved(d, *rs));
            }
            Part::Thyristor(t) => {
                let control = [self.node(&card.nodes[2]), nodes[1]];
                // Roff stands across the whole of it: on, the lines are those of both.
                let [vfwd, ron, roff] = t.lines;
                let part = if roff.is_finite() {
                    roff / (ron + roff)
                } else {
                    1.0
                };
                self.diode(nodes, [vfwd * part, ron * part, roff]);
                let place = self.network.devices.len();
                let (on, off) = (t.vgt, t.vgt);
                self.network
                    .devices
                    .push(Device::Switch { control, on, off });
                if let Device::Diode { gate, .. } = &mut self.network.devices[place - 1] {
                    *gate = Some(place);
                }
            }
            Part::Core(core) => {
                let (x, device) = (self.network.states(), self.network.devices.len());
                let ratio = core.henries / core.saturated;
                let branch = Branch::Core {
                    state: x,
                    beyond: [device, device + 1],
                    level: core.knee,
                    more: ratio - 1.0,
                };
                let wire = self.wire(nodes, branch);
                for sign in [1.0, -1.0] {
                    self.network.devices.push(Device::Level {
                        state: x,
                        sign,
                        level: core.knee,
                    });
                }
                let beyond = (core.ic.abs() - core.knee).max(0.0);
                let flux = core.ic - core.ic.signum() * beyond * (1.0 - 1.0 / ratio);
                self.network.start.push(flux);
                self.network
                    .storage
                    .push(Stored::Flux(vec![(wire, 1.0 / core.henries)]));
                self.network.shown.push(x);
            }
            Part::M(m) => {
                let [drain, gate] = nodes;
                let source = self.node(&card.nodes[2]);
                let (control, body) = if m.p_channel {
                    ([source, gate], [drain, source])
                } else {
                    ([gate, source], [source, drain])
                };
                let level = if m.p_channel { -m.vto } else { m.vto };
                self.switch([drain, source], control, [level; 2], [m.ron, m.roff]);
                self.diode(body, [0.0, m.rb, f64::INFINITY]);
            }
        }
    }

    /// Inductances, coupled ones included.
    fn inductors(&mut self) -> Result<(), Declined> {
        let inductors: Vec<(&Card, f64)> = self
            .circuit
            .cards
            .iter()
            .filter_map(|card| match card.part {
                Part::L(henries, _) => Some((card, henries)),
                _ => None,
            })
            .collect();
        // Branch and state of each, in the order of cards.
        let places: Vec<(usize, usize)> = self
            .network
            .wires
            .iter()
            .enumerate()
            .filter_map(|(wire, w)| match w.branch {
                Branch::Inductor(x) => Some((wire, x)),
                _ => None,
            })
            .collect();
        let n = inductors.len();
        let (mut matrix, mut whole) = (vec![0.0; n * n], vec![]);
        for (k, (_, henries)) in inductors.iter().enumerate() {
            matrix[k * n + k] = *henries;
        }
        for card in &self.circuit.cards {
            let Part::K(a, b, k) = &card.part else {
                continue;
            };
            let place = |name: &String| inductors.iter().position(|(c, _)| c.name == *name);
            let (Some(i), Some(j)) = (place(a), place(b)) else {
                return Err(Declined("a coupling of nothing".into()));
            };
            if k.abs() >= 1.0 {
                whole.push((i, j, *k));
                continue;
            }
            let mutual = k * (inductors[i].1 * inductors[j].1).sqrt();
            matrix[i * n + j] = mutual;
            matrix[j * n + i] = mutual;
        }
        for (k, &(wire, x)) in places.iter().enumerate() {
            // Rows of the inverse matrix, column by column (it is symmetric).
            let mut unit = vec![0.0; n];
            unit[k] = 1.0;
            let singular = || Declined("an inductance matrix without an inverse".into());
            let inverse = Factors::new(n, matrix.clone())
                .ok_or_else(singular)?
                .solve(&unit);
            let parts = places.iter().zip(inverse).filter(|(_, f)| *f != 0.0);
            self.network.storage[x] = Stored::Flux(parts.map(|(&(w, _), f)| (w, f)).collect());
            let _ = wire;
        }
        // Windings without leakage hang on the first of their group.
        let mut hangs: HashMap<usize, f64> = HashMap::new();
        let firsts: Vec<usize> = whole.iter().map(|&(i, _, _)| i).collect();
        for &(i, j, k) in &whole {
            if firsts
                .iter()
                .any(|&f| f < i && whole.iter().any(|&(a, b, _)| a == f && b == i))
            {
                continue;
            }
            hangs.insert(j, k * (inductors[j].1 / inductors[i].1).sqrt());
            let ratio = hangs[&j];
            let (first, state) = places[i];
            self.network.wires[places[j].0].branch = Branch::Winding(ratio, first);
            match &mut self.network.wires[first].branch {
                Branch::Magnetising(_, others) => others.push((places[j].0, ratio)),
                branch => *branch = Branch::Magnetising(state, vec![(places[j].0, ratio)]),
            }
            let start = self.network.start[places[j].1] * ratio;
            self.network.start[state] += start;
            // The state of the other winding stays where it is.
            self.network.storage[places[j].1] = Stored::Flux(vec![]);
            self.network
                .shown
                .retain(|&x| x != state && x != places[j].1);
        }
        Ok(())
    }
}
