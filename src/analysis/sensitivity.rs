//! Derivatives of measurements to the values of elements and parameters.

use std::sync::atomic::AtomicBool;

use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use super::measured::{laps, measured_once, periodic_measured};
use super::periodic::{PeriodicOptions, beside, steady};
use super::variation::{Near, Parameter, STEPS, Shifted, Trajectory};
use crate::circuit::{Circuit, Formula, Kind, Measured, Probe, SteadyState, Tran, source::Wave};
use crate::integrate::{
    Error, Grid, Note, OrbitKind, Reason, SimOptions, Simulation, SimulationOptions,
};
use crate::measure::{Instant, Measurement, Over};
use crate::model::Model;
use crate::settings::Settings;
use crate::settings::tolerances::periodic::{MEASURE_STEP, RUN_STEP, VALUE_STEP};

/// Rows that measurements see at least, besides those at events.
const ROWS: usize = 2000;

/// Parts of the distance of rows in which they stand about the instants that are measured, one after the other.
const REFINED: [f64; 2] = [0.05, 0.0025];

/// What derivatives may be asked for.
#[derive(Debug, Clone, Default)]
pub struct SensitivityOptions<'a> {
    /// Names of `.meas`; by default all.
    pub of: Vec<String>,
    /// Names of elements and parameters; by default all resistances, capacitances, inductances and constant sources of the top level and all
    /// parameters that something uses, unless they are 0.
    pub to: Vec<String>,
    /// Of the periodic steady state instead of the transient; `.tran … steady` asks for it too.
    pub steady: bool,
    /// The period of it, s, in place of the common one of the sources.
    pub period: Option<f64>,
    /// Ends the runs when set.
    pub cancel: Option<&'a AtomicBool>,
    /// Tolerances.
    pub settings: Settings,
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
}

/// The derivatives of measurements.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sensitivity {
    /// In file order.
    pub of: Vec<Gradient>,
    /// What they are derivatives to, and its value.
    pub at: Vec<(String, f64)>,
    /// Whether they are those of the variational equation; otherwise they are differences of runs.
    pub exact: bool,
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
/// The rows of the run, at the steps of the grid and on both sides of events, move with a value p as the variational equation says: their values by
/// ∂y/∂p, those at events in time too. What `.meas` finds on rows that are moved by ± a little differs by its derivative. In the steady state
/// ∂s₀/∂p = (I − M)⁻¹ φ_p with the monodromy M and what a period makes of the change alone. Where steps are made, differences of runs
/// with p (1 ± h) and p (1 ± 2h) stand for it, and a note says so.
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
    let known = |name: &&String| {
        !circuit
            .measurements
            .iter()
            .any(|m| m.name == name.to_lowercase())
    };
    if let Some(name) = options.of.iter().find(known) {
        return Err(unsupported(format!("no measurement `{name}`")));
    }
    if circuit.measurements.is_empty() {
        return Err(unsupported(
            "the netlist has no `.meas` to differentiate".into(),
        ));
    }
    let beside = Beside {
        model,
        options,
        fine: fine(circuit, options),
    };
    let mut found = match beside.exact(&to)? {
        Some(found) => found,
        None => beside.differences(&to)?,
    };
    let asked = |gradient: &Gradient| {
        options.of.is_empty()
            || options
                .of
                .iter()
                .any(|name| name.to_lowercase() == gradient.name)
    };
    found.of.retain(asked);
    Ok(found)
}

fn unsupported(what: String) -> Error {
    Error::before(Reason::Unsupported(what))
}

/// What is asked for, with its value.
fn values(model: &Model, asked: &[String]) -> Result<Vec<(String, f64)>, Error> {
    let circuit = model.circuit();
    let elements = circuit.elements.iter().filter(|e| !e.name.contains('.'));
    let elements = elements.filter_map(|e| Some((e.name.clone(), value_of(&e.kind)?)));
    let all: Vec<(String, f64)> = elements.chain(circuit.params.iter().cloned()).collect();
    // A card's value may be multiplied (`m=2`).
    let written = |(name, value): (String, f64)| {
        let mut set = model.clone();
        let Some(id) = circuit.element(&name) else {
            return Some((name, value));
        };
        set.set(&name, value).ok()?;
        let kind = &set.circuit().elements.get(id.index())?.kind;
        let factor = value_of(kind)? / value;
        Some((name, value / factor))
    };
    if asked.is_empty() {
        let some = all.into_iter().filter(|(_, value)| *value != 0.0);
        return Ok(some.filter_map(written).collect());
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
        written(own).ok_or_else(|| unsupported(format!("`{name}` cannot be set")))
    };
    asked.iter().map(find).collect()
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

/// The transient with so many rows at least.
fn fine(circuit: &Circuit, options: &SensitivityOptions<'_>) -> Option<Tran> {
    let tran = circuit.tran.filter(|_| !options.steady)?;
    let rows = Grid::of(&tran).len();
    Some(Tran {
        tstep: tran.tstep / ROWS.div_ceil(rows) as f64,
        ..tran
    })
}

/// A model and those near it.
struct Beside<'a> {
    model: &'a Model,
    options: &'a SensitivityOptions<'a>,
    fine: Option<Tran>,
}

/// A run that is differentiated, and how measurements see its rows.
struct Base {
    trajectory: Trajectory,
    /// Where it begins.
    positions: Vec<bool>,
    /// Times of rows besides those at events.
    times: Vec<f64>,
    /// Their distance.
    spacing: f64,
    /// Of an orbit: its monodromy, its period, and from when on its rows count.
    orbit: Option<(DMatrix<f64>, f64, f64)>,
    /// The periods that measurements see.
    laps: (usize, usize),
}

impl Beside<'_> {
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
        let circuit = Circuit {
            probes: model.circuit().measured.clone(),
            tran: self.fine.or(model.circuit().tran),
            ..model.circuit().clone()
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

    /// The run, where it is exact throughout.
    fn base(&self, model: &Model, notes: &mut Vec<Note>) -> Result<Option<Base>, Error> {
        if !self.options.steady {
            let Some(tran) = self.fine else {
                return Err(unsupported("the netlist asks for no .tran analysis".into()));
            };
            let mut simulation = self.simulation(model)?;
            let (state, positions) = (simulation.state(), simulation.positions());
            let place = (0.0, &state[..], &positions[..]);
            if !simulation.is_exact() || simulation.passages(place, tran.tstop)?.is_none() {
                return Ok(None);
            }
            let trajectory = Trajectory::with(&mut simulation, place, tran.tstop, true)?;
            let grid = Grid::of(&tran);
            return Ok(Some(Base {
                trajectory,
                positions,
                times: (0..grid.len()).map(|k| grid.time(k)).collect(),
                spacing: tran.tstep,
                orbit: None,
                laps: (0, 1),
            }));
        }
        let mut found = steady(model, &self.periodic())?;
        let orbit = found.orbit();
        let driven = orbit.kind == OrbitKind::Driven;
        if !driven || !found.simulation.is_exact() || found.course()?.is_none() {
            return Ok(None);
        }
        let (trajectory, from) = found.trajectory()?;
        let begin = trajectory
            .segments
            .first()
            .map_or(from, |segment| segment.from);
        let step = orbit.period / ROWS as f64;
        let times = (0..=2 * ROWS).map(|k| from + k as f64 * step);
        let inside = |t: &f64| *t > begin && *t < begin + orbit.period;
        let signals = model.circuit().measured.len() + 1;
        let (laps, note) = laps(model.circuit().tran, orbit.period, ROWS * signals);
        notes.extend(note);
        Ok(Some(Base {
            positions: vec![],
            times: times.filter(inside).collect(),
            spacing: step,
            orbit: Some((trajectory.monodromy(), orbit.period, from)),
            laps,
            trajectory,
        }))
    }

    /// By the variational equation; `None` where steps are made.
    fn exact(&self, to: &[(String, f64)]) -> Result<Option<Sensitivity>, Error> {
        let own = self.with(None)?;
        let mut notes = Vec::new();
        let Some(mut base) = self.base(&own, &mut notes)? else {
            return Ok(None);
        };
        let mut gradients: Vec<Gradient> = Vec::new();
        let mut left_out: Vec<String> = Vec::new();
        for (name, value) in to {
            self.go_on()?;
            let near = |step: f64| {
                let model = self.with(Some((name, value * (1.0 + step * VALUE_STEP))))?;
                let mut simulation = if self.options.steady {
                    let (period, simulation) = beside(&model, &self.periodic())?;
                    let moves =
                        base.orbit
                            .as_ref()
                            .zip(period)
                            .is_some_and(|((_, own, ..), other)| {
                                (own / other).round() * other != *own
                                    && ((own / other).round() * other - own).abs()
                                        > 1e-3 * VALUE_STEP * own
                            });
                    if moves && self.options.to.is_empty() {
                        return Ok(None);
                    }
                    if moves {
                        let what = format!(
                            "`{name}` changes the period, on which the steady state depends otherwise"
                        );
                        return Err(Error::before(Reason::NotSmooth(what)));
                    }
                    simulation
                } else {
                    self.simulation(&model)?
                };
                if !self.options.steady && simulation.positions() != base.positions {
                    let what = format!("a switch starts on another side where `{name}` is another");
                    return Err(Error::before(Reason::NotSmooth(what)));
                }
                Near::of(&mut simulation, &base.trajectory).map(Some)
            };
            let [a, b, c, d] = STEPS.map(near);
            let (Some(a), Some(b), Some(c), Some(d)) = (a?, b?, c?, d?) else {
                let text = format!(
                    "`{name}` is left out: it changes the period, on which the steady state depends otherwise"
                );
                notes.push(text.into());
                left_out.push(name.clone());
                continue;
            };
            let near = [a, b, c, d];
            if gradients.is_empty() {
                for part in REFINED {
                    let parameter = Parameter::of(&base.trajectory, &near)?;
                    let instants = base.instants(&parameter, own.circuit(), self.fine)?;
                    base.refine(&instants, part);
                }
            }
            let parameter = Parameter::of(&base.trajectory, &near)?;
            let start = match &base.orbit {
                None => Parameter::weighted_states(&near),
                Some((m, ..)) => {
                    let still = DVector::zeros(m.nrows());
                    let (_, forced) = parameter.along(&still, &[])?;
                    let closed = DMatrix::identity(m.nrows(), m.nrows()) - m;
                    closed.lu().solve(&forced).ok_or_else(|| {
                        let what = "the orbit is one of a family: where it moves is not determined";
                        Error::before(Reason::NotSmooth(what.into()))
                    })?
                }
            };
            let (rows, _) = parameter.along(&start, &base.times)?;
            let rows = base.seen(base.ordered(rows), self.fine);
            let measure = |circuit: &Circuit, h: f64| rows.measure(circuit, own.circuit(), h);
            if gradients.is_empty() {
                gradients = started(&measure(own.circuit(), 0.0));
            }
            let moved = |h: f64| {
                let model = self.with(Some((name, value * (1.0 + h))))?;
                Ok::<_, Error>(measure(model.circuit(), h))
            };
            let (low, high) = (moved(-MEASURE_STEP)?, moved(MEASURE_STEP)?);
            for (gradient, (low, high)) in gradients.iter_mut().zip(low.iter().zip(&high)) {
                let both = low.result.as_ref().ok().zip(high.result.as_ref().ok());
                let derivative =
                    both.map(|(low, high)| (high.value - low.value) / (2.0 * MEASURE_STEP * value));
                gradient.to.push((name.clone(), derivative));
            }
        }
        let at = to.iter().filter(|(name, _)| !left_out.contains(name));
        Ok(Some(Sensitivity {
            of: gradients,
            at: at.cloned().collect(),
            exact: true,
            notes,
        }))
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
        let finished = measured_once(
            &model,
            SimOptions {
                cancel: self.options.cancel,
                settings: self.options.settings.clone(),
                unestimated: true,
                ..SimOptions::default()
            },
        );
        match (finished.run, finished.error) {
            (Some((_, found)), None) => Ok(found.measured),
            (_, Some(error)) => Err(error),
            (None, None) => Ok(vec![]),
        }
    }

    /// By extrapolated differences of runs.
    fn differences(&self, to: &[(String, f64)]) -> Result<Sensitivity, Error> {
        let mut gradients = started(&self.measured(None)?);
        for (name, value) in to {
            self.go_on()?;
            let run = |step: f64| self.measured(Some((name, value * (1.0 + step * RUN_STEP))));
            let [a, b, c, d] = STEPS.map(run);
            let runs = [a?, b?, c?, d?];
            for (k, gradient) in gradients.iter_mut().enumerate() {
                let value_of = |m: usize| runs[m].get(k)?.result.as_ref().ok().map(|f| f.value);
                let all = [value_of(0), value_of(1), value_of(2), value_of(3)];
                let derivative = match all {
                    [Some(a), Some(b), Some(c), Some(d)] => {
                        Some((8.0 * (c - b) - (d - a)) / (12.0 * RUN_STEP * value))
                    }
                    _ => None,
                };
                gradient.to.push((name.clone(), derivative));
            }
        }
        let text = "the derivatives are differences of runs with values 1 and 2 % aside, as the run is not exact throughout";
        Ok(Sensitivity {
            of: gradients,
            at: to.to_vec(),
            exact: false,
            notes: vec![text.to_string().into()],
        })
    }
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
    };
    measured.iter().map(of).collect()
}

/// Rows as measurements see them: again and again from one lap to another, with so many seconds to a lap.
struct Seen {
    rows: Vec<Shifted>,
    laps: (usize, usize),
    period: f64,
}

impl Seen {
    /// By lap and row, and the row that ends the last lap.
    fn all(&self) -> impl Iterator<Item = (f64, &Shifted)> {
        let Self { rows, laps, period } = self;
        let lap = move |k: usize| rows.iter().map(move |row| (k as f64 * period, row));
        let last = rows.first().filter(|_| *period > 0.0);
        let last = last.map(|row| (laps.1 as f64 * period, row));
        (laps.0..laps.1).flat_map(lap).chain(last)
    }

    /// What a circuit's measurements find on rows that are moved by so much; the columns are the signals that `own` measures.
    fn measure(&self, circuit: &Circuit, own: &Circuit, h: f64) -> Vec<Measured> {
        let time = self.all().map(|(shift, row)| shift + row.t + h * row.dt);
        let time: Vec<f64> = time.collect();
        let column = |probe: &Probe| {
            let mut measured = own.measured.iter();
            let at = measured.position(|other| other.name == probe.name)?;
            let values = self.all().map(|(_, row)| row.y[at] + h * row.dy[at]);
            Some(values.collect())
        };
        circuit.measure(&time, &column)
    }
}

impl Base {
    /// Rows of the grid that an event passes when all are moved give way to it. One that would pass another event stays where it is.
    fn ordered(&self, mut rows: Vec<Shifted>) -> Vec<Shifted> {
        /// Moves of a row for which there is room.
        const ROOM: f64 = 4.0;
        let events: Vec<f64> = rows
            .iter()
            .filter(|row| row.event)
            .map(|row| row.t)
            .collect();
        let reach = |row: &Shifted| ROOM * MEASURE_STEP * row.dt.abs();
        for row in rows.iter_mut().filter(|row| row.dt != 0.0) {
            let below = events[..events.partition_point(|t| *t < row.t)].last();
            let above = events.get(events.partition_point(|t| *t <= row.t));
            let others = below.into_iter().chain(above);
            let room = others.fold(self.spacing, |room, t| room.min((t - row.t).abs()));
            if reach(row) > room {
                row.dy -= &row.rate * row.dt;
                row.dt = 0.0;
            }
        }
        let moving: Vec<(f64, f64)> = rows
            .iter()
            .filter(|row| row.dt != 0.0)
            .map(|row| (row.t, reach(row)))
            .collect();
        let passed = |row: &Shifted| {
            let at = moving.partition_point(|(t, _)| *t < row.t);
            let beside = moving[..at].last().into_iter().chain(moving.get(at));
            beside
                .into_iter()
                .any(|(t, reach)| (row.t - t).abs() < *reach)
        };
        rows.retain(|row| row.event || !passed(row));
        rows
    }

    /// When measurements find what they find.
    fn instants(
        &self,
        parameter: &Parameter<'_>,
        circuit: &Circuit,
        tran: Option<Tran>,
    ) -> Result<Vec<f64>, Error> {
        let states = self.trajectory.systems.first();
        let still = DVector::zeros(states.map_or(0, |system| system.lcs.storage.names.len()));
        let rows = self.seen(parameter.along(&still, &self.times)?.0, tran);
        let mut instants = Vec::new();
        for extremum in [Over::WhenMaximum, Over::WhenMinimum] {
            let mut asked = circuit.clone();
            for named in &mut asked.measurements {
                if let Some(Measurement::Over(over, ..)) = &mut named.what
                    && matches!(over, Over::Maximum | Over::Minimum | Over::PeakToPeak)
                {
                    *over = extremum;
                }
            }
            let all = rows.measure(&asked, circuit, 0.0);
            for (named, measured) in asked.measurements.iter().zip(&all) {
                let Ok(found) = &measured.result else {
                    continue;
                };
                // Between rows the ends of windows that are given move nothing.
                let crossing =
                    |end: &Option<Instant<Formula>>| matches!(end, Some(Instant::Crossing { .. }));
                let at = found.at.iter().map(|(_, t)| *t);
                match &named.what {
                    Some(Measurement::Over(over, _, window)) => {
                        let sought = crossing(&window.from) || crossing(&window.to);
                        instants.extend(at.filter(|_| sought));
                        let time = matches!(over, Over::WhenMaximum | Over::WhenMinimum);
                        instants.extend(time.then_some(found.value));
                    }
                    Some(Measurement::When(_)) => instants.push(found.value),
                    Some(Measurement::Find {
                        when: Instant::At(_),
                        ..
                    }) => {}
                    _ => instants.extend(at),
                }
            }
        }
        Ok(instants)
    }

    /// Rows at these instants, and about them in this part of their distance.
    fn refine(&mut self, instants: &[f64], part: f64) {
        /// Rows on either side.
        const ABOUT: i32 = 20;
        let ends = self
            .trajectory
            .segments
            .first()
            .zip(self.trajectory.segments.last());
        let Some((first, last)) = ends else { return };
        let (begin, end) = (first.from, last.to);
        for instant in instants {
            let t = match &self.orbit {
                None => *instant,
                Some((_, period, from)) => begin + (from + instant - begin).rem_euclid(*period),
            };
            let about = (-ABOUT..=ABOUT).map(|k| t + f64::from(k) * part * self.spacing);
            self.times.extend(about.filter(|t| *t > begin && *t < end));
        }
        self.times.sort_by(f64::total_cmp);
        self.times.dedup();
    }

    /// The rows as measurements see them: from tstart on, or the orbit from its beginning.
    fn seen(&self, mut rows: Vec<Shifted>, tran: Option<Tran>) -> Seen {
        let seen = |rows: Vec<Shifted>, period: f64| Seen {
            rows,
            laps: self.laps,
            period,
        };
        let Some((_, period, from)) = &self.orbit else {
            let start = tran.map_or(0.0, |tran| tran.tstart);
            rows.retain(|row| row.t >= start);
            return seen(rows, 0.0);
        };
        // What is beyond the end of the period stands at its beginning.
        let end = from + period;
        let at = rows.iter().position(|row| row.t >= end);
        rows.rotate_left(at.unwrap_or(0));
        for row in &mut rows {
            row.t -= if row.t >= end { end } else { *from };
        }
        seen(rows, *period)
    }
}
