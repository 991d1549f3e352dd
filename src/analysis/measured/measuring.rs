//! The signals and rows of a run that measurements and pictures need, besides those that are shown.

use super::outcome::{Finished, Measurements, is_measured};
use crate::analysis::conducting::curved_currents;
use crate::analysis::curves::{MOST_VALUES, laps, shortest_period, transient_curves};
use crate::analysis::density::{Cut, bent, crowd};
use crate::analysis::start::beginning;
use crate::circuit::{Circuit, Harmonics, Probe, Tran};
use crate::integrate::{Block, Error, Grid, Method, Note, RowKind, Run, SimOptions};
use crate::measure::{Curves, Signals};
use crate::model::Model;
use crate::settings::tolerances::times::{
    CROWDED, LINES_CLOSE, NOTHING, ROWS_A_PERIOD, ROWS_APART, ROWS_CLOSE,
};
use crate::waveform::Waveforms;

/// Rows that measurements see at least, besides those at events: a coarser print step is divided for them.
pub(super) const ROWS: usize = 2000;

/// Values of a picture between output times at most.
const MOST_PICTURED: usize = 1_000_000;

/// The transient of `shown`, which is `model` with other signals, from where `model` has it begin.
pub(super) fn begun(model: &Model, shown: &Model, mut options: SimOptions<'_>) -> Finished {
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

/// What a circuit's measurements need, and how its results are shown without that.
pub(super) struct Measuring<'a> {
    circuit: &'a Circuit,
    /// What the rows that are shown cover.
    pub(super) tran: Option<Tran>,
    /// Rows that are computed for each row that is shown.
    pub(super) divisions: usize,
    /// Columns that are shown.
    shown: usize,
    /// Values that a picture has room for, where the rows between are shown, too.
    pictured: Option<usize>,
    /// Currents that a picture looks at besides: of devices that no event tells of.
    pub(super) curved: Vec<Probe>,
    /// What the measurements see instead of rows, where the run is exact throughout.
    pub(super) curves: Option<Curves>,
}

impl<'a> Measuring<'a> {
    pub(super) fn of(circuit: &'a Circuit, fixed_step: bool) -> Self {
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
    pub(super) fn by_rows(&self) -> bool {
        is_measured(self.circuit) && self.curves.is_none()
    }

    /// Whether so many bytes hold the rows that are shown: refused before anything is computed.
    ///
    /// # Errors
    /// As [`Grid::check`].
    pub(super) fn room(&self, held: usize) -> Result<(), Error> {
        let most = Some(Grid::most(self.shown, held));
        self.tran
            .map_or(Ok(()), |tran| Grid::of(&tran).check(self.shown, most))
    }

    /// Takes in what happens between events, where the run is exact throughout; and has the run begin where the model says, of which a note may tell.
    pub(super) fn draw(&mut self, model: &Model, options: &mut SimOptions<'_>) -> Option<Note> {
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
    pub(super) fn picture(&mut self, model: &Model, held: usize) {
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
    pub(super) fn run(&self, model: &Model, options: &mut SimOptions<'_>) -> Finished {
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
    pub(super) fn probing(&self, model: &Model, tran: Option<Tran>) -> Result<Model, Error> {
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
    pub(super) fn fine(&self) -> Option<Tran> {
        self.tran.map(|tran| Tran {
            tstep: tran.tstep / self.divisions as f64,
            ..tran
        })
    }

    /// Measures on all rows, which repeat, then leaves only what is shown.
    pub(super) fn carry_out_repeated(&self, run: &mut Run, period: f64) -> Measurements {
        let (mut repeated, mut note) = ((0, 1), None);
        if self.by_rows() {
            let (span, values) = (self.circuit.measured_span(), run.waveforms.values.len());
            (repeated, note) = laps(span, period, values);
        }
        run.notes.extend(note);
        let found = self.found(&run.waveforms, repeated, period);
        (run.waveforms, run.kinds) = self.cut(run);
        found
    }

    /// What measurements find on rows that are repeated from one lap to another.
    pub(super) fn found(
        &self,
        waves: &Waveforms,
        (from, to): (usize, usize),
        period: f64,
    ) -> Measurements {
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
        let coarse = self.found(&some, (0, 1), 0.0);
        let pairs = found.measured.iter().zip(&coarse.measured);
        let both = pairs.filter_map(|(fine, coarse)| {
            let (a, b) = (
                fine.result.as_ref().ok()?.value,
                coarse.result.as_ref().ok()?.value,
            );
            let larger = a.abs().max(b.abs()).max(least);
            Some((&fine.name[..], [a, b], (a - b).abs() / larger))
        });
        // Of a spectrum the harmonic that is off most, relative to the largest.
        let pairs = found.harmonics.iter().zip(&coarse.harmonics);
        let spectra = pairs.filter_map(|(fine, coarse)| {
            let magnitudes = |of: &Harmonics| -> Option<Vec<f64>> {
                let spectrum = of.result.as_ref().ok()?;
                Some(spectrum.harmonics.iter().map(|h| h.magnitude).collect())
            };
            let (a, b) = (magnitudes(fine)?, magnitudes(coarse)?);
            let largest = a.iter().chain(&b).fold(least, |m: f64, v| m.max(*v));
            let off = |k: usize| (a[k] - b[k]).abs() / largest;
            let most = (0..a.len()).max_by(|j, k| off(*j).total_cmp(&off(*k)))?;
            Some((&fine.signal[..], [a[most], b[most]], off(most)))
        });
        both.chain(spectra).filter(|(.., off)| *off > 0.0).collect()
    }

    /// How often the print step is to be divided for rows that are close enough: twice as many as at events and corners, beside which fewer say nothing;
    /// and what straight lines leave out falls with the square of their length.
    pub(super) fn closer(&self, run: &Run, found: &Measurements) -> Option<usize> {
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

    /// Names the measurements of which even so [`ROWS_APART`] depends on the rows; where there are none, tells of an exact run that lines stand between its rows, and what part of a
    /// measurement depends on these at most.
    pub(super) fn on_rows(&self, run: &Run, found: &Measurements) -> Option<Note> {
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
        if !off.is_empty() {
            return Some(Note::run(
                "rows-apart",
                format!(
                    "rows may be too far apart for {}: between them curves count as straight lines. A shorter print step, as in `.tran 10n 1m`, or a shorter \
                 largest step, `.tran 0 1m 0 10n`, tells",
                    off.join(", ")
                ),
            ));
        }
        let most = thinned.iter().fold(0.0, |m: f64, (.., off)| m.max(*off));
        (run.method == Method::Exact.name() && most > 0.0).then(|| {
            Note::run("measured-on-rows", format!(
                "measurements see straight lines between the rows of this run, as what lies between its events takes too long to see, or is not known: with a third of the rows they change by up \
                 to {most:.1e} of their value"
            ))
        })
    }

    /// The signals that are shown, at the print steps, at events, and for pictures between.
    pub(super) fn cut(&self, run: &Run) -> (Waveforms, Vec<RowKind>) {
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
