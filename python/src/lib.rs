//! Python's side of `circ`: models, simulations and their results as NumPy arrays and JSON, which `circ/__init__.py` turns into Python's own
//! types.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use circ::analysis::{
    Finished, Measurements, PeriodicOptions, Row, SensitivityOptions, SmallSignalOptions,
    SweepOptions, TableOptions, Variant, drawn_names, measured_names, periodic_measured,
    periodic_table, sensitivity, shown, small_signal, sweep, table, transient,
};
use circ::circuit::{Circuit, Spread, Sweep, Tolerance, Tran};
use circ::diagnostic::{SourceFile, SourceMap};
use circ::integrate::{Reason, Run};
use circ::{
    Checkpoint, Diodes, ElaborateOptions, Error, Event, Method, Model, SimOptions, Simulation,
    SimulationOptions, StopReason, check, report,
};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Value, json};

create_exception!(
    _circ,
    NetlistError,
    PyException,
    "The netlist is no circuit; `diagnostics` says why."
);
create_exception!(
    _circ,
    SimulationError,
    PyException,
    "A run or a solution failed; `kind`, `time` and `device` say how."
);

/// Modes and their reductions are many small allocations: with that of the system an orbit takes a fifth longer.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// How often a long call looks for Ctrl-C.
const PATIENCE: Duration = Duration::from_millis(50);

/// A fault as one of Python's exceptions.
fn raised(py: Python<'_>, error: &Error, circuit: Option<&Circuit>) -> PyErr {
    let faults = match &error.reason {
        Reason::Netlist(faults) => Some(faults),
        Reason::Unknown(what) => return PyKeyError::new_err(what.clone()),
        _ => None,
    };
    let described = |diagnostics: &[circ::Diagnostic], sources: &SourceMap| {
        let faults = diagnostics.iter().map(|d| check::Fault::of(d, sources));
        report::json::line(&faults.collect::<Vec<_>>())
    };
    let result = match (faults, circuit) {
        (Some(faults), _) => {
            let raised = NetlistError::new_err(error.to_string());
            let text = described(&faults.findings, &faults.sources);
            raised
                .value(py)
                .setattr("_diagnostics", text)
                .map(|()| raised)
        }
        (None, circuit) => {
            let raised = SimulationError::new_err(error.to_string());
            let kind = circuit.map_or("run", |circuit| error.diagnostic(circuit).code);
            let value = raised.value(py);
            value
                .setattr("kind", kind)
                .and_then(|()| value.setattr("time", error.t))
                .and_then(|()| value.setattr("device", error.elements.first()))
                .map(|()| raised)
        }
    };
    result.unwrap_or_else(|raised| raised)
}

/// Carries out a long call on another thread, without the GIL; Ctrl-C ends it. The threads are kept: one that begins anew has to fetch its stack and its
/// memory first.
fn released<T: Send>(py: Python<'_>, call: impl FnOnce(&AtomicBool) -> T + Send) -> PyResult<T> {
    released_with(py, &Arc::default(), call)
}

/// The same where a flag is known that ends the call.
fn released_with<T: Send>(
    py: Python<'_>,
    cancel: &Arc<AtomicBool>,
    call: impl FnOnce(&AtomicBool) -> T + Send,
) -> PyResult<T> {
    cancel.store(false, Ordering::Relaxed);
    py.detach(move || {
        let (done, outcome) = channel();
        rayon::in_place_scope(|scope| {
            scope.spawn(move |_| {
                let _ = done.send(call(cancel));
            });
            let mut interrupt = None;
            loop {
                match outcome.recv_timeout(PATIENCE) {
                    Ok(found) => return interrupt.map_or(Ok(found), Err),
                    Err(RecvTimeoutError::Timeout) if interrupt.is_none() => {
                        if let Err(error) = Python::attach(|py| py.check_signals()) {
                            interrupt = Some(error);
                            cancel.store(true, Ordering::Relaxed);
                        }
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => {
                        return Err(PyValueError::new_err("a fault in circ itself"));
                    }
                }
            }
        })
    })
}

fn method(name: &str) -> PyResult<Method> {
    let all = [Method::Auto, Method::Exact, Method::Euler, Method::Theta];
    let found = all.into_iter().find(|method| method.name() == name);
    found.ok_or_else(|| {
        PyValueError::new_err(format!("no method `{name}`: auto, exact, euler, theta"))
    })
}

fn options(diodes: &str, params: Vec<(String, f64)>) -> PyResult<ElaborateOptions> {
    let diodes = match diodes {
        "auto" => Diodes::Auto,
        "ideal" => Diodes::Ideal,
        "exp" => Diodes::Exp,
        other => {
            let message = format!("no diodes `{other}`: auto, ideal, exp");
            return Err(PyValueError::new_err(message));
        }
    };
    if let Some((name, value)) = params.iter().find(|(_, value)| !value.is_finite()) {
        return Err(PyValueError::new_err(format!(
            "params: `{name}` is {value}"
        )));
    }
    let lower = |(name, value): (String, f64)| (name.to_lowercase(), value);
    let params = params.into_iter().map(lower);
    Ok(ElaborateOptions {
        diodes,
        params: params.collect(),
        ..ElaborateOptions::default()
    })
}

/// How a value is drawn, of (name, "normal" or "uniform", relative).
fn tolerance((name, kind, relative): (String, String, f64)) -> PyResult<Tolerance> {
    let spread = match kind.as_str() {
        "normal" => Spread::Normal,
        "uniform" => Spread::Uniform,
        other => {
            let message = format!("no distribution `{other}`: normal, uniform");
            return Err(PyValueError::new_err(message));
        }
    };
    if !(relative.is_finite() && relative >= 0.0) {
        let message =
            format!("a tolerance of {relative} for `{name}`: expected a number, not negative");
        return Err(PyValueError::new_err(message));
    }
    let name = name.to_lowercase();
    Ok(Tolerance {
        name,
        spread,
        relative,
    })
}

/// The seed of samples, and how values are drawn, as [`tolerance`] takes it.
type Random = (u64, Vec<(String, String, f64)>);

/// Values, failures, names of the columns that are measured and of those that are drawn.
type Swept<'py> = (
    Bound<'py, PyArray2<f64>>,
    Vec<String>,
    Vec<String>,
    Vec<String>,
);

/// As JSON.
fn events(all: &[Event]) -> String {
    let event = |event: &Event| {
        let changes: Vec<String> = event.changes.iter().map(ToString::to_string).collect();
        json!({"t": event.t, "changes": changes, "jump": event.jump})
    };
    Value::from_iter(all.iter().map(event)).to_string()
}

/// (names, units, time, values rows × columns, JSON of the summary, JSON of the events)
type Rows<'py> = (
    Vec<String>,
    Vec<&'static str>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
    String,
    String,
);

fn rows<'py>(
    py: Python<'py>,
    model: &Model,
    run: Run,
    found: &Measurements,
) -> PyResult<Rows<'py>> {
    let run = shown(model.circuit(), run);
    let summary = report::json::summary(&run, found, model.places());
    let events = events(&run.events);
    let waves = run.waveforms;
    let shape = [waves.time.len(), waves.names.len()];
    let values = PyArray1::from_vec(py, waves.values).reshape(shape)?;
    Ok((
        waves.names,
        waves.units,
        PyArray1::from_vec(py, waves.time),
        values,
        summary,
        events,
    ))
}

/// A circuit; `circ.Model` is its user's side.
#[pyclass(module = "circ._circ", frozen)]
struct Core {
    model: Model,
}

impl Core {
    fn of(py: Python<'_>, model: Result<Model, Error>) -> PyResult<Self> {
        model
            .map(|model| Self { model })
            .map_err(|error| raised(py, &error, None))
    }

    fn failed(&self, py: Python<'_>, error: &Error) -> PyErr {
        raised(py, error, Some(self.model.circuit()))
    }

    /// The model with what a run was asked for.
    fn asked(
        &self,
        py: Python<'_>,
        stop: Option<f64>,
        print: Option<f64>,
        probes: &[String],
    ) -> PyResult<Model> {
        let own = self.model.circuit().tran;
        let stop = stop.or(own.map(|t| t.tstop));
        let tran = stop.map(|tstop| {
            let tstep = print.or(own.map(|t| t.tstep)).unwrap_or(tstop / 1000.0);
            Tran {
                tstep,
                tstop,
                tstart: own.map_or(0.0, |t| t.tstart),
                tmax: own.and_then(|t| t.tmax),
                uic: own.is_some_and(|t| t.uic),
                prints: print.is_some() || own.is_none_or(|t| t.prints),
            }
        });
        if tran == own && probes.is_empty() {
            return Ok(self.model.clone());
        }
        let asked = self.model.asked(tran, probes);
        asked.map_err(|error| self.failed(py, &error))
    }
}

#[pymethods]
impl Core {
    #[staticmethod]
    fn load(
        py: Python<'_>,
        path: &str,
        diodes: &str,
        params: Vec<(String, f64)>,
    ) -> PyResult<Self> {
        let options = options(diodes, params)?;
        Self::of(py, py.detach(|| Model::load(path, options)))
    }

    #[staticmethod]
    fn of_files(
        py: Python<'_>,
        files: Vec<(String, String)>,
        diodes: &str,
        params: Vec<(String, f64)>,
    ) -> PyResult<Self> {
        let options = options(diodes, params)?;
        let [(name, text), included @ ..] = &files[..] else {
            return Err(PyValueError::new_err("there is no file to read"));
        };
        if included.is_empty() {
            return Self::of(py, py.detach(|| Model::parse_with(text, name, options)));
        }
        let file = |(path, text): &(String, String)| SourceFile {
            path: path.clone(),
            text: text.clone(),
        };
        let files: Vec<SourceFile> = files.iter().map(file).collect();
        Self::of(py, py.detach(|| Model::of_files(&files, options)))
    }

    /// (path, text) of the netlist and what it includes.
    fn files(&self) -> Vec<(String, String)> {
        let files = self.model.sources().files.iter();
        files
            .map(|file| (file.path.clone(), file.text.clone()))
            .collect()
    }

    #[getter]
    fn title(&self) -> &str {
        &self.model.circuit().title
    }

    fn findings(&self) -> String {
        let sources = self.model.sources();
        let faults = self
            .model
            .findings()
            .iter()
            .map(|d| check::Fault::of(d, sources));
        report::json::line(&faults.collect::<Vec<_>>())
    }

    /// The model with another value.
    fn set(&self, py: Python<'_>, name: &str, value: f64) -> PyResult<Self> {
        let mut model = self.model.clone();
        model
            .set(name, value)
            .map_err(|error| self.failed(py, &error))?;
        Ok(Self { model })
    }

    /// The value of an element (Ω, F, H; V or A of a constant source) or a parameter.
    fn value(&self, name: &str) -> PyResult<f64> {
        let (name, circuit) = (name.to_lowercase(), self.model.circuit());
        circuit.value(&name).ok_or_else(|| {
            PyKeyError::new_err(format!("no element or parameter `{name}` with a value"))
        })
    }

    #[pyo3(signature = (stop, print, step, method_name, probes))]
    fn tran<'py>(
        &self,
        py: Python<'py>,
        stop: Option<f64>,
        print: Option<f64>,
        step: Option<f64>,
        method_name: &str,
        probes: Vec<String>,
    ) -> PyResult<Rows<'py>> {
        let method = method(method_name)?;
        let model = self.asked(py, stop, print, &probes)?;
        let Finished { run, error } = released(py, |cancel| {
            let options = SimOptions {
                method,
                step,
                cancel: Some(cancel),
                ..SimOptions::default()
            };
            transient(&model, options)
        })?;
        match (error, run) {
            (None, Some((run, found))) => rows(py, &model, run, &found),
            (Some(error), _) => Err(self.failed(py, &error)),
            (None, None) => Err(PyValueError::new_err("a run without rows")),
        }
    }

    #[pyo3(signature = (period, order, probes))]
    fn pss<'py>(
        &self,
        py: Python<'py>,
        period: Option<f64>,
        order: Option<usize>,
        probes: Vec<String>,
    ) -> PyResult<Rows<'py>> {
        let model = self.asked(py, None, None, &probes)?;
        let found = released(py, |cancel| {
            let options = PeriodicOptions {
                period,
                order,
                cancel: Some(cancel),
                ..PeriodicOptions::default()
            };
            periodic_measured(&model, &options)
        })?;
        let (orbit, run, found) = found.map_err(|error| self.failed(py, &error))?;
        let run = Run {
            orbit: Some(orbit),
            ..run
        };
        rows(py, &model, run, &found)
    }

    /// (names, frequency, real and imaginary parts rows × columns)
    #[pyo3(signature = (frequencies, sidebands, probes))]
    #[expect(clippy::type_complexity, reason = "taken apart at once")]
    fn ac<'py>(
        &self,
        py: Python<'py>,
        frequencies: Vec<f64>,
        sidebands: u16,
        probes: Vec<String>,
    ) -> PyResult<(
        Vec<String>,
        Bound<'py, PyArray1<f64>>,
        Bound<'py, PyArray2<f64>>,
        Bound<'py, PyArray2<f64>>,
        Vec<String>,
    )> {
        let model = self.asked(py, None, None, &probes)?;
        let found = released(py, |cancel| {
            let options = SmallSignalOptions {
                frequencies,
                sidebands,
                cancel: Some(cancel),
                ..SmallSignalOptions::default()
            };
            small_signal(&model, &options)
        })?;
        let response = found.map_err(|error| self.failed(py, &error))?;
        let notes = model.places().all(&response.notes);
        let phasors = response.phasors;
        let shape = [phasors.frequency.len(), phasors.names.len()];
        let [re, im] = [
            phasors.values.iter().map(|v| v.re).collect(),
            phasors.values.iter().map(|v| v.im).collect(),
        ]
        .map(|values: Vec<f64>| PyArray1::from_vec(py, values).reshape(shape));
        Ok((
            phasors.names,
            PyArray1::from_vec(py, phasors.frequency),
            re?,
            im?,
            notes,
        ))
    }

    fn sensitivity(
        &self,
        py: Python<'_>,
        of: Vec<String>,
        to: Vec<String>,
        steady: bool,
        table: Option<(Vec<String>, Vec<String>)>,
    ) -> PyResult<String> {
        let with_table = table.is_some();
        let (inputs, outputs) = table.unwrap_or_default();
        let found = released(py, |cancel| {
            let options = SensitivityOptions {
                of,
                to,
                steady,
                table: with_table,
                inputs,
                outputs,
                cancel: Some(cancel),
                ..SensitivityOptions::default()
            };
            sensitivity(&self.model, &options)
        })?;
        let found = found.map_err(|error| self.failed(py, &error))?;
        let mut of = serde_json::Map::new();
        for gradient in &found.of {
            let to: serde_json::Map<String, Value> = (gradient.to.iter())
                .map(|(name, value)| (name.clone(), json!(value)))
                .collect();
            let entry = match &gradient.value {
                Ok(value) => json!({"value": value, "to": to}),
                Err(reason) => json!({"value": null, "failed": reason, "to": to}),
            };
            of.insert(gradient.name.clone(), entry);
        }
        let notes = self.model.places().all(&found.notes);
        Ok(json!({"of": of, "exact": found.exact, "notes": notes}).to_string())
    }

    fn table(
        &self,
        py: Python<'_>,
        steady: bool,
        inputs: Vec<String>,
        outputs: Vec<String>,
    ) -> PyResult<String> {
        let found = released(py, |cancel| {
            if steady {
                let options = PeriodicOptions {
                    cancel: Some(cancel),
                    ..PeriodicOptions::default()
                };
                periodic_table(&self.model, (&inputs, &outputs), &options)
            } else {
                let options = TableOptions {
                    inputs,
                    outputs,
                    cancel: Some(cancel),
                    ..TableOptions::default()
                };
                table(&self.model, &options)
            }
        })?;
        let found = found.map_err(|error| self.failed(py, &error))?;
        Ok(report::json::line(&found))
    }

    fn op(&self, py: Python<'_>) -> PyResult<String> {
        let found = released(py, |_| self.model.operating_point())?;
        let point = found.map_err(|error| self.failed(py, &error))?;
        let map = |pairs: &[(String, f64)]| -> serde_json::Map<String, Value> {
            pairs
                .iter()
                .map(|(name, value)| (name.clone(), json!(value)))
                .collect()
        };
        let switches: serde_json::Map<String, Value> = (point.switches.iter())
            .map(|(name, on)| (name.clone(), json!(if *on { "on" } else { "off" })))
            .collect();
        let notes = self.model.places().all(&point.notes);
        let found = json!({"nodes": map(&point.nodes), "currents": map(&point.currents), "switches": switches, "notes": notes});
        Ok(found.to_string())
    }

    fn check(&self, py: Python<'_>) -> PyResult<String> {
        let found = released(py, |_| {
            let lcs = self.model.lcs()?;
            Ok(check::circuit(self.model.circuit(), &lcs))
        })?;
        let report = found.map_err(|error: Error| self.failed(py, &error))?;
        Ok(report::json::line(&report))
    }

    /// The matrices by their letters, and the system as JSON without them.
    fn lcs<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyDict>, String)> {
        let lcs = self.model.lcs().map_err(|error| self.failed(py, &error))?;
        let arrays = PyDict::new(py);
        for (letter, m) in [
            ("A", &lcs.a),
            ("B", &lcs.b),
            ("C", &lcs.c),
            ("D", &lcs.d),
            ("E", &lcs.e),
            ("G", &lcs.g),
            ("P", &lcs.energy),
        ] {
            // Row by row: nalgebra keeps columns.
            let values = m.transpose().as_slice().to_vec();
            let array = PyArray1::from_vec(py, values).reshape([m.nrows(), m.ncols()])?;
            arrays.set_item(letter, array)?;
        }
        for (letter, v) in [("e", &lcs.e0), ("F", &lcs.f)] {
            arrays.set_item(letter, PyArray1::from_vec(py, v.as_slice().to_vec()))?;
        }
        let named = |name: &str, unit: &str| json!({"name": name, "unit": unit});
        let rest = json!({
            "states": lcs.states.iter().map(|s| named(&s.name, s.unit)).collect::<Vec<_>>(),
            "inputs": lcs.inputs.iter().map(|s| named(&s.name, s.unit)).collect::<Vec<_>>(),
            "ports": lcs.ports.iter().map(|p| json!({"device": p.device, "lambda": p.lambda, "y": p.y, "law": p.law.kind()})).collect::<Vec<_>>(),
            "switches": lcs.switches,
        });
        Ok((arrays, rest.to_string()))
    }

    /// What `.meas` finds with each of these values of the names, and samples: (values, failures) of (names measured, names drawn), a row a
    /// variant.
    #[pyo3(signature = (names, points, of, steady, random, serial))]
    #[allow(clippy::too_many_arguments, reason = "Python's side names them")]
    fn sweep<'py>(
        &self,
        py: Python<'py>,
        names: Vec<String>,
        points: Vec<(Vec<f64>, Option<u64>)>,
        of: Vec<String>,
        steady: bool,
        random: Option<Random>,
        serial: bool,
    ) -> PyResult<Swept<'py>> {
        let (sampled, model) = (random.is_some(), self.model.clone());
        let model = match random {
            Some((seed, given)) => {
                let tolerances = given.into_iter().map(tolerance);
                let tolerances = tolerances.collect::<PyResult<_>>()?;
                model.toleranced(seed, tolerances)
            }
            None => model,
        };
        let swept = |name: &String| {
            let (what, values) = (model.swept(name)?, vec![]);
            Ok(Sweep { what, values })
        };
        let sweeps: Result<Vec<_>, Error> = names.iter().map(swept).collect();
        let sweeps = sweeps.map_err(|error| self.failed(py, &error))?;
        let variant = |(values, sample)| Variant::of(&model, &sweeps, values, sample);
        let variants: Vec<Variant<'_>> = points.into_iter().map(variant).collect();
        let drawn = if sampled { drawn_names(&model) } else { vec![] };
        let columns = measured_names(&model, &of).map_err(|error| self.failed(py, &error))?;
        let (mut values, mut failures) = (vec![], vec![]);
        let width = columns.len() + drawn.len();
        let take = |row: Row| {
            let found = row.measured.into_iter().chain(row.drawn).take(width);
            values.extend(found.map(|value| value.unwrap_or(f64::NAN)));
            failures.push(row.failed.unwrap_or_default());
            ControlFlow::Continue(())
        };
        let together = if serial { 1 } else { variants.len().max(1) };
        let swept = released(py, |cancel| {
            let options = SweepOptions {
                of: columns.clone(),
                steady,
                cancel: Some(cancel),
                ..SweepOptions::default()
            };
            let mut take = take;
            let mut chunks = variants.chunks(together);
            chunks.try_for_each(|chunk| sweep(chunk, &options, &mut take))
        })?;
        swept.map_err(|error| self.failed(py, &error))?;
        let values = PyArray1::from_vec(py, values).reshape([failures.len(), width])?;
        Ok((values, failures, columns, drawn))
    }

    #[pyo3(signature = (method_name, step, until))]
    fn simulation(
        &self,
        py: Python<'_>,
        method_name: &str,
        step: Option<f64>,
        until: Option<f64>,
    ) -> PyResult<Course> {
        let cancel = Arc::new(AtomicBool::new(false));
        let options = SimulationOptions {
            method: method(method_name)?,
            step,
            until,
            cancel: Some(Arc::clone(&cancel)),
            ..SimulationOptions::default()
        };
        let found = released(py, |_| self.model.simulation(options))?;
        let simulation = found.map_err(|error| self.failed(py, &error))?;
        Ok(Course {
            simulation: Mutex::new(simulation),
            cancel,
            circuit: self.model.circuit().clone(),
        })
    }
}

/// A transient that its caller drives; `circ.Simulation` is its user's side.
#[pyclass(module = "circ._circ")]
struct Course {
    simulation: Mutex<Simulation>,
    cancel: Arc<AtomicBool>,
    circuit: Circuit,
}

/// A state to return to.
#[pyclass(module = "circ._circ", frozen)]
struct Place(Checkpoint);

#[pymethods]
impl Place {
    /// s.
    #[getter]
    fn time(&self) -> f64 {
        self.0.time()
    }
}

impl Course {
    fn own(&mut self) -> &mut Simulation {
        let own = self.simulation.get_mut();
        own.unwrap_or_else(PoisonError::into_inner)
    }

    fn failed(&self, py: Python<'_>, error: &Error) -> PyErr {
        raised(py, error, Some(&self.circuit))
    }

    fn carried<T: Send>(
        &mut self,
        py: Python<'_>,
        call: impl FnOnce(&mut Simulation) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        let cancel = Arc::clone(&self.cancel);
        let simulation = self.own();
        let found = released_with(py, &cancel, |_| call(simulation))?;
        found.map_err(|error| self.failed(py, &error))
    }
}

#[pymethods]
impl Course {
    #[getter]
    fn time(&mut self) -> f64 {
        self.own().time()
    }

    /// (time, reason, events as JSON)
    fn advance(
        &mut self,
        py: Python<'_>,
        t: f64,
        to_event: bool,
    ) -> PyResult<(f64, &'static str, String)> {
        let stop = self.carried(py, |simulation| {
            if to_event {
                simulation.advance_to_event(t)
            } else {
                simulation.advance_to(t)
            }
        })?;
        let reason = match stop.reason {
            StopReason::Time => "time",
            StopReason::Event => "event",
        };
        Ok((stop.time, reason, events(&stop.events)))
    }

    fn value(&mut self, py: Python<'_>, probe: &str) -> PyResult<f64> {
        let found = self.own().value(probe);
        found.map_err(|error| self.failed(py, &error))
    }

    fn probes(&mut self) -> Vec<String> {
        self.own().probes().to_vec()
    }

    fn state_names(&mut self) -> Vec<String> {
        self.own().state_names().to_vec()
    }

    fn state<'py>(&mut self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.own().state())
    }

    fn set_source(&mut self, py: Python<'_>, name: &str, value: f64) -> PyResult<()> {
        self.carried(py, |simulation| simulation.set_source(name, value))
            .map(|_| ())
    }

    fn set_switch(&mut self, py: Python<'_>, name: &str, on: bool) -> PyResult<()> {
        self.carried(py, |simulation| simulation.set_switch(name, on))
            .map(|_| ())
    }

    fn checkpoint(&mut self, py: Python<'_>) -> PyResult<Place> {
        let found = self.own().checkpoint();
        found.map(Place).map_err(|error| self.failed(py, &error))
    }

    fn restore(&mut self, py: Python<'_>, place: &Place) -> PyResult<()> {
        self.carried(py, |simulation| simulation.restore(&place.0))
    }
}

#[pymodule]
fn _circ(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add_class::<Core>()?;
    module.add_class::<Course>()?;
    module.add_class::<Place>()?;
    module.add("NetlistError", py.get_type::<NetlistError>())?;
    module.add("SimulationError", py.get_type::<SimulationError>())
}
