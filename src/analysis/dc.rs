//! `.dc`: the operating point at every value of the sweeps.

use super::sweep::{Variant, each, variants};
use crate::circuit::{Circuit, Kind, Probed, Swept};
use crate::integrate::{Error, OperatingPoint, Values, operating_point};
use crate::model::Model;
use crate::settings::Settings;

/// Operating points over swept quantities.
#[derive(Debug, Clone, PartialEq)]
pub struct Characteristic {
    /// The netlist's title.
    pub title: String,
    /// How many quantities are swept.
    pub swept: usize,
    /// What is swept, the innermost first, then the probes.
    pub names: Vec<String>,
    /// Of each column its unit: V, A, Ω, °C; none of a parameter.
    pub units: Vec<&'static str>,
    /// A row for every combination of values.
    pub rows: Vec<Vec<f64>>,
}

/// A point of a sweep that has no answer.
#[derive(Debug, thiserror::Error)]
#[error("{error}")]
pub struct Unsolved {
    /// The values of the sweeps.
    pub at: Vec<(String, f64)>,
    /// The circuit with them; none where the netlist is no circuit with these values.
    pub circuit: Option<Box<Circuit>>,
    /// Why.
    pub error: Box<Error>,
}

/// Carries out the `.dc` sweeps of a netlist.
///
/// # Errors
/// The first point in the order of the values that has no answer.
pub fn dc(model: &Model) -> Result<Characteristic, Unsolved> {
    let sweeps = &model.circuit().dc;
    let rows: Vec<_> = each(&variants(model, sweeps), point);
    let circuit = model.circuit();
    let swept = sweeps.iter().map(|sweep| {
        let unit = unit(circuit, &sweep.what);
        (sweep.what.name().to_string(), unit)
    });
    let probes = circuit.probes().into_iter().map(|probe| {
        let unit = match probe.what {
            Probed::Voltage(..) => "V",
            Probed::Current(_) => "A",
        };
        (probe.name, unit)
    });
    let (names, units) = swept.chain(probes).unzip();
    Ok(Characteristic {
        title: circuit.title.clone(),
        swept: sweeps.len(),
        names,
        units,
        rows: rows.into_iter().collect::<Result<_, _>>()?,
    })
}

/// The unit of what is swept; none of a parameter.
fn unit(circuit: &Circuit, what: &Swept) -> &'static str {
    let Swept::Element(name) = what else {
        return match what {
            Swept::Temperature => "°C",
            _ => "",
        };
    };
    let id = circuit.element(name);
    match id.map(|id| &circuit.elements[id.index()].kind) {
        Some(Kind::VoltageSource(_)) => "V",
        Some(Kind::CurrentSource(_)) => "A",
        Some(Kind::Resistor(_)) => "Ω",
        _ => "",
    }
}

fn point(variant: &Variant<'_>) -> Result<Vec<f64>, Unsolved> {
    let unsolved = |circuit: Option<Circuit>, error: Error| Unsolved {
        at: variant.named(),
        circuit: circuit.map(Box::new),
        error: Box::new(error),
    };
    let circuit = variant.circuit().map_err(|error| unsolved(None, error))?;
    match operating_point(&circuit, Values::Dc, false, &Settings::default()) {
        Ok(point) => {
            let values = variant.values().iter().copied();
            Ok(values.chain(readings(&circuit, &point)).collect())
        }
        Err(error) => Err(unsolved(Some(circuit), error)),
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
