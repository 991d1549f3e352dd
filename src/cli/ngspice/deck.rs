//! A circuit as a deck for ngspice, ideal devices replaced by what ngspice can do.

mod waveform;

#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::fmt::Write;

use crate::circuit::source::Wave;
use crate::circuit::{
    Affine, Circuit, Element, ElementId, Kind, Latch, Line, NodeId, Output, Probed, Quantity,
    Source, Switch, Tran,
};
use crate::cli::args::Realisation;
use crate::law::{Exponential, Law};

/// Ω: what a short or an ideal conducting device becomes where ngspice needs a resistance.
const NEAR_SHORT: f64 = 1e-6;
/// Ω: what an open or an ideal blocking device becomes.
const NEAR_OPEN: f64 = 1e12;
/// A: saturation current of the diodes written; with N = 0.01 it leaves 7 mV at 1 A.
const SATURATION_CURRENT: f64 = 1e-12;
/// Rise time of a true edge, relative to the span: ngspice would stretch a zero to a print step.
pub const EDGE: f64 = 1e-7;
/// Width of the steep parts of function blocks, relative to their inputs' size.
const STEEP: f64 = 1e-6;

/// ngspice's settings of one run.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// `reltol`.
    pub reltol: f64,
    /// Largest step, s.
    pub max_step: f64,
    /// `gear` or `trap`.
    pub method: &'static str,
    /// What diodes become.
    pub realisation: Realisation,
}

/// A deck, where ngspice keeps each probe, and what was changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Deck {
    /// The text.
    pub text: String,
    /// (our probe, the expression of ngspice vectors that is its value): `a` or `a − b`.
    pub probes: Vec<(String, Reading)>,
    /// What ngspice simulates instead of what the netlist says.
    pub notes: Vec<String>,
}

/// Where the value of a probe stands in ngspice's results.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reading {
    /// One vector.
    Vector(String),
    /// The difference of two node voltages.
    Difference(String, String),
}

/// Why there is no deck.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DeckError {
    /// Nothing to simulate.
    #[error("there is no `.tran` card to compare")]
    NoTran,
    /// An element ngspice has no counterpart for.
    #[error("{0} has no counterpart in ngspice")]
    NoCounterpart(String),
}

/// Writes the deck of a circuit's transient.
///
/// # Errors
/// See [`DeckError`].
pub fn deck(circuit: &Circuit, options: &Options) -> Result<Deck, DeckError> {
    let tran = circuit.tran.ok_or(DeckError::NoTran)?;
    let mut writer = Writer {
        circuit,
        options,
        tran,
        sensed: sensed(circuit),
        text: String::new(),
        notes: BTreeSet::new(),
    };
    let title = circuit.title.replace(char::is_control, " ");
    writer.line(format!("* {title}"));
    let ports = circuit.lines.iter().flat_map(|line| line.ports);
    let of_lines: Vec<ElementId> = ports.flat_map(|port| [port.impedance, port.wave]).collect();
    for (k, element) in circuit.elements.iter().enumerate() {
        let id = ElementId(k as u32);
        if !of_lines.contains(&id) {
            writer.element(id, element)?;
        }
    }
    for line in &circuit.lines {
        writer.transmission_line(line);
    }
    for (number, k) in circuit.couplings.iter().enumerate() {
        let (a, b) = (writer.card('l', k.a), writer.card('l', k.b));
        // A card that couples several windings is as many here.
        writer.line(format!("k{number}_{} {a} {b} {:e}", k.name, k.k.f64));
    }
    writer.notes.extend(transistors(circuit));
    let probes: Vec<_> = circuit
        .probes()
        .iter()
        .map(|p| (p.name.clone(), writer.reading(p.what)))
        .collect();
    writer.controls(&probes);
    let Writer { text, notes, .. } = writer;
    Ok(Deck {
        text,
        probes,
        notes: notes.into_iter().collect(),
    })
}

/// What is said of transistors: ngspice gets what they are here, and none of the rest of their models is compared.
fn transistors(circuit: &Circuit) -> Option<String> {
    /// More would not be read.
    const MOST: usize = 6;
    let transistors = circuit.pins.iter().filter(|pins| !pins.is_subcircuit);
    let names: Vec<&str> = transistors.map(|pins| &pins.device[..]).collect();
    let more = names.len().saturating_sub(MOST);
    let listed = names[..names.len() - more].join(", ");
    let listed = match more {
        0 => listed,
        _ => format!("{listed} and {more} more"),
    };
    (!names.is_empty()).then(|| {
        format!("ngspice simulates the transistors ({listed}) as circ does, as switches, diodes and sources, not by their models")
    })
}

/// Elements whose current needs a 0 V source in series because it controls something or is probed: ngspice's own readings
/// of device currents come from the device equations and not from the solution.
fn sensed(circuit: &Circuit) -> BTreeSet<ElementId> {
    let controls = circuit.elements.iter().filter_map(|e| match &e.kind {
        Kind::Controlled { control, .. } => Some(control),
        Kind::Function { input, .. } => Some(input),
        Kind::Switch(switch) => Some(&switch.control),
        _ => None,
    });
    let controlling = controls
        .flat_map(|c| &c.terms)
        .filter_map(|(_, q)| match q {
            Quantity::Current(id) => Some(*id),
            Quantity::Voltage(_) => None,
        });
    let probed = circuit.probes().into_iter().filter_map(|p| match p.what {
        Probed::Current(id) => Some(id),
        Probed::Voltage(..) => None,
    });
    let is_ammeter = |id: &ElementId| {
        matches!(
            circuit.elements[id.index()].kind,
            Kind::VoltageSource(_) | Kind::Inductor(_)
        )
    };
    controlling
        .chain(probed)
        .filter(|id| !is_ammeter(id))
        .collect()
}

struct Writer<'a> {
    circuit: &'a Circuit,
    options: &'a Options,
    tran: Tran,
    sensed: BTreeSet<ElementId>,
    text: String,
    notes: BTreeSet<String>,
}

impl Writer<'_> {
    fn line(&mut self, line: impl AsRef<str>) {
        self.text.push_str(line.as_ref());
        self.text.push('\n');
    }

    /// The name of an element's card of this letter: `r1` stays, `x1.r1` becomes `r.x1.r1`.
    fn card(&self, letter: char, id: ElementId) -> String {
        let name = &self.circuit.elements[id.index()].name;
        if name.starts_with(letter) {
            name.clone()
        } else {
            format!("{letter}.{name}")
        }
    }

    fn node(&self, id: NodeId) -> &str {
        &self.circuit.nodes[id.index()]
    }

    fn transmission_line(&mut self, line: &Line) {
        let mut ends = String::new();
        let mut initial = String::new();
        for port in &line.ports {
            let (first, last) = (
                &self.circuit.elements[port.impedance.index()],
                &self.circuit.elements[port.wave.index()],
            );
            let _ = write!(ends, " {} {}", self.node(first.p), self.node(last.n));
        }
        if self.tran.uic {
            // ngspice takes v and i of both ends: e₁ = v₂ + Z i₂ with i₂ = 0.
            let wave = |k: usize| {
                let source = &self.circuit.elements[line.ports[k].wave.index()];
                match &source.kind {
                    Kind::VoltageSource(source) => source.wave.value(0.0),
                    _ => 0.0,
                }
            };
            initial = format!(" ic={:e},0,{:e},0", wave(1), wave(0));
        }
        let name = &line.name;
        let card = if name.starts_with('t') {
            name.clone()
        } else {
            format!("t.{name}")
        };
        self.line(format!(
            "{card}{ends} z0={:e} td={:e}{initial}",
            line.impedance.f64, line.delay
        ));
    }

    fn element(&mut self, id: ElementId, element: &Element) -> Result<(), DeckError> {
        let mut p = self.node(element.p).to_owned();
        let n = self.node(element.n).to_owned();
        if self.sensed.contains(&id) {
            let inner = format!("{}_sense", element.name);
            self.line(format!("v.{}_sense {p} {inner} 0", element.name));
            p = inner;
        }
        let ic = element
            .ic
            .filter(|_| self.tran.uic)
            .map_or(String::new(), |ic| format!(" ic={ic:e}"));
        match &element.kind {
            Kind::Resistor(r) if r.f64 == 0.0 => {
                let card = self.card('v', id);
                self.line(format!("{card} {p} {n} 0"));
            }
            Kind::Resistor(r) => {
                let card = self.card('r', id);
                self.line(format!("{card} {p} {n} {:e}", r.f64));
            }
            Kind::Capacitor(c) => {
                let card = self.card('c', id);
                self.line(format!("{card} {p} {n} {:e}{ic}", c.f64));
            }
            Kind::Inductor(l) => {
                let card = self.card('l', id);
                self.line(format!("{card} {p} {n} {:e}{ic}", l.f64));
            }
            Kind::VoltageSource(source) => {
                let (card, wave) = (self.card('v', id), self.source(source));
                self.line(format!("{card} {p} {n} {wave}"));
            }
            Kind::CurrentSource(source) => {
                let (card, wave) = (self.card('i', id), self.source(source));
                self.line(format!("{card} {p} {n} {wave}"));
            }
            Kind::Controlled { output, control } => {
                let (card, value) = (self.card('b', id), self.affine(control));
                self.line(format!("{card} {p} {n} {}={value}", letter(*output)));
            }
            Kind::Function { output, input, law } => {
                let (card, x) = (self.card('b', id), self.affine(input));
                let curve = self.curve(&element.name, law)?;
                self.line(format!(
                    "{card} {p} {n} {}=pwl({x}, {curve})",
                    letter(*output)
                ));
            }
            Kind::Device(Law::Diode { vfwd, ron, roff }) => {
                self.diode(id, &p, &n, vfwd.f64, ron.f64, roff.map(|r| r.f64));
            }
            Kind::Device(Law::Exponential(diode)) => {
                let card = self.card('d', id);
                let (model, is, rs) = (&element.name, diode.is, diode.rs);
                self.line(format!("{card} {p} {n} m.{model}"));
                let thermal = Exponential::thermal_voltage(27.0);
                let breakdown = diode.breakdown.map_or(String::new(), |b| {
                    let nbv = b.slope / thermal;
                    format!(" bv={:e} ibv={:e} nbv={nbv:e}", b.bv, b.ibv)
                });
                let emission = diode.slope / thermal;
                self.line(format!(
                    ".model m.{model} d(is={is:e} n={emission:e} rs={rs:e}{breakdown})"
                ));
            }
            Kind::Device(law) => {
                let card = self.card('b', id);
                let curve = self.curve(&element.name, law)?;
                self.line(format!("{card} {p} {n} i=pwl(v({p},{n}), {curve})"));
            }
            Kind::Switch(switch) => self.switch(id, &p, &n, switch),
        }
        Ok(())
    }

    /// A piecewise-linear diode as a diode model with a source for its drop, or as the code model.
    fn diode(&mut self, id: ElementId, p: &str, n: &str, vfwd: f64, ron: f64, roff: Option<f64>) {
        let name = self.circuit.elements[id.index()].name.clone();
        let roff = roff.unwrap_or(NEAR_OPEN);
        let emission = match self.options.realisation {
            Realisation::Default => 1.0,
            Realisation::N001 => 0.01,
            Realisation::N0001 => 0.001,
            Realisation::Sidiode => {
                self.notes
                    .insert("ideal diodes are the code model sidiode".into());
                self.line(format!("a.{name} {p} {n} m.{name}"));
                let ron = ron.max(NEAR_SHORT);
                return self.line(format!(
                    ".model m.{name} sidiode(ron={ron:e} roff={roff:e} vfwd={vfwd:e})"
                ));
            }
        };
        self.notes
            .insert(format!("ideal diodes are D models with N = {emission}"));
        let card = self.card('d', id);
        let mut anode = p.to_owned();
        if vfwd != 0.0 {
            anode = format!("{name}_drop");
            self.line(format!("v.{name}_drop {p} {anode} {vfwd:e}"));
        }
        self.line(format!("{card} {anode} {n} m.{name}"));
        self.line(format!(
            ".model m.{name} d(is={SATURATION_CURRENT:e} n={emission} rs={ron:e})"
        ));
        if roff < NEAR_OPEN {
            self.line(format!("r.{name}_off {p} {n} {roff:e}"));
        }
    }

    /// A thyristor's switch has hysteresis around 1: its control is 2 with a gate, else 1 as long as its current holds it.
    fn latch(&self, gates: &[ElementId], switch: &Switch) -> String {
        let current = self.affine(&switch.control);
        let held = format!("({current} > {:e} ? 1 : 0)", switch.off_below);
        gates.iter().fold(held, |otherwise, gate| {
            let gate = &self.circuit.elements[gate.index()];
            let Kind::Switch(switch) = &gate.kind else {
                return otherwise;
            };
            let (name, level) = (&gate.name, switch.on_above);
            format!("(v({name}_control) > {level:e} ? 2 : {otherwise})")
        })
    }

    fn switch(&mut self, id: ElementId, p: &str, n: &str, switch: &Switch) {
        let name = self.circuit.elements[id.index()].name.clone();
        let (control, threshold, half) = match &switch.latch {
            None => (
                self.affine(&switch.control),
                0.5 * (switch.on_above + switch.off_below),
                0.5 * (switch.on_above - switch.off_below),
            ),
            Some(Latch::Hold { gates, .. }) => (self.latch(gates, switch), 1.0, 0.5),
            // Between an open switch that leaks and a diode no potential is undetermined.
            Some(Latch::Rest(_)) => return,
        };
        let (ron, roff) = (
            switch.ron.f64.max(NEAR_SHORT),
            switch.roff.map_or(NEAR_OPEN, |r| r.f64),
        );
        let initial = match switch.initial {
            Some(true) => " on",
            Some(false) => " off",
            None => "",
        };
        if switch.latch.is_some() {
            // A loop from the current to the switch and back needs a time to settle in.
            let delay = EDGE * self.tran.tstop;
            self.notes
                .insert(format!("thyristors follow their gates within {delay:e} s"));
            self.line(format!("b.{name}_now {name}_now 0 v={control}"));
            self.line(format!("r.{name}_delay {name}_now {name}_control 1"));
            self.line(format!("c.{name}_delay {name}_control 0 {delay:e}"));
        } else {
            self.line(format!("b.{name}_control {name}_control 0 v={control}"));
        }
        let card = self.card('s', id);
        self.line(format!("{card} {p} {n} {name}_control 0 m.{name}{initial}"));
        self.line(format!(
            ".model m.{name} sw(vt={threshold:e} vh={half:e} ron={ron:e} roff={roff:e})"
        ));
    }

    /// An affine function as an expression of a B source.
    fn affine(&self, affine: &Affine) -> String {
        let mut text = format!("({:e}", affine.constant);
        for (gain, quantity) in &affine.terms {
            let vector = match quantity {
                Quantity::Voltage(NodeId::GROUND) => continue,
                Quantity::Voltage(node) => format!("v({})", self.node(*node)),
                Quantity::Current(id) => format!("i({})", self.ammeter(*id)),
            };
            // Writing to a string does not fail.
            let _ = write!(text, " + ({:e})*{vector}", gain.f64);
        }
        text + ")"
    }

    /// The card whose branch current is the current of an element.
    fn ammeter(&self, id: ElementId) -> String {
        let element = &self.circuit.elements[id.index()];
        match &element.kind {
            _ if self.sensed.contains(&id) => format!("v.{}_sense", element.name),
            Kind::Inductor(_) => self.card('l', id),
            _ => self.card('v', id),
        }
    }

    /// The vertices of a law, its rays cut far out, its vertical parts given a width.
    fn curve(&mut self, name: &str, law: &Law) -> Result<String, DeckError> {
        let Law::Curve(curve) = law else {
            return Err(DeckError::NoCounterpart(name.into()));
        };
        let points: Vec<(f64, f64)> = curve.vertices.iter().map(|(v, i)| (v.f64, i.f64)).collect();
        let (first, last) = (points[0], points[points.len() - 1]);
        let size = points.iter().map(|p| p.0.abs()).fold(1.0, f64::max);
        let far = |from: (f64, f64), ray: &(_, _), sign: f64| {
            let (dx, dy): (crate::algebra::Value, crate::algebra::Value) = *ray;
            let length = if dx.f64 > 0.0 {
                1e3 * size / dx.f64
            } else {
                1.0 / NEAR_SHORT / dy.f64.max(NEAR_SHORT)
            };
            (
                from.0 + sign * length * dx.f64,
                from.1 + sign * length * dy.f64,
            )
        };
        let mut all = vec![far(first, &curve.first, -1.0)];
        all.extend(points);
        all.push(far(last, &curve.last, 1.0));
        self.notes
            .insert(format!("steep parts of {name} are given a width"));
        let mut text = String::new();
        let mut previous = f64::NEG_INFINITY;
        for (x, y) in all {
            let x = if x > previous {
                x
            } else {
                previous + STEEP * size
            };
            previous = x;
            let _ = write!(
                text,
                "{}{x:e}, {y:e}",
                if text.is_empty() { "" } else { ", " }
            );
        }
        Ok(text)
    }

    fn source(&mut self, source: &Source) -> String {
        let edge = EDGE * self.tran.tstop;
        let (wave, stretched) = waveform::words(&source.wave, edge);
        if stretched {
            self.notes
                .insert(format!("edges of zero width take {edge:e} s"));
        }
        if let Wave::Dc(value) = source.wave {
            return format!("dc {value:e}");
        }
        format!("dc {:e} {wave}", source.dc)
    }

    fn reading(&self, probed: Probed) -> Reading {
        let voltage = |node: NodeId| format!("v({})", self.node(node));
        match probed {
            Probed::Voltage(a, NodeId::GROUND) => Reading::Vector(voltage(a)),
            Probed::Voltage(NodeId::GROUND, b) => Reading::Difference("0".into(), voltage(b)),
            Probed::Voltage(a, b) => Reading::Difference(voltage(a), voltage(b)),
            Probed::Current(id) => Reading::Vector(format!("i({})", self.ammeter(id))),
        }
    }

    fn controls(&mut self, probes: &[(String, Reading)]) {
        let vectors: BTreeSet<&str> = probes
            .iter()
            .flat_map(|(_, reading)| match reading {
                Reading::Vector(v) => vec![v.as_str()],
                Reading::Difference(a, b) => vec![a.as_str(), b.as_str()],
            })
            .filter(|v| *v != "0")
            .collect();
        let saved = vectors.into_iter().collect::<Vec<_>>().join(" ");
        for (a, b, volts) in &self.circuit.initial_voltages {
            if *b == NodeId::GROUND {
                let line = format!(".ic v({})={volts:e}", self.node(*a));
                self.line(line);
            } else {
                self.notes
                    .insert("an `.ic` between two nodes is left out".into());
            }
        }
        if !self.circuit.initial_currents.is_empty() && !self.tran.uic {
            self.notes
                .insert("currents of `.ic` are left out: ngspice has them with `uic` alone".into());
        }
        let Tran {
            tstep,
            tstop,
            tstart,
            uic,
            ..
        } = self.tran;
        let Options {
            reltol,
            max_step,
            method,
            ..
        } = *self.options;
        self.line(format!(".options reltol={reltol:e} method={method}"));
        let uic = if uic { " uic" } else { "" };
        self.line(format!(
            ".tran {tstep:e} {tstop:e} {tstart:e} {max_step:e}{uic}"
        ));
        self.line(format!(".save {saved}"));
        self.line(".end");
    }
}

const fn letter(output: Output) -> char {
    match output {
        Output::Voltage => 'v',
        Output::Current => 'i',
    }
}
