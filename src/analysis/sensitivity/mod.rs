//! Derivatives of measurements to the values of elements and parameters.

mod base;
mod costs;
mod course;
mod exact;
mod stepped;
mod survey;

use std::sync::atomic::AtomicBool;

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use super::measured::{measured, periodic_measured};
use super::periodic::{PeriodicOptions, beyond_dense};
use super::table::{Entries, TABLE, entries};
use super::variation::STEPS;
use crate::circuit::{Circuit, Kind, Measured, NamedMeasurement, SteadyState, Tran, source::Wave};
use crate::integrate::{Error, Note, Reason, SimOptions, Simulation, SimulationOptions};
use crate::measure::{Measurement, Over};
use crate::model::Model;
use crate::settings::Settings;
use crate::settings::tolerances::periodic::{RUN_STEP, SIDES_APART};

/// Which way the derivatives of an exact run are computed: both have the same result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SensitivityMethod {
    /// Backward where there are more values than measurements, else forward.
    #[default]
    Automatic,
    /// Each value's change is carried along the run.
    Forward,
    /// What each measurement weighs is carried back along the run, once for all values. Values that move waveforms of sources otherwise than by a constant
    /// or with their edges, measurements of expressions that jump by themselves, and runs in which events coincide by chance still go forward.
    Adjoint,
}

/// How often derivatives have gone along the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Passes {
    /// Values whose change was carried along it.
    pub forward: usize,
    /// Measurements that were carried back along it.
    pub backward: usize,
}

/// What derivatives may be asked for.
#[derive(Debug, Clone, Default)]
pub struct SensitivityOptions<'a> {
    /// Names of `.meas`, and of entries of the table; by default all.
    pub of: Vec<String>,
    /// Names of elements and parameters; by default all resistances, capacitances, inductances and constant sources of the top level and all
    /// parameters that something uses, unless they are 0.
    pub to: Vec<String>,
    /// Of the periodic steady state instead of the transient; `.tran … steady` asks for it too.
    pub steady: bool,
    /// The period of it, s, in place of the common one of the sources.
    pub period: Option<f64>,
    /// Of the entries of the [table](super::table()) too, by their names in `--summary json` with dots between: `table.l1.i.rms`, `table.probes.v(out).ripple`,
    /// `table.power.efficiency`.
    pub table: bool,
    /// Elements from which the input power of the table comes, as in [`TableOptions`](super::TableOptions).
    pub inputs: Vec<String>,
    /// Elements that take its output power.
    pub outputs: Vec<String>,
    /// Which way they are computed.
    pub method: SensitivityMethod,
    /// Ends the runs when set.
    pub cancel: Option<&'a AtomicBool>,
    /// Tolerances.
    pub settings: Settings,
}

impl SensitivityOptions<'_> {
    fn asks_for(&self, measurement: &str) -> bool {
        let mut of = self.of.iter();
        let is_named = of.any(|name| name.to_lowercase() == measurement);
        is_named || self.of.is_empty() && !measurement.starts_with('.')
    }
}

/// The derivatives of one measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradient {
    /// Its name.
    pub name: String,
    /// What it found, or why it found nothing.
    pub value: Result<f64, String>,
    /// By element or parameter, in SI units; none where the measurement has no value there.
    pub to: Vec<(String, Option<f64>)>,
    /// By the same, along an exact run: the absolute values of the terms whose sum is p ∂J/∂p, together; rounding is relative to them. 0 where it was carried forward; empty along other
    /// runs.
    pub terms: Vec<f64>,
}

/// The derivatives of measurements.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sensitivity {
    /// In file order.
    pub of: Vec<Gradient>,
    /// What they are derivatives to, and its value.
    pub at: Vec<(String, f64)>,
    /// Whether they are those of the variational equation of a run that is exact throughout; otherwise they are those of its steps, or differences of runs, of which notes tell.
    pub exact: bool,
    /// How often they went along the run; not at all where they are differences.
    pub passes: Passes,
    /// Things the user should know.
    pub notes: Vec<Note>,
}

impl Sensitivity {
    /// The derivative of a measurement to an element's value or a parameter.
    #[must_use]
    pub fn derivative(&self, of: &str, to: &str) -> Option<f64> {
        let gradient = self.of.iter().find(|gradient| gradient.name == of)?;
        gradient.to.iter().find(|(name, _)| name == to)?.1
    }
}

impl Sensitivity {
    /// Takes in derivatives of the same measurements to other values.
    fn join(&mut self, other: Self) {
        for (own, other) in self.of.iter_mut().zip(other.of) {
            own.to.extend(other.to);
        }
        self.notes.extend(other.notes);
    }

    /// Takes in derivatives of other measurements to the same values.
    fn extend(&mut self, other: Self) {
        self.of.extend(other.of);
        self.at = other.at;
        self.exact &= other.exact;
        self.passes.forward += other.passes.forward;
        self.passes.backward += other.passes.backward;
        for note in other.notes {
            if !self.notes.contains(&note) {
                self.notes.push(note);
            }
        }
    }

    /// Puts values into this order.
    fn sort(&mut self, order: &[(String, f64)]) {
        let place = |name: &String| order.iter().position(|(own, _)| own == name);
        for gradient in &mut self.of {
            gradient.to.sort_by_cached_key(|(name, _)| place(name));
        }
        let known = |name: &String| self.of.iter().any(|g| g.to.iter().any(|(n, _)| n == name));
        self.at = order
            .iter()
            .filter(|(name, _)| known(name))
            .cloned()
            .collect();
    }
}

/// `{"of":{"vout":{"value":…,"to":{"l1":…}}},"exact":…,"notes":[…]}`.
impl Serialize for Sensitivity {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        struct To<'a>(&'a [(String, Option<f64>)]);
        impl Serialize for To<'_> {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
            }
        }
        #[derive(Serialize)]
        struct One<'a> {
            value: Option<f64>,
            #[serde(skip_serializing_if = "Option::is_none")]
            error: Option<&'a str>,
            to: To<'a>,
        }
        struct Of<'a>(&'a [Gradient]);
        impl Serialize for Of<'_> {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_map(self.0.iter().map(|gradient| {
                    let one = One {
                        value: gradient.value.as_ref().ok().copied(),
                        error: gradient.value.as_ref().err().map(String::as_str),
                        to: To(&gradient.to),
                    };
                    (&gradient.name, one)
                }))
            }
        }
        let mut map = serializer.serialize_map(Some(3))?;
        map.serialize_entry("of", &Of(&self.of))?;
        map.serialize_entry("exact", &self.exact)?;
        let notes: Vec<&String> = self.notes.iter().map(|note| &note.text).collect();
        map.serialize_entry("notes", &notes)?;
        map.end()
    }
}

/// The derivatives of what `.meas` finds to the values of elements and to parameters.
///
/// What happens between events moves with a value p as the variational equation says: its values by ∂y/∂p, its ends in time too. What `.meas` finds weighs these
/// changes: dJ = Σ ∂J/∂y δy + ∂J/∂t δt over the values of the smooth pieces that it sees and their ends. In the steady state
/// ∂s₀/∂p = (I − M)⁻¹ φ_p with the monodromy M and what a period makes of the change alone. With few values each change is carried along the run; with more values than
/// measurements what each measurement weighs is carried back along it instead, which costs the same for any number of values ([`SensitivityMethod`]). Large circuits, whose runs
/// are made in sparse steps, have the derivatives of these in the same way, and a note states what they may be off by. Where other steps are made,
/// differences of runs with p (1 ± h) and p (1 ± 2h) stand for it, and a note says so; they do as well where impulses are measured.
///
/// # Errors
/// A name that is not there; [`Reason::NotSmooth`] where the derivative does not exist; the errors of the run.
///
/// # Example
/// A capacitor is charged over RC: v = 1 − e^{−t/RC}, and R ∂v/∂R = −(t/RC) e^{−t/RC}.
/// ```
/// use circ::analysis::{SensitivityOptions, sensitivity};
///
/// let text = "rc\nv1 1 0 1\nr1 1 2 1k\nc1 2 0 1u\n.tran 10u 2m uic\n.meas tran v find v(2) at=1m\n.end\n";
/// let model = circ::Model::parse(text, "rc.cir")?;
/// let found = sensitivity(&model, &SensitivityOptions::default())?;
/// let truth = -(-1.0_f64).exp();
/// assert!((1e3 * found.derivative("v", "r1").unwrap() - truth).abs() < 1e-9);
/// assert!((1e-6 * found.derivative("v", "c1").unwrap() - truth).abs() < 1e-9);
/// # Ok::<(), circ::Error>(())
/// ```
pub fn sensitivity(model: &Model, options: &SensitivityOptions<'_>) -> Result<Sensitivity, Error> {
    let circuit = model.circuit();
    let options = &SensitivityOptions {
        steady: options.steady || circuit.steady == Some(SteadyState::Start),
        ..options.clone()
    };
    let to = values(model, &options.to)?;
    let groups = if options.table {
        let ends = (&options.inputs[..], &options.outputs[..]);
        entries(circuit, ends, options.steady)?
    } else {
        vec![]
    };
    let is_entry = |of: &&String| {
        let mut names = groups.iter().flat_map(Entries::names);
        names.any(|name| name.to_lowercase() == of.to_lowercase())
    };
    let others: Vec<&String> = options.of.iter().filter(|of| !is_entry(of)).collect();
    let is_cost = |of: &&String| options.table && of.to_lowercase().starts_with(TABLE);
    let (costs, cards): (Vec<&String>, Vec<&String>) = others.into_iter().partition(is_cost);
    if let Some(what) = cards.iter().find_map(|of| circuit.no_measurement(of)) {
        return Err(unsupported(what));
    }
    if circuit.measurements.is_empty() && !options.table {
        return Err(unsupported(
            "the netlist has no `.meas` to differentiate: `.meas tran vout avg v(out)`".into(),
        ));
    }
    let mut found = Sensitivity {
        exact: true,
        ..Sensitivity::default()
    };
    let cards = circuit.measurements.iter().map(|m| m.name.as_str());
    let all = std::iter::once((None, cards.collect()));
    let names = groups.iter().enumerate();
    let names = names.map(|(k, group)| (Some(k), group.names().collect::<Vec<&str>>()));
    let asked = all.chain(names).filter(|(_, names)| {
        let mut names = names.iter();
        names.any(|name| options.asks_for(name))
    });
    let beside = |entries: Option<usize>| Beside {
        model,
        options,
        entries,
    };
    for (entries, _) in asked {
        found.extend(beside(entries).found(&to)?);
    }
    if options.table && !circuit.losses.is_empty() && (options.of.is_empty() || !costs.is_empty()) {
        // Values on which the period depends are left out before.
        let to = if found.of.is_empty() {
            to
        } else {
            found.at.clone()
        };
        let mut more = beside(None).costs(&to)?;
        more.of.retain(|gradient| options.asks_for(&gradient.name));
        found.extend(more);
    }
    let mut known = found.of.iter().map(|gradient| &gradient.name);
    if let Some(of) = costs
        .iter()
        .find(|of| !known.any(|name| *name == of.to_lowercase()))
    {
        let what = "is no entry of the table: `circ sim --table --summary json` has all of them";
        return Err(unsupported(format!("`{of}` {what}")));
    }
    Ok(found)
}

fn unsupported(what: String) -> Error {
    Error::before(Reason::Unsupported(what))
}

fn left_out(name: &str) -> Note {
    let text = format!(
        "`{name}` is left out: it changes the period, on which the steady state depends otherwise"
    );
    Note::run("left-out", text)
}

/// What is asked for, with its value.
pub(super) fn values(model: &Model, asked: &[String]) -> Result<Vec<(String, f64)>, Error> {
    let circuit = model.circuit();
    let elements = circuit.elements.iter().filter(|e| !e.name.contains('.'));
    let elements = elements.filter_map(|e| Some((e.name.clone(), value_of(&e.kind)?)));
    let all: Vec<(String, f64)> = elements.chain(circuit.params.iter().cloned()).collect();
    if asked.is_empty() {
        let some = all.into_iter().filter(|(_, value)| *value != 0.0);
        return as_written(model, some.collect());
    }
    let find = |name: &String| {
        let own = all.iter().find(|(own, _)| *own == name.to_lowercase());
        let own = own.cloned().ok_or_else(|| {
            let what = "is no resistance, capacitance, inductance or constant source of the top level, nor a parameter that something uses";
            unsupported(format!("`{name}` {what}"))
        })?;
        if own.1 == 0.0 {
            return Err(unsupported(format!(
                "`{name}` is 0: a small part of it is no change"
            )));
        }
        model.swept(name).map(|_| own)
    };
    as_written(model, asked.iter().map(find).collect::<Result<_, _>>()?)
}

/// These values as their cards have them: a card's value may be multiplied (`m=2`).
fn as_written(model: &Model, mut all: Vec<(String, f64)>) -> Result<Vec<(String, f64)>, Error> {
    let elements = all
        .iter()
        .filter(|(name, _)| model.circuit().element(name).is_some());
    let (set, _) = model.circuit_with(&elements.cloned().collect::<Vec<_>>())?;
    for (name, value) in &mut all {
        let id = set.element(name);
        let again = id.and_then(|id| value_of(&set.elements[id.index()].kind));
        *value /= again.map_or(1.0, |again| again / *value);
    }
    Ok(all)
}

/// The value that a card gives to an element.
fn value_of(kind: &Kind) -> Option<f64> {
    match kind {
        Kind::Resistor(value) | Kind::Capacitor(value) | Kind::Inductor(value) => Some(value.f64),
        Kind::VoltageSource(source) | Kind::CurrentSource(source) => match source.wave {
            Wave::Dc(value) => Some(value),
            _ => None,
        },
        _ => None,
    }
}

/// A model and those near it.
struct Beside<'a> {
    model: &'a Model,
    options: &'a SensitivityOptions<'a>,
    /// The entries of the table that are measured in place of `.meas`, by their group.
    entries: Option<usize>,
}

impl Beside<'_> {
    fn found(&self, to: &[(String, f64)]) -> Result<Sensitivity, Error> {
        let found = match self.stepped(to)? {
            None if self.options.steady && beyond_dense(self.model) => {
                Some(self.few_differences(to)?)
            }
            None => self.exact(to)?,
            found => found,
        };
        let mut found = match found {
            Some(found) => found,
            None => self.differences(to)?,
        };
        found.of.retain(|gradient| {
            let is_there = self.entries.is_none() || gradient.value.is_ok();
            is_there && self.options.asks_for(&gradient.name)
        });
        Ok(found)
    }

    /// Gives a value to a model that measures what this does.
    fn set(&self, model: &mut Model, name: &str, value: f64) -> Result<(), Error> {
        model.set(name, value)?;
        if self.entries.is_some() {
            *model = model.with_circuit(self.measuring(model.circuit())?)?;
        }
        Ok(())
    }

    /// A circuit with what is measured.
    fn measuring(&self, circuit: &Circuit) -> Result<Circuit, Error> {
        let Some(group) = self.entries else {
            return Ok(circuit.clone());
        };
        let SensitivityOptions {
            inputs,
            outputs,
            steady,
            ..
        } = self.options;
        // What the netlist shows, not what is measured by now.
        let showing = Circuit {
            probes: self.model.circuit().probes.clone(),
            ..circuit.clone()
        };
        let all = entries(&showing, (inputs, outputs), *steady)?;
        let group = all.into_iter().nth(group).unwrap_or_default();
        Ok(group.measured_in(circuit))
    }

    /// Until when measurements see an orbit: entries of the table see what repeats.
    fn seen_until(&self, circuit: &Circuit) -> Option<Tran> {
        circuit.tran.filter(|_| self.entries.is_none())
    }

    fn periodic(&self) -> PeriodicOptions<'_> {
        PeriodicOptions {
            period: self.options.period,
            cancel: self.options.cancel,
            settings: self.options.settings.clone(),
            ..PeriodicOptions::default()
        }
    }

    /// The model with this value, which shows the signals of its measurements.
    fn with(&self, change: Option<(&str, f64)>) -> Result<Model, Error> {
        let mut model = self.model.clone();
        if let Some((name, value)) = change {
            model.set(name, value)?;
        }
        let circuit = self.measuring(model.circuit())?;
        let circuit = Circuit {
            probes: circuit.measured.clone(),
            columns: vec![],
            ..circuit
        };
        model.with_circuit(circuit)
    }

    fn simulation(&self, model: &Model) -> Result<Simulation, Error> {
        let options = SimulationOptions {
            settings: self.options.settings.clone(),
            ..SimulationOptions::default()
        };
        Simulation::closed(model.circuit(), model.multiport(), options)
    }

    fn go_on(&self) -> Result<(), Error> {
        let set = |cancel: &AtomicBool| cancel.load(std::sync::atomic::Ordering::Relaxed);
        if self.options.cancel.is_some_and(set) {
            return Err(Error::before(Reason::Interrupted));
        }
        Ok(())
    }

    /// What `.meas` finds in a run with this value.
    fn measured(&self, change: Option<(&str, f64)>) -> Result<Vec<Measured>, Error> {
        let model = self.with(change)?;
        if self.options.steady {
            return Ok(periodic_measured(&model, &self.periodic())?.2.measured);
        }
        let asked = SimOptions {
            cancel: self.options.cancel,
            settings: self.options.settings.clone(),
            unestimated: true,
            ..SimOptions::default()
        };
        // Differences of runs need one grid.
        measured(&model, asked, false)
    }

    /// By extrapolated differences of runs.
    fn differences(&self, to: &[(String, f64)]) -> Result<Sensitivity, Error> {
        let own = self.measured(None)?;
        let mut gradients = started(&own);
        let measuring = self.measuring(self.model.circuit())?;
        let extremal = measuring.measurements.iter().map(is_extremal);
        let extremal: Vec<bool> = extremal.collect();
        let mut parted: Vec<Vec<&str>> = vec![vec![]; gradients.len()];
        for (name, value) in to {
            self.go_on()?;
            let run = |step: f64| self.measured(Some((name, value * (1.0 + step * RUN_STEP))));
            let [a, b, c, d] = STEPS.map(run);
            let runs = [a?, b?, c?, d?];
            for (k, gradient) in gradients.iter_mut().enumerate() {
                let value_of = |m: usize| runs[m].get(k)?.result.as_ref().ok().map(|f| f.value);
                let all = [value_of(0), value_of(1), value_of(2), value_of(3)];
                if let (Ok(own), [Some(a), Some(b), Some(c), Some(d)]) = (&gradient.value, all)
                    && extremal[k]
                    && part(*own, [a, b, c, d])
                {
                    parted[k].push(name);
                }
                let derivative = match all {
                    [Some(a), Some(b), Some(c), Some(d)] => {
                        Some((8.0 * (c - b) - (d - a)) / (12.0 * RUN_STEP * value))
                    }
                    _ => None,
                };
                gradient.to.push((name.clone(), derivative));
            }
        }
        let text = "the derivatives are differences of runs with values 1 and 2 % aside, as the run is not exact throughout, or too long for all that is between its events to be kept, or signals have impulses";
        let mut notes = vec![Note::run("not-exact", text)];
        for (gradient, names) in gradients.iter().zip(parted) {
            if !names.is_empty() && self.options.asks_for(&gradient.name) {
                let text = format!(
                    "`{}` moves otherwise with {} upward than downward, as an extremum does that is reached at two times with the same value: there is no derivative; the number is between those to both sides",
                    gradient.name,
                    names.join(", ")
                );
                notes.push(Note::run("one-sided", text));
            }
        }
        Ok(Sensitivity {
            of: gradients,
            at: to.to_vec(),
            exact: false,
            passes: Passes::default(),
            notes,
        })
    }
}

/// Whether a measurement is an extreme value, or when it is reached.
fn is_extremal(of: &NamedMeasurement) -> bool {
    let Some(Measurement::Over(over, ..)) = of.what else {
        return false;
    };
    !matches!(over, Over::Average | Over::Rms | Over::Integral)
}

/// Whether derivatives with ln p to both sides, from the value and from those two steps down, one down, one up and two up, are not the same.
fn part(own: f64, [a, b, c, d]: [f64; 4]) -> bool {
    let (down, up) = (3.0 * own - 4.0 * b + a, 4.0 * c - d - 3.0 * own);
    let [down, up] = [down, up].map(|twice| twice / (2.0 * RUN_STEP));
    (up - down).abs() > SIDES_APART * own.abs().max(down.abs()).max(up.abs())
}

/// Gradients without derivatives yet.
fn started(measured: &[Measured]) -> Vec<Gradient> {
    let of = |measured: &Measured| Gradient {
        name: measured.name.clone(),
        value: match &measured.result {
            Ok(found) => Ok(found.value),
            Err(why) => Err(why.to_string()),
        },
        to: vec![],
        terms: vec![],
    };
    measured.iter().map(of).collect()
}
