//! What a table reads of a run, and what it makes of its integrals.

use std::collections::BTreeMap;

use super::commutation::Costs;
use crate::circuit::{Circuit, Element, Kind, NodeId, Probe, Probed, is_inside, wholes};
use crate::integrate::{Error, Reason};
use crate::model::Model;
use crate::settings::tolerances::periodic::FUNDAMENTAL;

/// What a table reads: the columns of a run that shows all elements.
pub(super) struct Columns<'a> {
    pub(super) circuit: &'a Circuit,
    pub(super) probes: Vec<Probe>,
    /// By element: its current, and its voltage.
    pub(super) elements: Vec<(usize, usize)>,
    /// The signals that the circuit shows.
    pub(super) shown: Vec<usize>,
    /// The switches, in the order of their positions.
    pub(super) switches: Vec<String>,
    pub(super) inputs: Vec<usize>,
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
        let voltage = |element: &Element| {
            let name = |node: NodeId| &circuit.nodes[node.index()];
            Probe {
                name: match element.n {
                    NodeId::GROUND => format!("v({})", name(element.p)),
                    n => format!("v({},{})", name(element.p), name(n)),
                },
                what: Probed::Voltage(element.p, element.n),
            }
        };
        let shown = circuit.probes().into_iter().map(&mut column).collect();
        let elements = circuit.elements.iter().zip(currents);
        let elements =
            elements.map(|(element, current)| (column(current), column(voltage(element))));
        let elements = elements.collect();
        let find = |name: &String| {
            circuit
                .element(&name.to_lowercase())
                .map(|id| id.index())
                .ok_or_else(|| {
                    let what = format!("no element `{name}`, which is to be an input or output");
                    Error::before(Reason::Unknown(what))
                })
        };
        // The sources that a gate is made of stand for no power.
        let is_source = |e: &Element| {
            matches!(e.kind, Kind::VoltageSource(_) | Kind::CurrentSource(_)) && !is_inside(&e.name)
        };
        let sources = || (0..circuit.elements.len()).filter(|k| is_source(&circuit.elements[*k]));
        let outputs: Vec<usize> = match outputs {
            [] => loads(circuit),
            named => named.iter().map(find).collect::<Result<_, _>>()?,
        };
        let inputs = match inputs {
            // A battery that is charged is an output alone.
            [] => sources().filter(|k| !outputs.contains(k)).collect(),
            named => named.iter().map(find).collect::<Result<_, _>>()?,
        };
        let is_switch = |e: &&Element| matches!(e.kind, Kind::Switch(_));
        let switches = circuit.elements.iter().filter(is_switch);
        Ok(Self {
            circuit,
            probes,
            elements,
            shown,
            switches: switches.map(|e| e.name.clone()).collect(),
            inputs,
            outputs,
        })
    }

    /// What each element consists of besides itself: `m1.channel` and `m1.body` of `m1`.
    pub(super) fn parts(&self) -> Vec<Vec<usize>> {
        let names = self.circuit.elements.iter().map(|e| e.name.as_str());
        let known: BTreeMap<&str, usize> = names.clone().enumerate().map(|(k, n)| (n, k)).collect();
        let mut parts = vec![Vec::new(); known.len()];
        for (part, name) in names.enumerate() {
            for whole in wholes(name).filter_map(|whole| known.get(whole)) {
                parts[*whole].push(part);
            }
        }
        parts
    }

    /// The same circuit, which shows all that the table reads.
    pub(super) fn probing(&self, model: &Model) -> Result<Model, Error> {
        model.with_circuit(Circuit {
            probes: self.probes.clone(),
            ..self.circuit.clone()
        })
    }
}

/// What a circuit shows as its loads: elements, no sources and no storage, whose current it shows by name; else resistors across voltages that
/// it shows by name.
fn loads(circuit: &Circuit) -> Vec<usize> {
    let asked = &circuit.probes;
    let takes = |e: &Element| {
        !matches!(
            e.kind,
            Kind::VoltageSource(_)
                | Kind::CurrentSource(_)
                | Kind::Capacitor(_)
                | Kind::Inductor(_)
                | Kind::Switch(_)
                | Kind::Device(_)
        )
    };
    let carries = |k: &usize| {
        let wanted = Probed::Current(crate::circuit::ElementId(*k as u32));
        asked.iter().any(|probe| probe.what == wanted)
    };
    let across = |k: &usize| {
        let Element { p, n, kind, .. } = &circuit.elements[*k];
        let (there, back) = (Probed::Voltage(*p, *n), Probed::Voltage(*n, *p));
        matches!(kind, Kind::Resistor(_))
            && asked
                .iter()
                .any(|probe| probe.what == there || probe.what == back)
    };
    let all = || 0..circuit.elements.len();
    let carrying: Vec<usize> = all()
        .filter(|k| takes(&circuit.elements[*k]) && carries(k))
        .collect();
    if carrying.is_empty() {
        return all().filter(across).collect();
    }
    carrying
}

/// √(Y_ac² − Y₁²)/Y₁ for a mean, the mean square about it and that of the part at ω; none without such a part.
pub(super) fn distortion(mean: f64, alternating: f64, fundamental: f64) -> Option<f64> {
    let counts = fundamental > FUNDAMENTAL.powi(2) * (alternating + mean.powi(2));
    counts.then(|| ((alternating - fundamental).max(0.0) / fundamental).sqrt())
}
