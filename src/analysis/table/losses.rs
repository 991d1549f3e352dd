//! What devices lose besides what their voltages and currents make, and how warm they become.

use super::columns::Columns;
use super::commutation::{Cost, Costs};
use super::heat::{Heated, Warm, at_rest};
use super::means::{DeviceLosses, ElementMeans, Switching};
use crate::circuit::{Element, EnergyTable, Losses, NodeId};
use crate::integrate::Note;

/// What there is to lose.
#[derive(Default)]
pub(super) struct Lost {
    /// By element.
    pub(super) losses: Vec<Option<DeviceLosses>>,
    /// Of the nodes of the thermal network, °C.
    pub(super) temperatures: Vec<(String, f64)>,
    /// Things the user should know.
    pub(super) notes: Vec<Note>,
}

/// A device with tables, or with a place in the thermal network.
struct Device<'a> {
    element: usize,
    tables: Option<(&'a Losses, &'a Costs)>,
    case: Option<NodeId>,
}

impl Device<'_> {
    /// Its tables with what they say by temperature.
    fn energies(&self) -> impl Iterator<Item = (&EnergyTable, &Cost)> {
        let all = self.tables.iter().flat_map(|(losses, costs)| {
            [
                (&losses.on, &costs.on),
                (&losses.off, &costs.off),
                (&losses.recovery, &costs.recovery),
            ]
        });
        all.filter_map(|(table, cost)| Some((table.as_ref()?, cost)))
    }

    /// Whether something is said of how warm it is.
    fn is_warm(&self) -> bool {
        let resists = self
            .tables
            .is_some_and(|(losses, _)| losses.resistance > 0.0);
        self.case.is_some() || resists || self.hottest().is_some()
    }

    /// The last temperature of its tables.
    fn hottest(&self) -> Option<f64> {
        let last = self
            .energies()
            .filter_map(|(table, _)| table.celsius.last());
        last.copied().reduce(f64::min)
    }
}

/// The losses of the devices over so many seconds, with means that have none yet.
pub(super) fn lost(
    columns: &Columns<'_>,
    elements: &[ElementMeans],
    costs: &[Costs],
    seconds: f64,
) -> Lost {
    let circuit = columns.circuit;
    let thermal = &circuit.thermal;
    let devices: Vec<Device<'_>> = circuit
        .elements
        .iter()
        .enumerate()
        .filter_map(|(element, Element { name, .. })| {
            let mut tables = circuit.losses.iter().zip(costs);
            let tables = tables.find(|(losses, _)| losses.device == *name);
            let mut cases = thermal.cases.iter();
            let case = cases
                .find(|(device, _)| device == name)
                .map(|(_, node)| *node);
            (tables.is_some() || case.is_some()).then_some(Device {
                element,
                tables,
                case,
            })
        })
        .collect();
    if devices.is_empty() {
        return Lost {
            losses: vec![None; elements.len()],
            ..Lost::default()
        };
    }
    let heated = devices.iter().map(|device| Heated {
        case: device.case,
        resistance: device.tables.map_or(0.0, |(losses, _)| losses.resistance),
        power: Box::new(|celsius| {
            let conduction = elements[device.element].power;
            device
                .energies()
                .fold((conduction, 0.0), |(p, rise), (table, cost)| {
                    let (energy, slope) = table.heated(&cost.joules, celsius);
                    (p + energy / seconds, rise + slope / seconds)
                })
        }),
    });
    let heated: Vec<Heated<'_>> = heated.collect();
    let names = |devices: &mut dyn Iterator<Item = &Device<'_>>| -> Vec<String> {
        devices
            .map(|device| elements[device.element].name.clone())
            .collect()
    };
    let mut notes = Vec::new();
    let warm = match at_rest(circuit, &heated) {
        Ok(Some(warm)) => Some(warm),
        Ok(None) => {
            let text = format!(
                "thermal runaway: the heat of the devices rises faster with their temperature than it leaves; their losses are those at {} °C",
                thermal.ambient
            );
            notes.push(Note::of(
                "thermal-runaway",
                names(&mut devices.iter()),
                text,
            ));
            None
        }
        Err(error) => {
            let text = format!(
                "no temperatures, and losses at {} °C: the thermal network has no state of rest: {error}",
                thermal.ambient
            );
            notes.push(Note::of(
                "no-temperatures",
                names(&mut devices.iter()),
                text,
            ));
            None
        }
    };
    let junction = |j: usize| warm.as_ref().map(|Warm { junctions, .. }| junctions[j]);
    let mut losses = vec![None; elements.len()];
    for (j, device) in devices.iter().enumerate() {
        let name = &elements[device.element].name;
        let celsius = junction(j).unwrap_or(thermal.ambient);
        let conduction = elements[device.element].power;
        let switching = (heated[j].power)(celsius).0 - conduction;
        let one = |table: &Option<EnergyTable>, cost: &Cost| {
            let table = table.as_ref()?;
            Some(Switching {
                count: cost.count,
                energy: table.heated(&cost.joules, celsius).0,
            })
        };
        let tables = device.tables;
        losses[device.element] = Some(DeviceLosses {
            on: tables.and_then(|(l, c)| one(&l.on, &c.on)),
            off: tables.and_then(|(l, c)| one(&l.off, &c.off)),
            recovery: tables.and_then(|(l, c)| one(&l.recovery, &c.recovery)),
            conduction,
            switching,
            total: conduction + switching,
            temperature: junction(j).filter(|_| device.is_warm()),
        });
        let beyond = device.energies().filter_map(|(_, cost)| cost.beyond);
        if let Some((v, i)) = beyond.reduce(|a, b| (a.0.max(b.0), a.1.max(b.1))) {
            let text = format!(
                "`{name}` changes state at up to {v:.4} V and {i:.4} A, beyond its loss tables, which are continued"
            );
            notes.push(Note::of("beyond-tables", [name], text));
        }
        if let Some((t, hottest)) = junction(j)
            .zip(device.hottest())
            .filter(|(t, last)| t > last)
        {
            let text = format!(
                "the junction of `{name}` comes to {t:.1} °C, and its loss tables end at {hottest} °C and are continued"
            );
            notes.push(Note::of("beyond-tables", [name], text));
        }
    }
    Lost {
        losses,
        temperatures: warm.map(|warm| warm.nodes).unwrap_or_default(),
        notes,
    }
}
