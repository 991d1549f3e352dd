//! Runs ngspice on a deck and reads what it says.

pub mod deck;

use std::fs::{self, File};
use std::io;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use self::deck::{Deck, Reading};
use super::cpu;
use crate::waveform::{Waveforms, canonical_name, raw, unit_of};

/// How long one run may take before it is stopped, s of wall clock.
const PATIENCE: Duration = Duration::from_secs(20);
/// How often a running ngspice is looked at.
const GLANCE: Duration = Duration::from_millis(2);
/// Short runs are repeated until they took this much user CPU together, s, or this often: the clock of a process counts in
/// ticks of up to 10 ms, which only a mean gets below.
const REPETITIONS: (f64, usize) = (0.1, 8);
/// Runs of the trivial netlist whose mean is the start-up time.
const START_UPS: usize = 16;
/// What is missing at the end of the time axis, relative to its length, before a run counts as broken off.
const UNFINISHED: f64 = 1e-6;
/// Lines of ngspice that are quoted.
const QUOTED_LINES: usize = 3;

/// What ngspice computed.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Our probes on ngspice's own time points.
    pub waveforms: Waveforms,
    /// User CPU of the whole process, s.
    pub cpu_seconds: f64,
}

/// Why there is no result.
#[derive(Debug, thiserror::Error)]
pub enum NgspiceError {
    /// There is no such program.
    #[error("ngspice is not installed (no program `ngspice` on the search path)")]
    NotInstalled,
    /// It could not be started, or its files not be read.
    #[error("ngspice could not be run: {0}")]
    Io(#[from] io::Error),
    /// It gave up; its own words.
    #[error("ngspice failed: {0}")]
    Failed(String),
}

/// Runs ngspice in batch mode in a directory of its own.
///
/// # Errors
/// See [`NgspiceError`].
pub fn run(deck: &Deck, tstop: f64) -> Result<Outcome, NgspiceError> {
    let directory = tempfile::tempdir()?;
    let (status, cpu_seconds) = execute(&deck.text, directory.path())?;
    let said = words(directory.path());
    let Some(status) = status else {
        return Err(NgspiceError::Failed(format!(
            "no result within {} s; {said}",
            PATIENCE.as_secs()
        )));
    };
    let raw = File::open(directory.path().join("run.raw")).and_then(|file| {
        raw::read(io::BufReader::new(file)).map_err(|e| io::Error::other(e.to_string()))
    });
    let reached = raw.as_ref().ok().and_then(|w| w.time.last().copied());
    match (raw, reached) {
        (Ok(waves), Some(reached)) if status.success() && reached >= tstop * (1.0 - UNFINISHED) => {
            Ok(Outcome {
                waveforms: renamed(&waves, deck)?,
                cpu_seconds,
            })
        }
        (_, Some(reached)) if !said.is_empty() => Err(NgspiceError::Failed(format!(
            "{said} (reached {reached:e} s)"
        ))),
        (_, _) if !said.is_empty() => Err(NgspiceError::Failed(said)),
        (Err(error), _) => Err(NgspiceError::Failed(format!("{status}, {error}"))),
        (Ok(_), reached) => Err(NgspiceError::Failed(format!(
            "{status}, ended at {:e} s",
            reached.unwrap_or(0.0)
        ))),
    }
}

/// As [`run`], with the mean user CPU of repeated runs, s.
///
/// # Errors
/// See [`NgspiceError`].
pub fn timed(deck: &Deck, tstop: f64) -> Result<(Outcome, f64), NgspiceError> {
    let outcome = run(deck, tstop)?;
    let (mut spent, mut runs) = (outcome.cpu_seconds, 1);
    while spent < REPETITIONS.0 && runs < REPETITIONS.1 {
        spent += execute(&deck.text, tempfile::tempdir()?.path())?.1;
        runs += 1;
    }
    Ok((outcome, spent / runs as f64))
}

/// User CPU seconds that ngspice needs to start, read a trivial netlist and end.
///
/// # Errors
/// See [`NgspiceError`].
pub fn start_up() -> Result<f64, NgspiceError> {
    let trivial = "* trivial\nv1 a 0 1\nr1 a 0 1\n.tran 1 1\n.save v(a)\n.end\n";
    let mut spent = 0.0;
    for _ in 0..START_UPS {
        spent += execute(trivial, tempfile::tempdir()?.path())?.1;
    }
    Ok(spent / START_UPS as f64)
}

/// What `ngspice --version` calls itself.
///
/// # Errors
/// See [`NgspiceError`].
pub fn version() -> Result<String, NgspiceError> {
    let output = Command::new("ngspice")
        .arg("--version")
        .output()
        .map_err(start_error)?;
    let text = String::from_utf8_lossy(&output.stdout);
    let named = text
        .split_whitespace()
        .find(|word| word.starts_with("ngspice-"));
    Ok(named.unwrap_or("ngspice").to_owned())
}

/// Runs a deck; its exit status (`None` when it was stopped for taking too long) and user CPU seconds.
fn execute(deck: &str, directory: &Path) -> Result<(Option<ExitStatus>, f64), NgspiceError> {
    fs::write(directory.join("run.cir"), deck)?;
    let before = cpu::of_children()?;
    let child = Command::new("ngspice")
        .args(["-b", "-n", "-r", "run.raw", "run.cir"])
        .current_dir(directory)
        .stdin(Stdio::null())
        .stdout(File::create(directory.join("out.txt"))?)
        .stderr(File::create(directory.join("err.txt"))?)
        .spawn()
        .map_err(start_error)?;
    let status = wait(child)?;
    Ok((status, cpu::of_children()? - before))
}

fn start_error(error: io::Error) -> NgspiceError {
    if error.kind() == io::ErrorKind::NotFound {
        NgspiceError::NotInstalled
    } else {
        NgspiceError::Io(error)
    }
}

fn wait(mut child: Child) -> io::Result<Option<ExitStatus>> {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if start.elapsed() > PATIENCE {
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        std::thread::sleep(GLANCE);
    }
}

/// The lines in which ngspice says what went wrong.
fn words(directory: &Path) -> String {
    let read = |name: &str| fs::read_to_string(directory.join(name)).unwrap_or_default();
    let said = read("err.txt") + &read("out.txt");
    let telling = [
        "error",
        "too small",
        "singular",
        "abort",
        "fail",
        "no convergence",
        "can't",
    ];
    let lines = said.lines().map(after_progress).filter(|line| {
        let line = line.to_lowercase();
        telling.iter().any(|word| line.contains(word))
    });
    lines.take(QUOTED_LINES).collect::<Vec<_>>().join("; ")
}

/// A line without the progress reports that ngspice writes in front of it.
fn after_progress(line: &str) -> &str {
    let at = line
        .rfind("Reference value")
        .and_then(|_| line.find("doAnalyses"));
    at.map_or(line, |at| &line[at..]).trim()
}

/// The deck's probes, taken or computed from ngspice's vectors. The row at t = 0, the operating point before anything that happens
/// at 0, is left out.
fn renamed(waves: &Waveforms, deck: &Deck) -> Result<Waveforms, NgspiceError> {
    let column = |vector: &str| -> Result<Vec<f64>, NgspiceError> {
        if vector == "0" {
            return Ok(vec![0.0; waves.len()]);
        }
        let j = waves.find(vector).ok_or_else(|| {
            let missing = format!(
                "no vector `{}` among {}",
                canonical_name(vector),
                waves.names.join(" ")
            );
            NgspiceError::Failed(missing)
        })?;
        Ok(waves.column(j).collect())
    };
    let mut columns = Vec::new();
    for (_, reading) in &deck.probes {
        columns.push(match reading {
            Reading::Vector(v) => column(v)?,
            Reading::Difference(a, b) => column(a)?
                .iter()
                .zip(column(b)?)
                .map(|(a, b): (&f64, f64)| a - b)
                .collect(),
        });
    }
    let names: Vec<String> = deck.probes.iter().map(|(name, _)| name.clone()).collect();
    let first = usize::from(waves.time.first() == Some(&0.0));
    Ok(Waveforms {
        title: waves.title.clone(),
        units: names.iter().map(|n| unit_of(n)).collect(),
        names,
        time: waves.time[first..].to_vec(),
        values: (first..waves.len())
            .flat_map(|k| columns.iter().map(move |c| c[k]))
            .collect(),
    })
}
