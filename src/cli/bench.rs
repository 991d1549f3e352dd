//! `circ bench`.

use std::path::Path;

use serde::Serialize;

use super::args::{BenchArgs, Realisation};
use super::exit::{Exit, Failure};
use super::input::{self, Subject};
use super::ngspice::{self, NgspiceError, deck};
use super::output;
use super::sim::{self, Request};
use super::streams::Streams;
use crate::circuit::{Circuit, Kind, Tran};
use crate::integrate::{Method, Run};
use crate::law::Law;
use crate::report::json;
use crate::report::work::{self, Measurement, Order};
use crate::waveform::Waveforms;
use crate::waveform::compare::{At, compare};

/// Halvings of the print step on the ladder of steps.
const HALVINGS: i32 = 10;
/// No run of more steps.
const MOST_STEPS: f64 = 2e6;
/// Tolerances of the error-controlled ladders.
const TOLERANCES: [f64; 7] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8];
/// The error of implicit Euler is of first order: tighter tolerances cost more than they show.
const EULER_TOLERANCES: usize = 4;
/// Tolerance of the reference where the exact integrator does not apply.
const REFERENCE_TOL: f64 = 1e-10;
/// Short runs are repeated up to so often, or for this many CPU seconds, and the fastest counts.
const REPETITIONS: (u32, f64) = (9, 0.05);
/// ngspice's ladder: `reltol`, and print steps per largest step.
const NGSPICE: [(f64, f64); 7] = [
    (1e-4, 0.1),
    (1e-6, 0.1),
    (1e-3, 1.0),
    (1e-4, 1.0),
    (1e-5, 1.0),
    (1e-6, 1.0),
    (1e-4, 10.0),
];
/// Rows of the reference that ngspice's own time points are read against, at least.
const ROWS: f64 = 50_000.0;
/// Errors below this are rounding and say nothing about the order.
const ROUNDING: f64 = 1e-11;

/// Measures error against run time.
///
/// # Errors
/// See [`Failure`].
pub(super) fn bench(args: &BenchArgs, streams: &Streams) -> Result<Exit, Failure> {
    for path in &args.outputs {
        ending(path)?;
    }
    let subject = input::open(&args.input, &[], streams)?;
    let file = &args.input.file;
    let tran = sim::tran(&subject).ok_or_else(|| {
        Failure::Message(format!(
            "{}: there is no `.tran` to measure",
            file.display()
        ))
    })?;
    let circuit = file
        .file_stem()
        .map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let wanted = |method: &str| args.methods.is_empty() || args.methods.iter().any(|m| m == method);
    let bench = Bench {
        subject: &subject,
        tran,
        circuit,
        streams,
        silent: Streams {
            quiet: true,
            verbose: false,
        },
    };
    let reference = bench.reference(None)?;
    streams.say(format!("errors are against {}", reference.name));
    let mut measurements = Vec::new();
    let mut rungs = rungs(tran);
    rungs.retain(|rung| wanted(rung.method));
    let bar = streams.progress(rungs.len() as u64, "measuring");
    for rung in &rungs {
        measurements.push(bench.measure(rung, &reference));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let against_ngspice = args.against.is_some() || args.methods.iter().any(|m| m == "ngspice");
    if against_ngspice && wanted("ngspice") {
        measurements.extend(bench.ngspice()?);
    }
    report(args, &measurements, streams)?;
    Ok(Exit::Done)
}

/// A method with a setting.
struct Rung {
    /// Its name for `--methods`.
    method: &'static str,
    /// The ladder.
    series: &'static str,
    parameter: String,
    request: Request,
}

/// The ladders of our own methods.
fn rungs(tran: Tran) -> Vec<Rung> {
    let request = |method| Request {
        method,
        theta: None,
        gamma: None,
        step: None,
        tol: None,
        events: false,
    };
    let mut rungs = vec![Rung {
        method: "exact",
        series: "exact",
        parameter: String::new(),
        request: request(Method::Exact),
    }];
    let siconos = Request {
        theta: Some(0.5),
        gamma: Some(1.0),
        ..request(Method::Theta)
    };
    let stepping = [
        (
            "euler",
            "euler-tol",
            request(Method::Euler),
            EULER_TOLERANCES,
        ),
        (
            "theta",
            "theta-tol",
            request(Method::Theta),
            TOLERANCES.len(),
        ),
        ("siconos", "siconos-tol", siconos, 0),
    ];
    for (method, controlled, request, n_tolerances) in stepping {
        for k in 0..=HALVINGS {
            let step = tran.tstep * 0.5f64.powi(k);
            if tran.tstop / step <= MOST_STEPS {
                let request = Request {
                    step: Some(step),
                    ..request.clone()
                };
                rungs.push(Rung {
                    method,
                    series: method,
                    parameter: format!("step={step:e}"),
                    request,
                });
            }
        }
        for tol in TOLERANCES.into_iter().take(n_tolerances) {
            let request = Request {
                tol: Some(tol),
                ..request.clone()
            };
            rungs.push(Rung {
                method,
                series: controlled,
                parameter: format!("tol={tol:e}"),
                request,
            });
        }
    }
    rungs
}

struct Reference {
    name: String,
    waveforms: Waveforms,
}

struct Bench<'a> {
    subject: &'a Subject,
    tran: Tran,
    circuit: String,
    streams: &'a Streams,
    /// For the runs themselves: drawing a progress bar would be measured.
    silent: Streams,
}

impl Bench<'_> {
    /// The exact solution, or where there is none the stepper's at a tight tolerance.
    fn reference(&self, tstep: Option<f64>) -> Result<Reference, Failure> {
        let request = Request {
            method: Method::Exact,
            theta: None,
            gamma: None,
            step: None,
            tol: None,
            events: true,
        };
        if let Ok(run) = sim::run(self.subject, &request, tstep, &self.silent) {
            return Ok(Reference {
                name: "exact".into(),
                waveforms: run.waveforms,
            });
        }
        let request = Request {
            method: Method::Theta,
            tol: Some(REFERENCE_TOL),
            ..request
        };
        let run = sim::run(self.subject, &request, tstep, &self.silent)
            .map_err(|e| Failure::Message(format!("there is no reference: {e}")))?;
        Ok(Reference {
            name: format!("theta tol={REFERENCE_TOL:e}"),
            waveforms: run.waveforms,
        })
    }

    fn measure(&self, rung: &Rung, reference: &Reference) -> Measurement {
        let blank = Measurement {
            circuit: self.circuit.clone(),
            method: rung.method.into(),
            series: rung.series.into(),
            parameter: rung.parameter.clone(),
            steps: 0,
            cpu_seconds: 0.0,
            max_error: None,
            rms_error: None,
            reference: reference.name.clone(),
            failure: None,
        };
        let mut best: Option<Run> = None;
        let mut spent = 0.0;
        for _ in 0..REPETITIONS.0 {
            match sim::run(self.subject, &rung.request, None, &self.silent) {
                Ok(run) => {
                    spent += run.stats.cpu_seconds;
                    if best
                        .as_ref()
                        .is_none_or(|b| run.stats.cpu_seconds < b.stats.cpu_seconds)
                    {
                        best = Some(run);
                    }
                }
                Err(error) => {
                    return Measurement {
                        failure: Some(error.to_string()),
                        ..blank
                    };
                }
            }
            if spent > REPETITIONS.1 {
                break;
            }
        }
        let Some(run) = best else { return blank };
        let errors = errors(&run.waveforms, reference, 0.0);
        Measurement {
            steps: run.stats.steps,
            cpu_seconds: run.stats.cpu_seconds,
            max_error: errors.map(|e| e.0),
            rms_error: errors.map(|e| e.1),
            ..blank
        }
    }

    /// ngspice over its settings and its realisations of the diodes.
    fn ngspice(&self) -> Result<Vec<Measurement>, Failure> {
        let Subject::Circuit(both) = self.subject else {
            return Err(Failure::Message(
                "a system without a circuit has no ngspice deck".into(),
            ));
        };
        let failed = |e: NgspiceError| Failure::Message(e.to_string());
        let start_up = ngspice::start_up().map_err(failed)?;
        let divisions = (ROWS * self.tran.tstep / (self.tran.tstop - self.tran.tstart))
            .ceil()
            .max(1.0);
        let reference = self.reference(Some(self.tran.tstep / divisions))?;
        let realisations: &[Realisation] = if has_diodes(&both.0) {
            &[
                Realisation::Default,
                Realisation::N001,
                Realisation::N0001,
                Realisation::Sidiode,
            ]
        } else {
            &[Realisation::N001]
        };
        let bar = self
            .streams
            .progress((realisations.len() * 2 * NGSPICE.len()) as u64, "ngspice");
        let mut measurements = Vec::new();
        for &realisation in realisations {
            for method in ["gear", "trap"] {
                for (reltol, divisor) in NGSPICE {
                    let longest = self.tran.tmax.unwrap_or(f64::INFINITY);
                    let max_step = longest.min(self.tran.tstep / divisor);
                    let options = deck::Options {
                        reltol,
                        max_step,
                        method,
                        realisation,
                    };
                    let measured = self.ngspice_at(&both.0, &options, &reference, start_up);
                    measurements.push(measured?);
                    bar.inc(1);
                }
            }
        }
        bar.finish_and_clear();
        Ok(measurements)
    }

    fn ngspice_at(
        &self,
        circuit: &Circuit,
        options: &deck::Options,
        reference: &Reference,
        start_up: f64,
    ) -> Result<Measurement, Failure> {
        let deck = deck::deck(circuit, options).map_err(|e| Failure::Message(e.to_string()))?;
        let diodes = options.realisation.name();
        let mut measurement = Measurement {
            circuit: self.circuit.clone(),
            method: format!("ngspice:reltol={:e}", options.reltol),
            series: format!("ngspice {} {diodes}", options.method),
            parameter: format!(
                "method={};maxstep={:e};diodes={diodes}",
                options.method, options.max_step
            ),
            steps: 0,
            cpu_seconds: 0.0,
            max_error: None,
            rms_error: None,
            reference: reference.name.clone(),
            failure: None,
        };
        match ngspice::timed(&deck, self.tran.tstop) {
            Ok((outcome, cpu_seconds)) => {
                // Edges that are vertical here take a little time there.
                let shift = 2.0 * deck::EDGE * self.tran.tstop;
                let errors = errors(&outcome.waveforms, reference, shift);
                measurement.steps = outcome.waveforms.len().saturating_sub(1) as u64;
                measurement.cpu_seconds = (cpu_seconds - start_up).max(0.0);
                measurement.max_error = errors.map(|e| e.0);
                measurement.rms_error = errors.map(|e| e.1);
            }
            Err(NgspiceError::Failed(words)) => measurement.failure = Some(words),
            Err(error) => return Err(Failure::Message(error.to_string())),
        }
        Ok(measurement)
    }
}

fn has_diodes(circuit: &Circuit) -> bool {
    circuit
        .elements
        .iter()
        .any(|e| matches!(e.kind, Kind::Device(Law::Diode { .. })))
}

/// Largest maximum and RMS error over the signals; edges may stand `shift` seconds off.
fn errors(waves: &Waveforms, reference: &Reference, shift: f64) -> Option<(f64, f64)> {
    let found = compare(waves, &reference.waveforms, At::FirstRows, shift).ok()?;
    let max =
        |s: &crate::waveform::compare::SignalError| if shift > 0.0 { s.shifted } else { s.max };
    Some((
        found.signals.iter().map(max).fold(0.0, f64::max),
        found.worst_rms(),
    ))
}

/// The observed orders of the fixed-step ladders.
fn orders(measurements: &[Measurement]) -> Vec<Order> {
    ["euler", "theta", "siconos"]
        .into_iter()
        .filter_map(|series| {
            let rungs = || measurements.iter().filter(move |m| m.series == series);
            let slope = |error: fn(&Measurement) -> Option<f64>| {
                let points: Vec<(f64, f64)> = rungs()
                    .filter_map(|m| {
                        let step: f64 = m.parameter.strip_prefix("step=")?.parse().ok()?;
                        let error = error(m).filter(|e| *e > ROUNDING)?;
                        Some((step.ln(), error.ln()))
                    })
                    .collect();
                least_squares_slope(&points)
            };
            let (max, rms) = slope(|m| m.max_error).zip(slope(|m| m.rms_error))?;
            Some(Order {
                series: series.into(),
                max,
                rms,
            })
        })
        .collect()
}

/// The slope of the straight line nearest to at least three points.
fn least_squares_slope(points: &[(f64, f64)]) -> Option<f64> {
    if points.len() < 3 {
        return None;
    }
    let n = points.len() as f64;
    let (x, y) = points
        .iter()
        .fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |(xy, xx), p| {
        (xy + (p.0 - x) * (p.1 - y), xx + (p.0 - x) * (p.0 - x))
    });
    (xx > 0.0).then(|| xy / xx)
}

fn ending(path: &Path) -> Result<String, Failure> {
    let ending = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase())
        .unwrap_or_default();
    match ending.as_str() {
        "csv" | "json" | "svg" | "png" => Ok(ending),
        _ => Err(output::unknown_ending(path, "csv, json, svg or png")),
    }
}

#[derive(Serialize)]
struct Document<'a> {
    measurements: &'a [Measurement],
    orders: &'a [Order],
}

fn report(
    args: &BenchArgs,
    measurements: &[Measurement],
    streams: &Streams,
) -> Result<(), Failure> {
    let orders = orders(measurements);
    for path in &args.outputs {
        match ending(path)?.as_str() {
            "csv" => output::bytes_to_file(path, work::csv(measurements).as_bytes())?,
            "json" => {
                let document = Document {
                    measurements,
                    orders: &orders,
                };
                output::bytes_to_file(path, (json::line(&document) + "\n").as_bytes())?;
            }
            _ => output::picture_to_file(path, &work::draw(measurements)?)?,
        }
    }
    let table = work::text(measurements, &orders);
    if !args.outputs.is_empty() {
        streams.say(table);
    } else if streams.out_is_terminal() {
        streams.data(table)?;
    } else {
        streams.data(work::csv(measurements))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_is_the_slope() {
        let points: Vec<(f64, f64)> = (0..5)
            .map(|k| (f64::from(k), 3.0 + 2.0 * f64::from(k)))
            .collect();
        assert_eq!(least_squares_slope(&points), Some(2.0));
        assert_eq!(least_squares_slope(&points[..2]), None);
    }

    #[test]
    fn ladders_halve_the_print_step_and_stay_affordable() {
        let tran = Tran {
            tstep: 1e-6,
            tstop: 0.1,
            tstart: 0.0,
            tmax: None,
            uic: false,
        };
        let rungs = rungs(tran);
        let steps: Vec<f64> = rungs
            .iter()
            .filter(|r| r.series == "euler")
            .filter_map(|r| r.request.step)
            .collect();
        assert_eq!(steps, [1e-6, 5e-7, 2.5e-7, 1.25e-7, 6.25e-8]);
    }
}
