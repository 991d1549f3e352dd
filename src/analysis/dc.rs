//! `.dc`: the operating point at every value of the sweeps.

use super::sweep::{Variant, each, variants};
use crate::circuit::{Circuit, Probed};
use crate::integrate::{OperatingPoint, SimError, Values, operating_point};
use crate::model::{Faults, Model};
use crate::settings::Settings;

/// Operating points over swept quantities.
#[derive(Debug, Clone, PartialEq)]
pub struct Characteristic {
    /// What is swept, the innermost first, then the probes.
    pub names: Vec<String>,
    /// A row for every combination of values.
    pub rows: Vec<Vec<f64>>,
}

/// Why a point of a sweep has no answer.
#[derive(Debug)]
pub enum Unsolved {
    /// The netlist is no circuit with these values.
    Circuit {
        /// What is wrong with it.
        faults: Faults,
    },
    /// The circuit has no operating point, or none was found.
    Point {
        /// The values of the sweeps.
        at: Vec<(String, f64)>,
        /// The circuit with them.
        circuit: Box<Circuit>,
        /// Why.
        error: Box<SimError>,
    },
}

/// Carries out the `.dc` sweeps of a netlist.
///
/// # Errors
/// The first point in the order of the values that has no answer.
pub fn dc(model: &Model) -> Result<Characteristic, Unsolved> {
    let sweeps = &model.circuit().dc;
    let rows: Vec<_> = each(&variants(model, sweeps), point);
    let swept = sweeps.iter().map(|sweep| sweep.what.name().to_string());
    let probes = model.circuit().probes().into_iter().map(|probe| probe.name);
    Ok(Characteristic {
        names: swept.chain(probes).collect(),
        rows: rows.into_iter().collect::<Result<_, _>>()?,
    })
}

fn point(variant: &Variant<'_>) -> Result<Vec<f64>, Unsolved> {
    let circuit = variant
        .circuit()
        .map_err(|faults| Unsolved::Circuit { faults })?;
    match operating_point(&circuit, Values::Dc, false, &Settings::default()) {
        Ok(point) => {
            let values = variant.values().iter().copied();
            Ok(values.chain(readings(&circuit, &point)).collect())
        }
        Err(error) => Err(Unsolved::Point {
            at: variant.named(),
            circuit: Box::new(circuit),
            error: Box::new(error),
        }),
    }
}

/// The probes of a circuit at an operating point.
fn readings(circuit: &Circuit, point: &OperatingPoint) -> Vec<f64> {
    let node = |index: usize| index.checked_sub(1).map_or(0.0, |k| point.nodes[k].1);
    let reading = |what| match what {
        Probed::Voltage(a, b) => node(a.index()) - node(b.index()),
        Probed::Current(id) => point.currents[id.index()].1,
    };
    circuit
        .probes()
        .iter()
        .map(|probe| reading(probe.what))
        .collect()
}
