//! Temperatures at rest: those at which the heat of the devices, which rises with them, leaves as fast as it comes.
//!
//! ```text
//! T_j = T_c(P) + R_jc P_j(T_j),     T_c(P) = T₀ + Z P,
//! ```
//!
//! with T₀ and Z of the thermal network, whose capacitances carry nothing at rest, and P_j the mean power of a device: what its voltages and currents make, and its
//! changes of state by the tables at T_j. P is piecewise linear in T, and Newton's method from T₀ ends on the piece of the solution.

use nalgebra::{DMatrix, DVector};

use crate::circuit::{Circuit, Kind, NodeId, Source};
use crate::integrate::Error;
use crate::model::Model;
use crate::settings::tolerances::periodic::{HEATINGS, WARM};

/// A device that gives heat away.
pub(super) struct Heated<'a> {
    /// The node of the network at which its case stands; none in the surroundings.
    pub(super) case: Option<NodeId>,
    /// From junction to case, K/W.
    pub(super) resistance: f64,
    /// Mean power and its rise with the temperature of the junction, °C: W, W/K.
    pub(super) power: Box<dyn Fn(f64) -> (f64, f64) + 'a>,
}

/// What the devices come to.
pub(super) struct Warm {
    /// Of the junctions, °C.
    pub(super) junctions: Vec<f64>,
    /// Of the nodes of the network without ground, °C.
    pub(super) nodes: Vec<(String, f64)>,
}

/// The temperatures at rest; `None` where there are none, as the heat rises faster than it leaves.
///
/// # Errors
/// Why the network has no state of rest.
pub(super) fn at_rest(circuit: &Circuit, devices: &[Heated<'_>]) -> Result<Option<Warm>, String> {
    let thermal = &circuit.thermal;
    let network = match &thermal.network {
        Some(network) => Network::of(network, devices)?,
        None => Network::default(),
    };
    let count = devices.len();
    let surroundings = DVector::from_fn(count, |j, _| match devices[j].case {
        Some(node) => network.cold(node),
        None => thermal.ambient,
    });
    let heating = DMatrix::from_fn(count, count, |j, k| {
        let own = if j == k { devices[j].resistance } else { 0.0 };
        own + match (devices[j].case, devices[k].case) {
            (Some(at), Some(from)) => network.rise(at, from),
            _ => 0.0,
        }
    });
    let mut warm = surroundings.clone();
    for _ in 0..HEATINGS {
        let powers = devices
            .iter()
            .zip(&warm)
            .map(|(device, t)| (device.power)(*t));
        let (power, slope): (Vec<f64>, Vec<f64>) = powers.unzip();
        let power = DVector::from_vec(power);
        let gains = &heating * DMatrix::from_diagonal(&DVector::from_vec(slope));
        let off = &surroundings + &heating * &power - &warm;
        let step = (DMatrix::identity(count, count) - &gains).lu().solve(&off);
        let Some(step) = step.filter(|step| step.iter().all(|t| t.is_finite())) else {
            return Ok(None);
        };
        warm += &step;
        if step.amax() <= WARM {
            // A disturbance comes back larger where more than all of it does.
            let stays = gains.complex_eigenvalues().iter().all(|gain| gain.re < 1.0);
            return Ok(stays.then(|| Warm {
                nodes: network.nodes(devices, &power),
                junctions: warm.iter().copied().collect(),
            }));
        }
    }
    Ok(None)
}

/// The temperatures of a network, °C, without heat and by heat at the nodes where cases stand, K/W.
#[derive(Default)]
struct Network {
    names: Vec<String>,
    cold: Vec<f64>,
    /// By node that takes heat.
    rises: Vec<(NodeId, Vec<f64>)>,
}

impl Network {
    fn of(network: &Circuit, devices: &[Heated<'_>]) -> Result<Self, String> {
        let rests = |circuit: Circuit| -> Result<Vec<(String, f64)>, Error> {
            Ok(Model::of_circuit(circuit)?.operating_point()?.nodes)
        };
        let cold = rests(network.clone()).map_err(|error| error.to_string())?;
        let (names, cold): (Vec<String>, Vec<f64>) = cold.into_iter().unzip();
        let mut rises: Vec<(NodeId, Vec<f64>)> = Vec::new();
        for node in devices.iter().filter_map(|device| device.case) {
            if node == NodeId::GROUND || rises.iter().any(|(own, _)| *own == node) {
                continue;
            }
            let mut heated = network.clone();
            for element in &mut heated.elements {
                if let Kind::VoltageSource(source) | Kind::CurrentSource(source) = &mut element.kind
                {
                    *source = Source::constant(0.0);
                }
            }
            let to = heated.nodes[node.index()].clone();
            heated.current_source("i.heat", ["0", &to], Source::constant(1.0));
            let rest = rests(heated);
            let rise =
                rest.map_err(|_| format!("no resistance leads heat away from node `{to}`"))?;
            rises.push((node, rise.into_iter().map(|(_, volts)| volts).collect()));
        }
        Ok(Self { names, cold, rises })
    }

    fn cold(&self, node: NodeId) -> f64 {
        of_node(&self.cold, node)
    }

    /// What a watt at one node does to another.
    fn rise(&self, at: NodeId, from: NodeId) -> f64 {
        let mut rises = self.rises.iter();
        rises
            .find(|(node, _)| *node == from)
            .map_or(0.0, |(_, rise)| of_node(rise, at))
    }

    fn nodes(&self, devices: &[Heated<'_>], power: &DVector<f64>) -> Vec<(String, f64)> {
        let mut all = self.cold.clone();
        for (device, power) in devices.iter().zip(power) {
            let from = self
                .rises
                .iter()
                .find(|(node, _)| Some(*node) == device.case);
            for (t, rise) in all.iter_mut().zip(from.iter().flat_map(|(_, rise)| rise)) {
                *t += rise * power;
            }
        }
        self.names.iter().cloned().zip(all).collect()
    }
}

/// Of values by node without ground.
fn of_node(values: &[f64], node: NodeId) -> f64 {
    node.index().checked_sub(1).map_or(0.0, |k| values[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heated(slope: f64) -> Result<Option<Warm>, String> {
        let mut network = Circuit::named("sink");
        network.resistor("r1", ["hs", "amb"], 0.5);
        network.capacitor("c1", ["hs", "0"], 100.0);
        network.voltage_source("v1", ["amb", "0"], Source::constant(40.0));
        let hs = network.node("hs");
        let mut circuit = Circuit::named("heat");
        circuit.thermal.network = Some(Box::new(network));
        circuit.thermal.ambient = 20.0;
        let device = |case, resistance, watts: f64| Heated {
            case,
            resistance,
            power: Box::new(move |t: f64| {
                (
                    watts + slope * (t - 40.0).max(0.0),
                    if t > 40.0 { slope } else { 0.0 },
                )
            }),
        };
        at_rest(
            &circuit,
            &[
                device(hs, 1.0, 10.0),
                device(hs, 0.0, 20.0),
                device(None, 2.0, 5.0),
            ],
        )
    }

    /// 30 W through 0.5 K/W, 10 W through 1 K/W above that; and 5 W through 2 K/W in the surroundings.
    #[test]
    fn heat_flows_to_the_surroundings() {
        let warm = heated(0.0).expect("a network").expect("temperatures");
        let near =
            |found: f64, truth: f64| assert!((found - truth).abs() < 1e-9, "{found} {truth}");
        [65.0, 55.0, 30.0]
            .into_iter()
            .zip(warm.junctions)
            .for_each(|(truth, t)| near(t, truth));
        assert_eq!(warm.nodes[0].0, "hs");
        near(warm.nodes[0].1, 55.0);
        near(warm.nodes[1].1, 40.0);
    }

    /// With 0.1 W/K more: T₁ = 40 + 1.5 P₁ + 0.5 P₂, T₂ = 40 + 0.5 P₁ + 0.5 P₂.
    #[test]
    fn heat_that_rises_with_temperature_finds_its_place_or_runs_away() {
        let warm = heated(0.1).expect("a network").expect("temperatures");
        let [a, b, _] = warm.junctions[..] else {
            panic!("three devices")
        };
        let (p, q) = (10.0 + 0.1 * (a - 40.0), 20.0 + 0.1 * (b - 40.0));
        assert!((a - 40.0 - 1.5 * p - 0.5 * q).abs() < 1e-9);
        assert!((b - 40.0 - 0.5 * p - 0.5 * q).abs() < 1e-9);
        assert!(heated(1.0).expect("a network").is_none());
    }
}
