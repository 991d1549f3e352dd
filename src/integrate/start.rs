//! Where a run starts: initial conditions (`uic`) or the operating point.

use nalgebra::DVector;

use crate::circuit::{
    Circuit, Element, ElementId, Kind, Line, LinePort, NodeId, Output, Probe, Probed, Source,
    source::Wave,
};
use crate::integrate::lawful;
use crate::integrate::reading::{self, Point};
use crate::integrate::run::{NoRest, Reason, SimError};
use crate::integrate::switching::at_start;
use crate::lcs::{Hold, Lcs, Position, ReduceError, StorageHold, reduce};
use crate::mna::{Behaviour, behaviour};
use crate::settings::Settings;
use crate::solve::Status;

/// The state of a circuit before t = 0+.
#[derive(Debug, Clone, PartialEq)]
pub struct Initial {
    /// All capacitor voltages and inductor currents, s⁻, in the order of [`Storage::names`](crate::lcs::Storage).
    pub storage: DVector<f64>,
    /// Switch positions.
    pub switches: Vec<bool>,
    /// The waves that arrive at the two ends of every transmission line, V.
    pub waves: Vec<[f64; 2]>,
    /// Things the user should know.
    pub notes: Vec<String>,
}

/// A solved operating point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OperatingPoint {
    /// Node voltages, V, in circuit order without ground.
    pub nodes: Vec<(String, f64)>,
    /// Currents of all elements, A, in circuit order.
    pub currents: Vec<(String, f64)>,
    /// Switch positions.
    pub switches: Vec<(String, bool)>,
    /// Things the user should know.
    pub notes: Vec<String>,
    /// All capacitor voltages and inductor currents.
    pub storage: Vec<f64>,
}

/// Which values the sources have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Values {
    /// Their `DC` values (`.op`).
    Dc,
    /// Their waveforms at t = 0⁻ (start of a transient): an edge at t = 0 acts after it.
    BeforeZero,
}

/// Storage values from `IC=` cards, else from differences of `.ic` node voltages for capacitors, else 0 (`uic`).
#[must_use]
pub fn from_initial_conditions(circuit: &Circuit, behaviour: &Behaviour) -> DVector<f64> {
    let known = node_voltages(circuit);
    let value = |k: usize| -> f64 {
        let storage = &behaviour.storage[k];
        if let Some(ic) = storage.initial {
            return ic;
        }
        let element = circuit
            .element(&storage.element)
            .map(|id| &circuit.elements[id.index()]);
        match element {
            Some(e) if storage.capacitor => {
                // A capacitor between two nodes of one `.ic v(a,b)=` has that difference.
                let pair = circuit.initial_voltages.iter().find_map(|&(a, b, v)| {
                    ((a, b) == (e.p, e.n))
                        .then_some(v)
                        .or(((b, a) == (e.p, e.n)).then_some(-v))
                });
                pair.unwrap_or_else(|| {
                    known[e.p.index()].unwrap_or(0.0) - known[e.n.index()].unwrap_or(0.0)
                })
            }
            _ => 0.0,
        }
    };
    DVector::from_fn(behaviour.storage.len(), |k, _| value(k))
}

/// Voltages of `.ic v(n)=` by node; differences are resolved as far as they chain to known nodes.
fn node_voltages(circuit: &Circuit) -> Vec<Option<f64>> {
    let mut known = vec![None; circuit.nodes.len()];
    known[NodeId::GROUND.index()] = Some(0.0);
    for _ in 0..circuit.initial_voltages.len() {
        for &(a, b, v) in &circuit.initial_voltages {
            match (known[a.index()], known[b.index()]) {
                (None, Some(b)) => known[a.index()] = Some(b + v),
                (Some(a), None) => known[b.index()] = Some(a - v),
                _ => {}
            }
        }
    }
    known
}

/// Solves the operating point: capacitors open, inductors short, devices by their complementarity problem y = Dλ + q with the
/// least-norm λ, switch positions iterated; with `hold_ic` the `.ic` node voltages are held.
///
/// # Errors
/// [`Reason::NoOperatingPoint`]: sources across shorted inductors, currents into capacitors alone, devices that contradict each
/// other; [`Reason::SwitchesDoNotSettle`].
pub fn operating_point(
    circuit: &Circuit,
    values: Values,
    hold_ic: bool,
    settings: &Settings,
) -> Result<OperatingPoint, SimError> {
    let mut notes = Vec::new();
    let mut statics = observed_circuit(circuit);
    without_delay(&mut statics);
    let tied = tie_floating(circuit, &mut statics, hold_ic, &mut notes);
    if hold_ic {
        hold_initial_voltages(circuit, &mut statics);
    }
    let behaviour = behaviour(&statics).map_err(|faults| {
        let words: Vec<String> = faults.iter().map(|f| f.message.clone()).collect();
        no_rest(NoRest::Network(words.join("; ")))
    })?;
    let behaviour = behaviour.standard();
    let mut position = of_cards(&behaviour);
    if let Some(guess) = from_nodesets(circuit, values, settings) {
        for ((position, switch), on) in position.iter_mut().zip(&behaviour.switches).zip(guess) {
            *position = switch.initial.unwrap_or(on);
        }
    }
    let mut seen = Vec::new();
    loop {
        let point = static_solution(&behaviour, &position, values, settings)?;
        let asked: Vec<bool> = behaviour
            .switches
            .iter()
            .zip(&point.controls)
            .map(|(s, &control)| s.initial.unwrap_or(control > s.on_above))
            .collect();
        let wanted = at_start(&behaviour.switches, asked);
        if wanted == position {
            notes.extend(point.notes);
            let count = circuit.nodes.len() - 1;
            let (currents, ties) = point.readings[count..].split_at(circuit.elements.len());
            let largest = currents.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            if let Some(k) = (0..ties.len()).find(|&k| ties[k].abs() > ROUNDING * largest) {
                let names = feeding(circuit, tied[k]);
                return Err(no_rest(NoRest::Floating).devices(names));
            }
            let named = |names: &[String], values: &[f64]| -> Vec<(String, f64)> {
                names.iter().cloned().zip(values.iter().copied()).collect()
            };
            let elements: Vec<String> = circuit.elements.iter().map(|e| e.name.clone()).collect();
            return Ok(OperatingPoint {
                nodes: named(&circuit.nodes[1..], &point.readings[..count]),
                currents: named(&elements, currents),
                switches: behaviour
                    .switches
                    .iter()
                    .map(|s| s.name.clone())
                    .zip(position)
                    .collect(),
                notes,
                storage: point.storage,
            });
        }
        if seen.contains(&wanted) || seen.len() > 64 {
            let names = behaviour.switches.iter().zip(wanted.iter().zip(&position));
            let moving = names
                .filter(|(_, (a, b))| a != b)
                .map(|(s, _)| s.name.as_str());
            return Err(SimError::before(Reason::SwitchesDoNotSettle).devices(moving));
        }
        seen.push(std::mem::replace(&mut position, wanted));
    }
}

/// The positions that the cards of the switches name, off where they name none.
fn of_cards(behaviour: &Behaviour) -> Vec<bool> {
    let named = behaviour.switches.iter();
    let asked = named.map(|s| s.initial.unwrap_or(false)).collect();
    at_start(&behaviour.switches, asked)
}

/// Switch positions of the operating point with the voltages of `.nodeset` held; `None` without such a point.
fn from_nodesets(circuit: &Circuit, values: Values, settings: &Settings) -> Option<Vec<bool>> {
    if circuit.nodesets.is_empty() {
        return None;
    }
    let mut held = circuit.clone();
    held.initial_voltages = std::mem::take(&mut held.nodesets);
    let point = operating_point(&held, values, true, settings).ok()?;
    Some(point.switches.into_iter().map(|(_, on)| on).collect())
}

/// The circuit with all node voltages and element currents as probes.
fn observed_circuit(circuit: &Circuit) -> Circuit {
    let nodes = circuit
        .nodes
        .iter()
        .enumerate()
        .skip(1)
        .map(|(i, name)| Probe {
            name: format!("v({name})"),
            what: Probed::Voltage(NodeId(i as u32), NodeId::GROUND),
        });
    let currents = circuit.elements.iter().enumerate().map(|(i, e)| Probe {
        name: format!("i({})", e.name),
        what: Probed::Current(ElementId(i as u32)),
    });
    Circuit {
        probes: nodes.chain(currents).collect(),
        ..circuit.clone()
    }
}

/// What `wave` says arrives at both ends of every line.
fn waves(circuit: &Circuit, wave: impl Fn(&LinePort) -> f64) -> Vec<[f64; 2]> {
    let ends = |line: &Line| [wave(&line.ports[0]), wave(&line.ports[1])];
    circuit.lines.iter().map(ends).collect()
}

/// Has what leaves the ends of lines arrive at the others at once, which makes them shorts: v₁ = v₂, i₁ = −i₂.
fn without_delay(statics: &mut Circuit) {
    for line in statics.lines.clone() {
        for (here, there) in [(0, 1), (1, 0)] {
            let control = line.leaving(there, statics);
            statics.elements[line.ports[here].wave.index()].kind = Kind::Controlled {
                output: Output::Voltage,
                control,
            };
        }
    }
}

fn source(name: String, p: NodeId, n: NodeId, volts: f64) -> Element {
    let kind = Kind::VoltageSource(Source {
        dc: volts,
        wave: Wave::Dc(volts),
    });
    Element {
        name,
        p,
        n,
        kind,
        ic: None,
        span: None,
    }
}

/// Nodes joined by anything that carries direct current or fixes a voltage.
fn conductive(circuit: &Circuit, with_capacitors: bool) -> Vec<usize> {
    let mut root: Vec<usize> = (0..circuit.nodes.len()).collect();
    fn find(root: &mut [usize], mut i: usize) -> usize {
        while root[i] != i {
            root[i] = root[root[i]];
            i = root[i];
        }
        i
    }
    for e in &circuit.elements {
        let joins = match &e.kind {
            Kind::Capacitor(_) => with_capacitors,
            Kind::CurrentSource(_) => false,
            Kind::Controlled { output, .. } | Kind::Function { output, .. } => {
                *output == crate::circuit::Output::Voltage
            }
            _ => true,
        };
        if joins {
            let (a, b) = (find(&mut root, e.p.index()), find(&mut root, e.n.index()));
            // The smaller index stays the root: ground, else the first node in file order.
            root[a.max(b)] = a.min(b);
        }
    }
    (0..root.len()).map(|i| find(&mut root, i)).collect()
}

/// Ties every part of the circuit that only capacitors hold to 0 V; returns a node of each.
fn tie_floating(
    circuit: &Circuit,
    statics: &mut Circuit,
    hold_ic: bool,
    notes: &mut Vec<String>,
) -> Vec<usize> {
    let mut tied = Vec::new();
    let (dc, all) = (conductive(circuit, false), conductive(circuit, true));
    for (i, &root) in dc.iter().enumerate() {
        // Its own root, not ground, and joined by capacitors to something with a smaller index.
        let floats = i == root && i != 0 && all[i] != i;
        let held = hold_ic
            && circuit.initial_voltages.iter().any(|(a, b, _)| {
                [a, b]
                    .iter()
                    .any(|n| n.index() != 0 && dc[n.index()] == root)
            });
        if floats && !held {
            let name = &circuit.nodes[i];
            let tie = source(format!("tie:{name}"), NodeId(i as u32), NodeId::GROUND, 0.0);
            statics.probes.push(Probe {
                name: format!("i({})", tie.name),
                what: Probed::Current(ElementId(statics.elements.len() as u32)),
            });
            statics.elements.push(tie);
            notes.push(format!(
                "node {name} is held by capacitors alone and starts at 0 V"
            ));
            tied.push(i);
        }
    }
    tied
}

/// Holds `.ic` node voltages by sources; one per node or difference.
fn hold_initial_voltages(circuit: &Circuit, statics: &mut Circuit) {
    for (k, &(a, b, volts)) in circuit.initial_voltages.iter().enumerate() {
        statics
            .elements
            .push(source(format!("ic:{k}"), a, b, volts));
    }
}

struct Static {
    readings: Vec<f64>,
    controls: Vec<f64>,
    storage: Vec<f64>,
    notes: Vec<String>,
}

/// A constraint of the static circuit may be off by this part of its terms (rounding).
const ROUNDING: f64 = 1e-9;

fn static_solution(
    behaviour: &Behaviour,
    switches: &[bool],
    values: Values,
    settings: &Settings,
) -> Result<Static, SimError> {
    let position = Position {
        devices: vec![Hold::Free; behaviour.pairs.len()],
        switches: switches.to_vec(),
        storage: StorageHold::Static,
    };
    let lcs = reduce(behaviour, &position).map_err(no_point)?;
    let u: Vec<f64> = lcs
        .inputs
        .iter()
        .map(|i| match values {
            Values::Dc => i.source.dc,
            Values::BeforeZero => i.source.value_left(0.0),
        })
        .collect();
    let q = &lcs.g * DVector::from_column_slice(&u) + &lcs.f;
    let mut notes = Vec::new();
    let lambda = devices(&lcs, &q, settings, &mut notes)?;
    let du = vec![0.0; u.len()];
    let at = Point {
        x: &[],
        lambda: lambda.as_slice(),
        u: &u,
        du: &du,
    };
    check_constraints(&lcs, at).map_err(|error| {
        // Sources that contradict each other do so without the operating point, too.
        let moving = Position {
            storage: StorageHold::Dynamic,
            ..position
        };
        match reduce(behaviour, &moving) {
            Err(e @ ReduceError::Sources { .. }) => SimError::before(e.into()),
            _ => error,
        }
    })?;
    let all = |rows: &crate::lcs::Rows| -> Vec<f64> {
        (0..rows.one.len())
            .map(|i| reading::value(rows, i, at))
            .collect()
    };
    let mut storage = &lcs.storage.u * DVector::from_column_slice(&u) + &lcs.storage.one;
    if lcs.storage.lambda.ncols() == lambda.len() {
        storage += &lcs.storage.lambda * &lambda;
    }
    Ok(Static {
        readings: all(&lcs.outputs.rows),
        controls: all(&lcs.controls),
        storage: storage.as_slice().to_vec(),
        notes,
    })
}

fn devices(
    lcs: &Lcs,
    q: &DVector<f64>,
    settings: &Settings,
    notes: &mut Vec<String>,
) -> Result<DVector<f64>, SimError> {
    if q.is_empty() {
        return Ok(DVector::zeros(0));
    }
    let mut driver = lawful::driver(lcs, lcs.d.clone(), settings.lcp_residual);
    let solution = driver.solve(q);
    match solution.status {
        Status::Solved => {}
        Status::Infeasible(ray) => {
            let device = lcs.ports[ray.imax()].device.clone();
            return Err(no_rest(NoRest::Devices).device(device));
        }
        Status::Failed => {
            let violation = solution.lambda.zip_map(&solution.y, |l, y| l.min(y).abs());
            let device = lcs.ports[violation.imax()].device.clone();
            let reason = Reason::Residual {
                residual: solution.residual,
                tolerance: settings.lcp_residual,
            };
            return Err(SimError::before(reason).device(device));
        }
    }
    let (lambda, unique) = driver.least_norm(q, &solution);
    if !unique {
        notes.push(
            "voltages or currents of devices are not determined by the ideal model; the least-norm choice is shown"
                .into(),
        );
    }
    Ok(lambda)
}

fn check_constraints(lcs: &Lcs, at: Point<'_>) -> Result<(), SimError> {
    let rows = &lcs.held.constraints;
    for i in 0..rows.one.len() {
        let value = reading::value(rows, i, at);
        let terms = (0..at.u.len()).map(|j| (rows.u[(i, j)] * at.u[j]).abs());
        if value.abs() > ROUNDING * terms.fold(rows.one[i].abs(), f64::max) {
            let names: Vec<&str> = (0..at.u.len())
                .filter(|&j| rows.u[(i, j)] != 0.0)
                .map(|j| lcs.inputs[j].name.as_str())
                .collect();
            return Err(no_rest(NoRest::Sources).devices(names));
        }
    }
    Ok(())
}

fn no_rest(why: NoRest) -> SimError {
    SimError::before(Reason::NoOperatingPoint(why))
}

fn no_point(error: ReduceError) -> SimError {
    match error {
        ReduceError::Internal(_) => SimError::before(error.into()),
        error => no_rest(NoRest::System(error)),
    }
}

/// Elements that drive a current into the part of the circuit that a node belongs to and only capacitors hold.
fn feeding(circuit: &Circuit, node: usize) -> impl Iterator<Item = &str> {
    let parts = conductive(circuit, false);
    let inside = move |id: NodeId| parts[id.index()] == parts[node];
    let elements = circuit.elements.iter();
    elements
        .filter(move |e| inside(e.p) != inside(e.n) && !matches!(e.kind, Kind::Capacitor(_)))
        .map(|e| e.name.as_str())
}

/// The start of a transient: [`from_initial_conditions`] with `uic`, else the [`operating_point`] with `.ic` held.
/// Switch positions with `uic` are those of the cards, off where none is given; the run settles them at t = 0.
///
/// # Errors
/// Those of [`operating_point`].
pub fn initial(
    circuit: &Circuit,
    behaviour: &Behaviour,
    uic: bool,
    settings: &Settings,
) -> Result<Initial, SimError> {
    if uic {
        return Ok(Initial {
            storage: from_initial_conditions(circuit, behaviour),
            switches: of_cards(behaviour),
            waves: waves(circuit, |port| {
                match circuit.elements[port.wave.index()].kind {
                    Kind::VoltageSource(ref source) => source.wave.value(0.0),
                    _ => 0.0,
                }
            }),
            notes: Vec::new(),
        });
    }
    let point = operating_point(circuit, Values::BeforeZero, true, settings)?;
    let mut notes = point.notes;
    for s in behaviour.storage.iter().filter(|s| s.initial.is_some()) {
        notes.push(format!("IC= of {} is ignored without uic", s.element));
    }
    Ok(Initial {
        storage: DVector::from_vec(point.storage),
        switches: point.switches.iter().map(|(_, on)| *on).collect(),
        waves: waves(circuit, |port| {
            let source = &circuit.elements[port.wave.index()];
            let volts = |node: NodeId| {
                node.index()
                    .checked_sub(1)
                    .map_or(0.0, |k| point.nodes[k].1)
            };
            volts(source.p) - volts(source.n)
        }),
        notes,
    })
}
