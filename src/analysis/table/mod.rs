//! Means, root mean squares, extrema and powers of all elements, in closed form between events.

mod columns;
mod commutation;
mod entries;
mod exact;
mod extrema;
mod heat;
mod integrals;
mod losses;
mod means;
mod rows;

use std::sync::atomic::AtomicBool;

use self::columns::{Columns, Sums};
pub(super) use self::entries::{Entries, TABLE, entries};
pub use self::means::{
    DeviceLosses, ElementMeans, Mean, SignalMeans, Span, Switching, Table, Throughput,
};
use super::periodic::{PeriodicOptions, common_period, settled};
use super::start::{beginning, course};
use super::variation::Course;
use crate::circuit::{Circuit, Tran, is_inside};
use crate::integrate::{Error, Method, Note, Reason, Run, SimOptions, Standing};
use crate::model::Model;
use crate::settings::Settings;
use crate::settings::tolerances::periodic::{BALANCED, STORED};

/// Rows of a run in steps at least: a coarser print step is divided.
const ROWS: usize = 2000;

/// What a table may be asked for.
#[derive(Debug, Clone, Default)]
pub struct TableOptions<'a> {
    /// Elements from which the input power comes; by default all independent sources, and controlled ones and negative resistances where these deliver more than
    /// they take together.
    pub inputs: Vec<String>,
    /// Elements that take the output power; by default those whose current the circuit shows besides sources, storage, switches, diodes, transistors and thyristors,
    /// else the resistors across voltages that it shows.
    pub outputs: Vec<String>,
    /// Where the transient begins, in place of its initial conditions or operating point.
    pub start: Option<Standing>,
    /// The method of the transient.
    pub method: Method,
    /// θ, default ½ (1 for `euler`).
    pub theta: Option<f64>,
    /// γ, default ½ (1 for `euler`).
    pub gamma: Option<f64>,
    /// Fixed step, s.
    pub step: Option<f64>,
    /// Ends the run when set.
    pub cancel: Option<&'a AtomicBool>,
    /// Tolerances.
    pub settings: Settings,
}

/// The means of all elements over the transient of `.tran`, from tstart⁺ to tstop.
///
/// Between events every quantity is y = c w with w' = 𝒜 w; ∫ w dt and ∫ w wᵀ dt are closed forms, and extrema are where c 𝒜 w vanishes. Where
/// steps are made, they are those of straight lines between rows, and a note says so.
///
/// # Errors
/// An element that is not there; else as [`Model::transient`].
///
/// # Example
/// The ripple of a rectifier's current.
/// ```
/// use circ::analysis::{TableOptions, table};
///
/// let text = "rectifier\nv1 1 0 sin(0 10 50)\nd1 1 2 d\nr1 2 0 5\n.model d d(ideal)\n.tran 1m 20m\n.save i(r1)\n.end\n";
/// let model = circ::Model::parse(text, "rectifier.cir")?;
/// let table = table(&model, &TableOptions::default())?;
/// let r1 = table.element("r1").unwrap();
/// assert!((r1.i.mean - 2.0 / std::f64::consts::PI).abs() < 1e-14 && (r1.i.rms - 1.0).abs() < 1e-14);
/// assert!((r1.i.max - 2.0).abs() < 1e-14 && (table.power.efficiency.unwrap() - 1.0).abs() < 1e-14);
/// # Ok::<(), circ::Error>(())
/// ```
pub fn table(model: &Model, options: &TableOptions<'_>) -> Result<Table, Error> {
    let columns = Columns::of(model.circuit(), &options.inputs, &options.outputs)?;
    let probing = columns.probing(model)?;
    let Some(tran) = model.circuit().tran else {
        let what = "the netlist asks for no .tran analysis";
        return Err(Error::before(Reason::Unsupported(what.into())));
    };
    let asked = (options.cancel, &options.settings);
    let (start, _) = beginning(model, options.start.clone(), asked)?;
    let span = Span {
        from: start.as_ref().map_or(0.0, |s| s.t).max(tran.tstart),
        to: tran.tstop,
    };
    let period = common_period(model.circuit()).filter(|period| *period <= span.to - span.from);
    let whole = (span.from, span.to);
    if let Some(course) = course(&probing, options.method, start.as_ref(), whole, asked)? {
        return columns.exact(&course, span, (period, false));
    }
    let rows = |tran: Tran| {
        if options.step.is_none() {
            finer(tran)
        } else {
            tran
        }
    };
    let circuit = Circuit {
        tran: Some(rows(tran)),
        ..probing.circuit().clone()
    };
    let run = probing.with_circuit(circuit)?.transient(SimOptions {
        method: options.method,
        theta: options.theta,
        gamma: options.gamma,
        step: options.step,
        corners: true,
        cancel: options.cancel,
        start,
        settings: options.settings.clone(),
        unestimated: true,
        ..SimOptions::default()
    })?;
    Ok(columns.of_rows(&run, span, (period, false)))
}

/// That a circuit has these inputs and outputs of a table.
///
/// # Errors
/// The first one that is not there.
#[cfg(feature = "cli")]
pub(crate) fn table_names(
    circuit: &Circuit,
    inputs: &[String],
    outputs: &[String],
) -> Result<(), Error> {
    Columns::of(circuit, inputs, outputs).map(drop)
}

/// The means of all elements over a period of the steady state of [`periodic`](super::periodic()).
///
/// # Errors
/// An element that is not there; else as [`periodic`](super::periodic()).
pub fn periodic_table(
    model: &Model,
    (inputs, outputs): (&[String], &[String]),
    options: &PeriodicOptions<'_>,
) -> Result<Table, Error> {
    let columns = Columns::of(model.circuit(), inputs, outputs)?;
    let probing = columns.probing(model)?;
    let mut found = settled(&probing, options)?;
    let orbit = found.orbit();
    let fundamental = Some(orbit.period / orbit.order as f64);
    let course = found
        .whole()
        .map_or(Ok(None), |steady| steady.course(options.cancel))?;
    if let Some((course, from)) = course {
        let span = Span {
            from,
            to: from + orbit.period,
        };
        let mut table = columns.exact(&course, span, (fundamental, true))?;
        table.span = Span {
            from: 0.0,
            to: orbit.period,
        };
        return Ok(table);
    }
    let options = PeriodicOptions {
        corners: true,
        ..options.clone()
    };
    let (orbit, run) = found.on_grid(&options, finer)?;
    let span = Span {
        from: 0.0,
        to: orbit.period,
    };
    Ok(columns.of_rows(&run, span, (fundamental, true)))
}

impl Columns<'_> {
    /// With the period of the sources, and whether the span is one after which all begins anew.
    fn exact(
        &self,
        course: &Course,
        span: Span,
        (period, closes): (Option<f64>, bool),
    ) -> Result<Table, Error> {
        let sums = exact::sums(self, course, span, (period, closes))?;
        Ok(self.table(&sums, span, period, true))
    }

    fn of_rows(&self, run: &Run, span: Span, (period, closes): (Option<f64>, bool)) -> Table {
        let sums = rows::sums(self, run, span, (period, closes));
        let mut table = self.table(&sums, span, period, false);
        let text = "the table is that of straight lines between steps, and not exact";
        table.notes.push(Note::run("not-exact", text));
        table
    }

    fn table(&self, sums: &Sums, span: Span, period: Option<f64>, exact: bool) -> Table {
        let seconds = span.to - span.from;
        let mean = |k: usize| Mean {
            mean: sums.mean[k] / seconds,
            rms: (sums.square[k] / seconds).sqrt(),
            min: sums.least[k],
            max: sums.greatest[k],
        };
        let names = |all: &[usize]| -> Vec<String> {
            all.iter()
                .map(|k| self.circuit.elements[*k].name.clone())
                .collect()
        };
        let elements = self.circuit.elements.iter().zip(&self.elements).enumerate();
        let work = |k: usize| self.whole(k).map(|part| sums.work[part]).sum::<f64>();
        let elements = elements.map(|(k, (element, (i, _)))| ElementMeans {
            name: element.name.clone(),
            i: mean(*i),
            v: mean(self.across[k]),
            power: work(k) / seconds,
            losses: None,
        });
        let mut elements: Vec<ElementMeans> = elements.collect();
        let signals = self.shown.iter().zip(&sums.distortion).map(|(k, thd)| {
            let value = mean(*k);
            let name = self.probes[*k].name.clone();
            SignalMeans {
                unit: crate::waveform::unit_of(&name),
                name,
                value,
                ripple: value.max - value.min,
                thd: *thd,
            }
        });
        let sum = |all: &[usize]| all.iter().map(|k| work(*k)).sum::<f64>();
        let moved: f64 = self.active.iter().map(|k| work(*k).abs()).sum();
        let mut inputs = self.inputs.clone();
        if -sum(&self.active) > BALANCED * moved {
            inputs.extend(&self.active);
        }
        let (input, output) = (-sum(&inputs), sum(&self.outputs));
        let known = input > 0.0 && !self.outputs.is_empty();
        let stored = self.storage.iter().map(|k| sums.work[*k]).sum::<f64>() / input;
        let lost = losses::lost(self, &elements, &sums.costs, seconds);
        let own = lost.losses.iter().flatten().map(|device| device.switching);
        let switching = (!self.circuit.losses.is_empty()).then(|| own.sum::<f64>());
        for (element, losses) in elements.iter_mut().zip(lost.losses) {
            element.losses = losses;
        }
        elements.retain(|element| !is_inside(&element.name));
        let notes = (known && stored.abs() > STORED).then(|| {
            let (share, verb) = (100.0 * stored.abs(), if stored > 0.0 { "went into" } else { "came out of" });
            Note::run("stored-energy", format!(
                "{share:.1} % of the input {verb} capacitors and inductors: the efficiency is that of this span; `circ pss --table` has that of the steady state"
            ))
        });
        let struck = self.shown.iter().zip(&sums.struck);
        let struck = struck.filter(|(_, struck)| **struck);
        let struck: Vec<&str> = struck.map(|(k, _)| self.probes[*k].name.as_str()).collect();
        let impulses = (!struck.is_empty()).then(|| {
            Note::run("squares-of-impulses", format!(
                "no distortion of {}, whose impulses have no squares: root mean squares, least and greatest values are those without them",
                struck.join(", ")
            ))
        });
        Table {
            span,
            exact,
            elements,
            signals: signals.collect(),
            power: Throughput {
                input: input / seconds,
                output: output / seconds,
                efficiency: known.then(|| output / input),
                switching,
                efficiency_with_switching: switching
                    .filter(|_| known)
                    .map(|more| output / (input + more * seconds)),
                inputs: names(&inputs),
                outputs: names(&self.outputs),
            },
            fundamental: period.map(f64::recip),
            temperatures: lost.temperatures,
            notes: lost
                .notes
                .into_iter()
                .chain(notes)
                .chain(impulses)
                .collect(),
        }
    }
}

/// With so many rows at least.
fn finer(tran: Tran) -> Tran {
    let rows = crate::integrate::Grid::of(&tran).len();
    Tran {
        tstep: tran.tstep / ROWS.div_ceil(rows) as f64,
        ..tran
    }
}
