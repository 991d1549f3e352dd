//! The error that a run states beside its true one.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};

use circ::Model;
use circ::circuit::{Kind, Tran};
use circ::integrate::{Method, Run, SimOptions, simulate};
use circ::settings::Settings;
use circ::waveform::Waveforms;

use crate::circuit::{Part, wholly_coupled};
use crate::networks::network;
use crate::random::Random;
use crate::topologies::{self, Style};

/// A way to run, and the circuits it is measured on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Setting {
    pub(crate) name: &'static str,
    pub(crate) method: Method,
    /// Steps over the span, at least and at most; chosen by the error where there are none.
    pub(crate) steps: Option<(f64, f64)>,
    pub(crate) tol: f64,
    /// Exponential diodes; else straight pieces.
    pub(crate) curved: bool,
}

/// What was found of one circuit.
#[derive(Debug, Clone)]
pub(crate) enum Found {
    Error {
        stated: Option<f64>,
        truth: f64,
        /// Where.
        place: String,
        /// CPU time over that of the run without an estimate.
        cost: (f64, f64),
    },
    /// No answer to compare with, or a circuit that the ideal model leaves open: why.
    Nothing(&'static str),
    /// The run failed.
    Refused(String),
}

/// Half of the circuits are converters, half networks; drawn from the seed.
pub(crate) fn netlist(seed: u64, curved: bool) -> String {
    if seed.is_multiple_of(2) {
        return network(&mut Random::new(seed), curved);
    }
    // The first of a fitting style among a thousand seeds of its own.
    let fits = |style: Style| match style {
        Style::Curved => curved,
        Style::Extreme => false,
        _ => !curved,
    };
    let seeds = (0..).map(|k| seed * 1000 + k);
    let mut cases = seeds.map(topologies::case);
    let case = cases.find(|case| fits(case.style)).expect("a case");
    let circuit = case.circuit;
    let coupled = wholly_coupled(&circuit);
    let mut saved = Vec::new();
    for card in &circuit.cards {
        for node in &card.nodes {
            let voltage = format!("v({node})");
            if node != "0" && !saved.contains(&voltage) {
                saved.push(voltage);
            }
        }
    }
    for card in &circuit.cards {
        // Currents of windings without leakage are not determined one by one.
        let told = match card.part {
            Part::D(_) | Part::S(_) => coupled.is_empty(),
            Part::L(..) => !coupled.contains(&card.name),
            _ => false,
        };
        if told {
            saved.push(format!("i({})", card.name));
        }
    }
    // Some stand at the instants of edges.
    let rows = Random::new(seed).pick(&[37, 40, 101, 200, 211, 500]);
    circuit.text_saving(&saved, rows)
}

/// What a run is asked for.
struct Asked {
    method: Method,
    step: Option<f64>,
    tol: f64,
    corners: bool,
    unestimated: bool,
}

/// A run that takes more steps says nothing.
const MOST_STEPS: u64 = 300_000;

fn run(model: &Model, asked: &Asked, finer: f64) -> Result<Run, String> {
    let mut circuit = model.circuit().clone();
    circuit.tran = circuit.tran.map(|tran| Tran {
        tstep: tran.tstep / finer,
        // An event at the last row is seen by a reference that goes on.
        tstop: tran.tstop + if finer > 1.0 { tran.tstep } else { 0.0 },
        ..tran
    });
    let options = SimOptions {
        method: asked.method,
        step: asked.step,
        corners: asked.corners,
        unestimated: asked.unestimated,
        settings: Settings {
            tol: asked.tol,
            max_steps: MOST_STEPS,
            ..Settings::default()
        },
        ..SimOptions::default()
    };
    let guarded = catch_unwind(AssertUnwindSafe(|| {
        simulate(&circuit, model.multiport(), options)
    }));
    guarded
        .unwrap_or_else(|_| panic!("panic"))
        .map_err(|e| e.to_string())
}

/// Rows of a reference between two of the run's.
const FINER: f64 = 4.0;
/// Tolerances of the reference where laws are curved: much finer steps, whose own error is told by the looser of them.
const CURVED: [f64; 2] = [1e-7, 1e-8];
/// A reference may err by this part of the error it measures.
const SURE: f64 = 0.2;
/// An error below this part of the amplitudes is rounding.
pub(crate) const ROUNDING: f64 = 1e-9;

/// The circuit of a seed.
pub(crate) fn measure(setting: &Setting, seed: u64) -> Found {
    of_text(setting, &netlist(seed, setting.curved), seed)
}

/// A netlist; the seed chooses the step where one is prescribed.
pub(crate) fn of_text(setting: &Setting, text: &str, seed: u64) -> Found {
    let model = Model::parse(text, "random.cir").unwrap_or_else(|e| panic!("{e}\n{text}"));
    let tran = model.circuit().tran.expect("a transient");
    let mut random = Random::new(seed ^ 0x5747_a7ed);
    let step = setting
        .steps
        .map(|(least, most)| tran.tstop / random.value(least, most));
    let asked = |unestimated| Asked {
        method: setting.method,
        step,
        tol: setting.tol,
        corners: false,
        unestimated,
    };
    let better = |tol| {
        let method = if setting.curved {
            Method::Theta
        } else {
            Method::Exact
        };
        let asked = Asked {
            method,
            step: None,
            tol,
            corners: true,
            unestimated: true,
        };
        run(&model, &asked, FINER)
    };
    let Ok(reference) = better(CURVED[1]) else {
        return Found::Nothing("no reference");
    };
    let undetermined = |run: &Run| run.notes.iter().any(|n| n.text.contains("not determined"));
    let found = match run(&model, &asked(false), 1.0) {
        Ok(found) => found,
        Err(error) => return Found::Refused(error),
    };
    if undetermined(&reference) || undetermined(&found) {
        return Found::Nothing("undetermined");
    }
    let alone = match run(&model, &asked(true), 1.0) {
        Ok(alone) => alone,
        Err(error) => return Found::Refused(error),
    };
    let aside = found.error.event_time.unwrap_or(0.0);
    let (truth, place) = distance(&found, &reference, (aside, ohms(&model)));
    if setting.curved {
        let Ok(other) = better(CURVED[0]) else {
            return Found::Nothing("no reference");
        };
        let own = distance(&other, &reference, (aside, ohms(&model))).0;
        if own > SURE * truth.max(ROUNDING) {
            return Found::Nothing("no sure reference");
        }
    }
    Found::Error {
        stated: found.error.max,
        truth,
        place,
        cost: (found.stats.cpu_seconds, alone.stats.cpu_seconds),
    }
}

/// The least amplitude that counts, over the largest of the same unit.
const FLOOR: f64 = 1e-3;

/// Below this part of the current that the largest voltage drives through the resistors of a circuit there is none.
const NOTHING: f64 = 1e-9;

/// The geometric mean of the resistances of a circuit, Ω.
fn ohms(model: &Model) -> f64 {
    let logarithm = |element: &circ::circuit::Element| match &element.kind {
        Kind::Resistor(r) if r.f64 > 0.0 => Some(r.f64.ln()),
        _ => None,
    };
    let r: Vec<f64> = model
        .circuit()
        .elements
        .iter()
        .filter_map(logarithm)
        .collect();
    (r.iter().sum::<f64>() / r.len().max(1) as f64).exp()
}

/// The largest distance of a value from the reference's over all columns and rows, relative to the amplitude; and where. A row that an
/// event is no further from than `aside`, s, is compared with all values of the reference within ± `aside`.
fn distance(found: &Run, reference: &Run, (aside, ohms): (f64, f64)) -> (f64, String) {
    let events = found.events.iter().chain(&reference.events);
    let mut events: Vec<f64> = events.map(|event| event.t).collect();
    events.sort_by(f64::total_cmp);
    let (waves, reference) = (&found.waveforms, &reference.waveforms);
    let columns: Vec<(usize, usize)> = (waves.names.iter().enumerate())
        .map(|(j, name)| (j, reference.find(name).expect("the same columns")))
        .collect();
    let largest: Vec<f64> = columns
        .iter()
        .map(|(_, k)| reference.column(*k).fold(0.0_f64, |m, v| m.max(v.abs())))
        .collect();
    let volts = columns
        .iter()
        .zip(&largest)
        .filter(|((j, _), _)| waves.units[*j] == "V");
    let driven = volts.fold(0.0_f64, |m, (_, a)| m.max(*a)) / ohms;
    let mut worst = (0.0, String::new());
    for (row, &t) in waves.time.iter().enumerate() {
        let rounding = 4.0 * f64::EPSILON * t;
        let wide = aside * (1.0 + 1e-9) + rounding;
        let next = events.partition_point(|event| *event < t - wide);
        let near = events.get(next).is_some_and(|event| *event <= t + wide);
        let width = if near { wide } else { rounding };
        let (low, high) = (t - width, t + width);
        let from = reference.time.partition_point(|s| *s < low);
        let to = reference.time.partition_point(|s| *s <= high);
        for (n, (j, k)) in columns.iter().enumerate() {
            let unit = waves.units[*j];
            let of_unit = columns
                .iter()
                .zip(&largest)
                .filter(|((j, _), _)| waves.units[*j] == unit);
            let of_all = of_unit.fold(0.0_f64, |m, (_, a)| m.max(*a));
            // Where all currents that are recorded are nothing beside the voltages, they are rounding.
            let scale = if unit == "A" && of_all <= NOTHING * driven {
                driven
            } else {
                largest[n].max(FLOOR * of_all)
            };
            let value = waves.row(row)[*j];
            let inner = (from..to).map(|r| reference.row(r)[*k]);
            let ends = [at(reference, low, *k), at(reference, high, *k)];
            let (min, max) = inner
                .chain(ends)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                    (a.min(v), b.max(v))
                });
            let off = (min - value).max(value - max).max(0.0);
            let relative = if off > 0.0 { off / scale } else { 0.0 };
            if relative > worst.0 {
                worst = (relative, format!("{} at {t:e}", waves.names[*j]));
            }
        }
    }
    worst
}

/// A column at a time, on straight lines between rows.
fn at(waves: &Waveforms, t: f64, column: usize) -> f64 {
    let k = waves.time.partition_point(|s| *s < t);
    let last = waves.time.len() - 1;
    if k == 0 || k > last {
        return waves.row(k.min(last))[column];
    }
    let (t0, t1) = (waves.time[k - 1], waves.time[k]);
    let (a, b) = (waves.row(k - 1)[column], waves.row(k)[column]);
    a + (b - a) * (t - t0) / (t1 - t0)
}

/// So many seeds from `first` on, on as many threads as there are cores.
pub(crate) fn many(setting: &Setting, first: u64, count: u64) -> Vec<(u64, Found)> {
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let next = Arc::new(Mutex::new(first));
    let found = Arc::new(Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..threads {
            let (next, found) = (Arc::clone(&next), Arc::clone(&found));
            scope.spawn(move || {
                loop {
                    let seed = {
                        let mut next = next.lock().expect("a lock");
                        let seed = *next;
                        if seed >= first + count {
                            return;
                        }
                        *next += 1;
                        seed
                    };
                    let one = measure(setting, seed);
                    found.lock().expect("a lock").push((seed, one));
                }
            });
        }
    });
    let mut found = std::mem::take(&mut *found.lock().expect("a lock"));
    found.sort_by_key(|(seed, _)| *seed);
    found
}
