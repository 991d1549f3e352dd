//! What a table reads of a run, and what it makes of its integrals.

use std::collections::{BTreeMap, BTreeSet};

use super::commutation::Costs;
use crate::circuit::{
    Circuit, Element, ElementId, Kind, NodeId, Output, Probe, Probed, Quantity, is_inside, wholes,
};
use crate::integrate::{Error, Reason};
use crate::model::Model;
use crate::settings::tolerances::periodic::FUNDAMENTAL;

/// What a table reads: the columns of a run that shows all elements.
pub(super) struct Columns<'a> {
    pub(super) circuit: &'a Circuit,
    pub(super) probes: Vec<Probe>,
    /// By element: its current, and its voltage.
    pub(super) elements: Vec<(usize, usize)>,
    /// By element: the voltage of a device of parts, between the terminals through which its current flows; of others their own.
    pub(super) across: Vec<usize>,
    /// What each element consists of besides itself: `m1.channel` and `m1.body` of `m1`.
    pub(super) parts: Vec<Vec<usize>>,
    /// What keeps energy: capacitors and inductors, saturable ones among them.
    pub(super) storage: Vec<usize>,
    /// The signals that the circuit shows.
    pub(super) shown: Vec<usize>,
    /// The switches, in the order of their positions.
    pub(super) switches: Vec<String>,
    pub(super) inputs: Vec<usize>,
    /// Controlled sources and negative resistances, which are inputs besides where they deliver more than they take together.
    pub(super) active: Vec<usize>,
    pub(super) outputs: Vec<usize>,
}

/// The integrals of a run over a span.
pub(super) struct Sums {
    /// Of the columns.
    pub(super) mean: Vec<f64>,
    /// Of their squares.
    pub(super) square: Vec<f64>,
    pub(super) least: Vec<f64>,
    pub(super) greatest: Vec<f64>,
    /// Of v i, by element.
    pub(super) work: Vec<f64>,
    /// Over the last period, by signal shown.
    pub(super) distortion: Vec<Option<f64>>,
    /// By signal shown: whether it has impulses in the last period.
    pub(super) struck: Vec<bool>,
    /// Of changes of state, by device with loss tables.
    pub(super) costs: Vec<Costs>,
}

impl<'a> Columns<'a> {
    pub(super) fn of(
        circuit: &'a Circuit,
        inputs: &[String],
        outputs: &[String],
    ) -> Result<Self, Error> {
        let mut probes: Vec<Probe> = Vec::new();
        let mut column = |probe: Probe| {
            probes
                .iter()
                .position(|p| p.what == probe.what)
                .unwrap_or_else(|| {
                    probes.push(probe);
                    probes.len() - 1
                })
        };
        let currents: Vec<Probe> = circuit.currents_of(|_| true).collect();
        let voltage = |(p, n): (NodeId, NodeId)| {
            let name = |node: NodeId| &circuit.nodes[node.index()];
            Probe {
                name: match n {
                    NodeId::GROUND => format!("v({})", name(p)),
                    n => format!("v({},{})", name(p), name(n)),
                },
                what: Probed::Voltage(p, n),
            }
        };
        let of_parts = circuit.pins.iter().filter(|pins| !pins.is_subcircuit);
        let terminals: BTreeMap<&str, (NodeId, NodeId)> = of_parts
            .filter_map(|pins| {
                let ends = (pins.nodes.first()?.1, pins.nodes.last()?.1);
                Some((pins.device.as_str(), ends))
            })
            .collect();
        let shown = circuit.probes().into_iter().map(&mut column).collect();
        let elements = circuit.elements.iter().zip(currents);
        let elements = elements.map(|(element, current)| {
            let own = column(voltage((element.p, element.n)));
            let across = terminals.get(element.name.as_str());
            let across = across.map_or(own, |ends| column(voltage(*ends)));
            ((column(current), own), across)
        });
        let (elements, across) = elements.unzip();
        let parts = parts(circuit);
        let storage = storage(circuit, &parts);
        let ports = circuit.lines.iter().flat_map(|line| line.ports);
        let ports = ports.flat_map(|port| [port.impedance.index(), port.wave.index()]);
        let are_parts: BTreeSet<usize> = parts.iter().flatten().copied().chain(ports).collect();
        // What a gate is made of stands for no power.
        let counts = |k: &usize| !are_parts.contains(k) && !is_inside(&circuit.elements[*k].name);
        let all = (0..circuit.elements.len()).filter(counts);
        let is_source = |k: &usize| {
            let kind = &circuit.elements[*k].kind;
            matches!(kind, Kind::VoltageSource(_) | Kind::CurrentSource(_))
        };
        let find = |name: &String| {
            circuit
                .element(&name.to_lowercase())
                .map(|id| id.index())
                .ok_or_else(|| {
                    let what = format!("no element `{name}`, which is to be an input or output");
                    Error::before(Reason::Unknown(what))
                })
        };
        let named = |names: &[String]| names.iter().map(find).collect::<Result<Vec<_>, _>>();
        let outputs: Vec<usize> = match outputs {
            [] => {
                let is_device = |k: &usize| {
                    let is_one = |k: &usize| {
                        let kind = &circuit.elements[*k].kind;
                        matches!(kind, Kind::Switch(_) | Kind::Device(_))
                    };
                    is_one(k) || parts[*k].iter().any(is_one)
                };
                let supplies = |k: &usize| match circuit.elements[*k].kind {
                    Kind::Controlled { output, .. } | Kind::Function { output, .. } => {
                        output == Output::Voltage
                    }
                    _ => is_source(k),
                };
                let takes = |k: &usize| !supplies(k) && !storage.contains(k) && !is_device(k);
                loads(circuit, &all.clone().filter(takes).collect::<Vec<_>>())
            }
            outputs => named(outputs)?,
        };
        let (inputs, active) = match inputs {
            // A battery that is charged is an output alone.
            [] => {
                let others = all.filter(|k| !outputs.contains(k) && !storage.contains(k));
                let (sources, others): (Vec<_>, Vec<_>) = others.partition(is_source);
                let delivers = |k: &usize| match &circuit.elements[*k].kind {
                    Kind::Controlled { .. } | Kind::Function { .. } => true,
                    Kind::Resistor(ohms) => ohms.f64 < 0.0,
                    _ => false,
                };
                (sources, others.into_iter().filter(delivers).collect())
            }
            inputs => (named(inputs)?, vec![]),
        };
        let is_switch = |e: &&Element| matches!(e.kind, Kind::Switch(_));
        let switches = circuit.elements.iter().filter(is_switch);
        Ok(Self {
            circuit,
            probes,
            elements,
            across,
            parts,
            storage,
            shown,
            switches: switches.map(|e| e.name.clone()).collect(),
            inputs,
            active,
            outputs,
        })
    }

    /// An element and its parts.
    pub(super) fn whole(&self, k: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::once(k).chain(self.parts[k].iter().copied())
    }

    /// The same circuit, which shows all that the table reads.
    pub(super) fn probing(&self, model: &Model) -> Result<Model, Error> {
        model.with_circuit(Circuit {
            probes: self.probes.clone(),
            ..self.circuit.clone()
        })
    }
}

fn parts(circuit: &Circuit) -> Vec<Vec<usize>> {
    let names = circuit.elements.iter().map(|e| e.name.as_str());
    let known: BTreeMap<&str, usize> = names.clone().enumerate().map(|(k, n)| (n, k)).collect();
    let mut parts = vec![Vec::new(); known.len()];
    for (part, name) in names.enumerate() {
        for whole in wholes(name).filter_map(|whole| known.get(whole)) {
            parts[*whole].push(part);
        }
    }
    parts
}

/// Capacitors and inductors, and saturable ones in place of the states of which they are functions, which are parts of them.
fn storage(circuit: &Circuit, parts: &[Vec<usize>]) -> Vec<usize> {
    let state = |k: usize| match &circuit.elements[k].kind {
        Kind::Function { input, .. } => match input.terms[..] {
            [(_, Quantity::Current(id))] => Some(id.index()).filter(|s| parts[k].contains(s)),
            _ => None,
        },
        _ => None,
    };
    let all = 0..circuit.elements.len();
    let states: BTreeSet<usize> = all.clone().filter_map(state).collect();
    let stores = |k: &usize| match circuit.elements[*k].kind {
        Kind::Capacitor(_) | Kind::Inductor(_) => !states.contains(k),
        _ => state(*k).is_some(),
    };
    all.filter(stores).collect()
}

/// What a circuit shows as its loads, of elements that may be such: those whose current it shows by name; else resistors across voltages that it shows by name.
fn loads(circuit: &Circuit, of: &[usize]) -> Vec<usize> {
    let asked = |what: Probed| circuit.probes.iter().any(|probe| probe.what == what);
    let carries = |k: &&usize| asked(Probed::Current(ElementId(**k as u32)));
    let across = |k: &&usize| {
        let Element { p, n, kind, .. } = &circuit.elements[**k];
        matches!(kind, Kind::Resistor(_))
            && (asked(Probed::Voltage(*p, *n)) || asked(Probed::Voltage(*n, *p)))
    };
    let carrying: Vec<usize> = of.iter().filter(carries).copied().collect();
    if carrying.is_empty() {
        return of.iter().filter(across).copied().collect();
    }
    carrying
}

/// √(Y_ac² − Y₁²)/Y₁ for a mean, the mean square about it and that of the part at ω; none without such a part.
pub(super) fn distortion(mean: f64, alternating: f64, fundamental: f64) -> Option<f64> {
    let counts = fundamental > FUNDAMENTAL.powi(2) * (alternating + mean.powi(2));
    counts.then(|| ((alternating - fundamental).max(0.0) / fundamental).sqrt())
}
