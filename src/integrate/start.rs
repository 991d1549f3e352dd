//! Where a run starts: initial conditions (`uic`) or the operating point.

mod on_laws;
mod prescribed;
mod statics;

use std::collections::BTreeMap;

use nalgebra::DVector;

use self::on_laws::off_laws;
use self::prescribed::{
    Guess, Held, Prescribed, hold_currents, hold_voltages, is_of_integrator, open_inductors,
    read_guesses,
};
use self::statics::{feeding, observed_circuit, tie_floating, without_delay};
use crate::circuit::{Circuit, Element, Kind, Line, LinePort, NodeId};
use crate::integrate::Note;
use crate::integrate::error::{Error, NoRest, Reason};
use crate::integrate::lawful;
use crate::integrate::reading::{self, Point};
use crate::integrate::switching::at_start;
use crate::lcs::{Hold, Lcs, Port, Position, ReduceError, Role, StorageHold, reduce};
use crate::mna::{StandardMultiport, StaticMultiport, behaviour};
use crate::settings::Settings;
use crate::settings::tolerances::jumps::CONSISTENT;
use crate::solve::Status;

/// The state of a circuit before t = 0+.
#[derive(Debug, Clone, PartialEq)]
pub struct Initial {
    /// All capacitor voltages and inductor currents, s⁻, in the order of [`Storage::names`](crate::lcs::Storage).
    pub storage: DVector<f64>,
    /// Switch positions.
    pub switches: Vec<bool>,
    /// By ideal pair of the devices: whether it conducts at the operating point. A latch has several, and starts in this one.
    pub conducting: Vec<bool>,
    /// The waves that arrive at the two ends of every transmission line, V.
    pub waves: Vec<[f64; 2]>,
    /// By port of the devices: voltage, V, and current, A, where the circuit rests at its operating point and nothing holds it there.
    pub(crate) at_rest: Option<Vec<(f64, f64)>>,
    /// Things the user should know.
    pub notes: Vec<Note>,
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
    pub notes: Vec<Note>,
    /// All capacitor voltages and inductor currents.
    pub storage: Vec<f64>,
    /// By ideal pair of the devices: whether it conducts, by more than rounding.
    pub conducting: Vec<bool>,
    /// By ideal pair and curved law of the devices: voltage, V, and current, A.
    pub ports: Vec<(f64, f64)>,
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
pub fn from_initial_conditions(circuit: &Circuit, behaviour: &StaticMultiport) -> DVector<f64> {
    let known = node_voltages(circuit);
    let elements = circuit.elements.iter().map(|e| (e.name.as_str(), e));
    let elements: BTreeMap<&str, &Element> = elements.collect();
    let value = |k: usize| -> f64 {
        let storage = &behaviour.storage[k];
        if let Some(ic) = storage.initial {
            return ic;
        }
        match elements.get(storage.element.as_str()) {
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
/// least-norm λ, switch positions iterated; with `hold_ic` the `.ic` node voltages and inductor currents are held, without it the values of integrators alone. Where something drives the node already,
/// they (and those of `.nodeset`) choose among several solutions, as a latch has.
///
/// # Errors
/// [`Reason::NoOperatingPoint`]: sources across shorted inductors, currents into capacitors alone, devices that contradict each
/// other; [`Reason::SwitchesDoNotSettle`].
pub fn operating_point(
    circuit: &Circuit,
    values: Values,
    hold_ic: bool,
    settings: &Settings,
) -> Result<OperatingPoint, Error> {
    let Prescribed { held, guesses } = Prescribed::of(circuit, hold_ic);
    match guessed(circuit, (&held, guesses.clone()), values, settings) {
        Err(error) if !held.currents.is_empty() => {
            let voltages = held.voltages;
            let held = Held {
                voltages,
                ..Held::default()
            };
            let mut point = guessed(circuit, (&held, guesses), values, settings)?;
            let text = format!(
                "currents of `.ic` are not held, as there is no operating point with them: {error}"
            );
            point
                .notes
                .push(Note::of("ic-not-held", &error.elements, text));
            Ok(point)
        }
        result => result,
    }
}

/// The [`operating_point`] with these held, of several solutions the one with these guesses.
fn guessed(
    circuit: &Circuit,
    (held, mut guesses): (&Held, Vec<Guess>),
    values: Values,
    settings: &Settings,
) -> Result<OperatingPoint, Error> {
    let asked = guesses.clone();
    for _ in 0..GUESSES {
        let Ok(mut point) = at_rest(circuit, (held, &guesses), values, settings) else {
            break;
        };
        let found: Vec<Guess> = guesses.iter().map(|guess| guess.found(&point)).collect();
        if found.iter().zip(&guesses).all(|(a, b)| a.agrees(b)) {
            let missed = asked.iter().zip(&found).filter(|(a, b)| !a.agrees(b));
            point
                .notes
                .extend(missed.map(|(asked, found)| asked.missed(found, circuit)));
            return Ok(point);
        }
        guesses = found;
    }
    at_rest(circuit, (held, &[]), values, settings)
}

/// Times that guessed voltages are replaced by what follows from them. A latch needs one.
const GUESSES: usize = 8;

/// The [`operating_point`] with these voltages and currents held, where controls see the guesses in place of the voltages of their nodes.
fn at_rest(
    circuit: &Circuit,
    (held, guesses): (&Held, &[Guess]),
    values: Values,
    settings: &Settings,
) -> Result<OperatingPoint, Error> {
    let mut notes = Vec::new();
    let mut statics = observed_circuit(circuit);
    without_delay(&mut statics);
    let tied = tie_floating(circuit, &mut statics, &held.voltages, &mut notes);
    hold_voltages(&held.voltages, &mut statics);
    hold_currents(&held.currents, &mut statics);
    let without_current = open_inductors(circuit, held, &mut statics);
    read_guesses(guesses, &mut statics);
    let behaviour = behaviour(&statics).map_err(|faults| {
        let words: Vec<String> = faults.iter().map(|f| f.message.clone()).collect();
        no_rest(NoRest::Network(words.join("; ")))
    })?;
    drop(statics);
    let behaviour = behaviour.into_standard();
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
            let (nodes, others) = point.readings.split_at(count);
            notes.extend(off_laws(&point.ports, &point.points, nodes));
            let (currents, ties) = others.split_at(circuit.elements.len());
            let largest = currents.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            if let Some(k) = (0..ties.len()).find(|&k| ties[k].abs() > CONSISTENT * largest) {
                let names = feeding(circuit, tied[k]);
                return Err(no_rest(NoRest::Floating).devices(names));
            }
            let volts = |id: NodeId| id.index().checked_sub(1).map_or(0.0, |k| point.readings[k]);
            let across = |e: &&Element| {
                let (a, b) = (volts(e.p), volts(e.n));
                (a - b).abs() > CONSISTENT * a.abs().max(b.abs())
            };
            if let Some(inductor) = without_current
                .iter()
                .map(|&k| &circuit.elements[k])
                .find(across)
            {
                return Err(no_rest(NoRest::Held).device(inductor.name.clone()));
            }
            let named = |names: &[String], values: &[f64]| -> Vec<(String, f64)> {
                names.iter().cloned().zip(values.iter().copied()).collect()
            };
            let elements: Vec<String> = circuit.elements.iter().map(|e| e.name.clone()).collect();
            return Ok(OperatingPoint {
                nodes: named(&circuit.nodes[1..], nodes),
                currents: named(&elements, currents),
                switches: behaviour
                    .switches
                    .iter()
                    .map(|s| s.name.clone())
                    .zip(position)
                    .collect(),
                notes,
                storage: point.storage,
                conducting: point.conducting,
                ports: point.points,
            });
        }
        if seen.contains(&wanted) || seen.len() > 64 {
            let names = behaviour.switches.iter().zip(wanted.iter().zip(&position));
            let moving = names
                .filter(|(_, (a, b))| a != b)
                .map(|(s, _)| s.name.as_str());
            return Err(Error::before(Reason::SwitchesDoNotSettle).devices(moving));
        }
        seen.push(std::mem::replace(&mut position, wanted));
    }
}

/// The positions that the cards of the switches name, off where they name none.
fn of_cards(behaviour: &StaticMultiport) -> Vec<bool> {
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
    let voltages = &mut held.initial_voltages;
    voltages.retain(|voltage| is_of_integrator(circuit, voltage));
    voltages.append(&mut held.nodesets);
    let point = operating_point(&held, values, true, settings).ok()?;
    Some(point.switches.into_iter().map(|(_, on)| on).collect())
}

/// What `wave` says arrives at both ends of every line.
fn waves(circuit: &Circuit, wave: impl Fn(&LinePort) -> f64) -> Vec<[f64; 2]> {
    let ends = |line: &Line| [wave(&line.ports[0]), wave(&line.ports[1])];
    circuit.lines.iter().map(ends).collect()
}

struct Static {
    ports: Vec<Port>,
    /// By port: whether it conducts.
    conducting: Vec<bool>,
    /// By port: voltage, V, and current, A.
    points: Vec<(f64, f64)>,
    readings: Vec<f64>,
    controls: Vec<f64>,
    storage: Vec<f64>,
    notes: Vec<Note>,
}

fn static_solution(
    behaviour: &StandardMultiport,
    switches: &[bool],
    values: Values,
    settings: &Settings,
) -> Result<Static, Error> {
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
    let (lambda, active) = devices(&lcs, &q, settings, &mut notes)?;
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
            Err(e @ ReduceError::Sources { .. }) => Error::before(e.into()),
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
    let y = &lcs.d * &lambda + &q;
    let points = reading::points(&lcs, &lambda, &y);
    let ports = lcs.ports.iter().zip(active);
    Ok(Static {
        points,
        conducting: ports
            .map(|(port, active)| active == Some(port.role != Role::Voltage))
            .collect(),
        readings: all(&lcs.outputs.rows),
        controls: all(&lcs.controls),
        storage: storage.as_slice().to_vec(),
        notes,
        ports: lcs.ports.clone(),
    })
}

/// λ of the devices, and which of them are active, where it is not zero on both sides.
fn devices(
    lcs: &Lcs,
    q: &DVector<f64>,
    settings: &Settings,
    notes: &mut Vec<Note>,
) -> Result<(DVector<f64>, Vec<Option<bool>>), Error> {
    if q.is_empty() {
        return Ok((DVector::zeros(0), Vec::new()));
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
            return Err(Error::before(reason).device(device));
        }
    }
    let least = driver.least_norm(q, &solution);
    if !least.chosen.is_empty() {
        let devices = least.chosen.iter().map(|&j| lcs.ports[j].device.clone());
        notes.push(Note::shared(&devices.collect::<Vec<_>>()));
    }
    Ok((least.solution.lambda, least.solution.active))
}

fn check_constraints(lcs: &Lcs, at: Point<'_>) -> Result<(), Error> {
    let rows = &lcs.held.constraints;
    for i in 0..rows.one.len() {
        let value = reading::value(rows, i, at);
        let terms = (0..at.u.len()).map(|j| (rows.u[(i, j)] * at.u[j]).abs());
        if value.abs() > CONSISTENT * terms.fold(rows.one[i].abs(), f64::max) {
            let names: Vec<&str> = (0..at.u.len())
                .filter(|&j| rows.u[(i, j)] != 0.0)
                .map(|j| lcs.inputs[j].name.as_str())
                .collect();
            return Err(no_rest(NoRest::Sources).devices(names));
        }
    }
    Ok(())
}

fn no_rest(why: NoRest) -> Error {
    Error::before(Reason::NoOperatingPoint(why))
}

fn no_point(error: ReduceError) -> Error {
    match error {
        ReduceError::Internal(_) => Error::before(error.into()),
        error => no_rest(NoRest::System(error)),
    }
}

/// The start of a transient: [`from_initial_conditions`] with `uic`, else the [`operating_point`] with `.ic` held.
/// Switch positions with `uic` are those of the cards, off where none is given; the run settles them at t = 0.
///
/// # Errors
/// Those of [`operating_point`].
pub fn initial(
    circuit: &Circuit,
    behaviour: &StaticMultiport,
    uic: bool,
    settings: &Settings,
) -> Result<Initial, Error> {
    if uic {
        return Ok(Initial {
            storage: from_initial_conditions(circuit, behaviour),
            switches: of_cards(behaviour),
            conducting: vec![false; behaviour.pairs.len()],
            waves: waves(circuit, |port| {
                match circuit.elements[port.wave.index()].kind {
                    Kind::VoltageSource(ref source) => source.wave.value(0.0),
                    _ => 0.0,
                }
            }),
            at_rest: None,
            notes: Vec::new(),
        });
    }
    let point = operating_point(circuit, Values::BeforeZero, true, settings)?;
    let is_held = !circuit.initial_voltages.is_empty() || !circuit.initial_currents.is_empty();
    let mut notes = point.notes;
    let held: Vec<&str> = circuit
        .initial_currents
        .iter()
        .map(|(id, _)| &circuit.elements[id.index()].name[..])
        .collect();
    // Where the card stands in a netlist with `.tran`, a finding there tells of a value other than 0.
    let told = |name: &str| {
        if circuit.tran.is_none() {
            return false;
        }
        let element = circuit
            .element(name)
            .map(|id| &circuit.elements[id.index()]);
        element.is_some_and(|e| e.span.is_some() && e.ic.is_some_and(|ic| ic != 0.0))
    };
    let ignored = behaviour.storage.iter().filter(|s| s.initial.is_some());
    let ignored = ignored.filter(|s| !told(&s.element));
    for s in ignored.filter(|s| !held.contains(&&s.element[..])) {
        let text = format!("IC= of {} is ignored without uic", s.element);
        notes.push(Note::of("ic-without-uic", [&s.element], text));
    }
    Ok(Initial {
        storage: DVector::from_vec(point.storage),
        switches: point.switches.iter().map(|(_, on)| *on).collect(),
        conducting: point.conducting,
        waves: waves(circuit, |port| {
            let source = &circuit.elements[port.wave.index()];
            let volts = |node: NodeId| {
                node.index()
                    .checked_sub(1)
                    .map_or(0.0, |k| point.nodes[k].1)
            };
            volts(source.p) - volts(source.n)
        }),
        at_rest: (!is_held).then_some(point.ports),
        notes,
    })
}
