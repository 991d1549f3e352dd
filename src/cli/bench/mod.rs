//! `circ bench`.

mod against;
mod ladder;
mod order;

use std::path::{Path, PathBuf};

use serde::Serialize;

use self::ladder::{Rung, rungs};
use self::order::orders;
use super::args::BenchArgs;
use super::exit::{Exit, Failure};
use super::files::{self, STDOUT};
use super::input::{self, Subject};
use super::output;
use super::request::{self, Request};
use super::streams::Streams;
use crate::circuit::Tran;
use crate::integrate::{Method, Run};
use crate::report::html::Page;
use crate::report::json;
use crate::report::work::{self, Measurement, Order, SignalError};
use crate::waveform::Waveforms;
use crate::waveform::compare::{self, At, compare};

/// Tolerance of the reference where the exact integrator does not apply.
const REFERENCE_TOL: f64 = 1e-10;
/// Short runs are repeated up to so often, or for this many CPU seconds, and the fastest counts.
const REPETITIONS: (u32, f64) = (9, 0.05);

/// Measures error against run time.
///
/// # Errors
/// See [`Failure`].
pub(super) fn bench(args: &BenchArgs, streams: &Streams) -> Result<Exit, Failure> {
    for path in &args.outputs {
        ending(path, args)?;
    }
    if let Some(path) = &args.signals
        && ending(path, args)? != "csv"
    {
        return Err(output::unknown_ending(path, "csv"));
    }
    let kept = args.against.iter().map(PathBuf::as_path);
    let outputs: Vec<&Path> = args
        .outputs
        .iter()
        .chain(&args.signals)
        .map(PathBuf::as_path)
        .collect();
    files::spare(&outputs, kept)?;
    let subject = input::open_as_it_stands(&args.input, &outputs, streams)?;
    let file = &args.input.file;
    let tran = subject.tran().ok_or_else(|| {
        Failure::told(
            "no-analysis",
            format!("{}: there is no `.tran` to measure", file.display()),
        )
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
            ..*streams
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
    let is_ngspice = |program: &PathBuf| program.as_path() == Path::new("ngspice");
    let against_ngspice =
        args.against.iter().any(is_ngspice) || args.methods.iter().any(|m| m == "ngspice");
    if against_ngspice && wanted("ngspice") {
        measurements.extend(bench.ngspice()?);
    }
    for path in args.against.iter().filter(|program| !is_ngspice(program)) {
        measurements.extend(against::points(path)?);
    }
    report(args, &measurements, streams)?;
    Ok(Exit::Done)
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
            unestimated: true,
            most_steps: None,
        };
        if let Ok(run) = request::run(self.subject, &request, tstep, &self.silent) {
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
        let run = request::run(self.subject, &request, tstep, &self.silent)
            .map_err(|e| Failure::told("no-reference", format!("there is no reference: {e}")))?;
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
            reference: reference.name.clone(),
            ..Measurement::default()
        };
        let mut best: Option<Run> = None;
        let mut spent = 0.0;
        for _ in 0..REPETITIONS.0 {
            match request::run(self.subject, &rung.request, rung.rows, &self.silent) {
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
        Measurement {
            steps: run.stats.steps,
            cpu_seconds: run.stats.cpu_seconds,
            energy_residual: Some(run.energy.residual_relative),
            ..blank
        }
        .with(errors(&run.waveforms, reference, 0.0))
    }
}

/// The errors of every signal; edges may stand `shift` seconds off.
fn errors(waves: &Waveforms, reference: &Reference, shift: f64) -> Vec<SignalError> {
    let Ok(found) = compare(waves, &reference.waveforms, At::FirstRows, shift) else {
        return Vec::new();
    };
    let error = |s: compare::SignalError| {
        let (max_error, max_time) = if shift > 0.0 {
            (s.shifted, s.shifted_time)
        } else {
            (s.max, s.max_time)
        };
        SignalError {
            name: s.name,
            unit: s.unit,
            amplitude: s.amplitude,
            max_error,
            max_time,
            rms_error: s.rms,
        }
    };
    found.signals.into_iter().map(error).collect()
}

/// What the ending names, or was asked for of standard output.
fn ending(path: &Path, args: &BenchArgs) -> Result<String, Failure> {
    if path == Path::new(STDOUT) {
        return Ok(args.format.clone().unwrap_or_else(|| "csv".into()));
    }
    let ending = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase())
        .unwrap_or_default();
    match ending.as_str() {
        "csv" | "json" | "svg" | "png" | "html" => Ok(ending),
        _ => Err(output::unknown_ending(path, "csv, json, svg, png or html")),
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
        match ending(path, args)?.as_str() {
            "csv" => files::write(path, work::csv(measurements).as_bytes())?,
            "json" => {
                let document = Document {
                    measurements,
                    orders: &orders,
                };
                files::write(path, (json::line(&document) + "\n").as_bytes())?;
            }
            "html" => {
                let title = args.input.file.display().to_string();
                let page = Page::of_measurements(&title, measurements).html()?;
                files::write(path, page.as_bytes())?;
            }
            ending => {
                output::picture_to_file(path, ending == "png", &work::draw(measurements)?)?;
            }
        }
    }
    if let Some(path) = &args.signals {
        files::write(path, work::signals_csv(measurements).as_bytes())?;
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
