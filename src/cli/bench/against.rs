//! Other programs: ngspice's ladders, and what a file says of any.

use std::path::Path;

use super::{Bench, Reference, errors};
use crate::circuit::{Circuit, Kind};
use crate::cli::args::Realisation;
use crate::cli::exit::Failure;
use crate::cli::input::Subject;
use crate::cli::ngspice::{self, NgspiceError, deck};
use crate::law::Law;
use crate::report::work::{self, Measurement};

/// Values of `reltol`.
const RELTOL: [f64; 4] = [1e-3, 1e-4, 1e-5, 1e-6];
/// Print steps per largest step, refined in turn.
const DIVISORS: [f64; 9] = [0.1, 0.3, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];
/// Steps are not refined further below this RMS error,
const ENOUGH: f64 = 3e-5;
/// nor beyond so many times the CPU time of the cheapest run with a good one,
const DEAR: f64 = 2.0;
const GOOD: f64 = 1e-4;
/// nor beyond so much, s,
const LONGEST: f64 = 0.5;
/// nor where a run costs so many times the one before, and its error is not below this part of the other's,
const MORE: f64 = 1.3;
const LESS: f64 = 0.8;
/// nor after so many failures in a row.
const FAILURES: usize = 4;
/// Rows of the reference that ngspice's own time points are read against, at least.
const ROWS: f64 = 50_000.0;

/// What a file in the columns of [`work::csv`] says of other programs: a ladder for each `method`, one colour for all of a program
/// (what stands before a colon).
pub(super) fn points(path: &Path) -> Result<Vec<Measurement>, Failure> {
    let wrong = |why: String| Failure::told("points", format!("{}: {why}", path.display()));
    let mut reader = csv::Reader::from_path(path).map_err(|e| wrong(e.to_string()))?;
    let columns = reader.headers().map_err(|e| wrong(e.to_string()))?.clone();
    let expected = work::csv(&[]);
    if columns.iter().ne(expected.trim_end().split(',')) {
        return Err(wrong(format!(
            "the columns must be {}",
            expected.trim_end()
        )));
    }
    let mut found = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| wrong(e.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |k: usize| match record[k].parse::<f64>() {
            _ if record[k].is_empty() => Ok(None),
            Ok(x) if x.is_finite() && x >= 0.0 => Ok(Some(x)),
            _ => Err(wrong(format!(
                "line {line}: `{}` is no {}",
                &record[k], &columns[k]
            ))),
        };
        found.push(Measurement {
            circuit: record[0].into(),
            method: record[1].into(),
            series: record[1].split(':').next().unwrap_or_default().into(),
            parameter: record[2].into(),
            steps: number(3)?.unwrap_or(0.0) as u64,
            cpu_seconds: number(4)?.unwrap_or(0.0),
            max_error: number(5)?,
            rms_error: number(6)?,
            reference: record[7].into(),
            failure: record[7].strip_prefix("failed: ").map(str::to_string),
            ..Measurement::default()
        });
    }
    Ok(found)
}

impl Bench<'_> {
    /// ngspice over its settings and its realisations of the diodes.
    pub(super) fn ngspice(&self) -> Result<Vec<Measurement>, Failure> {
        let Subject::Circuit(model) = self.subject else {
            return Err(Failure::told(
                "not-for-system",
                "a system without a circuit has no ngspice deck".into(),
            ));
        };
        let failed = |e: NgspiceError| Failure::told("ngspice", e.to_string());
        let start_up = ngspice::start_up().map_err(failed)?;
        let divisions = (ROWS * self.tran.tstep / (self.tran.tstop - self.tran.tstart))
            .ceil()
            .max(1.0);
        let reference = self.reference(Some(self.tran.tstep / divisions))?;
        let realisations: &[Realisation] = if has_diodes(model.circuit()) {
            &[
                Realisation::Default,
                Realisation::N001,
                Realisation::N0001,
                Realisation::Sidiode,
            ]
        } else {
            &[Realisation::N001]
        };
        let ladders: Vec<(Realisation, &'static str, f64)> = realisations
            .iter()
            .flat_map(|&r| ["gear", "trap"].map(|method| (r, method)))
            .flat_map(|(r, method)| RELTOL.map(|reltol| (r, method, reltol)))
            .collect();
        let bar = self.streams.progress(ladders.len() as u64, "ngspice");
        let mut measurements = Vec::new();
        let mut longest = LONGEST;
        for (realisation, method, reltol) in ladders {
            let most = self.tran.tmax.unwrap_or(f64::INFINITY);
            let mut steps = DIVISORS.map(|d| most.min(self.tran.tstep / d)).to_vec();
            steps.dedup();
            let (mut before, mut failures) = (None, 0);
            for max_step in steps {
                let options = deck::Options {
                    reltol,
                    max_step,
                    method,
                    realisation,
                };
                let measured = self.ngspice_at(model.circuit(), &options, &reference, start_up)?;
                let (cost, error) = (measured.cpu_seconds, measured.rms_error);
                measurements.push(measured);
                let Some(error) = error else {
                    failures += 1;
                    if failures == FAILURES {
                        break;
                    }
                    continue;
                };
                if error <= GOOD {
                    longest = longest.min(DEAR * cost);
                }
                let in_vain = before.is_some_and(|(c, e)| cost > MORE * c && error > LESS * e);
                if error <= ENOUGH || cost > longest || in_vain {
                    break;
                }
                (before, failures) = (Some((cost, error)), 0);
            }
            bar.inc(1);
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
        let deck =
            deck::deck(circuit, options).map_err(|e| Failure::told("ngspice", e.to_string()))?;
        let diodes = options.realisation.name();
        let mut measurement = Measurement {
            circuit: self.circuit.clone(),
            method: format!("ngspice:reltol={:e}", options.reltol),
            series: format!("ngspice {} {diodes}", options.method),
            parameter: format!(
                "method={};maxstep={:e};diodes={diodes}",
                options.method, options.max_step
            ),
            reference: reference.name.clone(),
            ..Measurement::default()
        };
        match ngspice::timed(&deck, self.tran.tstop) {
            Ok((outcome, cpu_seconds)) => {
                // Edges that are vertical here take a little time there.
                let shift = 2.0 * deck::EDGE * self.tran.tstop;
                measurement.steps = outcome.waveforms.len().saturating_sub(1) as u64;
                measurement.cpu_seconds = (cpu_seconds - start_up).max(0.0);
                Ok(measurement.with(errors(&outcome.waveforms, reference, shift)))
            }
            Err(NgspiceError::Failed(words)) => Ok(Measurement {
                failure: Some(words),
                ..measurement
            }),
            Err(error) => Err(Failure::told("ngspice", error.to_string())),
        }
    }
}

fn has_diodes(circuit: &Circuit) -> bool {
    circuit
        .elements
        .iter()
        .any(|e| matches!(e.kind, Kind::Device(Law::Diode { .. })))
}
