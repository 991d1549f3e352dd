//! A transient with its measurements: the signals they need are simulated besides those that are shown, and taken away again.

use std::ops::ControlFlow;

use super::conducting::{Conduction, conduction, curved_currents};
use super::curves::{MOST_VALUES, laps, orbit_curves, shortest_period, transient_curves};
use super::density::{Cut, Spikes, bent, crowd};
use super::periodic::{PeriodicOptions, periodic, settled};
use super::start::beginning;
use super::table::Table;
use super::worst::Worst;
use crate::circuit::{Circuit, Harmonics, Measured, Probe, Tran};
use crate::integrate::{Block, Error, Grid, Method, Note, Orbit, RowKind, Run, SimOptions};
use crate::measure::{Curves, Signals};
use crate::model::Model;
use crate::settings::tolerances::times::{
    CROWDED, LINES_CLOSE, NOTHING, ROWS_A_PERIOD, ROWS_APART, ROWS_CLOSE,
};
use crate::waveform::Waveforms;

/// Rows that measurements see at least, besides those at events: a coarser print step is divided for them.
const ROWS: usize = 2000;

/// Values of a picture between output times at most.
const MOST_PICTURED: usize = 1_000_000;

/// The outcome of the measurements of one run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Measurements {
    /// Of `.meas`, in file order.
    pub measured: Vec<Measured>,
    /// Of `.four`, in file order.
    pub harmonics: Vec<Harmonics>,
    /// The means of all elements, where they were asked for.
    pub table: Option<Table>,
    /// The ranges of measurements within tolerances, where they were asked for.
    pub worst: Vec<Worst>,
    /// Of a run for pictures when devices of curved laws conduct, which none of its events tells.
    pub conduction: Vec<Conduction>,
}

impl Measurements {
    /// Whether nothing was asked for.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.measured.is_empty()
            && self.harmonics.is_empty()
            && self.table.is_none()
            && self.worst.is_empty()
    }
}

/// A run, or as much of it as there is.
#[derive(Debug)]
pub struct Finished {
    /// The rows, and what was measured on them.
    pub run: Option<(Run, Measurements)>,
    /// Why it ended early.
    pub error: Option<Error>,
}

impl Finished {
    /// A run without measurements.
    #[must_use]
    pub fn of(result: Result<Run, Error>) -> Self {
        let (run, error) = match result {
            Ok(run) => (Some(run), None),
            Err(mut error) => (error.partial.take().map(|run| *run), Some(error)),
        };
        Self {
            run: run.map(|run| (run, Measurements::default())),
            error,
        }
    }
}

/// Whether a circuit asks for measurements; then [`transient`] holds its rows until the end.
#[must_use]
pub fn is_measured(circuit: &Circuit) -> bool {
    !circuit.measured.is_empty() || !circuit.measurements.is_empty()
}

/// The transient that `.tran` asks for, with what `.meas` and `.four` ask of it.
///
/// Of a run that is exact throughout they see what happens between events ([`Curves`]), else the rows, those at events and at corners of sources too, and at least
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

/// The same for pictures, which follow curves between output times: with rows of the kind [`RowKind::Between`] where events, sources or the
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
            run.notes.extend(measuring.too_coarse(run, found));
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

/// The transient of `shown`, which is `model` with other signals, from where `model` has it begin.
fn begun(model: &Model, shown: &Model, mut options: SimOptions<'_>) -> Finished {
    let asked = (options.cancel, &options.settings);
    let note = match beginning(model, options.start.take(), asked) {
        Ok((start, note)) => {
            options.start = start;
            note
        }
        Err(error) => return Finished::of(Err(error)),
    };
    let mut finished = Finished::of(shown.transient(options));
    if let Some((run, _)) = &mut finished.run {
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

/// What a circuit's measurements need, and how its results are shown without that.
struct Measuring<'a> {
    circuit: &'a Circuit,
    /// What the rows that are shown cover.
    tran: Option<Tran>,
    /// Rows that are computed for each row that is shown.
    divisions: usize,
    /// Columns that are shown.
    shown: usize,
    /// Values that a picture has room for, where the rows between are shown, too.
    pictured: Option<usize>,
    /// Currents that a picture looks at besides: of devices that no event tells of.
    curved: Vec<Probe>,
    /// What the measurements see instead of rows, where the run is exact throughout.
    curves: Option<Curves>,
}

impl<'a> Measuring<'a> {
    fn of(circuit: &'a Circuit, fixed_step: bool) -> Self {
        let rows = circuit.tran.map_or(ROWS, |tran| Grid::of(&tran).len());
        Self {
            circuit,
            tran: circuit.tran,
            // A fixed step is the user's choice of accuracy, which rows between would change.
            divisions: if fixed_step { 1 } else { ROWS.div_ceil(rows) },
            shown: circuit.probes().len(),
            pictured: None,
            curved: vec![],
            curves: None,
        }
    }

    /// Whether measurements see rows.
    fn by_rows(&self) -> bool {
        is_measured(self.circuit) && self.curves.is_none()
    }

    /// Whether so many bytes hold the rows that are shown: refused before anything is computed.
    ///
    /// # Errors
    /// As [`Grid::check`].
    fn room(&self, held: usize) -> Result<(), Error> {
        let most = Some(Grid::most(self.shown, held));
        self.tran
            .map_or(Ok(()), |tran| Grid::of(&tran).check(self.shown, most))
    }

    /// Takes in what happens between events, where the run is exact throughout; and has the run begin where the model says, of which a note may tell.
    fn draw(&mut self, model: &Model, options: &mut SimOptions<'_>) -> Option<Note> {
        if !self.by_rows() {
            return None;
        }
        let asked = (options.cancel, &options.settings);
        let (start, note) = beginning(model, options.start.take(), asked).ok()?;
        options.start = start;
        // What fails here fails in the run, or is measured on its rows.
        self.curves = transient_curves(model, options).ok().flatten();
        if self.curves.is_some() && self.pictured.is_none() {
            self.divisions = 1;
        }
        note
    }

    /// Shows rows between those of the grid, of so many values at most.
    fn picture(&mut self, model: &Model, held: usize) {
        let Some(tran) = self.circuit.tran else {
            return;
        };
        let (span, rows) = (tran.tstop - tran.tstart, Grid::of(&tran).len());
        // Half of what there is room for, as events have rows as well.
        let room = MOST_PICTURED.min(held / 2);
        let most = room / (rows * (self.shown + 1));
        let wanted = ROWS_A_PERIOD * span / shortest_period(model) / rows as f64;
        if self.by_rows() {
            self.divisions = self.divisions.max((wanted.ceil() as usize).min(most));
        } else {
            self.divisions = (wanted.ceil() as usize).min(most).max(1);
        }
        self.pictured = Some(room);
        self.curved = curved_currents(self.circuit);
    }

    /// A run on the finer grid, with the signals of the measurements after those that are shown.
    fn run(&self, model: &Model, options: &mut SimOptions<'_>) -> Finished {
        let probing = match self.probing(model, self.fine()) {
            Ok(probing) => probing,
            Err(error) => return Finished::of(Err(error)),
        };
        let options = SimOptions {
            corners: true,
            discard: false,
            ..options.again()
        };
        let mut finished = begun(model, &probing, options);
        if let Some((run, found)) = &mut finished.run {
            *found = self.found(&run.waveforms, (0, 1), 0.0);
        }
        finished
    }

    /// The same circuit with the signals of its measurements after those that are shown.
    fn probing(&self, model: &Model, tran: Option<Tran>) -> Result<Model, Error> {
        let mut probes = self.circuit.probes();
        let measured = self.circuit.measured.iter().filter(|_| self.by_rows());
        for probe in measured.chain(&self.curved) {
            if !probes.contains(probe) {
                probes.push(probe.clone());
            }
        }
        model.with_circuit(Circuit {
            probes,
            tran,
            ..self.circuit.clone()
        })
    }

    /// The transient with the print step of the run.
    fn fine(&self) -> Option<Tran> {
        self.tran.map(|tran| Tran {
            tstep: tran.tstep / self.divisions as f64,
            ..tran
        })
    }

    /// Measures on all rows, which repeat, then leaves only what is shown.
    fn carry_out_repeated(&self, run: &mut Run, period: f64) -> Measurements {
        let (mut repeated, mut note) = ((0, 1), None);
        if self.by_rows() {
            (repeated, note) = laps(self.circuit.tran, period, run.waveforms.values.len());
        }
        run.notes.extend(note);
        let found = self.found(&run.waveforms, repeated, period);
        (run.waveforms, run.kinds) = self.cut(run);
        found
    }

    /// What measurements find on rows that are repeated from one lap to another.
    fn found(&self, waves: &Waveforms, (from, to): (usize, usize), period: f64) -> Measurements {
        if let Some(curves) = &self.curves {
            return self.seen(&Signals::Curves(curves));
        }
        let repeated = |lap: &dyn Fn(usize, &mut Vec<f64>)| {
            let mut all = Vec::with_capacity((to - from) * waves.time.len());
            (from..to).for_each(|k| lap(k, &mut all));
            all
        };
        let time = repeated(&|lap, all| {
            all.extend(waves.time.iter().map(|t| t + lap as f64 * period));
        });
        let column = |probe: &Probe| {
            let index = waves.names.iter().position(|name| *name == probe.name)?;
            Some(repeated(&|_, all| all.extend(waves.column(index))))
        };
        self.seen(&self.circuit.seen(&time, &column))
    }

    fn seen(&self, signals: &Signals<'_>) -> Measurements {
        Measurements {
            measured: self.circuit.measure(signals),
            harmonics: self.circuit.harmonics(signals),
            ..Measurements::default()
        }
    }

    /// The measurements that come out otherwise where two of three rows of the grid after each event or corner are left out, as they are and so, and the
    /// difference over the larger one. (Every other row, or every third from the start on, may show all of a curve in the course of several periods.)
    fn thinned<'m>(&self, run: &Run, found: &'m Measurements) -> Vec<(&'m str, [f64; 2], f64)> {
        let mut some = Waveforms {
            names: run.waveforms.names.clone(),
            units: run.waveforms.units.clone(),
            ..Waveforms::default()
        };
        // Rows of the grid since the last event.
        let (mut k, last) = (0, run.waveforms.time.len());
        for (at, (t, values, kind)) in Block::of(&run.waveforms, &run.kinds).rows().enumerate() {
            k = if kind == RowKind::Grid { k + 1 } else { 0 };
            if k % 3 == 0 || at == 0 || at + 1 == last {
                some.time.push(t);
                some.values.extend_from_slice(values);
            }
        }
        // A mean that is zero but for rounding says nothing.
        let largest = run
            .waveforms
            .values
            .iter()
            .fold(0.0, |m: f64, v| m.max(v.abs()));
        let least = NOTHING * largest;
        let coarse = self.found(&some, (0, 1), 0.0).measured;
        let pairs = found.measured.iter().zip(&coarse);
        let both = pairs.filter_map(|(fine, coarse)| {
            let (a, b) = (
                fine.result.as_ref().ok()?.value,
                coarse.result.as_ref().ok()?.value,
            );
            let larger = a.abs().max(b.abs()).max(least);
            Some((&fine.name[..], [a, b], (a - b).abs() / larger))
        });
        both.filter(|(.., off)| *off > 0.0).collect()
    }

    /// How often the print step is to be divided for rows that are close enough: twice as many as at events and corners, beside which fewer say nothing;
    /// and what straight lines leave out falls with the square of their length.
    fn closer(&self, run: &Run, found: &Measurements) -> Option<usize> {
        let measured = self.by_rows();
        let room = match self.pictured {
            Some(_) if !measured && run.method != Method::Exact.name() => return None,
            Some(room) if !measured => room,
            _ => MOST_VALUES,
        };
        let crowd = crowd(&run.kinds);
        let needed = if crowd > 1.0 {
            crowd
        } else {
            let thinned = if measured {
                self.thinned(run, found)
            } else {
                vec![]
            };
            let off = thinned.iter().map(|(.., off)| *off).fold(0.0, f64::max);
            let lines = match self.pictured {
                Some(_) if run.method == Method::Exact.name() => {
                    bent(&run.waveforms, &run.kinds, self.shown) / LINES_CLOSE
                }
                _ => 0.0,
            };
            (off / ROWS_CLOSE).max(lines).sqrt()
        };
        let most = room / run.waveforms.values.len().max(1);
        let factor = (needed.ceil() as usize).min(most);
        (factor > 1).then(|| factor * self.divisions)
    }

    /// Names the measurements of which even so [`ROWS_APART`] depends on the rows.
    fn too_coarse(&self, run: &Run, found: &Measurements) -> Option<Note> {
        let thinned = self.thinned(run, found);
        let off = thinned.iter().filter(|(.., off)| *off > ROWS_APART);
        let off = off.map(|(name, [a, b], _)| {
            format!("{name} ({a:.4e}, and {b:.4e} with a third of the rows)")
        });
        let off: Vec<String> = off.collect();
        if off.is_empty() && crowd(&run.kinds) > CROWDED {
            let few = "measurements see fewer rows than half of those at events: between them curves count as straight lines; a shorter run, or fewer signals, has more";
            return Some(Note::run("rows-apart", few));
        }
        (!off.is_empty()).then(|| {
            Note::run("rows-apart", format!(
                "rows may be too far apart for {}: between them curves count as straight lines. A shorter print step, as in `.tran 10n 1m`, or a shorter \
                 largest step, `.tran 0 1m 0 10n`, tells",
                off.join(", ")
            ))
        })
    }

    /// The signals that are shown, at the print steps, at events, and for pictures between.
    fn cut(&self, run: &Run) -> (Waveforms, Vec<RowKind>) {
        let cut = Cut {
            columns: self.shown,
            grid: self.tran.map(|tran| Grid::of(&tran)),
            fine: self.fine().map(|tran| Grid::of(&tran).len()),
            divisions: self.divisions,
            between: self.pictured.is_some(),
        };
        cut.of(&run.waveforms, &run.kinds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;

    /// Twenty times as many rows would have two at every event.
    #[test]
    fn rows_are_as_close_as_events_want_them_and_memory_allows() {
        let text = "rc\nr1 1 0 1\nc1 1 0 1 ic=1\n.tran 1 1 uic\n.end\n";
        let model = Model::parse(text, "rc.cir").expect("a circuit");
        let mut run = model.transient(SimOptions::default()).expect("a run");
        run.kinds = [vec![RowKind::Grid], vec![RowKind::Event; 10]].concat();
        let mut closer = |values: usize| {
            run.waveforms.values = vec![0.0; values];
            let measuring = Measuring::of(model.circuit(), true);
            measuring.closer(&run, &Measurements::default())
        };
        assert_eq!(closer(0), Some(20));
        assert_eq!(closer(MOST_VALUES / 20), Some(20));
        assert_eq!(closer(MOST_VALUES / 3), Some(3));
        assert_eq!(closer(MOST_VALUES), None);
    }
}
