//! One case by `circ` and by the oracle.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use circ::Model;
use circ::integrate::{Method, Run, SimOptions};
use circ::settings::Settings;

use crate::changes::change;
use crate::circuit::{Card, Circuit, Core, DiodeModel, Part, ThyristorModel, states};
use crate::oracle::{self, Answer, COARSE, FINE};
use crate::random::Random;
use crate::resumed;
use crate::topologies::Case;

/// Largest difference of states relative to their amplitudes that needs no explanation.
pub(crate) const AGREES: f64 = 1e-6;

/// An oracle whose own error is larger than this says nothing.
const UNSURE: f64 = 1e-4;

/// Of error-controlled steps, and where these are in doubt.
const TOLERANCE: f64 = 1e-7;
const FINER: f64 = 1e-9;
/// Of a run.
pub(crate) const MOST_STEPS: u64 = 3_000_000;

/// What became of a case.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Outcome {
    Agrees {
        difference: f64,
        error: f64,
        method: String,
    },
    Differs {
        difference: f64,
        what: String,
    },
    /// `circ` refused, loudly.
    Refused(String),
    Panicked(String),
    /// The oracle has no answer.
    Declined(String),
    /// The difference has a cause that `circ` names itself.
    Explained(String),
}

/// A run of a netlist, or what was said instead; one that goes on for longer than this is said to hang.
const LONGEST: Duration = Duration::from_secs(60);

pub(crate) fn run(text: &str, method: Method) -> Result<Run, String> {
    run_to(text, method, TOLERANCE)
}

/// As [`run`], with another tolerance of the steps.
fn run_to(text: &str, method: Method, tol: f64) -> Result<Run, String> {
    let (send, receive) = mpsc::channel();
    let owned = text.to_string();
    // A run without progress cannot be ended from outside; its thread is left alone.
    std::thread::spawn(move || drop(send.send(attempt(&owned, method, tol))));
    receive
        .recv_timeout(LONGEST + Duration::from_secs(30))
        .unwrap_or_else(|_| Err("hang: no progress".into()))
}

fn attempt(text: &str, method: Method, tol: f64) -> Result<Run, String> {
    let end = Instant::now() + LONGEST;
    let guarded = catch_unwind(AssertUnwindSafe(|| {
        let model = Model::parse(text, "random.cir").map_err(|e| format!("not read: {e}"))?;
        let mut progress = |t: f64| assert!(Instant::now() < end, "hang: at {t:e} s");
        let options = SimOptions {
            method,
            progress: Some(&mut progress),
            settings: Settings {
                tol,
                max_steps: MOST_STEPS,
                large: super::number("CIRC_CONVERTERS_LARGE")
                    .map_or(Settings::default().large, |large| large as usize),
                ..Settings::default()
            },
            ..SimOptions::default()
        };
        model.transient(options).map_err(|e| e.to_string())
    }));
    guarded.unwrap_or_else(|e| Err(said(e.as_ref())))
}

/// The words of a panic.
pub(crate) fn said(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    let text = text.or_else(|| panic.downcast_ref::<&str>().map(ToString::to_string));
    format!("panic: {}", text.unwrap_or_default())
}

/// The columns of the signals at the rows k·stop/rows, k = 1, …, row by row.
pub(crate) fn rows(
    run: &Run,
    circuit: &Circuit,
    signals: &[String],
) -> Result<Vec<Vec<f64>>, String> {
    let columns: Vec<usize> = signals
        .iter()
        .map(|name| {
            run.waveforms
                .find(name)
                .ok_or_else(|| format!("no column {name}"))
        })
        .collect::<Result<_, _>>()?;
    let step = circuit.step();
    let mut rows = Vec::new();
    for k in 1..=circuit.rows {
        let t = k as f64 * step;
        let close = |&time: &f64| (time - t).abs() <= 1e-9 * step;
        let row = run.waveforms.time.iter().rposition(close);
        let row = row.ok_or_else(|| format!("no row at {t}"))?;
        rows.push(columns.iter().map(|&j| run.waveforms.row(row)[j]).collect());
    }
    Ok(rows)
}

/// Below this part of what drives a circuit nothing counts.
const NOTHING: f64 = 1e-9;

/// The least amplitudes that count, V and A: a circuit at rest has none of its own.
fn floors(circuit: &Circuit) -> (f64, f64) {
    let (mut volts, mut amps) = (0.0_f64, 0.0_f64);
    for card in &circuit.cards {
        match &card.part {
            Part::C(_, ic) => volts = volts.max(ic.abs()),
            Part::L(_, ic) | Part::Core(Core { ic, .. }) => amps = amps.max(ic.abs()),
            Part::V(wave) => volts = volts.max(wave.largest()),
            Part::I(wave) => amps = amps.max(wave.largest()),
            _ => {}
        }
    }
    let z = ohms(circuit);
    (NOTHING * volts.max(z * amps), NOTHING * amps.max(volts / z))
}

/// Amplitude of each signal; what is below a thousandth of the largest of its kind counts as that.
pub(crate) fn amplitudes(
    rows: &[Vec<f64>],
    signals: &[String],
    (volts, amps): (f64, f64),
) -> Vec<f64> {
    let own: Vec<f64> = (0..signals.len())
        .map(|j| rows.iter().fold(0.0_f64, |m, row| m.max(row[j].abs())))
        .collect();
    let largest = |kind: char, least: f64| {
        let of_kind = own.iter().zip(signals).filter(|(_, s)| s.starts_with(kind));
        of_kind.fold(1e3 * least, |m, (a, _)| m.max(*a))
    };
    let floors = (1e-3 * largest('v', volts), 1e-3 * largest('i', amps));
    let pairs = own.iter().zip(signals);
    pairs
        .map(|(a, s)| {
            a.max(if s.starts_with('v') {
                floors.0
            } else {
                floors.1
            })
        })
        .collect()
}

/// The largest difference, where and in what.
pub(crate) fn difference(
    a: &[Vec<f64>],
    b: &[Vec<f64>],
    signals: &[String],
    floors: (f64, f64),
) -> (f64, String) {
    let amplitudes = amplitudes(b, signals, floors);
    let mut worst = (0.0, String::new());
    for (k, (one, other)) in a.iter().zip(b).enumerate() {
        for (j, (x, y)) in one.iter().zip(other).enumerate() {
            let d = (x - y).abs() / amplitudes[j];
            let d = if d.is_nan() { f64::INFINITY } else { d };
            if d > worst.0 {
                worst = (
                    d,
                    format!("{} in row {}: {x} is not {y}", signals[j], k + 1),
                );
            }
        }
    }
    worst
}

/// The rows that are at no edge of a source. Where the state jumps at the instant of a row, the oracle's row is the one before.
fn beside_edges(circuit: &Circuit, rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let edges = oracle::corners(circuit);
    let is_beside = |k: usize| {
        let t = (k + 1) as f64 * circuit.step();
        edges.iter().all(|e| (e - t).abs() > 1e-9 * circuit.step())
    };
    let kept = rows.iter().enumerate().filter(|(k, _)| is_beside(*k));
    kept.map(|(_, row)| row.clone()).collect()
}

/// Whether every switch and diode has resistances that the oracle can work with as they stand.
fn is_plain(circuit: &Circuit) -> bool {
    circuit.cards.iter().all(|card| match card.part {
        Part::S(m) => m.ron >= 1e-5 && m.roff <= 1e9,
        Part::M(m) => m.rb >= 1e-5 && m.ron >= 1e-5 && m.roff <= 1e9,
        Part::D(DiodeModel::Lines(_, ron, roff)) => ron >= 1e-5 && roff <= 1e9,
        Part::Thyristor(t) => t.lines[1] >= 1e-5 && t.lines[2] <= 1e9,
        _ => true,
    })
}

/// The circuit with `ron` in series with every switch and diode and `roff` across them, so that both vanish together.
pub(crate) fn realised(circuit: &Circuit, ron: f64, roff: f64) -> Circuit {
    let mut circuit = circuit.clone();
    let across = |r: f64| 1.0 / (1.0 / r + 1.0 / roff);
    for card in &mut circuit.cards {
        match &mut card.part {
            Part::S(m) => (m.ron, m.roff) = (m.ron + ron, across(m.roff)),
            Part::D(DiodeModel::Lines(_, on, off)) => (*on, *off) = (*on + ron, across(*off)),
            Part::Thyristor(ThyristorModel {
                lines: [_, on, off],
                ..
            }) => {
                (*on, *off) = (*on + ron, across(*off));
            }
            Part::M(m) => {
                (m.ron, m.roff) = (m.ron + ron, across(m.roff));
                m.rb += ron;
            }
            _ => {}
        }
    }
    circuit
}

fn is_curved(circuit: &Circuit) -> bool {
    let curved = |card: &Card| matches!(card.part, Part::D(DiodeModel::Curved(..)));
    circuit.cards.iter().any(curved)
}

/// The circuit with a resistance across every inductor and exponential diode, without which nodes between them have no voltage.
fn shunted(circuit: &Circuit, ohms: f64) -> Circuit {
    let mut circuit = circuit.clone();
    let mut shunts = Vec::new();
    for card in &circuit.cards {
        if matches!(
            card.part,
            Part::L(..) | Part::Core(_) | Part::D(DiodeModel::Curved(..))
        ) {
            shunts.push(Card {
                name: format!("rshunt{}", card.name),
                nodes: card.nodes[..2].to_vec(),
                part: Part::R(ohms),
            });
        }
    }
    circuit.cards.extend(shunts);
    circuit
}

/// The size of a circuit's resistances, Ω.
fn ohms(circuit: &Circuit) -> f64 {
    let r = circuit.cards.iter().filter_map(|c| match c.part {
        Part::R(r) => Some(r.ln()),
        _ => None,
    });
    let (sum, count) = r.fold((0.0, 0.0), |(s, n), r| (s + r, n + 1.0));
    if count > 0.0 {
        (sum / count).exp()
    } else {
        1.0
    }
}

/// What the oracle says about a circuit.
pub(crate) struct Expected {
    rows: Vec<Vec<f64>>,
    /// Their own error, relative to amplitudes.
    error: f64,
    /// Rows so close to an event that the limit of realisations may have them on its other side.
    doubtful: Vec<usize>,
    /// Exponential diodes stand beside shunts, whose leaks they carry: the values need not tend to the limit in proportion, and the error
    /// is no bound.
    shunted: bool,
}

impl Expected {
    /// The rows that are not doubtful, of any answer.
    fn sure(&self, rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let kept = rows.iter().enumerate();
        let kept = kept.filter(|(k, _)| !self.doubtful.contains(k));
        kept.map(|(_, row)| row.clone()).collect()
    }
}

/// Rows that an event passes as realisations tend to the ideal circuit: it moves by a ninth of what it moved between the last two. Where
/// these differ in more than the times of their events, none is known.
fn doubtful(circuit: &Circuit, one: &Answer, two: &Answer) -> Vec<usize> {
    if one.events.len() != two.events.len() {
        return Vec::new();
    }
    let passes = |t: f64| {
        let mut events = one.events.iter().zip(&two.events);
        // The whole of it, as the ninth is an estimate.
        events.any(|(a, b)| (t - b).abs() <= (a - b).abs())
    };
    (0..circuit.rows)
        .filter(|k| passes((k + 1) as f64 * circuit.step()))
        .collect()
}

/// What falls by less than this a decade is not proportional to the resistances that vanish.
const PROPORTIONAL: f64 = 8.0;

/// What is left of values that three decades of resistances bring closer, but not in proportion: a diode that carries the leak of a shunt.
fn unproportional(rows: &[Vec<Vec<f64>>; 3], signals: &[String], floors: (f64, f64)) -> f64 {
    let [one, last, next] = rows;
    let amplitudes = amplitudes(next, signals, floors);
    let mut largest = 0.0_f64;
    for ((a, b), c) in one.iter().zip(last).zip(next) {
        for (j, amplitude) in amplitudes.iter().enumerate() {
            let (before, now) = ((a[j] - b[j]).abs(), (b[j] - c[j]).abs());
            if before < PROPORTIONAL * now {
                largest = largest.max(now / (before / now - 1.0).max(0.1) / amplitude);
            }
        }
    }
    largest
}

/// What the oracle says about a circuit for so many multiplications.
pub(crate) fn expected(circuit: &Circuit, budget: u64) -> Result<Expected, String> {
    let signals = states(circuit);
    let budget = Cell::new(budget);
    let least = floors(circuit);
    let answer =
        |circuit: &Circuit, accuracy| oracle::simulate(circuit, accuracy, &budget).map_err(|e| e.0);
    if is_plain(circuit)
        && let Ok(fine) = answer(circuit, FINE)
    {
        let coarse = answer(circuit, COARSE)?;
        let error = difference(&coarse.rows, &fine.rows, &signals, least).0;
        return Ok(Expected {
            rows: fine.rows,
            error,
            doubtful: Vec::new(),
            shunted: false,
        });
    }
    // Towards the ideal circuit: three decades and what they tend to.
    let z = ohms(circuit);
    let with_shunts = Cell::new(false);
    let at = |e: f64, accuracy| {
        let realised = realised(circuit, z * e, z / e);
        answer(&realised, accuracy).or_else(|_| {
            with_shunts.set(true);
            answer(&shunted(&realised, z / e), accuracy)
        })
    };
    let limit = |a: &Answer, b: &Answer| -> Vec<Vec<f64>> {
        let row = |(a, b): (&Vec<f64>, &Vec<f64>)| {
            a.iter().zip(b).map(|(a, b)| b + (b - a) / 9.0).collect()
        };
        a.rows.iter().zip(&b.rows).map(row).collect()
    };
    let (mut one, mut last) = (at(1e-4, FINE)?, at(1e-5, FINE)?);
    let coarse = at(1e-5, COARSE)?;
    let of_steps = difference(&coarse.rows, &last.rows, &signals, least).0;
    let mut found: Option<Expected> = None;
    for e in [1e-6, 1e-7, 1e-8] {
        let next = match at(e, FINE) {
            Ok(next) => next,
            Err(why) if found.is_none() => return Err(why),
            // Smaller ones may be beyond the oracle.
            Err(_) => break,
        };
        let mut fine = Expected {
            rows: limit(&last, &next),
            error: 0.0,
            doubtful: doubtful(circuit, &last, &next),
            shunted: with_shunts.get() && is_curved(circuit),
        };
        let coarse = fine.sure(&limit(&one, &last));
        let extrapolated = difference(&coarse, &fine.sure(&fine.rows), &signals, least).0;
        let rows = [&one.rows, &last.rows, &next.rows].map(|rows| fine.sure(rows));
        // The rest falls at least with e, where that is what it does.
        let of_limit = (0.3 * extrapolated).max(unproportional(&rows, &signals, least));
        fine.error = of_limit + of_steps;
        (one, last) = (last, next);
        found = Some(fine);
        if of_limit < 0.3 * AGREES {
            break;
        }
    }
    found.ok_or_else(|| "no limit".into())
}

/// A run of a case, with its rows.
pub(crate) struct Base {
    run: Run,
    rows: Vec<Vec<f64>>,
}

/// The run of a case, or what became of it.
pub(crate) fn base(case: &Case) -> Result<Base, Outcome> {
    let run = run(&case.circuit.text(), Method::Auto).map_err(|e| {
        if e.starts_with("panic") || e.starts_with("hang") {
            Outcome::Panicked(e)
        } else {
            Outcome::Refused(e)
        }
    })?;
    let rows = rows(&run, &case.circuit, &states(&case.circuit));
    match rows {
        Ok(rows) => Ok(Base { run, rows }),
        Err(what) => Err(Outcome::Differs {
            difference: f64::INFINITY,
            what,
        }),
    }
}

/// `circ` against the oracle, which may spend so many multiplications.
pub(crate) fn judge(case: &Case, base: &Base, budget: u64) -> Outcome {
    let signals = states(&case.circuit);
    let (run, found) = (&base.run, &base.rows);
    // Whatever the oracle says.
    let mut notes = run.notes.iter();
    if let Some(fault) = notes.find(|n| n.text.contains("internal error")) {
        return Outcome::Panicked(fault.text.clone());
    }
    let expected = match expected(&case.circuit, budget) {
        Ok(e) => e,
        Err(e) => return Outcome::Declined(e),
    };
    let error = expected.error;
    if error > UNSURE {
        return Outcome::Declined(format!("its own error is {error:.1e}"));
    }
    let least = floors(&case.circuit);
    let compared = |found: &[Vec<f64>]| {
        let (found, rows) = (expected.sure(found), expected.sure(&expected.rows));
        difference(&found, &rows, &signals, least)
    };
    let (worst, what) = compared(found);
    let (method, stated) = method(run);
    let allowed = AGREES + 3.0 * error + stated;
    if worst <= allowed {
        return Outcome::Agrees {
            difference: worst,
            error,
            method,
        };
    }
    let [one, other] = [found, &expected.rows].map(|rows| beside_edges(&case.circuit, rows));
    if one.len() < found.len() && difference(&one, &other, &signals, least).0 <= allowed {
        return Outcome::Explained("the state jumps at the instant of a row".into());
    }
    // Steps that state too small an error.
    if run.method != "exact"
        && let Ok(run) = run_to(&case.circuit.text(), Method::Auto, FINER)
        && let Ok(found) = rows(&run, &case.circuit, &signals)
        && compared(&found).0 <= AGREES + 3.0 * error
    {
        return Outcome::Explained(
            "steps are further off than they state, finer ones agree".into(),
        );
    }
    // What competes for an impulse shares it by ratios of resistances that an ideal circuit does not have.
    if run
        .notes
        .iter()
        .any(|n| n.text.contains("compete for an impulse"))
    {
        return Outcome::Explained("elements compete for an impulse".into());
    }
    if expected.shunted {
        return Outcome::Declined("exponential diodes carry the leaks of its shunts".into());
    }
    let what =
        format!("{what} ({method}, stated {stated:.1e}, the oracle's own error {error:.1e})");
    Outcome::Differs {
        difference: worst,
        what,
    }
}

/// What becomes of a case that `circ` refuses: where the oracle has no answer either, there may be none.
pub(crate) fn refused(case: &Case, why: String, budget: u64) -> Outcome {
    match expected(&case.circuit, budget) {
        Ok(expected) if expected.error <= UNSURE => Outcome::Refused(why),
        _ => Outcome::Declined("nor has circ an answer".into()),
    }
}

/// What made the rows, and the error that it states itself: an exact run that hands over to steps says so.
fn method(run: &Run) -> (String, f64) {
    let handed_over = run
        .notes
        .iter()
        .any(|n| n.text.contains("exact integration"));
    let method = match (run.method.as_str(), handed_over) {
        ("exact", true) => "exact and steps".to_string(),
        ("exact", false) => return ("exact".into(), 0.0),
        (method, true) => format!("{method} in the place of exact"),
        (method, false) => method.to_string(),
    };
    (method, run.error.max.unwrap_or(0.0))
}

/// `circ` against itself where the run is stopped, left and taken up again.
pub(crate) fn resumed(case: &Case, base: &Base, seed: u64) -> Outcome {
    let circuit = &case.circuit;
    let signals = states(circuit);
    let apart = |found: &[Vec<f64>], rows: &[Vec<f64>]| {
        let [one, other] = [found, rows].map(|rows| beside_edges(circuit, rows));
        difference(&one, &other, &signals, floors(circuit))
    };
    let found = match resumed::rows(circuit, seed, TOLERANCE) {
        Ok(rows) => rows,
        Err(what) => {
            return Outcome::Differs {
                difference: f64::INFINITY,
                what: format!("taken up again: {what}"),
            };
        }
    };
    let (difference, what) = apart(&found, &base.rows);
    let (method, stated) = method(&base.run);
    // Steps that state too small an error.
    if difference > AGREES + 2.0 * stated
        && base.run.method != "exact"
        && let Ok(run) = run_to(&circuit.text(), Method::Auto, FINER)
        && let Ok(whole) = rows(&run, circuit, &signals)
        && let Ok(found) = resumed::rows(circuit, seed, FINER)
        && apart(&found, &whole).0 <= AGREES
    {
        return Outcome::Explained(
            "steps are further off than they state, finer ones agree".into(),
        );
    }
    with_itself(
        difference,
        2.0 * stated,
        format!("taken up again: {what} ({method})"),
        method,
    )
}

/// The outcome of `circ` against itself, where both runs state so much error together.
fn with_itself(difference: f64, stated: f64, what: String, method: String) -> Outcome {
    if difference <= AGREES + stated {
        Outcome::Agrees {
            difference,
            error: 0.0,
            method,
        }
    } else {
        Outcome::Differs { difference, what }
    }
}

/// `circ` against itself after a change that must not matter; `None` where the change does not apply.
pub(crate) fn unchanged(
    case: &Case,
    base: &Base,
    kind: usize,
    random: &mut Random,
) -> Option<Outcome> {
    let circuit = &case.circuit;
    let signals = states(circuit);
    let change = change(circuit, kind, random)?;
    let failed = |what: String| {
        Some(Outcome::Differs {
            difference: f64::INFINITY,
            what: format!("{}: {what}\n{}", change.name, change.text),
        })
    };
    let second = match run(&change.text, Method::Auto) {
        Ok(run) => run,
        Err(e) => return failed(e),
    };
    let names: Vec<String> = change.signals.iter().map(|s| s.0.clone()).collect();
    let other = match rows(&second, &change.circuit, &names) {
        Ok(rows) => rows,
        Err(e) => return failed(e),
    };
    let other: Vec<Vec<f64>> = other
        .into_iter()
        .skip(change.every - 1)
        .step_by(change.every)
        .map(|row| {
            let signals = change.signals.iter();
            row.iter().zip(signals).map(|(x, (_, f))| x / f).collect()
        })
        .collect();
    // One signal alone stands beside itself.
    let (rows, signals) = if change.signals.len() == signals.len() {
        (base.rows.clone(), signals)
    } else {
        let place = signals.iter().position(|s| *s == names[0])?;
        (
            base.rows.iter().map(|row| vec![row[place]]).collect(),
            names,
        )
    };
    let (difference, what) = difference(&other, &rows, &signals, floors(circuit));
    let ((one, error), (two, other_error)) = (method(&base.run), method(&second));
    let method = format!("{one}, {two}");
    let what = format!("{}: {what} ({method})\n{}", change.name, change.text);
    Some(with_itself(difference, error + other_error, what, method))
}
