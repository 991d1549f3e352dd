//! Searches by a method, and the simulations that they move.

use super::period::Period;
use super::search::{Found, Search};
use super::{PeriodicOptions, none};
use crate::circuit::{Circuit, Tran};
use crate::integrate::{Error, Method, Note, Reason, Simulation, SimulationOptions};
use crate::mna::{SourcePort, StaticMultiport};
use crate::settings::Settings;
use crate::settings::tolerances::periodic::{
    FINER, FINER_TOL, LAP_STEPS, LAP_STEPS_OF_CORNER, LONGEST_SEARCH, ORBIT_TOL, PARTS_OF_PERIOD,
    TABLE_STEPS,
};

/// What orbits are followed by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct By {
    pub(super) method: Method,
    /// Steps of one length, in place of exact integration and of steps that keep a tolerance.
    pub(super) equal: bool,
}

impl By {
    /// What the plan of the circuit says.
    pub(super) const PLAN: Self = Self {
        method: Method::Auto,
        equal: false,
    };

    /// Equal steps by this method.
    pub(super) const fn equal(method: Method) -> Self {
        Self {
            method,
            equal: true,
        }
    }
}

/// What a simulation that shoots does where it is not exact.
#[derive(Clone, Copy)]
pub(super) struct Pace<'a> {
    pub(super) by: By,
    /// Its steps are those of the orbit that is kept, of a hundredth of the tolerance or half as long.
    pub(super) finer: bool,
    /// One of a circuit like this, whose amplitudes its own are taken for.
    pub(super) like: Option<&'a Simulation>,
}

impl Pace<'_> {
    /// That of a first search.
    pub(super) const fn first(by: By) -> Self {
        Self {
            by,
            finer: false,
            like: None,
        }
    }
}

/// The orbit that a search comes to, with a simulation that follows it, and what they are found by: the plan of the circuit, or equal steps where a circuit of curved laws rests, of whose
/// leakage and rounding a tolerance would have digits looked for, and where the plan finds none, of which a note is `said`.
pub(super) fn searched(
    parts: (&Circuit, &StaticMultiport),
    period: &Period,
    options: &PeriodicOptions<'_>,
    said: &mut Vec<Note>,
) -> Result<(By, (Simulation, Found)), Error> {
    let curved = parts.0.is_curved();
    let planned = searched_by(parts, period, By::PLAN, options);
    let others = match &planned {
        Ok((simulation, found)) => curved && found.rests && !simulation.is_exact(),
        Err(error) => {
            let too_many = matches!(error.reason, Reason::TooManySteps { .. });
            !error.is_interruption() && (curved || too_many)
        }
    };
    let by = By::equal(if curved { Method::Auto } else { Method::Theta });
    if others
        && let Ok(other) = searched_by(parts, period, by, options)
        && (other.1.rests || planned.is_err())
    {
        let failed = planned.err().filter(|_| !other.1.rests);
        said.extend(failed.map(|error| instead(curved, &error)));
        return Ok((by, other));
    }
    Ok((By::PLAN, planned?))
}

/// Equal steps had to do, as the plan of the circuit found no orbit.
fn instead(curved: bool, error: &Error) -> Note {
    let plan = if curved {
        "steps that keep a tolerance"
    } else {
        "exact integration"
    };
    let text = format!(
        "the orbit was found in {PARTS_OF_PERIOD} equal steps a period instead of by {plan}; they damp what swings faster and miss how devices turn off within them, so that there are no multipliers: {error}"
    );
    Note::run("steps-instead", text)
}

fn searched_by(
    parts: (&Circuit, &StaticMultiport),
    period: &Period,
    by: By,
    options: &PeriodicOptions<'_>,
) -> Result<(Simulation, Found), Error> {
    let mut simulation = simulation(parts, period.seconds, Pace::first(by), options)?;
    let mut search = Search::of(&mut simulation, options);
    let Some(seconds) = period.seconds else {
        let tran = parts.0.tran.ok_or_else(|| {
            none("no source repeats, and there is no `.tran` that says how long to look for rest: `.tran 1u 1m` looks for 1 ms".into())
        })?;
        return match search.autonomous(tran.tstop) {
            Ok(found) => Ok((simulation, found)),
            Err(error) if tran.uic && matches!(error.reason, Reason::NoOrbit(_)) => {
                operating_point(parts, tran, by, options)?.ok_or(error)
            }
            Err(error) => Err(error),
        };
    };
    let found = search.driven(seconds, period.from)?;
    Ok((simulation, found))
}

/// The operating point as the rest of a circuit whose transient does not come to one in time, where disturbances of it die out.
fn operating_point(
    (circuit, multiport): (&Circuit, &StaticMultiport),
    tran: Tran,
    by: By,
    options: &PeriodicOptions<'_>,
) -> Result<Option<(Simulation, Found)>, Error> {
    let circuit = Circuit {
        tran: Some(Tran { uic: false, ..tran }),
        ..circuit.clone()
    };
    let Ok(mut simulation) = simulation((&circuit, multiport), None, Pace::first(by), options)
    else {
        return Ok(None);
    };
    let found = Search::of(&mut simulation, options).rest_from_here(tran.tstop)?;
    Ok(found.map(|found| (simulation, found)))
}

/// The orbit of finer steps in place of `found`, with the simulation that makes them, and how far the two orbits are apart relative to the amplitudes;
/// nothing where it is not found.
pub(super) fn refined(
    parts: (&Circuit, &StaticMultiport),
    (simulation, found): (&mut Simulation, &mut Found),
    period: Option<f64>,
    by: By,
    options: &PeriodicOptions<'_>,
) -> Result<Option<f64>, Error> {
    let pace = Pace {
        by,
        finer: true,
        like: Some(simulation),
    };
    let mut finer = self::simulation(parts, period, pace, options)?;
    let Some(fixed) = Search::of(&mut finer, options).again(found)? else {
        return Ok(None);
    };
    let both = fixed.stand.state.iter().zip(&found.fixed.stand.state);
    let apart = both.zip(&found.amplitudes);
    let apart = apart.fold(0.0_f64, |m, ((a, b), size)| m.max((a - b).abs() / size));
    (found.fixed, *simulation) = (fixed, finer);
    Ok(Some(apart))
}

/// A simulation that shoots: no rows, and an end that is never reached. Where laws are curved its steps keep a part of the tolerance over a period, unless they are to be
/// equal; as many of them are made in a period as sources and laws explain.
pub(super) fn simulation(
    (circuit, multiport): (&Circuit, &StaticMultiport),
    period: Option<f64>,
    pace: Pace<'_>,
    options: &PeriodicOptions<'_>,
) -> Result<Simulation, Error> {
    let span = period.or(circuit.tran.map(|t| t.tstop)).unwrap_or(1.0);
    let Pace { by, finer, like } = pace;
    let of = |step: Option<f64>, tol: f64| {
        from_rest(searching(circuit.tran, span, LONGEST_SEARCH), |tran| {
            let circuit = Circuit {
                tran: Some(tran),
                ..circuit.clone()
            };
            let options = SimulationOptions {
                method: by.method,
                step,
                settings: Settings {
                    tol,
                    ..options.settings.clone()
                },
                ..SimulationOptions::default()
            };
            if step.is_none() && circuit.is_curved() {
                let corners = |port: &SourcePort| port.input.source.wave.corners(span);
                let corners: f64 = multiport.sources.iter().map(corners).sum();
                let most = LAP_STEPS + LAP_STEPS_OF_CORNER * corners;
                let most = most * (ORBIT_TOL * Settings::default().tol / tol).sqrt();
                let most = (most as u64).min(options.settings.max_steps);
                return Simulation::lapping(&circuit, multiport, options, (span, most), like);
            }
            Simulation::closed(&circuit, multiport, options)
        })
    };
    if !by.equal {
        let tol = if finer {
            FINER_TOL * ORBIT_TOL
        } else {
            ORBIT_TOL
        };
        let simulation = of(None, tol * options.settings.tol)?;
        if simulation.is_exact() || circuit.is_curved() {
            return Ok(simulation);
        }
    }
    // Where a step is halved, and where not, differs from return to return, and with it what they return to.
    let part = if finer { FINER } else { 1.0 };
    of(Some(part * span / PARTS_OF_PERIOD), options.settings.tol)
}

/// What is asked of runs that look for an orbit, in place of what the circuit asks for itself: they may take `most` spans, s.
pub(super) fn searching(own: Option<Tran>, span: f64, most: f64) -> Tran {
    Tran {
        tstep: span / TABLE_STEPS,
        prints: true,
        tstop: span * most,
        tstart: 0.0,
        tmax: own.and_then(|tran| tran.tmax),
        uic: own.is_some_and(|tran| tran.uic),
    }
}

/// What is made from the operating point, or without one where there is none: the orbit does not depend on where the search for it starts.
pub(super) fn from_rest<T>(
    tran: Tran,
    make: impl Fn(Tran) -> Result<T, Error>,
) -> Result<T, Error> {
    match make(tran) {
        Err(error) if has_no_rest(&error) => make(Tran { uic: true, ..tran }),
        made => made,
    }
}

/// Whether a simulation did not start for want of an operating point.
const fn has_no_rest(error: &Error) -> bool {
    matches!(
        error.reason,
        Reason::NoOperatingPoint(_) | Reason::SwitchesDoNotSettle
    )
}
