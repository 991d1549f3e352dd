//! What a change of state costs in a real device, where the ideal one loses nothing: tables on `.model` cards.

use super::builder::Builder;
use super::model::Parameters;
use super::scope::ScopeId;
use crate::diagnostic::{Diagnostic, Span};
use crate::netlist::ast::{self, Model, Name};

/// Parameters of tables: their axes, and what they tell.
const TABLES: [&str; 6] = ["vloss", "iloss", "tloss", "eon", "eoff", "err"];
/// Parameters of the way of heat to the case: its resistances, and its capacities, without which the temperature at rest is the same.
const HEAT: [&str; 2] = ["rthjc", "cthjc"];
/// Letters of elements that take them.
const TAKEN_BY: [char; 7] = ['s', 'w', 'd', 'a', 'm', 'j', 'z'];

/// Losses of a device besides those that its currents and voltages make.
#[derive(Debug, Clone, PartialEq)]
pub struct Losses {
    /// The card: `s1`, `m1`, `d1`.
    pub device: String,
    /// The element whose turning on and off costs energy.
    pub switch: Option<String>,
    /// The element that costs energy where its forward current is interrupted.
    pub diode: Option<String>,
    /// `eon`: by the voltage before and the current after.
    pub on: Option<EnergyTable>,
    /// `eoff`: by the current before and the voltage after.
    pub off: Option<EnergyTable>,
    /// `err`: by the current before and the reverse voltage after.
    pub recovery: Option<EnergyTable>,
    /// Devices in parallel, each with its part of the current.
    pub times: f64,
    /// `rthjc`: from the junction to the case, of all together, K/W.
    pub resistance: f64,
}

/// E(v, i, T), J: piecewise linear, and continued by its outer pieces.
///
/// An axis without points has no influence; an axis of one point stands for a proportional one, as a datasheet gives an energy at one voltage
/// and one current (of the temperature: for none).
#[derive(Debug, Clone, PartialEq)]
pub struct EnergyTable {
    /// V.
    pub volts: Vec<f64>,
    /// A.
    pub amperes: Vec<f64>,
    /// °C.
    pub celsius: Vec<f64>,
    /// J: the current runs fastest, then the voltage, then the temperature.
    pub joules: Vec<f64>,
}

impl EnergyTable {
    /// The energies at a voltage and a current, by temperature; none is below 0.
    pub fn at(&self, volts: f64, amperes: f64) -> impl Iterator<Item = f64> {
        let [v, i] = [place(&self.volts, volts), place(&self.amperes, amperes)];
        let row = self.amperes.len().max(1);
        let sheet = row * self.volts.len().max(1);
        self.joules.chunks(sheet).map(move |joules| {
            let corners = v.iter().flat_map(|v| i.iter().map(move |i| (v, i)));
            let parts = corners.map(|((v, a), (i, b))| a * b * joules[v * row + i]);
            parts.sum::<f64>().max(0.0)
        })
    }

    /// Whether a voltage and a current are below the last ones of the table.
    #[must_use]
    pub fn reaches(&self, volts: f64, amperes: f64) -> bool {
        let within =
            |axis: &[f64], x: f64| axis.len() < 2 || axis.last().is_none_or(|last| x <= *last);
        within(&self.volts, volts) && within(&self.amperes, amperes)
    }

    /// What energies that stand by temperature as [`Self::at`] gives them (none where nothing happened) are at a temperature, °C: J, and their
    /// rise with it, J/K.
    #[must_use]
    pub fn heated(&self, by_temperature: &[f64], celsius: f64) -> (f64, f64) {
        let at = |k: usize| by_temperature.get(k).copied().unwrap_or(0.0);
        if self.celsius.len() < 2 {
            return (at(0), 0.0);
        }
        let [(low, a), (high, b)] = place(&self.celsius, celsius);
        let slope = (at(high) - at(low)) / (self.celsius[high] - self.celsius[low]);
        (a * at(low) + b * at(high), slope)
    }
}

/// The two points of an axis between which a value is, or nearest to which, and their weights.
fn place(axis: &[f64], x: f64) -> [(usize, f64); 2] {
    match axis {
        [] => [(0, 1.0), (0, 0.0)],
        [only] => [(0, x / only), (0, 0.0)],
        _ => {
            let last = axis.len() - 2;
            let k = axis.partition_point(|point| *point <= x).saturating_sub(1);
            let k = k.min(last);
            let part = (x - axis[k]) / (axis[k + 1] - axis[k]);
            [(k, 1.0 - part), (k + 1, part)]
        }
    }
}

/// The elements of a device that change state.
pub(super) struct Changing {
    pub(super) switch: Option<String>,
    pub(super) diode: Option<String>,
}

impl<'n> Builder<'n, '_> {
    /// Takes the tables of a device's model, where it has some.
    pub(super) fn losses(
        &mut self,
        (device, model): (&str, &Name),
        params: &Parameters<'n>,
        Changing { switch, diode }: Changing,
        times: f64,
        scope: ScopeId,
    ) {
        if !has_losses(params) {
            return;
        }
        let mut axes =
            ["vloss", "iloss", "tloss"].map(|name| self.axis(model, params, name, scope));
        let [Some(volts), Some(amperes), Some(celsius)] = axes.each_mut().map(Option::take) else {
            return;
        };
        let mut table = |name: &str, acts: bool| {
            let Some(value) = params.get(name) else {
                return Some(None);
            };
            if !acts {
                self.unused(format!("{name} of {}", model.text), model);
                return Some(None);
            }
            let joules = self.scopes.numbers(value, scope)?;
            let [v, i, t] = [&volts, &amperes, &celsius].map(|axis| axis.len().max(1));
            if joules.len() != v * i * t || joules.iter().any(|e| *e < 0.0) {
                let message = format!(
                    "`{name}` of model `{}` needs {} energies, none negative, and has {}",
                    model.text,
                    v * i * t,
                    joules.len()
                );
                let label = format!("{t} temperatures by {v} voltages by {i} currents");
                self.tell(bad(value.span, message, label, "the currents of `iloss` run fastest, then the voltages of `vloss`, then the temperatures of `tloss`"));
                return None;
            }
            Some(Some(EnergyTable {
                volts: volts.clone(),
                amperes: amperes.clone(),
                celsius: celsius.clone(),
                joules,
            }))
        };
        let (on, off) = (
            table("eon", switch.is_some()),
            table("eoff", switch.is_some()),
        );
        let recovery = table("err", diode.is_some());
        let resistances = match params.get("rthjc") {
            Some(value) => self.scopes.numbers(value, scope),
            None => Some(Vec::new()),
        };
        let (Some(on), Some(off), Some(recovery), Some(resistances)) =
            (on, off, recovery, resistances)
        else {
            return;
        };
        let resistance = resistances.iter().sum::<f64>() / times;
        if resistances.iter().any(|r| *r < 0.0) {
            let message = format!("`rthjc` of model `{}` is negative", model.text);
            let span = params.get("rthjc").map_or(model.span, |value| value.span);
            self.tell(bad(
                span,
                message,
                "must not be negative",
                "the resistances from junction to case, K/W, which add",
            ));
            return;
        }
        self.circuit.losses.push(Losses {
            device: device.to_owned(),
            switch,
            diode,
            on,
            off,
            recovery,
            times,
            resistance,
        });
    }

    /// Warns of tables of a model that its device does not use.
    pub(super) fn idle_losses(&mut self, card: &ast::Element, model: &Name, chain: &[&'n Model]) {
        if !card.name.text.starts_with(TAKEN_BY) && has_losses(&Parameters::new(chain)) {
            self.unused(format!("loss tables of {}", model.text), model);
        }
    }

    fn axis(
        &mut self,
        model: &Name,
        params: &Parameters<'n>,
        name: &str,
        scope: ScopeId,
    ) -> Option<Vec<f64>> {
        let Some(value) = params.get(name) else {
            return Some(Vec::new());
        };
        let axis = self.scopes.numbers(value, scope)?;
        let rises = axis.windows(2).all(|pair| pair[0] < pair[1]);
        let signed = name == "tloss" || axis.first().is_some_and(|first| *first >= 0.0);
        let proportional = name == "tloss" || axis != [0.0];
        if axis.is_empty() || !rises || !signed || !proportional {
            let message = format!("`{name}` of model `{}` is no axis of a table", model.text);
            self.tell(bad(value.span, message, "must rise, from 0 or above", "for example `[0 300 600]`; a single value stands for a table that is proportional to it"));
            return None;
        }
        Some(axis)
    }
}

fn has_losses(params: &Parameters<'_>) -> bool {
    let mut names = TABLES.iter().chain(&HEAT);
    names.any(|name| params.get(name).is_some())
}

fn bad(span: Span, message: String, label: impl Into<String>, help: &str) -> Diagnostic {
    let fault = Diagnostic::error("bad-value", span, message);
    fault.label(label).help(help)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 mJ at 600 V and 50 A; and a grid whose corners are v i (1 + T/100).
    #[test]
    fn tables_are_proportional_or_piecewise_linear_and_go_on() {
        let one = EnergyTable {
            volts: vec![600.0],
            amperes: vec![50.0],
            celsius: vec![],
            joules: vec![1e-3],
        };
        assert_eq!(one.at(300.0, 25.0).collect::<Vec<_>>(), [0.25e-3]);
        assert!(one.reaches(1e3, 1e3) && one.heated(&[3.0], 77.0) == (3.0, 0.0));
        assert_eq!(one.heated(&[], 77.0), (0.0, 0.0));
        let (volts, amperes, celsius) = (vec![0.0, 100.0, 400.0], vec![0.0, 10.0], vec![0.0, 50.0]);
        let mut joules = Vec::new();
        for t in &celsius {
            for v in &volts {
                joules.extend(amperes.iter().map(|i| v * i * (1.0 + t / 100.0)));
            }
        }
        let grid = EnergyTable {
            volts,
            amperes,
            celsius,
            joules,
        };
        for (v, i) in [(50.0, 5.0), (250.0, 2.0), (500.0, 20.0), (0.0, 3.0)] {
            let found: Vec<f64> = grid.at(v, i).collect();
            assert!((found[0] - v * i).abs() < 1e-9 && (found[1] - 1.5 * v * i).abs() < 1e-9);
            let (at, slope) = grid.heated(&found, 150.0);
            assert!((at - 2.5 * v * i).abs() < 1e-9 && (slope - 0.01 * v * i).abs() < 1e-12);
        }
        assert!(grid.reaches(400.0, 10.0) && !grid.reaches(400.1, 1.0) && !grid.reaches(1.0, 10.1));
        // Nothing is gained.
        let falling = EnergyTable {
            amperes: vec![1.0, 2.0],
            joules: vec![1.0, 3.0],
            ..one
        };
        assert_eq!(falling.at(600.0, 0.0).collect::<Vec<_>>(), [0.0]);
    }
}
