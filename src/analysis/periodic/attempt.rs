//! Searches by a method, and the simulations that they move.

use super::period::Period;
use super::search::{Found, Search};
use super::{PeriodicOptions, none};
use crate::circuit::{Circuit, Tran};
use crate::integrate::{Error, Method, Reason, Simulation, SimulationOptions};
use crate::mna::StaticMultiport;
use crate::settings::tolerances::periodic::{FINER, LONGEST_SEARCH, PARTS_OF_PERIOD, TABLE_STEPS};

/// The orbit that a method comes to, and a simulation by it.
pub(super) fn searched(
    parts: (&Circuit, &StaticMultiport),
    period: &Period,
    method: Method,
    options: &PeriodicOptions<'_>,
) -> Result<(Simulation, Found), Error> {
    let mut simulation = simulation(parts, period.seconds, (1.0, method), options)?;
    let mut search = Search::of(&mut simulation, options);
    let Some(seconds) = period.seconds else {
        let tran = parts.0.tran.ok_or_else(|| {
            none("no source repeats, and there is no `.tran` that says how long to look for rest: `.tran 1u 1m` looks for 1 ms".into())
        })?;
        return match search.autonomous(tran.tstop) {
            Ok(found) => Ok((simulation, found)),
            Err(error) if tran.uic && matches!(error.reason, Reason::NoOrbit(_)) => {
                operating_point(parts, tran, method, options)?.ok_or(error)
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
    method: Method,
    options: &PeriodicOptions<'_>,
) -> Result<Option<(Simulation, Found)>, Error> {
    let circuit = Circuit {
        tran: Some(Tran { uic: false, ..tran }),
        ..circuit.clone()
    };
    let Ok(mut simulation) = simulation((&circuit, multiport), None, (1.0, method), options) else {
        return Ok(None);
    };
    let found = Search::of(&mut simulation, options).rest_from_here(tran.tstop)?;
    Ok(found.map(|found| (simulation, found)))
}

/// Where laws are curved: the orbit of steps half as long in place of `found`, and how far the two are apart relative to the amplitudes;
/// nothing where it is not found.
pub(super) fn refined(
    parts: (&Circuit, &StaticMultiport),
    found: &mut Found,
    period: Option<f64>,
    method: Method,
    options: &PeriodicOptions<'_>,
) -> Result<Option<f64>, Error> {
    let mut finer = simulation(parts, period, (FINER, method), options)?;
    let Some(fixed) = Search::of(&mut finer, options).again(found)? else {
        return Ok(None);
    };
    let both = fixed.stand.state.iter().zip(&found.fixed.stand.state);
    let apart = both.zip(&found.amplitudes);
    let apart = apart.fold(0.0_f64, |m, ((a, b), size)| m.max((a - b).abs() / size));
    found.fixed = fixed;
    Ok(Some(apart))
}

/// A simulation that shoots: no rows, an end that is never reached, and where laws are curved, or a method in steps is asked for, steps of `part` of the usual ones.
pub(super) fn simulation(
    (circuit, multiport): (&Circuit, &StaticMultiport),
    period: Option<f64>,
    (part, method): (f64, Method),
    options: &PeriodicOptions<'_>,
) -> Result<Simulation, Error> {
    let span = period.or(circuit.tran.map(|t| t.tstop)).unwrap_or(1.0);
    let of = |step: Option<f64>| {
        from_rest(searching(circuit.tran, span, LONGEST_SEARCH), |tran| {
            let circuit = Circuit {
                tran: Some(tran),
                ..circuit.clone()
            };
            let options = SimulationOptions {
                method,
                step,
                settings: options.settings.clone(),
                ..SimulationOptions::default()
            };
            Simulation::closed(&circuit, multiport, options)
        })
    };
    if method == Method::Auto {
        let simulation = of(None)?;
        if simulation.is_exact() {
            return Ok(simulation);
        }
    }
    // Steps that an error control chooses differ from return to return, and with them what they return to.
    of(Some(part * span / PARTS_OF_PERIOD))
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
