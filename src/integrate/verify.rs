//! A run made a second time by an independent method, and how far the two are apart.
//!
//! Exact integration and implicit steps share the reduced systems and nothing of the way through time: one finds events and modes, the
//! other solves a complementarity problem at every step. The steps are made at two tolerances, whose distance tells what they know
//! themselves. Rows are compared as those of companions are (`integrate::difference`), where an event may stand as far aside as
//! those of the verifying runs do among each other.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use nalgebra::DVector;

use crate::circuit::{Circuit, Tran};
use crate::integrate::difference::{Difference, grow, scales};
use crate::integrate::error::{Error, Reason};
use crate::integrate::rows::RowKind;
use crate::integrate::simulate::{Method, SimOptions, simulate, simulate_system};
use crate::integrate::stats::Run;
use crate::lcs::Lcs;
use crate::mna::StaticMultiport;
use crate::settings::Settings;
use crate::settings::tolerances::stated::{
    ASIDE, ENOUGH, EXACT, MOST_LEFT_OUT, MOST_STEPS, ROWS_LEFT, SAFETY, SHORTENED, TOLERANCES,
};

/// What the second run found.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Verified {
    /// How it was made: `exact`, `theta at a tolerance of 1e-6`.
    pub method: String,
    /// The largest difference of a signal from the second run, relative to the signal's amplitude: that of the signal for which it is the
    /// largest part of what is tolerated.
    pub max_difference: f64,
    /// What is tolerated of that signal: the error that the first run states and that of the second.
    pub tolerance: f64,
    /// The signal.
    pub signal: String,
    /// Where its difference is largest, s.
    pub time: f64,
    /// How far the run was made a second time, s, where its end asks for more steps than a verifying run may take.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub until: Option<f64>,
}

impl Verified {
    /// Whether the runs agree.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.max_difference <= self.tolerance
    }
}

/// How a second run is made.
#[derive(Clone, Default)]
pub struct VerifyOptions<'a> {
    /// Those of the first run; the tolerances of the steps are chosen here.
    pub settings: Settings,
    /// As [`SimOptions::cancel`].
    pub cancel: Option<&'a AtomicBool>,
}

/// Makes the run of a circuit a second time; `run` has its rows at the output times, and at events and corners too if it was made with
/// [`SimOptions::corners`].
///
/// # Errors
/// The second run's.
pub fn verify(
    circuit: &Circuit,
    behaviour: &StaticMultiport,
    run: &Run,
    options: &VerifyOptions<'_>,
) -> Result<Verified, Error> {
    let Some(tran) = circuit.tran else {
        return Err(Error::before(Reason::internal(
            "integrate::verify",
            "a run without `.tran`",
        )));
    };
    let mut part = circuit.clone();
    second(run, tran, options, &mut |tran, options| {
        part.tran = Some(tran);
        simulate(&part, behaviour, options)
    })
}

/// The same for the run of a system, see [`simulate_system`].
///
/// # Errors
/// The second run's.
pub fn verify_system(
    (lcs, x): (&Lcs, &DVector<f64>),
    tran: Tran,
    run: &Run,
    options: &VerifyOptions<'_>,
) -> Result<Verified, Error> {
    second(run, tran, options, &mut |tran, options| {
        simulate_system(lcs, x, tran, options)
    })
}

/// Makes a run of a transient.
type Simulate<'a> = dyn FnMut(Tran, SimOptions<'_>) -> Result<Run, Error> + 'a;

/// Verifies the whole run, or of one that asks for too many steps as much as they reach.
fn second(
    run: &Run,
    tran: Tran,
    options: &VerifyOptions<'_>,
    simulate: &mut Simulate<'_>,
) -> Result<Verified, Error> {
    let error = match part(run, tran, options, simulate) {
        Err(error) if matches!(error.reason, Reason::TooManySteps { .. }) => error,
        found => return found,
    };
    // What the first of the tolerances reached, the second and third do not.
    let reached = error.t.unwrap_or(0.0) / SHORTENED;
    let tstop = grid(run).take_while(|t| *t <= reached).last();
    let long_enough = |t: &f64| *t >= tran.tstart + ROWS_LEFT * tran.tstep;
    let Some(tstop) = tstop.filter(long_enough) else {
        return Err(error);
    };
    let verified = part(run, Tran { tstop, ..tran }, options, simulate)?;
    Ok(Verified {
        until: Some(tstop),
        ..verified
    })
}

/// Verifies a run up to the end of this transient.
fn part(
    run: &Run,
    tran: Tran,
    options: &VerifyOptions<'_>,
    simulate: &mut Simulate<'_>,
) -> Result<Verified, Error> {
    let (step, until) = (tran.tstep, tran.tstop);
    let mut again = |method, tol: f64| {
        let options = SimOptions {
            method,
            corners: true,
            unestimated: true,
            settings: Settings {
                tol,
                max_steps: options.settings.max_steps.min(MOST_STEPS),
                ..options.settings.clone()
            },
            cancel: options.cancel,
            ..SimOptions::default()
        };
        simulate(tran, options)
    };
    let is_exact = run.method == Method::Exact.name();
    let stated = match run.error.max {
        Some(error) => error,
        None if is_exact => EXACT,
        None => options.settings.tol,
    };
    let known = run.error.event_time.unwrap_or(0.0);
    if !is_exact {
        match again(Method::Exact, options.settings.tol) {
            Ok(exact) => {
                let aside = known.max(apart(run, &exact, until).min(ASIDE * step));
                let times = quiet_times(run, &[run, &exact], ASIDE * step, until);
                let found = compared(run, &exact, &times, aside);
                let judged = found.into_iter().map(|signal| (signal, stated + EXACT));
                return Ok(worst(Method::Exact.name().into(), judged));
            }
            Err(error) if error.reason == Reason::Interrupted => return Err(error),
            // Then steps.
            Err(_) => {}
        }
    }
    let method = if run.method == Method::Theta.name() {
        Method::Euler
    } else {
        Method::Theta
    };
    let mut coarse = again(method, TOLERANCES[0])?;
    let mut verified = None;
    for tol in &TOLERANCES[1..] {
        let fine = match again(method, *tol) {
            Ok(fine) => fine,
            // What is known already counts.
            Err(error) => match (verified, error.reason == Reason::Interrupted) {
                (Some(verified), false) => return Ok(verified),
                _ => return Err(error),
            },
        };
        let itself = SAFETY * apart(&coarse, &fine, until);
        let aside = itself
            .max(known)
            .max(apart(run, &fine, until).min(ASIDE * step));
        let runs = [run, &coarse, &fine];
        let times = quiet_times(run, &runs, itself.max(ASIDE * step), until);
        let own = compared(&coarse, &fine, &times, itself);
        let own: BTreeMap<&str, f64> = own.iter().map(|s| (s.name, s.distance)).collect();
        let judged = compared(run, &fine, &times, aside);
        let judged = judged.into_iter().map(|signal| {
            let own = own.get(signal.name).copied().unwrap_or(0.0);
            (signal, stated + tol.max(SAFETY * own))
        });
        let found = worst(
            format!("{} at a tolerance of {tol:e}", method.name()),
            judged,
        );
        let enough = found.holds() && found.tolerance - stated <= ENOUGH;
        verified = Some(found);
        if enough {
            break;
        }
        coarse = fine;
    }
    verified.ok_or_else(|| {
        Error::before(Reason::internal(
            "integrate::verify",
            "no tolerance to verify at",
        ))
    })
}

/// How far a signal of two runs is apart.
#[derive(Debug, Clone, Copy, Default)]
struct Signal<'a> {
    name: &'a str,
    /// The largest difference, relative to the signal's amplitude.
    distance: f64,
    /// Where that is, s.
    time: f64,
}

/// How far the signals of a run are from those of another at these times, rows of both; events may be `aside`, s.
fn compared<'a>(run: &'a Run, other: &Run, times: &[f64], aside: f64) -> Vec<Signal<'a>> {
    let (waves, others) = (&run.waveforms, &other.waveforms);
    let names = waves.names.iter().enumerate();
    let pairs: Vec<(usize, usize)> = names
        .filter_map(|(j, name)| Some((j, others.find(name)?)))
        .collect();
    let mut difference = Difference::new(pairs.len(), aside);
    let mut amplitude = vec![0.0; pairs.len()];
    let mut theirs = vec![0.0; pairs.len()];
    for k in 0..others.len() {
        pick(others.row(k), pairs.iter().map(|pair| pair.1), &mut theirs);
        grow(&mut amplitude, &theirs);
    }
    let mut ours = vec![0.0; pairs.len()];
    let (mut events, mut other_events) =
        (run.events.iter().peekable(), other.events.iter().peekable());
    for &t in times {
        // The last of several rows at one time holds the values after a jump.
        let row = |time: &[f64]| time.partition_point(|s| *s <= t).checked_sub(1);
        let rows = row(&waves.time).zip(row(&others.time));
        let Some((k, l)) = rows.filter(|(k, l)| waves.time[*k] == t && others.time[*l] == t) else {
            continue;
        };
        while let Some(event) = events.next_if(|event| event.t <= t) {
            difference.see(event, true);
        }
        while let Some(event) = other_events.next_if(|event| event.t <= t) {
            difference.see(event, false);
        }
        pick(waves.row(k), pairs.iter().map(|pair| pair.0), &mut ours);
        pick(others.row(l), pairs.iter().map(|pair| pair.1), &mut theirs);
        difference.compare(t, &ours, &theirs);
    }
    let units: Vec<&'static str> = pairs.iter().map(|(j, _)| waves.units[*j]).collect();
    let columns = difference.columns(&scales(&amplitude, &units));
    // Without a common row nothing is known.
    let known = difference.rows() > 0;
    let signal = |((j, _), (distance, time)): (&(usize, usize), (f64, f64))| Signal {
        name: &waves.names[*j],
        distance: if known { distance } else { f64::INFINITY },
        time,
    };
    pairs.iter().zip(columns).map(signal).collect()
}

/// These columns of a row.
fn pick(row: &[f64], columns: impl Iterator<Item = usize>, picked: &mut [f64]) {
    for (value, column) in picked.iter_mut().zip(columns) {
        *value = row[column];
    }
}

/// The signal whose difference is the largest part of what is tolerated.
fn worst<'a>(method: String, judged: impl Iterator<Item = (Signal<'a>, f64)>) -> Verified {
    let part = |(signal, tolerance): &(Signal<'_>, f64)| signal.distance / tolerance;
    let (signal, tolerance) = judged
        .max_by(|a, b| part(a).total_cmp(&part(b)))
        .unwrap_or_default();
    Verified {
        method,
        max_difference: signal.distance,
        tolerance,
        signal: signal.name.into(),
        time: signal.time,
        until: None,
    }
}

/// The times of the grid's rows up to `until`, s, that no event of these runs is near, nor the start and the end (beyond which none is seen);
/// all of them if those were too few.
fn quiet_times(run: &Run, runs: &[&Run], near: f64, until: f64) -> Vec<f64> {
    let all: Vec<f64> = grid(run).take_while(|t| *t <= until).collect();
    let events = runs.iter().flat_map(|run| run.events.iter().map(|e| e.t));
    let end = all.last().copied().unwrap_or(0.0);
    let mut events: Vec<f64> = events.chain([0.0, end]).collect();
    events.sort_by(f64::total_cmp);
    let is_quiet = |t: &f64| {
        let next = events.partition_point(|event| *event < t - near);
        events.get(next).is_none_or(|event| *event > t + near)
    };
    let quiet: Vec<f64> = all.iter().copied().filter(is_quiet).collect();
    if (quiet.len() as f64) < (1.0 - MOST_LEFT_OUT) * all.len() as f64 {
        return all;
    }
    quiet
}

/// The times of the grid's rows.
fn grid(run: &Run) -> impl Iterator<Item = f64> {
    let kind = |k: usize| run.kinds.get(k).copied().unwrap_or(RowKind::Grid);
    let times = run.waveforms.time.iter().enumerate();
    times
        .filter(move |(k, _)| kind(*k).is_grid())
        .map(|(_, t)| *t)
}

/// How far events of the same name up to `until`, s, are apart, s: the largest distance among names that both runs have equally often.
fn apart(a: &Run, b: &Run, until: f64) -> f64 {
    let by_name = |run: &'_ Run| {
        let mut times: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for event in run.events.iter().filter(|event| event.t <= until) {
            times.entry(event.to_string()).or_default().push(event.t);
        }
        times
    };
    let (a, b) = (by_name(a), by_name(b));
    let both = a
        .iter()
        .filter_map(|(name, times)| Some((times, b.get(name)?)));
    both.filter(|(a, b)| a.len() == b.len())
        .flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b).abs()))
        .fold(0.0, f64::max)
}
