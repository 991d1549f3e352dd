//! What changes of state cost by the loss tables of the models.
//!
//! A switch that turns on costs E_on(v⁻, i⁺), one that turns off E_off(v⁺, i⁻), and a diode whose forward current is interrupted E_rr(−v⁺, i⁻): voltages and
//! currents stand in the tables by magnitude, and a current that flows against the voltage counts as 0.

use super::columns::Columns;
use crate::circuit::{EnergyTable, Losses};
use crate::settings::tolerances::events::LEAKING;

/// How often something changed its state, and what that cost.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Cost {
    pub(super) count: usize,
    /// J, by temperature of the table.
    pub(super) joules: Vec<f64>,
    /// The largest voltage and current, where one of them is beyond the table.
    pub(super) beyond: Option<(f64, f64)>,
}

impl Cost {
    fn add(&mut self, table: Option<&EnergyTable>, times: f64, volts: f64, amperes: f64) {
        self.count += 1;
        let Some(table) = table else {
            return;
        };
        let each = amperes / times;
        let energies = table.at(volts, each).map(|energy| times * energy);
        if self.joules.is_empty() {
            self.joules.extend(energies);
        } else {
            let sums = self.joules.iter_mut().zip(energies);
            sums.for_each(|(sum, energy)| *sum += energy);
        }
        if !table.reaches(volts, each) {
            let (v, i) = self.beyond.unwrap_or_default();
            self.beyond = Some((v.max(volts), i.max(each)));
        }
    }
}

/// The changes of state of one device.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Costs {
    pub(super) on: Cost,
    pub(super) off: Cost,
    pub(super) recovery: Cost,
}

/// The values of all columns just before and after an instant.
pub(super) type Sides<'a> = (&'a [f64], &'a [f64]);

/// The devices with tables, and where their quantities stand.
pub(super) struct Commutations<'a> {
    devices: Vec<Device<'a>>,
    pub(super) costs: Vec<Costs>,
}

struct Device<'a> {
    losses: &'a Losses,
    /// The current of the switch, and the voltages that add up to that of the device.
    switch: Option<(usize, Vec<usize>)>,
    /// Current and voltage of the diode, and below what they are nothing.
    diode: Option<(usize, usize, f64, f64)>,
}

impl<'a> Commutations<'a> {
    /// With the least and the greatest values of all columns.
    pub(super) fn of(columns: &Columns<'a>, (least, greatest): (&[f64], &[f64])) -> Self {
        let at = |name: &str| {
            let id = columns.circuit.element(name)?;
            Some(columns.elements[id.index()])
        };
        let currents = columns.elements.iter().map(|(i, _)| greatest[*i]);
        // What a diode that never conducts carries is rounding.
        let nothing = LEAKING.powi(2) * currents.fold(0.0, f64::max);
        let devices = columns.circuit.losses.iter().map(|losses| {
            let switch = losses.switch.as_deref().and_then(|name| {
                let (i, v) = at(name)?;
                // An IGBT blocks with its junction and its channel.
                let whole = at(&losses.device).map(|(_, v)| v).filter(|w| *w != v);
                Some((i, whole.into_iter().chain([v]).collect()))
            });
            let diode = losses.diode.as_deref().and_then(|name| {
                let (i, v) = at(name)?;
                let conducting = nothing.max(LEAKING * greatest[i]);
                Some((i, v, conducting, LEAKING * least[v]))
            });
            Device {
                losses,
                switch,
                diode,
            }
        });
        let devices: Vec<Device<'a>> = devices.collect();
        Self {
            costs: vec![Costs::default(); devices.len()],
            devices,
        }
    }

    /// An instant at which `moved` tells what becomes of a switch, where it moves.
    pub(super) fn see(&mut self, moved: impl Fn(&str) -> Option<bool>, (before, after): Sides<'_>) {
        for (device, costs) in self.devices.iter().zip(&mut self.costs) {
            let Losses {
                switch,
                on,
                off,
                recovery,
                times,
                ..
            } = device.losses;
            let turns = switch.as_deref().and_then(&moved);
            if let (Some(turns_on), Some((i, across))) = (turns, &device.switch) {
                let (blocked, carried) = if turns_on {
                    (before, after)
                } else {
                    (after, before)
                };
                let volts: f64 = across.iter().map(|v| blocked[*v]).sum();
                let amperes = (carried[*i] * volts.signum()).max(0.0);
                let (cost, table) = if turns_on {
                    (&mut costs.on, on)
                } else {
                    (&mut costs.off, off)
                };
                cost.add(table.as_ref(), *times, volts.abs(), amperes);
            }
            if let (Some((i, v, least_i, least_v)), Some(table)) = (device.diode, recovery)
                && before[i] > least_i
                && after[v] < least_v
            {
                costs
                    .recovery
                    .add(Some(table), *times, -after[v], before[i]);
            }
        }
    }
}
