//! `circ compare`.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::{Map, Value};

use super::args::{self, CompareArgs};
use super::exit::{Exit, Failure};
use super::files;
use super::input::{self, Subject};
use super::ngspice::{self, deck};
use super::output;
use super::request::{self, Request};
use super::streams::Streams;
use super::view;
use crate::analysis::{shortest_period, steps};
use crate::circuit::Tran;
use crate::integrate::Method;
use crate::model::Model;
use crate::report::figure::{Figure, PANEL_COLUMNS};
use crate::report::html::Page;
use crate::report::{json, steps, svg, text};
use crate::waveform::compare::{At, Comparison, compare as compare_waveforms, difference};
use crate::waveform::{Plot, Waveforms, plots};

/// Rows of our side at least, so that straight lines between them do not count as error.
const ROWS: f64 = 20_000.0;
/// ngspice's `reltol` and `method`, the most accurate first: its own error should not be what is seen, but often only
/// looser settings bring it through a circuit with ideal devices.
const SETTINGS: [(f64, &str); 5] = [
    (1e-5, "gear"),
    (1e-4, "gear"),
    (1e-4, "trap"),
    (1e-3, "gear"),
    (1e-3, "trap"),
];
/// Steps of ngspice in each period of the fastest source at least.
const STEPS_A_PERIOD: f64 = 64.0;
/// Tolerance of our steppers where the exact integrator does not run, for the same reason.
const TOL: f64 = 1e-6;
/// Print steps by which edges may be shifted against ngspice (at least one of our rows: between rows we are straight lines).
const SHIFT: f64 = 0.1;
/// Signals drawn, the worst first.
const DRAWN: usize = 3;

/// Compares a simulation with ngspice's or with a file; status 1 outside the tolerance. With `.step` every run is compared
/// with ngspice's.
///
/// # Errors
/// See [`Failure`].
pub(super) fn compare(args: &CompareArgs, streams: &Streams) -> Result<Exit, Failure> {
    let written = args.outputs.iter().chain(&args.keep);
    let outputs: Vec<&Path> = written.map(PathBuf::as_path).collect();
    if !with_ngspice(args) {
        files::spare(&outputs, [args.against.as_path()])?;
    }
    let drawn = |path: &&PathBuf| has_ending(path, &["svg", "png", "html", "htm"]);
    if let Some(path) = args.outputs.iter().find(|path| !drawn(path)) {
        return Err(output::unknown_ending(path, "svg, png or html"));
    }
    let subject = input::open(&args.input, &[], &outputs, streams)?;
    if let Subject::Circuit(model) = &subject
        && !model.circuit().steps.is_empty()
    {
        if with_ngspice(args) {
            return every(args, model, streams);
        }
        streams.note(
            "left-out",
            "`.step` is left out: the file is compared with the values as they stand",
        );
    }
    let found = Found::of(args, &subject, streams)?;
    for path in &args.outputs {
        draw(path, &found, &found.verdict(args))?;
    }
    found.tell_notes(streams);
    if args.json {
        streams.data(json::line(&found.document(args)) + "\n")?;
    } else {
        streams.data(text::comparison(&found.comparison))?;
        streams.say(found.verdict(args));
    }
    Ok(exit(found.within))
}

fn with_ngspice(args: &CompareArgs) -> bool {
    args.against.to_str() == Some("ngspice")
}

const fn exit(within: bool) -> Exit {
    if within { Exit::Done } else { Exit::No }
}

/// The comparisons of all runs of `.step`.
fn every(args: &CompareArgs, model: &Model, streams: &Streams) -> Result<Exit, Failure> {
    if !args.outputs.is_empty() || args.keep.is_some() {
        let message = "`-o` and `--keep` take one run, and `.step` asks for several";
        return Err(Failure::told(
            "option-conflict",
            format!("{}: {message}", args.input.file.display()),
        ));
    }
    let (mut done, mut failures) = (Vec::new(), Vec::new());
    for variant in steps(model) {
        let values = variant.named();
        let label = steps::label(&values);
        let model = input::variant(&args.input, &variant, streams)?;
        let found = match Found::of(args, &Subject::Circuit(Box::new(model)), streams) {
            Ok(found) => found,
            Err(failure) => {
                failures.push(format!("{failure} at {label}"));
                continue;
            }
        };
        if !args.json {
            streams.data(format!(
                "{label}\n{}\n",
                text::comparison(&found.comparison)
            ))?;
            streams.say(format!("{label}: {}", found.verdict(args)));
        }
        found.tell_notes(streams);
        done.push((values, found));
    }
    let within = done.iter().all(|(_, found)| found.within);
    if args.json {
        let steps = done.iter().map(|(values, found)| Step {
            values: values
                .iter()
                .map(|(n, v)| (n.clone(), (*v).into()))
                .collect(),
            document: found.document(args),
        });
        let document = Steps {
            tol: args.tol,
            within,
            steps: steps.collect(),
        };
        streams.data(json::line(&document) + "\n")?;
    }
    if failures.is_empty() {
        Ok(exit(within))
    } else {
        Err(Failure::told("failed-runs", failures.join("\nerror: ")))
    }
}

/// Both sides of a run, and how far they are apart.
struct Found {
    ours: Waveforms,
    theirs: Theirs,
    comparison: Comparison,
    within: bool,
}

impl Found {
    fn of(args: &CompareArgs, subject: &Subject, streams: &Streams) -> Result<Self, Failure> {
        let tran = subject.tran().ok_or_else(|| {
            Failure::told(
                "no-analysis",
                format!(
                    "{}: there is no `.tran` to compare",
                    args.input.file.display()
                ),
            )
        })?;
        let theirs = if with_ngspice(args) {
            from_ngspice(args, subject, tran, streams)?
        } else {
            from_file(&args.against)?
        };
        let ours = simulated(args, subject, tran, streams)?;
        let shift = args.shift.unwrap_or(theirs.shift);
        let comparison = compare_waveforms(&ours, &theirs.waveforms, At::ReferenceRows, shift)?;
        let within = comparison.signals.iter().all(|s| s.shifted <= args.tol);
        Ok(Self {
            ours,
            theirs,
            comparison,
            within,
        })
    }

    fn document(&self, args: &CompareArgs) -> Document<'_> {
        Document {
            against: &self.theirs.name,
            tol: args.tol,
            within: self.within,
            notes: &self.theirs.notes,
            comparison: &self.comparison,
        }
    }

    fn verdict(&self, args: &CompareArgs) -> String {
        let verdict = if self.within { "within" } else { "outside" };
        format!(
            "{verdict} the tolerance of {:e}, against {}",
            args.tol, self.theirs.name
        )
    }

    fn tell_notes(&self, streams: &Streams) {
        for note in &self.theirs.notes {
            streams.note("ngspice", note);
        }
    }
}

#[derive(Serialize)]
struct Document<'a> {
    against: &'a str,
    tol: f64,
    within: bool,
    notes: &'a [String],
    #[serde(flatten)]
    comparison: &'a Comparison,
}

#[derive(Serialize)]
struct Steps<'a> {
    tol: f64,
    within: bool,
    steps: Vec<Step<'a>>,
}

#[derive(Serialize)]
struct Step<'a> {
    values: Map<String, Value>,
    #[serde(flatten)]
    document: Document<'a>,
}

/// The other side.
struct Theirs {
    name: String,
    waveforms: Waveforms,
    shift: f64,
    notes: Vec<String>,
}

fn from_ngspice(
    args: &CompareArgs,
    subject: &Subject,
    tran: Tran,
    streams: &Streams,
) -> Result<Theirs, Failure> {
    let Subject::Circuit(model) = subject else {
        let message = "a system without a circuit has no ngspice deck; compare it with a file";
        return Err(Failure::told(
            "not-for-system",
            format!("{}: {message}", args.input.file.display()),
        ));
    };
    let failed = |e: ngspice::NgspiceError| Failure::told("ngspice", e.to_string());
    let version = ngspice::version().map_err(failed)?;
    let bar = streams.progress(SETTINGS.len() as u64, &version);
    let mut first_failure = None;
    for (reltol, method) in SETTINGS {
        let options = deck::Options {
            reltol,
            max_step: longest_step(model, tran),
            method,
            realisation: args.realisation,
        };
        let deck = deck::deck(model.circuit(), &options)
            .map_err(|e| Failure::told("ngspice", e.to_string()))?;
        if let Some(path) = &args.keep {
            files::write(path, deck.text.as_bytes())?;
        }
        match ngspice::run(&deck, tran.tstop) {
            Ok(outcome) => {
                bar.finish_and_clear();
                let name = format!("{version} reltol={reltol:e} method={method}");
                let mut notes = deck.notes;
                notes.extend(first_failure.map(|e| format!("with tighter settings {e}")));
                return Ok(Theirs {
                    name,
                    waveforms: outcome.waveforms,
                    shift: (SHIFT * tran.tstep).max((tran.tstop - tran.tstart) / ROWS),
                    notes,
                });
            }
            Err(error @ ngspice::NgspiceError::Failed(_)) => {
                first_failure.get_or_insert(error);
            }
            Err(error) => return Err(failed(error)),
        }
        bar.inc(1);
    }
    Err(first_failure.map_or_else(
        || Failure::told("ngspice", "ngspice was not run".into()),
        failed,
    ))
}

/// The longest step of ngspice, which looks for no events: it steps over what switches within a period.
fn longest_step(model: &Model, tran: Tran) -> f64 {
    let asked = tran.tmax.unwrap_or(f64::INFINITY).min(tran.tstep);
    asked.min(shortest_period(model) / STEPS_A_PERIOD)
}

fn from_file(path: &Path) -> Result<Theirs, Failure> {
    let bytes = fs::read(path).map_err(|e| Failure::file(path, e))?;
    let plots = plots(&bytes).map_err(|error| Failure::Waveforms {
        path: path.to_owned(),
        error,
    })?;
    let runs = plots.into_iter().find_map(|plot| match plot {
        Plot::Time(runs) => Some(runs),
        Plot::Frequency(_) | Plot::Swept(..) => None,
    });
    let [(_, waveforms)] = <[_; 1]>::try_from(runs.unwrap_or_default()).map_err(|runs| {
        let file = path.display();
        Failure::told(
            "waveforms",
            match runs.len() {
                0 => format!("{file}: holds nothing over time"),
                count => format!("{file}: holds {count} runs; a comparison takes one"),
            },
        )
    })?;
    if let Some(gaps) = view::gaps([&waveforms]) {
        let (file, help) = (path.display(), "a comparison takes a file without gaps");
        return Err(Failure::told(
            "waveforms",
            format!("{file}: {gaps}; {help}"),
        ));
    }
    Ok(Theirs {
        name: path.display().to_string(),
        waveforms,
        shift: 0.0,
        notes: Vec::new(),
    })
}

/// Our side on a grid fine enough to be read at any time, with rows at events.
fn simulated(
    args: &CompareArgs,
    subject: &Subject,
    tran: Tran,
    streams: &Streams,
) -> Result<Waveforms, Failure> {
    let method = match args.integration.method {
        args::Method::Auto => Method::Auto,
        args::Method::Exact => Method::Exact,
        args::Method::Euler => Method::Euler,
        args::Method::Theta => Method::Theta,
    };
    let step = args.integration.step;
    let request = Request {
        method,
        theta: None,
        gamma: None,
        step,
        tol: Some(TOL),
        events: true,
        unestimated: true,
        most_steps: None,
    };
    let divisions = (ROWS * tran.tstep / (tran.tstop - tran.tstart))
        .ceil()
        .max(1.0);
    let run = request::run(subject, &request, Some(tran.tstep / divisions), streams)
        .map_err(|error| input::broke_off(&args.input, &error, subject.places(), streams))?;
    streams.notes(subject.places(), &run.notes);
    Ok(run.waveforms)
}

/// The worst signals on both sides, with their difference.
fn draw(path: &Path, found: &Found, verdict: &str) -> Result<(), Failure> {
    let (ours, theirs) = (&found.ours, &found.theirs);
    let mut worst: Vec<_> = found.comparison.signals.iter().collect();
    worst.sort_by(|a, b| b.max.total_cmp(&a.max));
    let names: Vec<String> = worst.iter().take(DRAWN).map(|s| s.name.clone()).collect();
    let delta = difference(ours, &theirs.waveforms)?;
    let label = theirs.name.split(' ').next().unwrap_or("reference");
    let is_page = has_ending(path, &["html", "htm"]);
    let pixels = if is_page { usize::MAX } else { PANEL_COLUMNS };
    let figure = Figure::of_comparison(ours, &theirs.waveforms, &delta, label, &names, pixels);
    if is_page {
        let page = Page::of_comparison(&figure, &found.comparison, verdict);
        return files::write(path, page.html()?.as_bytes());
    }
    output::picture_to_file(path, has_ending(path, &["png"]), &svg::draw(&figure)?)
}

fn has_ending(path: &Path, known: &[&str]) -> bool {
    let ending = path.extension().unwrap_or_default();
    known.iter().any(|known| ending.eq_ignore_ascii_case(known))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_ngspice_resolve_the_fastest_source() {
        let step = |source: &str, tran: &str| {
            let text = format!("steps\nv1 a 0 {source}\nr1 a 0 1k\n.tran {tran}\n.end\n");
            let model = Model::parse(&text, "steps.cir").unwrap();
            longest_step(&model, model.circuit().tran.unwrap())
        };
        // A print step of a period, as 1,000 rows may have, and ones that are short enough.
        let saw = "pulse(0 1 0 9.8u 0.1u 0.1u 10u)";
        assert!((step(saw, "10u 20m") - 10e-6 / 64.0).abs() < 1e-18);
        assert_eq!(step(saw, "10u 20m 0 100n"), 100e-9);
        assert_eq!(step("5", "10u 20m"), 10e-6);
    }
}
