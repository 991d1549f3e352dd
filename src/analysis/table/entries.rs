//! The entries of a table as measurements, which have derivatives.
//!
//! What the table finds in closed form these find on the pieces of the waveform: means and root mean squares of currents, voltages and their products, extrema, and
//! THD = √(Y_ac² − Y₁²)/Y₁ with Y₁² = 2 (mean y cos ωt)² + 2 (mean y sin ωt)² over the last period.

use std::f64::consts::TAU;

use super::columns::Columns;
use super::means::Table;
use crate::analysis::periodic::common_period;
use crate::circuit::{Circuit, Formula, NamedMeasurement, Probe, is_inside};
use crate::integrate::Error;
use crate::measure::{Instant, Measurement, Over, Window};
use crate::settings::tolerances::periodic::FUNDAMENTAL;

/// What names of entries begin with.
pub(in crate::analysis) const TABLE: &str = "table.";

/// Measurements that are made together, and the signals that they see.
#[derive(Default)]
pub(in crate::analysis) struct Entries {
    signals: Vec<Probe>,
    all: Vec<NamedMeasurement>,
}

/// The entries of the table of a circuit with these inputs and outputs, by groups that are measured together; of a steady state or else a transient. Names are those of `--summary json`
/// with dots between: `table.l1.i.rms`, `table.probes.v(out).ripple`, `table.power.efficiency`; those that begin with a dot are used by others.
///
/// # Errors
/// An input or output that is not there.
pub(in crate::analysis) fn entries(
    circuit: &Circuit,
    (inputs, outputs): (&[String], &[String]),
    steady: bool,
) -> Result<Vec<Entries>, Error> {
    let columns = Columns::of(circuit, inputs, outputs)?;
    let mut all = vec![columns.powers()];
    let last = Last::of(circuit, steady);
    let shown = columns.shown.iter();
    all.extend(shown.map(|column| columns.signal(*column, last.as_ref())));
    let elements = circuit.elements.iter().enumerate();
    let shown = elements.filter(|(_, element)| !is_inside(&element.name));
    all.extend(shown.map(|(k, _)| columns.element(k)));
    Ok(all)
}

impl Table {
    /// What no waveform shows, by the names of [`entries`]: losses by tables, and temperatures.
    pub(in crate::analysis) fn costs(&self) -> Vec<(String, f64)> {
        let mut all = Vec::new();
        let mut add = |name: String, value: Option<f64>| {
            all.extend(value.map(|value| (format!("{TABLE}{name}"), value)));
        };
        for element in &self.elements {
            let Some(losses) = &element.losses else {
                continue;
            };
            for (entry, value) in [
                ("conduction", Some(losses.conduction)),
                ("switching", Some(losses.switching)),
                ("total", Some(losses.total)),
                ("temperature", losses.temperature),
            ] {
                add(format!("{}.losses.{entry}", element.name), value);
            }
        }
        for (node, value) in &self.temperatures {
            add(format!("part.temperatures.{node}"), Some(*value));
        }
        add("power.switching".into(), self.power.switching);
        let efficiency = self.power.efficiency_with_switching;
        add("power.efficiency_with_switching".into(), efficiency);
        all
    }
}

/// The last period of the sources.
struct Last {
    /// s; of a steady state all of it is as good.
    from: Option<f64>,
    /// rad/s.
    omega: f64,
}

impl Last {
    fn of(circuit: &Circuit, steady: bool) -> Option<Self> {
        let period = common_period(circuit)?;
        let omega = TAU / period;
        if steady {
            return Some(Self { from: None, omega });
        }
        let tran = circuit.tran?;
        let fits = period <= tran.tstop - tran.tstart;
        let from = Some(tran.tstop - period);
        fits.then_some(Self { from, omega })
    }
}

impl Entries {
    /// The names of those that are no one's helpers.
    pub(in crate::analysis) fn names(&self) -> impl Iterator<Item = &str> {
        let names = self.all.iter().map(|entry| entry.name.as_str());
        names.filter(|name| !name.starts_with('.'))
    }

    /// A circuit that measures these, and nothing else.
    pub(in crate::analysis) fn measured_in(self, circuit: &Circuit) -> Circuit {
        Circuit {
            measured: self.signals,
            measurements: self.all,
            fourier: vec![],
            ..circuit.clone()
        }
    }

    fn seen(&mut self, probe: &Probe) -> Formula {
        let known = self.signals.iter().position(|own| own == probe);
        Formula::Signal(known.unwrap_or_else(|| {
            self.signals.push(probe.clone());
            self.signals.len() - 1
        }))
    }

    fn add(&mut self, name: String, what: Measurement<Formula>) -> Formula {
        self.all.push(NamedMeasurement {
            name,
            what: Some(what),
        });
        Formula::Result(self.all.len() - 1)
    }

    /// Over all that is seen.
    fn over(&mut self, name: String, over: Over, of: Formula) -> Formula {
        let window = Window {
            from: None,
            to: None,
        };
        self.add(name, Measurement::Over(over, of, window))
    }

    fn mean(&mut self, name: &str, of: &Formula) {
        for (entry, over) in [
            ("mean", Over::Average),
            ("rms", Over::Rms),
            ("min", Over::Minimum),
            ("max", Over::Maximum),
        ] {
            self.over(format!("{name}.{entry}"), over, of.clone());
        }
    }
}

impl Columns<'_> {
    /// Σ v i of elements and their parts.
    fn work(&self, of: &[usize], entries: &mut Entries) -> Formula {
        let products = of.iter().flat_map(|k| self.whole(*k)).map(|k| {
            let (i, v) = self.elements[k];
            let [i, v] = [i, v].map(|column| entries.seen(&self.probes[column]));
            v * i
        });
        let sum = products.reduce(|a, b| a + b);
        sum.unwrap_or(Formula::Number(0.0))
    }

    fn element(&self, k: usize) -> Entries {
        let mut entries = Entries::default();
        let name = format!("{TABLE}{}", self.circuit.elements[k].name);
        for (quantity, column) in [("i", self.elements[k].0), ("v", self.across[k])] {
            let seen = entries.seen(&self.probes[column]);
            entries.mean(&format!("{name}.{quantity}"), &seen);
        }
        let work = self.work(&[k], &mut entries);
        entries.over(format!("{name}.power"), Over::Average, work);
        entries
    }

    fn signal(&self, column: usize, last: Option<&Last>) -> Entries {
        let mut entries = Entries::default();
        let probe = &self.probes[column];
        let name = format!("{TABLE}probes.{}", probe.name);
        let y = entries.seen(probe);
        entries.mean(&name, &y);
        entries.over(format!("{name}.ripple"), Over::PeakToPeak, y.clone());
        let Some(Last { from, omega }) = last else {
            return entries;
        };
        let turned = |turn: &str| {
            let angle = Formula::Number(*omega) * Formula::Time;
            y.clone() * Formula::Call(turn.into(), vec![angle])
        };
        let asked = [
            ("mean", Over::Average, y.clone()),
            ("rms", Over::Rms, y.clone()),
            ("re", Over::Average, turned("cos")),
            ("im", Over::Average, turned("sin")),
        ];
        let [mean, rms, re, im] = asked.map(|(part, over, of)| {
            let window = Window {
                from: from.map(|t| Instant::At(Formula::Number(t))),
                to: None,
            };
            let what = Measurement::Over(over, of, window);
            let found = entries.add(format!(".{name}.{part}"), what);
            found.clone() * found
        });
        let first = Formula::Number(2.0) * (re + im);
        let least = Formula::Number(FUNDAMENTAL.powi(2)) * rms.clone();
        let part = (rms - mean - first.clone()) / first.clone();
        let thd = Formula::Call("sqrt".into(), vec![part]).known_where(first, least);
        entries.add(format!("{name}.thd"), Measurement::Param(thd));
        entries
    }

    fn powers(&self) -> Entries {
        let mut entries = Entries::default();
        let mut mean = |name: String, of: &[usize], sign: f64| {
            let work = Formula::Number(sign) * self.work(of, &mut entries);
            entries.over(name, Over::Average, work)
        };
        let output = mean(format!("{TABLE}power.output"), &self.outputs, 1.0);
        let name = format!("{TABLE}power.input");
        let input = if self.active.is_empty() {
            mean(name, &self.inputs, -1.0)
        } else {
            let sources = mean(".sources".into(), &self.inputs, -1.0);
            let active = mean(".active".into(), &self.active, -1.0);
            let active = Formula::Call("max".into(), vec![active, Formula::Number(0.0)]);
            entries.add(name, Measurement::Param(sources + active))
        };
        if !self.outputs.is_empty() {
            let ratio = (output / input.clone()).known_where(input, Formula::Number(0.0));
            let name = format!("{TABLE}power.efficiency");
            entries.add(name, Measurement::Param(ratio));
        }
        entries
    }
}
