//! A transient with its measurements: the signals they need are simulated besides those that are shown, and taken away again.

mod measuring;
mod outcome;

use std::ops::ControlFlow;

use self::measuring::{Measuring, ROWS, begun};
pub use self::outcome::{Finished, Measurements, is_measured};
use super::conducting::conduction;
use super::curves::{MOST_VALUES, orbit_curves, shortest_period};
use super::density::Spikes;
use super::periodic::{PeriodicOptions, periodic, settled};
use crate::circuit::{Measured, Tran};
use crate::integrate::{Block, Error, Grid, Note, Orbit, Run, SimOptions};
use crate::measure::Signals;
use crate::model::Model;
use crate::settings::tolerances::times::ROWS_A_PERIOD;

/// The transient that `.tran` asks for, with what `.meas` and `.four` ask of it.
///
/// Of a run that is exact throughout they see what happens between events ([`Curves`](crate::measure::Curves)), else the rows, those at events and at corners of sources too, and at least
/// 2000 of the grid unless the step is fixed. Where there are any, [`SimOptions::rows`] and [`SimOptions::discard`] are not heeded: the rows are those of the run. `.tran … steady` begins at the
/// periodic steady state unless [`SimOptions::start`] says where.
///
/// # Returns
/// A run that broke off as far as it came, measured.
#[must_use]
pub fn transient(model: &Model, options: SimOptions<'_>) -> Finished {
    if !is_measured(model.circuit()) {
        return unmeasured(model, options);
    }
    let measuring = Measuring::of(model.circuit(), options.step.is_some());
    shown_of(measuring, model, options)
}

/// The same for pictures, which follow curves between output times: with rows of the kind [`RowKind::Between`](crate::integrate::RowKind::Between) where events, sources or the
/// curves themselves are faster than the grid.
///
/// There are 16 rows for each period of the fastest source, and the run is made again with closer rows where fewer than twice as many as at events turn out to be
/// between these, or where a third of them makes another line; the latter of exact runs alone, as others would take as long again. A fixed step,
/// and memory, set limits to that.
#[must_use]
pub fn pictured(model: &Model, options: SimOptions<'_>) -> Finished {
    let mut measuring = Measuring::of(model.circuit(), options.step.is_some());
    if options.step.is_none() {
        measuring.picture(model, options.settings.max_held / size_of::<f64>());
    }
    shown_of(measuring, model, options)
}

/// A run with its measurements, of which what is shown remains.
fn shown_of(measuring: Measuring<'_>, model: &Model, options: SimOptions<'_>) -> Finished {
    let (measuring, mut finished) = observed(measuring, model, options);
    if let Some((run, found)) = &mut finished.run {
        if measuring.by_rows() {
            run.notes.extend(measuring.on_rows(run, found));
        }
        let mut spikes = Spikes::of(step_of(measuring.fine()));
        let columns = run.waveforms.units.len();
        spikes.see(columns, Block::of(&run.waveforms, &run.kinds));
        let note = spike(&spikes, run, measuring.by_rows());
        run.notes.extend(note);
        found.conduction = conduction(&run.waveforms, &measuring.curved);
        (run.waveforms, run.kinds) = measuring.cut(run);
    }
    finished
}

fn step_of(tran: Option<Tran>) -> f64 {
    tran.map_or(0.0, |tran| tran.tstep)
}

/// Tells of a spike in the rows of a run; `by_rows`: measurements see them.
fn spike(spikes: &Spikes, run: &Run, by_rows: bool) -> Option<Note> {
    let events: Vec<f64> = run.events.iter().map(|event| event.t).collect();
    let waves = &run.waveforms;
    let (j, value, t) = spikes.found(&waves.units, &events)?;
    let (name, unit) = (&waves.names[j], waves.units[j]);
    let cause = match unit {
        "A" => {
            "a capacitor that a switch or diode connects, to which its `Ron` alone stands in the way"
        }
        _ => {
            "a current that a switch or diode interrupts, which its `Roff` has to take (a diode, a clamp or a snubber would)"
        }
    };
    let means = if by_rows {
        "`.meas` takes the fall as a straight line, and means are wrong by that; `--table` has exact ones"
    } else {
        "Means of rows would be wrong by that; `.meas` and `--table` have exact ones"
    };
    Some(Note::run(
        "spike",
        format!(
            "{name} is {value:.3e} {unit} at t = {t:e} s, and has fallen before the next row: as a rule {cause}. {means}"
        ),
    ))
}

/// The transient of a circuit without measurements, whose rows are looked at as they pass.
fn unmeasured(model: &Model, mut options: SimOptions<'_>) -> Finished {
    let columns = model.multiport().probes;
    let mut spikes = Spikes::of(step_of(model.circuit().tran));
    let mut sink = options.rows.take();
    let mut take = |block: Block<'_>| {
        spikes.see(columns, block);
        sink.as_mut()
            .map_or(ControlFlow::Continue(()), |sink| sink(block))
    };
    let asked = SimOptions {
        rows: Some(&mut take),
        ..options.again()
    };
    let mut finished = begun(model, model, asked);
    if let Some((run, _)) = &mut finished.run {
        let note = spike(&spikes, run, false);
        run.notes.extend(note);
    }
    finished
}

/// What `.meas` finds in the transient of a model, without its rows where they are not needed; where they are, those of the first grid, or `closer` ones where
/// they turn out to be too far apart.
///
/// # Errors
/// The run's, wherever it breaks off.
pub(super) fn measured(
    model: &Model,
    mut options: SimOptions<'_>,
    closer: bool,
) -> Result<Vec<Measured>, Error> {
    let mut measuring = Measuring::of(model.circuit(), options.step.is_some());
    measuring.draw(model, &mut options);
    if let Some(curves) = &measuring.curves {
        return Ok(model.circuit().measure(&Signals::Curves(curves)));
    }
    whole(if closer {
        observed(measuring, model, options).1
    } else {
        measuring.run(model, &mut options)
    })
}

fn whole(finished: Finished) -> Result<Vec<Measured>, Error> {
    match finished.error {
        Some(error) => Err(error),
        None => Ok(finished
            .run
            .map(|(_, found)| found.measured)
            .unwrap_or_default()),
    }
}

/// A run with its measurements, made again on closer rows where those of the first one turn out to be too far apart for them.
fn observed<'a>(
    mut measuring: Measuring<'a>,
    model: &Model,
    mut options: SimOptions<'_>,
) -> (Measuring<'a>, Finished) {
    if let Err(error) = measuring.room(options.settings.max_held) {
        return (measuring, Finished::of(Err(error)));
    }
    let note = measuring.draw(model, &mut options);
    let mut finished = measuring.run(model, &mut options);
    // First as many as events ask for, then as curves do.
    for _ in 0..2 {
        let closer = match &finished {
            Finished {
                run: Some((run, found)),
                error: None,
            } if options.step.is_none() => measuring.closer(run, found),
            _ => None,
        };
        let Some(divisions) = closer else {
            break;
        };
        let before = std::mem::replace(&mut measuring.divisions, divisions);
        let again = measuring.run(model, &mut options);
        if again.error.is_some() {
            // Interrupted: what is there already is whole.
            measuring.divisions = before;
            break;
        }
        finished = again;
    }
    if let Some((run, _)) = &mut finished.run {
        run.notes.extend(note);
    }
    (measuring, finished)
}

/// The orbit of [`periodic`](super::periodic()), with what `.meas` and `.four` ask of it.
///
/// They see it repeated until the end of `.tran`, two periods at least, as a transient that began on it long ago would show it: windows and
/// times mean what they mean there. Where that takes more than four million values the first periods are left out, and a note says so.
///
/// # Errors
/// As [`periodic`](super::periodic()).
pub fn periodic_measured(
    model: &Model,
    options: &PeriodicOptions<'_>,
) -> Result<(Orbit, Run, Measurements), Error> {
    let circuit = model.circuit();
    if !is_measured(circuit) {
        let (orbit, run) = periodic(model, options)?;
        return Ok((orbit, run, Measurements::default()));
    }
    let mut measuring = Measuring::of(circuit, false);
    let probing = measuring.probing(model, circuit.tran)?;
    let options = PeriodicOptions {
        corners: true,
        ..options.clone()
    };
    let mut found = settled(&probing, &options)?;
    let drawn = (found.whole()).and_then(|steady| orbit_curves(circuit, steady, options.cancel));
    let (curves, note) = drawn.map_or((None, None), |(curves, note)| (Some(curves), note));
    measuring.curves = curves;
    let by_rows = measuring.by_rows();
    let (orbit, mut run) = found.on_grid(&options, |tran| {
        let rows = Grid::of(&tran).len();
        // As close as those of the transient, and as the sources ask for.
        let span = tran.tstop - tran.tstart;
        let asked = circuit.tran.map_or(0.0, |own| span / own.tstep);
        let wanted = (ROWS_A_PERIOD * span / shortest_period(&probing)).max(asked);
        let most = MOST_VALUES / (probing.circuit().probes().len() + 1);
        let wanted = (wanted.ceil() as usize).min(most).max(ROWS);
        measuring.divisions = if by_rows { wanted.div_ceil(rows) } else { 1 };
        measuring.tran = Some(Tran {
            tstart: 0.0,
            tstop: tran.tstop - tran.tstart,
            ..tran
        });
        Tran {
            tstep: tran.tstep / measuring.divisions as f64,
            ..tran
        }
    })?;
    run.notes.extend(note);
    let found = measuring.carry_out_repeated(&mut run, orbit.period);
    Ok((orbit, run, found))
}
