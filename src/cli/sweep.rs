//! `circ sweep`: a row of measurements for every combination of values and every sample.

use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::Path;

use super::args::SweepArgs;
use super::exit::{Exit, Failure};
use super::files::Written;
use super::input;
use super::signals::Signals;
use super::streams::Streams;
use crate::analysis::{
    self, Row, SweepOptions, Variant, drawn_names, measured_names, samples, variants,
};
use crate::circuit::Sweep;
use crate::integrate::Error;
use crate::model::Model;
use crate::settings::Settings;
use crate::waveform::{csv, npz};

/// Most runs of one sweep.
const MOST: usize = 10_000_000;

/// Runs, writes and tells.
///
/// # Errors
/// See [`Failure`]; variants that fail are rows, and their number is told.
pub(super) fn sweep(args: &SweepArgs, streams: &Streams) -> Result<Exit, Failure> {
    let out = vec!["-".into()];
    let outputs = if args.outputs.is_empty() {
        &out
    } else {
        &args.outputs
    };
    let paths: Vec<&Path> = outputs.iter().map(AsRef::as_ref).collect();
    let mut base = args.input.clone();
    if args.mc.is_some() {
        base.random.sample = Some(0);
    }
    let subject = input::open(&base, &[], &paths, streams)?;
    let model = input::model_of(&base, &subject)?;
    let fail = |error: Error| match error.reason {
        _ if model.netlist().is_none() => Failure::of_run("", &error),
        _ => Failure::of_run(&format!("{}: ", args.input.file.display()), &error),
    };
    let sweeps =
        sweeps(args, model).map_err(|error| input::refused(&args.input, &error, streams))?;
    let runs = sweeps.iter().map(|sweep| sweep.values.len());
    let runs = runs.chain(args.mc.map(|n| usize::try_from(n).unwrap_or(usize::MAX)));
    if runs.fold(1, usize::saturating_mul) > MOST {
        return Err(Failure::told(
            "too-many-runs",
            format!("more than {MOST} runs; take fewer values or samples"),
        ));
    }
    let mut all = variants(model, &sweeps);
    if let Some(count) = args.mc {
        if !model.circuit().random && drawn_names(model).is_empty() {
            return Err(Failure::told("nothing-random", "--mc: nothing is random: name a tolerance by `tol=5` on a card, --tol-of or --sigma-of, or write `{mc(1k, 0.05)}`".into()));
        }
        all = samples(&all, count);
    }
    // A mistake in a name is one in every variant.
    if let Some(first) = all.first() {
        input::variant(&args.input, first, streams)?;
    }
    let measured = measured_names(model, &args.of).map_err(fail)?;
    let drawn = if args.mc.is_some() {
        drawn_names(model)
    } else {
        vec![]
    };
    let signals = Signals::watch()?;
    let mut settings = Settings::default();
    if let Some(tol) = args.tol {
        settings.tol = tol;
    }
    let options = SweepOptions {
        of: measured.clone(),
        steady: args.pss,
        settings,
        cancel: Some(signals.flag()),
    };
    let mut table = Table {
        names: [
            sweeps
                .iter()
                .rev()
                .map(|s| s.what.name().to_string())
                .collect(),
            args.mc.map(|_| "sample".to_string()).into_iter().collect(),
            drawn,
            measured,
        ],
        rows: 0,
        failed: 0,
        sums: vec![],
        columns: vec![],
    };
    let mut written = outputs
        .iter()
        .map(|path| Output::create(path))
        .collect::<Result<Vec<_>, _>>()?;
    if written.iter().any(|output| output.form == Form::Npz) {
        table.columns = vec![vec![]; table.names().count()];
    }
    for output in &mut written {
        output.header(&table)?;
    }
    let bar = streams.progress(all.len() as u64, "sweeping");
    let mut failure = None;
    let ended = analysis::sweep(&all, &options, |row| {
        bar.inc(1);
        let entry = table.entry(&all[row.index], row);
        match written.iter_mut().try_for_each(|o| o.entry(&table, &entry)) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                failure = Some(error);
                ControlFlow::Break(())
            }
        }
    });
    bar.finish_and_clear();
    if let Some(failure) = failure {
        return Err(failure);
    }
    for output in written {
        output.finish(&table)?;
    }
    if let Err(error) = ended {
        let Some((signal, name)) = signals.received() else {
            return Err(fail(error));
        };
        let (file, done) = (args.input.file.display(), table.rows);
        let text = format!(
            "{file}: interrupted by {name}: {done} of {} runs are done",
            all.len()
        );
        streams.error(text);
        return Ok(Exit::Signal(signal));
    }
    if args.mc.is_some() {
        streams.say(table.statistics().trim_end());
    }
    if table.failed > 0 {
        let text = format!(
            "{} of {} runs failed: the column `error` says why",
            table.failed, table.rows
        );
        streams.warning("failed-runs", text);
    }
    Ok(Exit::Done)
}

/// The sweeps that the command line names, the last one innermost, as loops that are written one below the other; else those of `.step`.
fn sweeps(args: &SweepArgs, model: &Model) -> Result<Vec<Sweep>, Error> {
    let several = args
        .input
        .params
        .iter()
        .rev()
        .filter(|p| p.values.len() > 1);
    let sweeps: Vec<Sweep> = several
        .map(|given| {
            let what = model.swept(&given.name)?;
            let values = given.values.clone();
            Ok(Sweep { what, values })
        })
        .collect::<Result<_, Error>>()?;
    let of_cards = &model.circuit().steps;
    Ok(if sweeps.is_empty() {
        of_cards.clone()
    } else {
        sweeps
    })
}

/// What the rows have in common, and what they add up to.
struct Table {
    /// Names of what is swept, of the sample, of what is drawn, of what is measured.
    names: [Vec<String>; 4],
    rows: usize,
    failed: usize,
    /// Of each measurement: how many, mean, sum of squared deviations, least, greatest.
    sums: Vec<(usize, f64, f64, f64, f64)>,
    /// All values, for files that are written as columns.
    columns: Vec<Vec<f64>>,
}

/// A row, in the order of the names; none where there is no value.
struct Entry {
    values: Vec<Option<f64>>,
    error: String,
}

impl Table {
    fn names(&self) -> impl Iterator<Item = &String> {
        self.names.iter().flatten()
    }

    /// The row of a variant.
    fn entry(&mut self, variant: &Variant<'_>, row: Row) -> Entry {
        self.rows += 1;
        self.failed += usize::from(row.failed.is_some());
        self.sums.resize(
            row.measured.len(),
            (0, 0.0, 0.0, f64::INFINITY, f64::NEG_INFINITY),
        );
        for (sum, value) in self.sums.iter_mut().zip(&row.measured) {
            let Some(value) = *value else { continue };
            let (count, mean, squares, least, greatest) = *sum;
            let deviation = value - mean;
            let mean = mean + deviation / (count + 1) as f64;
            let squares = squares + deviation * (value - mean);
            *sum = (
                count + 1,
                mean,
                squares,
                least.min(value),
                greatest.max(value),
            );
        }
        let mut values: Vec<_> = variant.values().iter().rev().copied().map(Some).collect();
        if !self.names[1].is_empty() {
            values.push(variant.sample().map(|k| k as f64));
        }
        if !self.names[2].is_empty() {
            values.extend(row.drawn);
        }
        values.extend(row.measured);
        for (column, value) in self.columns.iter_mut().zip(&values) {
            column.push(value.unwrap_or(f64::NAN));
        }
        let error = row.failed.unwrap_or_default();
        Entry { values, error }
    }

    /// A line for each measurement.
    fn statistics(&self) -> String {
        let mut text = String::new();
        for (name, (count, mean, squares, least, greatest)) in self.names[3].iter().zip(&self.sums)
        {
            let deviation = (squares / (count.saturating_sub(1).max(1)) as f64).sqrt();
            text += &match count {
                0 => format!("{name}: no value\n"),
                _ => format!(
                    "{name}: mean {mean:.6e}, standard deviation {deviation:.3e}, from {least:.6e} to {greatest:.6e}, {count} values\n"
                ),
            };
        }
        text
    }
}

/// A file of rows.
struct Output {
    file: Written,
    form: Form,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    Csv,
    JsonLines,
    /// Columns, written at the end.
    Npz,
}

impl Output {
    fn create(path: &Path) -> Result<Self, Failure> {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("csv");
        let form = match ending.to_ascii_lowercase().as_str() {
            "csv" => Form::Csv,
            "jsonl" => Form::JsonLines,
            "npz" => Form::Npz,
            _ => {
                return Err(Failure::told(
                    "output-format",
                    format!(
                        "{}: rows of a sweep are written as csv, jsonl or npz",
                        path.display()
                    ),
                ));
            }
        };
        let file = Written::create(path)?;
        if form == Form::Npz && !file.can_seek() {
            return Err(Failure::told(
                "output-format",
                format!("{}: npz is written to files alone", path.display()),
            ));
        }
        Ok(Self { file, form })
    }

    fn header(&mut self, table: &Table) -> Result<(), Failure> {
        if self.form != Form::Csv {
            return Ok(());
        }
        let names = table.names().map(String::as_str).chain(["error"]);
        let line = names.collect::<Vec<_>>().join(",") + "\n";
        self.append(line.as_bytes())
    }

    fn append(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        self.file
            .append(bytes)
            .map_err(|error| self.file.failure(error))
    }

    fn entry(&mut self, table: &Table, entry: &Entry) -> Result<(), Failure> {
        let line = match self.form {
            Form::Csv => {
                let mut cells = Vec::new();
                for value in &entry.values {
                    if let Some(value) = value {
                        csv::cell(*value, &mut cells);
                    }
                    cells.push(b',');
                }
                let mut line = String::from_utf8_lossy(&cells).into_owned();
                if !entry.error.is_empty() {
                    line += &format!("\"{}\"", entry.error.replace('"', "\"\""));
                }
                line
            }
            Form::JsonLines => {
                let pairs = table.names().zip(&entry.values);
                let mut object: serde_json::Map<_, _> = pairs
                    .map(|(name, value)| (name.clone(), (*value).into()))
                    .collect();
                if !entry.error.is_empty() {
                    object.insert("error".into(), entry.error.as_str().into());
                }
                serde_json::Value::from(object).to_string()
            }
            Form::Npz => return Ok(()),
        };
        self.append((line + "\n").as_bytes())
    }

    fn finish(mut self, table: &Table) -> Result<(), Failure> {
        if self.form == Form::Npz {
            let names = table.names().map(String::as_str);
            let mut bytes = io::Cursor::new(vec![]);
            npz::write_columns(
                &mut bytes,
                names.zip(table.columns.iter().map(Vec::as_slice)),
            )?;
            let written = self.file.write_all(bytes.get_ref());
            written.map_err(|error| self.file.failure(error))?;
        }
        self.file.finish()
    }
}
