//! `.meas ac`: what is measured on the response.

use nalgebra::Complex;

use super::formula::Band;
use super::{About, Response, SmallSignalOptions, small_signal};
use crate::circuit::{Circuit, Formula, Measured, NamedMeasurement, Probe, Seen, carried_out};
use crate::integrate::Error;
use crate::measure::{MeasureError, Measurement, Over, Trace};
use crate::model::Model;
use crate::settings::tolerances::times::SAME_TIME;
use crate::waveform::Phasors;

/// How often the response is found closer to where a measurement finds something: each time halves what is between there and its neighbours.
const ROUNDS: usize = 20;

/// The response, with what `.meas ac` asks of it.
///
/// Measurements see straight lines between frequencies. About an operating point the response is found at more frequencies where they find a crossing or an extremum, until
/// these stand to about a millionth of the distance of two rows; the rows themselves stay as asked for.
///
/// # Errors
/// As [`small_signal`].
///
/// # Example
/// ```
/// use circ::analysis::{SmallSignalOptions, small_signal_measured};
///
/// let text = "rc\nv1 1 0 ac 1\nr1 1 2 1k\nc1 2 0 1u\n.ac dec 10 1 100k\n.meas ac corner when vp(2)=-45\n.end\n";
/// let model = circ::Model::parse(text, "rc.cir")?;
/// let (_, found) = small_signal_measured(&model, &SmallSignalOptions::default())?;
/// let corner = found[0].result.as_ref().unwrap().value;
/// assert!((corner / 159.15494309189535 - 1.0).abs() < 1e-6);
/// # Ok::<(), circ::Error>(())
/// ```
pub fn small_signal_measured(
    model: &Model,
    options: &SmallSignalOptions<'_>,
) -> Result<(Response, Vec<Measured>), Error> {
    let circuit = model.circuit();
    if circuit.responses.is_empty() {
        return Ok((small_signal(model, options)?, Vec::new()));
    }
    let shown = circuit.probes();
    let mut probes = shown.clone();
    for probe in &circuit.responded {
        if !probes.contains(probe) {
            probes.push(probe.clone());
        }
    }
    let probing = model.with_circuit(Circuit {
        probes,
        ..circuit.clone()
    })?;
    let width = probing.circuit().probes().len();
    let mut response = small_signal(&probing, options)?;
    let mut seen = response.phasors.clone();
    let mut found = measure(circuit, &seen);
    if response.about == About::Rest {
        for _ in 0..ROUNDS {
            let frequencies = closer(circuit, &seen, &found);
            if frequencies.is_empty() {
                break;
            }
            let asked = SmallSignalOptions {
                frequencies,
                ..options.clone()
            };
            merge(&mut seen, small_signal(&probing, &asked)?.phasors);
            found = measure(circuit, &seen);
        }
    }
    cut(&mut response.phasors, shown.len(), width);
    Ok((response, found))
}

/// Carries out the measurements.
fn measure(circuit: &Circuit, seen: &Phasors) -> Vec<Measured> {
    let found = carried_out(&circuit.responses, &Rows::of(circuit, seen));
    let in_hertz = |why| match why {
        MeasureError::Window { from, to, .. } => MeasureError::Band { from, to },
        why => why,
    };
    let found = found.into_iter().map(|measured| Measured {
        result: measured.result.map_err(in_hertz),
        ..measured
    });
    found.collect()
}

/// The response as measurements see it.
struct Rows<'a> {
    frequency: &'a [f64],
    /// Of the signals that they need.
    signals: Vec<Vec<Complex<f64>>>,
}

impl<'a> Rows<'a> {
    fn of(circuit: &Circuit, seen: &'a Phasors) -> Self {
        let column = |probe: &Probe| match seen.find(&probe.name) {
            Some(index) => seen.column(index).collect(),
            None => vec![Complex::from(f64::NAN); seen.frequency.len()],
        };
        Self {
            frequency: &seen.frequency,
            signals: circuit.responded.iter().map(column).collect(),
        }
    }

    fn real(&self, formula: &Formula, results: &[f64]) -> Vec<f64> {
        let band = Band {
            frequency: self.frequency,
            signals: &self.signals,
            results,
        };
        band.real(formula)
    }
}

impl Seen for Rows<'_> {
    fn span(&self) -> (f64, f64) {
        let ends = self.frequency.first().zip(self.frequency.last());
        ends.map_or((0.0, 0.0), |(first, last)| (*first, *last))
    }

    fn trace(
        &self,
        formula: &Formula,
        less: Option<&Formula>,
        results: &[f64],
    ) -> Result<Trace<'_>, MeasureError> {
        let mut values = self.real(formula, results);
        if let Some(less) = less {
            let less = self.real(less, results);
            values.iter_mut().zip(less).for_each(|(y, less)| *y -= less);
        }
        let finite = values.iter().all(|value| value.is_finite());
        let trace = finite.then(|| Trace::lines(self.frequency, values));
        trace.ok_or(MeasureError::NotFinite)
    }

    fn number(&self, formula: &Formula, results: &[f64]) -> f64 {
        let band = Band {
            frequency: &[f64::NAN],
            signals: &[],
            results,
        };
        band.real(formula).first().copied().unwrap_or(f64::NAN)
    }
}

/// Frequencies at which measurements find something, and halfway from there to the rows beside it, that are no rows yet.
fn closer(circuit: &Circuit, seen: &Phasors, found: &[Measured]) -> Vec<f64> {
    let mut all = circuit.responses.clone();
    // Where extremes are.
    for measurement in &circuit.responses {
        let Some(Measurement::Over(over, of, window)) = &measurement.what else {
            continue;
        };
        let places: &[Over] = match over {
            Over::Maximum => &[Over::WhenMaximum],
            Over::Minimum => &[Over::WhenMinimum],
            Over::PeakToPeak => &[Over::WhenMaximum, Over::WhenMinimum],
            _ => &[],
        };
        all.extend(places.iter().map(|place| NamedMeasurement {
            name: measurement.name.clone(),
            what: Some(Measurement::Over(*place, of.clone(), window.clone())),
        }));
    }
    let places = carried_out(&all, &Rows::of(circuit, seen));
    let places = places.into_iter().skip(found.len());
    let values = places.filter_map(|place| place.result.ok().map(|found| found.value));
    let mut spots: Vec<f64> = values.collect();
    for (measurement, measured) in circuit.responses.iter().zip(found) {
        let (Some(what), Ok(found)) = (&measurement.what, &measured.result) else {
            continue;
        };
        spots.extend(found.at.iter().map(|(_, f)| *f));
        let is_place = matches!(
            what,
            Measurement::When(_) | Measurement::Over(Over::WhenMaximum | Over::WhenMinimum, ..)
        );
        spots.extend(is_place.then_some(found.value));
    }
    let rows = &seen.frequency;
    let mut more = Vec::new();
    for f in spots {
        let after = rows.partition_point(|row| *row < f);
        let on_row = rows.get(after) == Some(&f);
        more.extend((!on_row).then_some(f));
        let beside = [
            after.checked_sub(1).and_then(|before| rows.get(before)),
            rows.get(after + usize::from(on_row)),
        ];
        more.extend(beside.into_iter().flatten().map(|row| 0.5 * (row + f)));
    }
    let (first, last) = (rows.first(), rows.last());
    let inside = |f: &f64| first.is_some_and(|a| a < f) && last.is_some_and(|b| f < b);
    // Closer together than that nothing is told apart.
    let is_new = |f: &f64| rows.iter().all(|row| (row - f).abs() > SAME_TIME * f);
    more.retain(|f| inside(f) && is_new(f));
    more.sort_by(f64::total_cmp);
    more.dedup_by(|a, b| (*a - *b).abs() <= SAME_TIME * *b);
    more
}

/// Puts the rows of one response between those of another.
fn merge(seen: &mut Phasors, more: Phasors) {
    let width = seen.names.len().max(1);
    let old = std::mem::take(&mut seen.frequency);
    let values = std::mem::take(&mut seen.values);
    let of = |frequency: Vec<f64>, values: &[Complex<f64>]| {
        let rows = values.chunks(width).map(<[_]>::to_vec);
        frequency.into_iter().zip(rows).collect::<Vec<_>>()
    };
    let mut rows = of(old, &values);
    rows.extend(of(more.frequency, &more.values));
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (frequency, values) in rows {
        seen.frequency.push(frequency);
        seen.values.extend(values);
    }
}

/// Leaves the first columns of every so many.
fn cut(phasors: &mut Phasors, shown: usize, width: usize) {
    let keeps = |k: usize| k % width.max(1) < shown;
    let columns = phasors.names.len().max(1);
    let rows = phasors.values.chunks(columns);
    let values = rows.flat_map(|row| {
        let kept = row.iter().enumerate().filter(|(k, _)| keeps(*k));
        kept.map(|(_, value)| *value)
    });
    phasors.values = values.collect();
    let mut index = 0..;
    phasors.names.retain(|_| index.next().is_some_and(keeps));
    let mut index = 0..;
    phasors.units.retain(|_| index.next().is_some_and(keeps));
}
