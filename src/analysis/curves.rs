//! The outputs of a run that is exact throughout, as smooth pieces that measurements see.

use std::sync::atomic::AtomicBool;

use super::periodic::Steady;
use super::start::course;
use super::variation::{Course, Linear, Motion, parts, unit};
use crate::circuit::{Circuit, Tran};
use crate::integrate::{Error, Note, SimOptions};
use crate::linalg::product::add_product;
use crate::measure::{Curves, VALUES};
use crate::model::Model;
use crate::settings::tolerances::times::{LAST_ROW, MOST_PERIODS, MOST_STATES};

/// Values that measurements see of a run at most.
pub(super) const MOST_VALUES: usize = 4_000_000;

/// What the measurements of a transient see, which begins where the options say. `None` where it is not exact throughout, or grows beyond the range of
/// numbers, or rows cost less.
///
/// # Errors
/// The run's; an exponential does not exist in doubles.
pub(super) fn transient_curves(
    model: &Model,
    options: &SimOptions<'_>,
) -> Result<Option<Curves>, Error> {
    let circuit = model.circuit();
    let own_steps = options.step.is_some() || options.theta.is_some() || options.gamma.is_some();
    let measured = &circuit.measured;
    let Some(tran) = circuit.tran.filter(|_| !own_steps && !measured.is_empty()) else {
        return Ok(None);
    };
    if is_large(model, &tran) {
        return Ok(None);
    }
    // A sweep has it show what is measured alone.
    let probing = if circuit.probes == *measured && circuit.columns.is_empty() {
        None
    } else {
        Some(model.with_circuit(Circuit {
            probes: measured.clone(),
            columns: vec![],
            ..circuit.clone()
        })?)
    };
    let probing = probing.as_ref().unwrap_or(model);
    let asked = (options.cancel, &options.settings);
    let start = options.start.as_ref();
    let first = circuit.measured_from(&tran).max(tran.tstart);
    let span = (first, tran.tstop);
    let Some(course) = course(probing, options.method, start, span, asked)? else {
        return Ok(None);
    };
    let outputs: Vec<usize> = (0..measured.len()).collect();
    // What is asked for at the end is seen there, too.
    let mut stretches = course.stretches.iter().rev();
    let last = stretches.find(|stretch| stretch.from < stretch.to);
    let last = last.map_or(tran.tstart, |stretch| stretch.from);
    let found = curves(&course, &outputs, first.min(last).max(tran.tstart))?;
    // What grows beyond the range of numbers ends the run, and rows tell when.
    Ok(found.filter(Curves::is_finite))
}

/// What the measurements of an orbit see, repeated until the end of `.tran`, and a note where that is not all of it.
pub(super) fn orbit_curves(
    circuit: &Circuit,
    steady: &mut Steady,
    cancel: Option<&AtomicBool>,
) -> Option<(Curves, Option<Note>)> {
    let period = steady.orbit().period;
    let outputs = circuit.measured.iter().map(|probe| {
        let mut names = steady.simulation.probes().iter();
        names.position(|name| *name == probe.name)
    });
    let outputs: Vec<usize> = outputs.collect::<Option<_>>()?;
    if outputs.is_empty() {
        return None;
    }
    let (course, from) = steady.course(cancel).ok()??;
    let curves = curves(&course, &outputs, from).ok()??;
    let (laps, note) = laps(circuit.measured_span(), period, curves.values());
    Some((curves.repeated(laps, period, from), note))
}

/// The periods of an orbit, of so many values each, that measurements see who see so much of a transient: those until its end, or the last of them, and a note.
pub(super) fn laps(
    (from, until): (f64, f64),
    period: f64,
    values: usize,
) -> ((usize, usize), Option<Note>) {
    let laps = (until / period - LAST_ROW).ceil().max(2.0) as usize;
    // One more, as rounding may have what is seen begin in the one before; and two at least.
    let first = (from / period).floor() as usize;
    let wanted = laps - first.saturating_sub(1).min(laps - 2);
    let kept = wanted.min((MOST_VALUES / values.max(1)).max(2));
    let note = (kept < wanted).then(|| {
        let text = format!(
            "measurements see the last {kept} of the {laps} periods until the end of `.tran`"
        );
        Note::run("last-periods", text)
    });
    ((laps - kept, laps), note)
}

/// The shortest period of its sources, s; ∞ where none repeats.
pub(crate) fn shortest_period(model: &Model) -> f64 {
    let sources = model.multiport().sources.iter();
    let periods = sources.filter_map(|source| source.input.source.wave.period());
    periods.fold(f64::INFINITY, f64::min)
}

/// Whether rows cost less than the exponentials of every mode and all changes of mode that measurements see.
pub(super) fn is_large(model: &Model, tran: &Tran) -> bool {
    let seconds = tran.tstop - model.circuit().measured_from(tran);
    model.multiport().storage.len() > MOST_STATES || seconds / shortest_period(model) > MOST_PERIODS
}

/// Pieces of these outputs from a time on; `None` where they are too many. Few exponentials of a mode are needed whatever happens in it.
fn curves(course: &Course, outputs: &[usize], from: f64) -> Result<Option<Curves>, Error> {
    let columns = outputs.len();
    let stretches = course.stretches.iter().filter(|stretch| stretch.to > from);
    let unit = unit(stretches.clone().map(|s| s.to - s.from).fold(0.0, f64::max));
    let (mut known, mut starts) = (Vec::new(), Vec::new());
    for stretch in stretches.clone() {
        starts.push(Linear::of(&mut known, &course.systems, stretch));
    }
    let mut motions: Vec<Motion<'_>> = known.iter().map(|linear| linear.over(unit)).collect();
    let mut found = Curves::of(columns);
    let room = MOST_VALUES / (columns * VALUES).max(1);
    let mut seen = Vec::new();
    let mut values = vec![[0.0; VALUES]; columns];
    for (stretch, (at, mut w)) in stretches.zip(starts) {
        let (seconds, age) = (stretch.to - stretch.from, (from - stretch.from).max(0.0));
        if age > 0.0 {
            w = known[at].over(age).after(0, &w)?;
        }
        let motion = &mut motions[at];
        for part in parts(&known[at].spectrum, unit, (age, seconds)) {
            if found.len() >= room {
                return Ok(None);
            }
            let [at_nodes, _] = motion.seen(part.level)?;
            seen.resize(at_nodes.nrows(), 0.0);
            seen.fill(0.0);
            add_product(&mut seen, at_nodes, w.as_slice());
            let (nodes, _) = seen.as_chunks::<VALUES>();
            for (values, output) in values.iter_mut().zip(outputs) {
                *values = nodes[*output];
            }
            let until = ((seconds - part.age) / part.length).min(1.0);
            if until == 1.0 {
                w = motion.after(part.level, &w)?;
            }
            found.push_cut((stretch.from + part.age, part.length, until), &values);
        }
    }
    for leap in course.leaps.iter().filter(|leap| leap.t >= from) {
        found.impulse(leap.t, outputs.iter().map(|k| leap.areas[*k]).collect());
    }
    Ok(Some(found))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a thousand periods those from the one before the first that is seen; two at least; and no more than there is room for, of which a note tells.
    #[test]
    fn an_orbit_is_repeated_as_far_as_it_is_seen() {
        let laps = |span, values| {
            let (laps, note) = laps(span, 1e-5, values);
            (laps, note.is_some())
        };
        assert_eq!(laps((9.005e-3, 10e-3), 100), ((899, 1000), false));
        assert_eq!(laps((9.995e-3, 10e-3), 100), ((998, 1000), false));
        assert_eq!(laps((10e-3, 10e-3), 100), ((998, 1000), false));
        assert_eq!(laps((0.0, 10e-3), 100), ((0, 1000), false));
        assert_eq!(laps((0.0, 0.0), 100), ((0, 2), false));
        let (room, each) = (50, MOST_VALUES / 50);
        assert_eq!(laps((9e-3, 10e-3), each), ((1000 - room, 1000), true));
        assert_eq!(laps((9.905e-3, 10e-3), each), ((989, 1000), false));
    }
}
