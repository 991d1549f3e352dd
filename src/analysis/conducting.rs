//! Which devices and switches carry a current at an instant.

use crate::circuit::{Circuit, Element, Kind, Probe, Probed, Tran};
use crate::integrate::{Error, Reason, SimOptions};
use crate::model::Model;
use crate::settings::tolerances::events::LEAKING;
use crate::settings::tolerances::times::SPAN_PARTS;
use crate::waveform::Waveforms;

/// When a device of a curved law conducts, which no event tells: its current is then not small against the largest that it carries.
#[derive(Debug, Clone, PartialEq)]
pub struct Conduction {
    /// The device.
    pub device: String,
    /// Whether it does in the first row.
    pub at_start: bool,
    /// When it begins to and ends, s.
    pub changes: Vec<(f64, bool)>,
}

/// The currents of devices of curved laws.
pub(super) fn curved_currents(circuit: &Circuit) -> Vec<Probe> {
    let curved = circuit
        .elements
        .iter()
        .filter(|element| match &element.kind {
            Kind::Device(law) => !law.is_piecewise_linear(),
            _ => false,
        });
    let probe = |element: &Element| {
        Some(Probe {
            name: format!("i({})", element.name),
            what: Probed::Current(circuit.element(&element.name)?),
        })
    };
    curved.filter_map(probe).collect()
}

/// When the devices of these currents conduct, by straight lines between rows; one that never changes is left out.
pub(super) fn conduction(waves: &Waveforms, currents: &[Probe]) -> Vec<Conduction> {
    let of = |probe: &Probe| {
        let at = waves.names.iter().position(|name| *name == probe.name)?;
        let sizes: Vec<f64> = waves.column(at).map(f64::abs).collect();
        let level = LEAKING * sizes.iter().fold(0.0, |m: f64, i| m.max(*i));
        let rows = waves.time.windows(2).zip(sizes.windows(2));
        let changes = rows.filter_map(|(t, i)| {
            let conducts = i[1] > level;
            let part = (level - i[0]) / (i[1] - i[0]);
            ((i[0] > level) != conducts).then(|| (t[0] + part * (t[1] - t[0]), conducts))
        });
        let changes: Vec<(f64, bool)> = changes.collect();
        (!changes.is_empty()).then(|| Conduction {
            device: probe.name[2..probe.name.len() - 1].to_owned(),
            at_start: sizes[0] > level,
            changes,
        })
    };
    currents.iter().filter_map(of).collect()
}

/// The names of what conducts at time t of the transient, s: diodes, switches, thyristors and transistors whose current is then not small against the largest that
/// they carried until then.
///
/// # Errors
/// Those of [`Model::transient`]; [`Reason::Unknown`] without a positive time.
pub fn conducting(model: &Model, t: f64) -> Result<Vec<String>, Error> {
    if !(t > 0.0 && t.is_finite()) {
        let message = format!("{t} s is no time after the start of the transient");
        return Err(Error::before(Reason::Unknown(message)));
    }
    let names = valves(model.circuit());
    if names.is_empty() {
        return Ok(names);
    }
    let asked = model.circuit().tran;
    let tran = Tran {
        tstep: t / SPAN_PARTS,
        prints: true,
        tstop: t,
        tstart: 0.0,
        tmax: asked.and_then(|tran| tran.tmax),
        uic: asked.is_some_and(|tran| tran.uic),
    };
    let probes: Vec<String> = names.iter().map(|name| format!("i({name})")).collect();
    let options = SimOptions {
        events: true,
        unestimated: true,
        ..SimOptions::default()
    };
    let waves = model
        .asked(Some(tran), &probes)?
        .transient(options)?
        .waveforms;
    let conducts = |j: usize| {
        let largest = waves.column(j).map(f64::abs).fold(0.0, f64::max);
        let now = waves.column(j).last().unwrap_or(0.0).abs();
        now > LEAKING * largest
    };
    let all = names.into_iter().enumerate();
    Ok(all
        .filter(|(j, _)| conducts(*j))
        .map(|(_, name)| name)
        .collect())
}

/// Devices and switches; what a thyristor's or transistor's card is made of under the name of the card, whose current is that of an element.
fn valves(circuit: &Circuit) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for element in &circuit.elements {
        let card = element.name.split('.').next().unwrap_or_default();
        let name = if circuit.element(card).is_some() {
            card
        } else {
            &element.name
        };
        let is_valve = matches!(element.kind, Kind::Device(_) | Kind::Switch(_));
        if is_valve && !names.iter().any(|own| own == name) {
            names.push(name.to_owned());
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    const BUCK: &str = "buck\nvin in 0 12\ns1 in sw gate 0 g\nd1 0 sw d\nl1 sw out 100u ic=0\nc1 out 0 47u ic=0\nr1 out 0 5\n\
        vg gate 0 pulse(0 1 0 10n 10n 8u 20u)\n.model g sw(vt=0.5 ron=10m roff=1meg)\n.model d d(ideal)\n.tran 1u 2m uic\n.end\n";

    /// A rectifier without a capacitor: the diode conducts while the source is above the knee, 0.54 V across the diode and 9 mV across the resistor at a thousandth of 9.3 mA.
    #[test]
    fn devices_of_curved_laws_conduct_where_their_currents_say_so() {
        let text = "rectifier\nv1 a 0 sin(0 10 50)\nd1 a b dm\nr1 b 0 1k\n.model dm d(is=1e-14)\n.tran 0.1m 40m\n.end\n";
        let model = Model::parse(text, "t.cir").expect("a circuit");
        let run = crate::analysis::pictured(&model, SimOptions::default()).run;
        let (run, found) = run.expect("a run");
        assert!(run.events.is_empty() && !run.waveforms.names.contains(&"i(d1)".into()));
        let [d1] = &found.conduction[..] else {
            panic!("{:?}", found.conduction)
        };
        assert!(d1.device == "d1" && !d1.at_start);
        let since = 0.055_f64.asin() / (100.0 * std::f64::consts::PI);
        let expected = [since, 0.01 - since, 0.02 + since, 0.03 - since];
        assert_eq!(d1.changes.len(), 4);
        for ((t, conducts), (k, at)) in d1.changes.iter().zip(expected.iter().enumerate()) {
            assert!(
                (t - at).abs() < 1e-4 && *conducts == (k % 2 == 0),
                "{t} {at}"
            );
        }
    }

    #[test]
    fn the_switch_and_then_the_diode_of_a_buck() {
        let model = Model::parse(BUCK, "buck.cir").unwrap();
        assert_eq!(conducting(&model, 1.004e-3).unwrap(), ["s1"]);
        assert_eq!(conducting(&model, 1.012e-3).unwrap(), ["d1"]);
        assert!(conducting(&model, 0.0).is_err() && conducting(&model, f64::NAN).is_err());
    }

    #[test]
    fn a_card_of_several_elements_conducts_as_one() {
        let text = "t\nv1 a 0 sin(0 10 50)\nx1 a g k scr1\nr1 k 0 10\nvg g k pulse(0 5 5m 0 0 200u 20m)\n\
            .model scr1 scr(vgt=1 igt=20m)\n.tran 100u 20m uic\n.end\n";
        let model = Model::parse(text, "t.cir").unwrap();
        assert!(conducting(&model, 4e-3).unwrap().is_empty());
        assert_eq!(conducting(&model, 7e-3).unwrap(), ["x1"]);
    }
}
