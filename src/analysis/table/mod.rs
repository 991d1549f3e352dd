//! Means, root mean squares, extrema and powers of all elements, in closed form between events.

mod commutation;
mod exact;
mod extrema;
mod heat;
mod integrals;
mod losses;
mod rows;

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use super::periodic::{PeriodicOptions, common_period, settled};
use super::start::{beginning, course};
use super::variation::Course;
use crate::circuit::{Circuit, Element, Kind, NodeId, Probe, Probed, Tran, is_inside, wholes};
use crate::integrate::{Error, Method, Note, Reason, Run, SimOptions, Standing};
use crate::model::Model;
use crate::settings::Settings;
use crate::settings::tolerances::periodic::{FUNDAMENTAL, STORED};
use commutation::Costs;
pub use losses::{DeviceLosses, Switching};

/// Rows of a run in steps at least: a coarser print step is divided.
const ROWS: usize = 2000;

/// A quantity over a span of time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Mean {
    /// (1/T) ∫ y dt, impulses included.
    pub mean: f64,
    /// √((1/T) ∫ y² dt), without impulses.
    pub rms: f64,
    /// The least value.
    pub min: f64,
    /// The greatest value.
    pub max: f64,
}

/// An element over a span of time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ElementMeans {
    /// Its name.
    #[serde(skip)]
    pub name: String,
    /// The current from its first node through it to the second, A.
    pub i: Mean,
    /// The voltage from its first node to the second, V; of an inductor or a capacitor without its parasitic parts, of a transistor that of its channel.
    pub v: Mean,
    /// Mean power into it and its parts (`m1.body`, `l1.rser`), W.
    pub power: f64,
    /// Where its model has loss tables, or its heat a way out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub losses: Option<DeviceLosses>,
}

/// A signal over a span of time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SignalMeans {
    /// `v(out)`.
    #[serde(skip)]
    pub name: String,
    /// `V` or `A`.
    #[serde(skip)]
    pub unit: &'static str,
    /// Its values.
    #[serde(flatten)]
    pub value: Mean,
    /// Greatest minus least value.
    pub ripple: f64,
    /// √(Y_rms² − mean² − Y₁²)/Y₁ with Y₁ the root mean square of its part at the frequency at which the circuit repeats, over its last
    /// period; none where it does not repeat or has no such part.
    pub thd: Option<f64>,
}

/// What goes in, and what comes out.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Throughput {
    /// Mean power out of `inputs`, W.
    pub input: f64,
    /// Mean power into `outputs`, W.
    pub output: f64,
    /// output/input; none without outputs or input.
    pub efficiency: Option<f64>,
    /// Mean power of changes of state by loss tables, which is no part of the input, W; none without tables.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub switching: Option<f64>,
    /// output/(input + switching); none without one of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub efficiency_with_switching: Option<f64>,
    /// Elements from which power comes.
    pub inputs: Vec<String>,
    /// Elements that take it.
    pub outputs: Vec<String>,
}

/// A span of time, s.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Span {
    /// Its start.
    pub from: f64,
    /// Its end.
    pub to: f64,
}

/// The elements and signals of a circuit over a span of time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// From when to when.
    pub span: Span,
    /// Whether all is in closed form; otherwise it is that of straight lines between steps.
    pub exact: bool,
    /// In file order, without parts of `A` devices.
    pub elements: Vec<ElementMeans>,
    /// The signals that the circuit shows.
    pub signals: Vec<SignalMeans>,
    /// Powers.
    pub power: Throughput,
    /// The frequency of [`SignalMeans::thd`], Hz.
    pub fundamental: Option<f64>,
    /// Of the nodes of the thermal network, at rest, °C.
    pub temperatures: Vec<(String, f64)>,
    /// Things the user should know.
    pub notes: Vec<Note>,
}

impl Table {
    /// The element of this name.
    #[must_use]
    pub fn element(&self, name: &str) -> Option<&ElementMeans> {
        self.elements.iter().find(|element| element.name == name)
    }

    /// The signal of this name.
    #[must_use]
    pub fn signal(&self, name: &str) -> Option<&SignalMeans> {
        self.signals.iter().find(|signal| signal.name == name)
    }
}

/// Elements by name, and beside them `probes`, `power`, `part`: no element's name begins with a p.
impl Serialize for Table {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        struct Signals<'a>(&'a [SignalMeans]);
        impl Serialize for Signals<'_> {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_map(self.0.iter().map(|signal| (&signal.name, signal)))
            }
        }
        #[derive(Serialize)]
        struct Part<'a> {
            #[serde(flatten)]
            span: Span,
            exact: bool,
            fundamental: Option<f64>,
            #[serde(skip_serializing_if = "BTreeMap::is_empty")]
            temperatures: BTreeMap<&'a str, f64>,
            #[serde(skip_serializing_if = "Vec::is_empty")]
            notes: Vec<&'a str>,
        }
        let mut map = serializer.serialize_map(Some(self.elements.len() + 3))?;
        for element in &self.elements {
            map.serialize_entry(&element.name, element)?;
        }
        map.serialize_entry("probes", &Signals(&self.signals))?;
        map.serialize_entry("power", &self.power)?;
        let part = Part {
            span: self.span,
            exact: self.exact,
            fundamental: self.fundamental,
            temperatures: self
                .temperatures
                .iter()
                .map(|(n, t)| (n.as_str(), *t))
                .collect(),
            notes: self.notes.iter().map(|note| note.text.as_str()).collect(),
        };
        map.serialize_entry("part", &part)?;
        map.end()
    }
}

/// What a table may be asked for.
#[derive(Debug, Clone, Default)]
pub struct TableOptions<'a> {
    /// Elements from which the input power comes; by default all independent sources.
    pub inputs: Vec<String>,
    /// Elements that take the output power; by default those whose current the circuit shows besides sources and storage, else the resistors
    /// across voltages that it shows.
    pub outputs: Vec<String>,
    /// Where the transient begins, in place of its initial conditions or operating point.
    pub start: Option<Standing>,
    /// The method of the transient.
    pub method: Method,
    /// θ, default ½ (1 for `euler`).
    pub theta: Option<f64>,
    /// γ, default ½ (1 for `euler`).
    pub gamma: Option<f64>,
    /// Fixed step, s.
    pub step: Option<f64>,
    /// Ends the run when set.
    pub cancel: Option<&'a AtomicBool>,
    /// Tolerances.
    pub settings: Settings,
}

/// The means of all elements over the transient of `.tran`, from tstart⁺ to tstop.
///
/// Between events every quantity is y = c w with w' = 𝒜 w; ∫ w dt and ∫ w wᵀ dt are closed forms, and extrema are where c 𝒜 w vanishes. Where
/// steps are made, they are those of straight lines between rows, and a note says so.
///
/// # Errors
/// An element that is not there; else as [`Model::transient`].
///
/// # Example
/// The ripple of a rectifier's current.
/// ```
/// use circ::analysis::{TableOptions, table};
///
/// let text = "rectifier\nv1 1 0 sin(0 10 50)\nd1 1 2 d\nr1 2 0 5\n.model d d(ideal)\n.tran 1m 20m\n.save i(r1)\n.end\n";
/// let model = circ::Model::parse(text, "rectifier.cir")?;
/// let table = table(&model, &TableOptions::default())?;
/// let r1 = table.element("r1").unwrap();
/// assert!((r1.i.mean - 2.0 / std::f64::consts::PI).abs() < 1e-14 && (r1.i.rms - 1.0).abs() < 1e-14);
/// assert!((r1.i.max - 2.0).abs() < 1e-14 && (table.power.efficiency.unwrap() - 1.0).abs() < 1e-14);
/// # Ok::<(), circ::Error>(())
/// ```
pub fn table(model: &Model, options: &TableOptions<'_>) -> Result<Table, Error> {
    let columns = Columns::of(model.circuit(), &options.inputs, &options.outputs)?;
    let probing = columns.probing(model)?;
    let Some(tran) = model.circuit().tran else {
        let what = "the netlist asks for no .tran analysis";
        return Err(Error::before(Reason::Unsupported(what.into())));
    };
    let asked = (options.cancel, &options.settings);
    let (start, _) = beginning(model, options.start.clone(), asked)?;
    let span = Span {
        from: start.as_ref().map_or(0.0, |s| s.t).max(tran.tstart),
        to: tran.tstop,
    };
    let period = common_period(model.circuit()).filter(|period| *period <= span.to - span.from);
    let whole = (span.from, span.to);
    if let Some(course) = course(&probing, options.method, start.as_ref(), whole, asked)? {
        return columns.exact(&course, span, (period, false));
    }
    let rows = |tran: Tran| {
        if options.step.is_none() {
            finer(tran)
        } else {
            tran
        }
    };
    let circuit = Circuit {
        tran: Some(rows(tran)),
        ..probing.circuit().clone()
    };
    let run = probing.with_circuit(circuit)?.transient(SimOptions {
        method: options.method,
        theta: options.theta,
        gamma: options.gamma,
        step: options.step,
        corners: true,
        cancel: options.cancel,
        start,
        settings: options.settings.clone(),
        unestimated: true,
        ..SimOptions::default()
    })?;
    Ok(columns.of_rows(&run, span, (period, false)))
}

/// That a circuit has these inputs and outputs of a table.
///
/// # Errors
/// The first one that is not there.
#[cfg(feature = "cli")]
pub(crate) fn table_names(
    circuit: &Circuit,
    inputs: &[String],
    outputs: &[String],
) -> Result<(), Error> {
    Columns::of(circuit, inputs, outputs).map(drop)
}

/// The means of all elements over a period of the steady state of [`periodic`](super::periodic()).
///
/// # Errors
/// An element that is not there; else as [`periodic`](super::periodic()).
pub fn periodic_table(
    model: &Model,
    (inputs, outputs): (&[String], &[String]),
    options: &PeriodicOptions<'_>,
) -> Result<Table, Error> {
    let columns = Columns::of(model.circuit(), inputs, outputs)?;
    let probing = columns.probing(model)?;
    let mut found = settled(&probing, options)?;
    let orbit = found.orbit();
    let fundamental = Some(orbit.period / orbit.order as f64);
    let course = found
        .whole()
        .map_or(Ok(None), |steady| steady.course(options.cancel))?;
    if let Some((course, from)) = course {
        let span = Span {
            from,
            to: from + orbit.period,
        };
        let mut table = columns.exact(&course, span, (fundamental, true))?;
        table.span = Span {
            from: 0.0,
            to: orbit.period,
        };
        return Ok(table);
    }
    let options = PeriodicOptions {
        corners: true,
        ..options.clone()
    };
    let (orbit, run) = found.on_grid(&options, finer)?;
    let span = Span {
        from: 0.0,
        to: orbit.period,
    };
    Ok(columns.of_rows(&run, span, (fundamental, true)))
}

/// With so many rows at least.
fn finer(tran: Tran) -> Tran {
    let rows = crate::integrate::Grid::of(&tran).len();
    Tran {
        tstep: tran.tstep / ROWS.div_ceil(rows) as f64,
        ..tran
    }
}

/// What a table reads: the columns of a run that shows all elements.
struct Columns<'a> {
    circuit: &'a Circuit,
    probes: Vec<Probe>,
    /// By element: its current, and its voltage.
    elements: Vec<(usize, usize)>,
    /// The signals that the circuit shows.
    shown: Vec<usize>,
    /// The switches, in the order of their positions.
    switches: Vec<String>,
    inputs: Vec<usize>,
    outputs: Vec<usize>,
}

/// The integrals of a run over a span.
struct Sums {
    /// Of the columns.
    mean: Vec<f64>,
    /// Of their squares.
    square: Vec<f64>,
    least: Vec<f64>,
    greatest: Vec<f64>,
    /// Of v i, by element.
    work: Vec<f64>,
    /// Over the last period, by signal shown.
    distortion: Vec<Option<f64>>,
    /// Of changes of state, by device with loss tables.
    costs: Vec<Costs>,
}

impl<'a> Columns<'a> {
    fn of(circuit: &'a Circuit, inputs: &[String], outputs: &[String]) -> Result<Self, Error> {
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
    fn parts(&self) -> Vec<Vec<usize>> {
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
    fn probing(&self, model: &Model) -> Result<Model, Error> {
        model.with_circuit(Circuit {
            probes: self.probes.clone(),
            ..self.circuit.clone()
        })
    }

    /// With the period of the sources, and whether the span is one after which all begins anew.
    fn exact(
        &self,
        course: &Course,
        span: Span,
        (period, closes): (Option<f64>, bool),
    ) -> Result<Table, Error> {
        let sums = exact::sums(self, course, span, (period, closes))?;
        Ok(self.table(&sums, span, period, true))
    }

    fn of_rows(&self, run: &Run, span: Span, (period, closes): (Option<f64>, bool)) -> Table {
        let sums = rows::sums(self, run, span, (period, closes));
        let mut table = self.table(&sums, span, period, false);
        let text = "the table is that of straight lines between steps, and not exact";
        table.notes.push(Note::run("not-exact", text));
        table
    }

    fn table(&self, sums: &Sums, span: Span, period: Option<f64>, exact: bool) -> Table {
        let seconds = span.to - span.from;
        let mean = |k: usize| Mean {
            mean: sums.mean[k] / seconds,
            rms: (sums.square[k] / seconds).sqrt(),
            min: sums.least[k],
            max: sums.greatest[k],
        };
        let names = |all: &[usize]| -> Vec<String> {
            all.iter()
                .map(|k| self.circuit.elements[*k].name.clone())
                .collect()
        };
        let elements = self.circuit.elements.iter().zip(&self.elements).enumerate();
        let parts = self.parts();
        let elements = elements.map(|(k, (element, (i, v)))| {
            let parts = &parts[k];
            // A transistor is known by the current into its first pin, a source without voltage.
            let across = match parts.first() {
                Some(&part) if sums.least[*v] == 0.0 && sums.greatest[*v] == 0.0 => {
                    self.elements[part].1
                }
                _ => *v,
            };
            let work = sums.work[k] + parts.iter().map(|part| sums.work[*part]).sum::<f64>();
            ElementMeans {
                name: element.name.clone(),
                i: mean(*i),
                v: mean(across),
                power: work / seconds,
                losses: None,
            }
        });
        let mut elements: Vec<ElementMeans> = elements.collect();
        let signals = self.shown.iter().zip(&sums.distortion).map(|(k, thd)| {
            let value = mean(*k);
            let name = self.probes[*k].name.clone();
            SignalMeans {
                unit: crate::waveform::unit_of(&name),
                name,
                value,
                ripple: value.max - value.min,
                thd: *thd,
            }
        });
        let power =
            |all: &[usize], sign: f64| all.iter().map(|k| sign * sums.work[*k]).sum::<f64>();
        let (input, output) = (power(&self.inputs, -1.0), power(&self.outputs, 1.0));
        let known = input > 0.0 && !self.outputs.is_empty();
        let stores = |k: &usize| {
            let kind = &self.circuit.elements[*k].kind;
            matches!(kind, Kind::Capacitor(_) | Kind::Inductor(_))
        };
        let storage: Vec<usize> = (0..self.circuit.elements.len()).filter(stores).collect();
        let stored = power(&storage, 1.0) / input;
        let lost = losses::lost(self, &elements, &sums.costs, seconds);
        let own = lost.losses.iter().flatten().map(|device| device.switching);
        let switching = (!self.circuit.losses.is_empty()).then(|| own.sum::<f64>());
        for (element, losses) in elements.iter_mut().zip(lost.losses) {
            element.losses = losses;
        }
        elements.retain(|element| !is_inside(&element.name));
        let notes = (known && stored.abs() > STORED).then(|| {
            let (share, verb) = (100.0 * stored.abs(), if stored > 0.0 { "went into" } else { "came out of" });
            Note::run("stored-energy", format!(
                "{share:.1} % of the input {verb} capacitors and inductors: the efficiency is that of this span; `circ pss --table` has that of the steady state"
            ))
        });
        Table {
            span,
            exact,
            elements,
            signals: signals.collect(),
            power: Throughput {
                input: input / seconds,
                output: output / seconds,
                efficiency: known.then(|| output / input),
                switching,
                efficiency_with_switching: switching
                    .filter(|_| known)
                    .map(|more| output / (input + more * seconds)),
                inputs: names(&self.inputs),
                outputs: names(&self.outputs),
            },
            fundamental: period.map(f64::recip),
            temperatures: lost.temperatures,
            notes: lost.notes.into_iter().chain(notes).collect(),
        }
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

/// √(Y_ac² − Y₁²)/Y₁ for ∫ y², ∫ y and ∫ y e^{−jωt} over so many seconds; none without a part at ω.
fn distortion(square: f64, mean: f64, harmonic: f64, seconds: f64) -> Option<f64> {
    let alternating = square / seconds - (mean / seconds).powi(2);
    let fundamental = 2.0 * (harmonic / seconds).powi(2);
    let counts = fundamental > FUNDAMENTAL.powi(2) * (square / seconds);
    counts.then(|| ((alternating - fundamental).max(0.0) / fundamental).sqrt())
}
